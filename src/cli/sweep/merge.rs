//! `merge`: combines the shards of a sweep into the file that one run of the whole sweep writes, byte for byte.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use ndarray::{Array1, ArrayD, OwnedRepr};
use ndarray_npy::{NpzReader, ReadNpzError, ReadableElement};
use serde_json::{Map, Value as Json};

use super::archive::{Archive, ArchivedAxis, AxisValues, SHARD, Source};
use super::options;
use super::target::Target;
use super::word::Word;
use crate::cli::args::MergeArguments;
use crate::cli::{Failure, interrupt};
use crate::files::same_file;
use crate::scene::open_regular;

/// An open shard.
struct OpenShard {
    path: PathBuf,
    reader: NpzReader<BufReader<File>>,
    meta: Map<String, Json>,
    /// Part and number of parts, e.g. `3/16`.
    shard: String,
    points: Vec<usize>,
}

/// Runs `merge`.
///
/// # Errors
/// Files that are not shards, or not all shards of one sweep; the file system.
pub fn merge(arguments: &MergeArguments) -> Result<(), Failure> {
    let shards: Vec<&Path> = arguments.shards.iter().map(PathBuf::as_path).collect();
    if same_file(&arguments.out, &shards).is_some() {
        return Err(Failure::usage(format!(
            "--out {} is one of the shards; choose another name",
            arguments.out.display()
        )));
    }
    let target = Target::claim(&arguments.out, arguments.force, false)?;
    let mut parts = Vec::new();
    for path in &arguments.shards {
        parts.push(OpenShard::open(path)?);
    }
    let Some(first) = parts.first_mut() else {
        return Err(Failure::usage("merge: no shard given"));
    };
    let meta = first.meta.clone();
    let axes = first.axes()?;
    for part in &parts[1..] {
        if part.meta != meta {
            return Err(Failure::usage(format!(
                "{} and {} are shards of different sweeps: {}",
                parts[0].path.display(),
                part.path.display(),
                super::partial::difference(&Json::Object(meta.clone()), &Json::Object(part.meta.clone())),
            )));
        }
    }
    let archive = Archive::of_meta(meta, axes).ok_or_else(|| not_a_shard(&parts[0].path))?;
    check_points(&parts, archive.count())?;
    let mut shards = Shards { names: archive.names(), parts };
    let summary = super::summarise(&archive, &mut shards)?;
    // An interrupted command must not leave a temporary file.
    interrupt::listen();
    target.write(&archive, &mut shards)?;
    super::report(&archive, &summary, &arguments.out, arguments.summary)
}

/// Requires every point exactly once.
fn check_points(parts: &[OpenShard], count: usize) -> Result<(), Failure> {
    let mut owner: Vec<Option<usize>> = vec![None; count];
    for (i, part) in parts.iter().enumerate() {
        for &point in &part.points {
            match owner.get_mut(point) {
                None => return Err(not_a_shard(&part.path)),
                Some(Some(other)) => {
                    return Err(Failure::usage(format!(
                        "{} and {} hold the same points (shards {} and {})",
                        parts[*other].path.display(),
                        part.path.display(),
                        parts[*other].shard,
                        part.shard
                    )));
                }
                Some(free) => *free = Some(i),
            }
        }
    }
    let missing = owner.iter().filter(|owner| owner.is_none()).count();
    if missing == 0 {
        return Ok(());
    }
    // Missing shards can be named only if all shards have the same number of parts.
    let numbers: Vec<_> = parts.iter().filter_map(|p| options::shard(&p.shard).ok()).collect();
    let of = numbers[0].of;
    let names: Vec<String> = if numbers.iter().all(|shard| shard.of == of) {
        let is_given = |k: &usize| numbers.iter().any(|shard| shard.number == *k);
        let missing_shards = (1..=of).filter(|k| !is_given(k));
        missing_shards.map(|k| format!("{k}/{of}")).collect()
    } else {
        Vec::new()
    };
    let which = if names.is_empty() { String::new() } else { format!("; shards not given: {}", names.join(", ")) };
    Err(Failure::usage(format!("{missing} of {count} points are in none of the files{which}")))
}

