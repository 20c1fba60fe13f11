//! The contact network of an accepted configuration: the stress that it carries, its fabric, how
//! many contacts grains have and how forces are spread over them.
//!
//! Sources: mean stress from contact forces, Love (1927) and Weber (1966); fabric tensor, Satake
//! (1982); mechanical coordination number, Thornton (2000, Geotechnique 50:43). A pair of bodies counts
//! as one contact, whatever the number of its contact points; its normal is the mean of theirs,
//! weighted by normal force. Stress counts compression positive.

use crate::assembly::membrane::MembranePoint;
use crate::assembly::{Contacts, MembraneContacts};
use crate::model::wall::WallContact;
use crate::model::{BodyKind, Membrane, Model};
use crate::tensor::{Mat3, Pose, Vec3};

/// A contact force between two bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairForce {
    pub bodies: [usize; 2],
    /// Unit, from the first body to the second.
    pub normal: Vec3,
    /// On the second body [N].
    pub force: Vec3,
    /// Sum over the pair's points of point times force on the second body [N m].
    pub moment: Mat3,
}

/// A force from outside on a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutsideForce {
    pub body: usize,
    /// [m]
    pub point: Vec3,
    /// [N]
    pub force: Vec3,
}

impl OutsideForce {
    /// Of a rigid wall on a body.
    pub fn of_wall(contact: &WallContact) -> Self {
        OutsideForce { body: contact.body, point: contact.point, force: contact.on_body() }
    }
}

/// Numbers about the network.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Network {
    /// Contacts per grain, plates included.
    pub coordination_number: f64,
    /// The same over the grains with at least two contacts.
    pub mechanical_coordination_number: f64,
    /// Grains with fewer than two contacts.
    pub rattlers: usize,
    /// Mean of `n n^T` over the contacts between grains.
    pub fabric: Mat3,
    /// Mean, largest, and standard deviation over mean, of the contact forces between grains [N].
    pub force_mean: f64,
    pub force_max: f64,
    pub force_variation: f64,
    /// Share of the contacts between grains that carry more than the mean force.
    pub strong_fraction: f64,
}

/// The touching pairs of the configuration in which `contacts` was last evaluated.
pub fn pair_forces(contacts: &Contacts) -> Vec<PairForce> {
    let touching = contacts.pairs.iter().filter_map(|pair| {
        let (mut normal, mut force, mut moment) = (Vec3::zeros(), Vec3::zeros(), Mat3::zeros());
        for point in pair.active() {
            let e = &point.evaluation;
            let on_b = Vec3::new(e.wrench[6], e.wrench[7], e.wrench[8]);
            normal += e.normal * e.pressure;
            force += on_b;
            moment += e.point * on_b.transpose();
        }
        let normal = normal.try_normalize(0.0)?;
        Some(PairForce { bodies: [pair.a(), pair.b()], normal, force, moment })
    });
    touching.collect()
}

/// Bodies and the arm times force of each force on their surfaces [N m], tension positive. Arms count from each body's
/// position, so that forces between bodies enter by their branch vectors and the origin is of no matter.
pub fn surface_moments<'a>(
    pairs: &'a [PairForce],
    outside: &'a [OutsideForce],
    position: impl Fn(usize) -> Vec3 + Copy + 'a,
) -> impl Iterator<Item = (usize, Mat3)> + 'a {
    let of_pair = move |pair: &PairForce| {
        let ends = [(pair.bodies[0], -1.0), (pair.bodies[1], 1.0)];
        let (moment, force) = (pair.moment, pair.force);
        ends.map(|(body, sign)| (body, (moment - position(body) * force.transpose()) * sign))
    };
    let of_outside = move |outside: &OutsideForce| {
        (outside.body, (outside.point - position(outside.body)) * outside.force.transpose())
    };
    pairs.iter().flat_map(of_pair).chain(outside.iter().map(of_outside))
}

/// Sum of [`surface_moments`] over the grains [N m]: over a volume it is the mean stress of what lies in it (grains and
/// empty pores).
pub fn stress_moment(
    pairs: &[PairForce],
    outside: &[OutsideForce],
    is_grain: impl Fn(usize) -> bool,
    position: impl Fn(usize) -> Vec3 + Copy,
) -> Mat3 {
    surface_moments(pairs, outside, position)
        .filter(|(body, _)| is_grain(*body))
        .fold(Mat3::zeros(), |sum, (_, moment)| sum + moment)
}

