//! `<joint>` and `<freejoint>`: the joints between a body and the one that carries it.

use roxmltree::Node;

use super::super::description::{Body, Joint, Kind, Pose, Spring};
use super::Model;
use crate::cli::Failure;
use crate::machine::Vec3;
use crate::words::{Words, words};

/// Cosine of the angle between two axes above which they count as parallel, and below which as perpendicular.
const PARALLEL: f64 = 1.0 - 1e-10;
const PERPENDICULAR: f64 = 1e-6;

/// Attributes of a joint that are read, reported elsewhere, or affect only limits.
const KNOWN_ATTRIBUTES: [&str; 13] = [
    "type",
    "axis",
    "range",
    "limited",
    "margin",
    "solreflimit",
    "solimplimit",
    "stiffness",
    "damping",
    "springref",
    "armature",
    "frictionloss",
    "ref",
];

/// Values of the attribute `type`.
#[derive(Clone, Copy, PartialEq, Eq)]
enum JointType {
    Hinge,
    Slide,
    Ball,
    Free,
}

words!(JointType {
    Hinge => "hinge",
    Slide => "slide",
    Ball => "ball",
    Free => "free",
});

/// A joint element.
#[derive(Clone, Copy)]
struct Element<'n, 'i> {
    node: Node<'n, 'i>,
    joint_type: JointType,
    axis: Vec3,
    anchor: Vec3,
}

/// The kind of the one scene joint that is equivalent to these joint elements, if there is one.
fn single_joint_kind(elements: &[Element]) -> Option<Kind> {
    match *elements {
        [Element { joint_type: JointType::Hinge, axis, .. }] => Some(Kind::Hinge(axis)),
        [Element { joint_type: JointType::Slide, axis, .. }] => Some(Kind::Slide(axis)),
        [Element { joint_type: JointType::Ball, .. }] => Some(Kind::Ball),
        [Element { joint_type: JointType::Free, .. }] => Some(Kind::Free),
        [a, b] => {
            let cosine = a.axis.dot(&b.axis).abs();
            match (a.joint_type, b.joint_type) {
                (JointType::Hinge, JointType::Slide) | (JointType::Slide, JointType::Hinge) if cosine > PARALLEL => {
                    Some(Kind::Cylindrical(a.axis))
                }
                (JointType::Hinge, JointType::Hinge)
                    if cosine < PERPENDICULAR && (a.anchor - b.anchor).norm() < 1e-9 =>
                {
                    Some(Kind::Universal(a.axis, b.axis))
                }
                _ => None,
            }
        }
        _ => None,
    }
}

