//! Channels of a scene: their names, columns and order.

use std::collections::BTreeSet;

use crate::common::parse;
use jointplay_physics::machine::Machine;
use jointplay_physics::simulate::{ChannelInfo, Frame, Simulation, channels_of, chosen_channels};
use jointplay_scene::{Scene, built_in_text};

fn scene(changes: &str) -> Scene {
    parse(&format!("{}\n{changes}", built_in_text("slider-crank-driven").expect("built in")), &[])
}

const SPRING: &str = "[[spring]]\nname = \"s\"\nfrom = { body = \"rod\" }\nto = { body = \"world\", at = \"1 0 0 m\" }\n\
                      length = \"1 m\"\nstiffness = \"1 N/m\"\n";

fn first(machine: &Machine) -> Frame {
    let mut frame = Frame { reactions: Some(Vec::new()), ..Frame::default() };
    Simulation::new(machine).expect("starts").sample(0.0, &mut frame);
    frame
}

/// The channels of `machine` that a run with these patterns writes; `first` is its frame at the start.
fn chosen(machine: &Machine, first: &Frame, patterns: &[&str]) -> Result<Vec<ChannelInfo>, String> {
    let patterns: Vec<String> = patterns.iter().map(|&pattern| pattern.to_owned()).collect();
    chosen_channels(channels_of(machine, first), &patterns).map_err(|error| error.to_string())
}

fn columns(channels: &[ChannelInfo]) -> String {
    channels.iter().map(|channel| &*channel.column).collect::<Vec<_>>().join(",")
}

fn assert_known(channels: &[ChannelInfo], first: &Frame) {
    for channel in channels {
        assert!(channel.reading().read(first).is_some_and(f64::is_finite), "{channel:?}");
    }
}

#[test]
fn a_part_named_like_an_angle_of_the_output_body_keeps_its_channels() {
    let text = "[[body]]\nname = \"arm\"\nmass = \"1 kg\"\ninertia = \"1 1 1 kg m^2\"\n\
                [[joint]]\nname = \"alpha\"\nkind = \"revolute\"\nchild = \"arm\"\naxis = [0, 1, 0]\n";
    let machine = parse(text, &[]).machine;
    let chosen = chosen(&machine, &first(&machine), &["alpha.rate"]).expect("has one");
    assert_eq!(columns(&chosen), "t_s,part_alpha_rate_rad_s");
}

#[test]
fn channels_begin_with_the_default_columns_and_have_distinct_names() {
    for text in ["", SPRING] {
        let scene = scene(text);
        let first = first(&scene.machine);
        let list = channels_of(&scene.machine, &first);
        let by_default: Vec<ChannelInfo> = list.iter().filter(|channel| channel.by_default).cloned().collect();
        assert_eq!(columns(&chosen(&scene.machine, &first, &[]).expect("no pattern fails")), columns(&by_default));
        assert!(list[..by_default.len()].iter().all(|channel| channel.by_default));
        let names: BTreeSet<&str> = list.iter().map(|channel| &channel.name[..]).collect();
        assert_eq!(names.len(), list.len());
        for channel in &list {
            assert_eq!(channel.unit.is_empty(), channel.name.ends_with(".state"));
            assert!(!channel.help.is_empty(), "{channel:?}");
        }
        assert_known(&list, &first);
        assert_eq!(chosen(&scene.machine, &first, &["*"]).expect("matches").len(), list.len());
    }
}

#[test]
fn channels_chosen_by_name_are_in_the_order_of_the_scene() {
    let scene = scene(SPRING);
    let first = first(&scene.machine);
    let columns = |patterns: &[&str]| chosen(&scene.machine, &first, patterns).map(|found| columns(&found));
    for (patterns, found) in [
        (&["B.force", "time"][..], "t_s,B_force_x_N,B_force_y_N,B_force_z_N"),
        (&["crank.angle", "B.force.z"], "t_s,B_force_z_N,crank_angle_rad"),
        (&["crank.rate", "slider.rate"], "t_s,crank_rate_rad_s,slider_rate_m_s"),
        (&["s.length", "*.actuator"], "t_s,crank_actuator_Nm,s_length_m"),
        (&["energy.k*"], "t_s,kinetic_J,kinetic_change_J"),
        (&["rod_?_m"], "t_s,rod_x_m,rod_y_m,rod_z_m"),
        (&["rod.pose"], "t_s,rod_x_m,rod_y_m,rod_z_m,rod_alpha_rad,rod_beta_rad,rod_gamma_rad"),
    ] {
        assert_eq!(columns(patterns).expect("matches"), found, "{patterns:?}");
    }
    let output = &scene.machine.bodies[scene.machine.output.body].name;
    let pose = columns(&[&format!("{output}.pose")]).expect("matches");
    assert_eq!(pose, "t_s,x_m,y_m,z_m,alpha_rad,beta_rad,gamma_rad");
    let wrong = columns(&["B.force", "B.froce"]).expect_err("no such channel");
    assert_eq!(wrong, "`B.froce` is none of the scene's channels (did you mean `B.force`?)");
}

#[test]
fn columns_at_the_end_of_a_row_keep_their_positions() {
    let load = "[[load]]\nname = \"wind\"\non = { body = \"rod\" }\nforce = \"1 0 0 N\"\n";
    let scene = scene(load);
    let first = first(&scene.machine);
    let channels = chosen(&scene.machine, &first, &[]).expect("no pattern fails");
    let last = "drive_work_J,gravity_work_J,restitution_loss_J,friction_loss_J,clearance_work_J,energy_residual_J,\
                wind_force_x_N,wind_force_y_N,wind_force_z_N,wind_torque_x_Nm,wind_torque_y_Nm,wind_torque_z_Nm,\
                damping_loss_J,external_work_J";
    assert!(columns(&channels).ends_with(last), "{channels:?}");
    assert_known(&channels, &first);
}
