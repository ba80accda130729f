//! `reference`: the page about the scene format, with tables generated from the reader's own rows.

use super::tables::Table;
use crate::scene::{
    ABOVE_ZERO, DRIVE_LAWS, DefaultRule, FileKey, FileTable, Kind, ValueType, Variants, file_tables, find,
};
use crate::units::{Dimension, dimension_name, format_quantity, si_unit, unit_table};

/// The page at build time.
const PAGE: &str = include_str!("../../docs/scene-format.md");
/// Begins the line before a table in the page; the table ends at the first empty line.
const START: &str = "<!-- table ";

/// The page of the scene format.
pub fn page() -> String {
    fill(PAGE).unwrap_or_else(|name| unreachable!("a test fills the page: {name}"))
}

/// `page` with its tables regenerated.
///
/// # Errors
/// The name of a table that is unknown or does not end.
pub fn fill(page: &str) -> Result<String, String> {
    let mut parts = page.split(START);
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let gap = part.split_once(" -->\n").and_then(|(name, rest)| {
            // Nothing but the empty line where a new table is to be.
            let rest = rest.strip_prefix('\n').or_else(|| Some(rest.split_once("\n\n")?.1))?;
            Some((name, table_content(name)?, rest))
        });
        let Some((name, table, rest)) = gap else {
            return Err(part.lines().next().unwrap_or_default().to_owned());
        };
        out += &format!("{START}{name} -->\n{table}\n{rest}");
    }
    Ok(out)
}

/// Content of the table `name` in the page; `None` for an unknown name.
fn table_content(name: &str) -> Option<String> {
    Some(match name {
        "units" => unit_table(),
        "laws" => laws(),
        _ => keys(file_tables().into_iter().find(|table| table.name == name)?),
    })
}

/// The keys of a table, one per row.
fn keys(table: &FileTable) -> String {
    let by = match table.variants {
        Some(Variants::Word(by, _)) => by,
        Some(Variants::Presence(_)) => "form",
        None => "",
    };
    let has_frames = table.keys.iter().any(|key| !key.frame.is_empty());
    let columns = [true, !by.is_empty(), true, true, has_frames, true];
    let selected = |cells: [String; 6]| {
        let cells = cells.into_iter().zip(columns);
        cells.filter_map(|(cell, selected)| selected.then_some(cell)).collect::<Vec<_>>()
    };
    let heads = ["key", by, "value", "default", "frame", "meaning"].map(str::to_owned);
    let heads = selected(heads);
    let is_section = |table: &FileTable| table.head.starts_with("[[");
    let is_part =
        |key: &&FileKey| matches!(key.value_type, ValueType::List(of, _) if is_section(table) && is_section(of));
    let (parts, own): (Vec<&FileKey>, Vec<&FileKey>) = unshared_keys(table).partition(is_part);
    let mut rows: Vec<[String; 6]> = Vec::new();
    for key in own {
        let (of, frame) = (key.of.join(", "), key.frame.to_owned());
        let row = [format!("`{}`", key.name), of, value(key, table), default_text(key), frame, description(key)];
        // Variants that describe a key alike share a row.
        let alike = |other: &&mut [String; 6]| (0..6).all(|cell| cell == 1 || row[cell] == other[cell]);
        match rows.iter_mut().find(alike) {
            Some(other) => other[1] += &format!(", {}", row[1]),
            None => rows.push(row),
        }
    }
    if let [first, ..] = parts[..] {
        let names: Vec<String> = parts.iter().map(|key| format!("`{}`", key.name)).collect();
        let empty = String::new;
        let help = "Its contents, as at the top of the file".to_owned();
        rows.push([names.join(", "), empty(), format!("{}, …", value(first, table)), "none".to_owned(), empty(), help]);
    }
    let mut rows: Vec<Vec<String>> = rows.into_iter().map(selected).collect();
    if let Some(also) = table.also {
        let any = format!("any key of {}", markdown_name(also));
        let same = || "as there".to_owned();
        let empty = String::new;
        rows.push(selected([any, empty(), same(), same(), empty(), "For this one only".to_owned()]));
    }
    Table::new(&heads.join(" | "), rows).markdown()
}

/// Keys of a table without those shared with `table.also`.
fn unshared_keys(table: &FileTable) -> impl Iterator<Item = &FileKey> {
    let shared = |key: &FileKey| Some(table.also?.key(key.name, None).is_some());
    let is_unshared = move |key: &&FileKey| shared(key) != Some(true);
    table.keys.iter().filter(is_unshared)
}

/// Description of a key; only the first sentence for a parameter, whose own page says more.
fn description(key: &FileKey) -> String {
    match key.value_type {
        ValueType::Parameter(_) => {
            let (first, _) = key.help.split_once(". ").unwrap_or((key.help, ""));
            first.trim_end_matches('.').to_owned()
        }
        _ => capital(key.help),
    }
}

/// `text` with its first letter capitalised.
pub fn capital(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().into_iter().flat_map(char::to_uppercase);
    first.chain(letters).collect()
}

