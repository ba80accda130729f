//! A round wall that wears where it is touched: the depth worn off it as a function of direction.
//!
//! A ball of radius r at e from the middle of a wall of the radius r + c(n) overlaps it by e . n - c(n) in the direction n, to first order
//! in c / r, and its penetration is the largest of these: delta = max (e . n - c0 - w(n)), with the worn depth w. Where it is largest, e
//! minus the gradient of w lies along n. So the contact is that of an unworn wall whose centre is the point s = w n + grad w, fixed to the
//! worn part: its penetration is delta, and its rate is that of delta, since s moves at right angles to n as n turns. Forces, moments and
//! powers are those of the unworn wall, and the energy is a function of the configuration alone. Where a wall has worn on all sides by more
//! than its play, a ball in the middle is nearer to s than to any wall: the middle then goes with it.
//!
//! w is a sum of smooth bumps of equal shape about directions of even spacing, and the volume the sum of theirs. What a
//! contact wears off is divided among them by overlap, as on an elastic foundation: c then tends to e . n, the wall of
//! the ball itself, wherever that lies beyond it. c plus its second derivatives, the radius of curvature of the set in
//! which the centre is free, decays in proportion to itself and stays positive, so that the largest overlap is at one place. It tends to
//! a small radius in place of 0, as if the ball were a little smaller there: the normal of a ball that fits its groove could turn at once.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use super::Shape;
use crate::machine::{LooseJoint, LooseKind, Mat3, Vec3};
use crate::mechanism::kinematics::Kinematics;
use crate::mechanism::model::{Anchor, BodyIndex, Site};

use super::Wall;

/// Bumps on a socket, whose golden-section spiral is the most even for any number: their radius on the sphere, and that of the
/// overlap over which a contact of no depth wears, rad. Wider bumps show less of the gaps between the directions.
const ON_SPHERE: usize = 400;
const SPHERE_BUMP: f64 = 60.0 * PI / 180.0;
const SPHERE_OVERLAP: f64 = 20.0 * PI / 180.0;
/// The same of each end of a bearing, of which the bumps are on the sectors of its wear map.
const RING_BUMP: f64 = 30.0 * PI / 180.0;
const RING_OVERLAP: f64 = 10.0 * PI / 180.0;
/// Least radius of curvature of the set in which the centre is free, over the distance of the centre from the middle, on a sphere and on a
/// ring: more than what the spacing of the bumps takes off it.
const SPHERE_TIGHTEST: f64 = 0.15;
const RING_TIGHTEST: f64 = 0.05;
/// Bumps whose cosines are found at once.
const BLOCK: usize = 8;
/// Iterations for the direction of the largest overlap, and the change from which its square is nothing, rad.
const ITERATIONS: u32 = 30;
const SMALL_TURN: f64 = 1e-7;
/// Largest change of one, rad.
const LARGEST_TURN: f64 = 0.3;

/// Directions of the bumps of a wall, and their shape: ((x - x0) / (1 - x0))^6 of the cosine x of the angle to a direction.
#[derive(Debug)]
pub struct Bumps {
    /// Unit vectors in the axes of the worn body.
    directions: Vec<Vec3>,
    /// x0.
    edge: f64,
    /// Sum of the bumps of depth 1 in any direction.
    sum: f64,
    /// Mean cosine within a bump: so much of a shift of the wall is left where the bumps have its depths.
    smoothing: f64,
    /// Overlap, over the clearance, over which a contact of no depth wears.
    overlap: f64,
    /// Least radius of curvature, over the distance of the part.
    tightest: f64,
}

impl Bumps {
    /// Those of the place `place` of `joint`, an index among the names of its sites; `None` where its wall is not round, or does not wear
    /// by direction.
    pub fn of(joint: &LooseJoint, place: u8) -> Option<Arc<Self>> {
        if !joint.wears_by_direction() {
            return None;
        }
        match joint.kind {
            LooseKind::Ball => Some(Arc::new(Self::on_sphere())),
            LooseKind::Pin(_) if joint.kind.play_of(place) == 0 => {
                let division = joint.division();
                let sectors = division.parts().iter().find_map(|part| match part.shape {
                    Shape::Ring { sectors } if part.place == place => Some(sectors),
                    _ => None,
                });
                sectors.map(|sectors| Arc::new(Self::on_ring(division.axes(), sectors)))
            }
            LooseKind::Pin(_) | LooseKind::Slide(_) => None,
        }
    }

