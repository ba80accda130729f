//! Joints as constraints between two bodies, in terms of their motion: constraint rows, coordinates and constraint violation. The
//! same in every formulation.

use super::kinematics::Kinematics;
use super::model::{Anchor, Pair};
use crate::jet::Jet;
use crate::machine::{JointKind, Vec3};

/// Constraint rows between a child and a parent.
#[derive(Clone, Copy, Debug)]
pub enum Rows {
    /// Two points coincide: 3 rows, (45) and the first three of (47).
    Point { child: Vec3, parent: Vec3 },
    /// A vector of the child is perpendicular to one of the parent: 1 row, as in (46), (47).
    Perpendicular { child: Vec3, parent: Vec3 },
    /// The child's point lies at `parent + s along`, where s = 0 or the driven coordinate: 1 row, (46) and Phi_D of (48).
    Offset { child: Vec3, parent: Vec3, along: Vec3, drive: Option<usize> },
    /// The angle from the parent's `zero` to the child's `child` about `axis` (fixed in the parent, or in the child if
    /// `in_child`) equals the driven coordinate: 1 row.
    Angle { child: Vec3, zero: Vec3, axis: Vec3, in_child: bool, drive: usize },
}

/// J of one row for its two bodies: (velocity, angular velocity) of the child, then of the parent.
#[derive(Clone, Copy, Default)]
pub(crate) struct JacobianRow {
    pub child: [Vec3; 2],
    pub parent: [Vec3; 2],
}

impl Rows {
    /// Number of rows.
    pub fn count(&self) -> usize {
        if matches!(self, Self::Point { .. }) { 3 } else { 1 }
    }

    /// Whether it constrains orientation rather than points.
    pub fn turns(&self) -> bool {
        matches!(self, Self::Perpendicular { .. } | Self::Angle { .. })
    }

    /// Calls `visit` with each row's number, Jacobian, and violation with its first and second time derivatives, for the motion
    /// of child and parent and the driven coordinates.
    #[inline(always)]
    pub(crate) fn linearise(
        &self,
        c: &Kinematics,
        p: &Kinematics,
        driven: &[Jet],
        mut visit: impl FnMut(usize, JacobianRow, [f64; 3]),
    ) {
        let zero = Vec3::zeros();
        let (wc, wp) = (c.angular_velocity, p.angular_velocity);
        match *self {
            Self::Point { child, parent } => {
                let (dc, dp) = (c.rotation * child, p.rotation * parent);
                let phi = (c.position + dc) - (p.position + dp);
                let rate = c.point_velocity(&dc) - p.point_velocity(&dp);
                let acceleration = c.point_acceleration(&dc) - p.point_acceleration(&dp);
                for i in 0..3 {
                    let mut e = zero;
                    e[i] = 1.0;
                    let row = JacobianRow { child: [e, dc.cross(&e)], parent: [-e, e.cross(&dp)] };
                    visit(i, row, [phi[i], rate[i], acceleration[i]]);
                }
            }
            Self::Perpendicular { child, parent } => {
                let (a, b) = (c.rotation * child, p.rotation * parent);
                let cross = a.cross(&b);
                let relative = wc - wp;
                let turning = wc.cross(&a).cross(&b) + a.cross(&wp.cross(&b));
                let acceleration =
                    (c.angular_acceleration - p.angular_acceleration).dot(&cross) + relative.dot(&turning);
                let row = JacobianRow { child: [zero, cross], parent: [zero, -cross] };
                visit(0, row, [a.dot(&b), relative.dot(&cross), acceleration]);
            }
            Self::Offset { child, parent, along, drive } => {
                let (dc, dp, b) = (c.rotation * child, p.rotation * parent, p.rotation * along);
                let f = drive.map_or(Jet::default(), |d| driven[d]);
                let d = (c.position + dc) - (p.position + dp);
                let d1 = c.point_velocity(&dc) - p.point_velocity(&dp);
                let d2 = c.point_acceleration(&dc) - p.point_acceleration(&dp);
                let b1 = wp.cross(&b);
                let b2 = p.angular_acceleration.cross(&b) + wp.cross(&b1);
                let phi = b.dot(&d) - f.value;
                let rate = b1.dot(&d) + b.dot(&d1) - f.rate;
                let acceleration = b2.dot(&d) + 2.0 * b1.dot(&d1) + b.dot(&d2) - f.acceleration;
                let row = JacobianRow { child: [b, dc.cross(&b)], parent: [-b, b.cross(&dp) + b.cross(&d)] };
                visit(0, row, [phi, rate, acceleration]);
            }
            Self::Angle { child, zero: reference, axis, in_child, drive } => {
                let of_axis = if in_child { c } else { p };
                let (a, b, x) = (c.rotation * child, p.rotation * reference, of_axis.rotation * axis);
                let f = driven[drive];
                let angle = libm::atan2(b.cross(&a).dot(&x), b.dot(&a));
                // A driven crank turns many times: compare modulo a turn.
                let turns = libm::round((f.value - angle) / std::f64::consts::TAU);
                let phi = angle + turns * std::f64::consts::TAU - f.value;
                let relative = wc - wp;
                let acceleration = (c.angular_acceleration - p.angular_acceleration).dot(&x)
                    + relative.dot(&of_axis.angular_velocity.cross(&x))
                    - f.acceleration;
                let row = JacobianRow { child: [zero, x], parent: [zero, -x] };
                visit(0, row, [phi, relative.dot(&x) - f.rate, acceleration]);
            }
        }
    }
}

