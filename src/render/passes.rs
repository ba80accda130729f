//! The passes of a picture, in order: what each draws, with which shader, blending and depth test.

use super::wgpu;
use wgpu::CompareFunction::{Always, Greater, Less, LessEqual};
use wgpu::Face::{self, Back, Front};

/// Content that a pass draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PassContent {
    /// The whole picture.
    FullScreen,
    /// The floor, where the list has one.
    Floor,
    /// Lines, hidden by solids in front of them.
    Lines,
    /// Lines in front of everything.
    Marks,
    /// Instances of meshes.
    Meshes(Group),
}

/// Instances that are drawn together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Group {
    Solid,
    /// Solid balls in sockets.
    Balls,
    Faded,
    Halos,
    Sockets,
    Wear,
    ClearBalls,
    Ghost,
    GhostEdges,
    Arrows,
    Overlay,
    /// Shadow casters: all solid, faded and clear instances, seen from the light.
    Casters,
}

impl Group {
    /// Number of groups.
    pub const COUNT: usize = Self::Casters as usize + 1;
}

/// Blending of a pass with the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Blend {
    /// Depth only.
    Nothing,
    /// Replaces.
    Opaque,
    /// Shaded light, blended by its opacity.
    Light,
    /// A colour of the theme, blended by its opacity; the last pass does not tone-map its share.
    Theme,
}

/// One pass.
#[derive(Debug)]
pub(super) struct Pass {
    pub label: &'static str,
    pub draws: PassContent,
    pub vertex: &'static str,
    /// `None`: depth seen from the light, to the shadow map.
    pub fragment: Option<&'static str>,
    pub blend: Blend,
    pub cull: Option<Face>,
    pub compare: wgpu::CompareFunction,
    pub write_depth: bool,
}

/// An opaque pass with depth test.
const fn solid(label: &'static str, group: Group, fragment: &'static str) -> Pass {
    Pass {
        label,
        draws: PassContent::Meshes(group),
        vertex: "vs_mesh",
        fragment: Some(fragment),
        blend: Blend::Opaque,
        cull: Some(Back),
        compare: Less,
        write_depth: true,
    }
}

/// A translucent pass.
const fn clear(label: &'static str, group: Group, fragment: &'static str, blend: Blend) -> Pass {
    Pass { blend, write_depth: false, ..solid(label, group, fragment) }
}

/// A pass without meshes.
const fn flat(label: &'static str, draws: PassContent, vertex: &'static str, fragment: &'static str) -> Pass {
    Pass { draws, vertex, cull: None, ..clear(label, Group::Solid, fragment, Blend::Theme) }
}

/// All passes: one to the shadow map, the others to the picture. The last, `shaders/finish.wgsl`, is `finish.rs`.
pub(super) const PASSES: &[Pass] = &[
    Pass { vertex: "vs_shadow", fragment: None, ..solid("shadow", Group::Casters, "") },
    Pass {
        blend: Blend::Opaque,
        compare: Always,
        ..flat("background", PassContent::FullScreen, "vs_background", "fs_background")
    },
    solid("solid", Group::Solid, "fs_solid"),
    Pass { vertex: "vs_joint", ..solid("balls", Group::Balls, "fs_ball") },
    flat("floor", PassContent::Floor, "vs_floor", "fs_floor"),
    flat("lines", PassContent::Lines, "vs_line", "fs_line"),
    clear("faded", Group::Faded, "fs_faded", Blend::Light),
    clear("halos", Group::Halos, "fs_halo", Blend::Theme),
    // The mesh has both sides of its faces, in an order that is from far to near for any line of sight.
    Pass { vertex: "vs_joint", ..clear("sockets", Group::Sockets, "fs_socket", Blend::Light) },
    // After the sockets, whose glass would tint their colours.
    Pass { cull: None, compare: Always, ..clear("wear behind others", Group::Wear, "fs_wear_behind", Blend::Theme) },
    solid("wear", Group::Wear, "fs_wear"),
    Pass { vertex: "vs_joint", ..clear("clear balls", Group::ClearBalls, "fs_clear_ball", Blend::Light) },
    // Only the nearest surface of a ghost is drawn; otherwise its back parts would show through in patches.
    Pass { vertex: "vs_ghost", blend: Blend::Nothing, ..solid("ghost, depth", Group::Ghost, "fs_ghost") },
    Pass {
        vertex: "vs_ghost",
        // The same vertices as in the depth pass.
        compare: LessEqual,
        ..clear("ghost", Group::Ghost, "fs_ghost", Blend::Theme)
    },
    Pass {
        vertex: "vs_ghost_edge",
        cull: Some(Front),
        blend: Blend::Theme,
        ..solid("ghost, outline", Group::GhostEdges, "fs_ghost_edge")
    },
    // After the sockets, so that glass does not dim a force.
    Pass { compare: Always, ..flat("marks", PassContent::Marks, "vs_line", "fs_line") },
    Pass { compare: Greater, ..clear("arrows behind others", Group::Arrows, "fs_mark_behind", Blend::Theme) },
    solid("arrows", Group::Arrows, "fs_mark"),
    Pass { vertex: "vs_overlay", ..solid("overlay", Group::Overlay, "fs_overlay") },
];

impl Pass {
    /// Whether it draws to the shadow map.
    pub fn is_shadow_pass(&self) -> bool {
        self.fragment.is_none()
    }

    /// Its blend state. The fourth channel of the picture is the share of the theme's colours in it.
    pub fn blend_state(&self) -> Option<wgpu::BlendState> {
        let over = |source| wgpu::BlendComponent {
            src_factor: source,
            dst_factor: wgpu::BlendFactor::OneMinusSrcAlpha,
            operation: wgpu::BlendOperation::Add,
        };
        let share = match self.blend {
            Blend::Nothing | Blend::Opaque => return None,
            Blend::Light => wgpu::BlendFactor::Zero,
            Blend::Theme => wgpu::BlendFactor::One,
        };
        Some(wgpu::BlendState { color: over(wgpu::BlendFactor::SrcAlpha), alpha: over(share) })
    }
}
