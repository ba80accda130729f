//! The first visit, and the sentence that a scene opens with.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;

use eframe::egui::{self, Event, Key, Pos2, Rect, Shape, Theme, accesskit::Role};
use egui_kittest::{Harness, kittest::Queryable as _};
use jointplay::app::{App, AppOptions, BUILT_IN_LESSONS, Click, Host, Lesson, OpenedFile, Store};
use jointplay::scene::{DEFAULT_SCENE, Scene};

use crate::hands::{builder, page};

const LARGE: [f32; 2] = [1280.0, 800.0];
const PHONE: [f32; 2] = [390.0, 844.0];
const WAYS: [&str; 3] = ["The whole machine", "Show me why", "Choose a machine"];

/// What a visit asked of its host.
#[derive(Default)]
struct Asked {
    noted: usize,
    sound: Vec<bool>,
    clicks: usize,
}

struct VisitHost(Rc<RefCell<Asked>>);

impl Host for VisitHost {
    fn note_visit(&mut self) {
        self.0.borrow_mut().noted += 1;
    }

    fn sound(&mut self, on: bool) {
        self.0.borrow_mut().sound.push(on);
    }

    fn click(&mut self, clicks: &[Click]) {
        self.0.borrow_mut().clicks += clicks.len();
    }

    fn no_sound(&mut self) -> Option<String> {
        None
    }

    fn read_dropped(&mut self, _files: Vec<Arc<dyn egui::DroppedFile + Send + Sync>>) {}

    fn opened(&mut self) -> Option<Vec<OpenedFile>> {
        None
    }
}

fn visit_with(options: AppOptions, size: [f32; 2], theme: Theme) -> (Harness<'static, App>, Rc<RefCell<Asked>>) {
    let asked = Rc::new(RefCell::new(Asked::default()));
    let host = VisitHost(asked.clone());
    let options = AppOptions { theme: theme.into(), clock: crate::common::ticking_clock::<10>, ..options };
    let mut harness = builder(size, theme).build_eframe(move |cc| {
        let mut app = App::new(cc, options).expect("the scene starts");
        app.set_host(Box::new(host));
        app
    });
    harness.run_steps(4);
    (harness, asked)
}

fn visit(size: [f32; 2]) -> (Harness<'static, App>, Rc<RefCell<Asked>>) {
    visit_with(AppOptions::first(), size, Theme::Light)
}

fn is_visit(harness: &Harness<'_, App>) -> bool {
    let shown = WAYS.map(|way| harness.query_by_role_and_label(Role::Button, way).is_some());
    assert!(shown == [harness.state().is_first_visit(); 3], "{shown:?}");
    shown[0]
}

fn press(harness: &mut Harness<'_, App>, way: &str) {
    harness.get_by_role_and_label(Role::Button, way).click();
    harness.run_steps(3);
}

/// Centre and radius of the ball in the window, points, and the picture's area.
fn ball(harness: &Harness<'_, App>) -> (Pos2, f32, Rect) {
    let app = harness.state();
    let player = app.player();
    // As drawn, with its play exaggerated twentyfold.
    let joint = &player.frame().joints[0];
    let centre = joint.ball_centre + joint.eccentricity * 19.0;
    let up = -player.running().view.down.unit();
    let radius = player.running().machine.loose_joints[0].contact.ball_radius;
    let place = |point| app.place_in_view(&point).expect("before the camera");
    let [middle, top] = [place(centre), place(centre + up * radius)];
    (middle, middle.distance(top), harness.get_by_label("3D view").rect())
}

fn keep(harness: &mut Harness<'_, App>, name: &str) {
    if let Some(folder) = std::env::var_os("KEEP_PICTURES") {
        let file = std::path::Path::new(&folder).join(format!("{name}.png"));
        harness.render().expect("drawn").save(file).expect("writable");
    }
}

/// Areas of the texts over `area`, and of their plates.
fn texts(harness: &Harness<'_, App>, area: Rect) -> Vec<(String, Rect)> {
    fn add(shape: &Shape, out: &mut Vec<(String, Rect)>) {
        match shape {
            Shape::Vec(shapes) => shapes.iter().for_each(|shape| add(shape, out)),
            Shape::Text(text) => out.push((text.galley.text().to_owned(), text.visual_bounding_rect())),
            _ => {}
        }
    }
    let mut found = Vec::new();
    harness.output().shapes.iter().for_each(|part| add(&part.shape, &mut found));
    found.retain(|(_, place)| area.contains(place.center()));
    found
}

