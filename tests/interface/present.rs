//! Presentation mode: legible from the last row.

use eframe::egui::{self, Key, PointerButton, Shape, TextStyle, accesskit::Role, vec2};
use egui_kittest::{Harness, kittest::Queryable as _};
use jointplay::app::App;
use jointplay::simulate::Simulation;

use crate::hands::window::{click, shown, sized};
use crate::hands::{compare_window, plain};

const SCREEN: egui::Vec2 = vec2(1280.0, 720.0);

/// Presses F5 and resizes the window for its new zoom, since a real one keeps its number of pixels.
fn toggle_presentation(harness: &mut Harness<'_, App>, screen: egui::Vec2) {
    harness.key_press(Key::F5);
    harness.step();
    harness.set_size(screen / harness.ctx.zoom_factor());
    harness.run();
}

#[test]
fn f5_shows_the_picture_with_large_type_and_does_not_affect_the_run() {
    for screen in [SCREEN, vec2(1920.0, 1080.0), vec2(800.0, 450.0)] {
        let mut harness = sized("spcmm", screen.into(), egui::Theme::Light);
        harness.state_mut().player_mut().run_to(30e-3);
        harness.run();
        let state = |harness: &Harness<'_, App>| {
            let player = harness.state().player();
            (player.pacer.shown(), player.simulation().state_hash())
        };
        let before = state(&harness);
        toggle_presentation(&mut harness, screen);
        assert!(harness.state().is_presenting());
        // The panels are hidden; time and transport remain.
        for gone in ["Controls", "Save", "View options", "Clearance"] {
            assert!(harness.query_by_label(gone).is_none(), "{gone}");
        }
        harness.get_by_label("Play");
        let zoom = harness.ctx.zoom_factor();
        let styles = &harness.ctx.global_style().text_styles;
        for style in [TextStyle::Small, TextStyle::Body, TextStyle::Button] {
            let share = styles[&style].size * zoom / screen.y;
            assert!(share >= 1.0 / 40.0 - 1e-6, "{screen:?} {style:?}: {share}");
        }

        // The caption describes the last impact that has ended by the displayed instant.
        let mut simulation = Simulation::new(&harness.state().player().running().machine).expect("starts");
        let mut impacts = Vec::new();
        while simulation.time() < 30e-3 {
            simulation.step().expect("runs");
            impacts.extend(simulation.take_impacts());
        }
        let last = impacts.iter().rfind(|impact| impact.end <= before.0);
        let last = last.expect("an impact");
        let words = harness.state().last_impact().expect("an impact");
        harness.get_by_label(&words);
        let mut parts = words.split(", ");
        let joints = &simulation.machine().loose_joints;
        assert_eq!(parts.next(), Some(joints[last.joint].name.as_str()));
        let number = |text: &str| -> f64 {
            let digits: String = text.chars().take_while(|c| !c.is_whitespace()).collect();
            digits.replace('\u{2212}', "-").parse().expect("a number")
        };
        let (force, duration) = (parts.next().expect("a force"), parts.next().expect("a time"));
        assert!(force.ends_with(" N") && duration.ends_with(" ms"), "{words}");
        assert!((number(force) / last.peak - 1.0).abs() < 5.1e-3, "{words}");
        let milliseconds = (last.end - last.start) * 1e3;
        assert!((number(duration) / milliseconds - 1.0).abs() < 0.051, "{words}");

        harness.key_press(Key::Escape);
        harness.step();
        harness.set_size(screen);
        harness.run();
        assert!(!harness.state().is_presenting());
        assert_eq!(harness.ctx.zoom_factor(), 1.0);
        harness.get_by_label("View options");
        assert_eq!(state(&harness), before);
    }
}

/// The smallest font size on the screen, as a fraction of its height.
fn smallest_font(harness: &Harness<'_, App>) -> f32 {
    fn sizes(shape: &Shape, min: &mut f32) {
        match shape {
            Shape::Vec(shapes) => shapes.iter().for_each(|shape| sizes(shape, min)),
            Shape::Text(text) => {
                let sections = text.galley.job.sections.iter();
                *min = sections.fold(*min, |min, section| min.min(section.format.font_id.size));
            }
            _ => {}
        }
    }
    let mut min = f32::INFINITY;
    harness.output().shapes.iter().for_each(|part| sizes(&part.shape, &mut min));
    min / harness.ctx.content_rect().height()
}

