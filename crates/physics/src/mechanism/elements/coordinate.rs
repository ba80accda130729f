//! Coordinate of a joint, from the motion of the two bodies it connects, and a force along it, in every formulation: a force on
//! the child and its opposite on the parent at the same point, or a pair of torques. The axes of a universal joint are
//! perpendicular, so that a torque about one does no work on the other.

use std::f64::consts::TAU;

use super::{At, Coupling, Edges, ElementReport, ForceElement, Loads, Powers, TorqueDerivatives, push};
use crate::jet::Jet;
use crate::machine::{Freedom, JointCoordinate, Machine, Mat3, Vec3};
use crate::mechanism::kinematics::{Kinematics, Wrench};
use crate::mechanism::model::{Anchor, Model};

/// A force or torque on the child along a coordinate, by the deviation of the coordinate from a target, m or rad, and its rate.
pub(super) trait CoordinateLaw: Send + Sync {
    /// The target at `t`, s.
    fn target(&self, t: f64) -> Jet;

    /// The force, N or N m.
    fn force(&self, deviation: [f64; 2]) -> f64;

    /// Its derivatives; `None` where it is constant.
    fn slopes(&self, deviation: [f64; 2]) -> Option<Slopes>;

    /// Whether it ever depends on the deviation.
    fn is_stiff(&self) -> bool {
        true
    }

    /// Stored energy, J.
    fn stored(&self, _deviation: f64) -> f64 {
        0.0
    }

    /// As [`ForceElement::work`].
    fn work(&self, _from: [f64; 2], _to: [f64; 2]) -> f64 {
        0.0
    }

    /// Adds its powers; `rate` is that of the coordinate itself.
    fn add_powers(&self, deviation: [f64; 2], rate: f64, powers: &mut Powers);

    /// As [`ForceElement::edges`].
    fn edges(&self, _deviation: impl FnOnce() -> [f64; 2]) -> Edges {
        Edges::default()
    }

    /// As [`ForceElement::freeze`].
    fn freeze(&mut self, _sides: Edges) {}

    /// As [`ElementReport::depth`].
    fn depth(&self, _deviation: f64) -> Option<[f64; 2]> {
        None
    }
}

/// The element with a law on a coordinate.
pub(super) struct OnCoordinate<L> {
    pub on: Coordinate,
    pub law: L,
}

/// A displacement along an axis or an angle about it.
#[derive(Clone, Copy)]
pub(super) struct Coordinate {
    parent: Anchor,
    child: Anchor,
    turns: bool,
    /// Axis, in the axes of the parent or, if `in_child`, of the child.
    axis: Vec3,
    in_child: bool,
    /// For an angle: a direction perpendicular to the axis, in the parent's axes, and the direction in the child's axes that
    /// coincides with it at coordinate 0.
    across: Vec3,
    child_across: Vec3,
    /// For an angle: determines its whole turns.
    reference: AngleReference,
}

/// Angle of a joint at one instant. Poses determine angles up to whole turns; the turns at instants nearby follow from it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AngleReference {
    /// s.
    pub time: f64,
    /// rad; the nearest quarter turn suffices.
    pub angle: f64,
}

impl AngleReference {
    /// What to add to `angle`, which is known up to whole turns, rad, at `t`, s, where it changes at `rate`, rad/s. The angle is
    /// taken as the nearest to that of a constant rate, so that steps may span several turns.
    pub fn whole_turns(&self, angle: f64, rate: f64, t: f64) -> f64 {
        TAU * libm::round((self.angle + rate * (t - self.time) - angle) / TAU)
    }
}

/// A coordinate at one instant.
struct State {
    /// Coordinate relative to the target, m or rad, and the rate of that.
    deviation: [f64; 2],
    /// Rate of the coordinate, m/s or rad/s.
    rate: f64,
    /// Axis, world.
    along: Vec3,
    /// Joint point of the child, world, m, and its arms from the centroids of parent and child.
    point: Vec3,
    arms: [Vec3; 2],
}

/// Derivatives of a force along a coordinate with respect to the coordinate and its rate.
pub(super) struct Slopes {
    pub by_position: f64,
    pub by_rate: f64,
}

impl Coordinate {
    /// The coordinate `on` of `machine`.
    pub fn of(machine: &Machine, model: &Model, on: JointCoordinate) -> Self {
        let freedom = on.freedom;
        let joint = machine.kinematic_joints().nth(on.joint).expect("an element acts on a joint of its machine");
        let [parent, child] = joint.points().map(|point| model.anchor(machine, &point));
        let (axis, second, rest) = (joint.axis, joint.child_axis, joint.rotation);
        let [across, child_across] = match freedom {
            Freedom::FirstTurn => [rest * second, second],
            Freedom::SecondTurn => [axis, rest.inverse() * axis],
            Freedom::Slide | Freedom::Turn | Freedom::TurnOfSlide => {
                let least = axis.iamin();
                let across = axis.cross(&Vec3::ith(least, 1.0)).normalize();
                [across, rest.inverse() * across]
            }
        };
        let in_child = freedom == Freedom::SecondTurn;
        Self {
            parent,
            child,
            turns: freedom.turns(),
            axis: if in_child { second } else { axis },
            in_child,
            across,
            child_across,
            reference: AngleReference::default(),
        }
    }

