//! The discrete-gradient method against the contact laws, the adaptive methods and its own promises: it creates no energy, settled
//! forces are right, and peaks and losses are within the bounds for its steps per impact.

use crate::common::{Changes, MACHINES, SCENES, frame_now, free_ball, live, mean_forces, parse, run_until, simulation};
use jointplay_physics::contact::{NormalLaw, undisturbed_restitution};
use jointplay_physics::simulate::{Frame, Impact, Ledger, Simulation};
use jointplay_scene::LiveScene;

const METHOD: (&str, &str) = ("solver.method", "discrete-gradient");

/// Changes that select the method with `parts` steps per impact.
fn with_parts<'a>(parts: &'a str, changes: &Changes<'a>) -> Vec<(&'a str, &'a str)> {
    [&[METHOD, ("solver.steps_per_impact", parts)], changes].concat()
}

/// Rebound speed of a free ball from the top of its socket, relative to that of the exact law `word`.
fn rebound(word: &str, law: NormalLaw, parts: &str) -> f64 {
    let contact = format!("normal_law = \"{word}\"\nrestitution = 0.9");
    let scene = parse(&free_ball(0.0, 0.08, 0.0, &contact), &with_parts(parts, &[]));
    let mut simulation = Simulation::new(&scene.machine).unwrap();
    let mut impacts = Vec::new();
    while impacts.is_empty() {
        simulation.step().unwrap();
        impacts.extend(simulation.take_impacts());
    }
    let speed = -frame_now(&mut simulation).bodies[0].velocity.z;
    speed / (0.08 * undisturbed_restitution(law.damping_factor(0.9)))
}

#[test]
fn an_undisturbed_impact_converges_to_its_law_and_an_elastic_one_loses_nothing() {
    for (parts, bound) in [("4", 1e-2), ("8", 3e-3), ("16", 1e-3), ("64", 1e-4)] {
        let ratio = rebound("lankarani-nikravesh", NormalLaw::LankaraniNikravesh, parts);
        assert!((ratio - 1.0).abs() < bound, "{parts}: {ratio}");
        let ratio = rebound("hertz", NormalLaw::Hertz, parts);
        assert!((ratio - 1.0).abs() < 1e-4, "{parts}, hertz: {ratio}");
    }
}

/// Impacts faster than 20 mm/s of a run over `span`.
fn hard_impacts(name: &str, changes: &Changes, span: f64) -> Vec<Impact> {
    let mut simulation = simulation(name, changes);
    let mut impacts = Vec::new();
    while simulation.time() < span {
        simulation.step().unwrap();
        impacts.extend(simulation.take_impacts());
    }
    impacts.retain(|impact| impact.approach_speed > 0.02);
    impacts.sort_by(|a, b| a.start.total_cmp(&b.start));
    impacts
}

#[test]
fn peaks_of_the_first_impacts_are_right_to_a_few_per_cent_and_converge() {
    for (name, span, bounds) in [("hexapod", 0.02, [0.03, 0.011, 6e-3]), ("delta", 0.02, [0.03, 0.02, 7e-3])] {
        let exact = hard_impacts(name, &[("solver.method", "dopri5"), ("solver.tolerance", "1e-9")], span);
        assert!(exact.len() >= 6, "{name}: {exact:?}");
        for (parts, bound) in ["4", "8", "16"].into_iter().zip(bounds) {
            let impacts = hard_impacts(name, &with_parts(parts, &[]), span);
            for impact in &exact[..6] {
                let near = impacts.iter().filter(|other| other.joint == impact.joint);
                let near =
                    near.min_by(|a, b| (a.start - impact.start).abs().total_cmp(&(b.start - impact.start).abs()));
                let ratio = near.expect("the same impact").peak / impact.peak;
                assert!((ratio - 1.0).abs() < bound, "{name}, {parts}: {ratio} of {impact:?}");
            }
        }
    }
}

fn ledger(name: &str, changes: &Changes, span: f64) -> Ledger {
    let mut simulation = simulation(name, changes);
    simulation.advance_to(span).unwrap();
    *simulation.ledger().unwrap()
}

