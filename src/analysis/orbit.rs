//! What sections and exponents ask of a motion.

/// A motion that can be stepped, observed and followed by a twin: a map, a driven oscillator, a mechanism.
///
/// All that [`Watch`](super::section::Watch) knows of a system; known systems (`tests/physics/known_systems.rs`) and mechanisms go through the same code.
pub trait Orbit: Sized {
    /// Why a step failed.
    type Stop;

    /// Time, s; for a map the number of iterations.
    fn time(&self) -> f64;

    /// One step of the system's own choice that ends at `end` at the latest, exactly there if it would pass it.
    ///
    /// # Errors
    /// The system cannot go on; it is then where it was.
    fn step_until(&mut self, end: f64) -> Result<(), Self::Stop>;

    /// Everything that decides the future and moves continuously: coordinates and velocities.
    fn state(&self) -> &[f64];

    /// What a difference of 1 means for each component of [`Self::state`].
    fn scales(&self) -> &[f64];

    /// A second run in the same state with the same future.
    ///
    /// # Errors
    /// As [`Self::step_until`].
    fn twin(&self) -> Result<Self, Self::Stop>;

    /// Adds `offset` to the state.
    fn displace(&mut self, offset: &[f64]);

    /// Whether the difference of the two states is one in continuous variables alone: where only one of them is in
    /// contact, a small difference is about to become another one.
    fn comparable(&self, _twin: &Self) -> bool {
        true
    }

    /// Number of values that [`Self::observe`] writes.
    fn observables(&self) -> usize;

    /// The observed values now.
    fn observe(&mut self, out: &mut [f64]);
}
