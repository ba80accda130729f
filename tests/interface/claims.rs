//! Walks every lesson to its end in each display mode and checks the statements that its text makes about the machine and the
//! window at an instant. Statements about a whole run are measured by the lesson itself; `jointplay lessons` and the unit tests
//! check those.

use eframe::egui::{Key, accesskit::Role};
use egui_kittest::{Harness, kittest::Queryable as _};
use jointplay::app::{App, BUILT_IN_LESSONS};
use jointplay::simulate::{ContactMode, Simulation};

use crate::hands::lesson::{PHONE, WIDE, open_lesson, play, present, press, shows_text};
use crate::hands::peaks_of_run;

/// Display mode of a lesson.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Mode {
    Window,
    Presentation,
    /// The page in a small window.
    Phone,
}

/// When a claim holds.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum When {
    /// At the start of the step.
    Begins,
    /// At its end.
    Ends,
}
use When::{Begins, Ends};

/// Lesson, step counted from 1, when the claim holds, its words as on the page, and its check.
type Claim = (&'static str, usize, When, &'static str, fn(&mut Shown) -> bool);

/// The window at an instant of a lesson.
struct Shown {
    harness: Harness<'static, App>,
    mode: Mode,
}

impl Shown {
    fn app(&self) -> &App {
        self.harness.state()
    }

    fn joint(&self, joint: usize) -> jointplay::simulate::JointReport {
        self.app().player().frame().joints[joint]
    }

    fn joints(&self) -> std::ops::Range<usize> {
        0..self.app().player().frame().joints.len()
    }

    fn time(&self) -> f64 {
        self.app().player().pacer.shown()
    }

    fn is_free(&self, joint: usize) -> bool {
        let report = self.joint(joint);
        report.state == ContactMode::Free && report.normal_force.norm() == 0.0
    }

    fn touches(&self, joint: usize) -> bool {
        let report = self.joint(joint);
        report.state != ContactMode::Free && report.penetration > 0.0 && report.normal_force.norm() > 0.0
    }

    fn all_free(&self) -> bool {
        self.joints().all(|joint| self.is_free(joint))
    }

    fn all_rest(&self) -> bool {
        self.joints().all(|joint| self.touches(joint) && self.joint(joint).penetration_rate.abs() < 1e-3)
    }

    /// Whether the ball of `joint` hits its wall within `within` s from now, by a separate run.
    fn strikes(&self, joint: usize, within: f64) -> bool {
        let now = self.time();
        let peaks = peaks_of_run(self.app(), now + within + 5e-3);
        peaks.iter().any(|(impact, _)| impact.joint == joint && impact.start > now && impact.start < now + within)
    }

    /// Whether the first impact of S1 is over.
    fn first_impact_is_over(&self) -> bool {
        let mut over = self.app().player().impact_record().until(self.time());
        self.is_free(0) && over.any(|(_, own, _)| own.joint == 0)
    }

    /// Whether these plots are shown; on a phone, in their tab.
    fn plots(&mut self, titles: &[&str]) -> bool {
        let tab = |harness: &mut Harness<'static, App>, name: &str| {
            harness.get_by_role_and_label(Role::Button, name).click();
            harness.run_steps(3);
        };
        if self.mode == Mode::Phone {
            tab(&mut self.harness, "Plots");
        }
        let are_shown = titles.iter().all(|title| shows_text(&self.harness, title));
        if self.mode == Mode::Phone {
            tab(&mut self.harness, "Lesson");
        }
        are_shown
    }

    fn microscope(&self, joint: usize) -> bool {
        let microscope = self.app().microscope();
        microscope.is_open() && microscope.joint() == joint
    }

    /// Presses `keys`, evaluates `look` at the instant reached, and returns to the current instant.
    fn after_keys(&mut self, keys: &[Key], look: impl Fn(&Self) -> bool) -> bool {
        let start = self.time();
        for key in keys {
            self.harness.key_press(*key);
            self.harness.step();
            while self.app().player().is_seeking() {
                self.harness.step();
            }
            self.harness.run_steps(2);
        }
        let holds = look(self);
        self.harness.state_mut().show_instant(start);
        self.harness.run_steps(2);
        if self.app().course().is_some_and(|course| course.is_reached()) {
            // The seek went past the end of the step, so restarts the step.
            press(&mut self.harness, Key::PageDown);
            press(&mut self.harness, Key::PageUp);
        }
        holds
    }
}

