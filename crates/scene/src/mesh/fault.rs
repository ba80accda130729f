//! Mesh file errors as data; `Display` forms the text.

use std::error::Error;

/// Error from the caller's lookup of a referenced file.
pub(super) type NoFile = Box<dyn Error + Send + Sync>;

/// An error in a mesh file.
#[derive(Debug)]
pub struct Fault {
    /// Byte offset in the file, if known.
    pub at: Option<usize>,
    /// Cause.
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

/// Why a mesh file is rejected.
#[derive(Debug, thiserror::Error)]
pub enum MeshFault {
    /// Unexpected end of file.
    #[error("the file ends within {0}")]
    EndsWithin(&'static str),
    /// Unexpected content.
    #[error("expected {0}")]
    Expected(&'static str),
    /// Invalid UTF-8.
    #[error("this byte is not valid UTF-8")]
    NotText,
    /// A coordinate that is not a number.
    #[error("is not a number")]
    NotNumber,
    /// A vertex without exactly three coordinates.
    #[error("needs three coordinates")]
    Coordinates,
    /// No triangles.
    #[error("holds no triangles")]
    NoTriangles,
    /// More items than this program reads.
    #[error("has too many {what}; allowed at most {most}")]
    TooMany {
        /// Kind of item.
        what: &'static str,
        /// Maximum number.
        most: usize,
    },
    /// A coordinate out of range or NaN.
    #[error("a coordinate is out of range; allowed -{most:e} to {most:e} in the unit of the file")]
    OutOfRange {
        /// Largest absolute coordinate, in file units.
        most: f64,
    },
    /// OBJ: a face with an invalid vertex index.
    #[error(
        "is not one of the {known} vertices before this line; allowed 1 to {known}, or -{known} to -1 counted from \
         the latest"
    )]
    NoVertex {
        /// Number of vertices so far.
        known: usize,
    },
    /// OBJ: a face with fewer than three vertices.
    #[error("a face needs at least 3 vertices")]
    Face,
    /// STL: a loop without exactly three vertices.
    #[error("a loop needs three vertices")]
    Loop,
    /// STL: an empty file.
    #[error("the file is empty")]
    Empty,
    /// STL: neither binary nor text.
    #[error("neither a binary STL file nor one in text, which begins with `solid`")]
    NotStl,
    /// STL: a file size that contradicts the triangle count.
    #[error("a binary STL file with {triangles} triangles, as it says here, has {wanted} bytes, this file has {bytes}")]
    Length {
        /// Triangle count in the file.
        triangles: usize,
        /// File size for this count, bytes.
        wanted: usize,
        /// Actual file size, bytes.
        bytes: usize,
    },
    /// glTF: invalid JSON.
    #[error("not a glTF file: {0}")]
    NotJson(serde_json::Error),
    /// glTF: an unsupported version of the binary container.
    #[error("version {0} of glTF; allowed 2")]
    Container(usize),
    /// glTF: a chunk that ends beyond the file.
    #[error("{0} ends beyond the file")]
    LongChunk(&'static str),
    /// glTF: an unsupported version.
    #[error("asset.version is `{0}`; allowed 2.0 and above")]
    Version(String),
    /// glTF: an unsupported required extension, as JSON.
    #[error("extensionsRequired: this program does not know {0}; export the mesh without it")]
    Extension(String),
    /// glTF: this buffer has no data.
    #[error("buffers[{0}].uri: missing")]
    NoUri(usize),
    /// glTF: this buffer has a data URI that is not base64.
    #[error("buffers[{0}].uri: holds no base64 data")]
    NotBase64(usize),
    /// glTF: an external buffer that cannot be read.
    #[error("buffers[{buffer}].uri: {why}")]
    Other {
        /// Index of the buffer.
        buffer: usize,
        /// Error from the lookup of the other file.
        why: Box<dyn Error + Send + Sync>,
    },
    /// glTF: an index beyond the end of a list.
    #[error("{list}[{at}] does not exist")]
    NoItem {
        /// Name of the list.
        list: &'static str,
        /// The index.
        at: usize,
    },
    /// glTF: an index that is not a whole number.
    #[error("{key} is {json}, must be a whole number")]
    NotIndex {
        /// Key of the index.
        key: &'static str,
        /// Its value, as JSON.
        json: String,
    },
    /// glTF: a byte or element count that is not a whole number.
    #[error("{list}[{at}] {key} is {json}, must be a whole number")]
    NotSize {
        /// Name of the list.
        list: &'static str,
        /// Index in the list.
        at: usize,
        /// Key of the count.
        key: &'static str,
        /// Its value, as JSON.
        json: String,
    },
    /// glTF: an item that ends beyond its container.
    #[error("{list}[{at}] ends beyond its {whole}")]
    Beyond {
        /// Name of the list.
        list: &'static str,
        /// Index in the list.
        at: usize,
        /// The container.
        whole: &'static str,
    },
    /// glTF: this node has two parents or is its own ancestor.
    #[error("nodes[{0}] appears twice in the scene")]
    Twice(usize),
    /// glTF: a node transform with the wrong number of values.
    #[error("nodes[{node}].{key} must be {count} numbers")]
    NotNumbers {
        /// Index of the node.
        node: usize,
        /// Key of the transform.
        key: &'static str,
        /// Required number of values.
        count: usize,
    },
    /// glTF: this mesh has triangle strips or fans.
    #[error("meshes[{0}]: strips and fans of triangles are not read; export single triangles")]
    Strips(usize),
    /// glTF: a triangle with an invalid vertex index.
    #[error("meshes[{mesh}]: vertex {vertex} does not exist; it has {known}")]
    NoCorner {
        /// Index of the mesh.
        mesh: usize,
        /// Index of the vertex.
        vertex: usize,
        /// Number of vertices.
        known: usize,
    },
    /// glTF: this accessor is sparse.
    #[error("accessors[{0}] is sparse, which this program does not read")]
    Sparse(usize),
    /// glTF: an accessor with the wrong element or component type.
    #[error("accessors[{accessor}] is not of type {kind} with a component type of {components:?}")]
    Elements {
        /// Index of the accessor.
        accessor: usize,
        /// Required element type.
        kind: &'static str,
        /// Allowed component types, as glTF codes.
        components: &'static [u64],
    },
}
