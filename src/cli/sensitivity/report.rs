//! The results as text, JSON, tables and charts.

use std::path::Path;

use serde_json::{Map, Value as Json, json};

use super::picture;
use crate::analysis::indices::IndicesError;
use crate::analysis::study::{Change, Input, Output, Sensitivity, StudyRunner as _, TargetAnswer};
use crate::analysis::yields::Estimate;
use crate::cli::Failure;
use crate::cli::args::SensitivityArguments;
use crate::cli::output::significant;
use crate::cli::study::{
    Study, display_value, display_value_digits, distinguishing_digits, estimate, number, value_of,
};
use crate::cli::summary::count;
use crate::cli::tables::{Table, quoted};
use crate::files::Folder;

/// Writes all files into `folder`; returns their provenance.
pub fn fill(
    folder: &Folder,
    study: &Study,
    results: &Sensitivity,
    arguments: &SensitivityArguments,
) -> Result<Map<String, Json>, Failure> {
    let mut meta = study.meta();
    meta.insert("over".into(), json!(arguments.over));
    meta.insert("rows".into(), json!(arguments.rows));
    study.write(
        folder,
        "sensitivity",
        &meta,
        json(study, results),
        &table(study, results),
        &picture::sheet(study, results),
    )?;
    Ok(meta)
}

fn interval(estimate: Option<&Estimate>) -> String {
    // Adding 0 turns -0 into 0.
    let hundredths = |value: f64| format!("{:.2}", (100.0 * value).round() / 100.0 + 0.0);
    let [value, low, high] = match estimate {
        Some(e) => [e.value, e.low, e.high].map(hundredths),
        None => return "-".to_owned(),
    };
    format!("{value} ({low} to {high})")
}

/// For a terminal.
pub fn text(study: &Study, results: &Sensitivity, out: &Path) -> String {
    let mut text = format!(
        "Scene             {}: runs of {}\n{}Runs              {}\n",
        study.scene().name,
        study.describe(),
        study.assumption_lines(),
        study.run_count_text(),
    );
    if let Some(screening) = &results.screening {
        let first = &study.outputs()[0];
        let rows = study.inputs().iter().zip(&screening.effects).enumerate().map(|(i, (input, effects))| {
            let number = |of: fn(&crate::analysis::morris::ElementaryEffects) -> f64| {
                effects.as_ref().map_or_else(|| "-".to_owned(), |effects| display_value(of(effects), first.unit))
            };
            let kept = if screening.kept.contains(&i) { "kept" } else { "left out" };
            vec![
                input.key.clone(),
                number(|e| e.mean_magnitude),
                number(|e| e.mean),
                number(|e| e.deviation),
                kept.to_owned(),
            ]
        });
        let heads = "parameter | mean size of effect | mean effect | deviation | for the indices";
        text += &format!("\nScreening of {}, from end to end of each parameter\n", first.name);
        text += &Table::new(heads, rows).text();
    }
    for (o, output) in study.outputs().iter().enumerate() {
        let nominal = results.alone.nominal[o];
        let ends = results.alone.ends.iter().flatten().map(|(_, outputs)| outputs);
        let digits = distinguishing_digits(nominal, ends.chain(&results.alone.together).map(|outputs| outputs[o]));
        let cell = |outputs: &[f64]| display_value_digits(outputs[o], output.unit, digits);
        text += &format!("\n{}: {} with the values of the scene\n", output.name, cell(&results.alone.nominal));
        let mut rows: Vec<Vec<String>> = (0..study.inputs().len()).map(|i| line(study, results, o, i, &cell)).collect();
        let [low, high] = results.alone.together.each_ref().map(|outputs| cell(outputs));
        rows.push(vec![
            "all together".into(),
            "lower ends".into(),
            low,
            "upper ends".into(),
            high,
            "-".into(),
            "-".into(),
        ]);
        let heads = "parameter | from | output alone | to | output alone | first-order | total";
        text += &Table::new(heads, rows).text();
        match &results.indices[o] {
            Some(Err(IndicesError::NoVariance { value })) => {
                let value = display_value(*value, output.unit);
                text += &format!("No indices: the result is {value} for all inputs, so its variance is 0\n");
            }
            Some(Err(error)) => text += &format!("No indices: {error}\n"),
            Some(Ok(indices)) => {
                text += &format!(
                    "Indices from {}{}; mean {}, standard deviation {}; intervals of 95 %\n",
                    count(indices.rows as u64, "row"),
                    if indices.incomplete_rows > 0 {
                        format!(", {} left out", indices.incomplete_rows)
                    } else {
                        String::new()
                    },
                    display_value(indices.mean, output.unit),
                    display_value(indices.variance.sqrt(), output.unit),
                );
            }
            None => {}
        }
    }
    if let Some(answer) = &results.target {
        text += &format!("\n{}\n", sentence(study, answer));
    }
    text + &format!("\nWritten           {}\nVersion           jointplay {}\n", out.display(), crate::VERSION)
}

/// Row of parameter `i` in the table of output `o`; `cell` formats a value of it.
fn line(study: &Study, results: &Sensitivity, o: usize, i: usize, cell: &impl Fn(&[f64]) -> String) -> Vec<String> {
    let input = &study.inputs()[i];
    let [(low, at_low), (high, at_high)] = &results.alone.ends[i];
    let indices = results.indices_of(o);
    let at = results.index_of(i);
    let [first, total] = match (indices, at) {
        (Some(indices), Some(at)) => [Some(&indices.first[at]), Some(&indices.total[at])],
        _ => [None, None],
    };
    vec![
        input.key.clone(),
        value_of(input, *low),
        cell(at_low),
        value_of(input, *high),
        cell(at_high),
        interval(first),
        interval(total),
    ]
}

