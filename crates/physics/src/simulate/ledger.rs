//! Energy ledger: works by quadrature of powers, compared with the change in energy.

use serde::{Deserialize, Serialize};

use crate::mechanism::Powers;

/// Energy exchanged since the start, J. Each work is computed from the forces that do it, never from energies, so that the
/// imbalance is the integration error: [`Self::residual`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Ledger {
    /// Supplied by the drives: actuator force times rate.
    pub drive_work: f64,
    /// Supplied by gravity: minus the change of its potential.
    pub gravity_work: f64,
    /// Change of the kinetic energy of all bodies.
    pub kinetic_change: f64,
    /// Change of the elastic energy in contacts, with that of bristles, and springs.
    pub elastic_change: f64,
    /// Dissipated by the damping part of the normal forces, with their cut-off at 0 included.
    pub restitution_loss: f64,
    /// Dissipated by friction, from the velocities of the two points where it acts. It may be negative where friction uses
    /// the centres' velocity: the force then drives the surfaces.
    pub friction_loss: f64,
    /// Supplied by clearances that are ramped to a new value or wear: those that grow take energy from the contacts.
    pub clearance_work: f64,
    /// Dissipated by the dampers of force elements.
    pub damping_loss: f64,
    /// Supplied by external loads.
    pub external_work: f64,
    /// Added to the contacts by parameter changes: jumps in their elastic energy.
    pub change_work: f64,
    /// Energy exchanged: half the sum of the magnitudes of all terms over all steps, as each joule leaves one term and
    /// enters another.
    pub exchanged: f64,
    /// Largest sum of kinetic energy and elastic energy in contacts at the end of any step.
    pub held: f64,
}

impl Ledger {
    /// Unaccounted energy, J: positive if energy was created.
    pub fn residual(&self) -> f64 {
        let supplied =
            self.drive_work + self.gravity_work + self.clearance_work + self.change_work + self.external_work;
        let dissipated = self.restitution_loss + self.friction_loss + self.damping_loss;
        self.kinetic_change + self.elastic_change - (supplied - dissipated)
    }

    /// Residual over the energy exchanged; 0 where none was.
    pub fn relative_residual(&self) -> f64 {
        if self.exchanged > 0.0 { self.residual() / self.exchanged } else { 0.0 }
    }

    /// Its terms for outputs, with their names: J, and the relative residual.
    pub fn terms(&self) -> [(&'static str, f64); 13] {
        [
            ("drive_work", self.drive_work),
            ("gravity_work", self.gravity_work),
            ("kinetic_change", self.kinetic_change),
            ("elastic_change", self.elastic_change),
            ("restitution_loss", self.restitution_loss),
            ("friction_loss", self.friction_loss),
            ("clearance_work", self.clearance_work),
            ("damping_loss", self.damping_loss),
            ("external_work", self.external_work),
            ("change_work", self.change_work),
            ("exchanged", self.exchanged),
            ("residual", self.residual()),
            ("relative_residual", self.relative_residual()),
        ]
    }

    /// Magnitude of the residual over [`Self::scale`]; 0 if that is 0.
    pub fn share(&self) -> f64 {
        let scale = self.scale();
        if scale > 0.0 { self.residual().abs() / scale } else { 0.0 }
    }

    /// Energy scale for judging a residual, J. A machine that repeatedly exchanges its energy without losses retains every error:
    /// its exchanged energy grows, but the energy it holds does not. A dissipative machine loses errors with its energy. At rest,
    /// or turning freely, a machine exchanges hardly any energy.
    pub fn scale(&self) -> f64 {
        let lost = [self.restitution_loss, self.friction_loss, self.damping_loss].map(|loss| loss.max(0.0));
        self.held.max(self.exchanged.min(self.held + lost.iter().sum::<f64>()))
    }
}

/// Energies at one instant, J.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Energies {
    pub kinetic: f64,
    pub gravitational: f64,
    pub elastic: f64,
    /// The part of `elastic` stored in contacts.
    pub in_contacts: f64,
}

impl Energies {
    fn held(&self) -> f64 {
        self.kinetic + self.in_contacts
    }
}

