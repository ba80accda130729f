//! A robot description as the text of a scene file.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use super::description::{Description, Form, Joint, Kind, Pose, Shape, Spring};
use crate::cli::Failure;
use crate::machine::{Quat, Vec3};

/// Smaller components count as 0: of positions, m, of directions, and of products relative to the inertia.
const ROUNDING: f64 = 1e-14;
/// Longest name in a scene file.
const MAX_NAME_LENGTH: usize = 40;

/// Unique names in the scene file, and those that differ from the description.
#[derive(Default)]
struct Names {
    taken: BTreeSet<String>,
    renamed: BTreeMap<String, String>,
}

impl Names {
    /// Assigns a name that is not taken yet, as close as possible to `requested`.
    fn assign(&mut self, requested: &str) -> String {
        let is_allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
        let mut name: String =
            requested.chars().map(|c| if is_allowed(c) { c } else { '_' }).take(MAX_NAME_LENGTH).collect();
        if name.is_empty() {
            name.push_str("part");
        }
        let mut number = 2;
        let base = name.clone();
        while name == "world" || self.taken.contains(&name) {
            let suffix = format!("_{number}");
            name = base.chars().take(MAX_NAME_LENGTH - suffix.len()).collect::<String>() + &suffix;
            number += 1;
        }
        if name != requested {
            self.renamed.insert(requested.to_owned(), name.clone());
        }
        self.taken.insert(name.clone());
        name
    }
}

/// A scene file, with the lines of the description that its parts come from.
pub struct SceneFile {
    /// The scene file.
    pub text: String,
    /// Byte at which each part begins, and its line in the description.
    origins: Vec<(usize, u32)>,
}

impl SceneFile {
    /// Line of the description from which a line of the scene comes, both from 1.
    pub fn origin(&self, line: u32) -> Option<u32> {
        let before = |at: usize| u32::try_from(self.text[..at].matches('\n').count()).unwrap_or(u32::MAX);
        self.origins.iter().rev().find(|(at, _)| before(*at) < line).map(|(_, origin)| *origin)
    }
}

/// The scene file of a description that was read from the file `file`.
///
/// # Errors
/// More parts than a scene has.
pub fn scene(description: &Description, file: &str) -> Result<SceneFile, Failure> {
    let mut bodies = Names::default();
    let names: Vec<String> = description.bodies.iter().map(|body| bodies.assign(&body.name)).collect();
    let mut joints = Names::default();
    let poses = description.poses();
    let body = |index: Option<usize>| index.map_or("world", |index| &names[index]);
    let mut out = String::new();
    let mut text = String::new();
    let mut origins = Vec::new();
    // Writing to a String cannot fail.
    for (body, name) in description.bodies.iter().zip(&names) {
        let inertial = &body.inertial;
        let i = inertial.inertia;
        origins.push((text.len(), body.line));
        if inertial.mass == 0.0 {
            let _ = write!(text, "\n# A body without mass only connects joints.");
        }
        let _ = writeln!(text, "\n[[body]]\nname = \"{name}\"\nmass = \"{} kg\"", inertial.mass);
        let _ = writeln!(text, "centre = {}", vector(inertial.centre, "m"));
        let _ = writeln!(text, "inertia = {}", components(i.diagonal(), "kg m^2"));
        let products =
            -Vec3::new(i.m12, i.m13, i.m23).map(|part| if part.abs() < ROUNDING * i.amax() { 0.0 } else { part });
        if products != Vec3::zeros() {
            let _ = writeln!(text, "products = {}", components(products, "kg m^2"));
        }
        if !body.shapes.is_empty() {
            text.push_str("shapes = [\n");
            for one in &body.shapes {
                origins.push((text.len(), one.line));
                let _ = writeln!(text, "    {{ {} }},", shape(one).join(", "));
            }
            text.push_str("]\n");
        }
    }
    for joint in &description.joints {
        let parent = joint.parent.map(|parent| &names[parent][..]);
        origins.push((text.len(), joint.line));
        write_joint(&mut text, joint, parent, &names[joint.child], &poses[joint.child], &mut joints);
    }
    for closure in &description.closures {
        let name = joints.assign(&closure.name);
        let ends = [0, 1].map(|end| (body(closure.bodies[end]), closure.frames[end]));
        origins.push((text.len(), closure.line));
        if closure.is_fixed {
            write_weld(&mut text, &name, ends);
        } else {
            write_ball_joint(&mut text, &name, ends.map(|(body, frame)| (body, frame.position)));
        }
    }
    for one in &description.fixed {
        origins.push((text.len(), one.line));
        let _ = writeln!(text, "\n[[fixed_shape]]\n{}", shape(one).join("\n"));
    }
    let _ = writeln!(
        out,
        "# From {}, by jointplay {}. Links without a joint of their own are parts of those that carry them.",
        comment_line(file),
        crate::VERSION
    );
    for omission in description.omissions() {
        let _ = writeln!(out, "# {}", comment_line(&omission));
    }
    for (from, to) in bodies.renamed.iter().chain(&joints.renamed) {
        let _ = writeln!(out, "# {} is called {to} here.", comment_line(from));
    }
    let _ = writeln!(out, "\nname = \"{}\"\nstart = \"ideal\"", Names::default().assign(&description.name));
    let _ = writeln!(out, "\n[gravity]");
    for (axis, value) in ["x", "y", "z"].iter().zip(description.gravity.iter()) {
        let _ = writeln!(out, "{axis} = \"{value} m/s^2\"");
    }
    let has_ball_joint = description.joints.iter().any(|joint| joint.kind == Kind::Ball);
    if has_ball_joint || description.closures.iter().any(|closure| !closure.is_fixed) {
        let _ = writeln!(
            out,
            "\n[contact]\n# A description has no play. A clearance above 0 gives it to all ball joints.\nclearance = \"0 mm\""
        );
    }
    let origins = origins.into_iter().map(|(at, line)| (out.len() + at, line)).collect();
    Ok(SceneFile { text: out + &text, origins })
}

