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

    def hardness(self, candidate) -> float:
        return 0.0

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


class Timing(Boxes):
    """The second family fails where three numbers are right; of two of them that can be told without a trial, in any family."""

    def hardness(self, candidate) -> float:
        return -float(np.abs(candidate.point[:2] - 0.7).sum())

    def tried(self, candidate) -> Tried:
        margin = float(np.abs(candidate.point[:3] - 0.7).max()) - 0.04 if candidate.base == 1 else 1.0
        return Tried(margin, "collision" if margin <= 0 else "reached", "", (0.0, 0.0), 1.0, 0.0, "way")


def _first_break(space: Boxes, method: str, seed: int, most: int) -> int:
    done = 0
    strategy = strategy_named(method, space, 4, seed)
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


@pytest.mark.parametrize(("method", "space"), [("gp", Boxes()), ("screen", Timing())])
def test_a_search_needs_a_tenth_of_what_chance_needs(method, space):
    # The corner's ball of radius 0.25 holds less than 6.2e-5 of its cube, the right timing is 1.7e-4 of all: chance needs more than 5,000.
    searched = [_first_break(space, method, seed, 2500) for seed in range(4)]
    chance = [_first_break(space, "random", seed, 10_000) for seed in range(4)]
    assert 10 * np.mean(searched) < np.mean(chance)


def test_a_screen_that_is_wrong_takes_at_most_four_times_as_many_trials():
    class Misleading(Boxes):
        corner = np.full(SIZE, 0.5)

        def hardness(self, candidate) -> float:
            return float(np.linalg.norm(candidate.point - self.corner))

        def tried(self, candidate) -> Tried:
            margin = float(np.abs(candidate.point - self.corner).max()) - 0.4
            return Tried(margin, "collision", "", (0.0, 0.0), 1.0, 0.0, "way")

    space = Misleading()
    share = {}
    for method in ("screen", "random"):
        strategy = strategy_named(method, space, 4, 0)
        tried = [space.tried(c) for _ in range(500) for c in strategy.ask()]
        share[method] = sum(t.broken for t in tried) / len(tried)
    assert share["random"] / 4.5 < share["screen"] < share["random"]


@pytest.mark.parametrize("method", ["screen", "gp"])
def test_the_same_seed_proposes_the_same(method):
    a, b = (strategy_named(method, Boxes(), 4, 7) for _ in range(2))
    for _ in range(4):
        asked, again = a.ask(), b.ask()
        assert all((x.point == y.point).all() and x.noise == y.noise for x, y in zip(asked, again, strict=True))
        a.tell(asked, [Boxes().tried(c) for c in asked])
        b.tell(again, [Boxes().tried(c) for c in again])


@pytest.mark.parametrize("method", ["screen", "gp"])
def test_what_makes_no_scenario_or_no_margin_ends_no_search_early(method):
    strategy = strategy_named(method, Boxes(), 4, 0)
    for _ in range(5):
        asked = strategy.ask()
        strategy.tell(
            asked, [None, *(Tried(math.inf, "aborted", "", (math.nan, math.nan), 0.0, 0.0, "") for _ in asked[1:])]
        )


def test_an_unknown_method_is_told():
    with pytest.raises(ClearwayError, match="unknown method 'sreen'; did you mean 'screen'"):
        strategy_named("sreen", Boxes(), 1, 0)
