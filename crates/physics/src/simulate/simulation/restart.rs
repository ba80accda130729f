//! A restart at a given state, and the equations of motion there as functions and matrices, for controllers and analyses.

use nalgebra::{DMatrix, DVector};

use super::{OPEN_LOOP, Observations, Simulation, State, Stepping};
use crate::integrate::System as _;
use crate::machine::Formulation;
use crate::mechanism::{ActiveSet, Coordinate, MechanismError, Worn};
use crate::simulate::StartError;

/// Deepest penetration at a restart, as a fraction of the ball radius or what stands in its place, as at any start.
const DEEPEST: f64 = 0.01;
/// Deepest wall that is set, as a fraction of that radius, as the play of any joint.
const DEEPEST_WEAR: f64 = 0.1;
/// Displacement for differences, in scales of the coordinates: truncation and rounding are then about equally small in a contact that
/// is pressed in by a micrometre.
const DIFFERENCE: f64 = 1e-7;

/// Why a state was not set, or an analysis is not defined.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RestartError {
    /// Wrong length.
    #[error("{found} numbers; the state has {expected}")]
    Length {
        /// Length given.
        found: usize,
        /// Length of the state.
        expected: usize,
    },
    /// A number that is not finite.
    #[error("number {index} (from 0) is {value}")]
    NotFinite {
        /// Index.
        index: usize,
        /// The number.
        value: f64,
    },
    /// Loops do not close near there.
    #[error(
        "joints that close loops stay open by {open:e} m or rad: the parts do not reach, or the state is too far off"
    )]
    Open {
        /// m or rad.
        open: f64,
    },
    /// Other walls that wear by direction.
    #[error(
        "{joint} has {} walls that wear by direction (wear_shape = \"profile\"), of {own:?} depths; given are {given:?}",
        own.len()
    )]
    Walls {
        /// Name of the joint.
        joint: String,
        /// Numbers of depths given.
        given: Vec<usize>,
        /// Those that it has.
        own: Vec<usize>,
    },
    /// A depth that nothing can wear.
    #[error("a worn depth of {value:e} m; allowed 0 m to {allowed:e} m, a tenth of the radius")]
    WornDepth {
        /// m.
        value: f64,
        /// m.
        allowed: f64,
    },
    /// Deep inside a wall.
    #[error("{joint} is {depth:e} m inside its wall; allowed {allowed:e} m")]
    Inside {
        /// Name of the joint.
        joint: String,
        /// m.
        depth: f64,
        /// m.
        allowed: f64,
    },
    /// Defined in joint coordinates alone.
    #[error("needs formulation = \"tree\", whose coordinates are those of the joints")]
    Formulation,
    /// The equations refuse to start there.
    #[error(transparent)]
    Start(#[from] StartError),
}

/// A machine linearised about its state: with its displacements x = B a in velocity space, (da/dt, d2a/dt2) = matrix (a, da/dt).
#[derive(Clone, Debug, PartialEq)]
pub struct Linearisation {
    /// Of displacements and their rates, in this order.
    pub matrix: DMatrix<f64>,
    /// B: directions of free motion, one a column; the identity where no joint closes a loop.
    pub directions: DMatrix<f64>,
}

impl Simulation {
    /// The coordinates of [`Self::state_vector`], in its order.
    pub fn coordinates(&self) -> Vec<Coordinate> {
        self.mechanism().coordinate_names(self.machine())
    }

    /// Begins anew at `time`, s, with coordinates and velocities `y`, ordered as in [`Self::state_vector`], under the conditions in
    /// effect and with what has worn so far. Quaternions are normalised, loops closed, contacts found as at a start; counters, impacts, ledger and peaks begin
    /// again, and a pull or wear map ends.
    ///
    /// # Errors
    /// A wrong length, numbers that are not finite, loops that do not close, parts deep in their walls; nothing has changed then.
    pub fn restart_at(&mut self, time: f64, y: &[f64]) -> Result<(), RestartError> {
        let expected = self.state_vector().len();
        if y.len() != expected {
            return Err(RestartError::Length { found: y.len(), expected });
        }
        if let Some(index) = y.iter().position(|value| !value.is_finite()) {
            return Err(RestartError::NotFinite { index, value: y[index] });
        }
        let before = self.state.clone();
        self.restart_or_return(before, time, y)
    }

