//! Writes the font of the interface without its unused tables, which would only enlarge the download of the page.

use std::path::Path;
use std::{env, error, fs};

/// Tables of advance widths and heights by pixel size; only rasterisers that do not hint glyphs themselves use them.
const UNUSED_TABLES: [&[u8]; 2] = [b"hdmx", b"VDMX"];
/// Size in bytes of the file's header, of a table record, and of a `post` table without glyph names (version 3).
const HEADER_SIZE: usize = 12;
const RECORD_SIZE: usize = 16;
const POST_SIZE: usize = 32;

fn main() -> Result<(), Box<dyn error::Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    let font = strip_unused_tables(epaint_default_fonts::UBUNTU_LIGHT).ok_or("the font is not an OpenType file")?;
    let folder = env::var_os("OUT_DIR").ok_or("Cargo sets OUT_DIR")?;
    Ok(fs::write(Path::new(&folder).join("ubuntu-light.ttf"), font)?)
}

/// `font`, an OpenType file, without [`UNUSED_TABLES`] and glyph names. Checksums of tables are not updated; nothing reads them.
/// Source: OpenType specification 1.9.1, "Organization of an OpenType font" and "post".
fn strip_unused_tables(font: &[u8]) -> Option<Vec<u8>> {
    let number = |at: usize| Some(u32::from_be_bytes(font.get(at..at + 4)?.try_into().ok()?));
    let count = usize::from(u16::from_be_bytes(font.get(4..6)?.try_into().ok()?));
    let mut tables = Vec::new();
    for entry in font.get(HEADER_SIZE..HEADER_SIZE + count * RECORD_SIZE)?.chunks_exact(RECORD_SIZE) {
        let word = |at: usize| Some(u32::from_be_bytes(entry[at..at + 4].try_into().ok()?) as usize);
        let (offset, length) = (word(8)?, word(12)?);
        let mut table = font.get(offset..offset + length)?.to_vec();
        if &entry[..4] == b"post" {
            table.truncate(POST_SIZE);
            table.get_mut(..4)?.copy_from_slice(&0x0003_0000_u32.to_be_bytes());
        }
        if !UNUSED_TABLES.contains(&&entry[..4]) {
            tables.push((&entry[..8], table));
        }
    }
    let mut header = number(0)?.to_be_bytes().to_vec();
    let table_count = u16::try_from(tables.len()).ok()?;
    let (power, step) = (table_count.checked_ilog2()?, 16_u16 << table_count.checked_ilog2()?);
    for field in [table_count, step, u16::try_from(power).ok()?, 16 * table_count - step] {
        header.extend(field.to_be_bytes());
    }
    let mut bodies = Vec::new();
    for (tag_and_sum, table) in &tables {
        let offset = HEADER_SIZE + RECORD_SIZE * tables.len() + bodies.len();
        header.extend_from_slice(tag_and_sum);
        header.extend(u32::try_from(offset).ok()?.to_be_bytes());
        header.extend(u32::try_from(table.len()).ok()?.to_be_bytes());
        bodies.extend_from_slice(table);
        bodies.resize(bodies.len().next_multiple_of(4), 0);
    }
    header.extend(bodies);
    Some(header)
}
