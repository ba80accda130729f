use super::*;
use crate::scene::LiveScene;
use crate::simulate::Quantity;

fn player(scene: &str) -> Player {
    let scene = Scene::load(scene, &[]).expect("built in");
    Player::new(&scene).expect("starts")
}

fn recorded(player: &Player, quantity: Quantity, to: f64) -> Vec<[f64; 2]> {
    let list = player.channels().list();
    let channel = list.iter().position(|c| c.quantity == quantity).expect("recorded");
    let mut bins = Vec::new();
    player.history().bins(channel, 0.0, to, 400, &mut bins);
    let points = bins.iter().map(|b| [0.5 * (b.from + b.to), b.greatest]);
    points.collect()
}

#[test]
fn the_record_holds_the_peak_of_an_impact_between_steps() {
    let mut player = player("spcmm");
    player.run_to(9e-3);
    player.advance(0.0);
    let points = recorded(&player, Quantity::NormalForce, 9e-3);
    let peak = points.iter().map(|p| p[1]).fold(0.0, f64::max);
    // Peak of the first impact of S1 (`tests/physics/reference.rs`); the live tolerance is coarser than the reference's.
    assert!((peak - 621.35).abs() < 0.005 * 621.35, "{peak}");
}

#[test]
fn the_record_of_a_joint_that_touches_at_two_places_is_the_sum_of_both() {
    // At rest each corner carries half of the weight.
    let mut player = player("belt");
    player.run_to(0.6);
    player.advance(0.0);
    let channel = player.channels().list().iter().position(|c| c.quantity == Quantity::NormalForce).expect("recorded");
    let mut bins = Vec::new();
    player.history().bins(channel, 0.4, 0.6, 400, &mut bins);
    assert!(bins.len() > 50 && bins.iter().all(|bin| bin.least > 9.7), "{bins:?}");
}

#[test]
fn a_long_step_is_recorded_as_a_curve() {
    // Free fall: half an acceleration times time squared, in steps of milliseconds.
    let mut player = player("spcmm");
    player.run_to(7e-3);
    let points = recorded(&player, Quantity::Eccentricity, 7e-3);
    assert!(points.len() > 15, "{}", points.len());
    let last = points[points.len() - 1];
    for point in points {
        let fall = last[1] * (point[0] / last[0]).powi(2);
        assert!((point[1] - fall).abs() < 0.03 * last[1], "{point:?}: {fall}");
    }
}

/// Checks that frame, record, peaks and sections are at the displayed instant, however far the run has been computed.
fn assert_at_displayed_instant(player: &Player) {
    let shown = player.pacer.shown();
    assert_eq!(player.frame().time, shown);
    let (_, end) = player.history().span().expect("recorded");
    assert_eq!(end, player.reached());
    assert!(shown == end || (player.has_future() && shown < end));
    assert!(player.peaks().iter().all(|peak| peak.time <= shown));
    assert!(player.watch().orbit().all(|(time, _)| *time <= shown));
    assert!(player.watch().sections().all(|(time, _)| *time <= shown));
    assert!(player.simulation().time() >= shown);
}

#[test]
fn record_and_peaks_contain_nothing_after_the_displayed_instant() {
    let mut player = player("spcmm");
    assert_at_displayed_instant(&player);
    player.pacer.set_scale(0.01);
    player.set_playing(true);
    let mut frames_within_steps = 0;
    for frame in 0..150 {
        player.advance(1.0 / 60.0);
        assert_at_displayed_instant(&player);
        let far = player.simulation().time() - player.pacer.shown();
        frames_within_steps += usize::from(far > 1e-4);
        if frame == 60 {
            player.set_playing(false);
            player.advance(1.0 / 60.0);
            assert_at_displayed_instant(&player);
            player.set_playing(true);
        }
    }
    assert!(frames_within_steps > 20, "in the middle of long steps: {frames_within_steps}");
    // Strictly after the peak of the second impact: the record contains the peak, and its last value is the displayed one.
    let forces = recorded(&player, Quantity::NormalForce, 1.0);
    let peak = player.simulation().statistics().joints[0].peak_normal;
    let top = forces.iter().map(|p| p[1]).fold(0.0, f64::max);
    assert!((top / peak - 1.0).abs() < 1e-6, "{top} {peak}");
    for back in 0..6 {
        player.single_step();
        assert_at_displayed_instant(&player);
        if back > 2 {
            player.step_back();
            assert_at_displayed_instant(&player);
        }
    }
    player.run_to(0.2);
    assert_at_displayed_instant(&player);
    player.reset().expect("starts");
    assert_at_displayed_instant(&player);
    assert!(player.peaks().iter().all(|peak| *peak == Peak::default()));
    assert_eq!(player.history().rows(9).len(), 1);
}

