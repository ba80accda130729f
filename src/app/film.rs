//! Films of a time window. Each frame is an instant of the run, reached by stepping and drawn off screen like a saved picture, so
//! the film does not depend on computing speed. Afterwards the run returns to its previous instant.

use eframe::egui::{self, RichText, Ui};

use super::App;
use super::canvas::{Canvas, Pending};
use super::graphics::Graphics;
use super::host::SaveFile;
use super::picture::Contents;
use super::player::Player;
use super::run::Run;
use super::tasks::Tasks;
use super::{field, layout, transport, value};
use crate::film::{Film, FilmFormat};

/// Sizes to choose from, pixels.
const SIZES: [([u32; 2], &str); 4] = [
    ([640, 360], "640 × 360"),
    ([1280, 720], "1280 × 720"),
    ([1920, 1080], "1920 × 1080"),
    ([3840, 2160], "3840 × 2160 (4K)"),
];
/// Frames per second to choose from.
const RATES: [f64; 4] = [15.0, 25.0, 30.0, 60.0];
/// Most frames of a film: more than five minutes at the highest rate.
const MAX_FRAMES: f64 = 20_000.0;

/// Settings of the next film.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmSettings {
    /// First and last instant, s.
    pub span: [f64; 2],
    /// Simulated seconds per second of film.
    pub scale: f64,
    /// Frames per second of film.
    pub rate: f64,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Whether the plots appear below the view.
    pub plots: bool,
    /// File format.
    pub format: FilmFormat,
}

impl FilmSettings {
    /// The run from 0 to `reached`, s, at time scale `scale`.
    pub fn all(reached: f64, scale: f64) -> Self {
        Self { span: [0.0, reached], scale, rate: 30.0, size: SIZES[1].0, plots: false, format: FilmFormat::Mp4 }
    }

    /// Number of frames; both ends count, as in `render --duration`.
    fn frames(&self) -> f64 {
        let [from, to] = self.span;
        ((to - from) / self.scale * self.rate * (1.0 + 1e-9)).floor() + 1.0
    }

    /// Instant of frame `k`, s.
    fn instant(&self, k: u64) -> f64 {
        let [from, to] = self.span;
        (from + k as f64 * self.scale / self.rate).min(to)
    }

    /// Why the film cannot be made, as a message.
    pub fn objection(&self) -> Option<String> {
        if self.span[0] == self.span[1] {
            return Some("The time range is empty: play the run first, or choose another range".to_owned());
        }
        if self.span[0] > self.span[1] {
            return Some("The film ends before it begins".to_owned());
        }
        if self.frames() > MAX_FRAMES {
            return Some(format!(
                "More than {MAX_FRAMES} frames: choose a shorter range, a faster time scale or fewer frames per second"
            ));
        }
        let fault = self.format.check(self.size, self.rate).err();
        fault.map(|error| error.to_string())
    }
}

/// A film being made.
pub struct RunningFilm {
    settings: FilmSettings,
    film: Film,
    canvas: Canvas,
    pending: Option<Pending>,
    /// Width over height of the view at the start.
    aspect: f32,
    /// Index of the next frame.
    next: u64,
    /// State of the run before: displayed instant, s, time scale, and whether it played.
    before: (f64, f64, bool),
}

impl RunningFilm {
    /// Progress, 0 to 1.
    pub fn fraction(&self) -> f32 {
        (self.film.frames() as f64 / self.settings.frames()) as f32
    }

    /// Restores the run from before: displayed instant, time scale, and whether it played.
    pub fn return_run(&self, run: &mut Run) {
        let (shown, scale, playing) = self.before;
        run.player.pacer.set_scale(scale);
        run.player.go_to(shown);
        run.player.set_playing(playing);
        run.viewport.release_scale();
        run.viewport.clear_history(&run.player);
    }
}

/// Controls of the settings.
pub fn settings_ui(ui: &mut Ui, settings: &mut FilmSettings, reached: f64) -> bool {
    egui::Grid::new("film").num_columns(2).show(ui, |ui| {
        let ends = [
            ("From", "First instant of the film, on the timeline"),
            ("To", "Last instant, at most what was shown of the run"),
        ];
        for (end, (name, help)) in settings.span.iter_mut().zip(ends) {
            ui.label(name);
            ui.add(field::time(end).range(0.0..=reached).speed(reached * 2e-3))
                .on_hover_text(help)
                .accessible_name(name);
            ui.end_row();
        }
        ui.label("Time scale");
        let mut scales: Vec<f64> = transport::SCALES.to_vec();
        // The window's own may be another one.
        if !scales.contains(&settings.scale) {
            scales.push(settings.scale);
            scales.sort_by(|a, b| b.total_cmp(a));
        }
        let scales: Vec<(f64, String)> = scales.into_iter().map(|scale| (scale, value::time_scale(scale))).collect();
        let help = "Simulated seconds per second of film";
        choice(ui, "Time scale of the film", help, &mut settings.scale, &scales);
        ui.end_row();
        ui.label("Frames");
        let rates = RATES.map(|rate| (rate, format!("{rate} a second")));
        choice(ui, "Frames of the film", "Per second of film", &mut settings.rate, &rates);
        ui.end_row();
        ui.label("Size");
        let sizes = SIZES.map(|(size, name)| (size, name.to_owned()));
        choice(ui, "Size of the film", "Pixels", &mut settings.size, &sizes);
        ui.end_row();
        ui.label("Shows");
        ui.horizontal(|ui| {
            for (plots, name) in [(false, "View only"), (true, "View and plots")] {
                ui.selectable_value(&mut settings.plots, plots, name).on_hover_text("The plots lie below the view");
            }
        });
        ui.end_row();
        ui.label("File");
        ui.horizontal(|ui| {
            let formats = [
                (FilmFormat::Mp4, "MP4", "H.264: plays everywhere, small, exact times"),
                (FilmFormat::Gif, "GIF", "Plays by itself in slides; 256 colours, at most 50 frames a second"),
            ];
            for (format, name, help) in formats {
                ui.selectable_value(&mut settings.format, format, name).on_hover_text(help);
            }
        });
        ui.end_row();
    });
    let frames = settings.frames();
    let summary = match settings.objection() {
        Some(objection) => RichText::new(objection).color(ui.visuals().error_fg_color),
        None => {
            let length = frames / settings.rate;
            let plural = if frames == 1.0 { "" } else { "s" };
            RichText::new(format!("{frames} frame{plural}, {length:.1} s of film")).weak()
        }
    };
    ui.label(summary);
    false
}

