//! How forces are spread: the distribution of the normal contact forces, and roses of the contact normals.
//!
//! A triaxial test is alike around its axis, so a rose shows directions by their angle to the horizontal plane only. A
//! sector's radius is the number of contacts (or the mean normal force) per solid angle over that of an isotropic fabric: isotropy
//! is the unit circle. A pair of bodies is one contact, as in the history. Fabric tensor after Satake (1982): the mean of
//! n ⊗ n; its deviator is 0 for isotropy.

use crate::error::Result;

use super::axis::{Axis, short};
use super::chart::{Arrangement, Chart, Layer, Panel};
use super::drawing::{Anchor, Drawing};
use super::lettering::fitted;
use super::palette::{AXIS, BLACK, BLUE, Colour, DASHED, GRID, INK, ORANGE, Stroke};
use super::run::{Largest, Run};

/// Sectors between the horizontal and the vertical.
const SECTORS: usize = 9;
/// Intervals of the force distribution over [0, FORCE_END) mean forces.
const INTERVALS: usize = 15;
const FORCE_END: f64 = 6.0;

/// The contacts of one saved state.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Fabric {
    /// What the state is called.
    pub name: String,
    /// Pairs of grains that touch.
    pub contacts: usize,
    /// Mean normal force of those [N].
    pub mean_force: f64,
    /// Probability density over normal force in mean normal forces, in [`INTERVALS`] intervals.
    pub density: Vec<[f64; 2]>,
    /// Contacts per solid angle over the isotropic number, from the horizontal upwards.
    pub numbers: [f64; SECTORS],
    /// Normal force per solid angle over the isotropic one.
    pub forces: [f64; SECTORS],
    /// Vertical minus horizontal principal value of the fabric tensor, by number and by force.
    pub anisotropy: [f64; 2],
}

impl Fabric {
    /// From contact normals and normal forces [N].
    pub fn of(name: &str, normals: &[[f64; 3]], forces: &[f64]) -> Fabric {
        let pairs: Vec<([f64; 3], f64)> = normals
            .iter()
            .copied()
            .zip(forces.iter().copied())
            .filter(|(n, force)| n.iter().all(|x| x.is_finite()) && force.is_finite() && *force > 0.0)
            .collect();
        let mut fabric = Fabric { name: name.into(), contacts: pairs.len(), ..Fabric::default() };
        if pairs.is_empty() {
            return fabric;
        }
        let total: f64 = pairs.iter().map(|(_, force)| force).sum();
        let count = pairs.len() as f64;
        fabric.mean_force = total / count;
        let width = FORCE_END / INTERVALS as f64;
        let mut histogram = [0.0; INTERVALS];
        let mut tensors = [[0.0; 2]; 2];
        for (n, force) in &pairs {
            if let Some(number) = histogram.get_mut((force / fabric.mean_force / width) as usize) {
                *number += 1.0 / (count * width);
            }
            let length = n.iter().map(|x| x * x).sum::<f64>().sqrt();
            let upward = (n[2].abs() / length.max(1e-300)).min(1.0);
            let sector =
                ((upward.asin() / std::f64::consts::FRAC_PI_2 * SECTORS as f64) as usize).min(SECTORS - 1);
            fabric.numbers[sector] += 1.0 / count;
            fabric.forces[sector] += force / total;
            for (tensor, weight) in tensors.iter_mut().zip([1.0 / count, force / total]) {
                tensor[0] += weight * upward * upward;
                tensor[1] += weight * 0.5 * (1.0 - upward * upward);
            }
        }
        for sector in 0..SECTORS {
            // Share of the sphere: the sine of the latitude grows linearly with area.
            let edge = |k: usize| (std::f64::consts::FRAC_PI_2 * k as f64 / SECTORS as f64).sin();
            let isotropic = edge(sector + 1) - edge(sector);
            fabric.numbers[sector] /= isotropic;
            fabric.forces[sector] /= isotropic;
        }
        fabric.density = histogram
            .iter()
            .enumerate()
            .map(|(k, &d)| [(k as f64 + 0.5) * width, if d > 0.0 { d } else { f64::NAN }])
            .collect();
        fabric.anisotropy = tensors.map(|[vertical, horizontal]| vertical - horizontal);
        fabric
    }
}

