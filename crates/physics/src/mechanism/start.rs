//! Start of a mechanism: assembly from the scene's values, displacement of the bodies, and rank of the constraints.

use super::assembly::{Assembled, Assembly, Placement};
use super::closed_form::ClosedMotion;
use super::constraints::Constraints;
use super::kinematics::{self, Kinematics};
use super::model::{self, Model, Motion};
use super::pairs::Opening;
use super::tree::Tree;
use super::{MAX_GIVEN_ANGLE, MAX_GIVEN_GAP, Mechanism, MechanismError, OpenJoint};
use crate::machine::{JointStart, Machine, StartRule, Vec3};

/// Smallest pivot ratio at which the start velocities still have three correct digits.
const DEPENDENT_ROWS: f64 = 1e-13;
/// Largest gap at which a loop counts as closed at the start, m or rad.
pub(super) const CLOSED: f64 = 1e-9;
/// With dependent rows, maximum speed at which a joint may open at the start, m/s or rad/s: rounding of the drives.
pub(super) const MAX_OPENING_RATE: f64 = 1e-8;
/// Displacement to the neighbouring poses at which the rank is checked, as a time at the scales' speeds, s: a tenth of the length
/// scale, 0.01 rad.
const NEIGHBOUR_STEP: f64 = 0.01;
/// Distance of a motion without play from its closed form, m, beyond which the two differ.
pub const OFF_PATH: f64 = 1e-6;
/// Assembly has converged once it moves by less than this fraction of the scales.
const AT_REST: f64 = 1e-9;

/// Pose and motion of the frame of each body at t = 0, as start values and drives of the tree joints say.
pub fn poses_as_given(machine: &Machine) -> Vec<JointStart> {
    let model = Model::new(machine);
    let mut tree = Tree::without_masses(&model);
    tree.update_kinematics(&model, 0.0, &model.start_state);
    let pose = |(body, m): (&model::Body, &Kinematics)| {
        let arm = m.rotation * body.origin;
        JointStart::Pose {
            position: m.position + arm,
            rotation: kinematics::quaternion_of(&m.rotation),
            velocity: m.point_velocity(&arm),
            angular_velocity: m.angular_velocity,
        }
    };
    model.bodies.iter().zip(&tree.motion).map(pose).collect()
}

impl Mechanism {
    /// Changes to the scene's values made by [`Self::start`]; none before.
    pub fn assembly(&self) -> &Assembly {
        static NONE: Assembly = Assembly {
            bodies: Vec::new(),
            widest: None,
            most_turned: None,
            other_mode: false,
            closed_form: false,
            unstable_rest: None,
        };
        self.model.assembled.get().map_or(&NONE, |assembled| &assembled.assembly)
    }

    /// State at t = 0: positions, then velocities.
    ///
    /// # Errors
    /// Joints that do not close, a singular start pose, or a path in closed form that does not pass through that pose.
    pub fn start(&mut self) -> Result<Vec<f64>, MechanismError> {
        self.start_checked(true)
    }

    /// The same for a machine that need not be on its path in closed form, because its balls or drives were moved.
    ///
    /// # Errors
    /// Joints that do not close, or a singular start pose.
    pub(super) fn start_off_path(&mut self) -> Result<Vec<f64>, MechanismError> {
        self.start_checked(false)
    }

