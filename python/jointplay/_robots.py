"""Robot descriptions, MJCF and URDF, as scenes (`docs/import.md`): MuJoCo compiles them, this module writes down the compiled model."""

from __future__ import annotations

import argparse
import json
import os
import re
import sys
import tempfile
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Union
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from ._scene import Scene
from .errors import OmissionWarning, OptionError, SceneError

if TYPE_CHECKING:
    import mujoco
else:
    try:
        import mujoco
    except ImportError:
        mujoco = None

_Array = NDArray[np.float64]
_Value = Union[str, bool, float, "_Array", Sequence["_Value"], "dict[str, _Value]"]
_Notes = dict[str, list[str]]

ROUNDING = 1e-14
"""Smaller parts count as 0: of positions, m, of directions, and of products relative to the inertia."""
PLACEHOLDER = 2e-14
"""Mass, kg, and moments, kg m^2, with which MuJoCo accepts a moving link without mass; the scene has 0 in place of it."""
ALL_MESHES = 8 << 20
"""Bytes that the mesh files of a scene may have together."""
SHOWN_GROUPS = 3
"""Geoms of lower groups are those that MuJoCo's viewer shows at first."""


def scene_of(source: str | os.PathLike[str], kind: str | None, folder: str | None = "meshes") -> tuple[Scene, dict[str, bytes]]:
    """The scene of a description, a file or a text with `<`, and its meshes by name of file in `folder`.

    `kind` is the element that the description must have, `robot` or `mujoco`; None allows both.
    """
    if mujoco is None:
        raise OptionError("a robot description needs mujoco: pip install 'jointplay[robots]'")
    is_text = isinstance(source, str) and "<" in source
    path = None if is_text else Path(source)
    label = path.name if path else "description"
    text = str(source) if path is None else path.read_bytes().decode("utf-8-sig", "replace")
    root = re.search(r"<([A-Za-z_][^\s/>]*)", re.sub(r"<!--.*?-->|<[?!].*?>", "", text, flags=re.S))
    if root is None:
        raise _refused(label, None, "is not an XML file: it has no element")
    if root[1] not in ([kind] if kind else ["robot", "mujoco"]):
        allowed = {"robot": "<robot> (URDF)", "mujoco": "<mujoco> (MJCF)", None: "<robot> (URDF) or <mujoco> (MJCF)"}[kind]
        raise _refused(label, None, f"its first element is <{root[1]}>; allowed {allowed}")
    description = Description(label)
    with _warnings_into(description.notes):
        model = _urdf(description, text, path) if root[1] == "robot" else _mjcf(description, text, path)
    writer = Writer(model, description, folder)
    scene_text = writer.text()
    with tempfile.TemporaryDirectory() as scratch:
        for name, content in writer.meshes.items():
            _write(Path(scratch, folder, name), content)
        try:
            return Scene.from_toml(scene_text, folder=scratch), writer.meshes
        except SceneError as error:
            raise _refused(label, None, f"a scene cannot hold this machine: {error}") from error


def warned(scene: Scene) -> Scene:
    """The scene, after a warning about its notes."""
    if scene.notes:
        warnings.warn("\n".join(["parts of the description are not in the scene:", *scene.notes]), OmissionWarning, stacklevel=3)
    return scene


@dataclass
class Description:
    """What is known of a description beside the compiled model."""

    label: str
    """Its name in messages."""
    notes: _Notes = field(default_factory=dict)
    """Names of elements by what the scene does not have of them."""
    massless: set[str] = field(default_factory=set)
    """Links without mass."""
    moments: dict[str, _Array] = field(default_factory=dict)
    """Given principal moments of inertia by name of body, in rising order, kg m^2."""
    is_urdf: bool = False

    def note(self, what: str, element: str) -> None:
        """Notes an element once."""
        found = self.notes.setdefault(what, [])
        if element not in found:
            found.append(element)


def _refused(file: str, line: int | None, message: str) -> SceneError:
    place = file if line is None else f"{file}:{line}"
    return SceneError(f"{place}: {message}", file=file, line=line, column=None, key=None, value=None, allowed=None)


