//! Element kernels: shape functions, quadrature, the straight-sided tet10, the membrane triangle, the
//! pressure facet.
//!
//! Tension positive, SI. Strains in the Voigt order of [`crate::material`]: xx, yy, zz, xy, yz, zx,
//! engineering shear. Node order as in [`crate::mesh`].

pub mod membrane;
pub mod pressure_facet;
pub mod tet10;

pub use membrane::{MembraneForces, MembraneTriangle};
pub use tet10::{POINT_COUNT, POINTS, StraightTet10};
