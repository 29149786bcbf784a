"""What a file can't say itself stands in a small TOML beside it, `trial7.c3d.toml` beside `trial7.c3d`."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from clearway.errors import ClearwayError
from clearway.validation import first_problem

M = TypeVar("M", bound=BaseModel)

LARGEST = 1 << 20
"""Bytes of a description that are read; a longer one is none."""


def beside(path: Path) -> Path:
    """Where the description of `path` stands: its whole name and `.toml`."""
    return path.parent / (path.name + ".toml")


def load(description: Path, model: type[M]) -> M:
    """The description in the TOML file `description`.

    Raises:
        ClearwayError: it can't be read, is no TOML, or says something wrong; names the field.
    """
    try:
        with open(description, "rb") as f:
            text = f.read(LARGEST + 1)
        if len(text) > LARGEST:
            raise ClearwayError("is too large for a description of a few lines", file=description)
        values = tomllib.loads(text.decode("utf-8-sig"))
    except FileNotFoundError as error:
        raise ClearwayError("no such file", file=description) from error
    except OSError as error:
        raise ClearwayError(f"cannot be read: {error.strerror}", file=description) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ClearwayError(f"not a TOML file: {error}", file=description) from error
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
