//! The checked case: plain data in SI. What stands here was found sound by `RawCase::check`.
//!
//! Tension is positive except where a field says otherwise: pressures and axial strains of the
//! stages count compression positive, as in soil mechanics.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::contact::asperity::{LIMIT_OVER_STRENGTH, NormalLaw};
use crate::contact::face::FaceContact;
use crate::crushing::Grip;
use crate::specimen::{SievePoint, SpecimenParameters, SpecimenSize, Unreachable, WithinClass};
use crate::tensor::Vec3;
use crate::triaxial::Rims;

pub use super::packed::{PackedCase, PackingCase};
pub use super::stage::{StageCase, StrainedCase, UntilCase};
pub use crate::material::Law as Scatter;
pub use crate::scene::BodyLoad;

/// Cells across a deformable body's smallest extent where no `mesh_size` is given.
const CELLS_ACROSS: f64 = 3.0;
/// Cells of a random grain whose case gives no `mesh_size`: those of a specimen's.
pub const GRAIN_CELLS: usize = 38;

/// A checked case; [`Case::completed`] writes it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Case {
    pub title: String,
    /// Seed of all randomness.
    pub seed: u64,
    /// Results file, relative to the case's folder, whose consolidated specimen the stages begin with.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start_from: Option<String>,
    #[serde(flatten)]
    pub geometry: Geometry,
    pub rock: RockCase,
    pub contact: ContactCase,
    /// End plates; without meaning in a scene.
    pub plates: PlatesCase,
    /// Lateral confinement; without meaning in a scene.
    pub membrane: MembraneCase,
    /// At least one.
    pub stages: Vec<StageCase>,
    pub solver: SolverCase,
    pub output: OutputCase,
    /// What was left out or put together of what the case brings in; not part of the completed case.
    #[serde(skip)]
    pub notes: Vec<String>,
    /// Files that were brought in, and whose contents are in the case now.
    #[serde(skip)]
    pub brought: Vec<String>,
    /// Cells of the mesh files of a scene, by their names.
    #[serde(skip)]
    pub cells_of_files: BTreeMap<String, usize>,
}

impl Case {
    /// How the grains of a specimen deform: chosen for each where an accuracy is asked for, else not at all.
    pub fn fidelity_of_grains(&self) -> Fidelity {
        self.settled(self.solver.fidelity)
    }

    /// How a body of a scene deforms, likewise.
    pub fn fidelity_of(&self, body: &BodyCase) -> Fidelity {
        self.settled(body.fidelity.unwrap_or(self.solver.fidelity))
    }

    /// The pressure at which a rock is crushed where it is indented [Pa]; infinite where nothing is said of it.
    pub fn limit_pressure_of(&self, rock: &RockCase) -> f64 {
        let by_strength =
            rock.compressive_strength.as_ref().map(|strength| LIMIT_OVER_STRENGTH * strength.mean);
        self.contact.limit_pressure.or(by_strength).unwrap_or(f64::INFINITY)
    }

    /// Meshes, surfaces and tables that the case reads, as it names them: relative to itself.
    pub fn files(&self) -> Vec<&str> {
        let mut files: Vec<&str> = self.brought.iter().map(String::as_str).collect();
        let Geometry::Scene(scene) = &self.geometry else { return files };
        files.extend(scene.bodies.iter().filter_map(|body| body.shape.file()));
        files
    }

    /// The rock of a body of a scene: its own, or the case's.
    pub fn rock_of<'a>(&'a self, body: &'a BodyCase) -> &'a RockCase {
        body.rock.as_ref().unwrap_or(&self.rock)
    }

    /// Whether anything depends on the meshes of grains or bodies, whose cells have values of their own then: not where all are rigid and none
    /// can break.
    pub fn meshes_act(&self) -> bool {
        let acts = |fidelity, rock: &RockCase| fidelity != Fidelity::Rigid || rock.damage.is_some();
        match &self.geometry {
            Geometry::Specimen(_) => acts(self.fidelity_of_grains(), &self.rock),
            Geometry::Scene(scene) => {
                scene.bodies.iter().any(|body| acts(self.fidelity_of(body), self.rock_of(body)))
            }
        }
    }

