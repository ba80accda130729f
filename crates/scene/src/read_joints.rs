//! Readers of tree joints, loop-closing joints and ball joints; sorting of bodies into a forest.

use super::document::{Node, Section};
use super::drives::read_drive;
use super::error::no_body;
use super::instance::Instance;
use super::placement::{read_attachment, read_rotation};
use super::play::{PlayText, read_play};
use super::table::contact_rows;
use super::*;
use jointplay_physics::suggest::nearest;
use jointplay_physics::words::Words;
use std::collections::{BTreeMap, BTreeSet};

/// Tolerance on the cosine of the angle between the axes of a universal joint: axes are typed with few digits.
pub(super) const SQUARE: f64 = 1e-4;

/// A joint whose bodies are still indices in file order.
pub(super) struct JointText<'d> {
    pub name: String,
    pub section: Section<'d>,
    /// `parent` and `child` are body indices in file order.
    pub joint: Joint,
    /// Whether it closes a loop: its child hangs on another joint.
    pub closes_loop: bool,
    /// Its play, if it has any: it is then cut.
    pub play: Option<PlayText<'d>>,
}

/// A ball joint with the positions of its contact keys.
pub(super) struct LooseJointText<'d> {
    pub joint: LooseJoint,
    pub section: Section<'d>,
    pub places: BTreeMap<&'static str, Node<'d>>,
}

/// Reads a `[[joint]]`; `bodies` are the names in file order, `places` the index of each.
pub(super) fn read_joint<'d>(
    node: &Node<'d>,
    bodies: &[String],
    places: &BTreeMap<&str, usize>,
) -> Result<JointText<'d>, SceneError> {
    let section = node.section_as(node.title("joint"))?;
    let name = section.require("name")?.name()?.into_owned();
    // Where it starts, a ball joint is as if fixed.
    let kind = JointKind::of_word(section.require("kind")?.choice()?).unwrap_or(JointKind::Fixed);
    let mut play = read_play(&section)?;
    let child_node = section.require("child")?;
    let place = |node: &Node<'_>, also| {
        let name = &*node.body()?;
        let names = || Option::into_iter(also).chain(bodies.iter().map(String::as_str));
        let place = places.get(name).copied();
        place.ok_or_else(|| node.error(no_body(name, names())))
    };
    let child = place(&child_node, None)?;
    let parent_node = section.get("parent");
    let parent = match &parent_node {
        Some(node) if node.text()? != "world" => Some(place(node, Some("world"))?),
        _ => None,
    };
    let mut joint = Joint {
        name: name.clone(),
        kind,
        parent,
        child,
        parent_point: section.vector("parent_point")?,
        child_point: section.vector("child_point")?,
        axis: Vec3::x(),
        child_axis: Vec3::y(),
        rotation: read_rotation(section.get("rotation"))?,
        drive: None,
        second_drive: None,
        start: JointStart::Scalar { position: 0.0, velocity: 0.0 },
        drawn: section.get("drawn").map_or(Ok(true), |node| node.flag())?,
    };
    let closes_loop = match section.get("closes_loop") {
        Some(node) => node.flag()?,
        None => false,
    };
    if closes_loop {
        check_closing(&section, &joint)?;
    }
    match kind {
        JointKind::Free => read_free(&section, &mut joint)?,
        JointKind::Fixed => {}
        JointKind::Prismatic | JointKind::Revolute => read_moving(&section, &mut joint)?,
        JointKind::Cylindrical | JointKind::Universal => {
            read_two_degrees(&section, &mut joint)?;
        }
    }
    if let Some(instance) = node.document.instance {
        let on = parent.map(|parent| &*bodies[parent]);
        place_parent_side(&mut joint, instance, on);
        if let Some(PlayText { displaced, .. }) = &mut play {
            *displaced = displaced.map(|by| instance.direction(on, by));
        }
        if closes_loop {
            place_child_side(&mut joint, instance, &bodies[child]);
        }
    }
    Ok(JointText { name, section, joint, closes_loop, play })
}

