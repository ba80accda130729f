//! Long computations in a web worker, both sides: `web/worker.js` is the worker, `web/host.js` manages it on the page.

use std::ops::ControlFlow;

use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;
use wasm_bindgen_futures::js_sys::Promise;

use crate::analysis::task::{self, Job, Message};
use crate::app::BackgroundTask;

#[wasm_bindgen]
extern "C" {
    /// In the worker: posts a message to the page.
    #[wasm_bindgen(js_namespace = jointplayWork)]
    fn post(message: &str);
    /// In the worker: the promise to await before continuing, if any.
    #[wasm_bindgen(js_namespace = jointplayWork)]
    fn rest() -> Option<Promise>;
    /// On the page: starts a worker for a job and returns its number.
    #[wasm_bindgen(js_namespace = jointplayHost, js_name = startWork)]
    fn start_work(job: &str) -> Option<u32>;
    /// On the page: the next message of a worker, if any.
    #[wasm_bindgen(js_namespace = jointplayHost, js_name = pollWork)]
    fn poll_work(worker: u32) -> Option<String>;
    /// On the page: sets the idle time of a worker, as a multiple of its computing time.
    #[wasm_bindgen(js_namespace = jointplayHost, js_name = restWork)]
    fn rest_work(worker: u32, rest: f64);
    /// On the page: ends a worker.
    #[wasm_bindgen(js_namespace = jointplayHost, js_name = endWork)]
    fn end_work(worker: u32);
}

fn post_message(message: &Message) {
    // Serialising plain data cannot fail.
    post(&serde_json::to_string(message).expect("a message is JSON"));
}

/// In the worker: computes a job, given as JSON, and posts each message as JSON.
#[wasm_bindgen]
pub async fn perform(job: String) {
    std::panic::set_hook(Box::new(|info| {
        post_message(&Message::Failed(format!("internal error in the computation: {info}")));
    }));
    let job = match serde_json::from_str::<Job>(&job) {
        Ok(job) => job,
        Err(error) => return post_message(&Message::Failed(format!("not a computation: {error}"))),
    };
    let mut send = |message| {
        post_message(&message);
        // The page terminates the worker to cancel the job.
        ControlFlow::Continue(())
    };
    let mut wait = async || {
        if let Some(promise) = rest() {
            // The promise is never rejected.
            let _ = JsFuture::from(promise).await;
        }
    };
    task::perform_with_rests(&job, &mut send, &mut wait).await;
}

/// On the page: a running worker, terminated on drop.
pub struct Worker {
    number: u32,
    finished: bool,
}

impl Worker {
    /// Starts `job`; `None` where the browser has no workers.
    pub fn start(job: &Job) -> Option<Self> {
        let job = serde_json::to_string(job).ok()?;
        Some(Self { number: start_work(&job)?, finished: false })
    }
}

impl BackgroundTask for Worker {
    fn poll(&mut self) -> Option<Message> {
        if self.finished {
            return None;
        }
        let text = poll_work(self.number)?;
        let message = serde_json::from_str(&text)
            .unwrap_or_else(|_| Message::Failed(format!("the computation was aborted: {text}")));
        if matches!(message, Message::Done | Message::Failed(_)) {
            self.finished = true;
            end_work(self.number);
        }
        Some(message)
    }

    fn rest(&mut self, rest: f64) {
        rest_work(self.number, rest);
    }

    fn cancel(&mut self) {
        end_work(self.number);
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.cancel();
    }
}
