//! Robot descriptions as scenes: masses, motion, names, and parts that are not imported.

use std::fs;
use std::path::Path;

use jointplay::scene::Scene;
use jointplay::simulate::{Frame, Simulation};

use crate::program::{folder, jointplay};

/// Folder of the descriptions for these tests.
const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/commands/import");

/// The scene of the description `text`, and the messages.
pub fn imported(text: &str) -> (Scene, String) {
    let folder = folder();
    fs::write(folder.path().join("robot"), text).unwrap();
    let outcome = jointplay(folder.path(), "import robot").expect(0);
    (Scene::parse(&outcome.stdout, None, &[]).unwrap(), outcome.stderr)
}

/// The error message for the description `text`.
pub fn import_error(text: &str) -> String {
    let folder = folder();
    fs::write(folder.path().join("robot"), text).unwrap();
    jointplay(folder.path(), "import robot").expect(2).stderr
}

pub fn mujoco(inside: &str) -> String {
    format!("<mujoco>\n<worldbody>\n{inside}\n</worldbody>\n</mujoco>")
}

pub fn initial_frame(scene: &Scene) -> Frame {
    let mut simulation = Simulation::new(&scene.machine).unwrap();
    let mut frame = Frame::default();
    simulation.sample(0.0, &mut frame);
    frame
}

/// Both descriptions of the arm as scenes with their meshes, and the messages.
fn arms() -> [(Scene, String); 2] {
    ["arm.urdf", "arm.xml"].map(|name| {
        let outcome = jointplay(Path::new(FOLDER), &format!("import {name}")).expect(0);
        let scene =
            Scene::parse_given(&outcome.stdout, None, &Default::default(), Some(Path::new(FOLDER)), &[]).unwrap();
        (scene, outcome.stderr)
    })
}

#[test]
fn the_same_arm_in_both_formats_gives_the_same_machine() {
    let [(urdf, _), (mjcf, _)] = arms();
    for (a, b) in urdf.machine.bodies.iter().zip(&mjcf.machine.bodies) {
        assert_eq!(a.name, b.name);
        assert!((a.mass - b.mass).abs() < 1e-12, "{}: {} {}", a.name, a.mass, b.mass);
        assert!((a.centre - b.centre).norm() < 1e-12, "{}: {} {}", a.name, a.centre, b.centre);
        assert!((a.inertia - b.inertia).norm() < 1e-12, "{}: {} {}", a.name, a.inertia, b.inertia);
    }
    let names = |scene: &Scene| scene.machine.bodies.iter().map(|body| body.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&urdf), ["upper_arm", "forearm", "plunger"]);
    // The flange is a part of the forearm: 0.8 kg and 0.1 kg.
    assert!((urdf.machine.bodies[1].mass - 0.9).abs() < 1e-12);
    let [one, other] = [&urdf, &mjcf].map(initial_frame);
    for (a, b) in one.bodies.iter().zip(&other.bodies) {
        assert!((a.position - b.position).norm() < 1e-12);
        assert!(a.angular_acceleration.norm() > 0.1);
        assert!((a.angular_acceleration - b.angular_acceleration).norm() < 1e-9 * a.angular_acceleration.norm());
        assert!((a.acceleration - b.acceleration).norm() < 1e-9 * (1.0 + a.acceleration.norm()));
    }
    for scene in [&urdf, &mjcf] {
        assert_eq!(scene.machine.ball_joints.len(), 1);
        assert_eq!(scene.machine.ball_joints[0].name, "elbow");
        let loose = Scene::parse_given(
            &scene.source.text,
            None,
            &Default::default(),
            Some(Path::new(FOLDER)),
            &[("contact.clearance".to_owned(), "0.2mm".to_owned())],
        );
        assert_eq!(loose.unwrap().machine.joints_with_clearance(), 1);
    }
}

