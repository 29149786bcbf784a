"""How a contact is told in words for people. Nobody is blamed: the search for a way out knows how everything will move, and the
robot may not have known."""

from __future__ import annotations

from clearway.indicators.avoidable import FORESIGHT, PLANNER, TOO_LATE
from clearway.reports.selection import Row, placed_in_contact
from clearway.trials.trial import AS_PLACED

WAYS_OUT = {
    PLANNER: "0.75 s before, a way out was left",
    FORESIGHT: "a way out was left when it was first seen, none 0.75 s before",
    TOO_LATE: "no way out was left once it could be seen",
}
"""The column `avoidable` in words."""


_OTHERS = {"person": "a person", "robot": "another robot"}
"""Who was touched, by the column `touched`, where it is no obstacle."""


def contact(row: Row) -> str:
    """A contact in words: who moved, and who the other was."""
    if placed_in_contact(row):
        return f"it was placed in {str(row['reason']).removesuffix(AS_PLACED).strip()}"
    other = "the moving obstacle" if "moving" in str(row["reason"]) else "an obstacle"
    other = _OTHERS.get(row.get("touched") or "", other)
    if str(row["failure"]) == "collision at rest":
        return f"{other} drove into it while it stood"
    return {
        "robot": "drove into something that stood",
        "obstacle": f"{other} ran into it while it no more than turned",
        "both": f"met {other} while both moved",
    }.get(row.get("moved_at_contact") or "", "touched something")


def way_out(row: Row) -> str:
    """Whether a contact left a way out, in words; empty without a contact or where nobody can tell."""
    return WAYS_OUT.get(row.get("avoidable") or "", "")
