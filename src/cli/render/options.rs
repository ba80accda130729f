//! Options of a picture: point of view, arrows, colours.

use eframe::egui::Rect;
use glam::Vec2;

use crate::app::{Strips, triad};
use crate::cli::args::{ArrowChoice, ArrowScale, CameraView, Hideable, RenderArguments, ThemeChoice, WearChoice};
use crate::cli::{Failure, quantity};
use crate::scene::Scene;
use crate::simulate::Frame;
use crate::view::{ArrowOptions, Camera, Preset, Quality, Scaling, SceneView, Swept, Theme, ViewOptions, WearMap};

/// Size of `area` in pixels, one per point.
pub fn size_of(area: Rect) -> [u32; 2] {
    [area.width(), area.height()].map(|edge| (edge as u32).max(1))
}

/// Point of view requested by `arguments`, at the frame of t = 0.
///
/// # Errors
/// Usage.
pub fn camera(
    arguments: &RenderArguments,
    scene: &Scene,
    view: &SceneView,
    frame: &Frame,
    options: &ViewOptions,
    strips: &Strips,
) -> Result<Camera, Failure> {
    positive("--zoom", f64::from(arguments.zoom), 1e3)?;
    let mut camera = view.camera();
    camera.preset(match arguments.camera {
        CameraView::Isometric => Preset::Isometric,
        CameraView::Front => Preset::Front,
        CameraView::Side => Preset::Side,
        CameraView::Top => Preset::Top,
    });
    if let Some(yaw) = &arguments.yaw {
        camera.yaw = quantity::angle("--yaw", yaw)? as f32;
    }
    if let Some(pitch) = &arguments.pitch {
        camera.pitch = (quantity::angle("--pitch", pitch)? as f32).clamp(-1.55, 1.55);
    }
    match &arguments.close_up {
        Some(name) => {
            let joint = scene.machine.loose_joints.iter().position(|joint| joint.name == *name).ok_or_else(|| {
                let names: Vec<&str> = scene.machine.loose_joints.iter().map(|joint| joint.name.as_str()).collect();
                Failure::usage(format!("--close-up {name}: no such joint with play; there are {}", names.join(", ")))
            })?;
            view.close_up(&mut camera, joint, scene, frame, options);
        }
        None => {
            let size = size_of(strips.scene);
            let plate = triad(strips.scene.translate(-strips.scene.min.to_vec2()));
            let plate = [plate.min, plate.max].map(|corner| Vec2::new(corner.x, corner.y));
            let plates = if arguments.overlay && options.triad { vec![plate] } else { Vec::new() };
            view.fit_around(&mut camera, scene, frame, options, size, &plates, &Swept::default());
        }
    }
    camera.distance /= arguments.zoom;
    Ok(camera)
}

/// View options requested by `arguments`.
///
/// # Errors
/// Usage.
pub fn view_options(arguments: &RenderArguments) -> Result<ViewOptions, Failure> {
    let magnification = arguments.magnification.unwrap_or(1.0);
    if !(1.0..=100.0).contains(&magnification) {
        return Err(Failure::usage(format!("--magnification {magnification}: allowed 1 to 100")));
    }
    let shown = |thing| !arguments.hide.contains(&thing);
    Ok(ViewOptions {
        theme: match arguments.theme {
            ThemeChoice::Light => Theme::Light,
            ThemeChoice::Dark => Theme::Dark,
        },
        magnification,
        arrows: ArrowOptions {
            normal: matches!(arguments.arrows, ArrowChoice::Both | ArrowChoice::Normal),
            friction: matches!(arguments.arrows, ArrowChoice::Both | ArrowChoice::Friction),
            scaling: match arguments.arrow_scale {
                ArrowScale::Linear => Scaling::Linear,
                ArrowScale::Logarithmic => Scaling::Logarithmic,
            },
            reference: match &arguments.arrow_reference {
                Some(force) => Some(quantity::force("--arrow-reference", force)? as f32),
                None => None,
            },
            peaks: shown(Hideable::Peaks),
            thickness: 1.0,
        },
        flash: shown(Hideable::Flash),
        floor: shown(Hideable::Floor),
        triad: shown(Hideable::Triad),
        joint_names: shown(Hideable::Names),
        hinges: shown(Hideable::Hinges),
        sockets: shown(Hideable::Sockets),
        // Fixed, so that the output is reproducible.
        quality: Quality::FULL,
        trail: shown(Hideable::Trail),
        wear: match arguments.wear {
            None => WearMap::Off,
            Some(WearChoice::Impulse) => WearMap::Impulse,
            Some(WearChoice::Friction) => WearMap::FrictionWork,
            Some(WearChoice::Depth) => WearMap::Depth,
        },
    })
}

/// Rejects a value outside 0 < `value` <= `most`.
///
/// # Errors
/// Usage.
pub fn positive(option: &str, value: f64, most: f64) -> Result<(), Failure> {
    if value > 0.0 && value <= most {
        return Ok(());
    }
    Err(Failure::usage(format!("{option} {value}: must be greater than 0 and at most {most}")))
}
