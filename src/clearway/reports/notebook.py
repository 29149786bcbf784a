"""What a notebook shows of results: the headline numbers as a small HTML table."""

from __future__ import annotations

import io
from html import escape
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from clearway.trials.store import Results

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def as_html(results: Results, summary: pa.Table) -> str:
    """A heading and a table, a row a group of trials; intervals stand in brackets behind the value, in small type.

    Args:
        results: What is shown.
        summary: `clearway.statistics.summary.summary` of it.
    """
    names = [n for n in summary.column_names if not n.endswith(("_low", "_high"))]
    rows = summary.to_pylist()
    names = [n for n in names if any(row[n] not in (None, "") for row in rows)]
    units = {f.name: f.metadata[b"unit"].decode() for f in summary.schema}
    head = "".join(f"<th>{escape(n)}{f' [{escape(units[n])}]' if units[n] else ''}</th>" for n in names)
    body = "".join(f"<tr>{''.join(f'<td>{_cell(row, n)}</td>' for n in names)}</tr>" for row in rows)
    brackets = "95 % intervals in brackets, of SR the exact one"
    title = (
        f"{len(results)} trials in {escape(str(results.path))}; {brackets}; means are of the trials that have a value"
    )
    return f"<p>{title}</p><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def as_png(figure: Figure) -> bytes:
    """The figure as a PNG image."""
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=110)
    return out.getvalue()


def _cell(row: dict[str, Any], name: str) -> str:
    value, low, high = row[name], row.get(f"{name}_low"), row.get(f"{name}_high")
    if not isinstance(value, float):
        return escape("" if value is None else str(value))
    between = "" if low is None or high is None else f" <small>({low:.4g} to {high:.4g})</small>"
    return f"{value:.4g}{between}"
