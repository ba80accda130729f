//! Writes a scene back to TOML: its source text with changed values replaced; comments and order are preserved.

use toml_edit::{ArrayOfTables, DocumentMut, Item, Table, TableLike, Value as Toml, value};

use std::collections::BTreeMap;

use super::access::sets_solver;
use super::file_number::{FileNumber, Place};
use super::model::PRESET;
use super::{SOLVER_KEYS, Scene, SceneError, Value, play};
use jointplay_physics::units::exact_quantity;

/// Maximum number of components in a vector.
const MAX_PARTS: usize = 4;

impl Scene {
    /// Text of a scene file that reads back to this scene, including its changes.
    ///
    /// # Errors
    /// A change that the format cannot express.
    pub fn to_toml(&self) -> Result<String, SceneError> {
        let write_error =
            |key: &str, message: String| SceneError { key: Some(key.to_owned()), message, ..SceneError::default() };
        let mut document: DocumentMut = self
            .numbers_in_place()?
            .parse()
            .map_err(|error: toml_edit::TomlError| write_error("", error.message().to_owned()))?;
        if let Some(solver) = document.get_mut("solver").and_then(Item::as_table_like_mut) {
            let gone: &[&str] = match self.changes.iter().any(|(key, _)| key == PRESET) {
                true => &SOLVER_KEYS,
                false if sets_solver(&self.changes).next().is_some() => &[PRESET],
                false => &[],
            };
            for key in gone {
                solver.remove(key.trim_start_matches("solver."));
            }
        }
        for (key, _) in &self.changes {
            if !self.source.numbers.contains_key(key) {
                self.write_change(&mut document, key)?;
            }
        }
        let text = document.to_string();
        // Return the text only if it reads back as intended.
        let source = &self.source;
        let read = Self::parse_with(&text, source.file.as_deref(), &source.beside, &[])?;
        for (key, _) in &self.changes {
            if read.get(key)? != self.get(key)? {
                return Err(write_error(key, "cannot be written to a scene file".to_owned()));
            }
        }
        Ok(text)
    }

    /// The scene's text with changed numbers replaced.
    fn numbers_in_place(&self) -> Result<String, SceneError> {
        let numbers = &self.source.numbers;
        let mut edits: BTreeMap<usize, (usize, String)> = BTreeMap::new();
        for (key, value) in &self.changes {
            let Some(number) = numbers.get(key) else {
                continue;
            };
            let refuse = |why: &str| {
                let message = format!("cannot be written to a scene file: {why}");
                SceneError::about(key, Some(value), message)
            };
            let text =
                |number: &FileNumber| toml_of(&exact_quantity(number.value, number.unit, number.dimension)).to_string();
            let is_same_place = |other: &&FileNumber| other.place == number.place;
            let same: Vec<&FileNumber> = numbers.values().filter(is_same_place).collect();
            let (span, text) = match &number.place {
                Place::Included => {
                    return Err(refuse("it is in another file, which this one includes"));
                }
                Place::ChangedDefault => {
                    return Err(refuse("the text does not give it; write it there first"));
                }
                Place::Value(span) if same.len() == 1 => (span, text(number)),
                // Components are in the order of their keys: x, y, z.
                Place::Part(span) if same.len() <= MAX_PARTS => {
                    let parts: Vec<String> = same.into_iter().map(text).collect();
                    (span, format!("[{}]", parts.join(", ")))
                }
                _ => return Err(refuse("every copy of a pattern has it")),
            };
            edits.insert(span.start, (span.end, text));
        }
        let mut written = self.source.text.to_string();
        for (start, (end, text)) in edits.into_iter().rev() {
            written.replace_range(start..end, &text);
        }
        Ok(written)
    }

    fn write_change(&self, document: &mut DocumentMut, key: &str) -> Result<(), SceneError> {
        let parameter = self.parameter(key)?;
        let item = self.item(key)?;
        if let Some((joint, part)) = self.loose_joint_of(key) {
            let (name, kind) = (&*joint.name, &joint.kind);
            // A `[[joint]]` has its play in a table.
            if let Some(own) = play::name_of(kind, &part)
                && set_joint_value(document.get_mut("joint"), name, |joint| set_play(joint, own, &item))
            {
                return Ok(());
            }
            let part = play::contact_part(kind, &part);
            let mut lists = ["joint_contact", "ball_joint", "joint"].into_iter();
            let mut set = |list| {
                set_joint_value(document.get_mut(list), name, |joint| {
                    set_value(joint, part, item.clone());
                    true
                })
            };
            if !lists.any(&mut set) {
                add_joint_contact(document, name, part, item);
            }
            return Ok(());
        }
        match parameter.key.split_once('.') {
            None => set_value(document.as_table_mut(), parameter.key, item),
            Some((section, part)) => {
                let is_new = !document.contains_key(section);
                let table = document.entry(section).or_insert_with(|| Item::Table(Table::new()));
                let table = table.as_table_like_mut().expect("the scene was read from this text");
                // If a section gives one component of gravity, the others are 0.
                if is_new && section == "gravity" {
                    for part in ["x", "y", "z"] {
                        set_value(table, part, self.item(&format!("gravity.{part}"))?);
                    }
                } else {
                    set_value(table, part, item);
                }
            }
        }
        Ok(())
    }

