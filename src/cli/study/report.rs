//! Output common to all studies: numbers for people and programs, the table of runs, and the files of a folder.

use serde_json::{Map, Value as Json, json};

use super::Study;
use crate::analysis::study::{Input, RunSpan, StudyRunner as _};
use crate::analysis::yields::Estimate;
use crate::chart::{Sheet, SheetError};
use crate::cli::output::significant;
use crate::cli::tables::quoted;
use crate::cli::{Failure, provenance};
use crate::files::Folder;
use crate::units::format_quantity_digits;

/// Significant digits for people: by default, of the largest difference between values, and at most.
const DIGITS: usize = 4;
const DISTINCT: usize = 3;
const MAX_DIGITS: usize = 9;
/// PNG pixels per pixel of a chart.
const PNG_SCALE: f32 = 2.0;

/// A value with its unit, lengths in mm; `-` if unknown or unlimited.
pub fn display_value(value: f64, unit: &str) -> String {
    display_value_digits(value, unit, DIGITS)
}

/// The same with `digits` significant digits.
pub fn display_value_digits(value: f64, unit: &str, digits: usize) -> String {
    let display = if unit == "m" { "mm" } else { unit };
    if value.is_finite() { format_quantity_digits(value, display, digits) } else { "-".to_owned() }
}

/// Significant digits, from four to nine, that show the largest distance of `values` from `nominal` to three digits.
pub fn distinguishing_digits(nominal: f64, values: impl Iterator<Item = f64>) -> usize {
    let distance = |value: f64| (value - nominal).abs();
    let largest = values.filter(|value| value.is_finite()).map(distance).fold(0.0, f64::max);
    let lost = libm::log10(nominal.abs() / largest);
    if lost.is_finite() { (lost.ceil().max(0.0) as usize + DISTINCT).clamp(DIGITS, MAX_DIGITS) } else { DIGITS }
}

/// One of the values of `input`, with unit.
pub fn value_of(input: &Input, value: f64) -> String {
    format_quantity_digits(value, input.unit, DIGITS)
}

/// A value on an axis, in mm for lengths, and its unit.
pub fn axis_value(value: f64, unit: &str) -> (f64, &str) {
    if unit == "m" { (1e3 * value, "mm") } else { (value, unit) }
}

/// In JSON; null if unknown or unlimited.
pub fn number(value: f64) -> Json {
    if value.is_finite() { json!(value) } else { Json::Null }
}

/// An estimate with its interval in JSON.
pub fn estimate(estimate: &Estimate) -> Json {
    json!({"value": number(estimate.value), "low": number(estimate.low), "high": number(estimate.high)})
}

impl Study {
    /// Number of runs, and of those without a result, for people.
    pub fn run_count_text(&self) -> String {
        let missing = self.runs().iter().filter(|run| run.outputs.iter().any(|value| !value.is_finite())).count();
        let missing = match missing {
            0 => String::new(),
            _ => format!(", {missing} without a result: they did not start, or diverged"),
        };
        format!("{}{missing}", self.runs().len())
    }

    /// Provenance of the results.
    pub fn meta(&self) -> Map<String, Json> {
        let mut meta = provenance::meta(self.scene());
        let RunSpan { duration, from } = self.span();
        meta.insert("duration_s".into(), json!(duration));
        meta.insert("from_s".into(), json!(from));
        meta.insert("seed".into(), json!(self.seed));
        let assumed = self.inputs().iter().filter_map(|input| Some((input.key.clone(), json!(input.assumed_range()?))));
        meta.insert("assumed_ranges".into(), Json::Object(assumed.collect()));
        meta
    }

    /// A line for each parameter whose range was not given, for people.
    pub fn assumption_lines(&self) -> String {
        let line = |input: &Input| {
            let (low, high) = input.assumed_range()?;
            let [low, high] = [low, high].map(|end| value_of(input, end));
            Some(format!(
                "Range not given   {}: {low} to {high}, half to one and a half of its value, within what is allowed\n",
                input.key
            ))
        };
        self.inputs().iter().filter_map(line).collect()
    }

    /// Writes results, table, charts and runs into `folder`, all but the runs under the name `name`.
    ///
    /// # Errors
    /// A chart that cannot be drawn; the file system.
    pub fn write(
        &self,
        folder: &Folder,
        name: &str,
        meta: &Map<String, Json>,
        mut results: Json,
        table: &str,
        sheet: &Sheet,
    ) -> Result<(), Failure> {
        if let Json::Object(results) = &mut results {
            results.insert("meta".into(), Json::Object(meta.clone()));
        }
        let drawing = |error: SheetError| Failure::io(error.to_string());
        let files = [
            (format!("{name}.csv"), table.as_bytes().to_vec()),
            (format!("{name}.json"), format!("{results:#}\n").into_bytes()),
            ("runs.csv".to_owned(), self.table().into_bytes()),
            (format!("{name}.svg"), sheet.svg().map_err(drawing)?.into_bytes()),
            (format!("{name}.png"), sheet.png(PNG_SCALE).map_err(drawing)?),
        ];
        for (name, content) in files {
            folder.write(&name, &content)?;
        }
        Ok(())
    }

    /// All runs as CSV, SI.
    fn table(&self) -> String {
        let inputs = self.inputs().iter().map(|input| (&input.key, input.si_unit));
        let columns = inputs.chain(self.outputs().iter().map(|output| (&output.name, output.unit)));
        let columns = columns.map(|(name, unit)| {
            let unit = if unit.is_empty() { String::new() } else { format!(" ({unit})") };
            quoted(&format!("{name}{unit}"))
        });
        let heads: Vec<String> = ["stage".to_owned()].into_iter().chain(columns).collect();
        let mut out = heads.join(",") + "\n";
        for run in self.runs() {
            let cells: Vec<String> =
                run.values.iter().chain(&run.outputs).map(|value| significant(*value, 12)).collect();
            out += &format!("{},{}\n", run.stage, cells.join(","));
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_that_differ_little_have_enough_digits_to_distinguish_them() {
        let cells = |values: [f64; 3]| {
            let digits = distinguishing_digits(values[0], values.into_iter());
            values.map(|value| display_value_digits(value, "m", digits))
        };
        assert_eq!(cells([0.1, 0.2, 0.301_234_56]), ["100 mm", "200 mm", "301.2 mm"]);
        assert_eq!(cells([-0.264_9, -0.264_901_234, f64::NAN]), ["-264.9 mm", "-264.901234 mm", "-"]);
        assert_eq!(cells([1.0, 1.0 + 1e-14, 1.0]), ["1000 mm"; 3]);
        assert_eq!(cells([0.0, 1.234_567e-3, 0.0]), ["0 mm", "1.235 mm", "0 mm"]);
    }
}
