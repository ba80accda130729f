//! Share of the processor used by a sweep while the picture moves: it yields time if the processor also draws.

/// Minimum frame rate beside a sweep, 1/s, for a picture that reaches it without one; margin of the target, because a count over
/// one second is an integer; rate above which the sweep may use more time again.
const MIN_RATE: f64 = 20.0;
const MARGIN: f64 = 0.5;
const RELAX_RATE: f64 = 30.0;
/// Averaging time of the frame rate, s; a gap of this length between two frames means that nothing moved.
const AVERAGING_TIME: f64 = 1.0;
/// Shortest and longest rest of a sweep, as multiples of its computing time; the rest is doubled or halved.
const MIN_REST: f64 = 1.0;
const MAX_REST: f64 = 8.0;
/// Frame rate below which a picture is slow by itself if it occurs at the longest rest, and the required number of counts in
/// succession.
const SLOW_PICTURE: (f64, u32) = (16.0, 3);

/// Determines the rest of the sweep's threads.
#[derive(Debug, Default)]
pub struct Throttle {
    rest: f64,
    /// Consecutive hopeless counts at the longest rest since the picture began to move.
    hopeless: u32,
    /// The latest frame, s; start of the count, s; frames since then.
    latest: Option<f64>,
    since: f64,
    frames: u32,
}

impl Throttle {
    /// Takes a frame at `now`, s; `moves`: whether the picture is animated. Returns the new rest, as a multiple of the computing
    /// time, if it changes.
    pub fn frame(&mut self, now: f64, moves: bool) -> Option<f64> {
        let before = self.rest;
        let latest = self.latest.replace(now).filter(|_| moves);
        match latest.filter(|latest| now - latest < AVERAGING_TIME) {
            None => {
                // At rest or just started: the frame rate is unknown.
                (self.since, self.frames) = (now, 0);
                if !moves {
                    (self.rest, self.hopeless) = (0.0, 0);
                }
            }
            Some(_) => {
                self.frames += 1;
                let span = now - self.since;
                if span >= AVERAGING_TIME {
                    self.adjust_rest(f64::from(self.frames) / span);
                    (self.since, self.frames) = (now, 0);
                }
            }
        }
        (self.rest != before).then_some(self.rest)
    }

    /// Adjusts the rest to a frame rate, 1/s.
    fn adjust_rest(&mut self, rate: f64) {
        let (hopeless, patience) = SLOW_PICTURE;
        if self.hopeless >= patience {
            return;
        }
        if self.rest < MAX_REST || rate >= hopeless {
            self.hopeless = 0;
        } else {
            self.hopeless += 1;
        }
        if rate > RELAX_RATE {
            let shorter = 0.5 * self.rest;
            self.rest = if shorter < MIN_REST { 0.0 } else { shorter };
        } else if rate < MIN_RATE + MARGIN {
            self.rest = if self.hopeless >= patience { 0.0 } else { (2.0 * self.rest).clamp(MIN_REST, MAX_REST) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A page that draws `free` frames per second alone, and `busy` beside a sweep that never rests.
    struct Page {
        free: f64,
        busy: f64,
        throttle: Throttle,
        rest: f64,
        now: f64,
    }

    impl Page {
        fn new(free: f64, busy: f64) -> Self {
            Self { free, busy, throttle: Throttle::default(), rest: 0.0, now: 0.0 }
        }

        /// Draws for `seconds`; returns the frame rate, 1/s.
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
    fn a_picture_that_was_fast_enough_stays_so_and_the_sweep_continues() {
        // Expected rest: the smallest power of two r for which (busy + r free) / (1 + r) suffices.
        for (free, busy, most) in [(23.0, 15.0, 4.0), (40.0, 5.0, 1.0), (60.0, 19.0, 1.0), (21.5, 15.0, 8.0)] {
            let mut page = Page::new(free, busy);
            page.draw(7.0);
            let rate = page.draw(60.0);
            assert!(rate >= MIN_RATE, "{free}, {busy}: {rate}");
            assert!(page.rest <= most, "{free}, {busy}: {}", page.rest);
        }
    }

    #[test]
    fn a_sweep_does_not_rest_where_that_is_useless_or_needless() {
        let mut slow = Page::new(13.0, 9.0);
        slow.draw(12.0);
        for _ in 0..60 {
            slow.draw(1.0);
            assert_eq!(slow.rest, 0.0, "a picture that is slow by itself");
        }
        let mut fast = Page::new(60.0, 60.0);
        fast.draw(60.0);
        assert_eq!(fast.rest, 0.0);
    }

    #[test]
    fn a_sweep_does_not_rest_while_the_picture_is_still() {
        let mut page = Page::new(23.0, 15.0);
        page.draw(10.0);
        assert!(page.rest > 0.0);
        assert_eq!(page.throttle.frame(page.now + 0.1, false), Some(0.0));
        // A long pause is not a slow frame.
        assert_eq!(page.throttle.frame(page.now + 20.0, true), None);
        assert_eq!(page.throttle.frame(page.now + 20.04, true), None);
    }
}
