//! What is far from any rockfill, mostly by a forgotten unit, and what would be more than a machine can bear.

use crate::results::counted;
use crate::specimen::{SpecimenSize, Unreachable};

use super::form::plain;
use super::size::SCENE_WEAKENING;
use super::types::*;

/// Plausible sizes of the coarsest grains [m] and pressures [Pa].
const SIZES: [f64; 2] = [1e-4, 3.0];
const PRESSURES: [f64; 2] = [1e3, 2e8];
/// Volume of voids over that of solids: broadly graded rock at its densest has more than the first.
const VOID_RATIOS: [f64; 2] = [0.15, 2.0];
/// Gravity [m/s2]: of a small body to that of a large centrifuge.
const GRAVITY: [f64; 2] = [1e-3, 3e3];
/// Tensile over compressive strength: rocks have a thirtieth to a fifth.
const STRENGTHS: [f64; 2] = [0.0, 0.5];
/// Increments of a stage that follow no curve.
const FEW: f64 = 2.0;
/// Rotations [rad]: degrees are more than a turn.
const ROTATIONS: [f64; 2] = [0.0, 6.3];
/// Times G t / p: the radius of the widest opening that a neo-Hookean sheet bridges (`verify`: a sheet over a hole).
const INFLATION: f64 = 1.24;
/// Openings between grains have about this radius over the largest size, at the least.
const PORE: f64 = 0.1;
/// Time on one core that is remarked on [s]: 30 days.
const LONG: f64 = 30.0 * 86400.0;

/// The largest sieve size [m].
fn first_size(grading: &[[f64; 2]]) -> f64 {
    grading.first().map_or(0.0, |point| point[0])
}

const METRES: &str = "a plain number is in metres, \"60 mm\" in millimetres";
const PASCALS: &str = "a plain number is in Pa, \"0.8 MPa\" in MPa";
const RADIANS: &str = "plain numbers are radians, \"30 deg\" are degrees";

/// What is far from the usual, a sentence each.
#[derive(Default)]
struct Found(Vec<String>);

impl Found {
    fn look(&mut self, name: &str, value: f64, unit: &str, [low, high]: [f64; 2], instead: &str) {
        if value < low || value > high {
            let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
            let shown = match value.abs() < 1e-5 || value.abs() >= 1e7 {
                true => format!("{value:e}"),
                false => format!("{value:.6}").trim_end_matches('0').trim_end_matches('.').to_string(),
            };
            let usual = format!("{} to {}{unit}", plain(low), plain(high));
            self.0
                .push(format!("{name} is {shown}{unit}, which is far from rockfill's ({usual}): {instead}"));
        }
    }
}

fn norm(vector: &[f64; 3]) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}

impl Case {
    /// What no rockfill is like: mostly a forgotten unit.
    pub(super) fn implausible(&self) -> Vec<String> {
        let mut found = Found::default();
        self.look_at_sizes(&mut found);
        self.look_at_motions(&mut found);
        self.look_at_materials(&mut found);
        self.look_at_stages(&mut found);
        found.0
    }

    fn look_at_sizes(&self, found: &mut Found) {
        match &self.geometry {
            Geometry::Specimen(it) => {
                found.look("specimen.grading: the largest size", first_size(&it.grading), "m", SIZES, METRES);
                // One that follows from the grains is as implausible as they are.
                if let SpecimenSize::Cylinder { diameter, .. } = it.size {
                    found.look("specimen.diameter", diameter, "m", [1e-3, 1e1], METRES);
                }
                // Whoever takes the nearest may ask for the densest so; another code's packing is as it is.
                if it.packing.is_none() && it.unreachable == Unreachable::Refuse {
                    let instead = "no packing of such grains is so dense, and compaction would take its time to find that out";
                    found.look("specimen.void_ratio", it.void_ratio, "", VOID_RATIOS, instead);
                }
            }
            Geometry::Scene(scene) => {
                // Those that are too thick are told of as meshes are, by what they span.
                let thin = |size: &f64| *size < 1.0;
                for body in &scene.bodies {
                    let Some(size) = body.shape.smallest_extent().filter(thin) else { continue };
                    let name = format!("the smallest extent of the body {:?}", body.name);
                    found.look(&name, size, "m", [1e-5, 1e2], METRES);
                }
            }
        }
    }

