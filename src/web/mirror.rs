//! Mirrors egui's accessibility tree, which eframe drops in a browser, for the elements that `web/mirror.js` lays over the
//! canvas and for tests. Requests to these elements go back to egui.

use std::collections::HashMap;

use eframe::egui::{self, accesskit};
use serde_json::{Value, json};

type Nodes<'a> = HashMap<accesskit::NodeId, &'a accesskit::Node>;

/// Latest accessibility tree of egui, and requests for its next frame.
#[derive(Default)]
pub struct Mirror {
    tree: Option<accesskit::TreeUpdate>,
    /// The visible parts of the controls, points: a control that is scrolled out of sight has none.
    visible: HashMap<accesskit::NodeId, egui::Rect>,
    requests: Vec<accesskit::ActionRequest>,
}

impl egui::Plugin for Mirror {
    fn debug_name(&self) -> &'static str {
        "mirror of the accessibility tree"
    }

    fn setup(&mut self, ctx: &egui::Context) {
        ctx.enable_accesskit();
    }

    fn input_hook(&mut self, _ctx: &egui::Context, input: &mut egui::RawInput) {
        let requests = self.requests.drain(..);
        let events = requests.map(egui::Event::AccessKitActionRequest);
        input.events.extend(events);
    }

    fn output_hook(&mut self, ctx: &egui::Context, output: &mut egui::FullOutput) {
        let tree = output.platform_output.accesskit_update.take();
        if tree.is_some() {
            self.visible = ctx.viewport(|viewport| {
                let widgets = viewport.this_pass.widgets.layers().flat_map(|(_, widgets)| widgets);
                widgets.map(|widget| (widget.id.accesskit_id(), widget.interact_rect)).collect()
            });
        }
        self.tree = tree.or(self.tree.take());
    }
}

impl Mirror {
    /// Controls, texts and parts of the window in reading order, as JSON: `[{"id", "inside", "role", "label", "text", "value",
    /// "min", "max", "step", "on", "expanded", "disabled", "live", "focusable", "focused", "rect": [x0, y0, x1, y1]}, …]`.
    /// Rectangles are the visible parts in CSS pixels of the canvas, `zoom` pixels per point; `inside` is the part of the window. Empty before
    /// the first frame.
    pub fn widgets(&self, zoom: f32) -> String {
        let Some(tree) = &self.tree else {
            return String::new();
        };
        let nodes: Nodes<'_> = tree.nodes.iter().map(|(id, node)| (*id, node)).collect();
        let mut widgets = Vec::new();
        let mut open: Vec<_> = tree.tree.iter().map(|tree| (tree.root, None)).collect();
        while let Some((id, part)) = open.pop() {
            let Some(node) = nodes.get(&id) else { continue };
            let own = is_part(node, &nodes).then_some(id).or(part);
            open.extend(node.children().iter().rev().map(|child| (*child, own)));
            let visible = self.visible.get(&id).copied();
            let widget = describe(id, node, &nodes, tree.focus, f64::from(zoom), visible);
            widgets.extend(widget.map(|mut widget| {
                widget["inside"] = part.map(|part| part.0.to_string()).into();
                widget
            }));
        }
        Value::Array(widgets).to_string()
    }

    /// Requests `action` on a control in the next frame: `Click`, `Focus`, `Increment`, `Decrement`, or `SetValue` with `data`.
    /// Other actions are ignored.
    pub fn request(&mut self, id: u64, action: &str, data: Option<accesskit::ActionData>) {
        use accesskit::Action;
        let action = match action {
            "Click" => Action::Click,
            "Focus" => Action::Focus,
            "Increment" => Action::Increment,
            "Decrement" => Action::Decrement,
            "SetValue" => Action::SetValue,
            _ => return,
        };
        self.requests.push(accesskit::ActionRequest {
            action,
            target_tree: accesskit::TreeId::ROOT,
            target_node: accesskit::NodeId(id),
            data,
        });
    }
}

/// Whether a node is a named part of the window.
fn is_part(node: &accesskit::Node, nodes: &Nodes<'_>) -> bool {
    matches!(node.role(), accesskit::Role::Region | accesskit::Role::Dialog) && label(node, nodes).is_some()
}

/// Describes a node that can be read or used; `None` for any other node.
fn describe(
    id: accesskit::NodeId,
    node: &accesskit::Node,
    nodes: &Nodes<'_>,
    focus: accesskit::NodeId,
    zoom: f64,
    visible: Option<egui::Rect>,
) -> Option<Value> {
    // A part of the window has no bounds of its own.
    let bounds = node.bounds().or_else(|| is_part(node, nodes).then_some(accesskit::Rect::ZERO))?;
    let rect = within([bounds.x0, bounds.y0, bounds.x1, bounds.y1], visible);
    // Focusable nodes are listed even without a name, so that tests find them.
    let nameless = || node.supports_action(accesskit::Action::Focus).then_some("");
    let label = label(node, nodes).or_else(nameless)?;
    Some(json!({
        // As text: the number has more digits than a JavaScript number holds.
        "id": id.0.to_string(),
        "role": format!("{:?}", node.role()),
        "label": label,
        "text": node.value(),
        "value": node.numeric_value(),
        "min": node.min_numeric_value(),
        "max": node.max_numeric_value(),
        "step": node.numeric_value_step(),
        "on": node.toggled().map(|on| on == accesskit::Toggled::True),
        "expanded": node.is_expanded(),
        "disabled": node.is_disabled(),
        "live": node.live().is_some(),
        "focusable": node.supports_action(accesskit::Action::Focus),
        "focused": id == focus,
        "rect": rect.map(|x| x * zoom),
    }))
}

/// The part of `bounds` that is `visible`, so that nothing out of sight lies where something else is: without any, a place of no size at
/// the nearest edge.
fn within(bounds: [f64; 4], visible: Option<egui::Rect>) -> [f64; 4] {
    let Some(visible) = visible else {
        return bounds;
    };
    let [left, top, right, bottom] = [visible.left(), visible.top(), visible.right(), visible.bottom()].map(f64::from);
    let inside = |x: f64, a: f64, b: f64| if a <= b { x.clamp(a, b) } else { 0.5 * (a + b) };
    [
        inside(bounds[0], left, right),
        inside(bounds[1], top, bottom),
        inside(bounds[2], left, right),
        inside(bounds[3], top, bottom),
    ]
}

/// A control's own name, else the name of its label (sliders, text fields), else its text.
fn label<'a>(node: &'a accesskit::Node, nodes: &Nodes<'a>) -> Option<&'a str> {
    let labelling = || {
        node.labelled_by().iter().find_map(|id| {
            let label = nodes.get(id)?;
            label.label().or(label.value())
        })
    };
    node.label().or_else(labelling).or(node.value())
}
