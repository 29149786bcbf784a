"""`clearway import`: look into recordings, and take motion out of them, without any plan."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.cli._options import Json, tell

if TYPE_CHECKING:
    from clearway.recordings.recording import Contents


NOW_AND_THEN = ("goal", "action", "path", "command", "other")
"""Kinds of things that come when they come, so that nothing of them can lack."""


def import_(
    files: Annotated[list[Path], typer.Argument(help="Recordings: motion capture, bags, tables.", show_default=False)],
    only_list: Annotated[
        bool, typer.Option("--list", help="Only show what the files hold: names, rates, gaps, duration.")
    ] = False,
    format: Annotated[
        str | None, typer.Option(help="As what to read them (`clearway list formats`); default: as they look.")
    ] = None,
    bodies: Annotated[
        list[str] | None,
        typer.Option(
            "--body",
            help="What to take: a marker prefix (tiago:), markers (M1,M2,M3), a body, a topic, map->base_link; "
            "repeat for several. Default: everything that is found.",
        ),
    ] = None,
    cutoff: Annotated[
        str, typer.Option(help="Of the low-pass: residual (chosen by analysis), none, or Hz.")
    ] = "residual",
    out: Annotated[Path, typer.Option(help="Folder for the motions, a CSV each.")] = Path("results/import"),
    as_json: Json = False,
) -> None:
    """Show what recordings hold (--list), or clean the motion of their bodies and write it as CSV. Overwrites nothing."""
    from clearway.recordings import formats

    if only_list:
        held = [formats.look(file, format=format) for file in files]
        if as_json:
            tell([_plain(c) for c in held], indent=2)
        else:
            typer.echo("\n\n".join(_listing(c) for c in held))
        return
    found = [row for file in files for row in _take(file, format, bodies or [], cutoff, out)]
    if as_json:
        tell(found, indent=2)
    else:
        _tell(found, out)
    raise typer.Exit(1 if any("problem" in row for row in found) else 0)


def _take(file: Path, format: str | None, bodies: list[str], cutoff: str, out: Path) -> list[dict[str, Any]]:
    from clearway.errors import ClearwayError
    from clearway.recordings.lab.unplanned import cleaning_at, file_of, motions, summary, write_motion

    rows: list[dict[str, Any]] = []
    for found in motions(file, bodies, cleaning_at(cutoff), format=format):
        row: dict[str, Any] = {"file": str(file), "body": found.name}
        if found.motion is None:
            rows.append(row | {"problem": found.problem})
            continue
        try:
            out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ClearwayError(f"cannot be made: {error.strerror or error}", file=out) from error
        path = out / file_of(file, found.name)
        write_motion(found.motion, path)
        rows.append(row | {"csv": str(path)} | summary(found.motion))
    return rows


def _tell(found: list[dict[str, Any]], out: Path) -> None:
    from clearway.reports.text import columns

    several = len({r["file"] for r in found}) > 1
    heads = (
        *(["file"] if several else []),
        "body",
        "samples",
        "Hz",
        "seen",
        "length",
        "gaps filled",
        "left open",
        "residual",
        "largest",
        "cut-off",
    )
    rows = []
    for r in found:
        if "problem" in r:
            continue
        filled = sum(g["count"] for kind, g in r["gaps"].items() if kind != "open")
        left = r["gaps"].get("open")
        rows.append((
            *([Path(r["file"]).name] if several else []), r["body"], str(r["samples"]), f"{r['rate']:.4g}", f"{100 * r['seen']:.1f} %", f"{r['length']:.2f} m",
            str(filled), f"{left['count']}, to {left['longest']:.2f} s" if left else "0",
            *("-" if r[k] is None else f"{1000 * r[k]:.2f} mm" for k in ("residual", "residual_max")),
            "-" if r["cutoff"] is None else f"{r['cutoff']:.2f} Hz",
        ))  # fmt: skip
    if rows:
        typer.echo(columns(heads, rows))
    said: dict[str, list[str]] = {}
    for r in found:
        for note in r.get("notes", ()):
            said.setdefault(note, []).append(f"{Path(r['file']).name} {r['body']}" if several else r["body"])
    for note, who in said.items():
        typer.echo(f"{', '.join(who)}  {note}")
    for r in found:
        if "problem" in r:
            typer.echo(f"{r['file']}: {r['body']}: {r['problem']}", err=True)
    if rows:
        typer.echo(f"motions: {out} ({len(rows)} of {len(found)} bodies)")


def _listing(held: Contents) -> str:
    from clearway.recordings.formats import formats
    from clearway.reports.text import columns

    lasting = "" if held.start is None else f", {held.duration:.3f} s"
    lines = [f"{held.file}: {formats()[held.format].title}{lasting}{_date(held)}"]
    rows = [
        (
            e.name, e.kind, str(e.count) if e.count or e.kind != "other" else "-", "-" if e.rate is None else f"{e.rate:.4g}",
            *(("-", "-") if e.kind in NOW_AND_THEN else (f"{100 * (1 - e.missing):.1f} %", f"{e.longest_gap:.3f}")), "-" if e.start is None else f"{e.start:.3f}", "-" if e.end is None else f"{e.end:.3f}",
            e.detail,
        )
        for e in held.entries
    ]  # fmt: skip
    heads = ("name", "kind", "samples", "Hz", "seen", "longest gap, s", "from, s", "to, s", "what")
    return "\n".join([*lines, columns(heads, rows) if rows else "nothing in it", *(f"note: {n}" for n in held.notes)])


def _date(held: Contents) -> str:
    from datetime import UTC, datetime

    if held.epoch is None:
        return ""
    try:
        return f", recorded {datetime.fromtimestamp(held.epoch + (held.start or 0.0), UTC):%Y-%m-%d %H:%M:%S} UTC"
    except (OverflowError, ValueError, OSError):
        return ""


def _plain(held: Contents) -> dict[str, Any]:
    from dataclasses import asdict

    return asdict(held) | {"file": str(held.file), "duration": held.duration}
