//! Readers of triangle meshes: STL, OBJ, glTF. Errors give the byte offset in the file.
//!
//! The readers are our own, a few dozen lines each: `stl_io` and `tobj` name no line in errors, `gltf` panics on inconsistent
//! accessors, and their features beyond triangles would bloat the web page.

mod builder;
mod fault;
mod gltf;
mod obj;
mod stl;

use std::path::Path;

use builder::Builder;
pub use builder::MAX_TRIANGLES;
use fault::NoFile;
pub use fault::{Fault, MeshFault};
pub use jointplay_physics::machine::Mesh;

/// Reads a referenced file.
type Other<'o> = &'o dyn Fn(&str) -> Result<Vec<u8>, NoFile>;

/// Mesh file formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    /// STL, text or binary.
    Stl,
    /// OBJ, faces only.
    Obj,
    /// glTF, `.gltf` or `.glb`.
    Gltf,
}

impl MeshFormat {
    /// Supported file name extensions.
    pub(crate) const ENDINGS: &'static str = ".stl, .obj, .gltf, .glb";

    /// The format of a file, by its extension.
    pub fn of(name: &str) -> Option<Self> {
        let ending = Path::new(name).extension()?.to_str()?;
        Some(match ending.to_ascii_lowercase().as_str() {
            "stl" => Self::Stl,
            "obj" => Self::Obj,
            "gltf" | "glb" => Self::Gltf,
            _ => return None,
        })
    }

    /// Length unit, m, if the format defines one.
    pub fn unit(self) -> Option<f64> {
        (self == Self::Gltf).then_some(1.0)
    }

    /// Parses the content of a mesh file; `other` reads the files it references.
    ///
    /// # Errors
    /// An invalid or unsupported file.
    pub fn read(self, bytes: &[u8], other: Other<'_>) -> Result<Mesh, Fault> {
        let mesh = match self {
            Self::Stl => stl::read(bytes)?,
            Self::Obj => obj::read(bytes)?,
            Self::Gltf => gltf::read(bytes, other)?,
        };
        mesh.finish().map_err(Fault::somewhere)
    }
}

/// The file as text.
fn text(bytes: &[u8]) -> Result<&str, Fault> {
    std::str::from_utf8(bytes).map_err(|fault| Fault::at(fault.valid_up_to(), MeshFault::NotText))
}

/// Parses a coordinate.
fn coordinate(text: &str, word: &str) -> Result<f64, Fault> {
    let number = word.parse::<f64>().ok();
    number.ok_or_else(|| Fault::at(offset(text, word), MeshFault::NotNumber))
}

