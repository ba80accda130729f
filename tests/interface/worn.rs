//! The slider "Worn for".

use eframe::egui::{self, Key, Modifiers, accesskit::Role, vec2};
use egui_kittest::{Harness, kittest::Queryable as _};
use jointplay::app::App;
use jointplay::simulate::{Frame, Simulation};

use crate::hands::lesson::shows_text;
use crate::hands::opened;
use crate::hands::window::{shown, sized};

const SCENE: &str = "measuring-machine";
/// Period of its drives, s.
const PERIOD: f64 = 1.0 / 6.0;
const NAME: &str = "Worn for";

fn window(coefficient: &str) -> Harness<'static, App> {
    let changes = [("contact.wear_coefficient", coefficient)];
    opened(SCENE, &changes, [1280.0, 800.0], egui::Theme::Light, crate::common::ticking_clock::<10>)
}

/// The window after two periods.
fn run_window(coefficient: &str) -> Harness<'static, App> {
    let mut harness = window(coefficient);
    harness.state_mut().run_to(2.1 * PERIOD);
    harness.run_steps(3);
    harness
}

fn clearances(harness: &Harness<'_, App>) -> Vec<f64> {
    let joints = &harness.state().player().pending().machine.loose_joints;
    joints.iter().map(|joint| joint.contact.clearance).collect()
}

/// Growth of the plays in the second period of a run of the machine of `harness`, m/s.
fn rates(harness: &Harness<'_, App>) -> Vec<f64> {
    let mut simulation = Simulation::new(&harness.state().player().running().machine).expect("starts");
    let mut worn = |time: f64| -> Vec<f64> {
        let mut frame = Frame::default();
        simulation.advance_to(time).expect("runs");
        simulation.sample(time, &mut frame);
        frame.joints.iter().map(|joint| joint.worn[0]).collect()
    };
    let (before, after) = (worn(PERIOD), worn(2.0 * PERIOD));
    before.iter().zip(&after).map(|(before, after)| (after - before) / PERIOD).collect()
}

/// Hours by which every clearance has grown from `before` at `rates`, which are the same for all.
fn hours_of(before: &[f64], after: &[f64], rates: &[f64]) -> f64 {
    let hours: Vec<f64> = (0..rates.len()).map(|j| (after[j] - before[j]) / rates[j] / 3600.0).collect();
    assert!(hours.iter().all(|own| (own / hours[0] - 1.0).abs() < 1e-6), "{hours:?}");
    hours[0]
}

fn set_hours(harness: &mut Harness<'_, App>, hours: f64) {
    harness.get_by_role_and_label(Role::Slider, NAME).set_value_accesskit(hours);
    harness.run_steps(40);
}

fn press(harness: &mut Harness<'_, App>, modifiers: Modifiers) {
    harness.key_press_modifiers(modifiers, Key::Z);
    harness.run_steps(40);
}

#[test]
fn letting_go_restarts_the_run_with_the_rate_of_the_last_period_times_the_time() {
    let mut harness = run_window("1e-14 m^2/N");
    let (set, rates) = (clearances(&harness), rates(&harness));
    assert!(rates.iter().all(|rate| *rate > 0.0));
    let track = harness.get_by_role_and_label(Role::Slider, NAME).rect();
    harness.drag_at(track.left_center() + vec2(40.0, 0.0));
    for part in 1..=4 {
        harness.hover_at(track.left_center() + vec2(40.0 + 30.0 * part as f32, 0.0));
        harness.run_steps(3);
    }
    // Until then the run stays, and the words say what the plays would be.
    assert_eq!(clearances(&harness), set);
    assert!(shown(&harness) > 2.0 * PERIOD);
    assert!(shows_text(&harness, "Extrapolated from the last period:"));
    harness.drop_at(track.left_center() + vec2(160.0, 0.0));
    harness.run_steps(3);
    assert!(shown(&harness) < 0.1 * PERIOD, "restarted");
    let worn = clearances(&harness);
    let hours = hours_of(&set, &worn, &rates);
    assert!(shows_text(&harness, &format!("{} h", jointplay::session::value::number(hours, 3))), "{hours}");
    let running = &harness.state().player().running().machine.loose_joints;
    assert!(running.iter().zip(&worn).all(|(joint, worn)| joint.contact.clearance == *worn));
    assert!(!harness.state().player().has_pending_changes());
    assert!(shows_text(&harness, "Extrapolated from the run before:"));
    let mm = |play: f64| jointplay::session::value::quantity(play, "mm", 3);
    assert!(shows_text(&harness, &format!("S1 0.3 to {}", mm(worn[0]))));
    // A link and a saved scene have them as changes.
    assert!(harness.state().share_state().contains("joint.S1.clearance="));
}

