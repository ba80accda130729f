//! A contact of a joint with play, between a part and a wall, by the laws in `contact`.

use super::{ActiveSet, At, Coupling, ForceElement, Loads};
use crate::contact::{BristleForce, Coefficients, ContactState, Force, FrictionBranch, Separation};
use crate::machine::Vec3;
use crate::mechanism::kinematics::Kinematics;
use crate::mechanism::loose::{Profile, Spot, Wall};
use crate::mechanism::model::{Anchor, ContactId, Site};
use crate::mechanism::{Powers, WallContact};

/// One contact at the latest evaluation.
#[derive(Clone, Copy, Debug, Default)]
pub struct Gap {
    /// e = Z_j - Z_i, m (5).
    pub eccentricity: Vec3,
    /// de/dt, m/s.
    pub(crate) eccentricity_rate: Vec3,
    /// Position of the ball in its socket. Every evaluation sets it for a ball beyond the wall, and `complete_separation`
    /// completes it for the others.
    pub separation: Separation,
    /// F_N, N (19).
    pub normal_force: f64,
    /// F_T on the ball, N (20).
    pub friction: Vec3,
    /// |v_t| used by friction, m/s.
    pub slip_speed: f64,
}

/// A contact of a loose site.
pub struct Contact {
    id: ContactId,
    pub site: Site,
    pub law: Coefficients,
    pub gap: Gap,
    /// Its bristles, if its law of friction has them.
    pub bristles: Option<BristleState>,
    /// Its worn wall, if that wears by direction; `site` then follows it.
    pub profile: Option<Box<Profile>>,
}

/// The bristles of a contact, in axes fixed to the carrier.
#[derive(Clone, Copy, Debug, Default)]
pub struct BristleState {
    /// First of their three components among those of all bristles.
    pub first: usize,
    /// Rate of the deflection at the latest evaluation, m/s; 0 without contact.
    pub rate: Vec3,
}

impl Contact {
    /// `first_bristle`: place of its bristles among those of all contacts, if it has any.
    pub fn new(id: ContactId, site: Site, law: Coefficients, first_bristle: Option<usize>) -> Self {
        let bristles = first_bristle.map(|first| BristleState { first, ..BristleState::default() });
        Self { id, site, law, gap: Gap::default(), bristles, profile: None }
    }

    /// Deflection of its bristles, m, in world axes and the plane across `normal`; zero without bristles.
    pub fn bent(&self, bristles: &[f64], normal: &Vec3, motion: &[Kinematics]) -> Vec3 {
        self.bristles.map_or_else(Vec3::zeros, |BristleState { first, .. }| {
            let own = Vec3::from_column_slice(&bristles[first..first + 3]);
            let turned = motion[self.site.carrier.body].rotation * own;
            turned - normal * normal.dot(&turned)
        })
    }

    /// Friction of the bristles under the normal force `normal_force`, N, at the separation of the gap, on the branch `branch`; with
    /// the deflection, m, and the sliding velocity, m/s. `None` without bristles.
    fn bristle_friction(
        &self,
        bristles: &[f64],
        motion: &[Kinematics],
        branch: FrictionBranch,
        normal_force: f64,
    ) -> Option<(BristleForce, Vec3, Vec3)> {
        let law = self.law.bristles.as_ref()?;
        let at = &self.gap.separation;
        let slip = at.sliding_velocity(&self.slip_velocity(&at.normal, motion));
        let bent = self.bent(bristles, &at.normal, motion);
        Some((law.force(branch, &bent, &slip, normal_force), bent, slip))
    }

    /// How far the bristles lie beyond `branch` at the gap last measured, m; `None` without bristles.
    pub fn bristle_excess(
        &self,
        bristles: &[f64],
        motion: &[Kinematics],
        contact_state: &ContactState,
        branch: FrictionBranch,
    ) -> Option<f64> {
        let at = &self.gap.separation;
        let approach = contact_state.approach(&self.law, at.rate);
        let normal_force = self.law.normal_force(at.penetration, at.rate, approach);
        self.bristle_friction(bristles, motion, branch, normal_force).map(|(force, ..)| force.excess)
    }

