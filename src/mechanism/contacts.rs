//! Ball joints with clearance: gaps and contact forces from the motion of the bodies. Allocates nothing.

use super::kinematics::{Kinematics, Wrench};
use super::model::{BallJoint, Model};
use crate::contact::{Coefficients, Pace, Parameters, Slip};
use crate::scene::{Scene, Vec3};

/// What a contact remembers between steps: part of the state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Memory {
    /// In contact.
    pub active: bool,
    /// What the damping term divides by: delta_dot0 of this contact, or its largest rate so far, not below the scene's floor,
    /// m/s; 0 while free.
    pub approach_speed: f64,
    /// The floor was used: this contact rebounds higher than asked.
    pub floored: bool,
    /// Piece of the friction law in force.
    pub slip: Slip,
    /// Piece of the rule for the approach speed in force.
    pub pace: Pace,
}

impl Memory {
    /// What the damping term divides by where the penetration grows at `rate`, m/s. Until a contact has a memory it is the
    /// rate itself.
    #[inline]
    pub fn approach(&self, c: &Coefficients, rate: f64) -> f64 {
        if self.active {
            c.approach(self.pace, self.approach_speed, rate)
        } else {
            rate.max(c.speed_floor)
        }
    }
}

/// A clearance on its way to a new value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ramp {
    /// Time at which it started, s.
    pub start: f64,
    /// Clearance there, m.
    pub from: f64,
    /// Signed rate, m/s.
    pub rate: f64,
    /// Where it ends, m.
    pub to: f64,
}

impl Ramp {
    /// Clearance and its rate at `t`.
    pub fn at(&self, t: f64) -> (f64, f64) {
        let value = self.from + self.rate * (t - self.start);
        if (self.rate < 0.0) == (value <= self.to) {
            (self.to, 0.0)
        } else {
            (value, self.rate)
        }
    }
}

/// How a contact force switches on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Switching {
    /// The memory decides; the stepper locates the instants at which it changes.
    Located,
    /// Penetration decides at every evaluation: for steppers that locate nothing.
    Immediate,
}

/// One ball joint at the latest evaluation.
#[derive(Clone, Copy, Debug, Default)]
pub struct Gap {
    /// e = Z_j - Z_i, m (5).
    pub eccentricity: Vec3,
    /// de/dt, m/s.
    pub eccentricity_rate: Vec3,
    /// n = e / |e| (8); zero where e is.
    pub normal: Vec3,
    /// delta, m (10).
    pub penetration: f64,
    /// d(delta)/dt, m/s.
    pub rate: f64,
    /// F_N, N (19).
    pub normal_force: f64,
    /// F_T on the ball, N (20).
    pub friction: Vec3,
    /// |v_t| that friction reads, m/s.
    pub slip_speed: f64,
}

struct Joint {
    joint: BallJoint,
    coefficients: Coefficients,
    clearance: f64,
}

/// All ball joints of a scene.
pub struct Contacts {
    joints: Vec<Joint>,
    parameters: Vec<Parameters>,
    ramps: Vec<Option<Ramp>>,
    memory: Vec<Memory>,
    gaps: Vec<Gap>,
    /// How contact forces switch on.
    pub switching: Switching,
    /// Contact evaluations so far: a scene without clearance makes none.
    pub evaluations: u64,
    /// Evaluations of friction so far, for whatever purpose: a scene without friction makes none.
    pub friction_evaluations: u64,
    any_ramp: bool,
    any_contact: bool,
    /// Contacts carry no force: for [`crate::integrate::ContactSystem::derivative_apart`].
    pub apart: bool,
    /// A sliding speed or a penetration rate may have been beyond its piece of the law since this was last cleared.
    pub strayed: bool,
    /// Of the latest evaluation, s.
    time: f64,
}

impl Contacts {
    /// Contacts of `scene`, all free.
    pub fn new(scene: &Scene, model: &Model) -> Self {
        let parameters: Vec<Parameters> = scene.ball_joints.iter().map(|j| j.contact).collect();
        let joints: Vec<Joint> = model
            .joints
            .iter()
            .zip(&parameters)
            .map(|(&joint, p)| Joint {
                joint,
                coefficients: Coefficients::new(p, p.clearance),
                clearance: p.clearance,
            })
            .collect();
        let n = joints.len();
        Self {
            any_contact: joints.iter().any(|j| j.joint.ideal.is_none()),
            joints,
            parameters,
            ramps: vec![None; n],
            memory: vec![Memory::default(); n],
            gaps: vec![Gap::default(); n],
            switching: Switching::Located,
            evaluations: 0,
            friction_evaluations: 0,
            any_ramp: false,
            apart: false,
            strayed: false,
            time: 0.0,
        }
    }