/// Largest number of quadrature nodes.
const NODES: usize = 6;
/// Weights of six equidistant instants for the interval between the last two: Adams-Moulton (Hairer, Nørsett & Wanner,
/// *Solving Ordinary Differential Equations I*, III.1).
const EVEN_WEIGHTS: [f64; NODES] =
    [27.0 / 1440.0, -173.0 / 1440.0, 482.0 / 1440.0, -798.0 / 1440.0, 1427.0 / 1440.0, 475.0 / 1440.0];
/// Relative tolerance for treating instants as equidistant: the weights are then accurate to the same order.
const EVEN_TOLERANCE: f64 = 1e-9;

/// Powers at some instants, and their interpolating polynomial.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct PowerInterpolant {
    times: [f64; NODES],
    powers: [Powers; NODES],
    count: usize,
}

impl PowerInterpolant {
    pub(super) fn len(&self) -> usize {
        self.count
    }

    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    /// Adds an instant; drops the oldest if full.
    pub(super) fn push(&mut self, time: f64, powers: Powers) {
        if self.count == NODES {
            self.times.copy_within(1.., 0);
            self.powers.copy_within(1.., 0);
            self.count -= 1;
        }
        self.times[self.count] = time;
        self.powers[self.count] = powers;
        self.count += 1;
    }

    /// Adds an instant, after dropping stored ones less than `apart` before the latest of them.
    pub(super) fn push_apart(&mut self, time: f64, powers: Powers, apart: f64) {
        while let [.., before, latest] = self.times[..self.count]
            && latest - before < apart
        {
            let last = self.count - 1;
            self.times[last - 1] = latest;
            self.powers[last - 1] = self.powers[last];
            self.count = last;
        }
        self.push(time, powers);
    }

    /// The same with times measured from `from` in units of `h`.
    pub(super) fn in_step_time(&self, from: f64, h: f64) -> Self {
        let mut shifted = *self;
        for time in &mut shifted.times[..self.count] {
            *time = (*time - from) / h;
        }
        shifted
    }

    /// Takes `power`, W, which something stores throughout, from what friction dissipates.
    pub(super) fn store_of_friction(&mut self, power: f64) {
        for powers in &mut self.powers[..self.count] {
            powers.friction -= power;
        }
    }

    /// Integral of the polynomial from 0 to `end`.
    pub(super) fn integral(&self, end: f64) -> Powers {
        let mut sum = Powers::default();
        let nodes = &self.times[..self.count];
        let even = |(i, x): (usize, &f64)| (x - (i as f64 - 4.0)).abs() < EVEN_TOLERANCE;
        if end == 1.0 && nodes.len() == NODES && nodes.iter().enumerate().all(even) {
            for (weight, powers) in EVEN_WEIGHTS.iter().zip(&self.powers) {
                sum.add(*weight, powers);
            }
            return sum;
        }
        for (weight, powers) in weights(nodes, end).iter().zip(&self.powers[..nodes.len()]) {
            sum.add(*weight, powers);
        }
        sum
    }
}

/// Quadrature weights at `nodes`, at most six, for the integral from 0 to `end` of the polynomial through the values there.
pub(super) fn weights(nodes: &[f64], end: f64) -> [f64; NODES] {
    let mut weights = [0.0; NODES];
    for (i, x) in nodes.iter().enumerate() {
        // Coefficients of this node's Lagrange polynomial, lowest first.
        let mut coefficients = [0.0; NODES + 1];
        coefficients[0] = 1.0;
        let others = nodes.iter().enumerate().filter(|&(j, _)| j != i);
        for (degree, (_, other)) in others.enumerate() {
            let scale = 1.0 / (x - other);
            for k in (0..=degree + 1).rev() {
                let below = if k > 0 { coefficients[k - 1] } else { 0.0 };
                coefficients[k] = (below - other * coefficients[k]) * scale;
            }
        }
        let terms = (0..nodes.len()).rev();
        weights[i] = terms.fold(0.0, |sum, k| end * (sum + coefficients[k] / (k + 1) as f64));
    }
    weights
}

