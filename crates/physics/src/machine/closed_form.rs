//! A motion in closed form: functions of time that drives follow, and the path of the output body that results.

use super::{Mat3, Vec3};
use crate::expression::Program;

/// Functions of time in closed form, such as the inverse kinematics of a platform that is to follow a path.
#[derive(Clone, Debug, PartialEq)]
pub struct ClosedForm {
    /// Repetitions of the motion per second, Hz; 0 if nothing moves.
    pub frequency: f64,
    /// Seconds of the functions' time per second: 1, unless the motion is to run slower or faster.
    pub pace: f64,
    /// The functions; each depends on the time and on the functions before it.
    pub functions: Vec<Function>,
    /// Motion of the output body where no joint has play, if known.
    pub path: Option<Path>,
}

/// A named function of time; on a hinge, lengths are angles.
#[derive(Clone, Debug, PartialEq)]
pub struct Function {
    /// Its name.
    pub name: String,
    /// The time, s, is variable 0, the function at index i is variable i + 1. The value is in SI units.
    pub program: Program,
    /// Its unit in the base units, for messages; empty for a pure number.
    pub unit: String,
    /// For a value that must be above 0, such as the rest of a rod's length: description of the fault where it is not.
    pub positive: Option<String>,
}

/// Motion of a body's frame in closed form; the variables of its programs are those of [`Function`].
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// Its origin, world axes, m.
    pub position: [Program; 3],
    /// Successive rotations: unit axis, in the axes rotated so far, and angle, rad.
    pub turns: Vec<(Vec3, Program)>,
    /// Placement of the whole machine: rotation about the world's origin, then shift, m.
    pub place: Option<(Mat3, Vec3)>,
}
