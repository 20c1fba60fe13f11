//! A smooth round core between the plates of the rig, in a rubber membrane, under a cell pressure: what it feels.
//!
//! - Core stress: `s = (p R_m + N) / R` with the radius `R_m = R + t/2 - overlap` of the sheet, on which the pressure acts, and its hoop
//!   tension `N = G t (l - 1/(l^3 m^2)) / m` at the hoop stretch l and the axial stretch m (neo-Hooke, Rivlin 1949). Rubber that fills its thickness would
//!   hand on p itself: `t/2R` of the pressure is what a sheet of no thickness, kept half its thickness off, has too much.
//! - Membrane correction: the core at constant volume, longer by e, carries `4 E_m t e / D` of axial stress more, `E_m = 3 G` (Henkel &
//!   Gilbert 1952, Geotechnique 3:20), and none at its side; shortened, the free sheet wrinkles, carries nothing axially and adds
//!   `2 E_m t (e/2) / D` at the side.
//!
//! How it is measured: virtual work. A core whose radius grows by `u(z) = 2 sin^2(pi z / H)` works against its contacts by `sum f u`, against
//! a uniform stress s by `s 2 pi R H`. That weight leaves out the ends: there the rims stand off the core, the pressure pushes the
//! sheet along the slope towards the plates, nothing but its tension holds it on a smooth core (4 % of stretch under 0.8 MPa), and the last rings' share of
//! the height is not what it was.
//!
//! Tolerance: the membrane is a polygon whose errors are of the second order in its sides; two sizes, the second half the first, are extrapolated to
//! none. What is left is of the fourth order, and nodes that are out of balance by up to 1e-3 of their load, not all one way. The
//! correction is of first order in e and in t/D.

use std::f64::consts::{PI, TAU};

use crate::contact::ContactShape;
use crate::contact::NormalLaw;
use crate::contact::face::FaceContact;
use crate::contact::law::Friction;
use crate::error::{Error, Result};
use crate::geometry::{Polyhedron, RoundedBody};
use crate::material::{Rubber, RubberLaw};
use crate::solver::Settings;
use crate::specimen::Specimen;
use crate::specimen::shape::GrainShape;
use crate::specimen::statistics::Statistics;
use crate::tensor::{Pose, Rotation, Vec3};
use crate::triaxial::{Cover, Rig, RigParameters, RubberSheet};
use crate::verification::{Absolute, Findings, timed};

/// Radius and height of the core, and its rounding [m].
pub const RADIUS: f64 = 0.05;
const HEIGHT: f64 = 0.1;
const ROUNDING: f64 = 1e-3;
/// Sides of the core over those of the membrane: the middles of all edges around the membrane then meet edges of the core, and none is slack.
const SIDES: usize = 4;
/// Edges of the two membranes [m].
pub const SIZES: [f64; 2] = [7e-3, 3.5e-3];
/// What core stress the problem asks for.
pub const HELD: f64 = 1e-3;

/// Where the rims of the membrane are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rims {
    /// Clear of the core, as the rig puts them.
    Clear,
    /// Where the sheet lies on the core, however that is strained.
    Flush,
}

/// A membrane around the core, and the pressure on it.
#[derive(Debug, Clone, Copy)]
pub struct Wrapped {
    /// Shear modulus [Pa].
    pub modulus: f64,
    /// Of the rubber [m].
    pub thickness: f64,
    /// Hoop stretch with which it goes around the core.
    pub stretch: f64,
    /// [Pa]
    pub pressure: f64,
    /// What presses its contacts by a hundredth of the thickness [Pa].
    pub stiffness: f64,
    pub rims: Rims,
}

/// What the core and the plates feel.
#[derive(Debug, Clone, Copy)]
pub struct Felt {
    /// Radial stress of the core [Pa], by virtual work, its ends left out.
    pub stress: f64,
    /// Axial stretch of the sheet half-way up.
    pub axial: f64,
    /// Force with which the sheet draws the top plate down [N].
    pub tension: f64,
    /// How far the sheet lies within the core's surface and half its thickness, mean over the load [m].
    pub overlap: f64,
    pub steps: usize,
}

