//! The PNG icon of the page, for devices that show no SVG.

use std::fs;

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree};

use crate::documents::root;

/// Background of the icon on devices without transparent icons, such as phones.
const BACKGROUND: [u8; 3] = [0x14, 0x17, 0x1c];

/// The picture as a PNG file with a palette, half as large as without one: the page has to load it.
fn with_palette(picture: &Pixmap) -> Vec<u8> {
    let mut colours: Vec<[u8; 3]> = Vec::new();
    let mut indices = Vec::new();
    for pixel in picture.pixels() {
        assert_eq!(pixel.alpha(), 255);
        let colour = [pixel.red(), pixel.green(), pixel.blue()];
        let known = colours.iter().position(|known| *known == colour);
        indices.push(known.unwrap_or(colours.len()) as u8);
        if known.is_none() {
            colours.push(colour);
        }
    }
    assert!(colours.len() <= 256, "{}", colours.len());
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, picture.width(), picture.height());
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_palette(colours.concat());
    encoder.set_filter(png::Filter::NoFilter);
    encoder.set_compression(png::Compression::High);
    encoder.write_header().and_then(|mut writer| writer.write_image_data(&indices)).expect("in memory");
    file
}

#[test]
fn the_icon_is_drawn_from_the_svg() {
    let svg = fs::read_to_string(root().join("web/icon.svg")).expect("the file exists");
    let tree = Tree::from_str(&svg, &Options::default()).expect("an SVG");
    let edge = 192_u32;
    let mut picture = Pixmap::new(edge, edge).expect("not empty");
    let [r, g, b] = BACKGROUND;
    picture.fill(resvg::tiny_skia::Color::from_rgba8(r, g, b, 255));
    // Phones crop the corners.
    let margin = 0.14 * edge as f32;
    let scale = (edge as f32 - 2.0 * margin) / tree.size().width();
    resvg::render(&tree, Transform::from_translate(margin, margin).pre_scale(scale, scale), &mut picture.as_mut());
    let drawn = with_palette(&picture);
    let path = root().join(format!("web/icon-{edge}.png"));
    if std::env::var_os("UPDATE_PAGES").is_some() {
        fs::write(&path, &drawn).expect("writable");
    }
    assert!(fs::read(&path).expect("the file exists") == drawn, "{}: UPDATE_PAGES=1 redraws it", path.display());
}
