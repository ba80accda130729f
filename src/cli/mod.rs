//! The command line: its arguments, its output and its exit codes.

mod args;
mod check;
#[cfg(feature = "gui")]
mod drivers;
mod failure;
mod gone;
mod impacts;
mod interrupt;
mod link;
mod machine;
mod map;
mod measuring;
pub mod output;
#[cfg(feature = "gui")]
mod page;
mod peaks;
mod progress;
mod provenance;
mod quantity;
pub mod reference;
#[cfg(feature = "gui")]
mod render;
mod run;
pub mod schema;
mod state;
mod summary;
mod sweep;
mod tables;
mod tradeoff;
mod wear;

use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::num::NonZero;
use std::path::Path;

use clap::Parser;

use self::args::{Arguments, Command, LessonArguments, SceneArguments, ViewArguments};
pub use self::failure::Failure;
pub use crate::scene::DEFAULT_SCENE;
use crate::scene::LiveScene;
use crate::scene::{BENCHMARKS, BUILT_IN, Scene, read_regular, reference_page, visible};

/// Size limit of a table that is read, in bytes.
const MAX_TABLE_SIZE: u64 = 64 << 20;

/// Runs the command line; returns the exit code.
pub fn main() -> u8 {
    interrupt::begin();
    let given: Vec<_> = std::env::args_os().collect();
    if let Some(answer) = gone::answer(given.get(1..).unwrap_or_default()) {
        complain(&format!("error: {answer}"));
        return Failure::USAGE;
    }
    let arguments = match Arguments::try_parse_from(given) {
        Ok(arguments) => arguments,
        Err(error) if error.use_stderr() => {
            // The message quotes user input, so it is printed with control characters visible.
            complain(error.render().to_string().trim_end());
            return Failure::USAGE;
        }
        // Help or version.
        Err(help) => return exit_code(written(help.print().and_then(|()| io::stdout().flush()))),
    };
    exit_code(dispatch(arguments))
}

/// The exit code of a command; its failure goes to standard error.
fn exit_code(outcome: Result<(), Failure>) -> u8 {
    match outcome {
        Ok(()) => 0,
        Err(failure) => {
            complain(&format!("error: {failure}"));
            failure.code
        }
    }
}

/// Number of threads: `requested`, or one per core.
fn threads(requested: Option<u16>) -> usize {
    let cores = || std::thread::available_parallelism().map_or(1, NonZero::get);
    requested.map_or_else(cores, usize::from)
}

fn dispatch(arguments: Arguments) -> Result<(), Failure> {
    match arguments.command {
        None => view(&ViewArguments::default()),
        Some(Command::View(arguments)) => view(&arguments),
        Some(Command::Scenes) => print(&scenes()?),
        Some(Command::Lessons(arguments)) => print(&lessons(&arguments)?),
        Some(Command::Check(arguments)) => check::check(&arguments),
        Some(Command::Run(arguments)) => run::run(&arguments),
        #[cfg(feature = "gui")]
        Some(Command::Render(arguments)) => {
            drivers::restart_with_runtime_dir();
            render::render(&arguments)
        }
        #[cfg(not(feature = "gui"))]
        Some(Command::Render(_)) => Err(no_graphics()),
        Some(Command::Tradeoff(arguments)) => tradeoff::tradeoff(&arguments),
        Some(Command::Sweep(arguments)) => sweep::sweep(&arguments),
        Some(Command::Map(arguments)) => map::map(&arguments),
        Some(Command::Parameters) => print(&reference_page()),
        Some(Command::Reference) => print(&reference::page()),
        Some(Command::Schema) => print(&schema::page()),
    }
}

#[cfg(feature = "gui")]
fn view(arguments: &ViewArguments) -> Result<(), Failure> {
    use crate::app::{AppOptions, Lesson, Store, WindowError, run_native};
    drivers::restart_with_runtime_dir();
    let page = page::address(arguments.page.as_deref())?;
    let options = match (&arguments.link, &arguments.lesson) {
        (Some(link), _) => Some(AppOptions::from_link(link).map_err(Failure::usage)?),
        (_, Some(lesson)) => Some(AppOptions::for_lesson(Lesson::load(lesson)?, 0)),
        (None, None) if arguments.scene.is_none() && arguments.changes.is_empty() => None,
        (None, None) => {
            let scene = arguments.scene.as_deref().unwrap_or(DEFAULT_SCENE.as_ref());
            Some(AppOptions::new(Scene::load(scene, &arguments.changes)?))
        }
    };
    let mut store = Store::for_current_user();
    if let Some(store) = store.as_mut().filter(|_| arguments.fresh) {
        store.forget();
    }
    run_native(options, page, store).map_err(|error| {
        let code = match error {
            WindowError::Start(_) => Failure::USAGE,
            WindowError::NoAdapter(_) => Failure::NO_ADAPTER,
            WindowError::Window(_) => Failure::INPUT_OUTPUT,
        };
        // The window system's own message offers no alternative.
        let message = if matches!(error, WindowError::Window(_)) && no_display() {
            "cannot open a window: there is no display; `jointplay render` draws frames without one".to_owned()
        } else {
            error.to_string()
        };
        Failure::new(code, message)
    })
}

