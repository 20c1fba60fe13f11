//! Newton's method alone, without drag, cap or line search: what its steps do to the forces out of
//! balance tells how good the tangent is.

use crate::assembly::Contacts;
use crate::solver::increment::Increment;
use crate::solver::newton::Newton;
use crate::tensor::Pose;

/// Largest force out of balance [N] before each of up to `steps` full steps from `start`. It ends early where it falls below `least` [N],
/// where no step can be found or where cores come too close.
pub fn plain_newton(increment: &Increment<'_>, start: Vec<Pose>, (steps, least): (usize, f64)) -> Vec<f64> {
    let Increment { model, committed, loads, settings } = *increment;
    let mut forces = Vec::new();
    let Ok(mut newton) = Newton::new(model, committed, loads, settings, Contacts::default(), start) else {
        return forces;
    };
    for _ in 0..steps {
        let (force, _) = newton.dofs.largest_force(&newton.residual);
        forces.push(force);
        let residual = newton.residual.clone();
        if force < least {
            break;
        }
        let Some(step) = newton.step(&residual) else { break };
        let from = (newton.poses.clone(), newton.away.clone());
        if newton.try_step(&from, &step, 1.0).is_none() {
            break;
        }
    }
    forces
}
