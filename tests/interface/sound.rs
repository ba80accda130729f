//! Sound: the clicks that the host receives during playback.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use eframe::egui::{self, Key, accesskit::Role};
use egui_kittest::{
    Harness,
    kittest::{NodeT as _, Queryable as _},
};
use jointplay::app::{App, Click, DroppedFile, Host, MAX_CLICKS, OpenedFile, PITCHES};
use jointplay::contact::ElasticLaw;
use jointplay::simulate::{Impact, Simulation};

use crate::hands::window::{click, shown, sized, window};

/// Records of a host that receives sound.
#[derive(Default)]
struct Recorded {
    on: Cell<bool>,
    clicks: RefCell<Vec<Click>>,
    /// Reason for having no sound device.
    no_device: RefCell<Option<String>>,
}

struct RecordingHost(Rc<Recorded>);

impl Host for RecordingHost {
    fn read_dropped(&mut self, _files: Vec<DroppedFile>) {}

    fn opened(&mut self) -> Option<Vec<OpenedFile>> {
        None
    }

    fn sound(&mut self, on: bool) {
        self.0.on.set(on);
    }

    fn click(&mut self, clicks: &[Click]) {
        assert!(self.0.on.get(), "sound is off");
        self.0.clicks.borrow_mut().extend(clicks);
    }

    fn no_sound(&mut self) -> Option<String> {
        self.0.no_device.borrow_mut().take()
    }
}

fn with_recording_host(scene: &str) -> (Harness<'static, App>, Rc<Recorded>) {
    let mut harness = window(scene);
    let recorded = Rc::new(Recorded::default());
    harness.state_mut().set_host(Box::new(RecordingHost(recorded.clone())));
    (harness, recorded)
}

/// Steps one frame; returns the time span that it showed, and its clicks.
fn frame(harness: &mut Harness<'_, App>, recorded: &Recorded) -> (f64, f64, Vec<Click>) {
    let from = shown(harness);
    harness.step();
    (from, shown(harness), recorded.clicks.take())
}

/// All impacts of a separate run of the scene that end by `time`, s.
fn impacts(harness: &Harness<'_, App>, time: f64) -> Vec<Impact> {
    let mut simulation = Simulation::new(&harness.state().player().running().machine).expect("starts");
    let mut impacts = Vec::new();
    while simulation.time() < time {
        simulation.step().expect("runs");
        impacts.extend(simulation.take_impacts());
    }
    impacts.retain(|impact| impact.end <= time);
    impacts
}

#[test]
fn clicks_during_playback_are_the_impacts_of_the_run_at_any_speed() {
    for (scene, scale, frames) in [("pendulum", 0.02, 240), ("spcmm", 0.005, 240), ("spcmm", 0.05, 90)] {
        let (mut harness, recorded) = with_recording_host(scene);
        harness.key_press(Key::M);
        harness.step();
        assert!(recorded.on.get());
        harness.state_mut().player_mut().pacer.set_scale(scale);
        harness.state_mut().player_mut().set_playing(true);
        let spans: Vec<_> = (0..frames).map(|_| frame(&mut harness, &recorded)).collect();
        let all = impacts(&harness, shown(&harness));
        assert!(all.len() > 5, "{scene}: {} impacts", all.len());
        let machine = &harness.state().player().running().machine;
        let mass: f64 = machine.bodies.iter().map(|body| body.mass).sum();
        let mut checked = 0;
        for (from, to, clicks) in spans {
            let in_span = |impact: &&Impact| from < impact.end && impact.end <= to;
            let ended: Vec<&Impact> = all.iter().filter(in_span).collect();
            assert_eq!(clicks.len(), ended.len().min(MAX_CLICKS), "{scene} at {to} s");
            if ended.len() > MAX_CLICKS {
                continue;
            }
            for (click, impact) in clicks.iter().zip(ended) {
                checked += 1;
                let time = from + click.after * scale;
                assert!((time - impact.end).abs() < 1e-9, "{time} s for {} s", impact.end);
                let pitch = (0.5 / (impact.end - impact.start)).clamp(PITCHES.0, PITCHES.1);
                assert!((click.pitch / pitch - 1.0).abs() < 1e-9);
                // By Hertz, the elastic energy of the impact is 2/5 K d^2.5.
                let stiffness = ElasticLaw::of_joint(&machine.contact, machine.contact.clearance).stiffness;
                let effective_mass = 0.8 * stiffness * impact.deepest.powf(2.5) / impact.approach_speed.powi(2);
                let impulse = effective_mass.min(mass) * (impact.approach_speed + impact.separation_speed);
                let loudness = (impulse / mass / 0.1).powf(0.4).min(1.0);
                assert!((click.loudness - loudness).abs() < 1e-9, "{impact:?}");
            }
        }
        assert!(checked > 5, "{scene}: {checked}");
    }
}

