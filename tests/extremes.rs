//! Every extreme that a scene may ask for, with every method, ends in an outcome with a name.

mod common;

use std::fmt::Write;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use common::{METHODS, frame_now};
use jointplay::scene::{BallJoint, JointStart, Scene, Vec3};
use jointplay::simulate::{Frame, JointReport, Simulation};

/// Simulated time that a run is asked for, s: the first impacts of every scene lie within; and until contacts settle.
const DURATION: f64 = 0.03;
const SETTLED: f64 = 0.5;
/// Evaluations of the equations after which a run has done enough, and that no single step may take.
const MOST_EVALUATIONS: u64 = 16_000;
const MOST_IN_A_STEP: u64 = 2000;
/// Without a result for so long a call hangs; work is counted in evaluations, so that a busy machine fails nothing.
const DEAD: Duration = Duration::from_secs(60);
/// Penetration over ball radius beyond which a ball has left its socket.
const OUT_OF_SOCKET: f64 = 0.1;
/// Energy that a passive scene may gain, of that exchanged: a method of order 1 with ten steps in an impact, and the others.
const CREATED: [f64; 2] = [0.06, 0.02];
const FORMS: [&str; 2] = ["tree", "lagrange"];

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
enum Outcome {
    /// To the end, with every invariant.
    Ran,
    /// With every invariant until the cap on work.
    Capped,
    /// With a warning beforehand that its step is too long, and rightly so: what was not held.
    Doubtful(String),
    /// By the divergence guard, which says why; the last good state is kept.
    Stopped(String),
    /// Before it began, with a reason.
    Refused(String),
    /// What must not be.
    Wrong(String),
}

impl Outcome {
    fn word(&self) -> &'static str {
        match self {
            Self::Ran => "runs",
            Self::Capped => "slow",
            Self::Doubtful(_) => "doubtful",
            Self::Stopped(_) => "stopped",
            Self::Refused(_) => "refused",
            Self::Wrong(_) => "WRONG",
        }
    }

    fn reason(&self) -> &str {
        match self {
            Self::Stopped(why) | Self::Doubtful(why) | Self::Refused(why) | Self::Wrong(why) => why,
            _ => "",
        }
    }
}

/// One extreme: a scene and what becomes of it with each formulation and method.
struct Row {
    what: String,
    scene: &'static str,
    changes: Vec<(String, String)>,
    edit: fn(&mut Scene),
    /// Simulated time, s.
    duration: f64,
    /// Nothing drives the scene, and friction takes energy only.
    passive: bool,
}

impl Row {
    fn new(what: &str, scene: &'static str, changes: &[(&str, &str)]) -> Self {
        let own = |(key, value): &(&str, &str)| ((*key).to_owned(), (*value).to_owned());
        Self {
            what: what.to_owned(),
            scene,
            changes: changes.iter().map(own).collect(),
            edit: |_| {},
            duration: DURATION,
            passive: matches!(scene, "pendulum" | "chain" | "slider-crank"),
        }
    }

    fn edited(mut self, edit: fn(&mut Scene)) -> Self {
        self.edit = edit;
        self
    }

    fn load(&self, form: &str, method: &str) -> Result<Scene, String> {
        let mut changes = self.changes.clone();
        for (key, value) in [("formulation", form), ("solver.method", method)] {
            changes.push((key.to_owned(), value.to_owned()));
        }
        let mut scene = Scene::load(self.scene, &changes).map_err(|error| error.to_string())?;
        (self.edit)(&mut scene);
        Ok(scene)
    }
}

fn scale_masses(scene: &mut Scene, factor: f64) {
    for body in &mut scene.bodies {
        body.mass *= factor;
        body.inertia *= factor;
    }
}

/// The rods' inertia about their own axis, nearly zero.
fn thin_rods(scene: &mut Scene) {
    for body in &mut scene.bodies {
        let i = &mut body.inertia;
        let least = (0..3).min_by(|&a, &b| i[(a, a)].total_cmp(&i[(b, b)]));
        if body.name.starts_with("rod") || body.name.starts_with("link") {
            let axis = least.unwrap();
            i[(axis, axis)] = 1e-14;
        }
    }
}

/// Where the pendulum's ball starts, from the centre of its socket.
fn start_at(scene: &mut Scene, offset: Vec3) {
    let JointStart::Pose { position, .. } = &mut scene.joints[0].start else {
        panic!("the pendulum is free")
    };
    *position += offset;
}

