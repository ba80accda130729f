//! Lessons in the window. `claims.rs` walks each to its end.

use std::sync::Arc;

use eframe::egui::{Key, Shape, TextStyle, accesskit::Role, vec2};
use egui_kittest::{Harness, kittest::Queryable as _};
use jointplay::app::{App, AppOptions, BUILT_IN_LESSONS, Lesson, Link, Verdict};
use jointplay::integrate::Method;
use jointplay::simulate::Simulation;

use crate::golden::PLAIN;
use crate::hands::lesson::{FRAMES, PHONE, WIDE, open_lesson, open_window, play, present, press, settle, shows_text};
use crate::hands::page;
use crate::hands::window::sized;
use crate::hands::{compare_window, fingers};

/// A built-in lesson whose runs take [`PLAIN`] steps. Every run begins with a state that names an instant, where the settings are added.
fn plain(name: &str) -> Arc<Lesson> {
    let [method, step] = PLAIN.map(|(key, value)| format!("{key}={}", value.replace(' ', "")));
    let prefix = format!("state = \"{method}&{step}&");
    let (_, text) = BUILT_IN_LESSONS.iter().find(|(id, _)| *id == name).expect("a lesson");
    let lines = text.lines().map(|line| match line.strip_prefix("state = \"") {
        Some(state) if state.starts_with("t=") || state.contains("&t=") => format!("{prefix}{state}\n"),
        _ => format!("{line}\n"),
    });
    let lesson = Lesson::parse(name, &lines.collect::<String>(), None).unwrap_or_else(|error| panic!("{error}"));
    for run in &lesson.runs {
        assert_eq!(run.scene.machine.solver.method, Method::RungeKutta4, "{name}: {}", run.name);
    }
    Arc::new(lesson)
}

fn step(harness: &Harness<'_, App>) -> usize {
    harness.state().course().expect("a lesson").step()
}

#[test]
fn the_answer_comes_from_the_displayed_run() {
    let mut harness = open_lesson("rattle", 0, WIDE);
    press(&mut harness, Key::PageDown);
    let wrong = "Not at all: S1 holds them";
    harness.get_by_role_and_label(Role::RadioButton, wrong).click();
    harness.run_steps(2);
    assert!(play(&mut harness));
    let player = harness.state().player();
    let touch = |joint| player.contact_history().touches(joint, 0.0, 1.0).next();
    let touches: Vec<f64> = (0..3).map(|joint| touch(joint).expect("touched")).collect();
    assert!(touches.iter().all(|time| (time / touches[0] - 1.0).abs() < 0.02), "{touches:?}");
    let name = "At nearly the same time".to_owned();
    harness.get_by_label(&format!("Not as predicted. Answer: {name}"));
    // After going back, the question can be answered again.
    press(&mut harness, Key::PageUp);
    press(&mut harness, Key::PageDown);
    harness.get_by_role_and_label(Role::RadioButton, &name).click();
    harness.run_steps(2);
    play(&mut harness);
    harness.get_by_label(&format!("As predicted: {name}"));

    // The text shows the peaks of the displayed run.
    let mut harness = open_lesson("rattle", 4, WIDE);
    assert!(play(&mut harness));
    let impacts = harness.state().player().simulation().impacts();
    let of_second = impacts.filter(|impact| impact.joint == 1);
    let peaks: Vec<f64> = of_second.map(|impact| impact.peak).collect();
    assert!(peaks[1] > 1.05 * peaks[0], "{peaks:?}");
    harness.get_by_label("Answer: Harder than the first");
    assert!(shows_text(&harness, &format!("{:.0} N", peaks[1])), "{peaks:?}");
}

