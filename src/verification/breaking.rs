//! Grains that damage, fail and come apart, and what is pressed between plates.
//!
//! - **Turned grain**: a stressed condensed grain and its loads turned by 0 to 360 degrees. Trace and norm of
//!   the deviator of the stress at every point are those of the upright one to 1e-9 of the largest (rounding
//!   times the condition of the factor).
//! - **Cut in two**: the cells across the middle of a grain deleted. Each part's assembled stiffness has six eigenvalues below 1e-12 of the largest and no
//!   seventh below 1e-9; the displacement left in its frame has no mean translation and rotation (its momentum over its mass); volumes add up.
//! - **Cycles**: tension beyond the peak, back, compression below and beyond its peak, back; `w_t`, `w_c` in {0, 0.5, 1}. With the histories
//!   `d = 1 - (e0/e)^N`: `(1-d) = (1 - (1-w_t r) d_c)(1 - (1-w_c(1-r)) d_t)`, r = 1 in tension and 0 in compression (source, eqs. 8-10 as corrected).
//! - **Fields**: 1e5 samples of Weibull laws; mean within four standard errors of what was asked, Kolmogorov's `D sqrt(n)` below 1.628 (p = 0.01).
//! - **Block in the press** (frictionless): `F = E A u / L` to 1e-6 below the peak, since strains are uniform and exact; the peak is `f_c A` less than an
//!   increment's rise.
//! - **Sphere in the press**: elastic part against Hertz at its refined pole, approach measured to the
//!   sphere's mean motion. Tolerance as for the problem `hertz`: nodes see point loads, too soft by 0.64 s/a,
//!   and the sphere is a half-space up to a/R.
//! - **Ledger of a pressed grain**: damage energy against what work and storage leave over, up to the first
//!   snap: 1e-3 of the work (its trapezoid is the largest error).

use nalgebra::DMatrix;

use crate::crushing::{Bench, Grip, Limits, Part, Plate};
use crate::grain::stiffness::stiffness_matrix;
use crate::grain::{Ancestry, CondensedGrain, DamagedGrain, Fragment, SurfacePoint, mean_motion};
use crate::material::{
    self, DamageLaw, DamageParameters, DamageState, Elastic, Property, Quantity, sample_field,
};
use crate::mesh::{CellId, Mesh, NearPoint, cuboid_mesh, grain_mesh, sphere_mesh};
use crate::tensor::{Pose, Rotation, Vec3};
use crate::verification::damage::{E, F_C, F_T, NU, law, uniaxial};
use crate::verification::grains::{rocks, sample_grain};
use crate::verification::{Absolute, Findings, Relative, hertz, timed, worse};

/// Opposite forces of 1 kN through a grain.
fn squeezed(grain: &CondensedGrain) -> Vec<(SurfacePoint, Vec3)> {
    let direction = Vec3::new(0.1, 0.2, 1.0) * 0.05;
    let (a, b) = (grain.locate(&direction), grain.locate(&-direction));
    let along = (b.position - a.position).normalize() * 1e3;
    vec![(a, along), (b, -along)]
}

/// The largest change of trace and deviator of the stresses of a grain that is turned, over the largest stress.
pub fn turned_grain() -> f64 {
    let mesh = grain_mesh(&sample_grain([16.0, 13.0]), 38).expect("a mesh");
    let rock = rocks(&mesh);
    let upright = CondensedGrain::new(mesh.clone(), &rock, 2700.0).expect("a grain");
    let loads = squeezed(&upright);
    let invariants = |grain: &CondensedGrain, loads: &[(SurfacePoint, Vec3)]| -> Vec<[f64; 2]> {
        let stresses = grain.cell_stresses(&grain.nodal_displacements(loads));
        let of_point = |s: &nalgebra::Vector6<f64>| {
            let p = (s[0] + s[1] + s[2]) / 3.0;
            let square = (0..3).map(|k| (s[k] - p).powi(2) + 2.0 * s[3 + k].powi(2)).sum::<f64>();
            [p, square.sqrt()]
        };
        stresses.iter().flatten().map(of_point).collect()
    };
    let first = invariants(&upright, &loads);
    let scale = first.iter().flatten().map(|x| x.abs()).fold(0.0, f64::max);
    let mut error = 0.0;
    for step in 1..=24 {
        let angle = f64::from(15 * step).to_radians();
        let turn = Rotation::from_scaled_axis(Vec3::new(0.2, -0.5, 0.9).normalize() * angle);
        let turned = Mesh { nodes: mesh.nodes.iter().map(|x| turn * x).collect(), ..mesh.clone() };
        let grain = CondensedGrain::new(turned, &rock, 2700.0).expect("a grain");
        let place = |(point, force): &(SurfacePoint, Vec3)| {
            let (position, normal) = (turn * point.position, turn * point.normal);
            (SurfacePoint { position, normal, ..point.clone() }, turn * force)
        };
        let loads: Vec<_> = loads.iter().map(place).collect();
        for (a, b) in invariants(&grain, &loads).iter().flatten().zip(first.iter().flatten()) {
            error = worse(error, (a - b).abs() / scale);
        }
    }
    error
}

