//! Features that the web page needs and the desktop shares: links, files, touch, small screens, announcements for screen readers.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::hands::page::{Calls, click, decoded, label, next_file, open, verdict, window};
use crate::hands::{compare_window, give_graphics, plain, type_over};
use eframe::egui::{
    self, Event, Key, Modifiers, PointerButton, Pos2, TouchDeviceId, TouchId, TouchPhase,
    accesskit::{Action, Live, Role},
    pos2, vec2,
};
use egui_kittest::{
    Harness,
    kittest::{NodeT as _, Queryable as _},
};
use jointplay::app::{App, AppOptions, CameraPose, DesktopHost, Link, OpenedFile, PlotWindow, Verdict};
use jointplay::machine::Drive;
use jointplay::scene::{DEFAULT_SCENE, Scene, Value};
use jointplay::simulate::{Channels, Frame, Quantity, Simulation, channels_of, chosen_channels};

/// A file dropped with the mouse.
#[derive(Debug)]
struct Dropped(PathBuf, &'static [u8]);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        Ok(self.1.to_vec())
    }
}

const LARGE: [f32; 2] = [1280.0, 800.0];
const PORTRAIT: [f32; 2] = [390.0, 844.0];
const LANDSCAPE: [f32; 2] = [844.0, 390.0];
/// A small, ten-year-old phone, or a laptop zoomed to 400 %.
const TINY: [f32; 2] = [320.0, 480.0];

fn hash(harness: &Harness<'_, App>) -> u64 {
    harness.state().player().simulation().state_hash()
}

#[test]
fn a_copied_link_opens_the_same_state_with_the_same_bits() {
    let (mut harness, calls) = window("spcmm", LARGE);
    click(&mut harness, "Play");
    harness.run_steps(30);
    harness.get_by_role_and_label(Role::Slider, "Clearance").set_value_accesskit(0.55);
    harness.run_steps(30);
    harness.get_by_role_and_label(Role::Slider, "Friction coefficient").set_value_accesskit(0.4);
    harness.run_steps(20);
    click(&mut harness, "Pause");
    click(&mut harness, "Step");
    harness.key_press(Key::Num2);
    harness.run();
    click(&mut harness, "Copy link");
    assert!(harness.state().announcement().starts_with("Link copied."));
    let link = calls.borrow().shared.last().expect("shared").clone();
    assert!(link.starts_with("https://example.org/lab/#scene=spcmm&"), "{link}");
    assert!(link.len() < 600, "{} characters", link.len());

    let options = AppOptions::from_link(&link).expect("a link");
    assert_eq!(options.scene.machine.contact.clearance, 0.3e-3, "the change is in the log");
    let (mut copy, _) = open(options, LARGE);
    assert_eq!(verdict(&mut copy), Verdict::Agrees(hash(&harness)));
    copy.run();
    assert_eq!(hash(&copy), hash(&harness));
    let (mine, theirs) = (harness.state().player(), copy.state().player());
    assert_eq!(mine.pacer.shown().to_bits(), theirs.pacer.shown().to_bits());
    assert_eq!(theirs.running().machine.contact.friction, 0.4);
    assert!(!theirs.is_playing());
    let words = format!("State reproduced: hash {:016x} agrees", hash(&harness));
    assert!(label(&copy, &words));
    assert!(copy.state().announcement().starts_with(&words));
    // It continues with the same bits, and its own link is the same.
    assert_eq!(copy.state().share_state(), harness.state().share_state());
    for harness in [&mut harness, &mut copy] {
        harness.state_mut().player_mut().run_to(0.1);
    }
    assert_eq!(hash(&copy), hash(&harness));
    click(&mut copy, "Dismiss");
    assert!(!label(&copy, &words));

    let wrong = link.replace("hash=", "hash=0000000000000000&was=").replace("&was=", "&utm_was=");
    let (mut copy, _) = open(AppOptions::from_link(&wrong).expect("a link"), LARGE);
    assert!(matches!(verdict(&mut copy), Verdict::Differs { expected: 0, .. }));
    copy.run();
    assert!(label(&copy, "State differs: hash"));
}

#[test]
fn a_long_replay_shows_its_progress_and_can_be_stopped() {
    let link = "?scene=pendulum&method=rk4&solver.step=1us&t=100s";
    let options = AppOptions::from_link(link).expect("a link");
    let (mut harness, _) = open(options, LARGE);
    let before = harness.state().replaying().expect("in progress");
    harness.get_by_label_contains("Reproducing the state of the link… 0 %");
    harness.run_steps(3);
    let after = harness.state().replaying().expect("still in progress");
    assert!(after > before, "{before} {after}");
    // During the replay nothing else may move the machine.
    harness.key_press(Key::Space);
    harness.key_press(Key::R);
    harness.step();
    assert!(harness.state().replaying().is_some_and(|now| now > before));
    assert!(harness.state().share_state().contains("t=100s"));
    click(&mut harness, "Stop here");
    assert!(harness.state().replaying().is_none());
    assert!(matches!(harness.state().verdict(), Some(Verdict::Failed(_))));
    assert!(harness.state().player().simulation().time() > 0.0);
    click(&mut harness, "Step");
    harness.key_press(Key::R);
    harness.run();
    assert_eq!(harness.state().player().simulation().time(), 0.0);
}

#[test]
fn a_bad_link_is_explained_over_the_paused_default_scene() {
    for (link, words) in [
        ("?scene=pendulun&embed=controls", "did you mean `pendulum`?"),
        ("?t=2000000s", "allowed 0 to 1000000 s"),
        ("?lesson=rattle&step=99", "allowed 1 to"),
        ("?scene=pendulun", "did you mean `pendulum`?"),
        ("?c=5", "contact.clearance = 5: needs a unit"),
        ("?scene=spcmm&spcmm.amplitude_x=500mm", "amplitude_x"),
        ("#scene=pendulum&log=AAAA", "cut short or damaged"),
        ("?speed=3", "unknown word"),
        ("?follow=joint.S9", "no such part; allowed: joint.S1,"),
        ("?show=microscope.S9", "no such joint with play; allowed: S1,"),
    ] {
        assert!(AppOptions::from_link(link).is_err(), "{link}");
        let (mut harness, _) = open(AppOptions::from_link_or_default(link), LARGE);
        assert!(label(&harness, "link: "));
        assert!(harness.state().announcement().contains(words), "{link}: {}", harness.state().announcement());
        let player = harness.state().player();
        assert_eq!(player.running().name, DEFAULT_SCENE);
        assert!(!player.is_playing() && harness.state().is_refused());
        assert_eq!(
            harness.state().embedded().map(|panels| panels.write()),
            link.contains("embed").then(|| "controls".to_owned())
        );
        let ctx = harness.ctx.clone();
        assert!(harness.state_mut().open_link(&ctx, "?c=2").is_err());
        assert!(harness.state().is_refused());
        harness.state_mut().open_link(&ctx, "?scene=pendulum").expect("opens");
        assert!(!harness.state().is_refused());
    }
    let options = AppOptions::from_link_or_default("?scene=pendulum&c=0.5mm&scale=1:10");
    assert_eq!((options.problem, options.playing, options.time_scale), (None, true, 0.1));
    assert_eq!(options.scene.machine.contact.clearance, 0.5e-3);
}

