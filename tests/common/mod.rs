//! Helpers shared by several test files.
#![allow(dead_code, reason = "each test file is a crate of its own and uses some of this")]

pub mod invariants;
pub mod matrix;
pub mod truss;

use std::hash::{BuildHasher, Hasher, RandomState};
use std::time::Duration;

use jointplay_physics::simulate::{Frame, Simulation};
use jointplay_scene::{LiveScene, Scene, SceneError};

/// Calls `kill` with `JOINTPLAY_KILLS` instants within `length`, by default `default_count`.
pub fn at_random_instants(length: Duration, default_count: u32, mut kill: impl FnMut(Duration)) {
    let requested = std::env::var("JOINTPLAY_KILLS").ok();
    let count = requested.and_then(|n| n.parse().ok()).unwrap_or(default_count);
    for k in 0..count {
        // Seeded by the system on each run; stratified so that even a few kills cover start, middle and end.
        let random = RandomState::new().build_hasher().finish() as f64 / u64::MAX as f64;
        let instant = length.mul_f64((f64::from(k) + random) / f64::from(count));
        eprintln!("killed after {instant:?} of {length:?}");
        kill(instant);
    }
}

/// The built-in scenes with few joints, which every method runs quickly.
pub const SCENES: [&str; 6] =
    ["measuring-machine", "spcmm", "pendulum", "slider-crank", "slider-crank-driven", "chain"];
/// The other built-in scenes, whose long runs are slow; `tests/physics/machines.rs` checks each of them.
pub const MACHINES: [&str; 7] =
    ["hexapod", "delta", "four-bar", "suspension", "press", "slider-crank-worn", "excavator"];
/// Words of `solver.method`.
pub const METHODS: [&str; 5] = ["discrete-gradient", "rk4", "dopri5", "radau5", "automatic"];

/// Changed parameters: keys and values as in `--set`.
pub type Changes<'a> = [(&'a str, &'a str)];

fn owned(changes: &Changes) -> Vec<(String, String)> {
    let owned = |(key, value): &(&str, &str)| ((*key).to_owned(), (*value).to_owned());
    changes.iter().map(owned).collect()
}

/// A built-in scene with changes.
pub fn scene(name: &str, changes: &Changes) -> Scene {
    Scene::load(name, &owned(changes)).unwrap()
}

/// Pairs of method and formulation that together cover every kind of Jacobian and error control.
pub const FOUR_VARIANTS: [(&str, &str); 4] =
    [("dopri5", "tree"), ("radau5", "lagrange"), ("automatic", "tree"), ("discrete-gradient", "lagrange")];
/// Those of [`FOUR_VARIANTS`] that control the error.
pub const THREE_VARIANTS: [(&str, &str); 3] = [("dopri5", "tree"), ("radau5", "lagrange"), ("automatic", "tree")];

/// A scene from its text with changes.
pub fn parse(text: &str, changes: &Changes) -> Scene {
    Scene::parse(text, None, &owned(changes)).unwrap()
}

/// `text` with `new` for `old`, which it must contain.
pub fn replaced(text: &str, old: &str, new: &str) -> String {
    assert!(text.contains(old), "{text}\nlacks {old}");
    text.replacen(old, new, 1)
}

/// Checks that no line of `cases`, `what -> words | more words`, makes a scene: `read` is given `what`, with line breaks for `; `, and
/// fails with an error that names a file and contains these words.
pub fn assert_refused(cases: &str, read: impl Fn(&str) -> Result<Scene, SceneError>) {
    for case in cases.trim().lines() {
        let (what, words) = case.trim().split_once("-> ").expect(case);
        let message = read(&what.trim_end().replace("; ", "\n")).expect_err(case).to_string();
        let file = message.split_once(':').map_or("", |(file, _)| file);
        assert!(file.ends_with(".toml") || file.ends_with(".csv"), "{case}\n{message}");
        for words in words.split(" | ") {
            assert!(message.contains(words), "{case}\n{message}\nlacks {words}");
        }
    }
}

/// The text of a scene: a free ball of 0.1 kg in a fixed socket, without friction, at `place` (mm) from the centre along z, moving at
/// `speed` (m/s) under `gravity` along z (m/s^2); `contact` holds more lines of `[contact]`.
pub fn free_ball(place: f64, speed: f64, gravity: f64, contact: &str) -> String {
    format!(
        r#"
        [gravity]
        z = "{gravity} m/s^2"
        [contact]
        friction_law = "none"
        {contact}
        [[body]]
        name = "ball"
        mass = "0.1 kg"
        inertia = "4e-6 4e-6 4e-6 kg m^2"
        [[joint]]
        name = "ball"
        kind = "free"
        child = "ball"
        start = {{ position = "0 0 {place} mm", velocity = "0 0 {speed} m/s" }}
        [[ball_joint]]
        name = "S"
        socket = {{ body = "world" }}
        ball = {{ body = "ball" }}
        "#
    )
}

