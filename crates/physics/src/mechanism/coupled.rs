//! Rows of three force components that are solved for together: contacts, and force elements between two bodies.

use super::MechanismError;
use super::bounds::{Advice, Cost, CostlyTask};
use super::columns::Column;
use super::equations::Equations;
use super::model::Model;
use crate::integrate::Method;
use crate::machine::{Mat3, Vec3};
use std::ops::Range;

/// Velocity coordinates that a force at a row may accelerate, in ascending order: those of the trees that it acts on, or all.
#[derive(Clone, Copy, Default)]
pub struct Spans([[usize; 2]; 2]);

impl Spans {
    /// Number of coordinates.
    pub fn len(&self) -> usize {
        self.0.iter().map(|[start, end]| end - start).sum()
    }

    fn ranges(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        self.0.iter().map(|&[start, end]| start..end).filter(|range| !range.is_empty())
    }

    /// Index of `coordinate` among its coordinates, if it is one of them.
    fn index_of(&self, coordinate: usize) -> Option<usize> {
        let [[start, end], [other, last]] = self.0;
        if (start..end).contains(&coordinate) {
            Some(coordinate - start)
        } else {
            (other..last).contains(&coordinate).then(|| coordinate - other + end - start)
        }
    }

    /// Whether it shares coordinates with `other`.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.ranges().any(|a| other.ranges().any(|b| a.start < b.end && b.start < a.end))
    }
}

/// Which rows act on the same coordinates.
pub struct CoupledRows {
    /// What a force at each row may accelerate.
    pub spans: Vec<Spans>,
    /// Bandwidth: rows further apart are not coupled.
    pub(crate) bandwidth: usize,
}

impl CoupledRows {
    /// For `n` velocity coordinates and rows between these pairs of bodies. With `within`, a force accelerates only the trees it
    /// acts on; otherwise all coordinates.
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
        let spans = |of: &[Option<usize>; 2]| {
            if !within {
                return Spans([[0, n], [n, n]]);
            }
            let mut spans = of.map(|block| {
                block.map_or([0, 0], |block| [model.blocks[block].v, model.blocks[block].v + model.blocks[block].n])
            });
            if of[0] == of[1] {
                spans[1] = [0, 0];
            }
            spans.sort_unstable();
            Spans(spans)
        };
        let spans: Vec<Spans> = blocks.iter().map(spans).collect();
        // Rows that act on the same tree are coupled.
        let mut first_on = vec![usize::MAX; model.blocks.len()];
        let mut bandwidth = if within { 0 } else { blocks.len().saturating_sub(1) };
        for (row, of) in blocks.iter().enumerate() {
            for &block in of.iter().flatten() {
                first_on[block] = first_on[block].min(row);
                bandwidth = bandwidth.max(row - first_on[block]);
            }
        }
        let cost = Cost::of_coupled_contacts(blocks.len(), bandwidth, spans.iter().map(Spans::len).sum());
        cost.check(CostlyTask::CoupledContacts, Advice::Method(Method::Automatic))?;
        Ok(Self { spans, bandwidth })
    }
}

/// M^-1 S^T of one row over its `spans`, as three interleaved columns, into `out`; `columns` has S, and `scratch` room for all
/// velocity coordinates.
pub fn apply_inverse_mass(
    model: &Model,
    equations: &mut dyn Equations,
    spans: &Spans,
    columns: &[Column],
    scratch: &mut [f64],
    out: &mut [f64],
) {
    let mut rest = out;
    for range in spans.ranges() {
        let (own, after) = rest.split_at_mut(3 * range.len());
        rest = after;
        let Some((inverse_mass, inverse_inertia)) = equations.free_body_inverse_mass(model, range.start) else {
            apply_inverse_mass_within(model, equations, &range, columns, scratch, own);
            continue;
        };
        let first = columns.iter().position(|column| column.coordinate == range.start);
        let Some([x, y, z, turns @ ..]) = first.and_then(|first| columns[first..].first_chunk::<6>()) else {
            own.fill(0.0);
            continue;
        };
        for (out, column) in own.chunks_exact_mut(3).zip([x, y, z]) {
            out.copy_from_slice((column.surface * inverse_mass).as_slice());
        }
        for (a, out) in own[9..].chunks_exact_mut(3).enumerate() {
            let of_axis = |b: usize| turns[b].surface * inverse_inertia[(a, b)];
            out.copy_from_slice((of_axis(0) + of_axis(1) + of_axis(2)).as_slice());
        }
    }
}

/// The same for one `range` of its spans.
fn apply_inverse_mass_within(
    model: &Model,
    equations: &mut dyn Equations,
    range: &Range<usize>,
    columns: &[Column],
    scratch: &mut [f64],
    out: &mut [f64],
) {
    for i in 0..3 {
        scratch[range.clone()].fill(0.0);
        for column in columns.iter().filter(|column| range.contains(&column.coordinate)) {
            scratch[column.coordinate] = column.surface[i];
        }
        if equations.is_block_diagonal() {
            equations.apply_inverse_mass_within(model, (range.start, range.end), scratch);
        } else {
            equations.apply_inverse_mass(model, scratch);
        }
        for (out, x) in out.chunks_exact_mut(3).zip(&scratch[range.clone()]) {
            out[i] = *x;
        }
    }
}

/// Adds to `velocities` the effect of `impulse` (N s) at the row with `weighted` over its `spans`.
pub fn add_impulse(velocities: &mut [f64], weighted: &[f64], spans: &Spans, impulse: &Vec3) {
    let mut weighted = weighted.chunks_exact(3);
    for range in spans.ranges() {
        for (v, w) in velocities[range].iter_mut().zip(&mut weighted) {
            *v += w[0] * impulse[0] + w[1] * impulse[1] + w[2] * impulse[2];
        }
    }
}

/// Effect of a force at the row with `weighted` over its `spans` on the velocity of the row with `columns`, 1/kg: S M^-1 S^T, or
/// W M^-1 S^T, of the centres, if `centres`.
pub fn mobility_between(columns: &[Column], weighted: &[f64], spans: &Spans, centres: bool) -> Mat3 {
    let mut mobility = Mat3::zeros();
    for c in columns {
        if let Some(index_of) = spans.index_of(c.coordinate) {
            let x = &weighted[3 * index_of..][..3];
            let velocity = if centres { &c.centre } else { &c.surface };
            for (j, x) in x.iter().enumerate() {
                for i in 0..3 {
                    mobility[(i, j)] += velocity[i] * x;
                }
            }
        }
    }
    mobility
}
