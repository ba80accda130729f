//! Reference values of the physics contract: single numbers, trajectories, and agreement between the two formulations.

use jointplay_physics::simulate::{Frame, Simulation};
use jointplay_scene::Scene;

fn scene(name: &str, changes: &[(&str, &str)]) -> Scene {
    let changes: Vec<(String, String)> = changes.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    Scene::load(name, &changes).unwrap()
}

fn simulation(name: &str, changes: &[(&str, &str)]) -> Simulation {
    Simulation::new(&scene(name, changes).machine).unwrap()
}

/// Rows of a file in `tests/reference/`: 16 columns.
fn reference(file: &str) -> Vec<[f64; 16]> {
    let path = format!("{}/tests/reference/{file}", crate::ROOT);
    let text = std::fs::read_to_string(path).unwrap();
    text.lines()
        .skip(1)
        .map(|line| {
            let mut row = [0.0; 16];
            for (slot, field) in row.iter_mut().zip(line.split(',')) {
                *slot = field.parse().unwrap();
            }
            row
        })
        .collect()
}

/// Largest position error up to 12 ms and over the whole trajectory, m.
fn compare(file: &str, changes: &[(&str, &str)]) -> (f64, f64) {
    let mut changes = changes.to_vec();
    changes.push(("solver.tolerance", "1e-11"));
    let mut simulation = simulation("spcmm", &changes);
    let mut frame = Frame::default();
    let (mut early, mut late) = (0.0_f64, 0.0_f64);
    for row in reference(file) {
        simulation.advance_to(row[0]).unwrap();
        simulation.sample(row[0], &mut frame);
        let error = (0..3).map(|i| (frame.pose.position[i] - row[1 + i]).abs()).fold(0.0, f64::max);
        if row[0] <= 0.012 {
            early = early.max(error);
        }
        late = late.max(error);
    }
    (early, late)
}

#[test]
fn positions_follow_the_reference_trajectories() {
    let cases: [(&str, &[(&str, &str)]); 2] = [
        ("spcmm_c0.30_cf0.15_ce0.90_centres.csv", &[]),
        (
            "spcmm_c0.50_cf0.20_ce0.90_surface.csv",
            &[("contact.clearance", "0.5 mm"), ("contact.friction", "0.2"), ("contact.friction_velocity", "surface")],
        ),
    ];
    for method in ["dopri5", "automatic", "radau5"] {
        for (file, changes) in cases {
            let mut changes = changes.to_vec();
            changes.push(("solver.method", method));
            let (early, late) = compare(file, &changes);
            println!("{method}, {file}: {early:.2e} m to 12 ms, {late:.2e} m to 20 ms");
            assert!(early < 1e-7, "{method}, {file}: {early:e} m up to 12 ms");
            assert!(late < 1e-6, "{method}, {file}: {late:e} m up to 20 ms");
        }
    }
}

#[test]
fn ideal_reactions_have_their_reference_values() {
    let mut simulation = simulation("spcmm", &[("contact.clearance", "0")]);
    let mut frame = Frame::default();
    let references = [(0.0, [8.28797785, 8.5687895, 2.83010815]), (0.5, [7.83492554, 7.20329026, 3.07470177])];
    for (time, expected) in references {
        simulation.advance_to(time).unwrap();
        simulation.sample(time, &mut frame);
        for (joint, expected) in frame.joints.iter().zip(expected) {
            assert!((joint.normal_force.norm() - expected).abs() < 1e-7, "{time}: {}", joint.normal_force.norm());
            assert!(joint.eccentricity.norm() < 1e-14, "{:e}", joint.eccentricity.norm());
        }
    }
}

