//! The built-in scenes as a whole: they load, and their loops close.

use std::sync::Arc;

use super::*;
use jointplay_physics::integrate::{Method, StepControl};
use jointplay_physics::machine::{ElementKind, Solver};

/// World poses of all bodies at the file's start, without drives.
fn start_poses(scene: &Scene) -> Vec<(Vec3, Quat)> {
    let mut poses: Vec<(Vec3, Quat)> = Vec::new();
    for joint in &scene.machine.joints {
        let (origin, frame) = joint.parent.map_or((Vec3::zeros(), Quat::identity()), |parent| poses[parent]);
        let q = match joint.start {
            JointStart::Scalar { position, .. } => position,
            JointStart::Pair { .. } => panic!("no built-in scene has one"),
            JointStart::Pose { position, rotation, .. } => {
                poses.push((position, rotation));
                continue;
            }
        };
        let (rotation, slide) = match joint.kind {
            JointKind::Revolute => {
                let turn = Quat::from_axis_angle(&nalgebra::Unit::new_normalize(joint.axis), q);
                (frame * turn * joint.rotation, Vec3::zeros())
            }
            _ => (frame * joint.rotation, joint.axis * q),
        };
        poses.push((origin + frame * (joint.parent_point + slide) - rotation * joint.child_point, rotation));
    }
    poses
}

#[test]
fn every_ball_of_every_built_in_scene_starts_in_the_centre_of_its_socket() {
    for name in BUILT_IN {
        let scene = Scene::load(name, &[]).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(scene.name, name);
        assert!(!scene.machine.loose_joints.is_empty(), "{name}");
        if scene.machine.start == StartRule::Ideal {
            // Assembled at the start: see `tests/physics/machines.rs`.
            continue;
        }
        let poses = start_poses(&scene);
        let point = |end: Attachment| end.body.map_or(end.point, |body| poses[body].0 + poses[body].1 * end.point);
        for joint in &scene.machine.loose_joints {
            let e = point(joint.carried()) - point(joint.carrier());
            assert!(e.norm() < 1e-9, "{name}: {} starts {:e} m off its socket's centre", joint.name, e.norm());
        }
    }
}

#[test]
fn joints_follow_their_bodies_and_parents_come_first() {
    for name in BUILT_IN {
        let scene = Scene::load(name, &[]).unwrap();
        for (index, joint) in scene.machine.joints.iter().enumerate() {
            assert_eq!(joint.child, index, "{name}");
            assert!(joint.parent.is_none_or(|parent| parent < index), "{name}");
        }
    }
}

/// The default scene is the paper's machine in another motion, and no copy that drifts away from it.
#[test]
fn the_default_scene_is_the_papers_machine_but_for_its_motion() {
    let paper = Scene::load("spcmm", &[]).unwrap();
    let settings = [("spcmm.frequency", "0.5 Hz"), ("contact.approach_speed", "start")];
    let mut own = changed(DEFAULT_SCENE, &settings);
    assert_ne!(own.machine, changed(DEFAULT_SCENE, &[]).machine);
    assert_eq!(own.machine, paper.machine);
    assert_eq!(own.overrides, paper.overrides);
    assert!(own.view.time_scale > paper.view.time_scale);
    (own.view.time_scale, own.view.plots) = (paper.view.time_scale, paper.view.plots);
    assert_eq!(own.view, paper.view);
    // Its parameters are those of the paper's scene, but for what is said of the frequency and for how far its slider goes.
    assert_eq!(own.own.len(), paper.own.len());
    for (own, paper) in own.own.iter().zip(&paper.own) {
        let differs = own.key == "spcmm.frequency";
        assert_eq!((own.key, own.label, own.equation), (paper.key, paper.label, paper.equation));
        assert!(own == paper || differs, "{}", own.key);
    }
    // What neither of these holds, such as comments, differs in no more lines than the values and words above have.
    let lines = |scene: &Scene| scene.source.text.lines().map(str::to_owned).collect::<std::collections::BTreeSet<_>>();
    let (own, paper) = (lines(&own), lines(&paper));
    let other = own.difference(&paper).chain(paper.difference(&own)).count();
    assert!(other <= 32, "{other} lines differ");
}

