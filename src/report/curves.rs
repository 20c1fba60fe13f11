//! Deviatoric stress and volumetric strain over axial strain (the source's Figure 8), of several runs and of the laboratory.

use crate::error::Result;

use super::axis::{Axis, short};
use super::chart::{Arrangement, Chart, Layer, Panel};
use super::laboratory::LaboratoryCurve;
use super::palette::{BLACK, Colour, Stroke};
use super::run::Run;

/// Greys of measured curves, so that they cannot be taken for computed ones.
const MEASURED: [Colour; 3] = [BLACK, Colour(0x70, 0x70, 0x70), Colour(0x9A, 0x9A, 0x9A)];
/// Radius of the mark of a curve that is a single point.
const LONE: f64 = 6.0;

/// The chart; `None` where no run has strains.
pub fn chart(runs: &[Run], laboratory: &[LaboratoryCurve]) -> Result<Option<Chart>> {
    let stress = Axis::new("deviatoric stress q [MPa]");
    let mut top = Panel::new(Axis::new("axial strain [%]"), stress);
    let mut bottom = Panel::new(Axis::new("axial strain [%]"), Axis::new("volume strain [%], contraction +"));
    bottom.weight = 0.72;
    let mut drawn = false;
    for (number, run) in runs.iter().enumerate().filter(|(_, run)| !run.is_scene()) {
        let shearing = run.shearing()?;
        let stroke = Stroke::of(number);
        let q = joined(&shearing.axial_strain, 100.0, &shearing.deviatoric_stress, 1e-6);
        let volume = joined(&shearing.axial_strain, 100.0, &shearing.volumetric_strain, 100.0);
        drawn |= q.iter().filter(|p| p[0].is_finite() && p[1].is_finite()).count() > 1;
        top.layers.push(Layer::Curve { label: run.label.clone(), points: q.clone(), stroke });
        bottom.layers.push(Layer::Curve { label: run.label.clone(), points: volume, stroke });
        if let Some(peak) = shearing.peak() {
            let (label, points) = (String::new(), vec![q[peak]]);
            top.layers.push(Layer::Points { label, points, colour: stroke.colour, radius: 3.6 });
            if runs.len() == 1 && laboratory.is_empty() {
                let text = format!("{} MPa at {} %", short(q[peak][1]), short(q[peak][0]));
                top.layers.push(Layer::Note { at: q[peak], text, colour: stroke.colour });
            }
        }
    }
    for (number, curve) in laboratory.iter().enumerate() {
        let colour = MEASURED[number % MEASURED.len()];
        // Larger marks where the greys begin anew.
        let radius = 3.0 + 1.5 * (number / MEASURED.len()) as f64;
        for (panel, values, factor) in
            [(&mut top, &curve.deviatoric_stress, 1e-6), (&mut bottom, &curve.volumetric_strain, 100.0)]
        {
            let points = joined(&curve.axial_strain, 100.0, values, factor);
            if points.iter().any(|p| p[1].is_finite()) {
                let stroke = Stroke { width: 0.8, ..Stroke::thin(colour) };
                let line = Layer::Curve { label: String::new(), points: points.clone(), stroke };
                panel.layers.push(line);
                let label = curve.label.clone();
                // A lone point, as of a peak, must not be lost among curves.
                let radius = if points.len() == 1 { LONE } else { radius };
                panel.layers.push(Layer::Points { label, points, colour, radius });
            }
        }
    }
    if !drawn {
        return Ok(None);
    }
    // Room for the peak's note.
    let highest = top.highest();
    if highest > 0.0 {
        top.y.high = Some(1.09 * highest);
    }
    let mut chart = Chart::new("Stress and volume change", vec![top, bottom], Arrangement::Stacked);
    chart.size = [720.0, 600.0];
    Ok(Some(chart))
}

/// Two columns as points, each in its unit.
pub fn joined(x: &[f64], x_factor: f64, y: &[f64], y_factor: f64) -> Vec<[f64; 2]> {
    x.iter().zip(y).map(|(x, y)| [x * x_factor, y * y_factor]).collect()
}
