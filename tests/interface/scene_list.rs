//! The list of scenes and its preview pictures.

use eframe::egui::{Rect, Theme, accesskit::Role};
use eframe::egui_wgpu::RendererOptions;
use egui_kittest::wgpu::{WgpuTestRenderer, create_render_state, default_wgpu_setup};
use egui_kittest::{Harness, kittest::Queryable as _};
use jointplay::app::{App, AppOptions, lesson_titles};
use jointplay::scene::{BUILT_IN, Scene};

/// A window that uses one adapter for on-screen and off-screen drawing.
fn window(size: [f32; 2], theme: Theme) -> Harness<'static, App> {
    let state = create_render_state(default_wgpu_setup(), RendererOptions::PREDICTABLE);
    let renderer = WgpuTestRenderer::from_render_state(state.clone());
    let builder = Harness::builder().with_size(size).with_theme(theme).with_max_steps(60).renderer(renderer);
    let scene = Scene::load("pendulum", &[]).expect("built in");
    let options = AppOptions { playing: false, theme: theme.into(), ..AppOptions::new(scene) };
    let mut harness = builder.build_eframe(move |cc| App::new(cc, options).expect("the scene starts"));
    let ctx = harness.ctx.clone();
    harness.state_mut().attach(&ctx, Some(&state), theme.into());
    harness.run();
    harness
}

/// The list of lessons: in order, each with a picture and its length, and the first to start with.
#[test]
fn the_lessons_have_pictures_lengths_and_an_order() {
    for (size, theme) in
        [([1280.0, 800.0], Theme::Light), ([1280.0, 800.0], Theme::Dark), ([390.0, 844.0], Theme::Light)]
    {
        let mut harness = window(size, theme);
        harness.get_by_role_and_label(Role::Button, "Lessons").click();
        harness.run_steps(2);
        harness.get_by_label("Start here");
        let places: Vec<Rect> = lesson_titles()
            .iter()
            .map(|(_, title)| harness.get_by_role_and_label(Role::Button, title).rect())
            .collect();
        for pair in places.windows(2) {
            assert!(pair[0].bottom() <= pair[1].top() || pair[0].right() <= pair[1].left(), "{pair:?}: in order");
        }
        harness.run_steps(places.len() + 2);
        if let Some(keep) = std::env::var_os("KEEP_PICTURES") {
            let name = format!("lessons-{}-{theme:?}.png", size[0]);
            harness.render().expect("drawn").save(std::path::Path::new(&keep).join(name)).expect("writable");
        }
        let seen: Vec<Rect> = places.into_iter().filter(|place| place.bottom() < size[1] * 0.8).collect();
        assert!(seen.len() >= 5, "{seen:?}");
        for place in seen {
            let colours = count_colours(&mut harness, place);
            assert!(colours > 60, "{place:?}: {colours}");
        }
    }
}

fn entries(harness: &Harness<'_, App>) -> Vec<Rect> {
    let area = |name: &str| harness.query_by_role_and_label(Role::Button, name).map(|entry| entry.rect());
    BUILT_IN.iter().filter_map(|name| area(name)).collect()
}

/// Number of distinct colours in the left part of `entry` within the window.
fn count_colours(harness: &mut Harness<'_, App>, entry: Rect) -> usize {
    let image = harness.render().expect("drawn");
    let (from, to) = (entry.left_top(), entry.left_bottom());
    let mut colours = std::collections::BTreeSet::new();
    for y in from.y.max(0.0) as u32 + 6..(to.y as u32).min(image.height()) - 6 {
        for x in from.x as u32 + 10..from.x as u32 + 100 {
            colours.insert(image.get_pixel(x, y).0);
        }
    }
    colours.len()
}

#[test]
fn each_scene_in_the_list_has_a_picture_that_leaves_the_layout_unchanged() {
    for (size, theme) in
        [([1280.0, 800.0], Theme::Light), ([1280.0, 800.0], Theme::Dark), ([390.0, 844.0], Theme::Light)]
    {
        let mut harness = window(size, theme);
        harness.get_by_role_and_label(Role::ComboBox, "Scene").click();
        harness.run_steps(2);
        let first = entries(&harness);
        let without_picture = count_colours(&mut harness, first[5]);
        harness.run_steps(BUILT_IN.len() + 2);
        assert_eq!(entries(&harness), first, "{size:?}");
        if let Some(keep) = std::env::var_os("KEEP_PICTURES") {
            let name = format!("scenes-{}-{theme:?}.png", size[0]);
            harness.render().expect("drawn").save(std::path::Path::new(&keep).join(name)).expect("writable");
        }
        for entry in first.iter().filter(|entry| entry.bottom() < size[1] * 0.8) {
            let colours = count_colours(&mut harness, *entry);
            assert!(colours > 100, "{entry:?}: {colours}");
        }
        assert!(without_picture < 20, "{without_picture}");
    }
}
