"""`python -m jointplay sensitivity` and `tolerance`: folders, tables, resuming, and answers to wrong input."""

import argparse
import json
import os
import re
import shlex
import signal
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path

import numpy as np
import pandas
import pytest

import jointplay as jp
from jointplay import __main__ as command
from jointplay import _study_command

ROOT = Path(__file__).resolve().parents[2]

SENSITIVITY = (
    "sensitivity hung.toml --duration 1ms --over joint.*.clearance=0.05mm..0.15mm --output link3.pose.z:end --out out --quiet"
)
FOUR_BAR = "tolerance four-bar --set solver.preset=real-time --duration 20ms --quiet --out t"
TOLERANCES = """# Both joints
parameter,distribution

joint.*.clearance,"uniform(0.05 mm, 0.2mm)"
contact.friction,"normal(0.1, 0.01, 0.05..0.15)"
"""


@pytest.fixture
def call(tmp_path, monkeypatch, capsys):
    """Calls the command in an empty folder: its exit code, standard output and standard error."""
    monkeypatch.chdir(tmp_path)

    def run(line, *more):
        words = [*line.split(), *more]
        # A file has a slash in its name or ends in .toml.
        code = command.main([f"./{word}" if word == "hung.toml" else word for word in words])
        return code, *capsys.readouterr()

    return run


def test_the_documents_give_arguments_that_exist():
    lines = []
    for document in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]:
        text = document.read_text().replace("\\\n", " ")
        lines += re.findall(r"^\./run lab ((?:sensitivity|tolerance) .*)", text, re.MULTILINE)
    assert len(lines) >= 6
    for line in lines:
        name, *words = shlex.split(line)
        parser = argparse.ArgumentParser(exit_on_error=False)
        import_module(f"jointplay.{command.COMMANDS[name][0]}").add_arguments(parser)
        assert parser.parse_args(words).over or "--tolerances" in line


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_sensitivity_folder_has_what_the_package_computes(call, hung, tmp_path):
    (tmp_path / "hung.toml").write_text(hung)
    code, printed, _ = call(SENSITIVITY, "--rows=16", "--screen=2", "--target=0.25028m", "--seed=3", "--summary=json")
    assert code == 0
    expected = jp.sensitivity(
        jp.Scene.load(tmp_path / "hung.toml"),
        {"joint.*.clearance": "0.05mm..0.15mm"},
        "link3.pose.z:end",
        rows=16,
        screen=2,
        target="0.25028m",
        seed=3,
        duration="1 ms",
    )
    out = tmp_path / "out"
    files = ["runs.csv", "sensitivity.csv", "sensitivity.json", "sensitivity.png", "sensitivity.svg"]
    assert names(out) == ["manifest.json", *files] and names(tmp_path) == ["hung.toml", "out"]
    results = json.loads(printed)
    written = json.loads((out / "sensitivity.json").read_text())
    manifest = json.loads((out / "manifest.json").read_text())
    meta = written.pop("meta")
    assert written == results and meta.items() <= manifest.items() and sorted(manifest["files"]) == files
    assert (meta["program"], meta["scene"], meta["seed"], meta["rows"], meta["duration_s"]) == ("jointplay", "hung", 3, 16, 1e-3)
    (output,) = results["outputs"]
    assert output["value"] == expected.nominal["link3.pose.z:end"] and output["unit"] == "m" and output["rows"] == 16
    indices = expected.indices["link3.pose.z:end"]
    for parameter in output["parameters"]:
        key = parameter["key"]
        assert parameter["total"] == indices.total[key]._asdict() and parameter["first_order"] == indices.first[key]._asdict()
        ends = expected.alone["link3.pose.z:end"][key]
        assert tuple(parameter[name] for name in ("low", "alone_low", "high", "alone_high")) == ends
    assert [one["ends"] for one in results["screening"]] == ["limits"] * 3
    assert [one["output"] for one in results["target"]["single"]] == [one.output for one in expected.target.single]
    table = pandas.read_csv(out / "sensitivity.csv", keep_default_na=False, na_values="NaN")
    pandas.testing.assert_frame_equal(expected.to_pandas(), table, rtol=1e-11, check_dtype=False)
    runs = pandas.read_csv(out / "runs.csv")
    assert len(runs) == results["runs"] == sum(len(stage.status) for stage in expected.runs.values())
    assert list(runs.columns) == ["stage", *(f"joint.J{n}.clearance (m)" for n in (1, 2, 3)), "link3.pose.z:end (m)", "status"]
    assert np.allclose(runs[runs.stage == "indices"].iloc[:, 1:4], expected.values, rtol=1e-11)
    assert (out / "sensitivity.png").read_bytes().startswith(b"\x89PNG")


