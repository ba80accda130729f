//! Force elements of a scene file: one row per kind, from which its section is read. Their physics is in
//! `mechanism/elements`.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use super::document::{Node, Section};
use super::drives::{FASTEST_DRIVE, read_drive};
use super::key::MAX_SI;
use super::points::{Axis, Graph, read_file, read_points};
use super::read_joints::{read_attachment, read_coordinate, read_rotation};
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
    curve: None,
    law: None,
    acts_by: &[],
    choices: &[],
    frequency: None,
    depth: None,
    force: |_| 0.0,
    fault: |_| None,
    look: ElementLook::Hidden,
};

const fn on_hinge(key: &'static str, dimension: Dimension, like: &'static str) -> Option<OnHinge> {
    Some(OnHinge { key, dimension, like })
}

/// Stiffnesses or dampings along or about three axes.
const fn stiff(key: &'static str, dimension: Dimension, help: &'static str) -> ElementVector {
    ElementVector { key, dimension, range: (0.0, LARGEST_FORCE), direction: false, upward: false, help }
}

/// Tension of a spring by its change of length.
const SPRING_CURVE: CurveAxes = (
    [("length", Dimension::Length), ("tension", Dimension::Force)],
    "[[\"-10 mm\", \"-50 N\"], [0, 0], [\"10 mm\", \"80 N\"]]",
);

/// Force or torque of a joint spring by its joint's coordinate.
const HINGE_CURVE: CurveAxes = (
    [("angle", Dimension::Angle), ("torque", Dimension::Torque)],
    "[[\"-10 deg\", \"-5 N m\"], [0, 0], [\"10 deg\", \"8 N m\"]]",
);
const SLIDE_CURVE: CurveAxes = ([("position", Dimension::Length), ("force", Dimension::Force)], SPRING_CURVE.1);

/// What a curve of a spring takes the place of.
const INSTEAD_OF: &[&str] = &["stiffness", "preload"];
const CURVE_KEYS: [&str; 2] = ["characteristic", "file"];

/// Every kind of force element.
pub static ELEMENT_KINDS: [ElementKind; 7] = [
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
        curve: Some(&ElementCurve {
            keys: CURVE_KEYS,
            slide: SPRING_CURVE,
            hinge: SPRING_CURVE,
            instead_of: INSTEAD_OF,
            help: "tension over the change of the distance from `length`, 2 to 10000 of `[change, tension]`, in place of \
                   `stiffness` and `preload`",
        }),
        acts_by: &["stiffness", "damping", "preload"],
        choices: &[(
            "side",
            SpringSide::WORDS,
            "which way it acts: a tyre and a rubber buffer only push, a rope only pulls",
        )],
        force: |spring| spring.unstretched().abs(),
        look: ElementLook::Coil,
        ..PLAIN
    },
    ElementKind {
        section: "load",
        frequency: Some("frequency"),
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
                upward: false,
                help: "force at the point",
            },
            ElementVector {
                key: "torque",
                dimension: Dimension::Torque,
                range: (-LARGEST_FORCE, LARGEST_FORCE),
                direction: true,
                upward: false,
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
        help: "spring with a damper on a coordinate of a joint, between the two bodies that it connects",
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
        curve: Some(&ElementCurve {
            keys: CURVE_KEYS,
            slide: SLIDE_CURVE,
            hinge: HINGE_CURVE,
            instead_of: INSTEAD_OF,
            help: "force or torque, towards lower coordinates, over the coordinate from `position`, 2 to 10000 of \
                   `[coordinate, force]`, in place of `stiffness` and `preload`",
        }),
        acts_by: &["stiffness", "damping", "preload"],
        force: |spring| match spring.on_hinge {
            true => 0.0,
            false => spring.unstretched().abs(),
        },
        look: ElementLook::Coil,
        ..PLAIN
    },
    ElementKind {
        section: "stop",
        depth: Some("depth"),
        help: "stops at the ends of a coordinate of a joint, which only push",
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
        look: ElementLook::Stop,
        ..PLAIN
    },
    ElementKind {
        section: "bushing",
        help: "three springs along and three about axes fixed in the body of `from`, each with a damper",
        points: &["from", "to"],
        vectors: &[
            stiff("stiffness", Dimension::Stiffness, "along its axes"),
            stiff("damping", Dimension::Damping, "along its axes"),
            stiff("turning_stiffness", Dimension::TurningStiffness, "about its axes"),
            stiff("turning_damping", Dimension::TurningDamping, "about its axes"),
        ],
        frame: "its axes: `axes` in the body of `from`",
        rotations: &[
            ("axes", "its axes in the body of `from`"),
            ("rotation", "orientation of the body of `to` in that of `from` in which it exerts no torque"),
        ],
        acts_by: &["stiffness", "damping", "turning_stiffness", "turning_damping"],
        look: ElementLook::Bushing,
        ..PLAIN
    },
    ElementKind {
        section: "motor",
        help: "force or torque on a coordinate of a joint without a drive, constant or towards a target",
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
        look: ElementLook::Motor,
        ..PLAIN
    },
    ElementKind {
        section: "tyre",
        help: "tyre of a wheel on a ground that may move up and down: a spring with a damper along `up`, which only pushes",
        points: &["on"],
        numbers: &[
            ElementNumber {
                key: "radius",
                dimension: Dimension::Length,
                range: (1e-6, 1e3),
                default: None,
                like: "\"300 mm\"",
                help: "height of the point `on`, the wheel's centre, over the ground at which it begins to push",
                on_hinge: None,
            },
            ElementNumber {
                key: "stiffness",
                dimension: Dimension::Stiffness,
                range: (0.0, LARGEST_FORCE),
                default: None,
                like: "\"200 kN/m\"",
                help: "change of its force with the height",
                on_hinge: None,
            },
            ElementNumber {
                key: "damping",
                dimension: Dimension::Damping,
                range: (0.0, LARGEST_FORCE),
                default: Some(0.0),
                like: "\"200 N s/m\"",
                help: "change of its force with the rate of the height",
                on_hinge: None,
            },
        ],
        vectors: &[ElementVector {
            key: "up",
            dimension: Dimension::None,
            range: (-1.0, 1.0),
            direction: true,
            upward: true,
            help: "which way is up",
        }],
        law: Some(("ground", "height of the ground, along `up` from the world's origin; at rest there if left out")),
        acts_by: &["stiffness"],
        fault: tyre_fault,
        look: ElementLook::Ground,
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
        "must be less than a turn above lower: a hinge is taken within half a turn of their middle".to_owned()
    } else if stop.number("restitution") < 1.0 && stop.number("speed") == 0.0 {
        let why = "missing; a restitution below 1 holds at one approach speed, which must be above 0";
        return Some(("speed", why.to_owned()));
    } else {
        return None;
    };
    Some(("upper", why))
}

