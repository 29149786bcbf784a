"""Writes the report: one self-contained page, its figures as SVG, its tables as CSV.

Nothing in a results directory is trusted to be harmless: Jinja escapes all text, JSON inside the page can't close its
script element, scripts build cells as text only, and a content security policy lets nothing run but the scripts that
the page was written with (by their hashes) and the replays beside it.
"""

from __future__ import annotations

import base64
import hashlib
import json
import os
import re
import shutil
import zlib
from collections.abc import Mapping, Sequence
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from clearway.errors import ClearwayError
from clearway.indicators import INDICATORS
from clearway.reports import (
    ablation,
    charts,
    conditions,
    head_to_head,
    outcomes,
    paper,
    paper_b,
    parameters,
    recordings,
    rescue,
    rescue_figures,
    theme,
    trajectory_plots,
    tuning,
)
from clearway.reports.barn import barn
from clearway.reports.findings import Findings
from clearway.reports.replay_encoding import Packer
from clearway.reports.selection import Row, is_recorded, label, representative, verdict, with_uncertainty
from clearway.reports.tables import NAMES, write_tables
from clearway.scenarios.suite import Section
from clearway.trials.store import Results, open_results

MOST_INLINE = 16_000_000
"""Bytes of packed replays that stay inside the page; more go to files beside it, in `replay/`."""
PAGE = "index.html"
_SCRIPTS = ("decode.js", "lidar.js", "stage.js", "replay.js", "table.js")


def write_report(path: str | os.PathLike[str]) -> Path:
    """Write `report/` into the results directory `path`, whole or not at all, and return its page.

    Raises:
        ClearwayError: `path` holds no results, or can't be written to.
    """
    results = open_results(Path(path))
    folder = results.path / "report"
    new = results.path / f".report-{os.getpid()}"
    try:
        shutil.rmtree(new, ignore_errors=True)
        for part in ("figures", "tables"):
            (new / part).mkdir(parents=True)
        build(results, new)
        _swap(new, folder)
    except OSError as error:
        raise ClearwayError(f"the report cannot be written: {error.strerror or error}", file=folder) from error
    finally:
        shutil.rmtree(new, ignore_errors=True)
    return folder / PAGE


def write_replay(results: Results, trial: int) -> Path:
    """Write a page that replays one trial, into `report/` of its results directory, and return it.

    Raises:
        ClearwayError: there is no such trial, or it can't be written.
    """
    f = Findings(results)
    row = next((r for r in f.rows if r["trial"] == trial), None)
    if row is None:
        raise ClearwayError(f"there is no trial {trial}; it holds 0 to {len(results) - 1}", file=results.path)
    packer = Packer(f.robots)
    packed = {trial: _json(_packed(f, packer, row))}
    page = _environment().get_template("replay.html").render(
        title=f"Trial {trial}: {f.title(row['robot'])}, {label(row)}",
        scenario=row["scenario"] or "recording",
        replay=_replay(packer, [row], f, trial, packed),
        **_frame(("decode.js", "lidar.js", "stage.js", "replay.js")),
    )  # fmt: skip
    file = results.path / "report" / f"trial-{trial:05d}.html"
    try:
        file.parent.mkdir(exist_ok=True)
        new = file.with_suffix(f".{os.getpid()}")
        new.write_text(page, encoding="utf-8", errors="replace")
        os.replace(new, file)
    except OSError as error:
        raise ClearwayError(f"the replay cannot be written: {error.strerror or error}", file=file) from error
    return file