fn write_joint(text: &mut String, joint: &Joint, parent: Option<&str>, child: &str, pose: &Pose, names: &mut Names) {
    let at = joint.pose.point(joint.anchor);
    let (kind, axes) = match joint.kind {
        Kind::Hinge(axis) => ("revolute", vec![axis]),
        Kind::Slide(axis) => ("prismatic", vec![axis]),
        Kind::Cylindrical(axis) => ("cylindrical", vec![axis]),
        Kind::Universal(axis, other) => ("universal", vec![axis, other]),
        Kind::Ball | Kind::Free => ("free", vec![]),
    };
    let is_ball = joint.kind == Kind::Ball;
    let joint_name = names.assign(&joint.name);
    let name = if is_ball { names.assign(&format!("{joint_name}_free")) } else { joint_name.clone() };
    let _ = writeln!(text, "\n[[joint]]\nname = \"{name}\"\nkind = \"{kind}\"");
    if kind == "free" {
        let _ = writeln!(text, "child = \"{child}\"");
        let position = vector(pose.position, "m");
        let _ = writeln!(text, "start = {{ position = {position}{} }}", rotation_key(", rotation", &pose.rotation));
        if is_ball {
            write_ball_joint(text, &joint_name, [(parent.unwrap_or("world"), at), (child, joint.anchor)]);
        }
        return;
    }
    if let Some(parent) = parent {
        let _ = writeln!(text, "parent = \"{parent}\"");
    }
    let _ = writeln!(text, "child = \"{child}\"");
    let _ = writeln!(text, "parent_point = {}", vector(at, "m"));
    if joint.anchor != Vec3::zeros() {
        let _ = writeln!(text, "child_point = {}", vector(joint.anchor, "m"));
    }
    if let Some(axis) = axes.first() {
        let _ = writeln!(text, "axis = {}", direction(joint.pose.rotation * axis));
    }
    if let Some(axis) = axes.get(1) {
        let _ = writeln!(text, "child_axis = {}", direction(*axis));
    }
    let rotation = rotation_key("rotation", &joint.pose.rotation);
    if !rotation.is_empty() {
        let _ = writeln!(text, "{rotation}");
    }
    for spring in &joint.springs {
        write_spring(text, spring, &joint_name, &names.assign(&format!("{joint_name}_spring")));
    }
}

fn write_ball_joint(text: &mut String, name: &str, [socket, ball]: [(&str, Vec3); 2]) {
    let end = |(body, at): (&str, Vec3)| format!("{{ body = \"{body}\", at = {} }}", vector(at, "m"));
    let _ = writeln!(text, "\n[[ball_joint]]\nname = \"{name}\"\nsocket = {}\nball = {}", end(socket), end(ball));
}

/// A joint without motion; the world can only be its parent.
fn write_weld(text: &mut String, name: &str, [one, other]: [(&str, Pose); 2]) {
    let [(parent, of_parent), (child, of_child)] = if other.0 == "world" { [other, one] } else { [one, other] };
    let _ = writeln!(text, "\n[[joint]]\nname = \"{name}\"\nkind = \"fixed\"");
    if parent != "world" {
        let _ = writeln!(text, "parent = \"{parent}\"");
    }
    let _ = writeln!(text, "child = \"{child}\"\nparent_point = {}", vector(of_parent.position, "m"));
    let _ = writeln!(text, "child_point = {}", vector(of_child.position, "m"));
    let rotation = rotation_key("rotation", &(of_parent.rotation * of_child.rotation.inverse()));
    let _ = writeln!(text, "{rotation}{}closes_loop = true", if rotation.is_empty() { "" } else { "\n" });
}