/// The forces of `pressure` [Pa] on the nodes of the model's cover.
pub fn cover_forces(model: &Model, poses: &[Pose], pressure: f64) -> Vec<OutsideForce> {
    let Some(cover) = &model.cover else { return Vec::new() };
    let mut forces = vec![Vec3::zeros(); cover.nodes().len()];
    cover.node_forces_into(&mut forces, poses, pressure);
    let on_node = |(node, force): (usize, Vec3)| {
        let point = cover.position(poses, node);
        cover.holds_of(node).map(move |hold| OutsideForce {
            body: hold.body,
            point,
            force: hold.axes.of(&force),
        })
    };
    forces.into_iter().enumerate().flat_map(on_node).collect()
}

/// The forces of a rubber membrane under `pressure` [Pa]: its contacts' on the bodies, and what the nodes glued
/// to the plates hand to them, which is pressure, tension of the sheet and contact forces.
pub fn membrane_forces(
    model: &Model,
    membrane: &Membrane,
    contacts: &Contacts,
    poses: &[Pose],
    pressure: f64,
) -> Vec<OutsideForce> {
    let contacts = &contacts.membrane;
    let on_body = |(body, point): (usize, &MembranePoint)| OutsideForce {
        body,
        point: point.on_surface(),
        force: point.on_body(),
    };
    let mut on_nodes = vec![Vec3::zeros(); membrane.nodes.len()];
    if let Some(cover) = &model.cover {
        cover.node_forces_into(&mut on_nodes, poses, pressure);
    }
    membrane.node_forces_into(&mut on_nodes, &contacts.positions);
    for (_, point) in contacts.points() {
        for (&node, force) in point.contact.nodes().iter().zip(&point.force.on_membrane) {
            on_nodes[node as usize] += force;
        }
    }
    let glued = (0..on_nodes.len()).filter(|&node| membrane.is_glued(node)).map(|node| OutsideForce {
        body: membrane.nodes[node].body,
        point: contacts.positions[node],
        force: on_nodes[node],
    });
    contacts.points().map(on_body).chain(glued).collect()
}

/// What presses on the grains from outside: cover, rubber membrane or wall under `pressure` [Pa].
pub fn outside_forces(
    model: &Model,
    contacts: &Contacts,
    poses: &[Pose],
    pressure: f64,
) -> Vec<OutsideForce> {
    match (&model.membrane, &model.wall) {
        (Some(membrane), _) => membrane_forces(model, membrane, contacts, poses, pressure),
        (None, Some(_)) => contacts.wall.iter().map(OutsideForce::of_wall).collect(),
        (None, None) => cover_forces(model, poses, pressure),
    }
}

/// Mean stress in the cover's `volume` [m^3] from contact forces and those from `outside` [Pa], compression positive. The
/// part of the pressure that the cover's rims hand to the plates counts where it acts sideways: it
/// confines the volume as much as the rest. Under a rubber membrane its contacts stand for the cover; the
/// hoop tension then comes on top of the pressure.
pub fn mean_stress(
    model: &Model,
    pairs: &[PairForce],
    outside: &[OutsideForce],
    poses: &[Pose],
    volume: f64,
) -> Mat3 {
    let is_grain = |body: usize| model.bodies[body].kind == BodyKind::Grain;
    let mut sum = stress_moment(pairs, outside, is_grain, |body| poses[body].position);
    for rim in outside.iter().filter(|outside| !is_grain(outside.body)) {
        let arm = rim.point - poses[rim.body].position;
        for i in 0..2 {
            for j in 0..2 {
                sum[(i, j)] += arm[i] * rim.force[j];
            }
        }
    }
    -0.5 * (sum + sum.transpose()) / volume
}

