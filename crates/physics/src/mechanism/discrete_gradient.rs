//! A step that solves the contacts: the discrete-gradient rule in velocities, reduced to the contact forces.
//!
//! The unknown is the mean velocity V of the step: v1 = 2 V - v0, and the positions move by h V. Forces other than contact forces
//! are those of the midpoint, at a guess of V, with the mass matrix there: V = v0 + h/2 (a + M^-1 sum S^T F). A contact force
//! depends on its joint's mean relative velocities u of the centres and s of the points in contact alone
//! ([`Coefficients::step_force`]), so that Newton's method needs three rows per contact in place of one per coordinate: F = f(u +
//! h/2 W M^-1 sum S^T F, s + h/2 S M^-1 sum S^T F).
//!
//! No event is located. The eccentricity at the end is that of the guessed motion, plus h W times the change of V.

mod film_rows;

use super::band::Band;
use super::bounds;
use super::columns::{Column, collect_columns, collect_relative_columns};
use super::contacts::Contacts;
use super::coupled::{CoupledRows, add_impulse, apply_inverse_mass, mobility_between};
use super::elements::{ActiveSet, At, Counts, ForceElement, Powers};
use super::equations::Equations;
use super::kinematics::Kinematics;
use super::loose::Wall;
use super::model::{Anchor, ContactId, Model, Site};
use super::systems::Evaluator;
use super::{Latest, Mechanism, MechanismError, elements};
use crate::contact::{Coefficients, ContactState, ContactStep, StepForce};
use crate::integrate::System as _;
use crate::machine::{Mat3, Vec3};
use film_rows::FilmStep;

/// Maximum number of iterations, and of successive cuts of one of them.
const ITERATIONS: u32 = 15;
const CUTS: u32 = 4;
/// Factor of a cut.
const CUT: f64 = 0.4;
/// Change of a velocity at which the iteration ends, unless friction requires a smaller one, m/s or rad/s.
const VELOCITY_TOLERANCE: f64 = 1e-4;
/// The same at a film, which is stiffer, m/s.
const FILM_TOLERANCE: f64 = 1e-6;
/// An element is stepped implicitly if its force changes its own relative motion by at least this fraction over half a step.
const MIN_RELATIVE_CHANGE: f64 = 0.05;
/// Distance of the end from the guessed one, over the scales, beyond which the step is repeated from there.
const GUESS_TOLERANCE: f64 = 1e-5;
/// Speed at which other contacts may push a ball towards its wall within a step, m/s.
const SPEED_MARGIN: f64 = 0.05;

/// How the force of a row of three depends on its mean velocities.
enum Law {
    /// A ball in its socket.
    Contact(Coefficients),
    /// Change of a force element's force, or torque, with its mean relative velocity, N s/m or N m s/rad.
    Element(Mat3),
    /// A station of a film, or its drag.
    Film(FilmStep),
}

/// A row that is solved for: a contact that touches or may within the step, or an element that is stepped
/// implicitly.
struct SolvedRow {
    /// Contacts by index, then two rows per element, for its force and its torque, or of a film one for its drag and one for each station.
    index: usize,
    law: Law,
    step: ContactStep,
    /// Mean normal of the guessed motion, for the lever arms.
    normal: Vec3,
    /// n . W M^-1 S^T n, 1/kg.
    mobility: f64,
    /// Mean velocities with the guessed motion: of the centres, used by friction, and of the surfaces, m/s.
    guessed: [Vec3; 3],
    /// The first two without contact forces.
    free: [Vec3; 2],
    /// Change of these by the contact forces: at present, before the latest iteration, and after it without a cut.
    added: [Vec3; 2],
    before: [Vec3; 2],
    full: [Vec3; 2],
    /// Force and derivatives by the law at the present velocities.
    law_force: StepForce,
    /// Force on the ball at present, before the latest iteration, and after it without a cut, N.
    force: Vec3,
    force_before: Vec3,
    full_force: Vec3,
    /// Mean normal force, N, power dissipated by friction, and normal force times sliding speed, W.
    normal_force: f64,
    friction_power: f64,
    sliding_power: f64,
}

impl SolvedRow {
    fn new(index: usize, law: Law) -> Self {
        let zero = [Vec3::zeros(); 2];
        Self {
            index,
            law,
            step: ContactStep::default(),
            normal: Vec3::zeros(),
            mobility: 0.0,
            guessed: [Vec3::zeros(); 3],
            free: zero,
            added: zero,
            before: zero,
            full: zero,
            law_force: StepForce::default(),
            force: Vec3::zeros(),
            force_before: Vec3::zeros(),
            full_force: Vec3::zeros(),
            normal_force: 0.0,
            friction_power: 0.0,
            sliding_power: 0.0,
        }
    }

    /// The law of a contact, with its row's number.
    fn contact(&self) -> Option<(usize, &Coefficients)> {
        match &self.law {
            Law::Contact(law) => Some((self.index, law)),
            Law::Element(_) | Law::Film(_) => None,
        }
    }

    /// Whether the force found is zero, with its derivatives.
    fn is_open(&self) -> bool {
        self.law_force.force == Vec3::zeros() && self.contact().is_some()
    }

    /// Velocities of the centres, and those used by friction, of [velocities of the centres and of the surfaces](moved_by).
    fn of_motion(&self, [centres, surfaces]: [Vec3; 2]) -> [Vec3; 2] {
        [centres, if self.follows_centres() { centres } else { surfaces }]
    }

    /// Whether friction uses the velocity of the centres.
    fn follows_centres(&self) -> bool {
        matches!(&self.law, Law::Contact(law) if law.has_friction() && !law.uses_surface_velocity())
    }
}

