//! Clicks every control with a pointer at its position, since an accessibility action also reaches covered controls.

use eframe::egui::{self, Key, Popup, Pos2, Rect, Shape, accesskit::Role, vec2};
use egui_kittest::{
    Harness,
    kittest::{NodeT as _, Queryable as _},
};
use jointplay::app::App;

use crate::hands::window::sized;

const WIDE: [f32; 2] = [1280.0, 800.0];
const PORTRAIT: [f32; 2] = [390.0, 844.0];
const LANDSCAPE: [f32; 2] = [844.0, 390.0];

/// Roles of clickable widgets.
const CLICKABLE: [Role; 5] = [Role::Button, Role::ComboBox, Role::CheckBox, Role::RadioButton, Role::Switch];

/// A clickable widget.
struct Target {
    id: egui::accesskit::NodeId,
    role: Role,
    name: String,
    rect: Rect,
}

/// Enabled clickable widgets whose centre is in the window.
fn targets(harness: &Harness<'_, App>) -> Vec<Target> {
    let window = harness.ctx.content_rect();
    let all = CLICKABLE.into_iter().flat_map(|role| harness.query_all_by_role(role));
    all.filter(|node| !node.accesskit_node().is_disabled() && window.contains(node.rect().center()))
        .map(|node| {
            let accesskit = node.accesskit_node();
            let name = accesskit.label().or_else(|| accesskit.value()).unwrap_or_default();
            Target { id: accesskit.locate().0, role: accesskit.role(), name, rect: node.rect() }
        })
        .collect()
}

/// Moves the pointer to the centre of each target and asserts that a click would hit it.
#[track_caller]
fn assert_in_reach(harness: &mut Harness<'_, App>, label: &str) -> usize {
    let targets = targets(harness);
    for target in &targets {
        harness.hover_at(target.rect.center());
        harness.run_steps(2);
        let hit = harness.ctx.viewport(|viewport| viewport.hits.click);
        let hit = hit.map(|widget| widget.id.accesskit_id());
        assert_eq!(hit, Some(target.id), "{label}: {:?} {} at {:?} is covered", target.role, target.name, target.rect);
    }
    harness.remove_cursor();
    harness.run_steps(2);
    targets.len()
}

fn press(harness: &mut Harness<'_, App>, at: Pos2) {
    harness.hover_at(at);
    harness.step();
    harness.drag_at(at);
    harness.step();
    harness.drop_at(at);
    harness.run_steps(3);
}

fn centre_of(harness: &Harness<'_, App>, role: Role, name: &str) -> Pos2 {
    harness.get_by_role_and_label(role, name).rect().center()
}

fn press_on(harness: &mut Harness<'_, App>, role: Role, name: &str) {
    let at = centre_of(harness, role, name);
    press(harness, at);
}

/// Presses the list or menu `name` and asserts that it opens.
#[track_caller]
fn assert_opens(harness: &mut Harness<'_, App>, label: &str, role: Role, name: &str) {
    press_on(harness, role, name);
    assert!(Popup::is_any_open(&harness.ctx), "{label}: {name} does not open");
    harness.key_press(Key::Escape);
    harness.run_steps(3);
    assert!(!Popup::is_any_open(&harness.ctx), "{label}: {name} stays open");
}

/// Opens every visible list.
fn open_lists(harness: &mut Harness<'_, App>, label: &str) -> usize {
    let lists: Vec<Target> = targets(harness).into_iter().filter(|target| target.role == Role::ComboBox).collect();
    for list in &lists {
        assert_opens(harness, label, list.role, &list.name);
    }
    lists.len()
}

fn presenting(size: [f32; 2]) -> Harness<'static, App> {
    let mut harness = sized("spcmm", size, egui::Theme::Light);
    harness.key_press(Key::F5);
    harness.step();
    harness.set_size(egui::Vec2::from(size) / harness.ctx.zoom_factor());
    harness.run();
    assert!(harness.state().is_presenting());
    harness
}

#[test]
fn every_button_list_and_switch_can_be_clicked_at_its_centre() {
    for (size, min_count) in [(WIDE, 30), (PORTRAIT, 10), (LANDSCAPE, 10)] {
        let mut harness = sized("spcmm", size, egui::Theme::Light);
        let label = format!("{size:?}");
        let count = assert_in_reach(&mut harness, &label);
        assert!(count >= min_count, "{label}: {count}");
        for key in [Key::C, Key::G] {
            harness.key_press(key);
            harness.run();
            assert_in_reach(&mut harness, &format!("{label} after {key:?}"));
        }
        let mut harness = presenting(size);
        assert!(assert_in_reach(&mut harness, &format!("presentation {size:?}")) >= 4);
    }
}

#[test]
fn every_list_and_menu_opens_by_a_press_at_its_centre() {
    let mut harness = sized("spcmm", WIDE, egui::Theme::Light);
    assert!(open_lists(&mut harness, "window") >= 3);
    for menu in ["Save", "View options", "Choose plots"] {
        assert_opens(&mut harness, "window", Role::Button, menu);
    }
    let mut harness = presenting(WIDE);
    assert!(open_lists(&mut harness, "presentation") >= 1);
    for size in [PORTRAIT, LANDSCAPE] {
        let mut harness = sized("spcmm", size, egui::Theme::Light);
        assert!(open_lists(&mut harness, "small window") >= 2);
        for menu in ["Menu", "View options"] {
            assert_opens(&mut harness, "small window", Role::Button, menu);
        }
    }
}

