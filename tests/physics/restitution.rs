//! The restitution check: each impact reports the requested coefficient, the one its law gives, and the achieved one.

use crate::common::{Changes, METHODS, live, parse, simulation};
use jointplay_physics::contact::{NormalLaw, undisturbed_restitution};
use jointplay_physics::simulate::{Doubt, Impact, Simulation};
use jointplay_scene::{LiveScene, built_in_text};

/// All impacts that end before `end`, collected step by step.
fn impacts(simulation: &mut Simulation, end: f64) -> Vec<Impact> {
    let mut impacts = Vec::new();
    while simulation.time() < end {
        simulation.step().unwrap();
        impacts.extend(simulation.take_impacts());
    }
    impacts
}

fn impacts_of(name: &str, changes: &Changes, end: f64) -> Vec<Impact> {
    impacts(&mut simulation(name, changes), end)
}

/// The pendulum's rod moving along its axis without gravity or friction: only the law of its single contact acts.
fn axial_impact(changes: &Changes) -> LiveScene {
    let text = built_in_text("pendulum").unwrap();
    let start = "rotation = { axis = [0, 1, 0], angle = \"-30 deg\" }";
    assert!(text.contains(start));
    let text = text.replace(start, "velocity = \"0 0 -0.1 m/s\"");
    let mut all = vec![("gravity.z", "0"), ("contact.friction", "0")];
    all.extend(changes);
    LiveScene::new(&parse(&text, &all)).unwrap()
}

#[test]
fn an_undisturbed_impact_has_the_restitution_of_its_law() {
    let laws = [
        ("gonthier", "0.5", NormalLaw::Gonthier),
        ("gonthier", "0.2", NormalLaw::Gonthier),
        ("lankarani-nikravesh", "0", NormalLaw::LankaraniNikravesh),
        ("lankarani-nikravesh", "0.9", NormalLaw::LankaraniNikravesh),
        ("hertz", "0.9", NormalLaw::Hertz),
        ("flores", "0.7", NormalLaw::Flores),
    ];
    for (word, restitution, law) in laws {
        let requested: f64 = restitution.parse().unwrap();
        let expected = undisturbed_restitution(law.damping_factor(requested));
        for method in METHODS {
            let changes = [
                ("contact.normal_law", word),
                ("contact.restitution", restitution),
                ("solver.method", method),
                ("solver.step", "2 us"),
                ("solver.steps_per_impact", "64"),
            ];
            // First order: errors of some parts in a thousand at 2 us.
            let bound = 1e-3;
            let impacts = impacts(&mut axial_impact(&changes), 0.02);
            let first = impacts.first().unwrap();
            let case = format!("{word} {restitution}, {method}: {first:?}");
            println!("{case}: gave {:.5}, law {expected:.5}", first.achieved());
            assert_eq!((first.requested, first.joint), (requested, 0), "{case}");
            assert!((first.law - expected).abs() < 1e-12, "{case}");
            assert!((first.achieved() - expected).abs() < bound, "{case}");
            assert!(!first.disturbed && !first.below_speed_floor, "{case}");
            assert!(first.end > first.start && first.steps > 5, "{case}");
        }
    }
    let zero = undisturbed_restitution(NormalLaw::LankaraniNikravesh.damping_factor(0.0));
    assert!((zero - 0.66).abs() < 5e-3, "{zero}");
}

#[test]
fn above_the_yield_speed_the_restitution_falls_with_the_fourth_root_of_the_speed() {
    for (word, law) in [("gonthier", NormalLaw::Gonthier), ("flores", NormalLaw::Flores)] {
        for method in METHODS {
            let changes = [
                ("contact.normal_law", word),
                ("contact.restitution", "0.8"),
                ("contact.yield_speed", "20 mm/s"),
                ("contact.impact_speed_floor", "0.1 mm/s"),
                ("solver.method", method),
                ("solver.step", "2 us"),
                ("solver.steps_per_impact", "64"),
            ];
            // From wall to wall, slower each time: from 100 mm/s to where nothing yields.
            let impacts = impacts(&mut axial_impact(&changes), 0.2);
            let mut yielding = 0;
            for impact in &impacts {
                let speed = impact.approach_speed;
                let asked = if speed > 0.02 { 0.8 * (0.02 / speed).powf(0.25) } else { 0.8 };
                let given = undisturbed_restitution(law.damping_factor(asked));
                assert!((impact.requested - asked).abs() < 1e-12, "{word} {method}: {impact:?}");
                assert!((impact.law - given).abs() < 1e-12, "{word} {method}: {impact:?}");
                assert!((impact.achieved() - given).abs() < 1e-3, "{word} {method}: {impact:?}");
                yielding += usize::from(speed > 0.02);
            }
            println!("{word} {method}: {yielding} of {}", impacts.len());
            assert!((3..impacts.len() - 1).contains(&yielding), "{word} {method}: {yielding} of {}", impacts.len());
        }
    }
}

