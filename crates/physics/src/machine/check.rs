//! Consistency checks of a machine, and warnings about choices that are allowed but doubtful.

use std::cmp::Ordering;

use super::{
    Brief, Characteristic, Doubt, Drive, Element, ElementKind, JointCoordinate, JointKind, LooseFault, LooseJoint,
    Lubricant, Machine, Warning,
};
use crate::contact::{self, ApproachSpeed, FrictionLaw, NormalLaw};
use crate::integrate::StepControl;
use crate::interpolate::{Ends, Interpolant, Interpolation, Overshoot};
use crate::units::{Dimension, format_quantity, unit_names};

/// Minimum number of fixed steps per impact. With fewer, much of the impact is lost; twice as many resolve it.
pub const MIN_IMPACT_STEPS: u64 = 5;
/// Longest step of rk4 that is stable, over the time in which what it steps decays: it must not reach 2.785.
const STABLE_STEP: f64 = 2.5;

/// Loosest tolerance at which impacts conserve energy to a few per cent.
const LOOSEST_TOLERANCE: f64 = 1e-3;

/// Maximum number of sentences about joints with play; one more stands for the rest.
const MAX_LISTED: usize = 40;

/// Largest accepted error of a law's restitution. The paper's 0.9, which its law turns into 0.913, is within it.
const RESTITUTION_ERROR: f64 = 0.02;

/// A stop of a slide counts as a ball with a radius of this many times its depth.
const DEPTH_FACTOR: f64 = 50.0;

/// Allowed asymmetry of an inertia, as a fraction of its largest component.
const ROUNDING: f64 = 1e-9;

/// Fault of a machine built in code; a scene file reports it with its line.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MachineFault {
    /// No body.
    #[error("a machine needs at least one body")]
    Empty,
    /// The joints do not match the bodies one to one, in body order.
    #[error(
        "the joint that carries body {body} must be at the same index of `joints`, with `child` = {body} (counted \
         from 0)"
    )]
    Joints {
        /// Index.
        body: usize,
    },
    /// A parent does not precede its child.
    #[error("the parent of body {body} must come before it (counted from 0)")]
    Order {
        /// Index of the child.
        body: usize,
    },
    /// A point refers to a body that does not exist.
    #[error("{what} refers to body {body}, but the machine has {bodies} bodies (counted from 0)")]
    NoBody {
        /// The joint or element with that point.
        what: String,
        /// Index.
        body: usize,
        /// Number of bodies.
        bodies: usize,
    },
    /// A joint does not have this coordinate.
    #[error("force element {element} acts on a coordinate that no joint has")]
    NoCoordinate {
        /// Name of the element.
        element: String,
    },
    /// A lubricant that is in no ball or pin with a size.
    #[error("lubricant {element} is in no joint with play that holds one: a ball, or a pin with a length")]
    NoLubricant {
        /// Name of the element.
        element: String,
    },
    /// A body has no valid inertia.
    #[error("body {body}: mass must be above 0 kg, and the inertia symmetric and positive definite")]
    Inertia {
        /// Name of the body.
        body: String,
    },
    /// A body without mass that would make the mass matrix singular in every pose.
    #[error("body {body} has mass 0 kg, which only a body between joints may have: {why}")]
    Massless {
        /// Name of the body.
        body: String,
        /// The reason.
        why: MasslessFault,
    },
    /// Points of a curve or of a table of positions that do not rise.
    #[error("{what}: a curve needs at least two finite points with increasing first coordinates")]
    Points {
        /// Name of the joint or element.
        what: String,
    },
    /// A table of straight lines for a coordinate: its rate would jump.
    #[error("{what}: a drive needs two derivatives, so that its table cannot be linear; allowed spline, monotone")]
    Kinks {
        /// Name of the joint or element.
        what: String,
    },
    /// A function that the machine's closed form does not have, or a force element that follows one.
    #[error("{what} follows function {function} of a closed form (counted from 0), which it does not have")]
    NoFunction {
        /// Name of the joint or element.
        what: String,
        /// Index of the function.
        function: usize,
    },
    /// Contact parameters contradict one another.
    #[error("{joint}: {fault}")]
    Contact {
        /// Name of the joint with play; "contact" for the machine as a whole.
        joint: String,
        /// The contradiction.
        fault: ContactFault,
    },
}

