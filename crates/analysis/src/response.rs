//! Response of a mechanism compared with its ideal motion, as in section 4.2, Figures 5 to 17 of Sheng & Chen.

use jointplay_physics::simulate::{Frame, Pose, Simulation, StartError, Stopped};
use jointplay_scene::{Scene, SceneError};

/// Coordinates of the output body: x, y, z, alpha, beta, gamma.
pub const COORDINATES: usize = 6;
/// Instants examined per step: accelerations peak within an impact's steps, not at their ends.
const OBSERVATIONS_PER_STEP: u32 = 4;

/// Largest magnitudes over a run. SI units; coordinates in the order x, y, z, alpha, beta, gamma.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Extremes {
    /// Largest |coordinate minus ideal coordinate|, m or rad; NaN if there is no ideal motion.
    pub deviation: [f64; COORDINATES],
    /// Largest |rate|, m/s or rad/s.
    pub rate: [f64; COORDINATES],
    /// Largest |second derivative|, m/s^2 or rad/s^2.
    pub acceleration: [f64; COORDINATES],
    /// Largest normal force of each ball joint, N.
    pub normal: Vec<f64>,
}

impl Extremes {
    fn new(joints: usize, has_ideal: bool) -> Self {
        Self {
            deviation: [if has_ideal { 0.0 } else { f64::NAN }; COORDINATES],
            normal: vec![0.0; joints],
            ..Self::default()
        }
    }

    fn include(&mut self, frame: &Frame, ideal: Option<&Pose>) {
        let [_, rates, accelerations] = derivatives(&frame.pose);
        for i in 0..COORDINATES {
            self.rate[i] = self.rate[i].max(rates[i].abs());
            self.acceleration[i] = self.acceleration[i].max(accelerations[i].abs());
        }
        if let Some(ideal) = ideal {
            let deviations = deviation(&frame.pose, ideal);
            for i in 0..COORDINATES {
                self.deviation[i] = self.deviation[i].max(deviations[i].abs());
            }
        }
        for (peak, joint) in self.normal.iter_mut().zip(&frame.joints) {
            *peak = peak.max(joint.normal_force.norm());
        }
    }
}

/// Coordinates, rates and second derivatives of a pose.
pub(super) fn derivatives(pose: &Pose) -> [[f64; COORDINATES]; 3] {
    let join =
        |a: &jointplay_physics::machine::Vec3, b: &jointplay_physics::machine::Vec3| [a.x, a.y, a.z, b.x, b.y, b.z];
    [
        join(&pose.position, &pose.angles),
        join(&pose.velocity, &pose.angle_rates),
        join(&pose.acceleration, &pose.angle_accelerations),
    ]
}

/// Coordinates minus those of the ideal motion; differences of angles are wrapped.
fn deviation(pose: &Pose, ideal: &Pose) -> [f64; COORDINATES] {
    let ([actual, ..], [ideal, ..]) = (derivatives(pose), derivatives(ideal));
    let turn = std::f64::consts::TAU;
    std::array::from_fn(|i| {
        let d = actual[i] - ideal[i];
        if i < 3 { d } else { d - turn * (d / turn).round() }
    })
}

/// Response of one run.
#[derive(Clone, Debug)]
pub struct Response {
    /// Names of the ball joints.
    pub joints: Vec<String>,
    /// Extremes in continuous time: forces from the cubic interpolant of each step, all others at four instants of each step.
    pub full: Extremes,
    /// Extremes at whole multiples of the sampling interval only, as a solver with that output step would report.
    pub sampled: Extremes,
    /// Time of the last separation of each joint, if any, s.
    pub last_separation: Vec<Option<f64>>,
    /// Largest constraint violation of the `lagrange` form, m or rad.
    pub constraint_drift: f64,
}

/// Reasons why there is no response.
#[derive(Clone, Debug, thiserror::Error)]
pub enum ResponseError {
    /// The scene does not start.
    #[error(transparent)]
    Start(#[from] StartError),
    /// The scene rejected a parameter.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The divergence guard stopped the run.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// The caller cancelled the run.
    #[error("cancelled")]
    Cancelled,
}

/// Simulation of the same scene with every ball joint ideal; `None` if it does not start.
fn ideal_of(scene: &Scene) -> Option<Simulation> {
    let mut ideal = scene.clone();
    ideal.set("contact.clearance", "0").ok()?;
    let names: Vec<String> = ideal.machine.ball_joints.iter().map(|j| j.name.clone()).collect();
    for name in names {
        ideal.set(&format!("joint.{name}.clearance"), "0").ok()?;
    }
    Simulation::new(&ideal.machine).ok()
}

/// Pose of the ideal motion at successive instants.
struct Ideal {
    simulation: Option<Simulation>,
    frame: Frame,
}

impl Ideal {
    /// Pose at `time`, which must not precede the latest request; `None` without an ideal motion.
    fn at(&mut self, time: f64) -> Option<&Pose> {
        let simulation = self.simulation.as_mut()?;
        if simulation.advance_to(time).is_err() {
            self.simulation = None;
            return None;
        }
        simulation.sample(time, &mut self.frame);
        Some(&self.frame.pose)
    }
}

/// One examined instant of a run.
pub struct Observation<'a> {
    /// Time, s.
    pub time: f64,
    /// State of the run.
    pub frame: &'a Frame,
    /// Pose of the ideal motion, if there is one.
    pub ideal: Option<&'a Pose>,
    /// Whether the time is a whole multiple of the sampling interval; otherwise it is one of four instants of a step.
    pub sample: bool,
    /// Largest constraint violation of the `lagrange` form so far, m or rad.
    pub constraint_drift: f64,
}