fn motor_fault(motor: &Element) -> Option<(&'static str, String)> {
    let follows = ["stiffness", "damping"].map(|key| motor.number(key) > 0.0).contains(&true);
    let why = match (follows, &motor.law) {
        (true, None) => "missing; stiffness and damping pull towards it",
        (false, Some(_)) => "has no effect: stiffness and damping, which pull towards it, are 0",
        (_, Some(law)) if law.slider().is_some() => "a motor follows a law of its own, not that of the scene's sliders",
        _ => return None,
    };
    Some(("target", why.to_owned()))
}

fn tyre_fault(tyre: &Element) -> Option<(&'static str, String)> {
    let why = "a ground follows a law of its own, not that of the scene's sliders";
    let slider = tyre.law.as_ref()?.slider();
    slider.map(|_| ("ground", why.to_owned()))
}

impl Element {
    /// Magnitude of a number that is a force on a slide and a torque on a hinge, N: 0 on a hinge.
    fn force_at_joint(&self, key: &str) -> f64 {
        match self.on_hinge {
            true => 0.0,
            false => self.number(key).abs(),
        }
    }

    /// Tension of a spring at the length, or the coordinate, from which its change counts, N or N m: of a curve, about that.
    fn unstretched(&self) -> f64 {
        let Some(points) = &self.curve else {
            return self.number("preload");
        };
        let next = points.partition_point(|point| point[0] < 0.0);
        let next = next.clamp(1, points.len() - 1);
        let ([x0, y0], [x1, y1]) = (points[next - 1], points[next]);
        y0 - x0 * (y1 - y0) / (x1 - x0)
    }
}

/// The curve of `row`, if `section` gives one.
fn read_curve(section: &Section<'_>, row: &ElementCurve, on_hinge: bool) -> Result<Option<Vec<[f64; 2]>>, SceneError> {
    let (axes, _) = if on_hinge { row.hinge } else { row.slide };
    let most = [MAX_SI, LARGEST_FORCE];
    let axis = |i: usize| Axis { name: axes[i].0, dimension: axes[i].1, most: most[i] };
    let (least, unit) = match on_hinge {
        true => (1e-9, "1e-9 rad"),
        false => (1e-9, "1 nm"),
    };
    let graph = Graph { axes: [axis(0), axis(1)], rise: (least, unit), repeats: false };
    let [points, file] = row.keys;
    let found = match (section.get(points), section.get(file)) {
        (Some(_), Some(node)) => {
            return Err(node.error(format!("not allowed here: `{points}` is given as well")));
        }
        (Some(node), None) => read_points(&node, &graph)?,
        (None, Some(node)) => read_file(&node, &graph)?,
        (None, None) => return Ok(None),
    };
    for key in row.instead_of {
        section.refuse(key, &format!("`{points}`, or its `{file}`, says what the spring exerts"))?;
    }
    Ok(Some(found))
}

