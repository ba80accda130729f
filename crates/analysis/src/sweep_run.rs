//! A sweep computed on the threads of this machine, with its finished blocks in a text file from which an interrupted sweep
//! resumes.
//!
//! Every line of the file begins with the CRC-32 of the rest of the line: the first line has the settings of the sweep as JSON, each
//! other one the number of a block and its records. Lines are only appended. A line that does not match its checksum, as a kill or
//! a full disk leaves it, is ignored, and its block computed again.

use std::fmt::Write as _;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, BufRead as _, BufReader, Seek as _, SeekFrom, Write as _};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use serde_json::Value as Json;

use super::parallel::{NoThreads, run_parallel};
use super::sweep::Sweep;

/// Time between two writes of the file to the disk.
const SYNC_INTERVAL: Duration = Duration::from_millis(500);

/// Steps between two looks at whether to continue.
const STEPS_BETWEEN_CHECKS: u32 = 4096;

/// Longest line, bytes, beside 32 for each number of a block: the settings have the texts of a scene and of its meshes, 12 MiB.
const MAX_LINE: usize = 64 << 20;

/// Why a sweep is not computed.
#[derive(Debug, thiserror::Error)]
pub enum RunFault {
    /// Too many numbers.
    #[error("{points} points of {length} numbers do not fit into memory: vary fewer values, or keep fewer sections")]
    NoMemory {
        /// Points.
        points: usize,
        /// Numbers of a point.
        length: usize,
    },
    /// No threads.
    #[error(transparent)]
    NoThreads(#[from] NoThreads),
    /// The file cannot be used.
    #[error("cannot use {}: {cause}", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: io::Error,
    },
    /// Another run uses the file.
    #[error("{} is in use: another run computes the same sweep", .0.display())]
    InUse(PathBuf),
    /// The file is not one of finished blocks.
    #[error("{} has no finished blocks of a sweep and is not used; delete it, or choose another name", .0.display())]
    Foreign(PathBuf),
    /// The file has blocks of another sweep.
    #[error("{} was started with other settings ({difference}); finish that sweep, delete the file, or choose another name", .path.display())]
    OtherSettings {
        /// The file.
        path: PathBuf,
        /// The first setting that differs.
        difference: String,
    },
}

/// A sweep with the records of its finished blocks.
pub struct SweepRun<'a> {
    sweep: &'a Sweep,
    /// One record per point, NaN for points of other blocks.
    records: Vec<f64>,
    done: Vec<bool>,
    file: Option<BlocksFile>,
}

/// The file of finished blocks.
struct BlocksFile {
    path: PathBuf,
    file: File,
    synced: Instant,
}

impl<'a> SweepRun<'a> {
    /// A sweep of which nothing is computed yet.
    ///
    /// # Errors
    /// No memory for the result.
    pub fn new(sweep: &'a Sweep) -> Result<Self, RunFault> {
        let (points, length) = (sweep.design().points(), sweep.layout().record_length());
        let mut records = Vec::new();
        if points.checked_mul(length).is_none_or(|count| records.try_reserve_exact(count).is_err()) {
            return Err(RunFault::NoMemory { points, length });
        }
        records.resize(points * length, f64::NAN);
        Ok(Self { sweep, records, done: vec![false; sweep.design().blocks()], file: None })
    }

