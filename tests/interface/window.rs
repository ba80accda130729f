//! The window, operated by role and label as by a user with a screen reader.

use crate::golden;
use crate::hands::{compare_window, plain, type_over};
use eframe::egui::{self, Key, accesskit::Role};
use egui_kittest::{
    Harness,
    kittest::{NodeT as _, Queryable as _},
};
use jointplay::app::{App, AppOptions};
use jointplay::scene::{BUILT_IN, Scene};
use jointplay::simulate::Quantity;

use crate::hands::window::{CURVES, WHITE, click, picture, shown, sized, window};
use crate::pixels::top;

fn time(harness: &Harness<'_, App>) -> f64 {
    harness.state().player().simulation().time()
}

fn clearance(harness: &Harness<'_, App>) -> f64 {
    harness.state().player().simulation().pending().machine.contact.clearance
}

/// Largest normal force since the reset, N.
fn peak_force(harness: &Harness<'_, App>) -> f64 {
    let statistics = harness.state().player().simulation().statistics();
    statistics.joints.iter().map(|joint| joint.peak_normal).fold(0.0, f64::max)
}

/// Replaces the content of a text field and presses Enter.
fn type_into(harness: &mut Harness<'_, App>, label: &str, text: &str) {
    type_over(harness, label, text);
    harness.key_press(Key::Enter);
    harness.step();
    harness.step();
}

#[test]
fn the_clearance_slider_changes_when_the_balls_hit() {
    // A free fall through 0.3 mm takes 7.8 ms, through 0.5 mm 10.1 ms.
    let mut harness = window("spcmm");
    harness.state_mut().player_mut().run_to(9.0e-3);
    assert!(peak_force(&harness) > 100.0, "at 0.3 mm all three joints have been hit by 9 ms");

    let slider = harness.get_by_role_and_label(Role::Slider, "Clearance");
    assert!((slider.accesskit_node().numeric_value().expect("a slider has a value") - 0.3).abs() < 1e-9);
    slider.set_value_accesskit(0.5);
    harness.run();
    assert!((clearance(&harness) - 0.5e-3).abs() < 1e-12);

    click(&mut harness, "Restart");
    assert_eq!(time(&harness), 0.0);
    harness.state_mut().player_mut().run_to(9.0e-3);
    assert!(peak_force(&harness) < 1.0, "at 0.5 mm nothing has been hit by 9 ms");
    harness.state_mut().player_mut().run_to(12.0e-3);
    assert!(peak_force(&harness) > 100.0);
}

#[test]
fn a_live_change_of_clearance_reaches_the_running_joints() {
    let mut harness = window("spcmm");
    harness.get_by_role_and_label(Role::Slider, "Clearance").set_value_accesskit(0.6);
    harness.run();
    harness.state_mut().player_mut().run_to(0.1);
    for joint in &harness.state().player().frame().joints {
        assert!((joint.clearance - 0.6e-3).abs() < 1e-9, "{}", joint.clearance);
    }
}

#[test]
fn a_drag_on_the_friction_slider_moves_friction() {
    let mut harness = window("spcmm");
    let before = harness.state().player().simulation().pending().machine.contact.friction;
    let track = harness.get_by_role_and_label(Role::Slider, "Friction coefficient").rect();
    harness.drag_at(track.left_center() + egui::vec2(12.0, 0.0));
    harness.step();
    harness.hover_at(track.right_center() - egui::vec2(4.0, 0.0));
    harness.step();
    harness.drop_at(track.right_center() - egui::vec2(4.0, 0.0));
    harness.run();
    let after = harness.state().player().simulation().pending().machine.contact.friction;
    assert!(after > before, "{before} to {after}");
}

#[test]
fn a_typed_value_takes_any_unit_and_a_bad_one_stays_for_correction() {
    let mut harness = window("spcmm");
    type_into(&mut harness, "Clearance", "500 um");
    assert!((clearance(&harness) - 0.5e-3).abs() < 1e-12);
    type_into(&mut harness, "Clearance", "0.4");
    assert!((clearance(&harness) - 0.4e-3).abs() < 1e-12, "a bare number takes the unit on show");

    type_into(&mut harness, "Clearance", "0.4 kg");
    assert!((clearance(&harness) - 0.4e-3).abs() < 1e-12, "the running value stays");
    let field = harness.get_by_role_and_label(Role::TextInput, "Clearance");
    assert_eq!(field.value().as_deref(), Some("0.4 kg"), "the typed text is not lost");
    harness.get_by_label_contains("wrong unit");

    type_into(&mut harness, "Clearance", "0.2 mm");
    assert!((clearance(&harness) - 0.2e-3).abs() < 1e-12);
    assert!(harness.query_by_label_contains("wrong unit").is_none(), "the message goes once the value is corrected");

    click(&mut harness, "Reset Clearance");
    assert!((clearance(&harness) - 0.3e-3).abs() < 1e-12, "back to the scene's own value");
}

#[test]
fn play_pause_and_the_space_bar() {
    let mut harness = window("spcmm");
    assert_eq!(time(&harness), 0.0);
    click(&mut harness, "Play");
    harness.run_steps(20);
    assert!(harness.state().player().is_playing());
    let playing = shown(&harness);
    assert!(playing > 0.0);

    click(&mut harness, "Pause");
    let paused = shown(&harness);
    harness.run_steps(10);
    assert_eq!(shown(&harness), paused, "time advanced while paused");

    harness.key_press(Key::Space);
    harness.step();
    assert!(harness.state().player().is_playing());
    harness.key_press(Key::Space);
    harness.step();
    assert!(!harness.state().player().is_playing());
}

#[test]
fn a_single_step_is_one_step_of_the_solver() {
    let mut harness = window("spcmm");
    for expected in 1..=3 {
        click(&mut harness, "Step");
        assert_eq!(harness.state().player().simulation().statistics().steps, expected);
        assert_eq!(shown(&harness), time(&harness));
    }
    harness.key_press(Key::ArrowRight);
    harness.step();
    assert_eq!(harness.state().player().simulation().statistics().steps, 4);
}

#[test]
fn a_reset_restores_the_same_bits() {
    let mut harness = window("spcmm");
    let start = harness.state().player().simulation().state_hash();
    harness.state_mut().player_mut().run_to(10.0e-3);
    assert_ne!(harness.state().player().simulation().state_hash(), start);
    harness.key_press(Key::R);
    harness.run();
    assert_eq!(harness.state().player().simulation().state_hash(), start);
    assert_eq!(shown(&harness), 0.0);
}

#[test]
fn the_time_scale_sets_how_fast_simulated_time_passes() {
    let mut harness = window("spcmm");
    harness.get_by_role_and_label(Role::Slider, "Time scale").set_value_accesskit(1e-3);
    harness.step();
    click(&mut harness, "Play");
    let before = shown(&harness);
    harness.run_steps(30);
    let passed = shown(&harness) - before;
    assert!((passed - 30.0 / 60.0 * 1e-3).abs() < 1e-9, "{passed}");

    harness.key_press(Key::Minus);
    harness.step();
    assert!((harness.state().player().pacer.scale() - 1e-4).abs() < 1e-12);
    harness.key_press(Key::ArrowUp);
    harness.step();
    assert!((harness.state().player().pacer.scale() - 1e-3).abs() < 1e-12);
}

