//! Drive laws: one row per law, and the reader of `drive` and of the factor of a load, which follows the same laws. The motion is
//! computed in `mechanism/drives`.

use super::closed_form::read_function_index;
use super::document::{Node, Section};
use super::formula::read_formula;
use super::key::{FileKey, FileTable, MAX_SI, ValueType, Variants, at_most, key, number, positive};
use super::points::{Graph, MAX_POINTS, SHORTEST_PART, read_file, read_points};
use super::*;
use jointplay_physics::interpolate::Interpolation;
use jointplay_physics::words::Words;
use std::sync::LazyLock;

/// Maximum frequency of a harmonic drive, Hz.
pub(super) const MAX_DRIVE_FREQUENCY: f64 = 1e4;
/// Word of the law that follows a function of the machine's closed form.
const FUNCTION: &str = "function";
/// Maximum number of terms in a sum of harmonics.
const MAX_TERMS: usize = 100;

const fn position_key(name: &'static str, help: &'static str) -> FileKey {
    key(name, number(Dimension::Length), "\"10 mm\"", help).on_hinge(Dimension::Angle, "\"10 deg\"")
}

const MEAN: FileKey = position_key("mean", "mean").default_zero();

/// Amplitude, frequency and phase of a harmonic.
const TERM: [FileKey; 3] = [
    position_key("amplitude", "amplitude"),
    key("frequency", positive(Dimension::Frequency, MAX_DRIVE_FREQUENCY), "\"1 Hz\"", "frequency"),
    key("phase", number(Dimension::Angle), "\"90 deg\"", "phase at t = 0").default_zero(),
];

static TERMS: FileTable = FileTable::new("term", "a term", "a harmonic of a sum", &TERM);

const START: FileKey = key("start", number(Dimension::Time), "\"1 s\"", "when it begins").default_zero();

const DURATION: FileKey =
    key("duration", ValueType::Number(Dimension::Time, (SHORTEST_PART, MAX_SI)), "\"0.5 s\"", "how long it lasts");

const INTERPOLATION: FileKey = key(
    "interpolation",
    ValueType::Word(&[Interpolation::Spline.word(), Interpolation::Monotone.word()]),
    "\"monotone\"",
    "`spline` for samples of a smooth motion; `monotone` turns only where the points do, and its acceleration jumps there; \
     straight lines are refused, because the rate of a drive must not jump",
)
.default_text(Interpolation::Spline.word());

/// A drive law of the scene file.
#[derive(Debug)]
pub struct DriveLaw {
    /// Its word in the file: `law = "harmonic"`.
    pub word: &'static str,
    /// Help text.
    pub help: &'static str,
    /// Keys of the law.
    pub keys: &'static [FileKey],
}

/// All drive laws. On a hinge, lengths become angles, and speeds angular speeds.
pub static DRIVE_LAWS: [DriveLaw; 8] = [
    DriveLaw {
        word: FUNCTION,
        help: "a function of `[closed_form]`",
        keys: &[key("function", ValueType::Text, "\"lift\"", "its name")],
    },
    DriveLaw {
        word: "constant",
        help: "position + velocity t",
        keys: &[
            position_key("position", "where it is at t = 0").default_zero(),
            key("velocity", number(Dimension::Speed), "\"10 mm/s\"", "its rate")
                .on_hinge(Dimension::AngularSpeed, "\"6 rad/s\""),
        ],
    },
    DriveLaw {
        word: "harmonic",
        help: "mean + amplitude sin(2π frequency t + phase)",
        keys: &[MEAN, TERM[0], TERM[1], TERM[2]],
    },
    DriveLaw {
        word: "harmonics",
        help: "mean + a sum of harmonics",
        keys: &[
            MEAN,
            key(
                "terms",
                ValueType::List(&TERMS, at_most(MAX_TERMS, "terms")),
                "[{ amplitude = \"10 mm\", frequency = \"1 Hz\" }]",
                "the harmonics",
            )
            .on_hinge(Dimension::Angle, "[{ amplitude = \"10 deg\", frequency = \"1 Hz\" }]"),
        ],
    },
    DriveLaw {
        word: "ramp",
        help: "from one position to another: with s from 0 to 1 over the duration, from + (to - from) (10 s³ - 15 s⁴ + 6 s⁵), \
               whose rate and acceleration are 0 at both ends",
        keys: &[
            position_key("from", "value before the ramp").default_zero(),
            position_key("to", "where it is afterwards"),
            START,
            DURATION,
        ],
    },
    DriveLaw {
        word: "pulse",
        help: "one bump: with s from 0 to 1 over the duration, base + height sin³(π s)",
        keys: &[
            position_key("base", "value before and after the pulse").default_zero(),
            position_key("height", "height of the bump above it"),
            START,
            DURATION,
        ],
    },
    DriveLaw {
        word: "table",
        help: "function through points, by default a cubic spline",
        keys: &[
            key(
                "points",
                ValueType::Pairs([Dimension::Time, Dimension::Length], at_most(MAX_POINTS, "points")),
                "[[\"0 s\", \"0 mm\"], [\"1 s\", \"10 mm\"]]",
                "time and position, in the order of time, at least two",
            )
            .on_hinge(Dimension::Angle, "[[\"0 s\", \"0 deg\"], [\"1 s\", \"10 deg\"]]")
            .unless("file"),
            key(
                "file",
                ValueType::File,
                "\"bump.csv\"",
                "the points: two columns under a header with units, `time_s,position_mm`",
            )
            .unless("points"),
            INTERPOLATION,
            key("repeat", ValueType::Flag, "true", "whether the points are one period of the motion")
                .default_text("false"),
        ],
    },
    DriveLaw {
        word: "formula",
        help: "an expression of the time t in s, see below",
        keys: &[
            key("formula", ValueType::Text, "\"0.01 * sin(2*pi*t)\"", "an expression of `t`"),
            key("unit", ValueType::Text, "\"mm\"", "unit of its value").default_text("`m`, `rad` on a hinge"),
            key(
                "resolve",
                ValueType::Number(Dimension::Time, (SHORTEST_PART, 1.0)),
                "\"1 ms\"",
                "longest step of an adaptive method; a fifth of the shortest feature of the formula is suitable",
            )
            .default_value(1e-3),
        ],
    },
];

