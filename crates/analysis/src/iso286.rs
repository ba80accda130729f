//! Limits of size and fits according to ISO 286-1:2010 for nominal sizes up to 500 mm: holes A to H, JS, K, M, N, P, R, S and
//! shafts a to h, js, k, m, n, p, r, s in the grades IT01 to IT18.

mod tables;

use std::fmt;
use std::str::FromStr;

use jointplay_physics::suggest::brief;

use crate::distribution::{Distribution, DistributionError};
use tables::{CLEARANCE_SIDE, Deviation, INTERFERENCE_SIDE, INTERMEDIATE, RANGES, TOLERANCES};

const MICROMETRE: f64 = 1e-6;

/// Reasons why a fit is invalid or has no limits.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// A text that does not name a hole and a shaft.
    #[error("`{}` is not a fit: expected a hole and a shaft such as H7/g6", brief(text))]
    Form {
        /// The given text.
        text: String,
    },
    /// A text that is not a tolerance class.
    #[error(
        "`{}` is not a tolerance class: expected a letter (A to H, JS, K, M, N, P, R, S for a hole, lower case for \
         a shaft) and a grade from 01 to 18, such as H7",
        brief(text)
    )]
    Class {
        /// The given text.
        text: String,
    },
    /// A nominal size out of range.
    #[error("nominal size {} mm: the tables of ISO 286-1 are used above 0 mm and up to 500 mm", nominal * 1e3)]
    Size {
        /// Nominal size, m.
        nominal: f64,
    },
    /// A class that the standard does not define for this size.
    #[error("ISO 286-1 does not define {class} for a nominal size of {} mm", nominal * 1e3)]
    Undefined {
        /// Tolerance class.
        class: ToleranceClass,
        /// Nominal size, m.
        nominal: f64,
    },
    /// A process capability that is not positive.
    #[error("process capability {capability}: expected a number above 0, e.g. 1 or 1.33")]
    Capability {
        /// The given capability.
        capability: f64,
    },
    /// Limits that do not define a distribution.
    #[error(transparent)]
    Distribution(#[from] DistributionError),
}

/// A tolerance class of a hole or a shaft, such as H7 or g6.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ToleranceClass {
    is_hole: bool,
    position: Position,
    /// Row of [`TOLERANCES`]: 0 is IT01, 1 is IT0, n + 1 is ITn.
    grade: usize,
}

/// Position of the tolerance interval relative to the nominal size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Position {
    /// H and h: one limit is the nominal size.
    Nominal,
    /// JS and js: symmetric.
    Symmetric,
    /// A to G and a to g: a row of [`CLEARANCE_SIDE`].
    Clearance(usize),
    /// K to S and k to s: a row of [`INTERFERENCE_SIDE`].
    Interference(usize),
}

/// Limit deviations from the nominal size, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimitDeviations {
    /// EI of a hole, ei of a shaft.
    pub lower: f64,
    /// ES of a hole, es of a shaft.
    pub upper: f64,
}

impl FromStr for ToleranceClass {
    type Err = FitError;

    fn from_str(text: &str) -> Result<Self, FitError> {
        let invalid_class = || FitError::Class { text: text.to_owned() };
        let trimmed = text.trim();
        let digits = trimmed.find(|c: char| c.is_ascii_digit()).ok_or_else(invalid_class)?;
        let (letters, number) = trimmed.split_at(digits);
        let is_hole = letters.starts_with(|c: char| c.is_ascii_uppercase());
        let lowercase = letters.to_ascii_lowercase();
        if letters != if is_hole { lowercase.to_ascii_uppercase() } else { lowercase.clone() } {
            return Err(invalid_class());
        }
        let row = |table: &[(&str, Deviation)]| table.iter().position(|(letter, _)| *letter == lowercase);
        let position = match lowercase.as_str() {
            "h" => Position::Nominal,
            "js" => Position::Symmetric,
            _ => {
                let clearance = row(&CLEARANCE_SIDE).map(Position::Clearance);
                clearance.or_else(|| row(&INTERFERENCE_SIDE).map(Position::Interference)).ok_or_else(invalid_class)?
            }
        };
        let grade = match number {
            "01" => 0,
            "0" => 1,
            _ if number.starts_with('0') => return Err(invalid_class()),
            _ => number.parse::<usize>().ok().filter(|n| (1..=18).contains(n)).ok_or_else(invalid_class)? + 1,
        };
        Ok(Self { is_hole, position, grade })
    }
}

