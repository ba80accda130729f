//! The figures of the paper, and those beyond it, as sheets.

use crate::analysis::paper::chaos::{Loop, Swept};
use crate::analysis::paper::{BY_CLEARANCE, BY_FRICTION, CASES, Case};
use crate::analysis::reproduction::{Findings, Row, SweepData, Traced, Variant, regime_word};
use crate::chart::{Axis, Chart, Colour, Level, Map, Marker, PALETTE, Scale, Series, Sheet};

/// Width of a sheet, height of a row of charts, pixels.
const WIDTH: u32 = 1120;
const ROW: u32 = 290;
/// The first part of a run, in which the balls bounce, s.
const EARLY: f64 = 0.15;

/// Name and unit of a column of a [`Row`], and SI units in one of it.
#[derive(Clone, Copy)]
struct Shown(usize, &'static str, &'static str, f64);

const X: Shown = Shown(1, "x", "mm", 1e-3);
const RATE_X: Shown = Shown(2, "Velocity in x", "m/s", 1.0);
const ACCELERATION_X: Shown = Shown(3, "Acceleration in x", "m/s²", 1.0);
const BETA: Shown = Shown(4, "β", "mrad", 1e-3);
const RATE_BETA: Shown = Shown(5, "Rate of β", "rad/s", 1.0);
const ACCELERATION_BETA: Shown = Shown(6, "Acceleration of β", "rad/s²", 1.0);
const DEVIATION_X: Shown = Shown(10, "x less ideal", "mm", 1e-3);
const DEVIATION_BETA: Shown = Shown(11, "β less ideal", "mrad", 1e-3);
const PROBE: Shown = Shown(12, "Probe error", "µm", 1e-6);
const FORCE: Shown = Shown(7, "Contact force", "N", 1.0);

/// Every figure by name, in the order of the page.
pub(super) fn all(found: &Findings) -> Vec<(String, Sheet)> {
    let mut out: Vec<(&str, Sheet)> = Vec::new();
    let kinds = [
        ["figure-05", "figure-06", "figure-07"],
        ["figure-11", "figure-12", "figure-13"],
    ];
    let forces = [
        [
            ("figure-08", BY_CLEARANCE[0]),
            ("figure-09", BY_CLEARANCE[1]),
            ("figure-10", BY_CLEARANCE[2]),
        ],
        [
            ("figure-14", BY_FRICTION[0]),
            ("figure-15", BY_FRICTION[1]),
            ("figure-16", BY_FRICTION[2]),
        ],
    ];
    for (which, cases) in [BY_CLEARANCE, BY_FRICTION].into_iter().enumerate() {
        let runs: Vec<(String, &Traced)> = cases
            .iter()
            .filter_map(|&case| Some((case_name(case, which), found.run(case)?)))
            .collect();
        let [displacement, velocity, acceleration] = kinds[which];
        out.push((
            displacement,
            early_and_whole(&runs, [X, BETA], [DEVIATION_X, DEVIATION_BETA]),
        ));
        out.push((
            velocity,
            early_and_whole(&runs, [RATE_X, RATE_BETA], [RATE_X, RATE_BETA]),
        ));
        let accelerations = [ACCELERATION_X, ACCELERATION_BETA];
        out.push((
            acceleration,
            early_and_whole(&runs, accelerations, accelerations),
        ));
        for (name, case) in forces[which] {
            out.extend(found.run(case).map(|run| (name, contact_forces(run))));
        }
    }
    out.push(("figure-17", verification(found)));
    out.push(("figure-17-drift", drift(found)));
    for (which, cases, names) in [
        (
            0,
            BY_CLEARANCE,
            ["figure-18", "figure-19", "figure-20", "exponent-clearance"],
        ),
        (
            1,
            BY_FRICTION,
            ["figure-21", "figure-22", "figure-23", "exponent-friction"],
        ),
    ] {
        let [portrait, section, bifurcated, exponents] = names;
        out.push((portrait, portraits(found, cases, which)));
        out.push((section, sections(found, which)));
        out.push((bifurcated, bifurcation(found, which)));
        out.push((exponents, exponent(found, which)));
    }
    out.push(("map", map(found)));
    out.push(("probe", probe(found)));
    out.into_iter()
        .map(|(name, sheet)| (picture_name(found.variant, name), sheet))
        .collect()
}

