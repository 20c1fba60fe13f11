//! The tet10 cell on problems with known displacement fields, boundary nodes prescribed, inner nodes solved.
//!
//! - Constant strain, six modes, on a distorted grain mesh: exact (Irons' patch test); 1e-10 relative,
//!   a few digits above the rounding of one factorisation.
//! - Pure bending, `u = kappa (x y, -(x^2 + nu (y^2 - z^2)) / 2, -nu y z)`, stress `E kappa y` along x and nothing
//!   else (Timoshenko & Goodier, "Theory of Elasticity", art. 102): quadratic, so in the space of the cell; 1e-9.
//! - Manufactured solution `u = a sin(k.x + c)` with body force
//!   `f = ((lambda + mu) k (k.a) + mu |k|^2 a) sin(k.x + c)`: L2 error of order 3, energy error of order 2
//!   (Ciarlet, "The Finite Element Method for Elliptic Problems", thms. 3.2.2, 3.2.5). Observed orders may
//!   fall short by 0.15: two meshes of finite size.

use nalgebra::Vector6;

use crate::element::{POINTS, StraightTet10, tet10::mass_share, tet10::shape_functions};
use crate::geometry::Polyhedron;
use crate::linalg::{NodeGraph, Ordering, SparseCholesky, SymmetricMatrix, SymmetricPattern};
use crate::material::{Elastic, Secant};
use crate::mesh::{Mesh, NodeId, cuboid_mesh, grain_mesh};
use crate::tensor::{Mat3, Vec3};
use crate::verification::{Absolute, Findings, Short, timed, worse};

const E: f64 = 30e9;
const NU: f64 = 0.2;

fn rock() -> Elastic {
    Elastic::new(E, NU).expect("allowed")
}

/// A lopsided polyhedron, so that no cell is regular.
fn distorted_mesh() -> Mesh {
    let points = [
        [1.0, 0.1, 0.2],
        [-0.8, 0.3, -0.1],
        [0.1, 1.2, 0.3],
        [0.2, -1.0, 0.1],
        [0.0, 0.2, 1.4],
        [-0.1, 0.1, -1.1],
        [0.7, 0.6, -0.6],
        [-0.6, -0.6, 0.7],
        [0.6, -0.5, -0.7],
        [-0.5, 0.7, 0.6],
    ]
    .map(Vec3::from);
    grain_mesh(&Polyhedron::convex_hull(&points).expect("a hull"), 120).expect("a mesh")
}

/// Solves for the inner nodes with `exact` on the surface and the body force `force` (interpolated at the nodes).
fn solve(mesh: &Mesh, exact: impl Fn(&Vec3) -> Vec3, force: impl Fn(&Vec3) -> Vec3) -> Vec<Vec3> {
    let surface = mesh.surface_nodes();
    let mut unknown = vec![None; mesh.nodes.len()];
    let mut count = 0;
    for (node, slot) in unknown.iter_mut().enumerate() {
        if surface.binary_search(&NodeId(node as u32)).is_err() {
            *slot = Some(count);
            count += 1;
        }
    }
    let mut u: Vec<Vec3> = mesh.nodes.iter().map(&exact).collect();
    let cliques: Vec<Vec<u32>> = mesh
        .cells
        .iter()
        .map(|cell| cell.iter().filter_map(|node| unknown[node.index()]).collect())
        .collect();
    let graph = NodeGraph::from_cliques(count as usize, cliques.iter().map(|c| &c[..])).expect("in range");
    let mut k = SymmetricMatrix::zeros(SymmetricPattern::from_graph(&graph, 3).expect("small"));
    let mut rhs = vec![0.0; 3 * count as usize];
    for (cell, nodes) in mesh.cell_ids().zip(&mesh.cells) {
        let element = StraightTet10::new(&mesh.corners(cell)).expect("a cell");
        let mut local = [[Mat3::zeros(); 10]; 10];
        element.add_stiffness(&mut local, &rock(), &[Secant::SOUND; 4]);
        for i in 0..10 {
            let Some(row) = unknown[nodes[i].index()] else { continue };
            for j in 0..10 {
                let body = force(&mesh.nodes[nodes[j].index()]) * (element.volume * mass_share(i, j));
                let known = match unknown[nodes[j].index()] {
                    None => local[i][j] * u[nodes[j].index()],
                    Some(_) => Vec3::zeros(),
                };
                for a in 0..3 {
                    rhs[3 * row as usize + a] += body[a] - known[a];
                    if let Some(column) = unknown[nodes[j].index()].filter(|column| *column <= row) {
                        for b in 0..if column == row { a + 1 } else { 3 } {
                            let (p, q) = (3 * row as usize + a, 3 * column as usize + b);
                            let known = k.add(p, q, local[i][j][(a, b)]);
                            debug_assert!(known, "in the pattern");
                        }
                    }
                }
            }
        }
    }
    let ordering = Ordering::nested_dissection(&graph, 3).expect("an ordering");
    let mut factor = SparseCholesky::analyse(k.pattern(), &ordering).expect("analysed");
    factor.factorise(&k).expect("factorised");
    let mut x = rhs;
    factor.back_substitute(&mut x, 1).expect("solved");
    for (u, unknown) in u.iter_mut().zip(&unknown) {
        if let Some(unknown) = unknown {
            let first = 3 * *unknown as usize;
            *u = Vec3::new(x[first], x[first + 1], x[first + 2]);
        }
    }
    u
}

