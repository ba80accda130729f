//! Contents of a scene, and the computations it needs.

use super::Mechanism;

/// Counts for `jointplay check`, and for tests that a scene pays only for what it contains.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Summary {
    /// Moving bodies.
    pub bodies: usize,
    /// Bodies whose motion is prescribed by time alone.
    pub driven_bodies: usize,
    /// Driven coordinates.
    pub drives: usize,
    /// Velocity coordinates of the formulation.
    pub velocity_coordinates: usize,
    /// Position coordinates of the formulation.
    pub position_coordinates: usize,
    /// Constraint rows of the formulation.
    pub constraint_rows: usize,
    /// Of these, redundant rows; known once the mechanism has been assembled.
    pub dependent_rows: usize,
    /// Degrees of freedom left.
    pub degrees_of_freedom: usize,
    /// Ideal joints among those that may have play.
    pub ideal_joints: usize,
    /// Joints that close loops besides the joints with play.
    pub closing_joints: usize,
    /// Places where joints with play can touch: contacts evaluated at every step.
    pub contacts: usize,
    /// Contacts with friction.
    pub frictional_contacts: usize,
    /// Blocks of the mass matrix that consist of a single free body.
    pub single_body_blocks: usize,
    /// Maximum number of velocity coordinates for which the method `automatic` also considers implicit steps.
    pub largest_implicit: usize,
    /// Whether a differential equation is solved at all.
    pub solves_differential_equation: bool,
}

impl Summary {
    pub(super) fn new(mechanism: &Mechanism) -> Self {
        let model = &mechanism.model;
        let equations = &mechanism.equations;
        let velocity_coordinates = equations.velocities(model);
        let (constraint_rows, rank) = (equations.rows(), equations.rank());
        Self {
            bodies: model.massive,
            driven_bodies: model.bodies[..model.massive].iter().filter(|b| b.driven_only).count(),
            drives: model.drives.len(),
            velocity_coordinates,
            position_coordinates: equations.positions(model),
            constraint_rows,
            dependent_rows: constraint_rows - rank,
            degrees_of_freedom: velocity_coordinates.saturating_sub(rank),
            ideal_joints: model.ideal_joints.len(),
            closing_joints: model.closures.len(),
            frictional_contacts: mechanism.contacts.iter().filter(|contact| contact.law.has_friction()).count(),
            contacts: mechanism.contacts.len(),
            single_body_blocks: model.blocks.iter().filter(|b| b.single_free_body.is_some()).count(),
            largest_implicit: mechanism.largest_implicit(),
            solves_differential_equation: !mechanism.is_kinematic(),
        }
    }
}