/// The text of a scene without gravity: two free bodies that tumble, `far` metres from the origin, with `joint` S between them, as from
/// [`pair_joints`]; `settings` begins the file, `more` ends it.
pub fn pair(settings: &str, joint: &str, far: f64, more: &str) -> String {
    format!(
        r#"
        gravity = {{ x = 0, y = 0, z = "0 m/s^2" }}
        {settings}
        [[body]]
        name = "a"
        mass = "0.2 kg"
        inertia = "2e-5 4e-5 3e-5 kg m^2"
        [[joint]]
        name = "a"
        kind = "free"
        child = "a"
        start = {{ position = "{far} 0 0 m", velocity = "0.3 0 0.1 m/s", angular_velocity = "30 -20 40 rad/s" }}
        [[body]]
        name = "b"
        mass = "0.1 kg"
        inertia = "2e-5 3e-5 4e-5 kg m^2"
        {joint}
        {more}
        "#
    )
}

/// Joints S of [`pair`]: a ball, and pins of which the pin or the bearing has the ends.
pub fn pair_joints(far: f64) -> [String; 3] {
    let ball = format!(
        "[[joint]]\nname = \"b\"\nkind = \"free\"\nchild = \"b\"\n\
         start = {{ position = \"{far} 0 0 m\", angular_velocity = \"-10 50 20 rad/s\" }}\n\
         [[ball_joint]]\nname = \"S\"\nsocket = {{ body = \"a\", at = \"20 0 0 mm\" }}\nball = {{ body = \"b\", at = \"20 0 0 mm\" }}"
    );
    let pin = |ends: &str| {
        format!(
            "[[joint]]\nname = \"S\"\nkind = \"cylindrical\"\nparent = \"a\"\nchild = \"b\"\naxis = [0, 0.6, 0.8]\n\
             parent_point = \"20 0 0 mm\"\nstart = {{ angular_velocity = \"80 rad/s\", velocity = \"0.2 m/s\" }}\n\
             play = {{ radial = \"0.1 mm\", length = \"24 mm\", radius = \"10 mm\", ends = \"{ends}\" }}"
        )
    };
    [ball, pin("pin"), pin("bearing")]
}

/// A simulation of a built-in scene.
pub fn simulation(name: &str, changes: &Changes) -> Simulation {
    Simulation::new(&scene(name, changes).machine).unwrap()
}

/// A running built-in scene whose parameters can be changed.
pub fn live(name: &str, changes: &Changes) -> LiveScene {
    LiveScene::new(&scene(name, changes)).unwrap()
}

/// Steps exactly to `end`, truncating the last step.
pub fn run_until(simulation: &mut Simulation, end: f64) {
    while simulation.time() < end {
        simulation.step_until(end).unwrap();
    }
}

/// The frame of the latest state.
pub fn frame_now(simulation: &mut Simulation) -> Frame {
    let mut frame = Frame::default();
    simulation.sample(simulation.time(), &mut frame);
    frame
}

/// Slope of ln(y) against ln(x) by least squares.
pub fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let logs = points.iter().map(|&(x, y)| (x.ln(), y.ln()));
    let (mut sx, mut sy, mut sxx, mut sxy) = (0.0, 0.0, 0.0, 0.0);
    for (x, y) in logs {
        sx += x;
        sy += y;
        sxx += x * x;
        sxy += x * y;
    }
    (n * sxy - sx * sy) / (n * sxx - sx * sx)
}

/// A clock for the interface that advances by `MICROSECONDS` at each reading, so that the work done in a frame does not depend on
/// the computer.
pub fn ticking_clock<const MICROSECONDS: u32>() -> f64 {
    thread_local! {
        static READINGS: std::cell::Cell<u32> = const { std::cell::Cell::new(0) };
    }
    READINGS.set(READINGS.get() + 1);
    f64::from(READINGS.get()) * f64::from(MICROSECONDS) * 1e-6
}

/// Mean magnitude of each contact force between `from` and `to`, N, sampled at 1001 instants.
pub fn mean_forces(simulation: &mut Simulation, from: f64, to: f64) -> Vec<f64> {
    let mut frame = Frame::default();
    let mut sums = vec![0.0; simulation.machine().loose_joints.len()];
    for n in 0..=1000 {
        let t = from + (to - from) * f64::from(n) / 1000.0;
        simulation.advance_to(t).unwrap();
        simulation.sample(t, &mut frame);
        for (sum, joint) in sums.iter_mut().zip(&frame.joints) {
            *sum += (joint.normal_force + joint.friction_force).norm() / 1001.0;
        }
    }
    sums
}
