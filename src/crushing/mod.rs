//! One grain between two rigid plates, driven by displacement: crushing tests on a sphere, a disc, a block or a grain.
//!
//! The plates are normal to z: the lower one fixed, the upper one moving. Contact is nodal (every surface node against both
//! planes), small displacements throughout, damage staggered: the contact forces under frozen damage, then more damage from the strains, until
//! nothing moves. Where softening outruns the plates (snap-back) that loop is a dwell at fixed plates; the energy it sets free beyond what damage takes is
//! booked as stabilisation.
//!
//! Not modelled: contact between the parts of a broken grain. A test ends when the grain comes apart.

mod press;

pub use press::{Ending, Grip, Press, Record, Row, crush};
