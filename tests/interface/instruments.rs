//! The microscope and the ideal ghost in the window.

use eframe::egui::{self, Key, Pos2, accesskit::Role, vec2};
use egui_kittest::{
    Harness,
    kittest::{NodeT as _, Queryable as _},
};
use jointplay::app::{App, Link};
use jointplay::simulate::Quantity;

use crate::hands::page::click;
use crate::hands::{compare_window, opened, plain};
use crate::pixels::Picture;

const WIDE: [f32; 2] = [1280.0, 800.0];
const PHONE: [f32; 2] = [390.0, 844.0];

/// The window on `scene` with some changes at t = 0, paused.
fn window(scene: &str, changes: &[(&str, &str)], size: [f32; 2], theme: egui::Theme) -> Harness<'static, App> {
    opened(scene, changes, size, theme, crate::common::ticking_clock::<10>)
}

fn spcmm() -> Harness<'static, App> {
    window("spcmm", &[], WIDE, egui::Theme::Light)
}

fn choose(harness: &mut Harness<'_, App>, combo: &str, entry: &str) {
    let combo = harness.get_by_role_and_label(Role::ComboBox, combo);
    combo.click();
    harness.run();
    // The open list is drawn last.
    let entries = harness.get_all_by_label(entry);
    entries.last().expect("an entry").click();
    harness.run();
}

/// Whether some label contains `words`.
fn shows_text(harness: &Harness<'_, App>, words: &str) -> bool {
    let mut all = harness.query_all_by_label_contains(words);
    all.next().is_some()
}

/// The camera's target, m.
fn target(harness: &Harness<'_, App>) -> [f32; 3] {
    let link = Link::parse(&harness.state().share_state()).expect("a link");
    link.camera.expect("has a camera").target
}

