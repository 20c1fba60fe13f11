//! How far a body may move at once, and how far around it one has to look for others.

use crate::contact::ContactShape;
use crate::model::{Body, BodyKind, Model};
use serde::{Deserialize, Serialize};

/// Bounds of a body's own length over its diameter.
const SHARE: [f64; 2] = [0.02, 0.1];

/// The length that caps on motion and margins of the search are measured in.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum StepLength {
    /// The smallest rounding of the model for all bodies.
    #[default]
    Smallest,
    /// Each body's rounding, but no less than a fiftieth of its diameter and no more than a tenth.
    PerBody,
}

impl StepLength {
    /// Of each body and what else has a pose [m].
    pub fn lengths(self, model: &Model) -> Vec<f64> {
        let smallest = model.smallest_rounding();
        match self {
            StepLength::Smallest => vec![smallest; model.carriers()],
            StepLength::PerBody => {
                let mut lengths: Vec<f64> = model.shapes.iter().zip(&model.bodies).map(own).collect();
                lengths.resize(model.carriers(), smallest);
                lengths
            }
        }
    }
}

fn own((shape, body): (&ContactShape, &Body)) -> f64 {
    let diameter = 2.0 * shape.outer_radius();
    let least = match body.kind {
        BodyKind::Fixed | BodyKind::Plate => 0.0,
        BodyKind::Grain | BodyKind::Placed | BodyKind::Gone => SHARE[0] * diameter,
    };
    shape.rounded.radius.clamp(least, SHARE[1] * diameter)
}
