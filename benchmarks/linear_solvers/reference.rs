//! This crate's LU, its LLT and faer's LU on one thread in CPU seconds; the matrices for `benchmarks/reference_solvers.py`.

use super::faer::{ByColamd, Ordered};
use super::{Network, REPETITIONS, cpu_seconds, norm};
use ::faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use riprap::linalg::{MultifrontalLu, NodeGraph, Ordering, SparseCholesky};
use std::path::Path;

const HEAD: &str = "grains,unknowns,entries,library,way,analysis_cpu_s,factor_cpu_s,again_cpu_s,solve_cpu_s,relative_residual,factor_entries";

/// CPU seconds at the start and after analysis, first and second factorisation and solution.
struct Clock(Vec<f64>);

impl Clock {
    fn start() -> Self {
        Clock(vec![cpu_seconds()])
    }

    fn mark(&mut self) {
        self.0.push(cpu_seconds());
    }
}

impl Network {
    /// Writes the matrices into a folder, then prints CSV.
    pub fn compare(&self, folder: &Path) {
        self.write(folder);
        println!("{HEAD}");
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
        pool.install(|| {
            for _ in 0..REPETITIONS {
                self.by_own_lu();
                self.by_own_llt();
                self.by_faer_colamd();
                self.by_faer_dissected();
            }
        });
    }

    fn write(&self, folder: &Path) {
        std::fs::create_dir_all(folder).expect("a folder");
        let write = |name: &str, bytes: Vec<u8>| std::fs::write(folder.join(name), bytes).expect("written");
        let whole = |list: &[usize]| list.iter().flat_map(|&k| (k as i64).to_le_bytes()).collect::<Vec<u8>>();
        let real = |list: &[f64]| list.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
        let mut even = Vec::with_capacity(self.values.len());
        for (column, range) in self.pattern.column_starts.windows(2).enumerate() {
            let rows = &self.pattern.rows[range[0]..range[1]];
            even.extend(rows.iter().map(|&row| self.symmetric.get(row.max(column), row.min(column))));
        }
        write("starts.i64", whole(&self.pattern.column_starts));
        write("rows.i64", whole(&self.pattern.rows));
        write("exact.f64", real(&self.values));
        write("symmetric.f64", real(&even));
        write("right_side.f64", real(&self.right_side));
    }

    fn print(&self, library: &str, way: &str, clock: &Clock, left: f64, entries: usize) {
        let spans: Vec<String> = clock.0.windows(2).map(|m| format!("{:.4}", m[1] - m[0])).collect();
        let (size, given, spans) = (self.pattern.size, self.values.len(), spans.join(","));
        println!("{},{size},{given},{library},{way},{spans},{left:.1e},{entries}", self.grains);
    }

    fn left(&self, x: &[f64]) -> f64 {
        let mut left = self.right_side.clone();
        self.multiply(x).iter().zip(&mut left).for_each(|(ax, b)| *b -= ax);
        norm(&left) / norm(&self.right_side)
    }

    /// An analysis, two factorisations and a solution, each timed.
    fn timed<L>(
        &self,
        analyse: impl FnOnce() -> L,
        factorise: impl Fn(&mut L),
        solve: impl FnOnce(&mut L, &mut [f64]),
    ) -> (Clock, L, Vec<f64>) {
        let mut clock = Clock::start();
        let mut factor = analyse();
        clock.mark();
        for _ in 0..2 {
            factorise(&mut factor);
            clock.mark();
        }
        let mut x = self.right_side.clone();
        solve(&mut factor, &mut x);
        clock.mark();
        (clock, factor, x)
    }

    fn by_own_lu(&self) {
        let (clock, lu, x) = self.timed(
            || MultifrontalLu::analyse(self.pattern.clone(), &self.first).expect("analysed"),
            |lu| lu.factorise(&self.values).expect("factorised"),
            |lu, x| {
                lu.solve_in_place(&self.values, x).expect("solved");
            },
        );
        self.print("riprap", "LU", &clock, self.left(&x), lu.factor_entries());
    }

    fn by_own_llt(&self) {
        let analyse = || {
            let width = (self.first[1] - self.first[0]) as usize;
            let ordering = Ordering::nested_dissection(&self.graph, width).expect("an ordering");
            SparseCholesky::analyse(self.symmetric.pattern(), &ordering).expect("analysed")
        };
        let (clock, ..) = self.timed(
            analyse,
            |factor| factor.factorise(&self.symmetric).expect("factorised"),
            |factor, x| factor.back_substitute(x, 1).expect("solved"),
        );
        self.print("riprap", "LLT", &clock, f64::NAN, 0);
    }

    fn by_faer_colamd(&self) {
        let matrix = self.matrix();
        let (clock, _, x) = self.timed(
            || ByColamd::analyse(matrix.symbolic()),
            |lu| lu.factorise(matrix),
            |lu, x| lu.solve(x),
        );
        self.print("faer", "LU (COLAMD)", &clock, self.left(&x), 0);
    }

    /// Nested dissection of the graph of A'A, on blocks as this crate's LU dissects the graph of A.
    fn by_faer_dissected(&self) {
        let matrix = self.matrix();
        let analyse = || {
            let blocks = self.graph.len();
            let rows: Vec<Vec<u32>> = (0..blocks)
                .map(|node| self.graph.neighbours(node).iter().copied().chain([node as u32]).collect())
                .collect();
            let graph = NodeGraph::from_cliques(blocks, rows.iter().map(|row| &row[..])).expect("a graph");
            let Ok(Ordering::Given(order)) = Ordering::nested_dissection(&graph, 1) else {
                panic!("no ordering");
            };
            let (first, nodes) = (&self.first, order.forward().iter().map(|&node| node as usize));
            let order: Vec<usize> = nodes.flat_map(|k| first[k] as usize..first[k + 1] as usize).collect();
            Ordered::analyse(matrix.symbolic(), &order)
        };
        let (clock, _, x) = self.timed(analyse, |lu| lu.factorise(matrix), |lu, x| lu.solve(x));
        self.print("faer", "LU (nested dissection of A'A)", &clock, self.left(&x), 0);
    }

    pub fn matrix(&self) -> SparseColMatRef<'_, usize, f64> {
        let (size, starts, rows) = (self.pattern.size, &self.pattern.column_starts, &self.pattern.rows);
        SparseColMatRef::new(
            SymbolicSparseColMatRef::new_checked(size, size, starts, None, rows),
            &self.values,
        )
    }
}
