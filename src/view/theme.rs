//! Colours of the picture, light and dark. Colours are sRGB-encoded here; the shader linearises them.

use crate::scene::Role;

/// Light or dark.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Theme {
    /// Dark things on a light background.
    #[default]
    Light,
    /// Light things on a dark background.
    Dark,
}

/// A colour: red, green, blue (sRGB-encoded) and opacity, each 0..=1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Colour(pub [f32; 4]);

impl Colour {
    /// From `0xRRGGBB`, opaque.
    pub const fn hex(rgb: u32) -> Self {
        Self([
            ((rgb >> 16) & 255) as f32 / 255.0,
            ((rgb >> 8) & 255) as f32 / 255.0,
            (rgb & 255) as f32 / 255.0,
            1.0,
        ])
    }

    /// The same colour with another opacity.
    pub const fn with_opacity(self, opacity: f32) -> Self {
        Self([self.0[0], self.0[1], self.0[2], opacity])
    }

    /// As 8-bit red, green, blue, opacity (not premultiplied): for a 2D painter.
    pub fn to_rgba8(self) -> [u8; 4] {
        self.0.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8)
    }
}

/// Colour and surface finish.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Base colour.
    pub colour: Colour,
    /// From 0 (mirror) to 1 (chalk).
    pub roughness: f32,
    /// From 0 (plastic) to 1 (metal).
    pub metal: f32,
}

impl Material {
    /// The same surface with another opacity.
    pub const fn with_opacity(self, opacity: f32) -> Self {
        Self {
            colour: self.colour.with_opacity(opacity),
            ..self
        }
    }
}

const fn material(rgb: u32, roughness: f32, metal: f32) -> Material {
    Material {
        colour: Colour::hex(rgb),
        roughness,
        metal,
    }
}

/// Which other state a ghost shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ghost {
    /// The neighbouring motion.
    Twin,
    /// The motion with every ball joint ideal.
    Ideal,
}

/// How a ghost is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GhostLook {
    /// Colour of its surfaces; full opacity applies along their edges.
    pub fill: Colour,
    /// Colour of its outline.
    pub edge: Colour,
    /// Outline width, points. The farther slice has the wider one: it shows around the nearer.
    pub width: f32,
    /// Depth slice that it is drawn in: 0 is in front of 1, and both in front of the machine, so that none interpenetrate.
    pub slice: f32,
}

const fn twin(fill: u32, opacity: f32, edge: u32) -> GhostLook {
    GhostLook {
        fill: Colour::hex(fill).with_opacity(opacity),
        edge: Colour::hex(edge),
        width: 1.4,
        slice: 0.0,
    }
}

const fn ideal(fill: u32, opacity: f32, edge: u32) -> GhostLook {
    GhostLook {
        width: 2.4,
        slice: 1.0,
        ..twin(fill, opacity, edge)
    }
}

/// All colours of one theme.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Palette {
    /// Top of the background.
    pub sky: Colour,
    /// Bottom of the background.
    pub ground: Colour,
    /// Floor plane.
    pub floor: Colour,
    /// Grid lines.
    pub grid: Colour,
    /// 2D text.
    pub text: Colour,
    /// Normal-force arrows.
    pub normal: Colour,
    /// Friction arrows.
    pub friction: Colour,
    /// Arrows of external forces.
    pub outside: Colour,
    /// Halo of a joint that was hit.
    pub flash: Colour,
    /// Gravity arrow.
    pub gravity: Colour,
    /// X, Y, Z of the triad.
    pub axes: [Colour; 3],
    /// Trail of the probe tip.
    pub trail: Colour,
    /// Balls.
    pub ball: Material,
    /// Sockets (opacity applies).
    pub socket: Material,
    /// The neighbouring motion, and the ideal one.
    ghosts: [GhostLook; 2],
    /// Factor on all light.
    pub exposure: f32,
}

impl Palette {
    /// Colours of `theme`. Orange and blue remain distinct for the colour-blind.
    pub const fn of(theme: Theme) -> Self {
        match theme {
            Theme::Light => Self {
                sky: Colour::hex(0xF5F7F9),
                ground: Colour::hex(0xD5DCE3),
                floor: Colour::hex(0xE3E8ED),
                grid: Colour::hex(0x8C99A6),
                text: Colour::hex(0x1E2A36),
                normal: Colour::hex(0xD9480F),
                friction: Colour::hex(0x1769C9),
                outside: Colour::hex(0x00796B),
                flash: Colour::hex(0xFFC61A),
                gravity: Colour::hex(0x6B3FA0),
                axes: [
                    Colour::hex(0xC92A2A),
                    Colour::hex(0x2B8A3E),
                    Colour::hex(0x1864AB),
                ],
                trail: Colour::hex(0xA61E4D),
                ball: material(0xD8DCE0, 0.22, 0.75),
                socket: material(0x6FA8DC, 0.15, 0.0).with_opacity(0.20),
                ghosts: [
                    twin(0x7B2FBE, 0.85, 0x5A189A),
                    ideal(0xFFFFFF, 0.9, 0x2F4858),
                ],
                exposure: 1.0,
            },
            Theme::Dark => Self {
                sky: Colour::hex(0x2A3138),
                ground: Colour::hex(0x181D22),
                floor: Colour::hex(0x2A323A),
                grid: Colour::hex(0x697785),
                text: Colour::hex(0xE6EBF0),
                normal: Colour::hex(0xFF7A33),
                friction: Colour::hex(0x4DABF7),
                outside: Colour::hex(0x2FD6BE),
                flash: Colour::hex(0xFFE27A),
                gravity: Colour::hex(0xB197FC),
                axes: [
                    Colour::hex(0xFF6B6B),
                    Colour::hex(0x69DB7C),
                    Colour::hex(0x4DABF7),
                ],
                trail: Colour::hex(0xF783AC),
                ball: material(0xE3E7EB, 0.22, 0.75),
                socket: material(0x8CC4F0, 0.15, 0.0).with_opacity(0.17),
                ghosts: [
                    twin(0xC9A0FF, 0.85, 0xE0C3FF),
                    ideal(0xFFFFFF, 0.5, 0xFFFFFF),
                ],
                exposure: 0.92,
            },
        }
    }

    /// How a ghost is drawn: the twin violet, the ideal pale.
    pub const fn ghost(&self, which: Ghost) -> GhostLook {
        self.ghosts[which as usize]
    }

    /// Material of a shape by its role; the same in both themes, so that a part keeps its colour.
    pub const fn material(&self, role: Role) -> Material {
        match role {
            Role::Slider => material(0x4C6A88, 0.45, 0.25),
            Role::DrivingRod => material(0x9AA9B8, 0.35, 0.55),
            Role::DrivenRod => material(0xE0A030, 0.40, 0.25),
            Role::Platform => material(0x2F9E8F, 0.50, 0.10),
            Role::Pin => material(0x59636E, 0.30, 0.70),
            Role::Probe => material(0xC2255C, 0.35, 0.10),
            Role::Rail => material(0x8A949E, 0.35, 0.60),
            Role::Frame => material(0x6C7680, 0.60, 0.20),
        }
    }
}
