//! The triaxial rig on a specimen of sixteen grains: stages, covers, stresses and energies.

mod behind;
mod breaking;
mod chosen;
mod hundred;
mod ledger;
mod ready;
mod recorded;
mod resolved;
mod rubber;
mod seating;
mod smooth;
mod stages;
mod wall;
mod weak;
