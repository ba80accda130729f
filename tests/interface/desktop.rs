//! Features of the desktop only: the window for the class, system dialogs, and settings remembered between starts.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;

use eframe::egui::{
    self, Context, ImmediateViewport, Key, Pos2, RawInput, Rect, Shape, ThemePreference, ViewportEvent, vec2,
};
use egui_kittest::{Harness, kittest::Queryable as _};
use jointplay::app::{App, Host, OpenedFile, SaveFile, Store, StoredSettings};
use jointplay::scene::{DEFAULT_SCENE, built_in_text};

use crate::hands::type_over;
use crate::hands::window::{click, shown, window};

/// Size of the audience's screen, points at zoom 1.
const SCREEN: egui::Vec2 = vec2(1280.0, 720.0);

/// The second window as recorded by the tests.
#[derive(Default)]
struct AudienceWindow {
    /// Texts with their font size as a fraction of the window's height.
    texts: Vec<(String, f32)>,
    events: Vec<egui::Event>,
    close: bool,
    shown: usize,
}

impl AudienceWindow {
    fn has(&self, part: &str) -> bool {
        self.texts.iter().any(|(text, _)| text.contains(part))
    }
}

thread_local! {
    static AUDIENCE: RefCell<AudienceWindow> = RefCell::default();
}

/// Shows a second viewport as a platform does.
fn show_audience(ctx: &Context, window: ImmediateViewport<'_>) {
    let ImmediateViewport { ids, mut viewport_ui_cb, .. } = window;
    let zoom = ctx.zoom_factor();
    let (events, close) = AUDIENCE.with_borrow_mut(|audience| (std::mem::take(&mut audience.events), audience.close));
    let info = egui::ViewportInfo {
        events: close.then_some(ViewportEvent::Close).into_iter().collect(),
        ..Default::default()
    };
    let input = RawInput {
        viewport_id: ids.this,
        viewports: [(ids.this, info)].into_iter().collect(),
        screen_rect: Some(Rect::from_min_size(Pos2::ZERO, SCREEN / zoom)),
        events,
        ..Default::default()
    };
    let mut output = ctx.run_ui(input, |ui| viewport_ui_cb(ui));
    // No textures are uploaded.
    output.textures_delta.clear();
    let mut texts = Vec::new();
    for part in &output.shapes {
        add_texts(&part.shape, zoom / SCREEN.y, &mut texts);
    }
    AUDIENCE.with_borrow_mut(|audience| (audience.texts, audience.shown) = (texts, audience.shown + 1));
}

fn add_texts(shape: &Shape, share: f32, out: &mut Vec<(String, f32)>) {
    match shape {
        Shape::Vec(shapes) => shapes.iter().for_each(|shape| add_texts(shape, share, out)),
        Shape::Text(text) => {
            let sizes = text.galley.job.sections.iter().map(|section| section.format.font_id.size);
            out.push((text.galley.text().to_owned(), sizes.fold(f32::INFINITY, f32::min) * share));
        }
        _ => {}
    }
}

