"""Navigators beside which variants are run: without one of their ingredients, or with another guarantee.

A navigator's class says what it knows: `INGREDIENTS`, names that its option `without` takes (several joined by `+`), and
`GUARANTEES`, values that its option `guarantee` takes. A variant has a name of its own, the navigator's with the
options in brackets, by which it is run, resumed and found in the results.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from clearway.campaigns.by_robot import is_by_robot
from clearway.campaigns.pool import Fate, Pool
from clearway.errors import ClearwayError, unknown
from clearway.navigators.registry import navigator_class, split_options, with_option

WITHOUT, GUARANTEE = "without", "guarantee"

Options = Mapping[str, Mapping[str, Any]]
"""Navigator's name -> what its constructor is given."""


def variants(
    navigators: Iterable[str],
    options: Options,
    without: Iterable[str] = (),
    guarantees: Iterable[str] = (),
    *,
    work: Pool | None = None,
    patience: float | None = None,
) -> tuple[tuple[str, ...], dict[str, Mapping[str, Any]]]:
    """The navigators to run, and the options of each.

    Args:
        navigators: Names or addresses, with or without options behind them.
        options: What their constructors are given. Those of others are kept: a scenario's robots may have them.
        without: Ingredients. Beside each navigator that knows one, the variant without it is run; one that leaves
            something out already, that has no ingredients, or that is privileged (a reference), runs as it is.
        guarantees: Values; each navigator that offers guarantees is run once with each of them, instead of as it
            stands.
        work: Where the navigators' modules are imported; None: in this process.
        patience: How long that may take, s of wall clock; None: as long as it likes.

    Raises:
        ClearwayError: a navigator that can't be imported, an ingredient or a guarantee that no navigator knows, or one that a navigator's own options set.
    """
    named = tuple(navigators)
    chosen, given = list(named), dict(options)
    strangers = given.keys() - set(named)
    for option, asked, attribute in (
        (GUARANTEE, list(guarantees), "GUARANTEES"),
        (WITHOUT, list(without), "INGREDIENTS"),
    ):
        if not asked:
            continue  # nobody's module is imported for nothing
        calls = [(name, attribute) for name in chosen]
        known = dict((work or Pool(0, Path())).each(_known, calls, patience=patience, fallen=_cannot_be_asked))
        _refuse_unknown(option, asked, known)
        made: dict[str, None] = {}
        for name in chosen:
            values = [value for value in asked if set(_parts(option, value)) <= known[name]]
            if values and (option in given.get(name, {}) or option in split_options(name)[1]):
                if option == WITHOUT:
                    values = []
                else:
                    raise ClearwayError(f"navigator {name!r} says its own {option} already", field=f"--{option}")
            if not values or option == WITHOUT:
                made[name] = None
            for value in values:
                variant = with_option(name, option, value)
                made[variant] = None
                if name in given:
                    given[variant] = given[name]
        chosen = list(made)
    return tuple(chosen), {name: given[name] for name in given if name in chosen or name in strangers}


def _known(name: str, attribute: str) -> tuple[str, frozenset[str]]:
    if is_by_robot(name):
        return name, frozenset()  # it runs as it is
    made = navigator_class(name)
    if attribute == "INGREDIENTS" and getattr(made, "privileged", False) is True:
        return name, frozenset()
    return name, frozenset(getattr(made, attribute, ()))


def _cannot_be_asked(fate: Fate, name: str, attribute: str) -> tuple[str, frozenset[str]]:
    raise ClearwayError(f"navigator {name!r} cannot be asked for its {attribute}: the process that asked it {fate}")


def _refuse_unknown(option: str, asked: Iterable[str], known: Mapping[str, frozenset[str]]) -> None:
    field, kind = f"--{option}", "ingredient" if option == WITHOUT else "guarantee"
    every = frozenset().union(*known.values())
    for value in asked:
        if not every:
            raise ClearwayError(f"none of the navigators has {kind}s: {', '.join(known)}", field=field)
        for part in _parts(option, value):
            if part not in every:
                raise unknown(kind, part, every, field=field)
        if not any(set(_parts(option, value)) <= own for own in known.values()):
            raise ClearwayError(f"none of the navigators knows all of {value!r}", field=field)


def _parts(option: str, value: str) -> list[str]:
    return value.split("+") if option == WITHOUT else [value]
