//! The triaxial rig: a specimen between plates under a cover, its stages, its measures and its
//! energy ledger. Measures count compression positive; forces and poses underneath do not.

pub mod measures;
pub mod rig;
pub mod stage;

pub use measures::{Ledger, Measures};
pub use rig::{Rig, RigParameters};
pub use stage::{Row, Stage, StageEnd, StepReport, Test};