    /// The coordinate at `t`, s, relative to `target`.
    fn measure(&self, target: &Jet, t: f64, motion: &[Kinematics]) -> State {
        let (parent, child) = (&motion[self.parent.body], &motion[self.child.body]);
        let of_axis = if self.in_child { child } else { parent };
        let along = of_axis.rotation * self.axis;
        let arm = child.rotation * self.child.offset;
        let point = child.position + arm;
        let from_parent = point - parent.position;
        let (deviation, rate) = if self.turns {
            let (zero, now) = (parent.rotation * self.across, child.rotation * self.child_across);
            let angle = libm::atan2(zero.cross(&now).dot(&along), zero.dot(&now));
            let rate = along.dot(&(child.angular_velocity - parent.angular_velocity));
            (angle - target.value + self.reference.whole_turns(angle, rate, t), rate)
        } else {
            let slid = from_parent - parent.rotation * self.parent.offset;
            let velocity = child.point_velocity(&arm) - parent.point_velocity(&from_parent);
            (along.dot(&slid) - target.value, along.dot(&velocity))
        };
        State { deviation: [deviation, rate - target.rate], rate, along, point, arms: [from_parent, arm] }
    }

    /// Adds `force` (N or N m) along the axis to the child, and its opposite to the parent.
    fn apply_force(&self, state: &State, force: f64, wrench: &mut [Wrench]) {
        let force = state.along * force;
        let [from_parent, arm] = &state.arms;
        if self.turns {
            wrench[self.child.body].torque += force;
            wrench[self.parent.body].torque -= force;
        } else {
            push(&mut wrench[self.child.body], arm, &force);
            push(&mut wrench[self.parent.body], from_parent, &-force);
        }
    }

    /// The child's joint point as a point of the parent and as a point of the child: their relative motion is the joint's.
    fn ends(&self, motion: &[Kinematics]) -> [Anchor; 2] {
        let (parent, child) = (&motion[self.parent.body], &motion[self.child.body]);
        let point = child.position + child.rotation * self.child.offset;
        let parent = Anchor { body: self.parent.body, offset: parent.rotation.tr_mul(&(point - parent.position)) };
        [parent, self.child]
    }

    /// Linearisation of a force along the axis.
    fn coupling(&self, state: &State, slopes: &Slopes, motion: &[Kinematics]) -> Coupling {
        let along = state.along * state.along.transpose();
        let (stiffness, damping) = (along * slopes.by_position, along * slopes.by_rate);
        let ends = self.ends(motion);
        if self.turns {
            let torque_derivatives =
                TorqueDerivatives { by_rotation: stiffness, by_angular_velocity: damping, mixed: None };
            return Coupling::at_one_point(ends, [Mat3::zeros(); 2], torque_derivatives);
        }
        Coupling::at_one_point(ends, [stiffness, damping], TorqueDerivatives::default())
    }

    /// Report of a force along the axis.
    fn report(&self, state: &State, force: f64, motion: &[Kinematics]) -> ElementReport {
        let force = state.along * force;
        if self.turns {
            return ElementReport {
                points: [state.point; 2],
                torque: Some(force),
                is_pure_torque: true,
                ..ElementReport::default()
            };
        }
        let parent = &motion[self.parent.body];
        ElementReport {
            points: [parent.position + parent.rotation * self.parent.offset, state.point],
            force,
            ..ElementReport::default()
        }
    }
}

impl<L: CoordinateLaw> OnCoordinate<L> {
    fn state(&self, t: f64, motion: &[Kinematics]) -> State {
        self.on.measure(&self.law.target(t), t, motion)
    }
}

impl<L: CoordinateLaw> ForceElement for OnCoordinate<L> {
    fn load(&mut self, at: &At<'_>, loads: &mut Loads<'_>) {
        let state = self.state(at.t, at.motion);
        let force = self.law.force(state.deviation);
        if force != 0.0 {
            self.on.apply_force(&state, force, loads.wrench);
        }
    }

    fn ends(&self, motion: &[Kinematics]) -> Option<[Anchor; 2]> {
        self.law.is_stiff().then(|| self.on.ends(motion))
    }

    fn coupling(&self, at: &At<'_>) -> Option<Coupling> {
        let state = self.state(at.t, at.motion);
        Some(self.on.coupling(&state, &self.law.slopes(state.deviation)?, at.motion))
    }

    fn stored(&self, t: f64, motion: &[Kinematics]) -> f64 {
        self.law.stored(self.state(t, motion).deviation[0])
    }

    fn work(&self, t: f64, poses: [&[Kinematics]; 2]) -> f64 {
        let [from, to] = poses.map(|motion| self.state(t, motion).deviation);
        self.law.work(from, to)
    }

    fn add_powers(&self, t: f64, motion: &[Kinematics], powers: &mut Powers) {
        let state = self.state(t, motion);
        self.law.add_powers(state.deviation, state.rate, powers);
    }

    fn edges(&self, t: f64, motion: &[Kinematics]) -> Edges {
        self.law.edges(|| self.state(t, motion).deviation)
    }

    fn freeze(&mut self, sides: Edges) {
        self.law.freeze(sides);
    }

    fn set_angle_reference(&mut self, reference: AngleReference) {
        self.on.reference = reference;
    }

    fn report(&self, t: f64, motion: &[Kinematics]) -> ElementReport {
        let state = self.state(t, motion);
        let depth = self.law.depth(state.deviation[0]);
        ElementReport { depth, ..self.on.report(&state, self.law.force(state.deviation), motion) }
    }
}
