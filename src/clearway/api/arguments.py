"""What several calls take: navigators by name, address or class; a fresh directory."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from clearway.campaigns.objects import navigator_name
from clearway.campaigns.shards import Shard
from clearway.contract import Navigator
from clearway.errors import ClearwayError, shown
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


def options_of(given: Any) -> dict[str, Mapping[str, Any]]:
    """What navigators' constructors are given, by the navigators' names, or by what was given as a navigator.

    Raises:
        ClearwayError: it is something else.
    """
    known = given or {}
    if not isinstance(known, Mapping) or not all(
        isinstance(own, Mapping) and all(isinstance(key, str) for key in own) for name, own in known.items()
    ):
        raise ClearwayError(
            f"{shown(given)} says none by a navigator's name; {{'orca': {{'horizon': 5.0}}}} does", field="options"
        )
    return {navigator_name(name): own for name, own in known.items()}
