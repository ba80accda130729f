//! Scene texts of any size, shared by tests and benchmarks.

/// A scene of `kind` with `n` bodies, whose ball joints have this clearance.
///
/// # Panics
/// If the kind is unknown.
pub fn scene_text(kind: &str, n: usize, clearance: &str) -> String {
    let mut text = format!("[contact]\nball_radius = \"1 mm\"\nclearance = \"{clearance}\"\n");
    for i in 0..n {
        let hinge = "kind = \"revolute\"\naxis = [0, 1, 0]\nparent_point = \"0 0 -1 mm\"\n";
        let joint = match kind {
            "hinges in a row" if i > 0 => format!("{hinge}parent = \"b{}\"", i - 1),
            "hinges on one body" if i > 0 => format!("{hinge}parent = \"b0\""),
            "hinges in a row" => hinge.to_owned(),
            _ => format!("kind = \"free\"\nstart = {{ position = \"{i} 0 0 mm\" }}"),
        };
        text += &format!(
            "[[body]]\nname = \"b{i}\"\nmass = \"1 kg\"\ninertia = \"1e-3 1e-3 1e-3 kg m^2\"\n\
             [[joint]]\nname = \"f{i}\"\nchild = \"b{i}\"\n{joint}\n"
        );
    }
    for i in 0..n {
        let here = format!("{i} 0 0 mm");
        let (before, own) = (format!("b{}", i.saturating_sub(1)), format!("b{i}"));
        let [socket, at, ball, end] = match kind {
            "pendulums" => ["world", &here, &own, "0 0 0 mm"],
            "sockets of one body" => ["world", &here, "b0", &here],
            "balls of one body" if i > 0 => ["b0", &here, &own, "0 0 0 mm"],
            "a chain" if i > 0 => [&before, "1 0 0 mm", &own, "0 0 0 mm"],
            "free bodies" | "hinges in a row" | "hinges on one body" | "balls of one body" | "a chain" => continue,
            other => panic!("no kind {other}"),
        };
        text += &format!(
            "[[ball_joint]]\nname = \"S{i}\"\nsocket = {{ body = \"{socket}\", at = \"{at}\" }}\n\
             ball = {{ body = \"{ball}\", at = \"{end}\" }}\n"
        );
    }
    text
}
