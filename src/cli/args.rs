//! Command-line arguments.

mod map;

use std::ffi::OsString;
use std::path::PathBuf;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::analysis::design::Start;
use crate::words::Words as _;

pub use self::map::MapArguments;

/// A 3D laboratory that shows what play in a joint does to a machine.
///
/// Without a command it opens the window.
#[derive(Debug, Parser)]
#[command(name = "jointplay", version, max_term_width = 110)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub command: Option<Command>,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Open the window on a scene.
    View(ViewArguments),
    /// List the built-in scenes, and the benchmarks of docs/validation.md.
    Scenes,
    /// List the built-in lessons, or check a lesson: compute its measures, print its texts with values and answers, and report
    /// errors and claims that fail.
    Lessons(LessonArguments),
    /// Print what a scene contains, what will be computed and what will not.
    Check(CheckArguments),
    /// Simulate without a window and write rows at equal intervals.
    Run(RunArguments),
    /// Draw frames without a window.
    Render(RenderArguments),
    /// Measure the cost and error of every method on scenes.
    Tradeoff(TradeoffArguments),
    /// Run a scene at many parameter values: statistics of any channel, sections, regimes, exponents.
    Sweep(SweepArguments),
    /// Map the error of the tip over drive positions and parameters: at rest, and with every ball, pin and block anywhere in its play.
    Map(MapArguments),
    /// Print the reference page of all parameters (Markdown).
    Parameters,
    /// Print the page about scene files, a guide and a reference of every key (Markdown).
    Reference,
    /// Print a JSON schema with which editors complete and check scene files.
    Schema,
}

/// A scene and what to change in it.
#[derive(Debug, Args)]
pub struct SceneArguments {
    /// Name of a built-in scene or a benchmark, or a file (contains `/` or ends in `.toml`).
    #[arg(required_unless_present = "link")]
    pub scene: Option<OsString>,
    /// Change a parameter, e.g. `contact.clearance=0.5mm`; may be repeated, the last wins.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = parse_change)]
    pub changes: Vec<(String, String)>,
    /// Use the scene of a share link, with its initial parameters. `run` also replays the live changes up to the link's instant
    /// and compares the state hash.
    #[arg(long, value_name = "LINK", conflicts_with_all = ["scene", "changes"])]
    pub link: Option<String>,
}

impl SceneArguments {
    /// Name of the scene in messages and in other commands.
    pub fn name(&self) -> std::path::PathBuf {
        self.scene.as_ref().map_or_else(|| "--link …".into(), Into::into)
    }
}

/// `lessons`.
#[derive(Debug, Args)]
pub struct LessonArguments {
    /// Name of a built-in lesson, or a file (contains `/` or ends in `.toml`).
    pub lesson: Option<String>,
}

/// `check`.
#[derive(Debug, Args)]
pub struct CheckArguments {
    /// Scene.
    #[command(flatten)]
    pub scene: SceneArguments,
    /// List the channels that `run --channels` can write, with unit, column and meaning, instead of checking the scene.
    #[arg(long)]
    pub channels: bool,
}

/// `view`.
#[derive(Debug, Default, Args)]
pub struct ViewArguments {
    /// Name of a built-in scene or a benchmark, or a file (contains `/` or ends in `.toml`), which is shown again whenever it is saved
    /// [default: the scene opened last; the first time measuring-machine].
    pub scene: Option<OsString>,
    /// Change a parameter, e.g. `contact.clearance=0.5mm`; may be repeated, the last wins.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = parse_change)]
    pub changes: Vec<(String, String)>,
    /// Open a share link, e.g. `?scene=pendulum&c=0.5mm&t=20ms`, and reproduce its state; the address before its `?` or
    /// `#` is optional.
    #[arg(long, value_name = "LINK", conflicts_with_all = ["scene", "changes"])]
    pub link: Option<String>,
    /// Begin a lesson, e.g. `rattle`: a built-in one by its name, or a file (contains `/` or ends in `.toml`).
    #[arg(long, value_name = "NAME|FILE", conflicts_with_all = ["scene", "changes", "link"])]
    pub lesson: Option<String>,
    /// Address of a page with the laboratory, e.g. `https://example.org/lab/`, to which `Copy link` appends its links
    /// [default: the environment variable JOINTPLAY_PAGE, at run time or else at build time; without it the window asks].
    #[arg(long, value_name = "URL")]
    pub page: Option<String>,
    /// Start fresh: forget window size, theme, type size, last scene and recent files, which are otherwise remembered.
    #[arg(long)]
    pub fresh: bool,
}

