//! Laws of drives in scene files: errors are located, and referenced files are read once.

use std::fs;
use std::path::Path;

use jointplay::machine::Drive;
use jointplay::scene::{DRIVE_LAWS, MAX_FILE_SIZE, Scene, SceneError};

/// A scene with one slide or hinge and its drive.
fn text(kind: &str, drive: &str) -> String {
    format!(
        "[[body]]\nname = \"a\"\nmass = \"1 kg\"\ninertia = \"1 1 1 kg m^2\"\n\
         [[joint]]\nname = \"P\"\nkind = \"{kind}\"\nchild = \"a\"\naxis = [1, 0, 0]\ndrive = {{ {drive} }}\n"
    )
}

fn parse(kind: &str, drive: &str) -> Result<Scene, SceneError> {
    Scene::parse(&text(kind, drive), Some("my.toml"), &[])
}

fn points(scene: &Scene) -> &[[f64; 2]] {
    match scene.machine.joints[0].drive.as_ref().expect("driven") {
        Drive::Table { points, .. } => points,
        other => panic!("{other:?}"),
    }
}

fn assert_contains(case: &str, error: &SceneError, fragments: &[&str]) {
    let text = error.to_string();
    for fragment in fragments {
        assert!(text.contains(fragment), "{case}\n  should say `{fragment}`, says:\n{text}");
    }
}

#[test]
fn every_law_is_read_on_slides_and_hinges() {
    for (kind, place, speed) in [("prismatic", "mm", "mm/s"), ("revolute", "deg", "rpm")] {
        for drive in [
            format!("law = \"constant\", velocity = \"1 {speed}\""),
            format!("law = \"harmonic\", amplitude = \"1 {place}\", frequency = \"1 Hz\""),
            format!("law = \"harmonics\", terms = [{{ amplitude = \"1 {place}\", frequency = \"1 Hz\" }}]"),
            format!("law = \"ramp\", to = \"1 {place}\", duration = \"1 s\""),
            format!("law = \"pulse\", height = \"1 {place}\", duration = \"1 s\""),
            format!("law = \"table\", points = [[0, 0], [\"1 s\", \"1 {place}\"]]"),
            format!("law = \"formula\", formula = \"sin(t)\", unit = \"{place}\""),
        ] {
            let scene = parse(kind, &drive).unwrap_or_else(|error| panic!("{error}"));
            let law = match scene.machine.joints[0].drive.as_ref().expect("driven") {
                Drive::Function(_) => "function",
                Drive::Constant { .. } => "constant",
                Drive::Harmonic { terms, .. } if terms.len() == 1 => "harmonic",
                Drive::Harmonic { .. } => "harmonics",
                Drive::Ramp { .. } => "ramp",
                Drive::Pulse { .. } => "pulse",
                Drive::Table { .. } => "table",
                Drive::Formula { .. } => "formula",
            };
            assert!(drive.contains(&format!("\"{law}")), "{drive}");
            assert_eq!(scene.to_toml().as_deref(), Ok(&*scene.source.text));
        }
    }
    // All but the law that needs functions.
    assert_eq!(DRIVE_LAWS.len(), 8);
}

#[test]
fn numbers_of_a_law_are_keys_and_may_be_expressions() {
    let parameter = "[[parameter]]\nname = \"bump\"\nvalue = \"4 mm\"\n";
    let drive = "law = \"pulse\", height = \"bump / 2\", start = \"1 s\", duration = \"10 ms\"";
    let text = format!("{parameter}{}", text("prismatic", drive));
    let mut scene = Scene::parse(&text, None, &[]).unwrap();
    let height = |scene: &Scene| match scene.machine.joints[0].drive {
        Some(Drive::Pulse { height, .. }) => height,
        ref other => panic!("{other:?}"),
    };
    assert_eq!(height(&scene), 2e-3);
    scene.set("parameter.bump", "6 mm").unwrap();
    assert_eq!(height(&scene), 3e-3);
    scene.set("joint.P.drive.height", "1 mm").unwrap();
    assert_eq!(height(&scene), 1e-3);
    let saved = Scene::parse(&scene.to_toml().unwrap(), None, &[]).unwrap();
    assert_eq!(height(&saved), 1e-3);
    let error = scene.set("joint.P.drive.duration", "0 s").unwrap_err();
    assert_contains("no duration", &error, &["joint.P.drive.duration", "allowed 0.001 ms to 1e9 ms; units s, ms"]);
}

