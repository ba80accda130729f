//! `tolerance`: what part of a manufactured lot meets its limits, what drives the rejects, and the cheapest fits that hold a
//! yield.

mod limit;
mod picture;
mod report;

use super::args::{SummaryForm, ToleranceArguments};
use super::study::{Row, Study, inputs, rows};
use super::{Failure, interrupt, load, print};
use crate::analysis::study::{self, CandidateRequest, FitOptions, Input, ToleranceOptions};
use crate::files::Folder;
use crate::scene::Scene;

/// Runs `tolerance`.
///
/// # Errors
/// Bad input, before anything runs; later Ctrl-C or the file system.
pub fn tolerance(arguments: &ToleranceArguments) -> Result<(), Failure> {
    let scene = load(&arguments.scene)?;
    let inputs = inputs(&scene, arguments.tolerances.as_deref(), &arguments.over)?;
    let (outputs, limits) = limit::read(&scene, &arguments.limit)?;
    let options = ToleranceOptions {
        units: arguments.runs as usize,
        sampling: arguments.sampling,
        seed: arguments.study.seed,
        fits: fits(&scene, &inputs, arguments)?,
    };
    // From here on there is a temporary folder, which an interrupted command removes.
    interrupt::listen();
    let folder = Folder::claim(&arguments.study.out, arguments.study.force)?;
    let mut study = Study::new(scene, inputs, outputs, &arguments.study)?;
    let outcome = study::tolerance(&mut study, &limits, options)?;
    let results = report::json(&study, &limits, &outcome);
    let meta = report::meta(&study, arguments);
    let sheet = picture::sheet(&study, &limits, &outcome.lot);
    study.write(&folder, "tolerance", &meta, results.clone(), &report::table(&study, &limits, &outcome), &sheet)?;
    folder.finish(meta)?;
    print(&match arguments.study.summary {
        SummaryForm::Text => report::text(&study, &limits, &outcome, arguments),
        SummaryForm::Json => format!("{results:#}\n"),
    })?;
    study.finish();
    Ok(())
}

/// The search that `--cost`, `--yield` and `--evaluations` request.
fn fits(scene: &Scene, inputs: &[Input], arguments: &ToleranceArguments) -> Result<Option<FitOptions>, Failure> {
    let Some(path) = &arguments.cost else {
        return Ok(None);
    };
    let requested = rows("--cost", path, ["parameter", "fit", "cost"])?.into_iter();
    let requested = requested.map(|Row { place, cells: [pattern, distribution, cost] }| CandidateRequest {
        place,
        pattern,
        distribution,
        cost,
    });
    let candidates = study::candidates(scene, inputs, &requested.collect::<Vec<_>>())?;
    let (required_yield, evaluations) = (arguments.required_yield, arguments.evaluations as usize);
    Ok(Some(FitOptions { candidates, required_yield, evaluations }))
}
