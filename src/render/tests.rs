//! Tests on pixels. They need a graphics adapter; software Vulkan will do.

use glam::Vec3;

use super::wgpu::naga;
use super::{Image, Offscreen, RenderError, shaders};
use crate::machine::Vec3 as Vec3d;
use crate::scene::Scene;
use crate::simulate::{ContactMode, Frame, Simulation};
use crate::view::{
    Camera, Colour, DrawList, Ghost, Palette, PeakMarks, Preset, SceneView, Shot, Theme, ViewOptions, WearMap,
    WearScale, fixture, to_f32,
};

const SIZE: [u32; 2] = [480, 360];

fn offscreen() -> Offscreen {
    Offscreen::new().expect("a graphics adapter: these tests need one, software is enough (mesa-vulkan-drivers)")
}

/// Bare options: only the machine and its floor.
fn bare() -> ViewOptions {
    let mut options = ViewOptions { triad: false, hinges: false, magnification: 20.0, ..Default::default() };
    (options.arrows.normal, options.arrows.friction) = (false, false);
    options
}

fn picture(scene: &Scene, frame: &Frame, options: &ViewOptions, camera: &Camera, hit: bool) -> DrawList {
    picture_of(SIZE, scene, frame, options, camera, hit)
}

fn picture_of(
    size: [u32; 2],
    scene: &Scene,
    frame: &Frame,
    options: &ViewOptions,
    camera: &Camera,
    hit: bool,
) -> DrawList {
    let view = SceneView::new(scene, frame);
    let mut marks = PeakMarks::new();
    let peaks = if hit { fixture::hits(frame) } else { Vec::new() };
    marks.update(frame, &peaks, f64::INFINITY);
    let mut list = DrawList::default();
    let shot = Shot { scene, frame, marks: &marks, options, camera, trail: &[], size, pixels_per_point: 1.0 };
    view.build(&shot, &mut list);
    list
}

/// Close-up of the pendulum's joint: scene, frame and camera.
fn close_up(options: &ViewOptions) -> (Scene, Frame, Camera) {
    let (scene, frame) = fixture::pendulum();
    let view = SceneView::new(&scene, &frame);
    let mut camera = view.camera();
    view.close_up(&mut camera, 0, &scene, &frame, options);
    (scene, frame, camera)
}

fn at(image: &Image, camera: &Camera, point: Vec3) -> [u8; 3] {
    let pixel = camera.project(point, SIZE).expect("before the eye");
    image.pixel(pixel.x as u32, pixel.y as u32)
}

fn brightness(pixel: [u8; 3]) -> i32 {
    pixel.iter().map(|&c| i32::from(c)).sum()
}

/// Largest difference of a channel.
fn difference(a: [u8; 3], b: [u8; 3]) -> u8 {
    a.iter().zip(b).map(|(&a, b)| a.abs_diff(b)).max().unwrap_or(0)
}

#[test]
fn every_shader_is_valid_and_translates_to_webgl2() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
    let architecture = include_str!("../../ARCHITECTURE.md");
    let modules = [shaders::LINEAR, shaders::ENCODED, shaders::FINISH];
    for file in std::fs::read_dir(folder).expect("the folder of shaders") {
        let name = file.expect("an entry").file_name();
        let name = name.to_str().expect("ASCII");
        let used = modules.iter().any(|module| module.files.contains(&name));
        assert!(used, "no module has {name}");
        assert!(architecture.contains(&format!("`{name}`")), "{name}: ARCHITECTURE.md");
    }
    let mut entries = 0;
    for shaders::Module { name, text, .. } in modules {
        let module =
            naga::front::wgsl::parse_str(text).unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(text)));
        // Core capabilities only: the web has no others.
        let flags = naga::valid::ValidationFlags::all();
        let info = naga::valid::Validator::new(flags, naga::valid::Capabilities::empty())
            .validate(&module)
            .unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(text)));
        for entry in &module.entry_points {
            let options =
                naga::back::glsl::Options { version: naga::back::glsl::Version::new_gles(300), ..Default::default() };
            let pipeline = naga::back::glsl::PipelineOptions {
                shader_stage: entry.stage,
                entry_point: entry.name.clone(),
                multiview: None,
            };
            let mut text = String::new();
            let policies = naga::proc::BoundsCheckPolicies::default();
            naga::back::glsl::Writer::new(&mut text, &module, &info, &options, &pipeline, policies)
                .and_then(|mut writer| writer.write())
                .unwrap_or_else(|error| panic!("{name} {}: {error}", entry.name));
            entries += 1;
        }
    }
    assert!(entries >= 25, "only {entries} entry points found");
}

#[test]
fn the_same_list_gives_the_same_bytes() {
    let (scene, frame) = fixture::three_legs();
    let view = SceneView::new(&scene, &frame);
    let options = ViewOptions { magnification: 10.0, ..Default::default() };
    let mut camera = view.camera();
    view.fit(&mut camera, &scene, &frame, &options, SIZE);
    let list = picture(&scene, &frame, &options, &camera, true);
    let mut device = offscreen();
    let first = device.render(&list).expect("a picture");
    assert_eq!((first.width, first.height, first.rgba.len()), (480, 360, 480 * 360 * 4));
    assert!(first.rgba.chunks(4).all(|pixel| pixel[3] == 255), "opaque everywhere");
    assert_eq!(device.render(&list).expect("a picture"), first, "on the same device");
    assert_eq!(offscreen().render(&list).expect("a picture"), first, "on a new device");
    let png = first.png(&[("Title", "three legs")]).expect("a PNG");
    let mut reader = png::Decoder::new(std::io::Cursor::new(&png)).read_info().expect("a PNG again");
    let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
    reader.next_frame(&mut bytes).expect("its pixels");
    assert_eq!(bytes, first.rgba);
}

