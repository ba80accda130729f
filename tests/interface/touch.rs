//! Touch on a small screen: scrolling, dragging, and controls that do not overlap.

use eframe::egui::{self, Pos2, Rect, accesskit::Role, vec2};
use egui_kittest::{Harness, kittest::Queryable as _};
use jointplay::app::{App, AppOptions};

use crate::hands::page::{click, label, open, window};
use crate::hands::{fingers, paced};

const PORTRAIT: [f32; 2] = [390.0, 844.0];
const LANDSCAPE: [f32; 2] = [844.0, 390.0];
/// A window tiled beside three others.
const SMALL: [f32; 2] = [400.0, 300.0];

fn rect(harness: &Harness<'_, App>, role: Role, name: &str) -> Rect {
    harness.get_by_role_and_label(role, name).rect()
}

fn clearance(harness: &Harness<'_, App>) -> f64 {
    harness.state().player().pending().machine.contact.clearance
}

/// The path of a finger from `from` by `offset`, in steps as small as a screen reports; it rests at the end to avoid kinetic
/// scrolling.
fn path(from: Pos2, offset: egui::Vec2) -> Vec<Pos2> {
    let parts = (0..=12).chain([12; 12]);
    parts.map(|k| from + offset * (k as f32 / 12.0)).collect()
}

#[test]
fn a_finger_on_a_slider_scrolls_up_and_down_and_moves_it_sideways() {
    let (mut harness, _) = window("spcmm", PORTRAIT);
    harness.run();
    let before = clearance(&harness);
    let track = rect(&harness, Role::Slider, "Clearance");
    // Away from the handle, where a touch would not move it at once.
    let at = track.left_center() + vec2(0.7 * track.width(), 0.0);
    fingers(&mut harness, &[&path(at, vec2(3.0, -90.0))]);
    harness.run();
    assert_eq!(clearance(&harness), before, "the swipe must not move the slider");
    let moved = track.top() - rect(&harness, Role::Slider, "Clearance").top();
    assert!(moved > 60.0, "scrolled by {moved}");

    // Back down, then sideways: the gesture remains a scroll.
    let start = rect(&harness, Role::Slider, "Friction coefficient").center();
    let friction = harness.state().player().pending().machine.contact.friction;
    let mut gesture = path(start, vec2(0.0, 90.0));
    gesture.extend(path(start + vec2(0.0, 90.0), vec2(80.0, 60.0)));
    fingers(&mut harness, &[&gesture]);
    harness.run();
    assert_eq!(harness.state().player().pending().machine.contact.friction, friction);
    assert_eq!(rect(&harness, Role::Slider, "Clearance").top(), track.top());

    // A tap is not a drag.
    fingers(&mut harness, &[&[at, at]]);
    harness.run();
    assert_eq!(clearance(&harness), before, "a tap must not move the slider");

    let from = track.left_center() + vec2(0.3 * track.width(), 0.0);
    fingers(&mut harness, &[&path(from, vec2(0.4 * track.width(), 20.0))]);
    harness.run();
    let part = clearance(&harness) / 1e-3;
    assert!((0.6..0.8).contains(&part), "{part}");
    assert_eq!(rect(&harness, Role::Slider, "Clearance").top(), track.top());

    // A mouse still moves it at once.
    harness.drag_at(track.left_center() + vec2(0.2 * track.width(), 0.0));
    harness.step();
    harness.drop_at(track.left_center() + vec2(0.2 * track.width(), 0.0));
    harness.run();
    assert!(clearance(&harness) < 0.4e-3, "{}", clearance(&harness));
}

/// Roles and names of controls that do not scroll.
const FIXED: [(Role, &str); 12] = [
    (Role::ComboBox, "Scene"),
    (Role::Button, "Menu"),
    (Role::Button, "View options"),
    (Role::Slider, "Timeline, s"),
    (Role::Button, "Restart"),
    (Role::Button, "Play"),
    (Role::Button, "Step"),
    (Role::ComboBox, "Time scale preset"),
    (Role::Button, "Panels"),
    (Role::Button, "Controls"),
    (Role::Button, "Plots"),
    (Role::Button, "Experiments"),
];