/// Angular acceleration of a hinged link from rest: m g l sin(theta) / I about the hinge.
#[test]
fn a_link_with_rotated_inertia_falls_as_its_closed_form() {
    let text = r#"<robot name="one"><link name="base"/><link name="rod">
        <inertial><origin xyz="0.3 0 0" rpy="0 0 1.5707963267948966"/><mass value="2"/>
            <inertia ixx="0.05" ixy="0" ixz="0" iyy="0.012" iyz="0" izz="0.06"/></inertial></link>
        <joint name="hinge" type="continuous"><parent link="base"/><child link="rod"/><origin rpy="0 0.4 0"/><axis xyz="0 1 0"/></joint>
        </robot>"#;
    let (scene, messages) = imported(text);
    assert_eq!(messages, "");
    // The rotated tensor has ixx about y.
    let expected = 2.0 * 9.81 * 0.3 * 0.4_f64.cos() / (0.05 + 2.0 * 0.09);
    let acceleration = initial_frame(&scene).bodies[0].angular_acceleration;
    assert!(
        (acceleration.y / expected - 1.0).abs() < 1e-9 && acceleration.x.abs() + acceleration.z.abs() < 1e-9,
        "{acceleration}"
    );
}

#[test]
fn geoms_give_a_body_its_mass() {
    let (scene, _) = imported(&mujoco(
        r#"<body name="b"><joint type="hinge"/>
            <geom type="sphere" size="0.1" pos="0.3 0 0" density="2000"/>
            <geom type="box" size="0.1 0.2 0.3" mass="3" euler="0 0 90"/>
            <body pos="0 0 1"><geom type="cylinder" size="0.05 0.2" mass="1"/></body></body>"#,
    ));
    let body = &scene.machine.bodies[0];
    let ball = 2000.0 * 4.0 / 3.0 * std::f64::consts::PI * 1e-3;
    let mass = ball + 4.0;
    assert!((body.mass - mass).abs() < 1e-12 * mass);
    let centre = [0.3 * ball / mass, 0.0, 1.0 / mass];
    assert!((body.centre - jointplay::machine::Vec3::from(centre)).norm() < 1e-12);
    // About y through the centroid: sphere, turned box, cylinder.
    let about = |own: f64, m: f64, x: f64, z: f64| own + m * ((x - centre[0]).powi(2) + (z - centre[2]).powi(2));
    let yy = about(0.4 * ball * 0.01, ball, 0.3, 0.0)
        + about(3.0 / 3.0 * (0.2_f64.powi(2) + 0.3_f64.powi(2)), 3.0, 0.0, 0.0)
        + about(0.0025 / 4.0 + 0.04 / 3.0, 1.0, 0.0, 1.0);
    assert!((body.inertia.m22 / yy - 1.0).abs() < 1e-12, "{} {yy}", body.inertia.m22);
}

#[test]
fn all_notations_of_an_orientation_agree() {
    let rotation = |notation: &str| {
        let text =
            mujoco(&format!("<body {notation}><joint type=\"free\"/><geom type=\"box\" size=\"0.1 0.2 0.3\"/></body>"));
        let text = text.replace("<worldbody>", "<compiler eulerseq=\"ZYX\"/><worldbody>");
        initial_frame(&imported(&text).0).bodies[0].rotation
    };
    // A quarter turn about x, then one about the fixed z axis.
    let expected = rotation("quat=\"0.5 0.5 0.5 0.5\"");
    for notation in ["axisangle=\"1 1 1 120\"", "xyaxes=\"0 1 0 0 0 1\"", "quat=\"-1 -1 -1 -1\""] {
        assert!((rotation(notation) - expected).norm() < 1e-12, "{notation}: {}", rotation(notation));
    }
    // Capital letters denote rotations about fixed axes, in sequence.
    let about_z_then_x = rotation("euler=\"90 0 90\"");
    let product = rotation("axisangle=\"1 0 0 90\"") * rotation("axisangle=\"0 0 1 90\"");
    assert!((about_z_then_x - product).norm() < 1e-12);
    let up = rotation("zaxis=\"1 0 0\"");
    assert!((up.column(2) - jointplay::machine::Vec3::x()).norm() < 1e-12);
}

#[test]
fn a_connection_closes_a_loop() {
    let bar = |name: &str, to: &str, inside: &str| {
        format!(
            "<body name=\"{name}\" pos=\"{to}\"><joint axis=\"0 1 0\"/><geom type=\"capsule\" fromto=\"0 0 0 0 0 0.4\" size=\"0.01\"/>{inside}</body>"
        )
    };
    let coupler = "<body name=\"coupler\" pos=\"0 0 0.4\"><joint axis=\"0 1 0\"/><geom type=\"capsule\" fromto=\"0 0 0 0.5 0 0\" size=\"0.01\"/></body>";
    let inside = bar("left", "0 0 0", coupler) + &bar("right", "0.5 0 0", "");
    let text = mujoco(&inside).replace(
        "</mujoco>",
        "<equality><connect name=\"tip\" body1=\"coupler\" body2=\"right\" anchor=\"0.5 0 0\"/></equality></mujoco>",
    );
    let (scene, _) = imported(&text);
    let ball = &scene.machine.ball_joints[0];
    assert_eq!(ball.name, "tip");
    let simulation = Simulation::new(&scene.machine).unwrap();
    assert_eq!(simulation.mechanism().summary().degrees_of_freedom, 1);
}

