//! The events of a run since its start: enough to repeat the same steps and get the same bits.
//!
//! A change happens between two steps, so the number of steps taken says exactly when. Sampling and drawing never change a step
//! and are not logged.

use crate::analysis::section::Schedule;
use crate::machine::Vec3;
use crate::scene::{LiveScene, SetError};
use crate::simulate::{Effect, MAX_RUN_DURATION, Pull, Simulation, Stopped};

/// Largest stiffness, N/m, and damping, N s/m, of a logged pull.
const MAX_STIFFNESS: f64 = 1e9;
/// Largest number of sections of a sweep, each of which ends a step.
const MAX_SECTIONS: u64 = 20_000;
/// Least time between two sections, s: times closer together are the same number late in a long run.
const MIN_INTERVAL: f64 = 1e-9;

/// An event between two steps.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// A parameter was given a value, as a user writes it.
    Set {
        /// Key.
        key: String,
        /// Value.
        value: String,
    },
    /// A parameter was reset to the value in the scene's file.
    Original {
        /// Key.
        key: String,
    },
    /// Steps end at `first`, at `first + interval`, and so on, at `sections` instants, s.
    Sections {
        /// First instant, s.
        first: Number,
        /// Interval, s.
        interval: Number,
        /// Number of instants.
        sections: u64,
    },
    /// The user pulled a body, or released it.
    Pull(Option<LoggedPull>),
    /// The divergence guard refused a step.
    Stop,
}

impl Event {
    /// A change of `key` to `value`.
    pub fn set(key: &str, value: &str) -> Self {
        Self::Set {
            key: key.to_owned(),
            // One line per event: line breaks count as spaces.
            value: value.split_whitespace().collect::<Vec<_>>().join(" "),
        }
    }

    /// Applies the event to `run`. Sections and a refused step change nothing here: the caller that steps the run handles them.
    ///
    /// # Errors
    /// As [`LiveScene::set`]; the run is left unchanged.
    pub fn apply(&self, run: &mut LiveScene) -> Result<Effect, SetError> {
        match self {
            Self::Set { key, value } => run.set(key, value),
            // A joint without a value of its own in the file follows the common one again, whatever that is now.
            Self::Original { key } => run.undo_change(key),
            Self::Pull(pulled) => Ok(run.pull(pulled.map(Pull::from)).map(|()| Effect::Now)?),
            Self::Sections { .. } | Self::Stop => Ok(Effect::Now),
        }
    }

    /// The step ends that this event prescribes.
    pub fn schedule(&self) -> Option<Schedule> {
        let Self::Sections { first, interval, sections } = self else {
            return None;
        };
        Some(Schedule {
            first: first.0,
            interval: interval.0,
            sections: usize::try_from(*sections).unwrap_or(usize::MAX),
            discard: 0,
        })
    }

    /// Description of the event.
    pub fn description(&self) -> String {
        match self {
            Self::Set { key, value } => format!("{key} = {value}"),
            Self::Original { key } => format!("{key} as in the scene file"),
            Self::Sections { sections, .. } => format!("{sections} sections of a sweep"),
            Self::Pull(Some(_)) => "pulled".to_owned(),
            Self::Pull(None) => "let go".to_owned(),
            Self::Stop => "stopped".to_owned(),
        }
    }
}

impl From<Schedule> for Event {
    fn from(schedule: Schedule) -> Self {
        let Schedule { first, interval, sections, .. } = schedule;
        Self::Sections { first: Number(first), interval: Number(interval), sections: sections as u64 }
    }
}

/// A pull: the body, and the numbers of a [`Pull`]: point, hand, stiffness, damping.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoggedPull {
    body: usize,
    numbers: [Number; 8],
}

impl From<Pull> for LoggedPull {
    fn from(pull: Pull) -> Self {
        let (p, h) = (pull.point, pull.hand);
        let numbers = [p.x, p.y, p.z, h.x, h.y, h.z, pull.stiffness, pull.damping];
        Self { body: pull.body, numbers: numbers.map(Number) }
    }
}

impl From<LoggedPull> for Pull {
    fn from(pull: LoggedPull) -> Self {
        let [px, py, pz, hx, hy, hz, stiffness, damping] = pull.numbers.map(|n| n.0);
        Self { body: pull.body, point: Vec3::new(px, py, pz), hand: Vec3::new(hx, hy, hz), stiffness, damping }
    }
}

