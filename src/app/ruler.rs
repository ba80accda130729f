//! The scale of the force arrows in the window: how it follows the forces, and that it says so when it changes.

/// Time for which a new scale is told, s.
const TOLD: f64 = 2.0;
/// Ratio of the scale to the one that would fit above which it falls.
const FALLS_BY: f32 = 5.0;

/// The scale of one picture's arrows over time.
#[derive(Default)]
pub struct RulerScale {
    /// Whether it only grows.
    grows_only: bool,
    /// Force of the reference length in the latest picture, N.
    shown: Option<f32>,
    /// When it last changed, s of viewing.
    changed: Option<f64>,
}

impl RulerScale {
    /// Whether it only grows from now on.
    pub fn only_grows(&mut self, on: bool) {
        self.grows_only = on;
    }

    /// The force of the reference length, N, where `automatic` would fit the recent forces: the latest one until it is too small or far
    /// too large, so that lengths can be compared for longer.
    pub fn follow(&self, automatic: f32) -> f32 {
        let keeps = |shown: &f32| *shown >= automatic && (self.grows_only || *shown <= FALLS_BY * automatic);
        self.shown.filter(keeps).unwrap_or(automatic)
    }

    /// Takes the scale of a picture drawn at `now`, s of viewing: the force `reference`, N, of the reference length, or `None` if no
    /// force is known. Returns how long it is still new, s.
    pub fn show(&mut self, reference: Option<f32>, now: f64) -> Option<f64> {
        if let Some(reference) = reference {
            if self.shown.is_some_and(|before| before != reference) {
                self.changed = Some(now);
            }
            self.shown = Some(reference);
        }
        let left = self.changed? + TOLD - now;
        self.changed = self.changed.filter(|_| left > 0.0);
        self.changed.map(|_| left)
    }

    /// Whether it was still new in the latest picture.
    pub fn is_new(&self) -> bool {
        self.changed.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_grows_at_once_and_falls_when_it_is_far_too_large_or_never() {
        let mut scale = RulerScale::default();
        assert_eq!(scale.follow(100.0), 100.0);
        scale.show(Some(100.0), 0.0);
        assert_eq!([200.0, 50.0, 20.0, 10.0].map(|fits| scale.follow(fits)), [200.0, 100.0, 100.0, 10.0]);
        scale.only_grows(true);
        assert_eq!([200.0, 50.0, 20.0, 10.0].map(|fits| scale.follow(fits)), [200.0, 100.0, 100.0, 100.0]);
    }

    #[test]
    fn a_new_scale_is_told_for_two_seconds() {
        let mut scale = RulerScale::default();
        assert_eq!(scale.show(None, 0.0), None);
        assert_eq!(scale.show(Some(50.0), 0.1), None, "the first is not new");
        assert_eq!(scale.show(Some(50.0), 5.0), None);
        assert_eq!(scale.show(Some(100.0), 6.0), Some(2.0));
        assert_eq!(scale.show(Some(100.0), 7.5), Some(0.5));
        assert_eq!(scale.show(None, 7.75), Some(0.25), "also while no force is known");
        assert_eq!(scale.show(Some(20.0), 7.9), Some(2.0), "and again after another change");
        assert_eq!(scale.show(Some(20.0), 9.9), None);
        assert_eq!(scale.show(Some(20.0), 9.95), None);
    }
}
