//! Integration with the Tsitouras 5(4) pair and the BDF methods of diffsol. Its root finding locates the start and the end of
//! each contact; the contact states are managed here.

use diffsol::{NalgebraLU, NalgebraMat, OdeBuilder, OdeSolverMethod, OdeSolverStopReason, Vector};

type M = NalgebraMat<f64>;
type Lu = NalgebraLU<f64>;

/// Interface of a scene for the independent solver: derivative and penetrations for given contact states.
pub trait Equations {
    fn start(&self) -> Vec<f64>;
    fn derivative(&self, t: f64, y: &[f64], dy: &mut [f64]);
    /// Penetration and its rate for each ball joint.
    fn gaps(&self, t: f64, y: &[f64]) -> Vec<(f64, f64)>;
    /// Normal force for each ball joint.
    fn forces(&self, t: f64, y: &[f64]) -> Vec<f64>;
    fn speed_floor(&self) -> f64;
    /// Sets the approach speeds of the active contacts.
    fn set_contacts(&self, contacts: &[Option<f64>]);
}

#[derive(Clone, Copy, Debug)]
pub enum Solver {
    Tsitouras,
    Bdf,
}

/// Results of an independent run.
pub struct Run {
    pub y: Vec<f64>,
    /// Joint, time, approach speed, largest sampled normal force, in the order of their start.
    pub contacts: Vec<(usize, f64, f64, f64)>,
}

/// A contact that just began ends this much further out, m, so that the root finding does not find the same root again.
const HYSTERESIS: f64 = 1e-14;

/// Integrates to `end` with relative and absolute tolerance `tolerance`.
pub fn integrate(equations: &dyn Equations, solver: Solver, tolerance: f64, end: f64) -> Run {
    let mut y = equations.start();
    let mut t = 0.0;
    let mut active: Vec<Option<f64>> = vec![None; equations.gaps(t, &y).len()];
    let mut run = Run { y: Vec::new(), contacts: Vec::new() };
    equations.set_contacts(&active);
    while t < end {
        let (t_next, y_next, root) = integrate_segment(equations, solver, tolerance, t, end, &y, &active, &mut run);
        (t, y) = (t_next, y_next);
        if let Some(j) = root {
            active[j] = match active[j] {
                Some(_) => None,
                None => {
                    let speed = equations.gaps(t, &y)[j].1.max(equations.speed_floor());
                    run.contacts.push((j, t, speed, 0.0));
                    Some(speed)
                }
            };
            equations.set_contacts(&active);
        }
    }
    run.y = y;
    run
}

/// Integrates to the next start or end of a contact, or to `end`: time, state, and the joint.
fn integrate_segment(
    equations: &dyn Equations,
    solver: Solver,
    tolerance: f64,
    start: f64,
    end: f64,
    y: &[f64],
    active: &[Option<f64>],
    run: &mut Run,
) -> (f64, Vec<f64>, Option<usize>) {
    let n = y.len();
    // The implicit solver needs the product of the Jacobian and a vector: by central differences.
    let product = |x: &[f64], _: &[f64], t: f64, v: &[f64], out: &mut [f64]| {
        let size = v.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        let h = 1e-8 / size.max(1e-300);
        let at = |s: f64| {
            let displaced: Vec<f64> = x.iter().zip(v).map(|(x, v)| x + s * h * v).collect();
            let mut dy = vec![0.0; n];
            equations.derivative(t, &displaced, &mut dy);
            dy
        };
        let (plus, minus) = (at(1.0), at(-1.0));
        for i in 0..n {
            out[i] = (plus[i] - minus[i]) / (2.0 * h);
        }
    };
    let roots = |x: &[f64], _: &[f64], t: f64, out: &mut [f64]| {
        for (j, (out, gap)) in out.iter_mut().zip(equations.gaps(t, x)).enumerate() {
            let shift = if active[j].is_some() { HYSTERESIS } else { -HYSTERESIS };
            *out = gap.0 + shift;
        }
    };
    let problem = OdeBuilder::<M>::new()
        .t0(start)
        .h0(1e-7)
        .rtol(tolerance)
        .atol([tolerance])
        .rhs_implicit(|x, _, t, dy| equations.derivative(t, x, dy), product)
        .init(|_, _, out| out.copy_from_slice(y), n)
        .root(roots, active.len())
        .build()
        .unwrap();
    match solver {
        Solver::Tsitouras => step_to_event(problem.tsit45().unwrap(), equations, end, run),
        Solver::Bdf => step_to_event(problem.bdf::<Lu>().unwrap(), equations, end, run),
    }
}

fn step_to_event<'a, Eqn, S>(
    mut solver: S,
    equations: &dyn Equations,
    end: f64,
    run: &mut Run,
) -> (f64, Vec<f64>, Option<usize>)
where
    Eqn: diffsol::OdeEquations<T = f64, M = M, V = diffsol::NalgebraVec<f64>> + 'a,
    S: OdeSolverMethod<'a, Eqn>,
{
    solver.set_stop_time(end).unwrap();
    loop {
        let before = solver.state_vector().t;
        let reason = solver.step().unwrap();
        let (t, root) = match reason {
            OdeSolverStopReason::RootFound(t, j) => (t, Some(j)),
            _ => (solver.state_vector().t, None),
        };
        // Samples forces within the step for the peaks.
        for k in 1..=16 {
            let inside = before + (t - before) * f64::from(k) / 16.0;
            let y = solver.interpolate(inside).unwrap().clone_as_vec();
            for (j, force) in equations.forces(inside, &y).into_iter().enumerate() {
                if let Some(contact) = run.contacts.iter_mut().rev().find(|c| c.0 == j) {
                    contact.3 = contact.3.max(force);
                }
            }
        }
        if root.is_some() || reason == OdeSolverStopReason::TstopReached {
            return (t, solver.interpolate(t).unwrap().clone_as_vec(), root);
        }
    }
}