/// Name of the picture of a figure in files and on the page.
pub(super) fn picture_name(variant: Variant, name: &str) -> String {
    format!("{}{name}", variant.prefix.replace('_', "-"))
}

/// What tells a run of a series from the others.
fn case_name(case: Case, which: usize) -> String {
    if which == 0 {
        format!("{} mm", case.clearance)
    } else {
        format!("friction {}", case.friction)
    }
}

fn axis(label: &str, unit: &str) -> Axis {
    Axis {
        label: label.to_owned(),
        unit: unit.to_owned(),
        ..Axis::default()
    }
}

fn time(to: f64) -> Axis {
    Axis {
        range: Some((0.0, to)),
        ..axis("Time", "s")
    }
}

fn line(label: &str, points: Vec<(f64, f64)>, colour: Colour) -> Series {
    Series {
        label: label.to_owned(),
        points,
        colour,
        line: true,
        marker: None,
    }
}

fn dots(label: &str, points: Vec<(f64, f64)>, colour: Colour, marker: Marker) -> Series {
    Series {
        line: false,
        marker: Some(marker),
        ..line(label, points, colour)
    }
}

fn sheet(charts: Vec<Chart>, columns: usize) -> Sheet {
    let rows = charts.len().div_ceil(columns) as u32;
    Sheet {
        title: String::new(),
        charts,
        columns,
        size: (WIDTH, ROW * rows + 34),
        note: String::new(),
    }
}

fn picked(rows: &[Row], shown: Shown, to: f64) -> Vec<(f64, f64)> {
    let early = rows.iter().take_while(|row| row[0] <= to);
    early.map(|row| (row[0], row[shown.0] / shown.3)).collect()
}

fn over_time(runs: &[(String, &Traced)], shown: Shown, to: f64, title: &str) -> Chart {
    let series = runs
        .iter()
        .enumerate()
        .map(|(n, (name, run))| line(name, picked(&run.rows, shown, to), PALETTE[n + 1]));
    Chart {
        title: title.to_owned(),
        x: time(to),
        y: axis(shown.1, shown.2),
        series: series.collect(),
        ..Chart::default()
    }
}

/// The whole run above, its beginning below.
fn early_and_whole(runs: &[(String, &Traced)], whole: [Shown; 2], early: [Shown; 2]) -> Sheet {
    let mut charts: Vec<Chart> = whole
        .iter()
        .map(|&s| over_time(runs, s, 2.0, "One period"))
        .collect();
    charts.extend(
        early
            .iter()
            .map(|&s| over_time(runs, s, EARLY, "While the balls bounce")),
    );
    sheet(charts, 2)
}

fn contact_forces(run: &Traced) -> Sheet {
    let chart = |to: f64, title: &str| Chart {
        title: title.to_owned(),
        x: time(to),
        y: axis(FORCE.1, FORCE.2),
        series: (0..3)
            .map(|j| {
                let shown = Shown(FORCE.0 + j, FORCE.1, FORCE.2, FORCE.3);
                line(
                    &format!("S{}", j + 1),
                    picked(&run.rows, shown, to),
                    PALETTE[j + 1],
                )
            })
            .collect(),
        ..Chart::default()
    };
    sheet(
        vec![
            chart(2.0, "One period"),
            chart(EARLY, "While the balls bounce"),
        ],
        2,
    )
}

fn verification(found: &Findings) -> Sheet {
    let runs = [
        ("ideal joints".to_owned(), &found.ideal),
        ("tree formulation".to_owned(), &found.runs[0]),
        ("lagrange formulation".to_owned(), &found.lagrange),
    ];
    let all = [
        X,
        BETA,
        RATE_X,
        RATE_BETA,
        ACCELERATION_X,
        ACCELERATION_BETA,
    ];
    let charts = all.iter().map(|&shown| {
        let mut chart = over_time(&runs, shown, 0.1, "");
        // The ideal motion is what all others are compared with.
        for (n, series) in chart.series.iter_mut().enumerate() {
            series.colour = PALETTE[n];
        }
        chart
    });
    sheet(charts.collect(), 2)
}

