//! Closest points of feature pairs, the weight of an edge pair, and their derivatives.

use crate::contact::law::ContactLaw;
use crate::tensor::Vec3;
use crate::tensor::dual::{Real, Vector};
use serde::{Deserialize, Serialize};

/// Which features of bodies `a` and `b` a contact joins. It is also the contact's identity:
/// histories are kept under it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Feature {
    /// A vertex of `a` against the core of `b`.
    VertexOfA(u32),
    /// A vertex of `b` against the core of `a`.
    VertexOfB(u32),
    /// An edge of each; counted by edge index in its polyhedron.
    Edges(u32, u32),
    /// A point of the patch that a face of each share, by its number there.
    Faces(u32, u32, u32),
}

/// The smooth piece on which the closest points lie: vertex, edge or facet of each body, by the
/// number of points that span it (1, 2, 3).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Site {
    pub feature: Feature,
    /// Vertex indices of body `a` that span the piece; the first `count_a` are used.
    pub on_a: [u32; 3],
    pub on_b: [u32; 3],
    pub count_a: u8,
    pub count_b: u8,
}

/// Closest points `(x_a, x_b)` of two features given by the points that span them; lines and
/// planes are taken as unbounded, since the search has already found the closest bounded piece.
pub fn closest_points<T: Real>(
    site: &Site,
    a: &[Vector<T>; 3],
    b: &[Vector<T>; 3],
) -> (Vector<T>, Vector<T>) {
    match (site.count_a, site.count_b) {
        (1, 1) => (a[0], b[0]),
        (1, 2) => (a[0], on_line(a[0], b)),
        (1, _) => (a[0], on_plane(a[0], b)),
        (2, 1) => (on_line(b[0], a), b[0]),
        (3, 1) => (on_plane(b[0], a), b[0]),
        _ => {
            let lines = LinePair::new(a, b);
            (a[0] + lines.u.times(lines.s), b[0] + lines.v.times(lines.t))
        }
    }
}

fn on_line<T: Real>(p: Vector<T>, q: &[Vector<T>; 3]) -> Vector<T> {
    let u = q[1] - q[0];
    q[0] + u.times((p - q[0]).dot(u) / u.dot(u))
}

fn on_plane<T: Real>(p: Vector<T>, q: &[Vector<T>; 3]) -> Vector<T> {
    let normal = (q[1] - q[0]).cross(q[2] - q[0]);
    p - normal.times(normal.dot(p - q[0]) / normal.dot(normal))
}

/// Two lines `p0 + s u` and `q0 + t v`, at their closest points.
pub struct LinePair<T> {
    pub u: Vector<T>,
    pub v: Vector<T>,
    pub s: T,
    pub t: T,
    uu: T,
    uv: T,
    vv: T,
    /// `|u x v|^2`.
    determinant: T,
}

impl<T: Real> LinePair<T> {
    pub fn new(a: &[Vector<T>; 3], b: &[Vector<T>; 3]) -> Self {
        let (u, v, r) = (a[1] - a[0], b[1] - b[0], a[0] - b[0]);
        let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
        let (ur, vr) = (u.dot(r), v.dot(r));
        let determinant = uu * vv - uv * uv;
        let s = (uv * vr - vv * ur) / determinant;
        let t = (uu * vr - uv * ur) / determinant;
        LinePair { u, v, s, t, uu, uv, vv, determinant }
    }

    /// The weight `m(s) m(t) e(theta)` of the edge pair and its derivatives by `s`, `t` and the
    /// squared sine of the angle between the edges.
    pub fn weight(&self, law: &ContactLaw) -> EdgeWeight<T> {
        self.weight_fading([fade_rate(self.uu, law.fade_length), fade_rate(self.vv, law.fade_length)], law)
    }

    /// The same with given rates, per edge length, at which `s` and `t` fade in from either end.
    pub fn weight_fading(&self, rates: [f64; 2], law: &ContactLaw) -> EdgeWeight<T> {
        let (ms, ms_slope) = end_fade(self.s, rates[0]);
        let (mt, mt_slope) = end_fade(self.t, rates[1]);
        let sine_squared = self.determinant / (self.uu * self.vv);
        let (e, e_slope) = fade(sine_squared.scaled(1.0 / law.parallel_limit));
        EdgeWeight {
            value: ms * mt * e,
            by_s: ms_slope * mt * e,
            by_t: ms * mt_slope * e,
            by_sine_squared: ms * mt * e_slope.scaled(1.0 / law.parallel_limit),
        }
    }

