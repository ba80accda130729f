//! File format of lessons, documented in `docs/lessons.md`.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use serde::Deserialize;
use toml::Spanned;

use super::names::{Names, comparisons, parameter};
use super::text;
use crate::scene::{MAX_FILE_SIZE, Quantity, Scene, SceneError, read_regular};
use crate::session::link::{Link, SceneText};
use crate::suggest::nearest;
use crate::units::Dimension;
use crate::view::Preset;

/// Limits on steps, measures, and choices of a question.
const MAX_STEPS: usize = 40;
const MAX_MEASURES: usize = 100;
const MAX_CHOICES: usize = 6;

/// Default end and start of the measures of a run.
const DEFAULT_END: &str = "120 s";
const DEFAULT_START: &str = "0 s";

/// A parsed lesson.
#[derive(Clone, Debug)]
pub struct Lesson {
    /// Name of a built-in lesson, or path of the file.
    pub name: String,
    /// Title, in sentence case.
    pub title: String,
    /// The runs started by its steps.
    pub runs: Vec<Run>,
    /// The measures taken in them.
    pub measures: Vec<Measure>,
    /// Steps in order.
    pub steps: Vec<Step>,
}

/// A run started by a step.
#[derive(Clone, Debug)]
pub struct Run {
    /// Name of the step.
    pub name: String,
    /// Scene with its initial values.
    pub scene: Scene,
    /// Live changes: time, s, key and value.
    pub changes: Vec<(f64, String, String)>,
}

/// A quantity computed from a run.
#[derive(Clone, Debug)]
pub struct Measure {
    /// Name used in expressions.
    pub name: String,
    /// Index of its run.
    pub run: usize,
    /// Kind of the measure.
    pub kind: Kind,
    /// Expressions for the start and end of the measured interval.
    pub times: [String; 2],
}

/// Kinds of measures.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// A parameter of the scene, by its key.
    Parameter(String),
    /// An instant named by texts and other measures.
    Instant,
    /// A property of an impact of a joint with play.
    Impact {
        /// Name of the joint, or `any`.
        of: String,
        /// Number of the impact, from 1.
        number: usize,
        /// The property.
        its: ImpactProperty,
    },
    /// Number of finished impacts of a joint with play, or of all joints for `any`.
    Count {
        /// Name of the joint, or `any`.
        of: String,
    },
    /// Largest value of a channel.
    Peak(String),
    /// Smallest value of a channel.
    Least(String),
    /// Time average of a channel.
    Mean(String),
    /// Value of a channel at an instant.
    At(String),
    /// Distance of a twin run, in scales of the state.
    Apart,
}

impl Kind {
    /// Dimension of the measure; none for a channel, whose dimension is known only from the running scene.
    pub fn dimension(&self) -> Dimension {
        match self {
            Self::Impact { its, .. } => match its {
                ImpactProperty::Start | ImpactProperty::End | ImpactProperty::Duration => Dimension::Time,
                ImpactProperty::Approach | ImpactProperty::Rebound => Dimension::Speed,
                ImpactProperty::Force => Dimension::Force,
                ImpactProperty::Depth => Dimension::Length,
            },
            Self::Instant => Dimension::Time,
            _ => Dimension::None,
        }
    }

    /// The joint with play of the measure.
    pub fn joint(&self) -> Option<&str> {
        match self {
            Self::Impact { of, .. } | Self::Count { of } => Some(of),
            _ => None,
        }
    }

    /// The channel of the measure.
    pub fn channel(&self) -> Option<&str> {
        match self {
            Self::Peak(name) | Self::Least(name) | Self::Mean(name) | Self::At(name) => Some(name),
            _ => None,
        }
    }
}

/// Properties of an impact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
#[allow(missing_docs)]
pub enum ImpactProperty {
    Start,
    End,
    Duration,
    Approach,
    Rebound,
    Force,
    Depth,
}

/// A step of a lesson.
#[derive(Clone, Debug)]
pub struct Step {
    /// Title, in sentence case.
    pub title: String,
    /// Markdown with placeholders.
    pub text: String,
    /// Index of its run.
    pub run: usize,
    /// Whether it restarts that run, and at which instant.
    pub begins: bool,
    /// Its other settings, as a link.
    pub link: Link,
    /// Camera target.
    pub view: Option<CameraTarget>,
    /// Open panels; `None` leaves them unchanged.
    pub open: Option<Vec<PanelName>>,
    /// Whether a twin run starts with the step.
    pub twin: bool,
    /// Labels of controls, and names of joints with play.
    pub highlight: Vec<String>,
    /// Expression of the instant at which the step ends.
    pub until: Option<String>,
    /// Question whose answer the class predicts.
    pub question: Option<Question>,
    /// Explanation of what was visible.
    pub seen: String,
    /// Conditions that must hold.
    pub claims: Vec<String>,
}

