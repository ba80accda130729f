//! Numbers and tables of the trade-off for people.

use std::fmt::Write as _;

use crate::analysis::{CaseCost, End, Phase, Point, ReferenceSolution, Setting, WorkPrecision};
use crate::cli::machine;
use crate::cli::output::significant;
use crate::units::format_quantity;

/// A factor with three digits, `-` if there is none.
pub fn times(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| significant(value, 3))
}

/// A relative error as a percentage with two digits.
pub fn percent(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{} %", significant(100.0 * value, 2)))
}

/// A step with its unit, or a tolerance.
pub fn value(setting: &Setting) -> String {
    if setting.adaptive { format!("{:e}", setting.tolerance) } else { format_quantity(setting.step_s, "us") }
}

/// An error with two digits; one below `floor` is shown as less than `floor`.
pub(super) fn error(value: Option<f64>, floor: Option<f64>) -> String {
    match (value, floor) {
        (None, _) => "-".to_owned(),
        (Some(value), Some(floor)) if value <= floor => format!("< {}", exponent(floor)),
        (Some(value), _) => exponent(value),
    }
}

/// Two digits: `4.3e-5`, `0.031`, `2.1`; rounding alone is `0`.
fn exponent(value: f64) -> String {
    if value == 0.0 {
        "0".to_owned()
    } else if (1e-2..1e3).contains(&value) {
        significant(value, 2)
    } else {
        format!("{value:.1e}")
    }
}

/// How a phase ended if it did not reach its end.
pub(super) fn end(phase: &Phase) -> &'static str {
    match phase.end {
        End::Reached => "",
        End::Capped => "capped",
        End::Stopped(_) | End::Refused(_) => "stopped",
    }
}

/// Description of the reference, a line each.
pub(super) fn reference(reference: &ReferenceSolution) -> Vec<(&'static str, String)> {
    let ms = |time: f64| format!("{} ms", significant(1e3 * time, 5));
    let floor = &reference.floor;
    let names: Vec<&str> = reference.slots.iter().map(|slot| joint(reference, slot.joint)).collect();
    let mut lines = vec![
        (
            "Reference",
            format!(
                "{} at {:e}; at half of it the peaks change by {}, the position by {} m, settled forces by {}",
                reference.setting.method,
                reference.setting.tolerance,
                exponent(floor.peak.unwrap_or(0.0)),
                exponent(floor.position_m.unwrap_or(0.0)),
                floor.settled.map_or_else(|| "-".to_owned(), exponent),
            ),
        ),
        (
            "First impacts",
            if reference.impacts == 0 {
                format!("none: the largest reactions of {} within {}", names.join(", "), ms(reference.span))
            } else {
                format!("{} within {}: {}", reference.impacts, ms(reference.span), names.join(", "))
            },
        ),
    ];
    lines.push((
        "Position",
        match reference.instant_impact {
            0 => format!("at {}", ms(reference.instant)),
            n => format!("at impact {n}, {}", ms(reference.instant)),
        },
    ));
    lines.push((
        "Settled",
        match &reference.settled {
            Some(span) => format!(
                "mean contact forces from {} to {}, all methods from the same state",
                ms(span.from),
                ms(span.to)
            ),
            None => "its contacts do not stay closed for 150 ms within the first 1.2 s: nothing to average".to_owned(),
        },
    ));
    lines
}

fn joint(reference: &ReferenceSolution, index: usize) -> &str {
    let joint = reference.scene().machine.ball_joints.get(index);
    joint.map_or("-", |joint| joint.name.as_str())
}

/// The whole result as text.
pub(super) fn text(found: &WorkPrecision) -> String {
    let mut out = String::new();
    let mut line = |label: &str, value: &str| {
        // Writing to a String cannot fail.
        let _ = writeln!(out, "{label:<18}{value}");
    };
    line("Scene", &found.reference.scene().name);
    for (key, value) in &found.reference.scene().changes {
        line("  changed", &format!("{key} = {value}"));
    }
    line("Machine", &machine::name());
    for (label, value) in reference(&found.reference) {
        line(label, &value);
    }
    line("Speed", "simulated seconds in a second of stepping");
    line("Ratio", "speed over that of rk4 at 10 us on the same span");
    line("*", "nothing else is both faster and more accurate");
    out.push('\n');
    let floor = &found.reference.floor;
    out.push_str("First impacts\n");
    out += &phase_table(
        found,
        |point| Some(&point.impacts),
        &["peak error", "position error (m)", "energy error"],
        |Point { errors, .. }| {
            vec![error(errors.peak, floor.peak), error(errors.position_m, floor.position_m), error(errors.energy, None)]
        },
    );
    if found.reference.settled.is_some() {
        out.push_str("\nSettled motion\n");
        out += &phase_table(
            found,
            |point| point.settled.as_ref(),
            &["force error"],
            |point| vec![error(point.errors.settled, floor.settled)],
        );
    }
    for point in &found.points {
        if let Some(why) = point.impacts.end.fault() {
            let _ = writeln!(out, "{} {}: {why}", point.setting.method, value(&point.setting));
        }
    }
    out.push('\n');
    out
}