    /// State at t = 0; `on_path`: the path in closed form, if there is one, must pass through it.
    fn start_checked(&mut self, on_path: bool) -> Result<Vec<f64>, MechanismError> {
        const T: f64 = 0.0;
        let model = &self.model;
        let assembled = model.start == StartRule::Ideal;
        let all: Vec<usize> = if assembled { (0..model.joints.len()).collect() } else { model.ideal_joints.clone() };
        let closes = !all.is_empty() || model.closes_loops();
        // Poses alone need no mass matrix.
        let mut tree = if closes { Tree::new(model) } else { Tree::without_masses(model) };
        let settled = model.settled.as_ref().map(|settled| &settled.state);
        let mut y = settled.unwrap_or(&model.start_state).clone();
        let ideal = model.path().filter(|_| assembled).map(|(form, path)| path.at(&form.at(T)));
        if let Some(ideal) = &ideal {
            place_output_body(model, ideal, &mut y);
            tree.update_kinematics(model, T, &y);
            turn_hinges(model, &tree.motion, &mut y);
        }
        tree.update_kinematics(model, T, &y);
        let guess = tree.motion.clone();
        for (j, joint) in model.joints.iter().enumerate() {
            if all.contains(&j) {
                // An assembled start needs only a rough guess, from which Newton's method closes the joints.
                let opening = model.opening(j, &guess);
                if opening.apart.norm() > MAX_GIVEN_GAP && !assembled {
                    return Err(MechanismError::Open { given: self.gap(j, opening) });
                }
                continue;
            }
            for c in joint.contacts.clone() {
                let (distance, clearance) = (model.sites[c].distance(&guess), self.contacts.clearance(c));
                if distance > clearance + 0.01 * self.contacts.coefficients(c).ball_radius {
                    let joint = self.joint_names[j].clone();
                    return Err(MechanismError::OutsideSocket { joint, distance, clearance });
                }
            }
        }
        let balls = model.joints.len();
        let openings = model.closures.iter().map(|pair| pair.opening(&guess));
        let openings: Vec<(usize, Opening)> = (balls..).zip(openings).collect();
        for &(joint, opening) in &openings {
            let Opening { apart, turned } = opening;
            let closed = apart.norm() <= MAX_GIVEN_GAP && turned <= MAX_GIVEN_ANGLE;
            if !assembled && !closed {
                let given = self.gap(joint, opening);
                return Err(MechanismError::Open { given });
            }
        }
        let widest = all.iter().map(|&j| (j, model.opening(j, &guess).apart.norm()));
        let widest = widest.chain(openings.iter().map(|(j, o)| (*j, o.apart.norm())));
        let turned = openings.iter().map(|(j, o)| (*j, o.turned));
        let mut assembly = Assembly {
            widest: widest.max_by(|a, b| a.1.total_cmp(&b.1)),
            most_turned: turned.max_by(|a, b| a.1.total_cmp(&b.1)),
            closed_form: ideal.is_some(),
            ..Assembly::default()
        };
        if closes {
            let mut constraints = Constraints::new(model, &all);
            let guessed = y.clone();
            self.assemble(&mut constraints, &mut tree, &mut y)?;
            assembly.other_mode = is_other_mode(model, &mut constraints, &mut tree, &guessed, &y);
        }
        Tree::normalise(model, &mut y);
        tree.update_kinematics(model, T, &y);
        let bodies = model.bodies[..model.massive].iter();
        let bodies = bodies.zip(guess.iter().zip(&tree.motion));
        assembly.bodies = bodies.map(|(body, (a, b))| placement(body, a, b)).collect();
        let rank = self.rank_of_closed_joints(&mut tree, &y)?;
        if rank.is_some() {
            self.check_opening_rates(&mut tree, &y)?;
        }
        // With play, the output body may leave its path.
        if let Some((form, path)) = model.path().filter(|_| on_path && (assembled || self.is_kinematic())) {
            let distance = kinematics::distance_from(&path.at(&form.at(T)), model, &tree.motion);
            if distance > OFF_PATH {
                return Err(MechanismError::OffPath { body: self.output_name.clone(), distance });
            }
        }
        let settled = model.settled.as_ref().map(|settled| settled.assembly.clone());
        // A second call has the same result.
        model.assembled.get_or_init(|| Assembled { assembly: settled.unwrap_or(assembly), rank });
        if let Some(rank) = rank {
            self.equations.treat_as_dependent(rank);
        }
        self.turns.start(&self.model, &mut tree, &y);
        let mut state = self.equations.state_of(&self.model, y, &tree.motion);
        state.resize(self.dimension(), 0.0);
        Ok(state)
    }

    /// Closes the joints of `constraints` from the guess in `y`.
    fn assemble(&self, constraints: &mut Constraints, tree: &mut Tree, y: &mut Vec<f64>) -> Result<(), MechanismError> {
        const T: f64 = 0.0;
        let model = &self.model;
        let guess = y.clone();
        let error = constraints.project(model, tree, T, y);
        tree.update_kinematics(model, T, y);
        if error <= CLOSED && constraints.least_joint_pivot() >= DEPENDENT_ROWS {
            return self.check_axis_directions(constraints, tree, &guess, y);
        }
        // Rows are dependent here or were on the way: retry with the independent rows.
        constraints.treat_as_dependent(constraints.rows());
        y.clone_from(&guess);
        let error = constraints.project(model, tree, T, y);
        tree.update_kinematics(model, T, y);
        if !(error <= CLOSED) {
            return Err(self.no_closure(constraints, tree, &guess, y));
        }
        // In a singular pose of a closed form, the drives do not determine the velocities, with or without clearance.
        if model.path().is_some() && rank_around(model, constraints, tree, y).is_none() {
            return Err(MechanismError::Singular);
        }
        self.check_axis_directions(constraints, tree, &guess, y)
    }

    /// Checks that no joint closed with its axis reversed: its rows do not distinguish an axis from its opposite.
    fn check_axis_directions(
        &self,
        constraints: &mut Constraints,
        tree: &mut Tree,
        guess: &[f64],
        y: &[f64],
    ) -> Result<(), MechanismError> {
        tree.update_kinematics(&self.model, 0.0, y);
        let mut closures = self.model.closures.iter();
        if closures.all(|pair| pair.opening(&tree.motion).turned <= 1.0) {
            return Ok(());
        }
        Err(self.no_closure(constraints, tree, guess, y))
    }

