"""Tests of the paper's statements: whether the results meet a criterion, and the numbers behind the verdict."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from ._paper_results import (
    COLUMNS,
    DERIVATIVES,
    PAPER,
    QUANTITIES,
    SERIES,
    Array,
    Case,
    Findings,
    Points,
    Record,
    Settled,
    amplitude,
)

NEGLIGIBLE = 0.05
"""Fraction of an amplitude below which a change is negligible; the criteria state it as 5 %."""

Reading = tuple[str, float, str]
"""A number behind a verdict: its description, its value, NaN if there is none, and its unit."""


class Verdict(NamedTuple):
    """Outcome of a test."""

    confirmed: bool
    """Whether the results meet the criterion."""
    criterion: str
    """Criterion for confirmation."""
    evidence: list[Reading]
    """The compared numbers."""


class Statement(NamedTuple):
    """A statement of the paper with its verdict."""

    place: str
    """Section and figure."""
    says: str
    """The statement in words."""
    verdict: Verdict
    """The verdict."""


def statements(findings: Findings) -> list[Statement]:
    """Every statement, in the order of the paper."""
    return [Statement(place, says, TESTS[test](findings, **given)) for place, says, test, given in PAPER["statement"]]


# --- Numbers and curves of the runs ---


def stays_near_ideal(findings: Findings, of: str, run: Sequence[float]) -> Verdict:
    most = findings.runs[_case(run)].value(f"largest deviation of {of}")
    share = most / amplitude(of)
    evidence = [_distance("at most", most, of), *_percent(["of the amplitude"], [share])]
    return Verdict(share < NEGLIGIBLE, "leaves the ideal motion by less than 5 % of its amplitude", evidence)


def grows(findings: Findings, of: str, over: str) -> Verdict:
    values = findings.values(of, over)
    criterion = "larger at each value than at the one before, in continuous time"
    return Verdict(_is_ascending(values), criterion, _by_run(over, values, QUANTITIES[of][0]))


def all_grow(findings: Findings, over: str) -> Verdict:
    tests = [given for _, _, test, given in PAPER["statement"] if test == "grows" and given["over"] == over]
    growing = sum(grows(findings, **given).confirmed for given in tests)
    evidence: list[Reading] = [("that grow", growing, ""), ("measured", len(tests), "")]
    return Verdict(growing == len(tests), "every measured quantity of section 4.2 grows at both steps", evidence)


def exceeds(findings: Findings, of: str, that: str, over: str) -> Verdict:
    large, small = findings.values(of, over), findings.values(that, over)
    evidence = _by_run(over, large, QUANTITIES[of][0]) + _by_run(over, small, QUANTITIES[that][0])
    larger = all(a > b for a, b in zip(large, small, strict=True))
    return Verdict(larger, "its peak is the larger number, in SI units, at all three values", evidence)


def no_rule(findings: Findings, of: str, over: str) -> Verdict:
    low, middle, high = values = findings.values(of, over)
    criterion = "the middle value has the largest or the smallest peak"
    return Verdict((middle - low) * (high - middle) < 0.0, criterion, _by_run(over, values, QUANTITIES[of][0]))


def differs_more(findings: Findings, of: str, than: str, over: str) -> Verdict:
    shares = [float(np.ptp(values) / np.mean(values)) for values in (findings.values(name, over) for name in (of, than))]
    criterion = "over the three values it differs by a larger share of its mean"
    return Verdict(shares[0] > shares[1], criterion, _percent([of, than], shares))


def changes_more_with(findings: Findings, of: str, over: str, than: str) -> Verdict:
    changes = {series: float(np.ptp(findings.values(of, series))) for series in (over, than)}
    evidence = [(series, change, QUANTITIES[of][0]) for series, change in changes.items()]
    criterion = "it changes more over the three values of this parameter than over those of the other"
    return Verdict(changes[over] > changes[than], criterion, evidence)


def steady(findings: Findings, after: float, over: str) -> Verdict:
    last = findings.values("last separation", over)
    return Verdict(all(time <= after for time in last), "no ball leaves its socket after that instant", _by_run(over, last, "s"))


def hardest(findings: Findings, joint: int, run: Sequence[float]) -> Verdict:
    peaks = findings.runs[_case(run)].peaks
    evidence = [(name, peak, "N") for name, peak in peaks.items()]
    criterion = "that joint has the largest peak force, in continuous time"
    return Verdict(peaks[f"S{joint}"] == max(peaks.values()), criterion, evidence)


def coincide(findings: Findings, runs: str, columns: list[str], after: float, ideal: bool = False) -> Verdict:
    nominal, *_ = records = list(findings.runs.values())
    of_series = [findings.runs[run] for run in SERIES[runs].runs] if runs in SERIES else [nominal, findings.lagrange]
    records = [*of_series, *([findings.ideal] if ideal else [])]
    shares = [_apart(records, column, after) for column in columns]
    evidence = [*_percent([COLUMNS[column].label for column in columns], shares), ("from", after, "s")]
    criterion = "no two curves are further apart than 5 % of the ideal motion's amplitude"
    return Verdict(_are_negligible(shares), criterion, evidence)


def formulations_agree(findings: Findings, of: list[str]) -> Verdict:
    nominal = next(iter(findings.runs.values()))
    apart = {c: formulations_apart(findings, c) for c in of}
    shares = [size / nominal.value(f"largest deviation of {c}") for c, size in apart.items()]
    evidence = [*_percent(of, shares), *(_distance(c, size, c) for c, size in apart.items())]
    criterion = "tree and lagrange agree within 5 % of the largest deviation from the ideal motion"
    return Verdict(_are_negligible(shares), criterion, evidence)


def formulations_apart(findings: Findings, coordinate: str) -> float:
    """Largest difference between the two formulations at the paper's output step, m or rad."""
    tree, lagrange = (
        record.samples(DERIVATIVES[coordinate][0]) for record in (next(iter(findings.runs.values())), findings.lagrange)
    )
    return float(np.abs(tree - lagrange).max())