#[test]
fn a_yielding_impact_is_stepped_as_one_of_its_restitution() {
    let asked = format!("{:e}", 0.99 * 1e-3_f64.powf(0.25));
    for method in METHODS {
        let first = |restitution: &str, yield_speed: &str| {
            let changes = [
                ("contact.normal_law", "gonthier"),
                ("contact.impact_speed_floor", "0.01 mm/s"),
                ("solver.method", method),
                ("contact.restitution", restitution),
                ("contact.yield_speed", yield_speed),
            ];
            impacts(&mut axial_impact(&changes), 0.02)[0]
        };
        let (yielding, set) = (first("0.99", "0.1 mm/s"), first(&asked, "0 m/s"));
        assert_eq!(yielding.steps, set.steps, "{method}");
        assert!((yielding.achieved() - set.achieved()).abs() < 1e-9, "{method}: {yielding:?} {set:?}");
    }
}

#[test]
fn slow_impacts_after_a_yielding_one_leave_no_doubt_of_its_damping() {
    let changes = [
        ("contact.normal_law", "gonthier"),
        ("contact.restitution", "0.99"),
        ("contact.yield_speed", "10 mm/s"),
        ("contact.impact_speed_floor", "0.1 mm/s"),
    ];
    let mut simulation = simulation("ball", &changes);
    let mut in_an_impact = false;
    while simulation.time() < 6.0 {
        simulation.step().unwrap();
        in_an_impact |= simulation.contact_states(0).iter().any(|state| state.active);
        if in_an_impact {
            let doubts = simulation.doubts();
            assert!(!doubts.iter().any(|doubt| matches!(doubt, Doubt::Damping { .. })), "{doubts:?}");
        }
    }
    assert!(simulation.statistics().impacts() > 64);
    assert!(simulation.statistics().joints[0].damping > 1.0);
}

#[test]
fn a_yield_speed_above_all_impacts_changes_no_bit_and_needs_something_that_can_fall() {
    for method in METHODS {
        let [without, with] = ["0 m/s", "1 m/s"].map(|speed| {
            let changes = [("contact.yield_speed", speed), ("solver.method", method)];
            let mut simulation = simulation("spcmm", &changes);
            simulation.advance_to(0.02).unwrap();
            assert!(simulation.statistics().impacts() > 3);
            simulation.state_hash()
        });
        assert_eq!(without, with, "{method}");
    }
    for (changes, words) in [
        ([("contact.approach_speed", "largest")], "approach_speed"),
        ([("contact.restitution", "1")], "restitution below 1"),
        ([("contact.normal_law", "hertz")], "normal_law with damping"),
    ] {
        let all = [
            ("contact.yield_speed".to_owned(), "10 mm/s".to_owned()),
            (changes[0].0.to_owned(), changes[0].1.to_owned()),
        ];
        let error = jointplay_scene::Scene::load("spcmm", &all).expect_err(words).to_string();
        assert!(error.contains(words) && error.contains("yield_speed") && error.contains("0 m/s"), "{error}");
    }
    // From now on.
    let mut simulation = axial_impact(&[("contact.normal_law", "gonthier"), ("contact.restitution", "0.8")]);
    assert_eq!(simulation.set("contact.yield_speed", "10 mm/s"), Ok(jointplay_physics::simulate::Effect::Now));
    let first = impacts(&mut simulation, 0.02)[0];
    assert!((first.requested - 0.8 * 0.1_f64.powf(0.25)).abs() < 1e-12, "{first:?}");
}

