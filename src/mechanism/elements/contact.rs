//! Ball joint with clearance: contact between a ball and the wall of its socket, by the laws in `contact`.

use super::{At, Coupling, ForceElement, Loads};
use crate::contact::{Coefficients, Force, Separation, Slope};
use crate::mechanism::columns::contact_sides;
use crate::mechanism::kinematics::Kinematics;
use crate::mechanism::model::{Anchor, BallJoint};
use crate::mechanism::{Powers, Touch};
use crate::scene::Vec3;

/// One ball joint at the latest evaluation.
#[derive(Clone, Copy, Debug, Default)]
pub struct Gap {
    /// e = Z_j - Z_i, m (5).
    pub eccentricity: Vec3,
    /// de/dt, m/s.
    pub eccentricity_rate: Vec3,
    /// n = e / |e| (8); zero if e is.
    pub normal: Vec3,
    /// delta, m (10).
    pub penetration: f64,
    /// d(delta)/dt, m/s.
    pub rate: f64,
    /// F_N, N (19).
    pub normal_force: f64,
    /// F_T on the ball, N (20).
    pub friction: Vec3,
    /// |v_t| used by friction, m/s.
    pub slip_speed: f64,
}

/// A ball joint; a force element if it has clearance.
pub struct Contact {
    /// Its index among the ball joints, and so that of its memory.
    index: usize,
    pub joint: BallJoint,
    pub law: Coefficients,
    pub gap: Gap,
}

impl Contact {
    pub fn new(index: usize, joint: BallJoint, law: Coefficients) -> Self {
        Self {
            index,
            joint,
            law,
            gap: Gap::default(),
        }
    }

    /// Whether it has clearance.
    #[inline]
    pub fn is_loose(&self) -> bool {
        self.joint.ideal.is_none()
    }

    /// Separation at the latest evaluation, for a ball that is off centre.
    #[inline]
    pub fn separation(&self) -> Separation {
        let gap = &self.gap;
        self.law
            .separation(&gap.eccentricity, &gap.eccentricity_rate)
    }

    /// Power dissipated by friction for the contact normal `n`, W.
    fn friction_power(&self, n: &Vec3, motion: &[Kinematics]) -> f64 {
        let (gap, law) = (&self.gap, &self.law);
        if gap.friction == Vec3::zeros() {
            return 0.0;
        }
        let [ball, socket] = self.spins(motion);
        let surfaces = law.surface_velocity(n, &gap.eccentricity_rate, ball, socket);
        -gap.friction.dot(&surfaces)
    }

    /// Contact of the ball with its socket wall at the latest evaluation; `None` if it does not press on it.
    pub fn touch(&self, motion: &[Kinematics]) -> Option<Touch> {
        if !self.is_loose() || self.gap.normal_force <= 0.0 {
            return None;
        }
        Some(Touch {
            direction: self.wall_direction(motion),
            normal_force: self.gap.normal_force,
            friction_power: self.friction_power(&self.separation().normal, motion),
        })
    }

    /// Unit vector from the socket centre to the ball centre, which must differ from it, at the latest evaluation, in the axes
    /// of the socket's body: towards the point of the wall nearest to the ball.
    pub fn wall_direction(&self, motion: &[Kinematics]) -> Vec3 {
        let socket = &motion[self.joint.socket.body];
        socket.rotation.tr_mul(&self.separation().normal)
    }

    /// Angular velocities of ball and socket, rad/s.
    #[inline]
    fn spins<'a>(&self, motion: &'a [Kinematics]) -> [&'a Vec3; 2] {
        [self.joint.ball.body, self.joint.socket.body].map(|body| &motion[body].angular_velocity)
    }

    /// Relative velocity used by friction for the normal `n`, m/s.
    #[inline]
    pub fn friction_reads(&self, n: &Vec3, motion: &[Kinematics]) -> Vec3 {
        let [ball, socket] = self.spins(motion);
        self.law
            .friction_reads(n, &self.gap.eccentricity_rate, ball, socket)
    }

    /// Gap geometry of bodies in `motion`.
    pub fn measure(&mut self, motion: &[Kinematics]) {
        self.gap.eccentricity = self.joint.eccentricity(motion);
        self.gap.eccentricity_rate = self.joint.opening_rate(motion);
        self.finish();
    }

    /// Completes normal, penetration and rate from the eccentricity of the latest evaluation.
    pub fn finish(&mut self) {
        let loose = self.is_loose();
        let Self { law, gap, .. } = self;
        let distance = gap.eccentricity.norm();
        gap.normal = if distance > 0.0 {
            gap.eccentricity / distance
        } else {
            Vec3::zeros()
        };
        if !loose {
            (gap.penetration, gap.rate) = (0.0, 0.0);
            return;
        }
        gap.penetration = distance - law.clearance;
        // A ball exactly at the centre leaves it in its direction of motion.
        let opening = if distance > 0.0 {
            gap.normal.dot(&gap.eccentricity_rate)
        } else {
            gap.eccentricity_rate.norm()
        };
        gap.rate = opening - law.clearance_rate;
    }
}

