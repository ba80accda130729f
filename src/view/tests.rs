//! Guarantees of the draw list.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::solids::Pose;
use super::*;
use super::{fixture, joint};
use crate::scene::Scene;
use crate::simulate::{Frame, Simulation};

const SIZE: [u32; 2] = [1280, 720];

fn shot<'a>(
    scene: &'a Scene,
    frame: &'a Frame,
    marks: &'a PeakMarks,
    options: &'a ViewOptions,
    camera: &'a Camera,
) -> Shot<'a> {
    Shot { scene, frame, marks, options, camera, trail: &[], size: SIZE, pixels_per_point: 1.0 }
}

/// Draw list of a scene; past peaks do not fade.
fn list(scene: &Scene, frame: &Frame, options: &ViewOptions) -> DrawList {
    let view = SceneView::new(scene, frame);
    let mut marks = PeakMarks::new();
    marks.update(frame, &[], f64::INFINITY);
    let mut out = DrawList::default();
    view.build(&shot(scene, frame, &marks, options, &view.camera()), &mut out);
    out
}

fn place(instance: &Instance) -> Vec3 {
    let [x, y, z] = instance.world_from_mesh;
    Vec3::new(x[3], y[3], z[3])
}

fn size(instance: &Instance) -> f32 {
    let [x, y, z] = instance.world_from_mesh;
    Vec3::new(x[0], y[0], z[0]).length()
}

/// The drawn ball of joint 0: the sphere of the ball's radius nearest to its socket.
fn ball(list: &DrawList, radius: f32) -> &Instance {
    let spheres = &list.solid.by_mesh[Mesh::Sphere.index()];
    spheres.iter().find(|s| (size(s) / radius - 1.0).abs() < 1e-4).expect("a ball")
}

#[test]
fn the_ball_stays_in_its_drawn_socket_at_every_magnification() {
    let (scene, frame) = fixture::pendulum();
    for magnification in [1.0, 2.0, 7.5, 20.0, 50.0, 100.0] {
        let options = ViewOptions { magnification, ..Default::default() };
        let list = list(&scene, &frame, &options);
        assert_eq!(list.magnification, magnification, "0.3 mm around 10 mm is drawable up to 100");
        let (ball, socket) = (ball(&list, 0.010), list.sockets[0]);
        let inner = size(&socket) * socket.inner_radius;
        let outermost = place(ball).distance(place(&socket)) + size(ball);
        // The fixture's ball is pressed 1 um into its wall.
        assert!((outermost - inner - 1e-6 * magnification).abs() < 1e-6, "×{magnification}: {outermost} in {inner}");
        assert!((inner - 0.010 - 0.3e-3 * magnification).abs() < 1e-6);
    }
}

#[test]
fn a_magnification_that_does_not_fit_is_reduced_and_the_label_states_it() {
    let (scene, mut frame) = fixture::pendulum();
    frame.joints[0].clearance = 2e-3;
    frame.joints[0].eccentricity *= 2e-3 / 0.3e-3;
    let options = ViewOptions { magnification: 100.0, ..Default::default() };
    let drawn = list(&scene, &frame, &options);
    assert!((10.0..20.0).contains(&drawn.magnification), "{}", drawn.magnification);
    assert!(drawn.magnification_text.contains("×100 does not fit"), "{}", drawn.magnification_text);
    let options = ViewOptions { magnification: 5.0, ..Default::default() };
    assert_eq!(list(&scene, &frame, &options).magnification_text, "clearance drawn ×5");
}

#[test]
fn the_rod_moves_with_its_magnified_ball() {
    let (scene, frame) = fixture::pendulum();
    let options = ViewOptions { magnification: 80.0, ..Default::default() };
    let list = list(&scene, &frame, &options);
    let rod =
        list.solid.by_mesh[Mesh::Cylinder.index()].iter().find(|c| (size(c) - 0.004).abs() < 1e-6).expect("the rod");
    assert!(place(rod).distance(place(ball(&list, 0.010))) < 1e-6, "its end is the ball's centre");
}

#[test]
fn the_bar_that_carries_a_socket_ends_at_the_socket() {
    let (scene, frame) = fixture::pendulum();
    let carrier = |magnification| {
        let list = list(&scene, &frame, &ViewOptions { magnification, ..Default::default() });
        let bars = &list.solid.by_mesh[Mesh::Cylinder.index()];
        // It hangs from z = 35 mm.
        let z = bars.iter().find(|c| (size(c) - 0.006).abs() < 1e-6).map(|c| c.world_from_mesh[2]);
        (z.map(|z| z[3] + z[2]), size(&list.sockets[0]))
    };
    for magnification in [1.0, 50.0] {
        let (end, outer) = carrier(magnification);
        let end = end.expect("the carrier");
        assert!((0.98..=1.0).contains(&(end / outer)), "×{magnification}: {end} at a socket of {outer}");
    }
    assert_eq!(carrier(100.0).0, None, "swallowed by a socket of 43 mm");
}

