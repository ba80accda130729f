//! `map`: the tip's error over the workspace, at rest and over all positions of the balls in their play.

mod archive;
mod report;
mod results;
mod vtk;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use serde_json::Value as Json;

use self::results::Results;
use super::args::{MapArguments, SummaryForm};
use super::output::check_distinct;
use super::{Failure, interrupt, load, print, progress, threads};
use crate::analysis::map::{MapPoint, MapPointError, WorkspaceMap};
use crate::analysis::parallel::run_parallel;
use crate::analysis::sweep_run::RunFault;
use crate::files::{OutputFile, PendingFile, publish};

/// Format of an output, by its extension.
#[derive(Clone, Copy)]
enum MapFormat {
    Npz,
    Vtk,
}

impl MapFormat {
    fn of(path: &Path) -> Result<Self, Failure> {
        let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
        match &*extension.to_ascii_lowercase() {
            "npz" => Ok(Self::Npz),
            "vtk" => Ok(Self::Vtk),
            _ => Err(Failure::usage(format!(
                "--out {}: a map is written as a NumPy archive or for ParaView; use the extension .npz or .vtk",
                path.display()
            ))),
        }
    }
}

/// Runs `map`.
///
/// # Errors
/// Bad input, before anything is computed; later Ctrl-C or the file system.
pub fn map(arguments: &MapArguments) -> Result<(), Failure> {
    let scene = load(&arguments.scene)?;
    let map = WorkspaceMap::new(scene, &arguments.over, arguments.directions);
    let map = map.map_err(|error| Failure::usage(error.to_string()))?;
    // From here on there may be temporary files, which an interrupted command removes.
    interrupt::listen();
    let outputs = arguments.out.iter().map(|path| ("--out".to_owned(), path.clone()));
    let names: Vec<(String, PathBuf)> =
        std::iter::once(("the scene".to_owned(), arguments.scene.name())).chain(outputs).collect();
    check_distinct(&names)?;
    let targets = arguments.out.iter().map(|path| {
        let format = MapFormat::of(path)?;
        Ok((format, OutputFile::claim(path, arguments.force)?))
    });
    let targets = targets.collect::<Result<Vec<_>, Failure>>()?;
    let bar = progress::bar(!arguments.quiet, map.design().points() as u64);
    let points = compute(&map, threads(arguments.threads), || bar.inc(1));
    bar.finish_and_clear();
    let results = Results { map, points: points? };
    if let Some(Err(fault)) = results.points.first().filter(|_| results.points.iter().all(Result::is_err)) {
        return Err(Failure::usage(format!("no point has a pose of the machine without play; at the first: {fault}")));
    }
    let files = targets.into_iter().map(|(format, target)| match format {
        MapFormat::Npz => archive::npz(&results, target),
        MapFormat::Vtk => archive::vtk(&results, target),
    });
    publish(files.collect::<Result<Vec<PendingFile>, _>>()?)?;
    print(&match arguments.summary {
        SummaryForm::Text => report::text(&results, &arguments.out),
        SummaryForm::Json => format!("{:#}\n", Json::Object(report::json(&results, &arguments.out))),
    })
}

/// All points of `map`; `done` is called after each.
fn compute(
    map: &WorkspaceMap,
    threads: usize,
    mut done: impl FnMut(),
) -> Result<Vec<Result<MapPoint, MapPointError>>, Failure> {
    let todo: Vec<usize> = (0..map.design().points()).collect();
    let mut points: Vec<Option<Result<MapPoint, MapPointError>>> = todo.iter().map(|_| None).collect();
    let work = |point, _: &dyn Fn() -> bool| Some(map.point(point));
    run_parallel(&todo, threads, work, |result| {
        if let Some((point, result)) = result {
            points[point] = Some(result);
            done();
        }
        if interrupt::is_requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })
    .map_err(RunFault::from)?;
    let computed = points.iter().flatten().count();
    let points: Option<Vec<_>> = points.into_iter().collect();
    points.ok_or_else(|| {
        let message = format!("interrupted with {computed} of {} points done; nothing is written", todo.len());
        Failure::new(Failure::INTERRUPTED, message)
    })
}
