//! The lecture instrument: each task of a teacher in front of a class takes at most three gestures.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;

use eframe::egui::{self, Key, PointerButton, Pos2, accesskit::Role, vec2};
use egui_kittest::{Harness, kittest::Queryable as _};
use jointplay::analysis::task::{Job, Message};
use jointplay::app::{App, BackgroundTask, Event, Host, Link, Log, OpenedFile, Player, Replay, SceneText, Verdict};
use jointplay::simulate::{ContactMode, Quantity};

use crate::hands::page::Calls;
use crate::hands::window::{CURVES, WHITE, click, picture, shown, sized, window};
use crate::hands::{compare_window, fingers, fingers_down, give_graphics, lift, plain};

/// Rectangle of the timeline's strip.
fn strip(harness: &Harness<'_, App>) -> egui::Rect {
    let strip = harness.get_by_role_and_label(Role::Slider, "Timeline, s");
    let mut rect = strip.rect();
    // The lanes only, without the flags above them.
    rect.min.y += 9.0;
    rect
}

/// Position of an instant on the timeline when the whole run is shown.
fn place(harness: &Harness<'_, App>, time: f64) -> Pos2 {
    let rect = strip(harness);
    let share = time / harness.state().player().reached();
    let x = rect.left() + share as f32 * rect.width();
    egui::pos2(x, rect.center().y)
}

fn key(harness: &mut Harness<'_, App>, key: Key) {
    harness.key_press(key);
    harness.run();
}

/// One gesture: presses at the first position and releases at the last.
fn drag(harness: &mut Harness<'_, App>, places: &[Pos2]) {
    harness.drag_at(places[0]);
    harness.step();
    for place in &places[1..] {
        harness.hover_at(*place);
        harness.step();
    }
    harness.drop_at(places[places.len() - 1]);
    harness.step();
}

fn run_to(harness: &mut Harness<'_, App>, time: f64) {
    harness.state_mut().player_mut().run_to(time);
    harness.run();
}

#[test]
fn a_click_on_the_timeline_shows_that_instant_and_a_drag_scrubs() {
    for size in [[1280.0, 800.0], [420.0, 800.0], [844.0, 390.0]] {
        let mut harness = sized("spcmm", size, egui::Theme::Light);
        run_to(&mut harness, 40e-3);
        for time in [12e-3, 31e-3, 2e-3] {
            let at = place(&harness, time);
            drag(&mut harness, &[at]);
            harness.run();
            let pixel = 40e-3 / f64::from(strip(&harness).width());
            assert!((shown(&harness) - time).abs() <= pixel, "{size:?} {}", shown(&harness));
            assert_eq!(harness.state().player().frame().time, shown(&harness));
            assert_eq!(harness.state().player().reached(), 40e-3);
        }
        let [from, to] = [2e-3, 20e-3].map(|time| place(&harness, time));
        drag(&mut harness, &[from, from.lerp(to, 0.5), to]);
        let pixel = 40e-3 / f64::from(strip(&harness).width());
        assert!((shown(&harness) - 20e-3).abs() <= pixel);
    }
}

#[test]
fn the_lanes_have_the_colours_of_past_contact_states() {
    let mut harness = window("spcmm");
    run_to(&mut harness, 20e-3);
    let player = harness.state().player();
    let touch = player.contact_history().touches(0, 0.0, 1.0).next().expect("strikes");
    let until = player.contact_history().states(0, touch, 1.0).find(|state| state.2 == ContactMode::Free);
    let until = until.expect("the end of the contact").0;
    let rect = strip(&harness);
    let lane = rect.height() / 3.0;
    let x = |time: f64| place(&harness, time).x as usize;
    let (row, before, strikes, after) =
        ((rect.top() + 0.5 * lane) as usize, x(0.5 * touch), x(touch), x(until + 0.3e-3));
    let drawn = picture(&mut harness);
    let blue = |column: usize| {
        let area = [column - 1, row - 1, column + 2, row + 1];
        drawn.covered(area, CURVES[0], WHITE).len()
    };
    assert_eq!(blue(before), 0, "free before the first impact");
    assert!(blue(strikes) > 0, "a mark where contact begins");
    assert_eq!(blue(after), 0, "free after it");
}

