"""Studies of uncertain parameters: the numbers of `jointplay sensitivity` and `jointplay tolerance`."""

import json

import numpy as np
import pandas
import pytest

import jointplay as jp

OVER = {"joint.*.clearance": "0.05mm..0.2mm", "contact.friction": "normal(0.15, 0.02, 0.05..0.25)"}
OVER_OPTIONS = [f"--over={pattern}={text}" for pattern, text in OVER.items()]


def is_same(estimate, expected):
    # JSON has no infinity: an infinite end of an interval is null.
    return [value if np.isfinite(value) else None for value in estimate] == [expected[name] for name in ("value", "low", "high")]


def test_indices_are_those_of_the_program(program, tmp_path):
    options = ["--duration", "20ms", "--from", "2ms", "--rows", "16", "--seed", "5", "--summary", "json", "--quiet"]
    outputs = ["tip-error", "A.normal:max", "impacts"]
    expected = json.loads(
        program("sensitivity", "four-bar", *OVER_OPTIONS, "--output", ",".join(outputs), *options, "--out", tmp_path / "results")
    )
    result = jp.sensitivity(
        jp.Scene.load("four-bar"), OVER, outputs, rows=16, seed=5, duration="20 ms", start_after="2 ms", threads=2
    )
    assert list(result.inputs) == ["joint.A.clearance", "joint.B.clearance", "contact.friction"]
    assert list(result.indices) == outputs and result.values.shape == (16 * 5, 3) and result.results.shape == (80, 3)
    for output in expected["outputs"]:
        indices = result.indices[output["name"]]
        for parameter in output["parameters"]:
            assert is_same(indices.first[parameter["key"]], parameter["first_order"]), parameter
            assert is_same(indices.total[parameter["key"]], parameter["total"]), parameter
    table = result.to_pandas()
    assert len(table) == 9 and table["total_high"].ge(table["total_low"]).all()


def test_effects_alone_screening_and_target_are_those_of_the_program(program, tmp_path):
    options = ["--duration=5ms", "--rows=8", "--screen=2", "--target=1um", "--seed=3", "--summary=json", "--quiet"]
    outputs = ["tip-error", "peak-force"]
    expected = json.loads(
        program("sensitivity", "four-bar", *OVER_OPTIONS, "--output", ",".join(outputs), *options, "--out", tmp_path / "results")
    )
    result = jp.sensitivity(
        jp.Scene.load("four-bar"), OVER, outputs, rows=8, screen=2, target="1 um", seed=3, duration="5 ms", threads=2
    )
    for output in expected["outputs"]:
        name = output["name"]
        assert (result.nominal[name], result.units[name]) == (output["value"], output["unit"])
        assert result.together[name] == (output["all_low"], output["all_high"])
        for parameter in output["parameters"]:
            key = parameter["key"]
            assert result.alone[name][key] == tuple(parameter[end] for end in ("low", "alone_low", "high", "alone_high"))
            indices = result.indices[name]
            assert (key in indices.total) == (parameter["total"] is not None) == (key in result.kept)
    assert result.screening is not None and result.target is not None
    for effects in expected["screening"]:
        assert result.screening[effects["key"]] == tuple(effects[name] for name in ("mean", "mean_magnitude", "deviation"))

    def changes(expected):
        return expected and ({change["key"]: change["value"] for change in expected["changes"]}, expected["output"])

    target = expected["target"]
    assert result.target.target == target["target"] == 1e-6
    assert result.target.together == changes(target["together"])
    assert result.target.single == [
        ({one["change"]["key"]: one["change"]["value"]}, one["output"]) for one in target["single"]
    ]
    table = pandas.read_csv(tmp_path / "results" / "sensitivity.csv", keep_default_na=False, na_values="NaN")
    pandas.testing.assert_frame_equal(result.to_pandas(), table, rtol=1e-11, check_dtype=False)
    # Without indices.
    easy = jp.sensitivity(
        jp.Scene.load("four-bar"), ["joint.*.clearance"], rows=0, target=result.nominal["tip-error"] * 0.99, duration="5 ms"
    )
    assert easy.target is not None and easy.indices == {} and len(easy.values) == 0
    assert easy.target.single or easy.target.together is not None
    assert easy.assumed_ranges == {f"joint.{name}.clearance": (0.5 * 1e-4, 1.5 * 1e-4) for name in "AB"}
    assert result.assumed_ranges == {}


