//! The application on a canvas, with the interface for the page and its tests.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;

use eframe::egui::{self, accesskit::ActionData};
use eframe::egui_wgpu::{RenderState, WgpuConfiguration, WgpuSetupCreateNew};
use eframe::web_sys::js_sys::Array;
use eframe::web_sys::{File, HtmlCanvasElement};
use serde_json::json;
use wasm_bindgen::prelude::*;

use super::crash;
use super::host::{Inbox, WebHost, are_graphics_lost, graphics_lost, schedule_steps, was_here};
use super::mirror::Mirror;
use crate::app::{App, AppOptions};
use crate::render::wgpu::Backends;
use crate::session::pace::LONGEST_STEPPING;

/// Interval between snapshots of the session, s; a crash report and the reload after it use the latest.
const SNAPSHOT_INTERVAL: f64 = 2.0;

/// The laboratory on a page.
#[wasm_bindgen]
pub struct Page {
    runner: eframe::WebRunner,
    /// Outlives the canvas, so that lost graphics lose nothing else.
    laboratory: Rc<RefCell<Option<Laboratory>>>,
    inbox: Rc<Inbox>,
}

/// The application with its page-specific state.
struct Laboratory {
    app: App,
    ctx: egui::Context,
    renderer: String,
    frames: u32,
    /// Time of the latest snapshot on egui's clock, s.
    snapshot_time: Option<f64>,
    /// Start of the latest frame on the player's clock, s.
    frame_start: f64,
}

/// The eframe application that draws the laboratory on one canvas.
struct CanvasApp(Rc<RefCell<Option<Laboratory>>>);

#[wasm_bindgen]
impl Page {
    /// Prepares the page, which shows panics from then on.
    #[wasm_bindgen(constructor)]
    #[allow(clippy::new_without_default, reason = "JavaScript knows no Default")]
    pub fn new() -> Self {
        crash::install_hook();
        // Fails if another page of the same module has installed the logger.
        let _ = eframe::WebLogger::init(log::LevelFilter::Warn);
        Self { runner: eframe::WebRunner::new(), laboratory: Rc::default(), inbox: Rc::default() }
    }

