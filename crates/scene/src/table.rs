//! The single table of scene parameters: files, `--set`, sliders, tooltips and the reference page are derived from it.

use super::field::{Access, Field, FieldValue, SWITCH, field, word_field, word_of};
use super::{Formulation, Kind, Machine, Parameter, Preset, Scope, SignedAxis, StartRule, Value, play};
use jointplay_physics::contact::{self, ApproachSpeed, FrictionLaw, FrictionVelocity, NormalLaw, WearShape};
use jointplay_physics::integrate::Method;
use jointplay_physics::units::Dimension as D;
use jointplay_physics::words::Words;

const DEFAULT: contact::Parameters = contact::Parameters::DEFAULT;

/// All parameters, in the order of the interface.
pub fn table() -> &'static [Parameter] {
    &TABLE
}

/// A row that takes effect at once; the functions below modify that where needed.
#[expect(clippy::too_many_arguments, reason = "the columns of the table")]
const fn row(
    key: &'static str,
    access: Access,
    label: &'static str,
    group: &'static str,
    kind: Kind,
    default: Value,
    scope: Scope,
    help: &'static str,
    equation: &'static str,
) -> Parameter {
    Parameter { key, access, label, group, kind, default, scope, at_reset: false, help, equation }
}

const fn contact(
    key: &'static str,
    field: Field<contact::Parameters>,
    label: &'static str,
    kind: Kind,
    default: Value,
    help: &'static str,
    equation: &'static str,
) -> Parameter {
    row(key, Access::Contact(field), label, "Contact", kind, default, Scope::Contact, help, equation)
}

/// A row of a contact parameter, by its field: a number.
macro_rules! contact_number {
    ($field:ident, $label:literal, $kind:expr, $help:literal, $equation:literal $(,)?) => {{
        let default = Value::Number(DEFAULT.$field);
        contact(concat!("contact.", stringify!($field)), field!($field), $label, $kind, default, $help, $equation)
    }};
}

/// A row of a contact parameter, by its field: a word of an enum.
macro_rules! contact_choice {
    ($field:ident, $label:literal, $words:ty, $help:literal, $equation:literal $(,)?) => {{
        let (kind, default) = (Kind::Choice(<$words>::WORDS), Value::Choice(DEFAULT.$field.word()));
        contact(concat!("contact.", stringify!($field)), word_field!($field), $label, kind, default, $help, $equation)
    }};
}

const fn at_reset(mut parameter: Parameter) -> Parameter {
    parameter.at_reset = true;
    parameter
}

const fn number(dimension: D, min: f64, max: f64, display: &'static str, slider: (f64, f64)) -> Kind {
    Kind::Number { dimension, min, max, display, slider, logarithmic: false }
}

const fn logarithmic(dimension: D, min: f64, max: f64, display: &'static str, slider: (f64, f64)) -> Kind {
    Kind::Number { dimension, min, max, display, slider, logarithmic: true }
}

const fn gravity(
    key: &'static str,
    field: Field<Machine>,
    label: &'static str,
    default: f64,
    help: &'static str,
) -> Parameter {
    let kind = number(D::Acceleration, -1000.0, 1000.0, "m/s^2", (-20.0, 20.0));
    row(
        key,
        Access::Machine(field),
        label,
        "Gravity",
        kind,
        Value::Number(default),
        Scope::Every,
        help,
        "Weight in the force vector of Sheng & Chen (2024), eqs. 52, 53",
    )
}

