//! The patch that two nearly parallel faces of rigid bodies share.
//!
//! The second face's plane is the domain, the first one's plane what it reaches into: with `o(x) > 0` the depth of its point x
//! behind that plane, `p = k o` is the pressure, a layer of springs k [N/m^3], and its energy `k/2 integral of o^2` over the part P of the
//! overlap of both polygons where o is positive. All integrals are exact, o being linear, so nothing depends on how a polygon is cut.
//! The force is along the first face's normal through the centre of pressure: the derivative of the energy at a given P.
//! That P changes does no work here (its rim pulls with `k o^2/2` per length, a share of about `o / (2 L)` of the force, with the other sign once a face
//! has slid past another's rim: the force would jump between faces of one size).
//!
//! Four points stand for the patch, a quarter of the force each: the centre of pressure and the root of its second moments
//! (a Cholesky factor in the second face's axes) each way, so that friction resists sliding and spinning as the pressure is spread. They
//! move continuously with the bodies and keep their numbers, so what a contact remembers is kept under these.

use crate::contact::face::{Face, FaceShare, FaceWeight};
use crate::contact::force::{Evaluation, Kinematics, PointState, Tangent, moving_frames};
use crate::contact::friction::{Pressed, rub};
use crate::contact::law::ContactLaw;
use crate::contact::state::Frame;
use crate::contact::wrench::Wrench;
use crate::tensor::dual::{Dual, Real, Vector};
use crate::tensor::{Pose, Vec3};

/// Points of a patch.
pub const POINTS: usize = 4;

/// Share of the smaller face's area below which a patch carries nothing.
const LEAST_AREA: f64 = 1e-12;

/// Two faces in space.
#[derive(Debug, Clone)]
pub struct FacesInSpace<'a> {
    ring: Vec<Vec3>,
    corner: Vec3,
    normals: [Vec3; 2],
    axes: [Vec3; 2],
    faces: [&'a Face; 2],
    /// How much of the patch is flat on both sides ([`crate::contact::face`]).
    g: f64,
}

