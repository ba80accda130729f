//! OBJ reader: vertices and faces; all other statements are ignored.

use super::{Builder, Fault, MeshFault, coordinate, offset, text};

pub(super) fn read(bytes: &[u8]) -> Result<Builder, Fault> {
    let text = text(bytes)?;
    let mut out = Builder::default();
    let mut vertices: Vec<u32> = Vec::new();
    let mut corners: Vec<u32> = Vec::new();
    for line in text.lines() {
        let line = line.split('#').next().unwrap_or_default();
        let mut words = line.split_ascii_whitespace();
        let Some(word) = words.next() else {
            continue;
        };
        let at = |why| Fault::at(offset(text, word), why);
        match word {
            "v" => {
                // A weight or a colour may follow.
                let numbers = words.take(3).map(|word| coordinate(text, word));
                let numbers = numbers.collect::<Result<Vec<_>, _>>()?;
                let place = <[f64; 3]>::try_from(numbers);
                let place = place.map_err(|_| at(MeshFault::Coordinates))?;
                vertices.push(out.vertex(place).map_err(at)?);
            }
            "f" => {
                corners.clear();
                for word in words {
                    let corner = index(word, vertices.len()).map(|i| vertices[i]);
                    let known = vertices.len();
                    corners.push(corner.ok_or_else(|| Fault::at(offset(text, word), MeshFault::NoVertex { known }))?);
                }
                if corners.len() < 3 {
                    return Err(at(MeshFault::Face));
                }
                for pair in corners[1..].windows(2) {
                    out.triangle([corners[0], pair[0], pair[1]]).map_err(at)?;
                }
            }
            _ => {}
        }
    }
    Ok(out)
}

/// Zero-based vertex index of a face corner such as `3/1/2`; `None` if it is not one of the `known` vertices.
fn index(word: &str, known: usize) -> Option<usize> {
    let number: i64 = word.split('/').next()?.parse().ok()?;
    let from = if number < 0 { known as i64 } else { -1 };
    let index = usize::try_from(number.checked_add(from)?).ok()?;
    (index < known).then_some(index)
}
