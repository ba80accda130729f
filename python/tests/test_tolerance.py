"""Lots of machines with limits: yields, percentiles, drivers of rejects, and the cheapest fits."""

import itertools
import json
import pickle

import numpy as np
import pandas
import pytest
from scipy import stats

import jointplay as jp
from jointplay import __main__ as command
from jointplay import _fits, _tolerance

FOUR_BAR = {"joint.*.clearance": "0.05mm..0.2mm", "contact.friction": "normal(0.1, 0.01, 0.05..0.15)"}


def machine():
    """Short runs in which both balls have impacts."""
    return jp.Scene.load("four-bar").set({"solver.preset": "real-time"})


def test_yields_have_wilsons_interval():
    # Newcombe 1998, Statistics in Medicine 17, 857-872, table I, method 3.
    for accepted, units, low, high in [
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ]:
        found = _tolerance.wilson(np.arange(units) < accepted)
        assert found == pytest.approx((accepted / units, low, high), abs=5e-5)


@pytest.mark.parametrize("p", [0.5, 0.8, 0.9, 0.95, 0.99])
def test_intervals_of_yields_cover_at_the_stated_rate(p):
    # Exactly, and for 60 lots.
    units = 200
    found = np.array([_tolerance.wilson(np.arange(units) < accepted) for accepted in range(units + 1)])
    covers = (found[:, 1] <= p) & (p <= found[:, 2])
    rate = stats.binom.pmf(np.arange(units + 1), units, p) @ covers
    # Wilson's interval has the stated rate on average over p; at one p the rate depends on which counts are possible.
    assert 0.93 <= rate <= 0.98
    lots = [np.random.default_rng(seed).binomial(units, p) for seed in range(60)]
    # At least 57 are expected, with a standard deviation of 1.7.
    assert covers[lots].sum() >= 52


def test_intervals_of_percentiles_are_tabulated_order_statistics():
    # Median at 95 %: values 2 and 9 of ten, 40 and 61 of a hundred (Conover 1999, table A3 and section 3.2).
    def percentile(n, p):
        return _tolerance.evaluate(np.arange(1.0, n + 1), None, 1.0).percentiles[p]

    assert percentile(10, 50) == (5.5, 2.0, 9.0)
    assert percentile(100, 50)[1:] == (40.0, 61.0)
    # Too few values for the upper end: 0.99^367 > 0.025 > 0.99^368.
    assert (percentile(367, 99).high, percentile(368, 99).high) == (np.inf, 368.0)


def test_intervals_of_percentiles_and_of_cpk_cover_at_the_stated_rate():
    covered = np.zeros(2)
    for seed in range(1000):
        random = np.random.default_rng(seed)
        # Exponential: strongly skewed. Its 95 % percentile is ln 20.
        percentile = _tolerance.evaluate(random.exponential(size=200), None, 1.0).percentiles[95]
        cpk = _tolerance.evaluate(random.normal(size=100), None, 4.0).cpk
        covered += [percentile.low <= np.log(20.0) <= percentile.high, cpk.low <= 4.0 / 3.0 <= cpk.high]
    # 950 with a standard deviation of 7; order statistics are conservative, and Bissell's interval is approximate.
    assert 930 <= covered[0] <= 990 and 920 <= covered[1] <= 980, covered


def test_capability_indices_follow_their_definition():
    values, deviation = np.array([9.0, 10.0, 11.0, 10.0]), np.sqrt(2.0 / 3.0)
    both = _tolerance.evaluate(values, 6.0, 13.0)
    assert both.cp == pytest.approx(7.0 / (6.0 * deviation)) and both.cpk.value == pytest.approx(1.0 / deviation)
    one = _tolerance.evaluate(values, 6.0, None)
    assert one.cp is None and one.cpk.value == pytest.approx(4.0 / (3.0 * deviation))
    # A mean outside the limits.
    assert _tolerance.evaluate(values, None, 9.5).cpk.value < 0.0
    constant = _tolerance.evaluate(np.full(5, 2.0), 0.0, 1.0)
    assert (constant.cp, constant.cpk) == (None, None) and constant.yield_.value == 0.0
    empty = _tolerance.evaluate(np.full(5, np.nan), 0.0, 1.0)
    assert empty.percentiles[50] is None and np.isnan(empty.mean) and empty.yield_.value == 0.0


def test_the_inputs_that_cause_rejects_stand_out():
    random = np.random.default_rng(99)
    inputs = {name: random.normal(size=2000) for name in "abc"} | {"d": np.full(2000, 3.0)}
    # Rejected where the first is large or the second far from its mean; the third has no influence.
    found = _tolerance.drive(inputs, (inputs["a"] < 1.5) & (abs(inputs["b"]) < 2.0))
    assert found["a"].mean_shift > 0.8 and found["a"].p_value < 1e-10
    assert abs(found["b"].mean_shift) < 0.5 and found["b"].distance > 0.15 and found["b"].p_value < 1e-3
    assert abs(found["c"].mean_shift) < 0.3 and found["c"].p_value > 0.01
    assert found["d"] == (0.0, 0.0, 1.0)
    assert _tolerance.drive(inputs, np.ones(2000, bool)) is None is _tolerance.drive(inputs, np.zeros(2000, bool))


