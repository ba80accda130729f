//! Pins whose contacts follow Johnson's line contact, a stiffness matched to it, or a given one: against the closed forms of Johnson and
//! ESDU 78035, written here by force where the program works by depth.

use std::f64::consts::PI;

use super::loose_kinds::{accurately, crank_pin, free_pair, impacts, pin, spinning_pin, thrown_pin};
use jointplay_physics::contact::{ElasticLaw, Elasticity, NormalLaw, Parameters};
use jointplay_physics::integrate::Method;
use jointplay_physics::machine::{
    Attachment, ContactFault, Element, ElementKind, EndsOn, Formulation, JointStart, Load, LoadAxes, LooseFault,
    LooseKind, Machine, MachineFault, Pin, Quat, Slide, StartRule, Vec3,
};
use jointplay_physics::simulate::{Doubt, Effect, Frame, Impact, Simulation};

/// The pin of the tables: r 10, c 0.1, L 24 mm, steel.
const LENGTH: f64 = 0.024;
const PLAY: f64 = 1e-4;
const LINE: Elasticity = Elasticity::Line { length: LENGTH };
/// E* = E / (2 (1 - nu^2)), Pa.
const MODULUS: f64 = 206e9 / (2.0 * (1.0 - 0.3 * 0.3));
/// pi E* L, N/m.
const STIFFNESS: f64 = PI * MODULUS * LENGTH;
/// Collars do not touch, and the pin stays in the middle.
const KEPT: Pin = Pin { length: Some(LENGTH), ends: EndsOn::Pin, kept: true, face_radius: None, travel: None };

/// Johnson's depth of a pin with `stiffness` = pi E* L in a gap `c` under `force`, m.
fn johnson(force: f64, stiffness: f64, c: f64) -> f64 {
    force / stiffness * (libm::log(4.0 * stiffness * c / force) - 1.0)
}

/// The energy that Johnson's contact stores under `force`, J: the integral of F d'(F).
fn stored(force: f64, stiffness: f64, c: f64) -> f64 {
    0.5 * force * force / stiffness * (libm::log(4.0 * stiffness * c / force) - 1.5)
}

/// The force at which Johnson's contact has stored `energy`, J, in N.
fn peak_of_energy(energy: f64, stiffness: f64, c: f64) -> f64 {
    let (mut low, mut high) = (0.0, 4.0 * stiffness * c * libm::exp(-2.0));
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        *if stored(middle, stiffness, c) < energy { &mut low } else { &mut high } = middle;
    }
    low
}

fn with(elasticity: Elasticity, mut machine: Machine) -> Machine {
    for joint in &mut machine.loose_joints {
        if let LooseKind::Pin(_) = joint.kind {
            joint.contact.elasticity = elasticity;
        }
    }
    machine
}

fn law(elasticity: Elasticity) -> ElasticLaw {
    ElasticLaw::of_joint(&Parameters { elasticity, ..Parameters::default() }, PLAY)
}

/// The pin thrown down at `speed` without damping, m/s.
fn elastic_throw(elasticity: Elasticity, kind: Pin, speed: f64) -> Machine {
    let mut machine = with(elasticity, accurately(thrown_pin(0.0, kind)));
    machine.loose_joints[0].contact.normal_law = NormalLaw::Hertz;
    if let JointStart::Pose { velocity, .. } = &mut machine.joints[0].start {
        *velocity = Vec3::new(0.0, 0.0, -speed);
    }
    machine
}

/// Its force at the deepest point, N, of both ends together, and how long the impact lasts, s.
fn thrown(elasticity: Elasticity, kind: Pin, speed: f64) -> (f64, f64) {
    let (impacts, simulation) = impacts(&elastic_throw(elasticity, kind, speed), 1.5 * PLAY / speed);
    assert!(simulation.ledger().unwrap().residual().abs() < 1e-8 * 0.05 * speed * speed);
    (impacts.iter().map(|impact| impact.peak).sum(), impacts[0].end - impacts[0].start)
}