#[test]
fn reduced_motion_and_high_contrast_are_respected() {
    let link = "?scene=slider-crank&t=20ms&play=1";
    let options = AppOptions { calm: true, contrast: true, ..AppOptions::from_link(link).expect("opens") };
    let (mut harness, _) = open(options, LARGE);
    for _ in 0..60 {
        harness.step();
    }
    let player = harness.state().player();
    assert_eq!((player.is_playing(), player.pacer.shown()), (false, 0.02));
    for theme in [egui::Theme::Light, egui::Theme::Dark] {
        let visuals = harness.ctx.style_of(theme).visuals.clone();
        let [ink, ground] = [visuals.weak_text_color(), visuals.panel_fill].map(|colour| colour.r().abs_diff(0));
        assert_eq!(ink.abs_diff(ground), 255, "{theme:?}");
    }
    harness.get_by_role_and_label(Role::Button, "View options").click();
    harness.run_steps(3);
    let flash = harness.get_by_role_and_label(Role::CheckBox, "Flash joints on impact");
    assert_eq!(flash.accesskit_node().toggled(), Some(egui::accesskit::Toggled::False));
}

fn touch(harness: &Harness<'_, App>, id: u64, phase: TouchPhase, pos: Pos2) {
    harness.event(Event::Touch { device_id: TouchDeviceId(0), id: TouchId(id), phase, pos, force: None });
    // The first finger is the pointer, too.
    if id == 1 {
        let button = |pressed| Event::PointerButton {
            pos,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::default(),
        };
        match phase {
            TouchPhase::Start => {
                harness.event(Event::PointerMoved(pos));
                harness.event(button(true));
            }
            TouchPhase::Move => harness.event(Event::PointerMoved(pos)),
            TouchPhase::End | TouchPhase::Cancel => {
                harness.event(button(false));
                harness.event(Event::PointerGone);
            }
        }
    }
}

fn camera(harness: &Harness<'_, App>) -> Option<CameraPose> {
    let link = Link::parse(&harness.state().share_state()).expect("a link");
    link.camera
}

#[test]
fn one_finger_orbits_and_two_pan_and_zoom() {
    let (mut harness, _) = window("spcmm", PORTRAIT);
    let opened = camera(&harness).expect("a link carries the camera");
    assert!(opened.fitted.is_some(), "as the scene opens");
    let middle = harness.get_by_label("3D view").rect().center();
    touch(&harness, 1, TouchPhase::Start, middle);
    harness.step();
    for step in 1..=5 {
        let pos = middle + vec2(12.0 * step as f32, 0.0);
        touch(&harness, 1, TouchPhase::Move, pos);
        harness.step();
    }
    touch(&harness, 1, TouchPhase::End, middle + vec2(60.0, 0.0));
    harness.run_steps(3);
    let rotated = camera(&harness).expect("a camera");
    touch(&harness, 1, TouchPhase::Start, middle);
    harness.step();
    touch(&harness, 1, TouchPhase::Move, middle + vec2(30.0, 0.0));
    harness.step();
    touch(&harness, 1, TouchPhase::Move, middle + vec2(60.0, 0.0));
    harness.step();
    touch(&harness, 1, TouchPhase::End, middle + vec2(60.0, 0.0));
    harness.run_steps(3);
    let second = camera(&harness).expect("a camera");
    assert!((second.yaw - rotated.yaw).abs() > 0.1, "{rotated:?} {second:?}");
    assert_eq!(second.target, rotated.target);
    assert_eq!(second.distance, rotated.distance);

    // Both fingers move in parallel: a pan.
    let fingers = |harness: &Harness<'_, App>, phase, spread: f32, shift: f32| {
        touch(harness, 1, phase, middle + vec2(shift - spread, 0.0));
        touch(harness, 2, phase, middle + vec2(shift + spread, 0.0));
    };
    fingers(&harness, TouchPhase::Start, 40.0, 0.0);
    harness.step();
    for step in 1..=4 {
        fingers(&harness, TouchPhase::Move, 40.0, 10.0 * step as f32);
        harness.step();
    }
    let shifted = camera(&harness).expect("shifted");
    assert_eq!((shifted.yaw, shifted.pitch), (second.yaw, second.pitch));
    assert_ne!(shifted.target, second.target);
    // Then apart: a zoom in.
    for step in 1..=4 {
        fingers(&harness, TouchPhase::Move, 40.0 + 10.0 * step as f32, 40.0);
        harness.step();
    }
    let nearer = camera(&harness).expect("nearer");
    assert!(nearer.distance < 0.8 * shifted.distance, "{shifted:?} {nearer:?}");
    assert_eq!((nearer.yaw, nearer.pitch), (second.yaw, second.pitch));
    // The finger left on the screen does not orbit.
    touch(&harness, 2, TouchPhase::End, middle + vec2(120.0, 0.0));
    harness.step();
    touch(&harness, 1, TouchPhase::Move, middle + vec2(-90.0, 30.0));
    harness.step();
    touch(&harness, 1, TouchPhase::End, middle + vec2(-90.0, 30.0));
    harness.run_steps(3);
    let after = camera(&harness).expect("a camera");
    assert_eq!((after.yaw, after.pitch), (second.yaw, second.pitch));
}

