//! Share links on the command line: the run of a window, repeated.
#![cfg(feature = "gui")]

use jointplay::app::{Link, Player, SceneText};
use jointplay::scene::Scene;

use crate::program::{folder, jointplay};

/// A link to a run in which a parameter was changed twice, and the state hash at its end.
fn link() -> (String, u64) {
    let scene = Scene::load("slider-crank", &[("contact.friction".to_owned(), "0.1".to_owned())]).expect("built in");
    let mut player = Player::new(&scene).expect("starts");
    player.run_to(0.02);
    player.set("contact.clearance", "0.5 mm").expect("allowed");
    player.run_to(0.03);
    player.set_original("contact.clearance").expect("allowed");
    player.run_to(0.041);
    let hash = player.simulation().state_hash();
    let link = Link {
        scene: SceneText::of(player.pending()),
        log: player.log(),
        steps: Some(player.steps()),
        time: Some(player.pacer.shown()),
        hash: Some(hash),
        ..Link::default()
    };
    (link.format(), hash)
}

#[test]
fn run_replays_a_link_to_the_same_bits_and_reports_differences() {
    let (link, hash) = link();
    let folder = folder();
    let run = |line: &str| jointplay(folder.path(), line);
    let summary = run(&format!("run --link {link} --summary json")).expect(0).json();
    assert_eq!(summary["state_hash"], format!("{hash:016x}"));
    assert_eq!(summary["agrees_with_link"], true);
    let page = format!("https://example.org/lab/#{link}");
    let text = run(&format!("run --link {page}")).expect(0).stdout;
    assert!(text.contains("agrees"), "{text}");
    // Continues to a later time on request.
    let longer = run(&format!("run --link {link} --duration 50ms --summary json")).expect(0).json();
    assert_eq!(longer["time_s"], 0.05);
    assert_ne!(longer["state_hash"], summary["state_hash"]);
    // A different state is a failure.
    let wrong = link.replace(&format!("hash={hash:016x}"), "hash=0123456789abcdef");
    let differs = run(&format!("run --link {wrong}")).expect(5);
    assert!(differs.stderr.contains("the link says 0123456789abcdef"));
    // `check` reads the scene with the initial parameters of the run.
    let checked = run(&format!("check --link {link}")).expect(0).stdout;
    assert!(checked.contains("changed: contact.friction = 0.1"), "{checked}");
    for (line, words) in [
        ("run --link ?scene=pendulum", "no instant"),
        ("run --link ?scene=pendulun --duration 1ms", "did you mean `pendulum`"),
        ("run --link ?scene=spcmm&contact.friction_velocity=printed --duration 1ms", "is gone: use centres"),
        ("run pendulum --link ?c=1mm --duration 1ms", "cannot be used with"),
    ] {
        let outcome = run(line).expect(2);
        assert!(outcome.stderr.contains(words), "{line}: {}", outcome.stderr);
    }
}
