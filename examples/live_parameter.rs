//! Parameters changed while the machine runs. A larger clearance takes effect at once; a smaller one closes slowly, because a jump
//! would leave the ball inside the wall of its socket; an ideal joint changes the equations of motion, and waits for the reset.
//!
//!     cargo run --example live_parameter

use std::error::Error;

use jointplay_physics::simulate::{CLEARANCE_SPEED, Effect, Frame};
use jointplay_scene::{LiveScene, Scene};

fn main() -> Result<(), Box<dyn Error>> {
    let scene = Scene::load("pendulum", &[])?;
    let mut live = LiveScene::new(&scene)?;
    let mut frame = Frame::default();
    live.advance_to(0.2)?;

    assert_eq!(live.set("contact.clearance", "0.5 mm")?, Effect::Now);
    live.sample_now(&mut frame);
    assert_eq!(frame.joints[0].clearance, 0.5e-3);

    // Until the ball rests on the wall of the larger socket.
    live.advance_to(1.0)?;
    assert_eq!(live.set("contact.clearance", "0.1 mm")?, Effect::Now);
    let changed = live.time();
    let mut latest = 0.5e-3;
    for k in 0..=5 {
        live.advance_to(changed + 0.05 * f64::from(k))?;
        live.sample_now(&mut frame);
        let clearance = frame.joints[0].clearance;
        println!("{:5.0} ms after the change: clearance {:.3} mm", (frame.time - changed) * 1e3, clearance * 1e3);
        assert!(clearance <= latest);
        latest = clearance;
    }
    assert_eq!(latest, 0.1e-3);
    println!("it closes at {} mm/s", CLEARANCE_SPEED * 1e3);

    assert_eq!(live.set("contact.clearance", "0 mm")?, Effect::AtReset);
    let clearance = |scene: &Scene| scene.machine.loose_joints[0].contact.clearance;
    println!("runs with {} m, pending {} m", clearance(live.running()), clearance(live.pending()));
    assert_eq!((clearance(live.running()), clearance(live.pending())), (0.1e-3, 0.0));

    live.reset()?;
    live.advance_to(0.2)?;
    live.sample_now(&mut frame);
    println!("after the reset the play is {:.1e} m", frame.joints[0].eccentricity.norm());
    assert!(frame.joints[0].eccentricity.norm() < 1e-9);
    Ok(())
}
