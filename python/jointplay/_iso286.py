"""Limits of size by ISO 286-1:2010 for nominal sizes up to 500 mm: holes A to H, JS, K, M, N, P, R, S and shafts a to h, js, k,
m, n, p, r, s in the grades IT01 to IT18."""

from __future__ import annotations

import re
from bisect import bisect_left

from .errors import OptionError


def _row(text: str) -> tuple[float, ...]:
    return tuple(map(float, text.split()))


RANGES = _row("3 6 10 18 30 50 80 120 180 250 315 400 500")
"""Upper ends of the main ranges of nominal sizes, mm; each range excludes its lower end."""

INTERMEDIATE = _row("3 6 10 14 18 24 30 40 50 65 80 100 120 140 160 180 200 225 250 280 315 355 400 450 500")
"""Upper ends of the intermediate ranges, mm."""

TOLERANCES = {
    grade: _row(row)
    for grade, row in {
        "01": "0.3 0.4 0.4 0.5 0.6 0.6 0.8 1 1.2 2 2.5 3 4",
        "0": "0.5 0.6 0.6 0.8 1 1 1.2 1.5 2 3 4 5 6",
        "1": "0.8 1 1 1.2 1.5 1.5 2 2.5 3.5 4.5 6 7 8",
        "2": "1.2 1.5 1.5 2 2.5 2.5 3 4 5 7 8 9 10",
        "3": "2 2.5 2.5 3 4 4 5 6 8 10 12 13 15",
        "4": "3 4 4 5 6 7 8 10 12 14 16 18 20",
        "5": "4 5 6 8 9 11 13 15 18 20 23 25 27",
        "6": "6 8 9 11 13 16 19 22 25 29 32 36 40",
        "7": "10 12 15 18 21 25 30 35 40 46 52 57 63",
        "8": "14 18 22 27 33 39 46 54 63 72 81 89 97",
        "9": "25 30 36 43 52 62 74 87 100 115 130 140 155",
        "10": "40 48 58 70 84 100 120 140 160 185 210 230 250",
        "11": "60 75 90 110 130 160 190 220 250 290 320 360 400",
        "12": "100 120 150 180 210 250 300 350 400 460 520 570 630",
        "13": "140 180 220 270 330 390 460 540 630 720 810 890 970",
        "14": "250 300 360 430 520 620 740 870 1000 1150 1300 1400 1550",
        "15": "400 480 580 700 840 1000 1200 1400 1600 1850 2100 2300 2500",
        "16": "600 750 900 1100 1300 1600 1900 2200 2500 2900 3200 3600 4000",
        "17": "1000 1200 1500 1800 2100 2500 3000 3500 4000 4600 5200 5700 6300",
        "18": "1400 1800 2200 2700 3300 3900 4600 5400 6300 7200 8100 8900 9700",
    }.items()
}
"""Standard tolerance of each grade over the main ranges, um (table 1)."""

CLEARANCE_SIDE = {
    letter: _row(row)
    for letter, row in {
        "a": "270 270 280 290 290 300 300 310 320 340 360 380 410 460 520 580 660 740 820 920 1050 1200 1350 1500 1650",
        "b": "140 140 150 150 150 160 160 170 180 190 200 220 240 260 280 310 340 380 420 480 540 600 680 760 840",
        "c": "60 70 80 95 95 110 110 120 130 140 150 170 180 200 210 230 240 260 280 300 330 360 400 440 480",
        "d": "20 30 40 50 65 80 100 120 145 170 190 210 230",
        "e": "14 20 25 32 40 50 60 72 85 100 110 125 135",
        "f": "6 10 13 16 20 25 30 36 43 50 56 62 68",
        "g": "2 4 5 6 7 9 10 12 14 15 17 18 20",
    }.items()
}
"""-es of the shafts a to g, which is EI of the holes A to G, um, over the main or the intermediate ranges (tables 2 and 4)."""

INTERFERENCE_SIDE = {
    letter: _row(row)
    for letter, row in {
        "k": "0 1 1 1 2 2 2 3 3 4 4 4 5",
        "m": "2 4 6 7 8 9 11 13 15 17 20 21 23",
        "n": "4 8 10 12 15 17 20 23 27 31 34 37 40",
        "p": "6 12 15 18 22 26 32 37 43 50 56 62 68",
        "r": "10 15 19 23 23 28 28 34 34 41 43 51 54 63 65 68 77 80 84 94 98 108 114 126 132",
        "s": "14 19 23 28 28 35 35 43 43 53 59 71 79 92 100 108 122 130 140 158 170 190 208 232 252",
    }.items()
}
"""ei of the shafts k to s, which is -ES of the holes K to S apart from an increment, um (tables 2, 3 and 5)."""

ROUNDING = 1e-12
"""Relative difference below which two sizes are equal, so that 3 mm in metres still ends its range."""


