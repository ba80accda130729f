//! What the picture may cost while it moves: less once frames are slow, more again once there is room. At rest it has everything.

use crate::simulate::REST;
use crate::view::Quality;

/// A frame that takes longer, s, is slow, if drawing is what takes most of it.
const SLOW: f64 = 1.0 / 24.0;
/// So many slow frames in succession, or so long of them, s, lower the quality.
const PATIENCE: (u32, f64) = (12, 1.2);
/// A frame whose drawing takes less, s, leaves room.
const ROOM: f64 = 1.0 / 45.0;
/// How long there is room before the quality is raised, s: at first, and at most after raising it was of no use. It grows by a
/// factor each time, so that the quality does not swing.
const WAIT: (f64, f64) = (3.0, 120.0);
const GROWTH: f64 = 4.0;
/// A raised quality that lasts so long, s, was of use.
const TRIAL: f64 = 10.0;
/// How many times its length a frame without room takes off the time with room.
const LOSS: f64 = 8.0;
/// A picture that has not changed for so long, s, is at rest.
const STILL: f64 = 0.2;

/// A frame on the screen.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Pixels of the picture.
    pub size: [u32; 2],
    /// Whether it differs from the frame before.
    pub moves: bool,
    /// When, s of viewing.
    pub now: f64,
    /// Time since the frame before, s.
    pub dt: f64,
    /// What of it was not stepping, s.
    pub drawing: f64,
}

/// Finds the row of [`Quality::LADDER`] that the frames allow.
#[derive(Debug)]
pub struct Pace {
    row: usize,
    /// Slow frames in succession, and how long they took, s.
    slow: (u32, f64),
    /// For how long there was room, and for how long there has to be, s.
    room: f64,
    wait: f64,
    /// Time since the quality was raised, s, until it has proved to be of use.
    trial: Option<f64>,
    size: [u32; 2],
    /// The latest frame, and the latest that moved, s of viewing.
    latest: f64,
    moved: f64,
}

impl Default for Pace {
    fn default() -> Self {
        Self {
            row: 0,
            slow: (0, 0.0),
            room: 0.0,
            wait: WAIT.0,
            trial: None,
            size: [0; 2],
            latest: f64::NEG_INFINITY,
            moved: f64::NEG_INFINITY,
        }
    }
}

impl Pace {
    /// Takes a frame; returns with which quality it is drawn.
    pub fn frame(&mut self, seen: &Seen) -> Quality {
        if seen.size != self.size {
            // Another size may have more room.
            (self.size, self.wait) = (seen.size, WAIT.0);
        }
        if seen.now > self.latest {
            let goes_on = self.moved == self.latest;
            if seen.moves && goes_on && seen.dt < REST {
                self.count(seen.dt, seen.drawing);
            } else {
                self.slow = (0, 0.0);
            }
            self.latest = seen.now;
        }
        if seen.moves {
            self.moved = seen.now;
        }
        match self.until_still(seen.now) {
            Some(_) => Quality::LADDER[self.row],
            None => Quality::FULL,
        }
    }

    /// How long the picture has to stay as it is until it is at rest, s; `None` if it is.
    pub fn until_still(&self, now: f64) -> Option<f64> {
        let left = self.moved + STILL - now;
        (left > 0.0).then_some(left)
    }

    /// Takes a frame between others that moved.
    fn count(&mut self, dt: f64, drawing: f64) {
        self.slow = if dt > SLOW && 2.0 * drawing >= dt { (self.slow.0 + 1, self.slow.1 + dt) } else { (0, 0.0) };
        self.room = if drawing < ROOM { self.room + dt } else { (self.room - LOSS * dt).max(0.0) };
        let trial = self.trial.map(|trial| trial + dt);
        self.trial = trial.filter(|trial| *trial < TRIAL);
        if trial.is_some() && self.trial.is_none() {
            self.wait = WAIT.0;
        }
        let (frames, time) = self.slow;
        // One alone is a hitch.
        if frames >= PATIENCE.0 || (frames > 1 && time >= PATIENCE.1) {
            if self.trial.take().is_some() {
                self.wait = (GROWTH * self.wait).min(WAIT.1);
            }
            self.go_to((self.row + 1).min(Quality::LADDER.len() - 1));
        } else if self.row > 0 && self.room >= self.wait {
            self.trial = Some(0.0);
            self.go_to(self.row - 1);
        }
    }

