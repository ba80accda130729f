//! The numbers of `docs/limits.md` are those that the program computes.

use crate::common::{Changes, frame_now, free_ball, parse, run_until, simulation};
use crate::joint_elements::momenta;
use jointplay_physics::contact::{ElasticLaw, NormalLaw, Parameters, undisturbed_restitution};
use jointplay_physics::simulate::{ContactMode, Frame, Simulation};

/// Asserts that the page contains this sentence, regardless of line breaks.
fn assert_documented(sentence: &str) {
    let page = std::fs::read_to_string(format!("{}/docs/limits.md", crate::ROOT)).unwrap();
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words(&page).contains(&words(sentence)), "docs/limits.md lacks: {sentence}");
}

const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// A free ball pressed by its weight onto the wall of its socket at an angle (rad) from the lowest point, with friction.
fn ball_on_wall(angle: f64, start: &str, changes: &Changes) -> Simulation {
    let text = free_ball(0.0, 0.0, -9.81, "");
    let law = ("contact.friction_law", "modified-coulomb");
    let changes = [&[law], changes].concat();
    let parameters = Parameters::default();
    let elastic = ElasticLaw::of_joint(&parameters, parameters.clearance);
    let depth = elastic.depth(0.1 * 9.81 * angle.cos());
    let distance = 1e3 * (parameters.clearance + depth);
    let from = "position = \"0 0 0 mm\", velocity = \"0 0 0 m/s\"";
    assert!(text.contains(from), "{text}");
    let to = format!("position = \"{:e} 0 {:e} mm\"{start}", distance * angle.sin(), -distance * angle.cos());
    Simulation::new(&parse(&text.replace(from, &to), &changes).machine).unwrap()
}

/// Angle of a ball in its socket from the lowest point, degrees.
fn angle_from_lowest_point(frame: &Frame) -> f64 {
    let e = frame.joints[0].eccentricity;
    (e.x / -e.z).atan() / DEGREE
}

#[test]
fn a_ball_creeps_where_coulomb_would_hold_it() {
    let creep_speed = |changes: &Changes| {
        let mut simulation =
            ball_on_wall(2.0 * DEGREE, "", &[&[("contact.friction_velocity", "centres")], changes].concat());
        run_until(&mut simulation, 1e-3);
        let frame = frame_now(&mut simulation);
        assert_eq!(frame.joints[0].state, ContactMode::Creep);
        (1e6 * frame.joints[0].slip_speed, simulation)
    };
    let (creep, mut simulation) = creep_speed(&[]);
    run_until(&mut simulation, 1.0);
    let angle = angle_from_lowest_point(&frame_now(&mut simulation));
    assert_documented(&format!("at 2° from that point creeps at {creep:.0} µm/s"));
    assert_documented(&format!("is at {angle:.1}° after a second"));
    let (slower, _) = creep_speed(&[("contact.slip_speed_high", "0.01 mm/s")]);
    assert_documented(&format!(
        "`contact.slip_speed_high` = 0.01 mm/s instead of 0.1 mm/s it creeps at {slower:.1} µm/s"
    ));
    assert_documented(&format!("holds a ball up to {:.1}°", 0.15_f64.atan() / DEGREE));
}

#[test]
fn a_ball_that_spins_about_its_contact_normal_is_not_slowed() {
    let mut simulation = ball_on_wall(0.0, ", angular_velocity = \"0 0 10 rad/s\"", &[]);
    run_until(&mut simulation, 1.0);
    let spin = frame_now(&mut simulation).bodies[0].angular_velocity.z;
    assert_documented(&format!(
        "spins at 10 rad/s about the normal of its contact still has {spin:.6} rad/s after a second"
    ));
}

/// Two rods in space, without gravity, that rotate about the ball joint with play between them.
const RODS_IN_SPACE: &str = r#"
[gravity]
z = 0

[[body]]
name = "a"
mass = "1 kg"
inertia = "1e-4 3e-3 3e-3 kg m^2"

[[joint]]
name = "a"
kind = "free"
child = "a"
start = { position = "-100 0 0 mm", angular_velocity = "0 2 3 rad/s" }

[[body]]
name = "b"
mass = "0.4 kg"
inertia = "2e-5 1e-3 1e-3 kg m^2"

[[joint]]
name = "b"
kind = "free"
child = "b"
start = { position = "100 0 0 mm", velocity = "0 0.1 0 m/s", angular_velocity = "20 -3 1 rad/s" }

[[ball_joint]]
name = "S"
socket = { body = "a", at = "100 0 0 mm" }
ball = { body = "b", at = "-100 0 0 mm" }
"#;

#[test]
fn friction_changes_the_angular_momentum_of_a_machine_in_space() {
    // Relative changes within two seconds.
    let drift = |changes: &Changes| {
        let changes = [&[("solver.tolerance", "1e-9"), ("contact.approach_speed", "largest")], changes].concat();
        let machine = parse(RODS_IN_SPACE, &changes).machine;
        let mut simulation = Simulation::new(&machine).unwrap();
        let [p, l] = momenta(&frame_now(&mut simulation), &machine);
        let mut largest = [0.0_f64; 2];
        for k in 1..=20 {
            run_until(&mut simulation, 0.1 * f64::from(k));
            let now = momenta(&frame_now(&mut simulation), &machine);
            largest = [largest[0].max((now[0] - p).norm() / p.norm()), largest[1].max((now[1] - l).norm() / l.norm())];
        }
        largest
    };
    let [momentum, angular] = drift(&[("contact.friction", "0.3")]);
    let [_, smooth] = drift(&[("contact.friction", "0")]);
    println!("{momentum:e} {angular:e} {smooth:e}");
    assert!(momentum < 1e-12, "{momentum:e}");
    assert_documented(&format!(
        "changes by {angular:.0e} of its value within two seconds, without friction by less than 1e-10"
    ));
    assert!(smooth < 1e-10, "{smooth:e}");
}

#[test]
fn contact_laws_and_patch_radii_have_the_documented_values() {
    let restitution = |law: NormalLaw, nominal| undisturbed_restitution(law.damping_factor(nominal));
    assert_documented(&format!(
        "gives {:.3} when asked for 0.9 and {:.3} when asked for 0.8",
        restitution(NormalLaw::LankaraniNikravesh, 0.9),
        restitution(NormalLaw::LankaraniNikravesh, 0.8)
    ));
    assert_documented(&format!("`flores` gives {:.3} when asked for 0.1", restitution(NormalLaw::Flores, 0.1)));
    let mut simulation = simulation("spcmm", &[]);
    let mut impacts = Vec::new();
    while simulation.time() < 0.02 {
        simulation.step().unwrap();
        impacts.extend(simulation.take_impacts());
    }
    let contact = &simulation.machine().loose_joints[0].contact;
    let (r, c) = (contact.ball_radius, contact.clearance);
    let force = (0..3).map(|j| simulation.peak(j).0).fold(0.0, f64::max);
    let depth = ElasticLaw::of_joint(contact, c).depth(force);
    let patch = (depth * (r + c) * r / c).sqrt() / r;
    assert_documented(&format!("reaches {patch:.2} ball radii in the hardest impact of `spcmm`, of {force:.0} N"));
    let first = &impacts[0];
    assert_documented(&format!("the first impact of `spcmm` lasts {:.2} ms", 1e3 * (first.end - first.start)));
    // Round trip of a wave in a rod of 0.2 m: steel of 206 GPa and 7850 kg/m^3.
    let round_trip = 0.4 / (206e9_f64 / 7850.0).sqrt();
    assert_documented(&format!("a wave takes {:.2} ms", 1e3 * round_trip));
}
