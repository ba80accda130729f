//! Appearance of the window: spacing, type sizes and the colours of both themes.

use std::sync::Arc;

use crate::session::link::ThemeChoice;
use eframe::egui::{
    self, Color32, CornerRadius, FontData, FontDefinitions, FontFamily, FontId, Frame, Margin, Response, RichText,
    Stroke, TextStyle, Theme, ThemePreference, Ui, Visuals, vec2,
};

/// Series colours for plots, dark enough on white and light enough on black; distinguishable for the colour-blind (after Okabe
/// & Ito).
const SERIES: [(Color32, Color32); 12] = [
    (rgb(0x0072B2), rgb(0x56B4E9)),
    (rgb(0xD55E00), rgb(0xFF8C3A)),
    (rgb(0x008F68), rgb(0x2CD0A0)),
    (rgb(0xB84E90), rgb(0xE493C4)),
    (rgb(0xA87B00), rgb(0xF0D042)),
    (rgb(0x5B5FC7), rgb(0xA5A8F5)),
    (rgb(0x7A4A1E), rgb(0xC99A6B)),
    (rgb(0x6B6B6B), rgb(0xB5B5B5)),
    (rgb(0x9B1C31), rgb(0xFF8A94)),
    (rgb(0x5A7A00), rgb(0xB9DB4A)),
    (rgb(0x007C8A), rgb(0x7CE6EE)),
    (rgb(0x7B2D8B), rgb(0xD08BE6)),
];

const fn rgb(hex: u32) -> Color32 {
    let [_, red, green, blue] = hex.to_be_bytes();
    Color32::from_rgb(red, green, blue)
}

/// Colour of the `index`th series of a plot.
pub fn series(index: usize, dark: bool) -> Color32 {
    let (on_light, on_dark) = SERIES[index % SERIES.len()];
    if dark { on_dark } else { on_light }
}

/// The same for a text: a little darker on white, for a contrast of 4.5.
pub fn series_text(index: usize, dark: bool) -> Color32 {
    let colour = series(index, dark);
    if dark { colour } else { colour.lerp_to_gamma(Color32::BLACK, 0.13) }
}

/// The egui preference for a theme choice.
pub fn preference(choice: ThemeChoice) -> ThemePreference {
    match choice {
        ThemeChoice::Light => ThemePreference::Light,
        ThemeChoice::Dark => ThemePreference::Dark,
        ThemeChoice::System => ThemePreference::System,
    }
}

/// The frame of a panel. On the web the canvas is already cleared to its colour, so the panel is not filled; with software
/// rendering that halves the cost of the interface.
pub fn panel(ui: &Ui) -> Frame {
    let frame = Frame::side_top_panel(ui.style());
    if cfg!(target_arch = "wasm32") { frame.fill(Color32::TRANSPARENT) } else { frame }
}

/// Least side of a touch target, points.
pub const FINGER: f32 = 44.0;
/// Side of a touch target in dense rows, points; WCAG 2.2 requires 24 (2.5.8).
const DENSE_FINGER: f32 = 30.0;

/// Sizes the controls for a mouse or for touch.
pub fn apply_size(ctx: &egui::Context, fingers: bool) {
    ctx.all_styles_mut(|style| {
        let spacing = &mut style.spacing;
        spacing.interact_size = if fingers { vec2(FINGER, FINGER) } else { vec2(40.0, 26.0) };
        spacing.icon_width = if fingers { 22.0 } else { 16.0 };
        spacing.combo_height = if fingers { 320.0 } else { 200.0 };
    });
    // A finger moves during a tap, and a double-tap does not hit the same point twice.
    ctx.options_mut(|options| {
        options.input_options.max_click_dist = if fingers { 16.0 } else { 6.0 };
    });
}

/// Whether controls are sized for touch.
pub fn has_fingers(ui: &Ui) -> bool {
    ui.spacing().interact_size.x >= FINGER
}

