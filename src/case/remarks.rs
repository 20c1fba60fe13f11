//! What a sound case holds that its author may not expect.

use std::path::Path;

use crate::contact::NormalLaw;
use crate::contact::asperity::LIMIT_OVER_STRENGTH;
use crate::contact::face::{Face, FaceContact};
use crate::geometry::RoundedBody;
use crate::mesh::file::read_mesh;
use crate::mesh::{sphere_hull, sphere_mesh};
use crate::model::STIFFNESS_RATIO;
use crate::specimen::shape::lying_grain;
use crate::tensor::Vec3;

use super::overlap::Placed;
use super::types::*;

/// Dents of a mesh over its volume that are told of.
const DENTED: f64 = 1e-3;
/// Largest sieve size over the diameter that laboratories keep to.
const COARSEST: f64 = 0.2;

/// Moduli and sizes of bodies that differ by more make systems badly conditioned.
const UNLIKE: [f64; 2] = [1e5, 20.0];

/// Share of the mass of a specimen by which a class may have too little below its middle without a word.
const OFF_THE_CURVE: f64 = 0.1;

/// Largest extent of a body that is taken for metres without a word [m]; a grain given in millimetres spans more.
const LARGEST_BODY: f64 = 10.0;

/// How many times what other bodies span the body of a mesh file may without a word; centimetres taken for metres make it a hundred.
const OUTSIZED: f64 = 5.0;

/// Contacts that bear a body of a scene, at the fewest that hold a face level.
const BEARING: f64 = 3.0;

/// Balls of more cells are not meshed to tell how far their meshes lie within them.
const MESHED_FOR_REMARKS: f64 = 2e4;

/// The largest pressure of a case, over what its rock can bear.
#[derive(Debug, Clone, PartialEq)]
pub struct Squeeze {
    /// The body of a scene whose load makes it.
    pub body: Option<String>,
    /// [Pa]
    pub pressure: f64,
    /// Over the mean Young's modulus.
    pub over_modulus: f64,
    /// How far contacts of rigid grains overlap under it, over their two roundings.
    pub over_roundings: f64,
}

