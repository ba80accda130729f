//! Invariants of a frame, whatever the scene and the method.

use jointplay_physics::machine::{LooseJoint, Machine, Vec3};
use jointplay_physics::simulate::{Frame, JointReport};

/// Penetration over ball radius beyond which a ball has left its socket.
const OUT_OF_SOCKET: f64 = 0.1;

/// Whether every number of the frame is finite.
pub fn finite(frame: &Frame) -> bool {
    let mut all = vec![frame.time, frame.kinetic, frame.potential, frame.elastic];
    let mut push = |v: &Vec3| all.extend_from_slice(v.as_slice());
    for b in &frame.bodies {
        for v in [&b.position, &b.velocity, &b.angular_velocity, &b.acceleration, &b.angular_acceleration] {
            push(v);
        }
        (0..3).for_each(|i| push(&b.rotation.column(i).into_owned()));
    }
    for j in &frame.joints {
        for v in
            [&j.socket_centre, &j.ball_centre, &j.eccentricity, &j.normal_force, &j.friction_force, &j.contact_point]
        {
            push(v);
        }
        push(&Vec3::new(j.penetration, j.penetration_rate, j.slip_speed));
    }
    let p = &frame.pose;
    for v in [&p.position, &p.angles, &p.velocity, &p.angle_rates, &p.acceleration, &p.angle_accelerations] {
        push(v);
    }
    frame.probe_error.iter().for_each(&mut push);
    all.extend_from_slice(&frame.actuators);
    all.iter().all(|x| x.is_finite())
}

/// The first violated invariant of a frame, if any.
pub fn violation(frame: &Frame, machine: &Machine, form: &str) -> Option<String> {
    if !finite(frame) {
        return Some(format!("not finite at t = {:e} s", frame.time));
    }
    for b in &frame.bodies {
        let skew = (b.rotation.tr_mul(&b.rotation) - jointplay_physics::machine::Mat3::identity()).amax();
        if skew > 1e-9 {
            return Some(format!("orientation off by {skew:e} at t = {:e} s", frame.time));
        }
    }
    let pairs = frame.joints.iter().zip(&machine.loose_joints);
    pairs
        .filter_map(|(report, joint)| joint_violation(report, joint, form))
        .next()
        .map(|what| format!("{what} at t = {:e} s", frame.time))
}

fn joint_violation(report: &JointReport, joint: &LooseJoint, form: &str) -> Option<String> {
    let radius = joint.contact.ball_radius;
    if joint.contact.clearance == 0.0 {
        // The `lagrange` formulation only stabilises its constraints.
        let limit = if form == "tree" { 1e-9 } else { 1e-3 };
        let open = report.eccentricity.norm();
        return (open > limit).then(|| format!("{} open by {open:e} m", joint.name));
    }
    if report.penetration > OUT_OF_SOCKET * radius {
        return Some(format!("{} {:.3} radii inside the wall", joint.name, report.penetration / radius));
    }
    let separating = report.penetration > 1e-9 && report.penetration_rate > 0.0;
    (separating && report.normal_force.norm() == 0.0)
        .then(|| format!("{} leaves its socket without a force", joint.name))
}
