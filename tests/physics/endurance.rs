//! Long runs, and runs with a parameter change in every frame: short versions of both here, a thousand simulated seconds and a
//! minute of frames in `./test full`.

use std::fmt::Write;
use std::sync::Mutex;

use crate::common::invariants::{finite, violation};
use crate::common::matrix::in_parallel;
use crate::common::{frame_now, scene};
use jointplay_physics::machine::Mat3;
use jointplay_physics::simulate::{Frame, Simulation};
use jointplay_scene::LiveScene;

/// Pseudo-random numbers from a seed (xorshift64*), so that every run of a test is the same.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn below(&mut self, count: usize) -> usize {
        (self.next() * count as f64) as usize
    }
}

/// One frame's change: a key and its value.
fn change(random: &mut Random, simulation: &Simulation) -> (String, String) {
    let joints = &simulation.machine().loose_joints;
    let joint = random.below(2 * joints.len());
    let target = match joints.get(joint) {
        Some(joint) => format!("joint.{}", joint.name),
        None => "contact".to_owned(),
    };
    let x = random.next();
    match random.below(3) {
        // 0.01 mm to 3 mm.
        0 => (format!("{target}.clearance"), format!("{:e} mm", 0.01 * 300_f64.powf(x))),
        1 => (format!("{target}.friction"), format!("{:e}", 1.5 * x)),
        _ => (format!("{target}.restitution"), format!("{x:e}")),
    }
}

/// Advances by one frame and checks the invariants.
fn advance_frame(simulation: &mut Simulation, target: f64, frame: &mut Frame) {
    simulation.advance_to(target).unwrap();
    simulation.sample(target, frame);
    assert!(finite(frame), "t = {target}");
    let now = frame_now(simulation);
    let machine = simulation.machine().clone();
    assert_eq!(violation(&now, &machine, "tree"), None, "t = {target}");
}

/// Runs `frames` frames at 60 frames per second and `pace` simulated seconds per second, with a random change in each.
fn random_changes(name: &str, preset: &str, seed: u64, frames: usize, pace: f64) {
    let mut random = Random(seed);
    let changes = [("solver.preset", preset)];
    let mut simulation = LiveScene::new(&scene(name, &changes)).unwrap();
    let mut frame = Frame::default();
    let mut shown = 0.0;
    let (mut restored, mut n) = (0, 0);
    while n < frames {
        let (key, value) = change(&mut random, &simulation);
        simulation.set(&key, &value).unwrap();
        match random.below(120) {
            // A pause: frames are drawn, but time does not advance.
            0 => {
                let hash = simulation.state_hash();
                for _ in 0..5 {
                    simulation.sample(shown, &mut frame);
                }
                assert_eq!(simulation.state_hash(), hash);
            }
            // Runs a random path twice from a snapshot, and once in another simulation.
            1 => {
                let snapshot = simulation.snapshot();
                let mut path = Vec::new();
                let replay = |simulation: &mut LiveScene, path: &[(String, String)]| {
                    for (n, (key, value)) in path.iter().enumerate() {
                        simulation.set(key, value).unwrap();
                        simulation.advance_to(shown + (n + 1) as f64 * pace / 60.0).unwrap();
                    }
                    simulation.state_hash()
                };
                for _ in 0..5 {
                    path.push(change(&mut random, &simulation));
                }
                let first = replay(&mut simulation, &path);
                simulation.restore(&snapshot);
                assert_eq!(replay(&mut simulation, &path), first, "seed {seed}, t = {shown}");
                let mut other = LiveScene::new(&scene(name, &[])).unwrap();
                other.restore(&snapshot);
                assert_eq!(replay(&mut other, &path), first, "elsewhere, seed {seed}, t = {shown}");
                simulation.restore(&snapshot);
                restored += 1;
            }
            _ => {}
        }
        shown += pace / 60.0;
        advance_frame(&mut simulation, shown, &mut frame);
        n += 1;
    }
    let statistics = simulation.statistics();
    println!(
        "{name}, {preset}, seed {seed}: {frames} frames, {shown:.2} s, {} steps, {} evaluations, {} impacts, {restored} restored",
        statistics.steps,
        statistics.evaluations,
        statistics.impacts()
    );
    assert!(restored > frames / 700);
}

/// The window's default pace: 1:50.
const SLOW_MOTION: f64 = 0.02;

const RANDOM: [(&str, &str, u64); 6] = [
    ("spcmm", "preview", 1),
    ("spcmm", "real-time", 2),
    ("spcmm", "accurate", 3),
    ("pendulum", "real-time", 4),
    ("slider-crank", "preview", 5),
    ("slider-crank-driven", "real-time", 6),
];

#[test]
fn seconds_with_a_change_in_every_frame() {
    for (name, preset, seed) in RANDOM {
        random_changes(name, preset, seed, 400, SLOW_MOTION);
    }
    random_changes("spcmm", "real-time", 7, 400, 1.0);
}