/// What a grain cut in two is.
#[derive(Debug, Clone, PartialEq)]
pub struct Cut {
    pub parts: usize,
    /// Rigid modes of each part.
    pub modes: Vec<usize>,
    /// Mean motion left in a part's frame over the displacements.
    pub motion: f64,
    /// Volume that is lost to no account over the whole.
    pub volume: f64,
}

/// Of a part's assembled stiffness [N/m], the smallest first.
pub fn eigenvalues(part: &Fragment) -> Vec<f64> {
    let (mesh, grain) = (part.grain.mesh(), &part.grain);
    let elastic: Vec<Elastic> = mesh.cell_ids().map(|cell| *grain.law(cell).elastic()).collect();
    let k = stiffness_matrix(mesh, &elastic, grain.intact()).expect("a stiffness");
    let dense = DMatrix::from_fn(k.size(), k.size(), |i, j| k.get(i, j));
    let mut values: Vec<f64> = dense.symmetric_eigenvalues().iter().copied().collect();
    values.sort_by(f64::total_cmp);
    values
}

/// Mean translation and rotation that the displacements `u` [m] of the whole grain's nodes leave in the frame of a part.
pub fn motion_left(part: &Fragment, u: &[Vec3]) -> (Vec3, Vec3) {
    let mesh = part.grain.mesh();
    let centroid = mesh.centroid();
    let left: Vec<Vec3> = part
        .nodes
        .iter()
        .zip(&mesh.nodes)
        .map(|(node, x)| u[node.index()] - part.translation - part.rotation.cross(&(x - centroid)))
        .collect();
    mean_motion(mesh, &left)
}

/// A grain whose cells across its middle have failed.
pub fn cut_in_two() -> Cut {
    let mesh = grain_mesh(&sample_grain([16.0, 13.0]), 90).expect("a mesh");
    let centre = mesh.centroid().z;
    let between = |cell: CellId| {
        let z = mesh.corners(cell).map(|p| p.z - centre);
        !(z.iter().all(|z| *z > 0.0) || z.iter().all(|z| *z < 0.0))
    };
    let state = |cell| DamageState { failed: between(cell), ..DamageState::default() };
    let states = mesh.cell_ids().map(|cell| [state(cell); 4]).collect();
    let laws = vec![law(3.0, 1.0, 0.0); mesh.cells.len()];
    let mut grain = DamagedGrain::with_states(mesh.clone(), laws, 2700.0, states, Ancestry::of_grain(0))
        .expect("a grain");
    let loads: Vec<_> =
        squeezed(grain.condensed()).iter().map(|(point, f)| (point.clone(), f * 1e-2)).collect();
    grain.commit(&loads).expect("a commit");
    let outcome = grain.break_up(&loads, 0, 1e-9).expect("a break-up").expect("cells have failed");
    let u = grain.condensed().nodal_displacements(&loads);
    let scale = u.iter().map(|u| u.norm()).fold(0.0, f64::max);
    let mut cut = Cut { parts: outcome.fragments.len(), modes: vec![], motion: 0.0, volume: 0.0 };
    for part in &outcome.fragments {
        let small = part.grain.mesh();
        let values = eigenvalues(part);
        let largest = values[values.len() - 1];
        let below = |share: f64| values.iter().filter(|value| value.abs() < share * largest).count();
        // Nothing between a rigid mode's rounding and the softest mode of the rock.
        cut.modes.push(if below(1e-12) == below(1e-9) { below(1e-9) } else { 0 });
        let (shift, turn) = motion_left(part, &u);
        cut.motion = worse(cut.motion, (shift.norm() + 0.01 * turn.norm()) / scale);
        cut.volume += small.volume();
    }
    cut.volume = ((cut.volume + outcome.deleted_volume + outcome.lost_volume) / mesh.volume() - 1.0).abs();
    cut
}

