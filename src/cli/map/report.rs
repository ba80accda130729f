//! The summary of a map, as text or as JSON.

use std::path::PathBuf;

use serde_json::{Map, Value as Json, json};

use super::results::{REACHABLE, Results, SETTLED};
use crate::cli::tables::Table;
use crate::machine::Vec3;
use crate::units::format_quantity_digits;

/// The points to be shown, by their rank.
fn notable(results: &Results) -> Vec<(&'static str, usize)> {
    let ranked = results.ranked();
    match ranked[..] {
        [] => Vec::new(),
        [only] => vec![("only", only)],
        [best, worst] => vec![("worst", worst), ("best", best)],
        [best, .., worst] => vec![("worst", worst), ("median", ranked[ranked.len() / 2]), ("best", best)],
    }
}

/// For a terminal.
pub fn text(results: &Results, out: &[PathBuf]) -> String {
    let [no_pose, no_rest, unbounded] = results.counts();
    let all = results.points.len();
    let mut text = format!("Scene             {}\nPoints            {all}", results.map.scene().name);
    for (number, what) in
        [(no_pose, "without a pose of the machine without play"), (no_rest, "without a position of rest")]
    {
        if number > 0 {
            text += &format!(", {number} {what}");
        }
    }
    text += "\n";
    let first = |is: &dyn Fn(usize) -> bool| (0..all).find(|&point| is(point));
    if let Some((point, Err(fault))) = first(&|p| results.points[p].is_err()).map(|p| (p, &results.points[p])) {
        text += &format!("No pose, first at {}: {fault}\n", results.describe(point));
    }
    if let Some(point) = first(&|p| results.points[p].as_ref().is_ok_and(|at_point| at_point.settled.is_err()))
        && let Ok(Err(fault)) = results.points[point].as_ref().map(|at_point| &at_point.settled)
    {
        text += &format!("No rest, first at {}: {fault}\n", results.describe(point));
    }
    if let Some(point) = first(&|p| !results.unbounded(p).is_empty()) {
        let directions: Vec<String> = results.unbounded(point).iter().map(direction).collect();
        text += &format!(
            "Unbounded         at {unbounded} points the tip moves without play although the drives are held, at the first along {}; \
             errors are those across these directions\n",
            directions.join(" and ")
        );
    }
    text += &format!("Settled error     {SETTLED}\nLargest error     of {REACHABLE}\n\n");
    let joints = &results.map.scene().machine.loose_joints;
    let rows = notable(results).into_iter().map(|(which, point)| {
        let largest = results.largest(point).norm();
        let settled = results.settled(point).norm();
        let ratio =
            if settled.is_nan() || largest == 0.0 { "-".to_owned() } else { format!("{:.2}", settled / largest) };
        let joint = results.largest_joint(point).map_or_else(
            || "-".to_owned(),
            |joint| {
                let shares = results.shares(point);
                let part = 100.0 * shares[joint] / shares.iter().sum::<f64>();
                format!("{} ({part:.0} %)", joints[joint].name)
            },
        );
        let along = results.largest_direction(point);
        let along = if along.x.is_nan() { "-".to_owned() } else { direction(&along) };
        vec![which.to_owned(), results.describe(point), length(largest), along, length(settled), ratio, joint]
    });
    text += &Table::new("point | at | largest error | along | settled | ratio | most from", rows).text();
    for path in out {
        text += &format!("Written           {}\n", path.display());
    }
    text + &format!("Version           jointplay {}\n", crate::VERSION)
}

fn length(si: f64) -> String {
    if si.is_nan() { "-".to_owned() } else { format_quantity_digits(si, "mm", 4) }
}

fn direction(v: &Vec3) -> String {
    let part = |x: f64| format!("{:.2}", if x.abs() < 5e-3 { 0.0 } else { x });
    format!("({}, {}, {})", part(v.x), part(v.y), part(v.z))
}

/// For programs, SI.
pub fn json(results: &Results, out: &[PathBuf]) -> Map<String, Json> {
    let mut all = results.meta();
    let [no_pose, no_rest, unbounded] = results.counts();
    all.insert("status".into(), json!("done"));
    all.insert("points".into(), json!(results.points.len()));
    all.insert("no_pose".into(), json!(no_pose));
    all.insert("no_rest".into(), json!(no_rest));
    all.insert("unbounded".into(), json!(unbounded));
    let joints = &results.map.scene().machine.loose_joints;
    for (which, point) in notable(results) {
        let indices = results.map.design().indices(point);
        let at = results.map.design().axes().iter().zip(indices).map(|(axis, i)| {
            let word = axis.words().map(|words| json!(words[i]));
            (axis.key().to_owned(), word.unwrap_or_else(|| json!(axis.number(i))))
        });
        let entry = json!({
            "point": point,
            "at": Json::Object(at.collect()),
            "ideal_tip_m": results.ideal_tip(point).as_slice(),
            "largest_error_m": results.largest(point).as_slice(),
            "largest_direction": results.largest_direction(point).as_slice(),
            "largest_joint": results.largest_joint(point).map(|joint| &joints[joint].name),
            "share_m": joints.iter().zip(results.shares(point)).map(|(joint, share)| (joint.name.clone(), json!(share)))
                .collect::<Map<_, _>>(),
            "settled_error_m": results.settled(point).as_slice(),
        });
        all.insert(which.into(), entry);
    }
    all.insert("out".into(), out.iter().map(|path| json!(path.display().to_string())).collect());
    all
}
