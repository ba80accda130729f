//! Report on the start of a scene, in words and as JSON: how assembly moved the bodies, which forces are indeterminate, and
//! what is probably not intended.

use serde_json::{Map, Value as Json, json};

use crate::presets::too_slow;
use jointplay_physics::machine::{Machine, Vec3};
use jointplay_physics::mechanism::{Placement, UnstableRest};
use jointplay_physics::simulate::{Doubt, Simulation};
use jointplay_physics::units::format_quantity_digits;
use jointplay_scene::Scene;

/// Placement in m and rad; a body that assembly moves or turns further than this gets a warning.
const WARNING_DISTANCE: Placement = Placement { moved: 5e-3, turned: 5.0 * DEGREE };

/// Placement in m and rad; a body that assembly moves and turns by less than this counts as unmoved.
const NEAR: Placement = Placement { moved: 1e-6, turned: 1e-3 * DEGREE };

const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// Name of a cut joint.
fn cut_joint(machine: &Machine, joint: usize) -> &str {
    let closing = || &machine.closing_joints[joint - machine.loose_joints.len()].name;
    let ball = machine.loose_joints.get(joint).map(|ball| &ball.name);
    ball.unwrap_or_else(closing)
}

fn exceeds(a: &Placement, b: &Placement) -> bool {
    a.moved > b.moved || a.turned > b.turned
}

fn words(placement: &Placement) -> String {
    let turned = format_quantity_digits(placement.turned / DEGREE, "", 4);
    format!("moved {}, turned {turned}°", format_quantity_digits(placement.moved, "mm", 4))
}

/// Label and text of each line about the assembly.
fn lines(simulation: &Simulation) -> Vec<(String, String)> {
    let machine = simulation.machine();
    let assembly = simulation.mechanism().assembly();
    let Some((joint, gap)) = assembly.widest else {
        return vec![("Assembly".to_owned(), "none: no joint starts closed".to_owned())];
    };
    let guess = if assembly.closed_form { "in the drives' closed form" } else { "as given" };
    let mode = if assembly.other_mode { "; another assembly mode than the guess's" } else { "" };
    let gap = if gap > NEAR.moved {
        format!("largest gap {guess} {} at {}", format_quantity_digits(gap, "mm", 4), cut_joint(machine, joint))
    } else {
        format!("no gap {guess}")
    };
    let turned = assembly.most_turned.filter(|(_, turned)| *turned > NEAR.turned);
    let turned = turned.map_or_else(String::new, |(joint, turned)| {
        format!("; turned most {} at {}", format_quantity_digits(turned, "deg", 4), cut_joint(machine, joint))
    });
    let mut lines = vec![("Assembly".to_owned(), gap + &turned + mode)];
    let bodies = || machine.bodies.iter().zip(&assembly.bodies);
    for (body, placement) in bodies().filter(|(_, p)| exceeds(p, &NEAR)) {
        lines.push((format!("  {}", body.name), words(placement)));
    }
    let unmoved = bodies().filter(|(_, p)| !exceeds(p, &NEAR)).count();
    if unmoved > 0 {
        let label = if unmoved == machine.bodies.len() { "  every body" } else { "  every other body" };
        let text = "moved less than 0.001 mm, turned less than 0.001°";
        lines.push((label.to_owned(), text.to_owned()));
    }
    lines
}

/// Assembly results that are probably not intended.
fn warnings(simulation: &Simulation) -> Vec<String> {
    let machine = simulation.machine();
    let assembly = simulation.mechanism().assembly();
    let far = machine.bodies.iter().zip(&assembly.bodies);
    let far = far.filter(|(_, placement)| exceeds(placement, &WARNING_DISTANCE));
    let far: Vec<String> = far.map(|(body, placement)| format!("{} {}", body.name, words(placement))).collect();
    let mut warnings = Vec::new();
    if !far.is_empty() {
        let open = assembly.widest.filter(|(_, gap)| *gap > NEAR.moved);
        let open = open.map(|(joint, gap)| {
            format!(" {} was {} open.", cut_joint(machine, joint), format_quantity_digits(gap, "mm", 4))
        });
        let askew = assembly.most_turned.filter(|(_, turned)| *turned > NEAR.turned);
        let askew = askew.map(|(joint, turned)| {
            format!(" {} was {} out of line.", cut_joint(machine, joint), format_quantity_digits(turned, "deg", 4))
        });
        let gap: String = open.into_iter().chain(askew).collect();
        warnings.push(format!(
            "assembly at the start moved bodies far from their poses in the scene: {}.{gap} Check axes, points and \
             start values.",
            far.join("; ")
        ));
    }
    if assembly.other_mode {
        warnings.push(
            "the loops closed in another assembly mode than that of the start values: a singular pose lies between them."
                .to_owned(),
        );
    }
    warnings.extend(assembly.unstable_rest.map(|rest| match rest {
        UnstableRest::Left => {
            "the search for an equilibrium met an unstable position of rest and left it to one side: the machine may as well rest \
             on the other side; start values nearer to the intended rest decide."
                .to_owned()
        }
        UnstableRest::Kept => {
            "the start in equilibrium is an unstable position of rest, which the slightest disturbance leaves: no rest was found \
             to either side."
                .to_owned()
        }
    }));
    let inside = simulation.doubts().into_iter().filter(|doubt| matches!(doubt, Doubt::StartsInside { .. }));
    warnings.extend(inside.map(|doubt| doubt.to_string()));
    warnings
}

