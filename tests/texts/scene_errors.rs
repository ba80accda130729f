//! Every error in a scene names its position, the key, the value and the allowed range.

use jointplay::scene::{BUILT_IN, Scene, SceneError};

/// A valid scene of one rod on one ball joint; each case below breaks one line of it.
const GOOD: &str = r#"name = "test"
start = "as-given"
[contact]
clearance = "0.3 mm"
friction = 0.15
[[body]]
name = "rod"
mass = "0.384 kg"
inertia = "1.92e-3 1.92e-3 1.58e-5 kg m^2"
shapes = [{ form = "sphere", centre = "0 0 1 mm", radius = "4 mm", role = "driven-rod" }]
[[joint]]
name = "free"
kind = "free"
child = "rod"
start = { position = [0, 0, "-100 mm"] }
[[ball_joint]]
name = "S1"
socket = { body = "world" }
ball = { body = "rod", at = "0 0 100 mm" }
restitution = 0.9
"#;

fn parse(text: &str) -> Result<Scene, SceneError> {
    Scene::parse(text, Some("my.toml"), &[])
}

/// Checks that `error` contains every fragment.
fn assert_contains(case: &str, error: &SceneError, fragments: &[&str]) {
    let text = error.to_string();
    for fragment in fragments {
        assert!(text.contains(fragment), "{case}\n  should say `{fragment}`, says:\n{text}");
    }
}

#[test]
fn the_unbroken_scene_is_read() {
    let scene = parse(GOOD).unwrap();
    assert_eq!(scene.machine.bodies[0].mass, 0.384);
    assert_eq!(scene.overrides(0), ["restitution"]);
}

#[test]
fn an_unknown_law_or_role_is_reported_before_its_keys() {
    let text = jointplay::scene::built_in_text("slider-crank-driven").unwrap();
    for (right, wrong, words) in [
        (
            "law = \"constant\"",
            "law = \"sinus\", speed = \"3 Hz\"",
            ["drive.law = \"sinus\"", "allowed function, constant, harmonic"],
        ),
        ("role = \"frame\"", "role = \"fame\"\ncolour = \"red\"", ["role = \"fame\"", "did you mean `frame`"]),
    ] {
        let broken = text.replacen(right, wrong, 1);
        assert_ne!(broken, text, "{right}");
        assert_contains(wrong, &parse(&broken).unwrap_err(), &words);
    }
}

