//! What takes the pictures: the scene alone, or the whole application.

use super::options;
use crate::app::{App, AppOptions, Headless};
use crate::cli::args::{RenderArguments, ThemeChoice};
use crate::cli::output::significant;
use crate::cli::{Failure, interrupt};
use crate::render::{Image, NoAdapter, Offscreen, RenderError};
use crate::scene::{Scene, Vec3};
use crate::simulate::{Frame, Peak, Simulation};
use crate::view::{ArrowMemory, Camera, DrawList, SceneView, Shot, ViewOptions, to_f32};

/// A simulation and what draws it.
pub trait Studio {
    /// Steps until `instant` lies in the latest step; a frame never shortens a step.
    ///
    /// # Errors
    /// The divergence guard, Ctrl-C.
    fn go_to(&mut self, instant: f64) -> Result<(), Failure>;

    /// Draws `instant`, which lies in the latest step; in a film, `frame_time` seconds of viewing time after the frame
    /// before and with what happened since.
    ///
    /// # Errors
    /// A failing graphics adapter.
    fn draw(&mut self, instant: f64, frame_time: Option<f64>) -> Result<Image, Failure>;

    /// The simulation.
    fn simulation(&self) -> &Simulation;

    /// Name of the graphics adapter.
    fn adapter(&self) -> String;
}

/// The scene alone, with text over it where asked.
pub struct SceneStudio {
    simulation: Simulation,
    frame: Frame,
    peaks: Vec<Peak>,
    /// Body and point of the probe tip.
    probe: Option<(usize, Vec3)>,
    trail: Vec<glam::Vec3>,
    names: Vec<String>,
    offscreen: Offscreen,
    overlay: Option<Headless>,
    view: SceneView,
    camera: Camera,
    options: ViewOptions,
    arrows: ArrowMemory,
    list: DrawList,
    size: [u32; 2],
}

impl SceneStudio {
    /// Sets everything up at t = 0.
    ///
    /// # Errors
    /// A scene that cannot start, bad options, no adapter.
    pub fn new(
        scene: &Scene,
        options: ViewOptions,
        arguments: &RenderArguments,
    ) -> Result<Self, Failure> {
        let mut simulation = Simulation::new(scene)?;
        let mut frame = Frame::default();
        simulation.sample(0.0, &mut frame);
        let view = SceneView::new(scene, &frame);
        let camera = options::camera(arguments, scene, &view, &frame, &options)?;
        let size = [arguments.size.0, arguments.size.1];
        let offscreen = Offscreen::new().map_err(|error| no_adapter(&error))?;
        offscreen
            .check_size(size)
            .map_err(|error| Failure::usage(error.to_string()))?;
        let overlay = if arguments.overlay {
            Some(Headless::new().map_err(|error| no_adapter(&error))?)
        } else {
            None
        };
        Ok(Self {
            simulation,
            frame,
            peaks: Vec::new(),
            probe: scene.output.probe.map(|tip| (scene.output.body, tip)),
            trail: Vec::new(),
            names: scene
                .ball_joints
                .iter()
                .map(|joint| joint.name.clone())
                .collect(),
            offscreen,
            overlay,
            view,
            camera,
            options,
            arrows: ArrowMemory::new(),
            list: DrawList::default(),
            size,
        })
    }

    /// Forces at the instant on show, a line for each ball joint, and how much the play is magnified.
    fn notes(&self) -> Vec<String> {
        let mut notes = vec![self.list.magnification_text.clone()];
        notes.extend(
            self.names
                .iter()
                .zip(&self.frame.joints)
                .map(|(name, joint)| {
                    format!(
                        "{name}: normal {} N, friction {} N",
                        significant(joint.normal_force.norm(), 4),
                        significant(joint.friction_force.norm(), 4)
                    )
                }),
        );
        notes
    }
}

