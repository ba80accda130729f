//! Keyboard: one table defines both the actions and the overlay that lists them.

use eframe::egui::accesskit::{self, ActionData, ActionRequest};
use eframe::egui::{self, EventFilter, Id, Key, Modifiers, Response, Slider, Ui};

/// Action of a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Action {
    PlayPause,
    Step,
    StepBack,
    Backwards,
    /// Go to the next or the previous impact.
    Impact {
        forward: bool,
    },
    Home,
    End,
    Reset,
    Slower,
    Faster,
    Fit,
    /// Undo or redo the latest change of the point of view.
    Camera {
        redo: bool,
    },
    /// Point of view, by index.
    Preset(usize),
    /// Close-up of a joint with play, by index.
    CloseUp(usize),
    Magnify,
    Sound,
    Microscope,
    ImpactList,
    IdealGhost,
    Arrows,
    Panel,
    Plots,
    Bench,
    Costs,
    Present,
    /// Go to the next or the previous step of a lesson.
    TurnPage {
        forward: bool,
    },
    Theme,
    Help,
    Close,
}

/// A key with its label in the overlay, and its action.
pub struct Binding {
    /// Group in the overlay.
    pub group: Group,
    /// Key.
    pub key: Key,
    /// Its action.
    pub action: Action,
    /// Label of the key in the overlay; empty if the line above covers it.
    pub written: &'static str,
    /// Description in the overlay.
    pub help: &'static str,
}

const fn bind(group: Group, key: Key, action: Action, written: &'static str, help: &'static str) -> Binding {
    Binding { group, key, action, written, help }
}

/// All key bindings.
pub const BINDINGS: [Binding; 44] = [
    bind(Group::Run, Key::Space, Action::PlayPause, "Space", "Play or pause"),
    bind(Group::Run, Key::ArrowRight, Action::Step, "Right arrow", "One step of the solver"),
    bind(Group::Run, Key::ArrowLeft, Action::StepBack, "Left arrow", "Undo the latest step"),
    bind(
        Group::Run,
        Key::Comma,
        Action::Impact { forward: false },
        ", and .",
        "Peak of the previous or next impact of the followed joint, otherwise of any",
    ),
    bind(Group::Run, Key::Period, Action::Impact { forward: true }, "", ""),
    bind(Group::Run, Key::J, Action::Backwards, "J", "Play backwards"),
    bind(Group::Run, Key::Home, Action::Home, "Home, End", "Start and end of the run so far"),
    bind(Group::Run, Key::End, Action::End, "", ""),
    bind(Group::Run, Key::R, Action::Reset, "R", "Restart at t = 0"),
    bind(Group::Run, Key::ArrowUp, Action::Faster, "Up arrow, +", "Faster"),
    bind(Group::Run, Key::Plus, Action::Faster, "", ""),
    bind(Group::Run, Key::Equals, Action::Faster, "", ""),
    bind(Group::Run, Key::ArrowDown, Action::Slower, "Down arrow, -", "Slower"),
    bind(Group::Run, Key::Minus, Action::Slower, "", ""),
    bind(Group::Picture, Key::F, Action::Fit, "F", "Show everything"),
    bind(
        Group::Picture,
        Key::Z,
        Action::Camera { redo: false },
        "Z, Y",
        "Back to the previous point of view, and forward to the next",
    ),
    bind(Group::Picture, Key::Y, Action::Camera { redo: true }, "", ""),
    bind(Group::Picture, Key::Num1, Action::Preset(0), "1", "Isometric view"),
    bind(Group::Picture, Key::Num2, Action::Preset(1), "2", "Front view"),
    bind(Group::Picture, Key::Num3, Action::Preset(2), "3", "Side view"),
    bind(Group::Picture, Key::Num4, Action::Preset(3), "4", "Top view"),
    bind(
        Group::Picture,
        Key::Num5,
        Action::CloseUp(0),
        "5, 6, 7, 8, 9",
        "Close-up of the first, second, … joint with play; the view follows it",
    ),
    bind(Group::Picture, Key::Num6, Action::CloseUp(1), "", ""),
    bind(Group::Picture, Key::Num7, Action::CloseUp(2), "", ""),
    bind(Group::Picture, Key::Num8, Action::CloseUp(3), "", ""),
    bind(Group::Picture, Key::Num9, Action::CloseUp(4), "", ""),
    bind(Group::Picture, Key::X, Action::Magnify, "X", "Next magnification of the clearance"),
    bind(Group::Picture, Key::M, Action::Sound, "M", "Sound on or off: a click for every impact"),
    bind(Group::Picture, Key::L, Action::Microscope, "L", "Microscope on the joint in focus, shown or hidden"),
    bind(Group::Window, Key::I, Action::ImpactList, "I", "Impact list shown or hidden"),
    bind(Group::Picture, Key::G, Action::IdealGhost, "G", "Ideal ghost: the machine without play, shown or hidden"),
    bind(Group::Picture, Key::A, Action::Arrows, "A", "Force arrows on or off"),
    bind(Group::Window, Key::C, Action::Panel, "C", "Controls shown or hidden"),
    bind(Group::Window, Key::P, Action::Plots, "P", "Plots shown or hidden; in a presentation the next of them"),
    bind(Group::Window, Key::B, Action::Bench, "B", "Experiments shown or hidden"),
    bind(Group::Window, Key::W, Action::Costs, "W", "What play costs, shown or hidden"),
    bind(
        Group::Window,
        Key::F5,
        Action::Present,
        "F5",
        "Presentation: picture and transport, large type, thick arrows",
    ),
    bind(
        Group::Window,
        Key::PageDown,
        Action::TurnPage { forward: true },
        "Page Down, Page Up",
        "Next and previous step of a lesson, as a presenter's remote sends them",
    ),
    bind(Group::Window, Key::PageUp, Action::TurnPage { forward: false }, "", ""),
    bind(Group::Window, Key::T, Action::Theme, "T", "Light or dark"),
    bind(Group::Window, Key::Questionmark, Action::Help, "?, F1", "This list"),
    bind(Group::Window, Key::Slash, Action::Help, "", ""),
    bind(Group::Window, Key::F1, Action::Help, "", ""),
    bind(
        Group::Window,
        Key::Escape,
        Action::Close,
        "Esc",
        "Leave a text field; otherwise close the menu, dialog or message; otherwise the presentation or microscope",
    ),
];

