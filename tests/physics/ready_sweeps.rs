//! The sweeps of the bench that are ready to run show what they say.

use std::ops::ControlFlow;

use crate::common::matrix::in_parallel;
use crate::common::simulation;
use jointplay::analysis::ready::{READY, ReadySweep};
use jointplay::analysis::sweep_task::{Share, SweptPoint};
use jointplay::analysis::task::{Job, Message, perform};

/// The points of a sweep that varies its parameter as `vary` says, with exponents or without.
fn points(ready: &ReadySweep, vary: Option<&str>, exponent: bool) -> Vec<SweptPoint> {
    let mut task = ready.task(&ready.scene().expect("a built-in scene"));
    task.exponent = exponent;
    if let Some(range) = vary {
        task.vary = vec![format!("{}={range}", ready.key)];
    }
    let mut points = Vec::new();
    perform(&Job::Sweep(task, Share::WHOLE), &mut || 0.0, &mut |message| {
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

fn named(name: &str) -> &'static ReadySweep {
    let found = READY.iter().find(|ready| ready.name == name);
    found.expect("a ready sweep")
}

#[test]
fn every_ready_sweep_has_a_sentence_and_a_range_that_its_scene_takes() {
    for ready in &READY {
        assert!(ready.shows.ends_with('.') && ready.shows.len() > 60, "{}", ready.name);
        let scene = ready.scene().expect("a built-in scene");
        assert_eq!(scene.name, ready.scene);
        for end in [ready.from, ready.to] {
            let mut scene = scene.clone();
            scene.set(ready.key, end).expect("in range");
        }
        // Enough sections for the 0-1 test, which decides about chaos here.
        let kept = ready.periods - ready.discard;
        assert!(kept >= 40 || ready.name == "Clearance alone does not cause chaos", "{}", ready.name);
    }
}

#[test]
#[ignore = "full: minutes"]
fn full_the_road_to_chaos_begins_with_knocks() {
    let ready = named("Road to chaos");
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
        // Contacts that begin in the kept turns.
        let mut run = simulation(ready.scene, &[(ready.key, &value)]);
        let impacts = [ready.discard, ready.periods].map(|turns| {
            run.advance_to(point.first + turns as f64 * point.interval).unwrap();
            run.statistics().impacts.iter().sum::<u64>()
        });
        assert_eq!(impacts[1] > impacts[0], speed >= 24, "{value}: {impacts:?}");
    });
    let ends = points(ready, Some("23 rad/s..31 rad/s:2"), true);
    parts_from(&ends[1], &ends[0]);
}

#[test]
#[ignore = "full: ten seconds"]
fn full_friction_ends_the_chaos_of_the_slider_crank() {
    let ready = named("Friction ends chaos");
    let regime = |value: &str| points(ready, Some(&format!("{value}..{value}:1")), false)[0].regime.clone();
    assert_eq!(regime("0.003"), "chaotic");
    assert_eq!(regime("0.008"), "periodic 1");
    let ends = points(ready, Some("0..0.016:2"), true);
    parts_from(&ends[0], &ends[1]);
}

/// Neighbouring motions part in the one and do not in the other, by far more than the exponents' errors.
fn parts_from(chaotic: &SweptPoint, regular: &SweptPoint) {
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

fn repeats(vary: Option<&str>, values: usize) {
    let points = points(named("Clearance alone does not cause chaos"), vary, false);
    assert_eq!(points.len(), values);
    for point in points {
        assert_eq!(point.regime, "periodic 1", "{:?}", point.settings);
    }
}

#[test]
fn the_machine_of_the_paper_repeats_with_little_play_and_with_much() {
    repeats(Some("0.01 mm..1 mm:2"), 2);
}

#[test]
#[ignore = "full: three seconds"]
fn full_the_machine_of_the_paper_repeats_whatever_its_play() {
    repeats(None, named("Clearance alone does not cause chaos").values);
}
