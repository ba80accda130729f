//! The panel "What play costs": the tornado beside the picture, and the sliders that it moves.

use std::rc::Rc;

use eframe::egui::{self, Color32, Key, Modifiers, Rect, Shape, accesskit::Role};
use egui_kittest::{
    Harness,
    kittest::{NodeT as _, Queryable as _},
};
use jointplay::analysis::study::{NAMED, OneAtATimePlan, RunSpan, StudyRuns, outputs};
use jointplay::app::{App, Event};
use jointplay::scene::Value;

use crate::golden::PLAIN;
use crate::hands::bench::{FAST, click, named_controls, set_number, sized, throttle, throttle_shared, wait};
use crate::hands::compare_window;

/// Colours of the bars towards the lower and upper ends in a light window.
const COLOURS: [Color32; 2] = [Color32::from_rgb(0x00, 0x72, 0xB2), Color32::from_rgb(0xD5, 0x5E, 0x00)];
const SPAN: RunSpan = RunSpan { duration: 0.3, from: 0.1 };
const RUNS: usize = 7;

/// The window on the paper's scene with the panel open and settings for short runs.
fn window(size: [f32; 2], theme: egui::Theme) -> Harness<'static, App> {
    let mut harness = sized("spcmm", &[&[FAST], &PLAIN[..]].concat(), size, theme);
    click(&mut harness, Role::Button, "What play costs");
    set_number(&mut harness, "Duration", SPAN.duration);
    set_number(&mut harness, "Observed from", SPAN.from);
    harness
}

fn large() -> Harness<'static, App> {
    window([1280.0, 800.0], egui::Theme::Light)
}

/// Computes the whole study.
fn compute(harness: &mut Harness<'_, App>) {
    harness.get_by_role_and_label(Role::Button, "Start runs").scroll_to_me();
    harness.run();
    click(harness, Role::Button, "Start runs");
    wait(harness, |app| app.bench().cost_study().is_some() && !app.bench().is_computing_costs());
    harness.run();
}

/// The button of a bar's end, found by the beginning of its label: `Clearance of S1 0.15 mm:`.
fn bar_end<'h>(harness: &'h Harness<'_, App>, label: &'h str) -> egui_kittest::Node<'h> {
    harness.get_by_label_contains(label)
}

fn clearance(harness: &Harness<'_, App>, joint: &str) -> f64 {
    match harness.state().player().pending().get(&format!("joint.{joint}.clearance")) {
        Ok(Value::Number(si)) => si,
        other => panic!("{other:?}"),
    }
}

/// Drawn rectangles of each colour of [`COLOURS`].
fn bars(harness: &Harness<'_, App>) -> [Vec<Rect>; 2] {
    fn add(shape: &Shape, bars: &mut [Vec<Rect>; 2]) {
        match shape {
            Shape::Vec(shapes) => shapes.iter().for_each(|shape| add(shape, bars)),
            Shape::Rect(drawn) => {
                for (own, colour) in bars.iter_mut().zip(COLOURS) {
                    if drawn.fill == colour {
                        own.push(drawn.rect);
                    }
                }
            }
            _ => {}
        }
    }
    let mut bars = Default::default();
    for part in &harness.output().shapes {
        add(&part.shape, &mut bars);
    }
    bars
}

