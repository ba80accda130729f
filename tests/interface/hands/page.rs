//! The window on a web page, whose host records what is asked of it.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;
use std::sync::Arc;

use eframe::egui::{self, accesskit::Role};
use egui_kittest::{
    Harness,
    kittest::{NodeT as _, Queryable as _},
};
use jointplay::app::{App, AppOptions, Host, OpenedFile, SaveFile, Verdict};
use jointplay::scene::Scene;

use super::builder;

/// Records the requests made to a host.
#[derive(Default)]
pub struct Calls {
    pub shared: Vec<String>,
    pub saved: Vec<SaveFile>,
    pub announced: Vec<String>,
    pub picked: usize,
    pub to_open: VecDeque<Vec<OpenedFile>>,
}

impl Calls {
    /// A host that records its requests.
    pub fn host() -> (Box<dyn Host>, Rc<RefCell<Self>>) {
        let calls = Rc::new(RefCell::new(Self::default()));
        (Box::new(PageHost(calls.clone())), calls)
    }
}

/// A web page's host without a browser.
struct PageHost(Rc<RefCell<Calls>>);

impl Host for PageHost {
    fn address(&self) -> String {
        "https://example.org/lab/".to_owned()
    }

    fn publish_link(&mut self, link: &str) -> bool {
        self.0.borrow_mut().shared.push(link.to_owned());
        false
    }

    fn save(&mut self, files: &[SaveFile]) -> Result<String, String> {
        self.0.borrow_mut().saved.extend_from_slice(files);
        Ok(format!("Saved {}", files[0].name))
    }

    fn pick_file(&mut self) -> bool {
        self.0.borrow_mut().picked += 1;
        true
    }

    fn read_dropped(&mut self, files: Vec<Arc<dyn egui::DroppedFile + Send + Sync>>) {
        let read = |file: &Arc<dyn egui::DroppedFile + Send + Sync>| OpenedFile {
            name: file.path().display().to_string(),
            content: file.bytes(),
        };
        let files = files.iter().map(read).collect();
        self.0.borrow_mut().to_open.push_back(files);
    }

    fn opened(&mut self) -> Option<Vec<OpenedFile>> {
        self.0.borrow_mut().to_open.pop_front()
    }

    fn announce(&mut self, text: &str, _event: bool) {
        self.0.borrow_mut().announced.push(text.to_owned());
    }
}

pub fn open(options: AppOptions, size: [f32; 2]) -> (Harness<'static, App>, Rc<RefCell<Calls>>) {
    paced(options, size, 1.0 / 60.0)
}

/// As [`open`], with `dt` seconds between frames.
pub fn paced(options: AppOptions, size: [f32; 2], dt: f32) -> (Harness<'static, App>, Rc<RefCell<Calls>>) {
    let mut options = options;
    options.theme = egui::Theme::Light.into();
    options.clock = crate::common::ticking_clock::<10>;
    let (page, calls) = Calls::host();
    let mut harness = builder(size, egui::Theme::Light).with_step_dt(dt).build_eframe(move |cc| {
        let mut app = App::new(cc, options).expect("the scene starts");
        app.set_host(page);
        app
    });
    harness.run_steps(3);
    (harness, calls)
}

/// `scene` at t = 0, paused.
pub fn window(scene: &str, size: [f32; 2]) -> (Harness<'static, App>, Rc<RefCell<Calls>>) {
    let mut options = AppOptions::new(Scene::load(scene, &[]).expect("a built-in scene"));
    options.playing = false;
    open(options, size)
}

/// Whether exactly one visible label contains `words`; the announcement for screen readers is not counted.
pub fn label(harness: &Harness<'_, App>, words: &str) -> bool {
    let labels = harness.query_all_by_label_contains(words).filter(|node| node.accesskit_node().role() == Role::Label);
    labels.count() == 1
}

pub fn click(harness: &mut Harness<'_, App>, label: &str) {
    harness.get_by_label(label).click();
    harness.run_steps(3);
}

/// Runs until the link's state has been reproduced or has failed to.
pub fn verdict(harness: &mut Harness<'_, App>) -> Verdict {
    for _ in 0..600 {
        if let Some(verdict) = harness.state().verdict() {
            return verdict.clone();
        }
        harness.step();
    }
    panic!("no verdict after ten seconds");
}

/// The next file that is saved.
pub fn next_file(harness: &mut Harness<'_, App>, calls: &Rc<RefCell<Calls>>) -> SaveFile {
    let start = std::time::Instant::now();
    while calls.borrow().saved.is_empty() {
        assert!(start.elapsed().as_secs() < 30, "no file was saved");
        std::thread::sleep(std::time::Duration::from_millis(5));
        harness.step();
    }
    calls.borrow_mut().saved.remove(0)
}

/// A picture's header and its pixels.
pub fn decoded(file: &SaveFile) -> (png::Info<'static>, Vec<u8>) {
    let mut reader = png::Decoder::new(std::io::Cursor::new(file.bytes.as_slice())).read_info().expect("a PNG file");
    let mut rgba = vec![0; reader.output_buffer_size().expect("fits in memory")];
    reader.next_frame(&mut rgba).expect("a complete picture");
    (reader.info().clone(), rgba)
}
