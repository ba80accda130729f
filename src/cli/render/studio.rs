//! Renderers of the pictures: the scene alone, or the whole application.

use std::sync::Arc;

use eframe::egui::{Pos2, Rect, vec2};

use super::options;
use crate::app::{App, AppOptions, Headless, Link, Overlay, Strips, force_notes, strips};
use crate::cli::args::{RenderArguments, ThemeChoice};
use crate::cli::{Failure, interrupt, link, start};
use crate::machine::Vec3;
use crate::render::{Image, NoAdapter, Offscreen, RenderError};
use crate::scene::LiveScene;
use crate::scene::Scene;
use crate::session::log::Log;
use crate::simulate::{Frame, Peak};
use crate::view::{Camera, DrawList, MARK_DURATION, PeakMarks, SceneView, Shot, ViewOptions, WearMap, to_f32};

/// A simulation with its renderer.
pub trait Studio {
    /// Steps until `instant` lies in the latest step; a frame never shortens a step.
    ///
    /// # Errors
    /// The divergence guard, Ctrl-C.
    fn go_to(&mut self, instant: f64) -> Result<(), Failure>;

    /// Draws `instant`, which lies in the latest step. In a film, which shows `time_scale` simulated seconds per second, it
    /// also draws the events since the previous frame.
    ///
    /// # Errors
    /// A graphics adapter failure.
    fn draw(&mut self, instant: f64, time_scale: Option<f64>) -> Result<Image, Failure>;

    /// Fixes the force of the reference arrow, N, for all frames.
    fn fix_arrow_scale(&mut self, reference: f32);

    /// The simulation.
    fn simulation(&self) -> &LiveScene;

    /// Name of the graphics adapter.
    fn adapter(&self) -> String;
}

/// Target of the drawing.
enum Screen {
    /// The scene alone.
    Plain(Box<Offscreen>),
    /// The scene with text over it.
    Annotated(Box<Headless>),
}

/// The scene alone, with text over it if requested.
pub struct SceneStudio {
    simulation: LiveScene,
    frame: Frame,
    peaks: Vec<Peak>,
    /// Body and point of the probe tip.
    probe: Option<(usize, Vec3)>,
    trail: Vec<glam::Vec3>,
    screen: Screen,
    /// Text over the scene, without its numbers.
    overlay: Overlay,
    strips: Strips,
    view: SceneView,
    camera: Camera,
    options: ViewOptions,
    marks: PeakMarks,
    list: Arc<DrawList>,
}

impl SceneStudio {
    /// Sets everything up at t = 0.
    ///
    /// # Errors
    /// A scene that cannot start, bad options, no adapter.
    pub fn new(scene: &Scene, options: ViewOptions, arguments: &RenderArguments) -> Result<Self, Failure> {
        let mut simulation = start(scene)?;
        let mut frame = Frame::default();
        simulation.sample(0.0, &mut frame);
        let view = SceneView::new(scene, &frame);
        let size = [arguments.size.0, arguments.size.1];
        let wear = options.wear != WearMap::Off;
        let whole = Rect::from_min_size(Pos2::ZERO, vec2(size[0] as f32, size[1] as f32));
        // Magnified play and wear colours are never shown unlabelled.
        let has_text = arguments.overlay || options.magnification != 1.0 || wear;
        let contents =
            Overlay { time: Some(0.0), legend: arguments.overlay, labels: arguments.overlay, ..Overlay::default() };
        let lines = if arguments.overlay { scene.machine.loose_joints.len() } else { 0 };
        let strips = if has_text {
            strips(whole, &contents, 1 + usize::from(wear) + lines, &options, false)
        } else {
            Strips::of_scene(whole)
        };
        let camera = options::camera(arguments, scene, &view, &frame, &options, &strips)?;
        if wear {
            simulation.track_wear();
        }
        let screen = if has_text {
            Screen::Annotated(Box::new(Headless::new().map_err(|error| no_adapter(&error))?))
        } else {
            let offscreen = Offscreen::new().map_err(|error| no_adapter(&error))?;
            offscreen.check_size(size).map_err(|error| render_failure(&error))?;
            Screen::Plain(Box::new(offscreen))
        };
        Ok(Self {
            simulation,
            frame,
            peaks: Vec::new(),
            probe: scene.machine.output.probe.map(|tip| (scene.machine.output.body, tip)),
            trail: Vec::new(),
            screen,
            overlay: contents,
            strips,
            view,
            camera,
            options,
            marks: PeakMarks::new(),
            list: Arc::default(),
        })
    }
}

impl Studio for SceneStudio {
    fn go_to(&mut self, instant: f64) -> Result<(), Failure> {
        while self.simulation.time() < instant {
            if interrupt::is_requested() {
                return Err(interrupted(self.simulation.time()));
            }
            self.simulation.step().map_err(|stopped| Failure::new(Failure::DIVERGED, stopped.to_string()))?;
        }
        Ok(())
    }