#[test]
fn a_double_tap_follows_what_it_hits() {
    let (mut harness, _) = window("spcmm", LARGE);
    // The first touch makes the controls larger and the picture a little smaller.
    let background = harness.get_by_label("3D view").rect().left_bottom() + vec2(200.0, -40.0);
    touch(&harness, 1, TouchPhase::Start, background);
    harness.step();
    touch(&harness, 1, TouchPhase::End, background);
    harness.run_steps(60);
    harness.key_press(Key::F);
    harness.run();
    // The middle of the platform, in the isometric view that the window starts with.
    let platform = crate::lecture::platform(&harness);
    harness.hover_at(platform);
    harness.run_steps(60);
    harness.get_by_label_contains("Angular speed");
    harness.remove_cursor();
    harness.run();
    // A finger is less precise than a mouse: the second tap lands slightly beside the first.
    for beside in [0.0, 7.0] {
        touch(&harness, 1, TouchPhase::Start, platform + vec2(beside, 0.0));
        harness.step();
        touch(&harness, 1, TouchPhase::End, platform + vec2(beside, 0.0));
        harness.step();
    }
    harness.run_steps(3);
    // The link carries the followed body and the camera.
    harness.state_mut().plots_mut().chosen = vec![Quantity::NormalForce, Quantity::Eccentricity, Quantity::Energy];
    harness.state_mut().plots_mut().window = PlotWindow::Last(0.01);
    harness.state_mut().microscope_mut().set_open(true);
    harness.state_mut().microscope_mut().focus(1);
    harness.state_mut().player_mut().set_ideal(true);
    harness.state_mut().player_mut().run_to(5e-3);
    harness.run_steps(3);
    let link = harness.state().share_state();
    let (mut copy, _) = open(AppOptions::from_link(&link).expect("a link"), LARGE);
    assert_eq!(verdict(&mut copy), Verdict::Agrees(hash(&harness)));
    copy.run_steps(3);
    assert_eq!(copy.state().share_state(), link);
    copy.get_by_label_contains("Energy, mJ");
    for mut harness in [harness, copy] {
        click(&mut harness, "View options");
        harness.get_by_label("Stop following");
    }
    assert!(
        link.contains("&follow=body.platform&")
            && link.contains("&plots=normal-force+eccentricity+energy&window=0.01s&")
            && link.contains("&show=microscope.S2+ideal&"),
        "{link}"
    );
}

#[test]
fn small_screens_have_touch_sized_controls_and_a_folding_sheet() {
    for size in [PORTRAIT, LANDSCAPE] {
        let (mut harness, _) = window("spcmm", size);
        harness.run();
        let view = harness.get_by_label("3D view").rect();
        assert!(view.width() > 240.0 && view.height() > 140.0, "{size:?}: {view:?}");
        let mut seen = 0;
        for name in ["Restart", "Play", "Step", "Menu", "View options", "Controls", "Plots"] {
            let rect = harness.get_by_role_and_label(Role::Button, name).rect();
            assert!(rect.size().min_elem() >= 43.5, "{size:?} {name}: {rect:?}");
            assert!(rect.right() <= size[0] && rect.bottom() <= size[1], "{name}: {rect:?}");
            seen += 1;
        }
        for (role, name) in [
            (Role::ComboBox, "Scene"),
            (Role::ComboBox, "Time scale preset"),
            (Role::Slider, "Clearance"),
            (Role::TextInput, "Clearance"),
        ] {
            let rect = harness.get_by_role_and_label(role, name).rect();
            assert!(rect.size().min_elem() >= 43.5, "{size:?} {name}: {rect:?}");
            assert!(rect.right() <= size[0], "{size:?} {name}: {rect:?}");
            seen += 1;
        }
        assert_eq!(seen, 11);
        // No two touch targets overlap.
        let rects: Vec<egui::Rect> = ["Restart", "Play", "Step", "Controls", "Plots"]
            .map(|name| harness.get_by_role_and_label(Role::Button, name).rect())
            .into();
        for (i, a) in rects.iter().enumerate() {
            for b in &rects[i + 1..] {
                assert!(!a.shrink(1.0).intersects(b.shrink(1.0)), "{size:?}: {a:?} {b:?}");
            }
        }

        click(&mut harness, "Controls");
        harness.run();
        let wide = harness.get_by_label("3D view").rect();
        assert!(wide.area() > 1.3 * view.area(), "{size:?}: {view:?} {wide:?}");
        assert!(harness.query_by_role_and_label(Role::Slider, "Clearance").is_none());
        harness.key_press(Key::P);
        harness.run();
        harness.get_by_label("Choose plots");
        click(&mut harness, "Menu");
        for name in ["Open…", "Copy link", "Picture…", "Data (CSV)…", "Scene…", "Keyboard shortcuts", "About"] {
            harness.get_by_label(name);
        }
    }
}

#[test]
fn dialogs_and_menus_stay_on_a_small_screen() {
    let outside = |harness: &Harness<'_, App>, role: Role, size: [f32; 2]| -> Vec<String> {
        let across = 0.0..=size[0];
        harness
            .query_all_by_role(role)
            .filter(|node| {
                let rect = node.rect();
                !(across.contains(&rect.left()) && across.contains(&rect.right()))
            })
            .map(|node| format!("{:?} {:?}", node.accesskit_node().label(), node.rect()))
            .collect()
    };
    for size in [PORTRAIT, LANDSCAPE, TINY] {
        let (mut harness, _) = window("spcmm", size);
        harness.run();
        let step = harness.get_by_role_and_label(Role::Button, "Step").rect();
        let scale = harness.get_by_role_and_label(Role::ComboBox, "Time scale preset");
        let scale = scale.rect();
        assert!(scale.left() >= step.right() && scale.right() <= size[0], "{size:?}: {scale:?}");
        harness.key_press(Key::Questionmark);
        harness.run();
        let words = harness.get_by_label("Turn the view").rect();
        assert!(words.width() > 20.0 && words.left() > 0.0, "{words:?}");
        let none: [String; 0] = [];
        assert_eq!(outside(&harness, Role::Label, size), none, "{size:?}");
        let close = harness.get_by_role_and_label(Role::Button, "Close").rect();
        assert!(close.bottom() <= size[1], "{size:?}: {close:?}");
        harness.key_press(Key::Escape);
        harness.run();

        // The wheel scrolls to entries below the visible part of a menu.
        click(&mut harness, "Menu");
        harness.run();
        let first = harness.get_by_label("Open…").rect();
        assert!(first.top() >= 0.0 && first.right() <= size[0], "{first:?}");
        harness.hover_at(harness.get_by_label("Picture…").rect().center());
        for _ in 0..4 {
            harness.event(Event::MouseWheel {
                unit: egui::MouseWheelUnit::Line,
                source: egui::MouseWheelSource::Wheel,
                delta: vec2(0.0, -10.0),
                phase: TouchPhase::Move,
                modifiers: Modifiers::NONE,
            });
            harness.run_steps(20);
        }
        let about = harness.get_by_label("About").rect();
        assert!(about.bottom() <= size[1], "{size:?}: {about:?}");
        click(&mut harness, "About");
        harness.get_by_label(&format!("{:016x}", hash(&harness)));
        assert_eq!(outside(&harness, Role::Label, size), none, "{size:?}");
    }
}

