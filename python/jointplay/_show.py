"""Pictures of runs with Matplotlib: curves and animations."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._geometry import Shape
from ._options import library

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Of the bodies in turn (Okabe and Ito)."""
STILL = "#888888"
"""Of the world."""
LIGHT = np.array([0.3, -0.5, 0.81])
"""Direction from which the light comes."""


def plot(axes: Any, time: NDArray[np.float64], curves: Iterable[tuple[str, str, NDArray[np.float64]]]) -> Any:
    """Draws curves (name, unit, values) over time into `axes`, by default new ones."""
    if axes is None:
        axes = library("matplotlib.pyplot").subplots()[1]
    units: list[str] = []
    for name, unit, values in curves:
        axes.plot(time, values, label=f"{name}, {unit}" if unit else name)
        units += [] if unit in units else [unit]
    labels = [text.get_label() for text in axes.get_lines()]
    axes.set(xlabel="time, s", ylabel=labels[0] if len(labels) == 1 else ", ".join(filter(None, units)))
    if len(labels) > 1:
        axes.legend()
    return axes


def animate(
    title: str,
    shapes: Sequence[Shape],
    names: Sequence[str],
    time: NDArray[np.float64],
    poses: NDArray[np.float64],
    interval: float,
) -> Any:
    """A Matplotlib animation of `shapes` at the poses of the bodies `names`, shape (frames, bodies, 4, 4); `interval` in ms."""
    pyplot = library("matplotlib.pyplot")
    places = {name: i for i, name in enumerate(names)}
    colours = [STILL if shape.body == "world" else COLOURS[places[shape.body] % len(COLOURS)] for shape in shapes]
    # One collection, so that its triangles hide each other.
    paint = np.repeat(library("matplotlib.colors").to_rgba_array(colours)[:, :3], [len(shape.faces) for shape in shapes], axis=0)

    def triangles(frame: int) -> NDArray[np.float64]:
        def placed(shape: Shape) -> NDArray[np.float64]:
            pose = np.eye(4) if shape.body == "world" else poses[frame, places[shape.body]]
            return np.asarray((shape.vertices @ pose[:3, :3].T + pose[:3, 3])[shape.faces])

        return np.concatenate([placed(shape) for shape in shapes])

    figure = pyplot.figure()
    axes = figure.add_subplot(projection="3d")
    drawn = axes.add_collection3d(library("mpl_toolkits.mplot3d.art3d").Poly3DCollection(triangles(0)))
    ends = np.concatenate([triangles(f).reshape(-1, 3)[:: 1 + len(paint) // 1000] for f in range(len(time))])
    low, high = ends.min(axis=0), ends.max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * float((high - low).max())
    axes.set(xlabel="x, m", ylabel="y, m", zlabel="z, m", box_aspect=(1, 1, 1))
    axes.set(**{f"{axis}lim": (middle[i] - half, middle[i] + half) for i, axis in enumerate("xyz")})

    def draw(frame: int) -> list[Any]:
        corners = triangles(frame)
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        size = np.linalg.norm(normal, axis=1, keepdims=True)
        light = 0.7 + 0.3 * (normal / np.where(size > 0.0, size, 1.0)) @ LIGHT
        drawn.set_verts(corners)
        drawn.set_color(paint * light[:, None])
        axes.set_title(f"{title}, t = {1e3 * time[frame]:.3f} ms")
        return [drawn]

    animation = library("matplotlib.animation").FuncAnimation(figure, draw, frames=len(time), interval=interval)
    # A notebook shows it as a page with controls, without a setting of Matplotlib's.
    animation._repr_html_ = animation.to_jshtml
    pyplot.close(figure)
    return animation
