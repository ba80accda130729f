"""Robot descriptions, MJCF and URDF, as scenes (`docs/import.md`): MuJoCo compiles them, this module writes the model down."""

from __future__ import annotations

import json
import os
import re
import tempfile
import warnings
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any, cast
from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._options import write
from .errors import OptionError, SceneError

try:
    # It has no types.
    mujoco: Any = import_module("mujoco")
except ImportError:
    mujoco = None

_Array = NDArray[np.float64]
_Keys = dict[str, object]

ROUNDING = 1e-14
"""Smaller parts count as 0: of positions, m, of directions, and of products relative to the inertia."""
PLACEHOLDER = 2e-14
"""Mass, kg, and moments, kg m^2, that MuJoCo just accepts: for moving links without mass, which have 0 in the scene."""
ALL_MESHES = 8 << 20
"""Bytes that the mesh files of a scene may have together."""
MAX_BYTES = 64 << 20
"""Largest description, bytes."""
FORMATS = {"mujoco": "<mujoco> (MJCF)", "robot": "<robot> (URDF)"}
"""Formats by their first element."""


@dataclass
class Description:
    """What is known of a description beside its compiled model."""

    label: str
    """Its name in messages."""
    is_urdf: bool = False
    """Whether it is a URDF."""
    notes: dict[str, list[str]] = field(default_factory=dict[str, list[str]])
    """Names of elements by what the scene does not have of them."""
    massless: set[str] = field(default_factory=set[str])
    """Links without mass."""
    moments: dict[str, _Array] = field(default_factory=dict[str, _Array])
    """Given principal moments of inertia by name of body, in rising order, kg m^2."""

    def note(self, what: str, element: str) -> None:
        """Notes an element, once."""
        found = self.notes.setdefault(what, [])
        if element not in found:
            found.append(element)

    def refused(self, message: str, line: int | None = None) -> SceneError:
        """The error that names the file, and the line if it is known."""
        place = self.label if line is None else f"{self.label}:{line}"
        return SceneError(f"{place}: {message}", file=self.label, line=line, column=None, key=None, value=None, allowed=None)


def scene_of(source: str | os.PathLike[str], kind: str | None, folder: str | None = "meshes") -> tuple[_native.Scene, dict[str, bytes]]:
    """The scene of a description, a file or a text with `<`; and its meshes, as files of `folder`, without which there are none.

    `kind` is the first element that the description must have; None allows all.
    """
    if mujoco is None:
        raise OptionError("a robot description needs mujoco: pip install 'jointplay[robots]'")
    path = None if isinstance(source, str) and "<" in source else Path(source)
    description = Description(path.name if path else "description")
    if path and path.exists() and not (path.is_file() and path.stat().st_size <= MAX_BYTES):
        raise description.refused(f"is not a file of at most {MAX_BYTES >> 20} MiB")
    text = str(source) if path is None else path.read_bytes().decode("utf-8-sig", "replace")
    root = re.search(r"<([A-Za-z_][^\s/>]*)", re.sub(r"<!--.*?-->|<[?!].*?>", "", text, flags=re.DOTALL))
    if root is None:
        raise description.refused("is not an XML file: it has no element")
    if root[1] not in ([kind] if kind else FORMATS):
        allowed = FORMATS[kind] if kind else " or ".join(FORMATS.values())
        raise description.refused(f"its first element is <{root[1]}>; allowed {allowed}")
    with _warnings_into(description):
        model = _urdf(description, text, path) if root[1] == "robot" else _mjcf(description, text, path)
    writer = Writer(model, description, folder)
    scene_text = writer.text()
    with tempfile.TemporaryDirectory() as scratch:
        for name, content in writer.meshes.items():
            write(Path(scratch, str(folder), name), content)
        try:
            return _native.Scene.parse(scene_text, None, Path(scratch)), writer.meshes
        except SceneError as error:
            # The lines of the scene mean nothing to who has none.
            message = re.sub(r"^line \d+, column \d+: ", "", str(error).splitlines()[0])
            raise description.refused(f"a scene cannot hold this machine: {message}") from error


