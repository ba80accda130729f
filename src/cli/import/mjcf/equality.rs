//! `<equality>`: the ball joints that close loops.

use roxmltree::Node;

use super::super::description::{Closure, Place};
use super::Model;
use crate::cli::Failure;
use crate::machine::Vec3;

/// A point of a moving body, m, or of the world.
type Point = (Option<usize>, Vec3);

impl<'n, 'i> Model<'_, 'n, 'i> {
    /// Reads `<connect>`, between two sites or at an anchor on the first of two bodies.
    pub(super) fn equality(&mut self, section: Node<'n, 'i>) -> Result<(), Failure> {
        let poses = self.found.poses();
        for node in section.children().filter(Node::is_element) {
            if !node.has_tag_name("connect") || node.attribute("active") == Some("false") {
                self.found.leave_out(self.source.line(node), format!("<{}> of <equality>", node.tag_name().name()));
                continue;
            }
            let ends = if node.attribute("site1").is_some() {
                [self.site(node, "site1")?, self.site(node, "site2")?]
            } else {
                self.anchored(node, &poses)?
            };
            let name = node
                .attribute("name")
                .map_or_else(|| format!("connect{}", self.found.closures.len() + 1), str::to_owned);
            self.found.closures.push(Closure { name, bodies: ends.map(|end| end.0), points: ends.map(|end| end.1) });
        }
        Ok(())
    }

    /// The site that `key` names.
    fn site(&mut self, node: Node<'n, 'i>, key: &str) -> Result<Point, Failure> {
        let name = self.source.require(node, key)?;
        let site = self.sites.get_mut(name).ok_or_else(|| self.source.error_in(node, key, "there is no such site"))?;
        site.connected = true;
        Ok(site.point)
    }

    /// The anchor on both bodies, where all coordinates are 0; `poses` are those of the bodies.
    fn anchored(&self, node: Node<'n, 'i>, poses: &[Place]) -> Result<[Point; 2], Failure> {
        self.source.require(node, "body1")?;
        self.source.require(node, "anchor")?;
        let anchor = self.source.numbers(node, "anchor")?.map_or_else(Vec3::zeros, Vec3::from);
        let find = |key: &str| match node.attribute(key) {
            None | Some("world") => Ok((None, Place::identity())),
            Some(name) => {
                let found = self.bodies.get(name).copied();
                found.ok_or_else(|| self.source.error_in(node, key, "there is no such body"))
            }
        };
        let ((first, place), (second, _)) = (find("body1")?, find("body2")?);
        let pose = |body: Option<usize>| body.map_or_else(Place::identity, |body| poses[body]);
        let point = place.point(anchor);
        let there = pose(first).point(point);
        let other = pose(second);
        Ok([(first, point), (second, other.rotation.inverse() * (there - other.position))])
    }
}
