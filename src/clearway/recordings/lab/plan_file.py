"""Reads a test plan's file, with what lies beside it: which files its trials have, and what the operators ticked."""

from __future__ import annotations

import os
from collections.abc import Collection
from pathlib import Path

from pydantic import ValidationError

from clearway.errors import ClearwayError
from clearway.reading import read_toml
from clearway.recordings.lab.captures import with_files
from clearway.recordings.lab.test_plan import TestPlan, by_number, problems_in
from clearway.recordings.lab.ticks import with_ticks
from clearway.recordings.lab.wildcards import with_everyone


class WrongPlan(ClearwayError):
    """A test plan that can't be read as one.

    Attributes:
        found: Everything that is wrong with it.
    """

    def __init__(self, found: list[ClearwayError]) -> None:
        super().__init__(found[0].problem, file=found[0].file, field=found[0].field)
        self.found = found


def load_test_plan(path: str | Path, unready: Collection[Path] = ()) -> TestPlan:
    """Read a test plan.

    Args:
        path: Its file.
        unready: Recordings that are still being written, and count as not there; the operators' table, where it may come later.

    Raises:
        WrongPlan: no such file, no TOML, or a field that is wrong; the message names file, field and value.
    """
    file = Path(path)
    try:
        plan = with_ticks(with_everyone(TestPlan.model_validate(read_toml(file))), file.parent)
        plan = with_files(plan, file.parent, unready)
        _ticks_there(plan, file.parent, unready)
    except ValidationError as error:
        raise WrongPlan(problems_in(error, file)) from error
    except ClearwayError as error:
        raise WrongPlan([by_number(error, file)]) from error
    return plan


def _ticks_there(plan: TestPlan, folder: Path, unready: Collection[Path]) -> None:
    """Nothing, if the operators' table is there or may come later, or nothing was recorded yet."""
    table = None if plan.test.ticks is None else folder / plan.test.ticks
    lacking = table is not None and not table.exists() and Path(os.path.abspath(table)) not in unready
    if lacking and any(plan.files_of(t) for t in plan.trials):
        said = "save it from the page to tick on, or take the line out if what the operators saw stands in the trials"
        raise ClearwayError(f"no such file: {plan.test.ticks!r}; {said}", field="test.ticks")
