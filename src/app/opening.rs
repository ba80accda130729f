//! Initial state of a window: time scale and plots of a scene.

use crate::analysis::drive::common_period;
use crate::scene::Scene;
use crate::session::pace::SCALE_RANGE;
use crate::simulate::Quantity;

/// Viewing time of one drive period, s, if the scene has no time scale.
const PERIOD_VIEWING_TIME: f64 = 4.0;
/// Time scale if neither the scene nor a drive defines one.
const UNDRIVEN_SCALE: f64 = 0.1;

/// Initial time scale of a window on `scene`, simulated seconds per second: the value in its file, or one at which a drive period
/// takes about four seconds.
pub fn time_scale(scene: &Scene) -> f64 {
    let period = common_period(&scene.machine).unwrap_or_else(|[first, second]| Some(first.max(second)));
    let from_period = || period.map_or(UNDRIVEN_SCALE, |period| round(period / PERIOD_VIEWING_TIME));
    scene.view.time_scale.unwrap_or_else(from_period).clamp(SCALE_RANGE.0, SCALE_RANGE.1)
}

/// Simulated time, s, after which the drives of `scene` repeat, or that is worth watching if nothing repeats.
pub fn viewing_period(scene: &Scene) -> f64 {
    let period = common_period(&scene.machine).unwrap_or_else(|[first, second]| Some(first.max(second)));
    period.unwrap_or_else(|| PERIOD_VIEWING_TIME * time_scale(scene))
}

/// The nearest of 1, 1:1.5, 1:2, 1:3, 1:4, 1:5, 1:6, 1:8, 1:10, 1:15, ….
fn round(scale: f64) -> f64 {
    let slower = 1.0 / scale.max(f64::MIN_POSITIVE);
    let decade = libm::pow(10.0, libm::log10(slower).floor());
    let distance = |k: &f64| libm::log(k * decade / slower).abs();
    let steps = [1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0];
    let nearest = steps.into_iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
    1.0 / (nearest.unwrap_or(1.0) * decade)
}

/// Initial plots of a window on `scene`, in the order of its file.
pub fn plots(scene: &Scene) -> Vec<Quantity> {
    let words = scene.view.plots;
    if words[0].is_none() {
        return vec![Quantity::NormalForce, Quantity::Eccentricity];
    }
    let of_word = |word: &str| Quantity::ALL.into_iter().find(|quantity| quantity.word() == word);
    words.into_iter().flatten().filter_map(of_word).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::drive::drive_period;
    use crate::scene::{BUILT_IN, DEFAULT_SCENE};
    use crate::simulate::Simulation;

    #[test]
    fn every_driven_built_in_machine_takes_three_to_six_seconds_per_turn() {
        for name in BUILT_IN {
            let scene = Scene::load(name, &[]).expect("built in");
            let scale = time_scale(&scene);
            match drive_period(&scene) {
                // With the paper's drive only the first 70 ms matter; the scene file sets a time scale for them.
                Ok(_) if name == "spcmm" => assert_eq!(scale, 0.02),
                Ok(period) => assert!((3.0..6.0).contains(&(period / scale)), "{name}: {period} s at {scale}"),
                Err(_) => assert!(scene.view.time_scale.is_some(), "{name}"),
            }
            let first = plots(&scene)[0];
            let is_error = matches!(first, Quantity::ProbeError | Quantity::TipError);
            assert_eq!(is_error, scene.machine.output.probe.is_some(), "{name}");
        }
    }

    #[test]
    fn every_built_in_machine_has_an_impact_within_a_second_of_viewing() {
        for name in BUILT_IN {
            let scene = Scene::load(name, &[]).expect("built in");
            let end = time_scale(&scene);
            let mut simulation = Simulation::new(&scene.machine).expect("starts");
            let mut peaks = Vec::new();
            let mut impacts = 0;
            while simulation.time() < end {
                simulation.step().expect("runs");
                simulation.take_peaks(&mut peaks);
                impacts += peaks.iter().map(|peak| peak.impacts).sum::<u32>();
            }
            assert!(impacts > 0, "{name}: nothing in {end} s");
        }
    }

    #[test]
    fn plot_words_of_scene_files_match_the_plots() {
        // Two of them as named in links made before the plots were renamed.
        let words = Quantity::ALL.map(|quantity| match quantity {
            Quantity::Penetration => "penetration".to_owned(),
            Quantity::ProbeError => "probe-error".to_owned(),
            _ => crate::app::plots::plot_of(quantity).label.to_lowercase().replace(' ', "-"),
        });
        assert_eq!(words.each_ref().map(String::as_str), Quantity::ALL.map(Quantity::word));
    }

    #[test]
    fn the_default_scene_has_impacts_in_every_period() {
        let scene = Scene::load(DEFAULT_SCENE, &[]).expect("built in");
        let period = drive_period(&scene).expect("driven");
        let mut simulation = Simulation::new(&scene.machine).expect("starts");
        let mut peaks = Vec::new();
        for turn in 1..=12 {
            let mut impacts = 0;
            while simulation.time() < f64::from(turn) * period {
                simulation.step().expect("runs");
                simulation.take_peaks(&mut peaks);
                impacts += peaks.iter().map(|peak| peak.impacts).sum::<u32>();
            }
            assert!(impacts >= 3, "turn {turn}: {impacts}");
        }
    }
}
