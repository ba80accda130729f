//! Triangle meshes.

use nalgebra::Vector3;

/// A triangle mesh in the unit of its file. Coincident vertices are merged.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    vertices: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    open: Option<[u32; 2]>,
}

impl Mesh {
    /// Mesh of triangles, given as vertex indices. Triangles are reoriented so that those of a closed mesh face outwards.
    ///
    /// # Panics
    /// If a triangle refers to a vertex that does not exist.
    pub fn new(vertices: Vec<[f32; 3]>, triangles: Vec<[u32; 3]>) -> Self {
        let open = open_edge(&triangles);
        let mut mesh = Self { vertices, triangles, open };
        if mesh.volume_about(mesh.middle()) < 0.0 {
            mesh.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
        }
        mesh
    }

    /// Vertex positions.
    pub fn vertices(&self) -> &[[f32; 3]] {
        &self.vertices
    }

    /// Vertex indices of each triangle, counter-clockwise seen from outside.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Ends of an edge that is not traversed equally often in both directions, if there is one: the mesh is then not closed and
    /// has no volume.
    pub fn open_edge(&self) -> Option<[[f32; 3]; 2]> {
        self.open.map(|ends| ends.map(|i| self.vertices[i as usize]))
    }

    /// Minimum and maximum coordinates.
    pub fn bounds(&self) -> [[f32; 3]; 2] {
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        // A file may list vertices that no triangle uses.
        for corner in self.triangles.iter().flatten() {
            let vertex = self.vertices[*corner as usize];
            for i in 0..3 {
                low[i] = low[i].min(vertex[i]);
                high[i] = high[i].max(vertex[i]);
            }
        }
        [low, high]
    }

    /// Vertices, relative to `point`, of the tetrahedra that join it to each triangle. The signed volumes add up to that of a
    /// closed mesh.
    pub(crate) fn tetrahedra(&self, point: [f32; 3]) -> impl Iterator<Item = [Vector3<f64>; 3]> {
        let point = Vector3::from(point.map(f64::from));
        let corner = move |i: u32| Vector3::from(self.vertices[i as usize].map(f64::from)) - point;
        self.triangles.iter().map(move |triangle| triangle.map(corner))
    }

    /// Centre of the bounding box.
    pub fn middle(&self) -> [f32; 3] {
        let [low, high] = self.bounds();
        [0, 1, 2].map(|i| 0.5 * (low[i] + high[i]))
    }

    /// Sum of the signed volumes of the tetrahedra from `point`, in the cube of the file's unit.
    pub fn volume_about(&self, point: [f32; 3]) -> f64 {
        let six = |[a, b, c]: [Vector3<f64>; 3]| a.dot(&b.cross(&c));
        self.tetrahedra(point).map(six).sum::<f64>() / 6.0
    }
}

/// The first edge whose two directions do not cancel.
fn open_edge(triangles: &[[u32; 3]]) -> Option<[u32; 2]> {
    let mut edges = Vec::with_capacity(3 * triangles.len());
    for &[a, b, c] in triangles {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            edges.push(([from.min(to), from.max(to)], if from < to { 1 } else { -1 }));
        }
    }
    edges.sort_unstable();
    let sum = |group: &[([u32; 2], i32)]| group.iter().map(|(_, sign)| sign).sum::<i32>();
    let mut groups = edges.chunk_by(|a, b| a.0 == b.0);
    groups.find(|group| sum(group) != 0).map(|group| group[0].0)
}
