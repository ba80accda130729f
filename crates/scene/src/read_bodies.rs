//! Bodies and shapes of a scene file.

use super::assets::MeshError;
use super::document::{Document, Node, Section};
use super::instance::Instance;
use super::mesh::{Fault, MeshFormat};
use super::placement::read_rotation;
use super::*;
use jointplay_physics::machine::{Solid, triangulate};
use jointplay_physics::units::format_quantity_digits;
use jointplay_physics::words::words;

#[derive(Clone, Copy, PartialEq)]
pub(super) enum Form {
    Capsule,
    Cylinder,
    Cone,
    Box,
    Sphere,
    Plate,
    Mesh,
}

words!(Form {
    Capsule => "capsule",
    Cylinder => "cylinder",
    Cone => "cone",
    Box => "box",
    Sphere => "sphere",
    Plate => "plate",
    Mesh => "mesh",
});

/// Largest mass, kg, and inertia, kg m^2, allowed in a file: anything larger is a typing error.
pub(super) const MAX_MASS: f64 = 1e9;
const MAX_INERTIA: f64 = 1e12;

/// Largest dimension of a shape, m.
const MAX_SHAPE: f64 = 1000.0;

/// Relative slack in the triangle inequality: moments of inertia are often given to three digits.
const TRIANGLE_SLACK: f64 = 1e-9;

/// Largest density, kg/m^3: five times that of osmium.
pub(super) const MAX_DENSITY: f64 = 1e5;

/// Reads a `[[body]]`.
pub(super) fn read_body<'d>(node: &Node<'d>) -> Result<(Body, Section<'d>), SceneError> {
    let section = node.section_as(node.title("body"))?;
    let name_node = section.require("name")?;
    let name = name_node.name()?.into_owned();
    if name == "world" {
        let why = "`world` is the fixed frame; choose another name";
        return Err(name_node.error(why));
    }
    let shapes = match section.get("shapes") {
        Some(node) => node.entries()?.iter().map(|shape| read_shape(shape, false)).collect::<Result<_, _>>()?,
        None => Vec::new(),
    };
    if let Some(node) = section.get("density") {
        return Ok((read_solid(&section, &node, name, shapes)?, section));
    }
    let mass_node = section.require("mass")?;
    let only_connects = mass_node.within(Dimension::Mass, (0.0, MAX_MASS)) == Ok(0.0) && has_no_inertia(&section)?;
    let (mass, inertia) = if only_connects {
        (0.0, Mat3::zeros())
    } else {
        (mass_node.within(Dimension::Mass, (ABOVE_ZERO, MAX_MASS))?, read_inertia(&section)?)
    };
    let body = Body { name, mass, centre: section.vector("centre")?, inertia, shapes, density: None };
    Ok((body, section))
}

/// A body whose mass, centroid and inertia follow from its shapes and the density in `node`.
fn read_solid(section: &Section<'_>, node: &Node<'_>, name: String, shapes: Vec<Shape>) -> Result<Body, SceneError> {
    for key in ["mass", "centre", "inertia", "products"] {
        section.refuse(key, "it follows from `density` and `shapes`")?;
    }
    for (shape, index) in shapes.iter().zip(0..) {
        let Geometry::Mesh { mesh, unit, .. } = &shape.geometry else {
            continue;
        };
        if let Some(ends) = mesh.open_edge() {
            let [from, to] = ends.map(|end| {
                let [x, y, z] = end.map(|x| format_quantity_digits(f64::from(x) * unit * 1e3, "", 4));
                format!("({x}, {y}, {z})")
            });
            return Err(section.error(
                &format!("shapes[{index}]"),
                format!(
                    "this mesh is not closed, so it has no volume for `density`: its edge from {from} to {to} mm in the \
                     file's frame does not lie between two triangles that face the same way; close it, or give `mass`, \
                     `centre` and `inertia`"
                ),
            ));
        }
    }
    let density = node.number()?;
    let solid = Solid::of_shapes(&shapes);
    let (mass, inertia) = (density * solid.volume, solid.inertia() * density);
    let heaviest = inertia.amax() <= MAX_INERTIA && mass <= MAX_MASS;
    // Rounding must not make the inertia matrix singular.
    if !(solid.volume > 0.0 && heaviest && inertia.symmetric_eigenvalues().min() > 0.0) {
        return Err(node.error(format!(
            "needs `shapes` with a volume that this program can weigh; these weigh {}, allowed above 0 up to {}",
            format_quantity(mass, "kg"),
            format_quantity(MAX_MASS, "kg"),
        )));
    }
    Ok(Body { name, mass, centre: solid.centre, inertia, shapes, density: Some(density) })
}

