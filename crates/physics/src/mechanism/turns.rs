//! Turns of joint angles. Coordinates of trees and drive laws count them, poses of bodies do not. An angle that follows from poses
//! alone is counted at the ends of steps: that of a joint that closes a loop, and in the `lagrange` form of any joint without a
//! drive. The state then contains the nearest number of quarter turns.

use std::f64::consts::FRAC_PI_2;

use super::Mechanism;
use super::elements::{AngleReference, ForceElement};
use super::equations::Equations;
use super::model::{Body, BodyIndex, Model, Motion};
use super::tree::Tree;
use crate::machine::{Formulation, Machine};

/// Maximum number of parts of the line from the pose of the scene to a position of rest.
const MAX_PARTS: f64 = 1000.0;

/// Angles that force elements act on, and angles that are counted.
pub(super) struct Turns {
    /// Elements on angles that the equations count, each with the body below the joint.
    followed: Vec<(usize, BodyIndex)>,
    /// Angles that follow from poses; those that elements act on come first.
    counted: Vec<Counted>,
    /// Number of those that elements act on.
    with_elements: usize,
    /// Index in `counted` of each coordinate in the order of [`Mechanism::coordinates`], if it is counted.
    index: Vec<Option<usize>>,
    /// Whether a run counts turns at the ends of its steps. Until then, as in the search of a rest, angles follow every evaluation.
    is_running: bool,
}

/// An angle that follows from poses.
struct Counted {
    source: CoordinateLocation,
    /// Elements that act on it.
    elements: Vec<usize>,
    reference: AngleReference,
}

/// Location of a joint coordinate.
#[derive(Clone, Copy)]
enum CoordinateLocation {
    /// The one-degree joint above this body.
    Above(BodyIndex),
    /// A loop-closing joint and which of its coordinates.
    Closing(usize, usize),
}

impl CoordinateLocation {
    fn is_angle(self, model: &Model) -> bool {
        match self {
            Self::Above(body) => {
                matches!(model.bodies[body].motion, Motion::Revolute { .. } | Motion::Driven { revolute: true, .. })
            }
            Self::Closing(closure, part) => model.closures[closure].kind.freedoms()[part].turns(),
        }
    }

    /// Whether it follows from poses alone.
    fn is_counted(self, machine: &Machine, model: &Model) -> bool {
        match self {
            Self::Above(body) => {
                machine.formulation == Formulation::Lagrange
                    && matches!(model.bodies[body].motion, Motion::Revolute { .. })
            }
            Self::Closing(..) => self.is_angle(model),
        }
    }

    /// Its coordinate and rate after a motion at `y`.
    fn coordinate(self, equations: &dyn Equations, model: &Model, y: &[f64]) -> Option<[f64; 2]> {
        match self {
            Self::Above(body) => equations.coordinate(model, y, body),
            Self::Closing(closure, part) => model.closures[closure].coordinates(equations.motion()).nth(part),
        }
    }
}

impl Counted {
    /// Sets the reference, also of its elements.
    fn set_reference(&mut self, time: f64, angle: f64, elements: &mut [Box<dyn ForceElement>]) {
        self.reference = AngleReference { time, angle };
        for &element in &self.elements {
            elements[element].set_angle_reference(self.reference);
        }
    }
}

impl Turns {
    pub(super) fn new(machine: &Machine, model: &Model) -> Self {
        let is_coordinate = |&b: &BodyIndex| !matches!(model.bodies[b].motion, Motion::Fixed | Motion::Free { .. });
        let above = model.order.iter().copied().filter(is_coordinate).map(CoordinateLocation::Above);
        let closing = model.closures.iter().enumerate();
        let closing = closing.flat_map(|(closure, pair)| {
            (0..pair.kind.freedoms().len()).map(move |part| CoordinateLocation::Closing(closure, part))
        });
        let sources: Vec<CoordinateLocation> = above.chain(closing).collect();
        let acting = elements_by_coordinate(machine, sources.len());
        let mut turns = Self {
            followed: Vec::new(),
            counted: Vec::new(),
            with_elements: 0,
            index: vec![None; sources.len()],
            is_running: false,
        };
        for has_elements in [true, false] {
            for (i, (&source, elements)) in sources.iter().zip(&acting).enumerate() {
                if elements.is_empty() == has_elements {
                    continue;
                }
                if source.is_counted(machine, model) {
                    turns.index[i] = Some(turns.counted.len());
                    let reference = AngleReference::default();
                    turns.counted.push(Counted { source, elements: elements.clone(), reference });
                } else if let CoordinateLocation::Above(body) = source
                    && source.is_angle(model)
                {
                    turns.followed.extend(elements.iter().map(|&element| (element, body)));
                }
            }
            if has_elements {
                turns.with_elements = turns.counted.len();
            }
        }
        turns
    }

