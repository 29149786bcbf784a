"""What a robot has to fulfil to be accepted, as a TOML file says it: criteria, each about a share of trials.

A criterion holds an indicator, or any other column of the trials, against a limit; so each trial conforms or doesn't. It then asks
either for a share of conforming trials at a confidence, or for so many trials of which so many may fail.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache, partial
from pathlib import Path
from typing import Annotated, Any, Literal

import pyarrow as pa
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from clearway.contract import BodyKind
from clearway.errors import ClearwayError, shown, unknown
from clearway.indicators import INDICATORS, row_schema
from clearway.indicators.avoidable import CLASSES
from clearway.indicators.cause import CAUSES
from clearway.quantities import Finite, Whole
from clearway.reading import read_toml
from clearway.statistics.betting import MOST, rule
from clearway.statistics.proportions import checked_probability
from clearway.statistics.samples import reliability_shown
from clearway.trials.store import results_schema
from clearway.trials.trial import Outcome
from clearway.tuning import Tuned
from clearway.validation import problems

MANY = 100
"""Criteria in a file."""

_CONTACT_FREE = tuple(o.value for o in Outcome if o not in (Outcome.REACHED, Outcome.COLLISION))
_FAILURES = (*_CONTACT_FREE, "unfinished", "DE", "OE", "DE+OE")
WORDS: dict[str, tuple[str, ...]] = {
    "outcome": tuple(Outcome),
    "failure": ("", "collision", "collision at rest", *_FAILURES),
    "cause": ("", *CAUSES, *_FAILURES),
    "moved_at_contact": ("", "robot", "obstacle", "both", "neither"),
    "touched": ("", *BodyKind),
    "avoidable": ("", *CLASSES),
    "tuned": tuple(Tuned),
    "source": ("simulated", "recorded"),
}  # fmt: skip
"""All words of the columns that have no others: one that is misspelt would fit no trial, and `none_of` would let every trial pass."""

BEFOREHAND = (
    "trial", "id", "scenario", "suite", "family", "batch", "configuration", "robot", "navigator", "setup", "localisation", "tracking",
    "privileged", "tuned", "floor_plan", "speed", "obstacle_speed", "size", "gap", "repetition", "seed", "run", "member", "people",
    "other_robots", "source",
)  # fmt: skip
"""Columns that are known before a trial is driven; by others it could be chosen for how it went."""

Label = str | bool | Finite
"""A value of a column by which trials are chosen."""


def _sure(value: float) -> float:
    if not 0.5 <= value < 1:
        hint = f" (did you mean {value / 100:g}?)" if 50 <= value < 100 else ""
        raise ValueError(f"{value:g} is no confidence; at least 0.5 and less than 1{hint}")
    return value


Confidence = Annotated[Finite, AfterValidator(_sure)]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)


class Criterion(_Part):
    """One thing that is asked of a robot's trials."""

    name: str = Field(default="", max_length=200, description="for the verdict; default: what it asks, in words")
    indicator: str = Field(description="an indicator, or any other column of trials.parquet")
    at_least: Finite | None = Field(default=None, description="a trial conforms from here on, in the indicator's unit")
    at_most: Finite | None = Field(default=None, description="a trial conforms up to here, in the indicator's unit")
    value: bool | None = Field(default=None, alias="is", description="of a yes or no: which conforms; default: true")
    one_of: tuple[str, ...] = Field(default=(), description="of a word: those that conform")
    none_of: tuple[str, ...] = Field(default=(), description="of a word: those that do not; any other does, none too")
    share: Finite | None = Field(default=None, description="of the trials that must conform, in (0, 1)")
    confidence: Confidence | None = Field(
        default=None, description="of either verdict on the share, in [0.5, 1); default: the file's"
    )
    trials: Whole | None = Field(
        default=None, ge=1, le=MOST, description="instead of a share: the first so many trials count"
    )
    failures: Whole = Field(default=0, ge=0, description="with `trials`: so many of them need not conform")
    where: dict[str, Label | tuple[Label, ...]] = Field(
        default_factory=dict, description="only trials with this value, or one of these, in a column"
    )
    each: str | None = Field(
        default=None, description="a column: each of its values that `where` names has to meet the criterion by itself"
    )
    missing: Literal["fails", "unknown"] = Field(
        default="fails",
        description="a trial of which the indicator cannot be computed: fails, or counts against either verdict",
    )
    expected: Finite | None = Field(
        default=None, description="for the plan: the share that conforms in truth; default: half way from `share` to 1"
    )


