"""Multibody dynamics of mechanisms with play in their joints.

    >>> import jointplay as jp
    >>> scene = jp.Scene.load("four-bar").set(clearance="0.2 mm")
    >>> run = scene.run("50 ms", every="0.1 ms")
    >>> run["A.normal"].max()

Quantities are floats in SI units, or text with a unit ("0.5 mm"). The same scene and the same calls give the same bits as the
program `jointplay`: compare `Run.hash` with the state hash that `jointplay run` prints.
"""

from . import _native
from ._compare import Comparison, compare
from ._control import Elements, Linearisation, Load, Lubricant, Motor, Spring
from ._fit import FitStart, ParameterFit, fit
from ._geometry import Shape
from ._render import render
from ._scene import Channel, Check, Parameter, Quantity, Run, Scene
from ._sensitivity import Changes, Effects, Ends, Indices, Sensitivity, Target, sensitivity
from ._simulation import Frame, Simulation
from ._study import Estimate, Runs, Study
from ._sweep import Sweep, SweepResult, sweep
from ._tolerance import FitChoice, Fits, Quality, RejectDriver, Tolerance, tolerance
from ._tradeoff import Tradeoff, TradeoffRow, tradeoff
from ._wear import Wear, wear
from .errors import (
    ChannelError,
    DoubtWarning,
    InternalError,
    InUseError,
    JointplayError,
    OmissionWarning,
    OptionError,
    SceneError,
    Stopped,
)

State = _native.State
__version__ = _native.__version__

__all__ = [
    "Changes",
    "Channel",
    "ChannelError",
    "Check",
    "Comparison",
    "DoubtWarning",
    "Effects",
    "Elements",
    "Ends",
    "Estimate",
    "FitChoice",
    "FitStart",
    "Fits",
    "Frame",
    "InUseError",
    "Indices",
    "InternalError",
    "JointplayError",
    "Linearisation",
    "Load",
    "Lubricant",
    "Motor",
    "OmissionWarning",
    "OptionError",
    "Parameter",
    "ParameterFit",
    "Quality",
    "Quantity",
    "RejectDriver",
    "Run",
    "Runs",
    "Scene",
    "SceneError",
    "Sensitivity",
    "Shape",
    "Simulation",
    "Spring",
    "State",
    "Stopped",
    "Study",
    "Sweep",
    "SweepResult",
    "Target",
    "Tolerance",
    "Tradeoff",
    "TradeoffRow",
    "Wear",
    "__version__",
    "compare",
    "fit",
    "render",
    "sensitivity",
    "sweep",
    "tolerance",
    "tradeoff",
    "wear",
]
