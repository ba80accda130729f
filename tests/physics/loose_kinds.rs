//! Pins and slides with play, against closed forms and against runs of an independent program: free rigid bodies with quaternions,
//! DOP853 at a tolerance of 1e-13 with located contacts (`tests/physics/joints`: the first ten contacts of each).

use jointplay_physics::contact::{FrictionVelocity, NormalLaw, Parameters};
use jointplay_physics::integrate::Method;
use jointplay_physics::machine::{
    Attachment, Body, ContactFault, Drive, Element, ElementKind, EndsOn, Formulation, Joint, JointFrame, JointStart,
    Load, LoadAxes, LooseFault, LooseJoint, LooseKind, Machine, MachineFault, Mat3, Pin, Quat, Slide, StartRule, Vec3,
};
use jointplay_physics::simulate::{Effect, Frame, Impact, Simulation};

/// Contacts of the independent program: start, s, approach speed, m/s, and peak, N.
fn contacts(csv: &str) -> Vec<[f64; 3]> {
    let row = |line: &str| {
        let cells: Vec<f64> = line.split(',').skip(1).map(|cell| cell.parse().unwrap()).collect();
        [cells[0], cells[2], cells[3]]
    };
    csv.lines().skip(1).map(row).collect()
}

fn diagonal(x: f64, y: f64, z: f64) -> Mat3 {
    Mat3::from_diagonal(&Vec3::new(x, y, z))
}

/// A joint in this pose and motion.
fn thrown(child: usize, position: Vec3, rotation: Quat, velocity: Vec3, angular_velocity: Vec3) -> Joint {
    let start = JointStart::Pose { position, rotation, velocity, angular_velocity };
    Joint { start, ..Joint::free(child) }
}

/// Loose joint of this kind between frames with the same axes at zero coordinates.
fn loose(kind: LooseKind, carrier: Attachment, carried: Attachment, axes: Quat, contact: Parameters) -> LooseJoint {
    let frames = [carrier, carried].map(|origin| JointFrame { origin, rotation: axes });
    LooseJoint { kind, frames, contact, ..LooseJoint::ball("J", carrier, carried) }
}

/// Axes with x along z.
fn upright() -> Quat {
    Quat::from_axis_angle(&Vec3::y_axis(), -std::f64::consts::FRAC_PI_2)
}

/// Steps `machine` up to `end`, s; its impacts in the order in which they began.
pub fn impacts(machine: &Machine, end: f64) -> (Vec<Impact>, Simulation) {
    let mut simulation = Simulation::new(machine).unwrap();
    let mut impacts = Vec::new();
    while simulation.time() < end {
        simulation.step_until(end).unwrap();
        impacts.extend(simulation.take_impacts());
    }
    impacts.sort_by(|a, b| a.start.total_cmp(&b.start));
    (impacts, simulation)
}

pub fn accurately(mut machine: Machine) -> Machine {
    (machine.solver.method, machine.solver.tolerance) = (Method::DormandPrince5, 1e-11);
    machine
}

/// Compares the first contacts with those of the independent program.
pub(super) fn compare(name: &str, machine: Machine, csv: &str, end: f64) {
    let mut reference = contacts(csv);
    reference.retain(|row| row[0] < end);
    for formulation in [Formulation::Tree, Formulation::Lagrange] {
        let (own, simulation) = impacts(&accurately(Machine { formulation, ..machine.clone() }), end + 2e-3);
        assert!(own.len() >= reference.len(), "{name}: {} of {}", own.len(), reference.len());
        // Contacts that begin together may come in either order.
        for row in &reference {
            let same = |a: &&Impact, b: &&Impact| {
                let far = |impact: &Impact| (impact.start - row[0]).abs() * 1e6 + (impact.peak / row[2] - 1.0).abs();
                far(a).total_cmp(&far(b))
            };
            let impact = own.iter().min_by(same).unwrap();
            let errors = [
                (impact.start - row[0]).abs(),
                (impact.approach_speed / row[1] - 1.0).abs(),
                (impact.peak / row[2] - 1.0).abs(),
            ];
            println!("{name} {formulation:?}: {row:?} {errors:?}");
            assert!(
                errors[0] < 1e-9 && errors[1] < 1e-6 && errors[2] < 1e-6,
                "{name} {formulation:?} {row:?}: {errors:?}"
            );
        }
        let residual = simulation.ledger().unwrap().residual();
        println!("{name}: residual {residual:e} J");
    }
}

