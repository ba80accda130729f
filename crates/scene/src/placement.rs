//! Attachment points and orientations: tables and readers.

use std::collections::BTreeMap;

use super::document::{Node, Section};
use super::error::no_body;
use super::instance::Placement;
use super::key::{FileTable, ValueType, Variants, key, number, vector};
use super::*;
use jointplay_physics::units::Dimension as D;

pub(super) static ATTACHMENT: FileTable = FileTable::new(
    "point",
    "a point on a body",
    "where something holds a body",
    &[
        key("body", ValueType::Body, "\"rod\"", "the body, or `world`"),
        key("at", vector(D::Length), "\"0 0 100 mm\"", "the point").default_zero().frame("that of its `body`"),
    ],
);

pub(super) static ROTATION: FileTable = FileTable::new(
    "rotation",
    "a rotation",
    "an orientation, in one of four forms",
    &[
        key("axis", ValueType::Direction, "[0, 1, 0]", "axis of the turn").of(&["axis"]),
        key("angle", number(D::Angle), "\"15 deg\"", "angle of the turn").of(&["axis"]),
        key("sequence", ValueType::Text, "\"xzy\"", "axes of three turns: `\"xzy\"` is Rx Rz Ry, as in paper eq. (2)")
            .of(&["sequence"]),
        key("angles", ValueType::Numbers(3, D::Angle), "\"0 2 15 deg\"", "their angles, in that order")
            .of(&["sequence"]),
        key("x", ValueType::Direction, "[1, 0, 0]", "the x axis").of(&["x"]),
        key("y", ValueType::Direction, "[0, 1, 0]", "on which side of it the y axis lies").of(&["x"]),
        key("quaternion", ValueType::Numbers(4, D::None), "[1, 0, 0, 0]", "a quaternion: w, x, y, z, of any length")
            .of(&["quaternion"]),
    ],
)
.by(Variants::Presence(&["axis", "sequence", "x", "quaternion"]));

/// Reads an orientation in one of four forms; the identity if the key is omitted:
/// `{ axis = [0, 1, 0], angle = "15 deg" }`;
/// `{ sequence = "xzy", angles = ["0 deg", "2 deg", "15 deg"] }`, R = Rx Rz Ry as in paper eq. (2);
/// `{ x = [1, 0, 0], y = [0, 1, 0] }`, the body's x axis, and the side on which its y axis lies;
/// `{ quaternion = [w, x, y, z] }`.
pub(super) fn read_rotation(node: Option<Node<'_>>) -> Result<Quat, SceneError> {
    let Some(node) = node else {
        return Ok(Quat::identity());
    };
    let section = node.section()?;
    let Some(form) = section.word else {
        return Err(node.error("needs exactly one form: axis and angle, sequence and angles, x and y, or quaternion"));
    };
    let turn = |axis: Vec3, angle: f64| Quat::from_axis_angle(&nalgebra::Unit::new_normalize(axis), angle);
    match form {
        "axis" => {
            let axis = section.require("axis")?.direction()?;
            Ok(turn(axis, section.number("angle")?))
        }
        "sequence" => {
            let node = section.require("sequence")?;
            let letters = node.text()?;
            let angles = section.require("angles")?.numbers::<3>()?;
            if letters.chars().count() != 3 {
                return Err(node.error("must be three of the letters x, y and z, for example \"xzy\""));
            }
            letters.chars().zip(angles).try_fold(Quat::identity(), |so_far, (letter, angle)| {
                let axis = match letter {
                    'x' => Vec3::x(),
                    'y' => Vec3::y(),
                    'z' => Vec3::z(),
                    _ => {
                        return Err(node.error("must be three of the letters x, y and z, for example \"xzy\""));
                    }
                };
                Ok(so_far * turn(axis, angle))
            })
        }
        "x" => {
            let x = section.require("x")?.direction()?;
            let y_node = section.require("y")?;
            let z = x.cross(&y_node.direction()?);
            if z.norm() < 1e-6 {
                return Err(y_node.error("must not be parallel to x"));
            }
            let z = z.normalize();
            let matrix = Mat3::from_columns(&[x, z.cross(&x), z]);
            Ok(Quat::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(matrix)))
        }
        _ => {
            let node = section.require("quaternion")?;
            let [w, x, y, z] = node.numbers()?;
            let size = w.abs().max(x.abs()).max(y.abs()).max(z.abs());
            if size == 0.0 {
                return Err(node.error("a quaternion must not be zero"));
            }
            Ok(Quat::new_normalize(nalgebra::Quaternion::new(w, x, y, z) / size))
        }
    }
}

/// Reads the placement in `section`: a rotation by `rotation` about the origin, then a translation by `position`; `None` without
/// either key.
pub(super) fn read_placement(section: &Section<'_>) -> Result<Option<Placement>, SceneError> {
    let (position, rotation) = (section.get("position"), section.get("rotation"));
    if position.is_none() && rotation.is_none() {
        return Ok(None);
    }
    let shift = position.map_or(Ok(Vec3::zeros()), |node| node.vector())?;
    Ok(Some(Placement { turn: read_rotation(rotation)?, shift, ..Placement::identity() }))
}

/// Reads a point on a body or the world from `key`; `bodies` maps names to indices in the sorted scene.
pub(super) fn read_attachment(
    section: &Section<'_>,
    key: &str,
    scene: &Scene,
    bodies: &BTreeMap<String, usize>,
) -> Result<Attachment, SceneError> {
    let part = section.require(key)?.section()?;
    let body_node = part.require("body")?;
    let name = &*body_node.body()?;
    let body = match (name, bodies.get(name)) {
        ("world", _) => None,
        (_, Some(&index)) => Some(index),
        (_, None) => {
            let names = scene.machine.bodies.iter().map(|body| body.name.as_str());
            return Err(body_node.error(no_body(name, std::iter::once("world").chain(names))));
        }
    };
    let point = part.vector("at")?;
    let on = body.map(|_| name);
    let point = section.document.instance.map_or(point, |instance| instance.point(on, point));
    Ok(Attachment { body, point })
}