#[test]
fn a_warning_is_found_by_the_key_of_its_parameter() {
    let check = |changes: &[(&str, &str)], key: &str, of_joint: Option<&str>| {
        let mut player = player("spcmm");
        assert!(player.warnings().next().is_none());
        for (key, value) in changes {
            player.set(key, value).expect("in range");
        }
        for key in [Some(key), of_joint].into_iter().flatten() {
            let warning = player.warning(key).unwrap_or_else(|| panic!("no warning about {key}"));
            assert!(warning.text.contains(key.rsplit('.').next().unwrap_or(key)), "{key}: {}", warning.text);
        }
        for unaffected in ["contact.friction", "gravity.x", "solver.preset"] {
            assert_eq!(player.warning(unaffected), None, "{key}");
        }
    };
    check(&[("contact.restitution", "0.3")], "contact.restitution", Some("joint.S2.restitution"));
    check(&[("joint.S2.clearance", "0.01 mm")], "contact.clearance", Some("joint.S2.clearance"));
    let slow = [("contact.slip_speed_low", "0.1 um/s"), ("contact.slip_speed_high", "0.5 um/s")];
    check(&slow, "contact.slip_speed_high", Some("joint.S1.slip_speed_high"));
    check(&[("solver.method", "rk4"), ("solver.step", "50 us")], "solver.step", None);
    check(&[("solver.tolerance", "1e-2")], "solver.tolerance", None);
}

thread_local! {
    static CLOCK_READING: std::cell::Cell<f64> = const { std::cell::Cell::new(0.0) };
}

#[test]
fn steps_between_frames_are_displayed_at_once_and_change_no_bit() {
    let mut player = player("spcmm");
    // Each clock reading adds half a millisecond, so that a slice between frames has several steps.
    player.clock = || CLOCK_READING.replace(CLOCK_READING.get() + 5e-4);
    player.pacer.set_scale(0.02);
    player.set_playing(true);
    let (mut impacts, mut between, mut longest) = (0, 0, 0);
    for frame in 0..40 {
        player.advance(0.06);
        assert_at_displayed_instant(&player);
        impacts += player.peaks().iter().map(|peak| peak.impacts).sum::<u32>();
        for slice in 1..=5 {
            let (steps, shown) = (player.steps(), player.pacer.shown());
            player.step_between(0.01 * f64::from(slice));
            assert!(player.pacer.shown() >= shown);
            assert_at_displayed_instant(&player);
            between += player.steps() - steps;
            longest = longest.max(player.steps() - steps);
        }
        if frame == 20 {
            // A script of the page may pause between frames.
            player.set_playing(false);
            let (hash, shown) = (player.simulation().state_hash(), player.pacer.shown());
            assert_eq!(player.step_between(0.05), None);
            player.advance(0.06);
            assert_at_displayed_instant(&player);
            assert_eq!((hash, shown), (player.simulation().state_hash(), player.pacer.shown()));
            player.set_playing(true);
        }
    }
    player.advance(0.0);
    impacts += player.peaks().iter().map(|peak| peak.impacts).sum::<u32>();
    assert!(between > player.steps() / 2, "{between} of {}", player.steps());
    assert!(longest <= 17, "a slice of 8 ms: {longest}");
    let mut other = self::player("spcmm");
    other.run_to(player.pacer.shown());
    assert_eq!((other.steps(), other.simulation().state_hash()), (player.steps(), player.simulation().state_hash()));
    let top =
        |player: &Player| recorded(player, Quantity::NormalForce, 1.0).iter().map(|point| point[1]).fold(0.0, f64::max);
    assert_eq!(top(&player), top(&other));
    other.advance(0.0);
    assert_eq!(impacts, other.peaks().iter().map(|peak| peak.impacts).sum::<u32>());
    assert!(impacts > 3, "{impacts}");
}

#[test]
fn after_steps_back_the_record_is_unchanged_and_a_new_future_continues_it() {
    let mut player = player("spcmm");
    player.run_to(8.6e-3);
    player.single_step();
    let rows = player.history().rows(200);
    for _ in 0..40 {
        player.single_step();
    }
    assert!(player.history().rows(200) != rows);
    let (all, former_end) = (player.history().rows(200), player.pacer.shown());
    for _ in 0..40 {
        player.step_back();
    }
    // The future is still known, and a refused value does not discard it.
    assert!(player.history().rows(200) == all);
    assert!(player.set("contact.friction", "-1").is_err());
    assert!(player.has_future() && player.abandoned_future().is_none());
    // A change keeps the past, and the former future is stored separately.
    player.set("contact.friction", "0.3").expect("in range");
    let former = player.abandoned_future().expect("a former future");
    assert_eq!((former.from, former.to), (player.pacer.shown(), former_end));
    assert!(former.history.rows(200) == all);
    let again = player.history().rows(200);
    assert_eq!(again.last().map(|row| row.0), rows.last().map(|row| row.0));
    assert_at_displayed_instant(&player);
    player.run_to(12e-3);
    assert!(player.abandoned_future().is_none(), "replaced");
    assert_at_displayed_instant(&player);
    let forces = recorded(&player, Quantity::NormalForce, 8.6e-3);
    assert!(forces.iter().any(|point| point[1] > 300.0));
}

