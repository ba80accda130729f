//! The plays of a machine as members: directions at a place of a joint along which its bodies may be displaced by at most the play,
//! whatever happens along others. A ball is one, in space; a pin is two, across its axis at its ends, and one along it; a block one
//! at each line of corners. The loads of a joint's rows are carried by its members; to first order in the plays.

use super::kinematics::Kinematics;
use super::model::Model;
use super::norm_sum::minimise;
use crate::machine::{LooseJoint, LooseKind, Mat3, Pin, Slide, Vec3};
use std::ops::Range;

/// A force or a torque on the carried part.
#[derive(Clone, Copy)]
enum Load {
    /// Along this direction at this place, in the axes of the joint's carrier frame, m from the joint's point.
    Force(Vec3, Vec3),
    /// About this direction: what has no play, but rows.
    Torque(Vec3),
}

/// A play of a joint.
struct Member {
    /// m; 0 for what has none.
    play: f64,
    /// Its directions, three at most.
    loads: Vec<Load>,
}

/// Members of each loose joint, and its rows.
pub struct Members {
    joints: Vec<Joint>,
}

struct Joint {
    rows: Range<usize>,
    /// Rotation of the carrier's frame in its body.
    frame: Mat3,
    members: Vec<Member>,
    /// Whether rows and members are the same: of a ball.
    is_ball: bool,
}

fn members(joint: &LooseJoint) -> Vec<Member> {
    let [x, y, z] = [Vec3::x(), Vec3::y(), Vec3::z()];
    let centre = Vec3::zeros();
    let [first, second] = joint.contact.clearances();
    let across = |play: f64, at: Vec3| Member { play, loads: vec![Load::Force(y, at), Load::Force(z, at)] };
    let along = |play: f64, direction: Vec3, at: Vec3| Member { play, loads: vec![Load::Force(direction, at)] };
    let turning = |axis: Vec3| Member { play: 0.0, loads: vec![Load::Torque(axis)] };
    match joint.kind {
        LooseKind::Ball => vec![Member { play: first, loads: [x, y, z].map(|axis| Load::Force(axis, centre)).into() }],
        LooseKind::Pin(Pin { length, kept, face_radius, .. }) => {
            let mut all = match length {
                Some(length) => [-0.5, 0.5].map(|end| across(first, x * (end * length))).into(),
                None => vec![across(first, centre), turning(y), turning(z)],
            };
            match face_radius.filter(|_| second > 0.0) {
                _ if !kept => {}
                Some(radius) => all.extend([y, z, -y, -z].map(|rim| along(second, x, rim * radius))),
                None => all.push(along(second, x, centre)),
            }
            all
        }
        LooseKind::Slide(Slide { half_length, half_width, half_height, .. }) => {
            let Some(half_height) = half_height else {
                let mut all: Vec<Member> = [-1.0, 1.0].map(|end| along(first, y, x * (end * half_length))).into();
                all.extend([along(0.0, z, centre), turning(y), turning(x)]);
                return all;
            };
            // Opposite walls touch lines of corners with the same lever arms.
            let ends = [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)];
            let at = |(end, side): (f64, f64), across: Vec3| x * (end * half_length) + across * side;
            let in_y = ends.map(|corner| along(first, y, at(corner, z * half_height)));
            let in_z = ends.map(|corner| along(second, z, at(corner, y * half_width)));
            in_y.into_iter().chain(in_z).collect()
        }
    }
}

impl Members {
    /// Members of `joints`, whose rows come first in the constraints of `model`, in which they have no play.
    pub fn new(joints: &[LooseJoint], model: &Model) -> Self {
        let mut first = 0;
        let joint = |(joint, compiled): (&LooseJoint, &super::model::LooseJoint)| {
            let count: usize = compiled.closed.rows.iter().flatten().map(super::pairs::Rows::count).sum();
            first += count;
            Joint {
                rows: first - count..first,
                frame: joint.frames[0].rotation.to_rotation_matrix().into_inner(),
                members: members(joint),
                is_ball: joint.kind == LooseKind::Ball,
            }
        };
        Self { joints: joints.iter().zip(&model.joints).map(joint).collect() }
    }

    /// Largest play, m.
    pub fn largest_play(&self) -> f64 {
        self.joints.iter().flat_map(|joint| &joint.members).map(|member| member.play).fold(0.0, f64::max)
    }