#[test]
fn depths_under_load_are_those_of_the_table() {
    let [sphere, line] = [Elasticity::Sphere, LINE].map(law);
    assert!((sphere.stiffness / 1.517e11 - 1.0).abs() < 4e-4);
    // h = (1 - nu^2) / (pi E) of either part.
    let s = 2.0 * (1.0 - 0.3 * 0.3) / (PI * 206e9);
    let esdu = |force: f64| force * s / LENGTH * (libm::log(4.0 * LENGTH * PLAY / (force * s)) + 1.0);
    let rows = [
        (10.0, ["0.163", "0.014", "0.016"]),
        (100.0, ["0.758", "0.111", "0.134"]),
        (1e3, ["3.52", "0.836", "1.07"]),
        (1e4, ["16.3", "5.66", "8.01"]),
    ];
    for (force, printed) in rows {
        let depths = [sphere.depth(force), line.depth(force), esdu(force)];
        for (depth, printed) in depths.iter().zip(printed) {
            let digits = printed.len() - 1 - printed.find('.').unwrap();
            assert_eq!(format!("{:.digits$}", 1e6 * depth), printed, "{force} N");
        }
        let depth = johnson(force, STIFFNESS, PLAY);
        assert!((depths[1] / depth - 1.0).abs() < 1e-14 && (line.force(depth) / force - 1.0).abs() < 1e-14);
        // ESDU adds twice F / (pi E* L).
        assert!((depths[2] - depth - 2.0 * force / STIFFNESS).abs() < 1e-14 * depth);
        println!("{force} N: {depths:?} m, F ~ d^{:.3}", line.exponent(depth));
    }
}

#[test]
fn peaks_of_undamped_impacts_follow_from_the_energy() {
    let planar = Pin { length: None, ends: EndsOn::Bearing, ..KEPT };
    for (speed, sphere, line) in [(0.2, 1235.0, 2438.0), (0.02, 78.0, 204.0)] {
        let energy = 0.05 * speed * speed;
        let expected = peak_of_energy(energy, STIFFNESS, PLAY);
        assert!((expected - line).abs() < 0.5, "{expected}");
        let whole = law(LINE);
        assert!((whole.force(whole.deepest(0.0, 0.1, speed)) / expected - 1.0).abs() < 1e-13);
        for kind in [KEPT, planar] {
            let (of_sphere, long) = thrown(Elasticity::Sphere, kind, speed);
            let (of_line, short) = thrown(LINE, kind, speed);
            println!(
                "{speed} m/s: {of_sphere:.3} N for {:.2} us, {of_line:.3} N ({expected:.3} N) for {:.2} us",
                1e6 * long,
                1e6 * short
            );
            assert!((of_sphere - sphere).abs() < 0.5, "{of_sphere}");
            assert!((of_line / expected - 1.0).abs() < 1e-7, "{of_line} {expected}");
            // Twice the peak and more, half of the time and less.
            assert!((1.9..2.7).contains(&(of_line / of_sphere)) && (0.3..0.5).contains(&(short / long)));
        }
    }
}

/// Where it is matched, a power of 1.5 stores 2/5 F d, less than the line contact, and beyond it is stiffer: it strikes harder.
#[test]
fn a_given_and_a_matched_stiffness_strike_as_their_powers_say() {
    let speed = 0.2;
    let of_line = peak_of_energy(0.05 * speed * speed, STIFFNESS, PLAY);
    let matched = |force: f64| {
        let stiffness = force / libm::pow(johnson(force, STIFFNESS, PLAY), 1.5);
        (Elasticity::StiffnessAt { force, length: LENGTH }, stiffness)
    };
    for (elasticity, stiffness) in [(Elasticity::Stiffness(5e10), 5e10), matched(1000.0), matched(of_line)] {
        // m v^2 / 2 = 2/5 K d^2.5, and 2.9432 d / v.
        let deepest = libm::pow(1.25 * 0.1 * speed * speed / stiffness, 0.4);
        let expected = [stiffness * libm::pow(deepest, 1.5), 2.943_275 * deepest / speed];
        let (peak, duration) = thrown(elasticity, KEPT, speed);
        println!("{elasticity:?}: {peak:.3} N for {:.3} us, {expected:?}", 1e6 * duration);
        assert!((peak / expected[0] - 1.0).abs() < 1e-7, "{elasticity:?}: {peak} {expected:?}");
        assert!((duration / expected[1] - 1.0).abs() < 1e-6, "{elasticity:?}: {duration:e} {expected:?}");
        assert_eq!(peak > of_line, elasticity != Elasticity::Stiffness(5e10));
    }
}

