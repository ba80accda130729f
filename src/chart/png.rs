//! Converts SVG to PNG with `resvg`, using bundled fonts, so that system fonts have no influence.

use std::sync::Arc;

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree, fontdb};

use super::ink::failed;
use super::{Sheet, SheetError};

/// Largest edge of a picture, pixels.
const MAX_EDGE: f32 = 16384.0;

impl Sheet {
    /// The SVG as shapes and glyphs.
    ///
    /// # Errors
    /// As [`Sheet::svg`].
    pub(super) fn tree(&self) -> Result<Tree, SheetError> {
        let mut fonts = fontdb::Database::new();
        fonts.load_font_data(epaint_default_fonts::UBUNTU_LIGHT.to_vec());
        // Provides glyphs that the first lacks, such as a raised minus sign.
        fonts.load_font_data(epaint_default_fonts::HACK_REGULAR.to_vec());
        let family = fonts.faces().find_map(|face| face.families.first()).map(|(name, _)| name.clone());
        fonts.set_sans_serif_family(family.unwrap_or_default());
        let options = Options { fontdb: Arc::new(fonts), ..Options::default() };
        Tree::from_str(&self.svg()?, &options).map_err(failed)
    }

    /// The sheet as PNG, with `scale` pixels per pixel of the description.
    ///
    /// # Errors
    /// As [`Sheet::svg`]; a picture without area or with an edge of more than 16384 pixels.
    pub fn png(&self, scale: f32) -> Result<Vec<u8>, SheetError> {
        let tree = self.tree()?;
        let (width, height) = (tree.size().width() * scale, tree.size().height() * scale);
        let fits = |edge: f32| (1.0..=MAX_EDGE).contains(&edge);
        let pixmap =
            (fits(width) && fits(height)).then(|| Pixmap::new(width.round() as u32, height.round() as u32)).flatten();
        let Some(mut pixmap) = pixmap else {
            return Err(SheetError(format!("cannot make a picture of {width} by {height} pixels")));
        };
        resvg::render(&tree, Transform::from_scale(scale, scale), &mut pixmap.as_mut());
        pixmap.encode_png().map_err(failed)
    }
}
