//! Least, median and largest time of one call.
//!
//! Words on the command line choose measurements by parts of their names. Without `--bench`, which `cargo bench` passes and
//! `cargo test --benches` does not, everything is called once.

use std::hint::black_box;
use std::time::{Duration, Instant};

const WARM_UP: Duration = Duration::from_millis(500);
/// Duration of a measurement, s, unless its minimum number of samples takes longer.
const DURATION: f64 = 3.0;
/// Minimum and maximum number of samples.
const SAMPLES: (f64, f64) = (10.0, 50.0);

pub struct Stopwatch {
    words: Vec<String>,
    once: bool,
}

impl Stopwatch {
    /// Reads the command line.
    pub fn new() -> Self {
        let (options, words): (Vec<_>, _) = std::env::args().skip(1).partition(|word| word.starts_with('-'));
        Self { words, once: !options.iter().any(|option| option == "--bench") }
    }

    /// Times `call`; returns the median, s, if it was measured.
    pub fn time<R>(&self, name: &str, mut call: impl FnMut() -> R) -> Option<f64> {
        self.measure(name, |calls| {
            let clock = Instant::now();
            for _ in 0..calls {
                black_box(call());
            }
            clock.elapsed()
        })
    }

    /// As [`Self::time`], for a `call` that returns the time to count, because it also does other things.
    pub fn time_part(&self, name: &str, mut call: impl FnMut() -> Duration) -> Option<f64> {
        self.measure(name, |calls| (0..calls).map(|_| call()).sum())
    }

    /// `run` makes the given number of calls and returns their total time.
    fn measure(&self, name: &str, mut run: impl FnMut(u64) -> Duration) -> Option<f64> {
        if !self.words.is_empty() && !self.words.iter().any(|word| name.contains(&**word)) {
            return None;
        }
        let (mut calls, mut clock) = (1, Instant::now());
        run(calls);
        if self.once {
            println!("{name}: called once");
            return None;
        }
        while clock.elapsed() < WARM_UP {
            calls *= 2;
            clock = Instant::now();
            run(calls);
        }
        let all = DURATION / clock.elapsed().as_secs_f64() * calls as f64;
        let samples = all.clamp(SAMPLES.0, SAMPLES.1).floor();
        let calls = (all / samples).max(1.0) as u64;
        let sample = |_| run(calls).as_secs_f64() / calls as f64;
        let mut times: Vec<f64> = (0..samples as u32).map(sample).collect();
        times.sort_by(f64::total_cmp);
        let (median, largest) = (times[times.len() / 2], times[times.len() - 1]);
        let [least, middle, most] = [times[0], median, largest].map(in_words);
        println!("{name}\n    {least}, {middle}, {most}    least, median, largest; {samples} × {calls} calls");
        Some(median)
    }
}

/// A time with its unit.
pub fn in_words(seconds: f64) -> String {
    let units = [(1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns")];
    let (size, unit) = units.into_iter().find(|(size, _)| seconds >= *size).unwrap_or(units[3]);
    format!("{:.3} {unit}", seconds / size)
}