#[test]
fn a_magnified_socket_does_not_intersect_its_carrier() {
    let options = ViewOptions { magnification: 100.0, ..Default::default() };
    let mut checked = 0;
    for name in crate::scene::BUILT_IN {
        let scene = Scene::load(name, &[]).expect("built in");
        let mut simulation = crate::simulate::Simulation::new(&scene.machine).expect("starts");
        let mut frame = Frame::default();
        simulation.sample(0.0, &mut frame);
        let view = SceneView::new(&scene, &frame);
        let plain = joint::joints(&scene, &frame, 1.0);
        // Twelve loose joints take long to simulate.
        let later: &[f64] = match scene.machine.loose_joints.len() {
            0..=8 => &[0.1, 0.4],
            _ => &[],
        };
        for time in [0.0, 9e-3].iter().chain(later).copied() {
            simulation.advance_to(time).expect("runs");
            simulation.sample(time, &mut frame);
            let m = view.magnification(&scene, &frame, &options);
            assert!(m > 15.0, "{name}: ×{m}");
            let joints = joint::joints(&scene, &frame, m);
            for (i, joint) in joints.iter().enumerate() {
                let ball = scene.machine.loose_joints[i].carried().body;
                for part in view.parts.iter().filter(|part| part.body != ball) {
                    let solid = part.place(&frame, &joints);
                    let Some(distance) = super::cast::distance(&solid, joint.socket_centre) else {
                        continue;
                    };
                    // A part that carries a socket at its original size touches it, and a bar ends at its outer face.
                    let touches = distance < plain[i].outer || part.reaches_socket(i);
                    assert!(
                        touches || distance >= joint.outer * 0.999,
                        "{name} at {time} s, ×{m}: joint {i} of {} m, {} m from part {} of {:?}",
                        joint.outer,
                        distance,
                        part.index,
                        part.body
                    );
                    checked += usize::from(!touches);
                }
            }
        }
    }
    assert!(checked > 100, "{checked}");
}

#[test]
fn only_the_differing_parts_of_a_ghost_are_drawn() {
    let (scene, frame) = fixture::three_legs();
    let view = SceneView::new(&scene, &frame);
    let (marks, options, camera) = (PeakMarks::new(), ViewOptions::default(), view.camera());
    let shot = shot(&scene, &frame, &marks, &options, &camera);
    let mut list = DrawList::default();
    view.build(&shot, &mut list);
    let mut ghost = frame.clone();
    assert!(!view.add_ghost(&shot, &ghost, Ghost::Twin, &mut list) && list.ghost.is_empty());
    let pixel = f64::from(camera.metres_per_pixel(SIZE));
    ghost.bodies[3].position.y += 0.2 * pixel;
    assert!(!view.add_ghost(&shot, &ghost, Ghost::Twin, &mut list), "a fifth of a pixel");
    ghost.bodies[3].position.y += 10.0 * pixel;
    assert!(view.add_ghost(&shot, &ghost, Ghost::Twin, &mut list));
    let moved = list.ghost.by_mesh[Mesh::Cylinder.index()].len();
    assert_eq!((list.ghost.len(), moved), (3, 1), "one rod with its two ends");
}

#[test]
fn arrows_start_at_the_contact_and_have_the_legends_length() {
    let (scene, frame) = fixture::pendulum();
    let mut options = ViewOptions { magnification: 20.0, triad: false, ..Default::default() };
    options.arrows.reference = Some(4.0);
    options.arrows.friction = false;
    let list = list(&scene, &frame, &options);
    let legend = list.legend.as_ref().expect("a legend");
    let shaft = list.arrows.by_mesh[Mesh::Cylinder.index()][0];
    let head = list.arrows.by_mesh[Mesh::Cone.index()][0];
    let along = |i: &Instance| Vec3::new(i.world_from_mesh[0][2], i.world_from_mesh[1][2], i.world_from_mesh[2][2]);
    // Force on the ball: up and to +X, against the wall's direction.
    let force = to_f32(&frame.joints[0].normal_force);
    let tip = place(&head) + along(&head);
    let pixel = |point: Vec3| list.eye.project(point, SIZE).expect("before the eye");
    // The isometric view looks at the force from 36 degrees beside it.
    let seen = pixel(tip).distance(pixel(place(&shaft))) / legend.pixels;
    assert!((0.7..=1.0).contains(&seen), "4 N at 4 N reference: {seen}");
    assert!((tip - place(&shaft)).normalize().dot(force.normalize()) > 0.9999);
    let contact = place(ball(&list, 0.010)) - force.normalize() * 0.010;
    assert!(place(&shaft).distance(contact) < 1e-6, "on the ball, where it touches");
    assert_eq!((legend.reference, legend.friction), (4.0, None));
}

