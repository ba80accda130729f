"""Which fraction of a lot of machines meets its limits, what drives the rejects, and the cheapest fits that reach a yield."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._distribution import At, Distribution, Request, resolve
from ._fits import Search
from ._options import is_a, library, whole
from ._study import DIVERGED, NOT_STARTED, Estimate, Over, Progress, Runs, Stages, Study, read_quantity, sample
from .errors import OptionError

if TYPE_CHECKING:
    import pandas

    from ._scene import Quantity, Scene

PERCENTILES = (50, 95, 99)
CONFIDENCE = 0.95
WIDER = 1.0 + 1e-9
"""Ratio of two widths up to which they are equal."""

Limits = tuple[float | None, float | None]
"""Lower and upper limit of an output, SI; None where there is none."""


@dataclass(frozen=True)
class Quality:
    """Statistics of one limited output over a lot."""

    yield_: Estimate
    """Fraction of the lot that meets this limit."""
    mean: float
    """Mean of the units with a result, SI."""
    deviation: float
    """Standard deviation of the units with a result, SI."""
    percentiles: dict[int, Estimate | None]
    """50th, 95th and 99th percentile, SI; None without results."""
    cp: float | None
    """Process capability Cp; None with one limit, or without spread."""
    cpk: Estimate | None
    """Process capability Cpk; None without spread."""


class RejectDriver(NamedTuple):
    """How one parameter differs between rejected and accepted units."""

    mean_shift: float
    """Mean of the rejected minus mean of the accepted units, in standard deviations."""
    distance: float
    """Kolmogorov-Smirnov distance of the two distributions."""
    p_value: float
    """Probability of such a distance if the parameter has no influence."""


class FitChoice(NamedTuple):
    """One of the candidates of each parameter that has candidates."""

    fits: dict[str, str]
    """Fit of each parameter, as it was given."""
    costs: dict[str, float]
    """Cost of each of them."""
    cost: float
    """Sum of the costs."""
    yield_: Estimate
    """Fraction of the lot that meets all limits with these fits."""


@dataclass(frozen=True)
class Fits:
    """The cheapest fits that reach a required yield."""

    required_yield: float
    """The yield that they must reach."""
    best: FitChoice | None
    """The cheapest choice found; None if even the tightest fits miss the yield."""
    is_proven: bool
    """Whether every cheaper choice is known to fail, provided that a tighter fit never lowers the yield."""
    evaluations: int
    """Number of choices that were evaluated."""
    check: Estimate | None
    """Yield of the best choice in another lot."""
    verdict: str | None
    """Whether the check confirms the required yield: `held` with 95 % confidence, `missed`, or `open` with too few units."""
    order_not_checked: list[str]
    """Parameters with a candidate without limits, which may not be tighter than the one before it."""


@dataclass(frozen=True)
class Tolerance:
    """Result of `tolerance`."""

    yield_: Estimate
    """Fraction of the lot that meets all limits."""
    not_started: int
    """Units of the lot that do not start, which are rejected."""
    diverged: int
    """Units of the lot that the divergence guard stops, which are rejected."""
    qualities: dict[str, Quality]
    """Statistics of each limited output."""
    drivers: dict[str, RejectDriver] | None
    """How rejects differ from accepted units, by parameter; None if all units or none are accepted."""
    fits: Fits | None
    """The cheapest fits; None without `cost`."""
    inputs: dict[str, float]
    """Value in the scene, SI, of each parameter."""
    units: dict[str, str]
    """SI unit of each parameter and output."""
    limits: dict[str, Limits]
    """Lower and upper limit of each output, SI; None where there is none."""
    assumed_ranges: dict[str, tuple[float, float]]
    """Ends, SI, of each range that was not given: 0.5 to 1.5 times the value, within the allowed range."""
    span: tuple[float, float]
    """Length of each run and end of its transient, s."""
    accepted: NDArray[np.bool_] = field(repr=False)
    """Whether each unit meets all limits."""
    runs: dict[str, Runs] = field(repr=False)
    """All runs by stage: `lot`, then `fits-1`, `fits-2`, … and `fits-check`."""

    @property
    def values(self) -> NDArray[np.float64]:
        """Values of the parameters of each unit, SI: shape (units, parameters)."""
        return self.runs["lot"].values

    @property
    def results(self) -> NDArray[np.float64]:
        """Limited outputs of each unit, SI: shape (units, outputs)."""
        return self.runs["lot"].results

    @property
    def missed(self) -> int:
        """Units of the lot that have a result and miss a limit."""
        return int((~self.accepted).sum()) - self.not_started - self.diverged

    def to_pandas(self) -> pandas.DataFrame:
        """One row per output and statistic, SI: the columns of `tolerance.csv`."""
        library("pandas", "pandas")
        import pandas

        rows: list[tuple[Any, ...]] = [("all", "", None, None, "yield", *self.yield_)]
        for name, quality in self.qualities.items():
            head = name, self.units[name], *self.limits[name]
            for statistic, value in statistics(quality).items():
                rows.append((*head, statistic, *(value if isinstance(value, tuple) else (value, None, None))))
        frame = pandas.DataFrame(rows, columns=["output", "unit", "lower", "upper", "statistic", "value", "low", "high"])
        return frame.astype({name: float for name in ("lower", "upper", "value", "low", "high")})


def statistics(quality: Quality) -> dict[str, float | Estimate | None]:
    """Statistics of an output by their names in files; Cp only with two limits."""
    found: dict[str, float | Estimate | None] = {"yield": quality.yield_, "mean": quality.mean, "deviation": quality.deviation}
    found |= {f"percentile_{p}": value for p, value in quality.percentiles.items()}
    return found | ({} if quality.cp is None else {"cp": quality.cp}) | {"cpk": quality.cpk}


class Price(NamedTuple):
    """A candidate of a parameter, with its cost."""

    place: str
    """Argument, or file with line, for errors."""
    pattern: str
    """A key, or a pattern for all that it matches."""
    fit: str
    """The distribution, as text."""
    cost: float | str
    """The cost in any currency, at least 0."""


class Candidate(NamedTuple):
    """A distribution that a parameter may have."""

    text: str
    distribution: Distribution
    cost: float


def tolerance(
    scene: Scene,
    over: Over,
    limits: Mapping[str, Quantity | tuple[Quantity | None, Quantity | None]],
    *,
    runs: int = 1000,
    sampling: str = "sobol",
    seed: int = 1,
    cost: Mapping[str, Mapping[str, float]] | Sequence[Price] | None = None,
    yield_: float = 0.99,
    evaluations: int = 64,
    duration: Quantity | None = None,
    from_: Quantity | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
    record: str | os.PathLike[str] | None = None,
) -> Tolerance:
    """Which fraction of a lot meets its limits, and what drives the rejects.

    The lot has `runs` units, one run each. `limits` has an upper limit for each output, or a lower and an upper one, of which one
    may be None; text such as `"20N..500N"` or `"1um.."`, too. A pattern of channels limits each of them. `sampling` is `sobol`,
    best with a power of two units, `latin-hypercube` or `random`.

    `cost` has the cost of each candidate of a parameter or pattern, from the loosest to the tightest:
    `{"joint.S1.clearance": {"H8/f7": 1.0, "H7/g6": 2.5}}`. With it, the result also has the cheapest fits with a yield of at
    least `yield_`, found with at most `evaluations` evaluated choices. `progress` is called with the fraction of each lot. With
    `record`, an interrupted call resumes when it is repeated, from the files `record`.STAGE.partial, which stay. The other
    arguments are those of `Study`.
    """
    whole("runs", runs, 2, 1_000_000)
    whole("evaluations", evaluations, 1, 10_000)
    whole("seed", seed, 0, 2**63 - 1)
    if not is_a(yield_, int, float) or not 0.0 < yield_ <= 1.0:
        raise OptionError(f"yield_ = {yield_!r}: allowed above 0 up to 1")
    if not is_a(limits, Mapping) or not limits:
        raise OptionError("limits: give a limit for at least one output")
    study = Study(scene, over, list(limits), duration=duration, from_=from_)
    given = list(limits.items())
    bounds = {name: _read_limits(study, o, *given[entry]) for o, (name, _, entry) in enumerate(study.native.outputs)}
    candidates = None if cost is None else _candidates(study, cost)

    stages = Stages(study, threads, progress, record)
    distributions = list(study.distributions.values())
    unit = sample(sampling, len(distributions), runs, seed)
    lower, upper = (np.array([bound[side] for bound in bounds.values()], dtype=float) for side in (0, 1))

    def run_lot(stage: str, unit: NDArray[np.float64], laws: Sequence[Distribution]) -> NDArray[np.bool_]:
        """Whether each unit meets all limits."""
        values = np.column_stack([law.quantile(unit[:, i]) for i, law in enumerate(laws)])
        return np.asarray(_meets(stages.run(stage, values), lower, upper).all(axis=1))

    accepted = run_lot("lot", unit, distributions)
    lot = stages.runs["lot"]
    fits = None
    if candidates is not None:
        independent = sample("random", len(distributions), runs, (seed + 1) % 2**63)
        keys = list(study.distributions)

        def yield_of(stage: str, choice: Sequence[int], unit: NDArray[np.float64]) -> Estimate:
            chosen = {key: own[i].distribution for (key, own), i in zip(candidates.items(), choice, strict=True)}
            laws = [chosen.get(key, law) for key, law in zip(keys, distributions, strict=True)]
            return wilson(run_lot(stage, unit, laws))

        fits = _cheapest(candidates, yield_, evaluations, yield_of, unit, independent)
    return Tolerance(
        yield_=wilson(accepted),
        not_started=int((lot.status == NOT_STARTED).sum()),
        diverged=int((lot.status == DIVERGED).sum()),
        qualities={name: evaluate(lot.results[:, o], *bound) for o, (name, bound) in enumerate(bounds.items())},
        drivers=drive(dict(zip(study.inputs, lot.values.T, strict=True)), accepted),
        fits=fits,
        inputs=study.inputs,
        units=study.units | study.outputs,
        limits=bounds,
        assumed_ranges=study.assumed_ranges,
        span=study.span,
        accepted=accepted,
        runs=stages.runs,
    )


def _read_limits(study: Study, o: int, name: str, given: Any) -> Limits:
    with At(f"limit of {name}"):
        if isinstance(given, str):
            low, dots, high = given.partition("..")
            given = (low.strip() or None, high.strip() or None) if dots else (None, given)
        pair = tuple(given) if is_a(given, tuple, list) else (None, given)
        if len(pair) != 2:
            raise OptionError(f"{given!r}: expected an upper limit, or a lower and an upper one")
        lower, upper = (None if end is None else read_quantity(study, o, end) for end in pair)
        if lower is None and upper is None:
            raise OptionError("expected a value, or LOW..HIGH")
        if lower is not None and upper is not None and lower >= upper:
            raise OptionError("the lower limit must be below the upper one")
        return lower, upper


def _meets(results: NDArray[np.float64], lower: Any, upper: Any) -> NDArray[np.bool_]:
    """Whether results are within limits, of which NaN is none; a result that is NaN is not."""
    low, high = np.nan_to_num(np.asarray(lower, float), nan=-np.inf), np.nan_to_num(np.asarray(upper, float), nan=np.inf)
    return np.asarray((results >= low) & (results <= high))


def wilson(accepted: NDArray[np.bool_]) -> Estimate:
    """Fraction of accepted units, with Wilson's interval (1927, J. Am. Stat. Assoc. 22, 209-212)."""
    found = library("scipy.stats").binomtest(int(accepted.sum()), len(accepted))
    interval = found.proportion_ci(CONFIDENCE, method="wilson")
    return Estimate(float(found.statistic), float(interval.low), float(interval.high))