    /// Current value of `key` as TOML: pure numbers and counts bare, everything else as a string.
    fn item(&self, key: &str) -> Result<Item, SceneError> {
        let parameter = self.parameter(key)?;
        let now = self.get(key)?;
        let text = parameter.write(&now);
        Ok(value(if matches!(now, Value::Choice(_)) { text.into() } else { toml_of(&text) }))
    }
}

/// A number as TOML: bare if it has no unit, otherwise a string.
fn toml_of(text: &str) -> Toml {
    text.parse().unwrap_or_else(|_| text.into())
}

/// Writes `item` to the key `name` of the table `play` of a joint, if it has one.
fn set_play(joint: &mut dyn TableLike, name: &str, item: &Item) -> bool {
    let play = joint.get_mut("play").and_then(Item::as_table_like_mut);
    play.map(|play| set_value(play, name, item.clone())).is_some()
}

/// Changes the entry named `name` in a list of joints by `set`, which says whether it did, if there is one.
fn set_joint_value(joints: Option<&mut Item>, name: &str, set: impl FnOnce(&mut dyn TableLike) -> bool) -> bool {
    let mut entries: Vec<&mut dyn TableLike> = match joints {
        Some(Item::ArrayOfTables(tables)) => tables.iter_mut().map(|table| table as _).collect(),
        Some(Item::Value(Toml::Array(array))) => {
            array.iter_mut().filter_map(Toml::as_inline_table_mut).map(|table| table as _).collect()
        }
        _ => Vec::new(),
    };
    let named = entries.iter_mut().find(|entry| entry.get("name").and_then(Item::as_str) == Some(name));
    named.is_some_and(|entry| set(*entry))
}

/// Adds a `[[joint_contact]]` with `item` for the joint with play `name`.
fn add_joint_contact(document: &mut DocumentMut, name: &str, part: &str, item: Item) {
    let mut own = Table::new();
    own.insert("name", value(name));
    own.insert(part, item);
    match document.entry("joint_contact").or_insert_with(|| Item::ArrayOfTables(ArrayOfTables::new())) {
        Item::ArrayOfTables(tables) => tables.push(own),
        Item::Value(Toml::Array(array)) => array.push(own.into_inline_table()),
        // Unreachable: the scene was read from this text.
        _ => {}
    }
}

/// Writes `item` to `table`; comments above and after the old value are preserved.
fn set_value(table: &mut dyn TableLike, name: &str, mut item: Item) {
    let Some(old) = table.get_mut(name) else {
        table.insert(name, item);
        return;
    };
    if let (Some(old), Some(new)) = (old.as_value(), item.as_value_mut()) {
        *new.decor_mut() = old.decor().clone();
    }
    // Inserting would reformat the key and drop the comments above it.
    *old = item;
}

#[cfg(test)]
mod tests {
    use super::super::table::{contact_part, find};
    use super::super::{BUILT_IN, Kind, Scope, table};
    use super::*;
    use std::sync::Arc;

    fn scene(name: &str, changes: &[(&str, &str)]) -> Scene {
        let own = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
        let changes: Vec<(String, String)> = changes.iter().map(own).collect();
        Scene::load(name, &changes).expect("in range")
    }

    /// All data that the simulation reads.
    fn bits(scene: &Scene) -> String {
        let mut plain = scene.clone();
        plain.changes.clear();
        plain.source = Default::default();
        for overrides in Arc::make_mut(&mut plain.overrides) {
            overrides.sort_unstable();
        }
        format!("{plain:?}")
    }

    #[test]
    fn a_scene_without_changes_is_its_own_text() {
        for name in BUILT_IN {
            let scene = scene(name, &[]);
            assert_eq!(scene.to_toml().as_deref(), Ok(&*scene.source.text));
        }
    }

