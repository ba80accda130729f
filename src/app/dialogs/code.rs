//! The link to the present state, its page address, and a QR code of it for phones in the room.

use eframe::egui::{
    self, Color32, Label, Mesh, Rect, Role, Sense, Shape, TextEdit, Ui, UiBuilder, Vec2, WidgetInfo, vec2,
};
use qrcodegen::{QrCode, QrCodeEcc, QrSegment, Version};

use crate::session::link::{NOT_A_PAGE_ADDRESS, is_page_address};

/// Quiet zone around a code, modules.
const QUIET_ZONE: i32 = 4;
/// Largest version, 117 modules a side; cameras cannot resolve larger codes on a screen.
const MAX_VERSION: u8 = 25;
/// Largest number of characters in a code of that version.
const MAX_CHARACTERS: usize = 1273;

/// Width from which what is said of a link has one line, points.
const MIN_WIDTH_OF_ONE_LINE: f32 = 560.0;
/// Space below a code for the frame of the dialog, points.
const BOTTOM_MARGIN: f32 = 28.0;

/// A QR code.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Code {
    /// Modules per side.
    size: i32,
    /// Column and row of each dark module.
    dark: Vec<[i32; 2]>,
}

/// Whether other devices can reach the page at `address`, i.e. it is not a local address.
fn is_publicly_reachable(address: &str) -> bool {
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

/// Encodes `link` as a QR code.
///
/// # Errors
/// The link is too long, as a message.
fn encode(link: &str) -> Result<Code, String> {
    let segments = [QrSegment::make_bytes(link.as_bytes())];
    let (low, any, largest) = (QrCodeEcc::Low, Version::MIN, Version::new(MAX_VERSION));
    let code = QrCode::encode_segments_advanced(&segments, low, any, largest, None, true);
    let code = code.map_err(|_| {
        format!(
            "The link has {} characters, and {MAX_CHARACTERS} fit into a QR code that a camera reads from a screen. Copy the link \
             instead, or press R: without the changes made on the way it is shorter",
            link.len()
        )
    })?;
    let size = code.size();
    let all = (0..size).flat_map(|y| (0..size).map(move |x| [x, y]));
    let dark = all.filter(|&[x, y]| code.get_module(x, y)).collect();
    Ok(Code { size, dark })
}

/// A link to share.
#[derive(Clone, Debug, PartialEq)]
pub struct SharedLink {
    /// Fragment of the link, without the `#`.
    fragment: String,
    /// Address of the page; "" for none.
    page: String,
    /// Whether the user may edit the address.
    typed: bool,
    /// QR code of the link, or why there is none.
    code: Result<Code, String>,
}

impl SharedLink {
    /// The link with `fragment` behind the address `page`, "" for none; the user is asked for an address if other devices cannot
    /// reach the page.
    pub fn new(fragment: String, page: String) -> Self {
        let typed = !is_publicly_reachable(&page);
        let mut shared = Self { fragment, page, typed, code: Err(String::new()) };
        shared.encode();
        shared
    }

    /// The whole link.
    pub fn link(&self) -> String {
        format!("{}#{}", self.page(), self.fragment)
    }

    /// Address of the page; "" for none.
    pub fn page(&self) -> &str {
        self.page.trim()
    }

    /// Whether the user can edit the address.
    pub fn is_editable(&self) -> bool {
        self.typed
    }

    /// Whether the address is valid or empty.
    pub fn can_be_copied(&self) -> bool {
        !self.typed || self.page().is_empty() || is_page_address(self.page())
    }

    fn encode(&mut self) {
        let page = self.page();
        self.code = match page {
            "" => Err("No QR code without an address: a phone could not open it".to_owned()),
            _ if !self.can_be_copied() => Err(format!("{page}: {NOT_A_PAGE_ADDRESS}")),
            _ if !is_publicly_reachable(page) => Err(format!("No QR code: other devices cannot reach {page}")),
            _ => encode(&self.link()),
        };
    }
}

/// Address, and what the link is good for; returns whether Enter was pressed.
pub(super) fn ui(ui: &mut Ui, shared: &mut SharedLink, new: bool) -> bool {
    let mut entered = false;
    if shared.typed {
        ui.label(
            "Address of a page with the laboratory. Without one the link begins with #: Jointplay opens it where it is pasted into \
             its window or given to --link, a browser behind such an address.",
        );
        let field = TextEdit::singleline(&mut shared.page).desired_width(f32::INFINITY);
        let field = ui.add(field.hint_text("https://example.org/lab/")).accessible_name("Address of the page");
        if new {
            field.request_focus();
        }
        entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        if field.changed() {
            shared.encode();
        }
    }
    // The same lines for every address, so that the buttons below stay in place.
    let words = match (&shared.code, shared.page()) {
        (Err(reason), _) => reason.clone(),
        (Ok(_), page) => format!("{page} in this state and view"),
    };
    let lines = 1.0 + f32::from(u8::from(ui.available_width() < MIN_WIDTH_OF_ONE_LINE));
    let height = lines * ui.text_style_height(&egui::TextStyle::Body) + 4.0;
    let (place, _) = ui.allocate_exact_size(vec2(ui.available_width(), height), Sense::hover());
    ui.new_child(UiBuilder::new().max_rect(place)).add(Label::new(words).wrap());
    entered
}

/// The QR code below the buttons, if the link has one.
pub(super) fn picture(ui: &mut Ui, shared: &SharedLink) {
    if let Ok(code) = &shared.code {
        let below = ui.ctx().content_rect().bottom() - ui.cursor().top() - BOTTOM_MARGIN;
        draw(ui, code, below.min(ui.available_width()).max(1.0));
    }
}

/// Draws dark on light in every theme, with whole pixels per module, at most `side` points large.
fn draw(ui: &mut Ui, code: &Code, side: f32) {
    let pixels = ui.pixels_per_point();
    let across = code.size + 2 * QUIET_ZONE;
    let module = (side * pixels / across as f32).floor().max(1.0) / pixels;
    let (room, _) = ui.allocate_exact_size(Vec2::splat(side), Sense::hover());
    let whole = Vec2::splat(across as f32 * module);
    let place = Rect::from_center_size(room.center(), whole);
    let response = ui.interact(place, ui.scope_id().with("code"), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "QR code of the link"));
    let corner = (place.min * pixels).round() / pixels;
    let mut mesh = Mesh::default();
    mesh.add_colored_rect(Rect::from_min_size(corner, whole), Color32::WHITE);
    for [x, y] in &code.dark {
        let at = corner + vec2((x + QUIET_ZONE) as f32, (y + QUIET_ZONE) as f32) * module;
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
            assert!(is_publicly_reachable(address), "{address}");
        }
        for address in [
            "",
            "null/page/",
            "file:///home/page/index.html",
            "http://localhost:8420/",
            "http://127.0.0.1:8420/page/",
            "http://[::1]:8420/",
        ] {
            assert!(!is_publicly_reachable(address), "{address}");
        }
    }

    #[test]
    fn a_link_fits_up_to_the_length_that_the_message_names() {
        let link = |length: usize| format!("https://example.org/#{}", "x".repeat(length - 21));
        assert_eq!(encode(&link(MAX_CHARACTERS)).expect("fits").size, 117);
        let error = encode(&link(MAX_CHARACTERS + 1)).expect_err("too long");
        assert!(error.contains("1274 characters, and 1273 fit"), "{error}");
        assert!(encode(&link(200)).expect("fits").size < 60);
    }
}
