//! Round trips, hand-written links and damaged links.

use super::*;
use crate::session::link::settings::WearMap;
use crate::session::log::Event;

/// Deterministic pseudo-random numbers (splitmix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, end: u64) -> u64 {
        self.next() % end
    }

    fn optional<T>(&mut self, make: impl FnOnce(&mut Self) -> T) -> Option<T> {
        (self.below(3) > 0).then(|| make(self))
    }

    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn text(&mut self, most: u64) -> String {
        const LETTERS: [char; 14] = ['a', 'Z', '0', ' ', '&', '=', '#', '?', '+', '%', '"', 'µ', '\n', '🦀'];
        let length = 1 + self.below(most);
        (0..length).map(|_| LETTERS[self.below(LETTERS.len() as u64) as usize]).collect()
    }

    fn link(&mut self) -> Link {
        let mut log = Log::default();
        for index in 0..self.below(4) {
            let value = format!("x{}x", self.text(9)).replace('\n', " ");
            log.base.push((format!("contact.k{index}"), value));
        }
        let mut steps = 0;
        for _ in 0..self.below(6) {
            steps += self.below(1 << 40);
            if self.below(2) == 0 {
                log.set(steps, "joint.S1.friction", &self.text(9));
            } else {
                let key = "solver.preset".to_owned();
                log.push(steps, Event::Original { key });
            }
        }
        Link {
            scene: if self.below(2) == 0 {
                SceneText::BuiltIn("pendulum".to_owned())
            } else {
                SceneText::File {
                    name: format!("a{}.toml", self.text(6)).replace(['\n', '/'], "_"),
                    text: self.text(300),
                }
            },
            log,
            steps: Some(steps + self.below(100)),
            time: self.optional(|c| c.unit() * 1e3),
            hash: self.optional(Self::next),
            time_scale: self.optional(|c| 1e-4 + 0.9 * c.unit()),
            camera: self.optional(|c| CameraPose {
                yaw: c.unit() as f32,
                pitch: 1.5 - 3.0 * c.unit() as f32,
                distance: 0.1 + c.unit() as f32,
                target: [0; 3].map(|_| c.unit() as f32 - 0.5),
                fitted: c.optional(|c| 0.5 + c.unit() as f32),
            }),
            magnification: self.optional(|c| 1.0 + 99.0 * c.unit() as f32),
            follow: self.optional(|c| format!("joint.x{}x", c.text(6)).replace('\n', " ")),
            plots: self.optional(|c| {
                let one = Quantity::ALL[c.below(Quantity::ALL.len() as u64) as usize];
                let others = Quantity::ALL.into_iter().filter(|q| *q != one);
                let mut all: Vec<Quantity> = others.filter(|_| c.below(3) == 0).collect();
                if c.below(2) == 0 {
                    // In any order.
                    all.insert(0, one);
                }
                all
            }),
            channels: self.optional(|c| {
                let names = 0..c.below(4);
                names.map(|n| format!("S{n}.*_-?x{}", c.below(9))).collect()
            }),
            window: self.optional(|c| match c.below(3) {
                0 => PlotWindow::Automatic,
                1 => PlotWindow::Everything,
                _ => PlotWindow::Last(1e-6 + c.unit()),
            }),
            instruments: self.optional(|c| Instruments {
                microscope: c.optional(|c| format!("S{}", c.below(9))),
                ideal: c.below(2) == 0,
                wear: [WearMap::Off, WearMap::Impulse, WearMap::FrictionWork, WearMap::Depth][c.below(4) as usize],
            }),
            lesson: self.optional(|c| format!("x{}x", c.text(9)).replace('\n', " ")),
            step: self.optional(|c| 1 + c.below(40) as usize),
            embedded: self.optional(|c| {
                let words = ["", "controls", "timeline,bench", "controls,plots"];
                Embedded::read(words[c.below(4) as usize]).expect("panels")
            }),
            playing: self.optional(|c| c.below(2) == 0),
            theme: self.optional(|c| ThemeChoice::ALL[c.below(3) as usize]),
            version: self.optional(|_| "0.1.0".to_owned()),
            beside: Texts::new(),
        }
    }
}

