//! The bodies that touch in a saved state, pair by pair: the contact points of `/contacts` summed up.
//!
//! A pair is one contact, as in the history: its force is the sum of its points' normal forces, its normal the mean of
//! theirs, weighted by those.

use std::collections::BTreeMap;

use crate::error::Result;
use crate::tensor::Vec3;

use super::reader::Reader;
use super::store::failure;

/// Two bodies that touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPair {
    /// Their numbers, the smaller first; those of a specimen's plates are below zero.
    pub bodies: [i64; 2],
    /// Unit, from the first body to the second; not a number where the points' normals cancel.
    pub normal: Vec3,
    /// Compression positive [N].
    pub normal_force: f64,
}

impl ContactPair {
    /// The numbers of two bodies in the order of a pair.
    pub fn key(a: i64, b: i64) -> [i64; 2] {
        [a.min(b), a.max(b)]
    }

    /// Whether one of the two is a specimen's plate.
    pub fn has_plate(&self) -> bool {
        self.bodies[0] < 0
    }

    /// The pairs of contact points, ordered by their bodies: each point with its bodies, its normal from the first to the second, and
    /// its normal force.
    pub(super) fn of_points(points: impl Iterator<Item = ([i64; 2], Vec3, f64)>) -> Vec<ContactPair> {
        let mut sums: BTreeMap<[i64; 2], (Vec3, f64)> = BTreeMap::new();
        for ([a, b], normal, force) in points {
            let (sum, total) = sums.entry(Self::key(a, b)).or_insert_with(|| (Vec3::zeros(), 0.0));
            *sum += normal * if a <= b { force } else { -force };
            *total += force;
        }
        let pair = |(bodies, (sum, normal_force)): ([i64; 2], (Vec3, f64))| {
            let normal = sum.try_normalize(0.0).unwrap_or_else(|| Vec3::repeat(f64::NAN));
            ContactPair { bodies, normal, normal_force }
        };
        sums.into_iter().map(pair).collect()
    }
}

impl Reader {
    /// The pairs that touch in a saved state, ordered by their bodies.
    ///
    /// # Errors
    /// A state whose contacts are not in the file; columns that are not of one length.
    pub fn contact_pairs(&self, state: usize) -> Result<Vec<ContactPair>> {
        let place = |column: &str| format!("contacts/{state}/{column}");
        let [a, b] = ["body_a", "body_b"].map(|column| self.integers(&place(column)));
        let (a, b) = (a?, b?);
        let [normals, forces] = ["normal", "normal_force"].map(|column| self.floats(&place(column)));
        let (normals, forces) = (normals?, forces?);
        for (column, found) in
            [("body_b", b.len()), ("normal", normals.len() / 3), ("normal_force", forces.len())]
        {
            if found != a.len() {
                return Err(failure(self.path(), &place(column), "is not as long as the columns beside it"));
            }
        }
        let bodies = a.into_iter().zip(b).map(|(a, b)| [a, b]);
        let normals = normals.chunks_exact(3).map(Vec3::from_column_slice);
        let points = bodies.zip(normals).zip(forces).map(|((bodies, normal), force)| (bodies, normal, force));
        Ok(ContactPair::of_points(points))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A face on a face touches in several points, which name the two bodies in either order.
    #[test]
    fn points_of_two_bodies_are_one_pair() {
        let points = [
            ([1, 0], Vec3::new(0.0, 0.0, -1.0), 3.0),
            ([0, 1], Vec3::new(1.0, 0.0, 0.0), 4.0),
            ([-2, 1], Vec3::new(0.0, 0.0, -1.0), 5.0),
            ([2, 1], Vec3::new(0.0, 1.0, 0.0), 1.0),
            ([1, 2], Vec3::new(0.0, 1.0, 0.0), 1.0),
        ];
        let pairs = ContactPair::of_points(points.into_iter());
        assert_eq!(pairs.iter().map(|pair| pair.bodies).collect::<Vec<_>>(), [[-2, 1], [0, 1], [1, 2]]);
        assert_eq!(pairs.iter().map(|pair| pair.normal_force).collect::<Vec<_>>(), [5.0, 7.0, 2.0]);
        assert!((pairs[1].normal - Vec3::new(0.8, 0.0, 0.6)).norm() < 1e-15, "{:?}", pairs[1]);
        assert!(pairs[0].has_plate() && !pairs[1].has_plate() && pairs[2].normal.x.is_nan());
    }
}
