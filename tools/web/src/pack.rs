//! From the compiled library to a folder that any static host can serve.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use flate2::{Compression, write::GzEncoder};
use sha2::{Digest as _, Sha256};
use wasm_bindgen_cli_support::Bindgen;

use crate::licences::licences;

/// Base name of the files that wasm-bindgen generates.
const NAME: &str = "jointplay";
/// The page's own files, from the root of the project.
const PAGE: &str = "index.html";
/// Service worker that stores the page for offline use; it lists all its files.
const SERVICE_WORKER: &str = "web/offline.js";
/// Scripts, style and icons beside it, copied as they are.
const PARTS: [&str; 12] = [
    "web/stuck.js",
    "web/main.js",
    "web/host.js",
    "web/canvas.js",
    "web/mirror.js",
    "web/guest.js",
    "web/worker.js",
    "web/page.css",
    "web/icon.svg",
    "web/icon-192.png",
    "web/poster.webp",
    "web/page.webmanifest",
];

/// Licences of the fonts and libraries in the page.
const LICENCES: &str = "licences.txt";
/// Preview picture that other sites show; opening the page does not load it.
const PREVIEW: &str = "web/preview.png";

/// The environment variable with the address of the page, as for the program's links.
const ADDRESS: &str = "JOINTPLAY_PAGE";

/// Content codings of the precompressed copies beside a file, best first, each with its file extension.
const CODINGS: [(&str, &str); 2] = [("br", "br"), ("gzip", "gz")];

/// The page with the whole address of its preview, which programs that show previews need; unchanged if its `address` is not known.
fn with_address(page: &str, address: &str) -> String {
    let relative = "property=\"og:image\" content=\"";
    if !(address.starts_with("https://") || address.starts_with("http://")) || address.contains(['"', '<', '?', '#']) {
        return page.to_owned();
    }
    page.replace(relative, &format!("{relative}{}/", address.trim_end_matches('/')))
}

/// The project's folder.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Writes the page into `folder`, which is built from scratch and replaced only as a whole: each file, and beside it
/// `<file>.gz`. `compress`: also `<file>.br`, and a table of sizes is printed.
pub fn pack(library: &Path, folder: &Path, compress: bool) -> Result<(), String> {
    let root = root();
    check_replaceable(folder)?;
    let scratch = scratch_beside(folder)?;
    fs::create_dir_all(&scratch).map_err(|e| failed(&scratch, &e))?;

    Bindgen::new()
        .input_path(library)
        .web(true)
        .and_then(|bindgen| {
            bindgen
                .out_name(NAME)
                .typescript(false)
                .remove_name_section(true)
                .remove_producers_section(true)
                .generate(&scratch)
        })
        .map_err(|e| format!("{}: {e:#}", library.display()))?;

    let wasm = scratch.join(format!("{NAME}_bg.wasm"));
    let code = fs::read(&wasm).map_err(|e| failed(&wasm, &e))?;
    for part in PARTS {
        let from = root.join(part);
        let name = from.file_name().expect("a file");
        fs::copy(&from, scratch.join(name)).map_err(|e| failed(&from, &e))?;
    }
    let licences = licences(&root, "wasm32-unknown-unknown", &[])?;
    let to = scratch.join(LICENCES);
    fs::write(&to, &licences).map_err(|e| failed(&to, &e))?;
    let mut all = code.clone();
    for part in PARTS.map(|part| root.join(part)) {
        all.extend(fs::read(&part).map_err(|e| failed(&part, &e))?);
    }
    let from = root.join(PAGE);
    let page = fs::read_to_string(&from).map_err(|e| failed(&from, &e))?;
    let from = root.join(SERVICE_WORKER);
    let worker = fs::read_to_string(&from).map_err(|e| failed(&from, &e))?;
    all.extend(page.bytes().chain(worker.bytes()).chain(licences.bytes()));
    // Every address contains the build, so that a browser never combines new scripts with old code from its cache.
    let build = format!("{:016x}", hash(&all));
    let page = page.replace("{{build}}", &build).replace("{{wasm_bytes}}", &code.len().to_string());
    let page = with_address(&page, &std::env::var(ADDRESS).unwrap_or_default());
    let to = scratch.join(PAGE);
    fs::write(&to, page).map_err(|e| failed(&to, &e))?;
    for file in files(&scratch)? {
        if file.extension().is_some_and(|ending| ending == "js" || ending == "css") {
            let text = fs::read_to_string(&file).map_err(|e| failed(&file, &e))?;
            fs::write(&file, without_comments(&text)).map_err(|e| failed(&file, &e))?;
        }
    }
    let worker = without_comments(&worker).replace("{{build}}", &build).replace("{{files}}", &integrity(&scratch)?);
    let to = scratch.join(from.file_name().expect("a file"));
    fs::write(&to, worker).map_err(|e| failed(&to, &e))?;
    compress_all(&scratch, compress)?;
    let from = root.join(PREVIEW);
    fs::copy(&from, scratch.join(from.file_name().expect("a file"))).map_err(|e| failed(&from, &e))?;
    remove(folder)?;
    fs::rename(&scratch, folder).map_err(|e| failed(folder, &e))
}

