//! Shapes from mesh files, roles and colours.

use std::collections::BTreeMap;
use std::fs;

use jointplay::machine::{Geometry, Role};
use jointplay::scene::{MAX_MESH_SIZE, Scene, file_bytes};

/// A body with the single shape `shape` and further keys.
fn scene(shape: &str, keys: &str) -> String {
    format!(
        "[[body]]\nname = \"arm\"\n{keys}\nshapes = [{{ {shape} }}]\n\n\
         [[joint]]\nname = \"hinge\"\nkind = \"revolute\"\nchild = \"arm\"\naxis = [0, 1, 0]\n"
    )
}

const WITH_DENSITY: &str = "density = \"2 g/cm^3\"";
const WITH_MASS: &str = "mass = \"1 kg\"\ninertia = \"1e-3 1e-3 1e-3 kg m^2\"";
const OBJ: &str = "form = \"mesh\", file = \"arm.obj\", unit = \"mm\"";

/// A box of 10 x 20 x 30 mm with a corner at the origin, as OBJ; without the last face it is open.
const BOX: &str = "v 0 0 0\nv 10 0 0\nv 0 20 0\nv 10 20 0\nv 0 0 30\nv 10 0 30\nv 0 20 30\nv 10 20 30\n\
                   f 1 5 7 3\nf 2 4 8 6\nf 1 2 6 5\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\n";

