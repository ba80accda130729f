"""`python -m jointplay paper`: the report is whole, its page agrees with its data, and every test of a statement can fail."""

import argparse
import csv
import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

import jointplay._paper_page as page
import jointplay._paper_results as results
from jointplay import _paper
from jointplay._paper_results import DERIVATIVES, NUMBERS, PAPER, RUNS, SERIES, Extent, Findings, Points, Record, Settled
from jointplay._paper_statements import TESTS, share_near_mean

SMALL = Extent(rows=200, settle=1, runs=(4, 1), values=(2, 2), sweep=(3, 1))


@pytest.fixture(scope="module")
def found():
    """Results of the shortest report."""
    return results.compute(SMALL, 2, lambda stage, part: None)


@pytest.fixture(scope="module")
def report(found, tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    page.write_report(folder, found)
    return folder


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def files(folder):
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


# --- The report ---


def test_the_report_has_every_figure_number_and_statement(report):
    text = (report / "index.html").read_text()
    for figure in range(5, 24):
        name = f"figure-{figure:02}"
        assert (report / "plots" / f"{name}.png").read_bytes()[:4] == b"\x89PNG"
        assert f'<h3 id="{name}">Figure {figure}:' in text
    stated = rows_of(report / "data" / "statements.csv")
    assert [(row["place"], row["statement"]) for row in stated] == [(place, says) for place, says, _, _ in PAPER["statement"]]
    verdicts = [row["verdict"] for row in stated]
    assert len(verdicts) == 52 and set(verdicts) == {"confirmed", "not confirmed"}
    for word, css in [("confirmed", "ok"), ("not confirmed", "off")]:
        assert text.count(f'<span class="{css}">{word}</span>') == verdicts.count(word)
    assert f"<b>{verdicts.count('confirmed')} of 52</b>" in text
    numbers = rows_of(report / "data" / "numbers.csv")
    assert [(row["figure"], float(row["paper"])) for row in numbers] == [(n.figure, n.value) for n in NUMBERS]
    for row in numbers:
        ratio = float(row["full"]) / float(row["paper"])
        limits = [(0.9, 1.1, "agrees within 10 %"), (0.5, 2.0, "within a factor of 2"), (0.0, np.inf, "differs")]
        assert row["agreement"] == next(word for low, high, word in limits if low <= ratio <= high)
        # Samples cannot exceed continuous time.
        assert not row["sampled"] or float(row["sampled"]) <= float(row["full"]) * (1.0 + 1e-9)


def test_every_link_of_the_page_resolves_and_none_leaves_the_folder(report):
    text = (report / "index.html").read_text()
    links = set(re.findall(r'(?:href|src)="([^"]*)"', text))
    assert len(links) > 40
    ids = set(re.findall(r'id="([^"]*)"', text))
    present = files(report)
    for link in links:
        assert link[1:] in ids if link.startswith("#") else link in present, link
    assert not re.search(r"https?://|<script|@import|<link|nan\b|\{[A-Z]+\}", text)
    assert {f"plots/{row['name']}.png" for section in PAPER["section"] for row in section["figure"]} <= links


def test_runs_agree_with_the_reference_and_with_the_drive(found):
    # The peaks of `tests/physics/reference.rs`, by another solver at 1e-12; tolerance as there.
    peaks = found.runs[(0.3, 0.15)].peaks
    assert list(peaks.values()) == pytest.approx([771.15, 870.59, 533.36], rel=5e-3)
    # x = 0.203 + sin(pi t)/40 (59): rows 5 µs apart miss the largest rate by less than 1e-10.
    assert found.ideal.value("largest velocity in x") == pytest.approx(np.pi / 40.0, rel=1e-8)
    assert found.ideal.value("largest acceleration in x") == pytest.approx(np.pi**2 / 40.0, rel=1e-6)
    assert np.isnan(found.ideal.value("last separation"))
    # The balls fall freely until the first one lands.
    fall = found.runs[(0.7, 0.2)].samples("x_deviation_m")[:8] / (9.81 / 2.0 * 1e-6 * np.arange(8.0) ** 2 + 1e-30)
    assert fall[1:] == pytest.approx(1.0, rel=5e-3)


def test_data_files_have_the_results(report, found):
    samples = rows_of(report / "data" / "response_c0.3mm_cf0.2.csv")
    assert len(samples) == 2001 and float(samples[1000]["t_s"]) == pytest.approx(1.0)
    assert float(samples[10]["x_m"]) == pytest.approx(found.runs[(0.3, 0.2)].columns["x_m"][2000], rel=1e-11)
    sections = rows_of(report / "data" / "runs_by_clearance_sections.csv")
    assert len(sections) == 3 * 3 and [float(row["contact.clearance"]) for row in sections[::3]] == pytest.approx(
        [3e-4, 5e-4, 7e-4]
    )
    assert len(rows_of(report / "data" / "settled_curves.csv")) == 5 * 801


# --- The command ---


@pytest.fixture
def shortened(monkeypatch, found):
    """The command with results at hand and without pictures."""
    monkeypatch.setattr(page, "write_figures", lambda folder, findings: None)
    monkeypatch.setattr(results, "compute", lambda extent, threads, progress, out: found)


def call(*words):
    return subprocess.run(
        [sys.executable, "-P", "-m", "jointplay", "paper", *map(str, words)], capture_output=True, text=True, check=False
    )


def run_here(out, *, force=False):
    _paper.main(argparse.Namespace(out=out, quick=True, force=force, threads=1))


def test_a_report_is_replaced_only_with_force_and_other_files_never(shortened, tmp_path, capsys):
    out = tmp_path / "paper"
    run_here(out)
    assert "of 52 confirmed" in capsys.readouterr().out
    (out / "index.html").write_text("old")
    with pytest.raises(_paper.OptionError, match="--force"):
        run_here(out)
    assert (out / "index.html").read_text() == "old"
    run_here(out, force=True)
    assert (out / "index.html").read_text() != "old"
    (out / "mine.txt").write_text("mine")
    with pytest.raises(_paper.OptionError, match=r"mine\.txt"):
        run_here(out, force=True)
    assert (out / "mine.txt").exists()
    assert [path.name for path in tmp_path.iterdir()] == ["paper"], "nothing else is left"


def test_an_interrupted_report_leaves_nothing(shortened, tmp_path, monkeypatch):
    def interrupt(folder, findings):
        raise KeyboardInterrupt

    monkeypatch.setattr(page, "write_figures", interrupt)
    with pytest.raises(KeyboardInterrupt):
        run_here(tmp_path / "paper")
    assert not list(tmp_path.iterdir())


def test_wrong_arguments_are_refused_before_anything_runs(tmp_path):
    (tmp_path / "file").write_text("x")
    for words, fragment in [
        (["--out", tmp_path / "file"], "it is a file"),
        (["--out", tmp_path / "no" / "paper"], "there is no folder"),
        (["--out", tmp_path / "paper", "--threads", "0"], "--threads 0: at least 1"),
        ([], "--out"),
    ]:
        done = call(*words)
        assert done.returncode == 2 and fragment in done.stderr and "Traceback" not in done.stderr, done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.long
def test_threads_change_no_byte_of_the_report(tmp_path):
    for threads in (1, 3):
        done = call("--out", tmp_path / str(threads), "--quick", "--threads", threads)
        assert done.returncode == 0, done.stderr
    one, other = tmp_path / "1", tmp_path / "3"
    assert files(one) == files(other)
    for name in files(one):
        assert (one / name).read_bytes() == (other / name).read_bytes(), name


# --- Tests of the statements, on made-up results ---


def still(peaks=(1.0, 1.0, 1.0), last=0.01, settled=True, **largest):
    """A run with columns of zeros except at 1 s, where a column has the given value."""
    columns = {name: np.zeros(2001) for name in results.COLUMNS}
    for name, value in largest.items():
        columns[name][1000] = value
    curve = {name: np.zeros(4) for columns_ in DERIVATIVES.values() for name in columns_[:2]}
    return Record(
        columns,
        1,
        dict(zip(results.JOINTS, peaks, strict=True)),
        last,
        Settled(curve, {"x": 0.0, "beta": 0.0}) if settled else None,
    )


def points(values, regimes, x, beta):
    """Points with eight sections, of which every second is further by `beta` than the others."""
    alternating = np.outer(beta, np.arange(8) % 2)
    sections = {name: np.zeros((len(values), 8)) for columns in DERIVATIVES.values() for name in columns[:2]}
    sections["x_m"] += np.asarray(x, dtype=float)[:, None]
    sections["beta_rad"] += alternating
    n = len(values)
    return Points(np.asarray(values, dtype=float), list(regimes), np.full(n, -1.0), np.full(n, 0.1), sections)


def made_up(runs=None, **swept):
    """Results at rest, except for the given runs and sweeps."""
    rest = points([1, 2, 3], ["periodic 1"] * 3, [0.2] * 3, [0.0] * 3)
    names = [f"runs_by_{series}" for series in SERIES] + [f"{series}_cold" for series in SERIES]
    records = dict(zip(RUNS, runs or [still() for _ in RUNS], strict=True))
    return Findings(SMALL, records, still(), still(), {**dict.fromkeys(names, rest), **swept}, {}, {"x": 1e-7, "beta": 1e-6})


def verdict(findings, place, words):
    """The verdict on the one statement whose place ends and whose words contain the given ones."""
    [(test, given)] = [(test, given) for at, says, test, given in PAPER["statement"] if at.endswith(place) and words in says]
    return TESTS[test](findings, **given).confirmed


def test_every_number_belongs_to_one_figure_and_every_statement_to_a_test():
    figures = [row["name"] for section in PAPER["section"] for row in section["figure"]]
    for number in NUMBERS:
        assert number.run in RUNS and number.quantity in results.QUANTITIES
        assert figures.count(f"figure-{int(number.figure.rstrip('abcdef')):02}") == 1
    assert len(NUMBERS) == 51 and len(PAPER["statement"]) == 52
    assert {test for _, _, test, _ in PAPER["statement"]} == set(TESTS)
    for series in SERIES.values():
        low, middle, high = (series.of(run) for run in series.runs)
        assert low < middle < high and low + high == pytest.approx(2.0 * middle) and set(series.runs) <= set(RUNS)


def test_verdicts_on_numbers_follow_them():
    def runs(ax, beta, deviation, peaks, last):
        rows = zip(peaks, last, ax, beta, deviation, strict=True)
        return [
            still(peak, time, ax_m_s2=a, beta_accel_rad_s2=b, x_deviation_m=d, beta_deviation_rad=d)
            for peak, time, a, b, d in rows
        ]

    # Runs at 0.3, 0.5 and 0.7 mm, then at friction 0.15 and 0.25; over friction, x is constant and beta grows from 1 to 3.
    peaks = [(3, 2, 1), (3, 2, 1), (1, 2, 3), (2, 1, 1), (5, 1, 1)]
    findings = made_up(runs([1, 1, 4, 1, 1], [2, 3, 3, 1, 3], [1e-3, 2e-3, 3e-3, 3e-3, 2e-3], peaks, [0.1, 0.2, 0.5, 0.1, 0.1]))
    for place, words, expected in [
        ("Figure 5a", "no obvious deviation", False),  # 3 mm of 25 mm
        ("Figure 5b", "deviation of beta grows", True),
        ("Figure 11b", "deviation of beta grows", False),
        ("Figures 8 to 10", "contact force of any joint", False),
        ("Figures 8 to 10", "last separation", True),
        ("Figure 8", "S1", True),
        ("Figure 9", "S2", False),
        ("Figure 10", "S3", True),
        ("Figure 15", "S2", False),
        ("Figure 7", "larger", False),
        ("Figures 6 to 10", "steady", False),
        ("Figures 11 to 16", "steady", True),
        ("Figure 13b", "no rule", False),
        ("Figure 13", "changes the acceleration", True),
        ("4.2.2", "main influence", True),
        ("second conclusion", "with clearance", False),
    ]:
        assert verdict(findings, place, words) is expected, (place, words)
    peaks[1] = (9, 2, 1)
    other = made_up(runs([1, 1, 1, 1, 99], [9, 3, 3, 1, 3], [1e-3] * 5, peaks, [0.1, 0.2, 0.3, 0.1, 0.4]))
    for place, words, expected in [
        ("Figure 5a", "no obvious deviation", True),
        ("Figure 7", "larger", True),
        ("Figures 6 to 10", "steady", True),
        ("Figures 11 to 16", "steady", False),
        ("Figure 13b", "no rule", True),
        ("Figure 13", "changes the acceleration", False),
        ("4.2.2", "main influence", False),
    ]:
        assert verdict(other, place, words) is expected, (place, words)


def test_a_conclusion_needs_every_quantity():
    columns = [column for _, column in results.QUANTITIES.values() if column]

    def run(size, **other):
        return still((size,) * 3, size, **{**dict.fromkeys(columns, size), **other})

    sizes = [2.0, 3.0, 4.0, 1.0, 3.0]
    growing = made_up([run(size) for size in sizes])
    assert verdict(growing, "second conclusion", "with clearance") and verdict(growing, "second conclusion", "with friction")
    # At 0.7 mm, vx alone is smaller.
    runs = [run(size) for size in sizes]
    runs[2] = run(4.0, vx_m_s=1.0)
    assert not verdict(made_up(runs), "second conclusion", "with clearance")
    assert verdict(made_up(runs), "second conclusion", "with friction")


def test_curves_are_compared_from_the_given_instant():
    def curve(early, late, deviation=0.1):
        """Off by shares of the amplitude until 0.35 s and afterwards, in both coordinates and all derivatives."""
        record = still(x_deviation_m=deviation, beta_deviation_rad=deviation)
        for coordinate, columns in DERIVATIVES.items():
            for nth, column in enumerate(columns):
                record.columns[column] = np.where(record.time < 0.35, early, late) * results.amplitude(coordinate, nth)
        return record

    # Over clearance the curves differ only at first, until shortly after 0.3 s; over friction by 4 % after that.
    runs = [curve(0.0, 0.0), curve(0.25, 0.0), curve(0.5, 0.0), curve(0.0, 0.02), curve(0.0, 0.04)]
    findings = replace(made_up(runs), lagrange=curve(0.0, 0.0), ideal=curve(0.0, 0.06))
    for place, words, expected in [
        ("Figure 5b", "coincide", False),
        ("Figure 6", "coincide", True),
        ("Figure 7", "fluctuate", False),  # 6 % from the ideal motion, though not from each other
        ("Figure 11a", "coincide", True),
        ("Figure 11b", "coincide", True),
        ("Figure 12", "little effect", True),
        ("Figure 13", "fluctuate", False),
        ("Figure 17a and b", "agree", False),
        ("Figure 17c to f", "agree", True),
        ("first conclusion", "alike", True),
    ]:
        assert verdict(findings, place, words) is expected, (place, words)
    # The formulations differ by 12.5 mm, of a largest deviation of 100 mm.
    apart = replace(findings, lagrange=curve(0.5, 0.06), ideal=curve(0.0, 0.0))
    for place, words, expected in [
        ("Figure 7", "fluctuate", True),
        ("Figure 13", "fluctuate", True),
        ("Figure 17c to f", "agree", False),
        ("first conclusion", "alike", False),
    ]:
        assert verdict(apart, place, words) is expected, (place, words)
    far = made_up([curve(0.0, share) for share in (0.0, 0.0, 0.0, 0.06, 0.12)])
    assert not any(verdict(far, place, words) for place, words in [("Figure 11a", "coincide"), ("Figure 12", "little effect")])


def test_verdicts_on_sections_follow_the_sweeps():
    as_printed = points([0.01, 0.5, 1.0], ["periodic 1", "periodic 1", "chaotic"], [0.2] * 3, [0.0, 0.0, 1e-3])
    runs = points([0.3, 0.5, 0.7], ["quasi-periodic"] * 3, [0.21, 0.22, 0.23], [1e-4, 2e-4, 3e-4])
    findings = made_up(clearance_cold=as_printed, runs_by_clearance=runs, runs_by_friction=runs)
    expected = {
        ("Figure 20a", "periodic"): True,
        ("Figure 20b", "chaotic"): True,
        ("third conclusion", "larger clearance"): True,
        ("Figure 19a", "further right"): True,
        ("Figure 19a", "quasi-periodic"): True,
        ("Figure 19b", "areas"): True,
        ("Figure 22", "quasi-periodic"): True,
        ("Figure 22", "denser"): False,
        ("Figure 22", "little effect"): False,
        ("Figure 23", "motion is periodic"): True,
        ("Figure 23", "little effect"): True,
        ("third conclusion", "friction has little"): True,
    }
    assert {key: verdict(findings, *key) for key in expected} == expected
    # All motions are periodic: at the same place over clearance, and 10 mm of 25 mm apart over friction.
    rest = points([0.01, 0.5, 1.0], ["periodic 1"] * 3, [0.2] * 3, [0.0] * 3)
    apart = points([0.01, 0.4], ["periodic 1"] * 2, [0.2, 0.21], [0.0] * 2)
    findings = made_up(clearance_cold=rest, runs_by_clearance=rest, friction_cold=apart)
    expected = {
        ("Figure 20a", "periodic"): True,
        ("Figure 20b", "chaotic"): False,
        ("third conclusion", "larger clearance"): False,
        ("Figure 19a", "further right"): False,
        ("Figure 19a", "quasi-periodic"): False,
        ("Figure 19b", "areas"): False,
        ("Figure 22", "quasi-periodic"): False,
        ("Figure 22", "little effect"): True,
        ("Figure 23", "little effect"): False,
    }
    assert {key: verdict(findings, *key) for key in expected} == expected
    # Chaos at a single friction, and x and the sections of beta that move.
    moving = points([0.01, 0.5, 1.0], ["chaotic"] * 3, [0.2] * 3, [1e-3] * 3)
    moving.sections["x_m"][2, ::2] += 1e-3
    findings = made_up(clearance_cold=moving, friction_cold=as_printed)
    for place, words in [
        ("third conclusion", "friction has little"),
        ("Figure 23", "motion is periodic"),
        ("Figure 20a", "periodic"),
        ("Figure 20b", "chaotic"),
    ]:
        assert not verdict(findings, place, words), (place, words)


def test_sections_crowd_around_a_centre_only_if_they_can_be_told_apart():
    resolution = {"x": 1e-7, "beta": 1e-6}

    def share(values):
        some = points([0.2], ["chaotic"], [0.2], [0.0])
        some.sections = {"x_m": np.full((1, len(values)), 0.2), "beta_rad": np.array([values])}
        return share_near_mean(some, 0, resolution)

    near = np.array([0.0, 1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 9.0, -9.0])
    assert share(near * 1e-5) == pytest.approx(7.0 / 9.0)
    assert np.isnan(share(near * 1e-9))
    assert share(np.array([1e-4, -1e-4, 1e-4, -1e-4])) == 0.0
    crowded = points([1, 2, 3], ["chaotic"] * 3, [0.2] * 3, [0.0] * 3)
    crowded.sections["beta_rad"] = np.tile(near[:8] * 1e-5, (3, 1))
    assert verdict(made_up(runs_by_friction=crowded), "Figure 22", "denser")


def test_portraits_are_compared_at_equal_phases():
    def runs(curves):
        records = [still() for _ in RUNS]
        for record, (x, width) in zip(records, curves, strict=True):
            record.settled = Settled({**record.settled.columns, "x_m": np.full(4, x)}, {"x": 0.0, "beta": width})
        return records

    # Over clearance the curves are 0.2 mm apart and increasingly wide; over friction they are 4 mm of 25 mm apart.
    findings = made_up(runs([(0.0, 1e-3), (1e-4, 2e-3), (2e-4, 3e-3), (4e-3, 0.0), (0.0, 1e-3)]))
    expected = {
        ("Figure 18a", "coincide"): True,
        ("Figure 18b", "width"): True,
        ("Figure 21a", "coincide"): False,
        ("Figure 21b", "coincide"): True,
        ("Figure 21b", "wide"): False,
    }
    assert {key: verdict(findings, *key) for key in expected} == expected
    findings = made_up(runs([(0.0, 1e-3), (1e-2, 4e-3), (2e-4, 3e-3), (0.0, 1e-5), (0.0, 1e-3)]))
    expected = {
        ("Figure 18a", "coincide"): False,
        ("Figure 18b", "width"): False,
        ("Figure 21a", "coincide"): True,
        ("Figure 21b", "wide"): True,
    }
    assert {key: verdict(findings, *key) for key in expected} == expected