#[test]
fn the_force_of_a_film_is_an_arrow_from_the_side_that_it_pushes() {
    let dry = r#"
        [contact]
        clearance = "0.1 mm"
        [[body]]
        name = "ball"
        mass = "1 kg"
        inertia = "4e-5 4e-5 4e-5 kg m^2"
        [[joint]]
        name = "ball"
        kind = "free"
        child = "ball"
        start = { position = "10 0 -50 um", velocity = "2 0 -5 mm/s" }
        [[ball_joint]]
        name = "S"
        socket = { body = "world" }
        ball = { body = "ball" }
        "#;
    let film = "[[lubricant]]\nname = \"oil\"\njoint = \"S\"\nviscosity = \"50 mPa s\"\n";
    let mut options = ViewOptions { triad: false, ..Default::default() };
    options.arrows.reference = Some(100.0);
    let (scene, frame) = started(&format!("{dry}{film}"), &[]);
    let drawn = list(&scene, &frame, &options);
    let force = to_f32(&frame.elements[0].force);
    assert_eq!(to_f32(&frame.joints[0].lubricant_force), force);
    assert!((40.0..100.0).contains(&force.length()), "{force}");
    let [shaft, head] = [Mesh::Cylinder, Mesh::Cone].map(|mesh| drawn.arrows.by_mesh[mesh.index()][0]);
    assert_eq!(drawn.arrows.by_mesh[Mesh::Cone.index()].len(), 1);
    let along = |i: &Instance| Vec3::new(i.world_from_mesh[0][2], i.world_from_mesh[1][2], i.world_from_mesh[2][2]);
    let arrow = place(&head) + along(&head) - place(&shaft);
    assert!(arrow.normalize().dot(force.normalize()) > 0.9999);
    // As long as that of a contact force of its size.
    let legend = drawn.legend.as_ref().expect("a legend");
    let pixel = |point: Vec3| drawn.eye.project(point, SIZE).expect("before the eye");
    let seen = pixel(place(&shaft)).distance(pixel(place(&shaft) + arrow)) / legend.pixels / (force.length() / 100.0);
    assert!((0.7..=1.0).contains(&seen), "{seen}");
    let from = place(ball(&drawn, 0.010)) - force.normalize() * 0.010;
    assert!(place(&shaft).distance(from) < 1e-6, "{} {from}", place(&shaft));
    assert!(legend.lubricant.is_some());
    options.arrows.normal = false;
    options.arrows.friction = true;
    let hidden = list(&scene, &frame, &options);
    assert!(hidden.arrows.by_mesh[Mesh::Cone.index()].is_empty());
    assert_eq!(hidden.legend.expect("a legend").lubricant, None);
    // Without a film, nothing of it.
    options.arrows.normal = true;
    let (scene, frame) = started(dry, &[]);
    assert_eq!(list(&scene, &frame, &options).legend.expect("a legend").lubricant, None);
}

#[test]
fn a_logarithmic_scale_shortens_three_decades_to_one_length() {
    let (scene, frame) = fixture::pendulum();
    let mut options = ViewOptions::default();
    options.arrows.scaling = Scaling::Logarithmic;
    options.arrows.reference = Some(1000.0);
    let legend = list(&scene, &frame, &options).legend.expect("a legend");
    let fractions: Vec<f32> = legend.ticks.iter().map(|tick| tick.fraction).collect();
    assert_eq!(legend.ticks.iter().map(|tick| tick.force.round()).collect::<Vec<_>>(), [1.0, 10.0, 100.0, 1000.0]);
    for (fraction, expect) in fractions.iter().zip([0.1, 0.347, 0.668, 1.0]) {
        assert!((fraction - expect).abs() < 2e-3, "{fractions:?}");
    }
}

#[test]
fn the_picked_part_is_the_one_drawn_under_the_cursor() {
    let (scene, frame) = fixture::three_legs();
    let view = SceneView::new(&scene, &frame);
    let (marks, options) = (PeakMarks::new(), ViewOptions { magnification: 30.0, ..Default::default() });
    let mut camera = view.camera();
    view.fit(&mut camera, &scene, &frame, &options, SIZE);
    let shot = shot(&scene, &frame, &marks, &options, &camera);
    let under = |point: Vec3| {
        let pixel = camera.project(point, SIZE).expect("before the eye");
        view.pick(&shot, pixel).map(|hit| hit.what)
    };
    let middle_of_rod = Pose::in_frame(&frame, Some(3)).apply(Vec3::new(0.0, 0.0, 0.1));
    assert_eq!(under(to_f32(&frame.joints[0].socket_centre)), Some(ScenePart::Joint(0)));
    assert_eq!(under(middle_of_rod), Some(ScenePart::Body(3)));
    assert_eq!(under(to_f32(&frame.bodies[6].position)), Some(ScenePart::Body(6)));
    assert_eq!(under(to_f32(&frame.bodies[0].position)), Some(ScenePart::Body(0)));
    assert_eq!(under(Vec3::new(0.032, 0.0, 0.29)), Some(ScenePart::Fixed(0)));
    assert_eq!(view.pick(&shot, Vec2::new(2.0, 2.0)), None, "the background");
    let pixel = camera.project(to_f32(&frame.joints[1].socket_centre), SIZE).expect("before the eye");
    let hit = view.pick(&shot, pixel).expect("a socket");
    assert_eq!(view.anchor(&scene, &frame, hit.what), Some(to_f32(&frame.joints[1].socket_centre)));
}