/// Whether the instant is the peak of impact `number` of `joint`, and the badge names it.
fn is_at_peak(shown: &Shown, number: u64, joint: usize) -> bool {
    let record = shown.app().player().impact_record();
    let at = record.in_progress(Some(joint), shown.time());
    let force = shown.joint(joint).normal_force.norm();
    let badge = shown.app().impact_badge().unwrap_or_default();
    at.is_some_and(|(own, impact)| {
        own == number
            && impact.force_peak.time == shown.time()
            && (force / impact.force_peak.force.norm() - 1.0).abs() < 2e-3
            && badge.starts_with(&format!("Impact {number}, S{}: ", joint + 1))
    })
}

const CLAIMS: &[Claim] = &[
    ("rattle", 1, Begins, "The microscope shows the gap magnified", |s| s.microscope(0)),
    ("rattle", 1, Begins, "The ball starts at the centre and touches nothing", |s| {
        s.joint(0).eccentricity.norm() < 1e-9 && s.all_free()
    }),
    ("rattle", 1, Begins, "Each of the three rods hangs by a ball in a socket", |s| s.joints().len() == 3),
    ("rattle", 2, Begins, "As long as a ball touches nothing, its joint carries no force", |s| s.all_free()),
    ("rattle", 2, Begins, "The gaps of all three joints are equal", |s| {
        s.joints().all(|joint| s.joint(joint).clearance == s.joint(0).clearance)
    }),
    ("rattle", 2, Ends, "All three strike after", |s| s.joints().all(|joint| s.touches(joint))),
    ("rattle", 3, Begins, "The ball of S1 has just touched its wall, and the force rises", |s| {
        s.touches(0) && s.joint(0).penetration_rate > 0.0
    }),
    ("rattle", 3, Begins, "the machine runs 10 000 times slower than real time", |s| {
        s.app().player().pacer.scale() == 1e-4
    }),
    ("rattle", 3, Begins, "Watch the force", |s| s.plots(&["Normal force, N"])),
    ("rattle", 3, Ends, "In that short time the wall reverses the motion of the ball", |s| s.is_free(0)),
    ("rattle", 4, Begins, "The first impact is now over", |s| s.is_free(0)),
    ("rattle", 5, Begins, "Before its first impact the ball of S2 fell through the whole gap", |s| {
        s.microscope(1) && s.is_free(1)
    }),
    ("rattle", 6, Ends, "From then on every ball rests on its wall", |s| s.all_rest()),
    ("rattle", 6, Ends, "slides along it as the machine moves", |s| {
        s.joints().all(|joint| s.joint(joint).slip_speed > 0.0)
    }),
    ("rattle", 6, Ends, "The play is still there, but all on one side", |s| {
        s.joints().all(|joint| s.joint(joint).eccentricity.norm() >= s.joint(joint).clearance)
    }),
    ("first-impact", 1, Begins, "with every ball at the centre of its socket", |s| {
        s.joints().all(|joint| s.joint(joint).eccentricity.norm() < 1e-9)
    }),
    ("first-impact", 1, Begins, "it runs the machine to the peak of the first impact", |s| {
        s.after_keys(&[Key::Period], |s| is_at_peak(s, 1, 0))
    }),
    ("first-impact", 1, Ends, "the first impact of S1 begins at", |s| s.touches(0) && s.plots(&["Normal force, N"])),
    ("first-impact", 2, Begins, "The slides move all the while", |s| {
        s.app().player().frame().bodies.iter().any(|body| body.velocity.norm() > 1e-3)
    }),
    ("first-impact", 2, Ends, "Before the first impact no ball touches its wall", |s| {
        s.all_free() && s.strikes(0, 0.11e-3)
    }),
    ("first-impact", 2, Ends, "The joints carry nothing", |s| s.plots(&["Normal force, N", "Acceleration, m/s²"])),
    ("first-impact", 4, Ends, "At 11 ms", |s| s.first_impact_is_over()),
    ("first-impact", 6, Ends, "the same to the last digit", |s| s.first_impact_is_over()),
    ("first-impact", 7, Ends, "the first impact ends a free fall through the clearance", |s| {
        s.joints().any(|joint| s.touches(joint))
    }),
    ("clearance", 1, Begins, "The clearance of all three joints is 0.3 mm", |s| {
        s.joints().all(|joint| (s.joint(joint).clearance - 0.3e-3).abs() < 1e-9)
    }),
    ("clearance", 2, Begins, "the clearance has just been doubled, to 0.6 mm", |s| {
        s.app().player().running().machine.contact.clearance == 0.6e-3 && s.joint(0).clearance == 0.6e-3
    }),
    ("clearance", 2, Begins, "S1 is in free flight", |s| s.is_free(0) && s.microscope(0)),
    ("clearance", 2, Ends, "it flies on and has farther to go", |s| s.joint(0).clearance == 0.6e-3),
    ("clearance", 3, Begins, "Now the machine starts with 0.6 mm of clearance", |s| {
        s.joint(1).clearance == 0.6e-3 && s.time() == 0.0
    }),
    ("clearance", 4, Begins, "Here the machine with twice the clearance continues", |s| s.joint(1).clearance == 0.6e-3),
    ("clearance", 5, Begins, "After the rattle every ball rests on its wall, off the centre of its socket", |s| {
        s.all_rest()
    }),
    ("clearance", 5, Begins, "the probe is not where it would be in the ideal machine", |s| {
        let error = s.app().player().frame().probe_error.expect("a probe").norm();
        s.app().player().ideal().is_some() && error > 0.3e-3 && s.plots(&["Tip error by axis, mm"])
    }),
    ("clearance", 6, Begins, "A clearance of 0 makes the joints ideal", |s| {
        s.joints().all(|joint| s.joint(joint).state == ContactMode::Ideal)
    }),
    ("clearance", 6, Ends, "each ball stays at the centre of its socket", |s| {
        s.joints().all(|joint| s.joint(joint).eccentricity.norm() < 1e-9)
    }),
    ("friction", 1, Begins, "Here the balls rest on their walls and slide along them", |s| {
        s.all_rest() && s.joints().all(|joint| s.joint(joint).slip_speed > 0.0)
    }),
    ("friction", 1, Begins, "watch the second arrow at the ball", |s| {
        s.joint(0).friction_force.norm() > 0.1 && shows_text(&s.harness, "Friction")
    }),
    ("friction", 2, Begins, "The balls are about to strike", |s| {
        s.all_free() && s.joints().all(|joint| s.strikes(joint, 0.2e-3))
    }),
    ("friction", 2, Begins, "Compare the plots of the normal and of the friction force", |s| {
        s.plots(&["Normal force, N", "Friction force, N"])
    }),
    ("friction", 3, Begins, "The same machine from the start, without friction", |s| {
        s.time() == 0.0 && s.app().player().running().machine.contact.friction == 0.0
    }),
    ("friction", 4, Begins, "Here nothing slows the balls along their walls", |s| {
        s.joints().all(|joint| s.joint(joint).friction_force.norm() == 0.0)
    }),
    ("friction", 5, Begins, "Two things dissipate energy", |s| s.plots(&["Energy balance, mJ"])),
    ("friction", 6, Begins, "At this instant friction is switched on", |s| {
        s.app().player().running().machine.contact.friction == 0.15 && (s.time() - 60e-3).abs() < 1e-9
    }),
    ("friction", 6, Ends, "then the balls rest on their walls", |s| s.all_rest()),
    ("slow-motion", 1, Begins, "At a time scale of 1:1000", |s| {
        s.app().player().pacer.scale() == 1e-3 && shows_text(&s.harness, "1:1000")
    }),
    ("slow-motion", 1, Begins, "The machine is paused just before it", |s| s.is_free(1) && s.strikes(1, 0.05e-3)),
    ("slow-motion", 1, Ends, "Press Play to watch the whole impact", |s| s.is_free(1)),
    ("slow-motion", 2, Begins, "Once more from just before the contact", |s| s.is_free(1) && s.strikes(1, 0.05e-3)),
    ("slow-motion", 3, Ends, "on the way in and", |s| s.is_free(1) && s.plots(&["Normal force, N", "Indentation, µm"])),
    ("slow-motion", 4, Begins, "runs the machine to the peak of the next impact", |s| {
        s.after_keys(&[Key::Period], |s| s.time() > 15e-3 && s.touches(1))
    }),
    ("slow-motion", 4, Begins, "now a little faster", |s| s.app().player().pacer.scale() == 2e-3),
    ("slow-motion", 4, Ends, "S1 strikes at 10.5 ms", |s| s.touches(0)),
    ("slow-motion", 5, Begins, "back to the peak of the first impact, and forward again", |s| {
        let before = s.app().player().simulation().state_hash();
        s.after_keys(&[Key::Comma, Key::Comma], |s| is_at_peak(s, 2, 1))
            && s.after_keys(&[Key::Comma, Key::Comma, Key::Period], |s| is_at_peak(s, 4, 1))
            && s.app().player().simulation().state_hash() == before
    }),
    ("slow-motion", 6, Begins, "It is about to strike again", |s| {
        s.is_free(2) && s.strikes(2, 0.1e-3) && s.microscope(2)
    }),
    ("slow-motion", 6, Ends, "It lasts 154 µs", |s| s.is_free(2)),
    ("ideal", 1, Begins, "The pale ghost is the same machine with ideal joints", |s| {
        s.app().player().ideal().is_some()
    }),
    ("ideal", 1, Begins, "The plot shows its three components", |s| {
        s.plots(&["Tip error by axis"]) && s.app().player().frame().probe_error.is_some()
    }),
    ("ideal", 2, Begins, "At the start the balls are at the centres of their sockets, and the error is 0", |s| {
        s.all_free() && s.app().player().frame().probe_error.expect("a probe").norm() < 1e-9
    }),
    ("ideal", 3, Begins, "The probe sits below the platform", |s| {
        let frame = s.app().player().frame();
        let gravity = s.app().player().running().machine.gravity;
        let output = &s.app().player().running().machine.output;
        let body = &frame.bodies[output.body];
        let probe = body.position + body.rotation * output.probe.expect("a probe");
        frame.joints.iter().all(|joint| (probe - joint.ball_centre).dot(&gravity) > 0.0)
    }),
    ("ideal", 4, Begins, "The balls rest on the walls of their sockets", |s| s.all_rest()),
    ("ideal", 5, Begins, "In this machine x points downwards; y and z are horizontal", |s| {
        let gravity = s.app().player().running().machine.gravity;
        gravity.x > 9.0 && gravity.y == 0.0 && gravity.z == 0.0
    }),
    ("ideal", 6, Ends, "It varies from", |s| s.plots(&["Tip error by axis"])),
    ("forces", 1, Begins, "Between the spikes the force is 0", |s| {
        let mut run = Simulation::new(&s.app().player().running().machine).expect("starts");
        let mut impacts = Vec::new();
        let mut seen = Vec::new();
        let mut frame = jointplay::simulate::Frame::default();
        while run.time() < 60e-3 {
            run.step().expect("runs");
            run.sample(run.time(), &mut frame);
            seen.push((run.time(), frame.joints[1].normal_force.norm()));
            impacts.extend(run.take_impacts());
        }
        impacts.retain(|impact| impact.joint == 1);
        // Leaves out the impact in progress at the end.
        let last = impacts.iter().map(|impact| impact.end).fold(0.0, f64::max);
        seen.retain(|(time, _)| *time < last);
        let between = |time: f64| impacts.iter().all(|impact| time <= impact.start || time >= impact.end);
        let all = seen.iter().filter(|(time, _)| between(*time)).collect::<Vec<_>>();
        all.len() > 100 && all.iter().all(|(_, force)| *force == 0.0)
    }),
    ("forces", 1, Begins, "The plot shows the normal force of each joint", |s| {
        s.plots(&["Normal force, N", "S1", "S2", "S3"])
    }),
    ("forces", 3, Begins, "The pulse peaks at 871 N", |s| s.is_free(1) && s.strikes(1, 0.2e-3)),
    ("forces", 5, Ends, "Only the line that the spikes hid remains", |s| {
        s.joints().all(|joint| s.joint(joint).state == ContactMode::Ideal)
    }),
    ("worn-hinge", 1, Begins, "The boom turns on a pin at its foot", |s| s.joints().len() == 2),
    ("worn-hinge", 3, Begins, "Play on to where the load is largest", |s| s.time() < 0.5),
    ("worn-hinge", 3, Ends, "They are a couple", |s| {
        let [a, b, ..] = &s.app().player().frame().sites[..] else { return false };
        a.normal_force.dot(&b.normal_force) < -0.9 * a.normal_force.norm() * b.normal_force.norm()
    }),
    ("wear", 1, Begins, "Three balls carry this machine", |s| s.joints().len() == 3),
    ("wear", 2, Begins, "Compare the plots of the normal force", |s| s.plots(&["Normal force, N", "S1", "S2", "S3"])),
    ("wear", 3, Begins, "The slider takes the growth in the last turn", |s| {
        s.app().player().wear_rates().is_some_and(|rates| rates.iter().all(|[rate, _]| *rate > 0.0))
    }),
    ("wear", 4, Begins, "The play of S1 has grown", |s| s.joint(0).clearance > 0.59e-3),
    ("twin", 1, Begins, "The violet ghost is a twin", |s| s.app().player().twin().is_some()),
    ("twin", 2, Begins, "The bench plots the distance of the twin against time", |s| plots_twin_distance(s)),
    ("twin", 2, Begins, "So far no ball touches its wall", |s| s.all_free()),
    ("twin", 2, Ends, "Falling together, the two machines stay together", |s| s.all_free()),
    ("twin", 5, Ends, "The drives take both to the same place", |s| s.all_rest()),
    ("chaos", 1, Begins, "The joint at the slider has a clearance of 0.3 mm", |s| s.joint(1).clearance == 0.3e-3),
    ("chaos", 1, Begins, "The violet twin", |s| s.app().player().twin().is_some() && plots_twin_distance(s)),
    ("chaos", 2, Begins, "Here the clearance is 0", |s| s.joint(0).state == ContactMode::Ideal),
    ("chaos", 3, Ends, "The ball rests on its wall", |s| s.touches(1)),
    ("to-the-class", 1, Begins, "The machine is paused at 9 ms, after the first impacts", |s| {
        let first = s.app().player().impact_record().until(s.time()).count();
        (s.time() - 9e-3).abs() < 1e-9 && s.all_free() && first == 3
    }),
    ("to-the-class", 2, Ends, "The link even carries a checksum of the state", |s| {
        s.app().share_state().contains("hash=")
    }),
];