    /// On a golden-section spiral from pole to pole.
    fn on_sphere() -> Self {
        let n = ON_SPHERE as f64;
        let direction = |i: usize| {
            let z = 1.0 - (2.0 * i as f64 + 1.0) / n;
            let turn = TAU * i as f64 / (0.5 * (1.0 + 5.0_f64.sqrt()));
            let (sin, cos) = libm::sincos(turn);
            let across = (1.0 - z * z).sqrt();
            Vec3::new(across * cos, across * sin, z)
        };
        let edge = libm::cos(SPHERE_BUMP);
        // Over the sphere the mean of a bump is (1 - x0) / 14, and its mean cosine x0 + 7/8 (1 - x0).
        Self {
            directions: (0..ON_SPHERE).map(direction).collect(),
            edge,
            sum: n * (1.0 - edge) / 14.0,
            smoothing: edge + 0.875 * (1.0 - edge),
            overlap: 1.0 - libm::cos(SPHERE_OVERLAP),
            tightest: SPHERE_TIGHTEST,
        }
    }

    /// On a circle about z of `axes`, whose rows they are in those of the body.
    fn on_ring(axes: &Mat3, sectors: u16) -> Self {
        let direction = |i: u16| {
            let (sin, cos) = libm::sincos(TAU * f64::from(i) / f64::from(sectors));
            axes.tr_mul(&Vec3::new(cos, sin, 0.0))
        };
        let edge = libm::cos(RING_BUMP);
        let overlap = 1.0 - libm::cos(RING_OVERLAP);
        let mut bumps = Self {
            directions: (0..sectors).map(direction).collect(),
            edge,
            sum: 1.0,
            smoothing: 1.0,
            overlap,
            tightest: RING_TIGHTEST,
        };
        let cosines = || bumps.directions.iter().map(|at| at.dot(&bumps.directions[0]));
        let sum: f64 = cosines().map(|x| bumps.bump(x)[0]).sum();
        let smoothing = cosines().map(|x| x * bumps.bump(x)[0]).sum::<f64>() / sum;
        (bumps.sum, bumps.smoothing) = (sum, smoothing);
        bumps
    }

    /// Number of directions.
    pub fn len(&self) -> usize {
        self.directions.len()
    }

    /// A bump at the cosine `x`, and its first two derivatives with respect to it.
    fn bump(&self, x: f64) -> [f64; 3] {
        let width = 1.0 - self.edge;
        let d = (x - self.edge) / width;
        if d <= 0.0 {
            return [0.0; 3];
        }
        let fourth = d * d * (d * d);
        [fourth * d * d, 6.0 * fourth * d / width, 30.0 * fourth / (width * width)]
    }

    /// Worn depth in the direction of the unit vector `n`, m, for the depths `depths` of the bumps.
    pub fn depth(&self, depths: &[f64], n: &Vec3) -> f64 {
        let depth = |(at, depth): (&Vec3, &f64)| depth * self.bump(at.dot(n))[0];
        self.directions.iter().zip(depths).map(depth).sum::<f64>() / self.sum
    }

    /// As [`WornWall::limit`].
    fn limit(&self, depths: &[f64], n: &Vec3, clearance: f64) -> Vec3 {
        let (value, gradient, _) = self.derivatives(depths, n);
        n * (clearance + value - gradient.dot(n)) + gradient
    }

    /// The same with its gradient and second derivatives in space.
    fn derivatives(&self, depths: &[f64], n: &Vec3) -> (f64, Vec3, Mat3) {
        let (mut value, mut gradient, mut curvature) = (0.0, Vec3::zeros(), Mat3::zeros());
        // Most bumps are out of reach: cosines first, by vector instructions, then the few that count.
        for (block, depths) in self.directions.chunks(BLOCK).zip(depths.chunks(BLOCK)) {
            let mut cosines = [f64::NEG_INFINITY; BLOCK];
            cosines.iter_mut().zip(block).for_each(|(x, at)| *x = at.dot(n));
            for ((x, at), depth) in cosines.iter().zip(block).zip(depths) {
                if *x > self.edge && *depth != 0.0 {
                    let [bump, first, second] = self.bump(*x).map(|part| part * depth);
                    value += bump;
                    gradient += at * first;
                    curvature += at * (at * second).transpose();
                }
            }
        }
        (value / self.sum, gradient / self.sum, curvature / self.sum)
    }

