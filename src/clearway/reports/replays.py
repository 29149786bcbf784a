"""The replays of a report: a sample of many inside the page, more of them in files beside it, and a table of all trials.

Everything is written trial by trial, so that memory holds no more than a page does.
"""

from __future__ import annotations

import base64
import json
import os
import re
import zlib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from itertools import accumulate
from operator import itemgetter
from pathlib import Path
from typing import Any
from urllib.parse import quote

from markupsafe import Markup

from clearway.indicators import INDICATORS
from clearway.reports import outcomes
from clearway.reports.findings import Findings
from clearway.reports.replay_encoding import Packer
from clearway.reports.selection import Row, between, is_recorded, label, system_of, verdict, with_uncertainty
from clearway.reports.words import way_out
from clearway.trials import Trial
from clearway.trials.keeping import is_outline

MOST_INSIDE = 16_000_000
"""Bytes of packed replays inside the page."""
MOST_LISTED = 2000
"""Trials that the page's table and its replays list; of more, a sample."""
MOST_WRITTEN = 10_000
"""Replays beside a page; of any other trial `clearway replay` makes a page of its own."""
MOST_BESIDE = 40
"""Trials that a page of one trial holds beside it."""
FOLDER, EVERY = "replay", "trials.js"
"""Where all of them lie then, seen from the page: a script a trial, and the table of all of them."""


def in_turn(rows: Sequence[Row], first: Row | None) -> list[Row]:
    """The trials in the order in which a page has room for them: `first`; then the failures, then the others, of each
    system, suite and batch in turn one."""
    counts = Counter[Any]()
    places: list[tuple[bool, bool, int]] = []
    for row in rows:
        group = (failed := _failed(row), system_of(row), row["suite"], row["batch"])
        places.append((first is None or row["trial"] != first["trial"], not failed, counts[group]))
        counts[group] += 1
    return [rows[i] for i in sorted(range(len(rows)), key=places.__getitem__)]


def _failed(row: Row) -> bool:
    return row["success"] is not None and not row["success"]