/// The largest error of the stress over the tensile strength along the cycle, for these recoveries.
pub fn cycle(w_c: f64, w_t: f64) -> f64 {
    let (t0, c0, n) = (F_T / E, F_C / E, 3.0);
    let law = law(n, w_c, w_t);
    let mut state = DamageState::default();
    let mut error = 0.0;
    let mut close = |to: f64, expected: f64| {
        let from = state.strain[0];
        let mut stress = 0.0;
        for k in 1..=50 {
            let e = from + (to - from) * f64::from(k) / 50.0;
            let response = law.respond(&uniaxial(e), &state);
            (stress, state) = (response.stress[0], response.state);
            error = worse(error, response.stress.rows(1, 5).norm() / F_T);
        }
        error = worse(error, (stress - expected).abs() / F_T);
    };
    let carried = |d: f64, e: f64| if d > 0.99 { 0.0 } else { (1.0 - d) * E * e };
    // Tension to 2.5 peak strains, half way back, zero.
    let d_t = 1.0 - (1.0 / 2.5_f64).powf(n);
    close(2.5 * t0, carried(d_t, 2.5 * t0));
    close(1.2 * t0, carried(d_t, 1.2 * t0));
    close(0.0, 0.0);
    // Compression below its peak: w_c = 1 gives E back, w_c = 0 nothing.
    close(-0.5 * c0, carried((1.0 - w_c) * d_t, -0.5 * c0));
    // Beyond the peak; the lateral extension nu e now leads the tension history.
    let e = 1.5 * c0;
    let d_t = 1.0 - (t0 / (NU * 2.0_f64.sqrt() * e)).powf(n);
    let d_c = 1.0 - (1.0 / 1.5_f64).powf(n);
    let d = 1.0 - (1.0 - d_c) * (1.0 - (1.0 - w_c) * d_t);
    close(-e, carried(d, -e));
    if d <= 0.99 {
        close(-0.4 * c0, carried(d, -0.4 * c0));
        // Tension again: w_t = 1 forgets the compression damage.
        let d = 1.0 - (1.0 - (1.0 - w_t) * d_c) * (1.0 - d_t);
        close(0.8 * t0, carried(d, 0.8 * t0));
    }
    error
}

/// Samples of a field.
const SAMPLES: usize = 100_000;

/// Mean over the asked one, less 1, in standard errors, and Kolmogorov's `D sqrt(n)` of a Weibull field.
pub fn weibull_field(shape: f64) -> [f64; 2] {
    let gamma = statrs::function::gamma::gamma;
    let quantity = Quantity { mean: 1.0, law: material::Law::Weibull { shape } };
    let mut values =
        sample_field(&quantity, Property::TensileStrength, 7, 0, SAMPLES).expect("a field").values;
    let (n, scale) = (SAMPLES as f64, 1.0 / gamma(1.0 + 1.0 / shape));
    let deviation = (scale * scale * gamma(1.0 + 2.0 / shape) - 1.0).sqrt();
    let mean = values.iter().sum::<f64>() / n;
    values.sort_by(f64::total_cmp);
    let gap = |(k, x): (usize, &f64)| {
        let f = -(-(x / scale).powf(shape)).exp_m1();
        (f - k as f64 / n).abs().max((f - (k + 1) as f64 / n).abs())
    };
    let distance = values.iter().enumerate().map(gap).fold(0.0, f64::max);
    [(mean - 1.0) / (deviation / n.sqrt()), distance * n.sqrt()]
}

