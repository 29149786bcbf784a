"""The page's first table: each system's success taken apart, on the same tests for all that stand side by side.

Three questions: did it touch nothing, did it arrive (by its own estimate, if that is known), did it stand where it was sent (by the
truth)? And which of the differences between systems are shown.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from statistics import mean, median

import numpy as np

from clearway.reports import recordings, sharing, tuning
from clearway.reports.findings import Findings
from clearway.reports.grid import NONE, counted, num, rate, rate_ends
from clearway.reports.same_tests import SameTests
from clearway.reports.selection import Row, System, driver, is_recorded
from clearway.statistics import Interval, PairedSuccess, any_estimate, holm, paired_success, wilson_interval

FEWEST_TIMES = 5
"""Tests that all finished, below which no time is compared."""


def collision_free(row: Row) -> bool | None:
    """Whether the robot touched nothing; None: nobody knows."""
    if str(row["failure"] or row["outcome"]).startswith("collision"):
        return False
    unknown = row["outcome"] == "scenario_failed" or (row["duration"] == 0 and row.get("contacts") is None)
    return None if unknown else True


def arrived(row: Row) -> bool | None:
    """Whether it was at its goals by its own estimate, and touched nothing; in a simulation also by the truth, for there a judge may end
    the test (`arrival = "measured"`), which nobody does of a real robot."""
    known: bool | None = True if row["success"] and not is_recorded(row) else row["success_self"]
    return known


def precise(row: Row) -> bool | None:
    """Whether it was at its goals by the truth and touched nothing: the trial's success."""
    known: bool | None = row["success"]
    return known


QUESTIONS: tuple[tuple[str, str, Callable[[Row], bool | None]], ...] = (
    ("Collision-free", "touched nothing", collision_free),
    ("Arrived", "by its own estimate", arrived),
    ("Precise", "within tolerance by the true pose: success, SR", precise),
)
"""Heading, what it means, and the question."""


@dataclass(frozen=True, slots=True)
class Share:
    """In how many of the trials a question is answered by yes.

    Attributes:
        yes: How many.
        judged: Of how many.
        interval: The share with Wilson's 95 % interval; None: of no trial the answer is known.
        against: How it compares with the best of those that ran the same tests; empty where nothing is compared.
        shown: Whether that difference is shown (McNemar, Holm over every two of them, p at most 0.05).
        doubtful: Whether it is not, though its interval leaves out 0.
        note: What else has to be known: trials not judged, successes that a person has to confirm; empty if nothing.
    """

    yes: int
    judged: int
    interval: Interval | None
    against: str = ""
    shown: bool = False
    doubtful: bool = False
    note: str = ""

    @property
    def percent(self) -> str:
        """The share and its interval as text."""
        i = self.interval
        return NONE if i is None else f"{self.rate} % [{', '.join(rate_ends(100 * i.low, 100 * i.high))}]"

    @property
    def rate(self) -> str:
        """The share in per cent; 0 and 100 only where it is none or all."""
        return rate(100 * self.yes / max(self.judged, 1))


@dataclass(frozen=True, slots=True)
class Line:
    """A system's line.

    Attributes:
        system: Who.
        name: The robot's name for people.
        navigator: Who drove, and what has to be known of it.
        shares: An answer a question.
        time: Median completion time on the tests that all finished, s.
        nearest: Median of the least distances to an obstacle, m, and the least of all.
        score: Mean score, a failure counting 0; empty where there is none.
        tuned: On what its parameters were chosen, if on some of these tests or ones like them.
    """

    system: System
    name: str
    navigator: str
    shares: tuple[Share, ...]
    time: str
    nearest: tuple[str, str]
    score: str
    tuned: str


@dataclass(frozen=True, slots=True)
class Verdicts:
    """The lines of those that ran the same tests, the most precise first.

    Attributes:
        lines: A line a system; references that were told the truth last.
        n: Number of tests.
        left_out: Trials of theirs that are left out here, for not all ran those tests.
        finished: On how many tests the times are.
        shared: What has to be said of trials that share a simulation; empty if there are none.
    """

    lines: tuple[Line, ...]
    n: int
    left_out: int
    finished: int
    shared: str = ""

    @property
    def scored(self) -> bool:
        """Whether any has a score."""
        return any(line.score for line in self.lines)

    @property
    def timed(self) -> str:
        """On what the times are, or why there are none."""
        tests = counted(self.finished, "test")
        if len(self.lines) == 1:
            return f"median of {tests}"
        if self.finished >= FEWEST_TIMES:
            return f"median of {tests} that all finished"
        return f"all finished {tests}: fewer than {FEWEST_TIMES} are not compared"

    @property
    def caption(self) -> str:
        """How the table is to be read."""
        several = len(self.lines) > 1
        said = counted(self.n, "test")
        said += ", the same for all" if several else ""
        said += f"; {self.left_out} trials of tests that not all ran are left out here" if self.left_out else ""
        said += ". Shares with Wilson's 95 % interval, which is shorter than the exact one that SR has below and on the terminal"
        if several:
            said += (
                "; below, how far from the highest, with Newcombe's interval for pairs. A difference is shown where McNemar's exact test "
                "says so after Holm's correction over every two systems (p at most 0.05)"
            )
            said += (
                ": some intervals leave out 0 and yet nothing is shown, for each interval stands for itself, and of many some do by chance"
                if any(s.doubtful for line in self.lines for s in line.shares) else ""
            )  # fmt: skip
        return f"{said}.{self.shared}"


