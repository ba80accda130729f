//! The common period of a scene's drives, and a running scene as an [`Orbit`].

use super::orbit::Orbit;
use jointplay_physics::machine::Machine;
use jointplay_physics::mechanism::periods_of;
use jointplay_physics::simulate::{Frame, Pose, Simulation, StartError, Stopped};
use jointplay_scene::Scene;

/// Reasons why a scene has no sections at a fixed drive phase.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoPeriod {
    /// Nothing periodic drives the scene.
    #[error(
        "the scene `{scene}` has no drive that repeats, and no periodic tyre ground, motor target or load, so there is no phase \
         at which to take sections"
    )]
    None {
        /// Name of the scene.
        scene: String,
    },
    /// Drives with different periods.
    #[error(
        "the drives and loads of the scene `{scene}` have different periods ({first} s and {second} s), so there is \
         no common phase at which to take sections"
    )]
    Different {
        /// Name of the scene.
        scene: String,
        /// Period of one drive, s.
        first: f64,
        /// Period of another, s.
        second: f64,
    },
}

/// Common period of all drives, time laws of force elements and harmonic loads of `scene`, s. Drives at rest do not count.
///
/// # Errors
/// A scene without a common period.
pub fn drive_period(scene: &Scene) -> Result<f64, NoPeriod> {
    let name = || scene.name.clone();
    let period = common_period(&scene.machine);
    let period = period.map_err(|[first, second]| NoPeriod::Different { scene: name(), first, second })?;
    period.ok_or_else(|| NoPeriod::None { scene: name() })
}

/// Common period of a machine, s; `None` if nothing repeats.
///
/// # Errors
/// Two different periods, s.
pub fn common_period(machine: &Machine) -> Result<Option<f64>, [f64; 2]> {
    let mut period: Option<f64> = None;
    for next in periods_of(machine).filter(|period| period.is_finite()) {
        match period {
            Some(first) if (first / next - 1.0).abs() > 1e-12 => return Err([first, next]),
            _ => period = Some(next),
        }
    }
    Ok(period)
}

/// Observables of a section: pose and rates of the output body, named as in the rows of a run.
pub const OBSERVABLES: [&str; 12] = [
    "x_m",
    "y_m",
    "z_m",
    "alpha_rad",
    "beta_rad",
    "gamma_rad",
    "vx_m_s",
    "vy_m_s",
    "vz_m_s",
    "alpha_rate_rad_s",
    "beta_rate_rad_s",
    "gamma_rate_rad_s",
];

/// Observables of a pose, in the order of [`OBSERVABLES`].
pub fn observed(pose: &Pose) -> [f64; 12] {
    let parts = [pose.position, pose.angles, pose.velocity, pose.angle_rates];
    std::array::from_fn(|i| parts[i / 3][i % 3])
}

/// A running scene whose sections record the pose and rates of its output body.
pub struct ObservedRun {
    simulation: Simulation,
    frame: Frame,
}

impl ObservedRun {
    /// Starts `scene` at t = 0.
    ///
    /// # Errors
    /// As [`Simulation::new`].
    pub fn new(scene: &Scene) -> Result<Self, StartError> {
        Ok(Self::resume(Simulation::new(&scene.machine)?))
    }

    /// Continues a running simulation.
    pub fn resume(simulation: Simulation) -> Self {
        Self { simulation, frame: Frame::default() }
    }

    /// The simulation.
    pub fn simulation(&self) -> &Simulation {
        &self.simulation
    }

    /// The simulation, to change a parameter between two sections or read its peaks.
    pub(crate) fn simulation_mut(&mut self) -> &mut Simulation {
        &mut self.simulation
    }

    /// All quantities at the latest state.
    pub fn frame(&mut self) -> &Frame {
        let now = self.simulation.time();
        self.simulation.sample(now, &mut self.frame);
        &self.frame
    }
}

/// Reasons why a run cannot start or continue.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ObservedError {
    /// The scene does not start.
    #[error(transparent)]
    Start(#[from] StartError),
    /// The divergence guard stopped the run.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl Orbit for Simulation {
    type Stop = Stopped;

    fn time(&self) -> f64 {
        self.time()
    }

    fn step_until(&mut self, end: f64) -> Result<(), Stopped> {
        self.step_until(end)
    }

    fn reproduce_step(&mut self, other: &Self) -> Result<(), Stopped> {
        self.reproduce_step(other)
    }

    fn state(&self) -> &[f64] {
        self.state_vector()
    }

    fn scales(&self) -> &[f64] {
        self.scales()
    }

    fn twin(&self) -> Self {
        self.clone()
    }

    fn displace(&mut self, offset: &[f64]) {
        self.displace(offset);
    }

    fn blend_approach_speeds(&mut self, other: &Self, part: f64) {
        self.blend_approach_speeds(other, part);
    }

    fn adopt_step_control(&mut self, other: &Self) {
        self.adopt_step_control(other);
    }

    /// True only while the same balls are in contact. Otherwise one run is in an impact that the other has not reached or has
    /// left.
    fn is_comparable(&self, twin: &Self) -> bool {
        (0..self.machine().loose_joints.len()).all(|j| {
            self.contact_states(j)
                .iter()
                .map(|contact| contact.active)
                .eq(twin.contact_states(j).iter().map(|contact| contact.active))
        })
    }

    fn observables(&self) -> usize {
        OBSERVABLES.len()
    }

    fn observe(&mut self, out: &mut [f64]) {
        let mut frame = Frame::default();
        self.sample(self.time(), &mut frame);
        out.copy_from_slice(&observed(&frame.pose));
    }
}

/// Delegates to the simulation; a frame buffer holds the observables.
impl Orbit for ObservedRun {
    type Stop = ObservedError;

    fn time(&self) -> f64 {
        self.simulation.time()
    }

    fn step_until(&mut self, end: f64) -> Result<(), ObservedError> {
        Ok(self.simulation.step_until(end)?)
    }

    fn reproduce_step(&mut self, other: &Self) -> Result<(), ObservedError> {
        Ok(self.simulation.reproduce_step(&other.simulation)?)
    }

    fn state(&self) -> &[f64] {
        self.simulation.state_vector()
    }

    fn scales(&self) -> &[f64] {
        self.simulation.scales()
    }

    fn twin(&self) -> Self {
        Self::resume(self.simulation.twin())
    }

    fn displace(&mut self, offset: &[f64]) {
        self.simulation.displace(offset);
    }

    fn blend_approach_speeds(&mut self, other: &Self, part: f64) {
        self.simulation.blend_approach_speeds(&other.simulation, part);
    }

    fn adopt_step_control(&mut self, other: &Self) {
        self.simulation.adopt_step_control(&other.simulation);
    }

    fn is_comparable(&self, twin: &Self) -> bool {
        self.simulation.is_comparable(&twin.simulation)
    }

    fn observables(&self) -> usize {
        self.simulation.observables()
    }

    fn observe(&mut self, out: &mut [f64]) {
        let values = observed(&self.frame().pose);
        out.copy_from_slice(&values);
    }
}
