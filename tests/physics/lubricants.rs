//! Lubricated joints: a ball that sinks through its film, a journal that a film carries, tilting pins, momentum and energy, the passage to
//! dry contact, live changes.

use std::f64::consts::PI;

use crate::common::matrix::{every_variant, in_tree};
use crate::common::{METHODS, assert_refused, frame_now, free_ball, pair, pair_joints, parse, replaced, run_until};
use crate::elements::frame_at;
use crate::joint_elements::{momenta, start_simulation};
use jointplay_physics::machine::Vec3;
use jointplay_physics::simulate::{Effect, ElementReport};
use jointplay_scene::{LiveScene, Scene};

/// A film of 50 mPa s, so that it never thins out, in joint S.
const OIL: &str = "[[lubricant]]\nname = \"oil\"\njoint = \"S\"\nviscosity = \"50 mPa s\"\nthickness = \"1 nm\"\n";

/// f(x) of a ball (Goenka 1980).
fn closing(x: f64) -> f64 {
    libm::log(1.0 - x) / (x * x * x) + 1.0 / (x * x * (1.0 - x)) - 0.5 / x
}

/// A ball of 0.1 kg and 10 mm radius under 10 m/s^2 in a socket with a play of 0.1 mm, at rest a fifth of it below the middle.
fn sinking() -> String {
    free_ball(-0.02, 0.0, -10.0, "clearance = \"0.1 mm\"") + OIL
}

