//! The stiff part of the equations of motion, linearised analytically: derivatives of the forces of contacts and force
//! elements with respect to displacement and velocity.
//!
//! An iteration that solves with an approximate Jacobian still converges, so non-stiff terms (gravity, gyroscopic terms, rotation
//! of lever arms) are left out. With a = M^-1 (Q + ...), K = dQ/dq and D = dQ/dv in velocity space, (s I - J) (x_q, x_v) = (b_q,
//! b_v) becomes (s I - M^-1 D - M^-1 K / s) x_v = b_v + M^-1 K T^+ b_q / s, x_q = (b_q + T x_v) / s, where T maps velocities to
//! position rates.
//!
//! Bristles add deflections z with z' = G z + B v and forces F_z z, and so F_z (s I - G)^-1 B to M^-1 D + M^-1 K / s. Where they stick,
//! G = 0 and z moves with the positions; where they slide fast, it follows the velocities. With that, x_z = (s I - G)^-1 (b_z + B x_v).

use super::columns::{Column, collect_columns, collect_relative_columns};
use super::contacts::Contacts;
use super::elements::{ActiveSet, At, Contact, Coupling, ForceElement, TorqueDerivatives};
use super::equations::Equations;
use super::flight::ActiveRanges;
use super::lu::Lu;
use super::model::Model;
use crate::integrate::{add_scaled, copy, divide};
use crate::machine::{Mat3, Vec3};
use nalgebra::Complex;
use std::ops::Range;

/// Bristles of a contact, linearised: in the plane across `normal` G = -(1 - turning) / lag across `along`, and -1 / lag along it; B = turning
/// times the sliding velocity across it. Along the normal both are 0.
#[derive(Clone)]
struct LinearBristles {
    /// Its part of [`Stiff::slips`].
    slips: Range<usize>,
    /// That of the carrier.
    rotation: Mat3,
    normal: Vec3,
    along: Vec3,
    turning: f64,
    lag: f64,
}

impl LinearBristles {
    /// Of a contact that carries no force.
    const FREE: Self = Self {
        slips: 0..0,
        rotation: Mat3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        normal: Vec3::new(0.0, 0.0, 0.0),
        along: Vec3::new(0.0, 0.0, 0.0),
        turning: 1.0,
        lag: 1.0,
    };

    /// B x_v plus `own`, b_z: the parts across and along the direction of sliding, and along the normal, world axes.
    fn right(&self, slips: &[(usize, Vec3)], x_v: &[f64], own: &[f64]) -> [Vec3; 3] {
        let slip: Vec3 = slips[self.slips.clone()].iter().map(|(coordinate, slip)| slip * x_v[*coordinate]).sum();
        let b = self.rotation * Vec3::from_column_slice(own);
        let onto = |axis: &Vec3, x: &Vec3| axis * axis.dot(x);
        let (along, normal) = (onto(&self.along, &b), onto(&self.normal, &b));
        [b - along - normal + (slip - onto(&self.along, &slip)) * self.turning, along, normal]
    }

    /// -G of these parts.
    fn decay(&self) -> [f64; 3] {
        [(1.0 - self.turning) / self.lag, 1.0 / self.lag, 0.0]
    }
}

/// The linearisation and its factors.
pub struct Stiff {
    n: usize,
    /// Velocity coordinates of each tree. Trees with many joints come last: if eliminated first, they would couple all their
    /// neighbours.
    trees: Vec<Range<usize>>,
    /// Index in `trees` for each coordinate.
    tree_of: Vec<usize>,
    /// Whether a coupling acts on both trees of a pair, row by row; and scratch for the trees coupled with one.
    is_coupled_pair: Vec<bool>,
    partners: Vec<usize>,
    /// Elimination index of each coupled tree's first coordinate.
    first: Vec<usize>,
    /// Coordinates with couplings, in elimination order.
    coordinates: Vec<usize>,
    /// Nonzero pattern of M^-1 K and M^-1 D: row and column in elimination order, and index into both matrices.
    entries: Vec<[u32; 3]>,
    /// M^-1 K and M^-1 D, column-major n x n.
    by_position: Vec<f64>,
    by_velocity: Vec<f64>,
    lu: Lu<f64>,
    lu_pair: Lu<Complex<f64>>,
    columns: Vec<Column>,
    /// Scratch for the derivative at the point of linearisation.
    pub derivative: Vec<f64>,
    /// Positions at the linearisation.
    y: Vec<f64>,
    shift: f64,
    shift_pair: Complex<f64>,
    scratch: Vec<f64>,
    scratch_im: Vec<f64>,
    rate: Vec<f64>,
    rate_im: Vec<f64>,
    packed: Vec<f64>,
    pair: Vec<Complex<f64>>,
    moved: Vec<Complex<f64>>,
    /// First velocity and first bristle of a state.
    positions: usize,
    first_bristle: usize,
    /// By three components, and the sliding velocity of their contacts per unit rate of each coordinate.
    bristles: Vec<LinearBristles>,
    slips: Vec<(usize, Vec3)>,
    bristle_scratch: [Vec<f64>; 2],
    /// Whether no contact or element carries a force: J is then zero except for q' = T v.
    empty: bool,
}

