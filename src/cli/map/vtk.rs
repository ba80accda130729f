//! Points with vectors and scalars as a legacy VTK file (VTK File Formats, Kitware, "Simple Legacy Formats"): poly data with one
//! vertex per point, binary, so that values that are unknown can be NaN.

use std::io::{self, Write};

use crate::machine::Vec3;

/// A file's content: points, m, and named data with a value at each.
pub struct Points<'a> {
    /// Title, one line.
    pub title: &'a str,
    /// The points.
    pub points: Vec<Vec3>,
    /// Vectors at the points.
    pub vectors: Vec<(&'static str, Vec<Vec3>)>,
    /// Numbers at the points.
    pub scalars: Vec<(String, Vec<f64>)>,
}

/// Longest title, characters.
const MAX_TITLE_LENGTH: usize = 255;

impl Points<'_> {
    /// Writes the file.
    pub fn write(&self, out: &mut impl Write) -> io::Result<()> {
        let count = self.points.len();
        let title: String = self.title.chars().filter(|c| !c.is_control()).take(MAX_TITLE_LENGTH).collect();
        write!(out, "# vtk DataFile Version 3.0\n{title}\nBINARY\nDATASET POLYDATA\nPOINTS {count} double\n")?;
        vectors(out, &self.points)?;
        write!(out, "\nVERTICES {count} {}\n", 2 * count)?;
        for point in 0..count as u32 {
            out.write_all(&1_u32.to_be_bytes())?;
            out.write_all(&point.to_be_bytes())?;
        }
        write!(out, "\nPOINT_DATA {count}\n")?;
        for (name, values) in &self.vectors {
            writeln!(out, "VECTORS {name} double")?;
            vectors(out, values)?;
            writeln!(out)?;
        }
        for (name, values) in &self.scalars {
            writeln!(out, "SCALARS {} double 1\nLOOKUP_TABLE default", name.replace(char::is_whitespace, "_"))?;
            values.iter().try_for_each(|value| out.write_all(&value.to_be_bytes()))?;
            writeln!(out)?;
        }
        Ok(())
    }
}

fn vectors(out: &mut impl Write, values: &[Vec3]) -> io::Result<()> {
    values.iter().flat_map(|value| value.iter()).try_for_each(|part| out.write_all(&part.to_be_bytes()))
}
