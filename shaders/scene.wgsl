// The picture: background, solids with one shadow, floor, lines, translucent sockets, marks in front of everything.
// Input colours are sRGB-encoded and shaded in linear space; `finish` encodes, the only place that does.

struct Globals {
    clip_from_world: mat4x4<f32>,
    light_from_world: mat4x4<f32>,
    eye: vec4<f32>,
    // xyz: towards the light; w: exposure
    light: vec4<f32>,
    // xyz: up; w: width of a shadow texel, m
    up: vec4<f32>,
    background_top: vec4<f32>,
    background_bottom: vec4<f32>,
    // width and height of the picture, pixels; 1 / size of the shadow map
    picture: vec4<f32>,
    // xyz: centre; w: radius
    floor_centre: vec4<f32>,
    // xyz: along the lines; w: spacing
    floor_along: vec4<f32>,
    floor_colour: vec4<f32>,
    floor_lines: vec4<f32>,
}

@group(0) @binding(0) var<uniform> globals: Globals;
@group(1) @binding(0) var shadow_map: texture_depth_2d;
@group(1) @binding(1) var shadow_sampler: sampler_comparison;

fn to_linear(c: vec3<f32>) -> vec3<f32> {
    return select(pow((c + 0.055) / 1.055, vec3<f32>(2.4)), c / 12.92, c <= vec3<f32>(0.04045));
}

// Encodes to sRGB, dithered by half a step against banding.
fn finish(linear: vec3<f32>, pixel: vec2<f32>, opacity: f32) -> vec4<f32> {
    let c = clamp(linear, vec3<f32>(0.0), vec3<f32>(1.0));
    let encoded = select(1.055 * pow(c, vec3<f32>(1.0 / 2.4)) - 0.055, c * 12.92, c <= vec3<f32>(0.0031308));
    let noise = fract(52.9829189 * fract(dot(floor(pixel), vec2<f32>(0.06711056, 0.00583715)))) - 0.5;
    return vec4<f32>(encoded + noise / 255.0, opacity);
}

// Fraction of the key light that reaches a point: 3 x 3 filtered comparisons.
fn lit(world: vec3<f32>, normal: vec3<f32>) -> f32 {
    let grazing = 1.0 - max(dot(normal, globals.light.xyz), 0.0);
    let lifted = world + normal * globals.up.w * (1.0 + 2.5 * grazing);
    let clip = globals.light_from_world * vec4<f32>(lifted, 1.0);
    let uv = vec2<f32>(0.5 + 0.5 * clip.x, 0.5 - 0.5 * clip.y);
    let depth = min(clip.z, 1.0);
    var sum = 0.0;
    for (var i = -1; i <= 1; i++) {
        for (var j = -1; j <= 1; j++) {
            let at = uv + vec2<f32>(f32(i), f32(j)) * 1.6 * globals.picture.z;
            sum += textureSampleCompareLevel(shadow_map, shadow_sampler, at, depth);
        }
    }
    let outside = any(uv < vec2<f32>(0.0)) || any(uv > vec2<f32>(1.0));
    return select(sum / 9.0, 1.0, outside);
}

// Environment light from a direction: bright above, with a studio window; dim below.
fn surroundings(direction: vec3<f32>, roughness: f32) -> f32 {
    let height = dot(direction, globals.up.xyz);
    let sky = mix(0.22, 0.85, smoothstep(-0.5 - roughness, 0.6 + roughness, height));
    let window = smoothstep(0.55 - 0.3 * roughness, 0.75 + 0.3 * roughness, height) * (1.0 - roughness);
    return sky + 0.5 * window;
}