#[test]
fn slow_motion_moves_in_every_frame_within_one_step() {
    let mut harness = window("spcmm");
    harness.state_mut().player_mut().run_to(7.85e-3);
    harness.state_mut().player_mut().pacer.set_scale(1e-4);
    harness.state_mut().player_mut().set_playing(true);
    let mut last = harness.state().player().frame().pose.position;
    let mut distinct = 0;
    for _ in 0..30 {
        harness.step();
        let now = harness.state().player().frame().pose.position;
        distinct += usize::from(now != last);
        last = now;
    }
    assert!(distinct >= 29, "{distinct} of 30 frames moved");
}

#[test]
fn the_question_mark_lists_the_keys_and_escape_closes() {
    let mut harness = window("pendulum");
    harness.key_press(Key::Questionmark);
    harness.run();
    harness.get_by_label("Play or pause");
    // While the list is open, keys do not reach the machine.
    harness.key_press(Key::Space);
    harness.step();
    assert!(!harness.state().player().is_playing());
    harness.key_press(Key::Escape);
    harness.run();
    assert!(harness.query_by_label("Play or pause").is_none());
}

#[test]
fn the_whole_list_of_keys_is_visible() {
    for size in [[1280.0, 800.0], [1920.0, 1080.0]] {
        let mut harness = sized("pendulum", size, egui::Theme::Light);
        harness.key_press(Key::Questionmark);
        harness.run();
        let dialog = egui::Rect::from_min_size(egui::Pos2::ZERO, size.into());
        let bottom = harness.get_by_role_and_label(Role::Button, "Close").rect().top();
        for words in [
            "Play or pause",
            "Faster",
            "Force arrows on or off",
            "This list",
            "Open a link",
            "Move that slider by one step, by ten, to its ends",
        ] {
            let row = harness.get_by_label(words).rect();
            assert!(dialog.contains_rect(row) && row.bottom() <= bottom, "{size:?}: {words} at {row}");
        }
    }
}

#[test]
fn switches_in_the_header_show_and_hide_the_panels() {
    for size in [[780.0, 700.0], [1280.0, 800.0]] {
        let mut harness = sized("pendulum", size, egui::Theme::Light);
        for (switch, inside) in
            [("Controls", "Accuracy"), ("Plots", "Normal force, N"), ("Experiments", "Order or chaos")]
        {
            let shown = |harness: &Harness<'_, App>| harness.query_by_label(inside).is_some();
            let before = shown(&harness);
            for on in [!before, before] {
                let place = harness.get_by_role_and_label(Role::Button, switch).rect();
                assert!(place.right() < size[0], "{switch} at {place}");
                click(&mut harness, switch);
                harness.run();
                assert_eq!(shown(&harness), on, "{switch}");
            }
        }
    }
}

#[test]
fn the_list_of_scenes_describes_each_scene() {
    let mut harness = window("pendulum");
    harness.get_by_role_and_label(Role::ComboBox, "Scene").click();
    harness.run();
    for name in BUILT_IN {
        let scene = Scene::load(name, &[]).expect("built in");
        let entry = harness.get_by_role_and_label(Role::Button, name);
        assert_eq!(entry.accesskit_node().description().as_deref(), Some(&*scene.title));
    }
    harness.get_by_role_and_label(Role::Button, "chain").click();
    harness.run();
    assert_eq!(harness.state().player().running().name, "chain");
}

#[test]
fn another_scene_opens_and_a_bad_one_leaves_the_running_scene() {
    let mut harness = window("spcmm");
    harness.get_by_role_and_label(Role::ComboBox, "Scene").click();
    harness.run();
    harness.get_by_label("pendulum").click();
    harness.run();
    assert_eq!(harness.state().player().simulation().pending().name, "pendulum");

    click(&mut harness, "Open");
    click(&mut harness, "Link…");
    type_into(&mut harness, "Path", "missing/card.toml");
    harness.run();
    let why = harness.get_by_label_contains("missing/card.toml");
    // It is not taken for the name of a benchmark.
    assert!(!why.accesskit_node().value().or(why.accesskit_node().label()).expect("a text").contains("cardan"));
    assert_eq!(harness.state().player().simulation().pending().name, "pendulum");
}

#[test]
fn a_value_that_waits_for_the_reset_says_so() {
    let mut harness = window("spcmm");
    let frequency = |harness: &Harness<'_, App>| {
        harness
            .state()
            .player()
            .simulation()
            .pending()
            .machine
            .closed_form
            .as_ref()
            .expect("the paper's scene")
            .frequency
    };
    harness.state_mut().player_mut().run_to(1e-3);
    harness.state_mut().player_mut().set("spcmm.frequency", "0.4 Hz").expect("in range");
    let group = Scene::load("spcmm", &[])
        .expect("built in")
        .parameters()
        .iter()
        .find(|p| p.key == "spcmm.frequency")
        .expect("in the table")
        .group;
    harness.get_by_label(group).click();
    harness.run();
    harness.get_by_label_contains("Applies when the run starts again");
    click(&mut harness, "Restart");
    assert!(harness.query_by_label_contains("Applies when the run starts again").is_none());
    assert!((frequency(&harness) - 0.4).abs() < 1e-12);
}

#[test]
fn a_parameter_of_the_file_becomes_a_slider_and_applies_at_the_reset() {
    let text = include_str!("../../docs/scene-tutorial.md");
    let blocks = text.split("```toml\n").skip(1);
    let example = blocks
        .filter_map(|rest| rest.split("```").next())
        .find(|block| block.contains("name = \"my-crank\""))
        .expect("the machine of the guide");
    let mut harness = window("pendulum");
    let bytes = example.as_bytes().to_vec();
    harness.state_mut().open_bytes("my-crank.toml", bytes).expect("starts");
    harness.run();
    let length = |harness: &Harness<'_, App>| {
        let player = harness.state().player();
        player.simulation().pending().machine.loose_joints[0].carrier().point.x
    };
    // It is visible without opening a group.
    assert!(harness.query_all_by_label("Crank radius").count() > 1);
    harness.state_mut().player_mut().run_to(1e-3);
    type_into(&mut harness, "Crank radius", "30 mm");
    harness.run();
    harness.get_by_label_contains("Applies when the run starts again");
    click(&mut harness, "Restart");
    assert!((length(&harness) - 0.03).abs() < 1e-15);
    type_into(&mut harness, "Crank radius", "90 mm");
    harness.run();
    harness.get_by_label_contains("allowed 20 mm to 80 mm");
}