/// Name of a table in Markdown.
fn markdown_name(table: &FileTable) -> String {
    match table.head.starts_with('[') {
        true => format!("`{}`", table.head),
        false => table.head.to_owned(),
    }
}

/// Type and range of a key of `table`, in words.
pub fn value(key: &FileKey, table: &FileTable) -> String {
    let dimension = |of: Dimension| match of {
        Dimension::None => "number",
        of => dimension_name(of),
    };
    let names = |hinge: bool| key.dimensions(hinge).iter().map(|of| dimension(*of)).collect::<Vec<_>>().join(" and ");
    let number = || match [names(false), names(true)] {
        [own, hinge] if hinge != own => format!("{own}, on a hinge {hinge}"),
        [own, _] => own,
    };
    let words = |words: &[&str]| format!("`{}`", words.join("`, `"));
    match key.value_type {
        ValueType::Number(of, range) => number() + &bounds(of, range),
        ValueType::Vector(Dimension::None, _) | ValueType::Direction => "direction".to_owned(),
        ValueType::Vector(of, range) => format!("vector, {}{}", number(), bounds(of, range)),
        ValueType::Numbers(count, _) => format!("{count} of {}", number()),
        ValueType::Quantity => "any quantity".to_owned(),
        ValueType::Range => "two quantities".to_owned(),
        ValueType::Whole(least, most) => format!("whole number, {least} to {most}"),
        ValueType::Flag => words(&["true", "false"]),
        ValueType::Text => "text".to_owned(),
        ValueType::Name => "name".to_owned(),
        ValueType::Body => "name of a body".to_owned(),
        ValueType::Joint => "name of a joint".to_owned(),
        ValueType::File => "name of a file".to_owned(),
        ValueType::Word(of) => words(of),
        ValueType::Words(of, limit) => format!("list of at most {} of {}", limit.max, words(of)),
        ValueType::Parameter(name) => find(name).map_or_else(String::new, |parameter| match parameter.kind {
            Kind::Number { dimension: of, .. } => {
                format!("{}, {}", dimension(of), parameter.range())
            }
            Kind::Count { .. } => format!("whole number, {}", parameter.range()),
            Kind::Choice(of) => words(of),
        }),
        ValueType::Table(of) => markdown_name(of),
        ValueType::List(of, _) if table.head.starts_with("[[") && of.head.starts_with("[[") => {
            format!("`[[{}.{}]]`", table.name, key.name)
        }
        ValueType::List(of, _) if of.head.starts_with("[[") => markdown_name(of),
        ValueType::List(_, limit) => format!("list of {}", limit.entries),
        ValueType::Vectors(..) => format!("list of vectors, {}", number()),
        ValueType::Pairs(_, limit) => format!("list of pairs, {}, at most {}", number(), limit.max),
        ValueType::Files(of, _) => format!("list of names of files, or {}", markdown_name(of)),
        ValueType::Values => "table of quantities".to_owned(),
    }
}

/// A range, appended to a dimension; empty if it is practically unlimited.
fn bounds(dimension: Dimension, (least, most): (f64, f64)) -> String {
    /// Beyond any sensible value, in SI units.
    const HUGE: f64 = 1e5;
    let show = |at: f64| format_quantity(at, si_unit(dimension));
    let above = match least {
        ABOVE_ZERO => ", above 0".to_owned(),
        0.0 => ", not below 0".to_owned(),
        _ if least.abs() > HUGE => String::new(),
        _ => format!(", from {}", show(least)),
    };
    match most <= HUGE {
        true => format!("{above}, up to {}", show(most)),
        false => above,
    }
}

/// Default value of a key, in words.
pub fn default_text(key: &FileKey) -> String {
    match (key.default, key.value_type) {
        (_, ValueType::Parameter(name)) => {
            let show = |parameter: &crate::scene::Parameter| parameter.show(&parameter.default);
            find(name).map_or_else(String::new, show)
        }
        (DefaultRule::Required, _) => "required".to_owned(),
        (DefaultRule::RequiredUnless(other), _) => format!("required, or `{other}`"),
        (DefaultRule::Number(_), ValueType::Table(_)) => "none".to_owned(),
        (DefaultRule::Number(value), _) if value.is_infinite() => "no limit".to_owned(),
        (DefaultRule::Number(0.0), _) => "0".to_owned(),
        (DefaultRule::Number(value), _) => {
            let unit = key.dimension(false).map_or("", si_unit);
            format_quantity(value, unit)
        }
        (DefaultRule::Description(words), ValueType::Word(_)) => format!("`{words}`"),
        (DefaultRule::Description(words), _) => words.to_owned(),
    }
}

/// The drive laws.
fn laws() -> String {
    let row = |kind: &crate::scene::DriveLaw| vec![format!("`{}`", kind.word), kind.help.to_owned()];
    Table::new("law | motion", DRIVE_LAWS.iter().map(row)).markdown()
}
