//! Rows of the films of lubricants, which are solved for like contacts: one for the drag of a film and one for each of its stations.
//!
//! The force of a film is that at the part theta of the step, from 1/2 where the film is soft to 1 where it is stiff:
//! theta = 1 / (1 - exp(-z)) - 1 / z, with which a velocity that falls as exp(-z t / h) is exact (Liniger & Willoughby 1970, SIAM J. Numer.
//! Anal. 7, 47). At the middle a stiff film would turn a velocity that does not fit it into an oscillation.

use super::{DiscreteGradient, Law, SolvedRow};
use crate::contact::{Film, StepForce};
use crate::machine::{Mat3, Vec3};
use crate::mechanism::columns::{collect_columns, collect_relative_columns};
use crate::mechanism::elements::{Film as ElementFilm, ForceElement};
use crate::mechanism::equations::Equations;
use crate::mechanism::kinematics::{Kinematics, Wrench};
use crate::mechanism::model::{Anchor, Model};

/// Eccentricity over the clearance at which a guess has left a film.
const FAR_BEYOND: f64 = 1.5;

/// What of a film resists.
enum Resistance {
    /// Pressure at a station, in the directions onto which the matrix projects.
    Pressure(Film, Mat3),
    /// Drag, N m s/rad.
    Drag(Mat3),
}

/// A station of a film, or its drag, over a step.
pub(super) struct FilmStep {
    resistance: Resistance,
    h: f64,
    /// Velocity at the start, m/s or rad/s; the eccentricity there, m, and its change over the guessed motion.
    velocity: Vec3,
    start: Vec3,
    change: Vec3,
    /// theta.
    part: f64,
    /// On the part, and on that with the wall.
    points: [Anchor; 2],
}

impl FilmStep {
    /// Eccentricity and velocity at its part of the step for the mean velocity `u`, m/s, where the guessed motion has `guessed`.
    fn at_part(&self, u: &Vec3, guessed: &Vec3) -> [Vec3; 2] {
        let e = self.start + (self.change + (u - guessed) * self.h) * self.part;
        [e, u + (u - self.velocity) * (2.0 * self.part - 1.0)]
    }

    /// Sets the part of the step for the guessed velocity, m/s, and the `mobility` of its row, 1/kg.
    pub(super) fn fit(&mut self, guessed: &Vec3, mobility: &Mat3) {
        let by_velocity = match &self.resistance {
            Resistance::Pressure(law, confined) => law.derivatives(&(self.start + self.change), guessed, confined)[1],
            Resistance::Drag(drag) => -drag,
        };
        let rates = mobility * by_velocity * self.h;
        let decay = guessed.try_normalize(0.0).map_or(rates.norm(), |along| (rates * along).norm());
        self.part = if decay < 1e-3 { 0.5 + decay / 12.0 } else { 1.0 / (1.0 - libm::exp(-decay)) - 1.0 / decay };
    }

    /// Force and derivatives.
    pub(super) fn force(&self, u: &Vec3, guessed: &Vec3) -> StepForce {
        let [e, v] = self.at_part(u, guessed);
        let (force, [by_e, by_v]) = match &self.resistance {
            Resistance::Pressure(law, confined) => (law.force(&e, &v), law.derivatives(&e, &v, confined)),
            Resistance::Drag(drag) => (drag * -v, [Mat3::zeros(), -drag]),
        };
        let by_velocity = by_e * (self.part * self.h) + by_v * (2.0 * self.part);
        StepForce { force, by_velocity, ..StepForce::default() }
    }

    /// Adds the mean force `force` of its row to what loads the bodies.
    pub(super) fn load(&self, force: &Vec3, motion: &[Kinematics], wrench: &mut [Wrench]) {
        for (point, force) in self.points.iter().zip([*force, -force]) {
            let own = &mut wrench[point.body];
            match self.resistance {
                Resistance::Drag(_) => own.torque += force,
                Resistance::Pressure(..) => {
                    own.force += force;
                    own.torque += (motion[point.body].rotation * point.offset).cross(&force);
                }
            }
        }
    }
}

