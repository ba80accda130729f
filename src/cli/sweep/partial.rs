//! File beside a sweep's output with the finished blocks, from which an interrupted sweep resumes. It is removed once the
//! output is written.
//!
//! Layout: magic number with the format version; the settings as JSON, preceded by their length and followed by their CRC-32;
//! then for each block its number, the number of its values, the values (float64, little-endian), and the CRC-32 of all these.
//! A block is appended by one write; if that is cut short, only this block is lost. Any other inconsistency rejects the whole
//! file, because a partly read result would look complete.

use std::fs::{File, TryLockError};
use std::io::{BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde_json::{Map, Value as Json};

use super::archive::Source;
use crate::analysis::sweep::Sweep;
use crate::cli::{Failure, warn};
use crate::files::{open_or_create, remove_file};

/// Magic number; its last character is the format version.
const MAGIC: &[u8; 8] = b"JPSWEEP1";
/// Size limit of the settings, bytes; longer ones are rejected as damaged.
const MAX_SETTINGS_SIZE: u64 = 64 << 20;

/// The finished blocks of a sweep.
pub struct Partial {
    path: PathBuf,
    file: File,
    /// Start and end of the blocks, bytes.
    start: u64,
    end: u64,
    /// Points of each block, and whether it is done.
    points: Vec<std::ops::Range<usize>>,
    done: Vec<bool>,
    record: usize,
    /// Index of each point in the output; `usize::MAX` for a point of another shard.
    output_index: Vec<usize>,
}

impl Partial {
    /// The file beside `out`.
    fn path_of(out: &Path) -> PathBuf {
        out.with_added_extension("partial")
    }

    /// Opens or creates the file beside `out`, which has the blocks `blocks`.
    ///
    /// # Errors
    /// Input/output: unreadable, damaged, in use; usage: started with other settings.
    pub fn open(out: &Path, settings: &Map<String, Json>, sweep: &Sweep, blocks: &[usize]) -> Result<Self, Failure> {
        let path = Self::path_of(out);
        let settings = Json::Object(settings.clone());
        let file = open_or_create(&path, &header(&settings))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(Failure::io(format!("{} is in use: another run writes the same output", path.display())));
            }
            // On a file system without locks, the user must avoid two runs with the same output.
            Err(TryLockError::Error(error)) => log::warn!("no lock: {error}"),
        }
        let design = sweep.design();
        let mut output_index = vec![usize::MAX; design.points()];
        let mut next = 0;
        for &b in blocks {
            for point in design.block(b) {
                output_index[point] = next;
                next += 1;
            }
        }
        let mut partial = Self {
            file,
            start: 0,
            end: 0,
            points: (0..design.blocks()).map(|b| design.block(b)).collect(),
            done: vec![false; design.blocks()],
            record: sweep.layout().record_length(),
            output_index,
            path,
        };
        partial.read(&settings)?;
        Ok(partial)
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether block `b` is done.
    pub fn has(&self, b: usize) -> bool {
        self.done[b]
    }

    /// Reader positioned at the first block.
    fn reader(&self) -> Result<impl Read, Failure> {
        let mut file = &self.file;
        file.seek(SeekFrom::Start(self.start)).map_err(self.failed())?;
        Ok(BufReader::new(file.take(self.end - self.start)))
    }

    /// Appends the records of block `b`.
    ///
    /// # Errors
    /// A file system error; the file is then unchanged.
    pub fn append(&mut self, b: usize, records: &[f64]) -> Result<(), Failure> {
        let mut bytes = Vec::with_capacity(20 + 8 * records.len());
        bytes.extend((b as u64).to_le_bytes());
        bytes.extend((records.len() as u64).to_le_bytes());
        records.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
        bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
        let mut file = &self.file;
        file.seek(SeekFrom::Start(self.end)).map_err(self.failed())?;
        let written = file.write_all(&bytes).and_then(|()| file.sync_all());
        if let Err(error) = written {
            // Best effort: a torn block is detected when the file is read.
            let _ = self.file.set_len(self.end);
            return Err(self.failed()(error));
        }
        self.end += bytes.len() as u64;
        self.done[b] = true;
        Ok(())
    }

    /// Removes the file once the output has its content.
    pub fn remove(self) {
        if let Err(error) = remove_file(&self.path) {
            warn(&format!("{} is no longer needed and could not be removed: {error}", self.path.display()));
        }
    }

    fn failed(&self) -> impl Fn(std::io::Error) -> Failure + use<> {
        let path = self.path.clone();
        move |error| Failure::io(format!("cannot use {}: {error}", path.display()))
    }

    fn damaged(&self, what: &str) -> Failure {
        Failure::io(format!("{} is damaged ({what}) and not used; delete it to start again", self.path.display()))
    }

    fn length(&self) -> Result<u64, Failure> {
        Ok(self.file.metadata().map_err(self.failed())?.len())
    }

    /// Reads and checks the whole file.
    fn read(&mut self, settings: &Json) -> Result<(), Failure> {
        let length = self.length()?;
        let mut file = &self.file;
        file.seek(SeekFrom::Start(0)).map_err(self.failed())?;
        let mut reader = BufReader::new(file);
        let mut magic = [0; 8];
        let cut = |_| self.damaged("it is cut short");
        reader.read_exact(&mut magic).map_err(cut)?;
        if &magic != MAGIC {
            let old = magic[..7] == MAGIC[..7];
            return Err(self.damaged(if old {
                "it is of another version of the format"
            } else {
                "it is not a partial sweep"
            }));
        }
        let size = read_u64(&mut reader).map_err(cut)?;
        if size > MAX_SETTINGS_SIZE.min(length) {
            return Err(self.damaged("its settings are too long"));
        }
        let mut text = vec![0; size as usize];
        reader.read_exact(&mut text).map_err(cut)?;
        if read_u32(&mut reader).map_err(cut)? != crc32fast::hash(&text) {
            return Err(self.damaged("its settings do not match their checksum"));
        }
        let stored: Json = serde_json::from_slice(&text).map_err(|_| self.damaged("its settings cannot be read"))?;
        if stored != *settings {
            return Err(Failure::usage(format!(
                "{} was started with other settings ({}); finish that sweep, delete the file, or choose another --out",
                self.path.display(),
                difference(&stored, settings)
            )));
        }
        let start = (MAGIC.len() + 8 + text.len() + 4) as u64;
        let mut end = start;
        let mut done = vec![false; self.done.len()];
        let mut records = Vec::new();
        let mut cut = false;
        while end < length && !cut {
            match self.next_block(&mut reader, &mut records)? {
                Some(b) if std::mem::replace(&mut done[b], true) => {
                    return Err(self.damaged("it contains a block twice"));
                }
                Some(_) => end += 20 + 8 * records.len() as u64,
                None => cut = true,
            }
        }
        if cut {
            // Otherwise the torn block would precede the next one.
            self.file.set_len(end).map_err(self.failed())?;
        }
        (self.start, self.end, self.done) = (start, end, done);
        Ok(())
    }

    /// Number and records of the next block, which must be complete.
    fn read_block(&self, reader: &mut impl Read, records: &mut Vec<f64>) -> Result<usize, Failure> {
        let b = self.next_block(reader, records)?;
        b.ok_or_else(|| self.damaged("it is cut short"))
    }

    /// Number and records of the next block; `None` if the file ends first.
    fn next_block(&self, reader: &mut impl Read, records: &mut Vec<f64>) -> Result<Option<usize>, Failure> {
        let foreign = || self.damaged("a block does not belong to this sweep");
        // Every number that is present must be valid, so that foreign data does not pass for a torn block.
        let Some(b) = self.number(reader)? else {
            return Ok(None);
        };
        let expected = usize::try_from(b)
            .ok()
            .filter(|&b| b < self.points.len())
            .filter(|&b| self.output_index[self.points[b].start] != usize::MAX)
            .map(|b| (b, self.points[b].len() * self.record));
        let (block, expected) = expected.ok_or_else(foreign)?;
        let Some(values) = self.number(reader)? else {
            return Ok(None);
        };
        if values != expected as u64 {
            return Err(foreign());
        }
        let mut bytes = Vec::with_capacity(8 * expected + 4);
        let length = 8 * expected as u64 + 4;
        let read = reader.take(length).read_to_end(&mut bytes);
        if (read.map_err(self.failed())? as u64) < length {
            return Ok(None);
        }
        let (bytes, written) = bytes.split_at(8 * expected);
        let mut checksum = crc32fast::Hasher::new();
        checksum.update(&b.to_le_bytes());
        checksum.update(&values.to_le_bytes());
        checksum.update(bytes);
        if *written != checksum.finalize().to_le_bytes() {
            return Err(self.damaged("a block does not match its checksum"));
        }
        records.clear();
        let words = bytes.as_chunks().0.iter();
        records.extend(words.map(|word| f64::from_le_bytes(*word)));
        Ok(Some(block))
    }

    /// The next integer; `None` if the file ends first.
    fn number(&self, reader: &mut impl Read) -> Result<Option<u64>, Failure> {
        match read_u64(reader) {
            Ok(number) => Ok(Some(number)),
            Err(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => Ok(None),
            Err(error) => Err(self.failed()(error)),
        }
    }
}

/// The part of the file before its blocks.
fn header(settings: &Json) -> Vec<u8> {
    let text = settings.to_string();
    let mut bytes = MAGIC.to_vec();
    bytes.extend((text.len() as u64).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes.extend(crc32fast::hash(text.as_bytes()).to_le_bytes());
    bytes
}

impl Source for Partial {
    fn gather(&mut self, offset: usize, length: usize, out: &mut [f64]) -> Result<(), Failure> {
        let mut reader = self.reader()?;
        let mut records = Vec::new();
        for _ in 0..self.done.iter().filter(|done| **done).count() {
            let b = self.read_block(&mut reader, &mut records)?;
            let points = self.points[b].clone();
            for (point, record) in points.zip(records.chunks_exact(self.record)) {
                let at = self.output_index[point] * length;
                out[at..at + length].copy_from_slice(&record[offset..offset + length]);
            }
        }
        Ok(())
    }
}

/// The first setting that differs.
pub fn difference(stored: &Json, requested: &Json) -> String {
    let (Some(stored), Some(requested)) = (stored.as_object(), requested.as_object()) else {
        return "unreadable".to_owned();
    };
    let mut keys = requested.keys().chain(stored.keys());
    let differing = keys.find(|key| stored.get(*key) != requested.get(*key));
    let show = |value: Option<&Json>| value.map_or("none".to_owned(), Json::to_string);
    differing.map_or("in their order".to_owned(), |key| {
        format!("{key}: {} there, {} now", show(stored.get(key)), show(requested.get(key)))
    })
}

fn read_u64(reader: &mut impl Read) -> std::io::Result<u64> {
    let mut bytes = [0; 8];
    reader.read_exact(&mut bytes)?;
    Ok(u64::from_le_bytes(bytes))
}

fn read_u32(reader: &mut impl Read) -> std::io::Result<u32> {
    let mut bytes = [0; 4];
    reader.read_exact(&mut bytes)?;
    Ok(u32::from_le_bytes(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::axis::Axis;
    use crate::analysis::design::{Design, Start};
    use crate::analysis::point::Plan;
    use crate::scene::Scene;

    #[test]
    fn a_truncated_block_is_recomputed_and_other_damage_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("a.npz");
        let path = Partial::path_of(&out);
        let scene = Scene::load("spcmm", &[]).unwrap();
        let axis = Axis::parse(&scene, "contact.clearance=0.2mm..0.3mm:3").unwrap();
        let design = Design::crossed(&scene, vec![axis], &[Start::Cold]).unwrap();
        let plan = Plan { periods: 1, discard: 0, phase: 0.0, exponent: false };
        let sweep = Sweep::new(scene, design, plan).unwrap();
        let mut settings = Map::new();
        settings.insert("periods".into(), 1.into());
        let open = || Partial::open(&out, &settings, &sweep, &[0, 1, 2]);
        let length = sweep.layout().record_length();
        let mut partial = open().unwrap();
        let header_length = partial.end as usize;
        for b in [2, 0, 1] {
            partial.append(b, &vec![b as f64; length]).unwrap();
        }
        drop(partial);
        let whole = std::fs::read(&path).unwrap();
        let block = 20 + 8 * length;
        assert_eq!(whole.len(), header_length + 3 * block);
        // Steps of 29 cover every offset within the eight-byte numbers; `ends` are the boundaries of whole blocks.
        let ends = (0..=3).map(|blocks| header_length + blocks * block);
        for cut in (header_length..whole.len()).step_by(29).chain(ends) {
            std::fs::write(&path, &whole[..cut]).unwrap();
            let mut partial = open().unwrap_or_else(|e| panic!("cut at {cut}: {e}"));
            let blocks = (cut - header_length) / block;
            let left: Vec<usize> = [2, 0, 1][..blocks].to_vec();
            assert!((0..3).all(|b| partial.has(b) == left.contains(&b)), "cut at {cut}");
            // The sweep continues after the last whole block.
            for b in [2, 0, 1].into_iter().skip(blocks) {
                partial.append(b, &vec![b as f64; length]).unwrap();
            }
            drop(partial);
            assert!(std::fs::read(&path).unwrap() == whole, "cut at {cut}");
        }
        let assert_refused = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            let Err(failure) = open() else {
                panic!("a damaged file is accepted");
            };
            assert!(failure.message.contains("a.npz.partial is damaged"), "{failure}");
            assert!(std::fs::read(&path).unwrap() == bytes, "the file is unchanged");
        };
        for cut in (1..header_length).step_by(97) {
            assert_refused(&whole[..cut]);
        }
        for at in (0..whole.len()).step_by(37) {
            let mut bytes = whole.clone();
            bytes[at] ^= 0x10;
            assert_refused(&bytes);
        }
        assert_refused(&[&whole[..], &whole[whole.len() - 8..]].concat());
    }
}
