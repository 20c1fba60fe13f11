//! One grain between two rigid plates, driven by displacement: crushing tests on a sphere, a disc, a block or a grain.
//!
//! The plates are normal to z. Contact is nodal (every surface node against both planes, as far as the plates reach), small displacements throughout,
//! damage staggered: the contact forces under frozen damage, then more damage from the strains, until
//! nothing moves. Where softening outruns the plates (snap-back) that loop rebalances at fixed plates; the energy it sets free beyond what damage takes is
//! booked as stabilisation.
//!
//! A grain that comes apart goes on as [`Part`]s that stand between the plates side by side. Not modelled: contact of these parts with one another, and
//! sliding with friction (a touching node sticks or is free to slide).
//!
//! `scene::press` drives the parts as a stage of a scene.

mod bench;
mod part;

pub use bench::{Bench, Contact, Grip, Memory, Patches, Plate, Push};
pub use part::{Kept, Limits, Part, Settled};
