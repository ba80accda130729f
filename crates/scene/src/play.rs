//! Play of a `[[joint]]`: the keys of its table `play`, as parameters of the joint, and where the cut bodies start.

use super::document::{Node, Section};
use super::field::{Access, Field, FieldValue, field};
use super::key::{ABOVE_ZERO, DefaultRule, FileKey, FileTable, ValueType, key};
use super::read_joints::{SQUARE, read_own_contact};
use super::table::contact_rows;
use super::*;
use jointplay_physics::contact::{self, ApproachSpeed, Elasticity, FrictionVelocity};
use jointplay_physics::machine::{EndsOn, LooseKind, Pin, Slide};
use jointplay_physics::mechanism::poses_as_given;
use jointplay_physics::units::Dimension as D;
use jointplay_physics::words::Words;
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// Largest dimension of a joint, m.
const MAX_LENGTH: f64 = 1.0;
/// Largest stiffness of a contact, N/m^1.5, and force at which it is matched, N.
const MAX_STIFFNESS: f64 = 1e13;
const MAX_FORCE: f64 = 1e12;
/// Laws of a pin's contact.
const ELASTIC: [&str; 2] = ["sphere", "line"];
/// Words of a key that is true or false.
const TRUTH: [&str; 2] = ["true", "false"];

const REVOLUTE: &str = "revolute";
const CYLINDRICAL: &str = "cylindrical";
const PRISMATIC: &str = "prismatic";
const SPHERICAL: &str = "spherical";
const PINS: &[&str] = &[REVOLUTE, CYLINDRICAL];
const ROUND: &[&str] = &[REVOLUTE, CYLINDRICAL, SPHERICAL];

/// A key of the table `play`, which is also a parameter of the joint.
struct Row {
    /// Kinds of joint that have it.
    kinds: &'static [&'static str],
    /// Contact parameter in which its value is; `None` for a dimension, which a change reads from the text again.
    part: Option<&'static str>,
    parameter: Parameter,
    in_file: FileKey,
}

/// A play or a radius, which a run changes.
fn live(
    name: &'static str,
    kinds: &'static [&'static str],
    (part, field): (&'static str, Field<contact::Parameters>),
    label: &'static str,
    default: &'static str,
    help: &'static str,
) -> Row {
    let key: &'static str = format!("play.{name}").leak();
    let of = part;
    let (least, slider) = if of == "ball_radius" { (1e-4, (1e-3, 0.1)) } else { (0.0, (0.0, 1e-3)) };
    let kind = Kind::Number {
        dimension: D::Length,
        min: least,
        max: MAX_LENGTH,
        display: "mm",
        slider,
        logarithmic: of == "ball_radius",
    };
    let parameter = Parameter {
        key,
        access: Access::Contact(field),
        label,
        group: "Play",
        kind,
        default: Value::Unset,
        scope: Scope::Joint,
        at_reset: false,
        help,
        equation: "Ambrósio & Pombo (2018), unified joint with clearance",
    };
    let in_file = super::key::key(name, ValueType::Parameter(key), "", help).default_text(default);
    Row { kinds, part: Some(part), parameter, in_file }
}

/// A dimension or a choice, which takes effect at a reset.
fn fixed(
    in_file: FileKey,
    kinds: &'static [&'static str],
    label: &'static str,
    kind: Kind,
    get: fn(&LooseJoint) -> Value,
) -> Row {
    let parameter = Parameter {
        key: format!("play.{}", in_file.name).leak(),
        access: Access::Joint(get),
        label,
        group: "Play",
        kind,
        default: Value::Unset,
        scope: Scope::Joint,
        at_reset: true,
        help: in_file.help,
        equation: "Ambrósio & Pombo (2018), unified joint with clearance",
    };
    Row { kinds, part: None, parameter, in_file }
}

fn length(
    name: &'static str,
    kinds: &'static [&'static str],
    label: &'static str,
    example: (&'static str, DefaultRule),
    help: &'static str,
    get: fn(&LooseJoint) -> Value,
) -> Row {
    quantity(name, kinds, label, (D::Length, MAX_LENGTH, "mm"), example, help, get)
}