def test_the_cheapest_fits_are_those_of_the_program(program, tmp_path):
    cost = {
        "joint.A.clearance": {"0.05mm..0.2mm": 1.0, "0.05mm..0.1mm": 3.0},
        "joint.B.clearance": {"0.05mm..0.2mm": 2.0, "0.05mm..0.1mm": 7.0},
    }
    rows = [f"{key},{fit},{price}" for key, fits in cost.items() for fit, price in fits.items()]
    (tmp_path / "costs.csv").write_text("\n".join(["parameter,fit,cost", *rows]))
    verdicts = set()
    options = ["--duration=20ms", "--runs=32", "--yield=0.5", "--summary=json", "--quiet", "--force"]
    # No machine meets the second limit.
    for limit in (125.0, 1.0):
        search = [f"--cost={tmp_path / 'costs.csv'}", f"--limit=peak-force={limit}", "--out", tmp_path / "results"]
        expected = json.loads(program("tolerance", "four-bar", *OVER_OPTIONS, *options, *search))["fits"]
        result = jp.tolerance(
            jp.Scene.load("four-bar"),
            OVER,
            {"peak-force": limit},
            units=32,
            sampling="sobol",
            cost=cost,
            required_yield=0.5,
            duration="20 ms",
            threads=2,
        ).fits
        assert (result.is_proven, result.evaluations) == (expected["is_proven"], expected["evaluations"])
        assert result.order_not_checked == expected["order_not_checked"] == []
        if expected["best"] is None:
            assert result.best is None and result.check is None and result.verdict is None
            verdicts.add(None)
            continue
        assert result.best.cost == expected["best"]["cost"] and is_same(result.best.yield_, expected["best"]["yield"])
        assert result.best.fits == {one["key"]: one["fit"] for one in expected["best"]["fits"]}
        assert is_same(result.check, expected["check"]["yield"]) and result.verdict == expected["check"]["verdict"]
        verdicts.add(result.verdict)
    assert len(verdicts) == 2 and None in verdicts


def test_yields_are_those_of_the_program(program, tmp_path):
    options = ["--duration", "20ms", "--runs", "40", "--seed", "2", "--sampling", "sobol", "--summary", "json", "--quiet"]
    expected = json.loads(
        program(
            "tolerance",
            "four-bar",
            *OVER_OPTIONS,
            "--limit",
            "tip-error=250um",
            "--limit",
            "peak-force=20N..120N",
            *options,
            "--out",
            tmp_path / "results",
        )
    )
    limits = {"tip-error": "250 um", "peak-force": (20.0, "120 N")}
    result = jp.tolerance(
        jp.Scene.load("four-bar"), OVER, limits, units=40, seed=2, sampling="sobol", duration="20 ms", threads=2
    )
    assert is_same(result.yield_, expected["yield"]) and result.accepted.sum() == expected["accepted"]
    for output in expected["outputs"]:
        quality = result.qualities[output["name"]]
        assert is_same(quality.yield_, output["yield"]) and quality.mean == output["mean"] and quality.cp == output.get("cp")
        assert is_same(quality.percentiles[95], output["percentile_95"]) and is_same(quality.cpk, output["cpk"])
    drivers = {driver["key"]: driver for driver in expected["reject_drivers"]}
    assert 0 < expected["accepted"] < 40
    assert list(result.drivers) == ["joint.A.clearance", "joint.B.clearance", "contact.friction"]
    for key, driver in result.drivers.items():
        assert (driver.mean_shift, driver.distance, driver.p_value) == tuple(
            drivers[key][name] for name in ("mean_shift", "distance", "p_value")
        )