/// Whether the twin's distance is plotted; on a phone, in its tab.
fn plots_twin_distance(shown: &mut Shown) -> bool {
    let tab = |harness: &mut Harness<'static, App>, name: &str| {
        harness.get_by_role_and_label(Role::Button, name).click();
        harness.run_steps(3);
    };
    if shown.mode == Mode::Phone {
        tab(&mut shown.harness, "Experiments");
    }
    let is_shown = shows_text(&shown.harness, "Distance to twin");
    if shown.mode == Mode::Phone {
        tab(&mut shown.harness, "Lesson");
    }
    is_shown
}

/// Walks every lesson to its end by Page Down and Play in `mode`; returns all claims that do not hold.
fn failed_claims(mode: Mode) -> Vec<String> {
    let mut failures = Vec::new();
    for (name, _) in BUILT_IN_LESSONS {
        let size = if mode == Mode::Phone { PHONE } else { WIDE };
        let mut harness = open_lesson(name, 0, size);
        if mode == Mode::Presentation {
            present(&mut harness, size);
        }
        let mut shown = Shown { harness, mode };
        let steps = shown.app().course().expect("a lesson").lesson().steps.len();
        for step in 1..=steps {
            let mut check = |shown: &mut Shown, now: When| {
                check_panel(shown, &format!("{mode:?}, {name}, step {step}"), now);
                save_picture(shown, &format!("{name}_{step}_{now:?}"));
                for (_, _, _, words, holds) in
                    CLAIMS.iter().filter(|claim| (claim.0, claim.1, claim.2) == (name, step, now))
                {
                    let at = format!("{mode:?}, {name}, step {step}, {now:?}: {words}");
                    if !shows_text(&shown.harness, words) {
                        failures.push(format!("{at}: not on the page"));
                    }
                    if !holds(shown) {
                        failures.push(at);
                    }
                }
            };
            assert_eq!(shown.app().course().expect("a lesson").step() + 1, step, "{mode:?}, {name}");
            assert!(shows_text(&shown.harness, &format!("{step} of {steps}")), "{mode:?}, {name}, step {step}");
            check(&mut shown, Begins);
            if play(&mut shown.harness) {
                shown.harness.run_steps(8);
                check(&mut shown, Ends);
            }
            press(&mut shown.harness, Key::PageDown);
        }
        // Page Down has no effect at the last step.
        assert_eq!(shown.app().course().expect("a lesson").step() + 1, steps);
        shown.harness.get_by_label("Leave the lesson").click();
        shown.harness.run_steps(2);
        assert!(shown.app().course().is_none());
    }
    failures
}