/// A script or a style sheet without blank lines and lines of comments, which would add 6 kB to the download.
fn without_comments(text: &str) -> String {
    let mut inside = false;
    let code = text.lines().filter(|line| {
        let line = line.trim();
        let block = inside || line.starts_with("/*");
        inside = block && !line.ends_with("*/");
        !block && !line.is_empty() && !line.starts_with("//")
    });
    code.flat_map(|line| [line, "\n"]).collect()
}

/// An unused folder on the same disk.
fn scratch_beside(folder: &Path) -> Result<PathBuf, String> {
    let name = folder.file_name().ok_or_else(|| {
        let folder = folder.display();
        format!("{folder}: name the folder itself, e.g. dist")
    })?;
    let name = format!(".{}.{}", name.to_string_lossy(), std::process::id());
    let scratch = folder.with_file_name(name);
    // Left by a killed process that had the same ID.
    remove(&scratch)?;
    Ok(scratch)
}

/// Only an earlier page or an empty folder may be replaced.
fn check_replaceable(folder: &Path) -> Result<(), String> {
    let Ok(mut entries) = fs::read_dir(folder) else {
        return Ok(());
    };
    let is_page = folder.join(format!("{NAME}_bg.wasm")).exists();
    if is_page || entries.next().is_none() {
        return Ok(());
    }
    Err(format!("{}: contains something other than this page; name an empty or a new folder", folder.display()))
}

/// The files of `folder`, in order.
pub fn files(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let entries = fs::read_dir(folder).map_err(|e| failed(folder, &e))?;
    let mut files: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    files.sort();
    Ok(files)
}

/// Integrity hash of each file in `folder`, as properties of a JavaScript object.
fn integrity(folder: &Path) -> Result<String, String> {
    let mut properties = Vec::new();
    for file in files(folder)? {
        let bytes = fs::read(&file).map_err(|e| failed(&file, &e))?;
        let name = file.file_name().expect("a file").to_string_lossy();
        let sum = BASE64_STANDARD.encode(Sha256::digest(&bytes));
        properties.push(format!("    '{name}': 'sha256-{sum}',"));
    }
    Ok(properties.join("\n"))
}

/// Writes every file of `folder` in the codings that browsers accept; brotli, which takes a minute, only `with_brotli`.
fn compress_all(folder: &Path, with_brotli: bool) -> Result<(), String> {
    let (mut raw, mut small) = (0, 0);
    if with_brotli {
        println!("{:>10} {:>10}  file", "bytes", "brotli");
    }
    for file in files(folder)? {
        let bytes = fs::read(&file).map_err(|e| failed(&file, &e))?;
        for (coding, ending) in CODINGS {
            let packed = match coding {
                "br" if !with_brotli => continue,
                "br" => brotli(&bytes),
                _ => gzip(&bytes),
            };
            let packed = packed.map_err(|e| failed(&file, &e))?;
            let to = file.with_added_extension(ending);
            fs::write(&to, &packed).map_err(|e| failed(&to, &e))?;
            if coding == "br" {
                let name = file.file_name().expect("a file").to_string_lossy();
                println!("{:>10} {:>10}  {name}", bytes.len(), packed.len());
                (raw, small) = (raw + bytes.len(), small + packed.len());
            }
        }
    }
    if with_brotli {
        println!("{raw:>10} {small:>10}  together");
    }
    Ok(())
}

fn gzip(bytes: &[u8]) -> std::io::Result<Vec<u8>> {
    let mut writer = GzEncoder::new(Vec::new(), Compression::default());
    writer.write_all(bytes)?;
    writer.finish()
}

fn brotli(bytes: &[u8]) -> std::io::Result<Vec<u8>> {
    const BUFFER: usize = 1 << 16;
    const QUALITY: u32 = 11;
    const WINDOW: u32 = 24;
    let mut writer = brotli::CompressorWriter::new(Vec::new(), BUFFER, QUALITY, WINDOW);
    writer.write_all(bytes)?;
    Ok(writer.into_inner())
}

/// FNV-1a, 64 bit.
fn hash(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3))
}

fn remove(folder: &Path) -> Result<(), String> {
    match fs::remove_dir_all(folder) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(failed(folder, &e)),
        _ => Ok(()),
    }
}

pub fn failed(path: &Path, error: &std::io::Error) -> String {
    format!("{}: {error}", path.display())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_preview_has_a_whole_address_where_that_of_the_page_is_known() {
        let page = fs::read_to_string(root().join(PAGE)).expect("the page");
        assert_eq!(page.matches("property=\"og:image\"").count(), 1);
        for address in ["https://example.org/lab/", "https://example.org/lab"] {
            let packed = with_address(&page, address);
            assert!(packed.contains("property=\"og:image\" content=\"https://example.org/lab/preview.png\""));
        }
        for unknown in ["", "example.org", "https://example.org/\"><script>"] {
            assert_eq!(with_address(&page, unknown), page);
        }
    }
}