/// Why a body needs a mass. A body without mass and inertia may only connect joints, as the cross of a universal joint does: the
/// mass matrix has the mass of all bodies beyond a joint on its diagonal, so that it must carry another body on a slide or a
/// hinge.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MasslessFault {
    /// Nothing bounds its motion.
    #[error("it is carried by a free joint")]
    Free,
    /// No mass moves with it.
    #[error("it carries no body")]
    Leaf,
    /// A force on it would act on no mass before it reaches the joints.
    #[error("joint with play {0} is on it")]
    Loose(String),
}

impl Machine {
    /// The first body without mass that the machine cannot have, by index.
    ///
    /// # Errors
    /// That body, and why.
    pub fn check_massless(&self) -> Result<(), (usize, MasslessFault)> {
        let mut massless = self.bodies.iter().zip(&self.joints).enumerate().filter(|(_, (body, _))| body.mass == 0.0);
        let ends = |joint: &LooseJoint| [joint.carrier().body, joint.carried().body];
        massless.try_for_each(|(index, (_, joint))| {
            let ball = self.loose_joints.iter().find(|ball| ends(ball).contains(&Some(index)));
            let why = match ball {
                _ if joint.kind == JointKind::Free => MasslessFault::Free,
                _ if self.joints.iter().all(|joint| joint.parent != Some(index)) => MasslessFault::Leaf,
                Some(ball) => MasslessFault::Loose(ball.name.clone()),
                None => return Ok(()),
            };
            Err((index, why))
        })
    }

    /// Checks that the parts fit together, as those of every scene file do.
    ///
    /// # Errors
    /// The first fault.
    pub fn check(&self) -> Result<(), MachineFault> {
        let bodies = self.bodies.len();
        if bodies == 0 {
            return Err(MachineFault::Empty);
        }
        let exists = |what: &str, body: Option<usize>| match body {
            Some(body) if body >= bodies => Err(MachineFault::NoBody { what: what.to_owned(), body, bodies }),
            _ => Ok(()),
        };
        for (index, body) in self.bodies.iter().enumerate() {
            if self.joints.get(index).is_none_or(|joint| joint.child != index) {
                return Err(MachineFault::Joints { body: index });
            }
            let skew = (body.inertia - body.inertia.transpose()).amax();
            let symmetric = skew <= ROUNDING * body.inertia.amax();
            let definite = symmetric && body.inertia.symmetric_eigenvalues().min() > 0.0;
            let massless = body.mass == 0.0 && body.inertia.amax() == 0.0;
            let heavy = body.mass > 0.0 && body.mass.is_finite() && definite;
            if !(massless || heavy) {
                return Err(MachineFault::Inertia { body: body.name.clone() });
            }
        }
        if let Some(extra) = self.joints.get(bodies) {
            return exists(&extra.name, Some(bodies));
        }
        self.check_massless()
            .map_err(|(index, why)| MachineFault::Massless { body: self.bodies[index].name.clone(), why })?;
        let misplaced = self.joints.iter().find(|joint| joint.parent.is_some_and(|parent| parent >= joint.child));
        misplaced.map_or(Ok(()), |joint| Err(MachineFault::Order { body: joint.child }))?;
        for joint in &self.closing_joints {
            exists(&joint.name, joint.parent.max(Some(joint.child)))?;
        }
        for joint in &self.loose_joints {
            exists(&joint.name, joint.carrier().body.max(joint.carried().body))?;
        }
        for element in &self.elements {
            let has = |on: JointCoordinate| {
                let joint = self.kinematic_joints().nth(on.joint);
                joint.is_some_and(|joint| joint.kind.freedoms().contains(&on.freedom))
            };
            if element.coordinate().is_some_and(|on| !has(on)) {
                return Err(MachineFault::NoCoordinate { element: element.name.clone() });
            }
            if let ElementKind::Lubricant(lubricant) = &element.kind
                && !lubricant.is_held(self)
            {
                return Err(MachineFault::NoLubricant { element: element.name.clone() });
            }
            element.points(self).iter().try_for_each(|point| exists(&element.name, point.body))?;
        }
        exists("output", Some(self.output.body))?;
        self.check_laws()?;
        self.check_contacts().map_err(|conflict| {
            let joint = conflict.joint.map_or("contact", |joint| &self.loose_joints[joint].name);
            MachineFault::Contact { joint: joint.to_owned(), fault: conflict.fault }
        })
    }

