//! MJCF, the XML of MuJoCo, <https://mujoco.readthedocs.io/en/stable/XMLreference.html>: a tree of bodies with joints and geoms.

mod equality;
mod geom;
mod joint;

use std::collections::BTreeMap;
use std::sync::Arc;

use roxmltree::Node;

use super::description::{Description, Pose, Shape};
use super::inertia::Inertial;
use super::mesh::MeshInertia;
use super::xml::{Source, child};
use super::{MAX_DEPTH, too_deep};
use crate::cli::Failure;
use crate::machine::{Mat3, Mesh, Quat, Vec3};

/// Default attributes of one class, by tag.
type Defaults<'n> = BTreeMap<&'n str, BTreeMap<&'n str, &'n str>>;

/// A site.
struct Site {
    /// The moving body, `None` for the world, and its pose there.
    at: (Option<usize>, Pose),
    line: u32,
    /// Whether a loop is closed at this site.
    is_connected: bool,
}

/// Settings and names of a file.
struct Model<'s, 'n, 'i> {
    source: &'s Source<'s>,
    /// Radians in the file's unit of angles.
    angle_unit: f64,
    /// Axes of Euler angles.
    euler_sequence: &'n str,
    mesh_folder: &'n str,
    inertia_from_geoms: Option<bool>,
    /// Default part of a mesh that has mass.
    mesh_inertia: MeshInertia,
    classes: BTreeMap<&'n str, Defaults<'n>>,
    /// Mesh assets by name, and loaded meshes by file.
    meshes: BTreeMap<String, Node<'n, 'i>>,
    loaded_meshes: BTreeMap<String, Arc<Mesh>>,
    colours: BTreeMap<&'n str, &'n str>,
    /// Bodies by name: the moving body of which each is a part, `None` for the world, and its pose there.
    bodies: BTreeMap<&'n str, (Option<usize>, Pose)>,
    sites: BTreeMap<&'n str, Site>,
    description: Description,
}

/// Attributes that state an orientation; an element has at most one of them.
const ORIENTATIONS: [&str; 5] = ["quat", "axisangle", "euler", "xyaxes", "zaxis"];
/// Message about a site that closes no loop.
const UNUSED_SITE: &str = "<site> of a body";
/// Class of the defaults of a whole file.
const MAIN: &str = "main";

/// Reads `<mujoco>`.
///
/// # Errors
/// A missing or invalid part, joints of a body that a scene cannot express, or a mesh whose mass cannot be computed.
pub fn read<'n, 'i>(source: &Source<'_>, root: Node<'n, 'i>) -> Result<Description, Failure> {
    let mut model = Model {
        source,
        angle_unit: 1.0_f64.to_radians(),
        euler_sequence: "xyz",
        mesh_folder: "",
        inertia_from_geoms: None,
        mesh_inertia: MeshInertia::Legacy,
        classes: BTreeMap::new(),
        meshes: BTreeMap::new(),
        loaded_meshes: BTreeMap::new(),
        colours: BTreeMap::new(),
        bodies: BTreeMap::new(),
        sites: BTreeMap::new(),
        description: Description::new(root.attribute("model").unwrap_or("model")),
    };
    let sections = || root.children().filter(Node::is_element);
    // The order of the sections is free: settings first.
    for node in sections() {
        match node.tag_name().name() {
            "compiler" => model.compiler(node)?,
            "option" => model.option(node)?,
            "default" => model.defaults(node, None, 0)?,
            "asset" => model.assets(node)?,
            _ => {}
        }
    }
    for node in sections().filter(|node| node.has_tag_name("worldbody")) {
        model.body(node, None, &Pose::identity(), MAIN, 0)?;
    }
    for node in sections() {
        match node.tag_name().name() {
            "compiler" | "option" | "default" | "asset" | "worldbody" => {}
            "equality" => model.equality(node)?,
            "include" => {
                return Err(source.error(node, "<include> is not supported: insert the contents of the file here"));
            }
            other => model.description.omit(source.line(node), format!("<{other}>")),
        }
    }
    if model.description.bodies.is_empty() {
        return Err(source.error(root, "no body has a joint"));
    }
    for site in model.sites.values().filter(|site| !site.is_connected) {
        model.description.omit(site.line, UNUSED_SITE);
    }
    Ok(model.description)
}

