//! A case of kind `scene`: from the checked case to parameters, through the stages, into the file.
//!
//! [`run`] runs a scene without a file; [`parameters`], [`history_row`] and [`body_rows`] are its parts.

use std::path::Path;

use crate::case::{BodyCase, Case, Fidelity, Geometry, PressCase, RockCase, SceneCase, ShapeCase, StageCase};
use crate::contact::law::Friction;
use crate::error::{Error, Result};
use crate::geometry::{Polyhedron, RoundedBody};
use crate::mesh::Mesh;
use crate::mesh::file::read_mesh;
use crate::model::Body;
use crate::results::{BodyRow, HistoryRow};
use crate::scene::{
    BodyLoad, LoadStage, PressParameters, Row, Scene, SceneBody, SceneParameters, SceneShape,
};
use crate::simulation::plan::damage_settings;
use crate::simulation::rock;
use crate::solver::Settings;
use crate::tensor::{Mat3, Pose, Rotation, Vec3};
use crate::triaxial::StageEnd;

use super::breaking::cell_states;
use super::contact_table::ContactTable;
use super::draws::moduli_of_scene;
use super::fields::scene_mesh;
use super::grain_stress::body_stresses;
use super::inside;
use super::kept::State;
use super::plan::PlannedStage;
use super::recorder::Recorder;
use super::shapes::{body_mesh, polyhedron, shown_mesh};

impl Recorder {
    /// Writes the bodies' meshes and the first state, or compares them with those of a continued run.
    pub(super) fn begin_scene(
        &mut self,
        case: &Case,
        scene: &Scene,
        parameters: &SceneParameters,
        folder: &Path,
    ) -> Result<()> {
        let names: Vec<&str> = scene.model.bodies.iter().map(|body| body.name.as_str()).collect();
        self.writer.set_bodies(&names)?;
        let meshes = body_meshes(case, parameters, folder)?;
        let moduli = moduli_of_scene(case, parameters, &meshes)?;
        let (mesh, points) = scene_mesh(scene, parameters, &meshes, &moduli)?;
        let first = State {
            time: 0.0,
            increment: 0,
            poses: scene.model.frames(&scene.committed.poses),
            stress: vec![Mat3::zeros(); scene.model.bodies.len()],
            local_strains: Vec::new(),
            contacts: ContactTable::default(),
            cells: Vec::new(),
            grains: Vec::new(),
            levels: scene.model.bodies.iter().map(Body::level).collect(),
        };
        self.begin_fields(mesh, points, (first, &[]))
    }

    /// Takes down an accepted increment; it is in the file when this returns.
    pub(super) fn accept_scene(
        &mut self,
        stage: &PlannedStage,
        parameters: &SceneParameters,
        scene: &Scene,
        row: &Row,
    ) -> Result<HistoryRow> {
        if self.at.stage != stage.index || row.increment == 1 {
            self.begin_stage(stage, None);
        }
        let begun = self.end_solving();
        let history = history_row(row, self.times());
        let poses = &scene.committed.poses;
        let state = State {
            time: history.time,
            increment: row.increment as u64,
            poses: scene.model.frames(poses),
            stress: match &scene.pressing {
                Some(pressing) => pressing.mean_stresses(poses.len()),
                None => body_stresses(scene, parameters, row.gravity),
            },
            local_strains: Vec::new(),
            contacts: match &scene.pressing {
                Some(pressing) => ContactTable::of_press(pressing),
                None => ContactTable::of(&scene.contacts, &scene.committed.memory, poses.len()),
            },
            cells: cell_states(&scene.model),
            grains: Vec::new(),
            levels: scene.model.bodies.iter().map(Body::level).collect(),
        };
        let insides = || inside::of_committed(&scene.model, &scene.contacts, &scene.committed, scene.loads());
        self.append(&history, &body_rows(row), state, [row.progress; 2], insides)?;
        self.hold_scene(scene)?;
        self.commit()?;
        self.took_since(begun);
        Ok(history)
    }
}

