//! Sections and nested tables of a scene file, one row per key. Readers ask for a key by name; its row determines how the
//! value is read. Rows of parameters are in `table.rs`, of force elements in `elements.rs`, of drive laws in `drives.rs`.

use std::sync::LazyLock;

use super::closed_form::CLOSED_FORM;
use super::drives::DRIVE;
use super::elements::ELEMENTS;
use super::key::{FileKey, FileTable, ListLimit, ValueType, Variants, at_most, key, number, positive, vector};
use super::placement::{ATTACHMENT, ROTATION};
use super::play::{DISPLACEMENT, TABLES as PLAY};
use super::read_bodies::{Form, MAX_DENSITY, MAX_MASS};
use super::table::{contact_rows, find};
use super::*;
use jointplay_physics::simulate::Quantity;
use jointplay_physics::units::Dimension as D;
use jointplay_physics::words::Words;

/// Maximum number of user-defined parameters.
const MAX_PARAMETERS: usize = 1000;
/// Range of the initial time scale.
const TIME_SCALE_RANGE: (f64, f64) = (1e-4, 1.0);
/// Maximum number of included files.
const MAX_FILES: usize = 100;
/// Largest length of a shape, m.
const MAX_EXTENT: f64 = 1000.0;

const WORLD: &str = "the world's";
const PARENT: &str = "the parent's: the world's where there is no `parent`";
const BODY_FRAME: &str = "the body's; of a fixed shape, the world's";

/// Concatenated rows.
fn concatenated(rows: &[&[FileKey]]) -> &'static [FileKey] {
    rows.concat().leak()
}

/// The row of a parameter, as the key `name`.
fn of_parameter(name: &'static str, parameter: &'static str) -> FileKey {
    let help = find(parameter).map_or("", |parameter| parameter.help);
    key(name, ValueType::Parameter(parameter), "", help).default_text("as parameters")
}

/// Rows of the parameters in `section`.
fn parameters(section: &str) -> Vec<FileKey> {
    let own = |parameter: &'static Parameter| {
        let name = parameter.key.strip_prefix(section)?.strip_prefix('.')?;
        Some(of_parameter(name, parameter.key))
    };
    table().iter().filter_map(own).collect()
}

/// Rows of the parameters that a joint with play may override.
fn contact_keys() -> Vec<FileKey> {
    let all = parameters("contact");
    let own = |key: &FileKey| contact_rows().any(|(part, _)| part == key.name);
    all.into_iter().filter(own).collect()
}

/// Top-level table of a scene file.
pub static FILE: LazyLock<FileTable> = LazyLock::new(|| {
    let names = [
        key("name", ValueType::Name, "\"press\"", "short name, for outputs").default_text("the file's").fixed(),
        key("title", ValueType::Text, "\"A press\"", "a line, for lists").default_text("`name`").fixed(),
        key("description", ValueType::Text, "\"It jumps.\"", "a paragraph").default_text("none").fixed(),
        of_parameter("start", "start"),
        of_parameter("formulation", "formulation"),
    ];
    let sections = [
        key("gravity", ValueType::Table(&GRAVITY), "{ z = \"-9.81 m/s^2\" }", GRAVITY.help),
        key("contact", ValueType::Table(&CONTACT), "{ clearance = \"0.2 mm\" }", CONTACT.help),
        key("solver", ValueType::Table(&SOLVER), "{ method = \"automatic\" }", SOLVER.help),
        key("view", ValueType::Table(&VIEW), "{ down = \"-z\" }", VIEW.help),
        key("output", ValueType::Table(&OUTPUT), "{ body = \"rod\" }", OUTPUT.help),
    ]
    .map(|key| key.default_text("the defaults"));
    let others = [
        key(
            "closed_form",
            ValueType::Table(&CLOSED_FORM),
            "{ frequency = \"1 Hz\", functions = [{ name = \"lift\", formula = \"20 mm * sin(2*pi*t/1 s)\" }] }",
            CLOSED_FORM.help,
        ),
        key(
            "include",
            ValueType::Files(&INCLUDE, at_most(MAX_FILES, "files")),
            "[\"leg.toml\"]",
            "files beside this one, whose lists are added to the scene",
        ),
    ]
    .map(|key| key.default_text("none"));
    let place = place("the scene");
    let joints = [list_of(
        &JOINT_CONTACT,
        at_most(MAX_BALL_JOINTS, "joints with play"),
        "{ name = \"J2\", clearance = \"0.1 mm\" }",
    )];
    FileTable::new(
        "scene",
        "the file",
        "a machine, and how it is simulated and shown",
        concatenated(&[&names, &sections, &place, &others, &lists(), &joints]),
    )
});

