//! riprap: implicit, quasi-static triaxial tests on rockfill.
//!
//! Thousands of deformable, crushable, frictional grains are generated, compacted, consolidated
//! and sheared after Ma, Zhou, Chang & Zhou (2011), "3D mesoscopic numerical simulation of
//! triaxial shear tests for rockfill", Chinese J. Geotech. Eng. 33(5):746-753.
//!
//! Inside, everything is SI (m, N, Pa, J, kg) with tension positive; only `triaxial` measures and
//! the history in a results file count compression positive.
//!
//! The modules below stand in layer order: each imports only modules listed above it
//! (`solver_tests/architecture` checks that). ARCHITECTURE.md walks through the house, docs/formulation.md has
//! the equations.

pub mod error;
pub mod input;
pub mod quantity;
pub mod tensor;
pub mod linalg;
pub mod geometry;
pub mod mesh;
pub mod material;
pub mod element;
pub mod grain;
pub mod crushing;
pub mod contact;
pub mod engine;
pub mod specimen;
pub mod model;
pub mod assembly;
pub mod solver;
pub mod loading;
pub mod triaxial;
pub mod scene;
pub mod results;
pub mod report;
pub mod case;
pub mod study;
pub mod setup;
pub mod recording;
pub mod simulation;
pub mod verification;
pub mod cli;