    /// Checks curves and time laws.
    fn check_laws(&self) -> Result<(), MachineFault> {
        let functions = self.closed_form.as_ref().map_or(0, |form| form.functions.len());
        let drives =
            self.joints.iter().flat_map(|joint| joint.drives().map(|(_, drive)| (&joint.name, drive, functions)));
        // Elements follow laws of their own.
        let laws = self.elements.iter().filter_map(|element| Some((&element.name, element.describe().law?.1, 0)));
        for (what, drive, functions) in drives.chain(laws) {
            if let &Drive::Function(function) = drive
                && function >= functions
            {
                return Err(MachineFault::NoFunction { what: what.clone(), function });
            }
        }
        for PointTable { of, points, interpolation, may_have_kinks, .. } in self.tables() {
            let finite = points.iter().flatten().all(|number| number.is_finite());
            let rising = points.len() >= 2 && points.windows(2).all(|pair| pair[0][0] < pair[1][0]);
            if !(finite && rising) {
                return Err(MachineFault::Points { what: of.to_owned() });
            }
            if interpolation == Interpolation::Linear && !may_have_kinks {
                return Err(MachineFault::Kinks { what: of.to_owned() });
            }
        }
        Ok(())
    }

    /// Every table of a drive, a time law or a characteristic.
    fn tables(&self) -> impl Iterator<Item = PointTable<'_>> {
        let of_drive = |what, of, drive, value: &'static str, may_have_kinks| match drive {
            &Drive::Table { ref points, interpolation, repeats } => Some(PointTable {
                what,
                of,
                points,
                interpolation,
                ends: Ends::of_motion(repeats),
                units: ["s", value],
                may_have_kinks,
            }),
            _ => None,
        };
        let unit = |turns: bool| if turns { "deg" } else { "mm" };
        let drives = self.joints.iter().flat_map(move |joint| {
            let drives = joint.drives();
            drives.filter_map(move |(freedom, drive)| {
                of_drive("drive", joint.name.as_str(), drive, unit(freedom.turns()), false)
            })
        });
        let laws = self.elements.iter().filter_map(move |element| {
            let (what, drive) = element.describe().law?;
            let is_factor = what == "factor";
            let unit = if is_factor { "" } else { unit(element.is_on_hinge()) };
            of_drive(what, element.name.as_str(), drive, unit, is_factor)
        });
        let characteristics = self.elements.iter().flat_map(|element| {
            let both = element.describe().spring.into_iter().flatten();
            let units = if element.is_on_hinge() { ["deg", "deg/s", "N m"] } else { ["mm", "mm/s", "N"] };
            let names = [("characteristic", units[0]), ("damping", units[1])];
            both.zip(names).filter_map(move |(characteristic, (what, unit))| match *characteristic {
                Characteristic::Line { .. } => None,
                Characteristic::Curve { ref points, interpolation } => Some(PointTable {
                    what,
                    of: &element.name,
                    points,
                    interpolation,
                    ends: Ends::Natural,
                    units: [unit, units[2]],
                    may_have_kinks: true,
                }),
            })
        });
        drives.chain(laws).chain(characteristics)
    }

    /// Warns of splines that overshoot.
    fn overshoot_warning(&self) -> Option<Doubt> {
        let splines =
            self.tables().filter(|table| table.interpolation == Interpolation::Spline && table.points.len() >= 2);
        let excess = |overshoot: &Overshoot| overshoot.excess() / (overshoot.range[1] - overshoot.range[0]);
        let beyond = splines.filter_map(|table| {
            let overshoot = Interpolant::new(table.points, table.interpolation, table.ends).overshoot()?;
            Some((table, overshoot))
        });
        let beyond: Vec<_> = beyond.collect();
        let (table, overshoot) = beyond.iter().max_by(|a, b| excess(&a.1).total_cmp(&excess(&b.1)))?;
        let PointTable { what, of, units, .. } = table;
        let others = beyond.len() - 1;
        Some(Doubt::Overshoot { table: format!("{what} of {of}"), others, overshoot: *overshoot, units: *units })
    }

    /// The doubt about a film that cannot become as thin as half of its gap.
    fn thick_film(&self, element: &Element) -> Option<Doubt> {
        let ElementKind::Lubricant(Lubricant { joint, thickness, .. }) = element.kind else { return None };
        let joint = &self.loose_joints[joint];
        let play = joint.contact.clearance;
        let (lubricant, joint) = (element.name.clone(), joint.name.clone());
        (play > 0.0 && thickness > 0.5 * play).then_some(Doubt::Lubricant { lubricant, joint, thickness, play })
    }

    /// Length scale of relative tolerances, m: the smallest ball radius, or 50 times the smallest depth of a slide's stop, at
    /// most 1 m. A loop-closing joint counts as a ball joint of the scene's radius, as does a scene without any of these.
    pub fn length_scale(&self) -> f64 {
        let radii = self.loose_joints.iter().map(|joint| joint.contact.ball_radius);
        let closing = self.closing_joints.iter().map(|_| self.contact.ball_radius);
        let on_slides = self.elements.iter().filter(|element| !element.is_on_hinge());
        let depths = on_slides.filter_map(|element| Some(DEPTH_FACTOR * element.describe().stop_depth?));
        let smallest = radii.chain(closing).chain(depths).reduce(f64::min);
        smallest.unwrap_or(self.contact.ball_radius).min(1.0)
    }

    /// Checks the contact parameters of each joint for consistency.
    pub fn check_contacts(&self) -> Result<(), ContactConflict> {
        let joints = self.loose_joints.iter().enumerate();
        let own = joints.clone().map(|(index, joint)| (Some(index), &joint.contact));
        for (joint, contact) in std::iter::once((None, &self.contact)).chain(own) {
            check_contact(contact).map_err(|fault| ContactConflict { joint, fault })?;
        }
        for (index, joint) in joints {
            let fault = |fault| ContactConflict { joint: Some(index), fault: ContactFault::Loose(fault) };
            joint.check(self.start).map_err(fault)?;
        }
        Ok(())
    }

    /// Allowed choices that may not be what the user expects: [`Self::doubts`], and causes of slow stepping.
    pub fn warnings(&self) -> Vec<Warning> {
        let doubts = self.doubts().into_iter();
        let mut warnings: Vec<Warning> = doubts.map(Warning::Doubt).collect();
        let doubts = warnings.len();
        for (joints, contact) in self.contact_groups() {
            if warnings.len() - doubts >= MAX_LISTED {
                warnings.push(Warning::Doubt(Doubt::MoreJoints));
                break;
            }
            if contact.clearance > 0.0
                && contact.slip_speed_high < 1e-6
                && contact.friction_law == FrictionLaw::ModifiedCoulomb
            {
                warnings.push(Warning::StiffFriction { joints, slip_speed_high: contact.slip_speed_high });
            }
        }
        warnings.extend(self.mesh_unit_warning());
        warnings
    }

    /// Reasons to doubt any result of this scene, whatever happens in the run.
    pub fn doubts(&self) -> Vec<Doubt> {
        let mut doubts = Vec::new();
        for (joints, contact) in self.contact_groups() {
            if doubts.len() >= MAX_LISTED {
                doubts.push(Doubt::MoreJoints);
                break;
            }
            // Where parts yield, also sixteen times as fast, where half of the restitution is asked for.
            let yielding = (contact.yield_speed > 0.0).then_some(16.0 * contact.yield_speed);
            for yielding in std::iter::once(None).chain(yielding.map(Some)) {
                let law = contact.normal_law;
                let requested = if yielding.is_some() { 0.5 * contact.restitution } else { contact.restitution };
                let achieved = contact::undisturbed_restitution(law.damping_factor(requested));
                if contact.clearance > 0.0 && (achieved - requested).abs() > RESTITUTION_ERROR {
                    doubts.push(Doubt::Restitution { joints: joints.clone(), law, requested, achieved, yielding });
                }
            }
            if contact.clearance > 0.0 && contact.clearance <= 1e-5 {
                doubts.push(Doubt::Clearance {
                    joints,
                    clearance: contact.clearance,
                    ball_radius: contact.ball_radius,
                });
            }
        }
        doubts.extend(self.loose_joints.iter().filter_map(LooseJoint::short_pin).take(MAX_LISTED));
        doubts.extend(self.elements.iter().filter_map(|element| self.thick_film(element)).take(MAX_LISTED));
        doubts.extend(self.step_warning());
        doubts.extend(self.tolerance_warning());
        doubts.extend(self.overshoot_warning());
        doubts
    }

    /// Warns of a tolerance too loose for impacts.
    fn tolerance_warning(&self) -> Option<Doubt> {
        let has_clearance = self.loose_joints.iter().any(|j| !j.contact.is_ideal());
        let loose = self.solver.method.is_adaptive() && self.solver.tolerance > LOOSEST_TOLERANCE;
        (has_clearance && loose)
            .then_some(Doubt::Tolerance { tolerance: self.solver.tolerance, loosest: LOOSEST_TOLERANCE })
    }

    /// Warns of a fixed step too long for the shortest expected impact, and recommends a shorter one.
    fn step_warning(&self) -> Option<Doubt> {
        if self.solver.method.control() != StepControl::Fixed {
            return None;
        }
        let clearances = self.loose_joints.iter().filter(|j| !j.contact.is_ideal());
        let element_forces = self.element_forces();
        let of_impacts = clearances.clone().map(|joint| {
            let (impact, friction) = self.impact_duration(joint, &element_forces);
            let brief = if friction > 1.0 { Brief::Sliding } else { Brief::Impact };
            (joint, impact / friction, MIN_IMPACT_STEPS as f64, brief)
        });
        let of_bristles = clearances.filter(|joint| joint.contact.has_bristles()).map(|joint| {
            let lag = joint.contact.bristle_damping / joint.contact.bristle_stiffness;
            (joint, lag, 1.0 / STABLE_STEP, Brief::Bristles)
        });
        let (joint, duration, steps, brief) =
            of_impacts.chain(of_bristles).min_by(|a, b| (a.1 / a.2).total_cmp(&(b.1 / b.2)))?;
        if self.solver.step <= duration / steps {
            return None;
        }
        // Round down to 1, 2 or 5 times a power of ten.
        let most = duration / (2.0 * steps);
        let decade = libm::pow(10.0, libm::floor(libm::log10(most)));
        let digit = [5.0, 2.0, 1.0].into_iter().find(|d| d * decade <= most);
        let recommended = digit.unwrap_or(1.0) * decade;
        Some(Doubt::Step { joint: joint.name.clone(), step: self.solver.step, duration, brief, recommended })
    }

    /// Sum of the magnitudes of the element forces on each body, N, without the stretch of springs, which needs the start poses.
    fn element_forces(&self) -> Vec<f64> {
        let mut element_forces = vec![0.0; self.bodies.len()];
        for element in &self.elements {
            for body in element.points(self).iter().filter_map(|point| point.body) {
                element_forces[body] += element.own_force();
            }
        }
        element_forces
    }

    /// Bound on the relative acceleration of bodies under gravity and forces, given as pairs of N and kg, m/s^2.
    pub(crate) fn max_acceleration(&self, element_forces: impl IntoIterator<Item = (f64, f64)>) -> f64 {
        let element_forces = element_forces.into_iter().map(|(force, mass)| force / mass);
        element_forces.fold(self.gravity.norm(), |sum, push| sum + push)
    }

    /// Estimated duration of the first impact of a joint with clearance, s, when gravity and the forces `element_forces` (N, by
    /// body) drive its bodies through the gap, or of the oscillation under those forces, if shorter. The second value is how many
    /// times within it friction could reverse sliding at the approach speed, at least 1.
    fn impact_duration(&self, joint: &LooseJoint, element_forces: &[f64]) -> (f64, f64) {
        let c = &joint.contact;
        let coefficients = contact::Coefficients::new(c, c.clearance);
        // Inverse effective masses at the ball's centre, normal and in sliding: a force there also rotates the body.
        let (mut normal, mut sliding) = (0.0, 0.0);
        let mut forces = Vec::new();
        for attachment in [&joint.carried(), &joint.carrier()] {
            let Some(b) = attachment.body else { continue };
            let (body, joint) = (&self.bodies[b], &self.joints[b]);
            if joint.is_prescribed() {
                continue;
            }
            let arm = (attachment.point - body.centre).norm_squared();
            let moments = body.inertia.symmetric_eigenvalues();
            let at_centre = 1.0 / body.mass + arm / moments.max();
            normal += at_centre;
            let turning = match c.friction_velocity {
                contact::FrictionVelocity::Surface => c.ball_radius * c.ball_radius / moments.min(),
                contact::FrictionVelocity::Centres => 0.0,
            };
            sliding += at_centre + turning;
            forces.push((element_forces[b], body.mass));
        }
        if normal == 0.0 {
            return (f64::INFINITY, 1.0);
        }
        let load = forces.iter().map(|(force, _)| force).sum();
        let fall = (2.0 * self.max_acceleration(forces) * c.clearance).sqrt();
        let speed = fall.max(c.impact_speed_floor);
        let contact::Coefficients { elastic, damping, .. } = coefficients;
        let duration =
            elastic.impact_duration(damping, 1.0 / normal, speed).min(elastic.half_period_under(1.0 / normal, load));
        (duration, (coefficients.friction * sliding / normal).max(1.0))
    }

    /// Groups of joints with play with equal contact parameters, with their names.
    fn contact_groups(&self) -> Vec<(String, contact::Parameters)> {
        let mut joints: Vec<_> = self.loose_joints.iter().enumerate().collect();
        // No value is NaN: the parameter ranges exclude it.
        joints.sort_by(|a, b| a.1.contact.partial_cmp(&b.1.contact).unwrap_or(Ordering::Equal));
        let mut groups: Vec<_> = joints.chunk_by(|a, b| a.1.contact == b.1.contact).collect();
        groups.sort_by_key(|group| group[0].0);
        let title = |group: &[(usize, &LooseJoint)]| match group {
            [first, .., last] if group.len() > 6 => format!("{} to {}", first.1.name, last.1.name),
            _ => group.iter().map(|(_, joint)| joint.name.as_str()).collect::<Vec<_>>().join(", "),
        };
        groups.into_iter().map(|group| (title(group), group[0].1.contact)).collect()
    }
}

