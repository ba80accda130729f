//! Random values of the keys of the scene format: a scene is read as written and starts, or is refused with the wrong key; equivalent
//! notations give the same scene.

use crate::common::invariants::finite;
use crate::properties::config;
use jointplay_physics::machine::{Quat, Vec3};
use jointplay_physics::simulate::{Frame, Simulation};
use jointplay_physics::units::{Dimension, si_unit};
use jointplay_scene::{
    ABOVE_ZERO, DefaultRule, FileKey, FileTable, Scene, SceneError, Texts, ValueType, file_tables, is_element,
};
use proptest::prelude::*;
use proptest::test_runner::TestCaseError;

/// Steps after every start.
const STEPS: u32 = 4;

/// The table of the format with this name.
fn rows(name: &str) -> &'static FileTable {
    let mut all = file_tables().into_iter();
    all.find(|table| table.name == name).expect("a table")
}

/// A number in quotes with the SI unit of its dimension.
fn quoted(value: f64, dimension: Dimension) -> String {
    format!("\"{value:e} {}\"", si_unit(dimension))
}

/// Numbers of either sign in a range, sampled logarithmically from 1e-4 to 1e4 and clamped to the range.
fn within((least, most): (f64, f64)) -> BoxedStrategy<f64> {
    let sized = (-4.0..4.0_f64).prop_map(|decade| 10_f64.powf(decade));
    let signed = (sized, any::<bool>()).prop_map(|(size, below)| if below { -size } else { size });
    let inside = (least.max(-1e4), most.min(1e4));
    let inside = match least {
        ABOVE_ZERO => (most.min(1e-4), inside.1),
        _ => inside,
    };
    signed.prop_map(move |x| x.clamp(inside.0, inside.1)).boxed()
}

/// A value of a key as in a file, for an element on a hinge (`hinge`) or on a slide.
fn value(key: &'static FileKey, hinge: bool) -> BoxedStrategy<String> {
    let dimension = key.dimension(hinge).unwrap_or(Dimension::None);
    let example = match key.on_hinge {
        Some((_, example)) if hinge => example,
        _ => key.example,
    };
    match key.value_type {
        ValueType::Number(_, range) => within(range).prop_map(move |x| quoted(x, dimension)).boxed(),
        ValueType::Vector(_, range) => proptest::collection::vec(within(range), 3)
            .prop_map(move |v| {
                let all: Vec<String> = v.iter().map(|x| quoted(*x, dimension)).collect();
                format!("[{}]", all.join(", "))
            })
            .boxed(),
        ValueType::Direction => {
            (-9..10_i32, -9..10_i32, 1..10_i32).prop_map(|(x, y, z)| format!("[{x}, {y}, {z}]")).boxed()
        }
        ValueType::Word(words) => proptest::sample::select(words).prop_map(|word| format!("\"{word}\"")).boxed(),
        ValueType::Flag => any::<bool>().prop_map(|flag| flag.to_string()).boxed(),
        ValueType::Table(table) if !table.words().is_empty() => {
            // The law of the paper's machine needs that machine.
            let words = table.words().iter().copied();
            let words: Vec<&'static str> = words.filter(|word| *word != "spcmm").collect();
            proptest::sample::select(words)
                .prop_flat_map(move |word| filled(table, Some(word), hinge, &[]))
                .prop_map(|keys| format!("{{ {} }}", keys.join(", ")))
                .boxed()
        }
        _ => Just(example.to_owned()).boxed(),
    }
}

/// Keys of a table with values, without those in `skip`: all required ones and most others.
fn filled(
    table: &'static FileTable,
    word: Option<&'static str>,
    hinge: bool,
    skip: &[&str],
) -> BoxedStrategy<Vec<String>> {
    let mut all: Vec<BoxedStrategy<Option<String>>> = Vec::new();
    let by = table.variants.map(|_| table.words());
    for key in table.of(word).filter(|key| !skip.contains(&key.name)) {
        let values = match (key.value_type, word) {
            (ValueType::Word(words), Some(word)) if by == Some(words) => Just(format!("\"{word}\"")).boxed(),
            _ => value(key, hinge),
        };
        let written = values.prop_map(|value| format!("{} = {value}", key.name));
        all.push(match key.default {
            DefaultRule::Required => written.prop_map(Some).boxed(),
            // The alternative to the file is chosen.
            DefaultRule::RequiredUnless(_) if matches!(key.value_type, ValueType::File) => Just(None).boxed(),
            DefaultRule::RequiredUnless(_) => written.prop_map(Some).boxed(),
            _ => proptest::option::weighted(0.7, written).boxed(),
        });
    }
    all.prop_map(|keys| keys.into_iter().flatten().collect()).boxed()
}