def test_a_yield_counts_the_runs_that_hold_all_limits():
    limits = {"peak-force": "140 N", "impacts": (7, "12")}
    found = jp.tolerance(machine(), FOUR_BAR, limits, runs=64, duration="20 ms", threads=2)
    force, impacts = found.results.T
    accepted = (force <= 140.0) & (impacts >= 7.0) & (impacts <= 12.0)
    assert 0 < accepted.sum() < (force <= 140.0).sum() < 64, "the limits split the lot"
    assert (found.accepted == accepted).all() and found.yield_.value == accepted.mean()
    assert (found.missed, found.not_started, found.diverged) == ((~accepted).sum(), 0, 0)
    quality = found.qualities["peak-force"]
    assert quality.yield_.value == (force <= 140.0).mean() and quality.mean == pytest.approx(force.mean(), rel=1e-14)
    low, high = np.sort(force)[[59, 60]]
    assert quality.percentiles[95].value == pytest.approx(0.15 * low + 0.85 * high, rel=1e-12)
    assert quality.cpk.value == pytest.approx((140.0 - force.mean()) / (3.0 * force.std(ddof=1)), rel=1e-12)
    assert list(found.drivers) == ["joint.A.clearance", "joint.B.clearance", "contact.friction"]
    for values, driver in zip(found.values.T, found.drivers.values(), strict=True):
        good, bad = np.sort(values[accepted]), np.sort(values[~accepted])
        distance = max(
            abs(np.searchsorted(good, v, "right") / len(good) - np.searchsorted(bad, v, "right") / len(bad)) for v in values
        )
        assert driver.distance == pytest.approx(distance, abs=1e-12)
    assert (found.values[:, :2] >= 0.05e-3).all() and (found.values[:, :2] <= 0.2e-3).all()
    again = pickle.loads(pickle.dumps(found))
    assert again.qualities == found.qualities and again.results.tobytes() == found.results.tobytes()
    assert len(found.to_pandas()) == 1 + 7 + 8


def test_a_limit_of_a_pattern_holds_for_each_channel():
    found = jp.tolerance(machine(), FOUR_BAR, {"*.normal:max": "20N..1000N"}, runs=4, duration="2 ms")
    assert found.limits == {"A.normal:max": (20.0, 1000.0), "B.normal:max": (20.0, 1000.0)}


def test_one_default_is_a_thousand_units_of_a_sobol_sequence():
    lot = jp.tolerance(jp.Scene.load("pendulum"), {"contact.friction": "0..1"}, {"peak-force": 1.0}, duration="1 us")
    assert len(lot.accepted) == 1000
    # The first 512 points of a Sobol sequence have one in each interval.
    assert sorted((512 * lot.values[:512, 0]).astype(int)) == list(range(512))


def test_units_that_do_not_start_are_counted_apart():
    # The sliders reach the platform only from some planes.
    scene = jp.Scene.load("spcmm").set({"solver.preset": "real-time"})
    found = jp.tolerance(scene, {"spcmm.slider_plane": "-100mm..60mm"}, {"tip-error": "50um"}, runs=16, duration="2 ms")
    errors = found.results[:, 0]
    finite = np.isfinite(errors)
    assert 0 < finite.sum() < 16 and found.not_started == 16 - finite.sum() and found.diverged == 0
    assert found.missed == (errors[finite] > 50e-6).sum() and found.accepted.sum() == (errors[finite] <= 50e-6).sum()
    assert found.qualities["tip-error"].mean == pytest.approx(errors[finite].mean(), rel=1e-14)


class Stack:
    """A stack of gaps and the largest acceptable sum. Each gap is uniform from 0 to a width that halves from one candidate to the
    next."""

    def __init__(self, joints, candidates, seed):
        random = np.random.default_rng(seed)
        self.widths = 1.0 + random.random(joints)
        # Costs grow with tightness apart from some noise: a few candidates cost more than a tighter one.
        self.costs = 1.6 ** np.arange(candidates) * (1.0 + random.random((joints, candidates)))
        self.units = random.random((400, joints))
        self.limit = 0.3 * self.widths.sum()
        self.evaluated = []

    def yield_of(self, choice):
        return np.mean(self.units @ (self.widths * 0.5 ** np.array(choice)) <= self.limit)

    def cost(self, choice):
        return sum(own[i] for own, i in zip(self.costs, choice, strict=True))

    def search(self, required, evaluations):
        def reaches(choice):
            assert choice not in self.evaluated
            self.evaluated.append(choice)
            return self.yield_of(choice) >= required

        self.evaluated = []
        found = _fits.Search(self.costs.tolist(), evaluations, reaches)
        assert found.evaluations == len(self.evaluated) <= evaluations
        return found