fn drift(found: &Findings) -> Sheet {
    let samples = |run: &'_ Traced| -> Vec<Row> {
        run.rows
            .iter()
            .filter(|row| row[14] == 1.0)
            .copied()
            .collect()
    };
    let (tree, lagrange) = (samples(&found.runs[0]), samples(&found.lagrange));
    let apart = |column: usize| -> Vec<(f64, f64)> {
        let pairs = tree.iter().zip(&lagrange);
        pairs
            .map(|(a, b)| (a[0], (a[column] - b[column]).abs() * 1e6))
            .collect()
    };
    let logarithmic = |label: &str, unit: &str| Axis {
        scale: Scale::Logarithmic,
        ..axis(label, unit)
    };
    let difference = Chart {
        title: "Difference of the formulations".to_owned(),
        x: time(2.0),
        y: logarithmic("|tree − lagrange|", "µm, µrad"),
        series: vec![
            line("x", apart(1), PALETTE[1]),
            line("β", apart(4), PALETTE[2]),
        ],
        ..Chart::default()
    };
    let violation = Chart {
        title: "Drift of the lagrange formulation".to_owned(),
        x: time(2.0),
        y: logarithmic("Largest violation so far", "µm, µrad"),
        series: vec![line(
            "constraints",
            found
                .lagrange
                .rows
                .iter()
                .map(|row| (row[0], row[13] * 1e6))
                .collect(),
            PALETTE[3],
        )],
        ..Chart::default()
    };
    sheet(vec![difference, violation], 2)
}

/// Value and rate of x or beta, as phase portraits show them.
const PHASES: [(&str, &str, &str, &str); 2] = [
    ("x", "mm", "Velocity in x", "m/s"),
    ("β", "mrad", "Rate of β", "rad/s"),
];

fn portraits(found: &Findings, cases: [Case; 3], which: usize) -> Sheet {
    let loops: Vec<Loop> = found.loops(cases);
    let chart = |c: usize, title: &str, points: &dyn Fn(usize) -> Vec<(f64, f64)>| {
        let (value, unit, rate, rate_unit) = PHASES[c];
        Chart {
            title: title.to_owned(),
            x: axis(value, unit),
            y: axis(rate, rate_unit),
            series: cases
                .iter()
                .enumerate()
                .map(|(n, &case)| line(&case_name(case, which), points(n), PALETTE[n + 1]))
                .collect(),
            ..Chart::default()
        }
    };
    let settled = |c: usize| {
        chart(c, "Settled", &|n| {
            let Some(l) = loops.get(n) else {
                return Vec::new();
            };
            let pairs = l.coordinates[c].iter().zip(&l.rates[c]);
            pairs.map(|(v, r)| (v * 1e3, *r)).collect()
        })
    };
    let first = |c: usize| {
        chart(c, "First period, with its impacts", &|n| {
            let rows = found
                .run(cases[n])
                .map(|run| &run.rows[..])
                .unwrap_or_default();
            let (value, rate) = ([1, 4][c], [2, 5][c]);
            rows.iter()
                .map(|row| (row[value] * 1e3, row[rate]))
                .collect()
        })
    };
    sheet(vec![settled(0), settled(1), first(0), first(1)], 2)
}

fn sections(found: &Findings, which: usize) -> Sheet {
    let data = found.sweep_data(["runs_by_clearance", "runs_by_friction"][which]);
    let kept = data.sweep.layout().kept();
    let names = [
        ["section_x_m", "section_vx_m_s"],
        ["section_beta_rad", "section_beta_rate_rad_s"],
    ];
    let cases = [BY_CLEARANCE, BY_FRICTION][which];
    let charts = (0..2).map(|c| {
        let (value, unit, rate, rate_unit) = PHASES[c];
        let [values, rates] = names[c].map(|name| data.values(name));
        let series = cases.iter().enumerate().map(|(n, &case)| {
            let part = n * kept..(n + 1) * kept;
            let pairs = values[part.clone()].iter().zip(&rates[part]);
            let points = pairs.map(|(v, r)| (v * 1e3, *r)).collect::<Vec<_>>();
            let marker = [Marker::Disc, Marker::Square, Marker::Triangle][n];
            dots(
                &case_name(case, which),
                seen(points),
                PALETTE[n + 1],
                marker,
            )
        });
        Chart {
            title: format!("{kept} sections each"),
            x: axis(value, unit),
            y: axis(rate, rate_unit),
            series: series.collect(),
            ..Chart::default()
        }
    });
    sheet(charts.collect(), 2)
}

