use super::*;
use crate::units::unit_names;

/// All texts of a lesson step.
fn texts(step: &Step) -> Vec<&str> {
    let mut all: Vec<&str> = vec![&step.title, &step.text, &step.seen];
    if let Some(question) = &step.question {
        all.push(&question.ask);
        all.extend(question.choices.iter().map(|choice| &*choice.text));
    }
    all
}

/// A number with a unit in `text`, outside its placeholders.
fn written_number(text: &str) -> Option<&str> {
    let units: Vec<&str> = [
        crate::units::Dimension::Length,
        crate::units::Dimension::Time,
        crate::units::Dimension::Mass,
        crate::units::Dimension::Angle,
        crate::units::Dimension::Speed,
        crate::units::Dimension::Acceleration,
        crate::units::Dimension::Frequency,
        crate::units::Dimension::Force,
        crate::units::Dimension::AngularSpeed,
    ]
    .into_iter()
    .flat_map(unit_names)
    .chain(["µm", "µs", "°", "%", "per", "J", "mJ", "kN", "degrees", "seconds", "milliseconds"])
    .collect();
    let outside = text.split('{').enumerate().map(|(index, part)| match index {
        0 => part,
        _ => part.split_once('}').map_or("", |(_, after)| after),
    });
    for part in outside {
        for (at, digit) in part.char_indices().filter(|(_, c)| c.is_ascii_digit()) {
            let rest = part[at + digit.len_utf8()..].trim_start_matches(|c: char| c.is_ascii_digit() || c == '.');
            let rest = rest.trim_start_matches([' ', '\u{a0}', '\u{202f}']);
            let word = rest.split(|c: char| !(c.is_alphanumeric() || "%°µ".contains(c))).next();
            if word.is_some_and(|word| units.contains(&word)) || rest.starts_with(['°', '%']) {
                return Some(&part[at..]);
            }
        }
    }
    None
}

/// Controls of every window, without a ring: the largest button, and that of the lesson's panel.
const ALWAYS_SHOWN: [&str; 2] = ["Play", "Next"];

#[test]
fn the_first_step_of_every_lesson_names_a_control_and_names_what_it_rings() {
    for (name, _) in BUILT_IN_LESSONS {
        let lesson = Lesson::built_in(name).unwrap_or_else(|error| panic!("{name}: {error}"));
        let step = &lesson.steps[0];
        let blocks = text::blocks(&step.text);
        let strong = |piece: &&text::TextSpan| piece.face == text::SpanStyle::Strong;
        let spans = blocks.iter().flat_map(|block| block.pieces.iter().filter(strong));
        let named: Vec<&str> = spans.map(|piece| &*piece.text).collect();
        // `claims.rs` checks that the ringed controls exist.
        let is_control = |label: &&str| ALWAYS_SHOWN.contains(label) || step.highlight.iter().any(|own| own == label);
        assert!(named.iter().any(is_control), "{name}: {named:?}");
        assert!(step.text.contains("ress **") || step.text.contains("rag **"), "{name} says what to do");
    }
}

#[test]
fn every_built_in_lesson_is_correct() {
    let mut names = std::collections::BTreeSet::new();
    for (name, _) in BUILT_IN_LESSONS {
        let lesson = Lesson::built_in(name).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!((5..=10).contains(&lesson.steps.len()), "{name}: {}", lesson.steps.len());
        for step in &lesson.steps {
            for text in texts(step) {
                assert_eq!(written_number(text), None, "{name}: {}", step.title);
            }
        }
        assert!(lesson.steps.iter().filter(|step| step.question.is_some()).count() >= 2, "{name}");
        assert!(lesson.steps.iter().any(|step| !step.claims.is_empty()), "{name}");
        RunningLesson::new(lesson, 0).examine().unwrap_or_else(|why| panic!("{why}"));
        assert!(names.insert(name));
    }
    assert!(written_number("after 7.8 ms").is_some());
    assert!(written_number("turned by 30°").is_some());
    assert_eq!(written_number("S1 may {first + 1 ms} be 1 of 3"), None);
}

/// The example lesson of `docs/lessons.md`.
fn example() -> &'static str {
    let page = include_str!("../../../docs/lessons.md");
    let (_, block) = page.split_once("```toml\n").expect("an example");
    block.split_once("```").expect("its end").0
}

#[test]
fn the_example_of_the_page_holds_and_is_printed_with_its_values() {
    let lesson = Lesson::parse("own.toml", example(), Some("own.toml"));
    let lesson = lesson.unwrap_or_else(|error| panic!("{error}"));
    let printed = RunningLesson::new(Arc::new(lesson), 0).print();
    let printed = printed.unwrap_or_else(|why| panic!("{why}"));
    assert!(printed.contains("[x]  At twice the time"), "{printed}");
    assert!(printed.contains("larger by 0.3 mm"), "{printed}");
    assert!(!printed.contains(['{', '…']), "{printed}");
}

