//! Wear maps: the cells add up to the totals of the run, lie at the contact points, and do not affect the run.

use crate::common::{Changes, METHODS, SCENES, parse, run_until, scene, simulation};
use jointplay_physics::machine::{LooseKind, Mat3};
use jointplay_physics::simulate::{Cell, Division, Frame, Simulation, Spot, Wear};
use jointplay_scene::{LiveScene, Scene};

/// Pins and blocks of every kind: with collars that touch at their rims, in a bore, between four walls, and in a plane.
const PINS: &str = include_str!("../fuzz/corpus/good-pins.toml");
const BLOCK: &str = include_str!("../fuzz/corpus/good-block.toml");
const PLANAR: &str = include_str!("../fuzz/corpus/good-planar-play.toml");
const OTHER_KINDS: [(&str, &str); 3] = [("pins", PINS), ("block", BLOCK), ("planar", PLANAR)];
/// One method each of those with error control, with collocation, and with means over a step.
const THREE_METHODS: [&str; 3] = ["dopri5", "radau5", "discrete-gradient"];

/// A run over `duration` with its wear map; the last step is cut at its end.
fn run_with_map(name: &str, changes: &Changes, duration: f64) -> LiveScene {
    run_scene_with_map(&scene(name, changes), duration)
}

fn run_scene_with_map(scene: &Scene, duration: f64) -> LiveScene {
    let mut simulation = LiveScene::new(scene).unwrap();
    simulation.track_wear();
    run_until(&mut simulation, duration);
    simulation.commit_wear();
    simulation
}

fn wear(simulation: &Simulation) -> &Wear {
    simulation.wear().unwrap()
}

/// Sum over the cells of joint `j`.
fn sum(wear: &Wear, j: usize) -> Cell {
    let mut sum = Cell::default();
    for cell in wear.cells(j) {
        sum.contacts += cell.contacts;
        sum.impulse += cell.impulse;
        sum.friction_work += cell.friction_work;
    }
    sum
}

#[test]
fn friction_work_and_contacts_agree_with_ledger_and_counters() {
    let check = |case: &str, simulation: &Simulation| {
        let wear = wear(simulation);
        let joints = simulation.statistics().joints.len();
        let sums: Vec<Cell> = (0..joints).map(|j| sum(wear, j)).collect();
        let contacts: Vec<u64> = sums.iter().map(|sum| sum.contacts).collect();
        let begun = simulation.statistics().joints.iter().map(|joint| joint.impacts);
        assert!(begun.eq(contacts), "{case}");
        let loss = simulation.ledger().unwrap().friction_loss;
        let work: f64 = sums.iter().map(|sum| sum.friction_work).sum();
        let sizes = (0..joints).flat_map(|j| wear.cells(j));
        let size: f64 = sizes.map(|cell| cell.friction_work.abs()).sum();
        println!("{case}: {work:e} of {loss:e}, {:e}", work - loss);
        // The two sums differ only in their order.
        assert!(size > 1e-7, "{case}: {size:e}");
        assert!((work - loss).abs() < 1e-11 * size, "{case}: {work:e}, {loss:e}");
    };
    for name in SCENES {
        check(name, &run_with_map(name, &[], 0.1));
    }
    for method in METHODS {
        let changes = [("solver.method", method), ("contact.friction_velocity", "surface")];
        check(method, &run_with_map("spcmm", &changes, 0.03));
    }
    for method in THREE_METHODS {
        let solver = ("solver.method", method);
        for (name, text) in OTHER_KINDS {
            for form in ["tree", "lagrange"] {
                let run = run_scene_with_map(&parse(text, &[solver, ("formulation", form)]), 0.02);
                check(&format!("{name}, {method}, {form}"), &run);
            }
        }
        for (name, duration) in [("slider-crank-worn", 0.05), ("excavator", 0.02)] {
            check(&format!("{name}, {method}"), &run_with_map(name, &[solver], duration));
        }
    }
    let lagrange = ("formulation", "lagrange");
    let ideal = ("joint.S2.clearance", "0");
    let run = run_with_map("spcmm", &[lagrange, ideal], 0.03);
    let cells = wear(&run).cells(1);
    assert!(cells.is_empty(), "an ideal joint has no wear cells");
    check("partly ideal", &run);
    // Parameters that change in contact.
    let mut run = run_with_map("spcmm", &[], 0.2);
    for (key, value) in
        [("contact.friction", "0.3"), ("contact.youngs_modulus", "150 GPa"), ("contact.clearance", "0.25 mm")]
    {
        run.set(key, value).unwrap();
        let end = run.time() + 0.05;
        run_until(&mut run, end);
    }
    run.commit_wear();
    check("live changes", &run);
}