/// A quantity above 0 up to `most`, SI.
fn quantity(
    name: &'static str,
    kinds: &'static [&'static str],
    label: &'static str,
    (dimension, most, display): (D, f64, &'static str),
    (example, default): (&'static str, DefaultRule),
    help: &'static str,
    get: fn(&LooseJoint) -> Value,
) -> Row {
    let in_file = key(name, ValueType::Number(dimension, (ABOVE_ZERO, most)), example, help);
    let slider = (1e-3 * most, 0.1 * most);
    let kind = Kind::Number { dimension, min: ABOVE_ZERO, max: most, display, slider, logarithmic: true };
    fixed(FileKey { default, ..in_file }, kinds, label, kind, get)
}

fn pin(joint: &LooseJoint) -> Option<&Pin> {
    if let LooseKind::Pin(pin) = &joint.kind { Some(pin) } else { None }
}

fn slide(joint: &LooseJoint) -> Option<&Slide> {
    if let LooseKind::Slide(slide) = &joint.kind { Some(slide) } else { None }
}

fn number(value: Option<f64>) -> Value {
    value.map_or(Value::Unset, Value::Number)
}

static ROWS: LazyLock<Vec<Row>> = LazyLock::new(|| {
    let words = DefaultRule::Description;
    vec![
        live(
            "radial",
            ROUND,
            ("clearance", field!(clearance)),
            "Radial play",
            "`contact.clearance`",
            "Radius of the bearing less that of the pin, or of the socket less that of the ball. With 0 the joint is ideal.",
        ),
        live(
            "axial",
            &[REVOLUTE],
            ("second_clearance", field!(second_clearance)),
            "Axial play",
            "0: nothing moves along the axis",
            "How far the pin moves along its axis to each side of its middle before its collars touch the bearing.",
        ),
        live(
            "y",
            &[PRISMATIC],
            ("clearance", field!(clearance)),
            "Play along y",
            "`contact.clearance`",
            "Gap between the block and each wall of its guide across the joint's second axis. With 0 these walls are ideal.",
        ),
        live(
            "z",
            &[PRISMATIC],
            ("second_clearance", field!(second_clearance)),
            "Play along z",
            "`contact.clearance`; 0 with `planar`",
            "The same across the joint's third axis.",
        ),
        live(
            "radius",
            ROUND,
            ("ball_radius", field!(ball_radius)),
            "Radius",
            "`contact.ball_radius`",
            "Radius of the pin, or of the ball.",
        ),
        length(
            "length",
            PINS,
            "Length",
            ("\"24 mm\"", DefaultRule::RequiredUnless("planar")),
            "length of the shorter of pin and bearing, centred on the joint's point: they touch at its two ends",
            |joint| number(pin(joint).and_then(|pin| pin.length)),
        ),
        fixed(
            key("ends", ValueType::Word(EndsOn::WORDS), "\"pin\"", "whose ends touch, those of the shorter part")
                .default_text("`bearing`"),
            PINS,
            "Ends of",
            Kind::Choice(EndsOn::WORDS),
            |joint| pin(joint).map_or(Value::Unset, |pin| Value::Choice(pin.ends.word())),
        ),
        length(
            "face_radius",
            &[REVOLUTE],
            "Radius of the faces",
            ("\"15 mm\"", words("collars touch on the axis and exert no torque")),
            "radius at which the collars touch the faces of the bearing",
            |joint| number(pin(joint).and_then(|pin| pin.face_radius)),
        ),
        length(
            "travel",
            PINS,
            "Travel",
            ("\"5 mm\"", words("not checked")),
            "how far the longer of pin and bearing reaches beyond the other; a run that exceeds it is doubted",
            |joint| number(pin(joint).and_then(|pin| pin.travel)),
        ),
        length(
            "half_length",
            &[PRISMATIC],
            "Half length",
            ("\"25 mm\"", DefaultRule::Required),
            "half of the block's length along the guide; the child is the block",
            |joint| number(slide(joint).map(|slide| slide.half_length)),
        ),
        length(
            "half_y",
            &[PRISMATIC],
            "Half width",
            ("\"20 mm\"", DefaultRule::Required),
            "half of its width along the joint's second axis",
            |joint| number(slide(joint).map(|slide| slide.half_width)),
        ),
        length(
            "half_z",
            &[PRISMATIC],
            "Half height",
            ("\"20 mm\"", DefaultRule::RequiredUnless("planar")),
            "half of its height along the joint's third axis",
            |joint| number(slide(joint).and_then(|slide| slide.half_height)),
        ),
        length(
            "corner_radius",
            &[PRISMATIC],
            "Corner radius",
            ("\"1 mm\"", DefaultRule::Number(1e-3)),
            "radius of curvature of its corners, which sets their stiffness",
            |joint| number(slide(joint).map(|slide| slide.corner_radius)),
        ),
        quantity(
            "stiffness",
            &[REVOLUTE, CYLINDRICAL, PRISMATIC, SPHERICAL],
            "Stiffness",
            (D::ContactStiffness, MAX_STIFFNESS, "N/m^1.5"),
            ("\"1.5e11 N/m^1.5\"", words("from radii and materials")),
            "K of the joint, which the ends of a pin share, or of each corner of a block, whatever the play",
            |joint| match joint.contact.elasticity {
                Elasticity::Stiffness(stiffness) => Value::Number(stiffness),
                _ => Value::Unset,
            },
        ),
        quantity(
            "stiffness_at",
            PINS,
            "Stiffness at",
            (D::Force, MAX_FORCE, "N"),
            ("\"1 kN\"", words("from radii and materials")),
            "the force at which a pin is as deep in its bearing as in Johnson's line contact; right there only",
            |joint| match joint.contact.elasticity {
                Elasticity::StiffnessAt { force, .. } => Value::Number(force),
                _ => Value::Unset,
            },
        ),
        fixed(
            key(
                "elastic",
                ValueType::Word(&ELASTIC),
                "\"line\"",
                "the law of its contacts: spheres after Hertz, which the books use for pins, too, or Johnson's line contact",
            )
            .default_text("`sphere`"),
            PINS,
            "Elastic law",
            Kind::Choice(&ELASTIC),
            |joint| {
                let is_line = matches!(joint.contact.elasticity, Elasticity::Line { .. });
                Value::Choice(ELASTIC[usize::from(is_line)])
            },
        ),
        fixed(
            key("planar", ValueType::Flag, "true", "whether it neither tilts nor leaves its plane: cheaper to compute")
                .default_text("false"),
            &[REVOLUTE, PRISMATIC],
            "Planar",
            Kind::Choice(&TRUTH),
            |joint| {
                let planar = match joint.kind {
                    LooseKind::Ball => return Value::Unset,
                    LooseKind::Pin(pin) => pin.length.is_none(),
                    LooseKind::Slide(slide) => slide.half_height.is_none(),
                };
                Value::Choice(TRUTH[usize::from(!planar)])
            },
        ),
    ]
});

/// Rows of all kinds.
pub(super) fn rows() -> impl Iterator<Item = &'static Parameter> {
    ROWS.iter().map(|row| &row.parameter)
}

