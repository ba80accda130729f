//! Builds and serves the page of Jointplay.
//!
//! `jointplay-web pack LIBRARY.wasm FOLDER [--compress]` writes the page; `jointplay-web serve FOLDER [PORT [HOST]]` serves a folder
//! until it is stopped: to this machine only, or on its address HOST (0.0.0.0: all its addresses). `jointplay-web licences TARGET
//! [FEATURES…]` prints the licences of what the program contains for a target of Rust, built with these arguments of cargo.

mod licences;
mod pack;
mod serve;

use std::net::{IpAddr, Ipv4Addr};
use std::path::Path;
use std::process::ExitCode;

const USAGE: &str = "usage: jointplay-web pack LIBRARY.wasm FOLDER [--compress]
       jointplay-web serve FOLDER [PORT [HOST]]
       jointplay-web licences TARGET [--no-default-features] [--features FEATURES]";

/// An address that only this machine can reach.
const LOCALHOST: IpAddr = IpAddr::V4(Ipv4Addr::LOCALHOST);

fn number(port: &str) -> Result<u16, String> {
    let wrong = |_| format!("`{port}` is not a port: allowed 0 to 65535");
    port.parse().map_err(wrong)
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let outcome = match arguments[..] {
        ["pack", library, folder] => pack::pack(Path::new(library), Path::new(folder), false),
        ["pack", library, folder, "--compress"] => pack::pack(Path::new(library), Path::new(folder), true),
        ["serve", folder] => serve::serve(Path::new(folder), LOCALHOST, 0),
        ["serve", folder, port] => number(port).and_then(|port| serve::serve(Path::new(folder), LOCALHOST, port)),
        ["serve", folder, port, host] => number(port).and_then(|port| {
            let host = host.parse().map_err(|_| {
                format!("`{host}` is not an IP address of this machine; 0.0.0.0 stands for all its addresses")
            });
            serve::serve(Path::new(folder), host?, port)
        }),
        ["licences", target, ref features @ ..] => {
            licences::licences(&pack::root(), target, features).map(|text| print!("{text}"))
        }
        _ => Err(USAGE.to_owned()),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(reason) => {
            eprintln!("error: {reason}");
            ExitCode::FAILURE
        }
    }
}
