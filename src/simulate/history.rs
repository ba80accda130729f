//! The recorded past of some channels, thinned so that no extreme is lost: bins of doubling width, each with the
//! least and the greatest value that fell into it.

/// Bins kept per level.
const BINS: usize = 1024;
/// Levels: the widest bin is `finest * 2^(LEVELS - 1)`.
const LEVELS: usize = 24;
/// No bin.
const EMPTY: i64 = i64::MIN;

/// Fixed-size record of `channels` quantities over time. Nothing is allocated after [`History::new`].
#[derive(Clone, Debug)]
pub struct History {
    channels: usize,
    finest: f64,
    /// Index (time / width) of the bin that each slot holds; level by level.
    indices: Vec<i64>,
    /// Newest index per level.
    newest: [i64; LEVELS],
    /// (least, greatest) per channel, slot by slot, level by level.
    ranges: Vec<(f32, f32)>,
    start: Option<f64>,
    end: f64,
}

impl History {
    /// A record of `channels` quantities whose narrowest bins are `finest` seconds wide.
    pub fn new(channels: usize, finest: f64) -> Self {
        Self {
            channels,
            finest: if finest > 0.0 && finest.is_finite() {
                finest
            } else {
                1e-6
            },
            indices: vec![EMPTY; LEVELS * BINS],
            newest: [EMPTY; LEVELS],
            ranges: vec![(0.0, 0.0); LEVELS * BINS * channels],
            start: None,
            end: 0.0,
        }
    }

    /// Number of channels.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Time of the first and of the latest entry since the record was cleared, s.
    pub fn span(&self) -> Option<(f64, f64)> {
        self.start.map(|start| (start, self.end))
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.indices.fill(EMPTY);
        self.newest = [EMPTY; LEVELS];
        self.start = None;
        self.end = 0.0;
    }

    /// Records one instant, s; one value per channel. An instant before the latest, or not finite, is ignored.
    pub fn push(&mut self, time: f64, values: &[f64]) {
        if !time.is_finite() || (self.start.is_some() && time < self.end) {
            return;
        }
        debug_assert_eq!(values.len(), self.channels);
        self.start.get_or_insert(time);
        self.end = time;
        let index = self.index(0, time);
        if self.newest[0] != index {
            self.close(0);
            self.open(0, index);
            let ranges = self.slot_mut(0, index);
            for (range, &value) in ranges.iter_mut().zip(values) {
                *range = (value as f32, value as f32);
            }
        } else {
            let ranges = self.slot_mut(0, index);
            for (range, &value) in ranges.iter_mut().zip(values) {
                *range = join(*range, (value as f32, value as f32));
            }
        }
    }

    /// Widens what is recorded at `time` so that `channel` includes `value`: a peak between two steps.
    pub fn widen(&mut self, time: f64, channel: usize, value: f64) {
        if channel >= self.channels || !time.is_finite() || !value.is_finite() {
            return;
        }
        for level in 0..LEVELS {
            let index = self.index(level, time);
            if self.indices[level * BINS + slot_of(index)] == index {
                let range = &mut self.slot_mut(level, index)[channel];
                *range = join(*range, (value as f32, value as f32));
            }
        }
    }

    /// Points (time in s, value) of `channel` from `from` to `to`, in order of time, at most two for each of
    /// `most_bins` bins and two beyond each end; appended to `out`.
    pub fn query(
        &self,
        channel: usize,
        from: f64,
        to: f64,
        most_bins: usize,
        out: &mut Vec<[f64; 2]>,
    ) {
        if channel >= self.channels || to <= from {
            return;
        }
        let Some((start, end)) = self.span() else {
            return;
        };
        let (from, to) = (from.max(start), to.min(end));
        let level = self.level(to - from, most_bins);
        let width = self.width(level);
        let first = self.index(level, from);
        let last = self.index(level, to);
        for index in first..=last {
            let Some((least, greatest)) = self.range(level, index, channel) else {
                continue;
            };
            if least.is_nan() {
                continue;
            }
            let time = ((index as f64 + 0.5) * width).clamp(start, end);
            if least == greatest {
                out.push([time, f64::from(least)]);
            } else {
                // Up one bin and down the next: an even line where the values rise and fall slowly.
                let rising = out.last().is_none_or(|p| {
                    (p[1] - f64::from(least)).abs() <= (p[1] - f64::from(greatest)).abs()
                });
                let (a, b) = if rising {
                    (least, greatest)
                } else {
                    (greatest, least)
                };
                out.push([time, f64::from(a)]);
                out.push([time, f64::from(b)]);
            }
        }
    }

