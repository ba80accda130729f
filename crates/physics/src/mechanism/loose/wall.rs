//! Surfaces that a point of the other body touches from inside, and where the forces act. Everything that a contact knows of its shape
//! is here; a socket keeps the paper's two points of force.

use super::Spot;
use crate::contact::{Coefficients, ElasticLaw, Parameters, Separation};
use crate::machine::{Mat3, Vec3};
use crate::mechanism::kinematics::Kinematics;
use crate::mechanism::model::{Anchor, Site};

/// A surface fixed in the carrier's body. Play in a direction along it is free.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wall {
    /// A sphere about the carrier's point, which has the radius of the ball and the play: [`Edge`] does not apply.
    Socket,
    /// A cylinder about the axis with this direction through the carrier's point.
    Bore(Vec3, Edge),
    /// The plane across this direction, the play away from the carrier's point: the carried point may not go farther.
    Plane(Vec3),
}

/// Where a round part touches a bore, from the carried point along the normal n.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edge {
    /// The carried part is the pin: at its radius r.
    Pin,
    /// The carried part is the bearing, and the wall is that of the pin: at -(r + c).
    Bearing,
}

/// How stiff a contact is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stiffness {
    /// This share of the joint's.
    Joint(f64),
    /// That of a sphere of this radius on a plane, m.
    Corner(f64),
    /// This share of the collars', whatever the play along the axis.
    Face(f64),
}

impl Stiffness {
    /// Coefficients of a contact with the clearance `clearance`, m.
    pub fn coefficients(self, parameters: &Parameters, clearance: f64) -> Coefficients {
        let mut law = Coefficients::new(parameters, clearance);
        self.set_elastic(&mut law, parameters);
        law
    }

    /// Sets the current clearance of a ramp, m, and its rate, m/s.
    pub fn set_clearance(self, law: &mut Coefficients, parameters: &Parameters, clearance: f64, rate: f64) {
        law.set_clearance(parameters, clearance, rate);
        self.set_elastic(law, parameters);
    }

    #[inline]
    fn set_elastic(self, law: &mut Coefficients, parameters: &Parameters) {
        match self {
            Self::Joint(share) => law.elastic.stiffness *= share,
            Self::Corner(radius) => law.elastic = ElasticLaw::of_corner(parameters, radius),
            Self::Face(share) => {
                law.elastic = ElasticLaw::of_faces(parameters);
                law.elastic.stiffness *= share;
            }
        }
    }
}

impl Wall {
    /// The nearest point of the axis or of the plane through the carrier's point, from that point, for a carried point `apart` from
    /// it; world axes, `rotation` that of the carrier. 0 for a socket.
    #[inline]
    fn foot(&self, rotation: &Mat3, apart: &Vec3) -> Vec3 {
        match self {
            Self::Socket => Vec3::zeros(),
            Self::Bore(axis, _) => {
                let axis = rotation * axis;
                axis * axis.dot(apart)
            }
            Self::Plane(normal) => {
                let normal = rotation * normal;
                apart - normal * normal.dot(apart)
            }
        }
    }

    /// Distances from the carried point and from its foot to the point of force, along the normal, m, at `distance` of the two. A
    /// socket keeps the two points of the paper, r n and R n; all others have one, so that angular momentum is exact.
    #[inline]
    pub fn levers(&self, law: &Coefficients, distance: f64) -> [f64; 2] {
        let point = match self {
            Self::Socket => return law.socket_levers(),
            Self::Bore(_, Edge::Pin) => law.ball_radius,
            Self::Bore(_, Edge::Bearing) => -(law.ball_radius + law.clearance),
            Self::Plane(_) => 0.0,
        };
        [point, point + distance]
    }

    /// Separation of the carried point that is `e` (m) from its foot and moves at `velocity` (m/s) relative to the carrier there;
    /// `rotation` is that of the carrier.
    #[inline]
    pub fn separation(&self, law: &Coefficients, e: &Vec3, velocity: &Vec3, rotation: &Mat3) -> Separation {
        match self {
            Self::Socket | Self::Bore(..) => law.separation(e, velocity),
            Self::Plane(normal) => law.separation_along(&(rotation * normal), e, velocity),
        }
    }

    /// Whether a point `e` from its foot is beyond the play, m.
    #[inline]
    pub fn is_beyond(&self, e: &Vec3, clearance: f64, rotation: &Mat3) -> bool {
        e.norm_squared() > clearance * clearance
            && match self {
                Self::Socket | Self::Bore(..) => true,
                Self::Plane(normal) => (rotation * normal).dot(e) > 0.0,
            }
    }

