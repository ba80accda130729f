//! Reference runs recorded before a change, as the window handles them: retain, and show beside the current machine.

use eframe::egui::{self, Align2, Button, Rect, Ui, pos2, vec2};

use super::overlay::Room;
use super::run::Run;
use super::viewport::Viewport;

/// The two halves of `area`: the machine before the change, and the current one.
fn halves(area: Rect) -> (Rect, Rect) {
    let middle = area.center();
    if area.width() >= area.height() {
        (area.with_max_x(middle.x - 1.0), area.with_min_x(middle.x + 1.0))
    } else {
        (Rect::from_min_max(area.min, pos2(area.right(), middle.y - 1.0)), area.with_min_y(middle.y + 1.0))
    }
}

/// Picture of a run from before a change, and that run's number.
pub type Beside = Option<(u64, Box<Viewport>)>;

impl Run {
    /// Retains the run from before the latest change, except during a lesson, whose text refers to its own plots. `is_over`: the
    /// gesture that caused the change has ended.
    pub(super) fn compare(&mut self, is_over: bool, in_lesson: bool) {
        let comparison = &mut self.plots.comparison;
        let wanted = comparison.is_on() && !in_lesson;
        if let Some((run, key)) = self.player.take_copy_before_change(wanted, is_over).filter(|_| wanted) {
            comparison.add(run, key);
        }
    }

    /// Advances the reference runs, and the picture of the displayed one, by `dt` seconds. Returns whether one of them still lags
    /// behind.
    pub(super) fn advance_earlier_runs(&mut self, dt: f32) -> bool {
        let Self { plots, player, beside, .. } = self;
        let before = plots.comparison.beside().map(|(earlier, _)| earlier.run().pacer.shown());
        let lags = plots.comparison.advance(player, f64::from(dt));
        if let (Some((earlier, _)), Some((_, picture))) = (plots.comparison.beside(), beside) {
            picture.advance(earlier.run(), dt);
            if !player.is_playing() && before != Some(earlier.run().pacer.shown()) {
                picture.restore_marks(earlier.run());
            }
        }
        lags
    }

    /// The halves of `area` for the machine before the change and the current one, if both are shown.
    pub(super) fn halves(&mut self, area: Rect) -> Option<[Rect; 2]> {
        self.plots.comparison.beside().is_some().then(|| halves(area).into())
    }

    /// Shows the machine before the change in `area` on request, with as much `room` for widgets as the current one has.
    pub(super) fn picture_before(&mut self, ui: &mut Ui, area: Option<Rect>, plain: bool, room: Room) {
        let Self { plots, player, viewport, beside, .. } = self;
        let Some(((earlier, number), area)) = plots.comparison.beside().zip(area) else {
            (viewport.title, viewport.common, *beside) = (None, None, None);
            return;
        };
        if plain {
            earlier.run_mut().follow(player.pacer.shown(), || true);
            earlier.run_mut().publish_peaks();
        }
        let (_, picture) = match beside.take().filter(|(of, _)| *of == number) {
            Some(shown) => beside.insert(shown),
            None => {
                let mut picture = Box::new(Viewport::beside(earlier.run()));
                picture.restore_marks(earlier.run());
                beside.insert((number, picture))
            }
        };
        picture.copy_view(viewport);
        let common = viewport.reference().max(picture.reference());
        (viewport.common, picture.common) = (Some(common), Some(common));
        picture.title = Some(format!("before: {}", earlier.name()));
        viewport.title = Some(format!("now: {}", earlier.named_in(player)));
        let mut place = ui.new_child(egui::UiBuilder::new().max_rect(area).id_salt("before"));
        picture.hides_time = viewport.hides_time;
        let close = vec2(70.0, ui.spacing().interact_size.y);
        let room = Room { notes: viewport.notes(player), ..room };
        let strips = picture.ui(&mut place, earlier.run(), plain, room);
        viewport.copy_camera(picture);
        picture.take_clicked();
        if let Some(pull) = picture.take_pull() {
            // A body that cannot be pulled stays unchanged.
            let _ = earlier.run_mut().pull(pull);
        }
        let close =
            Align2::RIGHT_CENTER.align_size_within_rect(close, strips.top.with_max_x(strips.top.right() - 10.0));
        if !plain && ui.put(close, Button::new("Close")).on_hover_text("Show only the current machine").clicked() {
            plots.comparison.hide_comparison();
            viewport.fit();
        }
    }

    /// Asks for another frame if the names of the picture have moved, which those of the picture before the change follow.
    pub(super) fn follow_names(&self, ctx: &egui::Context) {
        if self.beside.as_ref().is_some_and(|(_, picture)| picture.lags_behind_names_of(&self.viewport)) {
            ctx.request_repaint();
        }
    }
}
