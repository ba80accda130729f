//! The stiff part of the equations of motion, linearised analytically: derivatives of the forces of contacts and force
//! elements with respect to displacement and velocity.
//!
//! An iteration that solves with an approximate Jacobian still converges, so non-stiff terms (gravity, gyroscopic terms, rotation
//! of lever arms) are left out. With a = M^-1 (Q + ...), K = dQ/dq and D = dQ/dv in velocity space, (s I - J) (x_q, x_v) = (b_q,
//! b_v) becomes (s I - M^-1 D - M^-1 K / s) x_v = b_v + M^-1 K T^+ b_q / s, x_q = (b_q + T x_v) / s, where T maps velocities to
//! position rates.
//!
//! Bristles add deflections z with z' = S v and forces F_z z. As any Runge-Kutta method integrates S v as it does v, z moves with the
//! positions: F_z S is part of K, and x_z = (b_z + S x_v) / s. (S turns with the surfaces, which the iteration corrects.)

use super::columns::{Column, collect_columns, collect_relative_columns};
use super::contacts::Contacts;
use super::elements::{ActiveSet, At, Coupling, ForceElement, TorqueDerivatives};
use super::equations::Equations;
use super::flight::ActiveRanges;
use super::lu::Lu;
use super::model::Model;
use crate::integrate::{add_scaled, copy, divide};
use crate::machine::{Mat3, Vec3};
use nalgebra::Complex;
use std::ops::Range;

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
    /// By three components of the bristles: the columns of their contact, and the rotation into its carrier's axes; the columns of all.
    bristles: Vec<(Range<usize>, Mat3)>,
    slips: Vec<(usize, Vec3)>,
    bristle_scratch: Vec<f64>,
    bristle_scratch_im: Vec<f64>,
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
            bristles: vec![(0..0, Mat3::zeros()); bristles / 3],
            slips: Vec::with_capacity(n * bristles / 3),
            bristle_scratch: vec![0.0; bristles],
            bristle_scratch_im: vec![0.0; bristles],
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
        (t, y): (f64, &[f64]),
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
        let of_contacts = contacts.iter().map(|contact| (contact.bristles, contact.coupling(&at)));
        let of_elements = elements.iter().map(|element| (None, element.coupling(&at)));
        for (bristles, coupling) in of_contacts.chain(of_elements) {
            if let Some(state) = bristles {
                self.bristles[state.first / 3].0 = 0..0;
            }
            let Some(coupling) = coupling else {
                continue;
            };
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
            if let Some(state) = bristles {
                let carrier = coupling.sides[1].0.body;
                self.add_bristles(state.first / 3, &coupling, &motion[carrier].rotation);
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
        }
    }

    /// Adds one coupling: dQ_k = surface_k . dF + (F x turn_k) . dn.
    fn add(&mut self, coupling: &Coupling) {
        let (n, s) = (self.n, &coupling.stiffness);
        for l in &self.columns {
            let normal_q = s.normal * l.centre;
            let slip = if coupling.uses_surface_velocity { l.surface } else { l.centre };
            let force_q = s.by_displacement * l.centre + s.by_deflection * slip;
            let force_v = s.by_rate * l.centre + s.by_slip * slip;
            let lever = normal_q.cross(&coupling.force);
            for k in &self.columns {
                let at = l.coordinate * n + k.coordinate;
                self.by_position[at] += k.surface.dot(&force_q) + k.turn.dot(&lever);
                self.by_velocity[at] += k.surface.dot(&force_v);
            }
        }
    }

    /// Records how the velocities move the bristles of a contact, whose columns are those in `columns`.
    fn add_bristles(&mut self, index: usize, coupling: &Coupling, rotation: &Mat3) {
        let first = self.slips.len();
        let n = &coupling.normal;
        self.slips.extend(self.columns.iter().map(|column| {
            let slip = if coupling.uses_surface_velocity { column.surface } else { column.centre };
            (column.coordinate, slip - n * n.dot(&slip))
        }));
        self.bristles[index] = (first..self.slips.len(), rotation.transpose());
    }

    /// Adds S x_v to b_z, for the velocities in the state `x`.
    fn move_bristles(&self, x: &[f64], b: &mut [f64]) {
        for (i, (columns, rotation)) in self.bristles.iter().enumerate() {
            let slips = self.slips[columns.clone()].iter();
            let slip: Vec3 = slips.map(|(coordinate, slip)| slip * x[self.positions + coordinate]).sum();
            let moved = rotation * slip;
            b[3 * i..3 * i + 3].iter_mut().zip(moved.iter()).for_each(|(b, moved)| *b += moved);
        }
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
        self.bristle_scratch.copy_from_slice(&b[self.first_bristle..]);
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
        if !self.bristles.is_empty() {
            let mut moved = std::mem::take(&mut self.bristle_scratch);
            self.move_bristles(b, &mut moved);
            b[self.first_bristle..].iter_mut().zip(&moved).for_each(|(x, moved)| *x = moved / s);
            self.bristle_scratch = moved;
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
        self.bristle_scratch.copy_from_slice(&re[self.first_bristle..]);
        self.bristle_scratch_im.copy_from_slice(&im[self.first_bristle..]);
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
        if !self.bristles.is_empty() {
            let mut moved = [&mut self.bristle_scratch, &mut self.bristle_scratch_im].map(std::mem::take);
            self.move_bristles(re, &mut moved[0]);
            self.move_bristles(im, &mut moved[1]);
            for (i, (re_z, im_z)) in moved[0].iter().zip(&moved[1]).enumerate() {
                let x = inverse * Complex::new(*re_z, *im_z);
                (re[self.first_bristle + i], im[self.first_bristle + i]) = (x.re, x.im);
            }
            [self.bristle_scratch, self.bristle_scratch_im] = moved;
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