/// Compares means over runs with different steps, since every single run is chaotic.
#[test]
fn losses_of_many_loose_joints_agree_with_error_controlled_steps() {
    let [friction, restitution] = mean_losses(["4", "6", "8", "12", "16", "24"], "hexapod", &[], 1.0);
    assert!((-0.02..0.08).contains(&(friction / 21.8e-3 - 1.0)), "{friction}");
    assert!((restitution / 2.67e-3 - 1.0).abs() < 0.05, "{restitution}");
    // Without the springs that pull the rods together.
    let changes = [("parameter.rate", "3 Hz"), ("parameter.grip", "0.001 N")];
    let [_, restitution] = mean_losses(["8", "12", "16", "24", "32", "64"], "delta", &changes, 0.3);
    // The mean of six runs of `automatic` from 1e-3 to 2e-5 is 30.2 mJ, with a deviation of 0.4 mJ.
    assert!((restitution / 30.2e-3 - 1.0).abs() < 0.05, "{restitution}");
}

fn mean_losses<const N: usize>(parts: [&str; N], name: &str, changes: &Changes, span: f64) -> [f64; 2] {
    let ledgers = parts.map(|parts| ledger(name, &with_parts(parts, changes), span));
    let average = |part: fn(&Ledger) -> f64| ledgers.iter().map(part).sum::<f64>() / N as f64;
    [average(|ledger| ledger.friction_loss), average(|ledger| ledger.restitution_loss)]
}

#[test]
fn steps_and_iterations_of_many_loose_joints_stay_few() {
    let mut simulation = simulation("hexapod", &with_parts("8", &[]));
    simulation.advance_to(1.0).unwrap();
    let statistics = simulation.statistics();
    let counts = (statistics.steps, statistics.contact_evaluations);
    assert!(counts.0 <= 6800 && counts.1 <= 24_000, "{counts:?}");
}

#[test]
fn every_scene_balances_its_energy() {
    for name in SCENES.into_iter().chain(MACHINES) {
        for formulation in ["tree", "lagrange"] {
            let ledger = ledger(name, &with_parts("4", &[("formulation", formulation)]), 0.3);
            let residual = ledger.relative_residual();
            assert!(residual.abs() < 1e-3, "{name}, {formulation}: {residual:e}");
        }
    }
}

#[test]
fn settled_forces_are_right_within_half_a_per_cent() {
    let ideal = [("joint.S1.clearance", "0")];
    let surface = [("contact.friction_velocity", "surface")];
    for (name, formulation, changes) in [
        ("spcmm", "tree", &[][..]),
        ("spcmm", "lagrange", &[]),
        ("spcmm", "tree", &ideal),
        ("spcmm", "tree", &surface),
        ("chain", "tree", &[]),
        ("slider-crank", "tree", &[]),
        ("slider-crank-driven", "tree", &[]),
    ] {
        let base = [&[("formulation", formulation)], changes].concat();
        let close = [&base[..], &[("solver.tolerance", "1e-8")]].concat();
        let mut exact = live(name, &close);
        run_until(&mut exact, 1.0);
        let start = exact.snapshot();
        let expected = mean_forces(&mut exact, 1.0, 1.2);
        let mut coarse = live(name, &base);
        coarse.restore(&start);
        coarse.set(METHOD.0, METHOD.1).unwrap();
        coarse.set("solver.steps_per_impact", "16").unwrap();
        let actual = mean_forces(&mut coarse, 1.0, 1.2);
        for (j, (actual, expected)) in actual.iter().zip(&expected).enumerate() {
            let ratio = actual / expected;
            assert!((ratio - 1.0).abs() < 5e-3, "{name}, {base:?}, joint {j}: {ratio}");
        }
    }
}

