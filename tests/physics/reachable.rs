//! Tip errors with every ball anywhere in its clearance, and at rest, against known answers.

use crate::common::truss::{Guide, Rod, TIP, TWO_RODS, support, truss};
use crate::common::{parse, run_until, scene};
use jointplay_physics::machine::{Machine, Vec3};
use jointplay_physics::mechanism::{Farthest, HeldError, HeldMachine};
use jointplay_physics::simulate::{Frame, Simulation};
use jointplay_scene::Scene;

fn held_machine(scene: &Scene, positions: &[Option<f64>]) -> HeldMachine {
    HeldMachine::new(&scene.machine, positions).unwrap_or_else(|error| panic!("{error}"))
}

/// Unit vectors around the xz plane, none of them perpendicular to a rod.
fn directions(count: usize) -> impl Iterator<Item = Vec3> {
    (0..count).map(move |i| {
        let turn = std::f64::consts::TAU * (i as f64 + 0.137) / count as f64;
        Vec3::new(libm::cos(turn), 0.0, libm::sin(turn))
    })
}

fn error(farthest: &Farthest) -> Vec3 {
    farthest.error.unwrap_or_else(|| panic!("no pose: {farthest:?}"))
}

/// Elongation of each rod of [`TWO_RODS`] when the tip is displaced by `e`, relative to its clearance.
fn stretch(e: &Vec3) -> [f64; 2] {
    TWO_RODS.map(|rod| {
        let (length, _) = rod.length_and_direction(TIP);
        let (now, _) = rod.length_and_direction([TIP[0] + e.x, TIP[1] + e.z]);
        (now - length) / rod.total_play()
    })
}

#[test]
fn two_rods_hold_the_tip_within_their_parallelogram() {
    for guide in [Guide::Plane, Guide::None] {
        let scene = parse(&truss(&TWO_RODS, TIP, guide, "friction_law = \"none\""), &[]);
        // If the tip is free, the rods can rotate about the line of their fixed points; without weight they do not.
        let mut machine = Machine::clone(&scene.machine);
        machine.gravity = Vec3::zeros();
        let mut held_machine = HeldMachine::new(&machine, &[]).unwrap();
        assert!((held_machine.ideal_tip() - Vec3::new(TIP[0], 0.0, TIP[1])).norm() < 1e-12);
        let freedoms = held_machine.freedoms();
        assert_eq!(freedoms.unbounded.len(), usize::from(guide == Guide::None), "{freedoms:?}");
        assert!(freedoms.unbounded.iter().all(|free| free.y.abs() > 1.0 - 1e-9), "{freedoms:?}");
        assert_eq!(freedoms.bounded.len(), 2);
        assert!(freedoms.bounded.iter().all(|axis| axis.y.abs() < 1e-9), "{freedoms:?}");
        let mut corners = Vec::new();
        for u in directions(60) {
            let farthest = held_machine.farthest(&u);
            let expected = support(&TWO_RODS, TIP, [u.x, u.z]);
            assert!((farthest.support / expected - 1.0).abs() < 1e-9, "{} {expected}", farthest.support);
            // Each joint's share is proportional to its clearance.
            let shares = &farthest.shares;
            assert!((shares.iter().sum::<f64>() / expected - 1.0).abs() < 1e-9);
            assert!(
                (shares[1] / shares[0] - 1.5).abs() < 1e-9 && (shares[3] / shares[2] - 4.0).abs() < 1e-9,
                "{shares:?}"
            );
            // At a corner both rods use their whole clearance, in tension or compression.
            let e = error(&farthest);
            for stretch in stretch(&e) {
                assert!((stretch.abs() - 1.0).abs() < 1e-6, "{guide:?} {u:?}: {stretch}");
            }
            assert!((u.dot(&e) - expected).abs() < 1e-2 * expected);
            let known = |corner: &&Vec3| (*corner - e).norm() < 1e-8;
            if corners.iter().find(known).is_none() {
                corners.push(e);
            }
        }
        assert_eq!(corners.len(), 4, "{corners:?}");
    }
}

