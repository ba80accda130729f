//! A scene that is rotated and shifted as a whole, together with its gravity, has the same motion.

use crate::common::parse;
use crate::elements::frame_at;
use jointplay_physics::machine::{Quat, Vec3};
use jointplay_physics::simulate::Simulation;
use jointplay_scene::{Scene, Texts, built_in_text};

const SHIFT: [f64; 3] = [0.3, -0.2, 0.1];
const POSE: &str = "position = \"0.3 -0.2 0.1 m\"\nrotation = { axis = [1, 2, -2], angle = \"50 deg\" }\n";
const GRAVITY: &str = "[gravity]\nz = \"-9.81 m/s^2\"\n";

fn rotation() -> Quat {
    Quat::from_axis_angle(&nalgebra::Unit::new_normalize(Vec3::new(1.0, 2.0, -2.0)), 50_f64.to_radians())
}

/// `text` rotated and shifted by [`POSE`], with its gravity rotated as well.
fn transformed(text: &str) -> String {
    assert!(text.contains(GRAVITY));
    let gravity = rotation() * Vec3::new(0.0, 0.0, -9.81);
    let component = |(axis, value): (&str, &f64)| format!("{axis} = \"{value:e} m/s^2\"\n");
    let components: String = ["x", "y", "z"].into_iter().zip(gravity.iter()).map(component).collect();
    format!("{POSE}{}", text.replace(GRAVITY, &format!("[gravity]\n{components}")))
}

/// Changes that reduce the error of a step to rounding.
const FINE: [(&str, &str); 2] = [("solver.method", "dopri5"), ("solver.tolerance", "1e-12")];

/// Asserts the same motion of both scenes until `time`, s: bodies within 1e-9 m, forces within 1e-8 of the largest.
fn assert_same_motion(name: &str, [plain, transformed]: [Scene; 2], time: f64) {
    let mut both = [plain, transformed].map(|scene| {
        let simulation = Simulation::new(&scene.machine);
        simulation.unwrap_or_else(|error| panic!("{name}: {error}"))
    });
    let [a, b] = both.each_mut().map(|simulation| frame_at(simulation, time));
    let (rotation, shift) = (rotation(), Vec3::from(SHIFT));
    let mut max_speed: f64 = 0.0;
    for (a, b) in a.bodies.iter().zip(&b.bodies) {
        let error = (rotation * a.position + shift - b.position).norm();
        assert!(error < 1e-9, "{name}: {error:e}");
        let error = (rotation.to_rotation_matrix().into_inner() * a.rotation - b.rotation).amax();
        assert!(error < 1e-8, "{name}: {error:e}");
        max_speed = max_speed.max(a.velocity.norm());
    }
    assert!(max_speed > 1e-3, "{name} does not move");
    let largest = a.elements.iter().map(|element| element.force.norm()).fold(1.0, f64::max);
    for (a, b) in a.elements.iter().zip(&b.elements) {
        let error = (rotation * a.force - b.force).norm();
        assert!(error < 1e-8 * largest, "{name}: {error:e} of {largest}");
    }
    for j in 0..a.joints.len() {
        let [a, b] = both.each_ref().map(|simulation| simulation.peak(j).0);
        assert!((a / b - 1.0).abs() < 3e-9 || a == b, "{name}, joint {j}: {a} {b}");
    }
}

#[test]
fn a_built_in_scene_has_the_same_motion_in_any_pose() {
    for (name, time) in
        [("pendulum", 0.01), ("slider-crank", 0.01), ("chain", 0.01), ("four-bar", 5e-3), ("suspension", 2e-3)]
    {
        let text = built_in_text(name).unwrap();
        assert_same_motion(name, [text.to_owned(), transformed(text)].map(|text| parse(&text, &FINE)), time);
    }
}