#[test]
fn every_link_reads_back_to_the_same_bits() {
    let mut random = Random(1);
    for _ in 0..500 {
        let link = random.link();
        let text = link.format();
        for form in [
            text.clone(),
            format!("?{text}"),
            format!("#{text}"),
            format!("https://example.org/lab/index.html?c=1mm&renderer=webgl#{text}"),
        ] {
            let read = Link::parse(&form).unwrap_or_else(|error| panic!("{error}\n{form}"));
            assert_eq!(read, link, "{form}");
            assert_eq!(read.time.map(f64::to_bits), link.time.map(f64::to_bits), "{form}");
        }
        assert!(text.is_ascii() && !text.contains(['#', '?', ' ', '"']), "{text}");
    }
}

#[test]
fn no_text_causes_a_panic() {
    let mut random = Random(2);
    let mut read = 0;
    for _ in 0..1000 {
        let mut bytes = random.link().format().into_bytes();
        for _ in 0..=random.below(4) {
            let at = random.below(bytes.len() as u64) as usize;
            match random.below(3) {
                0 => bytes[at] = random.below(256) as u8,
                1 => bytes.truncate(at.max(1)),
                _ => bytes.insert(at, b"&=%#?-+0"[random.below(8) as usize]),
            }
        }
        if let Ok(link) = Link::parse(&String::from_utf8_lossy(&bytes)) {
            read += 1;
            // A nonsensical scene is an error.
            assert!(link.load().is_err() || link.log.base.is_empty());
        }
        // Arbitrary text does not panic, either.
        let _ = Link::parse(&random.text(200));
    }
    assert!(read > 40, "{read} are still links");
}

#[test]
fn a_handwritten_link_accepts_short_names_and_full_keys() {
    let link = Link::parse("?scene=pendulum&c=0.5mm&cf=0.2&ce=0.8&method=rk4&t=20ms&scale=1:50").expect("a link");
    let scene = link.load().expect("known keys");
    assert_eq!(scene.name, "pendulum");
    assert_eq!(scene.machine.contact.clearance, 0.5e-3);
    assert_eq!((scene.machine.contact.friction, scene.machine.contact.restitution), (0.2, 0.8));
    assert_eq!(link.time, Some(0.02));
    assert_eq!(link.time_scale, Some(0.02));
    assert!(link.has_instant());

    let link = Link::parse("joint.S1.clearance=0.5+mm&view.down=%2Bx").expect("a link");
    assert_eq!(link.scene, SceneText::BuiltIn(DEFAULT_SCENE.to_owned()));
    let scene = link.load().expect("known keys");
    assert_eq!(scene.machine.loose_joints[0].contact.clearance, 0.5e-3);
    assert!(!link.has_instant());

    // The fragment overrides the query, and replaces it if it names a scene.
    let changes_of = |text: &str| Link::parse(text).expect("a link").log.base;
    let clearance = |value: &str| vec![("contact.clearance".to_owned(), value.to_owned())];
    assert_eq!(changes_of("/?c=1mm#c=2mm"), clearance("2mm"));
    assert_eq!(changes_of("/?c=1mm#scene=pendulum"), Vec::new());
    assert_eq!(changes_of("http://localhost:1/a?c=1mm"), clearance("1mm"));
    assert_eq!(changes_of("http://localhost:1/a"), Vec::new());
    assert_eq!(changes_of("localhost:1?c=1mm"), clearance("1mm"));
    assert_eq!(changes_of("https://example.org/a=b/#c=1mm"), clearance("1mm"));
    // Bare pairs before a fragment are a query.
    let link = Link::parse("scene=pendulum#c=1mm").expect("a link");
    assert_eq!((link.scene, link.log.base), (SceneText::BuiltIn("pendulum".to_owned()), clearance("1mm")));
    assert_eq!(changes_of(""), Vec::new());
}

