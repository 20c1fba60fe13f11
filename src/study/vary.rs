//! What a study can vary, the values it takes, and the members that come of it.

use std::num::IntErrorKind;

use serde::Serialize;
use serde_json::{Value, json};

use crate::case::{Case, Fidelity, Geometry, RawCase, StageCase};
use crate::error::{Error, Result};

use super::outcome::Figures;

/// What is varied.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Vary {
    /// Strain increment of the stages driven by strain; increments of a scene's load stages.
    Increment,
    /// Cells of a grain; of a scene all mesh sizes that it gives, in proportion.
    Mesh,
    /// Out-of-balance force at which an increment is accepted.
    Tolerance,
    /// Unrest to which increments of a specimen are taken; `null`, each in balance, is the finest.
    Stabilisation,
    Fidelity,
    /// First penalty of the contacts of condensed bodies.
    Penalty,
    /// Seed of all randomness.
    Seed,
}

/// A value of what is varied, and what it means for the case.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// As shown.
    pub label: String,
    /// What goes to zero as results become exact; `None` for what has no such size. Zero is what is exact by itself, a limit and no
    /// member of a series.
    pub size: Option<f64>,
    pub overrides: Vec<(String, Value)>,
}

impl Vary {
    pub const WORDS: [(&'static str, Vary); 7] = [
        ("increment", Vary::Increment),
        ("mesh", Vary::Mesh),
        ("tolerance", Vary::Tolerance),
        ("stabilisation", Vary::Stabilisation),
        ("fidelity", Vary::Fidelity),
        ("penalty", Vary::Penalty),
        ("seed", Vary::Seed),
    ];

    pub fn word(self) -> &'static str {
        // All are there.
        Self::WORDS.into_iter().find(|(_, vary)| *vary == self).map_or("", |(word, _)| word)
    }

    /// What the values of this case are called in tables and on axes.
    pub fn heading(self, case: &Case) -> &'static str {
        match (self, &case.geometry) {
            (Vary::Increment, Geometry::Specimen(_)) => "strain increment [1]",
            (Vary::Increment, Geometry::Scene(_)) => "increments of the last stage [1]",
            (Vary::Mesh, Geometry::Specimen(_)) => "cells of a grain [1]",
            (Vary::Mesh, Geometry::Scene(_)) => "mesh size over the case's [1]",
            (Vary::Tolerance, _) => "force tolerance [1]",
            (Vary::Stabilisation, _) => "stabilisation [1]",
            (Vary::Fidelity, _) => "fidelity",
            (Vary::Penalty, _) => "first penalty [1]",
            (Vary::Seed, _) => "seed",
        }
    }

    /// The settings of a study of `case`: those of `values`, or some that suit the case, from the coarsest to the finest.
    ///
    /// # Errors
    /// `Error::Usage` for what the case does not have, and for values that are none.
    pub fn settings(self, source: &RawCase, case: &Case, values: &[String]) -> Result<Vec<Setting>> {
        let mut settings = match self {
            Vary::Increment => increments(source, case, values)?,
            Vary::Mesh => meshes(case, values)?,
            Vary::Tolerance => {
                let base = case.solver.force_tolerance;
                let numbers = floats(values, || vec![10.0 * base, base, 0.1 * base])?;
                let size = |tolerance: &f64| Some(*tolerance);
                in_place("/solver/force_tolerance", &numbers, |tolerance| format!("{tolerance:e}"), size)
            }
            Vary::Stabilisation => stabilisations(case, values)?,
            Vary::Fidelity => {
                let words = match values {
                    [] => ["rigid", "condensed", "full"].map(String::from).to_vec(),
                    values => values.to_vec(),
                };
                in_place("/solver/fidelity", &words, String::clone, |_| None)
            }
            Vary::Penalty => {
                if !has_condensed(case) {
                    let reason = "no body of the case is condensed; contacts of others are springs, and no key of the case sets their stiffness";
                    return Err(missing("penalty", reason));
                }
                let numbers = floats(values, || vec![1e-3, 1.0, 1e3])?;
                in_place("/solver/first_penalty", &numbers, |factor| format!("{factor:e}"), |_| None)
            }
            Vary::Seed => {
                let base = case.seed as usize;
                let numbers = whole(values, 0, || (base..=base.saturating_add(4)).collect())?;
                in_place("/seed", &numbers, usize::to_string, |_| None)
            }
        };
        // Stable: what has no size stays as given.
        settings.sort_by(|a, b| match (a.size, b.size) {
            (Some(a), Some(b)) => b.total_cmp(&a),
            _ => std::cmp::Ordering::Equal,
        });
        for (at, setting) in settings.iter().enumerate() {
            if settings[..at].iter().any(|other| other.label == setting.label) {
                return Err(Error::Usage(format!("--values: {} is there twice", setting.label)));
            }
        }
        Ok(settings)
    }

    /// Takes the sizes of grains' meshes from the cells that they were built with, which are about those asked for; those numbers,
    /// or `None` where nothing of the kind was varied.
    pub fn as_built(self, settings: &mut [Setting], all: &[Figures]) -> Option<Vec<f64>> {
        let built: Vec<f64> = all.iter().map(|figures| figures.cells_of_a_grain).collect();
        if self != Vary::Mesh || !built.iter().any(|cells| cells.is_finite()) {
            return None;
        }
        for (setting, cells) in settings.iter_mut().zip(&built).filter(|(_, cells)| cells.is_finite()) {
            setting.size = Some(edge(*cells));
        }
        Some(built)
    }
}

