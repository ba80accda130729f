//! What only the desktop has: a window for the class, dialogs of the system, and a memory from one start to the next.

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
use crate::window::{click, shown, window};

/// Size of the screen for the class, points at zoom 1.
const SCREEN: egui::Vec2 = vec2(1280.0, 720.0);

/// The second window, as the tests show it.
#[derive(Default)]
struct Second {
    /// Texts with the size of their type as a share of the window's height.
    texts: Vec<(String, f32)>,
    events: Vec<egui::Event>,
    close: bool,
    shown: usize,
}

impl Second {
    fn has(&self, part: &str) -> bool {
        self.texts.iter().any(|(text, _)| text.contains(part))
    }
}

thread_local! {
    static SECOND: RefCell<Second> = RefCell::default();
}

/// Shows second windows as a platform does.
fn show_second(ctx: &Context, window: ImmediateViewport<'_>) {
    let ImmediateViewport { ids, mut viewport_ui_cb, .. } = window;
    let zoom = ctx.zoom_factor();
    let (events, close) = SECOND.with_borrow_mut(|second| (std::mem::take(&mut second.events), second.close));
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
    // No texture is made of it.
    output.textures_delta.clear();
    let mut texts = Vec::new();
    for part in &output.shapes {
        add_texts(&part.shape, zoom / SCREEN.y, &mut texts);
    }
    SECOND.with_borrow_mut(|second| (second.texts, second.shown) = (texts, second.shown + 1));
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
fn the_window_for_the_class_shows_the_same_instant_in_large_type_and_gives_everything_back() {
    let mut harness = window("spcmm");
    harness.ctx.set_embed_viewports(false);
    Context::set_immediate_viewport_renderer(show_second);
    harness.state_mut().player_mut().run_to(30e-3);
    harness.run();
    let look = |harness: &Harness<'_, App>| {
        let pose = harness.state().camera_pose().expect("a picture");
        (shown(harness), harness.state().link().format(), harness.ctx.zoom_factor(), [pose.yaw, pose.distance])
    };
    let before = look(&harness);
    click(&mut harness, "Open");
    click(&mut harness, "Window for the class");
    assert!(harness.state().has_audience());
    harness.run();
    let last = harness.state().last_impact().expect("an impact");
    SECOND.with_borrow(|second| {
        for part in ["t = 30.0000 ms", &*last, "S1", "Force on the ball, N", "clearance drawn ×20"] {
            assert!(second.has(part), "{part}: {:?}", second.texts);
        }
        assert!(!second.has("Normal force"), "no plot is chosen");
        for (text, share) in &second.texts {
            assert!(*share >= 1.0 / 40.0 - 1e-6, "{text}: {share}");
        }
    });
    // The controls stay, as they were.
    for label in ["Play", "Save", "View options"] {
        harness.get_by_label(label);
    }
    assert_eq!(look(&harness), before);

    // P in it turns to the next plot, and a key of the run moves both.
    let press = |key| {
        let modifiers = egui::Modifiers::NONE;
        let event = |pressed| egui::Event::Key { key, physical_key: None, pressed, repeat: false, modifiers };
        SECOND.with_borrow_mut(|second| second.events.extend([true, false].map(event)));
    };
    for (title, other) in [("Normal force, N", "Eccentricity, mm"), ("Eccentricity, mm", "Normal force, N")] {
        press(Key::P);
        harness.run_steps(3);
        SECOND.with_borrow(|second| {
            assert!(second.has(title) && !second.has(other), "{:?}", second.texts);
            assert!(second.texts.iter().all(|(_, share)| *share >= 1.0 / 40.0 - 1e-6), "{:?}", second.texts);
        });
    }
    press(Key::P);
    harness.run_steps(3);
    SECOND.with_borrow(|second| assert!(!second.has("Eccentricity")));
    press(Key::Comma);
    harness.run_steps(3);
    assert!(shown(&harness) < 30e-3);
    harness.state_mut().show_instant(30e-3);

    SECOND.with_borrow_mut(|second| second.close = true);
    harness.run();
    assert!(!harness.state().has_audience());
    let frames = SECOND.with_borrow(|second| second.shown);
    harness.run_steps(3);
    assert_eq!(SECOND.with_borrow(|second| second.shown), frames, "it is gone");
    assert_eq!(look(&harness), before);
}

#[test]
fn where_a_platform_has_one_window_there_is_no_second_and_without_a_memory_no_menu() {
    let harness = window("spcmm");
    harness.get_by_label("Open…");
    assert!(harness.query_by_label("Open").is_none());
}

/// The window with its memory in `path`.
fn remembering(path: &std::path::Path) -> Harness<'static, App> {
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
fn theme_type_size_and_scenes_are_remembered_and_start_as_new_forgets_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("window.json");
    let file = |name: &str| folder.path().join(name);
    for (name, scene) in [("one.toml", "chain"), ("two.toml", "spcmm")] {
        std::fs::write(file(name), built_in_text(scene).expect("built in")).expect("writable");
    }
    let mut harness = remembering(&path);
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

    let mut harness = remembering(&path);
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
    assert_eq!((now.scene, now.recent.len(), now.size), (None, 0, None));
}

/// A desktop whose dialogs a test answers.
struct Desktop(Rc<RefCell<Dialogs>>);

#[derive(Default)]
struct Dialogs {
    /// Whether there are any.
    available: bool,
    suggested: Vec<String>,
    answer: Option<Option<String>>,
    saved: Vec<SaveFile>,
}

impl Host for Desktop {
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
fn files_go_where_the_dialog_says_and_where_there_is_none_where_the_text_field_says() {
    let mut harness = window("pendulum");
    let dialogs = Rc::new(RefCell::new(Dialogs { available: true, ..Dialogs::default() }));
    harness.state_mut().set_host(Box::new(Desktop(dialogs.clone())));
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