#[test]
fn every_broken_line_is_reported_with_its_remedy() {
    // (correct line, broken line, fragments of the error)
    let cases: &[(&str, &str, &[&str])] = &[
        (
            "friction = 0.15",
            "fricton = 0.15",
            &["my.toml:5:1", "contact.fricton", "unknown key", "did you mean `friction`"],
        ),
        ("mass = \"0.384 kg\"", "mas = \"0.384 kg\"", &["my.toml:8:1", "body.rod.mas", "did you mean `mass`"]),
        (
            "clearance = \"0.3 mm\"",
            "clearance = \"0.3 kg\"",
            &[
                "my.toml:4:13",
                "contact.clearance = \"0.3 kg\"",
                "wrong unit `kg` (a unit of mass)",
                "m, cm, mm, um",
                "0 mm to below the ball radius",
            ],
        ),
        (
            "clearance = \"0.3 mm\"",
            "clearance = 0.3",
            &["my.toml:4:13", "contact.clearance = 0.3", "needs a unit", "mm"],
        ),
        (
            "clearance = \"0.3 mm\"",
            "clearance = \"-1 mm\"",
            &[
                "my.toml:4:13",
                "contact.clearance = \"-1 mm\"",
                "out of range",
                "0 mm to below the ball radius",
                "units m",
            ],
        ),
        ("clearance = \"0.3 mm\"", "clearance = nan", &["my.toml:4:13", "contact.clearance = nan", "finite"]),
        ("clearance = \"0.3 mm\"", "clearance = \"inf mm\"", &["my.toml:4:13", "finite"]),
        (
            "clearance = \"0.3 mm\"",
            "clearance = \"12 mm\"",
            &["my.toml:4:13", "contact.clearance = \"12 mm\"", "below the ball radius, 10 mm", "mm, um"],
        ),
        ("clearance = \"0.3 mm\"", "clearance = \"10 mm\"", &["my.toml:4:13", "below the ball radius"]),
        ("clearance = \"0.3 mm\"", "clearance = true", &["my.toml:4:13", "must be a number or a text, not a boolean"]),
        (
            "friction = 0.15",
            "friction_velocity = \"printed\"",
            &[
                "my.toml:5:21",
                "contact.friction_velocity = \"printed\"",
                "is gone: use centres",
                "allowed centres, surface",
            ],
        ),
        ("friction = 0.15", "friction = inf", &["my.toml:5:12", "contact.friction = inf", "finite", "0 to 10"]),
        ("friction = 0.15", "friction = \"0.15 mm\"", &["my.toml:5:12", "pure number"]),
        ("friction = 0.15", "friction = 11", &["my.toml:5:12", "contact.friction = 11", "allowed 0 to 10"]),
        (
            "friction = 0.15",
            "normal_law = \"herz\"",
            &["my.toml:5:14", "contact.normal_law", "did you mean `hertz`", "lankarani-nikravesh"],
        ),
        (
            "restitution = 0.9",
            "clearance = \"12 mm\"",
            &["my.toml:20:13", "joint.S1.clearance = \"12 mm\"", "below the ball radius, 10 mm"],
        ),
        (
            "restitution = 0.9",
            "ball_radius = \"0.2 mm\"",
            &["my.toml:20:15", "joint.S1.ball_radius", "below the ball radius, 0.2 mm"],
        ),
        (
            "restitution = 0.9",
            "restitution = 0\nnormal_law = \"flores\"",
            &["my.toml:20:15", "joint.S1.restitution = 0", "flores divides by", "above 0 to 1"],
        ),
        (
            "restitution = 0.9",
            "slip_speed_low = \"1 mm/s\"",
            &["my.toml:20:18", "joint.S1.slip_speed_low", "below slip_speed_high 0.1 mm/s"],
        ),
        ("restitution = 0.9", "gap = 1", &["my.toml:20:1", "joint.S1.gap", "unknown key", "clearance"]),
        ("mass = \"0.384 kg\"", "mass = 0", &["my.toml:8:8", "body.rod.mass = 0", "above 0", "kg"]),
        ("mass = \"0.384 kg\"", "mass = \"-2 kg\"", &["my.toml:8:8", "body.rod.mass = \"-2 kg\"", "above 0"]),
        ("mass = \"0.384 kg\"\n", "", &["my.toml:6:1", "body.rod.mass", "missing", "0.384 kg"]),
        (
            "inertia = \"1.92e-3 1.92e-3 1.58e-5 kg m^2\"",
            "inertia = \"1e-3 1e-3 3e-3 kg m^2\"",
            &["my.toml:9:11", "body.rod.inertia", "no body has this inertia", "0.003 kg m^2", "0.002 kg m^2"],
        ),
        (
            "inertia = \"1.92e-3 1.92e-3 1.58e-5 kg m^2\"",
            "inertia = \"1e-3 1e-3 0 kg m^2\"",
            &["body.rod.inertia", "above 0"],
        ),
        (
            "inertia = \"1.92e-3 1.92e-3 1.58e-5 kg m^2\"",
            "inertia = \"1e-3 1e-3 1e-3 kg m^2\"\nproducts = \"2e-3 0 0 kg m^2\"",
            &["body.rod.inertia", "no body has this inertia", "-0.001 kg m^2"],
        ),
        (
            "inertia = \"1.92e-3 1.92e-3 1.58e-5 kg m^2\"",
            "inertia = \"1e-3 1e-3 kg m^2\"",
            &["my.toml:9:11", "body.rod.inertia", "needs 3 numbers", "has 2 numbers"],
        ),
        (
            "inertia = \"1.92e-3 1.92e-3 1.58e-5 kg m^2\"",
            "inertia = [\"1e-3 kg m^2\", \"1e-3 kg m^2\"]",
            &["needs 3 values, has 2"],
        ),
        ("form = \"sphere\"", "form = \"shere\"", &["my.toml:10:20", "did you mean `sphere`"]),
        // An unknown form would make its other keys unknown, too: only the form is reported.
        (
            "form = \"sphere\"",
            "form = \"torus\", bore = \"1 mm\"",
            &["body.rod.shapes[0].form = \"torus\"", "allowed capsule, cylinder, cone, box, sphere, plate"],
        ),
        ("form = \"sphere\"", "form = \"sphere\", bore = \"1 mm\"", &["shapes[0].bore", "unknown key"]),
        (
            "kind = \"free\"",
            "kind = \"planar\"\nstiffness = 3",
            &["joint.free.kind = \"planar\"", "allowed fixed, prismatic, revolute, free"],
        ),
        ("radius = \"4 mm\"", "radius = \"-4 mm\"", &["body.rod.shapes[0].radius", "above 0"]),
        ("centre = \"0 0 1 mm\"", "size = \"1 1 1 mm\"", &["body.rod.shapes[0].size", "a sphere has centre, radius"]),
        ("role = \"driven-rod\"", "role = \"rod\"", &["body.rod.shapes[0].role", "driven-rod"]),
        (
            "kind = \"free\"",
            "kind = \"ball\"",
            &["my.toml:13:8", "joint.free.kind = \"ball\"", "fixed, prismatic, revolute, free"],
        ),
        ("kind = \"free\"", "kind = \"revolute\"\naxis = [0, 0, 0]", &["my.toml:", "joint.free"]),
        (
            "child = \"rod\"",
            "child = \"rot\"",
            &["my.toml:14:9", "joint.free.child = \"rot\"", "no body `rot`", "did you mean `rod`"],
        ),
        ("start = { position = [0, 0, \"-100 mm\"] }\n", "", &["my.toml:11:1", "joint.free.start", "missing"]),
        (
            "start = { position = [0, 0, \"-100 mm\"] }",
            "start = { position = [0, 0, \"-100 s\"] }",
            &["my.toml:15:29", "joint.free.start.position.z", "wrong unit `s`"],
        ),
        (
            "start = { position = [0, 0, \"-100 mm\"] }",
            "start = { position = [0, 0] }",
            &["joint.free.start.position", "needs 3 values, has 2"],
        ),
        (
            "socket = { body = \"world\" }",
            "socket = { body = \"wold\" }",
            &["my.toml:18:19", "joint.S1.socket.body = \"wold\"", "no body `wold`", "did you mean `world`"],
        ),
        ("socket = { body = \"world\" }", "socket = { body = \"rod\" }", &["joint.S1.ball", "same body"]),
        ("socket = { body = \"world\" }\n", "", &["my.toml:16:1", "joint.S1.socket", "missing"]),
        ("name = \"S1\"", "name = \"S.1\"", &["my.toml:17:8", "joint.S.1.name", "is not a name"]),
        ("name = \"S1\"", "name = \"free\"", &["my.toml:17:8", "already a joint of this name, in line 12"]),
        ("start = \"as-given\"", "start = \"idea\"", &["my.toml:2:9", "did you mean `ideal`"]),
        (
            "start = \"as-given\"",
            "formulation = \"trees\"",
            &["my.toml:2:15", "formulation = \"trees\"", "did you mean `tree`"],
        ),
        ("start = \"as-given\"", "chain.links = 0", &["my.toml:2:1", "chain:", "unknown key"]),
        (
            "start = \"as-given\"",
            "parameter = [{ name = \"n\", key = \"chain.links\", value = 0, whole = true, range = [1, 4096] }]",
            &["my.toml:2:57", "chain.links = 0", "allowed 1 to 4096"],
        ),
        (
            "start = \"as-given\"",
            "parameter = [{ name = \"n\", key = \"chain.links\", value = 2.5, whole = true }]",
            &["chain.links = 2.5", "whole number"],
        ),
        (
            "start = \"as-given\"",
            "parameter = [{ name = \"n\", key = \"contact.friction\", value = 2 }]",
            &["parameter.n.key = \"contact.friction\"", "is not a key", "not first a key of the file"],
        ),
        (
            "start = \"as-given\"",
            "parameter = [{ name = \"n\", value = \"2 mm\", whole = true }]",
            &["parameter.n.whole = true", "a whole number has no unit"],
        ),
        (
            "start = \"as-given\"",
            "joint_contact = [{ name = \"S9\", friction = 0.1 }]",
            &["my.toml:2:27", "joint_contact.S9.name", "no joint with play `S9`", "joints with play: S1"],
        ),
        (
            "start = \"as-given\"",
            "gravity.z = \"9.81 m/s\"",
            &["my.toml:2:13", "gravity.z", "wrong unit `m/s` (a unit of speed)"],
        ),
        ("start = \"as-given\"", "solver.step = \"1 s\"", &["solver.step = \"1 s\"", "0.1 us to 10000 us"]),
        ("start = \"as-given\"", "view.down = \"down\"", &["view.down", "+x, -x, +y, -y, +z, -z"]),
        (
            "start = \"as-given\"",
            "output.body = \"rop\"",
            &["my.toml:2:15", "output.body = \"rop\"", "did you mean `rod`"],
        ),
        ("start = \"as-given\"", "start = ", &["my.toml:2:", "not valid TOML"]),
        ("[contact]", "[contact", &["my.toml:3:", "not valid TOML"]),
        ("friction = 0.15", "clearance = 0", &["my.toml:5:1", "duplicate key"]),
        ("[contact]", "[contacts]", &["my.toml:3:2", "contacts", "did you mean `contact`"]),
    ];
    for (good, bad, fragments) in cases {
        assert!(GOOD.contains(good), "the case `{good}` breaks nothing");
        match parse(&GOOD.replacen(good, bad, 1)) {
            Ok(_) => panic!("`{bad}` was accepted"),
            Err(error) => assert_contains(bad, &error, fragments),
        }
    }
}

