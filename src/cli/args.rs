//! What may be written on the command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

/// A 3D laboratory that shows what play in a ball joint does to a machine.
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
    /// List the built-in scenes.
    Scenes,
    /// Say what a scene contains, what will be computed and what will not.
    Check(SceneArguments),
    /// Simulate without a window and write rows at equal intervals.
    Run(RunArguments),
    /// Draw frames without a window.
    Render(RenderArguments),
    /// Print the reference page of all parameters (Markdown).
    Parameters,
}

/// A scene and what to change in it.
#[derive(Debug, Args)]
pub struct SceneArguments {
    /// Name of a built-in scene, or a file (contains `/` or ends in `.toml`).
    pub scene: String,
    /// Change a parameter, e.g. `contact.clearance=0.5mm`; may be repeated, the last wins.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = change)]
    pub changes: Vec<(String, String)>,
}

/// `view`.
#[derive(Debug, Args)]
pub struct ViewArguments {
    /// Name of a built-in scene, or a file (contains `/` or ends in `.toml`).
    #[arg(default_value = super::DEFAULT_SCENE)]
    pub scene: String,
    /// Change a parameter, e.g. `contact.clearance=0.5mm`; may be repeated, the last wins.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = change)]
    pub changes: Vec<(String, String)>,
    /// Open a share link, e.g. `?scene=pendulum&c=0.5mm&t=20ms`, and reproduce its state.
    #[arg(long, value_name = "LINK", conflicts_with_all = ["scene", "changes"])]
    pub link: Option<String>,
}

/// `run`.
#[derive(Debug, Args)]
pub struct RunArguments {
    /// Scene.
    #[command(flatten)]
    pub scene: SceneArguments,
    /// Simulated time, e.g. `20ms`.
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    pub duration: String,
    /// Interval between rows, e.g. `0.1ms`; the first row is at 0.
    #[arg(
        long,
        value_name = "TIME",
        allow_hyphen_values = true,
        requires = "out"
    )]
    pub every: Option<String>,
    /// File to write; its ending chooses the format: .csv, .json or .npz.
    #[arg(long, value_name = "FILE", requires = "every")]
    pub out: Option<PathBuf>,
    /// Form of the summary on standard output.
    #[arg(long, value_enum, value_name = "FORM", default_value = "text")]
    pub summary: SummaryForm,
    /// Replace an existing file.
    #[arg(long)]
    pub force: bool,
    /// No progress bar and no warnings.
    #[arg(long)]
    pub quiet: bool,
}

/// Form of the summary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SummaryForm {
    /// For a person.
    Text,
    /// One JSON object, for a script.
    Json,
}