#[test]
fn opposite_errors_are_equal_up_to_the_square_of_the_clearance() {
    let scene = parse(&truss(&TWO_RODS, TIP, Guide::Plane, ""), &[]);
    let mut held_machine = held_machine(&scene, &[]);
    for u in directions(16) {
        let [one, other] = [u, -u].map(|u| held_machine.farthest(&u));
        assert!((one.support / other.support - 1.0).abs() < 1e-9);
        let (a, b) = (error(&one), error(&other));
        assert!((a + b).norm() < 10.0 * a.norm_squared() / 0.2, "{a:?} {b:?}");
        assert!((a + b).norm() > 0.0);
    }
}

#[test]
fn the_tightest_of_parallel_rods_limits_the_error() {
    // Along a line the tighter rod limits the error.
    let along = |play: [f64; 2]| Rod { from: [0.3, 0.0], play };
    for (a, b) in [(0.1e-3, 0.25e-3), (0.3e-3, 0.2e-3), (0.2e-3, 0.2e-3)] {
        let rods = [along([0.4 * a, 0.6 * a]), along([0.5 * b; 2])];
        let mut held_machine = held_machine(&parse(&truss(&rods, [0.0, 0.0], Guide::Line, ""), &[]), &[]);
        let freedoms = held_machine.freedoms();
        assert!(freedoms.unbounded.is_empty() && freedoms.bounded.len() == 1, "{freedoms:?}");
        for u in [freedoms.bounded[0], -freedoms.bounded[0]] {
            let farthest = held_machine.farthest(&u);
            let least = a.min(b);
            assert!((farthest.support / least - 1.0).abs() < 1e-9, "{} {least}", farthest.support);
            assert!((error(&farthest) - u * least).norm() < 1e-8 * least, "{farthest:?}");
        }
    }
    // In a plane two of the three strips limit the error in each direction.
    let rods = [TWO_RODS[0], TWO_RODS[1], Rod { from: [-0.1, -0.25], play: [0.1e-3, 0.1e-3] }];
    let mut held_machine = held_machine(&parse(&truss(&rods, TIP, Guide::Plane, ""), &[]), &[]);
    let mut inactive = 0;
    for u in directions(48) {
        let farthest = held_machine.farthest(&u);
        let expected = support(&rods, TIP, [u.x, u.z]);
        assert!((farthest.support / expected - 1.0).abs() < 1e-9, "{u:?}: {} {expected}", farthest.support);
        let e = error(&farthest);
        for rod in &rods {
            let ((length, _), (now, _)) =
                (rod.length_and_direction(TIP), rod.length_and_direction([TIP[0] + e.x, TIP[1] + e.z]));
            let stretch = (now - length) / rod.total_play();
            assert!(stretch.abs() < 1.0 + 1e-6, "{u:?}: {stretch}");
            inactive += usize::from(stretch.abs() < 0.99);
        }
        assert!((u.dot(&e) / expected - 1.0).abs() < 1e-2, "{u:?}: {e:?} {expected}");
    }
    assert!(inactive > 20, "{inactive}");
}

/// A slider on x, driven by a crank of 50 mm about y and a rod of 160 mm.
fn slider_crank(plays: [f64; 2]) -> Scene {
    parse(
        &format!(
            "start = \"ideal\"\n[output]\nbody = \"slider\"\nprobe = \"0 0 20 mm\"\n\
             [[body]]\nname = \"crank\"\nmass = \"1 kg\"\ninertia = \"1e-3 1e-3 1e-3 kg m^2\"\n\
             [[joint]]\nname = \"crank\"\nkind = \"revolute\"\nchild = \"crank\"\naxis = [0, -1, 0]\n\
             drive = {{ law = \"constant\", position = \"30 deg\", velocity = \"3 rad/s\" }}\n\
             [[body]]\nname = \"slider\"\nmass = \"1 kg\"\ninertia = \"1e-3 1e-3 1e-3 kg m^2\"\n\
             [[joint]]\nname = \"slider\"\nkind = \"prismatic\"\nchild = \"slider\"\naxis = [1, 0, 0]\n\
             start = {{ position = \"200 mm\" }}\n\
             [[body]]\nname = \"rod\"\nmass = \"1 kg\"\ninertia = \"1e-3 1e-3 1e-3 kg m^2\"\n\
             [[joint]]\nname = \"rod\"\nkind = \"free\"\nchild = \"rod\"\n\
             start = {{ position = \"43 0 25 mm\", rotation = {{ x = [158, 0, -25], y = [0, 1, 0] }} }}\n\
             [[ball_joint]]\nname = \"B\"\nsocket = {{ body = \"crank\", at = \"50 0 0 mm\" }}\nball = {{ body = \"rod\" }}\n\
             clearance = \"{} m\"\nopening = [0, 1, 0]\n\
             [[ball_joint]]\nname = \"C\"\nsocket = {{ body = \"slider\" }}\nball = {{ body = \"rod\", at = \"160 0 0 mm\" }}\n\
             clearance = \"{} m\"\nopening = [0, 1, 0]\n",
            plays[0], plays[1]
        ),
        &[],
    )
}

