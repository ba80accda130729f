//! `schema`: a JSON schema of scene files (draft 7), for editors. It is generated from the reader's own rows and rejects only
//! what the reader rejects for its form alone.

use std::collections::BTreeSet;

use serde_json::{Map, Value as Json, json};

use super::reference::{capital, default_text, value};
use crate::scene::{ABOVE_ZERO, DefaultRule, FILE, FileKey, FileTable, Kind, ValueType, Variants, file_tables, find};
use crate::units::{Dimension, unit_names};

/// The schema as text.
pub fn page() -> String {
    // Serialising plain JSON cannot fail.
    serde_json::to_string_pretty(&schema()).unwrap_or_default() + "\n"
}

fn schema() -> Json {
    let mut schema = json!({
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "Jointplay scene",
    });
    merge(&mut schema, of_table(&FILE));
    let others = file_tables().into_iter().skip(1);
    let definitions: Map<String, Json> = others.map(|table| (table.name.to_owned(), of_table(table))).collect();
    schema["definitions"] = definitions.into();
    schema
}

/// Adds the members of `more`.
fn merge(to: &mut Json, more: Json) {
    if let (Some(to), Json::Object(more)) = (to.as_object_mut(), more) {
        to.extend(more);
    }
}

/// Schema of a table: all its keys, so that an editor knows them, and rules for keys that only some variants have.
fn of_table(table: &FileTable) -> Json {
    let mut properties = Map::new();
    for key in table.keys {
        let mut schema = of_key(key, table);
        if let Some(Json::Object(other)) = properties.get(key.name) {
            // Its type depends on the variant, whose rules state it.
            let both = [&other["description"], &schema["description"]];
            let both = both.map(|text| text.as_str().unwrap_or_default());
            schema = json!({ "description": both.join("\n\n") });
        }
        properties.insert(key.name.to_owned(), schema);
    }
    let mut schema = json!({
        "description": capital(table.help),
        "type": "object",
        "properties": properties,
        "additionalProperties": false,
    });
    let common = table.keys.iter().filter(|key| key.of.is_empty());
    merge(&mut schema, requirements(&common.collect::<Vec<_>>()));
    let mut rules = schema["allOf"].as_array().cloned().unwrap_or_default();
    if let Some(variants) = table.variants {
        let words = table.words();
        rules.extend(words.iter().map(|word| {
            let condition = match variants {
                Variants::Presence(_) => json!({ "required": [word] }),
                Variants::Word(by, _) => json!({
                    "properties": { by: { "const": word } }, "required": [by]
                }),
            };
            json!({ "if": condition, "then": of_variant(table, word) })
        }));
        if let Variants::Presence(_) = variants {
            let one = words.iter().map(|word| json!({ "required": [word] }));
            rules.push(json!({ "anyOf": one.collect::<Vec<_>>() }));
        }
    }
    if !rules.is_empty() {
        schema["allOf"] = rules.into();
    }
    schema
}

/// Rules of one variant of a table.
fn of_variant(table: &FileTable, word: &'static str) -> Json {
    let mut properties = Map::new();
    for key in table.keys {
        let rows = table.keys.iter().filter(|other| other.name == key.name);
        match (key.is_of(word), rows.count()) {
            (true, 1) => {}
            (true, _) => drop(properties.insert(key.name.to_owned(), of_key(key, table))),
            (false, _) => drop(properties.entry(key.name).or_insert(false.into())),
        }
    }
    let own = table.of(Some(word)).filter(|key| !key.of.is_empty());
    let mut schema = json!({ "properties": properties });
    merge(&mut schema, requirements(&own.collect::<Vec<_>>()));
    schema
}

/// Schema that requires the mandatory keys among `keys`.
fn requirements(keys: &[&FileKey]) -> Json {
    let needed = keys.iter().filter(|key| matches!(key.default, DefaultRule::Required));
    let needed: Vec<&str> = needed.map(|key| key.name).collect();
    let either = keys.iter().filter_map(|key| match key.default {
        DefaultRule::RequiredUnless(other) => Some(json!({
            "anyOf": [{ "required": [key.name] }, { "required": [other] }]
        })),
        _ => None,
    });
    let either: Vec<Json> = either.collect();
    match either.is_empty() {
        true => json!({ "required": needed }),
        false => json!({ "required": needed, "allOf": either }),
    }
}