#[test]
fn a_ball_sinks_through_its_film_as_its_equation_says() {
    // m z'' = m g - C f(z / c) z', by Runge and Kutta, from 0.2 c until its half second is over.
    let (mass, play, factor) = (0.1, 1e-4, 6.0 * PI * 0.05 * 1e-8 / 1e-12);
    let rate = |[z, v]: [f64; 2]| [v, 10.0 - factor * closing(z / play) * v / mass];
    let (mut y, h) = ([0.2e-4, 0.0], 1e-6);
    let moved = |y: [f64; 2], k: [f64; 2], h: f64| [y[0] + h * k[0], y[1] + h * k[1]];
    for _ in 0..500_000 {
        let a = rate(y);
        let b = rate(moved(y, a, 0.5 * h));
        let c = rate(moved(y, b, 0.5 * h));
        let d = rate(moved(y, c, h));
        y = [0, 1].map(|i| y[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
    }
    assert!((0.6..0.95).contains(&(y[0] / play)), "{y:?}");
    for variant in in_tree() {
        let step = ("solver.step", "1 us");
        let changes: Vec<_> =
            variant.close().into_iter().filter(|(key, _)| *key != "solver.step").chain([step]).collect();
        let mut simulation = start_simulation(&sinking(), &changes);
        let frame = frame_at(&mut simulation, 0.5);
        let off = (frame.bodies[0].position.z + y[0]) / play;
        let bound = if variant.method == "discrete-gradient" { 1e-5 } else { 1e-7 };
        println!("{variant}: {off:e}");
        assert!(off.abs() < bound, "{variant}: {off:e}");
        // What the film dissipates is what gravity has supplied.
        let ledger = simulation.ledger().unwrap();
        assert!(
            (ledger.damping_loss / ledger.gravity_work - 1.0).abs() < 100.0 * bound.max(1e-7),
            "{variant}: {ledger:?}"
        );
    }
}

/// A journal of 1 kg, 10 mm in radius and 24 mm long, with so large a moment of inertia that the drag hardly slows its 100 rad/s.
fn journal() -> String {
    r#"
    gravity = { x = 0, y = 0, z = "-10 m/s^2" }
    [[body]]
    name = "pin"
    mass = "1 kg"
    inertia = "10 10 10 kg m^2"
    [[joint]]
    name = "S"
    kind = "revolute"
    child = "pin"
    axis = [1, 0, 0]
    play = { radial = "0.1 mm", length = "24 mm", radius = "10 mm" }
    start = { velocity = "100 rad/s" }
    "#
    .to_owned()
        + &replaced(OIL, "50 mPa s", "5 mPa s")
}

#[test]
fn a_turning_journal_settles_where_sommerfeld_says() {
    for variant in every_variant() {
        // A bearing with ends of its own, and a piston: which part has the wall must not matter.
        let text = match variant.formulation {
            "tree" => journal(),
            _ => replaced(&journal(), "radius = \"10 mm\"", "radius = \"10 mm\", ends = \"pin\""),
        };
        let mut simulation = start_simulation(
            &text,
            &variant.close().map(|(key, value)| match key {
                "solver.step" => (key, "10 us"),
                _ => (key, value),
            }),
        );
        let frame = frame_at(&mut simulation, 0.6);
        let eccentricity = frame.joints[0].eccentricity;
        let ratio = eccentricity.norm() / 1e-4;
        assert!((0.1..0.9).contains(&ratio), "{variant}: {ratio}");
        let spin = frame.bodies[0].angular_velocity.x;
        let m = 1.0 - ratio * ratio;
        // A film of half a turn: attitude angle and load.
        let attitude = libm::atan2(PI * m.sqrt(), 2.0 * ratio);
        let load = 0.005 * 0.024 * 1e-6 / 1e-8 * spin * 6.0 * ratio / ((2.0 + ratio * ratio) * m)
            * (4.0 * ratio * ratio + PI * PI * m).sqrt();
        // Turning about +x, the journal climbs from -z towards -y: against the wall's friction, towards where the oil is drawn in from.
        let got = libm::atan2(eccentricity.y.abs(), -eccentricity.z);
        println!("{variant}: ratio {ratio}, {:e}, {:e}", got - attitude, load / 10.0 - 1.0);
        let bound = if variant.method == "discrete-gradient" { 1e-6 } else { 1e-5 };
        assert!((got - attitude).abs() < bound, "{variant}: {got} {attitude}");
        assert!((load / 10.0 - 1.0).abs() < bound, "{variant}: {load}");
        let ElementReport { force, torque, .. } = frame.elements[0];
        assert!((force.z / 10.0 - 1.0).abs() < bound, "{variant}: {force}");
        // The shear of the film turns the journal back, halfway between the centres: 2 pi mu r^3 L / (c m^1/2).
        let drag = 2.0 * PI * 0.005 * 1e-6 * 0.024 / (1e-4 * m.sqrt()) * spin;
        assert!((torque.unwrap().x / drag + 1.0).abs() < 1e-4, "{variant}: {torque:?} {drag}");
        assert!(simulation.ledger().unwrap().share() < 1e-3, "{variant}: {:?}", simulation.ledger());
    }
}

#[test]
fn a_pin_that_tilts_in_the_middle_is_held_as_by_its_whole_length() {
    let text = replaced(&journal(), "velocity = \"100 rad/s\"", "tilt_velocity = \"0 0.3 0.4 rad/s\"");
    for ends in ["bearing", "pin"] {
        let text = replaced(&text, "radius = \"10 mm\"", &format!("radius = \"10 mm\", ends = \"{ends}\""));
        let mut simulation = start_simulation(&text, &[]);
        let ElementReport { torque, force, .. } = frame_now(&mut simulation).elements[0];
        // 6 pi mu r^3 / c^3 per length, of which L^3 / 12 acts against turning.
        let expected = 6.0 * PI * 0.005 * 1e-6 / 1e-12 * 0.024 * 0.024 * 0.024 / 12.0 * Vec3::new(0.0, -0.3, -0.4);
        let torque = torque.unwrap();
        assert!((torque - expected).norm() < 1e-9 * expected.norm(), "{ends}: {torque} {expected}");
        assert!(force.norm() < 1e-9, "{ends}: {force}");
    }
}

#[test]
fn a_pin_that_stays_in_its_plane_moves_as_one_that_does_not_tilt() {
    let throw = "velocity = \"100 rad/s\", offset_velocity = \"0 0.02 0.05 m/s\"";
    let long = replaced(&journal(), "velocity = \"100 rad/s\"", throw);
    let planar = replaced(&long, ", length = \"24 mm\"", ", planar = true") + "length = \"24 mm\"\n";
    let ends = [long, planar].map(|text| {
        let mut simulation = start_simulation(&text, &[("solver.tolerance", "1e-10")]);
        frame_at(&mut simulation, 0.02).bodies[0].position
    });
    assert!((ends[0] - ends[1]).norm() < 1e-12 && ends[0].norm() > 1e-6, "{ends:?}");
}

/// Two tumbling bodies with joint S between them, and oil in it.
fn oiled_pair(joint: &str, far: f64) -> String {
    let contact = "[contact]\nclearance = \"0.1 mm\"\nrestitution = 0.8\nnormal_law = \"gonthier\"\nfriction = 0.1\n";
    pair(contact, joint, far, "[[lubricant]]\nname = \"oil\"\njoint = \"S\"\nviscosity = \"20 mPa s\"")
}

#[test]
fn momentum_is_kept_and_energy_balanced_and_methods_agree() {
    for (kind, joint) in pair_joints(0.0).iter().enumerate() {
        let mut ends: Vec<Vec3> = Vec::new();
        for variant in every_variant() {
            let [method, formulation] = variant.changes();
            let changes = [
                method,
                formulation,
                ("solver.tolerance", "1e-9"),
                ("solver.step", "1 us"),
                ("solver.steps_per_impact", "128"),
            ];
            let mut simulation = start_simulation(&oiled_pair(joint, 0.0), &changes);
            let machine = simulation.machine().clone();
            let before = momenta(&frame_now(&mut simulation), &machine);
            let frame = frame_at(&mut simulation, 0.03);
            let after = momenta(&frame, &machine);
            let off = [0, 1].map(|i| (after[i] - before[i]).norm() / before[i].norm());
            let ledger = simulation.ledger().unwrap();
            // Nothing touches, and the film acts at one point.
            assert_eq!(simulation.statistics().impacts(), 0);
            let turning = if method.1 == "discrete-gradient" { 1e-5 } else { 1e-10 };
            println!("{kind} {variant}: {off:?}, ledger {:e}, damping {:e}", ledger.share(), ledger.damping_loss);
            assert!(off[0] < 1e-12 && off[1] < turning, "{kind} {variant}: {off:?}");
            let residual = if method.1 == "discrete-gradient" { 1e-5 } else { 1e-6 };
            assert!(ledger.share() < residual, "{kind} {variant}: {ledger:?}");
            assert!(ledger.damping_loss > 0.005 * ledger.held, "{kind} {variant}: {ledger:?}");
            ends.push(frame.bodies[1].position);
        }
        for (end, variant) in ends.iter().zip(every_variant()) {
            let off = (end - ends[0]).norm();
            println!("{kind} {variant}: {off:e}");
            let bound = if variant.method == "discrete-gradient" { 1e-5 } else { 2e-7 };
            assert!(off < bound, "{kind} {variant}: {off:e}");
        }
    }
}

#[test]
fn a_film_far_from_the_origin_acts_as_one_at_it() {
    for index in 0..3 {
        let ends = [0.0, 1000.0].map(|far| {
            let mut simulation =
                start_simulation(&oiled_pair(&pair_joints(far)[index], far), &[("solver.tolerance", "1e-8")]);
            let frame = frame_at(&mut simulation, 0.01);
            (frame.bodies[1].position - frame.bodies[0].position, frame.elements[0].force)
        });
        assert!((ends[0].0 - ends[1].0).norm() < 1e-9, "{index}: {ends:?}");
        assert!((ends[0].1 - ends[1].1).norm() < 1e-3 * ends[0].1.norm().max(1.0), "{index}: {ends:?}");
    }
}

#[test]
fn a_ball_thrown_at_its_wall_loses_speed_to_the_film_and_comes_to_rest_in_dry_contact() {
    let contact = "clearance = \"0.1 mm\"\nrestitution = 0.9\nnormal_law = \"gonthier\"";
    let dry = free_ball(0.0, -0.3, -10.0, contact);
    let wet = dry.clone() + "[[lubricant]]\nname = \"oil\"\njoint = \"S\"\nviscosity = \"0.2 mPa s\"\n";
    let speeds = METHODS.map(|method| {
        let changes = [
            ("solver.method", method),
            ("solver.tolerance", "1e-8"),
            ("solver.step", "0.2 us"),
            ("solver.steps_per_impact", "128"),
        ];
        let mut simulation = start_simulation(&wet, &changes);
        let mut first = None;
        while first.is_none() && simulation.time() < 2e-3 {
            simulation.step().unwrap();
            first = simulation.take_impacts().next();
        }
        let first = first.expect(method);
        let ledger = *simulation.ledger().unwrap();
        println!("{method}: {first:?} {:e}", ledger.share());
        // It arrives slower than it was thrown, and leaves slower than its material alone would let it.
        assert!(first.approach_speed < 0.25 && first.achieved() < 0.85, "{method}: {first:?}");
        let bound = if method == "discrete-gradient" { 1e-12 } else { 1e-5 };
        assert!(ledger.share() < bound, "{method}: {ledger:?}");
        [first.approach_speed, first.achieved() * first.approach_speed]
    });
    let radau = speeds[METHODS.iter().position(|method| *method == "radau5").unwrap()];
    for (speed, method) in speeds.iter().zip(METHODS) {
        let off = [0, 1].map(|i| (speed[i] / radau[i] - 1.0).abs());
        let bound = if method == "discrete-gradient" { 1e-3 } else { 1e-4 };
        assert!(off[0] < bound && off[1] < bound, "{method}: {speeds:?}");
    }
    for method in METHODS {
        let mut simulation = start_simulation(&wet, &[("solver.method", method)]);
        let frame = frame_at(&mut simulation, 0.3);
        let (contact, film) = (frame.joints[0].normal_force.z, frame.elements[0].force.z);
        assert!((contact - 1.0).abs() < 1e-3 && film.abs() < 1e-3, "{method}: {contact} {film}");
    }
}

#[test]
fn a_machine_with_films_starts_settled_and_in_equilibrium() {
    // A rod that hangs on a ball, which lies on the wall of its socket.
    let text = jointplay_scene::built_in_text("pendulum").unwrap();
    let name = Scene::parse(text, None, &[]).unwrap().machine.loose_joints[0].name.clone();
    let film = format!("[[lubricant]]\nname = \"oil\"\njoint = \"{name}\"\nviscosity = \"20 mPa s\"\n");
    for start in ["settled", "equilibrium"] {
        let starts = [text.to_owned(), format!("{text}\n{film}")].map(|text| {
            let mut simulation = start_simulation(&text, &[("start", start)]);
            frame_now(&mut simulation).joints[0].ball_centre
        });
        assert_eq!(starts[0], starts[1], "{start}");
    }
}

#[test]
fn a_stiff_film_slows_neither_implicit_nor_automatic_steps() {
    // A ball of 2.4 g in a film of 10 um: explicit steps would be of some nanoseconds.
    let text = free_ball(0.002, 1e-4, -10.0, "clearance = \"10 um\"")
        + "[[lubricant]]\nname = \"oil\"\njoint = \"S\"\nviscosity = \"4 mPa s\"\n";
    let text = replaced(&text, "\"0.1 kg\"", "\"2.4 g\"");
    for method in ["radau5", "automatic", "discrete-gradient"] {
        let mut simulation = start_simulation(&text, &[("solver.method", method)]);
        run_until(&mut simulation, 9e-3);
        let statistics = simulation.statistics();
        println!("{method}: {} steps", statistics.steps);
        assert!(statistics.steps < 200, "{method}: {statistics:?}");
    }
}

#[test]
fn discrete_gradient_steps_account_for_the_energy_of_films_and_drives() {
    // A crank at 3000 rpm that turns a rod on a film of 50 um, of which each step is a large part.
    let text = "gravity = { x = 0, y = 0, z = 0 }\n\
        [[body]]\nname = \"crank\"\nmass = \"0.3 kg\"\ninertia = \"1e-4 1e-4 1e-4 kg m^2\"\n\
        [[joint]]\nname = \"main\"\nkind = \"revolute\"\nchild = \"crank\"\naxis = [0, 1, 0]\n\
        drive = { law = \"constant\", velocity = \"3000 rpm\" }\n\
        [[body]]\nname = \"rod\"\nmass = \"0.2 kg\"\ninertia = \"1e-5 3e-4 3e-4 kg m^2\"\ncentre = \"75 0 0 mm\"\n\
        [[joint]]\nname = \"S\"\nkind = \"revolute\"\nparent = \"crank\"\nchild = \"rod\"\naxis = [0, 1, 0]\n\
        parent_point = \"50 0 0 mm\"\nplay = { radial = \"50 um\", length = \"20 mm\", radius = \"10 mm\" }\n\
        [[body]]\nname = \"slider\"\nmass = \"0.5 kg\"\ninertia = \"1e-4 1e-4 1e-4 kg m^2\"\n\
        [[joint]]\nname = \"guide\"\nkind = \"prismatic\"\nchild = \"slider\"\naxis = [1, 0, 0]\nparent_point = \"200 0 0 mm\"\n\
        [[joint]]\nname = \"pin\"\nkind = \"revolute\"\nparent = \"rod\"\nchild = \"slider\"\naxis = [0, 1, 0]\nparent_point = \"150 0 0 mm\"\n\
        closes_loop = true\n\
        [[lubricant]]\nname = \"oil\"\njoint = \"S\"\nviscosity = \"50 mPa s\"\n";
    let losses = ["radau5", "discrete-gradient"].map(|method| {
        let mut simulation = start_simulation(text, &[("solver.method", method), ("start", "ideal")]);
        run_until(&mut simulation, 0.1);
        let ledger = simulation.ledger().unwrap();
        println!("{method}: {ledger:?}, {:e}", ledger.share());
        assert!(ledger.share() < 1e-4, "{method}: {ledger:?}");
        ledger.damping_loss
    });
    assert!((losses[1] / losses[0] - 1.0).abs() < 0.03, "{losses:?}");
}

#[test]
fn a_film_in_a_joint_without_play_changes_no_bit() {
    let joints = pair_joints(0.0);
    for joint in [&joints[0], &replaced(&joints[1], "radial = \"0.1 mm\"", "radial = 0")] {
        let wet = replaced(&oiled_pair(joint, 0.0), "clearance = \"0.1 mm\"", "clearance = 0");
        let dry = wet.split("[[lubricant]]").next().unwrap().to_owned();
        let ends = [wet, dry].map(|text| {
            let mut simulation = start_simulation(&text, &[("start", "ideal")]);
            let frame = frame_at(&mut simulation, 0.02);
            frame
                .bodies
                .iter()
                .flat_map(|body| body.position.iter().map(|x| x.to_bits()).collect::<Vec<_>>())
                .collect::<Vec<u64>>()
        });
        assert_eq!(ends[0], ends[1]);
    }
}

#[test]
fn changed_viscosity_radius_and_play_act_from_now_on() {
    let text = "[[parameter]]\nname = \"mu\"\nvalue = \"50 mPa s\"\n".to_owned()
        + &replaced(&sinking(), "viscosity = \"50 mPa s\"", "viscosity = \"mu\"");
    for method in METHODS {
        let mut simulation = LiveScene::new(&parse(&text, &[("solver.method", method)])).unwrap();
        run_until(&mut simulation, 0.2);
        let before = frame_now(&mut simulation);
        assert_eq!(simulation.set("parameter.mu", "100 mPa s"), Ok(Effect::Now), "{method}");
        let after = frame_now(&mut simulation);
        assert!((after.elements[0].force.z / before.elements[0].force.z - 2.0).abs() < 1e-9, "{method}");
        // The force goes with the fourth power of the radius.
        for (key, value, factor) in [
            ("contact.ball_radius", "20 mm", 16.0),
            ("parameter.mu", "50 mPa s", 8.0),
            ("contact.ball_radius", "10 mm", 0.5),
            ("parameter.mu", "100 mPa s", 1.0),
        ] {
            assert_eq!(simulation.set(key, value), Ok(Effect::Now), "{method}");
            let now = frame_now(&mut simulation).elements[0].force.z / after.elements[0].force.z;
            assert!((now / factor - 1.0).abs() < 1e-9, "{method} {key} = {value}: {now}");
        }
        // Twice the play: C falls to an eighth, and the ball is half as eccentric.
        assert_eq!(simulation.set("contact.clearance", "0.2 mm"), Ok(Effect::Now), "{method}");
        let wider = frame_now(&mut simulation);
        let ratio = -wider.joints[0].eccentricity.z / 1e-4;
        let expected = closing(0.5 * ratio) / closing(ratio) / 8.0;
        let got = wider.elements[0].force.z / after.elements[0].force.z;
        assert!((got / expected - 1.0).abs() < 1e-6, "{method}: {got} {expected}");
        // And less of it again: it moves there, and the film with it.
        assert_eq!(simulation.set("contact.clearance", "0.15 mm"), Ok(Effect::Now), "{method}");
        run_until(&mut simulation, 0.5);
        let frame = frame_now(&mut simulation);
        assert_eq!(frame.joints[0].clearance, 1.5e-4, "{method}");
        assert!(simulation.ledger().unwrap().share() < 1e-3, "{method}: {:?}", simulation.ledger());
    }
}

#[test]
fn a_lubricated_ball_is_not_in_free_flight() {
    let chain = jointplay_scene::built_in_text("chain").unwrap();
    let film = "[[lubricant]]\nname = \"oil\"\njoint = \"J3\"\nviscosity = \"20 mPa s\"\n";
    let mut simulation = start_simulation(&format!("{chain}\n{film}"), &[]);
    frame_at(&mut simulation, 0.05);
    let ledger = simulation.ledger().unwrap();
    assert!(ledger.damping_loss > 0.0 && ledger.relative_residual().abs() < 1e-4, "{ledger:?}");
}

#[test]
fn invalid_films_are_refused_with_their_position() {
    let cases = r#"
        "50 mPa s" => "50 mPa" -> lubricant.oil.viscosity | units of viscosity
        "50 mPa s" => "-1 mPa s" -> lubricant.oil.viscosity | allowed 0 Pa s to
        joint = "S" => joint = "T" -> lubricant.oil.joint | no such joint with play; allowed S
        thickness = "1 nm" => thickness = "0 um" -> lubricant.oil.thickness | allowed
        thickness = "1 nm" => length = "10 mm" -> lubricant.oil.length | has the size of that
        thickness = "1 nm" => [[lubricant]]; name = "fat"; joint = "S"; viscosity = "1 Pa s" -> lubricant.fat.joint | lubricant oil is in this joint; allowed one in each
    "#;
    assert_refused(cases, |change| {
        let (from, to) = change.split_once(" => ").expect(change);
        Scene::parse(&replaced(&sinking(), from, to), Some("mine.toml"), &[])
    });
    let line = replaced(&journal(), "length = \"24 mm\"", "length = \"24 mm\", planar = true, elastic = \"line\"");
    assert!(Scene::parse(&line, None, &[]).is_ok(), "the elastic law tells the length");
    let thick = Scene::parse(&replaced(&journal(), "\"1 nm\"", "\"60 um\""), None, &[]).unwrap();
    let doubts: Vec<String> = thick.machine.doubts().iter().map(ToString::to_string).collect();
    assert!(
        doubts
            .iter()
            .any(|doubt| doubt
                .contains("lubricant oil: its thickness 60 um is above half of the play 100 um of joint S")),
        "{doubts:?}"
    );
    let planar = replaced(&journal(), ", length = \"24 mm\"", ", planar = true");
    let error = Scene::parse(&planar, Some("mine.toml"), &[]).unwrap_err().to_string();
    assert!(
        error.contains("lubricant.oil.length: missing, e.g. \"20 mm\"; a pin that stays in its plane has a length"),
        "{error}"
    );
}
