//! What a case would build and about what it would cost: for the check, before anything is built.
//!
//! Sizes follow from the case; memory and time are estimates, meant to be right within a factor of two. Their coefficients are fits to what runs took
//! (`benchmarks/runs`, 2026): rigid grains 0.03, 0.12, 0.6 and 4.3 CPU s an increment of 2e-4 over the first percent of strain at 100, 300, 1000 and 3643
//! grains, 300 grains 0.25 over fifteen; longer increments take more steps. The tests below hold the estimates to runs that were timed. A specimen that
//! collapses often takes longer, one that stands still less.

use super::size::median_class;
use super::types::*;
use crate::contact::NormalLaw;

/// What would be built.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Grains of a specimen (expected), bodies of a scene.
    pub grains: usize,
    /// Tet10 cells of all deformable grains, about.
    pub cells: usize,
    /// Pairs of touching grains, about.
    pub contacts: usize,
    /// Unknowns of the global system: 6 a grain, and 3 a contact point of bodies that deform behind springs.
    pub degrees_of_freedom: usize,
    /// Increments if none is cut.
    pub increments: usize,
    /// [B]
    pub memory: f64,
    /// On one core [s].
    pub time: f64,
    /// Expected diameter and height of a specimen [m].
    pub size: Option<[f64; 2]>,
}

/// Touching neighbours of a grain in a compacted specimen (measured: 7).
const COORDINATION: f64 = 7.0;
/// Contact points of a pair of polyhedra.
const POINTS: f64 = 3.0;
/// Nodes of a tet10 mesh: so many a cell, and so many to the cells' power of two thirds, for the surface (measured: 95 of 38 cells, 42,000 of 29,500).
const NODES_PER_CELL: f64 = 1.4;
const NODES_OF_SURFACE: f64 = 3.7;
/// Volume of a cell over the cube of the longest edge that is asked for (measured: 0.01 for a cylinder of twelve sides, 0.03 for a sphere).
const CELL_VOLUME: f64 = 0.018;

/// CPU seconds of an increment at [`REFERENCE`] grains, of [`REFERENCE_INCREMENT`] of strain: rigid, condensed and full. Behind asperities grains that
/// deform take [`BEHIND`] times what rigid ones do.
const INCREMENT_TIME: [f64; 3] = [0.35, 5.0, 6.5];
const BEHIND: f64 = 2.5;
const REFERENCE: f64 = 300.0;
const REFERENCE_INCREMENT: f64 = 2e-4;
/// Powers of the grains and of the strain of an increment in that time (measured: 14,477 and 10,106 factorisations in increments
/// of 4e-4 and 8e-4; decision 0192).
const TIME_POWER: f64 = 1.4;
const STRAIN_POWER: f64 = 0.5;
/// What grains that can break take longer: rigid ones, and ones that bend (measured: 178 s for 300 rigid grains to 15 %).
const BREAKING: [f64; 2] = [1.6, 1.3];
/// CPU seconds of an increment that go into writing it.
const WRITING: f64 = 0.015;
/// CPU seconds a grain that generating, compacting and seating it takes.
const GENERATION: f64 = 0.08;
/// CPU seconds an increment of a body of a scene that deforms: a square of its cells where its flexibility is kept whole, every node with every other, and
/// from some 250 cells on, where that is solved for on demand, a cell (measured in `benchmarks/runs/2026-11-28-peers`: 5.2 and 5.6 s for piles of nine
/// bodies of 300 cells in six increments, 3.0 s for a refined ball of 5173 in five).
const SCENE_PAIR: f64 = 1.2e-6;
const SCENE_CELL: f64 = 3e-4;
/// What bodies of a scene that can break take longer (measured: 4.8 s for a bar of 192 cells in forty increments).
const SCENE_BREAKING: f64 = 4.0;
/// Of a rubber membrane: factorisations of an increment, and CPU seconds of one a node (measured: 14 and 20 at 100 and 300 grains, cheaper ones than 31 us).
const RUBBER: [f64; 2] = [12.0, 31e-6];
/// Edge of a membrane's triangles over the middle of the grading's sizes, where the case gives none.
const RUBBER_MESH: f64 = 0.25;

