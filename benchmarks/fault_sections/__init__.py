"""What `benchmarks/faults.py` is made of: a module a section, each a function that counts what was survived."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from itertools import cycle


@dataclass(slots=True)
class Count:
    """What became of one kind of fault.

    Attributes:
        fault: What was done.
        tried: How often.
        survived: How often it ended as it should.
        fallen: What happened otherwise, a line each.
    """

    fault: str
    tried: int = 0
    survived: int = 0
    fallen: list[str] = field(default_factory=list)

    def add(self, name: str, wrong: str | None) -> None:
        """Count one: `wrong` says what happened instead of what should, None if it is well."""
        self.tried += 1
        self.survived += wrong is None
        if wrong is not None:
            self.fallen.append(f"{self.fault}: {name}: {wrong}")


def in_turn(kinds: Collection[str], try_one: Callable[[str, int], str | None], tries: int, seed: int) -> list[Count]:
    """Try `tries` mutated files: the kinds in turn, each by a seed of its own; `try_one` says what was wrong."""
    counts = {kind: Count(f"{kind}, mutated") for kind in kinds}
    for n, kind in zip(range(tries), cycle(kinds), strict=False):
        number = seed + n // len(kinds)
        counts[kind].add(f"seed {number}", try_one(kind, number))
    return list(counts.values())
