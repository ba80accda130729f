//! Map of the tip's error over the workspace: its axes, its computation, and the arrows in the picture.

use eframe::egui::{RichText, Slider, TextEdit, Ui};

use super::computation::Computation;
use super::in_words;
use crate::analysis::map_task::{MapTask, TipErrors};
use crate::analysis::source::SceneSource;
use crate::analysis::task::{Job, Message};
use crate::app::host::Host;
use crate::app::layout::{self, reserve_lines};
use crate::app::player::Player;
use crate::app::{theme, value};
use crate::machine::{Drive, Machine, Vec3};
use crate::mechanism::drive_positions;
use crate::units::format_quantity_digits;
use crate::view::{Cloud, to_f32};

/// Number of directions searched at each point; the search for the largest error starts from the best of them.
const DIRECTIONS: usize = 16;
/// Range and initial value of the scale.
const SCALE_RANGE: std::ops::RangeInclusive<f32> = 1.0..=1000.0;
const INITIAL_SCALE: f32 = 100.0;
/// Largest number of drives that vary initially.
const MAX_DRIVES: usize = 3;

/// The error that the map shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum ShownError {
    #[default]
    Largest,
    Settled,
}

impl ShownError {
    const ALL: [Self; 2] = [Self::Largest, Self::Settled];

    fn name(self) -> &'static str {
        match self {
            Self::Largest => "largest error",
            Self::Settled => "settled error",
        }
    }

    /// Remark in the picture.
    fn note(self) -> &'static str {
        match self {
            Self::Largest => ", contact ignored",
            Self::Settled => "",
        }
    }

    fn help(self) -> &'static str {
        match self {
            Self::Largest => {
                "Largest error of the tip with every ball, pin and block anywhere in its play and the drives held. Contact between bodies, \
                 springs, loads and inertia are ignored."
            }
            Self::Settled => "Error of the tip at rest, under gravity, springs and loads, without friction.",
        }
    }

    fn of(self, errors: &TipErrors) -> Option<[f64; 3]> {
        match self {
            Self::Largest => errors.largest,
            Self::Settled => errors.settled,
        }
    }
}

/// Axes of the first drives, one per line: around their positions at t = 0, or a full turn if the only drive is a rotating crank.
fn default_axes(machine: &Machine) -> String {
    let driven = || machine.joints.iter().flat_map(|joint| joint.drives().map(move |drive| (joint, drive)));
    let is_only_drive = driven().nth(1).is_none();
    let axes = driven().zip(drive_positions(machine)).take(MAX_DRIVES).map(|((joint, (freedom, drive)), at)| {
        let full_turn = is_only_drive && matches!(drive, Drive::Constant { velocity, .. } if *velocity != 0.0);
        let (unit, ends, count) = match (freedom.turns(), full_turn) {
            (true, true) => ("deg", [0.0, 345.0_f64.to_radians()], 24),
            (true, false) => ("deg", [-1.0, 1.0].map(|side: f64| side * 10.0_f64.to_radians()), 5),
            (false, _) => ("mm", [-0.01, 0.01], 5),
        };
        let [from, to] = ends.map(|end| format_quantity_digits(at + end, unit, 4));
        format!("{}.{}={from}..{to}:{count}", joint.name, freedom.word())
    });
    axes.collect::<Vec<_>>().join("\n")
}

/// A map so far.
struct PartialMap {
    task: MapTask,
    axes: Vec<(String, Vec<f64>)>,
    points: Vec<Option<TipErrors>>,
}

impl PartialMap {
    /// Index of `point` along `axis`.
    fn index(&self, axis: usize, point: usize) -> usize {
        let below: usize = self.axes[axis + 1..].iter().map(|(_, values)| values.len()).product();
        point / below % self.axes[axis].1.len()
    }
}

/// The panel.
pub struct MapPanel {
    /// Name of the scene that `over` belongs to, and what varies, one axis per line.
    scene: String,
    over: String,
    pub(super) computation: Computation<MapTask>,
    mapped: Option<PartialMap>,
    shown_error: ShownError,
    scale: f32,
    /// Indices of the fixed axis and of its value.
    slice: Option<(usize, usize)>,
    /// Whether the panel was open when it was last drawn.
    shown: bool,
}

impl Default for MapPanel {
    fn default() -> Self {
        Self {
            scene: String::new(),
            over: String::new(),
            computation: Computation::default(),
            mapped: None,
            shown_error: ShownError::default(),
            scale: INITIAL_SCALE,
            slice: None,
            shown: false,
        }
    }
}