#[test]
fn axes_gravity_and_joints_are_labelled_at_their_positions() {
    let (scene, frame) = fixture::three_legs();
    let list = list(&scene, &frame, &ViewOptions::default());
    let texts: Vec<&str> = list.labels.iter().map(|label| &*label.text).collect();
    assert_eq!(texts, ["X", "Y", "Z", "g", "S1", "S2", "S3"]);
    let label = list.labels.iter().find(|label| label.kind == LabelKind::Joint(1)).expect("S2");
    let joint = list.eye.project(to_f32(&frame.joints[1].socket_centre), SIZE).expect("before the eye");
    assert!(
        (label.pixel.x - joint.x).abs() < 2.0 && (5.0..80.0).contains(&(joint.y - label.pixel.y)),
        "above its socket"
    );
    let x = &list.labels[0];
    let origin = list.overlay.by_mesh[Mesh::Cylinder.index()][0];
    let corner = list.eye.project(place(&origin), SIZE).expect("before the eye");
    assert!(x.pixel.y > corner.y + 10.0, "the X axis of this scene points down");
    assert!((corner - Vec2::new(62.0, 720.0 - 62.0)).length() < 1.0, "in the lower left corner: {corner}");
    let view = SceneView::new(&scene, &frame);
    let marks = PeakMarks::new();
    let (options, camera) = (ViewOptions::default(), view.camera());
    let narrow = Shot { size: [240, 320], ..shot(&scene, &frame, &marks, &options, &camera) };
    let mut list = DrawList::default();
    view.build(&narrow, &mut list);
    let texts: Vec<&str> = list.labels.iter().map(|label| &*label.text).collect();
    assert!(texts.contains(&"Z") && !texts.contains(&"g"), "{texts:?}");
}

#[test]
fn building_twice_gives_the_same_list_in_the_same_buffers() {
    let (scene, frame) = fixture::three_legs();
    let view = SceneView::new(&scene, &frame);
    let (options, camera) = (ViewOptions::default(), view.camera());
    let mut marks = PeakMarks::new();
    marks.update(&frame, &fixture::hits(&frame), 1.0);
    let shot = shot(&scene, &frame, &marks, &options, &camera);
    let mut list = DrawList::default();
    view.build(&shot, &mut list);
    assert_eq!(list.halos.len(), 3, "every joint was hit");
    let first = list.clone();
    let buffer = list.solid.by_mesh[0].as_ptr();
    view.build(&shot, &mut list);
    assert_eq!(list, first);
    assert_eq!(list.solid.by_mesh[0].as_ptr(), buffer);
}

#[test]
fn a_flash_is_a_narrow_ring_in_a_close_up_and_a_wide_one_at_a_distance() {
    let (scene, frame) = fixture::three_legs();
    let view = SceneView::new(&scene, &frame);
    let options = ViewOptions::default();
    let mut marks = PeakMarks::new();
    marks.update(&frame, &fixture::hits(&frame), 1.0);
    let ring = |camera: &crate::view::Camera| {
        let mut list = DrawList::default();
        view.build(&shot(&scene, &frame, &marks, &options, camera), &mut list);
        let halo = list.halos[0];
        let (radius, inner) = (halo.world_from_mesh[0][0], halo.metal);
        let [low, high] = [inner, 1.0].map(|share| {
            let edge = place(&halo) + camera.axes().0 * (share * radius);
            list.eye.project(edge, list.size).expect("in front").x
        });
        (high - low, 1.0 / inner)
    };
    let mut near = view.camera();
    view.close_up(&mut near, 0, &scene, &frame, &options);
    let (wide, share) = ring(&near);
    assert!((15.0..25.0).contains(&wide) && share < 1.3, "{wide} pixels, {share} of the socket");
    let mut far = view.camera();
    view.fit(&mut far, &scene, &frame, &options, SIZE);
    let (wide, share) = ring(&far);
    assert!(wide < 25.0 && (share - 1.7).abs() < 1e-3, "{wide} pixels, {share} of the socket");
}

