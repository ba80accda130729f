//! What is drawn of pins and slides against the gaps of the simulation: the draw list alone is measured, not what placed it.

use glam::{Mat3, Vec3};

use crate::machine::LooseKind;
use crate::scene::Scene;
use crate::simulate::{Frame, Simulation, Wear};
use crate::view::{
    DrawList, Instance, LabelKind, Layer, Mesh, PeakMarks, SceneView, Shot, ViewOptions, WearMap, to_f32, zones,
};

/// A pin in the world that is thrown with spin and tilt, so that it touches with both ends and both collars; `play`: more keys.
fn pin(play: &str) -> String {
    format!(
        r#"
        [contact]
        friction = 0.15
        [[body]]
        name = "pin"
        mass = "0.1 kg"
        inertia = "5e-6 1.6e-5 1.6e-5 kg m^2"
        [[joint]]
        name = "J"
        kind = "revolute"
        child = "pin"
        axis = [1, 2, 0.5]
        play = {{ radial = "0.1 mm", axial = "0.2 mm", length = "24 mm", radius = "10 mm", {play} }}
        start = {{ velocity = "20 rad/s", offset_velocity = "0.1 0.4 -0.2 m/s", tilt_velocity = "0 3 -2 rad/s" }}
        "#
    )
}

/// A block in a guide in the world, thrown so that it turns between all four walls; `play`: more keys.
fn block(play: &str) -> String {
    format!(
        r#"
        [[body]]
        name = "block"
        mass = "0.1 kg"
        inertia = "2e-5 3e-5 3e-5 kg m^2"
        [[joint]]
        name = "G"
        kind = "prismatic"
        child = "block"
        axis = [1, 2, 0.5]
        play = {{ y = "0.2 mm", half_length = "20 mm", half_y = "12 mm", {play} }}
        start = {{ velocity = "0.3 m/s", offset_velocity = "0 0.1 0.05 m/s", tilt_velocity = "2 3 -4 rad/s" }}
        "#
    )
}

const MAGNIFICATION: f32 = 15.0;
const SIZE: [u32; 2] = [1280, 720];

fn scene(text: &str) -> Scene {
    Scene::parse(text, None, &[]).expect("a scene")
}

/// Draws `frame` with its arrows.
fn list(scene: &Scene, frame: &Frame) -> DrawList {
    list_with_wear(scene, frame, None)
}

/// The same with the impulses of a wear map.
fn list_with_wear(scene: &Scene, frame: &Frame, wear: Option<&Wear>) -> DrawList {
    let map = if wear.is_some() { WearMap::Impulse } else { WearMap::Off };
    let options = ViewOptions { magnification: MAGNIFICATION, wear: map, ..Default::default() };
    let view = SceneView::new(scene, frame);
    let (mut camera, marks) = (view.camera(), PeakMarks::new());
    view.fit(&mut camera, scene, frame, &options, SIZE);
    let shot = Shot {
        scene,
        frame,
        marks: &marks,
        options: &options,
        camera: &camera,
        trail: &[],
        size: SIZE,
        pixels_per_point: 1.0,
    };
    let mut out = DrawList::default();
    view.build(&shot, &mut out);
    wear.into_iter().for_each(|wear| view.add_wear(&shot, wear, &mut out));
    assert_eq!(out.magnification, MAGNIFICATION, "fits");
    out
}

/// Calls `visit` with the frames of `text` over 20 ms, and the drawn list of each.
fn run(text: &str, mut visit: impl FnMut(&Scene, &Frame, &DrawList)) {
    let scene = scene(text);
    let mut simulation = Simulation::new(&scene.machine).expect("starts");
    let mut frame = Frame::default();
    let mut drawn = 0;
    while simulation.time() < 20e-3 {
        simulation.step().expect("runs");
        simulation.sample_now(&mut frame);
        if simulation.time() * 4e3 > f64::from(drawn) {
            drawn += 1;
            visit(&scene, &frame, &list(&scene, &frame));
        }
    }
}

fn linear(instance: &Instance) -> Mat3 {
    Mat3::from_cols_array_2d(&[0, 1, 2].map(|k| instance.world_from_mesh.map(|row| row[k])))
}

fn origin(instance: &Instance) -> Vec3 {
    Vec3::from(instance.world_from_mesh.map(|row| row[3]))
}

/// `point` in the coordinates of the mesh.
fn in_mesh(instance: &Instance, point: Vec3) -> Vec3 {
    linear(instance).inverse() * (point - origin(instance))
}

