//! Force elements and drives on single coordinates of joints with two degrees of freedom, and force elements on joints that close
//! loops, against closed-form solutions, in every method and both formulations.

use crate::common::matrix::for_every;
use crate::elements::frame_at;
use crate::joint_elements::{momenta, start_simulation};
use crate::two_degrees::angle_difference;
use jointplay_physics::simulate::{Frame, Simulation};

const MASS: f64 = 0.5;
/// Equal about every axis through the centroid, where the joint is, so that the angles of a universal joint are decoupled.
const INERTIA: f64 = 4e-3;

/// One coordinate of a joint between a body and the world.
#[derive(Clone, Copy, Debug)]
struct Case {
    kind: &'static str,
    coordinate: &'static str,
    /// Its index among the joint's coordinates.
    part: usize,
    closes_loop: bool,
}

const fn case(kind: &'static str, coordinate: &'static str, part: usize) -> Case {
    Case { kind, coordinate, part, closes_loop: false }
}

const TWO_DEGREE_CASES: [Case; 4] = [
    case("cylindrical", "position", 0),
    case("cylindrical", "angle", 1),
    case("universal", "angle", 0),
    case("universal", "child_angle", 1),
];

/// [`TWO_DEGREE_CASES`], and all kinds of joint that close a loop.
fn cases() -> impl Iterator<Item = Case> {
    let single = [case("prismatic", "position", 0), case("revolute", "angle", 0)];
    let closing = TWO_DEGREE_CASES.into_iter().chain(single).map(|case| Case { closes_loop: true, ..case });
    TWO_DEGREE_CASES.into_iter().chain(closing)
}

impl Case {
    fn slides(self) -> bool {
        self.coordinate == "position"
    }

    fn inertia(self) -> f64 {
        if self.slides() { MASS } else { INERTIA }
    }

    /// Units of position, velocity, force, stiffness and damping.
    fn units(self) -> [&'static str; 5] {
        match self.slides() {
            true => ["m", "m/s", "N", "N/m", "N s/m"],
            false => ["rad", "rad/s", "N m", "N m/rad", "N m s/rad"],
        }
    }

    fn rate_key(self) -> &'static str {
        match self.coordinate {
            "position" => "velocity",
            "angle" => "angular_velocity",
            _ => "child_angular_velocity",
        }
    }

    /// A body on the joint that starts at a coordinate and its rate; the other coordinate, if any, starts at 0 with a rate of 3.
    fn text(self, [q, rate]: [f64; 2], more: &str) -> String {
        let [length, speed, ..] = self.units();
        let second = match self.kind {
            "universal" => "child_axis = [1, 0, 0]\n",
            _ => "",
        };
        let joint = format!("name = \"j\"\nkind = \"{}\"\nchild = \"mass\"\naxis = [0, 0, 1]\n{second}", self.kind);
        let about = match self.coordinate {
            "child_angle" => "[1, 0, 0]",
            _ => "[0, 0, 1]",
        };
        let joints = match (self.closes_loop, self.slides()) {
            (false, _) => {
                let other = TWO_DEGREE_CASES.iter().find(|c| c.kind == self.kind && c.part != self.part);
                let other = other.expect("another");
                let [_, unit, ..] = other.units();
                format!(
                    "[[joint]]\n{joint}start = {{ {} = \"{q:e} {length}\", {} = \"{rate:e} {speed}\", {} = \"3 {unit}\" }}\n",
                    self.coordinate,
                    self.rate_key(),
                    other.rate_key()
                )
            }
            (true, true) => format!(
                "[[joint]]\nname = \"free\"\nkind = \"free\"\nchild = \"mass\"\n\
                 start = {{ position = \"0 0 {q:e} m\", velocity = \"0 0 {rate:e} m/s\" }}\n[[joint]]\n{joint}closes_loop = true\n"
            ),
            (true, false) => {
                let [x, z] = if about == "[1, 0, 0]" { [rate, 0.0] } else { [0.0, rate] };
                format!(
                    "[[joint]]\nname = \"free\"\nkind = \"free\"\nchild = \"mass\"\n\
                     start = {{ position = [0, 0, 0], rotation = {{ axis = {about}, angle = \"{q:e} rad\" }}, \
                     angular_velocity = \"{x:e} 0 {z:e} rad/s\" }}\n[[joint]]\n{joint}closes_loop = true\n"
                )
            }
        };
        format!(
            "[gravity]\nx = 0\ny = 0\nz = 0\n\
             [[body]]\nname = \"mass\"\nmass = \"{MASS} kg\"\ninertia = \"{INERTIA} {INERTIA} {INERTIA} kg m^2\"\n{joints}{more}"
        )
    }

    /// An element of `section` on the coordinate.
    fn element(self, section: &str, more: &str) -> String {
        let name = self.coordinate;
        let coordinate = match self.kind {
            "prismatic" | "revolute" => String::new(),
            _ => format!("coordinate = \"{name}\"\n"),
        };
        format!("[[{section}]]\nname = \"e\"\njoint = \"j\"\n{coordinate}{more}")
    }

    fn start_at(self, start: [f64; 2], more: &str, changes: &[(&str, &str)]) -> Simulation {
        start_simulation(&self.text(start, more), changes)
    }

    fn coordinate(self, frame: &Frame) -> [f64; 2] {
        frame.coordinates[self.part]
    }

    /// Force or torque of the element on the body along the axis.
    fn force(self, frame: &Frame) -> f64 {
        let report = &frame.elements[0];
        let rotation = frame.bodies[0].rotation;
        match self.coordinate {
            "position" => report.force.z,
            "angle" => report.torque.expect("a torque").z,
            _ => report.torque.expect("a torque").dot(&rotation.column(0)),
        }
    }
}

