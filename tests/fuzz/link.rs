//! Any bytes as a share link.
#![no_main]

use jointplay::app::Link;
use jointplay::scene::visible;
use jointplay::simulate::Simulation;

/// Scenes with more bodies are read but not started.
const MAX_BODIES: usize = 16;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    let link = match Link::parse(text) {
        Ok(link) => link,
        Err(error) => {
            let words = error.to_string();
            assert_eq!(visible(&words), words);
            return;
        }
    };
    // Writing a link and reading it back gives the same link.
    assert_eq!(Link::parse(&link.format()).as_ref(), Ok(&link));
    match link.load() {
        Ok(scene) if scene.machine.bodies.len() <= MAX_BODIES => {
            if let Ok(mut simulation) = Simulation::new(&scene.machine) {
                let _ = simulation.step();
            }
        }
        Ok(_) => {}
        Err(error) => {
            let words = error.to_string();
            assert_eq!(visible(&words), words);
        }
    }
});