impl MapPanel {
    /// Starts a requested map and takes messages from a running one; returns whether one is running.
    pub fn update(&mut self, host: &mut dyn Host) -> bool {
        let Self { computation, mapped, .. } = self;
        let take = |task: &MapTask, message| match message {
            Message::Axes(axes) => *mapped = Some(PartialMap { task: task.clone(), axes, points: Vec::new() }),
            Message::MapPoint(point) => {
                if let Some(mapped) = mapped {
                    mapped.points.push(point);
                }
            }
            _ => {}
        };
        let explain = |task: &MapTask, why: String| in_words(&why, "--over", &task.over);
        computation.update(host, "Maps", |_| 1, |task, _| Job::Map(task), take, explain)
    }

    /// The arrows of the map of the displayed scene; `None` if the panel was closed in the latest frame.
    pub fn take_cloud(&mut self, player: &Player) -> Option<Cloud> {
        let shown = std::mem::take(&mut self.shown);
        let mapped = self.mapped.as_ref().filter(|_| shown)?;
        if mapped.task.scene != SceneSource::of(player.pending()) {
            return None;
        }
        let vector = |v: [f64; 3]| to_f32(&Vec3::from(v));
        let points = mapped.points.iter().enumerate();
        let points = points.filter(|(point, _)| self.slice.is_none_or(|(axis, at)| mapped.index(axis, *point) == at));
        let arrows = points.filter_map(|(_, errors)| {
            let errors = errors.as_ref()?;
            Some([vector(errors.tip), vector(self.shown_error.of(errors)?)])
        });
        Some(Cloud {
            arrows: arrows.collect(),
            factor: self.scale,
            name: self.shown_error.name(),
            note: self.shown_error.note(),
        })
    }

    /// Axes, progress, and display options.
    pub fn ui(&mut self, ui: &mut Ui, player: &Player) {
        self.shown = true;
        let scene = player.pending();
        if self.scene != scene.name {
            (self.scene, self.over) = (scene.name.clone(), default_axes(&scene.machine));
        }
        ui.label("Over").on_hover_text(
            "One axis per line, all combined: a driven coordinate at which the drive is held, such as \
             crank.angle=0deg..345deg:24, or a parameter, such as contact.clearance=0.1mm,0.2mm",
        );
        ui.add(TextEdit::multiline(&mut self.over).desired_rows(3).desired_width(f32::INFINITY))
            .on_hover_text("What varies, as in `jointplay map --over`")
            .accessible_name("Axes of the map");
        self.start_ui(ui, player);
        reserve_lines(ui, "map says", 2, |ui| self.state_ui(ui, player));
        ui.horizontal_wrapped(|ui| {
            for shown_error in ShownError::ALL {
                let mut name = shown_error.name().to_owned();
                name[..1].make_ascii_uppercase();
                ui.selectable_value(&mut self.shown_error, shown_error, name).on_hover_text(shown_error.help());
            }
        });
        ui.horizontal(|ui| {
            ui.label("Scale");
            ui.add(
                Slider::new(&mut self.scale, SCALE_RANGE).logarithmic(true).custom_formatter(|x, _| format!("×{x:.0}")),
            )
            .on_hover_text("Length of an arrow over that of the error")
            .accessible_name("Scale of the arrows");
        });
        self.slice_ui(ui);
    }

    fn start_ui(&mut self, ui: &mut Ui, player: &Player) {
        let help = "Computes the error of the tip at every point in the background; the run is not affected";
        let stop = ["Cancel", "End the computation; the points so far stay"];
        if self.computation.button(ui, ["Map tip error", help], stop, ["Computed so far", "points"]) {
            (self.mapped, self.slice) = (None, None);
            let over = self.over.lines().map(str::trim).filter(|line| !line.is_empty());
            self.computation.requested = Some(MapTask {
                scene: SceneSource::of(player.pending()),
                over: over.map(str::to_owned).collect(),
                directions: DIRECTIONS,
            });
        }
    }

    fn state_ui(&self, ui: &mut Ui, player: &Player) {
        if let Some(problem) = &self.computation.problem {
            theme::error(ui, problem);
            return;
        }
        let Some(mapped) = &self.mapped else {
            ui.label(RichText::new("No map yet").small().weak());
            return;
        };
        if mapped.task.scene != SceneSource::of(player.pending()) {
            theme::warning(ui, "This map belongs to other values of the parameters, and is not drawn");
            return;
        }
        let posed = mapped.points.iter().flatten().count();
        let words = match mapped.points.len() - posed {
            0 => format!("{posed} points"),
            none => format!("{posed} points; {none} without a pose of the machine without play"),
        };
        ui.label(RichText::new(words).small()).on_hover_text("Arrows begin at the tip of the machine without play");
    }

