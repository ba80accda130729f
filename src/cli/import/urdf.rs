//! URDF, <http://wiki.ros.org/urdf/XML>: a tree of links whose root is fixed to the world. Links on fixed joints become one body.

use std::collections::BTreeMap;

use roxmltree::Node;

use super::description::{Body, Description, Form, Joint, Kind, Pose, Shape, Spring, mesh_unit};
use super::inertia::Inertial;
use super::xml::{Source, child};
use super::{MAX_DEPTH, too_deep};
use crate::cli::Failure;
use crate::machine::{Mat3, Quat, Vec3};

/// State of the traversal of the tree of links.
struct Tree<'s, 'n, 'i> {
    source: &'s Source<'s>,
    links: BTreeMap<&'n str, Node<'n, 'i>>,
    /// Joints by parent link, in the order of the file.
    joints: BTreeMap<&'n str, Vec<Node<'n, 'i>>>,
    colours: BTreeMap<&'n str, [f64; 3]>,
    description: Description,
}

/// Reads `<robot>`.
///
/// # Errors
/// A missing or invalid part, a link with several parents or without a path to the root, an unsupported kind of joint.
pub fn read(source: &Source, robot: Node) -> Result<Description, Failure> {
    let mut tree = Tree {
        source,
        links: BTreeMap::new(),
        joints: BTreeMap::new(),
        colours: BTreeMap::new(),
        description: Description::new(robot.attribute("name").unwrap_or("robot")),
    };
    let mut carried: BTreeMap<&str, Node> = BTreeMap::new();
    for node in robot.children().filter(Node::is_element) {
        match node.tag_name().name() {
            "link" => {
                if tree.links.insert(source.require(node, "name")?, node).is_some() {
                    return Err(source.error(node, "a second link of this name"));
                }
            }
            "joint" => {
                let [parent, child] = link_names(source, node)?;
                tree.joints.entry(parent).or_default().push(node);
                if let Some(first) = carried.insert(child, node) {
                    let line = source.line(first);
                    return Err(
                        source.error(node, &format!("{child} already has a parent, by the joint on line {line}"))
                    );
                }
            }
            "material" => {}
            other => tree.description.omit(source.line(node), format!("<{other}>")),
        }
    }
    // A material may be defined anywhere and is known by its name everywhere; the outermost definition counts.
    let mut materials: Vec<Node> = robot.descendants().filter(|node| node.has_tag_name("material")).collect();
    materials.sort_by_key(|node| node.parent() != Some(robot));
    for node in materials {
        let colour = child(node, "color").map(|c| source.numbers::<4>(c, "rgba")).transpose()?.flatten();
        if let Some(([r, g, b, _], name)) = colour.zip(node.attribute("name")) {
            tree.colours.entry(name).or_insert([r, g, b]);
        }
    }
    for (child, joint) in &carried {
        if !tree.links.contains_key(child) {
            return Err(source.error(*joint, &format!("there is no link {child}")));
        }
    }
    for (parent, joints) in &tree.joints {
        if !tree.links.contains_key(parent) {
            return Err(source.error(joints[0], &format!("there is no link {parent}")));
        }
    }
    let roots: Vec<&str> = tree.links.keys().copied().filter(|link| !carried.contains_key(link)).collect();
    let [root] = roots[..] else {
        let what = if roots.is_empty() { "none, the joints form a loop".to_owned() } else { roots.join(", ") };
        return Err(source.error(
            robot,
            &format!("exactly one link, which is fixed to the world, must have no parent; without parent: {what}"),
        ));
    };
    tree.walk(root, None, &Pose::identity(), 0)?;
    if tree.description.bodies.is_empty() {
        return Err(source.error(robot, "no joint moves"));
    }
    let moving = tree.joints.values().flatten().filter(|joint| joint.attribute("type") != Some("fixed")).count();
    if tree.description.bodies.len() < moving {
        return Err(source.error(robot, "some links form a loop that is not connected to the world"));
    }
    Ok(tree.description)
}

/// Names of the links that a joint connects.
fn link_names<'n>(source: &Source, joint: Node<'n, '_>) -> Result<[&'n str; 2], Failure> {
    let end = |tag: &str| -> Result<&'n str, Failure> {
        let node = joint.children().find(|node| node.has_tag_name(tag));
        let node = node.ok_or_else(|| source.error(joint, &format!("<{tag}> is missing")))?;
        node.attribute("link").ok_or_else(|| source.error(node, "the attribute `link` is missing"))
    };
    Ok([end("parent")?, end("child")?])
}

