"""Tables, figures, the page, the replay: everything drawn from a results directory alone."""

from __future__ import annotations

from clearway.reports.figures import FIGURES, figure
from clearway.reports.page import write_replay, write_report

__all__ = ["FIGURES", "figure", "write_replay", "write_report"]