/// Uniform rock of compressive strength `f_c` [Pa], ten times the tensile one.
fn rock(mesh: Mesh, f_c: f64) -> DamagedGrain {
    let elastic = Elastic::new(E, NU).expect("allowed");
    let law = DamageLaw::new(elastic, 0.1 * f_c, f_c, &DamageParameters::default(), 1e-3).expect("a law");
    let laws = vec![law; mesh.cells.len()];
    DamagedGrain::new(mesh, laws, 2700.0, Ancestry::of_grain(0)).expect("a grain")
}

/// Plates without an end above and below a mesh.
fn bench(mesh: &Mesh, grip: Grip) -> Bench {
    let heights = || mesh.nodes.iter().map(|x| x.z);
    let [low, high] = [heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max)];
    let plates = [Plate::wide(low), Plate::wide(high)];
    Bench { grip, patch: None, frame: Pose::identity(), plates, length: high - low, modulus: E }
}

/// A settled state: way of the upper plate [m], force on it [N], work of it, energy stored and set free by damage [J].
#[derive(Clone, Copy, Default)]
struct Pressed {
    travel: f64,
    force: f64,
    external: f64,
    elastic: f64,
    damage: f64,
}

/// Presses a grain by up to `travel` [m] in so many increments, halved where they do not settle, until its force falls, a point of it fails or nothing settles.
fn press(grain: DamagedGrain, grip: Grip, travel: f64, increments: usize) -> Vec<Pressed> {
    let mut bench = bench(grain.mesh(), grip);
    let limits = Limits { max_change: 0.2, tolerance: 1e-3, most_rounds: 400 };
    let (high, least) = (bench.plates[1].height, 0.02 * grain.mesh().volume());
    let step = travel / increments as f64;
    let mut part = Part::new(grain);
    let mut states = vec![Pressed::default()];
    let (mut done, mut share) = (0.0, 1.0);
    while done < increments as f64 && share > 0.01 {
        let last = states[states.len() - 1];
        let travel = (done + share).min(increments as f64) * step;
        bench.plates[1].height = high - travel;
        let Ok(settled) = part.settle(&bench, &limits, &|| false).expect("solvable") else {
            share *= 0.5;
            continue;
        };
        let force = settled.contact.force();
        let kept = part.keep(&settled, grip, 0, least).expect("solvable");
        if force < last.force || kept.commit.newly_failed > 0 {
            break;
        }
        (done, share) = (done + share, f64::min(1.0, 2.0 * share));
        states.push(Pressed {
            travel,
            force,
            external: last.external + 0.5 * (last.force + force) * (travel - last.travel),
            elastic: kept.commit.elastic + settled.contact.patch_energy,
            damage: last.damage + kept.commit.dissipated,
        });
    }
    states
}

/// Increments up to the peak of the block.
const BLOCK_INCREMENTS: usize = 40;

/// The largest error of the block's force below nine tenths of its peak, and its peak over `f_c A`.
pub fn block() -> [f64; 2] {
    let f_c = 100e6;
    let mesh = cuboid_mesh([10e-3, 10e-3, 20e-3], 10e-3).expect("a mesh");
    let peak_travel = f_c / E * 20e-3;
    let travel = 1.2 * peak_travel;
    let states = press(rock(mesh, f_c), Grip::Frictionless, travel, BLOCK_INCREMENTS * 12 / 10);
    let below = states.iter().filter(|state| state.travel > 0.0 && state.travel < 0.9 * peak_travel);
    let error = below.map(|at| (at.force / (E * 1e-4 * at.travel / 20e-3) - 1.0).abs()).fold(0.0, worse);
    let peak = states.iter().map(|state| state.force).fold(0.0, f64::max);
    [error, peak / (f_c * 1e-4)]
}