/// Position that a formula prescribes at `t`, s, in a scene with the parameters `own`.
fn formula(parameters: &str, kind: &str, drive: &str, t: f64) -> f64 {
    let text = format!("{parameters}{}", text(kind, drive));
    let scene = Scene::parse(&text, None, &[]).unwrap_or_else(|error| panic!("{error}"));
    position(&scene, t)
}

fn position(scene: &Scene, t: f64) -> f64 {
    match scene.machine.joints[0].drive.as_ref().expect("driven") {
        Drive::Formula { program, scale, .. } => scale * program.eval(&[t]),
        other => panic!("{other:?}"),
    }
}

const PARAMETERS: &str = "[[parameter]]\nname = \"stroke\"\nvalue = \"20 mm\"\n\
                   [[parameter]]\nname = \"rate\"\nvalue = \"3 Hz\"\n\
                   [[parameter]]\nname = \"lift\"\nvalue = \"30 deg\"\n\
                   [[parameter]]\nname = \"part\"\nvalue = 0.5\n";

#[test]
fn a_formula_may_be_one_of_the_scenes_parameters() {
    let t = 0.07;
    for (kind, drive, expected) in [
        (
            "prismatic",
            "formula = \"stroke * sin(2*pi*rate*t + lift)\"",
            0.02 * libm::sin(2.0 * std::f64::consts::PI * 3.0 * t + 30f64.to_radians()),
        ),
        // Dimensionless parameters are plain numbers.
        ("prismatic", "formula = \"10 * part * t\", unit = \"mm\"", 5e-3 * t),
        (
            "revolute",
            "formula = \"lift * (1 - exp(-t / 20 ms)) * part\"",
            30f64.to_radians() * (1.0 - libm::exp(-t / 0.02)) * 0.5,
        ),
        ("prismatic", "formula = \"3 mm + 2 m/s^2 * t^2\"", 3e-3 + 2.0 * t * t),
        ("prismatic", "formula = \"stroke\"", 0.02),
        // Constants are folded: the derivative of asin(1) is 0, not infinite.
        ("revolute", "formula = \"asin(2 * part) * rate * t\"", 1.5 * std::f64::consts::PI * t),
    ] {
        let value = formula(PARAMETERS, kind, &format!("law = \"formula\", {drive}"), t);
        assert!((value - expected).abs() < 1e-14, "{drive}: {value} {expected}");
    }
    let text = format!("{PARAMETERS}{}", text("prismatic", "law = \"formula\", formula = \"stroke * t / 1 s\""));
    let mut scene = Scene::parse(&text, None, &[]).unwrap();
    assert_eq!(position(&scene, 1.0), 0.02);
    scene.set("parameter.stroke", "5 mm").unwrap();
    assert_eq!(position(&scene, 1.0), 5e-3);
    assert_eq!(scene.undo_change("parameter.stroke").map(|_| ()), Ok(()));
    assert_eq!(position(&scene, 1.0), 0.02);
    for (drive, fragments) in [
        (
            "formula = \"stroke * sin(3*t)\"",
            &["joint.P.drive.formula", "a function of a quantity that is not a pure number"][..],
        ),
        ("formula = \"stroke + t\"", &["adds or compares quantities of different dimensions"]),
        ("formula = \"rate * t\"", &["which is not in m; units m, cm, mm"]),
        (
            "formula = \"stroke * rate * t\", unit = \"mm\"",
            &["joint.P.drive.unit", "a formula with quantities has its own unit"],
        ),
        ("formula = \"strok * rate * t\"", &["my.toml:22:39", "no variable `strok` (did you mean `stroke`?)"]),
        ("formula = \"max(stroke, 2 mm)\"", &["`max` has no second derivative"]),
        ("formula = \"stroke / (rate * t)\"", &["is not a finite number"]),
    ] {
        let text = format!("{PARAMETERS}{}", self::text("prismatic", &format!("law = \"formula\", {drive}")));
        let error = Scene::parse(&text, Some("my.toml"), &[]).expect_err(drive);
        assert_contains(drive, &error, fragments);
    }
}

