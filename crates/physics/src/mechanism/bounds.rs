//! Cost of a scene's equations, counted in time linear in its size and before anything is allocated.
//!
//! The matrices are sparse, but fill in for a body that carries many joints or for a long row of hinges. Memory then grows with
//! the square of the size, and the cost of an evaluation with its cube. `docs/scene-format.md` states the limits for such scenes.

use super::MechanismError;
use super::factor::NONE;
use super::lagrange::Layout;
use super::model::{BodyIndex, Model, Motion};
use super::pairs::Rows;
use crate::integrate::Method;
use crate::machine::{Formulation, Machine, StartRule};

/// Maximum number of matrix entries of one scene: 32 MiB.
pub const MAX_ENTRIES: u64 = 1 << 22;
/// Approximate maximum number of multiplications per evaluation: about 40 ms on a 2020 processor.
pub const MAX_PRODUCTS: u64 = 1 << 25;

/// Multiplications per ancestor of a body, and per pair of constraint rows on a body.
const PRODUCTS_PER_ANCESTOR: u64 = 20;
const PRODUCTS_PER_PAIR: u64 = 25;

/// The task whose cost exceeds a limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CostlyTask {
    /// Evaluating the equations.
    #[error("formulation {0}")]
    Formulation(Formulation),
    /// Closing the joints at the start.
    #[error("assembling the start")]
    Assembly,
    /// Solving for the forces of contacts that act on one another.
    #[error("solver.method discrete-gradient")]
    CoupledContacts,
}

/// The quantity limited.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LimitedQuantity {
    /// Matrix entries.
    #[error("numbers in its matrices")]
    Entries,
    /// Multiplications in mass matrices and constraint rows.
    #[error("multiplications in one evaluation")]
    Products,
}

/// Remedy for a scene that is too costly.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Advice {
    /// Another formulation.
    #[error("choose formulation = {0}")]
    Formulation(Formulation),
    /// Another method.
    #[error("choose solver.method = {0}")]
    Method(Method),
    /// A smaller scene.
    #[error("choose fewer bodies and joints, or clearances for ideal ball joints on one body")]
    Smaller,
}

/// Upper bounds on the cost of one formulation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Matrix entries.
    pub entries: u64,
    /// Multiplications per evaluation.
    pub products: u64,
}

impl Cost {
    fn add(&mut self, entries: u64, products: u64) {
        self.entries += entries;
        self.products += products;
    }

    /// Adds the cost of storing and factoring an envelope matrix whose rows begin at the columns `first`.
    fn add_envelope(&mut self, first: &[u64]) {
        for (i, f) in (0_u64..).zip(first) {
            self.entries += i - f + 1;
        }
        if self.entries > MAX_ENTRIES {
            return;
        }
        for (i, &f) in (0_u64..).zip(first) {
            let row = (f..).zip(&first[f as usize..i as usize]);
            self.products += row.map(|(j, &g)| j - f.max(g) + 1).sum::<u64>();
        }
    }

    fn fits(&self) -> bool {
        self.entries <= MAX_ENTRIES && self.products <= MAX_PRODUCTS
    }

    /// Cost of the equations in formulation `form`; in tree coordinates, with the joints `closed` as constraints.
    pub fn of(form: Formulation, machine: &Machine, model: &Model, closed: &[usize]) -> Self {
        match form {
            Formulation::Tree => Self::of_tree(model, closed),
            Formulation::Lagrange => Self::of_lagrange(&Layout::new(machine, model), model),
        }
    }

