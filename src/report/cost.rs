//! Convergence and cost of every increment: factorisations, augmentations, cuts, out-of-balance force, wall time.

use crate::error::Result;

use super::axis::Axis;
use super::chart::{Arrangement, Chart, Layer, Panel};
use super::curves::joined;
use super::palette::{AXIS, BLACK, Colour, DASHED, GREEN, ORANGE, PURPLE, Stroke};
use super::run::Run;

/// Sums over a run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Cost {
    pub increments: usize,
    pub factorisations: f64,
    pub augmentations: f64,
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
    let points = |values: &[f64]| joined(&increments, 1.0, values, 1.0);
    let dots = |label: &str, values: &[f64], colour: Colour| {
        let (label, points) = (label.to_string(), points(values));
        Layer::Points { label, points, colour, radius: 1.5 }
    };
    let x = || Axis::new("increment").whole();
    let mut work = Panel::new(x(), Axis::new("per increment").from(0.0));
    for (number, name) in ["factorisations", "augmentations"].into_iter().enumerate() {
        let stroke = Stroke { width: 1.4, ..Stroke::of(number) };
        work.layers.push(Layer::Curve { label: name.into(), points: points(&run.column(name)?), stroke });
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
    // Not in a colour of the upper panel's, whose legend this shares.
    balance.layers.push(dots("worst body over mean contact force", &run.column("out_of_balance")?, GREEN));
    let asked = |key: &str| run.case.pointer(key).and_then(|value| value.as_f64());
    // Files of older versions have no unrest, those of a press only zeros.
    let unrest = run.column("unrest").ok().filter(|unrest| unrest.iter().any(|unrest| *unrest > 0.0));
    let moves = asked("/solver/stabilisation").filter(|_| unrest.is_some());
    if let Some(unrest) = unrest {
        balance.layers.push(dots("mean of all bodies (unrest)", &unrest, PURPLE));
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
    time.layers.push(dots("wall time of the increment", &each, ORANGE));
    let title = format!("Convergence and cost: {}", run.label);
    Ok(Some(Chart::new(title, vec![work, balance, time], Arrangement::Stacked, [720.0, 560.0])))
}
