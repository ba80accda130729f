//! The chaos bench of the window, operated by role and label.

use std::collections::VecDeque;
use std::rc::Rc;
use std::sync::Arc;

use crate::golden::PLAIN;
use crate::hands::bench::{
    FAST, ThrottledTask, click, named_controls, set_number, sized, throttle, throttle_shared, wait,
};
use crate::hands::{compare_window, type_over};
use eframe::egui::{self, Key, accesskit::Role};
use egui_kittest::{
    Harness,
    kittest::{NodeT as _, Queryable as _},
};
use jointplay::analysis::drive::observed;
use jointplay::analysis::ready_sweeps::READY_SWEEPS;
use jointplay::analysis::task::Job;
use jointplay::app::{App, BackgroundTask, Host, Link, OpenedFile, Player, Replay, Verdict};

/// A window large enough to show the whole bench.
fn window(scene: &str, changes: &[(&str, &str)]) -> Harness<'static, App> {
    sized(scene, changes, [1400.0, 1600.0], egui::Theme::Light)
}

/// Starts a sweep of `values` values from `from` to `to`.
fn sweep(harness: &mut Harness<'_, App>, from: &str, to: &str, values: f64) {
    type_over(harness, "From", from);
    type_over(harness, "To", to);
    set_number(harness, "Values", values);
    set_number(harness, "Periods", 4.0);
    set_number(harness, "Discard", 1.0);
    click(harness, Role::Button, "Start sweep");
}

/// Number of sweep points received so far.
fn received_points(app: &App) -> usize {
    let swept = app.bench().swept();
    swept.map_or(0, |swept| swept.points.iter().flatten().count())
}

#[test]
fn a_sweep_fills_the_diagram_and_a_click_loads_the_section() {
    let mut harness = window("spcmm", &[FAST]);
    let points = throttle(&mut harness);
    sweep(&mut harness, "0.2 mm", "0.4", 3.0);
    assert!(harness.state().bench().is_sweeping());
    points.set(3);
    harness.step();
    assert!(!harness.state().bench().is_sweeping());
    assert_eq!(received_points(harness.state()), 3);
    harness.run_steps(3);
    harness.get_by_label("3 of 3 values");
    // Four periods do not determine a regime. The number comes first: "periodic 3" would mean a period of three.
    harness.get_by_label("3 unclear");

    let bench = harness.state().bench();
    let point = bench.swept().expect("swept").points[2].clone();
    let point = point.expect("received");
    assert_eq!(point.sections.len(), 3);
    let at = bench.place(2, 1).expect("drawn");
    // A click selects the nearest mark.
    let value = point.sections[1];
    harness.hover_at(at);
    harness.step();
    harness.drag_at(at);
    harness.step();
    harness.drop_at(at);
    harness.step();
    assert!(harness.state().loading().is_some(), "in progress");
    assert!(!harness.state().player().is_playing());
    harness.get_by_label_contains("Running to the chosen section…");
    wait(&mut harness, |app| app.loading().is_none());

    let player = harness.state_mut().player_mut();
    player.set_playing(false);
    let scene = player.simulation().pending();
    assert!((scene.machine.contact.clearance - 0.4e-3).abs() < 1e-15);
    // Sections at phase 0 are at T, 2 T, …; the first was discarded, and the second kept one was clicked.
    let steps = player.steps();
    let log = player.log().clone();
    let mut replayed = Player::new(scene).expect("starts");
    let link = Link {
        scene: jointplay::app::SceneText::of(scene),
        log,
        steps: Some(steps),
        hash: Some(player.simulation().state_hash()),
        ..Link::default()
    };
    let link = Link::parse(&link.format()).expect("a link");
    let replay = Replay::new(link, &mut replayed).expect("an instant");
    // The replay passes exactly the section of the sweep.
    let mut passed = false;
    let verdict = loop {
        let verdict = replay.advance(&mut replayed, {
            let mut steps = 2;
            move || {
                steps -= 1;
                steps > 0
            }
        });
        let section = observed(&replayed.frame().pose);
        passed |= replayed.simulation().time() == 0.6000000000000001 && section[..6] == value;
        if let Some(verdict) = verdict {
            break verdict;
        }
    };
    assert!(matches!(verdict, Verdict::Agrees(_)), "{verdict:?}");
    assert!(passed, "the clicked section, bit for bit");
    assert!(replayed.simulation().time() < 0.7, "the link ends beyond the clicked section");
}

