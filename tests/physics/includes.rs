//! Files that a scene includes several times with names, values and poses.

use crate::common::{assert_refused, replaced};
use crate::elements::frame_at;
use jointplay_physics::machine::{Machine, Vec3};
use jointplay_physics::simulate::Simulation;
use jointplay_scene::{Scene, SceneError, Texts};

/// A leg on the scene's chassis, with two toes, a spring, a stop and a foot on the world.
const LEG: &str = r#"
[[parameter]]
name = "length"
value = "200 mm"
range = ["100 mm", "500 mm"]

[[parameter]]
name = "half"
value = "length / 2"
unit = "mm"

[[body]]
name = "thigh"
mass = "weight * length / 200 mm"
inertia = "1e-3 1e-3 1e-3 kg m^2"

[[joint]]
name = "hip"
kind = "revolute"
parent = "chassis"
child = "thigh"
axis = [0, 1, 0]
parent_point = "50 0 0 mm"
child_point = [0, 0, "half"]

[[pattern]]
name = "toes"
count = 2
along = "0 10 0 mm"

[[pattern.body]]
name = "toe"
mass = "10 g * i"
inertia = "1e-6 1e-6 1e-6 kg m^2"

[[pattern.joint]]
name = "toe"
kind = "revolute"
parent = "thigh"
child = "toe"
axis = [0, 1, 0]
parent_point = [0, 0, "-half"]
child_point = "0 0 10 mm"
start = { position = "20 deg" }

[[spring]]
name = "muscle"
from = { body = "chassis", at = "80 0 0 mm" }
to = { body = "thigh" }
length = "100 mm"
stiffness = "500 N/m"
damping = "1 N s/m"

[[spring]]
name = "tendon"
from = { body = "toe1" }
to = { body = "toe2" }
length = "10 mm"
stiffness = "50 N/m"

[[spring]]
name = "tether"
from = { body = "world", at = "300 0 0 mm" }
to = { body = "thigh" }
length = "200 mm"
stiffness = "20 N/m"

[[motor]]
name = "drive"
joint = "hip"
torque = "0.1 N m"
"#;

const CHASSIS: &str = r#"
[gravity]
z = "-9.81 m/s^2"

[[parameter]]
name = "weight"
value = "1 kg"

[[body]]
name = "chassis"
mass = "5 kg"
inertia = "0.1 0.1 0.1 kg m^2"

[[joint]]
name = "chassis"
kind = "revolute"
child = "chassis"
axis = [0, 0, 1]
start = { velocity = "1 rad/s" }
"#;

fn read(top: &str, leg: &str, changes: &[(&str, &str)]) -> Result<Scene, SceneError> {
    let files = Texts::from([("leg.toml".to_owned(), leg.into()), ("other.toml".to_owned(), leg.into())]);
    let changes: Vec<(String, String)> = changes.iter().map(|(key, value)| ((*key).into(), (*value).into())).collect();
    Scene::parse_with(&format!("name = \"top\"\n{top}{CHASSIS}"), Some("top.toml"), &files, &changes)
}

const TWO_LEGS: &str = "include = [\n\
    { file = \"leg.toml\", name = \"left\" },\n\
    { file = \"leg.toml\", name = \"right\", values = { length = \"2 * 150 mm\" }, position = \"0 -20 0 mm\", \
      rotation = { axis = [0, 0, 1], angle = \"180 deg\" } },\n]\n";

/// The leg written directly into the scene: names begin with `prefix`; if `turned`, it is rotated by half a turn and shifted.
fn written_out(prefix: &str, length: &str, turned: bool) -> String {
    let mut text = LEG.to_owned();
    for name in ["length", "half"] {
        // Parameters have no dots and no hyphens in their names.
        text = text.replace(&format!("name = \"{name}\""), &format!("name = \"{prefix}_{name}\""));
    }
    text = text
        .replace("value = \"200 mm\"", &format!("value = \"{length}\""))
        .replace("\"length / 2\"", &format!("\"{prefix}_length / 2\""));
    text = text
        .replace("weight * length", &format!("weight * {prefix}_length"))
        .replace("\"half\"", &format!("\"{prefix}_half\""));
    text = text.replace("\"-half\"", &format!("\"-{prefix}_half\""));
    for name in ["thigh", "hip", "toe", "toe1", "toe2", "muscle", "tendon", "tether", "drive", "toes"] {
        text = text.replace(&format!("\"{name}\""), &format!("\"{prefix}-{name}\""));
    }
    if turned {
        // Half a turn about z maps points and axes (x, y, z) to (-x, -y, z).
        text = text.replace(
            "axis = [0, 1, 0]\nparent_point = \"50 0 0 mm\"",
            "axis = [0, -1, 0]\nparent_point = \"-50 -20 0 mm\"\nrotation = { axis = [0, 0, 1], angle = \"180 deg\" }",
        );
        text = text
            .replace("at = \"80 0 0 mm\"", "at = \"-80 -20 0 mm\"")
            .replace("at = \"300 0 0 mm\"", "at = \"-300 -20 0 mm\"");
    }
    text
}