/// Where the scene or an included file lies.
fn place(what: &str) -> [FileKey; 2] {
    let help = |text: String| -> &'static str { text.leak() };
    [
        key(
            "position",
            vector(D::Length),
            "\"0 0 100 mm\"",
            help(format!("by which {what} is shifted, after its turn; gravity is not changed")),
        )
        .default_zero()
        .frame(WORLD),
        key(
            "rotation",
            ValueType::Table(&ROTATION),
            "{ axis = [0, 0, 1], angle = \"90 deg\" }",
            help(format!("by which {what} is turned about the world's origin; gravity is not changed")),
        )
        .default_zero()
        .frame(WORLD),
    ]
}

static INCLUDE: LazyLock<FileTable> = LazyLock::new(|| {
    let own = [
        key("file", ValueType::File, "\"leg.toml\"", "the file, beside this one"),
        key("name", ValueType::Name, "\"left\"", "begins the names of its parts: `leg` becomes `left.leg`")
            .default_text("names stay as in the file"),
        key("values", ValueType::Values, "{ length = \"0.3 m\" }", "values of its parameters, by their names in it")
            .default_text("as in the file"),
    ];
    let keys = concatenated(&[&own, &place("the file")]);
    FileTable::new("include", "[[include]]", "a file whose lists are added to the scene", keys)
});

/// Top-level table of an included file.
pub(super) static INCLUDED: LazyLock<FileTable> = LazyLock::new(|| {
    let help = "lists that belong to the scene that includes it";
    FileTable::new("included", "an included file", help, lists().leak())
});

/// Lists allowed in a file.
fn lists() -> Vec<FileKey> {
    let own = [
        list_of(&PARAMETER, at_most(MAX_PARAMETERS, "parameters"), "{ name = \"stroke\", value = \"20 mm\" }"),
        list_of(&PATTERN, at_most(MAX_BODIES, "patterns"), "{ name = \"leg\", count = 6, along = \"100 0 0 mm\" }"),
    ];
    own.into_iter().chain(parts()).collect()
}

/// Lists allowed in a file and in a pattern.
fn parts() -> Vec<FileKey> {
    let parts = [
        list_of(
            &BODY,
            at_most(MAX_BODIES, "bodies"),
            "{ name = \"rod\", mass = \"0.384 kg\", inertia = \"1.92e-3 1.92e-3 1.58e-5 kg m^2\" }",
        ),
        list_of(
            &JOINT,
            at_most(MAX_BODIES, "joints"),
            "{ name = \"crank\", kind = \"revolute\", child = \"rod\", axis = [0, 1, 0] }",
        ),
        list_of(
            &BALL_JOINT,
            at_most(MAX_BALL_JOINTS, "ball joints"),
            "{ name = \"S1\", socket = { body = \"world\" }, ball = { body = \"rod\" } }",
        ),
        list_of(
            &FIXED_SHAPE,
            at_most(MAX_SHAPES, "shapes"),
            "{ form = \"sphere\", role = \"frame\", centre = \"0 0 0 mm\", radius = \"4 mm\" }",
        ),
    ];
    let element = |table| list_of(table, at_most(MAX_ELEMENTS, "force elements"), "");
    let elements = ELEMENTS.iter().map(|(table, _)| element(*table));
    parts.into_iter().chain(elements).collect()
}

/// A list of tables under the table's name; `like` is an example of an entry, or empty.
fn list_of(table: &'static FileTable, limit: ListLimit, example: &'static str) -> FileKey {
    let example = match example {
        "" => "",
        example => format!("[{example}]").leak(),
    };
    key(table.name, ValueType::List(table, limit), example, table.help).default_text("none")
}

static GRAVITY: LazyLock<FileTable> = LazyLock::new(|| {
    let help = "gravity; if one component is given, the others are 0 by default";
    FileTable::new("gravity", "[gravity]", help, parameters("gravity").leak())
});

static CONTACT: LazyLock<FileTable> = LazyLock::new(|| {
    let help = "play, material and friction of every joint with play without values of its own";
    FileTable::new("contact", "[contact]", help, parameters("contact").leak())
});