#[test]
fn a_warning_moves_no_control_and_its_remedy_removes_it() {
    let mut harness = window("spcmm");
    let place = |harness: &Harness<'_, App>| {
        [(Role::Slider, "Restitution"), (Role::TextInput, "Restitution"), (Role::Slider, "Friction coefficient")]
            .map(|(role, name)| harness.get_by_role_and_label(role, name).rect())
    };
    let before = place(&harness);
    assert!(harness.query_by_label_contains("in an undisturbed impact").is_none());
    harness.get_by_role_and_label(Role::Slider, "Restitution").set_value_accesskit(0.3);
    harness.run();
    assert_eq!(place(&harness), before);
    let law = |harness: &Harness<'_, App>| harness.state().player().pending().machine.contact.normal_law.word();
    assert_eq!(law(&harness), "lankarani-nikravesh");
    let sign = harness.get_by_label_contains("Restitution: S1, S2, S3: 0.3 is asked for");
    assert!(!sign.accesskit_node().label().expect("a label").contains("normal_law"));
    sign.click();
    harness.run();
    click(&mut harness, "Use the contact law gonthier");
    assert_eq!(law(&harness), "gonthier");
    assert!(harness.query_by_label_contains("in an undisturbed impact").is_none());
    assert_eq!(place(&harness), before);
}

#[test]
fn a_value_that_waits_offers_the_restart() {
    let mut harness = window("chain");
    harness.state_mut().player_mut().run_to(1e-3);
    harness.state_mut().player_mut().set("chain.links", "5").expect("in range");
    harness.run_steps(2);
    let links = |harness: &Harness<'_, App>| harness.state().player().running().machine.loose_joints.len();
    let before = links(&harness);
    let player = harness.state().player();
    let own = Scene::load("chain", &[]).expect("built in").parameters().into_iter().find(|p| p.key == "chain.links");
    let group = own.expect("a parameter").group;
    assert!(player.has_pending_changes());
    if harness.query_by_label_contains("Applies when the run starts again").is_none() {
        harness.get_by_label(group).click();
        harness.run();
    }
    harness.get_by_label_contains("Applies when the run starts again").click();
    harness.run();
    click(&mut harness, "Restart now");
    assert!(links(&harness) < before && !harness.state().player().has_pending_changes());
}

#[test]
fn a_clicked_value_is_selected_and_read_with_a_comma_or_a_unit() {
    let mut harness = window("spcmm");
    let clearance = |harness: &Harness<'_, App>| harness.state().player().pending().machine.contact.clearance;
    for (typed, expected) in
        [("0.8", 0.8e-3), ("0,7", 0.7e-3), ("0.6 mm", 0.6e-3), ("500 µm", 0.5e-3), ("0,25 mm", 0.25e-3)]
    {
        let entry = harness.get_by_role_and_label(Role::TextInput, "Clearance").rect().center();
        harness.drag_at(entry);
        harness.step();
        harness.drop_at(entry);
        harness.run();
        // Typed over the value, without deleting it first.
        harness.event(egui::Event::Text(typed.to_owned()));
        harness.run();
        harness.key_press(egui::Key::Enter);
        harness.run();
        assert!((clearance(&harness) - expected).abs() < 1e-12, "{typed}: {}", clearance(&harness));
    }
    // What may mean two things is refused, and the reason moves nothing.
    let below = harness.get_by_role_and_label(Role::Slider, "Friction coefficient").rect();
    type_into(&mut harness, "Clearance", "1,500");
    harness.run();
    harness.get_by_label_contains("decimal comma");
    assert_eq!(harness.get_by_role_and_label(Role::Slider, "Friction coefficient").rect(), below);
    assert!((clearance(&harness) - 0.25e-3).abs() < 1e-12);
}

#[test]
fn the_divergence_guard_explains_the_stop_and_a_reset_recovers() {
    let mut harness = window("spcmm");
    let player = harness.state_mut().player_mut();
    player.set("solver.method", "rk4").expect("a method");
    player.set("solver.step", "1 ms").expect("in range");
    player.run_to(0.5);
    assert!(player.stopped().is_some(), "steps ten times longer than an impact cannot hold");
    harness.run();
    harness.get_by_label_contains("Stopped at");
    harness.state_mut().player_mut().set("solver.step", "10 us").expect("in range");
    click(&mut harness, "Restart the run");
    harness.run();
    assert!(harness.query_by_label_contains("Stopped at").is_none());
    harness.state_mut().player_mut().run_to(9e-3);
    assert!(harness.state().player().stopped().is_none());
}

#[test]
fn a_narrow_window_keeps_the_controls_within_reach() {
    let mut harness = sized("spcmm", [420.0, 800.0], egui::Theme::Light);
    for label in ["Play", "Step", "Restart"] {
        let rect = harness.get_by_role_and_label(Role::Button, label).rect();
        assert!(rect.right() <= 420.0 && rect.bottom() <= 800.0, "{label}: {rect:?}");
    }
    let rect = harness.get_by_role_and_label(Role::Slider, "Clearance").rect();
    assert!(rect.right() <= 420.0 && rect.bottom() <= 800.0, "{rect:?}");
    harness.get_by_role_and_label(Role::Slider, "Clearance").set_value_accesskit(0.7);
    harness.run();
    assert!((clearance(&harness) - 0.7e-3).abs() < 1e-12);
}

#[test]
fn arrows_move_the_slider_that_was_dragged_and_step_again_after_a_click_elsewhere() {
    let mut harness = window("spcmm");
    let friction = |harness: &Harness<'_, App>| {
        let scene = harness.state().player().simulation().pending();
        scene.machine.contact.friction
    };
    let steps = |harness: &Harness<'_, App>| harness.state().player().steps();
    let track = harness.get_by_role_and_label(Role::Slider, "Friction coefficient").rect();
    harness.drag_at(track.center());
    harness.step();
    harness.drop_at(track.center());
    harness.run();
    let mut before = friction(&harness);
    for (key, sign) in [(Key::ArrowRight, 1.0), (Key::ArrowLeft, -1.0), (Key::ArrowUp, 1.0), (Key::ArrowDown, -1.0)] {
        harness.key_press(key);
        harness.run();
        let now = friction(&harness);
        assert!(sign * (now - before) > 0.0, "{key:?}: {before} to {now}");
        before = now;
    }
    assert_eq!(steps(&harness), 0, "the machine does not step");
    assert_eq!(harness.state().player().pacer.scale(), 0.02);
    // A slider has no use for the space bar.
    harness.key_press(Key::Space);
    harness.step();
    assert!(harness.state().player().is_playing());
    click(&mut harness, "Pause");
    let played = steps(&harness);
    harness.key_press(Key::ArrowRight);
    harness.run();
    assert_eq!((steps(&harness), friction(&harness)), (played + 1, before));
}

#[test]
fn shortcut_keys_are_ignored_while_a_field_is_edited() {
    let mut harness = window("spcmm");
    harness.get_by_role_and_label(Role::TextInput, "Clearance").focus();
    harness.step();
    harness.key_press(Key::Space);
    harness.key_press(Key::R);
    harness.step();
    assert!(!harness.state().player().is_playing());
}

