//! Dependencies point downwards: a module uses only modules on lower floors.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Floors from the ground up; modules of one floor do not use each other.
const FLOORS: [&[&str]; 12] = [
    &["words", "jet", "suggest", "units"],
    &["contact", "expression", "integrate", "interpolate"],
    &["machine"],
    &["mechanism"],
    &["simulate"],
    &["scene", "mesh"],
    &["analysis", "files"],
    &["chart", "film", "view"],
    &["render", "session"],
    &["app"],
    &["cli"],
    &["main", "web"],
];
/// Modules whose results must be the same bits everywhere.
const REPRODUCIBLE: [&str; 10] = [
    "jet",
    "contact",
    "expression",
    "integrate",
    "interpolate",
    "machine",
    "mechanism",
    "scene",
    "simulate",
    "analysis",
];
/// Modules of the lowest crate.
const PHYSICS: [&str; 11] = [
    "words",
    "jet",
    "suggest",
    "units",
    "contact",
    "expression",
    "integrate",
    "interpolate",
    "machine",
    "mechanism",
    "simulate",
];
/// Crates that are a single module.
const CRATES: [&str; 2] = ["scene", "analysis"];

fn floor(module: &str) -> Option<usize> {
    FLOORS.iter().position(|floor| floor.contains(&module))
}