    /// Selection of the fixed axis and its value.
    fn slice_ui(&mut self, ui: &mut Ui) {
        let Some(mapped) = self.mapped.as_ref().filter(|mapped| mapped.axes.len() > 1) else {
            return;
        };
        ui.horizontal_wrapped(|ui| {
            let mut axis = self.slice.map(|(axis, _)| axis);
            let names = ["Slice", "Axis that is fixed, so that only a slice of the map is drawn"];
            let all = [None].into_iter().chain((0..mapped.axes.len()).map(Some));
            let label = |axis: Option<usize>| axis.map_or("whole map", |axis| &*mapped.axes[axis].0);
            layout::choice(ui, names, None, &mut axis, all, label);
            let at = self.slice.filter(|(own, _)| Some(*own) == axis).map_or(0, |(_, at)| at);
            self.slice = axis.map(|axis| (axis, at));
            if let Some((axis, at)) = &mut self.slice {
                let values = &mapped.axes[*axis].1;
                let shown = |n: f64| values.get(n as usize).map_or_else(String::new, |si| value::number(*si, 4));
                ui.add(Slider::new(at, 0..=values.len() - 1).custom_formatter(|n, _| shown(n)))
                    .on_hover_text("Value at which the axis is fixed, in SI units")
                    .accessible_name("Value of the slice");
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::*;
    use crate::analysis::map::WorkspaceMap;
    use crate::analysis::task::perform;
    use crate::app::host::BackgroundTask;
    use crate::app::{DroppedFile, OpenedFile};
    use crate::scene::Scene;

    /// Messages of a job that has already been computed.
    struct Done(std::vec::IntoIter<Message>);

    impl BackgroundTask for Done {
        fn poll(&mut self) -> Option<Message> {
            self.0.next()
        }

        fn rest(&mut self, _rest: f64) {}

        fn cancel(&mut self) {}
    }

    /// Computes jobs at once.
    struct AtOnce;

    impl Host for AtOnce {
        fn read_dropped(&mut self, _files: Vec<DroppedFile>) {}

        fn opened(&mut self) -> Option<Vec<OpenedFile>> {
            None
        }

        fn start(&mut self, job: Job) -> Option<Box<dyn BackgroundTask>> {
            let mut messages = Vec::new();
            perform(&job, &mut |message| {
                messages.push(message);
                ControlFlow::Continue(())
            });
            Some(Box::new(Done(messages.into_iter())))
        }
    }

    #[test]
    fn arrows_are_the_errors_of_the_map_and_a_slice_is_a_part_of_them() {
        let scene = Scene::load("four-bar", &[]).expect("built in");
        let player = Player::new(&scene).expect("starts");
        let over = ["crank.angle=0deg..90deg:3".to_owned(), "contact.clearance=0.1mm,0.2mm".to_owned()];
        let task = MapTask { scene: SceneSource::of(&scene), over: over.to_vec(), directions: DIRECTIONS };
        let mut panel = MapPanel::default();
        panel.computation.requested = Some(task);
        assert!(!panel.update(&mut AtOnce), "it is done");
        assert_eq!(panel.take_cloud(&player), None, "the panel is closed");
        let map = WorkspaceMap::new(scene.clone(), &over, DIRECTIONS).expect("six points");
        let shown = |panel: &mut MapPanel| {
            panel.shown = true;
            panel.take_cloud(&player).expect("the map is of this scene")
        };
        for shown_error in ShownError::ALL {
            panel.shown_error = shown_error;
            let cloud = shown(&mut panel);
            assert_eq!((cloud.arrows.len(), cloud.factor), (6, INITIAL_SCALE));
            for (point, [tip, error]) in cloud.arrows.iter().enumerate() {
                let own = map.point(point).expect("a pose");
                let expected = match shown_error {
                    ShownError::Largest => own.largest.and_then(|largest| largest.error).expect("an error"),
                    ShownError::Settled => own.settled.expect("a position of rest"),
                };
                assert_eq!((*tip, *error), (to_f32(&own.ideal_tip), to_f32(&expected)));
            }
        }
        let all = shown(&mut panel).arrows;
        panel.slice = Some((1, 1));
        assert_eq!(shown(&mut panel).arrows, [all[1], all[3], all[5]]);
        panel.slice = Some((0, 2));
        assert_eq!(shown(&mut panel).arrows, all[4..]);
        // A map of other parameter values is not drawn.
        let other =
            Scene::load("four-bar", &[("contact.clearance".to_owned(), "0.3 mm".to_owned())]).expect("built in");
        let other = Player::new(&other).expect("starts");
        panel.shown = true;
        assert_eq!(panel.take_cloud(&other), None);
    }

    #[test]
    fn default_axes_are_positions_of_the_first_drives() {
        let scene = Scene::load("hexapod", &[]).expect("built in");
        let over: Vec<String> = default_axes(&scene.machine).lines().map(str::to_owned).collect();
        assert_eq!(over.len(), MAX_DRIVES);
        let map = WorkspaceMap::new(scene, &over, 2).expect("it reads them");
        assert!(map.point(0).is_ok() && map.point(62).is_ok());
        let crank = Scene::load("four-bar", &[]).expect("built in");
        assert!(default_axes(&crank.machine).ends_with("deg:24"), "{}", default_axes(&crank.machine));
    }
}
