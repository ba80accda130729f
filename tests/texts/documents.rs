//! The documents agree with the program.

use std::fs;
use std::path::{Path, PathBuf};

use jointplay::analysis::Setting;
use jointplay::analysis::presets::limit;
use jointplay::cli::{reference, schema};
use jointplay::machine::{Preset, Role, Vec3};
use jointplay::scene::{Scene, file_tables, reference_page};
use jointplay::simulate::{Frame, Simulation};

pub fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: impl AsRef<Path>) -> String {
    let path = root().join(path);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn the_parameter_page_is_what_the_program_prints() {
    assert!(read("docs/parameters.md") == reference_page(), "cargo run -- parameters > docs/parameters.md");
}

#[test]
fn the_citation_names_this_version() {
    let citation = read("CITATION.cff");
    let version = citation.lines().find_map(|line| line.strip_prefix("version: "));
    assert_eq!(version, Some(env!("CARGO_PKG_VERSION")));
}

/// The TOML blocks of the tutorial.
fn examples() -> Vec<String> {
    let page = read("docs/scene-tutorial.md");
    let blocks = page.split("```toml\n").skip(1);
    blocks.filter_map(|rest| rest.split("```").next().map(str::to_owned)).collect()
}

/// The first TOML block of that page that contains `line`.
fn example(line: &str) -> String {
    let mut blocks = examples().into_iter();
    let example = blocks.find(|block| block.contains(line));
    example.expect("a block of TOML")
}

#[test]
fn the_scene_page_describes_each_role() {
    let page = read("docs/scene-format.md");
    let (_, table) = page.split_once("| role | for |\n|---|---|\n").unwrap();
    let rows = table.lines().take_while(|line| line.starts_with('|'));
    let roles: Vec<&str> = rows.filter_map(|row| row.split('`').nth(1)).collect();
    assert_eq!(roles, Role::ALL.map(Role::word));
}

#[test]
fn every_example_of_the_tutorial_runs() {
    let examples = examples();
    assert!(examples.len() > 4);
    for text in examples {
        let scene = Scene::parse(&text, None, &[]).unwrap_or_else(|error| panic!("{error}"));
        let mut simulation = Simulation::new(&scene.machine).unwrap_or_else(|error| panic!("{error}"));
        let end = simulation.advance_to(0.05);
        end.unwrap_or_else(|error| panic!("{error}\n{text}"));
    }
}

/// Checks that the file at `path` equals `text`; with `UPDATE_PAGES` set, writes it first.
fn check_page(path: &str, text: &str, command: &str) {
    if std::env::var_os("UPDATE_PAGES").is_some() {
        fs::write(root().join(path), text).unwrap();
    }
    assert!(read(path) == text, "{path} is not what `{command}` prints");
}

#[test]
fn the_scene_page_has_the_tables_of_the_format() {
    let path = "docs/scene-format.md";
    let page = reference::fill(&read(path)).unwrap_or_else(|name| panic!("no table `{name}`"));
    check_page(path, &page, "jointplay reference");
    for table in file_tables() {
        // These repeat those of a drive for plain numbers, which the page says in words.
        let in_words = ["factor", "factor_term"].contains(&table.name);
        assert!(in_words || page.contains(&format!("<!-- table {} -->", table.name)), "no table `{}`", table.name);
    }
    for unit in ["µm", "kg·m²", "60 rpm", "15°"] {
        assert!(page.contains(unit), "{unit}");
    }
}

#[test]
fn the_schema_is_what_the_program_prints() {
    check_page("assets/scene.schema.json", &schema::page(), "jointplay schema");
}

#[test]
fn the_two_hinges_of_the_page_have_the_stated_positions() {
    let scene = Scene::parse(&example("name = \"turn\""), None, &[]).expect("the example loads");
    let mut simulation = Simulation::new(&scene.machine).expect("the example starts");
    let mut frame = Frame::default();
    simulation.sample(0.0, &mut frame);
    let arm = &frame.bodies[scene.machine.bodies.iter().position(|body| body.name == "arm").unwrap()];
    let tip = arm.position + arm.rotation * Vec3::new(0.0, 0.0, 0.1);
    let millimetres = |v: Vec3| {
        let part = |x: f64| format!("{}", (x * 1e4).round() / 10.0 + 0.0);
        format!("({}, {}, {}) mm", part(v.x), part(v.y), part(v.z))
    };
    let page = read("docs/scene-tutorial.md");
    for point in [arm.position, tip] {
        assert!(page.contains(&millimetres(point)), "{}", millimetres(point));
    }
    // The arm's hinge axis, y in the frames of table and arm, is along the world's -x.
    assert!((arm.rotation * Vec3::y() + Vec3::x()).norm() < 1e-12);
    let lifting = 5f64.to_radians() * std::f64::consts::TAU;
    let turning = 10.0 * std::f64::consts::TAU / 60.0;
    let spin = Vec3::new(-lifting, 0.0, turning);
    assert!((arm.angular_velocity - spin).norm() < 1e-12);
    simulation.advance_to(0.02).expect("the example runs");
}

/// The page of the trade-off was drawn from its table, which has the presets of the program, within their limits.
#[test]
fn the_tradeoff_page_and_its_table_are_those_of_the_presets() {
    let again = "measure the presets again, see docs/checks.md";
    let (page, table) = (read("docs/tradeoff.md"), read("docs/tradeoff.csv"));
    assert!(page.lines().count() <= 150, "{}", page.lines().count());
    let mut lines = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let heads = lines.next().expect("heads");
    let rows: Vec<Vec<&str>> = lines.collect();
    let cell = |row: &[&str], name: &str| row[heads.iter().position(|head| *head == name).expect(name)].to_owned();
    let number = |row: &[&str], name: &str| cell(row, name).parse::<f64>().ok();
    let trials = ["steer", "wrist", "gate", "two-balls", "slow-eight"];
    let files = trials.map(|name| root().join(format!("tests/trials/{name}.toml")));
    let scenes = jointplay::scene::BUILT_IN.map(std::path::PathBuf::from).into_iter().chain(files);
    let mut largest = [0.0_f64; Preset::ALL.len()];
    for scene in scenes {
        let scene = Scene::load(&scene, &[]).expect("loads");
        let own: Vec<_> = rows.iter().filter(|row| cell(row, "scene") == scene.name).collect();
        assert!(page.contains(&format!("| `{}` |", scene.name)), "{}: {again}", scene.name);
        for (preset, largest) in Preset::ALL.into_iter().zip(&mut largest) {
            let case = format!("{}, {}: {again}", scene.name, preset.word());
            let row = own.iter().find(|row| cell(row, "preset") == preset.word()).unwrap_or_else(|| panic!("{case}"));
            let setting = Setting::of_preset(preset, &scene.machine);
            let value = ["tolerance", "steps_per_impact"].into_iter().find_map(|name| number(row, name));
            assert_eq!((cell(row, "method"), value), (setting.method.to_string(), Some(setting.value())), "{case}");
            let error = number(row, "peak_error").unwrap_or_else(|| panic!("{case}"));
            assert!(error <= limit(preset), "{case}: {error}");
            *largest = largest.max(error);
            let (tolerance, steps) = match preset {
                Preset::Preview => (1e-3, 16.0),
                Preset::RealTime => (5e-4, 24.0),
                _ => continue,
            };
            // The method not chosen costs at least as much, within a factor, where it keeps the limit.
            let other = own.iter().filter(|other| match &*cell(other, "method") {
                "automatic" => number(other, "tolerance") == Some(tolerance),
                "discrete-gradient" => number(other, "steps_per_impact") == Some(steps),
                _ => false,
            });
            let keeps = |row: &[&str]| number(row, "peak_error").is_some_and(|error| error <= limit(preset));
            let cheapest =
                other.filter(|row| keeps(row)).filter_map(|row| number(row, "cost")).fold(f64::INFINITY, f64::min);
            assert!(number(row, "cost").is_some_and(|cost| cost <= 2.1 * cheapest), "{case}: {cheapest}");
        }
    }
    for (preset, error) in Preset::ALL.into_iter().zip(largest) {
        let stated = format!("{error:.1e}");
        let row = page.lines().find(|line| line.starts_with(&format!("| {} | {:e} |", preset.word(), limit(preset))));
        let is_stated = |row: &str| row.replace("e-0", "e-").contains(&format!("| {stated} |"));
        assert!(row.is_some_and(is_stated), "{}: {stated}: {again}", preset.word());
    }
}

/// Paths of the pages in `docs/`, relative to the root.
fn pages() -> Vec<String> {
    let entries = fs::read_dir(root().join("docs")).expect("the folder of documents");
    let names = entries.map(|entry| entry.expect("an entry").file_name().into_string().expect("ASCII"));
    names.filter(|name| name.ends_with(".md")).map(|name| format!("docs/{name}")).collect()
}

/// Every file named in a document exists.
#[test]
fn documents_name_files_that_exist() {
    let pages = pages();
    assert!(pages.len() > 10, "{pages:?}");
    let documents = ["README.md", "ARCHITECTURE.md", "CHANGELOG.md"].map(str::to_owned);
    for document in documents.into_iter().chain(pages) {
        let text = read(&document);
        for word in text.split(['`', '(', ')']) {
            let is_path = ["src/", "crates/", "docs/", "assets/", "tests/", "benches/", "examples/", "shaders/"]
                .iter()
                .any(|folder| word.starts_with(folder));
            if is_path && !word.contains(['*', '<', ' ', '\n']) {
                assert!(root().join(word).exists(), "{document} names {word}");
            }
        }
    }
}

/// Every page can be found from README.md: it is named there, or in a page that can be found.
#[test]
fn the_readme_leads_to_every_document() {
    let (mut unseen, mut found) = (pages(), vec!["README.md".to_owned()]);
    while let Some(document) = found.pop() {
        let text = read(&document);
        let (named, rest) = unseen.into_iter().partition(|page| text.contains(&format!("`{page}`")));
        unseen = rest;
        found.extend::<Vec<String>>(named);
    }
    assert!(unseen.is_empty(), "README.md does not lead to {unseen:?}");
}

/// Targets of links in README.md exist.
#[test]
fn links_of_the_readme_lead_to_files() {
    let readme = read("README.md");
    let targets = readme.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    let files: Vec<&str> = targets.filter(|target| !target.contains("://")).collect();
    assert!(files.len() > 10, "{files:?}");
    for file in files {
        assert!(root().join(file).exists(), "README.md links {file}");
    }
}

/// The program has all commands and options in the shell blocks of README.md and `docs/`.
#[test]
fn documents_use_commands_and_options_that_exist() {
    let mut checked = 0;
    for document in pages().into_iter().chain(["README.md".to_owned()]) {
        let page = read(&document);
        let blocks = page.split("```sh\n").skip(1).filter_map(|rest| rest.split("```").next());
        for line in blocks.flat_map(str::lines) {
            let line = line.split(" #").next().unwrap_or(line);
            let is_program = |word: &str| ["./run", "jointplay", "target/local/jointplay"].contains(&word);
            let mut words = line.split_whitespace().skip_while(|word| !is_program(word));
            // `web` and `release` are commands of the script, and what follows `lab` or `python -m jointplay` one of the Python package, whose
            // own tests check it.
            let is_own = |word: &&str| !["web", "release", "lab"].contains(word) && !line.starts_with("python");
            let (Some(_), Some(command)) = (words.next(), words.next().filter(is_own)) else {
                continue;
            };
            let help = std::process::Command::new(env!("CARGO_BIN_EXE_jointplay")).args([command, "--help"]).output();
            let help = help.expect("the program starts");
            assert!(help.status.success(), "{document}: {line}");
            let help = String::from_utf8(help.stdout).expect("UTF-8");
            for option in words.filter(|word| word.starts_with("--")) {
                let name = option.split('=').next().unwrap_or(option);
                let known = help.split([' ', ',', '\n']).any(|word| word == name);
                assert!(known, "{document}: `{line}`: {name}");
            }
            checked += 1;
        }
    }
    assert!(checked > 30, "only {checked} commands found: does the search still work?");
}

#[test]
fn the_mass_on_a_spring_of_the_page_starts_and_balances_its_energy() {
    let scene = Scene::parse(&example("name = \"s1\""), None, &[]).expect("the example loads");
    let mut simulation = Simulation::new(&scene.machine).expect("the example starts");
    let mut frame = Frame::default();
    simulation.sample(0.0, &mut frame);
    // 105 mm long at the start: 5 N against a weight of 4.905 N.
    assert!((frame.elements[0].force.z - 5.0).abs() < 1e-12, "{:?}", frame.elements[0]);
    assert!((frame.bodies[0].acceleration.z - (5.0 - 4.905) / 0.5).abs() < 1e-9);
    simulation.advance_to(2.0).expect("the example runs");
    let ledger = simulation.ledger().expect("is kept");
    assert!(ledger.damping_loss > 0.0 && ledger.external_work != 0.0);
    assert!(ledger.relative_residual().abs() < 1e-5, "{ledger:?}");
}

#[test]
fn the_wheel_of_the_page_rolls_over_its_bump() {
    let scene = Scene::parse(&example("name = \"strut\""), None, &[]).expect("the example loads");
    let mut simulation = Simulation::new(&scene.machine).expect("the example starts");
    let mut frame = Frame::default();
    let (mut highest, mut max_force, mut min_force) = (0.0_f64, 0.0_f64, f64::INFINITY);
    while simulation.time() < 1.0 {
        let next = simulation.time() + 2e-3;
        simulation.step_until(next).expect("it runs");
        simulation.sample(simulation.time(), &mut frame);
        let [ground, wheel] = frame.elements[1].points;
        let force = frame.elements[1].force.z;
        assert!(force == 0.0 || wheel.z - ground.z < 0.3);
        highest = highest.max(ground.z);
        (max_force, min_force) = (max_force.max(force), min_force.min(force));
    }
    assert!((highest - 0.04).abs() < 1e-4, "{highest}");
    let weight = 320.0 * 9.81;
    assert!(max_force > 2.0 * weight && min_force < 0.5 * weight, "{max_force} {min_force}");
    let ledger = simulation.ledger().expect("is kept");
    assert!(ledger.drive_work > 0.0 && ledger.damping_loss > 0.0, "{ledger:?}");
    assert!(ledger.relative_residual().abs() < 1e-3, "{ledger:?}");
}

#[test]
fn the_flap_of_the_page_opens_against_its_stop_and_shuts() {
    let scene = Scene::parse(&example("name = \"flap\""), None, &[]).expect("the example loads");
    let mut simulation = Simulation::new(&scene.machine).expect("the example starts");
    let mut frame = Frame::default();
    let (mut widest, mut deepest, mut max_torque) = (0.0_f64, 0.0_f64, 0.0_f64);
    while simulation.time() < 1.0 {
        let next = simulation.time() + 2e-3;
        simulation.step_until(next).expect("it runs");
        simulation.sample(simulation.time(), &mut frame);
        let rotation = &frame.bodies[0].rotation;
        let angle = libm::atan2(rotation[(0, 2)], rotation[(0, 0)]).to_degrees();
        (widest, deepest) = (widest.max(angle), deepest.min(angle));
        max_torque = max_torque.max(frame.elements[2].torque.expect("a torque").norm());
    }
    assert!((30.0..70.0).contains(&widest), "{widest}");
    assert!((-2.0..-0.05).contains(&deepest), "{deepest}");
    assert!((0.3..=0.6 + 1e-12).contains(&max_torque), "{max_torque}");
}
