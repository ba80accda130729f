// Output of a pass to 8-bit targets: the encoded colour of light, or of the theme where `theme_share` is 1.
fn pass_output(light: vec3<f32>, theme_share: f32, pixel: vec2<f32>, opacity: f32) -> vec4<f32> {
    return vec4<f32>(encode(display(min(light, vec3<f32>(BRIGHTEST)), theme_share), pixel), opacity);
}
