//! Start of a mechanism: assembly from the scene's values, how far it moved the bodies, and the rank of the constraints.

use super::closed_form::ClosedForm;
use super::constraints::Constraints;
use super::kinematics::{self, Kinematics};
use super::model::{self, Model, Motion};
use super::tree::Tree;
use super::{Mechanism, MechanismError, OPEN_AS_GIVEN};
use crate::scene::{StartRule, Vec3};

/// Smallest pivot ratio at which the start velocities still have three correct digits.
const DEPENDENT_ROWS: f64 = 1e-13;
/// Largest gap at which a loop counts as closed at the start, m.
const CLOSED: f64 = 1e-9;
/// With dependent rows, largest speed at which a joint may open at the start, m/s: rounding of the drives.
const HELD: f64 = 1e-8;
/// Distance of the neighbouring poses at which the rank is checked, as a time at the scales' speeds, s: a tenth of the
/// length scale, 0.01 rad.
const BESIDE: f64 = 0.01;
/// Assembly has come to rest once it moves by less than this fraction of the scales.
const AT_REST: f64 = 1e-9;

/// How assembly at the start changed the scene's values. In a scene that follows a closed form the guess comes from it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Assembly {
    /// How far each body was moved from the guess.
    pub bodies: Vec<Placement>,
    /// Of the joints that start closed, the one with the widest gap in the guess, and |Z_j - Z_i| there, m.
    pub widest: Option<(usize, f64)>,
    /// Whether the loops closed in another assembly mode than that of the guess, with a singular pose between the two. Known
    /// only if closed joints and drives leave no degree of freedom.
    pub other_mode: bool,
    /// Whether the guess comes from the closed form.
    pub closed_form: bool,
}

/// How far assembling moved a body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Placement {
    /// Distance of its frame's origin from that in the guess, m.
    pub moved: f64,
    /// Angle from its orientation in the guess, rad.
    pub turned: f64,
}

impl Mechanism {
    /// How [`Self::start`] changed the scene's values.
    pub fn assembly(&self) -> &Assembly {
        &self.assembly
    }

    /// State at t = 0: positions, then velocities.
    ///
    /// # Errors
    /// Ball joints that do not close.
    pub fn start(&mut self) -> Result<Vec<f64>, MechanismError> {
        const T: f64 = 0.0;
        let model = &self.model;
        let assembled = model.start == StartRule::Ideal;
        let all: Vec<usize> = if assembled {
            (0..model.joints.len()).collect()
        } else {
            model.ideal_joints.clone()
        };
        // Poses alone need no mass matrix.
        let mut tree = if all.is_empty() {
            Tree::without_masses(model)
        } else {
            Tree::new(model)
        };
        let settled = self.settled.as_ref().map(|settled| &settled.state);
        let mut y = settled.unwrap_or(&model.start_state).clone();
        let closed_form = model.closed_form.as_deref().filter(|_| assembled);
        if let Some(form) = closed_form {
            place_output_body(model, form, &mut y);
            tree.update_kinematics(model, T, &y);
            turn_hinges(model, &tree.motion, &mut y);
        }
        tree.update_kinematics(model, T, &y);
        let guess = tree.motion.clone();
        let distance = |j: usize| model.joints[j].eccentricity(&guess).norm();
        for j in 0..model.joints.len() {
            let d = distance(j);
            let joint = || self.joint_names[j].clone();
            let clearance = self.contacts.clearance(j);
            if all.contains(&j) {
                // An assembled start only needs a rough guess, which Newton's method then closes.
                if d > OPEN_AS_GIVEN && !assembled {
                    return Err(MechanismError::Open {
                        joint: joint(),
                        given: d,
                    });
                }
            } else if d > clearance + 0.01 * self.contacts.coefficients(j).ball_radius {
                return Err(MechanismError::OutsideSocket {
                    joint: joint(),
                    distance: d,
                    clearance,
                });
            }
        }
        let widest = all.iter().map(|&j| (j, distance(j)));
        let mut assembly = Assembly {
            widest: widest.max_by(|a, b| a.1.total_cmp(&b.1)),
            closed_form: closed_form.is_some(),
            ..Assembly::default()
        };
        if !all.is_empty() {
            let mut constraints = Constraints::new(model, &all);
            let guessed = y.clone();
            self.assemble(&mut constraints, &mut tree, &mut y)?;
            assembly.other_mode = is_other_mode(model, &mut constraints, &mut tree, &guessed, &y);
        }
        Tree::normalise(model, &mut y);
        tree.update_kinematics(model, T, &y);
        let bodies = model.bodies.iter().zip(guess.iter().zip(&tree.motion));
        assembly.bodies = bodies.map(|(body, (a, b))| placement(body, a, b)).collect();
        let rank = self.rank_of_ideal_joints(&mut tree, &y)?;
        if rank.is_some() {
            self.check_speeds(&mut tree, &y)?;
        }
        self.assembly = match &self.settled {
            Some(settled) => settled.assembly.clone(),
            None => assembly,
        };
        self.rank = rank;
        if let Some(rank) = rank {
            self.equations.treat_as_dependent(rank);
        }
        Ok(self.equations.state_of(&self.model, y, &tree.motion))
    }