#[test]
fn a_spring_on_one_coordinate_has_its_natural_frequency_in_every_method_and_formulation() {
    for_every(cases(), |case, variant| {
        let (m, bound) = (case.inertia(), variant.bound());
        let k = 400.0 * m;
        let [.., unit, _] = case.units();
        let spring = case.element("joint_spring", &format!("stiffness = \"{k:e} {unit}\"\n"));
        let mut simulation = case.start_at([0.03, 0.0], &spring, &variant.close());
        let frame = frame_at(&mut simulation, 0.1);
        let label = format!("{case:?} {variant}");
        let [q, rate] = case.coordinate(&frame);
        let (sin, cos) = (20.0 * 0.1_f64).sin_cos();
        let error = (q - 0.03 * cos).abs();
        assert!(error < bound, "{label}: {error:e}");
        assert!((rate + 0.6 * sin).abs() < 20.0 * bound, "{label}: {rate}");
        let force = case.force(&frame) + k * q;
        assert!(force.abs() < 1e-9 * k, "{label}: {force:e}");
        // The other coordinate continues at its initial rate.
        if !case.closes_loop {
            let [q, rate] = frame.coordinates[1 - case.part];
            let (error, rate_error) = (angle_difference(q, 0.3), (rate - 3.0).abs());
            assert!(error < 20.0 * bound && rate_error < 20.0 * bound, "{label}: {error:e} {rate_error:e}");
        }
        let residual = simulation.ledger().unwrap().relative_residual();
        assert!(residual.abs() < 1e-4, "{label}: {residual:e}");
    });
}

#[test]
fn a_motor_on_one_coordinate_drives_only_it_and_its_work_counts_as_drive_work() {
    for case in cases() {
        let m = case.inertia();
        let [_, _, unit, ..] = case.units();
        let key = if case.slides() { "force" } else { "torque" };
        let motor = case.element("motor", &format!("{key} = \"{:e} {unit}\"\n", 5.0 * m));
        let changes = [("solver.tolerance", "1e-10")];
        let mut simulation = case.start_at([0.0, -0.4], &motor, &changes);
        let frame = frame_at(&mut simulation, 0.3);
        let label = format!("{case:?}");
        let [q, rate] = case.coordinate(&frame);
        let expected = -0.4 * 0.3 + 0.5 * 5.0 * 0.09;
        assert!((q - expected).abs() < 1e-8, "{label}: {q} {expected}");
        assert!((rate - 1.1).abs() < 1e-8, "{label}: {rate}");
        let ledger = simulation.ledger().unwrap();
        let work = 5.0 * m * expected;
        assert!((ledger.drive_work - work).abs() < 1e-7 * m, "{label}: {ledger:?}");
    }
}