#[test]
fn additions_that_contradict_the_scene_are_refused() {
    let body = "[[body]]\nname = \"arm\"\nmass = \"1 kg\"\ninertia = \"1 1 1 kg m^2\"\n";
    let cases: &[(&str, &[&str])] = &[
        (
            "[[body]]\nname = \"rod\"\nmass = \"1 kg\"\ninertia = \"1 1 1 kg m^2\"\n",
            &["my.toml:22:8", "already a body of this name, in line 7"],
        ),
        (body, &["my.toml:21:1", "body.arm", "no [[joint]] has this body as its child", "ball_joint"]),
        (
            "[[joint]]\nname = \"again\"\nkind = \"free\"\nchild = \"rod\"\nstart = { position = \"0 0 0 m\" }\n",
            &["my.toml:24:9", "joint.again.child", "is already the child of joint `free`", "[[ball_joint]]"],
        ),
        (
            &format!(
                "{body}[[joint]]\nname = \"hinge\"\nkind = \"revolute\"\nparent = \"arm\"\nchild = \"arm\"\naxis = [0, 0, 1]\n"
            ),
            &["joint.hinge.parent", "cycle", "[[ball_joint]]"],
        ),
        (
            &format!("{body}[[joint]]\nname = \"hinge\"\nkind = \"revolute\"\nchild = \"arm\"\naxis = [0, 0, 0]\n"),
            &["my.toml:29:8", "joint.hinge.axis = [0, 0, 0]", "must not be zero"],
        ),
        (
            &format!("{body}[[joint]]\nname = \"hinge\"\nkind = \"revolute\"\nchild = \"arm\"\n"),
            &["my.toml:25:1", "joint.hinge.axis", "missing"],
        ),
        (
            &format!(
                "{body}[[joint]]\nname = \"slide\"\nkind = \"prismatic\"\nchild = \"arm\"\naxis = [1, 0, 0]\ndrive = {{ law = \"function\", function = \"f\" }}\n"
            ),
            &["joint.slide.drive.function = \"f\"", "no such function", "[closed_form]"],
        ),
        (
            &format!(
                "{body}[[joint]]\nname = \"slide\"\nkind = \"prismatic\"\nchild = \"arm\"\naxis = [1, 0, 0]\ndrive = {{ law = \"constant\", velocity = \"6 rad/s\" }}\n"
            ),
            &["joint.slide.drive.velocity = \"6 rad/s\"", "a unit of angular speed"],
        ),
        (
            &format!(
                "{body}[[joint]]\nname = \"hinge\"\nkind = \"revolute\"\nchild = \"arm\"\naxis = [1, 0, 0]\nrotation = {{ axis = [1, 0, 0] }}\n"
            ),
            &["joint.hinge.rotation.angle", "missing"],
        ),
        (
            &format!(
                "{body}[[joint]]\nname = \"hinge\"\nkind = \"revolute\"\nchild = \"arm\"\naxis = [1, 0, 0]\nrotation = {{ axis = [1, 0, 0], quaternion = [1, 0, 0, 0] }}\n"
            ),
            &["joint.hinge.rotation", "exactly one form"],
        ),
    ];
    for (more, fragments) in cases {
        match parse(&format!("{GOOD}{more}")) {
            Ok(_) => panic!("`{more}` was accepted"),
            Err(error) => assert_contains(more, &error, fragments),
        }
    }
}

