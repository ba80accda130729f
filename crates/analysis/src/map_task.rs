//! A map of the tip's error as plain data, for a thread or a worker.

use serde::{Deserialize, Serialize};

use super::map::{DIRECTIONS, MapPoint, WorkspaceMap};
use super::source::{SceneSource, TaskFault};
use super::task::Message;
use jointplay_physics::machine::Vec3;

/// Largest number of points that the window shows.
pub const MAX_POINTS: usize = 5000;

/// A request for a map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapTask {
    /// The scene.
    pub scene: SceneSource,
    /// Axes of the map, as in `map --over`.
    pub over: Vec<String>,
    /// Number of directions at each point.
    pub directions: usize,
}

/// Errors of the tip at a point, world axes, m.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TipErrors {
    /// Tip without play.
    pub tip: [f64; 3],
    /// Error at rest, if there is a rest position.
    pub settled: Option<[f64; 3]>,
    /// Largest error that is reachable with every ball anywhere in its play.
    pub largest: Option<[f64; 3]>,
}

impl TipErrors {
    fn of(point: &MapPoint) -> Self {
        let plain = |v: &Vec3| [v.x, v.y, v.z];
        let largest = point.largest.as_ref().and_then(|largest| largest.error.as_ref());
        Self {
            tip: plain(&point.ideal_tip),
            settled: point.settled.as_ref().ok().map(plain),
            largest: largest.map(plain),
        }
    }
}

/// Computes `task` point by point and awaits `rest` after each.
pub(super) async fn run(
    task: &MapTask,
    send: &mut dyn FnMut(Message) -> Result<(), TaskFault>,
    rest: &mut impl AsyncFnMut(),
) -> Result<(), TaskFault> {
    let directions = task.directions.clamp(*DIRECTIONS.start(), *DIRECTIONS.end());
    let map = WorkspaceMap::new(task.scene.scene()?, &task.over, directions)?;
    let points = map.design().points();
    if points > MAX_POINTS {
        return Err(TaskFault::TooManyPoints { points, most: MAX_POINTS });
    }
    let axes = map.design().axes().iter();
    let axes = axes.map(|axis| (axis.key().to_owned(), axis.numbers().collect()));
    send(Message::Axes(axes.collect()))?;
    for point in 0..points {
        send(Message::MapPoint(map.point(point).ok().as_ref().map(TipErrors::of)))?;
        send(Message::Progress((point + 1) as f64 / points as f64))?;
        rest().await;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::*;
    use crate::task::{Job, Message, perform};
    use jointplay_scene::Scene;

    /// The first messages of a map, up to `limit`, after which it is cancelled.
    fn messages(over: &[&str], limit: usize) -> Vec<Message> {
        let scene = Scene::load("four-bar", &[]).expect("built in");
        let over = over.iter().map(|&text| text.to_owned()).collect();
        let job = Job::Map(MapTask { scene: SceneSource::of(&scene), over, directions: 4 });
        // A job must survive its serialisation as text.
        let job: Job = serde_json::from_str(&serde_json::to_string(&job).expect("plain data")).expect("its own text");
        let mut messages = Vec::new();
        perform(&job, &mut |message| {
            messages.push(message);
            if messages.len() < limit { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        messages
    }

    #[test]
    fn a_map_reports_its_axes_then_its_points_and_ends_when_cancelled() {
        let over = ["crank.angle=0deg,90deg,180deg", "contact.clearance=0.1mm,0.2mm"];
        let all = messages(&over, usize::MAX);
        assert_eq!((all.len(), all.last()), (14, Some(&Message::Done)));
        let Message::Axes(axes) = &all[0] else { panic!("{all:?}") };
        assert_eq!((&axes[0].0[..], axes[1].1.len()), ("crank.angle", 2));
        let errors = |message: &Message| match message {
            Message::MapPoint(Some(errors)) => errors.clone(),
            other => panic!("{other:?}"),
        };
        // Twice the play doubles the error and leaves the ideal tip unchanged.
        let (one, two) = (errors(&all[1]), errors(&all[3]));
        assert_eq!(one.tip, two.tip);
        let size = |errors: &TipErrors| Vec3::from(errors.largest.expect("an error")).norm();
        assert!((size(&two) / size(&one) - 2.0).abs() < 0.01);
        assert_eq!(messages(&over, 3), all[..3]);
        let refused = messages(&["crank.angle=0deg..1deg:9999"], usize::MAX);
        assert!(matches!(&refused[..], [Message::Failed(why)] if why.contains("9999 points")), "{refused:?}");
    }
}
