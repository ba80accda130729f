//! Pixel tests of drawn curves.

use std::cell::Cell;
use std::rc::Rc;

use eframe::egui::Theme;
use egui_kittest::Harness;
use egui_plot::Plot;

use super::*;
use crate::app::theme;
use crate::session::history::History;

#[path = "../../../tests/common/pixels.rs"]
mod pixels;
use pixels::{Picture, top};

const COLOURS: [[u8; 3]; 3] = [[255, 0, 0], [0, 160, 0], [0, 0, 255]];
/// Largest channel difference of a pixel that is mostly of a given colour.
const MOSTLY: u8 = 150;
/// Sizes in points, and pixels per point.
const SIZES: [([f32; 2], f32); 3] = [([330.0, 130.0], 1.0), ([700.0, 240.0], 1.0), ([520.0, 300.0], 2.0)];

/// Plots the record's first three channels over `length` seconds and -50 to 750. Returns the picture and the map from plot
/// coordinates to pixels.
fn drawn(
    history: &History,
    length: f64,
    size: [f32; 2],
    scale: f32,
) -> (Picture, impl Fn(f64, f64) -> [f64; 2] + use<>) {
    let traces: Vec<Trace> = COLOURS
        .iter()
        .enumerate()
        .map(|(channel, [r, g, b])| {
            let mut bins = Vec::new();
            history.bins(channel, 0.0, length, (2.0 * size[0] * scale) as usize, &mut bins);
            Trace { bins, colour: Color32::from_rgb(*r, *g, *b) }
        })
        .collect();
    let transform_cell = Rc::new(Cell::new(None));
    let transform_sink = transform_cell.clone();
    let mut harness =
        Harness::builder().with_size(size).with_pixels_per_point(scale).with_theme(Theme::Light).wgpu().build_ui(
            move |ui| {
                // Text has a font from the second pass on.
                if ui.ctx().cumulative_pass_nr() == 0 {
                    ui.ctx().set_fonts(theme::fonts());
                    return ui.ctx().request_repaint();
                }
                let shown = Plot::new("curves").show_grid(false).show(ui, |plot| {
                    plot.set_plot_bounds_x(0.0..=length);
                    plot.set_plot_bounds_y(-50.0..=750.0);
                    plot.add(Curves::new(&traces, [1.0, 1.0]));
                });
                transform_sink.set(Some(shown.transform));
            },
        );
    harness.run();
    let image = harness.render().expect("drawn");
    let transform: PlotTransform = transform_cell.get().expect("shown");
    let place = move |time: f64, value: f64| {
        let at = transform.position_from_point(&PlotPoint::new(time, value)) * scale;
        [f64::from(at.x), f64::from(at.y)]
    };
    (Picture::new(image.width(), image.into_raw()), place)
}

/// Record of 0.1 s in steps of 0.1 ms; `value` gives each channel at each instant.
fn record(value: impl Fn(u32, usize) -> f64) -> History {
    let mut history = History::new(3, 2e-6);
    for n in 0..=1000 {
        history.push(f64::from(n) * 1e-4, &[0, 1, 2].map(|channel| value(n, channel)));
    }
    history
}

fn around(x: f64) -> [usize; 4] {
    [x as usize - 4, 0, x as usize + 4, usize::MAX]
}

#[test]
fn every_spike_including_the_newest_has_its_recorded_height() {
    let spikes = [(200, 0, 621.0), (430, 1, 333.0), (431, 1, 101.0), (700, 2, 87.0), (1000, 0, 379.0)];
    let history = record(|n, channel| {
        let found = spikes.iter().find(|spike| (spike.0, spike.1) == (n, channel));
        found.map_or(0.0, |spike| spike.2)
    });
    // The newest instant at the right edge, then in the middle.
    for ((size, scale), length) in SIZES.into_iter().zip([0.102, 0.2].into_iter().cycle()) {
        let (picture, place) = drawn(&history, length, size, scale);
        for (n, channel, force) in spikes.into_iter().filter(|spike| spike.2 != 101.0) {
            let [x, y] = place(f64::from(n) * 1e-4, force);
            let highest = top(&picture.coloured(around(x), COLOURS[channel], MOSTLY)).expect("drawn");
            assert!((highest as f64 + 0.5 - y).abs() <= 1.0, "{size:?} {n}: {highest} for {y}");
        }
    }
}

