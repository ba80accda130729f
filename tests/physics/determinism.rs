//! The same calls give the same bits, and a state that is restored goes on as if nothing had happened.

use crate::common::{METHODS, SCENES, frame_now, scene, simulation};
use jointplay::simulate::{Frame, Simulation};

fn hash_after(changes: &[(&str, &str)], name: &str, end: f64) -> u64 {
    let mut simulation = simulation(name, changes);
    crate::common::run_until(&mut simulation, end);
    assert_eq!(simulation.time(), end);
    simulation.state_hash()
}

#[test]
fn repeated_runs_give_the_same_bits() {
    for name in SCENES {
        let mut hashes = Vec::new();
        for method in METHODS {
            let changes = [("solver.method", method)];
            let hash = hash_after(&changes, name, 0.03);
            assert_eq!(hash, hash_after(&changes, name, 0.03), "{name}, {method}");
            hashes.push(hash);
        }
        let changes = [("formulation", "lagrange"), ("solver.tolerance", "1e-5")];
        let hash = hash_after(&changes, name, 0.012);
        assert_eq!(hash, hash_after(&changes, name, 0.012), "{name}, lagrange");
        hashes.push(hash);
        // The hash sees the difference between methods; the automatic pair may be explicit all the way.
        hashes.sort_unstable();
        hashes.dedup();
        assert!(hashes.len() >= METHODS.len(), "{name}: {}", hashes.len());
    }
}

#[test]
fn sampling_changes_nothing() {
    for name in SCENES {
        for method in METHODS {
            for ideal in [false, true] {
                let mut changes = vec![("solver.method", method)];
                if ideal {
                    changes.push(("contact.clearance", "0"));
                }
                let mut plain = simulation(name, &changes);
                let mut sampled = simulation(name, &changes);
                let mut frame = Frame::default();
                let mut peaks = Vec::new();
                while plain.time() < 0.012 {
                    plain.step().unwrap();
                    sampled.step().unwrap();
                    let (from, to) = (sampled.step_start(), sampled.time());
                    for part in [0.0, 0.3, 1.0] {
                        sampled.sample(from + part * (to - from), &mut frame);
                    }
                    sampled.take_peaks(&mut peaks);
                    assert_eq!(plain.state_hash(), sampled.state_hash(), "{name}, {method}");
                }
                assert_eq!(plain.statistics(), sampled.statistics(), "{name}, {method}");
            }
        }
    }
}

/// Steps on, with the frame in the middle of the last step and the one at its end, as text: every bit that is no NaN's.
fn go_on(simulation: &mut Simulation, steps: u32) -> (u64, String) {
    for _ in 0..steps {
        simulation.step().unwrap();
    }
    let mut middle = Frame::default();
    let time = 0.5 * (simulation.step_start() + simulation.time());
    simulation.sample(time, &mut middle);
    let end = frame_now(simulation);
    let text = format!("{middle:?} {end:?} {:?}", simulation.statistics());
    (simulation.state_hash(), text)
}

#[test]
fn a_restored_state_goes_on_with_the_same_bits() {
    for name in SCENES {
        for method in METHODS {
            for form in ["tree", "lagrange"] {
                let changes = [("solver.method", method), ("formulation", form)];
                let mut simulation = simulation(name, &changes);
                // Somewhere inside the second contact of any joint.
                let mut limit = 0;
                while simulation.statistics().impacts.iter().sum::<u64>() < 2 {
                    simulation.step().unwrap();
                    limit += 1;
                    assert!(limit < 20_000, "{name}, {method}: no impact");
                }
                simulation.step().unwrap();
                let joints = simulation.scene().ball_joints.len();
                let touching = (0..joints).any(|j| simulation.contact_memory(j).active);
                assert!(touching, "{name}, {method}, {form}");
                let here = frame_now(&mut simulation);
                let snapshot = simulation.snapshot();
                let hash = simulation.state_hash();
                let first = go_on(&mut simulation, 150);
                simulation.restore(&snapshot);
                assert_eq!(simulation.state_hash(), hash);
                assert_eq!(format!("{:?}", frame_now(&mut simulation)), format!("{here:?}"));
                assert_eq!(go_on(&mut simulation, 150), first, "{name}, {method}, {form}");
                // Into one that never saw the run and has other settings.
                let mut fresh = Simulation::new(&scene(name, &[])).unwrap();
                fresh.restore(&snapshot);
                assert_eq!(fresh.state_hash(), hash);
                assert_eq!(go_on(&mut fresh, 150), first, "{name}, {method}, {form}");
            }
        }
    }
}

/// What a live change does not reach, as the scales of the tolerance, is the same for a copy.
#[test]
fn a_copy_goes_on_with_the_same_bits_after_live_changes() {
    for method in METHODS {
        let mut simulation = simulation("spcmm", &[("solver.method", method)]);
        simulation.advance_to(2e-3).unwrap();
        for (key, value) in [("contact.ball_radius", "4 mm"), ("gravity.z", "-5 m/s^2")] {
            simulation.set(key, value).unwrap();
        }
        let mut copy = Simulation::of(&simulation.snapshot());
        let first = go_on(&mut simulation, 100);
        assert_eq!(go_on(&mut copy, 100), first, "{method}");
        let later = simulation.snapshot();
        let first = go_on(&mut simulation, 50);
        copy.restore(&later);
        assert_eq!(go_on(&mut copy, 50), first, "{method}");
    }
}

