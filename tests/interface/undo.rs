//! Undo and redo.

use eframe::egui::{self, Key, Modifiers, accesskit::Role};
use egui_kittest::{Harness, kittest::Queryable as _};
use jointplay::app::App;
use jointplay::scene::Value;
use jointplay::simulate::Quantity;

use crate::hands::window::{click, sized};

fn window() -> Harness<'static, App> {
    sized("spcmm", [1280.0, 800.0], egui::Theme::Light)
}

fn friction(harness: &Harness<'_, App>) -> f64 {
    harness.state().player().pending().machine.contact.friction
}

fn clearance(harness: &Harness<'_, App>) -> f64 {
    harness.state().player().pending().machine.contact.clearance
}

fn press(harness: &mut Harness<'_, App>, modifiers: Modifiers) {
    harness.key_press_modifiers(modifiers, Key::Z);
    harness.run_steps(3);
}

const UNDO: Modifiers = Modifiers::COMMAND;

fn redo() -> Modifiers {
    Modifiers::COMMAND | Modifiers::SHIFT
}

#[test]
fn a_drag_on_a_slider_is_undone_and_redone_as_one_change() {
    let mut harness = window();
    assert_eq!(harness.state().undo_words(false), None);
    let first = friction(&harness);
    let track = harness.get_by_role_and_label(Role::Slider, "Friction coefficient").rect();
    harness.drag_at(track.left_center() + egui::vec2(12.0, 0.0));
    for part in 1..10 {
        harness.hover_at(track.left_center() + egui::vec2(12.0 + 20.0 * part as f32, 0.0));
        // Slower than the interval within which changes are merged.
        harness.run_steps(40);
    }
    harness.drop_at(track.left_center() + egui::vec2(192.0, 0.0));
    harness.run_steps(3);
    let dragged = friction(&harness);
    assert!(dragged > first);
    let words = harness.state().undo_words(false).expect("a change to undo");
    assert_eq!(words, "Undo: Friction coefficient, to 0.15");
    press(&mut harness, UNDO);
    assert_eq!(friction(&harness), first);
    assert_eq!(harness.state().undo_words(false), None, "the drag was recorded as several changes");
    press(&mut harness, redo());
    assert_eq!(friction(&harness), dragged);
    // The buttons undo and redo as well.
    click(&mut harness, "Undo");
    assert_eq!(friction(&harness), first);
    click(&mut harness, "Redo");
    assert_eq!(friction(&harness), dragged);
}

#[test]
fn changes_are_undone_in_reverse_order_and_a_new_change_clears_redo() {
    let mut harness = window();
    harness.get_by_role_and_label(Role::Slider, "Clearance").set_value_accesskit(0.5);
    harness.run_steps(40);
    harness.get_by_role_and_label(Role::Slider, "Friction coefficient").set_value_accesskit(0.4);
    harness.run_steps(40);
    harness.get_by_role_and_label(Role::Slider, "Clearance").set_value_accesskit(0.6);
    harness.run_steps(40);
    press(&mut harness, UNDO);
    assert!((clearance(&harness) - 0.5e-3).abs() < 1e-9 && friction(&harness) == 0.4);
    press(&mut harness, UNDO);
    assert!((clearance(&harness) - 0.5e-3).abs() < 1e-9 && friction(&harness) == 0.15);
    press(&mut harness, UNDO);
    assert!((clearance(&harness) - 0.3e-3).abs() < 1e-9);
    press(&mut harness, UNDO);
    assert!((clearance(&harness) - 0.3e-3).abs() < 1e-9, "nothing left to undo");
    press(&mut harness, redo());
    assert!((clearance(&harness) - 0.5e-3).abs() < 1e-9);
    harness.get_by_role_and_label(Role::Slider, "Clearance").set_value_accesskit(0.4);
    harness.run_steps(3);
    assert_eq!(harness.state().undo_words(true), None);
    // Going back in time is not a change of parameters.
    let words = harness.state().undo_words(false);
    harness.state_mut().player_mut().run_to(20e-3);
    harness.run();
    harness.state_mut().player_mut().go_to(0.0);
    harness.run_steps(3);
    assert_eq!(harness.state().undo_words(false), words);
}

