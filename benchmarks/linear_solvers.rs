//! How long does it take to solve the linear system of a Newton step, by the number of grains?
//!
//! Three ways on the same made-up contact networks: faer's sparse LU (COLAMD), the multifrontal LU that the solver
//! uses, on one thread and on all. The networks have the graph of a packing (a jittered lattice in a cylinder, seven
//! contacts a grain, two points a contact, 40 % sliding), not its geometry: the times are meant.
//!
//! `cargo bench --bench linear_solvers [-- GRAINS ...]` prints CSV: one row a size, way and repetition.
//!
//! `-- condensed GRAINS` factorises networks of condensed grains, whose contact forces are unknowns too, with one point a
//! pair (what lumping a pair's contacts into their resultant would leave) up to three.
//!
//! `-- reference FOLDER GRAINS` measures this crate's LU and LLT and faer's LU (COLAMD; nested dissection of A'A) on one thread
//! in CPU time and writes the matrices for `benchmarks/reference_solvers.py`, which has other libraries solve them;
//! `-- reference-full FOLDER GRAINS` the same with all nodes of 38-cell grains as unknowns.

use riprap::geometry::Polyhedron;
use riprap::grain::stiffness::{sound, stiffness_matrix};
use riprap::linalg::lu::Pattern;
use riprap::linalg::{MultifrontalLu, NodeGraph, SymmetricMatrix, SymmetricPattern};
use riprap::material::Elastic;
use riprap::mesh::grain_mesh;
use riprap::tensor::{Mat3, Vec3};
use std::path::Path;
use std::time::Instant;

#[path = "linear_solvers/faer.rs"]
mod faer;
#[path = "linear_solvers/reference.rs"]
mod reference;

const HEAD: &str = "grains,unknowns,entries,way,threads,analysis_s,factor_s,solve_s,iterations,relative_residual,factor_entries";
const REPETITIONS: usize = 3;
const FRICTION: f64 = 0.65;
const SLIDING: f64 = 0.4;
const HOLD: f64 = 1e-4;
/// Tangential stiffness that a sliding contact keeps in the preconditioner.
const KEPT: f64 = 1e-3;
/// How far a condensed grain's surface gives way under a unit force at the same place, and at another.
const GIVES: [f64; 2] = [0.5, 0.05];

fn main() {
    let words: Vec<String> = std::env::args().filter(|a| a != "--bench").skip(1).collect();
    if let [way @ ("reference" | "reference-full"), folder, grains] =
        &words.iter().map(String::as_str).collect::<Vec<_>>()[..]
    {
        let grains = grains.parse().expect("a number of grains");
        let network = if *way == "reference" { Network::new(grains) } else { Network::full(grains) };
        network.compare(Path::new(folder));
        return;
    }
    if let [way, grains] = &words.iter().map(String::as_str).collect::<Vec<_>>()[..]
        && *way == "condensed"
    {
        println!("{HEAD}");
        for points in 1..=3 {
            let network = Network::condensed(grains.parse().expect("a number of grains"), points);
            for _ in 0..REPETITIONS {
                network.by_fronts(1);
            }
        }
        return;
    }
    let sizes: Vec<usize> = std::env::args().filter_map(|a| a.parse().ok()).collect();
    let sizes = if sizes.is_empty() { vec![100, 300, 1000, 3783] } else { sizes };
    println!("{HEAD}");
    for grains in sizes {
        let network = Network::new(grains);
        for _ in 0..REPETITIONS {
            network.by_faer();
            network.by_fronts(1);
            network.by_fronts(2);
        }
    }
}

/// Numbers between -1 and 1 that repeat (Knuth's linear congruential generator).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }
}

/// A contact point: bodies, lever arms, and its stiffness, exact and symmetrised.
struct Point {
    bodies: [usize; 2],
    arms: [Vec3; 2],
    exact: nalgebra::Matrix3<f64>,
    symmetric: nalgebra::Matrix3<f64>,
}

