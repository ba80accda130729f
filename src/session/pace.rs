//! Pacing against the wall clock: the target time of each frame, its stepping budget, and the bottleneck if the target is missed.
//! This module reads no clock: the caller measures times and passes them in. They affect the number of steps per frame, but not
//! the steps.

/// Longest frame to catch up with, s, unless the one before was as long: after a hitch or a hidden window the run does not race.
pub const LONGEST_FRAME: f64 = 0.25;

/// A gap longer than this, s, is a pause, not a frame.
pub const REST: f64 = 2.0;

/// Stepping budget of a frame of 1/60 s, s.
pub const USUAL_BUDGET: f64 = 0.012;

/// Largest stepping budget, s, however slow drawing is, so that the interface stays responsive.
pub const MAX_BUDGET: f64 = 0.25;

/// Longest period of stepping between two frames, s: user input waits until it ends.
pub const LONGEST_STEPPING: f64 = 0.008;

/// Averaging time of the achieved time scale, s.
const AVERAGE: f64 = 0.5;

/// Range of the time scale: from 1:10 000 slow motion to real time.
pub const SCALE_RANGE: (f64, f64) = (1e-4, 1.0);

/// Fraction of the requested time scale below which the run does not keep up.
const KEEPS_UP: f64 = 0.97;

/// Bottleneck that keeps the run below the requested time scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// Stepping.
    Computing,
    /// Everything else in a frame.
    Drawing,
}

/// Stepping budget, s, of a frame `dt` s after the last, of which drawing takes `drawing` s: the drawing time, less the margin
/// left in a frame of 1/60 s.
fn budget(dt: f64, drawing: f64) -> f64 {
    let usual = (0.75 * dt).clamp(0.002, USUAL_BUDGET);
    (drawing - (1.0 / 60.0 - USUAL_BUDGET)).clamp(usual, MAX_BUDGET)
}

/// Keeps the displayed time in step with the wall clock as far as the machine can keep up.
#[derive(Clone, Debug)]
pub struct Pacer {
    scale: f64,
    shown: f64,
    /// Time displayed at the end of the latest frame, s.
    base: f64,
    /// Stepping budget until the next frame, and its part within the latest frame, s.
    budget: f64,
    within: f64,
    /// Length of the latest frame, stepping time since it began, and non-stepping time of the frame before, s.
    frame: f64,
    spent: f64,
    drawing: f64,
    /// Whether stepping between frames has not kept up since the latest frame.
    behind: bool,
    advanced: f64,
    elapsed: f64,
}

impl Default for Pacer {
    fn default() -> Self {
        Self {
            scale: 0.02,
            shown: 0.0,
            base: 0.0,
            budget: USUAL_BUDGET,
            within: USUAL_BUDGET,
            frame: 0.0,
            spent: 0.0,
            drawing: 0.0,
            behind: false,
            advanced: 0.0,
            elapsed: 0.0,
        }
    }
}

impl Pacer {
    /// Requested time scale: simulated seconds per second.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Requests `scale` simulated seconds per second, clamped to [`SCALE_RANGE`].
    pub fn set_scale(&mut self, scale: f64) {
        if scale.is_finite() {
            self.scale = scale.clamp(SCALE_RANGE.0, SCALE_RANGE.1);
            self.forget_average();
        }
    }

    /// Displayed simulated time, s.
    pub fn shown(&self) -> f64 {
        self.shown
    }

    /// Time displayed at the end of the latest frame, s.
    pub fn shown_before(&self) -> f64 {
        self.base
    }

    /// Displays `time`, as after a reset or a single step.
    pub fn jump(&mut self, time: f64) {
        (self.shown, self.base, self.behind) = (time, time, false);
        (self.frame, self.spent, self.drawing) = (0.0, 0.0, 0.0);
        self.forget_average();
    }

    /// Starts a frame `dt` seconds after the last; returns the simulated time to reach.
    pub fn begin(&mut self, dt: f64) -> f64 {
        let dt = if dt.is_finite() { dt.max(0.0) } else { 0.0 };
        let frame = if dt < REST { dt } else { 0.0 };
        let drawing = (frame - self.spent).max(0.0);
        // A single slow frame is a hitch: only two in a row raise the budget.
        self.budget = budget(dt, drawing.min(self.drawing));
        self.within = if std::mem::take(&mut self.behind) { self.budget.min(LONGEST_STEPPING) } else { self.budget };
        let passed = dt.min(LONGEST_FRAME.max(self.frame));
        (self.frame, self.drawing) = (frame, drawing);
        self.target(passed)
    }

