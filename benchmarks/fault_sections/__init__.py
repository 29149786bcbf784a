"""What `benchmarks/faults.py` is made of: a module a section, each a function that counts what was survived."""

from __future__ import annotations

from dataclasses import dataclass, field


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
