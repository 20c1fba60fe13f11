//! What a sound case holds that its author may not expect.

use std::path::Path;

use crate::contact::face::{Face, FaceContact};
use crate::geometry::RoundedBody;
use crate::mesh::file::read_mesh;
use crate::model::STIFFNESS_RATIO;

use super::overlap::Placed;
use super::types::*;

/// Largest sieve size over the diameter that laboratories keep to.
const COARSEST: f64 = 0.2;

/// Moduli and sizes of bodies that differ by more make systems badly conditioned.
const UNLIKE: [f64; 2] = [1e5, 20.0];

/// Share of the mass of a specimen by which a class may have too little below its middle without a word.
const OFF_THE_CURVE: f64 = 0.1;

/// Largest extent of a body that is taken for metres without a word [m]; a grain given in millimetres spans more.
const LARGEST_BODY: f64 = 10.0;

/// The largest pressure of a case, over what its rock can bear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Squeeze {
    /// [Pa]
    pub pressure: f64,
    /// Over the mean Young's modulus.
    pub over_modulus: f64,
    /// How far contacts of rigid grains overlap under it, over their two roundings.
    pub over_roundings: f64,
}

impl std::fmt::Display for Squeeze {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Squeeze { pressure, over_modulus, over_roundings } = self;
        write!(
            f,
            "a pressure of {pressure:.2e} Pa is {over_modulus:.1e} of Young's modulus: contacts overlap by about {over_roundings:.1} times \
             their roundings, and have little or nothing left to carry it by; stiffer rock, less pressure or a larger contact.rounding would"
        )
    }
}

impl Case {
    /// Remarks on a sound case, each a sentence.
    pub fn remarks(&self) -> Vec<String> {
        let mut remarks = self.notes.clone();
        if let Geometry::Specimen(specimen) = &self.geometry {
            let largest = specimen.grading.first().map_or(0.0, |point| point[0]);
            let ratio = largest / specimen.diameter;
            remarks.extend(specimen.grading.windows(2).filter_map(|sieves| off_the_curve(sieves, specimen)));
            if ratio > COARSEST {
                remarks.push(format!(
                    "the largest grain is {ratio:.2} of the diameter; laboratories keep to {COARSEST}"
                ));
            }
        }
        remarks.extend(self.squeeze().map(|squeeze| squeeze.to_string()));
        remarks.extend(self.blended_faces());
        remarks.extend(self.huge_bodies());
        let [moduli, sizes] = self.ratios();
        if moduli >= UNLIKE[0] {
            remarks.push(format!(
                "the moduli of bodies differ by a factor of {moduli:.0e}: the systems to be solved are badly conditioned; every increment \
                 balances to solver.force_tolerance all the same, or is cut"
            ));
        }
        if sizes > UNLIKE[1] {
            remarks.push(format!(
                "the sizes of bodies differ by a factor of {sizes:.0}: the systems to be solved are badly conditioned; in a \
                 scene each body balances by what it carries itself, in a specimen by the mean contact force, not that of the smallest"
            ));
        }
        if let Some((path, recovery)) = self.recovery() {
            remarks.push(format!(
                "{path}.recovery_in_compression is {recovery}: where cracks close, stiffness comes back that nothing pays for. A bar pulled to twelve \
                 times its peak strain made up a quarter of the work on it so; 0 does so no more"
            ));
        }
        if let (Some(accuracy), None) = (self.solver.accuracy, self.solver.chosen_accuracy()) {
            remarks.push(format!(
                "solver.accuracy {accuracy} decides nothing: the fidelity is given; \"auto\" is chosen by accuracy"
            ));
        }
        if self.solver.rough_tolerance.is_some() {
            remarks.push(
                "solver.rough_tolerance has no effect any more: solver.stabilisation says how much may move at the end of an increment"
                    .into(),
            );
        }
        if self.rock.damage.is_some_and(|damage| damage.release_steps.is_some()) {
            remarks.push(
                "rock.damage.release_steps has no effect any more: what failed rock held goes at once, against the drag of \
                 solver.stabilisation"
                    .into(),
            );
        }
        remarks.extend(self.implausible());
        remarks.extend(self.too_wide_pores());
        remarks
    }

    /// The first rock whose cracks carry again where they close, by its path, and to what share.
    fn recovery(&self) -> Option<(String, f64)> {
        let of =
            |rock: &RockCase| rock.damage.map(|damage| damage.recovery_in_compression).filter(|w| *w > 0.0);
        let bodies = match &self.geometry {
            Geometry::Specimen(_) => &[],
            Geometry::Scene(scene) => &scene.bodies[..],
        };
        let of_body = |(index, body): (usize, &BodyCase)| {
            Some((format!("scene.bodies[{index}].rock.damage"), of(body.rock.as_ref()?)?))
        };
        let own = bodies.iter().enumerate().find_map(of_body);
        of(&self.rock).map(|recovery| ("rock.damage".into(), recovery)).or(own)
    }

