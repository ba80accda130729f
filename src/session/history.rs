//! Record of channels over time, decimated without losing extremes: bins of doubling width with their least and greatest values.

use std::sync::Arc;

/// Bins per level: more than a wide plot has columns of pixels.
const BINS: usize = 2048;
/// Number of levels: the widest bin is `finest * 2^(LEVELS - 1)`.
const LEVELS: usize = 23;
/// Slots that copies of a record share until one of them changes them; a divisor of [`BINS`].
const CHUNK: usize = 64;
/// Empty slot.
const EMPTY: i64 = i64::MIN;
/// Range of a channel without values.
const NO_VALUE: (f32, f32) = (f32::INFINITY, f32::NEG_INFINITY);

/// Record of `channels` quantities over time, of limited size. A copy shares the past with its original.
#[derive(Clone, Debug)]
pub struct History {
    channels: usize,
    finest: f64,
    slots: Slots,
    /// Newest index per level.
    newest: [i64; LEVELS],
    /// Greatest index per level whose bin has been overwritten, and with it all earlier ones.
    lost: [i64; LEVELS],
    /// First value per channel; NaN until a channel added later has one. Values are stored as differences from it, so that a
    /// small motion far from zero keeps its digits.
    base: Vec<f64>,
    start: Option<f64>,
    end: f64,
}

/// The slots of the bins, level by level.
#[derive(Clone, Debug)]
struct Slots {
    channels: usize,
    chunks: Vec<Arc<Chunk>>,
}

#[derive(Clone, Debug)]
struct Chunk {
    /// Bin index (time / width) of each slot.
    indices: [i64; CHUNK],
    /// (least, greatest) per channel relative to its base, slot by slot.
    ranges: Vec<(f32, f32)>,
}

impl Slots {
    fn new(channels: usize) -> Self {
        let empty = Chunk { indices: [EMPTY; CHUNK], ranges: vec![(0.0, 0.0); CHUNK * channels] };
        Self { channels, chunks: vec![empty.into(); LEVELS * BINS / CHUNK] }
    }

    fn rearranged(&self, from: &[Option<usize>]) -> Self {
        let mut new = Self::new(from.len());
        for (new, old) in new.chunks.iter_mut().zip(&self.chunks) {
            if old.indices != [EMPTY; CHUNK] {
                let ranges = rearranged(&old.ranges, self.channels, from);
                *new = Arc::new(Chunk { indices: old.indices, ranges });
            }
        }
        new
    }

    /// Index of the bin in the slot of bin `index` of `level`, and its ranges.
    fn get(&self, level: usize, index: i64) -> (i64, &[(f32, f32)]) {
        let (chunk, at) = place(level, index);
        let chunk = &self.chunks[chunk];
        (chunk.indices[at], &chunk.ranges[at * self.channels..][..self.channels])
    }

    fn get_mut(&mut self, level: usize, index: i64) -> (&mut i64, &mut [(f32, f32)]) {
        let (chunk, at) = place(level, index);
        let chunk = Arc::make_mut(&mut self.chunks[chunk]);
        (&mut chunk.indices[at], &mut chunk.ranges[at * self.channels..][..self.channels])
    }
}

/// Chunk of the slot of bin `index` of `level`, and the slot's place in it.
fn place(level: usize, index: i64) -> (usize, usize) {
    let slot = level * BINS + index.rem_euclid(BINS as i64) as usize;
    (slot / CHUNK, slot % CHUNK)
}

/// Least and greatest value of a channel between the times `from` and `to`, s.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Bin {
    pub from: f64,
    pub to: f64,
    pub least: f64,
    pub greatest: f64,
}

/// A position in the record that [`History::rewind`] can go back to.
#[derive(Clone, Debug)]
pub struct Mark {
    newest: [i64; LEVELS],
    /// Ranges of the newest bin of each level.
    ranges: Vec<(f32, f32)>,
    span: Option<(f64, f64)>,
}

impl Mark {
    /// Approximate size in bytes.
    pub fn bytes(&self) -> usize {
        size_of::<Self>() + std::mem::size_of_val(self.ranges.as_slice())
    }

    /// The same position in a record of `channels` channels after [`History::rearranged`].
    pub fn rearranged(&self, channels: usize, from: &[Option<usize>]) -> Self {
        Self { newest: self.newest, ranges: rearranged(&self.ranges, channels, from), span: self.span }
    }
}

