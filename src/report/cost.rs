//! Convergence and cost of every increment: factorisations, augmentations, cuts, out-of-balance force, wall time.

use crate::error::Result;

use super::axis::Axis;
use super::chart::{Arrangement, Chart, Layer, Panel};
use super::palette::{AXIS, BLACK, DASHED, GREEN, ORANGE, PURPLE, Stroke};
use super::run::Run;

/// Sums over a run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Cost {
    pub increments: usize,
    pub factorisations: f64,
    pub augmentations: f64,
    pub newton_iterations: f64,
    pub cuts: f64,
    /// Of the whole run, specimen included [s].
    pub wall_time: f64,
    /// Worst accepted increment.
    pub out_of_balance: f64,
}

impl Cost {
    pub fn of(run: &Run) -> Result<Cost> {
        let sum = |name: &str| -> Result<f64> { Ok(run.column(name)?.iter().sum()) };
        let balance = run.column("out_of_balance")?;
        Ok(Cost {
            increments: run.rows,
            factorisations: sum("factorisations")?,
            augmentations: sum("augmentations")?,
            newton_iterations: sum("newton_iterations")?,
            cuts: sum("cuts")?,
            wall_time: run.column("wall_time")?.last().copied().unwrap_or(f64::NAN),
            out_of_balance: balance.into_iter().filter(|x| x.is_finite()).fold(0.0, f64::max),
        })
    }
}

/// The chart of one run; `None` without increments.
pub fn chart(run: &Run) -> Result<Option<Chart>> {
    if run.rows < 2 {
        return Ok(None);
    }
    let increments = run.column("increment")?;
    let points =
        |values: &[f64]| -> Vec<[f64; 2]> { increments.iter().zip(values).map(|(x, y)| [*x, *y]).collect() };
    let x = || Axis::new("increment").whole();
    let mut work = Panel::new(x(), Axis::new("per increment").from(0.0));
    let thin = |mut stroke: Stroke| {
        stroke.width = 1.4;
        stroke
    };
    for (number, name) in ["factorisations", "augmentations"].into_iter().enumerate() {
        let points = points(&run.column(name)?);
        work.layers.push(Layer::Curve { label: name.into(), points, stroke: thin(Stroke::of(number)) });
    }
    let (factorisations, cuts) = (run.column("factorisations")?, run.column("cuts")?);
    let cut: Vec<[f64; 2]> = points(&factorisations)
        .into_iter()
        .zip(&cuts)
        .filter(|(_, cuts)| **cuts > 0.0)
        .map(|(point, _)| point)
        .collect();
    if !cut.is_empty() {
        let label = "was cut before it was accepted".into();
        work.layers.push(Layer::Points { label, points: cut, colour: BLACK, radius: 3.2 });
    }
    work.weight = 1.3;

    let mut balance = Panel::new(x(), Axis::new("out of balance [1]").logarithmic());
    balance.layers.push(Layer::Points {
        label: "worst body over mean contact force".into(),
        points: points(&run.column("out_of_balance")?),
        // Not one of the upper panel's, whose legend this shares.
        colour: GREEN,
        radius: 1.5,
    });
    let asked = |key: &str| run.case.pointer(key).and_then(|value| value.as_f64());
    // Files of older versions have no unrest, those of a press only zeros.
    let unrest = run.column("unrest").ok().filter(|unrest| unrest.iter().any(|unrest| *unrest > 0.0));
    let moves = asked("/solver/stabilisation").filter(|_| unrest.is_some());
    if let Some(unrest) = unrest {
        let label = "mean of all bodies (unrest)".into();
        balance.layers.push(Layer::Points { label, points: points(&unrest), colour: PURPLE, radius: 1.5 });
    }
    let level = moves.map(|value| ("solver.stabilisation", value));
    if let Some((label, value)) =
        level.or(asked("/solver/force_tolerance").map(|value| ("its tolerance", value)))
    {
        let stroke = Stroke { dash: DASHED, ..Stroke::thin(AXIS) };
        balance.layers.push(Layer::Level { label: label.into(), value, stroke });
    }

    let seconds = run.column("wall_time")?;
    // The first row's time includes the specimen.
    let each: Vec<f64> = std::iter::once(f64::NAN)
        .chain(seconds.windows(2).map(|pair| pair[1] - pair[0]))
        .map(|seconds| if seconds > 0.0 { seconds } else { f64::NAN })
        .collect();
    let mut time = Panel::new(x(), Axis::new("wall time [s]").logarithmic());
    time.layers.push(Layer::Points {
        label: "wall time of the increment".into(),
        points: points(&each),
        colour: ORANGE,
        radius: 1.5,
    });
    let mut chart = Chart::new(
        format!("Convergence and cost: {}", run.label),
        vec![work, balance, time],
        Arrangement::Stacked,
    );
    chart.size = [720.0, 560.0];
    Ok(Some(chart))
}
