//! The results as text, JSON and a table.

use serde_json::{Map, Value as Json, json};

use super::limit::describe;
use crate::analysis::lot::{Limit, PERCENTILES, Quality};
use crate::analysis::study::{CheapestFits, FitVerdict, Output, StudyRunner as _, Tolerance};
use crate::analysis::yields::{Estimate, RejectDriver};
use crate::cli::args::ToleranceArguments;
use crate::cli::output::significant;
use crate::cli::study::{Study, display_value, estimate, number};
use crate::cli::summary::count;
use crate::cli::tables::{Table, quoted};

/// Provenance of the files.
pub fn meta(study: &Study, arguments: &ToleranceArguments) -> Map<String, Json> {
    let mut meta = study.meta();
    let file = |path: &Option<std::path::PathBuf>| path.as_ref().map(|path| path.display().to_string());
    meta.insert("limit".into(), json!(arguments.limit));
    meta.insert("tolerances".into(), json!(file(&arguments.tolerances)));
    meta.insert("over".into(), json!(arguments.over));
    meta.insert("cost".into(), json!(file(&arguments.cost)));
    meta.insert("sampling".into(), json!(arguments.sampling));
    meta.insert("lot".into(), json!(arguments.runs));
    meta
}

fn percent(part: f64) -> String {
    display_value(100.0 * part, "%")
}

fn with_interval(part: &Estimate) -> String {
    format!("{} ({} to {})", percent(part.value), percent(part.low), percent(part.high))
}

/// Name of a statistic for people and for programs, its unit, and its value, with an interval where one is known.
type Statistic = (String, String, &'static str, Option<Estimate>);

fn statistics(output: &Output, quality: &Quality) -> Vec<Statistic> {
    let bare = |value: f64| Some(Estimate { value, low: f64::NAN, high: f64::NAN });
    let mut all = vec![
        ("mean".to_owned(), "mean".to_owned(), output.unit, bare(quality.mean)),
        ("standard deviation".to_owned(), "deviation".to_owned(), output.unit, bare(quality.deviation)),
    ];
    for (p, value) in PERCENTILES.iter().zip(&quality.percentiles) {
        let p = 100.0 * p;
        all.push((format!("{p:.0}th percentile"), format!("percentile_{p:.0}"), output.unit, *value));
    }
    let capability = quality.capability.as_ref();
    if let Some(cp) = capability.and_then(|capability| capability.cp) {
        all.push(("Cp".to_owned(), "cp".to_owned(), "", bare(cp)));
    }
    all.push(("Cpk".to_owned(), "cpk".to_owned(), "", capability.map(|capability| capability.cpk)));
    all
}

/// Number of units of the lot that did not start, or diverged.
fn without_result(outcome: &Tolerance) -> usize {
    outcome.lot.outputs.iter().filter(|outputs| outputs.iter().any(|value| !value.is_finite())).count()
}

/// Indices of the parameters, the one that differs most between rejects and accepted units first.
fn order(drivers: &[RejectDriver]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..drivers.len()).collect();
    order.sort_by(|&a, &b| drivers[b].distance.total_cmp(&drivers[a].distance));
    order
}