#[test]
fn the_ball_is_where_the_projection_says() {
    let options = ViewOptions { sockets: false, floor: false, ..bare() };
    let (scene, frame, camera) = close_up(&options);
    let list = picture(&scene, &frame, &options, &camera, false);
    let mut without = list.clone();
    without.solid.by_mesh.iter_mut().for_each(Vec::clear);
    let mut device = offscreen();
    let (with, without) = (device.render(&list).expect("a picture"), device.render(&without).expect("a picture"));
    let centre = to_f32(&(frame.joints[0].socket_centre + 20.0 * frame.joints[0].eccentricity));
    let (right, up, _) = camera.axes();
    let changed = |point: Vec3| difference(at(&with, &camera, point), at(&without, &camera, point));
    assert!(changed(centre) > 30, "the ball hides the background");
    for direction in [right, up, -right] {
        assert!(changed(centre + direction * 0.009) > 10, "inside its outline");
        assert!(changed(centre + direction * 0.0115) <= 1, "outside its outline");
    }
}

#[test]
fn the_ball_shows_through_its_socket() {
    let options = ViewOptions { floor: false, ..bare() };
    let (scene, frame, mut camera) = close_up(&options);
    // From behind: the closed half of the socket is between the eye and the ball.
    camera.yaw += std::f32::consts::PI;
    let list = picture(&scene, &frame, &options, &camera, false);
    let mut no_ball = list.clone();
    no_ball.solid.by_mesh[crate::view::Mesh::Sphere.index()].clear();
    let mut no_socket = list.clone();
    no_socket.sockets.clear();
    let mut device = offscreen();
    let mut draw = |list: &DrawList| device.render(list).expect("a picture");
    let (both, no_ball, no_socket) = (draw(&list), draw(&no_ball), draw(&no_socket));
    let centre = to_f32(&(frame.joints[0].socket_centre + 20.0 * frame.joints[0].eccentricity));
    let through = difference(at(&both, &camera, centre), at(&no_ball, &camera, centre));
    let tint = difference(at(&both, &camera, centre), at(&no_socket, &camera, centre));
    assert!(through > 15, "the ball can be seen: {through}");
    assert!(tint > 10, "the glass can be seen: {tint}");
}

#[test]
fn a_socket_seen_through_another_looks_the_same_from_either_mesh() {
    let options = ViewOptions { floor: false, ..bare() };
    let (scene, frame, mut camera) = close_up(&options);
    camera.yaw += std::f32::consts::PI;
    let mut list = picture(&scene, &frame, &options, &camera, false);
    list.solid = Default::default();
    // The remaining half.
    let opacity = |socket: &&crate::view::Instance| (socket.colour[3] * 1e6) as u32;
    let near = *list.sockets.iter().max_by_key(opacity).expect("a socket");
    let centre = Vec3::from(near.world_from_mesh.map(|row| row[3]));
    let (right, _, back) = camera.axes();
    let behind = centre - camera.distance * back;
    let pixels = |length: f32| {
        let [a, b] = [behind, behind + length * right].map(|p| camera.project(p, SIZE));
        a.expect("in view").distance(b.expect("in view"))
    };
    let size = Vec3::from(near.world_from_mesh.map(|row| row[0])).length();
    // Coarse meshes are drawn up to a radius of 4 pixels.
    let far = [3.8, 4.2].map(|radius| {
        let scale = radius / pixels(size);
        let mut far = near;
        for (row, at) in far.world_from_mesh.iter_mut().zip(behind.to_array()) {
            *row = [row[0] * scale, row[1] * scale, row[2] * scale, at];
        }
        far.colour = [1.0, 0.0, 0.0, 0.9];
        far
    });
    let mut device = offscreen();
    let mut colour = |sockets: &[crate::view::Instance]| {
        list.sockets = sockets.to_vec();
        at(&device.render(&list).expect("a picture"), &camera, behind)
    };
    let [coarse, fine] = far.map(|far| colour(&[far, near]));
    let bare = colour(&[far[1]]);
    assert!(difference(fine, bare) > 10, "{fine:?} {bare:?}: glass before it");
    assert!(difference(coarse, fine) < 6, "{coarse:?} {fine:?}");
}

/// Sockets 0, 1 and 2 behind one another in the middle of the picture, listed in this `order`, each with its own body. Socket 2
/// is nearest to the camera, or 0 if it looks from `behind`.
fn in_a_row(order: [usize; 3], behind: bool) -> (Scene, Frame, Camera) {
    let (mut scene, mut frame) = fixture::pendulum();
    let mut camera = SceneView::new(&scene, &frame).camera();
    (camera.yaw, camera.pitch) = (0.4, 0.0);
    (camera.target, camera.distance) = (Vec3::ZERO, 0.16);
    let (right, up, back) = camera.axes();
    // No socket is cut in the middle of the picture.
    let openings = [right + up - back, up - right + 0.5 * back, right - 2.0 * up - 1.5 * back];
    let double = |v: Vec3| Vec3d::new(v.x.into(), v.y.into(), v.z.into());
    let (joint, report) = (scene.machine.loose_joints[0].clone(), frame.joints[0]);
    let (body, motion) = (scene.machine.bodies[0].clone(), frame.bodies[0]);
    let machine = scene.machine_mut();
    (machine.loose_joints, frame.joints) = Default::default();
    (machine.bodies, frame.bodies) = Default::default();
    for k in order {
        let by = double(back * (0.05 * (k as f32 - 1.0)));
        let mut joint = joint.clone();
        joint.opening = double(openings[k].normalize());
        joint.frames[1].origin.body = Some(machine.bodies.len());
        machine.loose_joints.push(joint);
        let mut report = report;
        report.socket_centre += by;
        report.ball_centre += by;
        report.contact_point += by;
        frame.joints.push(report);
        machine.bodies.push(body.clone());
        let mut motion = motion;
        motion.position += by;
        frame.bodies.push(motion);
    }
    machine.fixed_shapes.clear();
    if behind {
        camera.yaw += std::f32::consts::PI;
    }
    (scene, frame, camera)
}

