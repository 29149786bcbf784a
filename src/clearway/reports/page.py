"""Writes the report: one self-contained page, its figures as SVG, its tables as CSV.

Nothing in a results directory is trusted to be harmless: Jinja escapes all text, JSON inside the page can't close its
script element, scripts build cells as text only, and a content security policy lets nothing run but the scripts that
the page was written with (by their hashes) and the replays beside it.
"""

from __future__ import annotations

import base64
import hashlib
import os
import re
import shutil
from collections.abc import Sequence
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from clearway.errors import ClearwayError
from clearway.placing import placed, working_folder
from clearway.reports import (
    ablation,
    acceptance,
    causes,
    charts,
    conditions,
    crowding,
    decision_time,
    encounters,
    fleets,
    head_to_head,
    outcomes,
    paper,
    paper_b,
    parameters,
    recordings,
    rescue,
    rescue_figures,
    same_tests,
    strips,
    summary,
    theme,
    trajectory_plots,
    tuning,
    verdicts,
)
from clearway.reports.barn import barn
from clearway.reports.findings import Findings
from clearway.reports.published import published
from clearway.reports.replays import EVERY, FOLDER, Replays, companions, in_page, in_turn
from clearway.reports.searched import searched
from clearway.reports.selection import is_recorded, label, representative
from clearway.reports.tables import NAMES, write_tables
from clearway.scenarios.suite import Section
from clearway.statistics import FEWEST, Verdict
from clearway.trials.store import Results, open_results

PAGE = "index.html"
_SCRIPTS = ("decode.js", "lidar.js", "stage.js", "replay.js", "table.js", "menu.js")


def write_report(path: str | os.PathLike[str], verdict: Verdict | None = None) -> Path:
    """Write `report/` into the results directory `path`, whole or not at all, and return its page.

    Args:
        path: The results directory.
        verdict: With what the page begins, where criteria were given.

    Raises:
        ClearwayError: `path` holds no results, or can't be written to.
    """
    results = open_results(Path(path))
    folder = results.path / "report"
    try:
        with working_folder(results.path, "report") as new:
            for part in ("figures", "tables"):
                (new / part).mkdir()
            build(results, new, verdict)
            _swap(new, folder)
    except OSError as error:
        raise ClearwayError(f"the report cannot be written: {error.strerror or error}", file=folder) from error
    return folder / PAGE


def write_replay(results: Results, trial: int) -> Path:
    """Write a page that replays one trial, with those of its simulation and of the same test beside it, into `report/` of its
    results directory, and return it.

    Raises:
        ClearwayError: there is no such trial, or it can't be written.
    """
    f = Findings(results)
    row = next((r for r in f.rows if r["trial"] == trial), None)
    if row is None:
        raise ClearwayError(f"there is no trial {trial}; it holds 0 to {len(results) - 1}", file=results.path)
    replays = Replays(f)
    rows = [row, *companions(f, row)]
    replays.write(rows, None)
    page = _environment().get_template("replay.html").render(
        title=f"Trial {trial}: {f.title(row['robot'])}, {label(row)}",
        scenario=row["scenario"] or "recording",
        replay=replays.shown(sorted(rows, key=lambda r: int(r["trial"])), trial),
        **_frame(("decode.js", "lidar.js", "stage.js", "replay.js")),
    )  # fmt: skip
    file = results.path / "report" / f"trial-{trial:05d}.html"
    with placed(file.parent) as new:
        (new / file.name).write_text(page, encoding="utf-8", errors="replace")
    return file


