//! `import`: a robot description, URDF or MJCF, as the text of a scene file.

mod description;
mod inertia;
mod mesh;
mod mjcf;
mod urdf;
mod write;
mod xml;

use std::path::Path;

use roxmltree::{Document, Node, ParsingOptions};

use super::args::ImportArguments;
use super::{Failure, print, warn};
use crate::scene::{ReadError, Scene, SceneError, read_regular};
use description::Description;
use xml::Source;

/// Size limit for a description, bytes: that of a scene file.
const MAX_BYTES: u64 = 4 << 20;
/// Largest nesting depth of bodies.
const MAX_DEPTH: usize = 1000;
/// Limit on the number of elements, attributes and texts of a description.
const MAX_NODES: u32 = 500_000;

/// Runs `import`.
///
/// # Errors
/// An unreadable file, one that is neither URDF nor MJCF, or an unsupported part that changes the motion of the machine.
pub fn import(arguments: &ImportArguments) -> Result<(), Failure> {
    let path = &arguments.file;
    let name = path.display().to_string();
    let bytes = read_regular(path, MAX_BYTES).map_err(|error| match error {
        ReadError::TooLarge(_) => Failure::usage(format!("{name}: {error}")),
        _ => Failure::io(format!("{name}: {error}")),
    })?;
    let text = String::from_utf8(bytes)
        .map_err(|_| Failure::io(format!("{name}: cannot read this file: it is not valid UTF-8")))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut description = read(&name, folder, &text)?;
    description.omit_unreadable_meshes(folder);
    let scene = write::scene(&description, &name)?;
    // A scene that cannot be read is not printed.
    Scene::parse_given(&scene.text, None, &Default::default(), Some(folder), &[])
        .map_err(|error| Failure::usage(in_description(&name, &scene, error)))?;
    for omission in description.omissions() {
        warn(&format!("{name}: {omission}"));
    }
    print(&scene.text)
}

/// Message about an error in the generated scene, with the line of the description `name` from which it comes, if any.
fn in_description(name: &str, scene: &write::SceneFile, error: SceneError) -> String {
    let origin = error.position.filter(|_| error.file.is_none()).and_then(|(line, _)| scene.origin(line));
    let Some(line) = origin else {
        return format!("{name}: the description gives no valid scene: {error}");
    };
    SceneError { file: Some(format!("{name}:{line}")), position: None, line_text: None, ..error }.to_string()
}

fn too_deep(source: &Source, node: Node) -> Failure {
    source.error(node, &format!("nested more than {MAX_DEPTH} levels deep"))
}

fn read(name: &str, folder: &Path, text: &str) -> Result<Description, Failure> {
    // A document type is harmless; its entities could multiply the text.
    if let Some(at) = text.find("<!ENTITY") {
        let line = text[..at].matches('\n').count() + 1;
        return Err(Failure::usage(format!("{name}:{line}: entities are not read: write their text in their places")));
    }
    let options = ParsingOptions { allow_dtd: true, nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options)
        .map_err(|error| Failure::usage(format!("{name}: is not an XML file: {error}")))?;
    let root = document.root_element();
    let source = Source { file: name, folder, document: &document };
    let is_macro = |node: &Node| node.tag_name().namespace().is_some_and(|space| space.ends_with("/xacro"));
    if let Some(node) = root.descendants().find(is_macro) {
        return Err(source.error(node, "a macro of xacro: expand the file first, xacro FILE > robot.urdf"));
    }
    match root.tag_name().name() {
        "robot" => urdf::read(&source, root),
        "mujoco" => mjcf::read(&source, root),
        other => Err(source.error(root, &format!("<{other}> is neither <robot> (URDF) nor <mujoco> (MJCF)"))),
    }
}