impl Stiff {
    /// For a state of so many positions, velocities and components of bristles. With `separate`, a force accelerates only the trees
    /// it acts on.
    pub fn new(model: &Model, [positions, velocities, bristles]: [usize; 3], separate: bool) -> Self {
        let n = velocities;
        let dimension = positions + velocities + bristles;
        let trees = if separate { trees_of(model) } else { std::iter::once(0..n).collect() };
        let mut tree_of = vec![0; n];
        for (tree_index, tree) in trees.iter().enumerate() {
            tree_of[tree.clone()].fill(tree_index);
        }
        Self {
            n,
            is_coupled_pair: vec![false; trees.len() * trees.len()],
            partners: Vec::with_capacity(trees.len()),
            first: vec![0; trees.len()],
            trees,
            tree_of,
            coordinates: Vec::with_capacity(n),
            entries: Vec::with_capacity(n * n),
            by_position: vec![0.0; n * n],
            by_velocity: vec![0.0; n * n],
            lu: Lu::new(n),
            lu_pair: Lu::new(n),
            columns: Vec::with_capacity(n),
            derivative: vec![0.0; dimension],
            y: vec![0.0; dimension],
            shift: 1.0,
            shift_pair: Complex::new(1.0, 1.0),
            scratch: vec![0.0; n],
            scratch_im: vec![0.0; n],
            rate: vec![0.0; positions],
            rate_im: vec![0.0; positions],
            packed: Vec::with_capacity(n),
            pair: Vec::with_capacity(n),
            moved: Vec::with_capacity(n),
            positions,
            first_bristle: positions + velocities,
            bristles: vec![LinearBristles::FREE; bristles / 3],
            slips: Vec::with_capacity(n * bristles / 3),
            bristle_scratch: [vec![0.0; bristles], vec![0.0; bristles]],
            empty: true,
        }
    }

    /// Generalised stiffness and damping of all contacts and elements, from gaps and forces of the evaluation just made at
    /// (t, y).
    pub fn gather(
        &mut self,
        model: &Model,
        contacts: &Contacts,
        elements: &[Box<dyn ForceElement>],
        active_set: ActiveSet<'_>,
        equations: &dyn Equations,
        (t, y, shift): (f64, &[f64], f64),
    ) {
        let motion = equations.motion();
        self.y.copy_from_slice(y);
        for [.., at] in self.entries.iter().map(|entry| entry.map(|x| x as usize)) {
            (self.by_position[at], self.by_velocity[at]) = (0.0, 0.0);
        }
        self.is_coupled_pair.fill(false);
        self.empty = true;
        let at = At { t, motion, active_set, bristles: &y[self.first_bristle..] };
        self.slips.clear();
        self.bristles.fill(LinearBristles::FREE);
        let of_contacts = contacts.iter().map(|contact| contact.coupling(&at));
        let of_elements = elements.iter().map(|element| element.coupling(&at));
        for coupling in of_contacts.chain(of_elements).flatten() {
            self.empty = false;
            let (sides, n) = (&coupling.sides, &coupling.normal);
            if let Some(torque_derivatives) = &coupling.torque_derivatives {
                collect_relative_columns(&mut self.columns, model, equations, sides);
                self.add_torque_derivatives(torque_derivatives);
            } else {
                collect_columns(&mut self.columns, model, equations, sides, n);
            }
            self.add(&coupling);
            self.record_coupled_trees();
        }
        if !self.bristles.is_empty() {
            for contact in contacts.iter().filter(|contact| contact.bristles.is_some()) {
                self.gather_bristles(model, contact, equations, (&at, shift));
            }
        }
        self.coordinates.clear();
        for (tree_index, tree) in self.trees.iter().enumerate() {
            if self.is_coupled(tree_index) {
                self.first[tree_index] = self.coordinates.len();
                self.coordinates.extend(tree.clone());
            }
        }
    }