/// A pin of 0.1 kg, r 10, L 24 mm, in a fixed bearing with 0.1 mm of play along x, thrown down at 0.2 m/s, tilted by `tilt` (rad).
pub fn thrown_pin(tilt: f64, pin: Pin) -> Machine {
    let mut machine = Machine::default();
    let body = Body::new("pin", 0.1, diagonal(5e-6, 1.583_333_333_333_333_3e-5, 1.583_333_333_333_333_3e-5));
    let tilted = Quat::from_axis_angle(&Vec3::y_axis(), tilt);
    let body = machine.add_body(body, thrown(0, Vec3::zeros(), tilted, Vec3::new(0.0, 0.0, -0.2), Vec3::zeros()));
    let contact = Parameters { clearance: 1e-4, friction: 0.0, ..Parameters::default() };
    let [bearing, carried] = [Attachment::world(Vec3::zeros()), Attachment::on(body, Vec3::zeros())];
    machine.loose_joints.push(loose(LooseKind::Pin(pin), bearing, carried, Quat::identity(), contact));
    machine
}

pub fn pin(ends: EndsOn) -> Pin {
    Pin { length: Some(0.024), ends, kept: false, face_radius: None, travel: None }
}

#[test]
fn a_thrown_pin_strikes_with_the_forces_of_the_closed_form() {
    for ends in [EndsOn::Pin, EndsOn::Bearing] {
        // Parallel: both ends at once, each with half of the stiffness and of the mass.
        let (both, _) = impacts(&accurately(thrown_pin(0.0, pin(ends))), 1e-3);
        assert_eq!(both.len(), 2);
        for impact in &both {
            assert!((impact.start - 0.5e-3).abs() < 1e-12 && (impact.approach_speed - 0.2).abs() < 1e-12);
            assert!((impact.peak / 589.701_774_0 - 1.0).abs() < 1e-8, "{ends:?}: {}", impact.peak);
        }
    }
    // Tilted: one end alone, on 1/m + (L/2 cos t)^2/J.
    let (one, _) = impacts(&accurately(thrown_pin(0.004, pin(EndsOn::Pin))), 0.34e-3);
    assert_eq!(one.len(), 1);
    assert!((one[0].start - 0.260_000_64e-3).abs() < 1e-11, "{:e}", one[0].start);
    assert!((one[0].peak / 606.323_194_4 - 1.0).abs() < 1e-6, "{}", one[0].peak);
}

/// The pin thrown into the bearing with spin and tilt, with 0.2 mm of axial play.
pub fn spinning_pin(ends: EndsOn, friction: f64) -> Machine {
    let mut machine = thrown_pin(0.0, Pin { kept: true, ..pin(ends) });
    machine.loose_joints[0].contact.second_clearance = 2e-4;
    machine.gravity = Vec3::new(0.0, 0.0, -9.81);
    let turn =
        [0.999_999_218_750_195_5, -7.499_998_046_875_2e-7, 0.000_999_999_552_083_401_7, -0.000_749_999_554_687_568_4];
    let [w, x, y, z] = turn;
    machine.joints[0].start = JointStart::Pose {
        position: Vec3::new(2e-5, 3e-5, -1e-5),
        rotation: Quat::new_normalize(nalgebra::Quaternion::new(w, x, y, z)),
        velocity: Vec3::new(0.05, 0.1, -0.2),
        angular_velocity: Vec3::new(20.0, 3.0, -2.0),
    };
    machine.loose_joints[0].contact.friction = friction;
    machine
}

