//! The list of impacts, its file, the badge at an impact, and the saved plots: all numbers agree with the run's records.

use eframe::egui::{self, Key};
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use jointplay::app::{App, AppOptions};
use jointplay::scene::Scene;
use jointplay::simulate::{Impact, Quantity};

use crate::hands::page::open;
use crate::hands::peaks_of_run;
use crate::hands::window::{click, shown, sized};

/// The impacts of a separate run of the same scene until `time`, s, in the order of their starts.
fn impacts_of_run(app: &App, time: f64) -> Vec<Impact> {
    peaks_of_run(app, time).into_iter().map(|(impact, _)| impact).collect()
}

/// The numbers in a text, in order.
fn numbers(text: &str) -> Vec<f64> {
    let digit = |c: char| c.is_ascii_digit() || c == '.' || c == '-';
    text.split(|c| !digit(c)).filter_map(|word| word.parse().ok()).collect()
}

fn is_close(actual: f64, expected: f64) -> bool {
    (actual / expected - 1.0).abs() < 6e-3
}

#[test]
fn the_list_shows_the_impacts_of_the_run_and_a_click_seeks_to_the_peak() {
    let mut harness = sized("spcmm", [1280.0, 800.0], egui::Theme::Light);
    harness.state_mut().player_mut().run_to(40e-3);
    harness.run();
    let impacts = impacts_of_run(harness.state(), 40e-3);
    assert!(impacts.len() > 9, "{}", impacts.len());
    let before = harness.state().player().simulation().state_hash();
    harness.key_press(Key::I);
    harness.run();
    assert!(harness.state().has_impact_list());
    // The latest impact is listed first.
    let names = ["S1", "S2", "S3"];
    for (at, impact) in impacts.iter().enumerate().rev().take(3) {
        let number = at + 1;
        let start = format!("Impact {number}, {}, ", names[impact.joint]);
        let row = harness.get_by_label_contains(&start);
        let words = row.accesskit_node().label().expect("a label");
        let rest = words.split_once(names[impact.joint]).expect("the joint").1;
        let displayed = numbers(rest);
        let expected = [
            impact.start * 1e3,
            (impact.end - impact.start) * 1e6,
            impact.peak,
            impact.approach_speed * 1e3,
            impact.separation_speed * 1e3,
            impact.achieved(),
            impact.law,
        ];
        assert_eq!(displayed.len(), expected.len(), "{words}");
        assert!(displayed.iter().zip(expected).all(|(a, b)| is_close(*a, b)), "{words}: {expected:?}");
        assert_eq!(words.contains("meanwhile"), impact.disturbed, "{words}");
    }
    assert_eq!(harness.state().player().simulation().state_hash(), before);
    let (_, peak) = *peaks_of_run(harness.state(), 40e-3).last().expect("some");
    harness.get_by_label_contains(&format!("Impact {}, ", impacts.len())).click();
    harness.run();
    assert_eq!(shown(&harness), peak);
    // The displayed instant is within this impact.
    let badge = harness.state().impact_badge().expect("a badge");
    assert!(badge.starts_with(&format!("Impact {}, ", impacts.len())), "{badge}");
}

#[test]
fn the_list_hides_neither_the_machine_nor_the_transport_and_closes_by_esc() {
    for (size, presents) in [
        ([1280.0, 800.0], false),
        ([1280.0, 720.0], true),
        ([800.0, 500.0], false),
        ([390.0, 844.0], false),
        ([844.0, 390.0], false),
    ] {
        let mut harness = sized("spcmm", size, egui::Theme::Light);
        harness.state_mut().player_mut().run_to(40e-3);
        harness.run();
        if presents {
            harness.key_press(Key::F5);
            harness.step();
            harness.set_size(egui::Vec2::from(size) / harness.ctx.zoom_factor());
            harness.run();
        }
        harness.key_press(Key::I);
        harness.run();
        let (view, bar) = (harness.get_by_label("3D view").rect(), harness.get_by_label("Transport bar").rect());
        let latest = format!("Impact {}, ", impacts_of_run(harness.state(), 40e-3).len());
        let row = harness.get_by_label_contains(&latest).rect();
        assert!(row.top() >= view.bottom() && row.top() < bar.top(), "{size:?}: {row:?}, {view:?}, {bar:?}");
        assert!(view.height() >= 60.0, "{size:?}: {view:?}");
        harness.key_press(Key::Escape);
        harness.run();
        assert!(!harness.state().has_impact_list());
        assert_eq!(harness.state().is_presenting(), presents, "Esc closes only the list");
    }
}