#[test]
fn every_control_has_a_name() {
    let mut harness = window("spcmm");
    // Opens all groups of parameters.
    for group in ["One joint", "Contact", "Gravity", "Solver"] {
        if let Some(header) = harness.query_by_role_and_label(Role::Button, group) {
            header.click();
            harness.run();
        }
    }
    let nameless: Vec<Role> = harness
        .root()
        .children_recursive()
        .filter(|node| {
            let node = node.accesskit_node();
            matches!(
                node.role(),
                Role::Button | Role::Slider | Role::TextInput | Role::ComboBox | Role::CheckBox | Role::SpinButton
            ) && node.label().is_none_or(|label| label.trim().is_empty())
        })
        .map(|node| node.accesskit_node().role())
        .collect();
    assert!(nameless.is_empty(), "{nameless:?}");
}

#[test]
fn wide_and_narrow_windows_show_what_is_stored() {
    for (name, size, theme) in [
        ("wide_light", [1280.0, 800.0], egui::Theme::Light),
        ("wide_dark", [1280.0, 800.0], egui::Theme::Dark),
        ("narrow_light", [420.0, 800.0], egui::Theme::Light),
    ] {
        let mut harness = plain("spcmm", &[], size, theme);
        harness.state_mut().player_mut().run_to(7.85e-3);
        harness.run();
        compare_window(&mut harness, name);
    }
}

fn open_a_bad_file(h: &mut Harness<'_, App>) {
    let text = b"name = 'mine'\n[contact]\nclearance = 3\n".to_vec();
    h.state_mut().open_bytes("mine.toml", text).expect_err("needs a unit");
}

#[test]
#[ignore = "writes pictures to look at, to $JOINTPLAY_LOOK"]
fn look() {
    let Ok(folder) = std::env::var("JOINTPLAY_LOOK") else {
        return;
    };
    let save = |harness: &mut Harness<'_, App>, name: &str| {
        let image = harness.render().expect("drawn");
        let picture = golden::Picture::new([image.width(), image.height()], image.as_raw());
        picture.write(format!("{folder}/{name}.png").as_ref());
    };
    let mut h = sized("spcmm", [1280.0, 800.0], egui::Theme::Light);
    h.state_mut().player_mut().set_playing(true);
    h.run_steps(100);
    h.state_mut().player_mut().set_playing(false);
    h.run();
    save(&mut h, "played");
    h.key_press(Key::Num5);
    h.run();
    save(&mut h, "closeup");
    h.key_press(Key::Questionmark);
    h.run();
    save(&mut h, "keys");
    h.key_press(Key::Escape);
    h.run();
    for group in ["Contact", "Solver", "One joint"] {
        h.get_by_role_and_label(Role::DisclosureTriangle, group).click();
        h.run();
    }
    type_into(&mut h, "Clearance", "0.4 kg");
    h.get_by_role_and_label(Role::Slider, "Restitution").set_value_accesskit(0.3);
    h.state_mut().player_mut().set("spcmm.frequency", "0.4 Hz").expect("ok");
    h.run();
    save(&mut h, "groups");
    let mut h = sized("spcmm", [1280.0, 800.0], egui::Theme::Dark);
    h.state_mut().player_mut().pacer.set_scale(1.0);
    h.state_mut().player_mut().set_playing(true);
    h.run_steps(60);
    h.get_by_label("View options").click();
    h.run_steps(5);
    save(&mut h, "playing");
    let player = h.state_mut().player_mut();
    player.set("solver.method", "rk4").expect("a method");
    player.set("solver.step", "1 ms").expect("in range");
    player.run_to(2.5);
    h.run();
    save(&mut h, "stopped");
    open_a_bad_file(&mut h);
    h.get_by_role_and_label(Role::Button, "Save").click();
    h.run_steps(5);
    save(&mut h, "save_menu");
    let mut h = sized("slider-crank", [420.0, 800.0], egui::Theme::Dark);
    h.state_mut().player_mut().run_to(0.05);
    h.get_by_role_and_label(Role::Button, "Plots").click();
    h.run();
    save(&mut h, "narrow_dark");
    open_a_bad_file(&mut h);
    h.get_by_label("Menu").click();
    h.run_steps(5);
    save(&mut h, "narrow_menu");
}

#[test]
fn a_settled_run_is_reported_beside_the_picture_and_a_swinging_one_never() {
    let mut harness = window("spcmm");
    let player = harness.state_mut().player_mut();
    player.pacer.set_scale(1.0);
    player.run_to(9e-3);
    player.set_playing(true);
    harness.step();
    assert!(harness.query_by_label("No rattling. Press R to restart").is_none());

    // Stepping must not depend on the speed of this computer.
    harness.state_mut().player_mut().run_to(0.5);
    let control_rects = |harness: &Harness<'_, App>| {
        ["Step", "3D view", "Time scale preset"].map(|label| harness.get_by_label(label).rect())
    };
    harness.step();
    assert!(harness.query_by_label("No rattling. Press R to restart").is_none());
    let paused = control_rects(&harness);
    harness.state_mut().player_mut().set_playing(true);
    harness.step();
    let words = harness.get_by_label("No rattling. Press R to restart").rect();
    assert!(!words.intersects(harness.get_by_label("3D view").rect()));
    assert_eq!(control_rects(&harness), paused, "the layout does not shift for it");

    for (scene, times) in [("pendulum", [1.0, 2.0]), ("chain", [0.7, 1.0])] {
        let mut harness = window(scene);
        for time in times {
            harness.state_mut().player_mut().run_to(time);
            harness.state_mut().player_mut().set_playing(true);
            harness.step();
            assert!(harness.query_by_label("At rest. Press R to restart").is_none(), "{scene} swings at {time} s");
        }
    }
}

/// Pixels in the colour of normal forces, left of the legend in the 3D view.
fn count_orange_pixels(harness: &mut Harness<'_, App>) -> usize {
    let view = harness.get_by_label("3D view").rect();
    let picture = harness.render().expect("drawn");
    let mut count = 0;
    for y in view.top() as u32..view.bottom() as u32 {
        for x in view.left() as u32..(view.right() - 200.0) as u32 {
            let [r, g, b, _] = picture.get_pixel(x, y).0.map(u32::from);
            // Less yellow than a rod, less red than the probe and the X axis.
            let hue = (25..52).contains(&(100 * g / r.max(1))) && 100 * b < 25 * r;
            count += usize::from(r > 110 && hue);
        }
    }
    count
}

#[test]
fn arrows_show_forces_of_the_displayed_instant_and_peaks_are_marked_separately() {
    let mut harness = window("spcmm");
    harness.state_mut().player_mut().run_to(7.0e-3);
    harness.run();
    assert_eq!(count_orange_pixels(&mut harness), 0, "nothing has touched yet");
    harness.state_mut().player_mut().run_to(9.0e-3);
    harness.run();
    let player = harness.state().player();
    assert!(player.frame().joints.iter().all(|joint| joint.normal_force.norm() == 0.0));
    let marked = count_orange_pixels(&mut harness);
    assert!(marked > 100, "three joints were hit: {marked}");
    // The mark stays while the run is paused.
    harness.run_steps(120);
    assert_eq!(count_orange_pixels(&mut harness), marked);

    harness.get_by_label("View options").click();
    harness.run();
    harness.get_by_role_and_label(Role::CheckBox, "Peaks").click();
    harness.run();
    harness.key_press(Key::Escape);
    harness.run();
    assert_eq!(count_orange_pixels(&mut harness), 0, "no arrow without a force");
}

