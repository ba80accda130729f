//! Lubricant in a joint with play, parallel to its contacts, by the law in `contact/film.rs`. Its force acts on both parts halfway between
//! their centres: what the pressure turns them by is then part of it, and momentum, angular momentum and the balance of energy are exact.
//! A pin that tilts has two stations with half of the film each, at the nodes of Gauss's rule over its length.

use super::{ActiveSet, At, Coupling, ElementReport, ForceElement, Loads, TorqueDerivatives, push};
use crate::contact::{Film as Law, FilmShape, Parameters};
use crate::machine::{self, LooseKind, Machine, Mat3, Pin, Vec3};
use crate::mechanism::kinematics::Kinematics;
use crate::mechanism::loose::Wall;
use crate::mechanism::model::{Anchor, Model};
use crate::mechanism::{Contacts, Powers};

pub struct Film {
    /// Index of its loose joint.
    pub joint: usize,
    /// The law of each station, with the parameters in force.
    pub law: Law,
    /// The joint's pin, if it has one, and a length of the film other than that, m.
    pin: (Option<Pin>, Option<f64>),
    /// Centres on the body with the wall and on the other; none in a joint without play.
    stations: Vec<[Anchor; 2]>,
    /// Axis of the wall, in the axes of its body, unless it is a sphere.
    axis: Option<Vec3>,
    /// Whether the wall belongs to the carried part.
    is_reversed: bool,
}

/// A station at one instant, world axes; of the body with the wall, then of the other.
pub struct Station {
    /// Where the force acts, from the centroids of both bodies and in the world, m.
    arms: [Vec3; 2],
    point: Vec3,
    /// e, m, and the velocity there, m/s, in the confined directions, onto which `confined` projects.
    pub eccentricity: Vec3,
    pub velocity: Vec3,
    pub confined: Mat3,
}

impl Film {
    pub fn new(film: &machine::Lubricant, machine: &Machine, model: &Model) -> Self {
        let joint = &machine.loose_joints[film.joint];
        let pin = match joint.kind {
            LooseKind::Pin(pin) => Some(pin),
            LooseKind::Ball | LooseKind::Slide(_) => None,
        };
        let length = film.length.or(joint.pin_length());
        let mut sites = model.sites.iter().filter(|site| site.joint == film.joint && site.play == 0);
        let (first, second) = (sites.next(), sites.next());
        let stations = match (first, second) {
            (Some(a), Some(b)) => {
                let middle = (a.carried.offset + b.carried.offset) * 0.5;
                let along = (b.carried.offset - a.carried.offset).normalize();
                let node = along * (0.5 * length.unwrap_or(0.0) / 3.0_f64.sqrt());
                [middle - node, middle + node].map(|offset| [a.carrier, Anchor { offset, ..a.carried }]).to_vec()
            }
            (Some(only), None) => vec![[only.carrier, only.carried]],
            _ => Vec::new(),
        };
        let mut new = Self {
            joint: film.joint,
            law: Law {
                shape: FilmShape::Ball,
                viscosity: film.viscosity,
                thickness: film.thickness,
                radius: 0.0,
                clearance: 0.0,
            },
            pin: (pin, film.length),
            stations,
            axis: first.and_then(|site| match site.wall {
                Wall::Bore(axis, _) => Some(axis),
                Wall::Socket | Wall::Plane(_) => None,
            }),
            is_reversed: first.is_some_and(|site| site.is_reversed),
        };
        new.set(&joint.contact, joint.contact.clearance);
        new
    }

    /// Takes the parameters of its joint, and the clearance, m.
    fn set(&mut self, joint: &Parameters, clearance: f64) {
        let (pin, own) = self.pin;
        let length = pin.and_then(|pin| own.or(pin.length_by(joint)));
        let share = 1.0 / self.stations.len().max(1) as f64;
        self.law.shape = length.map_or(FilmShape::Ball, |length| FilmShape::Pin(length * share));
        (self.law.radius, self.law.clearance) = (joint.ball_radius, clearance);
    }

    fn state(&self, [wall, edge]: &[Anchor; 2], motion: &[Kinematics]) -> Station {
        let bodies = [&motion[wall.body], &motion[edge.body]];
        let confined = self.axis.map_or_else(Mat3::identity, |axis| {
            let axis = bodies[0].rotation * axis;
            Mat3::identity() - axis * axis.transpose()
        });
        let offsets = [bodies[0].rotation * wall.offset, bodies[1].rotation * edge.offset];
        let apart = (bodies[1].position - bodies[0].position) + (offsets[1] - offsets[0]);
        let eccentricity = confined * apart;
        let arm = offsets[1] - eccentricity * 0.5;
        let arms = [(bodies[1].position - bodies[0].position) + arm, arm];
        Station {
            point: bodies[1].position + arm,
            velocity: confined * (bodies[1].point_velocity(&arms[1]) - bodies[0].point_velocity(&arms[0])),
            arms,
            eccentricity,
            confined,
        }
    }

    /// Number of its stations; 0 in a joint without play.
    pub fn len(&self) -> usize {
        self.stations.len()
    }

    /// Its stations at `motion`.
    pub fn stations(&self, motion: &[Kinematics]) -> impl Iterator<Item = Station> {
        self.stations.iter().map(|ends| self.state(ends, motion))
    }

    /// The points of both bodies at which the force of `station` acts, first that of the part on which it acts.
    pub fn points(&self, station: &Station, motion: &[Kinematics]) -> [Anchor; 2] {
        [1, 0].map(|side| {
            let body = self.stations[0][side].body;
            Anchor { body, offset: motion[body].rotation.tr_mul(&station.arms[side]) }
        })
    }

