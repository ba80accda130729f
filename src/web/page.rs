//! The application on a canvas, and what the page and its tests ask of it.

use eframe::egui;
use eframe::egui_wgpu::{WgpuConfiguration, WgpuSetupCreateNew};
use eframe::web_sys::HtmlCanvasElement;
use serde_json::json;
use wasm_bindgen::prelude::*;

use super::crash;
use super::mirror::Mirror;
use super::query::Query;
use crate::app::App;
use crate::render::wgpu::Backends;

/// The laboratory on a page.
#[wasm_bindgen]
pub struct Page {
    runner: eframe::WebRunner,
}

/// The application with what only a page needs.
struct PageApp {
    app: App,
    ctx: egui::Context,
    renderer: String,
    frames: u32,
    /// Scene and changes that a crash report would name.
    noted: (String, Vec<(String, String)>),
}

#[wasm_bindgen]
impl Page {
    /// Prepares the page: from here on a panic is shown on it.
    #[wasm_bindgen(constructor)]
    #[allow(clippy::new_without_default, reason = "JavaScript knows no Default")]
    pub fn new() -> Self {
        crash::explain_panics();
        // A second start on the same page finds the logger installed.
        let _ = eframe::WebLogger::init(log::LevelFilter::Warn);
        Self {
            runner: eframe::WebRunner::new(),
        }
    }

    /// Starts on `canvas` with `backend` (`webgpu` or `webgl`). `query`: keys and values of the address, in turn. What
    /// is wrong in it is shown beside the default scene.
    ///
    /// # Errors
    /// Text: the backend does not work here.
    pub async fn start(
        &self,
        canvas: HtmlCanvasElement,
        backend: String,
        query: Vec<String>,
    ) -> Result<(), JsValue> {
        let mut setup = WgpuSetupCreateNew::without_display_handle();
        setup.instance_descriptor.backends = if backend == "webgl" {
            Backends::GL
        } else {
            Backends::BROWSER_WEBGPU
        };
        let options = eframe::WebOptions {
            wgpu_options: WgpuConfiguration {
                wgpu_setup: setup.into(),
                ..Default::default()
            },
            ..Default::default()
        };
        let create: eframe::AppCreator<'static> =
            Box::new(move |cc| Ok(Box::new(PageApp::new(cc, &query)?)));
        self.runner.start(canvas, options, create).await
    }

    /// Frames drawn so far.
    pub fn frames(&self) -> u32 {
        self.with(|page| page.frames).unwrap_or(0)
    }

    /// What the laboratory is doing, as JSON: version, scene, changed parameters, time, state hash, renderer.
    pub fn state(&self) -> Option<String> {
        self.with(|page| page.state())
    }

    /// The controls on show, as JSON (`src/web/mirror.rs`). Empty the first time: the mirror starts with the next frame.
    pub fn widgets(&self) -> Option<String> {
        self.with(|page| {
            let mirror = page.ctx.plugin_or_default::<Mirror>();
            let widgets = mirror.lock().widgets.clone();
            if widgets.is_empty() {
                page.ctx.request_repaint();
            }
            widgets
        })
    }

    /// Pauses and runs on until simulated `time`, s.
    #[wasm_bindgen(js_name = runTo)]
    pub fn run_to(&self, time: f64) {
        self.with(|page| {
            page.app.player_mut().run_to(time);
            page.ctx.request_repaint();
        });
    }

    /// Panics in the next frame, so that a test sees what a crash leaves on the page.
    pub fn crash(&self) {
        self.with(|page| {
            page.ctx.add_plugin(Crash);
            page.ctx.request_repaint();
        });
    }

    fn with<T>(&self, ask: impl FnOnce(&mut PageApp) -> T) -> Option<T> {
        self.runner
            .app_mut::<PageApp>()
            .map(|mut page| ask(&mut page))
    }
}

impl PageApp {
    fn new(
        cc: &eframe::CreationContext<'_>,
        query: &[String],
    ) -> Result<Self, Box<dyn std::error::Error + Send + Sync>> {
        let pairs = query
            .chunks_exact(2)
            .map(|pair| (pair[0].as_str(), pair[1].as_str()));
        let mut problem = None;
        let options = match Query::read(pairs).and_then(|query| query.options()) {
            Ok(options) => options,
            Err(error) => {
                problem = Some(error.to_string());
                Query::default().options()?
            }
        };
        let mut app = App::new(cc, options)?;
        if let Some(problem) = problem {
            app.report(problem);
        }
        let renderer = cc.wgpu_render_state.as_ref().map_or_else(
            || "none".to_owned(),
            |state| {
                let info = state.adapter.get_info();
                format!("{} ({})", info.backend, info.name)
            },
        );
        let mut page = Self {
            app,
            ctx: cc.egui_ctx.clone(),
            renderer,
            frames: 0,
            noted: Default::default(),
        };
        page.note();
        Ok(page)
    }

    fn note(&mut self) {
        let scene = self.app.player().wanted();
        if self.noted.0 != scene.name || self.noted.1 != scene.changes {
            self.noted = (scene.name.clone(), scene.changes.clone());
            crash::note(scene, &self.renderer);
        }
    }

    fn state(&self) -> String {
        let player = self.app.player();
        let scene = player.scene();
        let changes: serde_json::Map<_, _> = scene
            .changes
            .iter()
            .map(|(key, value)| (key.clone(), json!(value)))
            .collect();
        json!({
            "version": crate::VERSION,
            "scene": scene.name,
            "changed_parameters": changes,
            "playing": player.is_playing(),
            "stopped": player.stopped().map(ToString::to_string),
            "time_s": player.simulation().time(),
            "shown_s": player.pacer.shown(),
            "steps": player.simulation().statistics().steps,
            "peak_normal_N": player.simulation().statistics().peak_normal,
            "state_hash": format!("{:016x}", player.simulation().state_hash()),
            "renderer": self.renderer,
            "frames": self.frames,
        })
        .to_string()
    }
}

impl eframe::App for PageApp {
    fn logic(&mut self, ctx: &egui::Context, frame: &mut eframe::Frame) {
        self.app.logic(ctx, frame);
        self.note();
    }

    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        self.app.ui(ui, frame);
        self.frames = self.frames.wrapping_add(1);
    }

    fn as_any_mut(&mut self) -> Option<&mut dyn std::any::Any> {
        Some(self)
    }
}

/// See [`Page::crash`].
struct Crash;

impl egui::Plugin for Crash {
    fn debug_name(&self) -> &'static str {
        "crash"
    }

    fn on_begin_pass(&mut self, _ui: &mut egui::Ui) {
        panic!("a crash was asked for");
    }
}