    /// The largest confining pressure that stages ask of a specimen, where it uses up the roundings. A contact of grains of the size d carries about
    /// `p d^2` by the spring `0.5 k E d` of two of them, and can overlap by its two roundings.
    pub fn squeeze(&self) -> Option<Squeeze> {
        let Geometry::Specimen(_) = &self.geometry else { return None };
        let pressure = self.stages.iter().map(StageCase::largest_pressure).fold(0.0, f64::max);
        let over_modulus = pressure / self.rock.youngs_modulus.mean;
        let over_roundings = over_modulus / (0.5 * STIFFNESS_RATIO * 2.0 * self.contact.rounding);
        (over_roundings > 1.0).then_some(Squeeze { pressure, over_modulus, over_roundings })
    }

    /// Where `contact.faces` is "area", the bodies of which a face carries by its corners and edges all the same.
    fn blended_faces(&self) -> Vec<String> {
        let Geometry::Scene(scene) = &self.geometry else { return Vec::new() };
        let blended = |body: &BodyCase| {
            let placed = Placed::new(body, None).ok().flatten()?;
            let rounding = body.rounding.or(Some(self.contact.rounding * body.shape.smallest_extent()?))?;
            let [all, blended] = Face::count(&RoundedBody::inset(&placed.shape, rounding).ok()?);
            (blended > 0).then(|| {
                format!(
                    "contact.faces \"area\": {blended} of the {all} faces of {:?} meet others at less than 0.1 rad and carry by corners and edges",
                    body.name
                )
            })
        };
        match self.contact.faces {
            FaceContact::Area => scene.bodies.iter().filter_map(blended).collect(),
            FaceContact::Corners => Vec::new(),
        }
    }

    /// Bodies that move and are larger than rock ever is in a test.
    fn huge_bodies(&self) -> Vec<String> {
        let Geometry::Scene(scene) = &self.geometry else { return Vec::new() };
        let huge = |body: &BodyCase| {
            let extent =
                body.shape.smallest_extent().filter(|extent| !body.fixed && *extent > LARGEST_BODY)?;
            Some(format!("{:?} is {extent:.3e} m thick: lengths without a unit are metres", body.name))
        };
        scene.bodies.iter().filter_map(huge).collect()
    }

    /// Remarks on the mesh files of a sound case, which are relative to `folder`.
    pub fn remarks_on_meshes(&self, folder: &Path) -> Vec<String> {
        let Geometry::Scene(scene) = &self.geometry else { return Vec::new() };
        let large = |body: &BodyCase| {
            let ShapeCase::Mesh(file) = &body.shape else { return None };
            let hull = read_mesh(&folder.join(file)).and_then(|mesh| mesh.convex_hull()).ok()?;
            let extents = Placed::new(body, Some(hull)).ok().flatten()?.extents();
            extents.iter().any(|extent| *extent > LARGEST_BODY).then(|| {
                let [x, y, z] = extents;
                format!(
                    "{:?} spans {x:.3e} x {y:.3e} x {z:.3e} m: lengths of {file} are read as metres; if it is in millimetres, scale it by 0.001",
                    body.name
                )
            })
        };
        scene.bodies.iter().filter_map(large).collect()
    }

    /// Largest over smallest mean modulus, and size of what is not held.
    fn ratios(&self) -> [f64; 2] {
        let ratio = |values: &mut dyn Iterator<Item = f64>| {
            let (low, high) =
                values.fold((f64::INFINITY, 0.0_f64), |(low, high), x| (low.min(x), high.max(x)));
            if low <= high { high / low } else { 1.0 }
        };
        match &self.geometry {
            Geometry::Specimen(specimen) => [1.0, ratio(&mut specimen.grading.iter().map(|point| point[0]))],
            Geometry::Scene(scene) => {
                let modulus = |body: &BodyCase| body.rock.as_ref().unwrap_or(&self.rock).youngs_modulus.mean;
                let free = scene.bodies.iter().filter(|body| !body.fixed);
                let mut sizes = free.filter_map(|body| body.shape.smallest_extent());
                [ratio(&mut scene.bodies.iter().map(modulus)), ratio(&mut sizes)]
            }
        }
    }
}

/// What a class between two sieves lacks below its middle, where that is much.
fn off_the_curve(sieves: &[[f64; 2]], specimen: &SpecimenCase) -> Option<String> {
    let [high, low] = [sieves[0][0], sieves[1][0]];
    let finer = specimen.within_class.passing([low, high], 0.5 * (low + high));
    ((0.5 - finer) * (sieves[0][1] - sieves[1][1]) > OFF_THE_CURVE).then(|| {
        format!(
            "between the sieves {low} and {high} m {:.0} % of the mass is finer than the middle, where a straight line has 50 %: sizes are uniform \
             by number there; give more sieves, or specimen.within_class \"mass\"",
            100.0 * finer
        )
    })
}

