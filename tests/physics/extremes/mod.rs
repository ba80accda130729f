//! Every extreme of a scene's parameters, with every preset or method, ends in a named outcome.

mod outcome;
// The pacing of the window, from a crate that this one does not use.
#[path = "../../../src/session/pace.rs"]
#[expect(dead_code, reason = "the window needs more of it")]
mod pace;
mod rows;

use std::fmt::Write;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use crate::common::METHODS;
use outcome::{Outcome, run};
use rows::{Columns, Row, rows};

/// A call without a result for this long hangs.
const TIMEOUT: Duration = Duration::from_secs(600);
const FORMS: [&str; 2] = ["tree", "lagrange"];
const PRESETS: [&str; 4] = ["preview", "real-time", "accurate", "reference"];

impl Columns {
    fn words(self) -> &'static [&'static str] {
        match self {
            Self::Presets => &PRESETS,
            Self::Methods => &METHODS,
        }
    }
}

/// Outcomes of a row: those of each formulation in the order of its columns.
type Outcomes = [Vec<Outcome>; 2];

/// A cell: indices of its row and its formulation, and the word of its column.
type Cell = (usize, usize, &'static str);

/// Outcomes of `cells`, in their order.
fn outcomes(rows: &Arc<Vec<Row>>, cells: Vec<Cell>) -> Vec<Outcome> {
    let cells = Arc::new(cells);
    let next = Arc::new(Mutex::new(0));
    let (send, receive) = channel();
    for _ in 0..2 {
        let (rows, cells, next, send) = (rows.clone(), cells.clone(), next.clone(), send.clone());
        std::thread::spawn(move || {
            loop {
                let cell = {
                    let mut next = next.lock().unwrap();
                    *next += 1;
                    *next - 1
                };
                let Some(&(row, form, word)) = cells.get(cell) else {
                    return;
                };
                let run = || run(&rows[row], FORMS[form], word);
                let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(run))
                    .unwrap_or_else(|_| Outcome::Wrong("panic".to_owned()));
                if send.send((cell, outcome)).is_err() {
                    return;
                }
            }
        });
    }
    drop(send);
    let mut outcomes = vec![None; cells.len()];
    loop {
        match receive.recv_timeout(TIMEOUT) {
            Ok((cell, outcome)) => outcomes[cell] = Some(outcome),
            Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => {
                let missing = outcomes.iter().position(Option::is_none).unwrap();
                let (row, form, word) = cells[missing];
                let row = &rows[row];
                panic!("hangs: {}, {}, {}, {word}", row.scene, row.label, FORMS[form]);
            }
        }
    }
    outcomes.into_iter().map(Option::unwrap).collect()
}

/// Outcomes of every row.
fn table() -> Vec<(Row, Outcomes)> {
    let rows = Arc::new(rows());
    let of_row = |(r, row): (usize, &Row)| {
        let words = row.columns.words();
        (0..FORMS.len()).flat_map(move |f| words.iter().map(move |word| (r, f, *word)))
    };
    let cells = rows.iter().enumerate().flat_map(of_row).collect();
    let mut outcomes = outcomes(&rows, cells).into_iter();
    let Ok(rows) = Arc::try_unwrap(rows) else { panic!("a thread still holds the rows") };
    let mut with = |row: Row| {
        let mut take = || outcomes.by_ref().take(row.columns.words().len()).collect();
        let of_forms = [take(), take()];
        (row, of_forms)
    };
    rows.into_iter().map(&mut with).collect()
}

const HEAD: &str = "# Behaviour at the limits of the parameters

Outcomes of the first impacts of a scene with extreme parameter values, in both formulations, with every preset, or with every method where
the row varies step or tolerance. All are in `docs/extremes.csv`, one line per scene, extreme and formulation.
`cargo test -p jointplay-analysis --test physics extremes::` computes and checks one cell of each row, with `-- --ignored extremes::full` all cells; with
`-- --ignored extremes::write_the_page` it writes this page and that file.

- **runs**: the run reaches its end. Every number is finite, orientations are rotations, ideal joints are closed to 1e-9 m (1 mm in
  `lagrange`, which only stabilises them), no ball is deeper in its wall than a tenth of its radius, a ball that moves deeper into the
  wall meets a force, and the energy of a scene without drives does not grow.
- **slow**: the same, but slower than requested, which the pacer reports; the window then shows the speed that it reached. Requested is
  slow motion of 1:10 on a computer that evaluates the equations 50 000 times per second, half as often with `lagrange`.
- **doubtful**: the program marks the result as doubtful and gives the reason (`doubts` in the summary of `run`).
- **stopped**: the divergence guard stopped the run, with a reason, and kept the last good state.
- **refused**: the run does not start, with a reason.
";
/// Heading of the part of the page that another test writes.
const LONG_RUN: &str = "\n## 1000 simulated seconds\n";

