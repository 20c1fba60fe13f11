//! How many grains fill how large a specimen, before any is generated.

use crate::specimen::SievePoint;
use crate::specimen::SpecimenSize;
use crate::specimen::grading::{SizeClass, mean_volumes, size_classes};
use crate::specimen::shape::{ShapeLaw, WithinClass};
use crate::specimen::size::{Plan, plan};

/// The grains of a grading and a shape law, on average.
#[derive(Debug, Clone, PartialEq)]
pub struct MeanGrains {
    classes: Vec<SizeClass>,
    /// [m3] per class.
    volumes: Vec<f64>,
}

impl MeanGrains {
    /// # Errors
    /// What the specimen generator refuses: a grading that is none, vertices that don't fit.
    pub fn new(
        grading: &[[f64; 2]],
        within_class: WithinClass,
        vertices: [usize; 2],
        vertex_separation: f64,
    ) -> Result<Self, String> {
        let curve: Vec<_> = grading.iter().map(|&[size, passing]| SievePoint { size, passing }).collect();
        // The rounding has no say in the nominal volume.
        let law = ShapeLaw { vertices, vertex_separation, rounding: 0.0, within_class };
        let classes = size_classes(&curve).map_err(|e| e.to_string())?;
        let volumes = mean_volumes(&classes, &law).map_err(|e| e.to_string())?;
        Ok(MeanGrains { classes, volumes })
    }

    /// Expected diameter, height and numbers of grains.
    pub fn plan(&self, size: SpecimenSize, void_ratio: f64) -> Plan {
        plan(&self.classes, &self.volumes, &size, void_ratio)
    }

    /// The number of grains that a diameter and height [m] with this void ratio hold.
    pub fn number(&self, diameter: f64, height: f64, void_ratio: f64) -> usize {
        self.plan(SpecimenSize::Cylinder { diameter, height }, void_ratio).numbers.iter().sum()
    }
}
