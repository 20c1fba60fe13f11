//! A grading curve out of a table, and cut or scaled to what can be tested.
//!
//! A table is a CSV ([`Columns`]) of sieve size and cumulative passing by mass. Passing is in per cent where its header says so or a value is above 1.
//!
//! Gradings that `riprap export --csv` wrote are such tables too: of a specimen's classes the mass fractions as built, of a breakage what passed before
//! the test ([`BEFORE`]).
//!
//! Between two sieves the share passing is linear in size, as grains are drawn.

use std::path::Path;

use serde_json::{Value, json};

use super::super::form::Form;
use super::super::size::with_mass;
use super::super::walk::shown;
use super::columns::Columns;
use super::words::{Notes, SIEVE, walked};
use crate::error::Fault;

const PATH: &str = "$.specimen.grading";
const OF_FILE: &str =
    "a CSV of sieve size and passing, e.g. \"sieve [mm],passing [%]\", its path relative to the case file";

/// Columns of riprap's own tables: of a breakage, by size, and of the classes of a specimen.
const BEFORE: &str = "passing_before";
const CLASSES: [&str; 3] = ["smallest_size", "largest_size", "mass_fraction"];

/// Shares of the mass below this are rounding.
const ROUNDING: f64 = 1e-9;

/// Size [m] and share passing.
type Curve = Vec<[f64; 2]>;

/// The list of points in place of a file's name or an object.
pub fn grading(given: &Value, folder: &Path) -> Result<(Value, Notes), Fault> {
    let mut notes = Notes::new();
    if let Value::String(file) = given {
        return Ok((json!(from_file(file, PATH, folder, &mut notes)?), notes));
    }
    let keys = walked(&Form::Object(SIEVE), given, PATH)?;
    let mut curve: Curve = match (keys["file"].as_str(), &keys["points"]) {
        (Some(file), Value::Null) => from_file(file, &format!("{PATH}.file"), folder, &mut notes)?,
        (None, points @ Value::Array(_)) => serde_json::from_value(points.clone()).unwrap_or_default(),
        _ => {
            let problem = "has not one of the keys file and points";
            return Err(Fault::new(PATH, shown(given), problem, "one of them"));
        }
    };
    curve.sort_by(|a, b| b[0].total_cmp(&a[0]));
    let ends = |curve: &Curve| [curve.first(), curve.last()].map(|point| point.map_or(0.0, |point| point[0]));
    let of_table = ends(&curve);
    curve = with_mass(&curve).to_vec();
    let parallel = keys["parallel"].as_f64();
    if let Some(size) = parallel {
        let factor = size / ends(&curve)[0];
        curve.iter_mut().for_each(|point| point[0] *= factor);
        notes.push(format!("grading: all sizes are scaled by {factor:.4}, parallel to the one given"));
    }
    let [largest, smallest] = ends(&curve);
    let fault = |key: &str, problem: String, accepted: &str| {
        Fault::new(format!("{PATH}.{key}"), shown(&given[key]), problem, accepted)
    };
    let limit = |key: &str, fits: &dyn Fn(f64) -> bool| match keys[key].as_f64() {
        Some(size) if !fits(size) => {
            let problem = format!("is not between the grading's sizes, {smallest} and {largest} m");
            Err(fault(key, problem, "a sieve size, as \"20 mm\""))
        }
        size => Ok(size),
    };
    // The mass beyond the last sieve of a table is cut off at that sieve; beyond those of a parallel grading nothing is.
    let is_free = parallel.is_some();
    let coarsest = limit("coarsest", &|size| size > smallest && (is_free || size <= of_table[0]))?;
    let finest = limit("finest", &|size| size < largest && (is_free || size >= of_table[1]))?;
    if let (Some(above), Some(below)) = (coarsest, finest)
        && passing_at(&curve, above) - passing_at(&curve, below) <= ROUNDING
    {
        let problem = format!("leaves no mass below coarsest, {}", shown(&given["coarsest"]));
        return Err(fault("finest", problem, "a size below coarsest, with mass between the two"));
    }
    for (limit, is_finest) in [(coarsest, false), (finest, true)] {
        let Some(limit) = limit else { continue };
        let gone = cut(&mut curve, limit, is_finest);
        let side = if is_finest { "finer" } else { "coarser" };
        if gone > ROUNDING {
            notes.push(format!(
                "grading: {:.1} % of the mass, {side} than {:.4} mm, is left out and the rest scaled up",
                1e2 * gone,
                1e3 * limit
            ));
        }
    }
    Ok((json!(curve), notes))
}