/// Numbers of the listed impacts from top to bottom.
fn listed(harness: &egui_kittest::Harness<'_, App>) -> Vec<usize> {
    let rows = harness.query_all_by_label_contains("Impact ");
    let rows = rows.filter_map(|row| {
        let words = row.accesskit_node().label()?;
        let number = words.strip_prefix("Impact ")?.split(',').next()?.parse().ok()?;
        Some((row.rect().top(), number))
    });
    let mut rows: Vec<(f32, usize)> = rows.collect();
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    rows.into_iter().map(|(_, number)| number).collect()
}

#[test]
fn the_list_sorts_by_every_column_both_ways() {
    let mut harness = sized("spcmm", [1600.0, 1000.0], egui::Theme::Light);
    harness.state_mut().player_mut().run_to(40e-3);
    harness.key_press(Key::I);
    harness.run();
    let impacts = impacts_of_run(harness.state(), 40e-3);
    type Column = (&'static str, fn(&Impact) -> f64);
    let columns: [Column; 8] = [
        ("Joint", |impact| impact.joint as f64),
        ("Time", |impact| impact.start),
        ("Duration", |impact| impact.end - impact.start),
        ("Peak", |impact| impact.peak),
        ("Approach", |impact| impact.approach_speed),
        ("Rebound", |impact| impact.separation_speed),
        ("Restitution", |impact| impact.achieved()),
        ("Undisturbed", |impact| impact.law),
    ];
    for (name, value) in columns {
        for falls in [true, false] {
            click(&mut harness, &format!("Sort by {name}"));
            harness.remove_cursor();
            harness.run();
            let shown: Vec<f64> = listed(&harness).into_iter().map(|number| value(&impacts[number - 1])).collect();
            assert!(shown.len() > 3, "{name}: {shown:?}");
            let in_order = |pair: &[f64]| if falls { pair[0] >= pair[1] } else { pair[0] <= pair[1] };
            assert!(shown.windows(2).all(in_order), "{name}: {shown:?}");
            let all = impacts.iter().map(value);
            let first = if falls { all.fold(f64::NEG_INFINITY, f64::max) } else { all.fold(f64::INFINITY, f64::min) };
            assert_eq!(shown[0], first, "{name}");
        }
    }
}

#[test]
fn the_hardest_impact_is_one_click_away() {
    let mut harness = sized("spcmm", [1600.0, 1000.0], egui::Theme::Light);
    harness.state_mut().player_mut().run_to(60e-3);
    harness.run();
    let peaks = peaks_of_run(harness.state(), 60e-3);
    let hardest = peaks.iter().max_by(|a, b| a.0.peak.total_cmp(&b.0.peak)).expect("impacts");
    let start = |harness: &mut egui_kittest::Harness<'_, App>| {
        harness.state_mut().show_instant(1e-3);
        harness.run();
    };
    start(&mut harness);
    click(&mut harness, "Hardest impact");
    assert_eq!(shown(&harness), hardest.1);
    let force = harness.state().player().frame().joints[hardest.0.joint].normal_force.norm();
    assert!(is_close(force, hardest.0.peak), "{force} N, {} N", hardest.0.peak);
    // From the list as well, whose button is the lower of the two; the plot's is below the list.
    start(&mut harness);
    harness.key_press(Key::I);
    harness.run();
    let buttons: Vec<_> = harness.query_all_by_label("Hardest impact").map(|node| node.rect()).collect();
    let upper = buttons.iter().min_by(|a, b| a.top().total_cmp(&b.top())).expect("two").center();
    assert_eq!(buttons.len(), 2);
    harness.drag_at(upper);
    harness.step();
    harness.drop_at(upper);
    harness.run();
    assert_eq!(shown(&harness), hardest.1);
}

#[test]
fn the_hardest_impact_comes_with_the_plots_around_it_and_a_double_click_leads_back() {
    let mut harness = sized("spcmm", [1600.0, 1000.0], egui::Theme::Light);
    harness.state_mut().player_mut().run_to(60e-3);
    harness.run();
    let x = |harness: &mut egui_kittest::Harness<'_, App>, time: f64| {
        let place = harness.state_mut().plots_mut().place(Quantity::NormalForce, time, 300.0);
        place.expect("a plot of the normal force")
    };
    let apart =
        |harness: &mut egui_kittest::Harness<'_, App>, time: f64| x(harness, time + 0.5e-3).x - x(harness, time).x;
    let peaks = peaks_of_run(harness.state(), 60e-3);
    let (impact, peak) = peaks.iter().max_by(|a, b| a.0.peak.total_cmp(&b.0.peak)).expect("impacts");
    let (peak, lasts) = (*peak, impact.end - impact.start);
    let before = apart(&mut harness, peak);
    click(&mut harness, "Hardest impact");
    assert_eq!(shown(&harness), peak);
    let plot = harness.get_by_label("Plot of Normal force").rect();
    let at = x(&mut harness, peak);
    assert!((at.x - plot.center().x).abs() < 0.1 * plot.width(), "{at} in {plot}");
    // The whole impact is in it, and wide enough to have a shape.
    let [left, right] = [peak - lasts, peak + lasts].map(|time| x(&mut harness, time).x);
    assert!(plot.left() < left && right < plot.right(), "{left} to {right} in {plot}");
    assert!(apart(&mut harness, peak) > 5.0 * before);
    harness.run_steps(60);
    harness.hover_at(at);
    harness.step();
    for _ in 0..2 {
        harness.drag_at(at);
        harness.step();
        harness.drop_at(at);
        harness.step();
    }
    harness.run();
    let after = apart(&mut harness, peak);
    assert!((after - before).abs() < 0.1 * before, "{after} {before}");
}