#[test]
fn impulses_are_time_integrals_of_the_normal_force() {
    for method in ["automatic", "radau5"] {
        let mut simulation = simulation("spcmm", &[("solver.method", method)]);
        simulation.track_wear();
        let (mut frame, mut expected) = (Frame::default(), [0.0; 3]);
        integrate(&mut simulation, 0.05, |weight, simulation, at| {
            simulation.sample(at, &mut frame);
            for (expected, joint) in expected.iter_mut().zip(&frame.joints) {
                *expected += weight * joint.normal_force.norm();
            }
        });
        simulation.commit_wear();
        for (j, expected) in expected.into_iter().enumerate() {
            let impulse = sum(wear(&simulation), j).impulse;
            println!("{method}, joint {j}: {impulse} N s, {:e}", impulse / expected - 1.0);
            // Simpson's rule, or Radau's, over steps that resolve an impact.
            assert!((impulse / expected - 1.0).abs() < 1e-4, "{method}: {impulse} {expected}");
        }
    }
}

#[test]
fn each_end_face_and_corner_has_the_impulse_of_its_own_force() {
    // Means over a step of the discrete gradient are not those of its interpolated positions.
    for (method, limit) in [("dopri5", 1e-4), ("radau5", 1e-4), ("discrete-gradient", 0.02)] {
        for (name, text) in OTHER_KINDS {
            let mut simulation = Simulation::new(&parse(text, &[("solver.method", method)]).machine).unwrap();
            simulation.track_wear();
            let (mut frame, joints) = (Frame::default(), simulation.machine().loose_joints.clone());
            let mut expected: Vec<Vec<f64>> = joints.iter().map(|joint| vec![0.0; joint.sites().len()]).collect();
            integrate(&mut simulation, 0.02, |weight, simulation, at| {
                simulation.sample(at, &mut frame);
                for (j, expected) in expected.iter_mut().enumerate() {
                    let one = [frame.joints[j].normal_force];
                    let sites = frame.sites_of(j).iter().map(|site| site.normal_force);
                    let forces: Vec<_> = if frame.sites_of(j).is_empty() { one.to_vec() } else { sites.collect() };
                    expected.iter_mut().zip(forces).for_each(|(sum, force)| *sum += weight * force.norm());
                }
            });
            simulation.commit_wear();
            let (mut loaded, wear) = (0, wear(&simulation));
            for (j, expected) in expected.iter().enumerate() {
                let whole: f64 = expected.iter().sum();
                let mut found = vec![0.0; expected.len()];
                let cells = wear.division(j).each().zip(wear.cells(j));
                cells.for_each(|((part, _), cell)| found[usize::from(part.place)] += cell.impulse);
                for (found, expected) in found.iter().zip(expected) {
                    println!("{name}, {method}, joint {j}: {found:e} of {expected:e} N s");
                    assert!((found - expected).abs() < limit * whole, "{name}, {method}: {found} {expected}");
                    loaded += usize::from(*expected > 0.0);
                }
            }
            assert!(loaded >= 3, "{name}, {method}: {loaded}");
        }
    }
}

/// Calls `visit` with weight, s, and instant of a quadrature over each step up to `end`.
fn integrate(simulation: &mut Simulation, end: f64, mut visit: impl FnMut(f64, &mut Simulation, f64)) {
    while simulation.time() < end {
        simulation.step().unwrap();
        let (from, to) = (simulation.step_start(), simulation.time());
        // Gauss quadrature with five points.
        let root = (10.0_f64 / 7.0).sqrt();
        let (inner, outer) = ((5.0 - 2.0 * root).sqrt() / 3.0, (5.0 + 2.0 * root).sqrt() / 3.0);
        let (inner_weight, outer_weight) =
            ((322.0 + 13.0 * 70.0_f64.sqrt()) / 1800.0, (322.0 - 13.0 * 70.0_f64.sqrt()) / 1800.0);
        let middle = 64.0 / 225.0;
        for (at, weight) in [
            (-outer, outer_weight),
            (-inner, inner_weight),
            (0.0, middle),
            (inner, inner_weight),
            (outer, outer_weight),
        ] {
            visit(weight * (to - from), simulation, from + 0.5 * (1.0 + at) * (to - from));
        }
    }
}

#[test]
fn a_wear_map_needs_no_ledger_and_ends_at_a_reset() {
    let without_ledger = run_with_map("pendulum", &[("solver.energy_ledger", "off")], 0.05);
    let mut with_ledger = run_with_map("pendulum", &[], 0.05);
    assert!(wear(&without_ledger).cells(0) == wear(&with_ledger).cells(0));
    with_ledger.reset().unwrap();
    assert!(with_ledger.wear().is_none());
}