def test_the_search_finds_the_lowest_cost_of_an_enumeration():
    evaluations = 0
    for seed in range(20):
        for required in (0.9, 0.97):
            stack = Stack(4, 5, seed)
            found = stack.search(required, 10_000)
            reaching = [c for c in itertools.product(range(5), repeat=4) if stack.yield_of(c) >= required]
            assert found.is_proven and stack.cost(found.best) == pytest.approx(min(map(stack.cost, reaching)), rel=1e-12)
            evaluations += found.evaluations
    assert 20 * evaluations < 40 * 5**4, "a twentieth of the choices"


def test_a_yield_that_the_tightest_fits_miss_takes_one_evaluation():
    stack = Stack(3, 4, 1)
    stack.limit = 1e-3
    found = stack.search(0.99, 100)
    assert (found.best, found.is_proven, found.evaluations) == (None, True, 1)


def test_with_few_evaluations_the_result_reaches_the_yield_but_is_not_proven():
    stack = Stack(5, 5, 2)
    every = stack.search(0.9, 10_000)
    last = np.inf
    for most in (1, 3, 8, every.evaluations - 1):
        found = stack.search(0.9, most)
        assert not found.is_proven and found.evaluations == most and stack.yield_of(found.best) >= 0.9
        assert stack.cost(every.best) <= stack.cost(found.best) <= last
        last = stack.cost(found.best)


def test_many_joints_take_few_evaluations_when_the_costs_are_alike():
    # 6^12 choices. Any three joints on the second level reach the yield, so that the proof must exclude all pairs.
    found = _fits.Search([[1.0, 2.0, 4.0, 8.0, 16.0, 32.0]] * 12, 1000, lambda choice: sum(min(c, 1) for c in choice) >= 3)
    assert sorted(found.best) == [0] * 9 + [1] * 3 and found.is_proven and found.evaluations < 66 + 50


COST = {
    "joint.A.clearance": {"0.05mm..0.2mm": 1.0, "0.05mm..0.1mm": 3.0},
    "joint.B.clearance": {"0.05mm..0.2mm": 2.0, "0.05mm..0.1mm": 7.0},
}


def test_the_cheapest_fits_are_those_of_an_exhaustive_search():
    options = {"runs": 32, "duration": "20 ms"}
    yields = {}
    for choice in itertools.product(*COST.values()):
        over = FOUR_BAR | dict(zip(COST, choice, strict=True))
        yields[choice] = jp.tolerance(machine(), over, {"peak-force": 125.0}, **options).yield_
    assert len({one.value for one in yields.values()}) > 1
    for required in {one.value for one in yields.values()}:
        found = jp.tolerance(machine(), FOUR_BAR, {"peak-force": 125.0}, cost=COST, yield_=required, **options)
        costs = {c: sum(COST[key][fit] for key, fit in zip(COST, c)) for c, one in yields.items() if one.value >= required}
        best = min(costs, key=costs.get)
        fits = found.fits
        assert (tuple(fits.best.fits.values()), fits.best.cost, fits.best.yield_) == (best, costs[best], yields[best])
        assert fits.is_proven and fits.order_not_checked == [] and fits.required_yield == required
        stages = [f"fits-{n}" for n in range(1, fits.evaluations + 1)]
        assert list(found.runs) == ["lot", *stages, "fits-check"]
        check = found.runs["fits-check"]
        assert fits.check == _tolerance.wilson(check.results[:, 0] <= 125.0)
        expected = "held" if fits.check.low >= required else "missed" if fits.check.high < required else "open"
        assert fits.verdict == expected
        # The check uses units of its own.
        assert not {tuple(row) for row in check.values} & {tuple(row) for s in ["lot", *stages] for row in found.runs[s].values}


def test_without_limits_the_order_of_candidates_is_not_checked():
    cost = {"joint.A.clearance": {"normal(0.1mm, 5um)": 1.0, "normal(0.1mm, 2um)": 2.0}}
    fits = jp.tolerance(machine(), FOUR_BAR, {"peak-force": 1e6}, runs=8, duration="1 ms", cost=cost, evaluations=1).fits
    assert fits.order_not_checked == ["joint.A.clearance"] and not fits.is_proven and fits.best.cost == 2.0


def test_the_command_and_the_function_judge_the_same_lot(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    over, limit = {"joint.*.clearance": "0.05mm..0.2mm", "contact.friction": "normal(0.15, 0.02)"}, {"tip-error": "0.25 mm"}
    lot = jp.tolerance(jp.Scene.load("four-bar"), over, limit, runs=64, duration="20 ms")
    words = "tolerance four-bar --limit tip-error=0.25mm --runs 64 --duration 20ms --out lot --quiet --summary json".split()
    assert command.main([*words, *(f"--over={key}={text}" for key, text in over.items())]) == 0
    results = json.loads(capsys.readouterr().out)
    assert results["yield"] == lot.yield_._asdict() and 0 < results["accepted"] == lot.accepted.sum() < 64
    runs = pandas.read_csv(tmp_path / "lot" / "runs.csv")
    assert np.allclose(runs.iloc[:, 1:4], lot.values, rtol=1e-11) and np.allclose(runs.iloc[:, 4:5], lot.results, rtol=1e-11)