    fn draw(&mut self, instant: f64, time_scale: Option<f64>) -> Result<Image, Failure> {
        self.simulation.sample(instant, &mut self.frame);
        self.simulation.take_peaks(&mut self.peaks);
        match time_scale {
            Some(time_scale) => {
                let fade = MARK_DURATION * time_scale;
                self.marks.update(&self.frame, &self.peaks, fade);
                if let Some((body, tip)) = self.probe {
                    let motion = &self.frame.bodies[body];
                    self.trail.push(to_f32(&(motion.position + motion.rotation * tip)));
                }
            }
            None => {
                // A single picture shows only its own instant.
                self.marks.clear(instant);
                self.marks.update(&self.frame, &[], f64::INFINITY);
            }
        }
        let shot = Shot {
            scene: self.simulation.pending(),
            frame: &self.frame,
            marks: &self.marks,
            options: &self.options,
            camera: &self.camera,
            trail: &self.trail,
            size: options::size_of(self.strips.scene),
            pixels_per_point: 1.0,
        };
        let list = Arc::make_mut(&mut self.list);
        self.view.build(&shot, list);
        if let Some(wear) = self.simulation.wear() {
            self.view.add_wear(&shot, wear, list);
        }
        match &mut self.screen {
            Screen::Plain(offscreen) => offscreen.render(&self.list),
            Screen::Annotated(headless) => {
                self.overlay.time = Some(instant);
                if self.overlay.labels {
                    self.overlay.notes = force_notes(self.simulation.pending(), &self.frame);
                }
                headless.picture(&self.list, &self.overlay, &self.strips, self.options.theme)
            }
        }
        .map_err(|error| render_failure(&error))
    }

    fn fix_arrow_scale(&mut self, reference: f32) {
        self.options.arrows.reference = Some(reference);
    }

    fn simulation(&self) -> &LiveScene {
        &self.simulation
    }

    fn adapter(&self) -> String {
        match &self.screen {
            Screen::Plain(offscreen) => offscreen.adapter(),
            Screen::Annotated(headless) => headless.adapter(),
        }
    }
}

/// The whole application with its panels.
pub struct ApplicationStudio {
    headless: Headless,
    app: App,
    size: [u32; 2],
}

/// Longest time that the application runs between two checks for Ctrl-C, s.
const SLICE: f64 = 0.01;

impl ApplicationStudio {
    /// Sets everything up at t = 0.
    ///
    /// # Errors
    /// A scene that cannot start, no adapter.
    pub fn new(scene: &Scene, options: ViewOptions, arguments: &RenderArguments) -> Result<Self, Failure> {
        let headless = Headless::new().map_err(|error| no_adapter(&error))?;
        let mut app_options = AppOptions::new(scene.clone());
        app_options.playing = false;
        // Plots, camera and instruments of the link; `--at` and `--duration` name the instants.
        app_options.link = arguments.scene.link.as_deref().map(link::parse).transpose()?.map(|link| {
            let log = Log { base: link.log.base, ..Log::default() };
            Link { log, time: None, steps: None, hash: None, playing: Some(false), ..link }
        });
        app_options.view =
            ViewOptions { magnification: arguments.magnification.unwrap_or(app_options.view.magnification), ..options };
        app_options.theme = match arguments.theme {
            ThemeChoice::Light => eframe::egui::ThemePreference::Light,
            ThemeChoice::Dark => eframe::egui::ThemePreference::Dark,
        };
        let app = headless.app(app_options).map_err(|error| scene.locate(&error))?;
        Ok(Self { headless, app, size: [arguments.size.0, arguments.size.1] })
    }
}

impl Studio for ApplicationStudio {
    fn go_to(&mut self, instant: f64) -> Result<(), Failure> {
        while self.simulation().time() < instant {
            if interrupt::is_requested() {
                return Err(interrupted(self.simulation().time()));
            }
            let next = (self.simulation().time() + SLICE).min(instant);
            let player = self.app.player_mut();
            player.run_to(next);
            if let Some(stopped) = player.stopped() {
                return Err(Failure::new(Failure::DIVERGED, stopped.to_string()));
            }
        }
        Ok(())
    }

    fn draw(&mut self, instant: f64, time_scale: Option<f64>) -> Result<Image, Failure> {
        match time_scale {
            Some(time_scale) => {
                let player = self.app.player_mut();
                player.pacer.set_scale(time_scale);
                player.run_to(instant);
                player.advance(0.0);
            }
            None => self.app.run_to(instant),
        }
        self.headless.app_frame(&mut self.app, self.size, 1.0).map_err(|error| render_failure(&error))
    }

    // The window scales its arrows by its own forces.
    fn fix_arrow_scale(&mut self, _reference: f32) {}

    fn simulation(&self) -> &LiveScene {
        self.app.player().simulation()
    }

    fn adapter(&self) -> String {
        self.headless.adapter()
    }
}

fn no_adapter(error: &NoAdapter) -> Failure {
    Failure::new(Failure::NO_ADAPTER, error.to_string())
}

fn render_failure(error: &RenderError) -> Failure {
    match error {
        RenderError::Size { .. } => Failure::usage(error.to_string()),
        RenderError::Device(_) => Failure::io(error.to_string()),
    }
}

fn interrupted(time: f64) -> Failure {
    Failure::new(Failure::INTERRUPTED, format!("interrupted at t = {time:.6e} s"))
}