/// Row of `name` in the table `play` of a joint of this kind.
fn row(kind: &LooseKind, name: &str) -> Option<&'static Row> {
    ROWS.iter().find(|row| row.in_file.name == name && row.kinds.contains(&kind.word()))
}

/// Contact parameter in which the value of a row of `play` is.
pub(super) fn part_of(parameter: &Parameter) -> Option<&'static str> {
    ROWS.iter().find(|row| row.parameter == *parameter)?.part
}

/// The parameter with this last part of a joint's key, `radial` after `joint.J.play.` or `friction` after `joint.J.`, and that last
/// part as the joint's keys have it: a ball's play is its clearance.
pub(super) fn parameter_of(joint: &LooseJoint, part: &str) -> Option<(&'static Parameter, String)> {
    let of_contact = |part: &str| Some((find(&format!("contact.{part}"))?, part.to_owned()));
    match (part.strip_prefix("play."), &joint.kind) {
        (None, LooseKind::Ball) => of_contact(part),
        (Some(name), LooseKind::Ball) => of_contact(row(&joint.kind, name)?.part?),
        (None, _) if own_part(&joint.kind, part) == part => of_contact(part),
        (None, _) => None,
        (Some(name), kind) => Some((&row(kind, name)?.parameter, part.to_owned())),
    }
}