fn of(layer: &Layer, mesh: Mesh) -> &[Instance] {
    &layer.by_mesh[mesh.index()]
}

/// Largest deviation of a drawn gap from the magnified one, m: f32, and the terms in the square of the tilt that the linear geometry
/// of the drawing leaves out, 2 c / L times a tenth of the play.
fn tolerance(play: f64) -> f32 {
    MAGNIFICATION * 2e-3 * play as f32 + 2e-7
}

/// The bearing's halves are the only instances of the scene's last mesh.
fn bearing(list: &DrawList) -> &Instance {
    &list.faded.by_mesh.last().expect("a mesh")[0]
}

/// Drawn gaps at the places of a pin, measured on cylinders: `shaft` and the bearing; of the collars, at radius `rim` if that is given.
fn pin_gaps(list: &DrawList, ends_on_pin: bool, rim: Option<f32>) -> [f32; 4] {
    let bearing = bearing(list);
    let middle = origin(bearing);
    let (inner, half) = (linear(bearing).x_axis.length(), linear(bearing).z_axis / 2.0);
    let axis = half.normalize();
    // The thickest shaft is the pin.
    let shafts = of(&list.solid, Mesh::Cylinder).iter();
    let shaft = shafts.max_by(|a, b| linear(a).x_axis.length().total_cmp(&linear(b).x_axis.length())).expect("a pin");
    let radius = linear(shaft).x_axis.length();
    let centre = |x: f32| {
        origin(shaft)
            + linear(shaft).z_axis * ((x - (origin(shaft) - middle).dot(axis)) / linear(shaft).z_axis.dot(axis))
    };
    let ends = if ends_on_pin {
        [origin(shaft), origin(shaft) + linear(shaft).z_axis].map(|end| (end - middle).dot(axis))
    } else {
        [-half.length(), half.length()]
    };
    let [a, b] = ends.map(|x| inner - radius - (centre(x) - middle - axis * x).length());
    // The faded cylinders are the collars; their faces are at z = 0 and 1 of the mesh.
    let face = |side: f32| {
        let collars = of(&list.faded, Mesh::Cylinder).iter();
        let collar = collars
            .max_by(|a, b| (side * (origin(a) - middle).dot(axis)).total_cmp(&(side * (origin(b) - middle).dot(axis))));
        let collar = collar.expect("a collar");
        let inside = if side > 0.0 { 0.0 } else { 1.0 };
        let thickness = linear(collar).z_axis.length();
        // Of four points on the rim of the bearing, as in the simulation, the nearest.
        let [y, z] = [0, 1].map(|k| Mat3::from_cols(rim_axes()[0], rim_axes()[1], Vec3::ZERO).col(k));
        let points = match rim {
            Some(rim) => [y, z, -y, -z].map(|out| middle + half * side + out * rim),
            None => [centre(side * half.length()); 4].map(|at| at + (middle + half * side - at).project_onto(axis)),
        };
        let gaps = points.map(|point| side * (inside - in_mesh(collar, point).z) * thickness);
        gaps.into_iter().fold(f32::INFINITY, f32::min)
    };
    // Moved towards +axis, the pin touches with the collar behind.
    [a, b, face(-1.0), face(1.0)]
}

/// The second and third axis of the joints above.
fn rim_axes() -> [Vec3; 2] {
    let scene = scene(&pin(""));
    let turn = scene.machine.loose_joints[0].frames[0].rotation.to_rotation_matrix().into_inner();
    [1, 2].map(|k| to_f32(&turn.column(k).into_owned()))
}

#[test]
fn a_drawn_pin_has_the_gaps_of_the_simulation_at_its_ends_and_collars_and_touches_where_it_does() {
    for (keys, ends_on_pin, rim) in [
        ("ends = \"pin\"", true, None),
        ("ends = \"bearing\"", false, None),
        ("ends = \"bearing\", face_radius = \"13 mm\"", false, Some(0.013)),
    ] {
        let mut touched = [0; 4];
        run(&pin(keys), |_, frame, list| {
            for (place, (site, drawn)) in frame.sites.iter().zip(pin_gaps(list, ends_on_pin, rim)).enumerate() {
                let play = if place < 2 { 1e-4 } else { 2e-4 };
                let expected = MAGNIFICATION * site.gap as f32;
                assert!(
                    (drawn - expected).abs() < tolerance(play),
                    "{keys}, place {place} at {} s: {drawn} for {expected} m",
                    frame.time
                );
                touched[place] += u32::from(site.gap < 0.0);
            }
        });
        assert!(touched[0] > 0 && touched[1] > 0 && touched[2] + touched[3] > 0, "{keys}: {touched:?}");
    }
}