#[test]
fn a_stop_reverses_one_coordinate() {
    for case in cases() {
        let m = case.inertia();
        let [length, _, force, ..] = case.units();
        let key = if case.slides() { "force" } else { "torque" };
        let stop =
            format!("upper = \"0.05 {length}\"\n{key} = \"{:e} {force}\"\ndepth = \"1e-3 {length}\"\n", 200.0 * m);
        let stop = case.element("stop", &stop);
        let changes = [("solver.tolerance", "1e-10")];
        let mut simulation = case.start_at([0.0, 0.5], &stop, &changes);
        let deepest = (10..=18).map(|n| {
            let frame = frame_at(&mut simulation, 0.01 * f64::from(n));
            (case.coordinate(&frame)[0], case.force(&frame))
        });
        let deepest = deepest.fold((0.0, 0.0), |a: (f64, f64), b| (a.0.max(b.0), a.1.min(b.1)));
        let label = format!("{case:?}");
        // Hertz: m v^2 / 2 = 0.4 K d^2.5 with K = 200 m / 0.001^1.5.
        let max_depth = (0.125 / (0.4 * 200.0) * 1e-3_f64.powf(1.5)).powf(0.4);
        assert!(deepest.0 - 0.05 < max_depth + 1e-9 && deepest.1 <= 0.0, "{label}: {deepest:?}");
        let [q, rate] = case.coordinate(&frame_at(&mut simulation, 0.25));
        assert!((rate + 0.5).abs() < 1e-6, "{label}: {rate}");
        assert!(q < 0.05, "{label}: {q}");
    }
}

const DRIVEN: &str = "law = \"harmonic\", mean = \"0.1 UNIT\", amplitude = \"0.2 UNIT\", frequency = \"1.5 Hz\"";

/// Position, velocity and acceleration of the law [`DRIVEN`] at 0.13 s.
fn driven() -> [f64; 3] {
    let w = 3.0 * std::f64::consts::PI;
    let (sin, cos) = (w * 0.13).sin_cos();
    [0.1 + 0.2 * sin, 0.2 * w * cos, -0.2 * w * w * sin]
}

#[test]
fn a_drive_of_one_coordinate_leaves_the_other_free_and_exerts_the_inertia_force() {
    for_every(TWO_DEGREE_CASES, |case, variant| {
        let ([length, ..], bound) = (case.units(), variant.bound());
        let text = case.text([0.0, 0.0], "");
        let start = text.find("start = ").expect("start values");
        let (before, after) = text.split_at(start);
        let other = TWO_DEGREE_CASES.iter().find(|c| c.kind == case.kind && c.part != case.part);
        let [_, unit, ..] = other.expect("another").units();
        let rate = other.expect("another").rate_key();
        let law = DRIVEN.replace("UNIT", length);
        let drive = format!("start = {{ {rate} = \"3 {unit}\" }}\ndrive = {{ {} = {{ {law} }} }}\n", case.coordinate);
        let text = before.to_owned() + &drive + after.split_once('\n').expect("a line").1;
        let mut simulation = start_simulation(&text, &variant.close());
        let frame = frame_at(&mut simulation, 0.13);
        let label = format!("{case:?} {variant}");
        let [q, rate, acceleration] = driven();
        let [own, speed] = case.coordinate(&frame);
        assert!((own - q).abs() < bound && (speed - rate).abs() < 20.0 * bound, "{label}: {own} {speed}");
        let [other, speed] = frame.coordinates[1 - case.part];
        assert!(
            angle_difference(other, 0.39) < 20.0 * bound && (speed - 3.0).abs() < 20.0 * bound,
            "{label}: {other} {speed}"
        );
        let inertia_force = case.inertia() * acceleration;
        let error = (frame.actuators[0] - inertia_force).abs() / inertia_force.abs();
        assert!(frame.actuators.len() == 1 && error < 1e4 * bound, "{label}: {error:e}");
        let ledger = simulation.ledger().unwrap();
        let residual = ledger.relative_residual();
        assert!(residual.abs() < 1e-4, "{label}: {residual:e}");
        let w = 3.0 * std::f64::consts::PI;
        let work = 0.5 * case.inertia() * (rate * rate - (0.2 * w).powi(2));
        let error = (ledger.drive_work / work - 1.0).abs();
        assert!(error < 1e3 * bound.max(1e-7), "{label}: {error:e}");
    });
}