    /// Begins anew, as [`Self::restart_at`], at the present state, with walls that have worn by direction to `walls`: of each of those of
    /// loose joint `j` the depths of its bumps, m, as from [`State::profiles`].
    ///
    /// # Errors
    /// Other walls, depths below 0, or parts deep in their walls; nothing has changed then.
    pub fn set_profiles(&mut self, j: usize, walls: &[Vec<f64>]) -> Result<(), RestartError> {
        let own: Vec<usize> = self.state.profiles(j).map(<[f64]>::len).collect();
        let given: Vec<usize> = walls.iter().map(Vec::len).collect();
        if own != given {
            let joint = self.model.machine().loose_joints[j].name.clone();
            return Err(RestartError::Walls { joint, given, own });
        }
        let allowed = DEEPEST_WEAR * self.model.machine().loose_joints[j].contact.ball_radius;
        if let Some(&value) = walls.iter().flatten().find(|depth| !(0.0..=allowed).contains(*depth)) {
            return Err(RestartError::WornDepth { value, allowed });
        }
        let contacts = self.workspace.mechanism.contacts.of_joint(j);
        let before = self.state.clone();
        let worn = self.state.profiles[contacts].iter_mut().filter(|depths| !depths.is_empty());
        worn.zip(walls).for_each(|(depths, wall)| depths.copy_from_slice(wall));
        let (time, y) = (self.state.time(), self.state.vector().to_vec());
        self.restart_or_return(before, time, &y)
    }

    /// Begins anew at (`time`, `y`), or returns to `before`.
    fn restart_or_return(&mut self, before: State, time: f64, y: &[f64]) -> Result<(), RestartError> {
        let restarted = self.try_restart(time, y);
        if restarted.is_err() {
            self.state = before;
            self.workspace.attach_to(&self.model, &mut self.state);
        }
        restarted
    }

    fn try_restart(&mut self, time: f64, y: &[f64]) -> Result<(), RestartError> {
        let mechanism = &mut self.workspace.mechanism;
        let mut y = y.to_vec();
        let open = mechanism.project(time, &mut y);
        if !(open <= OPEN_LOOP) {
            return Err(RestartError::Open { open });
        }
        let mut state = State::new(self.state.conditions.clone(), mechanism, y);
        state.elements = self.state.elements.clone();
        state.now.t = time;
        state.control.grid_origin = time;
        for (joint, (contact, before)) in
            state.joints.iter_mut().zip(state.conditions.joints.iter().zip(&self.state.joints))
        {
            joint.plays = contact.clearances();
            joint.worn = before.worn.map(|worn| Worn { rate: 0.0, ..worn });
        }
        state.profiles = self.state.profiles.clone();
        self.state = state;
        self.workspace.attach_to(&self.model, &mut self.state);
        let mechanism = &mut self.workspace.mechanism;
        mechanism.measure(time, &self.state.now.y);
        for (c, gap) in mechanism.contacts.gaps().enumerate() {
            let (depth, allowed) =
                (gap.separation.penetration, DEEPEST * mechanism.contacts.coefficients(c).ball_radius);
            if depth > allowed {
                let joint = self.model.machine().loose_joints[mechanism.contacts.joint_of(c)].name.clone();
                return Err(RestartError::Inside { joint, depth, allowed });
            }
        }
        self.run().begin()?;
        self.observations = Observations::new(&self.model);
        self.ideal = self.observations.workspace(&self.model);
        if !self.state.elements.is_as_started() || self.state.conditions.gravity != self.machine().gravity {
            let forces = self.state.applied_forces();
            self.observations.set_applied_forces(&self.model, self.ideal.as_deref_mut(), (0.0, &forces));
        }
        Ok(())
    }

    /// d/dt of coordinates and velocities at (`time`, `y`) with the conditions in effect. Contacts carry a force where they are
    /// closed, and damp with the approach speeds of the present state.
    ///
    /// # Errors
    /// A wrong length.
    pub fn rhs(&mut self, time: f64, y: &[f64]) -> Result<Vec<f64>, RestartError> {
        let expected = self.state_vector().len();
        if y.len() != expected {
            return Err(RestartError::Length { found: y.len(), expected });
        }
        let mut dy = vec![0.0; expected];
        self.run().immediate_derivative(time, y, &mut dy);
        Ok(dy)
    }

    /// Mass matrix of the velocity coordinates at the present state, SI: that of the trees, before joints that close loops
    /// constrain them.
    ///
    /// # Errors
    /// Another formulation than that of the tree.
    pub fn mass_matrix(&mut self) -> Result<DMatrix<f64>, RestartError> {
        self.needs_tree()?;
        Ok(self.run().with_all_bodies(|run| run.mechanism.mass_matrix(run.state.now.t, &run.state.now.y)))
    }

    /// Forces on the velocity coordinates at the present state, SI: loads, gravity, contacts and the terms of the velocities. The mass
    /// matrix times the accelerations equals them where no joint closes a loop.
    ///
    /// # Errors
    /// Another formulation than that of the tree.
    pub fn generalised_forces(&mut self) -> Result<DVector<f64>, RestartError> {
        self.needs_tree()?;
        Ok(self.run().with_all_bodies(|run| {
            let active_set = ActiveSet::by(run.locates(), &run.state.now.contact_states);
            run.mechanism.generalised_forces(run.state.now.t, &run.state.now.y, active_set)
        }))
    }