/// For a terminal.
pub fn text(study: &Study, limits: &[Limit], outcome: &Tolerance, arguments: &ToleranceArguments) -> String {
    let units = outcome.lot.accepted.len();
    let rejects = outcome.lot.accepted.iter().filter(|accepted| !**accepted).count();
    let mut text = format!(
        "Scene             {}: runs of {}\n{}Runs              {}\nLot               {}, {} rejected\n\
         Yield             {}, interval of 95 %\n",
        study.scene().name,
        study.describe(),
        study.assumption_lines(),
        study.run_count_text(),
        count(units as u64, "unit"),
        rejects,
        with_interval(&outcome.lot.yield_estimate),
    );
    let lost = without_result(outcome);
    if lost > 0 {
        text += &format!("Statistics        of the {} with a result\n", count((units - lost) as u64, "unit"));
    }
    for ((output, limit), quality) in study.outputs().iter().zip(limits).zip(&outcome.qualities) {
        text += &format!(
            "\n{} {}: {} of the lot\n",
            output.name,
            describe(limit, output.unit),
            with_interval(&quality.yield_estimate)
        );
        let rows = statistics(output, quality).into_iter().map(|(name, _, unit, value)| {
            let number = |of: fn(&Estimate) -> f64| {
                value.as_ref().map_or("-".to_owned(), |value| display_value(of(value), unit))
            };
            vec![name, number(|e| e.value), number(|e| e.low), number(|e| e.high)]
        });
        text += &Table::new("statistic | value | 95 % from | to", rows).text();
    }
    text += &match &outcome.drivers {
        Some(drivers) => {
            let rows = order(drivers).into_iter().map(|i| {
                let driver = &drivers[i];
                vec![
                    study.inputs()[i].key.clone(),
                    display_value(driver.mean_shift, ""),
                    format!("{:.2}", driver.distance),
                    p_value(driver.p_value),
                ]
            });
            let heads = "parameter | mean of the rejects off by (deviations) | Kolmogorov-Smirnov distance | p-value";
            format!("\nWhat drives the rejects\n{}", Table::new(heads, rows).text())
        }
        None if rejects == 0 => "\nNo rejects\n".to_owned(),
        None => "\nAll units are rejected, so nothing shows what drives the rejects\n".to_owned(),
    };
    if let Some(cheapest) = &outcome.cheapest {
        text += &fits(study, cheapest);
    }
    text + &format!(
        "\nWritten           {}\nVersion           jointplay {}\n",
        arguments.study.out.display(),
        crate::VERSION
    )
}

fn p_value(p: f64) -> String {
    if p < 1e-4 { "<0.0001".to_owned() } else { format!("{p:.4}") }
}

/// The cheapest fits in words.
fn fits(study: &Study, cheapest: &CheapestFits) -> String {
    let required = percent(cheapest.options.required_yield);
    let search = &cheapest.search;
    let effort = count(search.evaluations as u64, "choice");
    let mut text = String::new();
    match &search.best {
        None => {
            text += &format!("\nNo choice of fits holds a yield of {required}: the tightest do not ({effort} tried)\n");
        }
        Some(best) => {
            let proof = if search.is_proven {
                "proven the cheapest if a tighter fit never lowers the yield".to_owned()
            } else {
                format!("not proven the cheapest: --evaluations {} ended the search", cheapest.options.evaluations)
            };
            text += &format!("\nFits for a yield of {required}: cost {}, {proof}; {effort} tried\n", best.cost);
            let rows = cheapest.options.candidates.iter().zip(&best.candidates).map(|(of, &chosen)| {
                let one = &of.list[chosen];
                vec![study.inputs()[of.input].key.clone(), one.text.clone(), one.cost.to_string()]
            });
            text += &Table::new("parameter | fit | cost", rows).text();
            text += &format!("Yield {} in the lot of the search\n", with_interval(&best.estimate));
        }
    }
    if let Some((check, verdict)) = &cheapest.check {
        let verdict = match verdict {
            FitVerdict::Held => "it holds",
            FitVerdict::Missed => "it does not hold",
            FitVerdict::Open => "too few runs to tell whether it holds",
        };
        text += &format!("Yield {} in another lot: {verdict}\n", with_interval(check));
    }
    for of in cheapest.options.candidates.iter().filter(|of| !of.is_ordered()) {
        text += &format!(
            "The order of the candidates of {} is not checked: a distribution without limits has no width\n",
            study.inputs()[of.input].key
        );
    }
    text
}

