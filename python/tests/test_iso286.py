"""Limits of size by ISO 286-1 against published tables and the formulas behind them."""

import numpy as np
import pytest

import jointplay as jp
from jointplay import _iso286 as iso
from jointplay._distribution import radial_clearance

# Lower and upper limit deviation, um, from the tables of ISO 286-2:2010.
PUBLISHED = """
25 H7 0 21 | 50 H7 0 25 | 100 H8 0 54 | 3 H6 0 6 | 400 H11 0 360 | 25 g6 -20 -7 | 50 g6 -25 -9 | 10 h6 -9 0 | 6 f7 -22 -10
18 e8 -59 -32 | 30 d9 -117 -65 | 40 c11 -280 -120 | 50 c11 -290 -130 | 60 b11 -380 -190 | 20 a11 -430 -300 | 80 js6 -9.5 9.5
100 k6 3 25 | 25 k6 2 15 | 25 k8 0 33 | 40 m6 9 25 | 25 n6 15 28 | 25 p6 22 35 | 100 r6 51 73 | 25 s6 35 48 | 150 s7 100 140
500 s6 252 292 | 25 G7 7 28 | 25 F8 20 53 | 50 E9 50 112 | 40 D10 80 180 | 25 JS7 -10.5 10.5 | 25 K7 -15 6 | 50 K7 -18 7
3 K7 -10 0 | 25 K6 -11 2 | 25 M7 -21 0 | 300 M6 -41 -9 | 300 M7 -52 0 | 30 N7 -28 -7 | 25 N9 -52 0 | 3 N9 -29 -4 | 50 P7 -42 -17
25 P7 -35 -14 | 50 P9 -88 -26 | 25 R7 -41 -20 | 25 S7 -48 -27 | 3 S7 -24 -14 | 110 S7 -101 -66
"""


@pytest.mark.parametrize("row", PUBLISHED.replace("|", "\n").strip().splitlines())
def test_limits_are_those_of_the_published_tables(row):
    size, name, lower, upper = row.split()
    # Table values in micrometres, turned to metres and back.
    assert np.allclose(1e6 * np.array(iso.limits(name, 1e-3 * float(size))), [float(lower), float(upper)], rtol=0, atol=1e-9)


def mean_sizes(ends):
    """Geometric mean of each range, mm; the first begins at 1 mm."""
    return np.sqrt(np.array([1.0, *ends[:-1]]) * ends)


def test_tolerances_follow_the_formulas_of_the_standard():
    # ISO 286-1:1988, annex A: IT5 is about 7 i, IT6 to IT18 are 10 i, 16 i, 25 i, 40 i, 64 i, 100 i, …, with i = 0.45 D^(1/3) +
    # 0.001 D. The rounded values come from older standards, and up to 6 mm from practice.
    size = mean_sizes(iso.RANGES)
    unit = 0.45 * np.cbrt(size) + 0.001 * size
    allowed = np.where(np.array(iso.RANGES) == 3.0, 0.16, np.where(np.array(iso.RANGES) == 6.0, 0.1, 0.06))
    for grade, multiple in zip(range(5, 19), [7, 10, 16, 25, 40, 64, 100, 160, 250, 400, 640, 1000, 1600, 2500], strict=True):
        assert (abs(np.array(iso.TOLERANCES[str(grade)]) / (multiple * unit) - 1.0) < allowed).all(), grade
    # IT01, IT0 and IT1 have formulas of their own; IT2 to IT4 are roughly in geometric progression from IT1 to IT5.
    for grade, formula in [("01", 0.3 + 0.008 * size), ("0", 0.5 + 0.012 * size), ("1", 0.8 + 0.02 * size)]:
        assert (abs(np.array(iso.TOLERANCES[grade]) - formula) < 0.05 + 0.25 * formula).all(), grade
    first, fifth = (np.array(iso.TOLERANCES[grade]) for grade in "15")
    for grade in (2, 3, 4):
        assert (abs(iso.TOLERANCES[str(grade)] / (first * (fifth / first) ** ((grade - 1) / 4)) - 1.0) < 0.2).all(), grade
    table = np.array(list(iso.TOLERANCES.values()))
    assert (np.diff(table, axis=0) > 0).all() and (np.diff(table, axis=1) >= 0).all()


# ISO 286-1:1988, annex A, with D the geometric mean of the range.
FORMULAS = {
    "a": lambda d: np.where(d <= 120.0, 265.0 + 1.3 * d, 3.5 * d),
    "b": lambda d: np.where(d <= 160.0, 140.0 + 0.85 * d, 1.8 * d),
    "c": lambda d: np.where(d <= 40.0, 52.0 * d**0.2, 95.0 + 0.8 * d),
    "d": lambda d: 16.0 * d**0.44,
    "e": lambda d: 11.0 * d**0.41,
    "f": lambda d: 5.5 * d**0.41,
    "g": lambda d: 2.5 * d**0.34,
    "k": lambda d: 0.6 * np.cbrt(d),
    "n": lambda d: 5.0 * d**0.34,
}