/// Points that a picture can tell apart, once each.
fn seen(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    let mut cells = std::collections::HashSet::new();
    let cell = |v: f64| format!("{v:.6}");
    points
        .into_iter()
        .filter(|p| cells.insert((cell(p.0), cell(p.1))))
        .collect()
}

fn parameter(which: usize) -> Axis {
    [axis("Clearance", "mm"), axis("Friction coefficient", "")][which].clone()
}

fn swept(found: &Findings, which: usize) -> [Vec<Swept>; 3] {
    let names = [
        ["clearance_cold", "clearance_up", "clearance_down"],
        ["friction_cold", "friction_up", "friction_down"],
    ];
    names[which].map(|name| found.sweep_data(name).swept([1e3, 1.0][which]))
}

fn bifurcation(found: &Findings, which: usize) -> Sheet {
    let all = swept(found, which);
    let starts = ["cold start", "followed upward", "followed downward"];
    let diagram = |c: usize| {
        // Each start on top of the one before, and smaller: all of them show.
        let looks = [(0, Marker::Disc), (5, Marker::Point), (6, Marker::Dot)];
        let series = all.iter().enumerate().map(|(n, points)| {
            let points = points
                .iter()
                .flat_map(|p| p.sections[c].iter().map(|s| (p.value, s * 1e3)));
            let (colour, marker) = looks[n];
            dots(starts[n], points.collect(), PALETTE[colour], marker)
        });
        Chart {
            title: format!("Sections in {}", PHASES[c].0),
            x: parameter(which),
            y: axis(PHASES[c].0, PHASES[c].1),
            series: series.collect(),
            ..Chart::default()
        }
    };
    let differences = |c: usize| {
        let apart = |other: &[Swept]| -> Vec<(f64, f64)> {
            let pairs = all[0].iter().zip(other);
            pairs
                .map(|(a, b)| (a.value, (a.latest(c) - b.latest(c)).abs() * 1e6))
                .collect()
        };
        let spread = all[0]
            .iter()
            .map(|p| (p.value, p.spread(c) * 1e6))
            .collect();
        let unit = ["µm", "µrad"][c];
        Chart {
            title: format!("Spread and hysteresis in {}", PHASES[c].0),
            x: parameter(which),
            y: Axis {
                scale: Scale::Logarithmic,
                ..axis("Distance", unit)
            },
            series: vec![
                line("spread of the sections of a point", spread, PALETTE[0]),
                line("followed upward against cold", apart(&all[1]), PALETTE[5]),
                line("followed downward against cold", apart(&all[2]), PALETTE[6]),
            ],
            levels: vec![Level {
                y: found.resolution[c] * 1e6,
                text: "resolution: less counts as equal".to_owned(),
            }],
            ..Chart::default()
        }
    };
    sheet(
        vec![diagram(0), diagram(1), differences(0), differences(1)],
        2,
    )
}

/// Lower exponents are left out of the picture: the smallest clearances would press all others against 0, 1/s.
const LEAST_EXPONENT: f64 = -10.0;

fn exponent(found: &Findings, which: usize) -> Sheet {
    let data = found.sweep_data(["clearance_cold", "friction_cold"][which]);
    let points = data.swept([1e3, 1.0][which]);
    let along = points.iter().map(|p| (p.value, p.exponent.0)).collect();
    let (kept, running) = (
        data.sweep.layout().kept(),
        data.values("exponent_running_per_s"),
    );
    let discard = data.sweep.plan().discard;
    let legible: Vec<usize> = (0..points.len())
        .filter(|&k| points[k].exponent.0 > LEAST_EXPONENT)
        .collect();
    let chosen = 5.min(legible.len());
    let convergence = (0..chosen).map(|n| {
        let k = legible[n * (legible.len() - 1) / (chosen - 1).max(1)];
        let values = running[k * kept..(k + 1) * kept].iter();
        let values = values
            .enumerate()
            .map(|(i, v)| ((discard + i + 1) as f64, *v));
        let name = if which == 0 {
            format!("{} mm", crate::cli::output::significant(points[k].value, 3))
        } else {
            format!(
                "friction {}",
                crate::cli::output::significant(points[k].value, 3)
            )
        };
        line(&name, values.collect(), PALETTE[n + 1])
    });
    let zero = vec![Level {
        y: 0.0,
        text: "chaos lies above".to_owned(),
    }];
    let most = points.iter().map(|p| p.exponent.0).fold(0.0, f64::max);
    let y = Axis {
        range: Some((LEAST_EXPONENT, 1.1 * most + 1.0)),
        ..axis("Largest Lyapunov exponent", "1/s")
    };
    let along = Chart {
        title: "Along the sweep".to_owned(),
        x: parameter(which),
        y: y.clone(),
        series: vec![Series {
            marker: Some(Marker::Dot),
            ..line("exponent", along, PALETTE[0])
        }],
        levels: zero.clone(),
        ..Chart::default()
    };
    let convergence = Chart {
        title: "How it converges".to_owned(),
        x: axis("Periods run", ""),
        y,
        series: convergence.collect(),
        levels: zero,
        ..Chart::default()
    };
    sheet(vec![along, convergence], 2)
}