    fn go_to(&mut self, row: usize) {
        (self.row, self.slow, self.room) = (row, (0, 0.0), 0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [500, 400];
    const LEAST: usize = Quality::LADDER.len() - 1;

    /// A window whose picture moves.
    #[derive(Default)]
    struct Window {
        pace: Pace,
        now: f64,
        /// Every change of the row.
        changes: Vec<(f64, usize)>,
    }

    impl Window {
        /// Moves for `time` s; drawing takes `cost` of the row, s, as a whole number of `tick`, and stepping `stepping`.
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
            let quality = self.pace.frame(&Seen { size: SIZE, moves, now: self.now, dt, drawing });
            if self.pace.row != before {
                self.changes.push((self.now, self.pace.row));
            }
            quality
        }
    }

    /// Of a screen at 60 Hz, and of one that waits for nothing.
    const SCREEN: f64 = 1.0 / 60.0;
    const FREE: f64 = 1e-6;

    #[test]
    fn the_ladder_leaves_out_one_thing_more_in_each_row_in_the_order_that_is_promised() {
        let order = |q: &Quality| {
            let light = [q.occlusion, q.samples > 1, q.fine_shadows];
            let left_out = light.map(|kept| !kept);
            (left_out, (1.0 / q.sharpness * 100.0) as u32)
        };
        let rows: Vec<_> = Quality::LADDER.iter().map(order).collect();
        for (row, next) in rows.iter().zip(&rows[1..]) {
            let lights = |row: &([bool; 3], u32)| row.0.iter().filter(|out| **out).count();
            // In this order: the first that is kept goes next, and resolution last.
            assert!(next.0.is_sorted_by(|a, b| a >= b), "{next:?}");
            if lights(row) < 3 {
                assert_eq!((lights(next), next.1), (lights(row) + 1, 100));
            } else {
                assert!(next.1 > row.1);
            }
        }
        assert_eq!(rows[0], ([false; 3], 100));
        assert_eq!(Quality::LADDER[LEAST].sharpness, 0.5, "the stated floor");
    }

    #[test]
    fn only_slow_frames_in_succession_lower_it_step_by_step() {
        let mut window = Window::default();
        window.run(100.0, SCREEN, 0.0, |_| 0.005);
        // Now and then one, and pauses.
        for _ in 0..20 {
            window.run(1.05, FREE, 0.0, |_| 0.1);
            window.now += 2.0;
            window.show(true, 2.0, 2.0);
        }
        assert_eq!(window.changes, []);
        for row in 1..=LEAST {
            window.run(1.15, FREE, 0.0, |_| 0.1);
            assert_eq!(window.pace.row, row);
        }
        window.run(100.0, FREE, 0.0, |_| 0.1);
        assert_eq!(window.pace.row, LEAST);
    }

    #[test]
    fn at_three_frames_a_second_it_falls_within_seconds() {
        let mut window = Window::default();
        window.run(9.0, FREE, 0.0, |_| 1.0 / 3.0);
        assert_eq!(window.pace.row, LEAST);
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
            assert_eq!(window.pace.row, LEAST);
            window.run(20.0, tick, 0.0, |_| 0.01);
            assert_eq!(window.pace.row, 0, "tick {tick} s");
            // Hitches now and then hold it up no longer than a moment.
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
    fn under_an_even_load_it_settles_and_does_not_swing() {
        const MINUTES: f64 = 600.0;
        // By row; the greatest leaps that software drawing showed are from four samples to one.
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
    fn at_rest_the_picture_has_everything_and_is_asked_for_once() {
        let mut window = Window::default();
        window.run(20.0, FREE, 0.0, |_| 0.1);
        window.now += 0.1;
        assert_eq!(window.show(true, 0.1, 0.1), Quality::LADDER[LEAST]);
        let wait = window.pace.until_still(window.now).expect("soon at rest");
        window.now += 0.5 * wait;
        assert_eq!(window.show(false, 0.1, 0.1), Quality::LADDER[LEAST]);
        window.now += 0.6 * wait;
        assert_eq!(window.show(false, 0.1, 0.1), Quality::FULL);
        assert_eq!(window.pace.until_still(window.now), None);
        // Moved again, it is as before at once; the gap was no frame.
        window.now += 1.0;
        assert_eq!(window.show(true, 1.0, 1.0), Quality::LADDER[LEAST]);
        assert_eq!(window.pace.slow.0, 0);
    }
}
