//! Rows of three force components whose effect on one another is solved for: ball joints, and force elements between two bodies.

use super::MechanismError;
use super::bounds::{Advice, Cost, CostOf};
use super::columns::Column;
use super::equations::Equations;
use super::model::Model;
use crate::integrate::Method;
use crate::machine::{Mat3, Vec3};
use std::ops::Range;

/// Which rows act on the same coordinates.
pub struct CoupledRows {
    /// Velocity coordinates that a force at each row may accelerate.
    pub ranges: Vec<Range<usize>>,
    /// Bandwidth: rows further apart are not coupled.
    pub reach: usize,
}

impl CoupledRows {
    /// For `n` velocity coordinates and rows between these pairs of bodies. With `within`, a force accelerates only the trees it acts
    /// on; otherwise all coordinates.
    ///
    /// # Errors
    /// The rows are coupled too widely.
    pub fn new(
        model: &Model,
        n: usize,
        within: bool,
        bodies: impl Iterator<Item = [usize; 2]>,
    ) -> Result<Self, MechanismError> {
        let block_of =
            |body: usize| (body < model.bodies.len() && !model.bodies[body].driven_only).then(|| model.block_of[body]);
        let blocks: Vec<[Option<usize>; 2]> = bodies.map(|of| of.map(block_of)).collect();
        let range = |of: &[Option<usize>; 2]| {
            if !within {
                return 0..n;
            }
            let mut range = n..0;
            for block in of.iter().flatten().map(|&block| &model.blocks[block]) {
                range = range.start.min(block.v)..range.end.max(block.v + block.n);
            }
            range.start.min(range.end)..range.end
        };
        let ranges: Vec<Range<usize>> = blocks.iter().map(range).collect();
        // Rows that act on the same tree are coupled.
        let mut first_on = vec![usize::MAX; model.blocks.len()];
        let mut reach = if within { 0 } else { blocks.len().saturating_sub(1) };
        for (row, of) in blocks.iter().enumerate() {
            for &block in of.iter().flatten() {
                first_on[block] = first_on[block].min(row);
                reach = reach.max(row - first_on[block]);
            }
        }
        let cost = Cost::of_coupled_contacts(blocks.len(), reach, ranges.iter().map(ExactSizeIterator::len).sum());
        cost.check(CostOf::CoupledContacts, Advice::Method(Method::Automatic))?;
        Ok(Self { ranges, reach })
    }

    /// Whether forces at two rows may act on the same coordinates.
    pub fn meet(&self, one: usize, other: usize) -> bool {
        let [a, b] = [&self.ranges[one], &self.ranges[other]];
        a.start < b.end && b.start < a.end
    }
}

/// M^-1 S^T of one row over its `range`, as three interleaved columns, into `out`; `columns` has S, and `scratch` room for all velocity
/// coordinates.
pub fn weigh(
    model: &Model,
    equations: &mut dyn Equations,
    range: &Range<usize>,
    columns: &[Column],
    scratch: &mut [f64],
    out: &mut [f64],
) {
    let within = equations.is_block_diagonal();
    for i in 0..3 {
        scratch[range.clone()].fill(0.0);
        for column in columns {
            scratch[column.coordinate] = column.surface[i];
        }
        if within {
            equations.apply_inverse_mass_within(model, (range.start, range.end), scratch);
        } else {
            equations.apply_inverse_mass(model, scratch);
        }
        for (out, x) in out.chunks_exact_mut(3).zip(&scratch[range.clone()]) {
            out[i] = *x;
        }
    }
}

/// W M^-1 S^T, and the same for the velocity used by friction, of the row with `columns`, for a force at the row with `weighted` over
/// its `range`. Friction follows the surfaces if `surface`, otherwise the centres.
pub fn mobility_between(columns: &[Column], weighted: &[f64], range: &Range<usize>, surface: bool) -> [Mat3; 2] {
    let mut mobility = [Mat3::zeros(); 2];
    for c in columns {
        if range.contains(&c.coordinate) {
            let x = &weighted[3 * (c.coordinate - range.start)..][..3];
            let x = Vec3::new(x[0], x[1], x[2]).transpose();
            mobility[0] += c.centre * x;
            if surface {
                mobility[1] += c.surface * x;
            }
        }
    }
    if !surface {
        mobility[1] = mobility[0];
    }
    mobility
}
