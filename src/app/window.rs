//! The desktop window.

use eframe::egui;
use eframe::egui_wgpu;

use super::{App, AppOptions, DesktopHost, Player};
use crate::render;
use crate::scene::SceneError;

/// Why the window could not open.
#[derive(Debug, thiserror::Error)]
pub enum WindowError {
    /// The scene cannot start.
    #[error(transparent)]
    Start(#[from] SceneError),
    /// No graphics adapter.
    #[error(transparent)]
    NoAdapter(#[from] render::NoAdapter),
    /// No display, or anything else that the window system said.
    #[error("cannot open a window: {0}")]
    Window(String),
}

/// Opens the window and returns when it is closed. Links copied in it are appended to the address `page`.
///
/// # Errors
/// A scene that cannot start, no graphics adapter, no display.
pub fn run_native(mut options: AppOptions, page: String) -> Result<(), WindowError> {
    let native = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title("Jointplay")
            .with_app_id("jointplay")
            .with_inner_size([1280.0, 800.0])
            .with_min_inner_size([360.0, 480.0]),
        ..Default::default()
    };
    options.embedded = None;
    // A scene error must keep its type and not become one of the window.
    Player::new(&options.scene).map_err(|error| error.located(&options.scene))?;
    let create: eframe::AppCreator<'_> = Box::new(|cc| {
        let mut app = App::new(cc, options)?;
        app.set_host(Box::new(DesktopHost::new(page)));
        app.follow_frame_rate();
        Ok(Box::new(app))
    });
    eframe::run_native("Jointplay", native, create).map_err(|error| match error {
        eframe::Error::Wgpu(egui_wgpu::WgpuError::RequestAdapterError(_)) => render::NoAdapter.into(),
        other => WindowError::Window(other.to_string()),
    })
}