/// `run`.
#[derive(Debug, Args)]
pub struct RunArguments {
    /// Scene.
    #[command(flatten)]
    pub scene: SceneArguments,
    /// Simulated time at the end, e.g. `20ms`, counted from the start of the run also with --from-state; the last step ends exactly
    /// there. With --link the default is the link's instant.
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, required_unless_present = "link")]
    pub duration: Option<String>,
    /// Interval between rows, e.g. `0.1ms`; the first row is at 0.
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, requires = "out")]
    pub every: Option<String>,
    /// File to write; its extension selects the format: .csv, .json or .npz.
    #[arg(long, value_name = "FILE", requires = "every")]
    pub out: Option<PathBuf>,
    /// Write only the time and these channels, e.g. `S1.force,rod1.pose,*.actuator`; `*` matches any characters, `?` one
    /// character, and the first parts of a name all channels that begin with them; may be repeated. `jointplay check SCENE
    /// --channels` lists them.
    #[arg(long, value_name = "PATTERN,…", value_delimiter = ',', requires = "out")]
    pub channels: Vec<String>,
    /// File for one row per finished impact, with its effective restitution: .csv, .json or .npz.
    #[arg(long, value_name = "FILE")]
    pub impacts: Option<PathBuf>,
    /// File for the wear map: one row per cell of the walls of joints with play, with the contacts that began there,
    /// the impulse, the friction work and the worn depth: .csv, .json or .npz.
    #[arg(long, value_name = "FILE")]
    pub wear: Option<PathBuf>,
    /// File for the state at the end, from which --from-state resumes, with the same bits as a run without a break.
    #[arg(long, value_name = "FILE")]
    pub save_state: Option<PathBuf>,
    /// Resume from a state that --save-state wrote, with the same scene and the same --set. Rows begin at its time.
    #[arg(long, value_name = "FILE", conflicts_with = "link")]
    pub from_state: Option<PathBuf>,
    /// Format of the summary on standard output.
    #[arg(long, value_enum, value_name = "FORMAT", default_value = "text")]
    pub summary: SummaryForm,
    /// Replace existing files.
    #[arg(long)]
    pub force: bool,
    /// No progress and no warnings.
    #[arg(long)]
    pub quiet: bool,
}

