//! `tradeoff`: cost and error of every method on a scene, as a table, files and the documentation page.

mod files;
mod page;
mod picture;
mod points;

pub use page::skeleton;
pub use points::{percent, times, value};

use std::ffi::OsStr;
use std::path::Path;

use super::args::TradeoffArguments;
use super::{Failure, interrupt, load, measuring, print, warn};
use crate::analysis::{RunContext, WorkBudget, WorkPrecision, model_costs, presets, work_precision};
use crate::cli::args::SceneArguments;
use crate::files::Folder;
use crate::scene::{BUILT_IN, Scene};

/// Runs `tradeoff`.
///
/// # Errors
/// Bad input, before measuring starts; later a scene without a reference, Ctrl-C or the file system.
pub fn tradeoff(arguments: &TradeoffArguments) -> Result<(), Failure> {
    let budget = if arguments.quick { WorkBudget::QUICK } else { WorkBudget::FULL };
    match (&arguments.scene, &arguments.write) {
        (Some(scene), _) => measure_scene(scene, arguments, &budget),
        (None, Some(root)) => write_documentation(root, arguments.quiet, &budget),
        (None, None) => Err(Failure::usage("name a scene, or write --all --write FOLDER")),
    }
}

fn measure_scene(name: &OsStr, arguments: &TradeoffArguments, budget: &WorkBudget) -> Result<(), Failure> {
    let scene = load(&SceneArguments { scene: Some(name.to_owned()), changes: arguments.changes.clone(), link: None })?;
    // From here on there is a temporary folder, which an interrupted run removes.
    interrupt::listen();
    let folder = match &arguments.out {
        Some(path) => Some((path, Folder::claim(path, arguments.force)?)),
        None => None,
    };
    if !arguments.quiet {
        // Warnings about the solver do not matter here: all methods are run.
        for warning in scene.machine.warnings().iter().filter(|w| !w.is_about_solver()) {
            warn(&warning.to_string());
        }
    }
    let results = measure(&scene, budget, arguments.quiet)?;
    print(&points::text(&results))?;
    if let Some((path, folder)) = folder {
        let manifest = files::fill(&folder, &results, &scene)?;
        folder.finish(manifest)?;
        print(&format!("Written             {}\n", path.display()))?;
    }
    Ok(())
}

fn measure(scene: &Scene, budget: &WorkBudget, quiet: bool) -> Result<WorkPrecision, Failure> {
    measuring::measure(quiet, Some(scene), |context| work_precision(scene, budget, context))
}

/// Measures all built-in scenes for the documentation, and writes the documentation at the end.
fn write_documentation(root: &Path, quiet: bool, budget: &WorkBudget) -> Result<(), Failure> {
    let files = page::claim(root)?;
    let mut all_results = Vec::with_capacity(BUILT_IN.len());
    let mut paces = Vec::with_capacity(BUILT_IN.len());
    for name in BUILT_IN {
        let scene = Scene::load(name, &[])?;
        all_results.push(measure(&scene, &budget.of(&scene), quiet)?);
        let pace = |context: &mut RunContext| presets::pace(&scene, budget, context);
        paces.push((name, measuring::measure(quiet, Some(&scene), pace)?));
    }
    let costs = measuring::measure(quiet, None, |context| model_costs(budget, context))?;
    page::write(files, &all_results, &paces, &costs)?;
    for results in &all_results {
        print(&points::text(results))?;
    }
    print(&points::costs(&costs).text())
}
