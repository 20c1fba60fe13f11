//! Shapes and distances without mechanics: polyhedra, convex hulls, separating axes, searches.

mod hull;
pub mod planar;
pub mod neighbours;
pub mod polyhedron;
pub mod rounded;
pub mod separation;

pub use polyhedron::{Edge, Polyhedron};
pub use rounded::RoundedBody;