/// Last part of a joint's key for the contact parameter `part`: `play.radial` of a pin for its clearance.
pub(super) fn own_part<'a>(kind: &LooseKind, part: &'a str) -> &'a str {
    let own = ROWS.iter().find(|row| row.part == Some(part) && row.kinds.contains(&kind.word()));
    own.filter(|_| *kind != LooseKind::Ball).map_or(part, |row| row.parameter.key)
}

/// Name in the table `play` of the last part of a joint's key: `radial` for `play.radial`, and of a ball for `clearance`.
pub(super) fn name_of<'a>(kind: &LooseKind, part: &'a str) -> Option<&'a str> {
    let of_ball = || {
        let own = ROWS.iter().find(|row| row.part == Some(part) && row.kinds.contains(&SPHERICAL));
        own.filter(|_| *kind == LooseKind::Ball).map(|row| row.in_file.name)
    };
    part.strip_prefix("play.").or_else(of_ball)
}

/// The contact parameter of the last part of a joint's key: the reverse of [`own_part`].
pub(super) fn contact_part<'a>(kind: &LooseKind, part: &'a str) -> &'a str {
    let own = part.strip_prefix("play.").and_then(|name| row(kind, name)?.part);
    own.unwrap_or(part)
}

/// Last parts of the keys of the parameters of `joint`.
pub(super) fn parts_of(joint: &LooseJoint) -> impl Iterator<Item = &'static str> + '_ {
    let own = ROWS.iter().filter(|row| joint.kind != LooseKind::Ball && row.kinds.contains(&joint.kind.word()));
    let own = own.filter(|row| row.part.is_some()).map(|row| row.parameter.key);
    own.chain(contact_rows().map(|(part, _)| part).filter(|part| own_part(&joint.kind, part) == *part))
}

/// The table `play` of each kind of joint, with the kind.
pub(super) static TABLES: LazyLock<Vec<(&'static str, FileTable)>> = LazyLock::new(|| {
    let table = |kind: &'static str, name: &'static str, what: &'static str| {
        let own = ROWS.iter().filter(|row| row.kinds.contains(&kind)).map(|row| row.in_file);
        let second = key(
            "second_axis",
            ValueType::Direction,
            "[0, 1, 0]",
            "the joint's second axis, y, perpendicular to `axis`; the third, z, completes them by the right-hand rule",
        )
        .default_text("along the coordinate axis after the one nearest to `axis`: y for x, z for y, x for z")
        .frame("the parent's");
        let own: Vec<FileKey> = own.chain((kind == PRISMATIC).then_some(second)).collect();
        let head: &'static str = format!("`play` of a {kind} joint").leak();
        (kind, FileTable::new(name, head, what, own.leak()))
    };
    vec![
        table(REVOLUTE, "revolute_play", "a pin in its bearing: the parent is the bearing, the child the pin"),
        table(CYLINDRICAL, "cylindrical_play", "a pin that slides in its bearing: the parent is the bearing"),
        table(PRISMATIC, "prismatic_play", "a block between the flat walls of its guide: the parent is the guide"),
        table(SPHERICAL, "spherical_play", "a ball in its socket: the parent is the socket"),
    ]
});

/// Keys of a `start` that displace the child of a joint with play.
pub(super) const DISPLACEMENT: [FileKey; 4] = {
    const AXES: &str = "the parent's";
    [
        displaced("offset", D::Length, "\"0 0 0.05 mm\"", "by which the child is off the place without play")
            .frame(AXES),
        displaced(
            "tilt",
            D::Angle,
            "\"0 0.1 0 deg\"",
            "by which it is turned from it about the joint's point: axis times angle",
        )
        .frame(AXES),
        displaced(
            "offset_velocity",
            D::Speed,
            "\"0 0 -0.2 m/s\"",
            "velocity of its joint's point beyond that without play",
        )
        .frame(AXES),
        displaced("tilt_velocity", D::AngularSpeed, "\"0 3 0 rad/s\"", "angular velocity beyond that without play")
            .frame(AXES),
    ]
};