/// Slider planes of which the first is reached and the second, 1e-6 m further, is not.
fn reach_limit() -> (f64, f64) {
    let reached = |plane: f64| {
        let changes = [("spcmm.slider_plane".to_owned(), format!("{plane} m"))];
        Simulation::new(&Scene::load("spcmm", &changes).unwrap()).is_ok()
    };
    // x_s = a1 + 28 mm; the square roots end between these.
    let (mut good, mut bad) = (0.032, 0.0);
    assert!(reached(good) && !reached(bad));
    while good - bad > 1e-6 {
        let middle = 0.5 * (good + bad);
        if reached(middle) {
            good = middle;
        } else {
            bad = middle;
        }
    }
    (good, bad)
}

fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    let both = ["spcmm", "pendulum"];
    let mut each = |what: &str, changes: &[(&str, &str)]| {
        for scene in both {
            rows.push(Row::new(what, scene, changes));
        }
    };
    for clearance in ["0.1 um", "1 um", "0.01 mm", "3 mm", "9.9 mm"] {
        let changes = [("contact.clearance", clearance)];
        each(&format!("clearance {clearance}"), &changes);
    }
    for friction in ["0", "1", "10"] {
        let changes = [("contact.friction", friction)];
        each(&format!("friction {friction}"), &changes);
    }
    for law in [
        "lankarani-nikravesh",
        "hertz",
        "hunt-crossley",
        "flores",
        "gonthier",
    ] {
        for restitution in ["0", "0.001", "1"] {
            let changes = [
                ("contact.normal_law", law),
                ("contact.restitution", restitution),
            ];
            each(&format!("restitution {restitution}, {law}"), &changes);
        }
    }
    for modulus in ["1 MPa", "10 MPa", "1000 GPa"] {
        let changes = [("contact.youngs_modulus", modulus)];
        each(&format!("Young's modulus {modulus}"), &changes);
    }
    for (radius, clearance) in [("0.1 mm", "0.05 mm"), ("1 m", "0.3 mm"), ("1 m", "0.9 m")] {
        let changes = [
            ("contact.clearance", clearance),
            ("contact.ball_radius", radius),
        ];
        let reversed = [changes[1], changes[0]];
        let changes = if clearance == "0.9 m" {
            reversed
        } else {
            changes
        };
        each(
            &format!("ball radius {radius}, clearance {clearance}"),
            &changes,
        );
    }
    for step in ["0.1 us", "1 us", "100 us", "1 ms", "10 ms"] {
        each(&format!("step {step}"), &[("solver.step", step)]);
    }
    for tolerance in ["1e-2", "1e-4", "1e-8", "1e-10", "1e-13"] {
        each(
            &format!("tolerance {tolerance}"),
            &[("solver.tolerance", tolerance)],
        );
    }
    each(
        "slip speeds 0 and 1e-6 mm/s",
        &[
            ("contact.slip_speed_low", "0 m/s"),
            ("contact.slip_speed_high", "1e-6 mm/s"),
        ],
    );
    each(
        "impact speed floor 1e-6 mm/s",
        &[("contact.impact_speed_floor", "1e-6 mm/s")],
    );
    each(
        "impact speed floor 10 m/s",
        &[("contact.impact_speed_floor", "10 m/s")],
    );
    for (what, x, z) in [
        ("gravity 0", "0 m/s^2", "0 m/s^2"),
        ("gravity reversed", "-9.81 m/s^2", "9.81 m/s^2"),
        ("gravity 100 g", "981 m/s^2", "-981 m/s^2"),
    ] {
        rows.push(Row::new(what, "spcmm", &[("gravity.x", x)]));
        rows.push(Row::new(what, "pendulum", &[("gravity.z", z)]));
    }
    for scene in ["spcmm", "pendulum", "chain"] {
        let row = |what: &str| Row::new(what, scene, &[]);
        rows.push(row("masses 1e-6 times").edited(|s| scale_masses(s, 1e-6)));
        rows.push(row("masses 1e3 times").edited(|s| scale_masses(s, 1e3)));
        rows.push(row("rods without inertia about their axis").edited(thin_rods));
    }
    for frequency in ["0 Hz", "5 Hz", "50 Hz"] {
        let changes = [("spcmm.frequency", frequency)];
        rows.push(Row::new(
            &format!("drive frequency {frequency}"),
            "spcmm",
            &changes,
        ));
        let ideal = [changes[0], ("contact.clearance", "0")];
        rows.push(Row::new(
            &format!("drive frequency {frequency}, ideal"),
            "spcmm",
            &ideal,
        ));
    }
    for tolerance in ["1e-2", "1e-3", "1e-4"] {
        for scene in both {
            let what = format!("tolerance {tolerance}, until settled");
            let mut row = Row::new(&what, scene, &[("solver.tolerance", tolerance)]);
            row.duration = SETTLED;
            rows.push(row);
        }
    }
    let (reached, not_reached) = reach_limit();
    for (what, plane) in [("within", reached), ("beyond", not_reached)] {
        let plane = format!("{plane} m");
        for (kind, clearance) in [("clearance 0.3 mm", "0.3 mm"), ("ideal", "0")] {
            let changes = [
                ("spcmm.slider_plane", &*plane),
                ("contact.clearance", clearance),
            ];
            rows.push(Row::new(
                &format!("1e-6 m {what} the reach, {kind}"),
                "spcmm",
                &changes,
            ));
        }
    }
    for plane in ["132 mm", "162 mm", "175 mm", "189 mm", "222 mm"] {
        for (kind, clearance) in [("clearance 0.3 mm", "0.3 mm"), ("ideal", "0")] {
            // Fast enough to cross the range in the time there is.
            let changes = [
                ("spcmm.slider_plane", plane),
                ("contact.clearance", clearance),
                ("spcmm.frequency", "5 Hz"),
            ];
            rows.push(Row::new(
                &format!("slider plane {plane}, {kind}"),
                "spcmm",
                &changes,
            ));
        }
    }
    for (what, changes) in [
        ("one joint ideal", &[("joint.S1.clearance", "0")][..]),
        (
            "two joints ideal",
            &[("joint.S1.clearance", "0"), ("joint.S2.clearance", "0")],
        ),
        ("all joints ideal", &[("contact.clearance", "0")]),
        (
            "clearances 0, 0.1 um and 9 mm",
            &[
                ("joint.S1.clearance", "0"),
                ("joint.S2.clearance", "0.1 um"),
                ("joint.S3.clearance", "9 mm"),
            ],
        ),
    ] {
        rows.push(Row::new(what, "spcmm", changes));
    }
    rows.push(Row::new(
        "free, one joint of each kind",
        "slider-crank",
        &[],
    ));
    rows.push(Row::new(
        "free, both joints ideal",
        "slider-crank",
        &[("contact.clearance", "0")],
    ));
    rows.push(Row::new(
        "driven, one joint of each kind",
        "slider-crank-driven",
        &[],
    ));
    let pendulum = |what: &str| Row::new(what, "pendulum", &[]);
    let calm = |what: &str| Row::new(what, "pendulum", &[("gravity.z", "0 m/s^2")]);
    rows.push(pendulum("starts on the wall").edited(|s| start_at(s, Vec3::z() * -0.3e-3)));
    rows.push(
        pendulum("starts 1 um inside the wall").edited(|s| start_at(s, Vec3::z() * -0.301e-3)),
    );
    rows.push(
        pendulum("starts 0.09 mm inside the wall").edited(|s| start_at(s, Vec3::z() * -0.39e-3)),
    );
    rows.push(pendulum("starts 1 mm inside the wall").edited(|s| start_at(s, Vec3::z() * -1.3e-3)));
    rows.push(calm("at rest on the wall, no gravity").edited(|s| start_at(s, Vec3::x() * 0.3e-3)));
    rows.push(calm("at rest in the middle, no gravity"));
    rows
}