/// Checks that the panel shows the answer only at the end of the step and that all highlighted parts of the window exist.
fn check_panel(shown: &Shown, at: &str, now: When) {
    let course = shown.app().course().expect("a lesson");
    assert!(!shows_text(&shown.harness, "The machine has been changed"), "{at}");
    if now == Begins {
        let points_out = shown.mode != Mode::Window || shown.app().shows_highlights(&shown.harness.ctx);
        assert!(points_out, "{at}: a highlighted part is missing");
        assert!(!shows_text(&shown.harness, "Answer:"), "{at}: the answer shows too early");
    } else if course.lesson().steps[course.step()].question.is_some() {
        let answer = course.answer().unwrap_or_else(|| panic!("{at}: no answer"));
        assert!(shows_text(&shown.harness, &format!("Answer: {answer}")), "{at}: {answer}");
    }
}

/// Saves a picture to the folder `KEEP_PICTURES`, if set.
fn save_picture(shown: &mut Shown, name: &str) {
    if let Some(keep) = std::env::var_os("KEEP_PICTURES") {
        shown.harness.run_steps(8);
        let image = shown.harness.render().expect("drawn");
        let mode = format!("{:?}", shown.mode).to_lowercase();
        image.save(std::path::Path::new(&keep).join(format!("{mode}_{name}.png"))).expect("writable");
    }
}

