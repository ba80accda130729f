//! `check`: contents of a scene, what a run computes and what it skips, and warnings.

use std::fmt::Write;

use super::args::CheckArguments;
use super::measuring::within;
use super::summary::count;
use super::{Failure, load, print, start};
use crate::analysis::assembly::StartReport;
use crate::analysis::ideal_fault::ideal_fault;
use crate::analysis::initial_peaks::InitialPeaks;
use crate::contact::FrictionLaw;
use crate::integrate::{Method, StepControl};
use crate::machine::{Body, Element, Joint, JointKind, LooseJoint, LooseKind, Machine, Pin, Place, Slide};
use crate::mechanism::{ElementReport, Summary};
use crate::scene::Scene;
use crate::simulate::{ChannelInfo, Frame, Peak, channels_of};
use crate::units::significant;
use crate::units::{format_quantity, format_quantity_digits, to_display};

/// Runs `check`.
///
/// # Errors
/// Any error in the scene, including joints that cannot be closed at the start.
pub fn check(arguments: &CheckArguments) -> Result<(), Failure> {
    let scene = load(&arguments.scene)?;
    // Only starting the scene reveals joints that do not close and rods that do not reach.
    let mut simulation = start(&scene)?;
    let start_report = StartReport::of(&mut simulation);
    let mut frame = Frame::default();
    simulation.sample(0.0, &mut frame);
    if arguments.channels {
        return print(&channels(&channels_of(&scene.machine, &frame)));
    }
    let contents = simulation.mechanism().summary();
    let beginning = (contents.contacts > 0).then(|| InitialPeaks::of(&mut simulation, within(MAX_COST)));
    print(&report(&scene, &contents, &start_report, &frame, beginning.as_ref())?)
}

/// The channels of a scene, one per line: name, unit, column, description.
fn channels(all: &[ChannelInfo]) -> String {
    let width = |of: fn(&ChannelInfo) -> usize| all.iter().map(of).max().unwrap_or_default();
    let name = width(|channel| channel.name.len());
    let column = width(|channel| channel.column.len());
    let mut out = String::new();
    for (by_default, title) in [(true, "Written without --channels"), (false, "Written on request")] {
        // Writing to a String cannot fail.
        let _ = writeln!(out, "{title}:");
        for channel in all.iter().filter(|channel| channel.by_default == by_default) {
            let ChannelInfo { unit, help, .. } = channel;
            let _ = writeln!(out, "  {:<name$}  {unit:<6}  {:<column$}  {help}", channel.name, channel.column);
        }
    }
    out
}

fn is_ideal(joint: &LooseJoint) -> bool {
    joint.contact.is_ideal()
}