#[test]
fn the_tornado_shows_the_results_of_the_study() {
    let mut harness = large();
    let points = throttle_shared(&mut harness, 2);
    click(&mut harness, Role::Button, "Start runs");
    harness.run_steps(2);
    harness.get_by_label("Of the current setting; 0 of 7 runs");
    let label_rects = |harness: &Harness<'_, App>| {
        ["S1", "S2", "S3"].map(|joint| {
            let label = format!("Clearance of {joint} 0.15 mm");
            harness.get_by_label_contains(&label).rect()
        })
    };
    let first = label_rects(&harness);
    assert!(first[0].bottom() < first[1].top() && first[1].bottom() < first[2].top());
    for finished in 1..RUNS {
        points.set(1);
        harness.run_steps(2);
        harness.get_by_label(&format!("Of the current setting; {finished} of 7 runs"));
        assert_eq!(label_rects(&harness), first, "nothing moves while it computes");
        assert!(harness.state().bench().is_computing_costs());
    }
    let bar = harness.get_by_label("Computed so far");
    assert!(bar.accesskit_node().numeric_value().expect("a number") > 80.0);
    // Rows are not re-sorted under the pointer.
    harness.hover_at(first[1].center());
    points.set(1);
    harness.run_steps(3);
    assert!(!harness.state().bench().is_computing_costs());
    assert_eq!(label_rects(&harness), first);
    harness.hover_at(egui::pos2(700.0, 300.0));
    harness.run();

    // The results have the bits of the same runs outside the window.
    let scene = harness.state().player().pending();
    let nominal = scene.machine.contact.clearance;
    let over = ["S1", "S2", "S3"].map(|joint| (format!("joint.{joint}.clearance"), [0.5 * nominal, 1.5 * nominal]));
    let names: Vec<&str> = NAMED.iter().map(|named| named.name).collect();
    let study_outputs = outputs(scene, &names.join(",")).expect("outputs");
    let one_at_a_time = OneAtATimePlan::new(scene, &over).expect("a plan");
    let keys: Vec<String> = over.iter().map(|(key, _)| key.clone()).collect();
    let study = StudyRuns::new(scene, &keys, &study_outputs, SPAN, &one_at_a_time.rows()).expect("runs");
    let run = |index| {
        let mut block = study.sweep().begin(index);
        while !block.is_done() {
            block.advance(10_000);
        }
        study.outputs_of(&block.records())
    };
    let expected: Vec<Vec<f64>> = (0..RUNS).map(run).collect();
    let panel_study = harness.state().bench().cost_study().expect("a study");
    for output in 0..NAMED.len() {
        assert_eq!(panel_study.base(output), Some(expected[0][output]));
        for (index, run) in expected.iter().enumerate().skip(1) {
            assert_eq!(panel_study.end(output, (index - 1) / 2, (index - 1) % 2), Some(Some(run[output])));
        }
    }

    // Rows are sorted by the spread of the largest tip error; bars run from the base line to each end.
    let tip: Vec<f64> = expected.iter().map(|run| run[0]).collect();
    let spread = |input: usize| {
        let all = [tip[0], tip[1 + 2 * input], tip[2 + 2 * input]];
        all.iter().fold(f64::MIN, |a, b| a.max(*b)) - all.iter().fold(f64::MAX, |a, b| a.min(*b))
    };
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| spread(*b).total_cmp(&spread(*a)));
    let sorted = label_rects(&harness);
    assert!(order.windows(2).all(|pair| sorted[pair[0]].bottom() < sorted[pair[1]].top()), "{order:?} {sorted:?}");
    let bars = bars(&harness);
    let all = || bars.iter().flatten();
    let (left, right) =
        (all().map(|bar| bar.left()).fold(f32::MAX, f32::min), all().map(|bar| bar.right()).fold(f32::MIN, f32::max));
    let (min, max) = tip.iter().fold((f64::MAX, f64::MIN), |(a, b), &value| (a.min(value), b.max(value)));
    let x_of = |value: f64| left + ((value - min) / (max - min)) as f32 * (right - left);
    assert!(right - left > 80.0, "{left} {right}");
    for (end, bars) in bars.iter().enumerate() {
        assert_eq!(bars.len(), 3);
        for (row, bar) in bars.iter().enumerate() {
            let (base, tip_end) = (x_of(tip[0]), x_of(tip[1 + 2 * order[row] + end]));
            let (from, to) = (base.min(tip_end), base.max(tip_end));
            assert!((bar.left() - from).abs() < 0.1 && (bar.right() - to).abs() < 0.1, "{bar} {from} {to}");
        }
    }

    // The verdict says the same in a sentence, from the separate runs.
    let first = order[0];
    let [low, high] = [tip[1 + 2 * first], tip[2 + 2 * first]];
    let unit = if max < 1e-3 { "um" } else { "mm" };
    let shown = |si: f64| jointplay::units::format_quantity_digits(si, unit, 3);
    let bare = |si: f64| shown(si).split(' ').next().expect("a number").to_owned();
    let near = |other: &usize| spread(*other) >= 0.9 * spread(first);
    assert!(!order[1..].iter().any(near), "the sentence of a tie is another one");
    let [least, most] = [low.min(high).min(tip[0]), low.max(high).max(tip[0])];
    let moves = if (least, most) == (low.min(high), low.max(high)) {
        format!("from {} to {}", bare(low), shown(high))
    } else {
        format!("between {} and {}", bare(least), shown(most))
    };
    let joint = ["S1", "S2", "S3"][first];
    let moves = moves.replace("um", "µm");
    harness.get_by_label(&format!(
        "Clearance of {joint} matters most: ±0.15 mm there moves the largest tip error {moves}."
    ));
    harness.get_by_label("With the lower value");
    harness.get_by_label("With the upper value");

    // Another output can be shown from the same runs.
    harness.get_by_role_and_label(Role::ComboBox, "Effect on").click();
    harness.run();
    harness.get_by_role_and_label(Role::Button, "Peak normal force").click();
    harness.run();
    let words = format!("With the values of the scene: {}", value(expected[0][2], "N"));
    harness.get_by_label(&words);
}