#[test]
fn fitting_includes_protruding_parts_and_keeps_clear_of_plates() {
    // The discs of the stop are far beyond the rail.
    let stop = "[[stop]]\nname = \"ends\"\njoint = \"slide\"\nlower = \"-900 mm\"\nupper = \"800 mm\"\nforce = \"100 N\"\ndepth = \"1 mm\"\n";
    let motor = "[[motor]]\nname = \"m\"\njoint = \"slide\"\nforce = \"1 N\"\n";
    for element in [stop, motor] {
        let (scene, frame) = started(&format!("{ATTACHED}{element}"), &[]);
        let view = SceneView::new(&scene, &frame);
        let options = ViewOptions { floor: false, triad: false, ..ViewOptions::default() };
        let corners = [[Vec2::ZERO, Vec2::new(300.0, 180.0)], [Vec2::new(1000.0, 500.0), Vec2::new(1280.0, 720.0)]];
        for plates in [&[][..], &corners] {
            let mut camera = view.camera();
            view.fit_around(&mut camera, &scene, &frame, &options, SIZE, plates, &Swept::default());
            let marks = PeakMarks::new();
            let mut list = DrawList::default();
            view.build(&shot(&scene, &frame, &marks, &options, &camera), &mut list);
            let mut seen = 0;
            for bar in &list.solid.by_mesh[Mesh::Cylinder.index()] {
                let [x, y, z] = bar.world_from_mesh;
                let column = |k: usize| Vec3::new(x[k], y[k], z[k]);
                for end in [column(3), column(3) + column(2)] {
                    let at = camera.project(end, SIZE).expect("in front");
                    assert!(at.cmpge(Vec2::ZERO).all() && at.cmple(Vec2::new(1280.0, 720.0)).all(), "{at}");
                    seen += 1;
                }
            }
            assert!(seen > 4);
            let cover = crate::view::Cover::of(&list, 4.0);
            for [low, high] in plates {
                assert_eq!(cover.covered_fractions(*low, *high), [0.0; 2], "{low} {high}");
            }
        }
    }
}

#[test]
fn a_frame_with_non_finite_numbers_is_drawn_without_a_panic() {
    let (scene, mut frame) = fixture::three_legs();
    frame.bodies[3].position.x = f64::NAN;
    frame.joints[0].eccentricity.y = f64::NAN;
    frame.joints[1].normal_force.z = f64::INFINITY;
    let drawn = list(&scene, &frame, &ViewOptions { magnification: f32::NAN, ..Default::default() });
    assert_eq!(drawn.magnification, 1.0);
    let (view, marks, options) = (SceneView::new(&scene, &frame), PeakMarks::new(), ViewOptions::default());
    let mut camera = view.camera();
    view.fit(&mut camera, &scene, &frame, &options, SIZE);
    assert!(camera.eye().is_finite());
    for x in (0..SIZE[0]).step_by(40) {
        view.pick(&shot(&scene, &frame, &marks, &options, &camera), Vec2::new(x as f32, 360.0));
    }
    let empty = Frame::default();
    assert!(list(&scene, &empty, &ViewOptions::default()).sockets.is_empty());
}

#[test]
fn a_spring_is_within_the_picture_from_end_to_end() {
    let text = "[[body]]\nname = \"mass\"\nmass = \"1 kg\"\ninertia = \"1 1 1 kg m^2\"\n\
                shapes = [{ form = \"box\", centre = [0, 0, 0], size = \"20 20 20 mm\", role = \"slider\" }]\n\
                [[joint]]\nname = \"free\"\nkind = \"free\"\nchild = \"mass\"\nstart = { position = \"0 0 -200 mm\" }\n\
                [[spring]]\nname = \"s\"\nfrom = { body = \"world\" }\nto = { body = \"mass\" }\nlength = \"1 m\"\nstiffness = \"1 N/m\"\n";
    let scene = Scene::parse(text, None, &[]).unwrap();
    let mut simulation = crate::simulate::Simulation::new(&scene.machine).unwrap();
    let mut frame = Frame::default();
    simulation.sample(0.0, &mut frame);
    let view = SceneView::new(&scene, &frame);
    let mut camera = view.camera();
    view.fit(&mut camera, &scene, &frame, &ViewOptions::default(), SIZE);
    let ends = frame.elements[0].points;
    for end in ends {
        let at = camera.project(to_f32(&end), SIZE).unwrap();
        assert!(at.cmpge(Vec2::ZERO).all() && at.cmple(Vec2::new(1280.0, 720.0)).all(), "{at}");
    }
}

/// A scene from its text and its first frame.
fn started(text: &str, files: &[(&str, &str)]) -> (Scene, Frame) {
    let files = files.iter();
    let files = files.map(|(name, text)| ((*name).to_owned(), Arc::from(*text)));
    let scene = Scene::parse_with(text, None, &files.collect(), &[]).unwrap();
    let mut frame = Frame::default();
    Simulation::new(&scene.machine).unwrap().sample(0.0, &mut frame);
    (scene, frame)
}

/// A hinge about y at the origin with an arm to x = 100 mm.
const ARM: &str = r#"
[[body]]
name = "arm"
mass = "1 kg"
inertia = "1e-3 1e-3 1e-3 kg m^2"
centre = "50 0 0 mm"
shapes = [{ form = "box", centre = "50 0 0 mm", size = "100 20 10 mm" }]