#[test]
fn errors_in_functions_of_a_closed_form_name_the_function() {
    let text = jointplay::scene::built_in_text("spcmm").unwrap();
    let cases: [(&str, &str, &[&str]); 9] = [
        (
            "function = \"f1\"",
            "function = \"f4\"",
            &["joint.P1.drive.function = \"f4\"", "no such function; allowed phase, across", "root1, root2"],
        ),
        ("function = \"f1\"", "function = \"root1\"", &["joint.P1.drive.function", "m^2, which is not in m"]),
        (
            "\"y + hinge_radius*cosine\"",
            "\"z + hinge_radius*cosine\"",
            &["closed_form.functions[6].formula", "no variable `z`"],
        ),
        ("\"c*c + 1\"", "\"c*y + 1\"", &["closed_form.functions[10].formula", "adds or compares"]),
        (
            "name = \"over\"",
            "name = \"gamma\"",
            &["closed_form.functions[9].name", "already a parameter or a function"],
        ),
        ("name = \"over\"", "name = \"mm\"", &["closed_form.functions[9].name", "cannot name a function"]),
        ("z = \"z\"", "", &["closed_form.z", "missing"]),
        ("angle = \"beta\"", "angle = \"across\"", &["closed_form.turns[0].angle", "which is not in rad"]),
        ("frequency = \"frequency\"", "frequency = \"-1 Hz\"", &["closed_form.frequency", "allowed 0 Hz to"]),
    ];
    for (from, to, words) in cases {
        assert_eq!(text.matches(from).count(), 1, "{from}");
        assert_contains(to, &parse(&text.replace(from, to)).unwrap_err(), words);
    }
}

