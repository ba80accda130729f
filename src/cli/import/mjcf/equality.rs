//! `<equality>`: the joints that close loops.

use roxmltree::Node;

use super::super::description::{Closure, Pose};
use super::{Model, quaternion};
use crate::cli::Failure;
use crate::machine::Vec3;

/// A frame on a moving body, or on the world.
type Frame = (Option<usize>, Pose);

impl<'n, 'i> Model<'_, 'n, 'i> {
    /// Reads `<connect>` and `<weld>`, between two sites or at an anchor on one of two bodies.
    pub(super) fn equality(&mut self, section: Node<'n, 'i>) -> Result<(), Failure> {
        let poses = self.description.poses();
        for node in section.children().filter(Node::is_element) {
            let (tag, line) = (node.tag_name().name(), self.source.line(node));
            if !["connect", "weld"].contains(&tag) || node.attribute("active") == Some("false") {
                self.description.omit(line, format!("<{tag}> of <equality>"));
                continue;
            }
            let ends = if node.attribute("site1").is_some() {
                [self.site(node, "site1")?, self.site(node, "site2")?]
            } else {
                self.anchored_frames(node, &poses)?
            };
            let (bodies, frames) = (ends.map(|end| end.0), ends.map(|end| end.1));
            if bodies[0] == bodies[1] {
                return Err(self.source.error(node, "both ends are on one body, or on the world"));
            }
            let number = self.description.closures.len() + 1;
            let name = node.attribute("name").map_or_else(|| format!("{tag}{number}"), str::to_owned);
            // With a torque scale of 0, a weld holds only points together.
            let is_fixed = tag == "weld" && self.source.number(node, "torquescale")? != Some(0.0);
            self.description.closures.push(Closure { name, bodies, frames, is_fixed, line });
        }
        Ok(())
    }

    /// The site that `key` names.
    fn site(&mut self, node: Node<'n, 'i>, key: &str) -> Result<Frame, Failure> {
        let name = self.source.require(node, key)?;
        let site = self.sites.get_mut(name).ok_or_else(|| self.source.error_in(node, key, "there is no such site"))?;
        site.is_connected = true;
        Ok(site.at)
    }

    /// The common frame on both bodies; `poses` are those of the moving bodies where all coordinates are 0. The anchor of `<connect>` is
    /// a point of the first body, that of `<weld>` one of the second.
    fn anchored_frames(&self, node: Node<'n, 'i>, poses: &[Pose]) -> Result<[Frame; 2], Failure> {
        let is_weld = node.has_tag_name("weld");
        self.source.require(node, "body1")?;
        if !is_weld {
            self.source.require(node, "anchor")?;
        }
        let anchor = self.source.numbers(node, "anchor")?.map_or_else(Vec3::zeros, Vec3::from);
        let find = |key: &str| match node.attribute(key) {
            None | Some("world") => Ok((None, Pose::identity())),
            Some(name) => {
                let body = self.bodies.get(name).copied();
                body.ok_or_else(|| self.source.error_in(node, key, "there is no such body"))
            }
        };
        let ((first, one), (second, other)) = (find("body1")?, find("body2")?);
        let relative = self.source.numbers::<7>(node, "relpose")?.filter(|_| is_weld);
        let relative = relative.and_then(|[x, y, z, a, b, c, d]| Some((Vec3::new(x, y, z), quaternion([a, b, c, d])?)));
        if let Some((position, rotation)) = relative {
            let of_first = one.compose(&Pose { position, rotation });
            return Ok([(first, of_first), (second, Pose { position: other.point(anchor), ..other })]);
        }
        // A frame with the world's axes.
        let pose = |body: Option<usize>| body.map_or_else(Pose::identity, |body| poses[body]);
        let anchor_in_world =
            if is_weld { pose(second).compose(&other) } else { pose(first).compose(&one) }.point(anchor);
        let common = Pose { position: anchor_in_world, ..Pose::identity() };
        Ok([first, second].map(|body| (body, pose(body).inverse().compose(&common))))
    }
}
