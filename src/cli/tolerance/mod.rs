//! `tolerance`: what part of a manufactured lot holds its limits, what drives the rejects, and the cheapest fits that hold a
//! yield.

mod candidates;
mod limit;
mod picture;
mod report;

use super::args::{SummaryForm, ToleranceArguments};
use super::study::{Study, inputs};
use super::{Failure, load, print};
use crate::analysis::distribution::Distribution;
use crate::analysis::fits::{FitSearch, FitSearchError, RequiredYield, cheapest_fits};
use crate::analysis::lot::{Limit, Lot, Quality};
use crate::analysis::sampling::{Sampler, Sampling};
use crate::analysis::yields::{Estimate, RejectDriver, YieldsError, reject_drivers};
use crate::files::Folder;

use self::candidates::Candidates;

/// The cheapest fits.
struct Cheapest {
    candidates: Vec<Candidates>,
    search: FitSearch,
    /// Yield of the best choice in a lot of other units.
    check: Option<Estimate>,
}

/// Everything found.
struct Found {
    lot: Lot,
    /// For each limited output.
    qualities: Vec<Quality>,
    /// For each parameter; `None` if all units or none are accepted.
    drivers: Option<Vec<RejectDriver>>,
    cheapest: Option<Cheapest>,
}

/// Runs `tolerance`.
///
/// # Errors
/// Bad input, before anything runs; later Ctrl-C or the file system.
pub fn tolerance(arguments: &ToleranceArguments) -> Result<(), Failure> {
    let scene = load(&arguments.scene)?;
    let inputs = inputs(&scene, arguments.tolerances.as_deref(), &arguments.over)?;
    let (outputs, limits) = limit::read(&scene, &arguments.limit)?;
    let candidates = arguments.cost.as_deref().map(|path| candidates::read(&scene, &inputs, path)).transpose()?;
    let folder = Folder::claim(&arguments.study.out, arguments.study.force)?;
    let mut study = Study::new(scene, inputs, outputs, &arguments.study)?;
    let found = find(&mut study, &limits, candidates, arguments)?;
    let results = report::json(&study, &limits, &found, arguments);
    let meta = report::meta(&study, arguments);
    let sheet = picture::sheet(&study, &limits, &found.lot);
    study.write(&folder, "tolerance", &meta, results.clone(), &report::table(&study, &limits, &found), &sheet)?;
    folder.finish(meta)?;
    print(&match arguments.study.summary {
        SummaryForm::Text => report::text(&study, &limits, &found, arguments),
        SummaryForm::Json => format!("{results:#}\n"),
    })?;
    study.finish();
    Ok(())
}

fn find(
    study: &mut Study,
    limits: &[Limit],
    candidates: Option<Vec<Candidates>>,
    arguments: &ToleranceArguments,
) -> Result<Found, Failure> {
    let sample = sample(study, arguments, arguments.sampling, arguments.study.seed)?;
    let own: Vec<Distribution> = study.inputs().iter().map(|input| input.distribution.clone()).collect();
    let lot = lot(study, limits, "lot", &sample, &own)?;
    let statistics = |error: YieldsError| Failure::usage(error.to_string());
    let qualities = limits.iter().enumerate().map(|(o, limit)| lot.quality(o, limit)).collect::<Result<_, _>>();
    let qualities = qualities.map_err(statistics)?;
    let of_input =
        |(i, distribution): (usize, &Distribution)| sample.iter().map(|u| distribution.quantile(u[i])).collect();
    let values: Vec<Vec<f64>> = own.iter().enumerate().map(of_input).collect();
    let drivers = reject_drivers(&values, &lot.accepted).map_err(statistics)?;
    let cheapest = match candidates {
        Some(candidates) => Some(cheapest(study, limits, candidates, &sample, &own, arguments)?),
        None => None,
    };
    Ok(Found { lot, qualities, drivers, cheapest })
}

/// Points of the unit cube, a coordinate for each parameter.
fn sample(
    study: &Study,
    arguments: &ToleranceArguments,
    sampling: Sampling,
    seed: u64,
) -> Result<Vec<Vec<f64>>, Failure> {
    let sampler = Sampler::new(sampling, study.inputs().len(), arguments.runs as usize, seed)
        .map_err(|error| Failure::usage(format!("--runs {}: {error}", arguments.runs)))?;
    Ok((0..sampler.points()).filter_map(|index| sampler.point(index)).collect())
}

/// Runs the units whose parameters have the fractions `sample` of their `distributions`.
fn lot(
    study: &mut Study,
    limits: &[Limit],
    stage: &str,
    sample: &[Vec<f64>],
    distributions: &[Distribution],
) -> Result<Lot, Failure> {
    let unit = |u: &Vec<f64>| distributions.iter().zip(u).map(|(distribution, &u)| distribution.quantile(u)).collect();
    let outputs = study.run(stage, sample.iter().map(unit).collect())?;
    Lot::new(outputs, limits).map_err(|error| Failure::usage(error.to_string()))
}

/// Searches the cheapest choice of candidates on the units of `sample`, and runs other units with it.
fn cheapest(
    study: &mut Study,
    limits: &[Limit],
    candidates: Vec<Candidates>,
    sample: &[Vec<f64>],
    own: &[Distribution],
    arguments: &ToleranceArguments,
) -> Result<Cheapest, Failure> {
    let costs: Vec<Vec<f64>> = candidates.iter().map(|of| of.list.iter().map(|one| one.cost).collect()).collect();
    let with = |chosen: &[usize]| {
        let mut distributions = own.to_vec();
        for (of, &chosen) in candidates.iter().zip(chosen) {
            distributions[of.input] = of.list[chosen].distribution.clone();
        }
        distributions
    };
    let required = RequiredYield { fraction: arguments.required_yield, with_confidence: false };
    let mut evaluations = 0;
    let evaluate = |chosen: &[usize]| {
        evaluations += 1;
        Ok(lot(study, limits, &format!("fits-{evaluations}"), sample, &with(chosen))?.yielded)
    };
    let search =
        cheapest_fits(&costs, required, arguments.evaluations as usize, evaluate).map_err(|error| match error {
            FitSearchError::Evaluation(failure) => failure,
            other => Failure::usage(format!("--cost: {other}")),
        })?;
    let check = match &search.best {
        Some(best) => {
            // Independent of the units of the search, which were in favour of the choice that they led to.
            let others = self::sample(study, arguments, Sampling::Random, arguments.study.seed.wrapping_add(1))?;
            Some(lot(study, limits, "fits-check", &others, &with(&best.candidates))?.yielded)
        }
        None => None,
    };
    Ok(Cheapest { candidates, search, check })
}
