//! A static server for this machine only.

use std::fs::{self, File};
use std::path::{Component, Path, PathBuf};

use tiny_http::{Header, Method, Request, Response, Server};

/// Serves `folder` on 127.0.0.1 and prints the link; port 0 takes any free one.
pub fn serve(folder: &Path, port: u16) -> Result<(), String> {
    let folder = fs::canonicalize(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let server = Server::http(("127.0.0.1", port))
        .map_err(|e| format!("cannot serve on 127.0.0.1, port {port}: {e}"))?;
    let address = server.server_addr();
    println!("http://{address}/");
    for request in server.incoming_requests() {
        let sent = match answer(&folder, &request) {
            Ok(response) => request.respond(response),
            Err((code, text)) => {
                request.respond(Response::from_string(text).with_status_code(code))
            }
        };
        // A browser may hang up at any time; that is its affair.
        if let Err(error) = sent {
            eprintln!("note: {error}");
        }
    }
    Ok(())
}

fn answer(folder: &Path, request: &Request) -> Result<Response<File>, (u16, &'static str)> {
    if !matches!(request.method(), Method::Get | Method::Head) {
        return Err((405, "this server only gives files out"));
    }
    let path = request.url().split(['?', '#']).next().unwrap_or("/");
    let file = locate(folder, path).ok_or((404, "no such file"))?;
    let packed = file.with_added_extension("br");
    let compressed = accepts_brotli(request) && packed.is_file();
    let open = File::open(if compressed { &packed } else { &file });
    let mut response = Response::from_file(open.map_err(|_| (404, "no such file"))?);
    response.add_header(header("Content-Type", media_type(&file)));
    response.add_header(header("Cache-Control", "no-cache"));
    if compressed {
        response.add_header(header("Content-Encoding", "br"));
    }
    Ok(response)
}

/// The file that `path` names inside `folder`; a folder's is its `index.html`.
fn locate(folder: &Path, path: &str) -> Option<PathBuf> {
    let relative = Path::new(path.trim_start_matches('/'));
    let plain = relative
        .components()
        .all(|part| matches!(part, Component::Normal(_)));
    if !plain {
        return None;
    }
    let mut file = folder.join(relative);
    if file.is_dir() {
        // Without the slash the page's own relative addresses would miss.
        if !path.ends_with('/') {
            return None;
        }
        file.push("index.html");
    }
    file.is_file().then_some(file)
}

fn accepts_brotli(request: &Request) -> bool {
    request.headers().iter().any(|header| {
        header.field.equiv("Accept-Encoding") && {
            let value = header.value.as_str();
            value.split(',').any(|coding| coding.trim() == "br")
        }
    })
}

fn media_type(file: &Path) -> &'static str {
    match file.extension().and_then(|e| e.to_str()) {
        Some("html") => "text/html; charset=utf-8",
        Some("js") => "text/javascript; charset=utf-8",
        Some("css") => "text/css; charset=utf-8",
        Some("svg") => "image/svg+xml",
        Some("wasm") => "application/wasm",
        _ => "application/octet-stream",
    }
}

fn header(name: &str, value: &str) -> Header {
    Header::from_bytes(name, value).expect("plain ASCII")
}
