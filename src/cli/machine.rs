//! Name of the machine, which belongs to every timing.

/// Model of the processor, as far as the system reports it.
#[expect(clippy::disallowed_methods, reason = "reads a file of the system")]
pub fn name() -> String {
    let model = std::fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
        let line = text.lines().find(|line| line.starts_with("model name"))?;
        Some(line.split_once(':')?.1.trim().to_owned())
    });
    let model = model.filter(|model| !model.is_empty());
    let system = format!("{} {}", std::env::consts::OS, std::env::consts::ARCH);
    // Timings of an unoptimised build do not characterise the machine.
    let build = if cfg!(debug_assertions) { ", debug build" } else { "" };
    match model {
        Some(model) => format!("{model}, {system}{build}"),
        None => format!("{system}{build}"),
    }
}