fn largest(u: impl IntoIterator<Item = f64>) -> f64 {
    u.into_iter().fold(0.0, worse)
}

/// Largest errors of displacement and stress over the largest of each.
fn errors(mesh: &Mesh, exact: impl Fn(&Vec3) -> Vec3, stress: impl Fn(&Vec3) -> Vector6<f64>) -> [f64; 2] {
    let u = solve(mesh, &exact, |_| Vec3::zeros());
    let scale = largest(mesh.nodes.iter().map(|x| exact(x).norm()));
    let error = largest(mesh.nodes.iter().zip(&u).map(|(x, u)| (exact(x) - u).norm()));
    let displacement = error / scale;
    let scale = largest(mesh.nodes.iter().map(|x| stress(x).norm()));
    let mut worst: f64 = 0.0;
    for (cell, nodes) in mesh.cell_ids().zip(&mesh.cells) {
        let corners = mesh.corners(cell);
        let element = StraightTet10::new(&corners).expect("a cell");
        let found = element.stresses(&rock(), &nodes.map(|node| u[node.index()]));
        for (l, found) in POINTS.iter().zip(found) {
            let x: Vec3 = corners.iter().zip(l).map(|(corner, l)| corner * *l).sum();
            worst = worse(worst, (found - stress(&x)).norm() / scale);
        }
    }
    [displacement, worst]
}

/// Constant strain, one of six modes.
fn patch(mode: usize) -> [f64; 2] {
    let mesh = distorted_mesh();
    let strain = Vector6::ith(mode, 1e-3);
    let half = 0.5e-3;
    let mut gradient = Mat3::zeros();
    match mode {
        0..3 => gradient[(mode, mode)] = 1e-3,
        _ => {
            let (i, j) = [(0, 1), (1, 2), (2, 0)][mode - 3];
            (gradient[(i, j)], gradient[(j, i)]) = (half, half);
        }
    }
    let shift = Vec3::new(1e-4, -2e-4, 3e-4);
    errors(&mesh, |x| gradient * x + shift, |_| rock().stress(&strain))
}

/// Pure bending.
fn bending() -> [f64; 2] {
    let kappa = 1e-3;
    let bending = |p: &Vec3| {
        let (x, y, z) = (p.x, p.y, p.z);
        Vec3::new(x * y, -0.5 * (x * x + NU * (y * y - z * z)), -NU * y * z) * kappa
    };
    let stress = |p: &Vec3| Vector6::ith(0, E * kappa * p.y);
    errors(&distorted_mesh(), bending, stress)
}

