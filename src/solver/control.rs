//! An unknown load factor that is found together with the motion, so that a scalar of the
//! configuration meets its target in the same Newton solve.
//!
//! The tangent gets a border: with `b` the derivative of the forces by the factor and `c` that of the
//! scalar by the motion, `K dq - b dy = r`, `c dq = target - value`. One factorisation of K, two
//! solves. The factor's unknown and the scalar's residual are scaled to a length and a force, so that they
//! stand beside the others in the merit.

use crate::assembly::{self, Contacts, Dofs};
use crate::model::{Control, Controlled, Loads, Model};
use crate::tensor::{Pose, Vector6};

/// A [`Control`] in a Newton solve.
#[derive(Debug, Clone)]
pub struct Steering {
    control: Control,
    /// Loads at the factor zero.
    pressure_at_zero: f64,
    applied_at_zero: Vec<Vector6<f64>>,
    pub factor: f64,
    centre: f64,
    /// Factor per unit of its unknown [factor/m].
    factor_scale: f64,
    /// Residual per unit of the scalar [N/scalar].
    residual_scale: f64,
    column: Vec<f64>,
    row: Vec<f64>,
}

impl Steering {
    /// `stiffness` [N/m] is typical of the model. The factor starts at the control's guess.
    pub fn new(
        control: &Control,
        model: &Model,
        dofs: &Dofs,
        loads: &Loads,
        poses: &[Pose],
        stiffness: f64,
    ) -> Self {
        let mut steering = Steering {
            control: control.clone(),
            pressure_at_zero: loads.pressure,
            applied_at_zero: loads.applied.clone(),
            factor: control.guess,
            centre: control.guess,
            factor_scale: 1.0,
            residual_scale: 1.0,
            column: Vec::new(),
            row: Vec::new(),
        };
        steering.update_border(model, dofs, None, poses);
        let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
        steering.factor_scale = stiffness / norm(&steering.column);
        steering.residual_scale = stiffness / norm(&steering.row);
        steering
    }

    /// Sets the loads to those of the present factor.
    pub fn apply(&self, loads: &mut Loads) {
        loads.pressure = self.pressure_at_zero + self.factor * self.control.pressure;
        loads.applied.clone_from(&self.applied_at_zero);
        for (body, wrench) in &self.control.applied {
            loads.applied[*body] += wrench * self.factor;
        }
    }

    /// Makes the present factor the centre from which its unknown counts.
    pub fn recentre(&mut self) {
        self.centre = self.factor;
    }

    /// Sets the factor's unknown to `away` [m] from the centre, and the loads with it.
    pub fn move_to(&mut self, away: f64, loads: &mut Loads) {
        self.factor = self.centre + self.factor_scale * away;
        self.apply(loads);
    }

    /// What the scalar lacks to its target, in its own unit.
    pub fn lack(&self, model: &Model, poses: &[Pose]) -> f64 {
        match self.control.of {
            Controlled::Volume => self.control.target - model.enclosed_volume(poses),
            Controlled::Position { body, axis } => self.control.target - poses[body].position[axis],
        }
    }

    pub fn is_met(&self, model: &Model, poses: &[Pose]) -> bool {
        self.lack(model, poses).abs() <= self.control.tolerance
    }

    /// The lack as a force [N].
    pub fn residual(&self, model: &Model, poses: &[Pose]) -> f64 {
        self.residual_scale * self.lack(model, poses)
    }

    /// Computes the border of the tangent at `poses`, where `contacts` have their tangents.
    pub fn update_border(&mut self, model: &Model, dofs: &Dofs, contacts: Option<&Contacts>, poses: &[Pose]) {
        // Unit pressure loads the bodies with minus the derivative of the volume.
        let mut volume = vec![Vector6::zeros(); model.carriers()];
        assembly::pressure_loads_into(&mut volume, model, poses, 1.0);
        for entries in [&mut self.column, &mut self.row] {
            entries.clear();
            entries.resize(dofs.count(), 0.0);
        }
        for (body, wrench) in volume.iter().enumerate() {
            let load = wrench * (self.control.pressure * self.factor_scale);
            dofs.scatter(&mut self.column, body, load.as_slice());
        }
        if let Some(contacts) = contacts {
            let pressure = self.control.pressure * self.factor_scale;
            contacts.unknown_forces.pressure_into(&mut self.column, dofs, pressure);
        }
        for (body, wrench) in &self.control.applied {
            dofs.scatter(&mut self.column, *body, (wrench * self.factor_scale).as_slice());
        }
        match self.control.of {
            Controlled::Volume => {
                for (body, wrench) in volume.iter().enumerate() {
                    dofs.scatter(&mut self.row, body, (wrench * -self.residual_scale).as_slice());
                }
            }
            Controlled::Position { body, axis } => {
                let mut wrench = Vector6::zeros();
                wrench[axis] = self.residual_scale;
                dofs.scatter(&mut self.row, body, wrench.as_slice());
            }
        }
    }

    /// Completes a step: `step` holds the solution of `K x = r` on entry, followed by the residual of the
    /// control; `solve` solves another right side with K. `None` where the border is singular.
    pub fn complete(&self, step: &mut [f64], solve: impl FnOnce(&mut [f64]) -> Option<()>) -> Option<()> {
        let mut by_factor = self.column.clone();
        solve(&mut by_factor)?;
        let (last, motion) = step.split_last_mut()?;
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let factor = (*last - dot(&self.row, motion)) / dot(&self.row, &by_factor);
        if !factor.is_finite() {
            return None;
        }
        for (x, z) in motion.iter_mut().zip(&by_factor) {
            *x += factor * z;
        }
        *last = factor;
        Some(())
    }
}
