//! Force elements of a scene file: a table and a reader per kind. Their physics is in `mechanism/elements`.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use super::document::{Node, Section};
use super::drives::{DRIVE, FACTOR, MAX_DRIVE_FREQUENCY, interpolation, read_drive};
use super::instance::Instance;
use super::key::{FileKey, FileTable, MAX_SI, ValueType, at_most, key, number};
use super::placement::{ATTACHMENT, ROTATION, read_attachment, read_rotation};
use super::points::{Axis, Graph, MAX_POINTS, read_file, read_points};
use super::read_joints::{allowed_joints, read_coordinate};
use super::*;
use jointplay_physics::interpolate::Interpolation;
use jointplay_physics::machine::{
    Bushing, Characteristic, Drive, Element, ElementKind, Harmonic, JointCoordinate, JointSpring, Load, LoadAxes,
    LooseKind, Lubricant, Motor, Quat, Spring, SpringSide, Stop, Tyre, Vec3,
};
use jointplay_physics::suggest::nearest;
use jointplay_physics::units::Dimension as D;
use jointplay_physics::words::Words;

const MAX_FORCE: f64 = 1e12;

/// All kinds of force elements: table, and reader of the section once the attachment is known.
pub(super) static ELEMENTS: LazyLock<Vec<(&FileTable, ReadKind)>> = LazyLock::new(|| {
    vec![
        (&SPRING, read_spring),
        (&LOAD, read_load),
        (&JOINT_SPRING, read_joint_spring),
        (&STOP, read_stop),
        (&BUSHING, read_bushing),
        (&MOTOR, read_motor),
        (&TYRE, read_tyre),
        (&LUBRICANT, read_lubricant),
    ]
});

/// Whether `table` describes a force element.
pub fn is_element(table: &FileTable) -> bool {
    ELEMENTS.iter().any(|(of, _)| of.name == table.name)
}

pub(super) type ReadKind = fn(&ElementReader<'_, '_>) -> Result<ElementKind, SceneError>;

const NAME: FileKey = key("name", ValueType::Name, "\"s1\"", "its name, different from those of joints");

const COORDINATE: FileKey = key(
    "coordinate",
    ValueType::Word(&["position", "angle", "child_angle"]),
    "\"angle\"",
    "which coordinate of a joint that has two: `position` or `angle` of a cylindrical one, `angle` or `child_angle` of a universal one",
)
.default_text("the only one");

const fn joint(help: &'static str) -> FileKey {
    key("joint", ValueType::Joint, "\"crank\"", help)
}

const fn point(name: &'static str) -> FileKey {
    key(name, ValueType::Table(&ATTACHMENT), "{ body = \"rod\", at = \"0 0 100 mm\" }", "point of attachment")
}

/// A number of either sign, such as a force, up to `MAX_FORCE`.
const fn signed(name: &'static str, dimension: D, example: &'static str, help: &'static str) -> FileKey {
    key(name, ValueType::Number(dimension, (-MAX_FORCE, MAX_FORCE)), example, help)
}

/// A nonnegative number up to `MAX_FORCE`.
const fn unsigned(name: &'static str, dimension: D, example: &'static str, help: &'static str) -> FileKey {
    key(name, ValueType::Number(dimension, (0.0, MAX_FORCE)), example, help)
}

/// Stiffness and damping of an element on a joint.
const fn joint_stiffness(help: &'static str) -> FileKey {
    unsigned("stiffness", D::Stiffness, "\"10 N/mm\"", help)
        .default_zero()
        .on_hinge(D::TurningStiffness, "\"5 N m/rad\"")
}

const fn joint_damping(help: &'static str) -> FileKey {
    unsigned("damping", D::Damping, "\"20 N s/m\"", help)
        .default_zero()
        .on_hinge(D::TurningDamping, "\"0.1 N m s/rad\"")
}