#[test]
fn including_a_file_twice_equals_writing_it_twice() {
    let included = read(TWO_LEGS, LEG, &[]).unwrap();
    let text = CHASSIS.to_owned() + &written_out("left", "200 mm", false) + &written_out("right", "300 mm", true);
    let direct = Scene::parse(&text, None, &[]).unwrap();
    let names = |scene: &Scene| -> Vec<String> {
        let machine = &scene.machine;
        let bodies = machine.bodies.iter().map(|body| body.name.clone());
        let joints = machine.joints.iter().map(|joint| joint.name.clone());
        bodies.chain(joints).chain(machine.elements.iter().map(|element| element.name.clone())).collect()
    };
    let dots: Vec<String> = names(&included).iter().map(|name| name.replace('.', "-")).collect();
    assert_eq!(dots, names(&direct).iter().map(|name| name.replace("toe-", "toe")).collect::<Vec<_>>());
    assert!(names(&included).contains(&"left.toe2".to_owned()));
    let mut both = [included, direct].map(|scene| {
        let mut machine = Machine::clone(&scene.machine);
        machine.solver.tolerance = 1e-10;
        Simulation::new(&machine).unwrap()
    });
    let [a, b] = both.each_mut().map(|simulation| frame_at(simulation, 0.3));
    for (a, b) in a.bodies.iter().zip(&b.bodies) {
        assert!((a.position - b.position).norm() < 1e-9 && (a.rotation - b.rotation).amax() < 1e-8);
    }
    assert!((a.bodies[1].position - a.bodies[2].position).norm() > 0.05);
}

#[test]
fn parameters_of_an_included_file_are_separate_and_can_be_set_by_the_scene() {
    let scene = read(TWO_LEGS, LEG, &[]).unwrap();
    // Rounded to grams, since the thigh's mass is computed.
    let mass = |scene: &Scene, name: &str| {
        let body = scene.machine.bodies.iter().find(|body| body.name == name).unwrap();
        (body.mass * 1e3).round() / 1e3
    };
    assert_eq!((mass(&scene, "left.thigh"), mass(&scene, "right.thigh"), mass(&scene, "left.toe2")), (1.0, 1.5, 0.02));
    let keys: Vec<&str> = scene.source.own.iter().map(|row| row.key).collect();
    assert_eq!(keys, ["parameter.weight", "parameter.left.length", "parameter.right.length"]);
    // Both legs see a parameter of the scene, unless the file defines one of the same name.
    let heavy = read(TWO_LEGS, LEG, &[("parameter.weight", "2 kg"), ("parameter.left.length", "100 mm")]).unwrap();
    assert_eq!((mass(&heavy, "left.thigh"), mass(&heavy, "right.thigh")), (1.0, 3.0));
    let leg_with_weight = format!("[[parameter]]\nname = \"weight\"\nvalue = \"4 kg\"\n{LEG}");
    let both = read(TWO_LEGS, &leg_with_weight, &[("parameter.weight", "2 kg")]).unwrap();
    assert_eq!(mass(&both, "left.thigh"), 4.0);
    // Values given in the scene can be saved; numbers of the included file cannot.
    let mut changed = scene.clone();
    changed.set("parameter.right.length", "400 mm").unwrap();
    assert_eq!(mass(&changed, "right.thigh"), 2.0);
    assert!(changed.to_toml().unwrap().contains("values = { length = \"400 mm\" }"));
    changed.set("include.right.position.y", "-30 mm").unwrap();
    assert!(changed.to_toml().unwrap().contains("position = [\"0 mm\", \"-30 mm\", \"0 mm\"]"));
    changed.set("joint.left.hip.parent_point.x", "60 mm").unwrap();
    let joint = changed.machine.joints.iter().find(|joint| joint.name == "left.hip").unwrap();
    assert_eq!(joint.parent_point, Vec3::new(0.06, 0.0, 0.0));
    assert!(changed.to_toml().unwrap_err().to_string().contains("another file"));
}

