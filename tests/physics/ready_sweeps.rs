//! The ready-made sweeps of the bench show what their descriptions state.

use std::ops::ControlFlow;

use crate::common::matrix::in_parallel;
use crate::common::simulation;
use jointplay_analysis::ready_sweeps::{READY_SWEEPS, ReadySweep};
use jointplay_analysis::sweep_task::{Share, SweptPoint};
use jointplay_analysis::task::{Job, Message, perform};

/// The points of a sweep that varies its parameter as `vary` says, with exponents or without.
fn points(ready: &ReadySweep, vary: Option<&str>, exponent: bool) -> Vec<SweptPoint> {
    let mut task = ready.task(&ready.scene().expect("a built-in scene"));
    task.exponent = exponent;
    if let Some(range) = vary {
        task.vary = vec![format!("{}={range}", ready.key)];
    }
    let mut points = Vec::new();
    perform(&Job::Sweep(task, Share::WHOLE), &mut |message| {
        match message {
            Message::Point(point) => points.push(*point),
            Message::Failed(why) => panic!("{}: {why}", ready.name),
            _ => {}
        }
        ControlFlow::Continue(())
    });
    points.sort_by_key(|point| point.index);
    points
}

fn sweep_named(name: &str) -> &'static ReadySweep {
    let sweep = READY_SWEEPS.iter().find(|ready| ready.name == name);
    sweep.expect("a ready sweep")
}

#[test]
fn every_ready_sweep_has_a_description_and_a_range_that_its_scene_accepts() {
    for ready in &READY_SWEEPS {
        assert!(ready.shows.ends_with('.') && ready.shows.len() > 60, "{}", ready.name);
        let scene = ready.scene().expect("a built-in scene");
        assert_eq!(scene.name, ready.scene);
        for end in [ready.from, ready.to] {
            let mut scene = scene.clone();
            scene.set(ready.key, end).expect("in range");
        }
        // Enough sections for the 0-1 test, which decides about chaos here.
        let evaluated = ready.periods - ready.discard;
        assert!(evaluated >= 40 || ready.name == "Clearance alone does not cause chaos", "{}", ready.name);
    }
}

#[test]
#[ignore = "long: minutes"]
fn long_the_road_to_chaos_begins_with_impacts() {
    let ready = sweep_named("Road to chaos");
    let speeds: Vec<usize> = (21..=45).collect();
    assert_eq!((ready.from, ready.to, ready.values), ("21 rad/s", "45 rad/s", speeds.len()));
    in_parallel(&speeds, |&speed| {
        let value = format!("{speed} rad/s");
        let point = &points(ready, Some(&format!("{value}..{value}:1")), false)[0];
        let regime = match speed {
            21..=23 | 27 => "periodic 1",
            29 => "periodic 2",
            _ => "chaotic",
        };
        assert_eq!(point.regime, regime, "{value}");
        if !(23..=24).contains(&speed) {
            return;
        }
        // Impacts up to the start and up to the end of the evaluated turns.
        let mut run = simulation(ready.scene, &[(ready.key, &value)]);
        let impacts = [ready.discard, ready.periods].map(|turns| {
            run.advance_to(point.first + turns as f64 * point.interval).unwrap();
            run.statistics().impacts()
        });
        assert_eq!(impacts[1] > impacts[0], speed >= 24, "{value}: {impacts:?}");
    });
    let ends = points(ready, Some("23 rad/s..31 rad/s:2"), true);
    assert_exponents(&ends[1], &ends[0]);
}

#[test]
#[ignore = "full: ten seconds"]
fn full_friction_ends_the_chaos_of_the_slider_crank() {
    let ready = sweep_named("Friction ends chaos");
    let regime = |value: &str| points(ready, Some(&format!("{value}..{value}:1")), false)[0].regime.clone();
    assert_eq!(regime("0.003"), "chaotic");
    assert_eq!(regime("0.008"), "periodic 1");
    let ends = points(ready, Some("0..0.016:2"), true);
    assert_exponents(&ends[0], &ends[1]);
}

/// Asserts that neighbouring motions diverge at the chaotic point only, by far more than the errors of the exponents.
fn assert_exponents(chaotic: &SweptPoint, regular: &SweptPoint) {
    let exponent = |point: &SweptPoint| {
        let (exponent, error) = point.exponent.expect("measured");
        (exponent, error.expect("with its error"))
    };
    let (value, error) = exponent(chaotic);
    assert!(value > 1.5 && value - 2.0 * error > 1.0, "{value} ± {error} 1/s");
    assert_eq!(chaotic.regime, "chaotic");
    let (value, error) = exponent(regular);
    assert!(value + 2.0 * error < 0.2, "{value} ± {error} 1/s");
    assert_eq!(regular.regime, "periodic 1");
}

fn assert_periodic(vary: Option<&str>, values: usize) {
    let points = points(sweep_named("Clearance alone does not cause chaos"), vary, false);
    assert_eq!(points.len(), values);
    for point in points {
        assert_eq!(point.regime, "periodic 1", "{:?}", point.settings);
    }
}

#[test]
fn the_machine_of_the_paper_is_periodic_with_little_and_much_play() {
    assert_periodic(Some("0.01 mm..1 mm:2"), 2);
}

#[test]
#[ignore = "full: three seconds"]
fn full_the_machine_of_the_paper_is_periodic_for_any_play() {
    assert_periodic(None, sweep_named("Clearance alone does not cause chaos").values);
}