@pytest.mark.parametrize("letter", FORMULAS)
def test_deviations_follow_the_formulas_of_the_standard(letter):
    values = np.array((iso.CLEARANCE_SIDE | iso.INTERFERENCE_SIDE)[letter])
    size = mean_sizes(iso.RANGES if len(values) == len(iso.RANGES) else iso.INTERMEDIATE)
    formula = FORMULAS[letter](size)
    # Values are rounded to 1 um, 5 um or 10 um. By older practice c is larger up to 40 mm, and n smaller up to 3 mm.
    allowed = 1.0 + np.where((letter == "c") & (size < 40.0), 0.16, 0.05) * formula
    assert (abs(values - formula)[letter == "n" :] <= allowed[letter == "n" :]).all()
    assert (np.diff(values) >= 0).all()


def test_interference_sides_follow_each_other():
    it6, it7 = (np.array(iso.TOLERANCES[grade]) for grade in "67")
    m, p = (np.array(iso.INTERFERENCE_SIDE[letter]) for letter in "mp")
    assert (m[1:] == (it7 - it6)[1:]).all()
    assert (p[1:] >= it7[1:]).all() and (p[1:] <= it7[1:] + 5.0).all()
    # r is the geometric mean of p and s.
    r, s = (np.array(iso.INTERFERENCE_SIDE[letter]) for letter in "rs")
    of_p = p[[next(i for i, end in enumerate(iso.RANGES) if size <= end) for size in iso.INTERMEDIATE]]
    assert (abs(r - np.sqrt(s * of_p)) < 1.2).all()


@pytest.mark.parametrize("letter", "kmnprs")
def test_a_hole_with_an_increment_has_the_clearance_of_the_matching_shaft(letter):
    # The purpose of the increment (annex A): N7/h6 has the clearance of H7/n6, P7/h6 of H7/p6, ….
    for size in [5.0, 9.0, 15.0, 25.0, 45.0, 75.0, 110.0, 150.0, 220.0, 400.0, 480.0]:
        hole, shaft = (iso.clearance(fit, 1e-3 * size) for fit in (f"{letter.upper()}7/h6", f"H7/{letter}6"))
        assert np.allclose(hole, shaft, rtol=0, atol=1e-12), size


def test_clearances_of_fits_are_the_published_ones():
    published = [(50, "H7/g6", 9, 50), (25, "H8/f7", 20, 74), (25, "H7/h6", 0, 34), (25, "H11/c11", 110, 370)]
    for size, fit, low, high in [*published, (25, "H7/k6", -15, 19), (25, "H7/p6", -35, -1)]:
        assert np.allclose(1e6 * np.array(iso.clearance(fit, 1e-3 * size)), [low, high], rtol=0, atol=1e-9), fit
    # The end of a range belongs to it.
    assert [round(1e6 * iso.limits("H7", size)[1]) for size in (30e-3, 30.001e-3)] == [21, 25]


def test_the_radial_clearance_is_half_the_clearance_on_the_diameter():
    law = radial_clearance("H7/g6", 50e-3)
    assert np.allclose(1e6 * np.array([law.low, law.high]), [4.5, 25.0])
    # Hole and shaft are normal with widths of six standard deviations, so that the radius has sqrt(25^2 + 16^2) / 12.
    median, above = 1e6 * law.quantile(np.array([0.5, 0.841344746068543]))
    assert median == pytest.approx(14.75) and above - median == pytest.approx(np.hypot(25.0, 16.0) / 12.0, rel=1e-4)


@pytest.mark.parametrize("fit", "H7 g6/H7 H7/H6 h7/g6 H19/g6 H7/g00 J7/h6 Js7/h6 H/g 7/6 H07/g6 H7/g6/k6".split())
def test_what_is_no_fit_is_refused(fit):
    with pytest.raises(jp.OptionError, match="is not a"):
        iso.clearance(fit, 25e-3)


@pytest.mark.parametrize("size", [0.0, 0.6, float("nan")])
def test_sizes_beyond_the_tables_are_refused(size):
    with pytest.raises(jp.OptionError, match="above 0 mm and up to 500 mm"):
        iso.clearance("H7/g6", size)


def test_classes_that_the_standard_does_not_define_are_refused():
    for size, name in [(25, "K9"), (25, "N1"), (0.5, "a9"), (1, "h14"), (1, "N9")]:
        with pytest.raises(jp.OptionError, match=f"^ISO 286-1 does not define {name} for a nominal size of {size} mm$"):
            iso.limits(name, 1e-3 * size)
    for size, name in [(1, "n9"), (2, "K9"), (2, "h14"), (500, "JS18"), (500, "a01")]:
        assert iso.limits(name, 1e-3 * size)[0] < iso.limits(name, 1e-3 * size)[1]
