//! Joints of robot descriptions without a single equivalent joint in scenes: chains of hinges and slides, and welds.

use crate::import::{import_error, imported, initial_frame, mujoco};
use jointplay::machine::{JointKind, Vec3};
use jointplay::scene::Scene;
use jointplay::simulate::{Frame, Simulation};

const HINGES: &str = "<joint name=\"hip_x\" axis=\"1 0 0\" pos=\"0 0 0.02\" stiffness=\"3\" springref=\"20\"/>
    <joint name=\"hip_z\" axis=\"0 0 1\" pos=\"0 0 0.02\"/><joint name=\"hip_y\" axis=\"0 1 0\" pos=\"0 0 0.02\" damping=\"2\"/>";

fn leg(joints: &str) -> String {
    mujoco(&format!(
        "<body name=\"thigh\" pos=\"0 0.1 1\" euler=\"10 20 30\">{joints}<geom type=\"capsule\" fromto=\"0 0 0 0.05 0.01 -0.34\" size=\"0.06\"/>
            <body name=\"shin\" pos=\"0 0 -0.4\"><joint name=\"knee\" axis=\"0 -1 0\"/><geom type=\"box\" size=\"0.03 0.04 0.2\"/></body></body>"
    ))
}

fn index(scene: &Scene, name: &str) -> usize {
    scene.machine.bodies.iter().position(|body| body.name == name).unwrap()
}

fn frame_at(scene: &Scene, time: f64) -> Frame {
    let mut simulation = Simulation::new(&scene.machine).unwrap();
    while simulation.time() < time {
        simulation.step_until(time).unwrap();
    }
    let mut frame = Frame::default();
    simulation.sample(time, &mut frame);
    frame
}

/// Three hinges through one point have the degrees of freedom of a ball joint.
#[test]
fn three_hinges_of_a_body_form_a_chain_that_moves_like_a_ball_joint() {
    let (chain, messages) = imported(&leg(HINGES).replace("stiffness=\"3\"", "").replace("damping=\"2\"", ""));
    assert_eq!(messages.lines().count(), 1, "only the contact is not imported: {messages}");
    let names: Vec<&str> = chain.machine.bodies.iter().map(|body| body.name.as_str()).collect();
    assert_eq!(names, ["hip_x", "hip_z", "thigh", "shin"]);
    assert_eq!(
        chain.machine.bodies.iter().map(|body| body.mass == 0.0).collect::<Vec<_>>(),
        [true, true, false, false]
    );
    let joints: Vec<&str> = chain.machine.joints.iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(joints, ["hip_x", "hip_z", "hip_y", "knee"]);
    let (ball, _) = imported(&leg("<joint type=\"ball\" pos=\"0 0 0.02\"/>"));
    for (time, bound) in [(0.0, 1e-12), (0.1, 1e-5)] {
        let (one, other) = (frame_at(&chain, time), frame_at(&ball, time));
        for name in ["thigh", "shin"] {
            let (a, b) = (&one.bodies[index(&chain, name)], &other.bodies[index(&ball, name)]);
            assert!((a.position - b.position).norm() < bound, "{name} at {time} s");
            assert!((a.rotation - b.rotation).amax() < 10.0 * bound, "{name} at {time} s");
            let error = (a.angular_acceleration - b.angular_acceleration).norm() / b.angular_acceleration.norm();
            assert!(error < 1e3 * bound, "{name} at {time} s: {error}");
        }
    }
    assert!(initial_frame(&chain).bodies[3].acceleration.norm() > 0.1);
    let springs = imported(&leg(HINGES)).0.source.text;
    for (joint, value) in [("hip_x", "stiffness = \"3 N m/rad\""), ("hip_y", "damping = \"2 N m s/rad\"")] {
        let section = &springs[springs.find(&format!("name = \"{joint}_spring\"")).unwrap()..];
        assert!(section[..section.find("\n\n").unwrap_or(section.len())].contains(value), "{joint}: {section}");
    }
}

