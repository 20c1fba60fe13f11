//! The force of one contact point and its tangent.
//!
//! Normal part: `w s N(overlap)`, plus the gradient of the weight `w` times the energy stored per weight:
//! `-d/dq [ w s psi(overlap) ]`, a plain spring. Where the bodies' own flexibility is in the gap, a compliance stands behind the
//! spring (both together are the penalty, `stiffness`) and `offset` is what it gave under the force of the last
//! augmentation. The spring keeps its own law, onset and bend included, so that at rest that law is left, and
//! energies are the spring's (`assembly::elastic`). Friction: the trial
//! force `k_t w (stretch - slide)` is bent smoothly onto the disc of radius `mu w p`, `p` being the
//! normal force of the same configuration (implicit, never lagged). The bend is elastic; only what
//! the stretch exceeds the end of the bend by slips, so that repeating a step changes nothing. `mu` weakens with the slip
//! of the present step too (`law::Weakening`), solved for together with it.

use crate::contact::corner::CornerWeight;
use crate::contact::features::{LinePair, Site, closest_points};
use crate::contact::law::{ContactLaw, Weakening};
use crate::tensor::dual::{Dual, Real, Vector};
use crate::tensor::{Mat3, Vec3};

/// Where a body is now and where it was at the last accepted increment.
#[derive(Debug, Clone, Copy)]
pub struct Kinematics {
    /// Reference point now [m].
    pub position: Vec3,
    /// Reference point at the last accepted increment [m].
    pub committed_position: Vec3,
    /// Turns a vector now back to what it was: committed rotation times inverse of the present one.
    pub turn_back: Mat3,
}

/// What a contact point carries into a Newton solve; constant during it.
#[derive(Debug, Clone, Copy)]
pub struct PointState {
    /// Sum of the two rounding radii [m].
    pub radii: f64,
    /// Radius of `a` less that of `b` [m].
    pub radius_difference: f64,
    /// Normal stiffness during a Newton solve [N/m]: the spring, or a softer penalty.
    pub stiffness: f64,
    /// Stiffness of the contact's own spring [N/m], which is what stores energy here.
    pub spring: f64,
    pub friction: Weakening,
    /// Normal force of the last augmentation over the weight, times the penalty's compliance beyond
    /// the spring's [m].
    pub offset: f64,
    /// Tangential stretch carried over [m], in space; times the tangential stiffness it is the
    /// friction force at no further slide, on `b`.
    pub stretch: Vec3,
    /// Cosines of the corners' cones where a vertex meets a vertex and both are sharp. Each side's second site point is then its
    /// corner's axis away from the vertex.
    pub corners: Option<[f64; 2]>,
    /// Elastic displacement of `b`'s surface relative to `a`'s here [m], in space.
    pub elastic: Vec3,
    /// The part of it that came since the last accepted increment [m].
    pub elastic_change: Vec3,
    /// Overlap besides [m]; see [`crate::contact::memory::PointMemory::lead`].
    pub lead: f64,
    /// Where the contact's force is an unknown: compliance behind the spring per force, weight included [m/N], in all directions; and what
    /// it gave under the unknown force [m], in space, which it gives back. Where the two forces agree nothing of it is left.
    pub compliance: f64,
    pub given: Vec3,
    /// Whether it hardens before the cores meet ([`ContactLaw::hardening`]): where a body can break.
    pub hardens: bool,
}

impl PointState {
    /// Compliance that stands behind the spring, over the spring's own; zero for two rigid bodies.
    fn behind(&self) -> f64 {
        self.spring / self.stiffness - 1.0
    }

    /// The part of an evaluation's stretch that is the spring's own [m].
    pub fn own_stretch(&self, law: &ContactLaw, e: &Evaluation) -> Vec3 {
        let shared = 1.0 / self.stiffness - 1.0 / self.spring;
        e.stretch - e.friction * (shared / (e.weight * law.tangential_ratio) + self.compliance)
    }
}

