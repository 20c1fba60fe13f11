//! Contact between rounded convex bodies: which features are near each other, the force that each
//! such feature pair transmits, and what a contact remembers.
//!
//! Every body is a convex core rounded by a radius. One contact per vertex and opposite core (the
//! distance to a convex set is continuously differentiable outside it, so facet edges inside a
//! face cannot be felt) and one per pair of edges whose closest points lie inside both, with a
//! weight that fades towards the edges' ends and for nearly parallel edges; two vertices that face each other
//! share one. Two faces that are all but parallel may share a patch in the place of their corners and edges
//! ([`face`], where a model's shapes have faces). The force is the
//! derivative of an energy, weights included, plus friction; it is a continuous function of the
//! configuration (docs/formulation.md, sections 3 to 5; after the barrier-type distances of
//! Li et al. 2020, "Incremental potential contact", ACM Trans. Graph. 39(4)).
//!
//! Units SI. A gap is positive when open; `overlap = -gap`. Forces are on body `b` unless said.

pub mod asperity;
pub mod corner;
pub mod face;
pub mod features;
pub mod force;
mod friction;
pub mod law;
pub mod membrane;
pub mod memory;
pub mod patch;
mod patched;
pub mod point_memory;
pub mod mortar;
pub mod search;
pub mod state;
pub mod visit;
mod wrench;

pub use asperity::{Asperity, NormalLaw};
pub use corner::Corner;
pub use face::{Face, FaceShare};
pub use features::{Feature, Site};
pub use force::{Evaluation, Kinematics};
pub use law::ContactLaw;

pub use membrane::{MembraneContact, MembraneContactLaw, MembraneForce, MembraneTangent};
pub use memory::{ContactKey, Crushable, Crushed, Memory, PairMemory, PointMemory};
pub use mortar::Mortar;
pub use search::{ContactShape, Neighbours, PairFeatures};
