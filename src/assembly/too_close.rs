//! Configurations that contacts cannot be evaluated in.

use crate::model::Model;

/// Two cores have come closer than the floor (or overlap): the configuration is refused.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("bodies {a} and {b} are {distance:.3e} m apart, core to core")]
pub struct TooClose {
    pub a: usize,
    pub b: usize,
    pub distance: f64,
}

impl TooClose {
    /// Which bodies are so at the start of an increment; `None`: what is driven has no way to go.
    pub fn described(pair: Option<Self>, model: &Model) -> String {
        let Some(pair) = pair else { return "a driven body would pass into another one".into() };
        let name = |body: usize| model.bodies.get(body).map_or("the membrane", |body| body.name.as_str());
        let (a, b, distance) = (name(pair.a), name(pair.b), pair.distance);
        format!("{a} and {b} overlap at the start of the increment: {distance:.1e} m apart, core to core")
    }
}