    /// Rotations and gravity of a scene.
    fn look_at_motions(&self, found: &mut Found) {
        let Geometry::Scene(scene) = &self.geometry else { return };
        for (k, body) in scene.bodies.iter().enumerate() {
            let name = format!("scene.bodies[{k}].rotation");
            found.look(&name, norm(&body.rotation), "rad", ROTATIONS, RADIANS);
        }
        let own = std::iter::once(("scene.gravity".to_string(), Some(scene.gravity)));
        let of_stages = self.stages.iter().enumerate().filter_map(|(k, stage)| {
            let StageCase::Load { gravity, .. } = stage else { return None };
            Some((format!("stages[{k}].gravity"), *gravity))
        });
        for (name, gravity) in own.chain(of_stages) {
            let size = norm(&gravity.unwrap_or_default());
            if size > 0.0 {
                found.look(&name, size, "m/s2", GRAVITY, "the Earth's is 9.81");
            }
        }
        for (k, stage) in self.stages.iter().enumerate() {
            let StageCase::Load { bodies, .. } = stage else { continue };
            for (name, rotation) in bodies.iter().filter_map(|(name, load)| Some((name, load.rotation?))) {
                let rotation = norm(&rotation.map(|turn| turn.unwrap_or(0.0)));
                let name = format!("stages[{k}].bodies.{name}.rotation");
                found.look(&name, rotation, "rad", ROTATIONS, RADIANS);
            }
        }
    }

    /// Rock, friction and rubber.
    fn look_at_materials(&self, found: &mut Found) {
        let rock = &self.rock;
        let instead = "a plain number is in kg/m3, \"2.65 g/cm3\" is a way to write it";
        found.look("rock.density", rock.density, "kg/m3", [1e3, 8e3], instead);
        found.look("rock.youngs_modulus", rock.youngs_modulus.mean, "Pa", [1e7, 1e12], PASCALS);
        for (name, strength) in
            [("tensile", &rock.tensile_strength), ("compressive", &rock.compressive_strength)]
        {
            let mean = strength.as_ref().map_or(1e7, |law| law.mean);
            found.look(&format!("rock.{name}_strength"), mean, "Pa", [1e4, 1e10], PASCALS);
        }
        if let (Some(tensile), Some(compressive)) = (rock.tensile_strength, rock.compressive_strength) {
            let name = "rock.tensile_strength over rock.compressive_strength";
            let instead = "rock bears about a tenth in tension of what it does in compression";
            found.look(name, tensile.mean / compressive.mean, "", STRENGTHS, instead);
        }
        let coefficient = "friction is a coefficient, the tangent of the angle: 0.7 for 35 degrees";
        found.look("contact.friction", self.contact.friction, "", [0.0, 2.0], coefficient);
        // By default it is the grains'.
        if self.plates.friction != self.contact.friction {
            found.look("plates.friction", self.plates.friction, "", [0.0, 2.0], coefficient);
        }
        let grain = match &self.geometry {
            Geometry::Specimen(it) => Some(first_size(&it.grading)),
            Geometry::Scene(it) => {
                it.bodies.iter().filter_map(|body| body.shape.smallest_extent()).reduce(f64::max)
            }
        };
        if let Some(grain) = grain.filter(|_| self.idle_weakening().is_none()) {
            let slips = [0.0, grain.max(SCENE_WEAKENING)];
            found.look("contact.weakening_distance", self.contact.weakening_distance, "m", slips, METRES);
        }
        if let (MembraneCase::Rubber { thickness, shear_modulus, .. }, Geometry::Specimen(_)) =
            (self.membrane, &self.geometry)
        {
            found.look("membrane.thickness", thickness, "m", [5e-5, 5e-2], METRES);
            found.look("membrane.shear_modulus", shear_modulus, "Pa", [1e4, 1e9], PASCALS);
        }
    }

