//! The pictures of `docs/scene-tutorial.md` and `docs/scene-format.md`: every complete example has one, and each agrees with the program.
//!
//! `UPDATE_GOLDEN=1 cargo test --test interface pictures::` redraws them; look at each before committing it.

use std::fs;
use std::path::Path;

use jointplay::chart::{Axis, Chart, PALETTE, Series, Sheet};
use jointplay::scene::Scene;
use jointplay::simulate::{Frame, Simulation};

use crate::golden::{Picture, compare, draw};

const FOLDER: &str = "docs/pictures";
const SIZE: (u32, u32) = (512, 320);
/// Limit of file sizes, bytes.
const MAX_SIZE: u64 = 40_000;

/// Name of the picture of the laws.
const LAWS: &str = "drives";

/// Instants of pictures other than 0.1 s.
const INSTANTS: [(&str, &str); 4] = [("shapes", "0s"), ("joints", "0s"), ("crank", "25ms"), ("flap", "25ms")];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Both pages.
fn page() -> String {
    let read = |name| fs::read_to_string(root().join("docs").join(name)).expect("the page");
    read("scene-tutorial.md") + &read("scene-format.md")
}

/// Name of the picture at the beginning of `text`, if any.
fn first_picture(text: &str) -> Option<&str> {
    let link = text.trim_start().strip_prefix("![")?;
    let (alternative, link) = link.split_once("](pictures/")?;
    assert!(!alternative.contains('\n') && alternative.len() > 10, "{alternative}");
    Some(link.split_once(".png)")?.0)
}

/// Names of all pictures of the page, in order.
fn all_pictures(page: &str) -> Vec<&str> {
    let places = page.match_indices("![");
    let names = places.map(|(at, _)| first_picture(&page[at..]).expect("a picture of its own folder"));
    names.collect()
}

/// The complete examples of the page with the names of their pictures.
fn examples(page: &str) -> Vec<(&str, &str)> {
    let blocks = page.split("```toml\n").skip(1);
    let pair = |rest| {
        let (text, after) = str::split_once(rest, "```").expect("an end");
        let name = first_picture(after);
        (name.unwrap_or_else(|| panic!("a picture follows\n{text}")), text)
    };
    blocks.map(pair).collect()
}

fn check(name: &str, file: &str) {
    let folder = tempfile::tempdir().expect("a scratch folder");
    let entry = INSTANTS.iter().find(|(scene, _)| *scene == name);
    let instant = entry.map_or("0.1s", |(_, instant)| instant);
    let (width, height) = SIZE;
    let arguments = format!("{file} --at {instant} --size {width}x{height} --arrows none --hide triad,flash,peaks");
    let actual = Picture::read(&draw(folder.path(), &arguments));
    compare(FOLDER, name, &actual, &format!("jointplay render {arguments}"));
}

#[test]
fn every_example_has_its_picture() {
    let page = page();
    let scratch = tempfile::tempdir().expect("a scratch folder");
    for (name, text) in examples(&page) {
        let file = scratch.path().join(format!("{name}.toml"));
        fs::write(&file, text).expect("writable");
        check(name, file.to_str().expect("UTF-8"));
    }
}

#[test]
fn pictures_of_the_scenes_in_the_folder_are_current() {
    for name in ["shapes", "joints"] {
        let file = root().join(format!("{FOLDER}/{name}.toml"));
        check(name, file.to_str().expect("UTF-8"));
    }
}

#[test]
fn every_picture_is_linked_once_and_small() {
    let page = page();
    let mut linked = all_pictures(&page);
    linked.sort_unstable();
    let files = fs::read_dir(root().join(FOLDER)).expect("a folder");
    let files = files.map(|file| file.expect("readable").path());
    let pictures = files.filter(|file| file.extension().is_some_and(|ending| ending == "png"));
    let mut names = Vec::new();
    for file in pictures {
        let size = fs::metadata(&file).expect("readable").len();
        assert!(size < MAX_SIZE, "{}: {size} bytes", file.display());
        let name = file.file_stem().and_then(|name| name.to_str());
        names.push(name.expect("UTF-8").to_owned());
    }
    names.sort_unstable();
    assert_eq!(names, linked);
    let drawn = examples(&page).into_iter().map(|(name, _)| name);
    let mut drawn: Vec<&str> = drawn.chain(["shapes", "joints", LAWS]).collect();
    drawn.sort_unstable();
    assert_eq!(drawn, linked, "each is drawn by a test");
}

/// Laws with their keys for a motion within a second.
const DRIVES: [(&str, &str); 7] = [
    ("constant", "velocity = \"60 mm/s\", position = \"-30 mm\""),
    ("harmonic", "amplitude = \"40 mm\", frequency = \"2 Hz\""),
    (
        "harmonics",
        "terms = [{ amplitude = \"30 mm\", frequency = \"1 Hz\" }, { amplitude = \"15 mm\", frequency = \"4 Hz\" }]",
    ),
    ("ramp", "from = \"-40 mm\", to = \"40 mm\", start = \"0.3 s\", duration = \"0.4 s\""),
    ("pulse", "height = \"50 mm\", start = \"0.25 s\", duration = \"0.5 s\""),
    (
        "table",
        "points = [[\"0 s\", \"-30 mm\"], [\"0.2 s\", \"30 mm\"], [\"0.5 s\", \"-10 mm\"], [\"0.8 s\", \"20 mm\"]]",
    ),
    ("formula", "formula = \"45 * sin(2*pi*5*t) * exp(-3*t)\", unit = \"mm\""),
];

/// The motion of a slide under a law over a second, from a run: s, mm.
fn motion(law: &str, keys: &str) -> Vec<(f64, f64)> {
    let text = format!(
        "[[body]]\nname = \"slide\"\nmass = \"1 kg\"\ninertia = \"1e-3 1e-3 1e-3 kg m^2\"\n\n\
         [[joint]]\nname = \"slide\"\nkind = \"prismatic\"\nchild = \"slide\"\naxis = [1, 0, 0]\n\
         drive = {{ law = \"{law}\", {keys} }}\n"
    );
    let scene = Scene::parse(&text, None, &[]).unwrap_or_else(|error| panic!("{error}"));
    let mut simulation = Simulation::new(&scene.machine).unwrap_or_else(|error| panic!("{error}"));
    let mut frame = Frame::default();
    let mut at = |k: i32| {
        let t = f64::from(k) / 200.0;
        simulation.advance_to(t).expect("it runs");
        simulation.sample(t, &mut frame);
        (t, 1e3 * frame.bodies[0].position.x)
    };
    (0..=200).map(&mut at).collect()
}

#[test]
fn the_laws_of_drives_are_drawn_as_curves() {
    let axis =
        |label: &str, unit: &str, range| Axis { label: label.to_owned(), unit: unit.to_owned(), range: Some(range) };
    let chart = |(n, (law, keys)): (usize, &(&str, &str))| Chart {
        title: (*law).to_owned(),
        x: axis("t", "s", (0.0, 1.0)),
        y: axis("q", "mm", (-55.0, 55.0)),
        series: vec![Series::line("", motion(law, keys), PALETTE[1 + n % (PALETTE.len() - 1)])],
    };
    let sheet = Sheet {
        charts: DRIVES.iter().enumerate().map(chart).collect(),
        columns: 3,
        size: (720, 480),
        note: String::new(),
    };
    let folder = tempfile::tempdir().expect("a scratch folder");
    let file = folder.path().join("drives.png");
    fs::write(&file, sheet.png(1.0).expect("a picture")).expect("writable");
    compare(FOLDER, LAWS, &Picture::read(&file), "the laws of drives as curves");
}
