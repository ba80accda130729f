//! Every command that writes, on a file system that fails at any call: it leaves what was there or the whole result and
//! nothing beside it, and repeating it makes the same bytes. `JOINTPLAY_FAULTS` sets the number of faults per command.

use std::path::Path;

use clap::Parser;
use serde_json::Value as Json;

use super::{Arguments, Failure, dispatch};
use crate::files::faults::{Kind, Tree, survive};

/// Runs the command `line`; `@` stands for the folder.
fn command(folder: &Path, line: &str) -> Result<(), Failure> {
    let words = line.split_whitespace();
    let words = words.map(|word| word.replace('@', &folder.display().to_string()));
    dispatch(Arguments::try_parse_from(["jointplay".to_owned()].into_iter().chain(words)).unwrap())
}

/// As a script sees it: a disk fault is an input/output error.
fn outcome(result: Result<(), Failure>) -> Result<(), String> {
    result.map_err(|failure| {
        assert_eq!(failure.code, Failure::INPUT_OUTPUT, "{failure}");
        assert!(!failure.message.is_empty());
        failure.message
    })
}

/// Every file is the old or the new one, and the checksum in metadata tells whether it and its rows are from the same run.
fn whole_or_told(old: &Tree, new: &Tree, found: &Tree) -> bool {
    let is = |of: &Tree, name: &str| of.get(name) == found.get(name);
    found.iter().all(|(name, content)| {
        let Some(rows) = name.strip_suffix(".meta.json") else {
            // Rows always have their metadata.
            let account = format!("{name}.meta.json");
            return (is(old, name) || is(new, name)) && (!name.ends_with(".csv") || found.contains_key(&account));
        };
        let meta: Json = serde_json::from_slice(content).unwrap();
        let checksum = found.get(rows).map(|rows| format!("{:08x}", crc32fast::hash(rows)));
        let told = checksum.is_some_and(|checksum| meta["rows_crc32"] == checksum.as_str());
        let whole = [old, new].iter().any(|of| is(of, name) && is(of, rows));
        (is(old, name) || is(new, name)) && whole == told
    })
}

fn check(before: &[&str], line: &str) {
    let before = |folder: &Path| {
        for line in before {
            command(folder, line).unwrap();
        }
    };
    let work = |folder: &Path| outcome(command(folder, line));
    survive(Kind::default(), &before, &work, &whole_or_told);
}

#[test]
fn rows_and_impacts_survive_in_every_format() {
    let run = "run pendulum --duration 30ms --every 3ms --quiet";
    let all = "--out @/a.csv --impacts @/b.csv --wear @/c.csv --save-state @/d";
    check(&[], &format!("{run} {all}"));
    let old = format!("{run} --set contact.friction=0.3 --out @/a.csv --impacts @/b.csv");
    check(&[&old], &format!("{run} --out @/a.csv --impacts @/b.csv --force"));
    for ending in ["json", "npz"] {
        check(&[], &format!("{run} --out @/a.{ending}"));
    }
}

#[test]
fn sweeps_and_merges_survive() {
    // Without play the points cost next to nothing: this is about files.
    let sweep = "sweep spcmm --set contact.clearance=0 --vary spcmm.amplitude_x=20mm..25mm:3 --periods 1 --discard 0 --no-exponent --threads 1 --quiet";
    check(&[], &format!("{sweep} --out @/a.npz"));
    let shard = |k: usize| format!("{sweep} --shard {k}/2 --out @/{k}.npz");
    check(&[&shard(1), &shard(2)], "merge @/1.npz @/2.npz --out @/a.npz");
}

#[test]
fn two_writers_at_once_leave_one_whole_pair() {
    let folder = tempfile::tempdir().unwrap();
    let write = |friction: &str| {
        for _ in 0..12 {
            let line = format!(
                "run pendulum --duration 2ms --every 1ms --quiet --force --set contact.friction={friction} --out @/a.csv"
            );
            command(folder.path(), &line).unwrap();
        }
    };
    std::thread::scope(|scope| {
        scope.spawn(|| write("0.1"));
        scope.spawn(|| write("0.2"));
    });
    let found = crate::files::faults::tree(folder.path());
    assert_eq!(found.keys().collect::<Vec<_>>(), ["a.csv", "a.csv.meta.json"]);
    assert!(whole_or_told(&found, &found, &found));
}