/// Everything but the runs, SI.
pub fn json(study: &Study, limits: &[Limit], outcome: &Tolerance) -> Json {
    let of_output = |((output, limit), quality): ((&Output, &Limit), &Quality)| {
        let mut all = Map::new();
        all.insert("name".into(), json!(output.name));
        all.insert("unit".into(), json!(output.unit));
        all.insert("lower".into(), json!(limit.lower));
        all.insert("upper".into(), json!(limit.upper));
        all.insert("yield".into(), estimate(&quality.yield_estimate));
        for (_, name, _, value) in statistics(output, quality) {
            let plain = value.is_some_and(|value| value.low.is_nan());
            let value = value.map(|value| if plain { number(value.value) } else { estimate(&value) });
            all.insert(name, json!(value));
        }
        all
    };
    let outputs = study.outputs().iter().zip(limits).zip(&outcome.qualities).map(of_output);
    let drivers = outcome.drivers.as_ref().map(|drivers| {
        let of_input = |i: usize| {
            let driver = &drivers[i];
            json!({
                "key": study.inputs()[i].key,
                "mean_shift": number(driver.mean_shift),
                "distance": number(driver.distance),
                "p_value": number(driver.p_value),
            })
        };
        order(drivers).into_iter().map(of_input).collect::<Vec<_>>()
    });
    json!({
        "units": outcome.lot.accepted.len(),
        "accepted": outcome.lot.accepted.iter().filter(|accepted| **accepted).count(),
        "without_result": without_result(outcome),
        "yield": estimate(&outcome.lot.yield_estimate),
        "outputs": outputs.collect::<Vec<_>>(),
        "reject_drivers": drivers,
        "fits": outcome.cheapest.as_ref().map(|cheapest| fits_json(study, cheapest)),
        "runs": study.runs().len(),
    })
}

fn fits_json(study: &Study, cheapest: &CheapestFits) -> Json {
    let best = cheapest.search.best.as_ref().map(|best| {
        let fits = cheapest.options.candidates.iter().zip(&best.candidates).map(|(of, &chosen)| {
            let one = &of.list[chosen];
            json!({"key": study.inputs()[of.input].key, "fit": one.text, "cost": one.cost})
        });
        json!({"cost": best.cost, "fits": fits.collect::<Vec<_>>(), "yield": estimate(&best.estimate)})
    });
    let unchecked =
        cheapest.options.candidates.iter().filter(|of| !of.is_ordered()).map(|of| &study.inputs()[of.input].key);
    json!({
        "required_yield": cheapest.options.required_yield,
        "best": best,
        "is_proven": cheapest.search.is_proven,
        "evaluations": cheapest.search.evaluations,
        "check": cheapest.check.as_ref().map(|(check, verdict)| {
            json!({"yield": estimate(check), "verdict": verdict.word()})
        }),
        "order_not_checked": unchecked.collect::<Vec<_>>(),
    })
}

/// One row per output and statistic, SI.
pub fn table(study: &Study, limits: &[Limit], outcome: &Tolerance) -> String {
    let mut out = String::from("output,unit,lower,upper,statistic,value,low,high\n");
    let cell = |value: f64| significant(value, 12);
    let mut line = |heads: &str, name: &str, value: &Estimate| {
        out += &format!("{heads},{name},{},{},{}\n", cell(value.value), cell(value.low), cell(value.high));
    };
    line("all,,NaN,NaN", "yield", &outcome.lot.yield_estimate);
    for ((output, limit), quality) in study.outputs().iter().zip(limits).zip(&outcome.qualities) {
        let [lower, upper] = [limit.lower, limit.upper].map(|end| cell(end.unwrap_or(f64::NAN)));
        let heads = format!("{},{},{lower},{upper}", quoted(&output.name), output.unit);
        line(&heads, "yield", &quality.yield_estimate);
        let unknown = Estimate { value: f64::NAN, low: f64::NAN, high: f64::NAN };
        for (_, name, _, value) in statistics(output, quality) {
            line(&heads, &name, &value.unwrap_or(unknown));
        }
    }
    out
}