/// Workspace, allocated once.
pub struct DiscreteGradient {
    /// First row of each element, and place of its first among all rows of films.
    first_row: Vec<usize>,
    first_station: Vec<usize>,
    /// Velocity and eccentricity at the start, and eccentricity at the guessed end, of each row of a film, m/s and m.
    stations: Vec<[Vec3; 3]>,
    /// Upper bounds on the effect of a force and a torque of each element on its relative motion, 1/kg and 1/(kg m^2).
    max_mobility: Vec<[f64; 2]>,
    coupled: CoupledRows,
    band: Band,
    /// Rows for which the pattern of the band is set.
    arranged: Vec<usize>,
    rows: Vec<SolvedRow>,
    columns: Vec<Vec<Column>>,
    /// M^-1 S^T: three interleaved columns per row over its spans.
    weighted: Vec<Vec<f64>>,
    blocks: Vec<Mat3>,
    right: Vec<Vec3>,
    /// Effect of the forces on the velocities used by friction in the same band, 1/kg: S M^-1 S^T, or W M^-1 S^T where friction
    /// uses the centres.
    mobility: Vec<Mat3>,
    /// State at the middle and at the end, with the guessed velocities; derivative at the middle.
    middle: Vec<f64>,
    end: Vec<f64>,
    rate: Vec<f64>,
    /// Guessed mean velocity, and the one without contact forces.
    guess: Vec<f64>,
    mean: Vec<f64>,
    displacement: Vec<f64>,
    scratch: Vec<f64>,
    starts: Vec<ContactStart>,
    /// State at the end of the latest step, as measured.
    result: Vec<f64>,
    /// Powers over the step.
    powers: Powers,
}

/// A contact at the start of the step.
#[derive(Clone, Copy, Default)]
struct ContactStart {
    /// e, m.
    eccentricity: Vec3,
    /// Penetration rate and slip velocity, m/s.
    rate: f64,
    slip: Vec3,
    /// Clearances at both ends of the step, m.
    clearances: [f64; 2],
    /// Elastic energy with the clearance at the start, J.
    stored: f64,
}

/// The start of a step.
#[derive(Clone, Copy)]
pub struct StepStart<'a> {
    /// Time, s.
    pub t: f64,
    /// Step size, s.
    pub h: f64,
    /// State.
    pub y: &'a [f64],
    /// Mean rates of the step before.
    pub k: &'a [f64],
    /// Contact states.
    pub contact_states: &'a [ContactState],
    /// [`ContactStep::rebound`] of each contact.
    pub rebounds: &'a [Option<f64>],
}

impl DiscreteGradient {
    /// For a state of `dimension` components, of which `n` are velocities, and elements between these bodies, with so many rows of a film;
    /// `within` if a force accelerates only the trees it acts on.
    ///
    /// # Errors
    /// The contacts are coupled too widely.
    fn new(
        model: &Model,
        dimension: usize,
        n: usize,
        within: bool,
        elements: &[([Anchor; 2], usize)],
    ) -> Result<Self, MechanismError> {
        let contacts = model.sites.len();
        let of_contacts = model.sites.iter().map(|site| [site.carried.body, site.carrier.body]);
        let rows_of = |(_, stations): &([Anchor; 2], usize)| (*stations).max(2);
        let of_elements = elements.iter().flat_map(|element| {
            let bodies = element.0.map(|end| end.body);
            std::iter::repeat_n(bodies, rows_of(element))
        });
        let coupled = CoupledRows::new(model, n, within, of_contacts.chain(of_elements))?;
        let (rows, bandwidth) = (coupled.spans.len(), coupled.bandwidth);
        Ok(Self {
            first_row: places(contacts, elements.iter().map(rows_of)),
            first_station: places(0, elements.iter().map(|(_, rows)| *rows)),
            stations: vec![[Vec3::zeros(); 3]; elements.iter().map(|(_, stations)| stations).sum()],
            max_mobility: elements.iter().map(|(ends, _)| max_mobility(model, ends)).collect(),
            band: Band::with_capacity(rows, bandwidth),
            rows: Vec::with_capacity(rows),
            arranged: Vec::with_capacity(rows),
            columns: coupled.spans.iter().map(|spans| Vec::with_capacity(spans.len())).collect(),
            weighted: coupled.spans.iter().map(|spans| vec![0.0; 3 * spans.len()]).collect(),
            blocks: vec![Mat3::zeros(); Band::max_blocks(rows, bandwidth)],
            right: Vec::with_capacity(rows),
            mobility: vec![Mat3::zeros(); Band::max_blocks(rows, bandwidth)],
            middle: vec![0.0; dimension],
            end: vec![0.0; dimension],
            rate: vec![0.0; dimension],
            guess: vec![0.0; n],
            mean: vec![0.0; n],
            displacement: vec![0.0; n],
            scratch: vec![0.0; n],
            starts: vec![ContactStart::default(); contacts],
            result: vec![0.0; dimension],
            powers: Powers::default(),
            coupled,
        })
    }

    /// Records the start, from the motion just measured.
    fn record_start(&mut self, contacts: &Contacts, motion: &[Kinematics]) {
        for (j, start) in self.starts.iter_mut().enumerate() {
            let gap = contacts.gap(j);
            *start = ContactStart {
                eccentricity: contacts.reach(j),
                rate: gap.separation.rate,
                slip: contacts.slip_velocity(j, &gap.separation.normal, motion),
                clearances: [contacts.clearance(j); 2],
                stored: contacts.coefficients(j).elastic.energy(gap.separation.penetration),
            };
        }
    }

