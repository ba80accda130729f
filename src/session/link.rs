//! Share links: a scene, its changes and the instant of a run, as the query or fragment of a URL.
//!
//! A link carries the log of a run but no state: its values are checked by the same table as user input, a person can read and
//! write it, and it does not depend on internal data structures. The price is stepping from t = 0, which takes no longer than
//! the run itself did. The state hash verifies the result.

use std::fmt::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::URL_SAFE_NO_PAD as BASE64;

use super::embedded::Embedded;
use super::goal::Goal;
use super::log::Log;
use crate::scene::{DEFAULT_SCENE, MAX_FILE_SIZE, Scene, SceneError, Texts, built_in_text, visible, visible_line};
use crate::session::pace::SCALE_RANGE;
use crate::simulate::Quantity;
use crate::units::{Dimension, parse_quantity};
use crate::words::{Words as _, words};
use settings::{Instruments, PlotWindow, ScenePart};

/// Length limit of links, characters: e-mail, chats and every browser accept this length.
pub const MAX_LINK_LENGTH: usize = 32_000;
/// Size limit of an unpacked part of a link, bytes: that of a scene file.
const MAX_UNPACKED_LINK: usize = MAX_FILE_SIZE as usize;

/// Short names of parameters.
pub const ALIASES: [(&str, &str); 4] = [
    ("c", "contact.clearance"),
    ("cf", "contact.friction"),
    ("ce", "contact.restitution"),
    ("method", "solver.method"),
];

/// Keywords of a link: every key that is not a parameter.
const KEYWORDS: [&str; 22] = [
    "scene",
    "file",
    "text",
    "t",
    "steps",
    "hash",
    "log",
    "scale",
    "camera",
    "magnification",
    "follow",
    "plots",
    "channels",
    "window",
    "show",
    "lesson",
    "step",
    "embed",
    "play",
    "version",
    "renderer",
    "theme",
];

/// Latest instant that a link may name, s; a run to it takes days.
const MAX_LINK_TIME: f64 = 1e6;
/// Renderers that a page accepts; the desktop window chooses its own.
const RENDERERS: [&str; 2] = ["webgpu", "webgl"];

/// Colour theme of the window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ThemeChoice {
    /// Dark on light.
    Light,
    /// Light on dark.
    Dark,
    /// As in the system.
    #[default]
    System,
}

words!(ThemeChoice {
    Light => "light",
    Dark => "dark",
    System => "system",
});

/// A link that cannot be read: the cause and the allowed values.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}{}", location(.key, .value), visible(.message))]
pub struct LinkError {
    /// Word or key at fault; empty if it is the whole link.
    pub key: String,
    /// Value at fault, shortened.
    pub value: String,
    /// Cause and allowed values.
    pub message: String,
}

fn location(key: &str, value: &str) -> String {
    match (key, value) {
        ("", _) => "link: ".to_owned(),
        (key, "") => format!("link: {}: ", visible_line(key)),
        (key, value) => format!("link: {} = {}: ", visible_line(key), visible_line(value)),
    }
}

/// Where the scene of a link comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SceneText {
    /// A built-in scene, by name.
    BuiltIn(String),
    /// A file contained in the link.
    File {
        /// Its name, without folders.
        name: String,
        /// Its TOML text.
        text: String,
    },
}

/// Pose of the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraPose {
    /// Rotation about the vertical, rad.
    pub yaw: f32,
    /// Elevation, rad.
    pub pitch: f32,
    /// Distance from eye to target, m.
    pub distance: f32,
    /// Point it looks at, m.
    pub target: [f32; 3],
    /// Width over height of the picture that the camera was fitted to, if not moved since; another aspect is refitted. `None`:
    /// placed by the user.
    pub fitted: Option<f32>,
}