    /// Everything that is kept in at most so many rows: time of each bin's middle in s, then the least and the greatest
    /// value of each channel in it, channel after channel.
    pub fn rows(&self, most_bins: usize) -> Vec<(f64, Vec<(f32, f32)>)> {
        let Some((start, end)) = self.span() else {
            return Vec::new();
        };
        let level = self.level(end - start, most_bins);
        let width = self.width(level);
        (self.index(level, start)..=self.index(level, end))
            .filter_map(|index| {
                let values: Option<Vec<(f32, f32)>> = (0..self.channels)
                    .map(|channel| self.range(level, index, channel))
                    .collect();
                let time = ((index as f64 + 0.5) * width).clamp(start, end);
                values.map(|values| (time, values))
            })
            .collect()
    }

    /// The narrowest bins of which `most_bins` cover `length` seconds.
    fn level(&self, length: f64, most_bins: usize) -> usize {
        // Two bins of room: the window seldom starts and ends on a bin's edge.
        let most_bins = most_bins.clamp(2, BINS - 2) as f64;
        (0..LEVELS)
            .find(|&level| length / self.width(level) <= most_bins)
            .unwrap_or(LEVELS - 1)
    }

    fn width(&self, level: usize) -> f64 {
        self.finest * (1_u64 << level) as f64
    }

    fn index(&self, level: usize, time: f64) -> i64 {
        // Halving the finest index keeps the levels nested whatever the rounding of the division.
        ((time / self.finest).floor() as i64) >> level
    }

    fn slot_mut(&mut self, level: usize, index: i64) -> &mut [(f32, f32)] {
        let at = (level * BINS + slot_of(index)) * self.channels;
        &mut self.ranges[at..at + self.channels]
    }

    /// Range of `channel` in one bin, what the narrower levels have not yet handed up included.
    fn range(&self, level: usize, index: i64, channel: usize) -> Option<(f32, f32)> {
        let mut found: Option<(f32, f32)> = None;
        for below in 0..=level {
            let at = if below == level {
                index
            } else {
                self.newest[below]
            };
            if at == EMPTY || at >> (level - below) != index {
                continue;
            }
            let slot = below * BINS + slot_of(at);
            if self.indices[slot] == at {
                let range = self.ranges[slot * self.channels + channel];
                found = Some(found.map_or(range, |f| join(f, range)));
            }
        }
        found
    }

    /// Hands the newest bin of `level` up to the level above.
    fn close(&mut self, level: usize) {
        let index = self.newest[level];
        if index == EMPTY || level + 1 == LEVELS {
            return;
        }
        let above = index >> 1;
        let fresh = self.newest[level + 1] != above;
        if fresh {
            self.close(level + 1);
            self.open(level + 1, above);
        }
        let from = (level * BINS + slot_of(index)) * self.channels;
        let to = ((level + 1) * BINS + slot_of(above)) * self.channels;
        for channel in 0..self.channels {
            let range = self.ranges[from + channel];
            let target = &mut self.ranges[to + channel];
            *target = if fresh { range } else { join(*target, range) };
        }
    }

    fn open(&mut self, level: usize, index: i64) {
        self.newest[level] = index;
        self.indices[level * BINS + slot_of(index)] = index;
    }
}

fn slot_of(index: i64) -> usize {
    index.rem_euclid(BINS as i64) as usize
}