    /// Collects the contacts that touch or may, from the gaps just measured at the guessed end; all of them if `all`.
    fn gather(&mut self, contacts: &Contacts, from: &StepStart<'_>, all: bool) {
        for j in 0..contacts.len() {
            let start = &mut self.starts[j];
            start.clearances[1] = contacts.clearance(j);
            let end = contacts.reach(j);
            let deepest = (start.eccentricity.norm() - start.clearances[0]).max(end.norm() - start.clearances[1]);
            if !all && deepest + SPEED_MARGIN * from.h <= 0.0 {
                continue;
            }
            let law = *contacts.coefficients(j);
            let contact_state = &from.contact_states[j];
            let step = ContactStep {
                h: from.h,
                start: start.eccentricity,
                clearances: start.clearances,
                slip: start.slip,
                bent: Vec3::zeros(),
                approach: if contact_state.active {
                    law.yielded(contact_state.approach_speed)
                } else {
                    law.with_floor(start.rate)
                },
                rebound: from.rebounds[j],
            };
            let mean = (end - start.eccentricity) / from.h;
            let normal = step.mean_normal(&mean);
            self.rows.push(SolvedRow { step, normal, guessed: [mean; 3], ..SolvedRow::new(j, Law::Contact(law)) });
        }
    }

    /// Adds the elements that are stepped implicitly, by their linearisation at the middle.
    fn gather_elements(
        &mut self,
        model: &Model,
        elements: &[Box<dyn ForceElement>],
        equations: &dyn Equations,
        at: &At<'_>,
        h: f64,
    ) {
        for (i, element) in elements.iter().enumerate() {
            if let Some(film) = element.film() {
                self.gather_film(model, film, equations, i, h);
                continue;
            }
            let Some(coupling) = element.coupling(at) else {
                continue;
            };
            let [max_mobility, max_turning_mobility] = self.max_mobility[i];
            let gain = coupling.stiffness.by_displacement * (0.5 * h) + coupling.stiffness.by_rate;
            let torque_gain =
                coupling.torque_derivatives.map(|torque| torque.by_rotation * (0.5 * h) + torque.by_angular_velocity);
            let change =
                gain.norm() * max_mobility + torque_gain.map_or(0.0, |gain| gain.norm() * max_turning_mobility);
            if 0.5 * h * change < MIN_RELATIVE_CHANGE {
                continue;
            }
            let row = self.first_row[i];
            let columns = &mut self.columns[row];
            match torque_gain {
                Some(gain) => {
                    collect_relative_columns(columns, model, equations, &coupling.sides);
                    let Ok([forces, torques]) = self.columns.get_disjoint_mut([row, row + 1]) else {
                        unreachable!("two rows");
                    };
                    torques.clear();
                    let turns = |column: &Column| Column { centre: column.turn, surface: column.turn, ..*column };
                    torques.extend(forces.iter().map(turns));
                    self.rows.push(SolvedRow::new(row + 1, Law::Element(gain)));
                }
                None => collect_columns(columns, model, equations, &coupling.sides, &coupling.normal),
            }
            self.rows.push(SolvedRow::new(row, Law::Element(gain)));
        }
        self.rows.sort_unstable_by_key(|row| row.index);
    }

    /// Jacobian columns of the contacts, and the mean velocities, from the motion at the middle with the guessed velocities.
    fn linearise_rows(&mut self, model: &Model, equations: &dyn Equations, (contacts, bristles): (&Contacts, &[f64])) {
        for row in &mut self.rows {
            let columns = &mut self.columns[row.index];
            if let Law::Contact(law) = &row.law {
                let (contact, n) = (contacts.contact(row.index), row.normal);
                let (site, motion) = (&contact.site, equations.motion());
                row.step.bent = contact.bent(bristles, &n, motion);
                let spins = [site.carried.body, site.carrier.body].map(|body| &motion[body].angular_velocity);
                // Along a bore or a plane the centres move without a change of e, and a worn wall is touched elsewhere at the end.
                let relative = |site: &Site| site.opening(motion, &site.arms(motion)).1;
                let mean = if contact.moves_as_measured() { row.guessed[0] } else { relative(site) };
                let distance = if site.wall == Wall::Socket { 0.0 } else { row.step.mean_distance(&row.guessed[0]) };
                let levers = site.wall.levers(law, distance);
                row.guessed[1] = law.slip_velocity(&n, &mean, spins, levers);
                row.guessed[2] = Coefficients::surface_velocity(&n, &mean, spins, levers);
                collect_columns(columns, model, equations, &site.sides(law, distance, motion), &n);
                if site.wall != Wall::Socket {
                    let confined = site.wall.confined(&motion[site.carrier.body].rotation);
                    columns.iter_mut().for_each(|column| column.centre = confined * column.centre);
                }
            }
            let [centres, slip] = row.of_motion(moved_by(columns, |i| self.mean[i] - self.guess[i]));
            row.free = [row.guessed[0] + centres, row.guessed[1] + slip];
            row.added = [-centres, -slip];
        }
    }

    /// M^-1 S^T of every touch, and the mobility that couples the touches.
    fn compute_mobilities(&mut self, model: &Model, equations: &mut dyn Equations) {
        for row in &self.rows {
            let (row, spans) = (row.index, &self.coupled.spans[row.index]);
            apply_inverse_mass(model, equations, spans, &self.columns[row], &mut self.scratch, &mut self.weighted[row]);
        }
        let Self { band, arranged, rows, coupled, columns, weighted, mobility, .. } = self;
        if !rows.iter().map(|row| row.index).eq(arranged.iter().copied()) {
            let CoupledRows { spans, bandwidth } = &*coupled;
            band.set_pattern(rows.len(), *bandwidth, |i, j| spans[rows[i].index].overlaps(&spans[rows[j].index]));
            arranged.clear();
            arranged.extend(rows.iter().map(|row| row.index));
        }
        for (i, row) in rows.iter().enumerate() {
            let (own, centres) = (&columns[row.index], row.follows_centres());
            for at in band.row(i) {
                let j = band.columns()[at];
                let other = &rows[j];
                let mirrored = j < i && !centres && !other.follows_centres();
                mobility[at] = if mirrored {
                    mobility[band.position(j, i)].transpose()
                } else {
                    mobility_between(own, &weighted[other.index], &coupled.spans[other.index], centres)
                };
            }
        }
        for (i, row) in rows.iter_mut().enumerate() {
            let own = &mobility[band.diagonal(i)];
            row.mobility = row.normal.dot(&(own * row.normal));
            if let Law::Film(step) = &mut row.law {
                step.fit(&row.guessed[0], own);
            }
        }
    }

