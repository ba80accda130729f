//! Runs kept from before a change: their curves in the plots, and their machine side by side with the current one.

use eframe::egui::{self, Rect, Theme, accesskit::Role};
use egui_kittest::{Harness, kittest::Queryable as _};
use jointplay::app::{App, Player};
use jointplay::simulate::Bin;

use crate::hands::plain;
use crate::window::click;
use crate::window::pixels::{Area, Picture};

fn window() -> Harness<'static, App> {
    let mut harness = plain("slider-crank", &[], [1280.0, 800.0], Theme::Dark);
    harness.state_mut().run_to(0.02);
    harness.run_steps(2);
    harness
}

/// Sets a slider and waits until the next change counts as a separate one.
fn set(harness: &mut Harness<'_, App>, slider: &str, value: f64) {
    harness.get_by_role_and_label(Role::Slider, slider).set_value_accesskit(value);
    harness.run_steps(45);
}

fn names(harness: &Harness<'_, App>) -> Vec<String> {
    harness.state().comparison().kept().iter().map(|kept| kept.name()).collect()
}

fn force(player: &Player, from: f64, to: f64) -> Vec<Bin> {
    let channel = player.channels().normal_force(0).expect("has a joint");
    let mut bins = Vec::new();
    player.bins(channel, from, to, 2000, &mut bins);
    bins
}

/// The window's pixels.
fn window_picture(harness: &mut Harness<'_, App>) -> Picture {
    let picture = harness.render().expect("draws");
    Picture::new(picture.width(), picture.into_raw())
}

/// Colour levels by which pixels of the same picture differ at another position in the window.
const DITHER: u8 = 10;

/// Pixels of a rectangle.
fn area(rect: Rect) -> Area {
    [rect.left(), rect.top(), rect.right(), rect.bottom()].map(|edge| edge.round() as usize)
}

/// Number of pixels in an area of `one` that differ by more than the dither from those of `other` that are `by` columns further
/// right.
fn count_differing(one: &Picture, other: &Picture, [left, top, right, bottom]: Area, by: usize) -> usize {
    let pixels = (top..bottom).flat_map(|y| (left..right).map(move |x| (x, y)));
    let differs = |x, y| one.at(x, y).iter().zip(other.at(x + by, y)).any(|(a, b)| a.abs_diff(b) > DITHER);
    pixels.filter(|(x, y)| differs(*x, *y)).count()
}

#[test]
fn the_grey_curves_continue_the_run_without_the_change() {
    let mut harness = window();
    set(&mut harness, "Clearance", 0.9);
    assert_eq!(names(&harness), ["Clearance: 0.3 mm"]);
    harness.state_mut().run_to(0.05);
    harness.run_steps(200);
    let app = harness.state();
    let kept = &app.comparison().kept()[0];
    let mut other = Player::new(app.player().running()).expect("starts");
    other.set("contact.clearance", "0.3 mm").expect("is allowed");
    other.reset().expect("starts");
    other.run_to(0.02);
    other.run_to(0.05);
    let expected = force(&other, 0.02, 0.05);
    assert!(expected.len() > 100 && expected.iter().any(|bin| bin.greatest > 0.0));
    assert_eq!(force(kept.run(), 0.02, 0.05), expected);
    assert_ne!(force(app.player(), 0.02, 0.05), expected);
    // They are drawn in every plot of curves unless hidden.
    let plots = ["Normal force", "Acceleration"].map(|plot| harness.get_by_label(&format!("Plot of {plot}")).rect());
    let with_grey = window_picture(&mut harness);
    harness.get_by_label("— Clearance: 0.3 mm in Normal force").click();
    harness.run_steps(3);
    let without_grey = window_picture(&mut harness);
    for plot in plots {
        let changed = count_differing(&with_grey, &without_grey, area(plot), 0);
        assert!(changed > 50, "{changed}");
    }
}

#[test]
fn of_many_changes_the_latest_and_three_pinned_runs_stay() {
    let mut harness = window();
    // A drag counts as one change.
    let track = harness.get_by_role_and_label(Role::Slider, "Clearance").rect();
    harness.drag_at(track.left_center() + egui::vec2(12.0, 0.0));
    for part in 1..4 {
        harness.hover_at(track.left_center() + egui::vec2(12.0 + 20.0 * part as f32, 0.0));
        harness.run_steps(40);
    }
    harness.drop_at(track.left_center() + egui::vec2(72.0, 0.0));
    harness.run_steps(45);
    assert_eq!(names(&harness), ["Clearance: 0.3 mm"]);
    click(&mut harness, "Before and after (1)");
    for (pinned, clearance) in [0.2, 0.4, 0.6, 0.8].into_iter().enumerate() {
        let pins: Vec<_> = harness.get_all_by_role_and_label(Role::Button, "Pin").collect();
        assert_eq!(pins.len(), pinned + 1);
        pins[0].click();
        harness.run_steps(3);
        set(&mut harness, "Clearance", clearance);
    }
    assert_eq!(names(&harness).len(), 4, "the fourth is not pinned: the next change replaces it");
    assert_eq!(names(&harness)[0], "Clearance: 0.6 mm");
    assert_eq!(names(&harness)[1..], ["Clearance: 0.2 mm", "Clearance: 0.26 mm", "Clearance: 0.3 mm"]);
}

