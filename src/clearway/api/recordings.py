"""Real robots' trials, scored at once or as they are recorded."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from clearway.api.arguments import free_directory
from clearway.api.results import Results
from clearway.campaigns.progress import ProgressCallback

if TYPE_CHECKING:
    from clearway.campaigns.watching import Round


def score(
    test_plan: str | Path,
    *,
    out: str | Path | None = None,
    workers: int | None = None,
    resume: bool = False,
    progress: ProgressCallback | None = None,
) -> Results:
    """Import and score the recordings of a real robot by a test plan (TOML).

    Args:
        test_plan: Its file; `clearway protocol` writes a skeleton of one.
        out: The results directory; None: `results/NAME-OF-THE-PLAN`, numbered if that is taken.
        workers: How many processes; None: one a core.
        resume: Whether to go on with a scoring in `out` that was interrupted, or whose plan has grown since: trials are scored
            that are new, or of which the plan or a file now says something else.
        progress: Called with (done, total, note).

    Raises:
        ClearwayError: something in the test plan or in a file is wrong; one sentence says what and what would be right.
    """
    from clearway.campaigns.scoring import score_plan

    folder = free_directory([str(test_plan)]) if out is None else Path(out)
    done = score_plan(Path(test_plan), folder, workers=workers, resume=resume, progress=progress)
    return Results(done.path, done.campaign)


def watch(
    test_plan: str | Path,
    captures: str | Path,
    *,
    out: str | Path | None = None,
    workers: int | None = None,
    progress: ProgressCallback | None = None,
) -> Iterator[Round]:
    """Score recordings as they come in, until every trial of the plan was driven and can be used.

    Args:
        test_plan: Its file.
        captures: The folder into which recordings come; which of them is which trial's, the plan's `files` say.
        out: The results directory, gone on with if it holds results of this plan; None: `results/NAME-OF-THE-PLAN`.
        workers: How many processes; None: one a core.
        progress: Called with (done, total, note).

    Yields:
        Where the day stands: the results so far, the next trial, what has to be repeated.

    Raises:
        ClearwayError: there is no such folder.
    """
    from clearway.campaigns.watching import watch

    folder = Path("results") / Path(test_plan).stem if out is None else Path(out)
    yield from watch(Path(test_plan), Path(captures), folder, workers=workers, progress=progress)