/// Two bodies, the second on a slide or hinge of the first.
fn machine(hinge: bool, more: &str) -> String {
    let kind = if hinge { "revolute" } else { "prismatic" };
    let body = "mass = \"1 kg\"\ninertia = \"1e-2 1e-2 1e-2 kg m^2\"\n";
    format!(
        "[[body]]\nname = \"base\"\n{body}\n[[joint]]\nname = \"base\"\nkind = \"free\"\nchild = \"base\"\n\
         start = {{ position = \"0 0 1 m\" }}\n\n[[body]]\nname = \"rod\"\n{body}\n[[joint]]\nname = \"crank\"\n\
         kind = \"{kind}\"\nparent = \"base\"\nchild = \"rod\"\naxis = [0, 1, 0]\n{more}"
    )
}

/// Checks that an error has a key, a position and a readable message.
fn check_error(error: &SceneError, text: &str) -> Result<(), TestCaseError> {
    let words = error.to_string();
    prop_assert!(error.key.is_some() && error.position.is_some(), "{words}\n{text}");
    prop_assert!(!words.contains("NaN") && words.len() < 2000, "{words}");
    Ok(())
}

/// Checks that a scene starts and runs with finite numbers, or is refused with a clear error.
fn check_run(text: &str) -> Result<(), TestCaseError> {
    let scene = match Scene::parse(text, None, &[]) {
        Ok(scene) => scene,
        Err(error) => return check_error(&error, text),
    };
    let saved = scene.to_toml();
    prop_assert_eq!(saved.as_deref(), Ok(text));
    let mut simulation = match Simulation::new(&scene.machine) {
        Ok(simulation) => simulation,
        Err(error) => {
            prop_assert!(!scene.locate(&error).to_string().contains("NaN"));
            return Ok(());
        }
    };
    let mut frame = Frame::default();
    simulation.sample(0.0, &mut frame);
    prop_assert!(finite(&frame), "{}", text);
    for _ in 0..STEPS {
        if let Err(stopped) = simulation.step() {
            prop_assert!(!stopped.to_string().contains("NaN"), "{}", stopped);
            break;
        }
    }
    simulation.sample(simulation.time(), &mut frame);
    prop_assert!(finite(&frame), "{}", text);
    Ok(())
}

/// Everything of a scene except its source.
fn without_source(text: &str, files: &Texts) -> String {
    let mut scene = Scene::parse_with(text, None, files, &[]).unwrap_or_else(|error| panic!("{error}\n{text}"));
    scene.source = Default::default();
    format!("{scene:?}")
}

/// A force element with any values, on a slide or a hinge.
fn elements() -> impl Strategy<Value = String> {
    let tables: Vec<&FileTable> = file_tables().into_iter().filter(|table| is_element(table)).collect();
    (0..tables.len(), any::<[bool; 2]>()).prop_flat_map(move |(place, [hinge, swings])| {
        let table = tables[place];
        let points = table.keys.iter().filter(|key| key.table().is_some_and(|table| table.name == "point"));
        let points: Vec<&str> = points.map(|key| key.name).collect();
        // Leaves out the key for the other kind of joint.
        let other = if hinge { "force" } else { "torque" };
        let on_joint = table.key("joint", None).is_some();
        // A load has either a frequency or a factor.
        let law: &[&str] = if swings { &["factor"] } else { &["frequency", "phase"] };
        let skip: Vec<&str> = [&["name"], law, &points].concat();
        let skip: Vec<&str> = skip.into_iter().chain(on_joint.then_some(other)).collect();
        filled(table, None, hinge, &skip).prop_map(move |keys| {
            let bodies = ["base", "rod"].into_iter().rev();
            let points = points.iter().zip(bodies);
            let point = |(key, body)| format!("{key} = {{ body = \"{body}\", at = \"0 0 10 mm\" }}\n");
            let points: String = points.map(point).collect();
            let section = format!("\n[[{}]]\nname = \"e\"\n{points}{}\n", table.name, keys.join("\n"));
            machine(hinge, &section)
        })
    })
}

