//! The plot and view settings that a link carries, as words.

use crate::app::plots::{Plots, Window};
use crate::scene::{Dimension, Scene, parse_quantity};
use crate::simulate::Quantity;
use crate::view::Picked;

/// Longest window of the plots that a link asks for, s.
const LONGEST_WINDOW: f64 = 1e4;
/// Shortest one, s.
const SHORTEST_WINDOW: f64 = 1e-6;

/// A quantity's word: `normal-force`.
fn word(quantity: Quantity) -> String {
    quantity.label().to_lowercase().replace(' ', "-")
}

/// Reads quantities separated by commas or spaces, in the order of [`Quantity::ALL`]; `none` stands for none.
pub fn read_plots(text: &str) -> Result<Vec<Quantity>, String> {
    let mut chosen = Vec::new();
    for part in text.split([',', ' ']).filter(|part| !part.is_empty()) {
        match Quantity::ALL.iter().find(|q| word(**q) == part) {
            Some(quantity) => chosen.push(*quantity),
            None if part == "none" => {}
            None => {
                let known: Vec<String> = Quantity::ALL.map(word).to_vec();
                return Err(format!(
                    "no plot `{part}`; allowed, separated by commas: {}, none",
                    known.join(", ")
                ));
            }
        }
    }
    let ordered = Quantity::ALL.into_iter().filter(|q| chosen.contains(q));
    Ok(ordered.collect())
}

/// The reverse of [`read_plots`].
pub fn write_plots(chosen: &[Quantity]) -> String {
    if chosen.is_empty() {
        return "none".to_owned();
    }
    let words: Vec<String> = chosen.iter().map(|quantity| word(*quantity)).collect();
    words.join(" ")
}

/// Reads a span of time, `automatic` or `everything`.
pub fn read_window(text: &str) -> Result<Window, String> {
    match text {
        "automatic" => return Ok(Window::Automatic),
        "everything" => return Ok(Window::Everything),
        _ => {}
    }
    let length = parse_quantity(text, Dimension::Time).map_err(|error| error.to_string())?;
    if (SHORTEST_WINDOW..=LONGEST_WINDOW).contains(&length) {
        Ok(Window::Last(length))
    } else {
        Err("allowed automatic, everything, and 1 us to 10000 s".to_owned())
    }
}

/// The reverse of [`read_window`].
pub fn write_window(window: Window) -> String {
    match window {
        Window::Automatic => "automatic".to_owned(),
        Window::Everything => "everything".to_owned(),
        Window::Last(length) => format!("{length}s"),
    }
}

/// The part of `scene` that `text`, `joint.NAME` or `body.NAME`, names.
///
/// # Errors
/// There is no such part; lists those there are.
pub fn find_followed(scene: &Scene, text: &str) -> Result<Picked, String> {
    let joints = || scene.ball_joints.iter().map(|joint| joint.name.as_str());
    let bodies = || scene.bodies.iter().map(|body| body.name.as_str());
    let found = match text.split_once('.') {
        Some(("joint", name)) => joints().position(|joint| joint == name).map(Picked::Joint),
        Some(("body", name)) => bodies().position(|body| body == name).map(Picked::Body),
        _ => None,
    };
    found.ok_or_else(|| {
        let joints = joints().map(|name| format!("joint.{name}"));
        let known: Vec<String> = joints
            .chain(bodies().map(|name| format!("body.{name}")))
            .collect();
        format!("no such part; allowed: {}", known.join(", "))
    })
}

/// The reverse of [`find_followed`].
pub fn name_followed(scene: &Scene, picked: Picked) -> Option<String> {
    match picked {
        Picked::Joint(index) => {
            let joint = scene.ball_joints.get(index)?;
            Some(format!("joint.{}", joint.name))
        }
        Picked::Body(index) => Some(format!("body.{}", scene.bodies.get(index)?.name)),
        Picked::Fixed(_) => None,
    }
}

/// The chosen quantities and the window of `plots`, where they differ from the defaults.
pub fn changed(plots: &Plots) -> (Option<Vec<Quantity>>, Option<Window>) {
    let first = Plots::default();
    let chosen = (plots.chosen != first.chosen).then(|| plots.chosen.clone());
    (
        chosen,
        (plots.window != first.window).then_some(plots.window),
    )
}