fn report(
    scene: &Scene,
    contents: &Summary,
    start_report: &StartReport,
    start: &Frame,
    beginning: Option<&InitialPeaks>,
) -> Result<String, Failure> {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = writeln!(out, "{}: {}", scene.name, scene.title);
    for (key, value) in &scene.changes {
        let _ = writeln!(out, "  changed: {key} = {value}");
    }
    let mut line = |label: &str, value: &str| {
        let _ = writeln!(out, "{label:<22}{value}");
    };
    line(
        "Bodies",
        &format!(
            "{} moving: {}",
            scene.machine.bodies.len(),
            names(scene.machine.bodies.iter().map(|body| &body.name))
        ),
    );
    for body in scene.machine.bodies.iter().filter(|body| body.density.is_some()) {
        line(&format!("  {}", body.name), &mass_from_shapes(body));
    }
    let loose = &scene.machine.loose_joints;
    line("Joints", &joints(&scene.machine.joints, loose));
    if !scene.machine.closing_joints.is_empty() {
        line("Close loops", &joints(&scene.machine.closing_joints, loose));
    }
    for (joint, [force, torque]) in scene.machine.closing_joints.iter().zip(&start.closing) {
        let reaction = format!(
            "reaction at the start {} N and {} N m{}",
            significant(force.norm(), 6),
            significant(torque.norm(), 6),
            not_unique(start_report.indeterminate_parts(&joint.name))
        );
        line(&format!("  {}", joint.name), &reaction);
    }
    line("Joints with play", &with_and_without_play(loose));
    for (joint, report) in loose.iter().zip(&start.joints) {
        line(
            &format!("  {}", joint.name),
            &loose_joint(joint, report.normal_force.norm(), start_report.indeterminate_parts(&joint.name)),
        );
    }
    if !scene.machine.elements.is_empty() {
        line("Force elements", &format!("{}, with their forces at the start", scene.machine.elements.len()));
    }
    for (element, report) in scene.machine.elements.iter().zip(&start.elements) {
        line(&format!("  {}", element.name), &force_element(&scene.machine, element, report));
    }
    start_report.lines.iter().for_each(|(label, value)| line(label, value));
    if let Some(beginning) = beginning {
        let until = format_quantity_digits(beginning.until, "ms", 4);
        let cut = if beginning.is_cut {
            format!(", which took {MAX_COST} s of processor time: looked no further")
        } else {
            String::new()
        };
        line("Beginning", &format!("largest contact forces of the first {until}{cut}"));
        let mut peaks = loose.iter().zip(&beginning.peaks).filter(|(joint, _)| !is_ideal(joint));
        for (joint, peak) in peaks.by_ref().take(MAX_LISTED) {
            line(&format!("  {}", joint.name), &first_contact(peak));
        }
        match peaks.count() {
            0 => {}
            more => line("  …", &format!("and {}", count(more as u64, "more joint"))),
        }
    }
    line("Degrees of freedom", &freedoms(contents));
    line("Constraint rows", &rows(contents));
    start_report.indeterminate_forces().iter().for_each(|value| line("Not unique", value));
    line(
        "Equations",
        &format!(
            "{} formulation: {} velocity coordinates, {} constraint rows",
            scene.machine.formulation, contents.velocity_coordinates, contents.constraint_rows
        ),
    );
    line("Method", &method(scene, contents));
    let (computed, skipped) = computed_and_skipped(scene, contents);
    computed.iter().for_each(|item| line("Computed", item));
    skipped.iter().for_each(|item| line("Not computed", item));
    let near_singularity = ideal_fault(scene, within(MAX_COST)).map(|near| near.to_string());
    start_report.warnings_of(scene).iter().chain(&near_singularity).for_each(|warning| line("Warning", warning));
    Ok(out)
}

fn names<'a>(names: impl Iterator<Item = &'a String>) -> String {
    names.map(String::as_str).collect::<Vec<_>>().join(", ")
}

/// Mass properties of a body, computed from its shapes.
fn mass_from_shapes(body: &Body) -> String {
    let each = |values: [f64; 3], unit: &str| {
        let numbers = values.map(|value| significant(to_display(value, unit) + 0.0, 4));
        format!("{} {unit}", numbers.join(" "))
    };
    let i = &body.inertia;
    format!(
        "from its shapes: mass {}, centre {}, inertia {}, products {}",
        format_quantity(body.mass, "kg"),
        each(body.centre.into(), "mm"),
        each([i.m11, i.m22, i.m33], "kg mm^2"),
        each([-i.m12, -i.m13, -i.m23], "kg mm^2"),
    )
}

/// Joints by kind, without the free ones of bodies that a joint of `loose` carries.
fn joints(all: &[Joint], loose: &[LooseJoint]) -> String {
    let kinds = [
        JointKind::Prismatic,
        JointKind::Revolute,
        JointKind::Cylindrical,
        JointKind::Universal,
        JointKind::Free,
        JointKind::Fixed,
    ];
    let mut parts = Vec::new();
    for kind in kinds {
        for driven in [true, false] {
            let is_of_kind = |j: &&Joint| j.kind == kind && j.drives().next().is_some() == driven;
            let stands_for_loose =
                |j: &&Joint| kind == JointKind::Free && loose.iter().any(|loose| loose.name == j.name);
            let of_kind = || all.iter().filter(is_of_kind).filter(|j| !stands_for_loose(j));
            let count = of_kind().count();
            if count > 0 {
                let word = kind.word();
                let word = if driven { format!("driven {word}") } else { word.to_owned() };
                parts.push(format!("{count} {word} ({})", names(of_kind().map(|joint| &joint.name))));
            }
        }
    }
    if parts.is_empty() { "none".to_owned() } else { parts.join(", ") }
}

