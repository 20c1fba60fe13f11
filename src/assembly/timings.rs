//! What an increment's work takes, kernel by kernel: for the profile, never for a decision.

use std::time::Instant;

/// The kernels that are timed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kernel {
    /// Broad phase: which pairs of bodies can touch.
    Search,
    /// Features within reach of each pair, and the forces between them.
    Contacts,
    /// The same between the rubber membrane and bodies.
    Membrane,
    /// Sum of all forces on the unknowns, the cover's pressure among them.
    Residual,
    /// Tangents of the contact points.
    Tangents,
    /// Displacements of condensed bodies' surfaces, and their flexibility between their contacts.
    Flexibility,
    /// Contact stiffness into the matrix; contact forces eliminated.
    Assembly,
    /// The cover's stiffness into the matrix.
    Cover,
    /// Sparsity pattern, ordering and symbolic factorisation.
    Ordering,
    Factor,
    /// Substitution, refinement and residual check; iterations of contact forces.
    Solve,
    /// Strains of bodies that can break, their damage and new factors.
    Damage,
}

impl Kernel {
    /// In the order of the work.
    pub const ALL: [Kernel; 12] = [
        Kernel::Search,
        Kernel::Contacts,
        Kernel::Membrane,
        Kernel::Residual,
        Kernel::Tangents,
        Kernel::Flexibility,
        Kernel::Assembly,
        Kernel::Cover,
        Kernel::Ordering,
        Kernel::Factor,
        Kernel::Solve,
        Kernel::Damage,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Kernel::Search => "search",
            Kernel::Contacts => "contacts",
            Kernel::Membrane => "membrane",
            Kernel::Residual => "residual",
            Kernel::Tangents => "tangents",
            Kernel::Flexibility => "flexibility",
            Kernel::Assembly => "assembly",
            Kernel::Cover => "cover",
            Kernel::Ordering => "ordering",
            Kernel::Factor => "factor",
            Kernel::Solve => "solve",
            Kernel::Damage => "damage",
        }
    }
}

/// Calls and wall time [s] of each kernel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Timings {
    calls: [u64; Kernel::ALL.len()],
    seconds: [f64; Kernel::ALL.len()],
}

impl Timings {
    /// Books a call that began at `start` and ends now.
    pub fn book(&mut self, kernel: Kernel, start: Instant) {
        self.calls[kernel as usize] += 1;
        self.seconds[kernel as usize] += start.elapsed().as_secs_f64();
    }

    pub fn calls(&self, kernel: Kernel) -> u64 {
        self.calls[kernel as usize]
    }

    /// Wall time [s].
    pub fn seconds(&self, kernel: Kernel) -> f64 {
        self.seconds[kernel as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_are_booked_apart() {
        let mut timings = Timings::default();
        for (place, kernel) in Kernel::ALL.into_iter().enumerate() {
            assert_eq!(kernel as usize, place);
            timings.book(kernel, Instant::now());
        }
        timings.book(Kernel::Factor, Instant::now());
        for kernel in Kernel::ALL {
            assert_eq!(timings.calls(kernel), if kernel == Kernel::Factor { 2 } else { 1 });
        }
    }
}
