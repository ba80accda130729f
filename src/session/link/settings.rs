//! Text form of the settings of plots, view and instruments that a link carries.

use crate::scene::Scene;
use crate::simulate::{MAX_PICKED, Quantity};
use crate::units::{Dimension, parse_quantity};

/// Longest window of the plots that a link may request, s.
const MAX_PLOT_WINDOW: f64 = 1e4;
/// Shortest window, s.
const MIN_PLOT_WINDOW: f64 = 1e-6;
/// Length limit of a channel's name or of a pattern, bytes.
const MAX_NAME_LENGTH: usize = 120;

const IDEAL: &str = "ideal";
const MICROSCOPE: &str = "microscope.";
const WEAR: [(&str, WearMap); 3] =
    [("wear-impulse", WearMap::Impulse), ("wear-friction-work", WearMap::FrictionWork), ("wear-depth", WearMap::Depth)];

/// A part of the scene that can be hovered or followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScenePart {
    /// A body, by index.
    Body(usize),
    /// A joint with play, by index.
    Joint(usize),
    /// A fixed shape, by index.
    Fixed(usize),
}

/// Quantity shown on the sockets' inner faces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WearMap {
    /// Nothing.
    #[default]
    Off,
    /// Time integral of the normal force.
    Impulse,
    /// Work done by friction.
    FrictionWork,
    /// Depth of what has worn off.
    Depth,
}

/// How much of the past the plots show.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum PlotWindow {
    /// The last seconds of viewing time, at any time scale.
    #[default]
    Automatic,
    /// The last seconds of simulated time.
    Last(f64),
    /// Since the reset.
    Everything,
}

/// Instruments that are on.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Instruments {
    /// Name of the joint with play under the microscope.
    pub microscope: Option<String>,
    /// The ideal motion beside the run.
    pub ideal: bool,
    /// Wear map on the sockets.
    pub wear: WearMap,
}

impl Instruments {
    /// Reads words separated by commas or spaces; `none` stands for none.
    ///
    /// # Errors
    /// An unknown word; lists the allowed ones.
    pub fn read(text: &str) -> Result<Self, String> {
        let mut instruments = Self::default();
        for part in text.split([',', ' ']).filter(|part| !part.is_empty()) {
            if let Some(joint) = part.strip_prefix(MICROSCOPE) {
                instruments.microscope = Some(joint.to_owned());
            } else if let Some((_, map)) = WEAR.iter().find(|(word, _)| *word == part) {
                instruments.wear = *map;
            } else if part == IDEAL {
                instruments.ideal = true;
            } else if part != "none" {
                return Err(format!(
                    "no instrument `{part}`; allowed, separated by commas: {MICROSCOPE}JOINT, {IDEAL}, {}, none",
                    WEAR.map(|(word, _)| word).join(", ")
                ));
            }
        }
        Ok(instruments)
    }

    /// The reverse of [`Self::read`].
    pub fn write(&self) -> String {
        let mut words: Vec<String> = Vec::new();
        words.extend(self.microscope.iter().map(|joint| format!("{MICROSCOPE}{joint}")));
        words.extend(self.ideal.then(|| IDEAL.to_owned()));
        let wear = WEAR.iter().filter(|(_, map)| *map == self.wear);
        words.extend(wear.map(|(word, _)| (*word).to_owned()));
        if words.is_empty() {
            return "none".to_owned();
        }
        words.join(" ")
    }
}

/// Reads quantities separated by commas or spaces, each once, in the order in which they are shown; `none` stands for none.
pub fn read_plots(text: &str) -> Result<Vec<Quantity>, String> {
    let mut chosen = Vec::new();
    for part in text.split([',', ' ']).filter(|part| !part.is_empty()) {
        match Quantity::ALL.iter().find(|q| q.word() == part) {
            Some(quantity) if chosen.contains(quantity) => {}
            Some(quantity) => chosen.push(*quantity),
            None if part == "none" => {}
            None => {
                let known = Quantity::ALL.map(Quantity::word);
                return Err(format!("no plot `{part}`; allowed, separated by commas: {}, none", known.join(", ")));
            }
        }
    }
    Ok(chosen)
}