/// A note about the indeterminate `parts` of a reaction, if there are any.
fn not_unique(parts: Option<&str>) -> String {
    parts.map_or_else(String::new, |parts| format!(" (not unique: {parts})"))
}

/// Numbers and names of the joints that have play, and of those whose play is 0.
fn with_and_without_play(loose: &[LooseJoint]) -> String {
    let of = |ideal: bool| loose.iter().filter(move |joint| is_ideal(joint) == ideal);
    let part = |ideal: bool, what: &str| match of(ideal).count() {
        0 => None,
        number => Some(format!("{number}{what} ({})", names(of(ideal).map(|joint| &joint.name)))),
    };
    let parts: Vec<String> = part(false, "").into_iter().chain(part(true, " without")).collect();
    if parts.is_empty() { "none".to_owned() } else { parts.join(", ") }
}

fn loose_joint(joint: &LooseJoint, force: f64, indeterminate_parts: Option<&str>) -> String {
    let contact = &joint.contact;
    let kind = match joint.kind {
        LooseKind::Ball => String::new(),
        _ => format!("{}, ", joint.kind.word()),
    };
    if is_ideal(joint) {
        let reaction = significant(force, 6);
        return format!("{kind}ideal; reaction at the start {reaction} N{}", not_unique(indeterminate_parts));
    }
    let friction = match contact.friction_law {
        FrictionLaw::None => "no friction".to_owned(),
        law => format!("friction {} ({law}, {})", contact.friction, contact.friction_velocity),
    };
    format!("{kind}{}, {}, restitution {}, {friction}", dimensions(joint), contact.normal_law, contact.restitution,)
}

/// Plays and dimensions of a joint with play.
fn dimensions(joint: &LooseJoint) -> String {
    let mm = |what: &str, value: f64| format!("{what} {} mm", significant(value * 1e3, 6));
    let radius = joint.contact.ball_radius;
    let [first, second] = joint.contact.clearances();
    let parts: Vec<String> = match joint.kind {
        LooseKind::Ball => vec![mm("clearance", first), mm("ball radius", radius)],
        LooseKind::Pin(Pin { length, ends, kept, face_radius, travel }) => {
            let axial = (kept && length.is_some()).then(|| mm("axial play", second));
            let of_ends = |length| [mm("length", length), format!("ends of the {ends}")];
            let whole = [mm("radial play", first)].into_iter().chain(axial).chain([mm("pin radius", radius)]);
            whole
                .chain(length.map(of_ends).into_iter().flatten())
                .chain(length.is_none().then(|| "planar".to_owned()))
                .chain(face_radius.map(|radius| mm("face radius", radius)))
                .chain(travel.map(|travel| mm("travel", travel)))
                .collect()
        }
        LooseKind::Slide(Slide { half_length, half_width, half_height, corner_radius }) => {
            let block = [half_length, half_width].into_iter().chain(half_height);
            let sizes: Vec<String> = block.map(|half| significant(2e3 * half, 6)).collect();
            [mm("play along y", first)]
                .into_iter()
                .chain(half_height.map(|_| mm("along z", second)))
                .chain([format!("block {} mm", sizes.join(" x "))])
                .chain(half_height.is_none().then(|| "planar".to_owned()))
                .chain([mm("corner radius", corner_radius)])
                .collect()
        }
    };
    parts.join(", ")
}

/// Kind of a force element of `machine`, and its force and torque at the start.
fn force_element(machine: &Machine, element: &Element, report: &ElementReport) -> String {
    if let Place::Loose(joint) = element.describe().place
        && machine.loose_joints[joint].contact.clearance == 0.0
    {
        return format!("{}: none, as {} has no play", element.describe().word, machine.loose_joints[joint].name);
    }
    let force = report.own_force().map(|force| format!("{} N", significant(force.norm(), 6)));
    let torque = report.torque.map(|torque| format!("{} N m", significant(torque.norm(), 6)));
    let exerts: Vec<String> = force.into_iter().chain(torque).collect();
    format!("{}: {}", element.describe().word, exerts.join(" and "))
}

/// Processor time for each part of the check that steps, s.
const MAX_COST: f64 = 2.0;

/// Largest number of joints listed with their first contact forces.
const MAX_LISTED: usize = 12;

