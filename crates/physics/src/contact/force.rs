//! The force between a ball and its socket wall, and its derivatives with respect to displacement and velocity. Every contact
//! force and derivative is computed here.

use super::{BristleForce, Bristles, Coefficients, ContactState, FrictionBranch, FrictionVelocity, Mat3, Vec3};

/// Position and motion of a ball in its socket.
#[derive(Clone, Copy, Debug, Default)]
pub struct Separation {
    /// Eccentricity |e|, m.
    pub distance: f64,
    /// n = e / |e| (8); zero for e = 0.
    pub normal: Vec3,
    /// Penetration delta = |e| - c, m (10).
    pub penetration: f64,
    /// Penetration rate d(delta)/dt, m/s.
    pub rate: f64,
}

impl Separation {
    /// Sliding velocity v_t, m/s, from the velocity used by friction.
    #[inline]
    pub fn sliding_velocity(&self, slip_velocity: &Vec3) -> Vec3 {
        slip_velocity - self.normal * self.normal.dot(slip_velocity)
    }
}

/// Force on a ball, with its sliding speed.
#[derive(Clone, Copy, Debug)]
pub struct Force {
    /// F_N, N (19).
    pub normal: f64,
    /// F_T on the ball, N (20).
    pub friction: Vec3,
    /// |v_t| used by the friction law, m/s; 0 if it used none.
    pub slip_speed: f64,
}

/// Derivatives of a contact's force on the ball, and of its normal.
#[derive(Clone, Copy, Debug)]
pub struct Stiffness {
    /// dF/de, N/m.
    pub(crate) by_displacement: Mat3,
    /// Derivative with respect to the centres' relative velocity, through the penetration rate, N s/m.
    pub by_rate: Mat3,
    /// Derivative with respect to the velocity [`Coefficients::slip_velocity`], N s/m.
    pub(crate) by_slip: Mat3,
    /// dn/de, 1/m.
    pub normal: Mat3,
}

impl Stiffness {
    /// Adds the effect of the derivative `by_normal` (m/s) of the friction velocity with respect to the normal.
    pub(crate) fn add_normal_rotation(&mut self, by_normal: &Mat3) {
        self.by_displacement += self.by_slip * by_normal * self.normal;
    }

    /// Adds the friction of bristles on a contact with this normal, at a fixed deflection; what depends on the turning of the tangent
    /// plane is left out.
    pub(crate) fn add_bristles(&mut self, normal: &Vec3, law: &Bristles, force: &BristleForce) {
        let tangent = Mat3::identity() - normal * normal.transpose();
        self.by_slip += (force.by_bending() * (-law.stiffness * law.lag) + force.by_speed) * tangent;
        // The normal force is -n . F in what is there.
        let by_normal_force = force.by_normal_force * -normal.transpose();
        self.by_displacement += by_normal_force * self.by_displacement;
        self.by_rate += by_normal_force * self.by_rate;
    }

    /// Derivatives of a force between two points.
    pub(crate) fn between_points(by_displacement: Mat3, by_rate: Mat3) -> Self {
        Self { by_displacement, by_rate, by_slip: Mat3::zeros(), normal: Mat3::zeros() }
    }
}

impl Coefficients {
    /// Separation of a ball at the eccentricity e (m) with the velocity de/dt (m/s).
    #[inline]
    pub fn separation(&self, eccentricity: &Vec3, velocity: &Vec3) -> Separation {
        let distance = eccentricity.norm();
        let (normal, opening) = if distance > 0.0 {
            let normal = eccentricity / distance;
            (normal, normal.dot(velocity))
        } else {
            // A ball exactly at the centre leaves it in its direction of motion.
            (Vec3::zeros(), velocity.norm())
        };
        Separation { distance, normal, penetration: distance - self.clearance, rate: opening - self.clearance_rate }
    }

    /// The same across a plane with this normal: only the part of e along it counts, with its sign.
    #[inline]
    pub fn separation_along(&self, normal: &Vec3, eccentricity: &Vec3, velocity: &Vec3) -> Separation {
        let (distance, opening) = (normal.dot(eccentricity), normal.dot(velocity));
        let (penetration, rate) = (distance - self.clearance, opening - self.clearance_rate);
        Separation { distance, normal: *normal, penetration, rate }
    }

    /// Distances along the normal from the centres of ball and socket to the points where the force acts on each, m: r and R.
    #[inline]
    pub fn socket_levers(&self) -> [f64; 2] {
        [self.ball_radius, self.ball_radius + self.clearance]
    }

    /// Velocity of the ball's contact point relative to the socket's, m/s, from de/dt and the angular velocities of both, and their
    /// distances from the centres along the normal, m.
    #[inline]
    pub(crate) fn surface_velocity(
        normal: &Vec3,
        velocity: &Vec3,
        [ball, socket]: [&Vec3; 2],
        [to_ball, to_socket]: [f64; 2],
    ) -> Vec3 {
        velocity + ball.cross(&(normal * to_ball)) - socket.cross(&(normal * to_socket))
    }

