//! Desktop entry.
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::disallowed_types))]

#[cfg(not(target_arch = "wasm32"))]
use jointplay::scene::{visible, visible_line};

#[cfg(not(target_arch = "wasm32"))]
fn main() -> std::process::ExitCode {
    if std::env::var_os("RUST_LOG").is_some() {
        // Log messages may contain text of a scene.
        env_logger::Builder::from_default_env()
            .format(|out, record| {
                use std::io::Write;
                let message = record.args().to_string();
                let (level, target) = (record.level(), record.target());
                writeln!(out, "[{level} {target}] {}", visible(&message))
            })
            .init();
    }
    explain_panics();
    // Unwinding first lets temporary files be removed.
    let code = std::panic::catch_unwind(jointplay::cli::main).unwrap_or(jointplay::cli::Failure::INPUT_OUTPUT);
    std::process::ExitCode::from(code)
}

/// The browser has its own entry.
#[cfg(target_arch = "wasm32")]
fn main() {}

/// Reports a panic, which is a bug in the program, in one line with its location instead of a trace.
#[cfg(not(target_arch = "wasm32"))]
fn explain_panics() {
    use std::io::Write;
    use std::panic;
    let trace = panic::take_hook();
    panic::set_hook(Box::new(move |info| {
        if std::env::var_os("RUST_BACKTRACE").is_some() {
            trace(info);
        }
        let cause = info.payload_as_str().unwrap_or("unknown cause");
        let place = info.location().map(|place| format!(" ({}:{})", place.file(), place.line())).unwrap_or_default();
        let _ = writeln!(
            std::io::stderr(),
            "internal error in jointplay {}: {}{place}. This is a bug in the program; please report this line and the \
             command that led to it.",
            jointplay::VERSION,
            visible_line(cause),
        );
    }));
}