    /// Adds to `depths` what a contact wears off: `depth` is the volume over the area of the whole wall, m. It is cut as from `toward`
    /// ([`Profile::cut`]), `penetration` deep, where the clearance without wear is `clearance`, m.
    pub fn deposit(&self, depths: &mut [f64], depth: f64, [clearance, penetration]: [f64; 2], toward: &Vec3) {
        let beyond = |at: &Vec3, depth: f64| at.dot(toward) / self.smoothing - depth;
        let gaps = self.directions.iter().zip(&*depths).map(|(at, depth)| beyond(at, *depth));
        let most = gaps.fold(f64::NEG_INFINITY, f64::max);
        let reach = penetration + self.overlap * clearance;
        let overlap = |at: &Vec3, depth: f64| (beyond(at, depth) - most + reach).max(0.0);
        let total: f64 = self.directions.iter().zip(&*depths).map(|(at, depth)| overlap(at, *depth)).sum();
        let share = depth * self.directions.len() as f64 / total;
        for (at, depth) in self.directions.iter().zip(depths) {
            *depth += share * overlap(at, *depth);
        }
    }
}

/// Most of the clearance by which one part of an extrapolation deepens a bump, and most parts.
const EXTRAPOLATED_AT_ONCE: f64 = 0.005;
const MOST_PARTS: f64 = 2000.0;

/// A wall that wears by direction, at one instant. Directions are unit vectors in the axes of the body of its joint's carrier, from the
/// middle of the wall to it.
#[derive(Clone, Debug)]
pub struct WornWall {
    /// Index of its joint among those with play.
    pub joint: usize,
    /// Index among [`LooseKind::site_names`](crate::machine::LooseKind::site_names); 0 for a kind with one place.
    pub place: u8,
    bumps: Arc<Bumps>,
    /// Of the bumps, m.
    depths: Vec<f64>,
}

impl WornWall {
    /// That of place `place` of `joint`, whose index is `index`, with these depths of its bumps, m; `None` where no wall wears by
    /// direction.
    pub(crate) fn new(joint: &LooseJoint, index: usize, place: u8, depths: &[f64]) -> Option<Self> {
        let bumps = Bumps::of(joint, place).filter(|bumps| bumps.len() == depths.len())?;
        Some(Self { joint: index, place, bumps, depths: depths.to_vec() })
    }

    /// Largest worn depth, m, of those in the directions of its bumps, which are closer together than a bump is wide.
    pub fn deepest(&self) -> f64 {
        self.bumps.directions.iter().map(|direction| self.depth(direction)).fold(0.0, f64::max)
    }

    /// Worn depth in a direction, m.
    pub fn depth(&self, direction: &Vec3) -> f64 {
        self.bumps.depth(&self.depths, direction)
    }

    /// Depths of its bumps, m.
    pub fn depths(&self) -> &[f64] {
        &self.depths
    }

    /// Wears on `factor` times as much as the depths of its bumps have grown by, `growth`, m: as much in each direction, but in the shape
    /// that the part cuts as the wall deepens, so that a growth in few places does not become a slit that the part does not reach into.
    /// `clearance` is that without wear, m.
    pub fn extrapolate(&mut self, growth: &[f64], factor: f64, clearance: f64) {
        let bumps = &self.bumps;
        let most = growth.iter().copied().fold(0.0, f64::max) * factor;
        let parts = (most / (EXTRAPOLATED_AT_ONCE * clearance)).ceil().clamp(1.0, MOST_PARTS);
        for _ in 0..parts as usize {
            for (direction, growth) in bumps.directions.iter().zip(growth).filter(|(_, growth)| **growth > 0.0) {
                let toward = bumps.limit(&self.depths, direction, clearance);
                let cut = toward - direction * (bumps.tightest * toward.norm());
                let depth = growth * factor / (parts * bumps.len() as f64);
                bumps.deposit(&mut self.depths, depth, [clearance, 0.0], &cut);
            }
        }
    }

    /// Where the centre of the part is, from the middle of the wall, m, when it touches the wall in a direction across which the wall lies
    /// there. `clearance` is that without wear, m.
    pub fn limit(&self, direction: &Vec3, clearance: f64) -> Vec3 {
        self.bumps.limit(&self.depths, direction, clearance)
    }
}

