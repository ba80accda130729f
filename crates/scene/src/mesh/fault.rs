//! What can be wrong with a file, in numbers; the wording is formed on display.

use std::error::Error;

/// Why another file that a file names cannot be had, from whoever looks for it.
pub(super) type NoFile = Box<dyn Error + Send + Sync>;

/// What is wrong with a file.
#[derive(Debug)]
pub struct Fault {
    /// Offset in the file, bytes, where it is known.
    pub at: Option<usize>,
    /// What is wrong there.
    pub why: MeshFault,
}

impl Fault {
    pub(super) fn at(at: usize, why: MeshFault) -> Self {
        let at = Some(at);
        Self { at, why }
    }

    pub(super) fn somewhere(why: MeshFault) -> Self {
        Self { at: None, why }
    }
}

/// Why a file gives no mesh.
#[derive(Debug, thiserror::Error)]
pub enum MeshFault {
    /// The file ends early.
    #[error("the file ends within {0}")]
    EndsWithin(&'static str),
    /// Something else than the format has in this place.
    #[error("expected {0}")]
    Expected(&'static str),
    /// Not text.
    #[error("this byte is no text in UTF-8")]
    NotText,
    /// A word that should be a coordinate.
    #[error("is not a number")]
    NotNumber,
    /// A vertex with fewer or more.
    #[error("needs three coordinates")]
    Coordinates,
    /// No triangle at all.
    #[error("holds no triangles")]
    NoTriangles,
    /// More than this program reads.
    #[error("has too many {what}; allowed at most {most}")]
    TooMany {
        /// Of what.
        what: &'static str,
        /// Largest number.
        most: usize,
    },
    /// A vertex that is too far off, or nowhere.
    #[error("a coordinate is out of range; allowed -{most:e} to {most:e} in the unit of the file")]
    OutOfRange {
        /// Largest coordinate, in the unit of the file.
        most: f64,
    },
    /// OBJ: a face that names a vertex which is not there.
    #[error(
        "is none of the {known} vertices before this line; allowed 1 to {known}, or -{known} to -1 counted from the latest"
    )]
    NoVertex {
        /// Number of vertices.
        known: usize,
    },
    /// OBJ: a face with two vertices or less.
    #[error("a face needs at least 3 vertices")]
    Face,
    /// STL: a loop that is no triangle.
    #[error("a loop needs three vertices")]
    Loop,
    /// STL: no bytes.
    #[error("the file is empty")]
    Empty,
    /// STL: of neither kind.
    #[error("neither a binary STL file nor one in text, which begins with `solid`")]
    NotStl,
    /// STL: a length that does not fit the number of triangles.
    #[error("a binary STL file with {triangles} triangles, as it says here, has {wanted} bytes, this file has {bytes}")]
    Length {
        /// As the file says.
        triangles: usize,
        /// Length with so many of them, bytes.
        wanted: usize,
        /// Length of the file, bytes.
        bytes: usize,
    },
    /// glTF: not JSON.
    #[error("no glTF file: {0}")]
    NotJson(serde_json::Error),
    /// glTF: another version of the binary container.
    #[error("version {0} of glTF; allowed 2")]
    Container(usize),
    /// glTF: a chunk longer than what is left of the file.
    #[error("{0} ends beyond the file")]
    LongChunk(&'static str),
    /// glTF: another version.
    #[error("asset.version is `{0}`; allowed 2.0 and above")]
    Version(String),
    /// glTF: cannot be read without this extension, as JSON.
    #[error("extensionsRequired: this program does not know {0}; export the mesh without it")]
    Extension(String),
    /// glTF: this buffer lies nowhere.
    #[error("buffers[{0}].uri: missing")]
    NoUri(usize),
    /// glTF: this buffer lies within the file, in another way than as base64.
    #[error("buffers[{0}].uri: holds no base64 data")]
    NotBase64(usize),
    /// glTF: a buffer lies in another file.
    #[error("buffers[{buffer}].uri: {why}")]
    Other {
        /// Its index.
        buffer: usize,
        /// Why the other file cannot be had.
        why: Box<dyn Error + Send + Sync>,
    },
    /// glTF: an index beyond the end of a list.
    #[error("{list}[{at}]: there is none")]
    NoItem {
        /// Name of the list.
        list: &'static str,
        /// The index.
        at: usize,
    },
    /// glTF: an index that is none.
    #[error("{key} is {json}, must be a whole number")]
    NotIndex {
        /// What should be an index.
        key: &'static str,
        /// What is there.
        json: String,
    },
    /// glTF: a number of bytes or elements that is none.
    #[error("{list}[{at}] {key} is {json}, must be a whole number")]
    NotSize {
        /// Name of the list.
        list: &'static str,
        /// Index in it.
        at: usize,
        /// What should be such a number.
        key: &'static str,
        /// What is there.
        json: String,
    },
    /// glTF: does not fit in what it is a part of.
    #[error("{list}[{at}] ends beyond its {whole}")]
    Beyond {
        /// Name of the list.
        list: &'static str,
        /// Index in it.
        at: usize,
        /// What it is a part of.
        whole: &'static str,
    },
    /// glTF: this node hangs on two others, or on itself.
    #[error("nodes[{0}] is there twice in the scene")]
    Twice(usize),
    /// glTF: a node is not placed by as many numbers as it takes.
    #[error("nodes[{node}].{key} must be {count} numbers")]
    NotNumbers {
        /// Its index.
        node: usize,
        /// What places it.
        key: &'static str,
        /// How many numbers.
        count: usize,
    },
    /// glTF: this mesh has triangles with common sides.
    #[error("meshes[{0}]: strips and fans of triangles are not read; export single triangles")]
    Strips(usize),
    /// glTF: a triangle with a corner that is not there.
    #[error("meshes[{mesh}]: vertex {vertex} is none of its {known}")]
    NoCorner {
        /// Index of the mesh.
        mesh: usize,
        /// Index of the corner.
        vertex: usize,
        /// Number of corners.
        known: usize,
    },
    /// glTF: this accessor lists changes to other numbers.
    #[error("accessors[{0}] is sparse, which this program does not read")]
    Sparse(usize),
    /// glTF: other elements than are needed for this.
    #[error("accessors[{accessor}] is not of type {kind} with a component type of {components:?}")]
    Elements {
        /// Its index.
        accessor: usize,
        /// Wanted type.
        kind: &'static str,
        /// Allowed types of components, as glTF numbers them.
        components: &'static [u64],
    },
}
