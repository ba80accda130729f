//! Which joints with play act on one another.

use super::{ElementKind, Formulation, Machine};

/// Largest number of products in the elimination of coupled contacts for which presets choose it; the method's own limit is twice
/// as large (`mechanism::bounds`).
const MAX_PRODUCTS: usize = 1 << 24;

/// Joints with play that act on one another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Coupled {
    /// Those that share with another one what an impact accelerates: a tree of bodies, or trees that ideal joints connect.
    pub joints: usize,
    /// Whether few enough of them are coupled at once to be solved for together.
    pub is_narrow: bool,
}

impl Machine {
    /// The joints with play that act on one another, in time linear in the size of the machine.
    pub fn coupled_joints(&self) -> Coupled {
        let tree_of = self.trees();
        let mut linked: Vec<usize> = (0..self.bodies.len()).collect();
        let ideal = self.loose_joints.iter().filter(|joint| joint.contact.is_ideal());
        let ends = ideal.map(|joint| [joint.carrier(), joint.carried()]);
        let mut loops = 0;
        for [a, b] in ends.chain(self.closing_joints.iter().map(super::Joint::points)) {
            let trees = [a, b].map(|end| end.body.and_then(|body| tree_of[body]));
            loops += usize::from(trees != [None; 2]);
            if let [Some(a), Some(b)] = trees {
                let (a, b) = (root(&mut linked, a), root(&mut linked, b));
                linked[a.max(b)] = a.min(b);
            }
        }
        // Of each joint, and of each element twice, for its force and its torque, or of a lubricant for its drag and its stations: the
        // trees it acts on.
        let of_joints = self.loose_joints.iter().map(|joint| [joint.carrier().body, joint.carried().body]);
        let points = self.elements.iter().map(|element| element.points(self));
        let of_elements = points.zip(&self.elements).flat_map(|(points, element)| {
            let bodies = [0, 1].map(|n| points.get(n).and_then(|point| point.body));
            std::iter::repeat_n(bodies, if matches!(element.kind, ElementKind::Lubricant(_)) { 3 } else { 2 })
        });
        let rows = of_joints.chain(of_elements).map(|bodies| bodies.map(|body| body.and_then(|body| tree_of[body])));
        let rows: Vec<[Option<usize>; 2]> = rows.collect();
        let (mut first, mut bandwidth) = (vec![None; self.bodies.len()], 0);
        for (row, trees) in rows.iter().enumerate() {
            for &tree in trees.iter().flatten() {
                bandwidth = bandwidth.max(row - *first[tree].get_or_insert(row));
            }
        }
        if loops > 0 || self.formulation == Formulation::Lagrange {
            bandwidth = rows.len();
        }
        // Linked trees count as one; a joint within it counts once.
        let mut on = vec![0; self.bodies.len()];
        let mut acts_on = Vec::with_capacity(self.loose_joints.len());
        for (_, trees) in self.loose_joints.iter().zip(&rows).filter(|(joint, _)| !joint.contact.is_ideal()) {
            let mut trees = trees.map(|tree| tree.map(|tree| root(&mut linked, tree)));
            if trees[0] == trees[1] {
                trees[1] = None;
            }
            trees.iter().flatten().for_each(|&tree| on[tree] += 1);
            acts_on.push(trees);
        }
        let is_coupled = |trees: &&[Option<usize>; 2]| trees.iter().flatten().any(|&tree| on[tree] > 1);
        Coupled {
            joints: acts_on.iter().filter(is_coupled).count(),
            is_narrow: 40 * rows.len() * (bandwidth + 1) * (bandwidth + 1) <= MAX_PRODUCTS,
        }
    }

    /// The tree of each body, by its first body; `None` if the body moves with time alone.
    fn trees(&self) -> Vec<Option<usize>> {
        let mut trees: Vec<Option<usize>> = Vec::with_capacity(self.joints.len());
        for (body, joint) in self.joints.iter().enumerate() {
            let above = joint.parent.and_then(|parent| trees[parent]);
            trees.push(above.or((!joint.is_prescribed()).then_some(body)));
        }
        trees
    }
}

/// The first of the trees that `linked` connects with `tree`.
pub(crate) fn root(linked: &mut [usize], mut tree: usize) -> usize {
    while linked[tree] != tree {
        linked[tree] = linked[linked[tree]];
        tree = linked[tree];
    }
    tree
}