impl<'a> FacesInSpace<'a> {
    pub fn new(faces: [&'a Face; 2], poses: [&Pose; 2], g: f64) -> Self {
        let turns = poses.map(|pose| pose.rotation.to_rotation_matrix());
        FacesInSpace {
            ring: faces[0].ring.iter().map(|p| poses[0].position + turns[0] * p).collect(),
            corner: poses[1].position + turns[1] * faces[1].ring[0],
            normals: [turns[0] * faces[0].normal, turns[1] * faces[1].normal],
            axes: faces[1].axes.map(|axis| turns[1] * axis),
            faces,
            g,
        }
    }

    /// Area that the patch's weight and springs are taken over [m^2].
    pub fn reference_area(&self) -> f64 {
        self.faces[0].area.min(self.faces[1].area)
    }
}

/// The four points; `None` where the faces are apart. `states` have a quarter of the stiffness of [`FacesInSpace::reference_area`] as
/// their spring.
pub fn evaluate(
    law: &ContactLaw,
    faces: &FacesInSpace<'_>,
    kinematics: [&Kinematics; 2],
    states: &[PointState; POINTS],
) -> Option<[Evaluation; POINTS]> {
    let frames = kinematics.map(Frame::<f64>::still);
    wrenches(law, faces, &frames, states).map(|all| all.map(|(evaluation, _)| evaluation))
}

/// The exact derivatives of [`evaluate`]'s wrenches.
pub fn tangents(
    law: &ContactLaw,
    faces: &FacesInSpace<'_>,
    kinematics: [&Kinematics; 2],
    states: &[PointState; POINTS],
) -> Option<[Tangent; POINTS]> {
    let frames = moving_frames::<9>(kinematics);
    let gradients = |(_, wrench): (Evaluation, [Dual<9>; 12])| wrench.map(|component| component.gradient);
    wrenches(law, faces, &frames, states).map(|all| all.map(gradients))
}

fn wrenches<T: Real>(
    law: &ContactLaw,
    faces: &FacesInSpace<'_>,
    frames: &[Frame<T>; 2],
    states: &[PointState; POINTS],
) -> Option<[(Evaluation, [T; 12]); POINTS]> {
    let [frame_a, frame_b] = frames;
    let normals = [frame_a.turned(&faces.normals[0]), frame_b.turned(&faces.normals[1])];
    let normal = normals[0];
    let weight = FaceWeight::new(FaceShare::Patch { g: faces.g }, normals, normal);
    if weight.value.value() <= 0.0 {
        return None;
    }
    let corner = frame_b.carried(&faces.corner);
    let axes = faces.axes.map(|axis| frame_b.turned(&axis));
    let ring: Vec<Vector<T>> = faces.ring.iter().map(|p| frame_a.carried(p)).collect();
    let flat = |p: &Vector<T>| {
        let arm = *p - corner;
        // The depth follows from the place once the polygon is cut.
        Vertex { at: [arm.dot(axes[0]), arm.dot(axes[1])], depth: T::constant(0.0) }
    };
    // Seen from outside the second face, the first one's ring runs clockwise.
    let mut polygon: Vec<Vertex<T>> = ring.iter().rev().map(flat).collect();
    let rim: Vec<[f64; 2]> = faces.faces[1].ring.iter().map(|p| faces.faces[1].coordinates(p)).collect();
    for (k, [x, y]) in rim.iter().enumerate() {
        let [to_x, to_y] = rim[(k + 1) % rim.len()];
        let (along_x, along_y) = (to_x - x, to_y - y);
        polygon = cut(&polygon, |c| {
            (c.at[1] - T::constant(*y)).scaled(along_x) - (c.at[0] - T::constant(*x)).scaled(along_y)
        });
    }
    let in_space = |at: &[T; 2]| corner + axes[0].times(at[0]) + axes[1].times(at[1]);
    for c in &mut polygon {
        c.depth = normal.dot(ring[0] - in_space(&c.at));
    }
    let polygon = cut(&polygon, |c| c.depth);
    let sums = Sums::over(&polygon);
    if !(sums.area.value() > LEAST_AREA * faces.reference_area() && sums.depth.value() > 0.0) {
        return None;
    }
    let centre = sums.first.map(|s| s / sums.depth);
    let spread = |i: usize, j: usize, s: T| s / sums.depth - centre[i] * centre[j];
    let second = [spread(0, 0, sums.second[0]), spread(0, 1, sums.second[1]), spread(1, 1, sums.second[2])];
    let offsets = root(second, sums.area.value());
    let share = sums.area.scaled(1.0 / faces.reference_area());
    let mean = sums.depth / sums.area;
    let deepest = polygon.iter().map(|c| c.depth.value()).fold(0.0, f64::max);
    let point = |k: usize| {
        let (state, [dx, dy]) = (&states[k], offsets[k]);
        let place = in_space(&[centre[0] + dx, centre[1] + dy]);
        let weight_here = weight.value * share;
        let load = mean.scaled(state.spring);
        let pressure = weight_here * load;
        let mut evaluation = Evaluation {
            gap: -deepest,
            load: load.value(),
            ..Evaluation::new(state, weight_here.value(), normal.value(), place.value(), pressure.value())
        };
        let mut force = normal.times(pressure);
        if state.friction.coefficient > 0.0 {
            let (weight, overlap) = (weight_here, mean);
            let pressed = Pressed { point: place, normal, pressure, weight, overlap, grip: None };
            force = force + rub(law, state, [frame_a, frame_b], &pressed, &Vector::zero(), &mut evaluation);
        }
        let stored = sums.square.scaled(0.5 * state.spring / faces.reference_area());
        evaluation.energy = (weight.value * stored).value();
        let moment = weight.by_turn.times(stored);
        let mut wrench = Wrench::new([frame_a, frame_b], place, force);
        wrench.turn_a(-moment);
        wrench.turn_b(moment);
        let all = wrench.components();
        evaluation.wrench = all.map(T::value);
        (evaluation, all)
    };
    Some(std::array::from_fn(point))
}

/// A corner of the patch in the axes of the second face [m], and how deep it lies behind the first [m].
#[derive(Debug, Clone, Copy)]
struct Vertex<T> {
    at: [T; 2],
    depth: T,
}

/// The part of a convex polygon where a linear function is not negative.
fn cut<T: Real>(polygon: &[Vertex<T>], height: impl Fn(&Vertex<T>) -> T) -> Vec<Vertex<T>> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (k, start) in polygon.iter().enumerate() {
        let end = &polygon[(k + 1) % polygon.len()];
        let (from, to) = (height(start), height(end));
        if from.value() >= 0.0 {
            kept.push(*start);
        }
        if (from.value() < 0.0) != (to.value() < 0.0) {
            let share = from / (from - to);
            let between = |p: T, q: T| p + (q - p) * share;
            let at = [between(start.at[0], end.at[0]), between(start.at[1], end.at[1])];
            kept.push(Vertex { at, depth: between(start.depth, end.depth) });
        }
    }
    kept
}

/// Integrals over the patch: area, depth o, o x, o x x, o^2.
struct Sums<T> {
    area: T,
    depth: T,
    first: [T; 2],
    /// xx, xy, yy.
    second: [T; 3],
    square: T,
}

