//! Force chains: rows of grains that carry more than the others, along the row.
//!
//! Source: Peters, Muthuswamy, Wibowo & Tordesillas 2005, Phys. Rev. E 72:041307. A grain may be in a chain where its
//! largest principal stress is above the mean over all grains; two such grains that touch are linked where the line
//! between their centres lies within `ALIGNED` of both their directions of largest stress; a chain has at least `FEWEST`
//! grains. Stress counts compression positive.

use crate::tensor::{Mat3, Vec3};
use crate::triaxial::network::{OutsideForce, PairForce, surface_moments};

/// Cosine of 45 degrees.
const ALIGNED: f64 = std::f64::consts::FRAC_1_SQRT_2;
const FEWEST: usize = 3;

/// Mean stress of each body from the forces on its surface [Pa]: Love (1927). Zero where `volumes` [m^3] has none.
pub fn body_stresses(
    pairs: &[PairForce],
    outside: &[OutsideForce],
    positions: &[Vec3],
    volumes: &[Option<f64>],
) -> Vec<Mat3> {
    let stress = |(moment, volume): (&Mat3, &Option<f64>)| {
        volume.map_or(Mat3::zeros(), |volume| -0.5 * (moment + moment.transpose()) / volume)
    };
    body_moments(pairs, outside, positions).iter().zip(volumes).map(stress).collect()
}

/// Sum of arm times force over the surface of each of the bodies at `positions` [N m], tension positive.
pub fn body_moments(pairs: &[PairForce], outside: &[OutsideForce], positions: &[Vec3]) -> Vec<Mat3> {
    let mut moments = vec![Mat3::zeros(); positions.len()];
    for (body, moment) in surface_moments(pairs, outside, |body| positions[body]) {
        moments[body] += moment;
    }
    moments
}