    /// Derivative of [`Self::slip_velocity`] with respect to the normal, m/s. The play is so small that a slight motion of the
    /// ball turns its normal a lot, which changes the sliding velocity of spinning bodies.
    pub(crate) fn slip_velocity_by_normal(&self, [ball, socket]: [&Vec3; 2], [to_ball, to_socket]: [f64; 2]) -> Mat3 {
        match self.friction_velocity {
            FrictionVelocity::Centres => Mat3::zeros(),
            FrictionVelocity::Surface => ball.cross_matrix() * to_ball - socket.cross_matrix() * to_socket,
        }
    }

    /// Relative velocity used by friction, not yet projected onto the tangent plane, m/s; arguments as in
    /// `surface_velocity`.
    #[inline]
    pub fn slip_velocity(&self, normal: &Vec3, velocity: &Vec3, spins: [&Vec3; 2], levers: [f64; 2]) -> Vec3 {
        match self.friction_velocity {
            FrictionVelocity::Centres => *velocity,
            FrictionVelocity::Surface => Self::surface_velocity(normal, velocity, spins, levers),
        }
    }

    /// Whether friction uses the velocity of the surfaces rather than that of the centres.
    pub(crate) fn uses_surface_velocity(&self) -> bool {
        self.friction_velocity == FrictionVelocity::Surface
    }

    /// Force on a ball in contact; `slip_velocity` returns the velocity used by friction and is called only if there is friction.
    #[inline]
    pub fn force(&self, contact_state: &ContactState, gap: &Separation, slip_velocity: impl FnOnce() -> Vec3) -> Force {
        let approach = contact_state.approach(self, gap.rate);
        let mut force = Force {
            normal: self.normal_force(gap.penetration, gap.rate, approach),
            friction: Vec3::zeros(),
            slip_speed: 0.0,
        };
        if force.normal > 0.0 && self.friction > 0.0 {
            let sliding_velocity = gap.sliding_velocity(&slip_velocity());
            force.slip_speed = sliding_velocity.norm();
            let per_speed = self.friction_per_speed(contact_state.friction_branch, force.slip_speed);
            if per_speed != 0.0 {
                force.friction = sliding_velocity * (-per_speed * force.normal);
            }
        }
        force
    }

    /// Derivatives of `force` (the result of [`Self::force`], > 0) at the fixed friction velocity `slip_velocity`; `confined` projects
    /// onto the directions in which the wall confines.
    pub fn linearise(
        &self,
        contact_state: &ContactState,
        gap: &Separation,
        velocity: &Vec3,
        slip_velocity: &Vec3,
        force: &Force,
        confined: &Mat3,
    ) -> Stiffness {
        let Separation { distance, normal: n, penetration, rate } = *gap;
        let approach = contact_state.approach(self, rate);
        let tangent = Mat3::identity() - n * n.transpose();
        let normal_by_displacement = (confined - n * n.transpose()) / distance;
        let by_penetration = self.elastic.slope(penetration) * (1.0 + self.damping * rate / approach);
        let by_rate = if contact_state.approach_follows_rate(self, rate) {
            0.0
        } else {
            self.elastic.force(penetration) * self.damping / approach
        };
        // F = -F_N (n + p v_t), p the friction per normal force and speed.
        let mut along = -n;
        let mut by_displacement = normal_by_displacement * -force.normal;
        let mut by_slip = Mat3::zeros();
        if self.friction > 0.0 {
            let speed = force.slip_speed;
            let per_speed = self.friction_per_speed(contact_state.friction_branch, speed);
            let sliding_velocity = gap.sliding_velocity(slip_velocity);
            along -= sliding_velocity * per_speed;
            // dF/dv_t
            let mut resistance = Mat3::identity() * (-per_speed * force.normal);
            if speed > 0.0 {
                let slope = self.friction_per_speed_slope(contact_state.friction_branch, speed) / speed;
                resistance -= sliding_velocity * sliding_velocity.transpose() * (slope * force.normal);
            }
            // v_t = (1 - n n') w, and the tangent plane turns with n: dv_t = -((n . w) dn + n (w . dn)).
            let turned = normal_by_displacement * n.dot(slip_velocity)
                + n * (normal_by_displacement * slip_velocity).transpose();
            by_displacement -= resistance * turned;
            by_slip = resistance * tangent;
        }
        // d(delta_dot)/de = (1 - n n') e_dot / |e|.
        by_displacement += along * (n * by_penetration + normal_by_displacement * velocity * by_rate).transpose();
        Stiffness {
            by_displacement,
            by_rate: along * (n * by_rate).transpose(),
            by_slip,
            normal: normal_by_displacement,
        }
    }