#[test]
fn plots_that_stand_still_in_the_past_are_fine_at_every_pace() {
    let mut harness = sized("spcmm", [1280.0, 800.0], egui::Theme::Light);
    // A run so long that only its end is kept in detail.
    harness.state_mut().player_mut().run_to(2.0);
    harness.run();
    harness.state_mut().show_instant(50e-3);
    harness.run();
    let instant = (shown(&harness), harness.state().player().simulation().state_hash());
    for (button, length) in [("Ten times slower", 10e-3), ("Ten times slower", 1e-3), ("Ten times faster", 10e-3)] {
        click(&mut harness, button);
        harness.run();
        let player = harness.state().player();
        assert!((player.automatic_window() / length - 1.0).abs() < 1e-9, "{}", player.automatic_window());
        // The plots show a quarter of their window after the instant.
        let range = [50e-3 - 0.75 * length, 50e-3 + 0.25 * length];
        let mut bins = Vec::new();
        let channel = player.channels().normal_force(0).expect("recorded");
        player.bins(channel, range[0], range[1], 2000, &mut bins);
        let inside = bins.iter().filter(|bin| bin.from >= range[0] && bin.to <= range[1]);
        let widest = inside.map(|bin| bin.to - bin.from).fold(0.0, f64::max);
        assert!(widest > 0.0 && widest <= (length / 400.0).max(2.1e-6), "{button}: {widest} of {length}");
        assert!(bins.last().is_some_and(|bin| bin.to >= range[1] - length / 100.0), "{button}: up to the end");
        assert_eq!((shown(&harness), player.simulation().state_hash()), instant, "{button}");
    }
}

#[test]
fn a_cut_peak_leads_to_its_instant() {
    let mut harness = sized("hexapod", [1280.0, 800.0], egui::Theme::Light);
    harness.state_mut().player_mut().run_to(0.2);
    harness.state_mut().plots_mut().window = jointplay::app::PlotWindow::Everything;
    harness.run();
    let note = harness.get_by_label_contains(" above in Normal force");
    let told = numbers(&note.accesskit_node().label().expect("a label"))[0];
    note.click();
    harness.run();
    let peaks = peaks_of_run(harness.state(), 0.2);
    let (impact, _) = peaks.iter().find(|(_, time)| *time == shown(&harness)).expect("at the peak of an impact");
    assert!(is_close(impact.peak, told), "{} N, told {told} N", impact.peak);
}

#[test]
fn the_badge_at_an_impact_shows_the_recorded_values() {
    for presenting in [false, true] {
        let mut harness = sized("spcmm", [1280.0, 720.0], egui::Theme::Light);
        if presenting {
            harness.key_press(Key::F5);
            harness.step();
        }
        assert_eq!(harness.state().impact_badge(), None);
        harness.key_press(Key::Period);
        harness.step();
        while harness.state().player().is_seeking() {
            harness.step();
        }
        harness.run();
        let badge = harness.state().impact_badge().expect("stands at an impact");
        harness.get_by_label(&badge);
        let (impact, peak) = peaks_of_run(harness.state(), 9e-3)[0];
        // The displayed frame has the impact's peak force.
        assert_eq!(shown(&harness), peak);
        let force = harness.state().player().frame().joints[0].normal_force.norm();
        assert!(is_close(force, impact.peak), "{force} N, {} N", impact.peak);
        assert!(badge.starts_with("Impact 1, S1: 7.80"), "{badge}");
        let displayed = numbers(badge.split_once(": ").expect("numbers").1);
        let expected = [
            impact.start * 1e3,
            impact.peak,
            (impact.end - impact.start) * 1e6,
            impact.approach_speed * 1e3,
            impact.separation_speed * 1e3,
        ];
        assert_eq!(displayed.len(), 5, "{badge}");
        assert!(displayed.iter().zip(expected).all(|(a, b)| is_close(*a, b)), "{badge}: {expected:?}");
        harness.key_press(Key::Space);
        harness.step();
        assert_eq!(harness.state().impact_badge(), None, "not while time passes");
    }
}

