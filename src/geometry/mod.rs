//! Shapes and distances without mechanics: polyhedra, convex hulls, separating axes, searches.

pub mod polyhedron;

pub use polyhedron::{Edge, Polyhedron};