#[test]
fn only_omitted_parts_are_listed() {
    let [(urdf, messages), (mjcf, mjcf_messages)] = arms();
    for expected in [
        "mass of a link that does not move (line 9)",
        "<collision>: bodies do not touch each other (line 24)",
        "mesh meshes/motor.dae, which is not STL, OBJ or glTF (line 38)",
        "friction in a joint",
        "limits of a joint: a [[stop]] needs their stiffness, too (line 61, and 1 more)",
        "<transmission>",
    ] {
        assert!(messages.contains(&format!("omitted: {expected}")), "{expected}: {messages}");
        assert!(urdf.source.text.contains(expected), "{expected}");
    }
    assert_eq!(messages.lines().count(), 6, "{messages}");
    let expected = [
        "setting timestep of <option>",
        "<texture> of <asset>",
        "<light> of a body",
        "geom of type plane",
        "contact between geoms: bodies do not touch each other (line 14, and 4 more)",
        "frictionloss of <joint>",
        "gravcomp of <body>",
        "range of a joint: a [[stop]] needs its stiffness, too (line 18, and 1 more)",
        "<actuator>",
    ];
    for expected in expected {
        assert!(mjcf_messages.contains(&format!("omitted: {expected}")), "{expected}: {mjcf_messages}");
    }
    assert_eq!(mjcf_messages.lines().count(), expected.len(), "{mjcf_messages}");
    for scene in [&urdf, &mjcf] {
        let meshes = scene.source.text.matches("cover.stl").count();
        assert_eq!(meshes, 1);
        assert!(scene.source.text.contains("upper arm is called upper_arm here"));
    }
}

#[test]
fn default_classes_apply_to_their_elements() {
    let text = r#"<mujoco><compiler angle="radian"/>
        <default><joint damping="1"/><default class="stiff"><joint stiffness="20" axis="0 1 0"/></default></default>
        <worldbody><body name="a" childclass="stiff"><joint name="one"/><geom size="0.1"/>
            <body name="b" pos="1 0 0"><joint name="two" class="main"/><geom size="0.1"/>
                <body name="c" pos="1 0 0"><joint name="three" damping="0" springref="0.5"/><geom size="0.1"/></body></body></body></worldbody></mujoco>"#;
    let (scene, _) = imported(text);
    let text = &scene.source.text;
    let spring_of = |joint: &str| {
        let from = text.find(&format!("name = \"{joint}_spring\"")).unwrap();
        let section = &text[from..];
        section[..section.find("\n\n").unwrap_or(section.len())].to_owned()
    };
    assert!(
        spring_of("one").contains("stiffness = \"20 N m/rad\"")
            && spring_of("one").contains("damping = \"1 N m s/rad\"")
    );
    assert!(spring_of("two").contains("damping = \"1 N m s/rad\"") && !spring_of("two").contains("stiffness"));
    assert!(spring_of("three").contains("position = \"0.5 rad\"") && !spring_of("three").contains("damping"));
}

