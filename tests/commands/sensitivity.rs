//! `sensitivity`: known answers and user errors.

use std::fs;
use std::ops::ControlFlow;
use std::path::Path;

use jointplay::analysis::one_at_a_time_task::OneAtATimeTask;
use jointplay::analysis::source::SceneSource;
use jointplay::analysis::study::RunSpan;
use jointplay::analysis::sweep_task::Share;
use jointplay::analysis::task::{Job, Message, perform};
use jointplay::scene::Scene;
use serde_json::Value as Json;

use crate::program::{folder, jointplay};

const LINKS: usize = 3;
/// A study of the scene of [`write_hung_chain`], with runs in which nothing moves.
const HUNG_CHAIN: &str = "sensitivity ./hung.toml --duration 1ms --quiet --over joint.*.clearance=0.05mm..0.15mm";
/// Height of the middle of the last link without clearances, m.
const LENGTH: f64 = 0.1 * LINKS as f64 - 0.05;

/// Writes a scene of links of 100 mm that reversed gravity pulls straight up from a fixed socket: the height of the last one is the
/// sum of link lengths and clearances.
fn write_hung_chain(folder: &Path) {
    let mut text = String::from(
        "start = \"equilibrium\"\n[gravity]\nz = \"9.81 m/s^2\"\n[contact]\nclearance = \"0.1 mm\"\n\
         [output]\nbody = \"link3\"\n",
    );
    for n in 1..=LINKS {
        let below = if n == 1 { "world".to_owned() } else { format!("link{}", n - 1) };
        let socket = if n == 1 { "0 0 0 mm" } else { "0 0 50 mm" };
        text += &format!(
            "[[body]]\nname = \"link{n}\"\nmass = \"0.2 kg\"\ninertia = \"2e-4 2e-4 1e-5 kg m^2\"\n\
             [[joint]]\nname = \"free{n}\"\nkind = \"free\"\nchild = \"link{n}\"\nstart = {{ position = \"0 0 {} mm\" }}\n\
             [[ball_joint]]\nname = \"J{n}\"\nsocket = {{ body = \"{below}\", at = \"{socket}\" }}\n\
             ball = {{ body = \"link{n}\", at = \"0 0 -50 mm\" }}\nopening = [0, 1, 0]\n",
            100 * n - 50
        );
    }
    fs::write(folder.join("hung.toml"), text).unwrap();
}

fn results(path: &Path) -> Json {
    serde_json::from_str(&fs::read_to_string(path.join("sensitivity.json")).unwrap()).unwrap()
}