#[test]
fn scenes_without_contacts_are_restored_too() {
    for name in ["spcmm", "slider-crank", "slider-crank-driven", "pendulum"] {
        for form in ["tree", "lagrange"] {
            let changes = [("contact.clearance", "0"), ("formulation", form)];
            let mut simulation = simulation(name, &changes);
            go_on(&mut simulation, 10);
            let snapshot = simulation.snapshot();
            let first = go_on(&mut simulation, 20);
            let mut fresh = Simulation::new(&scene(name, &[])).unwrap();
            fresh.restore(&snapshot);
            assert_eq!(go_on(&mut fresh, 20), first, "{name}, {form}");
        }
    }
}

#[test]
fn a_snapshot_keeps_a_clearance_on_its_way_and_changes_that_wait() {
    for method in METHODS {
        let mut simulation = simulation("spcmm", &[("solver.method", method)]);
        simulation.advance_to(0.05).unwrap();
        simulation.set("contact.clearance", "0.1 mm").unwrap();
        simulation.set("spcmm.frequency", "1 Hz").unwrap();
        simulation.set("contact.friction", "0.3").unwrap();
        simulation.advance_to(0.06).unwrap();
        let frame = frame_now(&mut simulation);
        let clearance = frame.joints[0].clearance;
        assert!(clearance > 0.1e-3 && clearance < 0.3e-3, "{clearance}");
        let snapshot = simulation.snapshot();
        let hash = simulation.state_hash();
        let first = go_on(&mut simulation, 300);
        let mut fresh = Simulation::new(&scene("spcmm", &[])).unwrap();
        fresh.restore(&snapshot);
        assert_eq!(fresh.state_hash(), hash);
        assert_eq!(go_on(&mut fresh, 300), first, "{method}");
        assert_eq!(fresh.running_scene().contact.friction, 0.3);
        fresh.reset().unwrap();
        assert_eq!(fresh.scene().spcmm.unwrap().frequency, 1.0);
        assert_eq!(fresh.running_scene().spcmm.unwrap().frequency, 1.0);
        assert_eq!(frame_now(&mut fresh).joints[0].clearance, 0.1e-3);
    }
}

#[test]
fn a_reset_is_a_new_start() {
    for name in SCENES {
        let mut simulation = simulation(name, &[]);
        let hash = simulation.state_hash();
        let first = go_on(&mut simulation, 200);
        simulation.reset().unwrap();
        assert_eq!(simulation.time(), 0.0);
        assert_eq!(simulation.state_hash(), hash);
        assert_eq!(go_on(&mut simulation, 200), first, "{name}");
    }
}

/// A slider-crank with an ideal joint and a pendulum whose loose balls start off the centres of their sockets.
fn eccentric() -> [(&'static str, String); 2] {
    let text = |name: &str, from: &str, to: &str| {
        let text = jointplay::scene::built_in_text(name).unwrap();
        assert!(text.contains(from));
        text.replace(from, to)
    };
    let slider = "position = \"200 mm\", velocity";
    [
        ("C", text("slider-crank", slider, "position = \"200.2 mm\", velocity")),
        ("S1", text("pendulum", "position = [0, 0, 0]", "position = \"0.2 0 0 mm\"")),
    ]
}

#[test]
fn a_state_is_restored_where_no_start_would_be_accepted() {
    for (joint, text) in eccentric() {
        for method in METHODS {
            for form in ["tree", "lagrange"] {
                let case = format!("{joint}, {method}, {form}");
                let changes = [("solver.method", method), ("formulation", form)];
                let scene = crate::common::parse(&text, &changes);
                let mut simulation = Simulation::new(&scene).unwrap();
                simulation.advance_to(1e-3).unwrap();
                let key = format!("joint.{joint}.clearance");
                simulation.set(&key, "0.05 mm").unwrap();
                assert!(Simulation::new(simulation.running_scene()).is_err(), "{case}");
                simulation.advance_to(4e-3).unwrap();
                let snapshot = simulation.snapshot();
                let (mut peaks, mut again) = (Vec::new(), Vec::new());
                simulation.take_peaks(&mut peaks);
                let statistics = simulation.statistics().clone();
                let first = go_on(&mut simulation, 100);
                let mut other = Simulation::new(&scene).unwrap();
                for target in [&mut simulation, &mut other] {
                    target.restore(&snapshot);
                    assert_eq!(*target.statistics(), statistics, "{case}");
                    target.take_peaks(&mut again);
                    assert_eq!(again, peaks, "{case}");
                    assert_eq!(go_on(target, 100), first, "{case}");
                }
            }
        }
    }
}