    /// Draws on `canvas` with `backend` (`webgpu` or `webgl`); `start` numbers the calls. The first call opens `link`: the
    /// address from its `?` on, or a result of [`Self::session`]; errors in it are shown beside the default scene. `preferences`
    /// are those of the user's system: `calm` for reduced motion, `contrast` for high contrast, or both.
    ///
    /// # Errors
    /// Text: the backend does not work here. A running laboratory survives for the next attempt.
    pub async fn start(
        &self,
        canvas: HtmlCanvasElement,
        backend: String,
        start: u32,
        link: String,
        preferences: String,
    ) -> Result<(), JsValue> {
        let mut setup = WgpuSetupCreateNew::without_display_handle();
        setup.instance_descriptor.backends = if backend == "webgl" { Backends::GL } else { Backends::BROWSER_WEBGPU };
        let options = eframe::WebOptions {
            wgpu_options: WgpuConfiguration { wgpu_setup: setup.into(), ..Default::default() },
            ..Default::default()
        };
        let (laboratory, inbox) = (self.laboratory.clone(), self.inbox.clone());
        let create: eframe::AppCreator<'static> = Box::new(move |cc| {
            if let Some(state) = &cc.wgpu_render_state {
                watch(state, &backend, start);
            }
            inbox.attach(&cc.egui_ctx);
            let mut slot = laboratory.borrow_mut();
            match &mut *slot {
                Some(laboratory) => laboratory.attach(cc),
                None => *slot = Some(Laboratory::new(cc, &link, &preferences, inbox)?),
            }
            drop(slot);
            Ok(Box::new(CanvasApp(laboratory)))
        });
        self.runner.start(canvas, options, create).await
    }

    /// Releases the canvas; the laboratory waits for the next [`Self::start`].
    pub fn suspend(&self) {
        self.runner.destroy();
    }

    /// Frames drawn so far.
    pub fn frames(&self) -> u32 {
        self.with(|laboratory| laboratory.frames).unwrap_or(0)
    }

    /// State of the laboratory as JSON: version, scene, changed parameters, time, state hash, camera, renderer.
    pub fn state(&self) -> Option<String> {
        self.with(|laboratory| laboratory.state())
    }

    /// The current state as the fragment of a link, for a restart.
    pub fn link(&self) -> Option<String> {
        self.with(|laboratory| laboratory.app.share_state())
    }

    /// As [`Self::link`]; a state that no address can hold becomes `kept:` and a text of any length. [`Self::start`] accepts
    /// both.
    pub fn session(&self) -> Option<String> {
        self.with(|laboratory| laboratory.app.session())
    }

    /// Whether the user's own scene has unsaved changes; `None` if it has not changed since the start.
    pub fn unsaved(&self) -> Option<bool> {
        self.with(|laboratory| laboratory.app.unsaved())?
    }

    /// Opens the address from its `?` on after the user has edited it. Returns the reason for a failure, which is also shown.
    #[wasm_bindgen(js_name = openLink)]
    pub fn open_link(&self, link: &str) -> Option<String> {
        self.with(|laboratory| {
            laboratory.ctx.request_repaint();
            laboratory.app.open_link(&laboratory.ctx, link).err()
        })?
    }

    /// Whether the initial address could not be opened and nothing else has been done since.
    pub fn refused(&self) -> bool {
        self.with(|laboratory| laboratory.app.is_refused()).unwrap_or(false)
    }

    /// Whether the key with the browser's name `key` is a shortcut here, alone or with the command key.
    pub fn uses(&self, key: &str, command: bool, alt: bool) -> bool {
        !alt && self.with(|laboratory| laboratory.app.uses(&laboratory.ctx, key, command)).unwrap_or(false)
    }

    /// Opens an array of browser files that were chosen together.
    #[wasm_bindgen(js_name = openFiles)]
    pub fn open_files(&self, files: &Array) {
        let files = files.iter().filter_map(|file| file.dyn_into::<File>().ok());
        self.inbox.clone().read(files.collect());
    }

    /// Shows a message for a few seconds.
    pub fn notify(&self, text: String) {
        self.with(|laboratory| {
            laboratory.app.notify(text);
            laboratory.ctx.request_repaint();
        });
    }

    /// Starts or ends the presentation.
    pub fn present(&self, on: bool) {
        self.with(|laboratory| {
            laboratory.app.present(&laboratory.ctx, on);
            laboratory.ctx.request_repaint();
        });
    }

    /// Sets the parameter `key` to a value with its unit; returns the reason for a refusal.
    pub fn set(&self, key: &str, value: &str) -> Option<String> {
        self.with(|laboratory| {
            laboratory.ctx.request_repaint();
            let set = laboratory.app.player_mut().set(key, value);
            set.err().map(|error| error.to_string())
        })?
    }

    /// Plays, or pauses.
    pub fn play(&self, on: bool) {
        self.with(|laboratory| {
            laboratory.app.player_mut().set_playing(on);
            laboratory.ctx.request_repaint();
        });
    }

    /// Resets to t = 0.
    pub fn reset(&self) {
        self.with(|laboratory| {
            laboratory.app.reset();
            laboratory.ctx.request_repaint();
        });
    }

    /// The displayed impacts that ended after `time`, s, as JSON.
    pub fn impacts(&self, time: f64) -> Option<String> {
        self.with(|laboratory| laboratory.impacts(time))
    }

    /// Clears the focus in the laboratory once the keyboard focus has left it.
    pub fn release(&self) {
        self.with(|laboratory| {
            laboratory.ctx.memory_mut(|memory| {
                if let Some(focused) = memory.focused() {
                    memory.surrender_focus(focused);
                }
            });
        });
    }

    /// The visible controls as JSON ([`Mirror::widgets`]). The first call returns an empty string and enables the mirror from
    /// the next frame on.
    pub fn widgets(&self) -> Option<String> {
        self.with(|laboratory| {
            let ctx = &laboratory.ctx;
            let widgets = ctx.plugin_or_default::<Mirror>().lock().widgets(ctx.zoom_factor());
            if widgets.is_empty() {
                ctx.request_repaint();
            }
            widgets
        })
    }

    /// Passes a request of assistive software to the control `id` ([`Mirror::request`]); `value` is a number or a text.
    pub fn request(&self, id: &str, action: &str, value: &JsValue) {
        let number = value.as_f64().map(ActionData::NumericValue);
        let text = || Some(ActionData::Value(value.as_string()?.into()));
        let data = number.or_else(text);
        self.with(|laboratory| {
            let ctx = &laboratory.ctx;
            let mirror = ctx.plugin_or_default::<Mirror>();
            if let Ok(id) = id.parse() {
                mirror.lock().request(id, action, data);
                ctx.request_repaint();
            }
        });
    }

    /// Pauses playback and runs to the simulated `time`, s.
    #[wasm_bindgen(js_name = runTo)]
    pub fn run_to(&self, time: f64) {
        self.with(|laboratory| {
            laboratory.app.run_to(time);
            laboratory.ctx.request_repaint();
        });
    }

    /// Steps between two frames. Returns the delay before the next call, ms, or `None` to wait for the next frame.
    #[wasm_bindgen(js_name = stepBetween)]
    pub fn step_between(&self) -> Option<f64> {
        let behind = self.with(|laboratory| {
            let since = (laboratory.app.player().clock)() - laboratory.frame_start;
            laboratory.app.step_between(since)
        })??;
        Some(if behind { 0.0 } else { 1000.0 * LONGEST_STEPPING })
    }

    fn with<T>(&self, action: impl FnOnce(&mut Laboratory) -> T) -> Option<T> {
        // It stays borrowed after a panic.
        self.laboratory.try_borrow_mut().ok()?.as_mut().map(action)
    }
}

