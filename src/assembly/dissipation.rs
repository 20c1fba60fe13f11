//! Work that friction takes in a step.
//!
//! Slip times the mean force at which it slips is most of it: the coefficient's mean over the slip, and the load's from where slip begins.
//! The rest is what the tangential stretch of a contact stores and gives up without work, since its energy depends on more
//! than the stretch. With the stretch s, the largest friction force b over the weight, the weight w, and the tangential
//! stiffness k over the weight
//!
//! ```text
//! E = w e,    e = b^2 / k  Psi(x),    x = k s / b
//! dE = T ds + e dw + w h db,    h = b / k (2 Psi - x S)
//! ```
//!
//! The first term is work; the others are none: `h` is zero while a contact sticks and positive in the elastic bend of the
//! friction law, and `w` fades where a contact slides off the end of an edge. Both are booked by the
//! trapezoidal rule. A contact that is lost gives up what it had stored, and its force, averaged with none, works along what its bodies
//! slid in touch.

use crate::assembly::{ContactPoint, PairWork};
use crate::contact::ContactLaw;
use crate::contact::asperity::AsperityState;
use crate::contact::force::Kinematics;
use crate::contact::memory::PointMemory;
use crate::contact::mortar::MortarNode;
use crate::contact::{Feature, patch};
use crate::model::Model;
use crate::tensor::Vec3;

/// Changes of an indentation by less than this share of it tell no mean force.
const RESOLVED: f64 = 1e-6;

/// The tangential stretch of a contact at one end of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Stretched {
    /// Largest friction force over the weight [N].
    bound: f64,
    weight: f64,
    /// Energy over the weight [J].
    energy: f64,
    /// Derivative of that by the bound at a given stretch [m].
    by_bound: f64,
}

impl Stretched {
    /// `stiffness` [N/m] is the tangential one over the weight, `stretch` [m] the spring's own.
    fn new(law: &ContactLaw, stiffness: f64, bound: f64, weight: f64, stretch: f64) -> Self {
        if bound <= 0.0 || stiffness <= 0.0 {
            return Stretched { bound, weight, energy: 0.0, by_bound: 0.0 };
        }
        let share = (stiffness * stretch / bound).min(1.0 + law.friction_blend);
        let psi = law.friction_energy(share);
        Stretched {
            bound,
            weight,
            energy: bound * bound / stiffness * psi,
            by_bound: bound / stiffness * (2.0 * psi - share * law.friction_share(share)),
        }
    }

    /// Energy that came between the two without work [J].
    fn gained_until(&self, end: &Stretched) -> f64 {
        let faded = 0.5 * (self.energy + end.energy) * (end.weight - self.weight);
        let by_bound = 0.5 * (self.weight * self.by_bound + end.weight * end.by_bound);
        faded + by_bound * (end.bound - self.bound)
    }
}

impl PairWork {
    /// Work lost to friction since the committed state [J], in the configuration last evaluated.
    pub(super) fn dissipation(&self, model: &Model, kinematics: &[Kinematics]) -> f64 {
        let keeps_force = self.keeps_force(model);
        let kept: f64 = self.active().map(|point| dissipated(&model.law, self, point, keeps_force)).sum();
        let is_lost = |memory: &&PointMemory| !self.active().any(|p| p.site.feature == memory.feature);
        let lost = self.carried.points.iter().filter(is_lost);
        let given_up: f64 = lost.map(|memory| self.given_up(model, kinematics, memory)).sum();
        // Nodes of a patch that has slid are others, and hold what the old ones nearest to them did.
        kept + given_up + self.moved
    }

    /// What a contact dissipated that is lost [J]: what it had stored, and the work of the force that it began with, averaged with none, along
    /// the pair's slide. All of that where others have taken over from it (a corner that slid off an edge); where the bodies are apart now the
    /// share of a straight way on which they were not.
    fn given_up(&self, model: &Model, kinematics: &[Kinematics], lost: &PointMemory) -> f64 {
        if lost.load <= 0.0 {
            return lost.tangential_energy;
        }
        let share = if self.active().next().is_some() {
            1.0
        } else {
            let radii = self.roundings(model);
            let pressed = self.indentation_for(model, lost.feature, lost.load, lost.depth);
            let of_node = |node: &MortarNode| self.springs.patch * node.area;
            let of_rigid = || match lost.feature {
                // What the two have in common was known while they touched; it is the smaller face at most.
                Feature::Faces(i, j, _) => {
                    let faces = [(self.a(), i), (self.b(), j)];
                    let areas = faces.map(|(body, k)| model.shapes[body].faces[k as usize].area);
                    self.springs.patch * areas[0].min(areas[1]) / patch::POINTS as f64
                }
                Feature::VertexOfA(_) | Feature::VertexOfB(_) | Feature::Edges(..) => self.springs.contact,
            };
            let spring = self.node(lost.feature).map_or_else(of_rigid, of_node);
            let by_spring = || model.law_at(lost.feature).overlap_for(lost.load / spring);
            let overlap = pressed.map_or_else(by_spring, |indentation| indentation - lost.depth);
            overlap / (overlap + (self.nearest - radii).max(0.0))
        };
        let [of_a, of_b] = [self.a(), self.b()].map(|body| kinematics[body].moved(&lost.place));
        let still_near = self.points.iter().find(|point| point.site.feature == lost.feature);
        let elastic = still_near.map_or_else(Vec3::zeros, |point| point.state.elastic_change);
        let force = lost.traction * (lost.pressure / lost.load);
        lost.tangential_energy + 0.5 * share * force.dot(&(of_a - of_b - elastic))
    }
}

