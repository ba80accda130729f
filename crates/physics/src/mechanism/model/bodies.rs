//! The bodies of a machine along its trees: a body for each of the scene, and a massless link inside each joint of two degrees of
//! freedom.

use super::{Anchor, Body, BodyIndex, DriveLaw, Motion, Pair};
use crate::machine::{self, Drive, Freedom, Joint, JointKind, Machine, Mat3, Vec3};
use crate::mechanism::drives::trajectory_of;

/// No tree: a body that moves with the drives alone.
const NO_ROOT: BodyIndex = usize::MAX;

/// Bodies, parents first in `order`. Coordinates are not numbered yet.
#[derive(Default)]
pub(super) struct BodyTrees {
    /// Those of the scene, then the links.
    pub bodies: Vec<Body>,
    pub drives: Vec<DriveLaw>,
    pub two_degree_joints: Vec<Pair>,
    pub order: Vec<BodyIndex>,
    /// The uppermost body of each body's tree whose motion does not depend on time alone, if any.
    pub root: Vec<BodyIndex>,
    links: Vec<Body>,
    world: BodyIndex,
}

impl BodyTrees {
    /// Those of `machine`.
    pub fn of(machine: &Machine) -> Self {
        let has_two_degrees = |joint: &&Joint| joint.kind.freedoms().len() == 2;
        let world = machine.bodies.len() + machine.joints.iter().filter(has_two_degrees).count();
        let mut trees = Self { root: vec![NO_ROOT; world], world, ..Self::default() };
        for (index, (body, joint)) in machine.bodies.iter().zip(&machine.joints).enumerate() {
            trees.add(machine, index, body, joint);
        }
        trees.bodies.append(&mut trees.links);
        trees
    }

    /// The motion along `freedom` of body `body`. Free coordinates are numbered later, tree by tree.
    fn motion(&mut self, freedom: Freedom, drive: Option<&Drive>, body: BodyIndex) -> Motion {
        let revolute = freedom.turns();
        match drive {
            Some(drive) => {
                self.drives.push(DriveLaw { trajectory: trajectory_of(drive, revolute), body });
                Motion::Driven { drive: self.drives.len() - 1, revolute }
            }
            None if revolute => Motion::Revolute { q: 0, v: 0 },
            None => Motion::Prismatic { q: 0, v: 0 },
        }
    }

    /// Enters the root of `body`, below one whose root is `above`; returns it.
    fn place(&mut self, body: BodyIndex, above: BodyIndex, motion: &Motion) -> BodyIndex {
        self.root[body] = match motion {
            _ if above != NO_ROOT => above,
            Motion::Fixed | Motion::Driven { .. } => NO_ROOT,
            _ => body,
        };
        self.root[body]
    }

    fn add(&mut self, machine: &Machine, index: BodyIndex, body: &machine::Body, joint: &Joint) {
        let parent = joint.parent.unwrap_or(self.world);
        let parent_centre = joint.parent.map_or(Vec3::zeros(), |p| machine.bodies[p].centre);
        let (mut link_motion, link) = (None, machine.bodies.len() + self.links.len());
        let motion = match *joint.kind.freedoms() {
            [only] => self.motion(only, joint.drive.as_ref(), index),
            [first, second] => {
                link_motion = Some(self.motion(first, joint.drive.as_ref(), link));
                self.motion(second, joint.second_drive.as_ref(), index)
            }
            _ if joint.kind == JointKind::Fixed => Motion::Fixed,
            _ => Motion::Free { q: 0, v: 0 },
        };
        let mut above = if parent == self.world { NO_ROOT } else { self.root[parent] };
        if let Some(motion) = &link_motion {
            above = self.place(link, above, motion);
        }
        let moves_freely = self.place(index, above, &motion) != NO_ROOT;
        if parent != self.world && moves_freely {
            self.bodies[parent].has_moving_child = true;
        }
        let rest = joint.rotation.to_rotation_matrix().into_inner();
        let from_parent = joint.parent_point - parent_centre;
        let to_centroid = body.centre - joint.child_point;
        let (mut parent_or_link, mut from, mut axis) = (parent, from_parent, joint.axis);
        if let Some(motion) = link_motion {
            let child = Anchor { body: index, offset: -to_centroid };
            let of_parent = Anchor { body: parent, offset: from_parent };
            self.two_degree_joints.push(Pair::new(joint, child, of_parent));
            self.links.push(Body {
                driven_only: self.root[link] == NO_ROOT,
                has_moving_child: moves_freely,
                ..link_of(joint, motion, parent, from_parent)
            });
            self.order.push(link);
            (parent_or_link, from) = (link, Vec3::zeros());
            if joint.kind == JointKind::Universal {
                axis = joint.rotation * joint.child_axis;
            }
        }
        self.order.push(index);
        let turns = match motion {
            Motion::Driven { revolute, .. } => revolute,
            _ => matches!(motion, Motion::Revolute { .. }),
        };
        let [fixed, cosine, sine] = rotation_parts(&axis, rest, turns);
        let inertia = body.inertia;
        self.bodies.push(Body {
            mass: body.mass,
            inertia,
            inertia_inverse: inertia.try_inverse().unwrap_or_else(Mat3::zeros),
            parent: parent_or_link,
            motion,
            from_parent: from,
            to_centroid,
            axis,
            fixed,
            cosine,
            sine,
            origin: -body.centre,
            driven_only: !moves_freely,
            has_moving_child: false,
            diagonal: inertia == Mat3::from_diagonal(&inertia.diagonal()),
        });
    }
}

/// Relative rotation of a joint for coordinate q in constant, cosine and sine parts: Rot(axis, q) R0 =
/// (a a^T + cos q (1 - a a^T) + sin q [a]x) R0 if it `turns`, else R0.
fn rotation_parts(axis: &Vec3, rest: Mat3, turns: bool) -> [Mat3; 3] {
    if !turns {
        return [rest, Mat3::zeros(), Mat3::zeros()];
    }
    let along = axis * axis.transpose();
    [along * rest, (Mat3::identity() - along) * rest, axis.cross_matrix() * rest]
}

/// The massless link of a two-degree joint: on the slide of a cylindrical joint or the first hinge of a universal joint, whose
/// motion is `motion`.
fn link_of(joint: &Joint, motion: Motion, parent: BodyIndex, from_parent: Vec3) -> Body {
    let slides = joint.kind == JointKind::Cylindrical;
    let [fixed, cosine, sine] = rotation_parts(&joint.axis, Mat3::identity(), !slides);
    Body {
        mass: 0.0,
        inertia: Mat3::zeros(),
        inertia_inverse: Mat3::zeros(),
        parent,
        motion,
        from_parent,
        to_centroid: Vec3::zeros(),
        axis: joint.axis,
        fixed,
        cosine,
        sine,
        origin: Vec3::zeros(),
        driven_only: false,
        has_moving_child: true,
        diagonal: true,
    }
}
