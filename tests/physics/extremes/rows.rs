//! The extreme cases: their scenes and changes, and the methods or presets of each.

use jointplay_physics::machine::{JointStart, Vec3};
use jointplay_physics::simulate::Simulation;
use jointplay_scene::Scene;

/// Simulated time, s, that includes the first impacts of every scene.
const DURATION: f64 = 0.03;
/// Simulated time, s, until contacts settle.
const SETTLED: f64 = 0.2;

/// Columns of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Columns {
    /// Every preset.
    Presets,
    /// Every method, for rows about step size or tolerance.
    Methods,
}

/// One extreme.
pub struct Row {
    pub label: String,
    pub scene: &'static str,
    pub columns: Columns,
    changes: Vec<(String, String)>,
    edit: fn(&mut Scene),
    /// Simulated time, s.
    pub duration: f64,
    /// Nothing drives the scene, so its energy must not rise.
    pub passive: bool,
}

impl Row {
    fn new(label: &str, scene: &'static str, changes: &[(&str, &str)]) -> Self {
        let owned = |(key, value): &(&str, &str)| ((*key).to_owned(), (*value).to_owned());
        Self {
            label: label.to_owned(),
            scene,
            columns: Columns::Presets,
            changes: changes.iter().map(owned).collect(),
            edit: |_| {},
            duration: DURATION,
            passive: matches!(scene, "pendulum" | "chain" | "slider-crank"),
        }
    }

    fn edited(mut self, edit: fn(&mut Scene)) -> Self {
        self.edit = edit;
        self
    }

    fn with_methods(mut self) -> Self {
        self.columns = Columns::Methods;
        self
    }

    fn until_settled(mut self) -> Self {
        self.duration = SETTLED;
        self
    }

    /// The scene of one cell, or the error.
    pub fn load(&self, form: &str, column: &str) -> Result<Scene, String> {
        let key = match self.columns {
            Columns::Presets => "solver.preset",
            Columns::Methods => "solver.method",
        };
        let mut changes = self.changes.clone();
        for (key, value) in [("formulation", form), (key, column)] {
            changes.push((key.to_owned(), value.to_owned()));
        }
        let mut scene = Scene::load(self.scene, &changes).map_err(|error| error.to_string())?;
        (self.edit)(&mut scene);
        Ok(scene)
    }
}

fn scale_masses(scene: &mut Scene, factor: f64) {
    for body in &mut scene.machine_mut().bodies {
        body.mass *= factor;
        body.inertia *= factor;
    }
}

/// Sets the rods' moments of inertia about their own axes to nearly zero.
fn thin_rods(scene: &mut Scene) {
    for body in &mut scene.machine_mut().bodies {
        let i = &mut body.inertia;
        let axis = (0..3).min_by(|&a, &b| i[(a, a)].total_cmp(&i[(b, b)]));
        if body.name.starts_with("rod") || body.name.starts_with("link") {
            let axis = axis.unwrap();
            i[(axis, axis)] = 1e-14;
        }
    }
}

/// Offsets the start of the pendulum's ball from the centre of its socket.
fn start_at(scene: &mut Scene, offset: Vec3) {
    let JointStart::Pose { position, .. } = &mut scene.machine_mut().joints[0].start else {
        panic!("the pendulum is free")
    };
    *position += offset;
}

/// Bisects between slider planes `good`, within reach, and `bad`, beyond it, until they are at most 1e-6 m apart.
fn reach_limit(mut good: f64, mut bad: f64) -> (f64, f64) {
    let reached = |plane: f64| {
        let changes = [("spcmm.slider_plane".to_owned(), format!("{plane} m"))];
        Simulation::new(&Scene::load("spcmm", &changes).unwrap().machine).is_ok()
    };
    assert!(reached(good) && !reached(bad));
    while (good - bad).abs() > 1e-6 {
        let middle = 0.5 * (good + bad);
        if reached(middle) {
            good = middle;
        } else {
            bad = middle;
        }
    }
    (good, bad)
}

