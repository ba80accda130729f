//! Rows of joints with play that the joints of the tree imply: the pin of a planar machine, all of whose hinges are parallel, neither
//! tilts nor leaves its plane. They would cost as much as others, and make the constraints dependent.

use super::super::kinematics::Kinematics;
use super::super::model::{Model, Motion};
use super::super::pairs::Rows;
use super::super::tree::Tree;
use crate::machine::{Joint, Machine};

/// Poses at which a row must hold to count as implied: arbitrary ones, as a row that holds by chance at one fails at another.
const POSES: usize = 3;
/// Violation that is rounding, over 1 m and the distance of the bodies from the origin.
const ROUNDING: f64 = 1e-12;

/// Removes the rows of `model` that hold at any coordinates of the tree and any positions of the drives.
pub fn drop_implied(model: &mut Model, machine: &Machine) {
    if model.lasting.is_empty() {
        return;
    }
    let undriven = |joint: &Joint| Joint { drive: None, second_drive: None, ..joint.clone() };
    let tree = Machine {
        bodies: machine.bodies.clone(),
        joints: machine.joints.iter().map(undriven).collect(),
        ..Machine::default()
    };
    let tree = Model::new(&tree);
    let poses: Vec<Vec<Kinematics>> = (0..POSES).map(|pose| arbitrary(&tree, pose)).collect();
    for (_, cut) in &mut model.lasting {
        let (child, parent) = (cut.child.body, cut.parent.body);
        let holds = |rows: &Rows, motion: &[Kinematics]| {
            let [c, p] = [child, parent].map(|body| &motion[body]);
            let limit = ROUNDING * (1.0 + c.position.norm() + p.position.norm());
            let mut implied = true;
            rows.linearise(c, p, &[], |_, _, [value, rate, _]| {
                implied &= value.abs() <= limit && rate.abs() <= limit * (1.0 + c.velocity.norm() + p.velocity.norm());
            });
            implied
        };
        for rows in &mut cut.rows {
            rows.retain(|rows| !poses.iter().all(|motion| holds(rows, motion)));
        }
    }
    model.lasting.retain(|(_, cut)| cut.rows.iter().any(|rows| !rows.is_empty()));
}

/// Motion of the bodies at arbitrary coordinates and rates.
fn arbitrary(model: &Model, pose: usize) -> Vec<Kinematics> {
    // Multiples of an irrational number are spread evenly.
    let number = |i: usize| {
        let turn = 0.618_033_988_749_895 * (i + 1) as f64 + 0.414_213_562_373_095 * (pose + 1) as f64;
        2.0 * (turn - libm::floor(turn)) - 1.0
    };
    let mut y: Vec<f64> = (0..model.start_state.len()).map(number).collect();
    for body in &model.bodies {
        if let Motion::Free { q, .. } = body.motion {
            let turn = &mut y[q + 3..q + 7];
            let size = turn.iter().map(|x| x * x).sum::<f64>().sqrt();
            turn.iter_mut().for_each(|x| *x /= size);
        }
    }
    let mut tree = Tree::without_masses(model);
    tree.update_kinematics(model, 0.0, &y);
    tree.motion
}