/// A combo box of `options` for `value`.
fn choice<T: Copy + PartialEq>(ui: &mut Ui, name: &str, help: &str, value: &mut T, options: &[(T, String)]) {
    let label = |value: T| {
        let chosen = options.iter().find(|(option, _)| *option == value);
        chosen.map_or("", |(_, text)| text.as_str())
    };
    layout::choice(ui, [name, help], None, value, options.iter().map(|(option, _)| *option), label);
}

impl Tasks {
    /// Settings of the next film of `player`: the run so far, unless chosen otherwise before.
    pub fn film_to_make(&self, player: &Player) -> FilmSettings {
        let reached = player.reached();
        let all = FilmSettings::all(reached, player.pacer.scale());
        let mut settings = self.film_settings.clone().unwrap_or(all);
        settings.span = settings.span.map(|end| end.min(reached));
        if settings.span[0] == settings.span[1] {
            settings.span = [0.0, reached];
        }
        settings
    }

    /// Starts making the film; it is saved when complete.
    ///
    /// # Errors
    /// Why it cannot be made, as a message.
    pub fn start_film(&mut self, run: &mut Run, graphics: &Graphics, settings: FilmSettings) -> Result<(), String> {
        if let Some(objection) = settings.objection() {
            return Err(format!("No film: {objection}"));
        }
        let state = graphics.state.as_ref().ok_or("No film: there is no graphics adapter")?;
        let film = Film::new(settings.format, settings.size, settings.rate);
        let film = film.map_err(|error| format!("No film: {error}"))?;
        let pacer = &run.player.pacer;
        let before = (pacer.shown(), pacer.scale(), run.player.is_playing());
        let canvas = Canvas::beside(state);
        let aspect = run.viewport.scene_area().aspect_ratio();
        // Impacts glow as long as in playback at this scale.
        run.player.pacer.set_scale(settings.scale);
        run.viewport.hold_scale(&run.player, settings.span[1]);
        run.player.go_to(settings.span[0]);
        run.viewport.clear_history(&run.player);
        self.film_settings = Some(settings.clone());
        self.film = Some(RunningFilm { settings, film, canvas, aspect, pending: None, next: 0, before });
        Ok(())
    }
}

impl App {
    /// Draws the next frame or collects a finished one; does not block.
    pub(super) fn advance_film(&mut self, ctx: &egui::Context) {
        let Some(mut running) = self.tasks.film.take() else {
            return;
        };
        ctx.request_repaint();
        let continues = self.advance_frame(ctx, &mut running);
        if continues == Ok(true) {
            self.tasks.film = Some(running);
            return;
        }
        running.return_run(&mut self.run);
        let format = running.settings.format;
        let finish = |_| running.film.finish().map_err(|error| error.to_string());
        match continues.and_then(finish) {
            Ok(bytes) => {
                self.save(vec![SaveFile {
                    name: format!("{}.{format}", self.run.player.running().name),
                    mime: format.mime(),
                    bytes,
                }]);
            }
            Err(reason) => self.messages.fail(format!("The film cannot be made: {reason}")),
        }
    }

    /// One pass over `running`; returns whether frames are missing.
    fn advance_frame(&mut self, ctx: &egui::Context, running: &mut RunningFilm) -> Result<bool, String> {
        if let Some(pending) = &mut running.pending {
            let Some(image) = pending.take() else {
                return Ok(true);
            };
            running.pending = None;
            let image = image.map_err(|error| error.to_string())?;
            let added = running.film.add(&image.rgba);
            added.map_err(|error| error.to_string())?;
        }
        if running.next as f64 >= running.settings.frames() {
            return Ok(false);
        }
        let instant = running.settings.instant(running.next);
        self.run.player.go_to(instant);
        // Collects the peaks since the previous frame.
        self.run.player.advance(0.0);
        self.run.viewport.advance(&self.run.player, (1.0 / running.settings.rate) as f32);
        let contents = if running.settings.plots { Contents::Plots } else { Contents::View };
        let first = running.next == 0;
        let size = running.settings.size;
        let frame = self.draw_frame(ctx, &mut running.canvas, contents, size, running.aspect, first)?;
        running.pending = Some(frame);
        running.next += 1;
        Ok(true)
    }
}