/// `sweep`.
#[derive(Debug, Args)]
pub struct SweepArguments {
    /// Scene.
    #[command(flatten)]
    pub scene: SceneArguments,
    /// Parameter to vary; may be repeated. `contact.clearance=0.01mm..1mm:200`: equally spaced values, both ends included;
    /// `0.01mm..1mm:20:log`: with equal ratios; `contact.normal_law=hertz,flores`: listed numbers or words, also a single one. All
    /// combinations are run, the last parameter varying fastest.
    #[arg(long, value_name = "KEY=VALUES", required_unless_present = "points", conflicts_with = "points")]
    pub vary: Vec<String>,
    /// Take the points from a CSV file: a header of parameter keys, then one row per point, with units.
    #[arg(long, value_name = "FILE")]
    pub points: Option<PathBuf>,
    /// Drive periods per point, including those discarded.
    #[arg(long, value_name = "P", value_parser = parse_count, required_unless_present = "duration", requires = "discard")]
    pub periods: Option<usize>,
    /// Initial periods or crossings to discard as the transient.
    #[arg(long, value_name = "D", value_parser = parse_count)]
    pub discard: Option<usize>,
    /// Time between two sections, for drives without a common period or without any period [default: the common period].
    #[arg(long, value_name = "TIME", requires = "periods")]
    pub period: Option<String>,
    /// Length of each point's run, e.g. `2s`, in place of periods: any scene, without sections, regimes and exponents.
    #[arg(long, value_name = "TIME", conflicts_with_all = ["periods", "phase"])]
    pub duration: Option<String>,
    /// End of the transient of `--duration`: statistics begin there [default: 0].
    #[arg(long, value_name = "TIME", requires = "duration")]
    pub from: Option<String>,
    /// What to record, as CHANNEL:STATISTIC, e.g. `S1.normal:max,tip_error:rms,*.force:mean`; channels as in `run --channels`;
    /// statistics: max, min, mean, rms, std, range, end [default: the forces and impacts of the joints with play, and the tip error].
    #[arg(long, value_name = "LIST")]
    pub keep: Option<String>,
    /// Where the sections are taken: at one phase of the drive, or where a channel crosses a value, as in
    /// `crank.angle=90deg:up` or `slider.position=0:down`; then with --crossings, --discard and --duration.
    #[arg(long, value_name = "phase|CHANNEL=VALUE[:up|:down]", default_value = "phase")]
    pub section: String,
    /// Crossings of --section per point, including those discarded; --duration ends the search for them.
    #[arg(long, value_name = "N", value_parser = parse_count, requires_all = ["section", "discard", "duration"])]
    pub crossings: Option<usize>,
    /// Drive phase of the sections: a fraction of the period, or an angle such as `90deg`.
    #[arg(long, value_name = "PHASE", default_value = "0", allow_hyphen_values = true)]
    pub phase: String,
    /// Where each point starts from; several, separated by commas, run every point from each.
    #[arg(long, value_parser = start_parser(), value_name = "START", value_delimiter = ',', default_value = "cold")]
    pub start: Vec<Start>,
    /// Leave out the twin runs that measure the largest Lyapunov exponent.
    #[arg(long)]
    pub no_exponent: bool,
    /// Threads to use [default: one for each core]; the result does not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// File to write: a NumPy archive (.npz), or a table with one row per point (.csv).
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Format of the summary on standard output.
    #[arg(long, value_enum, value_name = "FORMAT", default_value = "text")]
    pub summary: SummaryForm,
    /// Replace an existing file.
    #[arg(long)]
    pub force: bool,
    /// No progress and no warnings.
    #[arg(long)]
    pub quiet: bool,
}

/// Form of the summary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SummaryForm {
    /// Text for people.
    Text,
    /// One JSON object, for scripts.
    Json,
}

