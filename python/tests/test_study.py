"""Uncertain parameters: their distributions, and the machine as a function of them."""

import copy
import os
import pickle
import re

import numpy as np
import pytest
from scipy import stats

import jointplay as jp
from jointplay import _options, _study
from jointplay._distribution import parse, uniform

OVER = {"joint.*.clearance": "0.05mm..0.2mm", "contact.friction": "normal(0.15, 0.02, 0.05..0.25)"}


def read(text):
    return parse(text, lambda part: float(part.strip().removesuffix("um")), lambda fit: uniform(7.0, 41.0))


@pytest.mark.parametrize(
    "text, mean, deviation, low, high",
    [
        ("1um..3um", 2.0, 2.0 / np.sqrt(12.0), 1.0, 3.0),
        ("uniform(1, 3um)", 2.0, 2.0 / np.sqrt(12.0), 1.0, 3.0),
        ("normal(20um, 3)", 20.0, 3.0, -np.inf, np.inf),
        ("normal(20, 3, 14..23)", *(float(part) for part in stats.truncnorm(-2, 1, 20, 3).stats()), 14.0, 23.0),
        ("triangular(0, 1, 5)", 2.0, np.sqrt(21.0 / 18.0), 0.0, 5.0),
        ("triangular(0, 0, 3)", 1.0, np.sqrt(0.5), 0.0, 3.0),
        ("measured(1um, 0)", 0.5, 1.0 / np.sqrt(12.0), 0.0, 1.0),
        (" 4 ", 4.0, 0.0, 4.0, 4.0),
        ("H7/g6", 24.0, 34.0 / np.sqrt(12.0), 7.0, 41.0),
    ],
)
def test_quantiles_have_the_moments_of_their_distribution(text, mean, deviation, low, high):
    law = read(text)
    assert (law.low, law.high) == (low, high)
    # The midpoint rule misses the outermost tails of a normal distribution.
    values = law.quantile((np.arange(200_000) + 0.5) / 200_000)
    if "14..23" in text:
        deviation = np.sqrt(deviation)
    assert values.mean() == pytest.approx(mean, abs=1e-5) and values.std() == pytest.approx(deviation, abs=2e-3)
    assert (np.diff(values) >= 0.0).all() and values[0] >= low and values[-1] <= high


@pytest.mark.parametrize("low, high", [(30.0, 31.0), (-31.0, -30.0), (-1.0, 8.0)])
def test_quantiles_rise_even_in_a_far_tail(low, high):
    values = read(f"normal(0, 1, {low}..{high})").quantile(np.arange(1, 1000) / 1000)
    assert (np.diff(values) > 0.0).all() and values[0] >= low and values[-1] <= high


def test_measured_values_are_joined_linearly():
    assert read("measured(5, 1, 3)").quantile(np.array([0.0, 0.25, 0.5, 0.75, 1.0])).tolist() == [1.0, 2.0, 3.0, 4.0, 5.0]


def test_ends_are_limits_or_quantiles():
    assert read("1..3").ends == (1.0, 3.0) and read("1..3").probabilities == (0.0, 1.0)
    # 97.5 % quantile of the normal distribution.
    assert read("normal(0, 1)").ends == pytest.approx((-1.959963984540054, 1.959963984540054), rel=1e-14)


def sizes(ball, own=""):
    """Two balls whose clearances are those of the scene, unless `own` gives the second one of its own."""
    text = '[contact]\nclearance = "0.02 mm"\nball_radius = "10 mm"\n'
    for n, more in ((1, ""), (2, f'ball_radius = "{ball} mm"\n{own}')):
        text += f"""
[[body]]
name = "b{n}"
mass = "1 kg"
inertia = "1e-3 1e-3 1e-3 kg m^2"
[[joint]]
name = "f{n}"
kind = "free"
child = "b{n}"
start = {{ position = [0, 0, 0] }}
[[ball_joint]]
name = "S{n}"
socket = {{ body = "world" }}
ball = {{ body = "b{n}" }}
{more}"""
    return jp.Scene.from_toml('start = "as-given"\n' + text)