#[test]
fn controls_may_be_changed_during_a_step_and_next_sets_the_machine() {
    let mut harness = open_lesson("rattle", 1, WIDE);
    let set = |harness: &mut Harness<'_, App>| {
        let player = harness.state_mut().player_mut();
        player.set("contact.friction", "0.4").expect("in range");
    };
    set(&mut harness);
    harness.run_steps(2);
    assert!(shows_text(&harness, "The machine has been changed"));
    harness.get_by_label("Restart this step").click();
    settle(&mut harness);
    assert!(!shows_text(&harness, "The machine has been changed"));
    assert_eq!(harness.state().player().running().machine.contact.friction, 0.15);
    set(&mut harness);
    press(&mut harness, Key::PageDown);
    assert_eq!(step(&harness), 2);
    assert_eq!(harness.state().player().running().machine.contact.friction, 0.15);
    settle(&mut harness);
    // The step starts at the end of the previous one, just after the onset of S1's first impact.
    let mut reference = Simulation::new(&harness.state().player().running().machine).expect("starts");
    reference.advance_to(20e-3).expect("runs");
    let of_s1 = reference.impacts().filter(|impact| impact.joint == 0);
    let [first, second] = of_s1.map(|impact| impact.start).take(2).collect::<Vec<_>>()[..] else {
        panic!("two impacts of S1");
    };
    let shown = harness.state().player().pacer.shown();
    assert!((shown - first - 0.03e-3).abs() < 1e-9, "{shown}, {first}");
    // As the text says, it touches and its force rises.
    let s1 = &harness.state().player().frame().joints[0];
    assert!(s1.penetration > 0.0 && s1.normal_force.norm() > 1.0);
    // A presenter remote's other keys work as usual: they seek to the peak of this impact and of the next one.
    let peaks = crate::hands::peaks_of_run(harness.state(), 20e-3);
    let of_s1: Vec<f64> = peaks.iter().filter(|(impact, _)| impact.joint == 0).map(|(_, peak)| *peak).collect();
    for peak in [of_s1[0], of_s1[1]] {
        press(&mut harness, Key::Period);
        for _ in 0..100 {
            harness.step();
        }
        assert_eq!(harness.state().player().pacer.shown(), peak);
    }
    assert!(of_s1[1] > second);
    // Without a lesson these keys do nothing.
    let mut harness = sized("pendulum", WIDE, eframe::egui::Theme::Light);
    let before = harness.state().share_state();
    harness.key_press(Key::PageDown);
    harness.run_steps(2);
    assert_eq!(harness.state().share_state(), before);
}

#[test]
fn a_lesson_changes_no_bit_of_the_run() {
    let mut harness = open_lesson("rattle", 4, WIDE);
    play(&mut harness);
    let player = harness.state().player();
    let mut reference = Simulation::new(&player.running().machine).expect("starts");
    while reference.statistics().steps < player.steps() {
        reference.step().expect("runs");
    }
    assert_eq!(player.simulation().state_hash(), reference.state_hash());
}

#[test]
fn a_link_opens_the_lesson_at_its_step() {
    let options = AppOptions::from_link("?lesson=rattle").expect("a link");
    let (mut harness, _) = page::open(options, WIDE);
    settle(&mut harness);
    assert_eq!(step(&harness), 0);
    press(&mut harness, Key::PageDown);
    harness.state_mut().player_mut().run_to(3e-3);
    harness.run_steps(2);
    let link = harness.state().share_state();
    assert!(link.contains("lesson=rattle&step=2"), "{link}");
    let before = harness.state().player().simulation().state_hash();
    let (mut harness, _) = page::open(AppOptions::from_link(&format!("#{link}")).expect("a link"), WIDE);
    settle(&mut harness);
    for _ in 0..100 {
        harness.step();
    }
    assert_eq!(step(&harness), 1);
    assert_eq!(harness.state().verdict(), Some(&Verdict::Agrees(before)));
    assert!(!shows_text(&harness, "The machine has been changed"));
    let (mut harness, _) = page::open(AppOptions::from_link("?lesson=rattle&step=5").expect("a link"), WIDE);
    settle(&mut harness);
    assert_eq!(step(&harness), 4);
    assert!((harness.state().player().pacer.shown() - 9.5e-3).abs() < 1e-12);
    for (text, wrong) in [("?lesson=ratle", "did you mean `rattle`?"), ("?lesson=rattle&step=0", "allowed 1 and more")]
    {
        let error = AppOptions::from_link(text).expect_err(text);
        assert!(error.contains(wrong), "{error}");
    }
    let link = Link::parse("?lesson=rattle&step=2").expect("a link");
    assert_eq!((link.lesson.as_deref(), link.step), (Some("rattle"), Some(2)));
}

