//! Writes the paths of the SVG as PDF. Text becomes glyph outlines, so a reader needs no fonts.

use pdf_writer::types::{LineCapStyle, LineJoinStyle};
use pdf_writer::{Content, Filter, Finish as _, Pdf, Rect, Ref, TextStr};
use resvg::tiny_skia::{Path, PathSegment, Point, Transform};
use resvg::usvg::{Color, FillRule, Group, LineCap, LineJoin, Node, Opacity, Paint};

use super::{Sheet, SheetError};

/// PDF points per pixel of the description: 72 and 96 per inch.
const POINTS: f32 = 0.75;

impl Sheet {
    /// The sheet as a one-page PDF with pixels of 1/96 inch; equal descriptions give equal bytes.
    ///
    /// # Errors
    /// As [`Sheet::svg`].
    pub fn pdf(&self) -> Result<Vec<u8>, SheetError> {
        let tree = self.tree()?;
        let (width, height) = (tree.size().width() * POINTS, tree.size().height() * POINTS);
        let mut content = Content::new();
        // A PDF page has its origin in the lower left corner.
        write_group(&mut content, tree.root(), Transform::from_row(POINTS, 0.0, 0.0, -POINTS, 0.0, height))?;
        let content = miniz_oxide::deflate::compress_to_vec_zlib(&content.finish(), 9);

        let [catalog, pages, page, stream, info] = [1, 2, 3, 4, 5].map(Ref::new);
        let mut pdf = Pdf::new();
        pdf.catalog(catalog).pages(pages);
        pdf.pages(pages).kids([page]).count(1);
        let mut page_writer = pdf.page(page);
        page_writer.parent(pages).media_box(Rect::new(0.0, 0.0, width, height)).contents(stream);
        page_writer.resources();
        page_writer.finish();
        pdf.stream(stream, &content).filter(Filter::FlateDecode);
        let mut about = pdf.document_info(info);
        about.creator(TextStr(&format!("jointplay {}", crate::VERSION)));
        if !self.title.is_empty() {
            about.title(TextStr(&self.title));
        }
        if !self.note.is_empty() {
            about.subject(TextStr(&self.note));
        }
        about.finish();
        Ok(pdf.finish())
    }
}

fn write_group(content: &mut Content, group: &Group, page: Transform) -> Result<(), SheetError> {
    let plain = group.opacity() == Opacity::ONE
        && group.clip_path().is_none()
        && group.mask().is_none()
        && group.filters().is_empty();
    if !plain {
        return Err(unsupported());
    }
    for node in group.children() {
        match node {
            Node::Group(group) => write_group(content, group, page)?,
            Node::Text(text) => write_group(content, text.flattened(), page)?,
            Node::Path(path) if path.is_visible() => write_path(content, path, page)?,
            Node::Path(_) => {}
            Node::Image(_) => return Err(unsupported()),
        }
    }
    Ok(())
}

fn write_path(content: &mut Content, path: &resvg::usvg::Path, page: Transform) -> Result<(), SheetError> {
    let transform = page.pre_concat(path.abs_transform());
    let Some(outline) = path.data().clone().transform(transform) else {
        return Ok(());
    };
    if let Some(fill) = path.fill() {
        let [red, green, blue] = rgb(fill.paint(), fill.opacity())?;
        content.set_fill_rgb(red, green, blue);
        write_outline(content, &outline);
        match fill.rule() {
            FillRule::NonZero => content.fill_nonzero(),
            FillRule::EvenOdd => content.fill_even_odd(),
        };
    }
    if let Some(stroke) = path.stroke() {
        if stroke.dasharray().is_some() {
            return Err(unsupported());
        }
        let [red, green, blue] = rgb(stroke.paint(), stroke.opacity())?;
        content.set_stroke_rgb(red, green, blue);
        content.set_line_width(round(stroke.width().get() * transform.get_scale().0));
        content.set_line_cap(match stroke.linecap() {
            LineCap::Butt => LineCapStyle::ButtCap,
            LineCap::Round => LineCapStyle::RoundCap,
            LineCap::Square => LineCapStyle::ProjectingSquareCap,
        });
        content.set_line_join(match stroke.linejoin() {
            LineJoin::Miter | LineJoin::MiterClip => LineJoinStyle::MiterJoin,
            LineJoin::Round => LineJoinStyle::RoundJoin,
            LineJoin::Bevel => LineJoinStyle::BevelJoin,
        });
        write_outline(content, &outline);
        content.stroke();
    }
    Ok(())
}

fn write_outline(content: &mut Content, path: &Path) {
    let mut last = Point::zero();
    let cubic = |content: &mut Content, points: [Point; 3]| {
        let [[x1, y1], [x2, y2], [x, y]] = points.map(rounded);
        content.cubic_to(x1, y1, x2, y2, x, y);
        points[2]
    };
    for segment in path.segments() {
        last = match segment {
            PathSegment::MoveTo(to) => {
                let [x, y] = rounded(to);
                content.move_to(x, y);
                to
            }
            PathSegment::LineTo(to) => {
                let [x, y] = rounded(to);
                content.line_to(x, y);
                to
            }
            PathSegment::QuadTo(middle, to) => {
                // The same curve as a cubic, the only kind in PDF.
                let towards = |from: Point| {
                    Point::from_xy(from.x + (middle.x - from.x) * 2.0 / 3.0, from.y + (middle.y - from.y) * 2.0 / 3.0)
                };
                cubic(content, [towards(last), towards(to), to])
            }
            PathSegment::CubicTo(one, two, to) => cubic(content, [one, two, to]),
            PathSegment::Close => {
                content.close_path();
                last
            }
        };
    }
}

fn rounded(point: Point) -> [f32; 2] {
    [round(point.x), round(point.y)]
}

/// Rounds to a thousandth of a point, finer than any printer.
fn round(points: f32) -> f32 {
    (points * 1000.0).round() / 1000.0
}

fn rgb(paint: &Paint, opacity: Opacity) -> Result<[f32; 3], SheetError> {
    match paint {
        Paint::Color(Color { red, green, blue }) if opacity == Opacity::ONE => {
            Ok([red, green, blue].map(|part| f32::from(*part) / 255.0))
        }
        _ => Err(unsupported()),
    }
}

/// Charts never cause this error: all their paths are opaque and of one colour.
fn unsupported() -> SheetError {
    SheetError("only opaque paths of a single colour can be written to a PDF file".to_owned())
}
