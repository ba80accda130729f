//! `bench`: how fast the default scene runs, against its speed goals.

use std::fmt::Write as _;

use super::args::BenchArguments;
use super::tradeoff::{grid, percent, times, value};
use super::{DEFAULT_SCENE, Failure, machine, measuring, print};
use crate::analysis::{Reach, reach};
use crate::scene::Scene;

/// Runs `bench`.
///
/// # Errors
/// Bad changes, Ctrl-C.
pub fn bench(arguments: &BenchArguments) -> Result<(), Failure> {
    let scene = Scene::load(DEFAULT_SCENE, &arguments.changes)?;
    let rows = measuring::measure(arguments.quiet, Some(&scene), |context| {
        reach(&scene, context)
    })?;
    print(&text(&rows))
}

fn text(rows: &[Reach]) -> String {
    let head = [
        "span",
        "method",
        "speed",
        "asked",
        "rk4 at 10 us",
        "ratio",
        "error",
        "of",
        "reached",
    ];
    let mut lines = vec![head.map(str::to_owned).to_vec()];
    for row in rows {
        lines.push(vec![
            row.goal.label().to_owned(),
            format!("{} {}", row.setting.method, value(&row.setting)),
            times(Some(row.speed)),
            format!("{:.0}", row.goal.asked()),
            times(row.yardstick),
            times(row.yardstick.map(|other| row.speed / other)),
            percent(row.error),
            row.goal.error_of().to_owned(),
            if row.met() { "yes" } else { "no" }.to_owned(),
        ]);
    }
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = writeln!(out, "Machine           {}", machine::name());
    out.push_str(
        "Speeds            simulated seconds in a second of stepping, one core\n\
         All joints ideal  no differential equation is solved, so that a stepper has no part in it\n\n",
    );
    out.push_str(&grid(&lines));
    out
}
