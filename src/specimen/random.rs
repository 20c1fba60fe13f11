//! Random numbers: a Mersenne Twister (MT19937-64, Matsumoto & Nishimura 1998) per purpose and grain.
//!
//! Each stream's seed is a hash of the case's seed, its purpose and an index, so that what a grain
//! gets depends neither on the other grains nor on the number of threads.

use crate::tensor::Rotation;
use rand_mt::Mt64;
use std::f64::consts::TAU;

/// What a stream is for; the numbers are part of "same seed, same bits".
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    Shape = 1,
    Placement = 2,
    Sample = 3,
}

/// A stream of random numbers.
pub struct Stream(Mt64);

impl Stream {
    /// The stream of `purpose` for the thing numbered `index` under the case's `seed`.
    pub fn new(seed: u64, purpose: Purpose, index: u64) -> Self {
        let mut state = mix(seed);
        state = mix(state ^ (purpose as u64));
        state = mix(state ^ index);
        Stream(Mt64::new(state))
    }

    /// Uniform in [0, 1), 53 bits.
    pub fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in [low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform over low, low + 1, ..., high.
    pub fn integer(&mut self, low: usize, high: usize) -> usize {
        let count = high - low + 1;
        low + ((self.unit() * count as f64) as usize).min(count - 1)
    }

    /// Uniform over all rotations (Shoemake 1992).
    pub fn rotation(&mut self) -> Rotation {
        let (u, a, b) = (self.unit(), TAU * self.unit(), TAU * self.unit());
        let (p, q) = ((1.0 - u).sqrt(), u.sqrt());
        Rotation::new_normalize(nalgebra::Quaternion::new(q * b.cos(), p * a.sin(), p * a.cos(), q * b.sin()))
    }
}

/// The finaliser of SplitMix64 (Steele, Lea & Flood 2014): a bijection whose every output bit
/// depends on every input bit.
fn mix(value: u64) -> u64 {
    let mut z = value.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_repeat_and_differ() {
        let draw = |seed, index| Stream::new(seed, Purpose::Shape, index).unit();
        assert_eq!(draw(1, 2), draw(1, 2));
        assert_ne!(draw(1, 2), draw(2, 1));
        assert_ne!(draw(1, 2), draw(1, 3));
        assert_ne!(draw(1, 2), Stream::new(1, Purpose::Placement, 2).unit());
    }

    #[test]
    fn first_numbers_of_streams_are_uniform() {
        let count = 20_000;
        let values: Vec<f64> = (0..count).map(|i| Stream::new(7, Purpose::Shape, i).unit()).collect();
        let mean = values.iter().sum::<f64>() / count as f64;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count as f64;
        // Five standard errors of a uniform sample.
        assert!((mean - 0.5).abs() < 5.0 * (1.0 / 12.0f64).sqrt() / (count as f64).sqrt());
        assert!((variance - 1.0 / 12.0).abs() < 5.0 * 0.0745 / (count as f64).sqrt());
    }

    #[test]
    fn rotated_axis_is_uniform_on_the_sphere() {
        let mut stream = Stream::new(3, Purpose::Placement, 0);
        let count = 20_000;
        let heights: Vec<f64> =
            (0..count).map(|_| (stream.rotation() * crate::tensor::Vec3::x()).z).collect();
        let mean = heights.iter().sum::<f64>() / count as f64;
        let second = heights.iter().map(|h| h * h).sum::<f64>() / count as f64;
        assert!(mean.abs() < 5.0 * 0.5774 / (count as f64).sqrt());
        assert!((second - 1.0 / 3.0).abs() < 5.0 * 0.2982 / (count as f64).sqrt());
    }
}
