//! From the checked case to what is computed with: grains and their rock, a rig or a scene, stages, solver
//! settings.
//!
//! The third step of text, checked, built. Nothing here is run, measured or written. What cannot be built is
//! an error before a results file is made for a scene, and while the rig is built for a specimen. SI units.

mod grains;
mod planned_stage;
mod rig;
mod rock;
pub mod rock_samples;
mod scene;
mod scene_body;
mod settings;
mod shapes;

pub use grains::{give_rock, grain_meshes};
pub use planned_stage::{PlannedStage, planned_stages};
pub use rig::{largest_pressure, rig};
pub use scene::scene_parameters;
pub use scene_body::body_meshes;
pub use settings::energy_gate;