#[test]
fn the_window_for_the_class_shows_the_same_instant_in_large_type_and_closes_without_a_trace() {
    let mut harness = window("spcmm");
    harness.ctx.set_embed_viewports(false);
    Context::set_immediate_viewport_renderer(show_audience);
    harness.state_mut().player_mut().run_to(30e-3);
    harness.run();
    let visible_state = |harness: &Harness<'_, App>| {
        let pose = harness.state().camera_pose().expect("a picture");
        (shown(harness), harness.state().link().format(), harness.ctx.zoom_factor(), [pose.yaw, pose.distance])
    };
    let before = visible_state(&harness);
    click(&mut harness, "Open");
    click(&mut harness, "Window for the class");
    assert!(harness.state().has_audience());
    harness.run();
    let last = harness.state().last_impact().expect("an impact");
    AUDIENCE.with_borrow(|audience| {
        for part in ["t = 30.0000 ms", &*last, "S1", "Force on the ball, N", "clearance drawn ×20"] {
            assert!(audience.has(part), "{part}: {:?}", audience.texts);
        }
        assert!(!audience.has("Normal force"), "no plot is chosen");
        for (text, share) in &audience.texts {
            assert!(*share >= 1.0 / 40.0 - 1e-6, "{text}: {share}");
        }
    });
    // The controls stay unchanged.
    for label in ["Play", "Save", "View options"] {
        harness.get_by_label(label);
    }
    assert_eq!(visible_state(&harness), before);

    // P in the audience's window shows the next plot; keys of the run affect both windows.
    let press = |key| {
        let modifiers = egui::Modifiers::NONE;
        let event = |pressed| egui::Event::Key { key, physical_key: None, pressed, repeat: false, modifiers };
        AUDIENCE.with_borrow_mut(|audience| audience.events.extend([true, false].map(event)));
    };
    for (title, other) in [("Tip error by axis, mm", "Normal force, N"), ("Normal force, N", "Tip error by axis, mm")] {
        press(Key::P);
        harness.run_steps(3);
        AUDIENCE.with_borrow(|audience| {
            assert!(audience.has(title) && !audience.has(other), "{:?}", audience.texts);
            assert!(audience.texts.iter().all(|(_, share)| *share >= 1.0 / 40.0 - 1e-6), "{:?}", audience.texts);
        });
    }
    press(Key::P);
    harness.run_steps(3);
    AUDIENCE.with_borrow(|audience| assert!(!audience.has("Normal force, N")));
    press(Key::Comma);
    harness.run_steps(3);
    assert!(shown(&harness) < 30e-3);
    harness.state_mut().show_instant(30e-3);

    AUDIENCE.with_borrow_mut(|audience| audience.close = true);
    harness.run();
    assert!(!harness.state().has_audience());
    let frames = AUDIENCE.with_borrow(|audience| audience.shown);
    harness.run_steps(3);
    assert_eq!(AUDIENCE.with_borrow(|audience| audience.shown), frames, "it is gone");
    assert_eq!(visible_state(&harness), before);
}

#[test]
fn a_single_window_platform_has_no_second_window_and_without_stored_settings_no_fresh_start() {
    let mut harness = window("spcmm");
    click(&mut harness, "Open");
    harness.get_by_label("File…");
    assert!(harness.query_by_label("Start fresh…").is_none());
    assert!(harness.query_by_label_contains("Window for the class").is_none());
}

/// The window with its settings stored in `path`.
fn with_store(path: &std::path::Path) -> Harness<'static, App> {
    let mut harness = window("pendulum");
    let ctx = harness.ctx.clone();
    ctx.set_theme(ThemePreference::System);
    harness.state_mut().store_settings_in(&ctx, Store::at(path.to_owned()));
    harness.run();
    harness
}

fn stored(path: &std::path::Path) -> StoredSettings {
    Store::at(path.to_owned()).remembered().clone()
}

#[test]
fn a_presentation_of_an_instant_leaves_the_type_as_it_was() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("window.json");
    let mut harness = with_store(&path);
    harness.ctx.set_zoom_factor(1.25);
    harness.run();
    let key = |key: Key, pressed: bool| {
        let (physical_key, modifiers) = (None, egui::Modifiers::NONE);
        egui::Event::Key { key, physical_key, pressed, repeat: false, modifiers }
    };
    // Both keys within a frame, then with some frames between.
    for frames in [0, 1, 2, 5] {
        for (index, pressed) in [Key::F5, Key::Escape].into_iter().enumerate() {
            harness.input_mut().events.extend([key(pressed, true), key(pressed, false)]);
            if index == 0 {
                harness.run_steps(frames);
                assert_eq!(harness.state().is_presenting(), frames > 0);
            }
        }
        harness.step();
        assert!(!harness.state().is_presenting());
        // Closed in the very next moment.
        eframe::App::on_exit(harness.state_mut());
        assert_eq!(stored(&path).zoom, Some(1.25), "{frames}");
        harness.run();
        assert_eq!(harness.ctx.zoom_factor(), 1.25, "{frames}");
    }
}