#[test]
fn a_description_that_changes_the_machine_if_ignored_is_refused_with_its_line() {
    let robot = |inside: &str| format!("<robot name=\"r\">\n<link name=\"base\"/>\n{inside}\n</robot>");
    let joint = |kind: &str, more: &str| {
        robot(&format!(
            "<link name=\"a\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial></link>\n<joint name=\"j\" type=\"{kind}\"><parent link=\"base\"/><child link=\"a\"/>{more}</joint>"
        ))
    };
    let body = |inside: &str| mujoco(&format!("<body name=\"b\">{inside}</body>"));
    let ball = "<geom size=\"0.1\"/>";
    for (text, expected) in [
        ("no markup".to_owned(), "robot: is not an XML file: "),
        ("<scene/>".to_owned(), "robot:1: scene: <scene> is neither <robot> (URDF) nor <mujoco> (MJCF)"),
        (robot(""), "no joint moves"),
        (joint("planar", ""), "robot:4: joint j: type = \"planar\": allowed: fixed, revolute"),
        (joint("revolute", "<axis xyz=\"0 0 0\"/>"), "axis: xyz = \"0 0 0\": the axis has no direction"),
        (joint("revolute", "<axis xyz=\"0 1\"/>"), "axis: xyz = \"0 1\": expected 3 numbers"),
        (joint("revolute", "<origin xyz=\"0 0 nan\"/>"), "expected 3 numbers"),
        (joint("revolute", "").replace("child link=\"a\"", "child link=\"x\""), "joint j: there is no link x"),
        (joint("revolute", "").replace("<mass value=\"1\"/>", ""), "robot:3: inertial: <mass> is missing"),
        (joint("revolute", "").replace("value=\"1\"", "value=\"0\""), "link a: a moving link needs an <inertial>"),
        (robot("<link name=\"a\"/>"), "without parent: a, base"),
        (mujoco(""), "no body has a joint"),
        (body("<joint/>"), "robot:3: body b: a moving body needs a mass above 0 kg"),
        (body(&format!("<joint type=\"screw\"/>{ball}")), "type = \"screw\": allowed: hinge, slide, ball, free"),
        (
            body(&format!("<joint type=\"slide\"/><joint type=\"ball\"/>{ball}")),
            "robot:3: body b: a ball or free joint is the only joint of its body in a scene",
        ),
        (body("<joint/><geom type=\"box\" size=\"1 1\"/>"), "a box needs number 3 above 0"),
        (body("<joint/><geom type=\"mesh\" mesh=\"m\"/>"), "there is no mesh m"),
        (body(&format!("<joint/>{ball}<frame/>")), "frame: is not supported: write the bodies that it stands for"),
        (
            "<mujoco>\n<include file=\"x.xml\"/></mujoco>".to_owned(),
            "robot:2: include: <include> is not supported: insert the contents of the file here",
        ),
    ] {
        let messages = import_error(&text);
        assert!(messages.contains(expected), "{text}\n  should say `{expected}`, says: {messages}");
    }
    let missing = jointplay(folder().path(), "import nothing.urdf").expect(1).stderr;
    assert!(missing.contains("nothing.urdf: cannot read this file"), "{missing}");
}

/// Angular acceleration about z, rad/s^2, of the first body of a file without gravity, and its moment of inertia about z.
fn angular_acceleration(settings: &str, inside: &str) -> (f64, f64) {
    let flag = "<option><flag gravity=\"disable\"/></option>";
    let (scene, _) = imported(&mujoco(inside).replace("<worldbody>", &format!("{settings}{flag}<worldbody>")));
    (initial_frame(&scene).bodies[0].angular_acceleration.z, scene.machine.bodies[0].inertia.m33)
}

#[test]
fn an_orientation_overrides_every_notation_in_its_default_class() {
    let inertia = |defaults: &str, own: &str| {
        let body = format!("<body><joint/><geom type=\"box\" size=\"0.1 0.2 0.3\" {own}/></body>");
        let text = mujoco(&body).replace("<worldbody>", &format!("<default>{defaults}</default><worldbody>"));
        imported(&text).0.machine.bodies[0].inertia
    };
    let expected = inertia("", "euler=\"20 30 40\"");
    let inner = "<geom quat=\"0.9 0.1 0.2 0.3\"/><default class=\"turned\"><geom euler=\"20 30 40\"/></default>";
    for (defaults, own) in [
        ("<geom quat=\"0.9 0.1 0.2 0.3\"/>", "euler=\"20 30 40\""),
        ("<geom axisangle=\"1 0 0 50\" quat=\"0.9 0.1 0.2 0.3\"/>", "euler=\"20 30 40\""),
        (inner, "class=\"turned\""),
    ] {
        let actual = inertia(defaults, own);
        assert!((actual - expected).amax() < 1e-14 * expected.amax(), "{defaults} {own}: {actual}");
    }
    assert!((inertia(inner, "") - expected).amax() > 0.1 * expected.amax());
}

