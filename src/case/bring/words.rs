//! The words by which a case brings in.

use serde_json::Value;

use crate::error::Fault;

use super::super::form::{Form, Key, positive, within};
use super::super::walk::Walker;
use crate::quantity::Dimension;

/// What was left out or put together, a sentence each.
pub type Notes = Vec<String>;

/// Keys of `specimen.grading` as an object.
pub static SIEVE: &[Key] = &[
    Key::optional(
        "file",
        Form::Text,
        "A CSV of two columns, sieve size and passing, with units in the header, or a grading that riprap export wrote, as it was before the test; relative to the case file.",
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
    Key::optional(
        "coarsest",
        LENGTH,
        "What is coarser, after parallel, is taken out and the rest scaled up: scalping.",
    ),
    Key::optional("finest", LENGTH, "What is finer, after parallel, is taken out and the rest scaled up."),
];
/// Keys of a body's `hull`.
pub static HULL: &[Key] = &[
    Key::required(
        "file",
        Form::Text,
        "A surface or mesh: .stl, .obj, .ply, .msh or .vtu; relative to the case file.",
    ),
    Key::required("unit", UNIT, "Of the file's coordinates, which have none themselves."),
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
/// The library of a specimen.
pub const SHAPES: Key = Key::optional(
    "shapes",
    Form::OrBrought(
        &Form::List(&Form::List(&POSITION, 4), 1),
        &Form::Either(&[Form::Text, Form::List(&Form::Text, 1)]),
    ),
    "Every grain is one of these, scaled to the grading: a folder of surfaces and meshes (.stl, .obj, .ply, .msh, .vtu), a list of such files, or a list of lists of vertices. Their convex hulls stand, those of files with at most so many corners as vertices says, those of lists as given; the unit does not matter.",
);
/// Another code's packing in place of drawn grains.
pub const PACKED_GRAINS: Key = Key::optional(
    "packing",
    Form::OrBrought(&Form::Object(PACKING), &Form::Text),
    "Grains and where they are, of another code, in place of drawn and placed ones; size, void_ratio and grading follow from it. diameter and height, if given, are of a cylinder about its middle beyond which grains are left out.",
);
/// Keys of `specimen.packing` as an object.
pub const PACKING: &[Key] = &[
    Key::optional(
        "file",
        Form::Brought(&Form::Text),
        "A CSV or JSON file of the grains, in their place; relative to the case file.",
    ),
    Key::optional("unit", Form::Brought(&UNIT), "Of a CSV's lengths whose headings have none, as YADE's."),
    Key::required("grains", GRAINS, "The grains; a file has them in place of this."),
    Key::default(
        "compact",
        Form::Flag,
        "false",
        "Whether it is compacted to void_ratio; else it is taken as it stands, overlaps shifted apart.",
    ),
];
/// The grains of a packing, in the case or a JSON file.
pub(super) const GRAINS: Form = Form::List(&Form::Object(PACKED), 1);
/// Keys of a grain of a packing.
const PACKED: &[Key] = &[
    Key::default("position", POSITION, "[0, 0, 0]", "Of the origin of its vertices."),
    Key::default("rotation", ROTATION, "[0, 0, 0]", "Rotation vector from its axes to those of space."),
    Key::required(
        "vertices",
        Form::List(&POSITION, 4),
        "Relative to the position; their convex hull is the grain.",
    ),
];
/// Just within void_ratio's.
pub const POROSITY: Form = Form::Quantity(Dimension::None, within(0.05, 0.666));
pub const POSITION: Form = Form::Tuple(&[SIGNED_LENGTH, SIGNED_LENGTH, SIGNED_LENGTH]);
pub const ROTATION: Form = Form::Tuple(&[ANGLE, ANGLE, ANGLE]);
const SIGNED_LENGTH: Form = Form::Quantity(Dimension::Length, within(-1e6, 1e6));
const ANGLE: Form = Form::Quantity(Dimension::Angle, within(-1e3, 1e3));
pub(super) const LENGTH: Form = Form::Quantity(Dimension::Length, positive(1e4));
pub(super) static POINT: Form = Form::Tuple(&[LENGTH, Form::Quantity(Dimension::None, within(0.0, 1.0))]);
const UNIT: Form = Form::Choice(&["m", "cm", "mm", "um", "in", "ft"]);

/// What is given at `path` in SI, or its first fault.
pub(super) fn walked(form: &Form, given: &Value, path: &str) -> Result<Value, Fault> {
    let mut walker = Walker::new(vec![]);
    let walked = walker.walk(form, given, path);
    match walker.faults.into_iter().next() {
        Some(fault) => Err(fault),
        None => Ok(walked.unwrap_or_default()),
    }
}
