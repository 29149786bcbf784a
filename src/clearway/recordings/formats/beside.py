"""What a file can't say itself stands in a small TOML beside it, `trial7.c3d.toml` beside `trial7.c3d`."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from clearway.reading import read_toml
from clearway.validation import first_problem

M = TypeVar("M", bound=BaseModel)


def beside(path: Path) -> Path:
    """Where the description of `path` stands: its whole name and `.toml`."""
    return path.parent / (path.name + ".toml")


def load(description: Path, model: type[M]) -> M:
    """The description in the TOML file `description`.

    Raises:
        ClearwayError: it can't be read, is no TOML, or says something wrong; names the field.
    """
    values = read_toml(description)
    try:
        return model.model_validate(values)
    except ValidationError as error:
        raise first_problem(error, model, file=description) from error


def hints(path: Path, model: type[M]) -> M:
    """What stands beside `path`; the model's defaults if nothing does.

    Raises:
        ClearwayError: as for `load`.
    """
    description = beside(path)
    return load(description, model) if description.is_file() else model()