#[test]
fn keys_jump_between_impacts_and_ends_and_play_backwards() {
    let mut harness = window("spcmm");
    run_to(&mut harness, 30e-3);
    key(&mut harness, Key::Home);
    assert_eq!(shown(&harness), 0.0);
    key(&mut harness, Key::Period);
    let first = shown(&harness);
    // The first impact of the paper's mechanism, at 7.8 ms.
    assert!((first - 7.8e-3).abs() < 0.1e-3, "{first}");
    key(&mut harness, Key::Period);
    assert!(shown(&harness) > first);
    key(&mut harness, Key::Comma);
    assert_eq!(shown(&harness), first);
    key(&mut harness, Key::End);
    assert_eq!(shown(&harness), 30e-3);
    harness.key_press(Key::J);
    harness.step();
    let before = shown(&harness);
    harness.run_steps(5);
    assert!(shown(&harness) < before);
    click(&mut harness, "Pause backwards");
    let still = shown(&harness);
    harness.run_steps(5);
    assert_eq!(shown(&harness), still);
    // The buttons do the same.
    click(&mut harness, "Previous impact");
    assert!(shown(&harness) < still);
    click(&mut harness, "Play backwards");
    harness.run_steps(3);
    assert!(harness.state().player().is_playing_backwards());
}

#[test]
fn resuming_from_the_past_leaves_an_abandoned_future_that_a_link_omits() {
    let mut harness = window("spcmm");
    run_to(&mut harness, 10e-3);
    harness.state_mut().player_mut().set("contact.friction", "0").expect("in range");
    run_to(&mut harness, 30e-3);
    let at = place(&harness, 5e-3);
    drag(&mut harness, &[at]);
    let player = harness.state_mut().player_mut();
    assert_eq!(player.pending().machine.contact.friction, 0.15, "as it was then");
    player.set("contact.clearance", "0.6 mm").expect("in range");
    let abandoned = player.abandoned_future().expect("an abandoned future");
    assert!((abandoned.from - 5e-3).abs() < 1e-4 && abandoned.to == 30e-3);
    assert_eq!(abandoned.flags.len(), 1);
    player.run_to(12e-3);
    harness.run();
    // The link reproduces the branch.
    let player = harness.state().player();
    check_link_reproduces(player);
    run_to(&mut harness, 31e-3);
    assert!(harness.state().player().abandoned_future().is_none(), "replaced");
}

/// Checks that a link to the current instant reproduces it to the bit.
fn check_link_reproduces(player: &Player) {
    let link = Link {
        scene: SceneText::of(player.running()),
        log: player.log(),
        steps: Some(player.steps()),
        time: Some(player.pacer.shown()),
        hash: Some(player.simulation().state_hash()),
        ..Link::default()
    };
    let link = Link::parse(&link.format()).expect("a link");
    let mut copy = Player::new(&link.load().expect("loads")).expect("starts");
    let replay = Replay::new(link, &mut copy).expect("an instant");
    let verdict = replay.advance(&mut copy, || true).expect("a verdict");
    assert_eq!(verdict, Verdict::Agrees(player.simulation().state_hash()));
}