#[test]
fn a_loop_closes_at_sites_and_on_parts_without_joints() {
    let text = |connect: &str| {
        mujoco(
            "<site name=\"ground\" pos=\"0.5 0 0\"/><body name=\"base\" pos=\"0.1 0 0\" euler=\"0 0 90\"/>
            <body name=\"crank\" euler=\"0 10 0\"><joint axis=\"0 1 0\"/><geom size=\"0.1\"/>
                <body name=\"rod\" pos=\"0 0 0.2\"><joint axis=\"0 1 0\"/><geom size=\"0.1\"/>
                    <body name=\"eye\" pos=\"0.3 0 0.1\" euler=\"0 90 0\"><site name=\"end\" pos=\"0.2 0 0\"/></body></body></body>",
        )
        .replace("</mujoco>", &format!("<equality><connect name=\"c\" {connect}/></equality></mujoco>"))
    };
    // The x axis of the eye is -z of the rod.
    let point = jointplay::machine::Vec3::new(0.3, 0.0, -0.1);
    let (scene, messages) = imported(&text("site1=\"end\" site2=\"ground\""));
    let ball = &scene.machine.ball_joints[0];
    assert_eq!(messages.matches("<site>").count(), 0, "{messages}");
    let points = |ball: &jointplay::machine::BallJoint| [ball.socket.point, ball.ball.point];
    assert!((points(ball)[0] - point).norm() < 1e-12, "{}", points(ball)[0]);
    assert!((points(ball)[1] - jointplay::machine::Vec3::new(0.5, 0.0, 0.0)).norm() < 1e-12);
    let (by_body, _) = imported(&text("body1=\"eye\" body2=\"base\" anchor=\"0.2 0 0\""));
    let points_by_body = points(&by_body.machine.ball_joints[0]);
    let (sine, cosine) = 10.0_f64.to_radians().sin_cos();
    let expected = jointplay::machine::Vec3::new(cosine * 0.3 + sine * 0.1, 0.0, -sine * 0.3 + cosine * 0.1);
    assert!(
        (points_by_body[0] - point).norm() < 1e-12 && (points_by_body[1] - expected).norm() < 1e-12,
        "{} {}",
        points_by_body[0],
        points_by_body[1]
    );
    for (connect, expected) in [
        ("site1=\"end\" site2=\"x\"", "connect c: site2 = \"x\": there is no such site"),
        ("site1=\"end\"", "connect c: the attribute `site2` is missing"),
        ("body1=\"x\" anchor=\"0 0 0\"", "connect c: body1 = \"x\": there is no such body"),
        ("anchor=\"0 0 0\"", "connect c: the attribute `body1` is missing"),
    ] {
        let messages = import_error(&text(connect));
        assert!(messages.contains(expected), "{connect}: {messages}");
    }
}

#[test]
fn springs_act_relative_to_the_pose_drawn_in_the_file() {
    let geom = "<geom type=\"box\" size=\"0.1 0.2 0.3\"/>";
    let hinge = "<joint stiffness=\"5\" springref=\"30\" ref=\"10\"/>";
    let (acceleration, inertia) = angular_acceleration("", &format!("<body>{hinge}{geom}</body>"));
    let expected = 5.0 * 20.0_f64.to_radians() / inertia;
    assert!((acceleration / expected - 1.0).abs() < 1e-9, "{acceleration} {expected}");
    // A hinge whose axis opposes its body's slide rotates in the opposite sense.
    let both =
        "<joint type=\"slide\" axis=\"0 0 1\"/><joint name=\"h\" axis=\"0 0 -1\" stiffness=\"5\" springref=\"0.3\"/>";
    let (acceleration, inertia) =
        angular_acceleration("<compiler angle=\"radian\"/>", &format!("<body>{both}{geom}</body>"));
    assert!((acceleration * inertia / (-5.0 * 0.3) - 1.0).abs() < 1e-9, "{acceleration}");
}

#[test]
fn option_flags_are_listed_and_the_gravity_flag_is_applied() {
    let text = mujoco("<body><joint axis=\"0 1 0\"/><geom size=\"0.1\" pos=\"1 0 0\"/></body>");
    let with = |flags: &str| {
        imported(
            &text.replace("<worldbody>", &format!("<option gravity=\"0 0 -5\"><flag {flags}/></option><worldbody>")),
        )
    };
    let (at_rest, messages) = with("gravity=\"disable\" equality=\"disable\"");
    assert_eq!(initial_frame(&at_rest).bodies[0].angular_acceleration.norm(), 0.0);
    assert!(
        messages.contains("omitted: flag equality of <option> (line 2)") && !messages.contains("flag gravity"),
        "{messages}"
    );
    let (falling, _) = with("gravity=\"enable\"");
    let acceleration = initial_frame(&falling).bodies[0].angular_acceleration.y;
    assert!((acceleration - 5.0 / (1.0 + 0.4 * 0.01)).abs() < 1e-9, "{acceleration}");
}

