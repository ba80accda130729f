//! Joints that are open by given amounts, and the part of given loads that joints balance.

use super::Constraints;
use crate::mechanism::kinematics::Kinematics;
use crate::mechanism::model::Model;

impl Constraints {
    /// Removes the part of the accelerations `vdot` that would open the joints: the linear part of [`Self::correct`], with its
    /// matrices.
    pub fn project_accelerations(&mut self, model: &Model, vdot: &mut [f64]) {
        for (u, unit) in self.units.iter().enumerate() {
            let moved = self.apply(model, u, vdot);
            let own = self.scratch[unit.range()].iter_mut();
            for (x, moved) in own.zip(unit.components(moved)) {
                *x = -moved;
            }
        }
        self.matrix.solve(&mut self.scratch);
        self.add_weighted(model, &self.scratch, vdot);
    }

    /// Writes the violation of every row at `motion` to `out`, m or rad.
    pub fn openings(&mut self, motion: &[Kinematics], out: &mut [f64]) {
        self.set_residuals(motion, 0);
        for (out, x) in out.iter_mut().zip(&self.multipliers) {
            *out = -x;
        }
    }

    /// Displacement of the coordinates, least in the metric of the mass matrix, that changes the openings of all rows by
    /// `change`, to first order and with the latest matrices.
    pub fn displacement_for_opening(&mut self, model: &Model, change: &[f64], step: &mut [f64]) {
        self.multipliers.copy_from_slice(change);
        self.matrix.solve(&mut self.multipliers);
        step.fill(0.0);
        self.add_weighted(model, &self.multipliers, step);
    }

    /// Loads x, N or N m, of the rows that balance generalised forces f, given f as the accelerations `vdot` = M^-1 f. J^T x = f,
    /// except for the part of f that moves the joints freely; its accelerations remain in `vdot`. If rows are dependent, any
    /// multiple of [`Self::system`]'s null vectors may be added to x.
    pub fn balance_loads(&mut self, model: &Model, vdot: &mut [f64], x: &mut [f64]) {
        self.project_accelerations(model, vdot);
        for (x, multiplier) in x.iter_mut().zip(&self.scratch) {
            *x = -multiplier;
        }
    }
}