#[test]
fn several_workers_share_a_sweep_and_a_bad_range_is_reported_once() {
    let mut harness = window("spcmm", &[FAST]);
    let points = throttle_shared(&mut harness, 4);
    sweep(&mut harness, "0.2 mm", "0.4", 5.0);
    points.set(2);
    harness.run_steps(3);
    harness.get_by_label("2 of 5 values");
    assert!(harness.state().bench().is_sweeping());
    let bar = harness.get_by_label("Swept so far");
    let progress = bar.accesskit_node().numeric_value().expect("a number");
    assert!((40.0..100.0).contains(&progress), "{progress}");
    points.set(3);
    harness.run_steps(3);
    harness.get_by_label("5 of 5 values");
    assert!(!harness.state().bench().is_sweeping());
    sweep(&mut harness, "0.4 mm", "0.2", 5.0);
    harness.run_steps(3);
    harness.get_by_label_contains("The range is reversed");
    assert!(!harness.state().bench().is_sweeping());
}

#[test]
fn the_diagram_comes_into_sight_when_a_sweep_starts() {
    for size in [[1280.0, 800.0], [420.0, 800.0], [844.0, 390.0]] {
        let mut harness = sized("spcmm", &[FAST], size, egui::Theme::Light);
        throttle(&mut harness);
        for (label, number) in [("Values", 3.0), ("Periods", 4.0), ("Discard", 1.0)] {
            set_number(&mut harness, label, number);
        }
        let start = harness.get_by_role_and_label(Role::Button, "Start sweep");
        start.scroll_to_me();
        harness.run_steps(60);
        // The diagram is not visible yet, and no point arrives.
        assert_eq!(harness.state().bench().diagram_seen(), 0.0);
        click(&mut harness, Role::Button, "Start sweep");
        harness.run_steps(60);
        assert!(harness.state().bench().is_sweeping());
        let seen = harness.state().bench().diagram_seen();
        assert!(seen > 0.99, "{size:?}: {seen} of it");
        // Later it stays where the user scrolls it to.
        let top = harness.get_by_role_and_label(Role::ComboBox, "Coordinate");
        top.scroll_to_me();
        harness.run_steps(60);
        let seen = harness.state().bench().diagram_seen();
        assert!(seen < 0.5, "{size:?}: {seen} of it");
    }
}

#[test]
fn a_sweep_of_another_scene_is_labelled_and_a_click_asks_before_replacing_the_current_one() {
    let mut harness = window("spcmm", &[FAST]);
    harness.get_by_label_contains("Running: spcmm, drive frequency 5 Hz");
    sweep(&mut harness, "0.2 mm", "0.4", 3.0);
    wait(&mut harness, |app| !app.bench().is_sweeping());
    harness.run_steps(3);
    harness.get_by_label_contains(
        "clearance 0.2 mm to 0.4 mm, 3 values; 4 periods of which 1 discarded, phase 0°, start as in file",
    );
    harness.get_by_label("This sweep belongs to the current scene");
    let click_point = |harness: &mut Harness<'_, App>| {
        let at = harness.state().bench().place(1, 1).expect("drawn");
        harness.hover_at(at);
        harness.step();
        harness.drag_at(at);
        harness.step();
        harness.drop_at(at);
        harness.run_steps(3);
    };
    // A change of the swept parameter does not count as another scene; any other change does.
    let player = harness.state_mut().player_mut();
    player.set("contact.clearance", "0.5 mm").expect("in range");
    harness.run_steps(2);
    harness.get_by_label("This sweep belongs to the current scene");
    let player = harness.state_mut().player_mut();
    player.set("contact.friction", "0.3").expect("in range");
    harness.run_steps(2);
    harness.get_by_label_contains("This sweep belongs to another scene. Friction coefficient: ");

    harness.state_mut().open("pendulum").expect("built in");
    harness.run_steps(3);
    harness.get_by_label("This sweep belongs to another scene. Scene: spcmm instead of pendulum");
    harness.get_by_label_contains("Running: pendulum, ");
    click_point(&mut harness);
    assert_eq!(harness.state().loading(), None);
    harness.get_by_role_and_label(Role::Dialog, "Change the running scene?");
    harness.get_by_label("Scene: spcmm instead of pendulum");
    click(&mut harness, Role::Button, "Keep this scene");
    assert_eq!(harness.state().player().running().name, "pendulum");
    click_point(&mut harness);
    click(&mut harness, Role::Button, "Change and run");
    assert!(harness.state().loading().is_some());
    assert_eq!(harness.state().player().running().name, "spcmm");
}