/// Camera target of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CameraTarget {
    /// The whole scene from a point of view.
    From(Preset),
    /// A close-up of a joint with play, by its index.
    At(usize),
}

/// A panel of the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
#[allow(missing_docs)]
pub enum PanelName {
    Controls,
    Plots,
    Bench,
}

/// A question answered by the run.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Question {
    /// The question.
    pub ask: String,
    /// The choices.
    pub choices: Vec<Choice>,
}

/// A choice.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Choice {
    /// Text of the choice.
    pub text: String,
    /// Condition under which the choice is correct.
    pub when: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    title: String,
    #[serde(default, rename = "about")]
    _about: String,
    picture: Option<Spanned<Picture>>,
    scene: Spanned<String>,
    #[serde(default)]
    measure: BTreeMap<String, Spanned<MeasureRow>>,
    step: Vec<Spanned<StepRow>>,
}

#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct MeasureRow {
    parameter: Option<String>,
    instant: Option<String>,
    impact: Option<usize>,
    its: Option<ImpactProperty>,
    of: Option<String>,
    impacts: Option<String>,
    peak: Option<String>,
    least: Option<String>,
    mean: Option<String>,
    value: Option<String>,
    twin: Option<String>,
    from: Option<String>,
    to: Option<String>,
    at: Option<String>,
    run: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StepRow {
    title: String,
    name: Option<String>,
    text: Spanned<String>,
    state: Option<Spanned<String>>,
    change: Option<Spanned<BTreeMap<String, String>>>,
    view: Option<Spanned<String>>,
    open: Option<Vec<PanelName>>,
    #[serde(default)]
    twin: bool,
    #[serde(default)]
    highlight: Vec<String>,
    until: Option<Spanned<String>>,
    question: Option<Spanned<Question>>,
    seen: Option<Spanned<String>>,
    #[serde(default)]
    claims: Vec<Spanned<String>>,
}

/// The picture of a lesson in the list.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Picture {
    /// Instant and changes, as in the state of a step.
    state: String,
    /// Camera target, as that of a step.
    view: Option<String>,
}

impl Picture {
    /// The scene, the instant, s, and the camera target; `scene` is that of the lesson.
    ///
    /// # Errors
    /// The state, the scene or the target is wrong; as a message.
    pub fn instant(&self, scene: &str) -> Result<(Scene, f64, Option<CameraTarget>), String> {
        let link = Link::parse(&format!("?{}", self.state)).map_err(|error| error.to_string())?;
        let scene = Scene::load(scene, &link.log.base).map_err(|error| error.to_string())?;
        let target = self.view.as_ref().map(|view| parse_camera_target(view, &scene)).transpose()?;
        Ok((scene, link.time.unwrap_or(0.0), target))
    }
}

/// The text of a lesson with its origin.
struct Source<'t> {
    file: Option<&'t str>,
    text: &'t str,
}

impl Source<'_> {
    /// An error at `span`, with the `key` if known.
    fn error(&self, span: Range<usize>, key: &str, message: impl Into<String>) -> SceneError {
        let value = self.text.get(span.clone()).unwrap_or_default();
        let value = value.lines().next().filter(|line| *line == value && line.len() < 60);
        SceneError::in_text(self.file, self.text, span.start, Some(key), value, message)
    }

    /// An error at `part` within `span`.
    fn error_within(&self, span: Range<usize>, part: &str, key: &str, message: String) -> SceneError {
        let inside = self.text.get(span.clone()).unwrap_or_default();
        let at = span.start + inside.find(part).unwrap_or(0);
        SceneError::in_text(self.file, self.text, at, Some(key), None, message)
    }
}

/// The key on the line of offset `at`, for errors without one.
fn key_at(text: &str, at: usize) -> Option<&str> {
    let begin = text.get(..at)?.rfind('\n').map_or(0, |line| line + 1);
    let (key, _) = text.get(begin..)?.lines().next()?.split_once('=')?;
    Some(key.trim()).filter(|key| !key.is_empty())
}

impl Lesson {
    /// Reads a file.
    ///
    /// # Errors
    /// The file cannot be read, or any error of [`Self::parse`].
    pub fn read(path: &str) -> Result<Self, SceneError> {
        let fault = |message: String| SceneError {
            file: Some(path.to_owned()),
            message,
            unreadable: true,
            ..SceneError::default()
        };
        let bytes = read_regular(Path::new(path), MAX_FILE_SIZE).map_err(|why| fault(why.to_string()))?;
        let text = String::from_utf8(bytes).map_err(|_| fault("not a text file: it is not valid UTF-8".to_owned()))?;
        Self::parse(path, &text, Some(path))
    }

