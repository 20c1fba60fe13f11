//! From one equilibrium to the next: Newton with line search inside proximal augmentations, step
//! control, dwell at instabilities. Every increment ends in a status; nothing here is an error.

pub mod equilibrium;
pub mod increment;
pub mod newton;
pub mod settings;

pub use equilibrium::{Balance, Equilibrium};
pub use increment::{Increment, IncrementReport, StepStatus, advance};
pub use settings::Settings;

#[cfg(test)]
mod tests;
