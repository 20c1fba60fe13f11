//! Condensed grains against solutions that share nothing with the condensation but the element.
//!
//! Same loads on the full mesh, held at six other supports: stresses and energies agree to 1e-8 relative (the condensation
//! is exact, what is left is rounding times the condition of K).

use nalgebra::DMatrix;

use crate::geometry::Polyhedron;
use crate::grain::stiffness::{node_graph, sound, stiffness_matrix};
use crate::grain::{CondensedGrain, SurfacePoint};
use crate::linalg::{Ordering, SparseCholesky};
use crate::material::Elastic;
use crate::mesh::{Mesh, grain_mesh};
use crate::tensor::Vec3;
use crate::verification::{Absolute, Findings, timed, worse};

/// A grain for the problems: ten corners, uneven, centred on its centroid.
/// Stretched along z to `top` and `-bottom` [mm].
pub fn sample_grain([top, bottom]: [f64; 2]) -> Polyhedron {
    let points = [
        [11.0, 1.0, 2.0],
        [-8.0, 3.0, -1.0],
        [1.0, 11.0, 3.0],
        [2.0, -10.0, 1.0],
        [0.0, 2.0, top],
        [-1.0, 1.0, -bottom],
        [7.0, 6.0, -6.0],
        [-6.0, -6.0, 7.0],
        [6.0, -5.0, -7.0],
        [-5.0, 7.0, 6.0],
    ]
    .map(|p| Vec3::from(p) * 1e-3);
    let hull = Polyhedron::convex_hull(&points).expect("a hull");
    hull.translated(&-hull.centroid())
}

/// Rock that varies from cell to cell.
pub fn rocks(mesh: &Mesh) -> Vec<Elastic> {
    (0..mesh.cells.len())
        .map(|k| Elastic::new(30e9 * (1.0 + 0.3 * (k as f64).sin()), 0.2).expect("allowed"))
        .collect()
}

/// Forces at points of the surface, with zero resultant and moment.
fn balanced_loads(grain: &CondensedGrain) -> Vec<(SurfacePoint, Vec3)> {
    let places = [
        [1.0, 0.2, 0.3],
        [-0.5, 1.0, -0.2],
        [-0.4, -0.9, 0.4],
        [0.1, 0.0, -1.0],
        [0.3, 0.8, 0.9],
        [-1.0, 0.1, 0.2],
    ];
    let points: Vec<SurfacePoint> = places.iter().map(|p| grain.locate(&(Vec3::from(*p) * 0.02))).collect();
    let mut forces: Vec<Vec3> = (0..6)
        .map(|k| Vec3::new((k as f64).cos(), (2.0 * k as f64).sin(), 0.3 * k as f64 - 0.7) * 100.0)
        .collect();
    // The smallest change of the forces (least squares) that balances them: the six equations B f = 0.
    let b = DMatrix::from_fn(6, 18, |row, column| {
        let unit = Vec3::ith(column % 3, 1.0);
        if row < 3 { unit[row] } else { (points[column / 3].position * 100.0).cross(&unit)[row - 3] }
    });
    let f = nalgebra::DVector::from_iterator(18, forces.iter().flatten().copied());
    let correction = b.transpose() * (&b * b.transpose()).lu().solve(&(&b * &f)).expect("spread-out points");
    for (k, force) in forces.iter_mut().enumerate() {
        *force -= Vec3::new(correction[3 * k], correction[3 * k + 1], correction[3 * k + 2]);
    }
    points.into_iter().zip(forces).collect()
}

/// The largest stress error over the largest stress, and the errors of both energies over the work of the loads.
pub fn condensed_against_full() -> [f64; 3] {
    let mesh = grain_mesh(&sample_grain([16.0, 13.0]), 38).expect("a mesh");
    let rock = rocks(&mesh);
    let grain = CondensedGrain::new(mesh.clone(), &rock, 2700.0).expect("a grain");
    let loads = balanced_loads(&grain);
    let condensed = grain.nodal_displacements(&loads);

    let mut k = stiffness_matrix(&mesh, &rock, &sound(rock.len())).expect("a stiffness");
    let mut f = vec![0.0; 3 * mesh.nodes.len()];
    for (point, force) in &loads {
        for &(node, weight) in &point.shares {
            let node = grain.surface().nodes()[node as usize].index();
            (0..3).for_each(|axis| f[3 * node + axis] += weight * force[axis]);
        }
    }
    // Six springs to the ground at three corners of the first cell. Balanced loads leave them without
    // reactions, however stiff they are.
    let corner = |c: usize| mesh.cells[0][c].index();
    for (node, axis) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)] {
        let known = k.add(3 * corner(node) + axis, 3 * corner(node) + axis, 1e9);
        debug_assert!(known, "on the diagonal");
    }
    let ordering = Ordering::nested_dissection(&node_graph(&mesh).expect("a graph"), 3).expect("an ordering");
    let mut factor = SparseCholesky::analyse(k.pattern(), &ordering).expect("analysed");
    factor.factorise(&k).expect("supports hold the grain");
    let mut x = f.clone();
    factor.back_substitute(&mut x, 1).expect("solved");
    let full: Vec<Vec3> = x.chunks_exact(3).map(|u| Vec3::new(u[0], u[1], u[2])).collect();

    let (a, b) = (grain.cell_stresses(&condensed), grain.cell_stresses(&full));
    let scale = a.iter().flatten().map(|s| s.norm()).fold(0.0, f64::max);
    let stress =
        a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).norm() / scale).fold(0.0, worse);
    let work = |u: &[Vec3]| -> f64 {
        (0..u.len()).map(|n| (0..3).map(|axis| 0.5 * f[3 * n + axis] * u[n][axis]).sum::<f64>()).sum()
    };
    let energy = grain.elastic_energy(&loads);
    [stress, (work(&full) / energy - 1.0).abs(), (work(&condensed) / energy - 1.0).abs()]
}

pub(super) fn condensed(findings: &mut Findings) {
    let (errors, time) = timed(condensed_against_full);
    for (error, of) in
        errors.into_iter().zip(["stress", "work on the full mesh", "work on the condensed one"])
    {
        let cost = (2, time);
        findings.compare(format!("condensed = full: {of} off"), error, 0.0, Absolute(1e-8), cost);
    }
}