@contextmanager
def _warnings_into(description: Description) -> Generator[None]:
    """Notes MuJoCo's warnings, which it would print and append to a file in the current folder."""

    def note(text: object) -> None:
        description.note("MuJoCo", " ".join(str(text).split()))

    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(note)
    try:
        with warnings.catch_warnings(record=True) as found:
            warnings.simplefilter("always")
            yield
        for one in found:
            note(one.message)
    finally:
        mujoco.set_mju_user_warning(before)


def _mjcf(description: Description, text: str, path: Path | None) -> Any:
    try:
        return _compiled(description, mujoco.MjSpec.from_file(str(path)) if path else mujoco.MjSpec.from_string(text))
    except ValueError as error:
        raise _fault(description, str(error), "<include" in text) from error


def _compiled(description: Description, spec: Any) -> Any:
    """The compiled model; remembers the given inertias."""
    for body in spec.bodies:
        if body.explicitinertial:
            is_full = not np.isnan(body.fullinertia[0])
            moments = _moments(body.fullinertia) if is_full else np.sort(np.asarray(body.inertia, float))
            description.moments.setdefault(body.name, moments)
    return spec.compile()


def _moments(inertia: ArrayLike) -> _Array:
    """Principal moments of xx, yy, zz, xy, xz, yz, in rising order."""
    xx, yy, zz, xy, xz, yz = np.asarray(inertia, float)
    return np.asarray(np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]), float)


def _fault(description: Description, message: str, has_includes: bool = False) -> SceneError:
    """MuJoCo's message as one sentence."""
    words = re.sub(r"^(XML )?Error: ", "", " ".join(message.split()))
    found = re.search(r"line(?: number=)? ?([1-9]\d*)", words, re.IGNORECASE)
    line = int(found[1]) if found else None
    syntax = re.match(r"XML parse error \d+: Error=XML_(?:ERROR_)?(\w+)", words)
    words = f"is not an XML file: {syntax[1].lower().replace('_', ' ')}" if syntax else re.sub(r",? line \d+$", "", words)
    if has_includes and line and not syntax:
        # MuJoCo does not say in which file.
        return description.refused(f"{words}, line {line} of this file or of one that it includes")
    return description.refused(words, line)


def _urdf(description: Description, text: str, path: Path | None) -> Any:
    """Compiles a URDF: with the meshes that are found, links without mass, and impossible inertias balanced."""
    description.is_urdf = True
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise description.refused(f"is not an XML file: {str(error).split(':')[0]}", error.position[0]) from error
    for element in root.iter():
        if "xacro" in str(element.tag):
            raise description.refused(f"<xacro:{str(element.tag).split('}')[-1]}> is a macro: expand the file first: xacro FILE")
    for transmission in root.findall("transmission"):
        description.note("omitted: transmission", transmission.get("name", ""))
    for joint in root.findall("joint"):
        for mimic in joint.findall("mimic"):
            description.note("omitted: mimic of joint", joint.get("name", ""))
            joint.remove(mimic)
    assets: dict[str, bytes] = {}
    for link in root.findall("link"):
        _mass_of_link(description, link)
        for shape in link.findall("visual"):
            # Names of shapes serve nothing here, and MuJoCo complains about equal ones.
            shape.attrib.pop("name", None)
            mesh = shape.find("geometry/mesh")
            if mesh is not None and not _find_mesh(mesh, path, assets):
                description.note("not drawn: mesh that is missing, or neither STL nor OBJ", mesh.get("filename", ""))
                link.remove(shape)
    settings = root
    for tag in ("mujoco", "compiler"):
        found = settings.find(tag)
        settings = ElementTree.SubElement(settings, tag) if found is None else found
    settings.attrib.pop("meshdir", None)
    settings.attrib |= {"balanceinertia": "true", "discardvisual": "false", "fusestatic": "false"}
    while True:
        try:
            return _compiled(description, mujoco.MjSpec.from_string(ElementTree.tostring(root, "unicode"), assets=assets))
        except ValueError as error:
            # A mesh that MuJoCo refuses, such as one without volume, is missing only in the picture.
            faulty = next((name for name in assets if Path(name).stem in str(error)), None)
            if faulty is None:
                raise _fault(description, str(error)) from error
            del assets[faulty]
            for link in root.findall("link"):
                for shape in link.findall(f"*/geometry/mesh[@filename='{faulty}']/../.."):
                    description.note("not drawn: mesh that MuJoCo refuses", faulty)
                    link.remove(shape)


