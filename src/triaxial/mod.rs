//! The triaxial rig: a specimen between plates under a cover, its stages, its measures and its
//! energy ledger. Measures count compression positive; forces and poses underneath do not.

mod drive;
pub mod ledger;
pub mod measures;
pub mod rig;
pub mod stage;
pub mod test;

pub use ledger::{EnergyGate, Ledger};
pub use measures::Measures;
pub use rig::{Rig, RigParameters};
pub use stage::{Lateral, Path, Stage, StageEnd, Steps, Until};
pub use test::{Row, StepReport, Test};