/// A parsed link.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Link {
    /// The scene.
    pub scene: SceneText,
    /// Changes at the start of the run, and events during it.
    pub log: Log,
    /// Steps to take; without it the run continues to `time`.
    pub steps: Option<u64>,
    /// Time to show, s.
    pub time: Option<f64>,
    /// Hash of the state after the last step.
    pub hash: Option<u64>,
    /// Simulated seconds per second.
    pub time_scale: Option<f64>,
    /// Point of view; without it everything is fitted as when a scene opens.
    pub camera: Option<CameraPose>,
    /// Magnification of the play.
    pub magnification: Option<f32>,
    /// Part that the view follows, `joint.NAME` or `body.NAME`.
    pub follow: Option<String>,
    /// Plots shown.
    pub plots: Option<Vec<Quantity>>,
    /// Names of the channels with plots of their own.
    pub channels: Option<Vec<String>>,
    /// Time window of the plots.
    pub window: Option<PlotWindow>,
    /// Instruments that are on.
    pub instruments: Option<Instruments>,
    /// Name of the built-in lesson that the link belongs to.
    pub lesson: Option<String>,
    /// Step of the lesson, counted from 1.
    pub step: Option<usize>,
    /// Panels when embedded in another page.
    pub embedded: Option<Embedded>,
    /// Whether the run plays once the state is reached; by default, only if the link names no instant.
    pub playing: Option<bool>,
    /// Light, dark, or as in the system.
    pub theme: Option<ThemeChoice>,
    /// Version of the program that made the link.
    pub version: Option<String>,
    /// Texts of the files that the scene references. A link does not carry them; [`Self::to_storage_text`] does.
    pub beside: Texts,
}

/// Error message for a text that [`is_page_address`] rejects.
pub const NOT_A_PAGE_ADDRESS: &str = "not an address of a page; expected one that begins with https:// or http:// and has no `#`, e.g. https://example.org/lab/";

/// Whether `text` can be the address of a page, to which links are appended.
pub fn is_page_address(text: &str) -> bool {
    let rest = text.strip_prefix("https://").or_else(|| text.strip_prefix("http://"));
    rest.is_some_and(|rest| !rest.is_empty() && !rest.contains(|c: char| c == '#' || c.is_whitespace()))
}

/// Whether `text` is a link in one of the forms of [`Link::parse`], rather than the name of a scene or of a file.
pub fn is_link(text: &str) -> bool {
    let text = text.trim();
    text.starts_with(['#', '?'])
        || text.contains("://")
        || (text.contains('=') && !text.ends_with(".toml") && !is_file(text))
}

/// Whether `text`, the part of a link before its `?` or `#`, consists of pairs: a key has no address in it.
fn is_pairs(text: &str) -> bool {
    text.split_once('=').is_some_and(|(key, _)| !key.contains(['/', ':']))
}

/// Whether `text` is empty or an address, and not the name of a scene or of a file; without its scheme it is recognised only if
/// pairs follow.
fn is_address(text: &str, pairs_follow: bool) -> bool {
    let is_short = || pairs_follow && text.contains(['/', '.', ':']) && !text.ends_with(".toml");
    text.is_empty() || text.contains("://") || is_short()
}

/// Whether `text` is the path of a file; a browser has none.
fn is_file(text: &str) -> bool {
    cfg!(not(target_arch = "wasm32")) && std::path::Path::new(text).is_file()
}

/// The panels that a link requests, even if it cannot be opened.
pub fn requested_panels(text: &str) -> Option<Embedded> {
    let parts = text.split(['?', '#']);
    let mut words = parts.flat_map(|part| form_urlencoded::parse(part.as_bytes()));
    let (_, panels) = words.find(|(word, _)| word == "embed")?;
    Some(Embedded::read(&panels).unwrap_or_default())
}

impl Link {
    /// Reads a whole URL, a query (`?…`), a fragment (`#…`) or the bare pairs. A fragment that names a scene stands alone;
    /// otherwise the query's pairs come first and the fragment's override them. Also reads the output of [`Self::to_storage_text`].
    ///
    /// # Errors
    /// An unknown word, an invalid value, a packed part that does not unpack. Whether the scene has the parameters and allows
    /// the values is checked only in [`Self::load`].
    pub fn parse(text: &str) -> Result<Self, LinkError> {
        let text = text.trim();
        if let Some(kept) = text.strip_prefix(storage::PREFIX) {
            return storage::read(kept);
        }
        let length = text.chars().count();
        if length > MAX_LINK_LENGTH {
            let message = format!("has {length} characters; allowed at most {MAX_LINK_LENGTH}");
            return Err(link_error("", "", message));
        }
        Self::read(text)
    }