/// A mesh of each body to show it by: the one that it is condensed with, or, of a rigid one, a coarse one; `None` where
/// the generator cannot mesh that.
fn body_meshes(case: &Case, parameters: &SceneParameters, folder: &Path) -> Result<Vec<Option<Mesh>>> {
    let Geometry::Scene(scene) = &case.geometry else { return Ok(Vec::new()) };
    let mesh = |(index, (body, built)): (usize, (&BodyCase, &SceneBody))| {
        let meshed = built.grain.is_some() || built.full.is_some() || body.mesh_size.is_some();
        match meshed {
            true => body_mesh(case, index, body, folder).map(Some),
            false => shown_mesh(case, index, body, folder),
        }
    };
    scene.bodies.iter().zip(&parameters.bodies).enumerate().map(mesh).collect()
}

/// Runs the scene of `case` without a results file. `folder` is where its mesh files are relative to.
/// `observe` sees each accepted increment and says whether to go on.
///
/// # Errors
/// What [`parameters`] and [`Scene::new`] refuse.
pub fn run(case: &Case, folder: &Path, observe: impl FnMut(&Scene, &Row) -> bool) -> Result<StageEnd> {
    Ok(Scene::new(&parameters(case, folder)?)?.run(observe))
}

/// What a scene takes from its case.
///
/// # Errors
/// `Error::Usage` where the case is not a scene or asks for what a scene cannot do yet;
/// `Error::Mesh` and `Error::Io` where a mesh file cannot be used.
pub fn parameters(case: &Case, folder: &Path) -> Result<SceneParameters> {
    let Geometry::Scene(scene) = &case.geometry else {
        return Err(Error::Usage("the case has a specimen, not a scene".into()));
    };
    let friction = friction(case, case.contact.friction);
    let bodies = scene
        .bodies
        .iter()
        .enumerate()
        .map(|(index, body)| scene_body(case, index, body, folder))
        .collect::<Result<_>>()?;
    let stages = case.stages.iter().enumerate().map(load_stage).collect::<Result<_>>()?;
    Ok(SceneParameters {
        bodies,
        gravity: Vec3::from(scene.gravity),
        friction,
        faces: case.contact.faces,
        normal: case.contact.normal,
        settings: settings(case),
        increment_range: [case.solver.increment_min, case.solver.increment_max],
        stages,
        press: scene.press.as_ref().map(|press| press_of(scene, press)).transpose()?,
    })
}

fn press_of(scene: &SceneCase, press: &PressCase) -> Result<PressParameters> {
    let number = |name: &str| {
        let found = scene.bodies.iter().position(|body| body.name == name);
        found.ok_or_else(|| Error::Usage(format!("the press names {name:?}, which is no body")))
    };
    Ok(PressParameters {
        body: number(&press.body)?,
        bottom: number(&press.bottom)?,
        top: number(&press.top)?,
        grip: press.grip,
        patch: press.patch,
    })
}

/// Solver settings of a case; what it does not mention is as usual.
pub fn settings(case: &Case) -> Settings {
    let solver = &case.solver;
    Settings {
        force_tolerance: solver.force_tolerance,
        gap_tolerance: solver.gap_tolerance,
        max_augmentations: solver.max_augmentations,
        max_dwell: solver.max_dwell,
        max_newton: solver.max_newton_iterations,
        first_penalty: solver.first_penalty,
        accuracy: solver.chosen_accuracy(),
        damage: damage_settings(case),
        ..Settings::default()
    }
}

