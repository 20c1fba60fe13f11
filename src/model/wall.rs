//! The `rigid_wall` cover: a rigid, frictionless circular cylinder around the grains, between the plates, whose radius
//! is an unknown of its own.
//!
//! The pressure p of the cell fluid acts on the cylinder and its ends and has the potential `p V` with the enclosed
//! volume `V = pi R^2 H`. So the radius R is in balance where the mean of the wall's pressure on the grains is p, with no
//! loop around the solve; the work over any path is `-p (V1 - V0)`, and loads and tangent are exact derivatives.
//!
//! A grain touches the inside of a cylinder with its corners alone: the core is convex, and so is the distance
//! from the axis, which is therefore largest at a vertex. Each core vertex is one contact, with
//! the overlap `d + r - R` of its distance d from the axis and its rounding r, and an energy of it.
//!
//! The wall is a carrier behind the bodies: the x of its pose is R, and nothing else of it moves. The plates do not turn.
//! Units: m, N, Pa, J. p > 0 presses inwards. The axis is z.

use std::f64::consts::PI;

use crate::contact::ContactLaw;
use crate::tensor::{Mat3, Pose, Rotation, Vec3, Vector6};

/// A rigid cylinder around the bodies between two plates.
#[derive(Debug, Clone, PartialEq)]
pub struct RigidWall {
    /// Index of the wall's pose in the list of poses.
    pub carrier: usize,
    /// Bottom and top plate.
    plates: [usize; 2],
    /// Of the plates' inner faces above their positions [m].
    faces: [f64; 2],
}

/// A core vertex against the inside of the wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WallContact {
    pub body: usize,
    /// The core vertex [m].
    pub vertex: Vec3,
    /// From the axis to the vertex; unit.
    pub outwards: Vec3,
    /// Where the rounded corner touches the wall [m].
    pub point: Vec3,
    /// [m]
    pub overlap: f64,
    /// Force of the wall on the body, inwards [N].
    pub pressure: f64,
    /// Derivative of that by the overlap [N/m].
    pub slope: f64,
    /// [J]
    pub energy: f64,
}

impl RigidWall {
    /// A wall of radius `radius` [m] whose pose stands at `carrier`, between the faces of two plates; returns its
    /// pose too.
    pub fn new(carrier: usize, plates: [usize; 2], faces: [f64; 2], radius: f64) -> (Self, Pose) {
        let pose = Pose::new(Vec3::new(radius, 0.0, 0.0), Rotation::identity());
        (RigidWall { carrier, plates, faces }, pose)
    }

    pub fn radius(&self, poses: &[Pose]) -> f64 {
        poses[self.carrier].position.x
    }

    /// Distance of the plates' faces [m].
    pub fn height(&self, poses: &[Pose]) -> f64 {
        let [bottom, top] = [0, 1].map(|k| poses[self.plates[k]].position.z + self.faces[k]);
        top - bottom
    }

    /// Enclosed volume [m^3].
    pub fn volume(&self, poses: &[Pose]) -> f64 {
        PI * self.radius(poses).powi(2) * self.height(poses)
    }

    /// Adds the loads of `pressure` [Pa]: on the wall's radius, and on the plates along z.
    pub fn loads_into(&self, loads: &mut [Vector6<f64>], poses: &[Pose], pressure: f64) {
        let (r, h) = (self.radius(poses), self.height(poses));
        let end = PI * r * r * pressure;
        loads[self.carrier][0] -= 2.0 * PI * r * h * pressure;
        loads[self.plates[0]][2] += end;
        loads[self.plates[1]][2] -= end;
    }

    /// Carriers that the pressure couples.
    pub fn coupled(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.plates.iter().map(|&plate| (plate, self.carrier))
    }