#[test]
fn the_wear_map_appears_with_its_scale_and_a_reset_clears_it() {
    let mut harness = window("spcmm");
    harness.state_mut().player_mut().run_to(9.0e-3);
    harness.run();
    // A colour of the scale that nothing else in the view has.
    let purple = |harness: &mut Harness<'_, App>| {
        let view = harness.get_by_label("3D view").rect();
        let low = harness.get_by_role_and_label(Role::Slider, "Timeline, s").rect().top();
        let area = [view.left(), view.top(), view.right(), low].map(|edge| edge as usize);
        picture(harness).coloured(area, [0x47, 0x2D, 0x7B], 12).len()
    };
    let choose = |harness: &mut Harness<'_, App>, name: &str| {
        click(harness, "View options");
        harness.get_by_role_and_label(Role::RadioButton, name).click();
        harness.run();
        harness.key_press(Key::Escape);
        harness.run();
    };
    assert_eq!(purple(&mut harness), 0);
    for name in ["Wear map: Impulse", "Wear map: Friction work"] {
        choose(&mut harness, name);
        let count = purple(&mut harness);
        assert!(count > 30, "{name}: {count}");
    }
    click(&mut harness, "Restart");
    harness.run();
    assert_eq!(purple(&mut harness), 0, "nothing has touched yet");
    harness.state_mut().player_mut().run_to(9.0e-3);
    harness.run();
    assert!(purple(&mut harness) > 30);
    choose(&mut harness, "Wear map: Off");
    assert_eq!(purple(&mut harness), 0);
}

#[test]
fn after_a_reset_or_a_step_back_no_future_force_is_displayed() {
    let mut harness = window("spcmm");
    harness.state_mut().player_mut().run_to(9.0e-3);
    harness.run();
    assert!(count_orange_pixels(&mut harness) > 100);
    harness.key_press(Key::R);
    harness.run();
    assert_eq!(count_orange_pixels(&mut harness), 0);

    harness.state_mut().player_mut().run_to(7.79e-3);
    harness.run();
    let mut steps = 0;
    while peak_force(&harness) < 400.0 {
        harness.key_press(Key::ArrowRight);
        harness.step();
        steps += 1;
        assert!(steps < 64);
    }
    assert!(count_orange_pixels(&mut harness) > 100);
    for _ in 0..steps {
        harness.key_press(Key::ArrowLeft);
        harness.step();
    }
    harness.run();
    assert!(peak_force(&harness) < 1.0);
    assert_eq!(count_orange_pixels(&mut harness), 0);
}

#[test]
fn the_tooltip_of_restitution_states_the_law_in_use() {
    let mut harness = window("spcmm");
    for (law, formula, from) in [
        ("lankarani-nikravesh", "(1 + ¾ (1 - e²) d' / d'0)", "Sheng & Chen (2024), eq. 19"),
        ("gonthier", "χ (1 + e) = ln((1 + χ) / (1 - e χ))", "Gonthier et al. (2004)"),
    ] {
        harness.state_mut().player_mut().set("contact.normal_law", law).expect("a law");
        let slider = harness.get_by_role_and_label(Role::Slider, "Restitution").rect();
        harness.hover_at(slider.center());
        harness.run_steps(60);
        harness.get_by_label_contains(formula);
        harness.get_by_label(from);
        if let Some(keep) = std::env::var_os("KEEP_PICTURES") {
            let path = std::path::Path::new(&keep).join(format!("tooltip-{law}.png"));
            harness.render().expect("drawn").save(path).expect("writable");
        }
        harness.hover_at(egui::pos2(800.0, 300.0));
        harness.run_steps(30);
    }
}

#[test]
fn a_tooltip_of_a_control_does_not_cover_the_picture_and_closes_for_a_dialog() {
    let mut harness = window("spcmm");
    let slider = harness.get_by_role_and_label(Role::Slider, "Clearance").rect();
    harness.hover_at(slider.center());
    harness.run_steps(60);
    let tooltip_rect =
        |harness: &Harness<'_, App>| harness.query_by_label_contains("Key contact.clearance").map(|label| label.rect());
    let tooltip = tooltip_rect(&harness).expect("a tooltip");
    let view = harness.get_by_label("3D view").rect();
    assert!(tooltip.right() < view.left(), "{tooltip:?} over {view:?}");
    assert!(tooltip.top() > slider.bottom(), "{tooltip:?} over {slider:?}");
    harness.key_press(Key::Questionmark);
    harness.run_steps(10);
    harness.get_by_label("Play or pause");
    assert!(tooltip_rect(&harness).is_none(), "it stays open over the list of keys");
}

#[test]
fn the_left_arrow_takes_a_single_step_back() {
    let mut harness = window("spcmm");
    harness.state_mut().player_mut().set_playing(false);
    harness.run();
    let start = time(&harness);
    harness.key_press(Key::ArrowRight);
    harness.run();
    assert!(time(&harness) > start);
    harness.key_press(Key::ArrowLeft);
    harness.run();
    assert_eq!(time(&harness), start);
}

#[test]
fn hovering_names_a_part_and_a_double_click_follows_it() {
    let mut harness = window("spcmm");
    // The middle of the platform, in the isometric view that the window starts with.
    let platform = crate::lecture::platform(&harness);
    harness.hover_at(platform);
    harness.run_steps(60);
    harness.get_by_label("Double-click to follow");
    harness.get_by_label_contains("Angular speed");

    for _ in 0..2 {
        harness.drag_at(platform);
        harness.drop_at(platform);
        harness.step();
    }
    harness.remove_cursor();
    harness.run();
    harness.get_by_label("View options").click();
    harness.run();
    harness.get_by_label("Stop following").click();
    harness.run();
    assert!(harness.query_by_label("Stop following").is_none());
}

#[test]
fn a_double_click_on_a_ball_or_its_name_is_a_close_up() {
    for on_name in [false, true] {
        let mut harness = window("spcmm");
        harness.run_steps(5);
        let at = if on_name { name_of_joint(&harness, "S2") } else { ball_of_joint(&harness, 1) };
        let far = harness.state().camera_pose().expect("a camera").distance;
        harness.hover_at(at);
        harness.run_steps(60);
        harness.get_by_label("Click for the microscope, double-click for a close-up");
        for _ in 0..2 {
            harness.drag_at(at);
            harness.drop_at(at);
            harness.step();
        }
        harness.remove_cursor();
        harness.run_steps(60);
        let near = harness.state().camera_pose().expect("a camera").distance;
        assert!(near < 0.5 * far, "{on_name}: {near} of {far}");
        assert!(harness.state().share_state().contains("follow=joint.S2"), "{}", harness.state().share_state());
        harness.get_by_label("Microscope");
    }
}

