//! The output rows of a run: their times, and channels at these times.

use jointplay_physics::simulate::{Frame, Reading, Simulation};

/// Row times k x `every`, k = 0..=`last`, of a run of length `duration`, in s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowTimes {
    every: f64,
    last: u64,
    duration: f64,
}

impl RowTimes {
    /// Rows of a run of length `duration`, s, at intervals `every`, s; `None` if the interval is not positive.
    pub fn new(duration: f64, every: f64) -> Option<Self> {
        // This form also rejects NaN.
        if !(every > 0.0) {
            return None;
        }
        // A quotient such as 20 ms / 0.1 ms must give 200 intervals despite rounding.
        let intervals = duration / every;
        let whole = intervals.round();
        let last = if (intervals - whole).abs() <= 1e-9 * whole { whole } else { intervals.floor() };
        Some(Self { every, last: last as u64, duration })
    }

    /// Interval between rows, s.
    pub fn every(&self) -> f64 {
        self.every
    }

    /// Index of the last row; the first is 0.
    pub fn last(&self) -> u64 {
        self.last
    }

    /// Time of row `k`, s.
    pub fn at(&self, k: u64) -> f64 {
        (k as f64 * self.every).min(self.duration)
    }

    /// Index of the first row at or after both `from` and `time`, s.
    pub fn first(&self, from: f64, time: f64) -> u64 {
        let from = time.max(from * (1.0 - 1e-9));
        let mut k = (from / self.every) as u64;
        // Corrects for rounding in the division.
        while k > 0 && self.at(k - 1) >= from {
            k -= 1;
        }
        while k <= self.last && self.at(k) < from {
            k += 1;
        }
        k
    }

    /// Whether the last row lies at the end of the run.
    pub fn include_the_end(&self) -> bool {
        self.duration - self.at(self.last) <= 1e-9 * self.duration
    }
}

/// A value in a row that is not finite, which ends the run.
#[derive(Debug, thiserror::Error)]
#[error("stopped: {name} is {value} at t = {time:.6e} s; try a smaller solver.step or solver.tolerance")]
pub struct NotFinite {
    name: String,
    value: f64,
    time: f64,
}

/// Reads the rows of a run while it is stepped.
pub struct RowReader {
    times: RowTimes,
    /// Index of the next row.
    next: u64,
    /// Names for messages, and where a frame has the values.
    channels: Vec<(String, Reading)>,
    frame: Frame,
    row: Vec<f64>,
}

impl RowReader {
    /// A reader of the rows from number `first` on.
    pub fn new(times: RowTimes, first: u64, channels: Vec<(String, Reading)>) -> Self {
        let mut frame = Frame::default();
        channels.iter().for_each(|(_, reading)| reading.request(&mut frame));
        Self { times, next: first, channels, frame, row: Vec::new() }
    }

    /// Time of the next row, s; `None` after the last.
    pub fn next_time(&self) -> Option<f64> {
        (self.next <= self.times.last).then(|| self.times.at(self.next))
    }

    /// Passes the rows that lie in the latest step of `simulation` to `take`; at the start, the row at 0. Values that are unknown,
    /// as the tip error after the ideal mechanism has stopped, are NaN.
    ///
    /// # Errors
    /// Any other value that is not finite; its row is not passed on.
    pub fn read(&mut self, simulation: &mut Simulation, mut take: impl FnMut(&[f64])) -> Result<(), NotFinite> {
        while let Some(time) = self.next_time().filter(|time| *time <= simulation.time()) {
            simulation.sample(time, &mut self.frame);
            self.row.clear();
            for (name, reading) in &self.channels {
                let value = reading.read(&self.frame);
                if let Some(value) = value.filter(|value| !value.is_finite()) {
                    return Err(NotFinite { name: name.clone(), value, time });
                }
                self.row.push(value.unwrap_or(f64::NAN));
            }
            take(&self.row);
            self.next += 1;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(duration: f64, every: f64) -> RowTimes {
        RowTimes::new(duration, every).expect("positive")
    }

    #[test]
    fn rows_are_at_whole_multiples_of_the_interval_including_both_ends() {
        for (duration, every, count) in [
            (0.02, 0.1e-3, 201),
            (0.0, 1e-3, 1),
            (0.3, 0.1, 4),
            (1.0, 0.3, 4),
            (0.7, 0.1, 8),
            (3.0, 1e-5, 300_001),
            (1e-3, 1.0, 1),
        ] {
            let times = rows(duration, every);
            assert_eq!(times.last() + 1, count, "{duration} by {every}");
            assert!(times.at(times.last()) <= duration, "{duration} by {every}");
        }
        let times = rows(0.7, 0.1);
        assert_eq!([0.0, 0.05, 0.1, 0.3, 0.7].map(|from| times.first(from, 0.0)), [0, 1, 1, 3, 7]);
        assert_eq!([0.3, 0.35, 0.71].map(|time| times.first(0.3, time)), [3, 4, 8]);
        assert!(rows(0.7, 0.1).include_the_end());
        assert!(rows(0.0, 0.1).include_the_end());
        assert!(!rows(1.0, 0.3).include_the_end());
        assert_eq!(RowTimes::new(1.0, 0.0), None);
        assert_eq!(RowTimes::new(1.0, f64::NAN), None);
    }
}