/// A table of the points in one phase: settings, speeds and work, the errors under the head `errors`, and how the phase ended.
fn phase_table(
    found: &WorkPrecision,
    phase: impl Fn(&Point) -> Option<&Phase>,
    errors: &[&str],
    error: impl Fn(&Point) -> Vec<String>,
) -> String {
    let mut head =
        "method,value,preset,speed,ratio,steps,evaluations,rejected".split(',').map(str::to_owned).collect::<Vec<_>>();
    head.extend(errors.iter().map(|&name| name.to_owned()));
    head.push(String::new());
    let mut rows = vec![head];
    for point in &found.points {
        let Some(phase) = phase(point) else {
            continue;
        };
        let mut row = vec![
            point.setting.method.word().to_owned(),
            value(&point.setting),
            point.preset.map_or("", |preset| preset.word()).to_owned(),
            times(phase.speed()),
            times(phase.ratio),
            phase.steps.to_string(),
            phase.evaluations.to_string(),
            phase.rejected.to_string(),
        ];
        row.extend(error(point));
        row.push(if phase.front { "*" } else { end(phase) }.to_owned());
        rows.push(row);
    }
    grid(&rows)
}

/// Costs of the parts of the model as text.
pub(super) fn costs(costs: &[CaseCost]) -> String {
    let head = ["scene", "with", "an evaluation", "a simulated second"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    rows.extend(cost_rows(costs));
    format!("Cost of the parts of the model, the first row being 1\n{}", grid(&rows))
}

/// Scene and name of each part, with its costs per evaluation and per simulated second relative to those of the first.
pub(super) fn cost_rows(costs: &[CaseCost]) -> Vec<Vec<String>> {
    let row = |cost: &CaseCost| {
        let first = &costs[0];
        vec![
            cost.part.scene.to_owned(),
            cost.part.label.to_owned(),
            times(Some(cost.evaluation_s / first.evaluation_s)),
            times(Some(cost.cost / first.cost)),
        ]
    };
    costs.iter().map(row).collect()
}

/// Aligns rows of cells in columns, the first row being the head: numbers to the right, words to the left.
pub fn grid(rows: &[Vec<String>]) -> String {
    let is_number = |text: &str| {
        let first = text.chars().next();
        text == "-" || first.is_none_or(|c| c.is_ascii_digit() || c == '<')
    };
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let looks = (0..columns).map(|c| {
        let width = rows.iter().filter_map(|row| row.get(c)).map(|text| text.chars().count());
        let mut body = rows.iter().skip(1).filter_map(|row| row.get(c));
        let right = rows.len() > 1 && body.all(|text| is_number(text));
        (width.max().unwrap_or(0), right)
    });
    let looks: Vec<(usize, bool)> = looks.collect();
    let mut out = String::new();
    for row in rows {
        let mut line = String::new();
        for (text, (width, right)) in row.iter().zip(&looks) {
            // Writing to a String cannot fail.
            let _ = if *right { write!(line, "{text:>width$}  ") } else { write!(line, "{text:<width$}  ") };
        }
        out.push_str(line.trim_end());
        out.push('\n');
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up() {
        let rows = [["a", "number"], ["word", "1"], ["b", "-"]];
        let rows: Vec<Vec<String>> = rows.iter().map(|row| row.map(str::to_owned).to_vec()).collect();
        assert_eq!(grid(&rows), "a     number\nword       1\nb          -\n");
    }

    #[test]
    fn an_error_below_the_floor_says_so() {
        assert_eq!(error(Some(3e-9), Some(1e-8)), "< 1.0e-8");
        assert_eq!(error(Some(3.14e-5), Some(1e-8)), "3.1e-5");
        assert_eq!(error(Some(0.0314), None), "0.031");
        assert_eq!(error(None, Some(1.0)), "-");
        assert_eq!(percent(Some(0.01234)), "1.2 %");
    }
}