impl<T: Real> Sums<T> {
    /// By a fan of triangles, over each of which products of linear functions have closed integrals.
    fn over(polygon: &[Vertex<T>]) -> Self {
        let zero = T::constant(0.0);
        let mut sums = Sums { area: zero, depth: zero, first: [zero; 2], second: [zero; 3], square: zero };
        for k in 1..polygon.len().saturating_sub(1) {
            let corners = [&polygon[0], &polygon[k], &polygon[k + 1]];
            let side = |i: usize, axis: usize| corners[i].at[axis] - corners[0].at[axis];
            let area = (side(1, 0) * side(2, 1) - side(1, 1) * side(2, 0)).scaled(0.5);
            let depth = corners.map(|c| c.depth);
            let [x, y] = [0, 1].map(|axis| corners.map(|c| c.at[axis]));
            sums.area = sums.area + area;
            sums.depth = sums.depth + area * total(depth).scaled(1.0 / 3.0);
            sums.square = sums.square + area * pairs(depth, depth);
            for (sum, axis) in sums.first.iter_mut().zip([x, y]) {
                *sum = *sum + area * pairs(depth, axis);
            }
            for (sum, [p, q]) in sums.second.iter_mut().zip([[x, x], [x, y], [y, y]]) {
                *sum = *sum + area * triples(depth, p, q);
            }
        }
        sums
    }
}

fn total<T: Real>(f: [T; 3]) -> T {
    f[0] + f[1] + f[2]
}

fn product<T: Real>(f: [T; 3], g: [T; 3]) -> [T; 3] {
    std::array::from_fn(|i| f[i] * g[i])
}

/// Mean of the product of two linear functions over a triangle, from their values at its corners.
fn pairs<T: Real>(f: [T; 3], g: [T; 3]) -> T {
    (total(f) * total(g) + total(product(f, g))).scaled(1.0 / 12.0)
}

/// Mean of the product of three.
fn triples<T: Real>(f: [T; 3], g: [T; 3], h: [T; 3]) -> T {
    let mixed =
        total(f) * total(product(g, h)) + total(g) * total(product(f, h)) + total(h) * total(product(f, g));
    let twice = total(product(f, product(g, h))).scaled(2.0);
    (total(f) * total(g) * total(h) + mixed + twice).scaled(1.0 / 60.0)
}