/// A setting for each of these values of one place in the case; `label` and `size` are those of a value.
fn in_place<T: Serialize>(
    place: &str,
    values: &[T],
    label: impl Fn(&T) -> String,
    size: impl Fn(&T) -> Option<f64>,
) -> Vec<Setting> {
    let overrides = |value: &T| vec![(place.to_string(), json!(value))];
    let setting = |value| Setting { label: label(value), size: size(value), overrides: overrides(value) };
    values.iter().map(setting).collect()
}

/// Where a study of a case in strict balance begins: what cases have that say nothing.
const USUAL_UNREST: f64 = 3e-3;

/// Unrests, `null` among them.
fn stabilisations(case: &Case, values: &[String]) -> Result<Vec<Setting>> {
    if matches!(case.geometry, Geometry::Scene(_)) {
        return Err(missing("stabilisation", "every increment of a scene is in balance"));
    }
    let base = case.solver.stabilisation.unwrap_or(USUAL_UNREST);
    let unrest = |text: &String| match text.trim() {
        "null" => Ok(None),
        _ => positive(text).map(Some),
    };
    let unrests: Vec<Option<f64>> = match values {
        [] => [1.0, 0.5, 0.25].map(|share| Some(share * base)).to_vec(),
        values => values.iter().map(unrest).collect::<Result<_>>()?,
    };
    let label = |unrest: &Option<f64>| unrest.map_or("null".into(), |unrest| format!("{unrest:e}"));
    Ok(in_place("/solver/stabilisation", &unrests, label, |unrest| Some(unrest.unwrap_or(0.0))))
}

/// A cell's edge over that of its grain of so many cells.
fn edge(cells: f64) -> f64 {
    cells.powf(-1.0 / 3.0)
}

/// Half of `base`, itself and its double, in whole numbers from 1 on, none twice.
fn around(base: usize) -> Vec<usize> {
    match base {
        0 | 1 => vec![1, 2, 4],
        base => vec![base / 2, base, 2 * base],
    }
}

/// Whether any body is condensed, or may become so.
fn has_condensed(case: &Case) -> bool {
    let chosen = case.solver.accuracy.is_some();
    let deforms = |fidelity: Fidelity| match fidelity {
        Fidelity::Condensed => true,
        Fidelity::Auto => chosen,
        Fidelity::Rigid | Fidelity::Full => false,
    };
    match &case.geometry {
        Geometry::Specimen(_) => deforms(case.solver.fidelity),
        Geometry::Scene(scene) => {
            scene.bodies.iter().any(|body| deforms(body.fidelity.unwrap_or(case.solver.fidelity)))
        }
    }
}

