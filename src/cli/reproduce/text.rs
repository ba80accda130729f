//! What page and data files say alike.

use crate::analysis::paper::{Case, Verdict, compare};
use crate::analysis::reproduction::{Findings, PERIOD};

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

/// In a word or two.
pub(super) fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Confirmed => "confirmed",
        Verdict::NotConfirmed => "not confirmed",
    }
}

/// Simulated time of all runs together, without twins, s.
pub(super) fn simulated(found: &Findings) -> f64 {
    let runs = (found.runs.len() + 2) as f64 * crate::analysis::paper::DURATION;
    let curves = found.curves.len() as f64 * PERIOD * (found.extent.settle + 2) as f64;
    let sweeps = found
        .swathes
        .iter()
        .map(|swathe| PERIOD * (swathe.sweep.plan().periods * swathe.sweep.grid().points()) as f64);
    runs + curves + sweeps.sum::<f64>()
}