#[test]
fn a_body_that_is_pressed_and_dragged_is_pulled_until_release() {
    let mut harness = window("spcmm");
    let image = harness.get_by_role_and_label(Role::Image, "3D view").rect();
    let platform = platform(&harness);
    let camera = camera(&harness);
    harness.drag_at(platform);
    harness.step();
    for step in 1..=4 {
        harness.hover_at(platform + vec2(15.0 * step as f32, 0.0));
        harness.step();
    }
    let player = harness.state().player();
    let pull = player.frame().pull.expect("pulls");
    assert!(pull.force.norm() > 0.1, "{pull:?}");
    assert_eq!(self::camera(&harness), camera, "the view stays");
    harness.state_mut().player_mut().set_playing(true);
    harness.run_steps(30);
    harness.state_mut().player_mut().set_playing(false);
    let player = harness.state().player();
    let ledger = player.frame().ledger.expect("kept");
    assert!(ledger.external_work.abs() > 1e-6, "{ledger:?}");
    harness.drop_at(platform + vec2(60.0, 0.0));
    harness.run();
    let player = harness.state().player();
    assert!(player.frame().pull.is_none());
    let pulls = |log: &Log| {
        let pulls = log.entries.iter().filter(|entry| matches!(entry.event, Event::Pull(_)));
        pulls.count()
    };
    assert!(pulls(&player.log()) >= 2);
    check_link_reproduces(player);
    let log = player.log();
    // Outside the machine a drag orbits the view.
    let outside = image.left_center() + vec2(30.0, 0.0);
    drag(&mut harness, &[outside, outside + vec2(40.0, 0.0)]);
    assert_ne!(self::camera(&harness), camera);
    assert_eq!(pulls(&harness.state().player().log()), pulls(&log));
}

fn camera(harness: &Harness<'_, App>) -> String {
    format!("{:?}", harness.state().camera_pose())
}

#[test]
fn plots_zoom_pan_and_seek_to_the_clicked_instant() {
    let mut harness = window("spcmm");
    run_to(&mut harness, 30e-3);
    let place = |harness: &mut Harness<'_, App>, time: f64| {
        let plots = harness.state_mut().plots_mut();
        plots.place(Quantity::NormalForce, time, 100.0).expect("shown")
    };
    let width = |harness: &mut Harness<'_, App>| {
        let [a, b] = [7.8e-3, 8.0e-3].map(|time| place(harness, time).x);
        b - a
    };
    let (before, impact) = (width(&mut harness), place(&mut harness, 7.85e-3));
    harness.hover_at(impact);
    harness.step();
    for _ in 0..3 {
        harness.event(egui::Event::MouseWheel {
            unit: egui::MouseWheelUnit::Point,
            delta: vec2(0.0, 200.0),
            phase: egui::TouchPhase::Move,
            source: egui::MouseWheelSource::Unknown,
            modifiers: egui::Modifiers::NONE,
        });
        harness.run_steps(8);
    }
    harness.run();
    assert!(width(&mut harness) > 4.0 * before, "an impact enlarged");
    assert!((place(&mut harness, 7.85e-3).x - impact.x).abs() < 2.0, "about the pointer");
    // A click seeks to that instant, and the cursor marks it.
    harness.drag_at(impact);
    harness.step();
    harness.drop_at(impact);
    harness.run_steps(40);
    assert!((shown(&harness) - 7.85e-3).abs() < 2e-5, "{}", shown(&harness));
    let now = shown(&harness);
    let line = place(&mut harness, now);
    assert!((line.x - impact.x).abs() < 2.0);
    // A drag pans the visible time window.
    drag(&mut harness, &[impact, impact + vec2(20.0, 0.0), impact + vec2(40.0, 0.0)]);
    harness.run();
    let shifted = place(&mut harness, 7.85e-3).x - impact.x;
    assert!((shifted - 40.0).abs() < 10.0, "{shifted}");
    // A double click restores the chosen window.
    for _ in 0..2 {
        harness.event(egui::Event::PointerButton {
            pos: impact,
            button: PointerButton::Primary,
            pressed: true,
            modifiers: egui::Modifiers::NONE,
        });
        harness.event(egui::Event::PointerButton {
            pos: impact,
            button: PointerButton::Primary,
            pressed: false,
            modifiers: egui::Modifiers::NONE,
        });
        harness.step();
    }
    harness.run();
    assert!((width(&mut harness) - before).abs() < 0.1 * before);
}

