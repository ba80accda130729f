//! The restitution check: each impact says what was asked for, what its law gives, and what it really gave.

use crate::common::{Changes, METHODS, live, parse, simulation};
use jointplay::contact::{NormalLaw, damping_factor, undisturbed_restitution};
use jointplay::scene::{LiveScene, built_in_text};
use jointplay::simulate::{Doubt, Impact, Simulation};

/// All impacts that finish before `end`, taken step by step.
fn impacts(simulation: &mut Simulation, end: f64) -> Vec<Impact> {
    let mut found = Vec::new();
    while simulation.time() < end {
        simulation.step().unwrap();
        simulation.take_impacts(&mut found);
    }
    found
}

fn of(name: &str, changes: &Changes, end: f64) -> Vec<Impact> {
    impacts(&mut simulation(name, changes), end)
}

/// The pendulum's rod flung along its axis without gravity or friction: nothing but the law of its one contact acts.
fn flung(changes: &Changes) -> LiveScene {
    let text = built_in_text("pendulum").unwrap();
    let start = "rotation = { axis = [0, 1, 0], angle = \"-30 deg\" }";
    assert!(text.contains(start));
    let text = text.replace(start, "velocity = \"0 0 -0.1 m/s\"");
    let mut all = vec![("gravity.z", "0"), ("contact.friction", "0")];
    all.extend(changes);
    LiveScene::new(&parse(&text, &all)).unwrap()
}

#[test]
fn an_undisturbed_impact_gives_what_its_law_gives() {
    let laws = [
        ("gonthier", "0.5", NormalLaw::Gonthier),
        ("gonthier", "0.2", NormalLaw::Gonthier),
        ("lankarani-nikravesh", "0", NormalLaw::LankaraniNikravesh),
        ("lankarani-nikravesh", "0.9", NormalLaw::LankaraniNikravesh),
        ("hertz", "0.9", NormalLaw::Hertz),
        ("flores", "0.7", NormalLaw::Flores),
    ];
    for (word, restitution, law) in laws {
        let asked: f64 = restitution.parse().unwrap();
        let expected = undisturbed_restitution(damping_factor(law, asked));
        for method in METHODS {
            let changes = [
                ("contact.normal_law", word),
                ("contact.restitution", restitution),
                ("solver.method", method),
                ("solver.step", "2 us"),
                ("solver.steps_per_impact", "64"),
            ];
            // Euler's method is of first order: some parts in a thousand at 2 us.
            let bound = match method {
                "semi-implicit-euler" => 2e-2,
                _ => 1e-3,
            };
            let found = impacts(&mut flung(&changes), 0.02);
            let first = found.first().unwrap();
            let case = format!("{word} {restitution}, {method}: {first:?}");
            println!("{case}: gave {:.5}, law {expected:.5}", first.achieved());
            assert_eq!((first.asked, first.joint), (asked, 0), "{case}");
            assert!((first.law - expected).abs() < 1e-12, "{case}");
            assert!((first.achieved() - expected).abs() < bound, "{case}");
            assert!(!first.disturbed && !first.floored, "{case}");
            assert!(first.end > first.start && first.steps > 5, "{case}");
        }
    }
    let zero = undisturbed_restitution(damping_factor(NormalLaw::LankaraniNikravesh, 0.0));
    assert!((zero - 0.66).abs() < 5e-3, "{zero}");
}

#[test]
fn an_impact_reports_its_depth_force_and_time() {
    let mut simulation = flung(&[("contact.normal_law", "hertz"), ("solver.tolerance", "1e-10")]);
    let first = impacts(&mut simulation, 0.01)[0];
    let k = simulation.mechanism().contacts.coefficients(0).stiffness;
    // Elastic: the peak is at the deepest point.
    let peak = k * first.deepest.powf(1.5);
    assert!((first.peak / peak - 1.0).abs() < 1e-4, "{first:?}");
    let statistics = simulation.statistics();
    assert!((first.peak / statistics.peak_normal[0] - 1.0).abs() < 1e-9);
    // 2.94 delta / v.
    let lasted = first.end - first.start;
    let expected = 2.943 * first.deepest / first.approach_speed;
    assert!((lasted / expected - 1.0).abs() < 1e-2, "{lasted} {expected}");
}

#[test]
fn slow_impacts_are_flagged() {
    let changes = [("contact.impact_speed_floor", "0.5 m/s")];
    let found = impacts(&mut flung(&changes), 0.01);
    assert!(found[0].floored && found[0].achieved() > found[0].law + 0.01, "{:?}", found[0]);
}

