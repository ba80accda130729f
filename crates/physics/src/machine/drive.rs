//! What a driven coordinate follows: q(t) with exact first and second derivatives. The motions are in `mechanism/drives`.

use crate::expression::Program;

/// Law of a driven coordinate, or of whatever else follows a function of time. On a hinge lengths are angles (rad) and speeds
/// angular speeds (rad/s).
#[derive(Clone, Debug, PartialEq)]
pub enum Drive {
    /// This coordinate, from 0, of the machine's closed form.
    ClosedForm(usize),
    /// `position` + `velocity` t.
    Constant {
        /// At t = 0, m.
        position: f64,
        /// m/s.
        velocity: f64,
    },
    /// `mean` plus a sum of harmonics.
    Harmonic {
        /// m.
        mean: f64,
        /// The harmonics.
        terms: Vec<Harmonic>,
    },
    /// From one position to another: with s from 0 to 1 over the duration, from + (to - from) (10 s^3 - 15 s^4 + 6 s^5).
    Ramp {
        /// Before, m.
        from: f64,
        /// Afterwards, m.
        to: f64,
        /// When it begins, s.
        start: f64,
        /// How long it lasts, s.
        duration: f64,
    },
    /// One bump: with s from 0 to 1 over the duration, base + height sin^3(pi s).
    Pulse {
        /// Before and afterwards, m.
        base: f64,
        /// Height of the bump above it, m.
        height: f64,
        /// When it begins, s.
        start: f64,
        /// How long it lasts, s.
        duration: f64,
    },
    /// A cubic spline through points.
    Table {
        /// Instants, s, and positions, m, in the order of time.
        points: Vec<[f64; 2]>,
        /// Whether they are one period of the motion.
        repeats: bool,
    },
    /// An expression of the time t.
    Formula {
        /// Of one variable, t, s.
        program: Program,
        /// One of its value, m.
        scale: f64,
        /// Longest step that an adaptive method takes, s.
        resolve: f64,
    },
}

/// amplitude sin(2 pi frequency t + phase).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Harmonic {
    /// m or rad.
    pub amplitude: f64,
    /// Hz.
    pub frequency: f64,
    /// rad.
    pub phase: f64,
}

impl Drive {
    /// The coordinate, from 0, of the machine's closed form, if it follows that.
    pub fn closed_form(&self) -> Option<usize> {
        match self {
            Self::ClosedForm(coordinate) => Some(*coordinate),
            _ => None,
        }
    }
}