def test_a_study_is_a_function_of_its_parameters():
    scene = jp.Scene.load("four-bar")
    study = jp.Study(scene, ["contact.clearance"], "A.normal:max", duration="5 ms")
    assert study.assumed_ranges == {"contact.clearance": (0.5 * 1e-4, 1.5 * 1e-4)}
    assert study.inputs == {"contact.clearance": 1e-4} and study.outputs == {"A.normal:max": "N"}
    results = study.run(np.array([[1e-4], [2e-4]]))
    for clearance, (force,) in zip([1e-4, 2e-4], results):
        run = scene.set(clearance=clearance).run("5 ms", warn=False)
        assert force == run.statistics["joints"]["A"]["peak_normal"]
    with pytest.raises(jp.OptionError, match="2 numbers are given for 1"):
        study.run([[1e-4, 2e-4]])


@pytest.mark.parametrize("calls", [0, 1])
@pytest.mark.parametrize(
    "work",
    [
        lambda scene, progress: jp.sensitivity(scene, OVER, "peak-force", rows=8, duration="1 ms", progress=progress),
        lambda scene, progress: jp.tolerance(scene, OVER, {"peak-force": 1.0}, units=8, duration="1 ms", progress=progress),
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
    "work, message",
    [
        (lambda scene: jp.sensitivity(scene, {"contact.clearence": None}), "did you mean"),
        (lambda scene: jp.sensitivity(scene, {"contact.clearance": "normal(1)"}), "contact.clearance"),
        (lambda scene: jp.sensitivity(scene, {"contact.clearance": "-1mm..1mm"}), "allowed"),
        (
            lambda scene: jp.sensitivity(scene, {"body.coupler.mass": "-1kg..2kg"}),
            "^over: body.coupler.mass: -1kg: out of range; allowed above 0 up to 1e9 kg; units kg",
        ),
        (
            lambda scene: jp.Study(scene, ["body.coupler.mass"], duration="1 ms").run([[-1.0]]),
            "^body.coupler.mass: -1 kg: out of range; allowed above 0 up to 1e9 kg",
        ),
        (lambda scene: jp.sensitivity(scene, {"contact.clearance": None}, "tip-eror"), "^output: tip-eror: expected CHANNEL"),
        (lambda scene: jp.sensitivity(scene, {"contact.clearance": None}, rows=4), "^rows = 4: allowed at least 8, or 0"),
        (lambda scene: jp.sensitivity(scene, {"contact.clearance": None}, target="5 kg"), "target of tip-error"),
        (lambda scene: jp.sensitivity(scene, {}), "at least one"),
        (lambda scene: jp.sensitivity(scene, ["contact.clearance"], start_after="1 ms"), "duration"),
        (lambda scene: jp.tolerance(scene, ["contact.clearance"], {"tip-error": "5 kg"}), "upper limit of tip-error"),
        (lambda scene: jp.tolerance(scene, ["contact.clearance"], {"tip-error": (2.0, 1.0)}), "higher upper one"),
        (lambda scene: jp.tolerance(scene, ["contact.clearance"], {"*.normal:max": 1.0}), "not for a pattern"),
        (lambda scene: jp.tolerance(scene, ["contact.clearance"], {"tip-error": 1.0}, sampling="sobl"), "did you mean `sobol`"),
        (lambda scene: jp.tolerance(scene, ["contact.clearance"], {"tip-error": 1.0}, units=0), "^units = 0: "),
        (lambda scene: jp.tolerance(scene, ["contact.clearance"], {"tip-error": 1.0}, cost={}), "^cost: no joints"),
        (
            lambda scene: jp.tolerance(scene, ["contact.clearance"], {"tip-error": 1.0}, cost={"contact.friction": {"0..1": 1}}),
            "^cost: contact.friction: give the parameter a distribution",
        ),
    ],
)
def test_bad_studies_are_refused(work, message):
    with pytest.raises(jp.JointplayError, match=message.replace("*", r"\*")):
        work(jp.Scene.load("four-bar"))