/// Notifies the page when the graphics of start number `start` are lost.
fn watch(state: &RenderState, backend: &str, start: u32) {
    if backend == "webgl" {
        // The canvas fires an event for this, but calls may fail before it.
        state.device.on_uncaptured_error(Arc::new(|error| {
            if are_graphics_lost() {
                log::warn!("drawing without graphics: {error}");
            } else {
                panic!("{error}");
            }
        }));
    } else {
        let callback = move |_, why: String| graphics_lost(start, &why);
        state.device.set_device_lost_callback(callback);
    }
}

/// Backend and adapter, for crash reports and tests.
fn renderer_name(cc: &eframe::CreationContext<'_>) -> String {
    cc.wgpu_render_state.as_ref().map_or_else(
        || "none".to_owned(),
        |state| {
            let info = state.adapter.get_info();
            // A browser may withhold the name of the adapter.
            match info.name.as_str() {
                "" => info.backend.to_string(),
                name => format!("{} ({name})", info.backend),
            }
        },
    )
}

impl Laboratory {
    fn new(
        cc: &eframe::CreationContext<'_>,
        link: &str,
        preferences: &str,
        inbox: Rc<Inbox>,
    ) -> Result<Self, Box<dyn std::error::Error + Send + Sync>> {
        let options = AppOptions {
            calm: preferences.contains("calm"),
            contrast: preferences.contains("contrast"),
            ..AppOptions::from_link_or_default(link)
        };
        let options = AppOptions { visit: options.visit && !was_here(), ..options };
        let mut app = App::new(cc, options)?;
        app.set_host(Box::new(WebHost { inbox, no_sound: None }));
        app.follow_frame_rate();
        Ok(Self {
            app,
            ctx: cc.egui_ctx.clone(),
            renderer: renderer_name(cc),
            frames: 0,
            snapshot_time: None,
            frame_start: 0.0,
        })
    }