#[test]
fn a_later_age_goes_on_from_the_worn_run_and_an_earlier_one_back_on_the_way() {
    let mut harness = run_window("1e-14 m^2/N");
    let (set, first) = (clearances(&harness), rates(&harness));
    set_hours(&mut harness, 4000.0);
    let worn = clearances(&harness);
    assert!((hours_of(&set, &worn, &first) - 4000.0).abs() < 0.01);
    // Nothing is known of its wear yet: until then it goes on, and back, at the rate of the run before.
    set_hours(&mut harness, 5000.0);
    assert!((hours_of(&set, &clearances(&harness), &first) - 5000.0).abs() < 0.01);
    let track = harness.get_by_role_and_label(Role::Slider, NAME).rect();
    harness.drag_at(track.left_center() + vec2(40.0, 0.0));
    harness.hover_at(track.left_center() + vec2(60.0, 0.0));
    harness.run_steps(3);
    assert!(shows_text(&harness, "Extrapolated from the run before:"));
    harness.key_press(Key::Escape);
    harness.drop_at(track.left_center() + vec2(60.0, 0.0));
    harness.run_steps(3);
    set_hours(&mut harness, 4000.0);
    assert_eq!(clearances(&harness), worn);
    harness.state_mut().run_to(2.1 * PERIOD);
    harness.run_steps(3);
    let second = rates(&harness);
    assert!(second.iter().zip(&first).all(|(second, first)| second > first), "wear speeds up: {first:?} {second:?}");
    set_hours(&mut harness, 6000.0);
    assert!((hours_of(&worn, &clearances(&harness), &second) - 2000.0).abs() < 0.01);
    harness.state_mut().run_to(2.1 * PERIOD);
    harness.run_steps(3);
    set_hours(&mut harness, 1000.0);
    assert!((hours_of(&set, &clearances(&harness), &first) - 1000.0).abs() < 0.01);
    harness.state_mut().run_to(2.1 * PERIOD);
    harness.run_steps(3);
    set_hours(&mut harness, 0.0);
    assert_eq!(clearances(&harness), set);
    let changes = &harness.state().player().pending().changes;
    assert_eq!(changes.len(), 1, "only the wear coefficient: {changes:?}");
}

#[test]
fn undo_takes_it_back_in_one_step_and_the_age_with_it() {
    let mut harness = run_window("1e-14 m^2/N");
    let set = clearances(&harness);
    set_hours(&mut harness, 2000.0);
    let worn = clearances(&harness);
    assert_ne!(set, worn);
    assert_eq!(harness.state().undo_words(false).as_deref(), Some("Undo: Worn for, to 0 h"));
    press(&mut harness, Modifiers::COMMAND);
    assert_eq!(clearances(&harness), set);
    assert_eq!(harness.state().undo_words(false), None, "one step");
    assert!(!shows_text(&harness, "2000 h") && shows_text(&harness, "0 h"));
    assert_eq!(harness.state().undo_words(true).as_deref(), Some("Redo: Worn for, to 2000 h"));
    press(&mut harness, Modifiers::COMMAND | Modifiers::SHIFT);
    assert_eq!(clearances(&harness), worn);
    assert!(shows_text(&harness, "2000 h") && shows_text(&harness, "Extrapolated from the run before:"));
}