#[test]
fn coincident_spikes_of_different_or_equal_height_are_all_visible() {
    let all = [[621.0, 561.0, 533.0], [533.0, 561.0, 621.0], [400.0; 3], [0.0; 3]];
    for (heights, (size, scale)) in all.into_iter().zip(SIZES.into_iter().cycle()) {
        let history = record(|n, channel| if n == 500 { heights[channel] } else { 0.0 });
        let (picture, place) = drawn(&history, 0.1, size, scale);
        let [x, _] = place(0.05, 0.0);
        for (height, colour) in heights.into_iter().zip(COLOURS) {
            let [_, y] = place(0.05, height);
            // Spikes rise above the level shared by all channels; that level is checked too.
            let area = match height {
                0.0 => {
                    let ends = (place(0.0, 9.0), place(0.1, -9.0));
                    [ends.0[0], ends.0[1], ends.1[0], ends.1[1]].map(|at| at as usize)
                }
                _ => [around(x)[0], 0, around(x)[2], (place(0.0, 0.0)[1] - 3.0) as usize],
            };
            let found = picture.coloured(area, colour, 110);
            assert!(found.len() > 2, "{heights:?} {size:?}: {colour:?}");
            if heights[0] != heights[1] {
                let highest = top(&picture.coloured(area, colour, MOSTLY)).expect("drawn");
                assert!((highest as f64 + 0.5 - y).abs() <= 1.0, "{heights:?}: {highest} for {y}");
            }
        }
    }
}

#[test]
fn a_curve_is_whole_and_stays_in_the_range_of_its_values() {
    // Slow, fast, and jumping between two values, sampled coarser and finer than pixels.
    let value = |n: u32, channel| match channel {
        0 => 350.0 + 300.0 * libm::sin(f64::from(n) * 0.01),
        1 => 350.0 + 300.0 * libm::sin(f64::from(n) * 2.5),
        _ => 50.0 + 100.0 * f64::from(n / 100 % 2),
    };
    for (turn, (size, scale)) in SIZES.into_iter().enumerate() {
        for channel in 0..3 {
            let length = [0.1, 0.01][(turn + channel) % 2];
            let only = |n: u32, other: usize| {
                if other == channel { value(n, channel) } else { f64::NAN }
            };
            let (picture, place) = drawn(&record(only), length, size, scale);
            let (low, high) = if channel == 2 { (50.0, 150.0) } else { (50.0, 650.0) };
            let corners = (place(0.0, 740.0), place(length, -40.0));
            let (left, right) = (corners.0[0] as usize + 1, corners.1[0] as usize - 1);
            let frame = [left, corners.0[1] as usize, right, corners.1[1] as usize];
            let found = picture.coloured(frame, COLOURS[channel], 110);
            // Half the width of a level curve.
            let half = f64::from(0.5 * WIDTH * scale) + 0.5;
            let (top, bottom) = (place(0.0, high)[1] - half, place(0.0, low)[1] + half);
            assert!(found.iter().all(|(_, y)| (top..bottom).contains(&(*y as f64 + 0.5))));
            for x in left..right {
                assert!(found.iter().any(|place| place.0 == x), "{channel} {size:?}: a gap at {x}");
            }
        }
    }
}

#[test]
fn a_range_over_a_long_stretch_is_a_pale_block_and_no_curve() {
    // One touch of a millisecond. Once half a minute has been recorded, only the range of bins of 16 ms is known.
    let mut history = record(|n, channel| match channel {
        0 if (480..490).contains(&n) => 390.0,
        0 => 0.0,
        _ => f64::NAN,
    });
    (101..=30_000).for_each(|n| history.push(f64::from(n) * 1e-3, &[0.0, f64::NAN, f64::NAN]));
    for (size, scale) in SIZES {
        let (picture, place) = drawn(&history, 0.1, size, scale);
        let corners = (place(0.0, 390.0), place(0.1, 60.0));
        let above_zero = [corners.0[0] + 2.0, corners.0[1], corners.1[0] - 2.0, corners.1[1]].map(|at| at as usize);
        let curve = picture.coloured(above_zero, COLOURS[0], 110);
        assert!(curve.is_empty(), "{size:?}: {curve:?}");
        let green = |time: f64| {
            let [x, y] = place(time, 200.0);
            picture.at(x as usize, y as usize)[1]
        };
        assert!(green(0.048) < green(0.02) - 30, "{size:?}: the range of the touch");
        assert!(green(0.09).abs_diff(green(0.02)) < 5, "{size:?}: no touch");
    }
}

#[test]
fn lines_are_split_at_sharp_corners() {
    let points = [(0.0, 0.0), (1.0, 0.1), (1.0, 0.1), (2.0, 0.0), (2.5, 50.0), (3.0, 0.0), (4.0, 0.0)];
    let parts = parts(points.into_iter().map(|(x, y)| pos2(x, y)));
    let ends: Vec<usize> = parts.iter().map(Vec::len).collect();
    assert_eq!(ends, [3, 2, 2, 2]);
}