@contextmanager
def _warnings_into(notes: _Notes) -> Iterator[None]:
    """Collects MuJoCo's warnings, which it would print and append to a file in the current folder."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda text: notes.setdefault("MuJoCo", []).append(" ".join(str(text).split())))
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def _compiled(description: Description, spec: mujoco.MjSpec) -> mujoco.MjModel:
    """The compiled model; remembers the given inertias."""
    for body in spec.bodies:
        if body.explicitinertial and body.name not in description.moments:
            xx, yy, zz, xy, xz, yz = np.asarray(body.fullinertia, float)
            full = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            moments = np.sort(body.inertia) if np.isnan(xx) else np.linalg.eigvalsh(full)
            description.moments[body.name] = np.asarray(moments, float)
    return spec.compile()


def _mjcf(description: Description, text: str, path: Path | None) -> mujoco.MjModel:
    try:
        spec = mujoco.MjSpec.from_file(str(path)) if path else mujoco.MjSpec.from_string(text)
        return _compiled(description, spec)
    except ValueError as error:
        raise _fault(description.label, str(error), "<include" in text) from error


def _fault(label: str, message: str, has_includes: bool = False) -> SceneError:
    """MuJoCo's message as one sentence."""
    words = re.sub(r"^(XML )?Error: ", "", " ".join(message.split()))
    syntax = re.match(r"XML parse error \d+: Error=XML_(?:ERROR_)?(\w+)", words)
    found = re.search(r"line(?: number=)? ?(\d+)", words, re.I)
    line = int(found[1]) if found and int(found[1]) else None
    if syntax:
        words = f"is not an XML file: {syntax[1].lower().replace('_', ' ')}"
    words = re.sub(r",? line \d+$", "", words)
    if has_includes and line and not syntax:
        # MuJoCo does not say in which file.
        return _refused(label, None, f"{words}, line {line} of this file or of one that it includes")
    return _refused(label, line, words)


def _urdf(description: Description, text: str, path: Path | None) -> mujoco.MjModel:
    """Compiles a URDF whose meshes are found, links without mass allowed, and impossible inertias balanced."""
    label = description.label
    description.is_urdf = True
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise _refused(label, error.position[0], f"is not an XML file: {str(error).split(':')[0]}") from error
    for element in root.iter():
        if isinstance(element.tag, str) and "xacro" in element.tag:
            raise _refused(label, None, f"<xacro:{element.tag.split('}')[-1]}> is a macro: expand the file first (`xacro FILE`)")
    for transmission in root.findall("transmission"):
        description.note("omitted: transmission", transmission.get("name", "without a name"))
    for joint in root.findall("joint"):
        for mimic in joint.findall("mimic"):
            description.note("omitted: mimic of joint", joint.get("name", ""))
            joint.remove(mimic)
    assets: dict[str, bytes] = {}
    for link in root.findall("link"):
        _mass_of_link(description, link)
        for kind in ("visual", "collision"):
            for shape in link.findall(kind):
                # Names of shapes serve nothing here, and MuJoCo complains about equal ones.
                shape.attrib.pop("name", None)
                mesh = shape.find("geometry/mesh")
                if mesh is not None and not _find_mesh(mesh, path, assets):
                    description.note("not drawn: mesh that is missing, or neither STL nor OBJ", mesh.get("filename", ""))
                    link.remove(shape)
    settings = root.find("mujoco")
    settings = ElementTree.SubElement(root, "mujoco") if settings is None else settings
    compiler = settings.find("compiler")
    compiler = ElementTree.SubElement(settings, "compiler") if compiler is None else compiler
    compiler.attrib.pop("meshdir", None)
    compiler.attrib |= {"balanceinertia": "true", "discardvisual": "false", "fusestatic": "false", "strippath": "true"}
    while True:
        try:
            return _compiled(description, mujoco.MjSpec.from_string(ElementTree.tostring(root, "unicode"), assets=assets))
        except ValueError as error:
            # A mesh that MuJoCo refuses, such as one without volume, is missing only in the picture.
            faulty = [(link, shape) for link in root.iter("link") for shape in link.findall("visual") if _uses(shape, str(error))]
            for link, shape in faulty:
                name = shape.find("geometry/mesh").get("source", "")  # type: ignore[union-attr]
                description.note("not drawn: mesh that MuJoCo refuses", name)
                link.remove(shape)
            if not faulty:
                raise _fault(label, str(error)) from error


def _uses(shape: ElementTree.Element, message: str) -> bool:
    mesh = shape.find("geometry/mesh")
    return mesh is not None and re.search(rf"\b{Path(mesh.get('filename', '')).stem}\b", message) is not None