/// What a contact dissipated since the committed state [J]; `keeps_force` where that, not its stretch, stayed when it got softer.
fn dissipated(law: &ContactLaw, pair: &PairWork, point: &ContactPoint, keeps_force: bool) -> f64 {
    let (state, e) = (&point.state, &point.evaluation);
    if e.coefficient <= 0.0 {
        return 0.0;
    }
    let stiffness = state.tangential_stiffness(law, e.grip);
    let at = |bound: f64, weight: f64, stretch: f64| Stretched::new(law, stiffness, bound, weight, stretch);
    let own = state.own_stretch(law, e);
    let end = at(e.coefficient * e.load, e.weight, own.norm());
    let slip = e.trial_stretch - e.stretch;
    let Some(memory) = pair.carried.point(point.site.feature).filter(|memory| memory.load > 0.0) else {
        let slid = 0.5 * e.mean_coefficient * e.friction.dot(&slip);
        return slid - at(0.0, e.weight, 0.0).gained_until(&end);
    };
    let left = if keeps_force { 1.0 } else { point.stiffness_left / memory.stiffness_left };
    let memory = memory.of_spring(left);
    let weight = memory.pressure / memory.load;
    // A patch that has grown holds the same force by less stretch, and energy.
    let before = state.tangential_stiffness(law, state.asperity.map_or(0.0, |asperity| asperity.grip));
    let held = memory.stretch.norm();
    let start = at(memory.bound, weight, held * before / stiffness);
    let stiffened = Stretched::new(law, before, memory.bound, weight, held).energy - start.energy;
    // What slips is at its bound, whatever its force was when the step began, and has turned into the direction of its slip; what stuck slips from where the
    // stretch and the bound, both on straight ways, meet.
    let along = own.try_normalize(0.0).unwrap_or_default();
    let ends = [e.carried_stretch.dot(&along), own.norm() + slip.norm()];
    let begins = slips_from(ends, own.norm(), memory.load / e.load);
    let bulge = state.asperity.map_or(0.0, |asperity| bulge(&asperity, memory.sprung(), e.indentation));
    let load = e.pressure
        + 0.5 * (1.0 - begins) * (memory.pressure - e.pressure)
        + 0.5 * (weight + e.weight) * (1.0 - begins) * (1.0 + 2.0 * begins) * bulge;
    let slid = e.mean_coefficient * e.coefficient * load * slip.norm();
    slid - start.gained_until(&end) + weight * stiffened
}

/// By how much the normal force [N] of an asperity is larger in a step, in the mean, than the mean of its ends: one that unloaded a little yields again as
/// rock before it goes on crushing. From the work on a straight way; between, as a parabola has it, `6 x (1 - x)` of this.
///
/// `sprung` is the force of the whole share at the start [N], `end` the indentation [m].
fn bulge(asperity: &AsperityState, sprung: f64, end: f64) -> f64 {
    let AsperityState { law, depth, share, .. } = asperity;
    let start = law.indentation_for(sprung / share, *depth);
    // Softer rock is crushed further by the force that it had.
    let depth = law.crushed(start, *depth);
    if (end - start).abs() < RESOLVED * end {
        return 0.0;
    }
    let [before, after] = [start, end].map(|indentation| law.press(indentation, depth));
    let crushing = law.work_of_crushing(law.crushed(end, depth)) - law.work_of_crushing(depth);
    let work = after.energy - before.energy + crushing;
    share * (work / (end - start) - 0.5 * (before.force + after.force))
}