fn of_key(key: &FileKey, table: &FileTable) -> Json {
    let mut description = format!("{}\n\nValue: {}", capital(key.help), value(key, table));
    let mut dimensions = [key.dimensions(false), key.dimensions(true)].concat();
    if let ValueType::Parameter(name) = key.value_type
        && let Some(Kind::Number { dimension, .. }) = find(name).map(|parameter| parameter.kind)
    {
        dimensions.push(dimension);
    }
    let mut known = BTreeSet::new();
    let units: Vec<&str> = dimensions.into_iter().flat_map(unit_names).filter(|unit| known.insert(*unit)).collect();
    if !units.is_empty() {
        description += &format!("; units {}", units.join(", "));
    }
    description += &match key.default {
        DefaultRule::Required | DefaultRule::RequiredUnless(_) => format!(".\n{}.", capital(&default_text(key))),
        _ => format!(".\nDefault: {}.", default_text(key)),
    };
    if !key.frame.is_empty() {
        description += &format!("\nFrame: {}.", key.frame);
    }
    let mut schema = json!({ "description": description });
    merge(&mut schema, of_value(key));
    if let Some(limit) = key.list_limit() {
        schema["maxItems"] = limit.max.into();
    }
    if let Some(example) = example(key.example) {
        schema["examples"] = json!([example]);
    }
    schema
}

fn of_value(key: &FileKey) -> Json {
    let text = || json!({ "type": "string" });
    let list = |items: Json| json!({ "type": "array", "items": items });
    match key.value_type {
        ValueType::Number(of, range) => number(of, range),
        ValueType::Vector(of, range) => numbers(3, number(of, range)),
        ValueType::Direction => numbers(3, number(Dimension::None, key.range())),
        ValueType::Numbers(count, of) => numbers(count, number(of, key.range())),
        ValueType::Quantity => json!({ "type": ["string", "number"] }),
        ValueType::Range => numbers(2, json!({ "type": ["string", "number"] })),
        ValueType::Whole(least, most) => whole(least.into(), most.into()),
        ValueType::Flag => json!({ "type": "boolean" }),
        ValueType::Name => json!({ "type": "string", "pattern": "^[A-Za-z0-9_-]{1,40}$" }),
        ValueType::Text | ValueType::Body | ValueType::Joint | ValueType::File => text(),
        ValueType::Word(words) => json!({ "enum": words }),
        ValueType::Words(words, _) => list(json!({ "enum": words })),
        ValueType::Parameter(name) => match find(name).map(|parameter| parameter.kind) {
            Some(Kind::Number { dimension, min, max, .. }) => number(dimension, (min, max)),
            Some(Kind::Count { min, max }) => whole(min, max),
            // "x" stands for "+x".
            Some(Kind::Choice(words)) => {
                let plain = words.iter().filter_map(|word| word.strip_prefix('+'));
                let all: Vec<&str> = words.iter().copied().chain(plain).collect();
                json!({ "enum": all })
            }
            None => json!({}),
        },
        ValueType::Table(of) => json!({ "allOf": [reference(of)] }),
        ValueType::List(of, _) => list(reference(of)),
        ValueType::Vectors(of, _) => list(numbers(3, number(of, key.range()))),
        ValueType::Pairs([first, second], _) => {
            let part = |of| number(of, key.range());
            list(json!({
                "type": "array", "items": [part(first), part(second)], "minItems": 2, "maxItems": 2
            }))
        }
        ValueType::Files(of, _) => list(json!({ "anyOf": [text(), reference(of)] })),
        ValueType::Values => {
            json!({ "type": "object", "additionalProperties": { "type": ["string", "number"] } })
        }
    }
}

fn reference(table: &FileTable) -> Json {
    json!({ "$ref": format!("#/definitions/{}", table.name) })
}

/// A quantity: a text with its unit or an expression, or a bare 0; a pure number may be bare.
fn number(dimension: Dimension, (least, most): (f64, f64)) -> Json {
    let mut schema = json!({ "type": ["string", "number"] });
    if dimension != Dimension::None {
        merge(&mut schema, json!({ "minimum": 0, "maximum": 0 }));
        return schema;
    }
    if least == ABOVE_ZERO {
        schema["exclusiveMinimum"] = json!(0);
    } else if least.is_finite() {
        schema["minimum"] = json!(least);
    }
    if most.is_finite() {
        schema["maximum"] = json!(most);
    }
    schema
}

/// A list of `count` numbers, or a text with one unit for all.
fn numbers(count: usize, items: Json) -> Json {
    json!({ "type": ["string", "array"], "items": items, "minItems": count, "maxItems": count })
}

fn whole(least: u64, most: u64) -> Json {
    json!({ "type": ["integer", "string"], "minimum": least, "maximum": most })
}

/// Converts a value in scene file syntax to JSON.
fn example(like: &str) -> Option<Json> {
    let text = format!("like = {like}");
    let mut table: Map<String, Json> = toml::from_str(&text).ok()?;
    table.remove("like")
}