def _mass_of_link(description: Description, link: ElementTree.Element) -> None:
    """Gives a link without mass a placeholder, and one with an impossible inertia the mean moment, as `balanceinertia` does."""
    name = link.get("name", "")

    def number(element: ElementTree.Element | None, key: str) -> float:
        given = "0" if element is None else element.get(key, "0")
        try:
            return float(given)
        except ValueError:
            raise _refused(description.label, None, f'link {name}: {key} = "{given}" is not a number') from None

    inertial = link.find("inertial")
    mass = 0.0 if inertial is None else number(inertial.find("mass"), "value")
    collisions = link.findall("collision")
    if collisions:
        description.note("omitted: contact of the geoms of body", name)
    if inertial is None and collisions:
        description.note("mass from collision shapes of 1000 kg/m^3: link without <inertial>", name)
        return
    for collision in collisions:
        link.remove(collision)
    if mass <= 0.0 or inertial is None:
        description.massless.add(name)
        for old in link.findall("inertial"):
            link.remove(old)
        inertial = ElementTree.SubElement(link, "inertial")
        ElementTree.SubElement(inertial, "mass", value=repr(PLACEHOLDER))
        moments = dict.fromkeys(("ixx", "iyy", "izz"), repr(PLACEHOLDER)) | dict.fromkeys(("ixy", "ixz", "iyz"), "0")
        ElementTree.SubElement(inertial, "inertia", moments)
        return
    inertia = inertial.find("inertia")
    if inertia is None:
        return
    xx, yy, zz, xy, xz, yz = (number(inertia, key) for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"))
    principal = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if principal[0] < PLACEHOLDER:
        # MuJoCo balances only moments above 1e-14 kg m^2.
        description.moments[name] = principal
        mean = repr(max(float(principal.mean()), PLACEHOLDER))
        inertia.attrib |= dict.fromkeys(("ixx", "iyy", "izz"), mean) | dict.fromkeys(("ixy", "ixz", "iyz"), "0")


def _find_mesh(mesh: ElementTree.Element, path: Path | None, assets: dict[str, bytes]) -> bool:
    """Replaces the file of a mesh, which packages resolve, by one in `assets` with a name of its own; False without one to read.

    MuJoCo would take files of the same name in different folders for one mesh.
    """
    given = mesh.get("filename", "")
    parts = Path(re.sub(r"^\w+://", "", given)).parts
    tails = [Path(*parts[n:]) for n in range(len(parts))]
    folders = (path or Path("description")).resolve().parents
    found = next((folder / tail for tail in tails for folder in folders if (folder / tail).is_file()), None)
    if found is None or found.suffix.lower() not in (".stl", ".obj"):
        return False
    content = found.read_bytes()
    name = next((name for name, known in assets.items() if known == content), None)
    if name is None:
        name = f"mesh-{len(assets)}-{re.sub('[^A-Za-z0-9_-]', '_', found.stem)}{found.suffix.lower()}"
        assets[name] = content
    mesh.attrib |= {"filename": name, "source": given}
    return True


class Names:
    """Names of a scene, unique in their kind."""

    def __init__(self, description: Description) -> None:
        self.description = description
        self.taken = {"world"}

    def take(self, wanted: str, is_given: bool = True) -> str:
        """A free name, as close as possible to `wanted`."""
        base = re.sub(r"[^A-Za-z0-9_-]", "_", wanted)[:40] or "part"
        name, number = base, 2
        while name in self.taken:
            name, number = f"{base[: 39 - len(str(number))]}_{number}", number + 1
        self.taken.add(name)
        if is_given and name != wanted:
            self.description.note("renamed", f"{wanted} is {name}")
        return name


def _number(value: float) -> str:
    return repr(float(value) + 0.0)


def _quantity(value: float | _Array, unit: str) -> str:
    return " ".join([*(_number(part) for part in np.ravel(value)), unit])


def _exact(value: _Array) -> _Array:
    """Without rounding errors of turned coordinates."""
    return np.where(np.abs(value) < ROUNDING, 0.0, value)


def _toml(value: _Value) -> str:
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(part)}" for key, part in value.items()) + " }"
    if isinstance(value, (list, np.ndarray)):
        is_table = len(value) > 0 and isinstance(value[0], dict)
        inside = [_toml(part) for part in value]
        return "[\n    " + ",\n    ".join(inside) + ",\n]" if is_table else "[" + ", ".join(inside) + "]"
    return _number(float(value))  # type: ignore[arg-type]


class Pose:
    """Position, m, and rotation of a frame."""

    def __init__(self, position: _Array | None = None, quaternion: _Array | None = None) -> None:
        self.position = np.zeros(3) if position is None else np.array(position, float)
        self.quaternion = np.array([1.0, 0.0, 0.0, 0.0]) if quaternion is None else np.array(quaternion, float)
        self.matrix = np.zeros(9)
        mujoco.mju_quat2Mat(self.matrix, self.quaternion)
        self.matrix = self.matrix.reshape(3, 3)

    def __matmul__(self, inner: Pose) -> Pose:
        quaternion = np.zeros(4)
        mujoco.mju_mulQuat(quaternion, self.quaternion, inner.quaternion)
        return Pose(self.point(inner.position), quaternion)

    def inverse(self) -> Pose:
        """The pose of the outer frame in this one."""
        return Pose(-self.matrix.T @ self.position, self.quaternion * (1.0, -1.0, -1.0, -1.0))

    def point(self, point: _Array) -> _Array:
        """A point of this frame in the outer one."""
        return self.position + self.matrix @ point

    def rotation(self, key: str = "rotation") -> dict[str, _Value]:
        """`rotation` of a scene, unless there is none."""
        small = np.abs(self.quaternion[1:]).max() < ROUNDING
        return {} if small else {key: {"quaternion": _exact(self.quaternion)}}


