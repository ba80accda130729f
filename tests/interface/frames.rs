//! Golden frames: what `jointplay render` draws, pixel for pixel, against `tests/golden/`.
//!
//! `UPDATE_GOLDEN=1 cargo test --test interface frames::` draws them anew; look at each before committing it. A failure leaves
//! `<name>.actual.png` and `<name>.diff.png` (differing pixels red) beside the golden frame.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value as Json;

/// Distance of a colour channel, of 255, from which a pixel counts as different, and how many may.
///
/// The one tolerance of all frames: another processor or driver rounds some tens of pixels along edges otherwise; the
/// least of the things drawn, an arrow, covers hundreds.
const TOLERANCE: (u8, usize) = (24, 120);

fn jointplay(folder: &Path, line: &str) -> Output {
    let output = Command::new(env!("CARGO_BIN_EXE_jointplay"))
        .args(line.split_whitespace())
        .current_dir(folder)
        .env_remove("RUST_LOG")
        .output()
        .expect("the program starts");
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

/// Draws one frame into `folder`/frames and returns its file.
pub fn draw(folder: &Path, what: &str) -> PathBuf {
    jointplay(folder, &format!("render {what} --out frames --quiet --force"));
    folder.join("frames/frame_00000.png")
}

/// A picture without its opacity.
pub struct Picture {
    size: [u32; 2],
    rgb: Vec<u8>,
}

impl Picture {
    pub fn read(path: &Path) -> Self {
        let file = fs::File::open(path).unwrap_or_else(|error| {
            panic!("{}: {error}; UPDATE_GOLDEN=1 cargo test --test interface frames::", path.display())
        });
        let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().expect("a PNG file");
        let mut pixels = vec![0; reader.output_buffer_size().expect("it fits")];
        let info = reader.next_frame(&mut pixels).expect("a PNG file");
        let rgb = match info.color_type {
            png::ColorType::Rgb => pixels,
            _ => pixels.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect(),
        };
        Self { size: [info.width, info.height], rgb }
    }

    /// Small, for golden frames live in the history for ever: without the lowest three bits, which hold the noise that
    /// keeps gradients from banding.
    fn write(&self, path: &Path) {
        let coarse: Vec<u8> = self.rgb.iter().map(|c| c & !7 | 4).collect();
        let file = fs::File::create(path).expect("writable");
        let mut encoder = png::Encoder::new(file, self.size[0], self.size[1]);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_compression(png::Compression::High);
        let mut writer = encoder.write_header().expect("writable");
        writer.write_image_data(&coarse).expect("writable");
        writer.finish().expect("writable");
    }

    /// Which pixels differ from `other`'s, which has the same size.
    fn differing(&self, other: &Self) -> Vec<bool> {
        let far = |(a, b): (&u8, &u8)| a.abs_diff(*b) > TOLERANCE.0;
        self.rgb.chunks_exact(3).zip(other.rgb.chunks_exact(3)).map(|(a, b)| a.iter().zip(b).any(far)).collect()
    }

    /// The picture, faded, with the marked pixels red.
    fn marked(&self, marks: &[bool]) -> Self {
        let pixel = |(p, mark): (&[u8], &bool)| match mark {
            true => [220, 0, 0],
            false => [p[0], p[1], p[2]].map(|c| 170 + c / 3),
        };
        Self { size: self.size, rgb: self.rgb.chunks_exact(3).zip(marks).flat_map(pixel).collect() }
    }
}

/// Why `actual` is not `golden`; and where, if they have the same size.
fn objection(actual: &Picture, golden: &Picture) -> Option<(String, Option<Picture>)> {
    if actual.size != golden.size {
        let text = format!("{:?} pixels instead of {:?}", actual.size, golden.size);
        return Some((text, None));
    }
    let marks = actual.differing(golden);
    let count = marks.iter().filter(|mark| **mark).count();
    (count > TOLERANCE.1).then(|| {
        let text = format!("{count} pixels differ, allowed are {}", TOLERANCE.1);
        (text, Some(golden.marked(&marks)))
    })
}

#[track_caller]
fn golden(name: &str, what: &str) {
    let folder = tempfile::tempdir().expect("a scratch folder");
    let actual = Picture::read(&draw(folder.path(), what));
    let words = format!("jointplay render {what}");
    compare("tests/golden", name, &actual, &words);
}

/// Compares a picture with the one of that `name` in a `folder` of the repository; `what` says how it is made.
#[track_caller]
pub fn compare(folder: &str, name: &str, actual: &Picture, what: &str) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let golden = root.join(format!("{folder}/{name}.png"));
    let left = |ending: &str| root.join(format!("tests/golden/{name}.{ending}.png"));
    for stale in ["actual", "diff"] {
        let _ = fs::remove_file(left(stale));
    }
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        fs::create_dir_all(golden.parent().expect("has one")).expect("writable");
        actual.write(&golden);
        return;
    }
    if let Some((why, diff)) = objection(actual, &Picture::read(&golden)) {
        actual.write(&left("actual"));
        if let Some(diff) = diff {
            diff.write(&left("diff"));
        }
        panic!("{folder}/{name}.png: {why}; see tests/golden/{name}.actual.png and .diff.png ({what})");
    }
}