static TABLE: [Parameter; 32] = [
    contact_number!(
        clearance,
        "Clearance",
        number(D::Length, 0.0, 1.0, "mm", (0.0, 1e-3)),
        "Radial gap c = R - r between socket and ball. With 0 the joint is ideal: a constraint instead of a contact. \
         It must stay below the ball radius. Larger gaps give longer free flights and harder impacts; at 0.01 mm and \
         below, the contact patch is no longer small against the ball, which Hertz's theory assumes.",
        "Sheng & Chen (2024), eqs. 9, 10; stiffness in eq. 19",
    ),
    contact_number!(
        friction,
        "Friction coefficient",
        number(D::None, 0.0, 10.0, "", (0.0, 1.0)),
        "Coulomb coefficient cf of ball on socket. Steel on steel lies between 0.1 (oiled) and 0.8 (dry). With 0 \
         the rattling lasts much longer.",
        "Sheng & Chen (2024), eq. 20",
    ),
    contact_number!(
        restitution,
        "Restitution",
        number(D::None, 0.0, 1.0, "", (0.0, 1.0)),
        "Rebound speed over approach speed asked of the normal law; 1 loses no energy. The Lankarani–Nikravesh \
         law is right only near 1: asked for 0.9 it gives 0.913, for 0.8 0.847, for 0 0.66. gonthier gives what is \
         asked for, flores within 0.05; both divide by this number and refuse 0.",
        "Sheng & Chen (2024), eq. 19",
    ),
    contact_number!(
        youngs_modulus,
        "Young's modulus",
        logarithmic(D::Stress, 1e6, 1e12, "GPa", (1e9, 1e12)),
        "Stiffness E of the material of ball and socket. Steel has 206 GPa. A softer material gives longer, gentler \
         impacts and deeper penetration, and lets the solver take larger steps.",
        "Sheng & Chen (2024), eq. 19, stiffness K",
    ),
    contact_number!(
        poisson_ratio,
        "Poisson's ratio",
        number(D::None, 0.0, 0.499, "", (0.0, 0.499)),
        "Lateral contraction over axial extension of the material, nu. Metals have about 0.3. It changes the contact \
         stiffness by at most a third.",
        "Sheng & Chen (2024), eq. 19, stiffness K",
    ),
    contact_number!(
        ball_radius,
        "Ball radius",
        logarithmic(D::Length, 1e-4, 1.0, "mm", (1e-3, 0.1)),
        "Radius r of the ball; the socket has R = r + c. A larger ball in the same gap fits more closely, so the \
         contact is stiffer.",
        "Sheng & Chen (2024), eqs. 9, 12, 19",
    ),
    contact_choice!(
        friction_velocity,
        "Friction velocity",
        FrictionVelocity,
        "Sliding velocity of the friction law. centres, the paper's choice, is the relative velocity of the two \
         centres, which neglects the rotation of the ball. surface is the relative velocity of the two material \
         points in contact.",
        "Sheng & Chen (2024), eqs. 15, 16 for centres; eqs. 13, 14 with the bodies' rotation for surface",
    ),
    contact_number!(
        slip_speed_low,
        "Low slip speed",
        logarithmic(D::Speed, 0.0, 1.0, "mm/s", (1e-7, 1e-3)),
        "v_a: below this sliding speed there is no friction, so that its direction never jumps at rest. It must stay \
         below the high slip speed.",
        "Sheng & Chen (2024), eq. 21",
    ),
    contact_number!(
        slip_speed_high,
        "High slip speed",
        logarithmic(D::Speed, 1e-9, 10.0, "mm/s", (1e-5, 1e-1)),
        "v_theta: above this sliding speed friction is full; below it a ball creeps where dry friction would hold \
         it. A smaller value creeps less and is stiffer to compute.",
        "Sheng & Chen (2024), eq. 21",
    ),
    contact_number!(
        impact_speed_floor,
        "Impact speed floor",
        logarithmic(D::Speed, 1e-9, 10.0, "mm/s", (1e-5, 0.1)),
        "Least approach speed by which the damping term divides. Without a floor the last, softest contacts would be \
         infinitely stiff. A contact that begins more slowly than this rebounds higher than asked.",
        "Sheng & Chen (2024), eq. 19, the speed at the start of contact",
    ),
    contact_choice!(
        approach_speed,
        "Approach speed",
        ApproachSpeed,
        "Speed by which the damping term divides. start, the paper's choice, is the penetration rate at which the \
         contact began. It damps a joint that touches softly and is then hit by its neighbour many times too \
         strongly. largest is \
         the largest rate of the contact so far, which limits damping to that of an undisturbed impact; an \
         undisturbed impact is the same with both.",
        "Sheng & Chen (2024), eq. 19, the speed at the start of contact",
    ),
    contact_number!(
        yield_speed,
        "Yield speed",
        logarithmic(D::Speed, 0.0, 1e3, "m/s", (1e-3, 10.0)),
        "Approach speed above which parts yield, so that they rebound less: the restitution falls with the fourth root of the speed. \
         With 0 it does not depend on the speed. Only for approach_speed start, a restitution below 1, and laws with damping.",
        "Johnson (1985), Contact Mechanics",
    ),
    contact_choice!(
        normal_law,
        "Normal law",
        NormalLaw,
        "Normal force as a function of penetration and its rate. lankarani-nikravesh is the paper's; hertz is \
         elastic; hunt-crossley, flores and gonthier differ in their damping, and gonthier alone gives the restitution \
         asked for.",
        "Sheng & Chen (2024), eq. 19 for lankarani-nikravesh",
    ),
    contact_choice!(
        friction_law,
        "Friction law",
        FrictionLaw,
        "Friction force as a function of normal force and sliding velocity. modified-coulomb rises linearly between \
         the two slip speeds, so that a loaded contact creeps; bristle sticks below its static limit and slides above \
         it; none leaves friction out. A change to or from bristle acts at the next reset.",
        "Sheng & Chen (2024), eqs. 20, 21 for modified-coulomb; Gonthier et al. (2004) for bristle",
    ),
    contact_number!(
        static_friction_ratio,
        "Static friction ratio",
        number(D::None, 1.0, 10.0, "", (1.0, 3.0)),
        "Coefficient of friction at rest over that of sliding, for the friction law bristle. Above 1, slow motions \
         jerk: the contact sticks until the load breaks it away.",
        "Stribeck (1902); Dupont et al. (2002)",
    ),
    contact_number!(
        stribeck_speed,
        "Stribeck speed",
        logarithmic(D::Speed, 1e-6, 10.0, "mm/s", (1e-5, 0.1)),
        "v_s of the friction law bristle: at this sliding speed friction has fallen 63 % of the way from its static to \
         its sliding value. Without effect at a static friction ratio of 1.",
        "Stribeck (1902); Dupont et al. (2002)",
    ),
    contact_number!(
        bristle_stiffness,
        "Bristle stiffness",
        logarithmic(D::Stiffness, 1e4, 1e11, "N/mm", (1e6, 1e10)),
        "Tangential stiffness of a sticking contact of the friction law bristle: it yields by the load over this number \
         before it slides. Mindlin gives 0.82 times the stiffness of the normal force at the load, for a Poisson's \
         ratio of 0.3.",
        "Gonthier et al. (2004); Mindlin (1949)",
    ),
    contact_number!(
        bristle_damping,
        "Bristle damping",
        logarithmic(D::Damping, 1.0, 1e6, "N s/m", (10.0, 1e5)),
        "Damping of a sticking contact of the friction law bristle, so that what sticks stops ringing. Over the \
         stiffness it is the time in which friction turns and follows its limit. It acts below the limit of friction only.",
        "Gonthier et al. (2004)",
    ),
    contact_number!(
        wear_coefficient,
        "Wear coefficient",
        logarithmic(D::Wear, 0.0, 1e-6, "m^2/N", (1e-18, 1e-8)),
        "Volume that a contact removes per normal force and sliding distance; the play grows by that volume over the \
         area of its surfaces. With 0 nothing wears. 1 mm^3/(N m) is 1e-9 m^2/N.",
        "Archard (1953); Flores (2009)",
    ),
    at_reset(contact_choice!(
        wear_shape,
        "Wear shape",
        WearShape,
        "Where a contact takes off what it wears. even takes it off the whole surface that the play is between, so that a ball and a \
         bearing stay round; profile takes it off the wall of the socket or the bearing where it is touched. Collars and the \
         walls of a guide wear evenly in any case.",
        "Archard (1953); Flores (2009)",
    )),
    gravity(
        "gravity.x",
        field!(gravity.x),
        "Gravity along X",
        0.0,
        "World X component of gravity. In the paper's machine X points down: +9.81 m/s^2. A file that gives any component has 0 for the others.",
    ),
    gravity(
        "gravity.y",
        field!(gravity.y),
        "Gravity along Y",
        0.0,
        "World Y component of gravity. A file that gives any component has 0 for the others.",
    ),
    gravity(
        "gravity.z",
        field!(gravity.z),
        "Gravity along Z",
        -9.81,
        "World Z component of gravity: -9.81 m/s^2 where Z points up. A file that gives any component has 0 for the others.",
    ),
    at_reset(row(
        "formulation",
        Access::Machine(word_field!(formulation)),
        "Formulation",
        "Solver",
        Kind::Choice(Formulation::WORDS),
        Value::Choice("tree"),
        Scope::Every,
        "Equations of motion. tree uses one coordinate for each degree of freedom that remains when the joints with play \
         are cut. \
         lagrange is the paper's: all bodies free, every joint a constraint with a multiplier, stabilised after \
         Baumgarte. Both give the same motion; tree is faster.",
        "Sheng & Chen (2024), eqs. 44 to 58 for lagrange",
    )),
    at_reset(row(
        "start",
        Access::Machine(word_field!(start)),
        "Start",
        "Solver",
        Kind::Choice(StartRule::WORDS),
        Value::Choice("as-given"),
        Scope::Every,
        "Where a run begins. as-given takes the start values of the joints. ideal takes them as guesses and closes every ball \
         joint, with the balls in the middle of their sockets: they drop first. settled lays each ball on the wall of its \
         socket where the mechanism without play presses it, as deep as that force needs. equilibrium continues from there to where \
         springs, bushings, tyres, stops, contacts and gravity are in balance.",
        "Constraints of Sheng & Chen (2024), eq. 45; eq. 19 at rest for settled; accelerations of 0 for equilibrium",
    )),
    row(
        "solver.method",
        Access::Machine(word_field!(solver.method)),
        "Method",
        "Solver",
        Kind::Choice(Method::WORDS),
        Value::Choice("automatic"),
        Scope::Every,
        "Time stepper. rk4 (order 4) keeps a fixed step; discrete-gradient takes a number of steps \
         per impact, solves each for the contact forces, and stays stable whatever its step: the fastest where many balls are \
         loose, to a few per cent; dopri5 (Dormand-Prince, order 5) chooses its steps by the tolerance and finds the instants at \
         which contacts begin and end; radau5 (Radau IIA, implicit, order 5) does so too and takes longer steps where contacts have \
         settled; automatic changes between dopri5 and radau5.",
        "Solves Sheng & Chen (2024), eqs. 55, 58 in time",
    ),
    row(
        "solver.step",
        Access::Machine(field!(solver.step)),
        "Step",
        "Solver",
        logarithmic(D::Time, 1e-7, 1e-2, "us", (1e-6, 1e-3)),
        Value::Number(10e-6),
        Scope::Every,
        "Step of a fixed-step method, first step of another one. An impact lasts about 0.1 ms: a fixed step \
         above 20 us no longer resolves it.",
        "Solves Sheng & Chen (2024), eqs. 55, 58 in time",
    ),
    row(
        "solver.tolerance",
        Access::Machine(field!(solver.tolerance)),
        "Tolerance",
        "Solver",
        logarithmic(D::None, 1e-13, 1e-2, "", (1e-12, 1e-3)),
        Value::Number(1e-6),
        Scope::Every,
        "Relative error that an adaptive method allows in one step; above 1e-5, automatic uses 1e-5 for its explicit \
         steps, which carry it through impacts. The motion between impacts is sensitive: use 1e-9 or less to compare \
         single \
         impacts.",
        "Solves Sheng & Chen (2024), eqs. 55, 58 in time",
    ),
    row(
        "solver.steps_per_impact",
        Access::Machine(field!(solver.steps_per_impact)),
        "Steps per impact",
        "Solver",
        Kind::Count { min: 2, max: 256 },
        Value::Count(16),
        Scope::Every,
        "Steps that discrete-gradient takes in the time in which a ball strikes its wall and rebounds (the Hertz time). Peaks of the \
         first impacts err by a few per cent with 4, by about one with 16; beyond 16 all other steps shrink, too. Other methods ignore it.",
        "Step of Sheng & Chen (2024), eqs. 55, 58; duration of eq. 21 without damping",
    ),
    row(
        "solver.preset",
        Access::Machine(Field {
            get: |machine| machine.solver.preset.map_or(Value::Unset, |preset| Value::Choice(preset.word())),
            // The settings that it stands for depend on the machine: `Scene::apply_preset`.
            set: |machine, value| machine.solver.preset = Some(word_of(value)),
        }),
        "Preset",
        "Solver",
        Kind::Choice(Preset::WORDS),
        Value::Unset,
        Scope::Every,
        "Method and accuracy by name: preview (automatic, 1e-3; discrete-gradient, 16, where 3 or more loose balls act on one another), \
         real-time (automatic, 5e-4; discrete-gradient, 24, where 4 or more do), accurate (automatic, 1e-7), reference (dopri5, 1e-11). \
         A scene has a preset, or a method with its tolerance, step or steps per impact, not both.",
        "Solves Sheng & Chen (2024), eqs. 55, 58 in time",
    ),
    at_reset(row(
        "solver.energy_ledger",
        Access::Machine(field!(solver.energy_ledger)),
        "Energy ledger",
        "Solver",
        Kind::Choice(&SWITCH),
        Value::Choice("on"),
        Scope::Every,
        "Accounts for the energy transferred by drives, gravity, contacts and losses, and for the residual, which is \
         the integration error. It changes no step; without it a run is slightly faster.",
        "Integrals of force times velocity; power of friction from (20) at the points of (24)",
    )),
    row(
        "view.down",
        Access::View(word_field!(down)),
        "Down on screen",
        "View",
        Kind::Choice(SignedAxis::WORDS),
        Value::Choice("-z"),
        Scope::Every,
        "World axis that points down on the screen. It moves the camera only; gravity has its own keys.",
        "No equation: display only",
    ),
];

