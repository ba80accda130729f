//! Motions that drives prescribe: each law a function of time with exact first and second derivatives. One file per family;
//! what they read from a scene is in `scene/drives.rs`.

mod bump;
mod formula;
mod harmonic;
mod line;
mod table;

use std::fmt::Debug;
use std::sync::Arc;

use crate::jet::Jet;
use crate::scene::{Drive, Joint, Scene};

/// A coordinate, m or rad, as a function of time, s. Allocates nothing.
pub trait Law: Debug + Send + Sync {
    /// Coordinate, rate and acceleration at `t`. The rate has no jump anywhere.
    fn at(&self, t: f64) -> Jet;

    /// Time after which the motion repeats, s; infinite where it does not, or where nothing moves.
    fn period(&self) -> f64 {
        f64::INFINITY
    }

    /// Shortest time in which the motion swings there and back, s: a mechanism that follows it exactly steps by a fiftieth of
    /// that.
    fn swing(&self) -> f64 {
        self.period()
    }

    /// Latest end of a step that starts at `t`, s: no adaptive step passes over what only begins within it.
    fn step_end(&self, _t: f64) -> f64 {
        f64::INFINITY
    }

    /// Whether [`Self::step_end`] is ever finite.
    fn bounds_steps(&self) -> bool {
        false
    }
}

/// What a driven coordinate follows.
#[derive(Clone, Debug)]
pub enum Course {
    /// This coordinate of the scene's closed form.
    ClosedForm(usize),
    /// A law of its own.
    Own(Arc<dyn Law>),
}

/// Makes a law; `turns` for a hinge.
type Make = fn(&Drive, turns: bool) -> Arc<dyn Law>;

/// All laws by word, besides those of closed forms.
const LAWS: [(&str, Make); 7] = [
    ("constant", line::make),
    ("harmonic", harmonic::make),
    ("harmonics", harmonic::make_sum),
    ("ramp", bump::make_ramp),
    ("pulse", bump::make_pulse),
    ("table", table::make),
    ("formula", formula::make),
];

/// Shortest time to the end of a step that [`Law::step_end`] asks for, s: at an instant that is reached only up to rounding,
/// no step of that length follows.
const NEAR: f64 = 1e-9;
/// Parts into which a single ramp or pulse is stepped, at least.
const PARTS: f64 = 50.0;

/// What a coordinate with this `drive` follows, an angle if it `turns`.
pub(super) fn course_of(drive: &Drive, turns: bool) -> Course {
    if let Some(coordinate) = drive.slider() {
        return Course::ClosedForm(coordinate);
    }
    let (_, make) =
        LAWS.iter().find(|(word, _)| *word == drive.kind.word).expect("every law of the scene format has its motion");
    Course::Own(make(drive, turns))
}

/// Periods of the motions that drives of joints prescribe, of what force elements follow and of loads, s; infinite where one does
/// not repeat or nothing moves.
pub fn periods_of(scene: &Scene) -> impl Iterator<Item = f64> {
    let drives = scene.joints.iter().flat_map(Joint::drives);
    let of_drives = drives.map(|(freedom, drive)| {
        let course = course_of(drive, freedom.turns());
        course.law().map_or_else(|| closed_period(scene), |law| law.period())
    });
    let of_elements = scene.elements.iter().map(|element| match &element.law {
        Some(law) => course_of(law, element.on_hinge).law().map_or(f64::INFINITY, |law| law.period()),
        None => element.kind.frequency.map_or(f64::INFINITY, |key| 1.0 / element.number(key)),
    });
    of_drives.chain(of_elements)
}

impl Course {
    /// Its own law, if it has one.
    pub fn law(&self) -> Option<&Arc<dyn Law>> {
        match self {
            Self::ClosedForm(_) => None,
            Self::Own(law) => Some(law),
        }
    }

    /// As [`Law::swing`].
    pub(super) fn swing(&self, scene: &Scene) -> f64 {
        self.law().map_or_else(|| closed_period(scene), |law| law.swing())
    }
}

/// Period of the closed form of `scene`, s.
fn closed_period(scene: &Scene) -> f64 {
    scene.spcmm.map_or(f64::INFINITY, |spcmm| period_if(&[spcmm.amplitude_x, spcmm.amplitude_beta], spcmm.frequency))
}

/// Period of a swing with these amplitudes, s.
fn period_if(amplitudes: &[f64], frequency: f64) -> f64 {
    if amplitudes.iter().any(|amplitude| *amplitude != 0.0) { 1.0 / frequency } else { f64::INFINITY }
}

/// Latest end of a step from `t` for a motion that lasts from `start` to `end`.
fn step_end_within(start: f64, end: f64, t: f64) -> f64 {
    if t < start - NEAR {
        start
    } else if t < end - NEAR {
        end.min(t + (end - start) / PARTS)
    } else {
        f64::INFINITY
    }
}

#[cfg(test)]
mod tests;