/// Memory of the program with what it holds of its rows, of a rigid grain with its mesh, and more of a cell that can break [B].
const BASE_MEMORY: f64 = 1.2e8;
const GRAIN_MEMORY: f64 = 1.5e5;
/// Memory of a body of a scene besides, for its columns in the results file, which are open as long as it is (measured: 2000 boxes 0.68 GB) [B].
const BODY_MEMORY: f64 = 1.65e5;
const BREAKING_MEMORY: f64 = 1.6e4;
/// Memory of what a grain that deforms keeps, over its factor: flexibilities and what they are made of, up to so many nodes; beyond, these are solved for on
/// demand (measured: 29,500 cells 1.5 GB).
const OWN_MEMORY: f64 = 3.0;
const KEPT_WHOLE: f64 = 1100.0;
/// Numbers kept in the factors of a system over its unknowns to this power (nested dissection in space): condensed, and with nodes among them.
const FILL: [f64; 2] = [15.0, 30.0];
const MEMORY_POWER: f64 = 4.0 / 3.0;

impl Case {
    /// What the case would build. `auto` fidelity counts as rigid, or as condensed where an accuracy is asked; `full` as condensed, too,
    /// where its nodes are eliminated.
    pub fn estimate(&self) -> Estimate {
        let (grains, cells, contacts, size) = match &self.geometry {
            Geometry::Specimen(it) => {
                let contacts = (COORDINATION / 2.0 * it.grains as f64).round();
                (it.grains, it.grains * it.cells_per_grain, contacts, Some([it.diameter, it.height]))
            }
            Geometry::Scene(it) => {
                let cells: f64 = it.bodies.iter().map(|body| self.cells_of(body)).sum();
                // Bodies set by hand touch a few others.
                (it.bodies.len(), cells as usize, it.bodies.len().saturating_sub(1) as f64, None)
            }
        };
        let n = grains as f64;
        let chooses = self.solver.chosen_accuracy().is_some();
        let follows = self.contact.normal == NormalLaw::Asperity;
        let (level, unknowns) = match self.solver.fidelity {
            Fidelity::Full if follows => (2, 6.0 * n),
            Fidelity::Condensed if follows => (1, 6.0 * n),
            Fidelity::Auto if chooses && follows => (1, 6.0 * n),
            Fidelity::Full => (2, 6.0 * n + 3.0 * POINTS * contacts),
            Fidelity::Condensed => (1, 6.0 * n + 3.0 * POINTS * contacts),
            Fidelity::Auto if chooses => (1, 6.0 * n + 3.0 * POINTS * contacts),
            Fidelity::Auto | Fidelity::Rigid => (0, 6.0 * n),
        };
        let filled = |unknowns: f64, fill: f64| fill * unknowns.powf(MEMORY_POWER);
        // Numbers that one body of so many cells keeps.
        let own_of = |cells: f64| {
            let nodes = NODES_PER_CELL * cells + NODES_OF_SURFACE * cells.powf(2.0 / 3.0);
            let kept = if nodes < KEPT_WHOLE { OWN_MEMORY } else { 1.0 };
            // Of small grains the factor is nearly half full.
            let each = 3.0 * nodes;
            kept * filled(each, FILL[1]).min(each * each / 4.0)
        };
        let own = match &self.geometry {
            Geometry::Specimen(it) if level > 0 => n * own_of(it.cells_per_grain as f64),
            Geometry::Specimen(_) => 0.0,
            // Of a scene each as it deforms, whatever the others do; a rigid one has no cells here.
            Geometry::Scene(it) => it.bodies.iter().map(|body| own_of(self.cells_of(body))).sum(),
        };
        let breaking = if self.rock.damage.is_some() { cells as f64 } else { 0.0 };
        let increments = self.stages.iter().map(|stage| self.increments_of(stage)).sum::<f64>();
        let effort =
            self.stages.iter().map(|stage| self.increments_of(stage) * self.length_of(stage)).sum::<f64>();
        let increment = match &self.geometry {
            Geometry::Specimen(_) => {
                let reference =
                    if follows && level > 0 { BEHIND * INCREMENT_TIME[0] } else { INCREMENT_TIME[level] };
                let plain = reference * (n / REFERENCE).powf(TIME_POWER);
                plain * if breaking > 0.0 { BREAKING[level.min(1)] } else { 1.0 }
                    + RUBBER[0] * RUBBER[1] * self.rubber_nodes()
            }
            Geometry::Scene(it) => {
                let of_body = |body: &BodyCase| {
                    let cells = self.cells_of(body);
                    (SCENE_PAIR * cells * cells).min(SCENE_CELL * cells)
                };
                let plain: f64 = it.bodies.iter().map(of_body).sum();
                plain * if breaking > 0.0 { SCENE_BREAKING } else { 1.0 }
            }
        };
        let is_generated = size.is_some() && self.start_from.is_none();
        let generation = if is_generated { GENERATION * n } else { 0.0 };
        let one = match &self.geometry {
            Geometry::Specimen(_) => GRAIN_MEMORY,
            Geometry::Scene(_) => GRAIN_MEMORY + BODY_MEMORY,
        };
        Estimate {
            grains,
            cells,
            contacts: contacts as usize,
            degrees_of_freedom: unknowns as usize,
            increments: increments as usize,
            memory: BASE_MEMORY
                + one * n
                + BREAKING_MEMORY * breaking
                + 8.0 * (own + filled(unknowns, FILL[0])),
            time: generation + effort * increment + increments * WRITING,
            size,
        }
    }

