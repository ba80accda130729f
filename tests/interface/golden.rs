//! Stored pictures: their format and comparison.
//!
//! `UPDATE_GOLDEN=1 cargo test --test interface` updates all pictures and texts; look at each before committing it. A failure
//! leaves `<name>.actual.png` and `<name>.diff.png` (differing pixels red) in `tests/golden/`.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Difference of a colour channel, of 255, above which a pixel counts as different, and the allowed number of such pixels.
///
/// The single tolerance of all pictures: other processors and drivers round some tens of pixels along edges differently, while the
/// smallest object drawn, an arrow, covers hundreds.
pub const TOLERANCE: (u8, usize) = (24, 120);

/// Error of a colour channel from the palette of 256 colours, smaller than the tolerance.
const PALETTE_ERROR: u8 = 20;

/// Fixed steps of a simple method for everything stored, so that it does not depend on the step control of adaptive methods.
pub const PLAIN: [(&str, &str); 2] = [("solver.method", "rk4"), ("solver.step", "20 us")];

/// Squared distance of colours below which a palette merges them: that of the dither against banding.
const MERGE_DISTANCE: u32 = 32;

/// Whether pictures and texts are stored instead of compared.
pub fn storing() -> bool {
    std::env::var_os("UPDATE_GOLDEN").is_some()
}

/// A picture without its opacity.
pub struct Picture {
    size: [u32; 2],
    rgb: Vec<u8>,
}

impl Picture {
    /// From width and height in pixels and RGBA data.
    pub fn new(size: [u32; 2], rgba: &[u8]) -> Self {
        Self { size, rgb: rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect() }
    }

    pub fn read(path: &Path) -> Self {
        let file = fs::File::open(path)
            .unwrap_or_else(|error| panic!("{}: {error}; UPDATE_GOLDEN=1 stores it", path.display()));
        let mut decoder = png::Decoder::new(std::io::BufReader::new(file));
        decoder.set_transformations(png::Transformations::EXPAND);
        let mut reader = decoder.read_info().expect("a PNG file");
        let mut pixels = vec![0; reader.output_buffer_size().expect("it fits")];
        let info = reader.next_frame(&mut pixels).expect("a PNG file");
        let size = [info.width, info.height];
        match info.color_type {
            png::ColorType::Rgb => Self { size, rgb: pixels },
            _ => Self::new(size, &pixels),
        }
    }

    /// The picture at half its size: each pixel the mean of four.
    pub fn half(&self) -> Self {
        let [width, height] = self.size.map(|edge| edge / 2);
        let at = |x: u32, y: u32, part: usize| u32::from(self.rgb[3 * (y * self.size[0] + x) as usize + part]);
        let mean = |x: u32, y: u32, part| {
            let sum: u32 = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| at(2 * x + i, 2 * y + j, part)).iter().sum();
            (sum / 4) as u8
        };
        let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        Self { size: [width, height], rgb: places.flat_map(|(x, y)| [0, 1, 2].map(|part| mean(x, y, part))).collect() }
    }

    /// Writes the picture with a palette, since stored files stay in the history forever.
    pub fn write(&self, path: &Path) {
        let (palette, indices) = self.palette();
        let file = fs::File::create(path).expect("writable");
        let mut encoder = png::Encoder::new(file, self.size[0], self.size[1]);
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_palette(palette.concat());
        encoder.set_compression(png::Compression::High);
        encoder.set_filter(png::Filter::NoFilter);
        let mut writer = encoder.write_header().expect("writable");
        writer.write_image_data(&indices).expect("writable");
        writer.finish().expect("writable");
    }

    /// At most 256 of its colours, and the index of each pixel. The next colour is the one farthest from all before, with a slight
    /// preference for frequent ones, so that no pixel is far off, however rare its colour.
    fn palette(&self) -> (Vec<[u8; 3]>, Vec<u8>) {
        let distance_squared =
            |a: [u8; 3], b: [u8; 3]| -> u32 { [0, 1, 2].map(|i| u32::from(a[i].abs_diff(b[i])).pow(2)).iter().sum() };
        // For each colour: its number of pixels, the distance to the nearest palette colour, and that colour's index.
        let mut colours: BTreeMap<[u8; 3], (f64, u32, u8)> = BTreeMap::new();
        for colour in self.pixels() {
            colours.entry(colour).or_insert((0.0, u32::MAX, 0)).0 += 1.0;
        }
        let mut palette = Vec::new();
        for index in 0..=255 {
            let gain = |(count, distance, _): (f64, u32, u8)| count.sqrt().sqrt() * f64::from(distance);
            let others = colours.iter().filter(|(_, (_, distance, _))| *distance >= MERGE_DISTANCE);
            let Some((&next, _)) = others.max_by(|a, b| gain(*a.1).total_cmp(&gain(*b.1))) else {
                break;
            };
            palette.push(next);
            for (colour, (_, distance, nearest)) in &mut colours {
                let new_distance = distance_squared(*colour, next);
                if new_distance < *distance {
                    (*distance, *nearest) = (new_distance, index);
                }
            }
        }
        let indices = self.pixels().map(|colour| colours[&colour].2).collect();
        (palette, indices)
    }

    fn pixels(&self) -> impl Iterator<Item = [u8; 3]> {
        self.rgb.chunks_exact(3).map(|p| [p[0], p[1], p[2]])
    }

    /// Marks the pixels that differ by more than `most` from those of `other`, which has the same size.
    fn differing(&self, other: &Self, most: u8) -> Vec<bool> {
        let far = |(a, b): (&u8, &u8)| a.abs_diff(*b) > most;
        self.rgb.chunks_exact(3).zip(other.rgb.chunks_exact(3)).map(|(a, b)| a.iter().zip(b).any(far)).collect()
    }

    /// Number of pixels that differ from those of `other`, which has the same size.
    pub fn differences(&self, other: &Self) -> usize {
        self.differing(other, TOLERANCE.0).into_iter().filter(|mark| *mark).count()
    }

    /// The picture, faded, with the marked pixels red.
    fn marked(&self, marks: &[bool]) -> Self {
        let pixel = |(p, mark): ([u8; 3], &bool)| if *mark { [220, 0, 0] } else { p.map(|c| 170 + c / 3) };
        Self { size: self.size, rgb: self.pixels().zip(marks).flat_map(pixel).collect() }
    }
}

