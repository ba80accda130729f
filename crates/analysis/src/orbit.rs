//! Interface of a motion for the computation of sections and exponents.

/// A motion that can be stepped, observed and copied as a twin, such as an iterated map, a driven oscillator or a mechanism.
///
/// [`SectionRun`](super::section::SectionRun) accesses a system only through this trait, so that systems with known exponents
/// (`tests/physics/known_systems.rs`) and mechanisms run through the same code.
pub trait Orbit: Sized {
    /// Reason why a step failed.
    type Stop;

    /// Time, s; for a map the number of iterations.
    fn time(&self) -> f64;

    /// Takes one step of a size chosen by the system, truncated to end exactly at `end` if necessary.
    ///
    /// # Errors
    /// The system cannot continue; its state is unchanged.
    fn step_until(&mut self, end: f64) -> Result<(), Self::Stop>;

    /// Steps to the time of the twin `other`, with the same steps as the latest step of `other`.
    ///
    /// # Errors
    /// As [`Self::step_until`].
    fn reproduce_step(&mut self, other: &Self) -> Result<(), Self::Stop> {
        while self.time() < other.time() {
            self.step_until(other.time())?;
        }
        Ok(())
    }

    /// The continuous part of the state: coordinates and velocities.
    fn state(&self) -> &[f64];

    /// Scale of each component of [`Self::state`], the unit in which differences are measured.
    fn scales(&self) -> &[f64];

    /// A copy in the same state and with the same future.
    fn twin(&self) -> Self;

    /// Adds `offset` to the state.
    fn displace(&mut self, offset: &[f64]);

    /// Moves history variables, which are not part of the state, towards those of `other` by the fraction `part` of the
    /// difference.
    fn blend_approach_speeds(&mut self, _other: &Self, _part: f64) {}

    /// Whether the two states differ only in continuous variables. While only one of them is in contact, a small difference is
    /// about to jump.
    fn is_comparable(&self, _twin: &Self) -> bool {
        true
    }

    /// Adopts the step control of `other`, a comparable run at the same time, so that the two runs differ by their motion and
    /// not by their integration errors.
    fn adopt_step_control(&mut self, _other: &Self) {}

    /// Number of values that [`Self::observe`] writes.
    fn observables(&self) -> usize;

    /// Writes the observed values of the current state.
    fn observe(&mut self, out: &mut [f64]);
}
