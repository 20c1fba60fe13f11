//! Verification: problems with known answers, and scenes on which methods fail.
//!
//! Each problem is set up in one place here (or in its case file under `cases/scenes`, which is compiled in):
//! `riprap verify` runs those of [`PROBLEMS`] and prints what they find, and the tests in `solver_tests` run
//! the same set-ups over wider ranges of their parameters with assertions of their own. A problem's module
//! gives its source, its formula and where its tolerance comes from. SI units.

pub mod arch;
pub mod arrays;
pub mod asperities;
pub mod balloon;
pub mod blocks;
pub mod bodies;
pub mod cells;
pub mod cores;
pub mod crush;
pub mod damage;
mod drag;
pub mod edges;
pub mod finding;
pub mod grains;
pub mod hertz;
pub mod patch;
pub mod rig;
pub mod run;
pub mod scenes;
pub mod spheres;
pub mod standing;
pub mod wedges;

pub use finding::Tolerance::{Absolute, Relative, Short};
pub(crate) use finding::worse;
pub use finding::{Finding, Findings, Tolerance, timed};
pub use run::Run;

/// A problem with a known answer.
#[derive(Debug, Clone, Copy)]
pub struct Problem {
    /// Unique; what `--only` takes.
    pub name: &'static str,
    /// In a line.
    pub title: &'static str,
    solve: fn(&mut Findings),
}

impl Problem {
    /// Runs the problem and compares.
    pub fn solve(&self) -> Vec<Finding> {
        let mut findings = Findings::of(self.name);
        (self.solve)(&mut findings);
        findings.into_list()
    }
}

const fn problem(name: &'static str, title: &'static str, solve: fn(&mut Findings)) -> Problem {
    Problem { name, title, solve }
}

/// All problems, in the order of the table.
pub const PROBLEMS: &[Problem] = &[
    problem("tet10", "cell: patch, bending, order of convergence", cells::tet10),
    problem("condensed", "condensed grain against its full mesh", grains::condensed),
    problem("damage_cell", "damage law of one cell, uniaxial", damage::uniaxial_cell),
    problem("softening_bar", "bar pulled apart, crack band: bricks, tet10", damage::softening_bar),
    problem("balloon", "neo-Hookean balloon, limit point", balloon::balloon),
    problem("core", "smooth core in rubber under pressure", cores::pressed),
    problem("rig_elastic", "elastic specimens in the rig", rig::elastic),
    problem("hertz", "condensed sphere on a rigid plane", hertz::normal),
    problem("spheres", "two condensed spheres: Hertz, Cattaneo-Mindlin", spheres::pressed_and_pushed),
    problem("patch", "contact patch test, non-matching meshes", patch::columns),
    problem("drag", "steps against a drag, which fades", drag::steps),
    problem("incline", "block on an incline: slides, or tips first", blocks::incline),
    problem("nafems_wedge", "NAFEMS CGS-4: pushed up a slope", wedges::up_a_slope),
    problem("wedge", "wedge pressed between two walls", wedges::between_walls),
    problem("wedge_let_go", "the same let go and pulled out", wedges::let_go),
    problem("card_tent", "two cards leaning on each other", standing::card_tent),
    problem("three_cylinders", "a cylinder on two", standing::three_cylinders),
    problem("arch", "semicircular masonry arch", arch::stands_or_falls),
    problem("simple_cubic", "simple cubic array of balls, squeezed", arrays::simple_cubic),
    problem("face_centred_cubic", "the same, face-centred", arrays::face_centred),
    problem("push", "block pushed along a plane: peak to residual", blocks::weakening),
    problem("cube_on_cube", "many redundant points", blocks::cube_on_cube),
    problem("facets", "slide over coplanar facets", blocks::over_facets),
    problem("crossed_edges", "edge on edge", edges::crossed),
    problem("corners", "corner on corner, corner on edge", edges::corners),
    problem("indents", "corner and edges of rock pressed in", asperities::indents),
    problem("corner_meshes", "corner of rock on four meshes", asperities::meshes),
    problem("rolling", "prism rolled over an edge", edges::rolling),
    problem("unlike_bodies", "stiffness 1e-6 to 1e6, sizes 1:20", standing::unlike_bodies),
    problem("scale", "the same in millimetres and kilometres", wedges::scale),
    problem("scenes", "the case files in cases/scenes", scenes::all),
];