    /// Attaches new graphics.
    fn attach(&mut self, cc: &eframe::CreationContext<'_>) {
        let theme = self.ctx.options(|options| options.theme_preference);
        self.app.attach(&cc.egui_ctx, cc.wgpu_render_state.as_ref(), theme);
        self.ctx = cc.egui_ctx.clone();
        self.renderer = renderer_name(cc);
        self.snapshot_time = None;
    }

    /// Updates the snapshot for crash reports.
    fn update_snapshot(&mut self) {
        let now = self.ctx.input(|input| input.time);
        if self.snapshot_time.is_none_or(|snapshot_time| now - snapshot_time > SNAPSHOT_INTERVAL) {
            self.snapshot_time = Some(now);
            let scene = self.app.player().pending();
            crash::record_session(scene, &self.renderer, self.app.session());
        }
    }

    fn impacts(&self, time: f64) -> String {
        let player = self.app.player();
        let joints = &player.running().machine.loose_joints;
        let shown = player.pacer.shown();
        let ended = player.simulation().impacts();
        let ended = ended.filter(|impact| impact.end > time && impact.end <= shown);
        let impacts = ended.map(|impact| {
            json!({
                "joint": joints[impact.joint].name,
                "site": joints[impact.joint].site_name(impact.place),
                "start_s": impact.start,
                "end_s": impact.end,
                "approach_m_s": impact.approach_speed,
                "separation_m_s": impact.separation_speed,
                "peak_N": impact.peak,
                "deepest_m": impact.deepest,
            })
        });
        serde_json::Value::Array(impacts.collect()).to_string()
    }

    fn state(&self) -> String {
        let player = self.app.player();
        let scene = player.running();
        let changes: serde_json::Map<_, _> =
            scene.changes.iter().map(|(key, value)| (key.clone(), json!(value))).collect();
        // An untouched camera fits the whole scene and is not reported.
        let camera = self.app.link().camera.filter(|camera| camera.fitted.is_none());
        let camera = camera.map(|camera| {
            json!({
                "yaw_rad": camera.yaw,
                "pitch_rad": camera.pitch,
                "distance_m": camera.distance,
                "target_m": camera.target,
            })
        });
        json!({
            "version": crate::VERSION,
            "scene": scene.name,
            "changed_parameters": changes,
            "playing": player.is_playing(),
            "replaying": self.app.replaying(),
            "stopped": player.stopped().map(ToString::to_string),
            "time_s": player.simulation().time(),
            "shown_s": player.pacer.shown(),
            "steps": player.simulation().statistics().steps,
            "pull_N": player.frame().pull.map(|pull| pull.force.norm()),
            "peak_normal_N": player.simulation().statistics().joints.iter().map(|joint| joint.peak_normal).collect::<Vec<_>>(),
            "state_hash": format!("{:016x}", player.simulation().state_hash()),
            "camera": camera,
            "renderer": self.renderer,
            "frames": self.frames,
        })
        .to_string()
    }
}

impl eframe::App for CanvasApp {
    fn logic(&mut self, ctx: &egui::Context, frame: &mut eframe::Frame) {
        if let Some(laboratory) = &mut *self.0.borrow_mut() {
            laboratory.frame_start = (laboratory.app.player().clock)();
            laboratory.app.logic(ctx, frame);
            laboratory.update_snapshot();
            schedule_steps();
        }
    }

    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        if let Some(laboratory) = &mut *self.0.borrow_mut() {
            laboratory.app.ui(ui, frame);
            laboratory.frames = laboratory.frames.wrapping_add(1);
        }
    }

    // Background of the panels, which are not filled themselves (`theme::panel`).
    fn clear_color(&self, visuals: &egui::Visuals) -> [f32; 4] {
        visuals.panel_fill.to_normalized_gamma_f32()
    }
}