fn join(a: (f32, f32), b: (f32, f32)) -> (f32, f32) {
    (a.0.min(b.0), a.1.max(b.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(n: u64) -> f64 {
        libm::sin(n as f64 * 0.001)
    }

    #[test]
    fn every_extreme_survives_at_every_width() {
        let mut history = History::new(2, 1e-5);
        for n in 0..200_000_u64 {
            let spike = if n == 123_456 { 50.0 } else { wave(n) };
            history.push(n as f64 * 1e-5, &[spike, -spike]);
        }
        for window in [1.0, 1.9, 2.0] {
            let mut points = Vec::new();
            history.query(0, 2.0 - window, 2.0, 500, &mut points);
            assert!(points.len() <= 1004, "{}", points.len());
            let greatest = points.iter().map(|p| p[1]).fold(f64::MIN, f64::max);
            let least = points.iter().map(|p| p[1]).fold(f64::MAX, f64::min);
            assert_eq!(greatest, 50.0, "window {window}");
            assert!((least + 1.0).abs() < 1e-6, "window {window}: {least}");
            let at = points.iter().find(|p| p[1] == 50.0).expect("found above")[0];
            assert!((at - 1.23456).abs() <= window / 250.0, "{at}");
        }
    }

    #[test]
    fn points_come_in_order_and_inside_the_window() {
        let mut history = History::new(1, 1e-6);
        for n in 0..50_000_u64 {
            history.push(n as f64 * 1e-5, &[wave(n)]);
        }
        let mut points = Vec::new();
        history.query(0, 0.2, 0.3, 300, &mut points);
        assert!(points.len() > 100, "{}", points.len());
        assert!(points.windows(2).all(|w| w[0][0] <= w[1][0]));
        let bin = 0.1 / 150.0;
        assert!(points.iter().all(|p| p[0] > 0.2 - bin && p[0] < 0.3 + bin));
        for p in points {
            assert!((p[1] - libm::sin(p[0] * 100.0)).abs() < 0.1);
        }
    }

    #[test]
    fn the_latest_value_is_seen_at_once() {
        let mut history = History::new(1, 1e-6);
        for n in 0..1000 {
            history.push(f64::from(n) * 1e-3, &[0.0]);
        }
        history.push(1.0, &[7.0]);
        let mut points = Vec::new();
        history.query(0, 0.0, 1.0, 100, &mut points);
        assert_eq!(points.iter().map(|p| p[1]).fold(f64::MIN, f64::max), 7.0);
    }

    #[test]
    fn a_peak_between_steps_widens_its_bin() {
        let mut history = History::new(2, 1e-5);
        for n in 0..1000 {
            history.push(f64::from(n) * 1e-4, &[1.0, 2.0]);
        }
        history.widen(0.05, 0, 9.0);
        for bins in [50, 500] {
            let mut points = Vec::new();
            history.query(0, 0.0, 0.1, bins, &mut points);
            let peak = points
                .iter()
                .find(|p| p[1] == 9.0)
                .expect("the peak is kept");
            assert!((peak[0] - 0.05).abs() < 0.1 / bins as f64 * 2.0);
            points.clear();
            history.query(1, 0.0, 0.1, bins, &mut points);
            assert!(
                points.iter().all(|p| p[1] == 2.0),
                "the other channel is untouched"
            );
        }
    }

    #[test]
    fn an_old_window_is_coarse_but_there_and_clear_empties() {
        let mut history = History::new(1, 1e-6);
        for n in 0..200_000_u64 {
            history.push(n as f64 * 1e-4, &[n as f64]);
        }
        let mut points = Vec::new();
        history.query(0, 0.0, 20.0, 400, &mut points);
        assert_eq!(points[0][1], 0.0);
        assert_eq!(points[points.len() - 1][1], 199_999.0);
        history.clear();
        points.clear();
        history.query(0, 0.0, 20.0, 400, &mut points);
        assert!(points.is_empty() && history.span().is_none());
    }

    #[test]
    fn time_never_runs_backwards() {
        let mut history = History::new(1, 1e-6);
        history.push(1.0, &[1.0]);
        history.push(0.5, &[2.0]);
        history.push(f64::NAN, &[3.0]);
        assert_eq!(history.span(), Some((1.0, 1.0)));
    }
}