    /// Adds bristle friction to the gap just loaded; returns whether it has left its branch.
    #[inline(never)]
    fn load_bristles(&mut self, at: &At<'_>, contact_state: &ContactState) -> bool {
        let branch = contact_state.friction_branch;
        let found = self.bristle_friction(at.bristles, at.motion, branch, self.gap.normal_force);
        let normal_rate = self.normal_rate(at.motion);
        let (Some((force, bent, slip)), Some(state)) = (found, &mut self.bristles) else {
            return false;
        };
        // The deflection stays in the tangent plane as that turns in the carrier.
        let turning = self.gap.separation.normal * normal_rate.dot(&bent);
        state.rate = at.motion[self.site.carrier.body].rotation.tr_mul(&(force.rate - turning));
        self.gap.friction = force.force;
        self.gap.slip_speed = slip.norm();
        force.excess > 0.0
    }

    /// The friction of the bristles after an evaluation, with its derivatives; `None` without bristles.
    pub fn bristle_force(&self, at: &At<'_>) -> Option<BristleForce> {
        let branch = at.active_set.contact_state(self.id)?.friction_branch;
        self.bristle_friction(at.bristles, at.motion, branch, self.gap.normal_force).map(|(force, ..)| force)
    }

    /// Whether the change of the eccentricity over a step is the motion of its ends.
    pub fn moves_as_measured(&self) -> bool {
        self.site.wall == Wall::Socket && self.worn_profile().is_none()
    }

    /// Rate of the normal relative to the carrier, 1/s.
    fn normal_rate(&self, motion: &[Kinematics]) -> Vec3 {
        let (gap, carrier) = (&self.gap, &motion[self.site.carrier.body]);
        let Separation { normal, distance, .. } = gap.separation;
        if matches!(self.site.wall, Wall::Plane(_)) || distance == 0.0 {
            return Vec3::zeros();
        }
        if let Some(profile) = self.worn_profile() {
            // Of the worn body, whose normal turns with the place alone, and with that.
            let worn = &motion[profile.worn_body()].angular_velocity;
            let velocity = gap.eccentricity_rate - worn.cross(&gap.eccentricity);
            let turning = profile.normal_by_displacement(motion) * velocity;
            return turning + (worn - carrier.angular_velocity).cross(&normal);
        }
        let velocity = gap.eccentricity_rate - carrier.angular_velocity.cross(&gap.eccentricity);
        let across = self.site.wall.confined(&carrier.rotation) * velocity;
        (across - normal * normal.dot(&across)) / distance
    }

    /// How fast the place where it presses turns along its wall, if that wears by direction, rad/s.
    pub fn sweep(&self, motion: &[Kinematics]) -> f64 {
        let Some(profile) = self.profile.as_deref().filter(|_| self.gap.separation.penetration > 0.0) else {
            return 0.0;
        };
        let turned = motion[self.site.carrier.body].angular_velocity - motion[profile.worn_body()].angular_velocity;
        (self.normal_rate(motion) + turned.cross(&self.gap.separation.normal)).norm()
    }

    /// Its wall, if that has worn by direction.
    fn worn_profile(&self) -> Option<&Profile> {
        self.profile.as_deref().filter(|profile| profile.has_worn())
    }

    /// Lets the site follow the worn wall, if there is one.
    #[inline(never)]
    pub fn follow_wear(&mut self, motion: &[Kinematics]) {
        if let Some(profile) = &mut self.profile {
            profile.follow(&mut self.site, motion);
        }
    }

    /// Whether it may carry a force.
    #[inline]
    pub fn may_carry_force(&self, active_set: ActiveSet<'_>) -> bool {
        active_set.contact_state(self.id).is_some()
    }

    /// Velocity of the surfaces against each other at the point of contact, m/s.
    #[inline(always)]
    fn surface_velocity(&self, motion: &[Kinematics]) -> Vec3 {
        let Separation { normal, distance, .. } = &self.gap.separation;
        let levers = self.site.wall.levers(&self.law, *distance);
        Coefficients::surface_velocity(normal, &self.gap.eccentricity_rate, self.spins(motion), levers)
    }

