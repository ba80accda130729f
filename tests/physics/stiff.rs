//! The linearised equations that implicit steps solve, beside central differences of the equations.

use crate::common::{parse, scene};
use jointplay_physics::contact::ContactState;
use jointplay_physics::integrate::{StiffSystem, System};
use jointplay_physics::interpolate::Interpolation;
use jointplay_physics::machine::{Characteristic, ElementKind, JointSpring, Machine, Spring};
use jointplay_physics::mechanism::{ActiveSet, Mechanism};

/// Asserts that the solutions x of (s I - J) x = b, for each unit rate b, satisfy s x - J x = b with central differences of the
/// equations along x for J x. The linearisation leaves out terms that are not stiff, of `left_out`, 1/s. `most` are the largest changes of positions and rates, SI.
fn check_solutions(
    case: &str,
    m: &mut Mechanism,
    active_set: ActiveSet<'_>,
    (t, y): (f64, &[f64]),
    (s, left_out): (f64, f64),
    most: [f64; 2],
) {
    let nq = m.positions();
    let (mut plus, mut minus) = (vec![0.0; y.len()], vec![0.0; y.len()]);
    // A change of a deflection alone meets the velocities in the next iteration.
    for l in nq..y.len() - m.contacts.bristles() {
        let mut equations = m.evaluator(active_set);
        equations.linearise(t, y, s);
        equations.factor_shifted(s);
        let mut x = vec![0.0; y.len()];
        x[l] = 1.0;
        equations.solve_shifted(&mut x);
        let largest = |x: &[f64]| x.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let width = (most[0] / largest(&x[..nq])).min(most[1] / largest(&x[nq..]));
        for (sign, rates) in [(width, &mut plus), (-width, &mut minus)] {
            let z: Vec<f64> = y.iter().zip(&x).map(|(y, x)| y + sign * x).collect();
            equations.derivative(t, &z, rates);
        }
        let pushed = |k: usize| s * x[k] - f64::from(u8::from(k == l));
        let scale = (nq..y.len()).map(|k| pushed(k).abs()).fold(0.0, f64::max);
        for k in nq..y.len() {
            let difference = (plus[k] - minus[k]) / (2.0 * width);
            let limit = (1e-3 + left_out / s) * scale.max(1.0);
            let solved = pushed(k);
            assert!((difference - solved).abs() < limit, "{case}, {l}, {k}: {solved:e} {difference:e} of {scale:e}");
        }
    }
}

/// The default scene with its platform lowered until every ball rests 0.2 um deep in its wall and creeps along it.
/// `approach_speed` is the approach speed of each contact state, m/s.
fn resting(changes: &[(&str, &str)], approach_speed: f64) -> (Mechanism, Vec<f64>, [ContactState; 3]) {
    let scene = scene("spcmm", changes);
    let mut mechanism = Mechanism::new(&scene.machine).unwrap();
    let mut y = mechanism.start().unwrap();
    y[0] += 0.3e-3 + 2e-7;
    let v = mechanism.positions();
    // Initially every ball moves with its socket.
    for (i, slip) in [2e-7, 3e-5, -4e-5].iter().enumerate() {
        y[v + i] += slip;
    }
    let contact_state =
        ContactState { active: true, approach_speed, below_speed_floor: true, ..ContactState::default() };
    (mechanism, y, [contact_state; 3])
}

#[test]
fn implicit_steps_of_contacts_agree_with_central_differences() {
    // In the last case the rate is the largest so far, so that the damping term does not depend on it.
    for (surface, approach, approach_speed) in [
        ("centres", "start", 1e-3),
        ("surface", "start", 1e-3),
        ("surface", "largest", 1e-3),
        ("surface", "largest", 1e-9),
    ] {
        let changes = [("contact.friction_velocity", surface), ("contact.approach_speed", approach)];
        let (mut m, y, contact_state) = resting(&changes, approach_speed);
        m.measure(0.0, &y);
        let rises = m.contacts.gaps().all(|gap| gap.separation.rate > approach_speed);
        assert_eq!(rises, approach_speed < 1e-6);
        for s in [1e3, 1e4, 1e5] {
            let case = format!("{surface} {approach} {approach_speed}, s = {s}");
            check_solutions(&case, &mut m, ActiveSet::Located(&contact_state), (0.0, &y), (s, 30.0), [1e-10, 1e-8]);
        }
    }
}

