//! Convex polygons in a plane, counter-clockwise.

/// The part that two polygons have in common; fewer than three corners where they are apart.
pub fn common_part(a: &[[f64; 2]], b: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut common = a.to_vec();
    for (k, from) in b.iter().enumerate() {
        let to = b[(k + 1) % b.len()];
        let height =
            |p: &[f64; 2]| (to[0] - from[0]) * (p[1] - from[1]) - (to[1] - from[1]) * (p[0] - from[0]);
        let mut kept = Vec::with_capacity(common.len() + 1);
        for (i, start) in common.iter().enumerate() {
            let end = &common[(i + 1) % common.len()];
            let (before, after) = (height(start), height(end));
            if before >= 0.0 {
                kept.push(*start);
            }
            if (before < 0.0) != (after < 0.0) {
                let share = before / (before - after);
                kept.push([0, 1].map(|axis| start[axis] + (end[axis] - start[axis]) * share));
            }
        }
        common = kept;
    }
    common
}

/// Area; zero of fewer than three corners.
pub fn area(polygon: &[[f64; 2]]) -> f64 {
    let Some(first) = polygon.first() else { return 0.0 };
    let from_first = |p: &[f64; 2]| [p[0] - first[0], p[1] - first[1]];
    let triangle = |pair: &[[f64; 2]]| {
        let [p, q] = [from_first(&pair[0]), from_first(&pair[1])];
        0.5 * (p[0] * q[1] - p[1] * q[0])
    };
    polygon.windows(2).map(triangle).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(x: f64, y: f64, side: f64) -> [[f64; 2]; 4] {
        [[x, y], [x + side, y], [x + side, y + side], [x, y + side]]
    }

    #[test]
    fn squares_have_their_overlap_in_common() {
        let whole = square(0.0, 0.0, 2.0);
        assert_eq!(area(&whole), 4.0);
        for (other, expected) in [
            (square(1.0, 0.5, 2.0), 1.5),
            (square(0.5, 0.5, 1.0), 1.0),
            (square(-1.0, -1.0, 9.0), 4.0),
            (square(2.5, 0.0, 1.0), 0.0),
        ] {
            for part in [common_part(&whole, &other), common_part(&other, &whole)] {
                assert!((area(&part) - expected).abs() < 1e-15, "{part:?}");
            }
        }
        // A diamond cuts the corners off.
        let diamond = [[1.0, -0.5], [2.5, 1.0], [1.0, 2.5], [-0.5, 1.0]];
        assert!((area(&common_part(&whole, &diamond)) - 3.5).abs() < 1e-15);
    }
}