/// A pin in a housing, both free, without gravity, with friction 0.2.
pub fn free_pair() -> Machine {
    let mut machine = Machine::default();
    let housing = Body::new("housing", 0.5, diagonal(3e-4, 4e-4, 5e-4));
    let housing = machine.add_body(
        housing,
        thrown(0, Vec3::zeros(), Quat::identity(), Vec3::new(0.1, -0.05, 0.02), Vec3::new(4.0, -6.0, 5.0)),
    );
    let at = Vec3::new(0.04, -0.01, 0.03);
    let body = Body::new("pin", 0.2, diagonal(9e-5, 9e-5, 1e-5));
    let body = machine.add_body(
        body,
        thrown(1, at, Quat::identity(), Vec3::new(-0.13, 0.110_000_000_000_000_01, 0.34), Vec3::new(5.0, -5.5, 30.0)),
    );
    let contact = Parameters { clearance: 8e-5, friction: 0.2, ball_radius: 9e-3, ..Parameters::default() };
    let kind =
        LooseKind::Pin(Pin { length: Some(0.02), ends: EndsOn::Pin, kept: false, face_radius: None, travel: None });
    let [carrier, carried] = [Attachment::on(housing, at), Attachment::on(body, Vec3::zeros())];
    machine.loose_joints.push(loose(kind, carrier, carried, upright(), contact));
    machine
}

#[test]
fn spinning_pins_agree_with_an_independent_program() {
    compare("a", spinning_pin(EndsOn::Pin, 0.15), include_str!("joints/a-contacts.csv"), 5.1e-3);
    compare("a_shaft", spinning_pin(EndsOn::Bearing, 0.15), include_str!("joints/a_shaft-contacts.csv"), 5.1e-3);
    compare("b", spinning_pin(EndsOn::Pin, 0.0), include_str!("joints/b-contacts.csv"), 5.1e-3);
    compare("h", free_pair(), include_str!("joints/h-contacts.csv"), 8e-3);
}

/// The pair turned and 30 m away: 4e-15 m of rounding in a position, and depths of micrometres. The same two ends strike with the same
/// forces, which the place and the axes of the world do not enter.
#[test]
fn the_place_of_a_pair_does_not_enter() {
    let near = impacts(&accurately(free_pair()), 5e-3).0;
    let turn = Quat::from_euler_angles(0.4, -1.1, 2.0);
    let mut machine = free_pair();
    for joint in &mut machine.joints {
        if let JointStart::Pose { position, rotation, velocity, angular_velocity } = &mut joint.start {
            *position = turn * *position + Vec3::new(30.0, -20.0, 10.0);
            *rotation = turn * *rotation;
            (*velocity, *angular_velocity) = (turn * *velocity, turn * *angular_velocity);
        }
    }
    let far = impacts(&accurately(machine), 5e-3).0;
    assert_eq!(far.len(), near.len());
    assert!(near.len() >= 5);
    for (a, b) in near.iter().zip(&far) {
        assert!((a.start - b.start).abs() < 1e-9, "{} {}", a.start, b.start);
        assert!((a.peak / b.peak - 1.0).abs() < 1e-6, "{} {}", a.peak, b.peak);
    }
}

/// A pin through a bearing of a tenth of a millimetre beside a long arm: a mass 1 m away turns it, and it strikes with both ends on
/// opposite sides, again and again.
#[test]
fn a_long_arm_on_a_pin_keeps_its_energy() {
    let mut machine = thrown_pin(0.0, Pin { kept: true, ..pin(EndsOn::Bearing) });
    let arm = Vec3::new(0.2, 1.0, 0.3);
    machine.bodies[0].inertia += (Mat3::identity() * arm.norm_squared() - arm * arm.transpose()) * 0.5;
    machine.gravity = Vec3::new(0.0, 0.0, -9.81);
    machine.loose_joints[0].contact.friction = 0.15;
    machine.joints[0].start = JointStart::Pose {
        position: Vec3::zeros(),
        rotation: Quat::identity(),
        velocity: Vec3::zeros(),
        angular_velocity: Vec3::new(2.0, 0.5, -0.3),
    };
    for formulation in [Formulation::Tree, Formulation::Lagrange] {
        let (impacts, simulation) = impacts(&accurately(Machine { formulation, ..machine.clone() }), 0.02);
        let ledger = *simulation.ledger().unwrap();
        println!("{formulation:?}: {} impacts, residual {:e} J", impacts.len(), ledger.residual());
        assert!(impacts.len() > 3);
        assert!(ledger.residual().abs() < 1e-7, "{:e} J", ledger.residual());
    }
}