    /// Number of ball joints, ideal ones included.
    pub fn len(&self) -> usize {
        self.joints.len()
    }

    /// Whether there is no ball joint.
    pub fn is_empty(&self) -> bool {
        self.joints.is_empty()
    }

    /// Whether joint `i` has a clearance.
    pub fn has_clearance(&self, i: usize) -> bool {
        self.joints[i].joint.ideal.is_none()
    }

    /// Results of the latest evaluation.
    pub fn gaps(&self) -> &[Gap] {
        &self.gaps
    }

    /// Contact memory.
    pub fn memory(&self) -> &[Memory] {
        &self.memory
    }

    /// Contact memory, to change.
    pub fn memory_mut(&mut self) -> &mut [Memory] {
        &mut self.memory
    }

    /// Coefficients of joint `i`.
    pub fn coefficients(&self, i: usize) -> &Coefficients {
        &self.joints[i].coefficients
    }

    /// Clearance of joint `i` in force at the latest evaluation, m.
    pub fn clearance(&self, i: usize) -> f64 {
        self.joints[i].clearance
    }

    /// Clearances under way.
    pub fn ramps(&self) -> &[Option<Ramp>] {
        &self.ramps
    }

    /// Starts, ends or restores the ramp of joint `i`.
    pub fn set_ramp(&mut self, i: usize, ramp: Option<Ramp>) {
        self.ramps[i] = ramp;
        self.any_ramp = self.ramps.iter().any(Option::is_some);
    }

    /// New parameters for joint `i` from now on; `clearance` is the one in force now.
    pub fn set_parameters(&mut self, i: usize, parameters: &Parameters, clearance: f64) {
        self.parameters[i] = *parameters;
        self.joints[i].clearance = clearance;
        self.joints[i].coefficients = Coefficients::new(parameters, clearance);
    }

    /// Moves clearances under way to `t`.
    #[inline]
    fn update_ramps(&mut self, t: f64) {
        if !self.any_ramp {
            return;
        }
        for i in 0..self.joints.len() {
            if let Some(ramp) = self.ramps[i] {
                let clearance = ramp.at(t).0;
                self.joints[i].clearance = clearance;
                self.joints[i].coefficients.stiffness =
                    crate::contact::hertz_stiffness(&self.parameters[i], clearance);
            }
        }
    }

    /// Rate of the clearance of joint `i` at the latest evaluation, m/s.
    pub fn clearance_rate(&self, i: usize) -> f64 {
        self.clearance_rate_at(i, self.time)
    }

    #[inline]
    fn clearance_rate_at(&self, i: usize, t: f64) -> f64 {
        if self.any_ramp {
            self.ramps[i].map_or(0.0, |r| r.at(t).1)
        } else {
            0.0
        }
    }

