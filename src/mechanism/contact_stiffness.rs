//! How one contact's force answers to displacement and velocity, and how each coordinate moves the contact.

use super::contacts::Contacts;
use super::kinematics::Kinematics;
use super::model::BallJoint;
use crate::scene::{Mat3, Vec3};

/// Derivatives of one contact's force on the ball, and of its normal.
pub struct Stiffness {
    /// dF/de, N/m.
    pub by_displacement: Mat3,
    /// Part of dF that follows the centres' relative velocity, N s/m.
    pub by_rate: Mat3,
    /// Part of dF that follows the sliding velocity, N s/m.
    pub by_slip: Mat3,
    /// dn/de, 1/m.
    pub normal: Mat3,
    /// Change of the force per second by a clearance under way, N/s.
    pub by_clearance: Vec3,
    /// On the ball, N.
    pub force: Vec3,
    /// Normal, from socket to ball centre.
    pub n: Vec3,
}

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

/// Derivatives of contact `j`; `None` where it carries no force.
pub fn linearise_contact(
    contacts: &Contacts,
    motion: &[Kinematics],
    joint: &BallJoint,
    j: usize,
) -> Option<Stiffness> {
    let gap = &contacts.gaps()[j];
    if joint.ideal.is_some() || gap.normal_force <= 0.0 {
        return None;
    }
    let c = contacts.coefficients(j);
    let distance = gap.eccentricity.norm();
    let n = gap.eccentricity / distance;
    let rate = n.dot(&gap.eccentricity_rate) - contacts.clearance_rate(j);
    let penetration = distance - contacts.clearance(j);
    let memory = &contacts.memory()[j];
    let approach = memory.approach(c, rate);
    let follows = memory.active && c.approach_follows(memory.pace, memory.approach_speed, rate);
    let identity = Mat3::identity();
    let tangent = identity - n * n.transpose();
    let normal = tangent / distance;
    let root = penetration.sqrt();
    let elastic = c.stiffness * penetration * root;
    let factor = 1.0 + c.damping * rate / approach;
    let by_penetration = 1.5 * c.stiffness * root * factor;
    let by_rate = if follows {
        0.0
    } else {
        elastic * c.damping / approach
    };
    let force_n = gap.normal_force;

    // F = -F_N n - mu F_N t, with t along the sliding velocity.
    let mut along = -n;
    let mut by_slip = Mat3::zeros();
    let mut by_normal = identity * -force_n;
    if c.friction > 0.0 {
        let speed = gap.slip_speed;
        let per_speed = c.friction_per_speed(memory.slip, speed);
        let radius = c.ball_radius;
        let (ball, socket) = (&motion[joint.ball.body], &motion[joint.socket.body]);
        let mut sliding = gap.eccentricity_rate;
        if c.surface {
            sliding += ball.angular_velocity.cross(&(n * radius))
                - socket
                    .angular_velocity
                    .cross(&(n * (radius + contacts.clearance(j))));
        }
        let t = if speed > 0.0 {
            (sliding - n * n.dot(&sliding)) / speed
        } else {
            Vec3::zeros()
        };
        along -= t * (per_speed * speed);
        let slope = speed * c.friction_per_speed_slope(memory.slip, speed);
        by_slip = (tangent * per_speed + t * t.transpose() * slope) * -force_n;
        // The tangent plane turns with n: d(v_t) = -(n . w) dn - n (w . dn).
        by_normal += by_slip * (identity * -n.dot(&sliding));
        by_slip *= tangent;
    }
    // d(delta_dot)/de = e_dot_t / |e|.
    let rate_by_e = normal * gap.eccentricity_rate;
    let by_displacement =
        along * (n * by_penetration + rate_by_e * by_rate).transpose() + by_normal * normal;
    Some(Stiffness {
        by_displacement,
        by_rate: along * (n * by_rate).transpose(),
        by_slip,
        normal,
        by_clearance: along * (by_penetration * contacts.clearance_rate(j)),
        force: n * -force_n + gap.friction,
        n,
    })
}

/// How each coordinate moves contact `j` with normal `n`, into `columns`.
pub fn collect_columns(
    columns: &mut Vec<Column>,
    contacts: &Contacts,
    motion: &[Kinematics],
    joint: &BallJoint,
    j: usize,
    n: &Vec3,
    visit: &impl Fn(usize, &Vec3, &mut dyn FnMut(usize, Vec3, Vec3)),
) {
    columns.clear();
    let radius = contacts.coefficients(j).ball_radius;
    let sides = [
        (&joint.ball, radius, 1.0),
        (&joint.socket, radius + contacts.clearance(j), -1.0),
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