    fn settled(&self, fidelity: Fidelity) -> Fidelity {
        match fidelity {
            Fidelity::Auto if self.solver.accuracy.is_some() => Fidelity::Auto,
            Fidelity::Auto => Fidelity::Rigid,
            given @ (Fidelity::Rigid | Fidelity::Condensed | Fidelity::Full) => given,
        }
    }
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Geometry {
    /// A generated rockfill specimen.
    Specimen(SpecimenCase),
    /// Bodies set by hand.
    Scene(SceneCase),
}

/// A generated cylindrical specimen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SpecimenCase {
    /// As given.
    #[serde(flatten)]
    pub size: SpecimenSize,
    /// Of the compacted specimen [m]; expected, if `size` gives the number of grains.
    #[serde(skip)]
    pub diameter: f64,
    /// Of the compacted specimen [m]; expected, if `size` gives the number of grains.
    #[serde(skip)]
    pub height: f64,
    /// Number of grains; expected, if `size` gives diameter and height.
    #[serde(skip)]
    pub grains: usize,
    /// Sieve size [m] and mass fraction passing, from the largest size (1) down to the smallest (0).
    pub grading: Vec<[f64; 2]>,
    /// How sizes are drawn between neighbouring sieves.
    pub within_class: WithinClass,
    /// Volume of voids over volume of solids, after compaction.
    pub void_ratio: f64,
    /// Fewest and most vertices of a grain.
    pub vertices: [usize; 2],
    /// Least distance of a grain's vertices on the unit sphere; 0 is off.
    pub vertex_separation: f64,
    /// Vertices of the shapes that grains are drawn from, in any unit; with none they are random.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shapes: Vec<Vec<[f64; 3]>>,
    /// Another code's grains in place of drawn and placed ones.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub packing: Option<PackingCase>,
    /// What to do where compaction cannot reach `void_ratio`.
    pub unreachable: Unreachable,
    /// Tet10 cells per grain, about.
    pub cells_per_grain: usize,
}

impl SpecimenCase {
    /// What the generator takes. `rounding` is [`ContactCase::rounding`].
    pub fn parameters(&self, seed: u64, rounding: f64) -> SpecimenParameters {
        let grading = self.grading.iter().map(|&[size, passing]| SievePoint { size, passing });
        SpecimenParameters {
            grading: grading.collect(),
            size: self.size,
            void_ratio: self.void_ratio,
            unreachable: self.unreachable,
            vertices: self.vertices,
            vertex_separation: self.vertex_separation,
            rounding,
            within_class: self.within_class,
            shapes: self.shapes.iter().map(|shape| shape.iter().copied().map(Vec3::from).collect()).collect(),
            packing: self.packing.as_ref().map(PackingCase::given),
            seed,
        }
    }
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneCase {
    pub bodies: Vec<BodyCase>,
    /// Acceleration [m/s2], space axes.
    pub gravity: [f64; 3],
    /// One body between two plates, nodes against planes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub press: Option<PressCase>,
}

/// A press around a body of the scene; names are those of bodies.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PressCase {
    pub body: String,
    /// The plate below, fixed.
    pub bottom: String,
    /// The plate above, driven along z.
    pub top: String,
    pub grip: Grip,
    /// Radius of the patch of surface by which a node meets a plate [m]; `None`: the node alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub patch: Option<f64>,
}

/// A body set by hand.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodyCase {
    /// Unique in the scene; without `/`.
    pub name: String,
    pub shape: ShapeCase,
    /// Edge length of the cells [m].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh_size: Option<f64>,
    /// Where a meshed sphere has smaller cells.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refine: Option<RefineCase>,
    /// Of the reference point [m].
    pub position: [f64; 3],
    /// Rotation vector from body to space axes [rad].
    pub rotation: [f64; 3],
    /// `None`: as `SolverCase::fidelity` says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fidelity: Option<Fidelity>,
    /// The body's own rock, complete; `None`: the case's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rock: Option<RockCase>,
    /// Peak friction on this body in place of contact's. Of two touching bodies the lower value
    /// rules; the residual value of the pair is `ContactCase::residual_friction`, or the pair's
    /// peak where that is lower.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// Radius of edges and corners [m] in place of contact's ratio.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rounding: Option<f64>,
    /// All six components of motion are prescribed to zero.
    pub fixed: bool,
}

