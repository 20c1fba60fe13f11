//! From the completed JSON value to the checked types and back.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::specimen::{SpecimenSize, Unreachable, WithinClass};

use super::size::MeanGrains;
use super::types::*;

/// The top level of the case file after completion: SI, defaults filled in.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    title: String,
    seed: u64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    start_from: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    specimen: Option<Specimen>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    scene: Option<SceneCase>,
    rock: RockCase,
    contact: ContactCase,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    plates: Option<PlatesCase>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    membrane: Option<MembraneCase>,
    stages: Vec<StageCase>,
    solver: SolverCase,
    output: OutputCase,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Specimen {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    diameter: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    height: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    grains: Option<usize>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    aspect: Option<f64>,
    grading: Vec<[f64; 2]>,
    within_class: WithinClass,
    void_ratio: f64,
    vertices: [usize; 2],
    vertex_separation: f64,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    shapes: Vec<Vec<[f64; 3]>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    packing: Option<PackingCase>,
    unreachable: Unreachable,
    cells_per_grain: usize,
}

/// The case of a completed value, a specimen with its mean grains; otherwise why the table and the
/// types disagree.
pub fn to_case(value: Value, grains: Option<&MeanGrains>) -> Result<Case, String> {
    let document: Document = serde_json::from_value(value).map_err(|e| e.to_string())?;
    let geometry = match (document.specimen, document.scene) {
        (Some(specimen), None) => Geometry::Specimen(specimen.to_case(grains.ok_or("no grains")?)?),
        (None, Some(scene)) => Geometry::Scene(scene),
        _ => return Err("neither specimen nor scene".into()),
    };
    Ok(Case {
        title: document.title,
        seed: document.seed,
        start_from: document.start_from,
        geometry,
        rock: document.rock,
        contact: document.contact,
        plates: document
            .plates
            .unwrap_or(PlatesCase { friction: document.contact.friction, tilting: Tilting::Locked }),
        membrane: document.membrane.unwrap_or(MembraneCase::Pressure { rims: None }),
        stages: document.stages,
        solver: document.solver,
        output: document.output,
        notes: Vec::new(),
        brought: Vec::new(),
    })
}

impl Specimen {
    fn to_case(&self, grains: &MeanGrains) -> Result<SpecimenCase, String> {
        let size = match (self.diameter, self.height, self.grains, self.aspect) {
            (Some(diameter), Some(height), ..) => SpecimenSize::Cylinder { diameter, height },
            (_, _, Some(count), Some(aspect)) => SpecimenSize::Grains { count, aspect },
            _ => return Err("the specimen has no size".into()),
        };
        let plan = grains.plan(size, self.void_ratio);
        Ok(SpecimenCase {
            size,
            diameter: plan.diameter,
            height: plan.height,
            grains: plan.numbers.iter().sum(),
            grading: self.grading.clone(),
            within_class: self.within_class,
            void_ratio: self.void_ratio,
            vertices: self.vertices,
            vertex_separation: self.vertex_separation,
            shapes: self.shapes.clone(),
            packing: self.packing.clone(),
            unreachable: self.unreachable,
            cells_per_grain: self.cells_per_grain,
        })
    }

    fn of(case: &SpecimenCase) -> Specimen {
        let (diameter, height, grains, aspect) = match case.size {
            SpecimenSize::Cylinder { diameter, height } => (Some(diameter), Some(height), None, None),
            SpecimenSize::Grains { count, aspect } => (None, None, Some(count), Some(aspect)),
        };
        Specimen {
            diameter,
            height,
            grains,
            aspect,
            grading: case.grading.clone(),
            within_class: case.within_class,
            void_ratio: case.void_ratio,
            vertices: case.vertices,
            vertex_separation: case.vertex_separation,
            shapes: case.shapes.clone(),
            packing: case.packing.clone(),
            unreachable: case.unreachable,
            cells_per_grain: case.cells_per_grain,
        }
    }
}

impl Case {
    /// Every value in force, in SI, as a case file that reads back as an equal case.
    pub fn completed(&self) -> Value {
        let (specimen, scene) = match &self.geometry {
            Geometry::Specimen(specimen) => (Some(Specimen::of(specimen)), None),
            Geometry::Scene(scene) => (None, Some(scene.clone())),
        };
        let of_specimen = specimen.is_some();
        let document = Document {
            title: self.title.clone(),
            seed: self.seed,
            start_from: self.start_from.clone(),
            specimen,
            scene,
            rock: self.rock.clone(),
            contact: self.contact,
            plates: of_specimen.then_some(self.plates),
            membrane: of_specimen.then_some(self.membrane),
            stages: self.stages.clone(),
            solver: self.solver,
            output: self.output,
        };
        // Maps with text keys and finite numbers: serialisation has nothing to fail on.
        serde_json::to_value(document).unwrap_or_default()
    }
}
