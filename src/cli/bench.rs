//! `bench`: how fast the default scene and machines with many loose joints run, against their speed goals.

use std::fmt::Write as _;

use super::args::BenchArguments;
use super::tables::{Table, yes};
use super::tradeoff::{percent, times, value};
use super::{DEFAULT_SCENE, Failure, machine, measuring, print};
use crate::analysis::{GROWTH, GoalResult, SPEED_GOALS, Speed, growth, reach, speed};
use crate::scene::Scene;
use crate::units::format_quantity;

/// Runs `bench`.
///
/// # Errors
/// Bad changes, Ctrl-C.
pub fn bench(arguments: &BenchArguments) -> Result<(), Failure> {
    let scene = Scene::load(DEFAULT_SCENE, &arguments.changes)?;
    let (rows, machines, growth) = measuring::measure(arguments.quiet, Some(&scene), |context| {
        let parts = SPEED_GOALS.len() + 2;
        let rows = reach(&scene, &mut context.part(0, parts))?;
        let mut machines = Vec::new();
        for (n, goal) in SPEED_GOALS.into_iter().enumerate() {
            machines.push(speed(goal, &mut context.part(n + 1, parts))?);
        }
        // Uses the tolerance of the shorter of its two chains.
        let tolerance = machines[1].tolerance;
        let growth = growth(tolerance, &mut context.part(parts - 1, parts))?;
        Ok((rows, machines, growth))
    })?;
    print(&text(&rows, &machines, growth))
}

fn text(rows: &[GoalResult], machines: &[Speed], growth: f64) -> String {
    let reach = rows.iter().map(|row| {
        vec![
            row.goal.label().to_owned(),
            format!("{} {}", row.setting.method, value(&row.setting)),
            times(Some(row.speed)),
            format!("{:.0}", row.goal.asked()),
            times(row.baseline),
            times(row.baseline.map(|other| row.speed / other)),
            percent(row.error),
            row.goal.error_of().to_owned(),
            yes(row.met()),
        ]
    });
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = writeln!(out, "Machine           {}", machine::name());
    out.push_str(
        "Speeds            simulated seconds in a second of stepping, one core\n\
         All joints ideal  no differential equation is solved, so the stepper plays no part\n\n",
    );
    let heads = "span | method | speed | asked | rk4 at 10 us | ratio | error | of | reached";
    out.push_str(&Table::new(heads, reach).text());
    let _ = writeln!(out, "\nMany loose joints, automatic at the loosest tolerance with good peaks\n");
    let speeds = machines.iter().map(|row| {
        vec![
            row.goal.label.to_owned(),
            format_quantity(row.goal.span, "s"),
            format!("{:e}", row.tolerance),
            percent(row.error),
            times(Some(row.speed)),
            format!("{:.0}", row.goal.asked),
            yes(row.met()),
        ]
    });
    let heads = "machine | span | tolerance | error | speed | asked | reached";
    out.push_str(&Table::new(heads, speeds).text());
    let ([short, long], span, most) = GROWTH;
    let _ = writeln!(
        out,
        "\nA link of a chain of {long} costs {} times one of {short} over {}; asked: at most {most}; reached: {}",
        times(Some(growth)),
        format_quantity(span, "ms"),
        yes(growth <= most)
    );
    out
}