static SOLVER: LazyLock<FileTable> = LazyLock::new(|| {
    let help = "how the equations are solved";
    FileTable::new("solver", "[solver]", help, parameters("solver").leak())
});

static VIEW: LazyLock<FileTable> = LazyLock::new(|| {
    let own = [
        key("floor", number(D::Length), "\"340 mm\"", "where the floor lies along `down`")
            .default_text("chosen by the view"),
        key("yaw", number(D::Angle), "\"-35 deg\"", "azimuth of the isometric view, with `pitch`")
            .default_text("that of the default view"),
        key("pitch", number(D::Angle), "\"12 deg\"", "elevation of the isometric view, with `yaw`")
            .default_text("that of the default view"),
        key(
            "time_scale",
            ValueType::Number(D::None, TIME_SCALE_RANGE),
            "0.05",
            "simulated seconds per second that a window begins with",
        )
        .default_text("a period of the drives takes about 4 s; without drives 0.1")
        .fixed(),
        key(
            "plots",
            ValueType::Words(Quantity::WORDS, at_most(MAX_PLOTS, "plots")),
            "[\"normal-force\", \"acceleration\"]",
            "plots that a window begins with",
        )
        .default_text("normal force and eccentricity")
        .fixed(),
        key(
            "watch",
            ValueType::Text,
            "\"Which ball strikes first?\"",
            "a sentence that a window begins with: what to watch",
        )
        .default_text("none")
        .fixed(),
    ];
    let keys = concatenated(&[&parameters("view"), &own]);
    FileTable::new("view", "[view]", "how the machine is viewed", keys)
});

static OUTPUT: FileTable = FileTable::new(
    "output",
    "[output]",
    "output quantities",
    &[
        key("body", ValueType::Body, "\"rod\"", "body whose pose is reported").default_text("the last one").fixed(),
        key("probe", vector(D::Length), "\"60 0 0 mm\"", "a point of that body, reported as well")
            .default_text("none")
            .frame("the body's"),
    ],
);

static JOINT_CONTACT: LazyLock<FileTable> = LazyLock::new(|| {
    let name = [key("name", ValueType::Joint, "\"J2\"", "which one")];
    FileTable::new(
        "joint_contact",
        "[[joint_contact]]",
        "contact parameters of one joint with play, such as one copy of a pattern",
        concatenated(&[&name, &contact_keys()]),
    )
    .also(&CONTACT)
});

static BODY: LazyLock<FileTable> = LazyLock::new(|| {
    let keys = [
        key("name", ValueType::Name, "\"rod\"", "its name, not `world`"),
        key(
            "mass",
            ValueType::Number(D::Mass, (0.0, MAX_MASS)),
            "\"0.384 kg\"",
            "its mass; 0 for a body that only connects two joints, whose inertia is then 0, too",
        )
        .unless("density"),
        key("centre", vector(D::Length), "\"14 0 0 mm\"", "its centroid").default_zero().frame("the body's"),
        key(
            "inertia",
            vector(D::Inertia),
            "\"1.58e-5 1.92e-3 1.93e-3 kg m^2\"",
            "Ixx, Iyy and Izz about the centroid, along these axes",
        )
        .unless("density")
        .frame("the body's"),
        key(
            "products",
            vector(D::Inertia),
            "\"0 1e-5 0 kg m^2\"",
            "integrals of xy, xz and yz over the mass, about the centroid",
        )
        .default_zero()
        .frame("the body's"),
        key(
            "shapes",
            ValueType::List(&SHAPE, at_most(MAX_SHAPES, "shapes")),
            "[{ form = \"sphere\", role = \"pin\", centre = \"0 0 0 mm\", radius = \"4 mm\" }]",
            "what it looks like",
        )
        .default_text("none"),
        key(
            "density",
            positive(D::Density, MAX_DENSITY),
            "\"7.85 g/cm^3\"",
            "density of its shapes, which then determine mass, centroid and inertia; overlapping volumes count twice; \
             `check` prints the result",
        )
        .default_text("`mass` and `inertia` are given"),
    ];
    FileTable::new("body", "[[body]]", "a rigid body", concatenated(&[&keys]))
});

static SHAPE: LazyLock<FileTable> = LazyLock::new(|| {
    let help = "a shape of a body: what it looks like, and weighs where the body has a `density`";
    of_shape("shape", "a shape", help)
});