#[test]
fn every_element_and_kind_of_joint_is_rotated_with_the_scene() {
    let body = "mass = \"1 kg\"\ninertia = \"0.01 0.02 0.025 kg m^2\"\n";
    let text = format!(
        "{GRAVITY}
[[body]]\nname = \"a\"\n{body}
[[body]]\nname = \"b\"\n{body}
[[body]]\nname = \"c\"\n{body}
[[body]]\nname = \"d\"\n{body}
[[joint]]\nname = \"a\"\nkind = \"free\"\nchild = \"a\"\nchild_point = \"10 0 0 mm\"
start = {{ position = \"0 0 290 mm\", rotation = {{ axis = [0, 1, 0], angle = \"10 deg\" }}, \
velocity = \"0.1 0 0.2 m/s\", angular_velocity = \"1 2 3 rad/s\" }}
[[joint]]\nname = \"b\"\nkind = \"universal\"\nchild = \"b\"\naxis = [0, 1, 0]\nchild_axis = [1, 0, 0]
parent_point = \"500 0 0 mm\"
child_point = \"0 0 50 mm\"\nstart = {{ angle = \"20 deg\", child_angular_velocity = \"1 rad/s\" }}
[[joint]]\nname = \"c\"\nkind = \"cylindrical\"\nchild = \"c\"\naxis = [1, 0, 1]\nparent_point = \"0 500 0 mm\"
rotation = {{ axis = [1, 0, 0], angle = \"30 deg\" }}
[[joint]]\nname = \"d\"\nkind = \"prismatic\"\nchild = \"d\"\naxis = [0, 0, 1]\nparent_point = \"0 -500 290 mm\"
[[tyre]]\nname = \"tyre\"\non = {{ body = \"a\" }}\nradius = \"300 mm\"\nstiffness = \"20 kN/m\"\ndamping = \"50 N s/m\"
ground = {{ law = \"harmonic\", amplitude = \"5 mm\", frequency = \"4 Hz\" }}
[[tyre]]\nname = \"tyre-up\"\non = {{ body = \"d\" }}\nradius = \"300 mm\"\nup = [0, 0, 1]\nstiffness = \"20 kN/m\"
[[bushing]]\nname = \"from-world\"\nfrom = {{ body = \"world\", at = \"500 0 -40 mm\" }}
to = {{ body = \"b\", at = \"0 0 10 mm\" }}
stiffness = \"100 200 300 N/m\"\nturning_stiffness = \"1 2 3 N m/rad\"\nturning_damping = \"0.01 0.02 0.03 N m s/rad\"
axes = {{ axis = [0, 1, 1], angle = \"20 deg\" }}\nrotation = {{ axis = [1, 1, 0], angle = \"5 deg\" }}
[[bushing]]\nname = \"to-world\"\nfrom = {{ body = \"c\" }}\nto = {{ body = \"world\", at = \"0 500 10 mm\" }}
stiffness = \"100 200 300 N/m\"\nturning_stiffness = \"1 2 3 N m/rad\"
axes = {{ axis = [0, 1, 1], angle = \"20 deg\" }}\nrotation = {{ axis = [1, 1, 0], angle = \"5 deg\" }}
[[spring]]\nname = \"spring\"\nfrom = {{ body = \"world\", at = \"0 -500 600 mm\" }}\nto = {{ body = \"a\" }}
length = \"500 mm\"\nstiffness = \"100 N/m\"
[[load]]\nname = \"wind\"\non = {{ body = \"b\" }}\nforce = \"1 2 0 N\"\ntorque = \"0 0.1 0 N m\"
frequency = \"3 Hz\"\nphase = \"20 deg\"
[[load]]\nname = \"thrust\"\non = {{ body = \"a\", at = \"0 0 10 mm\" }}\nforce = \"1 2 0 N\"\naxes = \"body\"
[[joint_spring]]\nname = \"joint-spring\"\njoint = \"b\"\ncoordinate = \"angle\"\nstiffness = \"1 N m/rad\"
[[motor]]\nname = \"motor\"\njoint = \"c\"\ncoordinate = \"position\"\nforce = \"5 N\"
[[fixed_shape]]\nform = \"box\"\nrole = \"frame\"\ncentre = \"0 0 0 mm\"\nsize = \"10 20 30 mm\"
"
    );
    assert_same_motion("elements", [text.clone(), transformed(&text)].map(|text| parse(&text, &FINE)), 0.2);
}

#[test]
fn an_included_file_is_rotated_with_its_scene() {
    // The file is rotated and shifted in the scene, and its pattern in the file.
    let leg = "[[pattern]]\nname = \"rods\"\ncount = 3\nabout = { point = \"100 0 0 mm\", axis = [0, 0, 1] }\n\
        [[pattern.body]]\nname = \"rod\"\nmass = \"0.2 kg * i\"\ninertia = \"1e-3 1e-3 1e-3 kg m^2\"\n\
        [[pattern.joint]]\nname = \"rod\"\nkind = \"revolute\"\nparent = \"base\"\nchild = \"rod\"\naxis = [0, 1, 0]\n\
        parent_point = \"200 0 0 mm\"\nchild_point = \"0 0 100 mm\"\nstart = { position = \"30 deg\" }\n\
        [[pattern.spring]]\nname = \"s\"\nfrom = { body = \"world\", at = \"200 0 50 mm\" }\nto = { body = \"rod\" }\n\
        length = \"100 mm\"\nstiffness = \"50 N/m\"\n";
    let top = format!(
        "include = [{{ file = \"leg.toml\", name = \"left\", position = \"0 100 0 mm\", \
         rotation = {{ axis = [0, 1, 0], angle = \"40 deg\" }} }}]\n{GRAVITY}\
         [[body]]\nname = \"base\"\nmass = \"1 kg\"\ninertia = \"0.1 0.1 0.1 kg m^2\"\n\
         [[joint]]\nname = \"base\"\nkind = \"revolute\"\nchild = \"base\"\naxis = [1, 0, 0]\nstart = {{ velocity = \"1 rad/s\" }}\n"
    );
    let files = Texts::from([("leg.toml".to_owned(), leg.into())]);
    let changes = FINE.map(|(key, value)| (key.to_owned(), value.to_owned()));
    let both = [top.clone(), transformed(&top)].map(|text| Scene::parse_with(&text, None, &files, &changes).unwrap());
    assert_eq!(both[0].machine.bodies[3].name, "left.rod3");
    assert_same_motion("leg", both, 0.2);
}

#[test]
fn a_machine_and_its_closed_form_have_the_same_motion_in_any_pose() {
    let text = built_in_text("spcmm").unwrap();
    let (along_x, along_z) = ("[gravity]\nx = \"9.81 m/s^2\"\n", GRAVITY);
    assert!(text.contains(along_x));
    let plain = text.replace(along_x, along_z);
    let both = [plain.clone(), transformed(&plain)].map(|text| parse(&text, &FINE));
    let probe = both[0].machine.output.probe.unwrap();
    let mut tips = both.each_ref().map(|scene| {
        let frame = frame_at(&mut Simulation::new(&scene.machine).unwrap(), 0.02);
        let body = &frame.bodies[scene.machine.output.body];
        body.position + body.rotation * probe - frame.probe_error.unwrap()
    });
    tips[0] = rotation() * tips[0] + Vec3::from(SHIFT);
    assert!((tips[0] - tips[1]).norm() < 1e-12, "{tips:?}");
    assert_same_motion("spcmm", both, 0.02);
}
