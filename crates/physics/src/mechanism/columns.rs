//! Jacobian columns of a contact, one per coordinate.

use super::equations::Equations;
use super::model::{Anchor, Model};
use crate::machine::Vec3;

/// Jacobian columns of one contact for one coordinate: relative velocities per unit rate.
#[derive(Clone, Copy)]
pub struct Column {
    /// Velocity coordinate.
    pub coordinate: usize,
    /// Ball centre relative to socket centre.
    pub centre: Vec3,
    /// Ball's contact point relative to the socket's.
    pub surface: Vec3,
    /// r omega_ball - R omega_socket, with r and R the lengths of the sides.
    pub turn: Vec3,
}

/// Fills `columns` with the velocity of the first point relative to the second per unit rate of each coordinate, and likewise for
/// the points of their bodies offset from them along `n`.
pub fn collect_columns(
    columns: &mut Vec<Column>,
    model: &Model,
    equations: &dyn Equations,
    sides: &[(Anchor, f64); 2],
    n: &Vec3,
) {
    columns.clear();
    let block = |side: usize| model.block_of.get(sides[side].0.body);
    let one_tree = block(0) == block(1);
    for ((anchor, radius), sign) in sides.iter().zip([1.0, -1.0]) {
        let m = &equations.motion()[anchor.body];
        let centre = m.position + m.rotation * anchor.offset;
        let to_surface = n * *radius;
        equations.visit_columns(model, anchor.body, &centre, &mut |coordinate, velocity, omega| {
            let centre = velocity * sign;
            let surface = (velocity + omega.cross(&to_surface)) * sign;
            let turn = omega * (*radius * sign);
            // A coordinate that is an ancestor of both bodies moves both.
            let shared = one_tree.then(|| columns.iter_mut().find(|c| c.coordinate == coordinate)).flatten();
            if let Some(column) = shared {
                column.centre += centre;
                column.surface += surface;
                column.turn += turn;
            } else {
                columns.push(Column { coordinate, centre, surface, turn });
            }
        });
    }
}

/// The same for two coincident points, without the coordinates that move both bodies as one.
pub fn collect_relative_columns(
    columns: &mut Vec<Column>,
    model: &Model,
    equations: &dyn Equations,
    sides: &[(Anchor, f64); 2],
) {
    const SHARED: usize = usize::MAX;
    columns.clear();
    let mut shared = 0;
    for ((anchor, radius), sign) in sides.iter().zip([1.0, -1.0]) {
        let m = &equations.motion()[anchor.body];
        let point = m.position + m.rotation * anchor.offset;
        let of_first = columns.len();
        equations.visit_columns(model, anchor.body, &point, &mut |coordinate, velocity, omega| {
            // Both walks end at the root and visit the shared coordinates in the same order.
            let own = columns[shared..of_first].iter().position(|c| c.coordinate == coordinate);
            if let Some(at) = own {
                columns[shared + at].coordinate = SHARED;
                shared += at + 1;
                return;
            }
            columns.push(Column {
                coordinate,
                centre: velocity * sign,
                surface: velocity * sign,
                turn: omega * (*radius * sign),
            });
        });
    }
    columns.retain(|column| column.coordinate != SHARED);
}
