"""Whatever a trial holds comes back from the results directory, bit by bit."""

from __future__ import annotations

import dataclasses
import enum
import json
import math
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from made_trials import make_recorded, make_trial

from clearway.contract import BodyKind, Diagnostics, EventKind
from clearway.geometry.grid import OccupancyGrid
from clearway.geometry.shapes import Circle, Polygon
from clearway.robots import DriveLimits
from clearway.trials import Attempt, Body, Errand, Event, Labels, Leg, Outcome, Snapshot, Span, Trial
from clearway.trials.attempt_json import attempt_from_json, attempt_to_json, dumps
from clearway.trials.store import TrialStore, open_results, write_partial

SCHEMA = pa.schema([pa.field("scenario", pa.string()), pa.field("speed", pa.float64(), metadata={"unit": "m/s"})])

anything = st.floats(allow_nan=True, allow_infinity=True)
finite = st.floats(allow_nan=False, allow_infinity=False)
text = st.text(st.characters(blacklist_categories=("Cs",)), max_size=8)
maybe = st.none() | finite


def array(*shape: int) -> st.SearchStrategy[np.ndarray]:
    return hnp.arrays(np.float64, shape, elements=anything)


shapes = st.builds(Circle, finite) | st.builds(
    Polygon, st.lists(st.tuples(finite, finite), min_size=2, max_size=4).map(tuple)
)
legs = st.builds(Leg, text, array(3), array(3), finite, anything, st.booleans(), anything)
bodies = st.builds(
    Body,
    text,
    st.sampled_from(BodyKind),
    shapes,
    st.none() | array(3),
    anything,
    st.booleans(),
)
labels = st.builds(Labels, text, text, text, maybe, maybe, maybe, maybe, st.integers(1, 99), st.none() | text)
attempts = st.builds(
    Attempt,
    labels=labels,
    robot=text,
    navigator=text,
    localisation=text,
    footprint=st.none() | shapes,
    legs=st.lists(legs, max_size=3).map(tuple),
    bodies=st.lists(bodies, max_size=4).map(tuple),
    speed_limit=maybe,
    period=finite,
    reference_length=maybe,
    floor_plan=text,
    scenario=st.none() | text,
    seed=st.none() | st.integers(0, 2**63 - 1),
    privileged=st.booleans(),
    tracking=text,
    optimal_time=maybe,
    shortest_path=maybe,
    limits=st.none() | st.builds(DriveLimits, *[anything] * 7),
    sight=maybe,
    source=st.sampled_from(["simulated", "recorded"]),
)
lines = st.integers(0, 3).flatmap(lambda n: array(n, 2))
grids = st.builds(
    OccupancyGrid,
    hnp.arrays(np.int8, st.tuples(st.integers(1, 3), st.integers(1, 3)), elements=st.integers(-128, 127)),
    finite,
    st.tuples(finite, finite),
)
diagnostics = st.builds(
    Diagnostics,
    polylines=st.dictionaries(text, lines, max_size=2),
    circles=st.dictionaries(text, st.integers(0, 2).flatmap(lambda n: array(n, 3)), max_size=2),
    tube=st.none() | st.integers(0, 2).flatmap(lambda n: array(n, 3)),
    tree=st.none() | st.integers(0, 2).flatmap(lambda n: array(n, 4)),
    field=st.none() | grids,
    status=text,
    iterations=st.integers(0, 2**40),
)


@st.composite
def trials(draw: st.DrawFn) -> Trial:
    n, m = draw(st.integers(0, 4)), draw(st.integers(0, 3))
    return Trial(
        attempt=draw(attempts),
        t=draw(array(n)),
        pose=draw(array(n, 3)),
        velocity=draw(st.none() | array(n, 2)),
        estimate=draw(st.none() | array(n, 3)),
        command=draw(st.none() | array(n, 2)),
        leg=draw(hnp.arrays(np.int64, n, elements=st.integers(0, 5))),
        moving_obstacles=draw(array(n, m, 3)),
        spans=tuple(draw(st.lists(st.builds(Span, st.integers(0, 5), anything, anything, st.booleans()), max_size=3))),
        events=tuple(
            draw(
                st.lists(
                    st.builds(Event, anything, st.sampled_from(EventKind), text, st.none() | st.integers(0, 3)),
                    max_size=3,
                )
            )
        ),
        outcome=draw(st.sampled_from(list(Outcome))),
        reason=draw(text),
        snapshots=tuple(draw(st.lists(st.builds(Snapshot, finite, diagnostics), max_size=3))),
        provenance=draw(
            st.dictionaries(text, text | st.integers(-(2**60), 2**60) | st.booleans() | finite, max_size=3)
        ),
        timing=draw(st.dictionaries(text, finite, max_size=2)),
        thinking=draw(
            st.none() | st.just(np.linspace(0.0, 1.0, n).astype(np.float32).astype(np.float64)) if n else st.none()
        ),
        cut=draw(st.none() | hnp.arrays(np.bool_, n)),
        sigma=draw(st.none() | array(n, 1 + m, 2)),
        errands=tuple(
            draw(
                st.lists(
                    st.builds(Errand, st.integers(0, 3), st.integers(0, 9), anything, anything, anything, anything),
                    max_size=3,
                )
            )
        ),
    )


