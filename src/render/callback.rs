//! Shows the picture inside an egui interface.

use std::sync::Arc;

use eframe::egui;
use eframe::egui_wgpu;

use super::finish::{Finish, PICTURE, picture};
use super::{RenderTarget, Renderer, wgpu};
use crate::view::DrawList;

/// Stored in egui's callback resources.
struct Resources {
    renderer: Renderer,
    finish: Finish,
    /// Last pass for pictures in egui's textures.
    still: Option<Finish>,
    /// One for each [`PictureSlot`].
    shown: [Option<CachedPicture>; 3],
}

/// Where a picture is shown; all slots share one renderer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureSlot {
    /// In the window.
    Window,
    /// Beside the first picture in the window.
    Beside,
    /// In a second window.
    Second,
}

/// A target, and the revision of the picture in it.
struct CachedPicture {
    target: RenderTarget,
    group: wgpu::BindGroup,
    revision: Option<u64>,
}

/// Creates the renderer and stores it in egui's callback resources. Call once, when the application starts.
pub fn install(state: &egui_wgpu::RenderState) {
    let renderer = Renderer::new(&state.device, &state.adapter);
    let finish = renderer.finish(&state.device, state.target_format);
    let resources = Resources { finish, renderer, still: None, shown: [None, None, None] };
    state.renderer.write().callback_resources.insert(resources);
}

/// Draws `list` at `list.size` to a new texture and registers it with egui; `None` without [`install`]. Free it with
/// `egui_wgpu::Renderer::free_texture`.
pub fn draw_still(state: &egui_wgpu::RenderState, list: &DrawList) -> Option<egui::TextureId> {
    let (device, queue) = (&state.device, &state.queue);
    let mut renderer = state.renderer.write();
    let resources: &mut Resources = renderer.callback_resources.get_mut()?;
    let still = picture(device, list.size).create_view(&Default::default());
    let target = resources.renderer.target(device, list.size, list.quality.samples);
    let finish = resources.still.get_or_insert_with(|| resources.renderer.finish(device, PICTURE));
    let mut encoder = device.create_command_encoder(&Default::default());
    resources.renderer.draw(device, queue, &mut encoder, &target, list);
    finish.encode(&mut encoder, &finish.group(device, &target.light), &still);
    queue.submit([encoder.finish()]);
    Some(renderer.register_native_texture(device, &still, wgpu::FilterMode::Linear))
}

/// The 3D viewport as an egui paint callback.
///
/// ```ignore
/// let list = Arc::make_mut(&mut self.list); // egui has dropped last frame's clone: no copy is made
/// view.build(&shot, list);                  // shot.size: the rectangle in physical pixels, or less of them
/// ui.painter().add(Viewport::shape(rect, self.list.clone()));
/// ```
pub struct Viewport {
    list: Arc<DrawList>,
    revision: Option<u64>,
    slot: PictureSlot,
}

impl Viewport {
    /// Shape for `egui::Painter::add`: draws `list` at `list.size` and shows it in `rect`.
    pub fn shape(rect: egui::Rect, list: Arc<DrawList>) -> egui::Shape {
        Self::revised(rect, list, None, PictureSlot::Window)
    }

    /// The same, but a picture with the same `revision` as the previous one in this `slot` is shown again without redrawing.
    pub fn revised(rect: egui::Rect, list: Arc<DrawList>, revision: Option<u64>, slot: PictureSlot) -> egui::Shape {
        egui_wgpu::Callback::new_paint_callback(rect, Self { list, revision, slot }).into()
    }
}

impl Resources {
    /// The renderer, and the target for `list` in `slot`.
    fn target_for(
        &mut self,
        device: &wgpu::Device,
        list: &DrawList,
        slot: PictureSlot,
    ) -> (&mut Renderer, &mut CachedPicture) {
        // A window can briefly be 0 pixels wide, or wider than the largest texture.
        let limit = device.limits().max_texture_dimension_2d;
        let size = list.size.map(|n| n.clamp(1, limit));
        let fits = |shown: &CachedPicture| shown.target.fits(list, size);
        let previous = &mut self.shown[slot as usize];
        let shown = previous.take().filter(fits).unwrap_or_else(|| {
            let target = self.renderer.target(device, size, list.quality.samples);
            CachedPicture { group: self.finish.group(device, &target.light), target, revision: None }
        });
        (&mut self.renderer, previous.insert(shown))
    }
}

impl egui_wgpu::CallbackTrait for Viewport {
    fn prepare(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        _screen: &egui_wgpu::ScreenDescriptor,
        _encoder: &mut wgpu::CommandEncoder,
        resources: &mut egui_wgpu::CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        // Without `install` there is no renderer: the rectangle stays empty.
        let Some(resources) = resources.get_mut::<Resources>() else {
            return Vec::new();
        };
        let (renderer, shown) = resources.target_for(device, &self.list, self.slot);
        let previous = std::mem::replace(&mut shown.revision, self.revision);
        if previous.is_none() || previous != self.revision {
            // The first picture does not wait for other pipelines.
            if previous.is_some() {
                renderer.create_next_pipeline(device, &shown.target);
            }
            // A submission of its own: the pictures of a window share the renderer's buffers.
            let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("picture") });
            renderer.draw(device, queue, &mut encoder, &shown.target, &self.list);
            queue.submit([encoder.finish()]);
        }
        Vec::new()
    }

    fn paint(
        &self,
        _info: egui::PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        resources: &egui_wgpu::CallbackResources,
    ) {
        let Some(resources) = resources.get::<Resources>() else {
            return;
        };
        if let Some(shown) = &resources.shown[self.slot as usize] {
            resources.finish.draw(pass, &shown.group);
        }
    }
}