#[test]
fn the_peak_of_an_ideal_joint_is_that_of_its_rows() {
    let mut simulation = simulation("slider-crank-driven", &with_parts("16", &[]));
    let mut frame = Frame::default();
    let mut rows = 0.0_f64;
    while simulation.time() < 0.025 {
        simulation.step().unwrap();
        let middle = 0.5 * (simulation.step_start() + simulation.time());
        for time in [middle, simulation.time()] {
            simulation.sample(time, &mut frame);
            rows = rows.max(frame.joints[0].normal_force.norm());
        }
    }
    let peak = simulation.statistics().joints[0].peak_normal;
    assert!(rows > 200.0 && (peak / rows - 1.0).abs() < 2e-2, "{peak} {rows}");
    assert!(simulation.peak(0).0 >= rows);
}

/// The lever arm of an extrapolated normal would do work, 2e-4 of the energy exchanged.
#[test]
fn normal_forces_do_no_work_on_rotating_bodies() {
    for parts in ["4", "16"] {
        let ledger = ledger("hexapod", &with_parts(parts, &[]), 1.0);
        let residual = ledger.relative_residual();
        assert!(residual.abs() < 1e-4, "{parts}: {residual:e}");
    }
}

#[test]
fn no_step_creates_energy() {
    for parts in ["2", "4", "16"] {
        for (name, friction) in
            [("pendulum", "0"), ("pendulum", "0.15"), ("pendulum", "10"), ("chain", "0.15"), ("slider-crank", "0.15")]
        {
            let mut simulation = simulation(name, &with_parts(parts, &[("contact.friction", friction)]));
            let start = frame_now(&mut simulation);
            let energy = start.kinetic + start.potential;
            let (mut max_gain, mut exchanged) = (0.0_f64, start.kinetic);
            for _ in 0..4000 {
                if simulation.time() > 1.0 {
                    break;
                }
                simulation.step().unwrap();
                let frame = frame_now(&mut simulation);
                max_gain = max_gain.max(frame.kinetic + frame.potential - energy);
                exchanged = exchanged.max(frame.kinetic);
            }
            assert!(
                max_gain <= 1e-3 * exchanged,
                "{name}, friction {friction}, {parts}: {max_gain:e} of {exchanged:e} J"
            );
        }
    }
}

/// A change of a clearance pushes balls inwards while the wall moves; the ledger accounts for that.
#[test]
fn a_live_change_preserves_the_energy_balance() {
    let mut simulation = live("spcmm", &with_parts("8", &[]));
    simulation.advance_to(0.2).unwrap();
    simulation.set("contact.clearance", "0.05 mm").unwrap();
    simulation.advance_to(0.4).unwrap();
    let ledger = simulation.ledger().unwrap();
    assert!(ledger.clearance_work.abs() > 1e-7, "{ledger:?}");
    assert!(ledger.relative_residual().abs() < 1e-3, "{ledger:?}");
    let rerun = |start: &LiveScene| {
        let mut copy = LiveScene::new(start.running()).unwrap();
        copy.restore(&start.snapshot());
        copy.advance_to(0.5).unwrap();
        copy.state_hash()
    };
    let hashes = [rerun(&simulation), rerun(&simulation)];
    simulation.advance_to(0.5).unwrap();
    assert_eq!(hashes, [simulation.state_hash(); 2]);
}

/// A ball of 0.1 kg and 10 mm radius that spins about y, under an optional torque about y, N m. It touches its socket where friction
/// of `ratio` times the normal force balances gravity; from any other position it would oscillate forever.
fn rotor(spin: f64, torque: Option<f64>, ratio: f64) -> String {
    let (x, z) = (0.1 * ratio.atan().sin(), -0.1 * ratio.atan().cos());
    let load = torque.map_or_else(String::new, |torque| {
        format!("[[load]]\nname = \"torque\"\non = {{ body = \"ball\" }}\ntorque = \"0 {torque} 0 N m\"")
    });
    format!(
        r#"
        [gravity]
        z = "-10 m/s^2"
        [contact]
        ball_radius = "10 mm"
        clearance = "0.1 mm"
        friction = 0.3
        slip_speed_low = "0.01 mm/s"
        slip_speed_high = "0.2 mm/s"
        [[body]]
        name = "ball"
        mass = "0.1 kg"
        inertia = "1e-4 1e-4 1e-4 kg m^2"
        [[joint]]
        name = "ball"
        kind = "free"
        child = "ball"
        start = {{ position = "{x} 0 {z} mm", angular_velocity = "0 {spin} 0 rad/s" }}
        [[ball_joint]]
        name = "S"
        socket = {{ body = "world" }}
        ball = {{ body = "ball" }}
        {load}
        "#
    )
}