#[cfg(test)]
mod tests {
    use crate::case::{RawCase, parse_override};

    #[test]
    fn what_decides_nothing_and_what_is_too_coarse_is_said() {
        let text = r#"{"specimen": {"diameter": "0.3 m", "height": "0.6 m", "void_ratio": 0.5, "grading": [[0.06, 1], [0.04, 0]]},
            "rock": {"density": 2180, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2},
            "contact": {"friction": 0.65}, "stages": [{"kind": "consolidate", "pressure": "0.8 MPa"}]}"#;
        let remarks = |overrides: &[&str]| {
            let mut raw = RawCase::parse("x.json".as_ref(), text).unwrap_or_else(|e| panic!("{e}"));
            let parsed: Vec<_> = overrides.iter().filter_map(|text| parse_override(text).ok()).collect();
            assert_eq!(parsed.len(), overrides.len());
            raw.set(&parsed);
            raw.check().unwrap_or_else(|e| panic!("{e}")).remarks().join("; ")
        };
        // A fifth exactly is kept to.
        assert_eq!(remarks(&[]), "");
        assert_eq!(remarks(&["/solver/fidelity=auto", "/solver/accuracy=0.05"]), "");
        assert!(
            remarks(&["/solver/fidelity=rigid", "/solver/accuracy=0.05"]).contains("0.05 decides nothing")
        );
        assert!(remarks(&["/solver/rough_tolerance=0.1"]).contains("no effect"));
        assert!(remarks(&["/specimen/diameter=0.15"]).contains("0.40 of the diameter"));
        assert!(remarks(&["/specimen/grading=[[0.06, 1], [0.002, 0]]"]).contains("a factor of 30"));
        assert!(
            remarks(&["/specimen/grading=[[0.06, 1], [0.015, 0]]"]).contains("28 % of the mass is finer")
        );
        assert_eq!(
            remarks(&["/specimen/grading=[[0.06, 1], [0.015, 0]]", "/specimen/within_class=mass"]),
            ""
        );
    }

    #[test]
    fn stiffness_that_comes_back_is_remarked_on() {
        let text = |recovery: &str| {
            format!(
                r#"{{"specimen": {{"diameter": "0.3 m", "height": "0.6 m", "void_ratio": 0.5, "grading": [[0.06, 1], [0.04, 0]]}},
            "rock": {{"density": 2180, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2, "compressive_strength": 2e8, "tensile_strength": 2e7,
                "damage": {{"exponent": 3{recovery}}}}},
            "contact": {{"friction": 0.65}}, "stages": [{{"kind": "consolidate", "pressure": "0.8 MPa"}}]}}"#
            )
        };
        let remarks = |recovery: &str| {
            let raw = RawCase::parse("x.json".as_ref(), &text(recovery)).unwrap_or_else(|e| panic!("{e}"));
            raw.check().unwrap_or_else(|e| panic!("{e}")).remarks().join("; ")
        };
        assert_eq!(remarks(""), "");
        let remarked = remarks(", \"recovery_in_compression\": 0.3");
        assert!(remarked.contains("rock.damage.recovery_in_compression is 0.3"), "{remarked}");
    }

    /// Scene 17 of the ladder.
    #[test]
    fn bodies_unlike_each_other_are_remarked_on() {
        let text = r#"{"scene": {"bodies": [{"name": "base", "shape": {"box": [1, 1, 0.1]}, "position": [0, 0, -0.05], "fixed": true},
                {"name": "ball", "shape": {"sphere": 0.02}, "position": [0, 0, 0.02], "rock": {"youngs_modulus": "30 kPa"}},
                {"name": "block", "shape": {"box": [1, 1, 1]}, "position": [0, 0, 0.54]}]},
            "rock": {"density": 2180, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2},
            "contact": {"friction": 0.65}, "stages": [{"kind": "load"}]}"#;
        let raw = RawCase::parse("x.json".as_ref(), text).unwrap_or_else(|e| panic!("{e}"));
        let remarks = raw.check().unwrap_or_else(|e| panic!("{e}")).remarks();
        assert!(remarks.len() == 2 && remarks[0].contains("a factor of 1e6"), "{remarks:?}");
        assert!(remarks[1].contains("a factor of 25"), "{remarks:?}");
        let text = text
            .replace("[1, 1, 1]}, \"position\": [0, 0, 0.54]", "[60, 40, 50]}, \"position\": [0, 0, 25.04]");
        let raw = RawCase::parse("x.json".as_ref(), &text).unwrap_or_else(|e| panic!("{e}"));
        let remarks = raw.check().unwrap_or_else(|e| panic!("{e}")).remarks();
        assert!(remarks.iter().any(|remark| remark.contains("\"block\" is 4.000e1 m thick")), "{remarks:?}");
    }
}
