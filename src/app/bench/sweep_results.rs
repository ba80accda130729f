//! A sweep of the bench and its results.

use crate::analysis::design::Start;
use crate::analysis::sweep_task::{Range, SweepTask, SweptPoint};
use crate::app::player::Player;
use crate::app::value;
use crate::scene::{Kind, Parameter, Scene, Value};

/// A started sweep and its results so far.
pub struct SweepResults {
    /// The requested task.
    pub task: SweepTask,
    /// The varied parameter.
    pub range: Range,
    /// Points by number; `None` for pending points.
    pub points: Vec<Option<SweptPoint>>,
    /// The swept scene, without the varied parameter.
    pub(super) scene: Option<Scene>,
}

impl SweepResults {
    /// The varied parameter as defined in the swept scene.
    pub(super) fn parameter(&self) -> Option<&'static Parameter> {
        self.scene.as_ref()?.parameter(&self.range.key).ok()
    }

    /// Description of the sweep: scene, changed parameters, range, periods.
    pub(super) fn caption(&self) -> String {
        let Self { task, range, .. } = self;
        let varied = [range.key.clone()];
        let scene = self.scene.as_ref();
        let scene = scene.map_or_else(String::new, |scene| value::scene_line(scene, &varied));
        let parameter = self.parameter();
        let label = parameter.map_or_else(|| range.key.clone(), |p| p.label.to_lowercase());
        let end = |si| match parameter.map(|p| (p, &p.kind)) {
            Some((_, Kind::Count { .. })) | None => value::number(si, 6),
            Some((parameter, _)) => parameter.show(&Value::Number(si)),
        };
        format!(
            "{scene}; {label} {} to {}, {} values; {} periods of which {} discarded, phase {}°, start {}",
            end(range.from),
            end(range.to),
            range.count,
            task.periods,
            task.discard,
            value::number(360.0 * task.phase, 4),
            start_label(task.start),
        )
    }

    /// Differences from the displayed scene, one phrase each.
    pub(super) fn differences(&self, player: &Player) -> Vec<String> {
        let varied = [self.range.key.clone()];
        let scene = self.scene.as_ref();
        scene.map_or_else(Vec::new, |scene| value::differences(scene, player.pending(), &varied))
    }
}

pub(super) fn start_label(start: Start) -> &'static str {
    match start {
        Start::Cold => "as in file",
        Start::FollowUp => "follow upwards",
        Start::FollowDown => "follow downwards",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::ready_sweeps::READY_SWEEPS;

    #[test]
    fn the_axis_of_a_swept_parameter_of_the_file_has_its_title_and_unit() {
        let ready = &READY_SWEEPS[0];
        let scene = ready.scene().expect("a built-in scene");
        let range = Range { key: ready.key.to_owned(), from: 21.0, to: 45.0, count: ready.values };
        let results = SweepResults { task: ready.task(&scene), range, points: Vec::new(), scene: Some(scene) };
        let parameter = results.parameter().expect("a parameter of the file");
        assert_eq!((parameter.label, parameter.display_unit()), ("Crank speed", "rad/s"));
        assert!(results.caption().contains("crank speed 21 rad/s to 45 rad/s, 25 values"), "{}", results.caption());
    }
}
