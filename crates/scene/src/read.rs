//! Reads a scene from TOML: settings first, then bodies, joints and ball joints.

use super::access::beside_preset;
use super::assets::AssetResolver;
use super::closed_form::read_closed_form;
use super::document::{Document, Node, Section, lists};
use super::elements::{ELEMENTS, read_element};
use super::error::{no_ball_joint, no_body};
use super::field::Access;
use super::format::FILE;
use super::include::{self, read_includes};
use super::instance::{Group, Instance};
use super::model::AsRead;
use super::pattern::{Pattern, read_patterns};
use super::placement::read_placement;
use super::play::{dimensions, loose_joint, own_part, place_cut_bodies};
use super::read_bodies::{read_body, read_shape};
use super::read_joints::{JointText, LooseJointText, read_ball_joint, read_joint, read_own_contact, sort_forest};
use super::reading::Reading;
use super::table::joint_part;
use super::user_parameters::read_user_parameters;
use super::*;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// Node of each parameter given in the file, by key.
type Places<'d> = BTreeMap<String, Node<'d>>;

impl Scene {
    /// Parses a scene from TOML text; `file` is its name in errors.
    ///
    /// # Errors
    /// Same as [`Self::load`].
    pub fn parse(text: &str, file: Option<&str>, changes: &[(String, String)]) -> Result<Self, SceneError> {
        Self::parse_with_assets(text, file, AssetResolver::default(), changes)
    }

    /// Like [`Self::parse`], for a text opened together with other files, `given` by name without folder. A file that also
    /// exists in `folder` is read there.
    ///
    /// # Errors
    /// Same as [`Self::load`].
    pub fn parse_given(
        text: &str,
        file: Option<&str>,
        given: &BTreeMap<String, Vec<u8>>,
        folder: Option<&Path>,
        changes: &[(String, String)],
    ) -> Result<Self, SceneError> {
        Self::parse_with_assets(text, file, AssetResolver::given(given, folder), changes)
    }

    /// Like [`Self::parse`], with the contents of the named files in `beside`.
    ///
    /// # Errors
    /// Same as [`Self::load`].
    pub fn parse_with(
        text: &str,
        file: Option<&str>,
        beside: &Texts,
        changes: &[(String, String)],
    ) -> Result<Self, SceneError> {
        Self::parse_with_assets(text, file, AssetResolver::known(beside), changes)
    }

    /// Parses a scene; `assets` resolves the files it names.
    pub(super) fn parse_with_assets(
        text: &str,
        file: Option<&str>,
        assets: AssetResolver<'_>,
        changes: &[(String, String)],
    ) -> Result<Self, SceneError> {
        Self::read(text, file, assets, changes, |_, _| true)
    }

    /// Like [`Self::parse_with_assets`], without the changes of keys that `retains` rejects once the bodies and joints are read.
    pub(super) fn read(
        text: &str,
        file: Option<&str>,
        assets: AssetResolver<'_>,
        changes: &[(String, String)],
        retains: fn(&Self, &str) -> bool,
    ) -> Result<Self, SceneError> {
        let reading = Reading::new(changes_of_text(changes));
        let document =
            Document { file, text, reading: &reading, assets: &assets, include: None, instance: None, on_hinge: false };
        Self::read_document(document, changes, retains)
    }

