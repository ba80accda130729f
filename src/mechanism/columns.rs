//! How each coordinate moves a contact.

use super::equations::Equations;
use super::model::{Anchor, BallJoint, Model};
use crate::contact::Coefficients;
use crate::scene::Vec3;

/// Columns of one contact: how each coordinate moves it.
#[derive(Clone, Copy)]
pub struct Column {
    /// Velocity coordinate.
    pub coordinate: usize,
    /// Ball centre against socket centre.
    pub centre: Vec3,
    /// Ball's contact point against the socket's.
    pub surface: Vec3,
    /// r omega_ball - R omega_socket.
    pub turn: Vec3,
}

/// Points that a contact acts on: of the ball, then of the socket, each with the radius from there to the wall, m.
pub fn contact_sides(joint: &BallJoint, c: &Coefficients) -> [(Anchor, f64); 2] {
    [
        (joint.ball, c.ball_radius),
        (joint.socket, c.ball_radius + c.clearance),
    ]
}

/// Fills `columns`: how each coordinate moves the first of two points against the second, and points of their bodies that lie
/// beyond them along `n`.
pub fn collect_columns(
    columns: &mut Vec<Column>,
    model: &Model,
    equations: &dyn Equations,
    sides: &[(Anchor, f64); 2],
    n: &Vec3,
) {
    columns.clear();
    for ((anchor, radius), sign) in sides.iter().zip([1.0, -1.0]) {
        let m = &equations.motion()[anchor.body];
        let centre = m.position + m.rotation * anchor.offset;
        let to_surface = n * *radius;
        equations.visit_columns(
            model,
            anchor.body,
            &centre,
            &mut |coordinate, velocity, omega| {
                let centre = velocity * sign;
                let surface = (velocity + omega.cross(&to_surface)) * sign;
                let turn = omega * (*radius * sign);
                // A coordinate above both bodies of the joint moves both.
                if let Some(column) = columns.iter_mut().find(|c| c.coordinate == coordinate) {
                    column.centre += centre;
                    column.surface += surface;
                    column.turn += turn;
                } else {
                    columns.push(Column {
                        coordinate,
                        centre,
                        surface,
                        turn,
                    });
                }
            },
        );
    }
}