/// Upwards, against the gravity that the file gives; `None` if it gives none.
fn up_of(scene: &Scene) -> Option<Vec3> {
    let size = scene.gravity.amax();
    (size > 0.0).then(|| -(scene.gravity / size).normalize())
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
    let mut points = kind.points.iter().map(point).collect::<Result<Vec<_>, _>>()?;
    if let [first, second] = points[..]
        && first.body == second.body
    {
        let [from, to] = [kind.points[0], kind.points[1]];
        return Err(section.error(to, format!("{from} and {to} are on the same body: a {} needs two", kind.section)));
    }
    if let [only] = points[..]
        && only.body.is_none()
    {
        return Err(section.error(kind.points[0], format!("a {} acts on a body, not on the world", kind.section)));
    }
    let mut joint = None;
    if let Some(which) = kind.joint {
        let (index, freedom) = read_coordinate(&section, scene, joints)?;
        let mut of = scene.kinematic_joints().skip(index);
        let of = of.next().expect("a joint of the scene");
        let driven = of.drives().any(|(driven, _)| driven == freedom);
        if which == ElementJoint::Undriven && driven {
            let why = format!("this joint has a drive, which leaves a {} nothing to move", kind.section);
            return Err(section.require("joint")?.error(why));
        }
        points = of.points().to_vec();
        joint = Some((index, freedom));
    }
    let on_hinge = joint.is_some_and(|(_, freedom)| freedom.turns());
    section.document.on_hinge = on_hinge;
    let number = |row: &ElementNumber| {
        let [key, other] = [on_hinge, !on_hinge].map(|hinge| row.on(hinge).0);
        if other != key {
            let (here, there) = if on_hinge { ("hinge", "slide") } else { ("slide", "hinge") };
            let why = format!("the joint is a {here}, where `{key}` belongs; `{other}` is for a {there}");
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
        if row.upward && section.get(row.key).is_none() {
            let why =
                "missing; without gravity only the file can say which way is up: write for example `up = [0, 0, 1]`";
            return up_of(scene).ok_or_else(|| section.error(row.key, why));
        }
        let value = match row.upward {
            true => section.require(row.key)?.direction()?,
            false => section.vector(row.key)?,
        };
        let turns = turns.filter(|_| row.direction);
        Ok(turns.map_or(value, |copy| copy.direction(value)))
    };
    let vectors = kind.vectors.iter().map(vector).collect::<Result<_, SceneError>>()?;
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
        let why = "a body outside the pattern does not turn with its copies: make it that of `from`";
        return Err(section.error(kind.points[1], why));
    }
    let rotations = kind.rotations.iter().map(rotation).collect::<Result<_, SceneError>>()?;
    let curve = kind.curve.map(|row| read_curve(&section, row, on_hinge));
    let law = kind.law.and_then(|(key, _)| section.get(key));
    let law = law.map(|node| read_drive(&node, on_hinge, scene));
    let element = Element {
        name,
        kind,
        points,
        joint,
        on_hinge,
        numbers,
        vectors,
        rotations,
        curve: curve.transpose()?.flatten(),
        law: law.transpose()?,
        choices,
    };
    let acts = |key: &&str| match kind.numbers.iter().any(|number| number.key == *key) {
        true => element.number(key) != 0.0,
        false => element.vector(key) != Vec3::zeros(),
    };
    let curved = element.curve.iter().flatten().any(|point| point[1] != 0.0);
    if !curved && !kind.acts_by.iter().any(acts) {
        let own = |key: &&'static str| {
            let number = kind.numbers.iter().find(|number| number.key == *key);
            number.map_or(*key, |number| number.on(on_hinge).0)
        };
        let keys: Vec<&str> = kind.acts_by.iter().map(own).collect();
        let (kind, keys) = (kind.section, keys.join(", "));
        return Err(section.error("", format!("this {kind} does nothing: {keys} are 0; one must not be")));
    }
    if let Some((key, why)) = (kind.fault)(&element) {
        return Err(match section.get(key) {
            Some(node) => node.error(why),
            None => section.error(key, why),
        });
    }
    Ok((element, section))
}
