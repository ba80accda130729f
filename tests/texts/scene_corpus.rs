//! The corpus of the fuzz target, the built-in scenes, and thousands of mutations of both: no panics, and errors with positions.

#[path = "../fuzz/check.rs"]
mod fuzz;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use fuzz::{Outcome, check};
use jointplay::scene::{BUILT_IN, built_in_text};

/// Mutations of each file of the corpus and of each built-in scene, multiplied by the environment variable `SCENE_MUTATIONS`.
const MUTATIONS: u64 = 40;
const MUTATIONS_OF_BUILT_IN: u64 = 200;

/// Changes that are appended to some mutated texts; some of them are valid.
const CHANGES: [&str; 25] = [
    "parameter.stroke=12 mm",
    "parameter.stroke=1",
    "body.rod.mass=2 kg",
    "body.rod1.mass=0 kg",
    "parameter.arm=60 mm",
    "body.block.density=1 g/cm^3",
    "spring.coil.stiffness=0 N/m",
    "joint.drive4.drive.duration=1 us",
    "motor.turn.torque=-1 N m",
    "contact.clearance=0",
    "contact.clearance=0.5mm",
    "contact.clearance=1e400 mm",
    "contact.restitution=0",
    "contact.normal_law=flores",
    "contact.friction=10",
    "joint.S1.clearance=0",
    "joint..clearance=1 mm",
    "joint.\u{1b}]0;.x=1",
    "chain.links=4096",
    "chain.links=-1",
    "solver.method=radau5",
    "solver.method=discrete-gradient",
    "solver.method=rk4",
    "spcmm.frequency=50 Hz",
    "\u{202e}=\u{9b}",
];

/// Tokens that tend to break parsers.
const TOKENS: [&str; 45] = [
    "0",
    "-0",
    "1",
    "-1",
    "1e-308",
    "1e308",
    "1e400",
    "nan",
    "-inf",
    "9223372036854775807",
    "0x7fffffffffffffff",
    "true",
    "\"\"",
    "\"nan m\"",
    "\"1e400 mm\"",
    "\"0 0 0\"",
    "\"1 2\"",
    "\"1 2 3 4 mm\"",
    "\"\u{b5}m\"",
    "\"1 m m\"",
    "\"arm / 2\"",
    "\"2 * (3 mm + i * 1 m)\"",
    "\"sqrt(-1) * 1 mm / 0\"",
    "\"t^2\"",
    "{ law = \"harmonic\", amplitude = 0, frequency = \"1 Hz\" }",
    "[]",
    "[[]]",
    "{}",
    "[0, 0]",
    "[0, 0, 0]",
    "[\"0\", 0, 0]",
    "[1e308, 1e308, 1e308]",
    "{ axis = [0, 0, 0], angle = \"1 rad\" }",
    "=",
    "[",
    "]",
    "\"",
    "'''",
    "#",
    ".",
    "\n",
    "\u{0}",
    "\u{feff}",
    "world",
    "1979-05-27",
];

pub struct Random(pub u64);

impl Random {
    fn next(&mut self) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33) as usize
    }

    fn below(&mut self, count: usize) -> usize {
        self.next() % count.max(1)
    }
}

/// Byte ranges of words, numbers, strings and symbols.
fn tokens(bytes: &[u8]) -> Vec<(usize, usize)> {
    let mut tokens = Vec::new();
    let mut i = 0;
    while i < bytes.len() {
        let start = i;
        let is_word_byte = |b: u8| b.is_ascii_alphanumeric() || b"_.-+".contains(&b);
        if bytes[i] == b'"' {
            i += 1;
            while i < bytes.len() && bytes[i] != b'"' && bytes[i] != b'\n' {
                i += 1;
            }
            i = (i + 1).min(bytes.len());
        } else if is_word_byte(bytes[i]) {
            while i < bytes.len() && is_word_byte(bytes[i]) {
                i += 1;
            }
        } else {
            i += 1;
            if bytes[start].is_ascii_whitespace() {
                continue;
            }
        }
        tokens.push((start, i));
    }
    tokens
}