    #[test]
    fn every_parameter_is_written_so_that_it_reads_back_to_the_same_scene() {
        for (turn, name) in BUILT_IN.into_iter().enumerate() {
            let plain = scene(name, &[]);
            // Common parameters are shared out among the scenes.
            let rows = plain.parameters().into_iter().enumerate();
            for (_, parameter) in rows.filter(|(place, row)| row.scope == Scope::Own || (place + turn) % 3 == 0) {
                let other = match parameter.kind {
                    // Inside every range, and not a round number.
                    Kind::Number { slider, .. } => Value::Number(slider.0 + 0.377_123_456_789 * (slider.1 - slider.0)),
                    Kind::Count { .. } => Value::Count(3),
                    Kind::Choice(words) => Value::Choice(words[words.len() - 1]),
                };
                let mut keys = vec![parameter.key.to_owned()];
                if let Some(part) = contact_part(parameter) {
                    keys.push(format!("joint.{}.{part}", plain.machine.loose_joints[0].name));
                }
                for key in keys {
                    let mut changed = plain.clone();
                    if let Err(error) = changed.set_value(&key, &other) {
                        // A law may reject the scene's restitution, for example.
                        assert!(matches!(parameter.scope, Scope::Contact), "{error}");
                        continue;
                    }
                    let text = changed.to_toml().unwrap_or_else(|error| panic!("{name} {key}: {error}"));
                    let read = Scene::parse(&text, None, &[]).expect("reads");
                    assert_eq!(bits(&read), bits(&changed), "{name} {key}\n{text}");
                    assert!(read.changes.is_empty());
                    let comments = |text: &str| text.matches('#').count();
                    assert_eq!(comments(&text), comments(&plain.source.text), "{key}");
                }
            }
        }
        assert!(find("contact.clearance").is_some() && table().len() > 20);
    }

    #[test]
    fn changes_that_depend_on_each_other_come_out_as_they_are() {
        let changes = [
            ("contact.clearance", "0.5 mm"),
            ("joint.S1.clearance", "0.2 mm"),
            ("joint.S1.friction", "0.4"),
            ("solver.preset", "preview"),
            ("gravity.x", "3 m/s^2"),
            ("formulation", "lagrange"),
        ];
        for name in ["spcmm", "pendulum"] {
            let changed = scene(name, &changes);
            let text = changed.to_toml().expect("has its places");
            let read = Scene::parse(&text, None, &[]).expect("reads");
            assert_eq!(bits(&read), bits(&changed), "{text}");
        }
    }

    #[test]
    fn gravity_that_the_file_leaves_out_is_written_whole() {
        let text = scene("pendulum", &[]).source.text.replace("[gravity]\nz = \"-9.81 m/s^2\"\n", "");
        let mut bare = Scene::parse(&text, None, &[]).expect("reads");
        assert_eq!(bare.machine.gravity.z, -9.81);
        bare.set("gravity.x", "1 m/s^2").expect("in range");
        let read = Scene::parse(&bare.to_toml().expect("written"), None, &[]).expect("reads");
        assert_eq!(read.machine.gravity, bare.machine.gravity);
    }

    #[test]
    fn inline_sections_and_lists_keep_their_form() {
        let text = scene("pendulum", &[]).source.text.replace(
            "[[ball_joint]]\nname = \"S1\"\nsocket = { body = \"world\", at = [0, 0, 0] }\nball = { body = \"rod\", at = \"0 0 100 mm\" }\nopening = [0, -1, 0]\n",
            "",
        );
        let inline = "ball_joint = [{ name = \"S1\", socket = { body = \"world\" }, ball = { body = \"rod\", at = \"0 0 100 mm\" } }]\nsolver = { step = \"5 us\" } # short\n";
        let text = format!("{inline}{text}");
        let mut changed = Scene::parse(&text, None, &[]).expect("reads");
        changed.set("joint.S1.clearance", "0.2 mm").expect("ok");
        changed.set("solver.step", "7 us").expect("ok");
        let written = changed.to_toml().expect("written");
        let read = Scene::parse(&written, None, &[]).expect("reads");
        assert_eq!(bits(&read), bits(&changed), "{written}");
        assert!(written.contains("# short"));
    }

    #[test]
    fn copies_of_a_pattern_have_values_of_their_own_in_every_form_of_the_file() {
        let changes = [("joint.J2.clearance", "0.5 mm"), ("joint.J8.friction", "0.4"), ("joint.J2.friction", "0.1")];
        let plain = scene("chain", &[]).source.text.to_string();
        let inline = format!("joint_contact = [{{ name = \"J3\" }}]\n{plain}");
        let there = format!("{plain}\n[[joint_contact]]\nname = \"J2\" # the second\nrestitution = 0.7\n");
        for text in [plain, inline, there] {
            let mut changed = Scene::parse(&text, None, &[]).expect("reads");
            for (key, value) in changes {
                changed.set(key, value).expect("in range");
            }
            let written = changed.to_toml().expect("has its places");
            let read = Scene::parse(&written, None, &[]).expect("reads");
            assert_eq!(bits(&read), bits(&changed), "{written}");
            assert_eq!(read.machine.loose_joints[1].contact.clearance, 0.5e-3);
            assert_eq!(written.contains("# the second"), text.contains("# the second"));
            // A second time: the entries exist now.
            let mut again = read;
            again.set("joint.J8.friction", "0.3").expect("in range");
            let written = again.to_toml().expect("has its places");
            assert_eq!(written.matches("\"J8\"").count(), 1, "{written}");
        }
        let twice = "[[joint_contact]]\nname = \"J2\"\n";
        let bad = format!("{}\n{twice}{twice}", scene("chain", &[]).source.text);
        let error = Scene::parse(&bad, None, &[]).expect_err("twice").to_string();
        assert!(error.contains("already a [[joint_contact]] of this name"), "{error}");
    }
}