/// Action of `key`.
pub fn action(key: Key) -> Option<Action> {
    BINDINGS.iter().find(|binding| binding.key == key).map(|binding| binding.action)
}

/// Mouse and touch gestures for the overlay.
pub const POINTER: [(&str, &str); 11] = [
    ("Drag beside the machine, one finger", "Turn the view"),
    ("Drag on a body; with a finger, hold first", "Pull it by a spring; with shift along the line of sight"),
    ("Right or middle drag, shift-drag, two fingers", "Pan the view"),
    ("Wheel, pinch", "Zoom in on what is under the cursor"),
    ("Hover", "Details of a part"),
    ("Click, tap on a joint with play or its name", "Centre it and show it under the microscope"),
    ("Double-click, double tap on it", "Close-up; the view follows it"),
    ("Double-click, double tap on a body", "Follow it; on the ground: stop following"),
    ("Double-click, double tap on the lowest bar", "Presentation, as F5"),
    ("Drop a file", "Open a scene"),
    ("Paste", "Open a link"),
];

/// Keys of the control with the focus, and key combinations, for the overlay.
pub const FOCUS: [(&str, &str); 7] = [
    ("Tab, Shift Tab", "Next and previous control, from Play on; a drag on a slider also gives it the focus"),
    ("Arrows, Page Up and Down, Home, End on a slider", "Move that slider by one step, by ten, to its ends"),
    ("Left, right arrow on a plot", "Move its cursor, which reads all curves at an instant"),
    ("Left, right arrow on the timeline", "Show the instant a hundredth of the range earlier or later"),
    ("Space, Enter", "Press the button with the focus"),
    ("Ctrl +, Ctrl -, Ctrl 0", "Larger, smaller and default type"),
    ("Ctrl Z, Ctrl Shift Z, Ctrl Y", "Undo and redo a change of a parameter, of the view options or of the plots"),
];

/// Groups of the overlay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// Time and steps.
    Run,
    /// Display options and cameras.
    Picture,
    /// Panels and dialogs.
    Window,
    /// Mouse and touch.
    Pointer,
    /// The control with the focus, and combinations.
    Focus,
}

impl Group {
    /// Heading of the group.
    pub fn title(self) -> &'static str {
        match self {
            Self::Run => "Run",
            Self::Picture => "Picture",
            Self::Window => "Window",
            Self::Pointer => "Mouse and touch",
            Self::Focus => "Control with the focus, combinations",
        }
    }

    /// Rows of the group: key or gesture, and its action.
    pub fn rows(self) -> impl Iterator<Item = (&'static str, &'static str)> {
        let keys = BINDINGS.iter().filter(move |b| !b.written.is_empty() && b.group == self);
        let others: &[_] = match self {
            Self::Pointer => &POINTER,
            Self::Focus => &FOCUS,
            _ => &[],
        };
        keys.map(|b| (b.written, b.help)).chain(others.iter().copied())
    }
}

/// Key under which the focused slider's ID is stored.
const SLIDER_KEY: &str = "slider with the focus";