/// The row of `/history`; a scene has no strains and stresses, so those are NaN.
pub fn history_row(row: &Row, [wall_time, solving_time]: [f64; 2]) -> HistoryRow {
    let count = |n: usize| n as i64;
    HistoryRow {
        stage: count(row.stage),
        increment: count(row.increment),
        time: row.stage as f64 + row.progress,
        coordination_number: 2.0 * row.measures.pairs as f64 / row.bodies.len().max(1) as f64,
        sliding_fraction: row.measures.sliding_fraction,
        failed_points: count(row.damage.failed_points),
        deleted_cells: count(row.damage.deleted_cells),
        fragments: count(row.damage.fragments),
        condensed_bodies: count(row.fidelity.condensed),
        promoted: count(row.fidelity.promoted),
        demoted: count(row.fidelity.demoted),
        repeats: count(row.fidelity.repeats),
        fidelity_error: row.fidelity.error.unwrap_or(f64::NAN),
        resting_utilisation: row.fidelity.utilisation,
        transition_jump: row.fidelity.jump,
        augmentations: count(row.counters.augmentations),
        newton_iterations: count(row.counters.newton_iterations),
        factorisations: count(row.counters.factorisations),
        cuts: count(row.counters.cuts),
        wall_time,
        solving_time,
        out_of_balance: row.balance.out_of_balance,
        max_penetration: row.measures.max_penetration,
        energy_external: row.ledger.external,
        energy_elastic: row.ledger.elastic,
        energy_friction: row.ledger.friction,
        energy_damage: row.ledger.damage,
        energy_crushing_contacts: row.ledger.indentation,
        energy_stabilisation: row.ledger.stabilisation,
        energy_membrane: row.ledger.membrane,
        energy_error: row.ledger.error(),
        snapped: row.snapped.into(),
        unrest: row.balance.unrest,
        ..HistoryRow::UNKNOWN
    }
}

/// The rows of `/bodies`, in the order of the scene's bodies.
pub fn body_rows(row: &Row) -> Vec<BodyRow> {
    row.bodies
        .iter()
        .map(|body| BodyRow {
            position: body.position,
            rotation: body.rotation,
            displacement: body.displacement,
            force: body.contact_force,
            moment: body.contact_moment,
            reaction_force: body.reaction_force,
            reaction_moment: body.reaction_moment,
        })
        .collect()
}

/// The law of a body with this peak coefficient: the residual one is the case's, or the peak where
/// that is lower.
fn friction(case: &Case, peak: f64) -> Friction {
    Friction {
        peak,
        residual: case.contact.residual_friction.min(peak),
        weakening_distance: case.contact.weakening_distance,
    }
}

fn scene_body(case: &Case, index: usize, body: &BodyCase, folder: &Path) -> Result<SceneBody> {
    let mut rock: RockCase = body.rock.as_ref().unwrap_or(&case.rock).clone();
    let rounded = |nominal: Polyhedron| {
        let smallest = (0..3)
            .map(|k| {
                let along = nominal.vertices.iter().map(|v| v[k]);
                along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
            })
            .fold(f64::INFINITY, f64::min);
        let rounding = body.rounding.unwrap_or(case.contact.rounding * smallest);
        SceneShape::Polyhedron { nominal, rounding }
    };
    let fidelity = case.fidelity_of(body);
    let mut mesh = match fidelity {
        Fidelity::Rigid => None,
        Fidelity::Auto | Fidelity::Condensed | Fidelity::Full => Some(body_mesh(case, index, body, folder)?),
    };
    let mut density = rock.density;
    if let (ShapeCase::Sphere(radius), Some(mesh)) = (&body.shape, &mesh) {
        // A mesh lies within its ball: it is given the ball's mass.
        let ball = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
        density *= ball / mesh.convex_hull()?.volume();
        rock.density *= ball / mesh.volume();
    }
    let rock = &rock;
    let mut shape = match &body.shape {
        ShapeCase::Box(_) | ShapeCase::Polyhedron(_) | ShapeCase::Cylinder { .. } | ShapeCase::Grain(_) => {
            let hull = polyhedron(case, index, body)?;
            rounded(hull.ok_or_else(|| Error::Usage(format!("{:?} has no shape", body.name)))?)
        }
        ShapeCase::Sphere(radius) => match &mesh {
            Some(mesh) => meshed_sphere(case, body, *radius, mesh)?,
            None => SceneShape::Sphere(*radius),
        },
        ShapeCase::Mesh(file) => {
            let mesh = read_mesh(&folder.join(file))?;
            let hull = mesh.convex_hull()?;
            let filled = (hull.volume() - mesh.volume()).abs() / hull.volume();
            if filled.is_nan() || filled > 1e-6 {
                return Err(Error::Mesh {
                    name: file.clone(),
                    message: "is not convex; rigid bodies of a scene have to be, for now".into(),
                });
            }
            rounded(hull)
        }
    };
    // A body far from the point that it is placed by moves in a frame of its own.
    let mut offset = Vec3::zeros();
    if let SceneShape::Polyhedron { nominal, rounding } = &shape
        && nominal.far_middle().is_some()
        && is_left_alone(case, body)
    {
        offset = nominal.centroid();
        mesh = mesh.map(|mesh| mesh.moved(&-offset));
        shape = SceneShape::Polyhedron { nominal: nominal.moved(&-offset), rounding: *rounding };
    }
    let (mut grain, mut full) = (None, None);
    match (fidelity, mesh) {
        (Fidelity::Auto | Fidelity::Condensed, Some(mesh)) => {
            grain = Some(rock::condensed(rock, &body.name, index, mesh, (case.seed, case.contact.normal))?);
        }
        (Fidelity::Full, Some(mesh)) => {
            let nodes = case.solver.nodes();
            let (resolved, condensed) = rock::full(rock, &body.name, index, mesh, case.seed, nodes)?;
            (full, grain) = (Some(resolved), condensed);
        }
        (Fidelity::Auto | Fidelity::Rigid | Fidelity::Condensed | Fidelity::Full, _) => {}
    }
    let damaged = match grain.as_ref().filter(|_| full.is_none()) {
        Some(grain) => rock::damaged(rock, &body.name, index, grain, case.seed)?,
        None => None,
    };
    let mut pose =
        Pose::new(Vec3::from(body.position), Rotation::from_scaled_axis(Vec3::from(body.rotation)));
    pose.position += pose.rotation * offset;
    Ok(SceneBody {
        name: body.name.clone(),
        shape,
        grain,
        full,
        damaged,
        rests: fidelity == Fidelity::Auto,
        pose,
        offset,
        density,
        youngs_modulus: rock.youngs_modulus.mean,
        poissons_ratio: rock.poissons_ratio.mean,
        limit_pressure: case.limit_pressure_of(rock),
        friction: body.friction.map(|peak| friction(case, peak)),
        fixed: body.fixed,
        // What is fixed and rigid is so, unless its own rock says how it yields.
        unyielding: body.fixed && fidelity == Fidelity::Rigid && body.rock.is_none(),
    })
}