#[test]
fn errors_in_a_link_state_key_and_cause() {
    for (text, words) in [
        ("clearance=0.5mm", "link: clearance: unknown word (did you mean `contact.clearance`?); allowed:"),
        ("clearence=0.5mm", "(did you mean `contact.clearance`?)"),
        ("scael=0.5", "(did you mean `scale`?)"),
        ("scale=2", "link: scale = 2: allowed 0.0001 to 1"),
        ("t=5", "link: t = 5: needs a unit"),
        ("t=-5ms", "allowed 0 to 1000000 s"),
        ("steps=many", "is not a number of steps"),
        ("hash=12", "is not a state hash"),
        ("camera=1,2,3", "is not a camera"),
        ("camera=0,0,1,0,0,0,0", "is not a camera"),
        ("camera=0,0,nan,0,0,0", "is not a camera"),
        ("magnification=1000", "allowed 1 to 100"),
        ("plots=speed", "no plot `speed`; allowed, separated by commas: normal-force,"),
        ("channels=S1.force+rod/1", "no names of channels; allowed, separated by commas, are those"),
        (
            "show=telescope",
            "no instrument `telescope`; allowed, separated by commas: microscope.JOINT, ideal, wear-impulse,",
        ),
        ("window=5", "link: window = 5: needs a unit"),
        ("window=0", "allowed automatic, everything, and 1 us to 10000 s"),
        ("c=0,5mm&window=0,5s", "has a decimal comma; write a point"),
        ("play=yes", "allowed 0 (paused) and 1 (playing)"),
        ("text=%%%", "does not unpack"),
        ("log=AAAA", "does not unpack"),
        ("scene=/etc/passwd", "a link names a built-in scene"),
        ("scene=../mine.toml", "a link names a built-in scene"),
        // Nothing that is given is ignored.
        ("pendulum", "link: pendulum: is neither pairs nor the address of a page"),
        ("mine.toml", "is neither pairs nor the address of a page"),
        ("example.org/lab/", "is neither pairs nor the address of a page"),
        ("pendulum?c=1mm", "link: pendulum: is neither pairs nor the address of a page"),
        ("runs/mine.toml#c=1mm", "is neither pairs nor the address of a page"),
        ("?pendulum", "link: pendulum: unknown word"),
        ("pendulum&c=1mm", "link: pendulum: unknown word"),
        ("file=pendulum", "names the scene file in `text`, which is missing"),
        ("scene=pendulum&text=AwA", "the link also has a scene file, in `text`"),
    ] {
        let error = Link::parse(text).expect_err(text).to_string();
        assert!(error.contains(words), "{text}: {error}");
    }
    for (text, words) in [
        ("scene=pendulun", "did you mean `pendulum`?"),
        ("c=0.5", "contact.clearance = 0.5: needs a unit"),
        ("c=-1mm", "out of range"),
        ("scene=pendulum&spcmm.frequency=1Hz", "spcmm.frequency = 1Hz: unknown key"),
        ("contact.clearence=1mm", "did you mean `contact.clearance`?"),
    ] {
        let error = Link::parse(text).expect("well formed").load();
        let error = error.expect_err(text).to_string();
        assert!(error.contains(words), "{text}: {error}");
    }
}

#[test]
fn a_decompression_bomb_is_rejected() {
    let zeros = "0".repeat(MAX_UNPACKED_LINK + 1);
    let packed = pack(&zeros);
    assert!(packed.len() < 10_000);
    let error = Link::parse(&format!("text={packed}")).expect_err("too large");
    assert!(error.to_string().contains("does not unpack"));
    let long = |length: usize| format!("?scene={}", "x".repeat(length - "?scene=".len()));
    assert!(Link::parse(&long(MAX_LINK_LENGTH)).is_ok());
    let error = Link::parse(&long(MAX_LINK_LENGTH + 1)).expect_err("too long");
    assert!(error.to_string().contains("allowed at most 32000"), "{error}");
}

