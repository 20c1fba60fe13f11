//! A packing of another code: grains with their corners or sizes and where they are, out of a table or a list, put about the z axis; with it the size,
//! void ratio and grading of the specimen.
//!
//! A list, in the case or in a JSON file, has of each grain `vertices`, and `position` and `rotation` where these are not nothing. A CSV ([`Columns`]) has
//! columns x, y and z, of each grain its size, diameter or radius, and may have its quaternion (qw, qx, qy, qz) or rotation vector (rx, ry, rz), and
//! the file's name or number of its shape in `specimen.shapes`. A grain without a shape gets a random one. What `riprap export --csv` says of grains in
//! saved states is such a table: its names are known too ([`OURS`]), and its last state counts; and so are YADE's, `export.text` and `textExt`.

use std::path::Path;

use rayon::prelude::*;
use serde_json::{Map, Value, json};

use crate::error::Fault;
use crate::report::Row;
use crate::specimen::given::void_ratio_within;
use crate::specimen::random::{Purpose, Stream};
use crate::specimen::shape::{GrainShape, lying_grain, solid_hull};
use crate::specimen::{GivenGrain, GivenPacking};
use crate::tensor::{Pose, Rotation, Vec3};

use super::super::form::Form;
use super::super::packed::PackingCase;
use super::super::walk::shown;
use super::columns::Columns;
use super::library::Shape;
use super::words::{GRAINS, Notes, PACKING, walked};
use crate::quantity::{self, Dimension};

const PATH: &str = "$.specimen.packing";
const ACCEPTED: &str = r#"a CSV or JSON file, its path relative to the case file, or an object such as {"file": "packing.csv", "compact": true}, or {"grains": [{"vertices": [[x, y, z], ...]}, ...]}"#;
const OF_TABLE: &str = "a CSV with columns x [mm], y [mm], z [mm] and one of size, diameter and radius [mm]";

/// What riprap's own tables call the columns, and YADE's.
const OURS: [(&str, &str); 8] = [
    ("radius", "r"),
    ("x", "position_x"),
    ("y", "position_y"),
    ("z", "position_z"),
    ("size", "sieve_size"),
    ("rx", "rotation_x"),
    ("ry", "rotation_y"),
    ("rz", "rotation_z"),
];

/// Sizes between which the axes of a random grain lie, over its own.
const RANDOM: [f64; 2] = [0.75, 1.25];
/// What a random grain must have room for; the case's own is asked of it later.
const ROUNDING: f64 = 0.02;
/// Sieves of the grading, one over the next.
const SIEVE_RATIO: f64 = std::f64::consts::SQRT_2;