    /// As [`Self::parse`], without the length limit.
    fn read(text: &str) -> Result<Self, LinkError> {
        let (before, fragment) = text.split_once('#').unwrap_or((text, ""));
        let (address, query) = match before.split_once('?') {
            Some((address, query)) => (address, query),
            None if is_pairs(before) => ("", before),
            None => (before, ""),
        };
        if !is_address(address, text.contains(['?', '#'])) {
            let message = "is neither pairs nor the address of a page; a link is for example ?scene=pendulum&c=0.5mm, with or \
                           without an address before the `?`";
            return Err(link_error(address, "", message));
        }
        let pairs = |part: &str| -> Vec<(String, String)> {
            form_urlencoded::parse(part.as_bytes()).map(|(key, value)| (key.into_owned(), value.into_owned())).collect()
        };
        let (mut all, last) = (pairs(query), pairs(fragment));
        if last.iter().any(|(key, _)| key == "scene" || key == "text") {
            all.clear();
        }
        all.extend(last);
        Self::from_pairs(&all)
    }

    fn from_pairs(pairs: &[(String, String)]) -> Result<Self, LinkError> {
        let mut link = Self::default();
        let (mut name, mut file, mut text, mut log) = (None, None, None, None);
        let mut base: Vec<(String, String)> = Vec::new();
        for (key, value) in pairs {
            let value = value.trim();
            let wrong = |message: &str| link_error(key, value, message);
            match key.as_str() {
                "scene" => name = Some(value.to_owned()),
                "file" => {
                    let last = value.rsplit(['/', '\\']).next().unwrap_or(value);
                    let clean: String = last.chars().filter(|c| !c.is_control()).collect();
                    file = Some(clean);
                }
                "text" => text = Some(unpack(key, value)?),
                "log" => log = Some(unpack(key, value)?),
                "t" => {
                    let time = parse_quantity(value, Dimension::Time).map_err(|error| wrong(&error.to_string()))?;
                    if !(0.0..=MAX_LINK_TIME).contains(&time) {
                        return Err(wrong("allowed 0 to 1000000 s"));
                    }
                    link.time = Some(time);
                }
                "steps" => {
                    let steps = value.parse().map_err(|_| wrong("is not a number of steps"))?;
                    link.steps = Some(steps);
                }
                "hash" => {
                    let hash = (value.len() == 16).then(|| u64::from_str_radix(value, 16).ok()).flatten();
                    link.hash = Some(hash.ok_or_else(|| wrong("is not a state hash: 16 digits, 0 to 9 and a to f"))?);
                }
                "scale" => link.time_scale = Some(read_scale(value).map_err(|m| wrong(&m))?),
                "camera" => link.camera = Some(read_camera(value).map_err(|m| wrong(&m))?),
                "magnification" => {
                    let factor = value.parse::<f32>().ok();
                    let valid = factor.filter(|factor| (1.0..=100.0).contains(factor));
                    link.magnification = Some(valid.ok_or_else(|| wrong("allowed 1 to 100"))?);
                }
                "follow" => link.follow = Some(value.to_owned()),
                "plots" => link.plots = Some(settings::read_plots(value).map_err(|m| wrong(&m))?),
                "channels" => {
                    link.channels = Some(settings::read_channels(value).map_err(|m| wrong(&m))?);
                }
                "window" => link.window = Some(settings::read_window(value).map_err(|m| wrong(&m))?),
                "show" => {
                    link.instruments = Some(Instruments::read(value).map_err(|m| wrong(&m))?);
                }
                "lesson" => link.lesson = Some(value.to_owned()),
                "step" => {
                    let step = value.parse().ok().filter(|step| *step > 0);
                    link.step = Some(step.ok_or_else(|| wrong("allowed 1 and more"))?);
                }
                "embed" => link.embedded = Some(Embedded::read(value).map_err(|m| wrong(&m))?),
                "play" => {
                    link.playing = Some(match value {
                        "1" => true,
                        "0" => false,
                        _ => return Err(wrong("allowed 0 (paused) and 1 (playing)")),
                    });
                }
                // Set by the page, `web/main.js`.
                "kept" => {
                    return Err(link_error(
                        "kept",
                        "",
                        "its scene is larger than an address can hold, and is stored only in the browser tab that showed it; open the scene file here",
                    ));
                }
                "version" => link.version = Some(value.chars().take(40).collect()),
                "theme" => {
                    let theme = ThemeChoice::of_word(value);
                    link.theme = Some(theme.ok_or_else(|| wrong("allowed light, dark and system"))?);
                }
                // Chosen before the application starts, by `web/main.js`.
                "renderer" if RENDERERS.contains(&value) => {}
                "renderer" => return Err(wrong("allowed webgpu and webgl")),
                // Appended to links by other sites.
                "fbclid" | "gclid" => {}
                other if other.starts_with("utm_") => {}
                other => {
                    let alias = ALIASES.iter().find(|(short, _)| *short == other);
                    let full = alias.map_or(other, |(_, full)| full);
                    if !full.contains('.') && full != "formulation" {
                        return Err(link_error(other, "", unknown_keyword(other)));
                    }
                    base.retain(|(before, _)| before != full);
                    base.push((full.to_owned(), value.to_owned()));
                }
            }
        }
        link.log = match log {
            Some(text) => Log::read(base, &text).map_err(|message| link_error("log", "", message))?,
            None => Log::new(&base),
        };
        let last = link.log.entries.last().map_or(0, |entry| entry.steps);
        if last > 0 && link.steps.is_none_or(|steps| steps < last) {
            return Err(link_error("log", "", "continues past the link's last step"));
        }
        link.scene = match (text, name, file) {
            (Some(_), Some(name), _) => {
                return Err(link_error(
                    "scene",
                    &name,
                    "the link also has a scene file, in `text`; allowed is one scene",
                ));
            }
            (Some(text), None, file) => SceneText::File { name: file.unwrap_or_else(|| "link.toml".to_owned()), text },
            (None, _, Some(file)) => {
                return Err(link_error("file", &file, "names the scene file in `text`, which is missing"));
            }
            (None, Some(name), None) => {
                if name.contains('/') || name.ends_with(".toml") {
                    let message = "a link names a built-in scene; a file travels in `text`";
                    return Err(link_error("scene", &name, message));
                }
                SceneText::BuiltIn(name)
            }
            (None, None, None) => link.scene,
        };
        Ok(link)
    }

