//! `render`: frames without a window, drawn by the window's own code.

mod destination;
mod options;
mod studio;

use serde_json::{Map, Value as Json, json};

use self::destination::Destination;
use self::studio::{ApplicationStudio, SceneStudio, Studio};
use super::args::RenderArguments;
use super::summary::{Status, count as count_of, hash_text};
use super::{Failure, interrupt, load, progress, provenance, quantity, start, warn};
use crate::scene::Scene;
use crate::simulate::{Frame, Peak};
use crate::view::{PeakMarks, ViewOptions};

/// Frame names have five digits.
const MAX_FRAMES: f64 = 100_000.0;

/// When to draw, and how much viewing time passes between two pictures.
#[derive(Clone, Debug, PartialEq)]
struct Times {
    /// Instants, s, in the order of the frame numbers.
    instants: Vec<f64>,
    /// Simulated seconds per second of film; `None` for single pictures.
    time_scale: Option<f64>,
}

impl Times {
    fn new(arguments: &RenderArguments) -> Result<Self, Failure> {
        let (Some(duration), Some(fps)) = (&arguments.duration, arguments.fps) else {
            let instants = arguments.at.iter().map(|at| quantity::duration("--at", at)).collect::<Result<_, _>>()?;
            return Ok(Self { instants, time_scale: None });
        };
        let duration = quantity::duration("--duration", duration)?;
        options::positive("--fps", fps, 10_000.0)?;
        options::positive("--slow", arguments.slow, 1e9)?;
        let rate = fps * arguments.slow;
        // Both ends count; the factor keeps a whole number of frames whole despite rounding.
        let last = (duration * rate * (1.0 + 1e-9)).floor();
        if last >= MAX_FRAMES {
            return Err(Failure::usage(format!(
                "{} frames are more than the limit of {MAX_FRAMES}; choose a lower --fps, a lower --slow or a shorter \
                 --duration",
                last + 1.0
            )));
        }
        Ok(Self {
            instants: (0..=last as u64).map(|k| (k as f64 / rate).min(duration)).collect(),
            time_scale: Some(1.0 / arguments.slow),
        })
    }

    /// Frame numbers in order of time, because the simulation only runs forward.
    fn in_order(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.instants.len()).collect();
        order.sort_by(|&a, &b| self.instants[a].total_cmp(&self.instants[b]));
        order
    }
}

/// Runs `render`.
///
/// # Errors
/// Bad input, no adapter, the divergence guard, Ctrl-C, the file system.
pub fn render(arguments: &RenderArguments) -> Result<(), Failure> {
    let times = Times::new(arguments)?;
    let view = options::view_options(arguments)?;
    let scene = load(&arguments.scene)?;
    let mut studio: Box<dyn Studio> = if arguments.ui {
        Box::new(ApplicationStudio::new(&scene, view.clone(), arguments)?)
    } else {
        Box::new(SceneStudio::new(&scene, view.clone(), arguments)?)
    };
    // From here on there is a temporary folder, which an interrupted run removes.
    interrupt::listen();
    let destination = Destination::claim(arguments)?;
    if !arguments.quiet {
        for warning in scene.machine.warnings() {
            warn(&warning.to_string());
        }
    }
    if let Some(reference) = common_reference(&scene, &times, &view, arguments)? {
        studio.fix_arrow_scale(reference);
    }
    fill(destination, &mut *studio, &scene, &times, arguments)
}

/// Draws all frames and gives the folder or the film its final name; an interrupted film leaves nothing.
fn fill(
    mut destination: Destination,
    studio: &mut dyn Studio,
    scene: &Scene,
    times: &Times,
    arguments: &RenderArguments,
) -> Result<(), Failure> {
    let meta = provenance::meta(scene);
    let bar = progress::bar(!arguments.quiet, times.instants.len() as u64);
    let mut frames = vec![Json::Null; times.instants.len()];
    let mut status = Status::Done;
    let mut failure = None;
    for (done, number) in times.in_order().into_iter().enumerate() {
        let instant = times.instants[number];
        if let Err(stop) = studio.go_to(instant) {
            status = if stop.code == Failure::INTERRUPTED { Status::Interrupted } else { Status::Diverged };
            failure = Some(stop);
            break;
        }
        let image = studio.draw(instant, times.time_scale)?;
        let mut entry = destination.add(number, &image, &meta)?;
        entry.insert("time_s".into(), json!(instant));
        entry.insert("state_time_s".into(), json!(studio.simulation().time()));
        let hash = hash_text(studio.simulation().state_hash());
        entry.insert("state_hash".into(), json!(hash));
        frames[number] = Json::Object(entry);
        bar.set_position(done as u64 + 1);
    }
    bar.finish_and_clear();
    if let (Destination::Film { .. }, Status::Interrupted, Some(stop)) = (&destination, status, &failure) {
        return Err(stop.clone());
    }

    frames.retain(|frame| !frame.is_null());
    let failure = failure.map(|failure| failure.with_result_in(&destination.spare_older()));
    let written = count_of(frames.len() as u64, "frame");
    let mut manifest = meta;
    manifest.insert("parameters".into(), provenance::parameters(scene)?);
    manifest.insert("status".into(), json!(status.word()));
    manifest.insert("size".into(), json!([arguments.size.0, arguments.size.1]));
    manifest.insert("adapter".into(), json!(studio.adapter()));
    manifest.insert("frames".into(), Json::Array(frames));
    destination.finish(manifest, &written)?;
    failure.map_or(Ok(()), Err)
}

/// Automatic force of the reference arrow, N, from all frames together, so that their arrows compare; `None` if no common
/// force is needed. Runs the simulation once beforehand.
fn common_reference(
    scene: &Scene,
    times: &Times,
    view: &ViewOptions,
    arguments: &RenderArguments,
) -> Result<Option<f32>, Failure> {
    let arrows = &view.arrows;
    let drawn = arrows.normal || arrows.friction;
    if arguments.ui || !drawn || arrows.reference.is_some() || times.instants.len() < 2 {
        return Ok(None);
    }
    let mut simulation = start(scene)?;
    let (mut frame, mut peaks, mut marks) = (Frame::default(), Vec::new(), PeakMarks::new());
    for number in times.in_order() {
        let instant = times.instants[number];
        while simulation.time() < instant {
            // Drawing the frames will report the reason.
            if interrupt::is_requested() || simulation.step().is_err() {
                return Ok(Some(marks.reference(arrows)));
            }
        }
        simulation.sample(instant, &mut frame);
        simulation.take_peaks(&mut peaks);
        let peaks_since: &[Peak] = if times.time_scale.is_some() && arrows.peaks { &peaks } else { &[] };
        // Without fading, the largest forces remain.
        marks.update(&frame, peaks_since, f64::INFINITY);
    }
    Ok(Some(marks.reference(arrows)))
}

/// Provenance of a picture as text entries inside it, which survive the loss of the manifest.
fn labels(meta: &Map<String, Json>) -> Vec<(&'static str, String)> {
    vec![("Software", format!("jointplay {}", crate::VERSION)), ("Description", Json::Object(meta.clone()).to_string())]
}
