//! How bodies behind asperities follow the forces of the step before.
//!
//! A compact body yields a twentieth of what its contacts do: displaced by `W F` it is next to where it will be. A slender one may yield as much as they
//! do, and swings: it retreats, is let go, and comes back further. So a body takes the share omega of the way `r = W F - u` to its displacements, by
//! Aitken's rule from its last two ways (Irons & Tuck 1969, Int. J. Numer. Methods Eng. 1:275-277),
//!
//! ```text
//! omega <- -omega r_old . (r - r_old) / |r - r_old|^2
//! ```
//!
//! within the bounds below. Where forces and displacements agree nothing depends on it.

use crate::tensor::Vec3;

const LEAST: f64 = 0.1;
const MOST: f64 = 1.0;

/// The last way of a body.
#[derive(Debug, Clone, Default)]
pub struct Followed {
    /// From its displacements to those under the forces [m].
    way: Vec<Vec3>,
    share: f64,
}

impl Followed {
    /// Sets `field`, displacements under the forces [m], to those that the body takes from where it `was`, empty for nowhere.
    pub fn follow(&mut self, field: &mut [Vec3], was: &[Vec3]) {
        let before = |k: usize| was.get(k).copied().unwrap_or_else(Vec3::zeros);
        let way: Vec<Vec3> = field.iter().enumerate().map(|(k, u)| u - before(k)).collect();
        let dot = |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>();
        self.share = if self.way.len() == way.len() && !way.is_empty() {
            let turned: Vec<Vec3> = way.iter().zip(&self.way).map(|(now, old)| now - old).collect();
            let square = dot(&turned, &turned);
            let share = if square > 0.0 { -self.share * dot(&self.way, &turned) / square } else { MOST };
            share.clamp(LEAST, MOST)
        } else {
            MOST
        };
        for (k, (u, way)) in field.iter_mut().zip(&way).enumerate() {
            *u = before(k) + way * self.share;
        }
        self.way = way;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Displacements `c - lambda u`, the answer to those before: alone it swings ever further where lambda is above 1.
    #[test]
    fn what_would_swing_settles() {
        for lambda in [0.05, 0.9, 1.2, 4.0] {
            let answer = Vec3::new(1.0, -0.5, 0.2);
            let (mut followed, mut u) = (Followed::default(), Vec::new());
            for _ in 0..3 {
                let was = u.clone();
                let old = was.first().copied().unwrap_or_else(Vec3::zeros);
                u = vec![answer * (1.0 + lambda) - old * lambda];
                followed.follow(&mut u, &was);
            }
            assert!((u[0] - answer).norm() < 1e-9, "{lambda}: {:?}", u[0]);
        }
    }

    #[test]
    fn what_goes_straight_is_followed_at_once() {
        let mut followed = Followed::default();
        for k in 1..4 {
            let aim = Vec3::x() * f64::from(k);
            let mut field = vec![aim];
            followed.follow(&mut field, &[Vec3::x() * f64::from(k - 1)]);
            assert_eq!(field[0], aim);
        }
    }
}