/// The fabric at the end of the consolidation, at the largest q and at the end, as far as contacts were saved.
pub fn fabrics(run: &Run) -> Result<Vec<Fabric>> {
    let states = run.reader.saved_states()?;
    let mut tables: Vec<(usize, u64)> = Vec::new();
    for (number, state) in states.iter().enumerate() {
        if run.reader.has(&format!("contacts/{number}/normal_force")) {
            tables.push((number, state.increment));
        }
    }
    let shearing = run.shearing()?;
    let increments = run.column("increment")?;
    let increment_of = |row: Option<usize>| row.and_then(|row| increments.get(row)).map(|&n| n as u64);
    let largest = shearing.curve.largest();
    let peak = increment_of(largest.map(|(at, _)| shearing.rows[at]));
    let near = match largest {
        Some((_, Largest::Peak)) | None => "near the peak",
        Some((_, Largest::AtEnd | Largest::Turned)) => "near the largest q",
    };
    // Of a run that is not sheared, the first row is the first increment.
    let consolidated = increment_of(shearing.rows.first().copied().filter(|_| shearing.behind_consolidation));
    let nearest = |wanted: Option<u64>| {
        let wanted = wanted?;
        tables.iter().min_by_key(|(_, increment)| increment.abs_diff(wanted)).copied()
    };
    let mut chosen: Vec<(usize, &str)> = Vec::new();
    for (table, name) in [
        (nearest(consolidated), "consolidated"),
        (nearest(peak), near),
        (tables.last().copied(), "at the end"),
    ] {
        if let Some((number, _)) = table {
            // The last name of a state is the one to keep.
            chosen.retain(|(known, _)| *known != number);
            chosen.push((number, name));
        }
    }
    let mut fabrics = Vec::new();
    for (number, name) in chosen {
        // Contacts with the plates are vertical by making, not by fabric.
        let between = run.reader.contact_pairs(number)?.into_iter().filter(|pair| !pair.has_plate());
        let (normals, forces): (Vec<[f64; 3]>, Vec<f64>) =
            between.map(|pair| (<[f64; 3]>::from(pair.normal), pair.normal_force)).unzip();
        let strain = states
            .get(number)
            .and_then(|state| increments.iter().position(|&n| n as u64 == state.increment))
            .and_then(|row| shearing.rows.iter().position(|&found| found == row))
            .map(|at| 100.0 * shearing.curve.axial_strain[at]);
        let name = match strain {
            Some(strain) if strain > 0.0 => format!("{name}, {} %", short(strain)),
            Some(_) | None => name.to_string(),
        };
        let fabric = Fabric::of(&name, &normals, &forces);
        if fabric.contacts > 0 {
            fabrics.push(fabric);
        }
    }
    Ok(fabrics)
}

/// Distribution of the forces, one curve a state.
pub fn chart(run: &Run, fabrics: &[Fabric]) -> Option<Chart> {
    let x = Axis::new("normal force over its mean [1]").from(0.0).to(FORCE_END);
    let mut panel = Panel::new(x, Axis::new("probability density [1]").logarithmic());
    for (number, fabric) in fabrics.iter().enumerate() {
        let points: Vec<[f64; 2]> = fabric.density.iter().copied().filter(|p| p[1].is_finite()).collect();
        let label = format!(
            "{} ({} contacts, mean {} kN)",
            fabric.name,
            fabric.contacts,
            short(1e-3 * fabric.mean_force)
        );
        panel.layers.push(Layer::Curve { label, points, stroke: Stroke::of(number) });
    }
    if panel.layers.is_empty() {
        return None;
    }
    let title = format!("Contact forces: {}", run.label);
    Some(Chart::new(title, vec![panel], Arrangement::Stacked, [720.0, 360.0]))
}

/// Roses side by side, one a state; `None` without contacts.
pub fn roses(run: &Run, fabrics: &[Fabric]) -> Option<Drawing> {
    if fabrics.is_empty() {
        return None;
    }
    let cell = 260.0;
    let width = (cell * fabrics.len() as f64).max(560.0);
    let mut drawing = Drawing::new(width, 390.0);
    let title = fitted(&format!("Contact normals: {}", run.label), 15.0, width - 28.0);
    drawing.text([14.0, 22.0], &title, 15.0, BLACK, Anchor::Left);
    let most = fabrics
        .iter()
        .flat_map(|fabric| fabric.numbers.iter().chain(&fabric.forces))
        .fold(1.0_f64, |most, &x| most.max(x));
    let radius = 105.0;
    let unit = radius / most;
    let mut x = 16.0;
    let force = Stroke { colour: ORANGE, width: 2.2, dash: super::palette::FULL };
    drawing.area(vec![[x + 6.0, 44.0], [x + 30.0, 44.0], [x + 30.0, 56.0], [x + 6.0, 56.0]], BLUE, 0.75);
    drawing.text([x + 37.0, 50.0], "number of contacts", 12.0, INK, Anchor::Left);
    x += 185.0;
    drawing.line(&[[x, 50.0], [x + 30.0, 50.0]], force);
    drawing.text([x + 37.0, 50.0], "their normal force", 12.0, INK, Anchor::Left);
    x += 175.0;
    drawing.line(&[[x, 50.0], [x + 30.0, 50.0]], Stroke { dash: DASHED, ..Stroke::thin(AXIS) });
    drawing.text([x + 37.0, 50.0], "isotropic", 12.0, INK, Anchor::Left);
    let first = 0.5 * (width - cell * fabrics.len() as f64) + 0.5 * cell;
    for (number, fabric) in fabrics.iter().enumerate() {
        let centre = [first + cell * number as f64, 195.0];
        rose(&mut drawing, centre, unit, radius, fabric, force);
        let name = fitted(&fabric.name, 13.0, cell - 10.0);
        drawing.text([centre[0], 332.0], &name, 13.0, BLACK, Anchor::Middle);
        // To two decimals, without a negative zero.
        let [by_number, by_force] = fabric.anisotropy.map(|a| short((100.0 * a).round() / 100.0 + 0.0));
        let text = format!("anisotropy {by_number}, of force {by_force}");
        drawing.text([centre[0], 353.0], &text, 12.0, INK, Anchor::Middle);
    }
    Some(drawing)
}

