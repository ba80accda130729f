//! Free flight: a free body that nothing but gravity acts on, by the Taylor series of its motion. Between two contacts the
//! whole motion is then known at the cost of one evaluation, to rounding.

use super::kinematics::{part, rotation_of};
use super::model::{Body, BodyIndex, Motion};
use super::{Mechanism, Touching};
use std::ops::Range;

use crate::scene::{Formulation, Scene, Vec3};

/// Order of the series in time.
const ORDER: usize = 10;
/// Largest part of a unit quaternion, and of the angular velocity, that the last term of a series may contribute.
const LAST_TERM: f64 = 1e-17;
/// The longest flight, s.
const LONGEST: f64 = 0.1;

/// A free body that nothing but contacts, gravity and the hand ever loads.
#[derive(Clone, Debug)]
pub struct Flyer {
    /// Its index.
    pub body: BodyIndex,
    /// Ball joints of which it carries the ball or the socket.
    pub joints: Vec<usize>,
    q: usize,
    v: usize,
}

impl Flyer {
    /// Those of `scene`, none where bodies couple through ideal joints or drives must hold what others do.
    pub(super) fn all(mechanism: &Mechanism, scene: &Scene) -> Vec<Self> {
        let model = &*mechanism.model;
        let separate = mechanism.equations.is_block_diagonal() && mechanism.sources.forces_suffice;
        if !separate || scene.formulation != Formulation::Tree {
            return Vec::new();
        }
        let loaded = |b: BodyIndex| {
            let mut points = scene.elements.iter().flat_map(|element| &element.points);
            points.any(|point| point.body == Some(b))
        };
        let lone = model.blocks.iter().filter_map(|block| block.lone);
        // In the order of their bodies, as blocks are.
        let flyer = |body: BodyIndex| {
            let Motion::Free { q, v } = model.bodies[body].motion else {
                return None;
            };
            let joints = model.joints.iter().enumerate().filter_map(|(j, joint)| {
                (joint.ball.body == body || joint.socket.body == body).then_some(j)
            });
            Some(Self {
                body,
                joints: joints.collect(),
                q,
                v: model.nq + v,
            })
        };
        lone.filter(|&b| !loaded(b)).filter_map(flyer).collect()
    }

    /// Its components of a state: positions, then velocities.
    pub fn parts(&self) -> [Range<usize>; 2] {
        [self.q..self.q + 7, self.v..self.v + 6]
    }
}

/// A free body in free flight.
#[derive(Clone, Debug, PartialEq)]
pub struct Flight {
    /// When it began and until when the series hold, s.
    start: f64,
    end: f64,
    /// Of the centroid at the start, m and m/s.
    position: Vec3,
    velocity: Vec3,
    /// m/s^2.
    gravity: Vec3,
    /// Coefficients of the quaternion (w, x, y, z).
    turn: [[f64; 4]; ORDER + 1],
    /// Coefficients of the angular velocity in body axes, rad/s: Euler's equations without a torque.
    spin: [Vec3; ORDER + 1],
}

impl Flight {
    /// Of `body` from its position coordinates `q` and velocity coordinates `v` at `t`.
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
        // Of the last two terms, one may vanish by symmetry.
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

    /// Whether it is known until `t`.
    pub fn lasts_until(&self, t: f64) -> bool {
        t <= self.end
    }

    /// Writes the coordinates of `flyer` at `t` to those of the state `y`.
    pub fn put(&self, flyer: &Flyer, t: f64, y: &mut [f64]) {
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
    /// The bodies that may fly.
    pub fn flyers(&self) -> &[Flyer] {
        &self.flyers
    }

    /// Of ball and socket of joint `j`, those that may fly.
    pub fn flyers_of(&self, j: usize) -> impl Iterator<Item = usize> + use<> {
        let joint = &self.model.joints[j];
        let of = |b: BodyIndex| self.flyers.binary_search_by_key(&b, |flyer| flyer.body).ok();
        [of(joint.ball.body), of(joint.socket.body)].into_iter().flatten()
    }

    /// Free flight of `flyer` from the state `y` at `t`.
    pub fn flight(&self, flyer: &Flyer, t: f64, y: &[f64]) -> Flight {
        let body = &self.model.bodies[flyer.body];
        Flight::new(body, &self.gravity, t, part(y, flyer.q), part(y, flyer.v))
    }

    /// Lets evaluations leave out the flyers for which `asleep` holds, by their index.
    pub fn put_to_sleep(&mut self, asleep: impl Fn(usize) -> bool) {
        let flyers = &self.flyers;
        let sleeps = |b: BodyIndex| {
            let flyer = flyers.binary_search_by_key(&b, |flyer| flyer.body);
            flyer.is_ok_and(&asleep)
        };
        self.equations.put_to_sleep(&sleeps);
        self.contacts.only_touching = (0..flyers.len()).any(&asleep);
    }

    /// Completes an evaluation at (t, y), with `touching`, by the motion of the bodies that it left out and all gaps.
    pub fn complete_gaps(&mut self, touching: Touching<'_>, y: &[f64]) {
        if self.contacts.only_touching {
            self.equations.update_asleep(&self.model, y);
            let motion = self.equations.motion();
            self.contacts.measure_others(touching, motion);
        }
        self.contacts.finish();
    }
}