    fn read_document(
        document: Document<'_>,
        changes: &[(String, String)],
        retains: fn(&Self, &str) -> bool,
    ) -> Result<Self, SceneError> {
        let Document { file, text, .. } = document;
        if text.trim().is_empty() {
            return Err(document.error(0..0, "", None, "the file is empty; a scene needs at least one body"));
        }
        let parsed = document.parse()?;
        let top = Section::new(document, String::new(), parsed.get_ref(), 0..0, &FILE)?;
        let includes = read_includes(&top)?;
        let documents: Vec<Document<'_>> = includes.iter().map(|include| include.document(document)).collect();
        let tables = documents.iter().map(Document::parse);
        let tables = tables.collect::<Result<Vec<_>, _>>()?;
        // Placements may depend on parameters, whose names depend on the file: names come first.
        let named = includes.iter().zip(&tables).map(|(include, table)| include.named(table));
        let named: Vec<Option<Instance<'_>>> = named.collect();
        let included = documents.iter().zip(&tables).zip(&named).map(|((document, table), instance)| {
            include::section(Document { instance: instance.as_ref(), ..*document }, table)
        });
        let files = std::iter::once(Ok(top.clone())).chain(included);
        let files = files.collect::<Result<Vec<_>, _>>()?;
        let own = read_user_parameters(&files)?;
        let scene_instance = read_scene_instance(&top)?;
        let placed =
            includes.iter().zip(&named).map(|(include, named)| include.placed(named.as_ref(), scene_instance.as_ref()));
        let placed = placed.collect::<Result<Vec<_>, _>>()?;
        let instances = std::iter::once(scene_instance.as_ref()).chain(placed.iter().map(Option::as_ref));
        let files = files.into_iter().zip(instances);
        let files = files.map(|(file, instance)| Section { document: Document { instance, ..file.document }, ..file });
        let files: Vec<Section<'_>> = files.collect();
        let patterns = read_patterns(&files)?;
        let mut scene = read_settings(&top)?;
        if let (Some(scene_instance), Some(form)) = (&scene_instance, &mut scene.machine_mut().closed_form)
            && let Some(path) = &mut form.path
        {
            let origin = scene_instance.point(None, Vec3::zeros());
            path.place =
                Some((scene_instance.rotation(None, Quat::identity()).to_rotation_matrix().into_inner(), origin));
        }
        let mut places = read_parameters(&top, &mut scene)?;
        let source = Arc::make_mut(&mut scene.source);
        source.places = places
            .iter()
            .map(|(key, node)| (key.clone(), node.offset()))
            .chain(top.get("closed_form").map(|node| ("closed_form".to_owned(), node.offset())))
            .collect();
        read_mechanism(&files, &patterns, &mut scene, &mut places)?;
        let source = Arc::make_mut(&mut scene.source);
        source.numbers = document.reading.numbers();
        source.own = own;
        source.beside = document.assets.texts();
        let of_text = changes_of_text(changes).filter(|(key, _)| retains(&scene, key)).cloned().collect();
        let as_read = AsRead {
            machine: scene.machine.clone(),
            view: scene.view,
            overrides: scene.overrides.clone(),
            changes: of_text,
        };
        Arc::make_mut(&mut scene.source).as_read = Some(as_read);
        scene.apply(changes, retains)?;
        scene.machine.check_contacts().map_err(|conflict| {
            let message = conflict.fault.to_string();
            let keys = scene.keys_of(&conflict);
            let place = || {
                let at = |key: &String| Some(places.get(key)?.error(scene.conflict_text(&conflict, key)));
                keys.iter().find_map(at)
            };
            // A default that does not fit the dimensions of a joint is not in the text; the joint is.
            let unplaced = || match conflict.joint.map(|index| &scene.machine.loose_joints[index].name) {
                Some(name) => scene.start_error(&format!("joint.{name}"), &[], message.clone()),
                None => SceneError { file: file.map(str::to_owned), message: message.clone(), ..Default::default() },
            };
            scene.blame_changes(&conflict).or_else(place).unwrap_or_else(unplaced)
        })?;
        Ok(scene)
    }
}

/// Those of `changes` that replace values of the text.
pub(super) fn changes_of_text(changes: &[(String, String)]) -> impl Iterator<Item = &(String, String)> {
    changes.iter().filter(|(key, _)| replaces_text(key))
}

/// The scene as a group with its own placement, if the file gives one.
///
/// # Errors
/// An invalid place.
fn read_scene_instance<'d>(top: &Section<'_>) -> Result<Option<Instance<'d>>, SceneError> {
    let placement = read_placement(top)?;
    Ok(placement.map(|placement| Instance { group: Group::Scene, placement, outer: None }))
}

/// Whether a change of a key replaces a value of the text, which is read again: a number of the text, or the parameter that places
/// bodies. Other parameters of the table are changed in the machine.
pub(super) fn replaces_text(key: &str) -> bool {
    let is_live = |key: String| find(&key).is_some_and(|row| matches!(row.access, Access::Contact(_)));
    let in_table = |(name, part): (&str, &str)| {
        let of_play = name.ends_with(".play") && is_live(format!("play.{part}"));
        of_play || is_live(format!("contact.{part}"))
    };
    find(key).is_none() && !joint_part(key).is_some_and(in_table) && !is_fixed_in_file(key)
}

