//! Colours of the picture, light and dark. Colours are sRGB-encoded here; the shader linearises them.

use crate::machine::Role;

/// Light or dark.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Theme {
    /// Dark objects on a light background.
    #[default]
    Light,
    /// Light objects on a dark background.
    Dark,
}

/// A colour: red, green, blue (sRGB-encoded) and opacity, each 0..=1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Colour(pub [f32; 4]);

impl Colour {
    /// From `0xRRGGBB`, opaque.
    pub const fn hex(rgb: u32) -> Self {
        Self([((rgb >> 16) & 255) as f32 / 255.0, ((rgb >> 8) & 255) as f32 / 255.0, (rgb & 255) as f32 / 255.0, 1.0])
    }

    /// Linear red, green and blue.
    pub fn linear(self) -> [f32; 3] {
        let [r, g, b, _] = self.0;
        [r, g, b].map(|c| if c > 0.04045 { ((c + 0.055) / 1.055).powf(2.4) } else { c / 12.92 })
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
        Self { colour: self.colour.with_opacity(opacity), ..self }
    }
}

const fn material(rgb: u32, roughness: f32, metal: f32) -> Material {
    Material { colour: Colour::hex(rgb), roughness, metal }
}

/// Bare steel.
const fn metal(rgb: u32) -> Material {
    material(rgb, 0.30, 0.85)
}

/// Aluminium with a coloured skin.
const fn anodised(rgb: u32) -> Material {
    material(rgb, 0.38, 0.45)
}

/// Paint.
const fn painted(rgb: u32) -> Material {
    material(rgb, 0.48, 0.0)
}

/// Clear glass with a tint.
const fn glass(rgb: u32, opacity: f32) -> Material {
    material(rgb, 0.12, 0.0).with_opacity(opacity)
}

/// Which other state a ghost shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ghost {
    /// The neighbouring motion.
    Twin,
    /// The motion with every joint ideal.
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
    GhostLook { fill: Colour::hex(fill).with_opacity(opacity), edge: Colour::hex(edge), width: 1.9, slice: 0.0 }
}

const fn ideal(fill: u32, opacity: f32, edge: u32) -> GhostLook {
    GhostLook { width: 2.9, slice: 1.0, ..twin(fill, opacity, edge) }
}

/// Colour of the light or the dark theme.
const fn pick(dark: bool, light_theme: u32, dark_theme: u32) -> Colour {
    Colour::hex(if dark { dark_theme } else { light_theme })
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
    /// Arrows of the forces of lubricants.
    pub lubricant: Colour,
    /// Arrows of external forces.
    pub external: Colour,
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
    /// Brightness of the key light, and of the reflected ground, sky and window of the studio.
    pub studio: [f32; 4],
    /// Brightness of the light along the edges of parts.
    pub behind: f32,
    /// Outline of arrows.
    pub outline: Colour,
    /// Rim around a contact point.
    pub rim: Colour,
}

impl Palette {
    /// Colours of `theme`. Those of forces remain distinct from each other and from an amber rod for the colour-blind.
    pub const fn of(theme: Theme) -> Self {
        let dark = matches!(theme, Theme::Dark);
        Self {
            sky: pick(dark, 0xF5F7F9, 0x2A3138),
            ground: pick(dark, 0xD5DCE3, 0x181D22),
            floor: pick(dark, 0xE3E8ED, 0x232A31),
            grid: pick(dark, 0x8C99A6, 0x56626E),
            text: pick(dark, 0x1E2A36, 0xE6EBF0),
            normal: pick(dark, 0xB83818, 0xFF6B6B),
            friction: pick(dark, 0x1769C9, 0x4DABF7),
            lubricant: pick(dark, 0xB07900, 0xFFD43B),
            external: pick(dark, 0x00796B, 0x2FD6BE),
            flash: pick(dark, 0xFFC61A, 0xFFE27A),
            gravity: pick(dark, 0x6B3FA0, 0xB197FC),
            axes: [pick(dark, 0xC92A2A, 0xFF6B6B), pick(dark, 0x27803A, 0x69DB7C), pick(dark, 0x1864AB, 0x4DABF7)],
            trail: pick(dark, 0xA61E4D, 0xF783AC),
            ball: material(if dark { 0xE3E7EB } else { 0xD8DCE0 }, 0.22, 0.75),
            socket: if dark { glass(0x8CC4F0, 0.17) } else { glass(0x6FA8DC, 0.20) },
            ghosts: if dark {
                [twin(0xC9A0FF, 0.85, 0xE0C3FF), ideal(0xFFFFFF, 0.16, 0xFFFFFF)]
            } else {
                [twin(0x7B2FBE, 0.85, 0x5A189A), ideal(0xFFFFFF, 0.3, 0x2F4858)]
            },
            exposure: if dark { 1.2 } else { 1.0 },
            studio: if dark { [1.0, 0.3, 0.62, 2.2] } else { [1.0, 0.42, 0.95, 2.2] },
            behind: if dark { 0.3 } else { 0.0 },
            outline: pick(dark, 0x20262C, 0x0B0E11),
            rim: pick(dark, 0xFFD43B, 0xFFF6C2),
        }
    }

