//! A tip held by rods in the xz plane, with clearance at both ends of each: a truss with a known error polygon.

use std::fmt::Write as _;

/// A rod from a fixed point to the tip, m, with the clearances of its two joints, m.
#[derive(Clone, Copy, Debug)]
pub struct Rod {
    pub from: [f64; 2],
    pub play: [f64; 2],
}

impl Rod {
    /// Length, m, and unit vector from `tip` to the rod's fixed point.
    pub fn length_and_direction(&self, tip: [f64; 2]) -> (f64, [f64; 2]) {
        let length_and_direction = [self.from[0] - tip[0], self.from[1] - tip[1]];
        let length = length_and_direction[0].hypot(length_and_direction[1]);
        (length, length_and_direction.map(|part| part / length))
    }

    /// Clearance of both joints together, m.
    pub fn total_play(&self) -> f64 {
        self.play[0] + self.play[1]
    }
}

/// How the tip is guided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Guide {
    /// Two slides, along x and z.
    Plane,
    /// One slide, along x.
    Line,
    /// Free.
    None,
}

/// The scene of `rods` that meet at `tip`; the first rod's fixed end is on a slide driven along x, `base.position`, at 0.
/// There is no friction; gravity is along -z.
pub fn truss(rods: &[Rod], tip: [f64; 2], guide: Guide, more: &str) -> String {
    let mut text = format!(
        "start = \"ideal\"\n[gravity]\nz = \"-9.81 m/s^2\"\n[contact]\nball_radius = \"8 mm\"\n{more}\n[output]\nbody = \"tip\"\n"
    );
    let mut body = |name: &str, mass: f64, joint: &str| {
        let _ = write!(
            text,
            "[[body]]\nname = \"{name}\"\nmass = \"{mass} kg\"\ninertia = \"1e-4 1e-4 1e-4 kg m^2\"\n\
             [[joint]]\nname = \"{name}\"\nchild = \"{name}\"\n{joint}\n"
        );
    };
    body("base", 1.0, "kind = \"prismatic\"\naxis = [1, 0, 0]\ndrive = { law = \"constant\", velocity = \"0 m/s\" }");
    let [x, z] = tip;
    let slide =
        |axis: &str, at: f64| format!("kind = \"prismatic\"\naxis = {axis}\nstart = {{ position = \"{at} m\" }}");
    match guide {
        Guide::Plane => {
            body("carriage", 0.5, &slide("[1, 0, 0]", x));
            body("tip", 0.5, &format!("parent = \"carriage\"\n{}", slide("[0, 0, 1]", z)));
        }
        Guide::Line => body("tip", 0.5, &format!("parent_point = [0, 0, \"{z} m\"]\n{}", slide("[1, 0, 0]", x))),
        Guide::None => body("tip", 0.5, &format!("kind = \"free\"\nstart = {{ position = \"{x} 0 {z} m\" }}")),
    }
    for (n, rod) in rods.iter().enumerate() {
        let (_, [ux, uz]) = rod.length_and_direction(tip);
        let [x, z] = rod.from;
        let start = format!("position = \"{x} 0 {z} m\", rotation = {{ x = [{}, 0, {}], y = [0, 1, 0] }}", -ux, -uz);
        body(&format!("rod{}", n + 1), 2e-3, &format!("kind = \"free\"\nstart = {{ {start} }}"));
    }
    for (n, rod) in rods.iter().enumerate() {
        let (length, _) = rod.length_and_direction(tip);
        let [x, z] = rod.from;
        let ground = if n == 0 { "base" } else { "world" };
        let sockets = [
            ("A", format!("body = \"{ground}\", at = \"{x} 0 {z} m\""), 0.0),
            ("B", "body = \"tip\"".to_owned(), length),
        ];
        for ((end, socket, at), play) in sockets.into_iter().zip(rod.play) {
            let _ = write!(
                text,
                "[[ball_joint]]\nname = \"{end}{n}\"\nsocket = {{ {socket} }}\nball = {{ body = \"rod{}\", at = \"{at} 0 0 m\" }}\n\
                 opening = [0, 1, 0]\nclearance = \"{play} m\"\n",
                n + 1,
                n = n + 1
            );
        }
    }
    text
}

/// Two rods at about right angles.
pub const TWO_RODS: [Rod; 2] =
    [Rod { from: [-0.2, 0.15], play: [0.1e-3, 0.15e-3] }, Rod { from: [0.1, 0.3], play: [0.05e-3, 0.2e-3] }];
/// The point where the rods [`TWO_RODS`] meet, m.
pub const TIP: [f64; 2] = [0.03, 0.02];

/// Support function along the unit vector `u` of the errors e with |n_i . e| <= C_i, for rods with unit vectors n_i: the minimum of
/// sum(C_i |l_i|) over all l with sum(l_i n_i) = u, attained by a pair of rods.
pub fn support(rods: &[Rod], tip: [f64; 2], u: [f64; 2]) -> f64 {
    let mut least = f64::INFINITY;
    for (i, a) in rods.iter().enumerate() {
        for b in &rods[..i] {
            let ((_, n), (_, m)) = (a.length_and_direction(tip), b.length_and_direction(tip));
            let det = n[0] * m[1] - n[1] * m[0];
            let (l, k) = ((u[0] * m[1] - u[1] * m[0]) / det, (n[0] * u[1] - n[1] * u[0]) / det);
            least = least.min(a.total_play() * l.abs() + b.total_play() * k.abs());
        }
    }
    least
}
