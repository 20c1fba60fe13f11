//! From one accepted state to the next: implicit steps against a drag, each solved by Newton's iterations. Every increment ends in a status;
//! nothing here is an error.

pub mod audit;
pub mod balance;
pub mod control;
pub mod damage;
pub mod dossier;
pub mod drape;
mod dynamic_relaxation;
pub mod equilibrium;
pub mod fidelity;
pub mod increment;
mod few;
mod motion;
pub mod newton;
mod path;
pub mod plain;
pub mod settings;
mod stabilised;
mod step;
pub mod stop;
pub mod sweep;
mod system;
mod tangent;

pub use balance::Balance;
pub use dossier::{ContactReport, Dossier};
pub use drape::{Drape, drape};
pub use equilibrium::Equilibrium;
pub use fidelity::{Transition, Verdict};
pub use increment::{ContactMeasures, Energies, Increment, IncrementReport, StepStatus, advance};
pub use motion::{continued_poses, motion_between, motion_vector};
pub use plain::plain_newton;
pub use settings::{DamageSettings, Relaxation, Settings, Stabilisation};
pub use stop::StopSignal;

#[cfg(test)]
mod tests;