#[test]
fn an_impact_reports_its_depth_force_and_time() {
    let mut simulation = axial_impact(&[("contact.normal_law", "hertz"), ("solver.tolerance", "1e-10")]);
    let first = impacts(&mut simulation, 0.01)[0];
    let k = simulation.mechanism().contacts.coefficients(0).elastic.stiffness;
    // Elastic: the peak is at the deepest point.
    let peak = k * first.deepest.powf(1.5);
    assert!((first.peak / peak - 1.0).abs() < 1e-4, "{first:?}");
    let statistics = simulation.statistics();
    assert!((first.peak / statistics.joints[0].peak_normal - 1.0).abs() < 1e-9);
    // 2.94 delta / v.
    let duration = first.end - first.start;
    let expected = 2.943 * first.deepest / first.approach_speed;
    assert!((duration / expected - 1.0).abs() < 1e-2, "{duration} {expected}");
}

#[test]
fn slow_impacts_are_flagged() {
    let changes = [("contact.impact_speed_floor", "0.5 m/s")];
    let impacts = impacts(&mut axial_impact(&changes), 0.01);
    assert!(impacts[0].below_speed_floor && impacts[0].achieved() > impacts[0].law + 0.01, "{:?}", impacts[0]);
}

#[test]
fn impacts_among_other_contacts_are_flagged() {
    let impacts = impacts_of("spcmm", &[], 0.012);
    // Reference values of the default scene: (joint, start in ms, approach speed in m/s, disturbed); the first three overlap.
    let references = [
        (2, 7.807810294, 0.07682235, true),
        (1, 7.807677416, 0.07687389, true),
        (0, 7.801422908, 0.07690900, true),
        (1, 10.01967, 0.06366, false),
        (0, 10.50063, 0.07533, false),
    ];
    for (impact, (joint, start, speed, disturbed)) in impacts.iter().zip(references) {
        assert_eq!((impact.joint, impact.disturbed), (joint, disturbed), "{impact:?}");
        assert!((1e3 * impact.start - start).abs() < 1e-4, "{impact:?}");
        assert!((impact.approach_speed / speed - 1.0).abs() < 1e-3, "{impact:?}");
        assert_eq!(impact.requested, 0.9);
        assert!((impact.law - 0.913).abs() < 1e-3);
        assert!((0.8..0.92).contains(&impact.achieved()), "{impact:?}");
        assert!(impact.steps >= 10, "{impact:?}");
    }
    // Unflagged impacts do not overlap with any other.
    for a in impacts.iter().filter(|a| !a.disturbed) {
        for b in impacts.iter().filter(|b| b.joint != a.joint) {
            assert!(b.end < a.start || b.start > a.end, "{a:?} {b:?}");
        }
    }
}

#[test]
fn methods_agree_about_the_first_impacts() {
    let reference = impacts_of("pendulum", &[("solver.method", "dopri5"), ("solver.tolerance", "1e-10")], 0.02);
    assert!(reference.len() >= 2);
    for method in METHODS {
        let changes = [("solver.method", method), ("solver.step", "2 us"), ("solver.steps_per_impact", "64")];
        let impacts = impacts_of("pendulum", &changes, 0.02);
        for (a, b) in impacts.iter().zip(&reference).take(2) {
            println!("{method}: {:.5} against {:.5}", a.achieved(), b.achieved());
            assert!((a.achieved() - b.achieved()).abs() < 1e-2, "{method}: {a:?} {b:?}");
            assert!((a.start - b.start).abs() < 2e-5, "{method}: {a:?} {b:?}");
            assert!((a.peak / b.peak - 1.0).abs() < 3e-2, "{method}: {a:?} {b:?}");
            assert!((a.deepest / b.deepest - 1.0).abs() < 2e-2, "{method}: {a:?} {b:?}");
        }
    }
    // At 10 us a fixed-step method takes about fifteen steps per impact, and reports that.
    let coarse = impacts_of("pendulum", &[("solver.method", "rk4")], 0.01);
    assert!((10..20).contains(&coarse[0].steps), "{:?}", coarse[0]);
}

