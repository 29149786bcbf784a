"""What several calls take: navigators by name, address or class; a fresh directory."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from pathlib import Path

from clearway.campaigns.shards import Shard
from clearway.contract import Navigator
from clearway.errors import ClearwayError
from clearway.given import PREFIX

NavigatorLike = str | Callable[..., Navigator]
"""A navigator's name or address, or its class, or a function that makes one."""


def free_directory(suites: Iterable[str], shard: Shard | None = None) -> Path:
    """Where results go when nobody says: `results/SUITE`, or `results/SUITE-2` and so on if that is taken; of a shard
    `results/SUITE-3-of-40`."""
    name = "-".join(Path(s.removeprefix(PREFIX)).stem for s in suites)
    if shard is not None:
        name += f"-{shard.number}-of-{shard.of}"
    number, path = 1, Path("results") / name
    while os.path.exists(path):
        number += 1
        path = Path("results") / f"{name}-{number}"
    return path


def strings(values: Iterable[str], field: str) -> tuple[str, ...]:
    """Names as they were given, one or several; anything else is told by its `field`."""
    if isinstance(values, str):  # a lone name is meant as a list of one, not of its letters
        return (values,)
    found = tuple(values)
    for value in found:
        if not isinstance(value, str):
            raise ClearwayError(f"{value!r} is not a name", field=field)
    return found
