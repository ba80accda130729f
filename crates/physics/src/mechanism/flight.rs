//! Free flight: Taylor series of the motion of a free body under gravity alone. Between two contacts the whole motion is then
//! known to rounding at the cost of one evaluation.

use serde::{Deserialize, Serialize};

use super::kinematics::{part, rotation_of};
use super::model::{Body, BodyIndex, Motion};
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
    /// Ball joints whose ball or socket is on the body.
    pub joints: Vec<usize>,
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
        let mut joints = vec![Vec::new(); model.bodies.len() + 1];
        for (j, joint) in model.joints.iter().enumerate() {
            joints[joint.ball.body].push(j);
            if joint.socket.body != joint.ball.body {
                joints[joint.socket.body].push(j);
            }
        }
        // In order of body index, like the blocks.
        let lone = model.blocks.iter().filter_map(|block| block.lone);
        let flyer = |body: BodyIndex| match model.bodies[body].motion {
            Motion::Free { q, v } => Some(Self { body, joints: std::mem::take(&mut joints[body]), q, v: model.nq + v }),
            _ => None,
        };
        lone.filter(|&b| !loaded[b]).filter_map(flyer).collect()
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
    of_positions: usize,
}

impl ActiveRanges {
    /// With capacity to exclude this number of bodies.
    pub fn with_room(free_flight_bodies: usize) -> Self {
        Self { parts: Vec::with_capacity(2 * (free_flight_bodies + 1)), of_positions: 0 }
    }

    /// Ranges of positions.
    pub fn positions(&self) -> &[Range<usize>] {
        &self.parts[..self.of_positions]
    }

    /// Ranges of velocities.
    pub fn velocities(&self) -> &[Range<usize>] {
        &self.parts[self.of_positions..]
    }

