//! Shapes and distances without mechanics: polyhedra, convex hulls, separating axes, searches.

pub mod polyhedron;
pub mod rounded;

pub use polyhedron::{Edge, Polyhedron};