/// A reference value of a joint coordinate.
const fn coordinate(name: &'static str, examples: [&'static str; 2], help: &'static str) -> FileKey {
    key(name, number(D::Length), examples[0], help).on_hinge(D::Angle, examples[1])
}

/// Stiffnesses or dampings along or about three axes.
const fn diagonal(name: &'static str, dimension: D, help: &'static str) -> FileKey {
    key(name, ValueType::Vector(dimension, (0.0, MAX_FORCE)), "", help)
        .default_zero()
        .frame("its axes: `axes` in the body of `from`")
}

const fn vector(name: &'static str, dimension: D, help: &'static str) -> FileKey {
    key(name, ValueType::Vector(dimension, (-MAX_FORCE, MAX_FORCE)), "", help)
        .default_zero()
        .frame("the world's, or the body's with `axes = \"body\"`")
}

const fn rotation(name: &'static str, help: &'static str) -> FileKey {
    key(name, ValueType::Table(&ROTATION), "{ axis = [0, 1, 0], angle = \"15 deg\" }", help).default_zero()
}

fn law(name: &'static str, help: &'static str) -> FileKey {
    key(name, ValueType::Table(&DRIVE), "{ law = \"constant\", velocity = \"10 mm/s\" }", help).default_text("none")
}

const CURVE_LIKE: &str = "[[\"-10 mm\", \"-50 N\"], [0, 0], [\"10 mm\", \"80 N\"]]";

/// Points of a force curve in place of `stiffness` and `preload`.
const fn curve(help: &'static str) -> FileKey {
    let pairs = ValueType::Pairs([D::Length, D::Force], at_most(MAX_POINTS, "points"));
    key("characteristic", pairs, CURVE_LIKE, help).default_text(WITHOUT_CURVE)
}

const CURVE_FILE: FileKey = key(
    "file",
    ValueType::File,
    "\"coil.csv\"",
    "instead of the points: a CSV file beside the scene, two columns under a header with units",
)
.default_text(WITHOUT_CURVE);
const WITHOUT_CURVE: &str = "`stiffness` and `preload` hold";

static SPRING: FileTable = FileTable::new(
    "spring",
    "[[spring]]",
    "spring with a damper along the line between two points",
    &[
        NAME,
        point("from"),
        point("to"),
        key(
            "length",
            ValueType::Number(D::Length, (0.0, 1e6)),
            "\"100 mm\"",
            "distance of the points at which the spring carries `preload`",
        ),
        unsigned("stiffness", D::Stiffness, "\"10 N/mm\"", "change of its tension with the distance").default_zero(),
        unsigned("damping", D::Damping, "\"20 N s/m\"", "change of its tension with the rate of the distance")
            .default_zero(),
        signed("preload", D::Force, "\"5 N\"", "tension at `length`; negative where it pushes").default_zero(),
        curve(
            "tension over the change of the distance from `length`, 2 to 10000 of `[change, tension]`, in place of `stiffness` and \
             `preload`",
        ),
        CURVE_FILE,
        interpolation(&[]),
        key(
            "side",
            ValueType::Word(SpringSide::WORDS),
            "",
            "direction in which it acts: a tyre or a rubber buffer only pushes, a rope only pulls",
        )
        .default_text(SpringSide::Both.word()),
    ],
);

static LOAD: LazyLock<FileTable> = LazyLock::new(|| {
    FileTable::new(
        "load",
        "[[load]]",
        "force and torque from outside on a body, constant, times sin(2π frequency t + phase), or times another law of time",
        vec![
            NAME,
            point("on"),
            key(
                "frequency",
                ValueType::Number(D::Frequency, (0.0, MAX_DRIVE_FREQUENCY)),
                "\"2 Hz\"",
                "0 for a constant load",
            )
            .default_zero(),
            key("phase", number(D::Angle), "\"90 deg\"", "phase at t = 0; not used where the load is constant")
                .default_zero(),
            key(
                "factor",
                ValueType::Table(&FACTOR),
                "{ law = \"ramp\", to = 1, duration = \"0.5 s\" }",
                "factor of force and torque over time, by the laws of drives, in place of `frequency` and `phase`",
            )
            .default_text("1, or that of `frequency`"),
            vector("force", D::Force, "force at the point"),
            vector("torque", D::Torque, "torque"),
            key(
                "axes",
                ValueType::Word(LoadAxes::WORDS),
                "",
                "whether force and torque keep to the world's axes or turn with the body",
            )
            .default_text(LoadAxes::World.word()),
        ]
        .leak(),
    )
});