/// Angular rates about y of a rotor at `times`, s, with `parts` steps per impact.
fn rates<const N: usize>(text: &str, parts: &str, times: [f64; N]) -> [f64; N] {
    let mut simulation = Simulation::new(&parse(text, &with_parts(parts, &[])).machine).unwrap();
    times.map(|time| {
        run_until(&mut simulation, time);
        frame_now(&mut simulation).bodies[0].angular_velocity.y
    })
}

/// Load, N, and ball radius, m, of [`rotor`].
const LOAD: f64 = 1.0;
const RADIUS: f64 = 0.01;

/// The contact point climbs to the friction angle, where the torque is W r mu / sqrt(1 + mu^2) for any step size.
#[test]
fn sliding_friction_brakes_a_spinning_ball_as_in_closed_form() {
    let expected = -LOAD * RADIUS * 0.3 / 1.09_f64.sqrt() / 1e-4;
    for parts in ["2", "8", "64"] {
        let [start, end] = rates(&rotor(40.0, None, 0.3), parts, [0.5, 1.0]);
        let deceleration = (end - start) / 0.5;
        assert!((deceleration / expected - 1.0).abs() < 1e-3, "{parts}: {deceleration} rad/s^2, not {expected}");
    }
}

/// Under half of that torque the ball creeps at the speed at which the friction law balances the torque.
#[test]
fn a_torque_below_the_friction_limit_turns_a_ball_at_the_creep_speed() {
    let torque = 0.5 * LOAD * RADIUS * 0.3 / 1.09_f64.sqrt();
    let carried = (torque / (LOAD * RADIUS)).asin().tan();
    let speed = 0.01e-3 + carried / 0.3 * 0.19e-3;
    for parts in ["2", "8", "64"] {
        let rates_at_end = rates(&rotor(speed / RADIUS, Some(torque), carried), parts, [4.0, 4.5]);
        for rate in rates_at_end {
            let expected = speed / RADIUS;
            assert!((rate / expected - 1.0).abs() < 1e-3, "{parts}: {rate} rad/s, not {expected}");
        }
    }
}

/// Symptom: impacts slower than 5 mm/s took one or two steps, and rebounded with 0.98 of their speed for 0.80 by the law, on Earth with
/// up to twice their speed. Nothing was doubted: the balls of separate sockets counted as disturbing each other.
#[test]
fn slow_impacts_of_separate_balls_return_no_more_than_their_law() {
    let text = std::fs::read_to_string(crate::trial("slow-eight")).unwrap();
    for preset in ["preview", "real-time"] {
        for gravity in ["-0.02", "-0.05", "-0.2", "-0.7", "-3", "-9.81"] {
            let gravity = format!("{gravity} m/s^2");
            let scene = parse(&text, &[("solver.preset", preset), ("gravity.z", &gravity)]);
            let mut simulation = Simulation::new(&scene.machine).unwrap();
            let mut impacts = Vec::new();
            while simulation.time() < 0.5 {
                simulation.step_until(0.5).unwrap();
                impacts.extend(simulation.take_impacts());
            }
            let resolved: Vec<_> = impacts.iter().filter(|impact| !impact.below_speed_floor).collect();
            assert!(resolved.len() > 8, "{preset}, {gravity}");
            for impact in resolved {
                assert!(!impact.disturbed, "{preset}, {gravity}: {impact:?}");
                assert!(impact.achieved() < impact.law + 0.05, "{preset}, {gravity}: {impact:?}");
            }
        }
    }
}
