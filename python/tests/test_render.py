"""Pictures equal those of the program if the package has graphics; otherwise the error explains how to get them."""

import struct
import zlib

import numpy as np
import pytest

import jointplay as jp
from jointplay import _native

HAS_GRAPHICS = hasattr(_native, "render")


def pixels(path):
    """Pixels of a PNG file with 8 bits a channel and no interlace: shape (height, width, channels)."""
    data, at, packed = path.read_bytes(), 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        content = data[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            width, height, _, colour = struct.unpack(">IIBB", content[:10])
        packed += content if kind == b"IDAT" else b""
        at += 12 + length
    channels = {2: 3, 6: 4}[colour]
    rows = np.frombuffer(zlib.decompress(packed), dtype=np.uint8).reshape(height, 1 + width * channels)
    out = np.zeros((height + 1, width + 1, channels), dtype=np.int64)
    for y, row in enumerate(rows):
        line = row[1:].reshape(width, channels).astype(np.int64)
        for x in range(width):
            a, b, c = out[y + 1, x], out[y, x + 1], out[y, x]
            p = a + b - c
            nearest = np.where(
                (abs(p - a) <= abs(p - b)) & (abs(p - a) <= abs(p - c)), a, np.where(abs(p - b) <= abs(p - c), b, c)
            )
            out[y + 1, x + 1] = (line[x] + [0 * a, a, b, (a + b) // 2, nearest][row[0]]) % 256
    return out[1:, 1:].astype(np.uint8)


@pytest.mark.skipif(not HAS_GRAPHICS, reason="a wheel without graphics")
def test_a_picture_is_that_of_the_program(program, tmp_path):
    options = ["--at", "20ms", "--size", "160x90", "--hide", "trail,peaks", "--quiet"]
    program("render", "pendulum", *options, "--out", tmp_path / "frames")
    (path,) = (tmp_path / "frames").glob("*.png")
    expected = pixels(path)
    simulation = jp.Simulation(jp.Scene.load("pendulum"))
    simulation.step_until("20 ms")
    picture = jp.render(simulation, (160, 90))
    assert picture.shape == (90, 160, 4) and picture.dtype == np.uint8 and (picture[..., 3] == 255).all()
    assert np.abs(picture[..., :3].astype(int) - expected[..., :3].astype(int)).max() <= 2
    assert len(np.unique(picture.reshape(-1, 4), axis=0)) > 100
    with pytest.raises(jp.OptionError, match="width = 0"):
        jp.render(simulation, (0, 90))


@pytest.mark.skipif(HAS_GRAPHICS, reason="a wheel with graphics")
def test_a_wheel_without_graphics_says_so():
    with pytest.raises(ImportError, match="--features render"):
        jp.render(jp.Simulation(jp.Scene.load("pendulum")))