/// Gauss-Legendre with four points a direction on the cube, collapsed to the tetrahedron: degree 5.
fn quadrature() -> Vec<([f64; 4], f64)> {
    let (p, q) = (0.339_981_043_584_856_3, 0.861_136_311_594_052_6);
    let (v, w) = (0.652_145_154_862_546_1, 0.347_854_845_137_453_9);
    let line = [(-q, w), (-p, v), (p, v), (q, w)].map(|(x, w)| (0.5 * (1.0 + x), 0.5 * w));
    let mut rule = Vec::new();
    for (r, wr) in line {
        let rest: f64 = 1.0 - r;
        for (s, ws) in line {
            for (t, wt) in line {
                let l = [r, rest * s, rest * (1.0 - s) * t];
                // Volume 1/6 of the unit tetrahedron, so that the weights sum to one.
                let weight = 6.0 * wr * ws * wt * rest.powi(2) * (1.0 - s);
                rule.push(([l[0], l[1], l[2], 1.0 - l[0] - l[1] - l[2]], weight));
            }
        }
    }
    rule
}

/// Observed orders of displacement (L2) and energy from 3 to 6 cells along each edge.
fn convergence() -> [f64; 2] {
    let (a, k, c) = (Vec3::new(1.0, -0.5, 0.7), Vec3::new(3.3, 2.1, -2.7), 0.4);
    let (lambda, mu) = rock().lame();
    let exact = |x: &Vec3| a * (k.dot(x) + c).sin();
    let force =
        |x: &Vec3| (k * ((lambda + mu) * k.dot(&a)) + a * (mu * k.norm_squared())) * (k.dot(x) + c).sin();
    let strain = |x: &Vec3| {
        let g = a * k.transpose() * (k.dot(x) + c).cos();
        Vector6::new(
            g[(0, 0)],
            g[(1, 1)],
            g[(2, 2)],
            g[(0, 1)] + g[(1, 0)],
            g[(1, 2)] + g[(2, 1)],
            g[(2, 0)] + g[(0, 2)],
        )
    };
    let rule = quadrature();
    let mut found = Vec::new();
    for cells in [3, 6] {
        let mesh = cuboid_mesh([1.0; 3], 1.0 / cells as f64).expect("a mesh");
        let u = solve(&mesh, exact, force);
        let (mut square, mut energy) = (0.0, 0.0);
        for (cell, nodes) in mesh.cell_ids().zip(&mesh.cells) {
            let corners = mesh.corners(cell);
            let element = StraightTet10::new(&corners).expect("a cell");
            let nodal = nodes.map(|node| u[node.index()]);
            for (l, weight) in &rule {
                let x: Vec3 = corners.iter().zip(l).map(|(corner, l)| corner * *l).sum();
                let value: Vec3 = shape_functions(l).iter().zip(&nodal).map(|(n, u)| u * *n).sum();
                square += (value - exact(&x)).norm_squared() * weight * element.volume;
                energy += rock().energy_density(&(element.strain(l, &nodal) - strain(&x)))
                    * weight
                    * element.volume;
            }
        }
        found.push((square.sqrt(), energy.sqrt()));
    }
    let order = |coarse: f64, fine: f64| (coarse / fine).log2();
    [order(found[0].0, found[1].0), order(found[0].1, found[1].1)]
}

pub(super) fn tet10(findings: &mut Findings) {
    let mut exact = |what: String, (errors, time): ([f64; 2], std::time::Duration), tolerance: f64| {
        for (error, of) in errors.into_iter().zip(["displacement", "stress"]) {
            let cost = (1, time);
            findings.compare(format!("{what}: {of} off"), error, 0.0, Absolute(tolerance), cost);
        }
    };
    for mode in 0..6 {
        exact(format!("constant strain, mode {mode}"), timed(|| patch(mode)), 1e-10);
    }
    exact("pure bending".into(), timed(bending), 1e-9);
    let (orders, time) = timed(convergence);
    for (order, (of, expected)) in orders.into_iter().zip([("displacement (L2)", 3.0), ("energy", 2.0)]) {
        let what = format!("observed order of the {of}, at least {expected}");
        findings.compare(what, order, expected, Short(0.15), (2, time));
    }
}