/// The ledger of a running simulation, at both ends of the latest step: part of its state.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Account {
    /// Whether the ledger is enabled.
    pub on: bool,
    /// Ledger and energies at the start and end of the latest step.
    before: (Ledger, Energies),
    now: (Ledger, Energies),
    /// Powers over the latest step, in step time 0 to 1: the works are integrated from it.
    pub course: PowerInterpolant,
    /// Powers at the ends of past steps, by time, for kinematic scenes.
    pub past: PowerInterpolant,
    /// Current powers, if known.
    pub powers: Option<Powers>,
}

impl Account {
    /// An account that starts with these energies.
    pub(super) fn start(on: bool, energies: Energies) -> Self {
        let entry = (Ledger::default(), energies);
        Self { on, before: entry, now: entry, ..Self::default() }
    }

    /// Whether the counts of stored instants are valid.
    pub(super) fn fits(&self) -> bool {
        self.course.count <= NODES && self.past.count <= NODES
    }

    /// Records a step of size `h` that ends with `energies`, from the powers in `course`.
    pub(super) fn record_step(&mut self, h: f64, energies: Energies) {
        self.before = self.now;
        self.now = (self.within(1.0, h, energies), energies);
    }

    /// Records a change of parameters that leaves the motion unchanged; `energies` are those with the new parameters.
    pub(super) fn record_change(&mut self, energies: Energies) {
        let (ledger, before) = &mut self.now;
        let jump = energies.elastic - before.elastic;
        ledger.change_work += jump;
        ledger.elastic_change += jump;
        ledger.exchanged += jump.abs();
        *before = energies;
        self.before = self.now;
        self.powers = None;
        self.course.clear();
        self.past.clear();
    }

    /// Records that clearances moved at the end of the latest step, which leaves the motion unchanged; `energies` are those
    /// with the new ones.
    pub(super) fn record_moved_clearances(&mut self, energies: Energies) {
        let (ledger, before) = &mut self.now;
        let jump = energies.elastic - before.elastic;
        ledger.clearance_work += jump;
        ledger.elastic_change += jump;
        ledger.exchanged += jump.abs();
        *before = energies;
    }

    /// Sum of the magnitudes of the energies at the end of the latest step, J.
    pub(super) fn energy(&self) -> f64 {
        let Energies { kinetic, gravitational, elastic, .. } = self.now.1;
        kinetic + gravitational.abs() + elastic.abs()
    }

    /// Ledger at the end of the latest step.
    pub(super) fn ledger(&self) -> &Ledger {
        &self.now.0
    }

    /// Ledger at fraction `theta` of the latest step, of size `h`, where the energies are `energies`.
    pub(super) fn within(&self, theta: f64, h: f64, energies: Energies) -> Ledger {
        let (ledger, start) = &self.before;
        let mut works = Powers::default();
        works.add(h, &self.course.integral(theta));
        with_exchanges(ledger, start, energies, &works)
    }
}

