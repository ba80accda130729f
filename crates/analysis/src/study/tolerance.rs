//! Tolerance studies: the fraction of a lot within its limits, the inputs that cause rejects, and the cheapest fits that hold a
//! yield.

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
    /// How the values of the units are drawn.
    pub sampling: Sampling,
    /// Seed of the samples.
    pub seed: u64,
    /// Search for the cheapest fits, if requested.
    pub fits: Option<FitOptions>,
}

/// Options of a search for the cheapest fits.
#[derive(Clone, Debug, PartialEq)]
pub struct FitOptions {
    /// Candidates of each parameter that has any.
    pub candidates: Vec<Candidates>,
    /// Fraction of the lot that must be accepted, above 0 and up to 1.
    pub required_yield: f64,
    /// Largest number of choices to evaluate, one lot each.
    pub evaluations: usize,
}

/// Result of a search for the cheapest fits.
#[derive(Clone, Debug, PartialEq)]
pub struct CheapestFits {
    /// The requested options.
    pub options: FitOptions,
    /// Result of the search; its joints are the parameters of the candidates.
    pub search: FitSearch,
    /// Yield of the best choice in an independent lot, and the verdict on the required yield.
    pub check: Option<(Estimate, FitVerdict)>,
}

/// Verdict of an independent lot on a required yield.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FitVerdict {
    /// The yield holds with 95 % confidence.
    Held,
    /// The yield does not hold, with 95 % confidence.
    Missed,
    /// Too few runs to tell.
    Open,
}

impl FitVerdict {
    /// Compares the measured yield `check` with the required one.
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

/// Results of a tolerance study.
#[derive(Clone, Debug, PartialEq)]
pub struct Tolerance {
    /// The units.
    pub lot: Lot,
    /// Statistics of each limited output.
    pub qualities: Vec<Quality>,
    /// How rejects differ in each parameter; `None` if all units or none are accepted.
    pub drivers: Option<Vec<RejectDriver>>,
    /// The cheapest fits, if requested.
    pub cheapest: Option<CheapestFits>,
}

/// Runs a tolerance study in the stages `lot`, `fits-1`, `fits-2`, …, and `fits-check`. `limits` holds one entry for each
/// output.
///
/// # Errors
/// An invalid lot or search, before anything runs; an error of `runner`.
pub fn tolerance<R: StudyRunner>(
    runner: &mut R,
    limits: &[Limit],
    options: ToleranceOptions,
) -> Result<Tolerance, R::Error> {
    let ToleranceOptions { units, sampling, seed, fits } = options;
    let sample = sample(runner, units, sampling, seed)?;
    let problem = fits.as_ref().map(problem).transpose()?;
    let given: Vec<Distribution> = runner.inputs().iter().map(|input| input.distribution.clone()).collect();
    let lot = lot(runner, limits, "lot", &sample, &given)?;
    let qualities = limits.iter().enumerate().map(|(o, limit)| lot.quality(o, limit)).collect::<Result<_, _>>();
    let qualities = qualities.map_err(StudyError::from)?;
    let of_input =
        |(i, distribution): (usize, &Distribution)| sample.iter().map(|u| distribution.quantile(u[i])).collect();
    let values: Vec<Vec<f64>> = given.iter().enumerate().map(of_input).collect();
    let drivers = reject_drivers(&values, &lot.accepted).map_err(StudyError::from)?;
    let mut result = Tolerance { lot, qualities, drivers, cheapest: None };
    let Some((fits, problem)) = fits.zip(problem) else {
        return Ok(result);
    };
    let with = |chosen: &[usize]| {
        let mut distributions = given.clone();
        for (candidates, &chosen) in fits.candidates.iter().zip(chosen) {
            distributions[candidates.input] = candidates.list[chosen].distribution.clone();
        }
        distributions
    };
    let mut evaluations = 0;
    let search = problem.solve(|chosen| {
        evaluations += 1;
        Ok::<_, R::Error>(
            self::lot(runner, limits, &format!("fits-{evaluations}"), &sample, &with(chosen))?.yield_estimate,
        )
    })?;
    let check = match &search.best {
        Some(best) => {
            // The units of the search are biased in favour of the choice that they selected; the check uses independent units.
            let independent = self::sample(runner, units, Sampling::Random, seed.wrapping_add(1))?;
            let yield_estimate =
                self::lot(runner, limits, "fits-check", &independent, &with(&best.candidates))?.yield_estimate;
            Some((yield_estimate, FitVerdict::of(&yield_estimate, fits.required_yield)))
        }
        None => None,
    };
    result.cheapest = Some(CheapestFits { options: fits, search, check });
    Ok(result)
}

/// The search problem for the cheapest fits. All choices are evaluated with the same units.
fn problem(fits: &FitOptions) -> Result<FitProblem, StudyError> {
    let costs: Vec<Vec<f64>> = fits
        .candidates
        .iter()
        .map(|candidates| candidates.list.iter().map(|candidate| candidate.cost).collect())
        .collect();
    let required = RequiredYield { fraction: fits.required_yield, with_confidence: false };
    FitProblem::new(&costs, required, fits.evaluations).map_err(StudyError::Fits)
}

/// Points of the unit cube, with a coordinate for each parameter.
fn sample(runner: &impl StudyRunner, units: usize, sampling: Sampling, seed: u64) -> Result<Vec<Vec<f64>>, StudyError> {
    let sampler = Sampler::new(sampling, runner.inputs().len(), units, seed)
        .map_err(|error| StudyError::argument(Argument::Units, units, error))?;
    Ok((0..sampler.points()).filter_map(|index| sampler.point(index)).collect())
}

/// Runs the units whose parameters are the quantiles of their `distributions` at the points of `sample`.
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
