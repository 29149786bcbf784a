"""A map, coloured by the probability with which a robot comes where: its narrowest passages, and what they cost by a measured curve."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.grid import FREE, OCCUPIED, OccupancyGrid
from clearway.geometry.passages import roomiest, widest_ways
from clearway.geometry.shapes import FloatArray
from clearway.reports import theme
from clearway.reports.grid import num
from clearway.reports.requirement import Requirement

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLOURS = "RdYlBu"
"""Matplotlib's scale from never (red) to always (blue), which colour-blind people can read."""


@dataclass(frozen=True, slots=True, eq=False)
class Passable:
    """A map, and with which probability a robot comes where.

    Attributes:
        found: The requirement whose curve it follows.
        grid: The map.
        start: Where the robot comes from (x, y), m.
        width: (rows, cols) the widest of the widths that were tried that the narrowest passage has, m, on the widest way to each cell;
            0: it is narrower than all of them; NaN: not free.
        probability: (rows, cols) of passing it, by the isotonic curve at that width, in [0, 1]; 0 where it is narrower than all that
            was tried, NaN: not free.
    """

    found: Requirement
    grid: OccupancyGrid
    start: tuple[float, float]
    width: FloatArray
    probability: FloatArray

    def share(self, least: float) -> float:
        """The share of the free floor to which the narrowest passage is passed with at least this probability."""
        free = np.isfinite(self.probability)
        return float((self.probability[free] >= least - 1e-9).mean())

    @property
    def shown(self) -> float | None:
        """The share of the free floor behind passages that are shown to be wide enough; None: no width is shown to be."""
        if self.found.passes is None:
            return None
        free = np.isfinite(self.width)
        return float((self.width[free] >= self.found.passes - 1e-9).mean())

    @property
    def reached(self) -> str:
        """How much of the floor it reaches, as the end of a sentence."""
        asked, behind = (
            self.found.reliability,
            "" if self.shown is None else f" ({100 * self.shown:.0f} % where that is shown)",
        )
        return (
            f"from ({num(self.start[0])}, {num(self.start[1])}) the narrowest passage on the way to {100 * self.share(asked):.0f} % of the "
            f"free floor is passed with {100 * asked:g} % or more{behind}, that to {100 * (1 - self.share(0.5)):.0f} % with less than 50 %"
        )

    def __str__(self) -> str:
        return f"{self.found.robot} with {self.found.navigator} at {self.found.speed:g} m/s: {self.reached}."

    def figure(self) -> Figure:
        """The map in its frame, m: each free cell in the colour of its probability."""
        from matplotlib.colors import ListedColormap
        from matplotlib.lines import Line2D

        rows, columns = self.grid.data.shape
        (left, low), edge = self.grid.origin, self.grid.resolution
        extent = (left, left + columns * edge, low, low + rows * edge)
        with theme.style():
            tall = min(max(6.2 * rows / columns, 2.0), 7.5)
            figure = theme.new_figure(7.2, tall + 1.0)
            axes = figure.add_subplot()
            walls = np.where(self.grid.data == OCCUPIED, 1.0, np.where(self.grid.data == FREE, np.nan, 0.0))
            both = ListedColormap([theme.FURNITURE, theme.INK])
            axes.imshow(walls, both, vmin=0.0, vmax=1.0, origin="lower", extent=extent, interpolation="nearest")
            drawn = axes.imshow(
                self.probability, _COLOURS, vmin=0.0, vmax=1.0, origin="lower", extent=extent, interpolation="nearest"
            )
            axes.plot(*self.start, "o", ms=7, mfc=theme.PAPER, mec=theme.INK, mew=1.5)
            marks = [
                Line2D([], [], marker="o", ls="", mfc=theme.PAPER, mec=theme.INK, mew=1.5, label="comes from here")
            ]
            wide = np.nan_to_num(self.width) >= (self.found.passes or np.inf) - 1e-9
            if wide.any() and not wide.all():
                x = left + (np.arange(columns) + 0.5) * edge
                y = low + (np.arange(rows) + 0.5) * edge
                axes.contour(x, y, wide.astype(float), [0.5], colors=theme.INK, linewidths=0.9)
                label = f"within: {100 * self.found.reliability:g} % is shown"
                marks.append(Line2D([], [], color=theme.INK, lw=0.9, label=label))
            axes.set(xlabel="x, m", ylabel="y, m", aspect="equal")
            axes.set_title(f"{self.found.robot}, {self.found.navigator}, {self.found.speed:g} m/s")
            figure.colorbar(drawn, ax=axes, label="probability of passing the narrowest passage", shrink=0.8)
            figure.legend(handles=marks, loc="outside lower left", ncols=2)
            return figure


def passable(found: Requirement, grid: OccupancyGrid, start: tuple[float, float] | None = None) -> Passable:
    """Colour a map by what a search for a width found.

    Args:
        found: Of a door, a corridor or another width, in m.
        grid: The map.
        start: Where the robot comes from (x, y), m; None: the roomiest place.

    Raises:
        ClearwayError: what was searched for is no width, or the start is not free.
    """
    if not (found.unit.strip() == "m" and found.eases):
        raise ClearwayError(
            f"a map has widths, and {found.quantity} is none; ask for a door or a corridor", field="offer"
        )
    start = roomiest(grid) if start is None else start
    width = widest_ways(grid, start, found.values)
    probability = np.zeros(width.shape)  # between two widths that of the narrower, as the sentence has it
    for value, share in zip(found.values, found.curve, strict=True):
        probability[width == value] = share
    return Passable(found, grid, start, width, np.where(np.isnan(width), np.nan, probability))