def same(a: Any, b: Any) -> bool:
    """Equal to the last bit, NaN equal to NaN, -0.0 not equal to 0.0."""
    if isinstance(a, np.ndarray):
        return isinstance(b, np.ndarray) and a.dtype == b.dtype and a.shape == b.shape and _bits(a) == _bits(b)
    if dataclasses.is_dataclass(a) and not isinstance(a, type):
        return type(a) is type(b) and all(same(getattr(a, f.name), getattr(b, f.name)) for f in dataclasses.fields(a))
    if isinstance(a, Mapping):
        return isinstance(b, Mapping) and list(a) == list(b) and all(same(a[k], b[k]) for k in a)
    if isinstance(a, tuple):
        return isinstance(b, tuple) and len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, float) and not isinstance(a, enum.Enum):
        return isinstance(b, float) and ((a == b and math.copysign(1, a) == math.copysign(1, b)) or (a != a and b != b))
    return type(a) is type(b) and a == b


def _bits(a: np.ndarray) -> bytes:
    if a.dtype.kind == "f":
        a = np.where(np.isnan(a), np.nan, a)  # one NaN is as good as another
    return a.tobytes()


@settings(max_examples=25, deadline=None)
@given(st.lists(trials(), min_size=1, max_size=3))
def test_every_trial_comes_back(written: list[Trial]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        with TrialStore(out, {"plan": {}}, len(written), SCHEMA) as store:
            for i in reversed(range(len(written))):
                write_partial(
                    store.partial,
                    store.key,
                    i,
                    written[i],
                    {"id": str(i), "scenario": written[i].attempt.scenario, "speed": 0.5},
                )
            results = store.finish()
        assert len(results) == len(written)
        for i, trial in enumerate(written):
            assert same(trial, results.trial(i))
        assert [same(a, b) for a, b in zip(written, open_results(out), strict=True)] == [True] * len(written)


def test_a_zero_below_zero_comes_back() -> None:
    attempt = dataclasses.replace(make_trial(0).attempt, limits=DriveLimits(*[1.0] * 7, v_y_max=-0.0))
    again = attempt_from_json(json.loads(dumps(attempt_to_json(attempt, 0))), ())
    assert same(attempt.limits, again.limits)


def test_a_recorded_trial_comes_back(tmp_path: Path) -> None:
    """Beside simulated ones: what is unknown stays unknown, and how sure the rest is stays said."""
    written = [make_trial(0), make_recorded(3), make_trial(1), make_recorded(4)]
    with TrialStore(tmp_path / "out", {"plan": {}}, len(written), SCHEMA) as store:
        for i, trial in enumerate(written):
            write_partial(
                store.partial,
                store.key,
                i,
                trial,
                {"id": str(i), "scenario": trial.attempt.scenario, "speed": trial.attempt.labels.speed},
            )
        results = store.finish()
    for i, trial in enumerate(written):
        assert same(trial, results.trial(i))
    again = results.trial(1)
    assert again.sigma is not None
    assert again.sigma.shape == (40, 2, 2)
    assert (again.attempt.source, again.attempt.labels.speed) == ("recorded", None)
    assert again.tie == pytest.approx(again.sigma[:, 0] / 2, nan_ok=True)
    bed = again.attempt.bodies[-1]
    assert (bed.name, bed.sigma, bed.outlined, bed.measured) == ("bed", 0.005, False, True)
    assert results.trial(0).sigma is None
    assert results.trials["speed"].to_pylist() == [0.6, None, 0.6, None]
