//! A scene file saved in an editor while the window shows it.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::path::PathBuf;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use eframe::egui::{self, accesskit::Role};
use egui_kittest::{
    Harness,
    kittest::{NodeT as _, Queryable as _},
};
use jointplay::app::{App, AppOptions, Clock, DesktopHost, Host, Link, OpenedFile, SceneText};
use jointplay::scene::{Scene, built_in_text};

use crate::hands::builder;

/// Requests to the host, and files it will report as saved.
#[derive(Default)]
struct Calls {
    watched: Vec<Option<String>>,
    saved: VecDeque<OpenedFile>,
}

/// A desktop host without a file system.
struct MemoryHost(Rc<RefCell<Calls>>);

impl Host for MemoryHost {
    fn read_dropped(&mut self, _files: Vec<Arc<dyn egui::DroppedFile + Send + Sync>>) {}

    fn opened(&mut self) -> Option<Vec<OpenedFile>> {
        None
    }

    fn watch(&mut self, _ctx: &egui::Context, name: Option<&str>, _beside: &[String]) {
        self.0.borrow_mut().watched.push(name.map(str::to_owned));
    }

    fn saved_elsewhere(&mut self) -> Option<OpenedFile> {
        self.0.borrow_mut().saved.pop_front()
    }
}

const NAME: &str = "./mine.toml";

fn text() -> String {
    built_in_text("pendulum").expect("built in").to_owned()
}

fn stopped_clock() -> f64 {
    0.0
}

/// A clock that advances by a second at each reading.
fn slow_clock() -> f64 {
    static READINGS: AtomicU64 = AtomicU64::new(0);
    READINGS.fetch_add(1, Ordering::Relaxed) as f64
}

/// The window on the file [`NAME`] with `changes`, paused at t = 0.
fn window(changes: &[(&str, &str)], clock: Clock) -> (Harness<'static, App>, Rc<RefCell<Calls>>) {
    let pair = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
    let changes: Vec<_> = changes.iter().map(pair).collect();
    let scene = Scene::parse(&text(), Some(NAME), &changes).expect("a scene");
    let calls = Rc::new(RefCell::new(Calls::default()));
    let desk = Box::new(MemoryHost(calls.clone()));
    (open_window(scene, clock, desk), calls)
}

fn open_window(scene: Scene, clock: Clock, host: Box<dyn Host>) -> Harness<'static, App> {
    let mut options = AppOptions::new(scene);
    options.playing = false;
    options.theme = egui::Theme::Light.into();
    options.clock = clock;
    let mut harness = builder([1280.0, 800.0], egui::Theme::Light).build_eframe(move |cc| {
        let mut app = App::new(cc, options).expect("the scene starts");
        app.set_host(host);
        app
    });
    harness.run_steps(3);
    harness
}

fn save(harness: &mut Harness<'_, App>, calls: &RefCell<Calls>, name: &str, text: &str) {
    calls.borrow_mut().saved.push_back(OpenedFile { name: name.to_owned(), content: Ok(text.as_bytes().to_vec()) });
    harness.run_steps(2);
}

/// Whether the announcement contains `words`.
fn announces(harness: &Harness<'_, App>, words: &str) -> bool {
    harness.state().announcement().contains(words)
}

fn friction(harness: &Harness<'_, App>) -> f64 {
    harness.state().player().pending().machine.contact.friction
}

/// The text with another friction.
fn rougher() -> String {
    let text = text().replace("friction = 0.15", "friction = 0.25");
    assert_ne!(text, self::text());
    text
}

#[test]
fn a_saved_file_is_shown_at_the_same_instant_by_the_same_camera() {
    let (mut harness, calls) = window(&[], stopped_clock);
    assert_eq!(calls.borrow().watched, [Some(NAME.to_owned())]);
    // Saving an unchanged file causes no reload.
    save(&mut harness, &calls, NAME, &text());
    assert!(!announces(&harness, "Reloaded"));
    harness.state_mut().run_to(12.5e-3);
    harness.key_press(egui::Key::Num2);
    harness.run();
    let before = harness.state().link().camera;
    assert!(before.is_some_and(|pose| pose.fitted.is_none()));

    save(&mut harness, &calls, NAME, &rougher());
    assert_eq!(friction(&harness), 0.25);
    let player = harness.state().player();
    assert_eq!(player.pacer.shown(), 12.5e-3);
    assert!(!player.is_playing());
    assert_eq!(player.pending().source.file.as_deref(), Some(NAME));
    assert_eq!(harness.state().link().camera, before);
    assert!(announces(&harness, "Reloaded at 12.500 ms"), "{}", harness.state().announcement());
    // The run equals one of the new file from its start.
    let scene = Scene::parse(&rougher(), Some(NAME), &[]).expect("a scene");
    let mut simulation = jointplay::simulate::Simulation::new(&scene.machine).expect("starts");
    simulation.advance_to(12.5e-3).expect("runs");
    assert_eq!(player.simulation().state_hash(), simulation.state_hash());
    // The file stays watched without another request.
    assert_eq!(calls.borrow().watched.len(), 1);
}

