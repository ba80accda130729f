//! Laws of driven joints: one row per law, from which `drive` is read. The motion they prescribe is in `mechanism/drives`.

use super::document::{MAX_SI, Node, Section};
use super::formula::read_formula;
use super::points::{Graph, SHORTEST_PART, read_file, read_points};
use super::*;

/// Highest frequency of a harmonic drive, Hz.
pub(super) const FASTEST_DRIVE: f64 = 1e4;
/// Most terms of a sum of harmonics.
const MOST_TERMS: usize = 100;
/// Lower end of a range that excludes 0.
const ABOVE_ZERO: f64 = f64::MIN_POSITIVE;
/// Range of a number that [`Node::quantity`] bounds.
const ANY: (f64, f64) = (-MAX_SI, MAX_SI);

/// A law being read.
struct DriveText<'a, 'd> {
    law: &'a Node<'d>,
    section: &'a Section<'d>,
    kind: JointKind,
    scene: &'a Scene,
}

const fn number(
    key: &'static str,
    dimension: Dimension,
    range: (f64, f64),
    default: Option<f64>,
    like: &'static str,
    help: &'static str,
) -> ElementNumber {
    ElementNumber {
        key,
        dimension,
        range,
        default,
        like,
        help,
        on_hinge: None,
    }
}

const fn place(key: &'static str, default: Option<f64>, help: &'static str) -> ElementNumber {
    number(key, Dimension::Length, ANY, default, "\"10 mm\"", help)
}

/// Amplitude, frequency and phase of a harmonic.
const TERM: [ElementNumber; 3] = [
    place("amplitude", None, "amplitude"),
    number(
        "frequency",
        Dimension::Frequency,
        (ABOVE_ZERO, FASTEST_DRIVE),
        None,
        "\"1 Hz\"",
        "frequency",
    ),
    number(
        "phase",
        Dimension::Angle,
        ANY,
        Some(0.0),
        "\"90 deg\"",
        "phase at t = 0",
    ),
];

const MEAN: ElementNumber = place("mean", Some(0.0), "mean");

const START: ElementNumber = number(
    "start",
    Dimension::Time,
    ANY,
    Some(0.0),
    "\"1 s\"",
    "when it begins",
);

const DURATION: ElementNumber = number(
    "duration",
    Dimension::Time,
    (SHORTEST_PART, MAX_SI),
    None,
    "\"0.5 s\"",
    "how long it lasts",
);

/// Every law of a drive.
pub static DRIVE_KINDS: [DriveKind; 8] = [
    DriveKind {
        word: "spcmm",
        help: "slider of the paper's machine; places the joint itself",
        numbers: &[],
        others: &[("slider", "which slider, 1, 2 or 3 (must be given)")],
    },
    DriveKind {
        word: "constant",
        help: "position + velocity t",
        numbers: &[
            place("position", Some(0.0), "where it is at t = 0"),
            number(
                "velocity",
                Dimension::Speed,
                ANY,
                None,
                "\"10 mm/s\"",
                "its rate",
            ),
        ],
        others: &[],
    },
    DriveKind {
        word: "harmonic",
        help: "mean + amplitude sin(2π frequency t + phase)",
        numbers: &[MEAN, TERM[0], TERM[1], TERM[2]],
        others: &[],
    },
    DriveKind {
        word: "harmonics",
        help: "mean + a sum of harmonics",
        numbers: &[MEAN],
        others: &[(
            "terms",
            "1 to 100 of `{ amplitude, frequency, phase }`, as of `harmonic` (must be given)",
        )],
    },
    DriveKind {
        word: "ramp",
        help: "from one position to another: with s from 0 to 1 over the duration, from + (to - from) (10 s³ - 15 s⁴ + 6 s⁵), \
               whose rate and acceleration are 0 at both ends",
        numbers: &[
            place("from", Some(0.0), "where it is before"),
            place("to", None, "where it is afterwards"),
            START,
            DURATION,
        ],
        others: &[],
    },
    DriveKind {
        word: "pulse",
        help: "one bump: with s from 0 to 1 over the duration, base + height sin³(π s)",
        numbers: &[
            place("base", Some(0.0), "where it is before and afterwards"),
            place("height", None, "height of the bump above it"),
            START,
            DURATION,
        ],
        others: &[],
    },
    DriveKind {
        word: "table",
        help: "cubic spline through points",
        numbers: &[],
        others: &[
            (
                "points",
                "2 to 10000 of `[time, position]`, in the order of time",
            ),
            (
                "file",
                "instead of `points`: a CSV file beside the scene, two columns under a header with units, `time_s,position_mm`",
            ),
            (
                "repeat",
                "true if the points are one period of the motion (false if left out)",
            ),
        ],
    },
    DriveKind {
        word: "formula",
        help: "an expression of the time t in s, see below",
        numbers: &[number(
            "resolve",
            Dimension::Time,
            (SHORTEST_PART, 1.0),
            Some(1e-3),
            "\"1 ms\"",
            "longest step that an adaptive method takes; a fifth of what the formula does in the shortest time suits it",
        )],
        others: &[
            ("formula", "the expression (must be given)"),
            ("unit", "unit of its value (m or rad if left out)"),
        ],
    },
];

impl DriveKind {
    fn keys(&self) -> impl Iterator<Item = &'static str> {
        let numbers = self.numbers.iter().map(|number| number.key);
        numbers.chain(self.others.iter().map(|(key, _)| *key))
    }
}