#[test]
fn a_first_visit_shows_one_ball_large_with_one_sentence_and_nothing_on_it() {
    for (name, size, theme) in [
        ("visit", LARGE, Theme::Light),
        ("visit_dark", LARGE, Theme::Dark),
        ("visit_phone", PHONE, Theme::Light),
        ("visit_phone_lying", [844.0, 390.0], Theme::Light),
    ] {
        let (mut harness, asked) = visit_with(AppOptions::first(), size, theme);
        assert!(is_visit(&harness), "{name}");
        assert_eq!(harness.state().player().running().name, DEFAULT_SCENE);
        assert_eq!(asked.borrow().noted, 1);
        let mut touched = 0;
        for frame in 0..240 {
            harness.step();
            let (centre, radius, area) = ball(&harness);
            assert!(2.0 * radius >= area.height().min(area.width()) / 3.0, "{name}: {radius} in {area}");
            assert!(area.shrink(radius).contains(centre), "{name}: {centre} in {area}");
            for (text, place) in texts(&harness, area) {
                assert!(place.distance_to_pos(centre) > radius, "{name}, frame {frame}: {text} lies on the ball");
            }
            let force = harness.state().player().frame().joints[0].normal_force.norm();
            if force > 0.0 && touched < 2 {
                touched += 1;
                keep(&mut harness, &format!("{name}_{touched}"));
            }
        }
        assert!(touched > 0, "{name}: no touch in four seconds");
        // The sentence is the run's own.
        harness.get_by_label("This ball is 0.3 mm too small for its socket.");
        for folded in ["Save", "Lessons", "Timeline, s", "Normal force, N", "View options", "Experiments", "Controls"] {
            assert!(harness.query_by_label(folded).is_none(), "{name}: {folded} is shown");
        }
        // Everything is in sight without scrolling.
        for way in WAYS {
            let place = harness.get_by_role_and_label(Role::Button, way).rect();
            assert!(place.bottom() <= size[1], "{name}: {way} at {place}");
        }
        let panel = Rect::from_min_size(Pos2::ZERO, size.into());
        let first = harness.get_by_role_and_label(Role::Slider, "Clearance").rect();
        let way = harness.get_by_role_and_label(Role::Button, WAYS[0]).rect();
        assert!(panel.contains_rect(first) && first.bottom() <= way.top(), "{name}: {first}");
        let picture = harness.get_by_label("3D view").rect();
        assert!(picture.height() >= 200.0, "{name}: {picture}");
        let tracks = ["Clearance", "Friction coefficient", "Restitution"]
            .map(|slider| harness.get_by_role_and_label(Role::Slider, slider).rect());
        assert!(tracks[0].top() < tracks[1].top(), "{name}: {tracks:?}");
        assert!(tracks.iter().all(|track| track.width() >= 120.0), "{name}: {tracks:?}");
    }
}

#[test]
fn a_slider_of_the_visit_changes_the_sentence_and_the_ball_and_sound_begins_with_the_gesture() {
    let (mut harness, asked) = visit(LARGE);
    harness.run_steps(60);
    assert!(asked.borrow().sound.is_empty(), "before a gesture no sound");
    let slider = harness.get_by_role_and_label(Role::Slider, "Clearance").rect();
    let at = slider.left_center() + egui::vec2(0.8 * slider.width(), 0.0);
    harness.hover_at(slider.center());
    harness.step();
    harness.drag_at(slider.center());
    harness.step();
    harness.hover_at(at);
    harness.run_steps(2);
    harness.drop_at(at);
    harness.run_steps(10);
    assert!(is_visit(&harness));
    let clearance = harness.state().player().frame().joints[0].clearance;
    assert!(clearance > 0.35e-3, "{clearance}");
    let words = jointplay::units::format_quantity(clearance, "mm");
    harness.get_by_label(&format!("This ball is {words} too small for its socket."));
    assert_eq!(asked.borrow().sound, [true]);
    for _ in 0..600 {
        harness.step();
    }
    assert!(asked.borrow().clicks > 0, "the impacts are heard");
    // What the visit has switched on ends with it.
    press(&mut harness, "The whole machine");
    assert_eq!(asked.borrow().sound, [true, false]);
}

/// Turns the sound on or off by its switch.
fn switch_sound(harness: &mut Harness<'_, App>) {
    harness.get_by_role_and_label(Role::CheckBox, "Sound").click();
    harness.run_steps(3);
}

