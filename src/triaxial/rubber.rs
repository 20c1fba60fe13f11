//! The rubber membrane of the rig: how it is cut, laid against the grains, and what it cannot do.

use crate::error::Result;
use crate::material::Rubber;
use crate::model::membrane::Fastening;
use crate::model::{BodyKind, Membrane, MembraneParameters};
use crate::solver::{Drape, Increment, drape};
use crate::tensor::Vec3;
use crate::triaxial::rig::Rig;

/// A rubber membrane as the case asks for it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RubberSheet {
    pub rubber: Rubber,
    /// Unstrained [m].
    pub thickness: f64,
    /// Edge length of the triangles [m]; `None`: [`MESH_SIZE`] of the median grain.
    pub mesh_size: Option<f64>,
    /// Largest pressure of the test [Pa].
    pub pressure: f64,
}

/// Edge length of the triangles over the median grain size, where none is given.
const MESH_SIZE: f64 = 0.25;
/// Distance that the membrane keeps from the grains before it is laid against them, over its thickness.
const CLEARANCE: f64 = 0.1;

impl Rig {
    /// Puts a membrane around the grains, clear of them all. It was cut to the specimen's diameter [m]: where
    /// grains stand out of that, it is stretched a little.
    pub(super) fn wrap(&mut self, sheet: &RubberSheet, diameter: f64) -> Result<()> {
        let parameters = MembraneParameters {
            rubber: sheet.rubber,
            thickness: sheet.thickness,
            mesh_size: sheet.mesh_size.unwrap_or(MESH_SIZE * self.median_size()),
            pressure: sheet.pressure,
        };
        let mut reach: f64 = 0.0;
        for (body, pose) in self.model.bodies.iter().zip(&self.committed.poses) {
            if body.kind == BodyKind::Grain {
                let distances = body.nominal.vertices.iter().map(|v| pose.to_space(v).xy().norm());
                reach = distances.fold(reach, f64::max);
            }
        }
        let fastening = |plate: usize, sign: f64| {
            let half = self.model.bodies[plate].nominal.vertices.iter().map(|v| v.z).fold(0.0, f64::max);
            let pose = self.committed.poses[plate];
            Fastening { body: plate, pose, height: pose.position.z + sign * half }
        };
        let fastenings = [fastening(self.bottom, 1.0), fastening(self.top, -1.0)];
        // The chords of a polygon come closer to the axis than its corners.
        let radius = reach + (0.5 + CLEARANCE) * sheet.thickness;
        let chords = (0.5 * parameters.mesh_size / radius).powi(2);
        let radius = radius.max(0.5 * diameter) * (1.0 + chords);
        let (membrane, cover, nodes) = Membrane::new(
            &parameters,
            0.5 * diameter,
            radius,
            &fastenings,
            self.model.bodies.len(),
            &self.model.law,
        )?;
        self.committed.poses.extend(nodes);
        self.model.membrane = Some(membrane);
        self.model.cover = Some(cover);
        Ok(())
    }

    /// Lays the membrane against the grains, which are held, under `pressure` [Pa]; `None` without a membrane.
    /// The nodes are committed as they come to lie.
    pub fn lay_membrane(&mut self, pressure: f64) -> Option<Drape> {
        let mut loads = self.loads(false, pressure);
        for held in &mut loads.prescribed[..self.model.bodies.len()] {
            *held = [true; 6];
        }
        let increment = Increment {
            model: &self.model,
            committed: &self.committed,
            loads: &loads,
            settings: &self.settings,
        };
        let laid = drape(&increment, &mut self.contacts)?;
        self.committed.poses.clone_from(&laid.poses);
        Some(laid)
    }

    /// Why a membrane gives way where it does, with the numbers, and the ways out.
    pub fn membrane_trouble(&self, pressure: f64) -> String {
        let Some(membrane) = &self.model.membrane else { return String::new() };
        let contacts = &self.contacts.membrane;
        let (node, span) = contacts.widest_span(membrane);
        let at = contacts.positions.get(node).copied().unwrap_or_else(Vec3::zeros);
        let stretch = membrane.measures(&contacts.positions).largest_stretch;
        let MembraneParameters { rubber, thickness, .. } = membrane.parameters;
        let holds = rubber.balloon_limit(thickness, span);
        let bridges = rubber.balloon_limit(thickness, 1.0) / pressure;
        let mut text = format!(
            "its widest opening, at ({:.1}, {:.1}, {:.1}) mm, has a radius of about {:.1} mm; the largest stretch \
             is {stretch:.2}",
            1e3 * at.x,
            1e3 * at.y,
            1e3 * at.z,
            1e3 * span
        );
        if holds < pressure {
            text += &format!(
                ". The membrane cannot bridge that: {:.1} mm of rubber with G = {:.2} MPa hold {:.3} MPa there (limit \
                 pressure 1.24 G t/R for neo-Hooke) and {:.2} MPa press; they bridge openings up to a radius of {:.1} \
                 mm. Ways out: a thicker or stiffer membrane, a law that stiffens (\"gent\"), less pressure, smaller \
                 grains, or a membrane of kind \"pressure\"",
                1e3 * thickness,
                1e-6 * rubber.shear_modulus(),
                1e-6 * holds,
                1e-6 * pressure,
                1e3 * bridges
            );
        }
        text
    }
}
