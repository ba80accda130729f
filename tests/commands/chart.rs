//! Charts: the same description gives the same picture, for any content.

use jointplay::chart::{Axis, Chart, PALETTE, Series, Sheet};

fn series(label: &str, points: Vec<(f64, f64)>, n: usize) -> Series {
    Series::line(label, points, PALETTE[n])
}

fn sheet(size: (u32, u32)) -> Sheet {
    let line = |n: usize| {
        let point = |k: i32| (0.1 * f64::from(k), (f64::from(k) * 0.3 + n as f64).sin());
        (0..60).map(point).collect()
    };
    let lines = (0..8).map(|n| series(&format!("a < b & {n}"), line(n), n)).collect();
    let phases = Chart::new("Phase portrait", Axis::new("Eccentricity", "mm"), Axis::new("Speed", "m/s"), lines);
    let broken = vec![(1e-3, 1e-9), (1e-2, f64::NAN), (1e-1, 0.0), (f64::INFINITY, 1.0), (1.0, 1e-2), (10.0, 1.0)];
    let lines = vec![series("broken", broken, 1), series("empty", Vec::new(), 2)];
    let errors = Chart::new("Error", Axis::new("Time", "s"), Axis::new("Error", ""), lines);
    Sheet { charts: vec![phases, errors], columns: 2, size, note: "a note".to_owned() }
}

#[test]
fn svg_and_picture_depend_only_on_the_description() {
    let sheet = sheet((900, 420));
    let svg = sheet.svg().unwrap();
    assert_eq!(svg, sheet.svg().unwrap());
    assert!(svg.starts_with("<svg width=\"900\" height=\"420\""), "{}", &svg[..80]);
    // Text stays text, escaped where it must be.
    for word in ["a &lt; b &amp; 3", "Phase portrait", "Eccentricity (mm)", "broken"] {
        assert!(svg.contains(word), "{word}");
    }
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
    let png = sheet.png(1.5).unwrap();
    assert_eq!(png, sheet.png(1.5).unwrap());
    let edge = |at: usize| u32::from_be_bytes(png[at..at + 4].try_into().unwrap());
    assert_eq!((edge(16), edge(20)), (1350, 630));
}

#[test]
fn a_picture_has_every_colour_and_letter() {
    let sheet = sheet((900, 420));
    let svg = sheet.svg().unwrap();
    for (r, g, b) in PALETTE {
        assert!(svg.contains(&format!("#{r:02X}{g:02X}{b:02X}")), "{r} {g} {b}");
    }
    // A missing glyph would leave nothing, or the same box for all.
    let with = |title: &str| Sheet { note: title.to_owned(), ..sheet.clone() }.png(1.0).unwrap();
    let mut pictures = vec![with(""), with("\u{10ffff}")];
    for letter in ["o", "²", "µ", "·", "Δ", "ε", "°", "⁻", "−"] {
        let picture = with(letter);
        assert!(!pictures.contains(&picture), "{letter}");
        pictures.push(picture);
    }
}

#[test]
fn characters_that_xml_cannot_hold_are_escaped() {
    let mut sheet = sheet((600, 300));
    sheet.note = "</text><script>\u{1b}]0;x\u{7}\u{202e}".to_owned();
    let svg = sheet.svg().unwrap();
    assert!(svg.contains("&lt;/text&gt;&lt;script&gt;\\u001b]0;x\\u0007\\u202e"));
    assert!(!svg.chars().any(|c| c.is_control() && c != '\n'));
    sheet.png(1.0).unwrap();
}

#[test]
fn a_page_that_cannot_be_drawn_is_refused() {
    assert!(sheet((200, 100)).svg().is_err());
    assert!(sheet((900, 420)).png(0.0).is_err());
    assert!(sheet((900, 420)).png(1e6).is_err());
}

#[test]
fn a_hundred_thousand_points_produce_a_small_file() {
    let place = |k: i32| {
        let a = f64::from(k) * 1e-3;
        (a.sin(), (1.7 * a).cos())
    };
    let series = Series::line("", (0..100_000).map(place).collect(), PALETTE[1]);
    let sheet = Sheet {
        charts: vec![Chart { series: vec![series], ..Chart::default() }],
        columns: 1,
        size: (600, 400),
        note: String::new(),
    };
    let size = sheet.svg().unwrap().len();
    assert!(size < 200_000, "{size}");
}

/// Blue pixels (column, row) of a chart of `series`, drawn at twice its size.
fn blue_pixels(series: Series) -> Vec<(u32, u32)> {
    let axis = Axis { range: Some((0.0, 10.0)), ..Axis::default() };
    let sheet = Sheet {
        charts: vec![Chart { x: axis.clone(), y: axis, series: vec![series], ..Chart::default() }],
        columns: 1,
        size: (500, 400),
        note: String::new(),
    };
    let png = sheet.png(2.0).unwrap();
    let picture = resvg::tiny_skia::Pixmap::decode_png(&png).unwrap();
    let pixels = picture.pixels().iter().zip(0..).filter(|(p, _)| p.blue() > p.red().saturating_add(60));
    pixels.map(|(_, at)| (at % picture.width(), at / picture.width())).collect()
}

#[test]
fn a_line_does_not_overshoot_its_peak() {
    // The highest coloured row of a line through `points`.
    let top = |points: &[(f64, f64)]| blue_pixels(Series::line("", points.to_vec(), PALETTE[1]))[0].1;
    let level = top(&[(1.0, 8.0), (9.0, 8.0)]);
    for half in [0.2, 0.5, 0.8, 1.2, 2.0] {
        let peak = top(&[(5.0 - half, 3.0), (5.0, 8.0), (5.0 + half, 3.0)]);
        assert!(peak.abs_diff(level) <= 1, "{half}: {peak} {level}");
    }
}