static JOINT_SPRING: FileTable = FileTable::new(
    "joint_spring",
    "[[joint_spring]]",
    "spring with a damper on a coordinate of a joint, between the two bodies that it connects",
    &[
        NAME,
        joint("the joint on which it acts"),
        COORDINATE,
        coordinate("position", ["\"10 mm\"", "\"30 deg\""], "joint coordinate at which it carries `preload`").default_zero(),
        joint_stiffness("change of its force or torque with the coordinate"),
        joint_damping("change of its force or torque with the rate of the coordinate"),
        signed("preload", D::Force, "\"5 N\"", "force or torque at `position`, towards lower coordinates")
            .default_zero()
            .on_hinge(D::Torque, "\"0.5 N m\""),
        curve(
            "force or torque, towards lower coordinates, over the coordinate from `position`, 2 to 10000 of `[coordinate, force]`, in \
             place of `stiffness` and `preload`",
        )
        .on_hinge(D::Torque, "[[\"-10 deg\", \"-5 N m\"], [0, 0], [\"10 deg\", \"8 N m\"]]"),
        CURVE_FILE,
        interpolation(&[]),
    ],
);

static STOP: FileTable = FileTable::new(
    "stop",
    "[[stop]]",
    "stops at the ends of a coordinate of a joint, which only push",
    &[
        NAME,
        joint("the joint on which it acts"),
        COORDINATE,
        coordinate("lower", ["\"-20 mm\"", "\"-30 deg\""], "joint coordinate at which the lower stop begins")
            .default_value(f64::NEG_INFINITY),
        coordinate("upper", ["\"20 mm\"", "\"30 deg\""], "joint coordinate at which the upper stop begins")
            .default_value(f64::INFINITY),
        unsigned("force", D::Force, "\"500 N\"", "force of a stop pressed in slowly by `depth`, on a slide")
            .unless("torque"),
        unsigned("torque", D::Torque, "\"20 N m\"", "torque of a stop pressed in slowly by `depth`, on a hinge")
            .unless("force"),
        key("depth", ValueType::Number(D::Length, (1e-9, 1e3)), "\"1 mm\"", "depth at which it exerts that")
            .on_hinge(D::Angle, "\"1 deg\""),
        key(
            "restitution",
            ValueType::Number(D::None, (0.01, 1.0)),
            "0.5",
            "speed after over speed before an impact at `speed`",
        )
        .default_value(1.0),
        key(
            "speed",
            ValueType::Number(D::Speed, (0.0, 1e6)),
            "\"0.1 m/s\"",
            "approach speed at which it rebounds with `restitution`; needed where that is below 1",
        )
        .default_zero()
        .on_hinge(D::AngularSpeed, "\"1 rad/s\""),
    ],
);

static BUSHING: FileTable = FileTable::new(
    "bushing",
    "[[bushing]]",
    "three springs along and three about axes fixed in the body of `from`, each with a damper",
    &[
        NAME,
        point("from"),
        point("to"),
        diagonal("stiffness", D::Stiffness, "along its axes"),
        diagonal("damping", D::Damping, "along its axes"),
        diagonal("turning_stiffness", D::TurningStiffness, "about its axes"),
        diagonal("turning_damping", D::TurningDamping, "about its axes"),
        rotation("axes", "its axes in the body of `from`"),
        rotation("rotation", "orientation of the body of `to` in that of `from` in which it exerts no torque"),
    ],
);

