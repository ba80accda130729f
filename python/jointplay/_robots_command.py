"""The command `import`: the scene file of a robot description (`docs/import.md`)."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ._options import write
from ._robots import scene_of
from ._scene import Scene
from .errors import OptionError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of `import`."""
    parser.add_argument("file", type=Path, help="the description; its first element is <robot> (URDF) or <mujoco> (MJCF)")
    parser.add_argument("--out", type=Path, metavar="SCENE", help="file of the scene, by default standard output")
    text = "folder of the meshes, beside the scene; by default that of --out with -meshes; without both there are no meshes"
    parser.add_argument("--meshes", type=Path, metavar="FOLDER", help=text)
    parser.add_argument("--force", action="store_true", help="replace existing files")


def main(arguments: argparse.Namespace) -> None:
    """Runs `import`."""
    out: Path | None = arguments.out
    folder: Path | None = arguments.meshes or (out.with_name(f"{out.stem}-meshes") if out else None)
    if out and folder and folder.resolve().parent != out.resolve().parent:
        raise OptionError(f"--meshes {folder}: a scene finds its meshes in a folder beside it, in {out.resolve().parent}")
    native, meshes = scene_of(arguments.file, None, folder.resolve().name if folder else None)
    scene = Scene(native)
    files = {folder / name: content for name, content in meshes.items()} if folder else {}
    files |= {out: scene.toml.encode()} if out else {}
    existing = next((path for path in files if path.exists()), None)
    if existing and not arguments.force:
        raise OptionError(f"{existing} exists already; --force replaces it")
    for path, content in files.items():
        write(path, content)
    if not out:
        sys.stdout.write(scene.toml)
    print(*scene.notes, sep="\n", file=sys.stderr)
