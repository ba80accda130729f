//! The arrows of the house point down: a module uses only what stands on lower floors.

use std::path::{Path, PathBuf};

/// Floors from the ground up; modules of one floor know nothing of each other.
const FLOORS: [&[&str]; 10] = [
    &["words"],
    &["contact", "files", "integrate"],
    &["scene"],
    &["mechanism"],
    &["simulate"],
    &["analysis", "chart", "view"],
    &["render"],
    &["app"],
    &["cli"],
    &["main", "web"],
];
/// Modules whose results must be the same bits everywhere.
const EXACT: [&str; 6] = [
    "contact",
    "integrate",
    "scene",
    "mechanism",
    "simulate",
    "analysis",
];

fn floor(module: &str) -> Option<usize> {
    FLOORS.iter().position(|floor| floor.contains(&module))
}

/// Source files under `folder`.
fn sources(folder: &Path, out: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            sources(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}

/// (module, file name for messages, code without comments and texts) of every file but `lib.rs`.
fn files() -> Vec<(String, String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut paths = Vec::new();
    sources(&root, &mut paths);
    let mut files = Vec::new();
    for path in paths {
        let local = path.strip_prefix(&root).unwrap();
        let first = local.components().next().unwrap().as_os_str();
        let module = Path::new(first).file_stem().unwrap().to_str().unwrap();
        if module == "lib" {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        files.push((module.to_owned(), local.display().to_string(), code(&text)));
    }
    files
}

/// Rust source with comments and the insides of texts blanked; lines stay where they are.
fn code(text: &str) -> String {
    let c: Vec<char> = text.chars().collect();
    let (mut out, mut i) = (String::new(), 0);
    let blank = |out: &mut String, from: usize, to: usize| {
        out.extend(
            c[from..to]
                .iter()
                .map(|&c| if c == '\n' { '\n' } else { ' ' }),
        );
    };
    while i < c.len() {
        let start = i;
        let word_before = i > 0 && (c[i - 1].is_alphanumeric() || c[i - 1] == '_');
        if c[i..].starts_with(&['/', '/']) {
            i += c[i..]
                .iter()
                .position(|&c| c == '\n')
                .unwrap_or(c.len() - i);
            blank(&mut out, start, i);
        } else if c[i..].starts_with(&['/', '*']) {
            i += 2;
            while i < c.len() && !c[i..].starts_with(&['*', '/']) {
                i += 1;
            }
            i = (i + 2).min(c.len());
            blank(&mut out, start, i);
        } else if c[i] == 'r' && !word_before && matches!(c.get(i + 1), Some('"' | '#')) {
            let hashes = c[i + 1..].iter().take_while(|&&c| c == '#').count();
            if c.get(i + 1 + hashes) != Some(&'"') {
                // A raw name such as r#type.
                out.push(c[i]);
                i += 1;
                continue;
            }
            i += 2 + hashes;
            while i < c.len()
                && !(c[i] == '"' && c[i + 1..].iter().take_while(|&&c| c == '#').count() >= hashes)
            {
                i += 1;
            }
            i = (i + 1 + hashes).min(c.len());
            blank(&mut out, start, i);
        } else if c[i] == '"' {
            i += 1;
            while i < c.len() && c[i] != '"' {
                i += if c[i] == '\\' { 2 } else { 1 };
            }
            i = (i + 1).min(c.len());
            blank(&mut out, start, i);
        } else if c[i] == '\'' && (c.get(i + 1) == Some(&'\\') || c.get(i + 2) == Some(&'\'')) {
            // A character, not a lifetime.
            i += if c[i + 1] == '\\' { 3 } else { 2 };
            while i < c.len() && c[i] != '\'' {
                i += 1;
            }
            i = (i + 1).min(c.len());
            blank(&mut out, start, i);
        } else {
            out.push(c[i]);
            i += 1;
        }
    }
    out
}

/// Words of `code` with the place at which each starts.
fn words(code: &str) -> impl Iterator<Item = (usize, &str)> {
    code.split(|c: char| !(c.is_alphanumeric() || c == '_'))
        .filter(|word| !word.is_empty())
        .map(|word| (word.as_ptr() as usize - code.as_ptr() as usize, word))
}

fn line_of(code: &str, at: usize) -> usize {
    code[..at].matches('\n').count() + 1
}

/// Modules that stand first after `crate::` (or `jointplay::` in the entries), `{…}` lists included.
fn uses(code: &str) -> Vec<(usize, &str)> {
    let mut found = Vec::new();
    for start in ["crate::", "jointplay::"] {
        for (at, _) in code.match_indices(start) {
            let after = &code[at + start.len()..];
            if let Some(list) = after.strip_prefix('{') {
                // Top-level items of the list.
                let (mut depth, mut fresh) = (0, true);
                for (offset, c) in list.char_indices() {
                    match c {
                        '{' => depth += 1,
                        '}' if depth == 0 => break,
                        '}' => depth -= 1,
                        ',' if depth == 0 => fresh = true,
                        c if fresh && depth == 0 && !c.is_whitespace() => {
                            fresh = false;
                            found.extend(words(&list[offset..]).next().map(|(_, word)| (at, word)));
                        }
                        _ => {}
                    }
                }
            } else {
                found.extend(words(after).next().map(|(_, word)| (at, word)));
            }
        }
    }
    found
}

#[test]
fn modules_use_only_lower_floors() {
    let files = files();
    let mut arrows = 0;
    for (module, file, code) in &files {
        let own = floor(module).unwrap_or_else(|| panic!("{file}: module {module} has no floor"));
        for (at, used) in uses(code) {
            let Some(other) = floor(used) else {
                // An item of the crate's root: no module.
                continue;
            };
            arrows += 1;
            assert!(
                used == module || other < own,
                "src/{file}:{}: {module} uses {used}",
                line_of(code, at)
            );
        }
        // `super` above the module's own folder would be a way around; a module of tests at the end is one deeper.
        let depth = file.matches('/').count() - usize::from(file.ends_with("mod.rs"));
        let (plain, tests) = code.split_once("#[cfg(test)]").unwrap_or((code, ""));
        for (part, deeper) in [(plain, 1), (tests, 2)] {
            let climb = "super::".repeat(depth + deeper);
            assert!(!part.contains(&climb), "src/{file}: climbs out by {climb}");
        }
    }
    assert!(
        arrows > 20,
        "only {arrows} arrows found: does the search still work?"
    );
}

#[test]
fn files_are_written_through_one_module() {
    // Reading is free; tests of a module may do as they like.
    const WRITING: [&str; 12] = [
        "fs::write",
        "fs::rename",
        "fs::copy",
        "fs::remove",
        "fs::create_dir",
        "fs::hard_link",
        "File::create(",
        "File::options",
        "OpenOptions",
        "DirBuilder",
        "tempfile::",
        "NamedTempFile",
    ];
    for (module, file, code) in files() {
        let (plain, _) = code
            .split_once("#[cfg(test)]\nmod tests")
            .unwrap_or((&code, ""));
        // Pictures that are drawn to be looked at.
        if module == "files"
            || file.ends_with("survival.rs")
            || file == "render/look.rs"
            || file.ends_with("/tests.rs")
        {
            continue;
        }
        for call in WRITING {
            let at = plain.find(call);
            assert!(
                at.is_none(),
                "src/{file}:{}: {call}",
                line_of(plain, at.unwrap_or(0))
            );
        }
    }
}

#[test]
fn physics_knows_no_screen_clock_or_platform_dependent_function() {
    // Crates of the screen, clocks and threads, hash order.
    const FORBIDDEN: [&str; 15] = [
        "egui",
        "wgpu",
        "glam",
        "eframe",
        "parry3d",
        "egui_plot",
        "web_time",
        "Instant",
        "SystemTime",
        "thread",
        "HashMap",
        "HashSet",
        "mul_add",
        "f32",
        "rayon",
    ];
    // Elementary functions of std: their bits differ between platforms; `libm` has the same ones everywhere.
    const ELEMENTARY: [&str; 25] = [
        "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sin_cos", "sinh", "cosh", "tanh",
        "asinh", "acosh", "atanh", "exp", "exp2", "exp_m1", "ln", "ln_1p", "log", "log2", "log10",
        "powf", "cbrt", "hypot",
    ];
    let mut seen = 0;
    for (module, file, code) in files() {
        if !EXACT.contains(&module.as_str()) {
            continue;
        }
        seen += 1;
        assert!(!code.contains("std::time"), "src/{file}: std::time");
        for (at, word) in words(&code) {
            let place = || format!("src/{file}:{}: {word}", line_of(&code, at));
            // What was recorded for the plots is kept short; nothing is computed from it.
            let recorded = word == "f32" && file == "simulate/history.rs";
            assert!(!FORBIDDEN.contains(&word) || recorded, "{}", place());
            let called = code[at + word.len()..].starts_with('(');
            let before = &code[..at];
            let method = before.ends_with('.') || before.ends_with("f64::");
            if ELEMENTARY.contains(&word) && called && method {
                // A jet's own functions go through libm.
                let own = module == "mechanism" && word == "sin_cos";
                assert!(own, "{}", place());
            }
        }
    }
    assert!(seen > 20, "only {seen} files");
}

#[test]
fn the_search_sees_through_comments_and_texts() {
    let text = "use crate::{scene::{A, app}, contact}; // crate::app\nlet s = \"crate::render\"; 'a' r#\"crate::cli\"# x.sin()";
    let code = code(text);
    let found: Vec<&str> = uses(&code).into_iter().map(|(_, word)| word).collect();
    assert_eq!(found, ["scene", "contact"]);
    assert!(code.contains("x.sin()") && !code.contains("render"));
    assert_eq!(line_of(&code, code.find("x.sin").unwrap()), 2);
}
