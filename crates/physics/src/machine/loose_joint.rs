//! Joints with play.

use super::{Attachment, Quat, StartRule, Vec3};
use crate::contact::{self, ElasticLaw, Elasticity};

/// A joint with play: contacts between two bodies in place of constraints, unless its clearance is 0.
#[derive(Clone, Debug, PartialEq)]
pub struct LooseJoint {
    /// Unique name.
    pub name: String,
    /// What can play in it.
    pub kind: LooseKind,
    /// A frame on each of its bodies, which coincide at the joint's zero position without play: that of the carrier (the socket),
    /// in which the contact's surface is fixed, then that of the carried part (the ball).
    pub frames: [JointFrame; 2],
    /// Unit vector in the carrier's body frame: the drawn socket is cut open on that side, so that the rod can pass and the ball
    /// inside is visible. It has no effect on the motion.
    pub opening: Vec3,
    /// Contact parameters.
    pub contact: contact::Parameters,
}

/// Kind of a joint with play.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LooseKind {
    /// A ball in a socket.
    Ball,
    /// A pin, the carried part, in a bearing: both along the x axes of their frames.
    Pin(Pin),
    /// A block, the carried part, in a guide along the x axes of their frames.
    Slide(Slide),
}

impl LooseKind {
    /// Part of the joint's stiffness that each contact across it has.
    pub(crate) fn share(&self) -> f64 {
        match self {
            Self::Pin(Pin { length: Some(_), .. }) => 0.5,
            Self::Ball | Self::Pin(_) | Self::Slide(_) => 1.0,
        }
    }
}

/// A round pin in a bearing. The ball radius of the contact parameters is the radius r of the pin, the clearance R - r.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pin {
    /// Length L of the shorter of pin and bearing, centred on the joint's point, m: they touch at its two ends. `None` for a joint
    /// that does not tilt, and touches at one point.
    pub length: Option<f64>,
    /// Which part has the ends.
    pub ends: EndsOn,
    /// Whether collars keep the pin in the bearing, with the second clearance to each side.
    pub kept: bool,
    /// Radius of the collars' faces, m. `None`: they touch on the axis, and exert no torque.
    pub face_radius: Option<f64>,
}

/// The part of a pin joint whose ends touch the other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EndsOn {
    /// The bearing, shorter than the pin: forces stay at its edges.
    #[default]
    Bearing,
    /// The pin, shorter than the bore, such as a piston: forces travel with it.
    Pin,
}

/// A rectangular block between the walls y = +-(half_width + c) and z = +-(half_height + second clearance) of its guide. It touches
/// with its corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slide {
    /// Half of its length along the guide, m.
    pub half_length: f64,
    /// Half of its width, along y, m.
    pub half_width: f64,
    /// Half of its height, along z, m. `None`: it stays in the plane of x and y.
    pub half_height: Option<f64>,
    /// Radius of curvature of its corners, which sets their stiffness, m. It does not enter the geometry.
    pub corner_radius: f64,
}

/// A point of a body, or of the world, with axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointFrame {
    /// Origin.
    pub origin: Attachment,
    /// Orientation in the axes of the body, or of the world; its x axis is that of the joint. A ball has no use for it.
    pub rotation: Quat,
}

impl From<Attachment> for JointFrame {
    /// With axes parallel to those of the body.
    fn from(origin: Attachment) -> Self {
        Self { origin, rotation: Quat::identity() }
    }
}

/// Why a joint with play cannot have its dimensions or settings.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LooseFault {
    /// A dimension that is not a length.
    #[error("{what} = {value:e} m: must be above 0 m")]
    Length {
        /// Which.
        what: &'static str,
        /// m.
        value: f64,
    },
    /// Play so large that the geometry, which is linear in it, is wrong.
    #[error("the play, {play:e} m, is above {part}, {most:e} m")]
    Play {
        /// m.
        play: f64,
        /// The part of a dimension that bounds it.
        part: &'static str,
        /// m.
        most: f64,
    },
    /// Play in a direction in which the joint has none to have.
    #[error(
        "it has one play: a ball, a pin that does not tilt or slides freely, and a block in a plane have no second"
    )]
    SecondPlay,
    /// Friction that follows the centres, which have no meaning for a pin.
    #[error("friction follows the velocity of the surfaces in joints other than ball joints")]
    FrictionVelocity,
    /// Line contact of a part that is no pin.
    #[error(
        "only a pin in its bearing has a line contact: elastic = \"line\" and stiffness_at are for revolute and cylindrical joints"
    )]
    LineContact,
    /// A stiffness that is none.
    #[error("stiffness = {0:e} N/m^1.5: must be above 0 N/m^1.5")]
    Stiffness(f64),
    /// A force at which the line contact has no depth.
    #[error("stiffness_at = {force:e} N: must be above 0 N and below {most:e} N, 4 pi E* L c / e^2")]
    StiffnessAt {
        /// N.
        force: f64,
        /// N.
        most: f64,
    },
    /// A start that only ball joints have.
    #[error("start = \"settled\" places balls in their sockets; with other joints with play, use \"equilibrium\"")]
    Settled,
}