#[test]
fn a_running_sweep_can_be_cancelled_over_a_scene_without_a_drive() {
    let mut harness = window("spcmm", &[FAST]);
    let points = throttle(&mut harness);
    sweep(&mut harness, "0.1 mm", "0.9 mm", 5.0);
    harness.state_mut().open("pendulum").expect("built in");
    harness.run_steps(2);
    let before = harness.get_by_label("Cancel sweep").rect();
    points.set(2);
    harness.run_steps(10);
    harness.get_by_label("2 of 5 values");
    assert_eq!(harness.get_by_label("Cancel sweep").rect(), before);
    click(&mut harness, Role::Button, "Cancel sweep");
    assert!(!harness.state().bench().is_sweeping());
}

#[test]
fn a_cancelled_sweep_keeps_its_points() {
    let mut harness = window("spcmm", &[FAST]);
    let start = harness.get_by_label("Start sweep").rect();
    let points = throttle(&mut harness);
    points.set(2);
    sweep(&mut harness, "0.1 mm", "0.9 mm", 5.0);
    harness.run_steps(10);
    assert!(harness.state().bench().is_sweeping());
    harness.get_by_label("2 of 5 values");
    assert_eq!(harness.get_by_label("Cancel sweep").rect(), start);
    click(&mut harness, Role::Button, "Cancel sweep");
    assert!(!harness.state().bench().is_sweeping());
    points.set(5);
    harness.run_steps(10);
    assert_eq!(received_points(harness.state()), 2);
    harness.get_by_role_and_label(Role::Button, "Start sweep");
}

#[test]
fn a_bad_range_is_explained() {
    let mut harness = window("spcmm", &[FAST]);
    for (from, to, words) in [
        ("0.4 mm", "0.2 mm", "The range is reversed"),
        ("0.1 mm", "20 mm", "below the ball radius"),
        ("0.1 mm", "2 kg", "wrong unit"),
    ] {
        sweep(&mut harness, from, to, 3.0);
        wait(&mut harness, |app| !app.bench().is_sweeping());
        harness.run_steps(2);
        harness.get_by_label_contains(words);
        assert!(harness.query_by_label_contains("--vary").is_none());
        assert_eq!(received_points(harness.state()), 0);
    }
}

#[test]
fn the_portrait_and_the_section_fill_while_the_scene_runs() {
    let mut harness = window("spcmm", &[FAST]);
    harness.get_by_label("Poincaré section: rate of x, m/s over x, mm");
    let slider = harness.get_by_role_and_label(Role::Slider, "Drive phase");
    slider.set_value_accesskit(90.0);
    harness.run();
    assert_eq!(harness.state().player().watch().phase(), 0.25);
    harness.state_mut().player_mut().pacer.set_scale(1.0);
    click(&mut harness, Role::Button, "Play");
    wait(&mut harness, |app| app.player().watch().sections().len() >= 3);
    let player = harness.state_mut().player_mut();
    player.set_playing(false);
    assert!(player.watch().orbit().count() > 300);
    let (time, _) = player.watch().sections().next().expect("taken");
    assert!((time - 0.05).abs() < 1e-12);
    player.set("contact.friction", "0.3").expect("in range");
    assert_eq!(player.watch().sections().len(), 0);
    player.run_to(1.5);
    assert!(player.watch().sections().len() > 0);
    click(&mut harness, Role::Button, "Restart");
    assert_eq!(harness.state().player().watch().sections().len(), 0);
}