# --- Phase portraits, sections and regimes ---


def portraits_coincide(findings: Findings, of: str, over: str) -> Verdict:
    curves = [settled.columns for settled in _settled(findings, over)]
    columns = DERIVATIVES[of][:2]
    share = max(_largest_range([curve[c] for curve in curves]) / amplitude(of, nth) for nth, c in enumerate(columns))
    criterion = "no two settled curves are further apart than 5 % of the amplitude at equal phases"
    return Verdict(_are_negligible([share]), criterion, _percent(["at most"], [share]))


def portraits_wide(findings: Findings, of: str, over: str, growing: bool = False) -> Verdict:
    widths = [settled.width[of] for settled in _settled(findings, over)]
    wide = all(width > findings.resolution[of] for width in widths) and (not growing or _is_ascending(widths))
    criterion = "successive settled periods differ by more than the resolution" + (", and increasingly" if growing else "")
    return Verdict(wide, criterion, _distances(findings, of, over, widths))


def sections_ascend(findings: Findings, of: str, over: str) -> Verdict:
    latest = findings.points[f"runs_by_{over}"].latest(of)
    further = bool((np.diff(latest) > findings.resolution[of]).all())
    return Verdict(further, "from value to value it grows by more than the resolution", _distances(findings, of, over, latest))


def sections_spread(findings: Findings, of: str, over: str) -> Verdict:
    spreads = findings.points[f"runs_by_{over}"].spread(of)
    wide = bool((spreads > findings.resolution[of]).all()) and _is_ascending(spreads)
    return Verdict(wide, "their spread is above the resolution and grows", _distances(findings, of, over, spreads))


def sections_crowd(findings: Findings, over: str) -> Verdict:
    points = findings.points[f"runs_by_{over}"]
    shares = [100.0 * share_near_mean(points, k, findings.resolution) for k in range(len(points.values))]
    criterion = (
        "they can be told apart, and more than half lie within half of the largest distance from their mean, "
        "in units of the resolution"
    )
    return Verdict(all(share > 50.0 for share in shares), criterion, _by_run(over, shares, "%"))


def share_near_mean(points: Points, point: int, resolution: dict[str, float]) -> float:
    """Fraction of the sections within half of the largest distance from their mean; NaN if they cannot be told apart."""
    scaled = np.array([points.sections[DERIVATIVES[c][0]][point] / resolution[c] for c in DERIVATIVES])
    distances = np.linalg.norm(scaled - scaled.mean(axis=1, keepdims=True), axis=0)
    furthest = distances.max()
    return float((distances < furthest / 2.0).mean()) if furthest > 0.5 else float("nan")


def sections_stay(findings: Findings, over: str, swept: bool) -> Verdict:
    points = findings.points[f"{over}_cold" if swept else f"runs_by_{over}"]
    shares = [float(np.ptp(points.latest(c)) / amplitude(c)) for c in DERIVATIVES]
    return Verdict(_are_negligible(shares), "they lie within 5 % of the amplitude of each other", _percent(DERIVATIVES, shares))


def sections_repeat(findings: Findings, of: str, over: str) -> Verdict:
    resolution, widest = findings.resolution[of], float(findings.points[f"{over}_cold"].spread(of).max())
    evidence = [_distance("largest spread", widest, of), _distance("resolution", resolution, of)]
    criterion = "at every point the latest half of the sections agree within the resolution"
    return Verdict(widest <= resolution, criterion, evidence)


def quasi_periodic(findings: Findings, over: str) -> Verdict:
    points = findings.points[f"runs_by_{over}"]
    regular = all(regime == "quasi-periodic" for regime in points.regimes)
    return Verdict(regular, "exponent not told from 0, regular 0-1 test, no period, in all three runs", _regimes(points))


