//! glTF 2.0 reader: triangles of the default scene, transformed by its nodes; materials, skins and animations are ignored.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use nalgebra::{Matrix4, Quaternion, UnitQuaternion, Vector3};
use serde_json::Value as Json;

use super::{Builder, Fault, MeshFault, Other};

pub(super) fn read(bytes: &[u8], other: Other<'_>) -> Result<Builder, Fault> {
    let (text, binary) = if bytes.starts_with(b"glTF") {
        let (text, binary) = chunks(bytes)?;
        (text, Some(binary))
    } else {
        (bytes, None)
    };
    let json = serde_json::from_slice(text).map_err(|why| Fault::somewhere(MeshFault::NotJson(why)))?;
    let mut file = File { json: &json, buffers: Vec::new() };
    file.build(binary, other).map_err(Fault::somewhere)
}

/// JSON and binary chunk of a `.glb` file.
fn chunks(bytes: &[u8]) -> Result<(&[u8], &[u8]), Fault> {
    let word = |at: usize| {
        let bytes = bytes.get(at..)?.first_chunk()?;
        Some(u32::from_le_bytes(*bytes) as usize)
    };
    match word(4) {
        Some(2) => {}
        Some(other) => return Err(Fault::at(4, MeshFault::Container(other))),
        None => return Err(Fault::at(bytes.len(), MeshFault::EndsWithin("its head"))),
    }
    let chunk = |at: usize, kind: &[u8; 4], name| {
        let named = bytes.get(at + 4..at + 8) == Some(kind);
        let length = word(at).filter(|_| named);
        let length = length.ok_or(Fault::at(at, MeshFault::Expected(name)))?;
        let end = (at + 8).saturating_add(length);
        let part = bytes.get(at + 8..end);
        part.ok_or(Fault::at(at, MeshFault::LongChunk(name)))
    };
    let text = chunk(12, b"JSON", "the chunk JSON")?;
    let next = 20 + text.len();
    // The binary chunk is optional.
    let binary = if next < bytes.len() { chunk(next, b"BIN\0", "the chunk BIN")? } else { &[] };
    Ok((text, binary))
}

struct File<'f> {
    json: &'f Json,
    buffers: Vec<Vec<u8>>,
}

/// Elements in a buffer.
struct Accessor<'f> {
    bytes: &'f [u8],
    stride: usize,
    count: usize,
    component: u64,
}

impl<'f> File<'f> {
    fn build(&mut self, binary: Option<&[u8]>, other: Other<'_>) -> Result<Builder, MeshFault> {
        let version = self.json["asset"]["version"].as_str().unwrap_or_default();
        if !version.starts_with("2.") {
            return Err(MeshFault::Version(version.to_owned()));
        }
        if let Some(needed) = self.list("extensionsRequired").first() {
            return Err(MeshFault::Extension(needed.to_string()));
        }
        for (i, buffer) in self.list("buffers").iter().enumerate() {
            let content = match (buffer["uri"].as_str(), binary) {
                (None, Some(binary)) if i == 0 => binary.to_vec(),
                (None, _) => return Err(MeshFault::NoUri(i)),
                (Some(uri), _) => match uri.strip_prefix("data:") {
                    Some(data) => data
                        .split_once(";base64,")
                        .and_then(|(_, data)| BASE64.decode(data).ok())
                        .ok_or(MeshFault::NotBase64(i))?,
                    None => other(uri).map_err(|why| MeshFault::Other { buffer: i, why })?,
                },
            };
            self.buffers.push(content);
        }
        let mut out = Builder::default();
        let scene = match self.json.get("scene") {
            Some(scene) => index(scene, "scene")?,
            None => 0,
        };
        let nodes = self.list("nodes");
        let mut seen = vec![false; nodes.len()];
        let mut open: Vec<(usize, Matrix4<f64>)> = Vec::new();
        let roots = self.item("scenes", scene)?;
        for root in roots["nodes"].as_array().into_iter().flatten() {
            open.push((index(root, "scenes.nodes")?, Matrix4::identity()));
        }
        while let Some((at, parent)) = open.pop() {
            let node = self.item("nodes", at)?;
            if std::mem::replace(&mut seen[at], true) {
                return Err(MeshFault::Twice(at));
            }
            let placed = parent * matrix(node, at)?;
            for child in node["children"].as_array().into_iter().flatten() {
                open.push((index(child, "nodes.children")?, placed));
            }
            if let Some(mesh) = node.get("mesh") {
                self.mesh(index(mesh, "nodes.mesh")?, &placed, &mut out)?;
            }
        }
        Ok(out)
    }

