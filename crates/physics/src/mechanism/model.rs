//! A scene compiled for the equations of motion: centroid frames, coordinate numbering, trees, drives.

mod bodies;

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use super::assembly::{Assembled, Settled};
use super::drives::{Law, Trajectory};
use super::factor::{NONE, Pattern};
use super::kinematics::Kinematics;
use super::loose::{Compiled, Stiffness, Wall, drop_implied};
use super::pairs::{Cut, Opening};
use crate::expression::Tape;
use crate::jet::Jet;
use crate::machine::{
    Attachment, ClosedForm, Joint, JointKind, JointStart, LooseKind, Machine, Mat3, Path, Pin, Quat, StartRule, Vec3,
};
use bodies::BodyTrees;

/// Index of a body: the scene's bodies, then massless links; one past the last is the world.
pub type BodyIndex = usize;

/// A body in its centroid frame: axes of the scene's body frame, origin at the centroid.
///
/// A joint of two degrees of freedom is compiled as two joints of one degree in series, connected by a massless link. The link's
/// frame is at the joint point, with the parent's axes at coordinate 0.
#[derive(Clone, Debug)]
pub struct Body {
    pub mass: f64,
    /// Inertia about the centroid, body axes, kg m^2.
    pub inertia: Mat3,
    pub(crate) inertia_inverse: Mat3,
    /// Parent body, or the world's index.
    pub parent: BodyIndex,
    pub motion: Motion,
    /// Joint point from the parent's centroid, parent axes (world: absolute), m.
    pub(crate) from_parent: Vec3,
    /// Centroid from the joint point, body axes, m.
    pub(crate) to_centroid: Vec3,
    /// Joint axis, parent axes.
    pub axis: Vec3,
    /// Relative rotation = `fixed` + cos q `cosine` + sin q `sine` (`fixed` alone unless revolute).
    pub fixed: Mat3,
    pub cosine: Mat3,
    pub sine: Mat3,
    /// Origin of the scene's body frame from the centroid, body axes, m.
    pub origin: Vec3,
    /// Whether its motion depends on time alone.
    pub(crate) driven_only: bool,
    /// Whether it has a child whose motion does not depend on time alone.
    pub(crate) has_moving_child: bool,
    /// Whether the inertia is diagonal in body axes.
    pub diagonal: bool,
}

/// Motion of a body relative to its parent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    Fixed,
    /// Prescribed by drive `drive`.
    Driven {
        drive: usize,
        revolute: bool,
    },
    /// One coordinate.
    Prismatic {
        q: usize,
        v: usize,
    },
    /// One coordinate.
    Revolute {
        q: usize,
        v: usize,
    },
    /// Centroid position and quaternion (w, x, y, z) from q; centroid velocity and angular velocity from v.
    Free {
        q: usize,
        v: usize,
    },
}

/// A set of bodies whose coordinates couple through the mass matrix.
#[derive(Clone, Debug)]
pub struct TreeBlock {
    /// First velocity coordinate.
    pub v: usize,
    /// Number of velocity coordinates.
    pub n: usize,
    /// Which of its coordinates couple.
    pub pattern: Pattern,
    /// The free body of this block if it is the only one: the mass matrix is then block diagonal.
    pub(crate) single_free_body: Option<BodyIndex>,
}

/// A point fixed to a body.
#[derive(Clone, Copy, Debug)]
pub struct Anchor {
    pub body: BodyIndex,
    /// From the body's centroid, body axes, m (world: absolute).
    pub offset: Vec3,
}

/// A point of a body with axes, body axes.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    pub origin: Anchor,
    pub axes: [Vec3; 3],
}

/// A cut joint that may have play.
#[derive(Clone, Debug)]
pub struct LooseJoint {
    /// Origins of the frames of the carrier and of the carried part.
    pub carrier: Anchor,
    pub carried: Anchor,
    /// The joint without play.
    pub closed: Cut,
    /// Index among the ideal joints; `None` with clearance.
    pub ideal: Option<usize>,
    /// Its contacts; none if it is ideal.
    pub contacts: Range<ContactId>,
}

/// Number of a contact among those of all joints.
pub type ContactId = usize;