const fn displaced(name: &'static str, dimension: D, example: &'static str, help: &'static str) -> FileKey {
    key(name, super::key::vector(dimension), example, help).default_zero()
}

/// What a joint with play has besides its kind and points: the tables of the file, and how its child starts.
pub(super) struct PlayText<'d> {
    /// The table `play`; a spherical joint need not have one.
    pub table: Option<Section<'d>>,
    /// Displacement of the child from its place without play, in the parent's axes: point, m, turn, rad, and their rates.
    pub displaced: [Vec3; 4],
}

/// Reads the table `play` of a joint, and the displacement of its start; `None` without play.
pub(super) fn read_play<'d>(section: &Section<'d>) -> Result<Option<PlayText<'d>>, SceneError> {
    let spherical = section.word == Some(SPHERICAL);
    let has_table = section.word.is_some_and(|word| TABLES.iter().any(|(kind, _)| *kind == word));
    let table = if has_table { section.get("play").map(|node| node.section()).transpose()? } else { None };
    let start = section.get("start").map(|node| node.section()).transpose()?.filter(|_| has_table);
    if table.is_none() && !spherical {
        let without = "only a joint with a table `play` has it";
        for (part, _) in contact_rows().filter(|(part, _)| has_table && section.rows.key(part, None).is_some()) {
            section.refuse(part, without)?;
        }
        for key in DISPLACEMENT {
            start.as_ref().map_or(Ok(()), |start| start.refuse(key.name, without))?;
        }
        return Ok(None);
    }
    if !spherical {
        section.refuse("drive", "a joint with play has no drive; drive the joint of another body")?;
    }
    let mut displaced = [Vec3::zeros(); 4];
    if let Some(start) = start {
        for (value, key) in displaced.iter_mut().zip(DISPLACEMENT) {
            *value = start.vector(key.name)?;
        }
    }
    Ok(Some(PlayText { table, displaced }))
}

/// The joint with play that `joint` becomes; its bodies are those of the sorted scene. Its table sets dimensions, then its own
/// contact parameters override those of the scene. Returns the nodes of these by parameter.
pub(super) fn loose_joint<'d>(
    joint: &Joint,
    (section, play): (&Section<'d>, &PlayText<'d>),
    scene: &Scene,
    scene_gives_speed: bool,
) -> Result<(LooseJoint, BTreeMap<&'static str, Node<'d>>), SceneError> {
    let table = play.table.as_ref();
    let number = |name: &str| table.and_then(|table| table.get(name)).map(|node| node.number()).transpose();
    let flag = |name: &str| table.and_then(|table| table.get(name)).map_or(Ok(false), |node| node.flag());
    let required = |name: &str| table.map_or(Ok(0.0), |table| table.require(name)?.number());
    let kind = match joint.kind {
        JointKind::Revolute | JointKind::Cylindrical => {
            let kept = joint.kind == JointKind::Revolute;
            let planar = kept && flag("planar")?;
            let ends = match table.and_then(|table| table.get("ends")) {
                Some(node) => node.word()?,
                None => EndsOn::default(),
            };
            let length = number("length")?;
            let length = if planar { None } else { Some(length.map_or_else(|| required("length"), Ok)?) };
            let face_radius = if kept { number("face_radius")? } else { None };
            LooseKind::Pin(Pin { length, ends, kept, face_radius, travel: number("travel")? })
        }
        JointKind::Prismatic => LooseKind::Slide(Slide {
            half_length: required("half_length")?,
            half_width: required("half_y")?,
            half_height: if flag("planar")? { None } else { Some(required("half_z")?) },
            corner_radius: table.map_or(Ok(0.0), |table| table.number("corner_radius"))?,
        }),
        _ => LooseKind::Ball,
    };
    let [carrier, carried] = joint.points();
    let on = joint.parent.map(|parent| &*scene.machine.bodies[parent].name);
    let elasticity = read_elasticity(kind, table)?;
    let mut loose = LooseJoint {
        kind,
        opening: scene.view.down.unit(),
        contact: contact::Parameters { elasticity, ..scene.machine.contact },
        ..LooseJoint::ball(&joint.name, carrier, carried)
    };
    if let Some(node) = section.rows.key("opening", section.word).and_then(|_| section.get("opening")) {
        let own = node.direction()?;
        loose.opening = section.document.instance.map_or(own, |instance| instance.direction(on, own));
    }
    if kind != LooseKind::Ball {
        let axes = axes_of(joint, section, table, on)?;
        loose.frames[0].rotation = axes;
        loose.frames[1].rotation = joint.rotation.inverse() * axes;
        loose.contact.friction_velocity = FrictionVelocity::Surface;
        loose.contact.second_clearance = match kind {
            LooseKind::Slide(Slide { half_height: Some(_), .. }) => loose.contact.clearance,
            _ => 0.0,
        };
        if !scene_gives_speed {
            loose.contact.approach_speed = ApproachSpeed::Largest;
        }
    }
    let mut places = read_own_contact(section, &mut loose)?;
    match table {
        None => {
            // Without a table it has no play.
            loose.contact.clearance = 0.0;
            places.extend(section.get("kind").map(|node| ("clearance", node)));
        }
        Some(table) => {
            for Row { part, parameter, in_file, .. } in ROWS.iter().filter(|row| row.kinds.contains(&kind.word())) {
                if let (Some(part), Access::Contact(field), Some(node)) =
                    (part, parameter.access, table.get(in_file.name))
                {
                    (field.set)(&mut loose.contact, &node.parameter()?);
                    places.insert(part, node);
                }
            }
        }
    }
    Ok((loose, places))
}

