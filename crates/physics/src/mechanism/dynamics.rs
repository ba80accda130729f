//! The equations of motion as matrices: names of the coordinates, mass matrix, forces. For analyses; nothing here is part of a step.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::elements::ActiveSet;
use super::model::Motion;
use super::{Mechanism, Vec3};
use crate::integrate::System;
use crate::machine::{Formulation, Machine};

/// A coordinate of the state vector, or the pose of a body in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Coordinate {
    /// Of a joint as channels name it, `crank.angle`; of a pose the name of the body.
    pub name: String,
    /// Components among the positions: one, m or rad, or seven, the position of the centre of mass, m, and the quaternion w, x, y, z.
    pub positions: Range<usize>,
    /// Components among the velocities: one, or six, the velocity of the centre of mass, m/s, and the angular velocity, rad/s, in
    /// world axes.
    pub velocities: Range<usize>,
}

impl Mechanism {
    /// The coordinates of the state vector of `machine`, which these equations were set up from, in its order.
    pub fn coordinate_names(&self, machine: &Machine) -> Vec<Coordinate> {
        let model = &self.model;
        let pose = |name: &str, q: usize, v: usize| Coordinate {
            name: name.to_owned(),
            positions: q..q + 7,
            velocities: v..v + 6,
        };
        if machine.formulation == Formulation::Lagrange {
            let bodies = machine.bodies.iter().enumerate();
            return bodies.map(|(b, body)| pose(&body.name, 7 * b, 6 * b)).collect();
        }
        let coordinate = |(b, body): (usize, &super::model::Body)| match body.motion {
            Motion::Free { q, v } => Some(pose(&machine.bodies[b].name, q, v)),
            Motion::Prismatic { q, v } | Motion::Revolute { q, v } => {
                let (of, part) = model.two_degree_joint_at(b).map_or((b, 0), |(pair, part)| (pair.child.body, part));
                let joint = &machine.joints[of];
                let name = format!("{}.{}", joint.name, joint.kind.freedoms()[part].word());
                Some(Coordinate { name, positions: q..q + 1, velocities: v..v + 1 })
            }
            Motion::Fixed | Motion::Driven { .. } => None,
        };
        let mut all: Vec<Coordinate> = model.bodies.iter().enumerate().filter_map(coordinate).collect();
        all.sort_by_key(|coordinate| coordinate.positions.start);
        all
    }

    /// For each body, the velocity of its centre of mass, m/s, and its angular velocity, rad/s, per unit rate of each velocity
    /// coordinate, in the poses last measured.
    fn body_columns(&self) -> Vec<Vec<(usize, Vec3, Vec3)>> {
        let of_body = |b: usize| {
            let mut columns = Vec::new();
            let centre = &self.equations.motion()[b].position;
            self.equations.visit_columns(&self.model, b, centre, &mut |i, v, w| columns.push((i, v, w)));
            columns
        };
        (0..self.model.massive).map(of_body).collect()
    }

    /// Mass matrix of the velocity coordinates at (t, y), kg, kg m and kg m^2: that of the trees alone, before joints that close
    /// loops constrain them.
    pub fn mass_matrix(&mut self, t: f64, y: &[f64]) -> DMatrix<f64> {
        self.measure(t, y);
        let n = self.velocities();
        let mut mass = DMatrix::zeros(n, n);
        for (b, columns) in self.body_columns().iter().enumerate() {
            let (body, rotation) = (&self.model.bodies[b], &self.motion()[b].rotation);
            let inertia = rotation * body.inertia * rotation.transpose();
            for &(i, v, w) in columns {
                let (momentum, moment) = (v * body.mass, inertia * w);
                for &(j, other_v, other_w) in columns {
                    mass[(j, i)] += momentum.dot(&other_v) + moment.dot(&other_w);
                }
            }
        }
        mass
    }

    /// Forces on the velocity coordinates at (t, y), N and N m: loads, gravity, active contacts and the terms of the velocities. The
    /// mass matrix times the accelerations equals them where no joint closes a loop.
    ///
    /// Of the tree formulation only: in the other the loads act on the bodies themselves.
    pub fn generalised_forces(&mut self, t: f64, y: &[f64], active_set: ActiveSet<'_>) -> DVector<f64> {
        let n = self.velocities();
        let mut dy = vec![0.0; self.dimension()];
        self.evaluator(active_set).derivative(t, y, &mut dy);
        let wrench: Vec<_> = self.equations.loads().1[..self.model.massive].to_vec();
        // Accelerations where every coordinate's own is 0.
        self.equations.complete_motion(&self.model, y, &vec![0.0; n]);
        let mut forces = DVector::zeros(n);
        for (b, columns) in self.body_columns().iter().enumerate() {
            let (body, m) = (&self.model.bodies[b], &self.motion()[b]);
            let inertia = m.rotation * body.inertia * m.rotation.transpose();
            let spin = &m.angular_velocity;
            let force = wrench[b].force + (self.gravity - m.acceleration) * body.mass;
            let torque = wrench[b].torque - inertia * m.angular_acceleration - spin.cross(&(inertia * spin));
            for &(i, v, w) in columns {
                forces[i] += force.dot(&v) + torque.dot(&w);
            }
        }
        self.forget_evaluation();
        forces
    }

    /// Moves the positions in `y` by the velocity-space displacement `step`, rotations by their rotation vectors.
    pub(crate) fn displace(&self, y: &mut [f64], step: &[f64]) {
        self.equations.displace(&self.model, y, step);
    }

    /// Velocity-space directions in which the constraints let the machine move at (t, y), one a column, scaled by the masses; the
    /// unit vectors where no joint closes a loop.
    pub(crate) fn free_directions(&mut self, t: f64, y: &[f64]) -> DMatrix<f64> {
        let mass = self.mass_matrix(t, y);
        let n = mass.nrows();
        if self.equations.rows() == 0 {
            return DMatrix::identity(n, n);
        }
        let mut dy = vec![0.0; self.dimension()];
        self.evaluator(ActiveSet::Nothing).derivative(t, y, &mut dy);
        let scale = DVector::from_iterator(n, mass.diagonal().iter().map(|m| m.sqrt()));
        let mut mobility = DMatrix::zeros(n, n);
        for i in 0..n {
            let mut column = DVector::zeros(n);
            column[i] = scale[i];
            self.equations.apply_inverse_mass(&self.model, column.as_mut_slice());
            mobility.set_column(i, &column.component_mul(&scale));
        }
        self.forget_evaluation();
        let symmetric = (&mobility + mobility.transpose()) * 0.5;
        let eigen = symmetric.symmetric_eigen();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let free = n - self.equations.rank();
        let columns: Vec<DVector<f64>> =
            order[..free].iter().map(|&k| eigen.eigenvectors.column(k).component_div(&scale)).collect();
        if columns.is_empty() { DMatrix::zeros(n, 0) } else { DMatrix::from_columns(&columns) }
    }
}