#[test]
fn three_sockets_behind_one_another_are_blended_from_far_to_near_whatever_their_order() {
    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    // A colour for each, and its opacity.
    let tints = [[0.9, 0.6, 0.6, 0.4], [0.6, 0.85, 0.6, 0.5], [0.6, 0.7, 0.85, 0.3]];
    let greys = [0.4, 0.75].map(|c| Colour([c, c, c, 1.0]));
    let options = ViewOptions { floor: false, joint_names: false, ..bare() };
    let mut device = offscreen();
    for behind in [false, true] {
        let mut whole = Vec::new();
        let mut glass = DrawList::default();
        let mut centres = Vec::new();
        for order in ORDERS {
            let (scene, frame, camera) = in_a_row(order, behind);
            let mut list = picture(&scene, &frame, &options, &camera, false);
            whole.push(device.render(&list).expect("a picture"));
            list.solid = Default::default();
            centres = vec![Vec3::ZERO; 3];
            for (joint, k) in frame.joints.iter().zip(order) {
                centres[k] = to_f32(&joint.socket_centre);
            }
            for half in &mut list.sockets {
                let at = Vec3::from(half.world_from_mesh.map(|row| row[3]));
                let k = centres.iter().position(|c| c.distance(at) < 1e-6);
                let [r, g, b, opacity] = tints[k.expect("one of the three")];
                // The cut-away half stays fainter.
                let is_opaque_half = half.colour[3] > 0.1;
                half.colour = [r, g, b, if is_opaque_half { opacity } else { 0.15 * opacity }];
            }
            glass = list;
        }
        let same = whole.iter().all(|picture| *picture == whole[0]);
        assert!(same, "the order in the scene changes the picture");

        // Mean light in the middle of the picture on each grey.
        let mut middle = |sockets: &dyn Fn(&crate::view::Instance) -> bool| {
            greys.map(|grey| {
                let mut list = glass.clone();
                list.background.top = grey;
                list.background.bottom = grey;
                list.sockets.retain(sockets);
                let image = device.render(&list).expect("a picture");
                let around = |n: u32| n / 2 - 4..n / 2 + 4;
                let mut sum = [0.0; 3];
                for pixel in around(SIZE[1])
                    .flat_map(|y| around(SIZE[0]).map(move |x| (x, y)))
                    .map(|(x, y)| light_of(image.pixel(x, y)))
                {
                    sum = [0, 1, 2].map(|k| sum[k] + pixel[k] / 64.0);
                }
                // In this range tone mapping subtracts a constant from shaded light.
                assert!(sum.iter().all(|c| (0.04..0.76).contains(c)), "{sum:?}");
                sum
            })
        };
        let backdrop = middle(&|_| false);
        // Transmittance and emitted light of each single socket.
        let single_sockets: Vec<(f32, [f32; 3])> = centres
            .iter()
            .map(|centre| {
                let [dark, bright] = middle(&|half| {
                    let at = Vec3::from(half.world_from_mesh.map(|row| row[3]));
                    centre.distance(at) < 1e-6
                });
                let through = (0..3).map(|k| (bright[k] - dark[k]) / (backdrop[1][k] - backdrop[0][k]));
                let through = through.sum::<f32>() / 3.0;
                let own = |k| dark[k] - through * backdrop[0][k] + 0.04 * (1.0 - through);
                (through, [0, 1, 2].map(own))
            })
            .collect();
        let over = |order: [usize; 3], ground: [f32; 3]| {
            let (light, share) = order.iter().fold((ground, 1.0), |(light, share), &k| {
                let (through, own) = single_sockets[k];
                let light = [0, 1, 2].map(|c| own[c] + through * light[c]);
                (light, share * through)
            });
            light.map(|c| c - 0.04 * (1.0 - share))
        };
        let off = |a: [f32; 3], b: [f32; 3]| (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f32::max);
        let far_to_near = if behind { [2, 1, 0] } else { [0, 1, 2] };
        for (seen, ground) in middle(&|_| true).into_iter().zip(backdrop) {
            let expected = over(far_to_near, ground);
            assert!(off(seen, expected) < 0.004, "{seen:?} {expected:?}");
            for wrong in ORDERS.into_iter().filter(|order| *order != far_to_near) {
                let wrong = over(wrong, ground);
                assert!(off(seen, wrong) > 0.012, "{seen:?} {wrong:?}");
            }
        }
    }
}

#[test]
fn the_machine_casts_a_shadow_on_the_floor() {
    let (scene, frame) = fixture::three_legs();
    let view = SceneView::new(&scene, &frame);
    let options = bare();
    let mut camera = view.camera();
    camera.preset(Preset::Top);
    let list = picture(&scene, &frame, &options, &camera, false);
    let floor = list.floor.expect("a floor");
    // Where the light's ray through the platform's middle meets the floor.
    let (light, up) = (list.light.direction, list.light.up);
    let platform = to_f32(&frame.bodies[6].position);
    let shadow = platform - light * ((platform - floor.centre).dot(up) / light.dot(up));
    camera.target = shadow;
    camera.pitch = 0.7;
    let shaded_list = picture(&scene, &frame, &options, &camera, false);
    let mut lit_list = shaded_list.clone();
    lit_list.solid.by_mesh.iter_mut().for_each(Vec::clear);
    let mut device = offscreen();
    let (shaded, lit) = (device.render(&shaded_list).expect("a picture"), device.render(&lit_list).expect("a picture"));
    let (dark, bright) = (brightness(at(&shaded, &camera, shadow)), brightness(at(&lit, &camera, shadow)));
    assert!(dark < bright - 90, "{dark} in the shadow, {bright} without it");
    let beside = shadow + 0.35 * camera.axes().0;
    assert!(difference(at(&shaded, &camera, beside), at(&lit, &camera, beside)) <= 1, "light beside it");
}

#[test]
fn an_arrow_inside_a_ball_can_be_seen() {
    let mut options = ViewOptions { floor: false, ..bare() };
    let (scene, frame, camera) = close_up(&options);
    let plain = picture(&scene, &frame, &options, &camera, false);
    options.arrows.normal = true;
    let marked = picture(&scene, &frame, &options, &camera, false);
    let mut device = offscreen();
    let (plain, marked) = (device.render(&plain).expect("a picture"), device.render(&marked).expect("a picture"));
    // The normal force points from the contact through the centre of the ball.
    let centre = to_f32(&(frame.joints[0].socket_centre + 20.0 * frame.joints[0].eccentricity));
    let inside = centre - 0.005 * to_f32(&frame.joints[0].normal_force).normalize();
    let [red, _, blue] = at(&marked, &camera, inside);
    assert!(
        difference(at(&plain, &camera, inside), [red, 0, blue]) > 0 && red > blue.saturating_add(40),
        "{red} {blue}"
    );
}