#[test]
fn impacts_among_other_contacts_are_flagged() {
    let found = of("spcmm", &[], 0.012);
    // Anchors of the default scene: (joint, start in ms, approach speed in m/s); the first three overlap.
    let anchors = [
        (2, 7.807810294, 0.07682235, true),
        (1, 7.807677416, 0.07687389, true),
        (0, 7.801422908, 0.07690900, true),
        (1, 10.01967, 0.06366, false),
        (0, 10.50063, 0.07533, false),
    ];
    for (impact, (joint, start, speed, disturbed)) in found.iter().zip(anchors) {
        assert_eq!((impact.joint, impact.disturbed), (joint, disturbed), "{impact:?}");
        assert!((1e3 * impact.start - start).abs() < 1e-4, "{impact:?}");
        assert!((impact.approach_speed / speed - 1.0).abs() < 1e-3, "{impact:?}");
        assert_eq!(impact.asked, 0.9);
        assert!((impact.law - 0.913).abs() < 1e-3);
        assert!((0.8..0.92).contains(&impact.achieved()), "{impact:?}");
        assert!(impact.steps >= 10, "{impact:?}");
    }
    // No two in contact at once, where nothing is flagged.
    for a in found.iter().filter(|a| !a.disturbed) {
        for b in found.iter().filter(|b| b.joint != a.joint) {
            assert!(b.end < a.start || b.start > a.end, "{a:?} {b:?}");
        }
    }
}

#[test]
fn methods_agree_about_the_first_impacts() {
    let reference = of("pendulum", &[("solver.method", "dopri5"), ("solver.tolerance", "1e-10")], 0.02);
    assert!(reference.len() >= 2);
    for method in METHODS {
        let changes = [("solver.method", method), ("solver.step", "2 us"), ("solver.steps_per_impact", "64")];
        let found = of("pendulum", &changes, 0.02);
        for (a, b) in found.iter().zip(&reference).take(2) {
            println!("{method}: {:.5} against {:.5}", a.achieved(), b.achieved());
            assert!((a.achieved() - b.achieved()).abs() < 1e-2, "{method}: {a:?} {b:?}");
            assert!((a.start - b.start).abs() < 2e-5, "{method}: {a:?} {b:?}");
            assert!((a.peak / b.peak - 1.0).abs() < 3e-2, "{method}: {a:?} {b:?}");
            assert!((a.deepest / b.deepest - 1.0).abs() < 2e-2, "{method}: {a:?} {b:?}");
        }
    }
    // At 10 us a fixed step takes some fifteen steps through an impact, and says so.
    let coarse = of("pendulum", &[("solver.method", "rk4")], 0.01);
    assert!((10..20).contains(&coarse[0].steps), "{:?}", coarse[0]);
}

#[test]
fn a_live_change_disturbs_an_impact_or_ends_it() {
    let until_touching = || {
        let mut simulation = live("pendulum", &[]);
        while !simulation.contact_state(0).active {
            simulation.step().unwrap();
        }
        for _ in 0..3 {
            simulation.step().unwrap();
        }
        simulation
    };
    let mut softened = until_touching();
    softened.set("contact.youngs_modulus", "100 GPa").unwrap();
    let found = impacts(&mut softened, 0.009);
    assert!(found[0].disturbed, "{:?}", found[0]);
    let mut released = until_touching();
    released.set("contact.clearance", "0.5 mm").unwrap();
    let found = impacts(&mut released, 0.009);
    assert!(found.is_empty(), "{found:?}");
}

#[test]
fn the_latest_are_kept_all_can_be_taken_and_snapshots_hold_them() {
    let mut simulation = live("chain", &[]);
    let mut taken = Vec::new();
    while taken.len() < 150 {
        simulation.step().unwrap();
        simulation.take_impacts(&mut taken);
    }
    let begun: u64 = simulation.statistics().impacts.iter().sum();
    let joints = simulation.machine().ball_joints.len();
    let touching = (0..joints).filter(|&j| simulation.contact_state(j).active);
    assert_eq!(begun as usize, taken.len() + touching.count());
    let latest: Vec<Impact> = simulation.impacts().copied().collect();
    assert_eq!(latest.len(), 64);
    assert_eq!(latest, taken[taken.len() - 64..]);
    assert!(taken.windows(2).all(|pair| pair[0].end <= pair[1].end));

    let snapshot = simulation.snapshot();
    let go_on = |simulation: &mut LiveScene| {
        let end = simulation.machine().solver.step * 2000.0 + simulation.time();
        let mut more = Vec::new();
        while simulation.time() < end {
            simulation.step().unwrap();
            simulation.take_impacts(&mut more);
        }
        more
    };
    let first = go_on(&mut simulation);
    assert!(!first.is_empty());
    simulation.restore(&snapshot);
    assert_eq!(simulation.impacts().copied().collect::<Vec<_>>(), latest);
    assert_eq!(go_on(&mut simulation), first);
    simulation.reset().unwrap();
    assert_eq!(simulation.impacts().len(), 0);
}