impl Observation<'_> {
    /// Coordinates x, y, z, alpha, beta, gamma, their rates and their second derivatives, SI units.
    pub fn derivatives(&self) -> [[f64; COORDINATES]; 3] {
        derivatives(&self.frame.pose)
    }

    /// Coordinates minus those of the ideal motion, m and rad; NaN without an ideal motion.
    pub fn deviation(&self) -> [f64; COORDINATES] {
        self.ideal.map_or([f64::NAN; COORDINATES], |ideal| deviation(&self.frame.pose, ideal))
    }
}

/// Runs `scene` for `duration` (s) and compares it with its ideal motion; `every` (s) is the sampling interval of
/// [`Response::sampled`]. `observe` receives every examined instant in order of time; `may_continue` receives the simulated
/// time after every step and returns false to cancel.
///
/// # Errors
/// A scene that does not start, the divergence guard, or cancellation by `may_continue`.
pub fn respond(
    scene: &Scene,
    duration: f64,
    every: f64,
    mut observe: impl FnMut(&Observation),
    mut may_continue: impl FnMut(f64) -> bool,
) -> Result<Response, ResponseError> {
    let mut simulation = Simulation::new(&scene.machine)?;
    let mut ideal = Ideal { simulation: ideal_of(scene), frame: Frame::default() };
    let joints = scene.machine.ball_joints.len();
    let mut full = Extremes::new(joints, ideal.simulation.is_some());
    let mut sampled = full.clone();
    let mut frame = Frame::default();
    let mut next_sample = 0_u64;
    loop {
        let (start, end) = (simulation.step_start(), simulation.time());
        // Observed instants and samples of the step are visited in order of time, because the ideal motion cannot run
        // backwards.
        let mut observation = 0;
        loop {
            let observation_time = start + (end - start) * f64::from(observation) / f64::from(OBSERVATIONS_PER_STEP);
            let sample_time = next_sample as f64 * every;
            let is_sample = sample_time <= end.min(duration) && sample_time <= observation_time;
            if !is_sample && observation > OBSERVATIONS_PER_STEP {
                break;
            }
            let time = if is_sample { sample_time } else { observation_time.min(end) };
            simulation.sample(time, &mut frame);
            let pose = ideal.at(time);
            if time <= duration {
                observe(&Observation {
                    time,
                    frame: &frame,
                    ideal: pose,
                    sample: is_sample,
                    constraint_drift: simulation.statistics().constraint_drift,
                });
            }
            if is_sample {
                sampled.include(&frame, pose);
                next_sample += 1;
            } else {
                full.include(&frame, pose);
                observation += 1;
            }
        }
        if end >= duration {
            break;
        }
        if !may_continue(end) {
            return Err(ResponseError::Cancelled);
        }
        simulation.step_until(duration)?;
    }
    let statistics = simulation.statistics();
    for (sampled_peak, peak) in full.normal.iter_mut().zip(&statistics.peak_normal) {
        *sampled_peak = sampled_peak.max(*peak);
    }
    Ok(Response {
        joints: scene.machine.ball_joints.iter().map(|j| j.name.clone()).collect(),
        full,
        sampled,
        last_separation: statistics.last_separation.clone(),
        constraint_drift: statistics.constraint_drift,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(name: &str, changes: &[(&str, &str)]) -> Scene {
        let owned = |&(k, v): &(&str, &str)| (k.to_owned(), v.to_owned());
        let changes: Vec<_> = changes.iter().map(owned).collect();
        Scene::load(name, &changes).expect("built in")
    }

    #[test]
    fn the_ideal_mechanism_follows_its_drive_without_deviation() {
        let scene = scene("spcmm", &[("contact.clearance", "0")]);
        let response = respond(&scene, 2.0, 1e-3, |_| (), |_| true).expect("runs");
        // x = 0.203 + sin(pi t)/40: |dx/dt| <= pi/40, |d2x/dt2| <= pi^2/40 (59).
        let pi = std::f64::consts::PI;
        assert!((response.full.rate[0] - pi / 40.0).abs() < 1e-9);
        assert!((response.full.acceleration[0] - pi * pi / 40.0).abs() < 1e-6);
        assert!((response.sampled.rate[4] - pi / 40.0).abs() < 1e-9);
        assert!(response.full.deviation.iter().all(|d| *d < 1e-9));
        assert!(response.last_separation.iter().all(Option::is_none));
    }

    #[test]
    fn play_causes_deviation_and_coarse_samples_miss_peaks() {
        let scene = scene("spcmm", &[]);
        let mut observations = 0;
        let response = respond(&scene, 0.02, 1e-3, |_| observations += 1, |_| true).expect("runs");
        assert!(observations > 100);
        // The peaks of `tests/physics/reference.rs`; friction changes the peaks of the first 20 ms by less than the tolerance.
        for (peak, expected) in response.full.normal.iter().zip([771.15, 870.59, 533.36]) {
            assert!((peak / expected - 1.0).abs() < 5e-3, "{peak} {expected}");
        }
        for (coarse, fine) in response.sampled.normal.iter().zip(&response.full.normal) {
            assert!(coarse < fine);
        }
        // The ball falls freely through the clearance, but no further.
        assert!(response.full.deviation[0] > 0.25e-3 && response.full.deviation[0] < 0.5e-3);
        assert!(response.full.rate[0] >= response.sampled.rate[0]);
    }

    #[test]
    fn a_cancelled_run_returns_the_cancellation() {
        let scene = scene("pendulum", &[]);
        let result = respond(&scene, 1.0, 1e-3, |_| (), |t| t < 0.01);
        assert!(matches!(result, Err(ResponseError::Cancelled)));
    }
}
