// The last pass: converts the drawn light to the bytes of a picture, in the current viewport.

// Light and, in the fourth channel, the share of theme colours; encoded colours in an 8-bit target.
@group(0) @binding(0) var drawn: texture_2d<f32>;

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
}

@vertex fn vs_finish(@builtin(vertex_index) i: u32) -> Corner {
    let uv = vec2<f32>(f32((i << 1u) & 2u), f32(i & 2u));
    var out: Corner;
    out.clip = vec4<f32>(uv.x * 2.0 - 1.0, 1.0 - uv.y * 2.0, 0.0, 1.0);
    out.uv = uv;
    return out;
}

fn pixel(in: Corner) -> vec2<f32> {
    return in.uv * vec2<f32>(textureDimensions(drawn));
}

fn texel(position: vec2<i32>) -> vec4<f32> {
    let last = vec2<i32>(textureDimensions(drawn)) - 1;
    return textureLoad(drawn, clamp(position, vec2<i32>(0), last), 0);
}

// Colour of a displayed pixel, interpolated between the four nearest where fewer pixels were drawn.
fn drawn_colour(in: Corner) -> vec4<f32> {
    let here = pixel(in);
    if (fwidth(here.x) > 0.95) {
        return texel(vec2<i32>(here));
    }
    let corner = vec2<i32>(floor(here - 0.5));
    let part = here - 0.5 - floor(here - 0.5);
    let above = mix(texel(corner), texel(corner + vec2<i32>(1, 0)), part.x);
    let below = mix(texel(corner + vec2<i32>(0, 1)), texel(corner + vec2<i32>(1, 1)), part.x);
    return mix(above, below, part.y);
}

@fragment fn fs_encode(in: Corner) -> @location(0) vec4<f32> {
    let c = drawn_colour(in);
    return vec4<f32>(encode(display(c.rgb, c.a), pixel(in)), 1.0);
}

// For a surface that encodes colours itself.
@fragment fn fs_display(in: Corner) -> @location(0) vec4<f32> {
    let c = drawn_colour(in);
    return vec4<f32>(display(c.rgb, c.a), 1.0);
}

@fragment fn fs_copy(in: Corner) -> @location(0) vec4<f32> {
    return vec4<f32>(drawn_colour(in).rgb, 1.0);
}

@fragment fn fs_decode(in: Corner) -> @location(0) vec4<f32> {
    return vec4<f32>(to_linear(drawn_colour(in).rgb), 1.0);
}