/// The elastic law that the table `play` gives.
fn read_elasticity(kind: LooseKind, table: Option<&Section<'_>>) -> Result<Elasticity, SceneError> {
    let Some(table) = table else { return Ok(Elasticity::Sphere) };
    let given = |name: &str| table.rows.key(name, None).and_then(|_| table.get(name));
    let [stiffness, at, elastic] = ["stiffness", "stiffness_at", "elastic"].map(given);
    let elastic = elastic.map(|node| Ok::<_, SceneError>((node.choice()?, node))).transpose()?;
    let line = elastic.filter(|(word, _)| *word == ELASTIC[1]).map(|(_, node)| node);
    let mut all = [&stiffness, &at, &line].into_iter().flatten();
    if let (Some(_), Some(second)) = (all.next(), all.next()) {
        return Err(
            second.error("is one of three ways to say how stiff it is: give `stiffness`, `stiffness_at` or `elastic`")
        );
    }
    // Also of a planar pin, which has no ends.
    let length = || if matches!(kind, LooseKind::Pin(_)) { table.require("length")?.number() } else { Ok(0.0) };
    Ok(match (&stiffness, &at, &line) {
        (Some(stiffness), ..) => Elasticity::Stiffness(stiffness.number()?),
        (_, Some(at), _) => Elasticity::StiffnessAt { force: at.number()?, length: length()? },
        (.., Some(_)) => Elasticity::Line { length: length()? },
        _ => Elasticity::Sphere,
    })
}

/// Nodes of the dimensions in the table `play`, by the last part of the joint's key.
pub(super) fn dimensions<'d>(play: &PlayText<'d>) -> impl Iterator<Item = (&'static str, Node<'d>)> {
    let rows = ROWS.iter().filter(|row| row.part.is_none());
    rows.filter_map(|Row { parameter, in_file, .. }| {
        let table = play.table.as_ref().filter(|table| table.rows.key(in_file.name, None).is_some())?;
        Some((parameter.key, table.get(in_file.name)?))
    })
}