/// The worn wall of a contact.
#[derive(Debug)]
pub struct Profile {
    /// The contact without wear.
    unworn: Site,
    bumps: Arc<Bumps>,
    /// Depths of the bumps, m, in the latest step and from its end on, which is at `end`, s.
    depths: [Vec<f64>; 2],
    end: f64,
    /// Which of the two applies.
    now: usize,
    /// Whether anything has worn off in each of the two.
    worn: [bool; 2],
    /// The part from the middle of the wall at the latest evaluation, m, in the axes of the worn body, like the rest.
    toward: Vec3,
    /// The normal, towards the wall, and its derivative with respect to that, 1/m.
    normal: Vec3,
    turning: Mat3,
}

impl Profile {
    /// An unworn one.
    pub fn new(unworn: Site, bumps: Arc<Bumps>) -> Self {
        let depths = vec![0.0; bumps.len()];
        Self {
            unworn,
            bumps,
            depths: [depths.clone(), depths],
            end: f64::NEG_INFINITY,
            now: 1,
            worn: [false; 2],
            toward: Vec3::zeros(),
            normal: Vec3::zeros(),
            turning: Mat3::zeros(),
        }
    }

    /// Copies it at the time last chosen to the walls of `to` from the one at `index` on; a new one is added.
    pub fn report(&self, index: usize, to: &mut Vec<WornWall>) {
        let (joint, place, depths) = (self.unworn.joint, self.unworn.place, &self.depths[self.now]);
        match to.get_mut(index) {
            Some(wall) if wall.depths.len() == depths.len() => {
                (wall.joint, wall.place) = (joint, place);
                wall.bumps = Arc::clone(&self.bumps);
                wall.depths.copy_from_slice(depths);
            }
            _ => {
                to.truncate(index);
                to.push(WornWall { joint, place, bumps: Arc::clone(&self.bumps), depths: depths.clone() });
            }
        }
    }

    /// Its bumps.
    pub fn bumps(&self) -> &Arc<Bumps> {
        &self.bumps
    }

    /// Sets the depths of its bumps, m, from `t` on, s; before that they remain. At all times from minus infinity on.
    pub fn continue_from(&mut self, t: f64, depths: &[f64]) {
        self.depths.swap(0, 1);
        self.worn.swap(0, 1);
        self.depths[1].copy_from_slice(depths);
        self.worn[1] = depths.iter().any(|depth| *depth != 0.0);
        self.end = t;
    }

    /// Chooses the depths at `t`, s.
    pub fn choose(&mut self, t: f64) {
        self.now = usize::from(t >= self.end);
    }

    /// Mean worn depth at the time last chosen, m: volume over area.
    pub fn mean_depth(&self) -> f64 {
        let depths = &self.depths[self.now];
        depths.iter().sum::<f64>() / depths.len() as f64
    }

    /// The part from the middle of the wall at the latest evaluation, m, in the axes of the worn body, less the least radius of curvature
    /// along the normal.
    pub fn cut(&self) -> Vec3 {
        self.toward - self.normal * (self.bumps.tightest * self.toward.norm())
    }

