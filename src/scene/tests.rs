//! The built-in scenes as a whole: they load, and they close.

use super::*;

/// World poses of all bodies at the file's start; slider coordinates of the spcmm law as `physics` derives them.
fn start_poses(scene: &Scene) -> Vec<(Vec3, Quat)> {
    // Roots of the paper's eq. (39) at t = 0 for a1 = 32 mm.
    let sliders = [0.136_493_548_0, 0.240_922_773_5, 0.186_472_405_6];
    let mut poses: Vec<(Vec3, Quat)> = Vec::new();
    for joint in &scene.joints {
        let (origin, frame) = joint
            .parent
            .map_or((Vec3::zeros(), Quat::identity()), |parent| poses[parent]);
        let q = match (joint.drive, joint.start) {
            (Some(Drive::Spcmm { slider }), _) => sliders[usize::from(slider) - 1],
            (_, JointStart::Scalar { position, .. }) => position,
            (
                _,
                JointStart::Pose {
                    position, rotation, ..
                },
            ) => {
                poses.push((position, rotation));
                continue;
            }
        };
        let (rotation, slide) = match joint.kind {
            JointKind::Revolute => {
                let turn = Quat::from_axis_angle(&nalgebra::Unit::new_normalize(joint.axis), q);
                (frame * turn * joint.rotation, Vec3::zeros())
            }
            _ => (frame * joint.rotation, joint.axis * q),
        };
        poses.push((
            origin + frame * (joint.parent_point + slide) - rotation * joint.child_point,
            rotation,
        ));
    }
    poses
}

#[test]
fn every_ball_of_every_built_in_scene_starts_in_the_centre_of_its_socket() {
    for name in BUILT_IN {
        let scene = Scene::load(name, &[]).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(scene.name, name);
        let poses = start_poses(&scene);
        let point = |end: Attachment| {
            end.body
                .map_or(end.point, |body| poses[body].0 + poses[body].1 * end.point)
        };
        assert!(!scene.ball_joints.is_empty(), "{name}");
        for joint in &scene.ball_joints {
            let e = point(joint.ball) - point(joint.socket);
            // The slider coordinates are given to ten digits.
            assert!(
                e.norm() < 1e-9,
                "{name}: {} starts {:e} m off its socket's centre",
                joint.name,
                e.norm()
            );
        }
    }
}

#[test]
fn joints_follow_their_bodies_and_parents_come_first() {
    for name in BUILT_IN {
        let scene = Scene::load(name, &[]).unwrap();
        for (index, joint) in scene.joints.iter().enumerate() {
            assert_eq!(joint.child, index, "{name}");
            assert!(joint.parent.is_none_or(|parent| parent < index), "{name}");
        }
    }
}
