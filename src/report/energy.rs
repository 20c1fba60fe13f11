//! Where the work goes: shares of the energies in the external work over axial strain (the source's Figure 9), over
//! the strain travelled where a test unloads, or, for scenes, over progress.

use crate::error::Result;

use super::axis::{Axis, short};
use super::chart::{Arrangement, Chart, Layer, Panel};
use super::palette::{AXIS, BLUE, Colour, DASHED, GREY, ORANGE, PURPLE, SKY, Stroke, VERMILLION};
use super::run::Run;

/// Dataset, name and colour from the bottom of the stack to its top; neighbours differ in lightness.
pub const PARTS: [(&str, &str, Colour); 6] = [
    ("energy_elastic", "elastic", BLUE),
    ("energy_friction", "friction", ORANGE),
    ("energy_crushing_contacts", "crushing at contacts", PURPLE),
    // Without the part before, which `/history` counts in.
    ("energy_damage", "damage", VERMILLION),
    ("energy_stabilisation", "stabilisation", GREY),
    ("energy_membrane", "membrane", SKY),
];

/// Less than this share of the largest external work is too little to divide by.
const STARTED: f64 = 1e-4;

/// The stack of one run over its abscissa.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Stack {
    /// Axial strain, or that travelled [%], or progress; never falls.
    pub abscissa: Vec<f64>,
    /// Whether strains of unloading count as well, since the strain itself goes back there.
    pub travelled: bool,
    /// Upper ends of the parts [%], in the order of [`PARTS`]: each adds to the one below.
    pub tops: [Vec<f64>; PARTS.len()],
    /// What negative parts would take away and the stack does not show [%], at worst.
    pub hidden: f64,
    /// Largest energy error over the largest external work.
    pub error: f64,
    /// External work at the end [J].
    pub external: f64,
}

/// Shares of the parts in the external work.
pub fn stack(run: &Run) -> Result<Stack> {
    let (rows, (abscissa, travelled)) = match run.is_scene() {
        true => ((0..run.rows).collect(), (run.column("time")?, false)),
        false => {
            let shearing = run.shearing()?;
            let strain: Vec<f64> = shearing.curve.axial_strain.iter().map(|strain| 100.0 * strain).collect();
            (shearing.rows, forwards(strain))
        }
    };
    let external = run.column("energy_external")?;
    let parts = PARTS.map(|(name, ..)| run.column(name));
    let [elastic, friction, crushing, damage, stabilisation, membrane] = parts;
    let (crushing, mut damage) = (crushing?, damage?);
    for (damage, crushing) in damage.iter_mut().zip(&crushing).filter(|(_, crushing)| crushing.is_finite()) {
        *damage -= crushing;
    }
    let parts = [elastic?, friction?, crushing, damage, stabilisation?, membrane?];
    let error = run.column("energy_error")?;
    Ok(Stack { travelled, ..stacked(&rows, &abscissa, &external, &parts, &error) })
}

/// A strain that goes back, by more than a loaded plate's trembling, as the strain travelled; whether it was.
fn forwards(strain: Vec<f64>) -> (Vec<f64>, bool) {
    const BACK: f64 = 1e-3;
    let span = |values: &[f64]| values.iter().copied().fold(0.0, |m: f64, x| m.max(x.abs()));
    let back: f64 = strain.windows(2).map(|pair| (pair[0] - pair[1]).max(0.0)).sum();
    let goes_back = back > BACK * span(&strain);
    let mut way = 0.0;
    let mut path = Vec::with_capacity(strain.len());
    let mut before = 0.0;
    for now in strain {
        way = if goes_back { way + (now - before).abs() } else { now.max(way) };
        before = now;
        path.push(way);
    }
    (path, goes_back)
}

fn stacked(
    rows: &[usize],
    abscissa: &[f64],
    external: &[f64],
    parts: &[Vec<f64>; PARTS.len()],
    error: &[f64],
) -> Stack {
    let largest =
        |values: &[f64]| values.iter().map(|x| x.abs()).filter(|x| x.is_finite()).fold(0.0, f64::max);
    let most = largest(external);
    let mut stack = Stack {
        external: rows.last().map_or(f64::NAN, |&row| external[row]),
        error: largest(error) / most,
        ..Stack::default()
    };
    for (&row, &x) in rows.iter().zip(abscissa) {
        let work = external[row];
        if !(work > STARTED * most && x.is_finite()) {
            continue;
        }
        stack.abscissa.push(x);
        let (mut top, mut hidden) = (0.0, 0.0);
        for (part, tops) in parts.iter().zip(&mut stack.tops) {
            let share = 100.0 * part[row] / work;
            // A part that is not there (NaN) or that a spring gave back has no height.
            if share > 0.0 {
                top += share;
            } else if share < 0.0 {
                hidden -= share;
            }
            tops.push(top);
        }
        stack.hidden = stack.hidden.max(hidden);
    }
    stack
}

