//! The browser's services for the application; `web/host.js` is their other half.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;
use std::sync::Arc;

use eframe::egui;
use eframe::web_sys::{File, js_sys::Uint8Array};
use wasm_bindgen::prelude::*;

use super::work::Worker;
use crate::analysis::task::Job;
use crate::app::{Host, OpenedFile, Running, SaveFile};
use crate::scene::{LARGEST_FILE, too_large};

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_namespace = jointplayHost)]
    fn address() -> String;
    #[wasm_bindgen(js_namespace = jointplayHost)]
    fn shared(link: &str);
    #[wasm_bindgen(js_namespace = jointplayHost)]
    fn save(name: &str, mime: &str, bytes: &[u8]);
    #[wasm_bindgen(js_namespace = jointplayHost)]
    fn pick();
    #[wasm_bindgen(js_namespace = jointplayHost, js_name = fillScreen)]
    fn fill_screen(on: bool);
    #[wasm_bindgen(js_namespace = jointplayHost)]
    fn announce(text: &str, event: bool);
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
    files: RefCell<VecDeque<OpenedFile>>,
    ctx: RefCell<egui::Context>,
}

impl Inbox {
    /// The window that is woken from now on.
    pub fn attach(&self, ctx: &egui::Context) {
        self.ctx.replace(ctx.clone());
    }

    /// The window.
    pub fn ctx(&self) -> egui::Context {
        self.ctx.borrow().clone()
    }

    /// A file has come.
    pub fn put(&self, file: OpenedFile) {
        self.files.borrow_mut().push_back(file);
        self.ctx().request_repaint();
    }

    /// Reads a file of the browser's and puts it in; a large one is not even read: a page has little memory.
    pub fn take(self: Rc<Self>, file: File) {
        wasm_bindgen_futures::spawn_local(async move {
            let content = if file.size() > LARGEST_FILE as f64 {
                Err(too_large())
            } else {
                match file.array_buffer().await {
                    Ok(bytes) => Ok(Uint8Array::new(&bytes).to_vec()),
                    Err(_) => Err("cannot be read; it may be a folder".to_owned()),
                }
            };
            let name = file.name();
            self.put(OpenedFile { name, content });
        });
    }
}

/// The page around the application.
pub struct WebHost {
    /// Incoming files.
    pub inbox: Rc<Inbox>,
}

impl Host for WebHost {
    fn address(&self) -> String {
        address()
    }

    fn shared(&mut self, link: &str) -> bool {
        shared(link);
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

    fn read_dropped(&mut self, file: Arc<dyn egui::DroppedFile + Send + Sync>) {
        if let Some(file) = file.web_file() {
            self.inbox.clone().take(file.clone());
        }
    }

    fn opened(&mut self) -> Option<OpenedFile> {
        self.inbox.files.borrow_mut().pop_front()
    }

    fn start(&mut self, job: Job) -> Option<Box<dyn Running>> {
        Some(Box::new(Worker::start(&job)?))
    }

    fn fill_screen(&mut self, _ctx: &egui::Context, on: bool) {
        fill_screen(on);
    }

    fn announce(&mut self, text: &str, event: bool) {
        announce(text, event);
    }
}