    /// Closes the joints of `constraints` from the guess in `y`.
    fn assemble(
        &self,
        constraints: &mut Constraints,
        tree: &mut Tree,
        y: &mut Vec<f64>,
    ) -> Result<(), MechanismError> {
        const T: f64 = 0.0;
        let model = &self.model;
        let guess = y.clone();
        let error = constraints.project(model, tree, T, y);
        tree.update_kinematics(model, T, y);
        if error <= CLOSED && constraints.system().least_joint_pivot(3) >= DEPENDENT_ROWS {
            return Ok(());
        }
        // Rows are dependent here or were on the way here: try again with the independent ones.
        constraints.treat_as_dependent(constraints.rows());
        y.clone_from(&guess);
        let error = constraints.project(model, tree, T, y);
        tree.update_kinematics(model, T, y);
        if !(error <= CLOSED) {
            return Err(self.no_closure(constraints, tree, &guess, y));
        }
        // In a singular pose of a closed form the drives do not determine the velocities, with clearance or without.
        if model.closed_form.is_some() && rank_around(model, constraints, tree, y).is_none() {
            return Err(MechanismError::Singular);
        }
        Ok(())
    }

    /// Checks that no ideal joint opens at the velocities in `y`: where directions are constrained more than once, for
    /// example by drives, these may contradict one another.
    fn check_speeds(&self, tree: &mut Tree, y: &[f64]) -> Result<(), MechanismError> {
        tree.update_kinematics(&self.model, 0.0, y);
        for &j in &self.model.ideal_joints {
            let rate = self.model.joints[j].opening_rate(&tree.motion);
            if !(rate.norm() <= HELD) {
                let joint = self.joint_names[j].clone();
                return Err(MechanismError::InconsistentDrives { joint, rate });
            }
        }
        Ok(())
    }

    /// The error for loops that are still open at `y`.
    fn no_closure(
        &self,
        constraints: &mut Constraints,
        tree: &mut Tree,
        guess: &[f64],
        y: &[f64],
    ) -> MechanismError {
        const T: f64 = 0.0;
        let model = &self.model;
        let mut again = y.to_vec();
        constraints.project(model, tree, T, &mut again);
        let steps = again.iter().zip(y).zip(&model.scale).take(model.nq);
        let at_rest = steps
            .map(|((a, b), scale)| (a - b).abs() / scale)
            .all(|moved| moved <= AT_REST);
        let joints = constraints.joints().to_vec();
        let name = |j: usize| self.joint_names[j].clone();
        tree.update_kinematics(model, T, &again);
        let open = |&j: &usize| {
            let gap = model.joints[j].eccentricity(&tree.motion);
            (gap.norm() > CLOSED).then(|| (name(j), gap))
        };
        let stays = if at_rest {
            joints.iter().filter_map(open).collect()
        } else {
            Vec::new()
        };
        tree.update_kinematics(model, T, guess);
        let given = |j: usize| model.joints[j].eccentricity(&tree.motion).norm();
        let given = joints.iter().map(|&j| (j, given(j)));
        let (joint, given) = given.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_default();
        MechanismError::NoClosure {
            joint: name(joint),
            given,
            stays,
        }
    }

