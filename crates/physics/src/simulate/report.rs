//! Fills a [`Frame`] from the latest evaluation of the equations.

use super::angles::pose_of;
use super::frame::{BodyMotion, ContactMode, Frame, JointReport, SiteReport, Sliding};
use crate::contact::ContactState;
use crate::machine::{Attachment, LooseJoint, LooseKind, Machine, Vec3};
use crate::mechanism::{ContactId, Contacts, Mechanism, angle_of};

/// Share of the limit of friction from which bristles count as sliding: at the limit, to rounding.
const AT_LIMIT: f64 = 1.0 - 1e-9;

/// Fills `out` after [`Evaluator::evaluate_fully`](crate::mechanism::Evaluator::evaluate_fully) at (`time`, `y`), with the
/// contact states `contact_states`.
pub(super) fn fill(
    mechanism: &mut Mechanism,
    machine: &Machine,
    contact_states: &[ContactState],
    (time, y): (f64, &[f64]),
    out: &mut Frame,
) {
    out.time = time;
    out.bodies.clear();
    for (b, m) in mechanism.motion()[..machine.bodies.len()].iter().enumerate() {
        let arm = m.rotation * mechanism.frame_origin(b);
        out.bodies.push(BodyMotion {
            position: m.position + arm,
            rotation: m.rotation,
            velocity: m.point_velocity(&arm),
            angular_velocity: m.angular_velocity,
            acceleration: m.point_acceleration(&arm),
            angular_acceleration: m.angular_acceleration,
        });
    }
    out.pose = pose_of(&out.bodies[machine.output.body]);
    out.joints.clear();
    out.sites.clear();
    for (j, joint) in machine.loose_joints.iter().enumerate() {
        out.joints.push(joint_report(mechanism, joint, contact_states, (j, time)));
        report_sites(mechanism, joint, j, &mut out.sites);
    }
    mechanism.contacts.report_worn_walls(&mut out.worn_walls);
    out.closing.clear();
    out.closing.extend(mechanism.closing_loads());
    out.elastic = mechanism.elastic_energy(time) + mechanism.bristle_energy(y);
    out.elements.clear();
    out.elements.extend(mechanism.element_reports(time));
    for (i, film) in mechanism.films() {
        out.joints[film.joint].lubricant_force += out.elements[i].force;
    }
    let (kinetic, gravitational) = mechanism.energies();
    out.kinetic = kinetic;
    out.potential = gravitational + out.elastic;
    out.probe_error = probe_error(mechanism, machine, out);
    out.coordinates.clear();
    out.coordinates.extend(mechanism.coordinates(time, y));
    out.actuators.resize(mechanism.drives(), 0.0);
    mechanism.actuator_forces(&mut out.actuators);
    if let Some(reactions) = &mut out.reactions {
        reactions.clear();
        reactions.extend(mechanism.joint_reactions());
    }
}

fn joint_report(
    mechanism: &Mechanism,
    joint: &LooseJoint,
    contact_states: &[ContactState],
    (j, time): (usize, f64),
) -> JointReport {
    let motion = mechanism.motion();
    let centre = |a: &Attachment| match a.body {
        None => a.point,
        Some(b) => {
            let m = &motion[b];
            m.position + m.rotation * (a.point + mechanism.frame_origin(b))
        }
    };
    let contacts = &mechanism.contacts;
    let ball_centre = centre(&joint.carried());
    let (eccentricity, axial, tilt) = displacement(mechanism, joint, j);
    let report = JointReport {
        socket_centre: centre(&joint.carrier()),
        ball_centre,
        eccentricity,
        axial,
        tilt,
        clearance: contacts.joint_clearance(j),
        worn: [0, 1].map(|play| contacts.worn(j, play, time)),
        second_clearance: contacts.play(j, 1),
        ..JointReport::default()
    };
    let depth = |&c: &ContactId| contacts.gap(c).separation.penetration;
    let Some(c) = contacts.of_joint(j).max_by(|a, b| depth(a).total_cmp(&depth(b))) else {
        let normal_force = mechanism.reaction(j).unwrap_or_default();
        return JointReport { normal_force, contact_point: ball_centre, state: ContactMode::Ideal, ..report };
    };
    let (gap, coefficients) = (contacts.gap(c), contacts.coefficients(c));
    let normal = |c: ContactId| contacts.push(c) * contacts.gap(c).normal_force;
    let friction = |c: ContactId| contacts.on_carried(c, &contacts.gap(c).friction);
    let sum = |of: &dyn Fn(ContactId) -> Vec3| contacts.of_joint(j).map(of).reduce(|a, b| a + b).unwrap_or_default();
    JointReport {
        penetration: gap.separation.penetration,
        penetration_rate: gap.separation.rate,
        contact_point: mechanism.contact_point(c),
        slip_speed: gap.slip_speed,
        sliding: Sliding {
            velocity: sliding_velocity(mechanism, c),
            limit: contacts.of_joint(j).map(|c| friction_limit(contacts, c)).sum(),
        },
        normal_force: sum(&normal),
        friction_force: sum(&friction),
        state: if !contact_states[c].active && gap.normal_force == 0.0 {
            ContactMode::Free
        } else if coefficients.bristles.is_some() {
            // One that sticks holds the joint.
            if contacts.of_joint(j).any(|c| sticks(contacts, c)) { ContactMode::Stick } else { ContactMode::Slip }
        } else if gap.slip_speed < coefficients.slip_high {
            ContactMode::Creep
        } else {
            ContactMode::Slip
        },
        ..report
    }
}