struct Network {
    grains: usize,
    /// First unknown of each block, and their number.
    first: Vec<u32>,
    pattern: Pattern,
    graph: NodeGraph,
    values: Vec<f64>,
    symmetric: SymmetricMatrix,
    right_side: Vec<f64>,
}

/// Places of grains in a cylinder, the pairs that touch, and the height over the radius.
fn packing(grains: usize, numbers: &mut Numbers) -> (Vec<Vec3>, Vec<[usize; 2]>, f64) {
    // A cylinder of height over diameter 2.17, in units of the lattice.
    let radius = (grains as f64 / (std::f64::consts::TAU * 2.17)).cbrt();
    let reach = 3 + (2.2 * radius) as i64;
    let mut places = vec![];
    for k in -reach..reach {
        for j in -reach..reach {
            for i in -reach..reach {
                let x = Vec3::new(i as f64, j as f64, k as f64) + 0.2 * numbers.vector();
                places.push(((x.xy().norm() / radius).max(x.z.abs() / (2.17 * radius)), x));
            }
        }
    }
    places.sort_by(|a, b| a.0.total_cmp(&b.0));
    let places: Vec<Vec3> = places.into_iter().take(grains).map(|p| p.1).collect();
    // The nearest pairs, seven ends a grain.
    let mut pairs = vec![];
    for (i, a) in places.iter().enumerate() {
        for (j, b) in places.iter().enumerate().skip(i + 1) {
            let distance = (a - b).norm();
            if distance < 1.9 {
                pairs.push((distance, i, j));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    pairs.truncate(7 * grains / 2);
    (places, pairs.into_iter().map(|(_, i, j)| [i, j]).collect(), radius)
}

impl Network {
    fn new(grains: usize) -> Self {
        let mut numbers = Numbers(grains as u64);
        let (places, pairs, radius) = packing(grains, &mut numbers);
        let points: Vec<Point> =
            pairs.iter().flat_map(|&pair| [pair; 2]).map(|pair| point(pair, &places, &mut numbers)).collect();
        let cliques: Vec<[u32; 2]> = pairs.iter().map(|pair| pair.map(|i| i as u32)).collect();
        let graph = NodeGraph::from_cliques(grains, cliques.iter().map(|c| &c[..])).expect("a graph");
        let mut columns: Vec<Vec<(usize, f64)>> = vec![vec![]; 6 * grains];
        let pattern = SymmetricPattern::from_graph(&graph, 6).expect("a pattern");
        let mut symmetric = SymmetricMatrix::zeros(pattern);
        for body in 0..grains {
            // The two ends stand on plates.
            let ends = places[body].z.abs() > 2.17 * radius - 0.7;
            for k in 0..6 {
                let held = HOLD + if ends { 1.0 } else { 0.0 };
                columns[6 * body + k].push((6 * body + k, held));
                assert!(symmetric.add(6 * body + k, 6 * body + k, held));
            }
        }
        for point in &points {
            point.for_each(&point.exact, |row, column, value| columns[column].push((row, value)));
            point.for_each(&point.symmetric, |row, column, value| {
                if row >= column {
                    assert!(symmetric.add(row, column, value));
                }
            });
        }
        let first = (0..=grains).map(|g| 6 * g as u32).collect();
        Network::assembled(grains, first, graph, columns, symmetric, &mut numbers)
    }

    /// Motion of the grains and, as further unknowns, the forces `f` of `points` contact points a pair: bodies balance, and each
    /// point obeys `f = K (motion - sum of flexibilities times forces on its two bodies)` with K its exact stiffness.
    fn condensed(grains: usize, points: usize) -> Self {
        let mut numbers = Numbers(grains as u64);
        let (places, pairs, radius) = packing(grains, &mut numbers);
        let all: Vec<Point> = pairs
            .iter()
            .flat_map(|&pair| std::iter::repeat_n(pair, points))
            .map(|pair| point(pair, &places, &mut numbers))
            .collect();
        let of_force = |k: usize| 6 * grains + 3 * k;
        let mut columns: Vec<Vec<(usize, f64)>> = vec![vec![]; of_force(all.len())];
        let mut on_body: Vec<Vec<usize>> = vec![vec![]; grains];
        for (body, place) in places.iter().enumerate() {
            let ends = place.z.abs() > 2.17 * radius - 0.7;
            // Whole blocks, zeros included.
            for k in 6 * body..6 * body + 6 {
                let held = HOLD + if ends { 1.0 } else { 0.0 };
                columns[k]
                    .extend((6 * body..6 * body + 6).map(|row| (row, if row == k { held } else { 0.0 })));
            }
        }
        for (k, point) in all.iter().enumerate() {
            for (body, motion) in point.bodies.iter().zip(point.motion()) {
                on_body[*body].push(k);
                let follows = point.exact * motion;
                for r in 0..3 {
                    for c in 0..6 {
                        columns[of_force(k) + r].push((6 * body + c, motion[(r, c)]));
                        columns[6 * body + c].push((of_force(k) + r, -follows[(r, c)]));
                    }
                }
            }
            for r in 0..3 {
                columns[of_force(k) + r].push((of_force(k) + r, 1.0));
            }
        }
        for forces in &on_body {
            for &k in forces {
                for &other in forces {
                    let gives = if k == other { GIVES[0] } else { GIVES[1] * numbers.next() };
                    for r in 0..3 {
                        for c in 0..3 {
                            columns[of_force(other) + c]
                                .push((of_force(k) + r, gives * all[k].exact[(r, c)]));
                        }
                    }
                }
            }
        }
        let first = (0..grains).map(|g| 6 * g as u32);
        let first = first.chain((0..=all.len()).map(|k| of_force(k) as u32)).collect();
        // Only its LU is asked for, which needs neither a graph nor a symmetric part.
        let graph = NodeGraph::from_cliques(grains, std::iter::empty()).expect("a graph");
        let symmetric = SymmetricMatrix::zeros(SymmetricPattern::from_graph(&graph, 6).expect("a pattern"));
        Network::assembled(grains, first, graph, columns, symmetric, &mut numbers)
    }

    /// All nodes of grains of about 38 cells; contacts between the surface nodes nearest to one another.
    fn full(grains: usize) -> Self {
        let mut numbers = Numbers(grains as u64);
        let (places, pairs, radius) = packing(grains, &mut numbers);
        let corners: Vec<Vec3> = (0..13).map(|_| 0.5 * numbers.vector().normalize()).collect();
        let shape = Polyhedron::convex_hull(&corners).expect("a hull");
        let mesh = grain_mesh(&shape, 38).expect("a mesh");
        let rock = vec![Elastic::new(1.0, 0.2).expect("allowed"); mesh.cells.len()];
        let stiffness = stiffness_matrix(&mesh, &rock, &sound(rock.len())).expect("a stiffness");
        let nodes = mesh.nodes.len();
        let surface = mesh.surface_nodes();
        // The six surface nodes nearest to where the grain meets a neighbour.
        let meeting = |direction: &Vec3| -> Vec<usize> {
            let mut near: Vec<usize> = surface.iter().map(|node| node.index()).collect();
            near.sort_by(|&a, &b| mesh.nodes[b].dot(direction).total_cmp(&mesh.nodes[a].dot(direction)));
            near.truncate(6);
            near
        };
        let couplings: Vec<([Vec<usize>; 2], Point)> = pairs
            .iter()
            .map(|&[i, j]| {
                let way = (places[j] - places[i]).normalize();
                let at = |grain: usize, way: Vec3| meeting(&way).iter().map(|n| grain * nodes + n).collect();
                ([at(i, way), at(j, -way)], point([i, j], &places, &mut numbers))
            })
            .collect();
        let cells = (0..grains).flat_map(|g| {
            let shift = (g * nodes) as u32;
            mesh.cells.iter().map(move |cell| cell.map(|node| node.0 + shift).to_vec())
        });
        let touching = couplings.iter().map(|(sides, _)| sides.concat().iter().map(|&n| n as u32).collect());
        let cliques: Vec<Vec<u32>> = cells.chain(touching).collect();
        let graph = NodeGraph::from_cliques(grains * nodes, cliques.iter().map(|c| &c[..])).expect("a graph");
        let pattern = SymmetricPattern::from_graph(&graph, 3).expect("a pattern");
        let mut symmetric = SymmetricMatrix::zeros(pattern);
        let mut columns: Vec<Vec<(usize, f64)>> = vec![vec![]; 3 * grains * nodes];
        let mut put = |row: usize, column: usize, exact: f64, even: f64| {
            columns[column].push((row, exact));
            assert!(row < column || symmetric.add(row, column, even));
        };
        for grain in 0..grains {
            let ends = places[grain].z.abs() > 2.17 * radius - 0.7;
            for row in 0..3 * nodes {
                let at = 3 * nodes * grain;
                let held = if ends { 1e-2 } else { HOLD };
                put(at + row, at + row, held, held);
                for other in graph.neighbours(grain * nodes + row / 3).iter().map(|&n| n as usize) {
                    let within = (grain * nodes..(grain + 1) * nodes).contains(&other);
                    for axis in (0..3).filter(|_| within) {
                        let column = 3 * (other - grain * nodes) + axis;
                        let value = stiffness.get(row.max(column), row.min(column));
                        put(at + row, at + column, value, value);
                    }
                }
                for axis in 0..3 {
                    let column = row - row % 3 + axis;
                    let value = stiffness.get(row.max(column), row.min(column));
                    put(at + row, at + column, value, value);
                }
            }
        }
        for (sides, point) in &couplings {
            let signed =
                || sides.iter().zip([-1.0, 1.0]).flat_map(|(s, sign)| s.iter().map(move |&n| (n, sign)));
            for (a, sign_a) in signed() {
                for (b, sign_b) in signed() {
                    let share: f64 = sign_a * sign_b / 36.0;
                    let (exact, even): (Mat3, Mat3) = (point.exact * share, point.symmetric * share);
                    for r in 0..3 {
                        for c in 0..3 {
                            put(3 * a + r, 3 * b + c, exact[(r, c)], even[(r, c)]);
                        }
                    }
                }
            }
        }
        let first = (0..=grains * nodes).map(|n| 3 * n as u32).collect();
        Network::assembled(grains, first, graph, columns, symmetric, &mut numbers)
    }

    /// `columns` hold the exact entries in any order, several of them for the same place.
    fn assembled(
        grains: usize,
        first: Vec<u32>,
        graph: NodeGraph,
        mut columns: Vec<Vec<(usize, f64)>>,
        symmetric: SymmetricMatrix,
        numbers: &mut Numbers,
    ) -> Self {
        let size = columns.len();
        let mut pattern = Pattern { size, column_starts: vec![0], rows: vec![] };
        let mut values = vec![];
        for column in &mut columns {
            column.sort_by_key(|entry| entry.0);
            for &(row, value) in column.iter() {
                let start = pattern.column_starts[pattern.column_starts.len() - 1];
                match pattern.rows[start..].last() {
                    Some(&last) if last == row => *values.last_mut().expect("an entry") += value,
                    _ => {
                        pattern.rows.push(row);
                        values.push(value);
                    }
                }
            }
            pattern.column_starts.push(pattern.rows.len());
        }
        let right_side = (0..size).map(|_| numbers.next()).collect();
        Network { grains, first, pattern, graph, values, symmetric, right_side }
    }

    fn row(
        &self,
        way: &str,
        threads: usize,
        [analysis, factor, solve]: [f64; 3],
        iterations: usize,
        x: &[f64],
        entries: usize,
    ) {
        let mut left = self.right_side.clone();
        self.multiply(x).iter().zip(&mut left).for_each(|(ax, b)| *b -= ax);
        println!(
            "{},{},{},{way},{threads},{analysis:.6},{factor:.6},{solve:.6},{iterations},{:.1e},{entries}",
            self.grains,
            self.pattern.size,
            self.values.len(),
            norm(&left) / norm(&self.right_side),
        );
    }

    fn multiply(&self, x: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; x.len()];
        for column in 0..x.len() {
            for k in self.pattern.column_starts[column]..self.pattern.column_starts[column + 1] {
                product[self.pattern.rows[k]] += self.values[k] * x[column];
            }
        }
        product
    }

    fn by_faer(&self) {
        let start = Instant::now();
        let matrix = self.matrix();
        let mut lu = self::faer::ByColamd::analyse(matrix.symbolic());
        let analysed = Instant::now();
        lu.factorise(matrix);
        let factorised = Instant::now();
        let mut x = self.right_side.clone();
        lu.solve(&mut x);
        self.row("faer LU", 1, times(start, analysed, factorised), 0, &x, 0);
    }

    fn by_fronts(&self, threads: usize) {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let start = Instant::now();
            let mut lu = MultifrontalLu::analyse(self.pattern.clone(), &self.first).expect("analysed");
            let analysed = Instant::now();
            lu.factorise(&self.values).expect("factorised");
            let factorised = Instant::now();
            let mut x = self.right_side.clone();
            lu.solve_in_place(&self.values, &mut x).expect("solved");
            self.row(
                "multifrontal LU",
                threads,
                times(start, analysed, factorised),
                0,
                &x,
                lu.factor_entries(),
            );
        });
    }
}