/// Cuts a curve, coarsest first, at a size; the share of the mass that is left out.
fn cut(curve: &mut Curve, limit: f64, is_finest: bool) -> f64 {
    let passing = passing_at(curve, limit);
    curve.retain(|point| if is_finest { point[0] > limit } else { point[0] < limit });
    let at = if is_finest { curve.len() } else { 0 };
    curve.insert(at, [limit, passing]);
    let [low, high] = if is_finest { [passing, 1.0] } else { [0.0, passing] };
    curve.iter_mut().for_each(|point| point[1] = ((point[1] - low) / (high - low)).clamp(0.0, 1.0));
    1.0 - (high - low)
}

fn passing_at(curve: &Curve, size: f64) -> f64 {
    let pair = curve.windows(2).find(|pair| pair[0][0] >= size && size >= pair[1][0]);
    match pair {
        Some([[a, p], [b, q]]) if a > b => q + (p - q) * (size - b) / (a - b),
        Some(_) | None => curve.last().map_or(0.0, |point| if size < point[0] { 0.0 } else { 1.0 }),
    }
}

fn from_file(file: &str, path: &str, folder: &Path, notes: &mut Notes) -> Result<Curve, Fault> {
    let read = Columns::read(&folder.join(file)).and_then(|columns| table(&columns));
    let (curve, told) =
        read.map_err(|problem| Fault::new(path, shown(&Value::from(file)), problem, OF_FILE))?;
    notes.extend(told.map(|told| format!("grading: of {file} {told}")));
    Ok(curve)
}

/// The curve of a table, and what is taken of one that riprap wrote.
fn table(columns: &Columns) -> Result<(Curve, Option<&'static str>), String> {
    if let [Some(smallest), Some(largest), Some(share)] = CLASSES.map(|name| columns.column(name)) {
        let curve = of_classes(columns, [smallest, largest, share])?;
        return Ok((curve, Some("mass_fraction is taken, that of the specimen as built")));
    }
    match columns.column("size").zip(columns.column(BEFORE)) {
        Some(places) => {
            let told = "passing_before is taken, that before the test: by square openings, which are finer than the sizes that grains are drawn by";
            Ok((of_points(columns, places)?, Some(told)))
        }
        None => Ok((of_points(columns, (0, 1))?, None)),
    }
}

/// Sizes of sieves between classes, and what is in the classes below each.
fn of_classes(columns: &Columns, places: [usize; 3]) -> Result<Curve, String> {
    let [smallest, largest, _] = places.map(|at| columns.metres(at));
    let (Some(smallest), Some(largest)) = (smallest, largest) else {
        return Err(format!("has no unit of length behind {} and {}", CLASSES[0], CLASSES[1]));
    };
    let mut classes = Vec::new();
    for row in &columns.rows {
        let [low, high, share] = places.map(|at| columns.number(row, at));
        classes.push([low? * smallest, high? * largest, share?]);
    }
    let below = |size: f64| {
        classes.iter().filter(|class| class[1] <= size).fold(0.0, |sum: f64, class| sum + class[2])
    };
    let mut sizes: Vec<f64> = classes.iter().flat_map(|class| [class[1], class[0]]).collect();
    sizes.sort_by(|a, b| b.total_cmp(a));
    sizes.dedup();
    sound(sizes.iter().map(|size| [*size, below(*size) / below(f64::INFINITY)]).collect())
}

/// A column of sizes and one of what passes.
fn of_points(columns: &Columns, (size, passing): (usize, usize)) -> Result<Curve, String> {
    let Some(metres) = columns.metres(size) else {
        let problem =
            "has no unit of length behind the name of its first column, the sieve size, as \"sieve [mm]\"";
        return Err(format!("{problem} (found {:?})", columns.header.first().map_or("", |(name, _)| name)));
    };
    let (name, unit) = columns.header.get(passing).cloned().unwrap_or_default();
    if name.contains("retain") {
        return Err("has what is retained in its second column; what passes in all is needed".into());
    }
    let point = |row| Ok([columns.number(row, size)? * metres, columns.number(row, passing)?]);
    let mut curve = columns.rows.iter().map(point).collect::<Result<Curve, String>>()?;
    let in_per_cent = format!("{name}{}", unit.unwrap_or_default()).contains(['%', '％']);
    if in_per_cent || curve.iter().any(|point| point[1] > 1.0) {
        curve.iter_mut().for_each(|point| point[1] *= 0.01);
    }
    curve.sort_by(|a, b| b[0].total_cmp(&a[0]));
    sound(curve)
}