/// A value as shown, with four digits.
fn value(si: f64, unit: &str) -> String {
    jointplay::units::format_quantity_digits(si, unit, 4)
}

#[test]
fn a_click_on_an_end_moves_the_slider_of_its_joint_and_is_undone() {
    let mut harness = large();
    compute(&mut harness);
    let original = clearance(&harness, "S2");
    harness.key_press(Key::C);
    harness.run();
    assert!(harness.query_by_label("Accuracy").is_none(), "the controls are closed");
    bar_end(&harness, "Clearance of S2 0.45 mm:").click();
    harness.run();
    assert_eq!(clearance(&harness, "S2"), 1.5 * original);
    let log = harness.state().player().log();
    let sets =
        |entry: &jointplay::app::Entry| matches!(&entry.event, Event::Set { key, .. } if key == "joint.S2.clearance");
    assert!(log.entries.iter().any(sets), "{log:?}");
    // The slider is visible and has the focus.
    let slider = harness.get_by_role_and_label(Role::Slider, "Clearance of S2");
    assert!(slider.accesskit_node().is_focused());
    assert!(Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(1280.0, 800.0)).contains_rect(slider.rect()));
    harness.get_by_label("Of an earlier setting. Clearance of S2: 0.3 mm instead of 0.45 mm");
    assert!(bars(&harness).iter().all(Vec::is_empty), "its bars are pale");
    assert_eq!(harness.state().undo_words(false).as_deref(), Some("Undo: Clearance of S2, to 0.3 mm"));
    harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    harness.run();
    assert_eq!(clearance(&harness, "S2"), original);
    harness.get_by_label("Of the current setting; 7 of 7 runs");
    assert_eq!(bars(&harness).map(|bars| bars.len()), [3, 3]);
    // The keyboard works as well.
    bar_end(&harness, "Clearance of S3 0.15 mm:").focus();
    harness.step();
    harness.key_press(Key::Enter);
    harness.run();
    assert_eq!(clearance(&harness, "S3"), 0.5 * original);
}