/// Whether a key exists in scene files but can never be changed from outside.
pub(super) fn is_fixed_in_file(key: &str) -> bool {
    let mut table: Option<&FileTable> = Some(&FILE);
    let mut fixed = false;
    for part in key.split('.') {
        let Some(row) = table.and_then(|table| table.key(part, None)) else {
            return false;
        };
        (table, fixed) = (row.table(), row.fixed);
    }
    fixed
}

/// Reads everything that is neither a parameter nor part of the mechanism; the rest has its defaults.
fn read_settings(top: &Section<'_>) -> Result<Scene, SceneError> {
    let document = top.document;
    let text = |name: &str| top.get(name).map(|node| node.text()).transpose();
    let stem = document.file.and_then(|file| Path::new(file).file_stem()).and_then(|stem| stem.to_str());
    let name = match top.get("name") {
        Some(node) => node.name()?.into_owned(),
        None => visible_line(stem.unwrap_or("scene")).into_owned(),
    };
    let closed_form = top.get("closed_form").map(|node| read_closed_form(&node.section()?)).transpose()?;
    let mut view = ViewSettings {
        down: SignedAxis::MinusZ,
        floor: None,
        isometric: None,
        time_scale: None,
        plots: [None; MAX_PLOTS],
    };
    let mut watch = "";
    if let Some(node) = top.get("view") {
        let section = node.section()?;
        if let Some(node) = section.get("watch") {
            watch = node.text()?;
        }
        let get = |name: &str| section.get(name).map(|node| node.number()).transpose();
        view.floor = get("floor")?;
        view.time_scale = get("time_scale")?;
        if let Some(plots) = section.get("plots") {
            for (place, plot) in view.plots.iter_mut().zip(plots.entries()?) {
                *place = Some(plot.choice()?);
            }
        }
        view.isometric = match (get("yaw")?, get("pitch")?) {
            (Some(yaw), Some(pitch)) => Some((yaw, pitch)),
            (None, None) => None,
            _ => return Err(section.error("", "yaw and pitch belong together: give both or none")),
        };
    }
    let source = Source {
        title: visible_line(text("title")?.unwrap_or(&name)).into_owned(),
        watch: visible_line(watch).into_owned(),
        description: visible(text("description")?.unwrap_or("").trim()).into_owned(),
        name,
        file: document.file.map(str::to_owned),
        text: document.text.into(),
        ..Source::default()
    };
    Ok(Scene {
        source: source.into(),
        machine: Machine { closed_form, ..Machine::default() }.into(),
        view,
        overrides: Arc::default(),
        changes: Vec::new(),
    })
}

/// Reads every parameter from the file, or takes its default; returns the nodes of those given.
fn read_parameters<'d>(top: &Section<'d>, scene: &mut Scene) -> Result<Places<'d>, SceneError> {
    let mut places = Places::new();
    let mut sections: BTreeMap<&str, Section<'d>> = BTreeMap::new();
    for parameter in table() {
        if let Some((name, _)) = parameter.key.split_once('.')
            && let (Some(node), false) = (top.get(name), sections.contains_key(name))
        {
            sections.insert(name, node.section()?);
        }
    }
    let find_node = |key: &'static str| match key.split_once('.') {
        Some((section, name)) => match sections.get(section) {
            Some(section) => section.get(name),
            None => top.change(section, name),
        },
        None => top.get(key),
    };
    for parameter in table().iter().filter(|parameter| parameter.default != Value::Unset) {
        scene.write(parameter, &default_of(parameter, &sections));
    }
    for parameter in table() {
        let Some(node) = find_node(parameter.key) else {
            continue;
        };
        scene.write(parameter, &node.parameter()?);
        places.insert(parameter.key.to_owned(), node);
    }
    if let (true, Some((key, node))) =
        (places.contains_key(PRESET), SOLVER_KEYS.iter().find_map(|key| places.get_key_value(*key)))
    {
        return Err(node.error(beside_preset(key)));
    }
    Ok(places)
}

