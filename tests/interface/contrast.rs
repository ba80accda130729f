//! Contrast of texts with what lies behind them, computed from what the window draws: at least 4.5:1, WCAG 2.2, 1.4.3.

use eframe::egui::{self, Color32, Key, Pos2, Rect, Shape, accesskit::Role, epaint::TextShape};
use egui_kittest::{
    Harness,
    kittest::{NodeT as _, Queryable as _},
};
use jointplay::app::App;
use jointplay::view::{Colour, Palette, Theme};

use crate::window::{click, sized};

/// Least contrast of a text.
const LEAST: f64 = 4.5;

/// Relative luminance, WCAG 2.2.
fn luminance(colour: Color32) -> f64 {
    let [r, g, b] = Colour(colour.to_normalized_gamma_f32()).linear().map(f64::from);
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

fn contrast(a: Color32, b: Color32) -> f64 {
    let (a, b) = (luminance(a), luminance(b));
    (a.max(b) + 0.05) / (a.min(b) + 0.05)
}

/// What is painted, in order: filled areas, and texts.
enum Painted<'a> {
    Fill(Rect, Color32),
    Text(Rect, &'a TextShape),
}

fn flatten<'a>(shape: &'a Shape, clip: Rect, sky: Color32, out: &mut Vec<Painted<'a>>) {
    match shape {
        Shape::Vec(shapes) => shapes.iter().for_each(|shape| flatten(shape, clip, sky, out)),
        Shape::Rect(rect) => out.push(Painted::Fill(rect.rect.intersect(clip), rect.fill)),
        Shape::Callback(callback) => out.push(Painted::Fill(callback.rect.intersect(clip), sky)),
        Shape::Text(text) => {
            let place = text.visual_bounding_rect().intersect(clip);
            if place.is_positive() {
                out.push(Painted::Text(place, text));
            }
        }
        _ => {}
    }
}

/// The colour at `point` after painting `all`.
fn behind(all: &[Painted<'_>], point: Pos2, ground: Color32) -> Color32 {
    let fills = all.iter().filter_map(|painted| match painted {
        Painted::Fill(rect, colour) if rect.contains(point) => Some(*colour),
        _ => None,
    });
    fills.fold(ground, Color32::blend)
}

/// Checks every text in the window except those of disabled controls, which WCAG excepts.
fn check(harness: &Harness<'_, App>, theme: egui::Theme, what: &str, poor: &mut Vec<String>) {
    let [r, g, b, _] = Palette::of(if theme == egui::Theme::Dark { Theme::Dark } else { Theme::Light }).sky.0;
    let sky = Color32::from_rgb((255.0 * r) as u8, (255.0 * g) as u8, (255.0 * b) as u8);
    let ground = harness.ctx.global_style().visuals.panel_fill;
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
    let mut seen = 0;
    for (index, painted) in all.iter().enumerate() {
        let Painted::Text(place, text) = painted else { continue };
        let words = text.galley.text();
        if words.trim().is_empty() || disabled.iter().any(|rect| rect.contains_rect(*place)) {
            continue;
        }
        // Four pale copies around a text are its halo.
        let is_halo = |painted: &Painted<'_>| {
            matches!(painted, Painted::Text(other, over) if over.galley.text() == words
                && (other.center() - place.center()).length() < 1.5 && over.fallback_color != text.fallback_color)
        };
        if all[index + 1..].iter().take(4).any(is_halo) {
            continue;
        }
        let ground = behind(&all[..index], place.center(), ground);
        for section in &text.galley.job.sections {
            let own = section.format.color;
            let own = if own == Color32::PLACEHOLDER { text.fallback_color } else { own };
            let ink = text.override_text_color.unwrap_or(own).gamma_multiply(text.opacity_factor);
            let found = contrast(ground.blend(ink), ground);
            seen += 1;
            if found < LEAST {
                poor.push(format!("{theme:?}, {what}: {words:?} {ink:?} on {ground:?}: {found:.2}"));
            }
        }
    }
    assert!(seen > 5, "{what}: {seen} texts");
}

#[test]
fn every_text_stands_out_from_what_lies_behind_it_in_both_themes() {
    let mut poor = Vec::new();
    for theme in [egui::Theme::Dark, egui::Theme::Light] {
        let mut harness = sized("spcmm", [1280.0, 800.0], theme);
        harness.state_mut().player_mut().run_to(40e-3);
        harness.state_mut().player_mut().set("contact.clearance", "0.6 mm").expect("in range");
        harness.state_mut().player_mut().run_to(60e-3);
        harness.run();
        let mut see = |harness: &mut Harness<'_, App>, what: &str| {
            harness.run_steps(3);
            check(harness, theme, what, &mut poor);
        };
        see(&mut harness, "panels");
        for menu in ["View options", "Save", "Lessons", "Choose plots"] {
            click(&mut harness, menu);
            see(&mut harness, menu);
            harness.key_press(Key::Escape);
            harness.run_steps(3);
        }
        for (key, what) in [
            (Key::L, "microscope"),
            (Key::I, "impact list"),
            (Key::B, "bench"),
            (Key::W, "costs"),
            (Key::Questionmark, "keys"),
        ] {
            harness.key_press(key);
            see(&mut harness, what);
        }
        harness.key_press(Key::Escape);
        harness.run_steps(2);
        click(&mut harness, "Save");
        click(&mut harness, "Film…");
        see(&mut harness, "film");
        harness.key_press(Key::Escape);
        harness.run_steps(2);
        let list = harness.get_by_role_and_label(Role::ComboBox, "Time scale preset");
        list.click();
        see(&mut harness, "list");
        harness.key_press(Key::Escape);
        assert!(harness.state_mut().open("no such scene").is_err());
        harness.state_mut().show_instant(20e-3);
        see(&mut harness, "past");
        harness.key_press(Key::F5);
        see(&mut harness, "presentation");

        let mut phone = sized("spcmm", [390.0, 844.0], theme);
        see(&mut phone, "phone");
    }
    assert!(poor.is_empty(), "{}", poor.join("\n"));
}