def _mass_of_link(description: Description, link: ElementTree.Element) -> None:
    """Gives a link without mass a placeholder, and one with an impossible inertia the mean moment, as `balanceinertia` does."""
    name, inertial, collisions = link.get("name", ""), link.find("inertial"), link.findall("collision")

    def numbers(tag: str, keys: str) -> list[float]:
        element = None if inertial is None else inertial.find(tag)
        texts = ["0" if element is None else element.get(key, "0") for key in keys.split()]
        try:
            return [float(text) for text in texts]
        except ValueError:
            raise description.refused(f"link {name}: <{tag}> has {', '.join(texts)}; expected numbers") from None

    if collisions:
        description.note("omitted: contact of body", name)
    for collision in collisions:
        # MuJoCo would compute the mass of a link without <inertial> from them; the format says that it has none.
        link.remove(collision)
    moments = _moments(numbers("inertia", "ixx iyy izz ixy ixz iyz"))
    is_massless = numbers("mass", "value")[0] <= 0.0
    if is_massless:
        description.massless.add(name)
        if moments[2] > PLACEHOLDER:
            description.note("altered to 0: inertia of link without mass", name)
        for old in link.findall("inertial"):
            link.remove(old)
        inertial = ElementTree.SubElement(link, "inertial")
        ElementTree.SubElement(inertial, "mass", value=repr(PLACEHOLDER))
    if inertial is not None and (is_massless or moments[0] < PLACEHOLDER):
        # MuJoCo balances only moments above 1e-14 kg m^2.
        description.moments[name] = moments
        for old in inertial.findall("inertia"):
            inertial.remove(old)
        mean = repr(PLACEHOLDER if is_massless else max(float(moments.mean()), PLACEHOLDER))
        ElementTree.SubElement(inertial, "inertia", {"ixx": mean, "iyy": mean, "izz": mean, "ixy": "0", "ixz": "0", "iyz": "0"})


def _find_mesh(mesh: ElementTree.Element, path: Path | None, assets: dict[str, bytes]) -> bool:
    """Replaces the file of a mesh, which packages resolve, by one of `assets` with a name of its own; False without one to read.

    MuJoCo would take files of the same name in different folders for one mesh.
    """
    parts = Path(re.sub(r"^\w+://", "", mesh.get("filename", ""))).parts
    tails = [Path(*parts[n:]) for n in range(len(parts))]
    folders = (path or Path("description")).resolve().parents
    found = next((folder / tail for tail in tails for folder in folders if (folder / tail).is_file()), None)
    if found is None or found.suffix.lower() not in (".stl", ".obj"):
        return False
    content = found.read_bytes()
    name = f"{re.sub('[^A-Za-z0-9_-]', '_', found.stem)}-{len(assets)}{found.suffix.lower()}"
    name = next((known for known in assets if assets[known] == content), name)
    assets[name] = content
    mesh.set("filename", name)
    return True


def _quantity(value: ArrayLike, unit: str) -> str:
    return " ".join([*(repr(float(part) + 0.0) for part in np.ravel(value)), unit])


def _metres(position: ArrayLike) -> str:
    return _quantity(_exact(position), "m")


def _exact(value: ArrayLike) -> _Array:
    """Without rounding errors of turned coordinates."""
    return np.where(np.abs(value) < ROUNDING, 0.0, value)


def _toml(value: object) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(part)}" for key, part in cast(_Keys, value).items()) + " }"
    if isinstance(value, list):
        return "[\n    " + ",\n    ".join(_toml(part) for part in cast(list[object], value)) + ",\n]"
    return json.dumps(_exact(cast(_Array, value)).tolist() if isinstance(value, np.ndarray) else value)


def _frame(position: ArrayLike, quaternion: ArrayLike = (1.0, 0.0, 0.0, 0.0)) -> _Array:
    """Coordinates of a frame in the outer one, as a matrix of four rows."""
    frame, matrix = np.eye(4), np.zeros(9)
    mujoco.mju_quat2Mat(matrix, np.asarray(quaternion, float))
    frame[:3, :3], frame[:3, 3] = matrix.reshape(3, 3), position
    return frame