/// Where the bodies of a loose joint can touch: a point of one touches a wall of the other.
#[derive(Clone, Copy, Debug)]
pub struct Site {
    /// Index among the loose joints.
    pub joint: usize,
    /// Point of the body with the wall.
    pub carrier: Anchor,
    /// The point that touches it.
    pub carried: Anchor,
    pub wall: Wall,
    /// Index of its play among [`Parameters::clearances`](crate::contact::Parameters::clearances).
    pub play: usize,
    pub stiffness: Stiffness,
    /// Whether the wall belongs to the carried part of the joint.
    pub is_reversed: bool,
    /// Index among [`LooseKind::site_names`](crate::machine::LooseKind::site_names); 0 for a kind with one site.
    pub place: u8,
}

/// A joint between two bodies, in the tree or closing a loop.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    pub kind: JointKind,
    /// Joint points.
    pub child: Anchor,
    pub parent: Anchor,
    /// Joint axis and two directions perpendicular to it, in the parent's axes.
    pub axes: [Vec3; 3],
    /// The same directions at zero coordinates, in the child's axes.
    pub(crate) child_axes: [Vec3; 3],
    /// Second axis of a universal joint, child axes.
    pub second: Vec3,
}

impl Pair {
    /// Pair of this kind whose axis is the x axis of both frames.
    pub fn of_frames(kind: JointKind, [parent, child]: &[Frame; 2]) -> Self {
        let second = Vec3::zeros();
        Self { kind, child: child.origin, parent: parent.origin, axes: parent.axes, child_axes: child.axes, second }
    }

    /// Pair for `joint` between these points.
    pub fn new(joint: &Joint, child: Anchor, parent: Anchor) -> Self {
        let x = joint.axis;
        let across = if x.x.abs() < 0.7 { Vec3::x() } else { Vec3::y() };
        let y = x.cross(&across).normalize();
        let axes = [x, y, x.cross(&y)];
        Self {
            kind: joint.kind,
            child,
            parent,
            axes,
            child_axes: axes.map(|axis| joint.rotation.inverse() * axis),
            second: joint.child_axis,
        }
    }
}

/// A driven coordinate.
#[derive(Clone, Debug)]
pub struct DriveLaw {
    pub trajectory: Trajectory,
    pub body: BodyIndex,
}

/// The compiled scene.
#[derive(Clone, Debug)]
pub struct Model {
    pub bodies: Vec<Body>,
    /// Number of bodies from the scene; the rest are massless links.
    pub(crate) massive: usize,
    /// All bodies, parents before children, and the position of each in that order.
    pub order: Vec<BodyIndex>,
    pub(crate) order_index: Vec<usize>,
    /// Joints of two degrees of freedom, by link.
    pub(crate) two_degree_joints: Vec<Pair>,
    /// Joints that close loops.
    pub(crate) closures: Vec<Pair>,
    /// Number of position coordinates.
    pub nq: usize,
    /// Number of velocity coordinates.
    pub nv: usize,
    pub blocks: Vec<TreeBlock>,
    /// Block of each body; unspecified for a body without coordinates.
    pub block_of: Vec<usize>,
    pub joints: Vec<LooseJoint>,
    pub ideal_joints: Vec<usize>,
    /// Contacts of the loose joints, in their order.
    pub sites: Vec<Site>,
    /// What loose joints with play do not leave free, each with the index of its joint.
    pub lasting: Vec<(usize, Cut)>,
    /// Pins with a travel, by their joints, each with its axis in the carrier's body.
    pub travelling: Vec<(usize, Vec3)>,
    pub drives: Vec<DriveLaw>,
    pub closed_form: Option<ClosedForm>,
    /// Functions of the closed form, for evaluation at every instant.
    pub functions: Tape,
    /// Indices of the closed form's values that the drives and the path of the output body use.
    pub(crate) required_values: Vec<usize>,
    pub start: StartRule,
    /// Position and velocity coordinates at t = 0 as specified in the scene.
    pub(crate) start_state: Vec<f64>,
    /// Factor on the tolerance for each coordinate of (q, v).
    pub scale: Vec<f64>,
    /// Length from which the position scales are derived, m.
    pub length_scale: f64,
    /// Scale of the rotation of each body of the scene as a free body, rad.
    pub(crate) spin_scales: Vec<f64>,
    /// Bound on the distance from the origin of every point of the machine with all coordinates at zero, m.
    pub extent: f64,
    pub(crate) output_body: BodyIndex,
    /// Probe tip from the output body's centroid, body axes.
    pub probe: Option<Vec3>,
    /// Shortest period of oscillation of a drive, s; infinite if none oscillates.
    pub shortest_period: f64,
    /// Drive laws that bound steps.
    pub bounding: Vec<Arc<dyn Law>>,
    /// State and assembly of a settled start or one in equilibrium, if the machine has such a rule.
    pub(super) settled: Option<Settled>,
    /// Result of assembly, once [`start`](super::Mechanism::start) has been called.
    pub(super) assembled: OnceLock<Assembled>,
}

