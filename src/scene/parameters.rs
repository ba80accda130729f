//! The one table of scene parameters: files, `--set`, sliders, tooltips and the reference page are made from it.

/// A parameter's value in SI units.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A quantity in SI units, or a pure number.
    Number(f64),
    /// A count.
    Count(u64),
    /// One of the parameter's choices.
    Choice(&'static str),
    /// Not given (`solver.preset` only).
    Unset,
}

/// Physical dimension of a quantity; fixes which units it may be written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// A pure number.
    None,
    /// m
    Length,
    /// s
    Time,
    /// kg
    Mass,
    /// kg m^2
    Inertia,
    /// Pa
    Stress,
    /// rad
    Angle,
    /// m/s
    Speed,
    /// rad/s
    AngularSpeed,
    /// m/s^2
    Acceleration,
    /// Hz
    Frequency,
}

/// What kind of value a parameter takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// A number with its dimension and closed range in SI units; `display` is the unit shown to people.
    Number {
        /// Dimension.
        dimension: Dimension,
        /// Least value, SI.
        min: f64,
        /// Greatest value, SI.
        max: f64,
        /// Unit for display and sliders, e.g. "mm".
        display: &'static str,
        /// Ends of the slider's travel, SI (inside min..=max; typed entry reaches the rest).
        slider: (f64, f64),
        /// Whether the slider is logarithmic.
        logarithmic: bool,
    },
    /// A whole number in a closed range.
    Count {
        /// Least.
        min: u64,
        /// Greatest.
        max: u64,
    },
    /// One of some words.
    Choice(&'static [&'static str]),
}

/// Where a key exists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scope {
    /// In every scene.
    Every,
    /// In every scene, and as `joint.<name>.<last part>` for one joint.
    Contact,
    /// Only in scenes with the paper's inverse kinematics.
    Spcmm,
    /// Only in chains.
    Chain,
}

/// One row of the table.
#[derive(Clone, Debug)]
pub struct Parameter {
    /// Key, e.g. `contact.clearance`.
    pub key: &'static str,
    /// Sentence-case name for the interface, e.g. "Clearance".
    pub label: &'static str,
    /// Heading it stands under, e.g. "Contact".
    pub group: &'static str,
    /// Values it takes.
    pub kind: Kind,
    /// Where it exists.
    pub scope: Scope,
    /// Takes effect only at the next reset (it would move a drive in mid-run, or change the equations).
    pub at_reset: bool,
    /// What the quantity is, in a sentence or two, with what to expect of extreme values.
    pub help: &'static str,
    /// Which equation it enters, e.g. "paper eqs. (9), (10)".
    pub equation: &'static str,
}
