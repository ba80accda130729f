//! The keyboard focus, the keys of a slider, and what is said of a lesson.

use eframe::egui::{self, Key, accesskit::Role};
use egui_kittest::{
    Harness,
    kittest::{NodeT as _, Queryable as _},
};
use jointplay::app::{App, AppOptions};
use jointplay::scene::{Kind, Scene};
use jointplay::units::to_display;

use crate::hands::page::open;
use crate::hands::window::sized;

fn window() -> Harness<'static, App> {
    sized("spcmm", [1280.0, 800.0], egui::Theme::Light)
}

/// Name of the control with the focus.
fn focused(harness: &Harness<'_, App>) -> Option<String> {
    let all = harness.query_all(egui_kittest::kittest::By::new().predicate(|node| node.is_focused()));
    all.filter_map(|node| node.accesskit_node().label()).next()
}

#[test]
fn a_dialog_takes_the_focus_and_esc_gives_it_back_to_what_opened_it() {
    let mut harness = window();
    for (openers, inside) in
        [(&["Keyboard shortcuts"][..], "Close"), (&["Save", "Film…"], "Cancel"), (&["About"], "Close")]
    {
        for opener in openers {
            harness.get_by_role_and_label(Role::Button, opener).click();
            harness.run_steps(3);
        }
        assert_eq!(focused(&harness).as_deref(), Some(inside), "{openers:?}");
        harness.key_press(Key::Escape);
        harness.run_steps(3);
        assert!(harness.query_by_label(inside).is_none());
        assert_eq!(focused(&harness).as_deref(), Some(openers[0]));
    }
    // A text field comes before the buttons.
    harness.get_by_role_and_label(Role::Button, "Open").click();
    harness.run_steps(3);
    harness.get_by_label("Link…").click();
    harness.run_steps(3);
    let path = harness.get_by_role_and_label(Role::TextInput, "Path");
    assert!(path.accesskit_node().is_focused());
    harness.key_press(Key::Escape);
    harness.run_steps(6);
    assert_eq!(focused(&harness).as_deref(), Some("Open"));
}

#[test]
fn esc_in_a_menu_gives_the_focus_back_to_its_button() {
    let mut harness = window();
    harness.get_by_role_and_label(Role::Button, "Save").focus();
    harness.run_steps(2);
    harness.key_press(Key::Enter);
    harness.run_steps(4);
    assert!(harness.query_by_label("Film…").is_some());
    assert_ne!(focused(&harness).as_deref(), Some("Save"), "the first entry has it");
    harness.key_press(Key::Escape);
    harness.run_steps(4);
    assert!(harness.query_by_label("Film…").is_none());
    assert_eq!(focused(&harness).as_deref(), Some("Save"));
}

#[test]
fn home_end_and_the_page_keys_move_the_focused_slider() {
    let mut harness = window();
    let parameter = Scene::load("spcmm", &[]).expect("built in").parameters();
    let parameter = parameter.into_iter().find(|own| own.key == "contact.restitution").expect("in the table");
    let Kind::Number { slider: (least, greatest), display, .. } = parameter.kind else { panic!("a number") };
    let value = |harness: &Harness<'_, App>| harness.state().player().pending().machine.contact.restitution;
    harness.get_by_role_and_label(Role::Slider, "Restitution").focus();
    harness.run_steps(2);
    let mut press = |key: Key| {
        harness.key_press(key);
        harness.run_steps(2);
        value(&harness)
    };
    let near = |a: f64, b: f64| (to_display(a, display) - to_display(b, display)).abs() < 1e-9;
    assert!(near(press(Key::Home), least));
    assert!(near(press(Key::End), greatest));
    assert!(near(press(Key::Home), least));
    let one = press(Key::ArrowRight);
    press(Key::Home);
    let ten = press(Key::PageUp);
    // An arrow moves by a point of the track, or to the round value near it.
    assert!(one > least && ten - least > 3.0 * (one - least), "{one} {ten}");
    assert!(near(press(Key::PageDown), least));
    // The run was not sent to its ends by them.
    assert_eq!(harness.state().player().pacer.shown(), 0.0);
}

#[test]
fn a_lesson_says_its_answer_and_its_next_step() {
    let options = AppOptions::from_link("?lesson=first-impact&step=2").expect("a link");
    let (mut harness, _) = open(options, [1280.0, 800.0]);
    for _ in 0..200 {
        harness.step();
        if harness.state().announcement().contains("Step 2 of 7") {
            break;
        }
    }
    let said = harness.state().announcement().to_owned();
    assert!(said.starts_with("Step 2 of 7: Nothing holds the platform. Before the first impact"), "{said}");
    assert!(said.contains("How does the platform move meanwhile?"), "{said}");
    harness.get_by_role_and_label(Role::RadioButton, "It follows the slides: they carry it").click();
    harness.run_steps(3);
    harness.key_press(Key::Space);
    for _ in 0..3000 {
        harness.step();
        if harness.state().announcement().contains("Not as predicted") {
            break;
        }
    }
    let said = harness.state().announcement().to_owned();
    assert!(
        said.starts_with("Not as predicted. Answer: It falls freely. The platform accelerates downwards at "),
        "{said}"
    );
    assert!(said.contains("Next step: Half g t squared."), "{said}");
}