[[joint]]
name = "hinge"
kind = "revolute"
child = "arm"
axis = [0, 1, 0]
"#;

fn count(list: &DrawList, mesh: Mesh) -> usize {
    list.solid.by_mesh[mesh.index()].len()
}

#[test]
fn a_hinge_has_a_pin_unless_the_scene_draws_it() {
    let (scene, frame) = started(ARM, &[]);
    let options = ViewOptions::default();
    let drawn = list(&scene, &frame, &options);
    let [pin] = drawn.solid.by_mesh[Mesh::Cylinder.index()][..] else {
        panic!("one pin");
    };
    // The pin runs through the whole arm and sticks out on both sides.
    let row = pin.world_from_mesh[1];
    let (from, to) = (row[3], row[3] + row[2]);
    assert!((from + to).abs() < 1e-6 && (0.0101..0.02).contains(&to.abs()), "{from} {to}");

    let hidden = ViewOptions { hinges: false, ..Default::default() };
    assert_eq!(count(&list(&scene, &frame, &hidden), Mesh::Cylinder), 0);
    let (scene, frame) = started(&format!("{ARM}drawn = false\n"), &[]);
    assert_eq!(count(&list(&scene, &frame, &options), Mesh::Cylinder), 0);
    let shaft = "\n[[fixed_shape]]\nform = \"cylinder\"\nfrom = \"0 -30 0 mm\"\nto = \"0 0 0 mm\"\nradius = \"4 mm\"\n";
    let (scene, frame) = started(&format!("{ARM}{shaft}"), &[]);
    let parts = list(&scene, &frame, &options);
    assert_eq!(count(&parts, Mesh::Cylinder) + parts.faded.len(), 1);
    // A disc is no pin.
    let disc = shaft.replace("-30", "-1");
    let (scene, frame) = started(&format!("{ARM}{disc}"), &[]);
    let parts = list(&scene, &frame, &options);
    assert_eq!(count(&parts, Mesh::Cylinder) + parts.faded.len(), 2);
}

#[test]
fn a_slide_has_a_rail_beyond_what_slides_on_it() {
    let text = ARM.replace("revolute", "prismatic").replace("[0, 1, 0]", "[1, 0, 0]");
    let (scene, frame) = started(&text, &[]);
    let drawn = list(&scene, &frame, &ViewOptions::default());
    let [rail, _sleeve] = drawn.solid.by_mesh[Mesh::Cylinder.index()][..] else {
        panic!("a rail and a sleeve");
    };
    let row = rail.world_from_mesh[0];
    assert!(row[3] < 0.0 && row[3] + row[2] > 0.1);
    let rail = "\n[[fixed_shape]]\nrole = \"rail\"\nform = \"box\"\ncentre = \"0 0 -10 mm\"\nsize = \"1 1 1 mm\"\n";
    let (scene, frame) = started(&format!("{text}{rail}"), &[]);
    let drawn = list(&scene, &frame, &ViewOptions::default());
    assert_eq!(count(&drawn, Mesh::Cylinder), 0);
}

/// Ends of the drawn bars, world axes, m: first those along `axis`, then the others.
fn bars(list: &DrawList, axis: Vec3) -> [Vec<[Vec3; 2]>; 2] {
    let bars = &list.solid.by_mesh[Mesh::Cylinder.index()];
    let ends = bars.iter().map(|bar| {
        let [x, y, z] = bar.world_from_mesh;
        let from = Vec3::new(x[3], y[3], z[3]);
        [from, from + Vec3::new(x[2], y[2], z[2])]
    });
    let along = |[from, to]: &[Vec3; 2]| (*to - *from).normalize().cross(axis).length() < 1e-5;
    let (along, others) = ends.partition(along);
    [along, others]
}

#[test]
fn a_universal_joint_is_a_cross_of_two_pins() {
    let text = ARM.replace("revolute", "universal")
        + "child_axis = [0, 0, 1]\nstart = { angle = \"30 deg\", child_angle = \"20 deg\" }\n";
    let (scene, frame) = started(&text, &[]);
    let [first, second] = bars(&list(&scene, &frame, &ViewOptions::default()), Vec3::Y);
    let ([[from, to]], [[low, high]]) = (&first[..], &second[..]) else {
        panic!("a pin along each axis: {first:?} {second:?}");
    };
    // Both pins pass through the arm, which is 20 mm wide, are equally long and cross at a right angle in the joint.
    assert!((0.0101..0.02).contains(&to.y.abs()), "{to}");
    assert!((from.distance(*to) - low.distance(*high)).abs() < 1e-6);
    assert!((*from + *to).length() < 1e-6 && (*low + *high).length() < 1e-6);
    // The second pin turns with the child: about y by the first angle, since the other angle is about itself.
    let axis = Vec3::new(0.5, 0.0, 0.75_f32.sqrt());
    assert!((*high - *low).normalize().cross(axis).length() < 1e-5);
    let (scene, frame) = started(&format!("{text}drawn = false\n"), &[]);
    let hidden = list(&scene, &frame, &ViewOptions::default());
    assert_eq!(count(&hidden, Mesh::Cylinder), 0);
}

