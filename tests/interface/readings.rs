//! The tooltip of a plot, and its spoken text.

use eframe::egui::{
    self, Key, Shape,
    accesskit::{Live, Role},
};
use egui_kittest::{
    Harness,
    kittest::{NodeT as _, Queryable as _},
};
use jointplay::app::{App, PlotWindow};
use jointplay::scene::LiveScene;
use jointplay::simulate::{Frame, Quantity};

use crate::hands::add_texts;
use crate::hands::window::sized;

/// Collects all texts of several lines on the screen.
fn collect_tooltips(shape: &Shape, out: &mut Vec<String>) {
    match shape {
        Shape::Vec(shapes) => shapes.iter().for_each(|shape| collect_tooltips(shape, out)),
        Shape::Text(text) if text.galley.text().contains('\n') => out.push(text.galley.text().to_owned()),
        _ => {}
    }
}

/// The tooltip of the plot of `quantity` at `value` and `time`, s: the time, s, and for each member the least and the greatest
/// value, in the unit of the axis.
fn read_tooltip(
    harness: &mut Harness<'_, App>,
    quantity: Quantity,
    time: f64,
    value: f64,
) -> (f64, Vec<(String, [f64; 2])>) {
    let at = harness.state_mut().plots_mut().place(quantity, time, value).expect("on show");
    harness.hover_at(at);
    harness.run_steps(4);
    let mut texts = Vec::new();
    for part in &harness.output().shapes {
        collect_tooltips(&part.shape, &mut texts);
    }
    let text = texts.iter().find(|text| text.contains("\nS1 ")).unwrap_or_else(|| panic!("no tooltip: {texts:?}"));
    let mut lines = text.lines();
    let numbers = |line: &str| -> Vec<f64> { line.split_whitespace().filter_map(|word| word.parse().ok()).collect() };
    let first = lines.next().expect("the time");
    assert!(first.ends_with(" ms"), "{text}");
    let members = lines.map(|line| {
        let (name, rest) = line.split_once(' ').expect("a name");
        let values = numbers(rest);
        (name.to_owned(), [values[0], *values.last().expect("a value")])
    });
    (numbers(first)[0] * 1e-3, members.collect())
}

#[test]
fn tooltips_have_the_values_of_the_run() {
    let mut harness = sized("spcmm", [1280.0, 800.0], egui::Theme::Light);
    harness.state_mut().plots_mut().chosen = vec![Quantity::NormalForce, Quantity::Eccentricity];
    harness.state_mut().player_mut().pacer.set_scale(1e-3);
    harness.state_mut().player_mut().run_to(8.5e-3);
    harness.run();
    let mut simulation = LiveScene::new(harness.state().player().running()).expect("starts");
    let mut sample = |time: f64| {
        let mut frame = Frame::default();
        simulation.reset().expect("starts");
        while simulation.time() < time {
            simulation.step().expect("runs");
        }
        simulation.sample(time, &mut frame);
        frame
    };
    let mut checked = 0;
    // In free fall, and near the peak of the first impact.
    for (quantity, time) in
        [(Quantity::Eccentricity, 5e-3), (Quantity::Eccentricity, 6.5e-3), (Quantity::NormalForce, 7.87e-3)]
    {
        let value = |frame: &Frame, joint: usize| match quantity {
            Quantity::Eccentricity => frame.joints[joint].eccentricity.norm() * 1e3,
            _ => frame.joints[joint].normal_force.norm(),
        };
        let pointer_value = value(&sample(time), 0) * if quantity == Quantity::Eccentricity { 1e-3 } else { 1.0 };
        let (at, members) = read_tooltip(&mut harness, quantity, time, pointer_value);
        assert!((at - time).abs() < 0.05e-3, "{at} {time}");
        let frame = sample(at);
        assert_eq!(members.len(), 3);
        for (joint, (name, [least, greatest])) in members.into_iter().enumerate() {
            assert_eq!(name, format!("S{}", joint + 1));
            let run = value(&frame, joint);
            assert!(run > 0.99 * least && run < 1.01 * greatest, "{name} at {at}: {least} to {greatest}, {run}");
            // Only narrow ranges count: a wide one would contain any value.
            checked += usize::from(greatest < 1.015 * least);
        }
    }
    assert!(checked >= 7, "{checked}");

    // By keyboard: the spoken text is that of the tooltip, at its instant.
    harness.remove_cursor();
    harness.get_by_role_and_label(Role::Image, "Plot of Normal force").focus();
    harness.run_steps(2);
    let mut times = Vec::new();
    for _ in 0..4 {
        harness.key_press(Key::ArrowLeft);
        harness.run_steps(4);
        let mut images = harness.query_all_by_role(Role::Image);
        let plot = images.find(|node| node.accesskit_node().is_focused()).expect("has the focus");
        assert_eq!(plot.accesskit_node().live(), Live::Polite);
        let spoken = plot.accesskit_node().label().expect("a label with the values");
        let mut texts = Vec::new();
        harness.output().shapes.iter().for_each(|part| collect_tooltips(&part.shape, &mut texts));
        let [text] = &texts[..] else { panic!("{spoken}: {texts:?}, {times:?}") };
        let (time, values) = text.split_once('\n').expect("values below the time");
        let words = format!("{} at {time}", values.replace('\n', ", "));
        assert_eq!(spoken, words.replace(" N", " newtons").replace(" ms", " milliseconds"));
        let at = time.split(' ').next().and_then(|at| at.parse::<f64>().ok()).expect("a time");
        let frame = sample(1e-3 * at);
        let first = values.lines().next().expect("S1").split(' ').filter_map(|word| word.parse::<f64>().ok());
        let range = first.fold((f64::INFINITY, 0.0_f64), |all, v| (all.0.min(v), all.1.max(v)));
        let run = frame.joints[0].normal_force.norm();
        assert!(run >= 0.98 * range.0 && run <= 1.02 * range.1, "{text}: {run}");
        times.push(at);
    }
    assert!(times.windows(2).all(|pair| pair[1] < pair[0]), "{times:?}");
}