#[test]
fn a_reload_restarts_if_the_instant_takes_too_long_to_reach() {
    let (mut harness, calls) = window(&[], slow_clock);
    harness.state_mut().run_to(12.5e-3);
    save(&mut harness, &calls, NAME, &rougher());
    assert_eq!(friction(&harness), 0.25);
    assert_eq!(harness.state().player().pacer.shown(), 0.0);
    assert!(announces(&harness, "Reloaded from the start"));
}

#[test]
fn an_error_in_the_file_is_shown_with_its_line_beside_the_running_scene() {
    let (mut harness, calls) = window(&[], stopped_clock);
    harness.state_mut().run_to(12.5e-3);
    let wrong = text().replace("friction = 0.15", "friction = -0.15");
    let line = wrong.lines().position(|line| line.starts_with("friction = -"));
    let place = format!("{NAME}:{}:", line.expect("a line") + 1);
    for (text, words) in [(wrong.as_str(), place.as_str()), ("[[[", NAME)] {
        save(&mut harness, &calls, NAME, text);
        let shown = harness.query_all_by_label_contains(words);
        assert!(shown.count() > 0, "{words}");
        assert_eq!(friction(&harness), 0.15);
        assert_eq!(harness.state().player().pacer.shown(), 12.5e-3);
    }
    // Restoring the running text removes the message and does not affect the run.
    let steps = harness.state().player().steps();
    save(&mut harness, &calls, NAME, &text());
    assert_eq!(harness.query_all_by_label_contains(NAME).count(), 0);
    assert_eq!(harness.state().player().steps(), steps);
    calls
        .borrow_mut()
        .saved
        .push_back(OpenedFile { name: NAME.to_owned(), content: Err("cannot read this file: gone".to_owned()) });
    harness.run_steps(2);
    assert!(harness.query_all_by_label_contains("gone").count() > 0);
}

#[test]
fn changes_in_the_window_stay_unless_the_file_changes_the_same_key() {
    let changes = [("contact.friction", "0.4"), ("contact.restitution", "0.7")];
    let (mut harness, calls) = window(&changes, stopped_clock);
    save(&mut harness, &calls, NAME, &rougher());
    let contact = harness.state().player().pending().machine.contact;
    assert_eq!((contact.friction, contact.restitution), (0.25, 0.7));
    assert!(announces(&harness, "Reloaded from the start, keeping 1 change"));
}

#[test]
fn only_the_file_of_the_shown_scene_is_watched() {
    let (mut harness, calls) = window(&[], stopped_clock);
    harness.state_mut().open("spcmm").expect("a scene");
    harness.run_steps(2);
    save(&mut harness, &calls, NAME, &rougher());
    assert_eq!(harness.state().player().pending().name, "spcmm");
    let link = {
        let scene = Scene::parse(&rougher(), Some(NAME), &[]).expect("a scene");
        let other = open_window(scene, stopped_clock, Box::new(DesktopHost::default()));
        other.state().share_state()
    };
    let ctx = harness.ctx.clone();
    harness.state_mut().open_link(&ctx, &link).expect("a link");
    harness.run_steps(2);
    // The scene has the file's name, but a link never makes the program read a file.
    let scene = harness.state().player().pending();
    assert_eq!(scene.source.file.as_deref(), Some("mine.toml"));
    assert_eq!(calls.borrow().watched, [Some(NAME.to_owned()), None, None]);
}

/// Runs frames until the window has noticed a change on disk and `done` holds.
fn wait(harness: &mut Harness<'_, App>, done: impl Fn(&Harness<'_, App>) -> bool) {
    let start = std::time::Instant::now();
    while !done(harness) {
        assert!(start.elapsed().as_secs() < 30);
        std::thread::sleep(std::time::Duration::from_millis(50));
        harness.run_steps(1);
    }
}

