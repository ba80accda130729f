//! The mechanics: numbers, energy, contacts, methods, what stops and what is doubted.

#[path = "../common/mod.rs"]
mod common;

mod bushings;
mod coordinates;
mod corners;
mod discrete_gradient;
mod double_crossing;
mod doubts;
mod drives;
mod elements;
mod endurance;
mod energy;
mod extremes;
mod flights;
mod guard;
mod impact;
mod independent;
mod joint_elements;
mod known_systems;
mod ledger;
mod limits;
mod live_changes;
mod loads;
mod loop_joints;
mod machines;
mod many_joints;
mod order;
mod pays_only;
mod planar_loops;
mod promises;
mod properties;
mod reactions;
mod ready_sweeps;
mod reference;
mod restitution;
mod settled;
mod settled_start;
mod spring_curves;
mod twin;
mod two_degrees;
mod tyres;
mod validation;
mod walls;
mod wear;
mod written;