/// Force of the upper plate over Hertz's at the approach that the sphere's mean motion gives, with cells of this size at the pole.
pub fn sphere(cell: f64) -> f64 {
    let radius = hertz::RADIUS;
    let near = NearPoint {
        point: Vec3::new(0.0, 0.0, radius),
        radius: hertz::CONTACT + 1e-4,
        mesh_size: cell,
        growth: 0.6,
    };
    let mesh = sphere_mesh(radius, 7e-3, Some(&near)).expect("a mesh");
    let mut bench = bench(&mesh, Grip::Frictionless);
    let high = bench.plates[1].height;
    let mut part = Part::new(rock(mesh, 1e12));
    let limits = Limits { max_change: 0.2, tolerance: 1e-3, most_rounds: 5 };
    // The coarse lower pole yields by more: twice nearer to the approach asked for; the force is compared at the one found.
    let (mut travel, mut found) = (2.0 * hertz::APPROACH, f64::NAN);
    for _ in 0..3 {
        bench.plates[1].height = high - travel;
        let Ok(Ok(settled)) = part.settle(&bench, &limits, &|| false) else { return f64::NAN };
        let approach = travel + settled.contact.motion[0].z;
        found = settled.contact.force() / (hertz::force() * (approach / hertz::APPROACH).max(0.0).powf(1.5));
        travel *= (hertz::APPROACH / approach).clamp(0.2, 5.0);
    }
    found
}

/// What the damage row of a pressed grain misses of what work and storage leave over, over the work, up to the first snap; and its share of
/// the work.
pub fn ledger() -> [f64; 2] {
    let mesh = grain_mesh(&sample_grain([10.0, 9.0]), 38).expect("a mesh");
    let states = press(rock(mesh, 250e6), Grip::Rough, 6e-5, 300);
    match states[..] {
        [_, .., last] => {
            let left_over = last.external - last.elastic - last.damage;
            [left_over / last.external, last.damage / last.external]
        }
        _ => [f64::NAN; 2],
    }
}

pub(super) fn turned(findings: &mut Findings) {
    let (error, time) = timed(turned_grain);
    let what = "invariants of a stressed grain turned by 0-360 deg";
    findings.compare(what, error, 0.0, Absolute(1e-9), (25, time));
}

pub(super) fn cut(findings: &mut Findings) {
    let (cut, time) = timed(cut_in_two);
    let cost = (cut.parts + 1, time);
    let exact = Absolute(0.0);
    findings.compare("parts of a grain cut in two", cut.parts as f64, 2.0, exact, cost);
    for (part, modes) in cut.modes.iter().enumerate() {
        findings.compare(format!("rigid modes of part {part}"), *modes as f64, 6.0, exact, cost);
    }
    let rounding = Absolute(1e-12);
    findings.compare("mean motion left in a part's frame", cut.motion, 0.0, rounding, cost);
    findings.compare("volume that is lost", cut.volume, 0.0, rounding, cost);
}

pub(super) fn cycles(findings: &mut Findings) {
    for w_c in [0.0, 0.5, 1.0] {
        for w_t in [0.0, 0.5, 1.0] {
            let (error, time) = timed(|| cycle(w_c, w_t));
            let what = format!("cycle, w_c {w_c}, w_t {w_t}: stress off over f_t");
            findings.compare(what, error, 0.0, Absolute(1e-8), time);
        }
    }
}

pub(super) fn fields(findings: &mut Findings) {
    for shape in [2.0, 10.0, 20.0] {
        let ([mean, distance], time) = timed(|| weibull_field(shape));
        let what = format!("Weibull {shape}: mean off, in standard errors");
        findings.compare(what, mean, 0.0, Absolute(4.0), time);
        let what = format!("Weibull {shape}: D sqrt(n)");
        findings.compare(what, distance, 0.0, Absolute(1.628), time);
    }
}

pub(super) fn pressed(findings: &mut Findings) {
    let ([error, peak], time) = timed(block);
    findings.compare("block: force off E A u / L", error, 0.0, Absolute(1e-6), time);
    let rise = Relative(1.0 / BLOCK_INCREMENTS as f64);
    findings.compare("block: peak over f_c A", peak, 1.0, rise, time);
    let cell = hertz::CELLS[0];
    let (force, time) = timed(|| sphere(cell));
    let what = format!("sphere: F over Hertz's, cells of {:.2} a", cell / hertz::CONTACT);
    findings.compare(what, force, 1.0, Relative(hertz::bound(cell)), time);
    let ([missed, share], time) = timed(ledger);
    let missed = if share > 0.01 { missed } else { f64::NAN };
    let what = "grain: work that no row has, over the work";
    findings.compare(what, missed, 0.0, Absolute(1e-3), time);
}