#[test]
fn a_presentation_scrubs_steps_between_impacts_and_shows_one_plot_at_a_time() {
    for screen in [SCREEN, vec2(1920.0, 1080.0)] {
        let mut harness = sized("spcmm", screen.into(), egui::Theme::Light);
        harness.state_mut().player_mut().run_to(40e-3);
        harness.run();
        toggle_presentation(&mut harness, screen);
        let strip = harness.get_by_role_and_label(Role::Slider, "Timeline, s").rect();
        let at = |share: f32| egui::pos2(strip.left() + share * strip.width(), strip.center().y);
        harness.drag_at(at(0.9));
        harness.step();
        for share in [0.8, 0.6, 0.5] {
            harness.hover_at(at(share));
            harness.step();
        }
        harness.drop_at(at(0.5));
        harness.run();
        assert!((shown(&harness) - 20e-3).abs() < 0.2e-3, "{}", shown(&harness));
        click(&mut harness, "Next impact");
        let next = shown(&harness);
        assert!(next > 20e-3);
        click(&mut harness, "Previous impact");
        assert!(shown(&harness) < next);
        let before = shown(&harness);
        click(&mut harness, "Step");
        assert!(shown(&harness) > before);

        let titles = ["Tip error by axis, mm", "Normal force, N"];
        let shown_plots = |harness: &Harness<'_, App>| titles.map(|title| harness.query_by_label(title).is_some());
        assert_eq!(shown_plots(&harness), [false, false]);
        for expected in [[true, false], [false, true], [false, false]] {
            harness.key_press(Key::P);
            harness.run();
            assert_eq!(shown_plots(&harness), expected);
            let share = smallest_font(&harness);
            assert!(share >= 1.0 / 40.0 - 1e-6, "{share}");
        }
        click(&mut harness, "Plot");
        assert_eq!(shown_plots(&harness), [true, false], "the button works, too");
        // The window's own plots are restored.
        harness.key_press(Key::F5);
        harness.step();
        harness.set_size(screen);
        harness.run();
        assert_eq!(shown_plots(&harness), [true, true]);
    }
}

#[test]
fn the_font_size_follows_the_screen() {
    let mut harness = sized("pendulum", SCREEN.into(), egui::Theme::Light);
    toggle_presentation(&mut harness, SCREEN);
    let zoom = harness.ctx.zoom_factor();
    assert!((zoom - 720.0 / 40.0 / 11.0).abs() < 1e-3, "{zoom}");
    // The full screen is larger than the window.
    harness.set_size(vec2(1920.0, 1080.0) / zoom);
    harness.step();
    harness.step();
    let zoom = harness.ctx.zoom_factor();
    assert!((zoom - 1080.0 / 40.0 / 11.0).abs() < 1e-3, "{zoom}");
}

#[test]
fn a_double_click_on_the_bar_toggles_presentation_too() {
    for size in [[1280.0, 800.0], [390.0, 844.0], [844.0, 390.0]] {
        let mut harness = sized("pendulum", size, egui::Theme::Light);
        // An empty part of the bar.
        let rect_of = |label: &str| harness.get_by_label(label).rect();
        let at = match size {
            [844.0, _] => rect_of("Controls").left_center() - vec2(14.0, 0.0),
            [390.0, _] => egui::pos2(370.0, rect_of("Experiments").center().y),
            _ => egui::pos2(size[0] - 24.0, rect_of("Play").center().y),
        };
        for _ in 0..2 {
            for pressed in [true, false] {
                harness.event(egui::Event::PointerMoved(at));
                harness.event(egui::Event::PointerButton {
                    pos: at,
                    button: PointerButton::Primary,
                    pressed,
                    modifiers: egui::Modifiers::NONE,
                });
                harness.step();
            }
        }
        assert!(harness.state().is_presenting(), "{size:?}");
    }
}

