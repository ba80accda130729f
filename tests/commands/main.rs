//! Tests of the command-line program: exit status, output and files.

#[path = "../common/mod.rs"]
mod common;

mod channels;
mod chart;
mod command_line;
mod ledger_files;
mod links;
mod loose;
mod map;
mod peaks;
mod program;
mod states;
mod survival;
mod sweep;
mod sweep_points;
mod tradeoff;