#[test]
fn the_menu_lists_the_lessons_and_touch_steps_through_one_on_a_phone() {
    let mut harness = sized("spcmm", WIDE, eframe::egui::Theme::Light);
    harness.get_by_label("Lessons").click();
    harness.run_steps(3);
    for (name, _) in BUILT_IN_LESSONS {
        let title = &Lesson::built_in(name).expect("a lesson").title;
        harness.get_by_role_and_label(Role::Button, title);
    }
    let title = &Lesson::built_in("first-impact").expect("a lesson").title;
    harness.get_by_role_and_label(Role::Button, title).click();
    settle(&mut harness);
    assert_eq!(harness.state().course().expect("a lesson").lesson().title, *title);

    let tap = |harness: &mut Harness<'_, App>, role: Role, label: &str| {
        let at = harness.get_by_role_and_label(role, label).rect().center();
        fingers(harness, &[&[at]]);
        settle(harness);
    };
    let mut harness = open_lesson("rattle", 0, PHONE);
    let next = harness.get_by_role_and_label(Role::Button, "Next").rect();
    tap(&mut harness, Role::Button, "Next");
    assert_eq!(step(&harness), 1);
    assert_eq!(harness.get_by_role_and_label(Role::Button, "Next").rect(), next, "nothing moves");
    tap(&mut harness, Role::Button, "Play");
    for _ in 0..FRAMES {
        harness.step();
        if harness.state().course().expect("a lesson").is_reached() {
            break;
        }
    }
    harness.run_steps(2);
    assert!(shows_text(&harness, "Answer: At nearly the same time"));
    tap(&mut harness, Role::Button, "Back");
    assert_eq!(step(&harness), 0);
    // The sheet can be folded and unfolded.
    tap(&mut harness, Role::Button, "Lesson");
    assert!(harness.query_by_role_and_label(Role::Button, "Next").is_none());
    tap(&mut harness, Role::Button, "Lesson");
    tap(&mut harness, Role::Button, "Leave the lesson");
    assert!(harness.state().course().is_none());
}

#[test]
fn the_window_is_restored_when_a_lesson_ends() {
    for (name, _) in BUILT_IN_LESSONS {
        let mut harness = sized("pendulum", WIDE, eframe::egui::Theme::Light);
        // Hides the plots, shows the bench, and stops in the middle of a changed run.
        press(&mut harness, Key::P);
        press(&mut harness, Key::B);
        press(&mut harness, Key::Num5);
        let player = harness.state_mut().player_mut();
        player.set("contact.clearance", "0.5 mm").expect("in range");
        player.run_to(12e-3);
        harness.run();
        let panels = |harness: &Harness<'_, App>| {
            ["Accuracy", "Normal force, N", "Order or chaos"].map(|panel| harness.query_by_label(panel).is_some())
        };
        assert_eq!(panels(&harness), [true, false, true]);
        let before = harness.state().share_state();
        let kept_runs = |harness: &Harness<'_, App>| {
            let names: Vec<String> = harness.state().comparison().kept().iter().map(|run| run.name()).collect();
            (names, harness.state().undo_words(false))
        };
        let kept_before = kept_runs(&harness);
        assert_eq!(kept_before.0, ["Clearance: 0.3 mm"]);
        assert!(kept_before.1.is_some());
        let title = &Lesson::built_in(name).expect("a lesson").title;
        harness.get_by_label("Lessons").click();
        harness.run_steps(3);
        harness.get_by_role_and_label(Role::Button, title).click();
        settle(&mut harness);
        let steps = harness.state().course().expect("a lesson").lesson().steps.len();
        for _ in 1..steps {
            press(&mut harness, Key::PageDown);
        }
        assert_ne!(harness.state().share_state(), before, "{name}");
        harness.get_by_label("Leave the lesson").click();
        harness.run_steps(60);
        assert_eq!(harness.state().share_state(), before, "{name}");
        assert_eq!(kept_runs(&harness), kept_before, "{name}");
        assert_eq!(panels(&harness), [true, false, true], "{name}");
    }
}

