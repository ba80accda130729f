//! Friction over sliding under the microscope, and the choice of the friction law.

use eframe::egui::{self, Key, Rect, accesskit::Role};
use egui_kittest::{Harness, kittest::Queryable as _};
use jointplay::app::{App, CurvePoint, FrictionCurve, FrictionScale};
use jointplay::scene::Scene;
use jointplay::simulate::{ContactMode, Frame, Simulation};

use crate::hands::{opened, page::click};
use crate::pixels::Picture;

const WIDE: [f32; 2] = [1600.0, 900.0];

/// A block that lies in its guide and is pushed to and fro beyond the limit of friction.
const PUSHED: &str = r#"
name = "pushed"
[gravity]
y = "-9.81 m/s^2"
[contact]
friction_law = "bristle"
restitution = 0.5
[solver]
method = "radau5"
tolerance = 1e-8
[[body]]
name = "block"
mass = "1 kg"
inertia = "1e-3 1e-3 1e-3 kg m^2"
[[joint]]
name = "J"
kind = "prismatic"
child = "block"
axis = [1, 0, 0]
play = { y = "1 um", half_length = "25 mm", half_y = "1 mm", planar = true }
[[load]]
name = "push"
on = { body = "block" }
force = "1 0 0 N"
factor = { law = "formula", formula = "1.5 * sin(2*pi*50*t)" }
"#;

/// The window on the pushed block, its microscope open.
fn pushed(size: [f32; 2], theme: egui::Theme, changes: &[(&str, &str)]) -> Harness<'static, App> {
    let mut harness = opened("pendulum", &[], size, theme, crate::common::ticking_clock::<10>);
    let mut text = PUSHED.to_owned();
    for (old, new) in changes {
        assert!(text.contains(old));
        text = text.replace(old, new);
    }
    harness.state_mut().open_bytes("pushed.toml", text.into_bytes()).expect("opens");
    harness.state_mut().player_mut().set_playing(false);
    harness.state_mut().microscope_mut().set_open(true);
    harness.run();
    harness
}

fn run_to(harness: &mut Harness<'_, App>, time: f64) {
    harness.state_mut().player_mut().run_to(time);
    harness.run();
}

fn drawn(harness: &Harness<'_, App>) -> Option<(FrictionCurve, FrictionScale)> {
    harness.state().microscope().friction().cloned()
}

/// Friction that the block exerts on the guide at `place`, N, its limit, N, and the position of the block along the guide, m, at `time`.
fn of_frame(run: &mut Simulation, frame: &mut Frame, place: usize, time: f64) -> [f64; 3] {
    while run.time() < time {
        run.step().expect("runs");
    }
    run.sample(time, frame);
    let site = &frame.sites_of(0)[place];
    [-site.friction_force.x, 0.15 * site.normal_force.norm(), frame.joints[0].axial]
}

#[test]
fn every_point_drawn_is_of_the_run_and_the_present_one_is_marked() {
    for (law, theme) in [("bristle", egui::Theme::Light), ("modified-coulomb", egui::Theme::Dark)] {
        let mut harness = pushed(WIDE, theme, &[("bristle", law)]);
        let scene = Scene::parse(&PUSHED.replace("bristle", law), None, &[]).expect("valid");
        harness.remove_cursor();
        for time in [0.31, 0.4037] {
            run_to(&mut harness, time);
            let (curve, scale) = drawn(&harness).expect("it lies");
            assert!(curve.touches && curve.points.len() > 100, "{law}: {}", curve.points.len());
            let mut run = Simulation::new(&scene.machine).expect("starts");
            let mut frame = Frame::default();
            let mut begun = None;
            for point in &curve.points {
                let [friction, limit, x] = of_frame(&mut run, &mut frame, curve.place, point.time);
                assert!((point.friction - friction).abs() < 1e-6 * limit, "{law}: {point:?}, not {friction} N");
                assert!((point.limit - limit).abs() < 1e-6 * limit, "{law}: {point:?}, not {limit} N");
                let begun = *begun.get_or_insert(point.displacement - x);
                // The corner moves with the block, which turns by some 1e-8.
                assert!((point.displacement - x - begun).abs() < 2e-8, "{law}: {point:?}, not {x} m");
                assert!(scale.area.contains(scale.place(point.displacement, point.friction)));
                assert!(scale.area.contains(scale.place(point.displacement, -point.limit)));
            }
            // The whole window of time, and up to now.
            let [first, last] = [curve.points[0], curve.points[curve.points.len() - 1]];
            let player = harness.state().player();
            assert_eq!(last.time, player.pacer.shown());
            assert!(last.time - first.time <= player.automatic_window());
            let mark = scale.place(last.displacement, last.friction);
            let picture = harness.render().expect("drawn");
            let picture = Picture::new(picture.width(), picture.into_raw());
            let around = Rect::from_center_size(mark, egui::Vec2::splat(16.0));
            let around = [around.left(), around.top(), around.right(), around.bottom()].map(|edge| edge as usize);
            let orange = if theme == egui::Theme::Light { [0xB8, 0x38, 0x18] } else { [0xFF, 0x70, 0x5C] };
            let dot = picture.coloured(around, orange, 40);
            assert!(dot.len() > 20, "{law}: {} at {mark}", dot.len());
            let mean = |read: fn(&(usize, usize)) -> usize| {
                dot.iter().map(read).sum::<usize>() as f32 / dot.len() as f32 + 0.5
            };
            let centre = egui::pos2(mean(|p| p.0), mean(|p| p.1));
            assert!(centre.distance(mark) < 2.0, "{law}: {centre}, not {mark}");
            harness.get_by_label_contains("Friction over sliding at J.");
        }
    }
}