def evaluate(results: NDArray[np.float64], lower: float | None, upper: float | None) -> Quality:
    """Statistics of an output with its limits. Results that are not finite only count as rejects."""
    stats = library("scipy.stats")
    within, finite = _meets(results, lower, upper), results[np.isfinite(results)]
    n = len(finite)
    mean = float(finite.mean()) if n else np.nan
    deviation = float(finite.std(ddof=1)) if n > 1 else np.nan
    percentiles: dict[int, Estimate | None] = {}
    for p in PERCENTILES:
        percentiles[p] = None
        if n:
            # Between order statistics, which holds for any distribution; an end that the sample is too small for is NaN.
            interval = stats.quantile_test(finite, p=p / 100.0).confidence_interval(CONFIDENCE)
            low, high = (float(end) for end in interval)
            value = float(np.quantile(finite, p / 100.0))
            percentiles[p] = Estimate(value, -np.inf if np.isnan(low) else low, np.inf if np.isnan(high) else high)
    cp = cpk = None
    if deviation > 0.0:
        low, high = (-np.inf if lower is None else lower), (np.inf if upper is None else upper)
        index = min(mean - low, high - mean) / (3.0 * deviation)
        # Bissell 1990, Applied Statistics 39, 331-340.
        half = float(stats.norm.ppf(0.5 + 0.5 * CONFIDENCE)) * float(np.sqrt(1.0 / (9.0 * n) + index**2 / (2.0 * (n - 1))))
        cpk = Estimate(index, index - half, index + half)
        cp = None if lower is None or upper is None else (upper - lower) / (6.0 * deviation)
    return Quality(wilson(within), mean, deviation, percentiles, cp, cpk)


