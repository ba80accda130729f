//! Browser entry: the same application on a canvas (`web/main.js` calls it), and runs without a picture.

#[cfg(all(target_arch = "wasm32", feature = "gui"))]
mod crash;
#[cfg(all(target_arch = "wasm32", feature = "gui"))]
mod host;
#[cfg(all(target_arch = "wasm32", feature = "gui"))]
mod mirror;
#[cfg(all(target_arch = "wasm32", feature = "gui"))]
mod page;
#[cfg(target_arch = "wasm32")]
mod run;
#[cfg(all(target_arch = "wasm32", feature = "gui"))]
mod work;

#[cfg(all(target_arch = "wasm32", feature = "gui"))]
pub use page::Page;
#[cfg(target_arch = "wasm32")]
pub use run::{Run, choices, scenes, version};
#[cfg(all(target_arch = "wasm32", feature = "gui"))]
pub use work::perform;