/// The share of a step behind which a contact slips: `ends` are its stretches along the slip had nothing slipped, `held` is what is held of it at the end [m],
/// `before` the share of that which is held at the start.
fn slips_from(ends: [f64; 2], held: f64, before: f64) -> f64 {
    let [missing, slip] = [(before * held - ends[0]).max(0.0), ends[1] - held];
    if slip > 0.0 { missing / (missing + slip) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Asperity;

    const LAW: ContactLaw = ContactLaw::SAMPLE;

    fn at(bound: f64, weight: f64, stretch: f64) -> Stretched {
        Stretched::new(&LAW, 2e8, bound, weight, stretch)
    }

    /// Against sums over the way: one that reloads and then crushes, one that unloads, one that only just moves.
    #[test]
    fn an_asperity_bears_more_on_its_way_than_in_the_mean_of_its_ends() {
        let law = Asperity { modulus: 1.6e10, limit_pressure: 3e8, radius: 1e-3, spread: 1.0 };
        let asperity = AsperityState { law, depth: 2e-5, grip: 0.0, share: 0.7 };
        let limit = law.elastic_limit(asperity.depth);
        for [from, to] in [[0.9 * limit, 1.1 * limit], [limit, 0.8 * limit], [0.9 * limit, 0.9001 * limit]] {
            let force = |h: f64| 0.7 * law.press(h, 2e-5).force;
            let steps = 20_000;
            let at = |k: usize| from + (to - from) * (k as f64 + 0.5) / steps as f64;
            let mean = (0..steps).map(|k| force(at(k))).sum::<f64>() / steps as f64;
            let exact = mean - 0.5 * (force(from) + force(to));
            let found = bulge(&asperity, force(from), to);
            assert!((found - exact).abs() < 1e-6 * force(from), "{from} {to}: {found} {exact}");
        }
        // One that its rock has become softer under by a twentieth.
        let yielding = 0.7 * law.press(limit, 2e-5).force / 0.95;
        assert!(bulge(&asperity, yielding, 1.1 * limit).abs() < 1e-3 * yielding);
        assert!(bulge(&asperity, 0.7 * law.press(0.9 * limit, 2e-5).force, 1.1 * limit) > 0.0);
    }

    /// Stretch from 1 to 5, held up to 2 and in the end up to 3: they meet in a third of the way. One that slips from the start does so at once.
    #[test]
    fn slip_begins_where_the_stretch_meets_its_bound() {
        assert!((slips_from([1.0, 5.0], 3.0, 2.0 / 3.0) - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!(slips_from([2.5, 5.0], 3.0, 2.0 / 3.0), 0.0);
        assert_eq!(slips_from([1.0, 3.0], 3.0, 1.0), 0.0);
        // One that is stretched the other way has farther to go.
        assert!((slips_from([-1.0, 5.0], 2.0, 1.0) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn by_bound_is_derivative_of_energy() {
        // Sticking, in the bend, and at its end.
        for stretch in [1e-6, 2.45e-6, 2.6e-6] {
            let (bound, h) = (500.0, 1e-3);
            let slope = (at(bound + h, 1.0, stretch).energy - at(bound - h, 1.0, stretch).energy) / (2.0 * h);
            let exact = at(bound, 1.0, stretch).by_bound;
            assert!((slope - exact).abs() < 1e-6 * 2.5e-6, "{stretch}: {slope} {exact}");
            assert!(exact >= 0.0);
        }
        assert_eq!(at(500.0, 1.0, 1e-6).by_bound, 0.0);
    }

    /// A contact that slides while its load grows in n steps: work = energy + slip work - gain, to second order.
    #[test]
    fn work_is_stored_or_dissipated() {
        let (stiffness, most) = (2e8, 1.0 + LAW.friction_blend);
        let miss = |n: usize| {
            let force = |i: usize| 500.0 * (1.0 + i as f64 / n as f64);
            let stretch = |i: usize| most * force(i) / stiffness;
            let slip = 4e-6 / n as f64;
            let (mut work, mut slid, mut gained) = (0.0, 0.0, 0.0);
            for i in 0..n {
                let mean = 0.5 * (force(i) + force(i + 1));
                work += mean * (slip + stretch(i + 1) - stretch(i));
                slid += mean * slip;
                gained += at(force(i), 1.0, stretch(i)).gained_until(&at(force(i + 1), 1.0, stretch(i + 1)));
            }
            let stored = at(force(n), 1.0, stretch(n)).energy - at(force(0), 1.0, stretch(0)).energy;
            assert!(gained > 0.02 * stored, "{gained} of {stored}");
            (work + gained - stored - slid).abs() / work
        };
        assert!(miss(1) < 1e-12 && miss(10) < 1e-12, "{} {}", miss(1), miss(10));
    }
}
