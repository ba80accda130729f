//! Joints with play.

use super::{Attachment, Doubt, Quat, StartRule, Vec3};
use crate::contact::{self, ElasticLaw, Elasticity};
use crate::units::{format_quantity, format_quantity_digits};
use crate::words::words;

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
    /// Name of its kind of joint in files.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Ball => "spherical",
            Self::Pin(pin) if pin.kept => "revolute",
            Self::Pin(_) => "cylindrical",
            Self::Slide(_) => "prismatic",
        }
    }

    /// Words for the carried part and for its carrier.
    pub fn parts(&self) -> [&'static str; 2] {
        match self {
            Self::Ball => ["ball", "socket"],
            Self::Pin(_) => ["pin", "bearing"],
            Self::Slide(_) => ["block", "guide"],
        }
    }

    /// Names of the places where it can touch; empty if there is only one. Of a pin the ends of the axis, at -L/2 and +L/2, and the
    /// faces of its collars, towards +axis and -axis; of a block its corners, 1 for - - - to 8 for + + + of x, y, z, each with the
    /// axis across its wall.
    pub fn site_names(&self) -> &'static [&'static str] {
        match self {
            Self::Ball | Self::Pin(Pin { length: None, .. }) => &[],
            Self::Pin(Pin { kept: true, .. }) => &["a", "b", "front", "back"],
            Self::Pin(_) => &["a", "b"],
            Self::Slide(Slide { half_height: None, .. }) => &["1y", "3y", "5y", "7y"],
            Self::Slide(_) => {
                &["1y", "1z", "2y", "2z", "3y", "3z", "4y", "4z", "5y", "5z", "6y", "6z", "7y", "7z", "8y", "8z"]
            }
        }
    }

    /// The play that its place `place`, an index among [`Self::site_names`], limits: 0, or 1 for the second.
    pub fn play_of(&self, place: u8) -> usize {
        match self {
            Self::Ball => 0,
            Self::Pin(_) => usize::from(place > 1),
            Self::Slide(_) => {
                let name = self.site_names().get(usize::from(place));
                usize::from(name.is_some_and(|name| name.ends_with('z')))
            }
        }
    }

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
    /// How far the longer of pin and bearing reaches beyond the other, to each side, m: displaced farther, an end touches nothing.
    /// `None` if that is not known.
    pub travel: Option<f64>,
}

impl Pin {
    /// Length L, m. The part that stays in its plane has none: 1.2 of its radii stand for it where one must be, as in the picture and
    /// in areas of wear.
    pub fn seat_length(&self, radius: f64) -> f64 {
        self.length.unwrap_or(1.2 * radius)
    }

    /// Outer radius of the collars' faces, m: 1.3 radii of the pin stand for it if they touch on the axis.
    pub fn collar_radius(&self, radius: f64) -> f64 {
        self.face_radius.unwrap_or(1.3 * radius)
    }
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

words!(EndsOn {
    Bearing => "bearing",
    Pin => "pin",
});

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

impl Slide {
    /// Half of its height, m. A block that stays in its plane has none: 0.6 of its half width stand for it where one must be, as in the
    /// picture and in areas of wear.
    pub fn seat_half_height(&self) -> f64 {
        self.half_height.unwrap_or(0.6 * self.half_width)
    }
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
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum LooseFault {
    /// A dimension that is not a length.
    #[error("{} is no dimension; allowed above 0 mm; units m, cm, mm, um", format_quantity(*.value, "mm"))]
    Length {
        /// Its key in files.
        key: &'static str,
        /// m.
        value: f64,
    },
    /// Play so large that the geometry, which is linear in it, is wrong.
    #[error(
        "the play {} is above {part}; allowed 0 mm to {}; units m, cm, mm, um",
        format_quantity(*.play, "mm"),
        format_quantity(*.most, "mm")
    )]
    Play {
        /// Its key in files.
        key: &'static str,
        /// m.
        play: f64,
        /// The part of a dimension that bounds it.
        part: &'static str,
        /// m.
        most: f64,
    },
    /// Play in a direction in which the joint has none to have.
    #[error(
        "has no second play: a ball, a pin that slides freely, and a pin or a block that stays in a plane have one"
    )]
    SecondPlay {
        /// Its key in files.
        key: &'static str,
    },
    /// Friction that follows the centres, which have no meaning for a pin.
    #[error("friction follows the velocity of the surfaces in joints other than ball joints; allowed surface")]
    FrictionVelocity,
    /// Line contact of a part that is no pin.
    #[error(
        "only a pin in its bearing has a line contact: elastic = \"line\" and stiffness_at are for revolute and cylindrical joints"
    )]
    LineContact,
    /// A stiffness that is none.
    #[error("{0:e} N/m^1.5 is no stiffness; allowed above 0 N/m^1.5")]
    Stiffness(f64),
    /// A force at which the line contact has no depth.
    #[error(
        "a line contact has no depth at {}; allowed above 0 N to below {}, 4 pi E* L c/e^2; units N, kN",
        format_quantity(*.force, "N"),
        format_quantity_digits(*.most, "N", 4)
    )]
    StiffnessAt {
        /// N.
        force: f64,
        /// N.
        most: f64,
    },
    /// A wear coefficient that is none.
    #[error("{0:e} m^2/N is no wear coefficient; allowed 0 m^2/N and above")]
    WearCoefficient(f64),
    /// Wear of a joint whose surface is not known.
    #[error("no area to spread the wear over: {why}; allowed without it 0 m^2/N")]
    NoWearingArea {
        /// The key that tells it.
        key: &'static str,
        /// What is missing.
        why: &'static str,
    },
    /// A start that only ball joints have.
    #[error("settled places balls in their sockets; with other joints with play, allowed as-given, ideal, equilibrium")]
    Settled,
}