/// `ledger` plus the exchanges since the energies were `start`.
fn with_exchanges(ledger: &Ledger, start: &Energies, end: Energies, works: &Powers) -> Ledger {
    let gravity = start.gravitational - end.gravitational;
    let kinetic = end.kinetic - start.kinetic;
    let elastic = end.elastic - start.elastic;
    let moved = works.drive.abs()
        + gravity.abs()
        + kinetic.abs()
        + elastic.abs()
        + works.restitution.abs()
        + works.friction.abs()
        + works.clearance.abs()
        + works.damping.abs()
        + works.external.abs();
    Ledger {
        drive_work: ledger.drive_work + works.drive,
        gravity_work: ledger.gravity_work + gravity,
        kinetic_change: ledger.kinetic_change + kinetic,
        elastic_change: ledger.elastic_change + elastic,
        restitution_loss: ledger.restitution_loss + works.restitution,
        friction_loss: ledger.friction_loss + works.friction,
        clearance_work: ledger.clearance_work + works.clearance,
        damping_loss: ledger.damping_loss + works.damping,
        external_work: ledger.external_work + works.external,
        change_work: ledger.change_work,
        exchanged: ledger.exchanged + 0.5 * moved,
        held: ledger.held.max(start.held()).max(end.held()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drive(power: f64) -> Powers {
        Powers { drive: power, ..Powers::default() }
    }

    #[test]
    fn the_integral_of_powers_is_that_of_their_interpolating_polynomial() {
        // A polynomial of degree 5 through six non-equidistant instants, four of them before the interval.
        let p = |t: f64| 1.0 + t * (2.0 - t * (3.0 - t * (0.5 + t * (0.25 - t))));
        let integral = |t: f64| t + t * t - t.powi(3) + 0.125 * t.powi(4) + 0.05 * t.powi(5) - t.powi(6) / 6.0;
        let mut course = PowerInterpolant::default();
        for t in [-9.0, -0.9, -0.5, -0.2, 0.0, 0.299] {
            course.push_apart(t, drive(p(t)), 1e-2);
        }
        course.push_apart(0.3, drive(p(0.3)), 1e-2);
        course.push_apart(1.0, drive(p(1.0)), 1e-2);
        assert_eq!(course.len(), NODES, "the oldest is forgotten");
        let shifted = course.in_step_time(0.3, 0.7);
        let expected = [-8.0 / 7.0, -5.0 / 7.0, -3.0 / 7.0, 0.0, 1.0];
        for (time, expected) in shifted.times[1..].iter().zip(expected) {
            assert!((time - expected).abs() < 1e-15);
        }
        for end in [1.0, 0.5, 0.0, -0.5] {
            let got = 0.7 * shifted.integral(end).drive;
            let expected = integral(0.3 + 0.7 * end) - integral(0.3);
            assert!((got - expected).abs() < 1e-13, "{got} {expected}");
        }
    }

    #[test]
    fn weights_of_equidistant_instants_are_those_of_the_interpolating_polynomial() {
        for (i, weight) in EVEN_WEIGHTS.into_iter().enumerate() {
            let (mut even, mut uneven) = (PowerInterpolant::default(), PowerInterpolant::default());
            for j in 0..NODES {
                let (time, power) = (j as f64 - 4.0, if i == j { 1.0 } else { 0.0 });
                even.push(time, drive(power));
                // Just uneven enough not to count as equidistant.
                let off = if j == 0 { 1e-8 } else { 0.0 };
                uneven.push(time + off, drive(power));
            }
            assert_eq!(even.integral(1.0).drive, weight);
            assert!((uneven.integral(1.0).drive - weight).abs() < 1e-7);
        }
    }

    #[test]
    fn weights_at_the_nodes_of_simpson_and_radau_are_theirs() {
        let weight = |times: &[f64], which: usize| {
            let mut course = PowerInterpolant::default();
            for (i, &t) in times.iter().enumerate() {
                course.push(t, drive(if i == which { 1.0 } else { 0.0 }));
            }
            course.integral(1.0).drive
        };
        for (i, expected) in [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0].into_iter().enumerate() {
            assert!((weight(&[0.0, 0.5, 1.0], i) - expected).abs() < 1e-15);
        }
        let [c1, c2] = crate::integrate::Radau::INTERIOR;
        let root = 6.0_f64.sqrt();
        // Hairer & Wanner II, (IV.5.9).
        let radau = [(16.0 - root) / 36.0, (16.0 + root) / 36.0, 1.0 / 9.0];
        for (i, expected) in radau.into_iter().enumerate() {
            assert!((weight(&[c1, c2, 1.0], i) - expected).abs() < 1e-14);
        }
    }

    #[test]
    fn unrecorded_energy_is_the_residual() {
        let at = |kinetic: f64, gravitational: f64| Energies { kinetic, gravitational, ..Energies::default() };
        let mut account = Account::start(true, at(0.0, 1.0));
        account.course.push(0.0, drive(2.0));
        // 2 J from the drive and 1 J from gravity, of which 2.75 J arrive.
        account.record_step(1.0, at(2.75, 0.0));
        let ledger = account.ledger();
        assert_eq!(ledger.residual(), -0.25);
        assert_eq!((ledger.exchanged, ledger.held, ledger.scale()), (0.5 * 5.75, 2.75, 2.75));
        let half = account.within(0.5, 1.0, at(1.5, 0.5));
        assert_eq!((half.residual(), half.drive_work), (0.0, 1.0));
        // 4 J of elastic energy from a stiffer contact.
        account.record_change(Energies { kinetic: 2.75, gravitational: 7.0, elastic: 4.0, in_contacts: 4.0 });
        assert_eq!(account.ledger().change_work, 4.0);
        assert_eq!(account.ledger().residual(), -0.25);
    }
}