#[test]
fn a_scene_opened_during_a_lesson_stays_after_the_lesson() {
    let mut harness = sized("pendulum", WIDE, eframe::egui::Theme::Light);
    harness.get_by_label("Lessons").click();
    harness.run_steps(3);
    let title = &Lesson::built_in("first-impact").expect("a lesson").title;
    harness.get_by_role_and_label(Role::Button, title).click();
    settle(&mut harness);
    harness.state_mut().open("delta").expect("built in");
    harness.run_steps(2);
    harness.get_by_label("Leave the lesson").click();
    harness.run_steps(2);
    assert_eq!(harness.state().player().running().name, "delta");
    harness.get_by_label("Accuracy");
}

#[test]
fn a_presented_lesson_is_legible_from_the_last_row() {
    let mut harness = open_lesson("rattle", 1, WIDE);
    present(&mut harness, WIDE);
    assert!(harness.state().is_presenting());
    let zoom = harness.ctx.zoom_factor();
    let styles = &harness.ctx.global_style().text_styles;
    for style in [TextStyle::Small, TextStyle::Body, TextStyle::Monospace, TextStyle::Heading] {
        let share = styles[&style].size * zoom / WIDE[1];
        assert!(share >= 1.0 / 40.0 - 1e-6, "{style:?}: {share}");
    }
    // The line height has the same minimum.
    // Also in the words for screen readers.
    let lines = harness.get_all_by_label_contains("2 of 6").map(|node| node.rect().height());
    let line = lines.fold(0.0, f32::max);
    assert!(line * zoom / WIDE[1] >= 1.0 / 40.0, "{line}");
    press(&mut harness, Key::PageDown);
    assert_eq!(step(&harness), 2);
    assert!(play(&mut harness));
    harness.key_press(Key::F5);
    harness.run_steps(2);
    assert!(!harness.state().is_presenting());
    assert_eq!(step(&harness), 2, "the lesson continues");
}

/// The lessons' stored steps, counted from 0.
const STORED_STEPS: [(&str, usize); 12] = [
    ("rattle", 1),
    ("first-impact", 3),
    ("clearance", 2),
    ("friction", 1),
    ("slow-motion", 2),
    ("ideal", 1),
    ("forces", 2),
    ("twin", 2),
    ("chaos", 0),
    ("to-the-class", 4),
    ("worn-hinge", 2),
    ("wear", 2),
];

#[test]
fn lessons_show_what_is_stored() {
    for (index, (name, step)) in STORED_STEPS.into_iter().enumerate() {
        let mut harness = open_window(plain(name), step, WIDE);
        if index % 2 == 0 {
            present(&mut harness, WIDE);
        }
        play(&mut harness);
        harness.run_steps(60);
        compare_window(&mut harness, &format!("lesson_{name}"));
    }
    let mut harness = open_window(plain("rattle"), 1, PHONE);
    play(&mut harness);
    harness.run_steps(60);
    compare_window(&mut harness, "lesson_rattle_phone");
}