impl<'n, 'i> Model<'_, 'n, 'i> {
    /// Adds the body `body` with the joints `nodes`, at `pose` in `carrier`, and returns its index. Hinges and slides without an
    /// equivalent scene joint become a chain of joints between massless bodies, in MuJoCo's order.
    pub(super) fn add_jointed_body(
        &mut self,
        body: Node<'n, 'i>,
        nodes: &[Node<'n, 'i>],
        class: &str,
        carrier: Option<usize>,
        pose: &Pose,
    ) -> Result<usize, Failure> {
        let line = self.source.line(body);
        let name = body.attribute("name");
        let name = name.map_or_else(|| format!("body{}", self.description.bodies.len() + 1), str::to_owned);
        let mut elements = Vec::new();
        for &node in nodes {
            elements.push(self.element(node, class)?);
        }
        let series: Vec<(Kind, &[Element])> = match single_joint_kind(&elements) {
            Some(kind) => vec![(kind, &elements)],
            None => elements.chunks(1).filter_map(|one| Some((single_joint_kind(one)?, one))).collect(),
        };
        let is_only_joint = |kind: &Kind| matches!(kind, Kind::Ball | Kind::Free);
        if series.len() > 1 && series.iter().any(|(kind, _)| is_only_joint(kind)) {
            let message =
                "a ball or free joint is the only joint of its body in a scene: insert a body with mass between them";
            return Err(self.source.error(body, message));
        }
        if carrier.is_some() && series.iter().any(|(kind, _)| *kind == Kind::Free) {
            return Err(self.source.error(body, "only a child of the world can have a free joint"));
        }
        let (mut parent, mut at) = (carrier, *pose);
        for (number, (kind, elements)) in (1..).zip(&series) {
            let index = self.description.bodies.len();
            let first = elements[0].node;
            let own = first.attribute("name");
            let body_name = match own {
                _ if number == series.len() => name.clone(),
                Some(own) => own.to_owned(),
                None => format!("{name}_{number}"),
            };
            self.description.bodies.push(Body::new(&body_name, line));
            let springs = self.springs(elements, class, *kind)?;
            // The anchor of a cylindrical joint is that of its hinge.
            let anchor =
                elements.iter().find(|element| element.joint_type == JointType::Hinge).unwrap_or(&elements[0]).anchor;
            let anchor = if *kind == Kind::Free { Vec3::zeros() } else { anchor };
            let name = own.unwrap_or(&body_name).to_owned();
            let line = self.source.line(first);
            self.description.joints.push(Joint {
                name,
                kind: *kind,
                parent,
                child: index,
                pose: at,
                anchor,
                springs,
                line,
            });
            (parent, at) = (Some(index), Pose::identity());
        }
        Ok(self.description.bodies.len() - 1)
    }

    fn element(&mut self, node: Node<'n, 'i>, class: &str) -> Result<Element<'n, 'i>, Failure> {
        let word = match node.tag_name().name() {
            "freejoint" => "free",
            _ => self.attribute(node, class, "type").unwrap_or("hinge"),
        };
        let allowed =
            || self.source.error(node, &format!("type = \"{word}\": allowed: {}", JointType::WORDS.join(", ")));
        let joint_type = JointType::of_word(word).ok_or_else(allowed)?;
        let axis = self.numbers(node, class, "axis")?.map_or_else(Vec3::z, Vec3::from);
        let axis = axis.try_normalize(1e-12).ok_or_else(|| self.source.error(node, "axis has no direction"))?;
        let anchor = self.numbers(node, class, "pos")?.map_or_else(Vec3::zeros, Vec3::from);
        self.omit_unknown_attributes(node, &KNOWN_ATTRIBUTES);
        let line = self.source.line(node);
        for key in ["armature", "frictionloss", "ref"] {
            if self.attribute(node, class, key).is_some_and(|value| value.trim() != "0") {
                self.description.omit(line, format!("{key} of <joint>"));
            }
        }
        if self.attribute(node, class, "range").is_some() {
            self.description.omit(line, "range of a joint: a [[stop]] needs its stiffness, too");
        }
        Ok(Element { node, joint_type, axis, anchor })
    }

    /// Springs and dampers of the elements of one joint.
    fn springs(&mut self, elements: &[Element<'n, 'i>], class: &str, kind: Kind) -> Result<Vec<Spring>, Failure> {
        let mut springs = Vec::new();
        for (at, &Element { node, joint_type, axis, .. }) in elements.iter().enumerate() {
            let (stiffness, damping) = (self.number(node, class, "stiffness")?, self.number(node, class, "damping")?);
            if stiffness == 0.0 && damping == 0.0 {
                continue;
            }
            if matches!(joint_type, JointType::Ball | JointType::Free) {
                self.description.omit(self.source.line(node), format!("stiffness and damping of a {joint_type} joint"));
                continue;
            }
            let is_angle = joint_type == JointType::Hinge;
            let coordinate = match (kind, is_angle, at) {
                (Kind::Cylindrical(_), true, _) | (Kind::Universal(..), _, 0) => Some("angle"),
                (Kind::Cylindrical(_), false, _) => Some("position"),
                (Kind::Universal(..), ..) => Some("child_angle"),
                _ => None,
            };
            // The axis of a cylindrical joint is that of its first element; the second may point the other way.
            let sign = match kind {
                Kind::Cylindrical(first) => first.dot(&axis).signum(),
                _ => 1.0,
            };
            // The scene's coordinate is 0 where MuJoCo's is `ref`.
            let rest = self.number(node, class, "springref")? - self.number(node, class, "ref")?;
            let rest = sign * rest * if is_angle { self.angle_unit } else { 1.0 };
            springs.push(Spring { coordinate, is_angle, stiffness, damping, rest });
        }
        Ok(springs)
    }
}
