//! Linearised friction of balls in contact, the stiff term that limits an explicit step while a ball creeps under load.
//!
//! On the ramp of its friction law, a joint under the load F_N responds to sliding like a damper of mu F_N / v_theta. Let S be
//! the velocity of a contact point per velocity coordinate, and W that of the slip velocity. Then dQ/dv = sum S_c^T B_c W_c, with
//! three rows per contact. Solving (s I - M^-1 dQ/dv) x = b thus needs no matrix of the size of the mechanism: the velocities
//! w_c = W_c x satisfy s w_c - sum_d H_cd B_d w_d = W_c b with H_cd = W_c M^-1 S_d^T, and x = (b + M^-1 sum S_c^T B_c w_c) / s.
//!
//! The force of a contact may grow many times over within a step. A W-method admits any B, but too large a B only adds damping,
//! while one too small by half is unstable. So B uses the larger of the loads at both ends of the step, as predicted from the
//! approach velocity.

use super::MechanismError;
use super::band::Band;
use super::bounds::{Advice, Cost, CostOf};
use super::columns::{Column, collect_columns, contact_sides};
use super::contacts::Contacts;
use super::elements::ActiveSet;
use super::equations::Equations;
use super::flight::ActiveRanges;
use super::model::{BallJoint, Model};
use crate::contact::{Coefficients, ContactState, Slope};
use crate::integrate::{Method, add_scaled, copy, divide};
use crate::machine::{Mat3, Vec3};

/// Coupling between a contact and one of the trees it acts on.
struct TreePart {
    /// Coordinate range of the tree.
    range: (usize, usize),
    /// Coordinates that move the contact, and the slip velocity per unit rate of each.
    reads: Vec<(usize, Vec3)>,
    /// M^-1 S^T.
    weighted: Vec<Vec3>,
}

impl TreePart {
    fn new(range: (usize, usize)) -> Self {
        let n = range.1 - range.0;
        Self { range, reads: Vec::with_capacity(n), weighted: vec![Vec3::zeros(); n] }
    }
}

/// A ball with play.
struct Touch {
    joint: usize,
    law: Coefficients,
    contact_state: ContactState,
    /// Eccentricity, m, its rate and the slip velocity, m/s.
    eccentricity: Vec3,
    rate: Vec3,
    read: Vec3,
    /// Trees it acts on.
    trees: Vec<TreePart>,
    /// B, N s/m.
    resistance: Mat3,
}

impl Touch {
    /// Sets B = dF/dw for the larger of the loads now and `h`, s, later.
    fn resist(&mut self, h: f64) {
        let later = self.law.separation(&self.eccentricity, &self.rate).rate > 0.0;
        let ahead = if later { h } else { 0.0 };
        let eccentricity = self.eccentricity + self.rate * ahead;
        let at = self.law.separation(&eccentricity, &self.rate);
        self.resistance = Mat3::zeros();
        if at.penetration <= 0.0 {
            return;
        }
        let force = self.law.force(&self.contact_state, &at, || self.read);
        if force.normal > 0.0 {
            let slope = Slope::Secant;
            let of = self.law.linearise(&self.contact_state, &at, &self.rate, &self.read, &force, slope);
            self.resistance = of.by_slip;
        }
    }

    /// Slip velocity for the velocities `x`.
    fn reading(&self, x: &[f64]) -> Vec3 {
        let reads = self.trees.iter().flat_map(|tree| &tree.reads);
        reads.fold(Vec3::zeros(), |sum, (coordinate, read)| sum + read * x[*coordinate])
    }

    /// Adds M^-1 S^T `force` to `x`.
    fn push(&self, force: &Vec3, x: &mut [f64]) {
        for tree in &self.trees {
            let (first, end) = tree.range;
            for (x, by) in x[first..end].iter_mut().zip(&tree.weighted) {
                *x += by.dot(force);
            }
        }
    }

    fn on(&self, range: (usize, usize)) -> Option<&TreePart> {
        self.trees.iter().find(|tree| tree.range == range)
    }

    /// Whether both contacts act on a common tree.
    fn meets(&self, other: &Self) -> bool {
        self.trees.iter().any(|tree| other.on(tree.range).is_some())
    }

    /// W M^-1 S^T for the forces of `other`.
    fn mobility(&self, other: &Self) -> Mat3 {
        let mut sum = Mat3::zeros();
        for tree in &self.trees {
            let Some(pushed) = other.on(tree.range) else {
                continue;
            };
            for (coordinate, read) in &tree.reads {
                sum += read * pushed.weighted[coordinate - tree.range.0].transpose();
            }
        }
        sum
    }
}