#[test]
fn closing_the_panel_cancels_the_study_and_discards_results() {
    let mut harness = large();
    let points = throttle(&mut harness);
    for close in ["What play costs", "Experiments", "tab"] {
        click(&mut harness, Role::Button, "Start runs");
        harness.run_steps(2);
        assert!(harness.state().bench().is_computing_costs());
        let running = Rc::strong_count(&points);
        match close {
            "tab" => click(&mut harness, Role::Button, "Order or chaos"),
            "Experiments" => click(&mut harness, Role::Button, "Experiments"),
            _ => harness.key_press(Key::W),
        }
        harness.run();
        assert_eq!(Rc::strong_count(&points), running - 1, "{close}: its worker has ended");
        let bench = harness.state().bench();
        assert!(!bench.is_computing_costs() && bench.cost_study().is_none() && !bench.shows_costs());
        assert!(!harness.state().shows_costs());
        harness.key_press(Key::W);
        harness.run();
        assert!(harness.state().shows_costs());
        harness.get_by_label("No results yet");
    }
}

#[test]
fn varied_parameters_and_ranges_can_be_chosen() {
    let mut harness = large();
    for name in ["Clearance", "Restitution"] {
        click(&mut harness, Role::CheckBox, name);
    }
    click(&mut harness, Role::Button, "Range");
    let before = named_controls(&harness);
    set_number(&mut harness, "Restitution from", 0.2);
    set_number(&mut harness, "Restitution to", 0.7);
    compute(&mut harness);
    let study = harness.state().bench().cost_study().expect("a study");
    let all = |ends| ["S1", "S2", "S3"].map(|joint| (format!("joint.{joint}.restitution"), ends));
    assert_eq!(study.task.over, all([0.2, 0.7]));
    bar_end(&harness, "Restitution of S1 0.7:");
    // The results add the choice of output and two bar ends per joint.
    assert_eq!(named_controls(&harness), before + 7);
    // A percentage is clipped to the parameter's range.
    click(&mut harness, Role::Button, "Percent");
    compute(&mut harness);
    let study = harness.state().bench().cost_study().expect("a study");
    assert_eq!(study.task.over, all([0.45, 1.0]));
    // A reversed range and an empty selection are refused.
    click(&mut harness, Role::Button, "Range");
    set_number(&mut harness, "Restitution to", 0.1);
    click(&mut harness, Role::Button, "Start runs");
    harness.get_by_label("Restitution: the first value must be below the second");
    click(&mut harness, Role::CheckBox, "Restitution");
    click(&mut harness, Role::Button, "Start runs");
    harness.get_by_label_contains("Nothing varies");
    assert!(!harness.state().bench().is_computing_costs());
}

#[test]
fn on_a_phone_the_slider_replaces_the_panel_until_it_is_reopened() {
    let mut harness = window([390.0, 844.0], egui::Theme::Light);
    compute(&mut harness);
    let end = bar_end(&harness, "Clearance of S1 0.45 mm:");
    end.scroll_to_me();
    harness.run();
    bar_end(&harness, "Clearance of S1 0.45 mm:").click();
    harness.run();
    let slider = harness.get_by_role_and_label(Role::Slider, "Clearance of S1");
    assert!(slider.accesskit_node().is_focused());
    let bottom = slider.rect().bottom();
    assert!(bottom < 844.0, "{bottom}");
    assert!(!harness.state().shows_costs());
    click(&mut harness, Role::Button, "Experiments");
    harness.run();
    harness.get_by_label_contains("Of an earlier setting.");
    bar_end(&harness, "Clearance of S1 0.45 mm:");
}

#[test]
fn the_panel_shows_what_is_stored() {
    for (name, size, theme) in [
        ("costs_light", [1280.0, 720.0], egui::Theme::Light),
        ("costs_dark", [1280.0, 720.0], egui::Theme::Dark),
        ("costs_phone", [390.0, 844.0], egui::Theme::Light),
        ("costs_lying", [844.0, 390.0], egui::Theme::Dark),
    ] {
        let mut harness = window(size, theme);
        compute(&mut harness);
        harness.remove_cursor();
        harness.run();
        compare_window(&mut harness, name);
        if let Some(keep) = std::env::var_os("KEEP_PICTURES") {
            let image = harness.render().expect("drawn");
            image.save(std::path::Path::new(&keep).join(format!("{name}.png"))).expect("writable");
        }
    }
}
