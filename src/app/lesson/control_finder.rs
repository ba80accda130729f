//! Positions of controls by their accessible names, so that a lesson needs no other identifiers.

use std::sync::Arc;

use eframe::egui::accesskit::{Node, Role, TreeUpdate};
use eframe::egui::{self, Rect, pos2};

/// Records where the controls with these names were last drawn.
#[derive(Default)]
pub struct ControlFinder {
    wanted: Arc<[String]>,
    found: Vec<(String, Rect)>,
}

impl egui::Plugin for ControlFinder {
    fn debug_name(&self) -> &'static str {
        "places of the controls that a lesson points at"
    }

    fn output_hook(&mut self, _ctx: &egui::Context, output: &mut egui::FullOutput) {
        self.found.clear();
        if let Some(tree) = &output.platform_output.accesskit_update
            && !self.wanted.is_empty()
        {
            self.find(tree);
        }
    }
}

impl ControlFinder {
    /// Rectangles of the controls named in `wanted` in the previous frame; parts of one control, such as slider and field, are
    /// merged.
    pub fn places(ctx: &egui::Context, wanted: &[String]) -> Vec<(String, Rect)> {
        let finder = ctx.plugin_or_default::<Self>();
        let mut finder = finder.lock();
        if *finder.wanted != *wanted {
            finder.wanted = wanted.into();
            if !wanted.is_empty() {
                ctx.enable_accesskit();
                ctx.request_repaint();
            }
        }
        finder.found.clone()
    }

    fn find(&mut self, tree: &TreeUpdate) {
        let named = |node: &Node, name: &str| node.label() == Some(name) || node.value() == Some(name);
        for name in self.wanted.iter() {
            let all = || tree.nodes.iter().filter(|(_, node)| named(node, name));
            let is_text =
                |node: &Node| matches!(node.role(), Role::Label | Role::TextRun | Role::Heading | Role::Region);
            // A text counts only if no control has its name.
            let controls = all().any(|(_, node)| !is_text(node));
            let rects = all()
                .filter(|(_, node)| !controls || !is_text(node))
                .filter_map(|(_, node)| node.bounds())
                .map(|b| Rect::from_min_max(pos2(b.x0 as f32, b.y0 as f32), pos2(b.x1 as f32, b.y1 as f32)));
            if let Some(rect) = rects.reduce(|a, b| a.union(b)) {
                self.found.push((name.clone(), rect));
            }
        }
    }
}