    /// A cut joint: `joint` counts joints with play, then other joints that close loops.
    fn gap(&self, joint: usize, opening: Opening) -> OpenJoint {
        let ball = self.model.joints.get(joint).is_some_and(|joint| !joint.closed.turns());
        OpenJoint { joint: self.joint_names[joint].clone(), ball, opening }
    }

    /// Gaps of the joints that `constraints` closes.
    fn gaps(&self, constraints: &Constraints, motion: &[Kinematics]) -> Vec<OpenJoint> {
        let gap = |&j: &usize| self.gap(j, self.model.opening(j, motion));
        constraints.joints().iter().map(gap).collect()
    }

    /// Checks that no ideal joint opens at the velocities in `y`: redundant constraints, for example by drives, may contradict
    /// one another.
    fn check_opening_rates(&self, tree: &mut Tree, y: &[f64]) -> Result<(), MechanismError> {
        tree.update_kinematics(&self.model, 0.0, y);
        for j in self.model.closed_joints() {
            let rate = self.model.opening_rate(j, &tree.motion);
            let stays_closed = rate.apart.norm() <= MAX_OPENING_RATE && rate.turned <= MAX_OPENING_RATE;
            if !stays_closed {
                let rate = self.gap(j, rate);
                return Err(MechanismError::InconsistentDrives { rate });
            }
        }
        Ok(())
    }

    /// The error for loops that are still open at `y`.
    fn no_closure(&self, constraints: &mut Constraints, tree: &mut Tree, guess: &[f64], y: &[f64]) -> MechanismError {
        const T: f64 = 0.0;
        let model = &self.model;
        let mut projected = y.to_vec();
        constraints.project(model, tree, T, &mut projected);
        let steps = projected.iter().zip(y).zip(&model.scale).take(model.nq);
        let at_rest = steps.map(|((a, b), scale)| (a - b).abs() / scale).all(|moved| moved <= AT_REST);
        tree.update_kinematics(model, T, &projected);
        let mut remaining = Vec::new();
        if at_rest {
            remaining = self.gaps(constraints, &tree.motion);
            remaining.retain(|OpenJoint { opening, .. }| opening.apart.norm() > CLOSED || opening.turned > CLOSED);
        }
        tree.update_kinematics(model, T, guess);
        let given = self.gaps(constraints, &tree.motion);
        let size = |gap: &OpenJoint| gap.opening.apart.norm() + gap.opening.turned * model.length_scale;
        let widest = given.into_iter().max_by(|a, b| size(a).total_cmp(&size(b)));
        let given = widest.unwrap_or_else(|| unreachable!("something did not close"));
        MechanismError::NoClosure { given, remaining }
    }

    /// Rank of the closed joints' rows in the assembled pose `y` and around it; `None` if all are independent.
    fn rank_of_closed_joints(&self, tree: &mut Tree, y: &[f64]) -> Result<Option<usize>, MechanismError> {
        const T: f64 = 0.0;
        let model = &self.model;
        if !model.closes_loops() {
            return Ok(None);
        }
        let mut constraints = Constraints::new(model, &model.ideal_joints);
        factor_at(model, &mut constraints, tree, T, y);
        if constraints.least_joint_pivot() >= DEPENDENT_ROWS {
            return Ok(None);
        }
        constraints.treat_as_dependent(constraints.rows());
        let rank = rank_around(model, &mut constraints, tree, y);
        rank.map(Some).ok_or_else(|| {
            if model.path().is_some() {
                return MechanismError::Singular;
            }
            factor_at(model, &mut constraints, tree, T, y);
            let shared = model.closed_joints().enumerate().filter(|&(k, _)| !constraints.is_unique(k));
            MechanismError::Branching { joints: shared.map(|(_, j)| self.joint_names[j].clone()).collect() }
        })
    }

    /// Whether the force of actuator `i` is unique at the latest evaluation.
    pub(crate) fn is_actuator_unique(&mut self, i: usize) -> bool {
        self.equations.is_actuator_unique(&self.model, &self.gravity, i)
    }
}