/// A specimen with its packing as a list and what follows from that.
pub fn specimen(
    given: &Map<String, Value>,
    library: &[Shape],
    folder: &Path,
    seed: u64,
) -> Result<(Value, Notes), Fault> {
    let given_packing = &given["packing"];
    let fault = |problem: String| Fault::new(PATH, shown(given_packing), problem, ACCEPTED);
    let (mut grains, compact) = grains_of(given_packing, library, folder, seed)?;
    let mut notes = Notes::new();
    // A completed case stays what it is, to the bit: a run that is continued has to be of the same case.
    let follows = ["grains", "aspect", "void_ratio", "grading", "within_class"];
    let complete = follows.iter().all(|key| given.contains_key(*key))
        && given_packing.get("grains").is_some()
        && !["diameter", "height", "shapes"].iter().any(|key| given.contains_key(*key));
    let (way, size) = foot(&grains);
    if complete && way.norm() < 1e-9 * size {
        return Ok((Value::Object(given.clone()), notes));
    }
    centre(&mut grains);
    let before = grains.len();
    keep_within(&mut grains, stated(given, "diameter")?, stated(given, "height")?);
    if grains.len() < before {
        notes.push(format!(
            "packing: {} of {before} grains do not lie in the cylinder and are left out",
            before - grains.len()
        ));
        centre(&mut grains);
    }
    if grains.is_empty() {
        return Err(fault("has no grain in the cylinder".into()));
    }
    let packing = GivenPacking { grains, compact };
    let (radius, height) = packing.extent();
    let sizes = sizes(&packing.grains).map_err(fault)?;
    let solid: f64 = sizes.iter().map(|[_, volume]| volume).sum();
    let found = void_ratio_within(radius, height, solid);
    let mut specimen = given.clone();
    for key in ["diameter", "height", "shapes"] {
        specimen.shift_remove(key);
    }
    // What follows from the packing may be said as well, but not otherwise.
    let agrees = |key: &str, found: f64, problem: String, accepted: &str| {
        let Some(value) = given.get(key) else { return Ok(()) };
        let problem = match quantity::read(value, Dimension::None) {
            Ok(said) if (said / found - 1.0).abs() <= 1e-6 => return Ok(()),
            Ok(_) => problem,
            Err(unread) => unread,
        };
        Err(Fault::new(format!("$.specimen.{key}"), shown(value), problem, accepted))
    };
    let (count, aspect) = (packing.grains.len(), 0.5 * height / radius);
    for (key, found) in [("grains", count as f64), ("aspect", aspect)] {
        let problem = format!("is not that of the packing, {found}");
        agrees(key, found, problem, &format!("no {key} beside a packing"))?;
    }
    specimen.insert("grains".into(), json!(count));
    specimen.insert("aspect".into(), json!(aspect));
    if !compact {
        let problem = format!("is not the void ratio {found:.3} of the packing, which is taken as it stands");
        agrees("void_ratio", found, problem, "no void_ratio, or \"compact\": true in packing")?;
        specimen.insert("void_ratio".into(), json!(found));
    }
    specimen.entry("grading").or_insert_with(|| json!(grading(sizes)));
    specimen.entry("within_class").or_insert("mass".into());
    let listed = |grain: &GivenGrain| {
        let corners: Vec<[f64; 3]> = grain.corners.iter().map(|c| (*c).into()).collect();
        let [position, rotation] =
            [grain.pose.position, grain.pose.rotation.scaled_axis()].map(<[f64; 3]>::from);
        json!({"position": position, "rotation": rotation, "vertices": corners})
    };
    let grains: Vec<Value> = packing.grains.iter().map(listed).collect();
    specimen.insert("packing".into(), json!({"grains": grains, "compact": compact}));
    Ok((Value::Object(specimen), notes))
}

/// A length that a specimen may state [m].
fn stated(specimen: &Map<String, Value>, key: &str) -> Result<Option<f64>, Fault> {
    let Some(value) = specimen.get(key).filter(|value| !value.is_null()) else { return Ok(None) };
    let read = quantity::read(value, Dimension::Length).ok().filter(|length| *length > 0.0);
    let path = format!("$.specimen.{key}");
    read.map(Some).ok_or_else(|| Fault::new(path, shown(value), "is no length", "a length, as \"300 mm\""))
}

/// The grains of a packing as it is given, and whether it is to be compacted.
fn grains_of(
    given: &Value,
    library: &[Shape],
    folder: &Path,
    seed: u64,
) -> Result<(Vec<GivenGrain>, bool), Fault> {
    let fault = |problem: String| Fault::new(PATH, shown(given), problem, ACCEPTED);
    let keys = match given {
        Value::String(_) => json!({"file": given}),
        // A file stands in place of grains.
        Value::Object(_) => walked(&Form::Overrides(PACKING), given, PATH)?,
        _ => return Err(fault("is no packing".into())),
    };
    let compact = keys["compact"] == true;
    let no_unit = || {
        let (path, accepted) = (format!("{PATH}.unit"), "\"m\", \"cm\", \"mm\", \"um\", \"in\" or \"ft\"");
        Fault::new(path, shown(&keys["unit"]), "is no unit of length", accepted)
    };
    let metres = |unit: &Value| unit.as_str().and_then(|unit| Dimension::Length.si_of(unit));
    let unit = match &keys["unit"] {
        Value::Null => None,
        unit => Some(metres(unit).ok_or_else(no_unit)?),
    };
    let grains = match (keys["file"].as_str(), &keys["grains"]) {
        (None, list @ Value::Array(_)) => listed(list, &format!("{PATH}.grains"))?,
        (Some(file), Value::Null) if file.to_ascii_lowercase().ends_with(".json") => {
            let read =
                super::super::source::read_named(&folder.join(file)).map_err(|e| fault(e.to_string()))?;
            let list = read.value.get("grains").unwrap_or(&read.value);
            listed(&walked(&GRAINS, list, PATH)?, PATH)?
        }
        (Some(file), Value::Null) => {
            let table = Columns::read(&folder.join(file)).and_then(last_state);
            let read = table.and_then(|table| tabled(&table, unit, library, seed, compact));
            read.map_err(|problem| Fault::new(PATH, shown(given), problem, OF_TABLE))?
        }
        _ => return Err(fault("has not one of the keys file and grains".into())),
    };
    Ok((grains, compact))
}