    /// Contact forces over the step. Returns whether the iteration converged.
    fn solve(&mut self, h: f64, model: &Model, equations: &mut dyn Equations, counts: &mut Counts) -> bool {
        let half = 0.5 * h;
        let laws = self.rows.iter().filter_map(SolvedRow::contact);
        let tolerance = laws.map(|(_, law)| law.slow_sliding()).fold(VELOCITY_TOLERANCE, f64::min);
        let (mut merit, mut cuts, mut part) = (f64::INFINITY, 0, 1.0);
        let mut has_moved_normal_forces = false;
        // An element's row has no law of friction.
        let rows = self.rows.iter().filter_map(SolvedRow::contact).count();
        let blocks = self.band.columns().len();
        counts.algebra += bounds::coupling_time(rows, blocks) as u64;
        for iteration in 0..ITERATIONS {
            counts.contacts += 1;
            counts.algebra += bounds::contact_time(rows, self.band.products()) as u64;
            for row in &mut self.rows {
                let [u, s] = [row.free[0] + row.added[0], row.free[1] + row.added[1]];
                row.law_force = match &row.law {
                    Law::Contact(law) => {
                        let slip_change =
                            if iteration > 0 { (row.added[1] - row.before[1]).norm() } else { f64::INFINITY };
                        let step_force = law.step_force(&row.step, &u, &s, slip_change);
                        counts.friction += u64::from(step_force.force != Vec3::zeros() && law.has_friction());
                        step_force
                    }
                    Law::Film(step) => step.force(&u, &row.guessed[0]),
                    Law::Element(gain) => {
                        StepForce { force: gain * (u - row.guessed[0]), by_velocity: *gain, ..StepForce::default() }
                    }
                };
            }
            if iteration > 0 {
                // Work of each missing force on the velocity that it would cause.
                let mismatch = |(i, row): (usize, &SolvedRow)| {
                    let force = row.law_force.force - row.force;
                    force.dot(&(self.mobility[self.band.diagonal(i)] * force))
                };
                let now: f64 = self.rows.iter().enumerate().map(mismatch).sum();
                if !(now <= merit) && cuts < CUTS {
                    cuts += 1;
                    part *= CUT;
                    for row in &mut self.rows {
                        row.force = row.force_before + (row.full_force - row.force_before) * part;
                        row.added = [0, 1].map(|q| row.before[q] + (row.full[q] - row.before[q]) * part);
                    }
                    continue;
                }
                (merit, cuts, part) = (now, 0, 1.0);
            }
            self.eliminate(half);
            let change = self.apply_forces(half);
            if !change.is_finite() {
                return false;
            }
            if change < tolerance {
                if has_moved_normal_forces || self.move_normal_forces(half, model, equations) < tolerance {
                    return true;
                }
                has_moved_normal_forces = true;
                merit = f64::INFINITY;
            }
        }
        false
    }

    /// Moves the normal forces from the guessed points of contact to the centres, where they have no lever arm, by changing the
    /// velocities without contact forces. With the guessed arms they would do work that is not part of the elastic energy.
    /// Returns the largest change of a relative velocity, m/s or rad/s.
    fn move_normal_forces(&mut self, half: f64, model: &Model, equations: &mut dyn Equations) -> f64 {
        let change = &mut self.scratch;
        change.fill(0.0);
        for row in self.rows.iter().filter(|row| row.contact().is_some() && !row.is_open()) {
            let n = row.step.mean_normal(&(row.free[0] + row.added[0]));
            let normal_force = n * row.force.dot(&n);
            for column in &self.columns[row.index] {
                change[column.coordinate] += half * (column.centre - column.surface).dot(&normal_force);
            }
        }
        equations.apply_inverse_mass(model, change);
        let mut largest = 0.0_f64;
        for row in &mut self.rows {
            let [centres, slip] = row.of_motion(moved_by(&self.columns[row.index], |i| change[i]));
            row.free[0] += centres;
            row.free[1] += slip;
            largest = largest.max(centres.norm()).max(slip.norm());
        }
        for (mean, change) in self.mean.iter_mut().zip(change) {
            *mean += *change;
        }
        largest
    }

    /// Applies the forces in `right` over `half` a step (s). Returns the largest change of a
    /// relative velocity, m/s or rad/s.
    fn apply_forces(&mut self, half: f64) -> f64 {
        let Self { rows, coupled, weighted, columns, right, scratch, .. } = self;
        scratch.fill(0.0);
        for (row, force) in rows.iter_mut().zip(&*right) {
            (row.before, row.force_before) = (row.added, row.force);
            (row.force, row.full_force) = (*force, *force);
            if *force != Vec3::zeros() {
                add_impulse(scratch, &weighted[row.index], &coupled.spans[row.index], &(force * half));
            }
        }
        let mut change = 0.0_f64;
        for row in rows {
            row.added = row.of_motion(moved_by(&columns[row.index], |i| scratch[i]));
            row.full = row.added;
            let finer = if matches!(row.law, Law::Film(_)) { VELOCITY_TOLERANCE / FILM_TOLERANCE } else { 1.0 };
            change = change.max((row.added[0] - row.before[0]).norm() * finer);
            change = change.max((row.added[1] - row.before[1]).norm());
        }
        change
    }