impl Wrapped {
    /// Where the sheet lies on a core of `radius` [m].
    fn lies_at(&self, radius: f64) -> f64 {
        radius + 0.5 * self.thickness
    }

    /// What a sheet so stretched and so far within presses with [Pa]: `(p R_m + N) / R`.
    pub fn expected(&self, felt: &Felt) -> f64 {
        let m = felt.axial;
        let at = self.lies_at(RADIUS) - felt.overlap;
        let l = self.stretch * at / self.lies_at(RADIUS);
        let tension = self.modulus * self.thickness * (l - 1.0 / (l.powi(3) * m * m)) / m;
        (self.pressure * at + tension) / RADIUS
    }

    /// Sides of a membrane with edges of `size` [m], whose middles touch the core when it lies there, and its unstrained radius [m].
    fn cut(&self, size: f64) -> (f64, f64) {
        let round = self.lies_at(RADIUS) / self.stretch;
        let mut unstrained = round;
        for _ in 0..3 {
            unstrained = round / (PI / (TAU * unstrained / size).ceil()).cos();
        }
        ((TAU * unstrained / size).ceil(), unstrained)
    }

    /// With a core shortened by `strain` at constant volume, under a membrane with edges of `size` [m] that was made for it unstrained;
    /// nothing where the membrane does not come to lie.
    ///
    /// # Errors
    /// As for bodies and rigs.
    pub fn lie(&self, size: f64, strain: f64) -> Result<Option<Felt>> {
        let (sides, unstrained) = self.cut(size);
        let around = SIDES * sides as usize;
        let corner = |k: usize| {
            let angle = TAU * (k / 2) as f64 / around as f64;
            let z = if k.is_multiple_of(2) { 0.5 } else { -0.5 } * HEIGHT;
            Vec3::new(RADIUS * angle.cos(), RADIUS * angle.sin(), z)
        };
        let nominal = Polyhedron::convex_hull(&(0..2 * around).map(corner).collect::<Vec<_>>())?;
        let rounded = RoundedBody::inset(&nominal, ROUNDING)?;
        let semi_axes = [RADIUS, RADIUS, 0.5 * HEIGHT];
        let specimen = Specimen {
            grains: vec![GrainShape { nominal, rounded, sieve_size: 2.0 * RADIUS, class: 0, semi_axes }],
            poses: vec![Pose::new(Vec3::new(0.0, 0.0, 0.5 * HEIGHT), Rotation::identity())],
            diameter: 2.0 * unstrained,
            height: HEIGHT,
            statistics: Statistics::default(),
        };
        let rubber = Rubber::new(self.modulus, RubberLaw::NeoHookean)
            .map_err(|error| Error::Specimen(error.to_string()))?;
        let (thickness, pressure) = (self.thickness, self.stiffness);
        let parameters = RigParameters {
            density: 2700.0,
            youngs_modulus: 30e9,
            poissons_ratio: 0.2,
            friction: Friction::constant(0.5),
            plate_friction: Friction::constant(0.5),
            faces: FaceContact::Corners,
            normal: NormalLaw::Spring,
            limit_pressure: f64::INFINITY,
            cover: Cover::Rubber(RubberSheet { rubber, thickness, mesh_size: Some(size), pressure }),
            tilting: false,
        };
        let mut rig = Rig::new(&specimen, &parameters, Settings::default())?;
        self.strain(&mut rig, strain);
        if self.rims == Rims::Flush {
            let at = self.lies_at(RADIUS / f64::sqrt(1.0 - strain)) / (PI / sides).cos();
            put_rims(&mut rig, at)?;
        }
        let Some(laid) = rig.lay_membrane(self.pressure).filter(|laid| laid.converged) else {
            return Ok(None);
        };
        Ok(Some(self.felt(&rig, laid.counters.newton_iterations)))
    }

