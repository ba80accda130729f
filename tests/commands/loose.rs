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
fn wear_maps_name_the_sites_and_add_up_to_the_ledger() {
    let folder = folder();
    fs::write(folder.path().join("thrown.toml"), THROWN).unwrap();
    fs::write(folder.path().join("crank.toml"), CRANK).unwrap();
    fs::write(folder.path().join("block.toml"), BLOCK).unwrap();
    let faces = "--set joint.J.play.face_radius=13mm";
    // Cells of each site, in the order of the joint's names; those divided by azimuth.
    let cases = [
        ("thrown.toml", "5ms", "J", vec![72, 72, 1, 1], 144),
        (&format!("thrown.toml {faces}"), "5ms", "J", vec![72, 72, 4, 4], 152),
        ("block.toml", "200ms", "J", vec![1; 4], 0),
    ];
    for (scene, duration, name, cells, divided) in cases {
        let line = format!("run {scene} --duration {duration} --wear worn.json --summary json --force");
        let outcome = jointplay(folder.path(), &line).expect(0);
        assert!(!outcome.stderr.contains("wear"), "{}", outcome.stderr);
        let summary: Json = serde_json::from_str(&outcome.stdout).unwrap();
        let worn: Json = serde_json::from_str(&fs::read_to_string(folder.path().join("worn.json")).unwrap()).unwrap();
        let column = |name: &str| worn["columns"][name].as_array().expect(name).clone();
        let sum = |name: &str| column(name).iter().map(|value| value.as_f64().unwrap()).sum::<f64>();
        let site = column("site");
        let found = (0..cells.len()).map(|place| site.iter().filter(|own| own.as_f64() == Some(place as f64)).count());
        assert_eq!(found.collect::<Vec<_>>(), cells, "{scene}");
        assert_eq!(column("azimuth_from_rad").iter().filter(|edge| !edge.is_null()).count(), divided, "{scene}");
        assert!(column("polar_from_rad").iter().all(Json::is_null), "{scene}");
        let names = worn["meta"]["sites"][0].as_array().unwrap();
        assert!(
            names.len() == cells.len()
                && names.iter().all(|site| site.as_str().unwrap().starts_with(&format!("{name}.")))
        );
        assert_eq!(sum("contacts"), summary["impacts"][name].as_f64().unwrap(), "{scene}");
        let (work, loss) = (sum("friction_work_J"), summary["energy_J"]["friction_loss"].as_f64().unwrap());
        assert!(sum("impulse_N_s") > 0.0 && (work - loss).abs() <= 1e-9 * loss, "{scene}: {work} {loss}");
    }
}

#[test]
fn all_kinds_have_reachable_sets() {
    let folder = folder();
    fs::write(folder.path().join("crank.toml"), CRANK).unwrap();
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