/// What `dimension` in a row stands for at a joint of `kind`, and an example of it there.
fn at_joint(
    kind: JointKind,
    dimension: Dimension,
    like: &'static str,
) -> (Dimension, &'static str) {
    match (kind, dimension) {
        (JointKind::Revolute, Dimension::Length) => (Dimension::Angle, "\"10 deg\""),
        (JointKind::Revolute, Dimension::Speed) => (Dimension::AngularSpeed, "\"6 rad/s\""),
        _ => (dimension, like),
    }
}

/// One number of a law.
fn read_number(
    section: &Section<'_>,
    row: &ElementNumber,
    kind: JointKind,
) -> Result<f64, SceneError> {
    let (dimension, like) = at_joint(kind, row.dimension, row.like);
    let node = match (section.get(row.key), row.default) {
        (None, Some(default)) => return Ok(default),
        _ => section.require(row.key, like)?,
    };
    let (least, most) = row.range;
    if least == ABOVE_ZERO {
        return node.positive(dimension, most, si_unit(dimension));
    }
    node.within(dimension, row.range)
}

/// The drive of a joint of `kind`, a slide or a hinge.
pub(super) fn read_drive(
    node: &Node<'_>,
    kind: JointKind,
    scene: &Scene,
) -> Result<Drive, SceneError> {
    // The word before anything else: it decides which other keys there are.
    if let Some(word) = node.peek(&node.key, "law") {
        word.choice(&DRIVE_KINDS.each_ref().map(|row| row.word))?;
    }
    let mut all = vec!["law"];
    for key in DRIVE_KINDS.iter().flat_map(DriveKind::keys) {
        if !all.contains(&key) {
            all.push(key);
        }
    }
    let law = node.section(&all)?.require("law", "\"constant\"")?;
    let word = law.text()?;
    let row = DRIVE_KINDS.iter().find(|row| row.word == word);
    let row = row.expect("its word was checked");
    let keys: Vec<&str> = ["law"].into_iter().chain(row.keys()).collect();
    let section = node.section(&keys)?;
    let numbers = row.numbers.iter();
    let numbers = numbers
        .map(|number| read_number(&section, number, kind))
        .collect::<Result<_, _>>()?;
    let text = DriveText {
        law: &law,
        section: &section,
        kind,
        scene,
    };
    let data = match row.word {
        "spcmm" => read_slider(&text)?,
        "harmonics" => read_terms(&text)?,
        "table" => read_table(&text)?,
        "formula" => read_law_of_formula(&text)?,
        _ => DriveData::Numbers,
    };
    Ok(Drive {
        kind: row,
        numbers,
        data,
    })
}

fn read_slider(text: &DriveText<'_, '_>) -> Result<DriveData, SceneError> {
    if text.kind != JointKind::Prismatic {
        return Err(text.law.error("the law spcmm drives prismatic joints only"));
    }
    if text.scene.spcmm.is_none() {
        return Err(text
            .law
            .error("the law spcmm needs a section [spcmm] in the file"));
    }
    let slider = text.section.require("slider", "1")?;
    match slider.scalar()?.parse::<u8>() {
        Ok(number @ 1..=3) => Ok(DriveData::Slider(number as usize - 1)),
        _ => Err(slider.error("out of range; allowed 1, 2 or 3; a whole number, no unit")),
    }
}

fn read_terms(text: &DriveText<'_, '_>) -> Result<DriveData, SceneError> {
    let like = "[{ amplitude = \"10 mm\", frequency = \"1 Hz\" }]";
    let node = text.section.require("terms", like)?;
    let nodes = node.elements_up_to(MOST_TERMS, "terms")?;
    if nodes.is_empty() {
        return Err(node.error(format!("needs a term; write for example `terms = {like}`")));
    }
    let keys = TERM.map(|number| number.key);
    let term = |node: Node<'_>| {
        let section = node.section(&keys)?;
        let mut term = [0.0; 3];
        for (value, row) in term.iter_mut().zip(&TERM) {
            *value = read_number(&section, row, text.kind)?;
        }
        Ok(term)
    };
    let terms = nodes.into_iter().map(term).collect::<Result<_, _>>()?;
    Ok(DriveData::Terms(terms))
}

fn read_table(text: &DriveText<'_, '_>) -> Result<DriveData, SceneError> {
    let section = text.section;
    let (dimension, _) = at_joint(text.kind, Dimension::Length, "");
    let repeats = section
        .get("repeat")
        .map_or(Ok(false), |node| node.flag())?;
    let graph = Graph::motion(dimension, repeats);
    let points = match (section.get("points"), section.get("file")) {
        (Some(_), Some(file)) => {
            return Err(file.error("not allowed here: `points` are given as well"));
        }
        (None, Some(file)) => read_file(&file, &graph)?,
        _ => {
            let like = match text.kind {
                JointKind::Revolute => "[[\"0 s\", \"0 deg\"], [\"1 s\", \"10 deg\"]]",
                _ => "[[\"0 s\", \"0 mm\"], [\"1 s\", \"10 mm\"]]",
            };
            read_points(&section.require("points", like)?, &graph)?
        }
    };
    Ok(DriveData::Points { points, repeats })
}

fn read_law_of_formula(text: &DriveText<'_, '_>) -> Result<DriveData, SceneError> {
    let (dimension, _) = at_joint(text.kind, Dimension::Length, "");
    let node = text.section.require("formula", "\"0.01 * sin(2*pi*t)\"")?;
    let unit = text.section.get("unit");
    let (program, scale) = read_formula(&node, unit.as_ref(), dimension)?;
    Ok(DriveData::Formula(program, scale))
}
