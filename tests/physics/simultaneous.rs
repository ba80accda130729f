//! Balls that strike in the same instant strike alike.
//!
//! Symptom: of two balls on a level rod the second struck with a restitution of 0.60 in place of 0.79, and at the next impacts they
//! differed by a factor of two. Cause: its approach speed was the slope of a cubic over a step of 1e-15 s, which is rounding error.
//! Contract: whatever the method, their impacts are equal to rounding, also far from the origin, where coordinates round more.

use std::fmt::Write as _;

use crate::common::{parse, run_until};
use jointplay_physics::simulate::{Impact, Simulation};
use jointplay_scene::Scene;

/// Approach speeds of the first two impacts, m/s: of a fall through the clearance of 0.1 mm, and after a rebound with 0.79491.
const APPROACHES: [f64; 2] = [0.044_294_469_180_7, 0.035_210_189_03];
/// End of the second impact of all balls, s.
const END: f64 = 0.013;

/// A level plate that falls on `balls` balls in a circle around (0.7 m, 0.3 m, `height`).
fn plate(balls: usize, height: f64, solver: &str) -> String {
    let mut text = format!(
        r#"
        [gravity]
        z = "-9.81 m/s^2"
        [contact]
        clearance = "0.1 mm"
        friction = 0
        normal_law = "gonthier"
        restitution = 0.8
        [solver]
        {solver}
        [[body]]
        name = "plate"
        mass = "0.9 kg"
        inertia = "4e-3 4e-3 7e-3 kg m^2"
        [[joint]]
        name = "plate"
        kind = "free"
        child = "plate"
        start = {{ position = "0.7 0.3 {height} m", rotation = {{ axis = [0, 0, 1], angle = "33 deg" }} }}
        "#
    );
    for n in 0..balls {
        let turn = 360.0 * n as f64 / balls as f64;
        write!(
            text,
            r#"
            [[ball_joint]]
            name = "S{n}"
            socket = {{ body = "world", at = ["0.7 m + 140 mm * cos({turn} deg + 33 deg)", "0.3 m + 140 mm * sin({turn} deg + 33 deg)", "{height} m"] }}
            ball = {{ body = "plate", at = ["140 mm * cos({turn} deg)", "140 mm * sin({turn} deg)", 0] }}
            "#
        )
        .unwrap();
    }
    text
}

/// The impacts of each ball until `end`, s.
fn impacts(scene: &Scene, end: f64) -> Vec<Vec<Impact>> {
    let mut simulation = Simulation::new(&scene.machine).unwrap();
    run_until(&mut simulation, end);
    let mut all = vec![Vec::new(); scene.machine.loose_joints.len()];
    simulation.impacts().for_each(|impact| all[impact.joint].push(*impact));
    all
}

fn relative(a: f64, b: f64) -> f64 {
    (a / b - 1.0).abs()
}

#[test]
fn two_four_and_eight_balls_strike_alike_with_every_method() {
    let solvers = [
        ("method = \"automatic\"\ntolerance = 1e-4", 2e-3),
        ("method = \"automatic\"\ntolerance = 1e-6", 2e-5),
        ("method = \"automatic\"\ntolerance = 1e-9", 1e-6),
        ("method = \"dopri5\"\ntolerance = 1e-11", 1e-6),
        ("method = \"radau5\"\ntolerance = 1e-8", 1e-5),
        ("method = \"rk4\"\nstep = \"1 us\"", 1e-4),
        ("method = \"discrete-gradient\"\nsteps_per_impact = 16", 2e-2),
    ];
    for balls in [2, 4, 8] {
        for height in [1.3, 170.0] {
            for (solver, error) in solvers {
                let case = format!("{balls} balls at {height} m, {solver}");
                let all = impacts(&parse(&plate(balls, height, solver), &[]), END);
                for (n, right) in APPROACHES.into_iter().enumerate() {
                    let first = all[0][n];
                    // The second is that of two balls.
                    let is_known = n == 0 || balls == 2;
                    assert!(!is_known || relative(first.approach_speed, right) < error, "{case}: {first:?}");
                    for ball in &all[1..] {
                        let other = ball[n];
                        // Coordinates of 170 m are known to 3e-14 m: the balls may touch 1e-12 s apart.
                        for (a, b) in [
                            (first.approach_speed, other.approach_speed),
                            (first.separation_speed, other.separation_speed),
                            (first.peak, other.peak),
                        ] {
                            assert!(relative(a, b) < 1e-7, "{case}: {first:?} {other:?}");
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn equal_gaps_of_a_straight_line_linkage_are_crossed_at_one_speed() {
    let text = std::fs::read_to_string(crate::trial("peaucellier")).unwrap();
    let gravity = [("gravity.z", "-9.81 m/s^2"), ("gravity.x", "1 m/s^2")];
    for tolerance in ["1e-6", "1e-8", "1e-11"] {
        let scene = parse(&text, &[&gravity[..], &[("solver.tolerance", tolerance)]].concat());
        let all = impacts(&scene, 4.7e-3);
        let joint = |name: &str| scene.machine.loose_joints.iter().position(|joint| joint.name == name).unwrap();
        for name in ["AP1", "BP1"] {
            let first = all[joint(name)][0];
            assert!(relative(first.approach_speed, 0.044_409_09) < 1e-7, "{tolerance}: {name}: {first:?}");
        }
    }
}

#[test]
fn both_inner_balls_of_a_steering_strike_at_one_speed() {
    let scene = Scene::load(crate::trial("steer"), &[]).unwrap();
    let all = impacts(&scene, 1.2e-3);
    let inner = |side: &str| {
        let name = format!("{side}.inner");
        all[scene.machine.loose_joints.iter().position(|joint| joint.name == name).unwrap()][0].approach_speed
    };
    for side in ["left", "right"] {
        assert!(relative(inner(side), 0.157_171_438) < 1e-7, "{side}: {}", inner(side));
    }
}