def drive(inputs: Mapping[str, NDArray[np.float64]], accepted: NDArray[np.bool_]) -> dict[str, RejectDriver] | None:
    """How rejected units differ from accepted ones in each input; None if all units or none are accepted."""
    if accepted.all() or not accepted.any():
        return None
    drivers: dict[str, RejectDriver] = {}
    for key, values in inputs.items():
        good, bad = values[accepted], values[~accepted]
        if np.ptp(values) == 0.0:
            drivers[key] = RejectDriver(0.0, 0.0, 1.0)
            continue
        with warnings.catch_warnings():
            # SciPy says so when it takes the limit distribution, where the exact probability is out of reach.
            warnings.simplefilter("ignore", RuntimeWarning)
            found = library("scipy.stats").ks_2samp(bad, good)
        shift = (bad.mean() - good.mean()) / values.std(ddof=1)
        drivers[key] = RejectDriver(float(shift), float(found.statistic), float(found.pvalue))
    return drivers


def _candidates(study: Study, cost: Mapping[str, Mapping[str, float]] | Sequence[Price]) -> dict[str, list[Candidate]]:
    """Candidates of each parameter, from the loosest to the tightest."""
    if isinstance(cost, Mapping):
        cost = [Price("cost", key, fit, price) for key, fits in cost.items() for fit, price in fits.items()]
    if not cost:
        raise OptionError("cost: give at least one candidate")
    found: dict[str, list[Candidate]] = {}
    for place, pattern, text, price in cost:
        try:
            amount = float(price)
        except ValueError:
            amount = np.nan
        if not 0.0 <= amount < np.inf:
            raise OptionError(f"{place}: {pattern}: cost {price}: expected a finite number of at least 0")
        for key, distribution in resolve(study.scene, Request(place, pattern, text)).items():
            with At(f"{place}: {key}"):
                if key not in study.distributions:
                    raise OptionError("give the parameter a distribution of its own, too")
                own = found.setdefault(key, [])
                if own and distribution.high - distribution.low > WIDER * (own[-1].distribution.high - own[-1].distribution.low):
                    raise OptionError(
                        f"{text} is wider than the candidate before it; list the candidates of a parameter from the loosest to "
                        "the tightest"
                    )
                own.append(Candidate(text, distribution, amount))
    return found


