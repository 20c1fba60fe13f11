//! The force between a piece of membrane and a body, and its tangent.
//!
//! As between grains (see [`crate::contact`]): the membrane is its triangles rounded by half its thickness, and
//! a contact joins a membrane node and a body's core, a core vertex and a triangle, or two
//! edges that cross. The force is minus the derivative of `w k psi(overlap)`, weight gradient included; there
//! is no friction. A core vertex touches each triangle beside a membrane edge, and a node and the
//! triangles around it touch together: the penalty k is then counted two to seven times, which the
//! equilibrium hardly feels, since the membrane's load fixes the force and k only the overlap.
//!
//! The membrane's points move freely, unlike a body's: the tangent has them one by one.
//! Units SI; forces on the membrane unless said.

use crate::contact::features::{Feature, LinePair, Site, closest_points, fade_rate};
use crate::contact::law::ContactLaw;
use crate::tensor::Vec3;
use crate::tensor::dual::{Dual, Real, Vector};

/// What a contact's force depends on besides the positions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MembraneContactLaw {
    /// Onset of the normal force, fades of edges.
    pub law: ContactLaw,
    /// Penalty [N/m]: a contact's force over its overlap.
    pub stiffness: f64,
    /// Share of a membrane edge over which its contacts fade in from either end.
    pub edge_fade: f64,
}

/// A contact in one configuration. In `site`, `a` is the body and `b` the membrane, its indices those of
/// membrane nodes.
#[derive(Debug, Clone, Copy)]
pub struct MembraneContact {
    pub site: Site,
    /// Rounding radius of the body [m].
    pub rounding: f64,
    /// How far the membrane's middle keeps off the rounded surface of the body: half its thickness [m].
    pub offset: f64,
    /// 0 to 1: weight of the body's edge; 1 for other pairs.
    pub edge_weight: f64,
}

impl MembraneContact {
    /// The membrane nodes that take part.
    pub fn nodes(&self) -> &[u32] {
        &self.site.on_b[..usize::from(self.site.count_b)]
    }
}

/// Forces of a contact [N, N m].
#[derive(Debug, Clone, Copy)]
pub struct MembraneForce {
    /// Weighted normal force [N]; zero where nothing touches.
    pub pressure: f64,
    /// [J]
    pub energy: f64,
    /// Overlap of the rounded surfaces [m].
    pub overlap: f64,
    /// Where the force acts on the body [m].
    pub point: Vec3,
    /// Force and moment about its position on the body.
    pub on_body: [f64; 6],
    /// On the membrane nodes of the site.
    pub on_membrane: [Vec3; 3],
}

/// Derivative of the fifteen components (force and moment on the body, force on three nodes) by the spin
/// of the body (0-2) and the three nodes' positions (3-11). Moving the body is moving the nodes the other way.
pub type MembraneTangent = [[f64; 12]; 15];

/// Forces with the body's position at `position`, its core points `body` and the nodes `membrane` [m].
pub fn evaluate(
    law: &MembraneContactLaw,
    contact: &MembraneContact,
    position: &Vec3,
    body: &[Vec3; 3],
    membrane: &[Vec3; 3],
) -> MembraneForce {
    let constants = |p: &[Vec3; 3]| p.map(|x| Vector::<f64>::constant(&x));
    forces(law, contact, &Vector::constant(position), &constants(body), &constants(membrane)).0
}

/// The exact derivative of [`evaluate`]'s forces.
pub fn tangent(
    law: &MembraneContactLaw,
    contact: &MembraneContact,
    position: &Vec3,
    body: &[Vec3; 3],
    membrane: &[Vec3; 3],
) -> MembraneTangent {
    // Only nodes that take part are variables: most contacts have one.
    match contact.nodes().len() {
        1 => derivative::<6>(law, contact, position, body, membrane),
        2 => derivative::<9>(law, contact, position, body, membrane),
        _ => derivative::<12>(law, contact, position, body, membrane),
    }
}

