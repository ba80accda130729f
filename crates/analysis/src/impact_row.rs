//! An impact as a table row, with the columns of `run --impacts` and of the file that the window saves.

use jointplay_physics::simulate::Impact;

/// Names of the columns.
pub const COLUMNS: [&str; 15] = [
    "joint",
    "start_s",
    "end_s",
    "approach_m_s",
    "separation_m_s",
    "restitution_asked",
    "restitution_law",
    "restitution_given",
    "floored",
    "disturbed",
    "steps",
    "deepest_m",
    "peak_N",
    "damping_over_elastic",
    "site",
];

/// Values of `impact` in the order of [`COLUMNS`], SI units; the joint is given by its index from 0, the site by
/// that among the sites of the joint.
pub fn row(impact: &Impact) -> [f64; COLUMNS.len()] {
    let flag = |set: bool| f64::from(u8::from(set));
    [
        impact.joint as f64,
        impact.start,
        impact.end,
        impact.approach_speed,
        impact.separation_speed,
        impact.requested,
        impact.law,
        impact.achieved(),
        flag(impact.below_speed_floor),
        flag(impact.disturbed),
        impact.steps as f64,
        impact.deepest,
        impact.peak,
        impact.damping,
        f64::from(impact.place),
    ]
}
