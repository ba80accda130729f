//! The documents say what the program does.

use std::fs;
use std::path::{Path, PathBuf};

use jointplay::scene::{
    DRIVE_KINDS, ELEMENT_KINDS, ElementJoint, ElementNumber, Role, Scene, Vec3, format_quantity,
    reference_page, si_unit, unit_table,
};
use jointplay::simulate::{Frame, Simulation};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: impl AsRef<Path>) -> String {
    let path = root().join(path);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn the_page_of_parameters_is_what_the_program_prints() {
    assert!(
        read("docs/parameters.md") == reference_page(),
        "cargo run -- parameters > docs/parameters.md"
    );
}

/// The blocks of TOML of the page about scenes.
fn examples() -> Vec<String> {
    let page = read("docs/scene-format.md");
    let blocks = page.split("```toml\n").skip(1);
    blocks
        .filter_map(|rest| rest.split("```").next().map(str::to_owned))
        .collect()
}

/// The first of them that contains `line`.
fn example(line: &str) -> String {
    let blocks = examples();
    let found = blocks.into_iter().find(|block| block.contains(line));
    found.expect("a block of TOML")
}

#[test]
fn the_page_of_scenes_says_what_each_role_is_for() {
    let page = read("docs/scene-format.md");
    let (_, table) = page.split_once("| role | for |\n|---|---|\n").unwrap();
    let rows = table.lines().take_while(|line| line.starts_with('|'));
    let roles: Vec<&str> = rows.filter_map(|row| row.split('`').nth(1)).collect();
    assert_eq!(roles, Role::ALL.map(Role::word));
}

#[test]
fn every_example_of_the_page_of_scenes_runs() {
    let examples = examples();
    assert!(examples.len() > 4);
    for text in examples {
        let scene = Scene::parse(&text, None, &[]).unwrap_or_else(|error| panic!("{error}"));
        let mut simulation = Simulation::new(&scene).unwrap_or_else(|error| panic!("{error}"));
        let end = simulation.advance_to(0.05);
        end.unwrap_or_else(|error| panic!("{error}\n{text}"));
    }
}

/// The sections of all kinds as table rows for the file-format page.
fn element_table() -> String {
    let mut out = String::new();
    for kind in &ELEMENT_KINDS {
        let points = kind.points.iter();
        let joint = kind.joint.map(|which| match which {
            ElementJoint::Any => "`joint` (a slide or a hinge)".to_owned(),
            ElementJoint::Undriven => "`joint` (a slide or a hinge without a drive)".to_owned(),
        });
        let mut keys: Vec<String> = joint.into_iter().collect();
        keys.extend(points.map(|key| format!("`{key}` (`{{ body, at }}`)")));
        for number in kind.numbers {
            let ([key, own_key], [unit, own_unit]) = {
                let [slide, hinge] = [false, true].map(|hinge| number.on(hinge));
                ([slide.0, hinge.0], [slide.1, hinge.1].map(si_unit))
            };
            let default = match number.default {
                None => "must be given".to_owned(),
                Some(value) if value.is_infinite() => "no limit if left out".to_owned(),
                Some(value) if unit == own_unit => {
                    format!("{} if left out", format_quantity(value, unit))
                }
                Some(value) => format!(
                    "{}, on a hinge {}, if left out",
                    format_quantity(value, unit),
                    format_quantity(value, own_unit)
                ),
            };
            let hinge = if own_key == key {
                String::new()
            } else {
                format!(" (on a hinge `{own_key}`)")
            };
            keys.push(format!("`{key}`{hinge}: {} ({default})", number.help));
        }
        for vector in kind.vectors {
            let (key, help, unit) = (vector.key, vector.help, si_unit(vector.dimension));
            keys.push(format!(
                "`{key}`: {help}, a vector in {unit} (0 if left out)"
            ));
        }
        for (key, help) in kind.rotations {
            keys.push(format!("`{key}`: {help}, a rotation (none if left out)"));
        }
        if let Some((key, help)) = kind.law {
            keys.push(format!("`{key}`: {help}, a law as of a drive"));
        }
        for (key, words, help) in kind.choices {
            keys.push(format!(
                "`{key}`: {help}, {} ({} if left out)",
                words.join(" or "),
                words[0]
            ));
        }
        out.push_str(&format!(
            "| `[[{}]]` | {}: `name`, {} |\n",
            kind.section,
            kind.help,
            keys.join("; ")
        ));
    }
    out
}

/// The laws of drives as a table for the file-format page.
fn drive_table() -> String {
    let mut out = "| law | motion | keys |\n|---|---|---|\n".to_owned();
    for kind in &DRIVE_KINDS {
        let number = |number: &ElementNumber| {
            let default = match number.default {
                None => "must be given".to_owned(),
                Some(0.0) => "0 if left out".to_owned(),
                Some(value) => {
                    let text = format_quantity(value, si_unit(number.dimension));
                    format!("{text} if left out")
                }
            };
            format!("`{}`: {} ({default})", number.key, number.help)
        };
        let numbers = kind.numbers.iter().map(number);
        let others = kind.others.iter();
        let others = others.map(|(key, help)| format!("`{key}`: {help}"));
        let keys: Vec<String> = others.chain(numbers).collect();
        out += &format!(
            "| `{}` | {} | {} |\n",
            kind.word,
            kind.help,
            keys.join("; ")
        );
    }
    out
}

#[test]
fn the_page_of_scenes_lists_the_units_that_are_read() {
    let page = read("docs/scene-format.md");
    assert!(page.contains(&unit_table()), "{}", unit_table());
    assert!(page.contains(&element_table()), "{}", element_table());
    assert!(page.contains(&drive_table()), "{}", drive_table());
    for unit in ["µm", "kg·m²", "60 rpm", "15°"] {
        assert!(page.contains(unit), "{unit}");
    }
}

#[test]
fn hinges_that_are_not_parallel_stand_where_the_page_says() {
    let scene = Scene::parse(&example("name = \"turn\""), None, &[]).expect("the example loads");
    let mut simulation = Simulation::new(&scene).expect("the example starts");
    let mut frame = Frame::default();
    simulation.sample(0.0, &mut frame);
    let arm = &frame.bodies[scene
        .bodies
        .iter()
        .position(|body| body.name == "arm")
        .unwrap()];
    let tip = arm.position + arm.rotation * Vec3::new(0.0, 0.0, 0.1);
    let millimetres = |v: Vec3| {
        let part = |x: f64| format!("{}", (x * 1e4).round() / 10.0 + 0.0);
        format!("({}, {}, {}) mm", part(v.x), part(v.y), part(v.z))
    };
    let page = read("docs/scene-format.md");
    for point in [arm.position, tip] {
        assert!(page.contains(&millimetres(point)), "{}", millimetres(point));
    }
    // The arm's hinge, y of the table and of the arm alike, along the world's -x.
    assert!((arm.rotation * Vec3::y() + Vec3::x()).norm() < 1e-12);
    let lifting = 5f64.to_radians() * std::f64::consts::TAU;
    let turning = 10.0 * std::f64::consts::TAU / 60.0;
    let spin = Vec3::new(-lifting, 0.0, turning);
    assert!((arm.angular_velocity - spin).norm() < 1e-12);
    simulation.advance_to(0.02).expect("the example runs");
}

#[test]
fn the_example_of_the_scene_format_runs() {
    let example = &example("name = \"rod\"\nmass = \"0.384 kg\"");
    let scene = Scene::parse(example, None, &[]).expect("the example loads");
    let mut simulation = Simulation::new(&scene).expect("the example starts");
    simulation.advance_to(0.02).expect("the example runs");
    assert!(
        simulation.statistics().impacts[0] > 0,
        "a rod that is let go falls onto its socket"
    );
}

/// Built-in scenes that `jointplay tradeoff --all` has not yet been run on since they came: it must list none of them.
const NOT_MEASURED: [&str; 5] = ["hexapod", "delta", "four-bar", "suspension", "press"];

/// The scenes of `assets/presets.json`: the built-in ones, in their order.
fn measured_scenes() -> Vec<&'static str> {
    let record = &jointplay::analysis::presets::record().scenes;
    let all = jointplay::scene::BUILT_IN;
    let has = |name: &&str| record.contains_key(*name);
    let expected = all.into_iter().filter(|name| !NOT_MEASURED.contains(name));
    let measured: Vec<&str> = all.into_iter().filter(has).collect();
    assert_eq!(
        measured,
        expected.collect::<Vec<_>>(),
        "after `jointplay tradeoff --all --write .` NOT_MEASURED is empty"
    );
    measured
}

