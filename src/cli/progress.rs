//! Progress of a long command on standard error: a bar on a terminal, otherwise a line at regular intervals.

use std::io::IsTerminal;
use std::thread;
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle, WeakProgressBar};

/// Time between two lines.
const INTERVAL: Duration = Duration::from_secs(10);

/// A bar of `length`, hidden unless `is_visible`.
pub fn bar(is_visible: bool, length: u64) -> ProgressBar {
    if !is_visible {
        return ProgressBar::hidden();
    }
    if !std::io::stderr().is_terminal() {
        let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::hidden());
        let (weak_bar, start) = (bar.downgrade(), Instant::now());
        let wait = move || {
            thread::sleep(INTERVAL);
            start.elapsed()
        };
        // Without the thread the command continues silently.
        let _ = thread::Builder::new()
            .name("progress".to_owned())
            .spawn(move || report_periodically(&weak_bar, wait, super::complain));
        return bar;
    }
    let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr());
    // Without the style the bar keeps its default look.
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {percent:>3} %  {elapsed} elapsed, {eta} to go") {
        bar.set_style(style);
    }
    bar
}

/// Reports the progress of `bar` until the work is over, whenever `wait` returns; `wait` gives the time since the start.
fn report_periodically(bar: &WeakProgressBar, mut wait: impl FnMut() -> Duration, mut print: impl FnMut(&str)) {
    // Progress before the first report may be from an earlier run, so it does not count for the speed.
    let mut first = None;
    loop {
        let elapsed = wait();
        let Some(bar) = bar.upgrade().filter(|bar| !bar.is_finished()) else {
            return;
        };
        let (done, all) = (bar.position(), bar.length().unwrap_or(0).max(1));
        let mut line = format!(
            "progress: {:.1} %, {} elapsed",
            (1000.0 * done as f64 / all as f64).min(1000.0).floor() / 10.0,
            HumanDuration(elapsed)
        );
        let (since, before) = *first.get_or_insert((elapsed, done));
        if done > before {
            let rate = (done - before) as f64 / (elapsed - since).as_secs_f64();
            let left = all.saturating_sub(done) as f64 / rate;
            if let Ok(left) = Duration::try_from_secs_f64(left) {
                line.push_str(&format!(", about {} to go", HumanDuration(left)));
            }
        }
        print(&line);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_is_reported_at_each_interval_until_the_work_is_finished() {
        let bar = ProgressBar::with_draw_target(Some(1000), ProgressDrawTarget::hidden());
        let weak_bar = bar.downgrade();
        // Half of the work was done by an earlier run.
        bar.set_position(500);
        let mut unfinished = Some(bar);
        let mut now = Duration::ZERO;
        let wait = || {
            now += INTERVAL;
            match now.as_secs() {
                ..50 => unfinished.as_ref().expect("unfinished").inc(100),
                _ => unfinished = None,
            }
            now
        };
        let mut lines = Vec::new();
        report_periodically(&weak_bar, wait, |line| lines.push(line.to_owned()));
        assert_eq!(
            lines,
            [
                "progress: 60.0 %, 10 seconds elapsed",
                "progress: 70.0 %, 20 seconds elapsed, about 30 seconds to go",
                "progress: 80.0 %, 30 seconds elapsed, about 20 seconds to go",
                "progress: 90.0 %, 40 seconds elapsed, about 10 seconds to go",
            ]
        );
    }

    #[test]
    fn work_finished_before_the_first_interval_reports_nothing() {
        let bar = ProgressBar::with_draw_target(Some(10), ProgressDrawTarget::hidden());
        bar.finish_and_clear();
        report_periodically(&bar.downgrade(), || INTERVAL, |line| panic!("unexpected line: {line}"));
    }
}