class Criteria(_Part):
    """All that is asked of a robot."""

    title: str = Field(default="", max_length=200, description="what is to be accepted")
    confidence: Confidence = Field(default=0.95, description="of the verdicts, in [0.5, 1)")
    most: Whole | None = Field(
        default=None,
        ge=1,
        le=MOST,
        description="trials of a criterion: what is not shown within so many is rejected; default: no bound",
    )
    where: dict[str, Label | tuple[Label, ...]] = Field(
        default_factory=dict, description="only these trials, for all criteria: `navigator`, `robot` and the like"
    )
    criterion: tuple[Criterion, ...] = Field(min_length=1, max_length=MANY)

    @property
    def rejecting(self) -> int:
        """Among how many criteria the risk of a wrong rejection is divided."""
        return max(1, sum(len(groups(one)) for one in self.criterion if one.share is not None))


def load_criteria(file: str | Path) -> Criteria:
    """Read a file of criteria.

    Raises:
        ClearwayError: it can't be read, or a criterion is wrong, says nothing, or can't be met by any number of trials.
    """
    if found := criteria_problems(file):
        raise found[0]
    return Criteria.model_validate(read_toml(Path(file)))


def criteria_problems(file: str | Path) -> list[ClearwayError]:
    """What is wrong with a file of criteria."""
    path = Path(file)
    try:
        criteria = Criteria.model_validate(read_toml(path))
    except ValidationError as error:
        return problems(error, Criteria, file=path)
    except ClearwayError as error:
        return [error]
    found = _refused(_checks(criteria)) or _refused(_checks_together(criteria))
    return [ClearwayError(error.problem, file=path, field=error.field) for error in found]


def groups(criterion: Criterion) -> list[dict[str, Any]]:
    """The groups of trials each of which has to meet the criterion, by column and value."""
    if criterion.each is None:
        return [dict(criterion.where)]
    values = criterion.where[criterion.each]
    return [{**criterion.where, criterion.each: v} for v in (values if isinstance(values, tuple) else (values,))]


def in_words(where: Mapping[str, Any]) -> str:
    """A group of trials: `batch MO, speed 0.6`."""
    return ", ".join(f"{name} {word(value)}" for name, value in where.items())


def word(value: Any) -> str:
    """A value of a column, or several of them."""
    if isinstance(value, tuple | list):
        return " or ".join(map(word, value))
    return f"{value:g}" if isinstance(value, float) else "none" if value is None else str(value)


def is_criteria(table: Mapping[str, Any]) -> bool:
    """Whether a TOML table is one of criteria."""
    return isinstance(table.get("criterion"), list)


@cache
def columns() -> pa.Schema:
    """The columns that a criterion may be about."""
    return results_schema(row_schema())


def unit(column: str) -> str:
    """The unit of a column."""
    return str((columns().field(column).metadata or {}).get(b"unit", b"").decode())


def confidence_of(criterion: Criterion, criteria: Criteria) -> float:
    """The confidence of a criterion's verdict."""
    return criteria.confidence if criterion.confidence is None else criterion.confidence


def errors_of(criterion: Criterion, criteria: Criteria) -> tuple[float, float]:
    """The greatest probabilities of accepting and of rejecting wrongly. All criteria have to be met, so that accepting needs no
    correction; any one that is not met rejects, so that risk is divided among them."""
    error = 1 - confidence_of(criterion, criteria)
    return error, error / criteria.rejecting


def asks(criterion: Criterion) -> str:
    """What conforms, in words: `MDO >= 0.1 m`."""
    name, of = criterion.indicator, unit(criterion.indicator)
    of = f" {of}" if of else ""
    if criterion.one_of or criterion.none_of:
        words = ", ".join(criterion.one_of or criterion.none_of)
        return f"{name} {'is' if criterion.one_of else 'is not'} {words.replace(', ', ' or ')}"
    if criterion.at_least is None and criterion.at_most is None:
        return name if criterion.value in (None, True) else f"not {name}"
    if criterion.at_least is not None and criterion.at_most is not None:
        return f"{name} from {criterion.at_least:g} to {criterion.at_most:g}{of}"
    return (
        f"{name} <= {criterion.at_most:g}{of}"
        if criterion.at_least is None
        else f"{name} >= {criterion.at_least:g}{of}"
    )