/// A contact point in one configuration.
#[derive(Debug, Clone, Copy)]
pub struct Evaluation {
    /// 0 to 1; below 1 only for edge pairs near an edge's end or nearly parallel, and for vertex pairs.
    pub weight: f64,
    /// Distance between the rounded surfaces, elastic displacement included [m].
    pub gap: f64,
    /// From `a` to `b`.
    pub normal: Vec3,
    /// Where the force acts [m].
    pub point: Vec3,
    /// Normal force, weight included [N].
    pub pressure: f64,
    /// Friction force on `b` [N].
    pub friction: Vec3,
    /// Friction coefficient in force.
    pub coefficient: f64,
    /// Its mean over the slip of the step, over its present value.
    pub mean_coefficient: f64,
    /// Normal force over the weight [N].
    pub load: f64,
    /// Tangential stretch had nothing slipped [m].
    pub trial_stretch: Vec3,
    /// What is left of it when the excess over the bound has slipped [m].
    pub stretch: Vec3,
    /// Energy stored in the tangential stretch [J].
    pub tangential_energy: f64,
    /// Energy of the normal part [J].
    pub energy: f64,
    /// Force and moment about the body's reference point on `a`, then on `b` [N, N m].
    pub wrench: [f64; 12],
}

impl Evaluation {
    pub fn is_active(&self) -> bool {
        self.pressure > 0.0
    }

    /// Whether the friction force is at its bound.
    pub fn slides(&self) -> bool {
        self.friction.norm() > (1.0 - 1e-6) * self.coefficient * self.pressure
    }

    /// Slip in the step [m].
    pub fn slip(&self) -> f64 {
        (self.trial_stretch - self.stretch).norm()
    }
}

/// Derivative of the twelve wrench components by: position of `b` relative to `a` (0-2), spin of
/// `b` (3-5), spin of `a` (6-8). Moving `a` is moving `b` the other way.
pub type Tangent = [[f64; 9]; 12];

/// The bodies' points that span the site, in space.
pub struct SitePoints {
    pub a: [Vec3; 3],
    pub b: [Vec3; 3],
}

pub fn evaluate(
    law: &ContactLaw,
    site: &Site,
    points: &SitePoints,
    a: &Kinematics,
    b: &Kinematics,
    state: &PointState,
) -> Evaluation {
    let frame =
        |k: &Kinematics| Frame { position: Vector::constant(&k.position), spin: None, kinematics: *k };
    let constants =
        |p: &[Vec3; 3]| [Vector::constant(&p[0]), Vector::constant(&p[1]), Vector::constant(&p[2])];
    let (on_a, on_b) = (constants(&points.a), constants(&points.b));
    wrench::<f64>(law, site, &on_a, &on_b, [&frame(a), &frame(b)], &Vector::zero(), state).0
}

/// Where a contact's force acts [m] and its normal from `a` to `b`.
pub fn place(site: &Site, points: &SitePoints, radius_difference: f64) -> (Vec3, Vec3) {
    let constants = |p: &[Vec3; 3]| p.map(|x| Vector::<f64>::constant(&x));
    let (xa, xb) = closest_points(site, &constants(&points.a), &constants(&points.b));
    let (xa, xb) = (xa.value(), xb.value());
    let normal = (xb - xa).normalize();
    (0.5 * (xa + xb + normal * radius_difference), normal)
}

/// As [`Tangent`] with the force on `b` (normal and friction alone) behind the wrench, by the same nine and by the
/// elastic displacement of `b`'s surface relative to `a`'s (9-11).
pub type ElasticTangent = [[f64; 12]; 15];

/// The exact derivative of [`evaluate`]'s wrench.
pub fn tangent(
    law: &ContactLaw,
    site: &Site,
    points: &SitePoints,
    a: &Kinematics,
    b: &Kinematics,
    state: &PointState,
) -> Tangent {
    derivative::<9>(law, site, points, a, b, state).0.map(|component| component.gradient)
}

/// The exact derivative of wrench and force where the elastic displacement is unknown as well.
pub fn elastic_tangent(
    law: &ContactLaw,
    site: &Site,
    points: &SitePoints,
    a: &Kinematics,
    b: &Kinematics,
    state: &PointState,
) -> ElasticTangent {
    let (wrench, force) = derivative::<12>(law, site, points, a, b, state);
    std::array::from_fn(|k| if k < 12 { wrench[k].gradient } else { force.0[k - 12].gradient })
}

