//! The stiff part of the equations of motion, linearised analytically: derivatives of the forces of contacts and force
//! elements with respect to displacement and velocity.
//!
//! An iteration that solves with an approximate Jacobian still converges, so non-stiff terms (gravity, gyroscopic terms, rotation
//! of lever arms) are left out. With a = M^-1 (Q + ...), K = dQ/dq and D = dQ/dv in velocity space, (s I - J) (x_q, x_v) = (b_q,
//! b_v) becomes (s I - M^-1 D - M^-1 K / s) x_v = b_v + M^-1 K T^+ b_q / s, x_q = (b_q + T x_v) / s, where T maps velocities to
//! position rates.

use super::columns::{Column, collect_columns, collect_relative_columns};
use super::contacts::Contacts;
use super::elements::{ActiveSet, At, Coupling, ForceElement, SceneElement, TorqueDerivatives};
use super::equations::Equations;
use super::flight::ActiveRanges;
use super::lu::Lu;
use super::model::Model;
use crate::integrate::{add_scaled, copy, divide};
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
    /// Whether no contact or element carries a force: J is then zero except for q' = T v.
    empty: bool,
}

impl Stiff {
    /// For `velocities` velocity coordinates in a state of `dimension`. With `separate`, a force accelerates only the trees it
    /// acts on.
    pub fn new(model: &Model, velocities: usize, dimension: usize, separate: bool) -> Self {
        let n = velocities;
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
            rate: vec![0.0; dimension - n],
            rate_im: vec![0.0; dimension - n],
            packed: Vec::with_capacity(n),
            pair: Vec::with_capacity(n),
            moved: Vec::with_capacity(n),
            empty: true,
        }
    }

    /// Generalised stiffness and damping of all contacts and elements, from gaps and forces of the evaluation just made at
    /// (t, y).
    pub fn gather(
        &mut self,
        model: &Model,
        contacts: &Contacts,
        elements: &[Box<dyn SceneElement>],
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
        let at = At { t, motion, active_set };
        let of_contacts = contacts.with_clearance().map(|contact| contact.coupling(&at));
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
            let force_q = s.by_displacement * l.centre;
            let normal_q = s.normal * l.centre;
            let slip = if coupling.uses_surface_velocity { l.surface } else { l.centre };
            let force_v = s.by_rate * l.centre + s.by_slip * slip;
            let lever = normal_q.cross(&coupling.force);
            for k in &self.columns {
                let at = l.coordinate * n + k.coordinate;
                self.by_position[at] += k.surface.dot(&force_q) + k.turn.dot(&lever);
                self.by_velocity[at] += k.surface.dot(&force_v);
            }
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
        let positions = b.len() - self.n;
        let s = self.shift;
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
        let positions = re.len() - self.n;
        let inverse = self.shift_pair.inv();
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
        for anchor in [&joint.ball, &joint.socket] {
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

#[cfg(test)]
mod tests {
    use crate::contact::ContactState;
    use crate::integrate::{StiffSystem, System};
    use crate::machine::Vec3;
    use crate::mechanism::{ActiveSet, Mechanism};
    use crate::scene::Scene;

    /// The default scene with its platform lowered until every ball rests 0.2 um deep in its wall and creeps along it.
    /// `approach_speed` is the approach speed of each contact state, m/s.
    fn resting(changes: &[(&str, &str)], approach_speed: f64) -> (Mechanism, Vec<f64>, [ContactState; 3]) {
        let changes: Vec<(String, String)> = changes.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
        let scene = Scene::load("spcmm", &changes).unwrap();
        let mut mechanism = Mechanism::new(&scene.machine).unwrap();
        let mut y = mechanism.start().unwrap();
        y[0] += 0.3e-3 + 2e-7;
        let v = mechanism.positions();
        // Initially every ball moves with its socket.
        for (i, slip) in [2e-7, 3e-5, -4e-5].iter().enumerate() {
            y[v + i] += slip;
        }
        let contact_state = ContactState { active: true, approach_speed, floored: true, ..ContactState::default() };
        (mechanism, y, [contact_state; 3])
    }

    #[test]
    fn the_stiff_part_of_the_jacobian_agrees_with_central_differences() {
        // In the last case the rate is the largest so far, so that the damping term does not depend on it.
        for (surface, approach, approach_speed) in [
            ("centres", "start", 1e-3),
            ("surface", "start", 1e-3),
            ("surface", "largest", 1e-3),
            ("surface", "largest", 1e-9),
        ] {
            let changes = [("contact.friction_velocity", surface), ("contact.approach_speed", approach)];
            let (mut m, y, contact_state) = resting(&changes, approach_speed);
            let (t, nq) = (0.0, m.positions());
            m.measure(t, &y);
            let rises = m.contacts.gaps().all(|gap| gap.separation.rate > approach_speed);
            assert_eq!(rises, approach_speed < 1e-6);
            let active_set = ActiveSet::Located(&contact_state);
            m.evaluator(active_set).linearise(t, &y);
            let stiff = m.stiff.take().unwrap();
            let n = stiff.n;
            let (mut plus, mut minus) = (vec![0.0; y.len()], vec![0.0; y.len()]);
            // Rounding of the differences and terms that are left out stay below 1e-3 of the stiffest entry.
            let compare = |name: &str, got: &[f64], plus: &[f64], minus: &[f64], scale: f64, width: f64| {
                for k in 0..n {
                    let want = (plus[nq + k] - minus[nq + k]) / (2.0 * width);
                    assert!(
                        (got[k] - want).abs() < 1e-3 * scale,
                        "{surface} {name}[{k}]: {:e} against {want:e}",
                        got[k]
                    );
                }
            };
            let largest = |x: &[f64]| x.iter().map(|x| x.abs()).fold(0.0, f64::max);
            let (stiffest, dampest) = (largest(&stiff.by_position), largest(&stiff.by_velocity));
            assert!(stiffest > 1e7 && dampest > 1e3, "{stiffest:e} {dampest:e}");
            for l in 0..n {
                let mut moved = |sign: f64, out: &mut [f64]| {
                    let mut z = y.clone();
                    let mut step = vec![0.0; n];
                    step[l] = sign * 1e-10;
                    crate::mechanism::Tree::displace(&m.model, &mut z, &step);
                    m.evaluator(active_set).derivative(t, &z, out);
                };
                moved(1.0, &mut plus);
                moved(-1.0, &mut minus);
                compare(&format!("K{l}"), &stiff.by_position[l * n..][..n], &plus, &minus, stiffest, 1e-10);
                let mut faster = |sign: f64, out: &mut [f64]| {
                    let mut z = y.clone();
                    z[nq + l] += sign * 1e-8;
                    m.evaluator(active_set).derivative(t, &z, out);
                };
                faster(1.0, &mut plus);
                faster(-1.0, &mut minus);
                compare(&format!("D{l}"), &stiff.by_velocity[l * n..][..n], &plus, &minus, dampest, 1e-8);
            }
        }
    }

    /// A serial chain from a free body, with a hinge, a slide, a fixed joint, and a hinge on a driven slide; moving, and loaded
    /// by `elements`.
    fn is_coupled_pair(elements: &str, formulation: &str) -> (Mechanism, Vec<f64>) {
        let body =
            |name: &str| format!("[[body]]\nname = \"{name}\"\nmass = \"1 kg\"\ninertia = \"2e-2 3e-2 4e-2 kg m^2\"\n");
        let joint = |kind: &str, parent: &str, child: &str, more: &str| {
            format!(
                "[[joint]]\nname = \"{child}\"\nkind = \"{kind}\"\nparent = \"{parent}\"\nchild = \"{child}\"\n{more}\n"
            )
        };
        let at = "parent_point = \"100 20 -30 mm\"\nchild_point = \"-80 10 20 mm\"\n\
                  rotation = { axis = [1, 2, 3], angle = \"40 deg\" }";
        let slow = "start = { position = \"0.3 mm\", velocity = \"0.2 mm/s\" }";
        let turns = "start = { position = \"0.3 mrad\", velocity = \"1 mrad/s\" }";
        let bodies = ["base", "arm", "rod", "table", "wheel"].map(body).concat();
        let free = "start = { position = \"0 0 1 m\", rotation = { axis = [3, 1, 2], angle = \"50 deg\" } }";
        let driven = "axis = [0, 1, 0]\ndrive = { law = \"harmonic\", amplitude = \"1 mm\", frequency = \"1 Hz\" }";
        let text = bodies
            + &joint("free", "world", "base", free)
            + &joint("revolute", "base", "arm", &format!("axis = [1, 0, 2]\n{at}\n{turns}"))
            + &joint("prismatic", "arm", "rod", &format!("axis = [0, 1, 1]\n{at}\n{slow}"))
            + &joint("prismatic", "world", "table", driven)
            + &joint("revolute", "table", "wheel", &format!("axis = [0, 1, 2]\n{at}\n{turns}"))
            + elements;
        let changes = [("formulation".to_owned(), formulation.to_owned())];
        let scene = Scene::parse(&text, None, &changes).unwrap();
        let mut mechanism = Mechanism::new(&scene.machine).unwrap();
        let y = mechanism.start().unwrap();
        (mechanism, y)
    }

    /// Moves the positions in `y` by `by` along velocity coordinate `l`.
    fn displace(m: &Mechanism, formulation: &str, y: &mut [f64], l: usize, by: f64) {
        if formulation == "tree" {
            let mut step = vec![0.0; m.model.nv];
            step[l] = by;
            crate::mechanism::Tree::displace(&m.model, y, &step);
            return;
        }
        let (at, i) = (7 * (l / 6), l % 6);
        if i < 3 {
            y[at + i] += by;
        } else {
            let turn = Vec3::ith(i - 3, by);
            crate::mechanism::kinematics::rotate_quaternion(&mut y[at + 3..at + 7], &turn);
        }
    }

    #[test]
    fn derivatives_of_elements_agree_with_central_differences_in_both_formulations() {
        for (name, elements) in ELEMENT_CASES {
            for formulation in ["tree", "lagrange"] {
                let (mut m, y) = is_coupled_pair(elements, formulation);
                let (t, nq) = (0.1, m.positions());
                m.evaluator(ActiveSet::Nothing).linearise(t, &y);
                let stiff = m.stiff.take().unwrap();
                let n = stiff.n;
                let largest = |x: &[f64]| x.iter().map(|x| x.abs()).fold(0.0, f64::max);
                let (stiffest, dampest) = (largest(&stiff.by_position), largest(&stiff.by_velocity));
                assert!(stiffest > 1e5 && dampest > 1e2, "{name}: {stiffest:e} {dampest:e}");
                let (mut plus, mut minus) = (vec![0.0; y.len()], vec![0.0; y.len()]);
                let check = |what: String, got: &[f64], plus: &[f64], minus: &[f64], scale: f64| {
                    for k in 0..n {
                        let want = plus[nq + k] - minus[nq + k];
                        assert!(
                            (got[k] - want / 2e-6).abs() < 2e-3 * scale,
                            "{name} {formulation} {what}[{k}]: {:e} against {:e}",
                            got[k],
                            want / 2e-6
                        );
                    }
                };
                for l in 0..n {
                    for (of, sign) in [(&mut plus, 1e-6), (&mut minus, -1e-6)] {
                        let mut z = y.clone();
                        displace(&m, formulation, &mut z, l, sign);
                        m.evaluator(ActiveSet::Nothing).derivative(t, &z, of);
                    }
                    let column = &stiff.by_position[l * n..][..n];
                    check(format!("K{l}"), column, &plus, &minus, stiffest);
                    for (of, sign) in [(&mut plus, 1e-6), (&mut minus, -1e-6)] {
                        let mut z = y.clone();
                        z[nq + l] += sign;
                        m.evaluator(ActiveSet::Nothing).derivative(t, &z, of);
                    }
                    let column = &stiff.by_velocity[l * n..][..n];
                    check(format!("D{l}"), column, &plus, &minus, dampest);
                }
            }
        }
    }

    const ELEMENT_CASES: [(&str, &str); 7] = [
        (
            "coordinates of two degrees",
            "[[body]]\nname = \"ring\"\nmass = \"1 kg\"\ninertia = \"2e-2 3e-2 4e-2 kg m^2\"\n\
             [[body]]\nname = \"cross\"\nmass = \"1 kg\"\ninertia = \"3e-2 3e-2 4e-2 kg m^2\"\n\
             [[joint]]\nname = \"ring\"\nkind = \"cylindrical\"\nparent = \"arm\"\nchild = \"ring\"\naxis = [2, 1, 0]\n\
             parent_point = \"0 50 20 mm\"\nchild_point = \"10 -40 0 mm\"\nrotation = { axis = [1, 2, 0], angle = \"25 deg\" }\n\
             start = { position = \"0.2 mm\", velocity = \"0.3 mm/s\", angle = \"0.2 mrad\", angular_velocity = \"1 mrad/s\" }\n\
             [[joint]]\nname = \"cross\"\nkind = \"universal\"\nparent = \"wheel\"\nchild = \"cross\"\naxis = [1, 2, 0]\n\
             child_axis = [0, 0, 1]\nparent_point = \"20 0 10 mm\"\nchild_point = \"0 30 20 mm\"\n\
             start = { angle = \"0.3 mrad\", angular_velocity = \"1 mrad/s\", child_angle = \"-0.2 mrad\", child_angular_velocity = \"2 mrad/s\" }\n\
             [[joint_spring]]\nname = \"t\"\njoint = \"ring\"\ncoordinate = \"position\"\nstiffness = \"900 N/mm\"\ndamping = \"7 kN s/m\"\n\
             [[joint_spring]]\nname = \"u\"\njoint = \"ring\"\ncoordinate = \"angle\"\nstiffness = \"20 kN m/rad\"\ndamping = \"200 N m s/rad\"\n\
             [[joint_spring]]\nname = \"v\"\njoint = \"cross\"\ncoordinate = \"angle\"\nstiffness = \"20 kN m/rad\"\ndamping = \"200 N m s/rad\"\n\
             [[motor]]\nname = \"w\"\njoint = \"cross\"\ncoordinate = \"child_angle\"\nstiffness = \"20 kN m/rad\"\ndamping = \"200 N m s/rad\"\n\
             target = { law = \"harmonic\", amplitude = \"0.5 mrad\", frequency = \"1 Hz\" }\n",
        ),
        (
            // Near the lengths of small tension: rotation of large forces with the bodies is left out.
            "curves",
            "[[spring]]\nname = \"s\"\nfrom = { body = \"world\", at = \"-50 90 20 mm\" }\nto = { body = \"rod\" }\nlength = \"1009.2 mm\"\n\
             characteristic = [[\"-0.2 mm\", \"-150 N\"], [0, \"-40 N\"], [\"0.1 mm\", \"60 N\"], [\"0.4 mm\", \"500 N\"]]\n\
             damping = \"7 kN s/m\"\n\
             [[joint_spring]]\nname = \"t\"\njoint = \"arm\"\ndamping = \"200 N m s/rad\"\n\
             characteristic = [[\"-1 mrad\", \"-20 N m\"], [0, \"1 N m\"], [\"0.5 mrad\", \"9 N m\"], [\"2 mrad\", \"70 N m\"]]\n\
             [[joint_spring]]\nname = \"u\"\njoint = \"rod\"\n\
             characteristic = [[\"0.1 mm\", \"-2 N\"], [\"0.2 mm\", \"10 N\"], [\"0.5 mm\", \"300 N\"]]\n",
        ),
        (
            "tyres",
            "[[tyre]]\nname = \"t\"\non = { body = \"rod\", at = \"30 -20 50 mm\" }\nradius = \"43.723 mm\"\nup = [1, 2, 3]\n\
             stiffness = \"900 N/mm\"\ndamping = \"30 kN s/m\"\n\
             ground = { law = \"harmonic\", mean = \"1 m\", amplitude = \"0.05 mm\", frequency = \"1 Hz\" }\n\
             [[tyre]]\nname = \"w\"\non = { body = \"wheel\" }\nradius = \"1 mm\"\nup = [0, 1, 1]\n\
             stiffness = \"900 N/mm\"\ndamping = \"30 kN s/m\"\n\
             ground = { law = \"constant\", position = \"-12.817 mm\", velocity = \"0.5 mm/s\" }\n",
        ),
        (
            "joint springs",
            "[[joint_spring]]\nname = \"t\"\njoint = \"arm\"\nstiffness = \"20 kN m/rad\"\ndamping = \"200 N m s/rad\"\n\
             [[joint_spring]]\nname = \"u\"\njoint = \"rod\"\nstiffness = \"900 N/mm\"\ndamping = \"7 kN s/m\"\n\
             [[joint_spring]]\nname = \"v\"\njoint = \"table\"\nstiffness = \"900 N/mm\"\ndamping = \"7 kN s/m\"\n\
             [[joint_spring]]\nname = \"w\"\njoint = \"wheel\"\nstiffness = \"20 kN m/rad\"\ndamping = \"200 N m s/rad\"\n",
        ),
        (
            "stops",
            "[[stop]]\nname = \"t\"\njoint = \"arm\"\nupper = 0\ntorque = \"6 N m\"\ndepth = \"0.3 mrad\"\nrestitution = 0.5\nspeed = \"10 mrad/s\"\n\
             [[stop]]\nname = \"u\"\njoint = \"rod\"\nlower = \"0.6 mm\"\nforce = \"300 N\"\ndepth = \"0.3 mm\"\nrestitution = 0.5\nspeed = \"10 mm/s\"\n\
             [[stop]]\nname = \"w\"\njoint = \"wheel\"\nlower = \"0.5 mrad\"\nupper = \"0.7 mrad\"\ntorque = \"4 N m\"\ndepth = \"0.3 mrad\"\n\
             restitution = 0.5\nspeed = \"10 mrad/s\"\n",
        ),
        (
            "bushings",
            "[[bushing]]\nname = \"t\"\nfrom = { body = \"base\", at = \"100 20 -30 mm\" }\nto = { body = \"arm\", at = \"-80 10 20 mm\" }\n\
             rotation = { axis = [1, 2, 3], angle = \"40 deg\" }\naxes = { axis = [0, 2, 1], angle = \"20 deg\" }\n\
             stiffness = \"900 500 300 N/mm\"\ndamping = \"7 5 9 kN s/m\"\n\
             turning_stiffness = \"20 30 40 kN m/rad\"\nturning_damping = \"200 300 100 N m s/rad\"\n\
             [[bushing]]\nname = \"u\"\nfrom = { body = \"table\", at = \"0 0 1000 mm\" }\nto = { body = \"base\" }\n\
             rotation = { axis = [3, 1, 2], angle = \"50 deg\" }\naxes = { axis = [1, 2, 1], angle = \"70 deg\" }\n\
             stiffness = \"900 500 300 N/mm\"\ndamping = \"7 5 9 kN s/m\"\n\
             turning_stiffness = \"20 30 40 kN m/rad\"\nturning_damping = \"200 300 100 N m s/rad\"\n\
             [[bushing]]\nname = \"w\"\nfrom = { body = \"wheel\", at = \"-80 10 20 mm\" }\nto = { body = \"table\", at = \"100 20 -30 mm\" }\n\
             rotation = { axis = [1, 2, 3], angle = \"-40 deg\" }\n\
             stiffness = \"900 500 300 N/mm\"\nturning_stiffness = \"20 30 40 kN m/rad\"\n",
        ),
        (
            "motors",
            "[[motor]]\nname = \"t\"\njoint = \"arm\"\nstiffness = \"20 kN m/rad\"\ndamping = \"200 N m s/rad\"\n\
             target = { law = \"harmonic\", amplitude = \"0.5 mrad\", frequency = \"1 Hz\" }\n\
             [[motor]]\nname = \"u\"\njoint = \"rod\"\nstiffness = \"900 N/mm\"\ndamping = \"7 kN s/m\"\nlimit = \"5 kN\"\n\
             target = { law = \"constant\", position = \"0.25 mm\", velocity = \"0.5 mm/s\" }\n\
             [[motor]]\nname = \"w\"\njoint = \"wheel\"\nstiffness = \"20 kN m/rad\"\ntorque = \"3 N m\"\n\
             target = { law = \"harmonic\", mean = \"0.1 mrad\", amplitude = \"0.5 mrad\", frequency = \"1 Hz\" }\n",
        ),
    ];
}