/// A joint that closes a loop, as constraint rows.
#[derive(Clone, Debug)]
pub struct Cut {
    /// Joint points.
    pub child: Anchor,
    pub parent: Anchor,
    /// Rows for position, then for orientation.
    pub rows: [Vec<Rows>; 2],
}

impl Cut {
    /// Two points that coincide.
    pub fn point(child: Anchor, parent: Anchor) -> Self {
        let point = Rows::Point { child: child.offset, parent: parent.offset };
        Self { child, parent, rows: [vec![point], Vec::new()] }
    }

    /// Whether it constrains orientation.
    pub fn turns(&self) -> bool {
        !self.rows[1].is_empty()
    }

    /// Joint points of child and parent relative to the centroids of their bodies, m. If the child's point slides, both arms lead
    /// to it.
    #[inline]
    pub fn arms(&self, motion: &[Kinematics]) -> [Vec3; 2] {
        let (c, p) = (&motion[self.child.body], &motion[self.parent.body]);
        let arm = c.rotation * self.child.offset;
        let slides = !matches!(self.rows[0][..], [Rows::Point { .. }]);
        [arm, if slides { c.position + arm - p.position } else { p.rotation * self.parent.offset }]
    }

    /// Violation of its rows, m and rad, or a derivative of this order.
    pub fn violation(&self, motion: &[Kinematics], order: usize) -> Opening {
        let (c, p) = (&motion[self.child.body], &motion[self.parent.body]);
        let parts = self.rows.each_ref().map(|rows| {
            let mut sum = Vec3::zeros();
            for rows in rows {
                let part = usize::from(rows.turns());
                rows.linearise(c, p, &[], |_, row, state| sum += row.child[part] * state[order]);
            }
            sum
        });
        Opening { apart: parts[0], turned: parts[1].norm() }
    }

    /// Separation of its points, m, or its first or second derivative.
    #[inline]
    pub fn separation(&self, motion: &[Kinematics], order: usize) -> Vec3 {
        separation([&self.child, &self.parent], motion, order)
    }
}

