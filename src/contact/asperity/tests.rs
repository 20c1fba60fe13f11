//! Closed forms, cycles and derivatives of the asperity law.

use super::*;

const E_STAR: f64 = 15.6e9;
const H: f64 = 0.7e9;

/// Tips sharp and blunt, of a large and a small rounding; crossed edges of two roundings; a cone without any.
fn samples() -> [Asperity; 5] {
    [
        Asperity::tip(E_STAR, H, 0.8e-3, 0.9),
        Asperity::tip(2.0 * E_STAR, 0.4 * H, 0.2e-3, 2.5),
        Asperity::tip(E_STAR, H, 0.5e-3, 40.0),
        Asperity::crossed_edges(E_STAR, H, [0.8e-3, 0.3e-3], [1.0, 1.7]),
        Asperity::tip(E_STAR, H, 0.0, 1.3),
    ]
}

/// Indentations of a cycle [m]: loaded, unloaded, reloaded beyond, let go, touched again.
const CYCLE: [f64; 6] = [0.3e-3, 0.27e-3, 0.7e-3, 0.0, 0.69e-3, 0.1e-3];

#[test]
fn below_the_limit_pressure_it_is_hertz() {
    // Two spheres of R = 12 mm, E 30 GPa, nu 0.2, approach 10 um: 51.03 N, a = 0.2449 mm, p0 = 406.1 MPa.
    let spheres = Asperity::tip(15e9 / 0.96, f64::INFINITY, 6e-3, 1.0);
    let Press { force, patch, .. } = spheres.press(1e-5, 0.0);
    assert!((force - 51.03).abs() < 0.005 && (patch - 0.2449e-3).abs() < 5e-8, "{force} {patch}");
    assert!((1.5 * force / (PI * patch * patch) - 406.1e6).abs() < 0.05e6);
    // Its mean pressure reaches the limit at (3 pi H / 4 E*)^2 R, where the other law goes on.
    let tip = Asperity::tip(E_STAR, H, 0.8e-3, 1.0);
    let limit = tip.elastic_limit(0.0);
    assert!((limit / ((0.75 * PI * H / E_STAR).powi(2) * 0.8e-3) - 1.0).abs() < 1e-12);
    for share in [0.2, 0.9, 1.0] {
        let update = tip.update(0.0, share * limit);
        let hertz = 4.0 / 3.0 * E_STAR * (0.8e-3f64 * (share * limit).powi(3)).sqrt();
        assert!((update.force / hertz - 1.0).abs() < 1e-12 && update.depth == 0.0);
        assert_eq!(update.dissipated, 0.0);
    }
}

/// The force of crushed rock is the limit pressure times the section of the feature at the crushed depth.
#[test]
fn crushed_rock_bears_the_limit_pressure_on_its_section() {
    let first = |r: f64| PI * (0.75 * PI * H / E_STAR * r).powi(2);
    // In the rounding of a tip: the paraboloid's section.
    let tip = Asperity::tip(E_STAR, H, 0.8e-3, 0.9);
    for indentation in [0.05e-3, 0.2e-3] {
        let Update { force, depth, .. } = tip.update(0.0, indentation);
        let area = first(0.8e-3) + 2.0 * PI * 0.8e-3 * depth;
        assert!((force / (H * area) - 1.0).abs() < 1e-6, "{force}");
        // What is not crushed is elastic: a patch under the limit pressure.
        let patch = (area / PI).sqrt();
        assert!((indentation - depth - 0.75 * PI * H / E_STAR * patch).abs() < 1e-9 * indentation);
    }
    // Of crossed edges the ellipse `x^2/(2 R_1) + y^2/(2 R_2) = d`.
    let edges = Asperity::crossed_edges(E_STAR, H, [0.8e-3, 0.3e-3], [1.0, 1.0]);
    let Update { force, depth, .. } = edges.update(0.0, 0.05e-3);
    let mean = (0.8e-3f64 * 0.3e-3).sqrt();
    assert!((force / (H * (first(mean) + 2.0 * PI * mean * depth)) - 1.0).abs() < 1e-6);
    // Of a sharp cone and of sharp wedges (half angles 50 and 60 degrees, a rhombus).
    let cone = Asperity::tip(E_STAR, H, 0.0, 1.3);
    let Update { force, depth, .. } = cone.update(0.0, 0.4e-3);
    assert!((force / (H * PI * (1.3 * depth).powi(2)) - 1.0).abs() < 1e-6);
    let [s, t] = [50.0f64, 60.0].map(|angle| angle.to_radians().tan());
    let Update { force, depth, .. } =
        Asperity::crossed_edges(E_STAR, H, [0.0; 2], [s, t]).update(0.0, 0.4e-3);
    assert!((force / (H * 2.0 * s * t * depth * depth) - 1.0).abs() < 1e-6);
}

