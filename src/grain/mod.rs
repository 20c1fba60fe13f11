//! A grain as a mechanical body, in body coordinates: mass, elimination onto the surface or all
//! nodes as they are, local contact stiffness, damage, fragments.
//!
//! SI units, tension positive. Loads are forces on the grain.

pub mod condensed;
pub mod damaged;
pub mod fragments;
pub mod full;
mod held;
pub mod hulls;
pub mod mass;
mod nearness;
mod pace;
mod patch;
pub mod stiffness;
pub mod stored;
pub mod surface;

pub use condensed::CondensedGrain;
pub use damaged::{Ancestry, DamageChange, DamageCommit, DamageSummary, DamagedGrain};
pub use fragments::{BreakUp, Fragment};
pub use full::FullGrain;
pub use hulls::{ContactShape, contact_shapes};
pub use mass::{MassProperties, mean_motion};
pub use patch::PATCH_OF_BODY;
pub use stored::StoredGrain;
pub use surface::{Surface, SurfacePoint};