    /// Pressures, each where it is named first, and increments.
    fn look_at_stages(&self, found: &mut Found) {
        // What a stage does not say is what the one before holds.
        let mut known: Vec<f64> = Vec::new();
        for (at, stage) in self.stages.iter().enumerate() {
            let pressure = stage.largest_pressure();
            if pressure > 0.0 && !known.contains(&pressure) {
                found.look(&format!("stages[{at}]: the pressure"), pressure, "Pa", PRESSURES, PASCALS);
            }
            known.extend([pressure, stage.pressure().unwrap_or(pressure)]);
            let Some(StrainedCase { axial_strain: Some(strain), increment, .. }) = self.strained(stage)
            else {
                continue;
            };
            let count = (strain / increment - 1e-9).ceil();
            if count <= FEW {
                found.0.push(format!(
                    "stages[{at}].increment is {}, its axial_strain of {} takes {}: too few to follow a curve; usual are 1e-4 to 1e-3",
                    plain(increment),
                    plain(strain),
                    counted(count, "increment")
                ));
            }
        }
    }

    /// A rubber sheet over pores that it cannot bridge at the largest pressure: the run would stop and say so.
    pub(super) fn too_wide_pores(&self) -> Option<String> {
        let Geometry::Specimen(specimen) = &self.geometry else { return None };
        let MembraneCase::Rubber { thickness, shear_modulus, .. } = self.membrane else { return None };
        let pressure = self.stages.iter().map(StageCase::largest_pressure).fold(0.0, f64::max);
        let bridged = INFLATION * shear_modulus * thickness / pressure;
        let grain = first_size(&specimen.grading);
        (bridged < PORE * grain).then(|| {
            format!(
                "the membrane bridges openings up to a radius of {:.1} mm at {:.2} MPa, between grains of up to {:.0} mm: it may bulge in \
                 without end, and the run would stop; a thicker or stiffer one, or {{\"kind\": \"pressure\"}}, does not",
                1e3 * bridged,
                1e-6 * pressure,
                1e3 * grain
            )
        })
    }

    /// What the estimate comes to on a machine with so much memory [B], where that is known.
    pub fn burdens(&self, memory: Option<f64>) -> Vec<String> {
        let estimate = self.estimate();
        let mut burdens = Vec::new();
        if let Some(there) = memory.filter(|there| estimate.memory > *there) {
            burdens.push(format!(
                "about {:.1} GB are needed and this machine has {:.1} GB: the run may be killed; take fewer grains or fewer cells",
                estimate.memory / 1e9,
                there / 1e9
            ));
        }
        if estimate.time > LONG {
            burdens.push(format!(
                "about {:.0} days on one core: fewer grains, less strain or larger increments take less",
                estimate.time / 86400.0
            ));
        }
        burdens
    }
}

#[cfg(test)]
mod tests {
    use crate::case::checked;

