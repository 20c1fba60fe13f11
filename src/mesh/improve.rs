//! Smoothing: moves points, within their freedom, so that the worst cell around each gets better.

use rand_mt::Mt64;

use crate::mesh::tetrahedra::Tetrahedra;
use crate::tensor::Vec3;

/// Points whose cells are all at least this good are left alone.
const GOOD_ENOUGH: f64 = 0.6;

/// Random search: every sweep tries one step for each movable point and keeps it only if the worst
/// radius ratio around the point grows; steps lengthen on success and shrink on failure. Never
/// worsens the worst cell. The directions come from a stream of their own, so the result depends on
/// the mesh alone.
pub(crate) fn smooth(mesh: &mut Tetrahedra, sweeps: usize) {
    let mut random = Mt64::new(SEED);
    let mut steps: Vec<f64> =
        (0..mesh.points.len() as u32).map(|point| 0.3 * shortest_edge_at(mesh, point)).collect();
    for _ in 0..sweeps {
        for point in 0..mesh.points.len() as u32 {
            let direction = Vec3::from_fn(|_, _| symmetric(&mut random));
            let step = steps[point as usize];
            let before = mesh.quality_around(point);
            if before >= GOOD_ENOUGH {
                continue;
            }
            let moved = try_move(mesh, point, &(direction * step), before);
            steps[point as usize] *= if moved { 1.5 } else { 0.9 };
        }
    }
}

/// Works on the worst cell until it reaches `wanted` or no more is to be had in `rounds`: random
/// steps of many lengths for its four points, and for all others around them.
pub(crate) fn lift_worst(mesh: &mut Tetrahedra, wanted: f64, rounds: usize) {
    let mut random = Mt64::new(SEED ^ 0xffff);
    for _ in 0..rounds {
        let worst = (0..mesh.cells.len() as u32).min_by(|&a, &b| mesh.quality(a).total_cmp(&mesh.quality(b)));
        let Some(worst) = worst.filter(|&cell| mesh.quality(cell) < wanted) else { return };
        let mut points: Vec<u32> = mesh.cells[worst as usize]
            .iter()
            .flat_map(|&point| mesh.around[point as usize].iter())
            .flat_map(|&cell| mesh.cells[cell as usize])
            .collect();
        points.sort_unstable();
        points.dedup();
        for point in points {
            let reach = shortest_edge_at(mesh, point);
            for halvings in 0..8 {
                let direction = Vec3::from_fn(|_, _| symmetric(&mut random));
                let before = mesh.quality_around(point);
                try_move(mesh, point, &(direction * (reach * 0.5_f64.powi(halvings))), before);
            }
        }
    }
}

const SEED: u64 = 0x7e77_a11e;

/// Uniform in -1..1.
fn symmetric(random: &mut Mt64) -> f64 {
    (random.next_u64() >> 11) as f64 * (2.0 / (1u64 << 53) as f64) - 1.0
}

fn try_move(mesh: &mut Tetrahedra, point: u32, step: &Vec3, before: f64) -> bool {
    let old = mesh.points[point as usize];
    let Some(new) = mesh.allowed(point, &(old + step)) else { return false };
    mesh.points[point as usize] = new;
    let better = mesh.quality_around(point) > before;
    if !better {
        mesh.points[point as usize] = old;
    }
    better
}

fn shortest_edge_at(mesh: &Tetrahedra, point: u32) -> f64 {
    mesh.around[point as usize]
        .iter()
        .flat_map(|&cell| mesh.cells[cell as usize])
        .filter(|&other| other != point)
        .map(|other| mesh.length(point, other))
        .fold(f64::INFINITY, f64::min)
}