/// The damping takes its part of the energy whatever the elastic law: the law of Gonthier returns what is asked for.
#[test]
fn restitution_does_not_depend_on_the_elastic_law() {
    let planar = Pin { length: None, ends: EndsOn::Bearing, ..KEPT };
    for elasticity in [Elasticity::Sphere, LINE, Elasticity::StiffnessAt { force: 1e3, length: LENGTH }] {
        for method in Method::ALL {
            let mut machine = elastic_throw(elasticity, planar, 0.2);
            let contact = &mut machine.loose_joints[0].contact;
            (contact.normal_law, contact.restitution) = (NormalLaw::Gonthier, 0.6);
            (machine.solver.method, machine.solver.step) = (method, 1e-7);
            let (impacts, simulation) = impacts(&machine, 0.8e-3);
            let achieved = impacts[0].achieved();
            println!("{elasticity:?} {method}: {achieved}, {} steps", impacts[0].steps);
            // Few steps of the discrete gradient lose less than the law, and never more.
            let most = match method {
                Method::DiscreteGradient => 0.01,
                Method::RungeKutta4 => 1e-6,
                _ => 1e-7,
            };
            assert!((achieved - 0.6).abs() < most, "{elasticity:?} {method}: {achieved}");
            assert!(simulation.doubts().iter().all(|doubt| !matches!(doubt, Doubt::Rebound { .. })));
        }
    }
}

/// Each end carries its share of 100 N by the lever, at Johnson's depth for half of the length.
#[test]
fn a_loaded_pin_rests_as_deep_as_the_line_contact_of_its_halves() {
    let half = 0.5 * LENGTH;
    for (x, formulation) in [(0.0, Formulation::Tree), (0.006, Formulation::Tree), (0.006, Formulation::Lagrange)] {
        let mut machine = with(LINE, accurately(thrown_pin(0.0, KEPT)));
        machine.formulation = formulation;
        machine.joints[0].start = resting(PLAY);
        machine.elements.push(load(x, 100.0));
        machine.start = StartRule::Equilibrium;
        let mut simulation = Simulation::new(&machine).unwrap();
        simulation.advance_to(0.01).unwrap();
        let mut frame = Frame::default();
        simulation.sample_now(&mut frame);
        let expected = johnson(100.0 * (0.5 + 0.5 * x / half), 0.5 * STIFFNESS, PLAY);
        let deepest = frame.joints[0].penetration;
        println!("{x}: {deepest:e} {expected:e}");
        // The lever arms of a tilted pin, and the tolerance of the equilibrium.
        assert!((deepest / expected - 1.0).abs() < 1e-3, "{x}: {deepest:e} {expected:e}");
    }
}

/// Near the bottom of its bearing.
fn resting(play: f64) -> JointStart {
    JointStart::Pose {
        position: Vec3::new(0.0, 0.0, -0.999 * play),
        rotation: Quat::identity(),
        velocity: Vec3::zeros(),
        angular_velocity: Vec3::zeros(),
    }
}

/// `force` (N) down at `x` (m) from the middle.
fn load(x: f64, force: f64) -> Element {
    let load = Load {
        on: Attachment::on(0, Vec3::new(x, 0.0, 0.0)),
        force: Vec3::new(0.0, 0.0, -force),
        torque: Vec3::zeros(),
        axes: LoadAxes::World,
        factor: None,
    };
    Element { name: "load".to_owned(), kind: ElementKind::Load(load) }
}