#[test]
fn a_scene_without_a_drive_explains_why_it_has_no_phase() {
    let mut harness = window("pendulum", &[]);
    harness.get_by_label_contains("No Poincaré section");
    harness.get_by_label_contains("No sweep");
    harness.get_by_label_contains("Phase portrait: ");
    harness.state_mut().player_mut().run_to(0.1);
    harness.run();
    assert!(harness.state().player().watch().orbit().count() > 20);
}

#[test]
fn a_twin_diverges_from_the_run_without_affecting_it() {
    let changes = [FAST, ("contact.friction", "0")];
    let mut harness = window("spcmm", &changes);
    click(&mut harness, Role::CheckBox, "Twin a billionth away");
    let player = harness.state_mut().player_mut();
    assert!(player.twin().is_some());
    player.run_to(0.1);
    let hash = player.simulation().state_hash();
    let twin = player.twin().expect("on");
    assert_eq!(twin.exponent(), Err((25, 0.2)), "too early to tell");
    let (first, last) = (twin.distances()[0], twin.distances().last().expect("many"));
    assert!(last[1] > 1e3 * first[1], "{first:?} {last:?}");
    harness.run();
    harness.get_by_label_contains("Exponent — 1/s, known in 5");

    click(&mut harness, Role::CheckBox, "Twin a billionth away");
    let player = harness.state_mut().player_mut();
    assert!(player.twin().is_none());
    player.reset().expect("starts");
    player.run_to(0.1);
    assert_eq!(player.simulation().state_hash(), hash, "the same bits");
}

#[test]
fn an_ideal_mechanism_has_no_twin() {
    let harness = window("spcmm", &[("contact.clearance", "0")]);
    let switch = harness.get_by_role_and_label(Role::CheckBox, "Twin a billionth away");
    assert!(switch.accesskit_node().is_disabled());
}

#[test]
fn the_bench_shows_what_is_stored() {
    let wide = [1280.0, 800.0];
    // After some periods, with a twin.
    let mut harness = sized("spcmm", &[&[FAST], &PLAIN[..]].concat(), wide, egui::Theme::Light);
    harness.state_mut().player_mut().set_twin(true);
    harness.state_mut().player_mut().run_to(0.5);
    for (name, size, theme) in [
        ("bench_wide_light", wide, egui::Theme::Light),
        ("bench_narrow", [420.0, 800.0], egui::Theme::Light),
        ("bench_lying", [844.0, 390.0], egui::Theme::Dark),
        ("bench_wide_dark", wide, egui::Theme::Dark),
    ] {
        harness.set_size(size.into());
        harness.ctx.set_theme(theme);
        harness.run();
        compare_window(&mut harness, name);
    }
    // A diverged twin in close-up. It starts after a time with friction, which erases earlier rounding errors.
    let player = harness.state_mut().player_mut();
    player.set_twin(false);
    player.set("contact.friction", "0").expect("in range");
    player.set_twin(true);
    player.run_to(0.6);
    harness.key_press(Key::Num5);
    harness.run();
    compare_window(&mut harness, "bench_ghost");

    let mut harness = window("spcmm", &[&[("spcmm.frequency", "10 Hz")], &PLAIN[..]].concat());
    harness.state_mut().player_mut().run_to(0.35);
    sweep(&mut harness, "0.05 mm", "0.8 mm", 5.0);
    wait(&mut harness, |app| !app.bench().is_sweeping());
    harness.remove_cursor();
    harness.run();
    compare_window(&mut harness, "bench_sweep");
}