#[test]
fn a_change_of_another_parameter_counts_separately_even_if_immediate() {
    let mut harness = window();
    for (slider, value, before) in
        [("Clearance", 0.9, "Clearance: 0.3 mm"), ("Friction coefficient", 0.4, "Friction coefficient: 0.15")]
    {
        harness.get_by_role_and_label(Role::Slider, slider).set_value_accesskit(value);
        harness.run_steps(3);
        assert_eq!(names(&harness), [before]);
    }
    let kept = harness.state().comparison().kept()[0].run();
    assert_eq!(kept.running().machine.contact.clearance, 9e-4);
}

#[test]
fn a_reset_keeps_the_record_of_a_run_that_was_never_changed() {
    let mut harness = window();
    set(&mut harness, "Clearance", 0.9);
    harness.state_mut().reset();
    harness.run_steps(3);
    let app = harness.state();
    assert_eq!(app.player().pacer.shown(), 0.0);
    let kept = app.comparison().kept()[0].run();
    assert!(kept.reached() >= 0.02 && force(kept, 0.0, 0.02).len() > 100);
    assert_eq!(kept.running().machine.contact.clearance, 3e-4);
    // A run with live changes restarts with its latest values.
    harness.state_mut().run_to(0.01);
    set(&mut harness, "Clearance", 0.7);
    harness.state_mut().run_to(0.02);
    set(&mut harness, "Clearance", 0.3);
    harness.state_mut().reset();
    harness.run_steps(3);
    let kept = harness.state().comparison().kept()[0].run();
    assert_eq!((kept.reached(), kept.running().machine.contact.clearance), (0.0, 7e-4));
}

#[test]
fn two_machines_with_the_same_parameters_have_the_same_picture() {
    let mut harness = window();
    set(&mut harness, "Clearance", 0.9);
    click(&mut harness, "Before and after (1)");
    click(&mut harness, "Pin");
    click(&mut harness, "Side by side");
    click(&mut harness, "Before and after (1)");
    let before = harness.get_by_label("3D view before the change").rect();
    let now = harness.get_by_label("3D view").rect();
    assert_eq!(before.size(), now.size());
    // Excludes the time, the topmost name, buttons and messages.
    let middle = area(Rect::from_min_max(before.min + egui::vec2(1.0, 110.0), before.max - egui::vec2(1.0, 60.0)));
    let by = (now.left() - before.left()).round() as usize;
    harness.state_mut().run_to(0.05);
    harness.run_steps(200);
    let other = window_picture(&mut harness);
    assert!(count_differing(&other, &other, middle, by) > 100, "other clearances");
    // The same parameters again, from the start.
    set(&mut harness, "Clearance", 0.3);
    harness.state_mut().reset();
    harness.state_mut().run_to(0.06);
    harness.state_mut().show_instant(0.05);
    harness.run_steps(200);
    let app = harness.state();
    let kept = &app.comparison().kept()[1];
    assert_eq!(kept.name(), "Clearance: 0.3 mm");
    assert_eq!(kept.run().frame().time, app.player().frame().time);
    let same = window_picture(&mut harness);
    assert_eq!(count_differing(&same, &same, middle, by), 0);
    // Both views share one camera.
    let centre = before.center();
    harness.drag_at(centre);
    harness.hover_at(centre + egui::vec2(60.0, 20.0));
    harness.run_steps(2);
    harness.drop_at(centre + egui::vec2(60.0, 20.0));
    harness.run_steps(30);
    let rotated = window_picture(&mut harness);
    assert!(count_differing(&same, &rotated, middle, 0) > 1000, "the view did not rotate");
    assert_eq!(count_differing(&rotated, &rotated, middle, by), 0);
}

#[test]
fn the_current_machine_waits_for_the_one_before_the_change() {
    let mut harness = window();
    set(&mut harness, "Clearance", 0.9);
    // The current run is far ahead.
    harness.state_mut().run_to(0.3);
    click(&mut harness, "Before and after (1)");
    click(&mut harness, "Side by side");
    click(&mut harness, "Before and after (1)");
    let instants = |harness: &Harness<'_, App>| {
        let app = harness.state();
        [app.comparison().kept()[0].run().pacer.shown(), app.player().pacer.shown()]
    };
    harness.state_mut().player_mut().set_playing(true);
    let mut waited = 0;
    while instants(&harness)[0] < 0.3 {
        assert_eq!(instants(&harness)[1], 0.3, "the current run must wait");
        harness.step();
        waited += 1;
        assert!(waited < 5000);
    }
    harness.run_steps(30);
    let [before, now] = instants(&harness);
    assert!(now > 0.3 && (now - before).abs() < 0.05, "{before} {now}");
    click(&mut harness, "Close");
    assert!(harness.query_by_label("3D view before the change").is_none());
}
