//! The server over real connections, with limits small enough to reach.

use std::io::{ErrorKind, Read as _};
use std::net::{SocketAddr, TcpStream};
use std::sync::atomic::{AtomicUsize, Ordering};

use super::*;

/// Longer than any test waits for an answer.
const PATIENT: Limits = {
    let long = Duration::from_mins(10);
    Limits { connections: 64, request: long, stall: long, total: long }
};
/// Short enough to wait for.
const IMPATIENT: Duration = Duration::from_millis(300);
/// More than the system stores between the two ends of a connection.
const LARGE: usize = 32 << 20;

/// A server of a folder of its own.
struct Server {
    address: SocketAddr,
    folder: PathBuf,
    _runtime: tokio::runtime::Runtime,
}

/// Serves the folder `page` below a temporary one; `files` are inside it.
fn serve_with(limits: Limits, files: &[(&str, &[u8])]) -> Server {
    static COUNT: AtomicUsize = AtomicUsize::new(0);
    let number = COUNT.fetch_add(1, Ordering::Relaxed);
    let folder = std::env::temp_dir().join(format!("jointplay-web-{}-{number}", std::process::id()));
    let page = folder.join("page");
    fs::create_dir_all(&page).expect("a folder");
    for (name, bytes) in files {
        fs::write(page.join(name), bytes).expect("a file");
    }
    let runtime = runtime().expect("a runtime");
    let listener = runtime.block_on(TcpListener::bind((Ipv4Addr::LOCALHOST, 0))).expect("a port");
    let address = listener.local_addr().expect("an address");
    let page = page.canonicalize().expect("a folder");
    runtime.spawn(async move { accept(&listener, page, limits).await });
    Server { address, folder, _runtime: runtime }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.folder);
    }
}

impl Server {
    /// A connection that has sent `text`.
    fn connect(&self, text: &str) -> TcpStream {
        let mut stream = TcpStream::connect(self.address).expect("a connection");
        stream.set_read_timeout(Some(Duration::from_mins(1))).expect("a limit");
        stream.write_all(text.as_bytes()).expect("a request");
        stream
    }

    /// Head and body of the answer to a request with these `fields`, after which the connection is closed.
    fn ask(&self, method: &str, path: &str, fields: &str) -> (String, Vec<u8>) {
        let request = format!("{method} {path} HTTP/1.1\r\nHost: here\r\nConnection: close\r\n{fields}\r\n");
        let mut answer = Vec::new();
        self.connect(&request).read_to_end(&mut answer).expect("an answer");
        let end = answer.windows(4).position(|four| four == b"\r\n\r\n").expect("a head") + 4;
        let body = answer.split_off(end);
        (String::from_utf8(answer).expect("a head in ASCII"), body)
    }

    fn get(&self, path: &str, fields: &str) -> (String, Vec<u8>) {
        self.ask("GET", path, fields)
    }
}

/// Reads what arrives until the server ends the connection; a reset is an end, too.
fn wait_for_end(stream: &mut TcpStream) -> usize {
    let mut bytes = Vec::new();
    match stream.read_to_end(&mut bytes) {
        Err(e) if e.kind() != ErrorKind::ConnectionReset => panic!("the connection is not ended: {e}"),
        _ => bytes.len(),
    }
}

const REQUEST: &str = "GET / HTTP/1.1\r\nHost: here\r\n\r\n";
const PAGE: (&str, &[u8]) = ("index.html", b"<p>page");

#[test]
fn parts_of_a_file_are_served_and_a_conditional_or_multiple_range_gets_the_whole() {
    let digits = b"0123456789";
    let server = serve_with(PATIENT, &[("digits.wasm", digits)]);
    let range = |fields| {
        let (head, body) = server.get("/digits.wasm", fields);
        (head.split(' ').nth(1).expect("a status").to_owned(), body)
    };
    assert_eq!(range("Range: bytes=2-4\r\n"), ("206".to_owned(), b"234".to_vec()));
    assert_eq!(range("Range: bytes=-3\r\n"), ("206".to_owned(), b"789".to_vec()));
    assert_eq!(range("Range: bytes=20-\r\n").0, "416");
    assert_eq!(range("Range: bytes=0-1, 4-5\r\n"), ("200".to_owned(), digits.to_vec()));
    // The part of another version would be joined to it.
    assert_eq!(range("Range: bytes=2-4\r\nIf-Range: \"old\"\r\n"), ("200".to_owned(), digits.to_vec()));
    let (head, body) = server.ask("HEAD", "/digits.wasm", "");
    assert!(head.contains("content-length: 10\r\n") && body.is_empty(), "{head}");
}