/// The parameter table as a Markdown page.
pub fn reference_page() -> String {
    let mut page = String::from(
        "# Scene parameters\n\nEvery key works in a scene file (a section and a name), as `--set key=value`, and in the window. \
         A quantity is written with its unit, `0.3 mm` or `0.3mm`; a bare 0 needs none.\n\n\
         | Key | Name | Default | Range | Unit | Where | Takes effect | Meaning | Equation \
         |\n|---|---|---|---|---|---|---|---|---|\n",
    );
    for parameter in table().iter().chain(play::rows()) {
        let effect = if parameter.at_reset { "at reset" } else { "at once" };
        let cells = [
            match parameter.scope {
                Scope::Joint => format!("`joint.<name>.{}`", parameter.key),
                _ => format!("`{}`", parameter.key),
            },
            parameter.label.to_owned(),
            parameter.show(&parameter.default),
            parameter.range(),
            parameter.units(),
            parameter.scope.describe().to_owned(),
            effect.to_owned(),
            parameter.help.to_owned(),
            parameter.equation.to_owned(),
        ];
        page.push_str(&format!("| {} |\n", cells.join(" | ")));
    }
    page
}

/// The row of a key (without a joint's name).
pub fn find(key: &str) -> Option<&'static Parameter> {
    TABLE.iter().chain(play::rows()).find(|parameter| parameter.key == key)
}

/// Name and rest of a key that begins with `joint.`: `("S1", "friction")`.
pub(super) fn joint_part(key: &str) -> Option<(&str, &str)> {
    key.strip_prefix("joint.")?.rsplit_once('.')
}

/// The contact parameter that a row sets: `clearance` for `contact.clearance`, and for `play.radial`.
pub(super) fn contact_part(parameter: &'static Parameter) -> Option<&'static str> {
    match parameter.access {
        Access::Contact(_) => parameter.key.strip_prefix("contact.").or_else(|| play::part_of(parameter)),
        _ => None,
    }
}

/// Rows of `[contact]`, which a joint may override: last part of the key, and the field.
pub(super) fn contact_rows() -> impl Iterator<Item = (&'static str, Field<contact::Parameters>)> {
    TABLE.iter().filter_map(|parameter| match parameter.access {
        Access::Contact(field) => Some((parameter.key.strip_prefix("contact.")?, field)),
        _ => None,
    })
}
