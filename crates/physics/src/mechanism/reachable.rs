//! The set of tip errors that are reachable with every part anywhere in its play and the drives held: its farthest point in a
//! direction. Contact between bodies, springs and inertia play no part.
//!
//! A unit force u at the tip of the mechanism without play presses its balls on their sockets with forces l_k, and does the
//! virtual work u . e = sum(l_k . d_k) while the balls are displaced by d_k in the sockets. Every ball with play c_k therefore
//! lies at c_k l_k / |l_k| where the tip is farthest along u (Venanzi & Parenti-Castelli, ASME J. Mech. Des. 127, 2005, pp.
//! 446-455; the set itself: Voglewede & Ebert-Uphoff, ASME J. Mech. Des. 126, 2004, pp. 283-290), and to first order the largest
//! u . e, the support of the set, is sum(c_k |l_k|). If joints share the load, the support is the least such sum over all l_k in
//! balance, by duality: the d_k of a redundant mechanism have to agree.
//!
//! The same statement holds for small changes of any pose with displaced balls. Applied to the pose that it leads to, until
//! nothing changes, it ends where no small change within the play takes the tip farther along u.

use super::constraints::Constraints;
use super::held::{DRIVE_END, HeldMachine, IMMOBILE};
use super::model::Model;
use super::start::factor_at;
use super::tree::Tree;
use crate::machine::{Mat3, Vec3};

/// Maximum number of poses, the first pose whose displacements are averaged with the previous ones, and the first whose
/// displacements are fixed. In a direction perpendicular to a face of the set they may alternate between its ends.
const MAX_POSES: usize = 40;
const FIRST_AVERAGED: usize = 12;
const FIRST_FIXED: usize = 24;
/// Shift of the tip from one pose to the next, over the largest clearance, at which they agree, and error of the openings at
/// which a pose counts as closed: a ball without load may lie anywhere.
const TIP_TOLERANCE: f64 = 1e-9;
const OPENING_TOLERANCE: f64 = 1e-6;
/// Change that is rounding, m.
const ROUNDING: f64 = 1e-14;

/// The tip's farthest error in one direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Farthest {
    /// Unit vector u, world axes.
    pub direction: Vec3,
    /// Support of the set along u to first order in the clearances, m.
    pub support: f64,
    /// Part of each joint with play in it, c_k |l_k|, m.
    pub shares: Vec<f64>,
    /// Error of the pose with displaced balls, m, world axes; `None` if its loops do not close.
    pub error: Option<Vec3>,
}

/// Directions of the tip with the drives held, orthonormal, world axes.
#[derive(Clone, Debug, PartialEq)]
pub struct TipFreedoms {
    /// Directions in which the tip moves even without play: nothing bounds the error.
    pub unbounded: Vec<Vec3>,
    /// Directions perpendicular to those, in which it moves by play alone. A planar mechanism has two.
    pub bounded: Vec<Vec3>,
}

impl HeldMachine {
    /// Directions in which the tip can err.
    pub fn freedoms(&mut self) -> TipFreedoms {
        self.factor(&self.ideal.clone());
        let unconstrained = self.mobility(|_| {}).trace();
        let loose = Model::new(&self.machine);
        let mut constraints = Constraints::new(&loose, &loose.ideal_joints);
        if constraints.rows() > 0 {
            // The rows of all joints may be dependent, and then some of these are, too.
            constraints.treat_as_dependent(constraints.rows());
        }
        factor_at(&self.model, &mut constraints, &mut self.tree, DRIVE_END, &self.ideal);
        let loose = self.mobility(|vdot| constraints.project_accelerations(&self.model, vdot));
        self.factor(&self.ideal.clone());
        let closed = self.closed_mobility();
        let least = IMMOBILE * unconstrained;
        let unbounded = range(&closed, least);
        let mut across = Mat3::identity();
        for free in &unbounded {
            across -= free * free.transpose();
        }
        TipFreedoms { bounded: range(&(across * loose * across), least), unbounded }
    }