#[test]
fn every_answer_has_the_documented_fields_and_its_type() {
    let files: [(&str, &[u8]); 5] =
        [PAGE, ("a.js", b"0"), ("a.wasm", b"\0asm"), ("page.webmanifest", b"{}"), ("licences.txt", "§".as_bytes())];
    let server = serve_with(PATIENT, &files);
    for (path, status, kind) in [
        ("/", "200", "text/html; charset=utf-8"),
        ("/a.js?build", "200", "text/javascript; charset=utf-8"),
        ("/a.wasm", "200", "application/wasm"),
        ("/page.webmanifest", "200", "application/manifest+json"),
        ("/licences.txt", "200", "text/plain; charset=utf-8"),
        ("/none", "404", "text/plain; charset=utf-8"),
    ] {
        let (head, body) = server.get(path, "");
        assert!(head.starts_with(&format!("HTTP/1.1 {status} ")), "{path}: {head}");
        assert!(head.contains(&format!("content-type: {kind}\r\n")), "{path}: {head}");
        assert!(!body.is_empty(), "{path}");
        for (name, value) in FIELDS {
            assert!(head.contains(&format!("{name}: {value}\r\n")), "{path}: {head}");
        }
    }
}

#[test]
fn compressed_copies_are_served_to_readers_that_accept_them() {
    let server = serve_with(PATIENT, &[("a.wasm", b"plain"), ("a.wasm.gz", b"small"), ("a.wasm.br", b"less"), PAGE]);
    for (accepted, coding, body) in [
        ("gzip, deflate, br", Some("br"), &b"less"[..]),
        ("gzip, br;q=0", Some("gzip"), b"small"),
        ("identity", None, b"plain"),
    ] {
        let (head, found) = server.get("/a.wasm", &format!("Accept-Encoding: {accepted}\r\n"));
        assert_eq!(found, body, "{accepted}");
        assert_eq!(
            head.split("content-encoding: ").nth(1).map(|rest| rest.split('\r').next().expect("a coding")),
            coding
        );
        assert!(head.contains("content-type: application/wasm\r\n"), "{head}");
    }
    // There is no compressed copy.
    assert_eq!(server.get("/", "Accept-Encoding: br, gzip\r\n").1, PAGE.1);
}

#[cfg(unix)]
#[test]
fn a_link_out_of_the_folder_leads_nowhere_and_one_inside_works() {
    use std::os::unix::fs::symlink;
    let server = serve_with(PATIENT, &[PAGE, ("a.js", b"plain")]);
    let (outside, page) = (&server.folder, server.folder.join("page"));
    fs::create_dir(outside.join("private")).expect("a folder");
    fs::write(outside.join("private/secret"), "secret").expect("a file");
    // Begins with the name of the folder.
    fs::create_dir(outside.join("page-of-another")).expect("a folder");
    fs::write(outside.join("page-of-another/secret"), "secret").expect("a file");
    let link = |to: PathBuf, name: &str| symlink(to, page.join(name)).expect("a link");
    link(outside.join("private/secret"), "file");
    link(outside.join("private"), "private");
    link(outside.join("page-of-another"), "other");
    link("../private/secret".into(), "relative");
    link(outside.join("private/secret"), "a.js.br");
    link("a.js".into(), "inside.js");
    for path in
        ["/file", "/private/secret", "/other/secret", "/relative", "/../private/secret", "/%2e%2e/private/secret"]
    {
        let (head, body) = server.get(path, "");
        assert!(head.starts_with("HTTP/1.1 404 "), "{path}: {head}");
        assert_eq!(body, b"no such file", "{path}");
    }
    assert_eq!(server.get("/inside.js", "").1, b"plain");
    assert_eq!(server.get("/a.js", "Accept-Encoding: br\r\n").1, b"plain");
}