#[test]
fn a_free_pair_keeps_its_momentum() {
    let momentum = |simulation: &mut Simulation| {
        let mut frame = Frame::default();
        simulation.sample_now(&mut frame);
        let machine = simulation.machine();
        let mut sum = [Vec3::zeros(); 2];
        for (motion, body) in frame.bodies.iter().zip(&machine.bodies) {
            let own = motion.rotation * (body.inertia * motion.rotation.tr_mul(&motion.angular_velocity));
            sum[0] += motion.velocity * body.mass;
            sum[1] += own + motion.position.cross(&motion.velocity) * body.mass;
        }
        sum
    };
    let mut simulation = Simulation::new(&accurately(free_pair())).unwrap();
    let before = momentum(&mut simulation);
    simulation.advance_to(0.03).unwrap();
    let after = momentum(&mut simulation);
    for (before, after) in before.iter().zip(&after) {
        // Action and reaction at one point: exact but for the error of the steps.
        assert!((after - before).norm() < 1e-10 * before.norm(), "{before} {after}");
    }
    let ledger = *simulation.ledger().unwrap();
    assert!(ledger.residual().abs() < 1e-8, "{:e} J", ledger.residual());
}

#[test]
fn a_pin_that_does_not_tilt_strikes_like_a_ball() {
    let planar = Pin { length: None, ends: EndsOn::Bearing, kept: true, face_radius: None, travel: None };
    let (pin, _) = impacts(&accurately(thrown_pin(0.0, planar)), 1e-3);
    assert_eq!(pin.len(), 1);
    assert!((pin[0].peak / (2.0 * 589.701_774_0) - 1.0).abs() < 1e-8, "{}", pin[0].peak);
}

/// A pin under 100 N down at `x` from the middle of its bearing rests with the depths of the closed form: each end carries its
/// share by the lever, and beyond the end the other one presses on the opposite side.
#[test]
fn a_loaded_pin_rests_as_deep_as_the_closed_form_says() {
    let half = 0.012;
    for ends in [EndsOn::Pin, EndsOn::Bearing] {
        for x in [0.0, 0.006, 0.0144] {
            // Held along the axis: the forces on a tilted pin in a bearing have a part along it.
            let mut machine = thrown_pin(0.0, Pin { kept: true, ..pin(ends) });
            machine.joints[0].start = JointStart::Pose {
                position: Vec3::new(0.0, 0.0, -9.9e-5),
                rotation: Quat::identity(),
                velocity: Vec3::zeros(),
                angular_velocity: Vec3::zeros(),
            };
            machine.loose_joints[0].contact.friction = 0.15;
            let load = Load {
                on: Attachment::on(0, Vec3::new(x, 0.0, 0.0)),
                force: Vec3::new(0.0, 0.0, -100.0),
                torque: Vec3::zeros(),
                axes: LoadAxes::World,
                factor: None,
            };
            machine.elements.push(Element { name: "load".to_owned(), kind: ElementKind::Load(load) });
            machine.start = StartRule::Equilibrium;
            let mut simulation = Simulation::new(&accurately(machine)).unwrap();
            simulation.advance_to(0.01).unwrap();
            let stiffness = 7.583_422_629_856_8e10;
            let shares = [0.5 - 0.5 * x / half, 0.5 + 0.5 * x / half].map(|share| 100.0 * share);
            let depths = shares.map(|force| libm::pow(force.abs() / stiffness, 2.0 / 3.0));
            let mut frame = Frame::default();
            simulation.sample_now(&mut frame);
            let deepest = frame.joints[0].penetration;
            println!("{ends:?} {x}: {deepest:e} {depths:?}");
            assert!((deepest - depths[1]).abs() < 1e-9, "{ends:?} {x}: {deepest:e} {depths:?}");
        }
    }
}