    /// Whether a coupling acts on tree `tree_index`.
    fn is_coupled(&self, tree_index: usize) -> bool {
        self.is_coupled_pair[tree_index * (self.trees.len() + 1)]
    }

    /// Records the trees that the coupling in `columns` acts on.
    fn record_coupled_trees(&mut self) {
        self.partners.clear();
        for column in &self.columns {
            let tree = self.tree_of[column.coordinate];
            if !self.partners.contains(&tree) {
                self.partners.push(tree);
            }
        }
        for &one in &self.partners {
            for &other in &self.partners {
                self.is_coupled_pair[one * self.trees.len() + other] = true;
            }
        }
    }

    /// Adds the torque of one coupling: dQ_k = turn_k . dT.
    fn add_torque_derivatives(&mut self, torque_derivatives: &TorqueDerivatives) {
        let n = self.n;
        for l in &self.columns {
            let torque_q = torque_derivatives.by_rotation * l.turn;
            let torque_v = torque_derivatives.by_angular_velocity * l.turn;
            for k in &self.columns {
                let at = l.coordinate * n + k.coordinate;
                self.by_position[at] += k.turn.dot(&torque_q);
                self.by_velocity[at] += k.turn.dot(&torque_v);
            }
            let Some(mixed) = &torque_derivatives.mixed else {
                continue;
            };
            for ([force, torque], matrix) in mixed.iter().zip([&mut self.by_position, &mut self.by_velocity]) {
                let (force, torque) = (force * l.turn, torque * l.centre);
                for k in &self.columns {
                    matrix[l.coordinate * n + k.coordinate] += k.centre.dot(&force) + k.turn.dot(&torque);
                }
            }
        }
    }

    /// Adds one coupling: dQ_k = surface_k . dF + (F x turn_k) . dn.
    fn add(&mut self, coupling: &Coupling) {
        let (n, s) = (self.n, &coupling.stiffness);
        for l in &self.columns {
            let normal_q = s.normal * l.centre;
            let slip = if coupling.uses_surface_velocity { l.surface } else { l.centre };
            let force_q = s.by_displacement * l.centre;
            let force_v = s.by_rate * l.centre + s.by_slip * slip;
            let lever = normal_q.cross(&coupling.force);
            for k in &self.columns {
                let at = l.coordinate * n + k.coordinate;
                self.by_position[at] += k.surface.dot(&force_q) + k.turn.dot(&lever);
                self.by_velocity[at] += k.surface.dot(&force_v);
            }
        }
    }