    /// The pairs as in a query or a fragment, without the leading `?` or `#`.
    pub fn format(&self) -> String {
        let mut out = form_urlencoded::Serializer::new(String::new());
        let mut packed = Vec::new();
        match &self.scene {
            SceneText::BuiltIn(name) => {
                out.append_pair("scene", name);
            }
            SceneText::File { name, text } => {
                out.append_pair("file", name);
                packed.push(("text", pack(text)));
            }
        }
        for (key, value) in &self.log.base {
            out.append_pair(key, value);
        }
        let mut add = |key: &str, value: Option<String>| {
            if let Some(value) = value {
                out.append_pair(key, &value);
            }
        };
        // Shortest digits that read back to the same bits.
        add("t", self.time.map(|time| format!("{time}s")));
        add("steps", self.steps.map(|steps| steps.to_string()));
        add("scale", self.time_scale.map(|scale| scale.to_string()));
        add("camera", self.camera.map(write_camera));
        add("magnification", self.magnification.map(|factor| factor.to_string()));
        add("follow", self.follow.clone());
        add("plots", self.plots.as_deref().map(settings::write_plots));
        let channels = self.channels.as_deref();
        add("channels", channels.map(settings::write_channels));
        add("window", self.window.map(settings::write_window));
        add("show", self.instruments.as_ref().map(Instruments::write));
        add("lesson", self.lesson.clone());
        add("step", self.step.map(|step| step.to_string()));
        add("embed", self.embedded.as_ref().map(Embedded::write));
        add("play", self.playing.map(|playing| u8::from(playing).to_string()));
        add("theme", self.theme.map(|theme| theme.word().to_owned()));
        add("version", self.version.clone());
        add("hash", self.hash.map(|hash| format!("{hash:016x}")));
        if !self.log.entries.is_empty() {
            packed.push(("log", pack(&self.log.to_text())));
        }
        for (key, value) in packed {
            out.append_pair(key, &value);
        }
        out.finish()
    }