def split(name: str) -> tuple[str, bool, str]:
    """Letter in lower case, whether it is a hole, and grade of a tolerance class such as H7."""
    found = re.fullmatch(r"([A-Z]+|[a-z]+)(01|0|[1-9][0-9]?)", name.strip())
    letter = found[1].lower() if found else ""
    if not found or letter not in {"h", "js", *CLEARANCE_SIDE, *INTERFERENCE_SIDE} or found[2] not in TOLERANCES:
        raise OptionError(
            f"`{name}` is not a tolerance class: expected a letter (A to H, JS, K, M, N, P, R, S for a hole, lower case for a "
            "shaft) and a grade from 01 to 18, such as H7"
        )
    return letter, found[1].isupper(), found[2]


def tolerance(name: str, nominal: float) -> float:
    """Width of the tolerance interval of a class at a nominal size, both in m."""
    return 1e-6 * TOLERANCES[split(name)[2]][_range(nominal, RANGES)]


def limits(name: str, nominal: float) -> tuple[float, float]:
    """Lower and upper limit deviation of a tolerance class at a nominal size, m (tables 1 to 5)."""
    letter, is_hole, grade = split(name)
    main = _range(nominal, RANGES)
    width = TOLERANCES[grade][main]
    number = list(TOLERANCES).index(grade) - 1
    # Notes to tables 1 to 5: up to 1 mm, IT14 and coarser grades, a, b, A, B, and N coarser than IT8 are not defined.
    is_small = nominal <= 1e-3 * (1.0 + ROUNDING)
    is_defined = not is_small or number < 14 and letter not in "ab" and not (letter == "n" and is_hole and number > 8)
    lower: float | None
    if letter == "h":
        lower = 0.0 if is_hole else -width
    elif letter == "js":
        lower = -0.5 * width
    elif letter in CLEARANCE_SIDE:
        distance = _size(CLEARANCE_SIDE[letter], nominal)
        lower = distance if is_hole else -distance - width
    elif is_hole:
        upper = _upper_of_hole(letter, number, main, _size(INTERFERENCE_SIDE[letter], nominal))
        lower = None if upper is None else upper - width
    else:
        # Table 5: k is 0 except in IT4 to IT7.
        lower = 0.0 if letter == "k" and not 4 <= number <= 7 else _size(INTERFERENCE_SIDE[letter], nominal)
    if lower is None or not is_defined:
        raise OptionError(f"ISO 286-1 does not define {name.strip()} for a nominal size of {1e3 * nominal:g} mm")
    return 1e-6 * lower, 1e-6 * (lower + width)


def _upper_of_hole(letter: str, number: int, main: int, of_shaft: float) -> float | None:
    """ES of a hole K to S, um, from ei of the shaft of that letter (tables 2 and 3); None where it is not defined.

    Above 3 mm, from IT3 to IT8 (P to S: IT7), it is -ei + ITn - IT(n-1). The hole with a shaft h of the next finer grade then has
    the clearance of a hole H with the shaft of that letter and finer grade.
    """
    if main == 0:
        # K is 0 and N -4 um in every grade.
        return -of_shaft
    if number > (8 if letter in "kmn" else 7):
        return {"k": None, "n": 0.0}.get(letter, -of_shaft)
    if number < 3:
        return None
    # Note to table 2: M6 has -9 um from 250 mm to 315 mm.
    if letter == "m" and number == 6 and RANGES[main] == 315.0:
        return -9.0
    return -of_shaft + TOLERANCES[str(number)][main] - TOLERANCES[str(number - 1)][main]


def _size(row: tuple[float, ...], nominal: float) -> float:
    return row[_range(nominal, RANGES if len(row) == len(RANGES) else INTERMEDIATE)]


def _range(nominal: float, ends: tuple[float, ...]) -> int:
    """Index of the range of a nominal size, m."""
    size = 1e3 * nominal / (1.0 + ROUNDING)
    if not 0.0 < size <= ends[-1]:
        raise OptionError(f"nominal size {1e3 * nominal:g} mm: the tables of ISO 286-1 are used above 0 mm and up to 500 mm")
    return bisect_left(ends, size)


def clearance(fit: str, nominal: float) -> tuple[float, float]:
    """Smallest and largest clearance on the diameter of a fit such as H7/g6 at a nominal size, m."""
    (hole_lower, hole_upper), (shaft_lower, shaft_upper) = (limits(name, nominal) for name in classes(fit))
    return hole_lower - shaft_upper, hole_upper - shaft_lower


def classes(fit: str) -> tuple[str, str]:
    """Tolerance classes of the hole and of the shaft of a fit."""
    hole, _, shaft = (part.strip() for part in fit.partition("/"))
    if not split(hole)[1] or split(shaft)[1]:
        raise OptionError(f"`{fit}` is not a fit: expected a hole and a shaft such as H7/g6")
    return hole, shaft
