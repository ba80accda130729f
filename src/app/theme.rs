//! Look of the window: spacing, type sizes and the colours of both themes.

use eframe::egui::{
    self, Color32, CornerRadius, FontFamily, FontId, Margin, Stroke, TextStyle, Theme, Visuals,
    vec2,
};

/// Series colours for plots, dark enough on white and light enough on black; distinguishable for the colour-blind (after Okabe
/// & Ito).
const SERIES: [(Color32, Color32); 9] = [
    (
        Color32::from_rgb(0x00, 0x72, 0xB2),
        Color32::from_rgb(0x56, 0xB4, 0xE9),
    ),
    (
        Color32::from_rgb(0xD5, 0x5E, 0x00),
        Color32::from_rgb(0xFF, 0x8C, 0x3A),
    ),
    (
        Color32::from_rgb(0x00, 0x8F, 0x68),
        Color32::from_rgb(0x2C, 0xD0, 0xA0),
    ),
    (
        Color32::from_rgb(0xB8, 0x4E, 0x90),
        Color32::from_rgb(0xE4, 0x93, 0xC4),
    ),
    (
        Color32::from_rgb(0xA8, 0x7B, 0x00),
        Color32::from_rgb(0xF0, 0xD0, 0x42),
    ),
    (
        Color32::from_rgb(0x5B, 0x5F, 0xC7),
        Color32::from_rgb(0xA5, 0xA8, 0xF5),
    ),
    (
        Color32::from_rgb(0x7A, 0x4A, 0x1E),
        Color32::from_rgb(0xC9, 0x9A, 0x6B),
    ),
    (
        Color32::from_rgb(0x6B, 0x6B, 0x6B),
        Color32::from_rgb(0xB5, 0xB5, 0xB5),
    ),
    (
        Color32::from_rgb(0x9B, 0x1C, 0x31),
        Color32::from_rgb(0xFF, 0x8A, 0x94),
    ),
];

/// Colour of the `index`th series of a plot.
pub fn series(index: usize, dark: bool) -> Color32 {
    let (on_light, on_dark) = SERIES[index % SERIES.len()];
    if dark { on_dark } else { on_light }
}

/// Least side of a touch target, points.
pub const FINGER: f32 = 44.0;

/// Sizes the controls for a mouse, or for fingers.
pub fn apply_size(ctx: &egui::Context, fingers: bool) {
    ctx.all_styles_mut(|style| {
        let spacing = &mut style.spacing;
        spacing.interact_size = if fingers {
            vec2(FINGER, FINGER)
        } else {
            vec2(40.0, 26.0)
        };
        spacing.icon_width = if fingers { 22.0 } else { 16.0 };
        spacing.combo_height = if fingers { 320.0 } else { 200.0 };
    });
    // A finger moves during a tap and does not come down twice on the same point.
    ctx.options_mut(|options| {
        options.input_options.max_click_dist = if fingers { 16.0 } else { 6.0 };
    });
}

/// Side of a small button, points: `mouse` where there is no need to make it larger.
pub fn side(ui: &egui::Ui, mouse: f32) -> f32 {
    if ui.spacing().interact_size.y >= FINGER {
        FINGER
    } else {
        mouse
    }
}

/// Sets both themes' styles.
pub fn apply(ctx: &egui::Context) {
    apply_size(ctx, false);
    ctx.style_mut_of(Theme::Light, |style| style.visuals = light());
    ctx.style_mut_of(Theme::Dark, |style| style.visuals = dark());
    ctx.all_styles_mut(|style| {
        let spacing = &mut style.spacing;
        spacing.item_spacing = vec2(8.0, 6.0);
        spacing.button_padding = vec2(10.0, 4.0);
        spacing.combo_width = 120.0;
        spacing.tooltip_width = 340.0;
        spacing.menu_margin = Margin::same(8);
        spacing.window_margin = Margin::same(16);
        style.text_styles = [
            (
                TextStyle::Heading,
                FontId::new(18.0, FontFamily::Proportional),
            ),
            (TextStyle::Body, FontId::new(14.0, FontFamily::Proportional)),
            (
                TextStyle::Button,
                FontId::new(14.0, FontFamily::Proportional),
            ),
            (
                TextStyle::Monospace,
                FontId::new(13.0, FontFamily::Monospace),
            ),
            (
                TextStyle::Small,
                FontId::new(12.0, FontFamily::Proportional),
            ),
        ]
        .into();
    });
}

