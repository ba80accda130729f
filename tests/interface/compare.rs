//! Runs kept from before a change: their curves in the plots, and their machine side by side with the current one.

use eframe::egui::{self, Rect, Theme, accesskit::Role};
use egui_kittest::{Harness, kittest::Queryable as _};
use jointplay::app::{App, Player};
use jointplay::session::history::Bin;
use jointplay::simulate::{Frame, Quantity, Simulation};

use crate::hands::plain;
use crate::hands::window::click;
use crate::pixels::{Area, Picture};

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

/// Pixels at the edge of a shadow, whose dither depends on the place in the window.
const DITHERED: usize = 1;

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
    assert!(count_differing(&same, &same, middle, by) <= DITHERED);
    // Both views share one camera; a drag beside the machine turns it, in either of them. Names, too, stand alike from every side.
    for (half, offset) in [(before, [60.0, 20.0]), (now, [-50.0, 10.0]), (before, [40.0, -45.0]), (now, [90.0, 30.0])] {
        let start = half.min + egui::vec2(60.0, 120.0);
        harness.drag_at(start);
        harness.hover_at(start + egui::Vec2::from(offset));
        harness.run_steps(2);
        harness.drop_at(start + egui::Vec2::from(offset));
        harness.run_steps(30);
        let rotated = window_picture(&mut harness);
        assert!(count_differing(&same, &rotated, middle, 0) > 1000, "the view did not rotate");
        let differing = count_differing(&rotated, &rotated, middle, by);
        assert!(differing <= DITHERED, "{offset:?}: {differing}");
    }
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

/// Checks the last `window` seconds before `time`, s, in the record of `run`, which had no change up to `time`, against the values of
/// the same steps: the curves reach the instant, have no wide bins, and hold no value that did not occur there.
fn assert_true_curves(run: &Player, time: f64, window: f64) {
    let from = time - window;
    let mut simulation = Simulation::new(&run.running().machine).expect("starts");
    let (mut frame, mut samples) = (Frame::default(), Vec::new());
    while simulation.time() < time {
        simulation.step().expect("runs");
        let (start, end) = (simulation.step_start(), simulation.time());
        if end < from - 1e-4 {
            continue;
        }
        let parts = ((end - start) / 2e-7).ceil();
        for part in 0..=parts as u32 {
            let at = start + (end - start) * f64::from(part) / parts;
            simulation.sample(at, &mut frame);
            let joint = &frame.joints[0];
            samples.push((at, [joint.normal_force.norm(), joint.eccentricity.norm()]));
        }
    }
    let list = run.channels().list();
    let of = |quantity| list.iter().position(|channel| channel.quantity == quantity).expect("recorded");
    for (index, quantity) in [Quantity::NormalForce, Quantity::Eccentricity].into_iter().enumerate() {
        let mut bins = Vec::new();
        run.bins(of(quantity), from, time, 600, &mut bins);
        let name = format!("{quantity:?} to {time} s");
        let most = samples.iter().map(|(_, values)| values[index]).fold(0.0, f64::max);
        let ends = (bins.first().expect("recorded").from, bins.last().expect("recorded").to);
        assert!(ends.0 <= from + 0.01 * window && (-1e-9..3e-6).contains(&(ends.1 - time)), "{name}: only {ends:?}");
        for bin in &bins {
            let width = bin.to - bin.from;
            assert!(width <= (window / 200.0).max(3e-6), "{name}: {bin:?}");
            let inside = samples.iter().filter(|(at, _)| (bin.from - 1e-6..=bin.to + 1e-6).contains(at));
            let (least, greatest) = inside.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), (_, values)| {
                (a.min(values[index]), b.max(values[index]))
            });
            let margin = 0.005 * most + 1e-9;
            assert!(
                bin.least >= least - margin && bin.greatest <= greatest + margin,
                "{name}: {bin:?} {least} {greatest}"
            );
        }
    }
}

/// Times, s, shortly after the beginning of some impacts of the first joint of `run`.
fn touches(run: &Player, from: f64, to: f64) -> Vec<f64> {
    let all: Vec<f64> = run.contact_history().touches(0, from, to).collect();
    assert!(all.len() > 3, "{all:?}");
    [0, all.len() / 2, all.len() - 1].map(|index| all[index] + 1e-4).into()
}

/// A window on a machine that has rattled for 0.15 s.
fn rattling() -> Harness<'static, App> {
    let mut harness = plain("spcmm", &[], [1280.0, 800.0], Theme::Dark);
    harness.state_mut().run_to(0.15);
    harness.run_steps(2);
    harness
}

#[test]
fn a_slow_replay_shows_the_true_values_of_both_runs() {
    // A time scale at which the plots show half a millisecond.
    const SCALE: f64 = 1e-4;
    let mut harness = rattling();
    set(&mut harness, "Clearance", 0.9);
    harness.state_mut().reset();
    harness.run_steps(3);
    harness.state_mut().player_mut().pacer.set_scale(SCALE);
    let window = harness.state().player().automatic_window();
    let wanted = touches(harness.state().comparison().kept()[0].run(), 0.02, 0.12);
    for start in wanted {
        for time in [start, start + 2e-5, start + 0.3 * window] {
            harness.state_mut().player_mut().run_to(time);
            harness.run_steps(5);
            let app = harness.state();
            let kept = app.comparison().kept()[0].run();
            assert_eq!((kept.reached(), kept.pacer.shown()), (0.15, time));
            assert_true_curves(kept, time, window);
            assert_true_curves(app.player(), time, window);
        }
    }
    // Backwards, out of a long replay.
    let back = touches(harness.state().player(), 0.02, 0.1);
    for time in back.into_iter().rev() {
        harness.state_mut().player_mut().go_to(time);
        harness.run_steps(5);
        let app = harness.state();
        assert_true_curves(app.comparison().kept()[0].run(), time, window);
        assert_true_curves(app.player(), time, window);
    }
}

#[test]
fn a_change_in_the_past_leaves_a_fine_record_of_what_led_to_it() {
    let mut harness = rattling();
    harness.state_mut().player_mut().pacer.set_scale(1e-4);
    let window = harness.state().player().automatic_window();
    let time = touches(harness.state().player(), 0.02, 0.12)[1];
    harness.state_mut().player_mut().go_to(time);
    harness.run_steps(3);
    set(&mut harness, "Friction coefficient", 0.4);
    assert_eq!(harness.state().player().reached(), time);
    let ends = |run: &Player| {
        let bins = force(run, time - window, time);
        assert!(bins.iter().all(|bin| bin.to - bin.from < 3e-6), "{bins:?}");
        (bins[0].from, bins[bins.len() - 1].to)
    };
    // The kept run knows what came after it, so that its last bin ends at an edge.
    let kept = (harness.state().comparison().kept()[0].run(), 3e-6);
    for (run, most) in [(harness.state().player(), 1e-9), kept] {
        let (from, to) = ends(run);
        assert!(from <= time - 0.99 * window && (to - time).abs() < most, "{from} {to}");
    }
}
