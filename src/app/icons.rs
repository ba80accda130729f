//! Buttons with painted icons. They need no font; screen readers read their names.

use eframe::egui::{self, Color32, Pos2, Rect, Response, Role, Sense, Shape, Stroke, Ui, Vec2, WidgetInfo, pos2, vec2};

/// The symbol of an icon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Icon {
    /// Triangle.
    Play,
    /// Two bars.
    Pause,
    /// Bar and triangle: one step.
    Step,
    /// Bar and triangle backwards: to the start.
    Start,
    /// Triangle to the left.
    Backwards,
    /// Two triangles, to the left or to the right: to the previous or the next impact.
    Before,
    #[allow(missing_docs)]
    After,
    /// Curved arrow: back to the default.
    Undo,
    /// Mirrored curved arrow: redo.
    Redo,
}

/// A button with a painted icon, `name` as its label and `help` as its tooltip. `prominent` fills it.
pub fn icon_button(ui: &mut Ui, icon: Icon, name: &str, help: &str, size: f32, prominent: bool) -> Response {
    let (rect, response) = ui.allocate_exact_size(Vec2::splat(size), Sense::click());
    let enabled = ui.is_enabled();
    response.widget_info(|| WidgetInfo::labeled(Role::Button, enabled, name));
    if ui.is_rect_visible(rect) {
        let visuals = ui.style().interact(&response);
        let selection = ui.visuals().selection;
        let (fill, colour) = if prominent {
            let fill = selection.stroke.color;
            let fill = if response.hovered() { fill.gamma_multiply(0.85) } else { fill };
            (fill, if ui.visuals().dark_mode { Color32::from_gray(20) } else { Color32::WHITE })
        } else {
            (visuals.weak_bg_fill, visuals.fg_stroke.color)
        };
        let radius = if prominent { size / 2.0 } else { 6.0 };
        let outline = if response.has_focus() { ui.visuals().widgets.hovered.fg_stroke } else { Stroke::NONE };
        ui.painter().rect(rect, radius, fill, outline, egui::StrokeKind::Outside);
        paint(ui, icon, rect.shrink(size * 0.28), colour);
    }
    if help.is_empty() { response } else { response.on_hover_text(help) }
}

fn paint(ui: &Ui, icon: Icon, rect: Rect, colour: Color32) {
    let painter = ui.painter();
    let at = |x: f32, y: f32| rect.min + vec2(x * rect.width(), y * rect.height());
    let bar = |x: f32, width: f32| Rect::from_min_max(at(x, 0.04), at(x + width, 0.96));
    let triangle = |points: [Pos2; 3]| Shape::convex_polygon(points.to_vec(), colour, Stroke::NONE);
    match icon {
        Icon::Play => {
            painter.add(triangle([at(0.14, 0.0), at(1.0, 0.5), at(0.14, 1.0)]));
        }
        Icon::Pause => {
            painter.rect_filled(bar(0.1, 0.28), 1.5, colour);
            painter.rect_filled(bar(0.62, 0.28), 1.5, colour);
        }
        Icon::Step => {
            painter.rect_filled(bar(0.0, 0.2), 1.0, colour);
            painter.add(triangle([at(0.34, 0.0), at(1.0, 0.5), at(0.34, 1.0)]));
        }
        Icon::Start => {
            painter.rect_filled(bar(0.0, 0.2), 1.0, colour);
            painter.add(triangle([at(1.0, 0.0), at(1.0, 1.0), at(0.3, 0.5)]));
        }
        Icon::Backwards => {
            painter.add(triangle([at(0.86, 0.0), at(0.0, 0.5), at(0.86, 1.0)]));
        }
        Icon::Before | Icon::After => {
            let turned = |x: f32| if icon == Icon::After { x } else { 1.0 - x };
            for left in [0.0, 0.5] {
                let point = |x: f32, y: f32| at(turned(left + x), y);
                painter.add(triangle([point(0.0, 0.1), point(0.5, 0.5), point(0.0, 0.9)]));
            }
        }
        Icon::Undo | Icon::Redo => {
            let centre = rect.center();
            let radius = rect.width() * 0.46;
            let mirrored = |p: Pos2| if icon == Icon::Redo { pos2(2.0 * centre.x - p.x, p.y) } else { p };
            let on_circle = |turn: f32| {
                let angle = turn * std::f32::consts::TAU;
                centre + radius * vec2(angle.cos(), angle.sin())
            };
            let points: Vec<Pos2> = (0..=20).map(|i| mirrored(on_circle(0.70 + 0.78 * i as f32 / 20.0))).collect();
            painter.add(Shape::line(points, Stroke::new(1.6, colour)));
            let tip = on_circle(0.70);
            let size = rect.width() * 0.34;
            let head = [
                pos2(tip.x - size * 0.75, tip.y + size * 0.55),
                pos2(tip.x - size * 0.25, tip.y - size * 0.75),
                pos2(tip.x + size * 0.65, tip.y + size * 0.35),
            ];
            painter.add(triangle(head.map(mirrored)));
        }
    }
}