def test_threads_and_repetition_change_no_byte_and_results_are_replaced_by_force_only(call, hung, tmp_path):
    (tmp_path / "hung.toml").write_text(hung)
    code, text, _ = call(SENSITIVITY, "--rows=8", "--threads=1")
    assert code == 0 and "joint.J2.clearance  0.05 mm" in text and "Written           out" in text
    assert "Indices from 8 rows; mean 250.3 mm" in text

    def content():
        return {name: (tmp_path / "out" / name).read_bytes() for name in names(tmp_path / "out")}

    before = content()
    code, _, error = call(SENSITIVITY, "--rows=8")
    assert code == 2 and "error: --out out: the folder is not empty; --force replaces earlier results" in error
    assert call(SENSITIVITY, "--rows=8", "--threads=2", "--force")[0] == 0 and content() == before
    (tmp_path / "out" / "mine.txt").write_text("")
    code, _, error = call(SENSITIVITY, "--rows=8", "--force")
    assert code == 2 and "other files than results of jointplay are not replaced: mine.txt" in error
    assert names(tmp_path) == ["hung.toml", "out"]


def test_a_row_count_that_is_no_power_of_two_is_warned_about(call, hung, tmp_path):
    (tmp_path / "hung.toml").write_text(hung)
    code, _, error = call(SENSITIVITY.replace(" --quiet", ""), "--rows=9")
    assert code == 0 and "warning: --rows 9: a Sobol sequence is evenly distributed only for a power of two" in error


