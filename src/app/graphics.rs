//! Graphics of the window.

use eframe::egui::{self, Atom, ThemePreference, Ui};
use eframe::egui_wgpu::RenderState;

use super::lesson::LessonCard;
use super::scene_pictures::{ScenePictures, Still};
use super::theme;
use super::touch::FirstTouch;
use crate::render;
use crate::scene::Scene;

/// The window's graphics device, and what is drawn with it besides the interface.
pub struct Graphics {
    /// For drawing pictures off screen; `None` without a window.
    pub state: Option<RenderState>,
    /// Graphics adapter and backend; "" without a window.
    pub renderer: String,
    /// Whether texts and edges are black and white.
    contrast: bool,
    scene_pictures: ScenePictures,
}

impl Graphics {
    /// None yet; `contrast`: texts and edges in black and white.
    pub fn new(contrast: bool) -> Self {
        Self { state: None, renderer: String::new(), contrast, scene_pictures: ScenePictures::default() }
    }

    /// Continues on the device of `state`.
    pub fn attach(&mut self, ctx: &egui::Context, state: Option<&RenderState>, theme: ThemePreference) {
        theme::apply(ctx, self.contrast);
        ctx.add_plugin(FirstTouch::default());
        ctx.set_theme(theme);
        self.renderer = String::new();
        if let Some(state) = state {
            render::install(state);
            let info = state.adapter.get_info();
            self.renderer = format!("{} {}", info.backend, info.name).trim().to_owned();
        }
        self.state = state.cloned();
        self.scene_pictures = ScenePictures::default();
    }

    /// Picture of a lesson.
    pub fn lesson_picture(&mut self, ui: &Ui, lesson: &LessonCard) -> Atom<'static> {
        let key = format!("lesson {}", lesson.name);
        self.scene_pictures.atom(ui, self.state.as_ref(), &key, || lesson.picture().map(Still::from))
    }

    /// Thumbnail of a built-in scene; blank on another canvas, where textures of the window are invalid.
    pub fn scene_picture(&mut self, ui: &Ui, is_other_canvas: bool, name: &str) -> Atom<'static> {
        let state = self.state.as_ref().filter(|_| !is_other_canvas);
        self.scene_pictures.atom(ui, state, name, || Some(Still::start(Scene::load(name, &[]).ok()?)))
    }
}
