//! A static file server for this machine or for a classroom.

use std::convert::Infallible;
use std::fs;
use std::future::Future;
use std::io::{self, Write as _};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};
use std::path::{Path, PathBuf};
use std::pin::{Pin, pin};
use std::sync::Arc;
use std::time::Duration;

use http_body_util::{Either, Full};
use hyper::body::{Bytes, Incoming};
use hyper::header::{self, HeaderName, HeaderValue};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Request, Response, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use qrcodegen::{QrCode, QrCodeEcc};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio_io_timeout::TimeoutStream;
use tower_http::services::ServeDir;
use tower_http::services::fs::{
    Backend, DefaultServeDirFallback, ServeFileSystemResponseBody, TokioBackend, TokioFile,
};
use tower_service::Service as _;

/// A file, or a sentence that says why there is none.
type Answer = Response<Either<ServeFileSystemResponseBody, Full<Bytes>>>;

/// What the server grants its readers.
#[derive(Clone, Copy)]
struct Limits {
    /// Connections answered at the same time. Further ones are told so.
    connections: usize,
    /// Time for a complete request, and for the next one on the same connection.
    request: Duration,
    /// Time without progress after which a reader that takes nothing of its answer is disconnected.
    stall: Duration,
    /// Time for everything: a reader that takes a little now and then holds its place no longer.
    total: Duration,
}

/// Browsers keep up to six open each: enough for six hundred of them.
const MAX_CONNECTIONS: usize = 4096;
/// Connections that are told at the same time that there are too many; later ones wait in the system's queue.
const REFUSALS: usize = 32;
/// Time for the request of a refused connection.
const REFUSAL_TIME: Duration = Duration::from_secs(1);
/// Open files beside those of the connections: terminal, listener, timers.
const OTHER_FILES: usize = 16;
/// Bytes read from a file at a time.
const CHUNK: usize = 16 << 10;
/// Bytes of an answer that wait for its reader, and the longest request: a link of 32 000 characters may be in an address.
const BUFFER: usize = 64 << 10;
/// The system's disk cache answers most reads; further threads would only use memory.
const READING_THREADS: usize = 4;
/// Pause after the system has refused a connection, as for a lack of memory.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// Fields of every answer.
const FIELDS: [(HeaderName, &str); 6] = [
    (header::CACHE_CONTROL, "no-cache"),
    (header::VARY, "Accept-Encoding"),
    // A frame that is sandboxed without `allow-same-origin` is a page of another origin.
    (header::ACCESS_CONTROL_ALLOW_ORIGIN, "*"),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, "no-referrer"),
    (HeaderName::from_static("permissions-policy"), "camera=(), microphone=(), geolocation=()"),
];

/// Serves `folder` on an address of this machine and prints the link; port 0 takes any free entry. An address that
/// other machines can reach is also printed as a QR code.
pub fn serve(folder: &Path, host: IpAddr, port: u16) -> Result<(), String> {
    let runtime = runtime().map_err(|e| format!("cannot serve: {e}"))?;
    runtime.block_on(serve_files(folder, host, port))
}

fn runtime() -> io::Result<tokio::runtime::Runtime> {
    tokio::runtime::Builder::new_multi_thread().max_blocking_threads(READING_THREADS).enable_all().build()
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
    let limits = Limits {
        connections: possible_connections(),
        request: Duration::from_secs(30),
        stall: Duration::from_mins(1),
        total: Duration::from_hours(1),
    };
    match accept(&listener, folder, limits).await {}
}

/// As many connections as the system's limit of open files allows: each needs one for itself and one for the file that it reads.
fn possible_connections() -> usize {
    let wanted = 2 * MAX_CONNECTIONS + REFUSALS + OTHER_FILES;
    // A system that does not tell its limit grants at least 256.
    let files = rlimit::increase_nofile_limit(wanted as u64).unwrap_or(256);
    let free = usize::try_from(files).unwrap_or(wanted).min(wanted).saturating_sub(REFUSALS + OTHER_FILES);
    (free / 2).max(1)
}

/// Answers connections until the process ends.
async fn accept(listener: &TcpListener, folder: PathBuf, limits: Limits) -> Infallible {
    let files = ServeDir::with_backend(folder.clone(), Inside { folder })
        .precompressed_br()
        .precompressed_gzip()
        .ignore_multi_range_requests(true)
        .with_buf_chunk_size(CHUNK);
    let free = Arc::new(Semaphore::new(limits.connections));
    let refusals = Arc::new(Semaphore::new(REFUSALS));
    loop {
        let Ok((stream, _)) = listener.accept().await else {
            tokio::time::sleep(ACCEPT_PAUSE).await;
            continue;
        };
        if let Ok(permit) = free.clone().try_acquire_owned() {
            let (files, free) = (files.clone(), free.clone());
            let answer = move |request| {
                // Connections that only wait for their next request leave room for those that have one.
                let is_crowded = free.available_permits() < limits.connections / 4;
                let files = files.clone();
                async move {
                    let mut response = answer(files, request).await;
                    if is_crowded {
                        response.headers_mut().insert(header::CONNECTION, HeaderValue::from_static("close"));
                    }
                    response
                }
            };
            tokio::spawn(converse(stream, limits, answer, permit));
        } else if let Ok(permit) = refusals.clone().acquire_owned().await {
            let answer = move |_| async move { too_many(limits.connections) };
            let limits = Limits { request: REFUSAL_TIME, stall: REFUSAL_TIME, ..limits };
            tokio::spawn(converse(stream, limits, answer, permit));
        }
    }
}