#[test]
fn a_cylindrical_joint_is_a_rail_and_a_sleeve_with_a_pin_across_or_the_bearing_of_a_shaft() {
    let text = ARM.replace("revolute", "cylindrical").replace("[0, 1, 0]", "[1, 0, 0]");
    let (scene, frame) = started(&text, &[]);
    let options = ViewOptions::default();
    let [along, across] = bars(&list(&scene, &frame, &options), Vec3::X);
    assert_eq!((along.len(), across.len()), (2, 1));
    // The pin turns with the child from its first position.
    let turned = text + "start = { angular_velocity = \"1000 rad/s\" }\n";
    let (scene, first) = started(&turned, &[]);
    let view = SceneView::new(&scene, &first);
    let (mut simulation, mut frame) = (Simulation::new(&scene.machine).unwrap(), Frame::default());
    simulation.advance_to(1e-3).unwrap();
    simulation.sample(1e-3, &mut frame);
    let (marks, camera, mut drawn) = (PeakMarks::new(), view.camera(), DrawList::default());
    view.build(&shot(&scene, &frame, &marks, &options, &camera), &mut drawn);
    let [_, after] = bars(&drawn, Vec3::X);
    let along = |[from, to]: [Vec3; 2]| (to - from).normalize();
    let cosine = along(across[0]).dot(along(after[0]));
    assert!((cosine - 1_f32.cos()).abs() < 1e-3, "{cosine}");

    let shaft = "{ form = \"cylinder\", from = \"0 0 0 mm\", to = \"100 0 0 mm\", radius = \"8 mm\" }";
    let shapes = turned.lines().find(|l| l.starts_with("shapes")).unwrap();
    let turned = turned.replace(shapes, &format!("shapes = [{shaft}]"));
    let (scene, frame) = started(&turned, &[]);
    let [along, across] = bars(&list(&scene, &frame, &options), Vec3::X);
    // The shaft, and its shorter bearing around the joint.
    assert_eq!((along.len(), across.len()), (2, 1));
    let lengths = along.iter().map(|[from, to]| from.distance(*to));
    let shortest = lengths.fold(f32::INFINITY, f32::min);
    assert!((0.02..0.03).contains(&shortest), "{along:?}");
    assert!(across[0][0].x > 0.5 * shortest, "beside it: {across:?}");
}

#[test]
fn joints_that_close_loops_are_drawn_like_tree_joints() {
    let closing = |kind: &str| {
        let text = format!(
            "{ARM}drawn = false\n[[joint]]\nname = \"closes\"\nkind = \"{kind}\"\nchild = \"arm\"\n\
             axis = [0, 1, 0]\nparent_point = \"60 0 0 mm\"\nchild_point = \"60 0 0 mm\"\ncloses_loop = true\n"
        );
        let second = match kind {
            "universal" => "child_axis = [0, 0, 1]\n",
            _ => "",
        };
        let (scene, frame) = started(&(text + second), &[]);
        let [along, others] = bars(&list(&scene, &frame, &ViewOptions::default()), Vec3::Y);
        for [from, to] in &along {
            let off = (*from + *to) * 0.5 - Vec3::new(0.06, 0.0, 0.0);
            assert!(off.length() < 1e-6, "{kind}: {from} {to}");
        }
        [along.len(), others.len()]
    };
    assert_eq!(closing("revolute"), [1, 0]);
    assert_eq!(closing("prismatic"), [2, 0]);
    assert_eq!(closing("cylindrical"), [2, 1]);
    assert_eq!(closing("universal"), [1, 1]);
}

#[test]
fn a_body_without_shapes_is_drawn() {
    let shapes = ARM.lines().find(|line| line.starts_with("shapes")).unwrap();
    let (scene, frame) = started(&ARM.replace(shapes, ""), &[]);
    let view = SceneView::new(&scene, &frame);
    assert!((0.025..0.05).contains(&view.bounds().radius), "{:?}", view.bounds());
    let drawn = list(&scene, &frame, &ViewOptions::default());
    assert!(count(&drawn, Mesh::Sphere) >= 1 && count(&drawn, Mesh::Cylinder) >= 2);
}