impl std::fmt::Display for Squeeze {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Squeeze { body, pressure, over_modulus, over_roundings } = self;
        if let Some(body) = body {
            write!(f, "the load of {body:?} over its size: ")?;
        }
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
        let placed = self.placed(None);
        remarks.extend(self.blended_faces(&placed));
        remarks.extend(self.huge_bodies());
        remarks.extend(self.inscribed_balls());
        let [moduli, sizes] = self.ratios(&placed);
        if moduli >= UNLIKE[0] {
            remarks.push(format!(
                "the moduli of bodies differ by a factor of {moduli:.0e}: the systems to be solved are badly conditioned; every increment \
                 balances to solver.force_tolerance all the same, or is cut"
            ));
        }
        remarks.extend(unlike(sizes));
        remarks.extend(self.sound_corners());
        remarks.extend(self.sound_faces());
        remarks.extend(self.faces_at_corners());
        remarks.extend(self.shortened_increments());
        remarks.extend(self.idle(&placed));
        remarks.extend(self.implausible());
        remarks.extend(self.too_wide_pores());
        remarks
    }

    /// Contacts of a specimen that never crush.
    fn sound_corners(&self) -> Option<String> {
        let is_specimen = matches!(self.geometry, Geometry::Specimen(_));
        let is_sound =
            self.contact.normal == NormalLaw::Asperity && self.limit_pressure_of(&self.rock).is_infinite();
        (is_specimen && is_sound).then(|| {
            format!(
                "contacts crush nowhere: there is no rock.compressive_strength, {LIMIT_OVER_STRENGTH} times which crushes corners, and no \
                 contact.limit_pressure"
            )
        })
    }

    /// Asperities are corners and edges: faces that carry by their area yield by springs.
    fn sound_faces(&self) -> Option<String> {
        let both = (self.contact.normal, self.contact.faces) == (NormalLaw::Asperity, FaceContact::Area);
        both.then(|| {
            "contact.faces \"area\" beside contact.normal \"asperity\": faces yield elastically under any pressure, corners and edges alone crush"
                .into()
        })
    }

    /// Beside asperities a scene's faces carry at their corners unless it says otherwise: a block between walls hardly presses them.
    fn faces_at_corners(&self) -> Option<String> {
        let Geometry::Scene(scene) = &self.geometry else { return None };
        let at_corners =
            (self.contact.normal, self.contact.faces) == (NormalLaw::Asperity, FaceContact::Corners);
        // Plates of a press meet nodes, and balls have no faces.
        let faced = scene.bodies.iter().filter(|body| !matches!(body.shape, ShapeCase::Sphere(_))).count();
        (at_corners && scene.press.is_none() && faced > 1).then(|| {
            "contact.faces \"corners\" beside contact.normal \"asperity\": faces that lie on each other are borne by their corners and edges alone; \
             where flat faces matter, contact.normal \"spring\" with contact.faces \"area\" has them share the load"
                .into()
        })
    }

    /// The bodies of a scene in their places; those of mesh files where `folder` says what they are relative to.
    fn placed(&self, folder: Option<&Path>) -> Vec<Option<Placed>> {
        let Geometry::Scene(scene) = &self.geometry else { return Vec::new() };
        let place = |(index, body): (usize, &BodyCase)| {
            let from_file = |file: &str| read_mesh(&folder?.join(file)).ok()?.convex_hull().ok();
            let made = if let ShapeCase::Grain(sizes) = &body.shape {
                lying_grain(*sizes, self.contact.rounding, self.seed, index as u64).ok()
            } else {
                body.shape.file().and_then(from_file)
            };
            Placed::new(body, made).ok().flatten()
        };
        scene.bodies.iter().enumerate().map(place).collect()
    }

    /// The largest pressure that stages ask for, where it uses up the roundings: of a specimen the largest principal stress that they name; of
    /// a scene the load of a body over its size. A contact of grains of the size d carries about `p d^2` by the spring `0.5 k E d` of two of them,
    /// and can overlap by its two roundings. The bodies of mesh files are left out.
    pub fn squeeze(&self) -> Option<Squeeze> {
        let squeezed = |body: Option<&str>, pressure: f64, modulus: f64, rounding: f64, contacts: f64| {
            let over_modulus = pressure / modulus;
            let over_roundings = over_modulus / (0.5 * STIFFNESS_RATIO * 2.0 * rounding * contacts);
            let body = body.map(str::to_string);
            (over_roundings > 1.0).then_some(Squeeze { body, pressure, over_modulus, over_roundings })
        };
        let scene = match &self.geometry {
            Geometry::Specimen(_) => {
                let modulus = self.rock.youngs_modulus.mean;
                return squeezed(None, self.largest_stress(), modulus, self.contact.rounding, 1.0);
            }
            Geometry::Scene(scene) => scene,
        };
        let loaded = |(body, placed): (&BodyCase, Option<Placed>)| {
            let placed = placed.filter(|_| !body.fixed)?;
            let rock = self.rock_of(body);
            // Balls have no roundings to use up.
            let volume = placed.shape.volume();
            let size = (6.0 * volume / std::f64::consts::PI).cbrt();
            let rounding = body.rounding.unwrap_or(self.contact.rounding * placed.smallest_extent());
            let load = self.largest_load(body, rock.density * volume);
            (size > 0.0)
                .then(|| {
                    let pressure = load / size.powi(2);
                    squeezed(Some(&body.name), pressure, rock.youngs_modulus.mean, rounding / size, BEARING)
                })
                .flatten()
        };
        let all = scene.bodies.iter().zip(self.placed(None)).filter_map(loaded);
        all.max_by(|a, b| a.over_roundings.total_cmp(&b.over_roundings))
    }

    /// The largest principal stress that the stages of a specimen name [Pa].
    fn largest_stress(&self) -> f64 {
        let (mut confining, mut largest) = (0.0_f64, 0.0_f64);
        for stage in &self.stages {
            confining = stage.pressure().filter(|named| *named > 0.0).unwrap_or(confining);
            let deviatoric = match stage {
                StageCase::StressShear { deviatoric_stress, .. } => *deviatoric_stress,
                other => other.strained().and_then(|it| it.until.deviatoric_stress).unwrap_or(0.0),
            };
            largest = largest.max(stage.largest_pressure()).max(confining + deviatoric);
        }
        largest
    }

    /// The largest force, weight included, that stages apply to a body of a scene [N].
    fn largest_load(&self, body: &BodyCase, mass: f64) -> f64 {
        let Geometry::Scene(scene) = &self.geometry else { return 0.0 };
        let (mut gravity, mut force, mut largest) = (Vec3::from(scene.gravity), Vec3::zeros(), 0.0_f64);
        for stage in &self.stages {
            let StageCase::Load { bodies, gravity: own, .. } = stage else { continue };
            gravity = own.map_or(gravity, Vec3::from);
            if let Some(given) = bodies.get(&body.name).and_then(|load| load.force) {
                force = Vec3::from(given.map(|component| component.unwrap_or(0.0)));
            }
            largest = largest.max((force + gravity * mass).norm());
        }
        largest
    }

    /// Where `contact.faces` is "area", the bodies of which a face carries by its corners and edges all the same.
    fn blended_faces(&self, placed: &[Option<Placed>]) -> Vec<String> {
        let Geometry::Scene(scene) = &self.geometry else { return Vec::new() };
        let blended = |(body, placed): (&BodyCase, &Option<Placed>)| {
            let placed = placed.as_ref().filter(|_| scene.press.is_none())?;
            let rounding = body.rounding.unwrap_or(self.contact.rounding * placed.smallest_extent());
            let [all, blended] = Face::count(&RoundedBody::inset(&placed.shape, rounding).ok()?);
            (blended > 0).then(|| {
                format!(
                    "contact.faces \"area\": {blended} of the {all} faces of {:?} meet others at less than 0.1 rad and carry by corners and edges",
                    body.name
                )
            })
        };
        match self.contact.faces {
            FaceContact::Area => scene.bodies.iter().zip(placed).filter_map(blended).collect(),
            FaceContact::Corners => Vec::new(),
        }
    }

    /// Balls that deform touch by the hull of their surface nodes, which lies within them.
    fn inscribed_balls(&self) -> Vec<String> {
        let Geometry::Scene(scene) = &self.geometry else { return Vec::new() };
        let inscribed = |body: &BodyCase| {
            let ShapeCase::Sphere(radius) = body.shape else { return None };
            // In a press its nodes touch, which lie on the ball.
            let is_pressed = scene.press.as_ref().is_some_and(|press| press.body == body.name);
            if self.fidelity_of(body) == Fidelity::Rigid || is_pressed {
                return None;
            }
            let told = format!("{:?} touches by the hull of its surface nodes, put onto the ball", body.name);
            if body.refine.is_some() || self.cells_of(body) > MESHED_FOR_REMARKS {
                return Some(format!("{told} and whose facets lie within it"));
            }
            let hull = sphere_hull(&sphere_mesh(radius, body.cell_size()?, None).ok()?, radius).ok()?;
            let heights = hull.facets.iter().zip(&hull.normals).map(|(f, n)| n.dot(&hull.vertices[f[0]]));
            let deepest = radius - heights.fold(f64::INFINITY, f64::min);
            Some(format!(
                "{told}: its facets lie up to {deepest:.2e} m within it, {:.1} % of its radius, and contacts are late by as much; a smaller \
                 mesh_size, or \"rigid\", is nearer",
                100.0 * deepest / radius
            ))
        };
        scene.bodies.iter().filter_map(inscribed).collect()
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
        if !scene.bodies.iter().any(|body| body.shape.file().is_some()) {
            return Vec::new();
        }
        let mut placed = self.placed(Some(folder));
        let span =
            |it: &Option<Placed>| it.as_ref().map_or(0.0, |it| it.extents().into_iter().fold(0.0, f64::max));
        let spans: Vec<f64> = placed.iter().map(span).collect();
        let large = |(k, body): (usize, &BodyCase)| {
            let file = body.shape.file()?;
            let others = (0..spans.len()).filter(|other| *other != k).map(|other| spans[other]);
            let times = spans[k] / others.fold(0.0, f64::max);
            let outsized = !body.fixed && times.is_finite() && times > OUTSIZED;
            let [x, y, z] = placed[k].as_ref()?.extents();
            let told = format!("{:?} spans {x:.3e} x {y:.3e} x {z:.3e} m", body.name);
            let unit = format!(
                "lengths of {file} are read as metres; if it is in centimetres or millimetres, scale it by 0.01 or 0.001"
            );
            match (spans[k] > LARGEST_BODY, outsized) {
                (true, _) => Some(format!("{told}: {unit}")),
                (false, true) => Some(format!("{told}, {times:.0} times what any other body does: {unit}")),
                (false, false) => None,
            }
        };
        let mut remarks: Vec<String> = scene.bodies.iter().enumerate().filter_map(large).collect();
        remarks.extend(scene.bodies.iter().filter_map(|body| dented(&folder.join(body.shape.file()?))));
        let without = self.ratios(&self.placed(None))[1];
        remarks.extend(unlike(self.ratios(&placed)[1]).filter(|_| without <= UNLIKE[1]));
        for (body, it) in scene.bodies.iter().zip(&mut placed) {
            if body.shape.file().is_none() {
                *it = None;
            }
        }
        remarks.extend(self.blended_faces(&placed));
        remarks
    }

    /// Largest over smallest mean modulus, and size of what is not held.
    fn ratios(&self, placed: &[Option<Placed>]) -> [f64; 2] {
        let ratio = |values: &mut dyn Iterator<Item = f64>| {
            let (low, high) =
                values.fold((f64::INFINITY, 0.0_f64), |(low, high), x| (low.min(x), high.max(x)));
            if low <= high { high / low } else { 1.0 }
        };
        match &self.geometry {
            Geometry::Specimen(specimen) => [1.0, ratio(&mut specimen.grading.iter().map(|point| point[0]))],
            Geometry::Scene(scene) => {
                let modulus = |body: &BodyCase| self.rock_of(body).youngs_modulus.mean;
                let free = scene.bodies.iter().zip(placed).filter(|(body, _)| !body.fixed);
                let mut sizes = free.filter_map(|(body, placed)| {
                    body.shape.smallest_extent().or_else(|| placed.as_ref().map(Placed::smallest_extent))
                });
                [ratio(&mut scene.bodies.iter().map(modulus)), ratio(&mut sizes)]
            }
        }
    }
}