#[test]
fn a_hit_joint_lights_up_and_themes_differ() {
    let options = bare();
    let (scene, frame, camera) = close_up(&options);
    let mut device = offscreen();
    let mut draw =
        |options: &ViewOptions, hit| device.render(&picture(&scene, &frame, options, &camera, hit)).expect("a picture");
    let (quiet, hit) = (draw(&options, false), draw(&options, true));
    let warmth = |picture: &Image, distance: f32| {
        let beside = to_f32(&frame.joints[0].socket_centre) + camera.axes().0 * distance;
        let [red, _, blue] = at(picture, &camera, beside).map(i32::from);
        red - blue
    };
    // Outwards from the socket's edge.
    let warmer = (0..60).filter(|k| {
        let distance = 0.0186 + 1e-4 * *k as f32;
        warmth(&hit, distance) - warmth(&quiet, distance) > 20
    });
    assert!(warmer.count() > 5, "warm light beside the socket");
    // The halo covers no part of the joint: neither the contact, nor the ball, nor the socket.
    let centre = to_f32(&frame.joints[0].socket_centre);
    let (right, up, _) = camera.axes();
    for k in 0..400 {
        let (turn, part) = (k as f32 * 2.4, k as f32 / 400.0);
        let point = centre + 0.0186 * part.sqrt() * (right * turn.cos() + up * turn.sin());
        assert_eq!(at(&hit, &camera, point), at(&quiet, &camera, point));
    }
    let dark = draw(&ViewOptions { theme: Theme::Dark, ..options.clone() }, false);
    assert!(brightness(quiet.pixel(5, 5)) > 600 && brightness(dark.pixel(5, 5)) < 200);
    let without_flash = draw(&ViewOptions { flash: false, ..options }, true);
    assert_eq!(without_flash, quiet, "no flash if flashes are off");
}

/// Pixels at which two pictures differ by more than `by`.
fn differing(a: &Image, b: &Image, by: u8) -> Vec<[u32; 2]> {
    let mut pixels = Vec::new();
    for y in 0..a.height {
        for x in 0..a.width {
            if difference(a.pixel(x, y), b.pixel(x, y)) > by {
                pixels.push([x, y]);
            }
        }
    }
    pixels
}

#[test]
fn an_arrow_across_the_line_of_sight_has_the_length_of_the_ruler() {
    let (scene, mut frame) = fixture::pendulum();
    let view = SceneView::new(&scene, &frame);
    let mut options = ViewOptions { sockets: false, floor: false, joint_names: false, ..bare() };
    options.arrows.normal = true;
    options.arrows.reference = Some(10.0);
    let mut device = offscreen();
    let mut draw = |list: &DrawList| device.render(list).expect("a picture");
    for (newtons, zoom, shift) in [
        (8.0, 1.0, [0.0, 0.0]),
        (8.0, 9.0, [0.0, 0.0]),
        (8.0, 0.4, [0.7, -0.3]),
        (3.0, 2.5, [-0.8, 0.2]),
        (0.6, 1.0, [0.0, 0.0]),
    ] {
        let mut camera = view.camera();
        camera.distance /= zoom;
        // At another depth than the target, and beside the middle.
        let (right, up, back) = camera.axes();
        let half = 0.3 * camera.distance;
        camera.target = to_f32(&frame.joints[0].socket_centre) + back * (0.5 * camera.distance)
            - right * (shift[0] * half)
            - up * (shift[1] * half);
        let along = (right * 0.8 - up * 0.6).as_dvec3();
        frame.joints[0].normal_force = crate::machine::Vec3::new(along.x, along.y, along.z) * newtons;
        let mut list = picture(&scene, &frame, &options, &camera, false);
        list.solid.by_mesh.iter_mut().for_each(Vec::clear);
        let with = draw(&list);
        list.arrows.by_mesh.iter_mut().for_each(Vec::clear);
        let reach = differing(&with, &draw(&list), 12).into_iter().map(|[x, y]| x as f32 * 0.8 + y as f32 * 0.6);
        let (low, high) = reach.fold((f32::MAX, f32::MIN), |(low, high), at| (low.min(at), high.max(at)));
        let ruler = list.legend.as_ref().expect("a ruler").pixels * newtons as f32 / 10.0;
        let seen = high - low + 1.0;
        // The tip is a point and the tail a disc seen from its edge: a pixel or two at either end.
        assert!((seen - ruler).abs() < 4.0, "{newtons} N at {zoom}: {seen} of {ruler}");
    }
}

#[test]
fn a_coincident_ghost_does_not_show_in_patches() {
    let options = ViewOptions { sockets: false, floor: false, ..bare() };
    let (scene, frame, camera) = close_up(&options);
    let view = SceneView::new(&scene, &frame);
    let mut device = offscreen();
    let plain = picture(&scene, &frame, &options, &camera, false);
    let without = device.render(&plain).expect("a picture");
    let back = camera.axes().2.as_dvec3();
    let centre = to_f32(&(frame.joints[0].socket_centre + 20.0 * frame.joints[0].eccentricity));
    // A little nearer, and a little farther: its ball lies almost entirely within the other.
    for move_by in [4.0, -4.0] {
        let metres = move_by * f64::from(camera.metres_per_pixel(SIZE)) / 20.0;
        let mut ghost = frame.clone();
        ghost.joints[0].eccentricity += crate::machine::Vec3::new(back.x, back.y, back.z) * metres;
        let mut list = plain.clone();
        let (marks, trail) = (PeakMarks::new(), []);
        let shot = Shot {
            scene: &scene,
            frame: &frame,
            marks: &marks,
            options: &options,
            camera: &camera,
            trail: &trail,
            size: SIZE,
            pixels_per_point: 1.0,
        };
        assert!(view.add_ghost(&shot, &ghost, Ghost::Twin, &mut list));
        let with = device.render(&list).expect("a picture");
        let (right, up, _) = camera.axes();
        for k in 0..400 {
            let (turn, part) = (k as f32 * 2.4, k as f32 / 400.0);
            let point = centre + 0.009 * part.sqrt() * (right * turn.cos() + up * turn.sin());
            let change = difference(at(&with, &camera, point), at(&without, &camera, point));
            assert!(change > 8, "{move_by}: {change} at {point}");
        }
    }
}

