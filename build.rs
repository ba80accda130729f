//! Writes the face of the interface without the tables that nothing here reads, which a page would be loaded with.

use std::path::Path;
use std::{env, error, fs};

/// Advance widths and heights by pixel size, for rasterisers without hinting of their own.
const UNREAD: [&[u8]; 2] = [b"hdmx", b"VDMX"];
/// Length of the file's head, of a table's entry, and of a `post` table without names of glyphs (version 3).
const HEAD: usize = 12;
const ENTRY: usize = 16;
const POST: usize = 32;

fn main() -> Result<(), Box<dyn error::Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    let face = without_unread(epaint_default_fonts::UBUNTU_LIGHT).ok_or("the face is no OpenType file")?;
    let folder = env::var_os("OUT_DIR").ok_or("Cargo sets OUT_DIR")?;
    Ok(fs::write(Path::new(&folder).join("ubuntu-light.ttf"), face)?)
}

/// `face`, an OpenType file, without the tables of [`UNREAD`] and the names of glyphs. Checksums of tables stay; nothing reads them.
/// Source: OpenType specification 1.9.1, "Organization of an OpenType font" and "post".
fn without_unread(face: &[u8]) -> Option<Vec<u8>> {
    let number = |at: usize| Some(u32::from_be_bytes(face.get(at..at + 4)?.try_into().ok()?));
    let count = usize::from(u16::from_be_bytes(face.get(4..6)?.try_into().ok()?));
    let mut tables = Vec::new();
    for entry in face.get(HEAD..HEAD + count * ENTRY)?.chunks_exact(ENTRY) {
        let word = |at: usize| Some(u32::from_be_bytes(entry[at..at + 4].try_into().ok()?) as usize);
        let (offset, length) = (word(8)?, word(12)?);
        let mut table = face.get(offset..offset + length)?.to_vec();
        if &entry[..4] == b"post" {
            table.truncate(POST);
            table.get_mut(..4)?.copy_from_slice(&0x0003_0000_u32.to_be_bytes());
        }
        if !UNREAD.contains(&&entry[..4]) {
            tables.push((&entry[..8], table));
        }
    }
    let mut head = number(0)?.to_be_bytes().to_vec();
    let kept = u16::try_from(tables.len()).ok()?;
    let (power, step) = (kept.checked_ilog2()?, 16_u16 << kept.checked_ilog2()?);
    for field in [kept, step, u16::try_from(power).ok()?, 16 * kept - step] {
        head.extend(field.to_be_bytes());
    }
    let mut bodies = Vec::new();
    for (tag_and_sum, table) in &tables {
        let offset = HEAD + ENTRY * tables.len() + bodies.len();
        head.extend_from_slice(tag_and_sum);
        head.extend(u32::try_from(offset).ok()?.to_be_bytes());
        head.extend(u32::try_from(table.len()).ok()?.to_be_bytes());
        bodies.extend_from_slice(table);
        bodies.resize(bodies.len().next_multiple_of(4), 0);
    }
    head.extend(bodies);
    Some(head)
}