#[test]
fn a_drawn_block_has_the_gaps_of_the_simulation_at_its_corners() {
    for keys in ["planar = true", "z = \"0.3 mm\", half_z = \"9 mm\""] {
        let mut touched = 0;
        run(&block(keys), |scene, frame, list| {
            let own = of(&list.solid, Mesh::Cube).first().expect("the block");
            let walls = of(&list.faded, Mesh::Cube);
            let names = scene.machine.loose_joints[0].kind.site_names();
            for (site, name) in frame.sites.iter().zip(names) {
                let corner = name[..1].parse::<u8>().expect("a digit") - 1;
                let sign = |bit: u8| if corner & bit == 0 { -0.5 } else { 0.5 };
                let is_planar = names.len() == 4;
                let local = Vec3::new(sign(4), sign(2), if is_planar { 0.0 } else { sign(1) });
                let point = origin(own) + linear(own) * local;
                // The wall that the name tells, on the side of the corner: its nearer face is at half an edge.
                let (axis, side) = if name.ends_with('y') { (1, sign(2)) } else { (2, sign(1)) };
                let gap = |wall: &Instance| {
                    let normal = linear(wall).col(axis).normalize();
                    let out = (origin(wall) - origin(own)).dot(normal);
                    let thickness = linear(wall).col(axis).length();
                    let is_own = out * side > 0.0 && thickness < 0.005;
                    is_own.then(|| (origin(wall) - point).dot(normal).abs() - thickness / 2.0)
                };
                // A corner that is pressed in is beyond the face.
                let drawn = walls.iter().find_map(gap).expect("a wall");
                let expected = MAGNIFICATION * site.gap as f32;
                assert!((drawn - expected).abs() < 3e-7, "{name} at {} s: {drawn} for {expected} m", frame.time);
                touched += u32::from(site.gap < 0.0);
            }
        });
        assert!(touched > 5, "{keys}: {touched}");
    }
}

#[test]
fn a_part_in_the_middle_of_its_play_touches_nothing_and_shows_no_force() {
    for text in [
        pin("ends = \"pin\""),
        pin("ends = \"bearing\", face_radius = \"13 mm\""),
        block("z = \"0.3 mm\", half_z = \"9 mm\""),
    ] {
        let scene = scene(&text);
        let mut simulation = Simulation::new(&scene.machine).expect("starts");
        let mut frame = Frame::default();
        simulation.sample_now(&mut frame);
        let list = list(&scene, &frame);
        assert!(of(&list.solid, Mesh::Sphere).is_empty() && list.arrows.is_empty());
        let label = list.labels.iter().find(|label| matches!(label.kind, LabelKind::Joint(0))).expect("its name");
        assert_eq!(*label.text, *scene.machine.loose_joints[0].name);
        if matches!(scene.machine.loose_joints[0].kind, LooseKind::Pin(_)) {
            let gaps = pin_gaps(&list, text.contains("\"pin\", ") || text.contains("ends = \"pin\""), None);
            for (gap, play) in gaps.into_iter().zip([1e-4, 1e-4, 2e-4, 2e-4]) {
                assert!((gap - MAGNIFICATION * play).abs() < 2e-7, "{gap}");
            }
        }
    }
}

#[test]
fn arrows_start_where_the_drawn_parts_touch_and_the_label_names_the_place_of_the_largest_force() {
    for text in [
        pin("ends = \"pin\""),
        pin("ends = \"bearing\", face_radius = \"13 mm\""),
        block("z = \"0.3 mm\", half_z = \"9 mm\""),
    ] {
        let mut compared = 0;
        run(&text, |scene, frame, list| {
            let joint = &scene.machine.loose_joints[0];
            let touching: Vec<_> = frame.sites.iter().enumerate().filter(|(_, site)| site.gap < 0.0).collect();
            let marks = of(&list.solid, Mesh::Sphere);
            assert_eq!(marks.len(), touching.len());
            for ((place, site), mark) in touching.iter().zip(marks) {
                let force = to_f32(&site.normal_force);
                if force.length() < 1e-3 {
                    continue;
                }
                let arrow = of(&list.arrows, Mesh::Cylinder).iter().find(|arrow| {
                    origin(arrow).distance(origin(mark)) < 1e-6
                        && linear(arrow).z_axis.normalize().dot(force.normalize()) > 0.999
                });
                assert!(arrow.is_some(), "at {} s", frame.time);
                // Where the simulation says, but for the magnified plays; it places the forces of collars in the middle of the joint.
                let is_face = joint.name == "J" && *place > 1;
                assert!(is_face || origin(mark).distance(to_f32(&site.contact_point)) < 6e-3);
                compared += 1;
            }
            let largest =
                touching.iter().max_by(|(_, a), (_, b)| a.normal_force.norm().total_cmp(&b.normal_force.norm()));
            if let Some((place, _)) = largest.filter(|(_, site)| site.normal_force.norm() > 0.0) {
                let label = list.labels.iter().find(|label| matches!(label.kind, LabelKind::Joint(0)));
                assert_eq!(*label.expect("its name").text, *joint.site_name(*place as u8));
            }
        });
        assert!(compared > 3, "{compared}");
    }
}

