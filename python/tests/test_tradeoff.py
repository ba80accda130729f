"""The trade-off of the methods: everything but the times is what the program measures."""

import json

import pytest

import jointplay as jp


def by_setting(points):
    return {json.dumps(point["setting"], sort_keys=True): point for point in points}


def test_costs_and_errors_are_those_of_the_program(program, tmp_path):
    program("tradeoff", "pendulum", "--quick", "--quiet", "--out", tmp_path / "found")
    told = json.loads((tmp_path / "found" / "tradeoff.json").read_text())["points"]
    parts = []
    found = jp.tradeoff(jp.Scene.load("pendulum"), progress=parts.append)
    assert parts[-1] <= 1.0 and len(parts) > 10
    own, theirs = by_setting(found.points), by_setting(told)
    assert own.keys() == theirs.keys()
    # A slow machine may cap a run; all others repeat but for their times.
    whole = [key for key in own if own[key]["impacts"]["end"] == theirs[key]["impacts"]["end"] == "reached"]
    assert len(whole) > len(own) // 2
    for key in whole:
        assert own[key]["errors"]["peak"] == theirs[key]["errors"]["peak"], key
        for name in ["simulated_s", "steps", "evaluations", "rejected"]:
            assert own[key]["impacts"][name] == theirs[key]["impacts"][name], key
    table = found.to_pandas()
    assert {"setting.method", "errors.peak", "impacts.evaluations", "impacts.ratio"} <= set(table.columns)
    assert table["impacts.front"].any()


def test_an_error_of_progress_ends_it():
    def fails(part):
        raise LookupError(part)

    with pytest.raises(LookupError):
        jp.tradeoff(jp.Scene.load("pendulum"), progress=fails)