/// A ball in which a mesh is finer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RefineCase {
    /// Its centre, in body axes [m].
    pub point: [f64; 3],
    /// [m]
    pub radius: f64,
    /// Edge length in it [m].
    pub mesh_size: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ShapeCase {
    /// Full edge lengths [m], centred on the position.
    Box([f64; 3]),
    /// Radius [m], centred on the position.
    Sphere(f64),
    /// About the z axis, centred on the position [m]; a prism of so many sides.
    Cylinder { radius: f64, length: f64, sides: usize },
    /// A random grain of the case's seed, as specimens have them: limits of its size class [m]. It lies on its lowest facet, its centroid on the
    /// position.
    Grain([f64; 2]),
    /// Vertices [m] relative to the position; the body is their convex hull.
    Polyhedron(Vec<[f64; 3]>),
    /// A .vtu file, relative to the case file; nodes [m] relative to the position.
    Mesh(String),
}

impl ShapeCase {
    /// The mesh file that it is in, as the case names it.
    pub fn file(&self) -> Option<&str> {
        match self {
            ShapeCase::Mesh(file) => Some(file),
            ShapeCase::Box(_)
            | ShapeCase::Sphere(_)
            | ShapeCase::Cylinder { .. }
            | ShapeCase::Grain(_)
            | ShapeCase::Polyhedron(_) => None,
        }
    }

    /// Smallest edge of the box around the shape, along the body's own axes [m]; `None` for a mesh.
    pub fn smallest_extent(&self) -> Option<f64> {
        match self {
            ShapeCase::Box(size) => size.iter().copied().reduce(f64::min),
            ShapeCase::Sphere(radius) => Some(2.0 * radius),
            ShapeCase::Cylinder { radius, length, .. } => Some(length.min(2.0 * radius)),
            ShapeCase::Grain(sizes) => Some(sizes[0]),
            ShapeCase::Polyhedron(points) => {
                let along = |k: usize| {
                    let high = points.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max);
                    let low = points.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min);
                    high - low
                };
                (0..3).map(along).reduce(f64::min)
            }
            ShapeCase::Mesh(_) => None,
        }
    }
}