/// Rank of `constraints`, treated as dependent, at the assembled state `y`; `None` if it is larger in neighbouring poses, so that
/// the pose is singular.
fn rank_around(model: &Model, constraints: &mut Constraints, tree: &mut Tree, y: &[f64]) -> Option<usize> {
    const T: f64 = 0.0;
    factor_at(model, constraints, tree, T, y);
    let rank = constraints.rank();
    if rank == model.nv {
        return Some(rank);
    }
    // The rows appeared dependent only because of a nearby singular pose.
    if rank == constraints.rows() {
        return None;
    }
    let period = (0.002 * model.shortest_period).min(1e-3);
    let mut neighbours = Vec::new();
    for sign in [1.0, -1.0] {
        if !model.drives.is_empty() {
            neighbours.push((sign * period, y[model.nq..].iter().map(|v| v * sign * period).collect()));
        }
        for direction in 1..=2 {
            factor_at(model, constraints, tree, T, y);
            let mut free: Vec<f64> = (0..model.nv)
                .map(|i| model.scale[model.nq + i] * libm::sin((direction * (2 * i + 1)) as f64))
                .collect();
            constraints.project_accelerations(model, &mut free);
            let sizes = free.iter().zip(&model.scale[model.nq..]);
            let largest = sizes.fold(0.0_f64, |most, (v, scale)| most.max(v.abs() / scale));
            let step: Vec<f64> = free.iter().map(|v| sign * NEIGHBOUR_STEP * v / largest).collect();
            neighbours.push((0.0, step));
        }
    }
    let grows = neighbours.iter().any(|(t, step): &(f64, Vec<f64>)| {
        let mut neighbour = y.to_vec();
        Tree::displace(model, &mut neighbour, step);
        let error = constraints.project(model, tree, T + t, &mut neighbour);
        factor_at(model, constraints, tree, T + t, &neighbour);
        !(error <= CLOSED) || constraints.rank() > rank
    });
    (!grows).then_some(rank)
}

/// Jacobians and J M^-1 J^T at (t, y).
pub(super) fn factor_at(model: &Model, constraints: &mut Constraints, tree: &mut Tree, t: f64, y: &[f64]) {
    tree.update_kinematics(model, t, y);
    constraints.prepare(model, tree, t, &y[..model.nq], &Vec3::zeros());
}

/// Whether closed joints leave no degree of freedom and a singular pose lies between the guess and the assembled state `y`: the
/// determinant of a full set of independent rows then differs in sign.
fn is_other_mode(model: &Model, constraints: &mut Constraints, tree: &mut Tree, guess: &[f64], y: &[f64]) -> bool {
    let mut sign_at = |y: &[f64], rows_in_minor: Option<&[usize]>| {
        factor_at(model, constraints, tree, 0.0, y);
        let rows = rows_in_minor.map_or_else(|| constraints.system().independent(), <[usize]>::to_vec);
        if rows.len() != model.nv {
            return None;
        }
        let place = |row: usize| rows.iter().position(|&independent| independent == row);
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
    Placement { moved: (origin(to) - origin(from)).norm(), turned: kinematics::angle_of(&turn) }
}

/// Places the free output body as in the ideal mechanism at t = 0, close to the assembled pose.
fn place_output_body(model: &Model, ideal: &ClosedMotion, y: &mut [f64]) {
    let body = &model.bodies[model.output_body];
    if let Motion::Free { q, v } = body.motion {
        let to_centroid = -(ideal.rotation * body.origin);
        let position = Vec3::from_fn(|i, _| ideal.position[i].value) + to_centroid;
        let rotation = kinematics::quaternion_of(&ideal.rotation);
        y[q..q + 3].copy_from_slice(position.as_slice());
        y[q + 3..q + 7].copy_from_slice(&[rotation.w, rotation.i, rotation.j, rotation.k]);
        let velocity = Vec3::from_fn(|i, _| ideal.position[i].rate) + ideal.angular_velocity.cross(&to_centroid);
        let v = model.nq + v;
        y[v..v + 3].copy_from_slice(velocity.as_slice());
        y[v + 3..v + 6].copy_from_slice(ideal.angular_velocity.as_slice());
    }
}

/// Turns every hinged body that carries a ball to bring the ball closest to its socket, so that loops close on the branch of the
/// closed form.
fn turn_hinges(model: &Model, motion: &[Kinematics], y: &mut [f64]) {
    for joint in &model.joints {
        let motion_of = |b: usize| model.bodies.get(b).map(|body| body.motion);
        let Some(Motion::Revolute { q, .. }) = motion_of(joint.carried.body) else {
            continue;
        };
        let body = &motion[joint.carried.body];
        let hinge = body.position - body.arm;
        let centre = |a: &model::Anchor| motion[a.body].position + motion[a.body].rotation * a.offset - hinge;
        let (ball, socket, axis) = (centre(&joint.carried), centre(&joint.carrier), body.axis);
        let sine = axis.dot(&ball.cross(&socket));
        let cosine = ball.dot(&socket) - axis.dot(&ball) * axis.dot(&socket);
        y[q] += libm::atan2(sine, cosine);
    }
}
