//! The browser's services for the application, implemented in `web/host.js`.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use eframe::egui;
use eframe::web_sys::{File, js_sys::Uint8Array};
use wasm_bindgen::prelude::*;

use super::work::Worker;
use crate::analysis::task::Job;
use crate::app::{BackgroundTask, Click, DroppedFile, Host, OpenedFile, SaveFile, Voice};
use crate::scene::{max_file_size, too_large};

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_namespace = jointplayHost)]
    fn address() -> String;
    #[wasm_bindgen(js_namespace = jointplayHost, js_name = publishLink)]
    fn publish_link(link: &str);
    #[wasm_bindgen(js_namespace = jointplayHost)]
    fn save(name: &str, mime: &str, bytes: &[u8]);
    #[wasm_bindgen(js_namespace = jointplayHost)]
    fn pick();
    #[wasm_bindgen(js_namespace = jointplayHost, js_name = fillScreen)]
    fn fill_screen(on: bool);
    #[wasm_bindgen(js_namespace = jointplayHost)]
    fn announce(text: &str, event: bool);
    /// Remembers that the first visit has been shown, if the browser lets the page store anything.
    #[wasm_bindgen(js_namespace = jointplayHost, js_name = noteVisit)]
    fn note_visit();
    /// Whether it has been shown before.
    #[wasm_bindgen(js_namespace = jointplayHost, js_name = wasHere)]
    pub fn was_here() -> bool;
    /// Switches sound on or off; returns the reason for a failure, or "".
    #[wasm_bindgen(js_namespace = jointplayHost)]
    fn sound(on: bool) -> String;
    /// Sample rate, Hz; 0 while sound is unavailable.
    #[wasm_bindgen(js_namespace = jointplayHost, js_name = soundRate)]
    fn sound_rate() -> f64;
    /// Plays `samples` after a delay of `after` seconds.
    #[wasm_bindgen(js_namespace = jointplayHost)]
    fn click(samples: &[f32], after: f64);
    /// Schedules calls of [`super::page::Page::step_between`] until the next frame.
    #[wasm_bindgen(js_namespace = jointplayHost, js_name = scheduleSteps)]
    pub fn schedule_steps();
    /// Reports that the graphics of start number `start` are lost.
    #[wasm_bindgen(js_namespace = jointplayHost, js_name = graphicsLost)]
    pub fn graphics_lost(start: u32, why: &str);
    /// Whether the current graphics are lost, which an error may show before the event does.
    #[wasm_bindgen(js_namespace = jointplayHost, js_name = areGraphicsLost)]
    pub fn are_graphics_lost() -> bool;
}

/// Incoming files, and the window to wake for them.
#[derive(Default)]
pub struct Inbox {
    files: RefCell<VecDeque<Vec<OpenedFile>>>,
    ctx: RefCell<egui::Context>,
}

impl Inbox {
    /// Sets the window to wake for new files.
    pub fn attach(&self, ctx: &egui::Context) {
        self.ctx.replace(ctx.clone());
    }

    /// The egui context of the window.
    pub fn ctx(&self) -> egui::Context {
        self.ctx.borrow().clone()
    }

    /// Adds files that arrived together.
    pub fn push(&self, files: Vec<OpenedFile>) {
        self.files.borrow_mut().push_back(files);
        self.ctx().request_repaint();
    }

    /// Reads browser files and adds them. Oversized files are not read, because a page has little memory.
    pub fn read(self: Rc<Self>, files: Vec<File>) {
        wasm_bindgen_futures::spawn_local(async move {
            let mut opened = Vec::with_capacity(files.len());
            for file in files {
                let name = file.name();
                let content = if file.size() > max_file_size(&name) as f64 {
                    Err(too_large())
                } else {
                    match file.array_buffer().await {
                        Ok(bytes) => Ok(Uint8Array::new(&bytes).to_vec()),
                        Err(_) => Err("cannot be read; it may be a folder".to_owned()),
                    }
                };
                opened.push(OpenedFile { name, content });
            }
            self.push(opened);
        });
    }
}

/// The page around the application.
pub struct WebHost {
    /// Incoming files.
    pub inbox: Rc<Inbox>,
    /// Why sound is unavailable, until the application has shown it.
    pub no_sound: Option<String>,
}

impl Host for WebHost {
    fn address(&self) -> String {
        address()
    }

    fn publish_link(&mut self, link: &str) -> bool {
        publish_link(link);
        true
    }

    fn save(&mut self, files: &[SaveFile]) -> Result<String, String> {
        for file in files {
            save(&file.name, file.mime, &file.bytes);
        }
        let names: Vec<&str> = files.iter().map(|file| file.name.as_str()).collect();
        Ok(format!("Downloading {}", names.join(" and ")))
    }

    fn pick_file(&mut self) -> bool {
        pick();
        true
    }

    fn read_dropped(&mut self, files: Vec<DroppedFile>) {
        let files = files.iter().filter_map(|file| file.web_file().cloned());
        self.inbox.clone().read(files.collect());
    }

    fn opened(&mut self) -> Option<Vec<OpenedFile>> {
        self.inbox.files.borrow_mut().pop_front()
    }

    fn workers(&self) -> usize {
        // One core is reserved for drawing and stepping.
        let cores = eframe::web_sys::window().map(|window| window.navigator().hardware_concurrency());
        (cores.unwrap_or(1.0) as usize).saturating_sub(1).max(1)
    }

    fn start(&mut self, job: Job) -> Option<Box<dyn BackgroundTask>> {
        Some(Box::new(Worker::start(&job)?))
    }

    fn fill_screen(&mut self, _ctx: &egui::Context, on: bool) {
        fill_screen(on);
    }

    fn sound(&mut self, on: bool) {
        self.no_sound = Some(sound(on)).filter(|why| !why.is_empty());
    }

    fn click(&mut self, clicks: &[Click]) {
        let rate = sound_rate();
        if rate > 0.0 {
            for one in clicks {
                let samples: Vec<f32> = Voice::new(one, rate).collect();
                click(&samples, one.after);
            }
        }
    }

    fn no_sound(&mut self) -> Option<String> {
        self.no_sound.take()
    }

    fn note_visit(&mut self) {
        note_visit();
    }

    fn announce(&mut self, text: &str, event: bool) {
        announce(text, event);
    }
}