#[test]
fn every_control_beside_the_bench_has_a_name_of_its_own() {
    let mut harness = window("spcmm", &[FAST]);
    harness.run();
    let controls = named_controls(&harness);
    assert!(controls > 60, "{controls}");
}

/// A host that records requested jobs and computes nothing.
struct RecordingHost(Rc<std::cell::RefCell<Vec<Job>>>);

impl Host for RecordingHost {
    fn read_dropped(&mut self, _files: Vec<Arc<dyn egui::DroppedFile + Send + Sync>>) {}

    fn opened(&mut self) -> Option<Vec<OpenedFile>> {
        None
    }

    fn start(&mut self, job: Job) -> Option<Box<dyn BackgroundTask>> {
        self.0.borrow_mut().push(job);
        Some(Box::new(ThrottledTask(VecDeque::new(), Rc::default())))
    }
}

#[test]
fn a_ready_sweep_is_described_and_one_click_opens_its_scene_and_starts_it() {
    // The pendulum has no drive, so no sweep of its own.
    let mut harness = window("pendulum", &[]);
    let jobs = Rc::new(std::cell::RefCell::new(Vec::new()));
    harness.state_mut().set_host(Box::new(RecordingHost(jobs.clone())));
    for ready in &READY_SWEEPS {
        harness.get_by_label(ready.shows);
        click(&mut harness, Role::Button, ready.name);
        harness.run_steps(2);
        let player = harness.state().player();
        assert_eq!(player.running().name, ready.scene);
        for (key, value) in ready.changes {
            let changes = &player.running().changes;
            assert!(changes.iter().any(|(k, v)| k == key && v == value), "{key}");
        }
        let mut expected = ready.task(player.pending());
        let Some(Job::Sweep(task, _)) = jobs.borrow_mut().pop() else {
            panic!("{}: no sweep", ready.name);
        };
        assert_eq!(task, expected);
        assert!(harness.state().bench().is_sweeping());
        // The click also set the controls: the same sweep can be started by hand.
        click(&mut harness, Role::Button, "Cancel sweep");
        click(&mut harness, Role::Button, "Start sweep");
        let Some(Job::Sweep(repeated, _)) = jobs.borrow_mut().pop() else {
            panic!("{}: no second sweep", ready.name);
        };
        expected.vary.clone_from(&repeated.vary);
        assert_eq!(repeated, expected);
        let range = |vary: &[String]| vary[0].replace(' ', "");
        assert_eq!(range(&repeated.vary), range(&task.vary));
        click(&mut harness, Role::Button, "Cancel sweep");
    }
}

#[test]
fn a_ready_sweep_asks_before_it_replaces_a_changed_scene() {
    let mut harness = window("pendulum", &[]);
    let jobs = Rc::new(std::cell::RefCell::new(Vec::new()));
    harness.state_mut().set_host(Box::new(RecordingHost(jobs.clone())));
    let player = harness.state_mut().player_mut();
    player.set("contact.clearance", "0.5 mm").expect("in range");
    harness.run_steps(2);
    for (answer, scene, sweeps) in [("Keep this scene", "pendulum", 0), ("Replace and sweep", READY_SWEEPS[0].scene, 1)]
    {
        click(&mut harness, Role::Button, READY_SWEEPS[0].name);
        harness.run_steps(2);
        harness.get_by_label("Clearance 0.5 mm");
        assert_eq!(harness.state().player().running().name, "pendulum");
        click(&mut harness, Role::Button, answer);
        harness.run_steps(2);
        assert_eq!(harness.state().player().running().name, scene);
        assert_eq!(jobs.borrow().len(), sweeps);
    }
}