#[test]
fn parts_of_an_included_file_are_reached_by_their_full_names() {
    let more = "[output]\nbody = \"right.toe1\"\n[[load]]\nname = \"pull\"\non = { body = \"left.thigh\" }\nforce = \"1 0 0 N\"\n\
                [[stop]]\nname = \"stop\"\njoint = \"left.hip\"\nlower = \"-30 deg\"\ntorque = \"1 N m\"\ndepth = \"1 deg\"\n";
    let scene = read(&format!("{TWO_LEGS}{more}"), LEG, &[]).unwrap();
    let machine = &scene.machine;
    assert_eq!(machine.bodies[machine.output.body].name, "right.toe1");
    let error =
        read(&format!("{TWO_LEGS}{more}").as_str().replace("left.hip", "left.hop"), LEG, &[]).unwrap_err().to_string();
    assert!(error.contains("did you mean `left.hip`"), "{error}");
    // Without a name for the file, its parts keep their names.
    let scene = read("include = [{ file = \"leg.toml\" }]\n", LEG, &[]).unwrap();
    assert!(scene.machine.bodies.iter().any(|body| body.name == "toe2"));
    assert_eq!(scene.machine, read("include = [\"leg.toml\"]\n", LEG, &[]).unwrap().machine);
}

#[test]
fn invalid_includes_are_refused_with_their_position() {
    let one = |more: &str| format!("[[include]]\nfile = \"leg.toml\"\n{more}\n");
    let cases = r#"
        name = "body" -> top.toml:4:8: include.body.name = "body" | a word of scene files
        name = "a b" -> top.toml:4:8: include.a b.name | is not a name
        name = "left"; values = { lenght = "1 m" } -> top.toml:5:21: include.left.values.lenght | is no parameter of leg.toml (did you mean `length`?)
        name = "left"; values = { length = "1 m" } -> top.toml:5:21: parameter.left.length = "1 m" | nm, km; the parameter is defined in line 2 of leg.toml
        name = "left"; values = { length = "1 kg" } -> top.toml:5:21: parameter.left.length = "1 kg" | mm
        name = "left"; values = 3 -> top.toml:5:10: include.left.values | must be a table
        name = "left"; scale = 3 -> top.toml:5:1: include.left.scale | unknown key
        name = "left"; position = "1 0 0" -> top.toml:5:12: include.left.position | unit
        name = "left"; [[include]]; file = "leg.toml"; name = "left" -> top.toml:7:8: include.left.name | already a file of this name
        [[include]]; file = "leg.toml"; name = "left" -> top.toml:5:8: include.left.file | needs a `name` each time
    "#;
    assert_refused(cases, |more| read(&one(more), LEG, &[]));
    let in_file = r#"
        mass = "weight => mass = "wight -> leg.toml:14:8: body.left.thigh.mass | wight
        { body = "toe1" } => { body = "toe3" } -> leg.toml:56:17: spring.left.tendon.from.body | no body `left.toe3`
    "#;
    let with = |change: &str, top: &str| {
        let (from, to) = change.split_once(" => ").expect(change);
        read(top, &replaced(LEG, from, to), &[])
    };
    assert_refused(in_file, |change| with(change, &one("name = \"left\"")));
    // The other copy of the file has a parameter of the same name, defined later; and where the parameter itself comes later.
    let in_both = r#"
        unit = "mm" => unit = "mm"; range = ["150 mm", "200 mm"] -> leg.toml:9:9: parameter.left.half = "length / 2" | out of range; allowed 150 mm to 200 mm
        "length / 2"; unit = "mm" => "late / 2"; unit = "mm"; [[parameter]]; name = "late"; value = "1 m" -> leg.toml:9:9: parameter.left.half = "late / 2" | uses the parameter late, which is defined after it
    "#;
    assert_refused(in_both, |change| with(change, &(one("name = \"left\"") + &one("name = \"right\""))));
}