impl Model {
    /// Compiles `machine`.
    pub fn new(machine: &Machine) -> Self {
        let BodyTrees { bodies, drives, two_degree_joints, order, root, .. } = BodyTrees::of(machine);
        let (massive, world) = (machine.bodies.len(), bodies.len());
        let mut order_index = vec![0; world];
        for (at, &body) in order.iter().enumerate() {
            order_index[body] = at;
        }

        let periods = drives.iter().map(|driven| driven.trajectory.shortest_period(machine));
        let shortest_period = periods.fold(f64::INFINITY, f64::min);
        let laws = drives.iter().filter_map(|driven| driven.trajectory.law());
        let driving_functions = drives.iter().filter_map(|driven| match driven.trajectory {
            Trajectory::Function(function) => Some(function + 1),
            Trajectory::Own(_) => None,
        });
        let path = machine.closed_form.as_ref().and_then(|form| form.path.as_ref());
        let mut required_values: Vec<usize> =
            driving_functions.chain(path.into_iter().flat_map(Path::variables)).collect();
        required_values.sort_unstable();
        required_values.dedup();
        let bounding = laws.filter(|law| law.bounds_steps()).cloned().collect();
        let mut model = Self {
            bodies,
            massive,
            order,
            order_index,
            two_degree_joints,
            closures: Vec::new(),
            nq: 0,
            nv: 0,
            blocks: Vec::new(),
            block_of: vec![0; world],
            joints: Vec::new(),
            ideal_joints: Vec::new(),
            sites: Vec::new(),
            lasting: Vec::new(),
            travelling: Vec::new(),
            drives,
            closed_form: machine.closed_form.clone(),
            required_values,
            functions: machine.closed_form.as_ref().map_or_else(Tape::default, ClosedForm::tape),
            start: machine.start,
            start_state: Vec::new(),
            scale: Vec::new(),
            length_scale: machine.length_scale(),
            spin_scales: Vec::new(),
            extent: 0.0,
            output_body: machine.output.body,
            probe: machine.output.probe.map(|p| p - machine.bodies[machine.output.body].centre),
            shortest_period,
            settled: None,
            assembled: OnceLock::new(),
            bounding,
        };
        model.number_coordinates(machine, &root);
        model.cut_joints(machine);
        drop_implied(&mut model, machine);
        let own_reaches = model.own_reaches(machine, |_| Vec3::zeros());
        model.spin_scales = own_reaches[..massive].iter().map(|reach| model.angle_scale(*reach)).collect();
        model.extent = model.distances().fold(0.0, f64::max);
        model
    }

    /// Compiles the joints that are cut: loose joints with their contacts, and joints that close loops.
    fn cut_joints(&mut self, machine: &Machine) {
        for (index, joint) in machine.loose_joints.iter().enumerate() {
            let frames = joint.frames.map(|frame| Frame {
                origin: self.anchor(machine, &frame.origin),
                axes: [Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| frame.rotation * axis),
            });
            let Compiled { closed, lasting, sites } =
                joint.kind.compile(index, &frames, joint.contact.clearances().map(|clearance| clearance > 0.0));
            let ideal = joint.contact.is_ideal().then(|| {
                self.ideal_joints.push(index);
                self.ideal_joints.len() - 1
            });
            let first = self.sites.len();
            if ideal.is_none() {
                self.sites.extend(sites);
                self.lasting.extend(lasting.map(|cut| (index, cut)));
            }
            let contacts = first..self.sites.len();
            let [carrier, carried] = frames.map(|frame| frame.origin);
            if matches!(joint.kind, LooseKind::Pin(Pin { travel: Some(_), .. })) {
                self.travelling.push((index, frames[0].axes[0]));
            }
            self.joints.push(LooseJoint { carrier, carried, closed, ideal, contacts });
        }
        for joint in &machine.closing_joints {
            let [parent, child] = joint.points().map(|point| self.anchor(machine, &point));
            self.closures.push(Pair::new(joint, child, parent));
        }
    }