fn default_of(parameter: &Parameter, sections: &BTreeMap<&str, Section<'_>>) -> Value {
    // A partly defaulted gravity vector would be surprising: if a section gives one component, the others are 0.
    if parameter.key.starts_with("gravity.") && sections.contains_key("gravity") {
        Value::Number(0.0)
    } else {
        parameter.default.clone()
    }
}

/// Reads bodies, joints, ball joints, fixed shapes, force elements and the output.
fn read_mechanism<'d>(
    files: &[Section<'d>],
    patterns: &'d [Pattern<'d>],
    scene: &mut Scene,
    places: &mut Places<'d>,
) -> Result<(), SceneError> {
    let list = |name: &str| {
        let copies = patterns.iter().map(|pattern| pattern.nodes(name));
        let copies = copies.collect::<Result<Vec<_>, _>>()?;
        lists(files, name, copies.concat())
    };
    let top = &files[0];
    let mut names = Names::default();

    let mut bodies = Vec::new();
    let mut body_sections = Vec::new();
    for node in list("body")? {
        let (body, section) = read_body(&node)?;
        names.add(&section, "body", &body.name)?;
        bodies.push(body);
        body_sections.push(section);
    }
    let file_order: Vec<String> = bodies.iter().map(|body| body.name.clone()).collect();
    let file_places: BTreeMap<&str, usize> =
        file_order.iter().enumerate().map(|(place, name)| (name.as_str(), place)).collect();
    let mut joint_names = Names::default();
    let mut joints: Vec<JointText<'d>> = Vec::new();
    for node in list("joint")? {
        let joint = read_joint(&node, &file_order, &file_places)?;
        joint_names.add(&joint.section, "joint", &joint.name)?;
        if joint.section.document.include.is_none() {
            let title = format!("joint.{}", joint.name);
            Arc::make_mut(&mut scene.source).places.insert(title, joint.section.offset());
        }
        joints.push(joint);
    }
    let tree: Vec<&JointText<'_>> = joints.iter().filter(|text| !text.closes_loop).collect();
    let machine = scene.machine_mut();
    (machine.bodies, machine.joints) = sort_forest(bodies, &tree, &body_sections)?;
    let by_name = indices_by_name(&scene.machine.bodies);
    let gives_speed = places.contains_key("contact.approach_speed");
    let mut add_loose = |scene: &mut Scene, joint: LooseJoint, own: BTreeMap<&'static str, Node<'d>>| {
        Arc::make_mut(&mut scene.overrides).push(own.keys().copied().collect());
        let key = |part| format!("joint.{}.{}", joint.name, own_part(&joint.kind, part));
        places.extend(own.into_iter().map(|(part, node)| (key(part), node)));
        scene.machine_mut().loose_joints.push(joint);
    };
    let (mut displaced, mut dimension_places) = (BTreeMap::new(), Vec::new());
    for text in &joints {
        let sorted = |body: usize| by_name[&file_order[body]];
        let (parent, child) = (text.joint.parent.map(sorted), sorted(text.joint.child));
        let joint = Joint { parent, child, ..text.joint.clone() };
        match &text.play {
            Some(play) => {
                let (loose, own) = loose_joint(&joint, (&text.section, play), scene, gives_speed)?;
                add_loose(scene, loose, own);
                let key = |part| format!("joint.{}.{part}", joint.name);
                dimension_places.extend(dimensions(play).map(|(part, node)| (key(part), node)));
                if !text.closes_loop {
                    displaced.insert(child, play.displaced);
                }
            }
            None if text.closes_loop => scene.machine_mut().closing_joints.push(joint),
            None => {}
        }
    }
    place_cut_bodies(scene.machine_mut(), &displaced);
    for node in list("ball_joint")? {
        let LooseJointText { joint, section, places: own } = read_ball_joint(&node, scene, &by_name)?;
        joint_names.add(&section, "joint", &joint.name)?;
        let title = format!("joint.{}", joint.name);
        if section.document.include.is_none() {
            Arc::make_mut(&mut scene.source).places.insert(title, section.offset());
        }
        add_loose(scene, joint, own);
    }
    places.extend(dimension_places);
    for node in list("fixed_shape")? {
        let shape = read_shape(&node, true)?;
        scene.machine_mut().fixed_shapes.push(shape);
    }
    scene.machine.check_massless().map_err(|(index, why)| {
        let node = body_sections[file_places[scene.machine.bodies[index].name.as_str()]].require("mass");
        let message = format!("only a body between joints may have no mass: {why}; allowed above 0 kg");
        node.map_or_else(|error| error, |node| node.error(message))
    })?;
    read_joint_contacts(top, scene, places)?;
    let joints = scene.machine.kinematic_joints().zip(0..);
    let joints = joints.map(|(joint, index)| (joint.name.clone(), index));
    let joints: BTreeMap<String, usize> = joints.collect();
    for kind in ELEMENTS.iter().copied() {
        for node in list(kind.0.name)? {
            let (element, section) = read_element(&node, kind, scene, &by_name, &joints)?;
            // Joints and elements share one table of column names.
            joint_names.add(&section, "joint or force element", &element.name)?;
            scene.machine_mut().elements.push(element);
        }
    }
    let of_bodies = scene.machine.bodies.iter().map(|body| body.shapes.len());
    let shapes = scene.machine.fixed_shapes.len() + of_bodies.sum::<usize>();
    if shapes > MAX_SHAPES {
        let message = format!("too many shapes: {shapes}; allowed at most {MAX_SHAPES}");
        return Err(top.document.error(0..0, "shapes", None, message));
    }
    if scene.machine.bodies.is_empty() {
        return Err(top.document.error(0..0, "body", None, "a scene needs at least one [[body]]"));
    }
    read_output(top, scene, &file_order)
}

