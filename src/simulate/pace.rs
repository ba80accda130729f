//! Pacing against the wall clock: how far the simulation should be after each frame. This module reads no clock; the caller
//! measures and passes times in.

/// Longest frame to catch up with, s: after a hitch or a hidden window the simulation continues instead of racing.
pub const LONGEST_FRAME: f64 = 0.25;

/// Largest stepping budget per frame, s: what drawing leaves of a 60 Hz frame.
pub const LARGEST_BUDGET: f64 = 0.012;

/// Averaging time of the achieved time scale, s.
const AVERAGE: f64 = 0.5;

/// Range of the time scale: from 1:10 000 slow motion to real time.
pub const SCALE_RANGE: (f64, f64) = (1e-4, 1.0);

/// Keeps the displayed time in step with the wall clock as far as the machine can keep up.
#[derive(Clone, Debug)]
pub struct Pacer {
    scale: f64,
    shown: f64,
    budget: f64,
    advanced: f64,
    elapsed: f64,
}

impl Default for Pacer {
    fn default() -> Self {
        Self {
            scale: 0.02,
            shown: 0.0,
            budget: LARGEST_BUDGET,
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

    /// Displays `time`, as after a reset or a single step.
    pub fn jump(&mut self, time: f64) {
        self.shown = time;
        self.forget_average();
    }

    /// Starts a frame `dt` seconds after the last; returns the simulated time to reach.
    pub fn begin(&mut self, dt: f64) -> f64 {
        let dt = if dt.is_finite() {
            dt.clamp(0.0, LONGEST_FRAME)
        } else {
            0.0
        };
        self.budget = (0.75 * dt).clamp(0.002, LARGEST_BUDGET);
        self.shown + dt * self.scale
    }

    /// Whether another step may start after `spent` seconds of stepping in this frame.
    pub fn may_step(&self, spent: f64) -> bool {
        spent < self.budget
    }

    /// Ends the frame begun `dt` seconds after the last: `target` is what [`Self::begin`] returned, `reached` the time of
    /// the simulation. Any shortfall is dropped, not carried over.
    pub fn end(&mut self, dt: f64, target: f64, reached: f64) {
        let shown = target.min(reached).max(self.shown);
        // So long a pause was no frame: it says nothing about the machine.
        if dt.is_finite() && dt < 1.0 {
            let keep = libm::exp(-dt / AVERAGE);
            self.advanced = self.advanced * keep + (shown - self.shown);
            self.elapsed = self.elapsed * keep + dt;
        }
        self.shown = shown;
    }

    /// Simulated seconds per second achieved lately; `None` before anything was measured.
    pub fn reached_scale(&self) -> Option<f64> {
        (self.elapsed > 0.05).then(|| self.advanced / self.elapsed)
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
            assert!(
                spent < LARGEST_BUDGET + step / speed,
                "a frame never steps longer than its budget"
            );
            pacer.end(dt, target, time);
        }
        time
    }

    #[test]
    fn a_fast_machine_reaches_the_asked_scale() {
        let mut pacer = Pacer::default();
        pacer.set_scale(0.5);
        run(&mut pacer, 120, 1.0 / 60.0, 10.0, 1e-5);
        assert!((pacer.shown() - 1.0).abs() < 1e-9);
        let reached = pacer.reached_scale().expect("measured over two seconds");
        assert!((reached - 0.5).abs() < 1e-9, "{reached}");
    }

    #[test]
    fn a_slow_machine_slows_down_and_says_so() {
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
        assert!(
            (reached - 1.0).abs() < 0.02,
            "the pause is no frame: {reached}"
        );
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
            pacer.end(1.0 / 60.0, target, time);
            let moved = pacer.shown() - last;
            assert!(
                (moved - 1e-4 / 60.0).abs() < 1e-12,
                "every frame moves by the same amount: {moved}"
            );
            last = pacer.shown();
        }
        assert!(
            time - last <= step,
            "the shown time lies within the latest step"
        );
    }

    #[test]
    fn shown_time_never_runs_backwards() {
        let mut pacer = Pacer::default();
        pacer.jump(0.2);
        let target = pacer.begin(f64::NAN);
        pacer.end(f64::NAN, target, 0.1);
        assert_eq!(pacer.shown(), 0.2);
    }
}