/// The linearisation and its factors.
pub struct Friction {
    n: usize,
    /// Whether a force accelerates only the trees it acts on.
    within: bool,
    /// Every ball with play, and the indices of those in contact.
    touches: Vec<Touch>,
    active: Vec<usize>,
    /// Contacts for which the band is arranged.
    arranged: Vec<usize>,
    /// Touches further apart in their order are not coupled.
    band: Band,
    /// s I - H B, factored, and H in the same layout.
    blocks: Vec<Mat3>,
    mobility: Vec<Mat3>,
    right: Vec<Vec3>,
    shift: f64,
    y: Vec<f64>,
    rate: Vec<f64>,
    scratch: Vec<f64>,
    columns: Vec<Column>,
    /// First touch on each tree.
    first_on: Vec<usize>,
    /// df/dt: friction depends on the state alone.
    pub time_derivative: Vec<f64>,
    /// Scratch for the derivative at the point of linearisation.
    pub derivative: Vec<f64>,
}

impl Friction {
    /// For `velocities` velocity coordinates in a state of `dimension`. With `within`, a force accelerates only the trees it acts
    /// on; otherwise all coordinates.
    ///
    /// # Errors
    /// The contacts are coupled too widely.
    pub fn new(
        model: &Model,
        contacts: &Contacts,
        velocities: usize,
        dimension: usize,
        within: bool,
    ) -> Result<Self, MechanismError> {
        let ranges = |joint: &BallJoint| {
            if !within {
                return vec![(0, velocities)];
            }
            let mut ranges = Vec::with_capacity(2);
            for body in [joint.ball.body, joint.socket.body] {
                if body < model.bodies.len() && !model.bodies[body].driven_only {
                    let block = &model.blocks[model.block_of[body]];
                    let range = (block.v, block.v + block.n);
                    if !ranges.contains(&range) {
                        ranges.push(range);
                    }
                }
            }
            ranges
        };
        let width = |&(first, end): &(usize, usize)| end - first;
        let loose = (0..contacts.len()).filter(|&j| contacts.has_clearance(j));
        let of: Vec<_> = loose.map(|j| (j, ranges(&model.joints[j]))).collect();
        let mut friction = Self {
            n: velocities,
            within,
            touches: Vec::new(),
            active: Vec::with_capacity(of.len()),
            arranged: Vec::with_capacity(of.len()),
            band: Band::default(),
            blocks: Vec::new(),
            mobility: Vec::new(),
            right: Vec::with_capacity(of.len()),
            shift: 1.0,
            y: vec![0.0; dimension],
            rate: vec![0.0; dimension - velocities],
            scratch: vec![0.0; velocities],
            columns: Vec::with_capacity(velocities),
            first_on: vec![usize::MAX; velocities + 1],
            time_derivative: vec![0.0; dimension],
            derivative: vec![0.0; dimension],
        };
        let trees = of.iter().map(|(_, ranges)| ranges.iter().copied());
        let reach = reach_of(trees, &mut friction.first_on);
        let widths = of.iter().flat_map(|(_, ranges)| ranges).map(width).sum();
        Cost::of_coupled_contacts(of.len(), reach, widths)
            .check(CostOf::CoupledContacts, Advice::Method(Method::DormandPrince5))?;
        let touch = |(joint, ranges): (usize, Vec<(usize, usize)>)| Touch {
            joint,
            law: *contacts.coefficients(joint),
            contact_state: ContactState::default(),
            eccentricity: Vec3::zeros(),
            rate: Vec3::zeros(),
            read: Vec3::zeros(),
            trees: ranges.into_iter().map(TreePart::new).collect(),
            resistance: Mat3::zeros(),
        };
        friction.band = Band::with_room(of.len(), reach);
        let size = Band::places(of.len(), reach);
        friction.touches = of.into_iter().map(touch).collect();
        friction.blocks.reserve_exact(size);
        friction.mobility.reserve_exact(size);
        Ok(friction)
    }

