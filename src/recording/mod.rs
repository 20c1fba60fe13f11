//! From the model to the results file: rows, tables, saved states and restart points. The only place where
//! physics meets HDF5.
//!
//! [`Recorder`] writes a run as it goes on: an accepted increment is in the file before the next one begins.
//! Tables are made of a model as it is committed and change nothing in it. SI units; the history of a
//! triaxial test counts compression positive.

mod breakage_meter;
mod breaking;
mod cell_fields;
mod contact_table;
mod fields;
mod grain_stress;
mod history_row;
mod profile;
mod recorder;
pub mod restart;
mod restart_data;
mod rock_table;
mod scene;
mod specimen_table;
mod stage_table;
mod sums;
mod target;

pub use fields::GrainMeshes;
pub use profile::Profile;
pub use recorder::Recorder;
pub use restart_data::{Consolidated, Origin, ScenePoint, TestPoint};
pub use specimen_table::Generated;
pub use sums::StageWork;
pub use target::{Target, check_target, followed};
