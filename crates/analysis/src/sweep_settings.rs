//! What identifies a sweep: provenance of its result, and of its file of finished blocks.

use super::axis::Axis;
use super::design::{Arrangement, FOLLOW_BLOCK};
use super::layout::Status;
use super::point::Span;
use super::regime::Regime;
use super::sweep::Sweep;
use jointplay_physics::simulate::Doubt;
use jointplay_physics::units::si_unit;
use jointplay_scene::{Kind, Scene, insert_texts, provenance};
use serde_json::{Map, Value as Json, json};

/// The settings of a sweep as JSON, for a program with this name and version, `writer`: equal settings give equal results.
pub fn settings(writer: [&str; 2], sweep: &Sweep) -> Map<String, Json> {
    let scene = sweep.scene();
    let (design, protocol, layout) = (sweep.design(), sweep.protocol(), sweep.layout());
    let mut all = provenance(writer, scene);
    insert_texts(&mut all, scene);
    let mut add = |key: &str, value: Json| all.insert(key.to_owned(), value);
    add("scene_crc32", json!(format!("{:08x}", crc32fast::hash(scene.source.text.as_bytes()))));
    add("vary", design.axes().iter().map(|axis| axis_settings(scene, axis)).collect());
    add("arrangement", json!(if design.arrangement() == Arrangement::Table { "table" } else { "crossed" }));
    match &protocol.span {
        Span::Sections { plan, .. } => {
            // A parameter that changes the period gives different periods at the ends of its range.
            let [period, other] = [0, design.points() - 1].map(|point| {
                let scene = design.scene(scene, point).ok()?;
                protocol.interval(&scene).ok()
            });
            add("periods", json!(plan.periods));
            add("discard", json!(plan.discard));
            add("section", json!("phase"));
            add("phase", json!(plan.phase));
            add("period_s", json!(period.filter(|_| period == other)));
        }
        Span::Duration { duration, from } => {
            add("duration_s", json!(duration));
            add("from_s", json!(from));
        }
        Span::Crossings { crossing, count, discard, duration } => {
            add("crossings", json!(count));
            add("discard", json!(discard));
            add("section", json!(crossing.text()));
            add("duration_s", json!(duration));
        }
    }
    let starts: Vec<&str> = design.starts().iter().map(|start| start.word()).collect();
    add("start", if let [start] = starts[..] { json!(start) } else { json!(starts) });
    add("follow_block", json!(FOLLOW_BLOCK));
    if let Some(plan) = protocol.plan() {
        add("exponent", json!(plan.exponent));
    }
    let statuses = json!({
        Status::Done.code().to_string(): "done",
        Status::Diverged.code().to_string(): "diverged",
        Status::NoStart.code().to_string(): "could not start",
    });
    add("statuses", statuses);
    if protocol.sections().is_some() {
        let words = Regime::ALL.iter().map(|regime| (regime.code().to_string(), json!(regime.word())));
        let none = ("-1".to_owned(), json!("none"));
        add("regimes", Json::Object(words.chain([none]).collect()));
    }
    let doubts = Doubt::KINDS.iter().enumerate();
    add("doubts", doubts.map(|(k, kind)| ((1_u32 << k).to_string(), json!(kind))).collect::<Map<_, _>>().into());
    add("kept", json!(layout.kept()));
    add("arrays", json!(layout.columns()));
    all
}

/// A varied parameter. Listed values are in the arrays; their checksum distinguishes sweeps.
fn axis_settings(scene: &Scene, axis: &Axis) -> Json {
    let mut own = Map::new();
    let mut add = |key: &str, value: Json| own.insert(key.to_owned(), value);
    add("key", json!(axis.key()));
    if axis.is_listed() {
        let mut checksum = crc32fast::Hasher::new();
        for i in 0..axis.count() {
            let value = scene.parameter(axis.key()).map(|parameter| parameter.write(&axis.value(i)));
            checksum.update(format!("{}\n", value.unwrap_or_default()).as_bytes());
        }
        add("values_crc32", json!(format!("{:08x}", checksum.finalize())));
    } else {
        add("from", json!(axis.number(0)));
        add("to", json!(axis.number(axis.count() - 1)));
    }
    add("count", json!(axis.count()));
    add("spacing", json!(axis.spacing()));
    if axis.words().is_some() {
        add("words", json!(true));
    }
    add("unit", json!(unit_suffix(scene, axis)));
    Json::Object(own)
}

/// SI unit of the values of `axis`, as the suffix of a column's name: `_m`, `_rad_s`; empty for a pure number or words.
pub fn unit_suffix(scene: &Scene, axis: &Axis) -> String {
    let unit = match scene.parameter(axis.key()).map(|parameter| parameter.kind) {
        Ok(Kind::Number { dimension, .. }) => si_unit(dimension),
        _ => "",
    };
    let unit = unit.replace([' ', '^'], "").replace('/', "_");
    if unit.is_empty() { unit } else { format!("_{unit}") }
}