#[test]
fn a_live_change_disturbs_an_impact_or_ends_it() {
    let in_contact = || {
        let mut simulation = live("pendulum", &[]);
        while !simulation.contact_states(0)[0].active {
            simulation.step().unwrap();
        }
        for _ in 0..3 {
            simulation.step().unwrap();
        }
        simulation
    };
    let mut softened = in_contact();
    softened.set("contact.youngs_modulus", "100 GPa").unwrap();
    let recorded = impacts(&mut softened, 0.009);
    assert!(recorded[0].disturbed, "{:?}", recorded[0]);
    let mut released = in_contact();
    released.set("contact.clearance", "0.5 mm").unwrap();
    let recorded = impacts(&mut released, 0.009);
    assert!(recorded.is_empty(), "{recorded:?}");
}

#[test]
fn recent_impacts_are_kept_all_can_be_taken_and_snapshots_contain_them() {
    let mut simulation = live("chain", &[]);
    let mut taken = Vec::new();
    while taken.len() < 150 {
        simulation.step().unwrap();
        taken.extend(simulation.take_impacts());
    }
    let started: u64 = simulation.statistics().impacts();
    let joints = simulation.machine().loose_joints.len();
    let touching = (0..joints).flat_map(|j| simulation.contact_states(j)).filter(|contact| contact.active);
    assert_eq!(started as usize, taken.len() + touching.count());
    let latest: Vec<Impact> = simulation.impacts().copied().collect();
    assert_eq!(latest.len(), 64);
    assert_eq!(latest, taken[taken.len() - 64..]);
    assert!(taken.windows(2).all(|pair| pair[0].end <= pair[1].end));

    let snapshot = simulation.snapshot();
    let continue_run = |simulation: &mut LiveScene| {
        let end = simulation.machine().solver.step * 2000.0 + simulation.time();
        let mut more = Vec::new();
        while simulation.time() < end {
            simulation.step().unwrap();
            more.extend(simulation.take_impacts());
        }
        more
    };
    let first = continue_run(&mut simulation);
    assert!(!first.is_empty());
    simulation.restore(&snapshot);
    assert_eq!(simulation.impacts().copied().collect::<Vec<_>>(), latest);
    assert_eq!(continue_run(&mut simulation), first);
    simulation.reset().unwrap();
    assert_eq!(simulation.impacts().len(), 0);
}

/// The pendulum's rod upright, its ball touching the bottom of its socket at 2 mm/s and then pressed by a hundred times its weight,
/// like a softly touching joint hit by its neighbour.
fn struck_contact(method: &str, approach_speed: &str) -> LiveScene {
    let text = built_in_text("pendulum").unwrap();
    let start = "position = [0, 0, 0]\nrotation = { axis = [0, 1, 0], angle = \"-30 deg\" }";
    assert!(text.contains(start));
    let touching = "position = \"0 0 -0.2999 mm\"\nvelocity = \"0 0 -0.002 m/s\"";
    let changes = [
        ("gravity.z", "0"),
        ("contact.friction", "0"),
        ("contact.approach_speed", approach_speed),
        ("solver.method", method),
        ("solver.step", "0.2 us"),
        ("solver.tolerance", "1e-9"),
        ("solver.steps_per_impact", "256"),
    ];
    let mut simulation = LiveScene::new(&parse(&text.replace(start, touching), &changes)).unwrap();
    while !simulation.contact_states(0)[0].active {
        simulation.step().unwrap();
    }
    simulation.set("gravity.z", "-981 m/s^2").unwrap();
    simulation
}