/// Points of a drive, a time law or a characteristic.
struct PointTable<'a> {
    /// What it is: `drive`.
    what: &'static str,
    /// Name of its joint or element.
    of: &'a str,
    points: &'a [[f64; 2]],
    interpolation: Interpolation,
    ends: Ends,
    /// Units of abscissas and values; "" for pure numbers.
    units: [&'static str; 2],
    /// Whether its slope may jump.
    may_have_kinks: bool,
}

/// A contradiction between contact parameters.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ContactFault {
    /// The ball does not fit into its socket.
    #[error(
        "clearance {} must be below the ball radius, {}; allowed 0 mm to below {1}; units {}",
        format_quantity(*.clearance, "mm"),
        format_quantity(*.ball_radius, "mm"),
        unit_names(Dimension::Length).join(", ")
    )]
    Clearance {
        /// Clearance, m.
        clearance: f64,
        /// Ball radius, m.
        ball_radius: f64,
    },
    /// The friction ramp ends before it begins.
    #[error(
        "slip_speed_low {} must be below slip_speed_high {}; units {}",
        format_quantity(*.low, "mm/s"),
        format_quantity(*.high, "mm/s"),
        unit_names(Dimension::Speed).join(", ")
    )]
    SlipSpeeds {
        /// Start of the ramp, m/s.
        low: f64,
        /// End of the ramp, m/s.
        high: f64,
    },
    /// A restitution of 0 under a law that divides by it.
    #[error("the law {0} divides by the restitution; allowed above 0 to 1; a pure number, no unit")]
    DividesByRestitution(NormalLaw),
    /// A yield speed without a restitution that could fall.
    #[error("yield_speed needs {needs}; without it allowed is yield_speed = 0 m/s")]
    Yield {
        /// What is missing.
        needs: &'static str,
        /// Last part of its key.
        key: &'static str,
    },
    /// Impossible dimensions or settings of a joint with play.
    #[error("{0}")]
    Loose(#[from] LooseFault),
}