#[test]
fn the_past_shows_what_is_stored() {
    for (name, size, theme) in [
        ("past_light", [1280.0, 800.0], egui::Theme::Light),
        ("past_dark", [1280.0, 800.0], egui::Theme::Dark),
        ("past_phone", [390.0, 844.0], egui::Theme::Light),
    ] {
        let mut harness = plain("spcmm", &[], size, theme);
        run_to(&mut harness, 25e-3);
        harness.state_mut().player_mut().set("contact.clearance", "0.6 mm").expect("in range");
        run_to(&mut harness, 60e-3);
        let player = harness.state_mut().player_mut();
        player.go_to(15e-3);
        player.set("contact.friction", "0").expect("in range");
        player.run_to(40e-3);
        player.go_to(30e-3);
        harness.run();
        compare_window(&mut harness, name);
    }
}

#[test]
fn wear_and_a_pull_show_what_is_stored() {
    for (name, size, theme) in [
        ("wear_light", [1280.0, 800.0], egui::Theme::Light),
        ("wear_dark", [1280.0, 800.0], egui::Theme::Dark),
        ("wear_phone", [390.0, 844.0], egui::Theme::Light),
        ("wear_phone_dark", [390.0, 844.0], egui::Theme::Dark),
    ] {
        let mut harness = plain("spcmm", &[], size, theme);
        click(&mut harness, "View options");
        let choice = |harness: &Harness<'_, App>, scroll: bool| {
            let choice = harness.get_by_role_and_label(Role::RadioButton, "Wear map: Impulse");
            if scroll {
                choice.scroll_to_me();
            } else {
                choice.click();
            }
        };
        choice(&harness, true);
        harness.run();
        choice(&harness, false);
        harness.run();
        harness.key_press(Key::Escape);
        run_to(&mut harness, 60e-3);
        // A colour of the scale that nothing else in the view has.
        let area = [0, 0, size[0] as usize, (0.6 * size[1]) as usize];
        let purple = picture(&mut harness).coloured(area, [0x47, 0x2D, 0x7B], 12);
        assert!(purple.len() > 30, "{name}: no wear map");
        compare_window(&mut harness, name);
    }
    for (name, size, theme) in [
        ("pull_light", [1280.0, 800.0], egui::Theme::Light),
        ("pull_dark", [1280.0, 800.0], egui::Theme::Dark),
        ("pull_phone", [390.0, 844.0], egui::Theme::Light),
        ("pull_phone_dark", [390.0, 844.0], egui::Theme::Dark),
    ] {
        let mut harness = plain("spcmm", &[], size, theme);
        let platform = platform(&harness);
        harness.drag_at(platform);
        harness.step();
        for step in 1..=4 {
            harness.hover_at(platform + vec2(20.0 * step as f32, 0.0));
            harness.step();
        }
        compare_window(&mut harness, name);
    }
}

/// Screen position of the platform at t = 0.
pub(crate) fn platform(harness: &Harness<'_, App>) -> Pos2 {
    let app = harness.state();
    let scene = app.player().running();
    let platform = scene.machine.bodies.iter().position(|body| body.name == "platform");
    let body = &app.player().frame().bodies[platform.expect("a platform")];
    app.place_in_view(&body.position).expect("in sight")
}

/// Accepts sweeps and never reports on them.
struct SilentHost;

impl Host for SilentHost {
    fn read_dropped(&mut self, _files: Vec<Arc<dyn egui::DroppedFile + Send + Sync>>) {}

    fn opened(&mut self) -> Option<Vec<OpenedFile>> {
        None
    }

    fn start(&mut self, job: Job) -> Option<Box<dyn BackgroundTask>> {
        matches!(job, Job::Sweep(..)).then(|| Box::new(Self) as Box<dyn BackgroundTask>)
    }
}

impl BackgroundTask for SilentHost {
    fn poll(&mut self) -> Option<Message> {
        None
    }

    fn rest(&mut self, _rest: f64) {}

    fn cancel(&mut self) {}
}

/// A window with a count of the gestures used for the current task.
struct Lecture {
    harness: Harness<'static, App>,
    gestures: usize,
}

impl Lecture {
    fn new() -> Self {
        Self::on([1280.0, 800.0])
    }

    fn on(size: [f32; 2]) -> Self {
        Self { harness: sized("spcmm", size, egui::Theme::Light), gestures: 0 }
    }

    fn app(&self) -> &App {
        self.harness.state()
    }

