mod common;
use common::{frame_now, scene, simulation, run_until};
use jointplay::simulate::{Frame, Simulation};
use std::time::Instant;
fn forces(sim: &mut Simulation, from: f64, to: f64) -> Option<Vec<f64>> {
    let mut f = Frame::default();
    let mut sums = vec![0.0; sim.scene().ball_joints.len()];
    for n in 0..=1000 {
        let t = from + (to - from) * f64::from(n) / 1000.0;
        sim.advance_to(t).ok()?;
        sim.sample(t, &mut f);
        for (s, j) in sums.iter_mut().zip(&f.joints) { *s += (j.normal_force + j.friction_force).norm() / 1001.0; }
    }
    Some(sums)
}
#[test]
fn table() {
    let only: Option<String> = std::env::var("ONLY").ok();
    for (name, extra) in [("spcmm", None), ("pendulum", None), ("pendulum", Some(("contact.friction","10"))), ("pendulum", Some(("contact.friction","0"))), ("spcmm", Some(("contact.friction","10"))), ("chain", None), ("slider-crank", None), ("slider-crank-driven", None)] {
        if only.as_deref().is_some_and(|o| o != name) { continue; }
        let base: Vec<(&str,&str)> = extra.into_iter().collect();
        let mut exact = simulation(name, &[&base[..], &[("solver.tolerance", "1e-8")]].concat());
        run_until(&mut exact, 0.02);
        let pos = frame_now(&mut exact).pose.position;
        run_until(&mut exact, 0.3);
        let snap = exact.snapshot();
        let want = forces(&mut exact, 0.3, 0.5).unwrap();
        for step in ["1000 us", "500 us", "200 us", "100 us", "50 us", "20 us"] {
            let ch = [&base[..], &[("solver.method","imex-euler"),("solver.step",step)]].concat();
            let mut s = simulation(name, &ch);
            let st = frame_now(&mut s);
            let e0 = st.kinetic + st.potential;
            let (mut most, mut ex) = (0.0f64, st.kinetic);
            let mut end = String::from("ok");
            let mut perr = f64::NAN;
            while s.time() < 1.0 {
                if s.step().is_err() { end = format!("STOP {:.3}", s.time()); break; }
                if s.step_start() < 0.02 && s.time() >= 0.02 { let mut f = Frame::default(); s.sample(0.02, &mut f); perr = (f.pose.position - pos).norm(); }
                let f = frame_now(&mut s);
                most = most.max(f.kinetic + f.potential - e0); ex = ex.max(f.kinetic);
            }
            let l = s.ledger().map(|l| l.residual() / l.exchanged).unwrap_or(f64::NAN);
            let mut q = Simulation::new(&scene(name, &base)).unwrap();
            q.restore(&snap).unwrap();
            q.set("solver.method","imex-euler").unwrap();
            q.set("solver.step", step).unwrap();
            let got = forces(&mut q, 0.3, 0.5);
            let err = got.map_or("stop".into(), |g| format!("{:.1e}", g.iter().zip(&want).map(|(g,w)| ((g-w)/w).abs()).fold(0.0,f64::max)));
            let mut r = simulation(name, &ch);
            let t0 = Instant::now();
            while r.time() < 0.5 { if r.step().is_err() { break; } }
            let dt = t0.elapsed().as_secs_f64();
            println!("{name:20} {:24} {step:8} {end:12} gain {:8.1e} resid {:8.1e} pos@20ms {:7.1e} settled {err:8} speed {:.1} evals/step {:.2}", extra.map_or(String::new(), |e| format!("{}={}", e.0,e.1)), most/ex, l, perr, r.time()/dt, r.statistics().evaluations as f64 / r.statistics().steps as f64);
        }
    }
}
