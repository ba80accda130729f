//! Picture quality while it moves: reduced when frames are slow, raised when there is headroom, full at rest.

use crate::session::pace::REST;
use crate::view::Quality;

/// A longer frame, s, counts as slow if drawing takes most of it.
const SLOW_FRAME: f64 = 1.0 / 24.0;
/// Number or total duration, s, of consecutive slow frames that lowers the quality.
const MAX_SLOW: (u32, f64) = (12, 1.2);
/// A frame with a shorter drawing time, s, has headroom.
const HEADROOM_FRAME: f64 = 1.0 / 45.0;
/// Headroom time before the quality is raised, s: initial value, and maximum after failed attempts. Each failure multiplies it by
/// a factor, which prevents oscillation.
const RAISE_AFTER: (f64, f64) = (3.0, 120.0);
const RAISE_AFTER_GROWTH: f64 = 4.0;
/// A raised quality that lasts this long, s, has succeeded.
const TRIAL: f64 = 10.0;
/// Weight of a frame without headroom when it is subtracted from the headroom time.
const HEADROOM_LOSS: f64 = 8.0;
/// A picture unchanged for this time, s, is at rest.
const REST_TIME: f64 = 0.2;

/// A displayed frame.
#[derive(Clone, Copy, Debug)]
pub struct ShownFrame {
    /// Pixels of the picture.
    pub size: [u32; 2],
    /// Whether it differs from the previous frame.
    pub moves: bool,
    /// Viewing time, s.
    pub now: f64,
    /// Time since the previous frame, s.
    pub dt: f64,
    /// Frame time without stepping, s.
    pub drawing: f64,
}

/// Selects the row of [`Quality::LADDER`] that the frame times permit.
#[derive(Debug)]
pub struct Pace {
    row: usize,
    /// Number of consecutive slow frames, and their total duration, s.
    slow: (u32, f64),
    /// Accumulated and required headroom time, s.
    room: f64,
    wait: f64,
    /// Time since the quality was raised, s, until the trial succeeds.
    trial: Option<f64>,
    size: [u32; 2],
    /// The latest frame, and the latest moving one, s of viewing.
    latest: f64,
    moved: f64,
}

impl Default for Pace {
    fn default() -> Self {
        Self {
            row: 0,
            slow: (0, 0.0),
            room: 0.0,
            wait: RAISE_AFTER.0,
            trial: None,
            size: [0; 2],
            latest: f64::NEG_INFINITY,
            moved: f64::NEG_INFINITY,
        }
    }
}

impl Pace {
    /// Takes a frame; returns the quality to draw it with.
    pub fn frame(&mut self, shown: &ShownFrame) -> Quality {
        if shown.size != self.size {
            // Another size may have more headroom.
            (self.size, self.wait) = (shown.size, RAISE_AFTER.0);
        }
        if shown.now > self.latest {
            let is_consecutive = self.moved == self.latest;
            if shown.moves && is_consecutive && shown.dt < REST {
                self.count_frame(shown.dt, shown.drawing);
            } else {
                self.slow = (0, 0.0);
            }
            self.latest = shown.now;
        }
        if shown.moves {
            self.moved = shown.now;
        }
        match self.time_to_rest(shown.now) {
            Some(_) => Quality::LADDER[self.row],
            None => Quality::FULL,
        }
    }

    /// Remaining time until the unchanged picture counts as at rest, s; `None` if it does already.
    pub fn time_to_rest(&self, now: f64) -> Option<f64> {
        let left = self.moved + REST_TIME - now;
        (left > 0.0).then_some(left)
    }

