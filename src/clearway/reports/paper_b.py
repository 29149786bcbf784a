"""What paper B printed, to stand beside what was measured here: its Tables 2 and 3.

Rado, Baglioni & Jamshidnejad, "Enabling robots to autonomously search dynamic cluttered post-disaster environments",
Scientific Reports 15, 2025. Its scenarios are not public: scenario 1 there is not scenario 1 here.
"""

from __future__ import annotations

from typing import TypeAlias

CITATION = (
    "Rado, Baglioni & Jamshidnejad, Enabling robots to autonomously search dynamic cluttered post-disaster environments, "
    "Scientific Reports 15, 34778 (2025)"
)
TABLES = {"sar-case1": "Table 2", "sar-case2": "Table 3"}
"""Which of its tables a suite's scenarios are to stand beside."""
METHODS = {
    "hp-tmpc": "HP+TMPC",
    "hl-rrt": "HL-RRT*",
    "colregs-apf": "APF",
    "colregs-apf-retuned": "APF, retuned",
}
"""Navigators by the paper's names for them."""

Run: TypeAlias = tuple[float, float] | None
"""Path [m] and time [s]; None where the paper prints a dash."""

_NONE: tuple[Run, ...] = (None,) * 10
_APF = (None,) * 6 + ((15.4, 30.8),) + (None,) * 3

PRINTED: dict[tuple[str, str, str], tuple[Run, ...]] = {
    ("sar-case1", "1", "hp-tmpc"): (
        (18.8, 49.8), (20.1, 55.7), (22.3, 50.5), (17.9, 53.3), (16.5, 41.1),
        (21.0, 55.2), (15.2, 32.3), (22.4, 49.7), (20.0, 59.5), (17.8, 39.3),
    ),
    ("sar-case1", "1", "hl-rrt"): (
        None, (20.0, 44.5), None, (19.3, 40.2), (19.8, 44.2), (21.9, 52.1), (15.0, 30.9), None, (24.9, 22.9), (19.2, 39.2),
    ),
    ("sar-case1", "1", "colregs-apf"): _APF,
    ("sar-case1", "2", "hp-tmpc"): (
        (15.5, 40.6), (16.8, 37.1), (21.0, 52.1), (16.8, 37.6), (16.5, 42.7),
        (18.2, 38.1), (15.0, 31.8), (19.1, 50.6), (18.2, 41.1), (16.9, 41.9),
    ),
    ("sar-case1", "2", "hl-rrt"): (
        (26.4, 50.7), (19.4, 41.2), (24.0, 46.3), (18.7, 35.0), (17.6, 32.5),
        (21.0, 44.5), (16.0, 30.9), (22.9, 50.4), (20.5, 42.5), (18.3, 33.3),
    ),
    ("sar-case1", "2", "colregs-apf"): _APF,
    ("sar-case2", "1", "hp-tmpc"): (None, None, (19.1, 47.8), None, None, (20.9, 51.0), None, None, None, None),
    ("sar-case2", "1", "hl-rrt"): _NONE,
    ("sar-case2", "1", "colregs-apf"): _NONE,
    ("sar-case2", "2", "hp-tmpc"): (
        (19.2, 50.7), (16.2, 43.1), (17.4, 41.0), (18.4, 45.0), (19.5, 52.0), (17.2, 48.7), (18.4, 46.8), None, None, None,
    ),
    ("sar-case2", "2", "hl-rrt"): _NONE,
    ("sar-case2", "2", "colregs-apf"): _NONE,
}  # fmt: skip
"""(suite, set-up, navigator) -> its ten runs, as printed."""

SUMS: dict[tuple[str, str, str], tuple[float, float | None, float, float | None]] = {
    ("sar-case1", "1", "hp-tmpc"): (19.2, 2.40, 48.6, 8.50),
    ("sar-case1", "1", "hl-rrt"): (20.0, 2.99, 44.2, 8.94),
    ("sar-case1", "1", "colregs-apf"): (15.4, None, 30.8, None),
    ("sar-case1", "2", "hp-tmpc"): (17.4, 1.78, 41.4, 6.13),
    ("sar-case1", "2", "hl-rrt"): (20.5, 3.18, 40.7, 7.74),
    ("sar-case1", "2", "colregs-apf"): (15.4, None, 30.8, None),
    ("sar-case2", "1", "hp-tmpc"): (20.0, 1.26, 49.4, 2.26),
    ("sar-case2", "2", "hp-tmpc"): (18.0, 1.16, 46.8, 4.01),
}
"""(suite, set-up, navigator) -> mean and standard deviation of the path [m], of the time [s], as printed."""

TYPO = (
    "Two of Table 2's numbers for HL-RRT* do not go together with the others: in set-up 1, scenario 9, it prints 22.9 s, where its "
    "mean and standard deviation both need 58.3 s; in set-up 2 it prints a standard deviation of the time of 7.74 s, its ten runs "
    "have 7.41 s."
)
