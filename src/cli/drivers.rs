//! Keeps graphics drivers from writing to the user's terminal.

/// Restarts this program with a runtime folder if it has none, before anything else is done.
///
/// Mesa asks Wayland's library for a display even without a window. That library complains on standard error if
/// `XDG_RUNTIME_DIR` does not name a folder, but silently accepts one that does not exist. The environment can be changed
/// safely only for a new program.
#[cfg(target_os = "linux")]
pub fn restart_with_runtime_dir() {
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
    let error = Command::new(program).arg0(name).args(arguments).env(FOLDER, Path::new("/nonexistent")).exec();
    // The program works without the folder, only with complaints.
    log::info!("cannot restart: {error}");
}

/// Does nothing: no other system is known to need it.
#[cfg(not(target_os = "linux"))]
pub fn restart_with_runtime_dir() {}
