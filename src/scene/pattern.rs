//! Patterns: a group of bodies, joints and elements of a scene file, repeated about an axis or along a line.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::sync::Arc;

use super::document::{Node, Section, lists};
use super::*;

/// Lists that a pattern may have, besides the sections of [`ELEMENT_KINDS`].
const MEMBERS: [&str; 4] = ["body", "joint", "ball_joint", "fixed_shape"];

/// One copy of a pattern: what its names become, and where what it leaves to the outside lies.
#[derive(Clone, Debug)]
pub(super) struct Copy {
    /// Counted from 1.
    pub number: u32,
    /// A point on the axis, m, about which copies are turned.
    centre: Vec3,
    turn: Quat,
    shift: Vec3,
    /// Names of the bodies, joints and elements that the pattern has.
    members: Arc<BTreeSet<String>>,
}

impl Copy {
    /// `name` with the copy's number if it is the pattern's own.
    pub fn name<'a>(&self, name: &'a str) -> Cow<'a, str> {
        if self.has(name) {
            Cow::Owned(format!("{name}{}", self.number))
        } else {
            Cow::Borrowed(name)
        }
    }

    /// Whether `name` is the pattern's own.
    pub fn has(&self, name: &str) -> bool {
        self.members.contains(name)
    }

    /// Whether `name` is that of a body in this copy.
    pub fn made(&self, name: &str) -> bool {
        let own = name.strip_suffix(&self.number.to_string());
        own.is_some_and(|own| self.has(own))
    }

    /// Where a point of the first copy lies in this one, m.
    pub fn point(&self, point: Vec3) -> Vec3 {
        self.centre + self.turn * (point - self.centre) + self.shift
    }

    /// Where a direction of the first copy points in this one.
    pub fn direction(&self, direction: Vec3) -> Vec3 {
        self.turn * direction
    }

    /// How an orientation of the first copy is turned in this one.
    pub fn rotation(&self, rotation: Quat) -> Quat {
        self.turn * rotation
    }

    /// Whether the copy is only shifted: a box, whose edges keep to the axes, can follow.
    pub fn keeps_axes(&self) -> bool {
        self.turn.angle() == 0.0
    }
}

/// A `[[pattern]]` with its copies.
pub(super) struct Pattern<'d> {
    section: Section<'d>,
    copies: Vec<Copy>,
}

/// The patterns of a scene's files.
///
/// # Errors
/// Anything wrong in their own keys, or too many copies.
pub(super) fn read_patterns<'d>(files: &[Section<'d>]) -> Result<Vec<Pattern<'d>>, SceneError> {
    lists(files, "pattern", MOST_BODIES, "patterns")?
        .iter()
        .map(read_pattern)
        .collect()
}

fn read_pattern<'d>(node: &Node<'d>) -> Result<Pattern<'d>, SceneError> {
    let elements = ELEMENT_KINDS.iter().map(|kind| kind.section);
    let lists: Vec<&str> = MEMBERS.into_iter().chain(elements).collect();
    let known: Vec<&str> = ["name", "count", "about", "along"]
        .into_iter()
        .chain(lists.iter().copied())
        .collect();
    let section = node.section_as(node.title("pattern"), &known)?;
    section.require("name", "\"leg\"")?.name()?;
    let count_node = section.require("count", "6")?;
    let count = match count_node.scalar()?.parse::<u32>() {
        Ok(count) if (1..=MOST_BODIES as u32).contains(&count) => count,
        _ => {
            let message =
                format!("out of range; allowed 1 to {MOST_BODIES}; a whole number, no unit");
            return Err(count_node.error(message));
        }
    };
    let mut members = BTreeSet::new();
    let mut size = 0;
    for list in &lists {
        let Some(list) = section.get(list) else {
            continue;
        };
        let entries = list.elements()?;
        size += entries.len();
        let name = |entry: &Node<'d>| {
            let name = entry.value.get_ref().get("name")?.get_ref().as_str()?;
            Some(name.to_owned())
        };
        members.extend(entries.iter().filter_map(name));
    }
    if size == 0 {
        let message = format!("nothing to repeat; allowed here: {}", lists.join(", "));
        return Err(section.error("", message));
    }
    if size.saturating_mul(count as usize) > MOST_SHAPES {
        return Err(count_node.error(format!(
            "{count} copies of {size} things are too many; allowed at most {MOST_SHAPES} in all"
        )));
    }
    let (centre, axis, angle) = match section.get("about") {
        None => (Vec3::zeros(), Vec3::z(), 0.0),
        Some(node) => {
            let about = node.section(&["point", "axis", "angle"])?;
            let point = about.get("point");
            let angle = about.get("angle");
            (
                point.map_or(Ok(Vec3::zeros()), |node| node.vector(Dimension::Length))?,
                about.require("axis", "[0, 0, 1]")?.direction()?,
                angle.map_or(Ok(std::f64::consts::TAU / f64::from(count)), |node| {
                    node.quantity(Dimension::Angle)
                })?,
            )
        }
    };
    let step = match section.get("along") {
        None if section.get("about").is_none() => {
            return Err(section.error(
                "",
                "missing `about` or `along`; write for example `about = { axis = [0, 0, 1] }` or `along = \"100 0 0 mm\"`",
            ));
        }
        None => Vec3::zeros(),
        Some(node) => node.vector(Dimension::Length)?,
    };
    let members = Arc::new(members);
    let copies = (0..count)
        .map(|index| Copy {
            number: index + 1,
            centre,
            turn: turned(axis, angle * f64::from(index)),
            shift: step * f64::from(index),
            members: members.clone(),
        })
        .collect();
    Ok(Pattern { section, copies })
}

/// The rotation by `angle` about the unit vector `axis`, from `libm`'s functions: start values must be the same bits everywhere.
fn turned(axis: Vec3, angle: f64) -> Quat {
    let (sin, cos) = libm::sincos(0.5 * angle);
    Quat::new_unchecked(nalgebra::Quaternion::from_parts(cos, axis * sin))
}

impl<'d> Pattern<'d> {
    /// What its list `name` gives, copy by copy.
    ///
    /// # Errors
    /// Not a list.
    pub fn nodes(&'d self, name: &str) -> Result<Vec<Node<'d>>, SceneError> {
        let mut nodes = Vec::new();
        if let Some(list) = self.section.get(name) {
            let entries = list.elements()?;
            for copy in &self.copies {
                for entry in &entries {
                    let mut node = entry.clone();
                    node.document.copy = Some(copy);
                    nodes.push(node);
                }
            }
        }
        Ok(nodes)
    }
}