#[test]
fn shapes_of_one_file_share_a_mesh_and_are_picked() {
    let wedge = "v 0 -10 -10\nv 0 10 -10\nv 0 0 10\nv 30 0 0\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    let mesh = "{ form = \"mesh\", file = \"a.obj\", unit = \"mm\"";
    let two = format!("shapes = [{mesh} }}, {mesh}, position = \"60 0 0 mm\", colour = \"#ff8000\" }}]");
    let shapes = ARM.lines().find(|line| line.starts_with("shapes")).unwrap();
    let (scene, frame) = started(&ARM.replace(shapes, &two), &[("a.obj", wedge)]);
    let options = ViewOptions::default();
    let drawn = list(&scene, &frame, &options);
    let last = Mesh::Plate(drawn.plates.len() as u16 - 1);
    let [near, far] = drawn.solid.by_mesh[last.index()][..] else {
        panic!("two instances of one mesh");
    };
    assert!(far.colour == [1.0, 128.0 / 255.0, 0.0, 1.0] && near.colour != far.colour);
    assert!((place(&far).x - 0.06).abs() < 1e-6);
    let view = SceneView::new(&scene, &frame);
    let marks = PeakMarks::new();
    let camera = view.camera();
    let shot = shot(&scene, &frame, &marks, &options, &camera);
    let pixel = drawn.eye.project(Vec3::new(0.065, 0.0, 0.0), SIZE).unwrap();
    let hit = view.pick(&shot, pixel).unwrap();
    assert_eq!(hit.what, ScenePart::Body(0));
    assert!((0.055..0.1).contains(&hit.point.x), "{:?}", hit.point);
    // Past its edge there is nothing.
    let pixel = drawn.eye.project(Vec3::new(0.045, 0.02, 0.0), SIZE).unwrap();
    assert_eq!(view.pick(&shot, pixel), None);
}

/// A slide with a stop at either end, a hinge with a motor, and a bushing between them.
const ATTACHED: &str = "[[body]]\nname = \"mass\"\nmass = \"1 kg\"\ninertia = \"1 1 1 kg m^2\"\n\
    shapes = [{ form = \"box\", centre = [0, 0, 0], size = \"20 20 20 mm\", role = \"slider\" }]\n\
    [[body]]\nname = \"arm\"\nmass = \"1 kg\"\ncentre = \"50 0 0 mm\"\ninertia = \"1 1 1 kg m^2\"\n\
    shapes = [{ form = \"capsule\", from = [0, 0, 0], to = \"100 0 0 mm\", radius = \"4 mm\", role = \"driven-rod\" }]\n\
    [[joint]]\nname = \"slide\"\nkind = \"prismatic\"\nchild = \"mass\"\naxis = [1, 0, 0]\n\
    [[joint]]\nname = \"hinge\"\nkind = \"revolute\"\nchild = \"arm\"\naxis = [0, 1, 0]\nparent_point = \"0 0 150 mm\"\n";

#[test]
fn bushings_stops_and_motors_are_drawn_where_they_act() {
    let stop = "[[stop]]\nname = \"ends\"\njoint = \"slide\"\nlower = \"-60 mm\"\nupper = \"80 mm\"\nforce = \"100 N\"\ndepth = \"1 mm\"\n";
    let turn =
        "[[stop]]\nname = \"ends\"\njoint = \"hinge\"\nupper = \"90 deg\"\ntorque = \"1 N m\"\ndepth = \"1 deg\"\n";
    let motor = "[[motor]]\nname = \"m\"\njoint = \"hinge\"\ntorque = \"1 N m\"\n";
    let push = "[[motor]]\nname = \"m\"\njoint = \"slide\"\nforce = \"1 N\"\n";
    let bushing = "[[bushing]]\nname = \"b\"\nfrom = { body = \"world\" }\nto = { body = \"mass\" }\nstiffness = [\"1 N/m\", 0, 0]\n";
    let count = |list: &DrawList| list.solid.by_mesh[Mesh::Cylinder.index()].len();
    let drawn = |text: &str| {
        let (scene, frame) = started(&format!("{ATTACHED}{text}"), &[]);
        list(&scene, &frame, &ViewOptions::default())
    };
    let bare = drawn("");
    for (text, cylinders, has_lines) in
        [(stop, 2, false), (turn, 1, false), (motor, 1, true), (push, 1, true), (bushing, 2, false)]
    {
        let list = drawn(text);
        assert_eq!(count(&list), count(&bare) + cylinders, "{text}");
        assert_eq!(list.lines.len() > bare.lines.len(), has_lines, "{text}");
    }
    // The discs begin where the slide ends, and face away from it.
    let list = drawn(stop);
    let ends: Vec<f32> = list.solid.by_mesh[Mesh::Cylinder.index()].iter().map(|bar| place(bar).x).collect();
    for limit in [-0.06, 0.08] {
        assert!(ends.iter().any(|x| (x - limit).abs() < 1e-6), "{ends:?}");
    }
    // Turned by its limit, the arm would point down: along -z.
    let list = drawn(turn);
    let pegs = &list.solid.by_mesh[Mesh::Cylinder.index()];
    let below = pegs.iter().any(|peg| {
        let at = place(peg);
        at.x.abs() < 1e-5 && at.y.abs() < 1e-5 && (0.05..0.149).contains(&at.z)
    });
    assert!(below, "{:?}", pegs.iter().map(place).collect::<Vec<_>>());
}
