//! Commands that fail or are killed while they write: every file under a final name is complete, either the old or the new
//! one, and repeating the command gives the same bytes as an undisturbed run.
#![cfg(unix)]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::Value as Json;

use crate::program::{command, files as tree, folder, jointplay, names};

/// Contents of files by name.
type Tree = BTreeMap<String, Vec<u8>>;

/// The result files in `folder`: neither temporary files nor partial results that a later run resumes from.
fn results(folder: &Path) -> Tree {
    let mut files = tree(folder);
    files.retain(|name, _| !name.starts_with(".jointplay-") && !name.ends_with(".partial"));
    files
}

/// Runs the commands `before`, then `line` with increasing limits on the file size. A write beyond the limit fails as on a full
/// disk, whether or not the shell ignores its signal.
fn check_failures(before: &[&str], line: &str) {
    let prepare = || {
        let folder = folder();
        before.iter().for_each(|line| drop(jointplay(folder.path(), line).expect(0)));
        folder
    };
    let clean = prepare();
    let old = tree(clean.path());
    jointplay(clean.path(), line).expect(0);
    let new = tree(clean.path());
    let largest = new.values().map(Vec::len).max().unwrap();
    let mut failed = 0;
    for blocks in [0, 1, 4, 16, 64, 256].into_iter().filter(|blocks| blocks * 512 < largest) {
        for trap in ["trap '' XFSZ;", ""] {
            let folder = prepare();
            let limited =
                format!("{trap} ulimit -c 0; ulimit -f {blocks}; exec {} {line}", env!("CARGO_BIN_EXE_jointplay"));
            let output = Command::new("sh").args(["-c", &limited]).current_dir(folder.path()).output().unwrap();
            let case = format!("{limited}: {}, {:?}", String::from_utf8_lossy(&output.stderr), names(folder.path()));
            assert_eq!(output.status.code(), Some(1), "{case}");
            assert!(!names(folder.path()).iter().any(|name| name.starts_with(".jointplay-")), "{case}");
            assert!(results(folder.path()) == old, "{case}");
            jointplay(folder.path(), line).expect(0);
            assert!(tree(folder.path()) == new, "{case}, then {:?}", names(folder.path()));
            failed += 1;
        }
    }
    assert!(failed >= 4, "{line}: {failed}");
}

const RUN: &str = "run pendulum --duration 30ms --every 3ms --quiet";

#[test]
fn failed_runs_leave_old_or_new_files_in_every_format() {
    check_failures(&[], &format!("{RUN} --out a.csv --impacts b.csv --wear c.csv --save-state d"));
    let old = format!("{RUN} --set contact.friction=0.3 --out a.csv --impacts b.csv");
    check_failures(&[&old], &format!("{RUN} --out a.csv --impacts b.csv --force"));
    for ending in ["json", "npz"] {
        check_failures(&[], &format!("{RUN} --out a.{ending}"));
    }
}

#[test]
fn failed_sweeps_leave_old_or_new_files() {
    // Points without play are cheap: this test is about files.
    let sweep = "sweep spcmm --set contact.clearance=0 --vary spcmm.amplitude_x=20mm..25mm:3 --periods 1 --discard 0 --no-exponent --threads 1 --quiet";
    check_failures(&[], &format!("{sweep} --out a.npz"));
    check_failures(&[], &format!("{sweep} --out a.csv"));
}

#[cfg(feature = "gui")]
#[test]
fn failed_renders_leave_old_or_new_files() {
    let render = "render pendulum --size 64x64 --quiet --force";
    check_failures(&[&format!("{render} --at 0s,1ms,3ms --out out")], &format!("{render} --at 0s,2ms --out out"));
    let film = |duration: &str| format!("{render} --duration {duration} --fps 500 --film a.mp4");
    check_failures(&[&film("4ms")], &film("2ms"));
}

/// Asserts that each file is from one of two runs, and that the checksum in the metadata matches exactly if both are from the same run.
fn assert_consistent(runs: [&Tree; 2], files: &Tree) {
    assert!(files.keys().eq(["a.csv", "a.csv.meta.json"]), "{:?}", files.keys());
    let matches = |name: &str| runs.map(|run| run[name] == files[name]);
    let (rows, metadata) = (matches("a.csv"), matches("a.csv.meta.json"));
    assert!(rows.contains(&true) && metadata.contains(&true));
    let meta: Json = serde_json::from_slice(&files["a.csv.meta.json"]).unwrap();
    let checksum_matches = meta["rows_crc32"] == format!("{:08x}", crc32fast::hash(&files["a.csv"])).as_str();
    assert_eq!(checksum_matches, rows == metadata);
}

/// Two runs to the same file.
fn two_runs() -> [(String, Tree); 2] {
    ["0.1", "0.2"].map(|friction| {
        let folder = folder();
        let line = format!("{RUN} --force --set contact.friction={friction} --out a.csv");
        jointplay(folder.path(), &line).expect(0);
        (line, tree(folder.path()))
    })
}

#[test]
fn rows_of_a_run_killed_at_any_instant_are_the_old_or_the_new_file() {
    let [(_, old), (line, new)] = two_runs();
    let work = folder();
    let start = std::time::Instant::now();
    jointplay(work.path(), &line).expect(0);
    crate::common::at_random_instants(start.elapsed(), 4, |instant| {
        old.iter().for_each(|(name, content)| fs::write(work.path().join(name), content).unwrap());
        let mut child = command(work.path(), &line).stdout(Stdio::null()).spawn().unwrap();
        std::thread::sleep(instant);
        child.kill().unwrap();
        child.wait().unwrap();
        assert_consistent([&old, &new], &results(work.path()));
        jointplay(work.path(), &line).expect(0);
        assert!(tree(work.path()) == new);
    });
}

#[test]
fn concurrent_writers_leave_complete_files() {
    let runs = two_runs();
    let folder = folder();
    std::thread::scope(|scope| {
        for (line, _) in &runs {
            scope.spawn(|| (0..12).for_each(|_| drop(jointplay(folder.path(), line).expect(0))));
        }
    });
    assert_consistent([&runs[0].1, &runs[1].1], &tree(folder.path()));
}

#[test]
fn metadata_without_its_rows_can_be_replaced() {
    let folder = folder();
    let line = format!("{RUN} --out a.csv");
    let path = |name: &str| folder.path().join(name);
    jointplay(folder.path(), &line).expect(0);
    fs::remove_file(path("a.csv")).unwrap();
    jointplay(folder.path(), &line).expect(0);
    // A file that this program did not write is not replaced.
    fs::remove_file(path("a.csv")).unwrap();
    fs::write(path("a.csv.meta.json"), "{}").unwrap();
    let failure = jointplay(folder.path(), &line).expect(1);
    assert!(failure.stderr.contains("a.csv.meta.json already exists"), "{}", failure.stderr);
    assert!(!path("a.csv").exists());
}