static MOTOR: LazyLock<FileTable> = LazyLock::new(|| {
    FileTable::new(
        "motor",
        "[[motor]]",
        "force or torque on a coordinate of a joint without a drive, constant or towards a target",
        vec![
            NAME,
            joint("the joint on which it acts, where that has no drive"),
            COORDINATE,
            signed("force", D::Force, "\"50 N\"", "constant part, on a slide").default_zero(),
            signed("torque", D::Torque, "\"2 N m\"", "constant part, on a hinge").default_zero(),
            joint_stiffness("gain on the distance from the target"),
            joint_damping("gain on the difference from the target's speed"),
            unsigned("limit", D::Force, "\"100 N\"", "largest force or torque, either way")
                .default_value(f64::INFINITY)
                .on_hinge(D::Torque, "\"10 N m\""),
            law("target", "motion that it is to follow"),
        ]
        .leak(),
    )
});

static TYRE: LazyLock<FileTable> = LazyLock::new(|| {
    FileTable::new(
        "tyre",
        "[[tyre]]",
        "tyre of a wheel on a ground that may move up and down: a spring with a damper along `up`, which only pushes",
        vec![
            NAME,
            point("on"),
            key(
                "radius",
                ValueType::Number(D::Length, (1e-6, 1e3)),
                "\"300 mm\"",
                "height of the point `on`, the wheel's centre, over the ground at which it begins to push",
            ),
            unsigned("stiffness", D::Stiffness, "\"200 kN/m\"", "change of its force with the height"),
            unsigned("damping", D::Damping, "\"200 N s/m\"", "change of its force with the rate of the height")
                .default_zero(),
            key("up", ValueType::Direction, "[0, 0, 1]", "which way is up").default_text("against the file's gravity"),
            law("ground", "height of the ground, along `up` from the world's origin; by default at rest at 0"),
        ]
        .leak(),
    )
});

static LUBRICANT: FileTable = FileTable::new(
    "lubricant",
    "[[lubricant]]",
    "lubricant between ball and socket, or pin and bearing, of a joint with play, beside its contacts",
    &[
        NAME,
        joint("the joint that it is in: spherical, revolute or cylindrical with play"),
        key(
            "viscosity",
            ValueType::Number(D::Viscosity, (0.0, 1e6)),
            "\"100 mPa s\"",
            "its dynamic viscosity: that of oils is 10 to 500 mPa s, that of water 1 mPa s",
        ),
        key(
            "thickness",
            ValueType::Number(D::Length, (1e-9, 1e-3)),
            "\"1 um\"",
            "thickness below which its film does not fall, about the roughness of both surfaces: there dry contact takes over",
        )
        .default_value(1e-6),
        key("length", ValueType::Number(D::Length, (1e-6, 1e3)), "\"20 mm\"", "length of its film along a pin; around a ball it has none")
            .default_text("`length` of the joint's `play`"),
    ],
);

/// Attachment of an element, and the section with its other keys.
pub(super) struct ElementReader<'s, 'd> {
    section: &'s Section<'d>,
    scene: &'s Scene,
    points: &'s [Attachment],
    coordinate: Option<JointCoordinate>,
}

impl ElementReader<'_, '_> {
    fn on_hinge(&self) -> bool {
        self.section.document.on_hinge
    }

    fn on(&self) -> JointCoordinate {
        self.coordinate.expect("the element's table has a joint")
    }

    /// Points of an element whose table has two.
    fn two_points(&self) -> [Attachment; 2] {
        [self.points[0], self.points[1]]
    }

    fn number(&self, name: &str) -> Result<f64, SceneError> {
        self.section.number(name)
    }