def demand(criterion: Criterion, criteria: Criteria) -> str:
    """How often, in words: `in 99 % of trials at 95 % confidence`."""
    if criterion.share is not None:
        return f"in {100 * criterion.share:g} % of trials at {100 * confidence_of(criterion, criteria):g} % confidence"
    but = "each" if not criterion.failures else f"all but {criterion.failures}"
    return f"in {but} of the first {criterion.trials} trials"


def _refused(checks: Iterable[Callable[[], None]]) -> list[ClearwayError]:
    """What they raise."""
    found = []
    for check in checks:
        try:
            check()
        except ClearwayError as error:
            found.append(error)
    return found


def _checks(criteria: Criteria) -> Iterator[Callable[[], None]]:
    """Of what is wrong whatever else is asked."""
    yield partial(_columns_there, criteria.where, "where")
    seen: dict[str, int] = {}
    for number, one in enumerate(criteria.criterion):
        at = f"criterion.{number}"
        yield partial(_limit, one, at)
        yield partial(_columns_there, one.where, f"{at}.where")
        yield partial(_each, one, at)
        yield partial(_often, one, criteria, at)
        yield partial(_once, one, number, seen)


def _checks_together(criteria: Criteria) -> Iterator[Callable[[], None]]:
    """Of what all criteria, each right by itself, ask together."""
    for number, one in enumerate(criteria.criterion):
        yield partial(_can_be_shown, one, criteria, f"criterion.{number}.share")


def _each(one: Criterion, at: str) -> None:
    """Refuse groups of which nobody says which there are."""
    if one.each is not None and one.each not in columns().names:
        raise unknown("column", one.each, columns().names, field=f"{at}.each")
    if one.each is not None and one.each not in one.where:
        raise ClearwayError(
            f"say each of which: where = {{ {one.each} = [...] }}, so that none is forgotten", field=f"{at}.each"
        )


def _once(one: Criterion, number: int, seen: dict[str, int]) -> None:
    """Refuse what another criterion asks."""
    said = one.model_copy(update={"name": ""}).model_dump_json()
    if (first := seen.setdefault(said, number)) != number:
        raise ClearwayError(f"asks the same as criterion.{first}; leave one out", field=f"criterion.{number}")


def _columns_there(where: Mapping[str, Any], at: str) -> None:
    for name, value in where.items():
        if name not in columns().names:
            raise unknown("column", name, columns().names, field=f"{at}.{name}")
        if name not in BEFOREHAND:
            raise ClearwayError(
                f"{name} is known only after a trial, and would choose trials by how they went; {', '.join(BEFOREHAND)} are known before",
                field=f"{at}.{name}",
            )
        if value == ():
            raise ClearwayError("names no value; say one, or leave it out", field=f"{at}.{name}")
        word = pa.types.is_string(columns().field(name).type)
        for v in value if isinstance(value, tuple) else (value,):
            if isinstance(v, str) != word:
                kind = "text" if word else "a number, true or false"
                raise ClearwayError(f"{shown(v)} is wrong: the column holds {kind}", field=f"{at}.{name}")
            if word:
                _known(name, v, f"{at}.{name}")


def _known(column: str, value: str, at: str) -> None:
    """Refuse a word that the column can't have."""
    if column in WORDS and value not in WORDS[column]:
        raise unknown(column, value, filter(None, WORDS[column]), field=at)