/// Table of `drive`: its law, and the keys of each law.
pub(super) static DRIVE: LazyLock<FileTable> = LazyLock::new(|| {
    let words: &[&str] = DRIVE_LAWS.each_ref().map(|kind| kind.word).to_vec().leak();
    let law = key("law", ValueType::Word(words), "\"constant\"", "law of motion");
    let keys_of_law = |(index, law): (usize, &'static DriveLaw)| {
        let keys = law.keys.iter();
        keys.map(move |key| key.of(&words[index..=index]))
    };
    let keys = DRIVE_LAWS.iter().enumerate().flat_map(keys_of_law);
    let keys: Vec<FileKey> = std::iter::once(law).chain(keys).collect();
    FileTable::new("drive", "a drive", "coordinate of a slide or a hinge as a function of time", keys.leak())
        .by(Variants::Word("law", ""))
});

static FACTOR_TERMS: LazyLock<FileTable> = LazyLock::new(|| {
    let keys = TERM.each_ref().map(pure).to_vec();
    FileTable::new("factor_term", "a term of a factor", TERMS.help, keys.leak())
});

/// Table of the `factor` of a load: the laws of drives, for pure numbers.
pub(super) static FACTOR: LazyLock<FileTable> = LazyLock::new(|| {
    let words: &[&str] = DRIVE.words().iter().copied().filter(|word| *word != FUNCTION).collect::<Vec<_>>().leak();
    let applies = |key: &&FileKey| key.of != [FUNCTION] && key.name != "unit";
    let row = |key: &FileKey| match key.value_type {
        ValueType::Word(_) if key.name == INTERPOLATION.name => OF_FACTOR,
        ValueType::Word(_) => FileKey { value_type: ValueType::Word(words), ..*key },
        _ => pure(key),
    };
    let keys: Vec<FileKey> = DRIVE.keys.iter().filter(applies).map(row).collect();
    FileTable::new("factor", "a factor", "a number as a function of time", keys.leak()).by(Variants::Word("law", ""))
});

/// Interpolation of measured data that may have corners.
pub(super) const fn interpolation(of: &'static [&'static str]) -> FileKey {
    let words = ValueType::Word(<Interpolation as Words>::WORDS);
    let help = "`monotone` turns only where the points do; `linear` has a kink at each point, where steps end; `spline` for samples \
                of a smooth function";
    let row = key(INTERPOLATION.name, words, "\"linear\"", help).default_text(Interpolation::Monotone.word());
    FileKey { of, ..row }
}

const OF_FACTOR: FileKey = interpolation(&["table"]);