class Writer:
    """Writes a compiled model as a scene."""

    def __init__(self, model: mujoco.MjModel, description: Description, folder: str | None) -> None:
        self.model, self.description, self.folder = model, description, folder
        self.note = description.note
        self.meshes: dict[str, bytes] = {}
        self.lines: list[str] = []
        bodies, joints = Names(description), Names(description)
        self.joint_names = joints
        raw = [self.raw(mujoco.mjtObj.mjOBJ_BODY, b, "body") for b in range(model.nbody)]
        self.mass = np.where([name in description.massless for name in raw], 0.0, model.body_mass)
        # Bodies without joints are parts of those that carry them.
        self.owner, self.place = [0], [Pose()]
        for b in range(1, model.nbody):
            inside = self.place[model.body_parentid[b]] @ Pose(model.body_pos[b], model.body_quat[b])
            is_own = model.body_jntnum[b] > 0
            self.owner.append(b if is_own else self.owner[model.body_parentid[b]])
            self.place.append(Pose() if is_own else inside)
            if not is_own and self.owner[b] and model.names[model.name_bodyadr[b]]:
                self.note(f"part of {raw[self.owner[b]]}", raw[b])
            if model.body_mocapid[b] >= 0:
                self.note("omitted: motion by mocap of body", raw[b])
        # Without mass there is no motion to compute.
        carried = self.mass.copy()
        for b in range(model.nbody - 1, 0, -1):
            carried[model.body_parentid[b]] += carried[b]
        self.moving = [b for b in range(1, model.nbody) if self.owner[b] == b and self._has_mass(b, carried)]
        if not self.moving:
            raise _refused(description.label, None, "no body with mass has a joint")
        self.raw_bodies = raw
        self.bodies = {0: "world"} | {b: bodies.take(raw[b], not raw[b].startswith("body ")) for b in self.moving}
        self.take_body = bodies.take
        disabled = mujoco.mjtDisableBit
        self.is_on = {
            word: not model.opt.disableflags & getattr(disabled, f"mjDSBL_{word}")
            for word in ("GRAVITY", "SPRING", "DAMPER", "EQUALITY", "CONSTRAINT", "CONTACT", "LIMIT", "FRICTIONLOSS")
        }

    def _has_mass(self, b: int, carried: _Array) -> bool:
        if carried[b] == 0.0:
            self.note("omitted: link without mass at the end of a chain", self.raw(mujoco.mjtObj.mjOBJ_BODY, b, "body"))
        return bool(carried[b] > 0.0)

    def raw(self, kind: mujoco.mjtObj, index: int, word: str) -> str:
        """Name in the description; else its number."""
        return mujoco.mj_id2name(self.model, kind, index) or f"{word} {index}"

    def section(self, title: str, keys: dict[str, _Value]) -> None:
        """Writes a section."""
        self.lines += ["", f"[[{title}]]", *(f"{key} = {_toml(value)}" for key, value in keys.items())]

    def text(self) -> str:
        """The scene file."""
        model, description = self.model, self.description
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        for b in self.moving:
            self.body(b)
        for shape in self.shapes(0):
            self.section("fixed_shape", shape)
        loops: list[dict[str, _Value]] = []
        for b in self.moving:
            loops += self.carry(b, data)
        for loop in loops:
            self.section("ball_joint", loop)
        is_closed = [self.equality(e) for e in range(model.neq)]
        self.omissions()
        name = re.sub(r"[^A-Za-z0-9_-]", "_", self.model.names.split(b"\0")[0].decode())[:40]
        name = Path(description.label).stem if name in ("", "MuJoCo_Model") else name
        head = [f"From {description.label} by MuJoCo {mujoco.__version__}."]
        notes = [f"{what}: {', '.join(elements)}" for what, elements in description.notes.items()]
        gravity = model.opt.gravity if self.is_on["GRAVITY"] else np.zeros(3)
        setup = [
            "",
            f"name = {_toml(Names(description).take(name, False))}",
            f'start = "{"ideal" if loops or any(is_closed) else "as-given"}"',
            "",
            "[gravity]",
            *(f'{axis} = "{_quantity(part, "m/s^2")}"' for axis, part in zip("xyz", gravity, strict=True)),
            "",
            "[contact]",
            "# A description has no play; a clearance above 0 gives it to every ball joint.",
            'clearance = "0 mm"',
        ]
        return "\n".join([*(f"# {_visible(line)}" for line in head + notes), *setup, *self.lines]) + "\n"

    def body(self, b: int) -> None:
        """A body with the mass of its parts."""
        model, note = self.model, self.note
        parts = [part for part in range(b, model.nbody) if self.owner[part] == b and self.mass[part] > 0.0]
        masses = self.mass[parts]
        frames = [self.place[part] @ Pose(model.body_ipos[part], model.body_iquat[part]) for part in parts]
        mass = float(masses.sum())
        centre = sum((m * frame.position for m, frame in zip(masses, frames, strict=True)), np.zeros(3)) / (mass or 1.0)
        inertia = np.zeros((3, 3))
        for part, frame in zip(parts, frames, strict=True):
            own, arm = frame.matrix @ np.diag(model.body_inertia[part]) @ frame.matrix.T, frame.position - centre
            inertia += own + self.mass[part] * (arm @ arm * np.eye(3) - np.outer(arm, arm))
            given = self.description.moments.get(self.raw_bodies[part])
            compiled = np.sort(model.body_inertia[part])
            if given is not None and not np.allclose(compiled * given[2], given * compiled[2], rtol=1e-6, atol=0.0):
                change = " ".join(f"{m:.4g}" for m in given) + " to " + " ".join(f"{m:.4g}" for m in compiled) + " kg m^2"
                note("altered: moments of inertia, balanceinertia", f"{self.raw_bodies[part]} ({change})")
        keys: dict[str, _Value] = {
            "name": self.bodies[b],
            "mass": _quantity(mass, "kg"),
            "centre": _quantity(_exact(centre), "m"),
            "inertia": _quantity(np.diag(inertia), "kg m^2"),
        }
        products = -inertia[[0, 0, 1], [1, 2, 2]]
        products[np.abs(products) < ROUNDING * inertia.max()] = 0.0
        if products.any():
            keys["products"] = _quantity(products, "kg m^2")
        shapes = self.shapes(b)
        self.section("body", keys | ({"shapes": shapes} if shapes else {}))

    def shapes(self, owner: int) -> list[_Value]:
        """Shapes of a body and its parts; of the world, those that stand still."""
        model, forms, found = self.model, mujoco.mjtGeom, []
        for g in range(model.ngeom):
            group, b = model.geom_group[g], model.geom_bodyid[g]
            default = np.array([0.5, 0.5, 0.5, 1.0], np.float32)
            material = model.geom_matid[g]
            rgba = model.mat_rgba[material] if material >= 0 and (model.geom_rgba[g] == default).all() else model.geom_rgba[g]
            is_shown = group == 1 if self.description.is_urdf else group < SHOWN_GROUPS
            if self.owner[b] != owner or rgba[3] == 0.0 or not is_shown:
                continue
            pose, size, form = self.place[b] @ Pose(model.geom_pos[g], model.geom_quat[g]), model.geom_size[g], forms(int(model.geom_type[g]))
            shape: dict[str, _Value] = {}
            if form == forms.mjGEOM_SPHERE:
                shape = {"form": "sphere", "centre": _quantity(_exact(pose.position), "m"), "radius": _quantity(size[0], "m")}
            elif form in (forms.mjGEOM_CAPSULE, forms.mjGEOM_CYLINDER):
                ends = [_quantity(_exact(pose.point(np.array([0.0, 0.0, z]))), "m") for z in (-size[1], size[1])]
                word = "capsule" if form == forms.mjGEOM_CAPSULE else "cylinder"
                shape = {"form": word, "from": ends[0], "to": ends[1], "radius": _quantity(size[0], "m")}
            elif form == forms.mjGEOM_BOX and not pose.rotation():
                shape = {"form": "box", "centre": _quantity(_exact(pose.position), "m"), "size": _quantity(2.0 * size, "m")}
            elif form == forms.mjGEOM_BOX:
                # A turned box is a thick plate.
                signs = ((-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.0))
                corners = [_quantity(_exact(pose.point(size * sign)), "m") for sign in signs]
                shape = {"form": "plate", "corners": corners, "thickness": _quantity(2.0 * size[2], "m")}
            elif form == forms.mjGEOM_MESH and self.folder and (file := self.mesh(int(model.geom_dataid[g]))):
                place = {"position": _quantity(_exact(pose.position), "m")} | pose.rotation()
                shape = {"form": "mesh", "file": file, "unit": "m"} | place
            if shape:
                colour = "#" + "".join(f"{round(255 * min(max(float(part), 0.0), 1.0)):02x}" for part in rgba[:3])
                found.append(shape | {"colour": colour})
            elif form == forms.mjGEOM_MESH and not self.folder:
                self.note("not drawn without --out or --meshes: mesh", self.raw(mujoco.mjtObj.mjOBJ_MESH, model.geom_dataid[g], "mesh"))
            elif form != forms.mjGEOM_MESH:
                word = form.name[7:].lower()
                self.note(f"not drawn: {word}", self.raw(mujoco.mjtObj.mjOBJ_GEOM, g, f"geom of {self.raw_bodies[b]}, number"))
        return found

    def allowed_triangles(self) -> int:
        """Triangles of a mesh up to which all meshes together are within the limit."""
        left, counts = (ALL_MESHES - 84 * self.model.nmesh) // 50, sorted(map(int, self.model.mesh_facenum))
        for n, count in enumerate(counts):
            share = left // (len(counts) - n)
            if count > share:
                return share
            left -= count
        return ALL_MESHES

    def mesh(self, k: int) -> str | None:
        """File of a mesh, coarser where all of them would be too large; None if no triangle is left."""
        model = self.model
        name = re.sub(r"[^A-Za-z0-9_-]", "_", self.raw(mujoco.mjtObj.mjOBJ_MESH, k, "mesh"))
        if f"{name}.stl" in self.meshes:
            return f"{self.folder}/{name}.stl"
        corners = model.mesh_vert[model.mesh_vertadr[k] :][: model.mesh_vertnum[k]]
        faces = model.mesh_face[model.mesh_faceadr[k] :][: model.mesh_facenum[k]]
        allowed, cells = self.allowed_triangles(), 512.0
        low, extent = corners.min(0), float(np.ptp(corners, 0).max()) or 1.0
        while len(faces) > allowed:
            # Corners in one cell of a grid become one.
            self.note("drawn coarser: mesh", name)
            grid = np.floor((corners - low) * (cells / extent)).astype(np.int64)
            _, first, inverse = np.unique(grid, axis=0, return_index=True, return_inverse=True)
            corners, faces, cells = corners[first], inverse.reshape(-1)[faces], cells / 2.0
            faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
        rows = np.zeros(len(faces), dtype=[("normal", "<3f4"), ("corners", "<9f4"), ("unused", "<u2")])
        rows["corners"] = corners[faces].reshape(-1, 9)
        if not len(faces):
            return None
        self.meshes[f"{name}.stl"] = bytes(80) + len(faces).to_bytes(4, "little") + rows.tobytes()
        return f"{self.folder}/{name}.stl"

    def carry(self, b: int, data: mujoco.MjData) -> list[dict[str, _Value]]:
        """Writes the joint that carries a body, or the chain of joints; returns the ball joint that is to follow."""
        model, kinds = self.model, mujoco.mjtJoint
        parent, child = self.owner[model.body_parentid[b]], self.bodies[b]
        before, carrier = self.place[model.body_parentid[b]] @ Pose(model.body_pos[b], model.body_quat[b]), self.bodies[parent]
        joints = range(model.body_jntadr[b], model.body_jntadr[b] + model.body_jntnum[b])
        for n, j in enumerate(joints):
            kind, at, label = kinds(int(model.jnt_type[j])), model.jnt_pos[j], self.raw(mujoco.mjtObj.mjOBJ_JOINT, j, "joint")
            name = self.joint_names.take(label, not label.startswith("joint "))
            if kind in (kinds.mjJNT_FREE, kinds.mjJNT_BALL):
                is_ball = kind == kinds.mjJNT_BALL
                if len(joints) > 1:
                    raise _refused(self.description.label, None, f"body {self.raw_bodies[b]}: a ball joint is the only joint of its "
                                   "body in a scene: give each joint a body of its own")
                here = Pose(data.xpos[b], data.xquat[b])
                start: dict[str, _Value] = {"position": _quantity(_exact(here.point(at)), "m")} | here.rotation()
                free = self.joint_names.take(f"{name}_free", False) if is_ball else name
                point = {"child_point": _quantity(at, "m")} if at.any() else {}
                self.section("joint", {"name": free, "kind": "free", "child": child} | point | {"start": start})
                self.bushing(j, name, carrier if is_ball else "world", before.point(at), child, at, before)
                if is_ball:
                    ends = [{"body": carrier, "at": _quantity(_exact(before.point(at)), "m")}, {"body": child, "at": _quantity(at, "m")}]
                    return [{"name": name, "socket": ends[0], "ball": ends[1]}]
                continue
            to = child
            if n < len(joints) - 1:
                to = self.take_body(name, False)
                self.section("body", {"name": to, "mass": "0 kg", "inertia": "0 0 0 kg m^2"})
            keys: dict[str, _Value] = {"name": name, "kind": "revolute" if kind == kinds.mjJNT_HINGE else "prismatic"}
            keys |= {} if carrier == "world" else {"parent": carrier}
            keys |= {"child": to, "axis": _exact(before.matrix @ model.jnt_axis[j])}
            keys |= {"parent_point": _quantity(_exact(before.point(at)), "m"), "child_point": _quantity(_exact(at), "m")}
            self.section("joint", keys | before.rotation())
            self.spring(j, name, label)
            before, carrier = Pose(), to
        return []

    def stiffness(self, j: int, label: str) -> tuple[float, float]:
        """Linear stiffness and damping of a joint; notes what else there is."""
        model, dof = self.model, self.model.jnt_dofadr[j]
        found = []
        for what, words, values, row in (
            ("stiffness", ("jnt_stiffness", "jnt_stiffnesspoly", "jnt_springyield"), "SPRING", j),
            ("damping", ("dof_damping", "dof_dampingpoly"), "DAMPER", dof),
        ):
            # Some versions have the higher powers in the same array, some in one of their own.
            parts = np.concatenate([np.ravel(getattr(model, word)[row]) for word in words if hasattr(model, word)])
            if self.is_on[values] and parts[1:].any():
                self.note(f"omitted: higher powers or yield of {what} of joint", label)
            found.append(float(parts[0]) if self.is_on[values] else 0.0)
        return found[0], found[1]

    def spring(self, j: int, name: str, label: str) -> None:
        """Spring and damper of a hinge or slide."""
        model = self.model
        stiffness, damping = self.stiffness(j, label)
        if not stiffness and not damping:
            return
        unit, force = ("rad", "N m") if int(model.jnt_type[j]) == mujoco.mjtJoint.mjJNT_HINGE else ("m", "N")
        rest = model.qpos_spring[model.jnt_qposadr[j]] - model.qpos0[model.jnt_qposadr[j]]
        keys: dict[str, _Value] = {"name": self.joint_names.take(f"{name}_spring", False), "joint": name}
        keys |= {"position": _quantity(rest, unit)} if rest and stiffness else {}
        keys |= {"stiffness": _quantity(stiffness, f"{force}/{unit}"), "damping": _quantity(damping, f"{force} s/{unit}")}
        self.section("joint_spring", keys)

    def bushing(self, j: int, name: str, carrier: str, at: _Array, child: str, there: _Array, rest: Pose) -> None:
        """Spring and damper of a ball joint, or of a free body in the world, which act alike in all directions."""
        model = self.model
        stiffness, damping = self.stiffness(j, name)
        if not stiffness and not damping:
            return
        keys: dict[str, _Value] = {"name": self.joint_names.take(f"{name}_spring", False)}
        if int(model.jnt_type[j]) == mujoco.mjtJoint.mjJNT_FREE:
            spring = model.qpos_spring[model.jnt_qposadr[j] :][:7]
            at, rest = spring[:3], Pose(spring[:3], spring[3:])
            keys |= {"stiffness": _quantity(np.full(3, stiffness), "N/m"), "damping": _quantity(np.full(3, damping), "N s/m")}
        ends = ({"body": body, "at": _quantity(_exact(point), "m")} for body, point in ((carrier, at), (child, there)))
        keys |= dict(zip(("from", "to"), ends, strict=True)) | rest.rotation()
        keys["turning_stiffness"] = _quantity(np.full(3, stiffness), "N m/rad")
        self.section("bushing", keys | {"turning_damping": _quantity(np.full(3, damping), "N m s/rad")})

    def equality(self, e: int) -> bool:
        """Writes a connection or a weld as a joint that closes a loop; whether it did."""
        model, kinds = self.model, mujoco.mjtEq
        kind, data = kinds(int(model.eq_type[e])), model.eq_data[e]
        word = kind.name[5:].lower()
        one, two = int(model.eq_obj1id[e]), int(model.eq_obj2id[e])
        label = self.raw(mujoco.mjtObj.mjOBJ_EQUALITY, e, word)
        is_active = model.eq_active0[e] and self.is_on["EQUALITY"] and self.is_on["CONSTRAINT"]
        if kind not in (kinds.mjEQ_CONNECT, kinds.mjEQ_WELD) or not is_active:
            self.note(f"omitted: {'' if is_active else 'inactive '}equality of kind {word}", label)
            return False
        if int(model.eq_objtype[e]) == mujoco.mjtObj.mjOBJ_SITE:
            frames = [Pose(model.site_pos[site], model.site_quat[site]) for site in (one, two)]
            one, two = int(model.site_bodyid[one]), int(model.site_bodyid[two])
        elif kind == kinds.mjEQ_CONNECT:
            frames = [Pose(data[:3]), Pose(data[3:6])]
        else:
            frames = [Pose(data[3:6], data[6:10]), Pose(data[:3])]
        ends = [(self.owner[b], self.place[b] @ frame) for b, frame in zip((one, two), frames, strict=True)]
        if ends[0][0] == ends[1][0] or any(owner not in self.bodies for owner, _ in ends):
            self.note("omitted: equality within one body, or of one that is omitted", label)
            return False
        self.note("rigid here, elastic in MuJoCo: equality", label)
        name = self.joint_names.take(label, not label.startswith(f"{word} "))
        if kind == kinds.mjEQ_CONNECT or data[10] == 0.0:
            points = [{"body": self.bodies[owner], "at": _quantity(_exact(frame.position), "m")} for owner, frame in ends]
            self.section("ball_joint", {"name": name, "socket": points[0], "ball": points[1]})
            return True
        # The world can only be the parent.
        (parent, outer), (child, inner) = ends if ends[1][0] else ends[::-1]
        keys: dict[str, _Value] = {"name": name, "kind": "fixed"} | ({"parent": self.bodies[parent]} if parent else {})
        keys |= {"child": self.bodies[child], "parent_point": _quantity(_exact(outer.position), "m")}
        keys |= {"child_point": _quantity(_exact(inner.position), "m")}
        self.section("joint", keys | (outer @ inner.inverse()).rotation() | {"closes_loop": True})
        return True

    def omissions(self) -> None:
        """Notes the parts of the model that a scene does not have, and writes the loads that hold bodies against gravity."""
        model, objects, note, is_on = self.model, mujoco.mjtObj, self.note, self.is_on
        if model.nflex:
            names = ", ".join(self.raw(objects.mjOBJ_FLEX, k, "flex") for k in range(model.nflex))
            raise _refused(self.description.label, None, f"flex {names}: the bodies of a scene are rigid")
        for j in range(model.njnt):
            dofs = slice(model.jnt_dofadr[j], model.jnt_dofadr[j] + (6, 3, 1, 1)[model.jnt_type[j]])
            label = self.raw(objects.mjOBJ_JOINT, j, "joint")
            for what, is_there in (
                ("range", model.jnt_limited[j] and is_on["LIMIT"]),
                ("armature", model.dof_armature[dofs].any()),
                ("friction", model.dof_frictionloss[dofs].any() and is_on["FRICTIONLOSS"]),
            ):
                if is_there:
                    note(f"omitted: {what} of joint", label)
        for what, kind, count in (
            ("actuator", objects.mjOBJ_ACTUATOR, len(model.actuator_trntype)),
            ("tendon", objects.mjOBJ_TENDON, model.ntendon),
            ("keyframe", objects.mjOBJ_KEY, model.nkey),
            ("plugin", objects.mjOBJ_PLUGIN, model.nplugin),
        ):
            for k in range(count):
                note(f"omitted: {what}", self.raw(kind, k, what))
        touching = [g for g in range(model.ngeom) if model.geom_contype[g] or model.geom_conaffinity[g]]
        for g in touching if is_on["CONTACT"] and len(touching) > 1 else []:
            note("omitted: contact of the geoms of body", self.raw_bodies[model.geom_bodyid[g]])
        for word in ("density", "viscosity", "wind"):
            if np.any(getattr(model.opt, word)):
                note("omitted: resistance of the medium", word)
        for b in range(1, model.nbody):
            if model.body_gravcomp[b] and self.owner[b] in self.bodies and self.owner[b] and is_on["GRAVITY"]:
                at = (self.place[b] @ Pose(model.body_ipos[b])).position
                force = -model.body_gravcomp[b] * self.mass[b] * model.opt.gravity
                name = self.joint_names.take(f"{self.raw_bodies[b]}_gravcomp", False)
                on: dict[str, _Value] = {"body": self.bodies[self.owner[b]], "at": _quantity(_exact(at), "m")}
                self.section("load", {"name": name, "on": on, "force": _quantity(force, "N")})