    /// The end of the site on the worn body.
    fn worn_end<'a>(&self, site: &'a mut Site) -> &'a mut Anchor {
        if self.unworn.is_reversed { &mut site.carried } else { &mut site.carrier }
    }

    /// Whether anything has worn off at the time last chosen.
    pub fn has_worn(&self) -> bool {
        self.worn[self.now]
    }

    /// The body with the wall that wears.
    pub fn worn_body(&self) -> BodyIndex {
        if self.unworn.is_reversed { self.unworn.carried.body } else { self.unworn.carrier.body }
    }

    /// Derivative of the normal with respect to the eccentricity, 1/m, world axes.
    pub fn normal_by_displacement(&self, motion: &[Kinematics]) -> Mat3 {
        let rotation = &motion[self.worn_body()].rotation;
        rotation * self.turning * rotation.transpose()
    }

    /// Moves the worn end of `site` to where an unworn wall is touched in the same way, at `motion`.
    pub fn follow(&mut self, site: &mut Site, motion: &[Kinematics]) {
        let unworn = &self.unworn;
        let (e, _) = unworn.opening(motion, &unworn.arms(motion));
        let (body, sign) = if unworn.is_reversed { (unworn.carried.body, -1.0) } else { (unworn.carrier.body, 1.0) };
        let rotation = &motion[body].rotation;
        self.toward = rotation.tr_mul(&(e * sign));
        let axis = match unworn.wall {
            Wall::Bore(axis, _) => Some(rotation.tr_mul(&(motion[unworn.carrier.body].rotation * axis))),
            Wall::Socket | Wall::Plane(_) => None,
        };
        let unmoved = if unworn.is_reversed { unworn.carried.offset } else { unworn.carrier.offset };
        let shift = self.find_shift(axis.as_ref());
        self.worn_end(site).offset = unmoved + shift;
    }

    /// Finds the direction of the largest overlap, at right angles to `axis` if there is one; returns s.
    fn find_shift(&mut self, axis: Option<&Vec3>) -> Vec3 {
        let (bumps, depths, toward) = (&*self.bumps, &self.depths[self.now], self.toward);
        let across = Mat3::identity() - axis.map_or_else(Mat3::zeros, |axis| axis * axis.transpose());
        if !self.has_worn() {
            let length = toward.norm();
            let n = if length > 0.0 { toward / length } else { Vec3::zeros() };
            self.normal = n;
            self.turning = if length > 0.0 { (across - n * n.transpose()) / length } else { Mat3::zeros() };
            return Vec3::zeros();
        }
        let overlaps = bumps.directions.iter().zip(depths).map(|(at, depth)| at.dot(&toward) - depth);
        let best = overlaps.enumerate().fold((0, f64::NEG_INFINITY), |a, b| if b.1 > a.1 { b } else { a });
        let straight = across * toward;
        let length = straight.norm();
        // Where little has worn off, the part itself shows the way.
        let mut n = if length > 0.0 { straight / length } else { bumps.directions[best.0] };
        let mut iterations = 0;
        loop {
            let (value, gradient, curvature) = bumps.derivatives(depths, &n);
            iterations += 1;
            if iterations == 1 && n.dot(&toward) - value < best.1 {
                n = (across * bumps.directions[best.0]).normalize();
                continue;
            }
            let tangent = across - n * n.transpose();
            let slope = tangent * (toward - gradient);
            let against = tangent * (toward.dot(&n) - gradient.dot(&n)) + tangent * curvature * tangent;
            let turning = inverse_across(&against, &n, axis);
            self.turning = turning;
            let mut turn = turning * slope;
            let size = turn.norm();
            if size > LARGEST_TURN {
                turn *= LARGEST_TURN / size;
            }
            if size < SMALL_TURN || iterations > ITERATIONS {
                if n.dot(&toward) <= value {
                    // In the middle of a wall that has worn on all sides: as far from it as an unworn one from its middle, if not farther.
                    return toward;
                }
                // The rest to first order.
                self.normal = (n + turn).normalize();
                let shift = n * (value - gradient.dot(&n)) + gradient;
                let bent = curvature * turn;
                return shift + turn * (value - gradient.dot(&n)) + bent - n * n.dot(&bent);
            }
            n = (n + turn).normalize();
        }
    }
}

/// Inverse of the symmetric `against` in the plane across `n`, or across both `n` and `axis`. Where the overlap has no largest value near
/// `n`, in the middle of the wall, that of its size: the direction then climbs.
fn inverse_across(against: &Mat3, n: &Vec3, axis: Option<&Vec3>) -> Mat3 {
    if let Some(axis) = axis {
        let along = axis.cross(n);
        let size = along.dot(&(against * along)).abs();
        return if size > 0.0 { along * along.transpose() / size } else { Mat3::zeros() };
    }
    let near = if n.x.abs() < 0.6 { Vec3::x() } else { Vec3::y() };
    let u = n.cross(&near).normalize();
    let v = n.cross(&u);
    let (a, b, c) = (u.dot(&(against * u)), u.dot(&(against * v)), v.dot(&(against * v)));
    // By its eigenvalues' sizes: (a, b; b, c) = mean + half (cos, sin; sin, -cos).
    let (mean, half) = (0.5 * (a + c), (0.25 * (a - c) * (a - c) + b * b).sqrt());
    let [low, high] = [(mean - half).abs(), (mean + half).abs()];
    if low == 0.0 || high == 0.0 {
        return Mat3::zeros();
    }
    let plane = u * u.transpose() + v * v.transpose();
    if half == 0.0 {
        return plane / high;
    }
    let turned = (u * u.transpose() - v * v.transpose()) * (0.5 * (a - c) / half)
        + (u * v.transpose() + v * u.transpose()) * (b / half);
    plane * (0.5 * (1.0 / high + 1.0 / low)) + turned * (0.5 * (1.0 / high - 1.0 / low))
}

