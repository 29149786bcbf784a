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


times = st.floats(0.0, 100.0)


@given(st.lists(st.tuples(times, times, times, times), min_size=1, max_size=5))
def test_mean_and_worst(found):
    row = score_row(among(*(Errand(1, k, *how) for k, how in enumerate(found))))
    late = [a - c for a, _, c, _ in found]
    assert row["people_delay"] == pytest.approx(sum(late) / len(late), abs=1e-9)
    assert row["people_delay_max"] == max(late)
    assert row["people_detour"] == pytest.approx(sum(b - d for _, b, _, d in found) / len(found), abs=1e-9)


def test_one_of_whom_it_is_not_known_leaves_none_and_is_named():
    known = Errand(1, 0, 5.0, 4.0, 4.0, 3.0)
    for errand, reason in (
        (Errand(2, 0, math.nan, math.nan, 4.0, 3.0), "bert did not arrive in two minutes after the trial"),
        (Errand(2, 0, 5.0, 4.0), "nobody knows when bert had arrived without robots"),
    ):
        row = score_row(among(known, errand))
        assert [row[n] for n in NAMES] == [None] * 3
        assert json.loads(row["not_computable"])["people_delay"] == reason


def test_who_arrives_neither_with_robots_nor_without_is_left_out():
    stuck = Errand(2, 0, math.nan, math.nan)
    row = score_row(among(Errand(1, 0, 5.0, 4.0, 4.0, 3.5), stuck))
    assert [row[n] for n in NAMES] == [1.0, 1.0, 0.5]
    row = score_row(among(stuck))
    assert json.loads(row["not_computable"])["people_delay"] == "nobody arrived, with robots or without"


def test_who_gave_up_delayed_nobody_for_long():
    trial = among(Errand(1, 0, 5.0, 4.0, 4.0, 3.0))
    spans = (replace(trial.spans[0], reached=False), *trial.spans[1:])
    row = score_row(replace(trial, spans=spans, outcome=Outcome.ABORTED))
    assert "leg forth was not finished" in json.loads(row["not_computable"])["people_delay"]


def test_without_people_and_of_recordings_nothing_is_said():
    film = among()
    for trial in (shuttle(bodies=(box(2.5, 1.0),)), replace(film, attempt=replace(film.attempt, source="recorded"))):
        row = score_row(trial)
        assert [row[n] for n in NAMES] == [None] * 3
        assert not set(NAMES) & set(json.loads(row["not_computable"]))