#[test]
fn a_silent_visit_says_how_to_hear_it_and_the_switch_moves_nothing() {
    for size in [LARGE, PHONE, [1920.0, 1080.0], [1024.0, 700.0]] {
        let (mut harness, _) = visit(size);
        let places = |harness: &Harness<'_, App>| {
            let sliders = ["Clearance", "Friction coefficient", "Restitution"]
                .map(|slider| harness.get_by_role_and_label(Role::Slider, slider).rect());
            let ways = WAYS.map(|way| harness.get_by_role_and_label(Role::Button, way).rect());
            (sliders, ways)
        };
        let silent = places(&harness);
        assert!(page::label(&harness, "Turn on Sound to hear it."), "{size:?}");
        // The first gesture of a visit switches it on.
        harness.key_press(Key::F12);
        harness.run_steps(3);
        assert!(!page::label(&harness, "Turn on Sound to hear it."), "{size:?}");
        assert_eq!(places(&harness), silent, "{size:?}");
        switch_sound(&mut harness);
        assert!(page::label(&harness, "Turn on Sound to hear it."), "{size:?}");
        assert_eq!(places(&harness), silent, "{size:?}");
    }
}

#[test]
fn the_tooltips_of_the_visit_have_no_equations_and_those_of_the_window_do() {
    let told = |harness: &mut Harness<'_, App>, slider: &str| {
        let at = harness.get_by_role_and_label(Role::Slider, slider).rect().center();
        harness.hover_at(at + egui::vec2(3.0, 0.0));
        harness.run_steps(60);
        let all = Rect::from_min_size(Pos2::ZERO, LARGE.into());
        let words: Vec<String> = texts(harness, all).into_iter().map(|(text, _)| text).collect();
        harness.hover_at(Pos2::ZERO);
        harness.run_steps(10);
        words
    };
    let refers = |words: &[String]| words.iter().any(|text| text.contains("eq. ") || text.contains("eqs. "));
    let (mut harness, _) = visit(LARGE);
    for (slider, words) in [
        ("Clearance", "flies longer and strikes harder"),
        ("Friction coefficient", "holds back a ball"),
        ("Restitution", "loses no energy"),
    ] {
        let words_shown = told(&mut harness, slider);
        assert!(words_shown.iter().any(|text| text.replace('\n', " ").contains(words)), "{slider}: {words_shown:?}");
        assert!(!refers(&words_shown), "{slider}: {words_shown:?}");
    }
    press(&mut harness, "The whole machine");
    harness.key_press(Key::Space);
    harness.run_steps(90);
    let words = told(&mut harness, "Restitution");
    assert!(refers(&words), "{words:?}");
}

/// The force that the ruler says its scale has come to, N.
fn new_scale(harness: &Harness<'_, App>) -> Option<f64> {
    let all = Rect::from_min_size(Pos2::ZERO, LARGE.into());
    let words =
        texts(harness, all).into_iter().find_map(|(text, _)| Some(text.strip_prefix("New scale: ")?.to_owned()))?;
    Some(words.strip_suffix(" N").expect("in newtons").replace('\u{202f}', "").parse().expect("a number"))
}

#[test]
fn the_ruler_of_the_visit_only_grows_and_every_new_scale_is_told_for_two_seconds() {
    let (mut harness, _) = visit(LARGE);
    let mut told: Vec<(f64, usize)> = Vec::new();
    for _ in 0..1200 {
        harness.step();
        match (new_scale(&harness), told.last_mut()) {
            (Some(scale), Some((last, frames))) if *last == scale => *frames += 1,
            (Some(scale), _) => told.push((scale, 1)),
            (None, _) => {}
        }
    }
    // Twenty seconds, at the end of which the balls rest with a fiftieth of the first forces.
    assert!(!told.is_empty() && told.is_sorted_by(|a, b| a.0 < b.0), "{told:?}");
    assert!(told.iter().all(|(_, frames)| *frames <= 121), "{told:?}");
    let rests = harness.state().player().frame().joints.iter().map(|joint| joint.normal_force.norm());
    assert!(rests.fold(0.0, f64::max) < 0.1 * told[told.len() - 1].0, "a scale that follows would have fallen");
    // The whole machine's follows the forces again, and says so.
    press(&mut harness, "The whole machine");
    let mut falls = false;
    let mut last = told[told.len() - 1].0;
    for _ in 0..1200 {
        harness.step();
        if let Some(scale) = new_scale(&harness) {
            falls |= scale < last;
            last = scale;
        }
    }
    assert!(falls);
}

