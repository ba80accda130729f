//! The equations of motion as what the steppers ask for.

use super::implicit::{ImplicitContacts, TURNS};
use super::lagrange::Lagrange;
use super::tree::{self, Tree};
use super::{Form, Mechanism, stiff};
use crate::integrate::{ContactSystem, StiffSystem, System};

impl System for Mechanism {
    fn dimension(&self) -> usize {
        match &self.form {
            Form::Tree { .. } => self.model.nq + self.model.nv,
            Form::Lagrange(_) => 13 * self.model.bodies.len(),
        }
    }

    fn positions(&self) -> usize {
        match &self.form {
            Form::Tree { .. } => self.model.nq,
            Form::Lagrange(_) => 7 * self.model.bodies.len(),
        }
    }

    fn derivative(&mut self, t: f64, y: &[f64], dy: &mut [f64]) {
        self.evaluations += 1;
        self.evaluated = t;
        let Self {
            model,
            form,
            contacts,
            gravity,
            ..
        } = self;
        match form {
            Form::Tree { tree, constraints } => {
                tree.forward(model, t, y);
                tree.load(t, contacts);
                let (dq, dv) = dy.split_at_mut(model.nq);
                Tree::position_rate(model, y, dq);
                tree.assemble(model, gravity, dv);
                tree.solve(model, dv);
                if let Some(constraints) = constraints {
                    constraints.correct(model, tree, t, &y[..model.nq], dv);
                }
            }
            Form::Lagrange(lagrange) => {
                let n = model.bodies.len();
                lagrange.forward(model, t, y);
                let (dq, dv) = dy.split_at_mut(7 * n);
                Lagrange::position_rate(n, y, dq);
                lagrange.accelerations(model, contacts, gravity, t, dv);
            }
        }
    }

    fn position_rate(&mut self, _t: f64, y: &[f64], dy: &mut [f64]) {
        match &self.form {
            Form::Tree { .. } => Tree::position_rate(&self.model, y, dy),
            Form::Lagrange(_) => Lagrange::position_rate(self.model.bodies.len(), y, dy),
        }
    }

    fn scale(&self) -> &[f64] {
        match &self.form {
            Form::Tree { .. } => &self.model.scale,
            Form::Lagrange(lagrange) => lagrange.scale(),
        }
    }
}

impl StiffSystem for Mechanism {
    fn linearise(&mut self, t: f64, y: &[f64]) {
        let positions = self.positions();
        self.prepare_linearisation();
        let Some(mut stiff) = self.stiff.take() else {
            return;
        };
        // Prescribed motion is what moves contacts by time alone; bodies that are states stand still in that sense.
        if let Form::Tree { tree, .. } = &mut self.form {
            let mut at_rest = std::mem::take(&mut stiff.derivative);
            at_rest[..positions].copy_from_slice(&y[..positions]);
            at_rest[positions..].fill(0.0);
            tree.forward(&self.model, t, &at_rest);
            stiff.observe_drift(&self.model, &tree.motion);
            stiff.derivative = at_rest;
        }
        let mut now = std::mem::take(&mut stiff.derivative);
        self.derivative(t, y, &mut now);
        stiff.derivative = now;
        let Self {
            model,
            form,
            contacts,
            ..
        } = self;
        match form {
            Form::Tree { tree, constraints } => {
                let motion = &tree.motion;
                stiff.gather(model, contacts, motion, y, |body, point, visit| {
                    if body < model.bodies.len() && !model.bodies[body].driven_only {
                        let first = model.blocks[model.block_of[body]].v;
                        tree::visit_columns(model, motion, body, point, |c, v, w| {
                            visit(first + c, v, w)
                        });
                    }
                });
                stiff.mobilise(|x| {
                    tree.solve(model, x);
                    if let Some(constraints) = constraints {
                        constraints.restrain(model, x);
                    }
                });
            }
            Form::Lagrange(lagrange) => {
                let motion = &lagrange.motion;
                stiff.gather(model, contacts, motion, y, |body, point, mut visit| {
                    if body < model.bodies.len() {
                        tree::visit_free(6 * body, &(point - motion[body].position), &mut visit);
                    }
                });
                stiff.mobilise(|x| lagrange.mobilise(model, x));
            }
        }
        self.stiff = Some(stiff);
    }

