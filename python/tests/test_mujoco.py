"""docs/mujoco.md: both programs on both machines up to the first impact, and the page's numbers about it."""

import importlib.util
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def comparison():
    spec = importlib.util.spec_from_file_location("mujoco_comparison", ROOT / "python" / "mujoco_comparison.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def page():
    return (ROOT / "docs" / "mujoco.md").read_text(encoding="utf-8")


def stated_peak(page, table, label):
    """First peak of a row of the page, N."""
    rows = re.search(rf"<!-- {table} -->\n(.*?)<!-- end -->", page, re.DOTALL)[1].splitlines()
    found = [row.split(" | ") for row in rows if row.startswith(f"| {label} |")]
    assert len(found) == 1, label
    return float(found[0][3])


@pytest.mark.parametrize("name", ["rod", "crank"])
def test_both_programs_agree_on_the_first_impact_as_the_page_states(name, comparison, page):
    machine = {"rod": comparison.ROD, "crank": comparison.CRANK}[name]
    _, impacts = comparison.run_jointplay(machine.toml, {"solver.preset": "accurate"}, machine.output, 7e-3)
    first = comparison.Impact(*(impacts[0][name] for name in ("start_s", "end_s", "peak_N")))
    assert first.peak == pytest.approx(stated_peak(page, name, "Jointplay, `accurate`"), abs=0.06)

    for match, (quantity, exact) in comparison.TUNED.items():
        limit = comparison.limit_of(machine, impacts, quantity, exact)
        _, others = comparison.run_mujoco(machine.mjcf.format(step=5e-6, integrator="Euler", **limit), first.end + 1e-4)
        other = others[0]
        # A step, and half of one by which semi-implicit Euler runs ahead or behind.
        assert abs(other.start - first.start) < 1e-5, match
        if quantity == "duration":
            # The peak of a linear spring is pi / 3.68 of Hertz's with the same momentum and duration.
            assert other.end - other.start == pytest.approx(first.end - first.start, rel=0.02), match
            assert -0.18 < other.peak / first.peak - 1 < -0.13, match
        else:
            assert other.peak == pytest.approx(first.peak, rel=0.01), match
        # Short of the tuning's last digits, the page has this run.
        assert other.peak == pytest.approx(stated_peak(page, name, f"MuJoCo, {match}, `Euler` 5 us"), rel=1e-3), match


def test_the_first_impact_of_the_rod_is_that_of_the_closed_form(comparison):
    start, speed, light, peak = comparison.closed_form()
    _, impacts = comparison.run_jointplay(comparison.ROD_TOML, {"solver.preset": "reference"}, "rod", 7e-3)
    first = impacts[0]
    assert first["start_s"] == pytest.approx(start, rel=1e-12) and first["approach_m_s"] == pytest.approx(speed, rel=1e-12)
    # The weight adds a per cent; the normal turns a little during the impact, which the closed form leaves out.
    assert first["peak_N"] == pytest.approx(light, rel=1e-2)
    assert first["peak_N"] == pytest.approx(peak, rel=1e-3)


def test_the_page_counts_the_lines_of_the_models(comparison, page):
    assert comparison.lines_table() in page