    /// Forces of the next Newton iteration into `right`; `half` a step, s.
    ///
    /// A contact's normal force depends on the velocity of the centres, friction on that of the surfaces. The derivatives take
    /// both from the latter: the two differ by the lever arms, along which the normal force does not act. Then each row of a
    /// contact can be divided by its derivative, and only the diagonal blocks change from one iteration to the next.
    fn eliminate(&mut self, half: f64) {
        let band = &self.band;
        self.right.clear();
        for (i, row) in self.rows.iter().enumerate() {
            if row.is_open() {
                self.right.push(Vec3::zeros());
                continue;
            }
            let StepForce { force, by_velocity, by_slip, .. } = &row.law_force;
            let slope = (by_velocity + by_slip) * half;
            match slope.try_inverse().filter(|_| row.contact().is_some()) {
                Some(inverse) => {
                    self.blocks[band.row(i)].copy_from_slice(&self.mobility[band.row(i)]);
                    self.blocks[band.diagonal(i)] -= inverse;
                    self.right.push(row.added[1] / half - inverse * force);
                }
                None => {
                    for (block, mobility) in self.blocks[band.row(i)].iter_mut().zip(&self.mobility[band.row(i)]) {
                        *block = -slope * mobility;
                    }
                    self.blocks[band.diagonal(i)] += Mat3::identity();
                    self.right.push(force - slope * row.added[1] / half);
                }
            }
        }
        let rows = &self.rows;
        let is_open = |i: usize| rows[i].is_open();
        band.factor(&mut self.blocks, is_open);
        band.solve(&self.blocks, &mut self.right, is_open);
    }

    /// Adds the effect of the contact forces over half a step `half`, s, to the mean velocity.
    fn add_impulses(&mut self, half: f64) {
        for row in &self.rows {
            let spans = &self.coupled.spans[row.index];
            add_impulse(&mut self.mean, &self.weighted[row.index], spans, &(row.force * half));
        }
    }
}

/// Where each of several ranges with these lengths begins, one after the other from `first`.
fn places(first: usize, lengths: impl Iterator<Item = usize>) -> Vec<usize> {
    lengths.scan(first, |next, length| Some(std::mem::replace(next, *next + length))).collect()
}

/// Upper bounds on the effect of a force, 1/kg, and of a torque, 1/(kg m^2), between two points on their relative motion. They
/// hold for free bodies; joints only reduce the effect.
pub(super) fn max_mobility(model: &Model, ends: &[Anchor; 2]) -> [f64; 2] {
    let mut max_mobility = [0.0; 2];
    for end in ends {
        let Some(body) = model.bodies.get(end.body).filter(|body| !body.driven_only) else {
            continue;
        };
        let turns = body.inertia_inverse.norm();
        max_mobility[0] += 1.0 / body.mass + end.offset.norm_squared() * turns;
        max_mobility[1] += turns;
    }
    max_mobility
}

/// Relative velocities of centres and of surfaces for the `change` of the mean velocity along each coordinate.
fn moved_by(columns: &[Column], change: impl Fn(usize) -> f64) -> [Vec3; 2] {
    let mut moved = [Vec3::zeros(); 2];
    for column in columns {
        let change = change(column.coordinate);
        moved[0] += column.centre * change;
        moved[1] += column.surface * change;
    }
    moved
}

impl Mechanism {
    /// Allocates the workspace of [`Evaluator::discrete_step`], so that steps do not allocate.
    ///
    /// # Errors
    /// The contacts are coupled too widely.
    pub fn prepare_discrete_gradient(&mut self) -> Result<(), MechanismError> {
        if self.discrete.is_none() {
            let (dimension, velocities) = (self.dimension(), self.velocities());
            let within = self.equations.is_block_diagonal();
            let motion = self.equations.motion();
            let world = self.model.bodies.len();
            let fixed = Anchor { body: world, offset: Vec3::zeros() };
            let ends = |element: &dyn ForceElement| element.ends(motion).unwrap_or([fixed; 2]);
            let stations = |element: &dyn ForceElement| element.film().map_or(0, |film| 1 + film.len());
            let elements = self.elements.iter().map(|element| (ends(&**element), stations(&**element)));
            let elements: Vec<([Anchor; 2], usize)> = elements.collect();
            let discrete = DiscreteGradient::new(&self.model, dimension, velocities, within, &elements)?;
            self.discrete = Some(Box::new(discrete));
        }
        Ok(())
    }

    /// Measures the end of such a step, at which the next one starts.
    pub(crate) fn measure_step_end(&mut self, t: f64, y: &[f64]) {
        self.measure(t, y);
        if let Some(discrete) = &mut self.discrete {
            discrete.result.copy_from_slice(y);
        }
    }

    /// Upper bound on the effect of a force at contact `c` on its opening, 1/kg.
    pub(crate) fn max_contact_mobility(&self, c: ContactId) -> f64 {
        let site = &self.model.sites[c];
        max_mobility(&self.model, &[site.carried, site.carrier])[0]
    }

    /// n . W M^-1 W^T n of contact `c` in the latest step, 1/kg; `None` if it did not touch.
    pub(crate) fn contact_mobility(&self, c: ContactId) -> Option<f64> {
        let rows = &self.discrete.as_ref()?.rows;
        let row = rows.binary_search_by_key(&c, |row| row.index).ok()?;
        Some(rows[row].mobility)
    }

    /// Largest error of the place of a part over the thickness of its film in the latest such step, as estimated.
    pub(crate) fn largest_misplacement(&self) -> f64 {
        self.discrete.as_ref().map_or(0.0, |discrete| discrete.largest_misplacement())
    }

    /// Derivative of the velocities without contact forces at the middle of the latest such step.
    pub(crate) fn contact_free_acceleration(&self) -> &[f64] {
        let velocities = self.velocity_range();
        self.discrete.as_ref().map_or(&[], |discrete| &discrete.rate[velocities])
    }

    /// What touched in the latest such step, with the means over it; directions are those of the latest
    /// evaluation.
    pub(crate) fn discrete_contacts(&self) -> impl Iterator<Item = (ContactId, elements::WallContact)> {
        let rows = self.discrete.iter().flat_map(|discrete| &discrete.rows);
        let contacts = rows.filter_map(|row| Some((row.contact()?.0, row)));
        contacts.filter(|(_, row)| row.normal_force > 0.0).map(|(contact, row)| {
            let (normal_force, friction_power) = (row.normal_force, row.friction_power);
            (contact, elements::WallContact { spot: self.spot(contact), normal_force, friction_power })
        })
    }