/// The slider-crank of Flores with a loose crank pin: 5000 rpm, 0.5 mm, L 20 mm; the rod hangs on an ideal ball at the slider and could
/// tilt.
pub fn crank_pin(friction: f64, kind: Pin) -> Machine {
    let mut machine = Machine { gravity: Vec3::new(0.0, -9.81, 0.0), ..Machine::default() };
    let turning = Drive::Constant { position: 0.0, velocity: 5000.0 / 60.0 * std::f64::consts::TAU };
    let crank = machine.add_body(
        Body::new("crank", 0.3, diagonal(1e-4, 1e-4, 1e-4)),
        Joint::revolute(None, 0, Vec3::z()).with_drive(turning),
    );
    let slider = machine.add_body(
        Body::new("slider", 0.14, diagonal(1e-4, 1e-4, 1e-4)),
        Joint::prismatic(None, 1, Vec3::x()).with_start(0.17, 0.0),
    );
    let rod = machine.add_body(
        Body::new("rod", 0.21, diagonal(2.5e-4, 2.5e-4, 2.5e-4)),
        thrown(
            2,
            Vec3::new(0.11, 0.0, 0.0),
            Quat::identity(),
            Vec3::new(0.0, 13.089_969_389_957_473, 0.0),
            Vec3::new(0.0, 0.0, -218.166_156_499_291_22),
        ),
    );
    let contact = Parameters { clearance: 0.5e-3, friction, youngs_modulus: 207e9, ..Parameters::default() };
    let at = |body, x| Attachment::on(body, Vec3::new(x, 0.0, 0.0));
    let wrist = LooseJoint::ball("S", at(slider, 0.0), at(rod, 0.06)).with_clearance(0.0);
    machine.loose_joints.push(wrist);
    machine.loose_joints.push(loose(LooseKind::Pin(kind), at(crank, 0.05), at(rod, -0.06), upright(), contact));
    machine
}

#[test]
fn a_slider_crank_with_a_loose_crank_pin_agrees_with_an_independent_program() {
    let long = Pin { length: Some(0.02), ends: EndsOn::Pin, kept: false, face_radius: None, travel: None };
    compare("c", crank_pin(0.1, long), include_str!("joints/c-contacts.csv"), 2e-3);
    compare("c_nofric", crank_pin(0.0, long), include_str!("joints/c_nofric-contacts.csv"), 2e-3);
}

/// A crank, driven or free, a rod and a block in a guide with play, in the plane of x and y.
struct SlidingBlock {
    lengths: [f64; 2],
    masses: [f64; 3],
    /// About z, and another value for the rod about x.
    inertias: [f64; 3],
    /// Centre of the crank from its hinge, m.
    crank_centre: f64,
    speed: f64,
    driven: bool,
    slide: Slide,
    contact: Parameters,
}

impl SlidingBlock {
    fn machine(&self) -> Machine {
        let mut machine = Machine { gravity: Vec3::new(0.0, -9.81, 0.0), ..Machine::default() };
        let x = |x: f64| Vec3::new(x, 0.0, 0.0);
        let body = |name: &str, i: usize| {
            let about = self.inertias[i];
            Body::new(name, self.masses[i], diagonal(1e-5, about, about))
        };
        let mut hinge = Joint::revolute(None, 0, Vec3::z());
        hinge.child_point = x(-self.crank_centre);
        hinge = match self.driven {
            true => hinge.with_drive(Drive::Constant { position: 0.0, velocity: self.speed }),
            false => hinge.with_start(0.0, self.speed),
        };
        let crank = machine.add_body(body("crank", 0), hinge);
        let [r, l] = self.lengths;
        let turn = -self.speed * r / l - self.speed;
        let rod_joint = Joint {
            parent_point: x(r - self.crank_centre),
            child_point: x(-0.5 * l),
            ..Joint::revolute(Some(crank), 1, Vec3::z()).with_start(0.0, turn)
        };
        let rod = machine.add_body(body("rod", 1), rod_joint);
        let block_joint = Joint {
            parent_point: x(0.5 * l),
            ..Joint::revolute(Some(rod), 2, Vec3::z()).with_start(0.0, self.speed * r / l)
        };
        let block = machine.add_body(body("block", 2), block_joint);
        let [guide, carried] = [Attachment::world(Vec3::zeros()), Attachment::on(block, Vec3::zeros())];
        machine.loose_joints.push(loose(LooseKind::Slide(self.slide), guide, carried, Quat::identity(), self.contact));
        machine
    }
}