#[test]
fn a_hovered_file_is_highlighted_and_a_large_one_is_refused() {
    let (mut harness, calls) = window("pendulum", LARGE);
    let picture = harness.render().expect("a picture");
    harness.input_mut().hovered_files.push(egui::HoveredFile::default());
    harness.step();
    assert_ne!(harness.render().expect("a picture"), picture);
    let before = hash(&harness);
    calls
        .borrow_mut()
        .to_open
        .push_back(vec![OpenedFile { name: "film.mp4".to_owned(), content: Err(jointplay::scene::too_large()) }]);
    harness.step();
    harness.run_steps(3);
    assert!(label(&harness, "film.mp4: too large for a scene file"));
    assert_eq!(hash(&harness), before);
}

#[test]
fn a_link_in_an_open_window_brings_its_theme() {
    let (mut harness, _) = window("spcmm", LARGE);
    let ctx = harness.ctx.clone();
    for (link, theme) in [
        ("#scene=pendulum&theme=dark", egui::Theme::Dark),
        // Without a theme, the current one stays.
        ("#scene=pendulum", egui::Theme::Dark),
        ("#scene=pendulum&theme=light", egui::Theme::Light),
    ] {
        harness.state_mut().open_link(&ctx, link).expect("a link");
        harness.run_steps(3);
        assert_eq!(ctx.theme(), theme, "{link}");
    }
}

#[test]
fn touch_enlarges_the_controls_of_a_large_window() {
    let (mut harness, _) = window("spcmm", LARGE);
    let height = |harness: &Harness<'_, App>| harness.get_by_label("Open").rect().height();
    assert!(height(&harness) < 30.0);
    touch(&harness, 1, TouchPhase::Start, pos2(700.0, 300.0));
    harness.step();
    touch(&harness, 1, TouchPhase::End, pos2(700.0, 300.0));
    harness.run_steps(3);
    assert!(height(&harness) >= 43.5);
}

#[test]
fn scene_record_and_picture_are_saved() {
    let (mut harness, calls) = window("spcmm", LARGE);
    give_graphics(&mut harness);
    let player = harness.state_mut().player_mut();
    player.set("contact.clearance", "0.45 mm").expect("in range");
    player.run_to(12e-3);
    harness.run();
    click(&mut harness, "Save");
    click(&mut harness, "Scene…");
    let saved = calls.borrow_mut().saved.remove(0);
    assert_eq!((saved.name.as_str(), saved.mime), ("spcmm.toml", "application/toml"));
    let text = String::from_utf8(saved.bytes).expect("text");
    let scene = Scene::parse(&text, Some("spcmm.toml"), &[]).expect("a scene");
    assert_eq!(scene.machine.contact.clearance, 0.45e-3);
    let changes = [("contact.clearance".to_owned(), "0.45 mm".to_owned())];
    let hashes = [scene, Scene::load("spcmm", &changes).expect("in range")].map(|scene| {
        let mut simulation = Simulation::new(&scene.machine).expect("starts");
        simulation.advance_to(20e-3).expect("runs");
        simulation.state_hash()
    });
    assert_eq!(hashes[0], hashes[1], "the same scene");

    click(&mut harness, "Save");
    click(&mut harness, "Data (CSV)…");
    let record = calls.borrow_mut().saved.remove(0);
    assert_eq!((record.name.as_str(), record.mime), ("spcmm-12.000ms.csv", "text/csv"));
    let text = String::from_utf8(record.bytes).expect("text");
    assert!(text.starts_with("t_s,S1_normal_N_min,S1_normal_N_max,"), "{text:.80}");
    let meta = calls.borrow_mut().saved.remove(0);
    assert_eq!(meta.name, "spcmm-12.000ms.csv.meta.json");

    click(&mut harness, "Save");
    click(&mut harness, "Picture…");
    let picture = next_file(&mut harness, &calls);
    assert_eq!((picture.name.as_str(), picture.mime), ("spcmm-12.000ms.png", "image/png"));
    let (info, rgba) = decoded(&picture);
    let view = harness.get_by_label("3D view").rect();
    // The strips of text above and below belong to it.
    assert_eq!(info.width, view.width().round() as u32);
    assert!((40..=120).contains(&(info.height - view.height().round() as u32)), "{}", info.height);
    let texts = &info.uncompressed_latin1_text;
    assert!(texts.iter().any(|t| t.text.contains("contact.clearance = 0.45 mm")));
    let pixels: std::collections::HashSet<&[u8]> = rgba.chunks_exact(4).collect();
    assert!(pixels.len() > 500, "an empty picture has few colours: {}", pixels.len());
    // The saved picture shows the background where the screen shows a button.
    let button = harness.get_by_role_and_label(Role::Button, "View options").rect();
    // The strip is 4 points higher than the button.
    let corner = pos2(view.left(), button.top() - 2.0);
    let at = (button.left_top() + vec2(6.0, 10.0)) - corner;
    let pixel = |x: f32, y: f32| {
        let i = 4 * (y as usize * info.width as usize + x as usize);
        [0, 1, 2].map(|c| i32::from(rgba[i + c]))
    };
    let (under, beside) = (pixel(at.x, at.y), pixel(at.x - 16.0, at.y));
    let difference = (0..3).map(|c| (under[c] - beside[c]).abs()).max();
    assert!(difference < Some(6), "{under:?} {beside:?}");
}

/// Mean colour difference, 0 to 255, between a picture and one of the same view at `times` the size, averaged down.
fn mean_difference(small: &(png::Info<'_>, Vec<u8>), large: &(png::Info<'_>, Vec<u8>), times: usize) -> f64 {
    let (width, height) = (small.0.width as usize, small.0.height as usize);
    assert_eq!((large.0.width as usize, large.0.height as usize), (times * width, times * height));
    let mut sum = 0.0;
    for (y, x, c) in (0..height).flat_map(|y| (0..width).flat_map(move |x| (0..3).map(move |c| (y, x, c)))) {
        let block = (0..times * times).map(|k| {
            let (row, column) = (times * y + k / times, times * x + k % times);
            f64::from(large.1[4 * (row * times * width + column) + c])
        });
        let mean = block.sum::<f64>() / (times * times) as f64;
        sum += (mean - f64::from(small.1[4 * (y * width + x) + c])).abs();
    }
    sum / (3 * width * height) as f64
}

