//! The words by which a case brings in.

use serde_json::Value;

use crate::error::Fault;

use super::super::form::{Form, Key, positive, within};
use super::super::quantity::Dimension;
use super::super::walk::{nearest, shown};

/// What was left out or put together, a sentence each.
pub type Notes = Vec<String>;

/// Keys of `specimen.grading` as an object.
pub static SIEVE: &[Key] = &[
    Key::optional(
        "file",
        Form::Text,
        "A CSV of two columns, sieve size and passing, with units in the header; relative to the case file.",
    ),
    Key::optional(
        "points",
        Form::List(&POINT, 2),
        "In place of a file: sieve size and mass fraction passing.",
    ),
    Key::optional(
        "parallel",
        LENGTH,
        "All sizes are scaled alike, so that the largest is this: a parallel grading.",
    ),
    Key::optional("coarsest", LENGTH, "What is coarser is taken out and the rest scaled up: scalping."),
    Key::optional("finest", LENGTH, "What is finer is taken out and the rest scaled up."),
];
/// Keys of a body's `hull`.
pub static HULL: &[Key] = &[
    Key::required(
        "file",
        Form::Text,
        "A surface or mesh: .stl, .obj, .ply, .msh or .vtu; relative to the case file.",
    ),
    Key::required("unit", Form::Choice(&UNITS), "Of the file's coordinates, which have none themselves."),
    Key::default(
        "vertices",
        Form::Count(4, 256),
        "24",
        "The most vertices that are kept, those that leave most of the volume.",
    ),
    Key::default(
        "centred",
        Form::Flag,
        "false",
        "Whether its centroid is put on the position, in place of the file's origin.",
    ),
];
pub(super) const LENGTH: Form = Form::Quantity(Dimension::Length, positive(1e4));
pub(super) static POINT: Form = Form::Tuple(&[LENGTH, Form::Quantity(Dimension::None, within(0.0, 1.0))]);
pub(super) static UNITS: [&str; 6] = ["m", "cm", "mm", "um", "in", "ft"];
/// In metres, as [`UNITS`].
pub(super) const METRES: [f64; 6] = [1.0, 1e-2, 1e-3, 1e-6, 0.0254, 0.3048];

/// Refuses keys that are not among `keys`.
pub(super) fn known(given: &Value, keys: &[Key], path: &str) -> Result<(), Fault> {
    let names = || keys.iter().map(|key| key.name);
    for (name, value) in given.as_object().into_iter().flatten() {
        if !names().any(|known| known == name) {
            let problem = match nearest(name, names()) {
                Some(near) => format!("unknown key: did you mean \"{near}\"?"),
                None => "unknown key".into(),
            };
            let accepted = names().collect::<Vec<_>>().join(", ");
            return Err(Fault::new(format!("{path}.{name}"), shown(value), problem, accepted));
        }
    }
    Ok(())
}
