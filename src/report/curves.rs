//! Deviatoric stress and volumetric strain over axial strain (the source's Figure 8), of several runs and of the laboratory.

use crate::error::Result;

use super::axis::{Axis, short};
use super::chart::{Arrangement, Chart, Layer, Panel};
use super::laboratory::LaboratoryCurve;
use super::palette::{BLACK, Colour, Stroke};
use super::run::{Largest, Run};

/// Greys of measured curves, so that they cannot be taken for computed ones.
const MEASURED: [Colour; 4] =
    [BLACK, Colour(0x52, 0x52, 0x52), Colour(0x80, 0x80, 0x80), Colour(0xA8, 0xA8, 0xA8)];
/// Radius of the mark of a curve that is a single point.
const LONE: f64 = 6.0;
/// A table of more points than this is a line with marks to tell it by, half as many at most.
const MANY: usize = 24;

/// The chart; `None` where no run has strains.
pub fn chart(runs: &[Run], laboratory: &[LaboratoryCurve]) -> Result<Option<Chart>> {
    let stress = Axis::new("deviatoric stress q [MPa]");
    let mut top = Panel::new(Axis::new("axial strain [%]"), stress);
    let mut bottom = Panel::new(Axis::new("axial strain [%]"), Axis::new("volume strain [%], contraction +"));
    bottom.weight = 0.72;
    let mut drawn = false;
    for (number, run) in runs.iter().enumerate().filter(|(_, run)| !run.is_scene()) {
        let curve = run.shearing()?.into_curve();
        let stroke = Stroke::of(number);
        let q = joined(&curve.axial_strain, 100.0, &curve.deviatoric_stress, 1e-6);
        let volume = joined(&curve.axial_strain, 100.0, &curve.volumetric_strain, 100.0);
        drawn |= q.iter().filter(|p| p[0].is_finite() && p[1].is_finite()).count() > 1;
        top.layers.push(Layer::Curve { label: run.label.clone(), points: q.clone(), stroke });
        bottom.layers.push(Layer::Curve { label: run.label.clone(), points: volume, stroke });
        if let Some((at, largest)) = curve.largest() {
            let [strain, stress] = q[at];
            if largest == Largest::Peak {
                let (label, points) = (String::new(), vec![q[at]]);
                top.layers.push(Layer::Points { label, points, colour: stroke.colour, radius: 3.6 });
            }
            if runs.len() == 1 && laboratory.is_empty() {
                let text = format!("{} MPa at {} %{}", short(stress), short(strain), largest.remark());
                top.layers.push(Layer::Note { at: q[at], text, colour: stroke.colour });
            }
        }
    }
    let reach = Reach::of(&top, laboratory);
    let mut counts = [0, 0];
    for curve in laboratory {
        // Lone points and curves take their greys apart.
        let count = &mut counts[usize::from(curve.axial_strain.len() > 1)];
        let number = *count;
        *count += 1;
        let colour = MEASURED[number % MEASURED.len()];
        // Larger marks where the greys begin anew.
        let radius = 3.0 + 1.5 * (number / MEASURED.len()) as f64;
        for (panel, values, factor) in
            [(&mut top, &curve.deviatoric_stress, 1e-6), (&mut bottom, &curve.volumetric_strain, 100.0)]
        {
            // A quantity's line joins its own points, whatever was read between them.
            let mut all = joined(&curve.axial_strain, 100.0, values, factor);
            all.retain(|point| point.iter().all(|x| x.is_finite()));
            let (line, points) = reach.cut(&all);
            if points.is_empty() {
                continue;
            }
            let stroke = Stroke { width: 1.2, ..Stroke::thin(colour) };
            // Cut so short that no mark tells it, the line does.
            let (name, label) = match points.len() < 2 && line.len() > points.len() {
                true => (curve.label.clone(), String::new()),
                false => (String::new(), curve.label.clone()),
            };
            panel.layers.push(Layer::Curve { label: name, points: line, stroke });
            // A lone point, as of a peak, must not be lost among curves.
            let radius = if all.len() == 1 { LONE } else { radius };
            let points = marks(points, number);
            panel.layers.push(Layer::Points { label, points, colour, radius });
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
    top.x.high = reach.end;
    let title = match reach.end {
        None => "Stress and volume change".to_string(),
        Some(_) => {
            format!("Stress and volume change; the laboratory's go on to {} %", short(reach.laboratory))
        }
    };
    Ok(Some(Chart::new(title, vec![top, bottom], Arrangement::Stacked, [720.0, 600.0])))
}

/// How far the abscissa goes [%].
struct Reach {
    /// Where it ends; `None` for where the data do.
    end: Option<f64>,
    /// The laboratory's largest strain.
    laboratory: f64,
}

impl Reach {
    /// Runs that end early must not be lost in a corner of what was measured.
    fn of(runs: &Panel, laboratory: &[LaboratoryCurve]) -> Reach {
        const FARTHER: f64 = 3.0;
        const SHOWN: f64 = 1.5;
        let most = |values: Vec<f64>| values.into_iter().filter(|x| x.is_finite()).fold(0.0, f64::max);
        let run = most(runs.values(0));
        let measured = 100.0 * most(laboratory.iter().flat_map(|c| c.axial_strain.iter().copied()).collect());
        let end = (run > 0.0 && measured > FARTHER * run).then_some(SHOWN * run);
        Reach { end, laboratory: measured }
    }

    /// A measured curve's line as far as the abscissa goes, and those of its points that are there.
    fn cut(&self, points: &[[f64; 2]]) -> (Vec<[f64; 2]>, Vec<[f64; 2]>) {
        let end = self.end.unwrap_or(f64::INFINITY);
        let inside: Vec<[f64; 2]> = points.iter().copied().take_while(|p| p[0] <= end).collect();
        let mut line = inside.clone();
        if let (Some([x, y]), Some([beyond, there])) = (inside.last(), points.get(inside.len())) {
            line.push([end, y + (there - y) * (end - x) / (beyond - x)]);
        }
        (line, inside)
    }
}

/// What the strains of a chart count from.
pub fn caption(runs: &[Run]) -> Result<String> {
    let (mut behind, mut from_start) = (0, Vec::new());
    for run in runs.iter().filter(|run| !run.is_scene()) {
        match run.shearing()?.behind_consolidation {
            true => behind += 1,
            false => from_start.push(run.label.as_str()),
        }
    }
    let of = match (behind, &from_start[..]) {
        (_, []) => "the end of the consolidation".to_string(),
        (0, _) => "the start of the run".to_string(),
        (_, runs) => {
            format!("the end of the consolidation; those of {} from the start of the run", runs.join(", "))
        }
    };
    Ok(format!("Strains count from {of}; compression and contraction are positive."))
}

/// The points of a curve that get a mark: all of a few; else some, not where its neighbours' are.
fn marks(points: Vec<[f64; 2]>, number: usize) -> Vec<[f64; 2]> {
    if points.len() <= MANY {
        return points;
    }
    let step = points.len().div_ceil(MANY / 2);
    points.into_iter().skip((number * step / MEASURED.len()) % step).step_by(step).collect()
}

/// Two columns as points, each in its unit.
pub fn joined(x: &[f64], x_factor: f64, y: &[f64], y_factor: f64) -> Vec<[f64; 2]> {
    x.iter().zip(y).map(|(x, y)| [x * x_factor, y * y_factor]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measured_curves_end_where_runs_are_seen() {
        let mut panel = Panel::new(Axis::new("x"), Axis::new("y"));
        let (label, points) = (String::new(), vec![[0.0, 0.0], [0.5, 1.0]]);
        panel.layers.push(Layer::Curve { label, points, stroke: Stroke::of(0) });
        let laboratory =
            |most: f64| [LaboratoryCurve { axial_strain: vec![0.0, most], ..LaboratoryCurve::default() }];
        assert_eq!(Reach::of(&panel, &laboratory(0.014)).end, None);
        let reach = Reach::of(&panel, &laboratory(0.15));
        assert_eq!((reach.end, reach.laboratory), (Some(0.75), 15.0));
        let (line, points) = reach.cut(&[[0.0, 0.0], [0.5, 1.0], [1.0, 2.0], [15.0, 3.0]]);
        assert_eq!(points, [[0.0, 0.0], [0.5, 1.0]]);
        assert_eq!(line, [[0.0, 0.0], [0.5, 1.0], [0.75, 1.5]]);
        assert_eq!(reach.cut(&[[11.6, 3.5]]), (vec![], vec![]));
    }

    #[test]
    fn measured_points_are_all_marked_and_dense_tables_here_and_there() {
        let line = |count: usize| (0..count).map(|k| [k as f64, 1.0]).collect::<Vec<_>>();
        assert_eq!(marks(line(MANY), 3), line(MANY));
        for number in 0..6 {
            let found = marks(line(200), number);
            assert!((11..=12).contains(&found.len()), "{}", found.len());
        }
        assert_ne!(marks(line(200), 0)[0], marks(line(200), 1)[0]);
    }
}
