//! Masses and inertias of robot descriptions: meshes, impossible inertias, and the lines of errors that the scene reader reports.

use std::fs;

use crate::import::{import_error, imported, mujoco};
use crate::program::{folder, jointplay};
use jointplay::machine::Vec3;
use jointplay::scene::Scene;

/// A box of 2 x 4 x 7 units about its corner, as OBJ, without the face with the most negative x if `open`.
fn cuboid(open: bool) -> String {
    let mut text = String::new();
    for i in 0..8 {
        let side = |bit: i32, size: f64| if i >> bit & 1 == 1 { size } else { 0.0 };
        text += &format!("v {} {} {}\n", side(0, 2.0), side(1, 4.0), side(2, 7.0));
    }
    text += "f 2 4 8 6\nf 1 2 6 5\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\n";
    if open { text } else { text + "f 1 5 7 3\n" }
}

/// A body whose one geom is an invisible mesh.
fn with_mesh(asset: &str, geom: &str) -> String {
    let body = format!("<body name=\"b\"><joint/><geom type=\"mesh\" mesh=\"m\" rgba=\"1 1 1 0\" {geom}/></body>");
    let asset = format!("<asset><mesh name=\"m\" file=\"m.obj\" {asset}/></asset><worldbody>");
    mujoco(&body).replace("<worldbody>", &asset)
}

fn outcome(text: &str, mesh: &str, status: i32) -> (String, String) {
    let folder = folder();
    fs::write(folder.path().join("robot"), text).unwrap();
    fs::write(folder.path().join("m.obj"), mesh).unwrap();
    let outcome = jointplay(folder.path(), "import robot").expect(status);
    (outcome.stdout, outcome.stderr)
}

#[test]
fn a_mesh_has_the_mass_of_its_volume_at_the_pose_of_its_geom() {
    let body_with_mesh = |asset: &str, geom: &str| {
        let (text, _) = outcome(&with_mesh(asset, geom), &cuboid(false), 0);
        Scene::parse(&text, None, &[]).unwrap().machine.bodies.remove(0)
    };
    // In hundredths: 0.02 x 0.04 x 0.07 m^3.
    let scale = "scale=\"0.01 0.01 0.01\"";
    let mass = 1000.0 * 5.6e-5;
    for inertia in ["", "inertia=\"convex\"", "inertia=\"exact\"", "inertia=\"legacy\""] {
        let body = body_with_mesh(&format!("{scale} {inertia}"), "pos=\"1 0 0\" euler=\"0 0 90\"");
        assert!((body.mass / mass - 1.0).abs() < 1e-6, "{} {mass}", body.mass);
        // Its x axis is the body's y, its y axis the body's -x.
        assert!((body.centre - Vec3::new(1.0 - 0.02, 0.01, 0.035)).norm() < 1e-8, "{}", body.centre);
        let zz = mass * (0.02_f64.powi(2) + 0.04_f64.powi(2)) / 12.0;
        let xx = mass * (0.02_f64.powi(2) + 0.07_f64.powi(2)) / 12.0;
        assert!((body.inertia.m33 / zz - 1.0).abs() < 1e-5 && (body.inertia.m11 / xx - 1.0).abs() < 1e-5);
    }
    // Edges of 0.02, 0.08 and 0.07 m, mirrored and moved by the mesh's own frame; a mass in place of a density.
    let moved = body_with_mesh("scale=\"-0.01 0.02 0.01\" refpos=\"1 2 3.5\"", "mass=\"3\"");
    assert!((moved.mass - 3.0).abs() < 1e-12 && moved.centre.norm() < 1e-8, "{} {}", moved.mass, moved.centre);
    let zz = 3.0 * (0.02_f64.powi(2) + 0.08_f64.powi(2)) / 12.0;
    assert!((moved.inertia.m33 / zz - 1.0).abs() < 1e-5);
    // kg/m^2 on a surface of 2 (8 + 14 + 28) square units.
    let shell = body_with_mesh(&format!("{scale} inertia=\"shell\""), "density=\"10\"");
    assert!((shell.mass / (10.0 * 1e-2) - 1.0).abs() < 1e-6, "{}", shell.mass);
}