/// `render`.
#[derive(Debug, Args)]
#[command(group = clap::ArgGroup::new("times").required(true).args(["at", "duration"]))]
#[command(group = clap::ArgGroup::new("destination").required(true).args(["out", "film"]))]
pub struct RenderArguments {
    /// Scene.
    #[command(flatten)]
    pub scene: SceneArguments,
    /// Instants to draw, e.g. `0s,7.85ms`. They do not end a step: the manifest has the state hash at the end of the step that
    /// contains the instant, while `run --duration` ends a step there and so reports another hash.
    #[arg(long, value_name = "TIME,…", value_delimiter = ',', allow_hyphen_values = true)]
    pub at: Vec<String>,
    /// Simulated time of a film, e.g. `0.1s`.
    #[arg(long, value_name = "TIME", requires = "fps", allow_hyphen_values = true)]
    pub duration: Option<String>,
    /// Frames per second of film.
    #[arg(long, value_name = "N", requires = "duration")]
    pub fps: Option<f64>,
    /// Slow motion: a second of film shows 1/S seconds.
    #[arg(long, value_name = "S", requires = "duration", default_value_t = 1.0)]
    pub slow: f64,
    /// Width and height of a frame in pixels.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size)]
    pub size: (u32, u32),
    /// Folder to write; it appears when all frames are done.
    #[arg(long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Film to write instead; its extension selects the format: .mp4 or .gif. It appears when all frames are done, with its
    /// metadata beside it.
    #[arg(long, value_name = "FILE", requires = "duration")]
    pub film: Option<PathBuf>,
    /// Point of view to start from.
    #[arg(long, value_enum, value_name = "VIEW", default_value = "isometric", help_heading = "Picture")]
    pub camera: CameraView,
    /// Azimuth of the camera, e.g. `30deg`; 0 looks from the front.
    #[arg(long, value_name = "ANGLE", allow_hyphen_values = true, help_heading = "Picture")]
    pub yaw: Option<String>,
    /// Elevation of the camera, e.g. `20deg`; positive looks down.
    #[arg(long, value_name = "ANGLE", allow_hyphen_values = true, help_heading = "Picture")]
    pub pitch: Option<String>,
    /// Zoom in by this factor.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, help_heading = "Picture")]
    pub zoom: f32,
    /// Close-up of one joint with play.
    #[arg(long, value_name = "JOINT", help_heading = "Picture", conflicts_with_all = ["camera", "yaw", "pitch"])]
    pub close_up: Option<String>,
    /// Which contact forces to draw.
    #[arg(long, value_enum, value_name = "WHICH", default_value = "both", help_heading = "Picture")]
    pub arrows: ArrowChoice,
    /// Scale of arrow length against force.
    #[arg(long, value_enum, value_name = "SCALE", default_value = "linear", help_heading = "Picture")]
    pub arrow_scale: ArrowScale,
    /// Force whose arrow has the reference length, e.g. `500N`; follows the forces if not given.
    #[arg(long, value_name = "FORCE", help_heading = "Picture")]
    pub arrow_reference: Option<String>,
    /// Magnification of eccentricity and clearance together, 1 to 100 [default: 1; with --ui that of the window].
    #[arg(long, value_name = "FACTOR", help_heading = "Picture")]
    pub magnification: Option<f32>,
    /// Colours.
    #[arg(long, value_enum, value_name = "THEME", default_value = "light", help_heading = "Picture")]
    pub theme: ThemeChoice,
    /// Parts of the picture to hide, e.g. `floor,triad`.
    #[arg(long, value_enum, value_name = "PART,…", value_delimiter = ',', help_heading = "Picture")]
    pub hide: Vec<Hideable>,
    /// Colour the walls of joints with play by their wear since the start, with a scale; balls, pins and blocks become
    /// translucent.
    #[arg(long, value_enum, value_name = "WHAT", help_heading = "Picture")]
    pub wear: Option<WearChoice>,
    /// Write time, forces and labels over the picture.
    #[arg(long, help_heading = "Picture")]
    pub overlay: bool,
    /// Draw the whole application with its panels instead of the scene alone.
    #[arg(long, help_heading = "Picture", conflicts_with_all = ["camera", "yaw", "pitch", "zoom", "close_up", "overlay"])]
    pub ui: bool,
    /// Replace a folder of frames.
    #[arg(long)]
    pub force: bool,
    /// No progress and no warnings.
    #[arg(long)]
    pub quiet: bool,
}

/// `tradeoff`.
#[derive(Debug, Args)]
pub struct TradeoffArguments {
    /// Names of built-in scenes or benchmarks, or files (contain `/` or end in `.toml`).
    #[arg(required = true, value_name = "SCENE")]
    pub scenes: Vec<OsString>,
    /// Change a parameter of every scene, e.g. `contact.clearance=0.5mm`; may be repeated, the last wins.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = parse_change)]
    pub changes: Vec<(String, String)>,
    /// Use a coarse grid of steps and tolerances over a tenth of a second, which takes seconds.
    #[arg(long)]
    pub quick: bool,
    /// Folder to write: `tradeoff.csv`, a row per scene, method, and step or tolerance.
    #[arg(long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// File to write: what the program states about its presets, of the built-in scenes among these; in the source,
    /// `assets/presets.json`.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["changes", "quick"])]
    pub presets: Option<PathBuf>,
    /// Replace earlier results.
    #[arg(long)]
    pub force: bool,
    /// No progress and no warnings.
    #[arg(long)]
    pub quiet: bool,
}