/// A pin at rest under a load F, which the wall lifts as its play shrinks from 2 c to c: F c, and the integral of dU/dc at constant force,
/// which for the line contact is F^2 / (2 pi E* L) ln 2.
#[test]
fn a_shrinking_play_does_the_work_of_the_closed_form() {
    let force: f64 = 2e4;
    let of_line = force * force / (2.0 * STIFFNESS) * std::f64::consts::LN_2;
    for (elasticity, stiffening) in [
        (LINE, of_line),
        // K ~ d0^-1.5, dU/dc = -1.5 d0' / d0 U, d0' = F / (pi E* L c), U = 2/5 F d0.
        (Elasticity::StiffnessAt { force, length: LENGTH }, 1.2 * of_line),
        (Elasticity::Stiffness(4e11), 0.0),
    ] {
        // The discrete gradient samples the work of the load once in each step of the ringing pin.
        for (method, tolerance, residual) in [(Method::Radau5, 3e-6, 6e-6), (Method::DiscreteGradient, 1e-5, 1e-2)] {
            let mut machine = with(elasticity, accurately(thrown_pin(0.0, KEPT)));
            (machine.solver.method, machine.solver.tolerance) = (method, 1e-9);
            // Damping would take its share of the force while the depth follows the play.
            machine.loose_joints[0].contact.normal_law = NormalLaw::Hertz;
            machine.loose_joints[0].contact.clearance = 2.0 * PLAY;
            machine.joints[0].start = resting(2.0 * PLAY);
            machine.elements.push(load(0.0, force));
            machine.start = StartRule::Equilibrium;
            let mut simulation = Simulation::new(&machine).unwrap();
            simulation.advance_to(1e-3).unwrap();
            let mut next = simulation.changed_machine();
            next.loose_joints[0].contact.clearance = PLAY;
            assert_eq!(simulation.adopt(&next), Ok(Effect::Now));
            // At 2 mm/s.
            simulation.advance_to(simulation.time() + PLAY / 2e-3 + 1e-6).unwrap();
            assert_eq!(simulation.state().plays(0)[0], PLAY);
            let ledger = *simulation.ledger().unwrap();
            let expected = force * PLAY + stiffening;
            println!(
                "{elasticity:?} {method}: {} J, {expected} J, {stiffening:e} J of it stiffness, residual {:e} J",
                ledger.clearance_work,
                ledger.residual()
            );
            assert!((ledger.clearance_work / expected - 1.0).abs() < tolerance, "{elasticity:?} {method}");
            assert!(ledger.residual().abs() < residual, "{:e} J", ledger.residual());
        }
    }
}

#[test]
fn the_ledger_closes_with_and_without_a_moving_play() {
    for (formulation, method) in [
        (Formulation::Tree, Method::DormandPrince5),
        (Formulation::Lagrange, Method::DormandPrince5),
        (Formulation::Tree, Method::DiscreteGradient),
    ] {
        for moves in [false, true] {
            let mut machine = Machine { formulation, ..with(LINE, accurately(spinning_pin(EndsOn::Pin, 0.15))) };
            machine.solver.method = method;
            let mut simulation = Simulation::new(&machine).unwrap();
            simulation.advance_to(1e-3).unwrap();
            if moves {
                let mut next = simulation.changed_machine();
                next.loose_joints[0].contact.clearance = 0.5e-4;
                assert_eq!(simulation.adopt(&next), Ok(Effect::Now));
            }
            simulation.advance_to(0.06).unwrap();
            let ledger = *simulation.ledger().unwrap();
            println!("{method} {formulation:?} {moves}: {:e} J of {:e} J", ledger.residual(), ledger.scale());
            // As with spheres (`loose_kinds`).
            assert!(ledger.residual().abs() < 1e-7, "{method} {formulation:?} {moves}: {:e} J", ledger.residual());
        }
    }
}

#[test]
fn both_formulations_and_every_method_step_a_line_contact() {
    let long = Pin { length: Some(0.02), ends: EndsOn::Bearing, kept: true, face_radius: None, travel: None };
    let machine = with(Elasticity::Line { length: 0.02 }, crank_pin(0.1, long));
    let peak = |method: Method, formulation: Formulation, tolerance: f64| {
        let mut machine = Machine { formulation, ..machine.clone() };
        machine.solver.method = method;
        machine.solver.step = 2e-7;
        machine.solver.tolerance = tolerance;
        let (impacts, simulation) = impacts(&machine, 1.2e-3);
        let ledger = *simulation.ledger().unwrap();
        let steps = simulation.statistics().steps;
        println!("{method} {formulation:?}: {:?} N, {steps} steps, {:e} J", impacts[0].peak, ledger.residual());
        // Both ends strike at once, in either order.
        impacts[..2].iter().map(|impact| impact.peak).fold(0.0, f64::max)
    };
    let reference = peak(Method::DormandPrince5, Formulation::Tree, 1e-11);
    for method in Method::ALL {
        for formulation in [Formulation::Tree, Formulation::Lagrange] {
            let error = (peak(method, formulation, 1e-7) / reference - 1.0).abs();
            // As with spheres (`loose_kinds`).
            let allowed = if method == Method::DiscreteGradient { 0.02 } else { 1e-4 };
            assert!(error < allowed, "{method} {formulation:?}: {error}");
        }
    }
}