#[test]
fn the_file_has_the_columns_and_values_of_the_command_line() {
    let scene = Scene::load("spcmm", &[]).expect("built in");
    let options = AppOptions { playing: false, ..AppOptions::new(scene) };
    let (mut harness, calls) = open(options, [1280.0, 800.0]);
    harness.state_mut().player_mut().run_to(30e-3);
    // Going back and forth does not duplicate impacts.
    harness.state_mut().player_mut().go_to(10e-3);
    harness.state_mut().player_mut().go_to(30e-3);
    harness.run();
    click(&mut harness, "Save");
    click(&mut harness, "Impacts…");
    let saved = calls.borrow().saved.clone();
    assert!(saved[0].name.ends_with("-impacts.csv") && saved[1].name.ends_with(".meta.json"));
    let meta = String::from_utf8(saved[1].bytes.clone()).expect("text");
    assert!(meta.contains("\"sites\"") && meta.contains("\"ball_joints\""), "the places of the column `site`: {meta}");
    let text = String::from_utf8(saved[0].bytes.clone()).expect("text");
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    assert_eq!(header[..3], ["joint", "start_s", "end_s"]);
    let rows: Vec<Vec<f64>> =
        lines.map(|line| line.split(',').map(|value| value.parse().expect("a number")).collect()).collect();
    let expected = impacts_of_run(harness.state(), shown(&harness));
    assert_eq!(rows.len(), expected.len());
    for (row, impact) in rows.iter().zip(&expected) {
        let expected = jointplay::analysis::impact_row::row(impact);
        assert_eq!(row[..], expected[..]);
    }
}

#[test]
fn the_displayed_plots_are_saved_as_svg_and_png() {
    let scene = Scene::load("spcmm", &[]).expect("built in");
    let options = AppOptions { playing: false, ..AppOptions::new(scene) };
    let (mut harness, calls) = open(options, [1280.0, 800.0]);
    harness.state_mut().plots_mut().chosen = vec![Quantity::NormalForce, Quantity::Eccentricity];
    harness.state_mut().player_mut().run_to(20e-3);
    harness.run();
    for format in ["Plots as SVG", "Plots as PNG"] {
        click(&mut harness, "Save");
        click(&mut harness, format);
    }
    let saved = calls.borrow().saved.clone();
    let [svg, png] = &saved[..] else { panic!("{} files", saved.len()) };
    assert!(svg.name.ends_with("-plots.svg") && svg.mime == "image/svg+xml");
    let text = String::from_utf8(svg.bytes.clone()).expect("text");
    assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"));
    for word in ["Normal force", "Eccentricity", "S1", "S3", "clearance", "state hash"] {
        assert!(text.contains(word), "{word}");
    }
    // The drawing has a line for each curve.
    assert!(text.matches("<polyline").count() >= 6, "{}", text.matches("<polyline").count());
    assert!(png.name.ends_with("-plots.png") && png.mime == "image/png");
    assert!(png.bytes.starts_with(b"\x89PNG"));
    if let Some(keep) = std::env::var_os("KEEP_PICTURES") {
        for file in &saved {
            let ending = file.name.rsplit('.').next().expect("an ending");
            std::fs::write(std::path::Path::new(&keep).join(format!("plots.{ending}")), &file.bytes).expect("writable");
        }
    }
}

#[test]
fn playing_backwards_marks_the_peaks_before_the_displayed_instant() {
    let mut harness = sized("spcmm", [1280.0, 800.0], egui::Theme::Light);
    harness.state_mut().player_mut().run_to(30e-3);
    harness.state_mut().player_mut().pacer.set_scale(0.005);
    harness.run();
    let peaks = peaks_of_run(harness.state(), 31e-3);
    harness.key_press(Key::J);
    harness.step();
    let mut marked = std::collections::BTreeSet::new();
    while shown(&harness) > 7e-3 {
        let now = shown(&harness);
        for (joint, force, age) in harness.state().peak_marks() {
            let matches = |(impact, peak): &&(Impact, f64)| impact.joint == joint && (peak - (now - age)).abs() < 1e-9;
            let (impact, peak) = peaks.iter().find(matches).unwrap_or_else(|| panic!("none at {} s", now - age));
            assert!(*peak <= now && is_close(f64::from(force), impact.peak), "{force} N at {now} s");
            marked.insert((joint, impact.start.to_bits()));
        }
        harness.step();
        assert!(harness.state().player().is_playing_backwards());
    }
    assert!(marked.len() > 6, "{}", marked.len());
}