    /// Projection onto the directions in which the wall confines, world axes; `rotation` is that of the carrier.
    pub fn confined(&self, rotation: &Mat3) -> Mat3 {
        let along = |direction: &Vec3| {
            let direction = rotation * direction;
            direction * direction.transpose()
        };
        match self {
            Self::Socket => Mat3::identity(),
            Self::Bore(axis, _) => Mat3::identity() - along(axis),
            Self::Plane(normal) => along(normal),
        }
    }
}

impl Site {
    /// Points of the carried part and of the carrier from the centroids of their bodies, m; the latter is the foot of the former.
    // Inlined: called three times per evaluation, and shorter than the call.
    #[inline(always)]
    pub fn arms(&self, motion: &[Kinematics]) -> [Vec3; 2] {
        let arms = self.arms_to_points(motion);
        if matches!(self.wall, Wall::Socket) { arms } else { self.arms_to_foot(motion, arms) }
    }

    /// Points of the carried part and of the carrier from the centroids of their bodies, m.
    #[inline(always)]
    pub fn arms_to_points(&self, motion: &[Kinematics]) -> [Vec3; 2] {
        // Not `map`: it is not always inlined, and costs a sixth of a run with many contacts.
        let arm = |anchor: &Anchor| motion[anchor.body].rotation * anchor.offset;
        [arm(&self.carried), arm(&self.carrier)]
    }

    #[inline(never)]
    fn arms_to_foot(&self, motion: &[Kinematics], [carried, carrier]: [Vec3; 2]) -> [Vec3; 2] {
        let (b, s) = (&motion[self.carried.body], &motion[self.carrier.body]);
        let apart = (b.position + carried) - (s.position + carrier);
        [carried, carrier + self.wall.foot(&s.rotation, &apart)]
    }

    /// The carried point from its foot and the velocity of the two relative to each other, m and m/s, given their arms. In a socket
    /// e and de/dt. Along the normal, the rate of the distance in any motion of the carrier: the foot's velocity is that of the
    /// carrier's material point.
    // Inlined: every evaluation needs it for every contact, and a call would cost a few per cent.
    #[inline(always)]
    pub fn opening(&self, motion: &[Kinematics], [carried, carrier]: &[Vec3; 2]) -> (Vec3, Vec3) {
        let (b, s) = (&motion[self.carried.body], &motion[self.carrier.body]);
        ((b.position + carried) - (s.position + carrier), b.point_velocity(carried) - s.point_velocity(carrier))
    }

    /// Distance of the carried point from its foot, towards the wall, m.
    pub fn distance(&self, motion: &[Kinematics]) -> f64 {
        let (e, _) = self.opening(motion, &self.arms(motion));
        match self.wall {
            Wall::Socket | Wall::Bore(..) => e.norm(),
            Wall::Plane(normal) => (motion[self.carrier.body].rotation * normal).dot(&e),
        }
    }

    /// Where it touches the carrier of its joint, whose point is `centre`, with the carried point `e` from its foot.
    pub fn spot(&self, centre: &Anchor, e: &Vec3, motion: &[Kinematics]) -> Spot {
        let direction = match (self.wall, self.is_reversed) {
            (Wall::Plane(normal), false) => normal,
            // A point on the face of a bearing.
            (Wall::Plane(_), true) => (self.carried.offset - centre.offset).normalize(),
            (Wall::Socket | Wall::Bore(..), false) => motion[self.carrier.body].rotation.tr_mul(&e.normalize()),
            // The pin touches on the other side of the bearing's axis.
            (Wall::Socket | Wall::Bore(..), true) => motion[self.carried.body].rotation.tr_mul(&-e.normalize()),
        };
        Spot { place: self.place, direction }
    }

    /// Both points as they are now fixed to their bodies, each with its lever, m.
    pub fn sides(&self, law: &Coefficients, distance: f64, motion: &[Kinematics]) -> [(Anchor, f64); 2] {
        let [carried, carrier] = self.wall.levers(law, distance);
        let foot = match self.wall {
            Wall::Socket => self.carrier,
            _ => {
                let offset = motion[self.carrier.body].rotation.tr_mul(&self.arms(motion)[1]);
                Anchor { offset, ..self.carrier }
            }
        };
        [(self.carried, carried), (foot, carrier)]
    }
}