fn finite(frame: &Frame) -> bool {
    let mut all = vec![frame.time, frame.kinetic, frame.potential, frame.elastic];
    let mut push = |v: &Vec3| all.extend_from_slice(v.as_slice());
    for b in &frame.bodies {
        for v in [
            &b.position,
            &b.velocity,
            &b.angular_velocity,
            &b.acceleration,
            &b.angular_acceleration,
        ] {
            push(v);
        }
        (0..3).for_each(|i| push(&b.rotation.column(i).into_owned()));
    }
    for j in &frame.joints {
        for v in [
            &j.socket_centre,
            &j.ball_centre,
            &j.eccentricity,
            &j.normal_force,
            &j.friction_force,
            &j.contact_point,
        ] {
            push(v);
        }
        push(&Vec3::new(j.penetration, j.penetration_rate, j.slip_speed));
    }
    let p = &frame.pose;
    for v in [
        &p.position,
        &p.angles,
        &p.velocity,
        &p.angle_rates,
        &p.acceleration,
        &p.angle_accelerations,
    ] {
        push(v);
    }
    frame.probe_error.iter().for_each(&mut push);
    all.extend_from_slice(&frame.actuators);
    all.iter().all(|x| x.is_finite())
}

/// What no frame may show; `None` where all is well.
fn fault(frame: &Frame, scene: &Scene, form: &str) -> Option<String> {
    if !finite(frame) {
        return Some(format!("not finite at t = {:e} s", frame.time));
    }
    for b in &frame.bodies {
        let skew = (b.rotation.tr_mul(&b.rotation) - jointplay::scene::Mat3::identity()).amax();
        if skew > 1e-9 {
            return Some(format!(
                "orientation off by {skew:e} at t = {:e} s",
                frame.time
            ));
        }
    }
    let pairs = frame.joints.iter().zip(&scene.ball_joints);
    pairs
        .filter_map(|(report, joint)| joint_fault(report, joint, form))
        .next()
        .map(|what| format!("{what} at t = {:e} s", frame.time))
}