    /// Whether a contact may have left its frozen branches of the laws: the step is then searched for corners.
    #[inline]
    pub(crate) fn leaves_branch(&self, contact_state: &ContactState, gap: &Separation, force: &Force) -> bool {
        contact_state.may_leave_approach_branch(gap.rate)
            || (force.normal > 0.0
                && self.friction > 0.0
                && contact_state.friction_branch != FrictionBranch::Unfrozen
                && self.excess_over_branch(contact_state.friction_branch, force.slip_speed) > 0.0)
    }

    /// Power dissipated by the damping part of `force`, W: (F_N - F) d(delta)/dt.
    #[inline]
    pub(crate) fn restitution_power(&self, gap: &Separation, force: f64) -> f64 {
        (force - self.elastic.force(gap.penetration)) * gap.rate
    }

    /// Power supplied by a ramping clearance, W: -F_N dc/dt + dU/dc dc/dt.
    #[inline]
    pub(crate) fn clearance_power(&self, gap: &Separation, force: f64) -> f64 {
        if self.clearance_rate == 0.0 {
            return 0.0;
        }
        let stiffening = self.elastic.energy_by_clearance(gap.penetration);
        (stiffening - force) * self.clearance_rate
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{ApproachBranch, Parameters};

    /// A ball pressed 2 µm into its wall that slides at `speed` m/s and sinks further at 5 mm/s while its clearance ramps.
    fn penetrating_ball(friction_velocity: FrictionVelocity, speed: f64) -> (Coefficients, Vec3, Vec3) {
        let parameters = Parameters { friction_velocity, ..Parameters::default() };
        let mut c = Coefficients::new(&parameters, 3e-4);
        c.set_clearance(&parameters, 3e-4, -2e-3);
        let n = Vec3::new(2.0, -1.0, 2.0) / 3.0;
        let t = Vec3::new(1.0, 2.0, 0.0) / libm::sqrt(5.0);
        (c, n * (3e-4 + 2e-6), n * 5e-3 + t * speed)
    }

    fn contact_state(friction_branch: FrictionBranch, approach_branch: ApproachBranch) -> ContactState {
        ContactState { active: true, approach_speed: 4e-3, friction_branch, approach_branch, ..ContactState::default() }
    }

    const BALL: Vec3 = Vec3::new(0.3, -0.2, 0.5);
    const SOCKET: Vec3 = Vec3::new(-0.1, 0.4, 0.2);

    /// Force on the ball.
    fn on_ball(c: &Coefficients, contact_state: &ContactState, e: &Vec3, v: &Vec3) -> Vec3 {
        let at = c.separation(e, v);
        let slip_velocity = || c.slip_velocity(&at.normal, v, [&BALL, &SOCKET], c.socket_levers());
        let force = c.force(contact_state, &at, slip_velocity);
        at.normal * -force.normal + force.friction
    }

    #[test]
    fn derivatives_are_those_of_central_differences() {
        for friction_velocity in FrictionVelocity::ALL {
            for (friction_branch, speed) in
                [(FrictionBranch::Ramp, 3e-5), (FrictionBranch::Full, 0.04), (FrictionBranch::Unfrozen, 0.04)]
            {
                for approach_branch in [ApproachBranch::Held, ApproachBranch::Rising] {
                    let (c, e, v) = penetrating_ball(friction_velocity, speed);
                    let contact_state = contact_state(friction_branch, approach_branch);
                    let at = c.separation(&e, &v);
                    let slip_velocity = c.slip_velocity(&at.normal, &v, [&BALL, &SOCKET], c.socket_levers());
                    let force = c.force(&contact_state, &at, || slip_velocity);
                    assert!(force.normal > 1.0 && force.friction.norm() > 0.01 * force.normal);
                    let mut s = c.linearise(&contact_state, &at, &v, &slip_velocity, &force, &Mat3::identity());
                    s.add_normal_rotation(&c.slip_velocity_by_normal([&BALL, &SOCKET], c.socket_levers()));
                    let by_velocity = s.by_rate + s.by_slip;
                    for k in 0..3 {
                        let unit = Vec3::ith(k, 1.0);
                        let d = 1e-11;
                        let difference = (on_ball(&c, &contact_state, &(e + unit * d), &v)
                            - on_ball(&c, &contact_state, &(e - unit * d), &v))
                            / (2.0 * d);
                        let got: Vec3 = s.by_displacement.column(k).into();
                        let off = (got - difference).norm() / s.by_displacement.norm();
                        assert!(
                            off < 1e-5,
                            "{friction_velocity:?} {friction_branch:?} {approach_branch:?} e{k}: {off:e}"
                        );
                        let d = 1e-8 * speed;
                        let difference = (on_ball(&c, &contact_state, &e, &(v + unit * d))
                            - on_ball(&c, &contact_state, &e, &(v - unit * d)))
                            / (2.0 * d);
                        let got: Vec3 = by_velocity.column(k).into();
                        let off = (got - difference).norm() / by_velocity.norm();
                        assert!(
                            off < 1e-5,
                            "{friction_velocity:?} {friction_branch:?} {approach_branch:?} v{k}: {off:e}"
                        );
                    }
                }
            }
        }
    }
}