/// Wrench and force on `b` with their derivatives by the first `N` of position and spin of `b`, spin of `a`, and
/// elastic displacement.
fn derivative<const N: usize>(
    law: &ContactLaw,
    site: &Site,
    points: &SitePoints,
    a: &Kinematics,
    b: &Kinematics,
    state: &PointState,
) -> ([Dual<N>; 12], Vector<Dual<N>>) {
    let variables = |base: &Vec3, first: usize| {
        Vector([0, 1, 2].map(|k| {
            if first + k < N { Dual::<N>::variable(base[k], first + k) } else { Dual::constant(base[k]) }
        }))
    };
    let spin_a = variables(&Vec3::zeros(), 6);
    let spin_b = variables(&Vec3::zeros(), 3);
    let shift_b = variables(&Vec3::zeros(), 0);
    let displaced = variables(&Vec3::zeros(), 9);
    let frame_a = Frame { position: Vector::constant(&a.position), spin: Some(spin_a), kinematics: *a };
    let frame_b =
        Frame { position: Vector::constant(&b.position) + shift_b, spin: Some(spin_b), kinematics: *b };
    let points_of = |points: &[Vec3; 3], frame: &Frame<Dual<N>>, spin: Vector<Dual<N>>| {
        points.map(|p| {
            let arm = Vector::constant(&(p - frame.kinematics.position));
            frame.position + arm + spin.cross(arm)
        })
    };
    let on_a = points_of(&points.a, &frame_a, spin_a);
    let on_b = points_of(&points.b, &frame_b, spin_b);
    let (_, wrench, force) = wrench(law, site, &on_a, &on_b, [&frame_a, &frame_b], &displaced, state);
    (wrench, force)
}

struct Frame<T> {
    position: Vector<T>,
    /// Infinitesimal rotation away from the present one; `None` where it is zero.
    spin: Option<Vector<T>>,
    kinematics: Kinematics,
}

impl<T: Real> Frame<T> {
    /// Where the material point that is now at `x` was at the last accepted increment.
    fn committed(&self, x: Vector<T>) -> Vector<T> {
        let mut arm = x - self.position;
        if let Some(spin) = self.spin {
            arm = arm - spin.cross(arm);
        }
        Vector::constant(&self.kinematics.committed_position) + arm.turned_by(&self.kinematics.turn_back)
    }
}

