//! The ghosts of the 3D view (twin run, ideal motion) and their notes.

use eframe::egui::Ui;

use super::player::Player;
use super::run::Run;
use super::{theme, value};
use crate::view::{DrawList, Ghost, SceneView, Shot};

/// Most notes on the ghosts of `player`; the room for them does not change while one is computed.
pub fn most_notes(player: &Player) -> usize {
    usize::from(player.twin().is_some()) + 2 * usize::from(player.ideal().is_some())
}

/// Adds the ghosts at the displayed instant to the draw list built from `shot`; returns a note on each.
pub fn add(view: &SceneView, shot: &Shot<'_>, player: &Player, list: &mut DrawList) -> Vec<String> {
    let mut notes = Vec::new();
    let mut note = |ghost: &str, is_apart: bool| {
        let near = if is_apart { "" } else { ", under a pixel away" };
        notes.push(format!("{ghost}{near}"));
    };
    let now = player.frame().time;
    // A twin that starts at the end of the displayed step is not visible yet.
    if let Some(twin) = player.twin().filter(|twin| twin.frame().time <= now) {
        let is_apart = view.add_ghost(shot, twin.frame(), Ghost::Twin, list);
        note("violet ghost: the twin run", is_apart);
    }
    let Some(ideal) = player.ideal() else {
        return notes;
    };
    if let Some(frame) = ideal.frame(now) {
        let is_apart = view.add_ghost(shot, frame, Ghost::Ideal, list);
        view.add_output_error(shot, frame, list);
        note("pale ghost: ideal joints", is_apart);
        if let Some(error) = ideal.output_error(player.frame()) {
            let length = value::quantity(error.norm(), "um", 4);
            notes.push(format!("tip error {length}"));
        }
    } else if ideal.error_message().is_some() {
        notes.push("no ideal ghost: see View options".to_owned());
    } else {
        notes.push("computing the ideal ghost".to_owned());
    }
    notes
}

impl Run {
    /// Shows or hides the ideal ghost.
    ///
    /// # Errors
    /// There is none; the message says why.
    pub fn show_ideal(&mut self, on: bool) -> Result<(), String> {
        self.player.set_ideal(on);
        self.ideal_fault().map_or(Ok(()), Err)
    }

    /// Why there is no ideal ghost although it was asked for.
    fn ideal_fault(&self) -> Option<String> {
        let fault = self.player.ideal()?.error_message()?;
        Some(format!("No ideal ghost: {fault}"))
    }

    /// Switch for the ideal ghost in the view menu; returns whether to toggle it.
    pub(super) fn ideal_switch(&self, ui: &mut Ui) -> bool {
        let mut on = self.player.ideal().is_some();
        let help = "The same machine with all joints ideal, the same drives and gravity, drawn pale over the run. An \
                    arrow from its tip to that of the run shows the tip error (key G), which the plot Tip error \
                    records, with or without the ghost. The run itself is not affected.";
        let toggled = ui.checkbox(&mut on, "Ideal ghost").on_hover_text(help).changed();
        if let Some(fault) = self.ideal_fault() {
            theme::warning(ui, fault);
        }
        toggled
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::Machine;
    use crate::scene::Scene;
    use crate::session::ideal::output_point;
    use crate::simulate::{Frame, Simulation, closed};
    use crate::view::{LabelKind, PeakMarks, ViewOptions, to_f32};

    #[test]
    fn the_arrow_and_its_note_are_the_distance_of_two_separate_runs() {
        let scene = Scene::load("slider-crank", &[]).expect("built in");
        let mut player = Player::new(&scene).expect("starts");
        player.set_ideal(true);
        player.run_to(0.06);
        player.update_ghosts();
        let time = player.frame().time;
        let tip = |machine: &Machine| {
            let mut frame = Frame::default();
            let mut run = Simulation::new(machine).expect("starts");
            run.advance_to(time).expect("runs");
            run.sample(time, &mut frame);
            output_point(&machine.output, &frame).expect("has a body")
        };
        let (ideal, error) = (tip(&closed(&scene.machine)), tip(&scene.machine) - tip(&closed(&scene.machine)));
        let view = SceneView::new(&scene, player.frame());
        let (marks, camera) = (PeakMarks::new(), view.camera());
        for magnification in [1.0, 10.0] {
            let options = ViewOptions { magnification, ..ViewOptions::default() };
            let shot = Shot {
                scene: &scene,
                frame: player.frame(),
                marks: &marks,
                options: &options,
                camera: &camera,
                trail: &[],
                size: [1280, 720],
                pixels_per_point: 1.0,
            };
            let mut list = DrawList::default();
            view.build(&shot, &mut list);
            let notes = add(&view, &shot, &player, &mut list);
            let length = value::number(error.norm() * 1e6, 4);
            assert!(notes.contains(&format!("tip error {length} µm")), "{notes:?}");
            let label = list.labels.iter().find(|l| l.kind == LabelKind::Error);
            let label = label.expect("in the picture");
            let drawn = if magnification > 1.0 { ", drawn ×10" } else { "" };
            assert_eq!(*label.text, *format!("tip error {length} µm{drawn}"));
            let head = to_f32(&ideal) + to_f32(&error) * magnification;
            assert!(label.anchor.distance(head) < 1e-6, "{head}");
        }
    }
}