static FIXED_SHAPE: LazyLock<FileTable> =
    LazyLock::new(|| of_shape("fixed_shape", "[[fixed_shape]]", "a shape that stands still").also(&SHAPE));

fn of_shape(name: &'static str, head: &'static str, help: &'static str) -> FileTable {
    const LONG: &[&str] = &["capsule", "cylinder", "cone"];
    let point = |name, of, help| {
        let value_type = vector(D::Length);
        let row = key(name, value_type, "\"0 0 10 mm\"", help);
        row.of(of).frame(BODY_FRAME)
    };
    let length = |name, of, help| {
        let value_type = positive(D::Length, MAX_EXTENT);
        key(name, value_type, "\"4 mm\"", help).of(of)
    };
    let own = [
        key("form", ValueType::Word(Form::WORDS), "\"capsule\"", "form"),
        key("role", ValueType::Word(Role::WORDS), "\"frame\"", "function of the part, which sets its colour")
            .default_text("the role of its body"),
        key("colour", ValueType::Text, "\"#c2255c\"", "red, green and blue in place of the role's colour")
            .default_text("the role's"),
        point("from", LONG, "one end of the axis; of a cone, its base"),
        point("to", LONG, "the other end; of a cone, its tip"),
        point("centre", &["box", "sphere"], "its middle"),
        length("radius", &["capsule", "cylinder", "cone", "sphere"], "radius; of a cone, that of its base"),
        key("size", vector(D::Length), "\"10 20 30 mm\"", "edge lengths along x, y and z").of(&["box"]),
        key(
            "corners",
            ValueType::Vectors(D::Length, at_most(MAX_CORNERS, "corners")),
            "[\"0 0 0 mm\", \"10 0 0 mm\", \"0 10 0 mm\"]",
            "corners of a polygon in one plane, in its order",
        )
        .of(&["plate"])
        .frame(BODY_FRAME),
        length("thickness", &["plate"], "half to each side of the corners"),
        key("file", ValueType::File, "\"arm.stl\"", "its triangles: STL, OBJ or glTF, beside the scene").of(&["mesh"]),
        key(
            "unit",
            positive(D::Length, MAX_EXTENT),
            "\"1 mm\"",
            "length of the file's unit, or that unit alone, `\"mm\"`",
        )
        .of(&["mesh"])
        .default_text("1 m for glTF; required for STL and OBJ"),
        point("position", &["mesh"], "where the file's frame lies").default_zero(),
        key(
            "rotation",
            ValueType::Table(&ROTATION),
            "{ axis = [1, 0, 0], angle = \"90 deg\" }",
            "orientation of the file's frame",
        )
        .of(&["mesh"])
        .default_zero()
        .frame(BODY_FRAME),
    ];
    FileTable::new(name, head, help, own.to_vec().leak()).by(Variants::Word("form", "{}"))
}