#[test]
fn implicit_steps_of_bristles_agree_with_central_differences_whether_they_stick_or_slide() {
    for surface in ["centres", "surface"] {
        // Bent to nine tenths of the limit they stick, slide slowly, and fast, where they follow the velocities.
        for damping in ["2000 N s/m", "50000 N s/m", "200000 N s/m", "1e6 N s/m"] {
            let changes = [
                ("contact.friction_velocity", surface),
                ("contact.friction_law", "bristle"),
                ("contact.bristle_damping", damping),
            ];
            let (mut m, mut y, contact_state) = resting(&changes, 1e-3);
            let active_set = ActiveSet::Located(&contact_state);
            let mut rates = vec![0.0; y.len()];
            m.evaluator(active_set).derivative(0.0, &y, &mut rates);
            let forces: Vec<f64> = m.contacts.gaps().map(|gap| gap.normal_force).collect();
            let first = y.len() - 9;
            for (c, force) in forces.into_iter().enumerate() {
                assert!(force > 0.1);
                // The normals lie along x.
                let length = 0.9 * 0.15 * force / 1e8;
                y[first + 3 * c + 1] = 0.6 * length;
                y[first + 3 * c + 2] = -0.8 * length;
            }
            for s in [1e3, 1e4, 1e5, 1e6] {
                let case = format!("{surface} {damping}, s = {s}");
                check_solutions(&case, &mut m, active_set, (0.0, &y), (s, 100.0), [1e-11, 1e-9]);
            }
        }
    }
}

#[test]
fn implicit_steps_of_a_film_agree_with_central_differences_where_its_stations_differ() {
    let film = "[[body]]\nname = \"cap\"\nmass = \"1 kg\"\ninertia = \"2e-2 3e-2 4e-2 kg m^2\"\n\
        [[joint]]\nname = \"J\"\nkind = \"revolute\"\nparent = \"base\"\nchild = \"cap\"\naxis = [1, 2, 0]\n\
        child_point = \"9 0 0 mm\"\nstart = { velocity = \"SPIN rad/s\", offset = \"0 0 -0.05 mm\", tilt = \"0.3 -0.15 0 deg\" }\n\
        play = { radial = \"0.1 mm\", axial = \"0.1 mm\", radius = \"10 mm\", length = \"20 mm\" }\n\
        [[lubricant]]\nname = \"oil\"\njoint = \"J\"\nviscosity = \"1 Pa s\"\n";
    for spin in ["0.1", "3"] {
        let machine = parse(&serial_chain(&film.replace("SPIN", spin)), &[]).machine;
        let mut m = Mechanism::new(&machine).unwrap();
        let y = m.start().unwrap();
        for s in [1e3, 1e4, 1e5] {
            let case = format!("{spin} rad/s, s = {s}");
            check_solutions(&case, &mut m, ActiveSet::Nothing, (0.1, &y), (s, 30.0), [1e-9, 1e-7]);
        }
    }
}

/// A serial chain from a free body, with a hinge, a slide, a fixed joint, and a hinge on a driven slide; moving, and loaded
/// by `elements`.
pub fn serial_chain(elements: &str) -> String {
    let body =
        |name: &str| format!("[[body]]\nname = \"{name}\"\nmass = \"1 kg\"\ninertia = \"2e-2 3e-2 4e-2 kg m^2\"\n");
    let joint = |kind: &str, parent: &str, child: &str, more: &str| {
        format!(
            "[[joint]]\nname = \"{child}\"\nkind = \"{kind}\"\nparent = \"{parent}\"\nchild = \"{child}\"\n{more}\n"
        )
    };
    let at = "parent_point = \"100 20 -30 mm\"\nchild_point = \"-80 10 20 mm\"\n\
              rotation = { axis = [1, 2, 3], angle = \"40 deg\" }";
    let slow = "start = { position = \"0.3 mm\", velocity = \"0.2 mm/s\" }";
    let turns = "start = { position = \"0.3 mrad\", velocity = \"1 mrad/s\" }";
    let bodies = ["base", "arm", "rod", "table", "wheel"].map(body).concat();
    let free = "start = { position = \"0 0 1 m\", rotation = { axis = [3, 1, 2], angle = \"50 deg\" } }";
    let driven = "axis = [0, 1, 0]\ndrive = { law = \"harmonic\", amplitude = \"1 mm\", frequency = \"1 Hz\" }";
    bodies
        + &joint("free", "world", "base", free)
        + &joint("revolute", "base", "arm", &format!("axis = [1, 0, 2]\n{at}\n{turns}"))
        + &joint("prismatic", "arm", "rod", &format!("axis = [0, 1, 1]\n{at}\n{slow}"))
        + &joint("prismatic", "world", "table", driven)
        + &joint("revolute", "table", "wheel", &format!("axis = [0, 1, 2]\n{at}\n{turns}"))
        + elements
}