/// A row of a drive for pure numbers in place of lengths, and numbers per second in place of speeds.
fn pure(key: &FileKey) -> FileKey {
    use Dimension::{Frequency, Length, None, Speed};
    let (value_type, example) = match key.value_type {
        ValueType::Number(Length, range) => (ValueType::Number(None, range), "0.5"),
        ValueType::Number(Speed, range) => (ValueType::Number(Frequency, range), "\"0.5 1/s\""),
        ValueType::Pairs([time, _], limit) => (ValueType::Pairs([time, None], limit), "[[\"0 s\", 0], [\"1 s\", 0.5]]"),
        ValueType::List(_, limit) => {
            (ValueType::List(&FACTOR_TERMS, limit), "[{ amplitude = 0.5, frequency = \"1 Hz\" }]")
        }
        ValueType::File => (key.value_type, "\"pull.csv\""),
        value_type => (value_type, key.example),
    };
    let help = match key.name {
        "points" => "time and factor, in the order of time, at least two",
        "file" => "the points: two columns under a header that names the unit of the time, `time_s,factor`",
        _ => key.help,
    };
    FileKey { value_type, example, help, on_hinge: Option::None, ..*key }
}

/// Reads the drive of a coordinate, which is an angle if `turns`, or a factor, if the row of `node` has that table.
pub(super) fn read_drive(node: &Node<'_>, turns: bool) -> Result<Drive, SceneError> {
    let mut node = node.clone();
    node.document.on_hinge = turns;
    let section = node.section()?;
    let law = section.require("law")?;
    let number = |name: &str| section.number(name);
    Ok(match law.choice()? {
        FUNCTION => Drive::Function(read_function_index(&section, coordinate(&section))?),
        "constant" => Drive::Constant { position: number("position")?, velocity: number("velocity")? },
        "harmonic" => Drive::Harmonic { mean: number("mean")?, terms: vec![read_term(&section)?] },
        "harmonics" => Drive::Harmonic { mean: number("mean")?, terms: read_terms(&section)? },
        "ramp" => Drive::Ramp {
            from: number("from")?,
            to: number("to")?,
            start: number("start")?,
            duration: number("duration")?,
        },
        "pulse" => Drive::Pulse {
            base: number("base")?,
            height: number("height")?,
            start: number("start")?,
            duration: number("duration")?,
        },
        "table" => read_table(&section)?,
        "formula" => read_law_of_formula(&section)?,
        word => unreachable!("`{word}` has a row and no reader"),
    })
}

/// Dimension of the joint's coordinate, or of a factor.
fn coordinate(section: &Section<'_>) -> Dimension {
    match section.document.on_hinge {
        _ if section.rows.name == FACTOR.name => Dimension::None,
        true => Dimension::Angle,
        false => Dimension::Length,
    }
}

fn read_term(section: &Section<'_>) -> Result<Harmonic, SceneError> {
    Ok(Harmonic {
        amplitude: section.number("amplitude")?,
        frequency: section.number("frequency")?,
        phase: section.number("phase")?,
    })
}

fn read_terms(section: &Section<'_>) -> Result<Vec<Harmonic>, SceneError> {
    let node = section.require("terms")?;
    let nodes = node.entries()?;
    if nodes.is_empty() {
        let example = node.example();
        return Err(node.error(format!("needs a term; write for example `terms = {example}`")));
    }
    nodes.into_iter().map(|node| read_term(&node.section()?)).collect()
}

fn read_table(section: &Section<'_>) -> Result<Drive, SceneError> {
    let repeats = section.get("repeat").map_or(Ok(false), |node| node.flag())?;
    let graph = Graph::motion(coordinate(section), repeats);
    let points = match (section.get("points"), section.get("file")) {
        (Some(_), Some(file)) => {
            return Err(file.error("not allowed here: `points` are given as well"));
        }
        (None, Some(file)) => read_file(&file, &graph)?,
        _ => read_points(&section.require("points")?, &graph)?,
    };
    let is_factor = coordinate(section) == Dimension::None;
    let interpolation = match section.get(INTERPOLATION.name) {
        Some(node) => node.word()?,
        None if is_factor => Interpolation::Monotone,
        None => Interpolation::Spline,
    };
    Ok(Drive::Table { points, interpolation, repeats })
}

fn read_law_of_formula(section: &Section<'_>) -> Result<Drive, SceneError> {
    let node = section.require("formula")?;
    // A factor has no unit.
    let unit = section.rows.key("unit", None).and_then(|_| section.get("unit"));
    let (program, scale) = read_formula(&node, unit.as_ref(), coordinate(section))?;
    Ok(Drive::Formula { program, scale, resolve: section.number("resolve")? })
}
