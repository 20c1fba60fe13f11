//! The model of a specimen between two rigid plates under a pressure cover, in a rubber membrane or in a rigid wall.

use std::borrow::Cow;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::assembly::{Contacts, Failing};
use crate::contact::NormalLaw;
use crate::contact::face::FaceContact;
use crate::contact::law::Friction;
use crate::contact::{ContactLaw, ContactShape};
use crate::error::Result;
use crate::geometry::{Polyhedron, RoundedBody};
use crate::grain::DamagedGrain;
use crate::model::cover::{Outline, Rim};
use crate::model::fracture::Fracture;
use crate::model::{
    Body, BodyKind, Breakage, Committed, Deformation, Loads, Model, PressureCover, RigidWall,
    STIFFNESS_RATIO, StoredBodies,
};
use crate::solver::{Dossier, Settings};
use crate::specimen::Specimen;
use crate::tensor::{self, Pose, Rotation, Vec3};
use crate::triaxial::sheet::RubberSheet;

/// What the rig needs besides the specimen.
#[derive(Debug, Clone, PartialEq)]
pub struct RigParameters {
    /// [kg/m^3]
    pub density: f64,
    /// Mean Young's modulus of the rock [Pa].
    pub youngs_modulus: f64,
    pub poissons_ratio: f64,
    pub friction: Friction,
    pub plate_friction: Friction,
    /// What parallel faces carry by.
    pub faces: FaceContact,
    /// What bears the normal force between rigid grains, and the pressure at which their rock is crushed by it [Pa].
    pub normal: NormalLaw,
    pub limit_pressure: f64,
    pub cover: Cover,
    /// Whether the top plate is free to tilt; else it stays level.
    pub tilting: bool,
}

/// What confines the specimen at its side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cover {
    /// A weightless flexible cover glued to the outermost grains; its rims are bonded to the plates or slide along them.
    Pressure(Rims),
    /// A rubber membrane in contact with the grains.
    Rubber(RubberSheet),
    /// A rigid frictionless cylinder whose mean pressure is the confining pressure.
    RigidWall,
}

/// How the rims of a pressure cover go with the plates; see [`PressureCover`]'s module.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Rims {
    Bonded,
    Sliding,
}

/// A triaxial test in progress.
#[derive(Debug, Clone)]
pub struct Rig {
    pub model: Model,
    pub committed: Committed,
    pub contacts: Contacts,
    pub settings: Settings,
    pub bottom: usize,
    pub top: usize,
    /// Volume of all grains [m^3].
    pub solid_volume: f64,
    /// Volume between the walls of the compaction over that of the cover as it was draped, or of the membrane
    /// as it was laid.
    pub nominal_ratio: f64,
    /// Pressure in force [Pa].
    pub pressure: f64,
    /// Whether the top plate is free to tilt.
    pub tilting: bool,
    /// Of a pressure cover.
    pub rims: Rims,
    /// What the last increment leaves to break up.
    pub failing: Failing,
    /// Of the last increment that could not be solved; not stored.
    pub dossier: Option<Dossier>,
}

/// How a body deforms and breaks, taken from it for a while.
#[derive(Debug, Clone)]
pub struct Elasticity {
    deformation: Deformation,
    breakage: Breakage,
}

/// What changes of a rig during a test. The rest follows from the specimen, parameters and settings.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct RigState<'a> {
    committed: Cow<'a, Committed>,
    contacts: Cow<'a, Contacts>,
    pressure: f64,
    nominal_ratio: f64,
    bodies: StoredBodies<'a>,
    failing: Cow<'a, Failing>,
}

impl RigState<'_> {
    /// Pressure in force [Pa].
    pub fn pressure(&self) -> f64 {
        self.pressure
    }
}

