//! What page and data files say alike.

use crate::analysis::paper::{Case, Verdict, compare};
use crate::analysis::reproduction::{Findings, PERIOD, Report, SweepData};

/// A number of the paper beside the same of this program, SI units.
pub(super) struct Compared {
    pub figure: &'static str,
    pub case: Case,
    pub what: String,
    pub unit: &'static str,
    pub paper: f64,
    pub full: f64,
    pub sampled: Option<f64>,
    pub agreement: &'static str,
}

/// All of them, in the paper's order.
pub(super) fn compared(found: &Findings) -> Vec<Compared> {
    let all = compare(&found.responses()).into_iter().map(|c| {
        let (what, unit) = c.published.quantity.label();
        Compared {
            figure: c.published.figure,
            case: c.published.case,
            what,
            unit,
            paper: c.published.value,
            full: c.full,
            sampled: c.sampled,
            agreement: c.agreement().word(),
        }
    });
    all.collect()
}

/// As the page shows it: beta by its letter, powers of ten raised, minus signs.
pub(super) fn typeset(text: &str) -> String {
    let all: Vec<char> = text.chars().collect();
    let is = |at: usize, test: fn(char) -> bool| all.get(at).is_some_and(|&c| test(c));
    let after = |at: usize, test: fn(char) -> bool| at > 0 && is(at - 1, test);
    let digits = |from: usize| {
        (from..)
            .take_while(|&k| is(k, |c| c.is_ascii_digit()))
            .count()
    };
    let mut out = String::with_capacity(text.len());
    let mut at = 0;
    while let Some(&c) = all.get(at) {
        let sign = usize::from(is(at + 1, |c| c == '-' || c == '+'));
        let length = digits(at + 1 + sign);
        let end = at + 1 + sign + length;
        if c == 'e'
            && length > 0
            && after(at, |c| c.is_ascii_digit())
            && !is(end, char::is_alphanumeric)
        {
            out.push_str("·10");
            if sign == 1 && all[at + 1] == '-' {
                out.push('⁻');
            }
            let power = all[at + 1 + sign..end].iter().collect::<String>();
            let raised = |c: char| {
                c.to_digit(10)
                    .map(|d| ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][d as usize])
            };
            out.extend(power.trim_start_matches('0').chars().filter_map(raised));
            at = end;
            continue;
        }
        if all[at..].starts_with(&['b', 'e', 't', 'a'])
            && !after(at, char::is_alphanumeric)
            && !is(at + 4, char::is_alphanumeric)
        {
            out.push('β');
            at += 4;
            continue;
        }
        let minus =
            c == '-' && is(at + 1, |c| c.is_ascii_digit()) && !after(at, |c| c != ' ' && c != '(');
        out.push(if minus { '\u{2212}' } else { c });
        at += 1;
    }
    out
}

/// In a word or two.
pub(super) fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Confirmed => "confirmed",
        Verdict::NotConfirmed => "not confirmed",
    }
}

/// Simulated time of all runs together, without twins, s.
pub(super) fn simulated(report: &Report) -> f64 {
    let of_runs = |count: usize| count as f64 * crate::analysis::paper::DURATION;
    let of_sweep =
        |data: &SweepData| PERIOD * (data.sweep.plan().periods * data.sweep.grid().points()) as f64;
    let of_findings = |found: &Findings| {
        let curves = found.curves.len() as f64 * PERIOD * (found.extent.settle + 2) as f64;
        of_runs(found.runs.len() + 1) + curves + found.sweeps.iter().map(of_sweep).sum::<f64>()
    };
    let combinations = report.combinations.iter();
    let combinations = combinations.map(|c| of_runs(c.runs.len()) + of_sweep(&c.sections));
    of_runs(1)
        + of_findings(&report.corrected)
        + of_findings(&report.printed)
        + combinations.sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::typeset;

    #[test]
    fn numbers_and_names_are_set_as_in_print() {
        for (text, set) in [
            ("9.06117e-4 rad", "9.06117·10⁻⁴ rad"),
            (
                "-1.305e-05 and -18.26 to -0.89 1/s",
                "−1.305·10⁻⁵ and −18.26 to −0.89 1/s",
            ),
            ("2e+12, 3e7", "2·10¹², 3·10⁷"),
            ("rate of beta, beta", "rate of β, β"),
            (
                "betas, alphabeta, 0-1 test, 12 edges, 4e",
                "betas, alphabeta, 0-1 test, 12 edges, 4e",
            ),
            ("", ""),
        ] {
            assert_eq!(typeset(text), set);
        }
    }
}
