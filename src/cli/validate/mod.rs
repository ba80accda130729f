//! `validate`: cases with independently known answers, and the page about them.

use std::io::Write as _;

use super::args::ValidateArguments;
use super::output::significant;
use super::tables::{Table, fill};
use super::{Failure, interrupt, print};
use crate::analysis::validation::{CASES, Case, Check, Comparison, ReferenceValue};
use crate::files::OutputFile;

/// Runs the command.
///
/// # Errors
/// A file that cannot be written; after the page is written, a case that misses its bound.
pub fn validate(arguments: &ValidateArguments) -> Result<(), Failure> {
    let target = arguments.out.as_ref().map(|path| OutputFile::claim(path, arguments.force)).transpose()?;
    let (page, missed) = page()?;
    // An interrupted command must not leave a temporary file.
    interrupt::listen();
    match target {
        Some(target) => target.write(|file| file.write_all(page.as_bytes()))?,
        None => print(&page)?,
    }
    if missed.is_empty() {
        return Ok(());
    }
    Err(Failure::new(Failure::MISSED, format!("not within their bounds: {}", missed.join("; "))))
}

/// The page, and the quantities outside their bounds.
///
/// # Errors
/// A case that does not run to its end.
pub fn page() -> Result<(String, Vec<String>), Failure> {
    let (mut rows, mut missed) = (Vec::new(), Vec::new());
    for case in &*CASES {
        let failed = |error| Failure::new(Failure::MISSED, format!("{}: {error}", case.title));
        for (check, comparison) in case.checks.iter().zip(case.compare().map_err(failed)?) {
            if !comparison.holds() {
                missed.push(format!("{}, {}: {comparison:?}", case.title, check.quantity));
            }
            rows.push(row(case, check, &comparison));
        }
    }
    let heads = "Case | Quantity | Source | Expected | Computed | Difference | Bound";
    let sources: String = CASES.iter().map(source).collect();
    let page = fill(include_str!("page.md"), &[("cases", Table::new(heads, rows).markdown()), ("sources", sources)]);
    Ok((page, missed))
}

fn row(case: &Case, check: &Check, comparison: &Comparison) -> Vec<String> {
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
    vec![
        case.title.clone(),
        format!("{}{unit}", check.quantity),
        origin,
        resolved(right, bound),
        resolved(ours, bound),
        difference,
        significant(bound, 1),
    ]
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

#[cfg(test)]
mod tests {
    use super::resolved;

    #[test]
    fn numbers_end_at_a_hundredth_of_the_bound() {
        assert_eq!(resolved(15.810_771_196_299, 1e-8), "15.8107711963");
        assert_eq!(resolved(45_924.953_2, 1.0), "45924.95");
        assert_eq!(resolved(4.974_135_8e-8, 1e-13), "4.9741358e-08");
        assert_eq!(resolved(1.7e-15, 1e-9), "0");
        assert_eq!(resolved(0.0, 1e-9), "0");
    }
}