fn changed(name: &str, changes: &[(&str, &str)]) -> Scene {
    let changes: Vec<_> = changes.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
    Scene::load(name, &changes).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn every_parameter_reads_writes_and_displays_its_default() {
    for parameter in table() {
        if parameter.default != Value::Unset {
            let text = parameter.write(&parameter.default);
            assert_eq!(parameter.read(&text), Ok(parameter.default.clone()), "{}", parameter.key);
        }
        assert!(parameter.help.ends_with('.'), "{}", parameter.key);
        if let Kind::Number { min, max, slider: (low, high), dimension, display, logarithmic, .. } = parameter.kind {
            assert!(min <= low && low < high && high <= max, "{}", parameter.key);
            assert!(!logarithmic || low > 0.0, "{}", parameter.key);
            let units = unit_names(dimension);
            assert!(units.contains(&display) || units.is_empty() && display.is_empty());
        }
        assert_eq!(table().iter().filter(|other| other.key == parameter.key).count(), 1);
        assert!(reference_page().contains(&format!("| `{}` |", parameter.key)));
    }
}

#[test]
fn every_parameter_of_every_scene_can_be_read_and_set_to_the_same_value() {
    for name in BUILT_IN {
        let original = Scene::load(name, &[]).unwrap();
        for parameter in original.parameters() {
            let mut scene = original.clone();
            let value = scene.get(parameter.key).unwrap();
            if value == Value::Unset {
                continue;
            }
            scene.set_value(parameter.key, &value).unwrap();
            assert_eq!(scene.get(parameter.key).unwrap(), value, "{name}: {}", parameter.key);
            assert_eq!(scene.changes.len(), 1);
            assert_eq!(scene.machine.bodies, original.machine.bodies);
            assert_eq!(scene.machine.solver.method, original.machine.solver.method);
        }
    }
}

#[test]
fn a_joint_value_overrides_the_scene_value_whichever_is_set_last() {
    let orders = [["joint.S1.clearance", "contact.clearance"], ["contact.clearance", "joint.S1.clearance"]];
    for [first, second] in orders {
        let value = |key: &str| {
            if key.starts_with("joint") { "0.7 mm" } else { "0.1 mm" }
        };
        let scene = changed("spcmm", &[(first, value(first)), (second, value(second))]);
        let clearances: Vec<f64> = scene.machine.loose_joints.iter().map(|joint| joint.contact.clearance).collect();
        assert_eq!(clearances, [0.7e-3, 0.1e-3, 0.1e-3]);
        assert_eq!(scene.get("contact.clearance"), Ok(Value::Number(0.1e-3)));
        assert_eq!(scene.get("joint.S2.clearance"), Ok(Value::Number(0.1e-3)));
        assert_eq!(scene.overrides[0], ["clearance"]);
    }
    // The override at B in the file is unaffected.
    let scene = changed("slider-crank", &[("contact.clearance", "0.5 mm")]);
    assert_eq!(scene.machine.loose_joints[0].contact.clearance, 0.0);
    assert_eq!(scene.machine.loose_joints[1].contact.clearance, 0.5e-3);
}

#[test]
fn the_last_of_two_changes_wins_and_only_the_result_is_checked() {
    let scene = changed("spcmm", &[("contact.friction", "0.2"), ("contact.friction", "0.3")]);
    assert_eq!(scene.machine.contact.friction, 0.3);
    assert_eq!(scene.changes, [("contact.friction".to_owned(), "0.3".to_owned())]);
    // A gap wider than the file's ball is valid with the larger ball set by the same changes.
    let scene = changed("spcmm", &[("contact.clearance", "12 mm"), ("contact.ball_radius", "20 mm")]);
    assert_eq!(scene.machine.loose_joints[2].contact.clearance, 0.012);
}

#[test]
fn a_preset_and_a_method_are_refused_together_and_a_change_replaces_the_one_of_the_text() {
    let preset = ("solver.preset", "reference");
    let method = ("solver.method", "rk4");
    let owned = |(key, value): (&str, &str)| (key.to_owned(), value.to_owned());
    for changes in [[preset, method], [method, preset]] {
        let error = Scene::load("spcmm", &changes.map(owned)).unwrap_err();
        assert_eq!(error.key.as_deref(), Some("solver.method"));
        assert!(error.message.contains("give a preset, or a method with its number"), "{error}");
    }
    let text = |solver: &str| format!("{}\n[solver]\n{solver}\n", built_in_text("pendulum").unwrap());
    let parse = |solver: &str, changes: &[(&str, &str)]| {
        Scene::parse(&text(solver), None, &changes.iter().copied().map(owned).collect::<Vec<_>>())
    };
    for key in SOLVER_KEYS {
        let number = match key {
            "solver.method" => "method = \"rk4\"",
            "solver.step" => "step = \"1 us\"",
            "solver.tolerance" => "tolerance = 1e-5",
            _ => "steps_per_impact = 8",
        };
        let error = parse(&format!("{number}\npreset = \"accurate\""), &[]).unwrap_err();
        assert!(error.message.contains(&format!("leave out either solver.preset or {key}")), "{error}");
        assert!(error.position.is_some());
    }
    let replaced = parse("tolerance = 1e-5\nmethod = \"rk4\"", &[preset]).unwrap();
    assert_eq!(replaced.machine.solver, Preset::Reference.solver(&replaced.machine));
    let replaced = parse("preset = \"reference\"", &[("solver.tolerance", "1e-5")]).unwrap();
    assert_eq!(replaced.machine.solver, Solver { tolerance: 1e-5, ..Solver::default() });
    for scene in [parse("tolerance = 1e-5\nmethod = \"rk4\"", &[preset]), Ok(replaced)] {
        let scene = scene.unwrap();
        let written = Scene::parse(&scene.to_toml().unwrap(), None, &[]).unwrap();
        assert_eq!(written.machine.solver, scene.machine.solver);
    }
}

#[test]
fn a_setting_changed_on_top_of_a_preset_keeps_its_method_and_number() {
    let owned = |pairs: &[(&str, &str)]| pairs.iter().map(|(k, v)| ((*k).into(), (*v).into())).collect::<Vec<_>>();
    let mut scene = changed("hexapod", &[("solver.preset", "real-time")]);
    let own = scene.machine.solver;
    let without = |scene: &Scene, key: &str| scene.value_without_change(&changed("hexapod", &[]), key);
    scene.set("solver.tolerance", "1e-5").unwrap();
    assert_eq!(scene.machine.solver, Solver { preset: None, tolerance: 1e-5, ..own });
    let changes = owned(&[
        ("solver.method", "discrete-gradient"),
        ("solver.steps_per_impact", "24"),
        ("solver.tolerance", "1e-5"),
    ]);
    assert_eq!(scene.changes, changes);
    assert_eq!(without(&scene, "solver.tolerance"), Some(Value::Number(1e-6)));
    // The same as a list, and back.
    assert_eq!(Scene::load("hexapod", &changes).unwrap().machine.solver, scene.machine.solver);
    scene.set("solver.preset", "real-time").unwrap();
    assert_eq!((scene.machine.solver, scene.changes.len()), (own, 1));

    let text = format!("{}\n[solver]\npreset = \"reference\"\n", built_in_text("pendulum").unwrap());
    let file = Scene::parse(&text, None, &[]).unwrap();
    let mut scene = file.clone();
    scene.set("solver.tolerance", "1e-9").unwrap();
    assert_eq!(scene.changes, owned(&[("solver.method", "dopri5"), ("solver.tolerance", "1e-9")]));
    // While another change sets the solver, the preset of the text does not come back.
    for (key, value) in [("solver.method", Value::Choice("automatic")), ("solver.tolerance", Value::Number(1e-11))] {
        assert_eq!(scene.value_without_change(&file, key), Some(value.clone()));
        scene.undo_change(key).unwrap();
        assert_eq!(scene.get(key), Ok(value));
    }
    assert_eq!(scene.machine.solver, file.machine.solver);
    // A refused value leaves all as it was.
    assert!(scene.set("solver.tolerance", "-1").is_err());
    assert_eq!((scene.machine.solver, scene.changes.len()), (file.machine.solver, 0));
}

#[test]
fn a_change_of_a_key_that_only_the_file_can_set_is_rejected_with_that_reason() {
    for key in ["closed_form.frequency", "output.body", "name", "title"] {
        let error = Scene::load("spcmm", &[(key.to_owned(), "1".to_owned())]).unwrap_err();
        assert!(error.message.starts_with("only in the scene file"), "{error}");
    }
}

#[test]
fn a_missing_drive_value_is_requested_in_the_unit_of_its_joint() {
    for (kind, like) in [("revolute", "10 deg"), ("prismatic", "10 mm")] {
        let text = format!(
            "[[body]]\nname = \"rod\"\nmass = \"1 kg\"\ninertia = \"1 1 1 kg m^2\"\n\
             [[joint]]\nname = \"P\"\nkind = \"{kind}\"\nchild = \"rod\"\naxis = [0, 0, 1]\n\
             drive = {{ law = \"harmonic\", frequency = \"1 Hz\" }}"
        );
        let error = Scene::parse(&text, None, &[]).unwrap_err();
        assert!(error.message.contains(&format!("\"{like}\"")), "{error}");
    }
}

#[test]
fn the_help_of_the_presets_states_their_settings() {
    let help = table().iter().find(|p| p.key == "solver.preset").unwrap().help;
    for preset in Preset::ALL {
        for scene in ["pendulum", "spcmm", "suspension"] {
            let solver = preset.solver(&changed(scene, &[]).machine);
            let value = match solver.method.control() {
                StepControl::PerImpact => format!("{}, {}", solver.method, solver.steps_per_impact),
                _ => format!("{}, {:e}", solver.method, solver.tolerance),
            };
            assert!(help.contains(&value), "{preset:?}: {value}");
        }
    }
}

#[test]
fn a_change_can_be_undone() {
    let mut scene = changed("spcmm", &[("joint.S1.friction", "0"), ("contact.friction", "0.4")]);
    scene.undo_change("joint.S1.friction").unwrap();
    assert_eq!(scene.get("joint.S1.friction"), Ok(Value::Number(0.4)));
    scene.undo_change("contact.friction").unwrap();
    assert_eq!(scene.get("contact.friction"), Ok(Value::Number(0.15)));
    assert!(scene.changes.is_empty());
}

#[test]
fn a_chain_is_rebuilt_when_its_number_of_links_changes() {
    let mut scene = changed("chain", &[("joint.J2.friction", "0.4"), ("joint.J7.friction", "0.5")]);
    assert_eq!((scene.machine.bodies.len(), scene.machine.loose_joints.len()), (8, 8));
    scene.set("chain.links", "3").unwrap();
    assert_eq!((scene.machine.bodies.len(), scene.machine.joints.len(), scene.machine.loose_joints.len()), (3, 3, 3));
    assert_eq!(scene.machine.loose_joints[1].contact.friction, 0.4);
    assert_eq!(scene.machine.output.body, 2);
    assert_eq!(scene.get("chain.links"), Ok(Value::Count(3)));
    // A change of a joint that no longer exists is dropped, too.
    assert!(scene.get("joint.J7.friction").is_err());
    assert_eq!(scene.changes.len(), 2);
    scene.set("chain.links", "9").unwrap();
    scene.set("joint.J9.friction", "0.5").unwrap();
    scene.set("body.link9.mass", "1 kg").unwrap();
    scene.undo_change("chain.links").unwrap();
    assert_eq!(scene.changes, [("joint.J2.friction".to_owned(), "0.4".to_owned())]);
    for many in ["100000", "1000000000", "1e300"] {
        let why = scene.set("chain.links", many).expect_err("too many").to_string();
        assert!(why.contains("allowed 1 to 4096; a whole number"), "{why}");
    }
    assert_eq!(changed("chain", &[("chain.links", "256")]).machine.bodies.len(), 256);
}

#[test]
fn a_copy_of_a_pattern_refers_to_the_previous_one() {
    let text = "parameter = [{ name = \"n\", key = \"links\", value = 3, whole = true }]\n\
                joint = [{ name = \"h1\", kind = \"revolute\", child = \"bar1\", axis = [0, 1, 0] }]\n\
                [[pattern]]\nname = \"bars\"\ncount = \"n\"\nalong = \"0 0 -1 m\"\n\
                body = [{ name = \"bar\", mass = \"1 kg\", inertia = \"1 1 1 kg m^2\" }]\n\
                joint = [{ name = \"h\", kind = \"revolute\", parent = \"previous.bar\", child = \"bar\", axis = [0, 1, 0], \
                parent_point = \"0 0 -1 m\" }]\n\
                joint_spring = [{ name = \"k\", joint = \"previous.h\", stiffness = \"1 N m/rad\" }]\n";
    let mut scene = Scene::parse(text, None, &[]).unwrap();
    let parents = |scene: &Scene| scene.machine.joints.iter().map(|joint| joint.parent).collect::<Vec<_>>();
    assert_eq!(parents(&scene), [None, Some(0), Some(1)]);
    // Coordinates on the previous bar are in its frame and do not shift with the copy.
    assert!(scene.machine.joints[1..].iter().all(|joint| joint.parent_point == Vec3::new(0.0, 0.0, -1.0)));
    let springs: Vec<&str> = scene.machine.elements.iter().map(|element| &*element.name).collect();
    assert_eq!(springs, ["k2", "k3"]);
    scene.set("links", "5").unwrap();
    assert_eq!(parents(&scene).len(), 5);
    assert!(scene.to_toml().unwrap().contains("value = 5, whole"));
    let error = Scene::parse(&text.replace("previous.bar", "previous.rod"), None, &[]).unwrap_err().to_string();
    assert!(error.contains("no body `previous.rod`"), "{error}");
    let error = Scene::parse(&text.replace("count = \"n\"", "count = \"n / 2\""), None, &[]).unwrap_err().to_string();
    assert!(error.contains("allowed 1 to 10000; a whole number"), "{error}");
}

#[test]
fn the_slider_plane_moves_sliders_and_rails() {
    let mut scene = changed("spcmm", &[]);
    scene.set("spcmm.slider_plane", "40mm").unwrap();
    assert_eq!(scene.machine.joints[0].parent_point, Vec3::new(0.040, 0.0, 0.0));
    let Geometry::Box { centre, .. } = scene.machine.fixed_shapes[0].geometry else { panic!("a rail is a box") };
    assert!((centre.x - 0.018).abs() < 1e-15);
}

#[test]
fn doubtful_parameter_values_cause_warnings() {
    assert!(changed("spcmm", &[]).machine.warnings().is_empty());
    let warnings = changed("spcmm", &[("contact.restitution", "0.3")]).machine.warnings();
    assert!(warnings.len() == 1 && warnings[0].to_string().contains("S1, S2, S3: restitution 0.3"), "{warnings:?}");
    for (law, requested, effective) in [
        ("lankarani-nikravesh", "0.9", None),
        ("lankarani-nikravesh", "0.8", Some("0.847")),
        ("hunt-crossley", "0.8", Some("0.833")),
        ("hertz", "0.9", Some("1.000")),
        ("hertz", "1", None),
        ("flores", "0.7", None),
        ("flores", "0.1", Some("0.069")),
        ("gonthier", "0.1", None),
    ] {
        let warnings =
            changed("spcmm", &[("contact.restitution", requested), ("contact.normal_law", law)]).machine.warnings();
        let texts: Vec<String> = warnings.iter().map(ToString::to_string).collect();
        match effective {
            None => assert_eq!(texts, [""; 0], "{law} {requested}"),
            Some(effective) => assert!(
                texts.len() == 1
                    && texts[0].contains(&format!("restitution {requested} with {law} gives {effective} ")),
                "{law} {requested}: {texts:?}"
            ),
        }
    }
    let warnings = changed("spcmm", &[("joint.S2.clearance", "0.01 mm")]).machine.warnings();
    assert!(warnings.len() == 1 && warnings[0].to_string().starts_with("S2: clearance 0.01 mm"), "{warnings:?}");
    assert!(changed("spcmm", &[("contact.clearance", "0")]).machine.warnings().is_empty());
    let coarse = [("solver.method", "rk4"), ("solver.step", "50 us")];
    assert!(changed("spcmm", &coarse).machine.warnings()[0].to_string().contains("50 us"));
}

#[test]
fn the_built_in_scenes_have_the_published_numbers() {
    let scene = changed("spcmm", &[]);
    let find = |name: &str| scene.machine.bodies.iter().find(|body| body.name == name).unwrap();
    assert_eq!(find("platform").inertia.diagonal(), Vec3::new(4.44e-4, 3.31e-4, 1.35e-4));
    // 1.92e-3 about the hinge axis: y for rods 1 and 2, z for rod 3.
    for (rod, hinge) in [("rod1", Vec3::y()), ("rod2", Vec3::y()), ("rod3", Vec3::z())] {
        let body = find(rod);
        assert_eq!(hinge.dot(&(body.inertia * hinge)), 1.92e-3);
        let child = scene.machine.bodies.iter().position(|other| other.name == rod).unwrap();
        assert_eq!(scene.machine.joints[child].axis, hinge);
    }
    let mass: f64 = scene.machine.bodies.iter().map(|body| body.mass).sum();
    assert!((mass - (3.0 * 0.168 + 3.0 * 0.384 + 0.490)).abs() < 1e-15);
    assert_eq!(scene.machine.gravity, Vec3::new(9.81, 0.0, 0.0));
    assert_eq!(scene.machine.start, StartRule::Ideal);
    assert_eq!(scene.machine.bodies[scene.machine.output.body].name, "platform");
    assert_eq!(scene.machine.contact.friction_velocity, jointplay_physics::contact::FrictionVelocity::Centres);
}

#[test]
fn the_slider_crank_starts_with_consistent_velocities() {
    let scene = changed("slider-crank", &[]);
    let rod = scene.machine.bodies.iter().position(|body| body.name == "rod").unwrap();
    let JointStart::Pose { rotation, velocity, angular_velocity, .. } = scene.machine.joints[rod].start else {
        panic!("the rod is free")
    };
    let end = |x: f64| velocity + angular_velocity.cross(&(rotation * Vec3::new(x, 0.0, 0.0)));
    // Crank pin: 6 rad/s times 0.08 m along -Y; slider: 0.24 m/s along X.
    assert!((end(-0.15) - Vec3::new(0.0, -0.48, 0.0)).norm() < 1e-15);
    assert!((end(0.15) - Vec3::new(0.24, 0.0, 0.0)).norm() < 1e-15);
    assert!(angular_velocity.dot(&(rotation * Vec3::x())).abs() < 1e-15);
    let driven = changed("slider-crank-driven", &[]);
    let crank = driven.machine.joints.iter().find(|joint| joint.name == "crank");
    let law = crank.and_then(|joint| joint.drive.as_ref()).expect("driven");
    assert_eq!(*law, Drive::Constant { position: 0.0, velocity: 6.0 });
    // Otherwise they are the same mechanism.
    assert_eq!(driven.machine.bodies, scene.machine.bodies);
    assert_eq!(driven.machine.loose_joints, scene.machine.loose_joints);
}

#[test]
fn all_forms_of_a_rotation_agree() {
    let rotation = |form: &str| {
        let text = format!(
            "[[body]]\nname = \"a\"\nmass = \"1 kg\"\ninertia = \"1 1 1 kg m^2\"\n[[joint]]\nname = \"a\"\nkind = \"free\"\n\
             child = \"a\"\nchild_point = \"1 0 0 m\"\nstart = {{ position = \"0 0 0 m\", rotation = {form}, \
             angular_velocity = \"0 0 2 rad/s\" }}"
        );
        let scene = Scene::parse(&text, None, &[]).unwrap_or_else(|error| panic!("{error}"));
        let JointStart::Pose { position, rotation, velocity, .. } = scene.machine.joints[0].start else { panic!() };
        // The joint point, 1 m out on the body's x axis, is at the origin and at rest.
        assert!((position + rotation * Vec3::x()).norm() < 1e-15);
        assert!((velocity - Vec3::new(0.0, 0.0, 2.0).cross(&position)).norm() < 1e-15);
        rotation.to_rotation_matrix().into_inner()
    };
    let expected = Mat3::new(0.0, 0.0, 1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0);
    for form in [
        "{ axis = [0, 2, 0], angle = \"90 deg\" }",
        "{ sequence = \"xzy\", angles = [0, 0, \"90 deg\"] }",
        "{ x = [0, 0, -3], y = [0, 1, -1] }",
        "{ quaternion = [1, 0, 1, 0] }",
    ] {
        assert!((rotation(form) - expected).norm() < 1e-15, "{form}");
    }
    // R = Rx Rz Ry, paper eq. (2): R12 = -sin beta.
    let r = rotation("{ sequence = \"xzy\", angles = \"10 20 30 deg\" }");
    assert!((r[(0, 1)] + libm::sin(20.0_f64.to_radians())).abs() < 1e-15);
    assert!((r[(1, 1)] - libm::cos(10.0_f64.to_radians()) * libm::cos(20.0_f64.to_radians())).abs() < 1e-15);
}

/// A rod on a slide, with a user-defined parameter.
const SCENE_WITH_PARAMETERS: &str = "
[[parameter]]
name = \"stroke\"
label = \"Stroke\"
value = \"20 mm\"
range = [\"10 mm\", \"50 mm\"]

[[parameter]]
name = \"speed\"
value = \"2 * stroke / 1 s\"
unit = \"mm/s\"

[[body]]
name = \"rod\"
mass = \"1 kg\" # a comment
centre = \"1 2 3 mm\"
inertia = \"1 1 1 kg m^2\"

[[joint]]
name = \"slide\"
kind = \"prismatic\"
child = \"rod\"
axis = [0, 0, 1]
parent_point = [\"stroke / 2\", 0, \"-(stroke + 1 cm)\"]
start = { position = \"0.5 * stroke\", velocity = \"speed\" }
";

#[test]
fn every_number_in_a_file_has_a_key() {
    let scene = Scene::parse(SCENE_WITH_PARAMETERS, None, &[]).expect("reads");
    let joint = |scene: &Scene| (scene.machine.joints[0].parent_point, scene.machine.joints[0].start);
    let start = |position, velocity| JointStart::Scalar { position, velocity };
    assert_eq!(joint(&scene), (Vec3::new(0.01, 0.0, -0.03), start(0.01, 0.04)));
    let mut changed = scene.clone();
    for (key, value) in [
        ("parameter.stroke", "40 mm"),
        ("body.rod.mass", "3 kg"),
        ("body.rod.centre.y", "7 mm"),
        ("joint.slide.parent_point.x", "1 mm"),
        ("joint.slide.start.velocity", "5 mm/s"),
    ] {
        changed.set(key, value).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(
            changed.get(key),
            Ok(Value::Number(parse_quantity(value, changed.source.numbers[key].dimension).unwrap()))
        );
    }
    assert_eq!(joint(&changed), (Vec3::new(0.001, 0.0, -0.05), start(0.02, 0.005)));
    assert_eq!((changed.machine.bodies[0].mass, changed.machine.bodies[0].centre.y), (3.0, 0.007));
    assert_eq!(changed.get("parameter.speed"), Ok(Value::Number(0.08)));
    // Changed values are replaced in place; nothing else changes.
    let text = changed.to_toml().expect("can be written back");
    for line in [
        "value = \"40 mm\"",
        "mass = \"3 kg\" # a comment",
        "centre = [\"1 mm\", \"7 mm\", \"3 mm\"]",
        "parent_point = [\"1 mm\", 0, \"-(stroke + 1 cm)\"]",
        "velocity = \"5 mm/s\"",
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
    let read = Scene::parse(&text, None, &[]).expect("reads");
    assert_eq!(joint(&read), joint(&changed));
    changed.undo_change("parameter.stroke").expect("was changed");
    assert_eq!(changed.machine.joints[0].parent_point.z, -0.03);
}

#[test]
fn a_user_parameter_is_listed_like_the_built_in_ones() {
    let scene = Scene::parse(SCENE_WITH_PARAMETERS, None, &[]).expect("reads");
    let rows = scene.parameters();
    let row = rows.iter().find(|row| row.key == "parameter.stroke");
    let row = row.expect("listed");
    assert_eq!((row.label, row.display_unit(), row.at_reset), ("Stroke", "mm", true));
    assert_eq!(row.range(), "10 mm to 50 mm");
    let speed = scene.parameter("parameter.speed").expect("known");
    // A parameter computed from others is an ordinary number.
    assert_eq!((speed.label, speed.display_unit()), ("parameter.speed", "m/s"));
}

#[test]
fn errors_in_numbers_and_expressions_state_the_cause() {
    let error = |from: &str, to: &str| {
        let text = SCENE_WITH_PARAMETERS.replace(from, to);
        assert_ne!(text, SCENE_WITH_PARAMETERS);
        Scene::parse(&text, Some("own.toml"), &[]).expect_err(to).to_string()
    };
    for (from, to, cause) in [
        ("\"stroke / 2\"", "\"strok / 2\"", "no variable `strok` (did you mean `stroke`?)"),
        ("\"stroke / 2\"", "\"stroke * stroke\"", "gives 0.0004 m^2, which is not in m; units m, cm"),
        ("\"stroke / 2\"", "\"stroke + speed\"", "adds or compares quantities of different dimensions"),
        ("\"stroke / 2\"", "\"sin(stroke) * 1 m\"", "takes a function of a quantity that is not a pure number"),
        ("\"stroke / 2\"", "\"10\"", "needs a unit"),
        ("\"stroke / 2\"", "\"2 * 5\"", "gives 10, which is not in m"),
        ("\"1 kg\"", "\"stroke * 1 kg\"", "gives 0.02 kg m, which is not in kg"),
        (
            "value = \"20 mm\"",
            "value = \"60 mm\"",
            "parameter.stroke = \"60 mm\": out of range; allowed 10 mm to 50 mm",
        ),
        ("[\"10 mm\", \"50 mm\"]", "[\"60 mm\", \"50 mm\"]", "the first value must be below the second"),
        ("\"stroke\"\n", "\"i\"\n", "cannot name a parameter"),
        ("\"speed\"\nvalue", "\"stroke\"\nvalue", "there is already a parameter of this name"),
        ("unit = \"mm/s\"", "unit = \"mph\"", "unknown unit"),
        ("unit = \"mm/s\"\n", "", "its unit cannot be told from an expression"),
    ] {
        let error = error(from, to);
        assert!(error.contains(cause) && error.starts_with("own.toml:"), "{error}");
    }
    let change = |key: &str, value: &str| {
        let change = (key.to_owned(), value.to_owned());
        Scene::parse(SCENE_WITH_PARAMETERS, None, &[change]).expect_err(key).to_string()
    };
    for (key, value, cause) in [
        ("parameter.stroke", "5 mm", "parameter.stroke = 5 mm: out of range; allowed 10 mm to 50 mm"),
        ("body.rod.mass", "-1 kg", "body.rod.mass = -1 kg: out of range; allowed above 0"),
        ("body.rod.mass", "1", "body.rod.mass = 1: needs a unit"),
        ("body.rod.maas", "1 kg", "unknown key (did you mean `body.rod.mass`?)"),
        ("joint.slide.start.velocit", "1 m/s", "did you mean `joint.slide.start.velocity`?"),
        ("body.rod.centre", "0 0 0 mm", "body.rod.centre = 0 0 0 mm: unknown key"),
    ] {
        let error = change(key, value);
        assert!(error.contains(cause), "{error}");
    }
}

#[test]
fn a_pattern_repeats_about_an_axis_and_along_a_line() {
    let text = "
[[body]]
name = \"table\"
mass = \"1 kg\"
inertia = \"1 1 1 kg m^2\"

[[joint]]
name = \"table\"
kind = \"fixed\"
child = \"table\"

[[pattern]]
name = \"leg\"
count = 3
about = { point = \"10 0 0 mm\", axis = [0, 0, 1] }
along = \"0 0 5 mm\"

[[pattern.body]]
name = \"rod\"
mass = \"i * 2 kg\"
inertia = \"1 1 1 kg m^2\"

[[pattern.joint]]
name = \"free\"
kind = \"free\"
child = \"rod\"
start = { position = \"20 0 0 mm\", velocity = \"1 0 0 m/s\" }

[[pattern.ball_joint]]
name = \"S\"
socket = { body = \"table\", at = \"20 0 0 mm\" }
ball = { body = \"rod\", at = \"0 0 1 mm\" }
opening = [1, 0, 0]

[[pattern.load]]
name = \"push\"
on = { body = \"rod\" }
force = \"1 0 0 N\"

[[pattern.fixed_shape]]
form = \"sphere\"
centre = \"20 0 0 mm\"
radius = \"1 mm\"
role = \"frame\"
";
    let scene = Scene::parse(text, None, &[]).expect("reads");
    let names: Vec<&str> = scene.machine.bodies.iter().map(|body| body.name.as_str()).collect();
    assert_eq!(names, ["table", "rod1", "rod2", "rod3"]);
    let near = |a: Vec3, b: Vec3| assert!((a - b).norm() < 1e-15, "{a} {b}");
    for copy in 0..3 {
        let angle = std::f64::consts::TAU / 3.0 * copy as f64;
        let radial = Vec3::new(libm::cos(angle), libm::sin(angle), 0.0);
        let place = Vec3::new(0.01, 0.0, 0.005 * copy as f64) + 0.01 * radial;
        let joint = &scene.machine.loose_joints[copy];
        assert_eq!(joint.name, format!("S{}", copy + 1));
        near(joint.carrier().point, place);
        // Points in the rod's frame are the same in every copy.
        near(joint.carried().point, Vec3::new(0.0, 0.0, 0.001));
        near(joint.opening, radial);
        assert_eq!(joint.carried().body, Some(copy + 1));
        let JointStart::Pose { position, velocity, rotation, .. } = scene.machine.joints[copy + 1].start else {
            panic!("free");
        };
        near(position, place);
        near(velocity, radial);
        near(rotation * Vec3::x(), radial);
        let ElementKind::Load(load) = &scene.machine.elements[copy].kind else {
            panic!("a load");
        };
        near(load.force, radial);
        assert_eq!(scene.machine.bodies[copy + 1].mass, 2.0 * (copy + 1) as f64);
        let Geometry::Sphere { centre, .. } = scene.machine.fixed_shapes[copy].geometry else {
            panic!("sphere");
        };
        near(centre, place);
    }
    // A rotated box becomes a plate of the same shape.
    let boxes = text.replace("form = \"sphere\"", "form = \"box\"").replace("radius = \"1 mm\"", "size = \"2 4 6 mm\"");
    let boxes = Scene::parse(&boxes, None, &[]).expect("reads");
    let Geometry::Box { centre, .. } = boxes.machine.fixed_shapes[0].geometry else {
        panic!("the first copy is not rotated");
    };
    near(centre, Vec3::new(0.02, 0.0, 0.0));
    let Geometry::Plate { corners, triangles, thickness } = &boxes.machine.fixed_shapes[1].geometry else {
        panic!("the second copy is rotated");
    };
    let angle = std::f64::consts::TAU / 3.0;
    let (x, y) =
        (Vec3::new(libm::cos(angle), libm::sin(angle), 0.0), Vec3::new(-libm::sin(angle), libm::cos(angle), 0.0));
    near(corners.iter().sum::<Vec3>() / 4.0, Vec3::new(0.01, 0.0, 0.005) + 0.01 * x);
    near(corners[1] - corners[0], 0.002 * x);
    near(corners[2] - corners[1], 0.004 * y);
    assert_eq!((triangles.len(), *thickness), (2, 0.006));
    // A change of a single copy is possible but cannot be written back.
    let mut changed = scene.clone();
    changed.set("body.rod2.mass", "9 kg").expect("a key");
    assert_eq!(changed.machine.bodies[2].mass, 9.0);
    let error = changed.to_toml().expect_err("cannot be written back");
    assert!(error.message.contains("every copy of a pattern has it"), "{error}");
    for (from, to, cause) in [
        ("count = 3", "count = 0", "out of range; allowed 1 to 10000"),
        (
            "about = { point = \"10 0 0 mm\", axis = [0, 0, 1] }\nalong = \"0 0 5 mm\"\n",
            "",
            "missing `about` or `along`",
        ),
        ("child = \"rod\"", "child = \"rot\"", "no body `rot`"),
        ("count = 3", "count = 3\nsize = 2", "unknown key"),
    ] {
        let error = Scene::parse(&text.replace(from, to), None, &[]).expect_err(to);
        assert!(error.message.contains(cause), "{error}");
    }
}

#[test]
fn a_scene_file_includes_parts_from_other_files() {
    let leg = "
[[parameter]]
name = \"reach\"
value = \"30 mm\"

[[body]]
name = \"leg\"
mass = \"2 kg\"
inertia = \"1 1 1 kg m^2\"

[[joint]]
name = \"leg\"
kind = \"free\"
child = \"leg\"
start = { position = [\"reach\", 0, 0] }
";
    let text = "
include = [\"leg.toml\"]

[[ball_joint]]
name = \"S\"
socket = { body = \"world\", at = [\"reach\", 0, 0] }
ball = { body = \"leg\" }
";
    let with = |leg: &str, text: &str, changes: &[(&str, &str)]| {
        let beside = Texts::from([("leg.toml".to_owned(), Arc::from(leg))]);
        let owned = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
        let changes: Vec<(String, String)> = changes.iter().map(owned).collect();
        Scene::parse_with(text, Some("scene.toml"), &beside, &changes)
    };
    let mut scene = with(leg, text, &[("body.leg.mass", "3 kg")]).expect("reads");
    assert_eq!(scene.machine.bodies[0].mass, 3.0);
    assert_eq!(scene.machine.loose_joints[0].carrier().point.x, 0.03);
    // A rebuild uses the file contents read before.
    scene.set("parameter.reach", "40 mm").expect("a key");
    assert_eq!(scene.machine.loose_joints[0].carrier().point.x, 0.04);
    assert_eq!(scene.machine.bodies[0].mass, 3.0);
    let error = scene.to_toml().expect_err("two files").to_string();
    assert!(error.contains("another file, which this one includes"), "{error}");
    for (leg, text, place, cause) in [
        (leg.replace("2 kg", "2"), text.to_owned(), "leg.toml:8:8: body.leg.mass", "needs a unit"),
        (leg.replace("[[body]]", "[[body"), text.to_owned(), "leg.toml:6:7: ", "not valid TOML"),
        (
            format!("start = \"ideal\"\n{leg}"),
            text.to_owned(),
            "leg.toml:1:1: start",
            "move it to the scene's own file",
        ),
        (
            format!("include = [\"foot.toml\"]\n{leg}"),
            text.to_owned(),
            "leg.toml:1:1: include: ",
            "name them in `include` of the scene's own file",
        ),
        (text.to_owned(), text.to_owned(), "scene.toml:2:12: include[0]", "cannot include itself"),
        (
            leg.to_owned(),
            text.replace("[[ball", "[[body]]\nname = \"leg\"\nmass = \"1 kg\"\ninertia = \"1 1 1 kg m^2\"\n[[ball"),
            "leg.toml:7:8: body.leg.name = \"leg\"",
            "in line 5 of scene.toml; names must differ, for example `leg2`",
        ),
        (
            leg.to_owned(),
            text.replace("[[ball", "[[parameter]]\nname = \"reach\"\nvalue = \"1 mm\"\n[[ball"),
            "leg.toml:3:8: parameter.reach.name = \"reach\"",
            "in line 5 of scene.toml; names must differ",
        ),
        (leg.to_owned(), text.replace("leg.toml", "arm.toml"), "scene.toml:2:12: include[0]", "has no folder"),
        (
            leg.to_owned(),
            text.replace("\"leg.toml\"", "\"leg.toml\", \"leg.toml\""),
            "scene.toml:2:24: include[1]",
            "included already",
        ),
        (
            leg.to_owned(),
            text.replace("name = \"S\"", "name = \"leg\""),
            "scene.toml:5:8: joint.leg.name",
            "in line 12 of leg.toml",
        ),
    ] {
        let error = with(&leg, &text, &[]).expect_err(cause).to_string();
        assert!(error.starts_with(place) && error.contains(cause), "{error}");
    }
}

#[test]
fn a_body_with_a_density_has_the_mass_of_its_shapes() {
    let text = |body: &str| {
        format!(
            "[[body]]\nname = \"bar\"\n{body}\n[[joint]]\nname = \"free\"\nkind = \"free\"\nchild = \"bar\"\nstart = {{ position = [0, 0, 0] }}\n"
        )
    };
    let bar = "shapes = [{ form = \"box\", centre = \"50 0 0 mm\", size = \"100 20 10 mm\", role = \"frame\" }]";
    let read = |body: String| Scene::parse(&text(&body), Some("bar.toml"), &[]);
    let scene = read(format!("density = \"7.85 g/cm^3\"\n{bar}")).expect("reads");
    let body = &scene.machine.bodies[0];
    assert!((body.mass - 0.157).abs() < 1e-15 && (body.centre - Vec3::new(0.05, 0.0, 0.0)).norm() < 1e-17);
    let moments = Vec3::new(0.01 * 0.01 + 0.02 * 0.02, 0.1 * 0.1 + 0.01 * 0.01, 0.1 * 0.1 + 0.02 * 0.02);
    let expected = Mat3::from_diagonal(&(moments * (0.157 / 12.0)));
    assert!((body.inertia - expected).amax() < 1e-18);
    for (body, cause) in [
        (
            format!("density = \"7850 kg/m^3\"\nmass = \"1 kg\"\n{bar}"),
            "bar.toml:4:8: body.bar.mass = \"1 kg\": not allowed here: it follows",
        ),
        ("density = \"7850 kg/m^3\"".to_owned(), "needs `shapes` with a volume"),
        (
            format!("density = \"0 kg/m^3\"\n{bar}"),
            "out of range; allowed above 0 up to 100000 kg/m^3; units kg/m^3, g/cm^3",
        ),
    ] {
        let error = read(body).expect_err(cause).to_string();
        assert!(error.contains(cause), "{error}");
    }
}

#[test]
fn expressions_are_accepted_for_every_number_and_their_units_are_checked() {
    let text = |value: &str, more: &str| {
        format!(
            "[contact]\n{more}\n[[parameter]]\nname = \"radius\"\nvalue = \"50 mm\"\n[[parameter]]\nname = \"rate\"\nvalue = \"60 rpm\"\n\
             [[body]]\nname = \"rod\"\nmass = \"1 kg\"\ninertia = \"1 1 1 kg m^2\"\n\
             [[joint]]\nname = \"hinge\"\nkind = \"revolute\"\nchild = \"rod\"\naxis = [0, 0, 1]\n{value}\n"
        )
    };
    let read = |value: &str, more: &str| Scene::parse(&text(value, more), Some("own.toml"), &[]);
    let start = |value: &str| {
        let scene = read(&format!("start = {{ position = \"{value}\" }}"), "");
        let JointStart::Scalar { position, .. } =
            scene.unwrap_or_else(|error| panic!("{error}")).machine.joints[0].start
        else {
            panic!("a hinge");
        };
        position
    };
    assert_eq!(start("asin(0.5)"), libm::asin(0.5));
    assert_eq!(start("atan2(1, 2) + 0 deg"), libm::atan2(1.0, 2.0));
    assert!((start("2 * 15°") - 0.5235987755982988).abs() < 1e-15);
    let scene = read("", "clearance = \"radius / 250 + 10 µm\"\nfriction = \"1/3\"").expect("reads");
    assert!((scene.machine.contact.clearance - 0.21e-3).abs() < 1e-18);
    assert_eq!(scene.machine.contact.friction, 1.0 / 3.0);
    // An exponent after a unit applies to the unit.
    let scene = read("", "clearance = \"3 mm^2 / (2 mm)^2 * 0.4 mm\"").expect("reads");
    assert!((scene.machine.contact.clearance - 0.3e-3).abs() < 1e-18);
    for inertia in ["0.3 kg * 1.0001 m^2 / 12", "0.3 kg * 1.0001 m² / 12", "0.3 kg * (1 m)^2 * 1.0001 / 12"] {
        let components = format!("[\"1e-3 kg m^2\", \"{inertia}\", \"{inertia}\"]");
        let text = text("", "").replace("\"1 1 1 kg m^2\"", &components);
        let scene = Scene::parse(&text, None, &[]).unwrap_or_else(|error| panic!("{error}"));
        assert!((scene.machine.bodies[0].inertia[(1, 1)] - 0.0250025).abs() < 1e-15);
    }
    let drive = |law: &str| format!("drive = {{ law = {law} }}");
    let spin = "\"constant\", velocity = \"rate\"";
    assert!(read(&drive(spin), "").is_ok());
    for (value, more, cause) in [
        (
            drive("\"harmonic\", amplitude = \"1 deg\", frequency = \"rate\""),
            "",
            "gives 6.28319 s^-1 rad, which is not in Hz",
        ),
        (
            drive("\"constant\", velocity = \"radius**2 * 3 mm**2\""),
            "",
            "`*` where an operator other than a power is expected",
        ),
        // After a unit with a slash, the exponent would be ambiguous.
        (String::new(), "clearance = \"3 m/s^3 * radius\"", "`^` where an operator other than a power is expected"),
        (String::new(), "clearance = \"radius * 3 mm ^2\"", "`^` where an operator other than a power is expected"),
        (String::new(), "clearance = \"radius * 3 mm^2.5\"", "`^` where an operator other than a power is expected"),
        (String::new(), "clearance = \"radius * 3 mm^2\"", "m^3, which is not in m"),
        (String::new(), "clearance = \"radius\"", "clearance 50 mm must be below the ball radius"),
        (String::new(), "friction = \"2 * radius\"", "gives 0.1 m, but must be a pure number; allowed 0 to 10"),
        (String::new(), "friction = \"2 * radiu\"", "no variable `radiu` (did you mean `radius`?)"),
    ] {
        let error = read(&value, more).expect_err(cause).to_string();
        assert!(error.contains(cause), "{error}");
    }
    let unit = text("", "").replace("\"radius\"", "\"mm\"");
    let error = Scene::parse(&unit, None, &[]).expect_err("a unit").to_string();
    assert!(error.contains("or a unit"), "{error}");
}

#[test]
fn bodies_and_joints_in_a_pattern_have_separate_namespaces() {
    let text = "
[[body]]
name = \"hub\"
mass = \"1 kg\"
inertia = \"1 1 1 kg m^2\"

[[joint]]
name = \"axle\"
kind = \"fixed\"
child = \"hub\"

[[pattern]]
name = \"blades\"
count = 3
about = { axis = [0, 0, 1] }

[[pattern.body]]
name = \"blade\"
mass = \"1 kg\"
inertia = \"1 1 1 kg m^2\"

[[pattern.joint]]
name = \"hub\"
kind = \"revolute\"
parent = \"hub\"
child = \"blade\"
parent_point = \"1 0 0 m\"
axis = [1, 0, 0]

[[pattern.joint_spring]]
name = \"s\"
joint = \"hub\"
stiffness = \"1 N m/rad\"
";
    let scene = Scene::parse(text, None, &[]).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(scene.machine.joints[2].name, "hub2");
    assert_eq!(scene.machine.joints[2].parent, Some(0));
    let angle = std::f64::consts::TAU / 3.0;
    let turned = Vec3::new(libm::cos(angle), libm::sin(angle), 0.0);
    assert!((scene.machine.joints[2].parent_point - turned).norm() < 1e-15);
    let shapes = format!("shapes = [{}]\n\n[[pattern.joint]]", "0, ".repeat(9999));
    let many = text.replace("count = 3", "count = 10000");
    let many = many.replacen("[[pattern.joint]]", &shapes, 1);
    let error = Scene::parse(&many, None, &[]).expect_err("too many copies");
    assert!(error.message.contains("copies of"), "{error}");
    let twice = format!(
        "{text}[[pattern]]\nname = \"blades\"\ncount = 1\nalong = [0, 0, 0]\nfixed_shape = [{{ form = \"sphere\", centre = [0, 0, 0], radius = \"1 mm\", role = \"pin\" }}]\n"
    );
    let error = Scene::parse(&twice, None, &[]).expect_err("twice").to_string();
    assert!(error.contains("already a pattern of this name"), "{error}");
}

#[test]
fn a_fast_preset_follows_the_number_of_coupled_balls_in_whatever_order_it_is_set() {
    let preset = ("solver.preset", "real-time");
    let ideal = ("contact.clearance", "0");
    let one = ("joint.A6.clearance", "0.1 mm");
    let solver = |changes: &[(&str, &str)]| changed("hexapod", changes).machine.solver;
    let many = Preset::RealTime.solver(&changed("hexapod", &[]).machine);
    assert_eq!(many.method.control(), StepControl::PerImpact);
    assert_eq!(solver(&[preset]), many);
    for changes in [[preset, ideal, one], [ideal, one, preset], [ideal, preset, one]] {
        assert_eq!(solver(&changes), Preset::RealTime.solver(&changed("pendulum", &[]).machine), "{changes:?}");
    }
    let mut scene = changed("hexapod", &[preset]);
    scene.set("contact.clearance", "0").unwrap();
    assert_eq!(scene.machine.solver.method, Method::Automatic);
    scene.undo_change("contact.clearance").unwrap();
    assert_eq!(scene.machine.solver, many);
}