/// Byte offset of `word`, a slice of `text`.
fn offset(text: &str, word: &str) -> usize {
    word.as_ptr() as usize - text.as_ptr() as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use jointplay_physics::machine::{Geometry, Quat, Solid, Vec3};
    use proptest::prelude::*;
    use std::f64::consts::PI;
    use std::fmt::Write as _;

    fn alone(_: &str) -> Result<Vec<u8>, NoFile> {
        Err("there is no other file".into())
    }

    fn read(format: MeshFormat, bytes: &[u8]) -> Result<Mesh, Fault> {
        format.read(bytes, &alone)
    }

    /// Vertices and outward triangles of a box of 1 x 2 x 3 centred at (10, 0, 0).
    fn box_of_triangles() -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
        let side = |i: u32, bit: u32| if i >> bit & 1 == 1 { 0.5 } else { -0.5 };
        let corner = |i| [10.0 + side(i, 0), 2.0 * side(i, 1), 3.0 * side(i, 2)];
        let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let halves = quads.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
        ((0..8).map(corner).collect(), halves.collect())
    }

    fn binary_stl() -> Vec<u8> {
        let (corners, triangles) = box_of_triangles();
        let mut out = vec![b's'; 80];
        out.extend((triangles.len() as u32).to_le_bytes());
        for triangle in triangles {
            out.extend([0; 12]);
            for corner in triangle {
                out.extend(corners[corner as usize].iter().flat_map(|x| x.to_le_bytes()));
            }
            out.extend([0; 2]);
        }
        out
    }

    fn text_stl() -> String {
        let (corners, triangles) = box_of_triangles();
        let mut out = "solid a box\n".to_owned();
        for triangle in triangles {
            out += " facet normal 0 0 0\n  outer loop\n";
            for corner in triangle {
                let [x, y, z] = corners[corner as usize];
                writeln!(out, "   vertex {x} {y:e} {z}").unwrap();
            }
            out += "  endloop\n endfacet\n";
        }
        out + "endsolid a box\n"
    }

    fn obj() -> String {
        let (corners, triangles) = box_of_triangles();
        let mut out = "# a box\no box\n".to_owned();
        for [x, y, z] in corners {
            writeln!(out, "v {x} {y} {z}").unwrap();
        }
        // Quadrilateral faces with relative vertex indices.
        for pair in triangles.chunks(2) {
            let [a, b, c, d] = [pair[0][0], pair[0][1], pair[0][2], pair[1][2]];
            let [a, b, c, d] = [a, b, c, d].map(|i| i as i32 - 8);
            writeln!(out, "f {a}//1 {b}//1 {c}//1 {d}//1 # a side").unwrap();
        }
        out
    }

    /// The box as glTF: its nodes rotate, scale and translate the mesh back into place.
    fn gltf_parts() -> (serde_json::Value, Vec<u8>) {
        let (corners, triangles) = box_of_triangles();
        let mut bytes = Vec::new();
        for [x, y, z] in corners {
            // A quarter turn about z takes (y, -x, z) to (x, y, z).
            let turned = [y, -(x - 10.0), z].map(|x| x / 2.0);
            bytes.extend(turned.iter().flat_map(|x| x.to_le_bytes()));
        }
        let indices = triangles.iter().flatten();
        bytes.extend(indices.flat_map(|i| (*i as u16).to_le_bytes()));
        let half = 0.5_f64.sqrt();
        let json = serde_json::json!({
            "asset": { "version": "2.0" },
            "scene": 0,
            "scenes": [{ "nodes": [0] }],
            "nodes": [
                { "children": [1], "translation": [10, 0, 0] },
                { "mesh": 0, "rotation": [0, 0, half, half], "scale": [2, 2, 2] },
            ],
            "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1 }] }],
            "accessors": [
                { "bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3" },
                { "bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR" },
            ],
            "bufferViews": [
                { "buffer": 0, "byteLength": 96 },
                { "buffer": 0, "byteOffset": 96, "byteLength": 72 },
            ],
            "buffers": [{ "byteLength": 168 }],
        });
        (json, bytes)
    }

    fn glb() -> Vec<u8> {
        let (json, buffer) = gltf_parts();
        let mut text = json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut out = b"glTF".to_vec();
        let length = 12 + 8 + text.len() + 8 + buffer.len();
        out.extend(2_u32.to_le_bytes());
        out.extend((length as u32).to_le_bytes());
        for (kind, chunk) in [(b"JSON", text), (b"BIN\0", buffer)] {
            out.extend((chunk.len() as u32).to_le_bytes());
            out.extend(kind);
            out.extend(chunk);
        }
        out
    }

    fn gltf_with(uri: &str) -> Vec<u8> {
        let (mut json, _) = gltf_parts();
        json["buffers"][0]["uri"] = uri.into();
        json.to_string().into_bytes()
    }

    fn gltf_alone() -> Vec<u8> {
        use base64::Engine as _;
        let data = base64::engine::general_purpose::STANDARD.encode(gltf_parts().1);
        gltf_with(&format!("data:application/octet-stream;base64,{data}"))
    }

    #[test]
    fn every_format_gives_the_same_box() {
        let (corners, triangles) = box_of_triangles();
        let files = [
            (MeshFormat::Stl, binary_stl()),
            (MeshFormat::Stl, text_stl().into_bytes()),
            (MeshFormat::Stl, text_stl().replace('\n', "\r\n").to_uppercase().into_bytes()),
            (MeshFormat::Obj, obj().into_bytes()),
            (MeshFormat::Gltf, glb()),
            (MeshFormat::Gltf, gltf_alone()),
        ];
        for (format, bytes) in files {
            let mesh = read(format, &bytes).unwrap();
            assert_eq!(mesh.open_edge(), None, "{format:?}");
            let place = |i: u32| mesh.vertices()[i as usize];
            let found = mesh.triangles().iter().map(|t| t.map(place));
            let wanted = triangles.iter().map(|t| t.map(|i| corners[i as usize]));
            for (found, wanted) in found.zip(wanted) {
                for (found, wanted) in found.iter().flatten().zip(wanted.iter().flatten()) {
                    assert!((found - wanted).abs() < 2e-6, "{format:?}: {found} {wanted}");
                }
            }
            assert_eq!((mesh.vertices().len(), mesh.triangles().len()), (8, 12));
        }
    }

    #[test]
    fn the_seeds_of_the_fuzz_target_are_read() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/fuzz/meshes");
        let mut count = 0;
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let format = MeshFormat::of(path.to_str().unwrap()).unwrap();
            let mesh = read(format, &std::fs::read(&path).unwrap()).unwrap();
            assert_eq!(mesh.open_edge(), None, "{}", path.display());
            count += 1;
        }
        assert_eq!(count, 5);
    }

    #[test]
    fn a_gltf_file_finds_its_buffer_beside_it() {
        let other = |name: &str| match name {
            "box.bin" => Ok(gltf_parts().1),
            _ => Err("no such file".into()),
        };
        assert!(MeshFormat::Gltf.read(&gltf_with("box.bin"), &other).is_ok());
        let fault = MeshFormat::Gltf.read(&gltf_with("bin"), &other).unwrap_err();
        assert_eq!(fault.why.to_string(), "buffers[0].uri: no such file");
    }

    #[test]
    fn a_mesh_inside_out_is_turned() {
        let text = text_stl();
        let mut lines: Vec<&str> = text.lines().collect();
        for i in 0..lines.len() {
            if lines[i].contains("outer loop") {
                lines.swap(i + 1, i + 2);
            }
        }
        let back = lines.join("\n");
        let [there, back] = [&text, &back].map(|text| read(MeshFormat::Stl, text.as_bytes()).unwrap());
        let volume = there.volume_about([0.0; 3]);
        assert!((volume - 6.0).abs() < 1e-5, "{volume}");
        assert!((volume - back.volume_about([0.0; 3])).abs() < 1e-5);
    }

    #[test]
    fn a_hole_is_found() {
        let whole = text_stl();
        let holed = whole.replacen("   vertex 10.5", "   vertex 10.6", 1);
        let mesh = read(MeshFormat::Stl, holed.as_bytes()).unwrap();
        let [from, to] = mesh.open_edge().expect("an open edge");
        assert!(from != to);
    }

    #[test]
    fn errors_state_their_cause_and_offset() {
        let at = |text: &str, part: &str| text.find(part);
        let check = |format, text: &str, place: Option<usize>, why: &str| {
            let fault = read(format, text.as_bytes()).unwrap_err();
            let found = fault.why.to_string();
            assert!(found.contains(why), "{fault:?}, wanted {why}");
            assert_eq!(fault.at, place, "{fault:?}");
        };
        let good = text_stl();
        let bad = good.replacen("vertex 9.5", "vertex 9.5mm", 1);
        check(MeshFormat::Stl, &bad, at(&bad, "9.5mm"), "not a number");
        let bad = good.replacen("  endloop", "", 1);
        check(MeshFormat::Stl, &bad, at(&bad, " endfacet").map(|i| i + 1), "endloop");
        let bad = &good[..good.len() - 16];
        check(MeshFormat::Stl, bad, Some(bad.len()), "ends within");
        check(MeshFormat::Stl, "", Some(0), "empty");
        check(MeshFormat::Stl, "PK", Some(0), "neither");
        let mut short = binary_stl();
        short.truncate(200);
        let fault = read(MeshFormat::Stl, &short).unwrap_err();
        assert_eq!(fault.at, Some(80));
        let why = fault.why.to_string();
        assert!(why.contains("12 triangles") && why.contains("684 bytes"));
        let good = obj();
        let bad = format!("{good}f 1 2 9\n");
        check(MeshFormat::Obj, &bad, bad.rfind('9'), "8 vertices");
        let bad = format!("{good}f 1 2\n");
        check(MeshFormat::Obj, &bad, bad.rfind('f'), "at least 3");
        check(MeshFormat::Obj, "v 1 2\n", Some(0), "three");
        check(MeshFormat::Obj, "v 1 2 1e300\n", Some(0), "out of range");
        check(MeshFormat::Obj, "hello\n", None, "no triangles");
        let fault = read(MeshFormat::Gltf, b"{ \"asset\": ").unwrap_err();
        assert!(fault.why.to_string().contains("line 1"), "{fault:?}");
        let gltf = |change: fn(&mut serde_json::Value)| {
            use base64::Engine as _;
            let (mut json, buffer) = gltf_parts();
            let data = base64::engine::general_purpose::STANDARD.encode(buffer);
            json["buffers"][0]["uri"] = format!("data:;base64,{data}").into();
            change(&mut json);
            let fault = read(MeshFormat::Gltf, json.to_string().as_bytes()).unwrap_err();
            fault.why.to_string()
        };
        let why = gltf(|json| json["accessors"][0]["count"] = 9.into());
        assert!(why.contains("accessors[0]"), "{why}");
        let why = gltf(|json| json["bufferViews"][1]["byteLength"] = u64::MAX.into());
        assert!(why.contains("bufferViews[1]"), "{why}");
        let why = gltf(|json| json["nodes"][1]["children"] = [0].into());
        assert!(why.contains("nodes[0]") && why.contains("twice"), "{why}");
        let why = gltf(|json| json["extensionsRequired"] = ["KHR_draco_mesh_compression"].into());
        assert!(why.contains("KHR_draco"), "{why}");
        let why = gltf(|json| json["asset"]["version"] = "1.0".into());
        assert!(why.contains("version"), "{why}");
    }

    #[test]
    fn more_triangles_than_allowed_are_refused() {
        let mut bytes = vec![0; 84 + 50 * (MAX_TRIANGLES + 1)];
        for (i, triangle) in bytes[84..].chunks_exact_mut(50).enumerate() {
            for (k, place) in triangle[12..48].chunks_exact_mut(4).enumerate() {
                let x = if k % 4 == 0 { i as f32 } else { 0.0 };
                place.copy_from_slice(&x.to_le_bytes());
            }
        }
        bytes[80..84].copy_from_slice(&(MAX_TRIANGLES as u32 + 1).to_le_bytes());
        let fault = read(MeshFormat::Stl, &bytes).unwrap_err();
        assert!(fault.why.to_string().contains("200000"), "{fault:?}");
    }

    proptest! {
        /// No bytes make a reader panic, and a fault lies within the file.
        #[test]
        fn damaged_files_are_read_or_refused(
            which in 0_usize..6,
            changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0_u8..4), 1..12),
        ) {
            let (format, mut bytes) = match which {
                0 => (MeshFormat::Stl, binary_stl()),
                1 => (MeshFormat::Stl, text_stl().into_bytes()),
                2 => (MeshFormat::Obj, obj().into_bytes()),
                3 => (MeshFormat::Gltf, glb()),
                4 => (MeshFormat::Gltf, gltf_alone()),
                _ => (MeshFormat::Gltf, gltf_with("box.bin")),
            };
            for (place, byte, how) in changes {
                if bytes.is_empty() {
                    break;
                }
                let i = place.index(bytes.len());
                match how {
                    0 => bytes[i] = byte,
                    1 => bytes.insert(i, byte),
                    2 => drop(bytes.remove(i)),
                    // Another digit keeps the file readable further on.
                    _ if bytes[i].is_ascii_digit() => bytes[i] = b'0' + byte % 10,
                    _ => bytes.truncate(i + bytes.len() / 2),
                }
            }
            let other = |_: &str| Ok(gltf_parts().1);
            match format.read(&bytes, &other) {
                Ok(mesh) => {
                    let last = mesh.vertices().len() as u32;
                    prop_assert!(mesh.triangles().iter().flatten().all(|i| *i < last));
                    prop_assert!(mesh.vertices().iter().flatten().all(|x| x.is_finite()));
                }
                Err(fault) => {
                    prop_assert!(!fault.why.to_string().is_empty());
                    prop_assert!(fault.at.is_none_or(|at| at <= bytes.len()), "{fault:?}");
                }
            }
        }
    }

    /// A shape from the OBJ file `text`, in millimetres, rotated and shifted.
    fn of_file(text: &str) -> Geometry {
        let alone = |_: &str| Err(String::new().into());
        let mesh = MeshFormat::Obj.read(text.as_bytes(), &alone).unwrap();
        assert_eq!(mesh.open_edge(), None);
        Geometry::Mesh {
            mesh: mesh.into(),
            unit: 1e-3,
            position: Vec3::new(0.1, -0.2, 0.3),
            rotation: Quat::from_euler_angles(0.4, -0.7, 1.1),
        }
    }

    /// Relative errors of volume and inertia against those of the form, and distance of the centroid from `position`, m.
    fn errors_against(mesh: &Geometry, form: &Geometry) -> [f64; 3] {
        let Geometry::Mesh { position, rotation, .. } = mesh else { panic!("a mesh") };
        let (computed, expected) = (Solid::of(mesh), Solid::of(form));
        let turn = rotation.to_rotation_matrix().into_inner();
        let inertia = turn * expected.inertia() * turn.transpose();
        [
            (computed.volume / expected.volume - 1.0).abs(),
            (computed.centre - position).norm(),
            (computed.inertia() - inertia).amax() / inertia.amax(),
        ]
    }

    #[test]
    fn a_mesh_of_a_box_has_the_mass_properties_of_the_box() {
        let mut text = String::new();
        for i in 0..8 {
            let side = |bit: i32, size: f64| if i >> bit & 1 == 1 { size } else { -size };
            text += &format!("v {} {} {}\n", side(0, 10.0), side(1, 20.0), side(2, 35.0));
        }
        text += "f 1 5 7 3\nf 2 4 8 6\nf 1 2 6 5\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\n";
        let size = Vec3::new(0.02, 0.04, 0.07);
        let centre = Vec3::zeros();
        let [volume, centroid, inertia] = errors_against(&of_file(&text), &Geometry::Box { centre, size });
        assert!(volume < 1e-12 && centroid < 1e-12 && inertia < 1e-12);
    }

    #[test]
    fn a_mesh_of_a_ball_has_nearly_the_mass_properties_of_the_ball() {
        let centre = Vec3::zeros();
        let ball = Geometry::Sphere { centre, radius: 0.05 };
        let errors = [40_usize, 80].map(|n| {
            let mut text = format!("v 0 0 {}\nv 0 0 {}\n", 50.0, -50.0);
            for i in 1..n {
                for k in 0..2 * n {
                    let (theta, phi) = (PI * i as f64 / n as f64, PI * k as f64 / n as f64);
                    let (across, z) = (50.0 * libm::sin(theta), 50.0 * libm::cos(theta));
                    let (x, y) = (across * libm::cos(phi), across * libm::sin(phi));
                    text += &format!("v {x} {y} {z}\n");
                }
            }
            let at = |i: usize, k: usize| 3 + (i - 1) * 2 * n + k % (2 * n);
            for k in 0..2 * n {
                text += &format!("f 1 {} {}\n", at(1, k), at(1, k + 1));
                text += &format!("f 2 {} {}\n", at(n - 1, k + 1), at(n - 1, k));
                for i in 1..n - 1 {
                    let [a, b, c, d] = [at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)];
                    text += &format!("f {a} {b} {c} {d}\n");
                }
            }
            errors_against(&of_file(&text), &ball)
        });
        // The polyhedron is inscribed in the ball; its error falls with the square of the edge length.
        assert!(errors[1][0] < 2e-3 && errors[1][1] < 1e-8 && errors[1][2] < 3e-3, "{errors:?}");
        for i in [0, 2] {
            let order = errors[0][i] / errors[1][i];
            assert!((order - 4.0).abs() < 0.05, "{order}");
        }
    }
}
