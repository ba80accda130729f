// What a pass leaves where only 8 bits are kept: the encoded colour of light, or of the theme if `given` is 1.
fn left(light: vec3<f32>, given: f32, pixel: vec2<f32>, opacity: f32) -> vec4<f32> {
    return vec4<f32>(encode(display(min(light, vec3<f32>(BRIGHTEST)), given), pixel), opacity);
}
