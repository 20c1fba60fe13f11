//! Keys of a sound case that decide nothing, each with what makes it so. A key that is left at its default says nothing.

use super::overlap::Placed;
use super::size::{SCENE_WEAKENING, weakening_distance};
use super::types::*;
use crate::contact::NormalLaw;

/// What the table has where a case does not say.
const GENT_LIMIT: f64 = 30.0;
const MOONEY_SHARE: f64 = 0.2;

/// A value that was given: it is not the default.
fn is_given(value: f64, default: f64) -> bool {
    (value - default).abs() > 1e-9 * default
}

fn scatters(law: &Law) -> bool {
    !matches!(law.scatter, Scatter::Constant)
}

impl Case {
    /// Remarks on keys that decide nothing; `placed` are the bodies of a scene as far as they are known.
    pub(super) fn idle(&self, placed: &[Option<Placed>]) -> Vec<String> {
        let mut idle = Vec::new();
        if let (Some(accuracy), None) = (self.solver.accuracy, self.solver.chosen_accuracy()) {
            idle.push(format!(
                "solver.accuracy {accuracy} decides nothing: the fidelity is given; \"auto\" is chosen by accuracy"
            ));
        }
        if self.contact.limit_pressure.is_some() && self.contact.normal == NormalLaw::Spring {
            idle.push("contact.limit_pressure decides nothing: contact.normal is \"spring\"".into());
        }
        idle.extend(self.outdated());
        idle.extend(self.idle_strength("rock", &self.rock));
        idle.extend(self.idle_weakening());
        match &self.geometry {
            Geometry::Specimen(_) => {
                if !self.meshes_act() {
                    idle.extend(idle_scatter("rock", &self.rock, "all grains are rigid"));
                }
                idle.extend(self.idle_rubber());
            }
            Geometry::Scene(scene) => {
                let deforms = |body: &BodyCase| self.fidelity_of(body) != Fidelity::Rigid;
                if !scene.bodies.iter().any(|body| body.rock.is_none() && deforms(body)) {
                    let why = "the bodies that are of it are rigid";
                    idle.extend(idle_scatter("rock", &self.rock, why));
                }
                if scene.press.is_some() && self.contact.normal == NormalLaw::Asperity {
                    idle.push(
                        "contact.normal \"asperity\" decides nothing: plates of a press meet nodes".into(),
                    );
                }
                for (k, body) in scene.bodies.iter().enumerate() {
                    let path = format!("scene.bodies[{k}]");
                    idle.extend(self.idle_rock(&path, body));
                    idle.extend(self.idle_cells(&path, body, placed.get(k).and_then(Option::as_ref)));
                }
            }
        }
        idle
    }

    /// Keys that older versions had.
    fn outdated(&self) -> Vec<String> {
        let rough = self.solver.rough_tolerance.map(|_| {
            "solver.rough_tolerance has no effect any more: solver.stabilisation says how much may move at the end of an increment"
        });
        let release = self.rock.damage.and_then(|damage| damage.release_steps).map(|_| {
            "rock.damage.release_steps has no effect any more: what failed rock held goes at once, against the drag of solver.stabilisation"
        });
        let nodes = self.solver.full_nodes.map(|_| {
            "solver.full_nodes has no effect any more: the nodes of full bodies are always eliminated body by body"
        });
        [rough, release, nodes].into_iter().flatten().map(String::from).collect()
    }

    /// Strengths without damage, and without asperities that crush by them.
    fn idle_strength(&self, path: &str, rock: &RockCase) -> Option<String> {
        let crushes = self.contact.normal == NormalLaw::Asperity && self.contact.limit_pressure.is_none();
        let given = [
            rock.tensile_strength.map(|_| "tensile_strength"),
            rock.compressive_strength.filter(|_| !crushes).map(|_| "compressive_strength"),
        ];
        let names: Vec<&str> = given.into_iter().flatten().collect();
        (rock.damage.is_none() && !names.is_empty()).then(|| {
            let verb = if names.len() > 1 { "decide" } else { "decides" };
            format!(
                "{path}: {} {verb} nothing: {path}.damage is null, so that nothing breaks",
                names.join(" and ")
            )
        })
    }

    /// Friction that is residual from the start does not weaken.
    pub(super) fn idle_weakening(&self) -> Option<String> {
        let distance = self.contact.weakening_distance;
        let peak = self.contact.friction;
        let (peak, default) = match &self.geometry {
            Geometry::Specimen(it) => (peak.max(self.plates.friction), weakening_distance(&it.grading)),
            Geometry::Scene(scene) => {
                let bodies = scene.bodies.iter().filter_map(|body| body.friction);
                (bodies.fold(peak, f64::max), SCENE_WEAKENING)
            }
        };
        let weakens = peak > self.contact.residual_friction;
        (is_given(distance, default) && !weakens).then(|| {
            format!(
                "contact.weakening_distance {distance} m decides nothing: contact.residual_friction is the peak {peak}, by default"
            )
        })
    }