    /// Power dissipated by friction, W.
    #[inline]
    fn friction_power(&self, motion: &[Kinematics]) -> f64 {
        let gap = &self.gap;
        if gap.friction == Vec3::zeros() {
            return 0.0;
        }
        -gap.friction.dot(&self.surface_velocity(motion))
    }

    /// Normal force times the sliding speed of the surfaces, whatever velocity friction uses, W: what wears them.
    pub fn sliding_power(&self, motion: &[Kinematics]) -> f64 {
        let gap = &self.gap;
        if gap.normal_force <= 0.0 {
            return 0.0;
        }
        gap.normal_force * gap.separation.sliding_velocity(&self.surface_velocity(motion)).norm()
    }

    /// What presses against the wall at the latest evaluation; `None` without contact force. `centre` is the point of the joint's
    /// carrier.
    pub fn wall_contact(&self, centre: &Anchor, motion: &[Kinematics]) -> Option<WallContact> {
        if self.gap.normal_force <= 0.0 {
            return None;
        }
        Some(WallContact {
            spot: self.spot(centre, motion),
            normal_force: self.gap.normal_force,
            friction_power: self.friction_power(motion),
        })
    }

    /// Where it touches the carrier of its joint, whose point is `centre`, at the latest evaluation, or would if it is near the wall.
    pub fn spot(&self, centre: &Anchor, motion: &[Kinematics]) -> Spot {
        self.site.spot(centre, &self.gap.eccentricity, motion)
    }

    /// e, or across a plane its part beyond it, m: a step's force is solved for by its length.
    pub fn reach(&self) -> Vec3 {
        match self.site.wall {
            Wall::Socket | Wall::Bore(..) => self.gap.eccentricity,
            Wall::Plane(_) => self.gap.separation.normal * self.gap.separation.distance.max(0.0),
        }
    }

    /// Angular velocities of ball and socket, rad/s.
    #[inline]
    fn spins<'a>(&self, motion: &'a [Kinematics]) -> [&'a Vec3; 2] {
        [self.site.carried.body, self.site.carrier.body].map(|body| &motion[body].angular_velocity)
    }

    /// Relative velocity used by friction for the normal `n`, m/s.
    #[inline]
    pub fn slip_velocity(&self, n: &Vec3, motion: &[Kinematics]) -> Vec3 {
        let levers = self.site.wall.levers(&self.law, self.gap.separation.distance);
        self.law.slip_velocity(n, &self.gap.eccentricity_rate, self.spins(motion), levers)
    }

    /// Measures the eccentricity and its rate; forces are left unchanged. The site follows its worn wall already.
    pub fn measure(&mut self, motion: &[Kinematics]) {
        let site = &self.site;
        let (e, rate) = site.opening(motion, &site.arms(motion));
        (self.gap.eccentricity, self.gap.eccentricity_rate) = (e, rate);
        self.complete_separation(motion);
    }

    /// Completes the separation from the eccentricity of the latest evaluation, at `motion`.
    pub fn complete_separation(&mut self, motion: &[Kinematics]) {
        let Self { site, law, gap, .. } = self;
        let rotation = &motion[site.carrier.body].rotation;
        gap.separation = site.wall.separation(law, &gap.eccentricity, &gap.eccentricity_rate, rotation);
    }
}

