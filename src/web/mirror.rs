//! The accessibility tree of the interface as JSON: eframe's browser side drops it. Tests find controls in it.

use eframe::egui::{self, accesskit};
use serde_json::json;

/// Keeps what egui last reported about its controls.
#[derive(Default)]
pub struct Mirror {
    /// `[{"role", "label", "value", "on", "disabled", "rect": [x0, y0, x1, y1]}, …]`; places in CSS pixels of the canvas.
    pub widgets: String,
}

impl egui::Plugin for Mirror {
    fn debug_name(&self) -> &'static str {
        "mirror of the accessibility tree"
    }

    fn setup(&mut self, ctx: &egui::Context) {
        ctx.enable_accesskit();
    }

    fn output_hook(&mut self, ctx: &egui::Context, output: &mut egui::FullOutput) {
        let Some(tree) = &output.platform_output.accesskit_update else {
            return;
        };
        // Places are given in points.
        let scale = f64::from(ctx.zoom_factor());
        let widgets = tree.nodes.iter().filter_map(|(_, node)| {
            let bounds = node.bounds()?;
            let rect = [bounds.x0, bounds.y0, bounds.x1, bounds.y1];
            let label = label(node, &tree.nodes)?;
            Some(json!({
                "role": format!("{:?}", node.role()),
                "label": label,
                "text": node.value(),
                "value": node.numeric_value(),
                "on": node.toggled().map(|on| on == accesskit::Toggled::True),
                "disabled": node.is_disabled(),
                "rect": rect.map(|x| x * scale),
            }))
        });
        self.widgets = serde_json::Value::Array(widgets.collect()).to_string();
    }
}

/// A control's own name, else that of what labels it (sliders, text fields), else its text.
fn label<'a>(
    node: &'a accesskit::Node,
    all: &'a [(accesskit::NodeId, accesskit::Node)],
) -> Option<&'a str> {
    let labelling = || {
        node.labelled_by().iter().find_map(|id| {
            let (_, label) = all.iter().find(|(other, _)| other == id)?;
            label.label().or(label.value())
        })
    };
    node.label().or_else(labelling).or(node.value())
}