    /// As [`Self::format`], within the length limit; with a note if something had to be left out.
    ///
    /// # Errors
    /// A message if the scene file is too large for a link or references other files.
    pub fn format_short(&self, pending: &Scene) -> Result<(String, Option<String>), String> {
        if let Some(name) = pending.source.beside.keys().next() {
            return Err(format!(
                "The scene reads the file {}, which a link cannot contain. Copy its contents into the scene file, or \
                 share both files instead",
                visible_line(name)
            ));
        }
        let whole = self.format();
        if whole.len() <= MAX_LINK_LENGTH {
            return Ok((whole, None));
        }
        let start = Self {
            log: Log::new(&pending.changes),
            steps: None,
            time: None,
            hash: None,
            playing: None,
            ..self.clone()
        }
        .format();
        if start.len() <= MAX_LINK_LENGTH {
            let note = format!(
                "This run has more changes than fit in a link of {MAX_LINK_LENGTH} characters ({}): the link starts the \
                 scene with the values as they are now, at t = 0",
                whole.len()
            );
            return Ok((start, Some(note)));
        }
        Err(format!(
            "The scene file is too large for a link: {} characters packed, {MAX_LINK_LENGTH} fit. Save the scene file and \
             share it instead",
            start.len()
        ))
    }

    /// Loads the scene with the changes at the start of the run.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn load(&self) -> Result<Scene, SceneError> {
        match &self.scene {
            SceneText::BuiltIn(name) => Scene::load(name, &self.log.base),
            SceneText::File { name, text } => Scene::parse_with(text, Some(name), &self.beside, &self.log.base),
        }
    }

    /// The part of `scene` that the view follows, if any.
    ///
    /// # Errors
    /// There is no such part.
    pub fn followed_part(&self, scene: &Scene) -> Result<Option<ScenePart>, LinkError> {
        self.follow
            .as_ref()
            .map(|name| settings::find_followed(scene, name).map_err(|why| link_error("follow", name, why)))
            .transpose()
    }

    /// Index of the joint with play under the microscope in `scene`, if any.
    ///
    /// # Errors
    /// There is no such joint.
    pub fn microscope_joint(&self, scene: &Scene) -> Result<Option<usize>, LinkError> {
        let Some(name) = self.instruments.as_ref().and_then(|i| i.microscope.as_ref()) else {
            return Ok(None);
        };
        let mut joints = scene.machine.loose_joints.iter();
        match joints.position(|joint| joint.name == *name) {
            Some(joint) => Ok(Some(joint)),
            None => {
                let known: Vec<_> = scene.machine.loose_joints.iter().map(|j| j.name.as_str()).collect();
                let message = format!("no such joint with play; allowed: {}", known.join(", "));
                Err(link_error("show", &format!("microscope.{name}"), message))
            }
        }
    }

    /// Whether the link, read from `text`, names no scene, change, instant, lesson or view.
    pub fn requests_nothing(&self, text: &str) -> bool {
        // Naming the default scene is a request.
        let bare = Self { theme: self.theme, embedded: self.embedded.clone(), ..Self::default() };
        !text.contains("scene=") && *self == bare
    }

    /// The instant of the link; without steps and time, the start.
    pub fn goal(&self) -> Goal {
        let steps = self.steps.or(self.time.is_none().then_some(0));
        Goal { steps, time: self.time.unwrap_or(f64::INFINITY) }
    }

    /// Whether the link names an instant to go to.
    pub fn has_instant(&self) -> bool {
        self.steps.is_some() || self.time.is_some() || self.hash.is_some() || !self.log.entries.is_empty()
    }
}

impl Default for SceneText {
    fn default() -> Self {
        Self::BuiltIn(DEFAULT_SCENE.to_owned())
    }
}