#[cfg(test)]
mod tests {
    use super::super::{Edge, Stiffness};
    use super::*;

    fn bumps() -> [(Bumps, Option<Vec3>); 2] {
        [(Bumps::on_sphere(), None), (Bumps::on_ring(&Mat3::identity(), 72), Some(Vec3::z()))]
    }

    /// A wall worn to `depths`, a bore about `axis` if there is one.
    fn worn(bumps: Bumps, axis: Option<Vec3>, depths: &[f64]) -> Profile {
        let anchor = Anchor { body: 0, offset: Vec3::zeros() };
        let wall = axis.map_or(Wall::Socket, |axis| Wall::Bore(axis, Edge::Pin));
        let (stiffness, carrier, carried) = (Stiffness::Joint(1.0), anchor, anchor);
        let site = Site { joint: 0, carrier, carried, wall, play: 0, stiffness, is_reversed: false, place: 0 };
        let mut profile = Profile::new(site, Arc::new(bumps));
        profile.continue_from(f64::NEG_INFINITY, depths);
        profile.choose(0.0);
        profile
    }

    /// A fixed sequence of unit vectors, across `axis` if there is one.
    fn directions(axis: Option<Vec3>, count: u32) -> impl Iterator<Item = Vec3> {
        (1..=count).map(move |i| {
            let [x, y, z] = [0.755, 0.570, 0.430].map(|step| 2.0 * (step * f64::from(i)).fract() - 1.0);
            Vec3::new(x, y, if axis.is_some() { 0.0 } else { z }).normalize()
        })
    }

    #[test]
    fn bumps_of_equal_depth_are_an_even_wall_to_the_unevenness_of_their_directions() {
        for ((bumps, axis), tolerance) in bumps().into_iter().zip([0.01, 1e-5]) {
            let depths = vec![2e-5; bumps.len()];
            let worst =
                directions(axis, 500).map(|n| (bumps.depth(&depths, &n) / 2e-5 - 1.0).abs()).fold(0.0, f64::max);
            assert!(worst < tolerance, "{worst:e}");
        }
    }

    #[test]
    fn derivatives_are_those_of_central_differences() {
        for (bumps, axis) in bumps() {
            let depths: Vec<f64> = (0..bumps.len()).map(|i| 1e-5 * (1.0 + (0.37 * i as f64).fract())).collect();
            for n in directions(axis, 20) {
                let (value, gradient, curvature) = bumps.derivatives(&depths, &n);
                assert!((value / bumps.depth(&depths, &n) - 1.0).abs() < 1e-14);
                for k in 0..3 {
                    let d = Vec3::ith(k, 1e-5);
                    let [above, below] = [n + d, n - d].map(|n| bumps.derivatives(&depths, &n));
                    let slope = (above.0 - below.0) / 2e-5;
                    assert!((slope - gradient[k]).abs() < 1e-7 * gradient.norm(), "{slope:e} {:e}", gradient[k]);
                    let bend = (above.1 - below.1) / 2e-5;
                    assert!((bend - curvature.column(k)).norm() < 1e-6 * curvature.norm());
                }
            }
        }
    }