    /// A forgotten unit each: what the author meant is a thousand or a million times that.
    #[test]
    fn forgotten_units_are_remarked_on() {
        let text = r#"{"specimen": {"grains": 80, "aspect": 2, "void_ratio": 0.5, "grading": [["60 mm", 1], ["40 mm", 0]]},
            "rock": {"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2, "damage": {},
                     "tensile_strength": "25 MPa", "compressive_strength": "250 MPa"},
            "contact": {"friction": 0.65}, "membrane": {"kind": "rubber", "thickness": "4 mm", "shear_modulus": "20 MPa"},
            "stages": [{"kind": "consolidate", "pressure": "0.8 MPa"}, {"kind": "shear", "axial_strain": 0.1}]}"#;
        let remarks =
            |overrides: &[&str]| checked(text, overrides).unwrap_or_else(|e| panic!("{e}")).remarks();
        let none: [String; 0] = [];
        assert_eq!(remarks(&["/specimen/grains=2000"]), none);
        for (given, says) in [
            ("/specimen/grading=[[60, 1], [40, 0]]", "specimen.grading: the largest size is 60 m"),
            ("/stages/0/pressure=0.8", "stages[0]: the pressure is 0.8 Pa"),
            ("/rock/density=2.7", "rock.density is 2.7 kg/m3"),
            (
                "/specimen/void_ratio=0.06",
                "specimen.void_ratio is 0.06, which is far from rockfill's (0.15 to 2):",
            ),
            ("/contact/friction=5", "contact.friction is 5, which is far from rockfill's (0 to 2):"),
            ("/rock/tensile_strength=2500", "rock.tensile_strength is 2500 Pa"),
            ("/membrane/shear_modulus=20", "membrane.shear_modulus is 20 Pa"),
            (
                "/rock/tensile_strength=200 MPa",
                "rock.tensile_strength over rock.compressive_strength is 0.8,",
            ),
            (
                "/stages/1/increment=0.06",
                "stages[1].increment is 0.06, its axial_strain of 0.1 takes 2 increments:",
            ),
        ] {
            let found = remarks(&["/specimen/grains=2000", given]);
            // Once, where it was given: not of stages, plates and sizes that take it over.
            let told: Vec<_> = found.iter().filter(|remark| !remark.contains("membrane bridges")).collect();
            assert!(told.len() == 1 && told[0].starts_with(says), "{given}: {found:?}");
        }
        let slow =
            ["/specimen/grains=2000", "/contact/residual_friction=0.3", "/contact/weakening_distance=12"];
        let found = remarks(&slow);
        assert!(found.len() == 1 && found[0].starts_with("contact.weakening_distance is 12 m"), "{found:?}");
        // As dense as can be.
        let nearest = ["/specimen/void_ratio=0.06", "/specimen/unreachable=nearest", "/specimen/grains=2000"];
        assert_eq!(remarks(&nearest), none);
        // 2 mm of 0.45 MPa at 0.8 MPa: 1.4 mm.
        let thin = remarks(&["/membrane/thickness=2 mm", "/membrane/shear_modulus=0.45 MPa"]);
        assert!(
            thin.iter().any(|remark| remark.contains("up to a radius of 1.4 mm at 0.80 MPa")),
            "{thin:?}"
        );
    }

    #[test]
    fn forgotten_units_of_scenes_are_remarked_on() {
        let text = r#"{"scene": {"bodies": [{"name": "a", "shape": {"box": [0.1, 0.1, 0.1]}, "rotation": [0, 0, "170 deg"]}]},
            "rock": {"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2}, "contact": {"friction": 0.65},
            "stages": [{"kind": "load", "gravity": [0, 0, -9.81], "bodies": {"a": {"rotation": [0, 0.1, null]}}}]}"#;
        let remarks = |given: &[&str]| checked(text, given).unwrap_or_else(|e| panic!("{e}")).remarks();
        let none: [String; 0] = [];
        assert_eq!(remarks(&[]), none);
        for (given, says) in [
            ("/stages/0/gravity=[0, 0, -9806]", "stages[0].gravity is 9806 m/s2"),
            ("/scene/gravity=[1e-9, 0, 0]", "scene.gravity is 1e-9 m/s2"),
            ("/scene/bodies/0/rotation=[0, 45, 0]", "scene.bodies[0].rotation is 45 rad"),
            ("/stages/0/bodies/a/rotation=[12, null, 0]", "stages[0].bodies.a.rotation is 12 rad"),
        ] {
            let found = remarks(&[given]);
            assert!(found.len() == 1 && found[0].starts_with(says), "{given}: {found:?}");
        }
    }

    #[test]
    fn more_memory_than_there_is_is_said() {
        let text = r#"{"specimen": {"grains": 5000000, "aspect": 2, "void_ratio": 0.5, "grading": [["60 mm", 1], ["40 mm", 0]]},
            "rock": {"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2}, "contact": {"friction": 0.65},
            "stages": [{"kind": "consolidate", "pressure": "0.8 MPa"}]}"#;
        let case = checked(text, &[]).unwrap_or_else(|e| panic!("{e}"));
        let said = case.burdens(Some(24e9)).join("; ");
        assert!(said.contains("this machine has 24.0 GB") && said.contains("days on one core"), "{said}");
        assert!(!case.burdens(Some(1e14)).join("; ").contains("this machine"));
        assert!(!case.burdens(None).join("; ").contains("this machine"));
    }
}