#[test]
fn joints_in_a_straight_chain_share_the_variance_equally() {
    let folder = folder();
    write_hung_chain(folder.path());
    let run =
        jointplay(folder.path(), &format!("{HUNG_CHAIN} --output link3.pose.z:end --rows 128 --out out")).expect(0);
    assert!(run.stdout.contains("joint.J2.clearance"), "{}", run.stdout);
    let results = results(&folder.path().join("out"));
    let output = &results["outputs"][0];
    let nominal = output["value"].as_f64().unwrap();
    // The balls penetrate their walls by less than a micrometre.
    assert!((nominal - LENGTH - 0.3e-3).abs() < 1e-6, "{nominal}");
    let parameters = output["parameters"].as_array().unwrap();
    assert_eq!(parameters.len(), LINKS);
    for parameter in parameters {
        let end = |key: &str| parameter[key].as_f64().unwrap() - nominal;
        assert!((end("alone_low") + 0.05e-3).abs() < 1e-7 && (end("alone_high") - 0.05e-3).abs() < 1e-7, "{parameter}");
        for key in ["first_order", "total"] {
            let value = parameter[key]["value"].as_f64().unwrap();
            assert!((value - 1.0 / LINKS as f64).abs() < 0.02, "{key} {value}");
            assert!(
                parameter[key]["low"].as_f64().unwrap() < value && value < parameter[key]["high"].as_f64().unwrap()
            );
        }
    }
    // Three uniform clearances, each of variance (0.1 mm)^2 / 12.
    let variance = output["variance"].as_f64().unwrap();
    assert!((variance / (3.0 * 1e-8 / 12.0) - 1.0).abs() < 0.03, "{variance}");
    let runs = fs::read_to_string(folder.path().join("out/runs.csv")).unwrap();
    assert_eq!(runs.lines().count(), 1 + (1 + 2 * LINKS + 2) + 128 * (LINKS + 2));
    for name in ["sensitivity.csv", "sensitivity.svg", "sensitivity.png", "manifest.json"] {
        assert!(folder.path().join("out").join(name).exists(), "{name}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2, "no partial file is left");
}

#[cfg(target_os = "linux")]
#[test]
fn an_interrupted_study_is_not_resumed_with_another_seed() {
    use crate::command_line::{signal, start_and_listen};
    use crate::program::{command, names, poll_until};
    let folder = folder();
    write_hung_chain(folder.path());
    let line = format!("{HUNG_CHAIN} --output link3.pose.z:end --rows 65536 --threads 1 --out out");
    let child = start_and_listen(&mut command(folder.path(), &line));
    poll_until(|| names(folder.path()).iter().any(|name| name.ends_with(".partial")));
    signal(&child, "-INT");
    assert_eq!(child.wait_with_output().unwrap().status.code(), Some(130));
    let other = jointplay(folder.path(), &format!("{line} --seed 7")).expect(2);
    assert!(other.stderr.contains("started with other settings (seed: 1 there, 7 now)"), "{}", other.stderr);
}

#[test]
fn suggested_changes_for_a_target_reach_it() {
    let folder = folder();
    write_hung_chain(folder.path());
    let suggestions = |excess: &str, out: &str| {
        let target = LENGTH + excess.parse::<f64>().unwrap();
        let line = format!("{HUNG_CHAIN} --output link3.pose.z:end --rows 0 --target {target:.6}m --out {out}");
        jointplay(folder.path(), &line).expect(0);
        results(&folder.path().join(out))["target"].clone()
    };
    // To remove 23 um of 0.3 mm, any single joint suffices, with four of the eight steps of 6.25 um.
    let single = suggestions("277e-6", "one");
    let options = single["single"].as_array().unwrap();
    assert_eq!(options.len(), LINKS, "{single}");
    for option in options {
        assert!((option["change"]["value"].as_f64().unwrap() - 0.075e-3).abs() < 1e-12, "{option}");
        assert!(option["output"].as_f64().unwrap() <= LENGTH + 277e-6);
    }
    // To remove 70 um, one joint goes to its lower end and another is reduced by 25 um.
    let together = suggestions("230e-6", "two");
    assert!(together["single"].as_array().unwrap().is_empty());
    let changes = together["together"]["changes"].as_array().unwrap();
    let mut values: Vec<f64> = changes.iter().map(|change| change["value"].as_f64().unwrap()).collect();
    values.sort_by(f64::total_cmp);
    assert!(
        (values[0] - 0.05e-3).abs() < 1e-12 && (values[1] - 0.075e-3).abs() < 1e-12 && values.len() == 2,
        "{values:?}"
    );
    assert!(suggestions("100e-6", "three")["together"].is_null());
}

#[test]
fn the_number_of_threads_changes_no_byte() {
    let folder = folder();
    write_hung_chain(folder.path());
    for (threads, out) in [(1, "a"), (2, "b")] {
        let line =
            format!("{HUNG_CHAIN} --output link3.pose.z:end,peak-force --rows 8 --threads {threads} --out {out}");
        jointplay(folder.path(), &line).expect(0);
    }
    for name in ["sensitivity.csv", "sensitivity.json", "runs.csv", "sensitivity.svg", "sensitivity.png"] {
        let read = |out: &str| fs::read(folder.path().join(out).join(name)).unwrap();
        assert!(read("a") == read("b"), "{name}");
    }
}

#[test]
fn the_window_computes_the_same_bits_as_the_command() {
    let folder = folder();
    let outputs = ["tip-error", "tip-error-rms", "peak-force", "energy-lost", "impacts"];
    let line = format!(
        "sensitivity spcmm --set spcmm.frequency=5Hz --over joint.*.clearance --output {} --duration 60ms --from 20ms --rows 0 \
         --quiet --out out",
        outputs.join(",")
    );
    jointplay(folder.path(), &line).expect(0);
    let results = results(&folder.path().join("out"));
    let scene = Scene::load("spcmm", &[("spcmm.frequency".to_owned(), "5Hz".to_owned())]).unwrap();
    let ends = [0.5, 1.5].map(|part| part * scene.machine.contact.clearance);
    let task = OneAtATimeTask {
        scene: SceneSource::of(&scene),
        over: ["S1", "S2", "S3"].map(|joint| (format!("joint.{joint}.clearance"), ends)).to_vec(),
        outputs: outputs.map(str::to_owned).to_vec(),
        span: RunSpan { duration: 0.06, from: 0.02 },
    };
    let mut runs = 0;
    perform(&Job::OneAtATime(task, Share::WHOLE), &mut || 0.0, &mut |message| {
        assert!(!matches!(message, Message::Failed(_)), "{message:?}");
        if let Message::Run(run) = message {
            runs += 1;
            for (output, value) in results["outputs"].as_array().unwrap().iter().zip(run.outputs) {
                let of_command = match run.index {
                    0 => &output["value"],
                    end => &output["parameters"][(end - 1) / 2][["alone_low", "alone_high"][(end - 1) % 2]],
                };
                assert_eq!(of_command.as_f64(), value, "{} of run {}", output["name"], run.index);
                assert!(value.is_some());
            }
        }
        ControlFlow::Continue(())
    });
    assert_eq!(runs, 7);
}

#[test]
fn a_screening_drops_parameters_without_influence() {
    let folder = folder();
    write_hung_chain(folder.path());
    let line = format!(
        "{HUNG_CHAIN} --over contact.restitution=0.5..0.9 --over gravity.x=0m/s^2..0.001m/s^2 --output link3.pose.z:end --rows 8 --screen 4 --out out"
    );
    let run = jointplay(folder.path(), &line).expect(0);
    let results = results(&folder.path().join("out"));
    let parameters = results["outputs"][0]["parameters"].as_array().unwrap();
    let is_kept = |key: &str| {
        let parameter = parameters.iter().find(|parameter| parameter["key"] == key).unwrap();
        !parameter["total"].is_null()
    };
    assert!(is_kept("joint.J1.clearance") && is_kept("joint.J3.clearance"), "{}", run.stdout);
    assert!(!is_kept("contact.restitution") && !is_kept("gravity.x"), "{}", run.stdout);
}

#[test]
fn invalid_studies_are_refused_before_any_run() {
    let folder = folder();
    write_hung_chain(folder.path());
    let bad = [
        ("--over joint.*.clearence=1um..2um", "(did you mean `joint.*.clearance`?)"),
        ("--over body.link1.mas", "(did you mean `body.link1.mass`?)"),
        ("--over joint.J1.clearance --output peak-force --rows 4", "--rows 4: allowed at least 8, or 0"),
        ("--over contact.friction=0.1..-2", "--over contact.friction=0.1..-2"),
        ("--over contact.friction=-1..2", "out of range"),
        (
            "--over body.link1.mass=-1kg..2kg --output peak-force",
            "--over body.link1.mass=-1kg..2kg: body.link1.mass: -1kg: out of range; allowed above 0 up to 1e9 kg; units kg,",
        ),
        (
            "--over body.link1.mass=normal(1kg,1kg) --output peak-force",
            "body.link1.mass: -0.959964 kg: out of range; allowed above 0 up to 1e9 kg; units kg,",
        ),
        ("--over contact.friction_law=coulomb", "contact.friction_law"),
        ("--over contact.friction=normal(0.1)", "normal"),
        ("--over contact.friction=H7/g6", "a fit gives a clearance"),
        ("--over joint.J1.clearance=H7/q6", "H7/q6"),
        (
            "--over joint.J1.clearance --output nothing",
            "--output nothing: expected CHANNEL:STATISTIC, e.g. S1.normal:max; statistics: max, min, mean, rms, std, range, end; \
             outputs by name: tip-error",
        ),
        ("--over joint.J1.clearance --output peak-force --target 1mm", "--target 1mm"),
        ("--over joint.J1.clearance --output peak-force --from 1ms", "--duration"),
        ("--over joint.J1.clearance --output peak-force --duration 1ms --from 2ms", "before the end"),
    ];
    for (rest, message) in bad {
        let run = jointplay(folder.path(), &format!("sensitivity ./hung.toml --out out {rest}")).expect(2);
        assert!(run.stderr.contains(message), "{rest}: {}", run.stderr);
        assert!(!folder.path().join("out").exists(), "{rest}");
    }
    // A fit at the ball's diameter: the joint clearance is half that between hole and shaft.
    let line = "sensitivity ./hung.toml --quiet --over joint.J1.clearance=H7/g6 --duration 1ms --rows 0 --output peak-force --out fit";
    jointplay(folder.path(), line).expect(0);
    let parameter = &results(&folder.path().join("fit"))["outputs"][0]["parameters"][0];
    let [low, high] = ["low", "high"].map(|key| parameter[key].as_f64().unwrap());
    // At 20 mm: H7 is 0 to 21 um, g6 is -20 to -7 um (ISO 286-2, tables 2 and 4).
    assert!((low - 3.5e-6).abs() < 1e-9 && (high - 20.5e-6).abs() < 1e-9, "{low} {high}");
}

#[test]
fn assumed_ranges_are_stated() {
    let folder = folder();
    let options = "four-bar --over contact.restitution --over contact.friction=0.1..0.2 --duration 1ms --quiet";
    let expected = "Range not given   contact.restitution: 0.45 to 1, half to one and a half of its value, within what is allowed\n";
    for (command, name) in [("sensitivity", "--rows 0"), ("tolerance", "--runs 8 --limit peak-force=1000N")] {
        let line = format!("{command} {options} {name} --out {command}");
        let run = jointplay(folder.path(), &line).expect(0);
        assert_eq!(run.stdout.matches("Range not given").count(), 1, "{}", run.stdout);
        assert!(run.stdout.contains(expected), "{}", run.stdout);
        for file in [format!("{command}.json"), "manifest.json".to_owned()] {
            let text = fs::read_to_string(folder.path().join(command).join(&file)).unwrap();
            let json: Json = serde_json::from_str(&text).unwrap();
            let meta = json.get("meta").unwrap_or(&json);
            assert_eq!(meta["assumed_ranges"], serde_json::json!({"contact.restitution": [0.45, 1.0]}), "{file}");
        }
    }
}

/// A mass rests on a spring at -m g / k; the mass is a number of the file, the stiffness a parameter of the scene.
#[test]
fn numbers_of_the_scene_file_can_vary_like_parameters() {
    let folder = folder();
    let text = r#"
start = "equilibrium"
[[parameter]]
name = "k"
label = "Spring"
value = "20 N/mm"
range = ["10 N/mm", "40 N/mm"]
help = "Stiffness."
[[body]]
name = "car"
mass = "400 kg"
inertia = "1 1 1 kg m^2"
[[joint]]
name = "heave"
kind = "prismatic"
child = "car"
axis = [0, 0, 1]
[[joint_spring]]
name = "spring"
joint = "heave"
stiffness = "k"
damping = "1000 N s/m"
"#;
    fs::write(folder.path().join("car.toml"), text).unwrap();
    // The standard deviation of the stiffness is smaller than its allowed minimum.
    let line = "sensitivity ./car.toml --quiet --over body.*.mass=normal(400kg,10kg) --over parameter.k=normal(20N/mm,0.5N/mm) \
                --output heave.position:mean --duration 1ms --rows 0 --out out";
    jointplay(folder.path(), line).expect(0);
    let results = results(&folder.path().join("out"));
    let parameters = &results["outputs"][0]["parameters"];
    // 97.5 % quantile of the normal distribution.
    let z = 1.959_963_984_540_054;
    let rest = |m: f64, k: f64| -m * 9.81 / k;
    let ends = [-z, z].map(|z| [rest(400.0 + 10.0 * z, 20e3), rest(400.0, 20e3 + 500.0 * z)]);
    for (i, key) in ["body.car.mass", "parameter.k"].iter().enumerate() {
        assert_eq!(parameters[i]["key"], *key);
        for (end, name) in ["alone_low", "alone_high"].iter().enumerate() {
            let value = parameters[i][name].as_f64().unwrap();
            assert!((value / ends[end][i] - 1.0).abs() < 1e-6, "{key} {name}: {value} {}", ends[end][i]);
        }
    }
}