/// The default scene in the middle of its first impacts.
const IMPACT: &str = "spcmm --at 7.85ms --size 640x400 --magnification 20 --overlay";

/// Every built-in scene: its instant, and how much its play is magnified.
const SCENES: [(&str, &str, u32); 10] = [
    ("spcmm", "7.85ms", 20),
    ("pendulum", "0.1s", 1),
    ("slider-crank", "0.1s", 1),
    ("slider-crank-driven", "0.1s", 1),
    ("chain", "0.1s", 1),
    ("hexapod", "20ms", 10),
    ("delta", "20ms", 10),
    ("four-bar", "0.1s", 10),
    ("suspension", "0.1s", 10),
    ("press", "0.1s", 10),
];

/// Compares the pictures of every scene with these `options`, whose names have this `ending`.
fn every_scene(options: &str, ending: &str) {
    assert_eq!(SCENES.map(|(scene, ..)| scene), jointplay::scene::BUILT_IN);
    for (scene, instant, magnification) in SCENES {
        golden(
            &format!("{}{ending}", scene.replace('-', "_")),
            &format!("{scene} --at {instant} --magnification {magnification} {options}"),
        );
    }
}

#[test]
fn every_scene_is_drawn_as_it_was() {
    every_scene("--size 640x400 --overlay", "");
}

#[test]
fn every_scene_is_drawn_dark_as_it_was() {
    every_scene("--size 400x250 --theme dark", "_dark");
}

#[test]
fn spcmm_dark_near_a_ball_joint() {
    golden("spcmm_close_up_dark", "spcmm --at 7.85ms --size 480x300 --magnification 20 --close-up S1 --theme dark");
}

#[test]
fn spcmm_in_the_window() {
    golden("spcmm_window", "spcmm --at 7.85ms --size 800x500 --ui");
}

#[test]
fn what_is_missing_is_found() {
    let folder = tempfile::tempdir().expect("a scratch folder");
    let whole = Picture::read(&draw(folder.path(), IMPACT));
    assert!(objection(&whole, &whole).is_none());
    for less in ["--arrows none", "--hide sockets", "--hide names", "--set contact.clearance=0.1mm"] {
        let picture = Picture::read(&draw(folder.path(), &format!("{IMPACT} {less}")));
        let marks = whole.differing(&picture);
        let count = marks.iter().filter(|mark| **mark).count();
        assert!(count > 2 * TOLERANCE.1, "{less} changes {count} pixels only");
    }
}

#[test]
fn a_frame_has_the_same_bytes_each_time() {
    for what in [IMPACT, "pendulum --at 20ms --size 640x400 --ui"] {
        let folders = [(); 2].map(|()| tempfile::tempdir().expect("a scratch folder"));
        let [a, b] = folders.each_ref().map(|folder| fs::read(draw(folder.path(), what)).expect("written"));
        assert!(a == b, "{what}");
    }
}

/// A frame's hash is that of a run to the end of the step that contains it: with a fixed step the two take the same steps.
#[test]
fn the_manifest_has_the_state_that_a_run_reaches() {
    let folder = tempfile::tempdir().expect("a scratch folder");
    let scene = "spcmm --set solver.method=rk4 --set solver.step=10us";
    draw(folder.path(), &format!("{scene} --at 7.853ms,0s,7.85ms --size 64x64"));
    let manifest = fs::read(folder.path().join("frames/manifest.json")).expect("written");
    let manifest: Json = serde_json::from_slice(&manifest).expect("JSON");
    assert_eq!(manifest["scene"], "spcmm");
    assert_eq!(manifest["changed_parameters"]["solver.method"], "rk4");
    assert_eq!(manifest["parameters"]["contact.clearance"], "0.3 mm");
    let frames = manifest["frames"].as_array().expect("a list");
    let number = |frame: &Json, key: &str| frame[key].as_f64().expect("a number");
    let times: Vec<f64> = frames.iter().map(|f| number(f, "time_s")).collect();
    assert_eq!(times, [7.853e-3, 0.0, 7.85e-3], "numbered as given");
    for frame in frames {
        let end = number(frame, "state_time_s");
        assert!(end >= number(frame, "time_s") && end < number(frame, "time_s") + 10e-6);
        let run = jointplay(folder.path(), &format!("run {scene} --duration {end:e}s --summary json --quiet"));
        let run: Json = serde_json::from_slice(&run.stdout).expect("JSON");
        assert_eq!(frame["state_hash"], run["state_hash"], "at {end} s");
    }
}
