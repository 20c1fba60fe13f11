//! Broad-phase search: which bounding balls come near each other, by a grid of cubic cells.
//!
//! The order of the answers depends on positions only, never on hashing or threads.

use crate::tensor::Vec3;
use std::collections::BTreeMap;

/// A ball around a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Centre in space [m].
    pub centre: Vec3,
    /// Radius [m].
    pub radius: f64,
}

/// Balls sorted into cubic cells.
#[derive(Debug, Clone)]
pub struct BallGrid {
    cell: f64,
    largest: f64,
    balls: Vec<Ball>,
    cells: BTreeMap<[i64; 3], Vec<usize>>,
}

impl BallGrid {
    /// An empty grid of cells of edge `cell` [m], best near the usual ball diameter.
    pub fn new(cell: f64) -> Self {
        BallGrid { cell, largest: 0.0, balls: vec![], cells: BTreeMap::new() }
    }

    /// Adds a ball; its index is the number of balls added before it.
    pub fn push(&mut self, ball: Ball) {
        self.largest = self.largest.max(ball.radius);
        self.cells.entry(self.cell_of(&ball.centre)).or_default().push(self.balls.len());
        self.balls.push(ball);
    }

    fn cell_of(&self, x: &Vec3) -> [i64; 3] {
        [x.x, x.y, x.z].map(|c| (c / self.cell).floor() as i64)
    }

    /// Indices, ascending, of the balls that come within `margin` [m] of `ball`.
    pub fn near(&self, ball: &Ball, margin: f64) -> Vec<usize> {
        let reach = Vec3::repeat(ball.radius + self.largest + margin);
        let (low, high) = (self.cell_of(&(ball.centre - reach)), self.cell_of(&(ball.centre + reach)));
        let mut found = vec![];
        for i in low[0]..=high[0] {
            for j in low[1]..=high[1] {
                for (_, members) in self.cells.range([i, j, low[2]]..=[i, j, high[2]]) {
                    found.extend(members.iter().copied().filter(|&k| {
                        let other = &self.balls[k];
                        let reach = ball.radius + other.radius + margin;
                        (other.centre - ball.centre).norm_squared() <= reach * reach
                    }));
                }
            }
        }
        found.sort_unstable();
        found
    }
}

/// All pairs `(i, j)`, `i < j`, of balls within `margin` [m] of each other, in ascending order.
pub fn near_pairs(balls: &[Ball], margin: f64) -> Vec<(usize, usize)> {
    let largest = balls.iter().map(|b| b.radius).fold(0.0, f64::max);
    if balls.is_empty() || largest <= 0.0 {
        return vec![];
    }
    let mut grid = BallGrid::new(2.0 * largest);
    let mut pairs = vec![];
    for (j, ball) in balls.iter().enumerate() {
        pairs.extend(grid.near(ball, margin).into_iter().map(|i| (i, j)));
        grid.push(*ball);
    }
    pairs.sort_unstable();
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(50))]
        #[test]
        fn grid_finds_what_comparing_all_finds(
            balls in prop::collection::vec((-5.0..5.0f64, -5.0..5.0f64, -5.0..5.0f64, 0.01..1.0f64), 1..60),
            margin in 0.0..0.5f64,
        ) {
            let balls: Vec<Ball> =
                balls.iter().map(|&(x, y, z, radius)| Ball { centre: Vec3::new(x, y, z), radius }).collect();
            let mut expected = vec![];
            for i in 0..balls.len() {
                for j in i + 1..balls.len() {
                    let reach = balls[i].radius + balls[j].radius + margin;
                    if (balls[i].centre - balls[j].centre).norm_squared() <= reach * reach {
                        expected.push((i, j));
                    }
                }
            }
            prop_assert_eq!(near_pairs(&balls, margin), expected);
        }
    }

    #[test]
    fn nothing_is_near_nothing() {
        assert!(near_pairs(&[], 1.0).is_empty());
    }
}
