//! The tangent of a Newton solve: assembled, factorised, solved for.
//!
//! Where contacts have their forces for unknowns, these are eliminated pair by pair and what is left of their
//! coupling is iterated ([`crate::assembly::contact_forces::PairElimination`]); otherwise, and where that
//! does not converge, all unknowns are factorised together. Both solve the same system.

use std::time::Instant;

use crate::assembly::{self, BlockPattern, Kernel};
use crate::linalg::lu::SolveFailure;
use crate::solver::newton::{Newton, weight_of};
use crate::solver::system::{System, Unknowns};

impl Newton<'_> {
    /// The Newton step for `held`, or `None` where the matrix is singular.
    pub(super) fn step(&mut self, held: &[f64]) -> Option<Vec<f64>> {
        let few = self.few.as_ref();
        self.contacts.update_tangents(self.model, &self.poses, |pair| few.is_none_or(|few| pair.is_of(few)));
        let (unknown_forces, generation) =
            (&self.contacts.unknown_forces, self.contacts.unknown_forces.generation);
        if self.together_for != Some(generation) && unknown_forces.can_be_split() {
            match self.step_by(Unknowns::Bodies, held) {
                Ok(step) => return Some(step),
                Err(failure) => tracing::debug!(?failure, "contact forces are not iterated"),
            }
            self.together_for = Some(generation);
        }
        let step = self.step_by(Unknowns::All(generation), held);
        if let Err(failure) = &step {
            tracing::warn!(?failure, "linear system");
        }
        step.ok()
    }

    fn step_by(&mut self, unknowns: Unknowns, held: &[f64]) -> Result<Vec<f64>, SolveFailure> {
        self.analyse(unknowns)?;
        self.assemble()?;
        let start = Instant::now();
        let system = self.system.as_mut().ok_or(SolveFailure::Singular)?;
        self.counters.factorisations += 1;
        let factorised = system.lu.factorise(&self.values);
        self.contacts.timings.book(Kernel::Factor, start);
        factorised?;
        let start = Instant::now();
        let mut step = held.to_vec();
        self.contacts.unknown_forces.complete(&mut step, &self.dofs);
        let (unknown_forces, motion) = (&self.contacts.unknown_forces, ..self.dofs.count());
        let mut solve =
            |right: &mut [f64]| system.solve_in_place(&self.values, unknown_forces, &self.dofs, right);
        let mut solved = solve(&mut step[motion]);
        if let (Ok(()), Some(steering)) = (&solved, &mut self.steering) {
            steering.update_border(self.model, &self.dofs, Some(&self.contacts), &self.poses);
            if steering.complete(&mut step, |right| solve(right).ok()).is_none() {
                solved = Err(SolveFailure::Singular);
            }
        }
        self.contacts.timings.book(Kernel::Solve, start);
        solved.map(|()| step)
    }

    /// Makes [`Self::system`] one of these unknowns for what couples now.
    fn analyse(&mut self, unknowns: Unknowns) -> Result<(), SolveFailure> {
        let start = Instant::now();
        if let Some(pattern) = self.new_pattern(unknowns) {
            self.system = Some(System::new(unknowns, pattern, self.system.take())?);
            self.contacts.timings.book(Kernel::Ordering, start);
        }
        Ok(())
    }

    /// The pattern of these unknowns for what couples now, or `None` where that of [`Self::system`] will do.
    fn new_pattern(&self, unknowns: Unknowns) -> Option<BlockPattern> {
        let unknown_forces = &self.contacts.unknown_forces;
        let covered = || self.model.cover.iter().flat_map(|c| c.coupled_bodies().map(|[a, b]| (a, b)));
        let touching =
            || self.contacts.pairs.iter().filter(|p| !p.tangents.is_empty()).map(|p| (p.a(), p.b()));
        let membrane = || self.model.membrane.iter();
        let pressing = || membrane().flat_map(|m| assembly::membrane_touching(m, &self.contacts));
        let pressed = || membrane().flat_map(|m| assembly::membrane_couplings(m, &self.contacts));
        let walled = || self.model.wall.iter().flat_map(|w| assembly::wall_couplings(w, &self.contacts.wall));
        let eliminated = (unknowns == Unknowns::Bodies).then(|| unknown_forces.eliminated_couplings());
        let pairs = || touching().chain(covered()).chain(walled());
        let mut needed = pairs().chain(pressing()).chain(eliminated.into_iter().flatten());
        let fits = |s: &System| s.unknowns == unknowns && s.pattern.covers(&self.dofs, &mut needed);
        if self.system.as_ref().is_some_and(fits) {
            return None;
        }
        let couplings = pairs().chain(pressed());
        Some(match unknowns {
            Unknowns::All(_) => {
                BlockPattern::new(&self.dofs, couplings.chain(unknown_forces.couplings(&self.dofs)))
            }
            Unknowns::Bodies => {
                let bodies = self.dofs.without_contacts();
                BlockPattern::new(&bodies, couplings.chain(unknown_forces.eliminated_couplings()))
            }
        })
    }

    /// The tangent with the drag, into `values`.
    fn assemble(&mut self) -> Result<(), SolveFailure> {
        let start = Instant::now();
        let system = self.system.as_mut().ok_or(SolveFailure::Singular)?;
        let System { unknowns, pattern, elimination, .. } = system;
        let (values, model, dofs, contacts) = (&mut self.values, self.model, &self.dofs, &self.contacts);
        values.clear();
        values.resize(pattern.entries(), 0.0);
        assembly::contact_stiffness_into(values, pattern, dofs, contacts);
        assembly::gravity_stiffness_into(values, model, pattern, dofs, &self.loads, &self.poses);
        self.contacts.timings.book(Kernel::Assembly, start);
        let start = Instant::now();
        assembly::cover_stiffness_into(values, model, pattern, dofs, &self.loads, &self.poses);
        self.contacts.timings.book(Kernel::Cover, start);
        let (start, contacts) = (Instant::now(), &self.contacts);
        assembly::membrane_stiffness_into(values, model, pattern, dofs, contacts, &self.poses);
        assembly::wall_stiffness_into(values, model, pattern, dofs, &contacts.wall, &self.loads, &self.poses);
        match unknowns {
            Unknowns::All(_) => contacts.unknown_forces.stiffness_into(values, pattern, dofs),
            Unknowns::Bodies => {
                if !contacts.unknown_forces.eliminate_into(elimination) {
                    return Err(SolveFailure::Singular);
                }
                contacts.unknown_forces.eliminated_stiffness_into(values, pattern, dofs, elimination);
            }
        }
        let drag = |carrier| {
            // The forces of contacts, which come behind the carriers, are not held.
            if carrier >= dofs.carriers() {
                return 0.0;
            }
            weight_of(&self.weights, carrier) * model.holding_stiffness(carrier, self.typical_stiffness)
        };
        pattern.add_diagonal(values, dofs, drag);
        self.contacts.timings.book(Kernel::Assembly, start);
        Ok(())
    }

    /// Turns forces on the unknowns into the motion that they cause, by the factor of the last [`Self::step`].
    pub(super) fn respond(&mut self, forces: &mut [f64]) -> Option<()> {
        let system = self.system.as_mut()?;
        system.solve_in_place(&self.values, &self.contacts.unknown_forces, &self.dofs, forces).ok()
    }
}