#[test]
fn ghosts_are_outlined_and_coincident_ghosts_do_not_flicker() {
    let options = ViewOptions { sockets: false, floor: false, ..bare() };
    let (scene, frame, camera) = close_up(&options);
    let view = SceneView::new(&scene, &frame);
    let mut device = offscreen();
    let plain = picture(&scene, &frame, &options, &camera, false);
    let (right, up, _) = camera.axes();
    let pixel = camera.metres_per_pixel(SIZE);
    let aside = (40.0 * pixel * right).as_dvec3();
    let aside = crate::machine::Vec3::new(aside.x, aside.y, aside.z);
    let mut ghost = frame.clone();
    ghost.bodies[0].position += aside;
    ghost.joints[0].socket_centre += aside;
    let (marks, trail) = (PeakMarks::new(), []);
    let shot = Shot {
        scene: &scene,
        frame: &frame,
        marks: &marks,
        options: &options,
        camera: &camera,
        trail: &trail,
        size: SIZE,
        pixels_per_point: 1.0,
    };
    let mut drawn = |ghosts: &[Ghost]| {
        let mut list = plain.clone();
        for which in ghosts {
            assert!(view.add_ghost(&shot, &ghost, *which, &mut list));
        }
        device.render(&list).expect("a picture")
    };
    let twin = drawn(&[Ghost::Twin]);
    let ideal = drawn(&[Ghost::Ideal]);
    let both = drawn(&[Ghost::Ideal, Ghost::Twin]);
    let report = &ghost.joints[0];
    let centre = to_f32(&(report.socket_centre + 20.0 * report.eccentricity));
    let radius = scene.machine.loose_joints[0].contact.ball_radius as f32;
    let palette = Palette::of(options.theme);
    let near = |image: &Image, point: Vec3, colour: [u8; 4]| {
        let [r, g, b, _] = colour;
        difference(at(image, &camera, point), [r, g, b]) < 40
    };
    let mut edged = [0; 2];
    for k in 0..120 {
        let turn = k as f32 * (std::f32::consts::TAU / 120.0);
        let out = right * turn.cos() + up * turn.sin();
        for part in [0.1, 0.4, 0.7] {
            let point = centre + 0.95 * radius * part * out;
            let change = difference(at(&both, &camera, point), at(&twin, &camera, point));
            assert!(change <= 1, "only the nearer is visible: {change} at {point}");
        }
        for (count, (image, which)) in edged.iter_mut().zip([(&twin, Ghost::Twin), (&both, Ghost::Ideal)]) {
            let edge = palette.ghost(which).edge.to_rgba8();
            // About the outline of the ball, which perspective makes a little larger.
            let ring = |step: i32| centre + (radius + 0.25 * step as f32 * pixel) * out;
            *count += usize::from((-4..16).any(|step| near(image, ring(step), edge)));
        }
    }
    // The rod leaves the ball on one side, with an outline of its own.
    assert!(edged[0] > 100 && edged[1] > 75, "{edged:?}");
    let apart = differing(&twin, &ideal, 30).len();
    assert!(apart > 3000, "distinguishable: {apart}");
}

#[test]
fn every_standard_view_shows_the_moving_parts() {
    let mut device = offscreen();
    let mut draw = |list: &DrawList| device.render(list).expect("a picture");
    let options = ViewOptions { floor: false, ..bare() };
    // About a hundred pictures: small.
    let size = SIZE.map(|n| n / 2);
    for name in crate::scene::BUILT_IN {
        let scene = Scene::load(name, &[]).expect("built in");
        let mut frame = Frame::default();
        let mut simulation = crate::simulate::Simulation::new(&scene.machine).expect("starts");
        // Twelve loose joints take long to simulate.
        let later = (scene.machine.loose_joints.len() <= 8).then_some(0.3);
        for (turn, time) in std::iter::once(0.0).chain(later).enumerate() {
            simulation.advance_to(time).expect("runs");
            simulation.sample(time, &mut frame);
            let view = SceneView::new(&scene, &frame);
            // At the later instant only every other view.
            for preset in Preset::ALL.into_iter().step_by(1 + turn) {
                let mut camera = view.camera();
                camera.preset(preset);
                view.fit(&mut camera, &scene, &frame, &options, size);
                let whole = picture_of(size, &scene, &frame, &options, &camera, false);
                let mut free = scene.clone();
                free.machine_mut().fixed_shapes.clear();
                let mut moving = picture_of(size, &free, &frame, &options, &camera, false);
                moving.light = whole.light;
                let (mut fixed, mut nothing) = (whole.clone(), moving.clone());
                // Fixed parts come first.
                let both = fixed.solid.by_mesh.iter_mut().zip(&mut nothing.solid.by_mesh);
                for (fixed, moving) in both {
                    fixed.truncate(fixed.len() - moving.len());
                    moving.clear();
                }
                fixed.sockets.clear();
                nothing.sockets.clear();
                let possible = differing(&draw(&moving), &draw(&nothing), 24);
                let (whole, fixed) = (draw(&whole), draw(&fixed));
                let seen = possible.iter().filter(|[x, y]| difference(whole.pixel(*x, *y), fixed.pixel(*x, *y)) > 24);
                let (seen, possible) = (seen.count(), possible.len());
                println!("{name} {time} {preset:?}: {seen} of {possible}");
                assert!(possible > 75, "{name} {preset:?}: {possible}");
                assert!(
                    seen as f64 > 0.8 * possible as f64,
                    "{name} at {time} s, {preset:?}: {seen} of {possible} pixels of the moving parts are visible"
                );
            }
        }
    }
}

