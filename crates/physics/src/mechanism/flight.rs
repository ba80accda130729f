//! Free flight: Taylor series of the motion of a free body under gravity alone. Between two contacts the whole motion is then
//! known to rounding at the cost of one evaluation.

use serde::{Deserialize, Serialize};

use super::kinematics::{part, rotation_of};
use super::model::{Body, BodyIndex, ContactId, Motion};
use super::{ActiveSet, Mechanism};
use std::ops::Range;

use crate::machine::{Formulation, Machine, Vec3};

/// Order of the series in time.
const ORDER: usize = 10;
/// Maximum contribution of the last term, relative to a unit quaternion and to the angular velocity.
const LAST_TERM: f64 = 1e-17;
/// Maximum duration of a flight, s.
const LONGEST: f64 = 0.1;

/// A free body that is loaded only by contacts, gravity and the hand.
#[derive(Clone, Debug)]
pub struct FreeFlightBody {
    /// Body index.
    pub body: BodyIndex,
    /// Contacts on the body.
    pub contacts: Vec<ContactId>,
    q: usize,
    v: usize,
}

impl FreeFlightBody {
    /// Free-flight bodies of a scene; none if ideal joints couple bodies or drive forces depend on unknown accelerations.
    pub(super) fn all(mechanism: &Mechanism, machine: &Machine) -> Vec<Self> {
        let model = &*mechanism.model;
        let separate = mechanism.equations.is_block_diagonal() && mechanism.sources.forces_suffice;
        if !separate || machine.formulation != Formulation::Tree {
            return Vec::new();
        }
        let mut loaded = vec![false; model.bodies.len()];
        let points = machine.elements.iter().flat_map(|element| element.points(machine));
        for body in points.filter_map(|point| point.body) {
            loaded[body] = true;
        }
        let mut contacts = vec![Vec::new(); model.bodies.len() + 1];
        for (c, site) in model.sites.iter().enumerate() {
            contacts[site.carried.body].push(c);
            if site.carrier.body != site.carried.body {
                contacts[site.carrier.body].push(c);
            }
        }
        // In order of body index, like the blocks.
        let single = model.blocks.iter().filter_map(|block| block.single_free_body);
        let free_flight_body = |body: BodyIndex| match model.bodies[body].motion {
            Motion::Free { q, v } => {
                Some(Self { body, contacts: std::mem::take(&mut contacts[body]), q, v: model.nq + v })
            }
            _ => None,
        };
        single.filter(|&b| !loaded[b]).filter_map(free_flight_body).collect()
    }

    /// Its components of the state: positions, then velocities.
    pub fn parts(&self) -> [Range<usize>; 2] {
        [self.q..self.q + 7, self.v..self.v + 6]
    }
}

/// Components of the state advanced by steps: those of bodies not in free flight.
#[derive(Default)]
pub(super) struct ActiveRanges {
    /// Ranges in ascending order, positions first.
    pub parts: Vec<Range<usize>>,
    /// Number of ranges that are positions.
    position_ranges: usize,
}

impl ActiveRanges {
    /// With capacity to exclude this number of bodies.
    pub fn with_capacity(free_flight_bodies: usize) -> Self {
        Self { parts: Vec::with_capacity(2 * (free_flight_bodies + 1)), position_ranges: 0 }
    }

    /// Ranges of positions.
    pub fn positions(&self) -> &[Range<usize>] {
        &self.parts[..self.position_ranges]
    }

    /// Ranges of velocities, and of what follows them.
    pub fn velocities(&self) -> &[Range<usize>] {
        &self.parts[self.position_ranges..]
    }

    /// Excludes `free_flight_bodies` from a state of `dimension` components, the first `positions` of which are positions.
    fn exclude<'a>(
        &mut self,
        positions: usize,
        dimension: usize,
        free_flight_bodies: impl Iterator<Item = &'a FreeFlightBody> + Clone,
    ) {
        self.parts.clear();
        for (kind, all) in [0..positions, positions..dimension].into_iter().enumerate() {
            let mut from = all.start;
            for body in free_flight_bodies.clone() {
                let part = &body.parts()[kind];
                if from < part.start {
                    self.parts.push(from..part.start);
                }
                from = part.end;
            }
            if from < all.end {
                self.parts.push(from..all.end);
            }
            if kind == 0 {
                self.position_ranges = self.parts.len();
            }
        }
    }
}