/// Axes of a joint in its parent, the body `on` or the world: x along its axis, y along its second axis.
fn axes_of(
    joint: &Joint,
    section: &Section<'_>,
    table: Option<&Section<'_>>,
    on: Option<&str>,
) -> Result<Quat, SceneError> {
    let x = joint.axis;
    let second = table.filter(|table| table.rows.key("second_axis", None).is_some());
    let y = match second.and_then(|table| table.get("second_axis")) {
        Some(node) => {
            let own = node.direction()?;
            let own = section.document.instance.map_or(own, |instance| instance.direction(on, own));
            if own.dot(&x).abs() > SQUARE {
                return Err(node.error("must be perpendicular to `axis`"));
            }
            own
        }
        None => {
            let nearest = x.abs().imax();
            Vec3::from_fn(|i, _| if i == (nearest + 1) % 3 { 1.0 } else { 0.0 })
        }
    };
    let y = (y - x * x.dot(&y)).normalize();
    let axes = Mat3::from_columns(&[x, y, x.cross(&y)]);
    Ok(Quat::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(axes)))
}

/// Puts the children of cut joints, free bodies, where they start: each at its place without play relative to its parent, then
/// displaced. `displaced` has the displacement of each cut joint of the tree, by body.
pub(super) fn place_cut_bodies(machine: &mut Machine, displaced: &BTreeMap<usize, [Vec3; 4]>) {
    if displaced.is_empty() {
        return;
    }
    let given = poses_as_given(machine);
    let mut placed: Vec<JointStart> = Vec::with_capacity(given.len());
    for (body, joint) in machine.joints.iter_mut().enumerate() {
        let world = JointStart::Pose {
            position: Vec3::zeros(),
            rotation: Quat::identity(),
            velocity: Vec3::zeros(),
            angular_velocity: Vec3::zeros(),
        };
        let of_parent = |poses: &[JointStart]| joint.parent.map_or(world, |parent| poses[parent]);
        let [was, is] = [of_parent(&given), of_parent(&placed)];
        let mut own = if was == is { given[body] } else { carried_along(&given[body], &was, &is) };
        if let Some(displaced) = displaced.get(&body) {
            own = displace(&own, &is, &joint.child_point, displaced);
            let name = std::mem::take(&mut joint.name);
            *joint = Joint { name, start: own, ..Joint::free(body) };
        }
        placed.push(own);
    }
}

/// Pose and motion as fields: position, rotation, velocity and angular velocity.
fn parts(pose: &JointStart) -> (Vec3, Quat, Vec3, Vec3) {
    match *pose {
        JointStart::Pose { position, rotation, velocity, angular_velocity } => {
            (position, rotation, velocity, angular_velocity)
        }
        JointStart::Scalar { .. } | JointStart::Pair { .. } => {
            (Vec3::zeros(), Quat::identity(), Vec3::zeros(), Vec3::zeros())
        }
    }
}

/// The pose and motion that `own` has when its parent is moved from the pose `was` to `is`.
fn carried_along(own: &JointStart, was: &JointStart, is: &JointStart) -> JointStart {
    let ((x, r, v, w), (x0, r0, v0, w0), (x1, r1, v1, w1)) = (parts(own), parts(was), parts(is));
    let turn = r1 * r0.inverse();
    let arm = turn * (x - x0);
    JointStart::Pose {
        position: x1 + arm,
        rotation: turn * r,
        velocity: v1 + w1.cross(&arm) + turn * (v - v0 - w0.cross(&(x - x0))),
        angular_velocity: w1 + turn * (w - w0),
    }
}

/// `own` displaced against its parent: its joint's point, at `point` in its frame, is moved and the body turned about it.
fn displace(
    own: &JointStart,
    parent: &JointStart,
    point: &Vec3,
    [offset, tilt, speed, spin]: &[Vec3; 4],
) -> JointStart {
    let ((x, r, v, w), (x0, r0, v0, w0)) = (parts(own), parts(parent));
    let arm = r * point;
    let relative = v + w.cross(&arm) - v0 - w0.cross(&(x + arm - x0));
    let rotation = r0 * Quat::from_scaled_axis(*tilt) * r0.inverse() * r;
    let at = x + arm + r0 * offset;
    let angular_velocity = w + r0 * spin;
    let arm = rotation * point;
    JointStart::Pose {
        position: at - arm,
        rotation,
        velocity: v0 + w0.cross(&(at - x0)) + relative + r0 * speed - angular_velocity.cross(&arm),
        angular_velocity,
    }
}
