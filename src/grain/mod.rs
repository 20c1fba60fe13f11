//! A grain as a mechanical body, in body coordinates: mass, elimination onto the surface, local
//! contact stiffness.
//!
//! SI units, tension positive. Loads are forces on the grain.

pub mod condensed;
mod held;
pub mod local;
pub mod mass;
pub mod stiffness;
pub mod surface;

pub use condensed::CondensedGrain;
pub use local::LocalStiffness;
pub use mass::MassProperties;
pub use surface::{Surface, SurfacePoint};
