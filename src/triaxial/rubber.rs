//! The rubber membrane of the rig: how it is cut, laid against the grains, and what it cannot do.

use crate::error::Result;
use crate::model::membrane::Fastening;
use crate::model::{BodyKind, Membrane, MembraneParameters};
use crate::solver::{Drape, Increment, drape};
use crate::triaxial::rig::Rig;
use crate::triaxial::sheet::RubberSheet;

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
        let before = self.volume(&self.committed.poses);
        self.committed.poses.clone_from(&laid.poses);
        self.nominal_ratio *= before / self.volume(&self.committed.poses);
        Some(laid)
    }

    /// Why a membrane gives way where it does, with the numbers, and the ways out.
    pub fn membrane_trouble(&self, pressure: f64) -> String {
        let Some(membrane) = &self.model.membrane else { return String::new() };
        let contacts = &self.contacts.membrane;
        let (node, seen) = contacts.widest_span(membrane);
        let stretch = membrane.measures(&contacts.positions).largest_stretch;
        let MembraneParameters { rubber, thickness, mesh_size, .. } = membrane.parameters;
        // Openings between nodes that all rest on something are not seen: half an edge is as fine as it gets.
        let span = seen.max(0.5 * mesh_size);
        let holds = rubber.balloon_limit(thickness, span);
        let bridges = rubber.balloon_limit(thickness, 1.0) / pressure;
        let mut text = match contacts.positions.get(node).filter(|_| seen > 0.0) {
            Some(at) => format!(
                "its widest opening, at ({:.1}, {:.1}, {:.1}) mm, has a radius of about {:.1} mm",
                1e3 * at.x,
                1e3 * at.y,
                1e3 * at.z,
                1e3 * span
            ),
            None => format!("its openings are finer than its mesh, {:.1} mm in radius", 1e3 * span),
        };
        text += &format!("; the largest stretch is {stretch:.2}");
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::Contacts;
    use crate::contact::ContactLaw;
    use crate::contact::law::Friction;
    use crate::material::Rubber;
    use crate::material::RubberLaw;
    use crate::model::{Body, Committed, Model};
    use crate::solver::Settings;
    use crate::tensor::{Pose, Rotation, Vec3};
    use crate::triaxial::network::membrane_forces;
    use crate::triaxial::rig::Rims;

    const ROUNDING: f64 = 1e-3;
    const HEIGHT: f64 = 0.06;
    const SIDE: f64 = 0.05;

    /// A square prism that leaves an opening of `gap` [m] below the top plate.
    fn prism_between_plates(gap: f64) -> Rig {
        let block = |name: &str, kind: BodyKind, size: [f64; 3], z: f64| {
            let (mut body, shape) = Body::block(name, kind, size, ROUNDING, 0.02);
            if kind == BodyKind::Plate {
                body.stiffness = f64::INFINITY;
            }
            (body, shape, Pose::new(Vec3::new(0.0, 0.0, z), Rotation::identity()))
        };
        let tall = HEIGHT - gap;
        let parts = [
            block("prism", BodyKind::Grain, [SIDE, SIDE, tall], 0.5 * tall),
            block("bottom plate", BodyKind::Plate, [0.3, 0.3, 0.02], -0.01),
            block("top plate", BodyKind::Plate, [0.3, 0.3, 0.02], HEIGHT + 0.01),
        ];
        let law = ContactLaw { onset: 4e-6, fade_length: ROUNDING, ..ContactLaw::SAMPLE };
        let (mut bodies, mut shapes, mut poses) = (vec![], vec![], vec![]);
        for (body, shape, pose) in parts {
            bodies.push(body);
            shapes.push(shape);
            poses.push(pose);
        }
        Rig {
            model: Model::new(bodies, shapes, law, Friction::constant(0.5)),
            committed: Committed::new(poses),
            contacts: Contacts::default(),
            settings: Settings::default(),
            bottom: 1,
            top: 2,
            solid_volume: SIDE * SIDE * tall,
            pressure: 0.0,
            nominal_ratio: 1.0,
            tilting: false,
            rims: Rims::Bonded,
            failing: Default::default(),
            dossier: None,
        }
    }

    fn laid(gap: f64, shear_modulus: f64, pressure: f64) -> (Rig, Drape) {
        let mut rig = prism_between_plates(gap);
        let rubber = Rubber::new(shear_modulus, RubberLaw::NeoHookean).expect("allowed");
        let sheet = RubberSheet { rubber, thickness: 2e-3, mesh_size: Some(7e-3), pressure };
        rig.wrap(&sheet, 1.2 * SIDE).expect("a membrane");
        let laid = rig.lay_membrane(pressure).expect("clear of the prism");
        (rig, laid)
    }

    /// A strip open by 15 mm. A thin membrane under 0.8 MPa says what it cannot do;
    /// a stiff one spans the opening and rests on the prism.
    #[test]
    fn membrane_over_an_opening_holds_or_says_that_it_cannot() {
        let (rig, soft) = laid(0.015, 0.45e6, 0.8e6);
        assert!(!soft.converged, "{soft:?}");
        let text = rig.membrane_trouble(0.8e6);
        for part in
            ["cannot bridge", "G = 0.45 MPa", "0.80 MPa press", "up to a radius of 1.4 mm", "Ways out"]
        {
            assert!(text.contains(part), "{part}: {text}");
        }
        let (rig, stiff) = laid(0.015, 45e6, 0.8e6);
        assert!(stiff.converged, "{} at {}", stiff.out_of_balance, stiff.worst);
        let membrane = rig.model.membrane.as_ref().expect("there");
        let measures = membrane.measures(&rig.contacts.membrane.positions);
        assert!(measures.largest_stretch < 1.5 && rig.contacts.membrane.energy() > 0.0, "{measures:?}");
        assert!(!rig.membrane_trouble(0.8e6).contains("cannot"));
    }

    /// What the membrane and the pressure exert on a held body is in balance with what they exert on the
    /// plates: the rubber itself is weightless.
    #[test]
    fn laid_membrane_hands_on_what_presses_on_it() {
        let (rig, stiff) = laid(0.002, 2e6, 0.2e6);
        assert!(stiff.converged);
        let (model, poses) = (&rig.model, &rig.committed.poses);
        let mut wrenches = vec![crate::tensor::Vector6::zeros(); model.carriers()];
        model.cover.as_ref().expect("there").loads_into(&mut wrenches, poses, 0.2e6);
        let membrane = model.membrane.as_ref().expect("there");
        crate::assembly::membrane_forces_into(&mut wrenches, membrane, &rig.contacts, poses);
        let on_bodies: crate::tensor::Vector6<f64> = wrenches[..3].iter().sum();
        let plate = wrenches[2].fixed_rows::<3>(0).norm();
        // Nodes are balanced to 1e-3 of their load, some 400 of them: far below the force on a plate.
        assert!(on_bodies.fixed_rows::<3>(0).norm() < 1e-2 * plate, "{on_bodies:?}");
    }
    /// What confines the prism, from contact forces: the pressure on the enclosed volume V and the tension of
    /// the sheet. Forces in balance on the membrane make `sum x f = -2 p V - dE/dk` over the horizontal axes
    /// for its energy E at horizontal stretch k about the axis (virtual work), less half the
    /// thickness for which contacts lie within the middle surface.
    #[test]
    fn contact_stress_under_a_membrane_is_pressure_and_tension() {
        let pressure = 0.2e6;
        let (rig, stiff) = laid(0.002, 2e6, pressure);
        assert!(stiff.converged);
        let (model, poses) = (&rig.model, &rig.committed.poses);
        let membrane = model.membrane.as_ref().expect("there");
        let forces = membrane_forces(model, membrane, &rig.contacts, poses, pressure);
        let sum: f64 = forces.iter().map(|f| f.point.xy().dot(&f.force.xy())).sum();
        let stretched = |k: f64| {
            let x = rig.contacts.membrane.positions.iter().map(|x| Vec3::new(k * x.x, k * x.y, x.z));
            membrane.energy(&x.collect::<Vec<_>>())
        };
        let slope = (stretched(1.0 + 1e-5) - stretched(1.0 - 1e-5)) / 2e-5;
        let within: f64 = rig
            .contacts
            .membrane
            .points()
            .map(|(_, point)| membrane.rounding() * point.on_body().xy().norm())
            .sum();
        let volume = model.cover.as_ref().expect("there").volume(poses);
        let expected = -2.0 * pressure * volume - slope + within;
        assert!(slope > 0.05 * pressure * volume, "{slope}");
        // Nodes are balanced to 1e-3 of their load; their errors do not add up.
        assert!((sum / expected - 1.0).abs() < 3e-3, "{sum} {expected} {slope} {within}");
    }
}