fn map(found: &Findings) -> Sheet {
    let data: &SweepData = found.sweep_data("map");
    let axes = data.sweep.grid().axes();
    let (ys, xs): (Vec<f64>, Vec<f64>) = (
        axes[0].values().collect(),
        axes[1].values().map(|v| v * 1e3).collect(),
    );
    let chart = |title: &str, values: Vec<f64>, scale: Axis, names: Vec<(f64, String)>| Chart {
        title: title.to_owned(),
        x: axis("Clearance", "mm"),
        y: axis("Friction coefficient", ""),
        map: Some(Map {
            xs: xs.clone(),
            ys: ys.clone(),
            values,
            scale,
            names,
        }),
        ..Chart::default()
    };
    let regimes = data.values("regime");
    let mut codes: Vec<i64> = regimes.iter().map(|r| *r as i64).collect();
    codes.sort_unstable();
    codes.dedup();
    let names = codes
        .iter()
        .map(|&c| (c as f64, regime_word(c).to_owned()))
        .collect();
    let joints = &found.runs[0].response.joints;
    let peaks: Vec<Vec<f64>> = joints
        .iter()
        .map(|j| data.values(&format!("{j}_peak_N")))
        .collect();
    let hardest = (0..regimes.len()).map(|k| peaks.iter().map(|p| p[k]).fold(f64::NAN, f64::max));
    let exponents = data.values("exponent_per_s").into_iter();
    // Grey where a disturbance grows.
    let memory = exponents
        .map(|e| if e < 0.0 { -1.0 / e } else { f64::NAN })
        .collect();
    let logarithmic = Axis {
        scale: Scale::Logarithmic,
        ..axis("", "s")
    };
    let charts = vec![
        chart("Regime", regimes.clone(), Axis::default(), names),
        chart(
            "Peak contact force of any joint",
            hardest.collect(),
            axis("", "N"),
            Vec::new(),
        ),
        chart(
            "Largest probe error, settled",
            data.values("probe_error_max_um"),
            axis("", "µm"),
            Vec::new(),
        ),
        chart(
            "Time in which a disturbance falls to 1/e",
            memory,
            logarithmic,
            Vec::new(),
        ),
    ];
    sheet(charts, 2)
}

fn probe(found: &Findings) -> Sheet {
    let data = found.sweep_data("clearance_cold");
    let values: Vec<f64> = data.swept(1e3).iter().map(|p| p.value).collect();
    let along = |name: &str| {
        values
            .iter()
            .copied()
            .zip(data.values(name))
            .collect::<Vec<_>>()
    };
    let against = Chart {
        title: "Settled, against clearance".to_owned(),
        x: parameter(0),
        y: axis(PROBE.1, PROBE.2),
        series: vec![
            line("largest", along("probe_error_max_um"), PALETTE[4]),
            line("root mean square", along("probe_error_rms_um"), PALETTE[0]),
        ],
        ..Chart::default()
    };
    let runs: Vec<(String, &Traced)> = BY_CLEARANCE
        .iter()
        .filter_map(|&case| Some((case_name(case, 0), found.run(case)?)))
        .collect();
    debug_assert_eq!(BY_CLEARANCE[0], CASES[0]);
    let over = over_time(&runs, PROBE, 2.0, "The first period");
    sheet(vec![against, over], 2)
}