class Replays:
    """The replays of one report.

    Args:
        f: What the report is of.

    Attributes:
        beside: Whether there are files beside the page.
    """

    def __init__(self, f: Findings) -> None:
        self._f, self._packer = f, Packer(f.robots)
        self._order: list[Row] = []
        self._inside: dict[int, Markup] = {}
        self._why: dict[int, str] = {}
        self.beside = False

    def write(self, order: Sequence[Row], page: Path | None) -> None:
        """Pack the trials. Where the page has no room for all of them, `MOST_WRITTEN` are written beside it, and some into it too.

        Args:
            order: The trials, those first that are to stand in the page.
            page: The page's folder; None: all of them stand in the page.
        """
        self._order = list(order)
        sizes: dict[int, int] = {}
        whole = 0
        written = {row["trial"] for row in self._order[:MOST_WRITTEN]}
        for row in sorted(order, key=lambda r: int(r["trial"])):  # as they are stored: each block is read once
            number = row["trial"]
            trial = self._f.results.remains(number) if number in written else None
            if row["reason"] or row["failure"]:
                self._why[number] = outcomes.why(row, None if trial is None else trial.attempt)
            if trial is None:
                continue
            text = in_page(_packed(self._f, self._packer, row, trial))
            sizes[number], whole = len(text), whole + len(text)
            if page is not None and not self.beside and not self._room(len(order), whole):
                self.beside = True
                (page / FOLDER).mkdir()
                for before, packed in self._inside.items():
                    _file(page, before).write_text(_script(packed), encoding="ascii")
                self._inside = {}
            if page is not None and self.beside:
                _file(page, number).write_text(_script(text), encoding="ascii")
            else:
                self._inside[number] = text
        if page is not None and self.beside:
            first = self._order[:MOST_WRITTEN]
            for taken, row in zip(accumulate(sizes[r["trial"]] for r in first), first, strict=True):
                if not self._room(len(self._inside) + 1, taken):
                    break
                self._inside[row["trial"]] = Markup(
                    _file(page, row["trial"]).read_text("ascii")[len(_CALL) : -len(_END)]
                )

    @staticmethod
    def _room(trials: int, size: int) -> bool:
        return trials <= MOST_LISTED and size <= MOST_INSIDE

    def listed(self) -> list[Row]:
        """The trials that the page lists, in their order."""
        return sorted(self._order[:MOST_LISTED], key=lambda r: int(r["trial"]))

    def about(self) -> str:
        """What the page says of the sample; empty where there is none."""
        kept = self._not_kept()
        if not self.beside:
            return kept
        text = f"Of {len(self._order)} trials {len(self._inside)} replays are in this page itself"
        text += f": failures before successes, of each system and batch in turn one. {self._written()} from {FOLDER}/ beside it."
        return f"{text} {self._one()} {kept}".strip()

    def _written(self) -> str:
        return "All open" if len(self._order) <= MOST_WRITTEN else f"The first {MOST_WRITTEN} in that order open"

    def _one(self) -> str:
        """How to see a replay that was not written; empty where all were."""
        if len(self._order) <= MOST_WRITTEN:
            return ""
        return f"clearway replay {self._f.results.path} --trial N makes a page of any other."

    def _not_kept(self) -> str:
        """What is said of trials that were not kept; empty where all were."""
        results = self._f.results
        lost = sum(not results.kept(row) for row in self._order)
        if not lost:
            return ""
        return (
            f"Of {lost} of {len(self._order)} trials only the row in the table was kept (--keep {results.keep}): their replay "
            f"shows where they began. clearway rerun {results.path} --trial N --out DIR runs one again and keeps all of it."
        )

    def shown(self, rows: Sequence[Row], first: int | None) -> dict[str, Any]:
        """What the player is given: the trials it lists, and those that stand in the page.

        Args:
            rows: The trials to list.
            first: The trial to show first; None: none.
        """
        floors = [_deflated(floor) for floor in self._packer.floors.things]
        tests, runs = (
            {key: k for k, key in enumerate(dict.fromkeys(map(of, rows)))} for of in (_test, itemgetter("run"))
        )
        index = {
            "robots": self._packer.robots.things, "floors": floors, "first": first, "folder": FOLDER,
            "total": len(self._order), "one": self._one(),
            "trials": [[r["trial"], _option(self._f, r), tests[_test(r)], runs[r["run"]] if r["run"] else -1] for r in rows],
        }  # fmt: skip
        return {"index": in_page(index), "inline": sorted(self._inside.items())}

    def cells(self, rows: Iterable[Row], columns: Sequence[Mapping[str, Any]]) -> list[list[Any]]:
        """The rows of the table of trials: the cells by column, and last whether the trial failed."""
        return [self._cells(row, columns) for row in rows]

    def write_table(self, columns: Sequence[Mapping[str, Any]], page: Path) -> None:
        """Write the rows of all trials beside the page."""
        with open(page / FOLDER / EVERY, "w", encoding="ascii") as file:
            file.write("clearwayTable([\n")
            for row in self._f.rows:
                file.write(f"{in_page(self._cells(row, columns))},\n")
            file.write("]);\n")

    def _cells(self, row: Row, columns: Sequence[Mapping[str, Any]]) -> list[Any]:
        own = {
            "verdict": verdict(row),
            "reason": self._why.get(row["trial"]) or None,
            "avoidable": way_out(row) or None,
        }
        said = row.get("to_confirm") or ""
        own["to_confirm"] = re.sub(r" \([^()]*(\([^()]*\)[^()]*)*\)", "", said)  # whole: in the replay
        cells = [own[c["key"]] if c["key"] in own else row[c["key"]] for c in columns]
        rounded = [round(v, 6) if isinstance(v, float) else v for v in cells]
        return [*rounded, _failed(row), *_measured(row, columns)]


_CALL, _END = "clearwayTrial(", ");\n"


def _script(packed: str) -> str:
    return f"{_CALL}{packed}{_END}"


def _file(page: Path, number: int) -> Path:
    return page / FOLDER / f"{number:05d}.js"


def _test(row: Row) -> tuple[Any, ...]:
    """What trials share that can be shown side by side: all but who drove."""
    if row["scenario"] is None:
        return (row["trial"],)
    return row["suite"], row["scenario"], row["robot"], row["member"]


def companions(f: Findings, row: Row) -> list[Row]:
    """The trials that a trial is shown with: of its simulation's other robots, and of the same test with other drivers."""
    return [
        r for r in f.rows
        if r is not row and (_test(r) == _test(row) or (r["run"] and r["run"] == row["run"]))
    ][:MOST_BESIDE]  # fmt: skip