#[test]
fn changes_are_refused_with_key_value_and_range() {
    let cases: &[(&str, &str, &str, &[&str])] = &[
        ("spcmm", "contact.clearance", "12 mm", &["contact.clearance = 12 mm", "below the ball radius, 10 mm"]),
        ("spcmm", "contact.clearance", "0.3", &["contact.clearance = 0.3", "needs a unit", "mm"]),
        ("spcmm", "contact.clearence", "0.3mm", &["contact.clearence = 0.3mm", "did you mean `contact.clearance`"]),
        ("spcmm", "clearance", "0.3mm", &["did you mean `contact.clearance`"]),
        ("spcmm", "joint.S4.clearance", "0.3mm", &["joint.S4.clearance", "no joint with play `S4`", "S1, S2, S3"]),
        ("spcmm", "joint.S1.clearence", "0.3mm", &["did you mean `joint.S1.clearance`"]),
        ("chain", "parameter.links", "3", &["did you mean `chain.links`"]),
        ("spcmm", "clearence", "0.3mm", &["clearence", "did you mean `contact.clearance`"]),
        (
            "slider-crank-driven",
            "joint.crank.drive.velocit",
            "7 rad/s",
            &[
                "`crank` is not a joint with play, and the file gives no such number of it (did you mean `joint.crank.drive.velocity`?)",
                "Joints with play, B, C, have joint.<joint>.<key>; keys: clearance, friction,",
            ],
        ),
        ("spcmm", "chain.links", "4", &["chain.links = 4", "unknown key"]),
        ("chain", "chain.links", "-4", &["chain.links = -4", "allowed 1 to 4096"]),
        ("pendulum", "spcmm.frequency", "1 Hz", &["spcmm.frequency = 1 Hz", "unknown key"]),
        ("spcmm", "spcmm.frequency", "51 Hz", &["allowed 0 Hz to 50 Hz"]),
        ("spcmm", "solver.method", "rk5", &["did you mean `rk4`", "dopri5"]),
        ("spcmm", "solver.method", "semi-implicit-euler", &["is gone: use rk4", "allowed discrete-gradient"]),
        ("spcmm", "contact.friction_velocity", "printed", &["is gone: use centres", "allowed centres, surface"]),
        (
            "spcmm",
            "joint.S2.friction_velocity",
            "printed",
            &["joint.S2.friction_velocity = printed: is gone: use centres"],
        ),
        ("spcmm", "solver.preset", "", &["preview"]),
        ("spcmm", "joint.S2.ball_radius", "0.3 mm", &["joint.S2.ball_radius = 0.3 mm", "below the ball radius"]),
    ];
    for (scene, key, value, fragments) in cases {
        let change = [((*key).to_owned(), (*value).to_owned())];
        let error = Scene::load(scene, &change).expect_err("a bad change was accepted");
        assert_eq!(error.position, None, "{error}");
        assert_contains(&format!("{key}={value}"), &error, fragments);
        // The same change of a running scene leaves it as it was.
        let mut live = Scene::load(scene, &[]).unwrap();
        let before = format!("{live:?}");
        let error = live.set(key, value).expect_err("a bad change was accepted");
        assert_contains(&format!("live {key}={value}"), &error, fragments);
        assert_eq!(format!("{live:?}"), before);
    }
}