/// Whether nothing but gravity and contacts moves a body, so that it is all one about which point its motion counts.
fn is_left_alone(case: &Case, body: &BodyCase) -> bool {
    let Geometry::Scene(scene) = &case.geometry else { return false };
    let named = |stage: &StageCase| match stage {
        StageCase::Load { bodies, .. } => bodies.contains_key(&body.name),
        _ => false,
    };
    scene.press.is_none() && (body.fixed || !case.stages.iter().any(named))
}

/// A meshed sphere is the hull of its surface nodes, corners on the sphere.
fn meshed_sphere(case: &Case, body: &BodyCase, radius: f64, mesh: &Mesh) -> Result<SceneShape> {
    let nominal = mesh.convex_hull()?;
    let rounding = body.rounding.unwrap_or(case.contact.rounding * 2.0 * radius);
    let core = nominal.scaled(1.0 - rounding / radius);
    Ok(SceneShape::Rounded { nominal, rounded: RoundedBody { core, radius: rounding } })
}

fn load_stage((index, stage): (usize, &StageCase)) -> Result<LoadStage> {
    match stage {
        StageCase::Load { increments, bodies, gravity } => Ok(LoadStage {
            increments: *increments,
            bodies: bodies
                .iter()
                .map(|(name, load)| {
                    let load = BodyLoad {
                        displacement: load.displacement,
                        rotation: load.rotation,
                        force: load.force,
                        moment: load.moment,
                    };
                    (name.clone(), load)
                })
                .collect(),
            gravity: gravity.map(Vec3::from),
        }),
        StageCase::Hold { increments } => Ok(LoadStage { increments: *increments, ..LoadStage::default() }),
        StageCase::Consolidate { .. }
        | StageCase::Shear { .. }
        | StageCase::StressShear { .. }
        | StageCase::Unload { .. }
        | StageCase::Reload { .. }
        | StageCase::Oedometer { .. }
        | StageCase::ConstantVolume { .. }
        | StageCase::ConstantP { .. } => Err(Error::Usage(format!(
            "$.stages[{index}].kind: a scene has no stage {:?}; accepted: \"load\", \"hold\"",
            stage.kind()
        ))),
    }
}
