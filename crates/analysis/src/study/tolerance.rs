//! What part of a lot holds its limits, what drives the rejects, and the cheapest fits that hold a yield.

use super::{Candidates, StudyError, StudyRunner};
use crate::argument::Argument;
use crate::distribution::Distribution;
use crate::fits::{FitProblem, FitSearch, RequiredYield};
use crate::lot::{Limit, Lot, Quality};
use crate::sampling::{Sampler, Sampling};
use crate::yields::{Estimate, RejectDriver, reject_drivers};

/// What a tolerance study computes.
#[derive(Clone, Debug, PartialEq)]
pub struct ToleranceOptions {
    /// Units of the lot, one run each.
    pub units: usize,
    /// How their values are drawn.
    pub sampling: Sampling,
    /// Seed of the samples.
    pub seed: u64,
    /// Search of the cheapest fits.
    pub fits: Option<FitOptions>,
}

/// A search of the cheapest fits.
#[derive(Clone, Debug, PartialEq)]
pub struct FitOptions {
    /// Of each parameter that has any.
    pub candidates: Vec<Candidates>,
    /// Part of the lot that must be accepted, above 0 and up to 1.
    pub required_yield: f64,
    /// Most choices that are tried, one lot each.
    pub evaluations: usize,
}

/// The cheapest fits.
#[derive(Clone, Debug, PartialEq)]
pub struct CheapestFits {
    /// What was asked for.
    pub options: FitOptions,
    /// What was found; the joints are those of the candidates.
    pub search: FitSearch,
    /// Yield of the best choice in a lot of other units, and what it says about the required one.
    pub check: Option<(Estimate, FitVerdict)>,
}

/// What another lot says about a required yield.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FitVerdict {
    /// It holds with 95 % confidence.
    Held,
    /// It does not hold.
    Missed,
    /// Too few runs to tell.
    Open,
}

impl FitVerdict {
    /// What the yield `check` says about the required one.
    fn of(check: &Estimate, required: f64) -> Self {
        if check.low >= required {
            Self::Held
        } else if check.high < required {
            Self::Missed
        } else {
            Self::Open
        }
    }

    /// The word in files.
    pub fn word(self) -> &'static str {
        match self {
            Self::Held => "held",
            Self::Missed => "missed",
            Self::Open => "open",
        }
    }
}

/// Everything found.
#[derive(Clone, Debug, PartialEq)]
pub struct Tolerance {
    /// The units.
    pub lot: Lot,
    /// For each limited output.
    pub qualities: Vec<Quality>,
    /// For each parameter; `None` if all units or none are accepted.
    pub drivers: Option<Vec<RejectDriver>>,
    /// `None` if they were not asked for.
    pub cheapest: Option<CheapestFits>,
}

/// Makes the runs of a tolerance study in the stages `lot`, `fits-1`, `fits-2`, …, and `fits-check`. `limits` has one for each
/// output.
///
/// # Errors
/// A lot or search that is not possible, before anything runs; an error of `runner`.
pub fn tolerance<R: StudyRunner>(
    runner: &mut R,
    limits: &[Limit],
    options: ToleranceOptions,
) -> Result<Tolerance, R::Error> {
    let ToleranceOptions { units, sampling, seed, fits } = options;
    let sample = sample(runner, units, sampling, seed)?;
    let problem = fits.as_ref().map(problem).transpose()?;
    let own: Vec<Distribution> = runner.inputs().iter().map(|input| input.distribution.clone()).collect();
    let lot = lot(runner, limits, "lot", &sample, &own)?;
    let qualities = limits.iter().enumerate().map(|(o, limit)| lot.quality(o, limit)).collect::<Result<_, _>>();
    let qualities = qualities.map_err(StudyError::from)?;
    let of_input =
        |(i, distribution): (usize, &Distribution)| sample.iter().map(|u| distribution.quantile(u[i])).collect();
    let values: Vec<Vec<f64>> = own.iter().enumerate().map(of_input).collect();
    let drivers = reject_drivers(&values, &lot.accepted).map_err(StudyError::from)?;
    let mut found = Tolerance { lot, qualities, drivers, cheapest: None };
    let Some((fits, problem)) = fits.zip(problem) else {
        return Ok(found);
    };
    let with = |chosen: &[usize]| {
        let mut distributions = own.clone();
        for (of, &chosen) in fits.candidates.iter().zip(chosen) {
            distributions[of.input] = of.list[chosen].distribution.clone();
        }
        distributions
    };
    let mut evaluations = 0;
    let search = problem.solve(|chosen| {
        evaluations += 1;
        Ok::<_, R::Error>(self::lot(runner, limits, &format!("fits-{evaluations}"), &sample, &with(chosen))?.yielded)
    })?;
    let check = match &search.best {
        Some(best) => {
            // Independent of the units of the search, which were in favour of the choice that they led to.
            let others = self::sample(runner, units, Sampling::Random, seed.wrapping_add(1))?;
            let yielded = self::lot(runner, limits, "fits-check", &others, &with(&best.candidates))?.yielded;
            Some((yielded, FitVerdict::of(&yielded, fits.required_yield)))
        }
        None => None,
    };
    found.cheapest = Some(CheapestFits { options: fits, search, check });
    Ok(found)
}

/// The search of the cheapest fits, in which all choices are judged by the same units.
fn problem(fits: &FitOptions) -> Result<FitProblem, StudyError> {
    let costs: Vec<Vec<f64>> = fits.candidates.iter().map(|of| of.list.iter().map(|one| one.cost).collect()).collect();
    let required = RequiredYield { fraction: fits.required_yield, with_confidence: false };
    FitProblem::new(&costs, required, fits.evaluations).map_err(StudyError::Fits)
}

/// Points of the unit cube, a coordinate for each parameter.
fn sample(runner: &impl StudyRunner, units: usize, sampling: Sampling, seed: u64) -> Result<Vec<Vec<f64>>, StudyError> {
    let sampler = Sampler::new(sampling, runner.inputs().len(), units, seed)
        .map_err(|error| StudyError::argument(Argument::Units, units, error))?;
    Ok((0..sampler.points()).filter_map(|index| sampler.point(index)).collect())
}

/// Runs the units whose parameters have the fractions `sample` of their `distributions`.
fn lot<R: StudyRunner>(
    runner: &mut R,
    limits: &[Limit],
    stage: &str,
    sample: &[Vec<f64>],
    distributions: &[Distribution],
) -> Result<Lot, R::Error> {
    let unit = |u: &Vec<f64>| distributions.iter().zip(u).map(|(distribution, &u)| distribution.quantile(u)).collect();
    let outputs = runner.run(stage, sample.iter().map(unit).collect())?;
    Ok(Lot::new(outputs, limits).map_err(StudyError::from)?)
}