/// Whether a body without mass also has no inertia, because it only connects joints.
fn has_no_inertia(section: &Section<'_>) -> Result<bool, SceneError> {
    let moments: [f64; 3] = section.require("inertia")?.numbers()?;
    Ok(moments == [0.0; 3] && section.vector("products")? == Vec3::zeros())
}

/// The inertia matrix about the centroid in body axes: `inertia` = Ixx, Iyy, Izz and, where the axes are not principal,
/// `products` = the integrals of xy, xz, yz over the mass.
fn read_inertia(section: &Section<'_>) -> Result<Mat3, SceneError> {
    let node = section.require("inertia")?;
    let [xx, yy, zz] = node.numbers()?;
    let [xy, xz, yz] = section.vector("products")?.into();
    let inertia = Mat3::new(xx, -xy, -xz, -xy, yy, -yz, -xz, -yz, zz);
    if inertia.amax() > MAX_INERTIA {
        return Err(node.error("out of range; allowed above 0 up to 1e12 kg m^2"));
    }
    let mut principal: Vec<f64> = inertia.symmetric_eigenvalues().iter().copied().collect();
    principal.sort_by(f64::total_cmp);
    let [small, middle, large] = [principal[0], principal[1], principal[2]];
    let units = unit_names(Dimension::Inertia).join(", ");
    if small <= 0.0 {
        return Err(node.error(format!(
            "no body has this inertia: its smallest principal moment is {}, allowed above 0; units {units}",
            format_quantity(small, "kg m^2")
        )));
    }
    if large > (small + middle) * (1.0 + TRIANGLE_SLACK) {
        return Err(node.error(format!(
            "no body has this inertia: its largest principal moment {} exceeds the sum of the other two, {}, which is the \
             most allowed; units {units}",
            format_quantity(large, "kg m^2"),
            format_quantity(small + middle, "kg m^2"),
        )));
    }
    Ok(inertia)
}

/// Reads a shape of a body, or a `fixed` one.
pub(super) fn read_shape(node: &Node<'_>, fixed: bool) -> Result<Shape, SceneError> {
    let section = node.section()?;
    let role = section.get("role").map(|node| node.word()).transpose()?;
    let colour = section.get("colour").as_ref().map(read_colour);
    let colour = colour.transpose()?;
    let form_node = section.require("form")?;
    let form: Form = form_node.word()?;
    let point = |name| section.vector(name);
    let size = |name| section.number(name);
    let geometry = match form {
        Form::Box => {
            let node = section.require("size")?;
            let size = node.vector()?;
            if size.min() <= 0.0 {
                return Err(node.error("edge lengths must be above 0; units m, mm, um"));
            }
            Geometry::Box { centre: point("centre")?, size }
        }
        Form::Sphere => Geometry::Sphere { centre: point("centre")?, radius: size("radius")? },
        Form::Plate => {
            let node = section.require("corners")?;
            let corners = node.entries()?.iter().map(Node::vector).collect::<Result<Vec<_>, SceneError>>()?;
            let triangles = triangulate(&corners).map_err(|fault| node.error(fault.to_string()))?;
            Geometry::Plate { corners, triangles, thickness: size("thickness")? }
        }
        Form::Capsule | Form::Cylinder | Form::Cone => {
            let (from, to, radius) = (point("from")?, point("to")?, size("radius")?);
            if from == to && form != Form::Capsule {
                return Err(section.error("to", format!("a {form} needs two different ends")));
            }
            match form {
                Form::Capsule => Geometry::Capsule { from, to, radius },
                Form::Cylinder => Geometry::Cylinder { from, to, radius },
                _ => Geometry::Cone { from, to, radius },
            }
        }
        Form::Mesh => read_mesh(&section)?,
    };
    let mut shape = Shape { geometry, role, colour };
    // Shapes of a body move with it.
    if let Some(instance) = node.document.instance.filter(|_| fixed) {
        place_shape(&mut shape, instance);
    }
    Ok(shape)
}