/// Length in pixels of the force scale in the lower right corner: the longest dark horizontal line.
fn ruler_length((info, rgba): &(png::Info<'_>, Vec<u8>)) -> usize {
    let (width, height) = (info.width as usize, info.height as usize);
    let dark = |x: usize, y: usize| {
        let at = 4 * (y * width + x);
        rgba[at..at + 3].iter().all(|colour| *colour < 110)
    };
    let longest = |y: usize| {
        let (mut run, mut longest) = (0, 0);
        for x in 7 * width / 10..width {
            run = if dark(x, y) { run + 1 } else { 0 };
            longest = longest.max(run);
        }
        longest
    };
    (7 * height / 10..height).map(longest).max().unwrap_or(0)
}

#[test]
fn a_saved_picture_has_the_chosen_size_and_parts_and_matches_the_screen() {
    let (mut harness, calls) = window("spcmm", [900.0, 640.0]);
    give_graphics(&mut harness);
    harness.state_mut().player_mut().run_to(7.85e-3);
    harness.run();
    let picture = |harness: &mut Harness<'_, App>, choices: &[&str]| {
        click(harness, "Save");
        for choice in choices {
            click(harness, choice);
        }
        click(harness, "Picture…");
        decoded(&next_file(harness, &calls))
    };
    let shown = harness.render().expect("a picture");
    let view = harness.get_by_label("3D view").rect();
    let window = picture(&mut harness, &["Whole window", "1×"]);
    assert_eq!((window.0.width, window.0.height), (900, 640));
    let screen = (window.0.clone(), shown.into_raw());
    let difference = mean_difference(&screen, &window, 1);
    assert!(difference < 0.3, "the window itself: {difference}");
    // Twice the size gives the same labels, ruler and arrows, only sharper.
    let single = picture(&mut harness, &["View only"]);
    let double = picture(&mut harness, &["2×"]);
    let difference = mean_difference(&single, &double, 2);
    // The tolerance covers the finer floor lines and letters.
    assert!(difference < 4.5, "the view at twice the size: {difference}");
    let [short, long] = [ruler_length(&single), ruler_length(&double)];
    assert!(short > 40 && long.abs_diff(2 * short) <= 3, "ruler {short}, {long}");
    // The buttons are left out, and the plots are below the view.
    let plots = picture(&mut harness, &["View and plots", "1×"]);
    assert_eq!(plots.0.width, single.0.width);
    assert!(plots.0.height > single.0.height + 150);
    let colours = |(info, rgba): &(png::Info<'_>, Vec<u8>)| {
        let below = &rgba[4 * (info.width * single.0.height) as usize..];
        let all: std::collections::HashSet<&[u8]> = below.chunks_exact(4).collect();
        all.len()
    };
    assert!(colours(&plots) > 100, "plots: {}", colours(&plots));
    // Drawing off screen has not changed the window.
    assert_eq!(harness.get_by_label("3D view").rect(), view);

    click(&mut harness, "Save");
    click(&mut harness, "View only");
    click(&mut harness, "Own size");
    for (name, edge) in [("Width of the picture", 300.0), ("Height of the picture", 777.0)] {
        let field = harness.get_by_role_and_label(Role::SpinButton, name);
        field.set_value_accesskit(edge);
        harness.run_steps(2);
    }
    harness.get_by_label("300 × 777 pixels");
    click(&mut harness, "Picture…");
    let custom = decoded(&next_file(&mut harness, &calls));
    assert_eq!((custom.0.width, custom.0.height), (300, 777));

    click(&mut harness, "Save");
    let field = harness.get_by_role_and_label(Role::SpinButton, "Width of the picture");
    field.set_value_accesskit(60_000.0);
    harness.run_steps(2);
    click(&mut harness, "Picture…");
    harness.run_steps(4);
    assert!(label(&harness, "60000x777 pixels: each side must be 1 to "));
    assert!(calls.borrow().saved.is_empty());
}

#[test]
fn the_desktop_asks_for_a_path_and_overwrites_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("mine.csv").display().to_string();
    let (mut harness, _) = window("pendulum", LARGE);
    harness.state_mut().set_host(Box::new(DesktopHost::default()));
    for exists in [false, true] {
        click(&mut harness, "Save");
        click(&mut harness, "Data (CSV)…");
        type_over(&mut harness, "Path", &path);
        harness.key_press(Key::Enter);
        harness.run_steps(3);
        let refused = label(&harness, "it is already there");
        assert_eq!(refused, exists);
    }
    let mut names: Vec<_> = std::fs::read_dir(folder.path())
        .expect("the folder")
        .map(|entry| entry.expect("an entry").file_name())
        .collect();
    names.sort();
    assert_eq!(names, ["mine.csv", "mine.csv.meta.json"]);
}

#[test]
fn a_chosen_or_dropped_file_opens_and_a_bad_one_leaves_the_running_scene() {
    let (mut harness, calls) = window("spcmm", LARGE);
    click(&mut harness, "Open");
    click(&mut harness, "File…");
    assert_eq!(calls.borrow().picked, 1);
    assert!(harness.query_by_label("Path").is_none(), "the host has its own dialog");
    let file = |name: &str, content| vec![OpenedFile { name: name.to_owned(), content }];
    for (bad, words) in [
        (Ok(b"name = [".to_vec()), "mine.toml:1"),
        (Ok(vec![0xff, 0xfe]), "not a text file"),
        (Err("it is gone".to_owned()), "it is gone"),
    ] {
        calls.borrow_mut().to_open.push_back(file("mine.toml", bad));
        harness.run_steps(3);
        assert!(label(&harness, words), "{words}");
        assert_eq!(harness.state().player().running().name, "spcmm");
    }
    let text = &Scene::load("pendulum", &[]).expect("built in").source.text;
    let renamed = text.replace("name = \"pendulum\"", "name = \"mine\"");
    calls.borrow_mut().to_open.push_back(file("mine.toml", Ok(renamed.into_bytes())));
    harness.run_steps(3);
    assert_eq!(harness.state().player().running().name, "mine");
    assert!(!label(&harness, "it is gone"));
    // The file travels in the link.
    let options = AppOptions::from_link(&harness.state().share_state()).expect("a link");
    assert_eq!(options.scene.name, "mine");

    let dropped = Dropped(PathBuf::from("bad.toml"), b"[contact]\nclearance = 3\n");
    harness.input_mut().dropped_files.push(Arc::new(dropped));
    harness.run_steps(3);
    assert!(label(&harness, "bad.toml:2"));
    assert_eq!(harness.state().player().running().name, "mine");
}