#[test]
fn chaos_is_two_gestures_away_from_a_new_window() {
    let mut harness = sized("spcmm", &[], [1280.0, 800.0], egui::Theme::Light);
    let jobs = Rc::new(std::cell::RefCell::new(Vec::new()));
    harness.state_mut().set_host(Box::new(RecordingHost(jobs.clone())));
    let screen = egui::Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(1280.0, 800.0));
    let is_visible = |harness: &Harness<'_, App>, label: &str| {
        let node = harness.get_by_role_and_label(Role::Button, label);
        screen.contains_rect(node.rect())
    };
    // Key B has opened the bench.
    assert!(is_visible(&harness, READY_SWEEPS[0].name));
    click(&mut harness, Role::Button, READY_SWEEPS[0].name);
    harness.run_steps(60);
    assert_eq!(jobs.borrow().len(), 1);
    // The view has scrolled to the sweep's progress.
    assert!(is_visible(&harness, "Cancel sweep"));
}

/// Pixels of the 3D view.
fn view(harness: &mut Harness<'_, App>) -> Vec<[u8; 4]> {
    let view = harness.get_by_label("3D view").rect();
    let picture = harness.render().expect("drawn");
    let rows = view.top() as u32..view.bottom() as u32;
    let pixels = rows.flat_map(|y| (view.left() as u32..view.right() as u32).map(move |x| (x, y)));
    pixels.map(|(x, y)| picture.get_pixel(x, y).0).collect()
}

fn count_differing(a: &[[u8; 4]], b: &[[u8; 4]]) -> usize {
    a.iter().zip(b).filter(|(a, b)| a != b).count()
}

#[test]
fn a_map_of_the_tip_error_is_drawn_while_its_panel_is_open() {
    let mut harness = window("four-bar", &[]);
    throttle(&mut harness);
    let before_map = view(&mut harness);
    let toggle = |harness: &mut Harness<'_, App>| {
        harness.get_by_label("Tip error over the workspace").click();
        harness.run();
    };
    let rect = |harness: &Harness<'_, App>| harness.get_by_label("3D view").rect();
    let before = rect(&harness);
    toggle(&mut harness);
    assert_eq!(rect(&harness), before, "it fits into the bench");
    harness.get_by_label("No map yet");
    click(&mut harness, Role::Button, "Map tip error");
    harness.run();
    harness.get_by_label("24 points");
    let with_map = view(&mut harness);
    if let Some(keep) = std::env::var_os("KEEP_PICTURES") {
        let path = std::path::Path::new(&keep).join("map.png");
        harness.render().unwrap().save(path).unwrap();
    }
    let arrows = count_differing(&before_map, &with_map);
    assert!(arrows > 200, "{arrows}");
    harness.get_by_role_and_label(Role::Slider, "Scale of the arrows").set_value_accesskit(1.0);
    harness.run();
    let small = view(&mut harness);
    assert!(count_differing(&with_map, &small) > 20, "the arrow of the largest error is shorter");
    toggle(&mut harness);
    let closed = view(&mut harness);
    assert_eq!(count_differing(&before_map, &closed), 0);
}

#[test]
fn a_bad_axis_of_a_map_is_explained() {
    let mut harness = window("four-bar", &[]);
    throttle(&mut harness);
    harness.get_by_label("Tip error over the workspace").click();
    harness.run();
    for (over, words) in [
        ("rocker.angle=0deg..1deg:2", "driven coordinates: crank.angle"),
        ("crank.angle=2deg..1deg:2", "The range is reversed"),
        ("crank.angle=0deg..1deg:9999", "take fewer values"),
    ] {
        let field = harness.get_by_role_and_label(Role::MultilineTextInput, "Axes of the map");
        field.focus();
        harness.run();
        harness.key_press_modifiers(egui::Modifiers::COMMAND, Key::A);
        harness.run();
        harness.get_by_role_and_label(Role::MultilineTextInput, "Axes of the map").type_text(over);
        harness.run();
        click(&mut harness, Role::Button, "Map tip error");
        harness.run();
        harness.get_by_label_contains(words);
        assert!(harness.query_by_label_contains("--over crank").is_none());
    }
}
