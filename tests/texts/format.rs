//! The tables of the scene format: each key is read as described, no other key is accepted, and the JSON schema made from the tables
//! accepts and refuses the same files as the reader.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use boon::{Compiler, Draft, SchemaIndex, Schemas};
use jointplay::cli::schema;
use jointplay::scene::{
    BUILT_IN, FILE, FileKey, FileTable, Scene, SceneError, Texts, ValueType, Variants, built_in_text, evaluate,
    file_tables,
};
use serde_json::Value as Json;

use crate::scene_corpus::{Random, mutate};
use toml_edit::{DocumentMut, Item, Value};

/// A scene with a file for each key that names one.
const WITH_FILES: &str = r##"include = [
    "leg.toml",
    { file = "arm.toml", name = "left", values = { weight = "2 kg" }, position = "0 0 1 m", rotation = { axis = [1, 0, 0], angle = "9 deg" } },
]
[[joint]]
name = "left"
kind = "fixed"
child = "left.leg"
[[joint]]
name = "j"
kind = "prismatic"
child = "leg"
axis = [0, 0, 1]
drive = { law = "table", file = "bump.csv" }
[[spring]]
name = "coil"
from = { body = "world", at = "0 0 1 m" }
to = { body = "leg" }
length = "1 m"
file = "coil.csv"
[[joint_spring]]
name = "buffer"
joint = "j"
file = "coil.csv"
[[load]]
name = "pull"
on = { body = "leg" }
force = "0 0 1 N"
factor = { law = "table", file = "pull.csv" }
[[body]]
name = "base"
mass = "1 kg"
inertia = "1 1 1 kg m^2"
shapes = [{ form = "mesh", file = "corner.stl", unit = "1 mm", position = "0 0 1 mm", rotation = { axis = [1, 0, 0], angle = "9 deg" } }]
[[joint]]
name = "base"
kind = "fixed"
child = "base"
[[fixed_shape]]
form = "mesh"
colour = "#c2255c"
file = "corner.stl"
unit = "1 mm"
position = "0 0 1 mm"
rotation = { axis = [1, 0, 0], angle = "90 deg" }
"##;

fn files_of_scene() -> Texts {
    let leg = "[[parameter]]\nname = \"weight\"\nvalue = \"1 kg\"\n[[body]]\nname = \"leg\"\nmass = \"weight\"\ninertia = \"1 1 1 kg m^2\"\n";
    let corner = "solid corner\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 9 0 0\nvertex 0 9 0\nendloop\nendfacet\nendsolid corner\n";
    let files = [
        ("leg.toml", leg),
        ("arm.toml", leg),
        ("bump.csv", "t_s,z_mm\n0,0\n1,1\n"),
        ("coil.csv", "length_mm,force_N\n-1,-5\n0,0\n1,8\n"),
        ("pull.csv", "t_s,factor\n0,0\n1,1\n"),
        ("corner.stl", corner),
    ];
    files.map(|(name, text)| (name.to_owned(), text.into())).into()
}

fn parse(text: &str) -> Result<Scene, SceneError> {
    Scene::parse_with(text, None, &files_of_scene(), &[])
}

/// Name and text of every file of the corpus whose name begins with `kind`.
fn corpus(kind: &str) -> Vec<(String, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/corpus");
    let entries = std::fs::read_dir(folder).unwrap();
    let mut paths: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let name = |path: &Path| path.file_name().unwrap().to_string_lossy().into_owned();
    let matching = paths.iter().filter(|path| name(path).starts_with(kind));
    matching.map(|path| (name(path), std::fs::read_to_string(path).unwrap())).collect()
}

/// Valid scenes that together use every key.
fn scenes() -> Vec<(String, String)> {
    let built_in = BUILT_IN.map(|name| (name.to_owned(), built_in_text(name).unwrap().to_owned()));
    let files = [("with files".to_owned(), WITH_FILES.to_owned())];
    let all = corpus("good-").into_iter().chain(built_in).chain(files);
    all.collect()
}

/// A step on the path to a value in a file: a key or a list index.
#[derive(Clone, Debug)]
enum Step {
    Key(String),
    Index(usize),
}

/// The item at a path in a file.
fn at<'a>(root: &'a mut Item, path: &[Step]) -> &'a mut Item {
    path.iter().fold(root, |item, step| match step {
        Step::Key(key) => item.get_mut(key.as_str()).expect("exists"),
        Step::Index(place) => item.get_mut(*place).expect("exists"),
    })
}

/// The word that selects a variant of a table.
type Word = Option<&'static str>;