    #[test]
    fn what_is_deposited_is_the_volume_and_the_wall_stays_one_that_the_part_can_touch_everywhere() {
        let clearance = 1e-4;
        // A groove that is narrow beside the bumps is smoothed by them.
        for ((bumps, axis), smoothing) in bumps().into_iter().zip([0.3, 0.05]) {
            let mut depths = vec![0.0; bumps.len()];
            // A groove of half the clearance, then wear all around it.
            let groove = Vec3::new(0.6, -0.8, 0.0);
            let mut deposited = 0.0;
            let mut wear = |n: &Vec3, count: u32, depths: &mut Vec<f64>| {
                for _ in 0..count {
                    // Pressed in by 0.1 um where the wall's normal is n.
                    let toward = bumps.limit(depths, n, clearance + 1e-7);
                    let cut = toward - n * (bumps.tightest * toward.norm());
                    bumps.deposit(depths, 1e-8, [clearance, 1e-7], &cut);
                    deposited += 1e-8;
                }
            };
            wear(&groove, 800, &mut depths);
            // The part has cut its own shape: the wall and the volume between the unworn wall and that of the part moved by the depth.
            let got = bumps.depth(&depths, &groove) / clearance;
            // Rounded at the tip.
            let tip = bumps.tightest * (1.0 + got);
            let reach = 1.0 + got - tip;
            let edge = ((1.0 - tip) / reach).acos();
            let mean = match axis {
                Some(_) => (reach * edge.sin() - (1.0 - tip) * edge) / PI,
                None => 0.25 * reach * edge.sin().powi(2) - 0.5 * (1.0 - tip) * (1.0 - edge.cos()),
            };
            assert!((mean / 0.08 - 1.0).abs() < smoothing, "groove of {got}: mean {mean}, 0.08 deposited");
            for n in directions(axis, 200) {
                wear(&n, 2, &mut depths);
            }
            let mean = depths.iter().sum::<f64>() / bumps.len() as f64;
            assert!((mean / deposited - 1.0).abs() < 1e-12, "{mean:e} {deposited:e}");
            assert!(depths.iter().all(|depth| *depth >= 0.0));
            // The radius of curvature of the set in which the centre is free.
            let mut least = f64::INFINITY;
            for n in directions(axis, 2000) {
                let (value, gradient, curvature) = bumps.derivatives(&depths, &n);
                let near = if n.x.abs() < 0.6 { Vec3::x() } else { Vec3::y() };
                let [u, v] = axis
                    .map_or([n.cross(&near).normalize(), n.cross(&n.cross(&near)).normalize()], |a| [a.cross(&n); 2]);
                let along =
                    |a: &Vec3, b: &Vec3| a.dot(&(curvature * b)) + a.dot(b) * (value - gradient.dot(&n) + clearance);
                let (a, b, c) = (along(&u, &u), along(&u, &v), along(&v, &v));
                let b = if axis.is_some() { 0.0 } else { b };
                least = least.min(0.5 * (a + c) - (0.25 * (a - c) * (a - c) + b * b).sqrt());
            }
            assert!(least > 0.0, "{least:e}");
        }
    }

    #[test]
    fn a_wall_worn_to_a_shifted_circle_is_one_about_its_centre() {
        for ((bumps, axis), tolerance) in bumps().into_iter().zip([0.02, 2e-5]) {
            let (shift, mean) = (Vec3::new(2e-5, -1e-5, 0.0), 3e-5);
            let depths: Vec<f64> = bumps.directions.iter().map(|at| mean + at.dot(&shift) / bumps.smoothing).collect();
            let mut profile = worn(bumps, axis, &depths);
            for n in directions(axis, 50) {
                profile.toward = n * 1.5e-4;
                let s = profile.find_shift(axis.as_ref());
                let from_centre = profile.toward - shift;
                let off = (profile.toward - s).norm() - (from_centre.norm() - mean);
                assert!(off.abs() < tolerance * mean, "{off:e}");
                let expected = from_centre.normalize();
                let normal = (profile.toward - s).normalize();
                assert!((normal - expected).norm() < 10.0 * tolerance, "{normal} {expected}");
                assert!((normal - profile.normal).norm() < 1e-9, "{normal} {}", profile.normal);
            }
        }
    }

    #[test]
    fn the_normal_and_the_penetration_follow_the_part() {
        for (bumps, axis) in bumps() {
            let depths: Vec<f64> = bumps.directions.iter().map(|at| 4e-5 * (at.x + 0.5 * at.y).max(0.0)).collect();
            let mut profile = worn(bumps, axis, &depths);
            let mut at = |toward: Vec3| {
                profile.toward = toward;
                let apart = toward - profile.find_shift(axis.as_ref());
                (apart.norm(), apart.normalize(), profile.turning)
            };
            for n in directions(axis, 100) {
                let toward = n * 1.4e-4;
                let (_, normal, turning) = at(toward);
                for k in 0..if axis.is_some() { 2 } else { 3 } {
                    let d = Vec3::ith(k, 1e-9);
                    let (above, below) = (at(toward + d), at(toward - d));
                    // The penetration is a function of the place whose gradient is the normal: no work is lost or gained.
                    let slope = (above.0 - below.0) / 2e-9;
                    assert!((slope - normal[k]).abs() < 1e-6, "{slope} {}", normal[k]);
                    let turned = (above.1 - below.1) / 2e-9;
                    assert!(
                        (turned - turning.column(k)).norm() < 1e-3 * turning.norm(),
                        "{turned} {}",
                        turning.column(k)
                    );
                }
            }
        }
    }
}