fn joint_fault(report: &JointReport, joint: &BallJoint, form: &str) -> Option<String> {
    let radius = joint.contact.ball_radius;
    if joint.contact.clearance == 0.0 {
        // The other form only stabilises its constraints.
        let limit = if form == "tree" { 1e-9 } else { 1e-3 };
        let open = report.eccentricity.norm();
        return (open > limit).then(|| format!("{} open by {open:e} m", joint.name));
    }
    if report.penetration > OUT_OF_SOCKET * radius {
        return Some(format!(
            "{} {:.3} radii inside the wall",
            joint.name,
            report.penetration / radius
        ));
    }
    let unheld = report.penetration > 1e-9 && report.penetration_rate > 0.0;
    (unheld && report.normal_force.norm() == 0.0)
        .then(|| format!("{} leaves its socket without a force", joint.name))
}

/// Runs one cell of the table.
fn run(row: &Row, form: &str, method: &str) -> Outcome {
    let scene = match row.load(form, method) {
        Ok(scene) => scene,
        Err(reason) => return Outcome::Refused(reason),
    };
    let mut simulation = match Simulation::new(&scene) {
        Ok(simulation) => simulation,
        Err(error) => return Outcome::Refused(error.to_string()),
    };
    let mut frame = frame_now(&mut simulation);
    if let Some(what) = fault(&frame, &scene, form) {
        return Outcome::Wrong(format!("{what}, at the start"));
    }
    let start = frame.kinetic + frame.potential;
    let (mut created, mut exchanged) = (0.0_f64, frame.kinetic + frame.elastic);
    let most = (row.duration / DURATION).sqrt() as u64
        * if form == "tree" {
            MOST_EVALUATIONS
        } else {
            MOST_EVALUATIONS / 2
        };
    let mut steps = 0_u64;
    loop {
        let before = simulation.statistics().evaluations;
        let result = simulation.step_until(row.duration);
        if let Err(stopped) = result {
            let hash = simulation.state_hash();
            frame = frame_now(&mut simulation);
            if let Some(what) = fault(&frame, &scene, form) {
                return Outcome::Wrong(format!("stopped ({}) too late: {what}", stopped.what));
            }
            if stopped.time != simulation.time() || simulation.state_hash() != hash {
                return Outcome::Wrong("stopped, but not at the last good state".to_owned());
            }
            return Outcome::Stopped(stopped.to_string());
        }
        let evaluations = simulation.statistics().evaluations;
        if evaluations - before > MOST_IN_A_STEP {
            return Outcome::Wrong(format!("a step took {} evaluations", evaluations - before));
        }
        steps += 1;
        let done = simulation.time() >= row.duration;
        let enough = evaluations >= most || steps >= most;
        if steps < 200 || steps.is_multiple_of(16) || done || enough {
            let middle = 0.5 * (simulation.step_start() + simulation.time());
            simulation.sample(middle, &mut frame);
            if !finite(&frame) {
                return Outcome::Wrong(format!("not finite inside a step, t = {middle:e} s"));
            }
            frame = frame_now(&mut simulation);
            if let Some(what) = fault(&frame, &scene, form) {
                return Outcome::Wrong(what);
            }
            created = created.max(frame.kinetic + frame.potential - start);
            exchanged = exchanged.max(frame.kinetic + frame.elastic);
        }
        if done || enough {
            let most_created = CREATED[usize::from(method != METHODS[0])];
            if row.passive && created > most_created * exchanged.max(1e-12) {
                let what = format!("{:.3} of the energy created", created / exchanged);
                let warned = scene.warnings().iter().any(|w| w.starts_with("solver."));
                return if warned {
                    Outcome::Doubtful(what)
                } else {
                    Outcome::Wrong(what)
                };
            }
            return if done { Outcome::Ran } else { Outcome::Capped };
        }
    }
}

