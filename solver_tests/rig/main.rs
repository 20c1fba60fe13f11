//! The triaxial rig on a specimen of sixteen grains: stages, covers, stresses and energies.

mod ledger;
mod ready;
mod stages;
mod wall;