#[test]
fn the_error_of_a_slider_is_the_clearance_along_its_rod() {
    const CLEARANCES: [f64; 2] = [0.2e-3, 0.3e-3];
    let scene = slider_crank(CLEARANCES);
    let (crank, rod, play) = (0.05, 0.16, CLEARANCES[0] + CLEARANCES[1]);
    for angle in [0.0_f64, 0.4, 1.2, 1.57, 2.8, 4.1, -1.0, 12.0] {
        let mut held_machine = held_machine(&scene, &[Some(angle)]);
        let (sine, cosine) = libm::sincos(angle);
        let slider = |length: f64| crank * cosine + (length * length - crank * crank * sine * sine).sqrt();
        assert!(
            (held_machine.ideal_tip() - Vec3::new(slider(rod), 0.0, 0.02)).norm() < 1e-12,
            "{angle}: {:?}",
            held_machine.ideal_tip()
        );
        let tilt = (slider(rod) - crank * cosine) / rod;
        assert_eq!(held_machine.freedoms().bounded, [Vec3::x()]);
        for sign in [1.0, -1.0] {
            let farthest = held_machine.farthest(&(Vec3::x() * sign));
            assert!((farthest.support * tilt / play - 1.0).abs() < 1e-9, "{angle}: {}", farthest.support);
            let expected = Vec3::x() * (slider(rod + sign * play) - slider(rod));
            assert!((error(&farthest) - expected).norm() < 1e-11, "{angle}: {farthest:?} {expected:?}");
        }
    }
}

/// Tip of `machine` with its balls fixed at `places` in their sockets, in the bodies' axes, m.
fn tip_with_balls_at(machine: &Machine, places: &[Vec3]) -> Option<Vec3> {
    let mut fixed = machine.clone();
    for (joint, place) in fixed.loose_joints.iter_mut().zip(places) {
        joint.contact.clearance = 0.0;
        joint.frames[1].origin.point -= place;
    }
    HeldMachine::new(&fixed, &[]).ok().map(|held_machine| held_machine.ideal_tip())
}

#[test]
fn no_position_of_the_balls_exceeds_the_computed_error() {
    let mut random = 1_u64;
    let mut next = || {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 11) as f64 / (1_u64 << 53) as f64 * 2.0 - 1.0
    };
    for name in ["four-bar", "spcmm"] {
        let scene = scene(name, &[]);
        let mut held_machine = held_machine(&scene, &[]);
        let bounded = held_machine.freedoms().bounded;
        let (mut largest_ratio, mut poses) = (0.0_f64, 0);
        let directions: Vec<Vec3> = bounded.iter().flat_map(|axis| [*axis, -axis]).collect();
        let supports: Vec<Farthest> = directions.iter().map(|u| held_machine.farthest(u)).collect();
        for _ in 0..150 {
            let places: Vec<Vec3> = scene
                .machine
                .loose_joints
                .iter()
                .map(|joint| {
                    // Mostly on the walls, where the extremes are.
                    let place = Vec3::new(next(), next(), next());
                    place.normalize() * joint.contact.clearance * (1.0 - 0.1 * next().abs())
                })
                .collect();
            let Some(tip) = tip_with_balls_at(&scene.machine, &places) else { continue };
            poses += 1;
            let e = tip - held_machine.ideal_tip();
            for (u, farthest) in directions.iter().zip(&supports) {
                let limit = u.dot(&error(farthest));
                assert!(u.dot(&e) <= limit * (1.0 + 1e-3), "{name} {u:?}: {} {limit}", u.dot(&e));
                largest_ratio = largest_ratio.max(u.dot(&e) / limit);
            }
        }
        assert!(poses > 100 && largest_ratio > 0.6, "{name}: {poses} poses, {largest_ratio}");
    }
}

