"""The trade-off of the methods: everything except the times equals the measurements of the program."""

import json

import pytest

import jointplay as jp


def by_setting(points):
    return {json.dumps(point["setting"], sort_keys=True): point for point in points}


def test_costs_and_errors_are_those_of_the_program(program, tmp_path):
    program("tradeoff", "pendulum", "--quick", "--quiet", "--out", tmp_path / "results")
    expected = json.loads((tmp_path / "results" / "tradeoff.json").read_text())["points"]
    parts = []
    result = jp.tradeoff(jp.Scene.load("pendulum"), progress=parts.append)
    assert parts[-1] <= 1.0 and len(parts) > 10
    own, program_points = by_setting(result.points), by_setting(expected)
    assert own.keys() == program_points.keys()
    # A slow machine may cap a run; all other runs differ only in their times.
    complete = [key for key in own if own[key]["impacts"]["end"] == program_points[key]["impacts"]["end"] == "reached"]
    assert len(complete) > len(own) // 2
    for key in complete:
        assert own[key]["errors"]["peak"] == program_points[key]["errors"]["peak"], key
        for name in ["simulated_s", "steps", "evaluations", "rejected"]:
            assert own[key]["impacts"][name] == program_points[key]["impacts"][name], key
    table = result.to_pandas()
    assert {"setting.method", "errors.peak", "impacts.evaluations", "impacts.ratio"} <= set(table.columns)
    assert table["impacts.front"].any()


def test_an_error_in_progress_ends_the_measurement():
    def fails(part):
        raise LookupError(part)

    with pytest.raises(LookupError):
        jp.tradeoff(jp.Scene.load("pendulum"), progress=fails)
