"""How every figure looks: colours that survive colour blindness and print, and SVG text that is the same each time.

The page shows the same SVGs inline with its own colours: each ink below has a CSS variable (`themed`), so a figure
follows the reader's light or dark scheme, while the file on disk stays as it is.
"""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from clearway.geometry.shapes import Circle, FloatArray, Shape

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, MUTED, RULE, PAPER = "#1c2733", "#5c6976", "#d3dae1", "#fefefe"
FIXTURE, FURNITURE, OBSTACLE = "#8d99a5", "#dfe4e9", "#6b4e3d"
ROBOT, MOVING, MARK, BAD = "#1f6098", "#c8590b", "#0d7a72", "#b3261e"
SMALLEST = 7.7
"""Points, of the smallest letters of a figure."""
_LEGIBLE = 11
"""Pixels that these have at least on a page, however narrow: a wider figure scrolls."""
SPEEDS = ("#a9cbe4", "#4c91c4", "#134f7c", "#0a2f4c")
"""Sequential, light to dark: slow to fast."""

_VARIABLES = {
    INK: "--ink",
    MUTED: "--muted",
    RULE: "--rule",
    PAPER: "--paper",
    FIXTURE: "--fixture",
    FURNITURE: "--furniture",
    OBSTACLE: "--obstacle",
    ROBOT: "--robot",
    MOVING: "--moving",
    MARK: "--mark",
    BAD: "--bad",
    SPEEDS[0]: "--speed-0",
    SPEEDS[1]: "--speed-1",
    SPEEDS[2]: "--speed-2",
}
_SYSTEM_FONTS = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Noto Sans', 'DejaVu Sans', sans-serif"

_STYLE: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 8.0,
    "axes.titlesize": 9.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titlecolor": INK,
    "axes.edgecolor": RULE,
    "axes.labelcolor": MUTED,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.8,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "text.color": INK,
    "grid.color": RULE,
    "grid.linewidth": 0.6,
    "figure.facecolor": PAPER,
    "axes.facecolor": PAPER,
    "savefig.facecolor": PAPER,
    "legend.frameon": False,
    "svg.fonttype": "none",
    "text.parse_math": False,  # a name with dollar signs is a name
    "hatch.linewidth": 0.6,
}


@contextmanager
def style() -> Iterator[None]:
    """Draw in Clearway's style inside this context; the caller's own matplotlib settings stay as they are."""
    import matplotlib

    with matplotlib.rc_context(_STYLE):
        yield


def new_figure(width: float, height: float) -> Figure:
    """An empty figure, sizes in inches, that no window or global state knows of."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


_NOT_XML = re.compile("[^\t\n\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that no XML may hold; a name may."""


def to_svg(figure: Figure, name: str) -> str:
    """The figure as SVG text: the same text for the same figure (ids salted with `name`, no date)."""
    import matplotlib

    out = io.StringIO()
    with matplotlib.rc_context(_STYLE | {"svg.hashsalt": f"clearway {name}"}), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph")  # text stays text: whoever shows it has fonts of its own
        figure.savefig(out, format="svg", metadata={"Date": None, "Creator": "Clearway", "Title": name})
    text = _NOT_XML.sub("\ufffd", out.getvalue())
    text = re.sub(r"'DejaVu Sans'(, [^;\"]*)?", _SYSTEM_FONTS, text)
    text = re.sub(r' d="[^"]*"', lambda path: re.sub(r"(\.\d\d)\d+", r"\1", path[0]), text)  # 0.01 pt is fine enough
    return "\n".join(line.rstrip() for line in text.splitlines()) + "\n"


def themed(svg: str, title: str) -> str:
    """The SVG for use inside the page: no prologue, scalable, coloured by the page's CSS variables, named for readers.

    Args:
        svg: Text made by `to_svg`.
        title: What a screen reader says; must come escaped.
    """
    body = svg[svg.index("<svg") :]
    body = re.sub(r"<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    body = re.sub(r"<title>.*?</title>", "", body, flags=re.DOTALL)
    body = re.sub(r' width="[^"]*pt"', "", re.sub(r' height="[^"]*pt"', "", body, count=1), count=1)
    box = re.search(r'viewBox="0 0 ([\d.]+)', body)
    width = f' style="--legible: {float(box[1]) * _LEGIBLE / SMALLEST:.0f}px"' if box else ""
    body = body.replace("<svg ", f'<svg role="img" aria-label="{title}"{width} ', 1)
    used = set(re.findall(r"#([\w.-]+)", body))
    body = re.sub(
        r' id="([^"]*)"', lambda found: found[0] if found[1] in used else "", body
    )  # an id is unique in a page
    for colour, variable in _VARIABLES.items():
        body = re.sub(rf"((?:fill|stroke|stop-color): ){colour}", rf"\1var({variable})", body)
        body = body.replace(f'fill="{colour}"', f'style="fill: var({variable})"')
    return body


def outline(shape: Shape, pose: FloatArray) -> FloatArray:
    """The shape's outline at `pose` as points (n, 2), closed; a disc becomes a polygon for drawing (a small one, of 16)."""
    import numpy as np

    if isinstance(shape, Circle):
        a = np.linspace(0.0, 2 * np.pi, 49 if shape.radius > 0.12 else 17)
        points = shape.radius * np.c_[np.cos(a), np.sin(a)]
    else:
        v = shape.array
        points = np.vstack([v, v[:1]])
    c, s = np.cos(pose[2]), np.sin(pose[2])
    placed: FloatArray = points @ np.array([[c, s], [-s, c]]) + pose[:2]
    return placed


def panel_grid(axes: Axes) -> None:
    """A quiet horizontal grid behind the data."""
    axes.set_axisbelow(True)
    axes.grid(axis="y")
    axes.tick_params(length=0)