#[test]
fn a_presented_lesson_shows_the_plots_that_it_mentions() {
    for (name, plot) in [("ideal", "Tip error"), ("rattle", "Normal force")] {
        let mut harness = open_lesson(name, 0, WIDE);
        harness.key_press(Key::F5);
        harness.step();
        harness.set_size(eframe::egui::Vec2::from(WIDE) / harness.ctx.zoom_factor());
        harness.run_steps(5);
        assert!(harness.state().is_presenting());
        assert!(shows_text(&harness, plot), "{name}: no {plot}");
    }
}

#[test]
fn a_presented_lesson_shows_the_whole_microscope_and_its_caption_clears_the_ball() {
    for size in [WIDE, [1920.0, 1080.0]] {
        let mut harness = open_lesson("rattle", 5, size);
        press(&mut harness, Key::F5);
        harness.set_size(vec2(size[0], size[1]) / harness.ctx.zoom_factor());
        harness.run_steps(5);
        let app = harness.state();
        let circle = app.microscope().circle().expect("open");
        let rect_of = |words: &str| harness.get_by_label_contains(words).rect();
        let (view, lesson) = (rect_of("3D view"), rect_of("Every impact and every slide"));
        let (sphere, section) = (rect_of("under the microscope."), rect_of("Section of the contact"));
        assert!(view.right() <= sphere.left() && sphere.right() <= lesson.left(), "{view:?} {sphere:?} {lesson:?}");
        let transport = harness.get_by_role_and_label(Role::Button, "Play").rect();
        assert!(section.bottom() <= transport.top(), "{section:?} {transport:?}");
        // The lesson leaves two thirds of the screen to the machine and its microscope.
        assert!(sphere.right() >= 0.6 * harness.ctx.content_rect().width(), "{sphere:?}");
        // No label overlaps the circle.
        let mut labels = 0;
        for part in &harness.output().shapes {
            let Shape::Text(text) = &part.shape else { continue };
            let rect = text.visual_bounding_rect();
            if sphere.contains_rect(rect) && !rect.contains(circle.centre) {
                labels += 1;
                let distance = rect.distance_to_pos(circle.centre);
                assert!(distance > circle.radius, "{:?} {rect:?} {circle:?}", text.galley.text());
            }
        }
        assert!(labels > 5, "{labels}");
        let ball = app.player().frame().joints[0].ball_centre;
        let ball = app.place_in_view(&ball).expect("in sight");
        let caption = rect_of(&app.last_impact().expect("an impact"));
        assert!(caption.distance_to_pos(ball) > 10.0, "{caption:?} {ball:?}");
    }
}

#[test]
fn a_lesson_on_a_phone_shows_the_controls_of_the_microscope_whole_or_not_at_all() {
    for (name, _) in BUILT_IN_LESSONS {
        let mut harness = open_lesson(name, 0, PHONE);
        harness.run_steps(3);
        if !harness.state_mut().microscope_mut().is_open() {
            continue;
        }
        // Less the margins of the two panels.
        let below = harness.get_by_role_and_label(Role::Slider, "Timeline, s").rect().top() - 13.0;
        let choice = harness.query_by_role_and_label(Role::ComboBox, "Plane of the microscope");
        if let Some(place) = choice.map(|choice| choice.rect()) {
            assert!(place.bottom() <= below || place.top() >= below, "{name}: {place} above {below}");
        }
    }
}

#[test]
fn the_buttons_of_a_lesson_lie_side_by_side_in_a_presentation() {
    for screen in [[1280.0, 800.0], [1280.0, 720.0]] {
        let mut harness = open_lesson("rattle", 1, screen);
        present(&mut harness, screen);
        let place = |name| harness.get_by_label(name).rect();
        let places = ["Back", "Next", "More", "Leave the lesson"].map(place);
        for pair in places.windows(2) {
            assert!(pair[0].right() < pair[1].left(), "{screen:?}: {pair:?}");
        }
    }
}