    fn key(&mut self, pressed: Key) {
        self.gestures += 1;
        self.harness.key_press(pressed);
        self.harness.step();
    }

    fn click(&mut self, role: Role, label: &str) {
        self.gestures += 1;
        self.harness.get_by_role_and_label(role, label).click();
        self.harness.run_steps(3);
    }

    /// Drags a slider to a fraction of its track.
    fn slide(&mut self, label: &str, part: f32) {
        self.gestures += 1;
        let track = self.harness.get_by_role_and_label(Role::Slider, label);
        let track = track.rect();
        let knob = track.left_center() + vec2(track.height() / 2.0, 0.0);
        let to = track.left_center() + vec2(part * track.width(), 0.0);
        drag(&mut self.harness, &[knob, to]);
        self.harness.run_steps(2);
    }

    /// One gesture with a finger per path.
    fn fingers(&mut self, paths: &[&[Pos2]]) {
        self.gestures += 1;
        fingers(&mut self.harness, paths);
        self.harness.run_steps(3);
    }

    /// Installs a page's host and returns its recorded calls.
    fn share_with_page(&mut self) -> Rc<RefCell<Calls>> {
        let (host, calls) = Calls::host();
        self.harness.state_mut().set_host(host);
        calls
    }

    /// Scrolls a control into view.
    fn scroll_to(&mut self, role: Role, label: &str) {
        self.gestures += 1;
        let control = self.harness.get_by_role_and_label(role, label);
        control.scroll_to_me();
        self.harness.run_steps(10);
    }

    fn tap(&mut self, role: Role, label: &str) {
        let at = self.harness.get_by_role_and_label(role, label).rect();
        self.fingers(&[&[at.center()]]);
    }

    /// Swipes a slider's handle to a fraction of its track.
    fn swipe(&mut self, label: &str, part: f32) {
        let track = self.harness.get_by_role_and_label(Role::Slider, label);
        let track = track.rect();
        let to = track.left_center() + vec2(part * track.width(), 0.0);
        self.fingers(&[&[track.center(), to, to]]);
    }

    /// A tap on the ball of the first joint, in the view that the window starts with.
    fn tap_ball(&mut self) {
        let player = self.app().player();
        let ball = player.frame().joints[0].ball_centre;
        let at = self.app().place_in_view(&ball).expect("in sight");
        self.fingers(&[&[at]]);
    }

    fn frames(&mut self, count: usize) {
        self.harness.run_steps(count);
    }

    /// Checks the number of gestures and starts the next task in a new window.
    fn finish_task(&mut self, task: &str) {
        assert!(self.gestures <= 3, "{task}: {} gestures", self.gestures);
        let size = self.harness.ctx.content_rect().size();
        *self = Self::on(size.into());
    }
}