    /// Nominal number of increments of a stage.
    fn increments_of(&self, stage: &StageCase) -> f64 {
        match *stage {
            StageCase::Consolidate { increments, .. }
            | StageCase::Hold { increments }
            | StageCase::StressShear { increments, .. }
            | StageCase::Load { increments, .. } => increments as f64,
            // Unloading is stiff: a tenth of a percent or so.
            _ => {
                self.strained(stage).map_or(0.0, |it| (it.axial_strain.unwrap_or(1e-3) / it.increment).ceil())
            }
        }
    }

    /// What an increment of a stage takes over one of [`REFERENCE_INCREMENT`].
    fn length_of(&self, stage: &StageCase) -> f64 {
        self.strained(stage).map_or(1.0, |it| (it.increment / REFERENCE_INCREMENT).powf(STRAIN_POWER))
    }

    /// Nodes of a rubber membrane, about; 0 of other covers.
    fn rubber_nodes(&self) -> f64 {
        let (Geometry::Specimen(it), MembraneCase::Rubber { mesh_size, .. }) =
            (&self.geometry, &self.membrane)
        else {
            return 0.0;
        };
        let middle = median_class(&it.grading).map(|[large, small]| 0.5 * (large[0] + small[0]));
        let Some(edge) = mesh_size.or(middle.map(|size| RUBBER_MESH * size)) else { return 0.0 };
        // A node has two triangles of even sides.
        std::f64::consts::PI * it.diameter * it.height / (0.75_f64.sqrt() * edge * edge)
    }