    /// Adds the triangles of a mesh.
    fn mesh(&self, at: usize, placed: &Matrix4<f64>, out: &mut Builder) -> Result<(), MeshFault> {
        /// Primitive modes up to this one are points and lines.
        const LINES: u64 = 3;
        const TRIANGLES: u64 = 4;
        let mesh = self.item("meshes", at)?;
        // A mirroring transform reverses the winding.
        let mirrored = placed.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
        for part in mesh["primitives"].as_array().into_iter().flatten() {
            match part.get("mode").map_or(Some(TRIANGLES), Json::as_u64) {
                Some(TRIANGLES) => {}
                Some(..=LINES) => continue,
                _ => return Err(MeshFault::Strips(at)),
            }
            let places = index(&part["attributes"]["POSITION"], "attributes.POSITION")?;
            let places = self.accessor(places, &[5126], "VEC3")?;
            let mut corners = Vec::new();
            for i in 0..places.count {
                let place = [0, 1, 2].map(|k| places.number(i, k));
                let place = placed.transform_point(&place.into());
                corners.push(out.vertex(place.into())?);
            }
            let order: Vec<usize> = match part.get("indices") {
                Some(indices) => {
                    let indices = index(indices, "indices")?;
                    let indices = self.accessor(indices, &[5121, 5123, 5125], "SCALAR")?;
                    (0..indices.count).map(|i| indices.whole(i)).collect()
                }
                None => (0..corners.len()).collect(),
            };
            for triangle in order.chunks_exact(3) {
                let corner = |k: usize| {
                    let found = corners.get(triangle[k]).copied();
                    found.ok_or_else(|| MeshFault::NoCorner { mesh: at, vertex: triangle[k], known: corners.len() })
                };
                let [a, b, c] = [corner(0)?, corner(1)?, corner(2)?];
                out.triangle(if mirrored { [a, c, b] } else { [a, b, c] })?;
            }
        }
        Ok(())
    }

    fn list(&self, name: &str) -> &'f [Json] {
        self.json[name].as_array().map_or(&[], Vec::as_slice)
    }

    fn item(&self, list: &'static str, at: usize) -> Result<&'f Json, MeshFault> {
        let found = self.list(list).get(at);
        found.ok_or(MeshFault::NoItem { list, at })
    }

    fn accessor(&self, at: usize, components: &'static [u64], kind: &'static str) -> Result<Accessor<'_>, MeshFault> {
        let json = self.item("accessors", at)?;
        if json.get("sparse").is_some() {
            return Err(MeshFault::Sparse(at));
        }
        let component = json["componentType"].as_u64().unwrap_or(0);
        if json["type"] != kind || !components.contains(&component) {
            return Err(MeshFault::Elements { accessor: at, kind, components });
        }
        let width = match component {
            5121 => 1,
            5123 => 2,
            _ => 4,
        };
        let size = width * if kind == "VEC3" { 3 } else { 1 };
        let count = size_of(json, "accessors", at, "count")?;
        let view_at = index(&json["bufferView"], "accessors.bufferView")?;
        let view = self.item("bufferViews", view_at)?;
        let of_view = |key| size_of(view, "bufferViews", view_at, key);
        let buffer = index(&view["buffer"], "bufferViews.buffer")?;
        let none = MeshFault::NoItem { list: "buffers", at: buffer };
        let buffer = self.buffers.get(buffer).ok_or(none)?;
        let (start, length) = (of_view("byteOffset")?, of_view("byteLength")?);
        let end = start.checked_add(length);
        let bytes = end.and_then(|end| buffer.get(start..end));
        let bytes = bytes.ok_or(MeshFault::Beyond { list: "bufferViews", at: view_at, whole: "buffer" })?;
        let stride = match of_view("byteStride")? {
            0 => size,
            stride => stride,
        };
        let offset = size_of(json, "accessors", at, "byteOffset")?;
        let bytes = bytes.get(offset..).unwrap_or_default();
        // The last element need not fill a whole stride.
        let last = count.checked_sub(1).map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(size));
        if last.is_none_or(|last| last > bytes.len()) {
            return Err(MeshFault::Beyond { list: "accessors", at, whole: "buffer view" });
        }
        Ok(Accessor { bytes, stride, count, component })
    }
}