    /// Bounds on the distances of the anchors of cut joints, and of all centroids, from the origin with all coordinates at zero,
    /// m.
    fn distances(&self) -> impl Iterator<Item = f64> {
        // The world, the last, has no offset.
        let mut centroids = vec![0.0; self.bodies.len() + 1];
        for &b in &self.order {
            let body = &self.bodies[b];
            centroids[b] = centroids[body.parent] + body.from_parent.norm() + body.to_centroid.norm();
        }
        let balls = self.joints.iter().flat_map(|joint| [joint.carrier, joint.carried]);
        let closures = self.closures.iter().flat_map(|pair| [pair.child, pair.parent]);
        let anchors: Vec<f64> = balls.chain(closures).map(|at| centroids[at.body] + at.offset.norm()).collect();
        anchors.into_iter().chain(centroids)
    }

    /// The two-degree joint whose link or child is body `b`, and which of its coordinates moves `b`.
    pub(crate) fn two_degree_joint_at(&self, b: BodyIndex) -> Option<(&Pair, usize)> {
        let link = |b: BodyIndex| self.two_degree_joints.get(b.checked_sub(self.massive)?);
        let own = link(b).map(|pair| (pair, 0));
        own.or_else(|| Some((link(self.bodies[b].parent)?, 1)))
    }

    /// Coordinate and rate at t = 0 of the one-degree joint above body `b`, as specified in the scene.
    fn start_of(&self, machine: &Machine, b: BodyIndex) -> [f64; 2] {
        let (joint, part) = match self.two_degree_joint_at(b) {
            Some((pair, part)) => (pair.child.body, part),
            None => (b, 0),
        };
        match machine.joints[joint].start {
            JointStart::Scalar { position, velocity } => [position, velocity],
            JointStart::Pair { position, velocity } => [position[part], velocity[part]],
            JointStart::Pose { .. } => [0.0, 0.0],
        }
    }

    /// Anchor of a point of `machine`.
    pub fn anchor(&self, machine: &Machine, point: &Attachment) -> Anchor {
        Anchor {
            body: point.body.unwrap_or(self.bodies.len()),
            offset: point.body.map_or(point.point, |b| point.point - machine.bodies[b].centre),
        }
    }