/// The momentum of a free pair, and the impacts of both formulations.
#[test]
fn a_free_pair_strikes_alike_in_both_formulations() {
    let machine = with(Elasticity::Line { length: 0.02 }, accurately(free_pair()));
    let [tree, lagrange] = [Formulation::Tree, Formulation::Lagrange]
        .map(|formulation| impacts(&Machine { formulation, ..machine.clone() }, 6e-3).0);
    assert!(tree.len() >= 5 && tree.len() == lagrange.len());
    for (a, b) in tree.iter().zip(&lagrange) {
        let errors = [(a.start - b.start).abs(), (a.peak / b.peak - 1.0).abs()];
        assert!(errors[0] < 1e-9 && errors[1] < 1e-6, "{errors:?}");
    }
}

/// Error of the largest force of an elastic impact in fixed steps, averaged over where in a step it begins, and the power of the step with
/// which it falls. A force like d^1.5 and one like d / ln(1 / d) both have a kink in their slope or below at the start.
#[test]
fn fixed_steps_converge_on_a_line_as_on_a_sphere() {
    for (elasticity, order) in [(Elasticity::Sphere, 2.0), (LINE, 1.5)] {
        let planar = Pin { length: None, ends: EndsOn::Bearing, ..KEPT };
        let duration = thrown(elasticity, planar, 0.2).1;
        let error = |steps: f64| {
            let mut machine = elastic_throw(elasticity, planar, 0.2);
            machine.solver.method = Method::RungeKutta4;
            machine.solver.step = duration / steps;
            let of_start = |start: u32| {
                let mut machine = machine.clone();
                if let JointStart::Pose { position, .. } = &mut machine.joints[0].start {
                    position.z = -0.2 * machine.solver.step * f64::from(start) / 8.0;
                }
                let (_, simulation) = impacts(&machine, 0.5e-3 + 2.0 * duration);
                let ledger = *simulation.ledger().unwrap();
                ledger.residual().abs() / 2e-3
            };
            (0..8).map(of_start).sum::<f64>() / 8.0
        };
        let errors = [25.0, 50.0, 100.0, 200.0, 400.0].map(error);
        let observed = libm::log2(errors[0] / errors[4]) / 4.0;
        println!("{elasticity:?}: {errors:?}, order {observed:.2}");
        assert!(observed > order, "{elasticity:?}: {observed}");
    }
}

#[test]
fn without_play_the_pin_is_ideal() {
    let long = Pin { length: Some(0.02), ends: EndsOn::Pin, kept: true, face_radius: None, travel: None };
    for elasticity in [
        Elasticity::Line { length: 0.02 },
        Elasticity::StiffnessAt { force: 1e3, length: 0.02 },
        Elasticity::Stiffness(1e11),
    ] {
        let mut machine = with(elasticity, crank_pin(0.0, long));
        machine.loose_joints.last_mut().unwrap().contact.clearance = 0.0;
        let (found, mut simulation) = impacts(&machine, 2e-3);
        assert!(found.is_empty());
        let mut frame = Frame::default();
        simulation.sample_now(&mut frame);
        let joint = frame.joints.last().unwrap();
        assert!(joint.eccentricity.norm() < 1e-9 && joint.normal_force.norm() > 1.0);
    }
}

/// A pin that plays along its axis alone touches with its collars, which have no line contact: 0.1 kg between two faces.
#[test]
fn collars_keep_the_stiffness_of_a_sphere() {
    for elasticity in [Elasticity::Sphere, LINE, Elasticity::StiffnessAt { force: 1e3, length: LENGTH }] {
        for method in [Method::DormandPrince5, Method::DiscreteGradient] {
            let mut machine = elastic_throw(elasticity, KEPT, 0.2);
            let contact = &mut machine.loose_joints[0].contact;
            (contact.clearance, contact.second_clearance) = (0.0, PLAY);
            if let JointStart::Pose { velocity, .. } = &mut machine.joints[0].start {
                *velocity = Vec3::new(0.2, 0.0, 0.0);
            }
            machine.solver.method = method;
            let (impacts, simulation) = impacts(&machine, 0.8e-3);
            let steps = simulation.statistics().steps;
            println!("{elasticity:?} {method}: {} N, {steps} steps", impacts[0].peak);
            let stiffness = law(Elasticity::Sphere).stiffness;
            let expected = stiffness * libm::pow(1.25 * 0.1 * 0.04 / stiffness, 0.6);
            let most = if method == Method::DiscreteGradient { 0.02 } else { 1e-7 };
            assert!((impacts[0].peak / expected - 1.0).abs() < most && steps < 500, "{elasticity:?} {method}: {steps}");
        }
    }
}