impl Contact {
    /// Force of the contact; in a socket, the most frequent wall, if `SOCKET`.
    #[inline(always)]
    fn load_on<const SOCKET: bool>(&mut self, at: &At<'_>, loads: &mut Loads<'_>) {
        let (site, law) = (&self.site, &self.law);
        let wall = if SOCKET { &Wall::Socket } else { &site.wall };
        let arms = if SOCKET { site.arms_to_points(at.motion) } else { site.arms(at.motion) };
        let (e, velocity) = site.opening(at.motion, &arms);
        let gap = &mut self.gap;
        *gap = Gap { eccentricity: e, eccentricity_rate: velocity, ..Gap::default() };
        let clearance = law.clearance;
        let rotation = &at.motion[site.carrier.body].rotation;
        if !wall.is_beyond(&e, clearance, rotation) {
            return;
        }
        let separation = wall.separation(law, &e, &velocity, rotation);
        gap.separation = separation;
        let Some(contact_state) = at.active_set.contact_state(self.id) else {
            return;
        };
        let counts = &mut *loads.counts;
        let force = law.force(contact_state, &separation, || {
            counts.friction += 1;
            let spin = |anchor: &Anchor| &at.motion[anchor.body].angular_velocity;
            let levers = wall.levers(law, separation.distance);
            law.slip_velocity(&separation.normal, &velocity, [spin(&site.carried), spin(&site.carrier)], levers)
        });
        let mut leaves = law.leaves_branch(contact_state, &separation, &force);
        gap.normal_force = force.normal;
        gap.friction = force.friction;
        gap.slip_speed = force.slip_speed;
        let levers = wall.levers(law, separation.distance);
        if self.bristles.is_some() {
            counts.friction += 1;
            leaves |= self.load_bristles(at, contact_state);
        }
        if let Some(has_left_branch) = loads.has_left_branch.get_mut(self.id) {
            *has_left_branch |= leaves;
        }
        if force.normal == 0.0 {
            return;
        }
        let (site, n) = (&self.site, separation.normal);
        let on_ball = n * -force.normal + self.gap.friction;
        let [to_ball, to_socket] = levers;
        let [arm_ball, arm_socket] = arms;
        let ball = &mut loads.wrench[site.carried.body];
        ball.force += on_ball;
        ball.torque += (arm_ball + n * to_ball).cross(&on_ball);
        let socket = &mut loads.wrench[site.carrier.body];
        socket.force -= on_ball;
        socket.torque -= (arm_socket + n * to_socket).cross(&on_ball);
    }

    #[inline(never)]
    fn load_on_wall(&mut self, at: &At<'_>, loads: &mut Loads<'_>) {
        self.load_on::<false>(at, loads);
    }
}

impl ForceElement for Contact {
    #[inline]
    fn load(&mut self, at: &At<'_>, loads: &mut Loads<'_>) {
        match self.site.wall {
            Wall::Socket => self.load_on::<true>(at, loads),
            Wall::Bore(..) | Wall::Plane(_) => self.load_on_wall(at, loads),
        }
    }

    fn coupling(&self, at: &At<'_>) -> Option<Coupling> {
        let gap = &self.gap;
        let contact_state = at.active_set.contact_state(self.id);
        let contact_state = contact_state.filter(|_| gap.normal_force > 0.0)?;
        let n = gap.separation.normal;
        let read = self.slip_velocity(&n, at.motion);
        let force = Force { normal: gap.normal_force, friction: gap.friction, slip_speed: gap.slip_speed };
        let Self { site, law, .. } = self;
        let confined = match self.worn_profile() {
            None => site.wall.confined(&at.motion[site.carrier.body].rotation),
            // The normal turns by the curvature of the worn wall.
            Some(profile) => profile.normal_by_displacement(at.motion) * gap.separation.distance + n * n.transpose(),
        };
        let mut stiffness =
            law.linearise(contact_state, &gap.separation, &gap.eccentricity_rate, &read, &force, &confined);
        let distance = gap.separation.distance;
        let levers = site.wall.levers(law, distance);
        if let Some(law) = &law.bristles
            && let Some(force) = self.bristle_force(at)
        {
            stiffness.add_bristles(&n, law, &force);
        }
        stiffness.add_normal_rotation(&law.slip_velocity_by_normal(self.spins(at.motion), levers));
        Some(Coupling {
            sides: site.sides(law, distance, at.motion),
            normal: n,
            force: n * -gap.normal_force + gap.friction,
            stiffness,
            uses_surface_velocity: self.law.uses_surface_velocity(),
            torque_derivatives: None,
        })
    }

    fn stored(&self, _: f64, _: &[Kinematics]) -> f64 {
        self.law.elastic.energy(self.gap.separation.penetration)
    }

    fn add_powers(&self, _: f64, motion: &[Kinematics], powers: &mut Powers) {
        let (gap, law) = (&self.gap, &self.law);
        if !self.site.wall.is_beyond(&gap.eccentricity, law.clearance, &motion[self.site.carrier.body].rotation) {
            return;
        }
        let at = &gap.separation;
        powers.restitution += law.restitution_power(at, gap.normal_force);
        powers.clearance += law.clearance_power(at, gap.normal_force);
        powers.friction += self.friction_power(motion);
    }
}