#[cfg(feature = "gui")]
fn no_display() -> bool {
    let unset = |name| std::env::var_os(name).is_none_or(|value| value.is_empty());
    cfg!(target_os = "linux") && unset("DISPLAY") && unset("WAYLAND_DISPLAY")
}

#[cfg(not(feature = "gui"))]
fn view(_arguments: &ViewArguments) -> Result<(), Failure> {
    Err(no_graphics())
}

#[cfg(not(feature = "gui"))]
fn no_graphics() -> Failure {
    Failure::usage("this program was built without graphics; build it with the default features to see anything")
}

fn scenes() -> Result<String, Failure> {
    let mut out = String::new();
    for name in BUILT_IN.into_iter().chain(BENCHMARKS) {
        // Writing to a String cannot fail.
        let _ = writeln!(out, "{name:<22}{}", Scene::load(name, &[])?.title);
    }
    Ok(out)
}

#[cfg(feature = "gui")]
fn lessons(arguments: &LessonArguments) -> Result<String, Failure> {
    use crate::app::{Lesson, RunningLesson, lesson_titles};
    if let Some(lesson) = &arguments.lesson {
        let mut running_lesson = RunningLesson::new(Lesson::load(lesson)?, 0);
        return running_lesson.print().map_err(Failure::usage);
    }
    let mut out = String::new();
    for (name, title) in lesson_titles() {
        // Writing to a String cannot fail.
        let _ = writeln!(out, "{name:<22}{title}");
    }
    Ok(out)
}

#[cfg(not(feature = "gui"))]
fn lessons(_arguments: &LessonArguments) -> Result<String, Failure> {
    Err(no_graphics())
}

fn load(arguments: &SceneArguments) -> Result<Scene, Failure> {
    match (&arguments.link, &arguments.scene) {
        (Some(text), _) => Ok(link::parse(text)?.load()?),
        (None, scene) => Ok(Scene::load(scene.as_deref().unwrap_or_default(), &arguments.changes)?),
    }
}

/// Starts a scene; an error names the line of its file and the change concerned.
fn start(scene: &Scene) -> Result<LiveScene, Failure> {
    LiveScene::new(scene).map_err(|error| scene.locate(&error).into())
}

/// The text of a table.
///
/// # Errors
/// Input/output: unreadable, or too large.
fn read_text(path: &Path) -> Result<String, Failure> {
    let unreadable = |why: &dyn std::fmt::Display| Failure::io(format!("{}: {why}", path.display()));
    let bytes = read_regular(path, MAX_TABLE_SIZE).map_err(|error| unreadable(&error))?;
    String::from_utf8(bytes).map_err(|_| unreadable(&"this is not a text file: it is not valid UTF-8"))
}

/// Writes results to standard output, with control characters in foreign text made visible; a reader that stops early (`|
/// head`) is no error.
fn print(text: &str) -> Result<(), Failure> {
    // In a test the output of `print!` is captured.
    #[cfg(test)]
    return {
        print!("{text}");
        Ok(())
    };
    #[cfg(not(test))]
    print_out(text)
}

#[cfg(not(test))]
fn print_out(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    written(out.write_all(visible(text).as_bytes()).and_then(|()| out.flush()))
}

/// The failure of an `outcome` of writing to standard output; a reader that stops early is none.
fn written(outcome: io::Result<()>) -> Result<(), Failure> {
    match outcome {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Failure::io(format!("cannot write to standard output: {error}")))
        }
        _ => Ok(()),
    }
}

fn warn(text: &str) {
    complain(&format!("warning: {text}"));
}

/// Writes to standard error, ignoring failures.
fn complain(text: &str) {
    let _ = writeln!(io::stderr(), "{}", visible(text));
}