def build(results: Results, folder: Path) -> None:
    """Write the report's files into `folder`, which has `figures/` and `tables/`."""
    f = Findings(results)
    figures = _figures(f, folder / "figures")
    tables = write_tables(f, folder / "tables")
    packer = Packer(f.robots)
    packed = {row["trial"]: _json(_packed(f, packer, row)) for row in f.rows}
    beside = sum(len(p) for p in packed.values()) > MOST_INLINE
    if beside:
        (folder / "replay").mkdir()
        for trial, text in packed.items():
            (folder / "replay" / f"{trial:05d}.js").write_text(f"clearwayTrial({text});\n", encoding="ascii")
    last = [r for r in f.rows if r["batch"] == f.rows[-1]["batch"]]
    first = representative([r for r in last if r["success"]] or last)
    columns = outcomes.trial_columns(f)
    duels = head_to_head.comparisons(f)
    simulated = {r["robot"] for r in f.rows if not is_recorded(r)}
    page = _environment().get_template("page.html").render(
        f=f,
        title=_title(f),
        cards=outcomes.cards(f),
        about=conditions.test(f),
        vehicles=[(f.title(name), conditions.vehicle(f, name)) for name in f.robots],
        deviations=conditions.deviations(f),
        figures=figures,
        batches=[outcomes.batches(f, s) for s in f.systems],
        breakdown=outcomes.breakdown(f),
        beside=outcomes.beside(f),
        space=outcomes.space(f),
        significance=[g for s in f.systems if (g := outcomes.significance(f, s))],
        normality=outcomes.normality(f),
        correlations=outcomes.correlations(f),
        table_3=[g for name in f.robots if (g := parameters.table_3(f, name))],
        missing=recordings.missing(f),
        unsure=recordings.to_confirm(f),
        near=recordings.near_tolerance(f),
        planned=f.planned,
        imports=recordings.overview(f),
        histories=recordings.histories(f),
        unrecorded=recordings.unrecorded(f),
        tuned_on=tuning.declarations(results.campaign),
        every=[(f.title(n), parameters.every_parameter(r)) for n, r in f.robots.items() if r is not None and n in simulated],
        rescues=rescue.tables(f),
        ablations=ablation.tables(f),
        duels=[g for g in (head_to_head.table(f, duels), head_to_head.indicator_table(duels)) if g is not None],
        verdicts=head_to_head.verdicts(duels),
        paper_b=paper_b,
        of_paper_a=bool(f.asked(Section.PAPER_A)),
        barns=[b for s in f.systems if (b := barn(f, s))],
        tables=[(name, NAMES[name]) for name in tables],
        trials=_json({"columns": columns, "rows": _table_rows(f, columns), "page": 50}),
        replay=_replay(packer, f.rows, f, first["trial"] if first else None, {} if beside else packed),
        paper=paper,
        **_frame(_SCRIPTS, beside=beside),
    )  # fmt: skip
    (folder / PAGE).write_text(page, encoding="utf-8", errors="replace")


def _swap(new: Path, folder: Path) -> None:
    """Put the finished folder in place of the old one; single trials' pages made by `write_replay` move along."""
    old = new.with_name(new.name + "-old")
    shutil.rmtree(old, ignore_errors=True)
    if folder.exists():
        for page in sorted(folder.glob("trial-*.html")):
            shutil.copy2(page, new / page.name)
        os.rename(folder, old)
    os.rename(new, folder)
    shutil.rmtree(old, ignore_errors=True)


def _figures(f: Findings, folder: Path) -> dict[str, list[tuple[str, Markup]]]:
    """Draw every figure: writes the files, and returns the inline versions with their titles by section."""
    out: dict[str, list[tuple[str, Markup]]] = {
        "layout": [],
        "trajectories": [],
        "bars": [],
        "correlations": [],
        "barn": [],
        "rescue": [],
        "thoughts": [],
    }

    def keep(section: str, name: str, title: str, drawn: Any) -> None:
        svg = theme.to_svg(drawn, name)
        (folder / f"{name}.svg").write_text(svg, encoding="utf-8", errors="replace")
        out[section].append((title, Markup(theme.themed(svg, str(escape(title))))))

    with theme.style():
        if f.systems:
            keep(
                "layout",
                "layout",
                "Layout of the configurations",
                trajectory_plots.layout(f.results, f.systems[0].of(f.rows)),
            )
        for system in f.systems:
            slug, name = _slug(f"{system.robot} {system.navigator} {system.setup or ''}".strip()), f.name(system)
            rows = system.of(f.rows)
            keep("trajectories", f"trajectories-{slug}", name, trajectory_plots.trajectories(f.results, rows))
            keep("bars", f"bars-{slug}", name, charts.bars(f.bars(system)))
            if found := barn(f, system):
                points = [(str(c.world), c.published, c.here) for c in found.courses]
                drawn = charts.agreement(points, "success, published", "success, here", "Success per world")
                keep("barn", f"barn-{slug}", f"{name}, success per world", drawn)
        for suite in rescue.suites(f):
            for robot, navigator in dict.fromkeys((s.robot, s.navigator) for s in ablation.whole(f.systems)):
                rivals = [s for s in f.systems if (s.robot, s.navigator) == (robot, navigator)]
                row = rescue.shown(f, suite, rivals[-1])
                if row is None:
                    continue
                same = [
                    r for s in rivals for r in s.of(f.rows) if (r["suite"], r["scenario"]) == (suite, row["scenario"])
                ]
                title = f"{f.title(robot)} · {navigator}, {label(row)}"
                slug = _slug(f"{robot} {navigator} {suite}")
                keep(
                    "rescue",
                    f"paths-{slug}",
                    title,
                    rescue_figures.paths(f.results, same, f"{navigator}, {row['batch']} {row['configuration']}"),
                )
                if f.results.trial(row["trial"]).snapshots:
                    keep("thoughts", f"thought-{slug}", title, rescue_figures.thought(f.results, row))
        if f.matrices:
            titles = {key[0]: f.title(key[0]) for key in f.matrices}
            keep("correlations", "correlations", "Correlations", charts.correlations(f.matrices, titles))
    return out