    /// Rank of the ideal joints' rows in the assembled pose `y` and around it; `None` if all are independent.
    fn rank_of_ideal_joints(
        &self,
        tree: &mut Tree,
        y: &[f64],
    ) -> Result<Option<usize>, MechanismError> {
        const T: f64 = 0.0;
        let model = &self.model;
        if model.ideal_joints.is_empty() {
            return Ok(None);
        }
        let mut constraints = Constraints::new(model, &model.ideal_joints);
        factor_at(model, &mut constraints, tree, T, y);
        if constraints.system().least_joint_pivot(3) >= DEPENDENT_ROWS {
            return Ok(None);
        }
        constraints.treat_as_dependent(constraints.rows());
        let rank = rank_around(model, &mut constraints, tree, y);
        rank.map(Some).ok_or_else(|| {
            if model.closed_form.is_some() {
                return MechanismError::Singular;
            }
            factor_at(model, &mut constraints, tree, T, y);
            let names = model.ideal_joints.iter().enumerate();
            let shared = names.filter(|&(k, _)| !constraints.is_unique(k));
            MechanismError::Branching {
                joints: shared.map(|(_, &j)| self.joint_names[j].clone()).collect(),
            }
        })
    }

    /// Whether the force of actuator `i` is unique at the latest evaluation.
    pub fn is_actuator_unique(&mut self, i: usize) -> bool {
        self.equations
            .is_actuator_unique(&self.model, &self.gravity, i)
    }
}

/// Rank of `constraints`, treated as dependent, at the assembled state `y` if it is the same in neighbouring poses; `None`
/// if it is larger there: the pose is singular.
fn rank_around(
    model: &Model,
    constraints: &mut Constraints,
    tree: &mut Tree,
    y: &[f64],
) -> Option<usize> {
    const T: f64 = 0.0;
    factor_at(model, constraints, tree, T, y);
    let rank = constraints.rank();
    if rank == model.nv {
        return Some(rank);
    }
    // The rows looked dependent only because a singular pose is narrowly missed.
    if rank == constraints.rows() {
        return None;
    }
    let period = (0.002 * model.shortest_period).min(1e-3);
    let mut beside = Vec::new();
    for sign in [1.0, -1.0] {
        if !model.drives.is_empty() {
            beside.push((
                sign * period,
                y[model.nq..].iter().map(|v| v * sign * period).collect(),
            ));
        }
        for direction in 1..=2 {
            factor_at(model, constraints, tree, T, y);
            let mut free: Vec<f64> = (0..model.nv)
                .map(|i| model.scale[model.nq + i] * libm::sin((direction * (2 * i + 1)) as f64))
                .collect();
            constraints.project_accelerations(model, &mut free);
            let sizes = free.iter().zip(&model.scale[model.nq..]);
            let largest = sizes.fold(0.0_f64, |most, (v, scale)| most.max(v.abs() / scale));
            let step: Vec<f64> = free.iter().map(|v| sign * BESIDE * v / largest).collect();
            beside.push((0.0, step));
        }
    }
    let grows = beside.iter().any(|(t, step): &(f64, Vec<f64>)| {
        let mut near = y.to_vec();
        Tree::displace(model, &mut near, step);
        let error = constraints.project(model, tree, T + t, &mut near);
        factor_at(model, constraints, tree, T + t, &near);
        !(error <= CLOSED) || constraints.rank() > rank
    });
    (!grows).then_some(rank)
}

