// Lighting: all constants of the light, the surroundings, surfaces, and balls in their sockets.

// Light of a diffuse surface: from the key light, from the eye, and from the lowest and the highest part of the sky.
const KEY_DIFFUSE: f32 = 0.66;
const EYE_DIFFUSE: f32 = 0.12;
const LOW_DIFFUSE: f32 = 0.20;
const HIGH_DIFFUSE: f32 = 0.46;
// Strength of the key light's highlight.
const KEY_SPECULAR: f32 = 2.0;
// Reflectance of non-metals at normal incidence.
const DIELECTRIC_F0: f32 = 0.04;
// Remaining part of the reflected surroundings in shadow, and of the key light next to a wall.
const MIRROR_IN_SHADOW: f32 = 0.6;
const KEY_WHEN_NEAR: f32 = 0.45;
// Upper limit of light: more would outshine translucent parts in front of it, and make edges ragged.
const BRIGHTEST: f32 = 1.5;
// The studio: cosines of the half angles of its window, around the key light, and of its strip, on the other side; brightness
// of the strip relative to the window.
const WINDOW: f32 = 0.86;
const STRIP: f32 = 0.93;
const STRIP_LIGHT: f32 = 0.45;
// Occlusion where ball and wall touch, and its decay per drawn gap of a centred ball.
const OCCLUSION: f32 = 0.85;
const OCCLUSION_DECAY: f32 = 1.52;
// The rim around a contact point: cosine of its half angle seen from the ball's centre, and half its width, pixels.
const RIM: f32 = 0.9;
const RIM_WIDTH: f32 = 1.4;
// Glass: additional light and opacity of its edge, and opacity of its cut face, in opacities of the material; additional opacity
// near the ball; largest opacity.
const GLASS_EDGE_LIGHT: f32 = 0.15;
const GLASS_EDGE: f32 = 2.25;
const GLASS_CUT: f32 = 3.6;
const GLASS_OCCLUDED: f32 = 0.35;
const GLASS_MOST: f32 = 0.95;
// Remaining part of the floor's light in shadow.
const FLOOR_IN_SHADOW: f32 = 0.55;
// Distance from its surface at which a shadow is looked up, texels: facing the light, and in addition at grazing incidence.
const SHADOW_LIFT: vec2<f32> = vec2<f32>(1.0, 2.5);
// Brightness of a mark within its outline, where it faces away from the eye.
const MARK_EDGE: f32 = 0.8;

// A soft box around direction `to` (`size`: cosine of its half angle), seen in direction `d` and blurred by a rough surface.
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
    let f0 = mix(vec3<f32>(DIELECTRIC_F0), s.base, s.metal);
    let away = 1.0 - max(dot(h, v), 0.0);
    let away2 = away * away;
    let f = f0 + (1.0 - f0) * (away2 * away2 * away);
    let diffuse = s.base * (1.0 - s.metal);
    let key = (diffuse * KEY_DIFFUSE + f * (d * g * KEY_SPECULAR)) * (nl * shadow * globals.studio.x);
    let sky = mix(LOW_DIFFUSE, HIGH_DIFFUSE, 0.5 + 0.5 * dot(n, globals.up.xyz)) + EYE_DIFFUSE * nv;
    let turned = 1.0 - nv;
    let turned2 = turned * turned;
    let edge = f0 + (max(vec3<f32>(1.0 - s.roughness), f0) - f0) * (turned2 * turned2 * turned);
    // From behind, so that a part turned from the light stands out from a dark ground.
    let behind = globals.strip.w * turned2 * turned;
    let mirror = edge * (surroundings(reflect(-v, n), s.roughness) * mix(MIRROR_IN_SHADOW, 1.0, shadow));
    let around = diffuse * sky + mirror + mix(s.base, vec3<f32>(1.0), 0.5) * behind;
    return (key * mix(KEY_WHEN_NEAR, 1.0, open) + around * open) * globals.light.w;
}

// Part of the surrounding light that reaches a surface at a distance of `gaps` from a wall: 1 - 2 E3(x) for a plane whose shade
// falls off exponentially along each ray, to within 0.03.
fn unoccluded(gaps: f32) -> f32 {
    return 1.0 - OCCLUSION * globals.rim.w * exp(-OCCLUSION_DECAY * max(gaps, 0.0));
}

// Distance, m, from point p along n to the sphere around c: from a ball to the wall of its socket.
fn distance_to_wall(p: vec3<f32>, n: vec3<f32>, c: vec3<f32>, radius: f32) -> f32 {
    let q = p - c;
    let along = dot(q, n);
    return -along + sqrt(max(along * along + radius * radius - dot(q, q), 0.0));
}

// The rim around a contact point: `cosine` of the angle to it at the centre of the ball, `spread` its change over a pixel.
fn rim(cosine: f32, spread: f32, touch: f32) -> f32 {
    // On a silhouette, the change between neighbouring pixels means nothing.
    let pixels = abs(cosine - RIM) / clamp(spread, 1e-6, 0.12);
    return touch * (1.0 - smoothstep(RIM_WIDTH - 0.6, RIM_WIDTH + 0.6, pixels));
}
