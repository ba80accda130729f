//! `<geom>`: shape and mass.

use roxmltree::Node;

use super::super::description::{Form, Place, Shape, mesh_unit};
use super::super::inertia::{Inertial, Solid};
use super::{MAIN, Model, to_z};
use crate::cli::Failure;
use crate::machine::Vec3;

/// Density of a geom without one of its own, kg/m^3.
const DENSITY: f64 = 1000.0;
/// Attributes of a geom that are read, or noted elsewhere, or act on contacts alone.
const GEOM: [&str; 18] = [
    "type",
    "size",
    "fromto",
    "mass",
    "density",
    "rgba",
    "material",
    "mesh",
    "contype",
    "conaffinity",
    "condim",
    "priority",
    "friction",
    "solmix",
    "solref",
    "solimp",
    "margin",
    "gap",
];

impl<'n, 'i> Model<'_, 'n, 'i> {
    /// Shape and, if `weighs`, mass of a geom, in the axes of its body.
    pub(super) fn geom(
        &mut self,
        node: Node<'n, 'i>,
        class: &str,
        weighs: bool,
    ) -> Result<(Option<Shape>, Option<Inertial>), Failure> {
        let line = self.source.line(node);
        self.leave_out_attributes(node, &GEOM);
        if ["contype", "conaffinity"].iter().any(|key| self.attribute(node, class, key) != Some("0")) {
            self.found.leave_out(line, "contact between geoms: bodies do not touch each other");
        }
        let mut place = self.place(node, class)?;
        let kind = self.attribute(node, class, "type").unwrap_or("sphere");
        let sizes = self.attribute(node, class, "size").map(|text| self.source.parse(node, "size", text, [1, 3]));
        let sizes = sizes.transpose()?.unwrap_or_default();
        let size = |at: usize| {
            let size = sizes.get(at).copied().filter(|size| *size > 0.0);
            size.ok_or_else(|| self.source.error(node, &format!("size: a {kind} needs number {} above 0", at + 1)))
        };
        let mut half = None;
        if let Some([a, b, c, d, e, f]) = self.numbers(node, class, "fromto")? {
            let (from, to) = (Vec3::new(a, b, c), Vec3::new(d, e, f));
            let along = (to - from).try_normalize(1e-12);
            let along = along.ok_or_else(|| self.source.error(node, "fromto: both points are the same"))?;
            // MuJoCo's z axis points from the second point to the first.
            place = Place { position: 0.5 * (from + to), rotation: to_z(-along) };
            half = Some(0.5 * (to - from).norm());
        }
        let length = |at: usize| half.map_or_else(|| size(at), Ok);
        let colour = self.attribute(node, class, "rgba");
        let material = || self.attribute(node, class, "material").and_then(|name| self.colours.get(name).copied());
        let colour = colour.or_else(material).map(|text| self.source.parse(node, "rgba", text, [4, 4])).transpose()?;
        let transparent = colour.as_ref().is_some_and(|rgba| rgba[3] == 0.0);
        let colour = colour.map(|rgba| [rgba[0], rgba[1], rgba[2]]);
        let (form, solid) = match kind {
            "sphere" => (Some(Form::Sphere(size(0)?)), Some(Solid::Ellipsoid([size(0)?; 3]))),
            "capsule" => {
                let (r, h) = (size(0)?, length(1)?);
                (Some(Form::Capsule(r, h)), Some(Solid::Capsule(r, h)))
            }
            "cylinder" => {
                let (r, h) = (size(0)?, length(1)?);
                (Some(Form::Cylinder(r, h)), Some(Solid::Cylinder(r, h)))
            }
            "box" | "ellipsoid" => {
                let axes = match half {
                    Some(half) => [size(0)?, size(0)?, half],
                    None => [size(0)?, size(1)?, size(2)?],
                };
                if kind == "box" {
                    (Some(Form::Box(axes)), Some(Solid::Box(axes)))
                } else {
                    self.found.leave_out(line, "picture of an ellipsoid");
                    (None, Some(Solid::Ellipsoid(axes)))
                }
            }
            "mesh" => (self.mesh(node, class, line)?, None),
            "plane" | "hfield" => {
                self.found.leave_out(line, format!("geom of type {kind}"));
                return Ok((None, None));
            }
            _ => {
                let allowed = "allowed: sphere, capsule, cylinder, box, ellipsoid, mesh, plane, hfield";
                return Err(self.source.error(node, &format!("type = \"{kind}\": {allowed}")));
            }
        };
        let mass = self.numbers::<1>(node, class, "mass")?.map(|[mass]| mass);
        let density = self.numbers::<1>(node, class, "density")?.map_or(DENSITY, |[density]| density);
        let mass = match (weighs, solid) {
            (false, _) => None,
            _ if mass == Some(0.0) || (mass.is_none() && density == 0.0) => None,
            (true, Some(solid)) => {
                let mass = mass.unwrap_or_else(|| density * solid.volume());
                let turn = *place.rotation.to_rotation_matrix().matrix();
                Some(Inertial::of_solid(solid, mass, place.position, turn))
            }
            (true, None) => {
                let message =
                    "the mass of a mesh is not computed: give its body an <inertial>, or the geom mass = \"0\"";
                return Err(self.source.error(node, message));
            }
        };
        let form = form.filter(|_| !transparent);
        Ok((form.map(|form| Shape { form, place, colour, line }), mass))
    }

    fn mesh(&mut self, node: Node<'n, 'i>, class: &str, line: u32) -> Result<Option<Form>, Failure> {
        let name = self.attribute(node, class, "mesh");
        let name = name.ok_or_else(|| self.source.error(node, "the attribute `mesh` is missing"))?;
        let asset =
            *self.meshes.get(name).ok_or_else(|| self.source.error(node, &format!("there is no mesh {name}")))?;
        let scale = self.numbers::<3>(asset, MAIN, "scale")?.unwrap_or([1.0; 3]);
        let moved = ["refpos", "refquat"].into_iter().find(|key| asset.attribute(*key).is_some());
        let unit = match (asset.attribute("file"), moved) {
            (None, _) => Err("which has no file".to_owned()),
            (_, Some(key)) => Err(format!("which has {key}")),
            _ => mesh_unit(scale).map_err(str::to_owned),
        };
        let unit = match unit {
            Ok(unit) => unit,
            Err(fault) => {
                self.found.leave_out(line, format!("mesh {name}, {fault}"));
                return Ok(None);
            }
        };
        let folder = self.mesh_folder.trim_end_matches('/').trim_start_matches("./");
        let file = asset.attribute("file").unwrap_or_default();
        let file = if folder.is_empty() { file.to_owned() } else { format!("{folder}/{file}") };
        Ok(Some(Form::Mesh(file, unit)))
    }
}
