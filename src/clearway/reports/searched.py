"""What a page says of trials that `clearway break` searched for: what breaks the robot, and how rare that is."""

from __future__ import annotations

from dataclasses import dataclass

from clearway.errors import ClearwayError
from clearway.reading import read_json
from clearway.reports.findings import Findings
from clearway.reports.summary import Summary

SEARCH = "search.json"
"""File in a results directory that says how its trials were found."""


@dataclass(frozen=True, slots=True)
class Searched:
    """What a search found.

    Attributes:
        said: Three sentences: what was tested, what came out, what to be careful about.
        breaks: Of each break the number of its trial and what happens.
    """

    said: Summary
    breaks: tuple[tuple[int, str], ...]


def searched(f: Findings, tested: str) -> Searched | None:
    """What the search found that the trials come from; None where they come from none.

    Args:
        f: The trials.
        tested: The sentence that says what was tested.

    Raises:
        ClearwayError: the file that says it is damaged.
    """
    file = f.results.path / SEARCH
    if not file.exists():
        return None
    told = read_json(file)
    try:
        found, rarity = str(told["found"]), told["rarity"]
        sentences = [str(one["sentence"]) for one in told["breaks"]]
        rare = f" How rare: {rarity['sentence']}." if rarity else " How rare that is was not asked (--rarity)."
    except (KeyError, TypeError) as error:
        raise ClearwayError("is not what `clearway break` writes", file=file) from error
    trials: dict[str, list[int]] = {}  # of each scenario, those that failed first
    for row in sorted(f.rows, key=lambda r: (r["success"] is not False, r["trial"])):
        trials.setdefault(row["scenario"], []).append(int(row["trial"]))
    order = list(dict.fromkeys(row["scenario"] for row in f.rows))
    breaks = tuple((trials[name][0], sentence) for name, sentence in zip(order, sentences, strict=False))
    limits = (
        "These tests were searched for because the robot fails there: their number says nothing of how often it fails. The"
        " robot is simulated, so this says what it would do as far as its models hold."
    )
    return Searched(Summary(tested, f"{found[:1].upper()}{found[1:]}.{rare}", limits), breaks)
