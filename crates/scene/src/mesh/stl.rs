//! STL reader, text and binary.

use super::{Builder, Fault, MeshFault, coordinate, offset, text};

/// Sizes of the binary header with the triangle count, and of a triangle record, bytes.
const HEAD: usize = 84;
const TRIANGLE: usize = 50;

pub(super) fn read(bytes: &[u8]) -> Result<Builder, Fault> {
    // Many binary files begin with `solid`, too: their length tells them apart.
    let count = bytes.get(80..HEAD).and_then(|count| count.try_into().ok());
    let count = count.map(|count| u32::from_le_bytes(count) as usize);
    let length = |count: usize| count.saturating_mul(TRIANGLE).saturating_add(HEAD);
    let begins = bytes.trim_ascii_start();
    let begins = begins.get(..5).unwrap_or_default();
    let solid = begins.eq_ignore_ascii_case(b"solid");
    match count {
        Some(count) if bytes.len() == length(count) => binary(bytes),
        _ if solid => read_text(text(bytes)?),
        _ if bytes.is_empty() => Err(Fault::at(0, MeshFault::Empty)),
        Some(count) => {
            Err(Fault::at(80, MeshFault::Length { triangles: count, wanted: length(count), bytes: bytes.len() }))
        }
        None => Err(Fault::at(0, MeshFault::NotStl)),
    }
}

fn binary(bytes: &[u8]) -> Result<Builder, Fault> {
    let mut out = Builder::default();
    for (i, triangle) in bytes[HEAD..].chunks_exact(TRIANGLE).enumerate() {
        let at = |why| Fault::at(HEAD + i * TRIANGLE, why);
        let number = |k: usize| {
            let place = 12 + 4 * k;
            let bytes = [0, 1, 2, 3].map(|i| triangle[place + i]);
            f64::from(f32::from_le_bytes(bytes))
        };
        let mut corners = [0; 3];
        for (k, corner) in corners.iter_mut().enumerate() {
            let place = [3 * k, 3 * k + 1, 3 * k + 2].map(number);
            *corner = out.vertex(place).map_err(at)?;
        }
        out.triangle(corners).map_err(at)?;
    }
    Ok(out)
}

fn read_text(text: &str) -> Result<Builder, Fault> {
    let mut out = Builder::default();
    // Vertices of the open loop.
    let mut corners: Option<Vec<u32>> = None;
    let mut ended = false;
    for line in text.lines() {
        let mut words = line.split_ascii_whitespace();
        let Some(word) = words.next() else {
            continue;
        };
        let at = |why| Fault::at(offset(text, word), why);
        ended = false;
        match (word.to_ascii_lowercase().as_str(), &mut corners) {
            ("solid" | "facet" | "endfacet", None) => {}
            ("endsolid", None) => ended = true,
            ("outer", None) => corners = Some(Vec::new()),
            ("vertex", Some(corners)) => {
                let numbers = words.map(|word| coordinate(text, word));
                let numbers = numbers.collect::<Result<Vec<_>, _>>()?;
                let place = <[f64; 3]>::try_from(numbers);
                let place = place.map_err(|_| at(MeshFault::Coordinates))?;
                corners.push(out.vertex(place).map_err(at)?);
            }
            ("endloop", Some(found)) => {
                let found = <[u32; 3]>::try_from(&found[..]);
                let found = found.map_err(|_| at(MeshFault::Loop))?;
                out.triangle(found).map_err(at)?;
                corners = None;
            }
            (_, None) => {
                return Err(at(MeshFault::Expected("`solid`, `facet`, `outer loop`, `endfacet` or `endsolid`")));
            }
            (_, Some(_)) => return Err(at(MeshFault::Expected("`vertex` or `endloop`"))),
        }
    }
    if !ended {
        return Err(Fault::at(text.len(), MeshFault::EndsWithin("a solid: no `endsolid`")));
    }
    Ok(out)
}
