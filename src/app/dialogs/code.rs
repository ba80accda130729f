//! The link to the present state as a QR code, for the cameras of the phones in the room.

use eframe::egui::{self, Color32, Mesh, Rect, Role, Sense, Shape, Ui, Vec2, WidgetInfo, vec2};
use qrcodegen::{QrCode, QrCodeEcc, QrSegment, Version};

use super::Dialog;
use crate::app::App;

/// Light modules around a code, which a reader needs.
const QUIET: i32 = 4;
/// Largest code, 117 modules at a side: of a larger one on a screen a camera does not tell them apart.
const LARGEST: u8 = 25;
/// Characters that fit into it.
const MOST: usize = 1273;

/// A QR code.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Code {
    /// Modules at a side.
    size: i32,
    /// Column and row of each dark one.
    dark: Vec<[i32; 2]>,
}

/// Whether other devices find the page at `address`: not if that is this machine's own.
fn is_found_by_others(address: &str) -> bool {
    let Some((scheme, rest)) = address.split_once("://") else {
        return false;
    };
    let host = rest.split('/').next().unwrap_or("");
    let name = match host.strip_prefix('[') {
        Some(bare) => bare.split(']').next().unwrap_or(""),
        None => host.split(':').next().unwrap_or(""),
    };
    let own = name.is_empty() || name == "localhost" || name.ends_with(".localhost") || name == "::1";
    matches!(scheme, "http" | "https") && !own && !name.starts_with("127.")
}

/// `link` as a code.
///
/// # Errors
/// It is too long, in words.
fn encode(link: &str) -> Result<Code, String> {
    let segments = [QrSegment::make_bytes(link.as_bytes())];
    let (low, any, largest) = (QrCodeEcc::Low, Version::MIN, Version::new(LARGEST));
    let code = QrCode::encode_segments_advanced(&segments, low, any, largest, None, true);
    let code = code.map_err(|_| {
        format!(
            "The link has {} characters, and {MOST} fit into a QR code that a camera reads from a screen. Copy the link \
             instead, or press R: without the changes made on the way it is shorter",
            link.len()
        )
    })?;
    let size = code.size();
    let all = (0..size).flat_map(|y| (0..size).map(move |x| [x, y]));
    let dark = all.filter(|&[x, y]| code.get_module(x, y)).collect();
    Ok(Code { size, dark })
}

impl App {
    /// The entry of the menu, where the page has an address that other devices find.
    pub(in crate::app) fn code_button(&mut self, ui: &mut Ui) {
        if !is_found_by_others(&self.host.address()) {
            return;
        }
        let help = "The link to this scene in this state and view, to be photographed by a phone";
        if ui.button("QR code").on_hover_text(help).clicked() {
            match self.link().format_short(self.player.wanted()) {
                Ok((fragment, note)) => {
                    let link = format!("{}#{fragment}", self.host.address());
                    let code = encode(&link);
                    self.dialog = Some(Dialog::Code { link, code });
                    note.into_iter().for_each(|note| self.say(note));
                }
                Err(reason) => self.problem = Some(reason),
            }
            crate::app::layout::close_menu(ui);
        }
    }
}

/// The code as large as `most` allows, points, and the address that it leads to.
pub(super) fn ui(ui: &mut Ui, link: &str, code: &Result<Code, String>, most: f32) -> bool {
    match code {
        Ok(code) => {
            let address = link.split('#').next().unwrap_or(link);
            let line = ui.text_style_height(&egui::TextStyle::Body) + ui.spacing().item_spacing.y;
            draw(ui, code, (most - line).min(ui.available_width()));
            ui.label(format!("{address} in this state and view"));
        }
        Err(reason) => {
            ui.label(reason);
        }
    }
    false
}

/// Dark on light whatever the theme, each module of whole pixels, at most `side` points large.
fn draw(ui: &mut Ui, code: &Code, side: f32) {
    let pixels = ui.pixels_per_point();
    let across = code.size + 2 * QUIET;
    let module = (side * pixels / across as f32).floor().max(1.0) / pixels;
    let whole = Vec2::splat(across as f32 * module);
    let (place, response) = ui.allocate_exact_size(whole, Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "QR code of the link"));
    let corner = (place.min * pixels).round() / pixels;
    let mut mesh = Mesh::default();
    mesh.add_colored_rect(Rect::from_min_size(corner, whole), Color32::WHITE);
    for [x, y] in &code.dark {
        let at = corner + vec2((x + QUIET) as f32, (y + QUIET) as f32) * module;
        mesh.add_colored_rect(Rect::from_min_size(at, Vec2::splat(module)), Color32::BLACK);
    }
    ui.painter().add(Shape::mesh(mesh));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_of_this_machine_is_not_found_by_others() {
        for address in
            ["http://192.168.0.7:8420/", "https://example.org/lab/", "http://[2001:db8::1]:8420/", "http://room.local/"]
        {
            assert!(is_found_by_others(address), "{address}");
        }
        for address in [
            "",
            "null/page/",
            "file:///home/page/index.html",
            "http://localhost:8420/",
            "http://127.0.0.1:8420/page/",
            "http://[::1]:8420/",
        ] {
            assert!(!is_found_by_others(address), "{address}");
        }
    }

    #[test]
    fn a_link_fits_up_to_the_length_that_the_message_names() {
        let link = |length: usize| format!("https://example.org/#{}", "x".repeat(length - 21));
        assert_eq!(encode(&link(MOST)).expect("fits").size, 117);
        let error = encode(&link(MOST + 1)).expect_err("too long");
        assert!(error.contains("1274 characters, and 1273 fit"), "{error}");
        assert!(encode(&link(200)).expect("fits").size < 60);
    }
}
