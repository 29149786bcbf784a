"""The page's first three sentences, made from the numbers: what was tested, what came out, what limits it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from clearway.reports import causes, decision_time, paper, recordings, sharing, tuning
from clearway.reports.findings import Findings
from clearway.reports.grid import counted, num
from clearway.reports.same_tests import LABELS
from clearway.reports.selection import System, distinct, driver, is_recorded
from clearway.reports.verdicts import Line, Verdicts
from clearway.scenarios.suite import Section, beyond_reach, listed
from clearway.statistics import wilson_interval

FEW = 3
"""Systems that are named one by one in a sentence."""


@dataclass(frozen=True, slots=True)
class Summary:
    """Three sentences.

    Attributes:
        tested: What was tested.
        result: What came out.
        limits: What to be careful about.
    """

    tested: str
    result: str
    limits: str


def summary(f: Findings, found: Sequence[Verdicts]) -> Summary:
    """What the page says first."""
    said = [_result(f, v) for v in found[:FEW]]
    if more := len(found) - len(said):
        said.append(f"What came out of {counted(more, 'other group')} of tests stands in the tables.")
    return Summary(_tested(f, found), " ".join(said) or "There are no trials.", _limits(f, found))


# --- what was tested --------------------------------------------------------------------------------------------------


def _tested(f: Findings, found: Sequence[Verdicts]) -> str:
    if not f.rows:
        return "Nothing was run."
    suites = " and ".join(suite.title for suite in f.suites.values())
    tests = (
        f"{len(f.rows)} trials in all"
        if len(found) > 1
        else f"{counted(found[0].n, 'test')}{' each' if len(f.systems) > 1 else ''}"
    )
    if len(found) == 1 and len(f.systems) > 1:
        tests += ", the same for all" if len(f.systems) > 2 else ", the same for both"
    there = sum(map(is_recorded, f.rows))
    how = (
        "real robots, measured"
        if there == len(f.rows)
        else f"{there} of the trials measured, the others simulated"
        if there
        else "simulated"
    )
    sources = "".join(f" {suite.source}" for suite in f.suites.values() if suite.source)
    return f"{suites} ({how}): {_who(f.systems, f)}, {tests}.{sources}"


def _who(systems: Sequence[System], f: Findings) -> str:
    robots = list(dict.fromkeys(s.robot for s in systems))
    navigators = list(dict.fromkeys(driver(s.navigator) for s in systems))
    titles = [f.title(r) for r in robots]
    by = {r: [driver(s.navigator) for s in systems if s.robot == r] for r in robots}
    if len(robots) <= FEW and any(set(own) != set(navigators) for own in by.values()):
        return listed([f"{f.title(r)} driven by {listed(list(dict.fromkeys(own)))}" for r, own in by.items()])
    if len(robots) <= FEW and len(navigators) <= FEW:
        return f"{listed(titles)}{', each' if len(robots) > 1 else ''} driven by {listed(navigators)}"
    return f"{listed(titles) if len(robots) <= FEW else f'{len(robots)} robots'} with {len(navigators)} navigators"


# --- what came out ----------------------------------------------------------------------------------------------------


def _result(f: Findings, v: Verdicts) -> str:
    lines = v.lines
    said = " ".join(_of_one(line) for line in lines) if len(lines) <= FEW else _of_many(lines)
    rows = [r for line in lines for r in f.of(line.system)]
    failed = [r for r in rows if r["success"] is False]
    if forgiven := causes.of_slack(failed):
        what = "that is the localisation's error, or a planner that stops at the rim of what is allowed"
        said += f" {forgiven} of the {counted(len(failed), 'failure')} missed the goal's tolerance by less than 2 cm and 0.02 rad where the robot took itself to be there: {what}."
    return said


def _of_one(line: Line) -> str:
    free, arrived, precise = line.shares
    name = f"{line.name} with {line.navigator}"
    if not precise.judged:
        return f"{name}: of no trial it is known whether it succeeded."
    parts = []
    if free.judged == precise.judged:
        parts.append("touched nothing" if free.yes == free.judged else f"touched something in {free.judged - free.yes}")
    if arrived.judged == precise.judged and arrived.yes != precise.yes:
        parts.append(f"arrived by its own estimate in {arrived.yes}")
    parts.append(
        f"stood within tolerance by its true pose in {precise.yes} of {precise.judged} tests ({precise.percent.split(' [')[0]})"
    )
    return f"{name} {listed(parts)}."


def _of_many(lines: Sequence[Line]) -> str:
    known = [line for line in lines if line.shares[-1].judged]
    if not known:
        return "Of no trial it is known whether it succeeded."
    high, low = (_extreme(known, -1, end) for end in (max, min))
    said = (
        f"All {len(known)} were equally often successful, {_often(high, -1)}."
        if len(high) == len(known)
        else f"Most often successful: {_names(high)}, {_often(high, -1)}; least often: {_names(low)}, {_often(low, -1)}."
    )
    hit = [line for line in known if line.shares[0].yes < line.shares[0].judged]
    if not hit:
        return f"{said} None of them touched anything."
    most = _extreme(hit, 0, min)
    return (
        f"{said} {len(hit)} of {len(known)} touched something, {_names(most)} most often ({_often(most, 0, of=False)})."
    )


def _extreme(lines: Sequence[Line], question: int, end: Callable[[list[float]], float]) -> list[Line]:
    """Those with the greatest or the least share, all of them where several are alike."""
    rates = [line.shares[question].yes / line.shares[question].judged for line in lines]
    return [line for line, rate in zip(lines, rates, strict=True) if rate == end(rates)]


def _names(lines: Sequence[Line]) -> str:
    """Who they are; of many how many."""
    return (
        listed([f"{line.name} with {line.navigator}" for line in lines])
        if len(lines) <= FEW
        else f"{len(lines)} systems alike"
    )


def _often(alike: Sequence[Line], question: int, *, of: bool = True) -> str:
    """In how many tests each of some that are alike did it; `of` False: did not."""
    counts = {(s.yes if of else s.judged - s.yes, s.judged) for s in (line.shares[question] for line in alike)}
    (some, tests), each = min(counts), " each" if len(alike) > 1 else ""
    return f"{some} of {counted(tests, 'test')}{each}" if len(counts) == 1 else f"{100 * some / tests:.0f} %{each}"


# --- what limits it ---------------------------------------------------------------------------------------------------


def _limits(f: Findings, found: Sequence[Verdicts]) -> str:
    if not f.rows:
        return "There is nothing to judge by."
    parts = []
    if not f.recorded:
        parts.append("the robots are simulated, so this says how they would do as far as their models hold")
    least = min(v.n for v in found)
    middle = wilson_interval(least // 2, least)
    half = 50 * (middle.high - middle.low)
    parts.append(f"with {counted(least, 'test')} a rate is known to about ±{num(half, 0 if half >= 1 else 1)} points")
    if any(
        n > 1
        for n in Counter(
            (
                r["robot"],
                r["navigator"],
                r.get("setup"),
                r.get("member") or "",
                r["suite"],
                *(r[name] for name in LABELS[:-1]),
            )
            for r in f.rows
        ).values()
    ):
        parts.append("repetitions of one test are alike, so the intervals are rather too narrow")
    together, runs = sharing.sharing(f.rows)
    if together:
        parts.append(
            f"{together} of the trials are of robots that met each other in {counted(runs, 'simulation')}, so they are not independent"
        )
    if len(found) > 1:
        parts.append("not all systems met the same tests: compare only those that stand in one table")
    if left := sum(v.left_out for v in found):
        parts.append(
            f"{counted(left, 'trial')} of tests that not all ran {'are' if left > 1 else 'is'} left out of the comparison"
        )
    if f.asked(Section.PAPER_A) and any(_short(f, s) for s in f.systems):
        parts.append("only a part of the paper's protocol was run")
    if near := [r for r in f.rows if r.get("tuned") and tuning.sign([r])]:
        parts.append(
            f"in {len(near)} trials the navigator's parameters were chosen on these tests or ones like them, which flatters it"
        )
    parts += [f"{sentence}; TCS and the parts of CT go by the set speed" for sentence in _too_fast(f)]
    if slow := decision_time.warnings(f):
        parts.append(
            f"{listed([f.name(s) for s in slow])} thought longer than a control period allows, and the simulated world waited"
        )
    unsure = [r for r in f.rows if r.get("to_confirm")]
    if unsure:
        parts.append(
            f"{counted(len(unsure), 'trial')} have to be confirmed by a person"
            if len(unsure) > 1
            else "1 trial has to be confirmed by a person"
        )
    if lost := len(recordings.unrecorded(f)) + len(recordings.unusable(f)):
        parts.append(f"{counted(lost, 'attempt')} without a usable recording count{'' if lost > 1 else 's'} as failed")
    if "truth" in distinct(f.rows, "localisation"):
        parts.append("the robots were told where they are")
    return f"{_capital('; '.join(parts))}."


def _too_fast(f: Findings) -> list[str]:
    """A sentence for each robot that couldn't drive the set speed of some of its simulated trials."""
    simulated = [r for r in f.rows if not is_recorded(r)]
    said = (
        beyond_reach((r["speed"] for r in simulated if r["robot"] == name), f.title(name), robot.drive.v_max)
        for name, robot in f.robots.items()
        if robot is not None
    )
    return [sentence for sentence in said if sentence]


def _short(f: Findings, system: System) -> bool:
    counts = Counter(r["batch"] for r in f.of(system) if r["suite"] in f.asked(Section.PAPER_A))
    return bool(counts) and any(counts[batch] < n for batch, n in paper.PROTOCOL.items())


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