/// The first of two points from the second, m, or the first or second derivative of that.
#[inline]
pub fn separation([child, parent]: [&Anchor; 2], motion: &[Kinematics], order: usize) -> Vec3 {
    let (c, p) = (&motion[child.body], &motion[parent.body]);
    let (child, parent) = (c.rotation * child.offset, p.rotation * parent.offset);
    match order {
        0 => (c.position + child) - (p.position + parent),
        1 => c.point_velocity(&child) - p.point_velocity(&parent),
        _ => c.point_acceleration(&child) - p.point_acceleration(&parent),
    }
}

/// Constraint violation of a joint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Opening {
    /// Separation of the joint's points, world axes: m, or m/s.
    pub apart: Vec3,
    /// Angular misalignment of its bodies: rad, or rad/s.
    pub turned: f64,
}

impl Pair {
    /// Its constraint rows without drives: position rows, then orientation rows. The directions within each part are mutually
    /// perpendicular.
    pub fn rows(&self) -> [Vec<Rows>; 2] {
        let [x, y, z] = self.axes;
        let [child_x, child_y, _] = self.child_axes;
        let slides = [self.offset(&y, None), self.offset(&z, None)];
        let along = [(child_x, y), (child_x, z)];
        let (points, orientation): (&[Rows], &[(Vec3, Vec3)]) = match self.kind {
            JointKind::Free => (&[], &[]),
            JointKind::Fixed => (&[self.point()], &[along[0], along[1], (child_y, z)]),
            JointKind::Revolute => (&[self.point()], &along),
            JointKind::Universal => (&[self.point()], &[(self.second, x)]),
            JointKind::Prismatic => (&slides, &[along[0], along[1], (child_y, z)]),
            JointKind::Cylindrical => (&slides, &along),
        };
        let perpendicular = |&(child, parent): &(Vec3, Vec3)| Rows::Perpendicular { child, parent };
        [points.to_vec(), orientation.iter().map(perpendicular).collect()]
    }

    /// The row that prescribes coordinate `part`.
    pub(crate) fn driven_row(&self, part: usize, drive: usize) -> Rows {
        let about_axis =
            |child: Vec3, zero: Vec3| Rows::Angle { child, zero, axis: self.axes[0], in_child: false, drive };
        match (self.kind, part) {
            (JointKind::Prismatic | JointKind::Cylindrical, 0) => self.offset(&self.axes[0], Some(drive)),
            (JointKind::Universal, 0) => about_axis(self.second, self.second_at_zero()),
            (JointKind::Universal, _) => {
                Rows::Angle { child: self.child_axes[0], zero: self.axes[0], axis: self.second, in_child: true, drive }
            }
            _ => about_axis(self.child_axes[1], self.axes[1]),
        }
    }

    /// Second axis of a universal joint at zero angles, in the parent's axes.
    fn second_at_zero(&self) -> Vec3 {
        let [x, y, z] = self.child_axes.map(|child_axes| child_axes.dot(&self.second));
        self.axes[0] * x + self.axes[1] * y + self.axes[2] * z
    }

    /// The row that keeps the points together along axis `i` of the parent.
    pub fn along(&self, i: usize) -> Rows {
        self.offset(&self.axes[i], None)
    }

    /// The rows that keep the axes parallel.
    pub fn parallel(&self) -> Vec<Rows> {
        let [child, _, _] = self.child_axes;
        self.axes[1..].iter().map(|&parent| Rows::Perpendicular { child, parent }).collect()
    }

    /// A cut with these rows for position and orientation alone, if there are any.
    pub fn keeping(&self, positions: Vec<Rows>, orientations: Vec<Rows>) -> Option<Cut> {
        let rows = [positions, orientations];
        let any = rows.iter().any(|rows| !rows.is_empty());
        any.then_some(Cut { child: self.child, parent: self.parent, rows })
    }

    fn point(&self) -> Rows {
        Rows::Point { child: self.child.offset, parent: self.parent.offset }
    }