#[test]
fn the_three_ways_on_lead_to_the_machine_a_lesson_and_the_list_of_machines() {
    let (mut harness, _) = visit(LARGE);
    harness.run_steps(30);
    let near = harness.state().camera_pose().expect("a camera").distance;
    press(&mut harness, "The whole machine");
    assert!(!is_visit(&harness));
    harness.run_steps(90);
    let pose = harness.state().camera_pose().expect("a camera");
    assert!(pose.distance > 3.0 * near && pose.fitted.is_some(), "{pose:?}");
    for panel in ["Timeline, s", "Normal force, N", "Lessons"] {
        harness.get_by_label(panel);
    }
    assert!(harness.state().player().is_playing());
    assert_eq!(harness.state().player().pacer.scale(), 0.05);
    keep(&mut harness, "visit_whole");

    let (mut harness, _) = visit(LARGE);
    press(&mut harness, "Show me why");
    assert!(!is_visit(&harness));
    let first = Lesson::built_in(BUILT_IN_LESSONS[0].0).expect("a lesson");
    assert_eq!(harness.state().course().expect("a lesson").lesson().title, first.title);

    for size in [LARGE, PHONE] {
        let (mut harness, _) = visit(size);
        press(&mut harness, "Choose a machine");
        harness.run_steps(2);
        keep(&mut harness, &format!("visit_choose_{}", size[0]));
        harness.get_by_role_and_label(Role::Button, "Close").click();
        harness.run_steps(2);
        assert!(is_visit(&harness), "nothing chosen");
        press(&mut harness, "Choose a machine");
        press(&mut harness, "pendulum");
        assert!(!is_visit(&harness));
        assert_eq!(harness.state().player().running().name, "pendulum");
        assert!(harness.state().player().is_playing());
    }
}

#[test]
fn one_gesture_elsewhere_skips_the_visit() {
    type Gesture = fn(&mut Harness<'_, App>);
    let gestures: [(&str, Gesture); 4] = [
        ("Esc", |harness| harness.key_press(Key::Escape)),
        ("a key of the window", |harness| harness.key_press(Key::P)),
        ("a press on the ball", |harness| {
            let at = harness.get_by_label("3D view").rect().center();
            harness.drag_at(at);
            harness.drop_at(at);
        }),
        ("the wheel over the ball", |harness| {
            let at = harness.get_by_label("3D view").rect().center();
            harness.hover_at(at);
            harness.event(Event::MouseWheel {
                unit: egui::MouseWheelUnit::Point,
                delta: egui::vec2(0.0, 20.0),
                phase: egui::TouchPhase::Move,
                source: egui::MouseWheelSource::Unknown,
                modifiers: egui::Modifiers::NONE,
            });
        }),
    ];
    for (name, gesture) in gestures {
        let (mut harness, _) = visit(LARGE);
        gesture(&mut harness);
        harness.run_steps(3);
        assert!(!is_visit(&harness), "{name}");
    }
    // Pausing and the sound belong to it.
    let (mut harness, asked) = visit(LARGE);
    harness.key_press(Key::Space);
    harness.run_steps(2);
    harness.key_press(Key::M);
    harness.run_steps(2);
    assert!(is_visit(&harness) && !harness.state().player().is_playing());
    assert!(!asked.borrow().sound.is_empty());
}

#[test]
fn a_link_a_frame_a_named_scene_and_a_later_start_skip_the_visit() {
    for (link, first) in [
        ("", true),
        ("?", true),
        ("?theme=dark", true),
        ("?renderer=webgl", true),
        ("?embed", false),
        ("?embed=controls", false),
        ("?scene=measuring-machine", false),
        ("?c=0.5mm", false),
        ("?t=20ms", false),
        ("?lesson=rattle", false),
    ] {
        assert_eq!(AppOptions::from_link(link).expect("a link").visit, first, "{link}");
    }
    assert!(!AppOptions::from_link_or_default("?c=5").visit);
    assert!(!AppOptions::new(Scene::load(DEFAULT_SCENE, &[]).expect("built in")).visit);

    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("window.json");
    let store = Store::at(path.clone());
    let options = store.start_options();
    assert!(options.visit, "the first start");
    let (mut harness, _) = visit_with(options, LARGE, Theme::Light);
    let ctx = harness.ctx.clone();
    harness.state_mut().store_settings_in(&ctx, store);
    harness.run_steps(3);
    assert!(is_visit(&harness), "it is not cut short by being remembered");
    let mut store = Store::at(path);
    assert!(!store.start_options().visit, "a later start");
    assert_eq!(store.start_options().scene.name, DEFAULT_SCENE);
    // As `--fresh` does.
    store.forget();
    assert!(store.start_options().visit);
}

#[test]
fn under_reduced_motion_the_visit_stands_still_at_a_touch_and_says_so() {
    let (mut harness, _) = visit_with(AppOptions { calm: true, ..AppOptions::first() }, LARGE, Theme::Light);
    harness.run_steps(120);
    assert!(is_visit(&harness));
    let shown = |harness: &Harness<'_, App>| {
        let player = harness.state().player();
        (player.is_playing(), player.pacer.shown(), harness.state().camera_pose().expect("a camera"))
    };
    let before = shown(&harness);
    assert!(!before.0);
    assert!(harness.state().player().frame().joints[0].normal_force.norm() > 0.0, "at a touch");
    keep(&mut harness, "visit_calm");
    harness.run_steps(60);
    assert_eq!(shown(&harness), before);
    assert!(page::label(&harness, "because your system asks for reduced motion"));
    press(&mut harness, "Play");
    assert!(harness.state().player().is_playing());
    assert!(!page::label(&harness, "because your system asks for reduced motion"));
}

