//! Draping a cover over the grains: a grid of nodes around the specimen is shot radially inwards,
//! and each node sticks to the first grain surface that it meets.

use std::collections::BTreeMap;

use crate::error::{Error, Result};
use crate::tensor::Vec3;

use super::bridging;
use super::outline::{DrapeStatistics, Outline, Rim};
use super::{CoverNode, PressureCover};

#[derive(Debug, Clone, Copy)]
struct Hit {
    node: CoverNode,
    /// Distance from the axis [m].
    radius: f64,
}

/// The grid of nodes: `rings` from the bottom rim to the top rim, `count` nodes each, every
/// other ring turned by half a step.
struct Grid {
    count: usize,
    rings: usize,
    rims: [Rim; 2],
}

impl Grid {
    fn len(&self) -> usize {
        self.rings * self.count
    }

    fn node(&self, ring: usize, step: usize) -> usize {
        ring * self.count + step % self.count
    }

    fn is_rim(&self, node: usize) -> bool {
        node < self.count || node >= self.len() - self.count
    }

    fn radius(&self) -> f64 {
        0.5 * (self.rims[0].radius + self.rims[1].radius)
    }

    /// Centre of the node's ring [m], outward unit vector at the node, and angle [rad].
    fn ray(&self, node: usize) -> (Vec3, Vec3, f64) {
        let (ring, step) = (node / self.count, node % self.count);
        let share = ring as f64 / (self.rings - 1) as f64;
        let centre = self.rims[0].centre * (1.0 - share) + self.rims[1].centre * share;
        let angle = std::f64::consts::TAU * (step as f64 + 0.5 * (ring % 2) as f64) / self.count as f64;
        (centre, Vec3::new(angle.cos(), angle.sin(), 0.0), angle)
    }

    fn side(&self) -> Vec<[usize; 3]> {
        let mut facets = Vec::with_capacity(2 * self.len());
        for ring in 0..self.rings - 1 {
            for step in 0..self.count {
                let [low, low_next] = [self.node(ring, step), self.node(ring, step + 1)];
                let [high, high_next] = [self.node(ring + 1, step), self.node(ring + 1, step + 1)];
                if ring % 2 == 0 {
                    facets.extend([[low, low_next, high], [low_next, high_next, high]]);
                } else {
                    facets.extend([[low, low_next, high_next], [low, high_next, high]]);
                }
            }
        }
        facets
    }

    /// Distance of the rings and of the nodes in a ring [m], on the mean rim radius.
    fn spacings(&self) -> [f64; 2] {
        let height = self.rims[1].centre.z - self.rims[0].centre.z;
        let around = std::f64::consts::TAU * self.radius() / self.count as f64;
        [height / (self.rings - 1) as f64, around]
    }
}

impl PressureCover {
    /// Drapes a cover over `outlines` between the bottom and the top rim.
    ///
    /// Nodes about `spacing` [m] apart are shot horizontally towards the axis and stick to the first
    /// outline that they meet. A node that meets none, or that ends more than `pore_depth` [m] inside
    /// the outermost node within `2 pore_depth` of it, has met a pore: it is taken out, and facets
    /// between the nodes around it span the pore. About 0.4 and 0.5 of the median grain size
    /// are sensible; the module's head says how much each matters.
    ///
    /// # Errors
    /// [`Error::Specimen`] where lengths are not positive and finite, the top rim is not above the
    /// bottom rim, or a quarter of the side or more has no grain.
    pub fn drape(outlines: &[Outline], rims: &[Rim; 2], spacing: f64, pore_depth: f64) -> Result<Self> {
        let grid = grid(rims, spacing, pore_depth)?;
        let hits = shoot(outlines, &grid);
        let depths = depths(&hits, &grid, 2.0 * pore_depth);
        let in_pore: Vec<bool> = (0..grid.len())
            .map(|node| !grid.is_rim(node) && depths[node].is_none_or(|depth| depth > pore_depth))
            .collect();

        let chart: Vec<[f64; 2]> = (0..grid.len())
            .map(|node| {
                let (centre, _, angle) = grid.ray(node);
                [angle * grid.radius(), centre.z - rims[0].centre.z]
            })
            .collect();
        let period = std::f64::consts::TAU * grid.radius();
        let side = bridging::take_out(grid.side(), &chart, period, &in_pore)?;

        let mut renumbered = vec![usize::MAX; grid.len()];
        let mut nodes = Vec::with_capacity(grid.len());
        let mut radii = vec![];
        for node in (0..grid.len()).filter(|&node| !in_pore[node]) {
            renumbered[node] = nodes.len();
            let (centre, outwards, _) = grid.ray(node);
            match &hits[node] {
                Some(hit) if !grid.is_rim(node) => {
                    radii.push(hit.radius);
                    nodes.push(hit.node);
                }
                _ => {
                    let rim = &rims[usize::from(node >= grid.count)];
                    let point = rim.pose.to_body(&(centre + outwards * rim.radius));
                    nodes.push(CoverNode { body: rim.body, point });
                }
            }
        }
        let side = side.iter().map(|facet| facet.map(|node| renumbered[node])).collect();
        let (count, total) = (grid.count, nodes.len());
        let top = total - count;
        let caps = (1..count - 1).flat_map(|k| [[0, k + 1, k], [top, top + k, top + k + 1]]).collect();
        let statistics = DrapeStatistics {
            bridged_nodes: in_pore.iter().filter(|&&pore| pore).count(),
            mean_radius: radii.iter().sum::<f64>() / radii.len().max(1) as f64,
        };
        PressureCover::closed(nodes, BTreeMap::new(), side, caps, [0..count, top..total], statistics)
    }
}