#[test]
fn a_new_branch_keeps_the_record_of_the_step_before_an_earlier_change() {
    let mut player = player("spcmm");
    // Free fall in long steps, each of which is recorded as a curve.
    while player.pacer.shown() < 4e-3 {
        player.single_step();
    }
    let change = player.pacer.shown();
    player.set("contact.friction", "0.2").expect("in range");
    for _ in 0..4 {
        player.single_step();
    }
    let before = recorded(&player, Quantity::Eccentricity, change);
    player.step_back();
    player.set("contact.friction", "0.3").expect("in range");
    assert!(recorded(&player, Quantity::Eccentricity, change) == before);
}

#[test]
fn a_change_within_a_step_leaves_the_rest_of_that_step_unchanged() {
    let (mut player, mut other) = (player("spcmm"), player("spcmm"));
    for player in [&mut player, &mut other] {
        player.pacer.set_scale(0.005);
        player.set_playing(true);
        while player.simulation().time() < 2e-3 + player.pacer.shown() {
            player.advance(1.0 / 60.0);
        }
    }
    let change = player.simulation().time();
    player.set("contact.clearance", "0.6 mm").expect("in range");
    assert_at_displayed_instant(&player);
    // The run continues as if it had been changed directly at that instant.
    let mut uninterrupted = LiveScene::new(other.running()).expect("starts");
    uninterrupted.restore(&other.simulation().snapshot());
    uninterrupted.set("contact.clearance", "0.6 mm").expect("in range");
    assert_eq!(player.simulation().state_hash(), uninterrupted.state_hash());
    let mut frames = 0;
    loop {
        player.advance(1.0 / 60.0);
        other.advance(1.0 / 60.0);
        assert_at_displayed_instant(&player);
        if player.pacer.shown() >= change {
            break;
        }
        frames += 1;
        assert_eq!(player.frame().pose, other.frame().pose);
        assert_eq!(player.frame().joints, other.frame().joints);
    }
    assert!(frames > 5, "{frames}");
    assert_eq!(player.frame().joints[0].clearance, 0.6e-3);
    let mut clearances = Vec::new();
    let channel = player.clearances().start;
    player.history().bins(channel, 0.0, 1.0, 400, &mut clearances);
    let (first, last) = (clearances[0], clearances[clearances.len() - 1]);
    assert!((first.greatest - 0.3e-3).abs() < 1e-9 && (last.greatest - 0.6e-3).abs() < 1e-9);
}

#[test]
fn a_window_hidden_for_minutes_resumes_without_catching_up() {
    let mut player = player("spcmm");
    player.pacer.set_scale(0.02);
    player.set_playing(true);
    for _ in 0..30 {
        player.advance(1.0 / 60.0);
    }
    let (before, steps) = (player.pacer.shown(), player.steps());
    // Ten minutes at 1:50 would be 12 s of simulated time.
    player.advance(600.0);
    let leap = player.pacer.shown() - before;
    assert!(leap <= 0.02 * crate::session::pace::LONGEST_FRAME + 1e-12, "{leap}");
    assert!(player.steps() - steps < 20_000);
    let before = player.pacer.shown();
    for _ in 0..30 {
        player.advance(1.0 / 60.0);
    }
    let passed = player.pacer.shown() - before;
    assert!(passed <= 0.01 + 1e-9, "no backlog: {passed}");
    assert!(player.is_playing());
}

#[test]
fn the_record_follows_a_new_number_of_links_after_the_reset() {
    let mut player = player("chain");
    let before = player.channels().len();
    assert_eq!(player.set("chain.links", "3").expect("in range"), Effect::AtReset);
    assert!(player.is_pending("chain.links") && player.has_pending_changes());
    assert_eq!(player.channels().len(), before);
    player.reset().expect("starts");
    assert!(!player.has_pending_changes());
    assert!(player.channels().len() < before);
    player.run_to(0.01);
    assert!(!recorded(&player, Quantity::NormalForce, 0.01).is_empty());
}

/// Record of the channel picked as `name`: time and greatest value of each bin.
fn picked(player: &Player, name: &str, to: f64) -> Vec<[f64; 2]> {
    let mut channels = player.channels().picked().iter();
    let index = channels.position(|c| c.name == name).expect("picked");
    let mut bins = Vec::new();
    let channel = player.picked().start + index;
    player.history().bins(channel, 0.0, to, 400, &mut bins);
    let points = bins.iter().map(|b| [0.5 * (b.from + b.to), b.greatest]);
    points.collect()
}

fn names(names: &[&str]) -> Vec<String> {
    names.iter().map(|&name| name.to_owned()).collect()
}

