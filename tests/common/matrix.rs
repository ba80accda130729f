//! The matrix of methods and formulations that tests go through, and cases side by side.

use std::fmt;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::METHODS;

/// Words of `formulation`.
pub const FORMULATIONS: [&str; 2] = ["tree", "lagrange"];

/// A cell of the matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Way {
    pub method: &'static str,
    pub formulation: &'static str,
}

impl fmt::Display for Way {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {}", self.method, self.formulation)
    }
}

impl Way {
    /// As a user asks for it.
    pub fn changes(self) -> [(&'static str, &'static str); 2] {
        [("solver.method", self.method), ("formulation", self.formulation)]
    }

    /// The same for smooth motion against a closed solution: with steps that suit the method's order.
    pub fn close(self) -> [(&'static str, &'static str); 5] {
        let step = match self.method {
            "semi-implicit-euler" => "1 us",
            "rk4" => "100 us",
            _ => "10 us",
        };
        let [method, formulation] = self.changes();
        [method, ("solver.step", step), ("solver.tolerance", "1e-10"), ("solver.steps_per_impact", "256"), formulation]
    }

    /// How close that comes, m.
    pub fn bound(self) -> f64 {
        match self.method {
            "semi-implicit-euler" | "discrete-gradient" => 2e-6,
            "rk4" => 1e-9,
            _ => 1e-8,
        }
    }

    /// Methods of first order pay for closeness with a hundred times the steps.
    fn is_dear(self) -> bool {
        self.method.ends_with("euler")
    }
}

/// Every method in both formulations.
pub fn every_way() -> impl Iterator<Item = Way> {
    METHODS.into_iter().flat_map(|method| FORMULATIONS.map(|formulation| Way { method, formulation }))
}

/// Calls `check` with every case and every method, each in the formulation whose turn it is: every case meets both
/// formulations, and every method does but those of first order, which meet the first case alone.
pub fn for_every<C: Copy>(cases: impl IntoIterator<Item = C>, mut check: impl FnMut(C, Way)) {
    for (turn, case) in cases.into_iter().enumerate() {
        for (place, method) in METHODS.into_iter().enumerate() {
            let way = Way { method, formulation: FORMULATIONS[(turn + place) % 2] };
            if turn == 0 || !way.is_dear() {
                check(case, way);
            }
        }
    }
}

/// Calls `check` with every case, on as many threads as there are cores; the dearest come first, best.
pub fn side_by_side<C: Sync>(cases: &[C], check: impl Fn(&C) + Sync) {
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
