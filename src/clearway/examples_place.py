"""Where the examples are: in an installed package beside its modules, in a checkout at its root."""

from __future__ import annotations

import shutil
from pathlib import Path

from clearway.errors import ClearwayError

_PACKAGE = Path(__file__).parent


def examples_folder() -> Path:
    """The folder that holds the examples.

    Raises:
        ClearwayError: this installation has none.
    """
    for folder in (_PACKAGE / "examples", _PACKAGE.parents[1] / "examples"):
        if (folder / "01_run_hospital.py").is_file():
            return folder
    raise ClearwayError("this installation has no examples; they are in the source distribution")


def example_files() -> list[Path]:
    """Every file of the examples, relative to their folder, sorted."""
    folder = examples_folder()
    files = (f.relative_to(folder) for f in folder.rglob("*") if f.is_file())
    return sorted(f for f in files if f.suffix != ".pyc" and not f.parts[0].startswith((".", "results")))


def copy_examples(to: Path) -> None:
    """Copy the examples into a folder, which is made if it isn't there; nothing is overwritten.

    Raises:
        ClearwayError: one of them is there already, or the folder can't be written.
    """
    folder, files = examples_folder(), example_files()
    for file in files:
        if (to / file).exists():
            raise ClearwayError("is there already; choose another folder", file=to / file)
    try:
        for file in files:
            (to / file).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(folder / file, to / file)
    except OSError as error:
        raise ClearwayError(f"cannot be written: {error.strerror or error}", file=to) from error