    fn factor_shifted(&mut self, shift: f64) {
        if let Some(stiff) = &mut self.stiff {
            stiff.factor(shift);
        }
    }

    fn solve_shifted(&mut self, b: &mut [f64]) {
        let Self {
            model, form, stiff, ..
        } = self;
        let Some(stiff) = stiff else { return };
        match form {
            Form::Tree { .. } => stiff.solve(b, &stiff::TreeMap(model)),
            Form::Lagrange(_) => stiff.solve(b, &stiff::BodyMap(model.bodies.len())),
        }
    }

    fn factor_shifted_pair(&mut self, real: f64, imaginary: f64) {
        if let Some(stiff) = &mut self.stiff {
            stiff.factor_pair(nalgebra::Complex::new(real, imaginary));
        }
    }

    fn solve_shifted_pair(&mut self, b_real: &mut [f64], b_imaginary: &mut [f64]) {
        let Self {
            model, form, stiff, ..
        } = self;
        let Some(stiff) = stiff else { return };
        match form {
            Form::Tree { .. } => stiff.solve_pair(b_real, b_imaginary, &stiff::TreeMap(model)),
            Form::Lagrange(_) => {
                stiff.solve_pair(b_real, b_imaginary, &stiff::BodyMap(model.bodies.len()));
            }
        }
    }

    fn time_derivative(&self) -> &[f64] {
        self.stiff
            .as_ref()
            .map_or(&[], |stiff| &stiff.time_derivative)
    }
}

impl ContactSystem for Mechanism {
    fn derivative_apart(&mut self, t: f64, y: &[f64], dy: &mut [f64]) {
        self.contacts.apart = true;
        self.derivative(t, y, dy);
        self.contacts.apart = false;
    }

    fn contact_push(&mut self, t: f64, h: f64, y: &mut [f64], dv: &mut [f64]) -> bool {
        // Ideal joints close first: contacts feel less than these may be open by.
        self.project(t, y);
        self.measure(t, y);
        // Refused, if at all, where the method was chosen.
        let _ = self.prepare_implicit_contacts();
        let Some(mut implicit) = self.implicit.take() else {
            return false;
        };
        let touches = implicit.gather(&self.model, &self.contacts);
        if touches {
            for _ in 0..TURNS {
                if !self.find_contact_forces(h, &mut implicit) {
                    break;
                }
            }
            dv.fill(0.0);
            implicit.push(h, &mut dv[self.positions()..]);
        }
        self.implicit = Some(implicit);
        touches
    }
}

impl Mechanism {
    /// Contact forces at the end of a step of size `h`, for the state just measured; whether a normal turned on the way.
    fn find_contact_forces(&mut self, h: f64, implicit: &mut ImplicitContacts) -> bool {
        let Self {
            model,
            form,
            contacts,
            ..
        } = self;
        match form {
            Form::Tree { tree, constraints } => {
                let motion = &tree.motion;
                implicit.arrange(model, contacts, motion, |body, point, visit| {
                    if body < model.bodies.len() && !model.bodies[body].driven_only {
                        let first = model.blocks[model.block_of[body]].v;
                        tree::visit_columns(model, motion, body, point, |c, v, w| {
                            visit(first + c, v, w)
                        });
                    }
                });
                implicit.solve(h, |(first, end), x| {
                    if let Some(constraints) = constraints {
                        tree.solve(model, x);
                        constraints.restrain(model, x);
                    } else {
                        tree.solve_within(model, first, end, x);
                    }
                })
            }
            Form::Lagrange(lagrange) => {
                let motion = &lagrange.motion;
                implicit.arrange(model, contacts, motion, |body, point, mut visit| {
                    if body < model.bodies.len() {
                        tree::visit_free(6 * body, &(point - motion[body].position), &mut visit);
                    }
                });
                implicit.solve(h, |_, x| lagrange.mobilise(model, x))
            }
        }
    }
}