#[test]
fn a_joint_with_both_coordinates_driven_carries_an_attached_pendulum() {
    for [first, second] in [[TWO_DEGREE_CASES[0], TWO_DEGREE_CASES[1]], [TWO_DEGREE_CASES[2], TWO_DEGREE_CASES[3]]] {
        let text = first.text([0.0, 0.0], "");
        let start = text.find("start = ").expect("start values");
        let drive = |case: Case, rate: &str| {
            let [_, speed, ..] = case.units();
            let law = format!("law = \"constant\", velocity = \"{rate} {speed}\"");
            format!("{} = {{ {law} }}", case.coordinate)
        };
        // A pendulum on a hinge along the body's x axis.
        let more = "[[body]]\nname = \"bob\"\nmass = \"0.2 kg\"\ninertia = \"1e-4 2e-4 3e-4 kg m^2\"\n\
                    [[joint]]\nname = \"h\"\nkind = \"revolute\"\nparent = \"mass\"\nchild = \"bob\"\naxis = [1, 0, 0]\n\
                    parent_point = \"40 0 0 mm\"\nchild_point = \"0 20 60 mm\"\nstart = { velocity = \"1 rad/s\" }\n";
        let driven = format!("drive = {{ {}, {} }}\n", drive(first, "0.7"), drive(second, "-2"));
        let text = text[..start].to_owned() + &driven + more;
        crate::formulations::check(first.kind, &text);
        let mut simulation = start_simulation(&text, &[("solver.tolerance", "1e-11")]);
        let summary = simulation.mechanism().summary();
        assert_eq!((summary.drives, summary.driven_bodies, summary.degrees_of_freedom), (2, 1, 1));
        let frame = frame_at(&mut simulation, 0.2);
        let [own, other] = [0, 1].map(|part| frame.coordinates[part]);
        assert!((own[0] - 0.14).abs() < 1e-9 && (own[1] - 0.7).abs() < 1e-9, "{own:?}");
        assert!((other[0] + 0.4).abs() < 1e-9 && (other[1] + 2.0).abs() < 1e-9, "{other:?}");
        let residual = simulation.ledger().unwrap().relative_residual();
        assert!(residual.abs() < 1e-7, "{residual:e}");
        assert_eq!(frame.actuators.len(), 2);
        let channels = jointplay_physics::simulate::channels_of(simulation.machine(), &frame);
        let columns = channels.iter().filter(|channel| channel.by_default).map(|channel| &channel.column);
        let own: &[&str] = match first.kind {
            "cylindrical" => &["j_actuator_N", "j_angle_actuator_Nm"],
            _ => &["j_angle_actuator_Nm", "j_child_angle_actuator_Nm"],
        };
        let actuator_columns: Vec<&String> = columns.filter(|column| column.contains("actuator")).collect();
        assert_eq!(actuator_columns, own);
    }
}

/// A free body, a ring on its axle and a rod on a cross of the ring tumble; springs and dampers act on all four coordinates.
const TUMBLING: &str = "[gravity]\nx = 0\ny = 0\nz = 0\n\
    [[body]]\nname = \"base\"\nmass = \"0.5 kg\"\ninertia = \"2e-4 3e-4 4e-4 kg m^2\"\n\
    [[body]]\nname = \"ring\"\nmass = \"0.3 kg\"\ninertia = \"2e-4 1e-4 2.5e-4 kg m^2\"\n\
    [[body]]\nname = \"rod\"\nmass = \"0.2 kg\"\ninertia = \"1e-4 1.5e-4 2e-4 kg m^2\"\n\
    [[joint]]\nname = \"free\"\nkind = \"free\"\nchild = \"base\"\n\
    start = { position = [0, 0, 0], velocity = \"0.1 0.2 0.3 m/s\", angular_velocity = \"4 -3 5 rad/s\" }\n\
    [[joint]]\nname = \"c\"\nkind = \"cylindrical\"\nparent = \"base\"\nchild = \"ring\"\naxis = [1, 2, 2]\n\
    parent_point = \"50 10 20 mm\"\nchild_point = \"-60 20 0 mm\"\nrotation = { axis = [0, 1, 1], angle = \"35 deg\" }\n\
    start = { position = \"2 mm\", velocity = \"0.2 m/s\", angle = \"20 deg\", angular_velocity = \"2 rad/s\" }\n\
    [[joint]]\nname = \"u\"\nkind = \"universal\"\nparent = \"ring\"\nchild = \"rod\"\naxis = [2, -1, 0]\nchild_axis = [0, 0, 1]\n\
    parent_point = \"30 0 10 mm\"\nchild_point = \"0 20 -10 mm\"\n\
    start = { angle = \"10 deg\", angular_velocity = \"3 rad/s\", child_angular_velocity = \"-4 rad/s\" }\n\
    [[joint_spring]]\nname = \"a\"\njoint = \"c\"\ncoordinate = \"position\"\nstiffness = \"500 N/m\"\ndamping = \"0.5 N s/m\"\n\
    [[joint_spring]]\nname = \"b\"\njoint = \"c\"\ncoordinate = \"angle\"\nstiffness = \"0.5 N m/rad\"\npreload = \"0.1 N m\"\n\
    [[joint_spring]]\nname = \"d\"\njoint = \"u\"\ncoordinate = \"angle\"\nstiffness = \"0.3 N m/rad\"\ndamping = \"1e-3 N m s/rad\"\n\
    [[stop]]\nname = \"e\"\njoint = \"u\"\ncoordinate = \"child_angle\"\nlower = \"-20 deg\"\nupper = \"20 deg\"\n\
    torque = \"1 N m\"\ndepth = \"2 deg\"\n";