    fn offset(&self, along: &Vec3, drive: Option<usize>) -> Rows {
        Rows::Offset { child: self.child.offset, parent: self.parent.offset, along: *along, drive }
    }

    /// Whether the child's point slides along the axis.
    pub fn slides(&self) -> bool {
        matches!(self.kind, JointKind::Prismatic | JointKind::Cylindrical)
    }

    /// Motion of child and parent.
    fn ends<'a>(&self, motion: &'a [Kinematics]) -> [&'a Kinematics; 2] {
        [&motion[self.child.body], &motion[self.parent.body]]
    }

    /// The joint as constraint rows, without drives.
    pub fn cut(&self) -> Cut {
        Cut { child: self.child, parent: self.parent, rows: self.rows() }
    }

    /// Coordinates with their rates, m or rad, in the order of [`JointKind::freedoms`]; angles between -pi and pi.
    pub fn coordinates(&self, motion: &[Kinematics]) -> impl Iterator<Item = [f64; 2]> + use<> {
        let [c, p] = self.ends(motion);
        let axis = p.rotation * self.axes[0];
        let spin = c.angular_velocity - p.angular_velocity;
        let slide = || {
            let arm = c.rotation * self.child.offset;
            let at = c.position + arm - p.position;
            let slid = at - p.rotation * self.parent.offset;
            let velocity = c.point_velocity(&arm) - p.point_velocity(&at);
            [axis.dot(&slid), axis.dot(&velocity)]
        };
        let turn = |about: &Vec3, from: &Vec3, to: &Vec3| {
            let angle = libm::atan2(from.cross(to).dot(about), from.dot(to));
            [angle, about.dot(&spin)]
        };
        let hinge = || turn(&axis, &(p.rotation * self.axes[1]), &(c.rotation * self.child_axes[1]));
        let both = match self.kind {
            JointKind::Fixed | JointKind::Free => [None, None],
            JointKind::Prismatic => [Some(slide()), None],
            JointKind::Revolute => [Some(hinge()), None],
            JointKind::Cylindrical => [Some(slide()), Some(hinge())],
            JointKind::Universal => {
                let second = c.rotation * self.second;
                let zero = p.rotation * self.second_at_zero();
                let first = turn(&axis, &zero, &second);
                [Some(first), Some(turn(&second, &axis, &(c.rotation * self.child_axes[0])))]
            }
        };
        both.into_iter().flatten()
    }

    /// Constraint violation, m and rad. Unlike the rows, it distinguishes an axis from its opposite.
    pub fn opening(&self, motion: &[Kinematics]) -> Opening {
        let [c, p] = self.ends(motion);
        let axes = self.axes.map(|axis| p.rotation * axis);
        let child_axes = self.child_axes.map(|axis| c.rotation * axis);
        let gap = (c.position + c.rotation * self.child.offset) - (p.position + p.rotation * self.parent.offset);
        let apart = if self.slides() { gap - axes[0] * axes[0].dot(&gap) } else { gap };
        let turned = match self.kind {
            JointKind::Free => 0.0,
            JointKind::Revolute | JointKind::Cylindrical => {
                libm::atan2(axes[0].cross(&child_axes[0]).norm(), axes[0].dot(&child_axes[0]))
            }
            JointKind::Universal => {
                let second = c.rotation * self.second;
                let (sine, cosine) = (axes[0].dot(&second), axes[0].cross(&second).norm());
                libm::atan2(sine, cosine).abs()
            }
            JointKind::Fixed | JointKind::Prismatic => {
                // For a rotation by an angle about n, the sums are 2 sin n and 1 + 2 cos.
                let pairs = || axes.iter().zip(&child_axes);
                let sine = pairs().map(|(a, b)| a.cross(b)).sum::<Vec3>().norm();
                let cosine = pairs().map(|(a, b)| a.dot(b)).sum::<f64>() - 1.0;
                libm::atan2(sine, cosine)
            }
        };
        Opening { apart, turned }
    }
}
