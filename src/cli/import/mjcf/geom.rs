//! `<geom>`: shape and mass.

use std::sync::Arc;

use roxmltree::Node;

use super::super::description::{Form, Pose, Shape, mesh_unit};
use super::super::inertia::{Inertial, Solid};
use super::super::mesh::{self, MeshInertia};
use super::{MAIN, Model, quaternion};
use crate::cli::Failure;
use crate::machine::{self, Quat, Vec3};
use crate::words::Words;

/// Density of a geom without one of its own, kg/m^3.
const DEFAULT_DENSITY: f64 = 1000.0;
/// Attributes of a geom that are read, reported elsewhere, or affect only contacts.
const KNOWN_ATTRIBUTES: [&str; 19] = [
    "type",
    "size",
    "fromto",
    "mass",
    "density",
    "rgba",
    "material",
    "mesh",
    "shellinertia",
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
    /// Shape and, if `has_mass`, mass of a geom, in the axes of its body.
    pub(super) fn geom(
        &mut self,
        node: Node<'n, 'i>,
        class: &str,
        has_mass: bool,
    ) -> Result<(Option<Shape>, Option<Inertial>), Failure> {
        let line = self.source.line(node);
        self.omit_unknown_attributes(node, &KNOWN_ATTRIBUTES);
        if ["contype", "conaffinity"].iter().any(|key| self.attribute(node, class, key) != Some("0")) {
            self.description.omit(line, "contact between geoms: bodies do not touch each other");
        }
        let pose = self.pose(node, class)?;
        if self.attribute(node, class, "shellinertia") == Some("true") {
            let message =
                "shellinertia = \"true\" is not supported: give its body an <inertial>, or the geom mass = \"0\"";
            return Err(self.source.error(node, message));
        }
        let kind = self.attribute(node, class, "type").unwrap_or("sphere");
        let sizes = self.attribute(node, class, "size").map(|text| self.source.parse(node, "size", text, [1, 3]));
        let sizes = sizes.transpose()?.unwrap_or_default();
        let size = |at: usize| {
            let size = sizes.get(at).copied().filter(|size| *size > 0.0);
            size.ok_or_else(|| self.source.error(node, &format!("size: a {kind} needs number {} above 0", at + 1)))
        };
        let between = self.fromto_pose(node, class)?;
        let pose = between.map_or(pose, |(pose, _)| pose);
        let half = between.map(|(_, half)| half);
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
                    self.description.omit(line, "picture of an ellipsoid");
                    (None, Some(Solid::Ellipsoid(axes)))
                }
            }
            "mesh" => (self.mesh_form(node, class)?, None),
            "plane" | "hfield" => {
                self.description.omit(line, format!("geom of type {kind}"));
                return Ok((None, None));
            }
            _ => {
                let allowed = "allowed: sphere, capsule, cylinder, box, ellipsoid, mesh, plane, hfield";
                return Err(self.source.error(node, &format!("type = \"{kind}\": {allowed}")));
            }
        };
        let mass = self.numbers::<1>(node, class, "mass")?.map(|[mass]| mass);
        let density = self.numbers::<1>(node, class, "density")?.map_or(DEFAULT_DENSITY, |[density]| density);
        let mass = match (has_mass, solid) {
            (false, _) => None,
            _ if mass == Some(0.0) || (mass.is_none() && density == 0.0) => None,
            (true, Some(solid)) => {
                let mass = mass.unwrap_or_else(|| density * solid.volume());
                let turn = *pose.rotation.to_rotation_matrix().matrix();
                Some(Inertial::of_solid(solid, mass, pose.position, turn))
            }
            (true, None) => {
                let solid = self.mesh_solid(node, class)?;
                Some(pose.inertial(Inertial::of_density(&solid, mass.map_or(density, |mass| mass / solid.volume))))
            }
        };
        let form = form.filter(|_| !transparent);
        Ok((form.map(|form| Shape { form, pose, colour, line }), mass))
    }

    /// The mesh asset of a geom and its scale.
    fn mesh_asset(&self, node: Node<'n, 'i>, class: &str) -> Result<(Node<'n, 'i>, [f64; 3]), Failure> {
        let name = self.attribute(node, class, "mesh");
        let name = name.ok_or_else(|| self.source.error(node, "the attribute `mesh` is missing"))?;
        let asset =
            *self.meshes.get(name).ok_or_else(|| self.source.error(node, &format!("there is no mesh {name}")))?;
        Ok((asset, self.numbers(asset, MAIN, "scale")?.unwrap_or([1.0; 3])))
    }

    /// The file of a mesh asset below the folder of the description.
    fn mesh_file(&self, asset: Node<'n, 'i>) -> Option<String> {
        let file = asset.attribute("file")?;
        let folder = self.mesh_folder.trim_end_matches('/').trim_start_matches("./");
        Some(if folder.is_empty() { file.to_owned() } else { format!("{folder}/{file}") })
    }

    /// Form of a mesh; `None` if a scene cannot show it.
    fn mesh_form(&mut self, node: Node<'n, 'i>, class: &str) -> Result<Option<Form>, Failure> {
        let (asset, scale) = self.mesh_asset(node, class)?;
        let moved = ["refpos", "refquat"].into_iter().find(|key| asset.attribute(*key).is_some());
        let form = match (self.mesh_file(asset), moved) {
            (None, _) => Err("which has no file".to_owned()),
            (_, Some(key)) => Err(format!("which has {key}")),
            (Some(file), None) => mesh_unit(scale).map(|unit| Form::Mesh(file, unit)).map_err(str::to_owned),
        };
        form.map(Some).or_else(|fault| {
            let name = self.attribute(node, class, "mesh").unwrap_or_default();
            self.description.omit(self.source.line(node), format!("picture of mesh {name}, {fault}"));
            Ok(None)
        })
    }

    /// The solid that has the mass of a mesh, in the axes of its geom.
    fn mesh_solid(&mut self, node: Node<'n, 'i>, class: &str) -> Result<machine::Solid, Failure> {
        let (asset, scale) = self.mesh_asset(node, class)?;
        let mesh_inertia = match self.attribute(asset, MAIN, "inertia") {
            None => self.mesh_inertia,
            Some(word) => MeshInertia::of_word(word).ok_or_else(|| {
                self.source.error(asset, &format!("inertia = \"{word}\": allowed: {}", MeshInertia::WORDS.join(", ")))
            })?,
        };
        let position = self.numbers(asset, MAIN, "refpos")?.map_or_else(Vec3::zeros, Vec3::from);
        let rotation = match self.numbers(asset, MAIN, "refquat")? {
            Some(parts) => quaternion(parts).ok_or_else(|| self.source.error(asset, "refquat is 0"))?,
            None => Quat::identity(),
        };
        let origin = Pose { position, rotation }.inverse();
        let scale = Vec3::from(scale);
        let remedy = "give its body an <inertial>, or the geom mass = \"0\"";
        let mass_error =
            |what: String| self.source.error(node, &format!("mesh without a computable mass: {what}; {remedy}"));
        let file = self.mesh_file(asset).ok_or_else(|| mass_error("it has no file".to_owned()))?;
        let mesh = match self.loaded_meshes.get(&file) {
            Some(mesh) => mesh.clone(),
            None => Arc::new(mesh::read(self.source.folder, &file).map_err(mass_error)?),
        };
        let solid =
            mesh::solid(&mesh, |point| scale.component_mul(&origin.point(point)), scale.product() < 0.0, mesh_inertia);
        let solid = solid.map_err(|fault| mass_error(format!("{file}: {fault}")))?;
        self.loaded_meshes.insert(file, mesh);
        Ok(solid)
    }
}