    /// Those of a mesh file; else as the generator makes them, about: bricks of six cells in a box, elsewhere cells halved until no edge is longer
    /// than asked.
    pub(super) fn cells_of(&self, body: &BodyCase) -> f64 {
        if self.fidelity_of(body) == Fidelity::Rigid {
            return 0.0;
        }
        let of_file = body.shape.file().and_then(|file| self.cells_of_files.get(file));
        let Some(h) = body.cell_size() else { return of_file.map_or(0.0, |cells| *cells as f64) };
        let volume = match &body.shape {
            ShapeCase::Box(size) => {
                return 6.0 * size.iter().map(|length| (length / h - 1e-9).ceil()).product::<f64>();
            }
            ShapeCase::Grain(_) if body.mesh_size.is_none() => return GRAIN_CELLS as f64,
            ShapeCase::Sphere(radius) => 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3),
            ShapeCase::Cylinder { radius, length, sides } => {
                // Where sides are narrower than cells, cells are as narrow, towards the axis more so: in quadratic mean by the root of two.
                let side = 2.0 * radius * (std::f64::consts::PI / *sides as f64).sin();
                let narrower = (std::f64::consts::SQRT_2 * h / side).max(1.0);
                std::f64::consts::PI * radius * radius * length * narrower
            }
            // Hulls of random grains fill about half of their ellipsoid.
            ShapeCase::Grain(sizes) => 0.3 * (0.5 * (sizes[0] + sizes[1])).powi(3),
            ShapeCase::Polyhedron(points) => {
                let points: Vec<_> = points.iter().map(|p| crate::tensor::Vec3::from(*p)).collect();
                crate::geometry::Polyhedron::convex_hull(&points).map_or(0.0, |hull| hull.volume())
            }
            ShapeCase::Mesh(_) => 0.0,
        };
        (volume / (CELL_VOLUME * h.powi(3))).ceil() + body.refine.map_or(0.0, |refine| refined(refine, h))
    }
}

/// Cells by which a refined part of a surface exceeds a mesh of edges `h`: a half ball of the fine ones, and about it edges that double from shell to shell.
fn refined(refine: RefineCase, h: f64) -> f64 {
    let half_ball = |radius: f64| 2.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
    let (mut edge, mut radius, mut inner, mut cells) = (refine.mesh_size, refine.radius, 0.0, 0.0);
    while edge < h {
        cells += (half_ball(radius) - inner) / (CELL_VOLUME * edge.powi(3));
        inner = half_ball(radius);
        radius += 2.0 * edge;
        edge *= 2.0;
    }
    cells
}

/// Estimates of tests below this are upper bounds [s].
const SHORT: f64 = 10.0;

