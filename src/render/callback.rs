//! Shows the picture inside an egui interface.

use std::sync::Arc;

use eframe::egui;
use eframe::egui_wgpu;

use super::wgpu;
use crate::view::DrawList;

/// Makes the renderer and keeps it in egui's callback resources. Call once, when the application starts.
pub fn install(_state: &egui_wgpu::RenderState) {
    todo!()
}

/// The 3D viewport as an egui paint callback.
///
/// ```ignore
/// let list = Arc::make_mut(&mut self.list); // egui has dropped last frame's clone: no copy is made
/// view.build(&shot, list);                  // shot.size: the rectangle in physical pixels
/// ui.painter().add(Viewport::shape(rect, self.list.clone()));
/// ```
pub struct Viewport {
    list: Arc<DrawList>,
}

impl Viewport {
    /// Shape for `egui::Painter::add`: draws `list` at `list.size` and shows it in `rect`.
    pub fn shape(rect: egui::Rect, list: Arc<DrawList>) -> egui::Shape {
        egui_wgpu::Callback::new_paint_callback(rect, Self { list }).into()
    }
}

impl egui_wgpu::CallbackTrait for Viewport {
    fn prepare(
        &self,
        _device: &wgpu::Device,
        _queue: &wgpu::Queue,
        _screen: &egui_wgpu::ScreenDescriptor,
        _encoder: &mut wgpu::CommandEncoder,
        _resources: &mut egui_wgpu::CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        let _ = &self.list;
        todo!()
    }

    fn paint(
        &self,
        _info: egui::PaintCallbackInfo,
        _pass: &mut wgpu::RenderPass<'static>,
        _resources: &egui_wgpu::CallbackResources,
    ) {
        todo!()
    }
}
