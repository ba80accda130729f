//! Thumbnails for the list of scenes: each is drawn once, at the start of its scene, when it first becomes visible.

use eframe::egui::{Atom, Color32, Pos2, Rect, TextureId, Ui, Vec2, pos2, vec2};
use eframe::egui_wgpu::RenderState;

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
    /// Thumbnail of the scene `name`, loaded by `load`, as a part of a button. Its size is the same before and after drawing.
    pub fn atom(
        &mut self,
        ui: &Ui,
        graphics: Option<&RenderState>,
        name: &str,
        load: impl FnOnce() -> Option<Scene>,
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
        load: impl FnOnce() -> Option<Scene>,
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
        let texture = load().and_then(|scene| render::draw_still(state, &list(&scene, theme, size, scale)?));
        self.drawn.push(Drawn { name: name.to_owned(), theme, size, texture });
        texture
    }
}

/// Draw list of `scene` at its start, without forces, axes and names.
fn list(scene: &Scene, theme: Theme, size: [u32; 2], pixels_per_point: f32) -> Option<DrawList> {
    let mut frame = Frame::default();
    Simulation::new(&scene.machine).ok()?.sample(0.0, &mut frame);
    let bare = ArrowOptions { normal: false, friction: false, peaks: false, ..ArrowOptions::default() };
    let options = ViewOptions {
        theme,
        magnification: 20.0,
        arrows: bare,
        triad: false,
        joint_names: false,
        ..ViewOptions::default()
    };
    let view = SceneView::new(scene, &frame);
    let mut camera = view.camera();
    view.fit(&mut camera, scene, &frame, &options, size);
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