/// What friction of the grains on the end `plates` adds to the mean radial stress in `volume` [m^3]: the mean over x and
/// y of minus lever arm times force on the grains [Pa], compression positive.
///
/// Of grains in balance the contacts between them cancel in the sum over all of arm times force, about
/// any one origin; what is left are the forces from outside. Those of the pressure on a closed cover sum up
/// to `-p V` times unity. So the radial stress from contact forces is the pressure and this.
pub fn end_friction(pairs: &[PairForce], plates: &[usize], volume: f64) -> f64 {
    let mut sum = 0.0;
    for pair in pairs {
        for (plate, sign) in [(pair.bodies[0], 1.0), (pair.bodies[1], -1.0)] {
            if plates.contains(&plate) {
                sum += sign * (pair.moment[(0, 0)] + pair.moment[(1, 1)]);
            }
        }
    }
    -0.5 * sum / volume
}

/// What a rubber membrane adds to the mean radial and to the axial stress from contact forces in `volume` [m^3], the inner
/// half of its rubber not counted, compression positive [Pa].
///
/// Its hoops press on the grains; along the axis it draws the plates together, which the grains carry beside the ram: minus
/// position times the sheet's force on its nodes. And `pressure` [Pa] acts on the middle of the rubber, farther out than the
/// grains' surfaces: `p inside / V` less lever times contact force, half that at the side of a cylinder. Forces in balance
/// on every node make these terms exact (virtual work of a uniform stretch).
pub fn membrane_stress(
    membrane: &Membrane,
    contacts: &MembraneContacts,
    pressure: f64,
    volume: f64,
    inside: f64,
) -> [f64; 2] {
    let mut forces = vec![Vec3::zeros(); membrane.nodes.len()];
    membrane.node_forces_into(&mut forces, &contacts.positions);
    let (mut across, mut along) = (0.0, 0.0);
    for (x, f) in contacts.positions.iter().zip(&forces) {
        across += x.x * f.x + x.y * f.y;
        along += x.z * f.z;
    }
    for (_, point) in contacts.points() {
        let (force, at) = (point.on_body(), point.on_surface());
        across += at.xy().dot(&force.xy());
        along += at.z * force.z;
        for (&node, f) in point.contact.nodes().iter().zip(&point.force.on_membrane) {
            let x = contacts.positions[node as usize];
            across += x.xy().dot(&f.xy());
            along += x.z * f.z;
        }
    }
    [(pressure * inside - 0.5 * across) / volume, (pressure * inside - along) / volume]
}

impl Network {
    /// `grains` says which bodies are grains.
    pub fn of(pairs: &[PairForce], is_grain: &[bool]) -> Self {
        let mut ends = vec![0usize; is_grain.len()];
        let mut forces = Vec::new();
        let mut fabric = Mat3::zeros();
        for pair in pairs {
            for body in pair.bodies {
                ends[body] += 1;
            }
            if pair.bodies.iter().all(|&body| is_grain[body]) {
                forces.push(pair.force.norm());
                fabric += pair.normal * pair.normal.transpose();
            }
        }
        let of_grains = || ends.iter().zip(is_grain).filter(|(_, grain)| **grain).map(|(ends, _)| *ends);
        let mean = |sum: f64, count: usize| if count == 0 { f64::NAN } else { sum / count as f64 };
        let held = || of_grains().filter(|&ends| ends >= 2);
        let count = forces.len();
        let force_mean = mean(forces.iter().sum(), count);
        let variance = mean(forces.iter().map(|f| (f - force_mean).powi(2)).sum(), count);
        Network {
            coordination_number: mean(of_grains().sum::<usize>() as f64, of_grains().count()),
            mechanical_coordination_number: mean(held().sum::<usize>() as f64, held().count()),
            rattlers: of_grains().filter(|&ends| ends < 2).count(),
            fabric: if count == 0 { Mat3::from_element(f64::NAN) } else { fabric / count as f64 },
            force_mean,
            force_max: forces.iter().copied().fold(f64::NAN, f64::max),
            force_variation: variance.sqrt() / force_mean,
            strong_fraction: mean(forces.iter().filter(|f| **f > force_mean).count() as f64, count),
        }
    }

