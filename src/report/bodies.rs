//! Scenes: how bodies move and what acts on them, over progress.

use crate::error::Result;

use super::axis::Axis;
use super::chart::{Arrangement, Chart, Layer, Panel};
use super::palette::Stroke;
use super::run::Run;

/// Curves that one chart holds; of more bodies, those with the largest values.
const MOST: usize = 7;

/// Dataset, name, unit, factor.
const QUANTITIES: [(&str, &str, &str, f64); 3] = [
    ("displacement", "displacement", "mm", 1e3),
    ("force", "contact force", "N", 1.0),
    ("reaction_force", "reaction of what drives or holds", "N", 1.0),
];

/// The charts of a scene, each with the stem of its file and how many bodies it leaves out.
pub fn charts(run: &Run) -> Result<Vec<(&'static str, Chart, usize)>> {
    let mut charts = Vec::new();
    let time = run.column("time")?;
    for (quantity, name, unit, factor) in QUANTITIES {
        let mut found: Vec<(String, Vec<f64>, f64)> = Vec::new();
        for body in &run.summary.bodies {
            let values = run.reader.floats(&format!("bodies/{body}/{quantity}"))?;
            let most = values.iter().map(|x| x.abs()).filter(|x| x.is_finite()).fold(0.0, f64::max);
            found.push((body.clone(), values, most));
        }
        let all = found.iter().map(|(.., most)| *most).fold(0.0, f64::max);
        // What stays at rounding's size has no curve worth drawing.
        found.retain(|(.., most)| *most > 1e-9 * all && *most > 0.0);
        if found.is_empty() || time.len() < 2 {
            continue;
        }
        let left_out = found.len().saturating_sub(MOST);
        let mut largest: Vec<f64> = found.iter().map(|(.., most)| *most).collect();
        largest.sort_by(|a, b| b.total_cmp(a));
        let least = largest[largest.len().min(MOST) - 1];
        found.retain(|(.., most)| *most >= least);
        found.truncate(MOST);
        let (unit, factor) = match unit {
            "N" if all > 2e3 => ("kN", 1e-3),
            "mm" if all < 2e-4 => ("µm", 1e6),
            unit => (unit, factor),
        };
        let panels = ["x", "y", "z"].into_iter().enumerate().map(|(axis, letter)| {
            let mut panel =
                Panel::new(Axis::new("progress [stages]"), Axis::new(format!("{letter} [{unit}]")));
            for (number, (body, values, _)) in found.iter().enumerate() {
                let rows = values.chunks_exact(3).map(|row| factor * row[axis]);
                let points = time.iter().copied().zip(rows).map(|(x, y)| [x, y]).collect();
                panel.layers.push(Layer::Curve { label: body.clone(), points, stroke: Stroke::of(number) });
            }
            panel
        });
        let title = format!("{}{}: {}", name[..1].to_uppercase(), &name[1..], run.label);
        let chart = Chart::new(title, panels.collect(), Arrangement::Stacked, [720.0, 560.0]);
        charts.push((quantity, chart, left_out));
    }
    Ok(charts)
}