#[test]
fn errors_in_a_drive_law_are_located() {
    let cases: &[(&str, &[&str])] = &[
        (
            "law = \"ramps\", to = 1",
            &[
                "my.toml:10:17",
                "joint.P.drive.law = \"ramps\"",
                "did you mean `ramp`?",
                "allowed function, constant, harmonic, harmonics, ramp, pulse, table, formula",
            ],
        ),
        ("to = \"1 mm\"", &["joint.P.drive.law", "missing"]),
        ("law = \"ramp\", duration = \"1 s\"", &["joint.P.drive.to", "missing", "to = \"10 mm\""]),
        (
            "law = \"ramp\", to = \"1 mm\", duration = \"0 s\"",
            &["joint.P.drive.duration = \"0 s\"", "allowed 1e-6 s to 1000000 s; units s, ms"],
        ),
        ("law = \"ramp\", to = \"1 mm\", duration = \"1 mm\"", &["wrong unit `mm`"]),
        (
            "law = \"ramp\", to = \"1 mm\", duration = \"1 s\", height = \"1 mm\"",
            &["joint.P.drive.height", "unknown key", "allowed here: law, from, to, start, duration"],
        ),
        (
            "law = \"pulse\", height = \"1 deg\", duration = \"1 s\"",
            &["joint.P.drive.height = \"1 deg\"", "wrong unit `deg`"],
        ),
        ("law = \"harmonics\"", &["joint.P.drive.terms", "missing"]),
        ("law = \"harmonics\", terms = []", &["joint.P.drive.terms = []", "needs a term"]),
        ("law = \"harmonics\", terms = [{ amplitude = \"1 mm\" }]", &["joint.P.drive.terms[0].frequency", "missing"]),
        (
            "law = \"harmonics\", terms = [{ amplitude = \"1 mm\", frequency = 0 }]",
            &["joint.P.drive.terms[0].frequency = 0", "above 0 up to 10000 Hz"],
        ),
        ("law = \"table\"", &["joint.P.drive.points", "missing", "[[\"0 s\", \"0 mm\"], [\"1 s\", \"10 mm\"]]"]),
        ("law = \"table\", points = [[0, 0]]", &["joint.P.drive.points", "has 1 points; allowed 2 to 10000"]),
        (
            "law = \"table\", points = [[0, 0], [\"1 s\"]]",
            &["joint.P.drive.points[1]", "a time and a position, has 1 values"],
        ),
        (
            "law = \"table\", points = [[0, 0], [\"1 s\", 0], [\"1 s\", 0]]",
            &["joint.P.drive.points[2][0] = \"1 s\"", "times must rise, by at least 1 us"],
        ),
        ("law = \"table\", points = [[0, 0], [\"1 s\", 3]]", &["joint.P.drive.points[1][1] = 3", "needs a unit"]),
        (
            "law = \"table\", repeat = true, points = [[0, 0], [\"1 s\", \"1 mm\"], [\"2 s\", \"2 mm\"]]",
            &["joint.P.drive.points", "the last position must be the first"],
        ),
        ("law = \"table\", repeat = true, points = [[0, 0], [\"1 s\", 0]]", &["has 2 points; allowed 3 to 10000"]),
        (
            "law = \"table\", interpolation = \"linear\", points = [[0, 0], [\"1 s\", 0]]",
            &["joint.P.drive.interpolation = \"linear\"", "is not one of the choices", "allowed spline, monotone"],
        ),
        (
            "law = \"table\", interpolation = \"cubic\", points = [[0, 0], [\"1 s\", 0]]",
            &["joint.P.drive.interpolation = \"cubic\"", "allowed spline, monotone"],
        ),
        (
            "law = \"table\", repeat = 1, points = [[0, 0], [\"1 s\", 0]]",
            &["joint.P.drive.repeat = 1", "true or false"],
        ),
        (
            "law = \"table\", file = \"a.csv\", points = [[0, 0], [\"1 s\", 0]]",
            &["joint.P.drive.file", "`points` are given as well"],
        ),
        (
            "law = \"table\", file = \"a.csv\"",
            &["my.toml:10:", "joint.P.drive.file = \"a.csv\"", "has no folder", "written into the scene itself"],
        ),
        ("law = \"formula\"", &["joint.P.drive.formula", "missing"]),
        (
            "law = \"formula\", formula = \"sin(2*pi*f*t)\"",
            &["my.toml:10:48", "joint.P.drive.formula", "no variable `f`"],
        ),
        ("law = \"formula\", formula = \"sine(t)\"", &["no function `sine` (did you mean `sin`?)"]),
        ("law = \"formula\", formula = \"(1 + t\"", &["ends where an operator or `)` is expected"]),
        ("law = \"formula\", formula = \"0.1 * abs(t)\"", &["my.toml:10:45", "`abs` has no second derivative"]),
        ("law = \"formula\", formula = \"1/t\"", &["has no finite position at t = 0"]),
        ("law = \"formula\", formula = \"t^0.5\"", &["has no finite speed at t = 0"]),
        ("law = \"formula\", formula = \"t^1.5\"", &["has no finite acceleration at t = 0"]),
        ("law = \"formula\", formula = \"t\", unit = \"deg\"", &["joint.P.drive.unit = \"deg\"", "wrong unit `deg`"]),
        (
            "law = \"formula\", formula = \"t\", resolve = \"2 s\"",
            &["joint.P.drive.resolve = \"2 s\"", "allowed 1e-6 s to 1 s"],
        ),
        ("law = \"formula\", formula = 3", &["joint.P.drive.formula = 3", "a text in quotes"]),
    ];
    for (drive, fragments) in cases {
        match parse("prismatic", drive) {
            Ok(_) => panic!("`{drive}` was accepted"),
            Err(error) => assert_contains(drive, &error, fragments),
        }
    }
    let many = vec!["{ amplitude = 0, frequency = \"1 Hz\" }"; 101].join(", ");
    let error = parse("prismatic", &format!("law = \"harmonics\", terms = [{many}]")).unwrap_err();
    assert_contains("101 terms", &error, &["too many: 101 terms; allowed at most 100"]);
    let error = parse("revolute", "law = \"ramp\", duration = \"1 s\"").unwrap_err();
    assert_contains("a hinge", &error, &["to = \"10 deg\""]);
}

