"""People's delay, of errands made by hand."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from indicator_trials import box, shuttle

from clearway.contract import BodyKind
from clearway.geometry.shapes import Circle
from clearway.indicators import score_row
from clearway.trials import Body, Errand, Outcome

NAMES = ("people_delay", "people_delay_max", "people_detour")


def person(name):
    return Body(name, BodyKind.PERSON, Circle(0.25), np.array([2.5, 3.0, 0.0]))


def among(*errands, **changes):
    return shuttle(bodies=(box(2.5, 1.0), person("anna"), person("bert")), errands=errands, **changes)


UNTIL = 120.0
times = st.floats(0.0, 100.0)


@given(st.lists(st.tuples(times, times, times, times), min_size=1, max_size=5))
def test_mean_and_worst(found):
    row = score_row(among(*(Errand(1, k, *how, until=UNTIL) for k, how in enumerate(found))))
    late = [a - c for a, _, c, _ in found]
    assert row["people_delay"] == pytest.approx(sum(late) / len(late), abs=1e-9)
    assert row["people_delay_max"] == max(late)
    assert row["people_detour"] == pytest.approx(sum(b - d for _, b, _, d in found) / len(found), abs=1e-9)


def test_who_does_not_arrive_counts_as_coming_at_the_end():
    known = Errand(1, 0, 5.0, 4.0, 4.0, 3.0, UNTIL)
    for errand, late in (
        (Errand(2, 0, math.nan, math.nan, 4.0, 3.0, UNTIL), UNTIL - 4.0),
        (Errand(2, 0, 5.0, 4.0, math.nan, math.nan, UNTIL), 5.0 - UNTIL),
        (Errand(2, 0, 5.0, 4.0, UNTIL + 7.0, 30.0, UNTIL), 5.0 - UNTIL),
        (Errand(2, 0, math.nan, math.nan, math.nan, math.nan, UNTIL), 0.0),
    ):
        row = score_row(among(known, errand))
        assert row["people_delay"] == pytest.approx((1.0 + late) / 2)
        assert row["people_delay_max"] == pytest.approx(max(1.0, late))
        both = [e for e in (known, errand) if not math.isnan(e.path - e.path_without)]
        assert row["people_detour"] == pytest.approx(sum(e.path - e.path_without for e in both) / len(both))
    row = score_row(among(errand))
    assert json.loads(row["not_computable"])["people_detour"] == "nobody arrived both with robots and without"


def test_where_nobody_knows_how_it_is_without_robots_nothing_is_said():
    row = score_row(among(Errand(1, 0, 5.0, 4.0)))
    assert [row[n] for n in NAMES] == [None] * 3
    assert json.loads(row["not_computable"])["people_delay"] == "nobody knows how people walk there without robots"


def test_who_gave_up_delayed_nobody_for_long_but_who_ran_out_of_time_did():
    trial = among(Errand(1, 0, 5.0, 4.0, 4.0, 3.0, UNTIL))
    spans = (replace(trial.spans[0], reached=False), *trial.spans[1:])
    for outcome in (Outcome.ABORTED, Outcome.LIVELOCK):  # the trial was over long before its time was
        row = score_row(replace(trial, spans=spans, outcome=outcome))
        assert "leg forth was not finished" in json.loads(row["not_computable"])["people_delay"]
    assert score_row(replace(trial, spans=spans, outcome=Outcome.TIMEOUT))["people_delay"] == 1.0


def test_without_people_and_of_recordings_nothing_is_said():
    film = among()
    for trial in (shuttle(bodies=(box(2.5, 1.0),)), replace(film, attempt=replace(film.attempt, source="recorded"))):
        row = score_row(trial)
        assert [row[n] for n in NAMES] == [None] * 3
        assert not set(NAMES) & set(json.loads(row["not_computable"]))