#[test]
fn a_file_that_is_not_a_scene_is_reported_as_such() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let write = |name: &str, bytes: &[u8]| {
        std::fs::write(path(name), bytes).unwrap();
        path(name)
    };
    let load = |name: &str| Scene::load(name, &[]).expect_err("this is no scene");

    let empty = write("empty.toml", b" \n");
    assert_contains("empty", &load(&empty), &[&empty, "the file is empty"]);
    let only_text = write("comment.toml", b"# nothing\n");
    assert_contains("no body", &load(&only_text), &["at least one [[body]]"]);
    let junk = write("junk.toml", b"name = \"x\"\n\x7fELF\xff\xfe\x00");
    assert_contains("binary", &load(&junk), &["junk.toml:2:5", "not valid UTF-8"]);
    let zeros = write("zeros.toml", &[0; 4096]);
    assert_contains("zeros", &load(&zeros), &["zeros.toml:1:", "not valid TOML"]);
    let huge = write("huge.toml", &vec![b'#'; (4 << 20) + 1]);
    assert_contains("huge", &load(&huge), &["too large", "4 MiB"]);
    let deep = write("deep.toml", format!("a = {}", "[".repeat(100_000)).as_bytes());
    assert_contains("deep", &load(&deep), &["deep.toml:1:", "not valid TOML"]);

    let directory = format!("{}/", folder.path().to_str().unwrap());
    let error = load(&directory);
    assert!(error.unreadable);
    assert_contains("directory", &error, &["is a directory"]);
    let error = load(&path("missing.toml"));
    assert!(error.unreadable);
    assert_contains("missing", &error, &["missing.toml", "cannot read"]);
    let error = load("spcm");
    assert!(!error.unreadable);
    assert_contains("misspelt", &error, &["no built-in scene `spcm`", "did you mean `spcmm`", "pendulum"]);
    assert_contains(
        "misspelt benchmark",
        &load("squeezr"),
        &["did you mean `squeezer`", "built in: measuring-machine, spcmm"],
    );
    assert_contains("misspelt file", &load("slider-crnk.toml"), &["did you mean `slider-crank`"]);
    // A file of one's own is no slip of a built-in name.
    for own in ["card.toml", "my/mine.toml", "chains-of-mine.toml"] {
        assert!(!load(own).to_string().contains("did you mean"), "{own}");
    }
}

#[test]
fn a_damaged_file_never_panics_and_its_error_has_a_place() {
    for name in BUILT_IN {
        let text = jointplay::scene::built_in_text(name).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        let written = lines.iter().enumerate().filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
        for (turn, (at, line)) in written.enumerate() {
            // Rotates through the kinds of damage.
            let damaged = match turn % 3 {
                0 => [&lines[..at], &lines[at + 1..]].concat().join("\n"),
                1 => [&lines[..=at], &lines[at..]].concat().join("\n"),
                // Removes quotes and braces.
                _ => text.replacen(line, &line.replace(['"', '{'], ""), 1),
            };
            if let Err(error) = parse(&damaged) {
                assert!(error.position.is_some(), "{name}, line {}: {error}", at + 1);
                assert_eq!(error.file.as_deref(), Some("my.toml"));
            }
        }
        for end in (0..text.len()).step_by(307) {
            let cut = &text[..text.floor_char_boundary(end)];
            if let Err(error) = parse(cut) {
                assert!(error.position.is_some(), "{name} cut at {end}: {error}");
            }
        }
    }
}

