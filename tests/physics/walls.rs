//! Contacts that begin without a sign change: a ball that starts on its wall, or is exactly on it where a search interval ends.

use crate::common::{free_ball, parse};
use jointplay_physics::simulate::{Impact, Simulation};
use jointplay_scene::LiveScene;

fn impacts_of(text: &str, changes: &[(&str, &str)], duration: f64) -> (Simulation, Vec<Impact>) {
    let mut simulation = Simulation::new(&parse(text, changes).machine).expect("starts");
    let mut impacts = Vec::new();
    while simulation.time() < duration {
        simulation.step_until(duration).expect("runs");
        impacts.extend(simulation.take_impacts());
    }
    (simulation, impacts)
}

const METHODS: [(&str, &[(&str, &str)]); 5] = [
    ("automatic", &[]),
    ("preview", &[("solver.preset", "preview")]),
    ("dopri5", &[("solver.method", "dopri5")]),
    ("radau5", &[("solver.method", "radau5")]),
    ("rk4", &[("solver.method", "rk4"), ("solver.step", "2 us")]),
];

/// A ball that starts on its wall, or within rounding inside it, and moves into it begins its impact at t = 0: it has the law's
/// restitution and the peak of the reference solution (SciPy DOP853, rtol 1e-12).
#[test]
fn a_ball_that_starts_on_its_wall_begins_an_impact() {
    for place in [-0.3, -0.300_000_000_000_1] {
        let text = free_ball(place, -1.0, 0.0, r#"clearance = "0.3 mm""#);
        for (name, changes) in METHODS {
            let (simulation, impacts) = impacts_of(&text, changes, 3e-4);
            let first = impacts[0];
            assert_eq!((first.start, first.approach_speed), (0.0, 1.0), "{name}");
            assert!((first.achieved() - 0.9132).abs() < 1e-4, "{name}: {}", first.achieved());
            assert!((first.peak / 6557.0 - 1.0).abs() < 1e-4, "{name}: {}", first.peak);
            assert_eq!(simulation.doubts(), [], "{name}");
        }
    }
}

/// With round numbers, search intervals end exactly on the wall: every ball rebounds with its initial energy.
#[test]
fn a_ball_rebounds_for_every_round_clearance_and_speed() {
    for clearance in [0.01, 0.02, 0.04, 0.05, 0.08, 0.1, 0.2, 0.25, 0.3, 0.4, 0.5, 1.0] {
        for speed in [0.1, 0.2, 0.25, 0.4, 0.5, 0.8, 1.0, 2.0, 2.5, 4.0, 5.0, 10.0] {
            let contact = format!("clearance = \"{clearance} mm\"\nnormal_law = \"hertz\"");
            let (simulation, impacts) =
                impacts_of(&free_ball(0.0, speed, 0.0, &contact), &[], 4e-3 * clearance / speed + 4e-4);
            let case = format!("{clearance} mm, {speed} m/s");
            assert!(!impacts.is_empty(), "{case}");
            for impact in impacts {
                assert!((impact.achieved() - 1.0).abs() < 1e-5, "{case}: {}", impact.achieved());
            }
            assert_eq!(
                simulation.statistics().joints.iter().map(|joint| joint.late).collect::<Vec<_>>(),
                [0.0],
                "{case}"
            );
        }
    }
}

/// A fixed step that ends exactly on the wall, and a live change of the clearance that moves the wall to the ball.
#[test]
fn a_contact_begins_where_a_step_or_a_change_ends_on_the_wall() {
    // 0.25 m/s over 2^-12 s is 2^-14 m, exactly the play.
    let play = 1e3 * 2f64.powi(-14);
    let text = free_ball(0.0, 0.25, 0.0, &format!("clearance = \"{play} mm\""));
    let step = 2f64.powi(-18) * 1e6;
    let fixed = [("solver.method", "rk4"), ("solver.step", &*format!("{step} us"))];
    let (_, impacts) = impacts_of(&text, &fixed, 2e-3);
    assert_eq!(impacts[0].approach_speed, 0.25);
    let mut simulation =
        LiveScene::new(&parse(&free_ball(0.0, 0.25, 0.0, r#"clearance = "1 mm""#), &[])).expect("starts");
    simulation.step_until(2f64.powi(-12)).expect("runs");
    simulation.set("contact.clearance", &format!("{play} mm")).expect("a change");
    let mut impacts = Vec::new();
    while impacts.is_empty() {
        simulation.step().expect("runs");
        impacts.extend(simulation.take_impacts());
    }
    assert!((impacts[0].achieved() - impacts[0].law).abs() < 1e-4, "{:?}", impacts[0]);
    assert!((impacts[0].start - 2f64.powi(-12)).abs() < 1e-15);
}