/// The reverse of [`read_plots`].
pub fn write_plots(chosen: &[Quantity]) -> String {
    if chosen.is_empty() {
        return "none".to_owned();
    }
    let words: Vec<&str> = chosen.iter().map(|quantity| quantity.word()).collect();
    words.join(" ")
}

/// Reads names of channels, or patterns of them, separated by commas or spaces; `none` stands for none.
pub fn read_channels(text: &str) -> Result<Vec<String>, String> {
    let is_allowed = |c: char| c.is_ascii_alphanumeric() || "_-.*?".contains(c);
    let parts = text.split([',', ' ']).filter(|part| !part.is_empty());
    let mut names: Vec<String> = Vec::new();
    for part in parts.filter(|part| *part != "none") {
        if part.len() > MAX_NAME_LENGTH || !part.chars().all(is_allowed) {
            return Err(
                "no names of channels; allowed, separated by commas, are those that `jointplay check --channels` lists, with * for any \
                 characters and ? for one"
                    .to_owned(),
            );
        }
        if !names.iter().any(|name| name == part) {
            names.push(part.to_owned());
        }
    }
    match names.len() {
        0..=MAX_PICKED => Ok(names),
        many => Err(format!("{many} names of channels; allowed at most {MAX_PICKED}")),
    }
}

/// The reverse of [`read_channels`].
pub fn write_channels(names: &[String]) -> String {
    match names {
        [] => "none".to_owned(),
        names => names.join(" "),
    }
}

/// Reads a span of time, `automatic` or `everything`.
pub fn read_window(text: &str) -> Result<PlotWindow, String> {
    match text {
        "automatic" => return Ok(PlotWindow::Automatic),
        "everything" => return Ok(PlotWindow::Everything),
        _ => {}
    }
    let length = parse_quantity(text, Dimension::Time).map_err(|error| error.to_string())?;
    if (MIN_PLOT_WINDOW..=MAX_PLOT_WINDOW).contains(&length) {
        Ok(PlotWindow::Last(length))
    } else {
        Err("allowed automatic, everything, and 1 us to 10000 s".to_owned())
    }
}

/// The reverse of [`read_window`].
pub fn write_window(window: PlotWindow) -> String {
    match window {
        PlotWindow::Automatic => "automatic".to_owned(),
        PlotWindow::Everything => "everything".to_owned(),
        PlotWindow::Last(length) => format!("{length}s"),
    }
}

/// The part of `scene` that `text`, `joint.NAME` or `body.NAME`, names.
///
/// # Errors
/// There is no such part; lists the allowed ones.
pub fn find_followed(scene: &Scene, text: &str) -> Result<ScenePart, String> {
    let joints = || scene.machine.loose_joints.iter().map(|joint| joint.name.as_str());
    let bodies = || scene.machine.bodies.iter().map(|body| body.name.as_str());
    let found = match text.split_once('.') {
        Some(("joint", name)) => joints().position(|joint| joint == name).map(ScenePart::Joint),
        Some(("body", name)) => bodies().position(|body| body == name).map(ScenePart::Body),
        _ => None,
    };
    found.ok_or_else(|| {
        let joints = joints().map(|name| format!("joint.{name}"));
        let known: Vec<String> = joints.chain(bodies().map(|name| format!("body.{name}"))).collect();
        format!("no such part; allowed: {}", known.join(", "))
    })
}

/// The reverse of [`find_followed`].
pub fn name_followed(scene: &Scene, part: ScenePart) -> Option<String> {
    match part {
        ScenePart::Joint(index) => {
            let joint = scene.machine.loose_joints.get(index)?;
            Some(format!("joint.{}", joint.name))
        }
        ScenePart::Body(index) => Some(format!("body.{}", scene.machine.bodies.get(index)?.name)),
        ScenePart::Fixed(_) => None,
    }
}