    /// The equations of motion linearised about the present state by central differences. They describe small motions about a
    /// state at rest; elsewhere, the matrix is that of the instant.
    ///
    /// # Errors
    /// Another formulation than that of the tree, or a state near which the loops do not close.
    pub fn linearise(&self) -> Result<Linearisation, RestartError> {
        self.needs_tree()?;
        // Projections may leave traces in the equations: in others than those of the run.
        let (mut state, mut workspace) = (self.state.clone(), self.model.workspace(&self.state));
        let mut run = Stepping::new(&self.model, &mut state, &mut workspace);
        run.end_flights();
        let (t, y) = (run.state.now.t, run.state.now.y.clone());
        let velocities = run.mechanism.velocity_range();
        let scale = run.mechanism.scale()[velocities.clone()].to_vec();
        let directions = run.mechanism.free_directions(t, &y);
        let count = directions.ncols();
        let back = directions.clone().pseudo_inverse(1e-12).unwrap_or_else(|_| directions.transpose());
        let mut matrix = DMatrix::zeros(2 * count, 2 * count);
        for k in 0..count {
            let direction = directions.column(k);
            matrix[(k, count + k)] = 1.0;
            // As long as the coordinate's scale lasts for the one that moves most by its own.
            let most = direction.iter().zip(&scale).map(|(x, scale)| (x / scale).abs()).fold(0.0, f64::max);
            let size = DIFFERENCE / most;
            let bent = run.bent_by(t, &y, &(direction * size));
            for (column, of_velocity) in [(k, false), (count + k, true)] {
                let mut change = DVector::zeros(directions.nrows());
                for sign in [1.0, -1.0] {
                    let mut moved = y.clone();
                    let step: Vec<f64> = direction.iter().map(|x| sign * size * x).collect();
                    if of_velocity {
                        moved[velocities.clone()].iter_mut().zip(&step).for_each(|(v, step)| *v += step);
                    } else {
                        run.mechanism.displace(&mut moved, &step);
                        moved[velocities.end..].iter_mut().zip(&bent).for_each(|(z, bent)| *z += sign * bent);
                    }
                    let open = run.mechanism.project(t, &mut moved);
                    if !(open <= OPEN_LOOP) {
                        return Err(RestartError::Open { open });
                    }
                    let mut dy = vec![0.0; y.len()];
                    run.immediate_derivative(t, &moved, &mut dy);
                    change += DVector::from_column_slice(&dy[velocities.clone()]) * sign;
                }
                let rates = &back * change / (2.0 * size);
                matrix.view_mut((count, column), (count, 1)).copy_from(&rates);
            }
        }
        Ok(Linearisation { matrix, directions })
    }

    fn needs_tree(&self) -> Result<(), RestartError> {
        if self.machine().formulation == Formulation::Tree { Ok(()) } else { Err(RestartError::Formulation) }
    }
}

impl Stepping<'_> {
    /// How far the displacement `step`, in velocity space, bends the bristles at rest at (`t`, `y`), m: their rates at that displacement
    /// per second.
    fn bent_by(&mut self, t: f64, y: &[f64], step: &DVector<f64>) -> Vec<f64> {
        let velocities = self.mechanism.velocity_range();
        let mut moving = y.to_vec();
        let mut rates = |speed: f64| {
            moving[velocities.clone()].iter_mut().zip(step.iter()).for_each(|(v, step)| *v = speed * step);
            let mut dy = vec![0.0; moving.len()];
            self.immediate_derivative(t, &moving, &mut dy);
            dy.split_off(velocities.end)
        };
        let [at_rest, moved] = [rates(0.0), rates(1.0)];
        moved.iter().zip(at_rest).map(|(moved, at_rest)| moved - at_rest).collect()
    }

    /// The derivative at (`t`, `y`), with every closed contact active.
    fn immediate_derivative(&mut self, t: f64, y: &[f64], dy: &mut [f64]) {
        self.with_all_bodies(|run| {
            let active_set = ActiveSet::Immediate(&run.state.now.contact_states);
            run.mechanism.evaluator(active_set).derivative(t, y, dy);
            run.mechanism.forget_evaluation();
        });
    }

    /// Asks something of all bodies, also those that steps exclude.
    fn with_all_bodies<T>(&mut self, ask: impl FnOnce(&mut Self) -> T) -> T {
        let excludes = self.include_all_bodies();
        let answer = ask(self);
        if excludes {
            self.exclude_flights();
        }
        answer
    }
}

impl From<MechanismError> for RestartError {
    fn from(error: MechanismError) -> Self {
        Self::Start(error.into())
    }
}