    /// Takes the turns at the start from the tree coordinates `y`. A joint that closes a loop starts within half a turn of 0 or, if
    /// `y` is a position of rest, of where the scene places its bodies: from there its angle is followed to `y` along a straight
    /// line. `tree` is left at `y`.
    pub(super) fn start(&mut self, model: &Model, tree: &mut Tree, y: &[f64]) {
        for counted in &mut self.counted {
            counted.reference = AngleReference::default();
            if let CoordinateLocation::Above(body) = counted.source
                && let Motion::Revolute { q, .. } = model.bodies[body].motion
            {
                counted.reference.angle = y[q];
            }
        }
        if model.settled.is_none() || model.closures.is_empty() {
            return;
        }
        let given = &model.start_state;
        let turned = |body: &Body| match body.motion {
            Motion::Revolute { q, .. } => (y[q] - given[q]).abs(),
            // The components of a quaternion change by up to half the angle.
            Motion::Free { q, .. } => (q + 3..q + 7).map(|i| 2.0 * (y[i] - given[i]).abs()).sum(),
            Motion::Prismatic { .. } | Motion::Fixed | Motion::Driven { .. } => 0.0,
        };
        // At most about 1 rad each.
        let parts = model.bodies.iter().map(turned).sum::<f64>().ceil().clamp(1.0, MAX_PARTS) as usize;
        let mut between = y.to_vec();
        for part in 0..=parts {
            let share = part as f64 / parts as f64;
            for ((between, from), to) in between.iter_mut().zip(given).zip(y) {
                *between = from + share * (to - from);
            }
            tree.update_kinematics(model, 0.0, &between);
            for counted in &mut self.counted {
                if let CoordinateLocation::Closing(closure, part) = counted.source
                    && let Some([angle, _]) = model.closures[closure].coordinates(&tree.motion).nth(part)
                    && angle.is_finite()
                {
                    counted.reference.angle = angle + counted.reference.whole_turns(angle, 0.0, 0.0);
                }
            }
        }
        tree.update_kinematics(model, 0.0, y);
    }

    /// Sets the references of elements on angles that the equations count, after a motion at (`t`, `y`), and before a run also
    /// those of the others.
    pub(super) fn follow(
        &mut self,
        elements: &mut [Box<dyn ForceElement>],
        equations: &dyn Equations,
        model: &Model,
        (t, y): (f64, &[f64]),
    ) {
        for &(element, body) in &self.followed {
            if let Some([angle, _]) = equations.coordinate(model, y, body) {
                elements[element].set_angle_reference(AngleReference { time: t, angle });
            }
        }
        if self.is_running {
            return;
        }
        for counted in &mut self.counted[..self.with_elements] {
            if let Some([angle, _]) = counted.source.coordinate(equations, model, y)
                && angle.is_finite()
            {
                let angle = angle + counted.reference.whole_turns(angle, 0.0, t);
                counted.set_reference(t, angle, elements);
            }
        }
    }
}

/// The elements that act on each of `coordinates` joint coordinates.
fn elements_by_coordinate(machine: &Machine, coordinates: usize) -> Vec<Vec<usize>> {
    let joints: Vec<_> = machine
        .kinematic_joints()
        .scan(0, |next, joint| {
            let (first, freedoms) = (*next, joint.kind.freedoms());
            *next += freedoms.len();
            Some((first, freedoms))
        })
        .collect();
    let mut acting = vec![Vec::new(); coordinates];
    for (number, element) in machine.elements.iter().enumerate() {
        if let Some(on) = element.coordinate()
            && let (first, freedoms) = joints[on.joint]
            && let Some(part) = freedoms.iter().position(|&freedom| freedom == on.freedom)
        {
            acting[first + part].push(number);
        }
    }
    acting
}

fn quarter_turns(angle: f64) -> i64 {
    libm::round(angle / FRAC_PI_2) as i64
}

impl Mechanism {
    /// Coordinates and rates of all sliding or turning joints after an evaluation at (`t`, `y`): tree joints in scene order, then
    /// joints that close loops. Angles count turns.
    pub fn coordinates(&self, t: f64, y: &[f64]) -> impl Iterator<Item = [f64; 2]> {
        let above = self.model.order.iter();
        let above = above.filter_map(move |&b| self.equations.coordinate(&self.model, y, b));
        let closures = self.model.closures.iter();
        let closing = closures.flat_map(|pair| pair.coordinates(self.equations.motion()));
        above.chain(closing).zip(&self.turns.index).map(move |([value, rate], &counted)| {
            let turns = |i: usize| self.turns.counted[i].reference.whole_turns(value, rate, t);
            [counted.map_or(value, |i| value + turns(i)), rate]
        })
    }

    /// Nearest numbers of quarter turns of the angles that follow from poses: of those that elements act on, and of the others.
    pub(crate) fn quarter_turns(&self) -> [Vec<i64>; 2] {
        let (with_elements, others) = self.turns.counted.split_at(self.turns.with_elements);
        [with_elements, others].map(|all| all.iter().map(|counted| quarter_turns(counted.reference.angle)).collect())
    }

    /// Sets these numbers for the time `t`, s, with those of the angles that elements act on first. A run begins.
    pub(crate) fn set_quarter_turns<'a>(&mut self, t: f64, all: impl Iterator<Item = &'a i64>) {
        let Self { turns, elements, .. } = self;
        turns.is_running = true;
        for (counted, &quarters) in turns.counted.iter_mut().zip(all) {
            counted.set_reference(t, quarters as f64 * FRAC_PI_2, elements);
        }
    }

    /// Updates these numbers to the motion at (`t`, `y`), which is the end of a step.
    pub(crate) fn count_turns<'a>(&mut self, t: f64, y: &[f64], all: impl Iterator<Item = &'a mut i64>) {
        if self.turns.counted.is_empty() {
            return;
        }
        if !self.is_measured_at(t) {
            self.forget_evaluation();
            self.equations.update_kinematics(&self.model, t, y);
        }
        let Self { turns, equations, model, elements, .. } = self;
        for (counted, quarters) in turns.counted.iter_mut().zip(all) {
            if let Some([angle, rate]) = counted.source.coordinate(&**equations, model, y) {
                *quarters = quarter_turns(angle + counted.reference.whole_turns(angle, rate, t));
                counted.set_reference(t, *quarters as f64 * FRAC_PI_2, elements);
            }
        }
    }
}