/// Sliding velocity of the carried part at contact `c`, m/s; zero where it does not touch.
fn sliding_velocity(mechanism: &Mechanism, c: ContactId) -> Vec3 {
    let contacts = &mechanism.contacts;
    let at = &contacts.gap(c).separation;
    if at.penetration <= 0.0 {
        return Vec3::zeros();
    }
    let velocity = at.sliding_velocity(&contacts.slip_velocity(c, &at.normal, mechanism.motion()));
    contacts.on_carried(c, &velocity)
}

/// Largest friction force at contact `c`, N.
fn friction_limit(contacts: &Contacts, c: ContactId) -> f64 {
    let (gap, law) = (contacts.gap(c), contacts.coefficients(c));
    gap.normal_force * law.bristles.map_or(law.friction, |bristles| bristles.coefficient(gap.slip_speed))
}

/// Whether contact `c` presses and has bristles below their limit.
fn sticks(contacts: &Contacts, c: ContactId) -> bool {
    let gap = contacts.gap(c);
    let bristles = contacts.coefficients(c).bristles.filter(|_| gap.normal_force > 0.0);
    bristles.is_some_and(|b| gap.friction.norm() < AT_LIMIT * b.coefficient(gap.slip_speed) * gap.normal_force)
}

/// Of the carried part from its place without play: across the axis, along it (m), and the angle (rad).
fn displacement(mechanism: &Mechanism, joint: &LooseJoint, j: usize) -> (Vec3, f64, f64) {
    let e = mechanism.separation(j);
    if joint.kind == LooseKind::Ball {
        return (e, 0.0, 0.0);
    }
    let motion = mechanism.motion();
    let [carrier, carried] = joint.frames.map(|frame| {
        let own = frame.rotation.to_rotation_matrix().into_inner();
        frame.origin.body.map_or(own, |body| motion[body].rotation * own)
    });
    let [axis, own] = [carrier.column(0), carried.column(0)];
    let along = axis.dot(&e);
    let tilt = match joint.kind {
        LooseKind::Slide(_) => angle_of(&carrier.tr_mul(&carried)),
        _ => libm::atan2(axis.cross(&own).norm(), axis.dot(&own)),
    };
    (e - axis * along, along, tilt)
}

/// Appends the reports of the sites of joint `j`.
fn report_sites(mechanism: &Mechanism, joint: &LooseJoint, j: usize, out: &mut Vec<SiteReport>) {
    let first = out.len();
    let zero = Vec3::zeros();
    let nothing = SiteReport {
        joint: j,
        gap: f64::INFINITY,
        normal_force: zero,
        friction_force: zero,
        contact_point: zero,
        sliding: Sliding::default(),
    };
    out.extend(joint.kind.site_names().iter().map(|_| nothing));
    if out.len() == first {
        return;
    }
    let contacts = &mechanism.contacts;
    for c in contacts.of_joint(j) {
        let site = &mut out[first + usize::from(contacts.place(c))];
        let gap = contacts.gap(c);
        site.normal_force += contacts.push(c) * gap.normal_force;
        site.friction_force += contacts.on_carried(c, &gap.friction);
        site.sliding.limit += friction_limit(contacts, c);
        // Of the points of a rim, the one that is deepest.
        if -gap.separation.penetration < site.gap {
            site.gap = -gap.separation.penetration;
            site.contact_point = mechanism.contact_point(c);
            site.sliding.velocity = sliding_velocity(mechanism, c);
        }
    }
}

/// Probe tip minus the tip of the ideal mechanism at the same time, m.
fn probe_error(mechanism: &Mechanism, machine: &Machine, frame: &Frame) -> Option<Vec3> {
    let (probe, ideal) = (machine.output.probe?, mechanism.closed_motion()?);
    let body = &frame.bodies[machine.output.body];
    let ideal_tip = Vec3::from_fn(|i, _| ideal.position[i].value) + ideal.rotation * probe;
    Some(body.position + body.rotation * probe - ideal_tip)
}