/// One panel a run; `None` where no run has done work.
pub fn chart(runs: &[&Run]) -> Result<Option<Chart>> {
    let mut panels = Vec::new();
    for run in runs {
        let stack = stack(run)?;
        if stack.abscissa.len() < 2 {
            continue;
        }
        let x = match (run.is_scene(), stack.travelled) {
            (true, _) => "progress [stages]",
            (false, true) => "axial strain travelled, unloading included [%]",
            (false, false) => "axial strain [%]",
        };
        let mut panel = Panel::new(Axis::new(x), Axis::new("share of the external work [%]").from(0.0));
        if runs.len() > 1 {
            panel.title = run.label.clone();
        }
        let points = |heights: &[f64]| stack.abscissa.iter().zip(heights).map(|(x, y)| [*x, *y]).collect();
        let mut low = vec![0.0; stack.abscissa.len()];
        for ((_, name, colour), high) in PARTS.iter().zip(&stack.tops) {
            // What never reaches a thousandth would only crowd the legend.
            if high.iter().zip(&low).any(|(high, low)| high - low > 0.1) {
                panel.layers.push(Layer::Band {
                    label: name.to_string(),
                    low: points(&low),
                    high: points(high),
                    colour: *colour,
                });
            }
            low.clone_from(high);
        }
        let stroke = Stroke { dash: DASHED, ..Stroke::thin(AXIS) };
        panel.layers.push(Layer::Level { label: "external work".into(), value: 100.0, stroke });
        panels.push(panel);
    }
    if panels.is_empty() {
        return Ok(None);
    }
    let columns = panels.len().min(2);
    let rows = panels.len().div_ceil(columns);
    let size = [if columns == 1 { 720.0 } else { 960.0 }, 400.0 * rows as f64];
    Ok(Some(Chart::new("Where the work goes", panels, Arrangement::Beside(columns), size)))
}

/// Energy that no part accounts for, over the work, below which nothing is to be done: mean stresses are off by no more than that, and the size of
/// increments changes them by more.
pub const SOUND: f64 = 0.01;

/// One line on the ledger of a run.
pub fn remark(stack: &Stack) -> String {
    let judged = match stack.error {
        error if error < SOUND => format!("below {} % is sound", short(100.0 * SOUND)),
        _ => "distrust mean stresses by as much; smaller increments close it better".into(),
    };
    let mut text = format!(
        "External work {} J, of which {} % at most is unaccounted for: {judged}.",
        short(stack.external),
        short(100.0 * stack.error)
    );
    if stack.hidden > 0.1 {
        text.push_str(&format!(
            " Parts below zero (up to {} %) are not drawn, so that the stack stands that much too high.",
            short(stack.hidden)
        ));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strains_that_go_back_are_travelled() {
        assert_eq!(forwards(vec![0.0, 1.0, 2.0]), (vec![0.0, 1.0, 2.0], false));
        // A loaded plate that trembles stays where it is.
        assert!(!forwards(vec![0.0, 2.0, 1.9999, 3.0]).1);
        assert_eq!(forwards(vec![0.0, 1.0, 0.5, 2.0]), (vec![0.0, 1.0, 1.5, 3.0], true));
    }

    #[test]
    fn shares_add_up_to_what_is_booked() {
        let [rises, falls] = [vec![0.0, 1.0, 5.0], vec![0.0, 0.5, -1.0]];
        let parts = [vec![1.0, 2.0, 3.0], rises, vec![f64::NAN; 3], vec![0.0; 3], falls, vec![f64::NAN; 3]];
        let external = [1e-9, 4.0, 8.0];
        let error = [0.0, 0.4, 0.2];
        let stack = stacked(&[0, 1, 2], &[0.0, 0.5, 1.0], &external, &parts, &error);
        // The first row has done no work worth the name.
        assert_eq!(stack.abscissa, [0.5, 1.0]);
        assert_eq!(stack.tops[0], [50.0, 37.5]);
        assert_eq!(stack.tops[1], [75.0, 100.0]);
        assert_eq!(stack.tops[5], [87.5, 100.0]);
        assert_eq!((stack.hidden, stack.error, stack.external), (12.5, 0.05, 8.0));
        assert!(remark(&stack).contains("5 % at most is unaccounted for: distrust mean stresses"));
        let sound = Stack { error: 3.5e-4, hidden: 0.0, ..stack };
        assert_eq!(
            remark(&sound),
            "External work 8 J, of which 0.035 % at most is unaccounted for: below 1 % is sound."
        );
    }
}