    /// Calls `block(i, j, row, column, k)` for each entry of the derivative of [`Self::loads_into`]: component `row` on
    /// carrier i by component `column` of carrier j.
    pub fn for_each_tangent_entry(
        &self,
        poses: &[Pose],
        pressure: f64,
        mut entry: impl FnMut(usize, usize, usize, usize, f64),
    ) {
        let (r, h) = (self.radius(poses), self.height(poses));
        let side = 2.0 * PI * pressure;
        entry(self.carrier, self.carrier, 0, 0, -side * h);
        for (&plate, sign) in self.plates.iter().zip([1.0, -1.0]) {
            entry(plate, self.carrier, 2, 0, sign * side * r);
            entry(self.carrier, plate, 0, 2, sign * side * r);
        }
    }

    /// Core vertices of one body [m] that press against the wall, appended to `found`. `rounding` [m] is the body's,
    /// `stiffness` [N/m] that of its contact with something rigid.
    pub fn touch_into(
        &self,
        found: &mut Vec<WallContact>,
        poses: &[Pose],
        (body, vertices): (usize, &[Vec3]),
        (rounding, stiffness): (f64, f64),
        law: &ContactLaw,
    ) {
        let radius = self.radius(poses);
        for vertex in vertices {
            let across = Vec3::new(vertex.x, vertex.y, 0.0);
            let distance = across.norm();
            let overlap = distance + rounding - radius;
            if overlap <= 0.0 || distance <= 0.0 {
                continue;
            }
            let outwards = across / distance;
            found.push(WallContact {
                body,
                vertex: *vertex,
                outwards,
                point: vertex + outwards * rounding,
                overlap,
                pressure: stiffness * law.normal(overlap),
                slope: stiffness * (overlap / law.onset).min(1.0),
                energy: stiffness * law.energy(overlap),
            });
        }
    }
}

impl WallContact {
    /// Force on the body [N].
    pub fn on_body(&self) -> Vec3 {
        -self.outwards * self.pressure
    }

