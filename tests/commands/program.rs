//! Runs the program as a script would, and lists the files that it writes.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value as Json;
use tempfile::TempDir;

/// Exit status and output of a run of the program.
pub struct Outcome {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl Outcome {
    #[track_caller]
    pub fn expect(self, code: i32) -> Self {
        assert_eq!(self.code, Some(code), "stdout: {}\nstderr: {}", self.stdout, self.stderr);
        self
    }

    pub fn json(&self) -> Json {
        serde_json::from_str(&self.stdout).unwrap_or_else(|error| panic!("{error} in: {}", self.stdout))
    }
}

/// Runs the program in `folder` with the words of `line`.
pub fn jointplay(folder: &Path, line: &str) -> Outcome {
    let output = command(folder, line).output().unwrap();
    Outcome {
        code: output.status.code(),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8(output.stderr).unwrap(),
    }
}

/// The program in `folder` with the words of `line`, not yet started.
pub fn command(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_jointplay"));
    command
        .args(line.split_whitespace())
        .current_dir(folder)
        .env_remove("RUST_LOG")
        .env_remove("RUST_BACKTRACE")
        // No test opens a window.
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET");
    command
}

pub fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

#[cfg(target_os = "linux")]
/// Polls until `condition` holds, without a time limit.
pub fn poll_until(condition: impl Fn() -> bool) {
    let start = std::time::Instant::now();
    while !condition() {
        assert!(start.elapsed().as_secs() < 120, "the condition does not come");
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
}

/// Names in `folder`, sorted.
pub fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Every file under `folder` with its content.
pub fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    fn walk(root: &Path, folder: &Path, out: &mut BTreeMap<String, Vec<u8>>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(root, &path, out);
            } else {
                let name = path.strip_prefix(root).unwrap().display().to_string();
                out.insert(name, fs::read(&path).unwrap());
            }
        }
    }
    let mut out = BTreeMap::new();
    walk(folder, folder, &mut out);
    out
}

#[test]
fn the_summary_of_a_run_reports_doubts() {
    let run = |form: &str, floor: &str| {
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_jointplay"))
            .args(["run", "pendulum", "--duration", "20ms", "--quiet", "--summary", form])
            .args(["--set", floor])
            .output()
            .unwrap();
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    let (doubtful, trusted) = ("contact.impact_speed_floor=10m/s", "contact.impact_speed_floor=1mm/s");
    let json: serde_json::Value = serde_json::from_str(&run("json", doubtful)).unwrap();
    assert_eq!(json["doubts"].as_array().unwrap().len(), 1, "{json}");
    assert_eq!(json["slower_than_asked"], false);
    let json: serde_json::Value = serde_json::from_str(&run("json", trusted)).unwrap();
    assert!(json["doubts"].as_array().unwrap().is_empty(), "{json}");
    assert!(run("text", doubtful).contains("Not trusted       S1: "), "{}", run("text", doubtful));
    assert!(!run("text", trusted).contains("Not trusted"));
}