/// The translational joint of Flores et al. 2008: crank 50, rod 120 mm, 5000 rpm, a block of 50 x 50 mm with 0.5 mm of play.
fn flores() -> SlidingBlock {
    SlidingBlock {
        lengths: [0.05, 0.12],
        masses: [0.3, 0.21, 0.14],
        inertias: [1e-4, 2.5e-4, 1e-4],
        crank_centre: 0.0,
        speed: 5000.0 / 60.0 * std::f64::consts::TAU,
        driven: true,
        slide: Slide { half_length: 0.025, half_width: 0.025, half_height: None, corner_radius: 1e-3 },
        contact: Parameters { clearance: 0.5e-3, friction: 0.03, youngs_modulus: 207e9, ..Parameters::default() },
    }
}

/// That of Flores, Leine & Glocker 2010: crank 153, rod 306 mm, released at 150 rad/s, a block of 100 x 50 mm with 1 mm of play.
fn released() -> SlidingBlock {
    SlidingBlock {
        lengths: [0.153, 0.306],
        masses: [0.038, 0.038, 0.076],
        inertias: [7.4e-5, 5.9e-4, 2.7e-6],
        crank_centre: 0.0765,
        speed: 150.0,
        driven: false,
        slide: Slide { half_length: 0.05, half_width: 0.025, half_height: None, corner_radius: 1e-3 },
        contact: Parameters {
            clearance: 1e-3,
            friction: 0.01,
            restitution: 0.4,
            normal_law: NormalLaw::Gonthier,
            youngs_modulus: 207e9,
            ..Parameters::default()
        },
    }
}

#[test]
fn sliders_with_a_loose_block_agree_with_an_independent_program() {
    compare("d2", flores().machine(), include_str!("joints/d2-contacts.csv"), 8e-3);
    compare("d1", released().machine(), include_str!("joints/d1-contacts.csv"), 0.02);
}

/// In space each corner of the planar slide is two, of half the stiffness: a quarter of the radius.
#[test]
fn a_block_in_space_strikes_like_one_in_the_plane() {
    let mut block = released();
    block.slide.half_height = Some(0.02);
    block.slide.corner_radius *= 0.25;
    block.contact.second_clearance = 0.5e-3;
    let (mut own, _) = impacts(&accurately(block.machine()), 7e-3);
    own.retain(|impact| impact.start < 6e-3);
    // Four corners of two walls, each twice.
    let reference = contacts(include_str!("joints/d1-contacts.csv"));
    assert_eq!(own.len(), 8);
    for [start, speed, peak] in &reference[..4] {
        let same = own.iter().filter(|impact| (impact.start - start).abs() < 1e-9);
        let same: Vec<&Impact> = same.filter(|impact| (2.0 * impact.peak / peak - 1.0).abs() < 1e-6).collect();
        assert_eq!(same.len(), 2, "{start} {peak}");
        assert!(same.iter().all(|impact| (impact.approach_speed / speed - 1.0).abs() < 1e-6));
    }
}

