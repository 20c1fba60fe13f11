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
pub mod breaking;
pub mod cells;
pub mod cores;
pub mod damage;
mod drag;
pub mod edges;
pub mod finding;
pub mod grains;
pub mod hertz;
pub mod membranes;
pub mod newton;
pub mod patch;
pub mod penalties;
pub mod rig;
pub mod run;
pub mod scenes;
pub mod spheres;
pub mod standing;
pub mod wedges;

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

/// All problems, in the order of the table.
pub const PROBLEMS: &[Problem] = &[
    Problem { name: "tet10", title: "cell: patch, bending, order of convergence", solve: cells::tet10 },
    Problem { name: "condensed", title: "condensed grain against its full mesh", solve: grains::condensed },
    Problem { name: "turned_grain", title: "stressed grain turned all around", solve: breaking::turned },
    Problem { name: "cut_grain", title: "grain cut in two by deletion", solve: breaking::cut },
    Problem { name: "damage_cell", title: "damage law of one cell, uniaxial", solve: damage::uniaxial_cell },
    Problem { name: "damage_cycle", title: "tension, compression, tension", solve: breaking::cycles },
    Problem { name: "rock_fields", title: "Weibull fields of 1e5 samples", solve: breaking::fields },
    Problem { name: "pressed", title: "block, sphere and grain in the press", solve: breaking::pressed },
    Problem { name: "softening_bar", title: "bar pulled apart, crack band", solve: damage::softening_bar },
    Problem { name: "balloon", title: "neo-Hookean balloon, limit point", solve: balloon::balloon },
    Problem {
        name: "membrane",
        title: "rubber cylinder: inflated, around a core",
        solve: membranes::cylinder,
    },
    Problem { name: "core", title: "smooth core in rubber under pressure", solve: cores::pressed },
    Problem { name: "pressure", title: "work of a follower pressure", solve: membranes::pressed },
    Problem { name: "rig_elastic", title: "elastic specimens in the rig", solve: rig::elastic },
    Problem { name: "hertz", title: "condensed sphere on a rigid plane", solve: hertz::normal },
    Problem {
        name: "spheres",
        title: "two condensed spheres: Hertz, Cattaneo-Mindlin",
        solve: spheres::pressed_and_pushed,
    },
    Problem { name: "patch", title: "contact patch test, non-matching meshes", solve: patch::columns },
    Problem { name: "drag", title: "steps against a drag, which fades", solve: drag::steps },
    Problem { name: "newton", title: "order of Newton's method", solve: newton::orders },
    Problem { name: "incline", title: "block on an incline: slides, or tips first", solve: blocks::incline },
    Problem { name: "nafems_wedge", title: "NAFEMS CGS-4: pushed up a slope", solve: wedges::up_a_slope },
    Problem { name: "wedge", title: "wedge pressed between two walls", solve: wedges::between_walls },
    Problem { name: "wedge_let_go", title: "the same let go and pulled out", solve: wedges::let_go },
    Problem { name: "card_tent", title: "two cards leaning on each other", solve: standing::card_tent },
    Problem { name: "three_cylinders", title: "a cylinder on two", solve: standing::three_cylinders },
    Problem { name: "arch", title: "semicircular masonry arch", solve: arch::stands_or_falls },
    Problem {
        name: "simple_cubic",
        title: "simple cubic array of balls, squeezed",
        solve: arrays::simple_cubic,
    },
    Problem { name: "face_centred_cubic", title: "the same, face-centred", solve: arrays::face_centred },
    Problem { name: "push", title: "block pushed along a plane: peak to residual", solve: blocks::weakening },
    Problem { name: "cube_on_cube", title: "many redundant points", solve: blocks::cube_on_cube },
    Problem { name: "facets", title: "slide over coplanar facets", solve: blocks::over_facets },
    Problem { name: "crossed_edges", title: "edge on edge", solve: edges::crossed },
    Problem { name: "corners", title: "corner on corner, corner on edge", solve: edges::corners },
    Problem { name: "indents", title: "corner and edges of rock pressed in", solve: asperities::indents },
    Problem { name: "corner_meshes", title: "corner of rock on four meshes", solve: asperities::meshes },
    Problem { name: "rolling", title: "prism rolled over an edge", solve: edges::rolling },
    Problem {
        name: "unlike_bodies",
        title: "stiffness 1e-6 to 1e6, sizes 1:20",
        solve: standing::unlike_bodies,
    },
    Problem {
        name: "first_guesses",
        title: "penalties and holds 1e-3 to 1e3",
        solve: penalties::first_guesses,
    },
    Problem { name: "rejected_trials", title: "they leave no trace", solve: penalties::rejected_trials },
    Problem { name: "scale", title: "the same in millimetres and kilometres", solve: wedges::scale },
    Problem { name: "scenes", title: "the case files in cases/scenes", solve: scenes::all },
];