impl ForceElement for Contact {
    #[inline]
    fn load(&mut self, at: &At<'_>, loads: &mut Loads<'_>) {
        let (joint, law) = (&self.joint, &self.law);
        let (ball, socket) = (&at.motion[joint.ball.body], &at.motion[joint.socket.body]);
        let arm_ball = ball.rotation * joint.ball.offset;
        let arm_socket = socket.rotation * joint.socket.offset;
        let velocity = ball.point_velocity(&arm_ball) - socket.point_velocity(&arm_socket);
        let e = (ball.position + arm_ball) - (socket.position + arm_socket);
        let gap = &mut self.gap;
        *gap = Gap {
            eccentricity: e,
            eccentricity_rate: velocity,
            ..Gap::default()
        };
        let clearance = law.clearance;
        let Some(memory) = at.touching.memory(self.index) else {
            return;
        };
        if e.norm_squared() <= clearance * clearance {
            return;
        }
        let separation = law.separation(&e, &velocity);
        let counts = &mut *loads.counts;
        let force = law.force(memory, &separation, || {
            counts.friction += 1;
            let (ball, socket) = (&ball.angular_velocity, &socket.angular_velocity);
            law.friction_reads(&separation.normal, &velocity, ball, socket)
        });
        loads.left_piece |= law.leaves_piece(memory, &separation, &force);
        gap.normal_force = force.normal;
        gap.friction = force.friction;
        gap.slip_speed = force.slip_speed;
        if force.normal == 0.0 {
            return;
        }
        let n = separation.normal;
        let on_ball = n * -force.normal + force.friction;
        let radius = law.ball_radius;
        let ball = &mut loads.wrench[joint.ball.body];
        ball.force += on_ball;
        ball.torque += (arm_ball + n * radius).cross(&on_ball);
        let socket = &mut loads.wrench[joint.socket.body];
        socket.force -= on_ball;
        socket.torque -= (arm_socket + n * (radius + clearance)).cross(&on_ball);
    }

    fn ends(&self) -> Option<[Anchor; 2]> {
        Some([self.joint.socket, self.joint.ball])
    }

    fn coupling(&self, at: &At<'_>) -> Option<Coupling> {
        let gap = &self.gap;
        let memory = at.touching.memory(self.index);
        let memory = memory.filter(|_| gap.normal_force > 0.0)?;
        let separation = self.separation();
        let n = separation.normal;
        let read = self.friction_reads(&n, at.motion);
        let force = Force {
            normal: gap.normal_force,
            friction: gap.friction,
            slip_speed: gap.slip_speed,
        };
        let stiffness = self.law.linearise(
            memory,
            &separation,
            &gap.eccentricity_rate,
            &read,
            &force,
            Slope::Tangent,
        );
        Some(Coupling {
            sides: contact_sides(&self.joint, &self.law),
            normal: n,
            force: n * -gap.normal_force + gap.friction,
            stiffness,
            uses_surface_velocity: self.law.uses_surface_velocity(),
        })
    }

    fn stored(&self, _: &[Kinematics]) -> f64 {
        self.law.elastic_energy(self.gap.penetration)
    }

    fn add_powers(&self, _: f64, motion: &[Kinematics], powers: &mut Powers) {
        let (gap, law) = (&self.gap, &self.law);
        if gap.eccentricity.norm_squared() <= law.clearance * law.clearance {
            return;
        }
        let at = self.separation();
        powers.restitution += law.restitution_power(&at, gap.normal_force);
        powers.clearance += law.clearance_power(&at, gap.normal_force);
        powers.friction += self.friction_power(&at.normal, motion);
    }
}