/// Jacobians and J M^-1 J^T at (t, y).
fn factor_at(model: &Model, constraints: &mut Constraints, tree: &mut Tree, t: f64, y: &[f64]) {
    tree.update_kinematics(model, t, y);
    constraints.prepare(model, tree, t, &y[..model.nq], &Vec3::zeros());
}

/// Whether closed joints leave no degree of freedom and a singular pose lies between the guess and the assembled state
/// `y`: the determinant of as many independent rows as coordinates then has opposite signs at the two.
fn is_other_mode(
    model: &Model,
    constraints: &mut Constraints,
    tree: &mut Tree,
    guess: &[f64],
    y: &[f64],
) -> bool {
    let mut sign_at = |y: &[f64], places: Option<&[usize]>| {
        factor_at(model, constraints, tree, 0.0, y);
        let rows = places.map_or_else(|| constraints.system().independent(), <[usize]>::to_vec);
        if rows.len() != model.nv {
            return None;
        }
        let place = |row: usize| rows.iter().position(|&kept| kept == row);
        let sign = constraints.is_minor_positive(model, place);
        Some((sign, rows))
    };
    let Some((end, rows)) = sign_at(y, None) else {
        return false;
    };
    sign_at(guess, Some(&rows)).is_some_and(|(sign, _)| sign != end)
}

fn placement(body: &model::Body, from: &Kinematics, to: &Kinematics) -> Placement {
    let origin = |m: &Kinematics| m.position + m.rotation * body.origin;
    let turn = from.rotation.tr_mul(&to.rotation);
    // Sine and cosine of the angle: the cosine alone does not resolve small angles.
    let sine = Vec3::new(
        turn[(2, 1)] - turn[(1, 2)],
        turn[(0, 2)] - turn[(2, 0)],
        turn[(1, 0)] - turn[(0, 1)],
    );
    Placement {
        moved: (origin(to) - origin(from)).norm(),
        turned: libm::atan2(sine.norm(), turn.trace() - 1.0),
    }
}

/// Places the free output body as in the ideal mechanism at t = 0, so that assembly has little left to do.
fn place_output_body(model: &Model, form: &dyn ClosedForm, y: &mut [f64]) {
    let ideal = form.at(0.0);
    let body = &model.bodies[model.output_body];
    if let Motion::Free { q, v } = body.motion {
        let to_centroid = -(ideal.rotation * body.origin);
        let position = Vec3::from_fn(|i, _| ideal.position[i].value) + to_centroid;
        let rotation = kinematics::quaternion_of(&ideal.rotation);
        y[q..q + 3].copy_from_slice(position.as_slice());
        y[q + 3..q + 7].copy_from_slice(&[rotation.w, rotation.i, rotation.j, rotation.k]);
        let velocity = Vec3::from_fn(|i, _| ideal.position[i].rate)
            + ideal.angular_velocity.cross(&to_centroid);
        let v = model.nq + v;
        y[v..v + 3].copy_from_slice(velocity.as_slice());
        y[v + 3..v + 6].copy_from_slice(ideal.angular_velocity.as_slice());
    }
}

/// Turns every hinged body that carries a ball so that the ball is closest to its socket and loops close on the branch of
/// the closed form.
fn turn_hinges(model: &Model, motion: &[Kinematics], y: &mut [f64]) {
    for joint in &model.joints {
        let motion_of = |b: usize| model.bodies.get(b).map(|body| body.motion);
        let Some(Motion::Revolute { q, .. }) = motion_of(joint.ball.body) else {
            continue;
        };
        let body = &motion[joint.ball.body];
        let hinge = body.position - body.arm;
        let centre = |a: &model::Anchor| {
            motion[a.body].position + motion[a.body].rotation * a.offset - hinge
        };
        let (ball, socket, axis) = (centre(&joint.ball), centre(&joint.socket), body.axis);
        let sine = axis.dot(&ball.cross(&socket));
        let cosine = ball.dot(&socket) - axis.dot(&ball) * axis.dot(&socket);
        y[q] += libm::atan2(sine, cosine);
    }
}
