"""Shared fixtures: the program with which the package must agree."""

import json
import os
import signal
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(autouse=True)
def interruptible():
    """Ctrl-C raises KeyboardInterrupt, as in a terminal; a background process of a script would ignore it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(scope="session")
def program():
    """Calls the program that `./test` has built, and returns its output."""
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    path = Path(os.environ.get("JOINTPLAY", target / "debug" / "jointplay"))

    def call(*arguments):
        done = subprocess.run([path, *map(str, arguments)], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return call


@pytest.fixture(scope="session")
def summary(program):
    """Calls a command of the program and returns its summary."""
    return lambda *arguments: json.loads(program(*arguments, "--summary", "json", "--quiet"))


@pytest.fixture
def falling():
    """A ball in a socket with play, as a scene file: cheap, and unknown to the program."""
    return """
name = "falling"
[gravity]
z = "-9.81 m/s^2"
[contact]
clearance = "0.2 mm"
[[body]]
name = "bob"
mass = "0.4 kg"
inertia = "1e-3 1e-3 1e-3 kg m^2"
[[joint]]
name = "bob"
kind = "free"
child = "bob"
start = { position = "0 0 0 mm" }
[[ball_joint]]
name = "S1"
socket = { body = "world", at = "0 0 0 mm" }
ball = { body = "bob", at = "0 0 0 mm" }
"""


@pytest.fixture
def hung():
    """Three links of 100 mm that reversed gravity pulls straight up from a fixed socket, as a scene file: the height of the last
    one is the sum of link lengths and clearances."""
    text = """
start = "equilibrium"
[gravity]
z = "9.81 m/s^2"
[contact]
clearance = "0.1 mm"
[output]
body = "link3"
"""
    for n in (1, 2, 3):
        text += f"""
[[body]]
name = "link{n}"
mass = "0.2 kg"
inertia = "2e-4 2e-4 1e-5 kg m^2"
[[joint]]
name = "free{n}"
kind = "free"
child = "link{n}"
start = {{ position = "0 0 {100 * n - 50} mm" }}
[[ball_joint]]
name = "J{n}"
socket = {{ body = "{f"link{n - 1}" if n > 1 else "world"}", at = "0 0 {50 if n > 1 else 0} mm" }}
ball = {{ body = "link{n}", at = "0 0 -50 mm" }}
opening = [0, 1, 0]
"""
    return text