    /// Force [N] and moment about `position` [N m] on the body.
    pub fn wrench(&self, position: &Vec3) -> Vector6<f64> {
        let force = self.on_body();
        let moment = (self.vertex - position).cross(&force);
        Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z)
    }

    /// Derivative of [`Self::wrench`] by the motion of the body (translation, then rotation vector about `position`),
    /// and by the wall's radius. The force on the radius is the pressure, and by reciprocity its
    /// derivative by the motion is that of the wrench by the radius.
    pub fn tangent(&self, position: &Vec3) -> ([[f64; 6]; 6], [f64; 6]) {
        let arm = self.vertex - position;
        let force = self.on_body();
        let outwards = self.outwards;
        let distance = Vec3::new(self.vertex.x, self.vertex.y, 0.0).norm();
        let across = Mat3::from_diagonal(&Vec3::new(1.0, 1.0, 0.0)) - outwards * outwards.transpose();
        let by_vertex = -outwards * outwards.transpose() * self.slope - across * (self.pressure / distance);
        let spin = -arm.cross_matrix();
        let turning = arm.cross_matrix();
        let mut motion = [[0.0; 6]; 6];
        let parts = [
            (0, 0, by_vertex),
            (0, 3, by_vertex * spin),
            (3, 0, turning * by_vertex),
            // The arm turns with the body: (w x a) x f = (a f^T - (a.f) I) w.
            (
                3,
                3,
                turning * by_vertex * spin + arm * force.transpose()
                    - Mat3::from_diagonal_element(arm.dot(&force)),
            ),
        ];
        for (row, column, part) in parts {
            for i in 0..3 {
                for j in 0..3 {
                    motion[row + i][column + j] = part[(i, j)];
                }
            }
        }
        let push = outwards * self.slope;
        let turn = arm.cross(&push);
        (motion, [push.x, push.y, push.z, turn.x, turn.y, turn.z])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAW: ContactLaw = ContactLaw { fade_length: 2e-3, parallel_limit: 0.5, ..ContactLaw::SAMPLE };

    fn poses(radius: f64) -> Vec<Pose> {
        let at = |z: f64| Pose::new(Vec3::new(0.0, 0.0, z), Rotation::identity());
        vec![at(-0.01), at(0.21), Pose::new(Vec3::new(radius, 0.0, 0.0), Rotation::identity())]
    }

    fn wall() -> RigidWall {
        RigidWall::new(2, [0, 1], [0.01, -0.01], 0.05).0
    }

    #[test]
    fn load_is_derivative_of_volume_and_tangent_of_load() {
        let (wall, poses, p, h) = (wall(), poses(0.05), 2e5, 1e-6);
        let loads = |poses: &[Pose]| {
            let mut loads = vec![Vector6::zeros(); 3];
            wall.loads_into(&mut loads, poses, p);
            loads
        };
        assert!((wall.height(&poses) - 0.2).abs() < 1e-15);
        let mut entries = [[0.0; 3]; 3];
        let component = [2, 2, 0];
        wall.for_each_tangent_entry(&poses, p, |i, j, row, column, k| {
            assert_eq!([row, column], [component[i], component[j]]);
            entries[i][j] += k;
        });
        for j in 0..3 {
            let moved = |step: f64| {
                let mut poses = poses.clone();
                poses[j].position[component[j]] += step;
                poses
            };
            let (plus, minus) = (moved(h), moved(-h));
            let work = -p * (wall.volume(&plus) - wall.volume(&minus)) / (2.0 * h);
            assert!((work / loads(&poses)[j][component[j]] - 1.0).abs() < 1e-8, "{j}");
            for i in 0..3 {
                let slope = (loads(&plus)[i][component[i]] - loads(&minus)[i][component[i]]) / (2.0 * h);
                assert!(
                    (slope - entries[i][j]).abs() < 1e-4 * p * 0.05,
                    "{i} {j}: {slope} {}",
                    entries[i][j]
                );
            }
        }
    }

    /// Of a corner at the wall, turned and moved about its body's position, and of the radius.
    #[test]
    fn force_is_derivative_of_energy_and_tangent_of_force() {
        let wall = wall();
        let local = Vec3::new(0.012, 0.004, -0.01);
        let body =
            Pose::new(Vec3::new(0.0345, 0.008, 0.1), Rotation::from_scaled_axis(Vec3::new(0.1, 0.2, 0.3)));
        let rounding = 1e-3;
        let reach = body.to_space(&local).xy().norm() + rounding;
        let at = |body: &Pose, shrink: f64| {
            let mut found = Vec::new();
            let poses = poses(reach - 1e-5 - shrink);
            wall.touch_into(&mut found, &poses, (3, &[body.to_space(&local)]), (rounding, 4e7), &LAW);
            found[0]
        };
        let contact = at(&body, 0.0);
        assert!(
            (contact.overlap - 1e-5).abs() < 1e-12 && contact.point.xy().norm() > contact.vertex.xy().norm()
        );
        let wrench = contact.wrench(&body.position);
        let (motion, by_radius) = contact.tangent(&body.position);
        for k in 0..7 {
            let h = if k < 3 || k == 6 { 1e-8 } else { 1e-6 };
            let step = |sign: f64| {
                let (mut shift, mut spin) = (Vec3::zeros(), Vec3::zeros());
                match k {
                    0..3 => shift[k] = sign * h,
                    3..6 => spin[k - 3] = sign * h,
                    _ => return (at(&body, -sign * h), body),
                }
                let moved = body.moved(&shift, &spin);
                (at(&moved, 0.0), moved)
            };
            let ((plus, place), (minus, other)) = (step(1.0), step(-1.0));
            let work = -(plus.energy - minus.energy) / (2.0 * h);
            let force = if k < 6 { wrench[k] } else { contact.pressure };
            assert!((work - force).abs() < 1e-5 * contact.pressure, "{k}: {work} {force}");
            let (plus, minus) = (plus.wrench(&place.position), minus.wrench(&other.position));
            for i in 0..6 {
                let slope = (plus[i] - minus[i]) / (2.0 * h);
                let expected = if k < 6 { motion[i][k] } else { by_radius[i] };
                assert!(
                    (slope - expected).abs() < 1e-3 * contact.slope * 0.02,
                    "{i} {k}: {slope} {expected}"
                );
            }
        }
    }
}
