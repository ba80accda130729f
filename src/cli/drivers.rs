//! Keeps graphics drivers from speaking to our user.

/// Begins this program again with a runtime folder where it has none, before anything else is done.
///
/// Mesa asks Wayland's library for a display, with a window or without one, and that library complains on standard error
/// where `XDG_RUNTIME_DIR` does not name a folder. One that is not there it takes in silence. An environment can be changed
/// safely for a new program alone.
#[cfg(target_os = "linux")]
pub fn quieten() {
    use std::os::unix::process::CommandExt;
    use std::path::{Path, PathBuf};
    use std::process::Command;

    const FOLDER: &str = "XDG_RUNTIME_DIR";
    let named = std::env::var_os(FOLDER).map(PathBuf::from);
    if named.is_some_and(|folder| folder.is_absolute()) {
        return;
    }
    let Ok(program) = std::env::current_exe() else {
        return;
    };
    let mut arguments = std::env::args_os();
    let name = arguments.next().unwrap_or_else(|| program.clone().into());
    let error = Command::new(program)
        .arg0(name)
        .args(arguments)
        .env(FOLDER, Path::new("/nonexistent"))
        .exec();
    // Then with the complaints.
    log::info!("cannot begin again: {error}");
}

/// Nothing is known of others.
#[cfg(not(target_os = "linux"))]
pub fn quieten() {}
