//! Bodies without mass between the joints of a tree: where the equations of motion have a solution.

use super::model::{Model, Motion};
use super::tree::Tree;
use super::{MechanismError, Vec3};
use crate::machine::{Formulation, Machine};

/// Checks that the accelerations of a machine with bodies of mass 0 are determined at its start values.
///
/// # Errors
/// A formulation that divides by the mass of every body, or a singular mass matrix.
pub fn check(machine: &Machine, model: &Model) -> Result<(), MechanismError> {
    let Some(body) = machine.bodies.iter().find(|body| body.mass == 0.0) else {
        return Ok(());
    };
    if machine.formulation == Formulation::Lagrange {
        return Err(MechanismError::NeedsMass { body: body.name.clone() });
    }
    let mut tree = Tree::new(model);
    tree.update_kinematics(model, 0.0, &model.start_state);
    tree.assemble(model, &Vec3::zeros(), &mut vec![0.0; model.nv]);
    let Some(dependent) = tree.dependent_coordinate(model) else {
        return Ok(());
    };
    let moves = |motion| match motion {
        Motion::Prismatic { v, .. } | Motion::Revolute { v, .. } => v == dependent,
        Motion::Free { v, .. } => (v..v + 6).contains(&dependent),
        Motion::Fixed | Motion::Driven { .. } => false,
    };
    let dependent_body = model.bodies.iter().position(|body| moves(body.motion)).unwrap_or_default();
    let child = model.two_degree_joint_at(dependent_body).map_or(dependent_body, |(pair, _)| pair.child.body);
    Err(MechanismError::Undetermined { joint: machine.joints[child].name.clone() })
}