#[test]
fn a_link_that_is_too_long_omits_the_run_or_is_refused() {
    let mut random = Random(3);
    let scene = Scene::load("pendulum", &[("contact.friction".into(), "0.3".into())]).expect("built in");
    let mut link = Link { scene: SceneText::of(&scene), steps: Some(1 << 40), hash: Some(7), ..Link::default() };
    for index in 0..8000 {
        let value = format!("{} mm", random.unit());
        link.log.set(index, "contact.clearance", &value);
    }
    assert!(link.format().len() > MAX_LINK_LENGTH);
    let (short, note) = link.format_short(&scene).expect("the start fits");
    assert!(short.len() <= MAX_LINK_LENGTH && note.is_some());
    let start = Link::parse(&short).expect("a link");
    assert_eq!(start.log.base, scene.changes);
    assert!(!start.has_instant() && start.hash.is_none());

    let noise: String = (0..40_000).map(|_| char::from(b'a' + random.below(26) as u8)).collect();
    link.scene = SceneText::File { name: "mine.toml".to_owned(), text: noise };
    let error = link.format_short(&scene).expect_err("does not fit");
    assert!(error.contains("too large for a link"), "{error}");
}

#[test]
fn a_link_too_long_for_an_address_is_stored_and_read_back() {
    let mut random = Random(5);
    let (mut plain, mut packed) = (0, 0);
    for _ in 0..100 {
        let mut link = random.link();
        let fragment = link.format();
        assert_eq!(link.to_storage_text(), fragment);
        plain += 1;
        link.beside.insert("a lift.csv".to_owned(), "time_s,y_mm\n0,0\n".into());
        assert_eq!(link.format(), fragment, "links contain no data files");
        let stored = link.to_storage_text();
        assert!(stored.starts_with("kept:"));
        assert_eq!(Link::parse(&stored).expect("reads"), link);
        packed += 1;
    }
    assert_eq!((plain, packed), (100, 100));
    let noise: String = (0..60_000).map(|_| char::from(b'a' + random.below(26) as u8)).collect();
    let (name, text) = ("mine.toml".to_owned(), noise);
    let large = Link { scene: SceneText::File { name, text }, ..Link::default() };
    assert!(Link::parse(&format!("#{}", large.format())).is_err());
    let stored = large.to_storage_text();
    assert_eq!(Link::parse(&stored).expect("reads"), large);
    let error = Link::parse(&stored[..stored.len() / 2]).expect_err("cut");
    assert!(error.to_string().contains("cut short or damaged"), "{error}");
    let error = Link::parse("#kept=1").expect_err("stored by another browser");
    assert!(error.to_string().contains("open the scene file here"), "{error}");
}

#[test]
fn a_built_in_scene_is_named_and_any_other_is_contained_in_the_link() {
    let scene = Scene::load("chain", &[]).expect("built in");
    assert_eq!(SceneText::of(&scene), SceneText::BuiltIn("chain".to_owned()));
    let text = format!("{}\n# mine\n", scene.source.text);
    let mine = Scene::parse(&text, Some("/home/me/chain.toml"), &[]).expect("reads");
    let name = "chain.toml".to_owned();
    assert_eq!(SceneText::of(&mine), SceneText::File { name, text });
}

#[test]
fn links_are_distinguished_from_files_and_scenes() {
    for link in [
        "https://example.org/lab/#scene=pendulum",
        "example.org/lab/?scene=pendulum",
        " ?scene=pendulum",
        "#scene=pendulum&v=0.5m/s",
        "scene=pendulum&c=0.5mm",
    ] {
        assert!(is_link(link), "{link}");
    }
    for other in ["pendulum", "mine.toml", "runs/mine", "c=0.5mm/mine.toml"] {
        assert!(!is_link(other), "{other}");
    }
    let file = tempfile::Builder::new().prefix("c=0.5mm").tempfile();
    let path = file.expect("a file").into_temp_path();
    assert!(!is_link(&path.display().to_string()), "it is a file");
}
