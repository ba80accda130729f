//! Makes and serves the page of Jointplay.
//!
//! `jointplay-web pack LIBRARY.wasm FOLDER [--compress]` writes the page; `jointplay-web serve FOLDER [PORT]` serves a folder on
//! this machine until it is ended.

mod pack;
mod serve;

use std::path::Path;
use std::process::ExitCode;

const USAGE: &str = "usage: jointplay-web pack LIBRARY.wasm FOLDER [--compress]
       jointplay-web serve FOLDER [PORT]";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match arguments[..] {
        ["pack", library, folder] => pack::pack(Path::new(library), Path::new(folder), false),
        ["pack", library, folder, "--compress"] => {
            pack::pack(Path::new(library), Path::new(folder), true)
        }
        ["serve", folder] => serve::serve(Path::new(folder), 0),
        ["serve", folder, port] => match port.parse() {
            Ok(port) => serve::serve(Path::new(folder), port),
            Err(_) => Err(format!("`{port}` is no port: it must be 0 to 65535")),
        },
        _ => Err(USAGE.to_owned()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(reason) => {
            eprintln!("error: {reason}");
            ExitCode::FAILURE
        }
    }
}