impl<'n> Tree<'_, 'n, '_> {
    /// Adds `link`, which lies at `pose` in the body `carrier`, and the links that it carries.
    fn walk(&mut self, link: &'n str, carrier: Option<usize>, pose: &Pose, depth: usize) -> Result<(), Failure> {
        if depth > MAX_DEPTH {
            return Err(too_deep(self.source, self.links[link]));
        }
        self.add_link_contents(self.links[link], carrier, pose)?;
        for joint in self.joints.get(link).cloned().unwrap_or_default() {
            let [_, child_link] = link_names(self.source, joint)?;
            let at = pose.compose(&self.origin(joint)?);
            let Some(kind) = self.kind(joint)? else {
                self.walk(child_link, carrier, &at, depth + 1)?;
                continue;
            };
            let index = self.description.bodies.len();
            self.description.bodies.push(Body::new(child_link, self.source.line(self.links[child_link])));
            let springs = self.damper(joint, kind)?;
            self.description.joints.push(Joint {
                name: self.source.require(joint, "name")?.to_owned(),
                kind,
                parent: carrier,
                child: index,
                pose: at,
                anchor: Vec3::zeros(),
                springs,
                line: self.source.line(joint),
            });
            self.walk(child_link, Some(index), &Pose::identity(), depth + 1)?;
            if !(self.description.bodies[index].inertial.mass > 0.0) && !self.description.only_connects(index) {
                let message = "a moving link needs an <inertial> with a mass above 0 kg, unless it connects a hinge or slide with \
                               another";
                return Err(self.source.error(self.links[child_link], message));
            }
        }
        Ok(())
    }

    /// Adds mass and shapes of a link.
    fn add_link_contents(&mut self, link: Node, carrier: Option<usize>, pose: &Pose) -> Result<(), Failure> {
        for node in link.children().filter(Node::is_element) {
            let line = self.source.line(node);
            match node.tag_name().name() {
                "inertial" => {
                    let inertial = pose.inertial(self.inertial(node)?);
                    match carrier {
                        Some(body) => {
                            let own = &mut self.description.bodies[body].inertial;
                            *own = own.combined_with(inertial);
                        }
                        None => self.description.omit(line, "mass of a link that does not move"),
                    }
                }
                "visual" => {
                    if let Some(shape) = self.shape(node, pose)? {
                        match carrier {
                            Some(body) => self.description.bodies[body].shapes.push(shape),
                            None => self.description.fixed.push(shape),
                        }
                    }
                }
                "collision" => self.description.omit(line, "<collision>: bodies do not touch each other"),
                other => self.description.omit(line, format!("<{other}> of a link")),
            }
        }
        Ok(())
    }

    /// Pose of a part in its link, or of a joint's child in its parent.
    fn origin(&self, node: Node) -> Result<Pose, Failure> {
        let Some(origin) = child(node, "origin") else {
            return Ok(Pose::identity());
        };
        let position = self.source.numbers(origin, "xyz")?.map_or_else(Vec3::zeros, Vec3::from);
        let [roll, pitch, yaw] = self.source.numbers(origin, "rpy")?.unwrap_or_default();
        Ok(Pose { position, rotation: Quat::from_euler_angles(roll, pitch, yaw) })
    }

    fn inertial(&self, node: Node) -> Result<Inertial, Failure> {
        let pose = self.origin(node)?;
        let part = |tag: &str| child(node, tag).ok_or_else(|| self.source.error(node, &format!("<{tag}> is missing")));
        let mass_node = part("mass")?;
        self.source.require(mass_node, "value")?;
        let mass = self.source.number(mass_node, "value")?.unwrap_or_default();
        let tensor = part("inertia")?;
        let mut components = [0.0; 6];
        for (value, key) in components.iter_mut().zip(["ixx", "iyy", "izz", "ixy", "ixz", "iyz"]) {
            self.source.require(tensor, key)?;
            *value = self.source.number(tensor, key)?.unwrap_or_default();
        }
        let [xx, yy, zz, xy, xz, yz] = components;
        let inertia = Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        let own = Inertial { mass, centre: Vec3::zeros(), inertia };
        own.error_message().map_or(Ok(pose.inertial(own)), |fault| Err(self.source.error(node, &fault)))
    }