    /// Normal force times sliding speed in the latest such step, W, of each contact that touched.
    pub(crate) fn discrete_sliding(&self) -> impl Iterator<Item = (ContactId, f64)> {
        let rows = self.discrete.iter().flat_map(|discrete| &discrete.rows);
        rows.filter_map(|row| Some((row.contact()?.0, row.sliding_power)))
    }

    /// Powers over the latest such step.
    pub(crate) fn discrete_powers(&self) -> Powers {
        self.discrete.as_ref().map_or_else(Powers::default, |discrete| discrete.powers)
    }
}

impl Evaluator<'_> {
    /// Takes the step `from`, with the state at its end in `y_end`, ideal joints not yet closed. Considers all contacts if
    /// `all`, otherwise those that the guessed motion brings near their walls. Returns whether the iteration converged.
    pub fn discrete_step(&mut self, from: &StepStart<'_>, all: bool, y_end: &mut [f64]) -> bool {
        let Some(mut discrete) = self.mechanism.discrete.take() else {
            return false;
        };
        let converged = self.discrete_step_in(&mut discrete, from, all, y_end);
        self.mechanism.discrete = Some(discrete);
        converged
    }

    /// Middle and end of the step with the guessed mean velocity, and the measurement of the end.
    fn follow_guess(&mut self, discrete: &mut DiscreteGradient, from: &StepStart<'_>) {
        for (part, at) in [(1.0, &mut discrete.end), (0.5, &mut discrete.middle)] {
            at.copy_from_slice(from.y);
            at[self.mechanism.velocity_range()].copy_from_slice(&discrete.guess);
            for (step, guess) in discrete.displacement.iter_mut().zip(&discrete.guess) {
                *step = part * from.h * guess;
            }
            self.mechanism.equations.displace(&self.mechanism.model, at, &discrete.displacement);
        }
        self.mechanism.measure(from.t + from.h, &discrete.end);
        discrete.record_stations(&self.mechanism.elements, self.mechanism.motion(), true);
    }

    fn discrete_step_in(
        &mut self,
        discrete: &mut DiscreteGradient,
        from: &StepStart<'_>,
        all: bool,
        y_end: &mut [f64],
    ) -> bool {
        let StepStart { t, h, y, k, .. } = *from;
        let positions = self.mechanism.positions();
        // The previous step ended with this measurement, unless the state has changed since.
        if self.mechanism.latest != Latest::Measured(t) || discrete.result != y {
            self.mechanism.measure(t, y);
        }
        discrete.record_start(&self.mechanism.contacts, self.mechanism.motion());
        discrete.record_stations(&self.mechanism.elements, self.mechanism.motion(), false);
        for (i, guess) in discrete.guess.iter_mut().enumerate() {
            *guess = y[positions + i] + 0.5 * h * k[positions + i];
        }
        for pass in 0..2 {
            if pass > 0 {
                let scale = &self.mechanism.scale()[self.mechanism.velocity_range()];
                let moved = discrete.mean.iter().zip(&discrete.guess).zip(scale);
                let moved = moved.map(|((mean, guess), scale)| (mean - guess).abs() / scale).fold(0.0, f64::max) * h;
                if moved < GUESS_TOLERANCE {
                    break;
                }
                discrete.guess.copy_from_slice(&discrete.mean);
            }
            self.follow_guess(discrete, from);
            if pass == 0 && discrete.leaves_a_film(&self.mechanism.elements) {
                // The rates of a film that the motion did not fit lead far away.
                discrete.guess.copy_from_slice(&y[self.mechanism.velocity_range()]);
                self.follow_guess(discrete, from);
            }
            discrete.rows.clear();
            if !matches!(self.active_set, ActiveSet::Nothing) {
                discrete.gather(&self.mechanism.contacts, from, all);
            }
            // All forces except those of contacts, at the middle.
            let active_set = std::mem::replace(&mut self.active_set, ActiveSet::Solved);
            self.derivative(t + 0.5 * h, &discrete.middle, &mut discrete.rate);
            self.active_set = active_set;
            for (i, mean) in discrete.mean.iter_mut().enumerate() {
                *mean = y[positions + i] + 0.5 * h * discrete.rate[positions + i];
            }
            let Mechanism { model, equations, elements, contacts, .. } = &mut *self.mechanism;
            let bristles = &y[y.len() - contacts.bristles()..];
            let at = At { t: t + 0.5 * h, motion: equations.motion(), active_set: ActiveSet::Solved, bristles };
            discrete.gather_elements(model, elements, &**equations, &at, h);
            if !discrete.rows.is_empty() {
                discrete.linearise_rows(model, &**equations, (contacts, bristles));
                discrete.compute_mobilities(model, &mut **equations);
                if !discrete.solve(h, model, &mut **equations, &mut self.counts) {
                    return false;
                }
                discrete.add_impulses(0.5 * h);
            }
        }
        y_end.copy_from_slice(y);
        for (step, mean) in discrete.displacement.iter_mut().zip(&discrete.mean) {
            *step = h * mean;
        }
        let Mechanism { model, equations, .. } = &*self.mechanism;
        equations.displace(model, y_end, &discrete.displacement);
        for (i, mean) in discrete.mean.iter().enumerate() {
            y_end[positions + i] = 2.0 * mean - y[positions + i];
        }
        self.bend_bristles(discrete, y_end);
        self.compute_discrete_powers(discrete, from);
        true
    }

    /// Deflections at the end of the step; zero without contact.
    fn bend_bristles(&self, discrete: &DiscreteGradient, y_end: &mut [f64]) {
        let Mechanism { model, equations, contacts, .. } = &*self.mechanism;
        let first = y_end.len() - contacts.bristles();
        y_end[first..].fill(0.0);
        for row in &discrete.rows {
            let Some((c, law)) = row.contact() else {
                continue;
            };
            let Some(of) = contacts.bristles_of(c).filter(|_| !row.is_open()) else {
                continue;
            };
            let n = row.law_force.normal;
            let slip = row.free[1] + row.added[1];
            let bent = law.bent_after(&row.step, &n, &slip, -row.force.dot(&n));
            let own = equations.motion()[model.sites[c].carrier.body].rotation.tr_mul(&bent);
            y_end[first + of.start..first + of.end].copy_from_slice(own.as_slice());
        }
    }

    /// Powers over the step: of the contacts from the work of their forces, of everything else at the middle.
    fn compute_discrete_powers(&mut self, discrete: &mut DiscreteGradient, from: &StepStart<'_>) {
        let (t, h) = (from.t + 0.5 * from.h, from.h);
        let Mechanism { model, equations, elements, sources, gravity, contacts, .. } = &mut *self.mechanism;
        let positions = equations.positions(model);
        let mut powers = Powers::default();
        for row in &mut discrete.rows {
            let Some((contact, _)) = row.contact() else {
                if matches!(row.law, Law::Film(_)) {
                    let [change, _] = moved_by(&discrete.columns[row.index], |i| discrete.mean[i] - discrete.guess[i]);
                    powers.damping -= row.force.dot(&(row.guessed[0] + change));
                }
                continue;
            };
            let [centres, surfaces] = moved_by(&discrete.columns[row.index], |i| discrete.mean[i] - discrete.guess[i]);
            let (u, s) = (row.guessed[0] + centres, row.guessed[2] + surfaces);
            let n = row.law_force.normal;
            let normal = -row.force.dot(&n);
            let end = (row.step.start + u * h).norm() - row.step.clearances[1];
            let start = row.step.start.norm() - row.step.clearances[0];
            let law = contacts.coefficients(contact);
            let stored = law.elastic.energy(end) - law.elastic.energy(start);
            row.normal_force = normal;
            row.friction_power = -(row.force + n * normal).dot(&s);
            row.sliding_power = normal.max(0.0) * (s - n * n.dot(&s)).norm();
            powers.restitution += (normal * (end - start) - stored) / h;
            powers.friction += row.friction_power;
            // A clearance that shrinks also stiffens the contact.
            let stiffened = law.elastic.energy(start) - discrete.starts[contact].stored;
            powers.clearance += (stiffened - normal * (row.step.clearances[1] - row.step.clearances[0])) / h;
        }
        if sources.none {
            discrete.powers = powers;
            return;
        }
        for element in elements.iter() {
            // Of films, the rows know more.
            if element.film().is_none() {
                element.add_powers(t, equations.motion(), &mut powers);
            }
        }
        if !model.drives.is_empty() {
            let (motion, wrench) = equations.loads();
            for row in &discrete.rows {
                if let Law::Film(step) = &row.law {
                    step.load(&row.force, motion, wrench);
                }
                let Some((contact, law)) = row.contact() else {
                    continue;
                };
                let site = &contacts.contact(contact).site;
                let [arm_ball, arm_socket] = site.arms(motion);
                // Only friction has a lever arm about the centres.
                let n = row.law_force.normal;
                let turning = row.normal.cross(&(row.force - n * row.force.dot(&n)));
                let [to_ball, to_socket] = site.wall.levers(law, law.clearance);
                let ball = &mut wrench[site.carried.body];
                ball.force += row.force;
                ball.torque += arm_ball.cross(&row.force) + turning * to_ball;
                let socket = &mut wrench[site.carrier.body];
                socket.force -= row.force;
                socket.torque -= arm_socket.cross(&row.force) + turning * to_socket;
            }
            let rates = &mut discrete.end[positions..positions + discrete.mean.len()];
            if equations.rows() > 0 {
                // Includes the reactions of the ideal joints to the contact forces.
                equations.accelerate(model, gravity, t, &discrete.middle, rates);
            } else {
                for (i, rate) in rates.iter_mut().enumerate() {
                    *rate = 2.0 / h * (discrete.mean[i] - from.y[positions + i]);
                }
            }
            let all = !sources.forces_suffice;
            powers.drive += equations.drive_power(model, gravity, &discrete.middle, rates, all);
        }
        self.mechanism.forget_evaluation();
        discrete.powers = powers;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{NormalLaw, Parameters};
    use crate::machine::{Attachment, Body, Formulation, Joint, JointStart, LooseJoint, Machine, Quat};

    /// A free joint that starts in this motion.
    fn starting(position: Vec3, velocity: Vec3, angular_velocity: Vec3) -> Joint {
        let start = JointStart::Pose { position, rotation: Quat::identity(), velocity, angular_velocity };
        Joint { start, ..Joint::free(0) }
    }

    /// A ball of 0.1 kg in the middle of a socket fixed to the world, which moves along x at 0.08 m/s, without gravity.
    fn ball(contact: Parameters) -> Machine {
        let mut machine = Machine::default();
        let body = Body::new("ball", 0.1, Mat3::identity() * 1e-4);
        let body = machine.add_body(body, starting(Vec3::zeros(), Vec3::x() * 0.08, Vec3::zeros()));
        let origin = Vec3::zeros();
        let mut joint = LooseJoint::ball("S", Attachment::world(origin), Attachment::on(body, origin));
        joint.contact = contact;
        machine.loose_joints.push(joint);
        machine
    }

    /// A mechanism stepped without a simulation.
    struct Run {
        mechanism: Mechanism,
        t: f64,
        y: Vec<f64>,
        k: Vec<f64>,
        contact_states: Vec<ContactState>,
        powers: Powers,
    }

    impl Run {
        fn new(machine: &Machine) -> Self {
            let mut mechanism = Mechanism::new(machine).expect("a machine");
            let y = mechanism.start().expect("a start");
            mechanism.prepare_discrete_gradient().expect("few contacts");
            let contact_states = vec![ContactState::default(); machine.loose_joints.len()];
            Self { mechanism, t: 0.0, k: vec![0.0; y.len()], y, contact_states, powers: Powers::default() }
        }

        /// Takes a step of size `h`, s; contact states follow the penetrations.
        fn step(&mut self, h: f64) {
            let (contact_states, rebounds) = (&self.contact_states, &vec![None; self.contact_states.len()]);
            let from = StepStart { t: self.t, h, y: &self.y, k: &self.k, contact_states, rebounds };
            let mut end = self.y.clone();
            let mut evaluator = self.mechanism.evaluator(ActiveSet::Immediate(&self.contact_states));
            assert!(evaluator.discrete_step(&from, false, &mut end), "converges");
            let open = self.mechanism.project(self.t + h, &mut end);
            assert!(open < 1e-9);
            let positions = self.mechanism.positions();
            for (k, (end, start)) in self.k.iter_mut().zip(end.iter().zip(&self.y)).skip(positions) {
                *k = (end - start) / h;
            }
            self.powers.add(h, &self.mechanism.discrete_powers());
            self.mechanism.measure(self.t, &self.y);
            let before: Vec<f64> = self.mechanism.contacts.gaps().map(|gap| gap.separation.rate).collect();
            (self.t, self.y) = (self.t + h, end);
            self.mechanism.measure(self.t, &self.y);
            for (j, contact_state) in self.contact_states.iter_mut().enumerate() {
                let gap = &self.mechanism.contacts.gap(j).separation;
                if gap.penetration <= 0.0 {
                    *contact_state = ContactState::default();
                } else if !contact_state.active {
                    *contact_state =
                        ContactState::at_onset(self.mechanism.contacts.coefficients(j), before[j].max(gap.rate));
                }
            }
        }

        fn energy(&mut self) -> f64 {
            let mut rate = vec![0.0; self.y.len()];
            self.mechanism
                .evaluator(ActiveSet::Immediate(&self.contact_states))
                .evaluate_fully(self.t, &self.y, &mut rate);
            let (kinetic, potential) = self.mechanism.energies();
            kinetic + potential + self.mechanism.elastic_energy(self.t)
        }
    }

    /// Restitution of that ball's impact with `n` steps per Hertz time, averaged over the instant within a step at which it
    /// begins.
    fn impact(contact: Parameters, n: f64) -> f64 {
        const STARTS: u32 = 8;
        let law = Coefficients::new(&contact, contact.clearance);
        let speed = 0.08;
        let depth = law.elastic.deepest(0.0, 0.1, speed);
        let h = 2.9432 * depth / speed / n;
        let mut sum = 0.0;
        for start in 0..STARTS {
            let mut run = Run::new(&ball(contact));
            run.step((contact.clearance - h * f64::from(start) / f64::from(STARTS)) / speed);
            while run.y[7] > 0.0 || run.mechanism.contacts.gap(0).separation.penetration > 0.0 {
                run.step(h);
            }
            sum -= run.y[7] / speed;
        }
        sum / f64::from(STARTS)
    }

    #[test]
    fn an_undamped_ball_rebounds_with_its_approach_speed_at_any_step_size() {
        let elastic = Parameters { normal_law: NormalLaw::Hertz, ..Parameters::DEFAULT };
        for n in [1.0, 2.0, 4.0, 8.0] {
            let restitution = impact(elastic, n);
            assert!((restitution - 1.0).abs() < 1e-4, "{n}: {restitution}");
        }
    }

    #[test]
    fn the_restitution_of_a_damped_ball_converges_to_that_of_its_law() {
        let law = Coefficients::new(&Parameters::DEFAULT, Parameters::DEFAULT.clearance);
        let exact = crate::contact::undisturbed_restitution(law.damping);
        let error = |n: f64| (impact(Parameters::DEFAULT, n) - exact).abs();
        let [four, eight, sixteen] = [4.0, 8.0, 16.0].map(error);
        assert!(four < 1e-2 && eight < 3e-3 && sixteen < 1e-3, "{four} {eight} {sixteen} of {exact}");
    }

    /// Two free bodies without gravity that turn and knock at each other through a loose ball.
    fn pair(formulation: Formulation) -> Machine {
        let mut machine = Machine { formulation, ..Machine::default() };
        let inertia = Mat3::from_diagonal(&Vec3::new(2e-4, 4e-4, 3e-4));
        for (name, spin) in [("a", Vec3::new(3.0, -2.0, 4.0)), ("b", Vec3::new(-1.0, 5.0, 2.0))] {
            let position = if name == "a" { Vec3::zeros() } else { Vec3::x() * 0.1 };
            machine.add_body(Body::new(name, 0.2, inertia), starting(position, spin * 0.01, spin));
        }
        let at = Vec3::x() * 0.05;
        let joint = LooseJoint::ball("S", Attachment::on(0, at), Attachment::on(1, -at));
        machine.loose_joints.push(joint.with_clearance(0.1e-3));
        machine
    }

    #[test]
    fn contacts_conserve_momentum_and_their_powers_account_for_the_energy() {
        for formulation in Formulation::ALL {
            let mut run = Run::new(&pair(formulation));
            let momentum = |run: &Run| run.mechanism.motion()[..2].iter().map(|m| m.velocity * 0.2).sum::<Vec3>();
            let start = (run.energy(), momentum(&run));
            for _ in 0..4000 {
                run.step(1e-5);
            }
            let end = (run.energy(), momentum(&run));
            assert!((end.1 - start.1).norm() < 1e-13, "{formulation}: {:e}", (end.1 - start.1).norm());
            let lost = run.powers.restitution + run.powers.friction;
            assert!(lost > 1e-4, "{formulation}: {lost:e}");
            let residual = end.0 - start.0 + lost;
            assert!(residual.abs() < 1e-3 * lost, "{formulation}: {residual:e} of {lost:e}");
        }
    }
}
