"""Tables, figures, the page, the replay: everything drawn from a results directory alone."""

from __future__ import annotations

from clearway.reports.figures import FIGURES, figure
from clearway.reports.page import write_replay, write_report
from clearway.reports.pdf import printing_browser, write_pdf

__all__ = ["FIGURES", "figure", "printing_browser", "write_pdf", "write_replay", "write_report"]
