//! Fingers: the first touch acts as any later one, and a pinch on a panel enlarges its type.

use eframe::egui::{self, Event, Id, Pos2, Rect, TouchDeviceId, TouchId, TouchPhase, Ui};

/// Factor of one step of the type size, and its limits.
const STEP: f32 = 1.1;
const SIZES: std::ops::RangeInclusive<f32> = 0.7..=2.5;

/// Frames after a step in which the distance of the fingers, which is measured in points of the new or the old size, says nothing.
const SETTLED: u32 = 2;

/// Announces a touch device before its first touch. egui makes areas scroll under a finger only once it has seen a touch, so that the
/// first swipe would be lost; and the controls take their size for fingers before one of them is pressed.
#[derive(Default)]
pub struct FirstTouch {
    known: bool,
    held: Vec<Event>,
}

impl egui::Plugin for FirstTouch {
    fn debug_name(&self) -> &'static str {
        "first touch"
    }

    fn input_hook(&mut self, ctx: &egui::Context, input: &mut egui::RawInput) {
        if !self.held.is_empty() {
            input.events.splice(0..0, self.held.drain(..));
            return;
        }
        let device = input.events.iter().find_map(|event| match event {
            Event::Touch { device_id, .. } => Some(*device_id),
            _ => None,
        });
        if let Some(device) = device.filter(|_| !self.known) {
            self.known = true;
            let is_of_pointer = |event: &mut Event| {
                matches!(
                    event,
                    Event::Touch { .. } | Event::PointerMoved(_) | Event::PointerButton { .. } | Event::PointerGone
                )
            };
            self.held = input.events.extract_if(.., is_of_pointer).collect();
            input.events.push(announcement(device));
            ctx.request_repaint();
        }
    }
}

/// An event that tells egui of a touch device without touching anything.
fn announcement(device_id: TouchDeviceId) -> Event {
    let id = TouchId::from(u64::MAX);
    Event::Touch { device_id, id, phase: TouchPhase::Cancel, pos: Pos2::ZERO, force: None }
}

/// A pinch that is enlarging type.
#[derive(Clone, Copy)]
struct Pinch {
    /// Distance of the fingers relative to that at the latest step.
    spread: f32,
    /// Frames since then.
    frames: u32,
}

/// Enlarges or reduces all type by a pinch that began in `area`.
pub fn pinch_enlarges(ui: &Ui, area: Rect) {
    let ctx = ui.ctx();
    let id = Id::unique("pinch on a panel");
    let Some(fingers) = ctx.input(egui::InputState::multi_touch) else {
        if !ctx.input(egui::InputState::any_touches) {
            ctx.data_mut(|data| data.remove::<Pinch>(id));
        }
        return;
    };
    let zoom = ctx.zoom_factor();
    let pinch = ctx.data(|data| data.get_temp::<Pinch>(id));
    if pinch.is_none() && !area.contains(fingers.start_pos) {
        return;
    }
    let mut pinch = pinch.unwrap_or(Pinch { spread: 1.0, frames: SETTLED });
    pinch.frames += 1;
    if pinch.frames > SETTLED {
        pinch.spread *= fingers.zoom_delta;
    }
    // In steps: the layout follows each of them.
    let step = match pinch.spread {
        spread if spread > STEP => STEP,
        spread if spread < 1.0 / STEP => 1.0 / STEP,
        _ => 1.0,
    };
    let wanted = (zoom * step).clamp(*SIZES.start(), *SIZES.end());
    if step != 1.0 {
        pinch = Pinch { spread: 1.0, frames: 0 };
        ctx.set_zoom_factor(wanted);
    }
    ctx.data_mut(|data| data.insert_temp(id, pinch));
}