    /// Cost of the `tree` formulation with these joints closed.
    fn of_tree(model: &Model, joints: &[usize]) -> Self {
        let mut cost = Self::default();
        // Number of coordinates visited by a solve with each block's mass matrix.
        let mut solution = Vec::with_capacity(model.blocks.len());
        for block in &model.blocks {
            let n = block.n as u64;
            if block.single_free_body.is_some() {
                solution.push(2 * n);
                continue;
            }
            let mut depth: Vec<u64> = Vec::with_capacity(block.n);
            let (mut sum, mut squares) = (0, 0);
            for &parent in &block.pattern.parent {
                let above = if parent == NONE { 0 } else { depth[parent] };
                depth.push(above + 1);
                sum += above + 1;
                squares += (above + 1) * (above + 1);
            }
            cost.add(n * n, squares / 2);
            solution.push(2 * sum);
        }
        let mut depth = vec![0; model.bodies.len()];
        for &b in &model.order {
            let body = &model.bodies[b];
            let above = depth.get(body.parent).copied().unwrap_or(0);
            depth[b] = if body.driven_only { 0 } else { above + 1 };
            if !matches!(body.motion, Motion::Fixed | Motion::Driven { .. }) {
                cost.add(0, PRODUCTS_PER_ANCESTOR * above);
            }
        }
        let block_of = |b: BodyIndex| {
            let body = model.bodies.get(b)?;
            (!body.driven_only).then(|| model.block_of[b])
        };
        let mut first_on = vec![u64::MAX; model.blocks.len()];
        let mut sides_on = vec![0_u64; model.blocks.len()];
        let mut rows = Vec::with_capacity(3 * joints.len());
        let units = model.cuts(joints).flat_map(|cut| {
            let bodies = [cut.child.body, cut.parent.body];
            cut.rows.map(|rows| (bodies, rows.iter().map(Rows::count).sum::<usize>()))
        });
        for (bodies, count) in units.filter(|(_, count)| *count > 0) {
            let at = rows.len() as u64;
            let mut first = at;
            let [ball, socket] = bodies.map(block_of);
            for block in [ball, socket.filter(|_| socket != ball)].into_iter().flatten() {
                let n = model.blocks[block].n as u64;
                first_on[block] = first_on[block].min(at);
                first = first.min(first_on[block]);
                sides_on[block] += 1;
                cost.add(6 * n, 3 * solution[block] + sides_on[block] * 9 * n);
            }
            for b in bodies {
                cost.add(0, 3 * PRODUCTS_PER_ANCESTOR * depth.get(b).copied().unwrap_or(0));
            }
            rows.extend(std::iter::repeat_n(first, count));
        }
        cost.add_envelope(&rows);
        let n = model.nv as u64;
        if n > 0 && rows.len() as u64 == n {
            // The determinant, whose sign changes across a singular pose.
            cost.add(n * n, n.saturating_pow(3) / 3);
        }
        cost
    }

    /// Cost of the `lagrange` formulation.
    fn of_lagrange(layout: &Layout, model: &Model) -> Self {
        let mut cost = Self::default();
        let world = model.world();
        let mut rows_on = vec![0_u64; world];
        let mut first_on = vec![u64::MAX; world];
        let mut first_of = Vec::new();
        for group in &layout.groups {
            let (at, rows) = (group.first as u64, group.rows().len() as u64);
            let mut first = at;
            for body in [group.child, group.parent] {
                if body != world {
                    first_on[body] = first_on[body].min(at);
                    first = first.min(first_on[body]);
                    rows_on[body] += rows;
                    // Two indices are stored per pair.
                    let pairs = rows * rows_on[body];
                    cost.add(2 * pairs, PRODUCTS_PER_PAIR * pairs);
                }
            }
            first_of.extend((0..rows).map(|_| first));
        }
        cost.add_envelope(&first_of);
        cost
    }

    /// Cost of solving for the forces of coupled contacts: `joints` contacts, each coupled with `bandwidth` joints before and
    /// after it, with columns of `width` numbers in total.
    pub fn of_coupled_contacts(joints: usize, bandwidth: usize, width: usize) -> Self {
        let (joints, bandwidth, width) = (joints as u64, bandwidth as u64, width as u64);
        let band = joints * (2 * bandwidth + 1);
        // Entries: three 3 x 3 blocks; three columns, and ten numbers per Jacobian column. Products: one elimination, and the
        // blocks.
        Self { entries: 27 * band + 13 * width, products: 40 * joints * (bandwidth + 1) * (bandwidth + 1) + 250 * band }
    }

    /// Rejects a cost beyond a limit; `of` names the task.
    ///
    /// # Errors
    /// The amount needed, and the limit.
    pub fn check(&self, of: CostlyTask, advice: Advice) -> Result<(), MechanismError> {
        let (what, needed, most) = if self.entries > MAX_ENTRIES {
            (LimitedQuantity::Entries, self.entries, MAX_ENTRIES)
        } else if self.products > MAX_PRODUCTS {
            (LimitedQuantity::Products, self.products, MAX_PRODUCTS)
        } else {
            return Ok(());
        };
        Err(MechanismError::TooCostly { of, what, needed, most, advice })
    }
}

/// Approximate time of one evaluation, ns on one core of a server, measured on chains, the paper's mechanism and machines with
/// ideal joints: a constant, plus terms per velocity coordinate, per joint with clearance, and per multiplication in mass
/// matrices and constraint rows. Only its ratio to the times of linear algebra matters.
pub fn evaluation_time(machine: &Machine, model: &Model) -> f64 {
    let cost = Cost::of(machine.formulation, machine, model, &model.ideal_joints);
    let loose = model.joints.len() - model.ideal_joints.len();
    600.0 + 6.0 * model.nv as f64 + 60.0 * loose as f64 + 0.8 * cost.products as f64
}

/// Approximate time to linearise, factor and solve an implicit step, ns. `coordinates` is the number of velocity coordinates
/// coupled by contacts and elements, `products` that of multiplications in the elimination with the real shift.
pub fn implicit_time(coordinates: usize, products: usize) -> f64 {
    800.0 * coordinates as f64 + 6.0 * products as f64
}

