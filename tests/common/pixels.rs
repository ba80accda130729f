//! Searches the pixels of a picture: `#[path = "common/pixels.rs"] mod pixels;`.
#![allow(dead_code, reason = "each test file is a crate of its own and uses some of this")]

/// A picture: rows of red, green, blue, alpha from the top left corner.
pub struct Picture {
    width: usize,
    rgba: Vec<u8>,
}

/// Left, top, right and bottom edges in pixels; the last two are exclusive.
pub type Area = [usize; 4];

impl Picture {
    /// From the width in pixels and the raw data, as in `Picture::new(image.width(), image.into_raw())`.
    pub fn new(width: u32, rgba: Vec<u8>) -> Self {
        let width = width as usize;
        Self { width, rgba }
    }

    /// The whole picture.
    pub fn area(&self) -> Area {
        [0, 0, self.width, self.rgba.len() / 4 / self.width]
    }

    /// Red, green and blue at column `x` and row `y`.
    pub fn at(&self, x: usize, y: usize) -> [u8; 3] {
        let at = 4 * (y * self.width + x);
        [self.rgba[at], self.rgba[at + 1], self.rgba[at + 2]]
    }

    /// Pixels (column, row) in `area` whose red, green and blue each differ from `colour` by at most `most`.
    pub fn coloured(&self, area: Area, colour: [u8; 3], most: u8) -> Vec<(usize, usize)> {
        let [left, top, right, bottom] = self.area();
        let (left, top) = (area[0].max(left), area[1].max(top));
        let (right, bottom) = (area[2].min(right), area[3].min(bottom));
        let near = |(x, y): &(usize, usize)| {
            let pairs = self.at(*x, *y).into_iter().zip(colour);
            pairs.into_iter().all(|(a, b)| a.abs_diff(b) <= most)
        };
        let places = (top..bottom).flat_map(|y| (left..right).map(move |x| (x, y)));
        places.filter(near).collect()
    }

    /// Pixels (column, row) in `area` that `colour` covers by about half or more over a background.
    pub fn covered(&self, area: Area, colour: [u8; 3], background: [u8; 3]) -> Vec<(usize, usize)> {
        let minus_background = |a: [u8; 3]| [0, 1, 2].map(|i| f32::from(a[i]) - f32::from(background[i]));
        let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let full = minus_background(colour);
        let mut places = self.coloured(area, colour, 255);
        places.retain(|&(x, y)| {
            let seen = minus_background(self.at(x, y));
            let share = dot(seen, full) / dot(full, full);
            let rest = [0, 1, 2].map(|i| seen[i] - share * full[i]);
            share > 0.45 && dot(rest, rest) < 300.0
        });
        places
    }
}

/// The topmost row of some pixels.
pub fn top(places: &[(usize, usize)]) -> Option<usize> {
    places.iter().map(|(_, y)| *y).min()
}