    /// The farthest error along the unit vector `direction`, one of those that [`TipFreedoms::bounded`] span.
    pub fn farthest(&mut self, direction: &Vec3) -> Farthest {
        let rows = self.constraints.rows();
        let most = self.members.largest_play();
        let mut y = self.ideal.clone();
        let (mut openings, mut targets, mut step) = (vec![0.0; rows], vec![0.0; rows], vec![0.0; self.model.nv]);
        let (mut support, mut shares, mut error) = (0.0, Vec::new(), None);
        let mut tip = self.ideal_tip;
        for pose in 0..MAX_POSES {
            self.factor(&y);
            let mut loads = vec![0.0; rows];
            let mut vdot = self.tip_load(direction);
            self.tree.solve(&self.model, &mut vdot);
            self.constraints.balance_loads(&self.model, &mut vdot, &mut loads);
            self.constraints.openings(&self.tree.motion, &mut openings);
            let null: Vec<Vec<f64>> = self.constraints.system().null_multipliers().map(<[f64]>::to_vec).collect();
            let (displaced, work) = self.members.displace(&self.model, &self.tree.motion, &null, &openings, &loads);
            if pose == 0 {
                support = work.iter().sum();
                shares = work;
            }
            let weight = match pose {
                ..FIRST_AVERAGED => 1.0,
                FIRST_AVERAGED..FIRST_FIXED => 0.5,
                _ => 0.0,
            };
            for (target, displaced) in targets.iter_mut().zip(&displaced) {
                *target += weight * (displaced - *target);
            }
            let change: Vec<f64> = targets.iter().zip(&openings).map(|(target, opening)| target - opening).collect();
            let size = change.iter().fold(0.0, |most: f64, part| if part.abs() <= most { most } else { part.abs() });
            let shifted = (self.tip() - tip).norm();
            tip = self.tip();
            error = (size <= (OPENING_TOLERANCE * most).max(ROUNDING)).then_some(tip - self.ideal_tip);
            let has_converged = shifted <= (TIP_TOLERANCE * most).max(ROUNDING) && pose > 0;
            if (has_converged && error.is_some()) || !size.is_finite() {
                break;
            }
            self.constraints.displacement_for_opening(&self.model, &change, &mut step);
            Tree::displace(&self.model, &mut y, &step);
        }
        Farthest { direction: *direction, support, shares, error }
    }

    /// Matrices of the constraints at the pose `y`.
    fn factor(&mut self, y: &[f64]) {
        factor_at(&self.model, &mut self.constraints, &mut self.tree, DRIVE_END, y);
    }
}

/// Orthonormal basis of the range of the symmetric, positive semidefinite matrix `m`; diagonal elements up to `least` count as
/// zero. The basis of space is the world axes, and that of a plane is aligned with them as far as possible.
fn range(m: &Mat3, least: f64) -> Vec<Vec3> {
    let mut remainder = *m;
    let mut basis: Vec<Vec3> = Vec::new();
    while basis.len() < 3 {
        let most = (0..3).max_by(|&a, &b| remainder[(a, a)].total_cmp(&remainder[(b, b)])).unwrap_or(0);
        if !(remainder[(most, most)] > least) {
            break;
        }
        let axis: Vec3 = remainder.column(most).normalize();
        let across = Mat3::identity() - axis * axis.transpose();
        remainder = across * remainder * across;
        basis.push(axis);
    }
    match basis[..] {
        [_, _, _] => vec![Vec3::x(), Vec3::y(), Vec3::z()],
        [a, b] => {
            let normal = upward(a.cross(&b));
            let axis = if normal.x.abs() < 0.7 { Vec3::x() } else { Vec3::y() };
            let first = (axis - normal * normal.dot(&axis)).normalize();
            vec![first, normal.cross(&first)]
        }
        [along] => vec![upward(along)],
        _ => Vec::new(),
    }
}

/// `v` or its opposite, with a positive largest component.
fn upward(v: Vec3) -> Vec3 {
    if v[v.iamax()] < 0.0 { -v } else { v }
}