/// The page: how often each outcome occurs, and the first reason of each outcome in a row.
fn page(table: &[(Row, Outcomes)]) -> String {
    let mut page = String::from(HEAD);
    let words = outcome::WORDS.join(" | ");
    let line = "---|".repeat(outcome::WORDS.len());
    let _ = write!(page, "\n## How often\n\n| Preset or method | Formulation | {words} |\n|---|---|{line}\n");
    for columns in [Columns::Presets, Columns::Methods] {
        for (n, column) in columns.words().iter().enumerate() {
            for (f, form) in FORMS.iter().enumerate() {
                let cells = table.iter().filter(|(row, _)| row.columns == columns);
                let cells: Vec<&str> = cells.map(|(_, outcomes)| outcomes[f][n].word()).collect();
                let counts = outcome::WORDS.map(|word| cells.iter().filter(|cell| **cell == word).count().to_string());
                let _ = writeln!(page, "| {column} | {form} | {} |", counts.join(" | "));
            }
        }
    }
    page.push_str("\n## Reasons\n\nThe first reason of each outcome in a row.\n\n");
    for (row, outcomes) in table {
        let mut reported: Vec<&str> = Vec::new();
        for (f, form) in FORMS.iter().enumerate() {
            for (outcome, column) in outcomes[f].iter().zip(row.columns.words()) {
                if outcome.reason().is_empty() || reported.contains(&outcome.word()) {
                    continue;
                }
                reported.push(outcome.word());
                let (label, word, why) = (&row.label, outcome.word(), outcome.reason());
                let why = why.lines().next().unwrap_or_default();
                let _ = writeln!(page, "- {}, {label}, {form}, {column}: **{word}**: {why}", row.scene);
            }
        }
    }
    page
}

/// Columns of the file of outcomes after those that name the row.
fn csv_columns() -> Vec<&'static str> {
    [&PRESETS[..], &METHODS].concat()
}

/// What a line of the file begins with.
fn csv_head(row: &Row, form: &str) -> String {
    format!("{},\"{}\",{form},", row.scene, row.label)
}

/// Every outcome; a row with presets has empty cells for methods, and the reverse.
fn csv(table: &[(Row, Outcomes)]) -> String {
    let columns = csv_columns();
    let mut csv = format!("scene,extreme,formulation,{}\n", columns.join(","));
    for (row, outcomes) in table {
        for (of_form, form) in outcomes.iter().zip(FORMS) {
            let cell = |column: &&str| {
                let place = row.columns.words().iter().position(|word| word == column);
                place.map_or("", |place| of_form[place].word())
            };
            let cells: Vec<&str> = columns.iter().map(cell).collect();
            let _ = writeln!(csv, "{}{}", csv_head(row, form), cells.join(","));
        }
    }
    csv
}

fn path(ending: &str) -> std::path::PathBuf {
    std::path::Path::new(crate::ROOT).join(format!("docs/extremes.{ending}"))
}

fn stored_csv() -> String {
    std::fs::read_to_string(path("csv")).unwrap_or_default()
}

/// The stored page: the outcomes, and the rest.
fn stored_page() -> (String, String) {
    let text = std::fs::read_to_string(path("md")).unwrap_or_default();
    let at = text.find(LONG_RUN).unwrap_or(text.len());
    (text[..at].to_owned(), text[at..].to_owned())
}

#[test]
#[ignore = "writes docs/extremes.md and docs/extremes.csv"]
fn write_the_page() {
    let table = table();
    std::fs::write(path("csv"), csv(&table)).unwrap();
    std::fs::write(path("md"), page(&table) + &stored_page().1).unwrap();
}

/// Prints the reason of an outcome; returns whether it is wrong.
fn report_outcome(row: &Row, form: &str, column: &str, outcome: &Outcome) -> bool {
    let (word, why) = (outcome.word(), outcome.reason());
    if !why.is_empty() {
        println!("{word}: {}, {}, {form}, {column}: {why}", row.scene, row.label);
    }
    matches!(outcome, Outcome::Wrong(_))
}

const UPDATE_COMMAND: &str = "cargo test -p jointplay-analysis --test physics -- --ignored extremes::write_the_page";

#[test]
#[ignore = "full: half a minute"]
fn full_every_extreme_ends_in_a_named_outcome() {
    let table = table();
    let mut wrong = 0;
    for (row, outcomes) in &table {
        for (f, form) in FORMS.iter().enumerate() {
            for (outcome, column) in outcomes[f].iter().zip(row.columns.words()) {
                wrong += u32::from(report_outcome(row, form, column, outcome));
            }
        }
    }
    assert_eq!(wrong, 0, "wrong outcomes");
    assert!(stored_csv() == csv(&table) && stored_page().0 == page(&table), "{UPDATE_COMMAND}");
}

/// Checks one cell of each row, rotating through formulations and columns.
#[test]
fn an_outcome_of_every_extreme_agrees_with_the_file() {
    let rows = Arc::new(rows());
    let cell_of_row = |(r, row): (usize, &Row)| {
        let words = row.columns.words();
        (r, r % FORMS.len(), words[r / FORMS.len() % words.len()])
    };
    let cells: Vec<Cell> = rows.iter().enumerate().map(cell_of_row).collect();
    let outcomes = outcomes(&rows, cells.clone());
    let (stored, columns) = (stored_csv(), csv_columns());
    for ((r, f, word), outcome) in cells.into_iter().zip(outcomes) {
        let (row, form) = (&rows[r], FORMS[f]);
        assert!(!report_outcome(row, form, word, &outcome), "wrong outcome");
        let head = csv_head(row, form);
        let line = stored.lines().find_map(|line| line.strip_prefix(&*head));
        let line = line.unwrap_or_else(|| panic!("{head}: {UPDATE_COMMAND}"));
        let column = columns.iter().position(|other| *other == word).expect("a column");
        let stored = line.split(',').nth(column).expect("a cell");
        assert_eq!(outcome.word(), stored, "{head} {word}: {UPDATE_COMMAND}");
    }
}