impl fmt::Display for ToleranceClass {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let letter = match self.position {
            Position::Nominal => "h",
            Position::Symmetric => "js",
            Position::Clearance(row) => CLEARANCE_SIDE[row].0,
            Position::Interference(row) => INTERFERENCE_SIDE[row].0,
        };
        let letter = if self.is_hole { letter.to_ascii_uppercase() } else { letter.to_owned() };
        match self.grade {
            0 => write!(f, "{letter}01"),
            grade => write!(f, "{letter}{}", grade - 1),
        }
    }
}

impl ToleranceClass {
    /// Whether this is the class of a hole (capital letter).
    pub fn is_hole(self) -> bool {
        self.is_hole
    }

    /// Width of the tolerance interval at a nominal size, m (table 1).
    ///
    /// # Errors
    /// A size out of range.
    pub fn tolerance(self, nominal: f64) -> Result<f64, FitError> {
        let (main, _) = ranges(nominal)?;
        Ok(TOLERANCES[self.grade][main] * MICROMETRE)
    }

    /// Limit deviations at a nominal size, both in m (tables 1 to 5).
    ///
    /// # Errors
    /// A size out of range, or a class that the standard does not define for it.
    pub fn limits(self, nominal: f64) -> Result<LimitDeviations, FitError> {
        let (main, intermediate) = ranges(nominal)?;
        let size = |deviation: &Deviation| match deviation {
            Deviation::Main(values) => values[main],
            Deviation::Intermediate(values) => values[intermediate],
        };
        let tolerance = TOLERANCES[self.grade][main];
        let undefined = || FitError::Undefined { class: self, nominal };
        // Notes to tables 1 to 5: up to 1 mm, IT14 and coarser grades, a, b, A, B, and N coarser than IT8 are not defined.
        if nominal <= 1e-3 * (1.0 + ROUNDING) {
            let letter = match self.position {
                Position::Clearance(row) => CLEARANCE_SIDE[row].0,
                Position::Interference(row) => INTERFERENCE_SIDE[row].0,
                Position::Nominal | Position::Symmetric => "",
            };
            let coarse_n = letter == "n" && self.is_hole && self.grade > grade(8);
            if self.grade >= grade(14) || ["a", "b"].contains(&letter) || coarse_n {
                return Err(undefined());
            }
        }
        let (lower, upper) = match (self.position, self.is_hole) {
            (Position::Nominal, true) => (0.0, tolerance),
            (Position::Nominal, false) => (-tolerance, 0.0),
            (Position::Symmetric, _) => (-0.5 * tolerance, 0.5 * tolerance),
            (Position::Clearance(row), true) => {
                let lower = size(&CLEARANCE_SIDE[row].1);
                (lower, lower + tolerance)
            }
            (Position::Clearance(row), false) => {
                let upper = -size(&CLEARANCE_SIDE[row].1);
                (upper - tolerance, upper)
            }
            (Position::Interference(row), true) => {
                let upper = self.hole_deviation(row, size(&INTERFERENCE_SIDE[row].1), main).ok_or_else(undefined)?;
                (upper - tolerance, upper)
            }
            (Position::Interference(row), false) => {
                let (letter, deviation) = &INTERFERENCE_SIDE[row];
                // Table 5: k is 0 except in IT4 to IT7.
                let is_zero = *letter == "k" && !(grade(4)..=grade(7)).contains(&self.grade);
                let lower = if is_zero { 0.0 } else { size(deviation) };
                (lower, lower + tolerance)
            }
        };
        Ok(LimitDeviations { lower: lower * MICROMETRE, upper: upper * MICROMETRE })
    }

    /// Upper limit deviation ES, micrometres, of a hole K to S; `shaft` is the lower deviation of the shaft with the same
    /// letter (tables 2 and 3). Above 3 mm, from IT3 to IT8 (P to S: IT7), it is -`shaft` + Δ with Δ = ITn - IT(n-1). The hole
    /// with a shaft h of the next finer grade then has the same clearance as a hole H with the shaft of that letter and finer
    /// grade.
    fn hole_deviation(self, row: usize, shaft: f64, main: usize) -> Option<f64> {
        let letter = INTERFERENCE_SIDE[row].0;
        let last_grade = if ["k", "m", "n"].contains(&letter) { grade(8) } else { grade(7) };
        if main == 0 {
            // K is 0 and N -4 µm in every grade.
            return Some(-shaft);
        }
        if self.grade > last_grade {
            return match letter {
                "k" => None,
                "n" => Some(0.0),
                _ => Some(-shaft),
            };
        }
        if self.grade < grade(3) {
            return None;
        }
        // Note to table 2: M6 has -9 µm from 250 mm to 315 mm.
        if letter == "m" && self.grade == grade(6) && RANGES[main] == 315.0 {
            return Some(-9.0);
        }
        Some(-shaft + TOLERANCES[self.grade][main] - TOLERANCES[self.grade - 1][main])
    }
}