/// A finite number that is compared by its bits.
#[derive(Clone, Copy, Debug)]
pub struct Number(pub f64);

impl PartialEq for Number {
    fn eq(&self, other: &Self) -> bool {
        self.0.to_bits() == other.0.to_bits()
    }
}

impl Eq for Number {}

/// An event and the number of steps taken before it since the start.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Accepted steps before it.
    pub steps: u64,
    /// The event.
    pub event: Event,
}

/// The start of a run and every event since.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Log {
    /// Changes to the scene file at the start of the run, in order.
    pub base: Vec<(String, String)>,
    /// Events in order.
    pub entries: Vec<Entry>,
}

impl Log {
    /// An empty log of a run that starts with these changes.
    pub fn new(base: &[(String, String)]) -> Self {
        Self { base: base.to_vec(), entries: Vec::new() }
    }

    /// Adds a change of `key` to `value`.
    pub fn set(&mut self, steps: u64, key: &str, value: &str) {
        self.push(steps, Event::set(key, value));
    }

    /// Adds an event.
    pub fn push(&mut self, steps: u64, event: Event) {
        self.entries.push(Entry { steps, event });
    }

    /// The entries as text: a line each, with the steps since the line before.
    pub fn to_text(&self) -> String {
        let mut text = String::new();
        let mut before = 0;
        for entry in &self.entries {
            let steps = entry.steps.saturating_sub(before);
            before = entry.steps;
            text.push_str(&match &entry.event {
                Event::Set { key, value } => format!("{steps} {key}={value}\n"),
                Event::Original { key } => format!("{steps} {key}\n"),
                Event::Sections { first, interval, sections } => {
                    format!("{steps} |{} {} {sections}\n", first.0, interval.0)
                }
                Event::Pull(None) => format!("{steps} @\n"),
                Event::Pull(Some(pull)) => {
                    let numbers = pull.numbers.map(|number| number.0.to_string());
                    format!("{steps} @{} {}\n", pull.body, numbers.join(" "))
                }
                Event::Stop => format!("{steps} !\n"),
            });
        }
        text
    }

    /// The reverse of [`Self::to_text`].
    ///
    /// # Errors
    /// A line that is not an entry.
    pub fn read(base: Vec<(String, String)>, text: &str) -> Result<Self, String> {
        let mut log = Self { base, entries: Vec::new() };
        let mut before = 0_u64;
        for line in text.lines() {
            let error = || {
                let start: String = line.chars().take(60).collect();
                format!("`{start}` is not a line of a log")
            };
            let (steps, body) = line.split_once(' ').ok_or_else(error)?;
            let more: u64 = steps.parse().map_err(|_| error())?;
            before = before.checked_add(more).ok_or_else(error)?;
            if body.is_empty() {
                return Err(error());
            }
            if let Some(text) = body.strip_prefix('|') {
                log.push(before, read_sections(text).ok_or_else(error)??);
                continue;
            }
            if let Some(text) = body.strip_prefix('@') {
                log.push(before, read_pull(text).ok_or_else(error)?);
                continue;
            }
            log.push(
                before,
                match body.split_once('=') {
                    Some((key, value)) => Event::Set { key: key.to_owned(), value: value.to_owned() },
                    None if body == "!" => Event::Stop,
                    None => Event::Original { key: body.to_owned() },
                },
            );
        }
        Ok(log)
    }
}

/// A log and the position of a run in it: the entries passed, and those ahead.
#[derive(Clone, Debug)]
pub struct Script {
    pub(super) log: Log,
    /// Number of entries passed.
    pub(super) passed: usize,
    /// Time of every entry ever passed, s.
    times: Vec<f64>,
    /// Prescribed step ends.
    sections: Option<Schedule>,
}

impl Script {
    /// At the start of `log`.
    pub fn new(log: Log) -> Self {
        Self { log, passed: 0, times: Vec::new(), sections: None }
    }

    /// The log up to the position.
    pub fn past(&self) -> Log {
        let Log { base, entries } = &self.log;
        Log { base: base.clone(), entries: entries[..self.passed].to_vec() }
    }

