//! `/contacts/<state>`: every contact point of a saved state.

use serde::{Deserialize, Serialize};

use crate::assembly::Contacts;
use crate::contact::Memory;
use crate::results::Column;
use crate::scene::Pressing;
use crate::tensor::Vec3;

/// The contact points of an accepted configuration.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct ContactTable {
    bodies: [Vec<i64>; 2],
    points: Vec<[f64; 3]>,
    normals: Vec<[f64; 3]>,
    forces: Vec<[f64; 3]>,
    normal_forces: Vec<f64>,
    friction_forces: Vec<[f64; 3]>,
    gaps: Vec<f64>,
    slips: Vec<f64>,
    mobilised: Vec<f64>,
}

impl ContactTable {
    /// `memory` is what the accepted increment left; the two bodies behind the first `grains` are plates.
    pub fn of(contacts: &Contacts, memory: &Memory, grains: usize) -> Self {
        let mut table = ContactTable::default();
        let number = |body: usize| match body {
            plate if (grains..grains + 2).contains(&plate) => grains as i64 - 1 - plate as i64,
            grain_or_part => grain_or_part as i64,
        };
        for (pair, point) in contacts.active() {
            let e = &point.evaluation;
            let bound = e.coefficient * e.pressure;
            table.bodies[0].push(number(pair.a()));
            table.bodies[1].push(number(pair.b()));
            table.points.push(e.point.into());
            table.normals.push(e.normal.into());
            table.forces.push(Vec3::new(e.wrench[6], e.wrench[7], e.wrench[8]).into());
            table.normal_forces.push(e.pressure);
            table.friction_forces.push(e.friction.into());
            table.gaps.push(e.gap);
            table.slips.push(memory.get(&pair.key()).map_or(0.0, |kept| kept.slip));
            table.mobilised.push(if bound > 0.0 { e.friction.norm() / bound } else { 0.0 });
        }
        table
    }

    /// The nodes that the plates of a press meet: from the plate to the node's body.
    pub fn of_press(pressing: &Pressing) -> Self {
        let mut table = ContactTable::default();
        let plates = pressing.plates();
        for (body, push) in pressing.pushes() {
            let normal = Vec3::new(0.0, 0.0, if push.upper { -1.0 } else { 1.0 });
            let pressure = push.force.dot(&normal);
            table.bodies[0].push(plates[usize::from(push.upper)] as i64);
            table.bodies[1].push(*body as i64);
            table.points.push(push.at.into());
            table.normals.push(normal.into());
            table.forces.push(push.force.into());
            table.normal_forces.push(pressure);
            table.friction_forces.push((push.force - normal * pressure).into());
            table.gaps.push(0.0);
            table.slips.push(0.0);
            // No friction law: a node sticks or is free.
            table.mobilised.push(f64::NAN);
        }
        table
    }

    pub fn columns(self) -> Vec<Column> {
        let [first, second] = self.bodies;
        let body = "number of the grain, of a part as fragment in /VTKHDF, or of a scene's body; -1 is the bottom plate, -2 the top plate";
        vec![
            Column::integers("body_a", body, first),
            Column::integers("body_b", body, second),
            Column::vectors("point", "m", "where the contact force acts", self.points),
            Column::vectors("normal", "1", "contact normal from body a to body b", self.normals),
            Column::vectors("force", "N", "contact force on body b, friction included", self.forces),
            Column::floats(
                "normal_force",
                "N",
                "normal contact force, compression positive",
                self.normal_forces,
            ),
            Column::vectors("friction_force", "N", "friction force on body b", self.friction_forces),
            Column::floats(
                "gap",
                "m",
                "distance of the rounded surfaces: negative by what is pressed in, or crushed",
                self.gaps,
            ),
            Column::floats("slip", "m", "slip of the pair since it touched", self.slips),
            Column::floats(
                "mobilised",
                "1",
                "friction force over its bound, 1 where it slides",
                self.mobilised,
            ),
        ]
    }
}
