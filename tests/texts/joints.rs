//! Joints with two degrees of freedom and joints that close loops in scene files; errors state the reason and what is allowed.

use jointplay::machine::{Freedom, JointKind, JointStart};
use jointplay::scene::Scene;

/// An arm on a hinge, a rod that hangs free, and the joint `j` between them.
fn text(joint: &str) -> String {
    let body = |name: &str| format!("[[body]]\nname = \"{name}\"\nmass = \"1 kg\"\ninertia = \"1 1 1 kg m^2\"\n");
    format!(
        "{}{}[[joint]]\nname = \"hinge\"\nkind = \"revolute\"\nchild = \"arm\"\naxis = [0, 1, 0]\n\
         [[joint]]\nname = \"free\"\nkind = \"free\"\nchild = \"rod\"\nstart = {{ position = [0, 0, 0] }}\n\
         [[joint]]\nname = \"j\"\nparent = \"arm\"\nchild = \"rod\"\n{joint}",
        body("arm"),
        body("rod")
    )
}

/// The same with `j` as the only joint of the rod.
fn text_of_tree(joint: &str) -> String {
    let free = "[[joint]]\nname = \"free\"\nkind = \"free\"\nchild = \"rod\"\nstart = { position = [0, 0, 0] }\n";
    text(joint).replace(free, "")
}

fn parse(text: &str) -> Result<Scene, String> {
    Scene::parse(text, Some("my.toml"), &[]).map_err(|error| error.to_string())
}

fn assert_refused(text: &str, words: &[&str]) {
    let error = parse(text).expect_err(words[0]);
    for words in words.iter().chain(&["my.toml:"]) {
        assert!(error.contains(words), "`{words}` is not in:\n{error}");
    }
}

#[test]
fn a_joint_that_closes_a_loop_is_not_part_of_the_tree() {
    let scene = parse(&text("kind = \"revolute\"\naxis = [0, 1, 0]\ncloses_loop = true\n")).unwrap();
    assert_eq!((scene.machine.joints.len(), scene.machine.closing_joints.len()), (2, 1));
    let joint = &scene.machine.closing_joints[0];
    assert_eq!((joint.kind, joint.parent, joint.child), (JointKind::Revolute, Some(0), 1));
    assert_eq!(scene.machine.cut_joints().collect::<Vec<_>>(), ["j"]);
    // The explicit default.
    let text = text_of_tree("kind = \"revolute\"\naxis = [0, 1, 0]\ncloses_loop = false\n");
    assert_eq!(parse(&text).unwrap().machine.closing_joints.len(), 0);
}

#[test]
fn start_values_of_joints_with_two_degrees_are_keys() {
    let joint = "kind = \"universal\"\naxis = [0, 2, 0]\nchild_axis = [0, 0, 3]\n\
                 start = { angle = \"10 deg\", child_angular_velocity = \"60 rpm\" }\n";
    let mut scene = parse(&text_of_tree(joint)).unwrap();
    scene.set("joint.j.start.angle", "0.5 rad").unwrap();
    let JointStart::Pair { position, velocity } = scene.machine.joints[1].start else {
        panic!("{:?}", scene.machine.joints[1].start);
    };
    assert_eq!(position, [0.5, 0.0]);
    assert!(velocity[0] == 0.0 && (velocity[1] - std::f64::consts::TAU).abs() < 1e-12);
    assert_eq!(scene.machine.joints[1].child_axis.as_slice(), [0.0, 0.0, 1.0]);
    let error = scene.set("joint.j.start.child_angle", "0.5 m").unwrap_err();
    assert!(error.to_string().contains("angle"), "{error}");
}