#[test]
fn the_background_has_exactly_the_themes_colours() {
    let mut device = offscreen();
    let list = DrawList {
        size: [64, 64],
        background: crate::view::Background {
            top: crate::view::Colour::hex(0x406080),
            bottom: crate::view::Colour::hex(0x406080),
        },
        ..Default::default()
    };
    let image = device.render(&list).expect("a picture");
    // Encoded exactly once; half a step of noise may round to a neighbour.
    assert!((0..64).all(|i| difference(image.pixel(i, i), [0x40, 0x60, 0x80]) <= 1), "{:?}", image.pixel(9, 9));
}

#[test]
fn a_size_that_cannot_be_drawn_is_refused_with_the_limit() {
    let mut device = offscreen();
    for size in [[0, 10], [10, 0], [1 << 20, 10]] {
        let list = DrawList { size, ..Default::default() };
        let error = device.render(&list).expect_err("refused");
        assert!(matches!(error, RenderError::Size { .. }));
        assert!(error.to_string().contains("1 to "), "{error}");
    }
}

/// An application with only the viewport.
struct OnlyViewport(std::sync::Arc<DrawList>);

impl eframe::App for OnlyViewport {
    fn ui(&mut self, ui: &mut eframe::egui::Ui, _frame: &mut eframe::Frame) {
        eframe::egui::CentralPanel::no_frame().show(ui, |ui| {
            let rect = ui.available_rect_before_wrap();
            ui.painter().add(super::Viewport::shape(rect, self.0.clone()));
        });
    }
}

#[test]
fn cells_with_contact_have_the_colour_of_their_value_and_others_none() {
    let scene = Scene::load("pendulum", &[]).expect("built in");
    let mut simulation = Simulation::new(&scene.machine).expect("starts");
    simulation.track_wear();
    simulation.advance_to(0.3).expect("steps");
    simulation.commit_wear();
    let mut frame = Frame::default();
    simulation.sample(simulation.time(), &mut frame);
    let wear = simulation.wear().expect("tracked");
    let (view, marks) = (SceneView::new(&scene, &frame), PeakMarks::new());
    let mut device = offscreen();
    for (theme, map) in [(Theme::Light, WearMap::Impulse), (Theme::Dark, WearMap::FrictionWork)] {
        let options = ViewOptions { theme, wear: map, ..bare() };
        // From above, into the lower half, where the weight presses.
        let mut camera = view.camera();
        view.close_up(&mut camera, 0, &scene, &frame, &options);
        camera.pitch = 1.2;
        let shot = Shot {
            scene: &scene,
            frame: &frame,
            marks: &marks,
            options: &options,
            camera: &camera,
            trail: &[],
            size: SIZE,
            pixels_per_point: 1.0,
        };
        let mut list = DrawList::default();
        view.build(&shot, &mut list);
        let clear = list.clear_balls.clone();
        assert_eq!(clear.len(), 1, "the ball that hides the wall is seen through");
        // Nothing in front of the wall.
        list.solid.by_mesh.iter_mut().for_each(Vec::clear);
        list.clear_balls.clear();
        let without = device.render(&list).expect("a picture");
        view.add_wear(&shot, wear, &mut list);
        let with = device.render(&list).expect("a picture");
        list.clear_balls = clear;
        let through = device.render(&list).expect("a picture");

        let scale = list.wear_scale.expect("a scale");
        let socket = to_f32(&frame.joints[0].socket_centre);
        let inner = 0.01 + 0.3e-3 * list.magnification;
        let (mut struck, mut clear, mut brightest) = (0, 0, 0.0_f32);
        for (i, ((part, number), cell)) in wear.division(0).each().zip(wear.cells(0)).enumerate() {
            let edges = part.edges(number);
            let middle = |edges: Option<[f64; 2]>| 0.5 * edges.expect("of a sphere").iter().sum::<f64>();
            let ((s, c), (sa, ca)) = (middle(edges.polar).sin_cos(), middle(edges.azimuth).sin_cos());
            // Its socket is fixed to the world.
            let direction = wear.division(0).axes().transpose() * Vec3d::new(s * ca, s * sa, c);
            let point = socket + to_f32(&direction) * (0.99 * inner);
            let to_eye = (camera.eye() - point).normalize();
            if to_f32(&direction).dot(to_eye) > -0.3 {
                continue;
            }
            let (before, after) = (at(&without, &camera, point), at(&with, &camera, point));
            let per_area = match map {
                WearMap::FrictionWork => cell.friction_work.abs() * 1e3,
                _ => cell.impulse,
            } / (part.area * 1e6);
            if cell.impulse == 0.0 {
                assert!(difference(before, after) <= 1, "cell {i} had no contact");
                clear += 1;
                continue;
            }
            let place = scale.position(per_area as f32);
            let [r, g, b, _] = WearScale::colour(place).to_rgba8();
            let off = difference(after, [r, g, b]);
            assert!(off <= 2, "cell {i}: {after:?} for {:?}", [r, g, b]);
            let seen = difference(at(&through, &camera, point), [r, g, b]);
            assert!(seen < 90, "cell {i} through the ball: {seen}");
            struck += 1;
            brightest = brightest.max(place);
        }
        assert!(struck >= 3 && clear >= 3, "{map:?}: {struck} struck, {clear} clear");
        assert_eq!(brightest, 1.0, "the largest value is in the picture");
    }
}

#[test]
fn the_interface_shows_the_same_picture_as_headless_rendering() {
    let (scene, frame) = fixture::three_legs();
    let view = SceneView::new(&scene, &frame);
    let options = ViewOptions { magnification: 10.0, ..Default::default() };
    let mut camera = view.camera();
    view.fit(&mut camera, &scene, &frame, &options, SIZE);
    let list = picture(&scene, &frame, &options, &camera, false);
    let headless = offscreen().render(&list).expect("a picture");
    let mut harness = egui_kittest::Harness::builder()
        .with_size(eframe::egui::vec2(SIZE[0] as f32, SIZE[1] as f32))
        .with_pixels_per_point(1.0)
        .wgpu()
        .build_eframe(|context| {
            super::install(context.wgpu_render_state.as_ref().expect("wgpu"));
            OnlyViewport(std::sync::Arc::new(list.clone()))
        });
    harness.run();
    let shown = harness.render().expect("a picture");
    assert_eq!((shown.width(), shown.height()), (SIZE[0], SIZE[1]));
    let worst = shown.as_raw().iter().zip(&headless.rgba).map(|(a, b)| a.abs_diff(*b)).max();
    assert!(worst.is_some_and(|worst| worst <= 1), "bytes are copied: {worst:?}");
}

