"""Distributions of uncertain parameters, read from text."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import _iso286, _native
from ._options import is_a, library
from ._scene import Scene
from .errors import JointplayError, OptionError

FORMS = (
    "a value, `LOW..HIGH`, `uniform(LOW, HIGH)`, `normal(MEAN, SD)`, `normal(MEAN, SD, LOW..HIGH)`, `triangular(LOW, MODE, HIGH)`, "
    "`measured(VALUE, VALUE, …)` or a fit such as `H7/g6`"
)
DEFAULT_RANGE = (0.5, 1.5)
"""Range of a parameter without a distribution, as multiples of its value."""
ENDS = (0.025, 0.975)
"""Probabilities whose quantiles stand for the ends of a distribution without limits."""
SHARED = "contact.clearance"
"""Clearance of all joints with play that have none of their own."""
RADII = {"clearance": "ball_radius", "play.radial": "play.radius"}
"""Radius of the round part with each play, as last parts of the joint's keys."""


class At:
    """Puts a place, such as an option or a line of a file, before the errors of a block."""

    def __init__(self, place: str) -> None:
        self.place = place

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if isinstance(error, JointplayError):
            raise OptionError(f"{self.place}: {error}") from error


@dataclass(frozen=True)
class Distribution:
    """Distribution of one parameter, SI."""

    low: float
    """Smallest possible value; infinite without a limit."""
    high: float
    """Largest possible value; infinite without a limit."""
    ppf: Callable[[NDArray[np.float64]], NDArray[np.float64]]
    """Quantile function, up to rounding."""
    is_assumed: bool = False
    """Whether it was not given: 0.5 to 1.5 times the value."""

    def quantile(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values below which the fractions `u` of all values lie."""
        return np.clip(self.ppf(u), self.low, self.high)

    @property
    def is_limited(self) -> bool:
        """Whether both ends are limits."""
        return bool(np.isfinite([self.low, self.high]).all())

    @property
    def probabilities(self) -> tuple[float, float]:
        """Probabilities of the ends: 0 and 1, or without limits 2.5 % and 97.5 %."""
        return (0.0, 1.0) if self.is_limited else ENDS

    @property
    def ends(self) -> tuple[float, float]:
        """Limits, or the quantiles that stand for them."""
        if self.is_limited:
            return self.low, self.high
        low, high = self.quantile(np.array(ENDS))
        return float(low), float(high)


def uniform(low: float, high: float, is_assumed: bool = False) -> Distribution:
    """All values between two limits are equally likely."""
    return Distribution(low, high, lambda u: low * (1.0 - u) + high * u, is_assumed)


def radial_clearance(fit: str, diameter: float) -> Distribution:
    """Radial clearance of a fit at a diameter, m.

    Hole and shaft are independent and normally distributed about the centres of their tolerance intervals, whose widths are six
    standard deviations (Cp = 1); the sum is cut off at the limits of the fit.
    """
    low, high = (0.5 * end for end in _iso286.clearance(fit, diameter))
    hole, shaft = (_iso286.tolerance(name, diameter) for name in _iso286.classes(fit))
    return _normal(0.5 * (low + high), 0.5 * float(np.hypot(hole, shaft)) / 6.0, low, high)


def _normal(mean: float, deviation: float, low: float = -np.inf, high: float = np.inf) -> Distribution:
    _check(deviation > 0.0, "the standard deviation of a normal distribution must be above 0")
    _check(low < high, "the lower limit of a truncated normal distribution must be below the upper one")
    a, b = (low - mean) / deviation, (high - mean) / deviation
    law = library("scipy.stats").truncnorm(a, b, mean, deviation)
    _check(
        np.isfinite(law.median()), "the limits of a truncated normal distribution are too many standard deviations from its mean"
    )
    return Distribution(low, high, law.ppf)


def _check(is_valid: bool, message: str) -> None:
    if not is_valid:
        raise OptionError(message)


def parse(text: str, read: Callable[[str], float], fit: Callable[[str], Distribution]) -> Distribution:
    """Reads a distribution. `read` reads a number with its unit, `fit` a fit such as H7/g6."""
    text = text.strip()

    def number(part: str) -> float:
        with At(f"`{text}`: {part.strip()}"):
            return read(part)

    def limits(part: str) -> tuple[float, float]:
        low, dots, high = part.partition("..")
        _check(bool(dots), f"`{text}` is not a distribution: expected {FORMS}")
        return number(low), number(high)

    call = re.fullmatch(r"(\w+)\s*\((.*)\)", text)
    if not call and "/" in text and re.match("[A-Za-z]", text):
        with At(f"`{text}`"):
            return fit(text)
    parts = [part.strip() for part in call[2].split(",")] if call else [text]
    match call[1] if call else "", parts:
        case ("", [span]) if ".." in span and "(" not in span:
            low, high = limits(span)
        case ("uniform", [first, second]):
            low, high = number(first), number(second)
        case ("normal", [mean, deviation]):
            return _normal(number(mean), number(deviation))
        case ("normal", [mean, deviation, span]):
            return _normal(number(mean), number(deviation), *limits(span))
        case ("triangular", [first, second, third]):
            low, mode, high = number(first), number(second), number(third)
            _check(low <= mode <= high and low < high, "a triangular distribution takes LOW, MODE and HIGH in ascending order")
            law = library("scipy.stats").triang((mode - low) / (high - low), low, high - low)
            return Distribution(low, high, law.ppf)
        case ("measured", [first, *_]) if first:
            values = np.sort([number(part) for part in parts])
            return Distribution(values[0], values[-1], lambda u: np.quantile(values, u))
        case ("", [value]) if value and not value[0].isalpha() and "(" not in value:
            constant = number(value)
            return Distribution(constant, constant, lambda u: np.full_like(u, constant))
        case _:
            raise OptionError(f"`{text}` is not a distribution: expected {FORMS}")
    _check(low < high, "the lower limit of a uniform distribution must be below the upper one")
    return uniform(low, high)


class Request(NamedTuple):
    """Parameters that vary."""

    place: str
    """Argument, option, or file with line, for errors."""
    pattern: str
    """A key, or a pattern for all that it matches."""
    text: str | None
    """The distribution; None for 0.5 to 1.5 times the value."""


def resolve(scene: Scene, request: Request) -> dict[str, Distribution]:
    """Distribution of each parameter of `scene` that a request names."""
    with At(request.place):
        keys = _native.matching_keys(scene.native, request.pattern)
        diameters = {}
        if isinstance(request.text, str) and re.fullmatch(r"\s*[A-Za-z]+\d+\s*/.*", request.text):
            diameters = {key: size for name in keys for key, size in _diameters(scene, name).items()}
            keys = list(diameters)
        found: dict[str, Distribution] = {}
        for key in keys:
            with At(key):
                one = found[key] = _of_parameter(scene, key, request.text, diameters.get(key))
            # One without limits is checked at its median.
            for value in (one.low, one.high, float(one.quantile(np.array(0.5)))):
                if np.isfinite(value):
                    scene.set({key: value})
        return found


def _diameters(scene: Scene, key: str) -> dict[str, float | None]:
    """Diameter of the ball or pin with the play `key`, m; None if it is no play of a round part.

    A clearance that joints of different size share has another fit at each of them: its place is taken by those of the joints.
    """
    if key != SHARED:
        joint = re.fullmatch(r"(joint\..*\.)(clearance|play\.radial)", key)
        return {key: 2.0 * _number(scene, joint[1] + RADII[joint[2]]) if joint else None}
    other = scene.set({SHARED: 2e-6 if scene[SHARED] == 1e-6 else 1e-6})
    keys = scene.parameters.keys()
    round_parts = [
        (f"joint.{name}.{play}", f"joint.{name}.{radius}")
        for name in scene.ball_joints
        for play, radius in RADII.items()
        if f"joint.{name}.{play}" in keys
    ]
    sizes = {play: 2.0 * _number(scene, radius) for play, radius in round_parts if other[play] != scene[play]}
    common = set(sizes.values()) or {2.0 * _number(scene, "contact.ball_radius")}
    return {SHARED: common.pop()} if len(common) == 1 else dict(sizes)


def _number(scene: Scene, key: str) -> float:
    value = scene[key]
    assert isinstance(value, float)
    return value


def _of_parameter(scene: Scene, key: str, text: str | None, diameter: float | None) -> Distribution:
    parameter = scene.parameter(key)
    if not isinstance(parameter.value, float) or parameter.range is None:
        raise OptionError("its values are not real numbers")
    if text is not None and not is_a(text, str):
        raise OptionError(f"{text!r} is not a distribution: expected text, {FORMS}")
    if text is None:
        low, high = sorted(float(np.clip(part * parameter.value, *parameter.range)) for part in DEFAULT_RANGE)
        _check(
            low < high,
            f"is {parameter.text} in the scene, so the default range, 0.5 to 1.5 times this value, is empty: give a range, KEY=A..B",
        )
        return uniform(low, high, is_assumed=True)

    def fit(name: str) -> Distribution:
        if diameter is None:
            raise OptionError(f"a fit gives a clearance, and {key} is none")
        return radial_clearance(name, diameter)

    return parse(text, lambda part: _native.read_number(scene.native, key, part), fit)
