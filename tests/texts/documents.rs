//! The documents say what the program does.

use std::fs;
use std::path::{Path, PathBuf};

use jointplay::scene::{
    ELEMENT_KINDS, Scene, Vec3, format_quantity, reference_page, si_unit, unit_table,
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

/// The `number`-th block of TOML of the page about scenes.
fn example(number: usize) -> String {
    let page = read("docs/scene-format.md");
    let block = page
        .split("```toml\n")
        .nth(number)
        .and_then(|rest| rest.split("```").next());
    block.expect("a block of TOML").to_owned()
}

/// The sections of all kinds as table rows for the file-format page.
fn element_table() -> String {
    let mut out = String::new();
    for kind in &ELEMENT_KINDS {
        let points = kind.points.iter();
        let mut keys: Vec<String> = points
            .map(|key| format!("`{key}` (`{{ body, at }}`)"))
            .collect();
        for number in kind.numbers {
            let default = match number.default {
                None => "must be given".to_owned(),
                Some(value) => format!(
                    "{} if left out",
                    format_quantity(value, si_unit(number.dimension))
                ),
            };
            keys.push(format!("`{}`: {} ({default})", number.key, number.help));
        }
        for (key, dimension, help) in kind.vectors {
            keys.push(format!(
                "`{key}`: {help}, a vector in {} (0 if left out)",
                si_unit(*dimension)
            ));
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

#[test]
fn the_page_of_scenes_lists_the_units_that_are_read() {
    let page = read("docs/scene-format.md");
    assert!(page.contains(&unit_table()), "{}", unit_table());
    assert!(page.contains(&element_table()), "{}", element_table());
    for unit in ["µm", "kg·m²", "60 rpm", "15°"] {
        assert!(page.contains(unit), "{unit}");
    }
}

#[test]
fn hinges_that_are_not_parallel_stand_where_the_page_says() {
    let scene = Scene::parse(&example(2), None, &[]).expect("the example loads");
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
    let example = &example(3);
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
    let scene = Scene::parse(&example(1), None, &[]).expect("the example loads");
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
