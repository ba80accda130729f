//! How much of a machine a sweep takes while the picture moves: where drawing is the processor's work, too, it gives some back.

/// Frames a second that the picture keeps if it has them without a sweep, and how many more are aimed at, as a count over a second is
/// a whole number; with so many a sweep may take more again.
const LEAST: f64 = 20.0;
const MARGIN: f64 = 0.5;
const AMPLE: f64 = 30.0;
/// Frames are counted for so long, s; a gap of that between two says that nothing moved.
const SPAN: f64 = 1.0;
/// Steps up and down in what a sweep rests, as a multiple of the time that it computes, and the most. Where that does not
/// help, the picture is slow by itself.
const MORE: f64 = 1.0;
const LESS: f64 = 0.25;
const MOST: f64 = 4.0;

/// Finds how long the computers of a sweep rest.
#[derive(Debug, Default)]
pub struct Throttle {
    rest: f64,
    /// Resting has not helped since the picture began to move.
    useless: bool,
    /// The latest frame, and the first of those that are counted, s; how many followed it.
    latest: Option<f64>,
    since: f64,
    frames: u32,
}

impl Throttle {
    /// Takes a frame at `now`, s; `moves`: whether the picture moves by itself. Returns the rest, as a multiple of the time
    /// computed, where it changes.
    pub fn frame(&mut self, now: f64, moves: bool) -> Option<f64> {
        let before = self.rest;
        let latest = self.latest.replace(now).filter(|_| moves);
        match latest.filter(|latest| now - latest < SPAN) {
            None => {
                // At rest, or just begun: nothing is known yet.
                (self.since, self.frames) = (now, 0);
                if !moves {
                    (self.rest, self.useless) = (0.0, false);
                }
            }
            Some(_) => {
                self.frames += 1;
                let span = now - self.since;
                if span >= SPAN {
                    self.judge(f64::from(self.frames) / span);
                    (self.since, self.frames) = (now, 0);
                }
            }
        }
        (self.rest != before).then_some(self.rest)
    }

    /// Takes the number of frames in a second.
    fn judge(&mut self, rate: f64) {
        if self.useless {
            return;
        }
        if rate > AMPLE {
            self.rest = (self.rest - LESS).max(0.0);
        } else if rate < LEAST + MARGIN {
            self.useless = self.rest >= MOST;
            self.rest = if self.useless { 0.0 } else { self.rest + MORE };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A page that draws `free` frames a second alone, and `busy` beside a sweep that never rests.
    struct Page {
        free: f64,
        busy: f64,
        throttle: Throttle,
        rest: f64,
        now: f64,
    }

    impl Page {
        fn new(free: f64, busy: f64) -> Self {
            Self {
                free,
                busy,
                throttle: Throttle::default(),
                rest: 0.0,
                now: 0.0,
            }
        }

        /// Draws for `seconds`; returns frames a second.
        fn draw(&mut self, seconds: f64) -> f64 {
            let (start, mut frames) = (self.now, 0);
            while self.now < start + seconds {
                self.now += (1.0 + self.rest) / (self.busy + self.rest * self.free);
                frames += 1;
                if let Some(rest) = self.throttle.frame(self.now, true) {
                    self.rest = rest;
                }
            }
            f64::from(frames) / (self.now - start)
        }
    }

    #[test]
    fn a_picture_that_was_fast_enough_stays_so_and_the_sweep_goes_on() {
        for (free, busy) in [(23.0, 15.0), (40.0, 5.0), (60.0, 19.0), (22.0, 21.5)] {
            let mut page = Page::new(free, busy);
            page.draw(6.0);
            let rate = page.draw(60.0);
            assert!(rate >= LEAST, "{free}, {busy}: {rate}");
            assert!(page.rest <= 3.0, "{free}, {busy}: {}", page.rest);
        }
    }

    #[test]
    fn nothing_is_given_up_where_that_is_of_no_use_or_of_no_need() {
        let mut slow = Page::new(13.0, 9.0);
        slow.draw(10.0);
        for _ in 0..60 {
            slow.draw(1.0);
            assert_eq!(slow.rest, 0.0, "a picture that is slow by itself");
        }
        let mut fast = Page::new(60.0, 60.0);
        fast.draw(60.0);
        assert_eq!(fast.rest, 0.0);
    }

    #[test]
    fn a_sweep_has_the_machine_while_the_picture_rests() {
        let mut page = Page::new(23.0, 15.0);
        page.draw(10.0);
        assert!(page.rest > 0.0);
        assert_eq!(page.throttle.frame(page.now + 0.1, false), Some(0.0));
        // A long pause is no slow frame.
        assert_eq!(page.throttle.frame(page.now + 20.0, true), None);
        assert_eq!(page.throttle.frame(page.now + 20.04, true), None);
    }
}