/// A free body in free flight.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Flight {
    /// Start, and end of the series' validity, s.
    start: f64,
    end: f64,
    /// Position and velocity of the centroid at the start, m and m/s.
    position: Vec3,
    velocity: Vec3,
    /// Gravity, m/s^2.
    gravity: Vec3,
    /// Coefficients of the quaternion (w, x, y, z).
    turn: [[f64; 4]; ORDER + 1],
    /// Coefficients of the angular velocity in body axes, rad/s, from Euler's equations without torque.
    spin: [Vec3; ORDER + 1],
}

impl Flight {
    /// Flight of `body` from its position coordinates `q` and velocity coordinates `v` at `t`.
    pub(super) fn new(body: &Body, gravity: &Vec3, t: f64, q: &[f64; 7], v: &[f64; 6]) -> Self {
        let [x, y, z, unit @ ..] = q;
        let [vx, vy, vz, wx, wy, wz] = *v;
        let mut turn = [[0.0; 4]; ORDER + 1];
        let mut spin = [Vec3::zeros(); ORDER + 1];
        let mut momentum = [Vec3::zeros(); ORDER + 1];
        turn[0] = *unit;
        spin[0] = rotation_of(unit).tr_mul(&Vec3::new(wx, wy, wz));
        for n in 0..ORDER {
            momentum[n] = body.inertia * spin[n];
            let mut torque = Vec3::zeros();
            let mut rate = [0.0; 4];
            for i in 0..=n {
                torque += momentum[i].cross(&spin[n - i]);
                let ([w, x, y, z], s) = (&turn[i], &spin[n - i]);
                rate[0] -= x * s.x + y * s.y + z * s.z;
                rate[1] += w * s.x + y * s.z - z * s.y;
                rate[2] += w * s.y + z * s.x - x * s.z;
                rate[3] += w * s.z + x * s.y - y * s.x;
            }
            let next = 1.0 / (n + 1) as f64;
            spin[n + 1] = body.inertia_inverse * torque * next;
            turn[n + 1] = rate.map(|rate| 0.5 * next * rate);
        }
        // Checks the last two terms, because one may vanish by symmetry.
        let mut length = LONGEST;
        for n in [ORDER - 1, ORDER] {
            let turns = turn[n].iter().map(|c| c * c).sum::<f64>().sqrt();
            let size = turns.max(spin[n].norm() / spin[0].norm().max(1.0));
            length = length.min(libm::pow(LAST_TERM / size, 1.0 / n as f64));
        }
        Self {
            start: t,
            end: t + length,
            position: Vec3::new(*x, *y, *z),
            velocity: Vec3::new(vx, vy, vz),
            gravity: *gravity,
            turn,
            spin,
        }
    }

    /// Whether the series are valid at `t`.
    pub(crate) fn is_valid_at(&self, t: f64) -> bool {
        t <= self.end
    }

    /// Writes the coordinates of `body` at `t` to the state `y`.
    pub(crate) fn write_state(&self, body: &FreeFlightBody, t: f64, y: &mut [f64]) {
        let s = t - self.start;
        let mut turn = self.turn[ORDER];
        let mut spin = self.spin[ORDER];
        for n in (0..ORDER).rev() {
            for i in 0..4 {
                turn[i] = self.turn[n][i] + s * turn[i];
            }
            spin = self.spin[n] + spin * s;
        }
        let position = self.position + (self.velocity + self.gravity * (0.5 * s)) * s;
        let velocity = self.velocity + self.gravity * s;
        let spin = rotation_of(&turn) * spin;
        let [q, v] = body.parts();
        y[q.start..q.start + 3].copy_from_slice(position.as_slice());
        y[q.start + 3..q.end].copy_from_slice(&turn);
        y[v.start..v.start + 3].copy_from_slice(velocity.as_slice());
        y[v.start + 3..v.end].copy_from_slice(spin.as_slice());
    }
}

impl Mechanism {
    /// Bodies capable of free flight.
    pub(crate) fn free_flight_bodies(&self) -> &[FreeFlightBody] {
        &self.free_flight_bodies
    }

    /// Bodies of contact `c` that are capable of free flight.
    pub(crate) fn free_flight_bodies_of(&self, c: ContactId) -> impl Iterator<Item = usize> + use<> {
        let site = &self.model.sites[c];
        let of = |b: BodyIndex| self.free_flight_bodies.binary_search_by_key(&b, |body| body.body).ok();
        [of(site.carried.body), of(site.carrier.body)].into_iter().flatten()
    }

