//! Golden frames: pictures of `jointplay render` against those in `tests/golden/`.
//!
//! `UPDATE_GOLDEN=1 cargo test --test interface frames::` redraws them; look at each before committing it.

use std::fs;
use std::path::Path;

use serde_json::Value as Json;

use crate::golden::{Picture, TOLERANCE, compare, draw, jointplay, picture_mismatch, plain};

#[track_caller]
fn golden(name: &str, arguments: &str) {
    golden_in("tests/golden", name, arguments);
}

#[track_caller]
fn golden_in(folder: &str, name: &str, arguments: &str) {
    let scratch = tempfile::tempdir().expect("a scratch folder");
    let actual = Picture::read(&draw(scratch.path(), arguments));
    compare(folder, name, &actual, &format!("jointplay render {arguments}"));
}

/// The default scene in the middle of its first impacts.
const IMPACT: &str = "spcmm --at 7.85ms --size 640x400 --magnification 20 --overlay";

/// Every built-in scene: the instant, and the magnification of its clearances.
const SCENES: [(&str, &str, u32); 13] = [
    ("measuring-machine", "0.108s", 20),
    ("spcmm", "7.85ms", 20),
    ("pendulum", "0.1s", 1),
    ("slider-crank", "0.1s", 1),
    ("slider-crank-driven", "0.1s", 1),
    ("chain", "0.1s", 1),
    ("hexapod", "20ms", 10),
    ("delta", "20ms", 10),
    ("four-bar", "0.1s", 10),
    ("suspension", "0.1s", 10),
    ("press", "0.1s", 10),
    ("slider-crank-worn", "0.1s", 10),
    ("excavator", "0.3s", 5),
];

#[test]
fn every_scene_is_drawn_as_stored() {
    assert_eq!(SCENES.map(|(scene, ..)| scene), jointplay::scene::BUILT_IN);
    for (scene, instant, magnification) in SCENES {
        golden(
            &scene.replace('-', "_"),
            &format!("{scene} --at {instant} --magnification {magnification} --size 640x400 --overlay"),
        );
    }
}

/// The press has parts of every role and the suspension has springs; their materials in the dark theme do not depend on the scene.
#[test]
fn every_role_is_drawn_dark_as_stored() {
    for scene in ["press", "suspension"] {
        let arguments = format!("{scene} --at 0.1s --magnification 10 --size 400x250 --theme dark");
        golden(&format!("{scene}_dark"), &arguments);
    }
}

#[test]
fn a_dark_close_up_of_a_ball_joint_is_drawn_as_stored() {
    golden("spcmm_close_up_dark", "spcmm --at 7.85ms --size 480x300 --magnification 20 --close-up S1 --theme dark");
}

#[test]
fn spcmm_in_the_window_is_drawn_as_stored() {
    golden("spcmm_window", "spcmm --at 7.85ms --size 800x500 --ui");
}

#[test]
fn the_readme_shows_the_current_window() {
    golden_in("assets", "window", "measuring-machine --at 0.108s --size 1200x740 --ui");
}

#[test]
fn a_missing_part_of_a_picture_is_detected() {
    let folder = tempfile::tempdir().expect("a scratch folder");
    let complete = Picture::read(&draw(folder.path(), IMPACT));
    assert!(picture_mismatch(&complete, &complete).is_none());
    for less in ["--arrows none", "--hide sockets", "--hide names", "--set contact.clearance=0.1mm"] {
        let picture = Picture::read(&draw(folder.path(), &format!("{IMPACT} {less}")));
        let count = complete.differences(&picture);
        assert!(count > 2 * TOLERANCE.1, "{less} changes {count} pixels only");
    }
}

#[test]
fn a_frame_has_the_same_bytes_each_time() {
    for arguments in [IMPACT, "pendulum --at 20ms --size 640x400 --ui"] {
        let folders = [(); 2].map(|()| tempfile::tempdir().expect("a scratch folder"));
        let [a, b] = folders.each_ref().map(|folder| fs::read(draw(folder.path(), arguments)).expect("written"));
        assert!(a == b, "{arguments}");
    }
}

#[test]
fn a_frame_of_the_window_shows_the_plots_of_its_link() {
    let render_window = |scene: &str| {
        let folder = tempfile::tempdir().expect("a scratch folder");
        jointplay(folder.path(), &format!("render {scene} --ui --at 5ms --size 900x600 --out frames --quiet"));
        fs::read(folder.path().join("frames/frame_00000.png")).expect("written")
    };
    let plain = render_window("pendulum");
    assert!(plain == render_window("--link ?scene=pendulum"), "a link to the scene alone");
    let energy = render_window("--link ?scene=pendulum&plots=energy");
    assert!(plain != energy, "other plots");
    assert!(energy != render_window("--link ?scene=pendulum&plots=energy&window=1ms"), "another time window");
}

