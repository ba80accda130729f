//! glTF 2.0: the triangles of the default scene, placed by its nodes; materials, skins and animations are left aside.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use nalgebra::{Matrix4, Quaternion, UnitQuaternion, Vector3};
use serde_json::Value as Json;

use super::{Builder, Fault};

type Other<'o> = &'o dyn Fn(&str) -> Result<Vec<u8>, String>;

pub(super) fn read(bytes: &[u8], other: Other<'_>) -> Result<Builder, Fault> {
    let (text, binary) = if bytes.starts_with(b"glTF") {
        let (text, binary) = chunks(bytes)?;
        (text, Some(binary))
    } else {
        (bytes, None)
    };
    let json = serde_json::from_slice(text)
        .map_err(|why| Fault::somewhere(format!("no glTF file: {why}")))?;
    let mut file = File {
        json: &json,
        buffers: Vec::new(),
    };
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
        Some(other) => return Err(Fault::at(4, format!("version {other} of glTF; allowed 2"))),
        None => return Err(Fault::at(bytes.len(), "the file ends within its head")),
    }
    let chunk = |at: usize, kind: &[u8; 4]| {
        let named = bytes.get(at + 4..at + 8) == Some(kind);
        let name = || String::from_utf8_lossy(kind).replace('\0', "");
        let length = word(at).filter(|_| named);
        let length =
            length.ok_or_else(|| Fault::at(at, format!("expected the chunk {}", name())))?;
        let end = (at + 8).saturating_add(length);
        let why = || format!("the chunk {} ends beyond the file", name());
        bytes.get(at + 8..end).ok_or_else(|| Fault::at(at, why()))
    };
    let text = chunk(12, b"JSON")?;
    let next = 20 + text.len();
    // There need not be one.
    let binary = if next < bytes.len() {
        chunk(next, b"BIN\0")?
    } else {
        &[]
    };
    Ok((text, binary))
}

struct File<'f> {
    json: &'f Json,
    buffers: Vec<Vec<u8>>,
}

/// Numbers that lie in a buffer.
struct Accessor<'f> {
    bytes: &'f [u8],
    stride: usize,
    count: usize,
    component: u64,
}