    /// Numbers the coordinates tree by tree, so that those of a tree are contiguous, and sets start state and scales.
    fn number_coordinates(&mut self, machine: &Machine, root: &[usize]) {
        let (length, speed) = (self.length_scale, self.speed_scale());
        let reaches = self.reaches(machine);
        let mut start_q: Vec<f64> = Vec::new();
        let mut start_v: Vec<f64> = Vec::new();
        let mut scale_q: Vec<f64> = Vec::new();
        let mut scale_v: Vec<f64> = Vec::new();
        let mut trees: Vec<Vec<BodyIndex>> = Vec::new();
        for &b in &self.order {
            let root = root[b];
            if root == b {
                self.block_of[b] = trees.len();
                trees.push(vec![b]);
            } else if root != usize::MAX {
                self.block_of[b] = self.block_of[root];
                trees[self.block_of[b]].push(b);
            }
        }
        // Last coordinate within its tree on the path from the root to each body.
        let mut last = vec![NONE; self.bodies.len()];
        for bodies in trees {
            let (tree, count) = (bodies[0], bodies.len());
            let first = start_v.len();
            let mut parent_coordinate = Vec::new();
            for b in bodies {
                let above = if b == tree { NONE } else { last[self.bodies[b].parent] };
                last[b] = above;
                let (q, v) = (start_q.len(), start_v.len());
                let [position, velocity] = self.start_of(machine, b);
                let angle = self.angle_scale(reaches[b]);
                let angular_speed = angle / SPEED_TIME;
                let mut push_coordinate = |length: f64, speed: f64| {
                    start_q.push(position);
                    start_v.push(velocity);
                    scale_q.push(length);
                    scale_v.push(speed);
                    parent_coordinate.push(above);
                };
                match &mut self.bodies[b].motion {
                    Motion::Prismatic { q: at_q, v: at_v } => {
                        (*at_q, *at_v) = (q, v);
                        push_coordinate(length, speed);
                        last[b] = v - first;
                    }
                    Motion::Revolute { q: at_q, v: at_v } => {
                        (*at_q, *at_v) = (q, v);
                        push_coordinate(angle, angular_speed);
                        last[b] = v - first;
                    }
                    Motion::Free { q: at_q, v: at_v } => {
                        (*at_q, *at_v) = (q, v);
                        let (position, rotation, velocity, spin) = free_start(machine.joints[b].start);
                        let centre = rotation * machine.bodies[b].centre;
                        start_q.extend((position + centre).iter());
                        start_q.extend([rotation.w, rotation.i, rotation.j, rotation.k]);
                        start_v.extend((velocity + spin.cross(&centre)).iter());
                        start_v.extend(spin.iter());
                        scale_q.extend([length; 3]);
                        // A quaternion component changes by half the angle.
                        scale_q.extend([0.5 * angle; 4]);
                        scale_v.extend([speed; 3]);
                        scale_v.extend([angular_speed; 3]);
                        for i in 0..6 {
                            parent_coordinate.push(if i == 0 { NONE } else { v - first + i - 1 });
                        }
                        last[b] = v - first + 5;
                    }
                    Motion::Fixed | Motion::Driven { .. } => {}
                }
            }
            let single_free_body =
                (count == 1 && matches!(self.bodies[tree].motion, Motion::Free { .. })).then_some(tree);
            self.blocks.push(TreeBlock {
                v: first,
                n: parent_coordinate.len(),
                pattern: Pattern::new(parent_coordinate),
                single_free_body,
            });
        }
        self.nq = start_q.len();
        self.nv = start_v.len();
        start_q.extend(start_v);
        self.start_state = start_q;
        scale_q.extend(scale_v);
        self.scale = scale_q;
    }

    /// Bound on the distance from each body's joint point, or from the centroid of a free body, of what the joint carries: the
    /// points at which joints and force elements act, the probe, and centroids, m. Without any off the joint point, the radius of
    /// gyration.
    fn reaches(&self, machine: &Machine) -> Vec<f64> {
        let mut reaches = self.own_reaches(machine, |body| match body.motion {
            Motion::Free { .. } => Vec3::zeros(),
            _ => body.to_centroid,
        });
        for &b in self.order.iter().rev() {
            let body = &self.bodies[b];
            if reaches[b] == 0.0 && body.mass > 0.0 {
                reaches[b] = (body.inertia.diagonal().max() / body.mass).sqrt();
            }
            if body.parent < self.bodies.len() {
                let parent = &self.bodies[body.parent];
                let base = if let Motion::Free { .. } = parent.motion { Vec3::zeros() } else { parent.to_centroid };
                let slides = matches!(body.motion, Motion::Prismatic { .. });
                let moved = if slides { self.start_of(machine, b)[0].abs() } else { 0.0 };
                let reach = (base + body.from_parent).norm() + moved + reaches[b];
                reaches[body.parent] = reaches[body.parent].max(reach);
            }
        }
        reaches
    }

    /// The same of the points of each body alone, from a point that is `base` before its centroid, m.
    fn own_reaches(&self, machine: &Machine, base: impl Fn(&Body) -> Vec3) -> Vec<f64> {
        let mut reaches: Vec<f64> = self.bodies.iter().map(|body| base(body).norm()).collect();
        let balls = machine.loose_joints.iter().flat_map(|joint| [joint.carrier(), joint.carried()]);
        let closures = machine.closing_joints.iter().flat_map(Joint::points);
        let elements = machine.elements.iter().flat_map(|element| element.points(machine));
        let points = balls.chain(closures).chain(elements).map(|point| self.anchor(machine, &point));
        let probe = self.probe.map(|offset| Anchor { body: self.output_body, offset });
        for point in points.chain(probe) {
            if let Some(body) = self.bodies.get(point.body) {
                reaches[point.body] = reaches[point.body].max((base(body) + point.offset).norm());
            }
        }
        reaches
    }