/// The answer to `--target` in words.
fn sentence(study: &Study, answer: &TargetAnswer) -> String {
    let output = &study.outputs()[0];
    let goal = format!("{} of at most {}", output.name, display_value(answer.target, output.unit));
    let change = |change: &Change| {
        let input = &study.inputs()[change.input];
        format!("{} = {}", input.key, value_of(input, change.value))
    };
    if !answer.single.is_empty() {
        let ways = answer
            .single
            .iter()
            .map(|(one, value)| format!("  {} alone gives {}\n", change(one), display_value(*value, output.unit)));
        return format!("{goal} is reached by one of\n{}", ways.collect::<String>().trim_end());
    }
    match &answer.together {
        Some((changes, value)) if changes.is_empty() => {
            format!("{goal} is already met by the values of the scene: {}", display_value(*value, output.unit))
        }
        Some((changes, value)) => {
            let changes: Vec<String> = changes.iter().map(change).collect();
            format!(
                "{goal} requires several changes together: {}, which give {}",
                changes.join(", "),
                display_value(*value, output.unit)
            )
        }
        None => format!("{goal} is not reached within the ranges"),
    }
}

/// Everything but the runs, SI.
pub fn json(study: &Study, results: &Sensitivity) -> Json {
    let of_output = |(o, output): (usize, &Output)| {
        let indices = results.indices_of(o);
        let of_input = |(i, input): (usize, &Input)| {
            let [(low, at_low), (high, at_high)] = &results.alone.ends[i];
            let at = results.index_of(i);
            let own = indices.zip(at);
            json!({
                "key": input.key,
                "value": input.nominal,
                "low": low, "high": high,
                "alone_low": number(at_low[o]), "alone_high": number(at_high[o]),
                "first_order": own.map(|(indices, at)| estimate(&indices.first[at])),
                "total": own.map(|(indices, at)| estimate(&indices.total[at])),
            })
        };
        json!({
            "name": output.name,
            "unit": output.unit,
            "value": number(results.alone.nominal[o]),
            "all_low": number(results.alone.together[0][o]),
            "all_high": number(results.alone.together[1][o]),
            "parameters": study.inputs().iter().enumerate().map(of_input).collect::<Vec<_>>(),
            "rows": indices.map(|indices| indices.rows),
            "incomplete_rows": indices.map(|indices| indices.incomplete_rows),
            "mean": indices.map(|indices| indices.mean),
            "variance": indices.map(|indices| indices.variance),
        })
    };
    let change = |one: &Change| json!({"key": study.inputs()[one.input].key, "value": one.value});
    let target = results.target.as_ref().map(|answer| {
        json!({
            "target": answer.target,
            "single": answer.single.iter().map(|(one, value)| json!({"change": change(one), "output": value})).collect::<Vec<_>>(),
            "together": answer.together.as_ref().map(|(changes, value)| {
                json!({"changes": changes.iter().map(change).collect::<Vec<_>>(), "output": value})
            }),
        })
    });
    let screening = results.screening.as_ref().map(|screening| {
        let effects = study.inputs().iter().zip(&screening.effects).map(|(input, effects)| {
            json!({
                "key": input.key,
                "mean": effects.map(|e| e.mean), "mean_magnitude": effects.map(|e| e.mean_magnitude),
                "deviation": effects.map(|e| e.deviation),
            })
        });
        effects.collect::<Vec<_>>()
    });
    json!({
        "outputs": study.outputs().iter().enumerate().map(of_output).collect::<Vec<_>>(),
        "screening": screening,
        "target": target,
        "runs": study.runs().len(),
    })
}

/// One row per output and parameter, SI.
fn table(study: &Study, results: &Sensitivity) -> String {
    let mut out = String::from(
        "output,unit,parameter,parameter_unit,low,high,alone_low,alone_high,first_order,first_order_low,first_order_high,total,total_low,total_high\n",
    );
    for (o, output) in study.outputs().iter().enumerate() {
        let indices = results.indices_of(o);
        for (i, input) in study.inputs().iter().enumerate() {
            let [(low, at_low), (high, at_high)] = &results.alone.ends[i];
            let own = indices.zip(results.index_of(i));
            let both = own.map_or([None, None], |(indices, at)| [Some(indices.first[at]), Some(indices.total[at])]);
            let estimates = both.into_iter().flat_map(|e| e.map_or([f64::NAN; 3], |e| [e.value, e.low, e.high]));
            let numbers = [*low, *high, at_low[o], at_high[o]].into_iter().chain(estimates);
            let cells: Vec<String> = numbers.map(|value| significant(value, 12)).collect();
            let heads = [quoted(&output.name), output.unit.to_owned(), quoted(&input.key), input.si_unit.to_owned()];
            out += &format!("{},{}\n", heads.join(","), cells.join(","));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_index_that_rounds_to_0_has_no_sign() {
        let estimate = Estimate { value: -1e-9, low: -0.014, high: 0.236 };
        assert_eq!(interval(Some(&estimate)), "0.00 (-0.01 to 0.24)");
        assert_eq!(interval(None), "-");
    }
}
