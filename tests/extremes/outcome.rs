//! One cell of the table: a run, and how it ends.

use jointplay::scene::{BallJoint, Scene, Vec3};
use jointplay::simulate::{Frame, JointReport, Pacer, Simulation};

use super::common::frame_now;
use super::rows::Row;

/// What is asked for: simulated seconds a second, in frames of so many seconds, of a machine that does so many evaluations
/// of the equations a second. Work is counted, not timed, so that a busy machine fails nothing.
const ASKED: f64 = 0.1;
const FRAME: f64 = 1.0 / 60.0;
const EVALUATIONS_PER_SECOND: f64 = 50_000.0;
/// Frames, of those that the run should take, after which a slow run has done enough.
const PATIENCE: f64 = 1.5;
/// Evaluations that no single step may take.
const MOST_IN_A_STEP: u64 = 2000;
/// Penetration over ball radius beyond which a ball has left its socket.
const OUT_OF_SOCKET: f64 = 0.1;
/// Energy that a passive scene may gain, of that exchanged: a method of order 1 with ten steps in an impact, and the others.
const CREATED: [f64; 2] = [0.06, 0.02];

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// To the end, with every invariant.
    Ran,
    /// With every invariant, and slower than asked: the pacer, from which the window has it, says so.
    Slow,
    /// Marked by the program as not to be trusted: why.
    Doubtful(String),
    /// By the divergence guard, which says why; the last good state is kept.
    Stopped(String),
    /// Before it began, with a reason.
    Refused(String),
    /// What must not be.
    Wrong(String),
}

impl Outcome {
    pub fn word(&self) -> &'static str {
        match self {
            Self::Ran => "runs",
            Self::Slow => "slow",
            Self::Doubtful(_) => "doubtful",
            Self::Stopped(_) => "stopped",
            Self::Refused(_) => "refused",
            Self::Wrong(_) => "WRONG",
        }
    }

    pub fn reason(&self) -> &str {
        match self {
            Self::Stopped(why) | Self::Doubtful(why) | Self::Refused(why) | Self::Wrong(why) => why,
            _ => "",
        }
    }
}

pub fn finite(frame: &Frame) -> bool {
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
pub fn fault(frame: &Frame, scene: &Scene, form: &str) -> Option<String> {
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

/// Energy of a run that nothing drives.
struct Balance {
    start: f64,
    created: f64,
    exchanged: f64,
}

impl Balance {
    fn new(frame: &Frame) -> Self {
        Self {
            start: frame.kinetic + frame.potential,
            created: 0.0,
            exchanged: frame.kinetic + frame.elastic,
        }
    }

    fn watch(&mut self, frame: &Frame) {
        let created = frame.kinetic + frame.potential - self.start;
        self.created = self.created.max(created);
        self.exchanged = self.exchanged.max(frame.kinetic + frame.elastic);
    }

    /// What part of the energy exchanged came from nowhere.
    fn gain(&self) -> f64 {
        self.created / self.exchanged.max(1e-12)
    }
}

/// Runs one cell of the table as the window would: frame by frame, behind its pacer.
pub fn run(row: &Row, form: &str, column: &str) -> Outcome {
    let scene = match row.load(form, column) {
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
    let mut balance = Balance::new(&frame);
    // The other form has all bodies' coordinates: an evaluation costs more.
    let rate = EVALUATIONS_PER_SECOND * if form == "tree" { 1.0 } else { 0.5 };
    let expected = (row.duration / (ASKED * FRAME)).ceil();
    let mut pacer = Pacer::default();
    pacer.set_scale(ASKED);
    let (mut frames, mut said_slow, mut steps) = (0.0, false, 0_u64);
    while simulation.time() < row.duration && frames < PATIENCE * expected {
        let target = pacer.begin(FRAME);
        let mut spent = 0.0;
        while simulation.time() < target.min(row.duration) && pacer.may_step(spent) {
            let before = simulation.statistics().evaluations;
            if let Err(stopped) = simulation.step_until(row.duration) {
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
            let evaluations = simulation.statistics().evaluations - before;
            if evaluations > MOST_IN_A_STEP {
                return Outcome::Wrong(format!("a step took {evaluations} evaluations"));
            }
            steps += 1;
            // A step of a scene that is a function of time alone evaluates outside the stepper.
            spent += evaluations.max(1) as f64 / rate;
            if steps < 200 || steps.is_multiple_of(16) || simulation.time() >= row.duration {
                let middle = 0.5 * (simulation.step_start() + simulation.time());
                simulation.sample(middle, &mut frame);
                if !finite(&frame) {
                    return Outcome::Wrong(format!("not finite inside a step, t = {middle:e} s"));
                }
                frame = frame_now(&mut simulation);
                if let Some(what) = fault(&frame, &scene, form) {
                    return Outcome::Wrong(what);
                }
                balance.watch(&frame);
            }
        }
        pacer.end(FRAME, target.min(row.duration), simulation.time());
        said_slow |= pacer.is_behind();
        frames += 1.0;
    }
    let mut doubts = simulation.doubts();
    let euler = scene.solver.method == jointplay::integrate::Method::SemiImplicitEuler;
    if row.passive && balance.gain() > CREATED[usize::from(!euler)] {
        let what = format!("{:.3} of the energy created", balance.gain());
        if doubts.is_empty() {
            return Outcome::Wrong(what);
        }
        doubts.push(what);
    }
    let late = simulation.time() < row.duration || frames > expected + 1.0;
    if late && !said_slow {
        return Outcome::Wrong("slower than asked, and does not say so".to_owned());
    }
    if !doubts.is_empty() {
        Outcome::Doubtful(doubts.join(" "))
    } else if late {
        Outcome::Slow
    } else {
        Outcome::Ran
    }
}