/// 5 um of play under 0.1 kg at 0.5 and 4 m/s: half of the width of the contact is no longer small against the pin, and the second impact
/// goes beyond the largest force of the theory.
#[test]
fn a_contact_too_wide_for_the_theory_is_doubted() {
    let play = 5e-6;
    for (speed, beyond) in [(0.05, false), (0.5, false), (4.0, true)] {
        let mut machine = elastic_throw(LINE, KEPT, speed);
        machine.loose_joints[0].contact.clearance = play;
        let (impacts, simulation) = impacts(&machine, 3e-4);
        let peak: f64 = impacts[..2].iter().map(|impact: &Impact| impact.peak).sum();
        let most = 4.0 * STIFFNESS * play * libm::exp(-2.0);
        let half_width = libm::sqrt(4.0 * peak / STIFFNESS * (0.01 + play) * 0.01 / play) / 0.01;
        println!("{speed} m/s: {peak} N of {most} N, half width over radius {half_width}");
        assert_eq!(peak > most, beyond);
        let doubts = simulation.doubts();
        let radii = doubts.iter().find_map(|doubt| match doubt {
            Doubt::Patch { radii, .. } => Some(*radii),
            _ => None,
        });
        assert_eq!(radii.is_some(), half_width > 1.0 / 3.0, "{doubts:?}");
        assert!(radii.is_none_or(|radii| (radii / half_width - 1.0).abs() < 1e-6), "{radii:?} {half_width}");
        // Beyond, too, the energy is stored and returned.
        assert!(simulation.ledger().unwrap().residual().abs() < 1e-6 * 0.05 * speed * speed);
    }
}

#[test]
fn laws_that_a_joint_cannot_have_are_refused() {
    let fault = |elasticity: Elasticity, kind: LooseKind| {
        let mut machine = with(elasticity, thrown_pin(0.0, pin(EndsOn::Pin)));
        (machine.loose_joints[0].kind, machine.loose_joints[0].contact.elasticity) = (kind, elasticity);
        match machine.check() {
            Err(MachineFault::Contact { fault: ContactFault::Loose(fault), .. }) => Some(fault),
            _ => None,
        }
    };
    let of_pin = |elasticity: Elasticity| fault(elasticity, LooseKind::Pin(pin(EndsOn::Pin)));
    let most = 4.0 * STIFFNESS * PLAY * libm::exp(-2.0);
    let at = |force: f64| Elasticity::StiffnessAt { force, length: LENGTH };
    for elasticity in [LINE, at(0.999 * most), Elasticity::Stiffness(1e10)] {
        assert_eq!(of_pin(elasticity), None);
    }
    for force in [0.0, -1.0, 1.001 * most, f64::NAN] {
        let fault = of_pin(at(force)).unwrap();
        assert!(matches!(fault, LooseFault::StiffnessAt { .. }));
        assert!(fault.to_string().contains("above 0 N to below 462000 N"), "{fault}");
    }
    assert!(matches!(of_pin(Elasticity::Line { length: 0.0 }), Some(LooseFault::Length { .. })));
    assert_eq!(of_pin(Elasticity::Stiffness(0.0)), Some(LooseFault::Stiffness(0.0)));
    let block = Slide { half_length: 0.02, half_width: 0.01, half_height: None, corner_radius: 1e-3 };
    for kind in [LooseKind::Ball, LooseKind::Slide(block)] {
        assert_eq!(fault(LINE, kind), Some(LooseFault::LineContact));
        assert_eq!(fault(at(10.0), kind), Some(LooseFault::LineContact));
        assert_eq!(fault(Elasticity::Stiffness(1e10), kind), None);
    }
}