#[test]
fn further_connections_are_told_that_there_are_too_many_and_served_once_others_have_ended() {
    let limits = Limits { connections: 3, ..PATIENT };
    let server = serve_with(limits, &[PAGE]);
    let open: Vec<_> = (0..limits.connections).map(|_| server.connect("")).collect();
    let (head, body) = server.get("/", "");
    assert!(head.starts_with("HTTP/1.1 503 "), "{head}");
    assert!(head.contains("retry-after: ") && head.contains("connection: close\r\n"), "{head}");
    assert!(String::from_utf8_lossy(&body).starts_with("3 connections are open"));
    drop(open);
    while server.get("/", "").0.starts_with("HTTP/1.1 503 ") {}
    assert_eq!(server.get("/", "").1, PAGE.1);
}

#[test]
fn idle_connections_are_not_kept_where_few_are_free() {
    let server = serve_with(Limits { connections: 8, ..PATIENT }, &[PAGE]);
    let kept: Vec<_> = (0..5).map(|_| server.connect("")).collect();
    let mut one = server.connect(REQUEST);
    let mut answer = [0; 1024];
    let count = one.read(&mut answer).expect("an answer");
    assert!(!String::from_utf8_lossy(&answer[..count]).contains("connection: close"));
    let (_seventh, mut eighth) = (server.connect(""), server.connect(REQUEST));
    assert!(wait_for_end(&mut eighth) > PAGE.1.len());
    drop(kept);
}

#[test]
fn half_a_request_and_an_idle_connection_are_ended() {
    let server = serve_with(Limits { request: IMPATIENT, ..PATIENT }, &[PAGE]);
    assert_eq!(wait_for_end(&mut server.connect("")), 0);
    assert_eq!(wait_for_end(&mut server.connect("GET / HTTP/1.1\r\nHost: he")), 0);
    // One that has had its answer.
    assert!(wait_for_end(&mut server.connect(REQUEST)) > PAGE.1.len());
}

#[test]
fn a_link_of_any_length_may_be_in_the_address_and_a_longer_one_is_refused() {
    let server = serve_with(PATIENT, &[PAGE]);
    assert_eq!(server.get(&format!("/?text={}", "x".repeat(32_000)), "").1, PAGE.1);
    let (head, _) = server.get(&format!("/?text={}", "x".repeat(BUFFER)), "");
    assert!(head.starts_with("HTTP/1.1 4"), "{head}");
}

const LARGE_REQUEST: &str = "GET /large HTTP/1.1\r\nHost: here\r\nConnection: close\r\n\r\n";

#[test]
fn readers_that_take_nothing_or_too_long_are_disconnected() {
    for limits in [Limits { stall: IMPATIENT, ..PATIENT }, Limits { total: IMPATIENT, ..PATIENT }] {
        let server = serve_with(Limits { connections: 1, ..limits }, &[("large", &vec![7; LARGE])]);
        let mut reader = server.connect(LARGE_REQUEST);
        // The only connection becomes free although this reader stays.
        while server.ask("HEAD", "/large", "").0.starts_with("HTTP/1.1 503 ") {}
        assert!(wait_for_end(&mut reader) < LARGE);
    }
}

#[test]
fn a_slow_reader_gets_everything() {
    // Long enough for a busy machine, and shorter than the whole takes.
    let stall = Duration::from_secs(1);
    let server = serve_with(Limits { stall, ..PATIENT }, &[("large", &vec![7; LARGE])]);
    let mut reader = server.connect(LARGE_REQUEST);
    let (mut received, mut part) = (0, vec![0; LARGE / 8]);
    loop {
        std::thread::sleep(stall / 6);
        match reader.read(&mut part).expect("more") {
            0 => break,
            count => received += count,
        }
    }
    assert!(received > LARGE, "{received} bytes");
}