/// Where the name of a joint stands in the picture.
fn name_of_joint(harness: &Harness<'_, App>, name: &str) -> egui::Pos2 {
    fn find(shape: &egui::Shape, name: &str, inside: egui::Rect) -> Option<egui::Pos2> {
        match shape {
            egui::Shape::Vec(shapes) => shapes.iter().find_map(|shape| find(shape, name, inside)),
            egui::Shape::Text(text) if text.galley.text() == name => {
                Some(text.visual_bounding_rect().center()).filter(|at| inside.contains(*at))
            }
            _ => None,
        }
    }
    let picture = harness.get_by_label("3D view").rect();
    let shapes = &harness.output().shapes;
    shapes.iter().find_map(|part| find(&part.shape, name, picture)).expect("a name in the picture")
}

/// Where the ball of a joint is in the picture.
fn ball_of_joint(harness: &Harness<'_, App>, joint: usize) -> egui::Pos2 {
    let app = harness.state();
    app.place_in_view(&app.player().frame().joints[joint].ball_centre).expect("before the camera")
}

#[test]
fn the_chosen_plots_are_shown_with_their_units() {
    let mut harness = window("spcmm");
    harness.get_by_label("Normal force, N");
    assert!(harness.query_by_label("Energy, mJ").is_none());
    harness.get_by_label("Choose plots").click();
    harness.run();
    harness.get_by_role_and_label(Role::CheckBox, "Energy, mJ").click();
    harness.run();
    harness.key_press(Key::Escape);
    harness.run();
    harness.get_by_role_and_label(Role::Label, "Energy, mJ");
}

#[test]
fn any_channel_is_found_by_name_plotted_and_carried_by_links() {
    let mut harness = window("spcmm");
    harness.get_by_label("Choose plots").click();
    harness.run();
    type_into(&mut harness, "Search channels", "rod1.po");
    harness.get_by_role_and_label(Role::CheckBox, "rod1.pose, mm, rad").click();
    harness.run();
    type_into(&mut harness, "Search channels", "*.reaction");
    harness.get_by_role_and_label(Role::CheckBox, "*.reaction, N").click();
    harness.run();
    harness.key_press(Key::Escape);
    harness.run();
    // There is one plot for each unit.
    for title in ["rod1.pose, mm", "rod1.pose, rad", "*.reaction, N"] {
        harness.get_by_role_and_label(Role::Label, title);
    }
    harness.get_by_label("gamma in rod1.pose, rad");
    harness.state_mut().player_mut().run_to(9e-3);
    harness.run();
    let player = harness.state().player();
    assert!(player.channels().picked().len() > 6);
    let link = harness.state().link();
    let names = ["rod1.pose".to_owned(), "*.reaction".to_owned()];
    assert_eq!(link.channels.as_deref(), Some(&names[..]));
    let link = link.format();
    let mut other = window("pendulum");
    let ctx = other.ctx.clone();
    let opened = other.state_mut().open_link(&ctx, &format!("#{link}"));
    assert_eq!(opened, Ok(()));
    other.run_steps(40);
    other.get_by_role_and_label(Role::Label, "rod1.pose, mm");
}

#[test]
fn the_accuracy_of_the_running_scene_is_shown_beside_the_controls() {
    let mut harness = window("spcmm");
    assert!(harness.query_by_label("Energy residual").is_none(), "the solver comes last");
    harness.get_by_label("Accuracy").click();
    harness.run();
    harness.get_by_label("not measured yet");
    let preset = |harness: &Harness<'_, App>| {
        let choice = harness.get_by_role_and_label(Role::ComboBox, "Preset");
        choice.value().map(|name| name.to_string())
    };
    assert_eq!(preset(&harness).as_deref(), Some("custom"));
    harness.state_mut().player_mut().set("solver.preset", "accurate").expect("a preset");
    harness.run_steps(2);
    assert_eq!(preset(&harness).as_deref(), Some("accurate"));
    harness.state_mut().player_mut().set_original("solver.preset").expect("its own value");
    harness.run_steps(2);
    assert_eq!(preset(&harness).as_deref(), Some("custom"));
    // The default has measured errors, too.
    assert!(harness.query_by_label("no preset").is_none());
    // Nothing has been hit yet, and the rows about impacts say so.
    harness.get_by_label("none yet");
    harness.get_by_label("No warnings so far");
    assert_eq!(harness.query_all_by_label("—").count(), 2);
    harness.state_mut().player_mut().run_to(9e-3);
    harness.run();
    harness.get_by_label("Energy residual");
    let player = harness.state().player();
    let impact = *player.simulation().impacts().next_back().expect("hit");
    assert!(impact.steps >= 10, "{impact:?}");
    let joint = &player.running().machine.loose_joints[impact.joint].name;
    let comparable = impact.has_own_restitution();
    let kind = match (comparable, impact.disturbed) {
        (true, _) => "undisturbed",
        (false, true) => "disturbed",
        (false, false) => "soft",
    };
    harness.get_by_label(&format!("{joint}, {kind}"));
    harness.get_by_label(&impact.steps.to_string());
    // Only an undisturbed impact can be compared with the restitution in the scene.
    let compared = harness.query_by_label_contains(", asked 0.9").is_some();
    assert_eq!(compared, comparable, "{impact:?}");
    // A coarse step shows in the count, and the speed of stepping is measured.
    let player = harness.state_mut().player_mut();
    player.set("solver.method", "rk4").expect("a method");
    player.set("solver.step", "20 us").expect("in range");
    player.reset().expect("starts");
    player.run_to(9e-3);
    let impact = *player.simulation().impacts().next_back().expect("hit");
    assert!(impact.steps < 10, "{impact:?}");
    player.set_playing(true);
    harness.run_steps(20);
    assert_eq!(preset(&harness).as_deref(), Some("custom"));
    assert!(harness.query_by_label("not measured yet").is_none());
}

#[test]
fn the_energy_balance_is_stacked_from_both_sides_and_shows_what_is_stored() {
    let mut harness = plain("spcmm", &[], [1280.0, 800.0], egui::Theme::Light);
    let plots = harness.state_mut().plots_mut();
    plots.chosen = vec![Quantity::EnergyBalance];
    plots.window = jointplay::app::PlotWindow::Everything;
    harness.state_mut().player_mut().run_to(0.05);
    harness.run();
    harness.get_by_label("Energy balance, mJ");
    compare_window(&mut harness, "energy_balance");
}

#[test]
fn the_accuracy_of_a_preset_is_stated_for_the_values_with_which_it_was_measured() {
    let mut harness = window("pendulum");
    harness.get_by_label("Accuracy").click();
    harness.run();
    // Measurements of the unchanged scene are stored in the program.
    assert!(harness.query_by_label("not measured").is_none());
    let player = harness.state_mut().player_mut();
    player.set("contact.clearance", "0.2 mm").expect("in range");
    player.set("solver.preset", "preview").expect("a preset");
    harness.run_steps(2);
    let unmeasured = |harness: &Harness<'_, App>| harness.query_all_by_label("not measured").count();
    assert_eq!(unmeasured(&harness), 2);
    harness.get_by_label("Peak force error");
    // Solver and view do not change the model.
    let player = harness.state_mut().player_mut();
    player.set_original("contact.clearance").expect("its own value");
    harness.run_steps(2);
    assert_eq!(unmeasured(&harness), 0);
}