@pytest.mark.parametrize(
    "scene, key, expected",
    [
        # H7/g6: radial clearances of 3.5 um to 20.5 um at 20 mm, 5 um to 29.5 um at 60 mm (ISO 286-2, tables 2 and 4).
        (sizes(30), "contact.clearance", {"joint.S1.clearance": (3.5, 20.5), "joint.S2.clearance": (5.0, 29.5)}),
        (sizes(10), "contact.clearance", {"contact.clearance": (3.5, 20.5)}),
        (sizes(30, 'clearance = "0.03 mm"'), "contact.clearance", {"contact.clearance": (3.5, 20.5)}),
        (sizes(30), "joint.S2.clearance", {"joint.S2.clearance": (5.0, 29.5)}),
        (sizes(30), "*.clearance", {"joint.S1.clearance": (3.5, 20.5), "joint.S2.clearance": (5.0, 29.5)}),
    ],
)
def test_a_fit_is_that_of_every_ball(scene, key, expected):
    found = jp.sensitivity(scene, {key: "H7/g6"}, "peak-force", rows=0, duration="1 us").alone["peak-force"]
    assert list(found) == list(expected)
    for name, ends in expected.items():
        assert (1e6 * found[name].low, 1e6 * found[name].high) == pytest.approx(ends, rel=1e-12)


def test_a_shared_clearance_takes_the_fit_of_the_only_ball():
    text = sizes(30).toml
    text = text[: text.index('[[body]]\nname = "b2"')].replace('name = "S1"', 'name = "S1"\nball_radius = "30 mm"')
    lot = jp.tolerance(jp.Scene.from_toml(text), {"contact.clearance": "H7/g6"}, {"peak-force": 1.0}, runs=4096, duration="1 us")
    assert lot.values.min() >= 5e-6 and lot.values.max() <= 29.5e-6 and lot.values.mean() == pytest.approx(17.25e-6, rel=1e-3)


def test_samples_are_uniform_and_spread_as_they_should():
    for sampling in _study.SAMPLINGS:
        unit = _study.sample(sampling, 3, 1000, 7)
        assert unit.shape == (1000, 3) and unit.min() > 0.0 and unit.max() < 1.0
        # Standard error of the mean of independent numbers: 0.009.
        assert abs(unit.mean(0) - 0.5).max() < 0.04
        assert (_study.sample(sampling, 3, 1000, 8) != unit).all()
        occupied = [len(set((64 * _study.sample(sampling, 3, 64, 7)[:, i]).astype(int))) for i in range(3)]
        assert (occupied == [64] * 3) == (sampling != "random")


def test_a_study_is_a_function_of_its_parameters():
    scene = jp.Scene.load("four-bar")
    study = jp.Study(scene, ["contact.clearance"], "A.normal:max", duration="5 ms")
    assert study.assumed_ranges == {"contact.clearance": (0.5 * 1e-4, 1.5 * 1e-4)}
    assert study.inputs == {"contact.clearance": 1e-4} and study.outputs == {"A.normal:max": "N"}
    results = study.run(np.array([[1e-4], [2e-4]]))
    for clearance, (force,) in zip([1e-4, 2e-4], results):
        run = scene.set(clearance=clearance).run("5 ms", warn=False)
        assert force == run.statistics["joints"]["A"]["peak_normal"]
    assert pickle.loads(pickle.dumps(study)).run([[2e-4]], threads=1).tolist() == results[1:].tolist()
    # With one parameter, a flat list has one run per value.
    assert study.run([1e-4, 2e-4]).tobytes() == results.tobytes()
    again = copy.deepcopy(study)
    assert again.outputs == study.outputs and again.scene == scene
    for wrong, message in [
        ([[1e-4, 2e-4]], "2 numbers are given for 1"),
        (np.zeros((1, 1, 1)), "shape (1, 1, 1)"),
        ([["a"]], "one row per run and one column for each of contact.clearance: could not convert"),
        ([[1e-4], [1e-4, 2e-4]], "one column for each of contact.clearance"),
    ]:
        with pytest.raises(jp.OptionError, match=re.escape(message)):
            study.run(wrong)


def test_a_row_without_a_result_is_named_and_costs_no_other_row():
    study = jp.Study(jp.Scene.load("four-bar"), ["contact.clearance"], "A.normal:max", duration="5 ms")
    with pytest.warns(jp.DoubtWarning, match=r"^four-bar: no result: values\[1\] = \[nan\] is not finite$"):
        results = study.run([[1e-4], [np.nan], [2e-4]])
    assert np.isnan(results[1]).all() and results[[0, 2]].tobytes() == study.run([1e-4, 2e-4]).tobytes()
    with pytest.warns(jp.DoubtWarning, match=r"values\[0\] = \[inf\]"):
        assert np.isnan(study.run([[np.inf]])).all()
    coarse = jp.Scene.load("spcmm").set({"solver.method": "rk4", "solver.step": "1 ms"})
    with pytest.warns(jp.DoubtWarning, match=r"values\[0\] diverged"):
        assert np.isnan(jp.Study(coarse, ["contact.clearance"], "impacts", duration="1 s").run([[5e-4]])).all()


