//! Ball joints with clearance: gaps and contact forces from the motion of the bodies. Allocates nothing.

use super::kinematics::{Kinematics, Wrench};
use super::model::{BallJoint, Model};
use crate::contact::{Coefficients, Force, Memory, Parameters, Separation, Slope, Stiffness};
use crate::scene::{Scene, Vec3};

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

/// What decides which contacts carry a force.
#[derive(Clone, Copy, Debug)]
pub enum Touching<'a> {
    /// The memory: the stepper locates the instants at which it changes.
    Located(&'a [Memory]),
    /// Penetration at every evaluation: for steppers that locate nothing.
    Immediate(&'a [Memory]),
    /// None does.
    Nothing,
}

impl<'a> Touching<'a> {
    /// As `memory` says where instants are `located`, by penetration elsewhere.
    pub fn by(located: bool, memory: &'a [Memory]) -> Self {
        if located {
            Self::Located(memory)
        } else {
            Self::Immediate(memory)
        }
    }

    /// Memory of joint `j` where it may carry a force.
    #[inline]
    pub(super) fn memory(self, j: usize) -> Option<&'a Memory> {
        match self {
            Self::Located(memory) => Some(&memory[j]).filter(|memory| memory.active),
            Self::Immediate(memory) => Some(&memory[j]),
            Self::Nothing => None,
        }
    }
}

/// Evaluations made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Of the equations of motion.
    pub equations: u64,
    /// Of all contacts at an instant: a scene without clearance makes none.
    pub contacts: u64,
    /// Of the friction of one contact: a scene without friction makes none.
    pub friction: u64,
}

impl std::ops::AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        self.equations += other.equations;
        self.contacts += other.contacts;
        self.friction += other.friction;
    }
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

impl Gap {
    /// Contact force on the ball where its normal is `n`, N.
    pub fn force_on_ball(&self, n: &Vec3) -> Vec3 {
        n * -self.normal_force + self.friction
    }
}

struct Joint {
    joint: BallJoint,
    coefficients: Coefficients,
}

/// All ball joints of a scene.
pub struct Contacts {
    joints: Vec<Joint>,
    parameters: Vec<Parameters>,
    ramps: Vec<Option<Ramp>>,
    gaps: Vec<Gap>,
    any_ramp: bool,
    any_contact: bool,
}

impl Contacts {
    /// Contacts of `scene`.
    pub fn new(scene: &Scene, model: &Model) -> Self {
        let parameters: Vec<Parameters> = scene.ball_joints.iter().map(|j| j.contact).collect();
        let joints: Vec<Joint> = model
            .joints
            .iter()
            .zip(&parameters)
            .map(|(&joint, p)| Joint {
                joint,
                coefficients: Coefficients::new(p, p.clearance),
            })
            .collect();
        let n = joints.len();
        Self {
            any_contact: joints.iter().any(|j| j.joint.ideal.is_none()),
            joints,
            parameters,
            ramps: vec![None; n],
            gaps: vec![Gap::default(); n],
            any_ramp: false,
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

    /// Coefficients of joint `i`.
    pub fn coefficients(&self, i: usize) -> &Coefficients {
        &self.joints[i].coefficients
    }

    /// Clearance of joint `i` in force at the latest evaluation, m.
    pub fn clearance(&self, i: usize) -> f64 {
        self.joints[i].coefficients.clearance
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
                let (clearance, rate) = ramp.at(t);
                self.joints[i]
                    .coefficients
                    .move_clearance(&self.parameters[i], clearance, rate);
            }
        }
    }