    /// Excludes `free_flight_bodies` from a state of `dimension` components, the first `positions` of which are positions.
    fn leave_out<'a>(
        &mut self,
        positions: usize,
        dimension: usize,
        free_flight_bodies: impl Iterator<Item = &'a FreeFlightBody> + Clone,
    ) {
        self.parts.clear();
        for (kind, all) in [0..positions, positions..dimension].into_iter().enumerate() {
            let mut from = all.start;
            for flyer in free_flight_bodies.clone() {
                let part = &flyer.parts()[kind];
                if from < part.start {
                    self.parts.push(from..part.start);
                }
                from = part.end;
            }
            if from < all.end {
                self.parts.push(from..all.end);
            }
            if kind == 0 {
                self.of_positions = self.parts.len();
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
    pub fn lasts_until(&self, t: f64) -> bool {
        t <= self.end
    }

    /// Writes the coordinates of `flyer` at `t` to the state `y`.
    pub fn put(&self, flyer: &FreeFlightBody, t: f64, y: &mut [f64]) {
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
        let [q, v] = flyer.parts();
        y[q.start..q.start + 3].copy_from_slice(position.as_slice());
        y[q.start + 3..q.end].copy_from_slice(&turn);
        y[v.start..v.start + 3].copy_from_slice(velocity.as_slice());
        y[v.start + 3..v.end].copy_from_slice(spin.as_slice());
    }
}

impl Mechanism {
    /// Bodies capable of free flight.
    pub fn free_flight_bodies(&self) -> &[FreeFlightBody] {
        &self.free_flight_bodies
    }

    /// Ball and socket bodies of joint `j` that are capable of free flight.
    pub fn flyers_of(&self, j: usize) -> impl Iterator<Item = usize> + use<> {
        let joint = &self.model.joints[j];
        let of = |b: BodyIndex| self.free_flight_bodies.binary_search_by_key(&b, |flyer| flyer.body).ok();
        [of(joint.ball.body), of(joint.socket.body)].into_iter().flatten()
    }

    /// Free flight of `flyer` from the state `y` at `t`.
    pub fn flight(&self, flyer: &FreeFlightBody, t: f64, y: &[f64]) -> Flight {
        let body = &self.model.bodies[flyer.body];
        Flight::new(body, &self.gravity, t, part(y, flyer.q), part(y, flyer.v))
    }

    /// Lets evaluations skip the free-flight bodies for whose index `asleep` holds.
    pub fn suspend(&mut self, asleep: impl Fn(usize) -> bool) {
        let free_flight_bodies = &self.free_flight_bodies;
        let sleeps = |b: BodyIndex| {
            let flyer = free_flight_bodies.binary_search_by_key(&b, |flyer| flyer.body);
            flyer.is_ok_and(&asleep)
        };
        self.equations.suspend(&sleeps);
        self.contacts.only_touching = (0..free_flight_bodies.len()).any(&asleep);
        let left_out = free_flight_bodies.iter().enumerate().filter(|(i, _)| asleep(*i));
        let (positions, dimension) = (self.positions(), self.dimension());
        let left_out = left_out.map(|(_, flyer)| flyer);
        self.moving.leave_out(positions, dimension, left_out);
    }

    /// Components of the state advanced by steps.
    pub fn moving(&self) -> &[Range<usize>] {
        &self.moving.parts
    }

    /// Completes an evaluation at (t, y), with `touching`: adds the motion of the skipped bodies and all gaps.
    pub fn complete_gaps(&mut self, touching: ActiveSet<'_>, y: &[f64]) {
        if self.contacts.only_touching {
            self.equations.update_asleep(&self.model, y);
        }
        self.contacts.finish_all(touching, self.equations.motion());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::{DormandPrince, Stepper, System};
    use crate::scene::Scene;

    /// A slender body tumbling about all its axes.
    fn tumbling() -> (Mechanism, Vec<f64>) {
        let text = r#"
            [gravity]
            y = "-9.81 m/s^2"
            [[body]]
            name = "rod"
            mass = "0.3 kg"
            inertia = "1e-4 5e-4 5.5e-4 kg m^2"
            products = "2e-5 -3e-5 1e-5 kg m^2"
            [[joint]]
            name = "rod"
            kind = "free"
            child = "rod"
            start = { position = "0.1 0.2 0.3 m", velocity = "1 2 -0.5 m/s", angular_velocity = "3 -7 11 rad/s" }
            [[body]]
            name = "post"
            mass = "1 kg"
            inertia = "1e-3 1e-3 1e-3 kg m^2"
            [[joint]]
            name = "post"
            kind = "prismatic"
            child = "post"
            axis = [0, 0, 1]
            drive = { law = "constant", position = 0, velocity = 0 }
        "#;
        let scene = Scene::parse(text, None, &[]).expect("a scene");
        let mut mechanism = Mechanism::new(&scene.machine).expect("equations");
        let y = mechanism.start().expect("a start");
        (mechanism, y)
    }

    #[test]
    fn a_flight_is_the_motion_that_the_equations_give() {
        let (mut mechanism, mut y) = tumbling();
        let flyer = mechanism.free_flight_bodies()[0].clone();
        let flight = mechanism.flight(&flyer, 0.25, &y);
        let length = flight.end - flight.start;
        assert!((1e-3..0.1).contains(&length), "{length}");
        assert!(flight.lasts_until(0.25 + length) && !flight.lasts_until(0.25 + 1.01 * length));
        // 400 steps of order 5 leave only rounding errors.
        let (n, mut t) = (400, 0.25);
        let mut stepper = DormandPrince::new(y.len());
        let (mut end, mut k) = (y.clone(), y.clone());
        let mut k_end = y.clone();
        let h = length / f64::from(n);
        let mut equations = mechanism.evaluator(ActiveSet::Nothing);
        equations.derivative(t, &y, &mut k);
        for _ in 0..n {
            stepper.attempt(&mut equations, t, h, &y, &k, &mut end, &mut k_end);
            std::mem::swap(&mut y, &mut end);
            std::mem::swap(&mut k, &mut k_end);
            t += h;
        }
        let mut flown = vec![f64::NAN; y.len()];
        flight.put(&flyer, 0.25 + length, &mut flown);
        for part in flyer.parts() {
            for i in part {
                assert!((flown[i] - y[i]).abs() < 3e-14 * (1.0 + y[i].abs()), "{i}: {} {}", flown[i], y[i]);
            }
        }
    }

    #[test]
    fn what_flies_is_left_out_of_what_moves() {
        let links = [("chain.links".to_owned(), "4".to_owned())];
        let scene = Scene::load("chain", &links).expect("a scene");
        let mut mechanism = Mechanism::new(&scene.machine).expect("equations");
        let dimension = mechanism.dimension();
        for flying in [&[][..], &[1], &[0, 1, 3], &[0, 1, 2, 3]] {
            mechanism.suspend(|flyer| flying.contains(&flyer));
            let mut moves = vec![false; dimension];
            for part in mechanism.moving().iter().cloned() {
                assert!(!part.is_empty());
                for i in part {
                    assert!(!std::mem::replace(&mut moves[i], true), "{i} twice");
                }
            }
            for (i, flyer) in mechanism.free_flight_bodies().iter().enumerate() {
                for component in flyer.parts().into_iter().flatten() {
                    assert_eq!(moves[component], !flying.contains(&i), "{flying:?}");
                }
            }
            let left_out = moves.iter().filter(|moves| !**moves).count();
            assert_eq!(left_out, 13 * flying.len());
            let of_positions = mechanism.moving.positions().last();
            assert!(of_positions.is_none_or(|part| part.end <= mechanism.positions()));
            let of_velocities = mechanism.moving.velocities().first();
            assert!(of_velocities.is_none_or(|part| part.start >= mechanism.positions()));
        }
    }

    #[test]
    fn a_flight_starts_where_it_is_and_keeps_energy_and_angular_momentum() {
        let (mechanism, y) = tumbling();
        let flyer = &mechanism.free_flight_bodies()[0];
        let flight = mechanism.flight(flyer, 0.0, &y);
        let body = &mechanism.model.bodies[flyer.body];
        let invariants = |y: &[f64]| {
            let [q, v] = flyer.parts();
            let turn: &[f64; 4] = part(y, q.start + 3);
            let r = rotation_of(turn);
            let w = r.tr_mul(&Vec3::new(y[v.start + 3], y[v.start + 4], y[v.start + 5]));
            let energy = 0.5 * w.dot(&(body.inertia * w));
            let length: f64 = turn.iter().map(|c| c * c).sum();
            (r * (body.inertia * w), energy, length)
        };
        let mut flown = y.clone();
        flight.put(flyer, 0.0, &mut flown);
        for (a, b) in flown.iter().zip(&y) {
            assert!((a - b).abs() < 1e-15 * (1.0 + b.abs()), "{a} {b}");
        }
        let (momentum, energy, _) = invariants(&y);
        flight.put(flyer, flight.end, &mut flown);
        let (momentum_end, energy_end, length) = invariants(&flown);
        assert!((momentum_end - momentum).norm() < 1e-14 * momentum.norm());
        assert!((energy_end - energy).abs() < 1e-14 * energy);
        assert!((length - 1.0).abs() < 1e-15);
        // A parabola.
        let s = flight.end;
        let expected = Vec3::new(0.1 + s, 0.2 + 2.0 * s - 0.5 * 9.81 * s * s, 0.3 - 0.5 * s);
        let got = Vec3::from_column_slice(&flown[flyer.q..flyer.q + 3]);
        assert!((got - expected).norm() < 1e-15, "{got}");
    }

    #[test]
    fn faster_spin_makes_flights_shorter_and_none_longest() {
        let (mechanism, mut y) = tumbling();
        let flyer = &mechanism.free_flight_bodies()[0];
        let spin = flyer.v + 3..flyer.v + 6;
        let length = |factor: f64| {
            let mut y = y.clone();
            y[spin.clone()].iter_mut().for_each(|w| *w *= factor);
            mechanism.flight(flyer, 0.0, &y).end
        };
        let (slow, fast) = (length(1.0), length(4.0));
        assert!((slow / fast - 4.0).abs() < 0.5, "{slow} {fast}");
        y[spin].fill(0.0);
        assert_eq!(mechanism.flight(flyer, 0.0, &y).end, LONGEST);
    }
}