    /// Adds the force of a contact's bristles, and records how the velocities bend them.
    fn gather_bristles(
        &mut self,
        model: &Model,
        contact: &Contact,
        equations: &dyn Equations,
        (at, shift): (&At<'_>, f64),
    ) {
        let (Some(state), Some(law), Some(force), Some(coupling)) =
            (contact.bristles, contact.law.bristles, contact.bristle_force(at), contact.coupling(at))
        else {
            return;
        };
        collect_columns(&mut self.columns, model, equations, &coupling.sides, &coupling.normal);
        let (first, n) = (self.slips.len(), &coupling.normal);
        self.slips.extend(self.columns.iter().map(|column| {
            let slip = if coupling.uses_surface_velocity { column.surface } else { column.centre };
            (column.coordinate, slip - n * n.dot(&slip))
        }));
        let bristles = LinearBristles {
            slips: first..self.slips.len(),
            rotation: at.motion[contact.site.carrier.body].rotation,
            normal: *n,
            along: force.along,
            turning: force.turning,
            lag: law.lag,
        };
        let stiffness = force.by_bending() * (-law.stiffness * force.turning);
        let [decay, ..] = bristles.decay();
        // 1 / (s + decay), to first order in 1 / s about that of the shift: at the complex one of the same step it is off by less than a fifth.
        let part = shift / (shift + decay);
        let (by_position, by_velocity) = (part * part, part * (1.0 - part) / shift);
        for l in bristles.slips.clone() {
            let (coordinate, slip) = self.slips[l];
            let force = stiffness * slip;
            for k in &self.columns {
                let at = coordinate * self.n + k.coordinate;
                let force = k.surface.dot(&force);
                self.by_position[at] += by_position * force;
                self.by_velocity[at] += by_velocity * force;
            }
        }
        self.bristles[state.first / 3] = bristles;
    }

    /// Converts generalised forces to accelerations.
    pub fn apply_inverse_mass(&mut self, model: &Model, equations: &mut dyn Equations) {
        if self.empty {
            return;
        }
        let n = self.n;
        let count = self.trees.len();
        self.entries.clear();
        for (tree_index, tree) in self.trees.iter().enumerate() {
            if !self.is_coupled(tree_index) {
                continue;
            }
            let is_coupled_pair = &self.is_coupled_pair[tree_index * count..][..count];
            self.partners.clear();
            self.partners.extend((0..count).filter(|&other| is_coupled_pair[other]));
            for (column, j) in tree.clone().zip(self.first[tree_index]..) {
                for matrix in [&mut self.by_position, &mut self.by_velocity] {
                    let forces = &mut matrix[column * n..][..n];
                    for &other in &self.partners {
                        let Range { start, end } = self.trees[other].clone();
                        if forces[start..end].iter().all(|force| *force == 0.0) {
                            continue;
                        }
                        if count > 1 {
                            equations.apply_inverse_mass_within(model, (start, end), forces);
                        } else {
                            equations.apply_inverse_mass(model, forces);
                        }
                    }
                }
                for &other in &self.partners {
                    for (row, i) in self.trees[other].clone().zip(self.first[other]..) {
                        let at = column * n + row;
                        if self.by_position[at] != 0.0 || self.by_velocity[at] != 0.0 {
                            self.entries.push([i, j, at].map(|x| x as u32));
                        }
                    }
                }
            }
        }
    }

    /// Number of coupled coordinates, and of products in their latest elimination with a real shift; 0 without couplings.
    pub fn size(&self) -> [usize; 2] {
        // Leftovers of an earlier linearisation must not enter a snapshot.
        if self.empty { [0; 2] } else { [self.coordinates.len(), self.lu.products] }
    }

    /// Prepares to solve with a real shift s: factors s I - M^-1 D - M^-1 K / s.
    pub fn factor(&mut self, shift: f64) {
        self.shift = shift;
        if self.empty {
            return;
        }
        let (k, d) = (&self.by_position, &self.by_velocity);
        let entries = self.entries.iter().map(|entry| {
            let [i, j, at] = entry.map(|x| x as usize);
            (i, j, -d[at] - k[at] / shift)
        });
        self.lu.factor(self.coordinates.len(), entries, shift);
    }

    /// Prepares to solve with a complex shift.
    pub fn factor_pair(&mut self, shift: Complex<f64>) {
        self.shift_pair = shift;
        if self.empty {
            return;
        }
        let (k, d) = (&self.by_position, &self.by_velocity);
        let inverse = shift.inv();
        let entries = self.entries.iter().map(|entry| {
            let [i, j, at] = entry.map(|x| x as usize);
            (i, j, -inverse * k[at] - d[at])
        });
        self.lu_pair.factor(self.coordinates.len(), entries, shift);
    }

    /// Solves (s I - J) x = b in place for the active components.
    pub fn solve(&mut self, b: &mut [f64], active_ranges: &ActiveRanges, equations: &dyn Equations, model: &Model) {
        let positions = self.positions;
        let s = self.shift;
        self.bristle_scratch[0].copy_from_slice(&b[self.first_bristle..]);
        if self.empty {
            divide(active_ranges.velocities(), b, s);
        } else {
            let (b_q, b_v) = b.split_at_mut(positions);
            equations.velocities_of(model, &self.y, b_q, &mut self.scratch);
            self.packed.clear();
            self.packed.extend(self.coordinates.iter().map(|&c| b_v[c]));
            for &c in &self.coordinates {
                self.scratch[c] /= s;
            }
            for [i, j, at] in self.entries.iter().map(|entry| entry.map(|x| x as usize)) {
                self.packed[i] += self.by_position[at] * self.scratch[self.coordinates[j]];
            }
            self.lu.solve(&mut self.packed);
            if self.coordinates.len() < self.n {
                divide(active_ranges.velocities(), b, s);
            }
            for (&c, x) in self.coordinates.iter().zip(&self.packed) {
                b[positions + c] = *x;
            }
        }
        copy(active_ranges.velocities(), &mut self.y, b);
        equations.position_rate(model, &self.y, &mut self.rate);
        add_scaled(active_ranges.positions(), b, 1.0, &self.rate);
        divide(active_ranges.positions(), b, s);
        let (moving, bent) = b.split_at_mut(self.first_bristle);
        let own = self.bristle_scratch[0].chunks_exact(3);
        for ((bristles, own), x) in self.bristles.iter().zip(own).zip(bent.chunks_exact_mut(3)) {
            let parts = bristles.right(&self.slips, &moving[positions..], own).into_iter().zip(bristles.decay());
            let solved: Vec3 = parts.map(|(part, decay)| part / (s + decay)).sum();
            x.copy_from_slice(bristles.rotation.tr_mul(&solved).as_slice());
        }
    }

    /// As [`Self::solve`] with the complex shift, for `re` + i `im`.
    pub fn solve_pair(
        &mut self,
        re: &mut [f64],
        im: &mut [f64],
        active_ranges: &ActiveRanges,
        equations: &dyn Equations,
        model: &Model,
    ) {
        let positions = self.positions;
        let inverse = self.shift_pair.inv();
        for (own, part) in self.bristle_scratch.iter_mut().zip([&*re, &*im]) {
            own.copy_from_slice(&part[self.first_bristle..]);
        }
        if !self.empty {
            let (re_q, re_v) = re.split_at(positions);
            let (im_q, im_v) = im.split_at(positions);
            equations.velocities_of(model, &self.y, re_q, &mut self.scratch);
            equations.velocities_of(model, &self.y, im_q, &mut self.scratch_im);
            self.pair.clear();
            let coupled = self.coordinates.iter();
            self.pair.extend(coupled.map(|&c| Complex::new(re_v[c], im_v[c])));
            self.moved.clear();
            let (re, im) = (&self.scratch, &self.scratch_im);
            let coupled = self.coordinates.iter();
            self.moved.extend(coupled.map(|&c| inverse * Complex::new(re[c], im[c])));
            for [i, j, at] in self.entries.iter().map(|entry| entry.map(|x| x as usize)) {
                self.pair[i] += self.moved[j] * self.by_position[at];
            }
            self.lu_pair.solve(&mut self.pair);
        }
        if self.empty || self.coordinates.len() < self.n {
            multiply(active_ranges.velocities(), re, im, inverse);
        }
        if !self.empty {
            for (&c, x) in self.coordinates.iter().zip(&self.pair) {
                (re[positions + c], im[positions + c]) = (x.re, x.im);
            }
        }
        for (part, rate) in [(&mut *re, &mut self.rate), (&mut *im, &mut self.rate_im)] {
            copy(active_ranges.velocities(), &mut self.y, part);
            equations.position_rate(model, &self.y, rate);
            add_scaled(active_ranges.positions(), part, 1.0, rate);
        }
        multiply(active_ranges.positions(), re, im, inverse);
        for (i, bristles) in self.bristles.iter().enumerate() {
            let part = |x: &[f64], own: &[f64]| bristles.right(&self.slips, &x[positions..], &own[3 * i..3 * i + 3]);
            let [re_right, im_right] = [part(re, &self.bristle_scratch[0]), part(im, &self.bristle_scratch[1])];
            let mut solved = [Vec3::zeros(); 2];
            for (side, decay) in bristles.decay().into_iter().enumerate() {
                let inverse = (self.shift_pair + decay).inv();
                for axis in 0..3 {
                    let x = inverse * Complex::new(re_right[side][axis], im_right[side][axis]);
                    solved[0][axis] += x.re;
                    solved[1][axis] += x.im;
                }
            }
            let own = self.first_bristle + 3 * i..self.first_bristle + 3 * i + 3;
            for (part, solved) in [&mut *re, &mut *im].into_iter().zip(solved) {
                part[own.clone()].copy_from_slice(bristles.rotation.tr_mul(&solved).as_slice());
            }
        }
    }
}

/// Multiplies `re` + i `im` by `by` in the ranges `parts`.
fn multiply(parts: &[Range<usize>], re: &mut [f64], im: &mut [f64], by: Complex<f64>) {
    for part in parts {
        for (re, im) in re[part.clone()].iter_mut().zip(&mut im[part.clone()]) {
            let x = by * Complex::new(*re, *im);
            (*re, *im) = (x.re, x.im);
        }
    }
}

/// Velocity coordinates of the trees of `model`; trees with more than two joints come last.
fn trees_of(model: &Model) -> Vec<Range<usize>> {
    let mut joints = vec![0; model.blocks.len()];
    for joint in &model.joints {
        for anchor in [&joint.carried, &joint.carrier] {
            if anchor.body < model.bodies.len() && !model.bodies[anchor.body].driven_only {
                joints[model.block_of[anchor.body]] += 1;
            }
        }
    }
    let mut order: Vec<usize> = (0..model.blocks.len()).collect();
    order.sort_by_key(|&block| joints[block].max(2));
    let range = |block: usize| model.blocks[block].v..model.blocks[block].v + model.blocks[block].n;
    order.into_iter().map(range).collect()
}