impl std::fmt::Display for Estimate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let things = if self.size.is_some() { "grains" } else { "bodies" };
        writeln!(f, "{things}               {:>12}", self.grains)?;
        if let Some([diameter, height]) = self.size {
            let size = format!("{:.0} x {:.0}", 1e3 * diameter, 1e3 * height);
            writeln!(f, "diameter, height     {size:>12}  mm (about)")?;
        }
        writeln!(f, "cells                {:>12}", self.cells)?;
        writeln!(f, "contacts             {:>12}  (about)", self.contacts)?;
        writeln!(f, "degrees of freedom   {:>12}  (about)", self.degrees_of_freedom)?;
        writeln!(f, "increments           {:>12}  (if none is cut)", self.increments)?;
        // Scenes are too unlike each other for better.
        let how = if self.size.is_some() { "within a factor of two or so" } else { "order of magnitude" };
        writeln!(f, "memory               {:>9.1} GB  ({how})", self.memory / 1e9)?;
        let (unit, seconds) = match self.time {
            t if t < 120.0 => ("s", 1.0),
            t if t < 7200.0 => ("min", 60.0),
            _ => ("h", 3600.0),
        };
        // What the least of tests takes goes with how its grains happen to lie.
        let how = if self.size.is_some() && self.time < SHORT { "or several times less" } else { how };
        write!(f, "time on one core     {:>9.1} {unit:<3} ({how})", self.time / seconds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::checked;

    #[test]
    fn times_are_in_a_unit_that_fits() {
        let line = |time: f64| {
            let estimate = Estimate {
                grains: 1,
                cells: 1,
                contacts: 1,
                degrees_of_freedom: 6,
                increments: 1,
                memory: 1e9,
                time,
                size: None,
            };
            estimate.to_string().lines().last().unwrap_or("").to_string()
        };
        for (time, shown) in [(2.04, "2.0 s   ("), (1500.0, "25.0 min ("), (9e5, "250.0 h   (")] {
            assert!(line(time).contains(&format!(" {shown}order")), "{}", line(time));
        }
    }

    /// CPU seconds and peak memory [B] of runs that were timed, each with where it is recorded: an estimate is within a factor of two of either.
    #[test]
    fn estimates_are_within_a_factor_of_two_of_timed_runs() {
        const NO_DAMAGE: &str = "/rock/damage=null";
        const SPRING: &str = "/contact/normal=spring";
        const FINE: &str = "/stages/1/increment=1e-4";
        const TWICE: &str = "/stages/1/increment=2e-4";
        const TO_ONE: &str = "/stages/1/axial_strain=0.01";
        let timed = [
            // Timed on 2026-11-30 (8c88733), beside one other run on two cores.
            ("quick_start.json", &[][..], 26.3, Some(180e6)),
            ("stages/hundred_grains.json", &[], 23.2, Some(233e6)),
            ("membrane/rubber_24.json", &[], 4.4, Some(107e6)),
            ("membrane/rubber_100.json", &[], 80.3, Some(149e6)),
            // benchmarks/runs/2026-11-26-asperities-300, followed to 13 % of 15.
            ("shuibuya/p0800_300.json", &[NO_DAMAGE, SPRING, FINE], 770.0, Some(86e6)),
            // benchmarks/runs/2026-11-29-shuibuya.
            ("shuibuya/p0800_300.json", &[], 178.0, Some(306e6)),
            ("shuibuya/p1600_300.json", &[], 205.0, Some(316e6)),
            ("shuibuya/p0800_3783.json", &[], 6900.0, Some(2.4e9)),
            // benchmarks/runs/2026-11-29-steps; the larger one with its specimen, seating and consolidation.
            ("shuibuya/p0800_300.json", &[NO_DAMAGE], 105.0, Some(168e6)),
            ("shuibuya/p0800_3783.json", &[NO_DAMAGE, TWICE, TO_ONE], 814.0, Some(782e6)),
        ];
        const CONDENSED: &str = "/solver/fidelity=condensed";
        let of_scenes = [
            // benchmarks/runs/2026-11-28-peers.
            ("../benchmarks/peers/cases/pile_closed.json", &[CONDENSED][..], 5.2, Some(313e6)),
            ("../benchmarks/peers/cases/pile_gapped.json", &[CONDENSED], 5.6, Some(139e6)),
            // Timed on 2026-11-28.
            ("crushing/bent_bar.json", &[], 4.8, None),
        ];
        for (file, overrides, seconds, memory) in timed.into_iter().chain(of_scenes) {
            let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("cases").join(file);
            let raw = crate::case::read(&path).unwrap_or_else(|e| panic!("{e}"));
            let estimate = raw.with(overrides).check().unwrap_or_else(|e| panic!("{e}")).estimate();
            let within = |found: f64, measured: f64| found < 2.0 * measured && measured < 2.0 * found;
            assert!(
                within(estimate.time, seconds),
                "{file} {overrides:?}: {} s for {seconds}",
                estimate.time
            );
            if let Some(memory) = memory {
                assert!(
                    within(estimate.memory, memory),
                    "{file} {overrides:?}: {} B for {memory}",
                    estimate.memory
                );
            }
        }
    }

    /// A block of 29,478 cells pressed onto a plate: 1462 MB on 2026-11-27, more than five times less than flexibilities kept whole would take.
    #[test]
    fn memory_of_one_body_of_many_cells_is_within_a_factor_of_two() {
        let text = r#"{"scene": {"bodies": [
            {"name": "plate", "shape": {"box": [4, 4, 0.5]}, "position": [0, 0, -1.25], "fixed": true, "fidelity": "rigid"},
            {"name": "block", "shape": {"box": [1, 1, 1]}, "position": [0, 0, -0.5], "mesh_size": 0.06}]},
            "rock": {"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2},
            "contact": {"friction": 0.5}, "solver": {"fidelity": "condensed"},
            "stages": [{"kind": "load", "increments": 2, "bodies": {"block": {"force": [0, 0, -1000]}}}]}"#;
        // The same where the body alone says so, in a scene of many small rigid ones: it was counted as rigid.
        let own = text.replace(r#""mesh_size": 0.06"#, r#""mesh_size": 0.06, "fidelity": "condensed""#);
        let own = own.replace(r#""solver": {"fidelity": "condensed"},"#, "");
        let small = |k: usize| {
            format!(r#"{{"name": "b{k}", "shape": {{"box": [1, 1, 1]}}, "position": [{}, 9, 0]}}, "#, 2 * k)
        };
        let small: String = (0..200).map(small).collect();
        let among = own.replace(r#"{"name": "plate""#, &format!(r#"{small}{{"name": "plate""#));
        let beside = 200.0 * (GRAIN_MEMORY + BODY_MEMORY);
        for (text, more) in [(text, 0.0), (&own, 0.0), (&among, beside)] {
            let case = checked(text, &[]).unwrap_or_else(|e| panic!("{e}"));
            let memory = case.estimate().memory - more;
            assert!(memory < 2.0 * 1462e6 && memory > 0.5 * 1462e6, "{memory}");
        }
    }

    #[test]
    fn cells_of_mesh_files_are_counted() {
        let folder = tempfile::tempdir().expect("a folder");
        let msh = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n\
                   $Elements\n1\n1 4 2 1 1 1 2 3 4\n$EndElements\n";
        std::fs::write(folder.path().join("tip.msh"), msh).expect("a mesh");
        let text = r#"{"scene": {"bodies": [{"name": "tip", "shape": {"mesh": "tip.msh"}, "fidelity": "condensed"}]},
            "rock": {"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2},
            "contact": {"friction": 0.5}, "stages": [{"kind": "load"}]}"#;
        let cells = |text: &str| {
            let raw = crate::case::RawCase::parse(&folder.path().join("x.json"), text);
            raw.and_then(|raw| raw.check()).unwrap_or_else(|e| panic!("{e}")).estimate().cells
        };
        assert_eq!((cells(text), cells(&text.replace("condensed", "rigid"))), (1, 0));
    }

    /// The refined ball of benchmarks/runs/2026-11-28-peers: 10,792 cells, 18 CPU s, 320 MB. It was counted as the 1862 of its coarse mesh.
    #[test]
    fn refined_cells_are_counted() {
        let text = r#"{"scene": {"bodies": [
            {"name": "plane", "shape": {"box": [2, 2, 1]}, "position": [0, 0, -0.5], "fixed": true, "fidelity": "rigid"},
            {"name": "ball", "shape": {"sphere": 1}, "position": [0, 0, 1], "fidelity": "condensed", "mesh_size": 0.5,
             "refine": {"point": [0, 0, -1], "radius": 0.15, "mesh_size": 0.05}}]},
            "rock": {"density": 1000, "youngs_modulus": 1e9, "poissons_ratio": 0.3}, "contact": {"friction": 0.3},
            "stages": [{"kind": "load", "increments": 5, "bodies": {"ball": {"displacement": [0, 0, -0.01]}}}]}"#;
        let it = checked(text, &[]).unwrap_or_else(|e| panic!("{e}")).estimate();
        for (found, measured) in [(it.cells as f64, 10_792.0), (it.time, 18.0), (it.memory, 320e6)] {
            assert!(found < 2.0 * measured && measured < 2.0 * found, "{found} for {measured}");
        }
    }
}