def verdicts(f: Findings, group: SameTests) -> Verdicts:
    """What the first table says of a group."""
    rivals = [s for s in group.systems if s.navigator not in f.privileged]
    shares = [_shares(group, rivals, ask) for _, _, ask in QUESTIONS]
    finished = [i for i in range(group.n) if all(group.rows[s][i]["CT"] is not None for s in group.systems)]
    obstacles = any(recordings.had_obstacles(r) for s in group.systems for r in group.rows[s])
    lines = []
    for system in group.systems:
        rows = group.rows[system]
        privileged = " (was told the truth)" if system.navigator in f.privileged else ""
        setup = f", set-up {system.setup}" if system.setup is not None else ""
        times = [rows[i]["CT"] for i in finished]
        scores = [r["barn_score"] or 0.0 for r in rows] if any(r["barn_score"] is not None for r in rows) else []
        lines.append(Line(
            system, f.title(system.robot), f"{driver(system.navigator)}{setup}{privileged}", tuple(s[system] for s in shares),
            f"{num(median(times), 1)} s" if len(times) >= FEWEST_TIMES or (times and len(group.systems) == 1) else NONE,
            _nearest(rows, obstacles), num(mean(scores), 3) if scores else "", tuning.sentence(rows) if tuning.sign(rows) else "",
        ))  # fmt: skip
    lines.sort(key=lambda line: (line.system not in rivals, -line.shares[-1].yes))
    shared = sharing.footnote(r for s in group.systems for r in group.rows[s])
    return Verdicts(tuple(lines), group.n, group.left_out, len(finished), shared)


def _nearest(rows: Sequence[Row], obstacles: bool) -> tuple[str, str]:
    """Median and least distance from obstacles, and of how many trials it is known if not of all; from walls only where no test has
    `obstacles`: who finished none of those that do would look far away from everything."""
    gaps, of = [r["MDO"] for r in rows if r["MDO"] is not None], ""
    if not gaps:
        if why := recordings.why_no_distance(rows):
            return NONE, why
        if obstacles:
            return NONE, "no finished trial with obstacles"
        gaps, of = [r["MDO_walls"] for r in rows if r["MDO_walls"] is not None], ", from walls"
    if not gaps:
        return NONE, "no obstacles"
    known = f", of {counted(len(gaps), 'trial')}" if len(gaps) < len(rows) else ""
    return f"{num(median(gaps), 2)} m", f"least {num(min(gaps), 2)} m{of}{known}"


def _shares(group: SameTests, rivals: Sequence[System], ask: Callable[[Row], bool | None]) -> dict[System, Share]:
    answers = {s: _answers(group.rows[s], ask) for s in group.systems}
    plain = {s: replace(_share(found), note=_note(group.rows[s], found)) for s, found in answers.items()}
    known = [s for s in rivals if plain[s].judged]
    if len(known) < 2 or len({tuple(answers[s]) for s in known}) == 1:
        return plain
    best = max(known, key=lambda s: plain[s].yes / plain[s].judged)
    pairs = [(a, b) for a, b in combinations(known, 2)]
    tested = {pair: _paired(answers[pair[0]], answers[pair[1]]) for pair in pairs}
    ps = holm([np.nan if t is None else t.p for t in tested.values()]).tolist()
    shown = {pair: t is not None and p <= 0.05 for (pair, t), p in zip(tested.items(), ps, strict=True)}
    found = dict(plain)
    for s in known:
        if plain[s].yes * plain[best].judged == plain[best].yes * plain[s].judged:
            found[s] = replace(plain[s], against="highest")
            continue
        difference = _paired(answers[best], answers[s])
        pair = (best, s) if (best, s) in tested else (s, best)
        if difference is None:
            continue
        found[s] = replace(
            plain[s],
            against=_against(difference, shown[pair]),
            shown=shown[pair],
            doubtful=not shown[pair] and difference.difference.high < 0,
        )
    return found


def _answers(rows: Sequence[Row], ask: Callable[[Row], bool | None]) -> list[bool | None]:
    return [None for _ in rows] if ask is arrived and not any_estimate(rows) else [ask(r) for r in rows]


def _share(answers: Sequence[bool | None]) -> Share:
    known = [a for a in answers if a is not None]
    yes = sum(known)
    return Share(yes, len(known), wilson_interval(yes, len(known)) if known else None)


def _note(rows: Sequence[Row], answers: Sequence[bool | None]) -> str:
    parts = [f"{n} not known" for n in [sum(a is None for a in answers)] if n]
    unsure = sum(bool(a and r.get("to_confirm")) for r, a in zip(rows, answers, strict=True))
    return ", ".join([*parts, *([f"{unsure} of these to be confirmed"] if unsure else [])])


def _paired(a: Sequence[bool | None], b: Sequence[bool | None]) -> PairedSuccess | None:
    both = [(x, y) for x, y in zip(a, b, strict=True) if x is not None and y is not None]
    return paired_success(*np.array(both, dtype=float).T) if both else None


def _against(found: PairedSuccess, shown: bool) -> str:
    d = found.difference
    points = f"{num(100 * d.estimate, 0)} points [{num(100 * d.low, 0)}, {num(100 * d.high, 0)}]"
    return points if shown else f"{points}: no difference shown"