    /// Counts a frame between moving frames.
    fn count_frame(&mut self, dt: f64, drawing: f64) {
        self.slow = if dt > SLOW_FRAME && 2.0 * drawing >= dt { (self.slow.0 + 1, self.slow.1 + dt) } else { (0, 0.0) };
        self.room = if drawing < HEADROOM_FRAME { self.room + dt } else { (self.room - HEADROOM_LOSS * dt).max(0.0) };
        let trial = self.trial.map(|trial| trial + dt);
        self.trial = trial.filter(|trial| *trial < TRIAL);
        if trial.is_some() && self.trial.is_none() {
            self.wait = RAISE_AFTER.0;
        }
        let (frames, time) = self.slow;
        // A single slow frame is a hitch.
        if frames >= MAX_SLOW.0 || (frames > 1 && time >= MAX_SLOW.1) {
            if self.trial.take().is_some() {
                self.wait = (RAISE_AFTER_GROWTH * self.wait).min(RAISE_AFTER.1);
            }
            self.set_row((self.row + 1).min(Quality::LADDER.len() - 1));
        } else if self.row > 0 && self.room >= self.wait {
            self.trial = Some(0.0);
            self.set_row(self.row - 1);
        }
    }

    fn set_row(&mut self, row: usize) {
        (self.row, self.slow, self.room) = (row, (0, 0.0), 0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [500, 400];
    const LOWEST: usize = Quality::LADDER.len() - 1;

    /// A window with a moving picture.
    #[derive(Default)]
    struct Window {
        pace: Pace,
        now: f64,
        /// All changes of the row.
        changes: Vec<(f64, usize)>,
    }

    impl Window {
        /// Moves for `time` s; drawing takes the row's `cost`, s, rounded to a multiple of `tick`, and stepping takes `stepping`,
        /// s.
        fn run(&mut self, time: f64, tick: f64, stepping: f64, cost: impl Fn(usize) -> f64) {
            let end = self.now + time;
            while self.now < end {
                let busy = cost(self.pace.row) + stepping;
                let dt = (busy / tick - 1e-9).ceil() * tick;
                self.now += dt;
                self.show(true, dt, dt - stepping);
            }
        }

        fn show(&mut self, moves: bool, dt: f64, drawing: f64) -> Quality {
            let before = self.pace.row;
            let quality = self.pace.frame(&ShownFrame { size: SIZE, moves, now: self.now, dt, drawing });
            if self.pace.row != before {
                self.changes.push((self.now, self.pace.row));
            }
            quality
        }
    }

    /// A screen at 60 Hz, and one without vertical sync.
    const SCREEN: f64 = 1.0 / 60.0;
    const FREE: f64 = 1e-6;

    #[test]
    fn each_row_of_the_ladder_drops_one_more_feature_in_the_documented_order() {
        let order = |q: &Quality| {
            let light = [q.occlusion, q.samples > 1, q.fine_shadows];
            let left_out = light.map(|kept| !kept);
            (left_out, (1.0 / q.sharpness * 100.0) as u32)
        };
        let rows: Vec<_> = Quality::LADDER.iter().map(order).collect();
        for (row, next) in rows.iter().zip(&rows[1..]) {
            let lights = |row: &([bool; 3], u32)| row.0.iter().filter(|out| **out).count();
            // Order of reduction: the first feature still present goes next, resolution last.
            assert!(next.0.is_sorted_by(|a, b| a >= b), "{next:?}");
            if lights(row) < 3 {
                assert_eq!((lights(next), next.1), (lights(row) + 1, 100));
            } else {
                assert!(next.1 > row.1);
            }
        }
        assert_eq!(rows[0], ([false; 3], 100));
        assert_eq!(Quality::LADDER[LOWEST].sharpness, 0.5, "the stated floor");
    }

    #[test]
    fn only_slow_frames_in_succession_lower_it_step_by_step() {
        let mut window = Window::default();
        window.run(100.0, SCREEN, 0.0, |_| 0.005);
        // Occasional slow frames, and pauses.
        for _ in 0..20 {
            window.run(1.05, FREE, 0.0, |_| 0.1);
            window.now += 2.0;
            window.show(true, 2.0, 2.0);
        }
        assert_eq!(window.changes, []);
        for row in 1..=LOWEST {
            window.run(1.15, FREE, 0.0, |_| 0.1);
            assert_eq!(window.pace.row, row);
        }
        window.run(100.0, FREE, 0.0, |_| 0.1);
        assert_eq!(window.pace.row, LOWEST);
    }

    #[test]
    fn at_three_frames_a_second_it_falls_within_seconds() {
        let mut window = Window::default();
        window.run(9.0, FREE, 0.0, |_| 1.0 / 3.0);
        assert_eq!(window.pace.row, LOWEST);
    }

    #[test]
    fn stepping_that_takes_most_of_a_frame_lowers_nothing() {
        let mut window = Window::default();
        window.run(60.0, FREE, 0.05, |_| 0.02);
        assert_eq!(window.changes, []);
    }

    #[test]
    fn it_rises_again_once_the_load_is_gone() {
        for tick in [SCREEN, FREE] {
            let mut window = Window::default();
            window.run(20.0, tick, 0.0, |_| 0.1);
            assert_eq!(window.pace.row, LOWEST);
            window.run(20.0, tick, 0.0, |_| 0.01);
            assert_eq!(window.pace.row, 0, "tick {tick} s");
            // Occasional hitches delay it only briefly.
            let mut window = Window::default();
            window.run(20.0, tick, 0.0, |_| 0.1);
            for _ in 0..25 {
                window.run(1.0, tick, 0.0, |_| 0.01);
                window.now += 0.06;
                window.show(true, 0.06, 0.06);
            }
            assert_eq!(window.pace.row, 0, "tick {tick} s");
        }
    }

    #[test]
    fn under_a_constant_load_it_settles_and_does_not_oscillate() {
        const MINUTES: f64 = 600.0;
        // Drawing times by row; the largest jumps in software rendering are from four samples to one.
        let loads = [
            [0.050, 0.045, 0.018, 0.016, 0.010, 0.005],
            [0.300, 0.250, 0.100, 0.090, 0.060, 0.020],
            [0.060, 0.050, 0.030, 0.028, 0.020, 0.010],
            [0.043, 0.041, 0.020, 0.019, 0.012, 0.006],
            [0.400; 6],
            [0.030; 6],
        ];
        for load in loads {
            for tick in [SCREEN, FREE] {
                let mut window = Window::default();
                window.run(30.0, tick, 0.0, |row| load[row]);
                let (settled, before) = (window.pace.row, window.changes.len());
                let mut away = 0.0;
                let end = window.now + MINUTES;
                while window.now < end {
                    let start = window.now;
                    window.run(0.05, tick, 0.0, |row| load[row]);
                    if window.pace.row != settled {
                        away += window.now - start;
                    }
                }
                let changes = window.changes.len() - before;
                assert!(changes <= 14, "{load:?}: {:?}", window.changes);
                assert!(away < 0.02 * MINUTES, "{load:?}: {away} s");
            }
        }
    }

    #[test]
    fn at_rest_the_picture_has_full_quality_and_is_requested_once() {
        let mut window = Window::default();
        window.run(20.0, FREE, 0.0, |_| 0.1);
        window.now += 0.1;
        assert_eq!(window.show(true, 0.1, 0.1), Quality::LADDER[LOWEST]);
        let wait = window.pace.time_to_rest(window.now).expect("soon at rest");
        window.now += 0.5 * wait;
        assert_eq!(window.show(false, 0.1, 0.1), Quality::LADDER[LOWEST]);
        window.now += 0.6 * wait;
        assert_eq!(window.show(false, 0.1, 0.1), Quality::FULL);
        assert_eq!(window.pace.time_to_rest(window.now), None);
        // Moving again restores the quality at once; the gap is not a frame.
        window.now += 1.0;
        assert_eq!(window.show(true, 1.0, 1.0), Quality::LADDER[LOWEST]);
        assert_eq!(window.pace.slow.0, 0);
    }
}