/// Mutates `text` once or twice.
pub fn mutate(text: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = text.to_vec();
    for _ in 0..=random.below(2) {
        let ranges = tokens(&bytes);
        if ranges.is_empty() {
            break;
        }
        let (from, to) = ranges[random.below(ranges.len())];
        let (other_from, other_to) = ranges[random.below(ranges.len())];
        let lines: Vec<&[u8]> = bytes.split_inclusive(|b| *b == b'\n').collect();
        let line = random.below(lines.len());
        match random.below(12) {
            0 => {
                let at = random.below(bytes.len());
                bytes[at] ^= 1 << random.below(8);
            }
            1 => bytes.truncate(random.below(bytes.len())),
            2 => {
                let other = bytes[other_from..other_to].to_vec();
                bytes.splice(from..to, other);
            }
            3 | 4 => {
                let token = TOKENS[random.below(TOKENS.len())];
                bytes.splice(from..to, token.bytes());
            }
            5 => {
                bytes.drain(from..to);
            }
            6 => {
                let mut shorter = lines;
                shorter.remove(line);
                bytes = shorter.concat();
            }
            7 => {
                let mut longer = lines.clone();
                longer.insert(random.below(lines.len()), lines[line]);
                bytes = longer.concat();
            }
            // The mutation most likely to leave a valid scene: another digit, sign or power of ten.
            _ => {
                let digits: Vec<usize> = (0..bytes.len()).filter(|&i| bytes[i].is_ascii_digit()).collect();
                let Some(&at) = digits.get(random.below(digits.len())) else {
                    continue;
                };
                let other = ["0", "1", "9", "-1", "1e3", "1e-3", "0.0"][random.below(7)];
                bytes.splice(at..=at, other.bytes());
            }
        }
    }
    if random.below(3) == 0 {
        let change = CHANGES[random.below(CHANGES.len())];
        bytes.extend(format!("\n#set {change}\n").into_bytes());
    }
    bytes
}

/// Name and bytes of every file of the corpus.
fn corpus() -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/corpus");
    let entries = std::fs::read_dir(folder).unwrap();
    let mut paths: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let read = |path: std::path::PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        (name, std::fs::read(path).unwrap())
    };
    paths.into_iter().map(read).collect()
}

/// Checks a text; a panic is reported with the text.
fn check_without_panic(name: &str, bytes: &[u8]) -> Outcome {
    std::panic::catch_unwind(|| check(bytes))
        .unwrap_or_else(|_| panic!("{name} breaks the reader:\n{}", String::from_utf8_lossy(bytes)))
}

#[test]
fn each_scene_of_the_corpus_ends_as_its_name_states() {
    let corpus = corpus();
    assert!(corpus.len() > 30);
    let mut wrong = Vec::new();
    for (name, bytes) in &corpus {
        let expected = match name.split('-').next() {
            Some("good") => Outcome::Starts,
            Some("stuck") => Outcome::NoStart,
            Some("bytes") => Outcome::NoText,
            _ => Outcome::Refused,
        };
        let outcome = check_without_panic(name, bytes);
        if outcome != expected {
            wrong.push(format!("{name}: {outcome:?}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn mutations_of_the_corpus_cause_no_panic() {
    let times = std::env::var("SCENE_MUTATIONS").ok();
    let times = times.map_or(1, |times| times.parse::<u64>().expect("a number"));
    let mut seeds: Vec<(String, Vec<u8>, u64)> =
        corpus().into_iter().map(|(name, bytes)| (name, bytes, MUTATIONS)).collect();
    for name in BUILT_IN {
        let text = built_in_text(name).unwrap();
        assert_eq!(check_without_panic(name, text.as_bytes()), Outcome::Starts);
        seeds.push((name.to_owned(), text.as_bytes().to_vec(), MUTATIONS_OF_BUILT_IN));
    }
    let next = AtomicUsize::new(0);
    let outcomes = std::sync::Mutex::new(BTreeMap::<String, u64>::new());
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while let Some((name, bytes, count)) = seeds.get(next.fetch_add(1, Ordering::Relaxed)) {
                    for seed in 1..=*count * times {
                        let mutated = mutate(bytes, &mut Random(seed));
                        let outcome = check_without_panic(&format!("{name}, mutation {seed}"), &mutated);
                        *outcomes.lock().unwrap().entry(format!("{outcome:?}")).or_default() += 1;
                    }
                }
            });
        }
    });
    let outcomes = outcomes.into_inner().unwrap();
    println!("{outcomes:?}");
    // If all mutations failed to parse, the test would check nothing.
    assert!(outcomes["Refused"] > 1000 && outcomes["Starts"] > 200, "{outcomes:?}");
}