/// The error message of the example with `old` replaced by `new`.
fn fault(old: &str, new: &str) -> String {
    assert!(example().contains(old), "{old}");
    let text = example().replacen(old, new, 1);
    match Lesson::parse("own.toml", &text, Some("own.toml")) {
        Err(error) => error.to_string(),
        Ok(lesson) => RunningLesson::new(Arc::new(lesson), 0).examine().expect_err(new),
    }
}

#[test]
fn errors_in_a_lesson_name_their_position_and_the_allowed_values() {
    for (old, new, message_parts) in [
        ("title = \"A rod", "titel = \"A rod", &["own.toml:1:1", "titel", "expected one of", "`title`"][..]),
        ("scene = \"pendulum\"", "scene = \"pendulun\"", &["own.toml:2:9", "scene", "did you mean `pendulum`?"]),
        ("scene = \"pendulum\"", "scene = 3", &["own.toml:2:9", "scene", "expected a string"]),
        ("{ impact = 1 }", "{ impact = 0 }", &["own.toml:6:9", "measure.first", "allowed 1 and more"]),
        (
            "{ impact = 1 }",
            "{ impact = 1, of = \"S9\" }",
            &["measure.first", "no joint with play `S9`; allowed: any, S1"],
        ),
        ("{ impact = 1 }", "{ from = \"0 s\" }", &["measure.first", "allowed one: parameter, instant, impact"]),
        ("run = \"wide\"", "run = \"wild\"", &["measure.wide", "did you mean `wide`?", "allowed: wide"]),
        ("its = \"approach\"", "its = \"aproach\"", &["unknown variant `aproach`", "`approach`"]),
        ("contact.clearance", "contact.clearence", &["measure.clearance", "contact.clearance"]),
        (
            "after {first}",
            "after {frist}",
            &["step 1.text", "own.toml:14:7", "no measure `frist` (did you mean `first`?); allowed: clearance, first"],
        ),
        ("after {first}", "after {first in mm}", &["step 1", "{first in mm}: not in that unit; allowed: s, ms, us"]),
        ("after {first}", "after {first + speed}", &["step 1", "different dimensions"]),
        ("\"first + 0.2 ms\"", "\"first + 0.2 xs\"", &["step 1.until", "own.toml:19:9"]),
        ("\"first + 0.2 ms\"", "\"0 s\"", &["step 1", "not an instant after the beginning of the step"]),
        ("show=microscope.S1", "show=microscope.S7", &["step 1.state", "allowed: S1"]),
        ("c=1.2mm", "c=1.2kg", &["step 2.state", "wrong unit"]),
        ("view = \"S1\"", "view = \"S2\"", &["step 1.view", "isometric, front, side, top, S1"]),
        ("wide / first < 1.1", "wide / first", &["step 2.question", "allowed <, > and ="]),
        ("wide / first < 1.1", "wide / first < 5", &["2 choices are correct, not one", "wide / first is 2"]),
        ("\"wide > first\"", "\"wide < first\"", &["`wide < first` does not hold", "wide is"]),
        ("name = \"wide\"", "", &["measure.wide", "no step that begins a run"]),
    ] {
        let error = fault(old, new);
        for part in message_parts {
            assert!(error.contains(part), "{new}: {error}: no `{part}`");
        }
    }
    let error = Lesson::load("ratle").expect_err("no such lesson").to_string();
    assert!(error.contains("did you mean `rattle`?"), "{error}");
    let error = Lesson::load("/no/such.toml").expect_err("no such file").to_string();
    assert!(error.contains("/no/such.toml: cannot read this file"), "{error}");
}

#[test]
fn a_change_belongs_to_an_instant_and_is_measured_where_it_happens() {
    let text = |state: &str| {
        format!(
            "title = \"x\"\nscene = \"spcmm\"\n[measure]\nbefore = {{ value = \"S1.clearance\", at = \"19 ms\", run = \"r\" }}\n\
             after = {{ value = \"S1.clearance\", at = \"21 ms\", run = \"r\" }}\n[[step]]\nname = \"r\"\ntitle = \"x\"\ntext = \"\"\n\
             state = \"{state}\"\nchange = {{ \"contact.clearance\" = \"0.6 mm\" }}\nclaims = [\"after = 2 * before\"]\n"
        )
    };
    let lesson = Lesson::parse("own", &text("t=20ms"), None).expect("a lesson");
    RunningLesson::new(Arc::new(lesson), 0).examine().unwrap_or_else(|why| panic!("{why}"));
    let error = Lesson::parse("own", &text("t=20ms&log=AAAA"), None).expect_err("a log");
    assert!(error.to_string().contains("step 1.state"), "{error}");
}