/// Point of view.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CameraView {
    /// From above, at an angle.
    Isometric,
    /// Level, from the front.
    Front,
    /// Level, from the right.
    Side,
    /// From above.
    Top,
}

/// Which contact forces to draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ArrowChoice {
    /// Normal forces and friction.
    Both,
    /// Normal forces.
    Normal,
    /// Friction.
    Friction,
    /// None.
    None,
}

/// Scale of arrow length against force.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ArrowScale {
    /// Proportional.
    Linear,
    /// Logarithmic over three decades below the reference force.
    Logarithmic,
}

/// What a wear map shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum WearChoice {
    /// Time integral of the normal force.
    Impulse,
    /// Magnitude of the friction work.
    Friction,
    /// Depth of what has worn off.
    Depth,
}

/// Colours of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ThemeChoice {
    /// Dark objects on a light background.
    Light,
    /// Light objects on a dark background.
    Dark,
}

/// Parts of a picture that can be hidden.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Hideable {
    /// Floor grid.
    Floor,
    /// Axis triad with gravity.
    Triad,
    /// Names of the joints with play.
    Names,
    /// Pins and rails of hinges and slides.
    Hinges,
    /// Sockets.
    Sockets,
    /// Trail of the probe tip.
    Trail,
    /// Flash of a joint that was hit.
    Flash,
    /// Hollow arrows of past peaks.
    Peaks,
}

fn parse_change(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() && !value.trim().is_empty() => {
            Ok((key.trim().to_owned(), value.trim().to_owned()))
        }
        _ => Err("expected KEY=VALUE, e.g. contact.clearance=0.5mm".to_owned()),
    }
}

/// Parser for `--start`.
fn start_parser() -> impl TypedValueParser<Value = Start> {
    let words = Start::ALL.map(|start| PossibleValue::new(start.word()).help(start.meaning()));
    PossibleValuesParser::new(words).map(|word| Start::of_word(&word).expect("one of these"))
}

/// Parses a whole number, also one like `1e3`. The upper limit is checked later, when the drive period is known.
fn parse_count(text: &str) -> Result<usize, String> {
    let number = text.parse::<f64>().ok().filter(|n| *n >= 0.0 && n.fract() == 0.0);
    let whole = text.parse().ok().or(number.map(|n| n as usize));
    whole.ok_or_else(|| "expected a whole number, e.g. 100".to_owned())
}

/// Largest edge of a frame that every adapter can draw, pixels.
const MAX_EDGE: u32 = 8192;

fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let error = || format!("expected WIDTHxHEIGHT in pixels, each from 16 to {MAX_EDGE}, e.g. 1280x720");
    let (width, height) = text.split_once(['x', 'X']).ok_or_else(error)?;
    let edge = |text: &str| text.parse().ok().filter(|e| (16..=MAX_EDGE).contains(e)).ok_or_else(error);
    Ok((edge(width)?, edge(height)?))
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    #[test]
    fn the_argument_declarations_are_consistent() {
        super::Arguments::command().debug_assert();
    }

    #[test]
    fn periods_are_whole_numbers() {
        for (text, number) in [("0", 0), ("100", 100), ("1e3", 1000)] {
            assert_eq!(super::parse_count(text), Ok(number));
        }
        assert_eq!(super::parse_count("9e18"), Ok(9_000_000_000_000_000_000));
        for bad in ["-1", "1.5", "nan", "inf", "", "x"] {
            assert!(super::parse_count(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn sizes_outside_the_range_are_refused() {
        assert_eq!(super::parse_size("1280x720"), Ok((1280, 720)));
        for bad in ["1280", "0x10", "-5x100", "99999x100", "x", "1e3x500"] {
            assert!(super::parse_size(bad).is_err(), "{bad}");
        }
    }
}
