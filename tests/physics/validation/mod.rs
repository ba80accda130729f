//! Validation cases with known reference results, and their page.

mod cases;

use jointplay_physics::units::significant;
use jointplay_scene::BENCHMARKS;

use self::cases::{CASES, Case, Check, Comparison, ImpactProperty, MODELS, Measure, ReferenceValue};

/// All cases together take about a second.
#[test]
fn every_case_is_within_its_bound_and_the_page_is_current() {
    let (mut rows, mut missed) = (String::new(), Vec::new());
    for case in &*CASES {
        for (check, comparison) in case.checks.iter().zip(case.compare()) {
            if !comparison.holds() {
                missed.push(format!("{}, {}: {comparison:?}", case.title, check.quantity));
            }
            rows += &row(case, check, &comparison);
        }
    }
    assert!(missed.is_empty(), "not within their bounds: {missed:#?}");
    let sources: String = CASES.iter().map(source).collect();
    let page = include_str!("page.md").replace("{rows}", &rows).replace("{sources}", &sources);
    let path = std::path::Path::new(crate::ROOT).join("docs/validation.md");
    if std::env::var_os("UPDATE_PAGES").is_some() {
        std::fs::write(&path, &page).unwrap();
    }
    let stored = std::fs::read_to_string(path).unwrap_or_default();
    assert!(stored == page, "docs/validation.md is out of date: UPDATE_PAGES=1 writes it");
}

/// A line of the page's table.
fn row(case: &Case, check: &Check, comparison: &Comparison) -> String {
    let Comparison { right, ours, bound } = *comparison;
    let origin = match &check.right {
        ReferenceValue::Published(_) => "published".to_owned(),
        ReferenceValue::Model(name) => format!("model, `{name}`"),
        ReferenceValue::Formula(text) => format!("`{text}`"),
    };
    let difference = comparison.difference();
    // Differences far below the bound may change with the compiler.
    let least = bound / 100.0;
    let difference =
        if difference.abs() < least { format!("below {}", significant(least, 1)) } else { significant(difference, 2) };
    let unit = if check.unit.is_empty() { String::new() } else { format!(" ({})", check.unit) };
    let (right, ours, bound) = (resolved(right, bound), resolved(ours, bound), significant(bound, 1));
    format!("| {} | {}{unit} | {origin} | {right} | {ours} | {difference} | {bound} |\n", case.title, check.quantity)
}

/// `value` rounded to a hundredth of `bound`.
fn resolved(value: f64, bound: f64) -> String {
    let least = bound.log10().floor() as i32 - 2;
    let digits = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 - least + 1 };
    match usize::try_from(digits) {
        Ok(digits @ 1..) => significant(value, digits.min(15)),
        _ => "0".to_owned(),
    }
}

/// The paragraph about a case.
fn source(case: &Case) -> String {
    let changes: String = case.changes.iter().map(|(key, value)| format!(" --set {key}=\"{value}\"")).collect();
    let duration = significant(case.duration, 6);
    let Case { title, scene, source, .. } = case;
    format!("- **{title}**: {} `jointplay run {scene}{changes} --duration {duration}s`\n", source.trim())
}

#[test]
fn numbers_end_at_a_hundredth_of_the_bound() {
    assert_eq!(resolved(15.810_771_196_299, 1e-8), "15.8107711963");
    assert_eq!(resolved(45_924.953_2, 1.0), "45924.95");
    assert_eq!(resolved(4.974_135_8e-8, 1e-13), "4.9741358e-08");
    assert_eq!(resolved(1.7e-15, 1e-9), "0");
    assert_eq!(resolved(0.0, 1e-9), "0");
}

#[test]
fn every_benchmark_has_a_case_and_every_check_a_reference_value() {
    for name in BENCHMARKS {
        assert!(CASES.iter().any(|case| case.scene == name), "{name}");
    }
    for check in CASES.iter().flat_map(|case| &case.checks) {
        assert!(check.right.value().is_finite() && check.bound > 0.0, "{check:?}");
    }
}

#[test]
fn every_value_of_the_independent_models_is_compared() {
    let used = |name: &str| {
        let checks = CASES.iter().flat_map(|case| &case.checks);
        checks.into_iter().any(|check| matches!(&check.right, ReferenceValue::Model(model) if model == name))
    };
    for (case, numbers) in &*MODELS {
        for key in numbers.keys() {
            assert!(used(&format!("{case}.{key}")), "{case}.{key}");
        }
    }
}

#[test]
fn a_slightly_wrong_gravity_violates_the_bound() {
    let pendulum = CASES.iter().find(|case| case.scene == "simple-pendulum").unwrap();
    let mut wrong = pendulum.clone();
    wrong.changes.push(("gravity.z".to_owned(), "-9.81001 m/s^2".to_owned()));
    let compare = |case: &Case| case.compare();
    assert!(compare(pendulum).iter().all(Comparison::holds));
    assert!(!compare(&wrong).iter().any(Comparison::holds));
}

#[test]
fn a_check_fails_if_the_run_does_not_show_its_quantity() {
    let pendulum = CASES.iter().find(|case| case.scene == "simple-pendulum").unwrap();
    for measure in [
        Measure::Impact { number: 1, property: ImpactProperty::Peak },
        Measure::Period { channel: "pivot.angle".to_owned(), level: 10.0 },
        Measure::At { channel: "pivot.angle".to_owned(), time: 11.0 },
    ] {
        let mut case = pendulum.clone();
        case.checks.truncate(1);
        case.checks[0].measure = measure;
        assert!(!case.compare()[0].holds(), "{case:?}");
    }
}