#[test]
fn a_picked_channel_is_recorded_from_the_pick_on_and_changes_no_bit() {
    let [mut player, mut uninterrupted] = [0; 2].map(|_| self::player("slider-crank-driven"));
    for player in [&mut player, &mut uninterrupted] {
        player.run_to(8e-3);
    }
    let before = recorded(&player, Quantity::Position, 8e-3);
    player.pick(&names(&["crank.reaction", "crank.angle"]));
    let listed: Vec<&str> = player.channels().picked().iter().map(|c| &*c.name).collect();
    assert_eq!(listed, ["crank.angle", "crank.reaction.x", "crank.reaction.y", "crank.reaction.z"]);
    assert!(recorded(&player, Quantity::Position, 8e-3) == before);
    // The record starts at the displayed instant.
    let first = picked(&player, "crank.angle", 1.0);
    assert!(first.len() == 1 && first[0][0] > 7.9e-3, "{first:?}");
    for player in [&mut player, &mut uninterrupted] {
        player.run_to(16e-3);
        player.advance(0.0);
    }
    assert_eq!(player.simulation().state_hash(), uninterrupted.simulation().state_hash());
    let end = player.history().span().expect("recorded").1;
    let angle = picked(&player, "crank.angle", end);
    assert!(angle.len() > 5 && angle[0][0] > 7.9e-3);
    let now = player.frame().coordinates[0][0];
    assert!((angle[angle.len() - 1][1] - now).abs() < 1e-2);
    let weight = picked(&player, "crank.reaction.z", end);
    assert!(weight.iter().all(|point| point[1] != 0.0 && point[1].is_finite()));
    // A channel that stays picked keeps its past; one no longer picked is dropped.
    player.pick(&names(&["crank.angle", "rod.pose.x"]));
    assert!(picked(&player, "crank.angle", end) == angle);
    assert_eq!(player.picked().len(), 2);
    let position = |player: &Player| recorded(player, Quantity::Position, end);
    assert!(position(&player) == position(&uninterrupted));
}

#[test]
fn picked_channels_rewind_and_branch_with_the_record() {
    let mut player = player("slider-crank-driven");
    player.run_to(4e-3);
    player.pick(&names(&["crank.angle"]));
    player.run_to(20e-3);
    let reached = player.reached();
    let all = picked(&player, "crank.angle", reached);
    player.go_to(10e-3);
    assert_at_displayed_instant(&player);
    // Retracing the time before the pick records the channel there, too.
    player.go_to(2e-3);
    let mut bins = Vec::new();
    player.bins(player.picked().start, 0.0, 2e-3, 400, &mut bins);
    assert!(!bins.is_empty());
    player.go_to(10e-3);
    player.set("contact.friction", "0.3").expect("in range");
    let truncated = picked(&player, "crank.angle", 1.0);
    assert!(truncated.iter().all(|point| point[0] < 10.1e-3));
    player.run_to(20e-3);
    let new_branch = picked(&player, "crank.angle", player.reached());
    assert!((new_branch[new_branch.len() - 1][1] - all[all.len() - 1][1]).abs() < 2e-2);
    player.reset().expect("starts");
    player.run_to(5e-3);
    assert!(picked(&player, "crank.angle", 5e-3)[0][0] < 1e-3);
}

#[test]
fn the_number_of_recorded_picked_channels_is_limited() {
    let mut player = player("chain");
    let before = player.history().channels();
    player.pick(&names(&["*"]));
    let most = crate::simulate::MAX_PICKED;
    assert_eq!(player.channels().picked().len(), most);
    assert_eq!(player.history().channels(), before + most);
    assert_eq!(player.clearances().len(), 8);
    player.pick(&names(&["no.such.channel"]));
    assert_eq!((player.picked().len(), player.history().channels()), (0, before));
    player.run_to(1e-3);
}

#[test]
fn stepping_back_restores_every_single_step_bit_by_bit() {
    let mut player = player("spcmm");
    player.step_back();
    player.run_to(8e-3);
    let mut hashes = Vec::new();
    for _ in 0..300 {
        hashes.push(player.simulation().state_hash());
        player.single_step();
    }
    let end = player.simulation().state_hash();
    for hash in hashes.iter().rev() {
        player.step_back();
        assert_eq!(player.simulation().state_hash(), *hash);
    }
    for _ in &hashes {
        player.single_step();
    }
    assert_eq!(player.simulation().state_hash(), end);
    // A change is not a step: stepping back undoes the step before it, and the change stays ahead in the log.
    let before = *hashes.last().expect("steps");
    player.set("contact.friction", "0.3").expect("in range");
    player.step_back();
    assert_eq!(player.simulation().state_hash(), before);
    assert_eq!(player.pending().machine.contact.friction, FRICTION);
    player.go_to(player.reached());
    assert_eq!(player.pending().machine.contact.friction, 0.3);
}

/// Friction coefficient in the scene file of the paper's mechanism.
const FRICTION: f64 = 0.15;

/// Uniform in [0, 1): a linear congruential generator.
struct Uniform(u64);

