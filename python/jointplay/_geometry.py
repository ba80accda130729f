"""Shapes of bodies as numbers and as triangles, and poses as matrices."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _native

TURNS = 16
"""Sides of the prisms that stand for round shapes."""


@dataclass(frozen=True)
class Shape:
    """A drawn shape of a body. Lengths in m, body axes."""

    body: str
    """Name of its body, or `world`."""
    kind: str
    """`capsule`, `cylinder`, `cone`, `box`, `sphere`, `plate` or `mesh`."""
    dimensions: dict[str, Any]
    """Numbers that define it: `from`, `to` and `radius` of round bars (a cone's tip is at `to`), `centre` and `size` of a box,
    `centre` and `radius` of a sphere, `corners` and `thickness` of a plate; nothing of a mesh."""
    vertices: NDArray[np.float64] = field(repr=False)
    """Corners of its triangles: shape (vertices, 3). Round shapes are prisms of 16 sides."""
    faces: NDArray[np.int64] = field(repr=False)
    """Triangles, as indices of vertices, counter-clockwise from outside: shape (faces, 3)."""


def shapes_of(scene: _native.Scene) -> list[Shape]:
    """All shapes of a scene."""
    return [_shape(body or "world", kind, numbers) for body, kind, numbers in scene.shapes()]


def _shape(body: str, kind: str, numbers: dict[str, Any]) -> Shape:
    if kind == "mesh":
        return Shape(body, kind, {}, numbers["vertices"], numbers["faces"])
    own: dict[str, Any] = {name: np.asarray(value) if np.ndim(value) else value for name, value in numbers.items()}
    if kind == "plate":
        return Shape(body, kind, own, *_plate(own["corners"], own.pop("triangles"), float(numbers["thickness"])))
    if kind == "box":
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
        faces = np.array([[a, *pair] for a, b, c, d in sides for pair in ((b, c), (c, d))])
        return Shape(body, kind, own, own["centre"] + 0.5 * signs * own["size"], faces)
    # Height along the axis and distance from it, of the ends and of the rings between them.
    radius = float(own["radius"])
    start = own["centre"] if kind == "sphere" else own["from"]
    axis = np.array([0.0, 0.0, 0.0]) if kind == "sphere" else own["to"] - start
    length = float(np.linalg.norm(axis))
    quarter = radius * np.exp(1j * np.linspace(0.0, np.pi / 2, TURNS // 4 + 1))
    caps = [(-z.real, z.imag) for z in quarter] + [(length + z.imag, z.real) for z in quarter]
    profile = {
        "cylinder": [(0.0, 0.0), (0.0, radius), (length, radius), (length, 0.0)],
        "cone": [(0.0, 0.0), (0.0, radius), (length, 0.0)],
    }
    return Shape(
        body, kind, own, *_revolved(start, axis / length if length else np.array([0.0, 0.0, 1.0]), profile.get(kind, caps))
    )


def _revolved(
    start: NDArray[np.float64], axis: NDArray[np.float64], profile: list[tuple[float, float]]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Surface of revolution of a profile that begins and ends on the axis."""
    across = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    across /= np.linalg.norm(across)
    angle = 2.0 * np.pi * np.arange(TURNS) / TURNS
    ring = np.outer(np.cos(angle), across) + np.outer(np.sin(angle), np.cross(axis, across))
    (first, _), *inner, (last, _) = profile
    rings = [start + height * axis + radius * ring for height, radius in inner]
    vertices = np.concatenate([[start + first * axis], *rings, [start + last * axis]])
    i = np.arange(TURNS)
    j, end = (i + 1) % TURNS, len(vertices) - 1
    faces = [np.stack([0 * i, 1 + j, 1 + i], axis=1)]
    for k in range(1, 1 + TURNS * (len(inner) - 1), TURNS):
        faces += [np.stack([k + i, k + j, k + TURNS + j], axis=1), np.stack([k + i, k + TURNS + j, k + TURNS + i], axis=1)]
    faces.append(np.stack([end + 0 * i, end - TURNS + i, end - TURNS + j], axis=1))
    return vertices, np.concatenate(faces)


def _plate(
    corners: NDArray[np.float64], triangles: NDArray[np.int64], thickness: float
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Polygon that is extruded to both sides of its plane."""
    a, b, c = (corners[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a).sum(axis=0)
    half = 0.5 * thickness * normal / np.linalg.norm(normal)
    n = len(corners)
    i = np.arange(n)
    j = (i + 1) % n
    sides = [np.stack([n + i, n + j, j], axis=1), np.stack([n + i, j, i], axis=1)]
    return np.concatenate([corners + half, corners - half]), np.concatenate([triangles, n + triangles[:, ::-1], *sides])


def matrices(positions: NDArray[np.float64], rotations: NDArray[np.float64]) -> NDArray[np.float64]:
    """Homogeneous matrices of poses, body to world: shape (…, 4, 4)."""
    found = np.zeros((*positions.shape[:-1], 4, 4))
    found[..., :3, :3], found[..., :3, 3], found[..., 3, 3] = rotations, positions, 1.0
    return found


def rotations_of(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation matrices Rx(alpha) Rz(beta) Ry(gamma) of the angles of pose channels, rad: shape (…, 3, 3)."""
    (sa, ca), (sb, cb), (sg, cg) = ((np.sin(angle), np.cos(angle)) for angle in np.moveaxis(angles, -1, 0))
    zero, one = np.zeros_like(sa), np.ones_like(sa)

    def rows(*entries: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.stack(entries, axis=-1).reshape(*sa.shape, 3, 3)

    x = rows(one, zero, zero, zero, ca, -sa, zero, sa, ca)
    z = rows(cb, -sb, zero, sb, cb, zero, zero, zero, one)
    y = rows(cg, zero, sg, zero, one, zero, -sg, zero, cg)
    return np.asarray(x @ z @ y)