def _visible(line: str) -> str:
    """Without characters that could end a comment."""
    return "".join(c if c.isprintable() else " " for c in line)


def _write(path: Path, content: bytes) -> None:
    """Writes a file, which appears whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}-", delete=False) as file:
        file.write(content)
    os.chmod(file.name, 0o644)
    os.replace(file.name, path)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of `import`."""
    parser.add_argument("file", type=Path, help="the description, whose first element is <robot> (URDF) or <mujoco> (MJCF)")
    parser.add_argument("--out", type=Path, metavar="SCENE", help="file of the scene, by default standard output; meshes go into a "
                        "folder beside it")
    parser.add_argument("--meshes", type=Path, metavar="FOLDER", help="folder of the meshes, beside the scene; by default the scene's "
                        "name and -meshes; without it and --out there are no meshes")
    parser.add_argument("--force", action="store_true", help="replace existing files")


def main(arguments: argparse.Namespace) -> None:
    """Runs `import`."""
    out: Path | None = arguments.out
    folder: Path | None = arguments.meshes or (out and out.with_name(f"{out.stem}-meshes"))
    if out and folder and folder.resolve().parent != out.resolve().parent:
        raise OptionError(f"--meshes {folder}: a scene finds its meshes only in a folder beside it, in {out.resolve().parent}")
    scene, meshes = scene_of(arguments.file, None, folder and folder.resolve().name)
    files = {folder / name: content for name, content in meshes.items()} if folder else {}
    files |= {out: scene.toml.encode()} if out else {}
    existing = [str(path) for path in files if path.exists()]
    if existing and not arguments.force:
        raise OptionError(f"{existing[0]} exists already; --force replaces it")
    for path, content in files.items():
        _write(path, content)
    if not out:
        sys.stdout.write(scene.toml)
    for note in scene.notes:
        print(note, file=sys.stderr)