    /// Gaps and forces at `t`; forces are added to `wrench` (about each body's centroid). Whether a sliding speed or a
    /// penetration rate was beyond the piece of its law that the memory holds.
    pub fn evaluate(
        &mut self,
        t: f64,
        motion: &[Kinematics],
        wrench: &mut [Wrench],
        touching: Touching<'_>,
        counts: &mut Counts,
    ) -> bool {
        if !self.any_contact || matches!(touching, Touching::Nothing) {
            return false;
        }
        self.update_ramps(t);
        counts.contacts += 1;
        let mut leaves_piece = false;
        for (
            i,
            Joint {
                joint,
                coefficients,
            },
        ) in self.joints.iter().enumerate()
        {
            if joint.ideal.is_some() {
                continue;
            }
            let (ball, socket) = (&motion[joint.ball.body], &motion[joint.socket.body]);
            let arm_ball = ball.rotation * joint.ball.offset;
            let arm_socket = socket.rotation * joint.socket.offset;
            let velocity = ball.point_velocity(&arm_ball) - socket.point_velocity(&arm_socket);
            let e = (ball.position + arm_ball) - (socket.position + arm_socket);
            let gap = &mut self.gaps[i];
            *gap = Gap {
                eccentricity: e,
                eccentricity_rate: velocity,
                ..Gap::default()
            };
            let clearance = coefficients.clearance;
            let Some(memory) = touching.memory(i) else {
                continue;
            };
            if e.norm_squared() <= clearance * clearance {
                continue;
            }
            let at = coefficients.separation(&e, &velocity);
            let force = coefficients.force(memory, &at, || {
                counts.friction += 1;
                let (ball, socket) = (&ball.angular_velocity, &socket.angular_velocity);
                coefficients.friction_reads(&at.normal, &velocity, ball, socket)
            });
            leaves_piece |= coefficients.leaves_piece(memory, &at, &force);
            gap.normal_force = force.normal;
            gap.friction = force.friction;
            gap.slip_speed = force.slip_speed;
            if force.normal == 0.0 {
                continue;
            }
            let on_ball = at.normal * -force.normal + force.friction;
            let radius = coefficients.ball_radius;
            let ball = &mut wrench[joint.ball.body];
            ball.force += on_ball;
            ball.torque += (arm_ball + at.normal * radius).cross(&on_ball);
            let socket = &mut wrench[joint.socket.body];
            socket.force -= on_ball;
            socket.torque -= (arm_socket + at.normal * (radius + clearance)).cross(&on_ball);
        }
        leaves_piece
    }

    /// Gap geometry alone (no force) at `t`: eccentricity, its rate, normal, penetration and its rate.
    pub fn measure(&mut self, t: f64, motion: &[Kinematics]) {
        self.update_ramps(t);
        for (Joint { joint, .. }, gap) in self.joints.iter().zip(&mut self.gaps) {
            gap.eccentricity = joint.eccentricity(motion);
            gap.eccentricity_rate = joint.opening_rate(motion);
        }
        self.finish();
    }

    /// Where the ball of joint `i`, off the centre, was at the latest evaluation.
    #[inline]
    pub fn separation(&self, i: usize) -> Separation {
        let gap = &self.gaps[i];
        let c = &self.joints[i].coefficients;
        c.separation(&gap.eccentricity, &gap.eccentricity_rate)
    }

    /// Relative velocity that friction reads at the contact of joint `i` with the normal `n`, m/s.
    pub fn friction_reads(&self, i: usize, n: &Vec3, motion: &[Kinematics]) -> Vec3 {
        let Joint {
            joint,
            coefficients,
        } = &self.joints[i];
        let spin = |body: usize| &motion[body].angular_velocity;
        let (ball, socket) = (spin(joint.ball.body), spin(joint.socket.body));
        coefficients.friction_reads(n, &self.gaps[i].eccentricity_rate, ball, socket)
    }

    /// Sliding speed of joint `i`, off the centre, in the motion last measured, m/s.
    pub fn slip_speed(&self, i: usize, motion: &[Kinematics]) -> f64 {
        let at = self.separation(i);
        let read = self.friction_reads(i, &at.normal, motion);
        self.joints[i].coefficients.sliding(&at, &read).norm()
    }

    /// Derivatives of the force of joint `i` at the latest evaluation; `None` where it carries none.
    pub fn linearise(
        &self,
        i: usize,
        motion: &[Kinematics],
        touching: Touching<'_>,
    ) -> Option<Stiffness> {
        let gap = &self.gaps[i];
        let memory = touching.memory(i).filter(|_| gap.normal_force > 0.0)?;
        let at = self.separation(i);
        let read = self.friction_reads(i, &at.normal, motion);
        let force = Force {
            normal: gap.normal_force,
            friction: gap.friction,
            slip_speed: gap.slip_speed,
        };
        let c = &self.joints[i].coefficients;
        Some(c.linearise(
            memory,
            &at,
            &gap.eccentricity_rate,
            &read,
            &force,
            Slope::Tangent,
        ))
    }

    /// Completes normal, penetration and rate of every gap from the eccentricities of the latest evaluation.
    pub fn finish(&mut self) {
        for (
            Joint {
                joint,
                coefficients,
            },
            gap,
        ) in self.joints.iter().zip(&mut self.gaps)
        {
            let distance = gap.eccentricity.norm();
            gap.normal = if distance > 0.0 {
                gap.eccentricity / distance
            } else {
                Vec3::zeros()
            };
            if joint.ideal.is_some() {
                (gap.penetration, gap.rate) = (0.0, 0.0);
            } else {
                gap.penetration = distance - coefficients.clearance;
                // A ball at rest at the centre leaves it in the direction in which it moves.
                let opening = if distance > 0.0 {
                    gap.normal.dot(&gap.eccentricity_rate)
                } else {
                    gap.eccentricity_rate.norm()
                };
                gap.rate = opening - coefficients.clearance_rate;
            }
        }
    }
}