#[test]
fn what_the_slider_did_not_make_has_no_age() {
    let mut harness = run_window("1e-14 m^2/N");
    set_hours(&mut harness, 2000.0);
    assert!(shows_text(&harness, "2000 h"));
    let set = |harness: &mut Harness<'_, App>, key: &str, value: &str| {
        harness.state_mut().player_mut().set(key, value).expect("in range");
        harness.run_steps(40);
    };
    for (key, value) in [("joint.S1.clearance", "0.5 mm"), ("contact.friction", "0.4")] {
        set(&mut harness, key, value);
        assert!(!shows_text(&harness, "2000 h") && !shows_text(&harness, "Extrapolated"), "{key}");
        press(&mut harness, Modifiers::COMMAND);
        assert!(shows_text(&harness, "2000 h"), "{key}");
    }
    // A restart changes nothing of the scene.
    harness.state_mut().reset();
    harness.run_steps(3);
    assert!(shows_text(&harness, "2000 h"));
    let link = harness.state().share_state();
    harness.state_mut().open("pendulum").expect("opens");
    harness.run_steps(3);
    assert!(harness.query_by_label(NAME).is_none());
    let ctx = harness.ctx.clone();
    harness.state_mut().open_link(&ctx, &link).expect("opens");
    harness.run_steps(100);
    assert!(harness.query_by_role_and_label(Role::Slider, NAME).is_some());
    assert!(!shows_text(&harness, "2000 h") && !shows_text(&harness, "Extrapolated"));
}

#[test]
fn the_handle_stops_where_the_scene_allows_no_more() {
    let mut harness = run_window("1e-10 m^2/N");
    let set = clearances(&harness);
    harness.key_press(Key::L);
    harness.run_steps(2);
    assert!(shows_text(&harness, "Microscope"));
    let track = harness.get_by_role_and_label(Role::Slider, NAME).rect();
    harness.drag_at(track.left_center() + vec2(40.0, 0.0));
    harness.hover_at(track.right_center() - vec2(2.0, 0.0));
    harness.run_steps(3);
    assert!(shows_text(&harness, "No longer: S1 is as wide as the scene allows"));
    // Esc takes the drag back, and does nothing else.
    harness.key_press(Key::Escape);
    harness.run_steps(3);
    assert!(!shows_text(&harness, "No longer") && shows_text(&harness, "Microscope"));
    harness.drop_at(track.right_center() - vec2(2.0, 0.0));
    harness.run_steps(3);
    assert_eq!(clearances(&harness), set);
    set_hours(&mut harness, 10_000.0);
    let machine = &harness.state().player().pending().machine;
    let joint = &machine.loose_joints[0].contact;
    assert!((0.99..1.0).contains(&(joint.clearance / joint.ball_radius)), "{}", joint.clearance);
}

#[test]
fn without_a_period_or_without_sliding_it_says_what_is_missing() {
    let mut harness = window("1e-14 m^2/N");
    assert!(shows_text(&harness, "Let the run go on for a full period"));
    harness.state_mut().run_to(1.1 * PERIOD);
    harness.run_steps(3);
    assert!(shows_text(&harness, "From the clearances as set:"));
    harness.state_mut().player_mut().set("contact.friction", "0.2").expect("in range");
    harness.run_steps(3);
    assert!(shows_text(&harness, "Let the run go on for a full period"), "the period had another friction");
    // A rod whose ball is held by nothing but its socket, before it falls: no drive, and a whole second without a touch.
    let changes = [("contact.wear_coefficient", "1e-14 m^2/N"), ("gravity.z", "0 m/s^2")];
    let clock = crate::common::ticking_clock::<10>;
    let mut harness = opened("pendulum", &changes, [1280.0, 800.0], egui::Theme::Light, clock);
    assert!(shows_text(&harness, "Let the run go on for a full second"));
    harness.state_mut().run_to(1.1);
    harness.run_steps(3);
    assert!(shows_text(&harness, "Nothing wore in the last second"));
}