    fn idle_rubber(&self) -> Vec<String> {
        let MembraneCase::Rubber { law, mooney_share, gent_limit, .. } = self.membrane else {
            return Vec::new();
        };
        let is_gent = law == RubberLawCase::Gent;
        let is_mooney = law == RubberLawCase::MooneyRivlin;
        let idle = |key: &str, value: f64, law: &str| {
            format!("membrane.{key} {value} decides nothing: membrane.law is not \"{law}\"")
        };
        let mut found = Vec::new();
        if !is_gent && is_given(gent_limit, GENT_LIMIT) {
            found.push(idle("gent_limit", gent_limit, "gent"));
        }
        if !is_mooney && is_given(mooney_share, MOONEY_SHARE) {
            found.push(idle("mooney_share", mooney_share, "mooney_rivlin"));
        }
        found
    }

    /// Of a body's own rock, where it is unlike the case's.
    fn idle_rock(&self, path: &str, body: &BodyCase) -> Vec<String> {
        let Some(rock) = &body.rock else { return Vec::new() };
        let (path, case) = (format!("{path}.rock"), &self.rock);
        let mut found = Vec::new();
        let strengths = |rock: &RockCase| (rock.tensile_strength, rock.compressive_strength);
        if strengths(rock) != strengths(case) {
            found.extend(self.idle_strength(&path, rock));
        }
        let laws = |rock: &RockCase| (rock.youngs_modulus, rock.poissons_ratio);
        if self.fidelity_of(body) == Fidelity::Rigid && laws(rock) != laws(case) {
            found.extend(idle_scatter(&path, rock, "bodies that are rigid do not deform"));
        }
        found
    }

    /// Of the sizes of a body's cells.
    fn idle_cells(&self, path: &str, body: &BodyCase, placed: Option<&Placed>) -> Vec<String> {
        let mut found = Vec::new();
        let is_rigid = self.fidelity_of(body) == Fidelity::Rigid;
        if let Some(size) = body.mesh_size {
            let largest = placed.map_or(f64::INFINITY, |it| it.extents().into_iter().fold(0.0, f64::max));
            if is_rigid {
                found.push(format!(
                    "{path}.mesh_size {size} m decides only how {:?} is drawn: it is rigid",
                    body.name
                ));
            } else if size > largest {
                found.push(format!(
                    "{path}.mesh_size {size} m decides nothing: {:?} spans {largest:.4} m, and has the largest cells that it can have",
                    body.name
                ));
            }
        }
        if let (Some(refine), ShapeCase::Sphere(radius)) = (&body.refine, &body.shape) {
            let key = format!("{path}.refine decides nothing");
            let off = refine.point.iter().map(|x| x * x).sum::<f64>().sqrt() - refine.radius - radius;
            let cells = body.cell_size().unwrap_or(f64::INFINITY);
            if is_rigid && body.mesh_size.is_none() {
                found.push(format!("{key}: {:?} is rigid and has no mesh", body.name));
            } else if off >= 0.0 {
                found.push(format!("{key}: it is {off:.4} m outside {:?}", body.name));
            } else if refine.mesh_size >= cells {
                let size = refine.mesh_size;
                found.push(format!("{key}: its mesh_size {size} m is no less than the body's, {cells} m"));
            }
        }
        found
    }
}

/// Elastic constants that vary from cell to cell where no cell deforms.
fn idle_scatter(path: &str, rock: &RockCase, why: &str) -> Option<String> {
    let laws = [("youngs_modulus", &rock.youngs_modulus), ("poissons_ratio", &rock.poissons_ratio)];
    let names: Vec<&str> = laws.into_iter().filter(|(_, law)| scatters(law)).map(|(name, _)| name).collect();
    (!names.is_empty()).then(|| {
        format!("the scatter of {path}.{} decides nothing: {why}, and take its mean", names.join(" and "))
    })
}

#[cfg(test)]
mod tests {
    use crate::case::checked;