#[test]
fn the_arrows_of_a_presentation_with_its_plot_have_their_ruler() {
    for screen in [SCREEN, vec2(1280.0, 800.0), vec2(1920.0, 1080.0)] {
        let mut harness = sized("measuring-machine", screen.into(), egui::Theme::Light);
        harness.state_mut().player_mut().run_to(108e-3);
        harness.run();
        toggle_presentation(&mut harness, screen);
        click(&mut harness, "Plot");
        harness.run();
        let texts: Vec<String> = harness
            .output()
            .shapes
            .iter()
            .filter_map(|shape| match &shape.shape {
                Shape::Text(text) => Some(text.galley.text().to_owned()),
                _ => None,
            })
            .collect();
        assert!(texts.iter().any(|text| text.starts_with("Force")), "{screen:?}: {texts:?}");
        if let Ok(folder) = std::env::var("LOOK") {
            let image = harness.render().expect("drawn");
            image.save(format!("{folder}/present-{}.png", screen.y)).expect("saved");
        }
    }
}

#[test]
fn a_presentation_shows_what_is_stored() {
    for (name, scene, theme) in [
        ("presentation_light", "spcmm", egui::Theme::Light),
        ("presentation_dark", "slider-crank-driven", egui::Theme::Dark),
    ] {
        let mut harness = plain(scene, &[], SCREEN.into(), theme);
        harness.state_mut().player_mut().run_to(30e-3);
        harness.run();
        toggle_presentation(&mut harness, SCREEN);
        let zoom = harness.ctx.zoom_factor();
        harness.set_pixels_per_point(zoom);
        harness.run();
        compare_window(&mut harness, name);
    }
}

#[test]
fn esc_closes_the_innermost_part_first_then_microscope_and_presentation() {
    let mut harness = sized("spcmm", SCREEN.into(), egui::Theme::Light);
    let esc = |harness: &mut Harness<'_, App>| {
        harness.key_press(Key::Escape);
        harness.run();
    };
    let is_open = |harness: &Harness<'_, App>| harness.state().microscope().is_open();
    harness.state_mut().microscope_mut().set_open(true);
    harness.run();
    // A text field.
    harness.get_by_role_and_label(Role::TextInput, "Clearance").focus();
    harness.run();
    assert!(harness.ctx.text_edit_focused());
    esc(&mut harness);
    assert!(!harness.ctx.text_edit_focused() && is_open(&harness));
    // A menu.
    click(&mut harness, "Choose plots");
    esc(&mut harness);
    assert!(harness.query_by_label("Search channels").is_none() && is_open(&harness));
    // A list in a dialog, then the dialog.
    click(&mut harness, "Save");
    click(&mut harness, "Film…");
    harness.get_by_role_and_label(Role::ComboBox, "Size of the film").click();
    harness.run();
    esc(&mut harness);
    assert!(harness.query_by_label("Make film").is_some());
    esc(&mut harness);
    assert!(harness.query_by_label("Make film").is_none() && is_open(&harness));
    // A message.
    let ctx = harness.ctx.clone();
    harness.state_mut().open_link(&ctx, "#scene=nowhere").expect_err("no such scene");
    harness.run();
    esc(&mut harness);
    assert!(harness.query_by_label("Dismiss").is_none() && is_open(&harness));
    esc(&mut harness);
    assert!(!is_open(&harness));
    // The list of time scales in a presentation.
    toggle_presentation(&mut harness, SCREEN);
    harness.get_by_role_and_label(Role::ComboBox, "Time scale preset").click();
    harness.run();
    esc(&mut harness);
    assert!(harness.state().is_presenting());
    esc(&mut harness);
    assert!(!harness.state().is_presenting());
}

#[test]
fn nothing_beside_the_clock_moves_as_its_digits_change() {
    for is_presenting in [false, true] {
        let mut harness = sized("spcmm", SCREEN.into(), egui::Theme::Light);
        if is_presenting {
            toggle_presentation(&mut harness, SCREEN);
        }
        let rects = |harness: &Harness<'_, App>| {
            ["Restart", "Play", "Step", "Next impact", "Timeline, s", "Time scale preset"]
                .map(|name| harness.get_by_label(name).rect())
        };
        let before = rects(&harness);
        for time in [0.9e-6, 3.3e-6, 0.9999e-3, 1e-3, 9.9999e-3, 10.0001e-3, 111.1111e-3] {
            harness.state_mut().player_mut().run_to(time);
            harness.run();
            assert_eq!(rects(&harness), before, "{time}");
        }
    }
}
