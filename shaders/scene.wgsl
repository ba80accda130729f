// The picture: background, solids with one shadow, floor, lines, translucent sockets, marks in front of everything.
// Colours of the theme are linear, those of lines encoded. `pass_output` is that of `linear.wgsl` or `encoded.wgsl`.

struct Globals {
    clip_from_world: mat4x4<f32>,
    light_from_world: mat4x4<f32>,
    eye: vec4<f32>,
    // xyz: towards the light; w: exposure
    light: vec4<f32>,
    // xyz: up; w: width of a shadow texel, m
    up: vec4<f32>,
    // brightness of the key light, the ground, the sky and the studio's window
    studio: vec4<f32>,
    // xyz: towards the studio's strip; w: light along the edges of parts
    strip: vec4<f32>,
    // w: comparisons for a shadow on either side of the middle one
    background_top: vec4<f32>,
    background_bottom: vec4<f32>,
    // width and height of the picture, pixels; 1 / size of the shadow map; half width of a shadow's edge, texels
    picture: vec4<f32>,
    // xyz: centre; w: radius
    floor_centre: vec4<f32>,
    // xyz: along the lines; w: spacing
    floor_along: vec4<f32>,
    floor_colour: vec4<f32>,
    floor_lines: vec4<f32>,
    // xyz: colour around marks; w: width, pixels
    outline: vec4<f32>,
    // xyz: colour around contact points; w: occlusion, 0 or 1
    rim: vec4<f32>,
}

@group(0) @binding(0) var<uniform> globals: Globals;
@group(1) @binding(0) var shadow_map: texture_depth_2d;
@group(1) @binding(1) var shadow_sampler: sampler_comparison;

// A colour of the theme.
fn theme_colour(colour: vec3<f32>, pixel: vec4<f32>, opacity: f32) -> vec4<f32> {
    return pass_output(colour, 1.0, pixel.xy, opacity);
}

// Fraction of the key light that reaches a point: 3 x 3 filtered comparisons, or one.
fn lit(world: vec3<f32>, normal: vec3<f32>) -> f32 {
    let grazing = 1.0 - max(dot(normal, globals.light.xyz), 0.0);
    let lifted = world + normal * globals.up.w * (SHADOW_LIFT.x + SHADOW_LIFT.y * grazing);
    let clip = globals.light_from_world * vec4<f32>(lifted, 1.0);
    let uv = vec2<f32>(0.5 + 0.5 * clip.x, 0.5 - 0.5 * clip.y);
    let depth = min(clip.z, 1.0);
    let apart = globals.picture.w * globals.picture.z;
    let outside = any(uv < vec2<f32>(0.0)) || any(uv > vec2<f32>(1.0));
    // No comparisons outside the map. Software adapters run both sides of a branch, but skip a loop that no pixel enters.
    let around = select(i32(globals.background_top.w), -1, outside);
    var sum = 0.0;
    for (var i = -around; i <= around; i++) {
        for (var j = -around; j <= around; j++) {
            let at = uv + vec2<f32>(f32(i), f32(j)) * apart;
            sum += textureSampleCompareLevel(shadow_map, shadow_sampler, at, depth);
        }
    }
    return select(sum / f32((2 * around + 1) * (2 * around + 1)), 1.0, outside);
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
    // The sphere that this one faces: from centre to centre, m; w: its radius, 0 without one
    @location(7) other: vec4<f32>,
    // xyz: direction from the ball's centre to the contact point; w: 1 during contact
    @location(8) touch: vec4<f32>,
}

struct Surface {
    @builtin(position) clip: vec4<f32>,
    @location(0) world: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) @interpolate(flat) colour: vec4<f32>,
    // roughness, metal
    @location(3) @interpolate(flat) surface: vec2<f32>,
}

// The ball or the socket of a ball joint.
struct Jointed {
    @builtin(position) clip: vec4<f32>,
    @location(0) world: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) @interpolate(flat) colour: vec4<f32>,
    // roughness, metal, 1 on a cut face
    @location(3) @interpolate(flat) surface: vec3<f32>,
    // From the mesh's origin, m.
    @location(4) local: vec3<f32>,
    @location(5) @interpolate(flat) other: vec4<f32>,
    @location(6) @interpolate(flat) touch: vec4<f32>,
}

fn rotated_and_scaled(in: Vertex, p: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(dot(in.row_0.xyz, p), dot(in.row_1.xyz, p), dot(in.row_2.xyz, p));
}

fn origin(in: Vertex) -> vec3<f32> {
    return vec3<f32>(in.row_0.w, in.row_1.w, in.row_2.w);
}

// The cofactor matrix transforms normals correctly under any scaling.
fn normal(in: Vertex) -> vec3<f32> {
    let x = in.row_0.xyz;
    let y = in.row_1.xyz;
    let z = in.row_2.xyz;
    return normalize(vec3<f32>(dot(cross(y, z), in.normal), dot(cross(z, x), in.normal), dot(cross(x, y), in.normal)));
}