fn in_folder(folder: &Path, csv: &[u8], name: &str) -> Result<Scene, SceneError> {
    fs::write(folder.join("bump.csv"), csv).unwrap();
    let scene = folder.join("scene.toml");
    fs::write(&scene, text("prismatic", &format!("law = \"table\", file = \"{name}\""))).unwrap();
    Scene::load(&scene, &[])
}

#[test]
fn a_referenced_file_is_read_once() {
    let folder = tempfile::tempdir().unwrap();
    let expected = [[0.0, 0.0], [0.01, 1e-3], [0.02, 0.0]];
    for csv in [
        "time_s,position_m\n0,0\n0.01,1e-3\n0.02,0\n",
        "\u{feff}t [ms]; z [mm]\r\n# measured\r\n0; 0\r\n\r\n10; 1\r\n20; 0\r\n",
        "t_ms\tbump height (um)\n0\t0\n10\t1000\n20\t0",
    ] {
        let mut scene = in_folder(folder.path(), csv.as_bytes(), "bump.csv").unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(points(&scene), expected, "{csv}");
        // Changes do not read the file again.
        fs::write(folder.path().join("bump.csv"), "gone").unwrap();
        scene.set("formulation", "lagrange").unwrap();
        let saved = scene.to_toml().unwrap();
        assert!(saved.contains("lagrange") && saved.contains("bump.csv"));
        scene.undo_change("formulation").unwrap();
        scene.set("body.a.mass", "2 kg").unwrap();
        assert_eq!(points(&scene), expected);
        assert_eq!(&*scene.source.beside["bump.csv"], csv);
    }
    fs::create_dir(folder.path().join("data")).unwrap();
    fs::write(folder.path().join("data/bump.csv"), "t_s,x_m\n0,0\n1,1\n").unwrap();
    let scene = in_folder(folder.path(), b"", "data/bump.csv").unwrap();
    assert_eq!(points(&scene), [[0.0, 0.0], [1.0, 1.0]]);
}