/// Two slides and a hinge, a hinge and a slide across it, and hinges at different points: each joint acts in the frame moved by the
/// joints before it.
#[test]
fn hinges_and_slides_act_in_their_order() {
    let ball = "<geom size=\"0.1\"/>";
    let body = |joints: &str| imported(&mujoco(&format!("<body name=\"b\">{joints}{ball}</body>"))).0;
    let slide = |axis: &str| format!("<joint type=\"slide\" axis=\"{axis}\"/>");
    let plane = body(&format!("{}{}<joint axis=\"0 0 1\"/>", slide("1 0 0"), slide("0 1 0")));
    let kinds: Vec<JointKind> = plane.machine.joints.iter().map(|joint| joint.kind).collect();
    assert_eq!(kinds, [JointKind::Prismatic, JointKind::Prismatic, JointKind::Revolute]);
    assert_eq!(Simulation::new(&plane.machine).unwrap().mechanism().summary().degrees_of_freedom, 3);
    // Pose of the body when the first coordinate is a quarter turn and the second is `second`.
    let moved = |joints: &str, second: &str| {
        let scene = body(joints);
        let text = scene.source.text.replacen("[[joint]]\n", "[[joint]]\nstart = { position = \"90 deg\" }\n", 1);
        let at = text.rfind("[[joint]]\n").unwrap() + "[[joint]]\n".len();
        let text = format!("{}start = {{ position = \"{second}\" }}\n{}", &text[..at], &text[at..]);
        initial_frame(&Scene::parse(&text, None, &[]).unwrap()).bodies[1]
    };
    // The slide rotates with the hinge before it: 0.3 m along the rotated x axis.
    let slid = moved(&format!("<joint axis=\"0 0 1\"/>{}", slide("1 0 0")), "0.3 m");
    assert!((slid.position - Vec3::new(0.0, 0.3, 0.0)).norm() < 1e-12, "{}", slid.position);
    // About z through (1, 0, 0), then about the rotated x axis through the image of (0, 0, 2).
    let turned = moved("<joint axis=\"0 0 1\" pos=\"1 0 0\"/><joint axis=\"1 0 0\" pos=\"0 0 2\"/>", "90 deg");
    // The second hinge maps the origin to (0, 2, 2) of its frame, the first maps (x, y, z) to (1 - y, x - 1, z).
    assert!((turned.position - Vec3::new(-1.0, -1.0, 2.0)).norm() < 1e-12, "{}", turned.position);
    let message = import_error(&mujoco(&format!("<body><joint/><joint type=\"free\"/>{ball}</body>")));
    assert!(message.contains("a ball or free joint is the only joint of its body"), "{message}");
}

#[test]
fn links_without_mass_connect_the_joints_of_a_urdf() {
    let joint = |name: &str, kind: &str, parent: &str, child: &str, axis: &str| {
        format!(
            "<joint name=\"{name}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{child}\"/><axis xyz=\"{axis}\"/></joint>\n"
        )
    };
    let mass = "<inertial><mass value=\"2\"/><inertia ixx=\"0.1\" ixy=\"0\" ixz=\"0\" iyy=\"0.1\" iyz=\"0\" izz=\"0.1\"/></inertial>";
    let robot = |last: &str, kind: &str| {
        format!(
            "<robot name=\"r\">\n<link name=\"base\"/><link name=\"rail\"/><link name=\"sled\"/>\n<link name=\"car\">{last}</link>\n{}{}{}</robot>",
            joint("x", "prismatic", "base", "rail", "1 0 0"),
            joint("y", "prismatic", "rail", "sled", "0 1 0"),
            joint("turn", kind, "sled", "car", "0 0 1"),
        )
    };
    let (scene, _) = imported(&robot(mass, "continuous"));
    assert_eq!(scene.machine.bodies.iter().map(|body| body.mass).collect::<Vec<_>>(), [0.0, 0.0, 2.0]);
    assert_eq!(initial_frame(&scene).bodies[2].acceleration.norm(), 0.0, "gravity is perpendicular to the joints");
    for (text, link) in
        [(robot("", "continuous"), "robot:3: link car"), (robot(mass, "spherical"), "robot:2: link sled")]
    {
        let message = import_error(&text);
        assert!(
            message.contains(&format!("{link}: a moving link needs an <inertial> with a mass above 0 kg")),
            "{message}"
        );
    }
}