#[test]
#[ignore = "full: ten seconds"]
fn full_a_minute_of_changes_with_every_frame() {
    let slow = RANDOM.map(|(name, preset, seed)| (name, preset, seed, SLOW_MOTION));
    let runs = [&[("spcmm", "real-time", 7, 1.0)], &slow[..]].concat();
    in_parallel(&runs, |(name, preset, seed, pace)| random_changes(name, preset, *seed, 3600, *pace));
}

#[test]
#[ignore = "minutes"]
fn minutes_of_changes_with_every_frame_in_real_time() {
    for seed in 11..14 {
        for name in ["spcmm", "pendulum"] {
            for preset in ["preview", "real-time"] {
                random_changes(name, preset, seed, 3600, 1.0);
            }
        }
    }
}

/// Default bounds of the energy residual with `preview` and `real-time`, for few loose joints.
const RESIDUAL: [f64; 2] = [2e-3, 1e-4];

/// Largest deviations of a long run, at the same phase of every period, from the third period.
#[derive(Debug, Default)]
struct Drift {
    /// Simulated time, s.
    time: f64,
    steps: u64,
    /// Contacts that began after the third period.
    contacts: u64,
    /// Largest distance between ball and socket of an ideal joint, m.
    open: f64,
    /// Largest deviation of an orientation from a rotation matrix.
    skew: f64,
    /// Change of energy, relative to the largest kinetic energy.
    energy: f64,
    /// Change of a normal force, relative to the largest.
    force: f64,
    /// Residual of the energy balance at the end, relative to the energy exchanged.
    residual: f64,
}

/// A long run: scene, changes, period (s) and bounds.
struct LongRun {
    scene: &'static str,
    label: &'static str,
    changes: &'static crate::common::Changes<'static>,
    period: f64,
    /// Bound on the change of energy, and a tenth of that on a force, with `preview` and `real-time`; none where contacts do not settle.
    limits: [Option<f64>; 2],
    /// Bound on the energy residual with `preview` and `real-time`, relative to the energy exchanged.
    residual: [f64; 2],
}

const SPCMM_PERIOD: f64 = 2.0;
const CRANK_PERIOD: f64 = std::f64::consts::PI / 3.0;
const IDEAL: (&str, &str) = ("contact.clearance", "0");
/// For motion that is a function of time alone.
const ROUNDING: [Option<f64>; 2] = [Some(1e-9); 2];
const SETTLED: [Option<f64>; 2] = [Some(0.02), Some(1e-3)];

fn long(
    scene: &'static str,
    label: &'static str,
    changes: &'static crate::common::Changes<'static>,
    period: f64,
    limits: [Option<f64>; 2],
) -> LongRun {
    LongRun { scene, label, changes, period, limits, residual: RESIDUAL }
}

/// Runs that are cheap enough for every test run.
fn short_list() -> [LongRun; 3] {
    [
        long("spcmm", "default", &[], SPCMM_PERIOD, SETTLED),
        long("spcmm", "ideal", &[IDEAL], SPCMM_PERIOD, ROUNDING),
        long("slider-crank-driven", "ideal", &[IDEAL], CRANK_PERIOD, ROUNDING),
    ]
}

fn long_list() -> Vec<LongRun> {
    let one_ideal = &[("joint.S1.clearance", "0")];
    let mut list = Vec::from(short_list());
    list.push(long("spcmm", "one joint ideal", one_ideal, SPCMM_PERIOD, SETTLED));
    list.push(long("slider-crank-driven", "default", &[], CRANK_PERIOD, [None; 2]));
    list.push(long("pendulum", "default", &[], 1.0, [None; 2]));
    list.push(long("slider-crank", "free, ideal", &[IDEAL], 1.0, [None; 2]));
    let many = |scene, label, changes| LongRun { residual: [1e-4; 2], ..long(scene, label, changes, 1.0, [None; 2]) };
    list.push(many("hexapod", "default", &[]));
    list.push(many("delta", "default", &[]));
    list.push(many("chain", "16 links", &[("chain.links", "16")]));
    list
}

const FAST: [&str; 2] = ["preview", "real-time"];

