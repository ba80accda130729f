//! Words of earlier versions, each answered with the way that took its place.

use std::ffi::{OsStr, OsString};

/// A command that the Python package took over, as the package names it.
const IN_PACKAGE: &[(&str, &str)] =
    &[("import", "import"), ("reproduce", "paper"), ("sensitivity", "sensitivity"), ("tolerance", "tolerance")];

/// Other commands and options, each with the command that has it, and what to do in place of it.
const GONE: &[(&str, &str, &str)] = &[
    ("bench", "", "`jointplay tradeoff SCENE…` measures the cost and error of every method on scenes"),
    ("tradeoff", "--all", "name the scenes: `jointplay tradeoff SCENE… --out FOLDER`"),
    (
        "validate",
        "",
        "`cargo test -p jointplay-analysis --test physics validation` compares with the known answers of docs/validation.md",
    ),
    (
        "merge",
        "",
        "split the rows of `sweep --points` over the computers, and concatenate the tables (docs/cluster.md)",
    ),
    (
        "sweep",
        "--shard",
        "split the rows of `--points` over the computers, and concatenate the tables (docs/cluster.md)",
    ),
    ("sweep", "--zip", "write one row per point to a file for `--points`"),
];

/// What to answer to `arguments`, without the name of the program, if they begin with a former command or use a former option.
pub fn answer(arguments: &[OsString]) -> Option<String> {
    let first = arguments.first()?.to_str()?;
    if let Some((word, now)) = IN_PACKAGE.iter().find(|(word, _)| *word == first) {
        return Some(format!(
            "`jointplay {word}` is now `./run lab {now} …`, or `python -m jointplay {now} …` after `pip install jointplay`"
        ));
    }
    let is_given =
        |word: &OsStr, option: &str| word.to_str().is_some_and(|word| word.split('=').next() == Some(option));
    let gone = GONE.iter().find(|(command, option, _)| {
        *command == first && (option.is_empty() || arguments.iter().any(|word| is_given(word, option)))
    });
    gone.map(|(command, option, now)| match *option {
        "" => format!("`jointplay {command}` is gone: {now}"),
        option => format!("`{option}` of `jointplay {command}` is gone: {now}"),
    })
}