/// Difference of `actual` from `golden`, if any, with a picture of it if both have the same size.
pub fn picture_mismatch(actual: &Picture, golden: &Picture) -> Option<(String, Option<Picture>)> {
    if actual.size != golden.size {
        let text = format!("{:?} pixels instead of {:?}", actual.size, golden.size);
        return Some((text, None));
    }
    let marks = actual.differing(golden, TOLERANCE.0);
    let count = marks.iter().filter(|mark| **mark).count();
    (count > TOLERANCE.1).then(|| {
        let text = format!("{count} pixels differ, allowed are {}", TOLERANCE.1);
        (text, Some(golden.marked(&marks)))
    })
}

/// Compares a picture with the stored one `name` in `folder` of the repository; `source` describes how it is made.
#[track_caller]
pub fn compare(folder: &str, name: &str, actual: &Picture, source: &str) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let golden = root.join(format!("{folder}/{name}.png"));
    let output = |ending: &str| root.join(format!("tests/golden/{name}.{ending}.png"));
    for stale in ["actual", "diff"] {
        let _ = fs::remove_file(output(stale));
    }
    if storing() {
        fs::create_dir_all(golden.parent().expect("has one")).expect("writable");
        actual.write(&golden);
        let differing = actual.differing(&Picture::read(&golden), PALETTE_ERROR);
        assert!(!differing.contains(&true), "{folder}/{name}.png: too many colours for a palette");
        return;
    }
    if let Some((why, diff)) = picture_mismatch(actual, &Picture::read(&golden)) {
        actual.write(&output("actual"));
        if let Some(diff) = diff {
            diff.write(&output("diff"));
        }
        panic!("{folder}/{name}.png: {why}; see tests/golden/{name}.actual.png and .diff.png ({source})");
    }
}

pub fn jointplay(folder: &Path, line: &str) -> Output {
    let output = Command::new(env!("CARGO_BIN_EXE_jointplay"))
        .args(line.split_whitespace())
        .current_dir(folder)
        .env_remove("RUST_LOG")
        .output()
        .expect("the program starts");
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

/// Options that set [`PLAIN`] steps.
pub fn plain() -> String {
    PLAIN.map(|(key, value)| format!("--set {key}={}", value.replace(' ', ""))).join(" ")
}

/// Draws one frame by [`PLAIN`] steps into `folder`/frames and returns its file.
pub fn draw(folder: &Path, arguments: &str) -> PathBuf {
    jointplay(folder, &format!("render {arguments} {} --out frames --quiet --force", plain()));
    folder.join("frames/frame_00000.png")
}