#[test]
fn errors_state_what_is_allowed() {
    let hinge = "kind = \"revolute\"\naxis = [0, 1, 0]\n";
    assert_refused(
        &text(hinge),
        &["joint.j.child = \"rod\"", "already the child of joint `free`", "`closes_loop = true`"],
    );
    let closing = |more: &str| text(&format!("{hinge}closes_loop = true\n{more}"));
    assert_refused(
        &closing("drive = { law = \"constant\", velocity = \"1 rad/s\" }\n"),
        &["joint.j.drive", "a joint that closes a loop has no drive"],
    );
    assert_refused(&closing("start = { position = \"1 deg\" }\n"), &["joint.j.start", "starts where"]);
    assert_refused(&closing("stiffness = 1\n"), &["joint.j.stiffness", "unknown key"]);
    assert_refused(
        &closing("").replace("parent = \"arm\"\nchild = \"rod\"", "parent = \"rod\"\nchild = \"rod\""),
        &["joint.j.child", "parent and child are the same body"],
    );
    assert_refused(&text("closes_loop = 1\n"), &["joint.j.kind", "missing"]);
    assert_refused(&text(&format!("{hinge}closes_loop = \"yes\"\n")), &["joint.j.closes_loop", "true or false"]);
    assert_refused(
        &text("kind = \"free\"\ncloses_loop = true\n"),
        &["joint.j.kind", "allowed fixed, prismatic, revolute, cylindrical, universal"],
    );
    assert_refused(&text_of_tree("kind = \"cylindrical\"\n"), &["joint.j.axis", "missing"]);
    assert_refused(&text_of_tree("kind = \"universal\"\naxis = [0, 1, 0]\n"), &["joint.j.child_axis", "missing"]);
    assert_refused(
        &text_of_tree("kind = \"universal\"\naxis = [0, 1, 0]\nchild_axis = [0, 1, 1]\n"),
        &["joint.j.child_axis", "perpendicular to `axis`", "45"],
    );
    assert_refused(
        &text_of_tree("kind = \"revolute\"\naxis = [0, 1, 0]\nchild_axis = [0, 0, 1]\n"),
        &["joint.j.child_axis", "a universal joint has `child_axis`"],
    );
    assert_refused(
        &text_of_tree("kind = \"cylindrical\"\naxis = [0, 1, 0]\nstart = { child_angle = \"1 deg\" }\n"),
        &["joint.j.start.child_angle", "unknown key"],
    );
    let stop = "[[stop]]\nname = \"s\"\njoint = \"j\"\nlower = \"1 mm\"\nforce = \"1 N\"\ndepth = \"1 mm\"\n";
    assert_refused(
        &(text_of_tree("kind = \"cylindrical\"\naxis = [0, 1, 0]\n") + stop),
        &["stop.s.coordinate", "missing: a cylindrical joint has position and angle", "coordinate = \"position\""],
    );
    let with_coordinate = |word: &str| stop.replace("lower", &format!("coordinate = \"{word}\"\nlower"));
    assert_refused(
        &(text_of_tree("kind = \"cylindrical\"\naxis = [0, 1, 0]\n") + &with_coordinate("child_angle")),
        &["stop.s.coordinate = \"child_angle\"", "no such coordinate: a cylindrical joint has position and angle"],
    );
    assert_refused(&(closing("") + &with_coordinate("position")), &["no such coordinate: a revolute joint has angle"]);
    assert_refused(&(closing("") + stop), &["stop.s.lower", "wrong unit `mm`", "units of angle"]);
    assert_refused(
        &(text_of_tree("kind = \"cylindrical\"\naxis = [0, 1, 0]\n") + &with_coordinate("angle")),
        &["stop.s.lower", "wrong unit `mm`", "units of angle"],
    );
    assert_refused(
        &(closing("") + &stop.replace("\"j\"", "\"free\"")),
        &["a free joint is neither a slide nor a hinge", "allowed hinge, j"],
    );
}

#[test]
fn drives_of_joints_with_two_degrees_name_their_coordinates() {
    let text_of_tree = |more: &str| text_of_tree(&format!("kind = \"cylindrical\"\naxis = [0, 1, 0]\n{more}"));
    let slide = "{ law = \"constant\", velocity = \"2 mm/s\" }";
    let turn = "{ law = \"constant\", velocity = \"3 rad/s\" }";
    let mut scene =
        parse(&text_of_tree(&format!("drive = {{ angle = {turn} }}\nstart = {{ velocity = \"1 m/s\" }}\n"))).unwrap();
    let driven: Vec<_> = scene.machine.driven().collect();
    assert_eq!(driven, [(&scene.machine.joints[1], Freedom::TurnOfSlide)]);
    scene.set("joint.j.drive.angle.velocity", "4 rad/s").unwrap();
    scene.set("joint.j.start.velocity", "2 m/s").unwrap();
    let both = format!("drive = {{ angle = {turn}, position = {slide} }}\n");
    let scene = parse(&text_of_tree(&both)).unwrap();
    assert!(scene.machine.joints[1].is_prescribed() && scene.machine.driven().count() == 2);
    for (more, words) in [
        (format!("drive = {slide}\n"), ["joint.j.drive.law", "unknown key"]),
        (format!("drive = {{ angle = {slide} }}\n"), ["joint.j.drive.angle.velocity", "rad/s"]),
        (format!("drive = {{ child_angle = {turn} }}\n"), ["joint.j.drive.child_angle", "unknown key"]),
        ("drive = { }\n".to_owned(), ["joint.j.drive", "drives nothing: give `position`, `angle` or both"]),
        (
            format!("{both}start = {{ angle = \"1 deg\" }}\n"),
            ["joint.j.start.angle", "the drive of this coordinate says where it starts"],
        ),
        (
            format!("drive = {{ angle = {turn} }}\nstart = {{ angular_velocity = \"1 rad/s\" }}\n"),
            ["joint.j.start.angular_velocity", "says where it starts"],
        ),
        (
            "drive = { position = { law = \"function\", function = \"f\" } }\n".to_owned(),
            ["joint.j.drive.position.function", "[closed_form]"],
        ),
    ] {
        assert_refused(&text_of_tree(&more), &words);
    }
    let motor = "[[motor]]\nname = \"m\"\njoint = \"j\"\ncoordinate = \"angle\"\ntorque = \"1 N m\"\n";
    assert_refused(
        &(text_of_tree(&format!("drive = {{ angle = {turn} }}\n")) + motor),
        &["motor.m.joint", "has a drive"],
    );
    parse(&(text_of_tree(&format!("drive = {{ position = {slide} }}\n")) + motor)).unwrap();
}