fn meshes(case: &Case, values: &[String]) -> Result<Vec<Setting>> {
    match &case.geometry {
        Geometry::Specimen(specimen) => {
            if !case.meshes_act() {
                return Err(unused_meshes("grains"));
            }
            let base = specimen.cells_per_grain;
            let numbers = whole(values, 1, || around(base))?;
            let size = |cells: &usize| Some(edge(*cells as f64));
            Ok(in_place("/specimen/cells_per_grain", &numbers, usize::to_string, size))
        }
        Geometry::Scene(scene) => {
            let meshed: Vec<(String, f64)> = scene
                .bodies
                .iter()
                .enumerate()
                .flat_map(|(at, body)| {
                    let refined = body.refine.map(|refine| ("/refine", refine.mesh_size));
                    let own = body.mesh_size.map(|size| ("", size)).into_iter().chain(refined);
                    own.map(move |(below, size)| (format!("/scene/bodies/{at}{below}/mesh_size"), size))
                })
                .collect();
            if meshed.is_empty() {
                return Err(missing("mesh", "no body of the scene has a mesh_size"));
            }
            if !case.meshes_act() {
                return Err(unused_meshes("bodies"));
            }
            let factors = floats(values, || vec![2.0, 1.0, 0.5])?;
            let setting = |factor: f64| Setting {
                label: factor.to_string(),
                size: Some(factor),
                overrides: meshed.iter().map(|(path, size)| (path.clone(), json!(size * factor))).collect(),
            };
            Ok(factors.into_iter().map(setting).collect())
        }
    }
}

fn increments(source: &RawCase, case: &Case, values: &[String]) -> Result<Vec<Setting>> {
    match &case.geometry {
        Geometry::Specimen(_) => {
            let stages = case.stages.iter().enumerate();
            let driven: Vec<(usize, f64)> =
                stages.filter_map(|(at, stage)| Some((at, stage.strained()?.increment))).collect();
            let Some(&(_, base)) = driven.last() else {
                return Err(missing("increment", "no stage of the case is driven by strain"));
            };
            let numbers = strain_increments(case, base, values)?;
            let completed = case.completed();
            // Other stages, and how far increments may grow where that is given, in proportion.
            let setting = |increment: f64| {
                let scaled = |place: String, own: f64| (place, json!(own * increment / base));
                let mut overrides = Vec::new();
                for (at, own) in &driven {
                    let largest = format!("/stages/{at}/increment_max");
                    // As checked: it may have been given with a unit.
                    if source.value.pointer(&largest).is_some()
                        && let Some(own) = completed.pointer(&largest).and_then(serde_json::Value::as_f64)
                    {
                        overrides.push(scaled(largest, own));
                    }
                    overrides.push(scaled(format!("/stages/{at}/increment"), *own));
                }
                Setting { label: format!("{increment:e}"), size: Some(increment), overrides }
            };
            Ok(numbers.into_iter().map(setting).collect())
        }
        Geometry::Scene(_) => {
            let load = |(at, stage): (usize, &StageCase)| {
                let StageCase::Load { increments, .. } = stage else { return None };
                Some((at, *increments))
            };
            let loaded: Vec<(usize, usize)> = case.stages.iter().enumerate().filter_map(load).collect();
            let Some(&(_, base)) = loaded.last() else {
                return Err(missing("increment", "the scene has no load stage"));
            };
            let numbers = whole(values, 1, || around(base))?;
            let given = |at: usize| source.value.pointer(&format!("/stages/{at}")).is_some();
            let setting = |number: usize| Setting {
                label: number.to_string(),
                size: Some(1.0 / number as f64),
                overrides: loaded
                    .iter()
                    .filter(|(at, _)| given(*at))
                    .map(|(at, own)| {
                        // The product of two such numbers fits.
                        let scaled = (*own as u128 * number as u128).div_ceil(base as u128).max(1);
                        let scaled = usize::try_from(scaled).unwrap_or(usize::MAX);
                        (format!("/stages/{at}/increments"), json!(scaled))
                    })
                    .collect(),
            };
            Ok(numbers.into_iter().map(setting).collect())
        }
    }
}