// Outgoing light of an opaque surface: hemisphere, key light (Lambert and GGX), a weak light from the eye.
fn shade(base: vec3<f32>, roughness: f32, metal: f32, n: vec3<f32>, v: vec3<f32>, shadow: f32) -> vec3<f32> {
    let l = globals.light.xyz;
    let h = normalize(l + v);
    let nl = max(dot(n, l), 0.0);
    let nv = max(dot(n, v), 1e-3);
    let nh = max(dot(n, h), 0.0);
    let a2 = pow(roughness, 4.0);
    let d = a2 / (3.14159265 * pow(nh * nh * (a2 - 1.0) + 1.0, 2.0));
    let k = roughness * roughness * 0.5;
    let g = 0.25 / ((nl * (1.0 - k) + k) * (nv * (1.0 - k) + k));
    let f0 = mix(vec3<f32>(0.04), base, metal);
    let f = f0 + (1.0 - f0) * pow(1.0 - max(dot(h, v), 0.0), 5.0);
    let diffuse = base * (1.0 - metal);
    let key = (diffuse * 0.30 + f * d * g * 0.95) * nl * 2.3 * shadow;
    let fill = diffuse * 0.13 * nv;
    let hemisphere = mix(0.17, 0.42, 0.5 + 0.5 * dot(n, globals.up.xyz));
    let edge = f0 + (max(vec3<f32>(1.0 - roughness), f0) - f0) * pow(1.0 - nv, 5.0);
    let mirror = edge * surroundings(reflect(-v, n), roughness) * mix(0.55, 1.0, shadow);
    return (key + fill + diffuse * hemisphere + mirror * mix(0.6, 0.9, metal)) * globals.light.w;
}

// ---- meshes

struct Vertex {
    // xyz: position; w: 1 on a socket's inner face, 2 and 3 on its cut face at the outer and inner edge
    @location(0) position: vec4<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) row_0: vec4<f32>,
    @location(3) row_1: vec4<f32>,
    @location(4) row_2: vec4<f32>,
    @location(5) colour: vec4<f32>,
    // roughness, metal, inner radius
    @location(6) surface: vec4<f32>,
}

struct Surface {
    @builtin(position) clip: vec4<f32>,
    @location(0) world: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) colour: vec4<f32>,
    // roughness, metal, 1 on a cut face
    @location(3) surface: vec3<f32>,
}

fn place(in: Vertex) -> Surface {
    let cut = step(1.5, in.position.w);
    let inner = in.position.w - 2.0 * cut;
    let p = vec4<f32>(in.position.xyz * mix(1.0, in.surface.z, inner), 1.0);
    let world = vec3<f32>(dot(in.row_0, p), dot(in.row_1, p), dot(in.row_2, p));
    // The cofactor matrix transforms normals correctly under any scaling.
    let x = in.row_0.xyz;
    let y = in.row_1.xyz;
    let z = in.row_2.xyz;
    let n = vec3<f32>(dot(cross(y, z), in.normal), dot(cross(z, x), in.normal), dot(cross(x, y), in.normal));
    var out: Surface;
    out.world = world;
    out.clip = globals.clip_from_world * vec4<f32>(world, 1.0);
    out.normal = normalize(n);
    out.colour = in.colour;
    out.surface = vec3<f32>(in.surface.xy, cut);
    return out;
}

@vertex fn vs_mesh(in: Vertex) -> Surface {
    return place(in);
}

@vertex fn vs_overlay(in: Vertex) -> Surface {
    var out = place(in);
    // In front of everything else, but depth-sorted among themselves.
    out.clip.z *= 0.001;
    return out;
}

// In front of everything but the triad, each ghost in its own depth slice (its `metal`): it interpenetrates neither the
// machine nor another ghost, but is depth-sorted in itself.
fn before_all(clip: vec4<f32>, slice: f32) -> vec4<f32> {
    return vec4<f32>(clip.xy, 0.001 * (clip.z + (1.0 + slice) * clip.w), clip.w);
}

@vertex fn vs_ghost(in: Vertex) -> Surface {
    var out = place(in);
    out.clip = before_all(out.clip, in.surface.y);
    return out;
}

// Its far side, expanded by the outline width (its `roughness`, pixels): what shows around the near side is the outline.
@vertex fn vs_ghost_edge(in: Vertex) -> Surface {
    var out = place(in);
    let n = globals.clip_from_world * vec4<f32>(out.normal, 0.0);
    let along = (n.xy * out.clip.w - out.clip.xy * n.w) * globals.picture.xy;
    let grown = along / max(length(along), 1e-9) * (2.0 * in.surface.x / globals.picture.xy) * out.clip.w;
    out.clip = before_all(out.clip, in.surface.y) + vec4<f32>(grown, 0.0, 0.0);
    return out;
}

