// Output of a pass to linear targets, which `finish.wgsl` encodes: light, or a colour of the theme where `theme_share` is 1.
fn pass_output(light: vec3<f32>, theme_share: f32, pixel: vec2<f32>, opacity: f32) -> vec4<f32> {
    return vec4<f32>(min(light, vec3<f32>(BRIGHTEST)), opacity);
}