/// Grains of a list of objects in SI.
fn listed(list: &Value, path: &str) -> Result<Vec<GivenGrain>, Fault> {
    let packing =
        PackingCase { grains: serde_json::from_value(list.clone()).unwrap_or_default(), compact: false };
    let grain = |(index, grain): (usize, &GivenGrain)| {
        let accepted = "a grain whose \"vertices\" span a body";
        about_centroid(&grain.corners, grain.pose)
            .map_err(|problem| Fault::new(format!("{path}[{index}]"), shown(&list[index]), problem, accepted))
    };
    packing.given().grains.iter().enumerate().map(grain).collect()
}

/// Of a table of states that riprap exported the last; any other as it is.
fn last_state(table: Columns) -> Result<Columns, String> {
    match table.column("state").filter(|_| table.column("position_x").is_some()) {
        Some(state) => table.with_largest(state),
        None => Ok(table),
    }
}

/// Grains of a table. Where random shapes stand for balls, these are spread so that nothing overlaps, for compaction to begin with.
fn tabled(
    table: &Columns,
    unit: Option<f64>,
    library: &[Shape],
    seed: u64,
    compact: bool,
) -> Result<Vec<GivenGrain>, String> {
    let column = |name: &str| {
        let mut others = OURS.iter().filter(|(known, _)| *known == name).map(|(_, ours)| *ours);
        table.column(name).or_else(|| others.find_map(|other| table.column(other)))
    };
    let length = |name: &str| -> Result<Option<(usize, f64)>, String> {
        let Some(at) = column(name) else { return Ok(None) };
        let metres = table.metres(at).or(unit).ok_or(format!(
            "has no unit of length behind {name}, as \"{name} [mm]\", and the packing no \"unit\""
        ))?;
        Ok(Some((at, metres)))
    };
    let needed = |name: &str| length(name)?.ok_or(format!("has no column {name}"));
    let place = [needed("x")?, needed("y")?, needed("z")?];
    let sizes =
        [length("size")?, length("diameter")?, length("radius")?.map(|(at, metres)| (at, 2.0 * metres))];
    let size = sizes.into_iter().flatten().next().ok_or("has no column size, diameter or radius")?;
    let all = |names: &[&str]| names.iter().map(|name| column(name)).collect::<Option<Vec<usize>>>();
    let (quaternion, vector) = (all(&["qw", "qx", "qy", "qz"]), all(&["rx", "ry", "rz"]));
    let shape = column("shape");
    if !compact && shape.is_none() {
        return Err("has sizes and no shapes: such a packing has to be compacted, by \"compact\": true and void_ratio, or needs a column shape".into());
    }
    let grain = |(index, row): (usize, &Row)| -> Result<GivenGrain, String> {
        let value = |(at, metres): (usize, f64)| Ok::<f64, String>(table.number(row, at)? * metres);
        let position = Vec3::new(value(place[0])?, value(place[1])?, value(place[2])?);
        let size = value(size)?;
        if size <= 0.0 {
            return Err(format!("line {}: a size of {size} m", row.0));
        }
        let mut stream = Stream::new(seed, Purpose::Placement, index as u64);
        let numbers =
            |at: &[usize]| at.iter().map(|at| table.number(row, *at)).collect::<Result<Vec<f64>, _>>();
        let rotation = match (&quaternion, &vector) {
            (Some(at), _) => {
                let q = numbers(at)?;
                Rotation::from_quaternion(nalgebra::Quaternion::new(q[0], q[1], q[2], q[3]))
            }
            (None, Some(at)) => Rotation::from_scaled_axis(Vec3::from_column_slice(&numbers(at)?)),
            (None, None) => stream.rotation(),
        };
        let corners = match shape.map(|at| Columns::cell(row, at)).filter(|name| !name.is_empty()) {
            Some(name) => {
                let found = library.iter().position(|(known, _)| known == name);
                let shape = found.or(name.parse().ok()).and_then(|k| library.get(k));
                corners_of(shape.ok_or(format!("line {}: specimen.shapes has no {name:?}", row.0))?)?
            }
            None if library.is_empty() => {
                lying_grain(RANDOM, ROUNDING, seed, index as u64).map_err(|e| e.to_string())?.vertices
            }
            None => corners_of(&library[stream.integer(0, library.len() - 1)])?,
        };
        let unit = GrainShape::of_corners(&corners, 0.0).map_err(|e| format!("line {}: {e}", row.0))?;
        let corners = unit.scaled(size / unit.sieve_size).nominal.vertices;
        Ok(GivenGrain { corners, pose: Pose::new(position, rotation) })
    };
    let mut grains = table.rows.par_iter().enumerate().map(grain).collect::<Result<Vec<_>, _>>()?;
    if grains.is_empty() {
        return Err("has no rows".into());
    }
    if shape.is_none() {
        let reach = |(grain, row): (&GivenGrain, &Row)| {
            let ball = 0.5 * size.1 * table.number(row, size.0).unwrap_or(f64::INFINITY);
            grain.corners.iter().map(|corner| corner.norm()).fold(0.0, f64::max) / ball
        };
        let spread = grains.iter().zip(&table.rows).map(reach).fold(1.0, f64::max);
        grains.iter_mut().for_each(|grain| grain.pose.position *= spread);
    }
    Ok(grains)
}