/// Runs for at least `duration`, samples twice per period, and compares the ends of the periods.
fn long_run(case: &LongRun, preset: usize, duration: f64) -> Drift {
    let changes = [case.changes, &[("solver.preset", FAST[preset])]].concat();
    let mut simulation = LiveScene::new(&scene(case.scene, &changes)).unwrap();
    let mut drift = Drift::default();
    let mut kinetic = 0.0_f64;
    let mut frame = Frame::default();
    let mut first: Option<(Frame, u64)> = None;
    let halves = 2 * (duration / case.period).ceil() as u32;
    let contacts = |simulation: &Simulation| simulation.statistics().impacts();
    for n in 1..=halves {
        let now = f64::from(n) * 0.5 * case.period;
        simulation.advance_to(now).unwrap();
        simulation.sample(now, &mut frame);
        assert!(finite(&frame));
        // Checked at the step's end: inside it the interpolated state may penetrate the wall within the tolerance.
        let end = frame_now(&mut simulation);
        let running = simulation.running();
        assert_eq!(violation(&end, &running.machine, "tree"), None);
        kinetic = kinetic.max(frame.kinetic);
        for (joint, of_scene) in frame.joints.iter().zip(&running.machine.loose_joints) {
            if of_scene.contact.clearance == 0.0 {
                drift.open = drift.open.max(joint.eccentricity.norm());
            }
        }
        for body in &frame.bodies {
            let deviation = body.rotation.tr_mul(&body.rotation) - Mat3::identity();
            drift.skew = drift.skew.max(deviation.amax());
        }
        if n % 2 == 1 || n < 6 {
            continue;
        }
        let Some((first, _)) = &first else {
            first = Some((frame.clone(), contacts(&simulation)));
            continue;
        };
        let gain = frame.kinetic + frame.potential - first.kinetic - first.potential;
        drift.energy = drift.energy.max(gain.abs() / kinetic);
        let force = |frame: &Frame, j: usize| frame.joints[j].normal_force.norm();
        let joints = 0..frame.joints.len();
        let max_force = joints.clone().map(|j| force(first, j)).fold(0.0, f64::max);
        for j in joints {
            let change = (force(&frame, j) - force(first, j)).abs() / max_force;
            drift.force = drift.force.max(change);
        }
    }
    let earlier_contacts = first.map_or(0, |(_, earlier_contacts)| earlier_contacts);
    drift.contacts = contacts(&simulation) - earlier_contacts;
    drift.steps = simulation.statistics().steps;
    drift.time = simulation.time();
    drift.residual = simulation.ledger().unwrap().relative_residual().abs();
    println!("{} {changes:?}: {drift:?}", case.scene);
    drift
}

fn check_limits(case: &LongRun, preset: usize, drift: &Drift) {
    let label = format!("{} {}, {}", case.scene, case.label, FAST[preset]);
    assert!(drift.open < 1e-12, "{label}: open by {:e} m", drift.open);
    assert!(drift.skew < 1e-12, "{label}: orientation off by {:e}", drift.skew);
    assert!(drift.residual < case.residual[preset], "{label}: residual {:e}", drift.residual);
    if let Some(limit) = case.limits[preset] {
        assert!(drift.energy < limit, "{label}: energy {:e}", drift.energy);
        assert!(drift.force < 10.0 * limit, "{label}: force {:e}", drift.force);
    }
}

fn check_no_drift(case: &LongRun, duration: f64) {
    let drift = long_run(case, 1, duration);
    check_limits(case, 1, &drift);
    assert_eq!(drift.contacts, 0, "{} {}: settled", case.scene, case.label);
}

#[test]
fn a_hundred_settled_seconds_do_not_drift() {
    short_list().iter().for_each(|case| check_no_drift(case, 100.0));
}

#[test]
#[ignore = "full: four seconds"]
fn full_a_thousand_settled_seconds_do_not_drift() {
    in_parallel(&short_list(), |case| check_no_drift(case, 1000.0));
}

#[test]
#[ignore = "half an hour on two cores; writes the long runs to docs/extremes.md"]
fn write_a_thousand_seconds_of_every_kind() {
    let mut page = String::from(
        "\n## 1000 simulated seconds\n\n\
         Written by `cargo test --release -p jointplay-analysis --test physics -- --ignored endurance::write` within an hour. Energy and normal force are the\n\
         largest changes from the end of the third period to the end of any later one, relative to the largest kinetic energy and to the\n\
         largest normal force. The energy residual is that of the whole run, relative to the energy exchanged. The free mechanisms have no\n\
         period; their energy is sampled every second, and the motion of pendulum and chain decays.\n\n\
         | Scene | Preset | Steps | Later contacts | Gap of ideal joints, m | Orientation error | Energy | Energy residual | Normal force |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    let list = long_list();
    let runs: Vec<_> =
        list.iter().flat_map(|case| (0..FAST.len()).map(move |preset| (case, preset))).enumerate().collect();
    let results = Mutex::new(Vec::new());
    in_parallel(&runs, |&(index, (case, preset))| {
        let drift = long_run(case, preset, 1000.0);
        results.lock().unwrap().push((index, drift));
    });
    let mut results = results.into_inner().unwrap();
    results.sort_by_key(|(index, _)| *index);
    for ((_, (case, preset)), (_, d)) in runs.into_iter().zip(results) {
        let force = match case.scene {
            "chain" | "pendulum" | "slider-crank" => "-".to_owned(),
            _ => format!("{:.1e}", d.force),
        };
        let _ = writeln!(
            page,
            "| {}, {} | {} | {} | {} | {:.1e} | {:.1e} | {:.1e} | {:.1e} | {force} |",
            case.scene, case.label, FAST[preset], d.steps, d.contacts, d.open, d.skew, d.energy, d.residual
        );
        check_limits(case, preset, &d);
    }
    let path = std::path::Path::new(crate::ROOT).join("docs/extremes.md");
    let text = std::fs::read_to_string(&path).unwrap();
    let at = text.find("\n## 1000 simulated seconds\n").unwrap_or(text.len());
    std::fs::write(path, text[..at].to_owned() + &page).unwrap();
}