    fn shape(&mut self, visual: Node, pose: &Pose) -> Result<Option<Shape>, Failure> {
        let geometry = child(visual, "geometry").ok_or_else(|| self.source.error(visual, "<geometry> is missing"))?;
        let line = self.source.line(visual);
        let Some(node) = geometry.children().find(Node::is_element) else {
            return Err(self.source.error(geometry, "is empty"));
        };
        let size = |key: &str| -> Result<f64, Failure> {
            self.source.require(node, key)?;
            Ok(self.source.number(node, key)?.unwrap_or_default())
        };
        let form = match node.tag_name().name() {
            "sphere" => Form::Sphere(size("radius")?),
            "cylinder" => Form::Cylinder(size("radius")?, 0.5 * size("length")?),
            "capsule" => Form::Capsule(size("radius")?, 0.5 * size("length")?),
            "box" => {
                self.source.require(node, "size")?;
                Form::Box(self.source.numbers::<3>(node, "size")?.unwrap_or_default().map(|edge| 0.5 * edge))
            }
            "mesh" => {
                let file = self.source.require(node, "filename")?;
                let scale = self.source.numbers::<3>(node, "scale")?.unwrap_or([1.0; 3]);
                let unit = match mesh_unit(scale) {
                    Ok(unit) => unit,
                    Err(fault) => {
                        self.description.omit(line, format!("mesh {file}, {fault}"));
                        return Ok(None);
                    }
                };
                // The folder of the scene is taken as the package.
                let inside =
                    file.strip_prefix("package://").and_then(|rest| rest.split_once('/')).map(|(_, inside)| inside);
                let file = inside.or(file.strip_prefix("file://")).unwrap_or(file).trim_start_matches("./");
                Form::Mesh(file.to_owned(), unit)
            }
            other => {
                self.description.omit(line, format!("shape <{other}>"));
                return Ok(None);
            }
        };
        let material = child(visual, "material");
        let own = material.and_then(|m| child(m, "color")).map(|c| self.source.numbers::<4>(c, "rgba")).transpose()?;
        let known = material.and_then(|m| m.attribute("name")).and_then(|name| self.colours.get(name).copied());
        let colour = own.flatten().map(|[r, g, b, _]| [r, g, b]).or(known);
        Ok(Some(Shape { form, pose: pose.compose(&self.origin(visual)?), colour, line }))
    }

    /// Motion that a joint allows; `None` for a fixed one.
    fn kind(&mut self, joint: Node) -> Result<Option<Kind>, Failure> {
        let axis = || -> Result<Vec3, Failure> {
            let Some(node) = child(joint, "axis") else {
                return Ok(Vec3::x());
            };
            let axis = self.source.numbers(node, "xyz")?.map_or_else(Vec3::x, Vec3::from);
            let direction = axis.try_normalize(1e-12);
            direction.ok_or_else(|| self.source.error_in(node, "xyz", "the axis has no direction"))
        };
        let kind = match self.source.require(joint, "type")? {
            "fixed" => return Ok(None),
            "revolute" | "continuous" => Kind::Hinge(axis()?),
            "prismatic" => Kind::Slide(axis()?),
            "spherical" | "ball" => Kind::Ball,
            "floating" => Kind::Free,
            _ => {
                let allowed = "allowed: fixed, revolute, continuous, prismatic, spherical, floating";
                return Err(self.source.error_in(joint, "type", allowed));
            }
        };
        for node in joint.children().filter(Node::is_element) {
            let line = self.source.line(node);
            match node.tag_name().name() {
                "origin" | "parent" | "child" | "axis" | "dynamics" => {}
                "limit" if joint.attribute("type") == Some("continuous") => {}
                "limit" => self.description.omit(line, "limits of a joint: a [[stop]] needs their stiffness, too"),
                "mimic" => self.description.omit(line, "<mimic>: the joint moves independently"),
                other => self.description.omit(line, format!("<{other}> of a joint")),
            }
        }
        Ok(Some(kind))
    }

    fn damper(&mut self, joint: Node, kind: Kind) -> Result<Vec<Spring>, Failure> {
        let Some(node) = child(joint, "dynamics") else {
            return Ok(Vec::new());
        };
        let line = self.source.line(node);
        if self.source.number(node, "friction")?.unwrap_or_default() != 0.0 {
            self.description.omit(line, "friction in a joint");
        }
        let damping = self.source.number(node, "damping")?.unwrap_or_default();
        let is_angle = match kind {
            Kind::Hinge(_) => true,
            Kind::Slide(_) => false,
            _ if damping != 0.0 => {
                self.description.omit(line, "damping of a joint that is neither a hinge nor a slide");
                return Ok(Vec::new());
            }
            _ => return Ok(Vec::new()),
        };
        let spring = Spring { coordinate: None, is_angle, stiffness: 0.0, damping, rest: 0.0 };
        Ok((damping != 0.0).then_some(spring).into_iter().collect())
    }
}
