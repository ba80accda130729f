//! Force elements of a scene file: one row per kind, from which its section is read. Their physics is in
//! `mechanism/elements`.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use super::document::{Node, Section};
use super::drives::{FASTEST_DRIVE, read_drive};
use super::read_joints::{read_attachment, read_one_degree_joint, read_rotation};
use super::*;
use crate::words::Words;

const LARGEST_FORCE: f64 = 1e12;

/// A kind without anything of its own.
const PLAIN: ElementKind = ElementKind {
    section: "",
    help: "",
    points: &[],
    joint: None,
    numbers: &[],
    vectors: &[],
    frame: "",
    rotations: &[],
    law: None,
    acts_by: &[],
    choices: &[],
    force: |_| 0.0,
    fault: |_| None,
    look: ElementLook::Hidden,
};

const fn on_hinge(key: &'static str, dimension: Dimension, like: &'static str) -> Option<OnHinge> {
    Some(OnHinge {
        key,
        dimension,
        like,
    })
}

/// Stiffnesses or dampings along or about three axes.
const fn stiff(key: &'static str, dimension: Dimension, help: &'static str) -> ElementVector {
    ElementVector {
        key,
        dimension,
        range: (0.0, LARGEST_FORCE),
        direction: false,
        help,
    }
}

/// Every kind of force element.
pub static ELEMENT_KINDS: [ElementKind; 6] = [
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
                on_hinge: None,
            },
            ElementNumber {
                key: "stiffness",
                dimension: Dimension::Stiffness,
                range: (0.0, LARGEST_FORCE),
                default: Some(0.0),
                like: "\"10 N/mm\"",
                help: "change of its tension with the distance",
                on_hinge: None,
            },
            ElementNumber {
                key: "damping",
                dimension: Dimension::Damping,
                range: (0.0, LARGEST_FORCE),
                default: Some(0.0),
                like: "\"20 N s/m\"",
                help: "change of its tension with the rate of the distance",
                on_hinge: None,
            },
            ElementNumber {
                key: "preload",
                dimension: Dimension::Force,
                range: (-LARGEST_FORCE, LARGEST_FORCE),
                default: Some(0.0),
                like: "\"5 N\"",
                help: "tension at `length`; negative where it pushes",
                on_hinge: None,
            },
        ],
        acts_by: &["stiffness", "damping", "preload"],
        choices: &[(
            "side",
            SpringSide::WORDS,
            "which way it acts: a tyre and a rubber buffer only push, a rope only pulls",
        )],
        force: |spring| spring.number("preload").abs(),
        look: ElementLook::Coil,
        ..PLAIN
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
                on_hinge: None,
            },
            ElementNumber {
                key: "phase",
                dimension: Dimension::Angle,
                range: (-1e6, 1e6),
                default: Some(0.0),
                like: "\"90 deg\"",
                help: "phase at t = 0; not used where the load is constant",
                on_hinge: None,
            },
        ],
        vectors: &[
            ElementVector {
                key: "force",
                dimension: Dimension::Force,
                range: (-LARGEST_FORCE, LARGEST_FORCE),
                direction: true,
                help: "force at the point",
            },
            ElementVector {
                key: "torque",
                dimension: Dimension::Torque,
                range: (-LARGEST_FORCE, LARGEST_FORCE),
                direction: true,
                help: "torque",
            },
        ],
        frame: "the world's, or the body's with `axes = \"body\"`",
        acts_by: &["force", "torque"],
        choices: &[(
            "axes",
            LoadAxes::WORDS,
            "whether force and torque keep to the world's axes or turn with the body",
        )],
        force: |load| load.vector("force").norm(),
        look: ElementLook::Arrow,
        ..PLAIN
    },
    ElementKind {
        section: "joint_spring",
        help: "spring with a damper on a slide or a hinge, between the two bodies that it connects",
        joint: Some(ElementJoint::Any),
        numbers: &[
            ElementNumber {
                key: "position",
                dimension: Dimension::Length,
                range: (-1e6, 1e6),
                default: Some(0.0),
                like: "\"10 mm\"",
                help: "joint coordinate at which it carries `preload`",
                on_hinge: on_hinge("position", Dimension::Angle, "\"30 deg\""),
            },
            ElementNumber {
                key: "stiffness",
                dimension: Dimension::Stiffness,
                range: (0.0, LARGEST_FORCE),
                default: Some(0.0),
                like: "\"10 N/mm\"",
                help: "change of its force or torque with the coordinate",
                on_hinge: on_hinge("stiffness", Dimension::TurningStiffness, "\"5 N m/rad\""),
            },
            ElementNumber {
                key: "damping",
                dimension: Dimension::Damping,
                range: (0.0, LARGEST_FORCE),
                default: Some(0.0),
                like: "\"20 N s/m\"",
                help: "change of its force or torque with the rate of the coordinate",
                on_hinge: on_hinge("damping", Dimension::TurningDamping, "\"0.1 N m s/rad\""),
            },
            ElementNumber {
                key: "preload",
                dimension: Dimension::Force,
                range: (-LARGEST_FORCE, LARGEST_FORCE),
                default: Some(0.0),
                like: "\"5 N\"",
                help: "force or torque at `position`, towards lower coordinates",
                on_hinge: on_hinge("preload", Dimension::Torque, "\"0.5 N m\""),
            },
        ],
        acts_by: &["stiffness", "damping", "preload"],
        force: |spring| spring.force_at_joint("preload"),
        look: ElementLook::Coil,
        ..PLAIN
    },
    ElementKind {
        section: "stop",
        help: "stops at the ends of a slide or a hinge, which only push",
        joint: Some(ElementJoint::Any),
        numbers: &[
            ElementNumber {
                key: "lower",
                dimension: Dimension::Length,
                range: (-1e6, 1e6),
                default: Some(f64::NEG_INFINITY),
                like: "\"-20 mm\"",
                help: "joint coordinate at which the lower stop begins",
                on_hinge: on_hinge("lower", Dimension::Angle, "\"-30 deg\""),
            },
            ElementNumber {
                key: "upper",
                dimension: Dimension::Length,
                range: (-1e6, 1e6),
                default: Some(f64::INFINITY),
                like: "\"20 mm\"",
                help: "joint coordinate at which the upper stop begins",
                on_hinge: on_hinge("upper", Dimension::Angle, "\"30 deg\""),
            },
            ElementNumber {
                key: "force",
                dimension: Dimension::Force,
                range: (0.0, LARGEST_FORCE),
                default: None,
                like: "\"500 N\"",
                help: "what a stop bears when it is pressed in slowly by `depth`",
                on_hinge: on_hinge("torque", Dimension::Torque, "\"20 N m\""),
            },
            ElementNumber {
                key: "depth",
                dimension: Dimension::Length,
                range: (1e-9, 1e3),
                default: None,
                like: "\"1 mm\"",
                help: "depth at which it bears that",
                on_hinge: on_hinge("depth", Dimension::Angle, "\"1 deg\""),
            },
            ElementNumber {
                key: "restitution",
                dimension: Dimension::None,
                range: (0.01, 1.0),
                default: Some(1.0),
                like: "0.5",
                help: "speed after over speed before an impact at `speed`",
                on_hinge: None,
            },
            ElementNumber {
                key: "speed",
                dimension: Dimension::Speed,
                range: (0.0, 1e6),
                default: Some(0.0),
                like: "\"0.1 m/s\"",
                help: "approach speed at which it rebounds with `restitution`; needed where that is below 1",
                on_hinge: on_hinge("speed", Dimension::AngularSpeed, "\"1 rad/s\""),
            },
        ],
        acts_by: &["force"],
        fault: stop_fault,
        ..PLAIN
    },
    ElementKind {
        section: "bushing",
        help: "three springs along and three about axes fixed in the body of `from`, each with a damper",
        points: &["from", "to"],
        vectors: &[
            stiff("stiffness", Dimension::Stiffness, "along its axes"),
            stiff("damping", Dimension::Damping, "along its axes"),
            stiff(
                "turning_stiffness",
                Dimension::TurningStiffness,
                "about its axes",
            ),
            stiff(
                "turning_damping",
                Dimension::TurningDamping,
                "about its axes",
            ),
        ],
        frame: "its axes: `axes` in the body of `from`",
        rotations: &[
            ("axes", "its axes in the body of `from`"),
            (
                "rotation",
                "orientation of the body of `to` in that of `from` in which it exerts no torque",
            ),
        ],
        acts_by: &[
            "stiffness",
            "damping",
            "turning_stiffness",
            "turning_damping",
        ],
        ..PLAIN
    },
    ElementKind {
        section: "motor",
        help: "force or torque on a slide or a hinge without a drive, constant or towards a target",
        joint: Some(ElementJoint::Undriven),
        numbers: &[
            ElementNumber {
                key: "force",
                dimension: Dimension::Force,
                range: (-LARGEST_FORCE, LARGEST_FORCE),
                default: Some(0.0),
                like: "\"50 N\"",
                help: "constant part",
                on_hinge: on_hinge("torque", Dimension::Torque, "\"2 N m\""),
            },
            ElementNumber {
                key: "stiffness",
                dimension: Dimension::Stiffness,
                range: (0.0, LARGEST_FORCE),
                default: Some(0.0),
                like: "\"10 N/mm\"",
                help: "gain on the distance from the target",
                on_hinge: on_hinge("stiffness", Dimension::TurningStiffness, "\"5 N m/rad\""),
            },
            ElementNumber {
                key: "damping",
                dimension: Dimension::Damping,
                range: (0.0, LARGEST_FORCE),
                default: Some(0.0),
                like: "\"20 N s/m\"",
                help: "gain on the difference from the target's speed",
                on_hinge: on_hinge("damping", Dimension::TurningDamping, "\"0.1 N m s/rad\""),
            },
            ElementNumber {
                key: "limit",
                dimension: Dimension::Force,
                range: (0.0, LARGEST_FORCE),
                default: Some(f64::INFINITY),
                like: "\"100 N\"",
                help: "largest force or torque, either way",
                on_hinge: on_hinge("limit", Dimension::Torque, "\"10 N m\""),
            },
        ],
        law: Some(("target", "motion that it is to follow")),
        acts_by: &["force", "stiffness", "damping"],
        force: |motor| motor.force_at_joint("force").min(motor.number("limit")),
        fault: motor_fault,
        ..PLAIN
    },
];