#[test]
fn claims_of_the_lessons_hold_in_the_window() {
    let failed = failed_claims(Mode::Window);
    assert!(failed.is_empty(), "{failed:#?}");
}

#[test]
fn claims_of_the_lessons_hold_in_a_presentation() {
    let failed = failed_claims(Mode::Presentation);
    assert!(failed.is_empty(), "{failed:#?}");
}

#[test]
fn claims_of_the_lessons_hold_on_the_page_in_a_small_window() {
    let failed = failed_claims(Mode::Phone);
    assert!(failed.is_empty(), "{failed:#?}");
}

#[test]
fn the_tip_error_reverses_with_gravity() {
    // Lesson `ideal`, step 5.
    let tip_error = |gravity: &str| {
        let change = [("gravity.x".to_owned(), gravity.to_owned())];
        let scene = jointplay::scene::Scene::load("spcmm", &change).expect("in range");
        let mut run = Simulation::new(&scene.machine).expect("starts");
        run.advance_to(0.4).expect("runs");
        let mut frame = jointplay::simulate::Frame::default();
        run.sample(0.4, &mut frame);
        frame.probe_error.expect("a probe").x
    };
    let (up, down) = (tip_error("-9.81 m/s^2"), tip_error("9.81 m/s^2"));
    assert!(down > 0.2e-3 && up < -0.2e-3, "{up} {down}");
}