impl<'n, 'i> Model<'_, 'n, 'i> {
    fn compiler(&mut self, node: Node<'n, 'i>) -> Result<(), Failure> {
        for attribute in node.attributes() {
            let value = attribute.value();
            match (attribute.name(), value) {
                ("angle", "degree") => self.angle_unit = 1.0_f64.to_radians(),
                ("angle", "radian") => self.angle_unit = 1.0,
                ("eulerseq", sequence) if sequence.len() == 3 && sequence.chars().all(|c| "xyzXYZ".contains(c)) => {
                    self.euler_sequence = sequence;
                }
                ("meshdir" | "assetdir", folder) => self.mesh_folder = folder,
                ("exactmeshinertia", "true") => self.mesh_inertia = MeshInertia::Exact,
                ("exactmeshinertia", _) => {}
                ("inertiafromgeom", "auto") => self.inertia_from_geoms = None,
                ("inertiafromgeom", "true") => self.inertia_from_geoms = Some(true),
                ("inertiafromgeom", "false") => self.inertia_from_geoms = Some(false),
                ("settotalmass", value) if value.trim().starts_with('-') => {}
                ("settotalmass", _) => {
                    return Err(self.source.error_in(
                        node,
                        "settotalmass",
                        "is not supported: scale the masses in the file",
                    ));
                }
                ("inertiagrouprange", value) if value.split_whitespace().eq(["0", "5"]) => {}
                ("inertiagrouprange", _) => {
                    let message = "is not supported: give the geoms of the other groups mass = \"0\"";
                    return Err(self.source.error_in(node, "inertiagrouprange", message));
                }
                ("coordinate", "local")
                | ("autolimits" | "texturedir" | "strippath" | "discardvisual" | "usethread", _) => {}
                (key @ ("angle" | "eulerseq" | "inertiafromgeom" | "coordinate"), _) => {
                    return Err(self.source.error_in(node, key, "is not one of the choices"));
                }
                (key, _) => self.description.omit(self.source.line(node), format!("setting {key} of <compiler>")),
            }
        }
        Ok(())
    }

    fn option(&mut self, node: Node) -> Result<(), Failure> {
        if let Some(gravity) = self.source.numbers(node, "gravity")? {
            self.description.gravity = Vec3::from(gravity);
        }
        let others = node.attributes().filter(|attribute| attribute.name() != "gravity");
        for attribute in others {
            self.description.omit(self.source.line(node), format!("setting {} of <option>", attribute.name()));
        }
        for flag in node.children().filter(|child| child.has_tag_name("flag")) {
            for attribute in flag.attributes() {
                match (attribute.name(), attribute.value()) {
                    ("gravity", "disable") => self.description.gravity = Vec3::zeros(),
                    ("gravity", _) => {}
                    (key, _) => self.description.omit(self.source.line(flag), format!("flag {key} of <option>")),
                }
            }
        }
        Ok(())
    }

    /// Reads a class of defaults, which inherits those of `parent`.
    fn defaults(&mut self, node: Node<'n, 'i>, parent: Option<&'n str>, depth: usize) -> Result<(), Failure> {
        if depth > MAX_DEPTH {
            return Err(too_deep(self.source, node));
        }
        let class = match (node.attribute("class"), parent) {
            (Some(class), _) => class,
            (None, None) => MAIN,
            (None, Some(_)) => return Err(self.source.error(node, "the attribute `class` is missing")),
        };
        let inherited = parent.and_then(|parent| self.classes.get(parent));
        let mut own: Defaults = inherited.or_else(|| self.classes.get(class)).cloned().unwrap_or_default();
        for element in node.children().filter(|child| child.is_element() && !child.has_tag_name("default")) {
            let values = own.entry(element.tag_name().name()).or_default();
            if has_orientation(element) {
                values.retain(|key, _| !ORIENTATIONS.contains(key));
            }
            values.extend(element.attributes().map(|attribute| (attribute.name(), attribute.value())));
        }
        self.classes.insert(class, own);
        node.children()
            .filter(|child| child.has_tag_name("default"))
            .try_for_each(|child| self.defaults(child, Some(class), depth + 1))
    }

    fn assets(&mut self, node: Node<'n, 'i>) -> Result<(), Failure> {
        for asset in node.children().filter(Node::is_element) {
            match asset.tag_name().name() {
                "mesh" => {
                    let file = asset.attribute("file").map(|file| {
                        let last = file.rsplit('/').next().unwrap_or(file);
                        last.rsplit_once('.').map_or(last, |(stem, _)| stem)
                    });
                    if let Some(name) = asset.attribute("name").or(file) {
                        self.meshes.insert(name.to_owned(), asset);
                    }
                }
                "material" => {
                    if let Some((name, colour)) = asset.attribute("name").zip(asset.attribute("rgba")) {
                        self.colours.insert(name, colour);
                    }
                }
                other => self.description.omit(self.source.line(asset), format!("<{other}> of <asset>")),
            }
        }
        Ok(())
    }

    /// The attribute `key` of an element: its own, or that of its class.
    fn attribute(&self, node: Node<'n, 'i>, class: &str, key: &str) -> Option<&'n str> {
        let class = node.attribute("class").unwrap_or(class);
        let is_superseded = ORIENTATIONS.contains(&key) && has_orientation(node);
        let values = || self.classes.get(class)?.get(node.tag_name().name()).filter(|_| !is_superseded);
        let default = || values()?.get(key).copied();
        node.attribute(key).or_else(default)
    }

    fn numbers<const N: usize>(&self, node: Node<'n, 'i>, class: &str, key: &str) -> Result<Option<[f64; N]>, Failure> {
        let Some(text) = self.attribute(node, class, key) else {
            return Ok(None);
        };
        Ok(self.source.parse(node, key, text, [N, N])?.try_into().ok())
    }

    fn number(&self, node: Node<'n, 'i>, class: &str, key: &str) -> Result<f64, Failure> {
        Ok(self.numbers::<1>(node, class, key)?.map_or(0.0, |[number]| number))
    }

    /// Records attributes of an element that are not `known`; poses, names and groups always are.
    fn omit_unknown_attributes(&mut self, node: Node<'n, 'i>, known: &[&str]) {
        const ALWAYS: [&str; 11] =
            ["name", "class", "childclass", "group", "user", "pos", "quat", "axisangle", "euler", "xyaxes", "zaxis"];
        let tag = node.tag_name().name();
        for key in node.attributes().map(|attribute| attribute.name()) {
            if !ALWAYS.contains(&key) && !known.contains(&key) {
                self.description.omit(self.source.line(node), format!("{key} of <{tag}>"));
            }
        }
    }

    /// Pose of an element in its parent.
    fn pose(&self, node: Node<'n, 'i>, class: &str) -> Result<Pose, Failure> {
        let position = self.numbers(node, class, "pos")?.map_or_else(Vec3::zeros, Vec3::from);
        Ok(Pose { position, rotation: self.rotation(node, class)? })
    }

    /// The pose between the two points of `fromto`, if an element has them, and half their distance, m.
    fn fromto_pose(&self, node: Node<'n, 'i>, class: &str) -> Result<Option<(Pose, f64)>, Failure> {
        let Some([a, b, c, d, e, f]) = self.numbers(node, class, "fromto")? else {
            return Ok(None);
        };
        let (from, to) = (Vec3::new(a, b, c), Vec3::new(d, e, f));
        let along = (to - from).try_normalize(1e-12);
        let along = along.ok_or_else(|| self.source.error(node, "fromto: both points are the same"))?;
        // MuJoCo's z axis points from the second point to the first.
        Ok(Some((Pose { position: 0.5 * (from + to), rotation: rotation_from_z(-along) }, 0.5 * (to - from).norm())))
    }

    fn rotation(&self, node: Node<'n, 'i>, class: &str) -> Result<Quat, Failure> {
        let direction = |v: Vec3, key: &str| {
            v.try_normalize(1e-12).ok_or_else(|| self.source.error(node, &format!("{key} has no direction")))
        };
        if let Some(parts) = self.numbers(node, class, "quat")? {
            return quaternion(parts).ok_or_else(|| self.source.error(node, "quat is 0"));
        }
        if let Some([x, y, z, angle]) = self.numbers(node, class, "axisangle")? {
            return Ok(rotation_about(direction(Vec3::new(x, y, z), "axisangle")?, self.angle_unit * angle));
        }
        if let Some(angles) = self.numbers::<3>(node, class, "euler")? {
            let mut rotation = Quat::identity();
            for (axis, angle) in self.euler_sequence.chars().zip(angles) {
                let about = match axis.to_ascii_lowercase() {
                    'x' => Vec3::x(),
                    'y' => Vec3::y(),
                    _ => Vec3::z(),
                };
                let next = rotation_about(about, self.angle_unit * angle);
                // Lower-case letters mean axes that rotate with the body, capitals fixed axes.
                rotation = if axis.is_ascii_lowercase() { rotation * next } else { next * rotation };
            }
            return Ok(rotation);
        }
        if let Some([a, b, c, d, e, f]) = self.numbers(node, class, "xyaxes")? {
            let x = direction(Vec3::new(a, b, c), "xyaxes")?;
            let y = Vec3::new(d, e, f);
            let y = direction(y - x * x.dot(&y), "xyaxes")?;
            return Ok(Quat::from_matrix(&Mat3::from_columns(&[x, y, x.cross(&y)])));
        }
        if let Some(z) = self.numbers(node, class, "zaxis")? {
            return Ok(rotation_from_z(direction(Vec3::from(z), "zaxis")?));
        }
        Ok(Quat::identity())
    }

    /// Reads a body at `pose` in the body `carrier`, and its child bodies. Without joints it is a part of its parent.
    fn body(
        &mut self,
        node: Node<'n, 'i>,
        carrier: Option<usize>,
        pose: &Pose,
        class: &'n str,
        depth: usize,
    ) -> Result<(), Failure> {
        if depth > MAX_DEPTH {
            return Err(too_deep(self.source, node));
        }
        let class = node.attribute("childclass").unwrap_or(class);
        self.omit_unknown_attributes(node, &[]);
        let is_joint = |child: &Node| matches!(child.tag_name().name(), "joint" | "freejoint");
        let joints: Vec<_> = node.children().filter(is_joint).collect();
        let (mut owner, mut at) = (carrier, *pose);
        if !joints.is_empty() {
            let index = self.add_jointed_body(node, &joints, class, carrier, pose)?;
            (owner, at) = (Some(index), Pose::identity());
        }
        if let Some(name) = node.attribute("name") {
            self.bodies.insert(name, (owner, at));
        }
        self.contents(node, owner, &at, class)?;
        for inner in node.children().filter(|child| child.has_tag_name("body")) {
            let class = inner.attribute("childclass").unwrap_or(class);
            let inner_pose = at.compose(&self.pose(inner, class)?);
            self.body(inner, owner, &inner_pose, class, depth + 1)?;
        }
        // By now, child bodies without joints have added their mass.
        if let Some(index) = owner.filter(|_| !joints.is_empty())
            && !(self.description.bodies[index].inertial.mass > 0.0)
        {
            return Err(self
                .source
                .error(node, "a moving body needs a mass above 0 kg, in <inertial> or in its geoms"));
        }
        Ok(())
    }

    /// Adds mass and shapes of a body to the body `owner`, in which it lies at `pose`.
    fn contents(
        &mut self,
        node: Node<'n, 'i>,
        owner: Option<usize>,
        pose: &Pose,
        class: &'n str,
    ) -> Result<(), Failure> {
        let own = child(node, "inertial").filter(|_| self.inertia_from_geoms != Some(true));
        let mut total = own.map(|inertial| self.inertial(inertial, class)).transpose()?;
        let from_geoms = total.is_none() && self.inertia_from_geoms != Some(false) && owner.is_some();
        for part in node.children().filter(Node::is_element) {
            let line = self.source.line(part);
            match part.tag_name().name() {
                "body" | "joint" | "freejoint" | "inertial" => {}
                "site" => self.add_site(part, owner, pose, class)?,
                "geom" => {
                    let (shape, mass) = self.geom(part, class, from_geoms)?;
                    if let Some(mass) = mass {
                        total = Some(total.map_or(mass, |total| total.combined_with(mass)));
                    }
                    if let Some(shape) = shape {
                        let shape = Shape { pose: pose.compose(&shape.pose), ..shape };
                        match owner {
                            Some(body) => self.description.bodies[body].shapes.push(shape),
                            None => self.description.fixed.push(shape),
                        }
                    }
                }
                "frame" | "replicate" | "composite" | "flexcomp" | "attach" | "include" => {
                    return Err(self.source.error(part, "is not supported: write the bodies that it stands for"));
                }
                other => self.description.omit(line, format!("<{other}> of a body")),
            }
        }
        if let (Some(total), Some(body)) = (total, owner) {
            let own = &mut self.description.bodies[body].inertial;
            *own = own.combined_with(pose.inertial(total));
        }
        Ok(())
    }

    /// Records a site of the body `owner`, or of a part of it that lies at `pose`.
    fn add_site(&mut self, node: Node<'n, 'i>, owner: Option<usize>, pose: &Pose, class: &str) -> Result<(), Failure> {
        let line = self.source.line(node);
        let Some(name) = node.attribute("name") else {
            self.description.omit(line, UNUSED_SITE);
            return Ok(());
        };
        let own = match self.fromto_pose(node, class)? {
            Some((own, _)) => own,
            None => self.pose(node, class)?,
        };
        self.sites.insert(name, Site { at: (owner, pose.compose(&own)), line, is_connected: false });
        Ok(())
    }

    fn inertial(&self, node: Node<'n, 'i>, class: &str) -> Result<Inertial, Failure> {
        let pose = self.pose(node, class)?;
        self.source.require(node, "mass")?;
        let mass = self.source.number(node, "mass")?.unwrap_or_default();
        let inertia = match self.source.numbers(node, "fullinertia")? {
            Some([xx, yy, zz, xy, xz, yz]) => Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
            None => {
                self.source.require(node, "diaginertia")?;
                Mat3::from_diagonal(&self.source.numbers(node, "diaginertia")?.map_or_else(Vec3::zeros, Vec3::from))
            }
        };
        let own = Inertial { mass, centre: Vec3::zeros(), inertia };
        own.error_message().map_or(Ok(pose.inertial(own)), |fault| Err(self.source.error(node, &fault)))
    }
}

/// Whether an element has an orientation of its own.
fn has_orientation(node: Node) -> bool {
    ORIENTATIONS.iter().any(|key| node.attribute(*key).is_some())
}

/// The rotation of a quaternion w, x, y, z of any length; `None` for 0.
fn quaternion([w, x, y, z]: [f64; 4]) -> Option<Quat> {
    // The double cover does not matter.
    let axis = Vec3::new(x, y, z);
    let angle = 2.0 * libm::atan2(axis.norm(), w);
    let rotation = axis.try_normalize(0.0).map_or_else(Quat::identity, |axis| rotation_about(axis, angle));
    (w != 0.0 || axis.norm() > 0.0).then_some(rotation)
}

/// The rotation by `angle`, rad, about a unit axis.
fn rotation_about(axis: Vec3, angle: f64) -> Quat {
    Quat::from_scaled_axis(angle * axis)
}

/// The shortest rotation that takes z to the unit vector `direction`.
fn rotation_from_z(direction: Vec3) -> Quat {
    let axis = Vec3::z().cross(&direction);
    let angle = libm::atan2(axis.norm(), direction.z);
    rotation_about(axis.try_normalize(1e-12).unwrap_or_else(Vec3::x), angle)
}