static JOINT: LazyLock<FileTable> = LazyLock::new(|| {
    const MOVES: &[&str] = &["prismatic", "revolute"];
    const TURNS: &[&str] = &["prismatic", "revolute", "cylindrical", "universal"];
    const PLACED: &[&str] = &["fixed", "prismatic", "revolute", "cylindrical", "universal", "spherical"];
    const LOOSE: &[&str] = &["prismatic", "revolute", "cylindrical", "spherical"];
    let own = [
        key("name", ValueType::Name, "\"P1\"", "its name, different from those of force elements"),
        key(
            "kind",
            ValueType::Word(JOINT_KINDS),
            "\"revolute\"",
            "how it moves, in this order: not at all, along `axis`, about `axis`, in every way, along and about \
             `axis`, about two axes, about its point in every way",
        ),
        key("parent", ValueType::Body, "\"world\"", "the body that carries it").default_text("the world"),
        key("child", ValueType::Body, "\"rod\"", "the body that it carries; each body is carried by exactly one joint"),
        key(
            "axis",
            ValueType::Direction,
            "[0, 0, 1]",
            "along which it slides or about which it turns, by the right-hand rule",
        )
        .of(TURNS)
        .frame(PARENT),
        key(
            "child_axis",
            ValueType::Direction,
            "[0, 1, 0]",
            "its second axis, perpendicular to `axis` where both angles are 0",
        )
        .of(&["universal"])
        .frame("the child's"),
        key("parent_point", vector(D::Length), "\"0 0 100 mm\"", "where it is on the parent")
            .of(PLACED)
            .default_zero()
            .frame(PARENT),
        key("child_point", vector(D::Length), "\"0 0 -100 mm\"", "where it is on the child")
            .default_zero()
            .frame("the child's"),
        key(
            "rotation",
            ValueType::Table(&ROTATION),
            "{ axis = [0, 1, 0], angle = \"90 deg\" }",
            "orientation of the child where the joint's coordinate is 0",
        )
        .of(PLACED)
        .default_zero()
        .frame(PARENT),
        key(
            "drive",
            ValueType::Table(&DRIVE),
            "{ law = \"harmonic\", amplitude = \"10 mm\", frequency = \"1 Hz\" }",
            "prescribed motion",
        )
        .of(MOVES)
        .default_text("none: it moves freely"),
        key(
            "drive",
            ValueType::Table(&CYLINDRICAL_DRIVE),
            "{ angle = { law = \"constant\", velocity = \"6 rad/s\" } }",
            "prescribed motions",
        )
        .of(&["cylindrical"])
        .default_text("none: it moves freely"),
        key(
            "drive",
            ValueType::Table(&UNIVERSAL_DRIVE),
            "{ angle = { law = \"constant\", velocity = \"6 rad/s\" } }",
            "prescribed motions",
        )
        .of(&["universal"])
        .default_text("none: it moves freely"),
        key(
            "start",
            ValueType::Table(&START),
            "{ position = \"10 mm\" }",
            "initial coordinate and rate; not with a drive",
        )
        .of(MOVES)
        .default_text("0, at rest")
        .on_hinge(D::Angle, "{ position = \"10 deg\" }"),
        key(
            "start",
            ValueType::Table(&FREE_START),
            "{ position = \"0 0 100 mm\" }",
            "where the child starts, and how it moves",
        )
        .of(&["free"]),
        key(
            "start",
            ValueType::Table(&CYLINDRICAL_START),
            "{ position = \"10 mm\", angle = \"30 deg\" }",
            "initial coordinates and rates, except driven ones",
        )
        .of(&["cylindrical"])
        .default_text("0, at rest"),
        key(
            "start",
            ValueType::Table(&UNIVERSAL_START),
            "{ angle = \"10 deg\", child_angle = \"30 deg\" }",
            "initial coordinates and rates, except driven ones",
        )
        .of(&["universal"])
        .default_text("0, at rest"),
        key("start", ValueType::Table(&SPHERICAL_START), "{ tilt = \"0 10 0 deg\" }", "where the child starts")
            .of(&["spherical"])
            .default_text("0, at rest"),
        opening().of(&["spherical"]),
        key(
            "drawn",
            ValueType::Flag,
            "false",
            "whether a pin, a rail or a cross is drawn for it, where the scene's shapes show none",
        )
        .of(TURNS)
        .default_text("true"),
        key(
            "closes_loop",
            ValueType::Flag,
            "true",
            "whether its child is carried by another joint, so that this joint closes a loop; it then has neither \
             `drive` nor `start`",
        )
        .default_text("false"),
    ];
    let play = PLAY.iter().map(|(kind, table)| {
        let example = match *kind {
            "prismatic" => "{ y = \"0.1 mm\", half_length = \"25 mm\", half_y = \"20 mm\", planar = true }",
            "spherical" => "{ radial = \"0.1 mm\", radius = \"10 mm\" }",
            _ => "{ radial = \"0.1 mm\", length = \"24 mm\", radius = \"10 mm\" }",
        };
        key("play", ValueType::Table(table), example, table.help)
            .of(std::slice::from_ref(kind))
            .default_text("none: it is ideal")
    });
    let contact = contact_keys().into_iter().filter(|key| !["clearance", "ball_radius"].contains(&key.name));
    let contact = contact.map(|key| key.of(LOOSE));
    let keys: Vec<FileKey> = own.into_iter().chain(play).chain(contact).collect();
    FileTable::new("joint", "[[joint]]", "a joint that carries a body", keys.leak())
        .by(Variants::Word("kind", "{} joint"))
});

/// Kinds of `[[joint]]`: those of tree joints, and the ball joint, which is always cut.
const JOINT_KINDS: &[&str] = &["fixed", "prismatic", "revolute", "free", "cylindrical", "universal", "spherical"];

