//! Gradings: mass passing over sieve size, asked, achieved and, where grains broke, after the test.
//!
//! What broke is read from `/breakage/grading`: `size` [m] with the shares of the mass finer than it, `passing_before` and
//! `passing_after` [1]. Those sizes are of square openings; a generated grain's own is the intermediate diameter of its
//! ellipsoid, so that the two need not agree.

use crate::error::Result;
use crate::results::Reader;

use super::axis::Axis;
use super::chart::{Arrangement, Chart, Layer, Panel};
use super::palette::{BLACK, BLUE, FULL, GREEN, Stroke, VERMILLION};
use super::run::Run;

const BEFORE: &str = "before the test, square openings";
const AFTER: &str = "after the test, square openings";

/// Sieve size [m] and the share of the mass that passes, from the finest to the coarsest.
pub type Grading = Vec<[f64; 2]>;

/// The gradings of a run, each with its name; none for scenes.
pub fn gradings(run: &Run) -> Result<Vec<(&'static str, Grading)>> {
    let mut found = Vec::new();
    if let Some(asked) = run.case.pointer("/specimen/grading").and_then(|value| value.as_array()) {
        let mut points: Grading = asked
            .iter()
            .filter_map(|point| Some([point.get(0)?.as_f64()?, point.get(1)?.as_f64()?]))
            .collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        found.push(("asked", points));
    }
    let reader = &run.reader;
    if reader.has("grains/sieve_size") && reader.has("grains/mass") {
        let (sizes, masses) = (reader.floats("grains/sieve_size")?, reader.floats("grains/mass")?);
        found.push(("achieved", passing(&sizes, &masses)));
    }
    // "Before" on top: dashed, it leaves the other to be seen where the two agree.
    for (name, title) in [("passing_after", AFTER), ("passing_before", BEFORE)] {
        if let Some(points) = broken(reader, name)? {
            found.push((title, points));
        }
    }
    Ok(found)
}

fn broken(reader: &Reader, name: &str) -> Result<Option<Grading>> {
    let place = format!("breakage/grading/{name}");
    if !reader.has("breakage/grading/size") || !reader.has(&place) {
        return Ok(None);
    }
    let (sizes, shares) = (reader.floats("breakage/grading/size")?, reader.floats(&place)?);
    let mut points: Grading = sizes.into_iter().zip(shares).map(|(size, share)| [size, share]).collect();
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    Ok(Some(points))
}

/// Indices of breakage that the file has, each with its name.
pub fn indices(run: &Run) -> Result<Vec<(&'static str, f64)>> {
    let mut found = Vec::new();
    for (dataset, name) in [
        ("marsal", "Marsal's B_g"),
        ("hardin", "Hardin's B_r"),
        ("einav", "Einav's B"),
        ("crushed_share", "crushed share of the solids"),
        ("fragments", "fragments"),
    ] {
        let place = format!("breakage/{dataset}");
        if run.reader.has(&place)
            && let Some(&value) = run.reader.floats(&place)?.first()
        {
            found.push((name, value));
        }
    }
    Ok(found)
}

/// Mass passing over size of grains, each grain a step: at its size all of it has passed.
fn passing(sizes: &[f64], masses: &[f64]) -> Grading {
    let mut grains: Vec<(f64, f64)> = sizes.iter().copied().zip(masses.iter().copied()).collect();
    grains.retain(|(size, mass)| size.is_finite() && mass.is_finite());
    grains.sort_by(|a, b| a.0.total_cmp(&b.0));
    let all: f64 = grains.iter().map(|(_, mass)| mass).sum();
    let mut below = 0.0;
    let mut points = Vec::new();
    for (size, mass) in grains {
        points.push([size, below / all]);
        below += mass;
        points.push([size, below / all]);
    }
    points
}

/// The part of a grading that is worth an abscissa: from the last size that not a hundredth more passes than the finest.
fn shown(points: &[[f64; 2]]) -> &[[f64; 2]] {
    let risen = points.iter().position(|point| point[1] > points[0][1] + 0.01);
    &points[risen.map_or(0, |at| at - 1)..]
}

/// The chart of one run; `None` where there is no grading.
pub fn chart(run: &Run) -> Result<Option<Chart>> {
    let gradings = gradings(run)?;
    if gradings.iter().all(|(_, points)| points.len() < 2) {
        return Ok(None);
    }
    let y = Axis::new("finer by mass [%]").from(0.0).to(100.0);
    let mut panel = Panel::new(Axis::new("sieve size [mm]").logarithmic(), y);
    for (name, points) in gradings {
        let stroke = match name {
            "asked" => Stroke { width: 4.0, ..Stroke::thin(super::palette::GREY) },
            "achieved" => Stroke { colour: BLUE, width: 1.6, dash: FULL },
            BEFORE => Stroke { colour: GREEN, width: 2.0, dash: super::palette::DASHED },
            AFTER => Stroke { colour: VERMILLION, width: 2.0, dash: FULL },
            _ => Stroke::thin(BLACK),
        };
        let points = shown(&points).iter().map(|[size, share]| [1e3 * size, 100.0 * share]).collect();
        panel.layers.push(Layer::Curve { label: name.into(), points, stroke });
    }
    let title = format!("Grading: {}", run.label);
    Ok(Some(Chart::new(title, vec![panel], Arrangement::Stacked, [720.0, 360.0])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mass_passes_grain_by_grain() {
        let points = passing(&[0.06, 0.02, 0.04], &[3.0, 1.0, 4.0]);
        assert_eq!(points[0], [0.02, 0.0]);
        assert_eq!(points[1], [0.02, 0.125]);
        assert_eq!(points[3], [0.04, 0.625]);
        assert_eq!(points[5], [0.06, 1.0]);
    }

    #[test]
    fn gradings_begin_where_they_rise() {
        let points = [[1e-4, 0.1], [1e-3, 0.105], [1e-2, 0.109], [2e-2, 0.3], [4e-2, 1.0]];
        assert_eq!(shown(&points), &points[2..]);
        assert_eq!(shown(&points[3..]), &points[3..]);
        assert_eq!(shown(&[[0.04, 1.0], [0.06, 1.0]]).len(), 2);
        assert!(shown(&[]).is_empty());
    }
}