#[test]
fn without_play_nothing_moves_and_idle_spin_has_no_effect() {
    let tight = TWO_RODS.map(|rod| Rod { play: [0.0; 2], ..rod });
    let mut held_machine = held_machine(&parse(&truss(&tight, TIP, Guide::Plane, ""), &[]), &[]);
    let freedoms = held_machine.freedoms();
    assert!(freedoms.bounded.is_empty() && freedoms.unbounded.is_empty(), "{freedoms:?}");
    let farthest = held_machine.farthest(&Vec3::x());
    assert!(farthest.support == 0.0 && error(&farthest).norm() < 1e-14, "{farthest:?}");
    assert!(held_machine.settled_error().unwrap().norm() < 1e-12);
}

#[test]
fn the_tip_rests_where_a_long_run_leaves_it() {
    let contact = "friction = 0.15\nrestitution = 0.3";
    let scene = parse(&truss(&TWO_RODS, TIP, Guide::Plane, contact), &[]);
    let mut held_machine = held_machine(&scene, &[]);
    let settled = held_machine.settled_error().unwrap();
    let mut simulation = Simulation::new(&scene.machine).unwrap();
    run_until(&mut simulation, 3.0);
    let mut frame = Frame::default();
    simulation.sample_now(&mut frame);
    let tip = frame.bodies[scene.machine.output.body].position;
    let run = tip - held_machine.ideal_tip();
    // Friction holds a ball up to atan(0.15) from its frictionless position, which is 1 - cos of that along the rod.
    assert!((run - settled).norm() < 0.02 * settled.norm(), "{run:?} {settled:?}");
    // The weight loads both rods, so the tip rests at one of the four corners, slightly deeper because the walls yield.
    let farthest = held_machine.farthest(&-Vec3::z());
    assert!((error(&farthest) - settled).norm() < 0.02 * settled.norm(), "{farthest:?} {settled:?}");
}

#[test]
fn unreachable_drive_positions_report_the_reached_fraction() {
    let scene = parse(&truss(&TWO_RODS, TIP, Guide::Plane, ""), &[]);
    // The fixed end of the first rod moves 0.1 m, and the tip with it.
    let mut moved = held_machine(&scene, &[Some(0.1)]);
    let tip = [moved.ideal_tip().x, moved.ideal_tip().z];
    let rods = [Rod { from: [TWO_RODS[0].from[0] + 0.1, TWO_RODS[0].from[1]], ..TWO_RODS[0] }, TWO_RODS[1]];
    for (rod, own) in rods.iter().zip(TWO_RODS) {
        assert!((rod.length_and_direction(tip).0 - own.length_and_direction(TIP).0).abs() < 1e-12);
    }
    for u in directions(8) {
        let farthest = moved.farthest(&u);
        assert!((farthest.support / support(&rods, tip, [u.x, u.z]) - 1.0).abs() < 1e-9);
    }
    match HeldMachine::new(&scene.machine, &[Some(-1.0)]).map(|_| ()) {
        Err(HeldError::Unreached { part }) => assert!((0.05..0.5).contains(&part), "{part}"),
        other => panic!("{other:?}"),
    }
}