    /// The value of `force` on a slide, of `torque` on a hinge.
    fn force_or_torque(&self) -> Result<f64, SceneError> {
        let (own, other, here, there) = match self.on_hinge() {
            true => ("torque", "force", "hinge", "slide"),
            false => ("force", "torque", "slide", "hinge"),
        };
        let why = format!("the joint is a {here}, where `{own}` belongs; `{other}` is for a {there}");
        self.section.refuse(other, &why)?;
        self.section.number(own)
    }

    fn word<T: Words + Default>(&self, name: &str) -> Result<T, SceneError> {
        self.section.get(name).map_or(Ok(T::default()), |node| node.word())
    }

    fn law(&self, name: &str) -> Result<Option<Drive>, SceneError> {
        let node = self.section.get(name);
        node.map(|node| read_drive(&node, self.on_hinge())).transpose()
    }

    /// Name of the body of attachment `index` (0 or 1); `None` for the world.
    fn body(&self, index: usize) -> Option<&str> {
        let body = self.points.get(index)?.body?;
        Some(&self.scene.machine.bodies[body].name)
    }

    /// The group that the element belongs to, if any.
    fn instance(&self) -> Option<&Instance<'_>> {
        self.section.document.instance
    }

    /// Elastic law of a spring: a line, or a curve whose `axes` have these names and dimensions.
    fn elastic(&self, axes: [(&'static str, D); 2]) -> Result<Characteristic, SceneError> {
        let line = Characteristic::Line { slope: self.number("stiffness")?, offset: self.number("preload")? };
        let most = [MAX_SI, MAX_FORCE];
        let axis = |i: usize| Axis { name: axes[i].0, dimension: axes[i].1, most: most[i] };
        let rise = (1e-9, if self.on_hinge() { "1e-9 rad" } else { "1 nm" });
        let graph = Graph { axes: [axis(0), axis(1)], rise, repeats: false };
        let points = match (self.section.get("characteristic"), self.section.get("file")) {
            (Some(_), Some(node)) => {
                return Err(node.error("not allowed here: `characteristic` is given as well"));
            }
            (Some(node), None) => read_points(&node, &graph)?,
            (None, Some(node)) => read_file(&node, &graph)?,
            (None, None) => {
                self.section.refuse("interpolation", "the spring has no `characteristic`")?;
                return Ok(line);
            }
        };
        for key in ["stiffness", "preload"] {
            self.section.refuse(key, "`characteristic`, or its `file`, says what the spring exerts")?;
        }
        let given = self.section.get("interpolation").map(|node| node.word()).transpose()?;
        Ok(Characteristic::Curve { points, interpolation: given.unwrap_or(Interpolation::Monotone) })
    }

    /// Rejects an element without effect; `keys` lists the values of which one must not be 0.
    fn check_effect(&self, acts: bool, keys: &str) -> Result<(), SceneError> {
        if acts {
            return Ok(());
        }
        let kind = self.section.rows.name;
        let zero = if keys.contains(',') { "are 0; one must not be" } else { "is 0; it must not be" };
        Err(self.section.error("", format!("this {kind} does nothing: {keys} {zero}")))
    }

    /// Rejects an element for which none of `keys` is written. Each may be 0: a controller sets them while the machine runs.
    fn check_given(&self, keys: &[&str]) -> Result<(), SceneError> {
        if keys.iter().any(|key| self.section.get(key).is_some()) {
            return Ok(());
        }
        let (kind, keys) = (self.section.rows.name, keys.join(", "));
        Err(self
            .section
            .error("", format!("this {kind} does nothing: {keys} are missing; one must be given, if only as 0")))
    }

    /// An error about a key that may be absent.
    fn fault<T>(&self, name: &str, why: &str) -> Result<T, SceneError> {
        Err(match self.section.get(name) {
            Some(node) => node.error(why),
            None => self.section.error(name, why),
        })
    }

    /// Rejects a function of the scene's closed form as the law of an element.
    fn refuse_function(&self, law: Option<&Drive>, name: &str, what: &str) -> Result<(), SceneError> {
        match law {
            Some(Drive::Function(_)) => {
                self.fault(name, &format!("a {what} follows a law of its own, no function of [closed_form]"))
            }
            _ => Ok(()),
        }
    }
}

fn read_spring(reader: &ElementReader<'_, '_>) -> Result<ElementKind, SceneError> {
    let [from, to] = reader.two_points();
    let spring = Spring {
        from,
        to,
        length: reader.number("length")?,
        damping: Characteristic::linear(reader.number("damping")?),
        elastic: reader.elastic([("length", D::Length), ("tension", D::Force)])?,
        side: reader.word("side")?,
    };
    reader.check_effect(spring.damping.has_effect() || spring.elastic.has_effect(), "stiffness, damping, preload")?;
    Ok(ElementKind::Spring(spring))
}

fn read_load(reader: &ElementReader<'_, '_>) -> Result<ElementKind, SceneError> {
    let axes = reader.word("axes")?;
    let frame = match axes {
        LoadAxes::World => None,
        LoadAxes::Body => reader.body(0),
    };
    let vector = |name: &str| {
        let vector = reader.section.vector(name)?;
        Ok(reader.instance().map_or(vector, |instance| instance.direction(frame, vector)))
    };
    let factor = match reader.law("factor")? {
        Some(law) => {
            for key in ["frequency", "phase"] {
                reader.section.refuse(key, "`factor` says how the load varies")?;
            }
            Some(law)
        }
        None => {
            let [frequency, phase] = [reader.number("frequency")?, reader.number("phase")?];
            let term = Harmonic { amplitude: 1.0, frequency, phase };
            (frequency > 0.0).then(|| Drive::Harmonic { mean: 0.0, terms: vec![term] })
        }
    };
    reader.check_given(&["force", "torque"])?;
    Ok(ElementKind::Load(Load {
        on: reader.points[0],
        force: vector("force")?,
        torque: vector("torque")?,
        axes,
        factor,
    }))
}

fn read_joint_spring(reader: &ElementReader<'_, '_>) -> Result<ElementKind, SceneError> {
    let axes = match reader.on_hinge() {
        true => [("angle", D::Angle), ("torque", D::Torque)],
        false => [("position", D::Length), ("force", D::Force)],
    };
    let spring = JointSpring {
        on: reader.on(),
        position: reader.number("position")?,
        damping: Characteristic::linear(reader.number("damping")?),
        elastic: reader.elastic(axes)?,
    };
    reader.check_effect(spring.damping.has_effect() || spring.elastic.has_effect(), "stiffness, damping, preload")?;
    Ok(ElementKind::JointSpring(spring))
}

fn read_stop(reader: &ElementReader<'_, '_>) -> Result<ElementKind, SceneError> {
    let stop = Stop {
        on: reader.on(),
        lower: reader.number("lower")?,
        upper: reader.number("upper")?,
        force: reader.force_or_torque()?,
        depth: reader.number("depth")?,
        restitution: reader.number("restitution")?,
        speed: reader.number("speed")?,
    };
    let on_hinge = reader.on_hinge();
    let key = if on_hinge { "torque" } else { "force" };
    reader.check_effect(stop.force != 0.0, key)?;
    let Stop { lower, upper, .. } = stop;
    if lower == f64::NEG_INFINITY && upper == f64::INFINITY {
        return reader.fault("upper", "missing; a stop needs `lower`, `upper` or both");
    }
    if lower >= upper {
        let unit = if on_hinge { "deg" } else { "mm" };
        return reader.fault("upper", &format!("must be above lower, {}", format_quantity(lower, unit)));
    }
    if stop.restitution < 1.0 && stop.speed == 0.0 {
        let why = "missing; a restitution below 1 holds at one approach speed, which must be above 0";
        return reader.fault("speed", why);
    }
    Ok(ElementKind::Stop(stop))
}

fn read_bushing(reader: &ElementReader<'_, '_>) -> Result<ElementKind, SceneError> {
    let vector = |name: &str| reader.section.vector(name);
    let [stiffness, damping] = [vector("stiffness")?, vector("damping")?];
    let [turning_stiffness, turning_damping] = [vector("turning_stiffness")?, vector("turning_damping")?];
    let rotation = |name: &str| -> Result<Quat, SceneError> {
        let rotation = read_rotation(reader.section.get(name))?;
        Ok(reader.instance().map_or(rotation, |instance| instance.rotation(reader.body(0), rotation)))
    };
    let [from, to] = reader.two_points();
    let rest = rotation("rotation")?;
    let bushing = Bushing {
        from,
        to,
        axes: rotation("axes")?,
        rotation: reader.instance().map_or(rest, |instance| instance.rotation_of(reader.body(1), rest)),
        stiffness,
        damping,
        turning_stiffness,
        turning_damping,
    };
    let acts = [stiffness, damping, turning_stiffness, turning_damping].iter().any(|vector| *vector != Vec3::zeros());
    reader.check_effect(acts, "stiffness, damping, turning_stiffness, turning_damping")?;
    Ok(ElementKind::Bushing(bushing))
}

fn read_motor(reader: &ElementReader<'_, '_>) -> Result<ElementKind, SceneError> {
    let motor = Motor {
        on: reader.on(),
        force: reader.force_or_torque()?,
        stiffness: reader.number("stiffness")?,
        damping: reader.number("damping")?,
        limit: reader.number("limit")?,
        target: reader.law("target")?,
    };
    reader.check_given(&[if reader.on_hinge() { "torque" } else { "force" }, "stiffness", "damping"])?;
    match &motor.target {
        None if motor.stiffness > 0.0 || motor.damping > 0.0 => {
            return reader.fault("target", "missing; stiffness and damping pull towards it");
        }
        Some(_) if ["stiffness", "damping"].iter().all(|key| reader.section.get(key).is_none()) => {
            let why = "has no effect: stiffness and damping, which pull towards it, are missing; one must be given, if only as 0";
            return reader.fault("target", why);
        }
        target => reader.refuse_function(target.as_ref(), "target", "motor")?,
    }
    Ok(ElementKind::Motor(motor))
}

fn read_tyre(reader: &ElementReader<'_, '_>) -> Result<ElementKind, SceneError> {
    let up = match reader.section.get("up") {
        Some(node) => node.direction()?,
        None => up_of(reader.scene).ok_or_else(|| {
            let why =
                "missing; without gravity only the file can say which way is up: write for example `up = [0, 0, 1]`";
            reader.section.error("up", why)
        })?,
    };
    // Against gravity, it does not turn with the scene.
    let up = match (reader.section.get("up"), reader.instance()) {
        (Some(_), Some(instance)) => instance.direction(None, up),
        _ => up,
    };
    let tyre = Tyre {
        on: reader.points[0],
        radius: reader.number("radius")?,
        stiffness: reader.number("stiffness")?,
        damping: reader.number("damping")?,
        up,
        height: reader.instance().map_or(0.0, |instance| up.dot(&instance.point(None, Vec3::zeros()))),
        ground: reader.law("ground")?,
    };
    reader.check_effect(tyre.stiffness != 0.0, "stiffness")?;
    reader.refuse_function(tyre.ground.as_ref(), "ground", "ground")?;
    Ok(ElementKind::Tyre(tyre))
}

fn read_lubricant(reader: &ElementReader<'_, '_>) -> Result<ElementKind, SceneError> {
    let node = reader.section.require("joint")?;
    let name = &*node.joint()?;
    let joints = || reader.scene.machine.loose_joints.iter();
    let holds = |kind: &LooseKind| !matches!(kind, LooseKind::Slide(_));
    let found = joints().enumerate().find(|(_, joint)| joint.name == name);
    let Some((index, joint)) = found.filter(|(_, joint)| holds(&joint.kind)) else {
        let wrong = match found {
            Some(_) => "a block in its guide holds no lubricant".to_owned(),
            None => "no such joint with play".to_owned(),
        };
        let names = || joints().filter(|joint| holds(&joint.kind)).map(|joint| joint.name.as_str());
        return Err(node.error(format!(
            "{wrong}{}; {}",
            nearest(name, names()),
            allowed_joints(names(), "ball or pin with play")
        )));
    };
    let mut elements = reader.scene.machine.elements.iter();
    let is_there = |element: &&Element| matches!(element.kind, ElementKind::Lubricant(other) if other.joint == index);
    if let Some(other) = elements.find(is_there) {
        return Err(node.error(format!("lubricant {} is in this joint; allowed one in each", other.name)));
    }
    let length = reader.section.get("length").map(|_| reader.number("length")).transpose()?;
    match joint.kind {
        LooseKind::Pin(_) if joint.pin_length().or(length).is_none() => {
            return reader.fault(
                "length",
                "missing, e.g. \"20 mm\"; a pin that stays in its plane has a length of its own only with elastic = \"line\" or stiffness_at",
            );
        }
        LooseKind::Pin(_) => {}
        LooseKind::Ball | LooseKind::Slide(_) => {
            reader.section.refuse("length", "around a ball it has the size of that")?;
        }
    }
    Ok(ElementKind::Lubricant(Lubricant {
        joint: index,
        viscosity: reader.number("viscosity")?,
        thickness: reader.number("thickness")?,
        length,
    }))
}

/// Unit vector against gravity; `None` if gravity is 0.
fn up_of(scene: &Scene) -> Option<Vec3> {
    let gravity = scene.machine.gravity;
    let size = gravity.amax();
    (size > 0.0).then(|| -(gravity / size).normalize())
}

/// Reads an element of this kind; `bodies` and `joints` map names to indices in the sorted scene.
pub(super) fn read_element<'d>(
    node: &Node<'d>,
    (table, read_kind): (&'static FileTable, ReadKind),
    scene: &Scene,
    bodies: &BTreeMap<String, usize>,
    joints: &BTreeMap<String, usize>,
) -> Result<(Element, Section<'d>), SceneError> {
    let kind = table.name;
    let mut section = node.section_as(node.title(kind))?;
    let name = section.require("name")?.name()?.into_owned();
    let keys = table.keys.iter();
    let ends: Vec<&str> =
        keys.filter(|key| key.table().is_some_and(|of| of.name == ATTACHMENT.name)).map(|key| key.name).collect();
    let point = |key: &&str| read_attachment(&section, key, scene, bodies);
    let points = ends.iter().map(point).collect::<Result<Vec<_>, _>>()?;
    match points[..] {
        [first, second] if first.body == second.body => {
            let [from, to] = [ends[0], ends[1]];
            return Err(section.error(to, format!("{from} and {to} are on the same body: a {kind} needs two")));
        }
        [only] if only.body.is_none() => {
            return Err(section.error(ends[0], format!("a {kind} acts on a body, not on the world")));
        }
        _ => {}
    }
    let mut coordinate = None;
    if table.key("coordinate", None).is_some() {
        let (index, freedom) = read_coordinate(&section, scene, joints)?;
        let mut of = scene.machine.kinematic_joints().skip(index);
        let of = of.next().expect("a joint of the scene");
        let driven = of.drives().any(|(driven, _)| driven == freedom);
        if kind == MOTOR.name && driven {
            let why = format!("this joint has a drive, which leaves a {kind} nothing to move");
            return Err(section.require("joint")?.error(why));
        }
        coordinate = Some(JointCoordinate { joint: index, freedom });
        section.document.on_hinge = freedom.turns();
    }
    let reader = ElementReader { section: &section, scene, points: &points, coordinate };
    let kind = read_kind(&reader)?;
    Ok((Element { name, kind }, section))
}