fn rose(drawing: &mut Drawing, centre: [f64; 2], unit: f64, radius: f64, fabric: &Fabric, force: Stroke) {
    let at = |angle: f64, r: f64| [centre[0] + r * angle.cos(), centre[1] - r * angle.sin()];
    let circle =
        |r: f64| (0..=96).map(|k| at(std::f64::consts::TAU * f64::from(k) / 96.0, r)).collect::<Vec<_>>();
    drawing.line(&circle(radius), Stroke::thin(GRID));
    for k in 0..12 {
        let angle = std::f64::consts::TAU * f64::from(k) / 12.0;
        drawing.line(&[centre, at(angle, radius)], Stroke::thin(GRID));
    }
    let sector = std::f64::consts::FRAC_PI_2 / SECTORS as f64;
    // The four quadrants show the same thing.
    let mirrored = |values: &[f64; SECTORS]| -> Vec<(f64, f64)> {
        let quadrant: Vec<f64> = values.to_vec();
        let back: Vec<f64> = quadrant.iter().rev().copied().collect();
        let all = [quadrant.clone(), back.clone(), quadrant, back].concat();
        all.into_iter().enumerate().map(|(k, value)| (k as f64 * sector, value)).collect()
    };
    for (from, value) in mirrored(&fabric.numbers) {
        let arc = (0..=6).map(|k| at(from + sector * f64::from(k) / 6.0, unit * value));
        drawing.area(std::iter::once(centre).chain(arc).collect(), BLUE, 0.75);
        drawing.line(
            &[centre, at(from, unit * value)],
            Stroke { width: 0.8, ..Stroke::thin(Colour(255, 255, 255)) },
        );
    }
    let mut outline: Vec<[f64; 2]> = Vec::new();
    for (from, value) in mirrored(&fabric.forces) {
        outline.extend((0..=6).map(|k| at(from + sector * f64::from(k) / 6.0, unit * value)));
    }
    outline.extend(outline.first().copied());
    drawing.line(&outline, force);
    drawing.line(&circle(unit), Stroke { dash: DASHED, ..Stroke::thin(AXIS) });
    let [x, y] = centre;
    drawing.text([x, y - radius - 11.0], "axial", 11.0, AXIS, Anchor::Middle);
    drawing.text([x + radius + 4.0, y + 12.0], "radial", 11.0, AXIS, Anchor::Right);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points spread evenly over the sphere (Fibonacci lattice) make a round rose and a fabric without deviator.
    #[test]
    fn isotropic_normals_make_the_unit_circle() {
        let count = 20_000;
        let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let normals: Vec<[f64; 3]> = (0..count)
            .map(|k| {
                let z = 1.0 - (2.0 * k as f64 + 1.0) / count as f64;
                let r = (1.0 - z * z).sqrt();
                [r * (golden * k as f64).cos(), r * (golden * k as f64).sin(), z]
            })
            .collect();
        let forces: Vec<f64> = (0..count).map(|k| 1.0 + f64::from(k as u32 % 3)).collect();
        let fabric = Fabric::of("x", &normals, &forces);
        for (number, force) in fabric.numbers.iter().zip(&fabric.forces) {
            assert!((number - 1.0).abs() < 5e-3 && (force - 1.0).abs() < 1e-2, "{number} {force}");
        }
        assert!(fabric.anisotropy.iter().all(|a| a.abs() < 1e-3), "{:?}", fabric.anisotropy);
        assert!((fabric.mean_force - 2.0).abs() < 1e-3);
        let width = FORCE_END / INTERVALS as f64;
        let whole: f64 = fabric.density.iter().map(|p| p[1]).filter(|d| d.is_finite()).sum::<f64>() * width;
        assert!((whole - 1.0).abs() < 1e-9, "a density integrates to one: {whole}");
    }

    #[test]
    fn vertical_normals_fill_the_upper_sector() {
        let fabric = Fabric::of("x", &[[0.0, 0.0, 1.0], [0.0, 0.1, -1.0]], &[3.0, 1.0]);
        assert!(fabric.numbers[..SECTORS - 1].iter().all(|&n| n == 0.0));
        assert!(fabric.anisotropy[0] > 0.9);
        assert_eq!(Fabric::of("x", &[[f64::NAN; 3]], &[1.0]).contacts, 0);
    }
}