static START: LazyLock<FileTable> = LazyLock::new(|| {
    let own = [
        key("position", number(D::Length), "\"10 mm\"", "its coordinate")
            .on_hinge(D::Angle, "\"10 deg\"")
            .default_zero(),
        key("velocity", number(D::Speed), "\"10 mm/s\"", "its rate")
            .on_hinge(D::AngularSpeed, "\"6 rad/s\"")
            .default_zero(),
    ];
    let help = "where it starts; with play, also how far off its place without play";
    FileTable::new("start", "`start` of a slide or a hinge", help, concatenated(&[&own, &DISPLACEMENT]))
});

static SPHERICAL_START: FileTable =
    FileTable::new("spherical_start", "start of a spherical joint", "where the ball starts", &DISPLACEMENT);

static CYLINDRICAL_START: LazyLock<FileTable> = LazyLock::new(|| {
    let own = [
        key("position", number(D::Length), "\"10 mm\"", "along it").default_zero(),
        key("angle", number(D::Angle), "\"30 deg\"", "about it").default_zero(),
        key("velocity", number(D::Speed), "\"10 mm/s\"", "along it").default_zero(),
        key("angular_velocity", number(D::AngularSpeed), "\"6 rad/s\"", "about it").default_zero(),
    ];
    let help = "where it starts, along its axis and about it; with play, also how far off its place without play";
    let keys = concatenated(&[&own, &DISPLACEMENT]);
    FileTable::new("cylindrical_start", "start of a cylindrical joint", help, keys)
});

/// Row of the drive of one of two coordinates.
fn motion(freedom: Freedom, example: &'static str, help: &'static str) -> FileKey {
    key(freedom.word(), ValueType::Table(&DRIVE), example, help).default_text("none: it moves freely")
}

const TURNING: &str = "{ law = \"constant\", velocity = \"6 rad/s\" }";

static CYLINDRICAL_DRIVE: LazyLock<FileTable> = LazyLock::new(|| {
    let sliding = "{ law = \"harmonic\", amplitude = \"10 mm\", frequency = \"1 Hz\" }";
    let keys = [
        motion(Freedom::Slide, sliding, "its motion along it"),
        motion(Freedom::TurnOfSlide, TURNING, "its motion about it"),
    ];
    FileTable::new(
        "cylindrical_drive",
        "`drive` of a cylindrical joint",
        "motions along its axis and about it, one or both",
        keys.to_vec().leak(),
    )
});

static UNIVERSAL_DRIVE: LazyLock<FileTable> = LazyLock::new(|| {
    let keys = [
        motion(Freedom::FirstTurn, TURNING, "its motion about `axis`"),
        motion(Freedom::SecondTurn, TURNING, "its motion about `child_axis`"),
    ];
    FileTable::new(
        "universal_drive",
        "`drive` of a universal joint",
        "motions about its axes, one or both",
        keys.to_vec().leak(),
    )
});

static UNIVERSAL_START: FileTable = FileTable::new(
    "universal_start",
    "start of a universal joint",
    "where it starts, about its axes",
    &[
        key("angle", number(D::Angle), "\"10 deg\"", "about `axis`").default_zero(),
        key("child_angle", number(D::Angle), "\"30 deg\"", "about `child_axis`").default_zero(),
        key("angular_velocity", number(D::AngularSpeed), "\"6 rad/s\"", "about `axis`").default_zero(),
        key("child_angular_velocity", number(D::AngularSpeed), "\"6 rad/s\"", "about `child_axis`").default_zero(),
    ],
);

static FREE_START: FileTable = FileTable::new(
    "free_start",
    "`start` of a free joint",
    "where a free body starts",
    &[
        key("position", vector(D::Length), "\"0 0 100 mm\"", "where `child_point` is").frame(WORLD),
        key(
            "rotation",
            ValueType::Table(&ROTATION),
            "{ axis = [0, 1, 0], angle = \"15 deg\" }",
            "orientation of the child",
        )
        .default_zero()
        .frame(WORLD),
        key("velocity", vector(D::Speed), "\"1 0 0 m/s\"", "velocity of `child_point`").default_zero().frame(WORLD),
        key("angular_velocity", vector(D::AngularSpeed), "\"0 0 6 rad/s\"", "angular velocity of the child")
            .default_zero()
            .frame(WORLD),
    ],
);