impl Accessor<'_> {
    /// Component `k` of element `i`, stored as `f32`.
    fn number(&self, i: usize, k: usize) -> f64 {
        let bytes = self.bytes.get(i * self.stride + 4 * k..);
        let bytes = bytes.and_then(|bytes| bytes.first_chunk());
        f64::from(bytes.map_or(f32::NAN, |bytes| f32::from_le_bytes(*bytes)))
    }

    /// Element `i`, stored as an unsigned integer.
    fn whole(&self, i: usize) -> usize {
        let bytes = self.bytes.get(i * self.stride..).unwrap_or_default();
        let width = match self.component {
            5121 => 1,
            5123 => 2,
            _ => 4,
        };
        let bytes = bytes.iter().take(width).rev();
        bytes.fold(0, |number, byte| number << 8 | usize::from(*byte))
    }
}

fn whole(json: &Json) -> Option<usize> {
    usize::try_from(json.as_u64()?).ok()
}

/// An index into a list; `key` names it in errors.
fn index(json: &Json, key: &'static str) -> Result<usize, MeshFault> {
    whole(json).ok_or_else(|| MeshFault::NotIndex { key, json: json.to_string() })
}

/// A byte or element count in item `at` of `list`; 0 if absent.
fn size_of(item: &Json, list: &'static str, at: usize, key: &'static str) -> Result<usize, MeshFault> {
    let Some(json) = item.get(key) else {
        return Ok(0);
    };
    whole(json).ok_or_else(|| MeshFault::NotSize { list, at, key, json: json.to_string() })
}

/// N numbers under `key` of node `at`, if present.
fn numbers<const N: usize>(node: &Json, at: usize, key: &'static str) -> Result<Option<[f64; N]>, MeshFault> {
    let Some(list) = node.get(key) else {
        return Ok(None);
    };
    let list = list.as_array().into_iter().flatten().map(Json::as_f64);
    let list = list.collect::<Option<Vec<f64>>>().and_then(|list| list.try_into().ok());
    list.map(Some).ok_or(MeshFault::NotNumbers { node: at, key, count: N })
}

/// Local transform of node `at`.
fn matrix(node: &Json, at: usize) -> Result<Matrix4<f64>, MeshFault> {
    if let Some(columns) = numbers::<16>(node, at, "matrix")? {
        return Ok(Matrix4::from_column_slice(&columns));
    }
    let shift = Vector3::from(numbers(node, at, "translation")?.unwrap_or([0.0; 3]));
    let scale = Vector3::from(numbers(node, at, "scale")?.unwrap_or([1.0; 3]));
    let [x, y, z, w] = numbers(node, at, "rotation")?.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
    let linear = turn.to_homogeneous() * Matrix4::new_nonuniform_scaling(&scale);
    Ok(Matrix4::new_translation(&shift) * linear)
}