#[test]
fn a_tiny_body_keeps_its_inertia() {
    let (scene, _) = imported(&mujoco("<body><joint type=\"free\"/><geom size=\"0.0001\" mass=\"1e-9\"/></body>"));
    let expected = 0.4 * 1e-9 * 1e-8;
    assert!((scene.machine.bodies[0].inertia.m11 / expected - 1.0).abs() < 1e-12);
    let robot = r#"<robot><link name="base"/><link name="grain"><inertial><mass value="1e-9"/>
        <inertia ixx="3e-18" ixy="1e-18" ixz="0" iyy="4e-18" iyz="-5e-19" izz="5e-18"/></inertial></link>
        <joint name="j" type="continuous"><parent link="base"/><child link="grain"/></joint></robot>"#;
    let tensor = imported(robot).0.machine.bodies[0].inertia;
    for (part, expected) in [(tensor.m11, 3e-18), (tensor.m12, 1e-18), (tensor.m13, 0.0), (tensor.m23, -5e-19)] {
        assert!((part - expected).abs() < 1e-30, "{part} {expected}");
    }
}

/// MuJoCo rotates z by the shortest arc to the direction from the second point to the first.
#[test]
fn a_box_between_two_points_is_oriented_as_in_mujoco() {
    let (scene, _) = imported(&mujoco(
        "<body><joint/><geom type=\"box\" size=\"0.01\" fromto=\"0 0 0 0.1 0.2 0.4\"/><geom size=\"9\" rgba=\"1 1 1 0\" mass=\"0\"/></body>",
    ));
    let file: toml::Value = toml::from_str(&scene.source.text).unwrap();
    let shapes = file["body"][0]["shapes"].as_array().unwrap();
    assert_eq!(shapes.len(), 1, "an invisible geom is not drawn");
    let corner = |at: usize| {
        let text = shapes[0]["corners"][at].as_str().unwrap();
        let parts: Vec<f64> = text.split(' ').take(3).map(|part| part.parse().unwrap()).collect();
        jointplay::machine::Vec3::new(parts[0], parts[1], parts[2])
    };
    let z = -jointplay::machine::Vec3::new(0.1, 0.2, 0.4).normalize();
    let x = jointplay::machine::Vec3::new(1.0 - z.x * z.x / (1.0 + z.z), -z.x * z.y / (1.0 + z.z), -z.x);
    assert!(((corner(0) - corner(1)) / 0.02 - x).norm() < 1e-9, "{}", corner(0) - corner(1));
}

#[test]
fn macros_and_mass_settings_are_refused_and_mirrored_meshes_are_reported() {
    let ball = "<body><joint/><geom size=\"0.1\"/></body>";
    let with = |setting: &str| mujoco(ball).replace("<worldbody>", &format!("<compiler {setting}/><worldbody>"));
    for (text, expected) in [
        (with("settotalmass=\"3\""), "compiler: settotalmass = \"3\": is not supported: scale the masses in the file"),
        (with("inertiagrouprange=\"3 4\""), "inertiagrouprange = \"3 4\": is not supported"),
        (
            "<robot name=\"r\" xmlns:xacro=\"http://ros.org/wiki/xacro\">\n<xacro:arm prefix=\"l\"/></robot>"
                .to_owned(),
            "robot:2: arm: a macro of xacro: expand the file first",
        ),
    ] {
        let messages = import_error(&text);
        assert!(messages.contains(expected), "{text}\n  should say `{expected}`, says: {messages}");
    }
    assert_eq!(imported(&with("settotalmass=\"-1\" inertiagrouprange=\"0 5\"")).1.lines().count(), 1);
    let mesh = |scale: &str| {
        let asset = format!("<asset><mesh name=\"m\" file=\"m.stl\" scale=\"{scale}\"/></asset><worldbody>");
        let geom = "<joint/><geom type=\"mesh\" mesh=\"m\" mass=\"0\"/>";
        imported(&mujoco(&ball.replace("<joint/>", geom)).replace("<worldbody>", &asset)).1
    };
    assert!(mesh("-1 -1 -1").contains("mesh m, whose scale is not above 0 along every axis"));
    assert!(mesh("1 1 2").contains("mesh m, whose scale differs between axes"));
}
