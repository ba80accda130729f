//! Any bytes as a file with a mesh, of each format; the seeds are in tests/fuzz/meshes.
#![no_main]

use jointplay::mesh::MeshFormat;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    for format in [MeshFormat::Stl, MeshFormat::Obj, MeshFormat::Gltf] {
        // Each referenced buffer has the bytes of the file itself.
        match format.read(bytes, &|_| Ok(bytes.to_vec())) {
            Ok(mesh) => {
                let last = mesh.vertices().len() as u32;
                assert!(mesh.triangles().iter().flatten().all(|corner| *corner < last));
            }
            Err(fault) => assert!(fault.at.is_none_or(|at| at <= bytes.len())),
        }
    }
});