/// An encoded pixel as linear light.
fn light_of(pixel: [u8; 3]) -> [f32; 3] {
    let [r, g, b] = pixel.map(|c| f32::from(c) / 255.0);
    Colour([r, g, b, 1.0]).linear()
}

#[test]
fn arrows_and_outlines_have_the_themes_colours_on_any_ground() {
    let mut device = offscreen();
    for theme in [Theme::Light, Theme::Dark] {
        let palette = Palette::of(theme);
        let (scene, frame) = fixture::three_legs();
        let mut options = ViewOptions { theme, ..bare() };
        (options.arrows.normal, options.arrows.friction) = (true, true);
        options.arrows.thickness = 2.0;
        options.arrows.reference = Some(1.0);
        let mut camera = SceneView::new(&scene, &frame).camera();
        SceneView::new(&scene, &frame).fit(&mut camera, &scene, &frame, &options, SIZE);
        let image = device.render(&picture(&scene, &frame, &options, &camera, true)).expect("a picture");
        let count = |colour: Colour| {
            let [r, g, b, _] = colour.to_rgba8();
            let all = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y)));
            all.filter(|(x, y)| difference(image.pixel(*x, *y), [r, g, b]) <= 2).count()
        };
        for colour in [palette.normal, palette.friction] {
            let seen = count(colour);
            assert!(seen > 60, "{theme:?} {colour:?}: {seen} pixels");
        }
    }
}

#[test]
fn a_halo_is_blended_in_linear_light() {
    let options = ViewOptions { floor: false, ..bare() };
    let (scene, frame, camera) = close_up(&options);
    let mut list = picture(&scene, &frame, &options, &camera, true);
    list.background.top = list.background.bottom;
    let mut device = offscreen();
    let lit = device.render(&list).expect("a picture");
    let halo = Colour(list.halos[0].colour).linear();
    list.halos.clear();
    let without = device.render(&list).expect("a picture");
    let beside = to_f32(&frame.joints[0].socket_centre) + camera.axes().0 * 0.0215;
    let (after, before) = (at(&lit, &camera, beside), at(&without, &camera, beside));
    let [after, before] = [after, before].map(light_of);
    // One opacity explains all three channels.
    let share = |k: usize| (after[k] - before[k]) / (halo[k] - before[k]);
    assert!(share(2) > 0.2, "{}", share(2));
    for k in [0, 1] {
        let expected = before[k] + share(2) * (halo[k] - before[k]);
        assert!((after[k] - expected).abs() < 0.02, "{k}: {after:?} {before:?} {halo:?}");
    }
}

#[test]
fn a_rim_marks_the_contact_point_only_during_contact() {
    let options = ViewOptions { floor: false, sockets: false, ..bare() };
    let (scene, touching, mut camera) = close_up(&options);
    let report = &touching.joints[0];
    let outwards = to_f32(&report.eccentricity).normalize();
    // View with the contact point in the middle.
    let ball = to_f32(&(report.socket_centre + 20.0 * report.eccentricity));
    camera.target = ball;
    let mut best = camera;
    for (yaw, pitch) in (0..64).flat_map(|i| (-8..=8).map(move |k| (i, k))) {
        (camera.yaw, camera.pitch) = (yaw as f32 * 0.0982, pitch as f32 * 0.19);
        if camera.axes().2.dot(outwards) > best.axes().2.dot(outwards) {
            best = camera;
        }
    }
    let mut device = offscreen();
    let mut draw = |state: ContactMode| {
        let mut frame = touching.clone();
        frame.joints[0].state = state;
        let list = picture(&scene, &frame, &options, &best, false);
        device.render(&list).expect("a picture")
    };
    let free = draw(ContactMode::Free);
    for state in [ContactMode::Creep, ContactMode::Slip, ContactMode::Stick] {
        let seen = differing(&draw(state), &free, 12);
        assert!(seen.len() > 60, "{state:?}: {} pixels", seen.len());
        // A ring: nothing at the point itself, and nothing far from it.
        let point = best.project(ball + outwards * 0.01, SIZE).expect("in view");
        for [x, y] in seen {
            let off = glam::Vec2::new(x as f32, y as f32).distance(point);
            let radius = 0.01 / best.metres_per_pixel(SIZE);
            assert!((0.25 * radius..0.65 * radius).contains(&off), "{off} {radius}");
        }
    }
    assert_eq!(draw(ContactMode::Ideal), free);
}

#[test]
fn a_ball_is_darker_near_its_wall() {
    let options = ViewOptions { floor: false, ..bare() };
    let (scene, frame, camera) = close_up(&options);
    let mut list = picture(&scene, &frame, &options, &camera, false);
    let mut device = offscreen();
    list.sockets.clear();
    for ball in &mut list.solid.by_mesh[crate::view::Mesh::Sphere.index()] {
        ball.touch = [0.0; 4];
    }
    let near = device.render(&list).expect("a picture");
    for ball in &mut list.solid.by_mesh[crate::view::Mesh::Sphere.index()] {
        ball.other = [0.0; 4];
    }
    let without_wall = device.render(&list).expect("a picture");
    let report = &frame.joints[0];
    let outwards = to_f32(&report.eccentricity).normalize();
    let centre = to_f32(&(report.socket_centre + 20.0 * report.eccentricity));
    let back = camera.axes().2;
    let share = |part: f32| {
        let side = (outwards * part + back * (1.0 - part.abs())).normalize();
        let point = centre + 0.0099 * side;
        let [a, b] = [&near, &without_wall].map(|image| brightness(at(image, &camera, point)) as f32);
        a / b
    };
    let (touching, front, opposite) = (share(0.8), share(0.0), share(-0.8));
    assert!(touching < 0.85 * front && front < opposite && opposite > 0.9, "{touching} {front} {opposite}");
}

