"""Which uncertain parameters move an output most."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._distribution import At
from ._options import library, whole
from ._study import DIVERGED, NOT_STARTED, Estimate, Over, Progress, Runs, Stages, Study, read_quantity, sample

if TYPE_CHECKING:
    import pandas

    from ._scene import Quantity, Scene

UNSCREENED = 8
"""Largest number of parameters for indices; more are screened first."""
TRAJECTORIES = 10
"""Default number of trajectories of a screening."""
LEVELS = 4
"""Levels of each parameter in a screening."""
NEGLIGIBLE = 0.05
"""Mean magnitude of an effect, relative to the largest, below which a parameter is screened out."""
MIN_ROWS = 8
"""Least number of complete rows from which indices are estimated."""
STEPS = 8
"""Steps from the value in the scene to the better end, on the way to a target."""
UNKNOWN = Estimate(np.nan, np.nan, np.nan)


@dataclass(frozen=True)
class Indices:
    """Sensitivity of one output to each parameter."""

    mean: float
    """Mean of the output, SI."""
    variance: float
    """Variance of the output, SI squared."""
    first: dict[str, Estimate]
    """First-order index: the share of the variance that vanishes on average when the parameter is fixed."""
    total: dict[str, Estimate]
    """Total index: the share that remains on average when all other parameters are fixed."""
    rows: int
    """Rows of the design from which they are estimated."""
    incomplete_rows: int
    """Rows that were left out because a run failed."""


class Ends(NamedTuple):
    """One parameter at the ends of its distribution, the others at their values in the scene."""

    low: float
    """Lower end of the parameter, SI."""
    at_low: float
    """Output there, SI; NaN for a run that fails."""
    high: float
    """Upper end of the parameter, SI."""
    at_high: float
    """Output there, SI; NaN for a run that fails."""


class Effects(NamedTuple):
    """Elementary effects of one parameter on the first output, from end to end of its distribution, SI."""

    mean: float
    """Mean effect."""
    mean_magnitude: float
    """Mean magnitude of the effect: the influence of the parameter."""
    deviation: float
    """Standard deviation: interactions and curvature."""
    low: float
    """Lower end of the parameter, SI."""
    high: float
    """Upper end of the parameter, SI."""
    ends: str
    """What the ends are: `limits` of the distribution, or `quantiles`, of 2.5 % and 97.5 %, where it has none."""


class Changes(NamedTuple):
    """Changed parameters that were run together."""

    values: dict[str, float]
    """Value of each changed parameter, SI."""
    output: float
    """First output there, SI."""


@dataclass(frozen=True)
class Target:
    """Changes of parameters with which the first output does not exceed a target."""

    target: float
    """Largest allowed value of the first output, SI."""
    single: list[Changes]
    """For each parameter that suffices alone, the smallest sufficient change that was run."""
    together: Changes | None
    """Changes of several parameters if none suffices alone. Empty if the scene meets the target; None if nothing reaches it."""


@dataclass(frozen=True)
class Sensitivity:
    """Result of `sensitivity`."""

    inputs: dict[str, float]
    """Value in the scene, SI, of each parameter."""
    units: dict[str, str]
    """SI unit of each parameter and output."""
    assumed_ranges: dict[str, tuple[float, float]]
    """Ends, SI, of each range that was not given: 0.5 to 1.5 times the value, within the allowed range."""
    span: tuple[float, float]
    """Length of each run and end of its transient, s."""
    nominal: dict[str, float]
    """Each output with the values of the scene, SI."""
    alone: dict[str, dict[str, Ends]]
    """For each output, the effect of every parameter alone."""
    together: dict[str, tuple[float, float]]
    """Each output with all parameters at their lower ends, and at their upper ends, SI."""
    screening: dict[str, Effects | None] | None
    """Effects of each parameter on the first output (None if the runs failed); None without a screening."""
    kept: list[str]
    """Parameters with indices; a screening omits the others."""
    indices: dict[str, Indices | str]
    """Indices of each output, or the reason why there are none; empty with rows=0."""
    target: Target | None
    """Changes that reach the target; None if none was given."""
    not_started: int
    """Number of runs, of all stages, that did not start."""
    diverged: int
    """Number of runs, of all stages, that the divergence guard stopped."""
    runs: dict[str, Runs] = field(repr=False)
    """All runs by stage: `alone`, `screening`, `indices`, `target`, `target-together`, as far as they were needed."""

    @property
    def values(self) -> NDArray[np.float64]:
        """Values of the parameters in each run of the indices, SI: shape (runs, parameters)."""
        return self.runs["indices"].values if "indices" in self.runs else np.empty((0, len(self.inputs)))

    @property
    def results(self) -> NDArray[np.float64]:
        """Outputs of each run of the indices, SI: shape (runs, outputs)."""
        return self.runs["indices"].results if "indices" in self.runs else np.empty((0, len(self.nominal)))

    def to_pandas(self) -> pandas.DataFrame:
        """One row per output and parameter, SI: the columns of `sensitivity.csv`."""
        library("pandas", "pandas")
        import pandas

        rows: list[dict[str, Any]] = []
        for output, alone in self.alone.items():
            indices = self.indices.get(output)
            for key, (low, at_low, high, at_high) in alone.items():
                row: dict[str, Any] = {"output": output, "unit": self.units[output]}
                row |= {"parameter": key, "parameter_unit": self.units[key]}
                row |= {"low": low, "high": high, "alone_low": at_low, "alone_high": at_high}
                for name, of_key in (("first_order", "first"), ("total", "total")):
                    estimate = getattr(indices, of_key).get(key) if isinstance(indices, Indices) else None
                    row |= dict(zip((name, f"{name}_low", f"{name}_high"), estimate or UNKNOWN, strict=True))
                rows.append(row)
        return pandas.DataFrame(rows)


def sensitivity(
    scene: Scene,
    over: Over,
    output: str | Sequence[str] = "tip-error",
    *,
    rows: int = 64,
    screen: int | None = None,
    target: Quantity | None = None,
    seed: int = 1,
    duration: Quantity | None = None,
    from_: Quantity | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
    record: str | os.PathLike[str] | None = None,
) -> Sensitivity:
    """Which uncertain parameters move an output most.

    The stages are: every parameter alone; a screening with `screen` trajectories (by default 10 if more than 8 parameters vary,
    otherwise none), after which unimportant parameters are omitted; first-order and total indices from `rows` rows of a Sobol
    sequence (rows (k + 2) runs for k parameters; a power of two is best, 0 for none); changes with which the first output is at
    most `target`. `progress` is called with the fraction of the present stage. With `record`, an interrupted call resumes when
    it is repeated, from the files `record`.STAGE.partial, which stay. The other arguments are those of `Study`.
    """
    whole("rows", rows, 0, 65536)
    if rows:
        whole("rows", rows, MIN_ROWS, 65536, ", or 0 for no indices")
    whole("seed", seed, 0, 2**63 - 1)
    study = Study(scene, over, output, duration=duration, from_=from_)
    keys, outputs = list(study.inputs), list(study.outputs)
    trajectories = (TRAJECTORIES if len(keys) > UNSCREENED else 0) if screen is None else whole("screen", screen, 0, 10000)
    limit = None
    if target is not None:
        with At(f"target of {outputs[0]}"):
            limit = read_quantity(study, 0, target)

    stages = Stages(study, threads, progress, record)
    ends = np.array([one.ends for one in study.distributions.values()])
    plan = study.native.alone(ends.tolist())
    nominal, *alone = stages.run("alone", [*plan, *ends.T.tolist()])
    sides = np.array(alone[:-2]).reshape(len(keys), 2, len(outputs))
    screening, kept = None, list(range(len(keys)))
    if trajectories:
        screening, kept = _screen(stages, trajectories, seed)
    indices = _indices(stages, kept, rows, seed) if rows else {}
    of_first = indices.get(outputs[0])
    return Sensitivity(
        inputs=study.inputs,
        units=study.units | study.outputs,
        assumed_ranges=study.assumed_ranges,
        span=study.span,
        nominal=dict(zip(outputs, nominal.tolist(), strict=True)),
        alone={
            name: {
                key: Ends(*map(float, (low, sides[i, 0, o], high, sides[i, 1, o])))
                for i, (key, (low, high)) in enumerate(zip(keys, ends, strict=True))
            }
            for o, name in enumerate(outputs)
        },
        together={name: (float(alone[-2][o]), float(alone[-1][o])) for o, name in enumerate(outputs)},
        screening=screening,
        kept=[keys[i] for i in kept],
        indices=indices,
        target=None if limit is None else _reach(stages, limit, ends, nominal[0], sides[:, :, 0], of_first),
        not_started=stages.count(NOT_STARTED),
        diverged=stages.count(DIVERGED),
        runs=stages.runs,
    )


def _screen(stages: Stages, trajectories: int, seed: int) -> tuple[dict[str, Effects | None], list[int]]:
    """Elementary effects (Morris 1991, Technometrics 33, 161-174) on the first output, and the parameters that remain."""
    distributions = stages.study.distributions
    k = len(distributions)
    problem = {"num_vars": k, "names": list(distributions), "bounds": [[0.0, 1.0]] * k}
    plan = library("SALib.sample.morris").sample(problem, trajectories, num_levels=LEVELS, seed=seed)
    lowest, highest = np.array([one.probabilities for one in distributions.values()]).T
    results = stages.run("screening", stages.at(lowest + plan * (highest - lowest)))
    moves = np.diff(plan.reshape(trajectories, k + 1, k), axis=1)
    changes = np.diff(results[:, 0].reshape(trajectories, k + 1), axis=1)
    moved, slopes = np.abs(moves).argmax(2), changes / moves.sum(2)
    effects: dict[str, Effects | None] = {}
    for i, (key, one) in enumerate(distributions.items()):
        own = slopes[moved == i]
        # An effect is missing on either side of a run that failed.
        own = own[np.isfinite(own)]
        effects[key] = None
        if len(own) > 1:
            mean, magnitude, deviation = (float(number) for number in (own.mean(), np.abs(own).mean(), own.std(ddof=1)))
            effects[key] = Effects(mean, magnitude, deviation, *one.ends, "limits" if one.is_limited else "quantiles")
    influence = np.array([one.mean_magnitude if one else 0.0 for one in effects.values()])
    largest = np.argsort(-influence, kind="stable")[:UNSCREENED]
    return effects, sorted(int(i) for i in largest if influence[i] >= NEGLIGIBLE * influence.max())


def _indices(stages: Stages, kept: list[int], rows: int, seed: int) -> dict[str, Indices | str]:
    """Indices of each output over the parameters `kept`, the others at their values in the scene.

    Row j has the point j of a sample A, that of a sample B, and for each parameter the point of A with this parameter from B.
    """
    k = len(kept)
    both = sample("sobol", 2 * k, rows, seed)
    a, b = both[:, :k], both[:, k:]
    points = np.stack([a, b, *(np.where(np.arange(k) == i, b, a) for i in range(k))], axis=1)
    results = stages.run("indices", stages.at(points.reshape(-1, k), kept)).reshape(rows, k + 2, -1)
    keys = list(stages.study.inputs)
    return {name: estimate_indices(results[:, :, o], [keys[i] for i in kept]) for o, name in enumerate(stages.study.outputs)}


def estimate_indices(results: NDArray[np.float64], keys: Sequence[str]) -> Indices | str:
    """First-order (Saltelli et al. 2010, Comput. Phys. Commun. 181, 259-270) and total indices (Jansen 1999, Comput. Phys.
    Commun. 117, 35-43) from the rows of a design, each with f(A), f(B) and f of every mixed point; or why there are none.

    A row with a result that is not finite is left out. The intervals are Student's with the error of the jackknife over rows, of a
    total index in its logarithm. As products of two deviations have long tails, they take half as many degrees of freedom as
    there are rows. They assume independent rows, and are too wide for a Sobol sequence on a smooth function.
    """
    complete = results[np.isfinite(results).all(1)]
    n = len(complete)
    if n < MIN_ROWS:
        return f"{n} of {len(results)} rows have all their results: at least {MIN_ROWS} are needed"
    mean = complete[:, :2].mean()
    a, b, mixed = complete[:, :1] - mean, complete[:, 1:2] - mean, complete[:, 2:] - mean
    # Sums over all rows, and over all but one.
    square, first, total, level = (
        np.concatenate([part.sum(0)[None], part.sum(0) - part]) / np.array([n] + [n - 1] * n)[:, None]
        for part in (0.5 * (a * a + b * b), b * (mixed - a), 0.5 * (mixed - a) ** 2, 0.5 * (a + b))
    )
    variance = square - level**2
    if not variance[0, 0] > (np.finfo(float).eps * mean) ** 2:
        return f"the variance of the result is 0: it is {mean:.6g}, whatever the inputs"
    # The mean of a difference, times the mean of B without the row.
    shift = np.concatenate([(mixed - a).sum(0)[None], (mixed - a).sum(0) - (mixed - a)]) / np.array([n] + [n - 1] * n)[:, None]
    first = (first - level * shift) / variance
    total = total / variance
    student = library("scipy.stats").t.ppf(0.975, 0.5 * n - 1.0)

    def errors(shares: NDArray[np.float64]) -> NDArray[np.float64]:
        left_out = shares[1:]
        return np.asarray(student * np.sqrt((n - 1) / n * ((left_out - left_out.mean(0)) ** 2).sum(0)))

    half, part = errors(first), errors(total)
    ratio = np.exp(np.divide(part, total[0], out=np.zeros_like(part), where=total[0] > 0.0))
    return Indices(
        mean=float(mean),
        variance=float(variance[0, 0]),
        first={key: Estimate(*map(float, (v, v - e, v + e))) for key, v, e in zip(keys, first[0], half, strict=True)},
        total={key: Estimate(*map(float, (v, v / r, v * r))) for key, v, r in zip(keys, total[0], ratio, strict=True)},
        rows=n,
        incomplete_rows=len(results) - n,
    )


def _reach(
    stages: Stages,
    limit: float,
    ends: NDArray[np.float64],
    now: float,
    sides: NDArray[np.float64],
    indices: Indices | str | None,
) -> Target:
    """Moves each parameter alone in equal steps towards its better end. If none suffices, moves them to their better ends one
    after another, those with the largest total index (or without indices the largest effect) first."""
    study = stages.study
    keys, nominal = list(study.inputs), np.array(list(study.inputs.values()))
    if now <= limit:
        return Target(limit, [], Changes({}, float(now)))
    is_upper = sides[:, 1] < sides[:, 0]
    better = np.where(is_upper, ends[:, 1], ends[:, 0])
    gain = now - np.where(is_upper, sides[:, 1], sides[:, 0])

    def path(start: NDArray[np.float64], i: int) -> NDArray[np.float64]:
        rows = np.tile(start, (STEPS, 1))
        rows[:, i] = nominal[i] + (better[i] - nominal[i]) * np.arange(1, STEPS + 1) / STEPS
        return rows

    def changed(row: NDArray[np.float64], output: float) -> Changes:
        return Changes({keys[i]: float(row[i]) for i in np.flatnonzero(row != nominal)}, float(output))

    rows = np.concatenate([path(nominal, i) for i in range(len(keys))])
    outputs = stages.run("target", rows)[:, 0].reshape(-1, STEPS)
    hits = [(i, int((own <= limit).argmax())) for i, own in enumerate(outputs) if (own <= limit).any()]
    if hits:
        return Target(limit, [changed(rows[i * STEPS + step], outputs[i, step]) for i, step in hits], None)
    total = {key: one.value for key, one in indices.total.items()} if isinstance(indices, Indices) else dict(zip(keys, gain))
    order = sorted((i for i in range(len(keys)) if gain[i] > 0.0), key=lambda i: (-total.get(keys[i], 0.0), -gain[i]))
    parts: list[NDArray[np.float64]] = []
    moved = nominal
    for i in order:
        parts.append(path(moved, i))
        moved = parts[-1][-1]
    if not parts:
        return Target(limit, [], None)
    rows = np.concatenate(parts)
    results = stages.run("target-together", rows)[:, 0]
    hit = np.flatnonzero(results <= limit).tolist()
    return Target(limit, [], changed(rows[hit[0]], results[hit[0]]) if hit else None)
