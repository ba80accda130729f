//! Sound: what the host is asked to sound while the run plays.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use eframe::egui::{self, Key, accesskit::Role};
use egui_kittest::{
    Harness,
    kittest::{NodeT as _, Queryable as _},
};
use jointplay::app::{App, Click, DroppedFile, Host, MAX_CLICKS, OpenedFile, PITCHES};
use jointplay::simulate::{Impact, Simulation};

use crate::window::{click, shown, sized, window};

/// What a host with ears has heard.
#[derive(Default)]
struct Heard {
    on: Cell<bool>,
    clicks: RefCell<Vec<Click>>,
    /// Why it can hear nothing.
    deaf: RefCell<Option<String>>,
}

struct Ears(Rc<Heard>);

impl Host for Ears {
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
        self.0.deaf.borrow_mut().take()
    }
}

fn with_ears(scene: &str) -> (Harness<'static, App>, Rc<Heard>) {
    let mut harness = window(scene);
    let heard = Rc::new(Heard::default());
    harness.state_mut().set_host(Box::new(Ears(heard.clone())));
    (harness, heard)
}

/// One frame; the stretch of the run that it showed, and its clicks.
fn frame(harness: &mut Harness<'_, App>, heard: &Heard) -> (f64, f64, Vec<Click>) {
    let from = shown(harness);
    harness.step();
    (from, shown(harness), heard.clicks.take())
}

/// All impacts of the scene that end up to `time`, s, by a run of its own.
fn impacts(harness: &Harness<'_, App>, time: f64) -> Vec<Impact> {
    let mut simulation = Simulation::new(&harness.state().player().running().machine).expect("starts");
    let mut impacts = Vec::new();
    while simulation.time() < time {
        simulation.step().expect("runs");
        simulation.take_impacts(&mut impacts);
    }
    impacts.retain(|impact| impact.end <= time);
    impacts
}

#[test]
fn while_it_plays_the_clicks_are_the_impacts_of_the_run_at_any_speed() {
    for (scene, scale, frames) in [("pendulum", 0.02, 240), ("spcmm", 0.005, 240), ("spcmm", 0.05, 90)] {
        let (mut harness, heard) = with_ears(scene);
        harness.key_press(Key::M);
        harness.step();
        assert!(heard.on.get());
        harness.state_mut().player_mut().pacer.set_scale(scale);
        harness.state_mut().player_mut().set_playing(true);
        let stretches: Vec<_> = (0..frames).map(|_| frame(&mut harness, &heard)).collect();
        let all = impacts(&harness, shown(&harness));
        assert!(all.len() > 5, "{scene}: {} impacts", all.len());
        let mass: f64 = harness.state().player().running().machine.bodies.iter().map(|body| body.mass).sum();
        let mut told = 0;
        for (from, to, clicks) in stretches {
            let within = |impact: &&Impact| from < impact.end && impact.end <= to;
            let ended: Vec<&Impact> = all.iter().filter(within).collect();
            assert_eq!(clicks.len(), ended.len().min(MAX_CLICKS), "{scene} at {to} s");
            if ended.len() > MAX_CLICKS {
                continue;
            }
            for (click, impact) in clicks.iter().zip(ended) {
                told += 1;
                let time = from + click.after * scale;
                assert!((time - impact.end).abs() < 1e-9, "{time} s for {} s", impact.end);
                let pitch = (0.5 / (impact.end - impact.start)).clamp(PITCHES.0, PITCHES.1);
                assert!((click.pitch / pitch - 1.0).abs() < 1e-9);
                // Two fifths of force times way is the energy of the blow after Hertz.
                let behind = 0.8 * impact.peak * impact.deepest / impact.approach_speed.powi(2);
                let impulse = behind.min(mass) * (impact.approach_speed + impact.separation_speed);
                let loudness = (impulse / mass / 0.1).powf(0.4).min(1.0);
                assert!((click.loudness - loudness).abs() < 1e-9, "{impact:?}");
            }
        }
        assert!(told > 5, "{scene}: {told}");
    }
}

