//! The accessibility tree of the interface, which eframe drops in a browser: for the elements that `web/mirror.js` lays over the
//! canvas, and for tests, which find controls in it. What these elements are asked to do goes back to egui.

use std::collections::HashMap;

use eframe::egui::{self, accesskit};
use serde_json::{Value, json};

type Nodes<'a> = HashMap<accesskit::NodeId, &'a accesskit::Node>;

/// Keeps what egui last reported about its controls, and what it is to be told next.
#[derive(Default)]
pub struct Mirror {
    tree: Option<accesskit::TreeUpdate>,
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

    fn output_hook(&mut self, _ctx: &egui::Context, output: &mut egui::FullOutput) {
        let tree = output.platform_output.accesskit_update.take();
        self.tree = tree.or(self.tree.take());
    }
}

impl Mirror {
    /// Controls, texts and parts of the window in reading order, as JSON: `[{"id", "inside", "role", "label", "text", "value", "min",
    /// "max", "step", "on", "expanded", "disabled", "live", "focusable", "focused", "rect": [x0, y0, x1, y1]}, …]`; places are in CSS
    /// pixels of the canvas, `zoom` of them to a point; `inside`: the part of the window. Empty before the first frame.
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
            let widget = describe(id, node, &nodes, tree.focus, f64::from(zoom));
            widgets.extend(widget.map(|mut widget| {
                widget["inside"] = part.map(|part| part.0.to_string()).into();
                widget
            }));
        }
        Value::Array(widgets).to_string()
    }

    /// Asks a control for `action` in the next frame: `Click`, `Focus`, `Increment`, `Decrement`, or `SetValue` with `data`.
    /// Anything else is ignored.
    pub fn ask(&mut self, id: u64, action: &str, data: Option<accesskit::ActionData>) {
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

/// A node that stands for something to read or to use.
fn describe(
    id: accesskit::NodeId,
    node: &accesskit::Node,
    nodes: &Nodes<'_>,
    focus: accesskit::NodeId,
    zoom: f64,
) -> Option<Value> {
    // A part of the window has no place of its own.
    let bounds = node.bounds().or_else(|| is_part(node, nodes).then_some(accesskit::Rect::ZERO))?;
    let rect = [bounds.x0, bounds.y0, bounds.x1, bounds.y1];
    // What can be used is listed without a name, too, so that a test finds it.
    let nameless = || node.supports_action(accesskit::Action::Focus).then_some("");
    let label = label(node, nodes).or_else(nameless)?;
    Some(json!({
        // More digits than a number of JavaScript holds.
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

/// A control's own name, else that of what labels it (sliders, text fields), else its text.
fn label<'a>(node: &'a accesskit::Node, nodes: &Nodes<'a>) -> Option<&'a str> {
    let labelling = || {
        node.labelled_by().iter().find_map(|id| {
            let label = nodes.get(id)?;
            label.label().or(label.value())
        })
    };
    node.label().or_else(labelling).or(node.value())
}