def build(results: Results, folder: Path, verdict: Verdict | None = None) -> None:
    """Write the report's files into `folder`, which has `figures/` and `tables/`; the page begins with the `verdict`, if any."""
    f = Findings(results)
    figures = _figures(f, folder / "figures")
    runs = fleets.runs(f)
    tables = write_tables(f, runs, folder / "tables")
    last = [r for r in f.rows if (r["suite"], r["batch"]) == (f.rows[-1]["suite"], f.rows[-1]["batch"])]
    first = representative([r for r in last if r["success"]] or last)
    replays = Replays(f)
    replays.write(in_turn(f.rows, first), folder)
    columns = outcomes.trial_columns(f)
    listed = replays.listed()
    if len(listed) < len(f.rows):
        replays.write_table(columns, folder)
    duels = head_to_head.comparisons(f)
    simulated = {r["robot"] for r in f.rows if not is_recorded(r)}
    page = _environment().get_template("page.html").render(
        f=f,
        accepted=None if verdict is None else acceptance.on_page(verdict),
        **_first_screen(f),
        about=conditions.test(f),
        vehicles=[(f.title(name), conditions.vehicle(f, name)) for name in f.robots],
        deviations=conditions.deviations(f),
        figures=figures,
        batches=[outcomes.batches(f, s) for s in f.systems],
        breakdown=outcomes.breakdown(f),
        decisions=decision_time.table(f),
        beside=outcomes.beside(f),
        space=outcomes.space(f),
        driving=encounters.driving(f),
        people=encounters.people(f),
        fleets=fleets.fleets(f, runs),
        incidents=encounters.incidents(f),
        significance=[g for s in f.systems if (g := outcomes.significance(f, s))],
        least_p=min((t["smallest_p"] for t in f.tests if t["smallest_p"] is not None), default=None),
        normality=outcomes.normality(f),
        speeds=len({r["speed"] for r in f.rows if r["speed"] is not None}),
        correlated=f.correlated,
        correlations=outcomes.correlations(f),
        table_3=[g for name in f.robots if (g := parameters.table_3(f, name))],
        missing=recordings.missing(f),
        bounds=recordings.bounds(f),
        unsure=recordings.to_confirm(f),
        near=recordings.near_tolerance(f),
        planned=f.planned,
        imports=recordings.overview(f),
        histories=recordings.histories(f),
        unrecorded=recordings.unrecorded(f),
        unusable=recordings.unusable(f),
        tuned_on=tuning.declarations(results.campaign),
        every=[(f.title(n), parameters.every_parameter(r)) for n, r in f.robots.items() if r is not None and n in simulated],
        rescues=rescue.tables(f),
        ablations=ablation.tables(f),
        duels=[g for g in (head_to_head.table(f, duels), head_to_head.indicator_table(duels)) if g is not None],
        compared=head_to_head.verdicts(f, duels),
        paper_b=paper_b,
        of_paper_a=bool(f.asked(Section.PAPER_A)),
        published=published(f),
        barns=[b for s in f.systems if (b := barn(f, s))],
        tables=[(name, NAMES[name]) for name in tables],
        trials=in_page({"columns": columns, "rows": replays.cells(listed, columns), "page": 50, "total": len(f.rows)}),
        replay=replays.shown(listed, first["trial"] if first else None),
        sample=replays.about(),
        every_trial=f"{FOLDER}/{EVERY}",
        paper=paper,
        **_frame(_SCRIPTS, beside=replays.beside),
    )  # fmt: skip
    (folder / PAGE).write_text(page, encoding="utf-8", errors="replace")


def first_screen(results: Results) -> dict[str, Any]:
    """What the page begins with, as its template asks for it."""
    return _first_screen(Findings(results))


