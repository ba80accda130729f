//! The module `jointplay._native`: scenes, runs, simulations and sweeps for the package in `python/jointplay`, which documents
//! them. SI units everywhere; text with a unit is accepted where a number is.
//!
//! Work runs without the interpreter's lock and checks for Ctrl-C between steps (`interpreter`). Errors become the exceptions of
//! `jointplay.errors`.

mod control;
mod errors;
mod geometry;
mod interpreter;
mod machine;
mod quantity;
#[cfg(feature = "render")]
mod render;
mod report;
mod run;
mod scene;
mod simulation;
mod study;
mod sweep;
mod tradeoff;

use pyo3::prelude::*;

/// Name and version of the program, as it writes them into its files.
const WRITER: [&str; 2] = ["jointplay", env!("CARGO_PKG_VERSION")];

/// The parts of `jointplay` that are written in Rust.
#[pymodule]
mod _native {
    use pyo3::prelude::*;

    use super::WRITER;
    #[cfg(feature = "render")]
    #[pymodule_export]
    use super::render::render;
    #[pymodule_export]
    use super::run::{run, wear_on};
    #[pymodule_export]
    use super::scene::{PyScene, scenes};
    #[pymodule_export]
    use super::simulation::{PySimulation, PyState};
    #[pymodule_export]
    use super::study::{PyStudy, matching_keys, provenance_of, read_duration, read_number};
    #[pymodule_export]
    use super::sweep::PySweep;
    #[pymodule_export]
    use super::tradeoff::tradeoff;

    /// Its version is that of the program.
    #[pymodule_init]
    fn version(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", WRITER[1])
    }
}
