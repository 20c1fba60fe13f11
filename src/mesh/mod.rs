//! Meshes of ten-node tetrahedra: generation, quality, surface, parts and files; the membrane's
//! cylinder of triangles.
//!
//! Every cell is straight-sided, its mid-side nodes half-way along the edges. Lengths in metres,
//! in body coordinates. Nodes of a cell are in VTK's order (cell type 24): four corners, then the
//! middles of edges 01, 12, 20, 03, 13, 23.

pub mod cylinder;
pub mod file;
pub mod formats;
pub mod generate;
pub mod quality;
pub mod tet10;

mod encoded;
mod improve;
mod refine;
mod tetrahedra;

pub use cylinder::CylinderMesh;
pub use generate::{
    MOST_CELLS, NearPoint, cuboid_mesh, grain_mesh, polyhedron_mesh, sphere_hull, sphere_mesh,
};
pub use quality::{CellQuality, QualityReport};
pub use tet10::{CellId, Mesh, NodeId, SurfaceFacet};