def test_an_interrupted_command_resumes(hung, tmp_path):
    (tmp_path / "hung.toml").write_text(hung)
    line = SENSITIVITY.replace("hung.toml", "./hung.toml").split()
    start = [sys.executable, "-P", "-m", "jointplay", *line, "--threads=1"]

    def runs(*more):
        return subprocess.run([*start, *more], cwd=tmp_path, capture_output=True, text=True, check=False)

    assert runs("--rows=128", "--out=whole").returncode == 0
    child = subprocess.Popen([*start, "--rows=128"], cwd=tmp_path, stderr=subprocess.PIPE, text=True)
    record = tmp_path / "out.indices.partial"
    while not record.exists() or record.read_bytes().count(b"\n") < 2:
        assert child.poll() is None
        time.sleep(0.01)
    child.send_signal(signal.SIGINT)
    _, error = child.communicate()
    assert child.returncode == 130 and "the same command resumes from out.*.partial" in error
    assert names(tmp_path) == ["hung.toml", "out.alone.partial", "out.indices.partial", "whole"]
    other = runs("--rows=128", "--seed=7")
    assert other.returncode == 2 and "out.indices.partial was started with other settings (vary)" in other.stderr
    kept = os.stat(record).st_size
    assert runs("--rows=128").returncode == 0 and kept > 0
    assert names(tmp_path) == ["hung.toml", "out", "whole"]
    for name in names(tmp_path / "whole"):
        assert (tmp_path / "out" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes(), name


def test_a_tolerance_folder_has_what_the_package_computes(call, tmp_path):
    (tmp_path / "tolerances.csv").write_text(TOLERANCES)
    (tmp_path / "costs.csv").write_text(
        "parameter,fit,cost\njoint.A.clearance,0.05mm..0.2mm,1\njoint.A.clearance,0.05mm..0.1mm,2\n"
    )
    line = f"{FOUR_BAR} --limit peak-force=140N --limit impacts=7..12 --tolerances tolerances.csv --runs 32 --seed 2"
    code, printed, _ = call(line, "--cost=costs.csv", "--yield=30%", "--summary=json")
    assert code == 0
    scene = jp.Scene.load("four-bar").set({"solver.preset": "real-time"})
    over = {"joint.*.clearance": "uniform(0.05 mm, 0.2mm)", "contact.friction": "normal(0.1, 0.01, 0.05..0.15)"}
    cost = {"joint.A.clearance": {"0.05mm..0.2mm": 1, "0.05mm..0.1mm": 2}}
    limits = {"peak-force": 140.0, "impacts": (7, 12)}
    expected = jp.tolerance(scene, over, limits, runs=32, seed=2, cost=cost, yield_=0.3, duration="20 ms")
    results = json.loads(printed)
    assert names(tmp_path / "t") == [
        "manifest.json",
        "runs.csv",
        "tolerance.csv",
        "tolerance.json",
        "tolerance.png",
        "tolerance.svg",
    ]
    assert names(tmp_path) == ["costs.csv", "t", "tolerances.csv"]
    assert results["yield"] == expected.yield_._asdict() and results["accepted"] == expected.accepted.sum()
    assert (results["units"], results["missed"], results["not_started"], results["diverged"]) == (32, expected.missed, 0, 0)
    force = results["outputs"][0]
    # The largest of 32 is above the 99 % percentile with a probability of 1 - 0.99^32 = 28 %: its upper end is unknown.
    assert force["percentile_99"]["high"] is None and expected.qualities["peak-force"].percentiles[99].high == np.inf
    assert (force["mean"], force["upper"], force["lower"]) == (expected.qualities["peak-force"].mean, 140.0, None)
    best = expected.fits.best
    rows = [{"key": key, "fit": fit, "cost": cost["joint.A.clearance"][fit]} for key, fit in best.fits.items()]
    assert results["fits"]["best"]["fits"] == rows and sum(row["cost"] for row in rows) == best.cost
    distances = [driver["distance"] for driver in results["reject_drivers"]]
    assert distances == sorted(distances, reverse=True) and len(distances) == 3
    assert (
        results["fits"]["best"]["cost"] == expected.fits.best.cost
        and results["fits"]["check"]["verdict"] == expected.fits.verdict
    )
    table = pandas.read_csv(tmp_path / "t" / "tolerance.csv", keep_default_na=False, na_values="NaN")
    pandas.testing.assert_frame_equal(expected.to_pandas(), table, rtol=1e-11, check_dtype=False)
    code, text, _ = call(line, "--force", "--over=joint.A.clearance=0.1mm..0.11mm")
    assert code == 0 and "peak-force at most 140 N: " in text and "impacts from 7 to 12: " in text
    runs = pandas.read_csv(tmp_path / "t" / "runs.csv")
    force, impacts = runs["peak-force (N)"], runs["impacts"]
    rejected = ((force > 140.0) | (impacts < 7) | (impacts > 12)).sum()
    assert f"Lot               32 units, {rejected} rejected: {rejected} missed a limit\n" in text
    # Options override the file.
    assert runs["joint.A.clearance (m)"].between(1e-4, 1.1e-4).all() and runs["joint.B.clearance (m)"].max() > 1.5e-4


def test_failed_units_are_stated_apart(call, tmp_path):
    line = "tolerance spcmm --set solver.preset=real-time --duration 2ms --over spcmm.slider_plane=-100mm..60mm --quiet --limit tip-error=50um --runs 16 --out t"
    code, text, _ = call(line)
    results = json.loads((tmp_path / "t" / "tolerance.json").read_text())
    lost = results["not_started"]
    assert code == 0 and 0 < lost < 16 and f"{lost} did not start" in text and f"of the {16 - lost} units with a result" in text
    runs = pandas.read_csv(tmp_path / "t" / "runs.csv")
    assert (runs["status"] == 2).sum() == lost and runs["tip-error (m)"].isna().sum() == lost


def test_assumed_ranges_are_stated(call, tmp_path):
    line = "four-bar --over contact.restitution --over contact.friction=0.1..0.2 --duration 1ms --quiet"
    expected = "Range not given   contact.restitution: 0.45 to 1, half to one and a half of its value, within what is allowed\n"
    for name, more in [("sensitivity", "--rows 0"), ("tolerance", "--runs 8 --limit peak-force=1000N")]:
        code, text, _ = call(f"{name} {line} {more} --out {name}")
        assert code == 0 and text.count("Range not given") == 1 and expected in text
        manifest = json.loads((tmp_path / name / "manifest.json").read_text())
        assert manifest["assumed_ranges"] == {"contact.restitution": [0.45, 1.0]}


FILE = "parameter,distribution\n"
COSTS = "parameter,fit,cost\njoint.A.clearance,0.1mm..0.2mm,1\n"


@pytest.mark.parametrize(
    "option, text, message",
    [
        ("tolerances", "", "--tolerances bad.csv: expected the heading parameter,distribution"),
        ("tolerances", FILE, "--tolerances bad.csv: expected the heading"),
        ("tolerances", "key,value\na,b\n", "--tolerances bad.csv, line 1: expected the heading"),
        ("tolerances", f"{FILE}#\njoint.C.clearance,0..1mm\n", "bad.csv, line 3: "),
        ("tolerances", f"{FILE}joint.*.clearance,1..2\n", "line 2: joint.A.clearance: "),
        ("tolerances", f"{FILE}joint.A.clearance,H7/q6\n", "line 2: joint.A.clearance: `H7/q6`"),
        ("tolerances", f"{FILE}contact.friction,normal(0.1,0.2)\n", "line 2: 3 cells for the 2"),
        ("tolerances", f'{FILE}contact.friction,"0.1\n', "line 2: a quoted cell does not end"),
        ("tolerances", f'{FILE}contact.friction,"normal(0,0.1)"\n', "contact.friction: -0."),
        ("tolerances", "\udcff", "not valid UTF-8"),
        ("cost", f"{COSTS}joint.B.clearance,0.1mm,1\n", "line 3: joint.B.clearance: give the parameter"),
        ("cost", f"{COSTS}joint.A.clearance,0.1mm,much\n", "line 3: joint.A.clearance: cost much: expected a finite number"),
        ("cost", f"{COSTS}joint.A.clearance,0.1mm..0.3mm,2\n", "line 3: joint.A.clearance: 0.1mm..0.3mm is wider"),
    ],
)
def test_errors_of_tables_name_the_line(call, tmp_path, option, text, message):
    (tmp_path / "bad.csv").write_bytes(text.encode(errors="surrogateescape"))
    over = ["--over=joint.A.clearance=0.1mm..0.2mm"] if option == "cost" else []
    code, _, error = call(f"{FOUR_BAR} --runs 2 --limit peak-force=140 --{option} bad.csv", *over)
    assert code == 2 and message in error and names(tmp_path) == ["bad.csv"]


@pytest.mark.parametrize(
    "line, code, message",
    [
        (f"{FOUR_BAR} --limit peak-force=140", 2, "--over: give at least one parameter, or --tolerances"),
        (f"{FOUR_BAR} --limit peak-force=140 --tolerances none.csv", 1, "none.csv"),
        (
            f"{FOUR_BAR} --limit peak-force=140 --tolerances /dev/zero",
            2,
            "/dev/zero: this is a folder, a pipe, a socket or a device",
        ),
        (f"{FOUR_BAR} --limit peak-force --over contact.friction", 2, "--limit peak-force: expected OUTPUT=LIMIT"),
        (
            f"{FOUR_BAR} --limit peak-force=1mm --over contact.friction",
            2,
            "limit of peak-force: expected a number for peak-force in N",
        ),
        (f"{FOUR_BAR} --limit peak-force=3..2 --over contact.friction", 2, "the lower limit must be below"),
        (f"{FOUR_BAR} --limit impacts=1 --limit impacts=2 --over contact.friction", 2, "impacts has a limit already"),
        (f"{FOUR_BAR} --limit peak-forc=1 --over contact.friction", 2, "output: peak-forc: "),
        (f"{FOUR_BAR} --limit peak-force=1 --yield 99 --over contact.friction", 2, "--yield 99: expected a part of the lot"),
        (f"{FOUR_BAR} --limit peak-force=1 --runs 1 --over contact.friction", 2, "runs = 1: allowed whole numbers from 2"),
        (f"{FOUR_BAR} --limit peak-force=1 --over contact.friction --set contact.clearance", 2, "expected KEY=VALUE"),
        (
            "sensitivity four-bar --out out --over contact.friction=-1..2",
            2,
            "--over contact.friction=-1..2: contact.friction = -1: out of",
        ),
        ("sensitivity four-bar --out out --over joint.A.clearance --rows 4", 2, "rows = 4: allowed"),
        ("sensitivity four-bar --out out --over joint.A.clearance --target 1kg", 2, "target of tip-error: "),
        ("sensitivity four-bar --out out --over joint.A.clearance --from 1ms", 2, "from_: give the duration, too"),
        ("sensitivity nothing --out out --over joint.A.clearance", 2, "nothing"),
        ("sensitivity four-bar --out none/out --over joint.A.clearance", 2, "--out none/out: there is no folder"),
    ],
)
def test_wrong_input_is_answered_in_a_sentence(call, tmp_path, line, code, message):
    found, _, error = call(line)
    assert (found, names(tmp_path)) == (code, []) and message in error and error.startswith("error: ") and error.count("\n") <= 3


def test_a_library_that_is_missing_is_named(call, monkeypatch):
    monkeypatch.setitem(sys.modules, "SALib.sample.morris", None)
    code, _, error = call(
        "sensitivity pendulum --over contact.friction --output peak-force --screen 2 --duration 1ms --quiet --out out"
    )
    assert code == 2 and error.endswith("needs SALib: pip install 'jointplay[studies]'\n")


def test_values_that_differ_little_have_enough_digits_to_be_distinguished():
    def cells(*values):
        digits = _study_command.distinguishing_digits(values[0], values)
        return [_study_command.show(value, "m", digits) for value in values]

    assert cells(0.1, 0.2, 0.30123456) == ["100 mm", "200 mm", "301.2 mm"]
    assert cells(-0.2649, -0.264901234, float("nan")) == ["-264.9 mm", "-264.901234 mm", "-"]
    assert cells(1.0, 1.0, 1.0) == ["1000 mm"] * 3
    assert cells(0.0, 1.234567e-3) == ["0 mm", "1.235 mm"]


@pytest.mark.parametrize("text, value", [("99%", 0.99), ("99 %", 0.99), ("0.5", 0.5), ("100%", 1.0)])
def test_a_fraction_is_a_number_or_a_percentage(text, value):
    from jointplay._tolerance_command import read_fraction

    assert read_fraction(text) == value
    for bad in ["99", "0", "-1%", "101%", "%", "nan", "nan%", ""]:
        with pytest.raises(jp.OptionError, match="above 0 and up to 100 %"):
            read_fraction(bad)