    /// The least virtual work of `loads`, of all rows up to combinations of the vectors `null`, with the displacements that the plays
    /// allow; `openings` are the present ones of the rows, as in [`minimise`]. Returns the displacements of the rows that do this
    /// work, and the part of each joint in the work.
    pub fn displace(
        &self,
        model: &Model,
        motion: &[Kinematics],
        null: &[Vec<f64>],
        openings: &[f64],
        loads: &[f64],
    ) -> (Vec<f64>, Vec<f64>) {
        let spread: Vec<Spread> = self
            .joints
            .iter()
            .enumerate()
            .map(|(j, joint)| Spread::new(joint, &model.joints[j].closed, motion))
            .collect();
        let own_rows = self.joints.last().map_or(0, |joint| joint.rows.end);
        let weights: Vec<f64> = self.joints.iter().flat_map(|joint| joint.members.iter().map(|m| m.play)).collect();
        let to_members = |rows: &[f64]| -> Vec<f64> {
            let own = self.joints.iter().zip(&spread).flat_map(|(joint, own)| own.carried(&rows[joint.rows.clone()]));
            own.chain(rows[own_rows..].iter().copied()).collect()
        };
        let slope =
            self.joints.iter().zip(&spread).flat_map(|(joint, own)| own.displaced(&openings[joint.rows.clone()]));
        let slope: Vec<f64> = slope.chain(openings[own_rows..].iter().copied()).collect();
        let mut x = to_members(loads);
        let mut basis: Vec<Vec<f64>> = null.iter().map(|null| to_members(null)).collect();
        // What members of one joint exert on one another.
        let mut first = 0;
        for own in &spread {
            for inner in own.inner() {
                let mut whole = vec![0.0; x.len()];
                whole[first..first + inner.len()].copy_from_slice(&inner);
                basis.push(whole);
            }
            first += own.width();
        }
        let gradients = minimise(&weights, &basis, &slope, &mut x);
        let mut shares = Vec::with_capacity(self.joints.len());
        let (mut displaced, mut first) = (Vec::with_capacity(loads.len()), 0);
        for (joint, own) in self.joints.iter().zip(&spread) {
            let range = first..first + own.width();
            let sizes = x[range.clone()].chunks_exact(3).map(|x| x.iter().map(|x| x * x).sum::<f64>().sqrt());
            shares.push(joint.members.iter().zip(sizes).map(|(member, size)| member.play * size).sum());
            displaced.extend(own.of_rows(&gradients[range]));
            first += own.width();
        }
        (displaced, shares)
    }
}

/// How the members of a joint carry the loads of its rows: loads = A x, with three columns for each member.
struct Spread {
    /// Of each row; `None` for a ball, where A is the identity.
    a: Option<Vec<Vec<f64>>>,
    /// (A A^T)^-1.
    inverse: nalgebra::DMatrix<f64>,
    columns: usize,
    /// Columns that stand for a direction.
    used: Vec<usize>,
}

impl Spread {
    fn new(joint: &Joint, cut: &super::pairs::Cut, motion: &[Kinematics]) -> Self {
        let columns = 3 * joint.members.len();
        let empty = nalgebra::DMatrix::zeros(0, 0);
        if joint.is_ball {
            return Self { a: None, inverse: empty, columns, used: Vec::new() };
        }
        let (child, parent) = (&motion[cut.child.body], &motion[cut.parent.body]);
        let axes = parent.rotation * joint.frame;
        let mut a = Vec::new();
        let mut used = Vec::new();
        for rows in cut.rows.iter().flatten() {
            rows.linearise(child, parent, &[], |_, row, _| {
                let along = row.child[usize::from(rows.turns())];
                let mut line = vec![0.0; columns];
                for (m, member) in joint.members.iter().enumerate() {
                    for (i, load) in member.loads.iter().enumerate() {
                        let exerted = match (*load, rows.turns()) {
                            (Load::Force(direction, _), false) => axes * direction,
                            (Load::Force(direction, at), true) => axes * at.cross(&direction),
                            (Load::Torque(_), false) => Vec3::zeros(),
                            (Load::Torque(axis), true) => axes * axis,
                        };
                        line[3 * m + i] = along.dot(&exerted);
                    }
                }
                a.push(line);
            });
        }
        for (m, member) in joint.members.iter().enumerate() {
            used.extend((0..member.loads.len()).map(|i| 3 * m + i));
        }
        let square = nalgebra::DMatrix::from_fn(a.len(), a.len(), |i, j| {
            a[i].iter().zip(&a[j]).map(|(a, b)| a * b).sum::<f64>()
        });
        // Every row is carried by some member.
        let inverse = square.try_inverse().unwrap_or(empty);
        Self { a: Some(a), inverse, columns, used }
    }

    fn width(&self) -> usize {
        self.columns
    }

    /// The least loads of the members that are those of the `rows`.
    fn carried(&self, rows: &[f64]) -> Vec<f64> {
        let Some(a) = &self.a else { return rows.to_vec() };
        let solved = &self.inverse * nalgebra::DVector::from_column_slice(rows);
        (0..self.columns).map(|c| a.iter().zip(solved.iter()).map(|(line, x)| line[c] * x).sum()).collect()
    }

    /// Displacements of the members for those of the rows.
    fn displaced(&self, rows: &[f64]) -> Vec<f64> {
        let Some(a) = &self.a else { return rows.to_vec() };
        (0..self.columns).map(|c| a.iter().zip(rows).map(|(line, x)| line[c] * x).sum()).collect()
    }

    /// The displacements of the rows that come nearest to those of the members.
    fn of_rows(&self, members: &[f64]) -> Vec<f64> {
        let Some(a) = &self.a else { return members.to_vec() };
        let sums = a.iter().map(|line| line.iter().zip(members).map(|(a, x)| a * x).sum::<f64>());
        (&self.inverse * nalgebra::DVector::from_iterator(a.len(), sums)).iter().copied().collect()
    }

    /// Loads of the members that together exert nothing.
    fn inner(&self) -> Vec<Vec<f64>> {
        let Some(a) = &self.a else { return Vec::new() };
        if self.used.len() <= a.len() {
            return Vec::new();
        }
        let unit = |&column: &usize| {
            let exerted: Vec<f64> = a.iter().map(|line| line[column]).collect();
            let mut own = self.carried(&exerted);
            own.iter_mut().for_each(|x| *x = -*x);
            own[column] += 1.0;
            own
        };
        self.used.iter().map(unit).collect()
    }
}
