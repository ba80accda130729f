//! Joints with play other than balls: what `check`, `run`, `map` and `render` say of them.

use std::fs;

use serde_json::Value as Json;

use crate::program::{folder, jointplay};

const THROWN: &str = include_str!("../../assets/benchmarks/thrown-pin.toml");
const CRANK: &str = include_str!("../../assets/benchmarks/crank-pin.toml");
const BLOCK: &str = include_str!("../../assets/benchmarks/released-slide.toml");
/// Contacts of the thrown pin from an independent program; its sites are the ends of the axis, at -L/2 and +L/2.
const CONTACTS: &str = include_str!("../physics/joints/a-contacts.csv");

#[test]
fn check_names_kinds_and_dimensions() {
    let folder = folder();
    let cases: [(&str, &[&str]); 5] = [
        (
            THROWN,
            &[
                "Joints                none\n",
                "Joints with play      1 (J)\n",
                "revolute, radial play 0.1 mm, axial play 0.2 mm, pin radius 10 mm, length 24 mm, ends of the pin,",
                "contact forces at J",
                "reactions of ideal joints: no joint has a play of 0",
            ],
        ),
        (
            CRANK,
            &[
                "Joints                1 prismatic (guide), 1 driven revolute (crank)\n",
                "Joints with play      1 (J), 1 without (S)\n",
                "cylindrical, radial play 0.5 mm, pin radius 10 mm, length 20 mm, ends of the pin,",
                "reactions of the ideal joints at S",
            ],
        ),
        (BLOCK, &["prismatic, play along y 1 mm, block 100 x 50 mm, planar, corner radius 1 mm, gonthier"]),
        // Its axial play alone is play, too.
        (&THROWN.replace("radial = \"0.1 mm\"", "radial = 0"), &["Joints with play      1 (J)\n", "radial play 0 mm"]),
        // Without play it cannot start displaced.
        (
            &THROWN
                .split("[joint.start]")
                .next()
                .unwrap()
                .replace("radial = \"0.1 mm\", axial = \"0.2 mm\"", "radial = 0"),
            &["Joints with play      1 without (J)\n", "revolute, ideal; reaction at the start", "no joint has play"],
        ),
    ];
    for (text, present) in cases {
        fs::write(folder.path().join("own.toml"), text).unwrap();
        let report = jointplay(folder.path(), "check own.toml").expect(0).stdout;
        for words in present {
            assert!(report.contains(words), "`{words}` is not in:\n{report}");
        }
        assert!(!report.contains("ball"), "{report}");
    }
}

#[test]
fn impacts_of_a_pin_name_their_ends() {
    let folder = folder();
    fs::write(folder.path().join("own.toml"), THROWN).unwrap();
    jointplay(folder.path(), "run own.toml --duration 5ms --impacts hits.json").expect(0);
    let file: Json = serde_json::from_str(&fs::read_to_string(folder.path().join("hits.json")).unwrap()).unwrap();
    let column = |name: &str| file["columns"][name].as_array().unwrap().clone();
    let sites = &file["meta"]["sites"];
    assert_eq!(*sites, serde_json::json!([["J.a", "J.b", "J.front", "J.back"]]));
    let (joints, places, starts) = (column("joint"), column("site"), column("start_s"));
    let name = |k: usize| {
        let [joint, place] = [&joints[k], &places[k]].map(|index| index.as_f64().unwrap() as usize);
        sites[joint][place].as_str().unwrap().to_owned()
    };
    let mut found: Vec<(f64, String)> = (0..starts.len()).map(|k| (starts[k].as_f64().unwrap(), name(k))).collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let expected: Vec<(f64, String)> = CONTACTS
        .lines()
        .skip(1)
        .map(|line| {
            let mut parts = line.split(',');
            let site = match parts.next().unwrap() {
                "P-" => "J.a",
                "P+" => "J.b",
                "Pa+" => "J.front",
                "Pa-" => "J.back",
                other => panic!("{other}"),
            };
            (parts.next().unwrap().parse().unwrap(), site.to_owned())
        })
        .take(found.len())
        .collect();
    assert!(found.len() > 5, "{found:?}");
    for ((start, site), (time, end)) in found.iter().zip(&expected) {
        // The first contacts; later ones spread with the difference of the two integrations.
        assert!((start - time).abs() < 1e-6 && site == end, "{site} at {start}: {end} at {time}");
    }
}

#[test]
fn balls_alone_have_wear_maps_and_all_kinds_reachable_sets() {
    let folder = folder();
    fs::write(folder.path().join("own.toml"), THROWN).unwrap();
    fs::write(folder.path().join("crank.toml"), CRANK).unwrap();
    let refused = jointplay(folder.path(), "run own.toml --duration 1ms --wear worn.csv").expect(2).stderr;
    assert!(refused.contains("--wear: only ball joints have a wear map, not J (revolute)"), "{refused}");
    let run = "run crank.toml --set joint.S.clearance=0.1mm --duration 1ms --wear worn.csv";
    let warned = jointplay(folder.path(), run).expect(0);
    assert!(warned.stderr.contains("warning: --wear: only ball joints have a wear map, not J (cylindrical)"));
    let rows = fs::read_to_string(folder.path().join("worn.csv")).unwrap();
    assert!(rows.lines().skip(1).all(|row| row.starts_with("1,")) && rows.lines().count() > 100, "{rows}");
    // In the dead centre the play of the crank's pin is that of the slider.
    let map = jointplay(folder.path(), "map crank.toml --over crank.angle=0deg..10deg:2").expect(0).stdout;
    assert!(map.contains("crank.angle = 0 deg          0.5 mm") && map.contains("J (100 %)"), "{map}");
}

#[test]
fn errors_of_a_pin_say_joint_and_play() {
    let folder = folder();
    let far = THROWN.replace("offset = \"0.02 0.03 -0.01 mm\"", "offset = \"0 0.5 0 mm\"");
    fs::write(folder.path().join("own.toml"), &far).unwrap();
    let error = jointplay(folder.path(), "check own.toml").expect(2).stderr;
    assert!(error.contains("joint J: as given it is 0.5") && error.contains("its play 0.1 mm"), "{error}");
    // Along the axis its axial play counts, not the radial one.
    for (axial, offset, code) in [("0.5 mm", "0.45 0 0 mm", 0), ("0.2 mm", "0.45 0 0 mm", 2)] {
        let text = THROWN.replace("axial = \"0.2 mm\"", &format!("axial = \"{axial}\""));
        let text = text.replace("offset = \"0.02 0.03 -0.01 mm\"", &format!("offset = \"{offset}\""));
        fs::write(folder.path().join("own.toml"), &text).unwrap();
        jointplay(folder.path(), "check own.toml").expect(code);
    }
    let stopped = "run own.toml --duration 10ms --set solver.method=rk4 --set solver.step=1ms";
    fs::write(folder.path().join("own.toml"), THROWN).unwrap();
    let error = jointplay(folder.path(), stopped).expect(4).stderr;
    assert!(error.contains("joint J.") && error.contains("inside its wall"), "{error}");
    assert!(!error.contains("ball") && !error.contains("socket"), "{error}");
}

#[cfg(feature = "gui")]
#[test]
fn a_close_up_names_the_joints_there_are() {
    let folder = folder();
    fs::write(folder.path().join("own.toml"), THROWN).unwrap();
    let error = jointplay(folder.path(), "render own.toml --close-up X --at 0 --out pictures").expect(2).stderr;
    assert!(error.contains("--close-up X: no such joint with play; there are J"), "{error}");
}