/// The pendulum's rod upright, its ball about to touch the bottom of its socket at 2 mm/s, and then under a hundred times its
/// weight: what a blow by a neighbour does to a joint that touches softly.
fn struck(method: &str, approach_speed: &str) -> LiveScene {
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
    while !simulation.contact_state(0).active {
        simulation.step().unwrap();
    }
    simulation.set("gravity.z", "-981 m/s^2").unwrap();
    simulation
}

/// The same by itself: m x'' = m g - K x^1.5 (1 + chi x' / v0), where v0 is the largest rate so far or stays that of the start.
/// Returns the largest force and the largest damping over elastic force of the first 200 us.
fn blow(largest: bool) -> (f64, f64) {
    let scene = crate::common::scene("pendulum", &[]);
    let c = jointplay::contact::Coefficients::new(&scene.machine.contact, scene.machine.contact.clearance);
    let (mass, g, h) = (scene.machine.bodies[0].mass, 981.0, 1e-9);
    let (mut x, mut v, mut v0) = (0.0_f64, 2e-3_f64, 2e-3_f64);
    let (mut force, mut ratio) = (0.0_f64, 0.0_f64);
    for _ in 0..200_000 {
        let of = |x: f64, v: f64| c.normal_force(x, v, if largest { v0.max(v) } else { v0 });
        let middle = v + 0.5 * h * (g - of(x, v) / mass);
        v += h * (g - of(x + 0.5 * h * v, middle) / mass);
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
fn damping_of_a_joint_that_is_hit_again_stays_at_chi_by_the_largest_speed() {
    for (word, largest) in [("start", false), ("largest", true)] {
        let (force, ratio) = blow(largest);
        let chi = damping_factor(NormalLaw::LankaraniNikravesh, 0.9);
        assert_eq!(ratio > 1.01 * chi, !largest, "{ratio}");
        for method in METHODS {
            let mut simulation = struck(method, word);
            let start = simulation.time();
            while simulation.time() < start + 2e-4 {
                simulation.step().unwrap();
            }
            let statistics = simulation.statistics();
            let (peak, damping) = (statistics.peak_normal[0], statistics.damping[0]);
            let ledger = simulation.ledger().unwrap();
            let case = format!("{word}, {method}: {peak} against {force}, {damping} against {ratio}");
            println!("{case}; residual {:.1e}", ledger.relative_residual());
            let bound = match method {
                "semi-implicit-euler" => 5e-3,
                // It takes an eighth of the time of such a slow impact in a step.
                "discrete-gradient" => 2e-2,
                _ => 1e-5,
            };
            assert!((peak / force - 1.0).abs() < bound, "{case}");
            assert!((damping / ratio - 1.0).abs() < 2.0 * bound, "{case}");
            assert!(ledger.relative_residual().abs() < bound, "{case}: {ledger:?}");
            let said = simulation.doubts().iter().any(|doubt| matches!(doubt, Doubt::Damping { .. }));
            assert_eq!(said, !largest, "{case}");
        }
    }
}

#[test]
fn an_undisturbed_impact_is_the_same_by_the_start_and_by_the_largest_speed() {
    for method in METHODS {
        let first = |word: &str| {
            let changes = [
                ("solver.method", method),
                ("solver.step", "2 us"),
                ("solver.tolerance", "1e-9"),
                ("contact.approach_speed", word),
            ];
            impacts(&mut flung(&changes), 0.01)[0]
        };
        let (start, largest) = (first("start"), first("largest"));
        for (a, b) in [(start.achieved(), largest.achieved()), (start.peak, largest.peak), (start.end, largest.end)] {
            assert!((a / b - 1.0).abs() < 1e-6, "{method}: {start:?} {largest:?}");
        }
        let chi = damping_factor(NormalLaw::LankaraniNikravesh, 0.9);
        assert!((start.damping / chi - 1.0).abs() < 1e-2, "{method}: {start:?}");
    }
}

#[test]
fn damping_in_a_chain_stays_at_chi_by_the_largest_speed() {
    for method in METHODS {
        for (word, bounded) in [("start", false), ("largest", true)] {
            let changes = [
                ("chain.links", "5"),
                ("contact.approach_speed", word),
                ("solver.method", method),
                ("solver.tolerance", "1e-5"),
            ];
            let mut simulation = simulation("chain", &changes);
            let found = impacts(&mut simulation, 0.04);
            let most = found.iter().map(|impact| impact.damping).fold(0.0, f64::max);
            let chi = damping_factor(NormalLaw::LankaraniNikravesh, 0.9);
            println!("{method}, {word}: {most:.3} in {} impacts", found.len());
            assert_eq!(most <= chi * (1.0 + 2e-6), bounded, "{method}, {word}: {most}");
            assert!(simulation.statistics().damping.iter().all(|d| !bounded || *d <= chi * (1.0 + 2e-6)));
        }
    }
}
