// How things are lit: every constant of the light, the surroundings, surfaces, and spheres in their sockets.

// Light that a diffuse surface gives off: in the key light, towards the eye, and under the lowest and the highest sky.
const KEY_DIFFUSE: f32 = 0.66;
const EYE_DIFFUSE: f32 = 0.12;
const LOW_DIFFUSE: f32 = 0.20;
const HIGH_DIFFUSE: f32 = 0.46;
// Of the key light's highlight.
const KEY_SPECULAR: f32 = 2.0;
// Reflected by what is no metal, seen straight on.
const PLAIN: f32 = 0.04;
// What shadow leaves of the reflected surroundings, and nearness of the key light.
const MIRROR_IN_SHADOW: f32 = 0.6;
const KEY_WHEN_NEAR: f32 = 0.45;
// Brightest light that is kept: more would outshine what is translucent before it, and make edges ragged.
const BRIGHTEST: f32 = 1.5;
// The studio: cosines of half the width of its window, about the key light, and of its strip, on the other side; brightness
// of the strip against the window.
const WINDOW: f32 = 0.86;
const STRIP: f32 = 0.93;
const STRIP_LIGHT: f32 = 0.45;
// Occlusion where ball and wall touch; how fast it ends, in the drawn gap of a centred ball.
const OCCLUSION: f32 = 0.85;
const GAPS: f32 = 1.52;
// The rim about a touching point: cosine of its half angle seen from the ball's centre, and half its width, pixels.
const RIM: f32 = 0.9;
const RIM_WIDTH: f32 = 1.4;
// Glass: light and opacity that its edge has more, opacity of its cut face, in opacities of the material; where the ball is
// near; the most there is.
const GLASS_EDGE_LIGHT: f32 = 0.15;
const GLASS_EDGE: f32 = 2.25;
const GLASS_CUT: f32 = 3.6;
const GLASS_OCCLUDED: f32 = 0.35;
const GLASS_MOST: f32 = 0.95;
// What shadow leaves of the floor's light.
const FLOOR_IN_SHADOW: f32 = 0.55;
// How far from its surface a shadow is looked for, texels: facing the light, and more where it grazes.
const SHADOW_LIFT: vec2<f32> = vec2<f32>(1.0, 2.5);
// Brightness of a mark within its outline, where it turns away.
const MARK_EDGE: f32 = 0.8;

// A soft box of cosine `size` about `to`, seen in direction `d` by a surface that blurs it.
fn box(d: vec3<f32>, to: vec3<f32>, size: f32, roughness: f32) -> f32 {
    let blur = 0.02 + 0.55 * roughness * roughness;
    let seen = smoothstep(size - blur, size + min(blur, 1.0 - size), dot(d, to));
    return seen * (1.0 - size) / (1.0 - size + blur);
}

// Light of the studio from a direction, blurred as a surface of this roughness reflects it.
fn surroundings(d: vec3<f32>, roughness: f32) -> f32 {
    let up = globals.up.xyz;
    let height = dot(d, up);
    let sky = mix(globals.studio.y, globals.studio.z, smoothstep(-0.35 - roughness, 0.45 + roughness, height));
    let boxes = box(d, globals.light.xyz, WINDOW, roughness) + STRIP_LIGHT * box(d, globals.strip.xyz, STRIP, roughness);
    return sky + globals.studio.w * boxes;
}

struct Finish {
    base: vec3<f32>,
    roughness: f32,
    metal: f32,
}

// Outgoing light of a surface with normal n towards v: key light (Lambert and GGX), sky, a weak light from the eye, reflected
// studio. `shadow` is the share of the key light that arrives, `open` that of everything else.
fn shade(s: Finish, n: vec3<f32>, v: vec3<f32>, shadow: f32, open: f32) -> vec3<f32> {
    let l = globals.light.xyz;
    let h = normalize(l + v);
    let nl = max(dot(n, l), 0.0);
    let nv = max(dot(n, v), 1e-3);
    let nh = max(dot(n, h), 0.0);
    let a2 = s.roughness * s.roughness * s.roughness * s.roughness;
    let lobe = nh * nh * (a2 - 1.0) + 1.0;
    let d = a2 / (3.14159265 * lobe * lobe);
    let k = s.roughness * s.roughness * 0.5;
    let g = 0.25 / ((nl * (1.0 - k) + k) * (nv * (1.0 - k) + k));
    let f0 = mix(vec3<f32>(PLAIN), s.base, s.metal);
    let away = 1.0 - max(dot(h, v), 0.0);
    let away2 = away * away;
    let f = f0 + (1.0 - f0) * (away2 * away2 * away);
    let diffuse = s.base * (1.0 - s.metal);
    let key = (diffuse * KEY_DIFFUSE + f * (d * g * KEY_SPECULAR)) * (nl * shadow * globals.studio.x);
    let sky = mix(LOW_DIFFUSE, HIGH_DIFFUSE, 0.5 + 0.5 * dot(n, globals.up.xyz)) + EYE_DIFFUSE * nv;
    let turned = 1.0 - nv;
    let turned2 = turned * turned;
    let edge = f0 + (max(vec3<f32>(1.0 - s.roughness), f0) - f0) * (turned2 * turned2 * turned);
    let mirror = edge * (surroundings(reflect(-v, n), s.roughness) * mix(MIRROR_IN_SHADOW, 1.0, shadow));
    return (key * mix(KEY_WHEN_NEAR, 1.0, open) + (diffuse * sky + mirror) * open) * globals.light.w;
}

// What a wall at so many gaps' distance leaves of the light around a surface: 1 - 2 E3(x) for a plane whose shade falls off
// exponentially along each ray, within 0.03.
fn left_by_wall(gaps: f32) -> f32 {
    return 1.0 - OCCLUSION * globals.rim.w * exp(-GAPS * max(gaps, 0.0));
}

// Distance from a point p outside the middle along n to a sphere about c, m: that of the wall around a ball.
fn to_wall(p: vec3<f32>, n: vec3<f32>, c: vec3<f32>, radius: f32) -> f32 {
    let q = p - c;
    let along = dot(q, n);
    return -along + sqrt(max(along * along + radius * radius - dot(q, q), 0.0));
}

// The rim about the point where a ball touches: `out` is a direction from its centre, `spread` its change over a pixel.
fn rim(cosine: f32, spread: f32, touch: f32) -> f32 {
    // Where a surface turns away its neighbour pixels know nothing of it.
    let pixels = abs(cosine - RIM) / clamp(spread, 1e-6, 0.12);
    return touch * (1.0 - smoothstep(RIM_WIDTH - 0.6, RIM_WIDTH + 0.6, pixels));
}