/// The sentence that `scene` opens with.
fn sentence(scene: &str) -> String {
    Scene::load(scene, &[]).expect("built in").watch.clone()
}

#[test]
fn every_scene_opens_with_one_sentence_that_leaves_by_itself_and_hides_no_machine() {
    for name in jointplay::scene::BUILT_IN {
        let words = sentence(name);
        assert!((40..=150).contains(&words.chars().count()), "{name}: {words}");
        assert!(!words.chars().any(|c| c.is_ascii_digit()), "{name}: a changed value would make it untrue");
    }
    let shows = |harness: &Harness<'_, App>, scene: &str| page::label(harness, &sentence(scene));
    for size in [LARGE, PHONE, [844.0, 390.0]] {
        let (mut harness, _) = page::paced(AppOptions::default_scene(), size, 0.1);
        assert!(shows(&harness, DEFAULT_SCENE), "{size:?}");
        for scene in jointplay::scene::BUILT_IN {
            harness.state_mut().open(scene).expect("built in");
            harness.run_steps(3);
            let words = harness.get_by_label(&sentence(scene)).rect();
            let above = harness.get_by_label("3D view").rect();
            let below = harness.get_by_role_and_label(Role::Slider, "Timeline, s").rect();
            assert!(words.top() >= above.bottom() - 1.0 && words.bottom() <= below.top(), "{size:?} {scene}: {words}");
        }
        harness.state_mut().open(DEFAULT_SCENE).expect("built in");
        harness.run_steps(3);
        keep(&mut harness, &format!("watch_{}", size[0]));
        harness.run_steps(150);
        assert!(!shows(&harness, DEFAULT_SCENE), "{size:?}: after 15 s");
        // Another scene has its own.
        harness.state_mut().open("press").expect("built in");
        harness.run_steps(3);
        assert!(shows(&harness, "press"));
    }
    // Changed values, an instant of a link, and a lesson say other things.
    for link in ["?c=0.5mm", "?t=5ms", "?lesson=rattle"] {
        let (harness, _) = page::open(AppOptions::from_link(link).expect("a link"), LARGE);
        assert!(!shows(&harness, DEFAULT_SCENE) && !shows(&harness, "spcmm"), "{link}");
    }
    // Under reduced motion it leaves at the first gesture, without fading.
    let calm = AppOptions { calm: true, ..AppOptions::default_scene() };
    let (mut harness, _) = page::open(calm, LARGE);
    assert!(shows(&harness, DEFAULT_SCENE));
    harness.key_press(Key::Space);
    harness.run_steps(2);
    assert!(!shows(&harness, DEFAULT_SCENE));
}

#[test]
fn in_a_narrow_picture_the_sentence_covers_the_whole_legend() {
    let (mut harness, _) = page::paced(AppOptions::default_scene(), LARGE, 1.0 / 60.0);
    harness.key_press(Key::W);
    let is_new = |harness: &Harness<'_, App>| {
        let area = harness.get_by_label("3D view").rect().expand(60.0);
        texts(harness, area).iter().any(|(text, _)| text.starts_with("New scale"))
    };
    let frames = (0..300).find(|_| {
        harness.step();
        is_new(&harness) && page::label(&harness, &sentence(DEFAULT_SCENE))
    });
    assert!(frames.is_some(), "the ruler has a new scale under the sentence");
    let (view, words) = (harness.get_by_label("3D view").rect(), harness.get_by_label(&sentence(DEFAULT_SCENE)).rect());
    let drawn = harness.render().expect("drawn");
    // Between the picture and the first line, and right of it, is only the ground.
    for y in view.bottom() as u32 + 1..words.top() as u32 {
        for x in view.right() as u32 - 150..view.right() as u32 - 1 {
            assert!(drawn.get_pixel(x, y).0[0] > 128, "dark at {x}, {y}");
        }
    }
}