#[test]
fn elements_on_one_of_two_coordinates_conserve_momentum_and_balance_their_energy() {
    let mut ends = Vec::new();
    for (formulation, method) in
        [("tree", "dopri5"), ("lagrange", "dopri5"), ("tree", "radau5"), ("lagrange", "radau5")]
    {
        let changes = [("solver.method", method), ("solver.tolerance", "1e-10"), ("formulation", formulation)];
        let mut simulation = start_simulation(TUMBLING, &changes);
        let machine = simulation.machine().clone();
        let before = frame_at(&mut simulation, 0.0);
        let frame = frame_at(&mut simulation, 0.3);
        let label = format!("{formulation} {method}");
        let (then, now) = (momenta(&before, &machine), momenta(&frame, &machine));
        for (then, now) in then.iter().zip(&now) {
            let error = (now - then).norm() / then.norm();
            assert!(error < 2e-8, "{label}: {error:e}");
        }
        let residual = simulation.ledger().unwrap().relative_residual();
        assert!(residual.abs() < 1e-6, "{label}: {residual:e}");
        ends.push(frame);
    }
    let (first, others) = ends.split_first().expect("four runs");
    for other in others {
        for (a, b) in first.coordinates.iter().zip(&other.coordinates) {
            assert!(angle_difference(a[0], b[0]) < 1e-5 && (a[1] - b[1]).abs() < 1e-3, "{a:?} {b:?}");
        }
    }
}

/// A spring on the closing hinge of a driven four-bar loads its drive.
#[test]
fn a_spring_on_a_closing_hinge_loads_the_drive_of_its_loop() {
    // In a parallelogram the closing hinge between coupler and rocker turns opposite to the crank.
    let body = |name: &str, inertia: f64| {
        format!("[[body]]\nname = \"{name}\"\nmass = \"0.1 kg\"\ninertia = \"1e-5 {inertia:e} {inertia:e} kg m^2\"\n")
    };
    let hinge = |name: &str, parent: &str, at: &str, more: &str| {
        format!(
            "[[joint]]\nname = \"{name}\"\nkind = \"revolute\"\nparent = \"{parent}\"\nchild = \"{name}\"\nparent_point = \"{at} 0 0 m\"\n\
             axis = [0, 1, 0]\n{more}\n"
        )
    };
    let text = "[gravity]\nx = 0\ny = 0\nz = 0\n".to_owned()
        + &body("crank", 1e-4)
        + &body("coupler", 1e-4)
        + &body("rocker", 1e-4)
        + &hinge(
            "crank",
            "world",
            "0",
            "drive = { law = \"constant\", position = \"1 rad\", velocity = \"0.2 rad/s\" }",
        )
        + &hinge("coupler", "crank", "0.1", "start = { position = \"-1 rad\", velocity = \"-0.2 rad/s\" }")
        + &hinge("rocker", "world", "0.3", "start = { position = \"1 rad\", velocity = \"0.2 rad/s\" }")
        + "[[joint]]\nname = \"B\"\nkind = \"revolute\"\nparent = \"coupler\"\nchild = \"rocker\"\ncloses_loop = true\n\
           parent_point = \"0.3 0 0 m\"\nchild_point = \"0.1 0 0 m\"\naxis = [0, 1, 0]\n";
    let spring = "[[joint_spring]]\nname = \"s\"\njoint = \"B\"\nposition = \"0.4 rad\"\nstiffness = \"2 N m/rad\"\n";
    let torque = |text: &str| {
        let mut simulation = start_simulation(text, &[]);
        let frame = frame_at(&mut simulation, 0.1);
        (frame.actuators[0], frame.coordinates.last().copied().expect("one")[0])
    };
    let (loaded, angle) = torque(&(text.clone() + spring));
    // Rocker against coupler: the coupler does not turn.
    assert!((angle - 1.02).abs() < 1e-8, "{angle}");
    let spring_torque = 2.0 * (1.02 - 0.4);
    let difference = loaded - torque(&text).0;
    assert!((difference - spring_torque).abs() < 1e-6, "{difference} {spring_torque}");
}