/// The contact with the elastic displacement `displaced` on top of the state's; its wrench, and the force on `b` but
/// for the weight's gradient.
fn wrench<T: Real>(
    law: &ContactLaw,
    site: &Site,
    a: &[Vector<T>; 3],
    b: &[Vector<T>; 3],
    [frame_a, frame_b]: [&Frame<T>; 2],
    displaced: &Vector<T>,
    state: &PointState,
) -> (Evaluation, [T; 12], Vector<T>) {
    let zero = T::constant(0.0);
    let is_edge_pair = site.count_a == 2 && site.count_b == 2;
    let (xa, xb) = closest_points(site, a, b);
    let difference = xb - xa;
    let distance = difference.norm();
    let normal = difference.times(T::constant(1.0) / distance);
    let elastic = Vector::constant(&state.elastic) + *displaced;
    let overlap = T::constant(state.radii) - distance - normal.dot(elastic) + T::constant(state.lead);
    // Halfway between the rounded surfaces, not between the cores.
    let point = (xa + xb + normal.times(T::constant(state.radius_difference))).times(T::constant(0.5));
    let lines = is_edge_pair.then(|| LinePair::new(a, b));
    let edge_weight = lines.as_ref().map(|l| l.weight(law));
    let axes = [a[1] - a[0], b[1] - b[0]];
    let corner_weight = state.corners.map(|cosines| CornerWeight::new(normal, axes, cosines));
    let weight = match (&edge_weight, &corner_weight) {
        (Some(edge), _) => edge.value,
        (None, Some(corner)) => corner.value,
        (None, None) => T::constant(1.0),
    };

    let given = Vector::constant(&state.given);
    let pushed = overlap + T::constant(state.offset) + normal.dot(given);
    let behind = T::constant(state.behind()) + weight.scaled(state.spring * state.compliance);
    let linear = law.normal_behind(pushed, behind).scaled(state.spring);
    let alone = state.behind() == 0.0 && state.compliance == 0.0;
    let hardened = law.hardening(overlap, state.radii).filter(|_| state.hardens && alone);
    let load = hardened.map_or(linear, |[more, _]| linear + more.scaled(state.spring));
    let pressure = weight * load;
    let mut evaluation = Evaluation {
        weight: weight.value(),
        gap: -overlap.value(),
        normal: normal.value(),
        point: point.value(),
        pressure: pressure.value(),
        friction: Vec3::zeros(),
        coefficient: state.friction.coefficient,
        mean_coefficient: 1.0,
        load: load.value(),
        trial_stretch: Vec3::zeros(),
        stretch: Vec3::zeros(),
        tangential_energy: 0.0,
        energy: 0.0,
        wrench: [0.0; 12],
    };
    if pressure.value() <= 0.0 {
        return (evaluation, [zero; 12], Vector::zero());
    }

    let mut force_on_b = normal.times(pressure);
    if state.friction.coefficient > 0.0 {
        let one = T::constant(1.0);
        let tangential_spring = state.spring * law.tangential_ratio;
        let behind = T::constant(state.behind()) + weight.scaled(tangential_spring * state.compliance);
        let spring = weight.scaled(tangential_spring);
        let stiffness = spring / (one + behind);
        let slide = frame_a.committed(point) - frame_b.committed(point)
            + Vector::constant(&(state.elastic_change - state.given))
            + *displaced;
        let tangential = |v: Vector<T>| v - normal.times(v.dot(normal));
        let trial = carried_over(&state.stretch, normal) - tangential(slide);
        let trial_length = trial.norm();
        let mut bound = pressure.scaled(state.friction.coefficient);
        let most = 1.0 + law.friction_blend;
        // The trial force over the bound at which the contact starts to slip, compliance behind the spring included.
        let slips_at = (T::constant(most) + behind) / (one + behind);
        if state.friction.excess > 0.0
            && stiffness.value() * trial_length.value() > slips_at.value() * bound.value()
            && trial_length.value() > 0.0
        {
            let slipped = state.friction.slipped(trial_length, pressure * slips_at / stiffness);
            bound = pressure * slipped.coefficient;
            evaluation.coefficient = slipped.coefficient.value();
            evaluation.mean_coefficient = slipped.mean / evaluation.coefficient;
        }
        // Trial force of the spring in units of what the bound can hold.
        let mut share = 0.0;
        let friction = if trial_length.value() > 0.0 {
            let x = law.share_behind(spring * trial_length / bound, behind);
            share = x.value();
            if share <= 1.0 - law.friction_blend {
                trial.times(stiffness)
            } else {
                trial.times(bound * law.friction_share(x) / trial_length)
            }
        } else {
            trial.times(stiffness)
        };
        force_on_b = force_on_b + friction;
        evaluation.friction = friction.value();
        evaluation.trial_stretch = trial.value();
        let behind = behind.value();
        evaluation.stretch =
            if share > most { trial.value() * ((most + behind) / (share + behind)) } else { trial.value() };
        evaluation.tangential_energy =
            bound.value().powi(2) / spring.value() * law.friction_energy(share.min(most));
    }
    let arm_a = point - frame_a.position;
    let arm_b = point - frame_b.position;
    let mut force_a = -force_on_b;
    let mut moment_a = arm_a.cross(force_a);
    let mut force_b = force_on_b;
    let mut moment_b = arm_b.cross(force_b);

    let excess = law.energy_at(linear.scaled(1.0 / state.spring)).scaled(state.spring);
    let excess = hardened.map_or(excess, |[_, more]| excess + more.scaled(state.spring));
    evaluation.energy = (weight * excess).value();
    if let (Some(lines), Some(edge_weight)) = (&lines, &edge_weight)
        && edge_weight.value.value() < 1.0
    {
        let gradient = lines.end_point_gradient(edge_weight, difference);
        for (k, g) in gradient.iter().enumerate() {
            let push = -g.times(excess);
            if k < 2 {
                force_a = force_a + push;
                moment_a = moment_a + (a[k] - frame_a.position).cross(push);
            } else {
                force_b = force_b + push;
                moment_b = moment_b + (b[k - 2] - frame_b.position).cross(push);
            }
        }
    }
    if let Some(corner) = corner_weight.filter(|corner| corner.value.value() < 1.0) {
        let across = corner.by_normal - normal.times(corner.by_normal.dot(normal));
        let push = -across.times(excess / distance);
        force_b = force_b + push;
        moment_b = moment_b + (b[0] - frame_b.position).cross(push);
        force_a = force_a - push;
        moment_a = moment_a - (a[0] - frame_a.position).cross(push);
        moment_a = moment_a - axes[0].cross(corner.by_axes[0]).times(excess);
        moment_b = moment_b - axes[1].cross(corner.by_axes[1]).times(excess);
    }
    let mut all = [zero; 12];
    for (part, vector) in all.chunks_exact_mut(3).zip([force_a, moment_a, force_b, moment_b]) {
        part.copy_from_slice(&vector.0);
    }
    evaluation.wrench = all.map(T::value);
    (evaluation, all, force_on_b)
}