impl BodyCase {
    /// Edge length of the cells of a body that deforms, about, by default a third of its smallest extent [m]; `None` for a mesh, which
    /// has its own.
    pub fn cell_size(&self) -> Option<f64> {
        let extent = self.shape.smallest_extent()?;
        Some(self.mesh_size.unwrap_or(extent / CELLS_ACROSS))
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fidelity {
    /// Chosen per grain; never the fidelity of a single body.
    Auto,
    Rigid,
    Condensed,
    Full,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RockCase {
    /// Of solid rock [kg/m3].
    pub density: f64,
    /// [Pa]
    pub youngs_modulus: Law,
    pub poissons_ratio: Law,
    /// Uniaxial [Pa], positive. Always there if `damage` is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compressive_strength: Option<Law>,
    /// Uniaxial [Pa], positive. Always there if `damage` is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tensile_strength: Option<Law>,
    /// `None` is elastic.
    pub damage: Option<DamageCase>,
}

/// A material quantity that varies from cell to cell.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Law {
    /// Expected value, in SI.
    pub mean: f64,
    #[serde(flatten)]
    pub scatter: Scatter,
    /// Edge [m] of the cube that the mean of a Weibull law is meant for, of strengths: smaller cells are stronger. `None`: the mean is every cell's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference_size: Option<f64>,
}

/// Damage softening after Ma et al. (2011), eqs. 6-10 as corrected in `material::damage`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DamageCase {
    /// N of the softening law, above 1.
    pub exponent: f64,
    /// Damage at which an integration point fails.
    pub threshold: f64,
    /// w_c: 1 restores all stiffness in compression.
    pub recovery_in_compression: f64,
    /// w_t: 1 restores all stiffness in tension.
    pub recovery_in_tension: f64,
    /// Crack-band regularisation [J/m2]; `None` is off.
    pub fracture_energy: Option<f64>,
    /// Parts below this share of the grain as generated are dust.
    pub least_fragment: f64,
    pub rubble: RubbleCase,
    /// Without effect.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub release_steps: Option<usize>,
}

/// What becomes of cells that have failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RubbleCase {
    /// They leave, and the grain is smaller.
    Removed,
    /// They stay in the contact body of the part that they hang on to.
    Kept,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContactCase {
    /// Peak friction coefficient.
    pub friction: f64,
    /// At most `friction`.
    pub residual_friction: f64,
    /// Slip over which friction decays by 1/e [m].
    pub weakening_distance: f64,
    /// Radius of edges and corners over the grain's size (a scene body's smallest extent along
    /// its own axes; a sphere has none).
    pub rounding: f64,
    /// What parallel faces carry by.
    pub faces: FaceContact,
    /// What bears the normal force between bodies.
    pub normal: NormalLaw,
    /// Pressure at which rock is crushed at a contact of asperities [Pa]; `None`: it follows from the compressive strength.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit_pressure: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlatesCase {
    /// Friction coefficient of grains on plates; 0 is smooth.
    pub friction: f64,
    /// Of the top plate; the bottom plate is fixed.
    pub tilting: Tilting,
}

/// Whether the top plate stays level.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Tilting {
    Locked,
    Free,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum MembraneCase {
    Rubber {
        /// [m]
        thickness: f64,
        /// At small strain [Pa].
        shear_modulus: f64,
        law: RubberLawCase,
        /// Share of the modulus from the second invariant; for `mooney_rivlin`.
        mooney_share: f64,
        /// Largest `I1 - 3`; for `gent`.
        gent_limit: f64,
        /// Of the triangles [m]; `None`: from the grains.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        mesh_size: Option<f64>,
    },
    Pressure {
        /// `None`: sliding where the plates have no friction, else bonded.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rims: Option<Rims>,
    },
    RigidWall,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RubberLawCase {
    NeoHookean,
    MooneyRivlin,
    Gent,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SolverCase {
    pub fidelity: Fidelity,
    /// Relative error that fidelity `auto` may cause; `None`: `auto` is one fidelity for all bodies.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<f64>,
    /// Without effect.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub full_nodes: Option<NodesCase>,
    /// Out-of-balance force over the mean contact force.
    pub force_tolerance: f64,
    /// Mean force out of balance on a body over the mean contact force; `None`: strict balance. Specimens only.
    pub stabilisation: Option<f64>,
    /// Without effect.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rough_tolerance: Option<f64>,
    /// Mismatch of gaps and contact forces of bodies that deform, over the median size.
    pub gap_tolerance: f64,
    /// Of contacts of condensed bodies, over the default.
    pub first_penalty: f64,
    /// Before an increment is cut.
    pub max_augmentations: usize,
    /// Behind a fall, where the smallest increment does not balance; zero: stop there. Scenes only.
    pub max_dwell: usize,
    /// In one augmentation.
    pub max_newton_iterations: usize,
    /// Largest change of damage at a point between two augmentations.
    pub damage_change: f64,
    /// Smallest increment over the stage's.
    pub increment_min: f64,
    /// Largest increment over the stage's.
    pub increment_max: f64,
    /// Growth of increments after easy ones.
    pub increment_growth: f64,
    /// What an increment does whose energy closes worse than `energy_tolerance`; `None`: nothing.
    pub energy_gate: Option<GateCase>,
    /// Energy error of an increment over its work.
    pub energy_tolerance: f64,
}

impl SolverCase {
    /// The accuracy, where fidelities are chosen for it.
    pub fn chosen_accuracy(&self) -> Option<f64> {
        self.accuracy.filter(|_| self.fidelity == Fidelity::Auto)
    }
}

/// What became of the nodes of full bodies in a solve; they are always eliminated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NodesCase {
    Eliminated,
    Unknowns,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GateCase {
    /// It counts as poorly closed.
    Warn,
    /// It is cut, down to the smallest.
    Cut,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutputCase {
    /// Axial strain between saved states; the share of the stage in stages without strain.
    pub fields_every: f64,
    pub contacts: bool,
    /// Increments between restart points.
    pub restart_every: usize,
}