/// Words for the indeterminate parts of a reaction: `the force along y, the torque across y`. The parts across those are unique.
fn parts([force, torque]: &[Vec<Vec3>; 2]) -> String {
    let part = |what: &str, along: &str, directions: &[Vec3]| match directions {
        [] => None,
        [one] => Some(format!("the {what} {along} {}", axis(one))),
        [one, other] => Some(format!("the {what} across {}", axis(&one.cross(other)))),
        _ => Some(format!("the {what}")),
    };
    let parts = [part("force", "along", force), part("torque", "about", torque)];
    parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// The axis of the world that `direction` is parallel to, otherwise its components.
fn axis(direction: &Vec3) -> String {
    let largest = direction.iamax();
    if direction[largest].abs() > 1.0 - 1e-9 {
        return ["x", "y", "z"][largest].to_owned();
    }
    let components = direction * direction[largest].signum();
    let components = components.map(|component| format_quantity_digits(component, "", 3));
    format!("({})", components.as_slice().join(" "))
}

/// Report on a scene at the start of its run.
pub struct StartReport {
    /// Label and text of each line about the assembly.
    pub lines: Vec<(String, String)>,
    /// Assembly results that are probably not intended.
    warnings: Vec<String>,
    /// Ideal ball joints, and joints that close loops, whose reactions are indeterminate.
    pub reactions: Vec<String>,
    /// Which parts of each of these are indeterminate, in words.
    parts: Vec<String>,
    /// Driven joints whose actuator forces are indeterminate.
    pub actuators: Vec<String>,
    /// The assembly as JSON, in m and rad.
    pub assembly: Json,
}

impl StartReport {
    /// Report on a simulation at its start.
    pub fn of(simulation: &mut Simulation) -> Self {
        let indeterminate = simulation.indeterminate_forces();
        let machine = simulation.machine();
        let driven: Vec<&String> = machine.driven().map(|(joint, _)| &joint.name).collect();
        let reactions = indeterminate.reactions.iter();
        Self {
            lines: lines(simulation),
            warnings: warnings(simulation),
            reactions: reactions.map(|&j| cut_joint(machine, j).to_owned()).collect(),
            parts: indeterminate.directions.iter().map(parts).collect(),
            actuators: indeterminate.actuators.iter().map(|&i| driven[i].clone()).collect(),
            assembly: json(simulation),
        }
    }

    /// The indeterminate parts of the reaction at joint `name`, in words; `None` if it is unique.
    pub fn indeterminate_parts(&self, name: &str) -> Option<&str> {
        let mut all = self.reactions.iter().zip(&self.parts);
        all.find(|(joint, _)| *joint == name).map(|(_, parts)| parts.as_str())
    }

    /// Message about indeterminate forces, if there are any.
    pub fn indeterminate_forces(&self) -> Option<String> {
        if self.reactions.is_empty() {
            return None;
        }
        let actuators = if self.actuators.is_empty() {
            String::new()
        } else {
            format!(", and of the actuators at {}", self.actuators.join(", "))
        };
        let joints = self.reactions.iter().zip(&self.parts);
        let joints: Vec<String> = joints.map(|(joint, parts)| format!("{joint} ({parts})")).collect();
        Some(format!(
            "forces at {}{actuators}: joints constrain the same direction more than once; the reactions given are \
             those of least squares",
            joints.join(", ")
        ))
    }

    /// Warnings about `scene`, the scene of this report: what is probably not intended.
    pub fn warnings_of(&self, scene: &Scene) -> Vec<String> {
        let of_machine = scene.machine.warnings().into_iter().map(|warning| warning.to_string());
        let slow = too_slow(scene).map(|slow| slow.to_string());
        of_machine.chain(slow).chain(self.warnings.iter().cloned()).collect()
    }
}

/// The assembly as JSON, in m and rad.
fn json(simulation: &Simulation) -> Json {
    let machine = simulation.machine();
    let assembly = simulation.mechanism().assembly();
    let bodies = machine.bodies.iter().zip(&assembly.bodies);
    let bodies: Map<String, Json> = bodies
        .map(|(body, p)| {
            let placement = json!({"moved_m": p.moved, "turned_rad": p.turned});
            (body.name.clone(), placement)
        })
        .collect();
    let widest = assembly.widest;
    json!({
        "largest_gap_joint": widest.map(|(joint, _)| cut_joint(machine, joint)),
        "largest_gap_m": widest.map(|(_, gap)| gap),
        "other_mode": assembly.other_mode,
        "unstable_rest": assembly.unstable_rest.map(|rest| match rest {
            UnstableRest::Left => "left",
            UnstableRest::Kept => "kept",
        }),
        "bodies": bodies,
    })
}