/// Answers the requests of a connection until one of the two ends it, and returns its `permit`.
async fn converse<F: Future<Output = Answer> + Send>(
    stream: TcpStream,
    limits: Limits,
    answer: impl Fn(Request<Incoming>) -> F + Send,
    permit: OwnedSemaphorePermit,
) {
    let mut stream = pin!(TimeoutStream::new(stream));
    stream.as_mut().set_write_timeout_pinned(Some(limits.stall));
    let service = service_fn(|request| {
        let answer = answer(request);
        async {
            let mut response = answer.await;
            for (name, value) in FIELDS {
                response.headers_mut().insert(name, HeaderValue::from_static(value));
            }
            Ok::<_, Infallible>(response)
        }
    });
    let conversation = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(limits.request)
        .max_buf_size(BUFFER)
        .serve_connection(TokioIo::new(stream), service);
    // An error concerns only this connection: its reader has left, stalls, or speaks no HTTP.
    let _ = tokio::time::timeout(limits.total, conversation).await;
    drop(permit);
}

/// The requested file, or why there is none.
async fn answer(mut files: ServeDir<DefaultServeDirFallback, Inside>, mut request: Request<Incoming>) -> Answer {
    // The file service does not compare the condition, and without a range every answer is right.
    if request.headers().contains_key(header::IF_RANGE) {
        request.headers_mut().remove(header::RANGE);
    }
    let Ok(response) = files.call(request).await;
    let mut response = match response.status() {
        status @ StatusCode::NOT_FOUND => sentence(status, "no such file"),
        status @ StatusCode::METHOD_NOT_ALLOWED => sentence(status, "this server only serves files"),
        status @ StatusCode::INTERNAL_SERVER_ERROR => sentence(status, "the file cannot be read"),
        _ => response.map(Either::Left),
    };
    // All texts of the page are UTF-8.
    if let Some(kind) = response.headers_mut().get_mut(header::CONTENT_TYPE)
        && let Ok(text) = kind.to_str()
        && text.starts_with("text/")
        && !text.contains("charset")
        && let Ok(complete) = HeaderValue::try_from(format!("{text}; charset=utf-8"))
    {
        *kind = complete;
    }
    response
}

fn too_many(connections: usize) -> Answer {
    let text = format!("{connections} connections are open, the most that this server answers: reload in a minute\n");
    let mut response = sentence(StatusCode::SERVICE_UNAVAILABLE, text);
    let fields = response.headers_mut();
    fields.insert(header::CONNECTION, HeaderValue::from_static("close"));
    fields.insert(header::RETRY_AFTER, HeaderValue::from_static("60"));
    response
}

fn sentence(status: StatusCode, text: impl Into<Bytes>) -> Answer {
    let mut response = Response::new(Either::Right(Full::new(text.into())));
    *response.status_mut() = status;
    response.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static("text/plain; charset=utf-8"));
    response
}

/// The regular files inside a folder: a symbolic link out of it leads to nothing, and neither does a pipe, which would block.
#[derive(Clone)]
struct Inside {
    /// Without symbolic links.
    folder: PathBuf,
}

impl Inside {
    async fn resolve(self, path: PathBuf) -> io::Result<PathBuf> {
        let path = tokio::fs::canonicalize(path).await.map_err(|_| io::ErrorKind::NotFound)?;
        let kind = tokio::fs::metadata(&path).await?;
        let is_served = path.starts_with(&self.folder) && (kind.is_file() || kind.is_dir());
        if is_served { Ok(path) } else { Err(io::ErrorKind::NotFound.into()) }
    }
}

impl Backend for Inside {
    type File = TokioFile;
    type Metadata = fs::Metadata;
    type OpenFuture = Pin<Box<dyn Future<Output = io::Result<TokioFile>> + Send>>;
    type MetadataFuture = Pin<Box<dyn Future<Output = io::Result<fs::Metadata>> + Send>>;

    fn open(&self, path: PathBuf) -> Self::OpenFuture {
        let path = self.clone().resolve(path);
        Box::pin(async { TokioBackend.open(path.await?).await })
    }

    fn metadata(&self, path: PathBuf) -> Self::MetadataFuture {
        let path = self.clone().resolve(path);
        Box::pin(async { TokioBackend.metadata(path.await?).await })
    }
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

#[cfg(test)]
mod tests;