def test_default_ranges_stay_within_what_is_allowed():
    study = jp.Study(jp.Scene.load("four-bar"), ["contact.restitution", "joint.A.clearance"], "peak-force", duration="1 ms")
    assert study.assumed_ranges == {"contact.restitution": (0.45, 1.0), "joint.A.clearance": (0.5e-4, 1.5 * 1e-4)}


def test_numbers_of_the_scene_file_vary_like_parameters():
    scene = jp.Scene.from_toml("""
start = "equilibrium"
[[parameter]]
name = "k"
label = "Spring"
value = "20 N/mm"
range = ["10 N/mm", "40 N/mm"]
help = "Stiffness."
[[body]]
name = "car"
mass = "400 kg"
inertia = "1 1 1 kg m^2"
[[joint]]
name = "heave"
kind = "prismatic"
child = "car"
axis = [0, 0, 1]
[[joint_spring]]
name = "spring"
joint = "heave"
stiffness = "k"
damping = "1000 N s/m"
""")
    # The standard deviation of the stiffness is smaller than its allowed minimum.
    over = {"body.*.mass": "normal(400kg, 10kg)", "parameter.k": "normal(20N/mm, 0.5N/mm)"}
    found = jp.sensitivity(scene, over, "heave.position:mean", rows=0, duration="1 ms").alone["heave.position:mean"]
    z = stats.norm.ppf(0.975)
    # A mass rests on a spring at -m g / k.
    for key, low, high in [
        ("body.car.mass", -(400 - 10 * z) * 9.81 / 20e3, -(400 + 10 * z) * 9.81 / 20e3),
        ("parameter.k", -400 * 9.81 / (20e3 - 500 * z), -400 * 9.81 / (20e3 + 500 * z)),
    ]:
        assert (found[key].at_low, found[key].at_high) == pytest.approx((low, high), rel=1e-6)


def test_an_interrupted_study_resumes(tmp_path):
    study = jp.Study(jp.Scene.load("four-bar"), ["contact.clearance"], "A.normal:max", duration="5 ms")
    # So many that a busy computer does not finish them before it stops.
    values, record = np.linspace(1e-4, 2e-4, 1000)[:, None], tmp_path / "record"
    expected = study.run(values)
    seen = []

    def stop(part):
        seen.append(part)
        if part > 0.01:
            raise ArithmeticError

    with pytest.raises(ArithmeticError):
        study.run(values, threads=1, progress=stop, record=record)
    kept = record.read_text().splitlines()
    assert 3 <= len(kept) - 1 < len(values)
    # A line that was being written.
    record.write_text("\n".join(kept) + "\n123.4 ")
    seen.clear()
    assert study.run(values, threads=1, progress=seen.append, record=record).tobytes() == expected.tobytes()
    assert seen[0] == 0.0 and seen[1] >= (len(kept) - 1) / len(values) and seen[-1] == 1.0
    assert study.run(values, record=record).tobytes() == expected.tobytes()
    with pytest.raises(jp.OptionError, match=r"record was started with other settings \(vary\)"):
        study.run(values + 1e-5, record=record)
    record.write_text("x")
    with pytest.raises(OSError, match="no finished blocks"):
        study.run(values, record=record)


def test_threads_change_no_bit():
    study = jp.Study(jp.Scene.load("four-bar"), OVER, ["tip-error", "peak-force"], duration="5 ms")
    values = study.run([[1e-4, 1e-4, 0.1], [2e-4, 1e-4, 0.1], [1e-4, 2e-4, 0.2]], threads=1)
    for threads in [3, -1]:
        again = study.run([[1e-4, 1e-4, 0.1], [2e-4, 1e-4, 0.1], [1e-4, 2e-4, 0.2]], threads=threads)
        assert values.tobytes() == again.tobytes()
    assert _options.workers(-1) == _options.workers(None) == os.cpu_count()


@pytest.mark.parametrize("calls", [0, 1])
@pytest.mark.parametrize(
    "work",
    [
        lambda scene, progress: jp.sensitivity(scene, OVER, "peak-force", rows=8, duration="1 ms", progress=progress),
        lambda scene, progress: jp.tolerance(scene, OVER, {"peak-force": 1.0}, runs=8, duration="1 ms", progress=progress),
        lambda scene, progress: jp.Study(scene, ["contact.friction"], duration="1 ms").run([[0.1], [0.2]], progress=progress),
    ],
)
def test_a_panic_within_a_study_is_an_internal_error(work, calls):
    # PyO3 panics in Rust when a called function raises this: at the beginning of a stage, or between its runs.
    panic = next(kind for kind in BaseException.__subclasses__() if kind.__name__ == "PanicException")
    seen = []

    def progress(part):
        seen.append(part)
        if len(seen) > calls:
            raise panic("no such thing")

    with pytest.raises(jp.InternalError, match=r"^internal error in jointplay [0-9.]+: no such thing\. This is a bug"):
        work(jp.Scene.load("four-bar"), progress)
    assert seen[0] == 0.0 and len(seen) == calls + 1


