//! How fast damage moves at a point whose cracks open and close in turn.
//!
//! The limit of the next change is halved when its sign turns and doubled, up to the caller's limit, when it stays: the Rprop rule of Riedmiller & Braun
//! (1993), Proc. IEEE Int. Conf. Neural Networks 1:586-591. So such points settle.

/// Limits below this mean that a point flips.
pub const FLIPPING: f64 = 1e-4;

/// Turns after which a point's limit grows by the second factor, not by the first. Without it, points that go twice one way and twice the
/// other would never settle.
const SOME_TURNS: u8 = 4;
const GROWTH: [f64; 2] = [2.0, 1.2];
/// Turns after which a point keeps what it has until the commit: points of one grain can have each other turn for ever, in longer rounds.
const MOST_TURNS: u8 = 32;

/// How a point's stiffness may change next, as [`Secant::change_to`](crate::material::Secant::change_to) measures it.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pace {
    /// The last limit, with the sign of the change.
    limit: f64,
    /// How often the sign turned.
    turns: u8,
}

impl Pace {
    /// The limit of a `wanted` change; below [`FLIPPING`] where the point is to keep what it has.
    pub fn next(&mut self, wanted: f64, most: f64) -> f64 {
        let last = self.limit;
        let size = if last == 0.0 {
            most
        } else if last * wanted < 0.0 {
            self.turns = self.turns.saturating_add(1);
            0.5 * last.abs()
        } else {
            (GROWTH[usize::from(self.turns >= SOME_TURNS)] * last.abs()).min(most)
        };
        self.limit = size.copysign(wanted);
        if self.turns < MOST_TURNS { size } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Moves of a point that wants to go to and fro for ever, `run` moves each way, until it may no more; `None`: it still may after 5000.
    fn moves_until_held(run: usize) -> Option<usize> {
        let mut pace = Pace::default();
        let up = |k: usize| (k / run).is_multiple_of(2);
        (0..5000).find(|&k| pace.next(if up(k) { 0.1 } else { -0.1 }, 0.2) < FLIPPING)
    }

    #[test]
    fn a_point_that_goes_to_and_fro_is_held_in_the_end() {
        // Soon where it turns at each move, or at each other.
        assert!(moves_until_held(1).is_some_and(|moves| moves < 15));
        assert!(moves_until_held(2).is_some_and(|moves| moves < 40));
        // In rounds so long that its limit comes back in each.
        for run in [6, 20] {
            assert!(
                moves_until_held(run).is_some_and(|moves| moves <= run * usize::from(MOST_TURNS)),
                "{run}"
            );
        }
        // One that goes on is never held.
        assert_eq!(moves_until_held(usize::MAX), None);
    }
}