/// A pendulum with a free weight welded to it swings as one with the weight as part of its body.
#[test]
fn a_welded_body_moves_as_part_of_the_other() {
    let rod = "<geom type=\"capsule\" fromto=\"0 0 0 0.5 0 0\" size=\"0.02\"/><site name=\"tip\" pos=\"0.5 0 0\" euler=\"0 30 0\"/>";
    let weight = "<geom type=\"box\" size=\"0.1 0.05 0.02\"/><site name=\"eye\" pos=\"-0.1 0 0\"/>";
    // Assembly moves both bodies until the weld closes; the reference uses the resulting angle of the rod.
    let expected = |angle: f64| {
        let (single_body, _) = imported(&mujoco(&format!(
            "<body name=\"rod\" euler=\"0 {} 0\"><joint axis=\"0 1 0\"/>{rod}<body name=\"weight\" pos=\"0.5 0 0\" euler=\"0 30 0\">{}</body></body>",
            angle.to_degrees(),
            weight.replace("<geom", "<geom pos=\"0.1 0 0\"")
        )));
        initial_frame(&single_body).bodies[0].angular_acceleration.y
    };
    let welded = |at: &str, weld: &str| {
        mujoco(&format!(
            "<body name=\"rod\"><joint axis=\"0 1 0\"/>{rod}</body><body name=\"weight\" {at}><freejoint/>{}</body>",
            weight
        ))
        .replace("</mujoco>", &format!("<equality><weld name=\"w\" {weld}/></equality></mujoco>"))
    };
    // 0.1 m along the x axis rotated by 30 deg about y.
    let (sine, cosine) = 30.0_f64.to_radians().sin_cos();
    let drawn = format!("pos=\"{} 0 {}\" euler=\"0 30 0\"", 0.5 + 0.1 * cosine, -0.1 * sine);
    let quaternion = "0.9659258262890683 0 0.25881904510252074 0";
    for (at, weld) in [
        (drawn.as_str(), "body1=\"rod\" body2=\"weight\"".to_owned()),
        (drawn.as_str(), "body1=\"weight\" body2=\"rod\" anchor=\"0.3 0 0\"".to_owned()),
        ("pos=\"0.55 0.02 -0.03\" euler=\"0 25 5\"", "site1=\"tip\" site2=\"eye\"".to_owned()),
        (
            "pos=\"0.55 0.02 -0.03\" euler=\"0 25 5\"",
            format!("body1=\"rod\" body2=\"weight\" anchor=\"-0.1 0 0\" relpose=\"0.5 0 0 {quaternion}\""),
        ),
    ] {
        let (scene, messages) = imported(&welded(at, &weld));
        assert!(!messages.contains("<weld>"), "{messages}");
        assert_eq!(scene.machine.closing_joints[0].kind, JointKind::Fixed);
        let simulation = Simulation::new(&scene.machine).unwrap();
        assert_eq!(simulation.mechanism().summary().degrees_of_freedom, 1, "{weld}");
        let frame = initial_frame(&scene);
        let rod = &frame.bodies[index(&scene, "rod")];
        let expected = expected(rod.rotation[(0, 2)].atan2(rod.rotation[(0, 0)]));
        let acceleration = rod.angular_acceleration.y;
        assert!((acceleration / expected - 1.0).abs() < 1e-6, "{weld}: {acceleration} {expected}");
    }
    let (welded_to_world, _) = imported(&welded(&drawn, "body1=\"weight\""));
    // The bound covers rounding of the weight carried by the weld.
    assert!(initial_frame(&welded_to_world).bodies[index(&welded_to_world, "weight")].acceleration.norm() < 1e-9);
    let (hinged, _) = imported(&welded(&drawn, "body1=\"rod\" body2=\"weight\" torquescale=\"0\""));
    assert_eq!((hinged.machine.closing_joints.len(), hinged.machine.ball_joints.len()), (0, 1));
    let inactive = imported(&welded(&drawn, "body1=\"rod\" active=\"false\"")).1;
    assert!(inactive.contains("omitted: <weld> of <equality>"), "{inactive}");
    let messages = import_error(&welded(&drawn, "body1=\"rod\" body2=\"rod\""));
    assert!(messages.contains("weld w: both ends are on one body"), "{messages}");
}
