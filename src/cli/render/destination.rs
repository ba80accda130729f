//! Destination of frames: a folder of pictures, or a film.

use std::io::Write;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value as Json, json};

use super::labels;
use crate::cli::args::RenderArguments;
use crate::cli::output::{claim_metadata, write_meta};
use crate::cli::{Failure, print};
use crate::files::{Folder, MANIFEST, OutputFile, publish, spare_older};
use crate::film::{Film, FilmError, FilmFormat};
use crate::render::Image;

/// Destination of the frames. Nothing has its final name before [`Destination::finish`].
pub(in crate::cli) enum Destination {
    /// `frame_00000.png`, …, and a manifest.
    Pictures(Folder),
    /// One file, with its metadata beside it.
    Film {
        /// The frames so far.
        film: Box<Film>,
        /// The file.
        file: OutputFile,
        /// Its metadata.
        metadata: OutputFile,
    },
}

impl Destination {
    /// The destination named by `arguments`.
    ///
    /// # Errors
    /// A path that cannot be written, or a film that its format cannot hold.
    pub fn claim(arguments: &RenderArguments) -> Result<Self, Failure> {
        let Some(path) = &arguments.film else {
            let folder = arguments.out.as_deref().unwrap_or(Path::new(""));
            return Ok(Self::Pictures(Folder::claim(folder, arguments.force)?));
        };
        let name = path.to_string_lossy();
        let Some(format) = FilmFormat::of_name(&name) else {
            return Err(Failure::usage(format!(
                "--film {name}: the name must end in {}",
                FilmFormat::ALL.map(|format| format!(".{format}")).join(" or ")
            )));
        };
        let size = [arguments.size.0, arguments.size.1];
        let rate = arguments.fps.unwrap_or_default();
        let film = Film::new(format, size, rate).map_err(film_failure)?;
        let file = OutputFile::claim(path, arguments.force)?;
        let metadata = claim_metadata(path, arguments.force)?;
        Ok(Self::Film { film: Box::new(film), file, metadata })
    }

    /// Adds frame `number` and returns its description for the manifest. `meta` is the provenance of all frames.
    ///
    /// # Errors
    /// Input/output, or a film that becomes too large.
    pub fn add(
        &mut self,
        number: usize,
        image: &Image,
        meta: &Map<String, Json>,
    ) -> Result<Map<String, Json>, Failure> {
        let mut entry = Map::new();
        match self {
            Self::Pictures(folder) => {
                let labels = labels(meta);
                let labels: Vec<(&str, &str)> = labels.iter().map(|(key, text)| (*key, text.as_str())).collect();
                let png = image.png(&labels).map_err(|error| Failure::io(error.to_string()))?;
                let file = format!("frame_{number:05}.png");
                folder.write(&file, &png)?;
                entry.insert("file".into(), json!(file));
            }
            Self::Film { film, .. } => {
                film.add(&image.rgba).map_err(film_failure)?;
                // Checksum of the pixels before encoding, as in a PNG.
                let checksum = format!("{:08x}", crc32fast::hash(&image.rgba));
                entry.insert("pixels_crc32".into(), json!(checksum));
            }
        }
        Ok(entry)
    }

    /// For frames that are not complete: names beside the requested ones, if those would replace older results. Returns them.
    pub fn spare_older(&mut self) -> Vec<PathBuf> {
        match self {
            Self::Pictures(folder) => folder.spare_older(),
            Self::Film { file, metadata, .. } => spare_older(vec![file, metadata]),
        }
    }

    /// Gives everything its final name.
    ///
    /// # Errors
    /// Input/output.
    pub fn finish(self, mut manifest: Map<String, Json>, written: &str) -> Result<(), Failure> {
        match self {
            Self::Pictures(folder) => {
                let place = folder.path().to_owned();
                folder.finish(manifest)?;
                print(&format!("{written} and {MANIFEST} in {}\n", place.display()))
            }
            Self::Film { film, file, metadata } => {
                let bytes = film.finish().map_err(film_failure)?;
                let checksum = format!("{:08x}", crc32fast::hash(&bytes));
                manifest.insert("film_crc32".into(), json!(checksum));
                let place = file.path().to_owned();
                let metadata = metadata.fill(|out| write_meta(out, &manifest))?;
                let film = file.fill(|out| out.write_all(&bytes))?;
                publish(vec![metadata, film])?;
                print(&format!("{written} in {}\n", place.display()))
            }
        }
    }
}

fn film_failure(error: FilmError) -> Failure {
    match error {
        FilmError::Encoder(_) => Failure::io(error.to_string()),
        _ => Failure::usage(error.to_string()),
    }
}