#[test]
fn controls_do_not_overlap_in_windows_of_any_size() {
    for size in [SMALL, [320.0, 480.0], [480.0, 320.0], PORTRAIT, LANDSCAPE] {
        let (mut harness, _) = window("spcmm", size);
        harness.run();
        for fold in [false, true] {
            if fold {
                harness.key_press(egui::Key::C);
                harness.run();
            }
            let shown: Vec<(&str, Rect)> = FIXED
                .iter()
                .filter_map(|&(role, name)| {
                    let node = harness.query_by_role_and_label(role, name)?;
                    Some((name, node.rect()))
                })
                .collect();
            assert!(shown.len() >= 9, "{size:?}: {shown:?}");
            let screen = Rect::from_min_size(Pos2::ZERO, size.into());
            for (i, (name, rect)) in shown.iter().enumerate() {
                assert!(screen.contains_rect(rect.shrink(0.5)), "{size:?}: {name} sticks out: {rect:?}");
                for (other, other_rect) in &shown[i + 1..] {
                    assert!(
                        !rect.shrink(1.0).intersects(other_rect.shrink(1.0)),
                        "{size:?}: {name} and {other}: {rect:?} {other_rect:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_phone_shows_the_machine_play_and_all_three_sliders() {
    for (size, picture) in [([390.0, 664.0], 140.0), (LANDSCAPE, 140.0)] {
        let (mut harness, _) = window("spcmm", size);
        harness.run();
        let sliders = ["Clearance", "Friction coefficient", "Restitution"];
        let tracks = sliders.map(|name| rect(&harness, Role::Slider, name));
        let entries = sliders.map(|name| rect(&harness, Role::TextInput, name));
        let play = rect(&harness, Role::Button, "Play");
        let screen = Rect::from_min_size(Pos2::ZERO, size.into());
        // The sheet ends at the edge of the window, or where the transport begins.
        let sheet_bottom =
            if play.top() > tracks[0].bottom() { rect(&harness, Role::Slider, "Timeline, s").top() } else { size[1] };
        for row in tracks.iter().chain(&entries) {
            assert!(screen.contains_rect(*row) && row.bottom() <= sheet_bottom - 2.0, "{size:?}: {row:?}");
            assert!(row.height() >= 24.0, "large enough for a finger: {row:?}");
        }
        assert!(tracks[1].top() - tracks[0].top() < 80.0, "two rows close together: {tracks:?}");
        assert!(screen.contains_rect(play), "{size:?}: {play:?}");
        let view = harness.get_by_label("3D view").rect();
        assert!(view.height() >= picture && view.width() >= 320.0, "{size:?}: {view:?}");
    }
}

#[test]
fn all_answers_of_a_question_are_visible_or_behind_a_button() {
    let options = || AppOptions::from_link("?lesson=first-impact&step=2").expect("a link");
    let last = "It stays where it is";
    let (mut harness, _) = open(options(), [390.0, 664.0]);
    harness.run_steps(30);
    let answer = rect(&harness, Role::RadioButton, last);
    assert!(answer.bottom() <= rect(&harness, Role::Button, "Next").top(), "{answer:?}");

    let (mut harness, _) = open(options(), LANDSCAPE);
    harness.run_steps(30);
    let hidden = |harness: &Harness<'_, App>| {
        let next = rect(harness, Role::Button, "Next").top();
        rect(harness, Role::RadioButton, last).bottom() > next
    };
    assert!(hidden(&harness));
    for _ in 0..4 {
        if harness.query_by_role_and_label(Role::Button, "More").is_some() {
            let at = rect(&harness, Role::Button, "More").center();
            fingers(&mut harness, &[&[at]]);
            harness.run_steps(30);
        }
    }
    assert!(!hidden(&harness));
    assert!(harness.query_by_role_and_label(Role::Button, "More").is_none(), "at the end");
}

#[test]
fn the_buttons_over_the_picture_never_cover_the_time() {
    for width in [760.0, 800.0, 820.0, 850.0, 880.0, 920.0, 1000.0] {
        let (mut harness, _) = window("spcmm", [width, 1180.0]);
        harness.run();
        let view = harness.get_by_label("3D view").rect();
        let first = harness.query_by_role_and_label(Role::Button, "Isometric");
        let first = first.map_or_else(|| rect(&harness, Role::Button, "View options"), |button| button.rect());
        // Width of "t = 43.5000 ms" in large letters with its background.
        assert!(first.left() - view.left() > 164.0, "{width}: {first:?} in {view:?}");
    }
}

#[test]
fn in_a_small_window_the_panels_are_behind_one_button() {
    let (mut harness, _) = window("spcmm", SMALL);
    harness.run();
    harness.get_by_role_and_label(Role::Slider, "Clearance");
    let choose = |harness: &mut Harness<'_, App>| {
        click(harness, "Panels");
        harness.get_by_role_and_label(Role::Button, "Plots").click();
        harness.run();
    };
    choose(&mut harness);
    harness.get_by_label("Choose plots");
    choose(&mut harness);
    assert!(harness.query_by_label("Choose plots").is_none());
}

#[test]
fn a_phone_in_portrait_shows_once_that_the_run_does_not_keep_up() {
    let slow = crate::common::ticking_clock::<4000>;
    for width in [PORTRAIT[0], 700.0] {
        let mut harness = paced("spcmm", &[], [width, PORTRAIT[1]], egui::Theme::Light, slow, 1.0 / 60.0);
        harness.state_mut().player_mut().pacer.set_scale(1.0);
        click(&mut harness, "Play");
        harness.run_steps(90);
        assert_eq!(harness.query_all_by_label_contains("only 1:").count(), 1, "{width}");
    }
    let mut harness = paced("spcmm", &[], PORTRAIT, egui::Theme::Light, slow, 1.0 / 60.0);
    harness.state_mut().player_mut().pacer.set_scale(1.0);
    click(&mut harness, "Play");
    harness.run_steps(90);
    let words = harness.get_by_label_contains("only 1:").rect();
    let bench = rect(&harness, Role::Button, "Experiments");
    assert!(words.left() >= bench.right() && words.right() <= PORTRAIT[0], "{words:?}");
    assert!((words.center().y - bench.center().y).abs() < 4.0);
}

#[test]
fn a_truncated_menu_shows_a_scroll_bar() {
    /// Number of pixel rows with a scroll bar at the menu's right edge.
    fn bar_rows(harness: &mut Harness<'_, App>) -> usize {
        let first = rect(harness, Role::Button, "Open…");
        let all = harness.query_all_by_role(Role::Button);
        let entries = all.map(|node| node.rect());
        let entries = entries.filter(|rect| (rect.left() - first.left()).abs() < 2.0);
        let right = entries.map(|rect| rect.right()).fold(0.0, f32::max);
        let picture = harness.render().expect("a picture");
        let fill = harness.ctx.global_style().visuals.window_fill;
        let rows = first.top() as u32..(harness.ctx.content_rect().height() - 40.0) as u32;
        // No entry's text reaches this far.
        rows.filter(|&y| {
            let pixel = picture.get_pixel(right as u32 + 5, y);
            let difference = (0..3).map(|k| pixel[k].abs_diff(fill.to_array()[k]));
            difference.max().is_some_and(|most| most > 40)
        })
        .count()
    }
    for (size, truncated) in [(LANDSCAPE, true), ([390.0, 1600.0], false)] {
        let (mut harness, _) = window("spcmm", size);
        harness.run();
        click(&mut harness, "Menu");
        harness.remove_cursor();
        harness.run();
        let about = harness.get_by_label("About").rect();
        assert_eq!(about.bottom() > size[1], truncated, "{size:?}: {about:?}");
        let rows = bar_rows(&mut harness);
        assert_eq!(rows > 60, truncated, "{size:?}: {rows} rows");
    }
}

#[test]
fn a_menu_that_is_longer_than_the_screen_scrolls_under_a_finger() {
    let (mut harness, _) = window("spcmm", LANDSCAPE);
    harness.run();
    click(&mut harness, "Menu");
    harness.run();
    let about = rect(&harness, Role::Button, "About");
    assert!(about.top() > LANDSCAPE[1], "{about:?}");
    let at = rect(&harness, Role::Button, "Picture…").center();
    for _ in 0..12 {
        fingers(&mut harness, &[&path(at, vec2(0.0, -120.0))]);
    }
    harness.run();
    let about = rect(&harness, Role::Button, "About");
    assert!(about.bottom() <= LANDSCAPE[1], "{about:?}");
    // A tap selects the visible entry.
    fingers(&mut harness, &[&[about.center()]]);
    harness.run();
    assert!(label(&harness, "State hash"));
}

#[test]
fn the_first_gesture_of_a_finger_scrolls() {
    for size in [PORTRAIT, [1024.0, 700.0]] {
        let top_after = |offset: egui::Vec2| {
            let (mut harness, _) = window("spcmm", size);
            harness.run();
            if size != PORTRAIT {
                // More than fits, so that there is something to scroll.
                click(&mut harness, "Accuracy");
                click(&mut harness, "One joint");
            }
            let before = rect(&harness, Role::Slider, "Friction coefficient");
            // Beside a name, where nothing but the panel is under the finger.
            let from = egui::pos2(before.right() - 130.0, before.top() - 6.0);
            fingers(&mut harness, &[&path(from, offset)]);
            harness.run();
            rect(&harness, Role::Slider, "Friction coefficient").top()
        };
        // A touch alone sizes the controls for fingers.
        let moved = top_after(egui::Vec2::ZERO) - top_after(vec2(2.0, -80.0));
        assert!(moved > 50.0, "{size:?}: scrolled by {moved}");
    }
}

#[test]
fn controls_and_bench_keep_their_scroll_positions() {
    let (mut harness, _) = window("spcmm", PORTRAIT);
    harness.run();
    let top = |harness: &Harness<'_, App>| rect(harness, Role::Slider, "Clearance").top();
    let first = top(&harness);
    let from = egui::pos2(300.0, rect(&harness, Role::Slider, "Restitution").top() - 6.0);
    fingers(&mut harness, &[&path(from, vec2(0.0, -70.0))]);
    harness.run();
    let scrolled = top(&harness);
    assert!(first - scrolled > 40.0, "{first} {scrolled}");
    click(&mut harness, "Experiments");
    harness.run();
    let bench = rect(&harness, Role::Button, "What play costs").top();
    assert!(bench > scrolled, "the bench begins at its top: {bench}");
    click(&mut harness, "Controls");
    harness.run();
    assert_eq!(top(&harness), scrolled);
}

#[test]
fn a_pinch_on_the_controls_enlarges_the_type() {
    let (mut harness, _) = window("spcmm", [1024.0, 900.0]);
    harness.run();
    let at = rect(&harness, Role::Slider, "Friction coefficient").center();
    let before = clearance(&harness);
    let zoom = harness.ctx.zoom_factor();
    let [left, right] = [-1.0, 1.0]
        .map(|side: f32| (0..=20).map(|k| at + vec2(side * (30.0 + 2.0 * k as f32), 0.0)).collect::<Vec<Pos2>>());
    fingers(&mut harness, &[&left, &right]);
    harness.run();
    // From 30 to 70 points beside the middle, in steps of a tenth; the frames after a step do not count.
    let enlarged = harness.ctx.zoom_factor() / zoom;
    assert!(enlarged > 1.2 && enlarged < 70.0 / 30.0, "{enlarged}");
    assert_eq!(clearance(&harness), before);
}

#[test]
fn in_a_lesson_on_a_phone_the_circle_is_whole_and_all_answers_are_in_sight() {
    for step in [2, 4] {
        let link = format!("?lesson=first-impact&step={step}");
        let (mut harness, _) = open(AppOptions::from_link(&link).expect("a link"), PORTRAIT);
        harness.run_steps(40);
        if let Some(keep) = std::env::var_os("KEEP_PICTURES") {
            let image = harness.render().expect("drawn");
            image.save(std::path::Path::new(&keep).join(format!("lesson_phone_{step}.png"))).expect("writable");
        }
        let next = rect(&harness, Role::Button, "Next");
        let answers: Vec<Rect> = harness.query_all_by_role(Role::RadioButton).map(|node| node.rect()).collect();
        assert!(answers.len() > 1);
        for answer in &answers {
            assert!(answer.height() >= 44.0 && answer.bottom() <= next.top() + 1.0, "{answer:?} {next:?}");
        }
        let circle = harness.state().microscope().circle().expect("a microscope");
        let edge = circle.radius * egui::Vec2::splat(1.0);
        let whole = Rect::from_center_size(circle.centre, 2.0 * edge);
        let view = harness.get_by_label("3D view").rect();
        let top = rect(&harness, Role::Slider, "Timeline, s").top();
        assert!(whole.left() >= 0.0 && whole.right() <= PORTRAIT[0] && whole.bottom() <= top, "{whole:?}");
        assert!(whole.top() >= view.bottom() || whole.left() >= view.right(), "{whole:?} {view:?}");
        assert!(circle.radius >= 60.0, "{}", circle.radius);
    }
}