/// Row of the side on which a socket is drawn open.
fn opening() -> FileKey {
    let help = "side on which the socket is drawn open; no effect on the motion";
    key("opening", ValueType::Direction, "[0, 0, 1]", help)
        .default_text("`view.down`")
        .frame("that of the socket's body")
}

static BALL_JOINT: LazyLock<FileTable> = LazyLock::new(|| {
    let end = |name, help| {
        let example = "{ body = \"rod\", at = \"0 0 100 mm\" }";
        key(name, ValueType::Table(&ATTACHMENT), example, help)
    };
    let own = [
        key("name", ValueType::Name, "\"S1\"", "its name, different from those of other joints"),
        end("socket", "the socket's centre"),
        end("ball", "the ball's centre, on another body"),
        opening(),
    ];
    FileTable::new(
        "ball_joint",
        "[[ball_joint]]",
        "a ball joint, which closes a loop: with play, or ideal where its `clearance` is 0",
        concatenated(&[&own, &contact_keys()]),
    )
    .also(&CONTACT)
});

static PARAMETER: FileTable = FileTable::new(
    "parameter",
    "[[parameter]]",
    "a parameter of the scene's own, for expressions, sliders and `--set`",
    &[
        key(
            "name",
            ValueType::Name,
            "\"stroke\"",
            "its name in expressions: letters, digits and `_`, a letter first; not `i`, `pi`, `e`, `t` or a unit",
        ),
        key("value", ValueType::Quantity, "\"20 mm\"", "its value"),
        key("label", ValueType::Text, "\"Stroke\"", "its name in the window").default_text("`name`"),
        key("unit", ValueType::Text, "\"mm\"", "unit in which it is shown")
            .default_text("that of `value`; required where that is an expression"),
        key("range", ValueType::Range, "[\"10 mm\", \"40 mm\"]", "least and greatest value").default_text("any value"),
        key("slider", ValueType::Range, "[\"15 mm\", \"30 mm\"]", "ends of its slider").default_text("`range`"),
        key("whole", ValueType::Flag, "true", "whether it is a whole number").default_text("false"),
        key("key", ValueType::Text, "\"chain.links\"", "its key for `--set`").default_text("`parameter.` and its name"),
        key("help", ValueType::Text, "\"How far it goes.\"", "what it is").default_text("none"),
        key("group", ValueType::Text, "\"Drive\"", "heading under which the window folds it away")
            .default_text("shown first"),
        key("equation", ValueType::Text, "\"Sheng & Chen (2024), eq. 59\"", "the equation that it enters")
            .default_text("none"),
    ],
);

static PATTERN: LazyLock<FileTable> = LazyLock::new(|| {
    let own = [
        key("name", ValueType::Name, "\"leg\"", "its name"),
        key("count", ValueType::Whole(1, MAX_BODIES as u32), "6", "number of copies"),
        key(
            "about",
            ValueType::Table(&ABOUT),
            "{ axis = [0, 0, 1] }",
            "the axis about which each copy is turned from the one before",
        )
        .unless("along"),
        key("along", vector(D::Length), "\"100 0 0 mm\"", "shift from one copy to the next")
            .unless("about")
            .frame(WORLD),
    ];
    let keys = concatenated(&[&own, &parts()]);
    FileTable::new("pattern", "[[pattern]]", "a group that is repeated", keys)
});

static ABOUT: FileTable = FileTable::new(
    "about",
    "`about` of a pattern",
    "about which copies are turned",
    &[
        key("point", vector(D::Length), "\"0 0 100 mm\"", "a point on it").default_zero().frame(WORLD),
        key("axis", ValueType::Direction, "[0, 0, 1]", "its direction").frame(WORLD),
        key("angle", number(D::Angle), "\"60 deg\"", "from copy to copy").default_text("a turn over `count`"),
    ],
);

/// All tables of a scene file: the top level, then the nested tables, each once, after the table that first refers to it.
pub fn file_tables() -> Vec<&'static FileTable> {
    fn add(table: &'static FileTable, all: &mut Vec<&'static FileTable>) {
        if all.iter().all(|other| other.name != table.name) {
            all.push(table);
            for inner in table.keys.iter().filter_map(FileKey::table) {
                add(inner, all);
            }
        }
    }
    let mut all = Vec::new();
    add(&FILE, &mut all);
    all
}