#[test]
fn the_page_of_the_trade_has_the_headings_and_diagrams_that_the_command_writes() {
    /// Headings and heads of tables.
    fn structure(page: &str) -> Vec<&str> {
        let lines: Vec<&str> = page.lines().collect();
        let is_rule = |line: &&str| line.starts_with("|---");
        let head = |n: &usize| lines[*n].starts_with('#') || lines.get(n + 1).is_some_and(is_rule);
        (0..lines.len()).filter(head).map(|n| lines[n]).collect()
    }
    let page = read("docs/tradeoff.md");
    let measured = measured_scenes();
    assert_eq!(
        structure(&page),
        structure(&jointplay::cli::tradeoff::skeleton(&measured)),
        "jointplay tradeoff --all --write ."
    );
    for name in measured {
        let diagram = format!("tradeoff-{name}.svg");
        assert!(page.contains(&format!("({diagram})")), "{diagram}");
        assert!(read(format!("docs/{diagram}")).starts_with("<svg"));
    }
}

/// Every file that a document names is there.
#[test]
fn documents_name_files_that_exist() {
    for document in [
        "README.md",
        "ARCHITECTURE.md",
        "CHANGELOG.md",
        "docs/numerics.md",
        "docs/scene-format.md",
        "docs/tradeoff.md",
        "docs/sweeps.md",
        "docs/cluster.md",
    ] {
        let text = read(document);
        for word in text.split(['`', '(', ')']) {
            let kept = [
                "src/",
                "docs/",
                "assets/",
                "tests/",
                "benches/",
                "examples/",
                "shaders/",
            ]
            .iter()
            .any(|folder| word.starts_with(folder));
            if kept && !word.contains(['*', '<', ' ', '\n']) {
                assert!(root().join(word).exists(), "{document} names {word}");
            }
        }
    }
}