/// Source files under `folder`.
fn sources(folder: &Path, out: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            sources(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}

/// (module, file name for messages, code without comments and strings) of every file except the `lib.rs` of crates with several modules.
fn files() -> Vec<(String, String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut paths = Vec::new();
    for crate_root in ["crates/physics/src", "src"].map(|folder| root.join(folder)) {
        let mut crate_files = Vec::new();
        sources(&crate_root, &mut crate_files);
        paths.extend(crate_files.into_iter().map(|path| (path.strip_prefix(&crate_root).unwrap().to_owned(), path)));
    }
    for name in CRATES {
        let folder = root.join(format!("crates/{name}/src"));
        let mut crate_files = Vec::new();
        sources(&folder, &mut crate_files);
        paths.extend(crate_files.into_iter().map(|path| {
            let local = path.strip_prefix(&folder).unwrap();
            let local = if local == Path::new("lib.rs") { Path::new("mod.rs") } else { local };
            (Path::new(name).join(local), path)
        }));
    }
    let mut files = Vec::new();
    for (local, path) in paths {
        let first = local.components().next().unwrap().as_os_str();
        let module = Path::new(first).file_stem().unwrap().to_str().unwrap();
        if module == "lib" {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        let mut code = code(&text);
        if CRATES.contains(&module) {
            code = code.replace("crate::", &format!("crate::{module}::"));
        }
        files.push((module.to_owned(), local.display().to_string(), code));
    }
    files
}

/// Rust source with comments and string contents blanked; line numbers are preserved.
fn code(text: &str) -> String {
    let c: Vec<char> = text.chars().collect();
    let (mut out, mut i) = (String::new(), 0);
    let blank = |out: &mut String, from: usize, to: usize| {
        out.extend(c[from..to].iter().map(|&c| if c == '\n' { '\n' } else { ' ' }));
    };
    while i < c.len() {
        let start = i;
        let word_before = i > 0 && (c[i - 1].is_alphanumeric() || c[i - 1] == '_');
        if c[i..].starts_with(&['/', '/']) {
            i += c[i..].iter().position(|&c| c == '\n').unwrap_or(c.len() - i);
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
            while i < c.len() && !(c[i] == '"' && c[i + 1..].iter().take_while(|&&c| c == '#').count() >= hashes) {
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

/// Words of `code` with their offsets.
fn words(code: &str) -> impl Iterator<Item = (usize, &str)> {
    code.split(|c: char| !(c.is_alphanumeric() || c == '_'))
        .filter(|word| !word.is_empty())
        .map(|word| (word.as_ptr() as usize - code.as_ptr() as usize, word))
}

fn line_of(code: &str, at: usize) -> usize {
    code[..at].matches('\n').count() + 1
}

/// Appends the paths of the use tree at the start of `code`, including `{…}` lists and `*`; returns the code after it.
fn parse_use_tree<'c>(mut code: &'c str, start: &[&'c str], paths: &mut Vec<Vec<&'c str>>) -> &'c str {
    let mut path = start.to_vec();
    loop {
        code = code.trim_start();
        if let Some(mut list) = code.strip_prefix('{') {
            loop {
                list = list.trim_start();
                if let Some(rest) = list.strip_prefix('}') {
                    return rest;
                }
                let rest = parse_use_tree(list, &path, paths);
                // Skips `as name`.
                let rest = rest.trim_start_matches(|c| !matches!(c, ',' | '}'));
                list = rest.strip_prefix(',').unwrap_or(rest);
            }
        }
        let end = code.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(code.len());
        let end = if code.starts_with('*') { 1 } else { end };
        path.extend((end > 0).then(|| &code[..end]));
        match code[end..].strip_prefix("::") {
            Some(rest) if end > 0 => code = rest,
            _ => {
                paths.push(path);
                return &code[end..];
            }
        }
    }
}

/// Every path that begins with one of the words `starts`, with its offset.
fn paths<'c>(code: &'c str, starts: &[&str]) -> Vec<(usize, Vec<&'c str>)> {
    let mut all = Vec::new();
    for (at, word) in words(code) {
        let begins = !code[..at].ends_with("::") && code[at + word.len()..].starts_with("::");
        if begins && starts.contains(&word) {
            let mut paths = Vec::new();
            parse_use_tree(&code[at..], &[], &mut paths);
            all.extend(paths.into_iter().map(|path| (at, path)));
        }
    }
    all
}

/// Modules named first after `crate::` (or `jointplay::` in the entries).
fn uses(code: &str) -> Vec<(usize, &str)> {
    let paths = paths(code, &["crate", "jointplay"]).into_iter();
    paths.filter_map(|(at, path)| Some((at, *path.get(1)?))).collect()
}

#[test]
fn modules_use_only_lower_floors() {
    let files = files();
    let mut arrows = 0;
    for (module, file, code) in &files {
        let own = floor(module).unwrap_or_else(|| panic!("{file}: module {module} has no floor"));
        for (at, used) in uses(code) {
            let Some(other) = floor(used).filter(|_| *used != *"scene" || !PHYSICS.contains(&module.as_str())) else {
                // An item of the crate's root is no module. Only tests of the physics use scenes; the compiler enforces that.
                continue;
            };
            arrows += 1;
            assert!(used == module || other < own, "src/{file}:{}: {module} uses {used}", line_of(code, at));
        }
        // `super` must not climb above the module's own folder; the module of tests at the end is one deeper.
        let depth = file.matches('/').count() - usize::from(file.ends_with("mod.rs"));
        let (production, tests) = code.split_once("#[cfg(test)]").unwrap_or((code, ""));
        for (part, deeper) in [(production, 1), (tests, 2)] {
            let climb = "super::".repeat(depth + deeper);
            assert!(!part.contains(&climb), "src/{file}: climbs out by {climb}");
        }
    }
    assert!(arrows > 20, "only {arrows} arrows found: does the search still work?");
}

/// A module's code without its tests.
struct Module<'c> {
    file: &'c str,
    code: &'c str,
    /// Names of its items.
    items: BTreeSet<&'c str>,
    /// Paths that it imports, as written.
    imports: Vec<Vec<&'c str>>,
}

impl<'c> Module<'c> {
    fn of(file: &'c str, code: &'c str) -> Self {
        const KINDS: [&str; 8] = ["fn", "struct", "enum", "trait", "type", "const", "static", "macro_rules"];
        let all: Vec<&str> = words(code).map(|(_, word)| word).collect();
        let pairs = all.windows(2).filter(|pair| KINDS.contains(&pair[0]));
        let mut imports = Vec::new();
        for (at, word) in words(code).filter(|(_, word)| *word == "use") {
            parse_use_tree(&code[at + word.len()..], &[], &mut imports);
        }
        Self { file, code, items: pairs.map(|pair| pair[1]).collect(), imports }
    }
}

/// Modules by their path from the root.
struct Modules<'c>(BTreeMap<Vec<&'c str>, Module<'c>>);

impl<'c> Modules<'c> {
    /// A path written in `module` from the root; `None` if it leads to another crate.
    fn absolute(&self, module: &[&'c str], path: &[&'c str]) -> Option<Vec<&'c str>> {
        let climbs = path.iter().take_while(|word| **word == "super").count();
        let above = &module[..module.len().checked_sub(climbs)?];
        match *path.first()? {
            "crate" => Some(path[1..].to_vec()),
            "self" => Some([module, &path[1..]].concat()),
            "super" => Some([above, &path[climbs..]].concat()),
            child => {
                let known = self.0.contains_key(&[module, &[child]].concat());
                known.then(|| [module, path].concat())
            }
        }
    }

    /// The longest part of a path from the root that is a module.
    fn module<'p>(&self, path: &'p [&'c str]) -> &'p [&'c str] {
        let known = |end: &usize| self.0.contains_key(&path[..*end]);
        &path[..(1..=path.len()).rev().find(known).unwrap_or(0)]
    }

    /// The module that defines the item at a path from the root, through re-exports.
    fn defining_module(&self, path: &[&'c str], depth: usize) -> Option<Vec<&'c str>> {
        let at = self.module(path);
        let (module, Some(name)) = (self.0.get(at)?, path.get(at.len())) else {
            return Some(at.to_vec());
        };
        if module.items.contains(name) {
            return Some(at.to_vec());
        }
        module.imports.iter().find_map(|import| {
            let mut target = self.absolute(at, import)?;
            if target.pop_if(|last| *last == "*").is_some() {
                target.push(name);
            }
            let named = depth > 0 && target.last() == Some(name);
            named.then(|| self.defining_module(&target, depth - 1)).flatten()
        })
    }

    /// Modules whose items `module` names, with the offset of each use.
    fn uses(&self, module: &[&'c str]) -> Vec<(usize, Vec<&'c str>)> {
        let code = self.0[module].code;
        let mut used = Vec::new();
        for (at, path) in paths(code, &["crate", "super"]) {
            let Some(mut target) = self.absolute(module, &path) else {
                continue;
            };
            if target.pop_if(|last| *last == "*").is_none() {
                let defining_module = self.defining_module(&target, 4);
                used.push((at, defining_module.unwrap_or_else(|| self.module(&target).to_vec())));
                continue;
            }
            for (at, word) in words(code) {
                let after = &code[at + word.len()..];
                let name = word.starts_with(char::is_uppercase) || after.starts_with(['(', ':']);
                let free = !code[..at].ends_with(['.', ':']) && !after.starts_with(": ");
                if name && free {
                    let item = [&target[..], &[word]].concat();
                    used.extend(self.defining_module(&item, 4).map(|defining_module| (at, defining_module)));
                }
            }
        }
        used
    }
}

#[test]
fn siblings_use_each_other_in_one_direction() {
    let files = files();
    let mut modules = Modules(BTreeMap::new());
    for (_, file, code) in &files {
        let (production, _) = code.split_once("#[cfg(test)]\nmod tests {").unwrap_or((code, ""));
        let path = file.trim_end_matches(".rs").trim_end_matches("/mod");
        modules.0.insert(path.split('/').collect(), Module::of(file, production));
    }
    // (folder, user, used) and a source position; both modules are below their common folder.
    let mut arrows = BTreeMap::new();
    for (user, module) in &modules.0 {
        for (at, used) in modules.uses(user) {
            let shared = user.iter().zip(&used).take_while(|(a, b)| a == b).count();
            if let (Some(a), Some(b)) = (user.get(shared), used.get(shared)) {
                let line = line_of(module.code, at);
                let place = format!("src/{}:{line}: {a} uses {b}", module.file);
                arrows.insert((&user[..shared], *a, *b), place);
            }
        }
    }
    assert!(arrows.len() > 300, "only {} arrows found: does the search still work?", arrows.len());
    // A module without users or without uses is in no cycle.
    loop {
        let before = arrows.len();
        let users: BTreeSet<_> = arrows.keys().map(|&(of, a, _)| (of, a)).collect();
        let used: BTreeSet<_> = arrows.keys().map(|&(of, _, b)| (of, b)).collect();
        arrows.retain(|&(of, a, b), _| users.contains(&(of, b)) && used.contains(&(of, a)));
        if arrows.len() == before {
            break;
        }
    }
    let places: Vec<String> = arrows.into_values().collect();
    assert!(places.is_empty(), "cycles:\n{}", places.join("\n"));
}

#[test]
fn files_are_written_through_one_module() {
    // Tests may also write.
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
        let (production, _) = code.split_once("#[cfg(test)]\nmod tests").unwrap_or((&code, ""));
        // `render/look.rs` draws pictures for inspection.
        // `sweep_run.rs` appends to the record of a sweep.
        let is_exempt = ["render/look.rs", "analysis/sweep_run.rs"].contains(&&*file);
        if module == "files" || is_exempt || file.ends_with("/tests.rs") {
            continue;
        }
        for call in WRITING {
            let at = production.find(call);
            assert!(at.is_none(), "src/{file}:{}: {call}", line_of(production, at.unwrap_or(0)));
        }
    }
}

#[test]
fn files_are_read_within_a_limit() {
    // `scene/file.rs` has the function; the last two read files of the system.
    const READING: [&str; 3] = ["scene/file.rs", "cli/machine.rs", "cli/interrupt.rs"];
    for (module, file, code) in files() {
        let (production, _) = code.split_once("#[cfg(test)]\nmod tests").unwrap_or((&code, ""));
        if module == "files" || READING.contains(&&*file) || file.ends_with("/tests.rs") {
            continue;
        }
        for call in ["fs::read(", "fs::read_to_string(", "File::open("] {
            let at = production.find(call);
            assert!(at.is_none(), "src/{file}:{}: {call}", line_of(production, at.unwrap_or(0)));
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
    // Elementary functions of std differ between platforms in the last bits; those of `libm` do not.
    const ELEMENTARY: [&str; 25] = [
        "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sin_cos", "sinh", "cosh", "tanh", "asinh", "acosh",
        "atanh", "exp", "exp2", "exp_m1", "ln", "ln_1p", "log", "log2", "log10", "powf", "cbrt", "hypot",
    ];
    let mut checked = 0;
    for (module, file, code) in files() {
        // Scheduling, which affects no result.
        let is_scheduling = ["analysis/parallel.rs", "analysis/sweep_run.rs"].contains(&&*file);
        if !REPRODUCIBLE.contains(&module.as_str()) || is_scheduling {
            continue;
        }
        checked += 1;
        assert!(!code.contains("std::time"), "src/{file}: std::time");
        for (at, word) in words(&code) {
            let position = || format!("src/{file}:{}: {word}", line_of(&code, at));
            // The record for the plots is in single precision; nothing is computed from it.
            let recorded = file == "simulate/history.rs";
            // Mesh files hold single-precision numbers; computations use f64.
            let single_precision =
                word == "f32" && (recorded || file == "machine/mesh.rs" || file.starts_with("scene/mesh/"));
            assert!(!FORBIDDEN.contains(&word) || single_precision, "{}", position());
            let called = code[at + word.len()..].starts_with('(');
            let before = &code[..at];
            let method = before.ends_with('.') || before.ends_with("f64::");
            if ELEMENTARY.contains(&word) && called && method {
                // A jet's own functions go through libm.
                let own = ["jet", "mechanism"].contains(&module.as_str()) && word == "sin_cos";
                assert!(own, "{}", position());
            }
        }
    }
    assert!(checked > 20, "only {checked} files");
}

#[test]
fn the_search_ignores_comments_and_strings() {
    let text = "use crate::{scene::{A, app}, contact}; // crate::app\nlet s = \"crate::render\"; 'a' r#\"crate::cli\"# x.sin()";
    let code = code(text);
    let modules: Vec<&str> = uses(&code).into_iter().map(|(_, word)| word).collect();
    assert_eq!(modules, ["scene", "scene", "contact"]);
    assert!(code.contains("x.sin()") && !code.contains("render"));
    assert_eq!(line_of(&code, code.find("x.sin").unwrap()), 2);
}
