//! Esc gives the keyboard focus back to the control that opened a menu, a list or a dialog.

use eframe::egui::{self, Event, Id, Key, Order, Popup, accesskit::Action};

/// Frames after the first in which a control gets the focus back.
const RETRIES: u32 = 2;

/// What was opened, and by which control.
#[derive(Default)]
pub struct FocusKeeper {
    /// The latest control outside menus and dialogs that was pressed.
    pressed: Option<Id>,
    opener: Option<Id>,
    /// Whether a menu or list, or a dialog, was open in the previous frame.
    were_open: [bool; 2],
    /// Whether Esc was pressed in this frame: what it closes takes the key.
    escapes: bool,
    /// What gets the focus back, and for how many frames to try: egui refuses it as long as it remembers the dialog.
    returns_to: Option<(Id, u32)>,
}

impl FocusKeeper {
    /// Begins a frame, before any key is taken.
    pub fn begin(&mut self, ctx: &egui::Context) {
        if let Some((opener, frames)) = self.returns_to.take()
            // At first the closed dialog's text field may still have it.
            && (frames == RETRIES || ctx.memory(|memory| memory.focused().is_none_or(|focused| focused == opener)))
        {
            ctx.memory_mut(|memory| memory.request_focus(opener));
            ctx.request_repaint();
            self.returns_to = frames.checked_sub(1).map(|frames| (opener, frames));
        }
        self.escapes = ctx.input(|input| input.key_pressed(Key::Escape));
    }

    /// Whether a dialog that is open now was not in the previous frame: it takes the focus.
    pub fn is_new_dialog(&self) -> bool {
        !self.were_open[1]
    }

    /// Ends a frame.
    pub fn end(&mut self, ctx: &egui::Context, is_dialog_open: bool) {
        let focused = ctx.memory(egui::Memory::focused);
        let activated = pressed_control(ctx, focused);
        let is_outside = |id: &Id| {
            let response = ctx.read_response(*id);
            response.is_some_and(|response| response.layer_id.order < Order::Foreground)
        };
        if let Some(own) = activated.filter(is_outside).filter(|_| !self.were_open[1]) {
            self.pressed = Some(own);
        }
        let are_open = [Popup::is_any_open(ctx), is_dialog_open];
        for (was, is) in self.were_open.into_iter().zip(are_open) {
            if is && !was {
                // A key opens without a control; the focus then returns to where it was.
                self.opener = if activated.is_some() { self.pressed } else { focused.filter(is_outside) };
            }
            if was && !is && self.escapes && are_open == [false; 2] {
                self.returns_to = self.opener.take().map(|opener| (opener, RETRIES));
                ctx.request_repaint();
            }
        }
        self.were_open = are_open;
    }
}

/// The control pressed in this frame: by pointer, by key while it has the focus, or by assistive software.
fn pressed_control(ctx: &egui::Context, focused: Option<Id>) -> Option<Id> {
    if let Some(clicked) = ctx.viewport(|viewport| viewport.interact_widgets.clicked) {
        return Some(clicked);
    }
    let (by_key, asked) = ctx.input(|input| {
        let by_key = input.key_pressed(Key::Enter) || input.key_pressed(Key::Space);
        let asked = input.events.iter().find_map(|event| match event {
            Event::AccessKitActionRequest(request) if request.action == Action::Click => Some(request.target_node),
            _ => None,
        });
        (by_key, asked)
    });
    let Some(node) = asked else {
        return focused.filter(|_| by_key);
    };
    ctx.viewport(|viewport| {
        let widgets = viewport.prev_pass.widgets.layers().flat_map(|(_, widgets)| widgets);
        widgets.map(|widget| widget.id).find(|id| id.accesskit_id() == node)
    })
}