/// Reads a mesh from a file beside the scene.
fn read_mesh(section: &Section<'_>) -> Result<Geometry, SceneError> {
    let file = section.require("file")?;
    let name = file.text()?;
    let document = &file.document;
    let mesh = document.assets.mesh(name);
    let mesh = mesh.map_err(|why| match why {
        MeshError::Unavailable(fault) => file.error(fault.to_string()),
        MeshError::Invalid { text, fault } => error_in(name, text.as_deref(), fault, document),
    })?;
    let own = MeshFormat::of(name).and_then(MeshFormat::unit);
    let unit = match own.filter(|_| section.get("unit").is_none()) {
        Some(unit) => unit,
        None => read_unit(&section.require("unit")?)?,
    };
    let bounds = mesh.bounds();
    let largest = bounds.as_flattened().iter().fold(0.0, |most, x| x.abs().max(most));
    if f64::from(largest) * unit > MAX_SHAPE {
        let size = format_quantity(f64::from(largest) * unit, "m");
        let message = format!("with this unit, the mesh reaches {size} far; allowed up to {MAX_SHAPE} m");
        return Err(section.get("unit").unwrap_or(file).error(message));
    }
    Ok(Geometry::Mesh {
        mesh,
        unit,
        position: section.vector("position")?,
        rotation: read_rotation(section.get("rotation"))?,
    })
}

/// The error for a fault in the mesh file `name`.
fn error_in(name: &str, text: Option<&str>, fault: Fault, document: &Document<'_>) -> SceneError {
    match (text, fault.at) {
        (Some(text), Some(at)) => {
            let file = Document { file: Some(name), text, ..*document };
            file.error(at..at, "", None, fault.why.to_string())
        }
        (_, at) => SceneError {
            file: Some(name.to_owned()),
            message: match at {
                Some(at) => format!("byte {at}: {}", fault.why),
                None => fault.why.to_string(),
            },
            ..SceneError::default()
        },
    }
}

/// Length of a file's unit, m: a unit of length alone (`"mm"`), or with a number (`"25.4 mm"`).
fn read_unit(node: &Node<'_>) -> Result<f64, SceneError> {
    match parse_quantity(&format!("1 {}", node.scalar()?), Dimension::Length) {
        Ok(unit) => Ok(unit),
        Err(_) => node.number(),
    }
}

/// Red, green and blue of `"#rrggbb"`.
fn read_colour(node: &Node<'_>) -> Result<[u8; 3], SceneError> {
    let text = node.text()?;
    let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6);
    let parts = [0, 2, 4].map(|at| {
        let digits = digits?.get(at..at + 2)?;
        // `from_str_radix` would also accept a sign.
        let is_hexadecimal = digits.bytes().all(|digit| digit.is_ascii_hexdigit());
        u8::from_str_radix(digits, 16).ok().filter(|_| is_hexadecimal)
    });
    match parts {
        [Some(red), Some(green), Some(blue)] => Ok([red, green, blue]),
        _ => Err(node.error(
            "not a colour; allowed: `#` and six hexadecimal digits, red, green and blue, for example \
                    \"#c2255c\"",
        )),
    }
}

/// Transforms a fixed shape of the group `instance`. A rotated box becomes a plate of the same shape.
fn place_shape(shape: &mut Shape, instance: &Instance<'_>) {
    let point = |point: Vec3| instance.point(None, point);
    match &mut shape.geometry {
        Geometry::Capsule { from, to, .. } | Geometry::Cylinder { from, to, .. } | Geometry::Cone { from, to, .. } => {
            *from = point(*from);
            *to = point(*to);
        }
        Geometry::Sphere { centre, .. } => *centre = point(*centre),
        Geometry::Plate { corners, .. } => {
            for corner in corners {
                *corner = point(*corner);
            }
        }
        Geometry::Box { centre, .. } if instance.preserves_axes() => *centre = point(*centre),
        Geometry::Mesh { position, rotation, .. } => {
            *position = point(*position);
            *rotation = instance.rotation(None, *rotation);
        }
        Geometry::Box { centre, size } => {
            let corner = |[x, y]: [f64; 2]| point(*centre + 0.5 * Vec3::new(x * size.x, y * size.y, 0.0));
            let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(corner).to_vec();
            let triangles = vec![[0, 1, 2], [0, 2, 3]];
            shape.geometry = Geometry::Plate { corners, triangles, thickness: size.z };
        }
    }
}