/// Where the points lie about their centre: the root of 2 times the columns of the Cholesky factor of their second moments, each way.
fn root<T: Real>([xx, xy, yy]: [T; 3], area: f64) -> [[T; 2]; POINTS] {
    let zero = T::constant(0.0);
    // Of a strip as narrow as rounding nothing is left but its centre.
    let least = 1e-12 * area;
    if xx.value() <= least {
        return [[zero; 2]; POINTS];
    }
    let along = xx.sqrt();
    let across = xy / along;
    let rest = yy - across * across;
    let rest = if rest.value() <= least { zero } else { rest.sqrt() };
    let wide = std::f64::consts::SQRT_2;
    let (first, second) = ([along.scaled(wide), across.scaled(wide)], [zero, rest.scaled(wide)]);
    [first, first.map(|x| -x), second, second.map(|x| -x)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::law::Weakening;
    use crate::geometry::{Polyhedron, RoundedBody};
    use crate::tensor::Rotation;

    const LAW: ContactLaw = ContactLaw { onset: 0.0, ..ContactLaw::SAMPLE };
    /// [N/m^3]
    const STIFFNESS: f64 = 1e12;

    /// Lower and upper box of these edges [m].
    struct Boxes {
        bodies: [Vec<Face>; 2],
        friction: f64,
    }

    impl Boxes {
        fn new(sizes: [[f64; 3]; 2], friction: f64) -> Self {
            let faces = |size: [f64; 3]| {
                let shape = Polyhedron::cuboid(size).expect("a box");
                Face::of(&RoundedBody::inset(&shape, 1e-3).expect("fits"))
            };
            Boxes { bodies: sizes.map(faces), friction }
        }

        fn facing(&self) -> [&Face; 2] {
            let along = |side: usize, z: f64| {
                let found = self.bodies[side].iter().find(|face| face.normal.z * z > 0.9);
                found.expect("a face that looks there")
            };
            [along(0, 1.0), along(1, -1.0)]
        }

        fn evaluate(&self, poses: &[Pose; 2]) -> Option<([Evaluation; POINTS], [Tangent; POINTS])> {
            let committed = [Pose::identity(), Pose::new(Vec3::new(0.0, 0.0, 0.02), Rotation::identity())];
            let kinematics = [0, 1].map(|i| Kinematics::between(&committed[i], &poses[i]));
            let faces = FacesInSpace::new(self.facing(), [&poses[0], &poses[1]], 1.0);
            let spring = 0.25 * STIFFNESS * faces.reference_area();
            let friction = Weakening::constant(self.friction);
            let state = PointState {
                stretch: Vec3::new(2e-6, 1e-6, 0.0),
                ..PointState::of_spring([1e-3; 2], spring, friction)
            };
            let [a, b] = [&kinematics[0], &kinematics[1]];
            let evaluated = evaluate(&LAW, &faces, [a, b], &[state; POINTS])?;
            Some((evaluated, tangents(&LAW, &faces, [a, b], &[state; POINTS])?))
        }

        fn total(&self, poses: &[Pose; 2]) -> ([f64; 12], f64) {
            let (points, _) = self.evaluate(poses).expect("a patch");
            let wrench = std::array::from_fn(|k| points.iter().map(|e| e.wrench[k]).sum());
            (wrench, points.iter().map(|e| e.energy).sum())
        }
    }

    /// The upper box at this place of its centre over the lower one's top [m], turned by this.
    fn poses(x: f64, y: f64, depth: f64, turn: [f64; 3]) -> [Pose; 2] {
        let upper = Rotation::from_scaled_axis(Vec3::from(turn));
        [Pose::identity(), Pose::new(Vec3::new(x, y, 0.02 - depth), upper)]
    }

    fn moved(poses: &[Pose; 2], k: usize, h: f64) -> [Pose; 2] {
        let mut motion = [Vec3::zeros(); 3];
        motion[k / 3][k % 3] = h;
        let [shift, spin, other] = motion;
        [poses[0].moved(&Vec3::zeros(), &other), poses[1].moved(&shift, &spin)]
    }

    const EQUAL: [[f64; 3]; 2] = [[0.03, 0.04, 0.02]; 2];
    const SMALL: [[f64; 3]; 2] = [[0.03, 0.04, 0.02], [0.02, 0.015, 0.02]];

    #[test]
    fn faces_of_a_box_are_its_own() {
        let boxes = Boxes::new(EQUAL, 0.0);
        assert_eq!(boxes.bodies[0].len(), 6);
        for face in &boxes.bodies[0] {
            let [x, y, z] = EQUAL[0];
            let expected = face.normal.abs().dot(&Vec3::new(y * z, x * z, x * y));
            assert!((face.area - expected).abs() < 1e-15, "{} {expected}", face.area);
            assert_eq!(face.ring.len(), 4);
        }
    }

    #[test]
    fn pressed_evenly_it_carries_the_area() {
        let boxes = Boxes::new(EQUAL, 0.0);
        let (wrench, energy) = boxes.total(&poses(0.006, -0.01, 1e-5, [0.0; 3]));
        let area = 0.024 * 0.03;
        assert!((wrench[8] / (STIFFNESS * area * 1e-5) - 1.0).abs() < 1e-9);
        assert!((energy / (0.5 * STIFFNESS * area * 1e-10) - 1.0).abs() < 1e-9);
        // Through the middle of the area, which is at x = 3 mm, y = -5 mm.
        assert!((wrench[3] / wrench[2] + 5e-3).abs() < 1e-9 && (wrench[4] / wrench[2] + 3e-3).abs() < 1e-9);
    }

    #[test]
    fn a_tilted_face_presses_by_its_wedge() {
        // Turned about y by t, the upper box's face is deeper by t x: a wedge that ends where the depth does.
        let (boxes, tilt, depth) = (Boxes::new(EQUAL, 0.0), 9e-4, 6e-6);
        let (wrench, _) = boxes.total(&poses(0.0, 0.0, depth, [0.0, tilt, 0.0]));
        let reach = 0.015 + depth / tilt;
        let expected = 0.5 * STIFFNESS * tilt * reach * reach * 0.04;
        assert!((wrench[8] / expected - 1.0).abs() < 1e-3, "{} {expected}", wrench[8]);
    }

    #[test]
    fn tangent_is_derivative_of_force() {
        for friction in [0.0, 0.1, 0.65] {
            for (sizes, at) in [
                (SMALL, poses(1e-3, 2e-3, 2e-5, [1e-4, 2e-4, 0.4])),
                (EQUAL, poses(4e-3, 7e-3, 1e-5, [2e-4, -3e-4, 0.2])),
                // Part of the face is open, and the weight fades.
                (EQUAL, poses(4e-3, 7e-3, 1e-5, [2e-2, -4e-2, 0.2])),
            ] {
                let boxes = Boxes::new(sizes, friction);
                let (_, exact) = boxes.evaluate(&at).expect("a patch");
                for k in 0..9 {
                    let h = if k < 3 { 1e-10 } else { 1e-8 };
                    let (plus, minus) =
                        (boxes.evaluate(&moved(&at, k, h)), boxes.evaluate(&moved(&at, k, -h)));
                    let (plus, minus) = (plus.expect("a patch").0, minus.expect("a patch").0);
                    for (point, exact) in exact.iter().enumerate() {
                        for i in 0..12 {
                            let difference = (plus[point].wrench[i] - minus[point].wrench[i]) / (2.0 * h);
                            let arms = [i % 6, k].map(|c| if c < 3 { 1.0 } else { 2e-2 });
                            let scale = STIFFNESS * 1e-4 * arms[0] * arms[1];
                            assert!(
                                (difference - exact[i][k]).abs() < 2e-4 * scale,
                                "mu {friction} point {point} component {i} motion {k}: {difference} {}",
                                exact[i][k]
                            );
                        }
                    }
                }
            }
        }
    }

    /// Where a face lies within the other one and presses everywhere its area is no variable, and the energy has all the force.
    #[test]
    fn force_is_derivative_of_energy_at_a_given_area() {
        let boxes = Boxes::new(SMALL, 0.0);
        for (depth, turn) in [(6e-5, [1e-4, 2e-4, 0.4]), (1.2e-3, [2e-2, 3.5e-2, 0.4])] {
            let at = poses(1e-3, 2e-3, depth, turn);
            let (wrench, _) = boxes.total(&at);
            for k in 0..9 {
                let h = if k < 3 { 1e-9 } else { 1e-7 };
                let slope =
                    (boxes.total(&moved(&at, k, h)).1 - boxes.total(&moved(&at, k, -h)).1) / (2.0 * h);
                let work = wrench[if k < 6 { 6 + k } else { k - 3 }];
                let scale = wrench[8] * if k < 3 { 1.0 } else { 1e-2 };
                assert!((slope + work).abs() < 1e-5 * scale, "motion {k}: {slope} {work}");
            }
        }
    }

    #[test]
    fn friction_resists_sliding_and_spinning() {
        let boxes = Boxes::new(EQUAL, 0.5);
        let (slid, _) = boxes.total(&poses(1e-4, 0.0, 1e-5, [0.0; 3]));
        // The stretch that it began with turns the force by a hundredth.
        assert!((slid[6] / (0.5 * slid[8]) + 1.0).abs() < 1e-3, "{} {}", slid[6], slid[8]);
        let (spun, _) = boxes.total(&poses(0.0, 0.0, 1e-5, [0.0, 0.0, 0.05]));
        // Mean distance from the middle of a rectangle of 30 by 40 mm: 13.5 mm; four points at 12.2 and 16.3 mm of it.
        assert!((spun[11] / (0.5 * spun[8]) + 13.5e-3).abs() < 1e-3, "{} {}", spun[11], spun[8]);
    }

    /// Force and moment change by no more than in proportion to the step.
    #[test]
    fn forces_are_continuous_over_rims_and_tilts() {
        let boxes = Boxes::new(EQUAL, 0.3);
        let ways: [&dyn Fn(f64) -> [Pose; 2]; 3] = [
            &|t| poses(-0.029 + 0.058 * t, 0.004, 1e-5, [2e-4, 3e-4, 0.3]),
            &|t| poses(2e-3, 0.004, 1e-5, [0.0, 0.12 * t, 0.0]),
            &|t| poses(2e-3, 0.004, 1e-5, [-0.11 * t, 0.05 - 0.1 * t, 0.2]),
        ];
        for (number, way) in ways.iter().enumerate() {
            let largest = |steps: usize| {
                let at = |i: usize| boxes.evaluate(&way(i as f64 / steps as f64));
                let total = |i: usize| -> [f64; 12] {
                    at(i).map_or([0.0; 12], |(points, _)| {
                        std::array::from_fn(|k| points.iter().map(|e| e.wrench[k]).sum())
                    })
                };
                let all: Vec<[f64; 12]> = (0..=steps).map(total).collect();
                let jump = |w: &[[f64; 12]]| (6..12).map(|k| (w[1][k] - w[0][k]).abs()).fold(0.0, f64::max);
                all.windows(2).map(jump).fold(0.0, f64::max)
            };
            let (coarse, fine) = (largest(500), largest(4000));
            assert!(coarse > 0.0 && fine < 0.2 * coarse, "way {number}: {coarse} {fine}");
        }
    }
}