#[test]
fn tasks_of_a_lecture_take_at_most_three_gestures() {
    let mut class = Lecture::new();
    // 1: the ball rattling in its gap, enlarged and with numbers.
    class.key(Key::Num5);
    class.key(Key::L);
    class.key(Key::Space);
    class.frames(60);
    assert!(class.app().microscope().is_open());
    assert!(class.app().player().paths().between(0, 0, 0.0, 1.0).len() > 10);
    class.finish_task("the ball in its gap");

    // 2: why the first impact comes at 7.8 ms: the impact with the ball's approach speed.
    class.key(Key::Period);
    while class.app().player().is_seeking() {
        class.frames(1);
    }
    assert!((shown(&class.harness) - 7.8e-3).abs() < 0.1e-3);
    class.key(Key::Num5);
    class.key(Key::L);
    assert!(class.app().microscope().is_open());
    class.finish_task("the first impact");

    // 3: the clearance is doubled during the run.
    class.key(Key::Space);
    class.slide("Clearance", 0.62);
    let clearance = class.app().player().running().machine.contact.clearance;
    assert!((0.5e-3..0.8e-3).contains(&clearance), "{clearance}");
    assert!(class.app().player().is_playing());
    class.finish_task("clearance live");

    // 4: friction off, and on again.
    class.slide("Friction coefficient", 0.0);
    assert_eq!(class.app().player().running().machine.contact.friction, 0.0);
    class.click(Role::Button, "Reset Friction coefficient");
    assert_eq!(class.app().player().running().machine.contact.friction, 0.15);
    class.finish_task("friction off and on");

    // 5: an impact a thousand times slower, the next one, the one before.
    class.key(Key::Period);
    while class.app().player().is_seeking() {
        class.frames(1);
    }
    class.slide("Time scale", 0.25);
    let scale = class.app().player().pacer.scale();
    assert!((0.5e-3..2e-3).contains(&scale), "{scale}");
    class.key(Key::Space);
    let first = shown(&class.harness);
    class.frames(30);
    let passed = shown(&class.harness) - first;
    assert!((passed / (30.0 * scale / 60.0) - 1.0).abs() < 0.2, "{passed}");
    class.finish_task("an impact slowly");
    class.harness.state_mut().player_mut().run_to(30e-3);
    class.key(Key::Comma);
    let last = shown(&class.harness);
    class.key(Key::Comma);
    assert!(shown(&class.harness) < last && last < 30e-3);
    class.key(Key::Period);
    assert_eq!(shown(&class.harness), last);
    class.finish_task("impact before, impact after");

    // 6: the ideal machine beside the real one, with the error of the probe.
    class.key(Key::G);
    class.key(Key::Space);
    class.frames(90);
    let player = class.app().player();
    let error = player.ideal().and_then(|ideal| ideal.output_error(player.frame()));
    assert!(error.expect("reached this instant").norm() > 1e-6);
    class.finish_task("ideal beside real");

    // 7: forces against time: one impact enlarged with the wheel and a value read with the pointer.
    class.harness.state_mut().player_mut().run_to(30e-3);
    class.frames(2);
    let plots = class.harness.state_mut().plots_mut();
    let at = plots.place(Quantity::NormalForce, 7.85e-3, 100.0).expect("shown");
    class.gestures += 2;
    class.harness.hover_at(at);
    class.harness.step();
    class.harness.event(egui::Event::MouseWheel {
        unit: egui::MouseWheelUnit::Point,
        delta: vec2(0.0, 600.0),
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Unknown,
        modifiers: egui::Modifiers::NONE,
    });
    class.frames(30);
    let plots = class.harness.state_mut().plots_mut();
    let [a, b] = [7.8e-3, 7.9e-3].map(|time| plots.place(Quantity::NormalForce, time, 0.0));
    let wide = b.expect("shown").x - a.expect("shown").x;
    assert!(wide > 4.0, "{wide} points for a tenth of a millisecond");
    class.finish_task("an impact enlarged");

    // 8: a twin run a billionth apart.
    class.key(Key::B);
    class.click(Role::CheckBox, "Twin a billionth away");
    class.key(Key::Space);
    class.frames(30);
    assert!(class.app().player().twin().is_some_and(|twin| twin.distances().len() > 5));
    class.finish_task("a billionth apart");

    // 9: the onset of chaos: the bench, and a sweep over a parameter.
    class.harness.state_mut().set_host(Box::new(SilentHost));
    class.key(Key::B);
    class.scroll_to(Role::Button, "Start sweep");
    class.click(Role::Button, "Start sweep");
    assert!(class.app().bench().is_sweeping());
    class.finish_task("where chaos begins");
    // The same as a guided lesson.
    class.click(Role::Button, "Lessons");
    class.click(Role::Button, "Where chaos begins");
    class.frames(10);
    assert!(class.app().player().twin().is_some());
    class.finish_task("where chaos begins, as a lesson");

    // 10: sharing with the class: link, picture, film.
    share_with_class(&mut class, Lecture::click, None);
}

