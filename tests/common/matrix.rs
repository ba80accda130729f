//! The matrix of methods and formulations that tests cover, and a parallel loop over cases.

use std::fmt;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::METHODS;

/// Values of `formulation`.
pub const FORMULATIONS: [&str; 2] = ["tree", "lagrange"];

/// A method in a formulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Variant {
    pub method: &'static str,
    pub formulation: &'static str,
}

impl fmt::Display for Variant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {}", self.method, self.formulation)
    }
}

impl Variant {
    /// The changes that select it.
    pub fn changes(self) -> [(&'static str, &'static str); 2] {
        [("solver.method", self.method), ("formulation", self.formulation)]
    }

    /// Changes for a comparison of smooth motion with a closed form: step sizes suit the method's order.
    pub fn close(self) -> [(&'static str, &'static str); 5] {
        let step = match self.method {
            "rk4" => "100 us",
            _ => "10 us",
        };
        let [method, formulation] = self.changes();
        [method, ("solver.step", step), ("solver.tolerance", "1e-10"), ("solver.steps_per_impact", "256"), formulation]
    }

    /// Error bound of such a comparison, m.
    pub fn bound(self) -> f64 {
        match self.method {
            "discrete-gradient" => 2e-6,
            "rk4" => 1e-9,
            _ => 1e-8,
        }
    }
}

/// Every method in the formulation `tree`. That `lagrange` moves alike is tested once for all, in `tests/physics/formulations.rs`.
pub fn in_tree() -> impl Iterator<Item = Variant> {
    METHODS.into_iter().map(|method| Variant { method, formulation: "tree" })
}

/// Every method in both formulations.
pub fn every_variant() -> impl Iterator<Item = Variant> {
    METHODS.into_iter().flat_map(|method| FORMULATIONS.map(|formulation| Variant { method, formulation }))
}

/// Calls `check` with every case and every method, alternating the formulation. Every case meets both formulations, and so does
/// every method.
pub fn for_every<C: Copy>(cases: impl IntoIterator<Item = C>, mut check: impl FnMut(C, Variant)) {
    for (turn, case) in cases.into_iter().enumerate() {
        for (place, method) in METHODS.into_iter().enumerate() {
            let variant = Variant { method, formulation: FORMULATIONS[(turn + place) % 2] };
            check(case, variant);
        }
    }
}

/// Calls `check` with every case, on as many threads as there are cores; `cases` should begin with the most expensive.
pub fn in_parallel<C: Sync>(cases: &[C], check: impl Fn(&C) + Sync) {
    let next = AtomicUsize::new(0);
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                while let Some(case) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
                    check(case);
                }
            });
        }
    });
}