/// Side of a small button, points: `mouse` unless controls are sized for touch.
pub fn side(ui: &Ui, mouse: f32) -> f32 {
    if has_fingers(ui) { ui.spacing().interact_size.y } else { mouse }
}

/// Uses dense rows in the rest of `ui`, so that a phone shows all answers of a question and most of a menu.
pub fn use_dense_rows(ui: &mut Ui) {
    if has_fingers(ui) {
        let spacing = ui.spacing_mut();
        (spacing.interact_size.y, spacing.item_spacing.y) = (DENSE_FINGER, 4.0);
    }
}

/// A small line of warning text.
pub fn warning(ui: &mut Ui, words: impl Into<String>) -> Response {
    let colour = ui.visuals().warn_fg_color;
    ui.label(RichText::new(words).small().color(colour))
}

/// A small line of error text.
pub fn error(ui: &mut Ui, words: impl Into<String>) -> Response {
    let colour = ui.visuals().error_fg_color;
    ui.label(RichText::new(words).small().color(colour))
}

/// One font for everything: its digits have equal widths, so a running clock does not jitter.
pub fn fonts() -> FontDefinitions {
    const NAME: &str = "Ubuntu-Light";
    let mut fonts = FontDefinitions::empty();
    let face = FontData::from_static(epaint_default_fonts::UBUNTU_LIGHT);
    fonts.font_data.insert(NAME.to_owned(), Arc::new(face));
    for family in fonts.families.values_mut() {
        family.push(NAME.to_owned());
    }
    fonts
}

/// Sets the font and the styles of both themes; `contrast` replaces grey by black and white.
pub fn apply(ctx: &egui::Context, contrast: bool) {
    ctx.set_fonts(fonts());
    apply_size(ctx, false);
    for theme in [Theme::Light, Theme::Dark] {
        ctx.style_mut_of(theme, |style| {
            style.visuals = visuals(theme == Theme::Dark);
            if contrast {
                sharpen(&mut style.visuals);
            }
        });
    }
    ctx.all_styles_mut(|style| {
        let spacing = &mut style.spacing;
        spacing.item_spacing = vec2(8.0, 6.0);
        spacing.button_padding = vec2(10.0, 4.0);
        spacing.combo_width = 120.0;
        // Lets popup lists take their natural height.
        spacing.default_area_size.y = 1000.0;
        spacing.tooltip_width = 340.0;
        spacing.menu_margin = Margin::same(8);
        spacing.window_margin = Margin::same(16);
        style.text_styles = [
            (TextStyle::Heading, FontId::new(18.0, FontFamily::Proportional)),
            (TextStyle::Body, FontId::new(14.0, FontFamily::Proportional)),
            (TextStyle::Button, FontId::new(14.0, FontFamily::Proportional)),
            (TextStyle::Monospace, FontId::new(13.0, FontFamily::Monospace)),
            (TextStyle::Small, FontId::new(12.0, FontFamily::Proportional)),
        ]
        .into();
    });
}

/// Gives text and edges the highest contrast.
fn sharpen(visuals: &mut Visuals) {
    let (ground, ink) =
        if visuals.dark_mode { (Color32::BLACK, Color32::WHITE) } else { (Color32::WHITE, Color32::BLACK) };
    (visuals.panel_fill, visuals.window_fill, visuals.extreme_bg_color) = (ground, ground, ground);
    (visuals.weak_text_color, visuals.disabled_alpha) = (Some(ink), 0.7);
    visuals.window_stroke = Stroke::new(1.0, ink);
    let widgets = &mut visuals.widgets;
    for widget in [
        &mut widgets.noninteractive,
        &mut widgets.inactive,
        &mut widgets.hovered,
        &mut widgets.active,
        &mut widgets.open,
    ] {
        (widget.fg_stroke.color, widget.bg_stroke) = (ink, Stroke::new(1.0, ink));
        (widget.weak_bg_fill, widget.bg_fill) = (ground, ground.lerp_to_gamma(ink, 0.3));
    }
}