/// Row of [`TOLERANCES`] of a grade from IT1 on.
const fn grade(number: usize) -> usize {
    number + 1
}

/// Relative difference below which two sizes are equal, so that 3 mm converted to metres still ends its range.
const ROUNDING: f64 = 1e-12;

/// Indices of the main and the intermediate range of a nominal size.
fn ranges(nominal: f64) -> Result<(usize, usize), FitError> {
    let error = FitError::Size { nominal };
    if !(nominal > 0.0) {
        return Err(error);
    }
    let holds = |end: &f64| nominal * 1e3 <= end * (1.0 + ROUNDING);
    let both = RANGES.iter().position(holds).zip(INTERMEDIATE.iter().position(holds));
    both.ok_or(error)
}

/// A hole and a shaft of the same nominal size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fit {
    /// Tolerance class of the hole, here the socket.
    pub hole: ToleranceClass,
    /// Tolerance class of the shaft, here the ball.
    pub shaft: ToleranceClass,
}

/// Kind of a fit, as in ISO 286-1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FitKind {
    /// Play, or at worst a clearance of 0, for all sizes within the limits.
    Clearance,
    /// Play or interference, depending on the actual sizes.
    Transition,
    /// Interference for all sizes within the limits.
    Interference,
}

/// Clearance of a fit on the diameter, hole minus shaft, m. Negative values are interference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClearanceLimits {
    /// Smallest hole minus largest shaft.
    pub min: f64,
    /// Largest hole minus smallest shaft.
    pub max: f64,
}

impl ClearanceLimits {
    /// Kind of the fit. A ball joint with play needs [`FitKind::Clearance`].
    pub fn kind(self) -> FitKind {
        // Differences of table values in metres have rounding errors far below a picometre.
        let zero = 1e-12;
        if self.min >= -zero {
            FitKind::Clearance
        } else if self.max <= zero {
            FitKind::Interference
        } else {
            FitKind::Transition
        }
    }
}

impl FromStr for Fit {
    type Err = FitError;

    fn from_str(text: &str) -> Result<Self, FitError> {
        let invalid_form = || FitError::Form { text: text.to_owned() };
        let (hole, shaft) = text.split_once('/').ok_or_else(invalid_form)?;
        let fit = Self { hole: hole.parse()?, shaft: shaft.parse()? };
        if !fit.hole.is_hole || fit.shaft.is_hole {
            return Err(invalid_form());
        }
        Ok(fit)
    }
}

impl fmt::Display for Fit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.hole, self.shaft)
    }
}

impl Fit {
    /// Clearance on the diameter at a nominal size, both in m.
    ///
    /// # Errors
    /// A size out of range, or a class that the standard does not define for it.
    pub fn clearance(self, nominal: f64) -> Result<ClearanceLimits, FitError> {
        let (hole, shaft) = (self.hole.limits(nominal)?, self.shaft.limits(nominal)?);
        Ok(ClearanceLimits { min: hole.lower - shaft.upper, max: hole.upper - shaft.lower })
    }

    /// Distribution of the radial clearance, half the clearance on the diameter, at a nominal diameter, both in m. Hole and
    /// shaft are independent and normally distributed about the centres of their tolerance intervals, whose widths are 6
    /// `capability` standard deviations (the process capability index Cp). The distribution is truncated at the limits of the
    /// fit.
    ///
    /// # Errors
    /// As [`Self::clearance`]; a capability that is not above 0.
    pub fn radial_clearance(self, nominal: f64, capability: f64) -> Result<Distribution, FitError> {
        if !(capability > 0.0 && capability.is_finite()) {
            return Err(FitError::Capability { capability });
        }
        let limits = self.clearance(nominal)?;
        let widths = [self.hole.tolerance(nominal)?, self.shaft.tolerance(nominal)?];
        let deviation = libm::hypot(widths[0], widths[1]) / (6.0 * capability);
        let (min, max) = (0.5 * limits.min, 0.5 * limits.max);
        Ok(Distribution::truncated_normal(0.5 * (min + max), 0.5 * deviation, min, max)?)
    }
}

#[cfg(test)]
mod tests;