/// The stretch of the last accepted increment in the present tangent plane, its length kept.
fn carried_over<T: Real>(stretch: &Vec3, normal: Vector<T>) -> Vector<T> {
    let length = stretch.norm();
    if length == 0.0 {
        return Vector::zero();
    }
    let old = Vector::constant(stretch);
    let projected = old - normal.times(old.dot(normal));
    let projected_length = projected.norm();
    if projected_length.value() < 1e-3 * length {
        return Vector::zero();
    }
    projected.times(T::constant(length) / projected_length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::features::Feature;
    use crate::tensor::Pose;

    const LAW: ContactLaw = ContactLaw { fade_length: 2e-3, parallel_limit: 0.5, ..ContactLaw::SAMPLE };

    struct Scene {
        site: Site,
        body_a: [Vec3; 3],
        body_b: [Vec3; 3],
        committed: [Pose; 2],
        state: PointState,
    }

    impl Scene {
        /// Shifts `b` along the normal until the rounded bodies overlap by 20 um.
        fn pressed(mut self) -> Self {
            for _ in 0..5 {
                let (e, _) = self.evaluate_at(&self.committed);
                self.committed[1].position -= e.normal * (e.gap + 2e-5);
            }
            self
        }

        fn evaluate_at(&self, poses: &[Pose; 2]) -> (Evaluation, Tangent) {
            let kinematics = [0, 1].map(|i| Kinematics {
                position: poses[i].position,
                committed_position: self.committed[i].position,
                turn_back: (self.committed[i].rotation * poses[i].rotation.inverse())
                    .to_rotation_matrix()
                    .into_inner(),
            });
            let points = SitePoints {
                a: self.body_a.map(|p| poses[0].to_space(&p)),
                b: self.body_b.map(|p| poses[1].to_space(&p)),
            };
            let [a, b] = &kinematics;
            (
                evaluate(&LAW, &self.site, &points, a, b, &self.state),
                tangent(&LAW, &self.site, &points, a, b, &self.state),
            )
        }
    }

    fn state(friction: f64) -> PointState {
        let friction = Weakening::constant(friction);
        PointState {
            radii: 1e-3,
            radius_difference: 4e-4,
            stiffness: 6e7,
            spring: 3e8,
            friction,
            offset: 4e-6,
            stretch: Vec3::new(2e-6, 1e-6, -1e-6),
            corners: None,
            elastic: Vec3::new(1e-7, 2e-7, -3e-7),
            elastic_change: Vec3::new(1e-7, 0.0, 1e-7),
            lead: 0.0,
            compliance: 0.0,
            given: Vec3::zeros(),
            hardens: true,
        }
    }

    fn edges(friction: f64) -> Scene {
        Scene {
            site: Site {
                feature: Feature::Edges(0, 0),
                on_a: [0, 1, 0],
                on_b: [0, 1, 0],
                count_a: 2,
                count_b: 2,
            },
            body_a: [Vec3::new(-8e-4, 1e-4, 0.0), Vec3::new(9e-3, -3e-4, 2e-4), Vec3::zeros()],
            body_b: [Vec3::new(1e-4, -7e-4, 2e-4), Vec3::new(2e-3, 9e-3, -3e-4), Vec3::zeros()],
            committed: [
                Pose::identity(),
                Pose::identity().moved(&Vec3::new(0.0, 0.0, 0.94e-3), &Vec3::new(0.01, 0.02, 0.03)),
            ],
            state: state(friction),
        }
        .pressed()
    }

    fn vertex_on_facet(friction: f64) -> Scene {
        Scene {
            site: Site {
                feature: Feature::VertexOfB(0),
                on_a: [0, 1, 2],
                on_b: [0, 0, 0],
                count_a: 3,
                count_b: 1,
            },
            body_a: [Vec3::new(-5e-3, -4e-3, 1e-3), Vec3::new(6e-3, -3e-3, 0.0), Vec3::new(0.0, 7e-3, 5e-4)],
            body_b: [Vec3::new(3e-4, 1e-3, -1e-2), Vec3::zeros(), Vec3::zeros()],
            committed: [
                Pose::identity(),
                Pose::identity().moved(&Vec3::new(0.0, 0.0, 1.136e-2), &Vec3::new(0.01, 0.0, 0.02)),
            ],
            state: state(friction),
        }
        .pressed()
    }

    /// Two corners, the direction between them in the fade of both.
    fn vertex_on_vertex(friction: f64) -> Scene {
        let axis = |x: f64, z: f64| Vec3::new(x, 0.1, z).normalize();
        let (vertex_a, vertex_b) = (Vec3::new(2e-3, 1e-3, 5e-3), Vec3::new(-1e-3, 2e-3, -6e-3));
        Scene {
            site: Site { feature: Feature::VertexOfA(0), on_a: [0; 3], on_b: [0; 3], count_a: 1, count_b: 1 },
            body_a: [vertex_a, vertex_a + axis(0.55, 1.0), Vec3::zeros()],
            body_b: [vertex_b, vertex_b + axis(0.5, -1.0), Vec3::zeros()],
            committed: [Pose::identity(), Pose::new(Vec3::new(3e-3, -1e-3, 1.2e-2), Default::default())],
            state: PointState { corners: Some([0.75, 0.8]), ..state(friction) },
        }
        .pressed()
    }

    fn motion(k: usize, step: f64) -> ([Vec3; 2], [Vec3; 2]) {
        let mut shift = [Vec3::zeros(); 2];
        let mut spin = [Vec3::zeros(); 2];
        match k {
            0..3 => shift[1][k] = step,
            3..6 => spin[1][k - 3] = step,
            _ => spin[0][k - 6] = step,
        }
        (shift, spin)
    }

    fn moved(scene: &Scene, poses: &[Pose; 2], k: usize, step: f64) -> (Evaluation, Tangent) {
        let (shift, spin) = motion(k, step);
        scene.evaluate_at(&[poses[0].moved(&shift[0], &spin[0]), poses[1].moved(&shift[1], &spin[1])])
    }

    #[test]
    fn tangent_is_derivative_of_force() {
        let weakening = |excess: f64, distance: f64| Weakening { coefficient: 0.1, excess, distance };
        for friction in [
            Weakening::constant(0.0),
            Weakening::constant(0.05),
            Weakening::constant(0.65),
            weakening(0.08, 5e-6),
            weakening(0.08, 2e-8),
        ] {
            for mut scene in [edges(0.05), vertex_on_facet(0.05), vertex_on_vertex(0.05)] {
                scene.state.friction = friction;
                let poses = [
                    scene.committed[0].moved(&Vec3::new(1e-6, 0.0, 0.0), &Vec3::new(1e-4, 0.0, 2e-4)),
                    scene.committed[1].moved(&Vec3::new(0.0, 2e-6, -1e-6), &Vec3::new(0.0, 1e-4, 0.0)),
                ];
                let (evaluation, tangent) = scene.evaluate_at(&poses);
                assert!(evaluation.is_active(), "gap {}", evaluation.gap);
                for k in 0..9 {
                    let h = if k < 3 { 1e-10 } else { 1e-8 };
                    let (plus, _) = moved(&scene, &poses, k, h);
                    let (minus, _) = moved(&scene, &poses, k, -h);
                    for i in 0..12 {
                        let difference = (plus.wrench[i] - minus.wrench[i]) / (2.0 * h);
                        let scale = 6e7 * if k < 3 { 1.0 } else { 1e-2 } * if i % 6 < 3 { 1.0 } else { 1e-2 };
                        assert!(
                            (difference - tangent[i][k]).abs() < 2e-4 * scale,
                            "{friction:?} component {i} motion {k}: {difference} {}",
                            tangent[i][k]
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn force_is_derivative_of_energy_without_friction() {
        for mut scene in [edges(0.0), vertex_on_facet(0.0), vertex_on_vertex(0.0)] {
            // The elastic displacement is held while the normal turns, which is not an energy.
            scene.state.elastic = Vec3::zeros();
            scene.state.offset = 0.0;
            scene.state.spring = scene.state.stiffness;
            let poses = scene.committed;
            let (evaluation, _) = scene.evaluate_at(&poses);
            assert!(evaluation.is_active() && evaluation.weight < 1.0 + 1e-15);
            for k in 0..9 {
                let h = if k < 3 { 1e-9 } else { 1e-7 };
                let (plus, _) = moved(&scene, &poses, k, h);
                let (minus, _) = moved(&scene, &poses, k, -h);
                let slope = (plus.energy - minus.energy) / (2.0 * h);
                let work = match k {
                    0..6 => evaluation.wrench[6 + k],
                    _ => evaluation.wrench[3 + k - 6],
                };
                let scale = evaluation.pressure * if k < 3 { 1.0 } else { 1e-2 };
                assert!((slope + work).abs() < 1e-4 * scale, "motion {k}: {slope} {work}");
            }
        }
    }

    #[test]
    fn repeated_augmentations_end_at_the_spring_law() {
        for mut scene in [edges(0.05), edges(0.65), vertex_on_facet(0.05), vertex_on_facet(0.65)] {
            let (soft, spring) = (scene.state.stiffness, scene.state.spring);
            // In the tangent plane: what turns into it keeps its length, sums of such do not.
            let normal = scene.evaluate_at(&scene.committed).0.normal;
            let own = scene.state.stretch - normal * scene.state.stretch.dot(&normal);
            scene.state.stretch = own;
            scene.state.stiffness = spring;
            scene.state.offset = 0.0;
            let (plain, _) = scene.evaluate_at(&scene.committed);
            scene.state.stiffness = soft;
            let shared = 1.0 / soft - 1.0 / spring;
            for _ in 0..200 {
                let (e, _) = scene.evaluate_at(&scene.committed);
                scene.state.offset = shared * e.load;
                scene.state.stretch = own + e.friction * (shared / (e.weight * LAW.tangential_ratio));
            }
            let (augmented, _) = scene.evaluate_at(&scene.committed);
            let relative = |a: f64, b: f64| (a - b).abs() / plain.pressure;
            assert!(relative(augmented.pressure, plain.pressure) < 1e-9);
            for k in 0..12 {
                let arm = if k % 6 < 3 { 1.0 } else { 1e-2 };
                let off = relative(augmented.wrench[k], plain.wrench[k]);
                assert!(off < 1e-6 * arm, "component {k}: {off}");
            }
            let stored = |e: &Evaluation| e.energy + e.tangential_energy;
            assert!((stored(&augmented) - stored(&plain)).abs() < 1e-6 * stored(&plain));
            assert!((augmented.energy - plain.energy).abs() < 1e-9 * plain.energy);
        }
    }

    #[test]
    fn forces_balance_and_obey_the_cone() {
        for scene in [edges(0.65), vertex_on_facet(0.2), vertex_on_vertex(0.4)] {
            let (e, _) = scene.evaluate_at(&scene.committed);
            let force = |first: usize| Vec3::new(e.wrench[first], e.wrench[first + 1], e.wrench[first + 2]);
            assert!((force(0) + force(6)).norm() < 1e-9 * e.pressure);
            let turn = |first: usize, body: usize| {
                scene.committed[body].position.cross(&force(first)) + force(first + 3)
            };
            assert!((turn(0, 0) + turn(6, 1)).norm() < 1e-9 * e.pressure);
            assert!(e.friction.norm() <= e.coefficient * e.pressure * (1.0 + 1e-12));
            assert!(e.friction.dot(&e.normal).abs() < 1e-9 * e.pressure);
        }
    }
}