fn visuals(dark: bool) -> Visuals {
    let mut visuals = if dark { Visuals::dark() } else { Visuals::light() };
    let pick = |on_light, on_dark| rgb(if dark { on_dark } else { on_light });
    visuals.panel_fill = pick(0xFAFBFC, 0x1B2026);
    visuals.window_fill = pick(0xFFFFFF, 0x22282F);
    visuals.extreme_bg_color = pick(0xFFFFFF, 0x12161A);
    visuals.faint_bg_color = pick(0xF0F3F6, 0x242A31);
    visuals.selection.bg_fill = pick(0xB5D5F5, 0x1F4E7D);
    visuals.selection.stroke = Stroke::new(1.0, pick(0x1058A8, 0x80C2FF));
    visuals.hyperlink_color = pick(0x1562B8, 0x6CB8FF);
    visuals.warn_fg_color = pick(0x9A5500, 0xFFB84D);
    visuals.error_fg_color = pick(0xC01C28, 0xFF7B72);
    visuals.widgets.noninteractive.bg_stroke = Stroke::new(1.0, pick(0xDCE2E8, 0x333B44));
    visuals.widgets.noninteractive.fg_stroke.color = pick(0x1E2A36, 0xD9E0E7);
    visuals.weak_text_color = Some(pick(0x576470, 0x9AA7B4));
    visuals.widgets.inactive.weak_bg_fill = pick(0xE9EDF1, 0x353E48);
    visuals.widgets.inactive.bg_fill = pick(0xD6DDE4, 0x3C454F);
    visuals.widgets.inactive.fg_stroke.color = pick(0x2B3845, 0xD0D8E0);
    visuals.widgets.hovered.weak_bg_fill = pick(0xDCE6F1, 0x404D5A);
    visuals.widgets.active.weak_bg_fill = pick(0xC6DBF0, 0x465D74);
    let radius = CornerRadius::same(6);
    for widget in [
        &mut visuals.widgets.noninteractive,
        &mut visuals.widgets.inactive,
        &mut visuals.widgets.hovered,
        &mut visuals.widgets.active,
        &mut visuals.widgets.open,
    ] {
        widget.corner_radius = radius;
    }
    visuals.window_corner_radius = CornerRadius::same(10);
    visuals.menu_corner_radius = CornerRadius::same(8);
    visuals.slider_trailing_fill = true;
    visuals
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Collects the texts of the files below `folder`.
    fn texts(folder: &std::path::Path, out: &mut Vec<String>) {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                texts(&path, out);
            } else if !path.ends_with("tests.rs") {
                out.extend(std::fs::read_to_string(&path));
            }
        }
    }

    #[test]
    fn the_font_has_every_displayed_character() {
        let ctx = eframe::egui::Context::default();
        apply(&ctx, false);
        let mut output = ctx.run_ui(Default::default(), |_| {});
        output.textures_delta.clear();
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut shown = vec![crate::scene::reference_page()];
        for folder in [
            "src/app",
            "src/session",
            "src/view",
            "crates/analysis/src",
            "crates/physics/src/machine",
            "crates/physics/src/simulate",
            "assets/scenes",
            "assets/benchmarks",
            "assets/lessons",
        ] {
            texts(&root.join(folder), &mut shown);
        }
        let shown: std::collections::BTreeSet<char> = shown.iter().flat_map(|text| text.chars()).collect();
        let shown = shown.into_iter().filter(|c| !c.is_control());
        let font = FontId::proportional(14.0);
        let missing: String = ctx.fonts_mut(|fonts| {
            let missing = |c: &char| !fonts.has_glyph(&font, *c);
            shown.filter(missing).collect()
        });
        assert_eq!(missing, "");
        // The font does not cover everything.
        assert!(!ctx.fonts_mut(|fonts| fonts.has_glyph(&font, '\u{6f22}')));
    }
}