fn not_a_shard(path: &Path) -> Failure {
    Failure::usage(format!("{} is not a shard of a sweep (jointplay sweep … --shard K/M writes them)", path.display()))
}

impl OpenShard {
    fn open(path: &Path) -> Result<Self, Failure> {
        let file = open_regular(path).map_err(|error| Failure::io(format!("{}: {error}", path.display())))?;
        let mut part = Self {
            path: path.to_owned(),
            reader: NpzReader::new(BufReader::new(file)).map_err(|error| unreadable(path, &error))?,
            meta: Map::new(),
            shard: String::new(),
            points: Vec::new(),
        };
        let meta: Vec<u8> = part.array("meta")?.into_raw_vec_and_offset().0;
        let meta = serde_json::from_slice(&meta).ok();
        let Some(Json::Object(mut meta)) = meta else {
            return Err(not_a_shard(path));
        };
        let Some(Json::String(shard)) = meta.shift_remove(SHARD) else {
            return Err(not_a_shard(path));
        };
        options::shard(&shard).map_err(|_| not_a_shard(path))?;
        (part.meta, part.shard) = (meta, shard);
        let points: ArrayD<i64> = part.array("point")?;
        let points = points.iter().map(|&point| usize::try_from(point));
        part.points = points.collect::<Result<_, _>>().map_err(|_| not_a_shard(path))?;
        Ok(part)
    }

    /// The varied parameters.
    fn axes(&mut self) -> Result<Vec<ArchivedAxis>, Failure> {
        let vary = self.meta.get("vary").and_then(Json::as_array).cloned();
        let mut axes = Vec::new();
        for axis in vary.unwrap_or_default() {
            let key = axis.get("key").and_then(Json::as_str);
            let key = key.ok_or_else(|| not_a_shard(&self.path))?.to_owned();
            let unit = axis.get("unit").and_then(Json::as_str).unwrap_or_default().to_owned();
            let values = if axis.get("words").is_some() {
                let words: ArrayD<Word> = self.array(&key)?;
                AxisValues::Words(words.iter().cloned().collect())
            } else {
                let values: ArrayD<f64> = self.array(&key)?;
                AxisValues::Numbers(values.iter().copied().collect())
            };
            axes.push(ArchivedAxis { key, unit, values });
        }
        Ok(axes)
    }

    fn array<T: ReadableElement>(&mut self, name: &str) -> Result<ArrayD<T>, Failure> {
        let read = self.reader.by_name::<OwnedRepr<T>, ndarray::IxDyn>(name);
        read.map_err(|error| unreadable(&self.path, &error))
    }
}

fn unreadable(path: &Path, error: &ReadNpzError) -> Failure {
    Failure::io(format!("cannot read {} as a shard of a sweep: {error}", path.display()))
}

/// All shards of a sweep as one source.
struct Shards {
    /// Name, whether it holds integers, and length of each array, in record order.
    names: Vec<(String, bool, usize)>,
    parts: Vec<OpenShard>,
}

impl Source for Shards {
    fn gather(&mut self, offset: usize, length: usize, out: &mut [f64]) -> Result<(), Failure> {
        let mut before = 0;
        let array = self.names.iter().find(|(_, _, array_length)| {
            let is_at_offset = before == offset;
            before += array_length;
            is_at_offset
        });
        let Some((name, whole, _)) = array else {
            return Ok(());
        };
        for part in &mut self.parts {
            let values: Array1<f64> = if *whole {
                let values: ArrayD<i64> = part.array(name)?;
                values.iter().map(|value| *value as f64).collect()
            } else {
                let values: ArrayD<f64> = part.array(name)?;
                values.iter().copied().collect()
            };
            if values.len() != part.points.len() * length {
                return Err(not_a_shard(&part.path));
            }
            for (point, values) in part.points.iter().zip(values.exact_chunks(length)) {
                let out = &mut out[point * length..(point + 1) * length];
                out.iter_mut().zip(values).for_each(|(out, value)| *out = *value);
            }
        }
        Ok(())
    }
}