#[test]
fn errors_in_a_referenced_file_name_that_file() {
    let folder = tempfile::tempdir().unwrap();
    let cases: &[(&[u8], &[&str])] = &[
        (b"", &["joint.P.drive.file = \"bump.csv\"", "has 0 points"]),
        (b"0,0\n1,1\n", &["bump.csv:1:1", "name the columns with their units, as in `time_s`; units s, ms"]),
        (b"time_s,angle_deg\n0,0\n", &["bump.csv:1:8", "as in `position_mm`; units m, cm, mm"]),
        (b"time_s,x_m\n0,0,0\n", &["bump.csv:2:1", "needs two columns", "has 3"]),
        (b"time_s,x_m\n0,zero\n", &["bump.csv:2:3: x_m = zero", "is not a number; the unit belongs in the header"]),
        (b"time_s,x_m\n0,0 mm\n", &["bump.csv:2:3", "is not a number"]),
        (b"time_s,x_m\n0,nan\n", &["bump.csv:2:3", "finite"]),
        (b"time_s,x_m\n0,1e9\n", &["bump.csv:2:3", "allowed -1000000 m to 1000000 m"]),
        (b"time_s,x_m\n0,0\n\n 0 ,1\n", &["bump.csv:4:2", "times must rise"]),
        (b"time_s,x_m\n0,0\n", &["has 1 points"]),
        (b"time_s,x_m\n0,\xff\n", &["joint.P.drive.file", "not valid UTF-8"]),
    ];
    for (csv, fragments) in cases {
        let case = String::from_utf8_lossy(csv);
        match in_folder(folder.path(), csv, "bump.csv") {
            Ok(_) => panic!("`{case}` was accepted"),
            Err(error) => assert_contains(&case, &error, fragments),
        }
    }
    for (name, why) in [
        ("bumps.csv", "cannot read this file"),
        ("../bump.csv", "is not a file beside the scene"),
        ("/etc/hostname", "is not a file beside the scene"),
        ("", "is not a file beside the scene"),
        (".", "is not a file beside the scene"),
    ] {
        let error = in_folder(folder.path(), b"", name).unwrap_err();
        assert_contains(name, &error, &["scene.toml:10:", "joint.P.drive.file", why]);
    }
    fs::create_dir(folder.path().join("data")).unwrap();
    let error = in_folder(folder.path(), b"", "data").unwrap_err();
    assert_contains("a folder", &error, &["this is a directory"]);
    let large = vec![b'#'; MAX_FILE_SIZE as usize + 1];
    let error = in_folder(folder.path(), &large, "bump.csv").unwrap_err();
    assert_contains("a large file", &error, &["too large; allowed at most 4 MiB"]);
    let mut many = String::from("t_s,x_m\n");
    for n in 0..=10_000 {
        many += &format!("{n},0\n");
    }
    let error = in_folder(folder.path(), many.as_bytes(), "bump.csv").unwrap_err();
    assert_contains("many points", &error, &["bump.csv:10002:1", "too many points; allowed at most 10000"]);
}
