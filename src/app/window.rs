//! The desktop window.

use eframe::egui;
use eframe::egui_wgpu;

use super::remembered::INITIAL_SIZE;
use super::{App, AppOptions, DesktopHost, Player, Store};
use crate::render;
use crate::scene::SceneError;

/// Why the window failed to open.
#[derive(Debug, thiserror::Error)]
pub enum WindowError {
    /// The scene failed to start.
    #[error(transparent)]
    Start(#[from] SceneError),
    /// No graphics adapter.
    #[error(transparent)]
    NoAdapter(#[from] render::NoAdapter),
    /// No display, or another error of the window system.
    #[error("cannot open a window: {0}")]
    Window(String),
}

/// Opens the window and returns when it is closed. Without `options` it starts from the settings in `store`. Links copied in it
/// are appended to the address `page`.
///
/// # Errors
/// The scene fails to start, or there is no graphics adapter or display.
pub fn run_native(options: Option<AppOptions>, page: String, store: Option<Store>) -> Result<(), WindowError> {
    let remembered = store.as_ref().map(|store| store.remembered().clone()).unwrap_or_default();
    let mut viewport = egui::ViewportBuilder::default()
        .with_title("Jointplay")
        .with_app_id("jointplay")
        .with_inner_size(remembered.size.unwrap_or(INITIAL_SIZE))
        .with_maximized(remembered.maximized)
        .with_min_inner_size([360.0, 480.0]);
    if let Some(position) = remembered.position {
        viewport = viewport.with_position(position);
    }
    let native = eframe::NativeOptions { viewport, ..Default::default() };
    let start_options = || store.as_ref().map_or_else(AppOptions::first, Store::start_options);
    let mut options = options.unwrap_or_else(start_options);
    options.embedded = None;
    // Keeps a scene error typed instead of wrapping it in a window error.
    Player::new(&options.scene).map_err(|error| options.scene.locate(&error))?;
    let create: eframe::AppCreator<'_> = Box::new(|cc| {
        let mut app = App::new(cc, options)?;
        app.set_host(Box::new(DesktopHost::new(page).with_dialogs()));
        app.follow_frame_rate();
        move_onto_screen(cc);
        if let Some(store) = store {
            app.store_settings_in(&cc.egui_ctx, store);
        }
        Ok(Box::new(app))
    });
    eframe::run_native("Jointplay", native, create).map_err(|error| match error {
        eframe::Error::Wgpu(egui_wgpu::WgpuError::RequestAdapterError(_)) => render::NoAdapter.into(),
        other => WindowError::Window(other.to_string()),
    })
}

/// Moves a window that lies off all screens, e.g. after one was unplugged, to the first remaining screen.
fn move_onto_screen(cc: &eframe::CreationContext<'_>) {
    let Some(window) = cc.winit_window() else {
        return;
    };
    // Some platforms do not report the window position.
    let Ok(place) = window.outer_position() else {
        return;
    };
    let middle = place.x + window.outer_size().width as i32 / 2;
    let mut screens = window.available_monitors().peekable();
    let first = screens.peek().map(|screen| screen.position());
    let inside = |start: i32, length: u32, at: i32| at >= start && at < start + length as i32;
    let is_visible = screens.any(|screen| {
        let (corner, size) = (screen.position(), screen.size());
        inside(corner.x, size.width, middle) && inside(corner.y, size.height, place.y.max(corner.y))
    });
    if let Some(corner) = first.filter(|_| !is_visible) {
        window.set_outer_position(corner);
    }
}
