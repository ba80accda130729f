//! Surfaces of joints with play that wear.
//!
//! Archard (1953, J. Appl. Phys. 24, 981): what a contact removes in a time is k N |v|, with the normal force N and the sliding velocity v
//! of the two surfaces. Flores (2009, Mech. Mach. Theory 44, 1211) has it in the clearance joints of multibody systems. Wear is even, with
//! the volume taken off the whole surface that the play is between, so that its depth, volume over area, is what the play grows by, and
//! walls stay spheres, cylinders and planes; or by direction (`mechanism/loose/profile.rs`). k is the sum of those of both parts, whose
//! shares do not matter to the play. Depths are small against radii: the areas are those of the part inside, without the play.

use std::f64::consts::PI;

use super::{LooseFault, LooseJoint, LooseKind, Pin, Slide};
use crate::contact::{Elasticity, Parameters};

impl LooseKind {
    /// Area over which play `play` of a joint with the contact parameters `contact` wears, m^2: the sphere 4 pi r^2 of a ball; the
    /// cylinder 2 pi r L of a pin; the faces of both its collars, from the pin's radius to that of the faces; both faces of a block
    /// across the play. `None` where the joint does not tell it.
    pub fn wearing_area(&self, contact: &Parameters, play: usize) -> Option<f64> {
        let radius = contact.ball_radius;
        match (*self, play) {
            (Self::Ball, _) => Some(4.0 * PI * radius * radius),
            (Self::Pin(pin), 0) => {
                let length = pin.length_by(contact);
                length.map(|length| 2.0 * PI * radius * length)
            }
            (Self::Pin(pin), _) => {
                let ring = |outer: f64| 2.0 * PI * (outer * outer - radius * radius);
                pin.face_radius.filter(|outer| *outer > radius).map(ring)
            }
            // Each of the two faces is 2 l by 2 h.
            (Self::Slide(slide), 0) => slide.half_height.map(|height| 8.0 * slide.half_length * height),
            (Self::Slide(slide), _) => Some(8.0 * slide.half_length * slide.half_width),
        }
    }

    /// What the joint must tell for play `play` to wear: a key, and why it is missing.
    fn missing_area(&self, play: usize) -> (&'static str, &'static str) {
        match self {
            Self::Pin(Pin { .. }) if play == 0 => (
                "play.length",
                "a planar pin has a length only with play.length and elastic = \"line\" or stiffness_at",
            ),
            Self::Slide(Slide { .. }) => ("play.half_z", "a planar block has no height"),
            Self::Ball | Self::Pin(_) => {
                ("play.face_radius", "its collars have no play.face_radius above the radius of the pin")
            }
        }
    }
}

impl Pin {
    /// Length L, m, of a pin with these contact parameters, if it has one: one that stays in its plane only where its elastic law needs it.
    pub(crate) fn length_by(&self, contact: &Parameters) -> Option<f64> {
        self.length.or(match contact.elasticity {
            Elasticity::Line { length } | Elasticity::StiffnessAt { length, .. } => Some(length),
            Elasticity::Sphere | Elasticity::Stiffness(_) => None,
        })
    }
}

impl LooseJoint {
    /// Length of its pin, m, if it tells one.
    pub fn pin_length(&self) -> Option<f64> {
        match self.kind {
            LooseKind::Pin(pin) => pin.length_by(&self.contact),
            LooseKind::Ball | LooseKind::Slide(_) => None,
        }
    }

    /// Whether it has walls that wear by direction: the profiles of these are part of the state.
    pub fn wears_by_direction(&self) -> bool {
        self.contact.has_profile() && !matches!(self.kind, LooseKind::Slide(_))
    }

    /// Checks that all its plays have a surface, if they wear.
    pub(super) fn check_wear(&self) -> Result<(), LooseFault> {
        let value = self.contact.wear_coefficient;
        if !(value >= 0.0 && value.is_finite()) {
            return Err(LooseFault::WearCoefficient(value));
        }
        for (play, clearance) in self.contact.clearances().into_iter().enumerate() {
            if value > 0.0 && clearance > 0.0 && self.kind.wearing_area(&self.contact, play).is_none() {
                let (key, why) = self.kind.missing_area(play);
                return Err(LooseFault::NoWearingArea { key, why });
            }
        }
        Ok(())
    }
}