#[test]
fn a_drive_with_a_negative_frequency_is_refused() {
    // A negative period once made a driven scene step backwards forever.
    let drive = |frequency: &str| {
        let text = GOOD.replace("kind = \"free\"", "kind = \"prismatic\"\naxis = [1, 0, 0]");
        text.replace(
            "start = { position = [0, 0, \"-100 mm\"] }",
            &format!("drive = {{ law = \"harmonic\", amplitude = \"1 mm\", frequency = \"{frequency}\" }}"),
        )
    };
    assert!(parse(&drive("1 Hz")).is_ok());
    for bad in ["-1 Hz", "0 Hz", "20 kHz"] {
        let error = parse(&drive(bad)).unwrap_err();
        assert_contains(bad, &error, &["my.toml:16:", "joint.free.drive.frequency", bad, "above 0 up to 10000 Hz"]);
    }
}

#[test]
fn a_scene_beyond_a_limit_is_refused_with_its_line() {
    let many = |count: usize, part: &dyn Fn(usize) -> String| -> String { (0..count).map(part).collect() };
    let body = |n: usize| format!("[[body]]\nname=\"b{n}\"\nmass=\"1 kg\"\ninertia=\"1 1 1 kg m^2\"\n");
    let joint =
        |n: usize| format!("[[joint]]\nname=\"f{n}\"\nkind=\"free\"\nchild=\"b{n}\"\nstart={{position=[0,0,0]}}\n");
    let ball = |n: usize| format!("[[ball_joint]]\nname=\"S{n}\"\nsocket={{body=\"world\"}}\nball={{body=\"b0\"}}\n");
    let shapes = |count: usize| {
        let shape = "{form=\"sphere\",centre=[0,0,0],radius=\"1 m\",role=\"pin\"},";
        format!("shapes=[{}]\n", shape.repeat(count))
    };
    let corners = "[0,0,0],".repeat(101);
    let plate = format!("shapes=[{{form=\"plate\",role=\"pin\",thickness=\"1 m\",corners=[{corners}]}}]\n");
    let cases = [
        (many(10_001, &body), "my.toml:40001:1: body[10000]: too many: 10001 bodies; allowed at most 10000"),
        (
            body(0) + &many(10_001, &joint),
            "my.toml:50005:1: joint[10000]: too many: 10001 joints; allowed at most 10000",
        ),
        (
            body(0) + &joint(0) + &many(10_001, &ball),
            "my.toml:40010:1: ball_joint[10000]: too many: 10001 ball joints; allowed at most 10000",
        ),
        (body(0) + &shapes(50_001), "body.b0.shapes[50000]: too many: 50001 shapes; allowed at most 50000"),
        (
            body(0) + &shapes(25_001) + &body(1) + &shapes(25_001) + &joint(0) + &joint(1),
            "too many shapes: 50002; allowed at most 50000",
        ),
        (body(0) + &plate, "corners[100]: too many: 101 corners; allowed at most 100"),
    ];
    for (text, words) in cases {
        assert_contains(words, &parse(&text).expect_err(words), &[words]);
    }
    let chain = jointplay::scene::built_in_text("chain").unwrap();
    let changes = vec![("chain.links".to_owned(), "4096".to_owned())];
    let enlarged = chain.to_owned() + &many(5905, &body) + &many(5905, &joint);
    let words = "too many: 10001 bodies with those of patterns and included files; allowed at most 10000";
    let error = Scene::parse(&enlarged, None, &changes).expect_err(words);
    assert_contains("chain", &error, &[words]);

    let more = (1..=4096).map(|n| (format!("joint.J{n}.friction"), "0.1".to_owned()));
    let changes: Vec<_> = changes.into_iter().chain(more).collect();
    let error = Scene::parse(chain, None, &changes).expect_err("too many changes");
    assert_contains("changes", &error, &["joint.J4096.friction = 0.1", "allowed at most 4096"]);
}

#[test]
fn thousands_of_different_joints_do_not_raise_thousands_of_warnings() {
    for links in [30, 4000] {
        // Clearances so small that each raises a warning.
        let change = |n: usize| (format!("joint.J{n}.clearance"), format!("{n}e-9 m"));
        let mut changes = vec![("chain.links".to_owned(), links.to_string())];
        changes.extend((1..=links).map(change));
        let warnings = Scene::load("chain", &changes).unwrap().machine.warnings();
        assert_eq!(warnings.len(), links.min(41), "{links}");
    }
}