impl Rig {
    /// The state to store, so that a test can go on from here to the same bits.
    pub fn state(&self) -> RigState<'_> {
        // Every field by name: a new one is either rebuilt by `new` or has to be stored.
        let Rig {
            model,
            committed,
            contacts,
            settings: _,
            bottom: _,
            top: _,
            solid_volume: _,
            pressure,
            nominal_ratio,
            tilting: _,
            failing,
            rims: _,
            dossier: _,
        } = self;
        RigState {
            committed: Cow::Borrowed(committed),
            contacts: Cow::Borrowed(contacts),
            pressure: *pressure,
            nominal_ratio: *nominal_ratio,
            bodies: model.stored_bodies(),
            failing: Cow::Borrowed(failing),
        }
    }

    /// Takes a stored state; `false`, and nothing is changed, where it belongs to another specimen.
    ///
    /// # Errors
    /// `Error::Mesh` where a grain that broke cannot be made anew.
    pub fn restore(&mut self, state: RigState<'_>) -> Result<bool> {
        let mut model = self.model.clone();
        let fits = model.restore_bodies(state.bodies)?
            && state.committed.poses.len() == model.carriers()
            && state.contacts.fit(model.bodies.len());
        if fits {
            self.model = model;
            self.failing = state.failing.into_owned();
            self.committed = state.committed.into_owned();
            self.contacts = state.contacts.into_owned();
            self.pressure = state.pressure;
            self.nominal_ratio = state.nominal_ratio;
        }
        Ok(fits)
    }

    /// Breaks up what the last increment left to; what broke. Bodies that bend are rigid meanwhile, with the forces that they have: their displacements are of
    /// the shapes that they had.
    ///
    /// # Errors
    /// `Error::Mesh` where a part cannot be made.
    pub fn break_up(&mut self) -> Result<Vec<Fracture>> {
        if self.failing.is_empty() {
            return Ok(Vec::new());
        }
        let failing = std::mem::take(&mut self.failing);
        let bodies = &self.model.bodies;
        let bending: Vec<usize> = failing
            .bodies()
            .filter(|body| bodies[*body].is_brittle() && bodies[*body].is_elastic())
            .collect();
        self.change_fidelity([&[], &bending]);
        let displacements = failing.displacements(self.model.bodies.len());
        let fractures = self.model.break_up(&mut self.committed, &displacements, |_| false)?;
        if !fractures.is_empty() {
            self.contacts.forget_bodies();
        }
        for fracture in &fractures {
            tracing::debug!(
                body = fracture.body,
                parts = ?fracture.parts,
                deleted_cells = fracture.deleted_cells,
                crushed_volume = fracture.crushed_volume,
                lost_parts = fracture.lost_parts,
                lost_energy = fracture.lost_energy,
                "broken"
            );
        }
        self.contacts.inherit(&self.model, &mut self.committed, &fractures);
        let of_bending = fractures.iter().filter(|fracture| bending.contains(&fracture.body));
        let parts: Vec<usize> = of_bending.flat_map(|fracture| fracture.parts.iter().copied()).collect();
        self.change_fidelity([&parts, &[]]);
        Ok(fractures)
    }

    /// Places the specimen between plates and drapes the cover.
    pub fn new(specimen: &Specimen, parameters: &RigParameters, settings: Settings) -> Result<Self> {
        let modulus = parameters.youngs_modulus / (1.0 - parameters.poissons_ratio.powi(2));
        let mut bodies = Vec::new();
        let mut shapes = Vec::new();
        let mut solid_volume = 0.0;
        for (index, grain) in specimen.grains.iter().enumerate() {
            let volume = grain.nominal.volume();
            solid_volume += volume;
            let size = (6.0 * volume / std::f64::consts::PI).cbrt();
            bodies.push(Body {
                mass: parameters.density * volume,
                limit_pressure: parameters.limit_pressure,
                ..Body::rigid(
                    format!("grain {index}"),
                    BodyKind::Grain,
                    grain.nominal.clone(),
                    STIFFNESS_RATIO * modulus * size,
                    0.5 * size,
                )
            });
            shapes.push(ContactShape::new(grain.rounded.clone()));
        }
        let rounding = shapes.iter().map(|s| s.rounded.radius).fold(0.0, f64::max);
        let (radius, height) = (0.5 * specimen.diameter, specimen.height);
        let thickness = 0.2 * radius;
        let size = [4.0 * radius, 4.0 * radius, thickness];
        let nominal = Polyhedron::cuboid(size)?;
        let core = Polyhedron::cuboid(size.map(|s| s - 2.0 * rounding))?;
        let (bottom, top) = (bodies.len(), bodies.len() + 1);
        let mut poses = specimen.poses.clone();
        for (name, z) in [("bottom plate", -0.5 * thickness), ("top plate", height + 0.5 * thickness)] {
            bodies.push(Body {
                friction: Some(parameters.plate_friction),
                ..Body::rigid(name, BodyKind::Plate, nominal.clone(), f64::INFINITY, radius)
            });
            shapes.push(ContactShape::new(RoundedBody { core: core.clone(), radius: rounding }));
            poses.push(Pose::new(Vec3::new(0.0, 0.0, z), Rotation::identity()));
        }
        let smallest = shapes.iter().map(|s| s.rounded.radius).fold(f64::INFINITY, f64::min);
        let law = ContactLaw::of_rock(smallest, parameters.poissons_ratio);
        let model = Model::new(bodies, shapes, law, parameters.friction).with_faces(parameters.faces);
        let model = model.with_normal(parameters.normal);
        let mut rig = Rig {
            model,
            committed: Committed::new(poses),
            contacts: Contacts::default(),
            settings,
            bottom,
            top,
            solid_volume,
            nominal_ratio: 1.0,
            pressure: 0.0,
            tilting: parameters.tilting,
            rims: match parameters.cover {
                Cover::Pressure(rims) => rims,
                Cover::Rubber(_) | Cover::RigidWall => Rims::Bonded,
            },
            failing: Failing::default(),
            dossier: None,
        };
        match &parameters.cover {
            Cover::Rubber(sheet) => rig.wrap(sheet, specimen.diameter)?,
            Cover::Pressure(_) => rig.drape(specimen.diameter)?,
            Cover::RigidWall => rig.enclose(),
        }
        let between_walls = std::f64::consts::PI * radius * radius * height;
        rig.nominal_ratio = between_walls / rig.volume(&rig.committed.poses);
        Ok(rig)
    }

    /// Has the grains deform and break like this, in their order; before anything has moved.
    pub fn make(&mut self, grains: impl IntoIterator<Item = (Deformation, Option<Arc<DamagedGrain>>)>) {
        for (body, (deformation, damaged)) in self.model.bodies.iter_mut().zip(grains) {
            body.deformation = deformation;
            body.breakage = damaged.map_or(Breakage::Never, Breakage::Brittle);
        }
        self.model.begin_damage();
    }

    /// Puts a rigid wall around the grains, touching the outermost.
    fn enclose(&mut self) {
        let mut reach: f64 = 0.0;
        let shapes = self.model.shapes.iter().zip(&self.model.bodies).zip(&self.committed.poses);
        for ((shape, _), pose) in shapes.filter(|((_, body), _)| body.kind == BodyKind::Grain) {
            let core = shape.rounded.core.vertices.iter();
            reach = core.map(|v| pose.to_space(v).xy().norm() + shape.rounded.radius).fold(reach, f64::max);
        }
        let half =
            |body: usize| self.model.bodies[body].nominal.vertices.iter().map(|v| v.z).fold(0.0, f64::max);
        let faces = [half(self.bottom), -half(self.top)];
        let (wall, pose) = RigidWall::new(self.model.bodies.len(), [self.bottom, self.top], faces, reach);
        self.committed.poses.push(pose);
        self.model.wall = Some(wall);
    }

    /// Makes all grains rigid; `None` where they are.
    pub fn stiffen(&mut self) -> Option<Vec<Elasticity>> {
        let taken = |body: &mut Body| Elasticity {
            deformation: std::mem::take(&mut body.deformation),
            breakage: std::mem::take(&mut body.breakage),
        };
        self.model.has_elastic().then(|| self.model.bodies.iter_mut().map(taken).collect())
    }

    /// Lets them deform again, undisplaced; contacts are as if they had just been made.
    pub fn soften(&mut self, elasticity: Vec<Elasticity>) {
        for (body, Elasticity { deformation, breakage }) in self.model.bodies.iter_mut().zip(elasticity) {
            (body.deformation, body.breakage) = (deformation, breakage);
        }
        // Pairs know the stiffness of their bodies.
        self.begin_contacts_anew();
    }

    /// Lays a new cover over the grains where they are now. Its rims are circles of the radius
    /// that the cover has on the side, so that the pressure near the plates acts sideways.
    fn drape(&mut self, diameter: f64) -> Result<()> {
        let loose = self.draped(0.5 * diameter)?;
        let fitting = self.draped(loose.statistics().mean_radius)?;
        self.model.cover = Some(fitting);
        Ok(())
    }

    /// Lays a new cover where the one that there is has been folded by grains that turned and fell; whether it did. Work goes on cover
    /// by cover; the nominal void ratio goes on, as strains do.
    pub fn mend_cover(&mut self) -> bool {
        let poses = &self.committed.poses;
        let Some(folded) = self.model.cover.as_ref().filter(|_| self.model.membrane.is_none()) else {
            return false;
        };
        let (before, volume) = (folded.inward_facets(poses), self.volume(poses));
        if before == 0 {
            return false;
        }
        // Plates are twice as wide as the specimen as generated.
        let corners = self.model.bodies[self.bottom].nominal.vertices.iter();
        let fitting = self
            .draped(0.5 * corners.map(|v| v.x).fold(0.0, f64::max))
            .and_then(|loose| self.draped(loose.statistics().mean_radius));
        match fitting {
            Ok(fitting) if fitting.inward_facets(poses) < before => {
                self.model.cover = Some(fitting);
                let after = self.volume(&self.committed.poses);
                self.nominal_ratio *= volume / after;
                tracing::debug!(folded = before, volume, after, "a new cover");
                true
            }
            Ok(_) => false,
            Err(error) => {
                tracing::debug!(%error, "no new cover");
                false
            }
        }
    }

    fn draped(&self, rim_radius: f64) -> Result<PressureCover> {
        let poses = &self.committed.poses;
        let grains: Vec<usize> =
            (0..self.model.bodies.len()).filter(|&i| self.model.bodies[i].kind == BodyKind::Grain).collect();
        let outlines: Vec<Outline<'_>> = grains
            .iter()
            .map(|&body| Outline {
                body,
                core: &self.model.shapes[body].rounded.core,
                rounding: self.model.shapes[body].rounded.radius,
                pose: poses[body],
            })
            .collect();
        let median = self.median_size();
        let rim = |body: usize, sign: f64| {
            let half = self.model.bodies[body].nominal.vertices.iter().map(|v| v.z).fold(0.0, f64::max);
            let pose = poses[body];
            Rim { body, pose, centre: pose.position + Vec3::new(0.0, 0.0, sign * half), radius: rim_radius }
        };
        let rims = [rim(self.bottom, 1.0), rim(self.top, -1.0)];
        let cover = PressureCover::drape(&outlines, &rims, 0.4 * median, 0.5 * median)?;
        match self.rims {
            Rims::Bonded => Ok(cover),
            Rims::Sliding => cover.sliding(poses),
        }
    }

    /// Median over the grains of the diameter of the ball of equal volume [m].
    pub(super) fn median_size(&self) -> f64 {
        let grains = self.model.bodies.iter().filter(|body| body.kind == BodyKind::Grain);
        let sizes = grains.map(|body| (6.0 * body.nominal.volume() / std::f64::consts::PI).cbrt());
        tensor::median(sizes).unwrap_or(0.0)
    }

    /// Everything held but the grains and the membrane; the top plate's vertical free where `top_free`,
    /// its tilt where it may.
    pub fn loads(&self, top_free: bool, pressure: f64) -> Loads {
        let mut loads = Loads::none(self.model.bodies.len());
        loads.prescribed[self.bottom] = [true; 6];
        loads.prescribed[self.top] = [true, true, !top_free, !self.tilting, !self.tilting, true];
        for (held, body) in loads.prescribed.iter_mut().zip(&self.model.bodies) {
            if body.kind == BodyKind::Gone {
                *held = [true; 6];
            }
        }
        match &self.model.wall {
            Some(_) => loads.free_radius(),
            None => loads.free_nodes(self.model.carriers() - self.model.bodies.len()),
        }
        loads.pressure = pressure;
        loads
    }

    /// Enclosed volume [m^3] at `poses`, without the inner half of a rubber membrane; zero without a cover.
    pub fn volume(&self, poses: &[Pose]) -> f64 {
        self.model.enclosed_volume(poses) - self.rubber_inside()
    }

    /// Volume of a rubber membrane's inner half [m^3], which is enclosed and not the specimen's.
    pub fn rubber_inside(&self) -> f64 {
        self.model.membrane.as_ref().map_or(0.0, |m| 0.5 * m.rubber_volume())
    }

    /// Distance between the plates' inner faces [m].
    pub fn height(&self, poses: &[Pose]) -> f64 {
        let covered = self.model.cover.as_ref().map(|cover| cover.height(poses));
        covered.or_else(|| self.model.wall.as_ref().map(|wall| wall.height(poses))).unwrap_or(0.0)
    }
}