/// With the spin and the first `(N - 3) / 3` nodes as variables.
fn derivative<const N: usize>(
    law: &MembraneContactLaw,
    contact: &MembraneContact,
    position: &Vec3,
    body: &[Vec3; 3],
    membrane: &[Vec3; 3],
) -> MembraneTangent {
    let variables =
        |base: &Vec3, first: usize| Vector([0, 1, 2].map(|k| Dual::<N>::variable(base[k], first + k)));
    let spin = variables(&Vec3::zeros(), 0);
    let turned = body.map(|p| Vector::constant(&p) + spin.cross(Vector::constant(&(p - position))));
    let nodes = [0, 1, 2].map(|k| match 3 + 3 * k {
        first if first < N => variables(&membrane[k], first),
        _ => Vector::constant(&membrane[k]),
    });
    let (_, components) = forces(law, contact, &Vector::constant(position), &turned, &nodes);
    components.map(|component| {
        let mut row = [0.0; 12];
        row[..N].copy_from_slice(&component.gradient);
        row
    })
}

fn forces<T: Real>(
    law: &MembraneContactLaw,
    contact: &MembraneContact,
    position: &Vector<T>,
    body: &[Vector<T>; 3],
    membrane: &[Vector<T>; 3],
) -> (MembraneForce, [T; 15]) {
    let site = &contact.site;
    let (xa, xb) = closest_points(site, body, membrane);
    let difference = xb - xa;
    let distance = difference.norm();
    let normal = difference.times(T::constant(1.0) / distance);
    let overlap = T::constant(contact.rounding + contact.offset) - distance;
    let mut result = MembraneForce {
        pressure: 0.0,
        energy: 0.0,
        overlap: overlap.value(),
        point: xa.value(),
        on_body: [0.0; 6],
        on_membrane: [Vec3::zeros(); 3],
    };
    let nothing = [T::constant(0.0); 15];
    if !(overlap.value() > 0.0) {
        return (result, nothing);
    }
    let stiffness = law.stiffness * contact.edge_weight;
    let lines = matches!(site.feature, Feature::Edges(..)).then(|| LinePair::new(body, membrane));
    let edge_weight = lines.as_ref().map(|lines| {
        let rates = [fade_rate(lines.u.dot(lines.u), law.law.fade_length), 1.0 / law.edge_fade];
        lines.weight_fading(rates, &law.law)
    });
    let weight = edge_weight.as_ref().map_or(T::constant(1.0), |w| w.value);
    let pressure = weight * law.law.normal(overlap).scaled(stiffness);
    if !(pressure.value() > 0.0) {
        return (result, nothing);
    }

    let push = normal.times(pressure);
    let mut on_membrane = shares(site.count_b, &xb, membrane, lines.as_ref()).map(|share| push.times(share));
    let mut force = -push;
    let mut moment = (xa - *position).cross(force);
    let energy = law.law.energy(overlap).scaled(stiffness);
    if let (Some(lines), Some(edge_weight)) = (&lines, &edge_weight)
        && edge_weight.value.value() < 1.0
    {
        let gradient = lines.end_point_gradient(edge_weight, difference);
        let [_, stretch] = lines.stretch_gradient(edge_weight);
        for (k, g) in gradient.iter().enumerate() {
            let pull = -g.times(energy);
            if k < 2 {
                force = force + pull;
                moment = moment + (body[k] - *position).cross(pull);
            } else {
                let along = stretch.times(energy);
                on_membrane[k - 2] =
                    if k == 2 { on_membrane[0] + pull + along } else { on_membrane[1] + pull - along };
            }
        }
    }
    let mut all = nothing;
    let vectors = [force, moment, on_membrane[0], on_membrane[1], on_membrane[2]];
    for (part, vector) in all.chunks_exact_mut(3).zip(vectors) {
        part.copy_from_slice(&vector.0);
    }
    result.pressure = pressure.value();
    result.energy = (weight * energy).value();
    for (k, component) in result.on_body.iter_mut().enumerate() {
        *component = all[k].value();
    }
    result.on_membrane = on_membrane.map(|f| f.value());
    (result, all)
}

