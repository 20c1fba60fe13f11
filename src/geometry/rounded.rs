//! (stand-in until the specimen branch lands)
use crate::geometry::Polyhedron;
#[derive(Debug, Clone, PartialEq)]
pub struct RoundedBody {
    pub core: Polyhedron,
    pub radius: f64,
}