/// Share of the grains (bodies with a volume) that are in a chain; not a number without grains.
pub fn chained_fraction(
    pairs: &[PairForce],
    stresses: &[Mat3],
    positions: &[Vec3],
    volumes: &[Option<f64>],
) -> f64 {
    let largest: Vec<Option<(f64, Vec3)>> = stresses
        .iter()
        .zip(volumes)
        .map(|(stress, volume)| {
            volume.is_some().then(|| {
                let eigen = stress.symmetric_eigen();
                let at = eigen.eigenvalues.imax();
                (eigen.eigenvalues[at], eigen.eigenvectors.column(at).into())
            })
        })
        .collect();
    let grains = largest.iter().flatten().count() as f64;
    let mean = largest.iter().flatten().map(|(value, _)| value).sum::<f64>() / grains;
    // Where all carry the same, rounding makes none of them strong.
    let least = mean * (1.0 + 1e-9);
    let strong = |body: usize| largest[body].filter(|(value, _)| *value > least).map(|(_, along)| along);
    // Each body's chain is named by the smallest body in it, found by following `link`.
    let mut link: Vec<usize> = (0..volumes.len()).collect();
    let root = |link: &[usize], mut body: usize| {
        while link[body] != body {
            body = link[body];
        }
        body
    };
    for pair in pairs {
        let [a, b] = pair.bodies;
        let (Some(u), Some(v)) = (strong(a), strong(b)) else { continue };
        let branch = (positions[b] - positions[a]).normalize();
        if u.dot(&branch).abs() >= ALIGNED && v.dot(&branch).abs() >= ALIGNED {
            let (x, y) = (root(&link, a), root(&link, b));
            link[x.max(y)] = x.min(y);
        }
    }
    let mut sizes = vec![0usize; link.len()];
    (0..link.len()).for_each(|body| sizes[root(&link, body)] += 1);
    sizes.iter().filter(|size| **size >= FEWEST).sum::<usize>() as f64 / grains
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPACING: f64 = 0.04;
    const VOLUME: f64 = 2e-5;

    /// Balls on a 3 x 3 x 3 lattice, pressed along each axis by a force [N] per row; `force(axis, row)`, the row named by its
    /// two other coordinates. Forces on the outermost come from outside.
    fn lattice(force: impl Fn(usize, [usize; 2]) -> f64) -> (Vec<PairForce>, Vec<OutsideForce>, Vec<Vec3>) {
        let index = |c: [usize; 3]| c[0] + 3 * (c[1] + 3 * c[2]);
        let place = |c: [usize; 3]| Vec3::new(c[0] as f64, c[1] as f64, c[2] as f64) * SPACING;
        let (mut pairs, mut outside, mut positions) = (vec![], vec![], vec![Vec3::zeros(); 27]);
        for at in 0..27 {
            let c = [at % 3, at / 3 % 3, at / 9];
            positions[index(c)] = place(c);
            for k in 0..3 {
                let size = force(k, [c[(k + 1) % 3], c[(k + 2) % 3]]);
                let mut axis = Vec3::zeros();
                axis[k] = 1.0;
                let half = axis * (0.5 * SPACING);
                if c[k] < 2 {
                    let mut next = c;
                    next[k] += 1;
                    let (point, on_second) = (place(c) + half, axis * size);
                    pairs.push(PairForce {
                        bodies: [index(c), index(next)],
                        normal: axis,
                        force: on_second,
                        moment: point * on_second.transpose(),
                    });
                } else {
                    outside.push(OutsideForce { body: at, point: place(c) + half, force: -axis * size });
                }
                if c[k] == 0 {
                    outside.push(OutsideForce { body: at, point: place(c) - half, force: axis * size });
                }
            }
        }
        (pairs, outside, positions)
    }

    fn chained(force: impl Fn(usize, [usize; 2]) -> f64) -> f64 {
        let (pairs, outside, positions) = lattice(force);
        let volumes = vec![Some(VOLUME); 27];
        let stresses = body_stresses(&pairs, &outside, &positions, &volumes);
        chained_fraction(&pairs, &stresses, &positions, &volumes)
    }

    /// Of a ball pressed by f along an axis the stress there is f times the spacing over its volume.
    #[test]
    fn stress_of_a_ball_in_a_row() {
        let (pairs, outside, positions) = lattice(|axis, _| [100.0, 200.0, 300.0][axis]);
        for stress in body_stresses(&pairs, &outside, &positions, &vec![Some(VOLUME); 27]) {
            for k in 0..3 {
                let expected = 100.0 * (k + 1) as f64 * SPACING / VOLUME;
                assert!((stress[(k, k)] - expected).abs() < 1e-9 * expected, "{stress}");
            }
        }
    }

    /// Columns that carry 700 N of 100 N are chains; beside each other they remain two, each of three.
    #[test]
    fn strong_columns_are_chains() {
        let one = chained(|axis, row| if axis == 2 && row == [1, 1] { 700.0 } else { 100.0 });
        assert!((one - 3.0 / 27.0).abs() < 1e-15, "{one}");
        let two = chained(|axis, row| if axis == 2 && row[0] == 1 && row[1] < 2 { 700.0 } else { 100.0 });
        assert!((two - 6.0 / 27.0).abs() < 1e-15, "{two}");
    }

    /// Strong grains side by side, each pressed across the line between them, are no chain, nor is a pair; and where all carry
    /// the same none carries more than the mean.
    #[test]
    fn strong_grains_that_do_not_press_each_other_are_no_chain() {
        let even = chained(|_, _| 100.0);
        assert_eq!(even, 0.0);
        let (pairs, _, positions) = lattice(|_, _| 100.0);
        let volumes = vec![Some(VOLUME); 27];
        let with = |strong: &dyn Fn(usize) -> Option<Vec3>| {
            let stresses: Vec<Mat3> = (0..27)
                .map(|body| strong(body).map_or(Mat3::identity(), |along| along * along.transpose() * 9.0))
                .collect();
            chained_fraction(&pairs, &stresses, &positions, &volumes)
        };
        // The lowest layer's middle row 3, 4, 5 along x.
        let row = |along: Vec3| with(&move |body| (3..6).contains(&body).then_some(along));
        assert_eq!(row(Vec3::z()), 0.0);
        assert!((row(Vec3::x()) - 3.0 / 27.0).abs() < 1e-15);
        // 44 degrees off the row still count, 46 do not.
        let off = |degrees: f64| {
            let turn = degrees.to_radians();
            row(Vec3::new(turn.cos(), 0.0, turn.sin()))
        };
        assert!(off(44.0) > 0.0 && off(46.0) == 0.0);
        assert_eq!(with(&|body| (3..5).contains(&body).then_some(Vec3::x())), 0.0);
    }
}