/// Checks the keys of a loop-closing joint.
fn check_closing(section: &Section<'_>, joint: &Joint) -> Result<(), SceneError> {
    if joint.kind == JointKind::Free {
        let node = section.require("kind")?;
        return Err(node.error(
            "a free joint holds nothing, so that it closes no loop; allowed fixed, prismatic, revolute, cylindrical, universal",
        ));
    }
    if joint.parent == Some(joint.child) {
        let node = section.require("child")?;
        return Err(node.error("parent and child are the same body: a joint that closes a loop needs two"));
    }
    let drive = "a joint that closes a loop has no drive; drive a slide or a hinge that a body hangs on";
    section.refuse("drive", drive)?;
    let start = "a joint that closes a loop starts where the joints that its bodies hang on put them";
    section.refuse("start", start)
}

/// Transforms the child's side of a joint of the group `instance`.
fn place_child_side(joint: &mut Joint, instance: &Instance<'_>, child: &str) {
    joint.child_point = instance.point(Some(child), joint.child_point);
    joint.child_axis = instance.direction(Some(child), joint.child_axis);
    joint.rotation = instance.rotation_of(Some(child), joint.rotation);
}

/// Transforms the parent's side of a joint of the group `instance`.
fn place_parent_side(joint: &mut Joint, instance: &Instance<'_>, parent: Option<&str>) {
    joint.parent_point = instance.point(parent, joint.parent_point);
    joint.axis = instance.direction(parent, joint.axis);
    joint.rotation = instance.rotation(parent, joint.rotation);
    if let JointStart::Pose { position, rotation, velocity, angular_velocity } = &mut joint.start {
        *position = instance.point(parent, *position);
        *rotation = instance.rotation(parent, *rotation);
        *velocity = instance.direction(parent, *velocity);
        *angular_velocity = instance.direction(parent, *angular_velocity);
    }
}

/// Reads the initial pose and velocity of a free body.
fn read_free(section: &Section<'_>, joint: &mut Joint) -> Result<(), SceneError> {
    if joint.parent.is_some() {
        let node = section.require("parent")?;
        return Err(node.error("a free joint has the world as its parent; allowed \"world\""));
    }
    let start = section.require("start")?.section()?;
    let rotation = read_rotation(start.get("rotation"))?;
    let angular_velocity = start.vector("angular_velocity")?;
    // The file gives pose and velocity of the joint point; the model needs those of the frame's origin.
    let arm = rotation * joint.child_point;
    joint.start = JointStart::Pose {
        position: start.vector("position")? - arm,
        rotation,
        velocity: start.vector("velocity")? - angular_velocity.cross(&arm),
        angular_velocity,
    };
    joint.child_point = Vec3::zeros();
    Ok(())
}

/// Reads a slide or a hinge: axis, and either a drive or start values.
fn read_moving(section: &Section<'_>, joint: &mut Joint) -> Result<(), SceneError> {
    if let Some(node) = section.get("drive") {
        section.refuse("start", "the drive says where the joint starts")?;
        joint.drive = Some(read_drive(&node, joint.kind == JointKind::Revolute)?);
    } else if let Some(node) = section.get("start") {
        let mut start = node.section()?;
        start.document.on_hinge = joint.kind == JointKind::Revolute;
        joint.start = JointStart::Scalar { position: start.number("position")?, velocity: start.number("velocity")? };
    }
    joint.axis = section.require("axis")?.direction()?;
    Ok(())
}

