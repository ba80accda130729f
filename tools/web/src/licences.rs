//! The licences of what the page and the program contain: fonts and libraries of others.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::pack::{failed, files};

/// The package of the program and of the page's library.
const PACKAGE: &str = "jointplay";
/// Texts for packages that come without one, the first choice first.
const STANDARD: [(&str, &str); 3] =
    [("Apache-2.0", APACHE), ("MIT", MIT), ("BSD-2-Clause", "tools/web/licences/BSD-2-Clause.txt")];
const APACHE: &str = "LICENSE-APACHE";
const MIT: &str = "LICENSE-MIT";

/// A list of the parts of the program, or the page, with their licences, and the texts of these, each once. `root`: folder of the
/// project; `features`: arguments of cargo that choose them.
pub fn licences(root: &Path, target: &str, features: &[&str]) -> Result<String, String> {
    let standard = |name: &str| read(&root.join(name));
    let apache = standard(APACHE)?;
    let mut document = Document::default();
    document.add("Jointplay", "MIT OR Apache-2.0", &[standard(MIT)?, apache.clone()]);
    document.add("Standard library of Rust", "MIT OR Apache-2.0", &[apache]);
    let contained = contained(root, target, features)?;
    let metadata =
        cargo(root, &[&["metadata", "--format-version", "1", "--filter-platform", target], features].concat())?;
    let metadata: Value = serde_json::from_str(&metadata).map_err(|e| format!("cargo metadata: {e}"))?;
    for package in metadata["packages"].as_array().into_iter().flatten() {
        let field = |key: &str| package[key].as_str().unwrap_or_default();
        let name = format!("{} {}", field("name"), field("version"));
        // The project's own packages have no source.
        if !contained.contains(&name) || package["source"].is_null() {
            continue;
        }
        let folder = Path::new(field("manifest_path")).parent().unwrap_or(root);
        let mut texts = licence_files(folder)?.iter().map(|file| read(file)).collect::<Result<Vec<_>, _>>()?;
        if texts.is_empty() {
            let offered = |licence: &str| field("license").split([' ', '/', '(', ')']).any(|one| one == licence);
            let chosen = STANDARD.iter().find(|(licence, _)| offered(licence));
            let (licence, file) = chosen.ok_or_else(|| {
                let licence = field("license");
                format!("{name} comes without the text of its licence, `{licence}`: add it to STANDARD in tools/web/src/licences.rs")
            })?;
            let text = standard(file)?;
            let authors: Vec<_> =
                package["authors"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
            texts.push(if *licence == "Apache-2.0" {
                text
            } else {
                format!("Copyright (c) {}\n\n{text}", authors.join(", "))
            });
        }
        document.add(&name, field("license"), &texts);
    }
    Ok(document.text())
}

/// The packages in the program, as name and version: neither build tools nor what only other members of the workspace need.
fn contained(root: &Path, target: &str, features: &[&str]) -> Result<BTreeSet<String>, String> {
    let edges = ["--edges", "normal,no-proc-macro", "--prefix", "none", "--format", "{p}"];
    let tree = cargo(root, &[&["tree", "--package", PACKAGE, "--target", target], features, &edges].concat())?;
    let packages = tree.lines().filter_map(|line| {
        let (name, rest) = line.split_once(" v")?;
        Some(format!("{name} {}", rest.split(' ').next()?))
    });
    Ok(packages.collect())
}

fn cargo(root: &Path, arguments: &[&str]) -> Result<String, String> {
    let command = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(command).args(arguments).arg("--locked").current_dir(root).output();
    let output = output.map_err(|e| format!("cargo: {e}"))?;
    if !output.status.success() {
        return Err(format!("cargo {}: {}", arguments.join(" "), String::from_utf8_lossy(&output.stderr)));
    }
    String::from_utf8(output.stdout).map_err(|e| format!("cargo: {e}"))
}

/// The files in `folder` and below that hold licences, by their names; beside a font, every text.
fn licence_files(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let entries = files(folder)?;
    let ends_with = |file: &Path, endings: &[&str]| {
        file.extension().is_some_and(|own| endings.iter().any(|ending| own.eq_ignore_ascii_case(ending)))
    };
    let has_font = entries.iter().any(|file| ends_with(file, &["ttf", "otf"]));
    let mut found = Vec::new();
    for entry in entries {
        if entry.is_dir() {
            found.extend(licence_files(&entry)?);
            continue;
        }
        let name = entry.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
        let is_licence = ["licens", "licenc", "copying", "copyright", "notice"].iter().any(|word| name.contains(word));
        // A package under the GPL alone could not be in the page: it is one of several choices.
        let is_other_choice = name.contains("gpl");
        if is_licence && !is_other_choice && !ends_with(&entry, &["rs"]) || has_font && ends_with(&entry, &["txt"]) {
            found.push(entry);
        }
    }
    Ok(found)
}

fn read(file: &Path) -> Result<String, String> {
    let bytes = fs::read(file).map_err(|e| failed(file, &e))?;
    Ok(String::from_utf8_lossy(&bytes).replace('\r', ""))
}

/// The document under construction.
#[derive(Default)]
struct Document {
    /// A line for each part.
    parts: Vec<String>,
    /// The texts, and each without its white space, by which equal ones are found.
    texts: Vec<String>,
    keys: Vec<String>,
}

impl Document {
    /// Adds a part that may be used under `licence`, an SPDX expression.
    fn add(&mut self, part: &str, licence: &str, texts: &[String]) {
        let mut numbers = BTreeSet::new();
        for text in texts {
            let key: String = text.split_whitespace().collect();
            let known = self.keys.iter().position(|known| *known == key);
            numbers.insert(1 + known.unwrap_or(self.keys.len()));
            if known.is_none() {
                self.keys.push(key);
                self.texts.push(text.trim_matches(['\n', '\r']).trim_end().to_owned());
            }
        }
        let numbers: Vec<_> = numbers.iter().map(ToString::to_string).collect();
        self.parts.push(format!("{part}: {licence} (text {})", numbers.join(", ")));
    }

    fn text(&self) -> String {
        let introduction = "Jointplay contains fonts, libraries and data of others, listed here with their licences. Where there is a \
                            choice, any one of them applies. The texts follow, by number.";
        let mut document = format!("{introduction}\n\n{}\n", self.parts.join("\n"));
        for (at, text) in self.texts.iter().enumerate() {
            document += &format!("\n{}\n\n{text}\n", format_args!("---------- {} ----------", at + 1));
        }
        document
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pack::root;

    #[test]
    fn every_font_and_library_of_the_page_is_listed_with_a_text() {
        const TARGET: &str = "wasm32-unknown-unknown";
        let text = licences(&root(), TARGET, &[]).expect("the licences");
        let (list, texts) = text.split_once("\n---------- 1 ----------\n").expect("a list and texts");
        let listed: BTreeSet<&str> = list.lines().filter_map(|line| Some(line.split_once(": ")?.0)).collect();
        let packages = contained(&root(), TARGET, &[]).expect("packages");
        assert!(packages.len() > 100, "{packages:?}");
        for package in packages.iter().filter(|package| !package.starts_with(PACKAGE)) {
            assert!(listed.contains(package.as_str()), "{package}");
        }
        // Not in the page: of the desktop, of the tests, and a tool of the compiler.
        for other in ["winit", "proptest", "syn"] {
            assert!(!listed.iter().any(|name| name.starts_with(&format!("{other} "))), "{other}");
        }
        for part in [
            "UBUNTU FONT LICENCE",
            "SIL Open Font License",
            "Copyright (c) 2014 John Slegers",
            "Bitstream Vera",
            "Copyright (c) Project Nayuki",
            "Copyright (c) Mata Network",
            "Apache License",
        ] {
            assert!(texts.contains(part), "{part}");
        }
        assert!(!texts.contains("GNU GENERAL PUBLIC LICENSE"));
    }

    #[test]
    fn libraries_of_the_program_are_those_of_its_target_and_features() {
        let listed = |target: &str, features: &[&str], name: &str| {
            let text = licences(&root(), target, features).expect("the licences");
            text.lines().any(|line| line.starts_with(&format!("{name} ")) && line.contains(" (text "))
        };
        let (linux, windows) = ("x86_64-unknown-linux-gnu", "x86_64-pc-windows-gnu");
        for (target, features, name, is_listed) in [
            (linux, &["--features", "sound"][..], "winit", true),
            (linux, &["--features", "sound"], "cpal", true),
            (linux, &["--features", "sound"], "proptest", false),
            (windows, &["--no-default-features"], "winit", false),
            (windows, &["--no-default-features"], "ctrlc", true),
        ] {
            assert_eq!(listed(target, features, name), is_listed, "{target} {name}");
        }
    }

    #[test]
    fn a_text_that_several_parts_share_is_written_once() {
        let mut document = Document::default();
        document.add("one 1", "MIT", &["the\n text".to_owned()]);
        document.add("two 2", "MIT OR Zlib", &["another".to_owned(), "\nthe text\n".to_owned()]);
        let text = document.text();
        assert!(text.contains("\none 1: MIT (text 1)\ntwo 2: MIT OR Zlib (text 1, 2)\n"), "{text}");
        assert_eq!(text.matches("\nthe").count(), 1, "{text}");
    }
}
