//! Drive laws: prescribed q(t) with exact first and second derivatives. The motions are in `mechanism/drives`.

use crate::expression::Program;
use crate::interpolate::Interpolation;

/// Prescribed function of time, for a joint coordinate, a motor's target, a tyre's ground or the factor of a load. On a hinge,
/// lengths are angles (rad) and speeds angular speeds (rad/s); of a factor, they are pure numbers and numbers per second.
#[derive(Clone, Debug, PartialEq)]
pub enum Drive {
    /// Function of the machine's closed form, by index from 0.
    Function(usize),
    /// `position` + `velocity` t.
    Constant {
        /// Position at t = 0, m.
        position: f64,
        /// Velocity, m/s.
        velocity: f64,
    },
    /// `mean` plus a sum of harmonics.
    Harmonic {
        /// Mean, m.
        mean: f64,
        /// The harmonics.
        terms: Vec<Harmonic>,
    },
    /// Transition between two positions: with s from 0 to 1 over the duration, from + (to - from) (10 s^3 - 15 s^4 + 6 s^5).
    Ramp {
        /// Initial position, m.
        from: f64,
        /// Final position, m.
        to: f64,
        /// Start time, s.
        start: f64,
        /// Duration, s.
        duration: f64,
    },
    /// Single pulse: with s from 0 to 1 over the duration, base + height sin^3(pi s).
    Pulse {
        /// Position before and afterwards, m.
        base: f64,
        /// Height of the pulse above `base`, m.
        height: f64,
        /// Start time, s.
        start: f64,
        /// Duration, s.
        duration: f64,
    },
    /// A function through points.
    Table {
        /// Times (s) and positions (m), in ascending time.
        points: Vec<[f64; 2]>,
        /// How it passes through them; only the factor of a load may be linear.
        interpolation: Interpolation,
        /// Whether the points span one period of the motion.
        repeats: bool,
    },
    /// An expression in the time t.
    Formula {
        /// Program with one variable, t in s.
        program: Program,
        /// Length of one unit of its result, m.
        scale: f64,
        /// Longest step of an adaptive method, s.
        resolve: f64,
    },
}

/// Harmonic amplitude sin(2 pi frequency t + phase).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Harmonic {
    /// Amplitude, m or rad.
    pub amplitude: f64,
    /// Frequency, Hz.
    pub frequency: f64,
    /// Phase, rad.
    pub phase: f64,
}