    /// Parses a lesson called `name`.
    ///
    /// # Errors
    /// Any fault, with file, line, column, key, and allowed values.
    pub fn parse(name: &str, text: &str, file: Option<&str>) -> Result<Self, SceneError> {
        let source = Source { file, text };
        let rows: File = toml::from_str(text).map_err(|error| {
            let at = error.span().map_or(0, |span| span.start);
            SceneError::in_text(file, text, at, key_at(text, at), None, error.message())
        })?;
        let scene_span = || rows.scene.span();
        if !(1..=MAX_STEPS).contains(&rows.step.len()) {
            let message = format!("{} steps; allowed 1 to {MAX_STEPS}", rows.step.len());
            return Err(source.error(scene_span(), "step", message));
        }
        if rows.measure.len() > MAX_MEASURES {
            let message = format!("{} measures; allowed {MAX_MEASURES}", rows.measure.len());
            return Err(source.error(scene_span(), "measure", message));
        }
        let mut lesson = Self {
            name: name.to_owned(),
            title: rows.title.clone(),
            runs: Vec::new(),
            measures: Vec::new(),
            steps: Vec::new(),
        };
        for row in &rows.step {
            let step = lesson.step(&source, &rows.scene, row)?;
            lesson.steps.push(step);
        }
        for (name, row) in &rows.measure {
            let measure = lesson
                .measure(name, row.get_ref())
                .map_err(|message| source.error(row.span(), &format!("measure.{name}"), message))?;
            lesson.measures.push(measure);
        }
        if let Some(picture) = &rows.picture {
            let scene = resolve_scene_path(rows.scene.get_ref(), file);
            let drawn = picture.get_ref().instant(&scene);
            drawn.map_err(|message| source.error(picture.span(), "picture", message))?;
        }
        lesson.check(&source, &rows)?;
        Ok(lesson)
    }