/// Reads a cylindrical or universal joint.
fn read_two_degrees(section: &Section<'_>, joint: &mut Joint) -> Result<(), SceneError> {
    let universal = joint.kind == JointKind::Universal;
    joint.axis = section.require("axis")?.direction()?;
    if universal {
        let node = section.require("child_axis")?;
        let second = joint.rotation * node.direction()?;
        let along = joint.axis.dot(&second);
        if along.abs() > SQUARE {
            let degrees = libm::acos(along.clamp(-1.0, 1.0)).to_degrees();
            return Err(node.error(format!(
                "must be perpendicular to `axis` where the angles are 0; with `rotation` it is at {degrees:.4} deg to it"
            )));
        }
        let square = (second - joint.axis * along).normalize();
        joint.child_axis = joint.rotation.inverse() * square;
    }
    let rates =
        if universal { ["angular_velocity", "child_angular_velocity"] } else { ["velocity", "angular_velocity"] };
    let drive = section.get("drive").map(|node| node.section()).transpose()?;
    let start = section.get("start").map(|node| node.section()).transpose()?;
    let (mut position, mut velocity) = ([0.0; 2], [0.0; 2]);
    let drives = [&mut joint.drive, &mut joint.second_drive];
    let coordinates = joint.kind.freedoms().iter().zip(rates).zip(drives);
    for (part, ((freedom, rate), driven)) in coordinates.enumerate() {
        let word = freedom.word();
        if let Some(node) = drive.as_ref().and_then(|drive| drive.get(word)) {
            *driven = Some(read_drive(&node, freedom.turns())?);
            for key in [word, rate] {
                let why = "the drive of this coordinate says where it starts";
                start.as_ref().map_or(Ok(()), |start| start.refuse(key, why))?;
            }
        } else if let Some(start) = &start {
            position[part] = start.number(word)?;
            velocity[part] = start.number(rate)?;
        }
    }
    if let (Some(drive), None) = (drive, joint.drives().next()) {
        let words = joint.kind.freedoms().iter().map(|freedom| freedom.word());
        let words: Vec<&str> = words.collect();
        return Err(drive.error("", format!("drives nothing: give `{}` or both", words.join("`, `"))));
    }
    joint.start = JointStart::Pair { position, velocity };
    Ok(())
}

/// Sorts bodies parents first, otherwise in file order, and joints in the same order with `parent` and `child` renumbered.
pub(super) fn sort_forest(
    bodies: Vec<Body>,
    joints: &[&JointText<'_>],
    sections: &[Section<'_>],
) -> Result<(Vec<Body>, Vec<Joint>), SceneError> {
    let closing = "each body hangs on exactly one joint; close loops with a [[ball_joint]], or with a joint that has \
                   `closes_loop = true`";
    let mut of_child: Vec<Option<&JointText<'_>>> = vec![None; bodies.len()];
    for &text in joints {
        let child = text.joint.child;
        if let Some(first) = of_child[child].replace(text) {
            let node = text.section.require("child")?;
            return Err(node.error(format!("this body is already the child of joint `{}`: {closing}", first.name)));
        }
    }
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); bodies.len()];
    let mut ready = BTreeSet::new();
    for (index, text) in of_child.iter().enumerate() {
        match text {
            None => {
                let name = &bodies[index].name;
                return Err(sections[index].error(
                    "",
                    format!("no [[joint]] has this body as its child: {closing}; write for example a joint with `child = \"{name}\"`, kind \"free\""),
                ));
            }
            Some(text) => match text.joint.parent {
                Some(parent) => children[parent].push(index),
                None => {
                    ready.insert(index);
                }
            },
        }
    }
    let mut order = Vec::with_capacity(bodies.len());
    while let Some(index) = ready.pop_first() {
        order.push(index);
        ready.extend(&children[index]);
    }
    let mut place = vec![usize::MAX; bodies.len()];
    for (new, &old) in order.iter().enumerate() {
        place[old] = new;
    }
    if let Some(text) = joints.iter().find(|text| place[text.joint.child] == usize::MAX) {
        let node = text.section.require("parent")?;
        return Err(node.error(format!("these joints form a cycle that does not reach the world: {closing}")));
    }
    let mut sorted_joints: Vec<Joint> = joints.iter().map(|text| text.joint.clone()).collect();
    for joint in &mut sorted_joints {
        joint.child = place[joint.child];
        joint.parent = joint.parent.map(|parent| place[parent]);
    }
    sorted_joints.sort_by_key(|joint| joint.child);
    let mut sorted_bodies: Vec<(usize, Body)> =
        bodies.into_iter().enumerate().map(|(old, body)| (place[old], body)).collect();
    sorted_bodies.sort_by_key(|(new, _)| *new);
    Ok((sorted_bodies.into_iter().map(|(_, body)| body).collect(), sorted_joints))
}

