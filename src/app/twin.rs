//! A second run beside the first, minimally displaced: how fast neighbouring motions diverge, without ever renormalising their
//! distance. The twin does not affect the run.

use crate::analysis::exponent::{offset, scaled_distance};
use crate::simulate::{Frame, Simulation, Snapshot};

/// The displacement, in units of the scales of the state.
pub const DISPLACEMENT: f64 = 1e-9;
/// Distances kept; at this number every second one is dropped.
const KEPT: usize = 4096;
/// The growing part ends where the distance first reaches this fraction of its largest value.
const GROWN: f64 = 0.1;
/// Fewer distances than this give no slope.
const FEWEST: usize = 8;

/// A straight line through logarithms of distances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Slope of the natural logarithm, 1/s.
    pub slope: f64,
    /// Natural logarithm of the line's distance at `from`.
    pub start: f64,
    /// Times between which it was fitted, s.
    pub from: f64,
    /// See `from`.
    pub to: f64,
}

/// Where a twin was, to take it back there.
pub struct TwinMark {
    /// When that twin began, s: no other can be taken there.
    begins: f64,
    state: Snapshot,
    steps: u64,
}

impl TwinMark {
    /// Approximate memory, bytes.
    pub fn bytes(&self) -> usize {
        self.state.bytes()
    }
}

/// The twin and its distances so far.
pub struct Twin {
    simulation: Simulation,
    /// When it began, s, and its displaced state then. While the run is taken again from before that, the twin waits.
    begins: f64,
    origin: Snapshot,
    frame: Frame,
    /// Time in s, distance in units of the scales.
    distances: Vec<[f64; 2]>,
    /// Every `stride`-th step is kept.
    stride: u64,
    steps: u64,
    /// Time that the run has reached, s, and its state there: the twin catches up when that is displayed.
    goal: f64,
    goal_state: Vec<f64>,
    ended: Option<String>,
}

impl Twin {
    /// Displaces a copy of `run` as it is now.
    pub fn new(run: &Simulation) -> Self {
        let mut simulation = Simulation::of(&run.snapshot());
        let away: Vec<f64> = offset(run.scales(), DISPLACEMENT).collect();
        simulation.displace(&away);
        let mut twin = Self {
            begins: run.time(),
            origin: simulation.snapshot(),
            simulation,
            frame: Frame::default(),
            distances: Vec::with_capacity(KEPT),
            stride: 1,
            steps: 0,
            goal: run.time(),
            goal_state: run.state().to_vec(),
            ended: None,
        };
        twin.measure();
        twin.place(run.time());
        twin
    }

    /// Begins anew from the present state of `run`. What a twin that began at the same instant knew of its distances stays.
    pub fn restart(&mut self, run: &Simulation) {
        let before = std::mem::replace(self, Self::new(run));
        if before.begins == self.begins {
            (self.distances, self.stride) = (before.distances, before.stride);
        }
    }

    /// When it began, s.
    pub fn begins(&self) -> f64 {
        self.begins
    }

    /// Where it is now.
    pub fn mark(&self) -> TwinMark {
        TwinMark { begins: self.begins, state: self.simulation.snapshot(), steps: self.steps }
    }

    /// Goes back with `run`, which has just been taken to where it was when `mark` was set. Without a mark of this twin it
    /// waits for its beginning, or begins anew where that has passed.
    pub fn go_back(&mut self, mark: Option<&TwinMark>, run: &Simulation) {
        let mark = mark.filter(|mark| mark.begins == self.begins);
        if mark.is_none() && self.begins < run.time() {
            return self.restart(run);
        }
        let (state, steps) = mark.map_or((&self.origin, 0), |mark| (&mark.state, mark.steps));
        self.simulation.restore(state);
        (self.steps, self.ended) = (steps, None);
        self.goal = self.begins.max(run.time());
        self.goal_state.copy_from_slice(run.state());
    }

    /// Forgets the distances after `time`, s: another future begins.
    pub fn cut(&mut self, time: f64) {
        let time = time.max(self.begins);
        self.distances.retain(|[at, _]| *at <= time);
    }

    /// Whether [`Self::place`] can show it at `time`, s, without being taken back.
    pub fn reaches(&self, time: f64) -> bool {
        time <= self.begins || self.simulation.step_start() < time
    }

    /// To be called after a step of `run`: the twin advances to where the run was before that step.
    pub fn follow(&mut self, run: &Simulation) {
        if run.time() <= self.begins {
            return;
        }
        self.come_to(self.goal);
        self.goal = run.time();
        self.goal_state.copy_from_slice(run.state());
    }