/// Largest contact force, its time and the fastest approach in the first part of a run.
fn first_contact(peak: &Peak) -> String {
    if peak.normal == 0.0 {
        return "no contact".to_owned();
    }
    let speed = match peak.impacts {
        0 => String::new(),
        _ => format!(", fastest approach {}", format_quantity_digits(peak.approach_speed, "m/s", 3)),
    };
    let [force, time] = [(peak.normal, "N"), (peak.time, "ms")].map(|(x, unit)| format_quantity_digits(x, unit, 4));
    format!("{force} at t = {time}{speed}")
}

fn freedoms(contents: &Summary) -> String {
    let (free, rows) = (contents.degrees_of_freedom, contents.constraint_rows);
    if rows == 0 {
        return free.to_string();
    }
    let independent = match contents.dependent_rows {
        0 => "",
        _ => " independent",
    };
    format!(
        "{free} ({} velocity coordinates less {}{independent} constraint rows)",
        contents.velocity_coordinates,
        rows - contents.dependent_rows,
    )
}

fn rows(contents: &Summary) -> String {
    match contents.dependent_rows {
        0 => contents.constraint_rows.to_string(),
        1 => format!("{}, one of which is redundant", contents.constraint_rows),
        more => format!("{}, {more} of which are redundant", contents.constraint_rows),
    }
}

fn method(scene: &Scene, contents: &Summary) -> String {
    let method = scene.machine.solver.method;
    let step = significant(scene.machine.solver.step * 1e6, 6);
    let is_explicit = method == Method::Automatic
        && contents.solves_differential_equation
        && contents.velocity_coordinates > contents.largest_implicit;
    match method.control() {
        StepControl::Fixed => format!("{method}, step {step} us"),
        StepControl::PerImpact => format!("{method}, {} steps per impact", scene.machine.solver.steps_per_impact),
        StepControl::Error => {
            let note = if is_explicit {
                format!(
                    "; explicit steps only: the implicit methods allow at most {} velocity coordinates",
                    contents.largest_implicit
                )
            } else {
                String::new()
            };
            format!(
                "{method}, relative tolerance {}, first step {step} us{note}",
                significant(scene.machine.solver.tolerance, 3)
            )
        }
    }
}

/// Descriptions of the parts that the run computes, and of those that it skips.
fn computed_and_skipped(scene: &Scene, contents: &Summary) -> (Vec<String>, Vec<String>) {
    let with = |ideal| names(scene.machine.loose_joints.iter().filter(move |j| is_ideal(j) == ideal).map(|j| &j.name));
    let (mut computed, mut skipped) = (Vec::new(), Vec::new());
    let mut list = |needed: bool, yes: String, no: &str| {
        if needed { computed.push(yes) } else { skipped.push(no.to_owned()) }
    };
    list(
        contents.solves_differential_equation,
        match contents.degrees_of_freedom as u64 {
            // Purely kinematic, but the number of constraint rows differs from that of the coordinates.
            0 => "the motion that the drives prescribe, with the loops closed after each step".to_owned(),
            free => format!("differential equations of {} of freedom", count(free, "degree")),
        },
        "differential equations: there is no degree of freedom, the drives prescribe the motion",
    );
    list(contents.contacts > 0, format!("contact forces at {}", with(false)), "contact forces: no joint has play");
    let has_friction = |joint: &&LooseJoint| {
        !is_ideal(joint) && joint.contact.friction > 0.0 && joint.contact.friction_law != FrictionLaw::None
    };
    let with_friction = || scene.machine.loose_joints.iter().filter(has_friction).map(|joint| &joint.name);
    list(
        with_friction().next().is_some(),
        format!("friction at {}", names(with_friction())),
        "friction: no contact has friction",
    );
    list(
        scene.machine.loose_joints.iter().any(is_ideal),
        format!("reactions of the ideal joints at {}", with(true)),
        "reactions of ideal joints: no joint has a play of 0",
    );
    if contents.closing_joints > 0 {
        let closing = names(scene.machine.closing_joints.iter().map(|joint| &joint.name));
        list(true, format!("reactions of the joints that close loops at {closing}"), "");
    }
    list(
        contents.drives > 0,
        format!("actuator forces at {}", names(scene.machine.driven().map(|(joint, _)| &joint.name))),
        "actuator forces: nothing is driven",
    );
    (computed, skipped)
}