#[test]
fn first_impacts_have_their_reference_speeds_and_peaks() {
    let mut simulation = simulation("spcmm", &[("solver.tolerance", "1e-9")]);
    // (joint; start, s; approach speed, m/s; peak, N): reference values of the contract.
    let expected = [
        (0, 7.801422908e-3, 0.07690900, 621.35),
        (1, 7.807677416e-3, 0.07687389, 560.67),
        (2, 7.807810294e-3, 0.07682235, 533.36),
        (1, 10.01967e-3, 0.06366, 870.58),
        (0, 10.50063e-3, 0.07533, 771.13),
        (2, 12.38051e-3, 0.04730, 321.29),
    ];
    let mut impacts: Vec<(usize, f64, f64, f64)> = Vec::new();
    let mut open: [Option<usize>; 3] = [None; 3];
    let mut peaks = Vec::new();
    while simulation.time() < 0.013 {
        simulation.step().unwrap();
        simulation.take_peaks(&mut peaks);
        for j in 0..3 {
            if peaks[j].impacts > 0 {
                open[j] = Some(impacts.len());
                impacts.push((j, simulation.time(), peaks[j].approach_speed, 0.0));
            }
            if let Some(at) = open[j] {
                impacts[at].3 = impacts[at].3.max(peaks[j].normal);
            }
            if !simulation.contact_states(j)[0].active {
                open[j] = None;
            }
        }
    }
    assert!(impacts.len() >= expected.len());
    for (actual, expected_impact) in impacts.iter().zip(expected) {
        assert_eq!(actual.0, expected_impact.0);
        assert!((actual.1 - expected_impact.1).abs() < 2e-8, "start {actual:?} against {expected_impact:?}");
        assert!((actual.2 / expected_impact.2 - 1.0).abs() < 1e-3, "speed {actual:?} against {expected_impact:?}");
        assert!((actual.3 / expected_impact.3 - 1.0).abs() < 5e-4, "peak {actual:?} against {expected_impact:?}");
    }
}

#[test]
fn settled_contact_carries_the_ideal_reaction() {
    let mut play = simulation("spcmm", &[]);
    let mut ideal = simulation("spcmm", &[("contact.clearance", "0")]);
    let (mut a, mut b) = (Frame::default(), Frame::default());
    for (from, to) in [(0.3, 0.4), (1.0, 1.2)] {
        let (mut force, mut reaction) = ([0.0; 3], [0.0; 3]);
        for n in 0..=1000 {
            let t = from + (to - from) * f64::from(n) / 1000.0;
            play.advance_to(t).unwrap();
            ideal.advance_to(t).unwrap();
            play.sample(t, &mut a);
            ideal.sample(t, &mut b);
            for j in 0..3 {
                force[j] += (a.joints[j].normal_force + a.joints[j].friction_force).norm();
                reaction[j] += b.joints[j].normal_force.norm();
            }
        }
        for j in 0..3 {
            let ratio = force[j] / reaction[j];
            println!("{from}-{to} s, joint {j}: settled over ideal {ratio:.5}");
            assert!((ratio - 1.0).abs() < 0.01, "{from}-{to} s, joint {j}: {ratio}");
        }
    }
}

#[test]
fn a_free_slider_crank_has_its_reference_positions_and_conserves_energy() {
    let mut simulation = simulation(
        "slider-crank",
        &[("contact.clearance", "0"), ("joint.C.clearance", "0"), ("solver.tolerance", "1e-10")],
    );
    let mut frame = Frame::default();
    simulation.sample(0.0, &mut frame);
    let energy = frame.kinetic + frame.potential;
    let crank = simulation.machine().bodies.iter().position(|b| b.name == "crank").unwrap();
    let slider = simulation.machine().bodies.iter().position(|b| b.name == "slider").unwrap();
    for (time, theta, theta_rate, x) in
        [(0.1, 0.55187518, None, 0.22636019), (0.2, 1.23040441, Some(8.77212174), 0.26052243)]
    {
        simulation.advance_to(time).unwrap();
        simulation.sample(time, &mut frame);
        let r = frame.bodies[crank].rotation;
        let angle = libm::atan2(r[(2, 1)], r[(1, 1)]);
        assert!((angle - theta).abs() < 1e-7, "{time}: {angle}");
        assert!((frame.bodies[slider].position.x - x).abs() < 1e-7, "{time}: {}", frame.bodies[slider].position.x);
        if let Some(rate) = theta_rate {
            assert!((frame.bodies[crank].angular_velocity.x - rate).abs() < 1e-6);
        }
        assert!((frame.kinetic + frame.potential - energy).abs() < 1e-8, "{time}");
    }
}
