//! `sensitivity`: which parameters influence an output most, each alone and all together, and which changes reach a target.

mod picture;
mod report;

use super::args::{SensitivityArguments, SummaryForm};
use super::study::{Study, inputs, outputs};
use super::{Failure, interrupt, load, print, warn};
use crate::analysis::study::{self, SensitivityOptions};
use crate::files::Folder;

/// Runs `sensitivity`.
///
/// # Errors
/// Bad input, before anything runs; later Ctrl-C or the file system.
pub fn sensitivity(arguments: &SensitivityArguments) -> Result<(), Failure> {
    let scene = load(&arguments.scene)?;
    let inputs = inputs(&scene, None, &arguments.over)?;
    let outputs = outputs(&scene, "--output", &arguments.output)?;
    let target = arguments
        .target
        .as_deref()
        .map(|text| outputs[0].read(text).map_err(|error| Failure::usage(format!("--target {text}: {error}"))));
    let options = SensitivityOptions {
        rows: arguments.rows as usize,
        screen: arguments.screen.map(|trajectories| trajectories as usize),
        target: target.transpose()?,
        seed: arguments.study.seed,
    };
    options.check()?;
    if !arguments.study.quiet && options.rows > 0 && !options.rows.is_power_of_two() {
        warn(&format!("--rows {}: a Sobol sequence is evenly distributed only for a power of two", options.rows));
    }
    // From here on there is a temporary folder, which an interrupted command removes.
    interrupt::listen();
    let folder = Folder::claim(&arguments.study.out, arguments.study.force)?;
    let mut study = Study::new(scene, inputs, outputs, &arguments.study)?;
    let results = study::sensitivity(&mut study, &options)?;
    let manifest = report::fill(&folder, &study, &results, arguments)?;
    folder.finish(manifest)?;
    print(&match arguments.study.summary {
        SummaryForm::Text => report::text(&study, &results, &arguments.study.out),
        SummaryForm::Json => format!("{:#}\n", report::json(&study, &results)),
    })?;
    study.finish();
    Ok(())
}