#[test]
fn bristles_draw_a_slope_and_coulomb_friction_a_jump() {
    let last_period = |law: &str, push: &str| {
        let mut harness = pushed(WIDE, egui::Theme::Light, &[("bristle", law), ("1.5 * sin", push)]);
        run_to(&mut harness, 0.4);
        let (curve, _) = drawn(&harness).expect("it lies");
        curve.points.into_iter().filter(|point| point.time > 0.38).collect::<Vec<_>>()
    };
    let is_inside = |point: &CurvePoint| point.friction.abs() < 0.5 * point.limit;
    let points = last_period("bristle", "1.5 * sin");
    let mut slopes = 0;
    for pair in points.windows(2).filter(|pair| pair.iter().all(is_inside)) {
        let slope = (pair[1].friction - pair[0].friction) / (pair[1].displacement - pair[0].displacement);
        // Of the damping, d a / v.
        assert!((slope / 1e8 - 1.0).abs() < 0.05, "{slope:e} N/m");
        slopes += 1;
    }
    assert!(slopes > 20, "{slopes}");
    let points = last_period("modified-coulomb", "2.5 * sin");
    let [least, most] =
        [f64::min, f64::max].map(|of| points.iter().map(|p| p.displacement).reduce(of).expect("points"));
    let inside: Vec<&CurvePoint> = points.iter().filter(|point| is_inside(point)).collect();
    assert!(!inside.is_empty() && most - least > 5e-6);
    for CurvePoint { displacement: x, .. } in inside {
        assert!((x - least).min(most - x) < 0.01 * (most - least), "{x:e} between {least:e} and {most:e}");
    }
}

#[test]
fn nothing_is_drawn_without_friction_or_room() {
    for [old, new] in [["bristle", "none"], ["restitution", "friction = 0\nrestitution"]] {
        let mut harness = pushed(WIDE, egui::Theme::Light, &[(old, new)]);
        run_to(&mut harness, 0.1);
        assert!(drawn(&harness).is_none(), "{new}");
        assert!(harness.query_all_by_label_contains("riction so far").next().is_none());
    }
    for size in [[400.0, 300.0], [640.0, 400.0]] {
        let mut harness = pushed(size, egui::Theme::Light, &[]);
        run_to(&mut harness, 0.1);
        assert!(drawn(&harness).is_none(), "{size:?}");
    }
    // An empty sheet keeps its place until the first contact, and a closed microscope draws nothing.
    let mut harness = pushed(WIDE, egui::Theme::Light, &[]);
    assert!(drawn(&harness).is_none());
    run_to(&mut harness, 0.1);
    assert!(drawn(&harness).is_some());
    harness.key_press(Key::L);
    harness.run();
    run_to(&mut harness, 0.1);
    assert!(!harness.state().microscope().is_open());
    harness.key_press(Key::L);
    harness.run();
    assert!(drawn(&harness).is_some(), "also of what happened before");
}

#[test]
fn it_follows_a_playing_run_into_the_past_and_through_a_restart() {
    let mut harness = pushed(WIDE, egui::Theme::Light, &[]);
    run_to(&mut harness, 0.2);
    let last = |harness: &Harness<'_, App>| {
        let (curve, _) = drawn(harness).expect("it lies");
        *curve.points.last().expect("points")
    };
    let there = last(&harness);
    harness.state_mut().player_mut().set_playing(true);
    harness.run_steps(20);
    harness.state_mut().player_mut().set_playing(false);
    harness.run();
    assert_eq!(last(&harness).time, harness.state().player().pacer.shown());
    assert!(last(&harness).time > 0.2);
    harness.state_mut().player_mut().go_to(0.2);
    harness.run();
    assert!(!harness.state().player().is_seeking());
    let again = last(&harness);
    assert_eq!([again.time, again.friction, again.limit], [there.time, there.friction, there.limit]);
    assert!((again.displacement - there.displacement).abs() < 1e-10, "{again:?} {there:?}");
    for _ in 0..30 {
        harness.state_mut().player_mut().step_back();
    }
    harness.run();
    let (curve, _) = drawn(&harness).expect("it lies");
    assert!(last(&harness).time < 0.2 && curve.points.is_sorted_by(|a, b| a.time <= b.time));
    click(&mut harness, "Restart");
    harness.run();
    assert!(drawn(&harness).is_none(), "no contact so far");
    run_to(&mut harness, 0.05);
    assert!(drawn(&harness).is_some());
}