    /// Collects the balls in contact from the gaps of the evaluation just made at `y`.
    pub fn gather(
        &mut self,
        model: &Model,
        contacts: &Contacts,
        touching: ActiveSet<'_>,
        equations: &mut dyn Equations,
        y: &[f64],
    ) {
        self.y.copy_from_slice(y);
        self.active.clear();
        for (slot, touch) in self.touches.iter_mut().enumerate() {
            let contact = contacts.joint(touch.joint);
            let contact_state = touching.contact_state(touch.joint);
            let Some(contact_state) = contact_state.filter(|_| contact.law.friction > 0.0) else {
                continue;
            };
            if contact.gap.eccentricity == Vec3::zeros() {
                continue;
            }
            self.active.push(slot);
            let n = contact.direction();
            touch.law = contact.law;
            touch.contact_state = *contact_state;
            touch.eccentricity = contact.gap.eccentricity;
            touch.rate = contact.gap.eccentricity_rate;
            touch.read = contact.slip_velocity(&n, equations.motion());
            let sides = contact_sides(&contact.joint, &contact.law);
            collect_columns(&mut self.columns, model, equations, &sides, &n);
            let surfaces = touch.law.uses_surface_velocity();
            for tree in &mut touch.trees {
                let (first, end) = tree.range;
                let here = |c: &&Column| (first..end).contains(&c.coordinate);
                let read = |c: &Column| if surfaces { c.surface } else { c.centre };
                let columns = self.columns.iter().filter(here);
                tree.reads.clear();
                tree.reads.extend(columns.clone().map(|c| (c.coordinate, read(c))));
                for i in 0..3 {
                    self.scratch[first..end].fill(0.0);
                    for column in columns.clone() {
                        self.scratch[column.coordinate] = column.surface[i];
                    }
                    if self.within {
                        equations.apply_inverse_mass_within(model, (first, end), &mut self.scratch);
                    } else {
                        equations.apply_inverse_mass(model, &mut self.scratch);
                    }
                    for (weighted, x) in tree.weighted.iter_mut().zip(&self.scratch[first..end]) {
                        weighted[i] = *x;
                    }
                }
            }
        }
        if self.active != self.arranged {
            self.arrange();
        }
        self.couple();
    }

    /// Number of balls in contact.
    pub fn touching(&self) -> usize {
        self.active.len()
    }

    fn arrange(&mut self) {
        let touch = |i: usize| &self.touches[self.active[i]];
        let size = self.active.len();
        let trees = (0..size).map(|i| touch(i).trees.iter().map(|tree| tree.range));
        let reach = reach_of(trees, &mut self.first_on);
        self.band.arrange(size, reach, |i, j| touch(i).meets(touch(j)));
        self.arranged.clone_from(&self.active);
    }

    fn couple(&mut self) {
        let band = &self.band;
        self.mobility.clear();
        self.mobility.resize(band.len(), Mat3::zeros());
        self.blocks.clear();
        self.blocks.resize(band.len(), Mat3::zeros());
        self.right.clear();
        self.right.resize(band.size(), Vec3::zeros());
        for i in 0..band.size() {
            for j in band.row(i) {
                let [one, other] = [i, j].map(|i| &self.touches[self.active[i]]);
                self.mobility[band.at(i, j)] = one.mobility(other);
            }
        }
    }

    /// Prepares to solve with the shift s for a step of size `h`.
    pub fn factor(&mut self, shift: f64, h: f64) {
        self.shift = shift;
        let band = &self.band;
        for &slot in &self.active {
            self.touches[slot].resist(h);
        }
        for i in 0..band.size() {
            for j in band.row(i) {
                let mut block = self.mobility[band.at(i, j)] * -self.touches[self.active[j]].resistance;
                if i == j {
                    block += Mat3::identity() * shift;
                }
                self.blocks[band.at(i, j)] = block;
            }
        }
        band.factor(&mut self.blocks, |_| false);
    }

    /// Bound on the rates at which friction damps sliding, 1/s, in the latest factorisation: the largest row sum of norms of H B
    /// (Gershgorin). Coupling between neighbours may double a contact's own rate.
    pub fn fastest(&self) -> f64 {
        let band = &self.band;
        let norm = |i: usize, j: usize| {
            let resistance = self.touches[self.active[j]].resistance;
            (self.mobility[band.at(i, j)] * resistance).norm()
        };
        let row = |i: usize| band.row(i).map(|j| norm(i, j)).sum();
        (0..band.size()).map(row).fold(0.0, f64::max)
    }