/// Every key of a file with its path, its row and the variant of its table; and every table with its path and variant.
struct Contents {
    keys: Vec<(Vec<Step>, &'static FileKey, Word)>,
    tables: Vec<(Vec<Step>, &'static FileTable, Word)>,
}

impl Contents {
    fn of(text: &str) -> Self {
        let document: DocumentMut = text.parse().unwrap();
        let mut contents = Self { keys: Vec::new(), tables: Vec::new() };
        contents.walk(document.as_item(), &FILE, Vec::new());
        contents
    }

    fn walk(&mut self, item: &Item, rows: &'static FileTable, path: Vec<Step>) {
        let table = item.as_table_like().expect("a table");
        let is_present = |word: &&&str| match rows.variants {
            Some(Variants::Word(by, _)) => table.get(by).and_then(Item::as_str) == Some(**word),
            _ => table.contains_key(word),
        };
        let word = rows.words().iter().find(is_present).copied();
        self.tables.push((path.clone(), rows, word));
        for (name, inner) in table.iter() {
            let row = rows.key(name, word).unwrap_or_else(|| panic!("{name}"));
            let path = [&path[..], &[Step::Key(name.to_owned())]].concat();
            self.keys.push((path.clone(), row, word));
            match row.value_type {
                ValueType::Table(rows) => self.walk(inner, rows, path),
                ValueType::List(rows, _) | ValueType::Files(rows, _) => {
                    let count = inner.as_array().map(|list| list.len());
                    let count = count.or_else(|| Some(inner.as_array_of_tables()?.len()));
                    for place in 0..count.expect("a list") {
                        let path = [&path[..], &[Step::Index(place)]].concat();
                        // A file name has no keys.
                        if !inner[place].is_str() {
                            self.walk(&inner[place], rows, path);
                        }
                    }
                }
                _ => {}
            }
        }
    }
}

/// `text` with another value at a path, or with a new key in the table there.
fn changed(text: &str, path: &[Step], key: Option<&str>) -> String {
    let document: DocumentMut = text.parse().unwrap();
    let mut root = document.into_item();
    let date: Value = "1979-05-27".parse().unwrap();
    match (at(&mut root, path), key) {
        (item, None) => *item = Item::Value(date),
        (item, Some(key)) => {
            let table = item.as_table_like_mut().expect("a table");
            table.insert(key, Item::Value(date));
        }
    }
    let table = root.into_table().expect("the whole file");
    DocumentMut::from(table).to_string()
}

/// All scenes by name and text, with each key and table listed only where it first occurs at its path and variant: the same code
/// reads it elsewhere.
fn first_occurrences() -> Vec<(String, String, Contents)> {
    let (mut keys, mut tables) = (BTreeSet::new(), BTreeSet::new());
    let keys_of_path = |path: &[Step]| -> Vec<String> {
        let key = |step: &Step| match step {
            Step::Key(key) => Some(key.clone()),
            Step::Index(_) => None,
        };
        path.iter().filter_map(key).collect()
    };
    let first_keys = |(name, text): (String, String)| {
        let mut contents = Contents::of(text.trim_start_matches('\u{feff}'));
        contents.keys.retain(|(path, row, word)| keys.insert((keys_of_path(path), std::ptr::from_ref(*row), *word)));
        contents
            .tables
            .retain(|(path, rows, word)| tables.insert((keys_of_path(path), std::ptr::from_ref(*rows), *word)));
        (name, text, contents)
    };
    scenes().into_iter().map(first_keys).collect()
}

/// Last part of an error's key, without list indices.
fn last_key(error: &SceneError) -> String {
    let key = error.key.as_deref().unwrap_or_default();
    let last_key = key.rsplit('.').next().unwrap_or_default();
    last_key.split('[').next().unwrap_or_default().to_owned()
}

#[test]
fn every_key_of_the_format_is_read_and_no_other() {
    let mut read = BTreeSet::new();
    for (name, text, contents) in first_occurrences() {
        parse(&text).unwrap_or_else(|error| panic!("{name}: {error}"));
        for (path, row, _) in contents.keys {
            // No key accepts a date, so only a key that is never read would let it pass.
            let wrong = changed(&text, &path, None);
            let error = parse(&wrong).expect_err(&format!("{name}: {path:?} is not read"));
            assert_eq!(last_key(&error), row.name, "{name}: {path:?}: {error}");
            read.insert(std::ptr::from_ref(row));
        }
        for (path, rows, _) in contents.tables {
            let error = parse(&changed(&text, &path, Some("hue"))).unwrap_err();
            assert_eq!(last_key(&error), "hue", "{name}: {path:?}: {error}");
            assert!(error.message.contains("unknown key"), "{}: {error}", rows.name);
        }
    }
    let mut missing = Vec::new();
    for table in file_tables() {
        let rows = table.keys.iter();
        let never = rows.filter(|row| !read.contains(&std::ptr::from_ref(*row)));
        missing.extend(never.map(|row| format!("`{}` of `{}`", row.name, table.name)));
    }
    assert!(missing.is_empty(), "no scene has {}", missing.join(", "));
}

#[test]
fn rows_of_the_format_table_describe_their_values() {
    let tables = file_tables();
    let names: BTreeSet<&str> = tables.iter().map(|table| table.name).collect();
    assert_eq!(names.len(), tables.len(), "two tables of one name");
    for table in tables {
        assert!(!table.help.is_empty() && !table.head.is_empty());
        for row in table.keys {
            let place = format!("{} of {}", row.name, table.name);
            assert!(!row.help.is_empty() && !row.help.contains('|'), "{place}");
            assert!(row.of.iter().all(|word| table.words().contains(word)), "{place}");
            for (value_type, like) in [Some((row.value_type, row.example)), row.on_hinge].into_iter().flatten() {
                let text = format!("like = {like}");
                let parsed = like.is_empty() || text.parse::<DocumentMut>().is_ok();
                assert!(parsed, "{place}: {text}");
                let ValueType::Pairs(dimensions, _) = value_type else {
                    continue;
                };
                let pairs: BTreeMap<String, Vec<[Json; 2]>> = toml::from_str(&text).unwrap();
                for (number, dimension) in pairs["like"].iter().flat_map(|pair| pair.iter().zip(dimensions)) {
                    let quantity = evaluate(number.as_str().unwrap_or("0"), &[]).unwrap();
                    let zero = number == 0;
                    assert!(zero || quantity.of(dimension, true).is_ok(), "{place}: {number} for {dimension:?}");
                }
            }
        }
    }
}

/// The schema in an independent validator.
struct Schema {
    schemas: Schemas,
    index: SchemaIndex,
}

impl Schema {
    fn new() -> Self {
        let text: Json = serde_json::from_str(&schema::page()).unwrap();
        let mut compiler = Compiler::new();
        compiler.set_default_draft(Draft::V7);
        compiler.add_resource("scene.json", text).unwrap();
        let mut schemas = Schemas::new();
        let index = compiler.compile("scene.json", &mut schemas).unwrap_or_else(|error| panic!("{error:#}"));
        Self { schemas, index }
    }

    fn check(&self, text: &str) -> Result<(), String> {
        let scene: Json = toml::from_str(text).map_err(|error| error.to_string())?;
        let checked = self.schemas.validate(&scene, self.index);
        checked.map_err(|error| format!("{error:#}"))
    }
}

/// Bad files of the corpus whose error a schema can detect.
const WRONG_FORM: [&str; 22] = [
    "axis-of-zero",
    "bad-name",
    "bare-number",
    "date",
    "drive-without-law",
    "empty-name",
    "key-of-another-form",
    "key-of-another-joint",
    "links-without-chain",
    "missing-mass",
    "no-such-preset",
    "out-of-range",
    "pattern-count",
    "pattern-in-pattern",
    "play-of-a-fixed-joint",
    "play-of-another-kind",
    "play-without-length",
    "table-for-value",
    "two-rotations",
    "unknown-key",
    "wrong-kind",
    "wrong-type",
];

#[test]
fn the_schema_accepts_every_scene_and_refuses_bad_ones() {
    let schema = Schema::new();
    let page = include_str!("../../docs/scene-tutorial.md");
    let blocks = page.split("```toml\n").skip(1);
    let examples = blocks.filter_map(|rest| Some(("example".to_owned(), rest.split("```").next()?.to_owned())));
    for (name, text) in scenes().into_iter().chain(examples) {
        let text = text.trim_start_matches('\u{feff}');
        schema.check(text).unwrap_or_else(|error| panic!("{name}: {error}\n{text}"));
    }
    for name in WRONG_FORM {
        let [(name, text)] = &corpus(&format!("bad-{name}.toml"))[..] else {
            panic!("no file bad-{name}.toml");
        };
        assert!(schema.check(text).is_err(), "{name}");
    }
}

/// Mutations of each scene.
const MUTATIONS: u64 = 60;

#[test]
fn the_schema_accepts_whatever_the_reader_accepts() {
    let schema = Schema::new();
    let mut accepted = 0;
    for (name, text) in scenes() {
        for seed in 1..=MUTATIONS {
            let mutated = mutate(text.as_bytes(), &mut Random(seed));
            let Ok(mutated) = String::from_utf8(mutated) else {
                continue;
            };
            if parse(&mutated).is_ok() {
                accepted += 1;
                let text = mutated.trim_start_matches('\u{feff}');
                let checked = schema.check(text);
                checked.unwrap_or_else(|error| panic!("{name}, mutation {seed}: {error}\n{text}"));
            }
        }
    }
    assert!(accepted > 50, "{accepted} mutations are scenes");
}

#[test]
fn the_schema_refuses_wrong_values_and_unknown_keys() {
    let schema = Schema::new();
    for (name, text, contents) in first_occurrences() {
        let text = text.trim_start_matches('\u{feff}');
        for (path, ..) in &contents.keys {
            // Not a valid value of any kind.
            let wrong = changed(text, path, None).replace("1979-05-27", "{ colour = { red = 1 } }");
            assert!(schema.check(&wrong).is_err(), "{name}: {path:?}");
        }
        for (path, ..) in &contents.tables {
            let wrong = changed(text, path, Some("hue"));
            assert!(schema.check(&wrong).is_err(), "{name}: {path:?}");
        }
    }
}