/// What an error says of the joints that a key may name; `kind` is what they are.
pub(super) fn allowed_joints<'n>(names: impl Iterator<Item = &'n str>, kind: &str) -> String {
    const LISTED: usize = 12;
    let mut listed: Vec<&str> = names.take(LISTED + 1).collect();
    if listed.len() > LISTED {
        listed[LISTED] = "…";
    }
    match listed.is_empty() {
        true => format!("the scene has no {kind}"),
        false => format!("allowed {}", listed.join(", ")),
    }
}

/// Resolves the keys `joint` and `coordinate` to a joint's index among the kinematic joints of `scene` and its coordinate.
/// `joints` maps names to these indices.
pub(super) fn read_coordinate(
    section: &Section<'_>,
    scene: &Scene,
    joints: &BTreeMap<String, usize>,
) -> Result<(usize, Freedom), SceneError> {
    let node = section.require("joint")?;
    let name = &*node.joint()?;
    let found = joints.get(name).copied();
    let joint = found.and_then(|index| scene.machine.kinematic_joints().nth(index));
    let freedoms = joint.map_or(&[][..], |joint| joint.kind.freedoms());
    let (Some(index), Some(joint), Some(first)) = (found, joint, freedoms.first()) else {
        let wrong = match joint {
            Some(joint) => format!("a {} joint is neither a slide nor a hinge", joint.kind),
            None => "no such joint that slides or turns".to_owned(),
        };
        let moving = scene.machine.kinematic_joints().filter(|joint| !joint.kind.freedoms().is_empty());
        let names = moving.map(|joint| joint.name.as_str());
        let near = nearest(name, names.clone());
        let allowed = allowed_joints(names, "joint that slides or turns");
        return Err(node.error(format!("{wrong}{near}; {allowed}")));
    };
    let words: Vec<&str> = freedoms.iter().map(|freedom| freedom.word()).collect();
    let has = format!("a {} joint has {}", joint.kind, words.join(" and "));
    match section.get("coordinate") {
        Some(node) => {
            let word = node.choice()?;
            let found = freedoms.iter().find(|freedom| freedom.word() == word);
            let freedom = found.ok_or_else(|| node.error(format!("no such coordinate: {has}")))?;
            Ok((index, *freedom))
        }
        None if freedoms.len() == 1 => Ok((index, *first)),
        None => {
            Err(section
                .error("coordinate", format!("missing: {has}; write for example `coordinate = \"{}\"`", words[0])))
        }
    }
}

/// Reads a `[[ball_joint]]`; `bodies` maps names to indices in the sorted scene.
pub(super) fn read_ball_joint<'d>(
    node: &Node<'d>,
    scene: &Scene,
    bodies: &BTreeMap<String, usize>,
) -> Result<LooseJointText<'d>, SceneError> {
    let section = node.section_as(node.title("joint"))?;
    let name = section.require("name")?.name()?.into_owned();
    let attachment = |key: &str| read_attachment(&section, key, scene, bodies);
    let (socket, ball) = (attachment("socket")?, attachment("ball")?);
    if socket.body == ball.body {
        return Err(section.error("ball", "socket and ball are on the same body: a ball joint needs two"));
    }
    let opening = section.get("opening").map_or(Ok(scene.view.down.unit()), |node| node.direction())?;
    let on = socket.body.map(|body| &*scene.machine.bodies[body].name);
    let opening = node.document.instance.map_or(opening, |instance| instance.direction(on, opening));
    let mut joint = LooseJoint { opening, contact: scene.machine.contact, ..LooseJoint::ball(&name, socket, ball) };
    let places = read_own_contact(&section, &mut joint)?;
    Ok(LooseJointText { joint, section, places })
}

/// Applies the contact overrides of `section` to `joint`; returns their nodes by parameter.
///
/// # Errors
/// A value that is invalid or out of range.
pub(super) fn read_own_contact<'d>(
    section: &Section<'d>,
    joint: &mut LooseJoint,
) -> Result<BTreeMap<&'static str, Node<'d>>, SceneError> {
    let mut places = BTreeMap::new();
    for (part, field) in contact_rows().filter(|(part, _)| section.rows.key(part, None).is_some()) {
        if let Some(node) = section.get(part) {
            let value = node.parameter()?;
            (field.set)(&mut joint.contact, &value);
            places.insert(part, node);
        }
    }
    Ok(places)
}