/// Corners of a shape, of which only proportions count.
fn corners_of((name, corners): &Shape) -> Result<Vec<Vec3>, String> {
    let corners: Result<Vec<[f64; 3]>, _> = serde_json::from_value(corners.clone());
    let corners = corners.map_err(|_| format!("shape {name} of specimen.shapes is no list of [x, y, z]"))?;
    Ok(corners.into_iter().map(Vec3::from).collect())
}

/// A grain whose frame is put to the centroid of its hull.
fn about_centroid(corners: &[Vec3], pose: Pose) -> Result<GivenGrain, String> {
    let hull = solid_hull(corners).map_err(|e| e.to_string())?;
    let centroid = hull.centroid();
    let corners = hull.vertices.iter().map(|v| v - centroid).collect();
    Ok(GivenGrain { corners, pose: Pose::new(pose.to_space(&centroid), pose.rotation) })
}

/// From the origin to the middle of the grains at their lowest corner, and how far they reach [m].
fn foot(grains: &[GivenGrain]) -> (Vec3, f64) {
    let corners = grains.iter().flat_map(|grain| grain.corners.iter().map(|c| grain.pose.to_space(c)));
    let wide = [Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY)];
    let [low, high] = corners.fold(wide, |[low, high], x| [low.inf(&x), high.sup(&x)]);
    let middle = 0.5 * (low + high);
    (Vec3::new(middle.x, middle.y, low.z), (high - low).norm())
}

/// Puts the middle of the grains on the z axis and their lowest corner at z = 0.
fn centre(grains: &mut [GivenGrain]) {
    let (by, _) = foot(grains);
    grains.iter_mut().for_each(|grain| grain.pose.position -= by);
}

/// Leaves out what reaches beyond a cylinder about the middle.
fn keep_within(grains: &mut Vec<GivenGrain>, diameter: Option<f64>, height: Option<f64>) {
    let [radius, height] = [diameter.map(|d| 0.5 * d), height].map(|limit| limit.unwrap_or(f64::INFINITY));
    let within = |x: Vec3| x.xy().norm() <= radius && x.z <= height;
    grains.retain(|grain| grain.corners.iter().all(|corner| within(grain.pose.to_space(corner))));
}

