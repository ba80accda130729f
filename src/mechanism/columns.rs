//! How each coordinate moves a contact.

use super::kinematics::Kinematics;
use super::model::BallJoint;
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

/// How each coordinate moves the contact of `joint` with normal `n`, into `columns`.
pub fn collect_columns(
    columns: &mut Vec<Column>,
    c: &Coefficients,
    motion: &[Kinematics],
    joint: &BallJoint,
    n: &Vec3,
    visit: &impl Fn(usize, &Vec3, &mut dyn FnMut(usize, Vec3, Vec3)),
) {
    columns.clear();
    let sides = [
        (&joint.ball, c.ball_radius, 1.0),
        (&joint.socket, c.ball_radius + c.clearance, -1.0),
    ];
    for (anchor, radius, sign) in sides {
        let m = &motion[anchor.body];
        let centre = m.position + m.rotation * anchor.offset;
        let to_surface = n * radius;
        visit(anchor.body, &centre, &mut |coordinate, velocity, omega| {
            let centre = velocity * sign;
            let surface = (velocity + omega.cross(&to_surface)) * sign;
            let turn = omega * (radius * sign);
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
        });
    }
}