/// The pixel area around a value in the plot of the normal force, from `top` N down to just above zero, and the value's row.
fn spike(harness: &mut Harness<'_, App>, time: f64, force: f64, top: f64) -> ([usize; 4], usize) {
    let plots = harness.state_mut().plots_mut();
    let position_of = |force| {
        let position_of = plots.place(Quantity::NormalForce, time, force);
        position_of.expect("shown")
    };
    let (high, at, zero) = (position_of(top).y as usize, position_of(force), position_of(0.0).y as usize);
    let area = [at.x as usize - 3, high, at.x as usize + 4, zero - 4];
    (area, at.y as usize)
}

#[test]
fn plotted_peaks_are_those_of_the_run() {
    for size in [[1200.0, 740.0], [900.0, 560.0], [1600.0, 1000.0]] {
        let mut harness = sized("spcmm", size, egui::Theme::Light);
        // All three strike within a tenth of a millisecond: 621, 561 and 533 N (`tests/physics/reference.rs`).
        harness.state_mut().player_mut().run_to(9e-3);
        harness.run();
        let player = harness.state().player();
        let statistics = player.simulation().statistics().clone();
        let peak = statistics.joints.iter().map(|joint| joint.peak_normal).fold(0.0, f64::max);
        let drawn = picture(&mut harness);
        for (joint, colour) in CURVES.into_iter().enumerate() {
            let (time, force) = (statistics.joints[joint].peak_time, statistics.joints[joint].peak_normal);
            let (area, row) = spike(&mut harness, time, force, 1.04 * peak);
            let highest = top(&drawn.covered(area, colour, WHITE)).expect("every joint is seen");
            assert!(highest.abs_diff(row) <= 1, "{size:?}: {force} N of joint {joint} in row {highest}, not {row}");
        }
        // During an impact the newest value is the highest, and nothing is drawn beyond it.
        let player = harness.state_mut().player_mut();
        player.run_to(14.94e-3);
        let shown = player.pacer.shown();
        let force = player.frame().joints[0].normal_force.norm();
        assert!(force > 300.0, "{force}");
        harness.run();
        let drawn = picture(&mut harness);
        let (area, row) = spike(&mut harness, shown, force, 1.2 * force);
        let highest = top(&drawn.covered(area, CURVES[0], WHITE)).expect("drawn");
        assert!(highest.abs_diff(row) <= 1, "{size:?}: {force} N in row {highest}, not {row}");
        let beyond = [area[0] + 5, area[1], area[0] + 60, area[3] + 6];
        for colour in CURVES {
            assert_eq!(drawn.covered(beyond, colour, WHITE), []);
        }
    }
}

#[test]
fn a_warning_beside_a_slider_is_not_contradicted_below() {
    let mut harness = window("spcmm");
    harness.get_by_label("Accuracy").click();
    harness.run();
    harness.get_by_label("No warnings so far");
    let player = harness.state_mut().player_mut();
    player.set("contact.restitution", "0.4").expect("in range");
    harness.run_steps(3);
    harness.get_by_label_contains("0.4 is asked for, but the contact law lankarani-nikravesh");
    harness.get_by_label("No warnings other than those beside the controls");
    assert!(harness.query_by_label("No warnings so far").is_none());
}

#[test]
fn a_low_plot_keeps_its_numbers() {
    for height in [740.0, 470.0, 400.0, 320.0] {
        let mut harness = sized("spcmm", [1000.0, height], egui::Theme::Light);
        if height < 500.0 {
            // A low window shows the plots in a sheet.
            harness.key_press(Key::P);
        }
        harness.state_mut().plots_mut().chosen = vec![Quantity::NormalForce, Quantity::Eccentricity];
        harness.state_mut().player_mut().run_to(9e-3);
        harness.run();
        let plots = harness.state_mut().plots_mut();
        let row = |force| plots.place(Quantity::NormalForce, 0.0, force);
        let (Some(zero), Some(above)) = (row(0.0), row(600.0)) else {
            panic!("{height}: no plot");
        };
        let drawn = picture(&mut harness);
        // The axis labels are left of the plot: counts the runs of rows with dark pixels.
        let has_ink = |y: usize| {
            let left = zero.x as usize;
            (left - 36..left - 3).any(|x| drawn.at(x, y).into_iter().all(|part| part < 150))
        };
        let rows: Vec<bool> = (above.y as usize - 8..(zero.y as usize + 8).min(height as usize)).map(has_ink).collect();
        let labels = rows.windows(2).filter(|pair| !pair[0] && pair[1]).count();
        assert!(labels >= 2, "{height}: {labels} numbers");
    }
}

#[test]
fn the_clearance_of_the_past_stays_where_it_was() {
    let mut harness = window("spcmm");
    harness.state_mut().plots_mut().chosen = vec![Quantity::NormalForce, Quantity::Eccentricity];
    let player = harness.state_mut().player_mut();
    player.run_to(0.02);
    player.set("contact.clearance", "0.6 mm").expect("in range");
    player.run_to(0.05);
    harness.run();
    // Hides the run before the change, which is drawn in greys, too.
    harness.get_by_label("— Clearance: 0.3 mm in Eccentricity").click();
    harness.run();
    let drawn = picture(&mut harness);
    // Share of a row, between two times, that has the dash colour (that of weak text).
    let dash_share = |harness: &mut Harness<'_, App>, from: f64, to: f64, clearance: f64| {
        let plots = harness.state_mut().plots_mut();
        let place = |time| plots.place(Quantity::Eccentricity, time, clearance);
        let (left, right) = (place(from).expect("shown"), place(to).expect("shown"));
        let row = left.y.floor() as usize;
        let area = [left.x as usize, row - 1, right.x as usize, row + 2];
        let pixels = drawn.coloured(area, [0x57, 0x64, 0x70], 70).len() as f32;
        pixels / (right.x - left.x)
    };
    for (clearance, old_line, new_line) in [(0.3e-3, true, false), (0.6e-3, false, true)] {
        let before = dash_share(&mut harness, 1e-3, 0.018, clearance);
        let after = dash_share(&mut harness, 0.025, 0.049, clearance);
        assert_eq!((before > 0.3, after > 0.3), (old_line, new_line), "{clearance}: {before} {after}");
    }
}