    /// Free flight of `body` from the state `y` at `t`.
    pub fn flight(&self, body: &FreeFlightBody, t: f64, y: &[f64]) -> Flight {
        let compiled = &self.model.bodies[body.body];
        Flight::new(compiled, &self.gravity, t, part(y, body.q), part(y, body.v))
    }

    /// Lets evaluations skip the free-flight bodies for whose index `suspended` holds.
    pub fn suspend(&mut self, suspended: impl Fn(usize) -> bool) {
        let free_flight_bodies = &self.free_flight_bodies;
        let is_suspended = |b: BodyIndex| {
            let index = free_flight_bodies.binary_search_by_key(&b, |body| body.body);
            index.is_ok_and(&suspended)
        };
        self.equations.suspend(&is_suspended);
        self.contacts.skips_inactive = (0..free_flight_bodies.len()).any(&suspended);
        let excluded = free_flight_bodies.iter().enumerate().filter(|(i, _)| suspended(*i));
        let (positions, dimension) = (self.positions(), self.dimension());
        let excluded = excluded.map(|(_, body)| body);
        self.active_ranges.exclude(positions, dimension, excluded);
    }

    /// Components of the state advanced by steps.
    pub fn active_ranges(&self) -> &[Range<usize>] {
        &self.active_ranges.parts
    }

