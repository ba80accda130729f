//! Charts: the same description gives the same picture, for any content.

use jointplay::chart::{Axis, Chart, Label, Level, Marker, PALETTE, Scale, Series, Sheet};

fn axis(label: &str, unit: &str, scale: Scale) -> Axis {
    Axis { scale, ..Axis::new(label, unit) }
}

fn series(label: &str, points: Vec<(f64, f64)>, n: usize) -> Series {
    let markers = [
        Marker::Disc,
        Marker::Square,
        Marker::Triangle,
        Marker::TriangleDown,
        Marker::Diamond,
        Marker::Cross,
        Marker::Plus,
        Marker::Ring,
    ];
    Series::line(label, points, PALETTE[n % PALETTE.len()]).marked(markers[n])
}

fn sheet(size: (u32, u32)) -> Sheet {
    let line = |n: usize| {
        let point = |k: i32| (0.1 * f64::from(k), (f64::from(k) * 0.3 + n as f64).sin());
        (0..60).map(point).collect()
    };
    let linear = Chart {
        title: "Phase portrait".to_owned(),
        x: axis("Eccentricity", "mm", Scale::Linear),
        y: axis("Speed", "m/s", Scale::Linear),
        series: (0..8).map(|n| series(&format!("a < b & {n}"), line(n), n)).collect(),
        labels: vec![Label { at: (2.0, 0.5), text: "\"here\" & there".to_owned() }],
        levels: vec![Level { y: 0.25, text: "level".to_owned() }],
    };
    let broken = vec![(1e-3, 1e-9), (1e-2, f64::NAN), (1e-1, 0.0), (f64::INFINITY, 1.0), (1.0, 1e-2), (10.0, 1.0)];
    let log = Chart {
        title: "Error".to_owned(),
        x: axis("Time", "s", Scale::Logarithmic),
        y: axis("Error", "", Scale::Logarithmic),
        series: vec![series("broken", broken, 1), series("empty", Vec::new(), 2)],
        ..Chart::default()
    };
    Sheet {
        title: "Two charts".to_owned(),
        charts: vec![linear, log],
        columns: 2,
        size,
        note: "a note".to_owned(),
        separate_legends: false,
    }
}

#[test]
fn svg_and_picture_depend_only_on_the_description() {
    let sheet = sheet((900, 420));
    let svg = sheet.svg().unwrap();
    assert_eq!(svg, sheet.svg().unwrap());
    assert!(svg.starts_with("<svg width=\"900\" height=\"420\""), "{}", &svg[..80]);
    // Text stays text, escaped where it must be.
    for word in ["a &lt; b &amp; 3", "Phase portrait", "Eccentricity (mm)", "broken", "10⁻⁶"] {
        assert!(svg.contains(word), "{word}");
    }
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
    let png = sheet.png(1.5).unwrap();
    assert_eq!(png, sheet.png(1.5).unwrap());
    let edge = |at: usize| u32::from_be_bytes(png[at..at + 4].try_into().unwrap());
    assert_eq!((edge(16), edge(20)), (1350, 630));
}

/// The page of a PDF: its media box, and its drawing operators.
fn page(pdf: &[u8]) -> (String, String) {
    let find = |from: usize, word: &str| {
        let at = pdf[from..].windows(word.len()).position(|part| part == word.as_bytes());
        from + at.unwrap_or_else(|| panic!("no {word}"))
    };
    let size = find(0, "/MediaBox");
    let start = find(0, "stream\n") + "stream\n".len();
    let end = find(start, "\nendstream");
    let drawing = miniz_oxide::inflate::decompress_to_vec_zlib(&pdf[start..end]).expect("a complete stream");
    let size = String::from_utf8_lossy(&pdf[size..find(size, "]") + 1]).into_owned();
    (size, String::from_utf8(drawing).expect("operators"))
}

#[test]
fn a_pdf_has_every_line_marker_and_letter_of_the_svg() {
    let sheet = sheet((900, 420));
    let pdf = sheet.pdf().unwrap();
    assert_eq!(pdf, sheet.pdf().unwrap());
    let (size, drawing) = page(&pdf);
    assert_eq!(size, "/MediaBox [0 0 675 315]");
    let operations = |drawing: &str, word: &str| drawing.split_whitespace().filter(|part| *part == word).count();
    let svg = sheet.svg().unwrap();
    let points =
        |element: &str| element.split_once("points=\"").map_or(2, |(_, list)| list.split_whitespace().count() - 1);
    let elements: Vec<&str> = svg.split('<').collect();
    // A line with a single point is not drawn.
    let lines = elements.iter().filter(|element| element.contains("stroke=\"#") && points(element) > 1).count();
    assert_eq!(operations(&drawing, "S"), lines);
    let filled = elements.iter().filter(|element| element.contains("fill=\"#")).count();
    // A text in two fonts has several outlines. Five of the markers are filled, at 60 points each.
    assert!(operations(&drawing, "f") >= filled && filled > 300, "{} {filled}", operations(&drawing, "f"));
    // Nothing is outside the page, and every colour is used.
    let (mut words, mut colours) = (Vec::new(), Vec::new());
    for word in drawing.split_whitespace() {
        match word.parse::<f64>() {
            Ok(number) => words.push(number),
            Err(_) => {
                match word {
                    "m" | "l" | "c" => {
                        let inside =
                            words.chunks(2).all(|at| (0.0..=675.0).contains(&at[0]) && (0.0..=315.0).contains(&at[1]));
                        assert!(inside, "{words:?} {word}");
                    }
                    "RG" | "rg" => colours.push(words.clone()),
                    _ => {}
                }
                words.clear();
            }
        }
    }
    for (r, g, b) in PALETTE {
        let parts = [r, g, b].map(|part| f64::from(part) / 255.0);
        let near = |other: &Vec<f64>| other.iter().zip(parts).all(|(a, b)| (a - b).abs() < 1e-3);
        assert!(colours.iter().any(near), "{r} {g} {b}");
    }
    // Each letter has its own outline; a missing glyph would be empty.
    let with = |title: &str| page(&Sheet { title: title.to_owned(), ..sheet.clone() }.pdf().unwrap()).1;
    let (nothing, plain) = (with(""), with("o"));
    for letter in ["²", "µ", "·", "Δ", "ε", "°", "⁻", "−"] {
        let content = with(letter);
        assert!(content != plain && operations(&content, "f") == operations(&nothing, "f") + 1, "{letter}");
    }
}

#[test]
fn characters_that_xml_cannot_hold_are_escaped() {
    let mut sheet = sheet((600, 300));
    sheet.title = "</text><script>\u{1b}]0;x\u{7}\u{202e}".to_owned();
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
        title: String::new(),
        charts: vec![Chart { series: vec![series], ..Chart::default() }],
        columns: 1,
        size: (600, 400),
        note: String::new(),
        separate_legends: false,
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
        title: String::new(),
        note: String::new(),
        separate_legends: false,
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
