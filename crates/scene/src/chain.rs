//! Chains of identical links built from one template.

use std::collections::BTreeMap;

use super::document::{Node, Section};
use super::placement::read_rotation;
use super::read_bodies::read_rigid_body;
use super::read_joints::read_own_contact;
use super::*;

/// Adds the bodies, free joints and ball joints of the `[chain]` in `node`. Link 1 hangs from a fixed socket at `hang`, every
/// other link from the socket at the lower end of the previous one. All start at rest in a straight line rotated by
/// `rotation`. Returns the nodes of contact parameters overridden by `[[chain.joint]]`, by key.
///
/// # Errors
/// Invalid section, a name already used in the file, or a joint that the chain does not have.
pub(super) fn expand<'d>(node: &Node<'d>, scene: &mut Scene) -> Result<BTreeMap<String, Node<'d>>, SceneError> {
    let section = node.section()?;
    let hang = section.vector("hang")?;
    let rotation = read_rotation(section.get("rotation"))?;
    let link = section.require("link")?.section()?;
    let template = read_rigid_body(&link, String::new())?;
    let ball = link.vector("ball")?;
    let socket = link.vector("socket")?;
    let opening = link.get("opening").map_or(Ok(scene.view.down.unit()), |node| node.direction())?;
    let links = scene.chain.map_or(0, |chain| chain.links);
    for (so_far, most, what) in [
        (scene.machine.bodies.len(), MOST_BODIES, "bodies"),
        (scene.machine.ball_joints.len(), MOST_BALL_JOINTS, "ball joints"),
    ] {
        if so_far + links > most {
            let message =
                format!("too many {what} with those of the file: {so_far} and {links}; allowed at most {most}");
            return Err(section.error("links", message));
        }
    }
    let shapes = links * template.shapes.len();
    if shapes > MOST_SHAPES {
        let message = format!("too many shapes: {shapes}; allowed at most {MOST_SHAPES}");
        return Err(section.error("links", message));
    }

    let used = |name: &str, prefix: &str| {
        let number = name.strip_prefix(prefix).and_then(|rest| rest.parse::<usize>().ok());
        number.is_some_and(|number| (1..=links).contains(&number))
    };
    let joint_used = |name: &str| used(name, "free") || used(name, "J");
    if scene.machine.bodies.iter().any(|body| used(&body.name, "link"))
        || scene.machine.joints.iter().any(|joint| joint_used(&joint.name))
        || scene.machine.ball_joints.iter().any(|joint| joint_used(&joint.name))
    {
        let message = "the file already uses a name that the chain needs: bodies link1, link2, …, joints free1, free2, … \
                       and J1, J2, …";
        return Err(link.error("", message));
    }

    let first = scene.machine.bodies.len();
    let step = rotation * (socket - ball);
    for index in 0..links {
        let number = index + 1;
        let body = Body { name: format!("link{number}"), ..template.clone() };
        let ball_joint = BallJoint {
            name: format!("J{number}"),
            socket: match index {
                0 => Attachment { body: None, point: hang },
                _ => Attachment { body: Some(first + index - 1), point: socket },
            },
            ball: Attachment { body: Some(first + index), point: ball },
            // The world's socket has world axes; the links' sockets rotate with the links.
            opening: if index == 0 { rotation * opening } else { opening },
            contact: scene.machine.contact,
        };
        let joint = Joint {
            name: format!("free{number}"),
            kind: JointKind::Free,
            parent: None,
            child: first + index,
            parent_point: Vec3::zeros(),
            child_point: Vec3::zeros(),
            axis: Vec3::x(),
            child_axis: Vec3::y(),
            rotation: Quat::identity(),
            drive: None,
            second_drive: None,
            start: JointStart::Pose {
                position: hang + step * index as f64 - rotation * ball,
                rotation,
                velocity: Vec3::zeros(),
                angular_velocity: Vec3::zeros(),
            },
            drawn: true,
        };
        scene.machine.bodies.push(body);
        scene.machine.joints.push(joint);
        scene.machine.ball_joints.push(ball_joint);
        scene.overrides.push(Vec::new());
    }
    read_own(&section, scene, links)
}

/// Reads every `[[chain.joint]]`; the chain's joints are the last `links` ball joints of `scene`.
fn read_own<'d>(
    section: &Section<'d>,
    scene: &mut Scene,
    links: usize,
) -> Result<BTreeMap<String, Node<'d>>, SceneError> {
    let mut places = BTreeMap::new();
    let first = scene.machine.ball_joints.len() - links;
    let list = section.get("joint").map(|node| node.entries());
    for node in list.transpose()?.unwrap_or_default() {
        let own = node.section_as(node.title("chain.joint"))?;
        let name = own.require("name")?.name()?;
        let joints = &mut scene.machine.ball_joints[first..];
        let number = name.strip_prefix('J').and_then(|n| n.parse::<usize>().ok());
        let index = number.and_then(|n| n.checked_sub(1));
        let Some(index) = index.filter(|n| joints.get(*n).is_some_and(|joint| joint.name == name)) else {
            let message = format!("the chain has no ball joint `{name}`; it has {links} links: J1 to J{links}");
            return Err(own.error("name", message));
        };
        if !scene.overrides[first + index].is_empty() {
            let message = format!("the ball joint `{name}` is listed twice");
            return Err(own.error("name", message));
        }
        let given = read_own_contact(&own, &mut joints[index])?;
        scene.overrides[first + index] = given.keys().copied().collect();
        places.extend(given.into_iter().map(|(part, node)| (format!("joint.{name}.{part}"), node)));
    }
    Ok(places)
}