/// The shares of the nodes in the closest point `x` of the membrane.
fn shares<T: Real>(count: u8, x: &Vector<T>, nodes: &[Vector<T>; 3], lines: Option<&LinePair<T>>) -> [T; 3] {
    let (zero, one) = (T::constant(0.0), T::constant(1.0));
    let [p, q, r] = nodes;
    match (count, lines) {
        (1, _) => [one, zero, zero],
        (2, Some(lines)) => [one - lines.t, lines.t, zero],
        (2, None) => {
            let u = *q - *p;
            let t = (*x - *p).dot(u) / u.dot(u);
            [one - t, t, zero]
        }
        _ => {
            let (u, v, w) = (*q - *p, *r - *p, *x - *p);
            let normal = u.cross(v);
            let square = normal.dot(normal);
            let second = normal.dot(w.cross(v)) / square;
            let third = normal.dot(u.cross(w)) / square;
            [one - second - third, second, third]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tensor::Rotation;

    const LAW: MembraneContactLaw = MembraneContactLaw {
        law: ContactLaw {
            onset: 2e-5,
            fade_length: 2e-3,
            parallel_limit: 0.6,
            tangential_ratio: 0.9,
            friction_blend: 0.05,
        },
        stiffness: 2e6,
        edge_fade: 0.25,
    };

    struct Scene {
        contact: MembraneContact,
        position: Vec3,
        body: [Vec3; 3],
        membrane: [Vec3; 3],
    }

    fn scene(feature: Feature, counts: [u8; 2], body: [Vec3; 3], mut membrane: [Vec3; 3]) -> Scene {
        let site = Site { feature, on_a: [0, 1, 2], on_b: [0, 1, 2], count_a: counts[0], count_b: counts[1] };
        let contact = MembraneContact { site, rounding: 1e-3, offset: 1e-3, edge_weight: 0.8 };
        let position = Vec3::new(1e-3, -2e-3, -8e-3);
        // Moved along the connecting line to an overlap of 0.1 mm.
        let v = |p: &[Vec3; 3]| p.map(|x| Vector::<f64>::constant(&x));
        let (xa, xb) = closest_points(&site, &v(&body), &v(&membrane));
        let gap = xb.value() - xa.value();
        let shift = gap * ((2e-3 - 1e-4) / gap.norm() - 1.0);
        membrane.iter_mut().for_each(|x| *x += shift);
        Scene { contact, position, body, membrane }
    }

    fn scenes() -> Vec<Scene> {
        let facet = [Vec3::new(-5e-3, -4e-3, 1e-3), Vec3::new(6e-3, -3e-3, 0.0), Vec3::new(0.0, 7e-3, 5e-4)];
        let above = facet.map(|x| x * 0.9 + Vec3::new(3e-4, 1e-4, 3e-3));
        let edge = [Vec3::new(-8e-4, 1e-4, 0.0), Vec3::new(9e-3, -3e-4, 2e-4), Vec3::zeros()];
        let across = [Vec3::new(3e-4, -7e-4, 2e-3), Vec3::new(2e-3, 9e-3, 3e-3), Vec3::zeros()];
        vec![
            scene(
                Feature::VertexOfB(0),
                [3, 1],
                facet,
                [above[0] * 0.2 + above[1] * 0.3, above[1], above[2]],
            ),
            scene(Feature::VertexOfB(0), [2, 1], edge, across),
            scene(Feature::VertexOfB(0), [1, 1], facet, across),
            scene(Feature::VertexOfA(0), [1, 3], [facet[0] * 0.3, facet[1], facet[2]], above),
            scene(Feature::VertexOfA(0), [1, 2], [edge[0] + Vec3::x() * 2e-3, edge[1], edge[2]], across),
            scene(Feature::Edges(0, 0), [2, 2], edge, across),
        ]
    }

    impl Scene {
        /// The scene with variable `k` (spin, then nodes; 12-14 the body's position) moved by `step`.
        fn moved(&self, k: usize, step: f64) -> MembraneForce {
            let (mut position, mut body, mut membrane) = (self.position, self.body, self.membrane);
            match k {
                0..3 => {
                    let turn = Rotation::from_scaled_axis(Vec3::ith(k, step));
                    body = body.map(|p| position + turn * (p - position));
                }
                3..12 => membrane[(k - 3) / 3][k % 3] += step,
                _ => {
                    position[k - 12] += step;
                    body.iter_mut().for_each(|p| p[k - 12] += step);
                }
            }
            evaluate(&LAW, &self.contact, &position, &body, &membrane)
        }

        fn components(force: &MembraneForce) -> [f64; 15] {
            let mut all = [0.0; 15];
            all[..6].copy_from_slice(&force.on_body);
            for (k, f) in force.on_membrane.iter().enumerate() {
                all[6 + 3 * k..9 + 3 * k].copy_from_slice(f.as_slice());
            }
            all
        }
    }

    #[test]
    fn force_is_derivative_of_energy() {
        for scene in scenes() {
            let force = scene.moved(0, 0.0);
            assert!(force.pressure > 0.0);
            if let Feature::Edges(..) = scene.contact.site.feature {
                let full = LAW.stiffness * 0.8 * LAW.law.normal(force.overlap);
                assert!(force.pressure < 0.95 * full, "the sample must lie in the fade");
            }
            let components = Scene::components(&force);
            for k in 0..15 {
                let h = if k < 3 { 1e-7 } else { 1e-9 };
                let slope = (scene.moved(k, h).energy - scene.moved(k, -h).energy) / (2.0 * h);
                let work = match k {
                    0..3 => components[3 + k],
                    3..12 => components[6 + k - 3],
                    _ => components[k - 12],
                };
                let scale = force.pressure * if k < 3 { 1e-2 } else { 1.0 };
                assert!((slope + work).abs() < 1e-5 * scale, "{:?} {k}: {slope} {work}", scene.contact.site);
            }
        }
    }

    #[test]
    fn tangent_is_derivative_of_force() {
        for scene in scenes() {
            let exact = tangent(&LAW, &scene.contact, &scene.position, &scene.body, &scene.membrane);
            for k in 0..15 {
                let h = if k < 3 { 1e-7 } else { 1e-9 };
                let (plus, minus) =
                    (Scene::components(&scene.moved(k, h)), Scene::components(&scene.moved(k, -h)));
                for (i, row) in exact.iter().enumerate() {
                    let difference = (plus[i] - minus[i]) / (2.0 * h);
                    // Moving the body is moving all nodes the other way.
                    let analytic =
                        if k < 12 { row[k] } else { -(0..3).map(|n| row[3 + 3 * n + k - 12]).sum::<f64>() };
                    let scale = LAW.stiffness
                        * if k < 3 { 1e-2 } else { 1.0 }
                        * if (3..6).contains(&i) { 1e-2 } else { 1.0 };
                    assert!(
                        (difference - analytic).abs() < 1e-4 * scale,
                        "{:?} component {i} by {k}: {difference} {analytic}",
                        scene.contact.site
                    );
                }
            }
        }
    }

    #[test]
    fn forces_balance() {
        for scene in scenes() {
            let force = scene.moved(0, 0.0);
            let on_body = Vec3::from_column_slice(&force.on_body[..3]);
            let moment = Vec3::from_column_slice(&force.on_body[3..]);
            let total = on_body + force.on_membrane.iter().sum::<Vec3>();
            let turning: Vec3 = scene
                .membrane
                .iter()
                .zip(&force.on_membrane)
                .map(|(x, f)| (x - scene.position).cross(f))
                .sum();
            assert!(total.norm() < 1e-11 * force.pressure, "{total:?}");
            assert!((turning + moment).norm() < 1e-12 * force.pressure, "{:?}", turning + moment);
        }
    }
}