fn stop_fault(stop: &Element) -> Option<(&'static str, String)> {
    let [lower, upper] = ["lower", "upper"].map(|key| stop.number(key));
    let unit = if stop.on_hinge { "deg" } else { "mm" };
    let why = if lower == f64::NEG_INFINITY && upper == f64::INFINITY {
        "missing; a stop needs `lower`, `upper` or both".to_owned()
    } else if lower >= upper {
        format!("must be above lower, {}", format_quantity(lower, unit))
    } else if stop.on_hinge && upper - lower >= TAU && upper.is_finite() && lower.is_finite() {
        "must be less than a turn above lower: a hinge is taken within half a turn of their middle"
            .to_owned()
    } else if stop.number("restitution") < 1.0 && stop.number("speed") == 0.0 {
        let why =
            "missing; a restitution below 1 holds at one approach speed, which must be above 0";
        return Some(("speed", why.to_owned()));
    } else {
        return None;
    };
    Some(("upper", why))
}

fn motor_fault(motor: &Element) -> Option<(&'static str, String)> {
    let follows = ["stiffness", "damping"]
        .map(|key| motor.number(key) > 0.0)
        .contains(&true);
    let why = match (follows, &motor.law) {
        (true, None) => "missing; stiffness and damping pull towards it",
        (false, Some(_)) => "has no effect: stiffness and damping, which pull towards it, are 0",
        (_, Some(law)) if law.slider().is_some() => {
            "a motor follows a law of its own, not that of the scene's sliders"
        }
        _ => return None,
    };
    Some(("target", why.to_owned()))
}

