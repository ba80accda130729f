"""Studies of uncertain parameters: the numbers of `jointplay sensitivity` and `jointplay tolerance`."""

import json

import numpy as np
import pandas
import pytest

import jointplay as jp

OVER = {"joint.*.clearance": "0.05mm..0.2mm", "contact.friction": "normal(0.15, 0.02, 0.05..0.25)"}
ASKED = [f"--over={pattern}={text}" for pattern, text in OVER.items()]


def same(estimate, told):
    # JSON has no infinity: an interval without an end has null there.
    return [value if np.isfinite(value) else None for value in estimate] == [told[name] for name in ("value", "low", "high")]


def test_indices_are_those_of_the_program(program, tmp_path):
    options = ["--duration", "20ms", "--from", "2ms", "--rows", "16", "--seed", "5", "--summary", "json", "--quiet"]
    outputs = ["tip-error", "A.normal:max", "impacts"]
    told = json.loads(
        program("sensitivity", "four-bar", *ASKED, "--output", ",".join(outputs), *options, "--out", tmp_path / "found")
    )
    found = jp.sensitivity(
        jp.Scene.load("four-bar"), OVER, outputs, rows=16, seed=5, duration="20 ms", start_after="2 ms", threads=2
    )
    assert list(found.inputs) == ["joint.A.clearance", "joint.B.clearance", "contact.friction"]
    assert list(found.indices) == outputs and found.values.shape == (16 * 5, 3) and found.results.shape == (80, 3)
    for own in told["outputs"]:
        indices = found.indices[own["name"]]
        for parameter in own["parameters"]:
            assert same(indices.first[parameter["key"]], parameter["first_order"]), parameter
            assert same(indices.total[parameter["key"]], parameter["total"]), parameter
    table = found.to_pandas()
    assert len(table) == 9 and table["total_high"].ge(table["total_low"]).all()


def test_effects_alone_screening_and_target_are_those_of_the_program(program, tmp_path):
    options = ["--duration=5ms", "--rows=8", "--screen=2", "--target=1um", "--seed=3", "--summary=json", "--quiet"]
    outputs = ["tip-error", "peak-force"]
    told = json.loads(program("sensitivity", "four-bar", *ASKED, "--output", ",".join(outputs), *options, "--out", tmp_path / "found"))
    found = jp.sensitivity(
        jp.Scene.load("four-bar"), OVER, outputs, rows=8, screen=2, target="1 um", seed=3, duration="5 ms", threads=2
    )
    for own in told["outputs"]:
        name = own["name"]
        assert (found.nominal[name], found.units[name]) == (own["value"], own["unit"])
        assert found.together[name] == (own["all_low"], own["all_high"])
        for parameter in own["parameters"]:
            key = parameter["key"]
            assert found.alone[name][key] == tuple(parameter[end] for end in ("low", "alone_low", "high", "alone_high"))
            indices = found.indices[name]
            assert (key in indices.total) == (parameter["total"] is not None) == (key in found.kept)
    assert found.screening is not None and found.target is not None
    for effects in told["screening"]:
        assert found.screening[effects["key"]] == tuple(effects[name] for name in ("mean", "mean_magnitude", "deviation"))

    def changes(told):
        return told and ({change["key"]: change["value"] for change in told["changes"]}, told["output"])

    target = told["target"]
    assert found.target.target == target["target"] == 1e-6
    assert found.target.together == changes(target["together"])
    assert found.target.single == [
        ({one["change"]["key"]: one["change"]["value"]}, one["output"]) for one in target["single"]
    ]
    table = pandas.read_csv(tmp_path / "found" / "sensitivity.csv", keep_default_na=False, na_values="NaN")
    pandas.testing.assert_frame_equal(found.to_pandas(), table, rtol=1e-11, check_dtype=False)
    # Without indices.
    easy = jp.sensitivity(
        jp.Scene.load("four-bar"), ["joint.*.clearance"], rows=0, target=found.nominal["tip-error"] * 0.99, duration="5 ms"
    )
    assert easy.target is not None and easy.indices == {} and len(easy.values) == 0
    assert easy.target.single or easy.target.together is not None
    assert easy.assumed_ranges == {f"joint.{name}.clearance": (0.5 * 1e-4, 1.5 * 1e-4) for name in "AB"}
    assert found.assumed_ranges == {}


def test_the_cheapest_fits_are_those_of_the_program(program, tmp_path):
    cost = {
        "joint.A.clearance": {"0.05mm..0.2mm": 1.0, "0.05mm..0.1mm": 3.0},
        "joint.B.clearance": {"0.05mm..0.2mm": 2.0, "0.05mm..0.1mm": 7.0},
    }
    rows = [f"{key},{fit},{price}" for key, fits in cost.items() for fit, price in fits.items()]
    (tmp_path / "costs.csv").write_text("\n".join(["parameter,fit,cost", *rows]))
    verdicts = set()
    options = ["--duration=20ms", "--runs=32", "--yield=0.5", "--summary=json", "--quiet", "--force"]
    # No machine holds the second limit.
    for limit in (125.0, 1.0):
        search = [f"--cost={tmp_path / 'costs.csv'}", f"--limit=peak-force={limit}", "--out", tmp_path / "found"]
        told = json.loads(program("tolerance", "four-bar", *ASKED, *options, *search))["fits"]
        found = jp.tolerance(
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
        assert (found.is_proven, found.evaluations) == (told["is_proven"], told["evaluations"])
        assert found.order_not_checked == told["order_not_checked"] == []
        if told["best"] is None:
            assert found.best is None and found.check is None and found.verdict is None
            verdicts.add(None)
            continue
        assert found.best.cost == told["best"]["cost"] and same(found.best.yield_, told["best"]["yield"])
        assert found.best.fits == {one["key"]: one["fit"] for one in told["best"]["fits"]}
        assert same(found.check, told["check"]["yield"]) and found.verdict == told["check"]["verdict"]
        verdicts.add(found.verdict)
    assert len(verdicts) == 2 and None in verdicts


def test_yields_are_those_of_the_program(program, tmp_path):
    options = ["--duration", "20ms", "--runs", "40", "--seed", "2", "--sampling", "sobol", "--summary", "json", "--quiet"]
    told = json.loads(
        program(
            "tolerance",
            "four-bar",
            *ASKED,
            "--limit",
            "tip-error=250um",
            "--limit",
            "peak-force=20N..120N",
            *options,
            "--out",
            tmp_path / "found",
        )
    )
    limits = {"tip-error": "250 um", "peak-force": (20.0, "120 N")}
    found = jp.tolerance(jp.Scene.load("four-bar"), OVER, limits, units=40, seed=2, sampling="sobol", duration="20 ms", threads=2)
    assert same(found.yield_, told["yield"]) and found.accepted.sum() == told["accepted"]
    for own in told["outputs"]:
        quality = found.qualities[own["name"]]
        assert same(quality.yield_, own["yield"]) and quality.mean == own["mean"] and quality.cp == own.get("cp")
        assert same(quality.percentiles[95], own["percentile_95"]) and same(quality.cpk, own["cpk"])
    drivers = {driver["key"]: driver for driver in told["reject_drivers"]}
    assert 0 < told["accepted"] < 40 and list(found.drivers) == ["joint.A.clearance", "joint.B.clearance", "contact.friction"]
    for key, driver in found.drivers.items():
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
    # PyO3 panics in Rust where it calls a function that raises this: at first where a stage begins, then between its runs.
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
    "work, said",
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
def test_bad_studies_are_refused(work, said):
    with pytest.raises(jp.JointplayError, match=said.replace("*", r"\*")):
        work(jp.Scene.load("four-bar"))