/// A pin that spins under a thrust on the rim of its collar is braked by the torque mu F r, and carries a moment that a collar on its
/// axis would not.
#[test]
fn a_collar_brakes_a_spin_with_the_torque_of_its_friction() {
    let mut machine = thrown_pin(0.0, Pin { kept: true, face_radius: Some(0.015), ..pin(EndsOn::Bearing) });
    let [spin, thrust, friction, inertia] = [100.0, 50.0, 0.2, 5e-6];
    machine.joints[0].start = JointStart::Pose {
        position: Vec3::new(1e-4, 0.0, 0.0),
        rotation: Quat::identity(),
        velocity: Vec3::zeros(),
        angular_velocity: Vec3::new(spin, 0.0, 0.0),
    };
    let contact = &mut machine.loose_joints[0].contact;
    (contact.second_clearance, contact.friction, contact.restitution) = (1e-4, friction, 0.0);
    machine.gravity = Vec3::new(thrust / 0.1, 0.0, 0.0);
    let mut simulation = Simulation::new(&accurately(machine)).unwrap();
    let rate = |simulation: &mut Simulation, time: f64| {
        simulation.step_until(time).unwrap();
        while simulation.time() < time {
            simulation.step_until(time).unwrap();
        }
        let mut frame = Frame::default();
        simulation.sample_now(&mut frame);
        frame.bodies[0].angular_velocity.x
    };
    // Once the thrust has settled on the four points.
    let [early, late] = [1e-3, 2e-3].map(|time| rate(&mut simulation, time));
    let braking = (early - late) / 1e-3;
    let expected = friction * thrust * 0.015 / inertia;
    println!("{braking} {expected}");
    assert!((braking / expected - 1.0).abs() < 1e-3, "{braking} {expected}");
}

#[test]
fn each_play_has_its_own_ramp_and_a_state_keeps_both() {
    let mut simulation = Simulation::new(&accurately(spinning_pin(EndsOn::Pin, 0.15))).unwrap();
    simulation.advance_to(1e-3).unwrap();
    let mut next = simulation.changed_machine();
    next.loose_joints[0].contact.clearance = 0.5e-4;
    next.loose_joints[0].contact.second_clearance = 1e-4;
    assert_eq!(simulation.adopt(&next), Ok(Effect::Now));
    simulation.advance_to(5e-3).unwrap();
    let ramping = simulation.state().plays(0);
    assert!(ramping[0] > 0.5e-4, "the pin lies beyond the new wall: {ramping:?}");
    let mut copy = simulation.clone();
    simulation.advance_to(0.06).unwrap();
    copy.advance_to(0.06).unwrap();
    assert_eq!(simulation.state_hash(), copy.state_hash());
    assert_eq!(simulation.state().plays(0), [0.5e-4, 1e-4]);
    let ledger = *simulation.ledger().unwrap();
    assert!(ledger.residual().abs() < 1e-7, "{:e} J", ledger.residual());
    // A play that ends changes the equations.
    next.loose_joints[0].contact.second_clearance = 0.0;
    assert_eq!(simulation.adopt(&next), Ok(Effect::AtReset));
}

#[test]
fn every_method_steps_pins_and_slides() {
    let long = Pin { length: Some(0.02), ends: EndsOn::Bearing, kept: true, face_radius: None, travel: None };
    for (name, machine) in [("pin", crank_pin(0.1, long)), ("slide", flores().machine())] {
        let peak = |method: Method| {
            let mut machine = machine.clone();
            machine.solver.method = method;
            machine.solver.step = 2e-7;
            machine.solver.tolerance = 1e-7;
            let (impacts, simulation) = impacts(&machine, 1.2e-3);
            let ledger = *simulation.ledger().unwrap();
            println!("{name} {method}: {:?} {:e}", impacts[0].peak, ledger.residual());
            // Both ends strike at once, in either order.
            impacts[..2].iter().map(|impact| impact.peak).fold(0.0, f64::max)
        };
        let reference = peak(Method::DormandPrince5);
        for method in Method::ALL {
            let error = (peak(method) / reference - 1.0).abs();
            let allowed = if method == Method::DiscreteGradient { 0.02 } else { 1e-4 };
            assert!(error < allowed, "{name} {method}: {error}");
        }
    }
}

