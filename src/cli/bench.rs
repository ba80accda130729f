//! `bench`: how fast the default scene and machines with many loose joints run, against their speed goals.

use std::fmt::Write as _;

use super::args::BenchArguments;
use super::tables::{Table, yes_or_no};
use super::tradeoff::{percent, times, value};
use super::{DEFAULT_SCENE, Failure, machine, measuring, print};
use crate::analysis::{
    GROWTH, GoalResult, LIMITS, LOOSE_MACHINES, LooseSpeed, Timed, growth, loose_speed, measure_speed_goals,
};
use crate::scene::Scene;
use crate::units::format_quantity;

/// Runs `bench`.
///
/// # Errors
/// Bad changes, Ctrl-C.
pub fn bench(arguments: &BenchArguments) -> Result<(), Failure> {
    let scene = Scene::load(DEFAULT_SCENE, &arguments.changes)?;
    let (rows, machines, growth) = measuring::measure(arguments.quiet, Some(&scene), |context| {
        let parts = LOOSE_MACHINES.len() + 2;
        let rows = measure_speed_goals(&scene, &mut context.part(0, parts))?;
        let mut machines = Vec::new();
        for (n, machine) in LOOSE_MACHINES.into_iter().enumerate() {
            machines.push(loose_speed(machine, &mut context.part(n + 1, parts))?);
        }
        let growth = growth(&mut context.part(parts - 1, parts))?;
        Ok((rows, machines, growth))
    })?;
    print(&text(&rows, &machines, growth))
}

fn text(rows: &[GoalResult], machines: &[LooseSpeed], growth: f64) -> String {
    let goal_rows = rows.iter().map(|row| {
        vec![
            row.goal.label().to_owned(),
            format!("{} {}", row.setting.method, value(&row.setting)),
            times(Some(row.speed)),
            format!("{:.0}", row.goal.required_speed()),
            times(row.baseline),
            times(row.baseline.map(|other| row.speed / other)),
            percent(row.error),
            row.goal.error_quantity().to_owned(),
            yes_or_no(row.is_met()),
        ]
    });
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = writeln!(out, "Machine           {}", machine::name());
    out.push_str(
        "Speeds            simulated seconds in a second of stepping, one core\n\
         All joints ideal  no differential equation is solved, so the stepper plays no part\n\n",
    );
    let headings = "span | method | speed | goal | rk4 at 10 us | ratio | error | of | reached";
    out.push_str(&Table::new(headings, goal_rows).text());
    out.push_str(
        "\nLoose joints: the fastest setting of each method whose peaks of the first impacts err by no more than the limit\n\n",
    );
    let line = |row: &LooseSpeed, limit: &str, timed: &Timed| {
        let setting = format!("{} {}", timed.setting.method, value(&timed.setting));
        let [speed, ratio] = [timed.speed, timed.speed / row.baseline.speed].map(|factor| times(Some(factor)));
        let span = format_quantity(row.machine.span, "s");
        vec![row.machine.label.to_owned(), span, limit.to_owned(), setting, percent(timed.error), speed, ratio]
    };
    let mut speeds = Vec::new();
    for row in machines {
        for (limit, fastest) in LIMITS.iter().zip(&row.fastest) {
            let limit = percent(Some(*limit));
            speeds.extend(fastest.iter().map(|timed| line(row, &limit, timed)));
        }
        speeds.push(line(row, "-", &row.baseline));
    }
    let headings = "machine | span | limit | setting | error | speed | over rk4";
    out.push_str(&Table::new(headings, speeds).text());
    let ([short, long], span, most) = GROWTH;
    let _ = writeln!(
        out,
        "\nA link of a chain of {long} costs {} times one of {short} over {}; goal: at most {most}; reached: {}",
        times(Some(growth)),
        format_quantity(span, "ms"),
        yes_or_no(growth <= most)
    );
    out
}