    /// Steps until `time`, s, lies within the latest step.
    fn come_to(&mut self, time: f64) {
        while self.ended.is_none() && self.simulation.time() < time.min(self.goal) {
            if let Err(stopped) = self.simulation.step_until(self.goal) {
                self.ended = Some(stopped.to_string());
                return;
            }
            if self.simulation.time() == self.goal {
                self.steps += 1;
                if self.steps.is_multiple_of(self.stride) {
                    self.measure();
                }
            }
        }
    }

    /// Records its distance from the run, where that is not known from before.
    fn measure(&mut self) {
        if self.distances.last().is_some_and(|[at, _]| *at >= self.goal) {
            return;
        }
        let scales = self.simulation.scales();
        let distance = scaled_distance(&self.goal_state, self.simulation.state(), scales);
        if self.distances.len() == KEPT {
            let mut keep = false;
            self.distances.retain(|_| {
                keep = !keep;
                keep
            });
            self.stride *= 2;
        }
        // Motions identical to the last bit have no logarithm of their distance.
        if distance > 0.0 && distance.is_finite() {
            self.distances.push([self.goal, distance]);
        }
    }

    /// Samples the state at `time`, s, into [`Self::frame`], limited to the twin's start and to where it ended.
    pub fn place(&mut self, time: f64) {
        self.come_to(time);
        self.simulation.sample(time, &mut self.frame);
    }

    /// The displayed state.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// Time in s and distance in units of the scales, in order.
    pub fn distances(&self) -> &[[f64; 2]] {
        &self.distances
    }

    /// Why it ended before the run.
    pub fn ended(&self) -> Option<&str> {
        self.ended.as_deref()
    }

    /// Slope of the logarithm over the growing part, by least squares: from the displacement to where the distance first
    /// reaches a tenth of its largest value; over everything where it does not grow.
    pub fn fit(&self) -> Option<Fit> {
        let largest = self.distances.iter().map(|d| d[1]).fold(0.0, f64::max);
        let end = self.distances.iter().position(|d| d[1] >= GROWN * largest);
        let growing = &self.distances[..end.map_or(0, |end| end + 1)];
        fit(if growing.len() < FEWEST { &self.distances } else { growing })
    }
}

/// The line through ln(distance) over time.
fn fit(distances: &[[f64; 2]]) -> Option<Fit> {
    let (first, last) = (distances.first()?, distances.last()?);
    if distances.len() < FEWEST {
        return None;
    }
    let n = distances.len() as f64;
    let mean_time = distances.iter().map(|d| d[0]).sum::<f64>() / n;
    let mean = distances.iter().map(|d| libm::log(d[1])).sum::<f64>() / n;
    let (mut across, mut along) = (0.0, 0.0);
    for [time, distance] in distances {
        across += (time - mean_time) * (libm::log(*distance) - mean);
        along += (time - mean_time) * (time - mean_time);
    }
    let slope = across / along;
    slope.is_finite().then_some(Fit {
        slope,
        start: mean + slope * (first[0] - mean_time),
        from: first[0],
        to: last[0],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    #[test]
    fn the_slope_of_an_exponential_is_its_rate() {
        let grows = |t: f64| [t, 1e-9 * libm::exp(3.5 * t)];
        let line: Vec<[f64; 2]> = (0..50).map(|i| grows(f64::from(i) * 0.1)).collect();
        let found = fit(&line).expect("points");
        assert!((found.slope - 3.5).abs() < 1e-12 && (found.from, found.to) == (0.0, 4.9));
        assert!((found.start - libm::log(1e-9)).abs() < 1e-9);
        assert_eq!(fit(&line[..7]), None);
    }

    #[test]
    fn a_twin_starts_a_billionth_away_and_thins_its_record() {
        let changes = [("contact.friction".to_owned(), "0".to_owned())];
        let scene = Scene::load("spcmm", &changes).expect("built in");
        let mut run = Simulation::new(&scene).expect("starts");
        let mut twin = Twin::new(&run);
        let start = twin.distances()[0];
        assert!((start[1] / DISPLACEMENT - 1.0).abs() < 1e-6, "{start:?}");
        for _ in 0..3 * KEPT {
            run.step().expect("runs");
            let start = run.step_start();
            twin.follow(&run);
            // Whatever instant of the step is displayed, the twin is there.
            for part in [0.3, 0.9, 1.0] {
                let time = start + part * (run.time() - start);
                twin.place(time);
                assert_eq!(twin.frame().time, time);
            }
        }
        assert!(twin.distances().len() <= KEPT && twin.stride > 1);
        assert!(twin.distances().is_sorted_by(|a, b| a[0] < b[0]));
        let fit = twin.fit().expect("grows");
        println!("{fit:?}, {:?}", twin.distances().last());
        assert!(fit.slope > 0.0, "{fit:?}");
    }
}