    /// A sweep whose finished blocks are in the file `path`, which is created if it does not exist. `settings` identify the sweep.
    ///
    /// # Errors
    /// An unreadable file, one of another sweep, or one that another run uses.
    pub fn resumed(sweep: &'a Sweep, path: &Path, settings: &Json) -> Result<Self, RunFault> {
        let mut run = Self::new(sweep)?;
        let failed = |cause| RunFault::File { path: path.to_owned(), cause };
        if path.metadata().is_ok_and(|metadata| !metadata.is_file()) {
            return Err(failed(io::Error::other("it is not a regular file")));
        }
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path).map_err(failed)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(RunFault::InUse(path.to_owned())),
            // On a file system without locks, the user must avoid two runs with the same file.
            Err(TryLockError::Error(_)) => {}
        }
        let end = run.read(path, &file, settings)?;
        // The next line must not continue a torn one.
        file.set_len(end).and_then(|()| (&file).seek(SeekFrom::End(0)).map(|_| ())).map_err(failed)?;
        let mut blocks = BlocksFile { path: path.to_owned(), file, synced: Instant::now() };
        if end == 0 {
            blocks.append(&settings.to_string())?;
            blocks.sync()?;
        }
        run.file = Some(blocks);
        Ok(run)
    }

    /// Reads the finished blocks; returns the end of the last whole line.
    fn read(&mut self, path: &Path, file: &File, settings: &Json) -> Result<u64, RunFault> {
        let failed = |cause| RunFault::File { path: path.to_owned(), cause };
        let longest = MAX_LINE + self.records.len().saturating_mul(32);
        let mut reader = BufReader::new(file);
        let (mut line, mut end) = (Vec::new(), 0);
        loop {
            line.clear();
            let read = io::Read::take(&mut reader, longest as u64).read_until(b'\n', &mut line).map_err(failed)?;
            if line.last() != Some(&b'\n') {
                // Before the settings are whole, the file has nothing to lose, unless it is somebody else's.
                let is_torn_start = end == 0 && (read == 0 || settings_line(settings).as_bytes().starts_with(&line));
                return if end > 0 || is_torn_start { Ok(end) } else { Err(RunFault::Foreign(path.to_owned())) };
            }
            line.pop();
            let content = checked(&line);
            if end == 0 {
                let stored = content.and_then(|text| serde_json::from_str(text).ok());
                let stored: Json = stored.ok_or_else(|| RunFault::Foreign(path.to_owned()))?;
                if stored != *settings {
                    let difference = difference(&stored, settings);
                    return Err(RunFault::OtherSettings { path: path.to_owned(), difference });
                }
            } else if let Some((b, records)) = content.and_then(|text| self.block_of(text)) {
                self.insert(b, &records);
            }
            end += read as u64;
        }
    }

    /// Number and records of the block in a line.
    fn block_of(&self, text: &str) -> Option<(usize, Vec<f64>)> {
        let mut words = text.split(' ');
        let b: usize = words.next()?.parse().ok().filter(|b| *b < self.done.len())?;
        let records = words.map(|word| word.parse().ok()).collect::<Option<Vec<f64>>>()?;
        (records.len() == self.sweep.design().block(b).len() * self.sweep.layout().record_length())
            .then_some((b, records))
    }

    fn insert(&mut self, b: usize, records: &[f64]) {
        let (points, length) = (self.sweep.design().block(b), self.sweep.layout().record_length());
        self.records[points.start * length..points.end * length].copy_from_slice(records);
        self.done[b] = true;
    }

    /// Number of points of finished blocks.
    pub fn finished_points(&self) -> usize {
        let blocks = self.done.iter().enumerate().filter(|(_, done)| **done);
        blocks.map(|(b, _)| self.sweep.design().block(b).len()).sum()
    }

    /// Whether all blocks are finished.
    pub fn is_complete(&self) -> bool {
        self.done.iter().all(|done| *done)
    }

    /// One record per point, in their order; NaN for the points of unfinished blocks.
    pub fn records(&self) -> &[f64] {
        &self.records
    }

    /// One record per point.
    pub fn into_records(self) -> Vec<f64> {
        self.records
    }

    /// Computes the blocks that are not finished, on `threads` threads, which do not affect the result. `watch` is called with the
    /// number of finished points at least every 50 ms, and stops the sweep when it breaks.
    ///
    /// # Errors
    /// The file cannot be written, no threads.
    pub fn compute(&mut self, threads: usize, mut watch: impl FnMut(usize) -> ControlFlow<()>) -> Result<(), RunFault> {
        let sweep = self.sweep;
        let todo: Vec<usize> = (0..self.done.len()).filter(|b| !self.done[*b]).collect();
        // Points of unfinished blocks count, too: a block of points that follow each other takes long.
        let points = AtomicUsize::new(self.finished_points());
        let work = |b: usize, may_continue: &dyn Fn() -> bool| {
            let mut block = sweep.begin(b);
            let mut reported = 0;
            while !block.is_done() {
                if !may_continue() {
                    return None;
                }
                block.advance(STEPS_BETWEEN_CHECKS);
                let finished = block.finished().len();
                points.fetch_add(finished - reported, Ordering::Relaxed);
                reported = finished;
            }
            Some(block.records())
        };
        let (mut outcome, mut flow) = (Ok(()), ControlFlow::Continue(()));
        run_parallel(&todo, threads, work, |result| {
            if let Some((b, records)) = result {
                self.insert(b, &records);
                if let (Some(file), Ok(())) = (&mut self.file, &outcome) {
                    outcome = file.append_block(b, &records);
                }
            }
            if flow.is_continue() {
                flow = if outcome.is_err() { ControlFlow::Break(()) } else { watch(points.load(Ordering::Relaxed)) };
            }
            flow
        })?;
        outcome?;
        self.file.as_mut().map_or(Ok(()), BlocksFile::sync)
    }
}

