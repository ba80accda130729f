//! Files named by a scene. They are read once, when the scene is loaded, and stored in its source, so that re-reading the
//! scene gives the same content.

use std::borrow::Cow;
use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::path::{Component, Path};
use std::sync::Arc;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;

use super::Texts;
use super::file::{ReadError, read_regular};
use super::mesh::{Fault, Mesh, MeshFormat};

/// Size limit for scene and text files, bytes: a scene is a few kilobytes.
pub const MAX_FILE_SIZE: u64 = 4 << 20;
/// Size limit for a mesh file, and for all mesh files together, bytes.
pub const MAX_MESH_SIZE: u64 = 8 << 20;

/// Size limit for the user-supplied file `name`, bytes.
pub fn max_file_size(name: &str) -> u64 {
    match MeshFormat::of(name) {
        Some(_) => MAX_MESH_SIZE,
        None => MAX_FILE_SIZE,
    }
}

/// Prefix of base64 content: for binary files, and for text that itself begins with it.
const ENCODED: &str = "base64:";

/// Decodes the bytes of a file that a scene stores as `text`.
pub fn file_bytes(text: &str) -> Cow<'_, [u8]> {
    let decoded = text.strip_prefix(ENCODED).map(|data| BASE64.decode(data));
    match decoded {
        Some(Ok(bytes)) => bytes.into(),
        _ => text.as_bytes().into(),
    }
}

/// Encodes the bytes of a file for storage in a scene.
fn encode(bytes: Vec<u8>) -> Arc<str> {
    match String::from_utf8(bytes) {
        Ok(text) if !text.starts_with(ENCODED) => text.into(),
        Ok(text) => encoded(text.as_bytes()),
        Err(fault) => encoded(fault.as_bytes()),
    }
}

fn encoded(bytes: &[u8]) -> Arc<str> {
    format!("{ENCODED}{}", BASE64.encode(bytes)).into()
}

/// Why a file named by a scene is unavailable.
#[derive(Debug, thiserror::Error)]
pub(super) enum AssetFault {
    #[error(
        "is not a file beside the scene; allowed: the name of a file in the scene's folder or below it, without \
             `..`"
    )]
    NotBeside,
    #[error(
        "this scene has no folder in which to find a file: choose or drop that file and the scene's at once, or load the scene \
         from a disk; what the file holds can also be written into the scene itself"
    )]
    NoFolder,
    #[error(transparent)]
    Unreadable(#[from] ReadError),
    #[error("too large; allowed at most {} MiB in all {files} that a scene names", .limit >> 20)]
    TooLarge {
        /// Total limit for files of this kind, bytes.
        limit: u64,
        files: &'static str,
    },
    #[error("not a text file: it is not valid UTF-8")]
    NotText,
    #[error("is not a mesh file; allowed: names that end in {}", MeshFormat::ENDINGS)]
    NotMesh,
}

/// Why a mesh cannot be read.
pub(super) enum MeshError {
    /// The file is unavailable or its format unknown.
    Unavailable(AssetFault),
    /// The file is invalid; `text` is its content if it is text.
    Invalid { text: Option<Arc<str>>, fault: Fault },
}

#[derive(Clone, Copy)]
enum FileKind {
    Text,
    Mesh,
}

/// Resolves the files named by a scene, and records those requested.
#[derive(Default)]
pub(super) struct AssetResolver<'d> {
    /// Folder of the scene file; `None` if only `known` and `given` may be used.
    folder: Option<&'d Path>,
    /// Files read earlier.
    known: Option<&'d Texts>,
    /// Files opened together with the scene, by name without folder.
    given: Option<&'d BTreeMap<String, Vec<u8>>>,
    requested: RefCell<Texts>,
    /// Bytes read so far for each [`FileKind`].
    bytes_read: [Cell<u64>; 2],
    /// Meshes parsed from the files in `requested`.
    meshes: RefCell<BTreeMap<String, Arc<Mesh>>>,
}

impl<'d> AssetResolver<'d> {
    pub fn in_folder(folder: &'d Path) -> Self {
        Self { folder: Some(folder), ..Self::default() }
    }

    /// A resolver that uses files read earlier.
    pub fn known(texts: &'d Texts) -> Self {
        Self { known: Some(texts), ..Self::default() }
    }

    /// A resolver that uses the files `given` with the scene, and its `folder` if it has one.
    pub fn given(given: &'d BTreeMap<String, Vec<u8>>, folder: Option<&'d Path>) -> Self {
        Self { folder, given: Some(given), ..Self::default() }
    }