/// A remark on sizes of bodies that differ by so much.
fn unlike(sizes: f64) -> Option<String> {
    (sizes > UNLIKE[1]).then(|| {
        format!(
            "the sizes of bodies differ by a factor of {sizes:.0}: the systems to be solved are badly conditioned; in a \
             scene each body balances by what it carries itself, in a specimen by the mean contact force, not that of the smallest"
        )
    })
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

/// What is said of a mesh with dents, which its convex hull fills.
fn dented(file: &Path) -> Option<String> {
    let mesh = read_mesh(file).ok()?;
    let filled = mesh.convex_hull().ok()?.volume() / mesh.volume() - 1.0;
    (filled > DENTED).then(|| {
        format!(
            "the mesh of {} has dents of {:.1} % of its volume: bodies touch by its convex hull, which fills them",
            file.display(),
            100.0 * filled
        )
    })
}

#[cfg(test)]
mod tests {
    use crate::case::checked;
    use crate::contact::face::FaceContact;

    #[test]
    fn what_decides_nothing_and_what_is_too_coarse_is_said() {
        let text = r#"{"specimen": {"diameter": "0.3 m", "height": "0.6 m", "void_ratio": 0.5, "grading": [[0.06, 1], [0.04, 0]]},
            "rock": {"density": 2180, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2, "compressive_strength": "250 MPa"},
            "contact": {"friction": 0.65}, "stages": [{"kind": "consolidate", "pressure": "0.8 MPa"}]}"#;
        let remarks_of = |text: &str, overrides: &[&str]| {
            checked(text, overrides).unwrap_or_else(|e| panic!("{e}")).remarks().join("; ")
        };
        let remarks = |overrides: &[&str]| remarks_of(text, overrides);
        // A fifth exactly is kept to.
        assert_eq!(remarks(&[]), "");
        assert_eq!(remarks(&["/solver/fidelity=auto", "/solver/accuracy=0.05"]), "");
        assert!(
            remarks(&["/solver/fidelity=rigid", "/solver/accuracy=0.05"]).contains("0.05 decides nothing")
        );
        assert!(remarks(&["/solver/rough_tolerance=0.1"]).contains("no effect"));
        assert!(remarks(&["/solver/full_nodes=unknowns"]).contains("no effect"));
        let [strong, unknown] = [", \"compressive_strength\": \"250 MPa\"", ""];
        assert!(remarks_of(&text.replace(strong, unknown), &[]).contains("contacts crush nowhere"));
        assert_eq!(remarks_of(&text.replace(strong, unknown), &["/contact/limit_pressure=700 MPa"]), "");
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

    /// Asperities are corners and edges; so are faces beside them, unless the case says otherwise. Scenes are told of either.
    #[test]
    fn faces_beside_asperities_are_remarked_on() {
        let checked = |geometry: &str, contact: &str| {
            let text = format!(
                r#"{{{geometry}, "rock": {{"density": 2180, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2}},
                "contact": {{"friction": 0.65{contact}}}}}"#
            );
            let case = checked(&text, &[]).unwrap_or_else(|e| panic!("{e}"));
            (case.contact.faces, case.remarks().join("; "))
        };
        let scene = |shape: &str| {
            format!(
                r#""scene": {{"bodies": [{{"name": "lower", "shape": {{{shape}}}, "fixed": true}},
                {{"name": "upper", "shape": {{{shape}}}, "position": [0, 0, 0.1]}}]}}, "stages": [{{"kind": "load"}}]"#
            )
        };
        let (blocks, balls) = (scene(r#""box": [0.1, 0.1, 0.1]"#), scene(r#""sphere": 0.05"#));
        let specimen = r#""specimen": {"diameter": "0.3 m", "height": "0.6 m", "void_ratio": 0.5, "grading": [[0.06, 1], [0.04, 0]]},
            "stages": [{"kind": "consolidate", "pressure": "0.8 MPa"}]"#;
        let asperity = ", \"normal\": \"asperity\"";
        assert_eq!(checked(&blocks, ""), (FaceContact::Area, String::new()));
        let (faces, remarks) = checked(&blocks, asperity);
        assert_eq!(faces, FaceContact::Corners);
        assert!(remarks.contains("borne by their corners and edges alone"), "{remarks}");
        let (faces, remarks) = checked(&blocks, &format!("{asperity}, \"faces\": \"area\""));
        assert_eq!(faces, FaceContact::Area);
        assert!(remarks.contains("faces yield elastically") && !remarks.contains("alone;"), "{remarks}");
        // Nothing is said of balls, which have no faces, nor of what specimens do by themselves.
        assert_eq!(checked(&balls, asperity), (FaceContact::Corners, String::new()));
        let crushed = ", \"limit_pressure\": \"700 MPa\"";
        assert_eq!(checked(specimen, crushed), (FaceContact::Corners, String::new()));
    }

    #[test]
    fn bodies_unlike_each_other_are_remarked_on() {
        let text = r#"{"scene": {"bodies": [{"name": "base", "shape": {"box": [1, 1, 0.1]}, "position": [0, 0, -0.05], "fixed": true},
                {"name": "ball", "shape": {"sphere": 0.02}, "position": [0, 0, 0.02], "rock": {"youngs_modulus": "30 kPa"}},
                {"name": "block", "shape": {"box": [1, 1, 1]}, "position": [0, 0, 0.54]}]},
            "rock": {"density": 2180, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2},
            "contact": {"friction": 0.65}, "stages": [{"kind": "load"}]}"#;
        let remarks = checked(text, &[]).unwrap_or_else(|e| panic!("{e}")).remarks();
        assert!(remarks.len() == 2 && remarks[0].contains("a factor of 1e6"), "{remarks:?}");
        assert!(remarks[1].contains("a factor of 25"), "{remarks:?}");
        let text = text
            .replace("[1, 1, 1]}, \"position\": [0, 0, 0.54]", "[60, 40, 50]}, \"position\": [0, 0, 25.04]");
        let remarks = checked(&text, &[]).unwrap_or_else(|e| panic!("{e}")).remarks();
        assert!(remarks.iter().any(|remark| remark.contains("\"block\" is 4.000e1 m thick")), "{remarks:?}");
    }
}