impl LooseFault {
    /// Last parts of the keys involved, the likelier cause first.
    pub(super) fn parts(&self) -> [&'static str; 2] {
        match *self {
            Self::Length { key, .. } | Self::SecondPlay { key } => [key, "play"],
            Self::Play { key, part, .. } => {
                let dimension = match part.rsplit(' ').next() {
                    Some("radius") => "play.radius",
                    Some("half_y") => "play.half_y",
                    Some("half_z") => "play.half_z",
                    _ if part.ends_with("half length") => "play.half_length",
                    _ => "play.length",
                };
                [key, dimension]
            }
            Self::FrictionVelocity => ["friction_velocity", "friction_velocity"],
            Self::Settled => ["start", "start"],
            Self::LineContact => ["play.elastic", "play.stiffness_at"],
            Self::Stiffness(_) => ["play.stiffness", "play.stiffness"],
            Self::WearCoefficient(_) => ["wear_coefficient", "wear_coefficient"],
            Self::NoWearingArea { key, .. } => ["wear_coefficient", key],
            Self::StiffnessAt { .. } => ["play.stiffness_at", "play.radial"],
        }
    }
}

impl LooseJoint {
    /// Checks the dimensions of its kind against its play.
    pub(super) fn check(&self, start: StartRule) -> Result<(), LooseFault> {
        let positive = |key, value: f64| {
            if value > 0.0 && value.is_finite() { Ok(()) } else { Err(LooseFault::Length { key, value }) }
        };
        let [radial, second] = self.contact.clearances();
        let limit = |key, play: f64, part, most: f64| {
            if play <= most { Ok(()) } else { Err(LooseFault::Play { key, play, part, most }) }
        };
        self.check_elasticity()?;
        self.check_wear()?;
        match self.kind {
            LooseKind::Ball if second > 0.0 => return Err(LooseFault::SecondPlay { key: "play" }),
            LooseKind::Ball => return Ok(()),
            LooseKind::Pin(Pin { length, kept, face_radius, travel, .. }) => {
                positive("play.radius", self.contact.ball_radius)?;
                limit("play.radial", radial, "a tenth of the radius", 0.1 * self.contact.ball_radius)?;
                if let Some(length) = length {
                    positive("play.length", length)?;
                    limit("play.radial", radial, "a tenth of the length", 0.1 * length)?;
                    // Farther out, the ends no longer face each other.
                    limit("play.axial", second, "a quarter of the length", 0.25 * length)?;
                }
                face_radius.map_or(Ok(()), |radius| positive("play.face_radius", radius))?;
                travel.map_or(Ok(()), |travel| positive("play.travel", travel))?;
                if second > 0.0 && !(kept && length.is_some()) {
                    return Err(LooseFault::SecondPlay { key: "play.axial" });
                }
            }
            LooseKind::Slide(Slide { half_length, half_width, half_height, corner_radius }) => {
                positive("play.half_length", half_length)?;
                positive("play.half_y", half_width)?;
                positive("play.corner_radius", corner_radius)?;
                limit("play.y", radial, "a tenth of the half length", 0.1 * half_length)?;
                limit("play.z", second, "a tenth of the half length", 0.1 * half_length)?;
                limit("play.y", radial, "a tenth of half_y", 0.1 * half_width)?;
                match half_height {
                    Some(height) => {
                        positive("play.half_z", height)?;
                        limit("play.z", second, "a tenth of half_z", 0.1 * height)?;
                    }
                    None if second > 0.0 => return Err(LooseFault::SecondPlay { key: "play.z" }),
                    None => {}
                }
            }
        }
        if self.contact.friction_velocity == contact::FrictionVelocity::Centres {
            return Err(LooseFault::FrictionVelocity);
        }
        if start == StartRule::Settled { Err(LooseFault::Settled) } else { Ok(()) }
    }

    /// The doubt about a pin whose play is not small against its length: the error of its gap is 2 r c/L^2 of the play c.
    pub(super) fn short_pin(&self) -> Option<Doubt> {
        let LooseKind::Pin(Pin { length: Some(length), .. }) = self.kind else { return None };
        let (play, radius) = (self.contact.clearance, self.contact.ball_radius);
        let most = length * length / (80.0 * radius);
        (play > most).then(|| Doubt::ShortPin { joint: self.name.clone(), play, radius, length, most })
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
                Err(LooseFault::Length { key: "play.length", value: length })
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

    /// Name of its site `place`: that of the joint, then that of the site if it has several.
    pub fn site_name(&self, place: u8) -> String {
        match self.kind.site_names().get(usize::from(place)) {
            Some(site) => format!("{}.{site}", self.name),
            None => self.name.clone(),
        }
    }

    /// Names of its sites, by place.
    pub fn sites(&self) -> Vec<String> {
        (0..self.kind.site_names().len().max(1)).map(|place| self.site_name(place as u8)).collect()
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
