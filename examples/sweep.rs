//! A bifurcation table: the driven slider-crank with little friction, for three clearances. Once per turn of the crank the slider's
//! position is recorded (a Poincaré section): the less regular the motion, the wider these positions spread, and the faster
//! neighbouring motions diverge (largest Lyapunov exponent). A study needs more values and at least forty periods of each.
//!
//!     cargo run --example sweep

use std::error::Error;

use jointplay_analysis::axis::Axis;
use jointplay_analysis::design::{Design, Start};
use jointplay_analysis::drive::OBSERVABLES;
use jointplay_analysis::point::Plan;
use jointplay_analysis::sweep::Sweep;
use jointplay_scene::Scene;

fn main() -> Result<(), Box<dyn Error>> {
    let mut scene = Scene::load("slider-crank-driven", &[])?;
    scene.set("contact.friction", "0.004")?;
    let clearance = Axis::parse(&scene, "contact.clearance=0.1mm..0.9mm:3")?;
    let design = Design::crossed(&scene, vec![clearance], &[Start::Cold])?;
    let plan = Plan { periods: 10, discard: 2, phase: 0.0, exponent: true };
    let sweep = Sweep::new(scene, design, plan)?;

    println!("{:26} {:>16} {:>10} {:>12} {:>8}", "", "exponent", "regime", "spread of x", "peak");
    let mut rows = Vec::new();
    // Blocks are independent, so a larger sweep distributes them over its threads.
    for block in 0..sweep.design().blocks() {
        let mut run = sweep.begin(block);
        while !run.is_done() {
            run.advance(10_000);
        }
        for (point, result) in run.finished() {
            let result = result.as_ref().ok_or("the point did not start")?;
            let exponent = result.evidence.exponent.as_ref().ok_or("the point has no exponent")?;
            let positions = result.sections.chunks(OBSERVABLES.len()).map(|section| section[0]);
            let (low, high) = positions.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            println!(
                "{:26} {:5.2} ± {:4.2} 1/s {:>10} {:9.1} µm {:6.0} N",
                sweep.describe(*point),
                exponent.value,
                exponent.standard_error,
                result.regime.word(),
                (high - low) * 1e6,
                result.joints[1].peak_kept,
            );
            rows.push((exponent.value, high - low));
        }
    }

    // More play, less order.
    assert_eq!(rows.len(), 3);
    assert!(rows.windows(2).all(|pair| pair[1].0 > pair[0].0 && pair[1].1 > pair[0].1));
    Ok(())
}