    /// Whether entries lie ahead.
    pub fn has_more(&self) -> bool {
        self.passed < self.log.entries.len()
    }

    /// The next event, if it is due after `steps` steps.
    pub fn due(&self, steps: u64) -> Option<&Event> {
        let next = self.log.entries.get(self.passed)?;
        (next.steps <= steps).then_some(&next.event)
    }

    /// Passes the next entry at `time`, s.
    pub fn pass(&mut self, time: f64) {
        if self.times.len() == self.passed {
            self.times.push(time);
        }
        self.passed += 1;
        self.sections = self.log.entries[self.passed - 1].event.schedule().or(self.sections);
    }

    /// Applies to `run` the events due before its next step, except a refused step.
    ///
    /// # Errors
    /// As [`Event::apply`], for the next entry.
    pub fn apply_due(&mut self, run: &mut LiveScene) -> Result<(), SetError> {
        while let Some(event) = self.due(run.statistics().steps).filter(|event| **event != Event::Stop) {
            event.apply(run)?;
            self.pass(run.time());
        }
        Ok(())
    }

    /// Takes a step of `run` that ends at `end`, s, at the latest, or where the log prescribes. A refused step passes the entry
    /// that says so, or is recorded by one.
    ///
    /// # Errors
    /// As [`Simulation::step`].
    pub fn step(&mut self, run: &mut Simulation, end: f64) -> Result<(), Stopped> {
        run.step_until(self.step_end(run.time()).min(end)).inspect_err(|_| {
            let steps = run.statistics().steps;
            match self.due(steps) {
                Some(Event::Stop) => self.pass(run.time()),
                _ => self.record(steps, Event::Stop, run.time()),
            }
        })
    }

    /// Adds entries ahead.
    pub fn queue(&mut self, entries: impl IntoIterator<Item = Entry>) {
        self.log.entries.extend(entries);
    }

    /// Adds an event that happened after `steps` steps at `time`, s, and drops the entries ahead.
    pub fn record(&mut self, steps: u64, event: Event, time: f64) {
        self.drop_ahead();
        self.log.push(steps, event);
        self.pass(time);
    }

    /// Returns to the position after `passed` entries.
    pub fn go_back(&mut self, passed: usize) {
        self.passed = passed;
        let entries = self.log.entries[..passed].iter().rev();
        self.sections = entries.filter_map(|entry| entry.event.schedule()).next();
    }

    /// Drops the entries ahead.
    pub fn drop_ahead(&mut self) {
        self.log.entries.truncate(self.passed);
        self.times.truncate(self.passed);
    }

    /// Latest end of a step that begins at `now`, s.
    pub fn step_end(&self, now: f64) -> f64 {
        self.sections.map_or(f64::INFINITY, |schedule| schedule.next(now))
    }

    /// Time, s, and description of every event ever passed; of a pull, only the start and the end.
    pub fn flags(&self) -> impl Iterator<Item = (f64, String)> {
        let entries = &self.log.entries;
        let is_pull = |at: usize| matches!(entries[at].event, Event::Pull(Some(_)));
        let continues_pull = move |at: usize| at > 0 && is_pull(at) && is_pull(at - 1);
        let times = self.times.iter().enumerate().filter(move |(at, _)| !continues_pull(*at));
        times.map(|(at, time)| (*time, entries[at].event.description()))
    }
}

/// Reads `FIRST INTERVAL SECTIONS`; the inner error states the limits that they exceed.
fn read_sections(text: &str) -> Option<Result<Event, String>> {
    let mut parts = text.split(' ');
    let mut number = || {
        let value = parts.next()?.parse::<f64>().ok()?;
        (value.is_finite() && value > 0.0).then_some(Number(value))
    };
    let (first, interval) = (number()?, number()?);
    let sections: u64 = parts.next()?.parse().ok()?;
    if parts.next().is_some() {
        return None;
    }
    let is_allowed = first.0 <= MAX_RUN_DURATION && interval.0 >= MIN_INTERVAL && sections <= MAX_SECTIONS;
    Some(if is_allowed {
        Ok(Event::Sections { first, interval, sections })
    } else {
        Err(format!(
            "{sections} sections from {:e} s on, {:e} s apart; allowed at most {MAX_SECTIONS}, from at most {MAX_RUN_DURATION:e} s on, \
             at least {MIN_INTERVAL:e} s apart",
            first.0, interval.0
        ))
    })
}