impl ContactFault {
    /// Last parts of the keys involved, the likelier cause first.
    pub fn parts(&self) -> [&'static str; 2] {
        match self {
            Self::Clearance { .. } => ["clearance", "ball_radius"],
            Self::SlipSpeeds { .. } => ["slip_speed_low", "slip_speed_high"],
            Self::Yield { key, .. } => ["yield_speed", key],
            Self::DividesByRestitution(_) => ["restitution", "normal_law"],
            Self::Loose(fault) => fault.parts(),
        }
    }
}

/// A contradiction in the contact parameters of the machine, or of one of its joints with play, by index.
#[derive(Clone, Copy, Debug)]
pub struct ContactConflict {
    /// Joint with play; `None` for the machine as a whole.
    pub joint: Option<usize>,
    /// The contradiction.
    pub fault: ContactFault,
}

fn check_contact(contact: &contact::Parameters) -> Result<(), ContactFault> {
    if contact.clearance >= contact.ball_radius {
        return Err(ContactFault::Clearance { clearance: contact.clearance, ball_radius: contact.ball_radius });
    }
    if contact.slip_speed_low >= contact.slip_speed_high {
        return Err(ContactFault::SlipSpeeds { low: contact.slip_speed_low, high: contact.slip_speed_high });
    }
    if contact.restitution == 0.0 && !contact.normal_law.damping_factor(0.0).is_finite() {
        return Err(ContactFault::DividesByRestitution(contact.normal_law));
    }
    let yields = contact.yield_speed > 0.0;
    if yields && contact.approach_speed != ApproachSpeed::Start {
        return Err(ContactFault::Yield { needs: "approach_speed = \"start\"", key: "approach_speed" });
    }
    if yields && contact.normal_law == NormalLaw::Hertz {
        return Err(ContactFault::Yield { needs: "a normal_law with damping", key: "normal_law" });
    }
    if yields && contact.restitution == 1.0 {
        return Err(ContactFault::Yield { needs: "a restitution below 1", key: "restitution" });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::{Attachment, Body, Element, ElementKind, Joint, Mat3, Spring, SpringSide, Vec3};

    /// Fault of a machine with a bob in a socket after `change`.
    fn fault(change: impl FnOnce(&mut Machine)) -> Option<MachineFault> {
        let mut machine = Machine::default();
        let bob = machine.add_body(Body::new("bob", 0.4, Mat3::identity() * 1e-3), Joint::free(0));
        let [socket, ball] = [Attachment::world(Vec3::zeros()), Attachment::on(bob, Vec3::zeros())];
        machine.loose_joints.push(LooseJoint::ball("S1", socket, ball));
        change(&mut machine);
        machine.check().err()
    }

    #[test]
    fn a_machine_built_in_code_is_checked_before_it_runs() {
        assert_eq!(fault(|_| ()), None);
        assert_eq!(fault(|machine| *machine = Machine::default()), Some(MachineFault::Empty));
        assert_eq!(fault(|machine| machine.joints.clear()), Some(MachineFault::Joints { body: 0 }));
        assert_eq!(fault(|machine| machine.joints[0].parent = Some(0)), Some(MachineFault::Order { body: 0 }));
        let beyond = |what: &str| Some(MachineFault::NoBody { what: what.to_owned(), body: 3, bodies: 1 });
        assert_eq!(fault(|machine| machine.loose_joints[0].frames[1].origin.body = Some(3)), beyond("S1"));
        assert_eq!(fault(|machine| machine.output.body = 3), beyond("output"));
        for mass in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(fault(|machine| machine.bodies[0].mass = mass), Some(MachineFault::Inertia { .. })));
        }
        for inertia in [Mat3::zeros(), -Mat3::identity(), Mat3::new(1.0, 0.1, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)] {
            assert!(matches!(fault(|machine| machine.bodies[0].inertia = inertia), Some(MachineFault::Inertia { .. })));
        }
        let drive = |drive: Drive| {
            move |machine: &mut Machine| machine.joints[0] = Joint::revolute(None, 0, Vec3::z()).with_drive(drive)
        };
        let table_of = |points: &[[f64; 2]], interpolation| {
            drive(Drive::Table { points: points.to_vec(), interpolation, repeats: false })
        };
        let table = |points: &[[f64; 2]]| table_of(points, Interpolation::Spline);
        let lines = fault(table_of(&[[0.0, 1.0], [1.0, 2.0]], Interpolation::Linear));
        assert!(matches!(lines, Some(MachineFault::Kinks { .. })), "{lines:?}");
        assert_eq!(fault(table(&[[0.0, 1.0], [1.0, 2.0]])), None);
        for points in [&[][..], &[[0.0, 1.0]], &[[1.0, 1.0], [1.0, 2.0]], &[[0.0, 1.0], [1.0, f64::NAN]]] {
            assert!(matches!(fault(table(points)), Some(MachineFault::Points { .. })), "{points:?}");
        }
        let none = fault(drive(Drive::Function(2)));
        assert!(matches!(none, Some(MachineFault::NoFunction { function: 2, .. })), "{none:?}");
        let curve = fault(|machine| {
            let [from, to] = [Attachment::world(Vec3::zeros()), Attachment::on(0, Vec3::zeros())];
            let elastic = Characteristic::Curve { points: Vec::new(), interpolation: Interpolation::Monotone };
            let side = SpringSide::Both;
            let spring = Spring { from, to, length: 0.1, elastic, damping: Characteristic::linear(0.0), side };
            machine.elements.push(Element { name: "s".to_owned(), kind: ElementKind::Spring(spring) });
        });
        assert_eq!(curve, Some(MachineFault::Points { what: "s".to_owned() }));
        let wide = fault(|machine| machine.loose_joints[0].contact.clearance = 1.0);
        assert!(matches!(wide, Some(MachineFault::Contact { joint, .. }) if joint == "S1"));
    }
}