/// `render`.
#[derive(Debug, Args)]
#[command(group = clap::ArgGroup::new("times").required(true).args(["at", "duration"]))]
pub struct RenderArguments {
    /// Scene.
    #[command(flatten)]
    pub scene: SceneArguments,
    /// Instants to draw, e.g. `0s,7.85ms`.
    #[arg(
        long,
        value_name = "TIME,…",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    pub at: Vec<String>,
    /// Simulated time of a film, e.g. `0.1s`.
    #[arg(
        long,
        value_name = "TIME",
        requires = "fps",
        allow_hyphen_values = true
    )]
    pub duration: Option<String>,
    /// Frames per second of film.
    #[arg(long, value_name = "N", requires = "duration")]
    pub fps: Option<f64>,
    /// Slow motion: a second of film shows 1/S seconds.
    #[arg(long, value_name = "S", requires = "duration", default_value_t = 1.0)]
    pub slow: f64,
    /// Width and height of a frame in pixels.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size)]
    pub size: (u32, u32),
    /// Folder to write; it appears when all frames are done.
    #[arg(long, value_name = "FOLDER")]
    pub out: PathBuf,
    /// Point of view to start from.
    #[arg(
        long,
        value_enum,
        value_name = "VIEW",
        default_value = "isometric",
        help_heading = "Picture"
    )]
    pub camera: CameraView,
    /// Turn about the vertical, e.g. `30deg`; 0 looks from the front.
    #[arg(
        long,
        value_name = "ANGLE",
        allow_hyphen_values = true,
        help_heading = "Picture"
    )]
    pub yaw: Option<String>,
    /// Height angle, e.g. `20deg`; positive looks down.
    #[arg(
        long,
        value_name = "ANGLE",
        allow_hyphen_values = true,
        help_heading = "Picture"
    )]
    pub pitch: Option<String>,
    /// Come nearer by this factor.
    #[arg(
        long,
        value_name = "FACTOR",
        default_value_t = 1.0,
        help_heading = "Picture"
    )]
    pub zoom: f32,
    /// Look at one ball joint from near by.
    #[arg(long, value_name = "BALL JOINT", help_heading = "Picture", conflicts_with_all = ["camera", "yaw", "pitch"])]
    pub close_up: Option<String>,
    /// Which contact forces to draw.
    #[arg(
        long,
        value_enum,
        value_name = "WHICH",
        default_value = "both",
        help_heading = "Picture"
    )]
    pub arrows: ArrowChoice,
    /// Length of an arrow against its force.
    #[arg(
        long,
        value_enum,
        value_name = "SCALE",
        default_value = "linear",
        help_heading = "Picture"
    )]
    pub arrow_scale: ArrowScale,
    /// Force whose arrow has the reference length, e.g. `500N`; follows the forces if not given.
    #[arg(long, value_name = "FORCE", help_heading = "Picture")]
    pub arrow_reference: Option<String>,
    /// Factor on eccentricity and clearance together, 1 to 100 [default: 1; with --ui as the window starts].
    #[arg(long, value_name = "FACTOR", help_heading = "Picture")]
    pub magnification: Option<f32>,
    /// Colours.
    #[arg(
        long,
        value_enum,
        value_name = "THEME",
        default_value = "light",
        help_heading = "Picture"
    )]
    pub theme: ThemeChoice,
    /// Things to leave out, e.g. `floor,triad`.
    #[arg(
        long,
        value_enum,
        value_name = "THING,…",
        value_delimiter = ',',
        help_heading = "Picture"
    )]
    pub hide: Vec<Hideable>,
    /// Write time, forces and labels over the picture.
    #[arg(long, help_heading = "Picture")]
    pub overlay: bool,
    /// Draw the whole application with its panels instead of the scene alone.
    #[arg(long, help_heading = "Picture", conflicts_with_all = ["camera", "yaw", "pitch", "zoom", "close_up", "overlay"])]
    pub ui: bool,
    /// Replace a folder of frames.
    #[arg(long)]
    pub force: bool,
    /// No progress bar and no warnings.
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

/// Length of an arrow against its force.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ArrowScale {
    /// Proportional.
    Linear,
    /// Three decades below the reference force.
    Logarithmic,
}

/// Colours of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ThemeChoice {
    /// Dark things on a light ground.
    Light,
    /// Light things on a dark ground.
    Dark,
}

/// What may be left out of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Hideable {
    /// Floor grid.
    Floor,
    /// Axis triad with gravity.
    Triad,
    /// Names of the ball joints.
    Names,
    /// Sockets.
    Sockets,
    /// Trail of the probe tip.
    Trail,
    /// Flash of a joint that was hit.
    Flash,
}

fn change(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() && !value.trim().is_empty() => {
            Ok((key.trim().to_owned(), value.trim().to_owned()))
        }
        _ => Err("expected KEY=VALUE, e.g. contact.clearance=0.5mm".to_owned()),
    }
}

/// Largest edge of a frame that every adapter can draw, pixels.
const LARGEST_EDGE: u32 = 8192;

fn size(text: &str) -> Result<(u32, u32), String> {
    let wrong = || {
        format!("expected WIDTHxHEIGHT in pixels, each from 16 to {LARGEST_EDGE}, e.g. 1280x720")
    };
    let (width, height) = text.split_once(['x', 'X']).ok_or_else(wrong)?;
    let edge = |text: &str| {
        text.parse()
            .ok()
            .filter(|e| (16..=LARGEST_EDGE).contains(e))
            .ok_or_else(wrong)
    };
    Ok((edge(width)?, edge(height)?))
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    #[test]
    fn the_declarations_hold_together() {
        super::Arguments::command().debug_assert();
    }

    #[test]
    fn sizes_outside_the_range_are_refused() {
        assert_eq!(super::size("1280x720"), Ok((1280, 720)));
        for bad in ["1280", "0x10", "-5x100", "99999x100", "x", "1e3x500"] {
            assert!(super::size(bad).is_err(), "{bad}");
        }
    }
}