#[test]
fn a_time_scale_is_chosen_from_the_list_by_a_mouse_and_by_a_drag_across_it() {
    for mut harness in [sized("spcmm", WIDE, egui::Theme::Light), presenting(WIDE)] {
        let scale = |harness: &Harness<'_, App>| harness.state().player().pacer.scale();
        for (entry, expected) in [("1:10", 0.1), ("1:100", 0.01), ("1:20", 0.05)] {
            press_on(&mut harness, Role::ComboBox, "Time scale preset");
            press_on(&mut harness, Role::Button, entry);
            assert_eq!(scale(&harness), expected, "{entry}");
            assert!(!Popup::is_any_open(&harness.ctx));
        }
        let at = centre_of(&harness, Role::ComboBox, "Time scale preset");
        harness.hover_at(at);
        harness.step();
        harness.drag_at(at);
        harness.step();
        for offset in [10.0, 20.0, 30.0, 40.0] {
            harness.hover_at(at + vec2(offset, 0.0));
            harness.step();
        }
        harness.drop_at(at + vec2(40.0, 0.0));
        harness.run_steps(3);
        assert_eq!(scale(&harness), 0.5, "two entries beyond 1:20");
        assert!(!Popup::is_any_open(&harness.ctx), "a drag opens nothing");
    }
}

#[test]
fn a_menu_opens_at_the_first_click_after_a_slider_drag() {
    for menu in ["Save", "Before and after (1)"] {
        let mut harness = sized("slider-crank", WIDE, egui::Theme::Light);
        let track = harness.get_by_role_and_label(Role::Slider, "Clearance").rect();
        harness.drag_at(track.left_center() + vec2(12.0, 0.0));
        harness.hover_at(track.left_center() + vec2(90.0, 0.0));
        harness.run_steps(2);
        harness.drop_at(track.left_center() + vec2(90.0, 0.0));
        harness.run_steps(45);
        press_on(&mut harness, Role::Button, menu);
        assert!(Popup::is_any_open(&harness.ctx), "{menu}");
    }
}

#[test]
fn the_names_labels_and_options_of_a_menu_begin_on_one_line() {
    let mut harness = sized("spcmm", WIDE, egui::Theme::Light);
    press_on(&mut harness, Role::Button, "Save");
    let left = |role, label: &str| harness.get_by_role_and_label(role, label).rect().left();
    // The highlight of an entry under the pointer begins before its name.
    let padding = 2.0;
    let name = left(Role::Button, "Film…") + padding;
    assert_eq!(left(Role::Button, "Scene…") + padding, name);
    for (role, label) in [
        (Role::RadioButton, "View only"),
        (Role::RadioButton, "Whole window"),
        (Role::RadioButton, "1×"),
        (Role::Label, "Width"),
    ] {
        assert_eq!(left(role, label), name, "{label}");
    }
    let plots = harness.get_all_by_role_and_label(Role::Label, "Plots").map(|label| label.rect().left());
    assert!(plots.into_iter().any(|left| left == name));
}

#[test]
fn a_click_puts_the_caret_between_the_letters_nearest_to_it() {
    for size in [WIDE, PORTRAIT] {
        let mut harness = sized("spcmm", size, egui::Theme::Light);
        let field = harness.get_by_role_and_label(Role::TextInput, "Clearance").rect();
        let click = |harness: &mut Harness<'_, App>, at: Pos2| {
            harness.hover_at(at);
            harness.step();
            harness.drag_at(at);
            harness.step();
            harness.drop_at(at);
            // Longer than between two clicks of a double click.
            harness.run_steps(40);
        };
        // The first click selects everything.
        click(&mut harness, field.center());
        let shapes: Vec<Shape> = harness.output().shapes.iter().map(|part| part.shape.clone()).collect();
        let text = shapes.iter().find_map(|shape| match shape {
            Shape::Text(text)
                if text.galley.text() == "0.3 mm" && field.contains(text.visual_bounding_rect().center()) =>
            {
                Some(text.clone())
            }
            _ => None,
        });
        let text = text.expect("the value");
        let row = &text.galley.rows[0];
        let letters: Vec<[f32; 2]> = row
            .row
            .glyphs
            .iter()
            .map(|glyph| {
                let left = text.pos.x + row.pos.x + glyph.pos.x;
                [left, left + glyph.advance_width]
            })
            .collect();
        assert_eq!(letters.len(), 6);
        for (index, [left, right]) in letters.iter().enumerate() {
            for (share, expected) in [(0.25, index), (0.75, index + 1)] {
                click(&mut harness, egui::pos2(egui::lerp(*left..=*right, share), field.center().y));
                let id = harness.ctx.memory(|memory| memory.focused()).expect("the field");
                let state = egui::TextEdit::load_state(&harness.ctx, id).expect("is edited");
                let caret = state.cursor.char_range().expect("a caret").primary.index;
                assert_eq!(usize::from(caret), expected, "{size:?}: letter {index} at {share}");
                let drawn = harness.output().shapes.iter().find_map(|part| match &part.shape {
                    Shape::LineSegment { points: [from, to], .. }
                        if from.x == to.x && field.contains(*from) && field.contains(*to) =>
                    {
                        Some(from.x)
                    }
                    _ => None,
                });
                let boundary = letters.get(expected).map_or(letters[5][1], |letter| letter[0]);
                // It is drawn on whole pixels.
                let drawn = drawn.expect("a caret");
                assert!((drawn - boundary).abs() <= 1.0, "{size:?}: {drawn} beside {boundary}");
            }
        }
    }
}
