//! The chaos bench in a window, with a host whose results come when the test wants them.

use std::cell::Cell;
use std::collections::{HashSet, VecDeque};
use std::ops::ControlFlow;
use std::rc::Rc;
use std::sync::Arc;

use eframe::egui::{self, Key, accesskit::Role};
use egui_kittest::{
    Harness,
    kittest::{NodeT as _, Queryable as _},
};
use jointplay::analysis::task::{Job, Message, perform};
use jointplay::app::{App, BackgroundTask, DesktopHost, Host, OpenedFile};

use super::opened;

/// A host that computes a job at once with a number of workers, but delivers only as many sweep points or study runs as the test
/// allows, so that results do not depend on timing.
struct ThrottledHost(Rc<Cell<usize>>, usize);

/// A job's undelivered messages, and the number of points that may still be delivered.
pub struct ThrottledTask(pub VecDeque<Message>, pub Rc<Cell<usize>>);

impl Host for ThrottledHost {
    fn read_dropped(&mut self, _files: Vec<Arc<dyn egui::DroppedFile + Send + Sync>>) {}

    fn opened(&mut self) -> Option<Vec<OpenedFile>> {
        None
    }

    fn workers(&self) -> usize {
        self.1
    }

    fn start(&mut self, job: Job) -> Option<Box<dyn BackgroundTask>> {
        let mut messages = VecDeque::new();
        perform(&job, &mut |message| {
            messages.push_back(message);
            ControlFlow::Continue(())
        });
        Some(Box::new(ThrottledTask(messages, self.0.clone())))
    }
}

impl BackgroundTask for ThrottledTask {
    fn poll(&mut self) -> Option<Message> {
        let Self(messages, points) = self;
        if let Message::Point(_) | Message::Run(_) = messages.front()? {
            points.set(points.get().checked_sub(1)?);
        }
        messages.pop_front()
    }

    fn rest(&mut self, _rest: f64) {}

    fn cancel(&mut self) {
        self.0.clear();
    }
}

/// Installs a throttled host; returns the number of points that it may still deliver.
pub fn throttle(harness: &mut Harness<'_, App>) -> Rc<Cell<usize>> {
    throttle_shared(harness, 1)
}

/// As [`throttle`], for a host that shares sweeps among `workers`.
pub fn throttle_shared(harness: &mut Harness<'_, App>, workers: usize) -> Rc<Cell<usize>> {
    let points = Rc::new(Cell::new(0));
    let host = ThrottledHost(points.clone(), workers);
    harness.state_mut().set_host(Box::new(host));
    points
}

/// The window on `scene` with some changes, paused at t = 0, with the bench open.
pub fn sized(scene: &str, changes: &[(&str, &str)], size: [f32; 2], theme: egui::Theme) -> Harness<'static, App> {
    let mut harness = opened(scene, changes, size, theme, crate::common::ticking_clock::<100>);
    harness.state_mut().set_host(Box::new(DesktopHost::default()));
    harness.run();
    harness.key_press(Key::B);
    harness.run();
    harness
}

pub const FAST: (&str, &str) = ("spcmm.frequency", "5 Hz");

pub fn click(harness: &mut Harness<'_, App>, role: Role, label: &str) {
    harness.get_by_role_and_label(role, label).click();
    harness.step();
    harness.step();
}

pub fn set_number(harness: &mut Harness<'_, App>, label: &str, number: f64) {
    harness.get_by_role_and_label(Role::SpinButton, label).set_value_accesskit(number);
    harness.step();
    harness.step();
}

pub fn wait(harness: &mut Harness<'_, App>, mut done: impl FnMut(&App) -> bool) {
    let start = std::time::Instant::now();
    while !done(harness.state()) {
        assert!(start.elapsed().as_secs() < 600, "no result after 600 s");
        std::thread::sleep(std::time::Duration::from_millis(20));
        harness.run_steps(1);
    }
}

/// Number of controls; panics unless each has a unique name.
pub fn named_controls(harness: &Harness<'_, App>) -> usize {
    let mut controls = 0;
    let mut names = HashSet::new();
    for node in harness.root().children_recursive() {
        let node = node.accesskit_node();
        let is_control = matches!(
            node.role(),
            Role::Button
                | Role::Slider
                | Role::TextInput
                | Role::ComboBox
                | Role::CheckBox
                | Role::SpinButton
                | Role::Splitter
                | Role::Image
        );
        controls += usize::from(is_control);
        let named = node.label().is_some_and(|label| !label.trim().is_empty());
        assert!(!is_control || named, "{:?}", node.role());
        let new = names.insert((node.role(), node.label()));
        assert!(!is_control || new, "two of role {:?} are called {:?}", node.role(), node.label());
    }
    controls
}