#[test]
fn the_camera_has_its_own_undo_apart_from_parameters_and_plots() {
    let mut harness = window();
    harness.run_steps(60);
    let pose = harness.state().camera_pose().expect("drawn");
    harness.key_press(Key::Num4);
    harness.run_steps(90);
    let rotated = harness.state().camera_pose().expect("drawn");
    assert!((rotated.pitch - pose.pitch).abs() > 0.1);
    assert_eq!(harness.state().undo_words(false), None);
    harness.key_press(Key::X);
    harness.run_steps(60);
    assert_eq!(harness.state().undo_words(false).as_deref(), Some("Undo: Magnification of the play"));
    harness.state_mut().plots_mut().chosen.push(Quantity::TipError);
    harness.run_steps(3);
    assert_eq!(harness.state().undo_words(false).as_deref(), Some("Undo: Choice of plots"));
    let is_at = |harness: &Harness<'_, App>, pose: &jointplay::app::CameraPose| {
        let now = harness.state().camera_pose().expect("drawn");
        (now.pitch - pose.pitch).abs() < 1e-3 && (now.yaw - pose.yaw).abs() < 1e-3
    };
    press(&mut harness, UNDO);
    assert_eq!(harness.state_mut().plots_mut().chosen.len(), 2);
    press(&mut harness, UNDO);
    harness.run_steps(60);
    assert!(is_at(&harness, &rotated), "undo turned the camera");
    assert_eq!(harness.state().undo_words(false), None);
    harness.key_press(Key::Z);
    harness.run_steps(60);
    assert!(is_at(&harness, &pose));
    harness.key_press(Key::Y);
    harness.run_steps(60);
    assert!(is_at(&harness, &rotated));
    // The same from the menu.
    click(&mut harness, "View options");
    click(&mut harness, "Previous view");
    harness.run_steps(60);
    assert!(is_at(&harness, &pose));
    // Redo of the plots is not lost by turning the camera.
    press(&mut harness, redo());
    press(&mut harness, redo());
    assert_eq!(harness.state_mut().plots_mut().chosen.len(), 3);
}

#[test]
fn another_scene_has_nothing_to_undo() {
    let mut harness = window();
    harness.get_by_role_and_label(Role::Slider, "Clearance").set_value_accesskit(0.5);
    harness.run_steps(3);
    assert!(harness.state().undo_words(false).is_some());
    harness.state_mut().open("pendulum").expect("opens");
    harness.run_steps(3);
    assert_eq!(harness.state().undo_words(false), None);
}

#[test]
fn undo_returns_a_value_to_what_it_followed() {
    let mut harness = window();
    let set = |harness: &mut Harness<'_, App>, key: &str, value: &str| {
        harness.state_mut().player_mut().set(key, value).expect("allowed");
        harness.run_steps(45);
    };
    let clearances = |harness: &Harness<'_, App>| -> Vec<f64> {
        let joints = &harness.state().player().pending().machine.loose_joints;
        joints.iter().map(|joint| joint.contact.clearance).collect()
    };
    // The file has 0.3 mm for all joints.
    set(&mut harness, "contact.clearance", "0.5 mm");
    for own in ["0.3 mm", "0.7 mm"] {
        set(&mut harness, "joint.S1.clearance", own);
        assert!(clearances(&harness)[0] != 5e-4 && clearances(&harness)[1..].iter().all(|other| *other == 5e-4));
        let words = harness.state().undo_words(false).expect("a change");
        assert!(words.ends_with("to 0.5 mm"), "{words}");
        assert_eq!(harness.state().player().original("joint.S1.clearance"), Some(Value::Number(5e-4)));
        press(&mut harness, UNDO);
        assert!(clearances(&harness).iter().all(|all| *all == 5e-4), "{:?}", clearances(&harness));
    }
    // It follows the common value again.
    set(&mut harness, "contact.clearance", "0.6 mm");
    assert!(clearances(&harness).iter().all(|all| *all == 6e-4), "{:?}", clearances(&harness));

    // A tolerance takes the place of a preset, and gives it back.
    let tolerance = |harness: &Harness<'_, App>| harness.state().player().pending().machine.solver.tolerance;
    set(&mut harness, "solver.preset", "reference");
    let preset = tolerance(&harness);
    let changes = |harness: &Harness<'_, App>| harness.state().player().pending().changes.clone();
    let with_preset = changes(&harness);
    set(&mut harness, "solver.tolerance", "1e-4");
    let with_tolerance = changes(&harness);
    assert_ne!(tolerance(&harness), preset);
    let words = harness.state().undo_words(false).expect("a change");
    assert!(words.starts_with("Undo: Tolerance"), "{words}");
    press(&mut harness, UNDO);
    assert_eq!((tolerance(&harness), changes(&harness)), (preset, with_preset.clone()));
    press(&mut harness, redo());
    assert_eq!(changes(&harness), with_tolerance);
    set(&mut harness, "solver.preset", "reference");
    let words = harness.state().undo_words(false).expect("a change");
    assert!(words.starts_with("Undo: Preset"), "{words}");
    assert_eq!(changes(&harness), with_preset);
    press(&mut harness, UNDO);
    let (mut restored, mut expected) = (changes(&harness), with_tolerance);
    restored.sort();
    expected.sort();
    assert_eq!(restored, expected);

    // A drag that begins on the preset is one change.
    set(&mut harness, "solver.preset", "reference");
    for dragged in ["1e-6", "1e-5", "1e-4"] {
        harness.state_mut().player_mut().set("solver.tolerance", dragged).expect("in range");
        harness.run_steps(1);
    }
    press(&mut harness, UNDO);
    assert_eq!((tolerance(&harness), changes(&harness)), (preset, with_preset));
}