#[test]
fn a_mesh_without_a_computable_mass_is_refused_with_its_line() {
    let error = |asset: &str, geom: &str, mesh: &str| outcome(&with_mesh(asset, geom), mesh, 2).1;
    for (asset, mesh, expected) in [
        (
            "",
            cuboid(true),
            "robot:3: geom: mesh without a computable mass: m.obj: it is not closed: its edge from (0, ",
        ),
        ("inertia=\"solid\"", cuboid(false), "inertia = \"solid\": allowed: convex, exact, legacy, shell"),
        ("inertia=\"convex\"", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\n".to_owned(), "lie in one plane"),
        ("", "v 0 0 x\n".to_owned(), "mesh without a computable mass: m.obj: "),
    ] {
        let message = error(asset, "", &mesh);
        assert!(message.contains(expected), "{message}\n  does not contain `{expected}`");
    }
    let open = cuboid(true);
    // An open mesh is accepted without mass or with the mass of its hull.
    outcome(&with_mesh("inertia=\"convex\"", ""), &open, 0);
    outcome(&with_mesh("", "mass=\"0\"").replace("<joint/>", "<joint/><geom size=\"0.1\"/>"), &open, 0);
    let missing_file = outcome(&with_mesh("", "").replace("m.obj", "gone.obj"), &open, 2).1;
    assert!(
        missing_file.contains("gone.obj: cannot read this file")
            && missing_file.contains("give its body an <inertial>"),
        "{missing_file}"
    );
    let shell = mujoco("<body><joint/><geom size=\"0.1\" shellinertia=\"true\"/></body>");
    assert!(import_error(&shell).contains("shellinertia = \"true\" is not supported"));
}

fn link(mass: &str, [xx, yy, zz]: [&str; 3], more: &str) -> String {
    format!(
        "<robot name=\"r\">\n<link name=\"base\"/>\n<link name=\"a\">\n<inertial><mass value=\"{mass}\"/>\n\
         <inertia ixx=\"{xx}\" ixy=\"0\" ixz=\"0\" iyy=\"{yy}\" iyz=\"0\" izz=\"{zz}\"/></inertial>\n{more}</link>\n\
         <joint name=\"j\" type=\"continuous\"><parent link=\"base\"/><child link=\"a\"/></joint></robot>"
    )
}

#[test]
fn impossible_inertias_are_refused_with_their_line() {
    let diagonal = |values: &str| {
        mujoco(&format!("<body>\n<joint/>\n<inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"{values}\"/></body>"))
    };
    let sphere = "<visual>\n<geometry><sphere radius=\"5000\"/></geometry></visual>\n";
    for (text, expected) in [
        (
            link("1", ["1", "1", "3"], ""),
            "robot:4: inertial: no body has this inertia: its largest principal moment, 3 kg m^2, exceeds",
        ),
        (
            link("1", ["1", "-1", "1"], ""),
            "robot:4: inertial: no body has this inertia: its smallest principal moment is -1 kg m^2",
        ),
        (link("-1", ["1", "1", "1"], ""), "robot:4: inertial: the mass is -1 kg; allowed from 0 kg"),
        (
            diagonal("0.1 0.1 0.3"),
            "robot:5: inertial: no body has this inertia: its largest principal moment, 0.3 kg m^2, exceeds",
        ),
        // Errors that only the scene reader finds.
        (link("2e9", ["1", "1", "1"], ""), "robot:3: body.a.mass = "),
        (link("1", ["0", "0", "0"], ""), "robot:3: body.a.inertia = "),
        (link("1", ["1", "1", "1"], sphere), "robot:6: body.a.shapes[0].radius = "),
    ] {
        let message = import_error(&text);
        assert!(message.contains(expected), "{text}\n  error without `{expected}`: {message}");
    }
    // A point mass can be a part of a body.
    let joint = "</link><link name=\"p\"><inertial><mass value=\"1\"/><inertia ixx=\"0\" ixy=\"0\" ixz=\"0\" iyy=\"0\" iyz=\"0\" izz=\"0\"/></inertial></link>\
                 <joint name=\"f\" type=\"fixed\"><parent link=\"a\"/><child link=\"p\"/></joint><link name=\"q\">";
    let text = link("1", ["1", "1", "1"], joint).replace(
        "</robot>",
        "<joint name=\"g\" type=\"fixed\"><parent link=\"a\"/><child link=\"q\"/></joint></robot>",
    );
    assert_eq!(imported(&text).0.machine.bodies[0].mass, 2.0);
}

#[test]
fn a_material_may_be_defined_anywhere_and_a_document_type_is_accepted() {
    let visual = |material: &str| format!("<visual><geometry><sphere radius=\"1\"/></geometry>{material}</visual>");
    let defined = "<material name=\"blue\"><color rgba=\"0 0 1 1\"/></material>";
    let text = link("1", ["1", "1", "1"], &(visual("<material name=\"blue\"/>") + &visual(defined)));
    let (scene, _) = imported(&text);
    assert_eq!(scene.source.text.matches("colour = \"#0000ff\"").count(), 2, "{}", scene.source.text);
    let outer = text.replace(
        "<link name=\"base\"/>",
        "<link name=\"base\"/><material name=\"blue\"><color rgba=\"1 0 0 1\"/></material>",
    );
    let (scene, _) = imported(&outer);
    assert_eq!(scene.source.text.matches("colour = \"#ff0000\"").count(), 1, "{}", scene.source.text);
    let with_document_type = |inside: &str| format!("<?xml version=\"1.0\"?>\n<!DOCTYPE robot{inside}>\n{text}");
    assert_eq!(imported(&with_document_type("")).0.machine.bodies.len(), 1);
    let message = import_error(&with_document_type(" [\n<!ENTITY a \"b\">]"));
    assert!(message.contains("robot:3: entities are not read: write their text in their places"), "{message}");
}