/// Rearranges ranges from slots of `channels` channels to slots of the channels `from`.
fn rearranged(ranges: &[(f32, f32)], channels: usize, from: &[Option<usize>]) -> Vec<(f32, f32)> {
    let slots = ranges.chunks_exact(channels.max(1));
    let slot = |slot: &[(f32, f32)]| {
        let range = |channel: &Option<usize>| channel.map_or(NO_VALUE, |at| slot[at]);
        from.iter().map(range).collect::<Vec<_>>()
    };
    slots.flat_map(slot).collect()
}

impl History {
    /// A record of `channels` quantities whose narrowest bins are `finest` seconds wide.
    pub fn new(channels: usize, finest: f64) -> Self {
        Self {
            channels,
            finest: if finest > 0.0 && finest.is_finite() { finest } else { 1e-6 },
            slots: Slots::new(channels),
            newest: [EMPTY; LEVELS],
            lost: [EMPTY; LEVELS],
            base: vec![0.0; channels],
            start: None,
            end: 0.0,
        }
    }

    /// The same record with other channels: `from` gives the old index of each, or `None` for a channel without values so far.
    pub fn rearranged(&self, from: &[Option<usize>]) -> Self {
        let base = |channel: &Option<usize>| channel.map_or(f64::NAN, |at| self.base[at]);
        Self {
            channels: from.len(),
            slots: self.slots.rearranged(from),
            base: from.iter().map(base).collect(),
            ..*self
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

    /// Clears the record.
    pub fn clear(&mut self) {
        self.slots = Slots::new(self.channels);
        self.newest = [EMPTY; LEVELS];
        self.lost = [EMPTY; LEVELS];
        self.start = None;
        self.end = 0.0;
    }

    /// The current position in the record.
    pub fn mark(&self) -> Mark {
        let mut ranges = Vec::with_capacity(LEVELS * self.channels);
        for (level, &index) in self.newest.iter().enumerate() {
            if index != EMPTY {
                ranges.extend_from_slice(self.slots.get(level, index).1);
            }
        }
        Mark { newest: self.newest, ranges, span: self.span() }
    }

    /// Drops everything recorded after `mark`, which must come from this record since it was last cleared.
    pub fn rewind(&mut self, mark: &Mark) {
        let Some((start, end)) = mark.span else {
            return self.clear();
        };
        (self.start, self.end) = (Some(start), end);
        self.newest = mark.newest;
        let mut stored = mark.ranges.chunks_exact(self.channels.max(1));
        for (level, &newest) in mark.newest.iter().enumerate() {
            for chunk in &mut self.slots.chunks[level * BINS / CHUNK..(level + 1) * BINS / CHUNK] {
                if chunk.indices.iter().any(|index| *index > newest) {
                    let later = Arc::make_mut(chunk).indices.iter_mut().filter(|index| **index > newest);
                    later.for_each(|index| *index = EMPTY);
                }
            }
            // The mark restores its newest bin; of later ones none is lost any more.
            self.lost[level] = self.lost[level].min(newest.saturating_sub(1));
            if newest != EMPTY
                && let Some(ranges) = stored.next()
            {
                let (index, slot) = self.slots.get_mut(level, newest);
                *index = newest;
                slot.copy_from_slice(ranges);
            }
        }
    }

    /// Records one value per channel at `time`, s; NaN means no value. Times that are not finite, or earlier than the latest, are
    /// ignored.
    pub fn push(&mut self, time: f64, values: &[f64]) {
        if !time.is_finite() || (self.start.is_some() && time < self.end) {
            return;
        }
        debug_assert_eq!(values.len(), self.channels);
        if self.start.is_none() {
            self.start = Some(time);
            for (base, &value) in self.base.iter_mut().zip(values) {
                *base = if value.is_finite() { value } else { 0.0 };
            }
        }
        self.end = time;
        let index = self.index(0, time);
        let is_new = self.newest[0] != index;
        if is_new {
            self.close(0);
            self.open(0, index);
        }
        let (_, slot) = self.slots.get_mut(0, index);
        let slot = slot.iter_mut().zip(values).zip(&mut self.base);
        for ((range, &value), base) in slot {
            if base.is_nan() && value.is_finite() {
                *base = value;
            }
            let base = *base;
            let stored = if value.is_nan() { NO_VALUE } else { ((value - base) as f32, (value - base) as f32) };
            *range = if is_new { stored } else { join(*range, stored) };
        }
    }

    /// Raises the bins at `time` so that `channel` reaches `value`: a peak between two steps. One that is lower than what is there, as that
    /// of one place of a joint that touches at several, changes nothing.
    pub fn raise(&mut self, time: f64, channel: usize, value: f64) {
        if channel >= self.channels || !time.is_finite() || !value.is_finite() {
            return;
        }
        let stored = (value - self.base[channel]) as f32;
        for level in 0..LEVELS {
            let index = self.index(level, time);
            if self.slots.get(level, index).0 == index {
                let range = &mut self.slots.get_mut(level, index).1[channel];
                *range = join(*range, (stored.max(range.0), stored));
            }
        }
    }

    /// Appends the record of `channel` from `from` to `to`, s, to `out`, in order of time, in at most `most_bins` bins plus one
    /// beyond each end. The last bin ends where the record ends; a gap between bins means that nothing was recorded there.
    pub fn bins(&self, channel: usize, from: f64, to: f64, most_bins: usize, out: &mut Vec<Bin>) {
        if channel >= self.channels || to <= from {
            return;
        }
        let Some((start, end)) = self.span() else {
            return;
        };
        let (from, to) = (from.max(start), to.min(end));
        let level = self.level(from, to, most_bins);
        let (width, complete) = (self.width(level), self.complete(level));
        // If the first bin is empty, start from the last non-empty one before it.
        let (mut first, oldest) = (self.index(level, from), self.index(level, start));
        while first > oldest.max(self.lost[level].saturating_add(1))
            && self.range(level, first, complete, channel).is_none()
        {
            first -= 1;
        }
        for index in first..=self.index(level, to) {
            if let Some((least, greatest)) = self.range(level, index, complete, channel)
                && least <= greatest
            {
                out.push(Bin {
                    from: (index as f64 * width).max(start),
                    to: ((index + 1) as f64 * width).min(end),
                    least,
                    greatest,
                });
            }
        }
    }

    /// The whole record in at most `most_bins` rows: midpoint of each bin, s, then (least, greatest) of each channel; least above
    /// greatest if it has no value there.
    pub fn rows(&self, most_bins: usize) -> Vec<(f64, Vec<(f64, f64)>)> {
        let Some((start, end)) = self.span() else {
            return Vec::new();
        };
        let level = self.level(start, end, most_bins);
        let (width, complete) = (self.width(level), self.complete(level));
        (self.index(level, start)..=self.index(level, end))
            .filter_map(|index| {
                let values: Option<Vec<(f64, f64)>> =
                    (0..self.channels).map(|channel| self.range(level, index, complete, channel)).collect();
                let time = ((index as f64 + 0.5) * width).clamp(start, end);
                values.map(|values| (time, values))
            })
            .collect()
    }

    /// The finest level at which `most_bins` bins cover `from` to `to`, s, and the bins still exist.
    fn level(&self, from: f64, to: f64, most_bins: usize) -> usize {
        // Two spare bins: the window seldom starts and ends on a bin's edge.
        let most_bins = most_bins.clamp(2, BINS - 2) as f64;
        (0..LEVELS)
            .find(|&level| (to - from) / self.width(level) <= most_bins && self.index(level, from) > self.lost[level])
            .unwrap_or(LEVELS - 1)
    }

    /// Width of the narrowest bins that still exist from `time` on, s.
    pub fn resolution(&self, time: f64) -> f64 {
        let exists = |level: &usize| self.index(*level, time) > self.lost[*level];
        self.width((0..LEVELS).find(exists).unwrap_or(LEVELS - 1))
    }

    fn width(&self, level: usize) -> f64 {
        self.finest * (1_u64 << level) as f64
    }

    fn index(&self, level: usize, time: f64) -> i64 {
        // Shifting the finest index keeps the levels nested whatever the rounding of the division.
        ((time / self.finest).floor() as i64) >> level
    }

    /// First bin of `level` into which finer levels have yet to be merged.
    fn complete(&self, level: usize) -> i64 {
        let newest = self.newest[..level].iter().enumerate();
        let above = newest.map(|(below, index)| index >> (level - below));
        above.min().unwrap_or(i64::MAX)
    }

    /// Range of `channel` in one bin, including values of finer levels not yet merged into it; bins before `complete` have none
    /// of these.
    fn range(&self, level: usize, index: i64, complete: i64, channel: usize) -> Option<(f64, f64)> {
        let mut merged: Option<(f32, f32)> = None;
        for below in if index < complete { level } else { 0 }..=level {
            let at = if below == level { index } else { self.newest[below] };
            if at == EMPTY || at >> (level - below) != index {
                continue;
            }
            let (stored, ranges) = self.slots.get(below, at);
            if stored == at {
                let range = ranges[channel];
                merged = Some(merged.map_or(range, |other| join(other, range)));
            }
        }
        let base = self.base[channel];
        let absolute = |relative: f32| {
            let value = base + f64::from(relative);
            // The base cancels this value to within f32 precision: report an exact zero.
            if value.abs() <= f64::from(f32::EPSILON) * base.abs() { 0.0 } else { value }
        };
        merged.map(|(least, greatest)| (absolute(least), absolute(greatest)))
    }

    /// Merges the newest bin of `level` into the level above.
    fn close(&mut self, level: usize) {
        let index = self.newest[level];
        if index == EMPTY || level + 1 == LEVELS {
            return;
        }
        let above = index >> 1;
        let is_new = self.newest[level + 1] != above;
        if is_new {
            self.close(level + 1);
            self.open(level + 1, above);
        }
        let (chunk, at) = place(level, index);
        let chunk = self.slots.chunks[chunk].clone();
        let (_, targets) = self.slots.get_mut(level + 1, above);
        for (target, &range) in targets.iter_mut().zip(&chunk.ranges[at * self.channels..]) {
            *target = if is_new { range } else { join(*target, range) };
        }
    }

    fn open(&mut self, level: usize, index: i64) {
        self.newest[level] = index;
        self.lost[level] = self.lost[level].max(index - BINS as i64);
        *self.slots.get_mut(level, index).0 = index;
    }
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

    fn bins(history: &History, channel: usize, from: f64, to: f64, most: usize) -> Vec<Bin> {
        let mut bins = Vec::new();
        history.bins(channel, from, to, most, &mut bins);
        bins
    }

    #[test]
    fn every_extreme_is_retained_at_every_bin_width() {
        let mut history = History::new(2, 1e-5);
        for n in 0..200_000_u64 {
            let spike = if n == 123_456 { 50.0 } else { wave(n) };
            history.push(n as f64 * 1e-5, &[spike, -spike]);
        }
        for window in [1.0, 1.9, 2.0] {
            let bins = bins(&history, 0, 2.0 - window, 2.0, 500);
            assert!((250..=502).contains(&bins.len()), "{}", bins.len());
            let least = bins.iter().map(|b| b.least).fold(f64::MAX, f64::min);
            assert!((least + 1.0).abs() < 1e-6, "window {window}: {least}");
            let spikes: Vec<&Bin> = bins.iter().filter(|b| b.greatest > 1.0).collect();
            assert_eq!((spikes.len(), spikes[0].greatest), (1, 50.0));
            let at = spikes[0];
            assert!(at.from <= 1.23456 && 1.23456 < at.to, "{at:?}");
        }
    }

    #[test]
    fn bins_are_in_order_within_the_window_and_end_with_the_record() {
        let mut history = History::new(1, 1e-6);
        for n in 0..50_000_u64 {
            history.push(n as f64 * 1e-5, &[wave(n)]);
        }
        let range = bins(&history, 0, 0.2, 0.3, 300);
        assert!(range.len() > 100, "{}", range.len());
        assert!(range.windows(2).all(|w| w[0].to == w[1].from));
        let width = 0.1 / 150.0;
        for bin in range {
            assert!(bin.from > 0.2 - width && bin.to < 0.3 + width);
            let middle = libm::sin((bin.from + bin.to) * 50.0);
            assert!((bin.least - middle).abs() < 0.1 && (bin.greatest - middle).abs() < 0.1);
        }
        // The window has fewer entries than bins: it begins with the entry before it.
        let range = bins(&history, 0, 0.499_953, 0.499_973, 300);
        assert!(range[0].from < 0.499_952 && range.len() == 3, "{range:?}");
        let range = bins(&history, 0, 0.0, 1.0, 300);
        assert_eq!(range[0].from, 0.0);
        assert_eq!(range[range.len() - 1].to, 49_999.0 * 1e-5);
    }

    #[test]
    fn the_latest_value_is_available_immediately() {
        let mut history = History::new(1, 1e-6);
        for n in 0..1000 {
            history.push(f64::from(n) * 1e-3, &[0.0]);
        }
        history.push(1.0, &[7.0]);
        let bins = bins(&history, 0, 0.0, 1.0, 100);
        assert_eq!(bins[bins.len() - 1].greatest, 7.0);
    }

    #[test]
    fn a_small_motion_far_from_zero_keeps_its_digits_and_zero_stays_exact() {
        let mut history = History::new(2, 1e-5);
        for n in 0..1000_u64 {
            let time = (n as f64 + 0.5) * 1e-5;
            history.push(time, &[0.203_441 + 1e-12 * wave(n), 1.6 * f64::from(n < 9)]);
        }
        let range = bins(&history, 0, 0.0, 1e-2, 1000);
        assert_eq!(range.len(), 1000);
        for (n, bin) in range.iter().enumerate() {
            let expected = 0.203_441 + 1e-12 * wave(n as u64);
            assert!((bin.least - expected).abs() < 1e-15, "{n}: {bin:?}");
        }
        let range = bins(&history, 1, 0.0, 1e-2, 1000);
        assert_eq!(range[range.len() - 1].greatest, 0.0);
    }

    #[test]
    fn a_peak_between_steps_widens_its_bin() {
        let mut history = History::new(2, 1e-5);
        for n in 0..1000 {
            history.push(f64::from(n) * 1e-4, &[1.0, 2.0]);
        }
        history.raise(0.05, 0, 9.0);
        for most in [50, 500] {
            let range = bins(&history, 0, 0.0, 0.1, most);
            let peak = range.iter().find(|b| b.greatest == 9.0);
            let peak = peak.expect("the peak is stored");
            assert!(peak.from <= 0.05 && 0.05 < peak.to);
            let other = bins(&history, 1, 0.0, 0.1, most);
            assert!(other.iter().all(|b| (b.least, b.greatest) == (2.0, 2.0)));
        }
    }

    #[test]
    fn rewinding_removes_everything_recorded_later() {
        let push = |history: &mut History, from: u64, to: u64| {
            for n in from..to {
                history.push(n as f64 * 1e-5, &[wave(n), n as f64]);
            }
        };
        let mut history = History::new(2, 1e-6);
        let nothing = history.mark();
        push(&mut history, 0, 3_333);
        let mark = history.mark();
        let (before, rows) = (bins(&history, 0, 0.0, 1.0, 700), history.rows(70));
        push(&mut history, 3_333, 60_000);
        history.raise(0.033_32, 0, 9.0);
        assert!(history.rows(70) != rows);
        history.rewind(&mark);
        assert_eq!(history.span(), Some((0.0, 3_332.0 * 1e-5)));
        assert!(history.rows(70) == rows);
        // Bins overwritten after the mark are still available at coarser levels.
        let after = bins(&history, 0, 0.0, 1.0, 700);
        let ends = |bins: &[Bin]| (bins[0].from, bins[bins.len() - 1].to);
        assert_eq!(ends(&after), ends(&before));
        let mut straight = history.clone();
        push(&mut straight, 3_333, 9_000);
        let mut anew = History::new(2, 1e-6);
        push(&mut anew, 0, 9_000);
        assert!(straight.rows(70) == anew.rows(70));
        history.rewind(&nothing);
        assert_eq!((history.span(), history.rows(9).len()), (None, 0));
    }

    #[test]
    fn what_follows_a_rewound_record_is_as_fine_as_ever() {
        let mut history = History::new(1, 1e-6);
        let push = |history: &mut History, from: u64, to: u64| {
            (from..to).for_each(|n| history.push(n as f64 * 1e-6, &[wave(n)]));
        };
        push(&mut history, 0, 10_000);
        let mark = history.mark();
        push(&mut history, 10_000, 900_000);
        assert!(history.resolution(0.01) > 1e-4);
        history.rewind(&mark);
        push(&mut history, 10_000, 11_000);
        assert_eq!([0.01, 0.011].map(|time| history.resolution(time)), [1e-6; 2]);
        let fine = bins(&history, 0, 0.01, 0.011, 2000);
        assert!(fine.len() > 990, "{}", fine.len());
        // What was overwritten is not available again.
        assert!(history.resolution(0.005) > 1e-6);
    }

    #[test]
    fn an_old_window_is_available_at_a_coarser_level_until_the_record_is_cleared() {
        let mut history = History::new(1, 1e-6);
        for n in 0..200_000_u64 {
            history.push(n as f64 * 1e-4, &[n as f64]);
        }
        let range = bins(&history, 0, 0.0, 20.0, 400);
        assert_eq!(range[0].least, 0.0);
        assert_eq!(range[range.len() - 1].greatest, 199_999.0);
        history.clear();
        assert!(bins(&history, 0, 0.0, 20.0, 400).is_empty() && history.span().is_none());
    }

    #[test]
    fn missing_values_are_distinguished_from_recorded_ones() {
        let mut history = History::new(2, 1e-5);
        for n in 0..3000_u64 {
            let late = if n < 1000 { f64::NAN } else { wave(n) };
            history.push(n as f64 * 1e-4, &[wave(n), late]);
        }
        assert!(history.rows(40) == history.clone().rows(40));
        for most in [40, 900] {
            let range = bins(&history, 1, 0.0, 0.3, most);
            assert!(range[0].to > 0.1 && range[0].from <= 0.1 + 1e-9);
            assert!(range.iter().all(|b| b.least.is_finite() && b.greatest <= 1.0));
            assert_eq!(bins(&history, 0, 0.0, 0.3, most)[0].from, 0.0);
        }
        let rows = history.rows(40);
        assert!(rows[0].1[1].0 > rows[0].1[1].1);
    }

    #[test]
    fn a_channel_added_later_has_no_past_and_the_others_keep_theirs() {
        let mut history = History::new(2, 1e-5);
        let mut straight = History::new(2, 1e-5);
        let at = |n: u64| n as f64 * 1e-4;
        let values = |n: u64| [wave(n), 0.2 + 1e-9 * wave(n)];
        for n in 0..1000 {
            history.push(at(n), &values(n));
            straight.push(at(n), &values(n));
        }
        let mark = history.mark();
        // The second channel comes first, then a new one; the first is dropped.
        let from = [Some(1), None];
        let (mut history, mark) = (history.rearranged(&from), mark.rearranged(2, &from));
        assert_eq!(history.channels(), 2);
        let push = |history: &mut History, straight: &mut History| {
            for n in 1000..3000 {
                // A small motion far from zero.
                history.push(at(n), &[values(n)[1], 7.0 + 1e-9 * wave(n)]);
                straight.push(at(n), &values(n));
            }
        };
        push(&mut history, &mut straight);
        for most in [40, 900] {
            let range = bins(&history, 1, 0.0, 0.3, most);
            assert!(range[0].from <= 0.1 && range[0].to > 0.1);
            assert!(range.iter().all(|b| (b.least - 7.0).abs() < 1.1e-9));
            assert!(range.iter().any(|b| b.least > 7.0 + 0.9e-9));
            assert!(range.iter().any(|b| b.greatest < 7.0 + 0.5e-9));
            let other = bins(&history, 0, 0.0, 0.3, most);
            assert!(other == bins(&straight, 1, 0.0, 0.3, most));
        }
        let later = bins(&history, 1, 0.0, 0.3, 40);
        history.rewind(&mark);
        assert!(bins(&history, 1, 0.0, 0.3, 40).is_empty());
        push(&mut history, &mut straight);
        assert!(bins(&history, 1, 0.0, 0.3, 40) == later);
    }

    #[test]
    fn values_at_earlier_times_are_ignored() {
        let mut history = History::new(1, 1e-6);
        history.push(1.0, &[1.0]);
        history.push(0.5, &[2.0]);
        history.push(f64::NAN, &[3.0]);
        assert_eq!(history.span(), Some((1.0, 1.0)));
    }
}