impl BlocksFile {
    fn append_block(&mut self, b: usize, records: &[f64]) -> Result<(), RunFault> {
        let mut text = b.to_string();
        for value in records {
            // Writing to a String cannot fail. The shortest number that reads back as the same bits.
            let _ = write!(text, " {value:e}");
        }
        self.append(&text)?;
        if self.synced.elapsed() < SYNC_INTERVAL { Ok(()) } else { self.sync() }
    }

    fn append(&mut self, content: &str) -> Result<(), RunFault> {
        self.file.write_all(line(content).as_bytes()).map_err(|cause| self.failed(cause))
    }

    fn sync(&mut self) -> Result<(), RunFault> {
        self.synced = Instant::now();
        self.file.sync_data().map_err(|cause| self.failed(cause))
    }

    fn failed(&self, cause: io::Error) -> RunFault {
        RunFault::File { path: self.path.clone(), cause }
    }
}

/// A line with its checksum.
fn line(content: &str) -> String {
    format!("{:08x} {content}\n", crc32fast::hash(content.as_bytes()))
}

fn settings_line(settings: &Json) -> String {
    line(&settings.to_string())
}

/// The content of a line without its end, if it matches its checksum.
fn checked(line: &[u8]) -> Option<&str> {
    let (checksum, content) = std::str::from_utf8(line).ok()?.split_once(' ')?;
    (checksum == format!("{:08x}", crc32fast::hash(content.as_bytes()))).then_some(content)
}

