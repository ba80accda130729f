//! Texts for screen readers that differ from the displayed ones: values with units in words, headings, landmarks, names of
//! splitters.

use eframe::egui::{Id, Response, Ui, accesskit::Role};

/// Units by symbol, in the singular. A prefix of [`PREFIXES`] scales them.
const UNITS: [(&str, &str); 10] = [
    ("m", "metre"),
    ("s", "second"),
    ("g", "gram"),
    ("N", "newton"),
    ("J", "joule"),
    ("Hz", "hertz"),
    ("Pa", "pascal"),
    ("rad", "radian"),
    ("deg", "degree"),
    ("%", "percent"),
];
const PREFIXES: [(char, &str); 7] =
    [('c', "centi"), ('m', "milli"), ('µ', "micro"), ('n', "nano"), ('k', "kilo"), ('M', "mega"), ('G', "giga")];

/// `text` with units spelled out after numbers and trailing zeros removed: `43.5000 ms` becomes `43.5 milliseconds`.
pub fn words(text: &str) -> String {
    let text = text.replace('\u{202f}', "").replace('°', " deg");
    let mut parts: Vec<String> = Vec::new();
    let mut number = None;
    let mut rest = text.split(' ').peekable();
    while let Some(word) = rest.next() {
        let symbol = word.trim_end_matches([',', ';']);
        let end = &word[symbol.len()..];
        if let Ok(value) = symbol.parse::<f64>() {
            number = Some(value);
            // A small number keeps its power of ten.
            let plain = value == 0.0 || value.abs() >= 1e-6;
            parts.push(if plain { format!("{value}{end}") } else { word.to_owned() });
            continue;
        }
        // In a product only the last factor is plural: newton metres.
        let factor = |next: &&str| end.is_empty() && unit(next, true).is_some();
        let singular = number == Some(1.0) || rest.peek().is_some_and(factor);
        match number.and_then(|_| unit(symbol, singular)) {
            Some(name) => {
                number = number.filter(|_| end.is_empty());
                parts.push(name + end);
            }
            None => {
                number = None;
                parts.push(word.to_owned());
            }
        }
    }
    parts.join(" ")
}

/// Name of the unit `symbol`, singular or plural; `None` if it is not a unit.
pub fn unit(symbol: &str, singular: bool) -> Option<String> {
    if let Some((above, below)) = symbol.split_once('/') {
        return Some(format!("{} per {}", unit(above, singular)?, unit(below, true)?));
    }
    for (power, words) in [('²', " squared"), ('³', " cubed")] {
        if let Some(symbol) = symbol.strip_suffix(power) {
            return Some(unit(symbol, singular)? + words);
        }
    }
    let of = |symbol: &str| UNITS.iter().find(|(own, _)| *own == symbol).map(|(_, name)| *name);
    let (prefix, name) = of(symbol).map(|name| ("", name)).or_else(|| {
        let (prefix, words) = PREFIXES.iter().find(|(prefix, _)| symbol.starts_with(*prefix))?;
        Some((*words, of(&symbol[prefix.len_utf8()..])?))
    })?;
    let end = if singular || name == "hertz" || name == "percent" { "" } else { "s" };
    Some(format!("{prefix}{name}{end}"))
}

/// Sets `text`, with units spelled out, as the spoken value of a slider.
pub fn value(response: &Response, text: &str) {
    response.ctx.accesskit_node_builder(response.id, |node| node.set_value(words(text)));
}

/// Marks the label of text `title` as a heading.
pub fn heading(response: &Response, title: &str) {
    response.ctx.accesskit_node_builder(response.id, |node| {
        node.set_role(Role::Heading);
        node.set_level(2);
        node.set_label(title);
    });
}

/// Marks `ui` as a named landmark for screen readers.
pub fn landmark(ui: &Ui, name: &str) {
    ui.ctx().accesskit_node_builder(ui.unique_id(), |node| {
        node.set_role(Role::Region);
        node.set_label(name);
    });
}

/// The same for `ui` with a title: the label `response`, which becomes a heading.
pub fn titled(ui: &Ui, response: &Response, title: &str) {
    heading(response, title);
    ui.ctx().accesskit_node_builder(ui.unique_id(), |node| {
        node.set_role(Role::Region);
        node.set_labelled_by(vec![response.id.accesskit_id()]);
    });
}

/// Names the splitter of `panel` in `ui`; call it after the panel was shown.
pub fn splitter(ui: &Ui, panel: &str, name: &str) {
    let id: Id = ui.scope_id().with(panel).with("__resize");
    if ui.read_response(id).is_none() {
        return;
    }
    ui.ctx().accesskit_node_builder(id, |node| {
        node.set_label(name);
        let share = 100.0 * node.numeric_value().unwrap_or_default();
        node.set_value(words(&format!("{share:.0} %")));
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_spoken_with_unit_names_and_significant_digits() {
        for (shown, spoken) in [
            ("0.3 mm", "0.3 millimetres"),
            ("1 mm", "1 millimetre"),
            ("0.15", "0.15"),
            ("3e-14 N", "3e-14 newtons"),
            ("0.0000 s", "0 seconds"),
            ("43.5000 ms", "43.5 milliseconds"),
            ("1 to 10\u{202f}000", "1 to 10000"),
            ("12.500 µs", "12.5 microseconds"),
            ("9.81 m/s²", "9.81 metres per second squared"),
            ("2 N m", "2 newton metres"),
            ("7 kg mm²", "7 kilogram millimetres squared"),
            ("6 Hz", "6 hertz"),
            ("90°", "90 degrees"),
            ("23 %", "23 percent"),
            ("70 GPa", "70 gigapascals"),
            ("S1 410 to 412 N, S2 0 N; m", "S1 410 to 412 newtons, S2 0 newtons; m"),
        ] {
            assert_eq!(words(shown), spoken);
        }
    }

    #[test]
    fn every_unit_on_show_has_a_name() {
        let parameters = crate::scene::table().iter().map(|parameter| parameter.display_unit());
        let plots = crate::simulate::Quantity::ALL.map(|quantity| crate::app::plots::plot_of(quantity).unit.0);
        for shown in parameters.chain(plots).filter(|unit| !unit.is_empty()) {
            let shown = crate::app::value::typeset(shown);
            assert!(shown.split(' ').all(|symbol| unit(symbol, true).is_some()), "{shown}");
        }
    }
}