#[test]
fn implicit_steps_of_elements_agree_with_central_differences_in_both_formulations() {
    let cases = ELEMENT_CASES.into_iter().flat_map(|case| [(case, false), (case, true)]);
    for ((name, elements), curves) in cases {
        for formulation in ["tree", "lagrange"] {
            let mut machine = Machine::clone(&parse(&serial_chain(elements), &[("formulation", formulation)]).machine);
            if curves {
                machine.elements.iter_mut().for_each(|element| bend_damping(&mut element.kind));
            }
            let mut m = Mechanism::new(&machine).unwrap();
            let y = m.start().unwrap();
            for s in [1e3, 1e4, 1e5] {
                let case = format!("{name} {formulation}, s = {s}");
                check_solutions(&case, &mut m, ActiveSet::Nothing, (0.1, &y), (s, 30.0), [1e-6, 1e-6]);
            }
        }
    }
}

/// Replaces the damper of a spring by one that is harder at low rates.
fn bend_damping(kind: &mut ElementKind) {
    if let ElementKind::Spring(Spring { damping, .. }) | ElementKind::JointSpring(JointSpring { damping, .. }) = kind
        && let Characteristic::Line { slope, .. } = *damping
    {
        let points =
            [-1.0, -2e-3, 2e-3, 1.0].map(|rate: f64| [rate, slope * (0.3 * rate + 0.7 * rate.clamp(-2e-3, 2e-3))]);
        *damping = Characteristic::Curve { points: points.to_vec(), interpolation: Interpolation::Spline };
    }
}