def _point(frame: _Array, point: ArrayLike) -> _Array:
    return np.asarray(frame[:3, :3] @ np.asarray(point, float) + frame[:3, 3], float)


def _rotation(frame: _Array) -> _Keys:
    """`rotation` of a scene, if there is one."""
    if np.abs(frame[:3, :3] - np.eye(3)).max() < ROUNDING:
        return {}
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, frame[:3, :3].flatten())
    return {"rotation": {"quaternion": quaternion}}


class Writer:
    """Writes a compiled model as a scene."""

    def __init__(self, model: Any, description: Description, folder: str | None) -> None:
        self.model: Any = model
        self.description, self.folder, self.note = description, folder, description.note
        self.meshes: dict[str, bytes] = {}
        self.lines: list[str] = []
        self.taken: tuple[set[str], set[str]] = ({"world"}, {"world"})
        self.raw_bodies = [self.raw("BODY", b) for b in range(model.nbody)]
        self.mass = np.where([name in description.massless for name in self.raw_bodies], 0.0, model.body_mass)
        carried = self.mass.copy()
        for b in range(model.nbody - 1, 0, -1):
            carried[model.body_parentid[b]] += carried[b]
        # Bodies without joints are parts of those that carry them.
        self.owner: list[int] = [0]
        self.place: list[_Array] = [np.eye(4)]
        self.parts: dict[int, list[int]] = {0: [0]}
        for b in range(1, model.nbody):
            parent, name = int(model.body_parentid[b]), self.raw_bodies[b]
            is_own = model.body_jntnum[b] > 0
            self.owner.append(b if is_own else self.owner[parent])
            self.parts.setdefault(self.owner[b], []).append(b)
            self.place.append(np.eye(4) if is_own else self.place[parent] @ _frame(model.body_pos[b], model.body_quat[b]))
            if not is_own and self.owner[b]:
                self.note("part of another body, without a joint", f"{name} of {self.raw_bodies[self.owner[b]]}")
            if model.body_mocapid[b] >= 0:
                self.note("omitted: motion by mocap of body", name)
            if is_own and carried[b] == 0.0:
                self.note("omitted: link without mass at the end of a chain", name)
        self.bodies = {b: self.name(self.raw_bodies[b]) for b in range(1, model.nbody) if self.owner[b] == b and carried[b] > 0.0}
        if not self.bodies:
            raise description.refused("no body with mass has a joint")
        self.bodies[0] = "world"

    def is_on(self, *words: str) -> bool:
        """Whether no flag of the description disables one of these."""
        return not any(self.model.opt.disableflags & getattr(mujoco.mjtDisableBit, f"mjDSBL_{word}") for word in words)

    def raw(self, kind: str, index: int) -> str:
        """Name of an element in the description; else its kind and number."""
        name = mujoco.mj_id2name(self.model, getattr(mujoco.mjtObj, f"mjOBJ_{kind}"), index)
        return name or f"{kind.lower()}{index}"

    def name(self, wanted: str, is_given: bool = True, is_body: bool = True) -> str:
        """A free name of a body, or of a joint or an element; as close as possible to `wanted`."""
        taken, base = self.taken[is_body], re.sub(r"[^A-Za-z0-9_-]", "_", wanted)[:40]
        name, number = base, 2
        while name in taken:
            name, number = f"{base[: 39 - len(str(number))]}_{number}", number + 1
        taken.add(name)
        if is_given and name != wanted:
            self.note("renamed", f"{wanted} is {name}")
        return name

    def section(self, title: str, keys: _Keys) -> bool:
        """Writes a section."""
        self.lines += ["", f"[[{title}]]", *(f"{key} = {_toml(value)}" for key, value in keys.items())]
        return True

    def text(self) -> str:
        """The scene file."""
        model, data = self.model, mujoco.MjData(self.model)
        mujoco.mj_kinematics(model, data)
        for b in self.bodies:
            self.body(b) if b else [self.section("fixed_shape", shape) for shape in self.shapes(0)]
        balls = [ball for b in self.bodies if b for ball in self.carry(b, data)]
        for ball in balls:
            self.section("ball_joint", ball)
        is_closed = [self.equality(e) for e in range(model.neq)]
        self.omissions()
        name = re.sub(r"[^A-Za-z0-9_-]", "_", model.names.split(b"\0")[0].decode())[:40]
        label = self.description.label
        name = re.sub(r"[^A-Za-z0-9_-]", "_", Path(label).stem)[:40] if name in ("", "MuJoCo_Model") else name
        notes = [f"{what}: {', '.join(elements)}" for what, elements in self.description.notes.items()]
        head = [f"From {label} by MuJoCo {mujoco.__version__}.", *notes]
        gravity = model.opt.gravity if self.is_on("GRAVITY") else np.zeros(3)
        setup = [
            *("# " + "".join(c if c.isprintable() else " " for c in line) for line in head),
            f'\nname = "{name}"\nstart = "{"ideal" if balls or any(is_closed) else "as-given"}"\n\n[gravity]',
            *(f'{axis} = "{_quantity(part, "m/s^2")}"' for axis, part in zip("xyz", gravity, strict=True)),
            '\n[contact]\n# A clearance above 0 gives every ball joint play.\nclearance = "0 mm"',
        ]
        return "\n".join(setup + self.lines) + "\n"

    def body(self, b: int) -> None:
        """A body with the mass of its parts."""
        model = self.model
        parts = [part for part in self.parts[b] if self.mass[part] > 0.0]
        frames = [self.place[part] @ _frame(model.body_ipos[part], model.body_iquat[part]) for part in parts]
        masses, centres = self.mass[parts], np.array([frame[:3, 3] for frame in frames]).reshape(-1, 3)
        centre = masses @ centres / (masses.sum() or 1.0)
        inertia = np.zeros((3, 3))
        for part, frame in zip(parts, frames, strict=True):
            arm, moments = frame[:3, 3] - centre, np.asarray(model.body_inertia[part], float)
            inertia += frame[:3, :3] * moments @ frame[:3, :3].T + self.mass[part] * (arm @ arm * np.eye(3) - np.outer(arm, arm))
            given, moments = self.description.moments.get(self.raw_bodies[part], moments), np.sort(moments)
            if not np.allclose(moments * np.max(given), np.sort(given) * moments[2], rtol=1e-6, atol=0.0):
                change = " to ".join(" ".join(f"{moment:.4g}" for moment in both) for both in (given, moments))
                self.note("altered by balanceinertia: moments of inertia of", f"{self.raw_bodies[part]} ({change} kg m^2)")
        products = -inertia[[0, 0, 1], [1, 2, 2]]
        products[np.abs(products) < ROUNDING * inertia.max()] = 0.0
        keys: _Keys = {"name": self.bodies[b], "mass": _quantity(masses.sum(), "kg"), "centre": _metres(centre)}
        keys |= {"inertia": _quantity(np.diag(inertia), "kg m^2")}
        keys |= {"products": _quantity(products, "kg m^2")} if products.any() else {}
        shapes = self.shapes(b)
        self.section("body", keys | ({"shapes": shapes} if shapes else {}))

    def shapes(self, owner: int) -> list[_Keys]:
        """Shapes of a body and its parts, or of the world: those that MuJoCo's viewer shows at first; of a URDF, its visuals."""
        model, kinds = self.model, mujoco.mjtGeom
        found: list[_Keys] = []
        geoms = ((b, model.body_geomadr[b] + n) for b in self.parts[owner] for n in range(model.body_geomnum[b]))
        for b, g in geoms:
            group, material = model.geom_group[g], model.geom_matid[g]
            has_colour = material < 0 or not np.allclose(model.geom_rgba[g], (0.5, 0.5, 0.5, 1.0))
            rgba = model.geom_rgba[g] if has_colour else model.mat_rgba[material]
            if rgba[3] == 0.0 or not (group == 1 if self.description.is_urdf else group < 3):
                continue
            frame, size = self.place[b] @ _frame(model.geom_pos[g], model.geom_quat[g]), model.geom_size[g]
            kind = model.geom_type[g]
            keys: _Keys = {}
            if kind == kinds.mjGEOM_SPHERE.value:
                keys = {"form": "sphere", "centre": _metres(frame[:3, 3]), "radius": _metres(size[0])}
            elif kind in (kinds.mjGEOM_CAPSULE.value, kinds.mjGEOM_CYLINDER.value):
                ends = {key: _metres(_point(frame, (0.0, 0.0, z))) for key, z in (("from", -size[1]), ("to", size[1]))}
                keys = {"form": kinds(int(kind)).name[7:].lower(), **ends, "radius": _metres(size[0])}
            elif kind == kinds.mjGEOM_BOX.value and not _rotation(frame):
                keys = {"form": "box", "centre": _metres(frame[:3, 3]), "size": _metres(2.0 * size)}
            elif kind == kinds.mjGEOM_BOX.value:
                # A turned box is a thick plate.
                signs = ((-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.0))
                corners = [_metres(_point(frame, size * sign)) for sign in signs]
                keys = {"form": "plate", "corners": corners, "thickness": _metres(2.0 * size[2])}
            elif kind == kinds.mjGEOM_MESH.value and self.folder:
                file = f"{self.folder}/{self.mesh(int(model.geom_dataid[g]))}"
                keys = {"form": "mesh", "file": file, "unit": "m", "position": _metres(frame[:3, 3])} | _rotation(frame)
            if keys:
                colour = "#" + "".join(f"{round(255 * min(max(float(part), 0.0), 1.0)):02x}" for part in rgba[:3])
                found.append(keys | {"colour": colour})
            elif kind == kinds.mjGEOM_MESH.value:
                self.note("not drawn, because no folder is given: mesh", self.raw("MESH", model.geom_dataid[g]))
            else:
                self.note(f"not drawn: {kinds(int(kind)).name[7:].lower()}", f"{self.raw('GEOM', g)} of {self.raw_bodies[b]}")
        return found

    def mesh(self, k: int) -> str:
        """File of a mesh, coarser where all of them would be too large."""
        model, name = self.model, re.sub(r"[^A-Za-z0-9_-]", "_", self.raw("MESH", k))
        corners = model.mesh_vert[model.mesh_vertadr[k] :][: model.mesh_vertnum[k]]
        faces = model.mesh_face[model.mesh_faceadr[k] :][: model.mesh_facenum[k]]
        fits = 50 * model.mesh_facenum.sum() + 84 * model.nmesh <= ALL_MESHES
        allowed, low, cells = ALL_MESHES if fits else (ALL_MESHES // model.nmesh - 84) // 50, corners.min(0), 512.0
        while len(faces) > allowed and f"{name}.stl" not in self.meshes:
            # Corners in one cell of a grid become one.
            self.note("drawn coarser: mesh", name)
            grid = np.floor((corners - low) * (cells / np.ptp(corners, 0).max())).astype(np.int64)
            _, first, inverse = np.unique(grid, axis=0, return_index=True, return_inverse=True)
            corners, faces, cells = corners[first], inverse.reshape(-1)[faces], cells / 2.0
            faces = faces[(faces != np.roll(faces, 1, axis=1)).all(1)]
        rows = np.zeros(len(faces), dtype=[("normal", "<3f4"), ("corners", "<9f4"), ("unused", "<u2")])
        rows["corners"] = corners[faces].reshape(-1, 9)
        self.meshes.setdefault(f"{name}.stl", bytes(80) + len(faces).to_bytes(4, "little") + rows.tobytes())
        return f"{name}.stl"

    def carry(self, b: int, data: Any) -> Iterator[_Keys]:
        """Writes the joint that carries a body, or the chain of joints; yields the ball joint that holds it, for later."""
        model, kinds, child, parent = self.model, mujoco.mjtJoint, self.bodies[b], int(self.model.body_parentid[b])
        frame, carrier = self.place[parent] @ _frame(model.body_pos[b], model.body_quat[b]), self.bodies[self.owner[parent]]
        joints = range(model.body_jntadr[b], model.body_jntadr[b] + model.body_jntnum[b])
        for j in joints:
            kind, at, name = model.jnt_type[j], model.jnt_pos[j], self.name(self.raw("JOINT", j), is_body=False)
            if kind in (kinds.mjJNT_FREE.value, kinds.mjJNT_BALL.value):
                is_ball = kind == kinds.mjJNT_BALL.value
                if len(joints) > 1:
                    message = f"body {self.raw_bodies[b]}: in a scene a ball joint is the only joint of its body"
                    raise self.description.refused(message)
                here = _frame(data.xpos[b], data.xquat[b])
                keys: _Keys = {"name": self.name(f"{name}_free", False, False) if is_ball else name, "kind": "free"}
                start: _Keys = {"position": _metres(_point(here, at))} | _rotation(here)
                self.section("joint", keys | {"child": child, "child_point": _metres(at), "start": start})
                if is_ball:
                    yield {"name": name, "socket": _end(carrier, _point(frame, at)), "ball": _end(child, at)}
                spring = model.qpos_spring[model.jnt_qposadr[j] :][:7]
                self.spring(j, name, _end(child, at), (carrier, frame) if is_ball else ("world", _frame(spring[:3], spring[3:])))
                continue
            to = child if j == joints[-1] else self.name(name, False)
            if to != child:
                self.section("body", {"name": to, "mass": "0 kg", "inertia": "0 0 0 kg m^2"})
            keys = {"name": name, "kind": "revolute" if kind == kinds.mjJNT_HINGE.value else "prismatic"}
            keys |= {"parent": carrier} if carrier != "world" else {}
            keys |= {"child": to, "axis": frame[:3, :3] @ model.jnt_axis[j]}
            keys |= {"parent_point": _metres(_point(frame, at)), "child_point": _metres(at)}
            self.section("joint", keys | _rotation(frame))
            self.spring(j, name)
            frame, carrier = np.eye(4), to

    def spring(self, j: int, name: str, on: _Keys | None = None, base: tuple[str, _Array] = ("", np.eye(4))) -> None:
        """Spring and damper of a joint: of a hinge or slide, else a bushing between a frame and the point `on`."""
        model = self.model
        values: list[float] = []
        for what, flag, row in (("stiffness", "SPRING", j), ("damping", "DAMPER", model.jnt_dofadr[j])):
            # Some versions have the higher powers in the same array, some in one of their own.
            words = ("jnt_stiffness", "jnt_stiffnesspoly", "jnt_springyield") if row is j else ("dof_damping", "dof_dampingpoly")
            linear, *higher = np.concatenate([np.ravel(getattr(model, word)[row]) for word in words if hasattr(model, word)])
            if any(higher):
                self.note(f"omitted: higher powers or yield of {what} of joint", self.raw("JOINT", j))
            values.append(float(linear) if self.is_on(flag) else 0.0)
        if not any(values):
            return
        kind, rest = model.jnt_type[j], model.qpos_spring[model.jnt_qposadr[j]] - model.qpos0[model.jnt_qposadr[j]]
        keys: _Keys = {"name": self.name(f"{name}_spring", False, False)}

        def pair(prefix: str, unit: str) -> _Keys:
            parts = [np.full(3 if on else 1, value) for value in values]
            return {
                f"{prefix}stiffness": _quantity(parts[0], f"{unit}/{'rad' if ' ' in unit else 'm'}"),
                f"{prefix}damping": _quantity(parts[1], f"{unit} s/{'rad' if ' ' in unit else 'm'}"),
            }

        if on is None:
            force, unit = ("N m", "rad") if kind == mujoco.mjtJoint.mjJNT_HINGE.value else ("N", "m")
            self.section("joint_spring", keys | {"joint": name, "position": _quantity(rest, unit)} | pair("", force))
            return
        carrier, frame = base
        keys |= {"from": _end(carrier, _point(frame, model.jnt_pos[j])), "to": on} | _rotation(frame) | pair("turning_", "N m")
        self.section("bushing", keys | (pair("", "N") if kind == mujoco.mjtJoint.mjJNT_FREE.value else {}))

    def equality(self, e: int) -> bool:
        """Writes a connection or a weld as a joint that closes a loop; whether it did."""
        model, data, word = self.model, self.model.eq_data[e], mujoco.mjtEq(int(self.model.eq_type[e])).name[5:].lower()
        label, bodies = self.raw("EQUALITY", e), [int(model.eq_obj1id[e]), int(model.eq_obj2id[e])]
        is_active = model.eq_active0[e] and self.is_on("EQUALITY", "CONSTRAINT")
        if word not in ("connect", "weld") or not is_active:
            self.note(f"omitted: {'' if is_active else 'inactive '}equality of kind {word}", label)
            return False
        if model.eq_objtype[e] == mujoco.mjtObj.mjOBJ_SITE.value:
            frames = [_frame(model.site_pos[site], model.site_quat[site]) for site in bodies]
            bodies = [int(model.site_bodyid[site]) for site in bodies]
        elif word == "weld":
            frames = [_frame(data[3:6], data[6:10]), _frame(data[:3])]
        else:
            frames = [_frame(data[:3]), _frame(data[3:6])]
        # The world can only be the parent.
        ends = [(self.owner[b], self.place[b] @ frame) for b, frame in zip(bodies, frames, strict=True)]
        (parent, outer), (child, inner) = ends if ends[1][0] else ends[::-1]
        if parent == child or not {parent, child} <= set(self.bodies):
            self.note("omitted: equality within one body, or of one that is omitted", label)
            return False
        self.note("rigid here, elastic in MuJoCo: equality", label)
        name = self.name(label, is_body=False)
        if word == "connect" or data[10] == 0.0:
            sides: _Keys = {"socket": _end(self.bodies[parent], outer[:3, 3]), "ball": _end(self.bodies[child], inner[:3, 3])}
            return self.section("ball_joint", {"name": name, **sides})
        keys: _Keys = {"name": name, "kind": "fixed"}
        keys |= {"parent": self.bodies[parent]} if parent else {}
        keys |= {"child": self.bodies[child], "parent_point": _metres(outer[:3, 3]), "child_point": _metres(inner[:3, 3])}
        return self.section("joint", keys | _rotation(outer @ np.linalg.inv(inner)) | {"closes_loop": True})

    def omissions(self) -> None:
        """Notes the parts of the model that a scene does not have, and writes the loads that hold bodies against gravity."""
        model, note = self.model, self.note
        if model.nflex:
            raise self.description.refused(f"flex {self.raw('FLEX', 0)}: the bodies of a scene are rigid")
        for j in range(model.njnt):
            dofs = slice(model.jnt_dofadr[j], model.jnt_dofadr[j] + (6, 3, 1, 1)[int(model.jnt_type[j])])
            for what, is_there in (
                ("range", model.jnt_limited[j] and self.is_on("LIMIT")),
                ("armature", model.dof_armature[dofs].any()),
                ("friction", model.dof_frictionloss[dofs].any() and self.is_on("FRICTIONLOSS")),
            ):
                if is_there:
                    note(f"omitted: {what} of joint", self.raw("JOINT", j))
        counts = {"ACTUATOR": len(model.actuator_trntype), "TENDON": model.ntendon, "KEY": model.nkey, "PLUGIN": model.nplugin}
        for kind, count in counts.items():
            for k in range(count):
                note(f"omitted: {'keyframe' if kind == 'KEY' else kind.lower()}", self.raw(kind, k))
        touching = [int(b) for b in model.geom_bodyid[(model.geom_contype | model.geom_conaffinity) != 0]]
        for b in touching if self.is_on("CONTACT") and len(touching) > 1 else []:
            note("omitted: contact of body", self.raw_bodies[b])
        for word in ("density", "viscosity", "wind"):
            if np.any(getattr(model.opt, word)):
                note("omitted: resistance of the medium", word)
        for b in map(int, np.flatnonzero(model.body_gravcomp * self.mass)):
            if self.owner[b] and self.is_on("GRAVITY"):
                keys: _Keys = {"name": self.name(f"{self.raw_bodies[b]}_gravcomp", False, False)}
                keys |= {"on": _end(self.bodies[self.owner[b]], _point(self.place[b], model.body_ipos[b]))}
                self.section("load", keys | {"force": _quantity(-model.body_gravcomp[b] * self.mass[b] * model.opt.gravity, "N")})


def _end(body: str, at: ArrayLike) -> _Keys:
    return {"body": body, "at": _metres(at)}