impl Element {
    /// Magnitude of a number that is a force on a slide and a torque on a hinge, N: 0 on a hinge.
    fn force_at_joint(&self, key: &str) -> f64 {
        match self.on_hinge {
            true => 0.0,
            false => self.number(key).abs(),
        }
    }
}

/// One element of `kind`; `bodies` and `joints` map names to indices in the sorted scene.
pub(super) fn read_element<'d>(
    node: &Node<'d>,
    kind: &'static ElementKind,
    scene: &Scene,
    bodies: &BTreeMap<String, usize>,
    joints: &BTreeMap<String, usize>,
) -> Result<(Element, Section<'d>), SceneError> {
    let mut section = node.section_as(node.title(kind.section))?;
    let name = section.require("name")?.name()?.into_owned();
    let point = |key: &&str| read_attachment(&section, key, scene, bodies);
    let mut points = kind
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
    let mut joint = None;
    if let Some(which) = kind.joint {
        let index = read_one_degree_joint(&section, scene, joints)?;
        let of = &scene.joints[index];
        if which == ElementJoint::Undriven && of.drive.is_some() {
            let why = format!(
                "this joint has a drive, which leaves a {} nothing to move",
                kind.section
            );
            return Err(section.require("joint")?.error(why));
        }
        points = of.points().to_vec();
        joint = Some(of);
    }
    let on_hinge = joint.is_some_and(|joint| joint.kind == JointKind::Revolute);
    section.document.on_hinge = on_hinge;
    let number = |row: &ElementNumber| {
        let [key, other] = [on_hinge, !on_hinge].map(|hinge| row.on(hinge).0);
        if other != key {
            let (here, there) = if on_hinge {
                ("hinge", "slide")
            } else {
                ("slide", "hinge")
            };
            let why =
                format!("the joint is a {here}, where `{key}` belongs; `{other}` is for a {there}");
            section.refuse(other, &why)?;
        }
        section.number(key)
    };
    let numbers = kind.numbers.iter().map(number).collect::<Result<_, _>>()?;
    let choice = |&(key, words, _): &(&str, &'static [&'static str], &str)| match section.get(key) {
        Some(node) => node.choice(),
        None => Ok(words[0]),
    };
    let choices = kind.choices.iter().map(choice);
    let choices: Vec<&str> = choices.collect::<Result<_, _>>()?;
    // A vector in axes that do not belong to the pattern turns with its copies.
    let turns = section.document.copy.filter(|copy| {
        let body = points.first().and_then(|point| point.body);
        let own = body.is_some_and(|body| copy.made(&scene.bodies[body].name));
        !own || !choices.contains(&LoadAxes::Body.word())
    });
    let vector = |row: &ElementVector| {
        let value = section.vector(row.key)?;
        let turns = turns.filter(|_| row.direction);
        Ok(turns.map_or(value, |copy| copy.direction(value)))
    };
    let vectors = kind
        .vectors
        .iter()
        .map(vector)
        .collect::<Result<_, SceneError>>()?;
    // Whether the first and second point are on bodies of the pattern's copy that is read; all are of a copy that does not turn.
    let owned = |place: usize| {
        let copy = section.document.copy.filter(|copy| !copy.keeps_axes());
        let body = points.get(place).and_then(|point| point.body);
        copy.is_none_or(|copy| body.is_some_and(|body| copy.made(&scene.bodies[body].name)))
    };
    // What an orientation in a body outside a pattern is to, turns with the pattern's copies.
    let turned = section.document.copy.filter(|_| !owned(0));
    let rotation = |&(key, _): &(&str, &str)| {
        let rotation = read_rotation(section.get(key))?;
        Ok(turned.map_or(rotation, |copy| copy.rotation(rotation)))
    };
    if !kind.rotations.is_empty() && owned(0) && !owned(1) {
        let why =
            "a body outside the pattern does not turn with its copies: make it that of `from`";
        return Err(section.error(kind.points[1], why));
    }
    let rotations = kind
        .rotations
        .iter()
        .map(rotation)
        .collect::<Result<_, SceneError>>()?;
    let law = kind.law.and_then(|(key, _)| section.get(key)).zip(joint);
    let law = law.map(|(node, joint)| read_drive(&node, joint.kind, scene));
    let element = Element {
        name,
        kind,
        points,
        joint: joint.map(|joint| joint.child),
        on_hinge,
        numbers,
        vectors,
        rotations,
        law: law.transpose()?,
        choices,
    };
    let acts = |key: &&str| match kind.numbers.iter().any(|number| number.key == *key) {
        true => element.number(key) != 0.0,
        false => element.vector(key) != Vec3::zeros(),
    };
    if !kind.acts_by.iter().any(acts) {
        let own = |key: &&'static str| {
            let number = kind.numbers.iter().find(|number| number.key == *key);
            number.map_or(*key, |number| number.on(on_hinge).0)
        };
        let keys: Vec<&str> = kind.acts_by.iter().map(own).collect();
        let (kind, keys) = (kind.section, keys.join(", "));
        return Err(section.error(
            "",
            format!("this {kind} does nothing: {keys} are 0; one must not be"),
        ));
    }
    if let Some((key, why)) = (kind.fault)(&element) {
        return Err(match section.get(key) {
            Some(node) => node.error(why),
            None => section.error(key, why),
        });
    }
    Ok((element, section))
}