    /// Gaps and forces at `t`; forces are added to `wrench` (about each body's centroid).
    pub fn evaluate(&mut self, t: f64, motion: &[Kinematics], wrench: &mut [Wrench]) {
        if !self.any_contact || self.apart {
            return;
        }
        self.update_ramps(t);
        self.time = t;
        self.evaluations += 1;
        for i in 0..self.joints.len() {
            let Joint {
                joint,
                coefficients,
                clearance,
            } = &self.joints[i];
            if joint.ideal.is_some() {
                continue;
            }
            let (ball, socket) = (&motion[joint.ball.body], &motion[joint.socket.body]);
            let arm_ball = ball.rotation * joint.ball.offset;
            let arm_socket = socket.rotation * joint.socket.offset;
            let centre_velocity = (ball.velocity + ball.angular_velocity.cross(&arm_ball))
                - (socket.velocity + socket.angular_velocity.cross(&arm_socket));
            let e = (ball.position + arm_ball) - (socket.position + arm_socket);
            let gap = &mut self.gaps[i];
            gap.eccentricity = e;
            gap.eccentricity_rate = centre_velocity;
            gap.normal_force = 0.0;
            gap.friction = Vec3::zeros();
            gap.slip_speed = 0.0;
            let square = e.norm_squared();
            let memory = &self.memory[i];
            let touches = match self.switching {
                Switching::Located => memory.active,
                Switching::Immediate => square > clearance * clearance,
            };
            if !touches || square <= clearance * clearance {
                continue;
            }
            let distance = square.sqrt();
            let n = e / distance;
            let rate = n.dot(&centre_velocity)
                - if self.any_ramp {
                    self.ramps[i].map_or(0.0, |r| r.at(t).1)
                } else {
                    0.0
                };
            let penetration = distance - clearance;
            let approach = memory.approach(coefficients, rate);
            // A rising rate may pass its largest value in any step.
            if memory.pace == Pace::Rising
                || (memory.pace == Pace::Held && rate > memory.approach_speed)
            {
                self.strayed = true;
            }
            let normal_force = coefficients.normal_force(penetration, rate, approach);
            gap.normal_force = normal_force;
            if normal_force == 0.0 {
                continue;
            }
            let mut force = n * -normal_force;
            let to_surface = n * coefficients.ball_radius;
            let socket_radius = coefficients.ball_radius + clearance;
            if coefficients.friction > 0.0 {
                self.friction_evaluations += 1;
                let relative = if coefficients.surface {
                    centre_velocity + ball.angular_velocity.cross(&to_surface)
                        - socket.angular_velocity.cross(&(n * socket_radius))
                } else {
                    centre_velocity
                };
                let slip = relative - n * n.dot(&relative);
                let speed = slip.norm();
                gap.slip_speed = speed;
                if memory.slip != Slip::Whole && coefficients.beyond(memory.slip, speed) > 0.0 {
                    self.strayed = true;
                }
                let per_speed = coefficients.friction_per_speed(memory.slip, speed);
                if per_speed != 0.0 {
                    let friction = slip * (-per_speed * normal_force);
                    gap.friction = friction;
                    force += friction;
                }
            }
            let on_ball = &mut wrench[joint.ball.body];
            on_ball.force += force;
            on_ball.torque += (arm_ball + to_surface).cross(&force);
            let on_socket = &mut wrench[joint.socket.body];
            on_socket.force -= force;
            on_socket.torque -= (arm_socket + n * socket_radius).cross(&force);
        }
    }

    /// Gap geometry alone (no force) at `t`: eccentricity, its rate, normal, penetration and its rate.
    pub fn measure(&mut self, t: f64, motion: &[Kinematics]) {
        self.update_ramps(t);
        self.time = t;
        for i in 0..self.joints.len() {
            let joint = &self.joints[i].joint;
            let (ball, socket) = (&motion[joint.ball.body], &motion[joint.socket.body]);
            let arm_ball = ball.rotation * joint.ball.offset;
            let arm_socket = socket.rotation * joint.socket.offset;
            let gap = &mut self.gaps[i];
            gap.eccentricity = (ball.position + arm_ball) - (socket.position + arm_socket);
            gap.eccentricity_rate = (ball.velocity + ball.angular_velocity.cross(&arm_ball))
                - (socket.velocity + socket.angular_velocity.cross(&arm_socket));
        }
        self.finish(t);
    }

    /// Sliding speed of joint `i` in the motion last measured, m/s.
    pub fn slip_speed(&self, i: usize, motion: &[Kinematics]) -> f64 {
        let Joint {
            joint,
            coefficients,
            clearance,
        } = &self.joints[i];
        let gap = &self.gaps[i];
        let n = gap.normal;
        let mut relative = gap.eccentricity_rate;
        if coefficients.surface {
            let radius = coefficients.ball_radius;
            relative += motion[joint.ball.body]
                .angular_velocity
                .cross(&(n * radius))
                - motion[joint.socket.body]
                    .angular_velocity
                    .cross(&(n * (radius + clearance)));
        }
        (relative - n * n.dot(&relative)).norm()
    }

    /// Completes normal, penetration and rate of every gap from the eccentricities of the latest evaluation.
    pub fn finish(&mut self, t: f64) {
        for i in 0..self.joints.len() {
            let clearance_rate = self.clearance_rate_at(i, t);
            let ideal = self.joints[i].joint.ideal.is_some();
            let clearance = self.joints[i].clearance;
            let gap = &mut self.gaps[i];
            let distance = gap.eccentricity.norm();
            gap.normal = if distance > 0.0 {
                gap.eccentricity / distance
            } else {
                Vec3::zeros()
            };
            if ideal {
                (gap.penetration, gap.rate) = (0.0, 0.0);
            } else {
                gap.penetration = distance - clearance;
                // A ball at rest at the centre leaves it in the direction in which it moves.
                let opening = if distance > 0.0 {
                    gap.normal.dot(&gap.eccentricity_rate)
                } else {
                    gap.eccentricity_rate.norm()
                };
                gap.rate = opening - clearance_rate;
            }
        }
    }
}
