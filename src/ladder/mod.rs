//! The verification ladder: problems with known answers, and scenes on which methods fail.
//!
//! Each problem is set up in one place here (or in its case file under `cases/scenes`, which is compiled in): `riprap verify` runs the
//! rungs of [`RUNGS`] and prints what they find, and the tests in `solver_tests` run the same set-ups over wider ranges of
//! their parameters with assertions of their own. A problem's module gives its source, its formula and
//! where its tolerance comes from. SI units.

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

/// One problem of the ladder.
#[derive(Debug, Clone, Copy)]
pub struct Rung {
    /// Unique; what `--only` takes.
    pub name: &'static str,
    /// In a line.
    pub problem: &'static str,
    climb: fn(&mut Findings),
}

impl Rung {
    /// Runs the problem and compares.
    pub fn climb(&self) -> Vec<Finding> {
        let mut findings = Findings::of(self.name);
        (self.climb)(&mut findings);
        findings.into_list()
    }
}

/// All rungs, in the order of the table.
pub const RUNGS: &[Rung] = &[
    Rung { name: "tet10", problem: "cell: patch, bending, order of convergence", climb: cells::tet10 },
    Rung { name: "condensed", problem: "condensed grain against its full mesh", climb: grains::condensed },
    Rung { name: "turned_grain", problem: "stressed grain turned all around", climb: breaking::turned },
    Rung { name: "cut_grain", problem: "grain cut in two by deletion", climb: breaking::cut },
    Rung { name: "damage_cell", problem: "damage law of one cell, uniaxial", climb: damage::uniaxial_cell },
    Rung { name: "damage_cycle", problem: "tension, compression, tension", climb: breaking::cycles },
    Rung { name: "rock_fields", problem: "Weibull fields of 1e5 samples", climb: breaking::fields },
    Rung { name: "pressed", problem: "block, sphere and grain in the press", climb: breaking::pressed },
    Rung { name: "softening_bar", problem: "bar pulled apart, crack band", climb: damage::softening_bar },
    Rung { name: "balloon", problem: "neo-Hookean balloon, limit point", climb: balloon::balloon },
    Rung {
        name: "membrane",
        problem: "rubber cylinder: inflated, around a core",
        climb: membranes::cylinder,
    },
    Rung { name: "core", problem: "smooth core in rubber under pressure", climb: cores::pressed },
    Rung { name: "pressure", problem: "work of a follower pressure", climb: membranes::pressed },
    Rung { name: "rig_elastic", problem: "elastic specimens in the rig", climb: rig::elastic },
    Rung { name: "hertz", problem: "condensed sphere on a rigid plane", climb: hertz::normal },
    Rung {
        name: "spheres",
        problem: "two condensed spheres: Hertz, Cattaneo-Mindlin",
        climb: spheres::pressed_and_pushed,
    },
    Rung { name: "patch", problem: "contact patch test, non-matching meshes", climb: patch::columns },
    Rung { name: "newton", problem: "order of Newton's method", climb: newton::orders },
    Rung { name: "incline", problem: "block on an incline: slides, or tips first", climb: blocks::incline },
    Rung { name: "nafems_wedge", problem: "NAFEMS CGS-4: pushed up a slope", climb: wedges::up_a_slope },
    Rung { name: "wedge", problem: "wedge pressed between two walls", climb: wedges::between_walls },
    Rung { name: "wedge_let_go", problem: "the same let go and pulled out", climb: wedges::let_go },
    Rung { name: "card_tent", problem: "two cards leaning on each other", climb: standing::card_tent },
    Rung { name: "three_cylinders", problem: "a cylinder on two", climb: standing::three_cylinders },
    Rung { name: "arch", problem: "semicircular masonry arch", climb: arch::stands_or_falls },
    Rung {
        name: "simple_cubic",
        problem: "simple cubic array of balls, squeezed",
        climb: arrays::simple_cubic,
    },
    Rung { name: "face_centred_cubic", problem: "the same, face-centred", climb: arrays::face_centred },
    Rung { name: "push", problem: "block pushed along a plane: peak to residual", climb: blocks::weakening },
    Rung { name: "cube_on_cube", problem: "many redundant points", climb: blocks::cube_on_cube },
    Rung { name: "facets", problem: "slide over coplanar facets", climb: blocks::over_facets },
    Rung { name: "crossed_edges", problem: "edge on edge", climb: edges::crossed },
    Rung { name: "corners", problem: "corner on corner, corner on edge", climb: edges::corners },
    Rung { name: "indents", problem: "corner and edges of rock pressed in", climb: asperities::indents },
    Rung { name: "corner_meshes", problem: "corner of rock on four meshes", climb: asperities::meshes },
    Rung { name: "rolling", problem: "prism rolled over an edge", climb: edges::rolling },
    Rung {
        name: "unlike_bodies",
        problem: "stiffness 1e-6 to 1e6, sizes 1:20",
        climb: standing::unlike_bodies,
    },
    Rung {
        name: "first_guesses",
        problem: "penalties and holds 1e-3 to 1e3",
        climb: penalties::first_guesses,
    },
    Rung { name: "rejected_trials", problem: "they leave no trace", climb: penalties::rejected_trials },
    Rung { name: "scale", problem: "the same in millimetres and kilometres", climb: wedges::scale },
    Rung { name: "scenes", problem: "the case files in cases/scenes", climb: scenes::all },
];
