//! The triaxial rig: a specimen between plates under a cover, its stages, its measures and its
//! energy ledger. Measures count compression positive; forces and poses underneath do not.

pub mod chains;
pub mod deformation;
mod drive;
mod fidelity;
pub mod measures;
pub mod network;
pub mod response;
pub mod rig;
mod rubber;
mod sheet;
pub mod stage;
mod starts;
pub mod summary;
pub mod test;
mod watch;
pub mod zones;

pub use deformation::LocalStrain;
pub use measures::{Measures, Picture};
pub use rig::{Cover, Rig, RigParameters, RigState, Rims};
pub use sheet::RubberSheet;
pub use stage::{Lateral, Path, Stage, Steps, Until};
pub use summary::{StageCurve, StageSummary};
pub use test::{Row, StepReport, Test};
