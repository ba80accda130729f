"""Links to the page (`docs/links.md`), and frames that show it in a notebook (`docs/embedding.md`)."""

from __future__ import annotations

import base64
import html
import os
import zlib
from urllib.parse import urlencode

from . import _native

MAX_LENGTH = 32_000
"""Length limit of a link that the page accepts, in characters."""


def link_of(scene: _native.Scene, time: float | None = None) -> str | None:
    """Pairs of a link that opens `scene`, and runs it to `time`, s.

    None for a scene that needs further files or is too long for a link.
    """
    text, _, files, changes = scene.origin()
    pairs: dict[str, str] = {}
    built_in = [name for names in _native.scenes() for name in names]
    if scene.name in built_in and text_of_built_in(scene.name) == text:
        pairs["scene"] = scene.name
    elif files:
        return None
    else:
        compressor = zlib.compressobj(9, zlib.DEFLATED, -15)
        packed = compressor.compress(text.encode()) + compressor.flush()
        pairs["text"] = base64.urlsafe_b64encode(packed).decode().rstrip("=")
    pairs.update(changes)
    if time is not None:
        pairs["t"] = f"{time!r}s"
    link = urlencode(pairs)
    return link if len(link) <= MAX_LENGTH else None


def text_of_built_in(name: str) -> str:
    """Text of the built-in scene `name`."""
    return _native.Scene.load(name).origin()[0]


def frame_of(scene: _native.Scene, time: float | None = None) -> str | None:
    """HTML of a frame in which the page shows `scene` at `time`; None unless the environment variable JOINTPLAY_PAGE is set."""
    page = os.environ.get("JOINTPLAY_PAGE")
    link = link_of(scene, time) if page else None
    if not page or link is None:
        return None
    address = html.escape(f"{page}#{link}&embed=controls", quote=True)
    title = html.escape(scene.title, quote=True)
    return (
        f'<iframe src="{address}" width="800" height="500" style="border: 0" loading="lazy"'
        f' allow="fullscreen; clipboard-write" title="{title}"></iframe>'
    )