fn place(in: Vertex) -> Surface {
    var out: Surface;
    out.world = rotated_and_scaled(in, in.position.xyz) + origin(in);
    out.clip = globals.clip_from_world * vec4<f32>(out.world, 1.0);
    out.normal = normal(in);
    out.colour = in.colour;
    out.surface = in.surface.xy;
    return out;
}

@vertex fn vs_joint(in: Vertex) -> Jointed {
    let cut = step(1.5, in.position.w);
    let inner = in.position.w - 2.0 * cut;
    var out: Jointed;
    out.local = rotated_and_scaled(in, in.position.xyz * mix(1.0, in.surface.z, inner));
    out.world = out.local + origin(in);
    out.clip = globals.clip_from_world * vec4<f32>(out.world, 1.0);
    out.normal = normal(in);
    out.colour = in.colour;
    out.surface = vec3<f32>(in.surface.xy, cut);
    out.other = in.other;
    out.touch = in.touch;
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

// The far side of a ghost, expanded by the outline width (its `roughness`, pixels): the part around the near side is the outline.
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

fn towards_eye(world: vec3<f32>) -> vec3<f32> {
    return normalize(globals.eye.xyz - world);
}

// Light of an opaque surface.
fn solid(in: Surface) -> vec3<f32> {
    let n = normalize(in.normal);
    let finish = Finish(in.colour.rgb, in.surface.x, in.surface.y);
    return shade(finish, n, towards_eye(in.world), lit(in.world, n), 1.0);
}

@fragment fn fs_solid(in: Surface) -> @location(0) vec4<f32> {
    return pass_output(solid(in), 0.0, in.clip.xy, 0.0);
}

@fragment fn fs_faded(in: Surface) -> @location(0) vec4<f32> {
    return pass_output(solid(in), 0.0, in.clip.xy, in.colour.a);
}

// Light of a ball: darker near the wall of its socket, with a rim around the contact point.
fn ball(in: Jointed) -> vec3<f32> {
    let n = normalize(in.normal);
    let cosine = dot(n, in.touch.xyz);
    let ring = rim(cosine, fwidth(cosine), in.touch.w);
    var open = 1.0;
    if (in.other.w > 0.0) {
        let gap = in.other.w - length(in.local);
        open = unoccluded(distance_to_wall(in.local, n, in.other.xyz, in.other.w) / gap);
    }
    let finish = Finish(in.colour.rgb, in.surface.x, in.surface.y);
    let light = shade(finish, n, towards_eye(in.world), lit(in.world, n), open);
    return mix(light, globals.rim.rgb, ring);
}

@fragment fn fs_ball(in: Jointed) -> @location(0) vec4<f32> {
    return pass_output(ball(in), 0.0, in.clip.xy, 0.0);
}

@fragment fn fs_clear_ball(in: Jointed) -> @location(0) vec4<f32> {
    return pass_output(ball(in), 0.0, in.clip.xy, in.colour.a);
}

// Marks have their own colour within an outline; they are slightly darker where they face away, which shows their shape.
fn mark(in: Surface) -> vec3<f32> {
    let facing = dot(normalize(in.normal), towards_eye(in.world));
    let shape = mix(MARK_EDGE, 1.0, smoothstep(0.2, 0.75, facing));
    // Pixels from the edge.
    let inside = facing / max(fwidth(facing), 1e-6);
    let width = globals.outline.w;
    // Most of the width of a thin mark is coloured.
    let body = max(smoothstep(width - 0.5, width + 0.5, inside), smoothstep(0.45, 0.7, facing));
    return mix(globals.outline.rgb, in.colour.rgb * shape, body);
}

// The triad is drawn only over the background, so it needs no outline.
@fragment fn fs_overlay(in: Surface) -> @location(0) vec4<f32> {
    let facing = dot(normalize(in.normal), towards_eye(in.world));
    return theme_colour(in.colour.rgb * mix(MARK_EDGE, 1.0, smoothstep(0.2, 0.75, facing)), in.clip, 1.0);
}

@fragment fn fs_mark(in: Surface) -> @location(0) vec4<f32> {
    return theme_colour(mark(in), in.clip, 1.0);
}

@fragment fn fs_mark_behind(in: Surface) -> @location(0) vec4<f32> {
    return theme_colour(mark(in), in.clip, 0.6);
}

// A cell of a wear map: its colour is a value.
@fragment fn fs_wear(in: Surface) -> @location(0) vec4<f32> {
    return theme_colour(in.colour.rgb, in.clip, 1.0);
}

// The same where something is in front of it, or where it is seen from behind, through the wall.
@fragment fn fs_wear_behind(in: Surface) -> @location(0) vec4<f32> {
    return theme_colour(in.colour.rgb, in.clip, 0.5);
}

// Another state of the machine, translucent: most opaque along its edges.
@fragment fn fs_ghost(in: Surface) -> @location(0) vec4<f32> {
    let facing = max(dot(normalize(in.normal), towards_eye(in.world)), 0.0);
    let edge = pow(1.0 - facing, 1.5);
    return theme_colour(in.colour.rgb, in.clip, in.colour.a * mix(0.5, 1.0, edge));
}

@fragment fn fs_ghost_edge(in: Surface) -> @location(0) vec4<f32> {
    return theme_colour(in.colour.rgb, in.clip, in.colour.a);
}

// Halo of a joint that was hit: a ring outside its socket, so that the contact stays visible.
@fragment fn fs_halo(in: Surface) -> @location(0) vec4<f32> {
    let facing = max(dot(normalize(in.normal), towards_eye(in.world)), 0.0);
    // `facing` relative to its value on the outline of the socket, whose radius is `surface.y` times that of this sphere.
    let out = facing / sqrt(1.0 - in.surface.y * in.surface.y);
    let ring = smoothstep(0.12, 0.8, out) * (1.0 - smoothstep(0.865, 0.975, out));
    return theme_colour(in.colour.rgb, in.clip, 0.85 * in.colour.a * ring);
}

// Glass, darker where the ball is near, with a rim around the contact point.
@fragment fn fs_socket(in: Jointed) -> @location(0) vec4<f32> {
    let from_ball = in.local - in.other.xyz;
    let cosine = dot(from_ball, in.touch.xyz) / max(length(from_ball), 1e-9);
    let near = in.other.w / max(length(from_ball), 1e-9);
    let ring = rim(cosine, fwidth(cosine), in.touch.w * smoothstep(0.9, 0.95, near));
    let cut = in.surface.z;
    let n = normalize(in.normal);
    let facing = max(dot(n, towards_eye(in.world)), 0.0);
    let edge = (1.0 - facing) * (1.0 - facing) * (1.0 - facing);
    let gap = max(length(in.local) - in.other.w, 1e-9);
    let open = unoccluded((length(from_ball) - in.other.w) / gap);
    let finish = Finish(in.colour.rgb, in.surface.x, in.surface.y);
    let light = shade(finish, n, towards_eye(in.world), 1.0, open) + edge * GLASS_EDGE_LIGHT;
    let glass = in.colour.a * mix(1.0 + GLASS_EDGE * edge, GLASS_CUT, cut);
    let opacity = min(glass + GLASS_OCCLUDED * (1.0 - open) * step(0.1, in.colour.a), GLASS_MOST);
    return pass_output(mix(light, globals.rim.rgb, ring), 0.0, in.clip.xy, max(opacity, ring));
}

// ---- background

@vertex fn vs_background(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
    let corner = vec2<f32>(f32((i << 1u) & 2u), f32(i & 2u));
    return vec4<f32>(corner * 2.0 - 1.0, 1.0, 1.0);
}

@fragment fn fs_background(@builtin(position) clip: vec4<f32>) -> @location(0) vec4<f32> {
    let height = smoothstep(0.0, 1.0, clip.y / globals.picture.y);
    let colour = mix(globals.background_top.rgb, globals.background_bottom.rgb, height);
    return theme_colour(colour, clip, 1.0);
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

// Coverage of a pixel by the lines of a grid of the given spacing, `width` pixels wide: the share that they cover, not a sample,
// so that there is no moire. `step` is the size of a pixel in spacings.
fn grid(at: vec2<f32>, step: vec2<f32>, width: f32) -> f32 {
    let line = min(step * width, vec2<f32>(1.0));
    let reach = max(step, line);
    let away = abs(fract(at - 0.5) - 0.5);
    let near = clamp(0.5 + (0.5 * line - away) / reach, vec2<f32>(0.0), vec2<f32>(1.0));
    // Dense lines are drawn as their mean, and even denser lines not at all.
    let crowd = smoothstep(vec2<f32>(0.15), vec2<f32>(0.5), step);
    let seen = mix(near, line, crowd) * (1.0 - smoothstep(vec2<f32>(0.3), vec2<f32>(0.9), step));
    return max(seen.x, seen.y);
}

@fragment fn fs_floor(in: FloorPoint) -> @location(0) vec4<f32> {
    let at = in.plane / globals.floor_along.w;
    let step = max(length2(dpdx(at), dpdy(at)), vec2<f32>(1e-6));
    let thin = grid(at, step, 1.0);
    let thick = grid(at * 0.1, step * 0.1, 1.6);
    let above = dot(globals.eye.xyz - in.world, globals.up.xyz) > 0.0;
    let fade = 1.0 - smoothstep(0.25, 1.0, length(in.plane) / globals.floor_centre.w);
    let light = mix(FLOOR_IN_SHADOW, 1.0, lit(in.world, globals.up.xyz));
    let colour = mix(globals.floor_colour.rgb, globals.floor_lines.rgb, max(0.25 * thin, 0.6 * thick));
    return theme_colour(colour * light, in.clip, fade * select(0.3, 1.0, above));
}

// Change over a pixel of each component, whatever its direction.
fn length2(x: vec2<f32>, y: vec2<f32>) -> vec2<f32> {
    return sqrt(x * x + y * y);
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
    let colour = select(in.start_colour, in.end_colour, at_end);
    out.colour = vec4<f32>(to_linear(colour.rgb), colour.a);
    return out;
}

@fragment fn fs_line(in: LinePoint) -> @location(0) vec4<f32> {
    return theme_colour(in.colour.rgb, in.clip, in.colour.a);
}
