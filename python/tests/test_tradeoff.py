"""The trade-off of the methods: everything except the times equals the measurements of the program."""

import csv

import pytest

import jointplay as jp

TIMES = {"scene", "time_s", "ratio"}


def test_costs_and_errors_are_those_of_the_program(program, tmp_path):
    program("tradeoff", "pendulum", "--quick", "--quiet", "--out", tmp_path / "results")
    with (tmp_path / "results" / "tradeoff.csv").open() as file:
        expected = list(csv.DictReader(file))
    parts = []
    result = jp.tradeoff(jp.Scene.load("pendulum"), quick=True, progress=parts.append)
    assert parts[-1] <= 1.0 and len(parts) > 10
    assert len(result.rows) == len(expected)
    for row, of_program in zip(result.rows, expected, strict=True):
        for name in of_program.keys() - TIMES:
            own, text = getattr(row, name), of_program[name]
            if isinstance(own, float | int):
                # A number in the file has 12 digits.
                assert own == pytest.approx(float(text), rel=1e-11), (row.method, name)
            else:
                assert (own or "") == text, (row.method, name)
    table = result.to_pandas()
    assert {"method", "peak_error", "cost", "ratio"} <= set(table.columns)
    assert set(table["preset"].dropna()) == {"preview", "real-time", "accurate", "reference"}


def test_an_error_in_progress_ends_the_measurement():
    def fails(part):
        raise LookupError(part)

    with pytest.raises(LookupError):
        jp.tradeoff(jp.Scene.load("pendulum"), quick=True, progress=fails)