/// A joint with any drive.
fn drives() -> impl Strategy<Value = String> {
    let joint = rows("joint");
    let drive = joint.key("drive", Some("revolute")).expect("a row");
    any::<bool>().prop_flat_map(move |hinge| {
        value(drive, hinge).prop_map(move |drive| machine(hinge, &format!("drive = {drive}\n")))
    })
}

/// A random expression of lengths and numbers that is a length: its text, and its value in m.
fn lengths() -> impl Strategy<Value = (String, f64)> {
    let leaf = (1..999_u32, any::<bool>()).prop_map(|(x, mm)| match mm {
        true => (format!("{x} mm"), f64::from(x) * 1e-3),
        false => (format!("{x} m"), f64::from(x)),
    });
    let arm = Just(("arm".to_owned(), 0.12));
    prop_oneof![leaf, arm].prop_recursive(4, 24, 2, |inner| {
        (inner.clone(), inner, 1..9_u32, 0..5_u32).prop_map(|((a, x), (b, y), n, which)| match which {
            0 => (format!("({a} + {b})"), x + y),
            1 => (format!("({a} - {b})"), x - y),
            2 => (format!("{n} * {a}"), f64::from(n) * x),
            3 => (format!("{a} / {n}"), x / f64::from(n)),
            _ => (format!("max({a}, {b})"), x.max(y)),
        })
    })
}

/// Forms without a mesh file.
const FORMS: [&str; 6] = ["capsule", "cylinder", "cone", "box", "sphere", "plate"];

const ARM: &str = "[[parameter]]\nname = \"arm\"\nvalue = \"120 mm\"\n";

