//! Taking nodes out of a triangulated chart: the hole around each is filled with facets between its
//! neighbours, so that the cover spans a pore as a taut sheet would.

use crate::error::{Error, Result};

/// Takes the nodes marked in `drop` out of `facets`, counter-clockwise triangles in a chart that
/// is periodic in its first coordinate. The numbering of the nodes stays.
///
/// # Errors
/// [`Error::Specimen`] where a hole would reach more than a quarter around.
pub(super) fn take_out(
    facets: Vec<[usize; 3]>,
    chart: &[[f64; 2]],
    period: f64,
    drop: &[bool],
) -> Result<Vec<[usize; 3]>> {
    let mut around = vec![vec![]; chart.len()];
    let mut facets: Vec<Option<[usize; 3]>> = facets.into_iter().map(Some).collect();
    for (index, facet) in facets.iter().flatten().enumerate() {
        facet.iter().for_each(|&node| around[node].push(index));
    }
    for node in (0..chart.len()).filter(|&node| drop[node]) {
        let too_wide =
            || Error::Specimen("the cover finds no grain over a quarter of the specimen's side".into());
        let ring = ring_of(node, &around[node], &facets).ok_or_else(too_wide)?;
        let mut outline = Vec::with_capacity(ring.len());
        for &other in &ring {
            let across = chart[other][0] - chart[node][0];
            let across = across - period * (across / period).round();
            if across.abs() > 0.25 * period {
                return Err(too_wide());
            }
            outline.push([across, chart[other][1] - chart[node][1]]);
        }
        let filling = fill(&outline).ok_or_else(too_wide)?;
        for index in std::mem::take(&mut around[node]) {
            for other in facets[index].take().into_iter().flatten().filter(|&other| other != node) {
                around[other].retain(|&f| f != index);
            }
        }
        for corners in filling {
            let facet = corners.map(|k| ring[k]);
            facet.iter().for_each(|&other| around[other].push(facets.len()));
            facets.push(Some(facet));
        }
    }
    Ok(facets.into_iter().flatten().collect())
}

/// The neighbours of `node`, counter-clockwise, or `None` if they do not close.
fn ring_of(node: usize, around: &[usize], facets: &[Option<[usize; 3]>]) -> Option<Vec<usize>> {
    let opposite = |&index: &usize| {
        let facet = facets[index]?;
        let k = facet.iter().position(|&corner| corner == node)?;
        Some([facet[(k + 1) % 3], facet[(k + 2) % 3]])
    };
    let sides = around.iter().map(opposite).collect::<Option<Vec<_>>>()?;
    let mut ring = vec![sides.first()?[0]];
    for _ in 1..sides.len() {
        let last = *ring.last()?;
        ring.push(sides.iter().find(|side| side[0] == last)?[1]);
    }
    let closes = sides.iter().any(|side| side[0] == ring[ring.len() - 1] && side[1] == ring[0]);
    closes.then_some(ring)
}

/// Triangulates a simple polygon, cutting off the best shaped ear first (of equal ones the first).
fn fill(outline: &[[f64; 2]]) -> Option<Vec<[usize; 3]>> {
    let mut left: Vec<usize> = (0..outline.len()).collect();
    let mut filling = Vec::with_capacity(left.len().saturating_sub(2));
    while left.len() > 3 {
        let count = left.len();
        let ear_at = |k: usize| [left[(k + count - 1) % count], left[k], left[(k + 1) % count]];
        let mut best: Option<(f64, usize)> = None;
        for k in 0..count {
            let ear = ear_at(k);
            let shape = shape_of(ear.map(|v| outline[v]));
            let free = |&v: &usize| ear.contains(&v) || !holds(ear.map(|w| outline[w]), outline[v]);
            if shape > FLAT && best.is_none_or(|(found, _)| shape > found + FLAT) && left.iter().all(free) {
                best = Some((shape, k));
            }
        }
        let (_, k) = best?;
        filling.push(ear_at(k));
        left.remove(k);
    }
    let last = [*left.first()?, *left.get(1)?, *left.get(2)?];
    (shape_of(last.map(|v| outline[v])) > FLAT).then_some(())?;
    filling.push(last);
    Some(filling)
}

/// Triangles with a shape measure below this count as having no area.
const FLAT: f64 = 1e-9;

fn twice_area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Twice the area over the sum of squared edges: 0.29 for an equilateral triangle, negative when clockwise.
fn shape_of([a, b, c]: [[f64; 2]; 3]) -> f64 {
    let squared = |p: [f64; 2], q: [f64; 2]| (p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2);
    twice_area(a, b, c) / (squared(a, b) + squared(b, c) + squared(c, a))
}

/// Whether `p` is in the triangle or on its outline. The nodes of a chart lie in rows, so a point on
/// a row must count as on the outline whichever way its rounding went.
fn holds([a, b, c]: [[f64; 2]; 3], p: [f64; 2]) -> bool {
    let outside = -FLAT * twice_area(a, b, c).abs();
    twice_area(a, b, p) >= outside && twice_area(b, c, p) >= outside && twice_area(c, a, p) >= outside
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_concave_outline_is_filled_without_overlap() {
        let outline =
            [[-2.0, -1.0], [0.0, -0.2], [2.0, -1.0], [2.0, 1.0], [1.0, 1.0], [0.0, 0.2], [-2.0, 1.0]];
        let filling = fill(&outline).expect("a simple polygon");
        assert_eq!(filling.len(), outline.len() - 2);
        let whole: f64 = (0..outline.len())
            .map(|k| {
                let (p, q) = (outline[k], outline[(k + 1) % outline.len()]);
                p[0] * q[1] - p[1] * q[0]
            })
            .sum();
        let parts: Vec<f64> =
            filling.iter().map(|f| twice_area(outline[f[0]], outline[f[1]], outline[f[2]])).collect();
        assert!(parts.iter().all(|&area| area > 0.0));
        assert!((parts.iter().sum::<f64>() - whole).abs() < 1e-12);
    }

    #[test]
    fn a_clockwise_or_flat_outline_is_refused() {
        assert_eq!(fill(&[[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]]), None);
        assert_eq!(fill(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]), None);
    }

    #[test]
    fn rows_that_rounding_has_bent_are_still_filled() {
        for bend in [-1e-16, 0.0, 1e-16] {
            let outline = [[-1.0, 0.0], [0.0, bend], [1.0, 0.0], [0.5, 1.0], [0.0, 1.0 - bend], [-0.5, 1.0]];
            let filling = fill(&outline).expect("a trapezium with points on its rows");
            assert!(filling.iter().all(|f| shape_of(f.map(|v| outline[v])) > 0.1), "{filling:?}");
        }
    }
}