/// Increments of the last driven stage, which is of `base` in the case: those of `values`, or some that suit.
///
/// # Errors
/// `Error::Usage` for values that are none, and for those at which increments would be taken shorter.
fn strain_increments(case: &Case, base: f64, values: &[String]) -> Result<Vec<f64>> {
    let longest = case.stages.iter().filter_map(|stage| Some(stage.strained()?.increment_max));
    let longest = longest.fold(base, f64::max);
    let most = case.largest_increment().map_or(f64::INFINITY, |most| most * base / longest);
    let begin = base.min(most);
    // Twice and four times as long where the shortest stage has room for them.
    let strains = case.stages.iter().filter_map(strains_of).fold(f64::INFINITY, f64::min);
    let room = (strains * base).min(most) / begin;
    let factors = [[4.0, 2.0, 1.0], [2.0, 1.0, 0.5]].into_iter().find(|of| of[0] <= room);
    let usual = || factors.unwrap_or([1.0, 0.5, 0.25]).map(|factor| factor * begin).to_vec();
    let numbers = floats(values, usual)?;
    match numbers.iter().find(|number| **number > most * (1.0 + 1e-9)) {
        Some(number) => Err(Error::Usage(format!(
            "--values: {number:e} is above {most:.2e}, beyond which increments are taken shorter, since \
             solver.accuracy is {}",
            case.solver.accuracy.unwrap_or(f64::NAN)
        ))),
        None => Ok(numbers),
    }
}

/// The strain of a stage over its increment, where it prescribes both.
fn strains_of(stage: &StageCase) -> Option<f64> {
    stage.strained().and_then(|it| Some(it.axial_strain? / it.increment))
}

fn unused_meshes(of: &str) -> Error {
    let reason = format!(
        "the {of} are rigid and cannot break, so that nothing depends on their meshes; rock with \"damage\", or a fidelity that has them deform, does"
    );
    missing("mesh", &reason)
}

fn missing(word: &str, why: &str) -> Error {
    Error::Usage(format!("--vary {word}: cannot be varied here: {why}"))
}

fn floats(values: &[String], default: impl Fn() -> Vec<f64>) -> Result<Vec<f64>> {
    match values {
        [] => Ok(default()),
        values => values.iter().map(positive).collect(),
    }
}

fn positive(text: &String) -> Result<f64> {
    match text.trim().parse::<f64>() {
        Ok(x) if x.is_finite() && x > 0.0 => Ok(x),
        _ => Err(Error::Usage(format!("--values: {text:?} is not a positive number"))),
    }
}

