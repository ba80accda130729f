//! Motions in closed form: functions of time by name, which drives follow, and the path of the output body.

use super::document::{Node, Section};
use super::formula::error_within;
use super::key::{FileKey, FileTable, ValueType, at_most, key};
use super::*;
use jointplay_physics::expression::Program;
use jointplay_physics::machine::{ClosedForm, Function, Path};
use jointplay_physics::suggest::nearest;
use std::sync::LazyLock;

/// Maximum number of functions.
const MAX_FUNCTIONS: usize = 100;
/// Maximum number of turns.
const MAX_TURNS: usize = 6;
/// Maximum number of repetitions per second, Hz.
const MAX_FREQUENCY: f64 = 1e4;

static FUNCTION: FileTable = FileTable::new(
    "function",
    "a function",
    "a function of time",
    &[
        key("name", ValueType::Text, "\"f1\"", "its name, for drives and for the functions after it").fixed(),
        key(
            "formula",
            ValueType::Text,
            "\"stroke * sin(2*pi*f*t)\"",
            "an expression of `t`, parameters and earlier functions",
        )
        .fixed(),
        key(
            "positive",
            ValueType::Text,
            "\"rod 1 is too short\"",
            "if its value must be above 0: what is wrong where it is not",
        )
        .default_text("any value is allowed")
        .fixed(),
    ],
);

static TURN: FileTable = FileTable::new(
    "turn",
    "a turn",
    "a turn of the output body, in the axes that the turns before have reached",
    &[
        key("axis", ValueType::Direction, "[0, 0, 1]", "its axis").fixed(),
        key("angle", ValueType::Text, "\"beta\"", "its angle, an expression of `t` and functions").fixed(),
    ],
);

/// The section `[closed_form]`.
pub(super) static CLOSED_FORM: LazyLock<FileTable> = LazyLock::new(|| {
    let own = [
        key(
            "frequency",
            ValueType::Number(Dimension::Frequency, (0.0, MAX_FREQUENCY)),
            "\"0.5 Hz\"",
            "how often the motion repeats; 0 if nothing moves",
        )
        .fixed(),
        key(
            "functions",
            ValueType::List(&FUNCTION, at_most(MAX_FUNCTIONS, "functions")),
            "[{ name = \"lift\", formula = \"20 mm * sin(2*pi*t/2 s)\" }]",
            "the functions, which drives follow by `law = \"function\"`",
        ),
    ];
    let place = |name, axis: &str| -> FileKey {
        let help =
            format!("{axis} of the output body's frame where no joint has play, an expression of `t` and functions");
        key(name, ValueType::Text, "\"lift\"", help.leak())
            .default_text("not known; then a motion without play runs alongside")
            .fixed()
    };
    let turns = key(
        "turns",
        ValueType::List(&TURN, at_most(MAX_TURNS, "turns")),
        "[{ axis = [0, 0, 1], angle = \"beta\" }]",
        "how the output body is turned there",
    )
    .default_text("not turned");
    let keys = own.into_iter().chain([place("x", "x"), place("y", "y"), place("z", "z"), turns]).collect::<Vec<_>>();
    FileTable::new(
        "closed_form",
        "[closed_form]",
        "functions of time that drives follow, such as the inverse kinematics of a platform, and the resulting motion of the output body",
        keys.leak(),
    )
});

/// Reads `[closed_form]`.
///
/// # Errors
/// An invalid or repeated name, an invalid formula, or only a part of the position.
pub(super) fn read_closed_form(section: &Section<'_>) -> Result<ClosedForm, SceneError> {
    let mut functions: Vec<Function> = Vec::new();
    for node in section.require("functions")?.entries()? {
        let entry = node.section()?;
        let name_node = entry.require("name")?;
        let name = name_node.identifier("a function")?;
        let reading = section.document.reading;
        if reading.is_defined(name) {
            return Err(name_node.error("there is already a parameter or a function of this name; names must differ"));
        }
        let formula = entry.require("formula")?;
        let (program, value) = reading
            .function(formula.text()?)
            .map_err(|error| error_within(&formula, formula.text().unwrap_or(""), error.at(), &error.to_string()))?;
        reading.add_function(name, value);
        let positive = entry.get("positive").map(|node| node.text()).transpose()?;
        let positive = positive.map(str::to_owned);
        functions.push(Function { name: name.to_owned(), program, unit: value.unit(), positive });
    }
    Ok(ClosedForm { frequency: section.number("frequency")?, pace: 1.0, functions, path: read_path(section)? })
}

/// Reads the path of the output body, if it is given.
fn read_path(section: &Section<'_>) -> Result<Option<Path>, SceneError> {
    const AXES: [&str; 3] = ["x", "y", "z"];
    if AXES.iter().all(|name| section.get(name).is_none()) {
        section.refuse("turns", "without x, y and z there is no path")?;
        return Ok(None);
    }
    let [x, y, z] = AXES.map(|name| read_value(&section.require(name)?, Dimension::Length));
    let turns = section.get("turns").map_or(Ok(Vec::new()), |node| node.entries())?;
    let turns = turns.iter().map(|node| {
        let turn = node.section()?;
        Ok((turn.require("axis")?.direction()?, read_value(&turn.require("angle")?, Dimension::Angle)?))
    });
    Ok(Some(Path { position: [x?, y?, z?], turns: turns.collect::<Result<_, SceneError>>()?, place: None }))
}

/// Reads an expression of time and functions with this dimension, or a pure number in SI units.
fn read_value(node: &Node<'_>, dimension: Dimension) -> Result<Program, SceneError> {
    let text = node.text()?;
    let (program, value) = node
        .document
        .reading
        .function(text)
        .map_err(|error| error_within(node, text, error.at(), &error.to_string()))?;
    check_dimension(value, dimension).map_err(|error| node.error(error.to_string()))?;
    Ok(program)
}

/// Index of the function that the drive `section` follows, as a coordinate of this dimension.
///
/// # Errors
/// No such function, or one of another dimension.
pub(super) fn read_function_index(section: &Section<'_>, dimension: Dimension) -> Result<usize, SceneError> {
    let node = section.require("function")?;
    let name = node.text()?;
    let known = section.document.reading.functions();
    let Some(found) = known.iter().position(|(own, _)| own == name) else {
        let names = known.iter().map(|(own, _)| own.as_str());
        let allowed = match known.is_empty() {
            true => "the file has no [closed_form]".to_owned(),
            false => format!("allowed {}", names.clone().collect::<Vec<_>>().join(", ")),
        };
        return Err(node.error(format!("no such function{}; {allowed}", nearest(name, names))));
    };
    check_dimension(known[found].1, dimension).map_err(|error| node.error(error.to_string()))?;
    Ok(found)
}

/// Whether a value of functions is a pure number, or has this dimension.
fn check_dimension(value: Quantity, dimension: Dimension) -> Result<(), DimensionError> {
    if value.is_pure() { Ok(()) } else { value.has(dimension, false) }
}
