//! How vectors and rotations are stored: as plain numbers, bit by bit (`#[serde(with = "…")]`).
//!
//! nalgebra's own serde support is off, since it costs a rebuild of half the dependencies.

use nalgebra::{Quaternion, SMatrix};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

use super::{Pose, Rotation, Vec3};

/// What a row of numbers can hold.
pub trait Numbers: Sized {
    /// Appends the numbers to `row`.
    fn put(&self, row: &mut Vec<f64>);
    /// Takes as many as [`Numbers::put`] gave; `None` where the row ends early.
    fn take(row: &mut impl Iterator<Item = f64>) -> Option<Self>;
}

impl<const R: usize, const C: usize> Numbers for SMatrix<f64, R, C> {
    fn put(&self, row: &mut Vec<f64>) {
        row.extend_from_slice(self.as_slice());
    }

    fn take(row: &mut impl Iterator<Item = f64>) -> Option<Self> {
        let mut matrix = Self::zeros();
        for component in matrix.iter_mut() {
            *component = row.next()?;
        }
        Some(matrix)
    }
}

impl<T: Numbers> Numbers for Vec<T> {
    fn put(&self, row: &mut Vec<f64>) {
        row.push(self.len() as f64);
        self.iter().for_each(|item| item.put(row));
    }

    fn take(row: &mut impl Iterator<Item = f64>) -> Option<Self> {
        let length = row.next()? as usize;
        (0..length).map(|_| T::take(row)).collect()
    }
}

impl<T: Numbers, const N: usize> Numbers for [T; N] {
    fn put(&self, row: &mut Vec<f64>) {
        self.iter().for_each(|item| item.put(row));
    }

    fn take(row: &mut impl Iterator<Item = f64>) -> Option<Self> {
        let items: Vec<T> = (0..N).map(|_| T::take(row)).collect::<Option<_>>()?;
        items.try_into().ok()
    }
}

pub fn serialize<T: Numbers, S: Serializer>(value: &T, serializer: S) -> Result<S::Ok, S::Error> {
    let mut row = Vec::new();
    value.put(&mut row);
    row.serialize(serializer)
}

pub fn deserialize<'de, T: Numbers, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error> {
    let mut row = Vec::<f64>::deserialize(deserializer)?.into_iter();
    let value = T::take(&mut row).ok_or_else(|| D::Error::custom("too few numbers"))?;
    match row.next() {
        None => Ok(value),
        Some(_) => Err(D::Error::custom("too many numbers")),
    }
}

impl Serialize for Pose {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let (x, q) = (&self.position, &self.rotation.coords);
        [x.x, x.y, x.z, q.x, q.y, q.z, q.w].serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Pose {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let [x, y, z, i, j, k, w] = <[f64; 7]>::deserialize(deserializer)?;
        // As it was, without another normalisation, which would change its last bits.
        Ok(Pose::new(Vec3::new(x, y, z), Rotation::new_unchecked(Quaternion::new(w, i, j, k))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tensor::Vector6;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct Everything {
        #[serde(with = "super")]
        vector: Vec3,
        #[serde(with = "super")]
        lists: [Vec<Vector6<f64>>; 2],
        pose: Pose,
    }

    #[test]
    fn every_bit_comes_back() {
        let third = 1.0 / 3.0;
        let everything = Everything {
            vector: Vec3::new(third, -0.0, f64::MIN_POSITIVE / 8.0),
            lists: [vec![Vector6::repeat(0.1), Vector6::repeat(1e300)], vec![]],
            pose: Pose::new(Vec3::repeat(third), Rotation::from_scaled_axis(Vec3::new(0.1, 0.2, third))),
        };
        let bytes = postcard::to_allocvec(&everything).expect("bytes");
        let again: Everything = postcard::from_bytes(&bytes).expect("the same");
        assert_eq!(again, everything);
        assert_eq!(again.vector.y.to_bits(), (-0.0_f64).to_bits());
        assert_eq!(postcard::to_allocvec(&again).expect("bytes"), bytes);
    }

    #[test]
    fn a_row_of_the_wrong_length_is_refused() {
        let bytes = postcard::to_allocvec(&vec![1.0, 2.0]).expect("bytes");
        let read = |bytes: &[u8]| {
            let mut from = postcard::Deserializer::from_bytes(bytes);
            deserialize::<Vec3, _>(&mut from).is_ok()
        };
        assert!(!read(&bytes));
        assert!(!read(&postcard::to_allocvec(&vec![1.0; 4]).expect("bytes")));
        assert!(read(&postcard::to_allocvec(&vec![1.0; 3]).expect("bytes")));
    }
}