    /// Completes an evaluation at (t, y), with `active_set`: adds the motion of the skipped bodies and all gaps.
    pub(crate) fn complete_gaps(&mut self, active_set: ActiveSet<'_>, y: &[f64]) {
        if self.contacts.skips_inactive {
            self.equations.update_suspended(&self.model, y);
        }
        self.contacts.complete_separations(active_set, self.equations.motion());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::{DormandPrince, Step, Stepper, System};
    use crate::machine::{Attachment, Body, Drive, Joint, JointStart, LooseJoint, Machine, Mat3, Quat};

    /// A slender body tumbling about all its axes.
    fn tumbling() -> (Mechanism, Vec<f64>) {
        let rates = [Vec3::new(1.0, 2.0, -0.5), Vec3::new(3.0, -7.0, 11.0)];
        let mut machine = Machine { gravity: Vec3::new(0.0, -9.81, 0.0), ..Machine::default() };
        let inertia = Mat3::new(1e-4, 2e-5, 1e-5, 2e-5, 5e-4, -3e-5, 1e-5, -3e-5, 5.5e-4);
        let start = JointStart::Pose {
            position: Vec3::new(0.1, 0.2, 0.3),
            rotation: Quat::identity(),
            velocity: rates[0],
            angular_velocity: rates[1],
        };
        machine.add_body(Body::new("rod", 0.3, inertia), Joint { start, ..Joint::free(0) });
        let still = Drive::Constant { position: 0.0, velocity: 0.0 };
        let post = Body::new("post", 1.0, Mat3::identity());
        machine.add_body(post, Joint::prismatic(None, 1, Vec3::z()).with_drive(still));
        let mut mechanism = Mechanism::new(&machine).expect("equations");
        let y = mechanism.start().expect("a start");
        (mechanism, y)
    }

    #[test]
    fn a_flight_agrees_with_the_integrated_equations() {
        let (mut mechanism, mut y) = tumbling();
        let body = mechanism.free_flight_bodies()[0].clone();
        let flight = mechanism.flight(&body, 0.25, &y);
        let length = flight.end - flight.start;
        assert!((1e-3..0.1).contains(&length), "{length}");
        assert!(flight.is_valid_at(0.25 + length) && !flight.is_valid_at(0.25 + 1.01 * length));
        // 400 steps of order 5 leave only rounding errors.
        let (n, mut t) = (400, 0.25);
        let mut stepper = DormandPrince::new(y.len());
        let (mut end, mut k) = (y.clone(), y.clone());
        let mut k_end = y.clone();
        let h = length / f64::from(n);
        let mut equations = mechanism.evaluator(ActiveSet::Nothing);
        equations.derivative(t, &y, &mut k);
        for _ in 0..n {
            stepper.attempt(&mut equations, Step { t, h, y: &y, k: &k }, &mut end, &mut k_end);
            std::mem::swap(&mut y, &mut end);
            std::mem::swap(&mut k, &mut k_end);
            t += h;
        }
        let mut flown = vec![f64::NAN; y.len()];
        flight.write_state(&body, 0.25 + length, &mut flown);
        for part in body.parts() {
            for i in part {
                assert!((flown[i] - y[i]).abs() < 3e-14 * (1.0 + y[i].abs()), "{i}: {} {}", flown[i], y[i]);
            }
        }
    }

    #[test]
    fn bodies_in_flight_are_excluded_from_the_active_ranges() {
        let mut machine = Machine::default();
        for i in 0..4 {
            machine.add_body(Body::new(&format!("b{i}"), 1.0, Mat3::identity()), Joint::free(i));
            let socket = Attachment { body: i.checked_sub(1), point: Vec3::zeros() };
            machine.loose_joints.push(LooseJoint::ball(&format!("S{i}"), socket, Attachment::on(i, Vec3::zeros())));
        }
        let mut mechanism = Mechanism::new(&machine).expect("equations");
        let dimension = mechanism.dimension();
        for flying in [&[][..], &[1], &[0, 1, 3], &[0, 1, 2, 3]] {
            mechanism.suspend(|index| flying.contains(&index));
            let mut moves = vec![false; dimension];
            for part in mechanism.active_ranges().iter().cloned() {
                assert!(!part.is_empty());
                for i in part {
                    assert!(!std::mem::replace(&mut moves[i], true), "{i} twice");
                }
            }
            for (i, body) in mechanism.free_flight_bodies().iter().enumerate() {
                for component in body.parts().into_iter().flatten() {
                    assert_eq!(moves[component], !flying.contains(&i), "{flying:?}");
                }
            }
            let excluded = moves.iter().filter(|moves| !**moves).count();
            assert_eq!(excluded, 13 * flying.len());
            let position_ranges = mechanism.active_ranges.positions().last();
            assert!(position_ranges.is_none_or(|part| part.end <= mechanism.positions()));
            let of_velocities = mechanism.active_ranges.velocities().first();
            assert!(of_velocities.is_none_or(|part| part.start >= mechanism.positions()));
        }
    }

    #[test]
    fn a_flight_starts_at_its_state_and_conserves_energy_and_angular_momentum() {
        let (mechanism, y) = tumbling();
        let body = &mechanism.free_flight_bodies()[0];
        let flight = mechanism.flight(body, 0.0, &y);
        let compiled = &mechanism.model.bodies[body.body];
        let invariants = |y: &[f64]| {
            let [q, v] = body.parts();
            let turn: &[f64; 4] = part(y, q.start + 3);
            let r = rotation_of(turn);
            let w = r.tr_mul(&Vec3::new(y[v.start + 3], y[v.start + 4], y[v.start + 5]));
            let energy = 0.5 * w.dot(&(compiled.inertia * w));
            let length: f64 = turn.iter().map(|c| c * c).sum();
            (r * (compiled.inertia * w), energy, length)
        };
        let mut flown = y.clone();
        flight.write_state(body, 0.0, &mut flown);
        for (a, b) in flown.iter().zip(&y) {
            assert!((a - b).abs() < 1e-15 * (1.0 + b.abs()), "{a} {b}");
        }
        let (momentum, energy, _) = invariants(&y);
        flight.write_state(body, flight.end, &mut flown);
        let (momentum_end, energy_end, length) = invariants(&flown);
        assert!((momentum_end - momentum).norm() < 1e-14 * momentum.norm());
        assert!((energy_end - energy).abs() < 1e-14 * energy);
        assert!((length - 1.0).abs() < 1e-15);
        // A parabola.
        let s = flight.end;
        let expected = Vec3::new(0.1 + s, 0.2 + 2.0 * s - 0.5 * 9.81 * s * s, 0.3 - 0.5 * s);
        let got = Vec3::from_column_slice(&flown[body.q..body.q + 3]);
        assert!((got - expected).norm() < 1e-15, "{got}");
    }

    #[test]
    fn series_are_valid_for_a_shorter_time_at_higher_spin() {
        let (mechanism, mut y) = tumbling();
        let body = &mechanism.free_flight_bodies()[0];
        let spin = body.v + 3..body.v + 6;
        let length = |factor: f64| {
            let mut y = y.clone();
            y[spin.clone()].iter_mut().for_each(|w| *w *= factor);
            mechanism.flight(body, 0.0, &y).end
        };
        let (slow, fast) = (length(1.0), length(4.0));
        assert!((slow / fast - 4.0).abs() < 0.5, "{slow} {fast}");
        y[spin].fill(0.0);
        assert_eq!(mechanism.flight(body, 0.0, &y).end, LONGEST);
    }
}
