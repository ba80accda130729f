//! Texts of page, pictures and data files.

use crate::analysis::paper::PAPER;
use crate::analysis::regime::Regime;
use crate::analysis::reproduction::{Findings, Report, SweepData};
use crate::cli::output::significant;

pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Shown where there is no number.
pub(super) const NONE: &str = "\u{2013}";

/// Four digits, as many as a reader takes in.
pub(super) fn shown(value: impl Into<Option<f64>>) -> String {
    let text = |value| typeset(&significant(value, 4));
    value.into().map_or_else(|| NONE.to_owned(), text)
}

/// Typeset for the page: beta as its letter, powers of ten raised, minus signs.
pub(super) fn typeset(text: &str) -> String {
    let all: Vec<char> = text.chars().collect();
    let is = |at: usize, test: fn(char) -> bool| all.get(at).is_some_and(|&c| test(c));
    let after = |at: usize, test: fn(char) -> bool| at > 0 && is(at - 1, test);
    let digits = |from: usize| (from..).take_while(|&k| is(k, |c| c.is_ascii_digit())).count();
    let mut out = String::with_capacity(text.len());
    let mut at = 0;
    while let Some(&c) = all.get(at) {
        let sign = usize::from(is(at + 1, |c| c == '-' || c == '+'));
        let length = digits(at + 1 + sign);
        let end = at + 1 + sign + length;
        if c == 'e' && length > 0 && after(at, |c| c.is_ascii_digit()) && !is(end, char::is_alphanumeric) {
            out.push_str("·10");
            if sign == 1 && all[at + 1] == '-' {
                out.push('⁻');
            }
            let power = all[at + 1 + sign..end].iter().collect::<String>();
            let raised =
                |c: char| c.to_digit(10).map(|d| ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][d as usize]);
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
        let minus = c == '-' && is(at + 1, |c| c.is_ascii_digit()) && !after(at, |c| c != ' ' && c != '(');
        out.push(if minus { '\u{2212}' } else { c });
        at += 1;
    }
    out
}

/// Capitalised, except for names of coordinates.
pub(super) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    match (letters.next(), text.split(' ').next()) {
        (Some(first), Some(word)) if !["x", "beta"].contains(&word) => first.to_uppercase().chain(letters).collect(),
        _ => text.to_owned(),
    }
}

pub(super) fn verdict(confirmed: bool) -> &'static str {
    if confirmed { "confirmed" } else { "not confirmed" }
}

/// Word for the regime of a motion that did not reach its end.
pub(super) const NO_REGIME: &str = "none";

/// A regime with its period.
pub(super) fn regime(regime: Option<Regime>) -> String {
    regime.map_or_else(|| NO_REGIME.to_owned(), |regime| regime.to_string())
}

/// Number of motions per regime, in order of first occurrence.
pub(super) fn regimes(motions: impl Iterator<Item = Option<Regime>>) -> Vec<(String, usize)> {
    let mut counts: Vec<(String, usize)> = Vec::new();
    for word in motions.map(regime) {
        match counts.iter_mut().find(|(of, _)| *of == word) {
            Some((_, count)) => *count += 1,
            None => counts.push((word, 1)),
        }
    }
    counts
}

pub(super) fn join(parts: impl Iterator<Item = String>) -> String {
    parts.collect::<Vec<_>>().join(", ")
}

/// Total simulated time of all runs, without twins, s.
pub(super) fn simulated(report: &Report) -> f64 {
    let of_sweep = |data: &SweepData| data.sweep.plan().periods * data.sweep.grid().points();
    let of_findings = |found: &Findings| {
        let curves = found.curves.len() * (found.extent.settle + 2);
        let sweeps = found.sweeps.iter().map(of_sweep);
        found.runs.len() + 1 + curves + sweeps.sum::<usize>()
    };
    let combinations = report.combinations.iter();
    let combinations = combinations.map(|c| c.runs.len() + of_sweep(&c.sections));
    let periods = 1 + of_findings(&report.corrected) + of_findings(&report.printed) + combinations.sum::<usize>();
    PAPER.period * periods as f64
}

#[cfg(test)]
mod tests {
    use super::{capital, typeset};

    #[test]
    fn numbers_and_names_are_set_as_in_print() {
        for (text, set) in [
            ("9.06117e-4 rad", "9.06117·10⁻⁴ rad"),
            ("-1.305e-05 and -18.26 to -0.89 1/s", "−1.305·10⁻⁵ and −18.26 to −0.89 1/s"),
            ("2e+12, 3e7", "2·10¹², 3·10⁷"),
            ("rate of beta, beta", "rate of β, β"),
            ("betas, alphabeta, 0-1 test, 12 edges, 4e", "betas, alphabeta, 0-1 test, 12 edges, 4e"),
            ("", ""),
        ] {
            assert_eq!(typeset(text), set);
        }
    }

    #[test]
    fn sentences_begin_with_a_capital_but_for_coordinates() {
        for (text, set) in [("rate of beta", "Rate of beta"), ("x", "x"), ("beta less ideal", "beta less ideal")] {
            assert_eq!(capital(text), set);
        }
    }
}