/// An independent integration of the same contact: m x'' = m g - K x^1.5 (1 + chi x' / v0), where v0 is the largest rate so far
/// or stays at its initial value. Returns the largest force and the largest ratio of damping to elastic force in the first 200 us.
fn reference_contact(largest: bool) -> (f64, f64) {
    let scene = crate::common::scene("pendulum", &[]);
    let c = jointplay_physics::contact::Coefficients::new(&scene.machine.contact, scene.machine.contact.clearance);
    let (mass, g, h) = (scene.machine.bodies[0].mass, 981.0, 1e-9);
    let (mut x, mut v, mut v0) = (0.0_f64, 2e-3_f64, 2e-3_f64);
    let (mut force, mut ratio) = (0.0_f64, 0.0_f64);
    for _ in 0..200_000 {
        let force_at = |x: f64, v: f64| c.normal_force(x, v, if largest { v0.max(v) } else { v0 });
        let middle = v + 0.5 * h * (g - force_at(x, v) / mass);
        v += h * (g - force_at(x + 0.5 * h * v, middle) / mass);
        x += h * middle;
        if largest {
            v0 = v0.max(v);
        }
        force = force.max(c.normal_force(x, v, v0));
        ratio = ratio.max(c.damping * v / v0);
    }
    (force, ratio)
}

#[test]
fn damping_of_a_joint_hit_again_is_bounded_by_chi_with_the_largest_speed() {
    for (word, largest) in [("start", false), ("largest", true)] {
        let (force, ratio) = reference_contact(largest);
        let chi = NormalLaw::LankaraniNikravesh.damping_factor(0.9);
        assert_eq!(ratio > 1.01 * chi, !largest, "{ratio}");
        for method in METHODS {
            let mut simulation = struck_contact(method, word);
            let start = simulation.time();
            while simulation.time() < start + 2e-4 {
                simulation.step().unwrap();
            }
            let statistics = simulation.statistics();
            let (peak, damping) = (statistics.joints[0].peak_normal, statistics.joints[0].damping);
            let ledger = simulation.ledger().unwrap();
            let case = format!("{word}, {method}: {peak} against {force}, {damping} against {ratio}");
            println!("{case}; residual {:.1e}", ledger.relative_residual());
            let bound = match method {
                // Its step is an eighth of the duration of such a slow impact.
                "discrete-gradient" => 2e-2,
                _ => 1e-5,
            };
            assert!((peak / force - 1.0).abs() < bound, "{case}");
            assert!((damping / ratio - 1.0).abs() < 2.0 * bound, "{case}");
            assert!(ledger.relative_residual().abs() < bound, "{case}: {ledger:?}");
            let has_doubt = simulation.doubts().iter().any(|doubt| matches!(doubt, Doubt::Damping { .. }));
            assert_eq!(has_doubt, !largest, "{case}");
        }
    }
}

#[test]
fn an_undisturbed_impact_is_the_same_with_start_and_with_largest_speed() {
    for method in METHODS {
        let first = |word: &str| {
            let changes = [
                ("solver.method", method),
                ("solver.step", "2 us"),
                ("solver.tolerance", "1e-9"),
                ("contact.approach_speed", word),
            ];
            impacts(&mut axial_impact(&changes), 0.01)[0]
        };
        let (start, largest) = (first("start"), first("largest"));
        for (a, b) in [(start.achieved(), largest.achieved()), (start.peak, largest.peak), (start.end, largest.end)] {
            assert!((a / b - 1.0).abs() < 1e-6, "{method}: {start:?} {largest:?}");
        }
        let chi = NormalLaw::LankaraniNikravesh.damping_factor(0.9);
        assert!((start.damping / chi - 1.0).abs() < 1e-2, "{method}: {start:?}");
    }
}

#[test]
fn damping_in_a_chain_is_bounded_by_chi_with_the_largest_speed() {
    for method in METHODS {
        for (word, bounded) in [("start", false), ("largest", true)] {
            let changes = [
                ("chain.links", "5"),
                ("contact.approach_speed", word),
                ("solver.method", method),
                ("solver.tolerance", "1e-5"),
            ];
            let mut simulation = simulation("chain", &changes);
            let impacts = impacts(&mut simulation, 0.04);
            let max_damping = impacts.iter().map(|impact| impact.damping).fold(0.0, f64::max);
            let chi = NormalLaw::LankaraniNikravesh.damping_factor(0.9);
            println!("{method}, {word}: {max_damping:.3} in {} impacts", impacts.len());
            assert_eq!(max_damping <= chi * (1.0 + 2e-6), bounded, "{method}, {word}: {max_damping}");
            assert!(simulation.statistics().joints.iter().all(|joint| !bounded || joint.damping <= chi * (1.0 + 2e-6)));
        }
    }
}
