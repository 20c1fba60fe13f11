//! The specimen in three dimensions on the page: what it is made of, state by state, as the script beside it ([`SCRIPT`]) wants it.
//!
//! Shown are the facets that one cell of a piece alone has, so a grain that came apart shows its faces of fracture between pieces that moved apart.
//! Places are 16-bit shares of the box that holds all states: 2 um in a specimen of 130 mm. Forces are those between grains, pair by pair, over
//! their mean; those below it are left out.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use crate::error::Result;
use crate::results::{ContactPair, SavedCells, SavedState};

use super::axis::short;
use super::palette::{HEAT, VIRIDIS};
use super::run::Run;

pub const SCRIPT: &str = include_str!("viewer.js");
/// Most bytes of places in a page, coded: with more, states are left out evenly, but for the end of the consolidation.
const MOST: usize = 12_000_000;

/// A view: the script's data, its caption, and whether there are forces and damage to show.
pub struct View {
    pub data: Value,
    pub caption: String,
    pub has_forces: bool,
    pub has_damage: bool,
}

/// What is seen of the cells: the same in all states.
struct Outside {
    /// Nodes whose places are kept.
    nodes: Vec<usize>,
    /// Three corners a triangle, in `nodes`.
    corners: Vec<u32>,
    owners: Vec<i32>,
    /// The cell of each triangle.
    cells: Vec<usize>,
}

/// The view of a run; `None` where no state was saved or nothing has a surface.
pub fn view(run: &Run) -> Result<Option<View>> {
    let all = run.reader.saved_states()?;
    let Some(last) = all.len().checked_sub(1) else { return Ok(None) };
    let cells = run.reader.saved_cells()?;
    let pieces = run.reader.saved_field("CellData", "fragment", last)?;
    let outside = Outside::of(&cells, &pieces);
    if outside.corners.is_empty() {
        return Ok(None);
    }
    let bytes = outside.nodes.len() * 6 * 4 / 3;
    let leading = run.leading_consolidations();
    let states = shown(&all, leading, MOST / bytes.max(1));
    let (mut places, mut damage, mut labels) = (Vec::new(), Vec::new(), Vec::new());
    for &state in &states {
        let points = run.reader.saved_points(&cells, state)?;
        places.extend(outside.nodes.iter().map(|&node| points[node]));
        let values = run.reader.saved_field("CellData", "damage", state)?;
        let share =
            |cell: &usize| values.get(*cell).copied().filter(|value| value.is_finite()).unwrap_or(0.0);
        damage.extend(outside.cells.iter().map(|cell| (255.0 * share(cell).clamp(0.0, 1.0)).round() as u8));
        labels.push(label(run, all[state].increment)?);
    }
    let (low, high) = places.iter().fold((places[0], places[0]), |(low, high), p| (low.inf(p), high.sup(p)));
    let quantised = places.iter().flat_map(|p| {
        [0, 1, 2].map(|k| (65535.0 * (p[k] - low[k]) / (high[k] - low[k]).max(1e-30)).round() as u16)
    });
    let coded = |bytes: Vec<u8>| STANDARD.encode(&bytes);
    let (lines, forces) = lines(run, &states)?;
    let reference = states.iter().position(|&state| is_behind(&all[state], leading));
    let reference = reference.filter(|&at| at + 1 < states.len()).unwrap_or(0);
    let has_forces = forces.iter().any(|forces| !forces.is_empty());
    let has_damage = damage.iter().any(|&value| value > 0);
    let data = json!({
        "corner_count": outside.nodes.len(),
        "low": <[f64; 3]>::from(low), "high": <[f64; 3]>::from(high),
        "places": coded(quantised.flat_map(u16::to_le_bytes).collect()),
        "corners": coded(outside.corners.iter().flat_map(|c| c.to_le_bytes()).collect()),
        "owners": coded(outside.owners.iter().flat_map(|o| o.to_le_bytes()).collect()),
        "damage": coded(damage),
        "labels": labels, "reference": reference, "lines": lines, "forces": forces,
        "displacement_colours": VIRIDIS, "damage_colours": HEAT,
    });
    let mut caption =
        "Drag to turn, shift and wheel or two fingers to zoom; the slider goes through the saved states"
            .to_string();
    if states.len() < all.len() {
        caption += &format!(" ({} of {}, to keep the page small)", states.len(), all.len());
    }
    caption += ". Displacement counts from ";
    caption += if reference > 0 { "the end of the consolidation." } else { "the first state shown." };
    if has_forces {
        caption += " Forces: between the centres of grains that touch, those above the mean of their state, as thick as they are large.";
    }
    if has_damage {
        caption += " Cells that failed stay in sight, at damage 1.";
    }
    Ok(Some(View { data, caption, has_forces, has_damage }))
}

/// Whether a state is the end of the leading consolidation, or comes behind it.
fn is_behind(state: &SavedState, leading: usize) -> bool {
    state.time >= leading as f64 - 1e-9
}

/// The states to show, about `most`: every so many up to the last, and the end of the consolidation, from which displacements count.
fn shown(all: &[SavedState], leading: usize, most: usize) -> Vec<usize> {
    let Some(last) = all.len().checked_sub(1) else { return Vec::new() };
    let step = last.div_ceil(most.clamp(2, all.len().max(2)) - 1).max(1);
    let consolidated = match leading {
        0 => None,
        _ => all.iter().position(|state| is_behind(state, leading)),
    };
    let is_shown = |state: &usize| (last - state).is_multiple_of(step) || Some(*state) == consolidated;
    (0..all.len()).filter(is_shown).collect()
}