    /// Fabric along the axis less that across it: positive where contacts face up and down.
    pub fn fabric_anisotropy(&self) -> f64 {
        self.fabric[(2, 2)] - 0.5 * (self.fabric[(0, 0)] + self.fabric[(1, 1)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pair(a: usize, b: usize, at: Vec3, force: Vec3) -> PairForce {
        PairForce { bodies: [a, b], normal: force.normalize(), force, moment: at * force.transpose() }
    }

    /// Spheres on a simple cubic lattice of spacing d, each pressed by the forces f along x, y and z
    /// by its neighbours or, at the boundary, from outside: the stress is f / d^2 along each axis.
    #[test]
    fn stress_of_a_cubic_lattice_is_force_over_spacing_squared() {
        const N: usize = 3;
        let spacing = 0.04;
        let force = Vec3::new(100.0, 250.0, 700.0);
        let index = |c: [usize; 3]| c[0] + N * (c[1] + N * c[2]);
        let place = |c: [usize; 3]| Vec3::new(c[0] as f64, c[1] as f64, c[2] as f64) * spacing;
        let mut positions = vec![Vec3::zeros(); N * N * N];
        let (mut pairs, mut outside) = (Vec::new(), Vec::new());
        for x in 0..N {
            for y in 0..N {
                for z in 0..N {
                    let c = [x, y, z];
                    positions[index(c)] = place(c);
                    for k in 0..3 {
                        let mut axis = Vec3::zeros();
                        axis[k] = 1.0;
                        let half = axis * (0.5 * spacing);
                        if c[k] + 1 < N {
                            let mut next = c;
                            next[k] += 1;
                            pairs.push(pair(index(c), index(next), place(c) + half, axis * force[k]));
                        } else {
                            let (point, force) = (place(c) + half, -axis * force[k]);
                            outside.push(OutsideForce { body: index(c), point, force });
                        }
                        if c[k] == 0 {
                            let (point, force) = (place(c) - half, axis * force[k]);
                            outside.push(OutsideForce { body: index(c), point, force });
                        }
                    }
                }
            }
        }
        let volume = (N as f64 * spacing).powi(3);
        let stress = -stress_moment(&pairs, &outside, |_| true, |body| positions[body]) / volume;
        for i in 0..3 {
            for j in 0..3 {
                let expected = if i == j { force[i] / spacing.powi(2) } else { 0.0 };
                assert!((stress[(i, j)] - expected).abs() < 1e-9 * expected.max(1.0), "{stress}");
            }
        }
        let network = Network::of(&pairs, &[true; 27]);
        assert!((network.coordination_number - 2.0 * 54.0 / 27.0).abs() < 1e-12);
        // As many contacts along each axis: isotropic, whatever their forces.
        assert!((network.fabric - Mat3::identity() / 3.0).norm() < 1e-12);
        assert!(network.fabric_anisotropy().abs() < 1e-12);
        assert!((network.force_mean - 350.0).abs() < 1e-9 && network.force_max == 700.0);
        // Of three equally many forces 100, 250, 700 one is above the mean of 350.
        assert!((network.strong_fraction - 1.0 / 3.0).abs() < 1e-12);
        let variance = (250f64.powi(2) + 100f64.powi(2) + 350f64.powi(2)) / 3.0;
        assert!((network.force_variation - variance.sqrt() / 350.0).abs() < 1e-12);
    }

    #[test]
    fn fabric_of_aligned_contacts_is_a_dyad_and_rattlers_do_not_carry() {
        let up = Vec3::new(0.0, 0.0, 10.0);
        // Grains 0, 1, 2 in a column on plate 4; grain 3 hangs on grain 2 alone.
        let pairs = [
            pair(0, 1, Vec3::zeros(), up),
            pair(1, 2, Vec3::zeros(), up),
            pair(2, 3, Vec3::zeros(), up),
            pair(0, 4, Vec3::zeros(), -up),
        ];
        let network = Network::of(&pairs, &[true, true, true, true, false]);
        assert!((network.fabric[(2, 2)] - 1.0).abs() < 1e-15 && network.fabric_anisotropy() == 1.0);
        assert_eq!(network.rattlers, 1);
        assert!((network.coordination_number - 7.0 / 4.0).abs() < 1e-15);
        // Thornton: (2 Nc - N1) / (Np - N0 - N1) with the plate's contact as one end.
        assert!((network.mechanical_coordination_number - 2.0).abs() < 1e-15);
        let nothing = Network::of(&[], &[true, false]);
        assert!(nothing.force_mean.is_nan() && nothing.coordination_number == 0.0);
    }
}
