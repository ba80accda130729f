//! The user's settings for the picture.

use super::Theme;
use super::WearMap;

/// All user settings for the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewOptions {
    /// Light or dark.
    pub theme: Theme,
    /// Factor on eccentricity and clearance together, 1..=100. It is reduced where a socket would become too large
    /// ([`super::DrawList::magnification`]).
    pub magnification: f32,
    /// Contact-force arrows.
    pub arrows: ArrowOptions,
    /// Whether a joint that was hit lights up.
    pub flash: bool,
    /// Floor grid.
    pub floor: bool,
    /// Axis triad with gravity, in the lower left corner.
    pub triad: bool,
    /// Names of the joints with play beside them.
    pub joint_names: bool,
    /// Pins and rails of hinges and slides that the scene does not draw itself.
    pub hinges: bool,
    /// Draw sockets; without them only the balls are shown.
    pub sockets: bool,
    /// Rendering quality.
    pub quality: Quality,
    /// Draw the caller's trail.
    pub trail: bool,
    /// Quantity shown on the sockets' inner faces; balls then become translucent.
    pub wear: WearMap,
}

impl Default for ViewOptions {
    fn default() -> Self {
        Self {
            theme: Theme::Light,
            magnification: 1.0,
            arrows: ArrowOptions::default(),
            flash: true,
            floor: true,
            triad: true,
            joint_names: true,
            hinges: true,
            sockets: true,
            quality: Quality::FULL,
            trail: true,
            wear: WearMap::Off,
        }
    }
}

/// Rendering quality of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Ambient occlusion between balls and sockets.
    pub occlusion: bool,
    /// Samples per pixel, 4 or 1.
    pub samples: u32,
    /// Shadow map of full size with soft edges; otherwise of half the side, with hard edges.
    pub fine_shadows: bool,
    /// Resolution along each edge of the picture, as a fraction of its pixels.
    pub sharpness: f32,
}

impl Quality {
    /// All features.
    pub const FULL: Self = Self::LADDER[0];

    /// Quality levels for a slow window: each row drops one more feature.
    pub const LADDER: [Self; 6] = [
        Self::row(true, 4, true, 1.0),
        Self::row(false, 4, true, 1.0),
        Self::row(false, 1, true, 1.0),
        Self::row(false, 1, false, 1.0),
        Self::row(false, 1, false, 0.75),
        Self::row(false, 1, false, 0.5),
    ];

    const fn row(occlusion: bool, samples: u32, fine_shadows: bool, sharpness: f32) -> Self {
        Self { occlusion, samples, fine_shadows, sharpness }
    }
}

/// How contact forces are drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct ArrowOptions {
    /// Draw normal forces (including the reactions of ideal joints).
    pub normal: bool,
    /// Draw friction forces.
    pub friction: bool,
    /// Length against force.
    pub scaling: Scaling,
    /// Force of the reference length, N; `None` follows the largest recent force.
    pub reference: Option<f32>,
    /// Mark past peaks of the normal force.
    pub peaks: bool,
    /// Factor on the thickness, usually 1; larger for a projector.
    pub thickness: f32,
}

impl Default for ArrowOptions {
    fn default() -> Self {
        Self { normal: true, friction: true, scaling: Scaling::Linear, reference: None, peaks: true, thickness: 1.0 }
    }
}

/// Length of an arrow against its force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scaling {
    /// Proportional.
    Linear,
    /// Logarithmic over the three decades below the reference force.
    Logarithmic,
}