/// Shares link, picture and film with `press`, from the menu `all` or from their own menus.
fn share_with_class(class: &mut Lecture, press: impl Fn(&mut Lecture, Role, &str), all: Option<&str>) {
    let calls = class.share_with_page();
    give_graphics(&mut class.harness);
    class.harness.state_mut().player_mut().run_to(10e-3);
    if let Some(menu) = all {
        press(class, Role::Button, menu);
    }
    press(class, Role::Button, "Copy link");
    assert_eq!(calls.borrow().shared.len(), 1);
    assert!(class.gestures <= 3);
    for (entry, confirm, name) in [("Picture…", None, "png"), ("Film…", Some("Make film"), "mp4")] {
        class.gestures = 0;
        press(class, Role::Button, all.unwrap_or("Save"));
        press(class, Role::Button, entry);
        if let Some(confirm) = confirm {
            press(class, Role::Button, confirm);
        }
        assert!(class.gestures <= 3, "{name}: {}", class.gestures);
        let file = crate::hands::page::next_file(&mut class.harness, &calls);
        assert!(file.name.ends_with(name), "{}", file.name);
    }
}

#[test]
fn tasks_of_a_lecture_take_at_most_three_touch_gestures_on_a_phone() {
    let mut class = Lecture::on([390.0, 844.0]);
    // 1
    class.tap_ball();
    class.tap(Role::Button, "Play");
    class.frames(60);
    let microscope = class.app().microscope();
    assert!(microscope.is_open() && microscope.joint() == 0);
    assert!(class.app().player().paths().between(0, 0, 0.0, 1.0).len() > 10);
    class.finish_task("the ball in its gap");

    // 2
    class.tap(Role::Button, "Next impact");
    while class.app().player().is_seeking() {
        class.frames(1);
    }
    assert!((shown(&class.harness) - 7.8e-3).abs() < 0.1e-3);
    class.tap_ball();
    assert!(class.app().microscope().is_open());
    class.finish_task("the first impact");

    // 3
    class.tap(Role::Button, "Play");
    class.swipe("Clearance", 0.62);
    let clearance = class.app().player().running().machine.contact.clearance;
    assert!((0.5e-3..0.8e-3).contains(&clearance), "{clearance}");
    assert!(class.app().player().is_playing());
    class.finish_task("clearance live");

    // 4
    class.swipe("Friction coefficient", -0.1);
    assert_eq!(class.app().player().running().machine.contact.friction, 0.0);
    class.tap(Role::Button, "Reset Friction coefficient");
    assert_eq!(class.app().player().running().machine.contact.friction, 0.15);
    class.finish_task("friction off and on");

    // 5
    class.tap(Role::Button, "Next impact");
    while class.app().player().is_seeking() {
        class.frames(1);
    }
    let list = class.harness.get_by_role_and_label(Role::ComboBox, "Time scale preset");
    let at = list.rect().center();
    class.fingers(&[&[at, at - vec2(20.0, 0.0), at - vec2(45.0, 0.0)]]);
    assert_eq!(class.app().player().pacer.scale(), 1e-3);
    class.tap(Role::Button, "Play");
    let first = shown(&class.harness);
    class.frames(30);
    let passed = shown(&class.harness) - first;
    assert!((passed / (30.0 * 1e-3 / 60.0) - 1.0).abs() < 0.2, "{passed}");
    class.finish_task("an impact slowly");
    class.harness.state_mut().player_mut().run_to(30e-3);
    class.tap(Role::Button, "Previous impact");
    let last = shown(&class.harness);
    class.tap(Role::Button, "Previous impact");
    assert!(shown(&class.harness) < last && last < 30e-3);
    class.tap(Role::Button, "Next impact");
    assert_eq!(shown(&class.harness), last);
    class.finish_task("impact before, impact after");

    // 6
    class.tap(Role::Button, "View options");
    class.tap(Role::CheckBox, "Ideal ghost");
    class.tap(Role::Button, "Play");
    class.frames(90);
    let player = class.app().player();
    assert!(player.is_playing());
    let error = player.ideal().and_then(|ideal| ideal.output_error(player.frame()));
    assert!(error.expect("reached this instant").norm() > 1e-6);
    class.finish_task("ideal beside real");

    // 7
    class.harness.state_mut().player_mut().run_to(30e-3);
    class.harness.state_mut().plots_mut().chosen = vec![Quantity::NormalForce, Quantity::Eccentricity];
    class.tap(Role::Button, "Plots");
    let width = |class: &mut Lecture| {
        let plots = class.harness.state_mut().plots_mut();
        let [a, b] = [7.8e-3, 7.9e-3].map(|time| plots.place(Quantity::NormalForce, time, 100.0));
        (b.expect("shown").x - a.expect("shown").x, a.expect("shown"))
    };
    let (before, at) = width(&mut class);
    let apart = |by: f32| [at - vec2(by, 0.0), at + vec2(by, 0.0)];
    let [one, two] = [0, 1].map(|finger| [7.0, 15.0, 30.0, 60.0].map(|by| apart(by)[finger]));
    class.fingers(&[&one, &two]);
    let (after, moved) = width(&mut class);
    assert!(after > 5.0 * before, "{before} {after}");
    assert!((moved.x - at.x).abs() < 10.0, "{at} {moved}");
    class.fingers(&[&[moved]]);
    assert!((shown(&class.harness) - 7.8e-3).abs() < 0.1e-3);
    class.finish_task("an impact enlarged");

    // 8
    class.tap(Role::Button, "Experiments");
    class.tap(Role::CheckBox, "Twin a billionth away");
    class.tap(Role::Button, "Play");
    class.frames(30);
    let twin = class.app().player().twin();
    assert!(twin.is_some_and(|twin| twin.distances().len() > 5));
    class.finish_task("a billionth apart");

    // 9
    class.tap(Role::Button, "Lessons");
    class.frames(20);
    // Swiped up: it is the last but one.
    let at = class.harness.get_by_label("Start here").rect().center();
    class.fingers(&[&[at + vec2(0.0, 500.0), at + vec2(0.0, 200.0), at]]);
    class.frames(30);
    class.tap(Role::Button, "Where chaos begins");
    class.frames(10);
    assert!(class.app().player().twin().is_some());
    class.finish_task("where chaos begins");

    // 10
    share_with_class(&mut class, Lecture::tap, Some("Menu"));
}