#[test]
fn without_play_they_are_the_ideal_joint() {
    let long = Pin { length: Some(0.02), ends: EndsOn::Pin, kept: true, face_radius: None, travel: None };
    for (name, mut machine, end) in [("pin", crank_pin(0.0, long), 2e-3), ("slide", flores().machine(), 2e-3)] {
        machine.loose_joints.last_mut().unwrap().contact.clearance = 0.0;
        let (impacts, mut simulation) = impacts(&machine, end);
        assert!(impacts.is_empty());
        let mut frame = Frame::default();
        simulation.sample_now(&mut frame);
        let open = frame.joints.last().unwrap().eccentricity;
        let across = if name == "slide" { Vec3::new(0.0, open.y, open.z) } else { open };
        assert!(across.norm() < 1e-9, "{name}: {open}");
        assert!(frame.joints.last().unwrap().normal_force.norm() > 1.0, "{name}");
    }
}

#[test]
fn one_play_without_the_other_leaves_the_other_rows() {
    // A pin with axial play alone stays on its axis; a block with play across y alone stays in its plane and does not roll.
    let mut axial = spinning_pin(EndsOn::Pin, 0.15);
    axial.loose_joints[0].contact.clearance = 0.0;
    axial.joints[0].start = JointStart::Pose {
        position: Vec3::zeros(),
        rotation: Quat::identity(),
        velocity: Vec3::new(0.05, 0.0, 0.0),
        angular_velocity: Vec3::new(20.0, 0.0, 0.0),
    };
    let mut block = released();
    block.slide.half_height = Some(0.02);
    for (machine, free) in [(axial, 0), (block.machine(), 1)] {
        for formulation in [Formulation::Tree, Formulation::Lagrange] {
            let (impacts, mut simulation) = impacts(&accurately(Machine { formulation, ..machine.clone() }), 0.025);
            assert!(impacts.len() > 1, "{free} {formulation:?}");
            let mut frame = Frame::default();
            simulation.sample_now(&mut frame);
            let open = frame.joints[0].eccentricity;
            for axis in (0..3).filter(|axis| *axis != free && !(free == 1 && *axis == 0)) {
                assert!(open[axis].abs() < 1e-8, "{free} {formulation:?}: {open}");
            }
            assert!(simulation.ledger().unwrap().residual().abs() < 1e-6);
        }
    }
}

#[test]
fn impossible_dimensions_are_refused() {
    let fault = |change: &dyn Fn(&mut LooseJoint)| {
        let mut machine = thrown_pin(0.0, pin(EndsOn::Pin));
        change(&mut machine.loose_joints[0]);
        match machine.check() {
            Err(MachineFault::Contact { joint, fault: ContactFault::Loose(fault) }) => {
                assert_eq!(joint, "J");
                Some(fault)
            }
            _ => None,
        }
    };
    let length = |length: f64| LooseKind::Pin(Pin { length: Some(length), ..pin(EndsOn::Pin) });
    assert_eq!(fault(&|_| ()), None);
    assert!(matches!(fault(&|joint| joint.kind = length(0.0)), Some(LooseFault::Length { .. })));
    assert!(matches!(
        fault(&|joint| joint.kind = length(9e-4)),
        Some(LooseFault::Play { part: "a tenth of the length", .. })
    ));
    assert!(matches!(
        fault(&|joint| joint.contact.clearance = 1.1e-3),
        Some(LooseFault::Play { part: "a tenth of the radius", .. })
    ));
    let far = |joint: &mut LooseJoint| {
        joint.kind = LooseKind::Pin(Pin { kept: true, ..pin(EndsOn::Pin) });
        joint.contact.second_clearance = 6.1e-3;
    };
    assert!(matches!(fault(&far), Some(LooseFault::Play { part: "a quarter of the length", .. })));
    assert_eq!(
        fault(&|joint| joint.contact.second_clearance = 1e-4),
        Some(LooseFault::SecondPlay { key: "play.axial" })
    );
    let centres = |joint: &mut LooseJoint| joint.contact.friction_velocity = FrictionVelocity::Centres;
    assert_eq!(fault(&centres), Some(LooseFault::FrictionVelocity));
    let block = Slide { half_length: 0.02, half_width: -0.01, half_height: None, corner_radius: 1e-3 };
    assert!(matches!(fault(&|joint| joint.kind = LooseKind::Slide(block)), Some(LooseFault::Length { .. })));
}