@pytest.mark.parametrize(
    "limit", ["", "uniform", "uniform(1um, 2um", "uniform(10um)", "gauss(1um)", "measured()", "(1um)", "1um.."]
)
def test_what_is_no_distribution_is_refused(limit):
    with pytest.raises(jp.OptionError, match="^over: contact.clearance: "):
        jp.Study(jp.Scene.load("four-bar"), {"contact.clearance": limit})


def test_more_parameters_than_a_study_has_are_refused():
    parts = ["clearance", "friction", "restitution", "youngs_modulus", "poisson_ratio", "ball_radius"]
    with pytest.raises(jp.OptionError, match="72 uncertain parameters; expected at most 64"):
        jp.Study(jp.Scene.load("hexapod"), [f"joint.*.{part}" for part in parts])


CLEARANCE = ["contact.clearance"]


@pytest.mark.parametrize(
    "work, message",
    [
        (lambda scene: jp.sensitivity(scene, {"contact.clearence": None}), "did you mean `contact.clearance`"),
        (
            lambda scene: jp.Study(scene, ["joint.*.clearence"]),
            "^over: no number of the scene matches joint.*.clearence .did you",
        ),
        (lambda scene: jp.Study(scene, ["contact.friction_law"]), "its values are not real numbers|no number"),
        (lambda scene: jp.Study(scene, {"contact.clearance": "normal(1mm)"}), "contact.clearance: `normal(1mm)` is not a dist"),
        (lambda scene: jp.Study(scene, {"contact.clearance": "uniform(1mm, 5 s)"}), "`uniform(1mm, 5 s)`: 5 s: wrong unit"),
        (lambda scene: jp.Study(scene, {"contact.clearance": "3um..1um"}), "must be below the upper one"),
        (lambda scene: jp.Study(scene, {"contact.friction": "normal(3, 0)"}), "above 0"),
        (lambda scene: jp.Study(scene, {"contact.friction": "triangular(3, 2, 4)"}), "ascending order"),
        (lambda scene: jp.Study(scene, {"contact.clearance": "-1mm..1mm"}), "-1 mm: out of range; allowed 0 mm to below"),
        (lambda scene: jp.Study(scene, {"contact.clearance": "0mm..10mm"}), "10 mm must be below the ball radius"),
        (lambda scene: jp.Study(scene, {"contact.friction": "H7/g6"}), "a fit gives a clearance, and contact.friction is none"),
        (lambda scene: jp.Study(scene, {"joint.A.clearance": "H7/q6"}), "`H7/q6`: `q6` is not a tolerance class"),
        (
            lambda scene: jp.Study(scene, {"body.coupler.mass": "-1kg..2kg"}),
            "^over: body.coupler.mass = -1 kg: out of range; allowed above 0 up to 1e9 kg; units kg",
        ),
        (
            lambda scene: jp.Study(scene, {"body.coupler.mass": "normal(1kg, 1kg)"}, "peak-force"),
            "body.coupler.mass: -0.959964 kg: out of range; allowed above 0 up to 1e9 kg; units kg,",
        ),
        (
            lambda scene: jp.Study(scene, {"body.coupler.inertia.x": "-1 kg m^2..1 kg m^2"}),
            "^over: .*body.coupler.inertia = .*: no body has this inertia",
        ),
        (lambda scene: jp.Study(scene.set(clearance=0.0), CLEARANCE), "is 0 mm in the scene, so the default range, 0.5 to 1.5"),
        (
            lambda scene: jp.Study(scene, ["body.coupler.mass"], duration="1 ms").run([[-1.0]]),
            "^body.coupler.mass: -1 kg: out of range; allowed above 0 up to 1e9 kg",
        ),
        (lambda scene: jp.Study(scene, CLEARANCE).run([[1e-4]], threads=0), "^threads = 0: .*, or -1 for one per core$"),
        (lambda scene: jp.Study(scene, CLEARANCE).run([[1e-4]], threads=True), "^threads = True: "),
        (
            lambda scene: jp.Study(scene, {"contact.clearance": (1e-4, 2e-4)}),
            "^over: contact.clearance: (0.0001, 0.0002) is not a distribution: expected text, a value, `LOW..HIGH`",
        ),
        (lambda scene: jp.Study(scene, {"contact.clearance": 1e-4}), "^over: contact.clearance: 0.0001 is not a distribution"),
        (lambda scene: jp.Study(scene, 5), "^over = 5: expected a mapping"),
        (lambda scene: jp.Study(scene, CLEARANCE, 5), "^output = 5: expected text"),
        (lambda scene: jp.tolerance(scene, CLEARANCE, 5), "^limits: "),
        (
            lambda scene: jp.tolerance(scene, CLEARANCE, {"tip-error": [1.0, 2.0, 3.0]}),
            "expected an upper limit, or a lower and an",
        ),
        (lambda scene: jp.tolerance(scene, CLEARANCE, {"tip-error": 1.0}, yield_="99%"), "^yield_ = '99%': allowed above 0"),
        (lambda scene: jp.sensitivity(scene, CLEARANCE, "tip-eror"), "^output: tip-eror: expected CHANNEL"),
        (lambda scene: jp.sensitivity(scene, CLEARANCE, "impacts,impacts"), "impacts: given twice"),
        (lambda scene: jp.sensitivity(scene, CLEARANCE, rows=4), "^rows = 4: allowed .* 8 .* or 0 for no indices"),
        (lambda scene: jp.sensitivity(scene, CLEARANCE, rows=8.5), "^rows = 8.5: "),
        (lambda scene: jp.sensitivity(scene, CLEARANCE, screen=-1), "^screen = -1: "),
        (lambda scene: jp.sensitivity(scene, CLEARANCE, seed=-1), "^seed = -1: "),
        (lambda scene: jp.sensitivity(scene, CLEARANCE, target="5 kg"), "^target of tip-error: "),
        (lambda scene: jp.sensitivity(scene, CLEARANCE, target=float("inf")), "^target of tip-error: inf: expected a finite"),
        (lambda scene: jp.sensitivity(scene, {}), "at least one"),
        (lambda scene: jp.sensitivity(scene, CLEARANCE, from_="1 ms"), "^from_: give the duration, too"),
        (lambda scene: jp.sensitivity(scene, CLEARANCE, duration="1 ms", from_="2 ms"), "before the end"),
        (lambda scene: jp.tolerance(scene, CLEARANCE, {}), "^limits: "),
        (lambda scene: jp.tolerance(scene, CLEARANCE, {"tip-error": "5 kg"}), "^limit of tip-error: "),
        (lambda scene: jp.tolerance(scene, CLEARANCE, {"tip-error": (2.0, 1.0)}), "must be below the upper one"),
        (lambda scene: jp.tolerance(scene, CLEARANCE, {"tip-error": ".."}), "expected a value, or LOW..HIGH"),
        (lambda scene: jp.tolerance(scene, CLEARANCE, {"tip-error": (None, None)}), "expected a value, or LOW..HIGH"),
        (
            lambda scene: jp.tolerance(scene, CLEARANCE, {"tip-error": 1.0}, sampling="sobl"),
            "^sampling = 'sobl': there are: sobol",
        ),
        (lambda scene: jp.tolerance(scene, CLEARANCE, {"tip-error": 1.0}, runs=0), "^runs = 0: allowed .* 2 to 1000000"),
        (lambda scene: jp.tolerance(scene, CLEARANCE, {"tip-error": 1.0}, yield_=99), "^yield_ = 99: allowed above 0 up to 1"),
        (lambda scene: jp.tolerance(scene, CLEARANCE, {"tip-error": 1.0}, cost={}), "^cost: "),
        (
            lambda scene: jp.tolerance(scene, CLEARANCE, {"tip-error": 1.0}, cost={"contact.friction": {"0..1": 1}}),
            "^cost: contact.friction: give the parameter a distribution",
        ),
        (
            lambda scene: jp.tolerance(scene, CLEARANCE, {"tip-error": 1.0}, cost={"contact.clearance": {"0mm..1mm": -1}}),
            "^cost: contact.clearance: cost -1: expected a finite number",
        ),
        (
            lambda scene: jp.tolerance(
                scene, CLEARANCE, {"tip-error": 1.0}, cost={"contact.clearance": {"0mm..1mm": 1, "0mm..2mm": 2}}
            ),
            "^cost: contact.clearance: 0mm..2mm is wider than the candidate before it",
        ),
    ],
)
def test_bad_studies_are_refused(work, message):
    with pytest.raises(jp.JointplayError, match=re.sub(r"[()]", r"\\\g<0>", message)):
        work(jp.Scene.load("four-bar"))
