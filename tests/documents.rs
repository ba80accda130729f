//! The documents say what the program does.

use std::fs;
use std::path::{Path, PathBuf};

use jointplay::scene::{Scene, reference_page};
use jointplay::simulate::Simulation;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: impl AsRef<Path>) -> String {
    let path = root().join(path);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn sources(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("readable").path();
        if path.is_dir() {
            sources(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}

#[test]
fn the_page_of_parameters_is_what_the_program_prints() {
    assert!(
        read("docs/parameters.md") == reference_page(),
        "cargo run -- parameters > docs/parameters.md"
    );
}

#[test]
fn the_example_of_the_scene_format_runs() {
    let page = read("docs/scene-format.md");
    let example = page
        .split("```toml\n")
        .nth(1)
        .and_then(|rest| rest.split("```").next())
        .expect("a block of TOML");
    let scene = Scene::parse(example, None, &[]).expect("the example loads");
    let mut simulation = Simulation::new(&scene).expect("the example starts");
    simulation.advance_to(0.02).expect("the example runs");
    assert!(
        simulation.statistics().impacts[0] > 0,
        "a rod that is let go falls onto its socket"
    );
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
    ] {
        let text = read(document);
        for word in text.split(['`', '(', ')']) {
            let kept = ["src/", "docs/", "assets/", "tests/", "benches/", "shaders/"]
                .iter()
                .any(|folder| word.starts_with(folder));
            if kept && !word.contains(['*', '<', ' ', '\n']) {
                assert!(root().join(word).exists(), "{document} names {word}");
            }
        }
    }
}

/// Modules from the ground up. A module uses only what stands on a lower floor.
const FLOORS: [&[&str]; 7] = [
    &["contact", "integrate"],
    &["scene"],
    &["mechanism"],
    &["simulate"],
    &["view"],
    &["render"],
    &["app"],
];

/// Modules of this crate that `text` names outside its tests.
fn uses(text: &str) -> Vec<String> {
    let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or("");
    code.lines()
        .filter(|line| !line.trim_start().starts_with("//"))
        .flat_map(|line| line.split("crate::").skip(1))
        .map(|rest| {
            rest.chars()
                .take_while(|c| c.is_alphanumeric() || *c == '_')
                .collect()
        })
        .collect()
}

#[test]
fn modules_use_only_lower_floors() {
    let floor = |name: &str| FLOORS.iter().position(|floor| floor.contains(&name));
    let mut checked = 0;
    for (level, names) in FLOORS.iter().enumerate() {
        for name in *names {
            let mut files = Vec::new();
            sources(&root().join("src").join(name), &mut files);
            for file in files {
                let text = fs::read_to_string(&file).expect("text");
                for used in uses(&text).iter().filter(|used| used != name) {
                    checked += 1;
                    let below = floor(used).is_some_and(|below| below < level);
                    assert!(
                        below || used == "VERSION",
                        "{} uses {used}, which is not below {name}",
                        file.display()
                    );
                }
                if level < 4 {
                    for library in [
                        "egui",
                        "wgpu",
                        "glam",
                        "web_time",
                        "std::time",
                        "std::thread",
                    ] {
                        let found = text
                            .lines()
                            .any(|l| !l.trim_start().starts_with("//") && l.contains(library));
                        assert!(!found, "{} uses {library}", file.display());
                    }
                }
            }
        }
    }
    assert!(checked > 20, "only {checked} uses found");
}