#[test]
fn it_lies_within_the_panel_also_enlarged_and_in_a_presentation() {
    for (size, zoom) in [(WIDE, 1.0), ([3200.0, 1800.0], 2.0), ([390.0, 844.0], 1.0)] {
        let mut harness = pushed(size, egui::Theme::Dark, &[]);
        harness.ctx.set_zoom_factor(zoom);
        harness.run();
        run_to(&mut harness, 0.1);
        let (_, scale) = drawn(&harness).unwrap_or_else(|| panic!("{size:?}"));
        let sheet = harness.get_by_label_contains("Friction over sliding at J.").rect();
        assert!(sheet.contains_rect(scale.area) && scale.area.height() > 60.0, "{size:?}: {sheet} {}", scale.area);
        let picture = harness.get_by_label_contains("Slide J under the microscope. ").rect();
        assert!(!picture.intersects(sheet), "{size:?}");
    }
    // On a common screen it is in sight with the plots below, under the circle and the section of a ball.
    let changes = [("contact.friction_law", "bristle")];
    let clock = crate::common::ticking_clock::<10>;
    let mut harness = opened("spcmm", &changes, [1280.0, 800.0], egui::Theme::Light, clock);
    harness.key_press(Key::L);
    harness.run();
    run_to(&mut harness, 0.1);
    let sheet = harness.get_by_label_contains("Friction over sliding: ").rect();
    let timeline = harness.get_by_label_contains("Timeline").rect();
    assert!(sheet.bottom() < timeline.top(), "{sheet} {timeline}");
    let mut harness = pushed([1920.0, 1080.0], egui::Theme::Light, &[]);
    run_to(&mut harness, 0.1);
    harness.key_press(Key::F5);
    harness.run();
    assert!(harness.state().is_presenting());
    assert!(drawn(&harness).is_some());
}

/// Whether the tooltip of the slider `name` says `words`.
fn says(harness: &mut Harness<'_, App>, name: &str, words: &str) -> bool {
    harness.get_by_role_and_label(Role::Slider, name).scroll_to_me();
    harness.run();
    let slider = harness.get_by_role_and_label(Role::Slider, name).rect();
    harness.hover_at(slider.center());
    harness.run_steps(60);
    let is_said = harness.query_by_label(words).is_some();
    harness.hover_at(egui::pos2(800.0, 300.0));
    harness.run_steps(30);
    is_said
}

#[test]
fn a_change_to_bristles_waits_for_a_restart_and_says_so() {
    let mut harness = opened("pendulum", &[], WIDE, egui::Theme::Light, crate::common::ticking_clock::<10>);
    run_to(&mut harness, 0.02);
    click(&mut harness, "Contact");
    harness.run();
    let unused = "Without effect: only the friction law bristle uses it";
    assert!(says(&mut harness, "Stribeck speed", unused));
    harness.get_by_role_and_label(Role::ComboBox, "Friction law").scroll_to_me();
    harness.run();
    harness.get_by_role_and_label(Role::ComboBox, "Friction law").click();
    harness.run();
    harness.get_all_by_label("bristle").last().expect("an entry").click();
    harness.run();
    assert!(harness.state().player().is_pending("contact.friction_law"));
    harness.get_by_label("Friction law: Applies when the run starts again from t = 0.");
    assert!(!says(&mut harness, "Stribeck speed", unused));
    assert!(says(&mut harness, "Stribeck speed", "Without effect: the static friction ratio is 1"));
    assert!(says(&mut harness, "Low slip speed", "Without effect: only the friction law modified-coulomb uses it"));
    run_to(&mut harness, 0.05);
    click(&mut harness, "Restart");
    harness.run();
    assert!(!harness.state().player().is_pending("contact.friction_law"));
    let mut sticks = false;
    for step in 1..200 {
        harness.state_mut().player_mut().run_to(f64::from(step) * 2e-3);
        sticks |= harness.state().player().frame().joints[0].state == ContactMode::Stick;
    }
    harness.run();
    assert!(sticks);
    harness.get_by_label_contains("Key of the timeline. ");
    assert!(harness.query_all_by_label_contains("Sticks: friction is below its limit").next().is_some());
}