#[test]
fn a_cell_lies_where_the_ball_touches() {
    for name in ["spcmm", "pendulum", "slider-crank"] {
        let mut simulation = simulation(name, &[]);
        simulation.advance_to(0.5).unwrap();
        simulation.track_wear();
        let (empty, mut frame) = (wear(&simulation).clone(), Frame::default());
        let joints = simulation.machine().loose_joints.len();
        let mut expected: Vec<_> = (0..joints).map(|j| vec![0.0; empty.division(j).cells()]).collect();
        while simulation.time() < 0.6 {
            simulation.step().unwrap();
            simulation.sample(simulation.time(), &mut frame);
            let h = simulation.time() - simulation.step_start();
            let machine = simulation.machine().clone();
            for (j, joint) in machine.loose_joints.iter().enumerate() {
                let rotation = match joint.carrier().body {
                    Some(b) => frame.bodies[b].rotation,
                    None => Mat3::identity(),
                };
                let report = &frame.joints[j];
                let direction = rotation.transpose() * report.eccentricity.normalize();
                if let Some(cell) = empty.division(j).cell(&Spot { place: 0, direction }) {
                    expected[j][cell] += h * report.normal_force.norm();
                }
            }
        }
        simulation.commit_wear();
        let wear = wear(&simulation);
        for (j, expected) in expected.iter().enumerate() {
            if wear.cells(j).is_empty() {
                continue;
            }
            let impulse = |cell: usize| wear.cells(j)[cell].impulse;
            let total: f64 = expected.iter().sum();
            let difference: f64 = (0..expected.len()).map(|i| (impulse(i) - expected[i]).abs()).sum();
            println!("{name}, joint {j}: {difference:e} of {total:e}");
            // The reference assigns a whole step at the edge of two cells to one of them.
            assert!(total > 0.0 && difference < 0.05 * total, "{name}, joint {j}: {difference} of {total}");
        }
    }
}

#[test]
fn a_pin_wears_its_bearing_where_it_touches_in_the_axes_of_the_bearing() {
    for (ends, method) in [("bearing", "dopri5"), ("pin", "dopri5"), ("bearing", "discrete-gradient")] {
        let changes = [("joint.J.play.ends", ends), ("solver.method", method)];
        // The bearing turns, too.
        let text = include_str!("../../assets/benchmarks/free-housing.toml");
        let name = parse(text, &[]).machine.loose_joints[0].name.clone();
        let changes = changes.map(|(key, value)| (key.replace(".J.", &format!(".{name}.")), value));
        let changes: Vec<(&str, &str)> = changes.iter().map(|(key, value)| (&key[..], *value)).collect();
        let mut simulation = Simulation::new(&parse(text, &changes).machine).unwrap();
        simulation.track_wear();
        let joint = simulation.machine().loose_joints[0].clone();
        assert!(matches!(joint.kind, LooseKind::Pin(_)));
        let division: Division = wear(&simulation).division(0).clone();
        let (mut frame, mut expected) = (Frame::default(), vec![0.0; division.cells()]);
        let mut turned = 0.0_f64;
        while simulation.time() < 0.03 {
            simulation.step().unwrap();
            simulation.sample(simulation.time(), &mut frame);
            let h = simulation.time() - simulation.step_start();
            let axes = frame.axes_of(&joint.frames[0]);
            turned = turned.max((axes - joint.frames[0].rotation.to_rotation_matrix().into_inner()).norm());
            for (place, site) in frame.sites_of(0).iter().enumerate().take(2) {
                // Where the forces act lies on the wall of the bearing, to the depth and the play.
                let from_axis = axes.tr_mul(&(site.contact_point - frame.joints[0].socket_centre));
                let azimuth = from_axis.z.atan2(from_axis.y);
                let within = |edges: [f64; 2]| {
                    let off = azimuth - 0.5 * (edges[0] + edges[1]);
                    off.cos() >= (0.5 * (edges[1] - edges[0])).cos()
                };
                let cells = division.each().enumerate().filter(|(_, (part, _))| usize::from(part.place) == place);
                let mut own = cells.filter(|(_, (part, cell))| part.edges(*cell).azimuth.is_some_and(within));
                let number = own.next().map(|(number, _)| number).unwrap();
                expected[number] += h * site.normal_force.norm();
            }
        }
        simulation.commit_wear();
        let found = wear(&simulation).cells(0);
        let total: f64 = expected.iter().sum();
        let difference: f64 = expected.iter().zip(found).map(|(sum, cell)| (sum - cell.impulse).abs()).sum();
        let used = expected.iter().filter(|sum| **sum > 0.0).count();
        println!("{ends}, {method}: {difference:e} of {total:e} in {used} cells, turned {turned}");
        // The reference assigns a whole step at the edge of two cells to one of them.
        assert!(total > 0.0 && used > 3 && difference < 0.1 * total, "{ends}, {method}: {difference} of {total}");
    }
}
