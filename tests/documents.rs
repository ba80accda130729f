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

#[test]
fn the_page_of_the_trade_has_the_headings_and_diagrams_that_the_command_writes() {
    let page = read("docs/tradeoff.md");
    let lines: Vec<&str> = page.lines().collect();
    let head = |n: &usize| {
        let table = lines
            .get(n + 1)
            .is_some_and(|next| next.starts_with("|---"));
        lines[*n].starts_with('#') || table
    };
    let written: Vec<&str> = (0..lines.len()).filter(head).map(|n| lines[n]).collect();
    assert_eq!(
        written,
        jointplay::cli::tradeoff::headings(),
        "jointplay tradeoff --all --write ."
    );
    for name in jointplay::scene::BUILT_IN {
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
