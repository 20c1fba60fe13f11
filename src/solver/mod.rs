//! From one accepted state to the next: implicit steps against a drag, each solved by Newton's iterations, and the control of increments. Every
//! increment ends in a status; nothing here is an error.

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
pub mod newton;
pub mod pace;
mod path;
pub mod plain;
pub mod settings;
mod stabilised;
mod step;
pub mod stop;
pub mod sweep;
mod tangent;

pub use balance::Balance;
pub use damage::DamageSettings;
pub use dossier::{ContactReport, Dossier};
pub use drape::{Drape, drape};
pub use equilibrium::Equilibrium;
pub use fidelity::{Transition, Verdict};
pub use increment::{ContactMeasures, Energies, Increment, IncrementReport, StepStatus, advance};
pub use pace::{Pace, continued_poses, motion_between, work_between};
pub use plain::{TangentPart, plain_newton};
pub use settings::{Relaxation, Settings};
pub use stabilised::Stabilisation;
pub use stop::StopSignal;

#[cfg(test)]
mod tests;