/// Outcomes of every row, formulation by formulation, method by method.
fn table(rows: Vec<Row>) -> Vec<(Row, Vec<Outcome>)> {
    let rows = Arc::new(rows);
    let per_row = FORMS.len() * METHODS.len();
    let next = Arc::new(Mutex::new(0));
    let (send, receive) = channel();
    for _ in 0..2 {
        let (rows, next, send) = (rows.clone(), next.clone(), send.clone());
        std::thread::spawn(move || {
            loop {
                let cell = {
                    let mut next = next.lock().unwrap();
                    *next += 1;
                    *next - 1
                };
                let Some(row) = rows.get(cell / per_row) else {
                    return;
                };
                let (form, method) = (cell % per_row / METHODS.len(), cell % METHODS.len());
                let run = || run(row, FORMS[form], METHODS[method]);
                let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(run))
                    .unwrap_or_else(|_| Outcome::Wrong("panic".to_owned()));
                if send.send((cell, outcome)).is_err() {
                    return;
                }
            }
        });
    }
    drop(send);
    let mut outcomes = vec![None; rows.len() * per_row];
    loop {
        match receive.recv_timeout(DEAD) {
            Ok((cell, outcome)) => outcomes[cell] = Some(outcome),
            Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => {
                let open = outcomes.iter().position(Option::is_none).unwrap();
                let row = &rows[open / per_row];
                panic!(
                    "hangs: {}, {}, cell {}",
                    row.what,
                    row.scene,
                    open % per_row
                );
            }
        }
    }
    let mut outcomes = outcomes.into_iter().map(Option::unwrap);
    let Ok(rows) = Arc::try_unwrap(rows) else {
        panic!("a thread still holds the rows")
    };
    let with = |row| (row, outcomes.by_ref().take(per_row).collect());
    rows.into_iter().map(with).collect()
}

const HEAD: &str = "# Stable at the extremes

What becomes of a scene at the ends of what may be asked for, with every method and both formulations: the first impacts of
each row, at the default step and tolerance where the row does not say otherwise. `tests/extremes.rs` runs the table, checks
it, and writes this page with `cargo test --test extremes -- --ignored`.

- **runs**: to the end. Every number is finite, orientations are rotations, ideal joints are closed to 1e-9 m (`lagrange`, which
  only stabilises them: 1 mm), no ball is deeper in its wall than a tenth of its radius, a ball in the wall that moves deeper
  meets a force, and where nothing drives the scene its energy does not grow.
- **slow**: the same, as far as the cap on work lets it come.
- **doubtful**: the energy grew, and the program warns before the run that the step or tolerance does not suit the scene.
- **stopped**: the divergence guard ended it, says why, and keeps the last good state.
- **refused**: it does not start, and says why.
";

fn page(table: &[(Row, Vec<Outcome>)]) -> String {
    let mut page = String::from(HEAD);
    for (f, form) in FORMS.iter().enumerate() {
        let methods = METHODS.join(" | ");
        let line = "---|".repeat(METHODS.len());
        let _ = write!(
            page,
            "\n## Formulation `{form}`\n\n| Scene | Extreme | {methods} |\n|---|---|{line}\n"
        );
        for (row, outcomes) in table {
            let of_form = &outcomes[f * METHODS.len()..][..METHODS.len()];
            let words: Vec<&str> = of_form.iter().map(Outcome::word).collect();
            let _ = writeln!(
                page,
                "| {} | {} | {} |",
                row.scene,
                row.what,
                words.join(" | ")
            );
        }
    }
    page
}

fn page_path() -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/extremes.md")
}

#[test]
#[ignore = "writes docs/extremes.md"]
fn write_the_page() {
    std::fs::write(page_path(), page(&table(rows()))).unwrap();
}

#[test]
fn every_extreme_ends_in_a_named_outcome() {
    let table = table(rows());
    let mut wrong = 0;
    for (row, outcomes) in &table {
        for (cell, outcome) in outcomes.iter().enumerate() {
            let (form, method) = (FORMS[cell / METHODS.len()], METHODS[cell % METHODS.len()]);
            if !outcome.reason().is_empty() {
                let (word, why) = (outcome.word(), outcome.reason());
                println!(
                    "{word}: {}, {}, {form}, {method}: {why}",
                    row.scene, row.what
                );
            }
            wrong += u32::from(matches!(outcome, Outcome::Wrong(_)));
        }
    }
    assert_eq!(wrong, 0, "outcomes that must not be");
    assert!(
        std::fs::read_to_string(page_path()).is_ok_and(|kept| kept == page(&table)),
        "cargo test --test extremes -- --ignored"
    );
}
