// What a pass leaves where light is kept linear until `finish.wgsl`: light, or a colour of the theme if `given` is 1.
fn left(light: vec3<f32>, given: f32, pixel: vec2<f32>, opacity: f32) -> vec4<f32> {
    return vec4<f32>(min(light, vec3<f32>(BRIGHTEST)), opacity);
}