def _cheapest(
    candidates: Mapping[str, list[Candidate]],
    required: float,
    evaluations: int,
    yield_of: Any,
    unit: NDArray[np.float64],
    independent: NDArray[np.float64],
) -> Fits:
    """All choices are evaluated at the points `unit`. These favour the choice that they select, so that it is checked at others."""
    yields: dict[tuple[int, ...], Estimate] = {}

    def reaches(choice: tuple[int, ...]) -> bool:
        yields[choice] = yield_of(f"fits-{len(yields) + 1}", choice, unit)
        return yields[choice].value >= required

    search = Search([[one.cost for one in own] for own in candidates.values()], evaluations, reaches)
    best, check, verdict = None, None, None
    if search.best is not None:
        chosen = {key: own[i] for (key, own), i in zip(candidates.items(), search.best, strict=True)}
        fits, costs = ({key: getattr(one, name) for key, one in chosen.items()} for name in ("text", "cost"))
        best = FitChoice(fits, costs, sum(costs.values()), yields[search.best])
        check = yield_of("fits-check", search.best, independent)
        verdict = "held" if check.low >= required else "missed" if check.high < required else "open"
    unchecked = [key for key, own in candidates.items() if len(own) > 1 and not all(one.distribution.is_limited for one in own)]
    return Fits(required, best, search.is_proven, search.evaluations, check, verdict, unchecked)
