//! Thumbnails for the lists of scenes and lessons: each is drawn once, when it first becomes visible.

use eframe::egui::{Atom, Color32, Pos2, Rect, TextureId, Ui, Vec2, pos2, vec2};
use eframe::egui_wgpu::RenderState;

use super::lesson::CameraTarget;
use crate::render;
use crate::scene::Scene;
use crate::simulate::{Frame, Simulation};
use crate::view::{ArrowOptions, DrawList, PeakMarks, SceneView, Shot, Theme, ViewOptions};

/// Size of a picture, points.
pub const SIZE: Vec2 = vec2(108.0, 72.0);
/// Camera distance relative to the one that fits the scene with room for arrows.
const CAMERA_DISTANCE: f32 = 0.88;
/// Texture coordinates of the whole picture.
const WHOLE_PICTURE: Rect = Rect { min: Pos2::ZERO, max: pos2(1.0, 1.0) };

/// Cache of drawn thumbnails.
#[derive(Default)]
pub struct ScenePictures {
    drawn: Vec<Drawn>,
    /// The pass of the latest drawing: one thumbnail per pass keeps passes short.
    pass: Option<u64>,
}

/// A thumbnail and its key.
struct Drawn {
    name: String,
    theme: Theme,
    size: [u32; 2],
    /// `None` if the scene cannot be drawn.
    texture: Option<TextureId>,
}

impl ScenePictures {
    /// Thumbnail `name` of what `load` gives, as a part of a button. Its size is the same before and after drawing.
    pub fn atom(
        &mut self,
        ui: &Ui,
        graphics: Option<&RenderState>,
        name: &str,
        load: impl FnOnce() -> Option<Still>,
    ) -> Atom<'static> {
        let texture = graphics.and_then(|state| self.texture(ui, state, name, load));
        let empty = ui.visuals().faint_bg_color;
        Atom::paint(SIZE, move |ui, part| match texture {
            Some(texture) => {
                ui.painter().image(texture, part.rect, WHOLE_PICTURE, Color32::WHITE);
            }
            None => {
                ui.painter().rect_filled(part.rect, 0.0, empty);
            }
        })
    }

    fn texture(
        &mut self,
        ui: &Ui,
        state: &RenderState,
        name: &str,
        load: impl FnOnce() -> Option<Still>,
    ) -> Option<TextureId> {
        let theme = if ui.visuals().dark_mode { Theme::Dark } else { Theme::Light };
        let scale = ui.pixels_per_point();
        let size = [SIZE.x, SIZE.y].map(|edge| (edge * scale).round() as u32);
        let has_key = |drawn: &&Drawn| drawn.name == name && drawn.theme == theme;
        if let Some(drawn) = self.drawn.iter().find(|drawn| has_key(drawn) && drawn.size == size) {
            return drawn.texture;
        }
        let pass = Some(ui.ctx().cumulative_pass_nr());
        if self.pass == pass {
            ui.ctx().request_repaint();
            return None;
        }
        self.pass = pass;
        // The pixel size changed, e.g. on another screen.
        let old = self.drawn.iter().position(|drawn| has_key(&drawn));
        if let Some(texture) = old.and_then(|old| self.drawn.swap_remove(old).texture) {
            state.renderer.write().free_texture(&texture);
        }
        let texture = load().and_then(|still| render::draw_still(state, &still.list(theme, size, scale)?));
        self.drawn.push(Drawn { name: name.to_owned(), theme, size, texture });
        texture
    }
}

/// What a thumbnail shows.
pub struct Still {
    scene: Scene,
    /// The instant, s.
    time: f64,
    target: Option<CameraTarget>,
}

impl From<(Scene, f64, Option<CameraTarget>)> for Still {
    fn from((scene, time, target): (Scene, f64, Option<CameraTarget>)) -> Self {
        Self { scene, time, target }
    }
}

impl Still {
    /// `scene` at its start.
    pub fn start(scene: Scene) -> Self {
        Self { scene, time: 0.0, target: None }
    }

    /// Its draw list, without axes and names, and with forces only from close up.
    fn list(&self, theme: Theme, size: [u32; 2], pixels_per_point: f32) -> Option<DrawList> {
        let scene = &self.scene;
        let mut frame = Frame::default();
        let mut simulation = Simulation::new(&scene.machine).ok()?;
        simulation.advance_to(self.time).ok()?;
        simulation.sample(self.time, &mut frame);
        let is_close = matches!(self.target, Some(CameraTarget::At(_)));
        let arrows = ArrowOptions { normal: is_close, friction: is_close, peaks: false, ..ArrowOptions::default() };
        let options = ViewOptions {
            theme,
            magnification: 20.0,
            arrows,
            triad: false,
            joint_names: false,
            ..ViewOptions::default()
        };
        let view = SceneView::new(scene, &frame);
        let mut camera = view.camera();
        if let Some(CameraTarget::At(joint)) = self.target {
            view.close_up(&mut camera, joint, scene, &frame, &options);
        } else {
            if let Some(CameraTarget::From(preset)) = self.target {
                camera.preset(preset);
            }
            view.fit(&mut camera, scene, &frame, &options, size);
        }
        // Arrows are not drawn and need no room.
        camera.distance *= CAMERA_DISTANCE;
        let marks = PeakMarks::new();
        let shot = Shot {
            scene,
            frame: &frame,
            marks: &marks,
            options: &options,
            camera: &camera,
            trail: &[],
            size,
            pixels_per_point,
        };
        let mut list = DrawList::default();
        view.build(&shot, &mut list);
        Some(list)
    }
}