#[test]
fn only_forward_play_with_sound_on_is_audible() {
    let (mut harness, heard) = with_ears("pendulum");
    let silent = |harness: &mut Harness<'_, App>, frames: usize, what: &str| {
        for _ in 0..frames {
            let (_, _, clicks) = frame(harness, &heard);
            assert!(clicks.is_empty(), "{what}");
        }
    };
    // Off at first.
    harness.state_mut().player_mut().set_playing(true);
    silent(&mut harness, 90, "sound is off");
    assert!(impacts(&harness, shown(&harness)).len() > 3);
    harness.key_press(Key::M);
    harness.step();
    harness.state_mut().player_mut().set_playing(false);
    heard.clicks.take();
    silent(&mut harness, 5, "paused");
    harness.key_press(Key::J);
    harness.step();
    assert!(harness.state().player().is_playing_backwards());
    silent(&mut harness, 60, "backwards");
    for (key, what) in [
        (Key::End, "a jump to the end"),
        (Key::Home, "a jump to the start"),
        (Key::Period, "on to an impact"),
        (Key::ArrowRight, "a step"),
        (Key::End, "a jump to the end"),
        // None has happened there yet: the run goes on to it.
        (Key::Period, "on to an impact to come"),
        (Key::R, "a reset"),
    ] {
        harness.key_press(key);
        silent(&mut harness, 30, what);
    }
    // What was shown before sounds again when it is played again.
    harness.state_mut().player_mut().set_playing(true);
    let again: usize = (0..90).map(|_| frame(&mut harness, &heard).2.len()).sum();
    assert_eq!(again, impacts(&harness, shown(&harness)).len());
    harness.key_press(Key::M);
    harness.step();
    heard.clicks.take();
    assert!(!heard.on.get());
    silent(&mut harness, 60, "off again");
}

#[test]
fn a_run_has_the_same_bits_with_sound_and_without() {
    let run = |sound: bool| {
        let (mut harness, heard) = with_ears("spcmm");
        harness.state_mut().set_sound(sound);
        harness.state_mut().player_mut().set_playing(true);
        harness.run_steps(90);
        assert_eq!(heard.clicks.borrow().is_empty(), !sound);
        let player = harness.state().player();
        (player.simulation().state_hash(), player.pacer.shown(), player.steps())
    };
    assert_eq!(run(true), run(false));
}

#[test]
fn the_switch_is_in_the_menu_and_the_key_is_its_own() {
    let (mut harness, heard) = with_ears("pendulum");
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
    assert!(heard.on.get() && harness.state().is_sounding());
    assert!(switch(&mut harness, false));
    harness.key_press(Key::M);
    harness.run();
    assert!(!switch(&mut harness, false) && !heard.on.get());
    // The magnification has another.
    let magnified = |harness: &Harness<'_, App>| harness.state().link().magnification;
    let before = magnified(&harness);
    harness.key_press(Key::X);
    harness.run();
    assert_ne!(magnified(&harness), before);
    assert!(!harness.state().is_sounding());
}

#[test]
fn without_a_device_the_window_says_so_and_goes_on() {
    let (mut harness, heard) = with_ears("pendulum");
    harness.state_mut().player_mut().set_playing(true);
    harness.key_press(Key::M);
    harness.run_steps(3);
    assert!(harness.state().is_sounding());
    // It turns out later, as opening a device takes a while.
    heard.deaf.replace(Some("this machine has no sound device".to_owned()));
    harness.run_steps(90);
    assert!(!harness.state().is_sounding() && !heard.on.get());
    let words = harness.state().announcement();
    assert!(words.contains("No sound: this machine has no sound device."), "{words}");
    assert!(harness.state().player().is_playing());

    // A window without any services knows at once.
    let mut harness = sized("pendulum", [1280.0, 800.0], egui::Theme::Light);
    harness.key_press(Key::M);
    harness.run_steps(90);
    assert!(!harness.state().is_sounding());
    let words = harness.state().announcement();
    assert!(words.contains("No sound: "), "{words}");
}