    /// Where the simulation should be `passed` seconds after the latest frame.
    fn target(&self, passed: f64) -> f64 {
        (self.base + passed * self.scale).max(self.shown)
    }

    /// Starts a period of stepping between two frames, `since` seconds after the first of them began. Returns the simulated time
    /// to reach, or `None` if that frame is already too long to catch up with.
    pub fn begin_between(&self, since: f64) -> Option<f64> {
        (since < LONGEST_FRAME.max(self.frame)).then(|| self.target(since))
    }

    /// Whether another step may start after `spent` seconds of stepping in this period.
    pub fn may_step_between(&self, spent: f64) -> bool {
        spent < LONGEST_STEPPING && self.has_budget(spent)
    }

    /// Whether the budget allows `more` seconds of stepping before the next frame.
    fn has_budget(&self, more: f64) -> bool {
        self.spent + more < self.budget
    }

    /// Ends the period, like [`Self::end`]. Returns whether another one may follow, and whether the simulation is still behind.
    pub fn end_between(&mut self, target: f64, reached: f64, spent: f64) -> (bool, bool) {
        self.spent += spent;
        self.shown = target.min(reached).max(self.shown);
        self.behind = reached < target;
        (self.has_budget(0.0), self.behind)
    }

    /// Non-stepping time of the frame before the latest [`Self::begin`], s.
    pub fn drawing(&self) -> f64 {
        self.drawing
    }

    /// Whether another step may start after `spent` seconds of stepping in this frame.
    pub fn may_step(&self, spent: f64) -> bool {
        spent < self.within
    }

    /// Ends the frame begun `dt` seconds after the last: `target` is what [`Self::begin`] returned, `reached` the time of
    /// the simulation, `spent` how long it stepped, s. Any shortfall is dropped, not carried over.
    pub fn end(&mut self, dt: f64, target: f64, reached: f64, spent: f64) {
        self.spent = spent;
        let shown = target.min(reached).max(self.shown);
        // A longer pause is not a frame and says nothing about the machine's speed.
        if dt.is_finite() && dt < REST {
            let keep = libm::exp(-dt / AVERAGE);
            self.advanced = self.advanced * keep + (shown - self.base);
            self.elapsed = self.elapsed * keep + dt;
        }
        (self.shown, self.base) = (shown, shown);
    }

    /// Simulated seconds per second achieved recently; `None` before the first measurement.
    pub fn reached_scale(&self) -> Option<f64> {
        (self.elapsed > 0.05).then(|| self.advanced / self.elapsed)
    }

    /// Bottleneck on a machine that simulates `capacity` seconds per second of stepping; `None` while the run keeps up. Stepping
    /// reduces the requested scale to the capacity, and drawing reduces that to the achieved scale; the larger ratio is the
    /// bottleneck.
    pub fn limit(&self, capacity: Option<f64>) -> Option<Limit> {
        let reached = self.reached_scale()?;
        let slow = capacity.is_some_and(|capacity| capacity * capacity < self.scale * reached);
        let limit = if slow { Limit::Computing } else { Limit::Drawing };
        (reached < KEEPS_UP * self.scale).then_some(limit)
    }