    /// Largest angular frequency, rad/s, of a ball vibrating on its wall at the linearisation, with its neighbours' forces
    /// constant: sqrt(n' H n dF_N/d(delta)), where dF_N/d(delta) = 3/2 F_N/delta (19). The method steps this explicitly.
    pub fn ringing(&self) -> f64 {
        let square = |(i, &slot): (usize, &usize)| {
            let touch = &self.touches[slot];
            let at = touch.law.separation(&touch.eccentricity, &touch.rate);
            if at.penetration <= 0.0 {
                return 0.0;
            }
            let force = touch.law.force(&touch.contact_state, &at, || touch.read);
            let (stiffness, n) = (1.5 * force.normal / at.penetration, at.normal);
            stiffness * n.dot(&(self.mobility[self.band.at(i, i)] * n))
        };
        let squares = self.active.iter().enumerate().map(square);
        squares.fold(0.0, f64::max).sqrt()
    }

    /// Solves (s I - J) x = b in place for the active components.
    pub fn solve(&mut self, b: &mut [f64], moving: &ActiveRanges, equations: &dyn Equations, model: &Model) {
        let positions = b.len() - self.n;
        let b_v = &mut b[positions..];
        for (&slot, right) in self.active.iter().zip(&mut self.right) {
            *right = self.touches[slot].reading(b_v);
        }
        self.band.solve(&self.blocks, &mut self.right, |_| false);
        for (&slot, w) in self.active.iter().zip(&self.right) {
            let touch = &self.touches[slot];
            touch.push(&(touch.resistance * w), b_v);
        }
        divide(moving.velocities(), b, self.shift);
        copy(moving.velocities(), &mut self.y, b);
        equations.position_rate(model, &self.y, &mut self.rate);
        add_scaled(moving.positions(), b, 1.0, &self.rate);
        divide(moving.positions(), b, self.shift);
    }
}

/// Bandwidth of the coupling between touches that act on these trees. `first_on` is scratch, one entry per coordinate.
fn reach_of(
    touches: impl Iterator<Item = impl Iterator<Item = (usize, usize)>> + Clone,
    first_on: &mut [usize],
) -> usize {
    for (first, _) in touches.clone().flatten() {
        first_on[first] = usize::MAX;
    }
    let mut reach = 0;
    for (i, trees) in touches.enumerate() {
        for (first, _) in trees {
            first_on[first] = first_on[first].min(i);
            reach = reach.max(i - first_on[first]);
        }
    }
    reach
}

#[cfg(test)]
mod tests {
    use crate::contact::ContactState;
    use crate::integrate::{FrictionSystem, StiffSystem, System};
    use crate::mechanism::{ActiveSet, Mechanism};
    use crate::scene::Scene;

    /// Without damping: the load, and with it friction, would otherwise depend on the penetration rate, which the linearisation
    /// leaves out.
    fn scene(name: &str, changes: &[(&str, &str)]) -> Scene {
        let own = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
        let elastic = [("contact.restitution", "1"), ("contact.slip_speed_low", "0")];
        let changes: Vec<(String, String)> = elastic.iter().chain(changes).map(own).collect();
        Scene::load(name, &changes).unwrap()
    }

    /// Slip velocity, m/s: so slow that no load is predicted to rise within a step.
    const SLIP: f64 = 2e-8;

    /// Balls that rest 0.2 um deep in their walls and creep along them: two neighbours in a chain, one tree between driven
    /// slides, and the latter with an ideal joint.
    fn resting() -> Vec<(Scene, Vec<f64>)> {
        let deep = 0.3e-3 + 2e-7;
        let chain = scene("chain", &[("chain.links", "3")]);
        let mut hanging = Mechanism::new(&chain.machine).unwrap().start().unwrap();
        let positions = hanging.len() - 18;
        for link in 0..3 {
            let times = f64::from(link as u8 + 1);
            hanging[7 * link + 2] -= times * deep;
            hanging[positions + 6 * link] += times * SLIP;
            hanging[positions + 6 * link + 1] -= times * SLIP;
        }
        let mut all = vec![(chain, hanging)];
        let still = [("spcmm.amplitude_x", "0"), ("spcmm.amplitude_beta", "0")];
        for closed in [&[][..], &[("joint.S2.clearance", "0")]] {
            let spcmm = scene("spcmm", &[&still, closed].concat());
            let mechanism = &mut Mechanism::new(&spcmm.machine).unwrap();
            let mut y = mechanism.start().unwrap();
            y[0] += deep;
            mechanism.project(0.0, &mut y);
            y[mechanism.positions() + 1] += SLIP;
            all.push((spcmm, y));
        }
        all
    }

