//! What sections and exponents require of a motion.

/// A motion that can be stepped, observed and copied as a twin: a map, a driven oscillator, a mechanism.
///
/// [`SectionRun`](super::section::SectionRun) knows a system only through this trait, so that known systems
/// (`tests/physics/known_systems.rs`) and mechanisms run through the same code.
pub trait Orbit: Sized {
    /// Why a step failed.
    type Stop;

    /// Time, s; for a map the number of iterations.
    fn time(&self) -> f64;

    /// One step of a size that the system chooses, ending no later than `end`, and exactly there if it would pass it.
    ///
    /// # Errors
    /// The system cannot continue; its state is then unchanged.
    fn step_until(&mut self, end: f64) -> Result<(), Self::Stop>;

    /// Steps until the time of `other`, whose twin it is, by steps like its latest.
    ///
    /// # Errors
    /// As [`Self::step_until`].
    fn step_beside(&mut self, other: &Self) -> Result<(), Self::Stop> {
        while self.time() < other.time() {
            self.step_until(other.time())?;
        }
        Ok(())
    }

    /// The continuous part of the state: coordinates and velocities.
    fn state(&self) -> &[f64];

    /// Scale of each component of [`Self::state`]: what a difference of 1 means.
    fn scales(&self) -> &[f64];

    /// A second run in the same state and with the same future.
    fn twin(&self) -> Self;

    /// Adds `offset` to the state.
    fn displace(&mut self, offset: &[f64]);

    /// Takes what it remembers besides its state towards what `other` does, by the fraction `part` of their difference.
    fn remember_like(&mut self, _other: &Self, _part: f64) {}

    /// Whether the two states differ in continuous variables alone: while only one of them is in contact, a small
    /// difference is about to jump.
    fn comparable(&self, _twin: &Self) -> bool {
        true
    }

    /// Steps from here on as `other` is about to, a comparable run at the same time: what two runs differ by should be their
    /// motion, not their errors.
    fn step_like(&mut self, _other: &Self) {}

    /// Number of values that [`Self::observe`] writes.
    fn observables(&self) -> usize;

    /// Writes the observed values of the current state.
    fn observe(&mut self, out: &mut [f64]);
}