#[test]
fn a_long_press_on_a_body_pulls_it() {
    for size in [[1280.0, 800.0], [390.0, 844.0]] {
        let mut harness = sized("spcmm", size, egui::Theme::Light);
        let (at, camera) = (platform(&harness), camera(&harness));
        // A resting finger trembles.
        let rests = (0..60).map(|k| at + vec2((k % 2) as f32, 0.0));
        let moves = (1..5).map(|k| at + vec2(10.0 * k as f32, 0.0));
        let path: Vec<Pos2> = rests.chain(moves).collect();
        fingers_down(&mut harness, &[&path]);
        let pull = harness.state().player().frame().pull.expect("pulls");
        assert!(pull.force.norm() > 1.0, "{size:?}: {pull:?}");
        lift(&mut harness, &[&path]);
        assert!(harness.state().player().frame().pull.is_none(), "{size:?}");
        assert_eq!(self::camera(&harness), camera, "{size:?}: the view stays");
    }
}

#[test]
fn going_back_to_just_after_an_impact_shows_its_peak_again() {
    let mut harness = sized("spcmm", [1280.0, 800.0], egui::Theme::Light);
    let marks = |harness: &Harness<'_, App>| harness.state().peak_marks();
    run_to(&mut harness, 40e-3);
    harness.run();
    // The peak of the first impacts, 60 to 80 us after first contact.
    harness.state_mut().player_mut().pacer.set_scale(1e-3);
    harness.state_mut().show_instant(8.2e-3);
    harness.run_steps(3);
    let first = marks(&harness);
    assert_eq!(first.len(), 3, "{first:?}");
    assert!(first.iter().all(|(_, force, age)| *force > 100.0 && (0.1e-3..0.5e-3).contains(age)), "{first:?}");
    // A step back keeps them; before the impact there are none.
    key(&mut harness, Key::ArrowLeft);
    assert_eq!(marks(&harness).len(), 3);
    harness.state_mut().show_instant(7.5e-3);
    harness.run_steps(3);
    assert!(marks(&harness).is_empty());
}