#[test]
fn the_mass_on_a_spring_of_the_page_swings_about_its_rest() {
    let scene = Scene::parse(&example("name = \"s1\""), None, &[]).expect("the example loads");
    let mut simulation = Simulation::new(&scene).expect("the example starts");
    let mut frame = Frame::default();
    simulation.sample(0.0, &mut frame);
    // 105 mm long at the start: 5 N against a weight of 4.905 N.
    assert!(
        (frame.elements[0].force.z - 5.0).abs() < 1e-12,
        "{:?}",
        frame.elements[0]
    );
    assert!((frame.bodies[0].acceleration.z - (5.0 - 4.905) / 0.5).abs() < 1e-9);
    simulation.advance_to(2.0).expect("the example runs");
    let ledger = simulation.ledger().expect("is kept");
    assert!(ledger.damping_loss > 0.0 && ledger.external_work != 0.0);
    assert!(ledger.relative_residual().abs() < 1e-5, "{ledger:?}");
}

#[test]
fn the_flap_of_the_page_opens_against_its_stop_and_shuts() {
    let scene = Scene::parse(&example("name = \"flap\""), None, &[]).expect("the example loads");
    let mut simulation = Simulation::new(&scene).expect("the example starts");
    let mut frame = Frame::default();
    let (mut widest, mut deepest, mut most) = (0.0_f64, 0.0_f64, 0.0_f64);
    while simulation.time() < 1.0 {
        let next = simulation.time() + 2e-3;
        simulation.step_until(next).expect("it runs");
        simulation.sample(simulation.time(), &mut frame);
        let rotation = &frame.bodies[0].rotation;
        let angle = libm::atan2(rotation[(0, 2)], rotation[(0, 0)]).to_degrees();
        (widest, deepest) = (widest.max(angle), deepest.min(angle));
        most = most.max(frame.elements[2].torque.expect("a torque").norm());
    }
    assert!((30.0..70.0).contains(&widest), "{widest}");
    assert!((-2.0..-0.05).contains(&deepest), "{deepest}");
    assert!((0.3..=0.6 + 1e-12).contains(&most), "{most}");
}