proptest! {
    #![proptest_config(config(96))]

    #[test]
    fn any_force_element_runs_or_is_refused_by_key(text in elements()) {
        check_run(&text)?;
    }

    #[test]
    fn any_drive_runs_or_is_refused_by_key(text in drives()) {
        check_run(&text)?;
    }

    #[test]
    fn an_expression_reads_as_its_computed_value((text, value) in lengths()) {
        let scene = format!("{ARM}{}", machine(false, &format!("start = {{ position = \"{text}\" }}\n")));
        match Scene::parse(&scene, None, &[]) {
            Ok(scene) => {
                let read = scene.source.numbers["joint.crank.start.position"].value;
                prop_assert!((read - value).abs() <= 1e-12 * value.abs().max(1e3), "{text}: {read} {value}");
            }
            Err(error) => {
                check_error(&error, &scene)?;
                prop_assert!(value.abs() > 1e6, "{error}");
            }
        }
        // No length is a mass.
        let wrong = scene.replacen("\"1 kg\"", &format!("\"{text}\""), 1);
        let error = Scene::parse(&wrong, None, &[]).expect_err("a length for a mass");
        prop_assert_eq!(error.key.as_deref(), Some("body.base.mass"));
    }

    #[test]
    fn a_number_reads_the_same_as_an_expression_and_as_a_parameter(value in within((-1e4, 1e4))) {
        let plain = format!("{value:e} m");
        let parameter = format!("[[parameter]]\nname = \"own\"\nvalue = \"{plain}\"\n");
        let scene = |text: &str| {
            let more = format!("start = {{ position = \"{text}\" }}\nparent_point = [0, \"{text}\", 0]\n");
            without_source(&format!("{parameter}{}", machine(false, &more)), &Texts::new())
        };
        let expected = scene(&plain);
        for other in ["own".to_owned(), format!("2 * ({plain}) / 2"), "own * 4 / 4".to_owned()] {
            prop_assert_eq!(scene(&other), expected.clone(), "{}", other);
        }
    }

    #[test]
    fn instances_of_a_pattern_have_the_expected_poses(
        count in 1..6_u32,
        at in proptest::array::uniform3(-1.0..1.0_f64),
        centre in proptest::array::uniform3(-1.0..1.0_f64),
        axis in proptest::array::uniform3(1..9_i32),
        angle in -3.0..3.0_f64,
        along in proptest::array::uniform3(-1.0..1.0_f64),
    ) {
        let list = |v: [f64; 3]| format!("\"{:e} {:e} {:e} m\"", v[0], v[1], v[2]);
        let text = format!(
            "[[pattern]]\nname = \"p\"\ncount = {count}\nalong = {}\n\
             about = {{ point = {}, axis = {axis:?}, angle = \"{angle:e} rad\" }}\n\
             body = [{{ name = \"rod\", mass = \"i * 1 kg\", inertia = \"1 1 1 kg m^2\" }}]\n\
             joint = [{{ name = \"free\", kind = \"free\", child = \"rod\", start = {{ position = {} }} }}]\n",
            list(along), list(centre), list(at)
        );
        let scene = Scene::parse(&text, None, &[]).unwrap();
        prop_assert_eq!(scene.machine.bodies.len(), count as usize);
        let mut simulation = Simulation::new(&scene.machine).unwrap();
        let mut frame = Frame::default();
        simulation.sample(0.0, &mut frame);
        let [at, centre, along] = [at, centre, along].map(Vec3::from);
        let axis = nalgebra::Unit::new_normalize(Vec3::from(axis.map(f64::from)));
        for (k, body) in frame.bodies.iter().enumerate() {
            let turn = Quat::from_axis_angle(&axis, angle * k as f64);
            let expected = centre + turn * (at - centre) + along * k as f64;
            prop_assert!((body.position - expected).norm() < 1e-12);
            let error = body.rotation - turn.to_rotation_matrix().into_inner();
            prop_assert!(error.amax() < 1e-12);
            prop_assert_eq!(scene.machine.bodies[k].mass, (k + 1) as f64);
        }
    }

    #[test]
    fn an_included_part_equals_the_same_text_in_the_scene(element in elements(), cut in 0..5_usize) {
        // The included part comes last, so that lists keep their order.
        let parts: Vec<&str> = element.split_inclusive("\n\n").collect();
        let (own, included) = parts.split_at(cut.min(parts.len()));
        let (own, included) = (own.concat(), included.concat());
        let files = Texts::from([("part.toml".to_owned(), included.into())]);
        if Scene::parse(&element, None, &[]).is_ok() {
            let single = format!("name = \"x\"\n{element}");
            let split = format!("name = \"x\"\ninclude = [\"part.toml\"]\n{own}");
            prop_assert_eq!(without_source(&single, &Texts::new()), without_source(&split, &files));
        }
    }

    #[test]
    fn the_mass_of_a_body_is_proportional_to_its_density(
        form in proptest::sample::select(&FORMS[..]),
        density in 1.0..1e4_f64,
        shift in proptest::array::uniform3(-0.5..0.5_f64),
        size in proptest::array::uniform3(0.01..0.3_f64),
    ) {
        let body = |density: f64, shift: [f64; 3]| {
            let point = |v: [f64; 3]| {
                let v: Vec<String> = v.iter().zip(shift).map(|(a, b)| format!("\"{:e} m\"", a + b)).collect();
                format!("[{}]", v.join(", "))
            };
            let [a, b, c] = size;
            let geometry = match form {
                "box" => format!("centre = {}, size = \"{a} {b} {c} m\"", point([0.0; 3])),
                "sphere" => format!("centre = {}, radius = \"{a} m\"", point([0.0; 3])),
                "plate" => format!(
                    "corners = [{}, {}, {}], thickness = \"{c} m\"",
                    point([0.0; 3]), point([a, 0.0, 0.0]), point([0.0, b, 0.0])
                ),
                _ => format!("from = {}, to = {}, radius = \"{c} m\"", point([0.0; 3]), point([a, b, 0.0])),
            };
            let text = format!(
                "[[body]]\nname = \"a\"\ndensity = \"{density:e} kg/m^3\"\n\
                 shapes = [{{ form = \"{form}\", role = \"pin\", {geometry} }}]\n\
                 [[joint]]\nname = \"j\"\nkind = \"fixed\"\nchild = \"a\"\n"
            );
            Scene::parse(&text, None, &[]).map(|scene| scene.machine.bodies[0].clone())
        };
        let plain = body(density, [0.0; 3]).unwrap();
        let heavy = body(2.0 * density, [0.0; 3]).unwrap();
        let shifted = body(density, shift).unwrap();
        prop_assert_eq!(heavy.mass, 2.0 * plain.mass);
        prop_assert_eq!(heavy.inertia, plain.inertia * 2.0);
        prop_assert!((shifted.mass / plain.mass - 1.0).abs() < 1e-9);
        prop_assert!((shifted.centre - plain.centre - Vec3::from(shift)).norm() < 1e-9);
        prop_assert!((shifted.inertia - plain.inertia).amax() < 1e-6 * plain.inertia.amax());
    }
}