    /// How a ghost is drawn: the twin violet, the ideal little more than its outline, since it lies on the machine.
    pub const fn ghost(&self, which: Ghost) -> GhostLook {
        self.ghosts[which as usize]
    }

    /// Material of a shape by its role; the same in both themes, so that a part keeps its colour.
    pub const fn material(&self, role: Role) -> Material {
        match role {
            Role::Slider => anodised(0x4C6A88),
            Role::DrivingRod => metal(0x9AA9B8),
            Role::DrivenRod => anodised(0xE0A030),
            Role::Platform => painted(0x2F9E8F),
            Role::Pin => metal(0x6B7580),
            Role::Probe => painted(0xC2255C),
            Role::Rail => metal(0x8A949E),
            Role::Frame => painted(0x6C7680),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Linear colours as a dichromat sees them: G. M. Machado, M. M. Oliveira, L. A. F. Fernandes, A Physiologically-based
    /// Model for Simulation of Color Vision Deficiency, IEEE TVCG 15 (2009), severity 1.0.
    const VISIONS: [(&str, [[f32; 3]; 3]); 3] = [
        ("full", [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
        (
            "protanopia",
            [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
        ),
        (
            "deuteranopia",
            [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
        ),
    ];

    /// Least CIE 1976 difference: a difference of 2.3 can just be seen side by side.
    const MIN_DIFFERENCE: f32 = 25.0;

    fn product(rows: [[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
        rows.map(|row| (0..3).map(|i| row[i] * v[i]).sum())
    }

    /// CIE L*a*b* under D65 of linear sRGB.
    fn lab(light: [f32; 3]) -> [f32; 3] {
        const XYZ: [[f32; 3]; 3] = [
            [0.412_456_4, 0.357_576_1, 0.180_437_5],
            [0.212_672_9, 0.715_152_2, 0.072_175],
            [0.019_333_9, 0.119_192, 0.950_304_1],
        ];
        let [x, y, z] = product(XYZ, light.map(|c| c.clamp(0.0, 1.0)));
        let [x, y, z] = [x / 0.95047, y, z / 1.08883]
            .map(|t| if t > 216.0 / 24389.0 { t.cbrt() } else { (24389.0 / 27.0 * t + 16.0) / 116.0 });
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    #[test]
    fn force_colours_are_distinguishable_from_each_other_and_from_an_amber_rod_with_any_colour_vision() {
        for theme in [Theme::Light, Theme::Dark] {
            let palette = Palette::of(theme);
            let rod = palette.material(Role::DrivenRod).colour;
            let marks = [palette.normal, palette.friction, palette.external, rod];
            for (eye, vision) in VISIONS {
                let seen = marks.map(|colour| lab(product(vision, colour.linear())));
                for (i, a) in seen.iter().enumerate() {
                    for (j, b) in seen.iter().enumerate().skip(i + 1) {
                        let squares = (0..3).map(|k| (a[k] - b[k]).powi(2));
                        let difference = squares.sum::<f32>().sqrt();
                        assert!(difference > MIN_DIFFERENCE, "{theme:?} {eye} {i} {j}: {difference}");
                    }
                }
            }
        }
    }
}