/// Key under which is stored whether a text field had the focus in the previous frame.
const TYPING_KEY: &str = "text field with the focus";

/// Steps of an arrow key that Page Up and Page Down take on a slider.
const PAGE_STEPS: usize = 10;

/// Finger travel that determines the direction of a drag, points.
const DRAG_THRESHOLD: f32 = 8.0;

/// State of a touch that started on a slider.
#[derive(Clone, Copy, PartialEq)]
enum Finger {
    /// Undecided.
    Waits,
    /// Sideways: moves the handle. Vertical: scrolls the enclosing area.
    Goes,
}

/// Leaves a touch that started on the slider `own` to the enclosing scroll area, unless it moves sideways. `place`: ID of the
/// stored state. Call it before adding the slider; returns whether the slider may receive the touch.
fn slider_receives_touch(ui: &Ui, place: Id, own: Id) -> bool {
    let (touched, origin, travel) = ui.input(|input| {
        let pointer = &input.pointer;
        let travel = pointer.total_drag_delta().unwrap_or_default();
        (input.any_touches(), pointer.press_origin(), travel)
    });
    if !touched {
        ui.data_mut(|data| data.remove::<Finger>(place));
        return true;
    }
    let ctx = ui.ctx();
    let (now, receives_touch) = match ui.data(|data| data.get_temp(place)) {
        None if ctx.is_being_dragged(own) => {
            ctx.stop_dragging();
            (Finger::Waits, false)
        }
        Some(Finger::Waits) if travel.length() >= DRAG_THRESHOLD => {
            let sideways = travel.x.abs() >= travel.y.abs();
            let below = origin.filter(|_| !sideways);
            let below = below.and_then(|origin| scrolling_at(ui, origin));
            if let Some(drawn) = below.or(sideways.then_some(own)) {
                ctx.set_dragged_id(drawn);
            }
            (Finger::Goes, true)
        }
        _ => return true,
    };
    ui.data_mut(|data| data.insert_temp(place, now));
    receives_touch
}

/// ID of the area around `ui` that scrolls under a finger at `point`.
fn scrolling_at(ui: &Ui, point: egui::Pos2) -> Option<Id> {
    let layer = ui.layer_id();
    ui.ctx().viewport(|viewport| {
        // Enclosing scroll areas were added earlier and sense only drags.
        let widgets = viewport.this_pass.widgets.get_layer(layer);
        let under = widgets.filter(|widget| {
            let sense = widget.sense;
            sense.senses_drag() && !sense.senses_click() && widget.interact_rect.contains(point)
        });
        under.last().map(|widget| widget.id)
    })
}

/// A slider that captures the arrow keys, Home, End, Page Up and Page Down after a drag or Tab focus, until something else is clicked.
/// `ends`: its least and greatest value. Only a sideways drag of a finger moves it.
pub fn slider(ui: &mut Ui, slider: Slider<'_>, ends: [f64; 2]) -> Response {
    let place = ui.next_auto_id().with("finger");
    let own = place.with("slider");
    let before: Option<Id> = ui.data(|data| data.get_temp(own));
    if let Some(own) = before.filter(|own| ui.memory(|memory| memory.has_focus(*own))) {
        ui.input_mut(|input| {
            let to = [Key::Home, Key::End].map(|key| input.consume_key(Modifiers::NONE, key));
            for (_, end) in to.into_iter().zip(ends).filter(|(pressed, _)| *pressed) {
                input.events.push(egui::Event::AccessKitActionRequest(ActionRequest {
                    action: accesskit::Action::SetValue,
                    target_tree: accesskit::TreeId::ROOT,
                    target_node: own.accesskit_id(),
                    data: Some(ActionData::NumericValue(end)),
                }));
            }
        });
    }
    let receives_touch = before.is_none_or(|before| slider_receives_touch(ui, place, before));
    let response = if receives_touch {
        ui.add(slider)
    } else {
        // Disabled without fading.
        let faded = std::mem::replace(&mut ui.visuals_mut().disabled_alpha, 1.0);
        let response = ui.add_enabled(false, slider);
        ui.visuals_mut().disabled_alpha = faded;
        response
    };
    ui.data_mut(|data| data.insert_temp(own, response.id));
    if response.drag_started() {
        response.request_focus();
    }
    if response.has_focus() {
        ui.data_mut(|data| data.insert_temp(Id::unique(SLIDER_KEY), response.id));
        let arrows = EventFilter { horizontal_arrows: true, vertical_arrows: true, ..EventFilter::default() };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, arrows));
    }
    response
}