    /// Scale of an angle that moves points at `reach` (m), rad: they move by twice the length scale, and by a tenth of the reach
    /// at most.
    fn angle_scale(&self, reach: f64) -> f64 {
        MAX_ANGLE.min(2.0 * self.length_scale / reach)
    }

    /// Scale of speeds, m/s.
    pub(crate) fn speed_scale(&self) -> f64 {
        self.length_scale / SPEED_TIME
    }

    /// What closes loops if the loose joints with these indices have no play: they, then all other joints that close loops, then what
    /// the others with play do not leave free.
    pub fn cuts(&self, joints: &[usize]) -> impl Iterator<Item = Cut> {
        let loose = joints.iter().map(|&j| self.joints[j].closed.clone());
        let lasting = self.lasting.iter().filter(|(j, _)| !joints.contains(j)).map(|(_, cut)| cut.clone());
        loose.chain(self.closures.iter().map(Pair::cut)).chain(lasting)
    }

    /// Violation at `motion` of cut joint `k`, a loose joint as if it had no play, or one that closes a loop, or then what a loose
    /// joint does not leave free.
    pub fn opening(&self, k: usize, motion: &[Kinematics]) -> Opening {
        match (self.joints.get(k), self.closures.get(k.wrapping_sub(self.joints.len()))) {
            (Some(joint), _) => joint.closed.violation(motion, 0),
            (_, Some(pair)) => pair.opening(motion),
            _ => self.lasting[k - self.joints.len() - self.closures.len()].1.violation(motion, 0),
        }
    }

    /// Its rate.
    pub fn opening_rate(&self, k: usize, motion: &[Kinematics]) -> Opening {
        match (self.joints.get(k), self.closures.get(k.wrapping_sub(self.joints.len()))) {
            (Some(joint), _) => joint.closed.violation(motion, 1),
            (_, Some(pair)) => pair.cut().violation(motion, 1),
            _ => self.lasting[k - self.joints.len() - self.closures.len()].1.violation(motion, 1),
        }
    }

    /// Cut joints whose rows close loops, in the order of [`Self::cuts`] of the ideal ones.
    pub fn closed_joints(&self) -> impl Iterator<Item = usize> {
        let others = self.joints.len()..self.joints.len() + self.closures.len() + self.lasting.len();
        self.ideal_joints.iter().copied().chain(others)
    }

    /// Whether any joint closes a loop.
    pub(crate) fn closes_loops(&self) -> bool {
        !self.ideal_joints.is_empty() || !self.closures.is_empty() || !self.lasting.is_empty()
    }

    /// The world's index among bodies.
    pub fn world(&self) -> BodyIndex {
        self.bodies.len()
    }

    /// The path of the output body, if it is known in closed form.
    pub fn path(&self) -> Option<(&ClosedForm, &Path)> {
        let form = self.closed_form.as_ref()?;
        Some((form, form.path.as_ref()?))
    }

    /// Driven coordinate `drive` at `t`, for the `values` of the closed form at that time.
    pub fn drive(&self, drive: usize, t: f64, values: &[Jet]) -> Jet {
        match &self.drives[drive].trajectory {
            Trajectory::Function(function) => values[function + 1],
            Trajectory::Own(law) => law.at(t),
        }
    }

    /// Latest end of an adaptive step that starts at `t`, s, to resolve features of drive laws.
    pub fn step_end(&self, t: f64) -> f64 {
        let ends = self.bounding.iter().map(|law| law.step_end(t));
        ends.fold(f64::INFINITY, f64::min)
    }
}

fn free_start(start: JointStart) -> (Vec3, Quat, Vec3, Vec3) {
    match start {
        JointStart::Pose { position, rotation, velocity, angular_velocity } => {
            (position, rotation, velocity, angular_velocity)
        }
        JointStart::Scalar { .. } | JointStart::Pair { .. } => {
            (Vec3::zeros(), Quat::identity(), Vec3::zeros(), Vec3::zeros())
        }
    }
}

/// Time in which a body moves by the length scale at the speed scale, s.
const SPEED_TIME: f64 = 0.1;
/// Largest scale of an angle, rad.
const MAX_ANGLE: f64 = 0.1;