    /// Text of the file `name`.
    ///
    /// # Errors
    /// The file is unavailable or not text.
    pub fn text(&self, name: &str) -> Result<Arc<str>, AssetFault> {
        let text = self.content(name, FileKind::Text)?;
        if text.starts_with(ENCODED) {
            return Err(AssetFault::NotText);
        }
        Ok(text)
    }

    /// Mesh of the file `name`.
    ///
    /// # Errors
    /// The file is unavailable or invalid.
    pub fn mesh(&self, name: &str) -> Result<Arc<Mesh>, MeshError> {
        if let Some(mesh) = self.meshes.borrow().get(name) {
            return Ok(mesh.clone());
        }
        let format = MeshFormat::of(name).ok_or(MeshError::Unavailable(AssetFault::NotMesh))?;
        let text = self.content(name, FileKind::Mesh).map_err(MeshError::Unavailable)?;
        // References are relative to the folder of the mesh file.
        let other = |other: &str| {
            let other = Path::new(name).with_file_name(other);
            let text = self.content(&other.to_string_lossy(), FileKind::Mesh)?;
            Ok(file_bytes(&text).into_owned())
        };
        let mesh = format.read(&file_bytes(&text), &other);
        let mesh = mesh.map_err(|fault| MeshError::Invalid {
            text: Some(text.clone()).filter(|text| !text.starts_with(ENCODED)),
            fault,
        })?;
        let mesh = Arc::new(mesh);
        let mut meshes = self.meshes.borrow_mut();
        meshes.insert(name.to_owned(), mesh.clone());
        Ok(mesh)
    }

    /// Encoded content of the file `name`.
    fn content(&self, name: &str, kind: FileKind) -> Result<Arc<str>, AssetFault> {
        let found = self.requested.borrow().get(name).cloned();
        let found = found.or_else(|| self.known?.get(name).cloned());
        let text = match found {
            Some(text) => text,
            None => self.read(name, kind)?,
        };
        let mut requested = self.requested.borrow_mut();
        requested.insert(name.to_owned(), text.clone());
        Ok(text)
    }

    /// Contents of all files requested.
    pub fn texts(&self) -> Texts {
        self.requested.borrow().clone()
    }

    fn read(&self, name: &str, kind: FileKind) -> Result<Arc<str>, AssetFault> {
        let is_plain = |part: Component<'_>| matches!(part, Component::Normal(_));
        if name.is_empty() || !Path::new(name).components().all(is_plain) {
            return Err(AssetFault::NotBeside);
        }
        let (limit, files) = match kind {
            FileKind::Text => (MAX_FILE_SIZE, "files"),
            FileKind::Mesh => (MAX_MESH_SIZE, "meshes"),
        };
        let bytes_read = &self.bytes_read[kind as usize];
        let remaining = limit.saturating_sub(bytes_read.get());
        let bytes = self.bytes(Path::new(name), remaining).map_err(|fault| match fault {
            AssetFault::Unreadable(ReadError::TooLarge(_)) => AssetFault::TooLarge { limit, files },
            other => other,
        })?;
        bytes_read.set(bytes_read.get() + bytes.len() as u64);
        Ok(encode(bytes))
    }

    /// Content of the file `name`, of at most `limit` bytes.
    fn bytes(&self, name: &Path, limit: u64) -> Result<Vec<u8>, AssetFault> {
        let path = self.folder.map(|folder| folder.join(name));
        // Files dropped on a web page come without a folder.
        let given = name.file_name().and_then(|own| self.given?.get(own.to_str()?));
        match (given, path) {
            (Some(bytes), path) if !path.as_ref().is_some_and(|path| path.exists()) => {
                if bytes.len() as u64 > limit {
                    return Err(ReadError::TooLarge(limit).into());
                }
                Ok(bytes.clone())
            }
            (_, Some(path)) => Ok(read_regular(&path, limit)?),
            (_, None) => Err(AssetFault::NoFolder),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encoded_files_decode_to_the_same_bytes() {
        for bytes in [&b"v 1 2 3"[..], b"base64:AAAA", b"base64:", b"", b"\xff\x00solid"] {
            let text = encode(bytes.to_vec());
            assert_eq!(&*file_bytes(&text), bytes);
        }
        assert_eq!(&*encode(b"plain".to_vec()), "plain");
    }
}