/// A frame's hash is that of a run to the end of the step that contains the frame; with a fixed step both take the same steps.
#[test]
fn the_manifest_has_the_state_that_a_run_reaches() {
    let folder = tempfile::tempdir().expect("a scratch folder");
    draw(folder.path(), "spcmm --at 7.853ms,0s,7.85ms --size 64x64");
    let manifest = fs::read(folder.path().join("frames/manifest.json")).expect("written");
    let manifest: Json = serde_json::from_slice(&manifest).expect("JSON");
    assert_eq!(manifest["scene"], "spcmm");
    assert_eq!(manifest["changed_parameters"]["solver.method"], "rk4");
    assert_eq!(manifest["parameters"]["contact.clearance"], "0.3 mm");
    let frames = manifest["frames"].as_array().expect("a list");
    let number = |frame: &Json, key: &str| frame[key].as_f64().expect("a number");
    let times: Vec<f64> = frames.iter().map(|f| number(f, "time_s")).collect();
    assert_eq!(times, [7.853e-3, 0.0, 7.85e-3], "numbered as given");
    for frame in frames {
        let end = number(frame, "state_time_s");
        assert!(end >= number(frame, "time_s") && end < number(frame, "time_s") + 20e-6);
        let run =
            jointplay(folder.path(), &format!("run spcmm {} --duration {end:e}s --summary json --quiet", plain()));
        let run: Json = serde_json::from_slice(&run.stdout).expect("JSON");
        assert_eq!(frame["state_hash"], run["state_hash"], "at {end} s");
    }
}

/// A picture with a force element differs from one without it and from one with another element.
#[test]
fn bushings_stops_and_motors_are_drawn() {
    const MACHINE: &str = "[[body]]
name = \"mass\"
mass = \"1 kg\"
inertia = \"1 1 1 kg m^2\"
shapes = [{ form = \"box\", centre = [0, 0, 0], size = \"20 20 20 mm\", role = \"slider\" }]
[[body]]
name = \"arm\"
mass = \"1 kg\"
centre = \"50 0 0 mm\"
inertia = \"1 1 1 kg m^2\"
shapes = [{ form = \"capsule\", from = [0, 0, 0], to = \"100 0 0 mm\", radius = \"4 mm\", role = \"driven-rod\" }]
[[joint]]
name = \"slide\"
kind = \"prismatic\"
child = \"mass\"
axis = [1, 0, 0]
[[joint]]
name = \"hinge\"
kind = \"revolute\"
child = \"arm\"
axis = [0, 1, 0]
parent_point = \"0 0 150 mm\"
";
    const ELEMENTS: [(&str, &str); 6] = [
        ("nothing", ""),
        (
            "stop-of-slide",
            "[[stop]]\nname = \"e\"\njoint = \"slide\"\nlower = \"-60 mm\"\nupper = \"80 mm\"\nforce = \"100 N\"\ndepth = \"1 mm\"\n",
        ),
        (
            "stop-of-hinge",
            "[[stop]]\nname = \"e\"\njoint = \"hinge\"\nlower = \"-60 deg\"\nupper = \"90 deg\"\ntorque = \"1 N m\"\ndepth = \"1 deg\"\n",
        ),
        ("motor-of-slide", "[[motor]]\nname = \"e\"\njoint = \"slide\"\nforce = \"1 N\"\n"),
        ("motor-of-hinge", "[[motor]]\nname = \"e\"\njoint = \"hinge\"\ntorque = \"1 N m\"\n"),
        (
            "bushing",
            "[[bushing]]\nname = \"e\"\nfrom = { body = \"world\" }\nto = { body = \"arm\", at = \"115 0 0 mm\" }\nstiffness = [\"1 N/m\", 0, 0]\n",
        ),
    ];
    let folder = tempfile::tempdir().expect("a scratch folder");
    let pictures = ELEMENTS.map(|(name, text)| {
        fs::write(folder.path().join(format!("{name}.toml")), format!("{MACHINE}{text}")).expect("writable");
        let picture = Picture::read(&draw(folder.path(), &format!("{name}.toml --at 0s --size 600x450 --arrows none")));
        if let Some(keep) = std::env::var_os("KEEP_PICTURES") {
            picture.write(&Path::new(&keep).join(format!("{name}.png")));
        }
        picture
    });
    for (at, one) in pictures.iter().enumerate() {
        for (other, name) in pictures[at + 1..].iter().zip(&ELEMENTS[at + 1..]) {
            let count = one.differences(other);
            assert!(count > 2 * TOLERANCE.1, "{} and {} differ in {count} pixels only", ELEMENTS[at].0, name.0);
        }
    }
}
