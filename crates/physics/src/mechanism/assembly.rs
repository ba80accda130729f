//! What assembly at the start does, and what it finds about a compiled machine.

/// Changes to the scene's values made by assembly at the start. In a scene with a closed form, the guess comes from it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Assembly {
    /// Displacement of each body from the guess.
    pub bodies: Vec<Placement>,
    /// Closed joint with the widest gap in the guess, and that gap (|Z_j - Z_i| of a ball joint), m. Other loop-closing joints
    /// are numbered after the joints with play.
    pub widest: Option<(usize, f64)>,
    /// Loop-closing joint with the largest angular misalignment in the guess, and that angle, rad.
    pub most_turned: Option<(usize, f64)>,
    /// Whether the loops closed in a different assembly mode from the guess, across a singular pose. Known only if closed joints
    /// and drives leave no degree of freedom.
    pub other_mode: bool,
    /// Whether the guess comes from the closed form.
    pub closed_form: bool,
    /// The unstable position of rest that the search for a start in equilibrium met, if any.
    pub unstable_rest: Option<UnstableRest>,
}

/// What became of a position of rest that the slightest disturbance leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnstableRest {
    /// The search left it to one side, and found a stable rest there.
    Left,
    /// It is the start: no rest was found to either side.
    Kept,
}

/// What assembly at the start finds about a compiled machine.
#[derive(Clone, Debug)]
pub(super) struct Assembled {
    pub assembly: Assembly,
    /// Rank of the rows of loop-closing joints, if some are dependent.
    pub rank: Option<usize>,
}

/// Displacement of a body by assembly.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Placement {
    /// Distance of the origin of its frame from the guess, m.
    pub moved: f64,
    /// Angle from its orientation in the guess, rad.
    pub turned: f64,
}

/// A start that is settled, or in equilibrium.
#[derive(Clone, Debug)]
pub(super) struct Settled {
    /// Positions and velocities in the coordinates of the tree.
    pub state: Vec<f64>,
    /// Assembly of the machine without play, before the balls were displaced by their play.
    pub assembly: Assembly,
}