const LIFTED: &str = "name = \"lifted\"\ninclude = [\"own.toml\"]\n[[body]]\nname = \"a\"\nmass = \"1 kg\"\ninertia = \"1 1 1 kg m^2\"\n\
    shapes = [{ form = \"mesh\", file = \"parts/a.obj\", unit = \"mm\" }]\n\
    [[joint]]\nname = \"a\"\nkind = \"prismatic\"\nchild = \"a\"\naxis = [0, 0, 1]\ndrive = { law = \"table\", file = \"lift.csv\" }\n";

#[test]
fn a_scene_and_its_files_can_be_dropped_together() {
    let (mut harness, calls) = window("pendulum", LARGE);
    let all: [(&str, &'static [u8]); 4] = [
        ("lifted.toml", LIFTED.as_bytes()),
        ("lift.csv", b"time_s,position_mm\n0,0\n0.5,3\n1,0\n"),
        ("own.toml", b"[[parameter]]\nname = \"reach\"\nvalue = \"2 mm\"\n"),
        ("a.obj", b"v 0 -10 -10\nv 0 10 -10\nv 0 0 10\nv 30 0 0\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"),
    ];
    let drop = |names: &[&str], harness: &mut Harness<'_, App>| {
        for (name, bytes) in all.iter().filter(|(name, _)| names.contains(name)) {
            let dropped = Dropped(PathBuf::from(name), bytes);
            harness.input_mut().dropped_files.push(Arc::new(dropped));
        }
        harness.run_steps(3);
    };
    // The message names the missing file and the remedy.
    drop(&["lifted.toml", "a.obj", "own.toml"], &mut harness);
    assert!(label(&harness, "joint.a.drive.file = \"lift.csv\""));
    assert!(label(&harness, "choose or drop that file and the scene's at once"));
    assert_eq!(harness.state().player().running().name, "pendulum");
    drop(&["lift.csv", "a.obj"], &mut harness);
    assert!(label(&harness, "lift.csv, a.obj: no scene among them"));

    drop(&["lifted.toml", "lift.csv", "own.toml", "a.obj"], &mut harness);
    let scene = harness.state().player().running().clone();
    assert_eq!(scene.name, "lifted", "{}", harness.state().announcement());
    assert_eq!(scene.get("parameter.reach").expect("included"), Value::Number(2e-3));
    let names: Vec<&String> = scene.source.beside.keys().collect();
    assert_eq!(names, ["lift.csv", "own.toml", "parts/a.obj"]);
    let drive = scene.machine.joints[0].drive.as_ref().expect("driven");
    let Drive::Table { points, .. } = drive else {
        panic!("{drive:?}");
    };
    assert_eq!(points[..], [[0.0, 0.0], [0.5, 3e-3], [1.0, 0.0]]);
    // A reset reads the dropped files again.
    harness.key_press(Key::R);
    harness.run_steps(3);
    assert_eq!(harness.state().player().running().source.beside, scene.source.beside);
    assert!(!label(&harness, "no folder"));

    // The files can also be chosen in the host's own dialog.
    let mut files = all.map(|(name, bytes)| OpenedFile { name: name.to_owned(), content: Ok(bytes.to_vec()) });
    files[0].content = Ok(LIFTED.replace("lifted", "again").into_bytes());
    calls.borrow_mut().to_open.push_back(files.to_vec());
    harness.run_steps(3);
    assert_eq!(harness.state().player().running().name, "again");
}

#[test]
fn keys_and_tab_work_before_the_first_click() {
    let (mut harness, _) = window("spcmm", LARGE);
    harness.key_press(Key::ArrowRight);
    harness.step();
    assert_eq!(harness.state().player().steps(), 1);
    // Tab goes to the most used button first, and from there to every control.
    let controls = |harness: &Harness<'_, App>| {
        let all = harness.root().children_recursive();
        let usable = all.map(|node| node.accesskit_node()).filter(|node| !node.is_disabled());
        let tabs = usable.filter(|node| node.data().supports_action(Action::Focus));
        tabs.filter_map(|node| node.label()).collect::<BTreeSet<_>>()
    };
    let mut seen = Vec::new();
    while seen.len() < 2 || seen[seen.len() - 1] != seen[0] {
        harness.key_press(Key::Tab);
        harness.run_steps(2);
        seen.push(focused(&harness).expect("has the focus"));
        assert!(seen.len() < 100, "{seen:?}");
    }
    assert_eq!(seen[0], "Play");
    assert_eq!(seen.into_iter().collect::<BTreeSet<_>>(), controls(&harness));
}

#[test]
fn events_are_announced_to_assistive_software() {
    let (mut harness, calls) = window("pendulum", LARGE);
    harness.state_mut().player_mut().pacer.set_scale(0.02);
    assert_eq!(harness.state().announcement(), "Pendulum on a ball joint. Paused at the start. S1 free.");
    harness.key_press(Key::Space);
    harness.run_steps(2);
    harness.run_steps(120);
    harness.key_press(Key::Space);
    harness.run_steps(3);
    let words = harness.state().announcement().to_owned();
    assert!(words.contains("Paused at ") && words.contains("S1 "), "{words}");
    let announcements = calls.borrow().announced.clone();
    assert_eq!(announcements.last(), Some(&words));
    assert!(announcements.iter().any(|text| text.contains("Running at time scale 1:50")));
    assert!(announcements.iter().any(|text| text.contains("Largest normal force since the last report")));
    assert!((4..=6).contains(&announcements.len()), "{announcements:#?}");
    let node = harness.get_by_role_and_label(Role::Status, &words);
    assert_eq!(node.accesskit_node().live(), Live::Polite);
}

#[test]
fn the_about_box_shows_version_state_and_adapter() {
    let (mut harness, _) = window("pendulum", LARGE);
    give_graphics(&mut harness);
    click(&mut harness, "About");
    harness.get_by_label_contains("Drawn with ");
    harness.get_by_label(&format!("Version {}", jointplay::VERSION));
    harness.get_by_label(&format!("{:016x}", hash(&harness)));
}