pub const ELEMENT_CASES: [(&str, &str); 8] = [
    (
        "coordinates of two degrees",
        "[[body]]\nname = \"ring\"\nmass = \"1 kg\"\ninertia = \"2e-2 3e-2 4e-2 kg m^2\"\n\
         [[body]]\nname = \"cross\"\nmass = \"1 kg\"\ninertia = \"3e-2 3e-2 4e-2 kg m^2\"\n\
         [[joint]]\nname = \"ring\"\nkind = \"cylindrical\"\nparent = \"arm\"\nchild = \"ring\"\naxis = [2, 1, 0]\n\
         parent_point = \"0 50 20 mm\"\nchild_point = \"10 -40 0 mm\"\nrotation = { axis = [1, 2, 0], angle = \"25 deg\" }\n\
         start = { position = \"0.2 mm\", velocity = \"0.3 mm/s\", angle = \"0.2 mrad\", angular_velocity = \"1 mrad/s\" }\n\
         [[joint]]\nname = \"cross\"\nkind = \"universal\"\nparent = \"wheel\"\nchild = \"cross\"\naxis = [1, 2, 0]\n\
         child_axis = [0, 0, 1]\nparent_point = \"20 0 10 mm\"\nchild_point = \"0 30 20 mm\"\n\
         start = { angle = \"0.3 mrad\", angular_velocity = \"1 mrad/s\", child_angle = \"-0.2 mrad\", child_angular_velocity = \"2 mrad/s\" }\n\
         [[joint_spring]]\nname = \"t\"\njoint = \"ring\"\ncoordinate = \"position\"\nstiffness = \"900 N/mm\"\ndamping = \"7 kN s/m\"\n\
         [[joint_spring]]\nname = \"u\"\njoint = \"ring\"\ncoordinate = \"angle\"\nstiffness = \"20 kN m/rad\"\ndamping = \"200 N m s/rad\"\n\
         [[joint_spring]]\nname = \"v\"\njoint = \"cross\"\ncoordinate = \"angle\"\nstiffness = \"20 kN m/rad\"\ndamping = \"200 N m s/rad\"\n\
         [[motor]]\nname = \"w\"\njoint = \"cross\"\ncoordinate = \"child_angle\"\nstiffness = \"20 kN m/rad\"\ndamping = \"200 N m s/rad\"\n\
         target = { law = \"harmonic\", amplitude = \"0.5 mrad\", frequency = \"1 Hz\" }\n",
    ),
    (
        // Near the lengths of small tension: rotation of large forces with the bodies is left out.
        "curves",
        "[[spring]]\nname = \"s\"\nfrom = { body = \"world\", at = \"-50 90 20 mm\" }\nto = { body = \"rod\" }\nlength = \"1009.2 mm\"\n\
         characteristic = [[\"-0.2 mm\", \"-150 N\"], [0, \"-40 N\"], [\"0.1 mm\", \"60 N\"], [\"0.4 mm\", \"500 N\"]]\n\
         damping = \"7 kN s/m\"\n\
         [[joint_spring]]\nname = \"t\"\njoint = \"arm\"\ndamping = \"200 N m s/rad\"\n\
         characteristic = [[\"-1 mrad\", \"-20 N m\"], [0, \"1 N m\"], [\"0.5 mrad\", \"9 N m\"], [\"2 mrad\", \"70 N m\"]]\n\
         [[joint_spring]]\nname = \"u\"\njoint = \"rod\"\n\
         characteristic = [[\"0.1 mm\", \"-2 N\"], [\"0.2 mm\", \"10 N\"], [\"0.5 mm\", \"300 N\"]]\n",
    ),
    (
        "tyres",
        "[[tyre]]\nname = \"t\"\non = { body = \"rod\", at = \"30 -20 50 mm\" }\nradius = \"43.723 mm\"\nup = [1, 2, 3]\n\
         stiffness = \"900 N/mm\"\ndamping = \"30 kN s/m\"\n\
         ground = { law = \"harmonic\", mean = \"1 m\", amplitude = \"0.05 mm\", frequency = \"1 Hz\" }\n\
         [[tyre]]\nname = \"w\"\non = { body = \"wheel\" }\nradius = \"1 mm\"\nup = [0, 1, 1]\n\
         stiffness = \"900 N/mm\"\ndamping = \"30 kN s/m\"\n\
         ground = { law = \"constant\", position = \"-12.817 mm\", velocity = \"0.5 mm/s\" }\n",
    ),
    (
        "joint springs",
        "[[joint_spring]]\nname = \"t\"\njoint = \"arm\"\nstiffness = \"20 kN m/rad\"\ndamping = \"200 N m s/rad\"\n\
         [[joint_spring]]\nname = \"u\"\njoint = \"rod\"\nstiffness = \"900 N/mm\"\ndamping = \"7 kN s/m\"\n\
         [[joint_spring]]\nname = \"v\"\njoint = \"table\"\nstiffness = \"900 N/mm\"\ndamping = \"7 kN s/m\"\n\
         [[joint_spring]]\nname = \"w\"\njoint = \"wheel\"\nstiffness = \"20 kN m/rad\"\ndamping = \"200 N m s/rad\"\n",
    ),
    (
        "stops",
        "[[stop]]\nname = \"t\"\njoint = \"arm\"\nupper = 0\ntorque = \"6 N m\"\ndepth = \"0.3 mrad\"\nrestitution = 0.5\nspeed = \"10 mrad/s\"\n\
         [[stop]]\nname = \"u\"\njoint = \"rod\"\nlower = \"0.6 mm\"\nforce = \"300 N\"\ndepth = \"0.3 mm\"\nrestitution = 0.5\nspeed = \"10 mm/s\"\n\
         [[stop]]\nname = \"w\"\njoint = \"wheel\"\nlower = \"0.5 mrad\"\nupper = \"0.7 mrad\"\ntorque = \"4 N m\"\ndepth = \"0.3 mrad\"\n\
         restitution = 0.5\nspeed = \"10 mrad/s\"\n",
    ),
    (
        "bushings",
        "[[bushing]]\nname = \"t\"\nfrom = { body = \"base\", at = \"100 20 -30 mm\" }\nto = { body = \"arm\", at = \"-80 10 20 mm\" }\n\
         rotation = { axis = [1, 2, 3], angle = \"40 deg\" }\naxes = { axis = [0, 2, 1], angle = \"20 deg\" }\n\
         stiffness = \"900 500 300 N/mm\"\ndamping = \"7 5 9 kN s/m\"\n\
         turning_stiffness = \"20 30 40 kN m/rad\"\nturning_damping = \"200 300 100 N m s/rad\"\n\
         [[bushing]]\nname = \"u\"\nfrom = { body = \"table\", at = \"0 0 1000 mm\" }\nto = { body = \"base\" }\n\
         rotation = { axis = [3, 1, 2], angle = \"50 deg\" }\naxes = { axis = [1, 2, 1], angle = \"70 deg\" }\n\
         stiffness = \"900 500 300 N/mm\"\ndamping = \"7 5 9 kN s/m\"\n\
         turning_stiffness = \"20 30 40 kN m/rad\"\nturning_damping = \"200 300 100 N m s/rad\"\n\
         [[bushing]]\nname = \"w\"\nfrom = { body = \"wheel\", at = \"-80 10 20 mm\" }\nto = { body = \"table\", at = \"100 20 -30 mm\" }\n\
         rotation = { axis = [1, 2, 3], angle = \"-40 deg\" }\n\
         stiffness = \"900 500 300 N/mm\"\nturning_stiffness = \"20 30 40 kN m/rad\"\n",
    ),
    (
        // Far from the middle and near the wall; of a pin that turns and tilts too.
        "films",
        "[contact]\nclearance = \"0.1 mm\"\n\
         [[body]]\nname = \"bob\"\nmass = \"1 kg\"\ninertia = \"2e-2 3e-2 4e-2 kg m^2\"\n\
         [[joint]]\nname = \"bob\"\nkind = \"free\"\nchild = \"bob\"\n\
         start = { position = \"20.05 30.03 0.06 mm\", velocity = \"3 5 9 mm/s\", angular_velocity = \"2 -3 5 rad/s\" }\n\
         [[ball_joint]]\nname = \"S\"\nsocket = { body = \"world\", at = \"20 30 0 mm\" }\nball = { body = \"bob\" }\n\
         [[lubricant]]\nname = \"t\"\njoint = \"S\"\nviscosity = \"100 mPa s\"\n\
         [[body]]\nname = \"pin\"\nmass = \"1 kg\"\ninertia = \"2e-2 3e-2 4e-2 kg m^2\"\n\
         [[joint]]\nname = \"P\"\nkind = \"revolute\"\nparent = \"rod\"\nchild = \"pin\"\naxis = [1, 2, 3]\n\
         play = { radial = \"0.1 mm\", length = \"24 mm\", radius = \"10 mm\" }\n\
         start = { velocity = \"3 rad/s\", offset = \"0.04 0.03 0.02 mm\", offset_velocity = \"2 3 5 mm/s\", tilt_velocity = \"0.1 0.2 0.3 rad/s\" }\n\
         [[lubricant]]\nname = \"u\"\njoint = \"P\"\nviscosity = \"100 mPa s\"\n",
    ),
    (
        "motors",
        "[[motor]]\nname = \"t\"\njoint = \"arm\"\nstiffness = \"20 kN m/rad\"\ndamping = \"200 N m s/rad\"\n\
         target = { law = \"harmonic\", amplitude = \"0.5 mrad\", frequency = \"1 Hz\" }\n\
         [[motor]]\nname = \"u\"\njoint = \"rod\"\nstiffness = \"900 N/mm\"\ndamping = \"7 kN s/m\"\nlimit = \"5 kN\"\n\
         target = { law = \"constant\", position = \"0.25 mm\", velocity = \"0.5 mm/s\" }\n\
         [[motor]]\nname = \"w\"\njoint = \"wheel\"\nstiffness = \"20 kN m/rad\"\ntorque = \"3 N m\"\n\
         target = { law = \"harmonic\", mean = \"0.1 mrad\", amplitude = \"0.5 mrad\", frequency = \"1 Hz\" }\n",
    ),
];