@vertex fn vs_shadow(in: Vertex) -> @builtin(position) vec4<f32> {
    return globals.light_from_world * vec4<f32>(place(in).world, 1.0);
}

@fragment fn fs_solid(in: Surface) -> @location(0) vec4<f32> {
    let n = normalize(in.normal);
    let v = normalize(globals.eye.xyz - in.world);
    let base = to_linear(in.colour.rgb);
    let colour = shade(base, in.surface.x, in.surface.y, n, v, lit(in.world, n));
    return finish(colour, in.clip.xy, in.colour.a);
}

// Marks keep their colour: just enough shading to show their shape.
fn mark(in: Surface) -> vec3<f32> {
    let n = normalize(in.normal);
    let v = normalize(globals.eye.xyz - in.world);
    return to_linear(in.colour.rgb) * (0.55 + 0.30 * max(dot(n, v), 0.0) + 0.30 * max(dot(n, globals.light.xyz), 0.0));
}

@fragment fn fs_mark(in: Surface) -> @location(0) vec4<f32> {
    return finish(mark(in), in.clip.xy, 1.0);
}

@fragment fn fs_mark_behind(in: Surface) -> @location(0) vec4<f32> {
    return finish(mark(in), in.clip.xy, 0.6);
}

// A cell of a wear map: its colour is a value.
@fragment fn fs_wear(in: Surface) -> @location(0) vec4<f32> {
    return finish(to_linear(in.colour.rgb), in.clip.xy, 1.0);
}

// The same where something is in front of it, or where it is seen from behind, through the wall.
@fragment fn fs_wear_behind(in: Surface) -> @location(0) vec4<f32> {
    return finish(to_linear(in.colour.rgb), in.clip.xy, 0.5);
}

// Another state of the machine, translucent: most opaque along its edges.
@fragment fn fs_ghost(in: Surface) -> @location(0) vec4<f32> {
    let facing = max(dot(normalize(in.normal), normalize(globals.eye.xyz - in.world)), 0.0);
    let edge = pow(1.0 - facing, 1.5);
    return finish(to_linear(in.colour.rgb), in.clip.xy, in.colour.a * mix(0.3, 1.0, edge));
}

@fragment fn fs_ghost_edge(in: Surface) -> @location(0) vec4<f32> {
    return finish(to_linear(in.colour.rgb), in.clip.xy, in.colour.a);
}

// Halo of a joint that was hit: a ring outside its socket, which hides nothing of the contact.
@fragment fn fs_halo(in: Surface) -> @location(0) vec4<f32> {
    let facing = max(dot(normalize(in.normal), normalize(globals.eye.xyz - in.world)), 0.0);
    // The socket's outline lies where this sphere, of 1.7 times its radius, has `facing` = 0.81.
    let ring = smoothstep(0.1, 0.65, facing) * (1.0 - smoothstep(0.7, 0.79, facing));
    return finish(to_linear(in.colour.rgb) * 1.15, in.clip.xy, 0.85 * in.colour.a * ring);
}

@fragment fn fs_socket(in: Surface, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    let n = normalize(select(-in.normal, in.normal, front));
    let v = normalize(globals.eye.xyz - in.world);
    let facing = max(dot(n, v), 0.0);
    let cut = in.surface.z;
    let rim = pow(1.0 - facing, 3.0);
    let base = to_linear(in.colour.rgb);
    let colour = shade(base, in.surface.x, in.surface.y, n, v, 1.0) + rim * 0.15;
    let opacity = in.colour.a * mix(1.0 + 2.25 * rim, 3.6, cut);
    return finish(colour, in.clip.xy, min(opacity, 0.95));
}

// ---- background

@vertex fn vs_background(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
    let corner = vec2<f32>(f32((i << 1u) & 2u), f32(i & 2u));
    return vec4<f32>(corner * 2.0 - 1.0, 1.0, 1.0);
}

@fragment fn fs_background(@builtin(position) clip: vec4<f32>) -> @location(0) vec4<f32> {
    let height = smoothstep(0.0, 1.0, clip.y / globals.picture.y);
    let colour = mix(globals.background_top.rgb, globals.background_bottom.rgb, height);
    return finish(to_linear(colour), clip.xy, 1.0);
}