def _limit(one: Criterion, at: str) -> None:
    """Refuse a limit that is none, upside down, or that every trial keeps or none can."""
    name = one.indicator
    if name not in columns().names:
        raise unknown("indicator", name, columns().names, field=f"{at}.indicator")
    kind = columns().field(name).type
    limits = {"at_least": one.at_least is not None, "at_most": one.at_most is not None, "is": one.value is not None}
    given = [n for n, there in (limits | {"one_of": bool(one.one_of), "none_of": bool(one.none_of)}).items() if there]
    word, yes = pa.types.is_string(kind), pa.types.is_boolean(kind)
    allowed = ("one_of", "none_of") if word else ("is",) if yes else ("at_least", "at_most")
    for field in given:
        if field not in allowed:
            what = "a word" if word else "a yes or no" if yes else "a number"
            raise ClearwayError(f"{name} is {what}; {' or '.join(allowed)} says what conforms", field=f"{at}.{field}")
    if (word and len(given) != 1) or not (word or yes or given):
        raise ClearwayError(f"{name} needs a limit: {' or '.join(allowed)}", field=at)
    for v in (*one.one_of, *one.none_of):
        _known(name, v, f"{at}.{given[0]}")
    low = -math.inf if one.at_least is None else one.at_least
    high = math.inf if one.at_most is None else one.at_most
    if low > high:
        raise ClearwayError(
            f"the limit is upside down: at_least {low:g} is more than at_most {high:g}, and no trial can be both",
            field=f"{at}.at_least",
        )
    indicator = INDICATORS.get(name)
    if indicator is None or yes or word:
        return
    of = f" {indicator.unit}" if indicator.unit else ""
    least, greatest = indicator.bounds
    if len(given) == 1:
        [field], [other] = given, set(allowed) - set(given)
        if indicator.upside_down(field == "at_least"):
            raise ClearwayError(
                f"the limit is upside down: {name} is the better the {indicator.better}; write {other} = {getattr(one, field):g}",
                field=f"{at}.{field}",
            )
    if high < least or low > greatest:
        field = "at_most" if high < least else "at_least"
        ends = f"never less than {least:g}{of}" if high < least else f"never more than {greatest:g}{of}"
        raise ClearwayError(f"no trial can meet it: {name} is {ends}", field=f"{at}.{field}")
    if low <= least and high >= greatest:
        raise ClearwayError(f"every trial meets it: {name} lies from {least:g} to {greatest:g}{of}", field=at)


def _often(one: Criterion, criteria: Criteria, at: str) -> None:
    """Refuse a share or a number of trials that can't be shown."""
    if (one.share is None) == (one.trials is None):
        raise ClearwayError(
            "say how often: share (with a confidence) or trials (with failures)"
            + (", not both" if one.share is not None else ""),
            field=at,
        )
    if one.expected is not None and one.expected != 1:
        try:
            checked_probability("expected", one.expected)
        except ClearwayError as error:
            raise ClearwayError(error.problem, field=at) from None
    if one.trials is not None:
        if one.failures >= one.trials:
            raise ClearwayError(
                f"{one.failures} of {one.trials} trials may fail; every robot meets it", field=f"{at}.failures"
            )
        if one.confidence is not None:
            sure = reliability_shown(one.trials, one.failures, one.confidence)
            raise ClearwayError(
                f"belongs to a share; {one.trials} trials with {one.failures} failures show a share of {sure:.4g} at "
                f"{one.confidence:g}: write share = {math.floor(1000 * sure) / 1000:g} instead of trials, or leave confidence out",
                field=f"{at}.confidence",
            )
        if criteria.most is not None and one.trials > criteria.most:
            raise ClearwayError(
                f"{one.trials} trials are asked for and most = {criteria.most} allows fewer", field=f"{at}.trials"
            )
        return
    assert one.share is not None
    if one.failures:
        raise ClearwayError("belongs to `trials`, not to a share", field=f"{at}.failures")
    confidence = confidence_of(one, criteria)
    if one.share == 1:
        raise ClearwayError(
            "no number of trials shows a share of 1; 300 trials without a failure show "
            f"{reliability_shown(300, 0, confidence):.4g} at {confidence:g}: write share = 0.99, or trials = 300 with failures = 0",
            field=f"{at}.share",
        )
    try:
        checked_probability("share", one.share)
    except ClearwayError as error:
        raise ClearwayError(error.problem, field=at) from None
    if one.expected is not None and one.expected <= one.share:
        raise ClearwayError(
            f"a robot with a share of {one.expected:g} is not to be accepted; more than {one.share:g} can be expected",
            field=f"{at}.expected",
        )


def _can_be_shown(one: Criterion, criteria: Criteria, field: str) -> None:
    """Refuse a share that takes more trials than there may be."""
    if one.share is None:
        return
    least = rule(one.share, *errors_of(one, criteria), failures=1).least
    if least > (criteria.most or MOST):
        allowed = f"most = {criteria.most}" if criteria.most else f"{MOST:,}"
        raise ClearwayError(
            f"no robot can meet it within {allowed} trials: {one.share:g} at {confidence_of(one, criteria):g} needs "
            + (f"{least} even without a failure" if least <= MOST else "more even without a failure"),
            field=field,
        )
