//! A scene: bodies set by hand, loaded in stages, without a rig around them.
//!
//! Each stage moves, turns and loads named bodies and turns gravity, linearly over its increments;
//! an increment that misses is cut, an easy one grows back. What each accepted increment did to
//! every body comes out as a [`Row`]. SI units; components are along space axes, moments about the
//! body's reference point. Forces on a body are positive along the axes.

mod drive;
mod fall;
mod increments;
pub mod parameters;
mod placed;
pub mod press;
mod pressed;
pub mod row;
pub mod run;
pub mod uniqueness;

pub use parameters::{BodyLoad, LoadStage, SceneBody, SceneParameters, SceneShape};
pub use press::{PressParameters, Pressing};
pub use row::{BodyState, Row};
pub use run::{Scene, SceneState};
pub use uniqueness::other_equilibrium;