#[test]
fn a_past_peak_is_marked_at_the_end_that_was_hit() {
    let scene = scene(&pin("ends = \"bearing\""));
    let mut simulation = Simulation::new(&scene.machine).expect("starts");
    let mut frame = Frame::default();
    simulation.sample_now(&mut frame);
    let drawn = super::joints(&scene, &frame, MAGNIFICATION)[0];
    let axis = frame.axes_of(&scene.machine.loose_joints[0].frames[0]);
    let [x, y] = [0, 1].map(|k| super::column(&axis, k));
    // The bearing is 24 mm long, its inner radius 10 mm and 15 times 0.1 mm; the force pushes away from +y.
    for (place, along) in [(Some(0), -0.012), (Some(1), 0.012), (None, 0.0)] {
        let point = drawn.wall_point(-y * 3.0, place) - drawn.socket_centre;
        assert!(point.distance(x * along + y * 0.0115) < 1e-6, "{place:?}: {point}");
    }
    // Displaced towards -axis, the pin is pushed back by the collar in front of the bearing's end at +axis.
    let point = drawn.wall_point(x * 3.0, Some(3)) - drawn.socket_centre;
    assert!(point.distance(x * 0.012) < 1e-6, "{point}");
}

#[test]
fn cells_of_a_wear_map_are_on_the_walls_where_the_parts_touch_and_are_seen_through_them() {
    let cases = [
        (pin("ends = \"bearing\", face_radius = \"13 mm\""), 1e-4, 2, 1e-4),
        (pin("ends = \"pin\""), 1e-4, 2, 1e-4),
        (block("planar = true"), 2e-4, 4, MAGNIFICATION * 2e-4),
        (block("z = \"0.3 mm\", half_z = \"9 mm\""), 2e-4, 16, MAGNIFICATION * 3e-4),
    ];
    for (text, play, walls, slack) in cases {
        let scene = scene(&text);
        let mut simulation = Simulation::new(&scene.machine).expect("starts");
        simulation.track_wear();
        let (mut frame, mut found) = (Frame::default(), 0);
        while simulation.time() < 20e-3 {
            simulation.step().expect("runs");
            simulation.sample_now(&mut frame);
            if frame.sites.iter().all(|site| site.normal_force.norm() == 0.0)
                || !simulation.statistics().steps.is_multiple_of(10)
            {
                continue;
            }
            simulation.commit_wear();
            let wear = simulation.wear().expect("tracked");
            let list = list_with_wear(&scene, &frame, Some(wear));
            let drawn = super::joints(&scene, &frame, MAGNIFICATION);
            let cells = of(&list.wear, zones::SQUARE);
            for (place, site) in frame.sites.iter().enumerate().take(walls) {
                if site.normal_force.norm() < 1.0 {
                    continue;
                }
                // On the wall, which is behind x = 0 of one of the squares by a hundredth of the wall's distance, to the depth.
                let in_front = 0.01 * 0.0165;
                let point = drawn[0].site_point(place, site);
                let holds = |cell: &Instance| {
                    let (at, linear) = (in_mesh(cell, point), linear(cell));
                    let off = at.x.abs() * linear.x_axis.length();
                    // Tilt moves a corner along its wall by no more than the play across the others.
                    let beyond = |share: f32, edge: Vec3| (share.abs() - 0.5) * edge.length();
                    off < in_front - MAGNIFICATION * site.gap as f32 + tolerance(play)
                        && beyond(at.y, linear.y_axis).max(beyond(at.z, linear.z_axis)) < slack
                };
                assert!(cells.iter().any(holds), "{text}, place {place} at {} s", frame.time);
                found += 1;
            }
            let part = if walls == 2 { Mesh::Cylinder } else { Mesh::Cube };
            assert!(of(&list.solid, part).is_empty(), "the part that hides the wall is seen through");
        }
        assert!(found > 5, "{text}: {found}");
    }
}