#[test]
fn an_account_that_lost_its_rows_stands_in_no_way() {
    let folder = tempfile::tempdir().unwrap();
    let line = "run pendulum --duration 2ms --every 1ms --quiet --out @/a.csv";
    let at = |name: &str| folder.path().join(name);
    command(folder.path(), line).unwrap();
    std::fs::remove_file(at("a.csv")).unwrap();
    command(folder.path(), line).unwrap();
    // A file that this program did not write is left alone.
    std::fs::remove_file(at("a.csv")).unwrap();
    std::fs::write(at("a.csv.meta.json"), "{}").unwrap();
    let failure = command(folder.path(), line).unwrap_err();
    assert!(failure.message.contains("a.csv.meta.json already exists"), "{failure}");
    assert!(!at("a.csv").exists());
}

#[cfg(feature = "gui")]
#[test]
fn frames_survive() {
    use super::Command;
    use super::render::{Destination, Studio, Times, fill};
    use crate::render::Image;
    use crate::scene::LiveScene;
    use crate::scene::Scene;

    /// Draws nothing: this is about files.
    struct Blank(LiveScene);

    impl Studio for Blank {
        fn go_to(&mut self, instant: f64) -> Result<(), Failure> {
            self.0.advance_to(instant).unwrap();
            Ok(())
        }

        fn draw(&mut self, _instant: f64, _frame_time: Option<f64>) -> Result<Image, Failure> {
            Ok(Image { width: 16, height: 16, rgba: vec![self.0.statistics().steps as u8; 4 * 16 * 16] })
        }

        fn fix_arrow_scale(&mut self, _reference: f32) {}

        fn simulation(&self) -> &LiveScene {
            &self.0
        }

        fn adapter(&self) -> String {
            "none".to_owned()
        }
    }

    let render = |folder: &Path, at: &str| {
        let line = format!("jointplay render pendulum --size 16x16 --quiet --force {at}");
        let words = line.split_whitespace();
        let words = words.map(|word| word.replace('@', &folder.display().to_string()));
        let Some(Command::Render(arguments)) = Arguments::try_parse_from(words).unwrap().command else {
            panic!("not a command to render");
        };
        let scene = Scene::load("pendulum", &[]).unwrap();
        let times = Times::new(&arguments).unwrap();
        let destination = Destination::claim(&arguments)?;
        let mut studio = Blank(LiveScene::new(&scene).unwrap());
        fill(destination, &mut studio, &scene, &times, &arguments)
    };
    let whole = |old: &Tree, new: &Tree, found: &Tree| found == old || found == new;
    let old = |folder: &Path| render(folder, "--at 0s,1ms,3ms --out @/out").unwrap();
    survive(Kind::default(), &old, &|folder| outcome(render(folder, "--at 0s,2ms --out @/out")), &whole);
    // A film and its metadata are two files: the one tells whether it belongs to the other.
    let told = |old: &Tree, new: &Tree, found: &Tree| {
        let is = |of: &Tree, name: &str| of.get(name) == found.get(name);
        let each = |name: &String| is(old, name) || is(new, name);
        let film = found.get("a.mp4");
        found.keys().all(each)
            && film.is_none_or(|film| {
                let account = found.get("a.mp4.meta.json");
                let account: Json = serde_json::from_slice(account.unwrap()).unwrap();
                let checksum = format!("{:08x}", crc32fast::hash(film));
                let whole = [old, new].iter().any(|of| is(of, "a.mp4") && is(of, "a.mp4.meta.json"));
                whole == (account["film_crc32"] == checksum.as_str())
            })
    };
    let film = |duration: &str| format!("--duration {duration} --fps 500 --film @/a.mp4");
    survive(
        Kind::default(),
        &|folder: &Path| render(folder, &film("4ms")).unwrap(),
        &|folder| outcome(render(folder, &film("2ms"))),
        &told,
    );
}
