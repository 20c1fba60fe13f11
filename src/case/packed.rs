//! Another code's packing, as a completed case has it.

use serde::{Deserialize, Serialize};

use crate::specimen::{GivenGrain, GivenPacking};
use crate::tensor::{Pose, Rotation, Vec3};

/// Grains that stand about the z axis, on z = 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PackingCase {
    pub grains: Vec<PackedCase>,
    /// Whether it is compacted to the void ratio; else it is taken as it stands.
    pub compact: bool,
}

/// A grain of a packing: the hull of its vertices [m], relative to its position [m], turned by its rotation vector [rad].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PackedCase {
    pub position: [f64; 3],
    pub rotation: [f64; 3],
    pub vertices: Vec<[f64; 3]>,
}

impl PackingCase {
    /// What the generator takes.
    pub fn given(&self) -> GivenPacking {
        let grain = |packed: &PackedCase| GivenGrain {
            corners: packed.vertices.iter().copied().map(Vec3::from).collect(),
            pose: Pose::new(
                Vec3::from(packed.position),
                Rotation::from_scaled_axis(Vec3::from(packed.rotation)),
            ),
        };
        GivenPacking { grains: self.grains.iter().map(grain).collect(), compact: self.compact }
    }
}