#[test]
fn theme_zoom_and_scenes_are_remembered_until_a_fresh_start() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("window.json");
    let file = |name: &str| folder.path().join(name);
    for (name, scene) in [("one.toml", "chain"), ("two.toml", "spcmm")] {
        std::fs::write(file(name), built_in_text(scene).expect("built in")).expect("writable");
    }
    let mut harness = with_store(&path);
    assert_eq!(stored(&path).scene.as_deref(), Some("pendulum"));
    for name in ["one.toml", "two.toml"] {
        harness.state_mut().open(&file(name).display().to_string()).expect("a scene");
        harness.run();
    }
    let listed = |name: &str| file(name).display().to_string();
    assert_eq!(stored(&path).recent, [listed("two.toml"), listed("one.toml")]);
    assert_eq!(stored(&path).scene, Some(listed("two.toml")));
    harness.ctx.set_theme(ThemePreference::Dark);
    harness.ctx.set_zoom_factor(1.25);
    harness.run();
    eframe::App::on_exit(harness.state_mut());
    assert_eq!(stored(&path).theme.as_deref(), Some("dark"));
    drop(harness);

    let mut harness = with_store(&path);
    assert_eq!(harness.ctx.zoom_factor(), 1.25);
    assert!(harness.ctx.options(|options| options.theme_preference == ThemePreference::Dark));
    // A presentation has a zoom of its own.
    harness.key_press(Key::F5);
    harness.run();
    eframe::App::on_exit(harness.state_mut());
    assert_eq!(stored(&path).zoom, Some(1.25));
    harness.key_press(Key::F5);
    harness.run();

    click(&mut harness, "Open");
    click(&mut harness, "one.toml");
    harness.run();
    assert_eq!(harness.state().player().running().name, "chain");
    std::fs::remove_file(file("two.toml")).expect("there");
    click(&mut harness, "Open");
    click(&mut harness, "two.toml");
    harness.run();
    assert_eq!(harness.state().player().running().name, "chain", "it stays");
    assert!(harness.query_all_by_label_contains("two.toml").next().is_some(), "a message names it");

    click(&mut harness, "Open");
    click(&mut harness, "Start fresh…");
    click(&mut harness, "Start fresh");
    harness.run_steps(3);
    assert_eq!(harness.state().player().running().name, DEFAULT_SCENE);
    assert_eq!(harness.ctx.zoom_factor(), 1.0);
    assert!(harness.ctx.options(|options| options.theme_preference == ThemePreference::System));
    let now = stored(&path);
    assert_eq!((now.scene.as_deref(), now.recent.len(), now.size), (Some(DEFAULT_SCENE), 0, None));
}

/// A desktop host whose dialogs are answered by a test.
struct ScriptedDesktop(Rc<RefCell<Dialogs>>);

#[derive(Default)]
struct Dialogs {
    /// Whether the system has file dialogs.
    available: bool,
    suggested: Vec<String>,
    answer: Option<Option<String>>,
    saved: Vec<SaveFile>,
}

impl Host for ScriptedDesktop {
    fn asks_for_path(&self) -> bool {
        true
    }

    fn save(&mut self, files: &[SaveFile]) -> Result<String, String> {
        self.0.borrow_mut().saved.extend_from_slice(files);
        Ok(format!("Saved {}", files[0].name))
    }

    fn pick_path(&mut self, name: &str) -> bool {
        let mut dialogs = self.0.borrow_mut();
        dialogs.suggested.push(name.to_owned());
        dialogs.available
    }

    fn picked_path(&mut self, _ctx: &Context, _frame: &eframe::Frame) -> Option<Option<String>> {
        self.0.borrow_mut().answer.take()
    }

    fn read_dropped(&mut self, _files: Vec<Arc<dyn egui::DroppedFile + Send + Sync>>) {}

    fn opened(&mut self) -> Option<Vec<OpenedFile>> {
        None
    }
}

#[test]
fn files_are_saved_to_the_path_from_the_dialog_or_else_from_the_text_field() {
    let mut harness = window("pendulum");
    let dialogs = Rc::new(RefCell::new(Dialogs { available: true, ..Dialogs::default() }));
    harness.state_mut().set_host(Box::new(ScriptedDesktop(dialogs.clone())));
    let names = || -> Vec<String> { dialogs.borrow().saved.iter().map(|file| file.name.clone()).collect() };
    for answer in [None, Some("/data/mine.csv".to_owned())] {
        harness.state_mut().save_record();
        harness.run();
        assert!(harness.query_by_label("Path").is_none(), "the dialog of the system asks");
        assert!(names().is_empty());
        dialogs.borrow_mut().answer = Some(answer);
        harness.run();
    }
    assert_eq!(dialogs.borrow().suggested, vec!["pendulum-0.000ms.csv"; 2]);
    assert_eq!(names(), ["/data/mine.csv", "/data/mine.csv.meta.json"]);

    dialogs.borrow_mut().available = false;
    harness.state_mut().save_record();
    harness.run();
    type_over(&mut harness, "Path", "typed.csv");
    harness.key_press(Key::Enter);
    harness.run();
    assert_eq!(names()[2..], ["typed.csv", "typed.csv.meta.json"]);
}