    /// Derivative of the force of a station with respect to its velocity, N s/m.
    pub fn damping(&self, s: &Station) -> Mat3 {
        self.law.derivatives(&s.eccentricity, &s.velocity, &s.confined)[1]
    }

    /// Drag of the whole film, as of a station.
    pub fn whole_drag(&self, motion: &[Kinematics]) -> Mat3 {
        self.stations(motion).map(|s| self.drag(&s, motion)).sum()
    }

    fn force(&self, s: &Station) -> Vec3 {
        self.law.force(&s.eccentricity, &s.velocity)
    }

    /// Drag of a station, N m s/rad: the torque is minus that times the angular velocity of the part against the wall.
    fn drag(&self, s: &Station, motion: &[Kinematics]) -> Mat3 {
        let distance = s.eccentricity.norm();
        let [about, across] = self.law.drag(distance);
        let axis = match self.axis {
            Some(axis) => motion[self.stations[0][0].body].rotation * axis,
            None if distance > 0.0 => s.eccentricity / distance,
            None => Vec3::x(),
        };
        let along = axis * axis.transpose();
        match self.axis {
            Some(_) => along * about,
            None => along * about + (Mat3::identity() - along) * across,
        }
    }

    /// Bodies of the wall and of the other part.
    fn bodies<'a>(&self, motion: &'a [Kinematics]) -> Option<[&'a Kinematics; 2]> {
        self.stations.first().map(|ends| ends.map(|end| &motion[end.body]))
    }

    /// Angular velocity of the part against the wall, rad/s.
    pub fn spin(&self, motion: &[Kinematics]) -> Vec3 {
        self.bodies(motion).map_or_else(Vec3::zeros, |[wall, edge]| edge.angular_velocity - wall.angular_velocity)
    }

    /// Mean point of the stations, m.
    fn middle(&self, motion: &[Kinematics]) -> Vec3 {
        let points = self.stations(motion).map(|s| s.point);
        points.sum::<Vec3>() / self.stations.len().max(1) as f64
    }
}

impl ForceElement for Film {
    fn load(&mut self, at: &At<'_>, loads: &mut Loads<'_>) {
        if matches!(at.active_set, ActiveSet::Solved) {
            return;
        }
        let spin = self.spin(at.motion);
        for ends in &self.stations {
            let s = self.state(ends, at.motion);
            let force = self.force(&s);
            let torque = self.drag(&s, at.motion) * -spin;
            for (side, sign) in [-1.0, 1.0].into_iter().enumerate() {
                let wrench = &mut loads.wrench[ends[side].body];
                push(wrench, &s.arms[side], &(force * sign));
                wrench.torque += torque * sign;
            }
        }
    }

    fn film(&self) -> Option<&Film> {
        Some(self)
    }

    fn follow(&mut self, contacts: &Contacts, t: f64) {
        self.set(contacts.parameters(self.joint), contacts.clearance_at(self.joint, t));
    }

    fn add_powers(&self, _: f64, motion: &[Kinematics], powers: &mut Powers) {
        let pressure = self.stations(motion).map(|s| -self.force(&s).dot(&s.velocity));
        let spin = self.spin(motion);
        powers.damping += spin.dot(&(self.whole_drag(motion) * spin)) + pressure.sum::<f64>();
    }

    fn ends(&self, motion: &[Kinematics]) -> Option<[Anchor; 2]> {
        let (middle, bodies) = (self.middle(motion), self.bodies(motion)?);
        let at = |side: usize| {
            let body: &Kinematics = bodies[side];
            Anchor { body: self.stations[0][side].body, offset: body.rotation.tr_mul(&(middle - body.position)) }
        };
        Some([at(0), at(1)])
    }

    fn coupling(&self, at: &At<'_>) -> Option<Coupling> {
        let ends = self.ends(at.motion)?;
        let middle = self.middle(at.motion);
        let (mut along, mut torque) = ([Mat3::zeros(); 2], TorqueDerivatives::default());
        let mut mixed = [[Mat3::zeros(); 2]; 2];
        for station in &self.stations {
            let s = self.state(station, at.motion);
            torque.by_angular_velocity -= self.drag(&s, at.motion);
            let [by_displacement, by_velocity] = self.law.derivatives(&s.eccentricity, &s.velocity, &s.confined);
            // The velocity is that of a point which turns with the mean of both bodies: a displacement changes it, too.
            let turning = station.iter().map(|end| at.motion[end.body].angular_velocity).sum::<Vec3>() * 0.5;
            let by_displacement = by_displacement - by_velocity * turning.cross_matrix() * s.confined;
            let arm = (s.point - middle).cross_matrix();
            for (order, derivative) in [by_displacement, by_velocity].into_iter().enumerate() {
                along[order] += derivative;
                mixed[order][0] -= derivative * arm;
                mixed[order][1] += arm * derivative;
            }
            torque.by_rotation -= arm * by_displacement * arm;
            torque.by_angular_velocity -= arm * by_velocity * arm;
        }
        torque.mixed = (self.stations.len() > 1).then_some(mixed);
        Some(Coupling::at_one_point(ends, along, torque))
    }

    fn report(&self, _: f64, motion: &[Kinematics]) -> ElementReport {
        let (mut force, mut torque, spin) = (Vec3::zeros(), Vec3::zeros(), self.spin(motion));
        let middle = self.middle(motion);
        for ends in &self.stations {
            let s = self.state(ends, motion);
            let own = self.force(&s);
            force += own;
            torque += (s.point - middle).cross(&own) - self.drag(&s, motion) * spin;
        }
        let sign = if self.is_reversed { -1.0 } else { 1.0 };
        ElementReport {
            points: [middle; 2],
            force: force * sign,
            torque: Some(torque * sign),
            ..ElementReport::default()
        }
    }
}