/// Text of an included file: one parameter.
fn parameter_text(name: &str, value: &str) -> String {
    format!("[[parameter]]\nname = \"{name}\"\nvalue = \"{value}\"\n")
}

#[test]
fn included_files_are_watched_and_reloaded() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let write = |name: &str, text: &str| std::fs::write(path(name), text).expect("writes");
    let including = |names: &str, text: &str| format!("include = [{names}]\n{text}");
    write("own.toml", &parameter_text("reach", "1 mm"));
    write("mine.toml", &including("\"own.toml\"", &text()));
    let changes = [("contact.restitution".to_owned(), "0.7".to_owned())];
    let scene = Scene::load(path("mine.toml"), &changes).expect("a scene");
    let mut harness = open_window(scene, stopped_clock, Box::new(DesktopHost::default()));
    let get = |harness: &Harness<'_, App>, key: &str| {
        let scene = harness.state().player().pending();
        scene.get(key).map(|value| format!("{value:?}")).ok()
    };
    let before = get(&harness, "parameter.reach");
    assert!(before.is_some());
    let notice = "Reloaded from the start, keeping 1 change";

    // A change of the included file only.
    write("own.toml", &parameter_text("reach", "25 mm"));
    wait(&mut harness, |harness| get(harness, "parameter.reach") != before);
    assert!(announces(&harness, notice), "{}", harness.state().announcement());
    // A change of the scene file, which now includes another file with an error.
    write("other.toml", "[[parameter]]\nname = 1\n");
    let both = including("\"own.toml\", \"other.toml\"", &rougher());
    write("mine.toml", &both);
    wait(&mut harness, |harness| announces(harness, "other.toml:2"));
    assert_eq!(friction(&harness), 0.15);
    write("other.toml", &parameter_text("width", "3 mm"));
    wait(&mut harness, |harness| friction(harness) == 0.25);
    assert!(announces(&harness, notice), "{}", harness.state().announcement());
    let width = get(&harness, "parameter.width");
    assert!(width.is_some());
    write("other.toml", &parameter_text("width", "3.5 mm"));
    wait(&mut harness, |harness| get(harness, "parameter.width") != width);
}

/// A file dropped on the window.
#[derive(Debug)]
struct Dropped(PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &std::path::Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        std::fs::read(&self.0).map_err(|cause| cause.to_string())
    }
}

#[test]
fn a_dropped_scene_finds_its_files_and_a_link_does_not() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("mine.toml");
    let text = format!("include = [\"own.toml\"]\n{}", rougher());
    std::fs::write(folder.path().join("own.toml"), parameter_text("reach", "1 mm")).expect("writes");
    std::fs::write(&path, &text).expect("writes");
    let scene = Scene::parse(&self::text(), None, &[]).expect("a scene");
    let mut harness = open_window(scene, stopped_clock, Box::new(DesktopHost::default()));
    let file = Arc::new(Dropped(path.clone()));
    harness.input_mut().dropped_files.push(file);
    harness.run_steps(3);
    assert_eq!(friction(&harness), 0.25, "{}", harness.state().announcement());
    let source = &harness.state().player().pending().source;
    assert!(source.beside.contains_key("own.toml"));

    let name = path.display().to_string();
    let scene = SceneText::File { name, text };
    let link = Link { scene, ..Link::default() };
    let ctx = harness.ctx.clone();
    let opened = harness.state_mut().open_link(&ctx, &link.format());
    let reason = opened.expect_err("no folder");
    assert!(reason.contains("has no folder"), "{reason}");
}

#[test]
fn a_file_on_the_disk_is_noticed() {
    let folder = tempfile::tempdir().expect("a folder");
    let path: PathBuf = folder.path().join("mine.toml");
    std::fs::write(&path, text()).expect("writes");
    let scene = Scene::load(&path, &[]).expect("a scene");
    let mut harness = open_window(scene, stopped_clock, Box::new(DesktopHost::default()));
    std::fs::write(&path, rougher()).expect("writes");
    wait(&mut harness, |harness| friction(harness) == 0.25);
    assert!(announces(&harness, "Reloaded"));
    let labels = harness.query_all_by_label_contains("Reloaded");
    assert!(labels.filter(|node| node.accesskit_node().role() == Role::Status).count() > 0);
}
