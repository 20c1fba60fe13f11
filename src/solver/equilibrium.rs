//! What the search for an equilibrium came to, and displacements that follow its forces.

use crate::assembly::elastic::Relaxed;
use crate::solver::balance::Balance;
use crate::solver::damage::DamageWatch;
use crate::solver::newton::Newton;
use crate::tensor::Vector6;

/// What the search for an equilibrium came to.
#[derive(Debug, Clone, PartialEq)]
pub struct Equilibrium {
    pub converged: bool,
    /// Whether it was taken for one though gaps or damage had not settled.
    pub unsettled: bool,
    pub balance: Balance,
    /// Out-of-balance of each augmentation.
    pub history: Vec<f64>,
    pub augmentations: usize,
    /// Energy in elastic bodies [J].
    pub surface_energy: f64,
    /// Work on each component of each carrier along a stabilised increment [J].
    pub work: Vec<Vector6<f64>>,
    /// Work of the pressure on the volume under the cover along it, without what bodies bend [J].
    pub pressure_work: f64,
    /// Work of forces on displacements of bodies that follow them by steps, beyond what these store [J].
    pub bending_loss: f64,
    /// Why a body that damage has softened could not be solved for, if so.
    pub broke: Option<String>,
}

impl Equilibrium {
    /// Nothing has been done yet.
    pub(super) fn begun(balance: Balance) -> Self {
        Equilibrium {
            converged: false,
            unsettled: false,
            balance,
            history: vec![balance.out_of_balance],
            augmentations: 0,
            surface_energy: 0.0,
            work: Vec::new(),
            pressure_work: 0.0,
            bending_loss: 0.0,
            broke: None,
        }
    }
}

/// A gap of elastic bodies may miss by this share of what a rigid body yields to the mean contact
/// force, where that is less than the gap tolerance.
const GAP_SHARE: f64 = 1e-2;

/// What bodies that deform are off by, once their displacements follow the forces of a configuration.
pub(super) struct Following {
    /// The largest miss of a gap over its tolerance.
    pub gap: f64,
    /// The largest force out of balance on a node that is eliminated, over the force tolerance.
    pub node: f64,
    /// Elastic energy of these bodies [J].
    pub energy: f64,
}

impl Newton<'_> {
    /// Elastic energy of what deforms in the configuration last evaluated, in balance or not [J].
    pub(super) fn surface_energy(&self) -> f64 {
        self.contacts.elastic_energy(self.model, &self.loads, &self.poses)
    }

    /// Has the displacements of bodies follow the forces of the present configuration.
    pub(super) fn follow(&mut self, balance: &Balance, damage: &DamageWatch, tolerance: f64) -> Following {
        let yielding = balance.least_force / self.typical_stiffness;
        let usual = self.settings.gap_tolerance * self.model.typical_size();
        let gap_tolerance = usual.min((GAP_SHARE * yielding).max(damage.gap_floor()));
        let Relaxed { mismatch, left, energy } =
            self.contacts.relax(self.model, &self.loads, &self.poses, gap_tolerance);
        tracing::trace!(out_of_balance = balance.out_of_balance, mismatch, gap_tolerance, "elastic");
        Following { gap: mismatch / gap_tolerance, node: left / balance.least_force / tolerance, energy }
    }
}