/// The curve, if its numbers are sizes and shares.
fn sound(curve: Curve) -> Result<Curve, String> {
    let is_sound = |point: &&[f64; 2]| point[0] > 0.0 && (0.0..=1.0 + 1e-9).contains(&point[1]);
    match curve.iter().find(|point| !is_sound(point)) {
        Some(point) => Err(format!("has the row {} mm, {} passing", 1e3 * point[0], point[1])),
        None => Ok(curve),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_of_any_country_are_read() {
        let expected = vec![[0.06, 1.0], [0.04, 0.625], [0.02, 0.1]];
        let read =
            |text: &str| Ok::<Curve, String>(Columns::parse(text).and_then(|columns| table(&columns))?.0);
        let near = |text: &str| {
            let found = read(text).unwrap_or_else(|e| panic!("{text}: {e}"));
            assert_eq!(found.len(), expected.len(), "{text}");
            for (a, b) in found.iter().zip(&expected) {
                assert!((a[0] - b[0]).abs() < 1e-15 && (a[1] - b[1]).abs() < 1e-12, "{text}: {found:?}");
            }
        };
        near("sieve [mm],passing [%]\n60,100\n40,62.5\n20,10\n");
        near("\u{feff}# Steinbruch\nSiebweite (mm);Durchgang (%)\n20,0;10,0\n40,0;62,5\n60,0;100\n");
        near("sep=;\r\nSiebweite (mm);Durchgang (%)\r\n20,0;10,0\r\n40,0;62,5\r\n60,0;100\r\n");
        near("d [m]\tpassing\n0.06\t1\n0.04\t0.625\n0.02\t0.1\n");
        near("粒径/mm\t小于某粒径质量百分数/%\n60\t100\n40\t62.5\n20\t10\n");
        near("\"粒径 [mm]\",\"通过率\"\n60,100\n40,62.5 %\n20,10\n");
        near("\"sieve, square [mm]\",\"passing, of mass [%]\"\n60, \"100\"\n\"40\",62.5\n20,10\n");
        near(
            "sieve [inch],passing [%]\n2.3622047244094488,100\n1.5748031496062992,62.5\n0.7874015748031496,10\n",
        );
        let refused = |text: &str| read(text).expect_err(text);
        assert!(refused("sieve,passing\n60,1\n").contains("no unit of length"));
        assert!(refused("sieve [mm],retained [%]\n60,1\n").contains("retained"));
        assert!(refused("sieve [mm],passing [%]\n60,five\n").contains("line 2: \"five\""));
        assert!(refused("sieve [mm],passing [%]\n60,0,62,5\n").contains("decimal commas"));
        assert!(refused("sieve [mm],passing [%]\n60,120\n").contains("1.2 passing"));
    }

    /// As `export --csv` writes them, with columns in the order of their names; older ones have -0.
    #[test]
    fn gradings_that_riprap_wrote_are_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let read = |text: &str| {
            std::fs::write(folder.path().join("own.csv"), text).expect("a table");
            grading(&json!("own.csv"), folder.path())
        };
        let breakage =
            "passing_after [1],passing_before [1],size [m]\n0.1,-0.0,0.02\n0.7,0.5,0.04\n1.0,1.0,0.06\n";
        let classes = "grains [1],largest_size [m],mass_fraction [1],mass_fraction_asked [1],smallest_size [m]\n\
                       80,0.06,0.6,0.5,0.04\n9,0.04,0.6,0.5,0.02\n";
        for (text, says) in [(breakage, "passing_before"), (classes, "as built")] {
            let (curve, notes) = read(text).unwrap_or_else(|e| panic!("{text}: {e}"));
            let curve: Curve = serde_json::from_value(curve).expect("points");
            assert_eq!(curve, [[0.06, 1.0], [0.04, 0.5], [0.02, 0.0]], "{text}");
            assert!(notes.len() == 1 && notes[0].contains(says), "{notes:?}");
        }
        assert!(read(&classes.replace(",0.6,", ",0.0,")).is_err_and(|fault| fault.problem.contains("NaN")));
        assert!(read(&classes.replace("_size [m]", "_size")).is_err());
    }

    #[test]
    fn scalping_keeps_the_shape_of_the_rest() {
        let mut curve = vec![[0.08, 1.0], [0.04, 0.6], [0.02, 0.2], [0.01, 0.0]];
        // Half-way between 40 and 80 mm: 0.8 pass.
        let gone = cut(&mut curve, 0.06, false);
        assert!((gone - 0.2).abs() < 1e-12);
        let gone = cut(&mut curve, 0.02, true);
        assert!((gone - 0.25).abs() < 1e-12);
        let expected = [[0.06, 1.0], [0.04, (0.75 - 0.25) / 0.75], [0.02, 0.0]];
        for (a, b) in curve.iter().zip(&expected) {
            assert!((a[0] - b[0]).abs() < 1e-15 && (a[1] - b[1]).abs() < 1e-12, "{curve:?}");
        }
    }

    /// A tenth below the finest sieve and a tenth above the coarsest are cut off; where there is none nothing changes.
    #[test]
    fn a_curve_may_be_cut_at_its_ends() {
        let between = |shares: [f64; 3], ends: [&str; 2]| {
            let points: Vec<Value> =
                ["60 mm", "40 mm", "20 mm"].iter().zip(shares).map(|(size, p)| json!([size, p])).collect();
            grading(&json!({"points": points, "coarsest": ends[0], "finest": ends[1]}), Path::new(""))
        };
        for (shares, noted) in [([1.0, 0.5, 0.0], 0), ([0.9, 0.5, 0.1], 2)] {
            let (curve, notes) = between(shares, ["60 mm", "20 mm"]).unwrap_or_else(|e| panic!("{e}"));
            let points: Vec<f64> =
                curve.as_array().into_iter().flatten().filter_map(|p| p[1].as_f64()).collect();
            assert!(points.len() == 3 && points[0] == 1.0 && points[2] == 0.0, "{curve}");
            assert!((points[1] - 0.5).abs() < 1e-12 && notes.len() == noted, "{curve} {notes:?}");
        }
        let refused = |ends| between([1.0, 0.5, 0.0], ends).expect_err("refused").path;
        assert_eq!(refused(["60 mm", "60 mm"]), "$.specimen.grading.finest");
        assert_eq!(refused(["20 mm", "20 mm"]), "$.specimen.grading.coarsest");
        // The wrong way round.
        let swapped = between([1.0, 0.5, 0.0], ["30 mm", "50 mm"]).expect_err("nothing is left").to_string();
        let says = "$.specimen.grading.finest: leaves no mass below coarsest, \"30 mm\" (found \"50 mm\"; ";
        assert!(swapped.starts_with(says), "{swapped}");
    }

    #[test]
    fn a_parallel_grading_has_the_same_shares() {
        let given =
            json!({"points": [["600 mm", 1], ["200 mm", "40 %"], ["100 mm", 0]], "parallel": "60 mm"});
        let (curve, notes) = grading(&given, Path::new("")).unwrap_or_else(|e| panic!("{e}"));
        let sizes: Vec<f64> =
            curve.as_array().expect("a list").iter().filter_map(|point| point[0].as_f64()).collect();
        assert!(sizes.iter().zip([0.06, 0.02, 0.01]).all(|(a, b)| (a - b).abs() < 1e-15), "{sizes:?}");
        assert!(notes[0].contains("scaled by 0.1000"), "{notes:?}");
        // The largest size is that of the coarsest grains: a sieve beyond them is none of it.
        let points = json!([["800 mm", 1], ["600 mm", 1], ["200 mm", "40 %"], ["100 mm", 0]]);
        let beyond = grading(&json!({"points": points, "parallel": "60 mm"}), Path::new(""));
        assert_eq!(beyond.unwrap_or_else(|e| panic!("{e}")).0, curve);
        for outside in [
            json!({"points": [["60 mm", 1], ["20 mm", 0]], "finest": "90 mm"}),
            // Of the scaled sizes, 20 to 60 mm, nothing would be left.
            json!({"points": [["600 mm", 1], ["200 mm", 0]], "finest": "90 mm", "parallel": "60 mm"}),
        ] {
            let refused = grading(&outside, Path::new(""));
            assert!(refused.is_err_and(|fault| fault.path == "$.specimen.grading.finest"));
        }
        let wrong = json!({"points": [["60 mm", 1], ["20 mm", 0]], "scalp": "90 mm"});
        assert!(grading(&wrong, Path::new("")).is_err_and(|fault| fault.problem.contains("unknown key")));
    }
}