/// Reads `BODY` and eight numbers, or nothing.
fn read_pull(text: &str) -> Option<Event> {
    if text.is_empty() {
        return Some(Event::Pull(None));
    }
    let (body, rest) = text.split_once(' ')?;
    let numbers: Option<Vec<Number>> = rest
        .split(' ')
        .map(|part| part.parse::<f64>().ok())
        .map(|value| value.filter(|value| value.is_finite()).map(Number))
        .collect();
    let numbers: [Number; 8] = numbers?.try_into().ok()?;
    let is_in_range = numbers[6..].iter().all(|n| (0.0..=MAX_STIFFNESS).contains(&n.0));
    let body = body.parse().ok()?;
    is_in_range.then_some(Event::Pull(Some(LoggedPull { body, numbers })))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_written_as_text_reads_back_unchanged() {
        let mut log = Log::new(&[("contact.friction".to_owned(), "0.2".to_owned())]);
        log.set(0, "contact.clearance", " 0.5\n mm");
        log.set(120, "joint.S1.clearance", "0.4 mm");
        let key = "contact.clearance".to_owned();
        log.push(120, Event::Original { key });
        let sections = Event::Sections { first: Number(0.1 + 0.2), interval: Number(2.0), sections: 30 };
        log.push(130, sections);
        let pull = Pull {
            body: 3,
            point: Vec3::new(0.1, -1e-300, 0.0),
            hand: Vec3::new(1.0 / 3.0, 2.0, 1e22),
            stiffness: 700.5,
            damping: 0.0,
        };
        log.push(131, Event::Pull(Some(pull.into())));
        log.push(140, Event::Pull(None));
        log.push(7_000_000_000, Event::Stop);
        let text = log.to_text();
        assert_eq!(text.lines().next(), Some("0 contact.clearance=0.5 mm"));
        assert_eq!(Log::read(log.base.clone(), &text), Ok(log));
        for bad in [
            "x a=b",
            "12",
            "12 ",
            "-1 a=b",
            "1 a=b\n18446744073709551615 a=b",
            "1 |2 2",
            "1 |0 2 3",
            "1 |1 NaN 3",
            "1 |1 2 3 4",
            "1 @0 1 2 3",
            "1 @0 1 2 3 4 5 6 -7 8",
            "1 @0 1 2 3 4 5 inf 7 8",
            "1 @0 1 2 3 4 5 6 7 1e10",
        ] {
            assert!(Log::read(Vec::new(), bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_log_with_more_or_closer_sections_than_a_run_can_end_steps_at_is_refused() {
        assert!(Log::read(Vec::new(), "0 |1000000 1e-9 20000\n").is_ok());
        for beyond in ["0 |1 1 1000000000000", "0 |1 1e-9 20001", "0 |1 1e-10 2", "0 |1e300 1 2"] {
            let error = Log::read(Vec::new(), beyond).expect_err(beyond);
            let allowed = "allowed at most 20000, from at most 1e6 s on, at least 1e-9 s apart";
            assert!(error.contains(allowed), "{error}");
        }
    }

    #[test]
    fn a_new_event_drops_the_entries_ahead_and_passed_entries_stay() {
        let mut script = Script::new(Log::default());
        let sections = Event::from(Schedule { first: 1.0, interval: 0.5, sections: 2, discard: 0 });
        script.queue([Entry { steps: 4, event: sections }, Entry { steps: 9, event: Event::Stop }]);
        assert_eq!((script.due(3), script.step_end(0.0)), (None, f64::INFINITY));
        assert!(script.due(4).is_some());
        script.pass(0.25);
        assert_eq!((script.due(4), script.due(9), script.step_end(1.2)), (None, Some(&Event::Stop), 1.5));
        assert_eq!(script.flags().map(|(time, _)| time).collect::<Vec<_>>(), [0.25]);
        script.go_back(0);
        assert!(script.step_end(0.0).is_infinite() && script.past().entries.is_empty());
        script.pass(0.25);
        script.record(5, Event::Pull(None), 0.3);
        assert!(!script.has_more());
        assert_eq!(script.past().entries.iter().map(|entry| entry.steps).collect::<Vec<_>>(), [4, 5]);
    }
}