#[test]
fn only_forward_play_with_sound_on_is_audible() {
    let (mut harness, recorded) = with_recording_host("pendulum");
    let assert_silent = |harness: &mut Harness<'_, App>, frames: usize, action: &str| {
        for _ in 0..frames {
            let (_, _, clicks) = frame(harness, &recorded);
            assert!(clicks.is_empty(), "{action}");
        }
    };
    // Sound is off by default.
    harness.state_mut().player_mut().set_playing(true);
    assert_silent(&mut harness, 90, "sound is off");
    assert!(impacts(&harness, shown(&harness)).len() > 3);
    harness.key_press(Key::M);
    harness.step();
    harness.state_mut().player_mut().set_playing(false);
    recorded.clicks.take();
    assert_silent(&mut harness, 5, "paused");
    harness.key_press(Key::J);
    harness.step();
    assert!(harness.state().player().is_playing_backwards());
    assert_silent(&mut harness, 60, "backwards");
    for (key, action) in [
        (Key::End, "a jump to the end"),
        (Key::Home, "a jump to the start"),
        (Key::Period, "a seek to an impact"),
        (Key::ArrowRight, "a step"),
        (Key::End, "a jump to the end"),
        // No impact is recorded ahead, so the run continues to the next one.
        (Key::Period, "a seek to a future impact"),
        (Key::R, "a reset"),
    ] {
        harness.key_press(key);
        assert_silent(&mut harness, 30, action);
    }
    // Replaying a shown part makes its impacts audible again.
    harness.state_mut().player_mut().set_playing(true);
    let replayed: usize = (0..90).map(|_| frame(&mut harness, &recorded).2.len()).sum();
    assert_eq!(replayed, impacts(&harness, shown(&harness)).len());
    harness.key_press(Key::M);
    harness.step();
    recorded.clicks.take();
    assert!(!recorded.on.get());
    assert_silent(&mut harness, 60, "off again");
}

#[test]
fn a_run_has_the_same_bits_with_sound_and_without() {
    let run = |sound: bool| {
        let (mut harness, recorded) = with_recording_host("spcmm");
        harness.state_mut().set_sound(sound);
        harness.state_mut().player_mut().set_playing(true);
        harness.run_steps(90);
        assert_eq!(recorded.clicks.borrow().is_empty(), !sound);
        let player = harness.state().player();
        (player.simulation().state_hash(), player.pacer.shown(), player.steps())
    };
    assert_eq!(run(true), run(false));
}

#[test]
fn sound_has_a_switch_in_the_menu_and_its_own_key() {
    let (mut harness, recorded) = with_recording_host("pendulum");
    let switch = |harness: &mut Harness<'_, App>, change: bool| {
        click(harness, "View options");
        let node = harness.get_by_role_and_label(Role::CheckBox, "Sound");
        let on = node.accesskit_node().toggled() == Some(egui::accesskit::Toggled::True);
        if change {
            node.click();
            harness.run();
        }
        harness.key_press(Key::Escape);
        harness.run();
        on
    };
    assert!(!switch(&mut harness, true));
    assert!(recorded.on.get() && harness.state().is_sounding());
    assert!(switch(&mut harness, false));
    harness.key_press(Key::M);
    harness.run();
    assert!(!switch(&mut harness, false) && !recorded.on.get());
    // The magnification has a different key.
    let magnified = |harness: &Harness<'_, App>| harness.state().link().magnification;
    let before = magnified(&harness);
    harness.key_press(Key::X);
    harness.run();
    assert_ne!(magnified(&harness), before);
    assert!(!harness.state().is_sounding());
}

#[test]
fn without_a_sound_device_the_window_reports_it_and_continues() {
    let (mut harness, recorded) = with_recording_host("pendulum");
    harness.state_mut().player_mut().set_playing(true);
    harness.key_press(Key::M);
    harness.run_steps(3);
    assert!(harness.state().is_sounding());
    // The failure arrives later, as opening a device takes a while.
    recorded.no_device.replace(Some("this machine has no sound device".to_owned()));
    harness.run_steps(90);
    assert!(!harness.state().is_sounding() && !recorded.on.get());
    let words = harness.state().announcement();
    assert!(words.contains("No sound: this machine has no sound device."), "{words}");
    assert!(harness.state().player().is_playing());

    // A window without a host reports it at once.
    let mut harness = sized("pendulum", [1280.0, 800.0], egui::Theme::Light);
    harness.key_press(Key::M);
    harness.run_steps(90);
    assert!(!harness.state().is_sounding());
    let words = harness.state().announcement();
    assert!(words.contains("No sound: "), "{words}");
}