/// Reads every `[[joint_contact]]`: contact parameters of a joint with play in addition to those of its own entry.
fn read_joint_contacts<'d>(top: &Section<'d>, scene: &mut Scene, places: &mut Places<'d>) -> Result<(), SceneError> {
    let mut names = Names::default();
    for node in lists(std::slice::from_ref(top), "joint_contact", Vec::new())? {
        let section = node.section_as(node.title("joint_contact"))?;
        let node = section.require("name")?;
        let name = node.text()?;
        names.add(&section, "[[joint_contact]]", name)?;
        let joints = &mut Arc::make_mut(&mut scene.machine).loose_joints;
        let Some(index) = joints.iter().position(|joint| joint.name == name) else {
            return Err(node.error(no_ball_joint(name, joints)));
        };
        for (part, node) in read_own_contact(&section, &mut joints[index])? {
            scene.add_override(index, part);
            places.insert(scene.joint_key(index, part), node);
        }
    }
    Ok(())
}

/// Index of each body, by name.
fn indices_by_name(bodies: &[Body]) -> BTreeMap<String, usize> {
    let place = |(index, body): (usize, &Body)| (body.name.clone(), index);
    bodies.iter().enumerate().map(place).collect()
}

fn read_output(top: &Section<'_>, scene: &mut Scene, file_order: &[String]) -> Result<(), SceneError> {
    // Default: the last body (the end of a chain, the platform of most files).
    let last = file_order.last().map_or("", String::as_str);
    let section = top.get("output").map(|node| node.section()).transpose()?;
    let node = section.as_ref().and_then(|section| section.get("body"));
    let output_name = node.as_ref().map_or(Ok(last), |node| node.text())?;
    let found = scene.machine.bodies.iter().position(|body| body.name == output_name);
    let names = || scene.machine.bodies.iter().map(|body| body.name.as_str());
    let body = match (found, node) {
        (Some(body), _) => body,
        (None, Some(node)) => return Err(node.error(no_body(output_name, names()))),
        (None, None) => 0,
    };
    let probe = section.and_then(|section| section.get("probe")).map(|node| node.vector()).transpose()?;
    scene.machine_mut().output = Output { body, probe };
    Ok(())
}

/// Names read so far, which must be unique, with their nodes.
#[derive(Default)]
struct Names<'d> {
    places: BTreeMap<String, Node<'d>>,
}

impl<'d> Names<'d> {
    fn add(&mut self, section: &Section<'d>, what: &str, name: &str) -> Result<(), SceneError> {
        let node = section.require("name")?;
        match self.places.insert(name.to_owned(), node.clone()) {
            None => Ok(()),
            Some(first) => Err(node.duplicate_error(&first, what, name)),
        }
    }
}