    /// The names of its measures, all pending.
    pub fn names(&self) -> Names<'_> {
        let one = |measure: &Measure| Quantity::new(1.0, measure.kind.dimension());
        let all = self.measures.iter();
        Names::unmeasured(all.map(|measure| (measure.name.as_str(), one(measure))).collect())
    }

    /// The last step up to `step` that starts a run; the machine is set for it.
    pub fn run_start_step(&self, step: usize) -> usize {
        let before = self.steps[..=step].iter();
        before.rev().position(|step| step.begins).map_or(0, |back| step - back)
    }

    fn step(
        &mut self,
        source: &Source<'_>,
        scene: &Spanned<String>,
        row: &Spanned<StepRow>,
    ) -> Result<Step, SceneError> {
        let at = format!("step {}", self.steps.len() + 1);
        let key = |name: &str| format!("{at}.{name}");
        let span = row.span();
        let row = row.get_ref();
        let state = row.state.as_ref();
        let words = state.map_or("", |state| state.get_ref());
        let fault = |message: String| {
            let span = state.map_or(span.clone(), Spanned::span);
            source.error(span, &key("state"), message)
        };
        let mut link = Link::parse(&format!("?{}", words.trim_start_matches(['?', '#'])))
            .map_err(|error| fault(error.to_string()))?;
        if !link.log.entries.is_empty() {
            let message = "contains live changes, packed in `log`; write them as `change` of a step";
            return Err(fault(message.to_owned()));
        }
        (link.steps, link.hash) = (None, None);
        let named = words.split(['&', '?']).any(|word| word.starts_with("scene="));
        let first = self.runs.is_empty();
        let begins = first || named || link.has_instant() || !link.log.base.is_empty();
        if begins {
            let argument = match &link.scene {
                SceneText::BuiltIn(name) if named => name.clone(),
                SceneText::BuiltIn(_) => resolve_scene_path(scene.get_ref(), source.file),
                SceneText::File { .. } => {
                    let message = "contains a scene file; name the file as `scene` of the lesson";
                    return Err(fault(message.to_owned()));
                }
            };
            let loaded =
                Scene::load(&argument, &[]).map_err(|error| source.error(scene.span(), "scene", error.to_string()))?;
            let loaded = match &link.log.base[..] {
                [] => loaded,
                base => Scene::load(&argument, base).map_err(|error| fault(error.to_string()))?,
            };
            link.time.get_or_insert(0.0);
            // A link copied while the machine is being set uses this scene.
            link.scene = SceneText::of(&loaded);
            let name = row.name.clone().unwrap_or_default();
            let same = |run: &Run| !name.is_empty() && run.name == name;
            if self.runs.iter().any(same) {
                let message = format!("another step has the name `{name}`");
                return Err(source.error(span, &key("name"), message));
            }
            self.runs.push(Run { name, scene: loaded, changes: Vec::new() });
        } else if row.name.is_some() {
            let message = "names a run, but the step begins none: its `state` has no instant, parameter or scene";
            return Err(source.error(span, &key("name"), message));
        }
        let index = self.runs.len() - 1;
        let run = &mut self.runs[index];
        let scene = run.scene.clone();
        if let Some(change) = &row.change {
            let fault = |message: String| source.error(change.span(), &key("change"), message);
            let Some(time) = link.time.filter(|_| begins) else {
                return Err(fault("needs a state with an instant, such as `t=20ms`".to_owned()));
            };
            let mut changed = scene.clone();
            for (key, value) in change.get_ref() {
                let done = changed.set(key, value);
                done.map_err(|error| fault(error.to_string()))?;
                run.changes.push((time, key.clone(), value.clone()));
            }
        }
        let followed = link.followed_part(&scene).and(link.microscope_joint(&scene));
        followed.map_err(|error| fault(error.to_string()))?;
        let view = row.view.as_ref().map(|view| {
            parse_camera_target(view.get_ref(), &scene)
                .map_err(|message| source.error(view.span(), &key("view"), message))
        });
        let view = view.transpose()?;
        if let Some(question) = &row.question {
            let fault = |message: String| source.error(question.span(), &key("question"), message);
            let count = question.get_ref().choices.len();
            if !(2..=MAX_CHOICES).contains(&count) {
                return Err(fault(format!("{count} choices; allowed 2 to {MAX_CHOICES}")));
            }
            if row.until.is_none() {
                return Err(fault("needs `until`, the instant at which the answer is shown".to_owned()));
            }
        }
        Ok(Step {
            title: row.title.clone(),
            text: row.text.get_ref().clone(),
            run: index,
            begins,
            link,
            view,
            open: row.open.clone(),
            twin: row.twin,
            highlight: row.highlight.clone(),
            until: row.until.as_ref().map(|until| until.get_ref().clone()),
            question: row.question.as_ref().map(|question| question.get_ref().clone()),
            seen: row.seen.as_ref().map_or(String::new(), |seen| seen.get_ref().clone()),
            claims: row.claims.iter().map(|claim| claim.get_ref().clone()).collect(),
        })
    }

    fn measure(&self, name: &str, row: &MeasureRow) -> Result<Measure, String> {
        const KINDS: &str = "parameter, instant, impact, impacts, peak, least, mean, value, twin";
        let MeasureRow {
            parameter: key,
            instant,
            impact,
            its,
            of,
            impacts,
            peak,
            least,
            mean,
            value,
            twin,
            from,
            to,
            at,
            run,
        } = row.clone();
        let kinds = [
            key.map(Kind::Parameter),
            instant.is_some().then_some(Kind::Instant),
            impact.map(|number| Kind::Impact {
                of: of.clone().unwrap_or_else(|| "any".to_owned()),
                number,
                its: its.unwrap_or(ImpactProperty::Start),
            }),
            impacts.map(|of| Kind::Count { of }),
            peak.map(Kind::Peak),
            least.map(Kind::Least),
            mean.map(Kind::Mean),
            value.map(Kind::At),
            twin.is_some().then_some(Kind::Apart),
        ];
        let kinds: Vec<Kind> = kinds.into_iter().flatten().collect();
        let [kind] = &kinds[..] else {
            return Err(format!("{} kinds of measure; allowed one: {KINDS}", kinds.len()));
        };
        if matches!(kind, Kind::Impact { number: 0, .. }) {
            return Err("impact = 0: allowed 1 and more; the first impact has number 1".to_owned());
        }
        if (its.is_some() || of.is_some()) && !matches!(kind, Kind::Impact { .. }) {
            return Err("`its` and `of` belong to `impact`".to_owned());
        }
        if at.is_some() != matches!(kind, Kind::At(_)) {
            return Err("`value` needs `at`, the instant; no other measure has it".to_owned());
        }
        let ends = match kind {
            Kind::Peak(_) | Kind::Least(_) | Kind::Mean(_) | Kind::Count { .. } => to.is_some(),
            _ => true,
        };
        if !ends {
            return Err("needs `to`, the end of the measured interval".to_owned());
        }
        let run = match run {
            None => 0,
            Some(name) => self.runs.iter().position(|run| run.name == name).ok_or_else(|| {
                let names = self.runs.iter().map(|run| &*run.name).filter(|name| !name.is_empty());
                let near = nearest(&name, names.clone());
                let known: Vec<&str> = names.collect();
                format!("no step that begins a run has the name `{name}`{near}; allowed: {}", known.join(", "))
            })?,
        };
        let scene = &self.runs[run].scene;
        if let Kind::Parameter(key) = kind {
            parameter(scene, key)?;
        }
        if let Some(joint) = kind.joint().filter(|name| *name != "any") {
            let mut names = scene.machine.loose_joints.iter().map(|joint| &*joint.name);
            if !names.clone().any(|name| name == joint) {
                let known: Vec<&str> = names.by_ref().take(12).collect();
                return Err(format!("no joint with play `{joint}`; allowed: any, {}", known.join(", ")));
            }
        }
        let or = |text: Option<String>, default: &str| text.unwrap_or_else(|| default.to_owned());
        Ok(Measure {
            name: name.to_owned(),
            run,
            kind: kind.clone(),
            times: [or(from, DEFAULT_START), or(at.or(twin).or(instant).or(to), DEFAULT_END)],
        })
    }

    /// Checks that every expression refers only to measures.
    fn check(&self, source: &Source<'_>, rows: &File) -> Result<(), SceneError> {
        let names = self.names();
        for (measure, row) in self.measures.iter().zip(rows.measure.values()) {
            for text in &measure.times {
                names.check(text).map_err(|why| {
                    let key = format!("measure.{}", measure.name);
                    source.error_within(row.span(), text, &key, format!("`{text}` {why}"))
                })?;
            }
        }
        for (index, row) in rows.step.iter().enumerate() {
            let row = row.get_ref();
            let key = |name: &str| format!("step {}.{name}", index + 1);
            let condition = |text: &str| {
                let parts = comparisons(text).ok_or("contains no comparison; allowed <, > and =")?;
                let mut sides = parts.into_iter().flat_map(|(left, _, right)| [left, right]);
                sides.try_for_each(|side| names.check(side).map_err(|why| format!("`{side}` {why}")))
            };
            let prose = |text: &str| text::fill(text, &names).map(|_| ());
            for (name, text) in [("text", Some(&row.text)), ("seen", row.seen.as_ref())] {
                if let Some(text) = text {
                    prose(text.get_ref()).map_err(|why| {
                        let part = why.split(':').next().unwrap_or_default();
                        source.error_within(text.span(), part, &key(name), why.clone())
                    })?;
                }
            }
            if let Some(until) = &row.until {
                let checked = names.check(until.get_ref());
                checked.map_err(|why| source.error(until.span(), &key("until"), why))?;
            }
            for claim in &row.claims {
                let checked = condition(claim.get_ref());
                checked.map_err(|why| source.error(claim.span(), &key("claims"), why))?;
            }
            if let Some(question) = &row.question {
                let fault = |part: &str, why| source.error_within(question.span(), part, &key("question"), why);
                let Question { ask, choices } = question.get_ref();
                prose(ask).map_err(|why| fault(ask, why))?;
                for Choice { text, when } in choices {
                    prose(text).map_err(|why| fault(text, why))?;
                    condition(when).map_err(|why| fault(when, why))?;
                }
            }
        }
        Ok(())
    }
}

/// Resolves a scene file relative to the lesson file.
fn resolve_scene_path(scene: &str, file: Option<&str>) -> String {
    let is_file = scene.contains('/') || scene.ends_with(".toml");
    let folder = file.and_then(|file| std::path::Path::new(file).parent());
    match folder.filter(|_| is_file) {
        // A path with `/` is always a file.
        Some(folder) => folder.join(scene).to_string_lossy().into_owned(),
        None => scene.to_owned(),
    }
}

/// Parses a camera target.
fn parse_camera_target(word: &str, scene: &Scene) -> Result<CameraTarget, String> {
    let joints = || scene.machine.loose_joints.iter().map(|joint| &*joint.name);
    if let Some(joint) = joints().position(|name| name == word) {
        return Ok(CameraTarget::At(joint));
    }
    let name = |preset: &Preset| preset.label().to_lowercase();
    let found = Preset::ALL.into_iter().find(|preset| name(preset) == word);
    found.map(CameraTarget::From).ok_or_else(|| {
        let presets = Preset::ALL.iter().map(name);
        let known: Vec<String> = presets.chain(joints().map(str::to_owned)).collect();
        format!("no such view; allowed: {}", known.join(", "))
    })
}