fn light() -> Visuals {
    let mut visuals = Visuals::light();
    visuals.panel_fill = Color32::from_rgb(0xFA, 0xFB, 0xFC);
    visuals.window_fill = Color32::WHITE;
    visuals.extreme_bg_color = Color32::WHITE;
    visuals.faint_bg_color = Color32::from_rgb(0xF0, 0xF3, 0xF6);
    visuals.selection.bg_fill = Color32::from_rgb(0xB5, 0xD5, 0xF5);
    visuals.selection.stroke = Stroke::new(1.0, Color32::from_rgb(0x15, 0x62, 0xB8));
    visuals.hyperlink_color = Color32::from_rgb(0x15, 0x62, 0xB8);
    visuals.warn_fg_color = Color32::from_rgb(0x9A, 0x55, 0x00);
    visuals.error_fg_color = Color32::from_rgb(0xC0, 0x1C, 0x28);
    visuals.widgets.noninteractive.bg_stroke =
        Stroke::new(1.0, Color32::from_rgb(0xDC, 0xE2, 0xE8));
    visuals.widgets.noninteractive.fg_stroke.color = Color32::from_rgb(0x1E, 0x2A, 0x36);
    visuals.weak_text_color = Some(Color32::from_rgb(0x57, 0x64, 0x70));
    visuals.widgets.inactive.weak_bg_fill = Color32::from_rgb(0xE9, 0xED, 0xF1);
    visuals.widgets.inactive.bg_fill = Color32::from_rgb(0xD6, 0xDD, 0xE4);
    visuals.widgets.inactive.fg_stroke.color = Color32::from_rgb(0x2B, 0x38, 0x45);
    visuals.widgets.hovered.weak_bg_fill = Color32::from_rgb(0xDC, 0xE6, 0xF1);
    visuals.widgets.active.weak_bg_fill = Color32::from_rgb(0xC6, 0xDB, 0xF0);
    common(&mut visuals);
    visuals
}

fn dark() -> Visuals {
    let mut visuals = Visuals::dark();
    visuals.panel_fill = Color32::from_rgb(0x1B, 0x20, 0x26);
    visuals.window_fill = Color32::from_rgb(0x22, 0x28, 0x2F);
    visuals.extreme_bg_color = Color32::from_rgb(0x12, 0x16, 0x1A);
    visuals.faint_bg_color = Color32::from_rgb(0x24, 0x2A, 0x31);
    visuals.selection.bg_fill = Color32::from_rgb(0x1F, 0x4E, 0x7D);
    visuals.selection.stroke = Stroke::new(1.0, Color32::from_rgb(0x6C, 0xB8, 0xFF));
    visuals.hyperlink_color = Color32::from_rgb(0x6C, 0xB8, 0xFF);
    visuals.warn_fg_color = Color32::from_rgb(0xFF, 0xB8, 0x4D);
    visuals.error_fg_color = Color32::from_rgb(0xFF, 0x7B, 0x72);
    visuals.widgets.noninteractive.bg_stroke =
        Stroke::new(1.0, Color32::from_rgb(0x33, 0x3B, 0x44));
    visuals.widgets.noninteractive.fg_stroke.color = Color32::from_rgb(0xD9, 0xE0, 0xE7);
    visuals.weak_text_color = Some(Color32::from_rgb(0x9A, 0xA7, 0xB4));
    visuals.widgets.inactive.weak_bg_fill = Color32::from_rgb(0x35, 0x3E, 0x48);
    visuals.widgets.inactive.bg_fill = Color32::from_rgb(0x3C, 0x45, 0x4F);
    visuals.widgets.inactive.fg_stroke.color = Color32::from_rgb(0xD0, 0xD8, 0xE0);
    visuals.widgets.hovered.weak_bg_fill = Color32::from_rgb(0x40, 0x4D, 0x5A);
    visuals.widgets.active.weak_bg_fill = Color32::from_rgb(0x46, 0x5D, 0x74);
    common(&mut visuals);
    visuals
}

fn common(visuals: &mut Visuals) {
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
}