    /// Derivative of dv/dt for velocities along `x`, by central differences.
    fn along(scene: &Scene, contact_states: &[ContactState], y: &[f64], x: &[f64]) -> Vec<f64> {
        let mut mechanism = Mechanism::new(&scene.machine).unwrap();
        let positions = mechanism.positions();
        let width = 1e-9 / x.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let mut at = |sign: f64| {
            let (mut moved, mut out) = (y.to_vec(), vec![0.0; y.len()]);
            for (v, x) in moved[positions..].iter_mut().zip(x) {
                *v += sign * width * x;
            }
            mechanism.evaluator(ActiveSet::Located(contact_states)).derivative(0.0, &moved, &mut out);
            out.split_off(positions)
        };
        let (plus, minus) = (at(1.0), at(-1.0));
        let of = |(plus, minus): (&f64, &f64)| (plus - minus) / (2.0 * width);
        plus.iter().zip(&minus).map(of).collect()
    }

    #[test]
    fn a_hanging_chain_rings_as_its_links_are_pushed_back() {
        let (scene, y) = resting().swap_remove(0);
        let contact_state =
            ContactState { active: true, approach_speed: 1e-3, floored: true, ..ContactState::default() };
        let contact_state = vec![contact_state; scene.machine.ball_joints.len()];
        let mut mechanism = Mechanism::new(&scene.machine).unwrap();
        mechanism.prepare_friction().unwrap();
        let mut evaluator = mechanism.evaluator(ActiveSet::Located(&contact_state));
        evaluator.friction_alone().linearise(0.0, &y);
        let ringing = mechanism.friction_ringing();
        // Closing acceleration of the lowest joint; the highest, on the world, is stiffer.
        let mut opening = |by: f64| {
            let (mut moved, mut out) = (y.clone(), vec![0.0; y.len()]);
            moved[7 * 2 + 2] -= by;
            let mut evaluator = mechanism.evaluator(ActiveSet::Located(&contact_state));
            evaluator.evaluate_fully(0.0, &moved, &mut out);
            let joint = &mechanism.contacts.joint(2).joint;
            joint.opening_acceleration(mechanism.motion()).z
        };
        let width = 1e-11;
        let expected = ((opening(width) - opening(-width)) / (2.0 * width)).sqrt();
        assert!((ringing / expected - 1.0).abs() < 1e-3, "{ringing} {expected}");
    }

    #[test]
    fn it_solves_with_what_friction_alone_adds_to_the_derivative() {
        for (scene, y) in resting() {
            let name = &scene.name;
            let contact_state =
                ContactState { active: true, approach_speed: 1e-3, floored: true, ..ContactState::default() };
            let contact_state = vec![contact_state; scene.machine.ball_joints.len()];
            let mut mechanism = Mechanism::new(&scene.machine).unwrap();
            let positions = mechanism.positions();
            mechanism.prepare_friction().unwrap();
            let mut evaluator = mechanism.evaluator(ActiveSet::Located(&contact_state));
            let mut system = evaluator.friction_alone();
            system.linearise(0.0, &y);
            let shift = 4e4;
            system.factor_shifted(shift);
            let b: Vec<f64> = (0..y.len()).map(|i| libm::sin(1.0 + i as f64)).collect();
            let mut x = b.clone();
            system.solve_shifted(&mut x);
            assert!(mechanism.friction_rate() > shift, "{name}: not stiff");
            let x_v = &x[positions..];
            let mut smooth = scene.clone();
            for joint in &mut smooth.machine.ball_joints {
                joint.contact.friction = 0.0;
            }
            let with = along(&scene, &contact_state, &y, x_v);
            let without = along(&smooth, &contact_state, &y, x_v);
            let largest = b.iter().fold(0.0_f64, |most, b| most.max(b.abs()));
            for k in 0..x_v.len() {
                let left = shift * x_v[k] - (with[k] - without[k]);
                let off = (left - b[positions + k]).abs();
                let scale = largest + (shift * x_v[k]).abs() + with[k].abs();
                assert!(off < 1e-3 * scale, "{name} {k}: {left:e} {:e}", b[positions + k]);
            }
            let mut rate = vec![0.0; y.len()];
            let mut moving = y.clone();
            moving[positions..].copy_from_slice(x_v);
            mechanism.position_rate(&moving, &mut rate);
            for k in 0..positions {
                assert!((shift * x[k] - b[k] - rate[k]).abs() < 1e-9, "{name} q{k}");
            }
        }
    }
}