    fn forget_average(&mut self) {
        self.advanced = 0.0;
        self.elapsed = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs `frames` frames of `dt` on a machine that simulates `speed` seconds per second of stepping.
    fn run(pacer: &mut Pacer, frames: usize, dt: f64, speed: f64, step: f64) -> f64 {
        let mut time = pacer.shown();
        for _ in 0..frames {
            let target = pacer.begin(dt);
            let mut spent = 0.0;
            while time < target && pacer.may_step(spent) {
                time += step;
                spent += step / speed;
            }
            assert!(spent < USUAL_BUDGET + step / speed, "a frame never steps longer than its budget");
            pacer.end(dt, target, time, spent);
        }
        time
    }

    #[test]
    fn a_fast_machine_reaches_the_requested_scale() {
        let mut pacer = Pacer::default();
        pacer.set_scale(0.5);
        run(&mut pacer, 120, 1.0 / 60.0, 10.0, 1e-5);
        assert!((pacer.shown() - 1.0).abs() < 1e-9);
        let reached = pacer.reached_scale().expect("measured over two seconds");
        assert!((reached - 0.5).abs() < 1e-9, "{reached}");
    }

    #[test]
    fn a_slow_machine_reports_the_scale_that_it_reaches() {
        let mut pacer = Pacer::default();
        pacer.set_scale(1.0);
        run(&mut pacer, 240, 1.0 / 60.0, 0.5, 1e-5);
        let reached = pacer.reached_scale().expect("measured");
        // 12 ms of stepping at half speed in a frame of 16.7 ms.
        assert!((reached - 0.5 * 0.012 * 60.0).abs() < 0.01, "{reached}");
    }

    #[test]
    fn a_hitch_is_not_caught_up_with() {
        let mut pacer = Pacer::default();
        pacer.set_scale(1.0);
        run(&mut pacer, 10, 1.0 / 60.0, 10.0, 1e-5);
        let before = pacer.shown();
        run(&mut pacer, 1, 30.0, 1000.0, 1e-5);
        assert!(pacer.shown() - before <= LONGEST_FRAME + 1e-12);
        let reached = pacer.reached_scale().expect("measured");
        assert!((reached - 1.0).abs() < 0.02, "the pause is no frame: {reached}");
    }

    #[test]
    fn many_frames_fit_in_one_step_of_slow_motion() {
        let mut pacer = Pacer::default();
        pacer.set_scale(1e-4);
        let step = 1e-5;
        let mut time = 0.0;
        let mut last = 0.0;
        for _ in 0..60 {
            let target = pacer.begin(1.0 / 60.0);
            while time < target {
                time += step;
            }
            pacer.end(1.0 / 60.0, target, time, 0.0);
            let moved = pacer.shown() - last;
            assert!((moved - 1e-4 / 60.0).abs() < 1e-12, "every frame moves by the same amount: {moved}");
            last = pacer.shown();
        }
        assert!(time - last <= step, "the shown time lies within the latest step");
    }

    #[test]
    fn shown_time_never_runs_backwards() {
        let mut pacer = Pacer::default();
        pacer.jump(0.2);
        let target = pacer.begin(f64::NAN);
        pacer.end(f64::NAN, target, 0.1, 0.0);
        assert_eq!(pacer.shown(), 0.2);
    }

    /// Runs `frames` frames in real time, with `drawing` s of drawing each, on a machine that simulates `speed` seconds per
    /// second of stepping, in steps of `step` s; returns the longest frame, s.
    fn drawn(pacer: &mut Pacer, frames: usize, drawing: f64, speed: f64, step: f64) -> f64 {
        let (mut time, mut dt, mut longest) = (pacer.shown(), 1.0 / 60.0, 0.0_f64);
        for _ in 0..frames {
            let (target, mut spent) = (pacer.begin(dt), 0.0);
            while time < target && pacer.may_step(spent) {
                time += step;
                spent += step / speed;
            }
            pacer.end(dt, target, time, spent);
            dt = drawing + spent;
            longest = longest.max(dt);
        }
        longest
    }

    #[test]
    fn stepping_gets_as_much_time_as_slow_drawing() {
        // A chain that could run at 0.4 of real time, at three frames per second with the usual budget.
        let (drawing, speed, step) = (1.0 / 3.0 - USUAL_BUDGET, 0.4, 1e-4);
        let mut pacer = Pacer::default();
        pacer.set_scale(1.0);
        let longest = drawn(&mut pacer, 100, drawing, speed, step);
        assert!(longest < drawing + MAX_BUDGET + step / speed, "{longest}");
        let reached = pacer.reached_scale().expect("measured");
        let share = MAX_BUDGET / (MAX_BUDGET + drawing);
        assert!((reached / speed - share).abs() < 0.01, "{reached}");
        assert!(reached > 10.0 * speed * USUAL_BUDGET * 3.0, "{reached}");
        assert_eq!(pacer.limit(Some(speed)), Some(Limit::Computing));
        // Below the bound the shares are equal, except for the margin of a usual frame.
        let mut pacer = Pacer::default();
        pacer.set_scale(1.0);
        drawn(&mut pacer, 100, 0.1, speed, step);
        let reached = pacer.reached_scale().expect("measured");
        assert!((reached / speed - 0.488).abs() < 0.01, "{reached}");
    }

    #[test]
    fn successive_slow_frames_are_caught_up_with_completely() {
        let mut pacer = Pacer::default();
        pacer.set_scale(1.0);
        drawn(&mut pacer, 20, 0.6, 1000.0, 1e-4);
        let before = pacer.shown();
        drawn(&mut pacer, 11, 0.6, 1000.0, 1e-4);
        // The first frame of the second call is short, so the next slow frame again counts as the first.
        let passed = pacer.shown() - before;
        assert!((passed - (1.0 / 60.0 + 0.25 + 9.0 * 0.6)).abs() < 0.02, "{passed}");
    }

    #[test]
    fn a_hitch_does_not_raise_the_stepping_budget() {
        let mut pacer = Pacer::default();
        pacer.set_scale(1.0);
        for dt in [1.0 / 60.0, 1.0 / 60.0, 0.9, 1.0 / 60.0, 5.0, 5.0] {
            let target = pacer.begin(dt);
            assert!(!pacer.may_step(USUAL_BUDGET), "after {dt} s");
            pacer.end(dt, target, target, 0.0);
        }
    }

    #[test]
    fn budgets_at_common_refresh_rates_have_their_stated_values() {
        // The wait for the screen counts as drawing.
        for (hertz, usual) in [(60.0, 0.012), (120.0, 0.00625), (30.0, 0.0286)] {
            let dt = 1.0 / hertz;
            assert!((budget(dt, dt) - usual).abs() < 1e-4, "{hertz} Hz");
        }
    }

    /// Runs frames with `drawing` s of drawing on a machine that simulates `speed` seconds per second of stepping and also steps
    /// between frames, while another processor waits `idle` s for the screen; returns the longest period of stepping, s.
    fn stepped_between(pacer: &mut Pacer, frames: usize, drawing: f64, idle: f64, speed: f64) -> f64 {
        let (mut time, mut dt, mut longest) = (pacer.shown(), drawing + idle, 0.0_f64);
        let step = 1e-5;
        for _ in 0..frames {
            let (target, mut spent) = (pacer.begin(dt), 0.0);
            while time < target && pacer.may_step(spent) {
                (time, spent) = (time + step, spent + step / speed);
            }
            pacer.end(dt, target, time, spent);
            longest = longest.max(spent);
            let mut since = drawing + spent;
            while let Some(target) = pacer.begin_between(since).filter(|_| since < drawing + idle) {
                let mut spent = 0.0;
                while time < target && pacer.may_step_between(spent) {
                    (time, spent) = (time + step, spent + step / speed);
                }
                let shown = pacer.shown();
                let (another, behind) = pacer.end_between(target, time, spent);
                assert!(
                    pacer.shown() >= shown && time - pacer.shown() <= step,
                    "what is shown is within the latest step"
                );
                longest = longest.max(spent);
                since += spent + if behind { 0.0 } else { LONGEST_STEPPING };
                if !another {
                    break;
                }
            }
            dt = since.max(drawing + idle);
        }
        longest
    }

    #[test]
    fn steps_between_slow_frames_come_in_short_periods_and_reach_the_requested_scale() {
        // At speed 0.5 at most half a second per second is possible, less the time for drawing.
        for (speed, requested) in [(0.5, 0.1), (0.5, 1.0), (10.0, 1.0)] {
            let mut pacer = Pacer::default();
            pacer.set_scale(requested);
            // The first frames do not know yet that they cannot keep up.
            stepped_between(&mut pacer, 20, 0.03, 0.12, speed);
            let longest = stepped_between(&mut pacer, 100, 0.03, 0.12, speed);
            assert!(longest <= LONGEST_STEPPING + 1e-5 / speed + 1e-12, "{speed} {requested}: {longest}");
            let reached = pacer.reached_scale().expect("measured");
            // Stepping takes nearly as much time as everything else.
            let least = requested.min(0.45 * speed);
            assert!(reached > 0.98 * least && reached < 1.01 * requested, "{speed} {requested}: {reached}");
        }
    }

    #[test]
    fn the_limit_is_the_larger_of_the_two_slowdowns() {
        let limit = |requested, drawing, speed| {
            let mut pacer = Pacer::default();
            pacer.set_scale(requested);
            drawn(&mut pacer, 200, drawing, speed, 1e-5);
            pacer.limit(Some(speed))
        };
        assert_eq!(limit(1.0, 0.004, 10.0), None);
        assert_eq!(limit(1.0, 0.004, 0.2), Some(Limit::Computing));
        assert_eq!(limit(1.0, 0.1, 0.9), Some(Limit::Drawing));
        assert_eq!(limit(1.0, 0.1, 1.5), Some(Limit::Drawing));
        // Without a known capacity, stepping cannot be the limit.
        let mut pacer = Pacer::default();
        run(&mut pacer, 10, 1.0 / 60.0, 1e-3, 1e-5);
        assert_eq!(pacer.limit(None), Some(Limit::Drawing));
    }
}