#[test]
fn it_is_absent_without_wear_and_comes_when_the_pointer_is_elsewhere() {
    let mut harness = sized(SCENE, [1280.0, 800.0], egui::Theme::Light);
    assert!(harness.query_by_label(NAME).is_none());
    let control = harness.get_by_role_and_label(Role::Slider, "Clearance").rect().center();
    harness.hover_at(control);
    harness.run_steps(3);
    let set = |harness: &mut Harness<'_, App>, value: &str| {
        let player = harness.state_mut().player_mut();
        player.set("contact.wear_coefficient", value).expect("in range");
        harness.run_steps(3);
    };
    set(&mut harness, "1e-14 m^2/N");
    assert!(harness.query_by_label(NAME).is_none(), "it would move what is under the pointer");
    let picture = egui::pos2(640.0, 300.0);
    harness.hover_at(picture);
    harness.run_steps(3);
    let below = |harness: &Harness<'_, App>| harness.get_by_label("Accuracy").rect().top();
    let before = below(&harness);
    harness.get_by_role_and_label(Role::Slider, NAME);
    harness.hover_at(control);
    set(&mut harness, "0 m^2/N");
    assert_eq!(below(&harness), before);
    harness.hover_at(picture);
    harness.run_steps(3);
    assert!(harness.query_by_label(NAME).is_none() && below(&harness) < before);
}

#[test]
fn it_is_absent_where_walls_wear_by_direction() {
    for (shape, shown) in [("even", true), ("profile", false)] {
        let changes = [("contact.wear_coefficient", "1e-14 m^2/N"), ("contact.wear_shape", shape)];
        let clock = crate::common::ticking_clock::<10>;
        let mut harness = opened(SCENE, &changes, [1280.0, 800.0], egui::Theme::Light, clock);
        harness.run_steps(3);
        assert_eq!(harness.query_by_role_and_label(Role::Slider, NAME).is_some(), shown, "{shape}");
    }
}

#[test]
fn keys_move_the_handle_and_enter_lets_go() {
    let mut harness = run_window("1e-14 m^2/N");
    let set = clearances(&harness);
    harness.get_by_role_and_label(Role::Slider, NAME).focus();
    harness.run_steps(3);
    for _ in 0..3 {
        harness.key_press(Key::End);
        harness.run_steps(3);
    }
    assert_eq!(clearances(&harness), set);
    assert!(shows_text(&harness, "10\u{202f}000 h") || shows_text(&harness, "10000 h"));
    harness.key_press(Key::Enter);
    harness.run_steps(3);
    assert_ne!(clearances(&harness), set);
    assert!(shown(&harness) < 0.1 * PERIOD, "restarted");
}

#[test]
fn many_plays_have_four_lines_and_two_of_a_joint_their_names() {
    let opened = |scene: &str, own: &[(&str, &str)]| {
        let changes = [own, &[("contact.wear_coefficient", "1e-14 m^2/N")]].concat();
        opened(scene, &changes, [1280.0, 800.0], egui::Theme::Light, crate::common::ticking_clock::<10>)
    };
    assert!(shows_text(&opened("hexapod", &[]), "and 9 more"));
    // One pin of the excavator also plays along its axis.
    let own = [("joint.boom-pin.play.face_radius", "60 mm"), ("joint.boom-pin.play.axial", "0.2 mm")];
    let mut harness = opened("excavator", &own);
    let plays = |harness: &Harness<'_, App>| -> Vec<[f64; 2]> {
        let joints = &harness.state().player().pending().machine.loose_joints;
        joints.iter().map(|joint| joint.contact.clearances()).collect()
    };
    let set = plays(&harness);
    for name in ["boom-pin, radial 0.5 mm", "boom-pin, axial 0.2 mm", "stick-pin 0.5 mm"] {
        assert!(shows_text(&harness, name), "{name}");
    }
    harness.state_mut().run_to(4.1);
    harness.run_steps(3);
    let rates = harness.state().player().wear_rates().expect("a period");
    set_hours(&mut harness, 100.0);
    for ((before, after), rates) in set.iter().zip(plays(&harness)).zip(rates) {
        for play in 0..2 {
            let wanted = before[play] + rates[play] * 100.0 * 3600.0;
            assert!((after[play] - wanted).abs() < 1e-12, "{after:?} {before:?} {rates:?}");
        }
        assert!(rates[0] > 0.0);
    }
}