/// Behind the rounding a tip is its cone, its area and the area's slope continuous.
#[test]
fn a_rounded_tip_becomes_its_cone() {
    let (radius, spread) = (0.8e-3, 0.9);
    let tip = Asperity::tip(E_STAR, H, radius, spread);
    let [end, depth] = tip.rounding_end();
    // Where the paraboloid `rho^2/(2R)` is as steep as the cone.
    assert!((end - radius / spread).abs() < 1e-15);
    for d in [1.5 * depth, 4.0 * depth] {
        assert!((tip.patch(d) - (end + spread * (d - depth))).abs() < 1e-15);
    }
    let slope = |d: f64| (tip.patch(d + 1e-10) - tip.patch(d - 1e-10)) / 2e-10;
    assert!((slope(depth) - spread).abs() < 1e-3 * spread, "{}", slope(depth));
}

#[test]
fn unloading_begins_with_the_stiffness_of_a_flat_punch() {
    for asperity in samples() {
        for indentation in [0.05e-3, 0.3e-3, 1e-3] {
            let loaded = asperity.update(0.0, indentation);
            let patch = (loaded.force / (PI * asperity.limit_pressure)).sqrt();
            let back = asperity.update(loaded.depth, indentation * (1.0 - 1e-12));
            let expected = 2.0 * asperity.modulus * patch;
            assert!((back.tangent / expected - 1.0).abs() < 1e-6, "{asperity:?}: {back:?} {expected}");
            // And it is let go of where it has been crushed to.
            assert_eq!(asperity.update(loaded.depth, loaded.depth).force, 0.0);
        }
    }
}

/// Work by quadrature of the force over a cycle: stored and lost, to 1e-6 of the work put in.
#[test]
fn a_cycle_closes_its_energy() {
    // Simpson's rule; at a kink of the slope its error is of the order of a step squared over the way.
    let steps = 4000;
    for asperity in samples() {
        let (mut depth, mut here, mut work, mut turnover, mut lost) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for to in CYCLE {
            // Pieces between the kinks, of which the state at the start knows all but the end of the rounding.
            let [end, end_depth] = asperity.rounding_end();
            let kinks =
                [depth, asperity.elastic_limit(depth), end_depth + asperity.yielding() * end, here, to];
            let inside = |k: &f64| (*k - here) * (*k - to) <= 0.0;
            let mut stops: Vec<f64> = kinks.into_iter().filter(inside).collect();
            stops.sort_by(|a, b| (a - here).abs().total_cmp(&(b - here).abs()));
            for piece in stops.windows(2) {
                let step = (piece[1] - piece[0]) / f64::from(steps);
                for k in 0..steps {
                    let from = piece[0] + f64::from(k) * step;
                    let force = |h: f64| asperity.press(h, depth).force;
                    let area =
                        step / 6.0 * (force(from) + 4.0 * force(from + 0.5 * step) + force(from + step));
                    work += area;
                    turnover += area.abs();
                }
            }
            let update = asperity.update(depth, to);
            lost += update.dissipated;
            assert!(update.dissipated >= 0.0 && update.depth >= depth);
            (depth, here) = (update.depth, to);
            let gap = work - update.stored - lost;
            assert!(gap.abs() < 1e-6 * turnover, "{asperity:?} at {to}: {gap} of {turnover}");
        }
        assert!(lost > 0.0);
    }
}

/// Split into however many steps, the way ends in one state, with one force and one loss.
#[test]
fn steps_do_not_matter() {
    for asperity in samples() {
        let whole = asperity.update(0.0, 0.8e-3);
        let (mut depth, mut lost) = (0.0, 0.0);
        for k in 1..=7 {
            let update = asperity.update(depth, 0.8e-3 * f64::from(k) / 7.0);
            (depth, lost) = (update.depth, lost + update.dissipated);
        }
        assert!((depth - whole.depth).abs() < 1e-12 * depth);
        assert!((lost - whole.dissipated).abs() < 1e-9 * lost);
        assert!((asperity.update(depth, 0.8e-3).force / whole.force - 1.0).abs() < 1e-9);
    }
}

/// By central differences, away from kinks: elastic, in the rounding and behind it, unloading.
#[test]
fn tangent_is_the_derivative_of_the_force_and_force_that_of_the_energy() {
    for asperity in samples() {
        for depth in [0.0, 0.05e-3, 0.4e-3] {
            let limit = asperity.elastic_limit(depth);
            let elastic = [0.3, 0.8].map(|share| depth + share * (limit - depth));
            let crushing = [1e-5, 1e-4, 6e-4].map(|more| limit + more);
            // A sharp cone is crushed from the start.
            for h in elastic.into_iter().chain(crushing).filter(|h| *h > depth) {
                let step = 1e-4 * (h - depth).min((h - limit).abs());
                let force = |h: f64| asperity.press(h, depth).force;
                let slope = (force(h + step) - force(h - step)) / (2.0 * step);
                let update = asperity.update(depth, h);
                // The third derivative of a power of h, times the step squared.
                assert!((slope / update.tangent - 1.0).abs() < 1e-6, "{asperity:?} {depth} {h}");
                let energy = |h: f64| asperity.press(h, depth).energy;
                let gained = (energy(h + step) - energy(h - step)) / (2.0 * step);
                let crush = |h: f64| asperity.work_of_crushing(asperity.crushed(h, depth));
                let lost = (crush(h + step) - crush(h - step)) / (2.0 * step);
                assert!(((gained + lost) / update.force - 1.0).abs() < 1e-5, "{asperity:?} {depth} {h}");
            }
        }
    }
}