/// A pin or a block held in the world, with the tip at `tip` (mm) of it.
fn held_part(joint: &str, tip: &str) -> HeldMachine {
    let text = format!(
        "[gravity]\nz = 0\n[output]\nbody = \"part\"\nprobe = \"{tip} mm\"\n[[body]]\nname = \"part\"\nmass = \"0.1 kg\"\n\
         inertia = \"1e-5 1e-5 1e-5 kg m^2\"\n[[joint]]\nname = \"J\"\nchild = \"part\"\naxis = [1, 0, 0]\n{joint}\n"
    );
    held_machine(&parse(&text, &[]), &[])
}

/// The support along `u` and the pose that reaches it.
fn farthest_along(joint: &str, tip: &str, u: [f64; 3]) -> f64 {
    let u = Vec3::from(u);
    let farthest = held_part(joint, tip).farthest(&u);
    let reached = u.dot(&error(&farthest));
    assert!((reached / farthest.support - 1.0).abs() < 1e-2, "{joint} {tip}: {reached} {farthest:?}");
    assert!((farthest.shares[0] / farthest.support - 1.0).abs() < 1e-9);
    farthest.support
}

#[test]
fn a_pin_lets_its_tip_wander_as_the_lever_of_its_ends_says() {
    const C: f64 = 1e-4;
    let pin = |more: &str| format!("kind = \"revolute\"\nplay = {{ radial = \"0.1 mm\", length = \"24 mm\"{more} }}");
    let near = |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-7, "{found} {expected}");
    for ends in ["bearing", "pin"] {
        let pin = pin(&format!(", axial = \"0.2 mm\", ends = \"{ends}\""));
        // Beyond the end both ends touch, on opposite sides: 2 a/L of the play; between them the play itself.
        for u in [[0.0, 1.0, 0.0], [0.0, 0.6, -0.8]] {
            near(farthest_along(&pin, "60 0 0", u), C * 2.0 * 60.0 / 24.0);
            near(farthest_along(&pin, "6 0 0", u), C);
        }
        near(farthest_along(&pin, "60 0 0", [1.0, 0.0, 0.0]), 2e-4);
        // Beside the axis, tilt moves it along: 2 b/L.
        near(farthest_along(&pin, "0 0 30", [1.0, 0.0, 0.0]), 2e-4 + C * 2.0 * 30.0 / 24.0);
    }
    // Collars bound the tilt to c_a/r_f where that is less than 2 c/L; the ends still carry the force.
    let collars = pin(", axial = \"0.05 mm\", face_radius = \"20 mm\"");
    near(farthest_along(&collars, "60 0 0", [0.0, 1.0, 0.0]), C + 48e-3 * 0.05 / 20.0);
    let wide = pin(", axial = \"0.5 mm\", face_radius = \"20 mm\"");
    near(farthest_along(&wide, "60 0 0", [0.0, 0.0, 1.0]), C * 2.0 * 60.0 / 24.0);
    // A pin that does not tilt moves as a whole.
    let planar = "kind = \"revolute\"\nplay = { radial = \"0.1 mm\", planar = true }";
    near(farthest_along(planar, "60 0 0", [0.0, 1.0, 0.0]), C);
}

#[test]
fn a_block_lets_its_tip_wander_as_the_lever_of_its_corners_says() {
    let near = |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-7, "{found} {expected}");
    let size = "half_length = \"25 mm\", half_y = \"20 mm\"";
    // The joint is held along its guide by a drive of another body: along it nothing bounds the tip.
    let planar = format!("kind = \"prismatic\"\nplay = {{ y = \"0.1 mm\", {size}, planar = true }}");
    near(farthest_along(&planar, "100 0 0", [0.0, 1.0, 0.0]), 1e-4 * 100.0 / 25.0);
    let spatial =
        format!("kind = \"prismatic\"\nplay = {{ y = \"0.1 mm\", z = \"0.2 mm\", {size}, half_z = \"20 mm\" }}");
    near(farthest_along(&spatial, "100 0 0", [0.0, 1.0, 0.0]), 1e-4 * 100.0 / 25.0);
    near(farthest_along(&spatial, "100 0 0", [0.0, 0.0, 1.0]), 2e-4 * 100.0 / 25.0);
    near(farthest_along(&spatial, "10 0 0", [0.0, 0.0, 1.0]), 2e-4);
}
