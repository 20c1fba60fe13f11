//! The smallest square hole that a body passes, as a sieve has.

use crate::tensor::Vec3;
use std::f64::consts::{FRAC_PI_2, PI, SQRT_2};

/// Directions that are looked along first, and turns of the square that are tried first.
const DIRECTIONS: usize = 200;
const TURNS: usize = 24;
/// One of so many turns tells whether the others are worth it.
const FIRST_OF: usize = 4;

/// Edge [m] of the smallest square hole through which the convex hull of `points` [m] passes without turning on the way:
/// the least bounding square of its projections, by a search over directions refined to about 0.1 %. Points inside the hull change nothing.
pub fn square_opening(points: &[Vec3]) -> f64 {
    let mut search = Search::over(points);
    let mut best = (f64::INFINITY, Vec3::z());
    let golden = PI * (3.0 - 5.0f64.sqrt());
    for k in 0..DIRECTIONS {
        let z = 1.0 - (k as f64 + 0.5) / DIRECTIONS as f64;
        let ring = (1.0 - z * z).sqrt();
        let direction = Vec3::new(ring * (golden * k as f64).cos(), ring * (golden * k as f64).sin(), z);
        let side = search.along(&direction, best.0);
        if side < best.0 {
            best = (side, direction);
        }
    }
    let mut step = 0.1;
    while step > 2e-3 {
        let (u, v) = perpendicular(&best.1);
        let trial = [u, -u, v, -v, u + v, u - v, v - u, -u - v]
            .map(|d| (best.1 + d * step).normalize())
            .map(|d| (search.along(&d, best.0), d));
        let found = trial.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or(best);
        if found.0 < best.0 {
            best = found;
        } else {
            step *= 0.5;
        }
    }
    best.0
}

/// Bounding squares of projections of some points.
struct Search<'a> {
    points: &'a [Vec3],
    /// Sines and cosines of the turns that are tried first.
    turns: [(f64, f64); TURNS],
    flat: Vec<[f64; 2]>,
}

impl<'a> Search<'a> {
    fn over(points: &'a [Vec3]) -> Self {
        let turns = std::array::from_fn(|k| turn(k).sin_cos());
        Search { points, turns, flat: Vec::with_capacity(points.len()) }
    }

    /// Least side [m] of a square around the projection along `direction`, over the square's turns; infinite where that cannot be less than `best`.
    ///
    /// A turn by `t` changes a side by no more than `t` times the projection's diameter, which is at most root two of any turn's side.
    fn along(&mut self, direction: &Vec3, best: f64) -> f64 {
        let (u, v) = perpendicular(direction);
        self.flat.clear();
        self.flat.extend(self.points.iter().map(|p| [u.dot(p), v.dot(p)]));
        let is_hopeless = |least: f64, apart: usize| least > best * (1.0 + SQRT_2 * 0.5 * turn(apart));
        let mut sides = [f64::INFINITY; TURNS];
        for first in 0..FIRST_OF {
            for k in (first..TURNS).step_by(FIRST_OF) {
                sides[k] = self.side(self.turns[k]);
            }
            let least = sides.iter().copied().fold(f64::INFINITY, f64::min);
            if first == 0 && is_hopeless(least, FIRST_OF) {
                return f64::INFINITY;
            }
        }
        let least = (0..TURNS).min_by(|a, b| sides[*a].total_cmp(&sides[*b])).unwrap_or(0);
        if is_hopeless(sides[least], 1) {
            return f64::INFINITY;
        }
        let (mut angle, mut step) = (turn(least), 0.5 * turn(1));
        while step > 1e-3 {
            let next = [angle - step, angle, angle + step];
            let side = |angle: &f64| self.side(angle.sin_cos());
            angle = next.into_iter().min_by(|a, b| side(a).total_cmp(&side(b))).unwrap_or(angle);
            step *= 0.5;
        }
        self.side(angle.sin_cos())
    }

    /// Side of the square around the projection, turned by an angle of this sine and cosine [m].
    fn side(&self, (sine, cosine): (f64, f64)) -> f64 {
        let extent = |x: f64, y: f64| {
            let along = self.flat.iter().map(|p| x * p[0] + y * p[1]);
            along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
        };
        extent(cosine, sine).max(extent(-sine, cosine))
    }
}

/// Turn number `k` of those tried first.
fn turn(k: usize) -> f64 {
    k as f64 * FRAC_PI_2 / TURNS as f64
}

fn perpendicular(direction: &Vec3) -> (Vec3, Vec3) {
    let u = direction.cross(&Vec3::ith(direction.iamin(), 1.0)).normalize();
    (u, direction.cross(&u))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Polyhedron;

    #[test]
    fn square_opening_of_boxes() {
        let opening = |size| square_opening(&Polyhedron::cuboid(size).expect("a box").vertices);
        // The two smaller edges decide: across the hole, or turned by 45 degrees if one is thin.
        assert!((opening([3.0, 2.0, 1.9]) / 2.0 - 1.0).abs() < 0.01);
        assert!((opening([5.0, 1.0, 1.0]) - 1.0).abs() < 0.01);
        assert!((opening([3.0, 2.0, 0.1]) / (2.1 / 2.0f64.sqrt()) - 1.0).abs() < 0.01);
    }

    /// As a mesh has them: on edges and facets, where a hull out of triangles has some without area.
    #[test]
    fn points_inside_the_hull_change_nothing() {
        let mut corners = Polyhedron::cuboid([0.03, 0.02, 0.05]).expect("a box").vertices;
        assert!((square_opening(&corners) / 0.03 - 1.0).abs() < 2e-3);
        let inside = [[0.0, 0.01, 0.025], [0.005, 0.01, 0.025], [0.015, 0.0, 0.0]];
        corners.extend(inside.map(Vec3::from));
        assert!((square_opening(&corners) / 0.03 - 1.0).abs() < 2e-3);
    }

    /// What is left out as hopeless is no less than the best.
    #[test]
    fn what_is_left_out_is_larger() {
        let point = |k: usize| Vec3::from([1.3, 2.9, 4.1].map(|rate| (rate * k as f64).sin()));
        let points: Vec<Vec3> = (0..14).map(point).collect();
        let mut search = Search::over(&points);
        let mut left_out = 0;
        for k in 0..100 {
            let direction = Vec3::new((k as f64).sin(), (2.0 * k as f64).cos(), 0.3).normalize();
            let exact = search.along(&direction, f64::INFINITY);
            for best in [0.9 * exact, 0.999 * exact, 1.001 * exact] {
                let found = search.along(&direction, best);
                left_out += usize::from(found.is_infinite());
                assert!(found == exact || found.is_infinite() && exact >= best, "{found} {exact} {best}");
            }
        }
        assert!(left_out > 50, "{left_out}");
    }
}