    /// What an edge's change of length adds to [`Self::end_point_gradient`]: along `u` at `p1`, less at
    /// `p0`, and along `v` at `q1`, less at `q0`. Nothing on a rigid body, where the two cancel.
    pub fn stretch_gradient(&self, weight: &EdgeWeight<T>) -> [Vector<T>; 2] {
        let shared = weight.by_sine_squared * self.uv * self.uv.scaled(2.0) / (self.uu * self.vv);
        [self.u.times(shared / self.uu), self.v.times(shared / self.vv)]
    }

    /// Gradient of a function of `s`, `t` and the squared sine by the end points `p0, p1, q0, q1`,
    /// given its derivatives by those three; `gap` is `x_b - x_a`. Follows from differentiating
    /// the two conditions that the closest points' difference is normal to both lines.
    pub fn end_point_gradient(&self, weight: &EdgeWeight<T>, gap: Vector<T>) -> [Vector<T>; 4] {
        let one = T::constant(1.0);
        let along_u = (weight.by_s * self.vv + weight.by_t * self.uv) / self.determinant;
        let along_v = -((weight.by_s * self.uv + weight.by_t * self.uu) / self.determinant);
        let shared = self.u.times(along_u) + self.v.times(along_v);
        let turn = weight.by_sine_squared * self.uv.scaled(-2.0) / (self.uu * self.vv);
        let on_u = gap.times(along_u) + self.v.times(turn);
        let on_v = gap.times(along_v) + self.u.times(turn);
        [
            -shared.times(one - self.s) - on_u,
            -shared.times(self.s) + on_u,
            shared.times(one - self.t) - on_v,
            shared.times(self.t) + on_v,
        ]
    }
}

/// The weight of an edge pair and its partial derivatives.
pub struct EdgeWeight<T> {
    pub value: T,
    pub by_s: T,
    pub by_t: T,
    pub by_sine_squared: T,
}

/// Edge length over fade length. Short edges fade over half their length, so that the middle keeps full weight.
pub fn fade_rate<T: Real>(length_squared: T, fade_length: f64) -> f64 {
    (length_squared.value().sqrt() / fade_length).max(2.0)
}

/// `m(s)` and its slope: 0 at an edge's ends, 1 further than the fade length from both.
fn end_fade<T: Real>(s: T, rate: f64) -> (T, T) {
    let (z, sign) = if s.value() < 0.5 { (s, 1.0) } else { (T::constant(1.0) - s, -1.0) };
    let (m, slope) = fade(z.scaled(rate));
    (m, slope.scaled(sign * rate))
}

/// A step from 0 to 1 with continuous second derivative, `z^3 (10 - 15 z + 6 z^2)`, and its slope.
pub(super) fn fade<T: Real>(z: T) -> (T, T) {
    if z.value() <= 0.0 {
        (T::constant(0.0), T::constant(0.0))
    } else if z.value() >= 1.0 {
        (T::constant(1.0), T::constant(0.0))
    } else {
        let square = z * z;
        let rest = T::constant(1.0) - z;
        let value = square * z * (T::constant(10.0) - z.scaled(15.0) + square.scaled(6.0));
        (value, (square * rest * rest).scaled(30.0))
    }
}

/// Closest point of the triangle `abc` to `p` (Ericson 2005, "Real-time collision detection",
/// section 5.1.5), and which corners span the feature it lies on.
pub fn closest_on_triangle(p: &Vec3, corners: [&Vec3; 3]) -> (Vec3, [bool; 3]) {
    let [a, b, c] = corners;
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (*a, [true, false, false]);
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return (*b, [false, true, false]);
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return (*c, [false, false, true]);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (a + ab * (d1 / (d1 - d3)), [true, true, false]);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (a + ac * (d2 / (d2 - d6)), [true, false, true]);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let share = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return (b + (c - b) * share, [false, true, true]);
    }
    let scale = 1.0 / (va + vb + vc);
    (a + ab * (vb * scale) + ac * (vc * scale), [true, true, true])
}

/// The corners that span the feature a closest point lies on; unused places repeat the first.
pub fn spanned(corners: [u32; 3], spans: [bool; 3]) -> ([u32; 3], u8) {
    let mut piece = [0; 3];
    let mut count = 0;
    for k in 0..3 {
        if spans[k] {
            piece[count] = corners[k];
            count += 1;
        }
    }
    for k in count..3 {
        piece[k] = piece[0];
    }
    (piece, count as u8)
}