def all_periodic(findings: Findings, over: str) -> Verdict:
    points = findings.points[f"{over}_cold"]
    return Verdict(all(r == "periodic 1" for r in points.regimes), "every point is periodic 1", _regimes(points))


def periodic_to_chaotic(findings: Findings, over: str) -> Verdict:
    points = findings.points[f"{over}_cold"]
    criterion = "the smallest value is periodic; at the largest the exponent is above its uncertainty"
    becomes = points.regimes[0].startswith("periodic") and points.regimes[-1] == "chaotic"
    return Verdict(becomes, criterion, _regimes(points))


def chaos_grows(findings: Findings, over: str) -> Verdict:
    points = findings.points[f"{over}_cold"]
    half, spreads = len(points.values) // 2, points.spread("beta")
    chaotic = [regime == "chaotic" for regime in points.regimes]
    below, above = sum(chaotic[:half]), sum(chaotic[half:])
    evidence: list[Reading] = [("chaotic in the lower half", below, ""), ("in the upper half", above, "")]
    evidence += [_distance("spread in the lower half", float(spreads[:half].max()), "beta")]
    evidence += [_distance("in the upper half", float(spreads[half:].max()), "beta")]
    return Verdict(above > below, "more chaotic points in the upper half of the values than in the lower half", evidence)


def chaos_all_or_none(findings: Findings, over: str) -> Verdict:
    points = findings.points[f"{over}_cold"]
    chaotic = points.regimes.count("chaotic")
    return Verdict(chaotic in (0, len(points.regimes)), "all points are chaotic or none is", _regimes(points))


TESTS: dict[str, Callable[..., Verdict]] = {
    "stays_near_ideal": stays_near_ideal,
    "grows": grows,
    "all_grow": all_grow,
    "exceeds": exceeds,
    "no_rule": no_rule,
    "differs_more": differs_more,
    "changes_more_with": changes_more_with,
    "steady": steady,
    "hardest": hardest,
    "coincide": coincide,
    "formulations_agree": formulations_agree,
    "portraits_coincide": portraits_coincide,
    "portraits_wide": portraits_wide,
    "sections_ascend": sections_ascend,
    "sections_spread": sections_spread,
    "sections_crowd": sections_crowd,
    "sections_stay": sections_stay,
    "sections_repeat": sections_repeat,
    "quasi_periodic": quasi_periodic,
    "all_periodic": all_periodic,
    "periodic_to_chaotic": periodic_to_chaotic,
    "chaos_grows": chaos_grows,
    "chaos_all_or_none": chaos_all_or_none,
}
"""Tests by the names that the table of the paper uses."""


# --- Comparisons and readings ---


def _case(run: Sequence[float]) -> Case:
    return run[0], run[1]


def _settled(findings: Findings, over: str) -> list[Settled]:
    curves = [findings.runs[run].settled for run in SERIES[over].runs]
    return [curve for curve in curves if curve is not None]


def _apart(records: list[Record], column: str, after: float) -> float:
    """Largest distance between any two curves from `after`, s, on, relative to the amplitude."""
    nth, of = next((columns.index(column), c) for c, columns in DERIVATIVES.items() if column in columns)
    late = records[0].time[:: records[0].stride] >= after - 1e-9
    return _largest_range([record.samples(column)[late] for record in records]) / amplitude(of, nth)


def _largest_range(curves: Sequence[Array]) -> float:
    """Largest distance between any two curves at equal indices."""
    return float(np.ptp(np.array(curves), axis=0).max())


def _is_ascending(values: Iterable[float]) -> bool:
    return bool((np.diff(list(values)) > 0.0).all())


def _are_negligible(shares: Iterable[float]) -> bool:
    return all(share < NEGLIGIBLE for share in shares)


def _by_run(over: str, values: Iterable[float], unit: str) -> list[Reading]:
    series = SERIES[over]
    return [(series.name(run), float(value), unit) for run, value in zip(series.runs, values, strict=True)]


def _percent(names: Iterable[str], shares: Iterable[float]) -> list[Reading]:
    return [(name, share * 100.0, "%") for name, share in zip(names, shares, strict=True)]


def _distance(name: str, size: float, coordinate: str) -> Reading:
    return name, size * 1e6, {"x": "µm", "beta": "µrad"}[coordinate]


def _distances(findings: Findings, of: str, over: str, sizes: Iterable[float]) -> list[Reading]:
    by_run = [_distance(SERIES[over].name(run), float(size), of) for run, size in zip(SERIES[over].runs, sizes, strict=True)]
    return [*by_run, _distance("resolution", findings.resolution[of], of)]


def _regimes(points: Points) -> list[Reading]:
    counts: list[Reading] = [(regime, number, "") for regime, number in Counter(points.regimes).items()]
    measured = points.exponents[np.isfinite(points.exponents)]
    if len(measured):
        counts += [("smallest exponent", float(measured.min()), "1/s"), ("largest exponent", float(measured.max()), "1/s")]
    return counts