impl SceneText {
    /// Source of `scene`.
    pub fn of(scene: &Scene) -> Self {
        let text = &scene.source.text;
        if built_in_text(&scene.name) == Some(&**text) {
            return Self::BuiltIn(scene.name.clone());
        }
        let path = scene.source.file.as_deref().unwrap_or("scene.toml");
        Self::File { name: path.rsplit(['/', '\\']).next().unwrap_or(path).to_owned(), text: text.to_string() }
    }
}

fn link_error(key: &str, value: &str, message: impl Into<String>) -> LinkError {
    let short = |text: &str| -> String {
        let mut short: String = text.chars().take(60).collect();
        if short.len() < text.len() {
            short.push('…');
        }
        short
    };
    LinkError { key: short(key), value: short(value), message: message.into() }
}

fn unknown_keyword(key: &str) -> String {
    let short = ALIASES.iter().map(|(short, _)| *short);
    let known: Vec<&str> = KEYWORDS.into_iter().chain(short).collect();
    format!(
        "unknown word{}; allowed: {}, and every parameter by its key, for example contact.clearance",
        crate::scene::suggest_parameter(key, &known),
        known.join(", ")
    )
}

fn read_scale(text: &str) -> Result<f64, String> {
    let scale = match text.split_once(':') {
        Some(("1", slower)) => slower.parse::<f64>().ok().map(|slower| 1.0 / slower),
        Some(_) => None,
        None => text.parse::<f64>().ok(),
    };
    let (least, greatest) = SCALE_RANGE;
    scale
        .filter(|scale| (least..=greatest).contains(scale))
        .ok_or_else(|| format!("allowed {least} to {greatest}, or 1:1 to 1:{}", 1.0 / least))
}

fn read_camera(text: &str) -> Result<CameraPose, String> {
    let numbers: Option<Vec<f32>> = text
        .split([' ', ','])
        .filter(|part| !part.is_empty())
        .map(|part| part.parse().ok().filter(|number: &f32| number.is_finite()))
        .collect();
    let numbers = numbers.unwrap_or_default();
    let max_pitch = std::f32::consts::FRAC_PI_2;
    let (numbers, fitted) = match numbers[..] {
        [.., aspect] if numbers.len() == 7 => (&numbers[..6], Some(aspect)),
        _ => (&numbers[..], None),
    };
    match *numbers {
        [yaw, pitch, distance, x, y, z]
            if yaw.abs() <= 1e3
                && pitch.abs() <= max_pitch
                && (1e-4..=1e4).contains(&distance)
                && [x, y, z].iter().all(|part| part.abs() <= 1e4)
                && fitted.is_none_or(|aspect| (1e-2..=1e2).contains(&aspect)) =>
        {
            Ok(CameraPose { yaw, pitch, distance, target: [x, y, z], fitted })
        }
        _ => {
            Err("is not a camera: yaw and pitch (-1.57 to 1.57) in rad, distance (0.0001 to 10000) and target x, y, z \
             (-10000 to 10000) in m; then, if it shows everything, width over height (0.01 to 100) of the picture"
                .to_owned())
        }
    }
}

fn write_camera(camera: CameraPose) -> String {
    let [x, y, z] = camera.target;
    let mut words = format!("{} {} {} {x} {y} {z}", camera.yaw, camera.pitch, camera.distance);
    if let Some(aspect) = camera.fitted {
        // Writing to a String cannot fail.
        let _ = write!(words, " {aspect}");
    }
    words
}

fn pack(text: &str) -> String {
    BASE64.encode(miniz_oxide::deflate::compress_to_vec(text.as_bytes(), 9))
}

fn unpack(key: &str, packed: &str) -> Result<String, LinkError> {
    unpack_within(key, packed, MAX_UNPACKED_LINK)
}

/// The reverse of [`pack`] for a text of at most `most` bytes.
fn unpack_within(key: &str, packed: &str, most: usize) -> Result<String, LinkError> {
    let damaged = || link_error(key, "", "does not unpack: the link is cut short or damaged");
    let bytes = BASE64.decode(packed).map_err(|_| damaged())?;
    let text = miniz_oxide::inflate::decompress_to_vec_with_limit(&bytes, most).map_err(|_| damaged())?;
    String::from_utf8(text).map_err(|_| damaged())
}

pub mod settings;
mod storage;
#[cfg(test)]
mod tests;