#[test]
fn high_first_peaks_are_cut_from_a_plot_of_forces_and_their_height_is_displayed() {
    let mut harness = sized("hexapod", [1280.0, 800.0], egui::Theme::Light);
    harness.state_mut().player_mut().run_to(0.2);
    harness.state_mut().plots_mut().window = PlotWindow::Everything;
    harness.run();
    let player = harness.state().player();
    let mut largest = [0.0_f64; 2];
    let forces = player.channels().list().iter().enumerate().filter(|(_, own)| own.quantity == Quantity::NormalForce);
    for (channel, _) in forces {
        let mut bins = Vec::new();
        player.bins(channel, 0.0, 0.2, 1000, &mut bins);
        for bin in bins {
            let part = &mut largest[usize::from(bin.from > 0.05)];
            *part = part.max(bin.greatest);
        }
    }
    let [first, later] = largest;
    assert!(first > 4.0 * later && later > 1.0, "{first} N, {later} N");
    // Height of a force above the upper edge of the plot, points.
    let above = |harness: &mut Harness<'_, App>, force: f64| {
        let top = harness.get_by_label("Plot of Normal force").rect().top();
        top - harness.state_mut().plots_mut().place(Quantity::NormalForce, 0.1, force).expect("on show").y
    };
    assert!(above(&mut harness, first) > 0.0 && above(&mut harness, later) < 0.0);
    let mut texts = String::new();
    for part in &harness.output().shapes {
        add_texts(&part.shape, egui::Rect::EVERYTHING, &mut texts);
    }
    let words = texts.lines().find(|text| text.ends_with(" N above")).expect("the height of the cut peaks");
    let displayed: f64 = words.split_whitespace().nth(1).and_then(|word| word.parse().ok()).expect("a number");
    assert!((displayed / first - 1.0).abs() < 5.1e-3, "{words}: {first} N");
    let toggle = |harness: &Harness<'_, App>| harness.get_by_label("Whole first peaks in Normal force").click();
    toggle(&harness);
    harness.run();
    assert!(above(&mut harness, first) < 0.0, "the plot lacks the whole range");
    toggle(&harness);
    harness.run();
    assert!(above(&mut harness, first) > 0.0);
}
