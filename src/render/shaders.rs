//! The shaders. WGSL has no includes: a module is the concatenation of its files.

use super::wgpu;

/// A module: its name, its files, their text.
pub(super) struct Module {
    pub name: &'static str,
    #[cfg_attr(not(test), expect(dead_code, reason = "tests look for unused files"))]
    pub files: &'static [&'static str],
    pub text: &'static str,
}

macro_rules! module {
    ($name:literal: $($file:literal),+) => {
        Module {
            name: $name,
            files: &[$($file),+],
            text: concat!($(include_str!(concat!("../../shaders/", $file))),+),
        }
    };
}

/// All passes but the last, for linear light.
pub(super) const LINEAR: Module = module!("scene": "colour.wgsl", "light.wgsl", "linear.wgsl", "scene.wgsl");
/// The same for light encoded by each pass.
pub(super) const ENCODED: Module = module!("scene, encoded": "colour.wgsl", "light.wgsl", "encoded.wgsl", "scene.wgsl");
/// The last pass.
pub(super) const FINISH: Module = module!("finish": "colour.wgsl", "finish.wgsl");

pub(super) fn module(device: &wgpu::Device, module: &Module) -> wgpu::ShaderModule {
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(module.name),
        source: wgpu::ShaderSource::Wgsl(module.text.into()),
    })
}