/// Distance of the camera's target from the socket of `joint`, m.
fn distance_to_target(harness: &Harness<'_, App>, joint: usize) -> f64 {
    let centre = harness.state().player().frame().joints[joint].socket_centre;
    let offset = [0, 1, 2].map(|i| f64::from(target(harness)[i]) - centre[i]);
    offset.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[test]
fn the_ball_centre_is_drawn_at_the_scaled_eccentricity() {
    let mut harness = spcmm();
    harness.key_press(Key::L);
    harness.run();
    choose(&mut harness, "Plane of the microscope", "XY");
    choose(&mut harness, "Joint in focus", "S2");
    assert_eq!(harness.state().microscope().joint(), 1);
    harness.remove_cursor();
    // In free fall the dot is the only thing in the circle with the text colour.
    for time in [4e-3, 7e-3, 9.6e-3] {
        harness.state_mut().player_mut().run_to(time);
        harness.run();
        let report = harness.state().player().frame().joints[1];
        assert_eq!(report.normal_force.norm(), 0.0);
        let circle = harness.state().microscope().circle().expect("drawn");
        let scale = circle.radius / report.clearance as f32;
        // X points down, in the scene and in the picture.
        let [x, y] = [0, 1].map(|i| report.eccentricity[i] as f32 * scale);
        let expected: Pos2 = circle.centre + vec2(y, x);
        let picture = harness.render().expect("drawn");
        let picture = Picture::new(picture.width(), picture.into_raw());
        let area = [-8.0, 8.0].map(|by| expected + vec2(by, by));
        let area = [area[0].x, area[0].y, area[1].x, area[1].y].map(|edge| edge as usize);
        let dot = picture.coloured(area, [0x1E, 0x2A, 0x36], 24);
        assert!(dot.len() > 20, "{time}: {} at {expected}", dot.len());
        let mean = |component: fn(&(usize, usize)) -> usize| {
            dot.iter().map(component).sum::<usize>() as f32 / dot.len() as f32 + 0.5
        };
        let dot_centre = Pos2::new(mean(|p| p.0), mean(|p| p.1));
        assert!(dot_centre.distance(expected) < 1.0, "{dot_centre} {expected}");
        assert!(expected.distance(circle.centre) < circle.radius + 1.0);
    }
    let path = harness.state().player().paths();
    assert!(path.between(1, 0, 0.0, 1.0).len() > 50);
}

#[test]
fn the_joint_in_focus_stays_in_the_middle_and_a_click_opens_its_microscope() {
    let mut harness = spcmm();
    harness.key_press(Key::Num6);
    harness.run();
    assert!(distance_to_target(&harness, 1) < 1e-6);
    assert!(!harness.state().microscope().is_open());
    let before = harness.state().player().frame().joints[1].socket_centre;
    harness.state_mut().player_mut().pacer.set_scale(0.5);
    harness.state_mut().player_mut().set_playing(true);
    harness.run_steps(40);
    harness.state_mut().player_mut().set_playing(false);
    harness.run();
    let after = harness.state().player().frame().joints[1].socket_centre;
    assert!((after - before).norm() > 1e-3, "its slider moves");
    assert!(distance_to_target(&harness, 1) < 1e-5);
    // The same while the view is still moving.
    harness.key_press(Key::Num5);
    harness.state_mut().player_mut().set_playing(true);
    harness.run_steps(60);
    harness.state_mut().player_mut().set_playing(false);
    harness.run();
    assert!(distance_to_target(&harness, 0) < 1e-5);

    let middle = harness.get_by_label("3D view").rect().center();
    harness.hover_at(middle);
    harness.step();
    harness.drag_at(middle);
    harness.drop_at(middle);
    harness.run();
    let microscope = harness.state().microscope();
    assert!(microscope.is_open() && microscope.joint() == 0);
    harness.get_by_label_contains("Ball joint S1 under the microscope");
    harness.key_press(Key::Escape);
    harness.run();
    assert!(!harness.state().microscope().is_open());
    // Esc closes a message before the microscope.
    harness.key_press(Key::L);
    let opened = harness.state_mut().open_bytes("bad.toml", vec![0xFF]);
    let problem = opened.expect_err("no text");
    harness.run();
    harness.key_press(Key::Escape);
    harness.run();
    assert!(harness.query_by_label(&problem).is_none());
    assert!(harness.state().microscope().is_open());
    harness.get_by_role_and_label(Role::Button, "Close").click();
    harness.run();
    assert!(!harness.state().microscope().is_open());
}

#[test]
fn the_microscope_shows_the_recorded_values_of_an_impact() {
    let mut harness = spcmm();
    harness.key_press(Key::L);
    harness.state_mut().player_mut().run_to(9.5e-3);
    harness.run();
    let player = harness.state().player();
    let impact = player.simulation().impacts().find(|impact| impact.joint == 0);
    let impact = *impact.expect("S1 was hit");
    let restitution = format!("{:.4}", impact.achieved());
    harness.get_by_label(restitution.trim_end_matches('0'));
    harness.get_by_label("Restitution set");
    harness.get_by_label("0.9");
    harness.get_by_label("The ball touches nothing");
    for step in 0.. {
        assert!(step < 2000);
        harness.state_mut().player_mut().single_step();
        if harness.state().player().frame().joints[0].normal_force.norm() > 0.0 {
            break;
        }
    }
    harness.run();
    assert!(shows_text(&harness, "In contact, "));
    let closed = [("contact.clearance", "0")];
    let mut harness = window("spcmm", &closed, WIDE, egui::Theme::Light);
    harness.key_press(Key::L);
    harness.run();
    assert_eq!(harness.state().microscope().circle(), None);
    harness.get_by_label("Ideal joint: no clearance");
}

#[test]
fn instruments_change_no_bit_of_the_run() {
    let run = |instruments: bool| {
        let mut harness = window("slider-crank", &[], WIDE, egui::Theme::Light);
        if instruments {
            for key in [Key::L, Key::G, Key::Num6] {
                harness.key_press(key);
                harness.run();
            }
            harness.state_mut().plots_mut().chosen = vec![Quantity::TipError];
            harness.state_mut().player_mut().set_twin(true);
        }
        for time in [0.01, 0.02, 0.05, 0.08] {
            harness.state_mut().player_mut().run_to(time);
            harness.run();
        }
        let player = harness.state().player();
        let error = player.ideal().map(|ideal| ideal.output_error(player.frame()));
        assert_eq!(error.is_some(), instruments);
        if let Some(error) = error {
            assert!(error.expect("reached this instant").norm() > 1e-7);
        }
        (player.simulation().state_hash(), player.steps())
    };
    assert_eq!(run(true), run(false));
}

#[test]
fn an_impossible_ideal_ghost_is_explained() {
    let text = jointplay::scene::built_in_text("pendulum").expect("built in");
    // A rod whose two sockets are farther apart than its balls by less than the clearance.
    let second = "[[ball_joint]]\nname = \"S2\"\nopening = [0, -1, 0]\n\
        socket = { body = \"world\", at = \"0 0 -200.2 mm\" }\nball = { body = \"rod\", at = \"0 0 -100 mm\" }\n";
    let text = text.replace("-30 deg", "0 deg") + second;
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("between.toml");
    std::fs::write(&path, text).expect("written");
    let mut harness = spcmm();
    harness.state_mut().open(path.to_str().expect("plain")).expect("opens");
    harness.run();
    harness.key_press(Key::G);
    harness.run();
    assert!(shows_text(&harness, "No ideal ghost: with ideal joints, ball joint S"));
    harness.key_press(Key::Escape);
    harness.key_press(Key::G);
    harness.run();
    harness.key_press(Key::G);
    harness.run();
    assert!(harness.state().player().ideal().is_some());
    // The ghost stays on in another scene.
    harness.state_mut().open("pendulum").expect("opens");
    harness.run();
    assert!(harness.state().player().ideal().is_some());
    harness.key_press(Key::G);
    harness.run();
    assert!(harness.state().player().ideal().is_none());
}

#[test]
fn every_control_of_the_microscope_has_a_name() {
    for size in [WIDE, PHONE] {
        let mut harness = window("chain", &[], size, egui::Theme::Light);
        harness.key_press(Key::L);
        harness.run();
        for node in harness.root().children_recursive() {
            let node = node.accesskit_node();
            let is_control =
                matches!(node.role(), Role::Button | Role::ComboBox | Role::CheckBox | Role::Image | Role::Window);
            let named = node.label().is_some_and(|label| !label.trim().is_empty());
            assert!(!is_control || named, "{:?}", node.role());
        }
        // The microscope is beside the picture and covers nothing of it.
        let view = harness.get_by_label("3D view").rect();
        let shown = harness.get_by_label_contains("under the microscope. ");
        let close = harness.get_by_role_and_label(Role::Button, "Close");
        for part in [shown.rect(), close.rect()] {
            assert!(part.left() >= view.right(), "{size:?}: {part}, {view}");
            let transport = harness.get_by_role_and_label(Role::Slider, "Timeline, s").rect();
            assert!(part.right() <= size[0] && part.bottom() <= transport.top());
        }
    }
    // In a window too small for both it is hidden.
    let mut harness = window("spcmm", &[], [400.0, 300.0], egui::Theme::Light);
    harness.key_press(Key::L);
    harness.run();
    let microscope = |harness: &Harness<'_, App>| shows_text(harness, "under the microscope. ");
    assert!(!microscope(&harness), "beside the open sheet");
    click(&mut harness, "Panels");
    click(&mut harness, "Controls");
    harness.run();
    assert!(microscope(&harness), "with the sheet folded away");
}

#[test]
fn microscope_and_ghosts_show_what_is_stored() {
    for (name, size, theme) in [
        ("microscope_light", WIDE, egui::Theme::Light),
        ("microscope_dark", WIDE, egui::Theme::Dark),
        ("microscope_phone", PHONE, egui::Theme::Light),
    ] {
        let mut harness = plain("spcmm", &[], size, theme);
        harness.state_mut().player_mut().run_to(12.42e-3);
        harness.key_press(Key::Num7);
        harness.key_press(Key::L);
        harness.run();
        compare_window(&mut harness, name);
    }
    for (name, theme) in [("ghosts_light", egui::Theme::Light), ("ghosts_dark", egui::Theme::Dark)] {
        let changes = [("contact.clearance", "0.8 mm"), ("contact.friction", "0")];
        let mut harness = plain("slider-crank", &changes, WIDE, theme);
        harness.state_mut().plots_mut().chosen = vec![Quantity::TipError];
        harness.key_press(Key::G);
        harness.run();
        let player = harness.state_mut().player_mut();
        player.set_twin(true);
        player.run_to(0.6);
        harness.run();
        compare_window(&mut harness, name);
    }
}
