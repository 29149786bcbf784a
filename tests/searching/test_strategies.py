"""How strategies go through a space whose margins are a formula."""

from __future__ import annotations

import math

import numpy as np
import pytest

from clearway.errors import ClearwayError
from clearway.searching.candidates import Tried
from clearway.searching.strategies import strategy_named

SIZE = 8


class Boxes:
    """Three families; the second one fails near a corner of its cube."""

    corner = np.full(SIZE, 0.9)

    def __len__(self) -> int:
        return 3

    def size(self, base: int) -> int:
        return SIZE

    def nominal(self, base: int) -> np.ndarray:
        return np.full(SIZE, 0.5)

    def tried(self, candidate) -> Tried:
        far = float(np.linalg.norm(candidate.point - self.corner))
        margin = far - 0.25 if candidate.base == 1 else far + 1.0 + candidate.base
        return Tried(
            margin,
            "collision" if margin <= 0 else "reached",
            "",
            (float(candidate.point[0]) * 10, 0.0),
            1.0,
            0.0,
            "way",
        )


def _first_break(method: str, seed: int, most: int) -> int:
    space, done = Boxes(), 0
    strategy = strategy_named(method, space, most, 4, seed)
    while done < most:
        asked = strategy.ask()
        tried = [space.tried(c) for c in asked]
        assert all(((c.point >= 0) & (c.point <= 1)).all() for c in asked)
        for k, one in enumerate(tried, 1):
            if one.broken:
                return done + k
        strategy.tell(asked, tried)
        done += len(asked)
    return most


@pytest.mark.parametrize("method", ["gp", "cma", pytest.param("qd", marks=pytest.mark.slow)])
def test_a_search_needs_a_tenth_of_what_chance_needs(method):
    # The corner's ball of radius 0.25 holds less than 6.2e-5 of its cube: chance needs 48,000 trials in the mean.
    climbed = [_first_break(method, seed, 2500) for seed in range(4)]
    chance = [_first_break("random", seed, 10_000) for seed in range(4)]
    assert 10 * np.mean(climbed) < np.mean(chance)


@pytest.mark.parametrize("method", ["gp", "cma", "qd"])
def test_the_same_seed_proposes_the_same(method):
    a, b = (strategy_named(method, Boxes(), 100, 4, 7) for _ in range(2))
    for _ in range(4):
        asked, again = a.ask(), b.ask()
        assert all((x.point == y.point).all() and x.noise == y.noise for x, y in zip(asked, again, strict=True))
        a.tell(asked, [Boxes().tried(c) for c in asked])
        b.tell(again, [Boxes().tried(c) for c in again])


@pytest.mark.parametrize("method", ["gp", "cma", "qd"])
def test_what_makes_no_scenario_or_no_margin_ends_no_search_early(method):
    strategy = strategy_named(method, Boxes(), 100, 4, 0)
    for _ in range(5):
        asked = strategy.ask()
        strategy.tell(
            asked, [None, *(Tried(math.inf, "aborted", "", (math.nan, math.nan), 0.0, 0.0, "") for _ in asked[1:])]
        )


def _places(method: str, seed: int, most: int) -> int:
    """At how many of ten places breaks are found, where one number alone says at which."""

    class Line(Boxes):
        def __len__(self) -> int:
            return 1

        def tried(self, candidate) -> Tried:
            margin = float(np.abs(candidate.point[1:] - 0.7).max()) - 0.25
            return Tried(margin, "collision", "", (float(candidate.point[0]) * 10, 0.0), 1.0, 0.0, "way")

    space, found, done = Line(), set(), 0
    strategy = strategy_named(method, space, most, 4, seed)
    while done < most:
        asked = strategy.ask()
        tried = [space.tried(c) for c in asked]
        found |= {round(t.place[0]) for t in tried if t.broken}
        strategy.tell(asked, tried)
        done += len(asked)
    return len(found)


def test_a_climb_that_begins_anew_finds_breaks_at_more_places_than_chance():
    places = {method: sum(_places(method, seed, 600) for seed in range(4)) for method in ("cma", "qd", "random")}
    assert places["cma"] > 1.3 * places["random"]
    assert places["qd"] > 2.0 * places["random"]


def test_an_unknown_method_is_told():
    with pytest.raises(ClearwayError, match="unknown method 'cme'; did you mean 'cma'"):
        strategy_named("cme", Boxes(), 10, 1, 0)