def _first_screen(f: Findings) -> dict[str, Any]:
    found = [verdicts.verdicts(f, group) for group in same_tests.same_tests(f)]
    said = summary.summary(f, found)
    search = searched(f, said.tested)
    return {
        "title": _title(f),
        "said": search.said if search else said,
        "breaks": search.breaks if search else (),
        "verdicts": () if search else found,  # shares of what was searched for mean nothing
        "questions": verdicts.QUESTIONS,
        "fixes_of": [(f.name(s), n, causes.causes(f, s)) for s in f.systems if (n := causes.failures(f.of(s)))],
        "fixes_of_all": causes.causes_of_all(f),
        "slow": list(decision_time.warnings(f).values()),
    }


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
        "strips": [],
        "bars": [],
        "correlations": [],
        "barn": [],
        "rescue": [],
        "thoughts": [],
        "people": [],
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
                trajectory_plots.layout(f.results, f.of(f.systems[0])),
            )
        for system in f.systems:
            slug, name = _slug(f"{system.robot} {system.navigator} {system.setup or ''}".strip()), f.name(system)
            rows = f.of(system)
            keep("trajectories", f"trajectories-{slug}", name, trajectory_plots.trajectories(f.results, rows))
            if any(r["suite"] in f.asked(Section.PAPER_A) for r in rows):
                keep("bars", f"bars-{slug}", name, charts.bars(f.bars(system)))
            if (found := barn(f, system)) and len(found.courses) >= FEWEST:
                points = [(str(c.world), c.published, c.here) for c in found.courses]
                drawn = charts.agreement(points, "success, published", "success, here", "Success per world")
                keep("barn", f"barn-{slug}", f"{name}, success per world", drawn)
        for suite in rescue.suites(f):
            for robot, navigator in dict.fromkeys((s.robot, s.navigator) for s in ablation.whole(f.systems)):
                rivals = [s for s in f.systems if (s.robot, s.navigator) == (robot, navigator)]
                row = rescue.shown(f, suite, rivals[-1])
                if row is None:
                    continue
                same = [r for s in rivals for r in f.of(s) if (r["suite"], r["scenario"]) == (suite, row["scenario"])]
                title = f"{f.title(robot)} · {navigator}, {label(row)}"
                slug = _slug(f"{robot} {navigator} {suite}")
                keep(
                    "rescue",
                    f"paths-{slug}",
                    title,
                    rescue_figures.paths(f.results, same, f"{navigator}, {row['batch']} {row['configuration']}"),
                )
                if f.results.remains(row["trial"]).snapshots:
                    keep("thoughts", f"thought-{slug}", title, rescue_figures.thought(f.results, row))
        for indicator in strips.SHOWN:
            strip = strips.strips(f.rows, f.name, (indicator,), f.tolerances)
            if strip is not None:
                keep("strips", f"strips-{indicator.lower().replace('_', '-')}", f"{indicator} of every trial", strip)
        if (distances := crowding.distances(f)) is not None:
            keep("people", "person-distance", "Smallest distance from a person", distances)
        for suite in f.asked(Section.BY_NUMBER):
            for column, words in crowding.COUNTED.items():
                if (curves := crowding.by_number(f, suite, column)) is not None:
                    keep(
                        "people",
                        f"by-{_slug(f'{words} {suite}')}",
                        f"{f.suites[suite].title} by number of {words}",
                        curves,
                    )
        if f.correlated:
            titles = {key[0]: f.title(key[0]) for key in f.matrices}
            keep("correlations", "correlations", "Correlations", charts.correlations(f.matrices, titles))
    return out


def _title(f: Findings) -> str:
    return " and ".join(suite.title for suite in f.suites.values()) or "No trials"


def page_of(template: str, **content: Any) -> str:
    """A page without scripts, in the report's style.

    Args:
        template: Its template's name.
        **content: What the template asks for, beside style and policy.
    """
    return _environment().get_template(template).render(**content, **_frame(()))


def _frame(scripts: Sequence[str], *, beside: bool = False) -> dict[str, Any]:
    """Style, scripts and the policy that admits these scripts only."""
    texts = [_asset(name) for name in scripts]
    hashes = (
        " ".join(f"'sha256-{base64.b64encode(hashlib.sha256(t.encode()).digest()).decode()}'" for t in texts)
        or "'none'"
    )
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


def _slug(name: str) -> str:
    """A harmless file name, different for different names."""
    plain = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")[:60]
    return (
        plain if re.fullmatch(r"[A-Za-z0-9 -]+", name) else f"{plain}-{hashlib.sha256(name.encode()).hexdigest()[:6]}"
    )