/// Sieve size [m] and volume [m3] of each grain.
fn sizes(grains: &[GivenGrain]) -> Result<Vec<[f64; 2]>, String> {
    let one = |grain: &GivenGrain| {
        let shape = GrainShape::of_corners(&grain.corners, 0.0).map_err(|e| e.to_string())?;
        Ok([shape.sieve_size, shape.nominal.volume()])
    };
    grains.par_iter().map(one).collect()
}

/// Sieves that hold the sizes, and the share of the volume that passes each.
fn grading(mut sizes: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    sizes.sort_by(|a, b| b[0].total_cmp(&a[0]));
    let [largest, smallest] = [sizes.first(), sizes.last()].map(|size| size.map_or(1.0, |size| size[0]));
    let (top, bottom) = (1.001 * largest, 0.999 * smallest);
    let count = ((top / bottom).ln() / SIEVE_RATIO.ln()).ceil().max(1.0);
    let total: f64 = sizes.iter().map(|[_, volume]| volume).sum();
    let passing =
        |sieve: f64| sizes.iter().filter(|[size, _]| *size < sieve).map(|[_, v]| v).sum::<f64>() / total;
    let sieve = |k: f64| top * (bottom / top).powf(k / count);
    let between = (1..count as usize).map(|k| sieve(k as f64)).map(|size| [size, passing(size)]);
    std::iter::once([top, 1.0]).chain(between).chain([[bottom, 0.0]]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, Geometry, RawCase, SpecimenCase, checked};

    fn check(folder: &Path, specimen: &str) -> crate::error::Result<Case> {
        let text = format!(
            r#"{{"specimen": {{{specimen}}}, "contact": {{"friction": 0.65}},
            "rock": {{"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2}},
            "stages": [{{"kind": "consolidate", "pressure": "0.8 MPa"}}]}}"#
        );
        RawCase::parse(&folder.join("x.json"), &text)?.check()
    }

    fn refused(folder: &Path, specimen: &str) -> String {
        check(folder, specimen).expect_err(specimen).to_string()
    }

    fn packed(case: &Case) -> (&SpecimenCase, &PackingCase) {
        let Geometry::Specimen(specimen) = &case.geometry else { panic!("no specimen") };
        (specimen, specimen.packing.as_ref().expect("a packing"))
    }

    /// 27 cubes of 20 mm in a cube of 60 mm, by their corners in space.
    #[test]
    fn a_list_of_polyhedra_is_taken_as_it_stands() {
        let folder = tempfile::tempdir().expect("a folder");
        let cube = |at: usize| {
            let place = [at % 3, at / 3 % 3, at / 9];
            let corner =
                |k: usize| [0, 1, 2].map(|i| format!("\"{} mm\"", 100 + 20 * (place[i] + (k >> i & 1))));
            let corners: Vec<String> = (0..8).map(|k| format!("[{}]", corner(k).join(", "))).collect();
            format!("{{\"vertices\": [{}]}}", corners.join(", "))
        };
        let list = format!("[{}]", (0..27).map(cube).collect::<Vec<_>>().join(", "));
        std::fs::write(folder.path().join("cubes.json"), &list).expect("a packing");
        for given in [format!("\"packing\": {{\"grains\": {list}}}"), r#""packing": "cubes.json""#.into()] {
            let case = check(folder.path(), &given).unwrap_or_else(|e| panic!("{e}"));
            let (specimen, packing) = packed(&case);
            assert!(!packing.compact && specimen.grains == 27);
            // In a cylinder around it; the polygon of 24 panels around that is larger by 0.6 %.
            let around = std::f64::consts::PI * 0.5 * 1.0058 - 1.0;
            assert!((specimen.void_ratio - around).abs() < 1e-3, "{}", specimen.void_ratio);
            assert!(
                specimen.grading.iter().all(|point| (point[0] - 0.02).abs() < 1e-4),
                "{:?}",
                specimen.grading
            );
            let lowest = packing.grains.iter().map(|grain| grain.position[2]).fold(1.0, f64::min);
            assert!((lowest - 0.01).abs() < 1e-12);
            let again = checked(&case.completed().to_string(), &[]).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(again.completed(), case.completed());
        }
        let case = check(folder.path(), r#""packing": "cubes.json", "height": "45 mm""#)
            .unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(packed(&case).1.grains.len(), 18);
        assert!(
            case.remarks().iter().any(|remark| remark.contains("9 of 27 grains")),
            "{:?}",
            case.remarks()
        );
        assert!(
            refused(folder.path(), r#""packing": "cubes.json", "void_ratio": 0.4"#)
                .contains("taken as it stands")
        );
        assert!(
            refused(folder.path(), r#""packing": "cubes.json", "diameter": "5 mm""#)
                .contains("no grain in the cylinder")
        );
        for stated in ["\"grains\": 26", "\"aspect\": 3", "\"aspect\": \"300 %\""] {
            let said = refused(folder.path(), &format!(r#""packing": "cubes.json", {stated}"#));
            assert!(said.contains("is not that of the packing"), "{said}");
        }
        for (stated, problem) in [("40 %", "taken as it stands"), ("loose", "does not begin with a number")] {
            let given = format!(r#""packing": "cubes.json", "void_ratio": "{stated}""#);
            let said = refused(folder.path(), &given);
            assert!(said.contains("$.specimen.void_ratio") && said.contains(problem), "{said}");
        }
        let slip = r#""packing": {"grains": [{"positon": [0, 0, 0], "vertices": []}]}"#;
        let said = refused(folder.path(), slip);
        assert!(said.contains("$.specimen.packing.grains[0].positon: is an unknown key"), "{said}");
        let flat = r#""packing": {"grains": [{"vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]}]}"#;
        let said = refused(folder.path(), flat);
        assert!(said.contains("$.specimen.packing.grains[0]") && said.matches("$.").count() == 1, "{said}");
    }

    #[test]
    fn a_table_has_sizes_turns_and_shapes() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |text: &str| std::fs::write(folder.path().join("p.csv"), text).expect("a packing");
        // A box of 40 x 20 x 10 mm has a sieve size of 20 mm; turned by a right angle about y it stands on end.
        let shapes = r#""shapes": [[[0, 0, 0], [4, 0, 0], [0, 2, 0], [4, 2, 0], [0, 0, 1], [4, 0, 1], [0, 2, 1], [4, 2, 1]]]"#;
        let flat = |z: usize| format!("0;0;{z},0;20;0;1;0;0;0\n");
        let flat = [5, 15, 25, 35].map(flat).concat();
        write(&format!(
            "x [mm];y [mm];z [mm];size [mm];shape;qw;qx;qy;qz\n25,5;0;20;20;0;1,0;0;1,0;0\n{flat}"
        ));
        let case = check(folder.path(), &format!(r#""packing": "p.csv", {shapes}"#))
            .unwrap_or_else(|e| panic!("{e}"));
        let (_, packing) = packed(&case);
        let given = packing.given();
        let tall = |grain: &GivenGrain| {
            let z = || grain.corners.iter().map(|c| grain.pose.to_space(c).z);
            z().fold(f64::NEG_INFINITY, f64::max) - z().fold(f64::INFINITY, f64::min)
        };
        let [a, b] = [tall(&given.grains[0]), tall(&given.grains[1])];
        assert!((a / 0.04 - 1.0).abs() < 0.01 && (b / 0.01 - 1.0).abs() < 0.01, "{a} {b}");
        assert!((given.grains[0].pose.position.x - given.grains[1].pose.position.x - 0.0255).abs() < 1e-12);
        // Balls: random grains of their size, spread, to be compacted.
        let ball =
            |k: usize| format!("{},{},{},{}\n", 25 * (k % 4), 25 * (k / 4 % 4), 25 * (k / 16), 10 + k % 2);
        let balls: String = (0..64).map(ball).collect();
        write(&format!("x [mm],y [mm],z [mm],radius [mm]\n{balls}"));
        assert!(refused(folder.path(), r#""packing": "p.csv""#).contains("has to be compacted"));
        let compact = r#""packing": {"file": "p.csv", "compact": true}"#;
        assert!(refused(folder.path(), compact).contains("$.specimen.void_ratio"));
        let case = check(folder.path(), &format!(r#"{compact}, "void_ratio": 0.6"#))
            .unwrap_or_else(|e| panic!("{e}"));
        let (specimen, packing) = packed(&case);
        assert!(packing.compact && specimen.grains == 64 && specimen.void_ratio == 0.6);
        let grains = packing.given().grains;
        let reach = |grain: &GivenGrain| grain.corners.iter().map(|c| c.norm()).fold(0.0, f64::max);
        for (at, a) in grains.iter().enumerate() {
            let apart = |b: &GivenGrain| (a.pose.position - b.pose.position).norm() - reach(a) - reach(b);
            assert!(grains[..at].iter().all(|b| apart(b) > 0.0));
        }
        // The same as YADE exports it, which has no units.
        let ball = |k: usize| [25 * (k % 4), 25 * (k / 4 % 4), 25 * (k / 16), 10 + k % 2];
        let row = |k: usize| ball(k).map(|number| (number as f64 / 1e3).to_string()).join("\t") + "\n";
        write(&format!("#format x_y_z_r\n{}", (0..64).map(row).collect::<String>()));
        let unit = |unit: &str| {
            format!(r#""packing": {{"file": "p.csv", "compact": true, "unit": {unit}}}, "void_ratio": 0.6"#)
        };
        let same = check(folder.path(), &unit("\"m\"")).unwrap_or_else(|e| panic!("{e}"));
        let others = packed(&same).1.given().grains;
        for (one, other) in grains.iter().zip(&others) {
            assert!((one.pose.position - other.pose.position).norm() < 1e-12);
            assert!((reach(one) - reach(other)).abs() < 1e-12);
        }
        assert!(refused(folder.path(), compact).contains("no unit of length behind x"));
        assert!(refused(folder.path(), &unit("\"ell\"")).contains("$.specimen.packing.unit: is no unit"));
        // Of what riprap itself exports the last state.
        let row = |state: usize, k: usize| {
            let [x, y, z] = [k % 4, k / 4 % 4, k / 16].map(|at| 0.025 * at as f64 + state as f64);
            format!("{state},{k},{},{x},{y},{z},0,0,0.5\n", 0.02 + 0.002 * (k % 2) as f64)
        };
        let rows: String = (0..128).map(|k| row(k / 64, k % 64)).collect();
        let header = "state [1],grain [1],sieve_size [m],position_x [m],position_y [m],position_z [m],\
                      rotation_x [rad],rotation_y [rad],rotation_z [rad]";
        write(&format!("{header}\n{rows}"));
        let case = check(folder.path(), &format!(r#"{compact}, "void_ratio": 0.6"#))
            .unwrap_or_else(|e| panic!("{e}"));
        let (specimen, packing) = packed(&case);
        assert_eq!(specimen.grains, 64);
        assert!((specimen.grading[0][0] / 0.022 - 1.0).abs() < 0.02, "{:?}", specimen.grading);
        assert!(packing.grains.iter().all(|grain| (grain.rotation[2] - 0.5).abs() < 1e-12));
        for (text, problem) in [
            ("x,y [mm],z [mm],size [mm]\n0,0,0,1\n", "no unit of length behind x"),
            ("x [mm],y [mm],size [mm]\n0,0,1\n", "no column z"),
            ("x [mm],y [mm],z [mm]\n0,0,0\n", "no column size"),
            ("x [mm],y [mm],z [mm],size [mm]\n0,0,a,1\n", "line 2: \"a\""),
            ("x [mm],y [mm],z [mm],size [mm]\n0,0,0,-1\n", "line 2: a size of"),
            ("x [mm],y [mm],z [mm],size [mm],shape\n0,0,0,1,b.stl\n", "has no \"b.stl\""),
        ] {
            write(text);
            let said = refused(folder.path(), &format!(r#"{compact}, "void_ratio": 0.6"#));
            assert!(said.contains(problem), "{text}: {said}");
        }
    }
}
