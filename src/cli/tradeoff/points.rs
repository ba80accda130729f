//! Measurements as tables and lines, for terminal and page.

use crate::analysis::{CaseCost, End, Phase, Point, ReferenceSolution, Setting, WorkPrecision};
use crate::cli::machine;
use crate::cli::output::significant;
use crate::cli::tables::{self, Table};
use crate::integrate::StepControl;
use crate::units::format_quantity;

/// A factor with three digits, `-` if there is none.
pub fn times(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| significant(value, 3))
}

/// A relative error as a percentage with two digits.
pub fn percent(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{} %", significant(100.0 * value, 2)))
}

/// A step with its unit, a tolerance, or a number of steps per impact.
pub fn value(setting: &Setting) -> String {
    match setting.method.control() {
        StepControl::Fixed => format_quantity(setting.step_s, "us"),
        StepControl::Error => format!("{:e}", setting.tolerance),
        StepControl::PerImpact => setting.steps_per_impact.to_string(),
    }
}

/// An error with two digits; one below `floor` is shown as less than `floor`.
pub(super) fn error(value: Option<f64>, floor: Option<f64>) -> String {
    match (value, floor) {
        (None, _) => "-".to_owned(),
        (Some(value), Some(floor)) if value <= floor => format!("< {}", exponent(floor)),
        (Some(value), _) => exponent(value),
    }
}

/// Formats an error with two digits: `4.3e-5`, `0.031`, `2.1`; exactly 0 is `0`.
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

/// Lines about the reference and about settings that failed.
pub(super) fn facts(results: &WorkPrecision) -> Vec<(&'static str, String)> {
    let ms = |time: f64| format!("{} ms", significant(1e3 * time, 5));
    let ReferenceSolution { setting, floor, slots, impacts, span, instant, instant_impact, settled, .. } =
        &results.reference;
    let joints = &results.reference.scene().machine.ball_joints;
    let names = slots.iter().map(|slot| joints.get(slot.joint).map_or("-", |joint| joint.name.as_str()));
    let names = names.collect::<Vec<_>>().join(", ");
    let refused = results.points.iter().filter(|point| point.impacts.end.fault().is_some());
    let refused = refused.map(|point| format!("{} {}", point.setting.method, value(&point.setting)));
    let [peak, position, force] = [floor.peak, floor.position_m, floor.settled].map(|change| error(change, None));
    vec![
        ("Reference", format!("{} at {:e}", setting.method, setting.tolerance)),
        ("Change at half the tolerance", format!("peaks {peak}, position {position} m, settled forces {force}")),
        match impacts {
            0 => ("Largest reactions", format!("within {}: {names}", ms(*span))),
            _ => ("First impacts", format!("{impacts} within {}: {names}", ms(*span))),
        },
        match instant_impact {
            0 => ("Position", format!("at {}", ms(*instant))),
            n => ("Position", format!("at impact {n}, {}", ms(*instant))),
        },
        match settled {
            Some(span) => ("Settled", format!("from {} to {}", ms(span.from), ms(span.to))),
            None => ("Settled", "never: contacts do not stay closed for 150 ms within the first 1.2 s".to_owned()),
        },
        ("Stopped or refused", refused.reduce(|all, one| format!("{all}, {one}")).unwrap_or_else(|| "-".to_owned())),
    ]
}

/// The whole result as text.
pub(super) fn text(results: &WorkPrecision) -> String {
    let scene = results.reference.scene();
    let mut values = vec![("Scene", scene.name.clone())];
    values.extend(scene.changes.iter().map(|(key, value)| ("  changed", format!("{key} = {value}"))));
    values.push(("Machine", machine::name()));
    values.extend(facts(results));
    let terms = [
        ("Speed", "simulated seconds in a second of stepping"),
        ("Ratio", "speed over that of rk4 at 10 us on the same span"),
        ("*", "no other setting is both faster and more accurate"),
    ];
    values.extend(terms.map(|(label, meaning)| (label, meaning.to_owned())));
    let mut out = tables::lines(values);
    let impacts =
        phase_table(results, |point| Some(&point.impacts), "peak error | position error (m) | energy error", 0..3);
    out += &format!("\n{}", impacts.with_title("First impacts").text());
    if results.reference.settled.is_some() {
        let settled = phase_table(results, |point| point.settled.as_ref(), "force error", 3..4);
        out += &format!("\n{}", settled.with_title("Settled motion").text());
    }
    for point in &results.points {
        if let Some(why) = point.impacts.end.fault() {
            out += &format!("{} {}: {why}\n", point.setting.method, value(&point.setting));
        }
    }
    out + "\n"
}

/// Errors of a point in peaks, position, energy and settled forces.
pub(super) fn errors(results: &WorkPrecision, point: &Point) -> [String; 4] {
    let (errors, floor) = (&point.errors, &results.reference.floor);
    [
        error(errors.peak, floor.peak),
        error(errors.position_m, floor.position_m),
        error(errors.energy, None),
        error(errors.settled, floor.settled),
    ]
}

/// The points in one phase: settings, speeds, work, errors of that phase, and how it ended.
fn phase_table(
    results: &WorkPrecision,
    phase: fn(&Point) -> Option<&Phase>,
    heads: &str,
    own: std::ops::Range<usize>,
) -> Table {
    let row = |point: &Point| {
        let phase = phase(point)?;
        let mut row = vec![
            point.setting.method.to_string(),
            value(&point.setting),
            point.preset.map_or("", |preset| preset.word()).to_owned(),
            times(phase.speed()),
            times(phase.ratio),
        ];
        row.extend([phase.steps, phase.evaluations, phase.rejected].map(|count| count.to_string()));
        row.extend_from_slice(&errors(results, point)[own.clone()]);
        row.push(if phase.front { "*" } else { end(phase) }.to_owned());
        Some(row)
    };
    let heads = format!("method | value | preset | speed | ratio | steps | evaluations | rejected | {heads} | ");
    Table::new(&heads, results.points.iter().filter_map(row))
}

/// Costs of the parts of the model per evaluation and per simulated second, relative to those of the first.
pub(super) fn costs(costs: &[CaseCost]) -> Table {
    let row = |cost: &CaseCost| {
        let (first, part) = (&costs[0], &cost.part);
        let relative = [cost.evaluation_s / first.evaluation_s, cost.cost / first.cost];
        [&[part.scene.to_owned(), part.label.to_owned()], &relative.map(|cost| times(Some(cost)))[..]].concat()
    };
    let table = Table::new("Scene | With | An evaluation | A simulated second", costs.iter().map(row));
    table.with_title("Cost of the parts of the model, the first row being 1")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_below_the_floor_is_marked() {
        assert_eq!(error(Some(3e-9), Some(1e-8)), "< 1.0e-8");
        assert_eq!(error(Some(3.14e-5), Some(1e-8)), "3.1e-5");
        assert_eq!(error(Some(0.0314), None), "0.031");
        assert_eq!(error(None, Some(1.0)), "-");
        assert_eq!(percent(Some(0.01234)), "1.2 %");
    }
}
