//! Small pictures of scenes, for the list of scenes: drawn once each, at the start of the scene, when they are first seen.

use eframe::egui::{Atom, Color32, Pos2, Rect, TextureId, Ui, Vec2, pos2, vec2};
use eframe::egui_wgpu::RenderState;

use crate::render;
use crate::scene::Scene;
use crate::simulate::{Frame, Simulation};
use crate::view::{ArrowOptions, DrawList, PeakMarks, SceneView, Shot, Theme, ViewOptions};

/// Size of a picture, points.
pub const SIZE: Vec2 = vec2(108.0, 72.0);
/// Distance of the camera over that at which everything fits, with room for arrows.
const CLOSER: f32 = 0.88;
/// Part of a picture that is drawn.
const WHOLE: Rect = Rect { min: Pos2::ZERO, max: pos2(1.0, 1.0) };

/// The pictures that were drawn.
#[derive(Default)]
pub struct ScenePictures {
    drawn: Vec<Drawn>,
    /// The pass in which the latest was drawn: one in each, so that none takes long.
    pass: Option<u64>,
}

/// A picture, and of what it is one.
struct Drawn {
    name: String,
    theme: Theme,
    size: [u32; 2],
    /// `None`: it cannot be drawn.
    texture: Option<TextureId>,
}

impl ScenePictures {
    /// The picture of the scene `name`, which `load` gives, as a part of a button: as large before it is drawn as afterwards.
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
                ui.painter().image(texture, part.rect, WHOLE, Color32::WHITE);
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
        let one = |drawn: &&Drawn| drawn.name == name && drawn.theme == theme;
        if let Some(drawn) = self.drawn.iter().find(|drawn| one(drawn) && drawn.size == size) {
            return drawn.texture;
        }
        let pass = Some(ui.ctx().cumulative_pass_nr());
        if self.pass == pass {
            ui.ctx().request_repaint();
            return None;
        }
        self.pass = pass;
        // Of another size, as on another screen.
        let old = self.drawn.iter().position(|drawn| one(&drawn));
        if let Some(texture) = old.and_then(|old| self.drawn.swap_remove(old).texture) {
            state.renderer.write().free_texture(&texture);
        }
        let texture = load().and_then(|scene| render::draw_still(state, &list(&scene, theme, size, scale)?));
        self.drawn.push(Drawn { name: name.to_owned(), theme, size, texture });
        texture
    }
}

/// What is drawn of `scene`: all of it at its start, without forces, axes and names.
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
    // No room for arrows.
    camera.distance *= CLOSER;
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
