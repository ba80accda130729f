//! Tests of the window: frames, panels, links and input.
#![cfg(feature = "gui")]

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/pixels.rs"]
mod pixels;

mod bench_window;
mod claims;
mod clicks;
mod compare;
mod contrast;
mod costs;
mod desktop;
mod embed;
mod film;
mod focus;
mod frames;
mod golden;
mod hands;
mod headless_window;
mod hysteresis;
mod impacts;
mod instruments;
mod lecture;
mod lessons;
mod pace;
mod page;
mod pictures;
mod places;
mod present;
mod readings;
mod reload;
mod scene_list;
mod sound;
mod touch;
mod undo;
mod visit;
mod window;
mod worn;