// ---- floor

struct FloorPoint {
    @builtin(position) clip: vec4<f32>,
    @location(0) world: vec3<f32>,
    // From the centre, m, along and across the lines.
    @location(1) plane: vec2<f32>,
}

@vertex fn vs_floor(@builtin(vertex_index) i: u32) -> FloorPoint {
    let corner = vec2<f32>(f32(i & 1u), f32(i >> 1u)) * 2.0 - 1.0;
    var out: FloorPoint;
    out.plane = corner * globals.floor_centre.w;
    let across = cross(globals.up.xyz, globals.floor_along.xyz);
    out.world = globals.floor_centre.xyz + globals.floor_along.xyz * out.plane.x + across * out.plane.y;
    out.clip = globals.clip_from_world * vec4<f32>(out.world, 1.0);
    return out;
}

// Coverage by lines of a grid of the given spacing, `width` pixels wide; fades where lines crowd.
fn grid(plane: vec2<f32>, spacing: f32, width: f32) -> f32 {
    let at = plane / spacing;
    let step = max(fwidth(at), vec2<f32>(1e-6));
    let away = abs(fract(at - 0.5) - 0.5) / step;
    let lines = clamp(vec2<f32>(0.5 + 0.5 * width) - away, vec2<f32>(0.0), vec2<f32>(1.0));
    let room = 1.0 - smoothstep(vec2<f32>(0.08), vec2<f32>(0.35), step);
    let seen = lines * room;
    return max(seen.x, seen.y);
}

@fragment fn fs_floor(in: FloorPoint) -> @location(0) vec4<f32> {
    let thin = grid(in.plane, globals.floor_along.w, 1.0);
    let thick = grid(in.plane, globals.floor_along.w * 10.0, 1.6);
    let above = dot(globals.eye.xyz - in.world, globals.up.xyz) > 0.0;
    let fade = 1.0 - smoothstep(0.25, 1.0, length(in.plane) / globals.floor_centre.w);
    let light = mix(0.55, 1.0, lit(in.world, globals.up.xyz));
    let plane = to_linear(globals.floor_colour.rgb) * light;
    let lines = to_linear(globals.floor_lines.rgb) * light;
    let colour = mix(plane, lines, max(0.25 * thin, 0.6 * thick));
    return finish(colour, in.clip.xy, fade * select(0.3, 1.0, above));
}

// ---- lines

struct LineEnds {
    // xyz: point; w: width, pixels
    @location(0) start: vec4<f32>,
    @location(1) end: vec4<f32>,
    @location(2) start_colour: vec4<f32>,
    @location(3) end_colour: vec4<f32>,
}

struct LinePoint {
    @builtin(position) clip: vec4<f32>,
    @location(0) colour: vec4<f32>,
}

@vertex fn vs_line(in: LineEnds, @builtin(vertex_index) i: u32) -> LinePoint {
    var a = globals.clip_from_world * vec4<f32>(in.start.xyz, 1.0);
    var b = globals.clip_from_world * vec4<f32>(in.end.xyz, 1.0);
    // An end behind the eye is clipped to the near plane (z = 0); otherwise its projection would be inverted.
    if (a.z < 0.0) { a = mix(a, b, a.z / (a.z - b.z)); }
    if (b.z < 0.0) { b = mix(b, a, b.z / (b.z - a.z)); }
    let along = (b.xy / b.w - a.xy / a.w) * globals.picture.xy;
    let across = vec2<f32>(-along.y, along.x) / max(length(along), 1e-6);
    let at_end = (i & 1u) == 1u;
    let side = f32(i >> 1u) * 2.0 - 1.0;
    var out: LinePoint;
    out.clip = select(a, b, at_end);
    out.clip.x += across.x * side * in.start.w / globals.picture.x * out.clip.w;
    out.clip.y += across.y * side * in.start.w / globals.picture.y * out.clip.w;
    out.colour = select(in.start_colour, in.end_colour, at_end);
    return out;
}

@fragment fn fs_line(in: LinePoint) -> @location(0) vec4<f32> {
    return finish(to_linear(in.colour.rgb), in.clip.xy, in.colour.a);
}
