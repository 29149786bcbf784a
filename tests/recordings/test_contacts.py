"""Contacts: what is certain, what a person has to confirm, and what isn't said at all."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from clearway.errors import ClearwayError
from clearway.geometry.distance import clearance
from clearway.geometry.shapes import Circle, Polygon, Shape, rectangle
from clearway.recordings.lab.contacts import _moved_in, assess
from clearway.trials import Attempt, Body, Event, Labels

DISC = Circle(0.3)
L_SHAPE = Polygon(((-0.3, -0.3), (0.5, -0.3), (0.5, 0.1), (0.1, 0.1), (0.1, 0.4), (-0.3, 0.4)))


def attempt(footprint: Shape | None, *bodies: Body, source: str = "recorded") -> Attempt:
    return Attempt(
        Labels("own", "own", "own", None), "robot", "recorded", "recorded", footprint, (), bodies, None, 0.01,
        source=source,  # type: ignore[arg-type]
    )  # fmt: skip


def box(x: float, sigma: float = 0.0, kind: str = "obstacle", name: str = "box") -> Body:
    return Body(name, kind, rectangle(0.2, 0.2), np.array([x, 0.0, 0.0]), sigma)


def approach(nearest: float, n: int = 101, back: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """Drives along x until its base_link is at `nearest`, and back."""
    t = np.arange(n) * 0.01
    x = nearest - 0.5 * np.abs(np.linspace(-1, 1 if back else 0, n))
    return t, np.stack([x, np.zeros(n), np.zeros(n)], axis=1)


def of(nearest: float, body: Body, footprint: Shape = DISC, s: tuple[float, float] = (0.003, 0.0)) -> tuple[Event, ...]:
    t, pose = approach(nearest)
    return assess(attempt(footprint, body), t, pose, np.zeros((len(t), 0, 3)), np.tile(s, (len(t), 1, 1)))


def test_clearance_against_its_uncertainty() -> None:
    """A disc of 0.3 m before a box whose face is at 0.9 m, U = 2 * 3 mm: nothing, possible, certain."""
    assert of(0.593, box(1.0)) == ()
    for nearest, said in ((0.595, "0.005 m +- 0.006 m"), (0.603, "0.000 m +- 0.006 m")):
        (event,) = of(nearest, box(1.0))
        assert event.kind == "possible contact"
        assert event.t == pytest.approx(0.5, abs=0.021)
        assert said in event.detail
        assert "to be confirmed" in event.detail
        assert "obstacle 'box'" in event.detail
    (event,) = of(0.607, box(1.0))
    assert event.kind == "contact"
    assert event.t <= 0.5


def test_a_long_approach_says_when_it_began() -> None:
    t = np.arange(0.0, 12.0, 0.05)
    x = np.where((t > 3) & (t < 9), 0.6, 0.0)  # 3 to 9 s at the box
    x[np.argmin(np.abs(t - 6.0))] = 0.602  # nearest in the middle
    pose = np.stack((x, 0 * x, 0 * x), axis=1)
    n = len(t)
    (event,) = assess(attempt(Circle(0.3), box(1.0)), t, pose, np.zeros((n, 0, 3)), np.tile([0.003, 0.0], (n, 1, 1)))
    assert event.t == pytest.approx(6.0, abs=0.06)
    began, lasted = re.search(r"from ([\d.]+) s for ([\d.]+) s", event.detail).groups()  # type: ignore[union-attr]
    assert float(began) == pytest.approx(3.0, abs=0.06)
    assert float(lasted) == pytest.approx(6.0, abs=0.11)


def test_the_uncertainty_is_of_both_with_headings_by_the_lever_arm() -> None:
    square = rectangle(0.6, 0.6)
    arm = math.hypot(0.3, 0.3)
    u = 2 * math.sqrt(0.003**2 + 0.004**2 + (0.01 * arm) ** 2)
    assert of(0.6 - u - 1e-4, box(1.0, 0.004), square, (0.003, 0.01)) == ()
    (event,) = of(0.6 - u + 1e-4, box(1.0, 0.004), square, (0.003, 0.01))
    assert event.kind == "possible contact"
    assert f"+- {u:.3f} m" in event.detail
    # a disc looks the same from everywhere
    assert of(0.6 - u + 1e-4, box(1.0, 0.004), Circle(0.3), (0.003, 0.01)) == ()


def test_a_room_is_surveyed_worse_than_a_marker() -> None:
    assert of(0.57, box(1.0)) == ()
    (event,) = of(0.57, box(1.0, kind="wall"))
    assert event.kind == "possible contact"
    t, pose = approach(0.57)
    exact = attempt(Circle(0.3), box(1.0, kind="wall"), source="simulated")
    assert assess(exact, t, pose, np.zeros((len(t), 0, 3)), np.zeros((len(t), 1, 2))) == ()


def test_one_event_per_body_and_episode() -> None:
    t, pose = approach(0.598)
    twice = np.concatenate([t, t + 2.0]), np.vstack([pose, pose])
    n = len(twice[0])
    bodies = box(1.0), box(1.001, name="other")
    events = assess(attempt(Circle(0.3), *bodies), *twice, np.zeros((n, 0, 3)), np.tile([0.003, 0.0], (n, 1, 1)))
    assert [(round(e.t, 2), e.kind) for e in events] == [(0.5, "possible contact")] * 2 + [
        (2.5, "possible contact")
    ] * 2
    assert {e.detail.split("'")[1] for e in events} == {"box", "other"}


def test_moving_obstacles_that_are_absent_or_without_outline_are_skipped() -> None:
    t, pose = approach(0.0, back=False)
    n = len(t)
    moving_obstacles = np.zeros((n, 3, 3))
    moving_obstacles[:, 0] = [0.5, 0.0, 0.0]
    moving_obstacles[:, 1] = np.nan
    moving_obstacles[-1:, 1] = [0.5, 0.0, np.nan]  # of a disc no heading is needed
    moving_obstacles[:, 2] = [0.5, 0.0, np.nan]
    person, cart = (
        Body("person", "moving obstacle", Circle(0.25), None),
        Body("cart", "moving obstacle", rectangle(0.4, 0.4), None),
    )
    ghost = Body("ghost", "moving obstacle", Circle(0.0), None, outlined=False)
    sigma = np.full((n, 4, 2), 0.001)
    made = attempt(Circle(0.3), person, replace(person, name="late"), cart)
    events = assess(made, t, pose, moving_obstacles, sigma)
    assert [(e.kind, e.detail.split("'")[1]) for e in events] == [("contact", "person"), ("contact", "late")]
    assert events[1].t == t[-1]
    assert assess(attempt(Circle(0.3), ghost), t, pose, moving_obstacles[:, :1], sigma[:, :2]) == ()
    assert assess(attempt(None, person), t, pose, moving_obstacles[:, :1], sigma[:, :2]) == ()


def test_without_uncertainty_nothing_is_certain() -> None:
    t, pose = approach(0.65)
    still = np.zeros((len(t), 0, 3))
    (event,) = assess(attempt(Circle(0.3), box(1.0)), t, pose, still, None)
    assert event.kind == "possible contact"
    assert "unknown uncertainty" in event.detail
    t, pose = approach(0.599)
    assert assess(attempt(Circle(0.3), box(1.0)), t, pose, still, None) == ()


def test_gaps_are_not_judged() -> None:
    t, pose = approach(0.65)
    pose[30:70] = np.nan
    assert (
        assess(attempt(Circle(0.3), box(1.0)), t, pose, np.zeros((len(t), 0, 3)), np.full((len(t), 1, 2), 0.001)) == ()
    )


@pytest.mark.parametrize("shape", [rectangle(0.8, 0.5), L_SHAPE, Polygon(((0.0, -0.2), (0.6, 0.0), (0.0, 0.2)))])
def test_what_is_moved_in_lies_inside_by_that_much(shape: Polygon) -> None:
    for by in (0.005, 0.03, 0.08):
        inner = _moved_in(shape, by)
        assert inner is not None
        core, centre = inner
        assert isinstance(core, Polygon)
        outline = [
            Polygon((a, b)) for a, b in zip(shape.vertices, shape.vertices[1:] + shape.vertices[:1], strict=True)
        ]
        at, origin = np.array([*centre, 0.0]), np.zeros(3)
        nearest = min(clearance(core, at, edge, origin) for edge in outline)
        assert nearest == pytest.approx(by, abs=1e-6)
        assert all(
            clearance(Circle(0.0), np.array([*centre, 0.0]) + np.array([*v, 0.0]), shape, origin) == 0.0
            for v in core.vertices
        )
    assert _moved_in(shape, 1.0) is None


def test_shapes_that_do_not_go_together_are_refused() -> None:
    t, pose = approach(0.5)
    with pytest.raises(ClearwayError, match="go with 101 instants and 0 moving bodies"):
        assess(attempt(Circle(0.3)), t, pose[:-1], np.zeros((len(t), 0, 3)), None)
    with pytest.raises(ClearwayError, match="uncertainties"):
        assess(attempt(Circle(0.3)), t, pose, np.zeros((len(t), 0, 3)), np.zeros((3, 1, 2)))
    assert assess(attempt(Circle(0.3), box(0.0)), np.zeros(0), np.zeros((0, 3)), np.zeros((0, 0, 3)), None) == ()
