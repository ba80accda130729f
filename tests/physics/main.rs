//! Tests of the mechanics: reference values, energy, contacts, methods, stops and doubts. A test of the analysis crate, so that an edit
//! in physics is tested without building the window.

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/large.rs"]
mod large;

/// The project's folder.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Path of a scene in `tests/trials`.
fn trial(name: &str) -> String {
    format!("{ROOT}/tests/trials/{name}.toml")
}

mod bristles;
mod bushings;
mod channels;
mod closed_form;
mod control;
mod coordinates;
mod corners;
mod discrete_gradient;
mod double_crossing;
mod doubts;
mod drives;
mod elements;
mod endurance;
mod energy;
mod equilibrium;
mod extremes;
mod flights;
mod formulations;
mod guard;
mod ideal;
mod impact;
mod includes;
mod independent;
mod joint_elements;
mod known_systems;
mod laws;
mod ledger;
mod limits;
mod line_contact;
mod live_changes;
mod loads;
mod loop_joints;
mod loose_kinds;
mod loose_scenes;
mod lubricants;
mod machines;
mod many_joints;
mod massless;
mod mechanism;
mod order;
mod paper;
mod pays_only;
mod planar_loops;
mod presets;
mod promises;
mod properties;
mod reachable;
mod reactions;
mod ready_sweeps;
mod reference;
mod restitution;
mod settled;
mod settled_start;
mod simultaneous;
mod spring_curves;
mod stiff;
mod tables;
mod turned;
mod turns;
mod twin;
mod two_degrees;
mod tyres;
mod validation;
mod walls;
mod wear;
mod worn;
mod written;
