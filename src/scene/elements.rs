//! Force elements of a scene file: one row per kind, from which its section is read. Their physics is in
//! `mechanism/elements`.

use std::collections::BTreeMap;

use super::document::{Node, Section};
use super::drives::FASTEST_DRIVE;
use super::error::nearest;
use super::read_joints::read_attachment;
use super::*;
use crate::words::Words;

const LARGEST_FORCE: f64 = 1e12;

/// Every kind of force element.
pub static ELEMENT_KINDS: [ElementKind; 2] = [
    ElementKind {
        section: "spring",
        help: "spring with a damper along the line between two points",
        points: &["from", "to"],
        numbers: &[
            ElementNumber {
                key: "length",
                dimension: Dimension::Length,
                range: (0.0, 1e6),
                default: None,
                like: "\"100 mm\"",
                help: "distance of the points at which the spring carries `preload`",
            },
            ElementNumber {
                key: "stiffness",
                dimension: Dimension::Stiffness,
                range: (0.0, LARGEST_FORCE),
                default: Some(0.0),
                like: "\"10 N/mm\"",
                help: "change of its tension with the distance",
            },
            ElementNumber {
                key: "damping",
                dimension: Dimension::Damping,
                range: (0.0, LARGEST_FORCE),
                default: Some(0.0),
                like: "\"20 N s/m\"",
                help: "change of its tension with the rate of the distance",
            },
            ElementNumber {
                key: "preload",
                dimension: Dimension::Force,
                range: (-LARGEST_FORCE, LARGEST_FORCE),
                default: Some(0.0),
                like: "\"5 N\"",
                help: "tension at `length`; negative where it pushes",
            },
        ],
        vectors: &[],
        acts_by: &["stiffness", "damping", "preload"],
        choices: &[],
        force: |spring| spring.number("preload").abs(),
    },
    ElementKind {
        section: "load",
        help: "force and torque from outside on a body, constant or times sin(2π frequency t + phase)",
        points: &["on"],
        numbers: &[
            ElementNumber {
                key: "frequency",
                dimension: Dimension::Frequency,
                range: (0.0, FASTEST_DRIVE),
                default: Some(0.0),
                like: "\"2 Hz\"",
                help: "0 for a constant load",
            },
            ElementNumber {
                key: "phase",
                dimension: Dimension::Angle,
                range: (-1e6, 1e6),
                default: Some(0.0),
                like: "\"90 deg\"",
                help: "phase at t = 0; not used where the load is constant",
            },
        ],
        vectors: &[
            ("force", Dimension::Force, "force at the point"),
            ("torque", Dimension::Torque, "torque"),
        ],
        acts_by: &["force", "torque"],
        choices: &[(
            "axes",
            LoadAxes::WORDS,
            "whether force and torque keep to the world's axes or turn with the body",
        )],
        force: |load| load.vector("force").norm(),
    },
];

impl ElementKind {
    fn keys(&self) -> Vec<&'static str> {
        let numbers = self.numbers.iter().map(|number| number.key);
        let vectors = self.vectors.iter().map(|(key, ..)| *key);
        let choices = self.choices.iter().map(|(key, ..)| *key);
        let points = self.points.iter().copied();
        ["name"]
            .into_iter()
            .chain(points)
            .chain(numbers)
            .chain(vectors)
            .chain(choices)
            .collect()
    }
}

/// One element of `kind`; `bodies` maps names to indices in the sorted scene.
pub(super) fn read_element<'d>(
    node: &Node<'d>,
    kind: &'static ElementKind,
    scene: &Scene,
    bodies: &BTreeMap<String, usize>,
) -> Result<(Element, Section<'d>), SceneError> {
    let section = node.section_as(node.title(kind.section), &kind.keys())?;
    let name = section.require("name", "\"s1\"")?.name()?.into_owned();
    let point = |key: &&str| read_attachment(&section, key, scene, bodies);
    let points = kind
        .points
        .iter()
        .map(point)
        .collect::<Result<Vec<_>, _>>()?;
    if let [first, second] = points[..]
        && first.body == second.body
    {
        let [from, to] = [kind.points[0], kind.points[1]];
        return Err(section.error(
            to,
            format!(
                "{from} and {to} are on the same body: a {} needs two",
                kind.section
            ),
        ));
    }
    if let [only] = points[..]
        && only.body.is_none()
    {
        return Err(section.error(
            kind.points[0],
            format!("a {} acts on a body, not on the world", kind.section),
        ));
    }
    let number = |row: &ElementNumber| match section.get(row.key) {
        None => match row.default {
            Some(default) => Ok(default),
            None => section.require(row.key, row.like).map(|_| 0.0),
        },
        Some(node) => {
            let value = node.quantity(row.dimension)?;
            let (least, most) = row.range;
            if (least..=most).contains(&value) {
                return Ok(value);
            }
            let unit = si_unit(row.dimension);
            Err(node.error(format!(
                "out of range; allowed {} to {}; units {}",
                format_quantity(least, unit),
                format_quantity(most, unit),
                unit_names(row.dimension).join(", ")
            )))
        }
    };
    let numbers = kind.numbers.iter().map(number).collect::<Result<_, _>>()?;
    // A vector in axes that do not belong to the pattern turns with its copies.
    let turns = section.document.copy.filter(|copy| {
        let body = points.first().and_then(|point| point.body);
        let own = body.is_some_and(|body| copy.made(&scene.bodies[body].name));
        !own || section
            .get("axes")
            .is_none_or(|axes| axes.text() != Ok(LoadAxes::Body.word()))
    });
    let vector = |&(key, dimension, _): &(&str, Dimension, &str)| {
        let Some(node) = section.get(key) else {
            return Ok(Vec3::zeros());
        };
        let value = node.vector(dimension)?;
        if value.amax() <= LARGEST_FORCE {
            return Ok(turns.map_or(value, |copy| copy.direction(value)));
        }
        let most = format_quantity(LARGEST_FORCE, si_unit(dimension));
        Err(node.error(format!("out of range; allowed -{most} to {most}")))
    };
    let vectors = kind.vectors.iter().map(vector).collect::<Result<_, _>>()?;
    let choice = |&(key, words, _): &(&str, &'static [&'static str], &str)| {
        let Some(node) = section.get(key) else {
            return Ok(words[0]);
        };
        let text = node.text()?;
        words
            .iter()
            .copied()
            .find(|word| *word == text)
            .ok_or_else(|| {
                let near = nearest(text, words.iter().copied());
                node.error(format!(
                    "is not one of the choices{near}; allowed {}",
                    words.join(", ")
                ))
            })
    };
    let choices = kind.choices.iter().map(choice).collect::<Result<_, _>>()?;
    let element = Element {
        name,
        kind,
        points,
        numbers,
        vectors,
        choices,
    };
    let acts = |key: &&str| match kind.numbers.iter().any(|number| number.key == *key) {
        true => element.number(key) != 0.0,
        false => element.vector(key) != Vec3::zeros(),
    };
    if !kind.acts_by.iter().any(acts) {
        let (kind, keys) = (kind.section, kind.acts_by.join(", "));
        return Err(section.error(
            "",
            format!("this {kind} does nothing: {keys} are 0; one must not be"),
        ));
    }
    Ok((element, section))
}