/// Closest points of two segments as parameters `(s, t)` in [0, 1] (Ericson 2005, 5.1.9).
pub fn closest_on_segments(p0: &Vec3, p1: &Vec3, q0: &Vec3, q1: &Vec3) -> (f64, f64) {
    let (u, v, r) = (p1 - p0, q1 - q0, p0 - q0);
    let (a, e, f) = (u.dot(&u), v.dot(&v), v.dot(&r));
    let (c, b) = (u.dot(&r), u.dot(&v));
    let determinant = a * e - b * b;
    let s = if determinant > 1e-12 * a * e { ((b * f - c * e) / determinant).clamp(0.0, 1.0) } else { 0.5 };
    let t = (b * s + f) / e;
    if t < 0.0 {
        ((-c / a).clamp(0.0, 1.0), 0.0)
    } else if t > 1.0 {
        (((b - c) / a).clamp(0.0, 1.0), 1.0)
    } else {
        (s, t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAW: ContactLaw = ContactLaw { fade_length: 0.5, parallel_limit: 0.9, ..ContactLaw::SAMPLE };

    fn weight_of(points: &[Vec3; 4]) -> f64 {
        let v = points.map(|p| Vector::constant(&p));
        LinePair::<f64>::new(&[v[0], v[1], v[0]], &[v[2], v[3], v[2]]).weight(&LAW).value
    }

    /// Only rigid motions of each edge occur, so the lengths of the edges are kept.
    #[test]
    fn edge_weight_gradient_is_its_derivative_under_rigid_motion() {
        let points = [
            Vec3::new(-0.3, 0.02, 0.01),
            Vec3::new(1.1, -0.05, 0.03),
            Vec3::new(0.1, -0.35, 0.4),
            Vec3::new(0.4, 0.9, 0.3),
        ];
        let v = points.map(|p| Vector::constant(&p));
        let (a, b) = ([v[0], v[1], v[0]], [v[2], v[3], v[2]]);
        let lines = LinePair::<f64>::new(&a, &b);
        let weight = lines.weight(&LAW);
        assert!(
            weight.value > 0.05 && weight.value < 0.95,
            "the sample must lie in the fade: {}",
            weight.value
        );
        let gap = (b[0] + lines.v.times(lines.t)) - (a[0] + lines.u.times(lines.s));
        let gradient = lines.end_point_gradient(&weight, gap).map(|g| g.value());
        let h = 1e-6;
        for edge in 0..2 {
            for k in 0..6 {
                let moved = |sign: f64| {
                    let mut axis = Vec3::zeros();
                    axis[k % 3] = sign * h;
                    let mut q = points;
                    for p in &mut q[2 * edge..2 * edge + 2] {
                        *p = if k < 3 {
                            *p + axis
                        } else {
                            crate::tensor::Rotation::from_scaled_axis(axis) * *p
                        };
                    }
                    q
                };
                let difference = (weight_of(&moved(1.0)) - weight_of(&moved(-1.0))) / (2.0 * h);
                let mut axis = Vec3::zeros();
                axis[k % 3] = 1.0;
                let analytic: f64 = (2 * edge..2 * edge + 2)
                    .map(|i| gradient[i].dot(&if k < 3 { axis } else { axis.cross(&points[i]) }))
                    .sum();
                assert!(
                    (difference - analytic).abs() < 1e-7,
                    "edge {edge} motion {k}: {difference} {analytic}"
                );
            }
        }
    }

    #[test]
    fn closest_point_of_triangle_is_stationary() {
        let (a, b, c) = (Vec3::new(0.0, 0.0, 0.0), Vec3::new(1.0, 0.1, 0.0), Vec3::new(0.2, 0.9, 0.3));
        for p in [
            Vec3::new(0.3, 0.3, 2.0),
            Vec3::new(-1.0, -1.0, 0.2),
            Vec3::new(0.6, -2.0, 0.1),
            Vec3::new(2.0, 1.5, 0.0),
        ] {
            let (closest, _) = closest_on_triangle(&p, [&a, &b, &c]);
            let best = (closest - p).norm();
            for i in 0..=50 {
                for j in 0..=50 - i {
                    let q = a + (b - a) * (i as f64 / 50.0) + (c - a) * (j as f64 / 50.0);
                    assert!((q - p).norm() >= best - 1e-12);
                }
            }
        }
    }
}