def _packed(f: Findings, packer: Packer, row: Row) -> dict[str, Any]:
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
    trial = f.results.trial(row["trial"])
    if reason := outcomes.why(row, trial.attempt):
        facts["reason"] = reason
    facts |= {name: row[name] for name in ("cause", "avoidable") if row.get(name)}
    if row.get("violations"):
        facts["violated assumptions"] = f"{row['violations']}, see the events"
    if is_recorded(row):
        why = json.loads(row["not_computable"])
        if row["duration"]:  # else nothing was recorded, which is said once
            facts |= {name: f"not computable: {why[name]}" for name in (*outcomes.DIGITS, "success") if name in why}
        said = (("to_confirm", "to confirm"), ("near_tolerance", "near its tolerance"), ("note", "note"))
        facts |= {name: row[key] for key, name in said if row.get(key)}
        if (number := f.planned(row)) is not None:
            facts["in the test plan"] = f"no. {number}"
    packed = packer.pack(trial, row["trial"], facts)
    return packed | {"verdict": verdict(row), "success": bool(row["success"])}


def _table_rows(f: Findings, columns: Sequence[Mapping[str, Any]]) -> list[list[Any]]:
    """The trials' cells by column, and last whether the trial failed."""
    out = []
    for row in f.rows:
        told = row["reason"] or row["failure"]
        why = outcomes.why(row, f.results.trial(row["trial"]).attempt) if told else ""
        shown = row | {"verdict": verdict(row), "reason": why or None}
        shown["to_confirm"] = re.sub(
            r" \([^()]*(\([^()]*\)[^()]*)*\)", "", row.get("to_confirm") or ""
        )  # whole: in the replay
        cells = [shown[c["key"]] for c in columns]
        rounded = [round(v, 6) if isinstance(v, float) else v for v in cells]
        out.append([*rounded, row["success"] is not None and not row["success"], *_measured(row, columns)])
    return out


def _measured(row: Row, columns: Sequence[Mapping[str, Any]]) -> list[dict[int, Any]]:
    """Of a measured trial: by column, the uncertainty of its value, or why it has none."""
    if not is_recorded(row):
        return []
    why = json.loads(row["not_computable"])
    u = {i: row.get(f"{c['key']}_U") for i, c in enumerate(columns)}
    return [{i: u[i] or why.get(c["key"]) for i, c in enumerate(columns) if u[i] or c["key"] in why}]


def _replay(
    packer: Packer, rows: Sequence[Row], f: Findings, first: int | None, inline: Mapping[int, Markup]
) -> dict[str, Any]:
    several = len(f.systems) > 1
    trials = [
        [r["trial"], f"{r['trial']}  {f.title(r['robot']) + ', ' if several else ''}{label(r)}: {verdict(r)}"]
        for r in rows
    ]
    scenes = [
        base64.b64encode(zlib.compress(json.dumps(s, separators=(",", ":")).encode())).decode()
        for s in packer.scenes.things
    ]
    index = {"robots": packer.robots.things, "scenes": scenes, "trials": trials, "first": first, "folder": "replay"}
    return {"index": _json(index), "inline": list(inline.items())}


def _title(f: Findings) -> str:
    return " and ".join(suite.title for suite in f.suites.values()) or "No trials"


def _frame(scripts: Sequence[str], *, beside: bool = False) -> dict[str, Any]:
    """Style, scripts and the policy that admits these scripts only."""
    texts = [_asset(name) for name in scripts]
    hashes = " ".join(f"'sha256-{base64.b64encode(hashlib.sha256(t.encode()).digest()).decode()}'" for t in texts)
    policy = (
        f"default-src 'none'; script-src {hashes}{' self-placeholder' if beside else ''}; style-src 'unsafe-inline'; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    ).replace("self-placeholder", "'self' file:")
    return {"style": Markup(_asset("page.css")), "scripts": [Markup(t) for t in texts], "policy": policy}


@cache
def _asset(name: str) -> str:
    return "\n" + (resources.files("clearway.reports") / "templates" / name).read_text(encoding="utf-8")


@cache
def _environment() -> Environment:
    return Environment(
        loader=PackageLoader("clearway.reports", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def _json(value: Any) -> Markup:
    """JSON that can stand in a script element: pure ASCII without <, > and &."""
    text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))


def _slug(name: str) -> str:
    """A harmless file name, different for different names."""
    plain = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")[:60]
    return (
        plain if re.fullmatch(r"[A-Za-z0-9 -]+", name) else f"{plain}-{hashlib.sha256(name.encode()).hexdigest()[:6]}"
    )