/// Actions of the keys pressed since the last frame. An active text field captures all keys, a focused slider the arrows, and any
/// other focused control also the space bar. `turns_pages`: Page Up and Page Down are those of a presenter's remote, wherever the focus
/// is.
pub fn pressed(ctx: &egui::Context, turns_pages: bool) -> Vec<Action> {
    // Esc has already taken the focus from a text field, or takes back what is dragged, and does nothing else.
    let typing = ctx.text_edit_focused();
    let before = Id::unique(TYPING_KEY).with(ctx.viewport_id());
    let typed = ctx.data_mut(|data| std::mem::replace(data.get_temp_mut_or_default::<bool>(before), typing));
    let dragged = ctx.dragged_id().or(ctx.drag_stopped_id()).is_some();
    if typing || ((typed || dragged) && ctx.input(|input| input.key_pressed(Key::Escape))) {
        return Vec::new();
    }
    let focused = ctx.memory(egui::Memory::focused);
    let slider = focused.is_some() && focused == ctx.data(|data| data.get_temp(Id::unique(SLIDER_KEY)));
    if slider {
        // egui's slider handles only the arrows in its own direction.
        ctx.input_mut(|input| {
            let pages = input.events.iter().filter_map(|event| match event {
                egui::Event::Key { key: key @ (Key::PageUp | Key::PageDown), pressed: true, .. } if !turns_pages => {
                    let arrow = if *key == Key::PageUp { Key::ArrowRight } else { Key::ArrowLeft };
                    let pressed = |key| egui::Event::Key {
                        key,
                        physical_key: None,
                        pressed: true,
                        repeat: false,
                        modifiers: Modifiers::NONE,
                    };
                    Some(std::iter::repeat_n(pressed(arrow), PAGE_STEPS))
                }
                _ => None,
            });
            let pages: Vec<egui::Event> = pages.flatten().collect();
            input.events.extend(pages);
            for event in &mut input.events {
                if let egui::Event::Key { key, .. } = event {
                    *key = match *key {
                        Key::ArrowUp => Key::ArrowRight,
                        Key::ArrowDown => Key::ArrowLeft,
                        other => other,
                    };
                }
            }
        });
    }
    let is_captured = |key: Key| match key {
        Key::Space => focused.is_some() && !slider,
        Key::ArrowUp | Key::ArrowDown | Key::ArrowLeft | Key::ArrowRight | Key::Home | Key::End => focused.is_some(),
        Key::PageUp | Key::PageDown => slider && !turns_pages,
        _ => false,
    };
    let actions = ctx.input(|input| {
        input
            .events
            .iter()
            .filter_map(|event| match event {
                egui::Event::Key { key, pressed: true, repeat, modifiers, .. }
                    if !modifiers.command && !modifiers.alt =>
                {
                    let binding = BINDINGS.iter().find(|b| b.key == *key && !is_captured(*key))?;
                    // Only these actions repeat while the key is held.
                    let repeats =
                        matches!(binding.action, Action::Step | Action::StepBack | Action::Faster | Action::Slower);
                    (!repeat || repeats).then_some(binding.action)
                }
                _ => None,
            })
            .collect()
    });
    if turns_pages {
        // The timeline does not take them either.
        let turns = |event: &egui::Event| matches!(event, egui::Event::Key { key: Key::PageUp | Key::PageDown, .. });
        ctx.input_mut(|input| input.events.retain(|event| !turns(event)));
    }
    actions
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_overlay_lists_every_bound_key() {
        let mut written = "";
        for binding in &BINDINGS {
            if !binding.written.is_empty() {
                written = binding.written;
            }
            let name = match binding.key {
                Key::ArrowRight => "Right arrow",
                Key::ArrowLeft => "Left arrow",
                Key::ArrowUp => "Up arrow",
                Key::ArrowDown => "Down arrow",
                // One key with shift and without.
                Key::Plus | Key::Equals => "+",
                Key::Questionmark | Key::Slash => "?",
                Key::Minus => "-",
                Key::Comma => ",",
                Key::Period => ".",
                Key::PageDown => "Page Down",
                Key::PageUp => "Page Up",
                Key::Escape => "Esc",
                other => other.name(),
            };
            assert!(written.split(", ").chain(written.split(" and ")).any(|part| part == name), "{name}: {written}");
        }
    }

    #[test]
    fn no_key_does_two_things_and_every_action_is_listed() {
        for (i, a) in BINDINGS.iter().enumerate() {
            for b in &BINDINGS[i + 1..] {
                assert_ne!(a.key, b.key, "{}", a.help);
            }
            let listed = BINDINGS.iter().any(|b| {
                !b.written.is_empty()
                    && (std::mem::discriminant(&b.action) == std::mem::discriminant(&a.action)
                        || (a.action == Action::End && b.action == Action::Home))
            });
            assert!(listed, "{:?} is missing from the overlay", a.action);
        }
    }
}