impl Uniform {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Runs to `to`, s, with `changes` at their times. Returns time and state hash after every step without a change.
fn run_with(player: &mut Player, changes: &[(f64, &str, &str)], to: f64) -> Vec<(f64, u64)> {
    let mut hashes = Vec::new();
    let mut changes = changes.iter().peekable();
    while player.pacer.shown() < to {
        player.single_step();
        let now = player.pacer.shown();
        if let Some((_, key, value)) = changes.next_if(|change| change.0 <= now) {
            player.set(key, value).expect("in range");
        } else {
            hashes.push((now, player.simulation().state_hash()));
        }
    }
    hashes
}

const CHANGES: [(f64, &str, &str); 4] = [
    (0.05, "contact.clearance", "0.5 mm"),
    (0.12, "contact.friction", "0.2"),
    (0.2, "contact.clearance", "0.1 mm"),
    (0.21, "solver.method", "radau5"),
];

#[test]
fn any_past_instant_is_displayed_with_the_same_bits_again() {
    for (scene, to) in [("spcmm", 0.3), ("slider-crank", 0.25), ("chain", 0.22)] {
        let mut player = player(scene);
        let hashes = run_with(&mut player, &CHANGES, to);
        let end = player.simulation().state_hash();
        let rows = player.history().rows(300);
        let mut random = Uniform(7);
        for _ in 0..30 {
            let (time, hash) = hashes[(random.next() * hashes.len() as f64) as usize];
            player.go_to(time);
            assert_eq!(player.simulation().state_hash(), hash, "{scene} at {time}");
            assert_at_displayed_instant(&player);
            // Between two steps the display is consistent, too.
            player.go_to(time + 1e-7);
            assert_at_displayed_instant(&player);
        }
        assert!(player.history().rows(300) == rows, "the record stays");
        player.go_to(player.reached());
        assert_eq!(player.simulation().state_hash(), end, "{scene}");
        assert_eq!(player.log().entries.len(), CHANGES.len());
    }
}

#[test]
#[ignore = "full: ten seconds"]
fn full_a_thousand_jumps_over_a_thousand_impacts_have_the_bits_of_the_run() {
    // Balls that lose almost no energy keep rattling.
    let changes = [("contact.restitution", "1"), ("contact.friction", "0")];
    let owned = |(key, value): (&str, &str)| (key.to_owned(), value.to_owned());
    let scene = Scene::load("spcmm", &changes.map(owned)).expect("in range");
    let mut player = Player::new(&scene).expect("starts");
    let mut hashes = Vec::new();
    let impacts = |player: &Player| {
        let of = |joint| player.contact_history().touches(joint, 0.0, f64::INFINITY).count();
        (0..3).map(of).sum::<usize>()
    };
    while impacts(&player) < 1000 {
        let to = player.pacer.shown() + 0.05;
        hashes.extend(run_with(&mut player, &[], to));
        assert!(to < 10.0, "{} impacts", impacts(&player));
    }
    let end = player.simulation().state_hash();
    let mut random = Uniform(11);
    for _ in 0..1000 {
        let (time, hash) = hashes[(random.next() * hashes.len() as f64) as usize];
        player.go_to(time);
        assert_eq!(player.simulation().state_hash(), hash, "at {time}");
    }
    player.go_to(player.reached());
    assert_eq!(player.simulation().state_hash(), end);
}

#[test]
fn the_twin_follows_the_run_back_and_forward() {
    let mut player = player("spcmm");
    player.run_to(10e-3);
    player.set_twin(true);
    let mut seen = Vec::new();
    for frame in 0..60 {
        if frame == 30 {
            player.set("contact.friction", "0").expect("in range");
        }
        player.run_to(10e-3 + 2e-3 * f64::from(frame));
        let twin = player.twin().expect("on");
        seen.push((player.pacer.shown(), twin.frame().clone()));
    }
    let distances = player.twin().expect("on").distances().to_vec();
    let twin_start = player.twin().expect("on").start_time();
    let mut random = Uniform(5);
    for _ in 0..100 {
        let (time, frame) = &seen[(random.next() * seen.len() as f64) as usize];
        player.go_to(*time);
        let twin = player.twin().expect("stays on");
        if *time < twin_start {
            assert!(twin.frame().time > *time, "the twin starts later");
        } else if *time > twin_start {
            assert_eq!(twin.frame().bodies, frame.bodies, "at {time}");
        }
        assert_eq!(twin.distances(), distances, "known distances are unchanged");
    }
    // On a new branch, the twin of the abandoned future is dropped.
    player.go_to(seen[10].0);
    player.set("contact.friction", "0.3").expect("in range");
    let twin = player.twin().expect("stays on");
    assert_eq!(twin.start_time(), player.simulation().time());
    assert_eq!(twin.distances().len(), 1);
}

#[test]
#[ignore = "half a minute: `cargo test --release --lib -- --ignored ten_minutes`"]
fn ten_minutes_stay_within_reach() {
    let mut player = player("spcmm");
    player.run_to(600.0);
    let bytes = player.rewind_bytes();
    let (mut random, mut longest, clock) = (Uniform(3), 0.0_f64, player.clock);
    for _ in 0..300 {
        let start = clock();
        player.go_to(600.0 * random.next());
        longest = longest.max(clock() - start);
    }
    println!("{} steps, {bytes} bytes, longest jump {longest:.4} s", player.steps());
    assert!(bytes < 64 << 20);
}

/// Resident memory of this process, bytes.
#[cfg(target_os = "linux")]
fn resident() -> usize {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux has it");
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let size = line.and_then(|line| line.trim().strip_suffix(" kB"));
    1024 * size.expect("in kB").parse::<usize>().expect("a number")
}

#[test]
#[cfg(target_os = "linux")]
#[ignore = "minutes: `cargo test --lib -- --ignored an_hour --nocapture`"]
fn an_hour_takes_no_more_memory_than_ten_minutes() {
    let mut player = player("spcmm");
    player.set_ideal(true);
    let mut bytes_held = Vec::new();
    for part in 1..=6 {
        player.run_to(600.0 * f64::from(part));
        bytes_held.push((resident(), player.rewind_bytes()));
        println!("{} s: {:?} bytes", 600 * part, bytes_held[bytes_held.len() - 1]);
    }
    assert!(bytes_held[5].0 < bytes_held[0].0 + (32 << 20), "{bytes_held:?}");
}

#[test]
fn the_distant_past_is_displayed_in_full_detail_again() {
    let mut player = player("spcmm");
    player.run_to(9e-3);
    let fine = recorded(&player, Quantity::NormalForce, 9e-3);
    let peak = fine.iter().map(|p| p[1]).fold(0.0, f64::max);
    player.run_to(3.0);
    let bins = |player: &Player| {
        let mut bins = Vec::new();
        let channel = player.channels().normal_force(0).expect("recorded");
        player.bins(channel, 7.6e-3, 8.2e-3, 400, &mut bins);
        bins
    };
    assert!(bins(&player).len() < 5, "only wide bins remain");
    player.go_to(8e-3);
    let again = bins(&player);
    assert!(again.len() >= 20, "{}", again.len());
    assert!(again.windows(2).all(|pair| pair[0].to <= pair[1].from));
    let top = again.iter().map(|bin| bin.greatest).fold(0.0, f64::max);
    assert!(top > 0.0 && top <= peak * (1.0 + 1e-6), "{top} {peak}");
}

#[test]
fn playing_backwards_passes_the_same_states_to_the_start() {
    let mut player = player("spcmm");
    player.run_to(20e-3);
    player.pacer.set_scale(0.02);
    player.play_backwards();
    let mut before = player.pacer.shown();
    let mut frames = 0;
    while player.is_playing() {
        player.advance(1.0 / 60.0);
        let shown = player.pacer.shown();
        let expected = (before - 0.02 / 60.0).max(0.0);
        assert!((shown - expected).abs() < 1e-12, "{shown} {expected}");
        assert_at_displayed_instant(&player);
        before = shown;
        frames += 1;
    }
    assert!((59..=61).contains(&frames), "{frames}");
    assert_eq!(player.simulation().time(), 0.0);
    let start = self::player("spcmm");
    assert_eq!(player.simulation().state_hash(), start.simulation().state_hash());
    // And forwards again through the same states.
    player.go_to(20e-3);
    let mut uninterrupted = self::player("spcmm");
    uninterrupted.run_to(20e-3);
    assert_eq!(player.simulation().state_hash(), uninterrupted.simulation().state_hash());
}

#[test]
fn resuming_from_the_past_abandons_later_changes() {
    let mut player = player("spcmm");
    let _ = run_with(&mut player, &CHANGES[..2], 0.15);
    assert_eq!(player.flags().count(), 2);
    player.go_to(0.08);
    assert_eq!(player.pending().machine.contact.friction, FRICTION);
    assert_eq!(player.log().entries.len(), 1, "the link contains the changes up to here");
    player.set_playing(true);
    let former = player.abandoned_future().expect("a former future");
    assert_eq!((former.from, former.to), (0.08, 0.15_f64.max(former.to)));
    assert_eq!(former.flags.len(), 1);
    assert_eq!(player.flags().count(), 1);
    player.run_to(0.16);
    let mut uninterrupted = self::player("spcmm");
    let _ = run_with(&mut uninterrupted, &CHANGES[..1], 0.08);
    uninterrupted.run_to(0.16);
    assert_eq!(player.simulation().state_hash(), uninterrupted.simulation().state_hash());
}

/// Joint with play, start and peak time of every impact of an independent run up to `to`, s, sorted by peak time.
fn peaks_of_run(player: &Player, to: f64) -> Vec<(usize, f64, f64)> {
    let mut simulation = Simulation::new(&player.running().machine).expect("starts");
    let (mut peaks, mut steps, mut impacts) = (Vec::new(), Vec::new(), Vec::new());
    while simulation.time() < to {
        simulation.step().expect("runs");
        simulation.take_peaks(&mut peaks);
        steps.extend(peaks.iter().copied().enumerate());
        impacts.extend(simulation.take_impacts());
    }
    let top = |impact: &crate::simulate::Impact| {
        let within =
            |(joint, peak): &&(usize, Peak)| *joint == impact.joint && (impact.start..=impact.end).contains(&peak.time);
        let (_, top) = steps.iter().filter(within).max_by(|a, b| a.1.normal.total_cmp(&b.1.normal)).expect("a force");
        assert_eq!(top.normal, impact.peak);
        (impact.joint, impact.start, top.time)
    };
    let mut impact_peaks: Vec<_> = impacts.iter().map(top).collect();
    impact_peaks.sort_by(|a, b| a.2.total_cmp(&b.2));
    impact_peaks
}

#[test]
fn navigation_to_the_next_or_previous_impact_ends_at_its_peak() {
    let mut player = player("spcmm");
    let impact_peaks = peaks_of_run(&player, 80e-3);
    let end = 60e-3;
    player.run_to(end);
    player.go_to(0.0);
    let reached = player.reached();
    // Later impacts may still be in progress.
    let before: Vec<_> = impact_peaks.iter().filter(|top| top.2 <= reached - 10e-3).collect();
    assert!(before.len() >= 6);
    // The first impact of the paper's mechanism.
    assert!((before[0].2 - 7.86e-3).abs() < 0.05e-3, "{before:?}");
    for (joint, start, time) in &before {
        player.go_to_impact(None, true);
        assert!(!player.is_seeking());
        assert_eq!(player.pacer.shown(), *time);
        assert_at_displayed_instant(&player);
        let (_, impact) = player.impact_record().in_progress(None, *time).expect("an impact");
        assert_eq!((impact.joint, impact.start), (*joint, *start));
        // The displayed force is the peak.
        let force = player.frame().joints[*joint].normal_force.norm();
        assert!((force / impact.force_peak.force.norm() - 1.0).abs() < 1e-3, "{force} at {time}");
    }
    // A future impact is reached by stepping, without displaying the instants between.
    player.go_to(reached);
    player.go_to_impact(None, true);
    assert!(player.is_seeking());
    while player.is_seeking() {
        player.advance(1.0 / 60.0);
    }
    let next = impact_peaks.iter().find(|top| top.2 > reached).expect("another impact");
    assert_eq!(player.pacer.shown(), next.2);
    assert!(!player.is_playing());
    assert_at_displayed_instant(&player);
    player.go_to(before[before.len() - 1].2 + 1e-9);
    for (_, _, time) in before.iter().rev() {
        player.go_to_impact(None, false);
        assert_eq!(player.pacer.shown(), *time);
    }
    player.go_to_impact(None, false);
    assert_eq!(player.pacer.shown(), 0.0);
    player.go_to_impact(Some(1), true);
    let of_one = impact_peaks.iter().find(|top| top.0 == 1).expect("hit");
    assert_eq!(player.pacer.shown(), of_one.2);
}

#[test]
fn an_impact_in_progress_is_continued_to_its_peak() {
    let mut player = player("spcmm");
    let impact_peaks = peaks_of_run(&player, 20e-3);
    let first = impact_peaks[0];
    // Halfway up the rise; the search starts from there and from the start of the run.
    let rising = 0.5 * (first.1 + first.2);
    player.run_to(rising);
    player.go_to_impact(Some(first.0), false);
    assert_eq!(player.pacer.shown(), 0.0, "there is no peak yet");
    for from in [0.0, rising] {
        let mut player = self::player("spcmm");
        player.run_to(rising);
        player.go_to(from);
        player.go_to_impact(Some(first.0), true);
        while player.is_seeking() {
            player.advance(1.0 / 60.0);
        }
        assert_eq!(player.pacer.shown(), first.2);
    }
    // Past the peak, but not past the impact.
    let mut player = self::player("spcmm");
    player.run_to(first.2 + 10e-6);
    player.go_to_impact(Some(first.0), false);
    assert_eq!(player.pacer.shown(), first.2);
    // On a new branch, after a change during the impact.
    player.set("contact.friction", "0.3").expect("in range");
    player.go_to_impact(Some(first.0), true);
    while player.is_seeking() {
        player.advance(1.0 / 60.0);
    }
    let number = player.impact_record().in_progress(Some(first.0), player.pacer.shown()).map(|(number, _)| number);
    let before = impact_peaks.iter().filter(|top| top.2 < player.pacer.shown()).count() as u64;
    assert!(number.is_some_and(|number| number > 1), "{number:?}, {before}");
}

#[test]
fn the_search_for_an_impact_ends_in_a_run_without_further_impacts() {
    let mut player = player("spcmm");
    player.run_to(0.4);
    let latest = player.impact_record().previous_peak(None, 0.4).expect("hit");
    player.go_to_impact(None, true);
    let mut frames = 0;
    while player.is_seeking() {
        player.advance(1.0 / 60.0);
        frames += 1;
        assert!(frames < 20_000);
    }
    let shown = player.pacer.shown();
    assert!(shown >= 5.4 - 1e-9 || player.impact_record().next_peak(None, latest, true).is_some(), "{shown}");
    assert_at_displayed_instant(&player);
    // The balls rest on their walls: their last impacts have no end.
    assert!(player.impact_record().in_progress(None, shown).is_none());
    player.go_to_impact(None, false);
    assert_eq!(player.pacer.shown(), latest);
    let (_, resting) = player.impact_record().in_progress(None, latest).expect("in contact");
    assert!(resting.finished().is_none() && resting.force_peak.time == latest);
}

#[test]
fn the_wear_map_includes_only_completed_steps() {
    let mut player = player("spcmm");
    let wear_map = |player: &Player| player.wear().expect("tracked").clone();
    let contacts = |player: &Player| -> u64 {
        let wear = wear_map(player);
        let cells = (0..3).flat_map(|j| wear.cells(j));
        cells.map(|cell| cell.contacts).sum()
    };
    player.run_to(7e-3);
    player.pacer.set_scale(0.001);
    player.set_playing(true);
    let mut ahead = 0;
    while player.pacer.shown() < 7.9e-3 {
        player.advance(1.0 / 60.0);
        let shown = player.pacer.shown();
        // The first contacts of S1, S2 and S3 (`tests/physics/reference.rs`), within the tolerance of the preset.
        let first_contacts = [7.80142e-3, 7.80768e-3, 7.80781e-3];
        if first_contacts.iter().all(|time: &f64| (time - shown).abs() > 1e-6) {
            let expected = first_contacts.iter().filter(|time| **time < shown).count();
            assert_eq!(contacts(&player), expected as u64, "t = {shown}");
        }
        let computed: u64 = player.simulation().statistics().impacts();
        ahead += usize::from(computed > contacts(&player));
    }
    assert!(ahead > 0, "the run is ahead of the displayed instant");
    player.set_playing(false);
    player.single_step();
    let before = wear_map(&player);
    for _ in 0..30 {
        player.single_step();
    }
    assert!(wear_map(&player) != before);
    for _ in 0..30 {
        player.step_back();
    }
    assert!(wear_map(&player) == before);
    player.reset().expect("starts");
    assert_eq!(contacts(&player), 0);
    let after = wear_map(&player);
    assert!(after.cells(0).iter().all(|cell| cell.impulse == 0.0));
}

#[test]
fn a_preset_chosen_live_replaces_solver_keys_set_by_name() {
    let mut player = player("spcmm");
    player.set("solver.tolerance", "1e-9").expect("in range");
    player.set("solver.preset", "accurate").expect("a preset");
    let tolerance = crate::machine::Preset::Accurate.solver(&player.pending().machine).tolerance;
    assert_eq!(player.pending().machine.solver.tolerance, tolerance);
    assert_eq!(player.running().machine.solver.tolerance, tolerance);
    player.set("solver.tolerance", "1e-9").expect("in range");
    assert_eq!(player.running().machine.solver.tolerance, 1e-9);
    assert_eq!(player.pending().machine.solver.preset, None);
}

#[test]
fn a_rejected_value_changes_nothing() {
    let mut player = player("spcmm");
    let before = player.pending().machine.contact;
    assert!(player.set("contact.clearance", "-1 mm").is_err());
    assert!(player.set("contact.clearence", "1 mm").is_err());
    assert_eq!(player.pending().machine.contact, before);
    player.set("contact.clearance", "0.7 mm").expect("in range");
    player.set_original("contact.clearance").expect("the value of the scene");
    assert_eq!(player.pending().machine.contact, before);
}

#[test]
fn the_duration_of_frames_changes_the_steps_per_frame_and_no_bit() {
    fn slow() -> f64 {
        thread_local! {
            static CLOCK_READING: std::cell::Cell<f64> = const { std::cell::Cell::new(0.0) };
        }
        CLOCK_READING.set(CLOCK_READING.get() + 1e-3);
        CLOCK_READING.get()
    }
    let mut counts = Vec::new();
    for frames in [&[1.0 / 60.0][..], &[0.4], &[0.9, 0.02, 3.0, 0.1, 0.1]] {
        let mut player = player("spcmm");
        player.clock = slow;
        player.pacer.set_scale(1.0);
        player.set_playing(true);
        for dt in frames.iter().cycle().take(12) {
            player.advance(*dt);
        }
        let mut uninterrupted = Simulation::new(&player.running().machine).expect("starts");
        while uninterrupted.statistics().steps < player.steps() {
            uninterrupted.step().expect("runs");
        }
        assert_eq!(player.simulation().state_hash(), uninterrupted.state_hash());
        counts.push(player.steps());
    }
    assert!(counts[1] > 10 * counts[0], "{counts:?}");
}