/// Whole numbers, none below `least`.
fn whole(values: &[String], least: usize, default: impl Fn() -> Vec<usize>) -> Result<Vec<usize>> {
    let number = |text: &String| match text.trim().parse::<usize>() {
        Ok(n) if n >= least => Ok(n),
        Ok(_) => Err(Error::Usage(format!("--values: {text:?} is below {least}"))),
        Err(e) if *e.kind() == IntErrorKind::PosOverflow => {
            Err(Error::Usage(format!("--values: {text:?} is too large: at most {}", usize::MAX)))
        }
        Err(_) => Err(Error::Usage(format!("--values: {text:?} is not a whole number"))),
    };
    match values {
        [] => Ok(default()),
        values => values.iter().map(number).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHEAR: &str = include_str!("../../cases/stages/shear.json");
    const PUSH: &str = include_str!("../../cases/scenes/push.json");
    const HERTZ: &str = include_str!("../../cases/scenes/hertz.json");

    fn parsed(text: &str, overrides: &[&str]) -> (RawCase, Case) {
        let raw = RawCase::parse("case.json".as_ref(), text).unwrap().with(overrides);
        let case = raw.check().unwrap();
        (raw, case)
    }

    fn varied(raw: &RawCase, setting: &Setting) -> Case {
        let mut other = raw.clone();
        other.set(&setting.overrides);
        other.check().unwrap_or_else(|e| panic!("{e}"))
    }

    #[test]
    fn meshes_of_a_scene_are_varied_in_proportion() {
        let (raw, case) = parsed(HERTZ, &[]);
        let settings = Vary::Mesh.settings(&raw, &case, &["0.5".into(), "1".into()]).unwrap();
        let sizes: Vec<_> = settings.iter().map(|setting| setting.size).collect();
        assert_eq!(sizes, [Some(1.0), Some(0.5)]);
        let of_case = |at: &str| raw.value.pointer(at).is_some();
        assert_eq!(settings[1].overrides.len(), 4);
        assert!(settings[1].overrides.iter().all(|(path, _)| of_case(path)));
        let Geometry::Scene(scene) = varied(&raw, &settings[1]).geometry else { panic!("a scene") };
        assert!(scene.bodies.iter().all(|body| body.mesh_size == Some(2e-3)));
        assert!(scene.bodies.iter().all(|body| body.refine.is_some_and(|refine| refine.mesh_size == 2e-4)));
    }

    #[test]
    fn how_far_increments_may_grow_is_varied_with_them() {
        let (raw, case) = parsed(SHEAR, &[]);
        let settings = Vary::Increment.settings(&raw, &case, &["1e-4".into(), "2.5e-5".into()]).unwrap();
        for (setting, increments) in settings.iter().zip([[1e-4, 4e-4], [2.5e-5, 1e-4]]) {
            let StageCase::Shear { increment, increment_max, .. } = varied(&raw, setting).stages[1] else {
                panic!("a shear")
            };
            let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;
            assert!(near(increment, increments[0]) && near(increment_max, increments[1]), "{setting:?}");
        }
    }

    /// Defaults never ask for increments longer than a stage; a limit given with a unit is varied, too.
    #[test]
    fn increments_keep_within_their_stage() {
        for (strain, expected) in
            [(1e-2, [4.0, 2.0, 1.0]), (2.5e-3, [2.0, 1.0, 0.5]), (1e-3, [1.0, 0.5, 0.25])]
        {
            let strain = format!("/stages/1/axial_strain={strain}");
            let (raw, case) =
                parsed(SHEAR, &[&strain, "/stages/1/increment=1e-3", "/stages/1/increment_max=0.1 %"]);
            let settings = Vary::Increment.settings(&raw, &case, &[]).unwrap();
            for (setting, factor) in settings.iter().zip(expected) {
                assert_eq!(setting.size, Some(1e-3 * factor));
                varied(&raw, setting);
            }
        }
    }

    /// Increments that an accuracy shortens to one length would be no series.
    #[test]
    fn increments_keep_below_what_an_accuracy_allows() {
        let long = ["/stages/1/increment=4e-4", "/stages/1/increment_max=8e-4", "/solver/accuracy=0.05"];
        let (raw, case) = parsed(SHEAR, &long);
        let settings = |values: &[String]| Vary::Increment.settings(&raw, &case, values);
        let error = settings(&["2e-4".into(), "1e-4".into()]).unwrap_err().to_string();
        assert!(error.contains("2e-4 is above 1.25e-4") && error.contains("accuracy is 0.05"), "{error}");
        assert_eq!(settings(&["1.25e-4".into(), "1e-4".into()]).map(|settings| settings.len()).ok(), Some(2));
        for setting in settings(&[]).unwrap() {
            let remarks = varied(&raw, &setting).remarks().join("; ");
            assert!(!remarks.contains("is taken as"), "{setting:?}: {remarks}");
        }
    }

    #[test]
    fn unrests_are_varied_down_to_balance() {
        let (raw, case) = parsed(SHEAR, &[]);
        let values = ["null", "1e-3", "4e-3"].map(String::from);
        let settings = Vary::Stabilisation.settings(&raw, &case, &values).unwrap();
        let stabilisation = |setting: &Setting| varied(&raw, setting).solver.stabilisation;
        assert_eq!(settings.iter().map(stabilisation).collect::<Vec<_>>(), [Some(4e-3), Some(1e-3), None]);
        let (raw, case) = parsed(PUSH, &[]);
        let error = Vary::Stabilisation.settings(&raw, &case, &[]).unwrap_err().to_string();
        assert!(error.contains("--vary stabilisation") && error.contains("in balance"), "{error}");
    }

    #[test]
    fn penalties_of_a_condensed_scene_are_varied() {
        let (raw, case) = parsed(HERTZ, &[]);
        let settings = Vary::Penalty.settings(&raw, &case, &[]).unwrap();
        let penalty = |setting: &Setting| varied(&raw, setting).solver.first_penalty;
        assert_eq!(settings.iter().map(penalty).collect::<Vec<_>>(), [1e-3, 1.0, 1e3]);
    }

    #[test]
    fn meshes_of_grains_that_nothing_depends_on_are_not_varied() {
        let varied = |overrides: &[&str]| {
            let (raw, case) = parsed(SHEAR, overrides);
            Vary::Mesh.settings(&raw, &case, &[]).map(|settings| settings.len()).map_err(|e| e.to_string())
        };
        let rigid = "/solver/fidelity=rigid";
        let error = varied(&["/rock/damage=null", rigid]).unwrap_err();
        assert!(error.contains("--vary mesh") && error.contains("rigid and cannot break"), "{error}");
        assert!(varied(&["/rock/damage=null", "/solver/fidelity=auto"]).is_err());
        let breaks =
            ["/rock/damage={}", "/rock/compressive_strength=250 MPa", "/rock/tensile_strength=25 MPa"];
        assert_eq!(varied(&[&breaks[..], &[rigid]].concat()), Ok(3));
        assert_eq!(varied(&["/rock/damage=null", "/solver/fidelity=condensed"]), Ok(3));
        assert_eq!(varied(&["/rock/damage=null", "/solver/fidelity=auto", "/solver/accuracy=0.1"]), Ok(3));
    }

    #[test]
    fn meshes_of_bodies_that_nothing_depends_on_are_not_varied() {
        let varied = |fidelity: &str| {
            let text = HERTZ.replace("\"fidelity\": \"condensed\"", &format!("\"fidelity\": \"{fidelity}\""));
            let (raw, case) = parsed(&text, &[]);
            Vary::Mesh.settings(&raw, &case, &[]).map(|settings| settings.len()).map_err(|e| e.to_string())
        };
        assert_eq!(varied("condensed"), Ok(3));
        let error = varied("rigid").unwrap_err();
        assert!(error.contains("the bodies are rigid and cannot break"), "{error}");
    }

    #[test]
    fn a_series_of_meshes_begins_at_one_cell_and_is_sized_as_built() {
        let (raw, case) = parsed(SHEAR, &["/solver/fidelity=condensed", "/specimen/cells_per_grain=1"]);
        let mut settings = Vary::Mesh.settings(&raw, &case, &[]).unwrap();
        let labels: Vec<&str> = settings.iter().map(|setting| setting.label.as_str()).collect();
        assert_eq!(labels, ["1", "2", "4"]);
        let zero = Vary::Mesh.settings(&raw, &case, &["0".into()]).unwrap_err().to_string();
        assert!(zero.contains("below 1"), "{zero}");
        // One is not built yet: what was asked for stands for it.
        let all =
            [8.0, f64::NAN, 27.0].map(|cells| Figures { cells_of_a_grain: cells, ..Figures::default() });
        let built = Vary::Mesh.as_built(&mut settings, &all).unwrap();
        assert_eq!((built[0], built[2]), (8.0, 27.0));
        for (setting, cells) in settings.iter().zip([8.0_f64, 2.0, 27.0]) {
            assert!((setting.size.unwrap() * cells.cbrt() - 1.0).abs() < 1e-12, "{setting:?}");
        }
        assert_eq!(Vary::Seed.as_built(&mut settings, &all), None);
    }

    #[test]
    fn a_seed_beyond_what_there_are_is_too_large() {
        let (raw, case) = parsed(PUSH, &[]);
        let seed = |text: &str| Vary::Seed.settings(&raw, &case, &[text.into()]).unwrap_err().to_string();
        assert!(seed("99999999999999999999").contains("is too large: at most 18446744073709551615"));
        assert!(seed("1.5").contains("is not a whole number"));
    }

    #[test]
    fn the_largest_numbers_do_not_wrap() {
        let (mut raw, case) = parsed(PUSH, &[]);
        let most = usize::MAX.to_string();
        let settings = Vary::Increment.settings(&raw, &case, &[most]).unwrap();
        let (_, last) = settings[0].overrides.last().unwrap();
        assert_eq!(*last, json!(usize::MAX));
        raw.set(&[("/seed".into(), json!(u64::MAX))]);
        let case = raw.check().unwrap();
        assert_eq!(Vary::Seed.settings(&raw, &case, &[]).unwrap().len(), 1);
    }

    #[test]
    fn a_scene_without_meshes_has_none_to_vary() {
        let (raw, case) = parsed(PUSH, &[]);
        let error = Vary::Mesh.settings(&raw, &case, &[]).unwrap_err().to_string();
        assert!(error.contains("mesh_size"), "{error}");
    }
}
