//! Contrast of texts against their background, computed from the shapes of the window: at least 4.5:1, WCAG 2.2, 1.4.3.

use eframe::egui::{self, Color32, Key, Pos2, Rect, Shape, accesskit::Role, epaint::TextShape};
use egui_kittest::{
    Harness,
    kittest::{NodeT as _, Queryable as _},
};
use jointplay::app::App;
use jointplay::view::{Colour, Palette, Theme};

use crate::hands::window::{click, sized};

/// Required contrast of a text.
const MIN_CONTRAST: f64 = 4.5;

/// Relative luminance, WCAG 2.2.
fn luminance(colour: Color32) -> f64 {
    let [r, g, b] = Colour(colour.to_normalized_gamma_f32()).linear().map(f64::from);
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

fn contrast(a: Color32, b: Color32) -> f64 {
    let (a, b) = (luminance(a), luminance(b));
    (a.max(b) + 0.05) / (a.min(b) + 0.05)
}

/// A painted item: a filled area or a text.
enum Item<'a> {
    Fill(Rect, Color32),
    Text(Rect, &'a TextShape),
}

fn flatten<'a>(shape: &'a Shape, clip: Rect, sky: Color32, out: &mut Vec<Item<'a>>) {
    match shape {
        Shape::Vec(shapes) => shapes.iter().for_each(|shape| flatten(shape, clip, sky, out)),
        Shape::Rect(rect) => out.push(Item::Fill(rect.rect.intersect(clip), rect.fill)),
        Shape::Callback(callback) => out.push(Item::Fill(callback.rect.intersect(clip), sky)),
        Shape::Text(text) => {
            let area = text.visual_bounding_rect().intersect(clip);
            if area.is_positive() {
                out.push(Item::Text(area, text));
            }
        }
        _ => {}
    }
}

/// The colour at `point` after painting `all` over `background`.
fn colour_at(all: &[Item<'_>], point: Pos2, background: Color32) -> Color32 {
    let fills = all.iter().filter_map(|item| match item {
        Item::Fill(rect, colour) if rect.contains(point) => Some(*colour),
        _ => None,
    });
    fills.fold(background, Color32::blend)
}

/// Checks every text in the window except those of disabled controls, which WCAG excepts.
fn check(harness: &Harness<'_, App>, theme: egui::Theme, view: &str, failures: &mut Vec<String>) {
    let [r, g, b, _] = Palette::of(if theme == egui::Theme::Dark { Theme::Dark } else { Theme::Light }).sky.0;
    let sky = Color32::from_rgb((255.0 * r) as u8, (255.0 * g) as u8, (255.0 * b) as u8);
    let background = harness.ctx.global_style().visuals.panel_fill;
    let disabled: Vec<Rect> = harness
        .root()
        .children_recursive()
        .filter(|node| node.accesskit_node().is_disabled())
        .map(|node| node.rect().expand(1.0))
        .collect();
    let mut all = Vec::new();
    for part in &harness.output().shapes {
        flatten(&part.shape, part.clip_rect, sky, &mut all);
    }
    let mut checked = 0;
    for (index, item) in all.iter().enumerate() {
        let Item::Text(area, text) = item else { continue };
        let words = text.galley.text();
        if words.trim().is_empty() || disabled.iter().any(|rect| rect.contains_rect(*area)) {
            continue;
        }
        // The halo of a text is four pale copies around it.
        let is_halo = |item: &Item<'_>| {
            matches!(item, Item::Text(other, over) if over.galley.text() == words
                && (other.center() - area.center()).length() < 1.5 && over.fallback_color != text.fallback_color)
        };
        if all[index + 1..].iter().take(4).any(is_halo) {
            continue;
        }
        let background = colour_at(&all[..index], area.center(), background);
        for section in &text.galley.job.sections {
            let colour = section.format.color;
            let colour = if colour == Color32::PLACEHOLDER { text.fallback_color } else { colour };
            let ink = text.override_text_color.unwrap_or(colour).gamma_multiply(text.opacity_factor);
            let ratio = contrast(background.blend(ink), background);
            checked += 1;
            if ratio < MIN_CONTRAST {
                failures.push(format!("{theme:?}, {view}: {words:?} {ink:?} on {background:?}: {ratio:.2}"));
            }
        }
    }
    assert!(checked > 5, "{view}: {checked} texts");
}

#[test]
fn every_text_has_enough_contrast_in_both_themes() {
    let mut failures = Vec::new();
    for theme in [egui::Theme::Dark, egui::Theme::Light] {
        let mut harness = sized("spcmm", [1280.0, 800.0], theme);
        harness.state_mut().player_mut().run_to(40e-3);
        harness.state_mut().player_mut().set("contact.clearance", "0.6 mm").expect("in range");
        harness.state_mut().player_mut().run_to(60e-3);
        harness.run();
        let mut check_view = |harness: &mut Harness<'_, App>, view: &str| {
            harness.run_steps(3);
            check(harness, theme, view, &mut failures);
        };
        check_view(&mut harness, "panels");
        for menu in ["View options", "Save", "Lessons", "Choose plots"] {
            click(&mut harness, menu);
            check_view(&mut harness, menu);
            harness.key_press(Key::Escape);
            harness.run_steps(3);
        }
        for (key, view) in [
            (Key::L, "microscope"),
            (Key::I, "impact list"),
            (Key::B, "bench"),
            (Key::W, "costs"),
            (Key::Questionmark, "keys"),
        ] {
            harness.key_press(key);
            check_view(&mut harness, view);
        }
        harness.key_press(Key::Escape);
        harness.run_steps(2);
        click(&mut harness, "Save");
        click(&mut harness, "Film…");
        check_view(&mut harness, "film");
        harness.key_press(Key::Escape);
        harness.run_steps(2);
        let list = harness.get_by_role_and_label(Role::ComboBox, "Time scale preset");
        list.click();
        check_view(&mut harness, "list");
        harness.key_press(Key::Escape);
        assert!(harness.state_mut().open("no such scene").is_err());
        harness.state_mut().show_instant(20e-3);
        check_view(&mut harness, "past");
        harness.key_press(Key::F5);
        check_view(&mut harness, "presentation");

        let mut phone = sized("spcmm", [390.0, 844.0], theme);
        check_view(&mut phone, "phone");
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
