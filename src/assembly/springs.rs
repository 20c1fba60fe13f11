//! What the springs between two bodies are shares of.

use serde::{Deserialize, Serialize};

use crate::contact::Feature;
use crate::model::Model;

/// The springs of sound contacts between two bodies as they deform now.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Springs {
    /// Of a vertex, or of edges that count in full [N/m].
    pub contact: f64,
    /// Of a patch, per area [N/m^3].
    pub patch: f64,
}

impl Springs {
    pub fn between(model: &Model, a: usize, b: usize) -> Self {
        Springs { contact: model.contact_spring(a, b), patch: model.patch_stiffness(a, b) }
    }

    /// Where the bodies meet at this feature [N/m], or [N/m^3] of a patch.
    pub fn at(&self, feature: Feature) -> f64 {
        match feature {
            Feature::Faces(..) => self.patch,
            Feature::VertexOfA(_) | Feature::VertexOfB(_) | Feature::Edges(..) => self.contact,
        }
    }
}