    /// Shortens the core by `strain`, with the plate on it; its rounding stays.
    fn strain(&self, rig: &mut Rig, strain: f64) {
        let (across, along) = (1.0 / f64::sqrt(1.0 - strain), 1.0 - strain);
        let wider = |x: f64| if x == 0.0 { 0.0 } else { across + (across - 1.0) * ROUNDING / x };
        let RoundedBody { mut core, radius } = rig.model.shapes[0].rounded.clone();
        for x in &mut core.vertices {
            let grown = wider(x.xy().norm());
            let taller = along + (along - 1.0) * ROUNDING / x.z.abs();
            *x = Vec3::new(grown * x.x, grown * x.y, taller * x.z);
        }
        rig.model.shapes[0] = ContactShape::new(RoundedBody { core, radius });
        rig.committed.poses[0].position.z *= along;
        rig.committed.poses[rig.top].position.z -= strain * HEIGHT;
        let first = rig.model.bodies.len();
        for node in &mut rig.committed.poses[first..] {
            let x = &mut node.position;
            *x = Vec3::new(across * x.x, across * x.y, along * x.z);
        }
    }

    fn felt(&self, rig: &Rig, steps: usize) -> Felt {
        let Some(membrane) = &rig.model.membrane else {
            let none = f64::NAN;
            return Felt { stress: none, axial: none, tension: none, overlap: none, steps };
        };
        let contacts = &rig.contacts.membrane;
        let height = rig.height(&rig.committed.poses);
        let (mut work, mut lost) = (0.0, 0.0);
        for (_, point) in contacts.points().filter(|(body, _)| *body == 0) {
            let x = point.force.point;
            let part =
                -point.on_body().xy().dot(&x.xy().normalize()) * 2.0 * (PI * x.z / height).sin().powi(2);
            work += part;
            lost += part * point.force.overlap;
        }
        let mut forces = vec![Vec3::zeros(); membrane.nodes.len()];
        membrane.node_forces_into(&mut forces, &contacts.positions);
        let glued = |body: usize| (0..forces.len()).filter(move |&node| membrane.nodes[node].body == body);
        let around = glued(rig.bottom).count();
        let ring = |ring: usize| {
            let nodes = contacts.positions.iter().skip(ring * around).take(around);
            nodes.map(|x| x.z).sum::<f64>() / around as f64
        };
        let rings = forces.len() / around;
        let (low, high) = (rings / 4, rings - 1 - rings / 4);
        let spacing = HEIGHT / (rings - 1) as f64;
        Felt {
            stress: work / (TAU * RADIUS * height),
            axial: (ring(high) - ring(low)) / ((high - low) as f64 * spacing),
            overlap: lost / work,
            tension: -glued(rig.top).map(|node| forces[node].z).sum::<f64>(),
            steps,
        }
    }

    /// Core stress less the closed form over the pressure, extrapolated to no edges, and the steps taken.
    ///
    /// # Errors
    /// As for [`Wrapped::lie`].
    pub fn excess(&self) -> Result<Option<(f64, usize)>> {
        let (mut off, mut steps) = ([0.0; 2], 0);
        for (off, size) in off.iter_mut().zip(SIZES) {
            let Some(felt) = self.lie(size, 0.0)? else { return Ok(None) };
            *off = (felt.stress - self.expected(&felt)) / self.pressure;
            steps += felt.steps;
        }
        Ok(Some((off[1] + (off[1] - off[0]) / 3.0, steps)))
    }

    /// What a core shortened by `strain` feels more than before: axial stress from the sheet and radial stress over the closed forms' sizes
    /// `4 E_m t e / D` and `E_m t e / D`, and the steps taken.
    ///
    /// # Errors
    /// As for [`Wrapped::lie`].
    fn correction(&self, strain: f64) -> Result<Option<([f64; 2], usize)>> {
        let size = SIZES[1];
        let (Some(before), Some(after)) = (self.lie(size, 0.0)?, self.lie(size, strain)?) else {
            return Ok(None);
        };
        let young = 3.0 * self.modulus;
        let whole = young * self.thickness * strain.abs() / (2.0 * RADIUS);
        let axial = (after.tension - before.tension) / (PI * RADIUS * RADIUS);
        let radial = after.stress - before.stress;
        Ok(Some(([axial / (4.0 * whole), radial / whole], before.steps + after.steps)))
    }
}