#[test]
fn recorded_channels_have_the_columns_of_a_run() {
    for name in jointplay::scene::BUILT_IN {
        let scene = Scene::load(name, &[]).expect("built in");
        let mut frame = Frame::default();
        Simulation::new(&scene.machine).expect("starts").sample(0.0, &mut frame);
        let written = chosen_channels(channels_of(&scene.machine, &frame), &[]).expect("no pattern fails");
        for channel in Channels::of(&scene.machine).list() {
            // A run writes friction as a vector and energies instead of their changes; it has no live changes, no pulling hand
            // and no ghost.
            let replaced = ["change_work_J", "kinetic_change_J", "elastic_change_J"];
            let window_only = matches!(channel.quantity, Quantity::FrictionForce | Quantity::TipError)
                || replaced.contains(&channel.column())
                || (channel.column() == "external_work_J" && scene.machine.elements.is_empty());
            let in_run = written.iter().any(|written| written.column == channel.column());
            assert_eq!(in_run, !window_only, "{name}: {}", channel.column());
        }
    }
}

#[test]
fn phones_show_what_is_stored() {
    for (name, size) in [("phone_upright", PORTRAIT), ("phone_lying", LANDSCAPE)] {
        let mut harness = plain("spcmm", &[], size, egui::Theme::Light);
        let (page, _) = Calls::host();
        harness.state_mut().set_host(page);
        harness.state_mut().player_mut().run_to(7.85e-3);
        harness.run();
        compare_window(&mut harness, name);
    }
}

/// Name of the control that has the focus.
fn focused(harness: &Harness<'_, App>) -> Option<String> {
    let mut all = harness.root().children_recursive();
    let node = all.find(|node| node.accesskit_node().is_focused())?;
    node.accesskit_node().label()
}

#[test]
fn a_menu_opened_by_keyboard_focuses_its_first_entry_and_closes_after_its_last() {
    for (size, name, first) in [(LARGE, "Save", "Picture…"), (PORTRAIT, "Menu", "Open…")] {
        let (mut harness, _) = window("spcmm", size);
        let menu = harness.get_by_role_and_label(Role::Button, name);
        menu.focus();
        harness.run_steps(2);
        harness.key_press(Key::Enter);
        harness.run_steps(4);
        let mut seen = vec![focused(&harness).expect("has the focus")];
        assert_eq!(seen[0], first);
        while harness.query_by_label("Data (CSV)…").is_some() {
            harness.key_press(Key::Tab);
            harness.run_steps(2);
            seen.push(focused(&harness).unwrap_or_default());
            assert!(seen.len() < 40, "{seen:?}");
        }
        for entry in ["Picture…", "2×", "Whole window", "Data (CSV)…", "Scene…"] {
            assert!(seen.iter().any(|label| label == entry), "{entry}: {seen:?}");
        }
    }
}

/// Types `text` into the open dialog and presses Enter.
fn enter_path(harness: &mut Harness<'_, App>, text: &str) {
    type_over(harness, "Path", text);
    harness.key_press(Key::Enter);
    harness.run_steps(4);
}

#[test]
fn the_buttons_of_a_dialog_stay_in_place_while_it_shows_an_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("bad.toml");
    std::fs::write(&path, "[contact]\nclearance = 3\n".repeat(20)).expect("written");
    for size in [LARGE, LANDSCAPE, TINY] {
        let (mut harness, _) = window("spcmm", size);
        harness.state_mut().set_host(Box::new(DesktopHost::default()));
        click(&mut harness, if size == LARGE { "Open" } else { "Menu" });
        harness.run_steps(3);
        click(&mut harness, "Link…");
        enter_path(&mut harness, &path.display().to_string());
        harness.get_by_label_contains("bad.toml:");
        let of = |name| harness.get_all_by_role_and_label(Role::Button, name).map(|node| node.rect());
        // The lowest: the header has a menu of that name.
        let lowest = |a: &egui::Rect, b: &egui::Rect| a.top().total_cmp(&b.top());
        let [open, close] = ["Open", "Cancel"].map(|name| of(name).max_by(lowest).expect("a button"));
        assert!(!open.intersects(close.shrink(1.0)), "{open:?} {close:?}");
        assert!(open.bottom() <= size[1] && (open.center().y - close.center().y).abs() < 1.0);
        // The path can be corrected and confirmed with the mouse.
        let field = harness.get_by_role_and_label(Role::TextInput, "Path");
        field.focus();
        harness.step();
        harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
        harness.step();
        let field = harness.get_by_role_and_label(Role::TextInput, "Path");
        field.type_text("pendulum");
        harness.run_steps(2);
        let buttons = harness.get_all_by_role_and_label(Role::Button, "Open");
        buttons.max_by(|a, b| a.rect().top().total_cmp(&b.rect().top())).expect("a button").click();
        harness.run_steps(3);
        assert_eq!(harness.state().player().running().name, "pendulum");
        assert!(harness.query_by_label("Path").is_none());
    }
}

/// The text copied to the clipboard in this frame.
fn clipboard_text(harness: &Harness<'_, App>) -> Option<String> {
    let commands = &harness.output().platform_output.commands;
    commands.iter().find_map(|command| match command {
        egui::OutputCommand::CopyText(text) => Some(text.clone()),
        _ => None,
    })
}

/// The text that a click on `Copy link` copies to the clipboard, without an address where the dialog asks for one.
fn copy_link(harness: &mut Harness<'_, App>) -> String {
    harness.get_by_label("Copy link").click();
    for _ in 0..8 {
        harness.step();
        if let Some(text) = clipboard_text(harness) {
            return text;
        }
        if let Some(copy) = harness.query_by_label("Copy") {
            copy.click();
        }
    }
    panic!("nothing was copied");
}