/// Force, energy and loss are continuous where crushing begins, goes on and leaves the rounding.
#[test]
fn nothing_jumps() {
    for asperity in samples() {
        let [end, end_depth] = asperity.rounding_end();
        let leaves = end_depth + asperity.yielding() * end;
        for depth in [0.0, 0.02e-3, 0.5e-3] {
            for h in [asperity.elastic_limit(depth), leaves].into_iter().filter(|h| *h > 0.0) {
                let [below, above] = [1.0 - 1e-9, 1.0 + 1e-9].map(|share| asperity.update(depth, share * h));
                let near = |x: f64, y: f64| (x - y).abs() <= 1e-7 * (x.abs() + y.abs()) + 1e-16;
                assert!(near(below.force, above.force), "{asperity:?} {depth} {h}");
                assert!(near(below.stored, above.stored) && (below.depth - above.depth).abs() < 1e-8 * h);
            }
        }
        // And in the state: an untouched feature and one that has just begun to crush unload alike.
        let limit = asperity.elastic_limit(0.0);
        if limit > 0.0 {
            let [whole, begun] = [0.0, asperity.crushed(limit * (1.0 + 1e-9), 0.0)]
                .map(|depth| asperity.press(0.5 * limit, depth).force);
            assert!((whole / begun - 1.0).abs() < 1e-7);
        }
    }
}

#[test]
fn the_indentation_of_a_force_inverts_the_law() {
    for asperity in samples() {
        for depth in [0.0, 0.2e-3] {
            for h in [1.05, 1.5, 4.0].map(|more| depth + more * 1e-5).into_iter().chain([0.9e-3]) {
                let force = asperity.press(h, depth).force;
                assert!((asperity.indentation_for(force, depth) / h - 1.0).abs() < 1e-9, "{asperity:?} {h}");
            }
        }
    }
}

/// What an asperity and the compliance behind it yield adds up to the way, in elastic, crushed and unloaded states; derivatives by way and compliance are
/// those of differences.
#[test]
fn an_indentation_behind_a_compliance_shares_the_way() {
    for asperity in samples() {
        for depth in [0.0, 0.2e-3] {
            for more in [1e-7, 2e-6, 1e-5, 1e-4, 1e-3] {
                let way = depth + more;
                let stiffness = asperity.update(depth, way).tangent;
                for compliance in [0.0, 0.05, 3.0].map(|share| share / stiffness) {
                    let at = |way: f64, compliance: f64| asperity.indentation_behind(way, depth, compliance);
                    let h = at(way, compliance);
                    let left = h + compliance * asperity.press(h, depth).force - way;
                    assert!(left.abs() < 1e-12 * way, "{asperity:?} {depth} {more} {compliance:e}: {left:e}");
                    let [by_way, by_compliance] = [1e-6 * more, 1e-6 / stiffness];
                    let dual = asperity.indentation_behind(
                        Dual::<2>::variable(way, 0),
                        depth,
                        Dual::variable(compliance, 1),
                    );
                    let slope =
                        (at(way + by_way, compliance) - at(way - by_way, compliance)) / (2.0 * by_way);
                    // Yield may lie between the two.
                    assert!((slope - dual.gradient[0]).abs() < 2e-3, "{slope} {}", dual.gradient[0]);
                    if compliance > 0.0 {
                        let ends = [1.0, -1.0].map(|sign| at(way, compliance + sign * by_compliance));
                        let slope = (ends[0] - ends[1]) / (2.0 * by_compliance);
                        let miss = (slope - dual.gradient[1]).abs();
                        assert!(miss < 2e-3 * dual.gradient[1].abs(), "{slope:e} {:e}", dual.gradient[1]);
                    }
                }
            }
        }
    }
}

/// The mean pressure on the patch never exceeds the limit.
#[test]
fn pressure_keeps_below_its_limit() {
    for asperity in samples() {
        for depth in [0.0, 0.1e-3, 0.6e-3] {
            for k in 1..200 {
                let Press { force, patch, .. } = asperity.press(1e-5 * f64::from(k), depth);
                assert!(force <= asperity.limit_pressure * PI * patch * patch * (1.0 + 1e-12));
            }
        }
    }
}

/// A cone so blunt that its pressure stays below the limit does not count as blunter than that, or crushing would give energy.
#[test]
fn nearly_flat_corners_lose_no_energy_twice() {
    let flat = Asperity::tip(E_STAR, H, 0.5e-3, 1e6);
    let mut before = 0.0;
    for k in 1..100 {
        let work = flat.work_of_crushing(1e-6 * f64::from(k));
        assert!(work > before);
        before = work;
    }
    let Update { force, depth, .. } = flat.update(0.0, 1e-4);
    assert!(force.is_finite() && depth > 0.0);
}