/// Shear modulus [Pa], thickness [m], stretch, pressure [Pa].
const fn wrapped([modulus, thickness, stretch, pressure]: [f64; 4]) -> Wrapped {
    Wrapped { modulus, thickness, stretch, pressure, stiffness: pressure, rims: Rims::Clear }
}

/// Thick and thin, soft and stiff, slack and stretched.
pub const WRAPPED: [Wrapped; 4] = [
    wrapped([0.45e6, 2e-3, 1.0, 0.8e6]),
    wrapped([0.45e6, 0.5e-3, 1.0, 0.2e6]),
    wrapped([2e6, 5e-3, 1.0, 0.4e6]),
    wrapped([0.45e6, 2e-3, 1.1, 0.1e6]),
];

/// Thin, and pressed lightly by contacts that hardly yield.
const LIGHTLY: Wrapped =
    Wrapped { stiffness: 1e6, rims: Rims::Flush, ..wrapped([1.8e6, 0.5e-3, 1.0, 100.0]) };
/// Shortened and lengthened by these.
const STRAINS: [f64; 2] = [2e-3, -2e-3];

impl Wrapped {
    /// What a strain may miss of the first-order formulas.
    fn first_order(&self, strain: f64) -> f64 {
        3.0 * strain.abs() + self.thickness / RADIUS
    }
}

/// Puts the rims of the membrane at `radius` [m].
fn put_rims(rig: &mut Rig, radius: f64) -> Result<()> {
    let (Some(membrane), Some(cover)) = (&mut rig.model.membrane, &mut rig.model.cover) else {
        return Ok(());
    };
    let first = rig.model.bodies.len();
    for node in membrane.nodes.iter_mut().filter(|node| node.body < first) {
        let wider = radius / node.point.xy().norm();
        (node.point.x, node.point.y) = (wider * node.point.x, wider * node.point.y);
    }
    *cover = cover.glued_anew(|node| (membrane.nodes[node].body, membrane.nodes[node].point))?;
    Ok(())
}

pub(super) fn pressed(findings: &mut Findings) {
    for wrapped in WRAPPED {
        let (found, time) = timed(|| wrapped.excess());
        let (off, steps, note) = match found {
            Ok(Some((off, steps))) => (off, steps, String::new()),
            Ok(None) => (f64::NAN, 0, "a membrane did not come to lie".into()),
            Err(error) => (f64::NAN, 0, error.to_string()),
        };
        let Wrapped { modulus, thickness, stretch, pressure, .. } = wrapped;
        let what = format!(
            "core stress less its closed form over p = {pressure:.1e} Pa, {:.1} mm of {modulus:.1e} Pa, stretched {stretch}",
            1e3 * thickness
        );
        findings.compare(what, off, 0.0, Absolute(HELD), (steps, time, note));
    }
    for strain in STRAINS {
        let (found, time) = timed(|| LIGHTLY.correction(strain));
        let (parts, steps, note) = match found {
            Ok(Some((parts, steps))) => (parts, steps, String::new()),
            Ok(None) => ([f64::NAN; 2], 0, "a membrane did not come to lie".into()),
            Err(error) => ([f64::NAN; 2], 0, error.to_string()),
        };
        let tolerance = Absolute(LIGHTLY.first_order(strain));
        let expected = if strain > 0.0 { [0.0, 1.0] } else { [1.0, 0.0] };
        let names = ["4 E_m t e/D, axial", "E_m t e/D, radial"];
        for ((part, expected), name) in parts.into_iter().zip(expected).zip(names) {
            let what = format!("membrane correction at a strain of {strain} over {name}");
            findings.compare(what, part, expected, tolerance, (steps, time, note.clone()));
        }
    }
}
