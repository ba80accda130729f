//! A static file server for this machine or for a classroom.

use std::fs;
use std::io::{self, Write as _};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};
use std::path::{Component, Path, PathBuf};

use axum::Router;
use axum::extract::Request;
use axum::http::{HeaderName, Method, StatusCode, header};
use axum::response::{IntoResponse as _, Response};
use qrcodegen::{QrCode, QrCodeEcc};
use tokio::net::TcpListener;

use crate::pack::{CODINGS, hash};

/// Serves `folder` on an address of this machine and prints the link; port 0 takes any free entry. An address that
/// other machines can reach is also printed as a QR code.
pub fn serve(folder: &Path, host: IpAddr, port: u16) -> Result<(), String> {
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_io().build();
    let runtime = runtime.map_err(|e| format!("cannot serve: {e}"))?;
    runtime.block_on(serve_files(folder, host, port))
}

async fn serve_files(folder: &Path, host: IpAddr, port: u16) -> Result<(), String> {
    let folder = fs::canonicalize(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let listener =
        TcpListener::bind((host, port)).await.map_err(|e| format!("cannot serve on {host}, port {port}: {e}"))?;
    let bound = listener.local_addr();
    let port = bound.map_or(port, |address| address.port());
    let address = reachable_address(host);
    let link = format!("http://{}/", SocketAddr::new(address, port));
    let code = if address.is_loopback() { String::new() } else { qr(&link)? };
    // In one write, so that a program reading the output gets it whole.
    let printed = io::stdout().write_all(format!("{link}\n{code}").as_bytes());
    printed.map_err(|e| format!("standard output: {e}"))?;
    let files = Router::new().fallback(async move |request: Request| answer(&folder, &request));
    axum::serve(listener, files).await.map_err(|e| format!("the server stopped: {e}"))
}

/// The address at which other machines reach a server on `host`. If that stands for every address of this machine, it is the
/// one of the outgoing route.
fn reachable_address(host: IpAddr) -> IpAddr {
    if !host.is_unspecified() {
        return host;
    }
    // Nothing is sent: the system only looks up the route. The targets are addresses reserved for documentation.
    let (any, out): (IpAddr, IpAddr) = match host {
        IpAddr::V4(_) => (Ipv4Addr::UNSPECIFIED.into(), Ipv4Addr::new(192, 0, 2, 1).into()),
        IpAddr::V6(_) => (Ipv6Addr::UNSPECIFIED.into(), Ipv6Addr::new(0x2001, 0xdb8, 0, 0, 0, 0, 0, 1).into()),
    };
    let local = UdpSocket::bind((any, 0)).and_then(|socket| {
        socket.connect((out, 9))?;
        socket.local_addr()
    });
    match (local, host) {
        (Ok(address), _) => address.ip(),
        (Err(_), IpAddr::V4(_)) => Ipv4Addr::LOCALHOST.into(),
        (Err(_), IpAddr::V6(_)) => Ipv6Addr::LOCALHOST.into(),
    }
}

/// `text` as a QR code for a terminal with a dark background: each line has two rows of modules, and light modules are drawn.
fn qr(text: &str) -> Result<String, String> {
    /// Width of the light margin that scanners need, in modules.
    const QUIET_ZONE: i32 = 4;
    let code = QrCode::encode_text(text, QrCodeEcc::Medium).map_err(|e| format!("no QR code of {text}: {e}"))?;
    let size = code.size();
    let light = |x, y| !code.get_module(x, y);
    let mut lines = String::new();
    for y in (-QUIET_ZONE..size + QUIET_ZONE).step_by(2) {
        lines.extend((-QUIET_ZONE..size + QUIET_ZONE).map(|x| match (light(x, y), light(x, y + 1)) {
            (true, true) => '█',
            (true, false) => '▀',
            (false, true) => '▄',
            (false, false) => ' ',
        }));
        lines.push('\n');
    }
    Ok(lines)
}

fn answer(folder: &Path, request: &Request) -> Response {
    const MISSING: (StatusCode, &str) = (StatusCode::NOT_FOUND, "no such file");
    if !matches!(*request.method(), Method::GET | Method::HEAD) {
        let refused = "this server only serves files";
        return (StatusCode::METHOD_NOT_ALLOWED, refused).into_response();
    }
    file_response(folder, request).unwrap_or_else(|| MISSING.into_response())
}

/// The requested file; `None` if there is none.
fn file_response(folder: &Path, request: &Request) -> Option<Response> {
    let file = locate(folder, request.uri().path())?;
    let mut packed = CODINGS.iter().filter_map(|(coding, ending)| {
        let packed = file.with_added_extension(ending);
        (accepts(request, coding) && packed.is_file()).then_some((*coding, packed))
    });
    let (coding, source) = match packed.next() {
        Some((coding, packed)) => (Some(coding), packed),
        None => (None, file.clone()),
    };
    let bytes = fs::read(source).ok()?;
    let tag = format!("\"{:016x}\"", hash(&bytes));
    let known =
        field(request, header::IF_NONE_MATCH).is_some_and(|known| known.split(',').any(|known| known.trim() == tag));
    let fields = [
        (header::CONTENT_TYPE, media_type(&file)),
        (header::CACHE_CONTROL, "no-cache"),
        (header::ETAG, &tag),
        (header::VARY, "Accept-Encoding"),
        // A frame that is sandboxed without `allow-same-origin` is a page of another origin.
        (header::ACCESS_CONTROL_ALLOW_ORIGIN, "*"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
    ];
    Some(if known {
        (StatusCode::NOT_MODIFIED, fields).into_response()
    } else {
        let coding = coding.map(|coding| [(header::CONTENT_ENCODING, coding)]);
        (fields, coding, bytes).into_response()
    })
}

/// The file that `path` names inside `folder`; for a folder, its `index.html`.
fn locate(folder: &Path, path: &str) -> Option<PathBuf> {
    let relative = Path::new(path.trim_start_matches('/'));
    let is_plain = relative.components().all(|part| matches!(part, Component::Normal(_)));
    if !is_plain {
        return None;
    }
    let mut file = folder.join(relative);
    if file.is_dir() {
        // Without the slash, relative addresses in the page would not resolve.
        if !path.ends_with('/') {
            return None;
        }
        file.push("index.html");
    }
    file.is_file().then_some(file)
}

/// Value of the header field `name`.
fn field(request: &Request, name: HeaderName) -> Option<&str> {
    request.headers().get(name)?.to_str().ok()
}

fn accepts(request: &Request, coding: &str) -> bool {
    field(request, header::ACCEPT_ENCODING).is_some_and(|accepted| {
        accepted.split(',').any(|entry| {
            let (name, weight) = entry.split_once(';').unwrap_or((entry, ""));
            name.trim() == coding && !matches!(weight.trim(), "q=0" | "q=0.0")
        })
    })
}

fn media_type(file: &Path) -> &'static str {
    match file.extension().and_then(|e| e.to_str()) {
        Some("html") => "text/html; charset=utf-8",
        Some("js") => "text/javascript; charset=utf-8",
        Some("css") => "text/css; charset=utf-8",
        Some("svg") => "image/svg+xml",
        Some("png") => "image/png",
        Some("wasm") => "application/wasm",
        Some("webmanifest") => "application/manifest+json",
        _ => "application/octet-stream",
    }
}