impl LooseJoint {
    /// Checks the dimensions of its kind against its play.
    pub(super) fn check(&self, start: StartRule) -> Result<(), LooseFault> {
        let positive = |what, value: f64| {
            if value > 0.0 && value.is_finite() { Ok(()) } else { Err(LooseFault::Length { what, value }) }
        };
        let [radial, second] = self.contact.clearances();
        let limit = |play: f64, part, most: f64| {
            if play <= most { Ok(()) } else { Err(LooseFault::Play { play, part, most }) }
        };
        self.check_elasticity()?;
        match self.kind {
            LooseKind::Ball if second > 0.0 => return Err(LooseFault::SecondPlay),
            LooseKind::Ball => return Ok(()),
            LooseKind::Pin(Pin { length, kept, face_radius, .. }) => {
                positive("the radius", self.contact.ball_radius)?;
                limit(radial, "a tenth of the radius", 0.1 * self.contact.ball_radius)?;
                if let Some(length) = length {
                    positive("the length", length)?;
                    limit(radial, "a tenth of the length", 0.1 * length)?;
                    // Farther out, the ends no longer face each other.
                    limit(second, "a quarter of the length", 0.25 * length)?;
                }
                face_radius.map_or(Ok(()), |radius| positive("the radius of the faces", radius))?;
                if second > 0.0 && !(kept && length.is_some()) {
                    return Err(LooseFault::SecondPlay);
                }
            }
            LooseKind::Slide(Slide { half_length, half_width, half_height, corner_radius }) => {
                positive("the half length", half_length)?;
                positive("the half width", half_width)?;
                positive("the corner radius", corner_radius)?;
                limit(radial.max(second), "a tenth of the half length", 0.1 * half_length)?;
                limit(radial, "a tenth of the half width", 0.1 * half_width)?;
                match half_height {
                    Some(height) => {
                        positive("the half height", height)?;
                        limit(second, "a tenth of the half height", 0.1 * height)?;
                    }
                    None if second > 0.0 => return Err(LooseFault::SecondPlay),
                    None => {}
                }
            }
        }
        if self.contact.friction_velocity == contact::FrictionVelocity::Centres {
            return Err(LooseFault::FrictionVelocity);
        }
        if start == StartRule::Settled { Err(LooseFault::Settled) } else { Ok(()) }
    }

    /// Checks the elastic law against the kind and the play.
    fn check_elasticity(&self) -> Result<(), LooseFault> {
        let is_pin = matches!(self.kind, LooseKind::Pin(_));
        let positive = |value: f64| value > 0.0 && value.is_finite();
        let of_length = |length: f64| {
            if !is_pin {
                Err(LooseFault::LineContact)
            } else if positive(length) {
                Ok(())
            } else {
                Err(LooseFault::Length { what: "the length of the line contact", value: length })
            }
        };
        match self.contact.elasticity {
            Elasticity::Sphere => Ok(()),
            Elasticity::Stiffness(stiffness) if positive(stiffness) => Ok(()),
            Elasticity::Stiffness(stiffness) => Err(LooseFault::Stiffness(stiffness)),
            Elasticity::Line { length } => of_length(length),
            Elasticity::StiffnessAt { force, length } => {
                of_length(length)?;
                // Without play there is no contact.
                let most = match self.contact.clearance {
                    0.0 => f64::INFINITY,
                    clearance => ElasticLaw::largest_line_force(&self.contact, length, clearance),
                };
                if force > 0.0 && force < most { Ok(()) } else { Err(LooseFault::StiffnessAt { force, most }) }
            }
        }
    }

    /// Ball joint with default contact parameters and the drawn socket open towards -z.
    pub fn ball(name: &str, socket: Attachment, ball: Attachment) -> Self {
        Self {
            name: name.to_owned(),
            kind: LooseKind::Ball,
            frames: [socket.into(), ball.into()],
            opening: -Vec3::z(),
            contact: contact::Parameters::default(),
        }
    }

    /// The same joint with a radial clearance of `clearance`, m; 0 makes it ideal.
    pub fn with_clearance(mut self, clearance: f64) -> Self {
        self.contact.clearance = clearance;
        self
    }

    /// Origin of the carrier's frame: the socket's centre Z_i.
    pub fn carrier(&self) -> Attachment {
        self.frames[0].origin
    }

    /// Origin of the carried part's frame: the ball's centre Z_j.
    pub fn carried(&self) -> Attachment {
        self.frames[1].origin
    }
}