fn write_spring(text: &mut String, spring: &Spring, joint: &str, name: &str) {
    let _ = writeln!(text, "\n[[joint_spring]]\nname = \"{name}\"\njoint = \"{joint}\"");
    if let Some(coordinate) = spring.coordinate {
        let _ = writeln!(text, "coordinate = \"{coordinate}\"");
    }
    let [rest, stiffness, damping] =
        if spring.is_angle { ["rad", "N m/rad", "N m s/rad"] } else { ["m", "N/m", "N s/m"] };
    for (key, value, unit) in [
        ("position", spring.rest, rest),
        ("stiffness", spring.stiffness, stiffness),
        ("damping", spring.damping, damping),
    ] {
        if value != 0.0 {
            let _ = writeln!(text, "{key} = \"{value} {unit}\"");
        }
    }
}

/// Keys of a shape.
fn shape(shape: &Shape) -> Vec<String> {
    let Pose { position, rotation } = shape.pose;
    let axis = |half: f64| rotation * Vec3::new(0.0, 0.0, half);
    let ends = |half: f64| {
        let (from, to) = (position - axis(half), position + axis(half));
        [format!("from = {}", vector(from, "m")), format!("to = {}", vector(to, "m"))]
    };
    let radius = |r: f64| format!("radius = \"{r} m\"");
    let form = |word: &str| format!("form = \"{word}\"");
    let centre = || format!("centre = {}", vector(position, "m"));
    let mut keys = match &shape.form {
        Form::Sphere(r) => vec![form("sphere"), centre(), radius(*r)],
        Form::Cylinder(r, h) => [&[form("cylinder")][..], &ends(*h), &[radius(*r)]].concat(),
        Form::Capsule(r, h) => [&[form("capsule")][..], &ends(*h), &[radius(*r)]].concat(),
        Form::Box([a, b, c]) if rotation == Quat::identity() => {
            vec![form("box"), centre(), format!("size = {}", vector(2.0 * Vec3::new(*a, *b, *c), "m"))]
        }
        // A rotated box is written as a thick plate.
        Form::Box([a, b, c]) => {
            let corner = |(x, y): (f64, f64)| vector(shape.pose.point(Vec3::new(x * a, y * b, 0.0)), "m");
            let corners = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].map(corner).join(", ");
            vec![form("plate"), format!("corners = [{corners}]"), format!("thickness = \"{} m\"", 2.0 * c)]
        }
        Form::Mesh(file, unit) => {
            let file = toml::Value::from(file.as_str());
            let mut keys = vec![form("mesh"), format!("file = {file}"), format!("unit = \"{unit} m\"")];
            keys.push(format!("position = {}", vector(position, "m")));
            keys.extend(Some(rotation_key("rotation", &rotation)).filter(|keys| !keys.is_empty()));
            keys
        }
    };
    if let Some(colour) = shape.colour {
        let [r, g, b] = colour.map(|part| (255.0 * part.clamp(0.0, 1.0)).round() as u8);
        keys.push(format!("colour = \"#{r:02x}{g:02x}{b:02x}\""));
    }
    keys
}

/// `key` with a rotation; empty for the identity.
fn rotation_key(key: &str, rotation: &Quat) -> String {
    if *rotation == Quat::identity() {
        return String::new();
    }
    let q = rotation.quaternion();
    format!("{key} = {{ quaternion = [{}, {}, {}, {}] }}", number(q.w), number(q.i), number(q.j), number(q.k))
}

/// A number in TOML syntax, with a decimal point.
fn number(value: f64) -> String {
    format!("{value:?}")
}

fn vector(v: Vec3, unit: &str) -> String {
    components(Vec3::from(rounded(v)), unit)
}

/// The components, even the smallest, without rounding to 0.
fn components(v: Vec3, unit: &str) -> String {
    format!("\"{} {} {} {unit}\"", v.x, v.y, v.z)
}

fn direction(v: Vec3) -> String {
    let [x, y, z] = rounded(v).map(number);
    format!("[{x}, {y}, {z}]")
}

/// The components, with 0 (never -0) in place of rounding errors.
fn rounded(v: Vec3) -> [f64; 3] {
    [v.x, v.y, v.z].map(|part| if part.abs() < ROUNDING { 0.0 } else { part })
}

/// One line of a comment.
fn comment_line(text: &str) -> String {
    crate::scene::visible_line(text).into_owned()
}