/// Every row.
pub fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    let both = ["spcmm", "pendulum"];
    let mut each = |label: &str, changes: &[(&str, &str)]| {
        for scene in both {
            rows.push(Row::new(label, scene, changes));
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
    for law in ["lankarani-nikravesh", "hertz", "hunt-crossley", "flores", "gonthier"] {
        for restitution in ["0", "0.001", "1"] {
            let changes = [("contact.normal_law", law), ("contact.restitution", restitution)];
            each(&format!("restitution {restitution}, {law}"), &changes);
        }
    }
    for modulus in ["1 MPa", "10 MPa", "1000 GPa"] {
        let changes = [("contact.youngs_modulus", modulus)];
        each(&format!("Young's modulus {modulus}"), &changes);
    }
    for (radius, clearance) in [("0.1 mm", "0.05 mm"), ("1 m", "0.3 mm"), ("1 m", "0.9 m")] {
        let changes = [("contact.clearance", clearance), ("contact.ball_radius", radius)];
        let reversed = [changes[1], changes[0]];
        let changes = if clearance == "0.9 m" { reversed } else { changes };
        each(&format!("ball radius {radius}, clearance {clearance}"), &changes);
    }
    each(
        "slip speeds 0 and 1e-6 mm/s",
        &[("contact.slip_speed_low", "0 m/s"), ("contact.slip_speed_high", "1e-6 mm/s")],
    );
    each("impact speed floor 1e-6 mm/s", &[("contact.impact_speed_floor", "1e-6 mm/s")]);
    each("impact speed floor 10 m/s", &[("contact.impact_speed_floor", "10 m/s")]);
    for (label, x, z) in [
        ("gravity 0", "0 m/s^2", "0 m/s^2"),
        ("gravity reversed", "-9.81 m/s^2", "9.81 m/s^2"),
        ("gravity 100 g", "981 m/s^2", "-981 m/s^2"),
    ] {
        rows.push(Row::new(label, "spcmm", &[("gravity.x", x)]));
        rows.push(Row::new(label, "pendulum", &[("gravity.z", z)]));
    }
    for scene in ["spcmm", "pendulum", "chain"] {
        let row = |label: &str| Row::new(label, scene, &[]);
        rows.push(row("masses times 1e-6").edited(|s| scale_masses(s, 1e-6)));
        rows.push(row("masses times 1e3").edited(|s| scale_masses(s, 1e3)));
        rows.push(row("rods without inertia about their axis").edited(thin_rods));
    }
    for frequency in ["0 Hz", "5 Hz", "50 Hz"] {
        let changes = [("spcmm.frequency", frequency)];
        rows.push(Row::new(&format!("drive frequency {frequency}"), "spcmm", &changes));
        let ideal = [changes[0], ("contact.clearance", "0")];
        rows.push(Row::new(&format!("drive frequency {frequency}, ideal"), "spcmm", &ideal));
    }
    for scene in both {
        for step in ["0.1 us", "1 us", "100 us", "1 ms", "10 ms"] {
            let changes = [("solver.step", step)];
            rows.push(Row::new(&format!("step {step}"), scene, &changes).with_methods());
        }
        for tolerance in ["1e-2", "1e-4", "1e-8", "1e-10", "1e-13"] {
            let changes = [("solver.tolerance", tolerance)];
            rows.push(Row::new(&format!("tolerance {tolerance}"), scene, &changes).with_methods());
        }
        for tolerance in ["1e-2", "1e-3", "1e-4"] {
            let changes = [("solver.tolerance", tolerance)];
            let label = format!("tolerance {tolerance}, until settled");
            let row = Row::new(&label, scene, &changes).with_methods();
            rows.push(row.until_settled());
        }
        rows.push(Row::new("default, until settled", scene, &[]).until_settled());
    }
    // x_s = a1 + 28 mm; the square roots end between 28 mm and 60 mm, and between 364 mm and 365 mm. The rods of the lower
    // end are longest a quarter of a period after the start, that of the upper end three quarters: within the run at the
    // higher frequency.
    for (end, good, bad, frequencies) in
        [("lower", 0.032, 0.0, &["0.5 Hz", "10 Hz"][..]), ("upper", 0.336, 0.337, &["30 Hz"])]
    {
        let (reached, not_reached) = reach_limit(good, bad);
        for (side, plane) in [("within", reached), ("beyond", not_reached)] {
            let plane = format!("{plane} m");
            for (kind, clearance) in [("clearance 0.3 mm", "0.3 mm"), ("ideal", "0")] {
                for frequency in frequencies {
                    let changes = [
                        ("spcmm.slider_plane", &*plane),
                        ("contact.clearance", clearance),
                        ("spcmm.frequency", frequency),
                    ];
                    let label = format!("1e-6 m {side} the {end} reach, {kind}, {frequency}");
                    rows.push(Row::new(&label, "spcmm", &changes));
                }
            }
        }
    }
    for plane in ["132 mm", "162 mm", "175 mm", "189 mm", "222 mm", "336 mm"] {
        for (kind, clearance) in [("clearance 0.3 mm", "0.3 mm"), ("ideal", "0")] {
            // Fast enough to cross the singular range within the run.
            let changes =
                [("spcmm.slider_plane", plane), ("contact.clearance", clearance), ("spcmm.frequency", "5 Hz")];
            rows.push(Row::new(&format!("slider plane {plane}, {kind}"), "spcmm", &changes));
        }
    }
    for (label, changes) in [
        ("one joint ideal", &[("joint.S1.clearance", "0")][..]),
        ("two joints ideal", &[("joint.S1.clearance", "0"), ("joint.S2.clearance", "0")]),
        ("all joints ideal", &[("contact.clearance", "0")]),
        (
            "clearances 0, 0.1 um and 9 mm",
            &[("joint.S1.clearance", "0"), ("joint.S2.clearance", "0.1 um"), ("joint.S3.clearance", "9 mm")],
        ),
        (
            "an ideal joint, a frictionless elastic one, a rough one with friction 1",
            &[
                ("joint.S1.clearance", "0"),
                ("joint.S2.normal_law", "hertz"),
                ("joint.S2.restitution", "1"),
                ("joint.S2.friction_law", "none"),
                ("joint.S3.normal_law", "gonthier"),
                ("joint.S3.restitution", "0.3"),
                ("joint.S3.friction", "1"),
                ("joint.S3.friction_velocity", "surface"),
            ],
        ),
    ] {
        rows.push(Row::new(label, "spcmm", changes));
    }
    rows.push(Row::new("free, one joint of each kind", "slider-crank", &[]));
    rows.push(Row::new("free, both joints ideal", "slider-crank", &[("contact.clearance", "0")]));
    rows.push(Row::new("driven, one joint of each kind", "slider-crank-driven", &[]));
    let pendulum = |label: &str| Row::new(label, "pendulum", &[]);
    let calm = |label: &str| Row::new(label, "pendulum", &[("gravity.z", "0 m/s^2")]);
    rows.push(pendulum("starts on the wall").edited(|s| start_at(s, Vec3::z() * -0.3e-3)));
    rows.push(pendulum("starts 1 um inside the wall").edited(|s| start_at(s, Vec3::z() * -0.301e-3)));
    rows.push(pendulum("starts 0.09 mm inside the wall").edited(|s| start_at(s, Vec3::z() * -0.39e-3)));
    rows.push(pendulum("starts 1 mm inside the wall").edited(|s| start_at(s, Vec3::z() * -1.3e-3)));
    rows.push(calm("at rest on the wall, no gravity").edited(|s| start_at(s, Vec3::x() * 0.3e-3)));
    rows.push(calm("at rest in the middle, no gravity"));
    // The machines, driven as fast as their parameters allow.
    for (scene, key, value, duration) in [
        ("hexapod", "parameter.rate", "5 Hz", 0.01),
        ("delta", "parameter.rate", "3 Hz", 0.004),
        ("four-bar", "parameter.speed", "60 rad/s", DURATION),
        ("suspension", "parameter.bump", "30 mm", DURATION),
        ("press", "parameter.speed", "400 rpm", DURATION),
    ] {
        let mut row = Row::new(&format!("{key} = {value}"), scene, &[(key, value)]);
        row.duration = duration;
        rows.push(row);
    }
    rows
}