def _option(f: Findings, row: Row) -> str:
    """What a trial is called in the player's list."""
    drove = row["navigator"] if row["navigator"] else ""
    who = f"{f.title(row['robot'])}{f' ({drove})' if drove else ''}{', ' + row['member'] if row['member'] else ''}, "
    return f"{row['trial']}  {who}{label(row)}: {verdict(row)}"


def _deflated(value: Any) -> str:
    return base64.b64encode(zlib.compress(json.dumps(value, separators=(",", ":")).encode())).decode()


def _packed(f: Findings, packer: Packer, row: Row, trial: Trial) -> dict[str, Any]:
    """One trial for the replay, with the lines that stand beside it."""
    facts = {
        "robot": f.title(row["robot"]),
        "navigator": row["navigator"] + (f", set-up {row['setup']}" if row.get("setup") else ""),
        "test": f"{row['batch']} {row['configuration']}",
    }
    for key, name, unit in (("speed", "set speed", "m/s"), ("obstacle_speed", "obstacle speed", "m/s"), ("size", "edge", "m"),
                            ("gap", "gap", "d_base"), ("repetition", "repetition", ""), ("seed", "seed", "")):  # fmt: skip
        if row[key] is not None:
            facts[name] = (
                f"{row[key]:g} {unit}".strip() if isinstance(row[key], float) else f"{row[key]} {unit}".strip()
            )
    for name, digits in outcomes.DIGITS.items():
        if row[name] is not None:
            facts[name] = f"{with_uncertainty(row, name, digits)} {INDICATORS[name].unit}"
    if reason := outcomes.why(row, trial.attempt):
        facts["reason"] = reason
    if is_outline(trial):
        facts["not kept"] = f"how it went (--keep {f.results.keep}); it stands where it began"
    if left := way_out(row):
        facts["way out"] = left
    if row.get("violations"):
        facts["violated assumptions"] = f"{row['violations']}, see the events"
    if is_recorded(row):
        why = json.loads(row["not_computable"])
        if row["duration"]:  # else nothing was recorded, which is said once
            facts |= {name: _unknown(row, name, why) for name in (*outcomes.DIGITS, "success") if name in why}
        said = (("to_confirm", "to confirm"), ("near_tolerance", "near its tolerance"), ("note", "note"))
        facts |= {name: row[key] for key, name in said if row.get(key)}
        if (number := f.planned(row)) is not None:
            facts["in the test plan"] = f"no. {number}"
    packed = packer.pack(trial, row["trial"], facts)
    if (video := _video(f, trial)) is not None:
        packed["video"] = video
    return packed | {"title": _option(f, row), "verdict": verdict(row), "success": bool(row["success"])}


def _video(f: Findings, trial: Trial) -> tuple[str, float] | None:
    """The trial's video as a page of the report links to it, and where in it the trial begins, s; None without one."""
    told = trial.provenance.get("video")
    if not isinstance(told, Mapping) or not isinstance(told.get("start"), int | float):
        return None
    plan = f.results.campaign.get("run", {}).get("test_plan")
    file = Path(os.path.abspath(str(plan))).parent / str(told.get("file")) if plan else Path(str(told.get("file")))
    page = Path(os.path.abspath(f.results.path)) / "report"
    return quote(os.path.relpath(file, page) if plan else str(file)), float(told["start"])


def _unknown(row: Row, name: str, why: Mapping[str, str]) -> str:
    """Why a recording has no value of an indicator, and its bounds if it has those."""
    found = between(row, name)
    return f"{found} {INDICATORS[name].unit}: {why[name]}" if found else f"not computable: {why[name]}"


def _measured(row: Row, columns: Sequence[Mapping[str, Any]]) -> list[dict[int, Any]]:
    """Of a measured trial: by column, the uncertainty of its value, or its bounds and why it has none."""
    if not is_recorded(row):
        return []
    why = json.loads(row["not_computable"])
    found: dict[int, Any] = {}
    for i, c in enumerate(columns):
        if u := row.get(f"{c['key']}_U"):
            found[i] = u
        elif c["key"] in why:
            found[i] = [between(row, c["key"]), _unknown(row, c["key"], why)]
    return [found]


def in_page(value: Any) -> Markup:
    """JSON that can stand in a script element: pure ASCII without <, > and &."""
    text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))