    const SPECIMEN: &str = r#"{"specimen": {"grains": 2000, "aspect": 2, "void_ratio": 0.5, "grading": [["60 mm", 1], ["40 mm", 0]]},
        "rock": {"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2}, "contact": {"friction": 0.65},
        "membrane": {"kind": "rubber", "thickness": "4 mm", "shear_modulus": "20 MPa"},
        "stages": [{"kind": "consolidate", "pressure": "0.8 MPa"}]}"#;
    const SCENE: &str = r#"{"scene": {"bodies": [
        {"name": "base", "shape": {"box": [0.5, 0.5, 0.1]}, "position": [0, 0, -0.05], "fixed": true, "fidelity": "rigid"},
        {"name": "ball", "shape": {"sphere": 0.03}, "position": [0, 0, 0.03], "fidelity": "condensed"}]},
        "rock": {"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2}, "contact": {"friction": 0.65},
        "stages": [{"kind": "load"}]}"#;

    fn told(text: &str, overrides: &[&str]) -> Vec<String> {
        let mut found = checked(text, overrides).unwrap_or_else(|e| panic!("{overrides:?}: {e}")).remarks();
        found.retain(|remark| remark.contains("decide"));
        found
    }

    /// Each key alone says that it decides nothing, and no word where it does.
    #[test]
    fn keys_that_decide_nothing_are_told() {
        let scatter = r#"/rock/poissons_ratio={"mean": 0.25, "variation": 0.1}"#;
        let damage = r#"/rock/damage={"exponent": 3}"#;
        let strengths = ["/rock/tensile_strength=7 MPa", "/rock/compressive_strength=70 MPa"];
        let rows: &[(&str, &[&str], &str)] = &[
            (SPECIMEN, &[], ""),
            (SPECIMEN, &strengths[..1], "rock: tensile_strength decides nothing"),
            (SPECIMEN, &strengths, "rock: tensile_strength decides nothing"),
            (
                SPECIMEN,
                &["/contact/normal=spring", strengths[0], strengths[1]],
                "tensile_strength and compressive_strength decide nothing",
            ),
            (SPECIMEN, &[damage, strengths[0], strengths[1]], ""),
            (SPECIMEN, &[strengths[1]], ""),
            (
                SPECIMEN,
                &["/contact/weakening_distance=2 mm"],
                "contact.weakening_distance 0.002 m decides nothing",
            ),
            (SPECIMEN, &["/contact/weakening_distance=2 mm", "/contact/residual_friction=0.3"], ""),
            (SPECIMEN, &["/contact/weakening_distance=2 mm", "/plates/friction=0.9"], ""),
            (SPECIMEN, &["/membrane/gent_limit=12"], "membrane.gent_limit 12 decides nothing"),
            (SPECIMEN, &["/membrane/gent_limit=12", "/membrane/law=gent"], ""),
            (SPECIMEN, &["/membrane/mooney_share=0.4"], "membrane.mooney_share 0.4 decides nothing"),
            (SPECIMEN, &["/membrane/mooney_share=0.4", "/membrane/law=mooney_rivlin"], ""),
            (
                SPECIMEN,
                &[scatter],
                "the scatter of rock.poissons_ratio decides nothing: all grains are rigid",
            ),
            (SPECIMEN, &[scatter, "/solver/fidelity=condensed"], ""),
            (SCENE, &[], ""),
            (SCENE, &[scatter], ""),
            (
                SCENE,
                &[scatter, "/scene/bodies/1/fidelity=rigid"],
                "the scatter of rock.poissons_ratio decides nothing",
            ),
            (
                SCENE,
                &[r#"/scene/bodies/0/rock={"youngs_modulus": {"mean": 3e10, "weibull_shape": 5}}"#],
                "scene.bodies[0].rock.youngs_modulus decides nothing",
            ),
            (
                SCENE,
                &["/scene/bodies/0/mesh_size=30 mm"],
                "scene.bodies[0].mesh_size 0.03 m decides only how",
            ),
            (SCENE, &["/scene/bodies/1/mesh_size=70 mm"], "scene.bodies[1].mesh_size 0.07 m decides nothing"),
            (SCENE, &["/scene/bodies/1/mesh_size=40 mm"], ""),
            (
                SCENE,
                &[r#"/scene/bodies/1/refine={"point": [0, 0, -0.09], "radius": 0.01, "mesh_size": 0.002}"#],
                "scene.bodies[1].refine decides nothing: it is 0.05",
            ),
            (
                SCENE,
                &[r#"/scene/bodies/1/refine={"point": [0, 0, -0.03], "radius": 0.01, "mesh_size": 0.025}"#],
                "no less than the body's, 0.02 m",
            ),
            (
                SCENE,
                &[r#"/scene/bodies/1/refine={"point": [0, 0, -0.03], "radius": 0.01, "mesh_size": 0.004}"#],
                "",
            ),
        ];
        for (text, overrides, says) in rows {
            let found = told(text, overrides);
            match says.is_empty() {
                true => assert!(found.is_empty(), "{overrides:?}: {found:?}"),
                false => assert!(found.len() == 1 && found[0].contains(says), "{overrides:?}: {found:?}"),
            }
        }
    }
}
