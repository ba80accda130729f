//! The scheduler example distributes a sweep over shards, merges them, and resumes after a failure.
#![cfg(target_os = "linux")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use crate::program::jointplay;

const SWEEP: &str = "spcmm --vary contact.clearance=0.2mm..0.4mm:3 --periods 2 --discard 1";

fn example(folder: &Path, line: &str) -> Output {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/sweep-parallel.sh");
    Command::new(script)
        .args(line.split_whitespace())
        .current_dir(folder)
        .env("JOINTPLAY", env!("CARGO_BIN_EXE_jointplay"))
        .env("PARALLEL_OPTIONS", "--jobs 2")
        // GNU parallel stores its settings there.
        .env("HOME", folder)
        .output()
        .unwrap()
}

#[test]
fn gnu_parallel_distributes_a_sweep_and_resumes_after_a_failure() {
    let version = Command::new("parallel").arg("--version").output();
    let is_installed = version.is_ok_and(|v| String::from_utf8_lossy(&v.stdout).contains("GNU parallel"));
    assert!(is_installed, "GNU parallel is missing: ./test installs it (Debian, Ubuntu: parallel)");
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    jointplay(folder.path(), &format!("sweep {SWEEP} --out whole.npz")).expect(0);

    // A shard that cannot be written fails, and nothing is merged.
    fs::create_dir_all(path("spread.npz.shards/2.npz.partial")).unwrap();
    let failed = example(folder.path(), &format!("2 spread.npz {SWEEP}"));
    let stderr = String::from_utf8_lossy(&failed.stderr).into_owned();
    assert!(!failed.status.success() && !path("spread.npz").exists());
    assert!(stderr.contains("2.npz.partial"), "{stderr}");
    fs::remove_dir(path("spread.npz.shards/2.npz.partial")).unwrap();

    let resumed = example(folder.path(), &format!("2 spread.npz {SWEEP}"));
    assert!(resumed.status.success(), "{}", String::from_utf8_lossy(&resumed.stderr));
    assert!(fs::read(path("spread.npz")).unwrap() == fs::read(path("whole.npz")).unwrap());
    assert!(!path("spread.npz.shards").exists());
}