impl DiscreteGradient {
    /// Records all stations of films at the start, or their eccentricities at the guessed end, from the motion just measured.
    pub(super) fn record_stations(&mut self, elements: &[Box<dyn ForceElement>], motion: &[Kinematics], at_end: bool) {
        let films = elements.iter().enumerate().filter_map(|(i, element)| Some((i, element.film()?)));
        for (i, film) in films {
            let (drag, stations) = self.stations[self.first_station[i]..].split_first_mut().expect("a row of drag");
            if !at_end {
                drag[0] = film.spin(motion);
            }
            for (own, station) in stations.iter_mut().zip(film.stations(motion)) {
                match at_end {
                    true => own[2] = station.eccentricity,
                    false => [own[0], own[1]] = [station.velocity, station.eccentricity],
                }
            }
        }
    }

    /// Whether the guessed motion leads a part far beyond the wall of its film.
    pub(super) fn leaves_a_film(&self, elements: &[Box<dyn ForceElement>]) -> bool {
        elements.iter().zip(&self.first_station).any(|(element, first)| {
            element.film().is_some_and(|film| {
                let ends = self.stations[*first + 1..].iter().take(film.len());
                ends.into_iter().any(|[.., end]| end.norm() > FAR_BEYOND * film.law.clearance)
            })
        })
    }

    /// Adds the drag of `film`, element `i`, and its stations, from the motion at the middle.
    pub(super) fn gather_film(
        &mut self,
        model: &Model,
        film: &ElementFilm,
        equations: &dyn Equations,
        i: usize,
        h: f64,
    ) {
        let motion = equations.motion();
        for (k, station) in film.stations(motion).enumerate() {
            let row = self.first_row[i] + 1 + k;
            let [velocity, start, end] = self.stations[self.first_station[i] + 1 + k];
            let points = film.points(&station, motion);
            let columns = &mut self.columns[row];
            collect_columns(columns, model, equations, &points.map(|point| (point, 0.0)), &Vec3::zeros());
            for column in columns {
                column.centre = station.confined * column.centre;
                column.surface = column.centre;
            }
            let resistance = Resistance::Pressure(film.law, station.confined);
            if k == 0 {
                let (row, velocity) = (self.first_row[i], self.stations[self.first_station[i]][0]);
                let columns = &mut self.columns[row];
                collect_relative_columns(columns, model, equations, &points.map(|point| (point, 1.0)));
                columns.iter_mut().for_each(|column| (column.centre, column.surface) = (column.turn, column.turn));
                let resistance = Resistance::Drag(film.whole_drag(motion));
                let zero = Vec3::zeros();
                let step = FilmStep { resistance, h, velocity, start: zero, change: zero, part: 1.0, points };
                let guessed = [film.spin(motion); 3];
                self.rows.push(SolvedRow { guessed, ..SolvedRow::new(row, Law::Film(step)) });
            }
            let step = FilmStep { resistance, h, velocity, start, change: end - start, part: 1.0, points };
            self.rows.push(SolvedRow { guessed: [station.velocity; 3], ..SolvedRow::new(row, Law::Film(step)) });
        }
    }

    /// Largest error of the place of a part over the thickness of its film, as of a velocity that falls exponentially over the step just
    /// solved: h |u1 - u0| (theta - 1/2).
    pub(super) fn largest_misplacement(&self) -> f64 {
        let misplacement = |row: &SolvedRow| {
            let Law::Film(step @ FilmStep { resistance: Resistance::Pressure(law, _), .. }) = &row.law else {
                return 0.0;
            };
            let u = row.free[0] + row.added[0];
            let [e, _] = step.at_part(&u, &row.guessed[0]);
            2.0 * (u - step.velocity).norm() * step.h * (step.part - 0.5) / law.thickness_at(e.norm())
        };
        self.rows.iter().map(misplacement).fold(0.0, f64::max)
    }
}
