//! The points of a map as arrays, and the notable points among them.

use serde_json::{Map, Value as Json, json};

use crate::analysis::axis::Axis;
use crate::analysis::map::{MapPoint, MapPointError, WorkspaceMap};
use crate::cli::provenance;
use crate::machine::Vec3;
use crate::scene::{Kind, insert_texts};
use crate::units::si_unit;

/// Label of everything that is computed from the reachable set.
pub const REACHABLE: &str = "all errors with every ball, pin and block anywhere in its play and the drives held; contact between bodies, springs, \
                             loads and inertia are ignored";
/// Label of the error at rest.
pub const SETTLED: &str = "static equilibrium with play under gravity, springs and loads, without friction";

/// All points of a map, in its order.
pub struct Results {
    pub map: WorkspaceMap,
    pub points: Vec<Result<MapPoint, MapPointError>>,
}

/// A vector without values.
const UNKNOWN: Vec3 = Vec3::new(f64::NAN, f64::NAN, f64::NAN);

impl Results {
    fn computed(&self, point: usize) -> Option<&MapPoint> {
        self.points[point].as_ref().ok()
    }

    /// Tip without play, m; NaN without a pose.
    pub fn ideal_tip(&self, point: usize) -> Vec3 {
        self.computed(point).map_or(UNKNOWN, |at_point| at_point.ideal_tip)
    }

    /// Error at rest, m; NaN if there is none.
    pub fn settled(&self, point: usize) -> Vec3 {
        self.computed(point).and_then(|at_point| at_point.settled.as_ref().ok().copied()).unwrap_or(UNKNOWN)
    }

    /// Largest error in the bounded directions, m: 0 where play moves the tip nowhere, NaN without a pose.
    pub fn largest(&self, point: usize) -> Vec3 {
        let of_point = |at_point: &MapPoint| match &at_point.largest {
            Some(largest) => largest.error.unwrap_or(UNKNOWN),
            None if at_point.farthest.iter().all(|farthest| farthest.error.is_some()) => Vec3::zeros(),
            None => UNKNOWN,
        };
        self.computed(point).map_or(UNKNOWN, of_point)
    }

    /// Direction of the largest error; NaN without one.
    pub fn largest_direction(&self, point: usize) -> Vec3 {
        self.computed(point).and_then(|at_point| at_point.largest.as_ref()).map_or(UNKNOWN, |largest| largest.direction)
    }

    /// Share of each joint with play in the support along the direction of the largest error, m; NaN without one.
    pub fn shares(&self, point: usize) -> Vec<f64> {
        let joints = self.map.scene().machine.loose_joints.len();
        let largest = self.computed(point).and_then(|at_point| at_point.largest.as_ref());
        let mut shares = largest.map_or_else(Vec::new, |largest| largest.shares.clone());
        shares.resize(joints, f64::NAN);
        shares
    }

    /// Joint with play with the largest share of the largest error.
    pub fn largest_joint(&self, point: usize) -> Option<usize> {
        let shares = self.shares(point);
        let most = (0..shares.len()).max_by(|&a, &b| shares[a].total_cmp(&shares[b]).then(b.cmp(&a)))?;
        (shares[most] > 0.0).then_some(most)
    }

    /// Directions in which nothing bounds the error.
    pub fn unbounded(&self, point: usize) -> &[Vec3] {
        self.computed(point).map_or(&[], |at_point| &at_point.freedoms.unbounded)
    }

    /// Largest number of directions of any point.
    pub fn directions(&self) -> usize {
        self.points.iter().flatten().map(|at_point| at_point.farthest.len()).max().unwrap_or(0)
    }

    /// Number of points without a pose, of those with a pose that do not rest, and of those with unbounded directions.
    pub fn counts(&self) -> [usize; 3] {
        let with_pose = || self.points.iter().flatten();
        [
            self.points.len() - with_pose().count(),
            with_pose().filter(|at_point| at_point.settled.is_err()).count(),
            with_pose().filter(|at_point| !at_point.freedoms.unbounded.is_empty()).count(),
        ]
    }

    /// Points with a largest error, from the smallest to the largest.
    pub fn ranked(&self) -> Vec<usize> {
        let size = |point: &usize| self.largest(*point).norm();
        let mut ranked: Vec<usize> = (0..self.points.len()).filter(|point| size(point).is_finite()).collect();
        ranked.sort_by(|a, b| size(a).total_cmp(&size(b)).then(a.cmp(b)));
        ranked
    }

    /// What varies at `point`, for people.
    pub fn describe(&self, point: usize) -> String {
        let indices = self.map.design().indices(point);
        let axes = self.map.design().axes().iter().zip(indices);
        axes.map(|(axis, i)| format!("{} = {}", axis.key(), self.format_value(axis, i))).collect::<Vec<_>>().join(", ")
    }

    fn format_value(&self, axis: &Axis, i: usize) -> String {
        match axis.coordinate() {
            Some(coordinate) => {
                let unit = if coordinate.dimension == crate::units::Dimension::Angle { "deg" } else { "mm" };
                crate::units::format_quantity_digits(axis.number(i), unit, 6)
            }
            None => {
                let parameter = self.map.scene().parameter(axis.key());
                parameter.map_or_else(|_| String::new(), |parameter| parameter.show(&axis.value(i)))
            }
        }
    }

    /// SI unit of `axis`; empty for a pure number or words.
    pub fn unit(&self, axis: &Axis) -> &'static str {
        let dimension = match axis.coordinate() {
            Some(coordinate) => Some(coordinate.dimension),
            None => match self.map.scene().parameter(axis.key()).map(|parameter| parameter.kind) {
                Ok(Kind::Number { dimension, .. }) => Some(dimension),
                _ => None,
            },
        };
        dimension.map_or("", si_unit)
    }

    /// Provenance, with the meaning of the numbers.
    pub fn meta(&self) -> Map<String, Json> {
        let scene = self.map.scene();
        let mut meta = provenance::meta(scene);
        insert_texts(&mut meta, scene);
        let axes = self.map.design().axes().iter();
        let axes = axes.map(|axis| {
            json!({"key": axis.key(), "count": axis.count(), "spacing": axis.spacing(), "unit": self.unit(axis),
                   "driven_coordinate": axis.coordinate().is_some()})
        });
        meta.insert("over".into(), axes.collect());
        meta.insert("directions".into(), json!(self.map.directions()));
        let joints = scene.machine.loose_joints.iter();
        meta.insert("ball_joints".into(), joints.map(|joint| json!(joint.name)).collect());
        let faults = self.points.iter().enumerate().filter_map(|(point, at_point)| {
            let fault = match at_point {
                Ok(at_point) => at_point.settled.as_ref().err()?.to_string(),
                Err(fault) => fault.to_string(),
            };
            Some((point.to_string(), json!(fault)))
        });
        meta.insert("faults".into(), Json::Object(faults.collect()));
        meta.insert("settled_error".into(), json!(SETTLED));
        meta.insert("reachable_set".into(), json!(REACHABLE));
        meta
    }
}
