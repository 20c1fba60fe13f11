//! What a case would build and about what it would cost: for the check, before anything is built.
//!
//! Sizes follow from the case; memory and time are estimates, good to a factor of a few. Their
//! coefficients come from feasibility trials on two cores (2026): at 3783 grains one factorisation
//! of the condensed network took 0.2 CPU s with one contact point a pair and 3.5 with three, at 216
//! grains factorisations were 80 % of the time, and an increment took 10 to 50 of them.

use super::types::*;

/// What would be built. Memory and time are orders of magnitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Grains of a specimen (expected), bodies of a scene.
    pub grains: usize,
    /// Tet10 cells of all deformable grains, about; without those of mesh files, and of refined spheres those of the coarse mesh.
    pub cells: usize,
    /// Pairs of touching grains, about.
    pub contacts: usize,
    /// Unknowns of the global system: 6 a grain, and 3 a contact point (condensed, and full with its nodes eliminated) or node (full).
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
/// Nodes of a tet10 mesh over its cells (measured on grains of 38 cells: 95 nodes).
const NODES_PER_CELL: f64 = 2.5;
/// Volume of a cell over the cube of the longest edge that is asked for (measured: 0.01 for a cylinder of twelve sides, 0.03 for a sphere).
const CELL_VOLUME: f64 = 0.018;
/// Factorisations of an increment between collapses (10 to 50 measured); collapses take more.
const FACTORISATIONS: f64 = 25.0;
/// CPU seconds of a factorisation at [`REFERENCE`] grains: rigid, condensed, full.
const FACTOR_TIME: [f64; 3] = [0.21, 3.5, 35.0];
const REFERENCE: f64 = 3783.0;
/// Nested dissection in space: work as the square of the unknowns, memory as their power 4/3.
const WORK_POWER: f64 = 2.0;
const MEMORY_POWER: f64 = 4.0 / 3.0;
/// Numbers kept in the factors over unknowns to [`MEMORY_POWER`].
const FILL: f64 = 15.0;
/// Time of everything but the factorisation, per grain and factorisation [s]: contacts, tangents.
const REST_TIME: f64 = 1e-4;
/// Memory of the program and of a grain without its cells [B].
const BASE_MEMORY: f64 = 5e7;
const GRAIN_MEMORY: f64 = 2e4;
/// Memory of a body of a scene besides, for its columns in the results file, which are open as long as it is (measured: 2000 boxes 0.68 GB) [B].
const BODY_MEMORY: f64 = 3e5;

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
        let nodes = NODES_PER_CELL * cells as f64;
        let (level, unknowns) = match self.solver.fidelity {
            Fidelity::Rigid => (0, 6.0 * n),
            Fidelity::Auto if self.solver.chosen_accuracy().is_none() => (0, 6.0 * n),
            Fidelity::Full if self.solver.nodes() == NodesCase::Unknowns => (2, 6.0 * n + 3.0 * nodes),
            Fidelity::Auto | Fidelity::Condensed | Fidelity::Full => (1, 6.0 * n + 3.0 * POINTS * contacts),
        };
        // A condensed grain keeps its own factor, of which small ones are nearly half full.
        let own = if level == 1 && grains > 0 { n * (3.0 * nodes / n).powi(2) / 4.0 } else { 0.0 };
        let increments = self.stages.iter().map(StageCase::increments).sum::<f64>();
        let factor = FACTOR_TIME[level] * (n / REFERENCE).powf(WORK_POWER);
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
            memory: BASE_MEMORY + one * n + 8.0 * (own + FILL * unknowns.powf(MEMORY_POWER)),
            time: increments * FACTORISATIONS * (factor + REST_TIME * n),
            size,
        }
    }

    /// As the generator makes them, about: bricks of six cells in a box, elsewhere cells halved until no edge is longer than asked.
    pub(super) fn cells_of(&self, body: &BodyCase) -> f64 {
        let Some(h) = body.cell_size().filter(|_| self.fidelity_of(body) != Fidelity::Rigid) else {
            return 0.0;
        };
        let volume = match &body.shape {
            ShapeCase::Box(size) => {
                return 6.0 * size.iter().map(|length| (length / h - 1e-9).ceil()).product::<f64>();
            }
            ShapeCase::Grain(_) if body.mesh_size.is_none() => return GRAIN_CELLS as f64,
            ShapeCase::Sphere(radius) => 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3),
            ShapeCase::Cylinder { radius, length, .. } => std::f64::consts::PI * radius * radius * length,
            // Hulls of random grains fill about half of their ellipsoid.
            ShapeCase::Grain(sizes) => 0.3 * (0.5 * (sizes[0] + sizes[1])).powi(3),
            ShapeCase::Polyhedron(points) => {
                let points: Vec<_> = points.iter().map(|p| crate::tensor::Vec3::from(*p)).collect();
                crate::geometry::Polyhedron::convex_hull(&points).map_or(0.0, |hull| hull.volume())
            }
            ShapeCase::Mesh(_) => 0.0,
        };
        (volume / (CELL_VOLUME * h.powi(3))).ceil()
    }
}

impl StageCase {
    /// Nominal number of increments.
    fn increments(&self) -> f64 {
        match *self {
            StageCase::Consolidate { increments, .. }
            | StageCase::Hold { increments }
            | StageCase::StressShear { increments, .. }
            | StageCase::Load { increments, .. } => increments as f64,
            StageCase::Shear { axial_strain, increment, .. }
            | StageCase::Oedometer { axial_strain, increment, .. }
            | StageCase::ConstantVolume { axial_strain, increment, .. }
            | StageCase::ConstantP { axial_strain, increment, .. } => (axial_strain / increment).ceil(),
            // Unloading is stiff: a tenth of a percent or so.
            StageCase::Unload { increment, .. } => (1e-3 / increment).ceil(),
            StageCase::Reload { axial_strain, increment, .. } => {
                (axial_strain.unwrap_or(1e-3) / increment).ceil()
            }
        }
    }
}

impl std::fmt::Display for Estimate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "grains               {:>12}", self.grains)?;
        if let Some([diameter, height]) = self.size {
            let size = format!("{:.0} x {:.0}", 1e3 * diameter, 1e3 * height);
            writeln!(f, "diameter, height     {size:>12}  mm (about)")?;
        }
        writeln!(f, "cells                {:>12}", self.cells)?;
        writeln!(f, "contacts             {:>12}  (about)", self.contacts)?;
        writeln!(f, "degrees of freedom   {:>12}  (about)", self.degrees_of_freedom)?;
        writeln!(f, "increments           {:>12}  (if none is cut)", self.increments)?;
        writeln!(f, "memory               {:>9.1} GB  (order of magnitude)", self.memory / 1e9)?;
        let (unit, seconds) = match self.time {
            t if t < 120.0 => ("s", 1.0),
            t if t < 7200.0 => ("min", 60.0),
            _ => ("h", 3600.0),
        };
        write!(f, "time on one core     {:>9.1} {unit:<3} (order of magnitude)", self.time / seconds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