/// The first setting that differs.
fn difference(stored: &Json, requested: &Json) -> String {
    let (Some(stored), Some(requested)) = (stored.as_object(), requested.as_object()) else {
        return "unreadable".to_owned();
    };
    let mut keys = requested.keys().chain(stored.keys());
    let differing = keys.find(|key| stored.get(*key) != requested.get(*key));
    let is_short = |value: Option<&Json>| value.is_none_or(|value| !value.is_array() && !value.is_object());
    let show = |value: Option<&Json>| value.map_or("none".to_owned(), Json::to_string);
    differing.map_or("in their order".to_owned(), |key| match (stored.get(key), requested.get(key)) {
        (there, now) if is_short(there) && is_short(now) => format!("{key}: {} there, {} now", show(there), show(now)),
        _ => key.clone(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::Axis;
    use crate::design::{Design, Start};
    use crate::point::Plan;
    use jointplay_scene::Scene;
    use serde_json::json;

    fn sweep() -> Sweep {
        let scene = Scene::load("slider-crank-driven", &[]).expect("built in");
        let axis = Axis::parse(&scene, "contact.clearance=0.2mm..0.3mm:3").expect("a range");
        let design = Design::crossed(&scene, vec![axis], &[Start::Cold]).expect("three points");
        Sweep::new(scene, design, Plan { periods: 1, discard: 0, phase: 0.0, exponent: false }).expect("a sweep")
    }

    fn to_the_end(_: usize) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    fn same_bits(a: &[f64], b: &[f64]) -> bool {
        a.iter().map(|x| x.to_bits()).eq(b.iter().map(|x| x.to_bits()))
    }

    #[test]
    fn a_file_cut_anywhere_or_damaged_anywhere_gives_the_same_bits() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("blocks");
        let (sweep, settings) = (sweep(), json!({"periods": 1}));
        let mut whole = SweepRun::resumed(&sweep, &path, &settings).expect("a new file");
        whole.compute(2, to_the_end).expect("computed");
        assert!(whole.is_complete() && whole.finished_points() == 3);
        let expected = whole.records().to_vec();
        let mut plain = SweepRun::new(&sweep).expect("memory");
        plain.compute(1, to_the_end).expect("computed");
        assert!(same_bits(&expected, plain.records()));
        drop(whole);
        let bytes = std::fs::read(&path).expect("written");
        let start = bytes.iter().position(|byte| *byte == b'\n').expect("settings") + 1;
        let ends: Vec<usize> = (0..bytes.len()).filter(|i| bytes[*i] == b'\n').collect();
        for cut in (0..bytes.len()).step_by(41).chain(ends.iter().flat_map(|end| [*end, end + 1])) {
            std::fs::write(&path, &bytes[..cut]).expect("cut");
            let mut run = SweepRun::resumed(&sweep, &path, &settings).unwrap_or_else(|e| panic!("cut at {cut}: {e}"));
            let lines = ends.iter().filter(|end| **end < cut).count();
            assert_eq!(run.finished_points(), lines.saturating_sub(1), "cut at {cut}");
            if cut % 5 == 0 {
                run.compute(2, to_the_end).expect("computed");
                assert!(same_bits(&expected, run.records()));
                drop(run);
                let mut again = SweepRun::resumed(&sweep, &path, &settings).expect("its own file");
                again.compute(1, |_| panic!("all blocks are there")).expect("nothing to do");
                assert!(same_bits(&expected, again.records()), "cut at {cut}");
            }
        }
        for at in (start..bytes.len()).step_by(29) {
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x10;
            std::fs::write(&path, &damaged).expect("written");
            let run = SweepRun::resumed(&sweep, &path, &settings).unwrap_or_else(|e| panic!("byte {at}: {e}"));
            assert!(run.finished_points() < 3, "byte {at}");
            let length = sweep.layout().record_length();
            for (point, record) in run.records().chunks(length).enumerate() {
                let is_done = !record.iter().all(|value| value.is_nan());
                assert!(!is_done || same_bits(record, &expected[point * length..][..length]), "byte {at}");
            }
        }
        // Settings that are damaged, or somebody else's file, are not touched.
        for content in [&b"hello"[..], b"x", b"hello\nworld\n", &[&b"x"[..], &bytes].concat()] {
            std::fs::write(&path, content).expect("written");
            let refused = SweepRun::resumed(&sweep, &path, &settings);
            assert!(matches!(refused, Err(RunFault::Foreign(_))));
            assert_eq!(std::fs::read(&path).expect("there"), content);
        }
        std::fs::write(&path, &bytes).expect("written");
        let other = SweepRun::resumed(&sweep, &path, &json!({"periods": 2})).err().expect("refused").to_string();
        assert!(other.contains("other settings (periods: 1 there, 2 now)"), "{other}");
        let _in_use = SweepRun::resumed(&sweep, &path, &settings).expect("its own file");
        assert!(matches!(SweepRun::resumed(&sweep, &path, &settings), Err(RunFault::InUse(_))));
    }

    #[test]
    fn a_sweep_that_is_stopped_resumes() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("blocks");
        let (sweep, settings) = (sweep(), json!({}));
        let mut run = SweepRun::resumed(&sweep, &path, &settings).expect("a new file");
        let stop_after_one = |points| if points >= 1 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
        run.compute(1, stop_after_one).expect("stopped");
        let finished = run.finished_points();
        assert!(!run.is_complete());
        drop(run);
        let mut run = SweepRun::resumed(&sweep, &path, &settings).expect("its own file");
        assert_eq!(run.finished_points(), finished);
        run.compute(2, to_the_end).expect("computed");
        assert!(run.is_complete());
    }
}
