// Conversion of light to the bytes of a picture. Only light is tone-mapped; colours of the theme are shown unchanged.

// Where the compression of highlights starts, and how fast they turn white.
const COMPRESSION_START: f32 = 0.76;
const DESATURATION: f32 = 0.15;

// Khronos PBR Neutral: below COMPRESSION_START, hue and saturation are preserved and the 4 % of white reflection are subtracted.
// https://github.com/KhronosGroup/ToneMapping/blob/main/PBR_Neutral/README.md
fn neutral(light: vec3<f32>) -> vec3<f32> {
    let least = min(light.r, min(light.g, light.b));
    let c = light - select(0.04, least - 6.25 * least * least, least < 0.08);
    let peak = max(c.r, max(c.g, c.b));
    let room = 1.0 - COMPRESSION_START;
    let bent = 1.0 - room * room / (max(peak, COMPRESSION_START) + room - COMPRESSION_START);
    let white = 1.0 - 1.0 / (DESATURATION * (peak - bent) + 1.0);
    return select(mix(c * bent / max(peak, COMPRESSION_START), vec3<f32>(bent), white), c, peak < COMPRESSION_START);
}

// `theme_share` is the share of theme colours in `light`.
fn display(light: vec3<f32>, theme_share: f32) -> vec3<f32> {
    let c = mix(neutral(max(light, vec3<f32>(0.0))), light, theme_share);
    return clamp(c, vec3<f32>(0.0), vec3<f32>(1.0));
}

// sRGB, dithered by half a step against banding.
fn encode(c: vec3<f32>, pixel: vec2<f32>) -> vec3<f32> {
    let encoded = select(1.055 * pow(c, vec3<f32>(1.0 / 2.4)) - 0.055, c * 12.92, c <= vec3<f32>(0.0031308));
    let noise = fract(52.9829189 * fract(dot(floor(pixel), vec2<f32>(0.06711056, 0.00583715)))) - 0.5;
    return encoded + noise / 255.0;
}

fn to_linear(c: vec3<f32>) -> vec3<f32> {
    return select(pow((c + 0.055) / 1.055, vec3<f32>(2.4)), c / 12.92, c <= vec3<f32>(0.04045));
}