#[test]
fn a_link_without_an_address_warns_before_it_is_copied_and_accepts_one() {
    let (mut harness, _) = window("pendulum", LARGE);
    harness.state_mut().set_host(Box::new(DesktopHost::default()));
    let assert_label = |harness: &Harness<'_, App>, words: &str| assert!(label(harness, words), "{words}");
    harness.get_by_label("Copy link").click();
    for _ in 0..3 {
        harness.step();
        assert_eq!(clipboard_text(&harness), None);
    }
    assert_label(&harness, "Without one the link begins with #");
    assert_label(&harness, "No QR code without an address");
    let keep = |harness: &mut Harness<'_, App>, name: &str| {
        if let Some(keep) = std::env::var_os("KEEP_PICTURES") {
            harness.render().expect("drawn").save(std::path::Path::new(&keep).join(name)).expect("writable");
        }
    };
    keep(&mut harness, "link-without-address.png");
    let has_code =
        |harness: &Harness<'_, App>| harness.query_by_role_and_label(Role::Image, "QR code of the link").is_some();
    let enabled = |harness: &Harness<'_, App>| !harness.get_by_label("Copy").accesskit_node().is_disabled();
    assert!(!has_code(&harness) && enabled(&harness));
    let position = harness.get_by_label("Copy").rect();
    for (typed, words, can_be_copied) in [
        ("example.org", "not an address of a page", false),
        ("http://localhost:8000/", "other devices cannot reach http://localhost:8000/", true),
        ("https://example.org/lab/", "https://example.org/lab/ in this state and view", true),
    ] {
        type_over(&mut harness, "Address of the page", typed);
        harness.run_steps(2);
        assert_label(&harness, words);
        assert_eq!(enabled(&harness), can_be_copied, "{typed}");
        assert_eq!(harness.get_by_label("Copy").rect(), position, "{typed}");
    }
    assert!(has_code(&harness));
    keep(&mut harness, "link-with-address.png");
    harness.get_by_label("Copy").click();
    harness.step();
    let link = clipboard_text(&harness).expect("copied");
    assert!(link.starts_with("https://example.org/lab/#scene=pendulum"), "{link}");
    // The address is remembered, and the embedding line uses it.
    assert_eq!(copy_link(&mut harness), link);
    assert!(harness.state().embedding().expect("a line").contains("https://example.org/lab/#"));
    click(&mut harness, "Save");
    keep(&mut harness, "save-menu.png");
    click(&mut harness, "QR code");
    assert!(has_code(&harness) && harness.query_by_label("Address of the page").is_none());
}

#[test]
fn a_link_from_the_window_opens_in_every_form_and_restores_the_camera() {
    let (mut harness, _) = window("spcmm", LARGE);
    harness.state_mut().player_mut().run_to(9e-3);
    harness.run();
    let bare = copy_link_from(&mut harness, "");
    assert!(bare.starts_with("#scene=spcmm&"), "{bare}");
    let page = "https://example.org/lab/";
    let full = copy_link_from(&mut harness, page);
    assert_eq!(full, format!("{page}{bare}"));
    let pairs = bare.trim_start_matches('#');
    let here = (hash(&harness), camera(&harness));
    assert!(here.1.is_some());
    for link in [full.clone(), bare.clone(), format!("?{pairs}"), pairs.to_owned(), format!("{page}?{pairs}")] {
        assert!(AppOptions::from_link(&link).is_ok(), "{link}");
        for pasted in [false, true] {
            let (mut other, _) = window("pendulum", LARGE);
            other.state_mut().set_host(Box::new(DesktopHost::default()));
            if !pasted {
                click(&mut other, "Open");
                click(&mut other, "Link…");
                enter_path(&mut other, &link);
            } else if link == pairs {
                // Pasted text without a leading # or ? is ignored unless it contains key=value pairs.
                other.event(Event::Paste("some words".to_owned()));
                other.run_steps(2);
                assert_eq!(other.state().player().running().name, "pendulum");
                continue;
            } else {
                other.event(Event::Paste(link.clone()));
                other.run_steps(2);
            }
            assert_eq!(verdict(&mut other), Verdict::Agrees(here.0), "{link}");
            assert_eq!((hash(&other), camera(&other)), here, "{link}");
        }
    }
    // On a screen of another aspect ratio the camera fits the scene again.
    let (mut phone, _) = open(AppOptions::from_link(&full).expect("a link"), PORTRAIT);
    verdict(&mut phone);
    // The verdict leaves after 5 s and returns its room to the picture.
    phone.run_steps(320);
    phone.run();
    let fitted = camera(&phone).expect("a camera");
    assert!(fitted.fitted.is_some_and(|aspect| aspect < 2.0), "{fitted:?}");
    assert_ne!(Some(fitted), here.1);
}

fn copy_link_from(harness: &mut Harness<'_, App>, page: &str) -> String {
    let host = DesktopHost::new(page.to_owned());
    harness.state_mut().set_host(Box::new(host));
    copy_link(harness)
}

#[test]
fn every_link_without_a_scene_opens_the_default_machine_in_its_own_motion() {
    for link in
        ["", "?", "?theme=light", "?renderer=webgl", "?embed", "?embed=controls", "?play=0", "?c=0.5mm", "?t=20ms"]
    {
        let options = AppOptions::from_link(link).expect("a link");
        assert_eq!((options.scene.name.as_str(), options.time_scale), (DEFAULT_SCENE, 0.05), "{link}");
        let changes: Vec<_> = options.scene.changes.iter().map(|(key, _)| key.as_str()).collect();
        assert_eq!(changes, ["contact.clearance"][..usize::from(link.contains("c="))], "{link}");
    }
    // Links written before the default machine changed name theirs.
    let options = AppOptions::from_link("?scene=spcmm&c=0.5mm").expect("a link");
    assert_eq!((options.scene.name.as_str(), options.time_scale), ("spcmm", 0.02));
    let (mut harness, _) = open(AppOptions::from_link("?play=1").expect("a link"), LARGE);
    harness.run_steps(120);
    let turns = harness.state().player().pacer.shown() * 6.0;
    assert!((0.4..1.2).contains(&turns), "{turns}");
}

#[test]
fn another_scene_brings_its_own_time_scale_and_plots_and_reopening_keeps_them() {
    let (mut harness, _) = window("spcmm", LARGE);
    let app = harness.state_mut();
    app.player_mut().pacer.set_scale(1e-3);
    app.plots_mut().window = PlotWindow::Last(1e-3);
    app.plots_mut().chosen = vec![Quantity::Energy];
    app.open("press").expect("built in");
    assert_eq!(app.player().pacer.scale(), 0.125);
    assert_eq!(app.plots_mut().window, PlotWindow::Automatic);
    assert_eq!(app.plots_mut().chosen, [Quantity::TipError, Quantity::NormalForce]);
    // A link without plots selects the scene's own, too.
    assert_eq!(app.link().plots, None);
    app.plots_mut().window = PlotWindow::Everything;
    app.player_mut().pacer.set_scale(0.5);
    app.open("press").expect("built in");
    assert_eq!((app.player().pacer.scale(), app.plots_mut().window), (0.5, PlotWindow::Everything));
}