/// Approximate time to set up the system of this number of coupled contacts, with `blocks` within its band, ns.
pub fn coupling_time(rows: usize, blocks: usize) -> f64 {
    1200.0 * rows as f64 + 25.0 * blocks as f64
}

/// Approximate time of one iteration for their forces, ns; `products` of blocks in the elimination.
pub fn contact_time(rows: usize, products: usize) -> f64 {
    350.0 * rows as f64 + 7.0 * products as f64
}

/// Maximum number of velocity coordinates of the implicit methods, which hold dense matrices.
pub const MAX_DENSE: usize = 1024;
/// If all coordinates are coupled, an implicit step with more of them than this costs more than many explicit steps, and the
/// automatic choice stays explicit.
pub const MAX_COUPLED: usize = 96;

/// Rejects a scene whose equations, or whose assembly at the start, exceed the limits.
///
/// # Errors
/// As [`Cost::check`]; advises the other formulation if it is within the limits.
pub fn check(machine: &Machine, model: &Model) -> Result<(), MechanismError> {
    let closed = match model.start {
        StartRule::AsGiven | StartRule::Settled | StartRule::Equilibrium => model.ideal_joints.clone(),
        StartRule::Ideal => (0..model.joints.len()).collect(),
    };
    let cost = |form| Cost::of(form, machine, model, &closed);
    let own = cost(machine.formulation);
    // Assembly uses tree coordinates in every formulation.
    let assembly = match closed.is_empty() && model.closures.is_empty() {
        true => Cost::default(),
        false => cost(Formulation::Tree),
    };
    if own.fits() && assembly.fits() {
        return Ok(());
    }
    let helps = |form: &Formulation| *form != machine.formulation && cost(*form).fits();
    let other = Formulation::ALL.into_iter().find(helps);
    let advice = other.filter(|_| assembly.fits()).map_or(Advice::Smaller, Advice::Formulation);
    own.check(CostlyTask::Formulation(machine.formulation), advice)?;
    assembly.check(CostlyTask::Assembly, advice)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::{Attachment, Body, Joint, LooseJoint, Mat3, Vec3};

    /// Costs of `n` bodies in both formulations; `joint` is that of body `i`, `ball` the bodies of an ideal ball joint beside it.
    fn costs(n: usize, joint: impl Fn(usize) -> Joint, ball: impl Fn(usize) -> Option<usize>) -> [Cost; 2] {
        let mut machine = Machine::default();
        for i in 0..n {
            machine.add_body(Body::new(&format!("b{i}"), 1.0, Mat3::identity()), joint(i));
        }
        for (i, socket) in (1..n).filter_map(|i| Some((i, ball(i)?))) {
            let [socket, ball] = [socket, i].map(|body| Attachment::on(body, Vec3::zeros()));
            machine.loose_joints.push(LooseJoint::ball(&format!("S{i}"), socket, ball).with_clearance(0.0));
        }
        let model = Model::new(&machine);
        Formulation::ALL.map(|form| Cost::of(form, &machine, &model, &model.ideal_joints))
    }

    #[test]
    fn costs_of_sparse_scenes_grow_linearly_and_those_of_dense_ones_by_their_powers() {
        // Growth of (entries, multiplications) from n to 2n parts, for tree and lagrange: 2 is linear.
        let hinge = |parent: Option<usize>, i: usize| Joint::revolute(parent, i, Vec3::y());
        let in_a_row = |i: usize| hinge(i.checked_sub(1), i);
        let on_one = |i: usize| if i == 0 { Joint::free(0) } else { hinge(Some(0), i) };
        for (kind, both, tree, lagrange) in [
            ("free bodies", [200, 400].map(|n| costs(n, Joint::free, |_| None)), [1.0, 1.0], [1.0, 1.0]),
            ("a chain", [200, 400].map(|n| costs(n, Joint::free, |i| Some(i - 1))), [2.0, 2.0], [2.0, 2.0]),
            ("hinges in a row", [200, 400].map(|n| costs(n, in_a_row, |_| None)), [4.0, 8.0], [2.0, 2.0]),
            ("hinges on one body", [200, 400].map(|n| costs(n, on_one, |_| None)), [4.0, 2.0], [4.0, 8.0]),
            ("balls of one body", [200, 400].map(|n| costs(n, Joint::free, |_| Some(0))), [4.0, 8.0], [4.0, 8.0]),
        ] {
            let [once, twice] = both;
            for (form, growth) in [tree, lagrange].into_iter().enumerate() {
                let (a, b) = (once[form], twice[form]);
                let ratio = |a: u64, b: u64| b.max(1) as f64 / a.max(1) as f64;
                let got = [ratio(a.entries, b.entries), ratio(a.products, b.products)];
                for (got, at_most) in got.into_iter().zip(growth) {
                    assert!(got < 1.1 * at_most, "{kind}, form {form}: {got} of {at_most}");
                }
            }
        }
    }
}