fn point(bodies: [usize; 2], places: &[Vec3], numbers: &mut Numbers) -> Point {
    let [a, b] = bodies.map(|i| places[i]);
    let normal = ((b - a).normalize() + 0.4 * numbers.vector()).normalize();
    let at = 0.5 * (a + b) + 0.2 * numbers.vector();
    let along = nalgebra::Matrix3::from_fn(|r, c| normal[r] * normal[c]);
    let across = nalgebra::Matrix3::identity() - along;
    let slip = (across * numbers.vector()).normalize();
    let (exact, symmetric) = if numbers.next() < 2.0 * SLIDING - 1.0 {
        (along + FRICTION * slip * normal.transpose(), along + KEPT * across)
    } else {
        (along + across, along + across)
    };
    Point { bodies, arms: [at - a, at - b], exact, symmetric }
}

impl Point {
    /// Relative motion of the point per motion of each of its bodies.
    fn motion(&self) -> [nalgebra::Matrix3x6<f64>; 2] {
        [0, 1].map(|side| {
            let sign = if side == 0 { -1.0 } else { 1.0 };
            let mut motion = nalgebra::Matrix3x6::zeros();
            motion.fixed_view_mut::<3, 3>(0, 0).copy_from(&(nalgebra::Matrix3::identity() * sign));
            motion.fixed_view_mut::<3, 3>(0, 3).copy_from(&(self.arms[side].cross_matrix() * -sign));
            motion
        })
    }

    /// Entries of the 12 x 12 stiffness of relative motion at the point.
    fn for_each(&self, stiffness: &nalgebra::Matrix3<f64>, mut entry: impl FnMut(usize, usize, f64)) {
        let motion = self.motion();
        for row in 0..2 {
            for column in 0..2 {
                let block = motion[row].transpose() * stiffness * motion[column];
                for r in 0..6 {
                    for c in 0..6 {
                        entry(6 * self.bodies[row] + r, 6 * self.bodies[column] + c, block[(r, c)]);
                    }
                }
            }
        }
    }
}

/// CPU time of this thread so far [s].
fn cpu_seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").expect("Linux");
    text.split(' ').next().and_then(|ns| ns.parse::<f64>().ok()).expect("a number") * 1e-9
}

fn times(start: Instant, analysed: Instant, factorised: Instant) -> [f64; 3] {
    let seconds = |from: Instant, to: Instant| (to - from).as_secs_f64();
    [seconds(start, analysed), seconds(analysed, factorised), factorised.elapsed().as_secs_f64()]
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|v| v * v).sum::<f64>().sqrt()
}
