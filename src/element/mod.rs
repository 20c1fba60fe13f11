//! Element kernels: shape functions, quadrature, the straight-sided tet10 at small and finite strain, the
//! membrane triangle, the pressure facet.
//!
//! Tension positive, SI. Strains in the Voigt order of [`crate::material`]: xx, yy, zz, xy, yz, zx,
//! engineering shear. Node order as in [`crate::mesh`].

pub mod membrane;
pub mod pressure_facet;
pub mod tet10;
pub mod total_lagrangian;

pub use membrane::{MembraneForces, MembraneTriangle};
pub use tet10::{POINT_COUNT, POINTS, StraightTet10};
pub use total_lagrangian::{Cell, Strains};