impl Outside {
    /// `pieces`: the number of the body that each cell is on in the end.
    fn of(cells: &SavedCells, pieces: &[f64]) -> Outside {
        let piece = |cell: usize| pieces.get(cell).map_or(-1, |piece| *piece as i64);
        let places = cells.places();
        let mut numbers = BTreeMap::new();
        let mut kept = Outside { nodes: vec![], corners: vec![], owners: vec![], cells: vec![] };
        for (nodes, cell) in cells.outside(|cell| (cells.grain[cell] >= 0).then(|| piece(cell))) {
            kept.corners.extend(nodes.map(|node| {
                // The same place in the same piece is the same corner.
                *numbers.entry((piece(cell), places[node])).or_insert_with(|| {
                    kept.nodes.push(node);
                    kept.nodes.len() as u32 - 1
                })
            }));
            kept.owners.push(cells.grain[cell] as i32);
            kept.cells.push(cell);
        }
        kept
    }
}

/// Ends [m] of the bars of each state, and their forces over the mean.
type Bars = (Vec<Vec<f64>>, Vec<Vec<f64>>);

fn lines(run: &Run, states: &[usize]) -> Result<Bars> {
    let (mut ends, mut sizes) = (Vec::new(), Vec::new());
    let places = match run.reader.has("grains/position") {
        true => run.reader.floats("grains/position")?,
        false => Vec::new(),
    };
    let grains = run.summary.grains;
    for &state in states {
        let group = format!("contacts/{state}");
        let (mut line, mut force) = (Vec::new(), Vec::new());
        if !places.is_empty() && run.reader.has(&format!("{group}/normal_force")) {
            // Plates are below zero; parts of broken grains have no place of their own in the table of grains.
            let between = |pair: ContactPair| {
                let [a, b] = pair.bodies.map(|n| usize::try_from(n).ok().filter(|n| *n < grains));
                Some(([a?, b?], pair.normal_force))
            };
            let pairs: Vec<_> = run.reader.contact_pairs(state)?.into_iter().filter_map(between).collect();
            let mean = pairs.iter().map(|(_, size)| size).sum::<f64>() / pairs.len().max(1) as f64;
            for ([a, b], size) in pairs.into_iter().filter(|(_, size)| *size > mean) {
                let place =
                    |grain: usize| places.get(3 * (state * grains + grain)..).and_then(|p| p.get(..3));
                if let (Some(from), Some(to)) = (place(a), place(b)) {
                    // Tenths of a millimetre are enough for a bar.
                    line.extend(from.iter().chain(to).map(|x| (x * 1e5).round() / 1e5));
                    force.push((size / mean * 100.0).round() / 100.0);
                }
            }
        }
        ends.push(line);
        sizes.push(force);
    }
    Ok((ends, sizes))
}

/// What is said of a state.
fn label(run: &Run, increment: u64) -> Result<String> {
    let increments = run.column("increment")?;
    let Some(row) = increments.iter().position(|&n| n as u64 == increment) else { return Ok("start".into()) };
    let at = |name: &str| -> Result<f64> { Ok(run.column(name)?.get(row).copied().unwrap_or(f64::NAN)) };
    let (stage, strain, q) = (at("stage")?, at("axial_strain")?, at("deviatoric_stress")?);
    let kind = run.summary.stages.get(stage as usize).map_or("", String::as_str);
    Ok(match strain.is_finite() && q.is_finite() {
        true => format!("{kind}, axial strain {} %, q {} MPa", short(100.0 * strain), short(1e-6 * q)),
        false => format!("{kind}, increment {increment}"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::CellKind;
    use crate::tensor::Vec3;

    /// Without the end of the consolidation displacements would count from amid the shearing.
    #[test]
    fn the_end_of_the_consolidation_is_kept() {
        let state = |k: u32| SavedState { time: f64::from(k) / 4.0, increment: u64::from(k) };
        let all: Vec<SavedState> = (0..=12).map(state).collect();
        assert_eq!(shown(&all, 1, 3), [0, 4, 6, 12]);
        assert_eq!(shown(&all, 0, 3), [0, 6, 12]);
        assert_eq!(shown(&all, 1, 100).len(), 13);
        assert!(shown(&[], 1, 3).is_empty());
    }

    /// Two tetrahedra with a face in common, their points apart: one outside of six facets while they are one piece, eight when they came apart.
    #[test]
    fn the_outside_is_that_of_the_pieces() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]]
            .map(Vec3::from);
        let of = [[0, 1, 2, 3], [1, 2, 3, 4]];
        let cells = SavedCells {
            points: of.iter().flatten().map(|&k| corners[k]).collect(),
            types: vec![CellKind::Tetrahedron as i64; 2],
            connectivity: (0..8).collect(),
            offsets: vec![0, 4, 8],
            grain: vec![0, 0],
            part: vec![0, 0],
            parts: vec!["grains".into()],
        };
        let whole = Outside::of(&cells, &[0.0, 0.0]);
        assert_eq!((whole.nodes.len(), whole.owners.len()), (5, 6));
        let apart = Outside::of(&cells, &[0.0, 7.0]);
        assert_eq!((apart.nodes.len(), apart.owners.len()), (8, 8));
        assert_eq!(apart.cells.iter().filter(|cell| **cell == 1).count(), 4);
    }
}