impl<'f> File<'f> {
    fn build(&mut self, binary: Option<&[u8]>, other: Other<'_>) -> Result<Builder, String> {
        let version = self.json["asset"]["version"].as_str().unwrap_or_default();
        if !version.starts_with("2.") {
            return Err(format!(
                "asset.version is `{version}`; allowed 2.0 and above"
            ));
        }
        if let Some(needed) = self.list("extensionsRequired").first() {
            return Err(format!(
                "extensionsRequired: this program does not know {needed}; export the mesh without it"
            ));
        }
        for (i, buffer) in self.list("buffers").iter().enumerate() {
            let content = match (buffer["uri"].as_str(), binary) {
                (None, Some(binary)) if i == 0 => Ok(binary.to_vec()),
                (None, _) => Err("missing".to_owned()),
                (Some(uri), _) => match uri.strip_prefix("data:") {
                    Some(data) => data
                        .split_once(";base64,")
                        .and_then(|(_, data)| BASE64.decode(data).ok())
                        .ok_or_else(|| "holds no base64 data".to_owned()),
                    None => other(uri),
                },
            };
            let content = content.map_err(|why| format!("buffers[{i}].uri: {why}"))?;
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
                return Err(format!("nodes[{at}] is there twice in the scene"));
            }
            let placed = parent * matrix(node).map_err(|why| format!("nodes[{at}].{why}"))?;
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
    fn mesh(&self, at: usize, placed: &Matrix4<f64>, out: &mut Builder) -> Result<(), String> {
        /// Kinds of primitives: up to this one, points and lines.
        const LINES: u64 = 3;
        const TRIANGLES: u64 = 4;
        let mesh = self.item("meshes", at)?;
        // Mirrored triangles are seen from inside.
        let mirrored = placed.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
        for part in mesh["primitives"].as_array().into_iter().flatten() {
            match part.get("mode").map_or(Some(TRIANGLES), Json::as_u64) {
                Some(TRIANGLES) => {}
                Some(..=LINES) => continue,
                _ => {
                    return Err(format!(
                        "meshes[{at}]: strips and fans of triangles are not read; export single triangles"
                    ));
                }
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
                    found.ok_or_else(|| {
                        let (which, known) = (triangle[k], corners.len());
                        format!("meshes[{at}]: vertex {which} is none of its {known}")
                    })
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

    fn item(&self, list: &str, at: usize) -> Result<&'f Json, String> {
        let found = self.list(list).get(at);
        found.ok_or_else(|| format!("{list}[{at}]: there is none"))
    }

    fn accessor(&self, at: usize, components: &[u64], kind: &str) -> Result<Accessor<'_>, String> {
        let json = self.item("accessors", at)?;
        let wrong = |why: &str| format!("accessors[{at}] {why}");
        if json.get("sparse").is_some() {
            return Err(wrong("is sparse, which this program does not read"));
        }
        let component = json["componentType"].as_u64().unwrap_or(0);
        if json["type"] != kind || !components.contains(&component) {
            return Err(wrong(&format!(
                "is not of type {kind} with a component type of {components:?}"
            )));
        }
        let width = match component {
            5121 => 1,
            5123 => 2,
            _ => 4,
        };
        let size = width * if kind == "VEC3" { 3 } else { 1 };
        let count = size_of(json, "count").map_err(|why| wrong(&why))?;
        let view_at = index(&json["bufferView"], "accessors.bufferView")?;
        let view = self.item("bufferViews", view_at)?;
        let of_view =
            |name: &str| size_of(view, name).map_err(|why| format!("bufferViews[{view_at}] {why}"));
        let buffer = index(&view["buffer"], "bufferViews.buffer")?;
        let buffer = self
            .buffers
            .get(buffer)
            .ok_or_else(|| format!("buffers[{buffer}]: there is none"))?;
        let (start, length) = (of_view("byteOffset")?, of_view("byteLength")?);
        let end = start.checked_add(length);
        let bytes = end.and_then(|end| buffer.get(start..end));
        let bytes =
            bytes.ok_or_else(|| format!("bufferViews[{view_at}] ends beyond its buffer"))?;
        let stride = match of_view("byteStride")? {
            0 => size,
            stride => stride,
        };
        let offset = size_of(json, "byteOffset").map_err(|why| wrong(&why))?;
        let bytes = bytes.get(offset..).unwrap_or_default();
        // The last one need not be followed by a whole stride.
        let last = count
            .checked_sub(1)
            .map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(size));
        if last.is_none_or(|last| last > bytes.len()) {
            return Err(wrong("ends beyond its buffer view"));
        }
        Ok(Accessor {
            bytes,
            stride,
            count,
            component,
        })
    }
}

impl Accessor<'_> {
    /// Component `k` of element `i` of 32-bit floating-point numbers.
    fn number(&self, i: usize, k: usize) -> f64 {
        let bytes = self.bytes.get(i * self.stride + 4 * k..);
        let bytes = bytes.and_then(|bytes| bytes.first_chunk());
        f64::from(bytes.map_or(f32::NAN, |bytes| f32::from_le_bytes(*bytes)))
    }

    /// Element `i` of whole numbers.
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

/// An index into a list; `what` names it in errors.
fn index(json: &Json, what: &str) -> Result<usize, String> {
    let number = json
        .as_u64()
        .and_then(|number| usize::try_from(number).ok());
    number.ok_or_else(|| format!("{what} is {json}, must be a whole number"))
}

/// A number of bytes or elements, 0 if it is not given.
fn size_of(json: &Json, name: &str) -> Result<usize, String> {
    match json.get(name) {
        None => Ok(0),
        Some(number) => index(number, name),
    }
}

/// N numbers, if they are given.
fn numbers<const N: usize>(json: &Json, name: &str) -> Result<Option<[f64; N]>, String> {
    let Some(list) = json.get(name) else {
        return Ok(None);
    };
    let list = list.as_array().into_iter().flatten().map(Json::as_f64);
    let list = list
        .collect::<Option<Vec<f64>>>()
        .and_then(|list| list.try_into().ok());
    list.map(Some)
        .ok_or_else(|| format!("{name} must be {N} numbers"))
}

/// How a node places what hangs on it.
fn matrix(node: &Json) -> Result<Matrix4<f64>, String> {
    if let Some(columns) = numbers::<16>(node, "matrix")? {
        return Ok(Matrix4::from_column_slice(&columns));
    }
    let shift = Vector3::from(numbers(node, "translation")?.unwrap_or([0.0; 3]));
    let scale = Vector3::from(numbers(node, "scale")?.unwrap_or([1.0; 3]));
    let [x, y, z, w] = numbers(node, "rotation")?.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
    let linear = turn.to_homogeneous() * Matrix4::new_nonuniform_scaling(&scale);
    Ok(Matrix4::new_translation(&shift) * linear)
}