impl Studio for SceneStudio {
    fn go_to(&mut self, instant: f64) -> Result<(), Failure> {
        while self.simulation.time() < instant {
            if interrupt::asked() {
                return Err(interrupted(self.simulation.time()));
            }
            self.simulation
                .step()
                .map_err(|stopped| Failure::new(Failure::DIVERGED, stopped.to_string()))?;
        }
        Ok(())
    }

    fn draw(&mut self, instant: f64, frame_time: Option<f64>) -> Result<Image, Failure> {
        self.simulation.sample(instant, &mut self.frame);
        self.simulation.take_peaks(&mut self.peaks);
        match frame_time {
            Some(frame_time) => {
                let options = &self.options.arrows;
                self.arrows
                    .update(&self.frame, &self.peaks, frame_time as f32, options);
                if let Some((body, tip)) = self.probe {
                    let motion = &self.frame.bodies[body];
                    self.trail
                        .push(to_f32(&(motion.position + motion.rotation * tip)));
                }
            }
            None => {
                // A single picture shows the forces of its own instant.
                self.arrows.clear();
                self.arrows
                    .update(&self.frame, &[], 0.0, &self.options.arrows);
            }
        }
        let shot = Shot {
            frame: &self.frame,
            arrows: &self.arrows,
            options: &self.options,
            camera: &self.camera,
            trail: &self.trail,
            size: self.size,
        };
        self.view.build(&shot, &mut self.list);
        let image = self
            .offscreen
            .render(&self.list)
            .map_err(|error| failed(&error))?;
        let notes = self.notes();
        match &mut self.overlay {
            Some(overlay) => overlay
                .over(&image, &self.list, instant, &notes, self.options.theme)
                .map_err(|error| failed(&error)),
            None => Ok(image),
        }
    }

    fn simulation(&self) -> &Simulation {
        &self.simulation
    }

    fn adapter(&self) -> String {
        self.offscreen.adapter()
    }
}

/// The whole application with its panels.
pub struct ApplicationStudio {
    headless: Headless,
    app: App,
    size: [u32; 2],
}

/// Longest time that the application runs between two looks for Ctrl-C, s.
const SLICE: f64 = 0.01;

impl ApplicationStudio {
    /// Sets everything up at t = 0.
    ///
    /// # Errors
    /// A scene that cannot start, no adapter.
    pub fn new(
        scene: &Scene,
        options: ViewOptions,
        arguments: &RenderArguments,
    ) -> Result<Self, Failure> {
        let headless = Headless::new().map_err(|error| no_adapter(&error))?;
        let mut start = AppOptions::new(scene.clone());
        start.playing = false;
        start.view = options;
        start.theme = match arguments.theme {
            ThemeChoice::Light => eframe::egui::ThemePreference::Light,
            ThemeChoice::Dark => eframe::egui::ThemePreference::Dark,
        };
        let app = headless.app(start)?;
        Ok(Self {
            headless,
            app,
            size: [arguments.size.0, arguments.size.1],
        })
    }
}

impl Studio for ApplicationStudio {
    fn go_to(&mut self, instant: f64) -> Result<(), Failure> {
        while self.simulation().time() < instant {
            if interrupt::asked() {
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

    fn draw(&mut self, instant: f64, _frame_time: Option<f64>) -> Result<Image, Failure> {
        self.app.player_mut().run_to(instant);
        self.headless
            .app_frame(&mut self.app, self.size, 1.0)
            .map_err(|error| failed(&error))
    }

    fn simulation(&self) -> &Simulation {
        self.app.player().simulation()
    }

    fn adapter(&self) -> String {
        self.headless.adapter()
    }
}

fn no_adapter(error: &NoAdapter) -> Failure {
    Failure::new(Failure::NO_ADAPTER, error.to_string())
}

fn failed(error: &RenderError) -> Failure {
    match error {
        RenderError::Size { .. } => Failure::usage(error.to_string()),
        RenderError::Device(_) => Failure::io(error.to_string()),
    }
}

fn interrupted(time: f64) -> Failure {
    Failure::new(
        Failure::INTERRUPTED,
        format!("interrupted at t = {time:.6e} s"),
    )
}
