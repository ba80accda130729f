//! Quantities that the paper reports for a run, and its numbers compared with this program's.

use super::Coordinate::{Beta, X};
use super::Published;
use crate::response::{Extremes, Response};
use jointplay_physics::words::words;

/// A scalar of a run shown in a figure, in SI units.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "their words say it")]
pub enum FigureValue {
    DeviationX,
    DeviationBeta,
    RateX,
    RateBeta,
    AccelerationX,
    AccelerationBeta,
    Normal1,
    Normal2,
    Normal3,
    Strongest,
    LastSeparation,
}

words!(FigureValue {
    DeviationX => "largest deviation of x",
    DeviationBeta => "largest deviation of beta",
    RateX => "largest velocity in x",
    RateBeta => "largest angular rate of beta",
    AccelerationX => "largest acceleration in x",
    AccelerationBeta => "largest acceleration of beta",
    Normal1 => "largest contact force in S1",
    Normal2 => "largest contact force in S2",
    Normal3 => "largest contact force in S3",
    Strongest => "largest contact force of any joint",
    LastSeparation => "last separation",
});

impl FigureValue {
    /// Contact forces, joint by joint.
    pub const NORMAL: [Self; 3] = [Self::Normal1, Self::Normal2, Self::Normal3];

    /// Unit, and accessor of the value in the extremes of a run; the accessor returns `None` where sampling does not matter.
    fn row(self) -> (&'static str, fn(&Extremes) -> Option<f64>) {
        match self {
            Self::DeviationX => ("m", |e| Some(e.deviation[X.index()])),
            Self::DeviationBeta => ("rad", |e| Some(e.deviation[Beta.index()])),
            Self::RateX => ("m/s", |e| Some(e.rate[X.index()])),
            Self::RateBeta => ("rad/s", |e| Some(e.rate[Beta.index()])),
            Self::AccelerationX => ("m/s²", |e| Some(e.acceleration[X.index()])),
            Self::AccelerationBeta => ("rad/s²", |e| Some(e.acceleration[Beta.index()])),
            Self::Normal1 => ("N", |e| e.normal.first().copied()),
            Self::Normal2 => ("N", |e| e.normal.get(1).copied()),
            Self::Normal3 => ("N", |e| e.normal.get(2).copied()),
            Self::Strongest => ("N", |e| e.normal.iter().copied().reduce(f64::max)),
            Self::LastSeparation => ("s", |_| None),
        }
    }

    /// SI unit.
    pub fn unit(self) -> &'static str {
        self.row().0
    }

    /// Value in continuous time; NaN where undefined.
    pub fn of(self, response: &Response) -> f64 {
        let value = match self {
            Self::LastSeparation => response.last_separation.iter().flatten().copied().reduce(f64::max),
            _ => self.row().1(&response.full),
        };
        value.unwrap_or(f64::NAN)
    }

    /// Value at the paper's sampling; `None` where sampling does not matter.
    pub fn sampled(self, response: &Response) -> Option<f64> {
        self.row().1(&response.sampled)
    }
}

/// How close two numbers are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Agreement {
    /// Within 10 % of the paper's number.
    Agrees,
    /// Between half and twice the paper's number.
    Near,
    /// Further away.
    Differs,
}

words!(Agreement {
    Agrees => "agrees within 10 %",
    Near => "within a factor of 2",
    Differs => "differs",
});

impl Agreement {
    /// Agreement of a number with the paper's, from their ratio.
    pub fn of(ratio: f64) -> Self {
        if (0.9..=1.1).contains(&ratio) {
            Self::Agrees
        } else if (0.5..=2.0).contains(&ratio) {
            Self::Near
        } else {
            Self::Differs
        }
    }
}

/// A number of the paper with this program's counterpart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// The paper's number.
    pub published: &'static Published,
    /// This program's number, in continuous time.
    pub full: f64,
    /// Value that a solver with the paper's output step would report; `None` where sampling does not matter.
    pub sampled: Option<f64>,
}

impl Comparison {
    /// Continuous-time value over the paper's number.
    pub fn ratio(&self) -> f64 {
        self.full / self.published.value
    }

    /// Sampled value over the paper's number.
    pub fn sampled_ratio(&self) -> Option<f64> {
        self.sampled.map(|value| value / self.published.value)
    }

    /// Agreement in continuous time: impacts are so short that samples catch their peaks only by chance.
    pub fn agreement(&self) -> Agreement {
        Agreement::of(self.ratio())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_are_classified_by_their_agreement() {
        for (ratio, expected) in [
            (1.0, Agreement::Agrees),
            (0.89, Agreement::Near),
            (2.0, Agreement::Near),
            (2.1, Agreement::Differs),
            (0.3, Agreement::Differs),
            (f64::NAN, Agreement::Differs),
        ] {
            assert_eq!(Agreement::of(ratio), expected, "{ratio}");
        }
    }
}