/// The Khronos PBR Neutral tone mapper, from its specification:
/// <https://github.com/KhronosGroup/ToneMapping/blob/main/PBR_Neutral/README.md>.
fn neutral(light: [f64; 3]) -> [f64; 3] {
    let least = light.into_iter().fold(f64::INFINITY, f64::min);
    let offset = if least <= 0.08 { least - 6.25 * least * least } else { 0.04 };
    let c = light.map(|x| x - offset);
    let peak = c.into_iter().fold(0.0, f64::max);
    let bends = 0.8 - 0.04;
    if peak <= bends {
        return c;
    }
    let bent = 1.0 - (1.0 - bends) * (1.0 - bends) / (peak + 1.0 - 2.0 * bends);
    let white = 1.0 / (0.15 * (peak - bent) + 1.0);
    c.map(|x| x * bent / peak * white + bent * (1.0 - white))
}

#[test]
fn light_is_tone_mapped_and_theme_colours_are_unchanged() {
    let values = [0.0, 0.0625, 0.125, 0.375, 0.75, 1.0, 2.5, 12.0];
    let mut texels = Vec::new();
    for r in values {
        for g in [0.03125, 0.5, 4.0] {
            for theme_share in [0.0, 0.5, 1.0] {
                texels.push([r, g, 0.25, theme_share]);
            }
        }
    }
    let image = offscreen().finished(&texels);
    for (i, [r, g, b, theme_share]) in texels.into_iter().enumerate() {
        let light = [r, g, b].map(f64::from);
        let mapped = neutral(light);
        let expected = [0, 1, 2].map(|k| {
            let theme_share = f64::from(theme_share);
            let c = (mapped[k] + theme_share * (light[k] - mapped[k])).clamp(0.0, 1.0);
            let encoded = if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
            (255.0 * encoded).round() as u8
        });
        let computed = image.pixel(i as u32, 0);
        assert!(difference(computed, expected) <= 1, "{r} {g} {theme_share}: {computed:?} {expected:?}");
    }
}

#[test]
fn the_longest_chain_needs_few_triangles_from_afar_and_from_within() {
    let links = [("chain.links".to_owned(), "4096".to_owned())];
    let scene = Scene::load("chain", &links).expect("within the limit");
    let mut frame = Frame::default();
    let mut simulation = Simulation::new(&scene.machine).expect("starts");
    simulation.sample(0.0, &mut frame);
    let (view, options) = (SceneView::new(&scene, &frame), bare());
    let mut afar = view.camera();
    view.fit(&mut afar, &scene, &frame, &options, SIZE);
    let mut within = afar;
    view.close_up(&mut within, 2048, &scene, &frame, &options);
    let mut device = offscreen();
    for camera in [afar, within] {
        let list = picture(&scene, &frame, &options, &camera, false);
        // Links of the finest meshes would take 100 million.
        let triangles = device.triangles(&list);
        println!("{triangles} triangles");
        assert!((1_000..3_000_000).contains(&triangles), "{triangles}");
    }
}

/// A scene and a frame of it, moved by `by`, m.
fn moved(scene: &Scene, frame: &Frame, by: Vec3d) -> (Scene, Frame) {
    use crate::machine::Geometry::{Box, Capsule, Cylinder};
    let (mut scene, mut frame) = (scene.clone(), frame.clone());
    for shape in &mut scene.machine_mut().fixed_shapes {
        match &mut shape.geometry {
            Capsule { from, to, .. } | Cylinder { from, to, .. } => {
                *from += by;
                *to += by;
            }
            Box { centre, .. } => *centre += by,
            other => panic!("{other:?}"),
        }
    }
    for joint in &mut scene.machine_mut().loose_joints {
        for end in joint.frames.iter_mut().map(|frame| &mut frame.origin) {
            if end.body.is_none() {
                end.point += by;
            }
        }
    }
    frame.bodies.iter_mut().for_each(|body| body.position += by);
    for joint in &mut frame.joints {
        joint.socket_centre += by;
        joint.ball_centre += by;
        joint.contact_point += by;
    }
    (scene, frame)
}

#[test]
fn a_machine_far_from_the_origin_is_drawn_as_at_the_origin_without_jitter() {
    let mut options = bare();
    (options.arrows.normal, options.joint_names) = (true, false);
    options.floor = false;
    let mut device = offscreen();
    let mut draw = |by: Vec3d| {
        let (scene, frame) = fixture::pendulum();
        let (scene, frame) = moved(&scene, &frame, by);
        let view = SceneView::new(&scene, &frame);
        let mut camera = view.camera();
        view.close_up(&mut camera, 0, &scene, &frame, &options);
        camera.distance *= 0.25;
        let list = picture(&scene, &frame, &options, &camera, false);
        (device.render(&list).expect("a picture"), list)
    };
    let (here, _) = draw(Vec3d::zeros());
    for metres in [100.0, 1000.0] {
        let (there, list) = draw(Vec3d::new(metres, -0.5 * metres, 0.25 * metres));
        assert!(list.eye.position.length() < 1.0);
        let off = differing(&here, &there, 24).len();
        assert!(off < 200, "{metres} m: {off} pixels");
    }
    // A micrometre at a time: within half a pixel of where it belongs.
    let ball = |list: &DrawList| {
        let ball = list.solid.by_mesh[crate::view::Mesh::Sphere.index()][0];
        let point = Vec3::from(ball.world_from_mesh.map(|row| row[3]));
        list.eye.project(point, SIZE).expect("in view")
    };
    let (_, at_start) = draw(Vec3d::new(100.0, 0.0, 0.0));
    for k in 1..8 {
        let (_, list) = draw(Vec3d::new(100.0 + f64::from(k) * 1e-6, 0.0, 0.0));
        let off = ball(&list).distance(ball(&at_start));
        assert!(off < 0.25, "{k} um: {off} pixels");
    }
}