#[test]
fn units_are_printed_consistently() {
    let mut harness = window("spcmm");
    for group in ["Solver", "Gravity", "Contact"] {
        harness.get_by_label(group).click();
        harness.run();
    }
    let field = harness.get_by_role_and_label(Role::TextInput, "Gravity along X");
    assert_eq!(field.value().as_deref(), Some("9.81 m/s²"));
    type_into(&mut harness, "Gravity along X", "9.7 m/s²");
    type_into(&mut harness, "Gravity along Y", "1 kg");
    let nodes = harness.root().children_recursive();
    let texts = nodes.flat_map(|node| {
        let node = node.accesskit_node();
        [node.label(), node.value()].map(|text| text.map(|text| text.to_string()))
    });
    let inconsistent: Vec<String> = texts
        .flatten()
        .filter(|text| text.contains("^2") || text.split(|c: char| !c.is_alphabetic()).any(|w| w == "um" || w == "us"))
        .collect();
    assert!(inconsistent.is_empty(), "{inconsistent:?}");
}

/// Role, name and rectangle of every control in order; Play and Pause count as the same button.
fn control_rects(harness: &Harness<'_, App>) -> Vec<(Role, String, [f64; 4])> {
    let all = harness.root().children_recursive();
    all.filter_map(|node| {
        let node = node.accesskit_node();
        let rect = node.bounding_box()?;
        let rect = [rect.x0, rect.y0, rect.x1, rect.y1];
        let label = node.label().filter(|label| !label.trim().is_empty())?;
        let name = match label.as_str() {
            "Pause" => "Play".to_owned(),
            other => other.to_owned(),
        };
        let is_control = matches!(
            node.role(),
            Role::Button
                | Role::Slider
                | Role::TextInput
                | Role::ComboBox
                | Role::CheckBox
                | Role::RadioButton
                | Role::SpinButton
                | Role::DisclosureTriangle
                | Role::Image
        );
        // A note on cut peaks comes with them, inside the plot.
        (is_control && !name.contains(" above in ")).then_some((node.role(), name, rect))
    })
    .collect()
}

/// Runs and plays the current scene and checks that no control moves.
fn check_layout_is_steady(harness: &mut Harness<'_, App>, label: &str) {
    harness.state_mut().player_mut().set_playing(false);
    harness.run_steps(4);
    let before = control_rects(harness);
    assert!(before.len() > 10, "{label}: {}", before.len());
    for time in [9e-3, 0.12] {
        let player = harness.state_mut().player_mut();
        player.run_to(time);
        player.pacer.set_scale(0.5);
        player.set_playing(true);
        harness.run_steps(2);
        let now = control_rects(harness);
        for (was, is) in before.iter().zip(&now) {
            assert_eq!(was, is, "{label} at {time} s");
        }
        assert_eq!(before.len(), now.len(), "{label} at {time} s");
        harness.state_mut().player_mut().set_playing(false);
    }
}

#[test]
fn nothing_moves_while_a_scene_plays() {
    let sizes = [[1280.0, 800.0], [900.0, 640.0], [390.0, 844.0], [844.0, 390.0], [320.0, 480.0]];
    for (index, size) in sizes.into_iter().enumerate() {
        let mut options = AppOptions::new(Scene::load("spcmm", &[]).expect("built in"));
        options.playing = false;
        let mut harness = Harness::builder()
            .with_size(size)
            .with_step_dt(1.0 / 60.0)
            .build_eframe(move |cc| App::new(cc, options).expect("the scene starts"));
        harness.state_mut().player_mut().pacer.set_scale(0.5);
        // The content depends on the scene, its position on the window size: every scene is checked in one size, one scene in all.
        for (i, scene) in jointplay::scene::BUILT_IN.into_iter().enumerate() {
            if i % 5 == index || scene == "chain" {
                harness.state_mut().open(scene).expect("built in");
                check_layout_is_steady(&mut harness, &format!("{scene} in {size:?}"));
            }
        }
        // The bench with a twin, and a run that raises warnings.
        harness.key_press(Key::B);
        harness.state_mut().open("spcmm").expect("built in");
        let player = harness.state_mut().player_mut();
        player.set("solver.method", "rk4").expect("a method");
        player.set("solver.step", "40 us").expect("in range");
        player.set_twin(true);
        check_layout_is_steady(&mut harness, &format!("doubts in {size:?}"));
        let doubts = harness.state().player().simulation().doubts();
        assert!(!doubts.is_empty());
    }
}

#[test]
fn panels_keep_their_shares_when_the_window_changes_size() {
    let mut harness = window("spcmm");
    harness.run();
    let shares = |harness: &Harness<'_, App>| {
        let size = harness.ctx.content_rect().size();
        let view = harness.get_by_label("3D view").rect();
        let plots = harness.get_by_label("Choose plots").rect();
        [view.left() / size.x, (size.y - plots.top()) / size.y]
    };
    let before = shares(&harness);
    for size in [[1500.0, 940.0], [1100.0, 760.0], [1280.0, 800.0]] {
        harness.set_size(size.into());
        harness.run();
        for (now, before) in shares(&harness).into_iter().zip(before) {
            // The frame around the plots does not scale.
            assert!((now - before).abs() < 0.01, "{size:?}: {now} {before}");
        }
    }
}

#[test]
fn a_notice_lies_below_the_scene_and_leaves_after_five_seconds() {
    for size in [[1280.0, 800.0], [390.0, 844.0], [844.0, 390.0]] {
        let mut harness = sized("spcmm", size, egui::Theme::Light);
        harness.run();
        let before = harness.get_by_label("3D view").rect();
        harness.state_mut().notify("Link copied".to_owned());
        harness.run_steps(30);
        let view = harness.get_by_label("3D view").rect();
        assert_eq!(view, before, "{size:?}: nothing moves");
        let notice = harness.get_by_label("Link copied").rect();
        assert!(notice.top() >= view.bottom(), "{size:?}: {notice} {view}");
        harness.run_steps(280);
        assert!(harness.query_by_label("Link copied").is_none(), "{size:?}");
    }
}

#[test]
fn an_error_makes_room_for_itself_below_the_scene() {
    for size in [[1280.0, 800.0], [390.0, 844.0]] {
        let mut harness = sized("spcmm", size, egui::Theme::Light);
        let ctx = harness.ctx.clone();
        harness.state_mut().open_link(&ctx, "#scene=nowhere").expect_err("no such scene");
        harness.run_steps(5);
        let view = harness.get_by_label("3D view").rect();
        let dismiss = harness.get_by_role_and_label(Role::Button, "Dismiss").rect();
        assert!(dismiss.top() >= view.bottom(), "{size:?}: {dismiss} {view}");
        let timeline = harness.get_by_role_and_label(Role::Slider, "Timeline, s").rect();
        assert!(dismiss.bottom() <= timeline.top(), "{size:?}: {dismiss} {timeline}");
    }
}

#[test]
fn sliders_keep_tracks_of_120_points_at_twice_the_type_size() {
    // 1280 × 800 pixels at 200 %.
    let mut harness = sized("spcmm", [640.0, 400.0], egui::Theme::Light);
    harness.run();
    let view = harness.get_by_label("3D view").rect();
    for name in ["Clearance", "Friction coefficient", "Restitution"] {
        let track = harness.get_by_role_and_label(Role::Slider, name).rect();
        assert!(track.width() >= 120.0 && track.left() > view.right(), "{name}: {track} {view}");
    }
}
