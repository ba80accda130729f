//! Crash reports, shown on the page after a panic.

use std::cell::RefCell;

use wasm_bindgen::prelude::*;

use crate::scene::{Scene, visible_line};

thread_local! {
    /// Description of the running session for the report, and a link to it.
    static RUNNING: RefCell<(String, String)> = const { RefCell::new((String::new(), String::new())) };
}

#[wasm_bindgen]
extern "C" {
    /// Shows the report instead of the canvas (`web/main.js`).
    #[wasm_bindgen(js_namespace = globalThis, js_name = jointplayCrashed, catch)]
    fn crashed(report: &str, link: &str) -> Result<(), JsValue>;
}

/// Installs a panic hook that shows a report on the page.
pub fn install_hook() {
    let previous = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        let message = info.payload_as_str().unwrap_or("unknown cause");
        let location = info.location().map(|at| format!("{}:{}", at.file(), at.line())).unwrap_or_default();
        let (running, link) = RUNNING.with_borrow(Clone::clone);
        let report = format!("internal error in jointplay {}: {message}\nat {location}\n{running}", crate::VERSION);
        // Fails without a page, as in a script.
        let _ = crashed(&report, &link);
        previous(info);
    }));
}

/// Records the running session for a report. `link` is the fragment that restores it ([`super::Page::session`]).
pub fn record_session(scene: &Scene, renderer: &str, link: String) {
    let mut text = format!("scene: {}\n", scene.name);
    for (key, value) in &scene.changes {
        let (key, value) = (visible_line(key), visible_line(value));
        text.push_str(&format!("changed: {key} = {value}\n"));
    }
    let state = if link.starts_with("kept:") { "larger than an address" } else { &link };
    text.push_str(&format!("renderer: {renderer}\nstate: #{state}"));
    RUNNING.set((text, link));
}