/// A binary STL file of one triangle without its last `missing` bytes.
fn stl(missing: usize) -> Vec<u8> {
    let mut bytes = vec![b's'; 80];
    bytes.extend(1_u32.to_le_bytes());
    let numbers = [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    bytes.extend(numbers.iter().flat_map(|x: &f32| x.to_le_bytes()));
    bytes.extend([0; 2]);
    bytes.truncate(bytes.len() - missing);
    bytes
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn with_files(files: &[(&str, &[u8])]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        for (name, content) in files {
            fs::write(folder.path().join(name), content).unwrap();
        }
        Self(folder)
    }

    fn read(&self, text: &str) -> Result<Scene, String> {
        let read = Scene::parse_given(text, Some("scene.toml"), &BTreeMap::new(), Some(self.0.path()), &[]);
        read.map_err(|error| error.to_string())
    }
}

#[test]
fn the_mass_of_a_body_follows_from_the_volume_of_its_mesh() {
    let folder = Folder::with_files(&[("arm.obj", BOX.as_bytes())]);
    let place = format!("{OBJ}, position = \"0 5 0 mm\", rotation = {{ axis = [0, 0, 1], angle = \"90 deg\" }}");
    let scene = folder.read(&scene(&place, WITH_DENSITY)).unwrap();
    let body = &scene.machine.bodies[0];
    assert!((body.mass - 0.012).abs() < 1e-12, "{}", body.mass);
    let centre = jointplay::machine::Vec3::new(-0.01, 0.01, 0.015);
    assert!((body.centre - centre).norm() < 1e-12, "{}", body.centre);
    let (x, y, z) = (20e-3_f64, 10e-3_f64, 30e-3_f64);
    let about = [y * y + z * z, x * x + z * z, x * x + y * y].map(|sum| 0.012 * sum / 12.0);
    for (i, expected) in about.into_iter().enumerate() {
        assert!((body.inertia[(i, i)] / expected - 1.0).abs() < 1e-9);
    }
}

#[test]
fn a_mesh_of_implausible_size_raises_a_warning_with_a_better_unit() {
    let metres = BOX.replace("10", "0.01").replace("20", "0.02").replace("30", "0.03");
    let folder = Folder::with_files(&[("arm.obj", BOX.as_bytes()), ("metres.obj", metres.as_bytes())]);
    // A wheel on its hinge with an arm of 0.4 m.
    let machine = "child_point = [0, 0, 0]\n\n[[body]]\nname = \"long\"\nmass = \"1 kg\"\ninertia = \"1e-6 1e-6 1e-6 kg m^2\"\n\n\
                   [[joint]]\nname = \"end\"\nkind = \"revolute\"\nchild = \"long\"\nparent = \"arm\"\naxis = [0, 1, 0]\n\
                   child_point = \"400 0 0 mm\"\n";
    let joint_point = "child_point = \"0 0 30 mm\"\n";
    for (file, unit, keys, rest, better) in [
        ("arm.obj", "m", WITH_DENSITY, joint_point, Some("unit = \"mm\" would make it 37.4 mm")),
        ("arm.obj", "m", WITH_MASS, "", Some("the rest of the machine 38.7 mm; unit = \"mm\"")),
        (
            "arm.obj",
            "m",
            WITH_DENSITY,
            machine,
            Some("with the unit 1 m this mesh reaches 37.4 m, the rest of the machine 400 mm"),
        ),
        ("metres.obj", "mm", WITH_DENSITY, joint_point, Some("unit = \"m\" would make it 37.4 mm")),
        ("metres.obj", "mm", WITH_MASS, "", Some("reaches 0.0374 mm, the rest of the machine 38.7 mm; unit = \"m\"")),
        ("metres.obj", "mm", WITH_DENSITY, machine, Some("unit = \"m\"")),
        // There is nothing to compare with, or the size is plausible: a part may be small and may extend beyond its joint points.
        ("arm.obj", "m", WITH_DENSITY, "", None),
        ("metres.obj", "mm", WITH_DENSITY, "", None),
        ("arm.obj", "mm", WITH_DENSITY, joint_point, None),
        ("arm.obj", "mm", WITH_MASS, "", None),
        ("arm.obj", "mm", WITH_DENSITY, machine, None),
        ("metres.obj", "m", WITH_DENSITY, "child_point = \"0 0 2 mm\"\n", None),
        ("arm.obj", "25.4 mm", WITH_DENSITY, machine, None),
    ] {
        let shape = format!("form = \"mesh\", file = \"{file}\", unit = \"{unit}\"");
        let read = folder.read(&(scene(&shape, keys) + rest)).unwrap();
        let warnings: Vec<String> = read.machine.warnings().iter().map(ToString::to_string).collect();
        match better {
            None => assert_eq!(warnings, [""; 0], "{file} {unit} {keys} {rest}"),
            Some(better) => {
                let is_expected =
                    |w: &String| w.starts_with("body.arm.shapes[0]: with the unit 1 m") && w.contains(better);
                assert!(warnings.len() == 1 && is_expected(&warnings[0]), "{file} {unit} {keys} {rest}: {warnings:?}");
            }
        }
    }
    let two = format!("{OBJ} }}, {{ {OBJ}").replace("\"mm\"", "\"m\"");
    let warnings = folder.read(&scene(&two, WITH_MASS)).unwrap().machine.warnings();
    assert!(warnings[0].to_string().contains(" (and 1 more): with the unit 1 m"), "{warnings:?}");
}

#[test]
fn a_mesh_is_read_once() {
    let bytes = stl(0);
    let folder = Folder::with_files(&[("arm.stl", &bytes)]);
    let shape = "form = \"mesh\", file = \"arm.stl\", unit = \"mm\"";
    let first = folder.read(&scene(shape, WITH_MASS)).unwrap();
    assert_eq!(*file_bytes(&first.source.beside["arm.stl"]), bytes);
    // The stored content is used even after the file is deleted.
    drop(folder);
    let source = &first.source;
    let reread = Scene::parse_with(&source.text, Some("scene.toml"), &source.beside, &[]).unwrap();
    assert_eq!(reread.machine.bodies, first.machine.bodies);
    assert_eq!(first.to_toml().unwrap(), *source.text);
    let Geometry::Mesh { mesh, unit, .. } = &reread.machine.bodies[0].shapes[0].geometry else {
        panic!("a mesh");
    };
    assert_eq!((mesh.triangles().len(), *unit), (1, 1e-3));
}

#[test]
fn shapes_of_one_file_share_its_triangles() {
    let folder = Folder::with_files(&[("arm.obj", BOX.as_bytes())]);
    let shapes = format!("{OBJ} }}, {{ {OBJ}, position = \"1 0 0 m\"");
    let scene = folder.read(&scene(&shapes, WITH_MASS)).unwrap();
    let meshes: Vec<_> = scene.machine.bodies[0].shapes.iter().map(|shape| &shape.geometry).collect();
    let [Geometry::Mesh { mesh: a, .. }, Geometry::Mesh { mesh: b, .. }] = meshes[..] else {
        panic!("two meshes");
    };
    assert!(std::sync::Arc::ptr_eq(a, b));
}

#[test]
fn a_fixed_mesh_follows_a_pattern() {
    let folder = Folder::with_files(&[("arm.obj", BOX.as_bytes())]);
    let text = format!(
        "{}\n[[pattern]]\nname = \"ring\"\ncount = 2\nabout = {{ axis = [0, 0, 1] }}\n\n\
         [[pattern.fixed_shape]]\nform = \"mesh\"\nfile = \"arm.obj\"\nunit = \"1 cm\"\nposition = \"2 0 0 m\"\n",
        scene(OBJ, WITH_MASS)
    );
    let scene = folder.read(&text).unwrap();
    let Geometry::Mesh { position, rotation, unit, .. } = scene.machine.fixed_shapes[1].geometry else {
        panic!("a mesh");
    };
    assert!((position.x + 2.0).abs() < 1e-12 && (rotation.angle() - std::f64::consts::PI).abs() < 1e-12);
    assert_eq!(unit, 0.01);
}

#[test]
fn errors_in_a_mesh_are_reported_with_their_position() {
    let bad = BOX.replace("v 10 20 30", "v 10 2O 30");
    let open = BOX.replace("f 5 6 8 7\n", "");
    let cut = stl(7);
    let large = vec![b'#'; MAX_MESH_SIZE as usize + 1];
    let folder = Folder::with_files(&[
        ("arm.obj", BOX.as_bytes()),
        ("bad.obj", bad.as_bytes()),
        ("open.obj", open.as_bytes()),
        ("cut.stl", &cut),
        ("large.obj", &large),
        ("arm.gltf", b"{\n \"asset\": }"),
    ]);
    let mesh = |file: &str, more: &str| format!("form = \"mesh\", file = \"{file}\"{more}");
    let mm = ", unit = \"mm\"";
    for (shape, keys, fragments) in [
        (mesh("bad.obj", mm), WITH_MASS, &["bad.obj:8:6: is not a number", "v 10 2O 30"][..]),
        (mesh("cut.stl", mm), WITH_MASS, &["cut.stl: byte 80: ", "has 134 bytes, this file has 127"]),
        (mesh("arm.gltf", ""), WITH_MASS, &["arm.gltf: not a glTF file: ", "line 2 column"]),
        (mesh("large.obj", mm), WITH_MASS, &["shapes[0].file", "at most 8 MiB in all meshes"]),
        (mesh("arm.obj", ""), WITH_MASS, &["shapes[0].unit: missing", "unit = \"1 mm\""]),
        (mesh("arm.obj", ", unit = \"kg\""), WITH_MASS, &["shapes[0].unit", "mm"]),
        (mesh("arm.obj", ", unit = \"50 m\""), WITH_MASS, &["reaches 1500 m far", "up to 1000 m"]),
        (mesh("arm.step", mm), WITH_MASS, &["shapes[0].file", ".stl, .obj, .gltf, .glb"]),
        (mesh("none.obj", mm), WITH_MASS, &["shapes[0].file", "cannot read this file"]),
        (mesh("../arm.obj", mm), WITH_MASS, &["shapes[0].file", "without `..`"]),
        (mesh("arm.obj", ", unit = \"mm\", size = \"1 1 1 mm\""), WITH_MASS, &["a mesh has file, unit"]),
        (mesh("open.obj", mm), WITH_DENSITY, &["body.arm.shapes[0]", "not closed", "(0, 0, 30)", "`mass`"]),
    ] {
        let error = folder.read(&scene(&shape, keys)).unwrap_err();
        for part in fragments {
            assert!(error.contains(part), "{error}\nlacks {part}");
        }
    }
    // An open mesh is accepted where the mass is given.
    assert!(folder.read(&scene(&mesh("open.obj", mm), WITH_MASS)).is_ok());
    let nowhere = Scene::parse(&scene(OBJ, WITH_MASS), None, &[]).unwrap_err();
    assert!(nowhere.to_string().contains("no folder"), "{nowhere}");
}

#[test]
fn colours_are_read_and_refused() {
    let sphere = |colour: &str| {
        let shape = format!("form = \"sphere\", centre = [0, 0, 0], radius = \"1 mm\", colour = \"{colour}\"");
        Scene::parse(&scene(&shape, WITH_MASS), None, &[])
    };
    let read = sphere("#C2255c").unwrap();
    assert_eq!(read.machine.bodies[0].shapes[0].colour, Some([0xc2, 0x25, 0x5c]));
    for bad in ["red", "#12345", "#1234567", "#+12345", "#é2345", "123456", ""] {
        let error = sphere(bad).unwrap_err().to_string();
        assert!(error.contains("not a colour; allowed: `#` and six"), "{bad}: {error}");
    }
}

#[test]
fn a_shape_without_a_role_has_the_role_of_its_body() {
    let body = |name: &str| format!("[[body]]\nname = \"{name}\"\n{WITH_MASS}\n");
    let joint = |name: &str, kind: &str, more: &str| {
        format!("[[joint]]\nname = \"{name}\"\nchild = \"{name}\"\nkind = \"{kind}\"\n{more}\n")
    };
    let names = ["crank", "pump", "free", "ram", "hinged", "foot", "base", "last"];
    let drive = |speed: &str| format!("axis = [0, 0, 1]\ndrive = {{ law = \"constant\", velocity = \"{speed}\" }}");
    let axis = "axis = [0, 0, 1]";
    let mut text: String = names.iter().map(|name| body(name)).collect();
    text += &joint("crank", "revolute", &drive("1 rad/s"));
    text += &joint("pump", "prismatic", &drive("1 m/s"));
    text += &joint("free", "free", "start = { position = [0, 0, 0] }");
    text += &joint("ram", "prismatic", axis);
    text += &joint("hinged", "revolute", axis);
    text += &joint("foot", "fixed", "parent = \"crank\"");
    text += &joint("base", "fixed", "");
    text += &joint("last", "revolute", axis);
    let scene = Scene::parse(&text, None, &[]).unwrap();
    let roles = scene.machine.body_roles();
    let role_of = |name: &str| {
        let body = scene.machine.bodies.iter().position(|body| body.name == name);
        roles[body.unwrap()]
    };
    let expected = [
        Role::DrivingRod,
        Role::Slider,
        Role::DrivenRod,
        Role::Slider,
        Role::DrivenRod,
        Role::DrivingRod,
        Role::Frame,
        Role::Platform,
    ];
    for (name, expected) in names.iter().zip(expected) {
        assert_eq!(role_of(name), expected, "{name}");
    }
}