fn grid(rims: &[Rim; 2], spacing: f64, pore_depth: f64) -> Result<Grid> {
    let height = rims[1].centre.z - rims[0].centre.z;
    let lengths = [
        ("spacing", spacing),
        ("pore depth", pore_depth),
        ("bottom radius", rims[0].radius),
        ("top radius", rims[1].radius),
        ("height", height),
    ];
    for (name, length) in lengths {
        if !(length > 0.0 && length.is_finite()) {
            return Err(Error::Specimen(format!(
                "the cover's {name} must be a positive length, not {length} m"
            )));
        }
    }
    let mut grid = Grid { count: 0, rings: 0, rims: *rims };
    let count = (std::f64::consts::TAU * grid.radius() / spacing).ceil().max(8.0);
    let intervals = (height / spacing).ceil().max(2.0);
    if count * intervals > MOST_NODES {
        return Err(Error::Specimen(format!(
            "the cover would have {:.1e} nodes at a spacing of {spacing} m, more than {MOST_NODES:.0e}",
            count * intervals
        )));
    }
    (grid.count, grid.rings) = (count as usize, intervals as usize + 1);
    Ok(grid)
}

/// Far above any sensible cover; keeps a wrong unit from filling the memory.
const MOST_NODES: f64 = 1e7;

/// The first outline that each node off the rims meets.
fn shoot(outlines: &[Outline], grid: &Grid) -> Vec<Option<Hit>> {
    let reaches: Vec<f64> = outlines.iter().map(Outline::reach).collect();
    // Start outside everything.
    let mut start = grid.radius();
    for (outline, reach) in outlines.iter().zip(&reaches) {
        for rim in &grid.rims {
            start = start.max((outline.pose.position - rim.centre).xy().norm() + 1.001 * reach);
        }
    }
    let shoot_one = |node: usize| {
        if grid.is_rim(node) {
            return None;
        }
        let (centre, outwards, _) = grid.ray(node);
        let (origin, inwards) = (centre + outwards * start, -outwards);
        let mut first: Option<(f64, &Outline)> = None;
        for (outline, reach) in outlines.iter().zip(&reaches) {
            // The ray is a line through the axis: what lies farther beside it cannot be met.
            let off = outline.pose.position - centre;
            let beside = off.x * outwards.y - off.y * outwards.x;
            if off.z * off.z + beside * beside > reach * reach {
                continue;
            }
            if let Some(distance) = outline.entry(&origin, &inwards)
                && distance <= start
                && first.is_none_or(|(nearest, _)| distance < nearest)
            {
                first = Some((distance, outline));
            }
        }
        first.map(|(distance, outline)| {
            let point = outline.pose.to_body(&(origin + inwards * distance));
            Hit { node: CoverNode { body: outline.body, point }, radius: start - distance }
        })
    };
    (0..grid.len()).map(shoot_one).collect()
}

/// How far each hit lies inside the outermost one within `window` [m] of it.
fn depths(hits: &[Option<Hit>], grid: &Grid, window: f64) -> Vec<Option<f64>> {
    let [up, around] = grid.spacings();
    let (rings, steps) = ((window / up) as usize, ((window / around) as usize).min(grid.count / 2));
    let depth_of = |node: usize| {
        let radius = hits[node]?.radius;
        let (ring, step) = (node / grid.count, node % grid.count);
        let mut outermost = radius;
        for other_ring in ring.saturating_sub(rings)..=(ring + rings).min(grid.rings - 1) {
            for turn in 0..=2 * steps {
                let other = grid.node(other_ring, step + grid.count - steps + turn);
                if let Some(hit) = &hits[other] {
                    outermost = f64::max(outermost, hit.radius);
                }
            }
        }
        Some(outermost - radius)
    };
    (0..grid.len()).map(depth_of).collect()
}
