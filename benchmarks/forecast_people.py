"""How well are people forecast who keep out of each other's way? Errors by look-ahead of each way to forecast them.

Scenes that are drawn, whose people see no robot, everybody perceived, exactly unless `--error` is given: the people of the suite `crowd`, who walk by ORCA; the
same people if they walk by social force; and the recordings of `replayed` and of `replayed-held-out`, which social force made, as an
overhead camera sees them. Compared: constant velocity, the mixture of models that know of one obstacle only, and that with ORCA, with
social force, and with both as further models.

Printed: mean error of the likeliest hypothesis after 1, 3 and 5 s, m, over all who have been seen for a second and are there
until then; and ms for an update.

    python benchmarks/forecast_people.py [--draws A:B] [--error M] [--json] [--smoke]
"""

from __future__ import annotations

import argparse
import json
import math
import time
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.contract import Obstacles
from clearway.crowds import orca, social_force
from clearway.crowds.bodies import Bodies, Wishes
from clearway.crowds.walls import walls_of
from clearway.forecasts.forecaster import Forecaster
from clearway.forecasts.parameters import ForecastParameters
from clearway.geometry.shapes import FloatArray
from clearway.scenarios.crowdnav import RADIUS, SPEED, TRAINING, crossings
from clearway.scenarios.replayed_draws import COUNTERFLOW, CROSSING, Streams, one_draw
from clearway.scenarios.replayed_draws import RADIUS as RECORDED_RADIUS

AHEAD = (1.0, 3.0, 5.0)
SEEN = 1.0
"""Who has been seen for less is not counted, s."""
WAYS: dict[str, dict[str, Any]] = {
    "constant velocity": {"constant_velocity_only": True},
    "mixture": {},
    "with ORCA": {"avoidance": ["orca"]},
    "with social force": {"avoidance": ["social-force"]},
    "with both": {"avoidance": ["orca", "social-force"]},
}
FINE = 0.05
"""People who walk by social force in the places of `crowd` decide so often, s."""


class Scene(NamedTuple):
    """Where people are.

    Attributes:
        period: Time between two instants, s.
        radius: Of each, m.
        place: (t, n, 2) m; NaN: not there.
        arrives: (n,) from which instant on each is where it wants to, and its way no more counted.
    """

    period: float
    radius: float
    place: FloatArray
    arrives: npt.NDArray[np.int64]


def crossing(seed: int, rule: str, by_force: bool) -> Scene:
    """People of `crowd`, for 10 s; by ORCA as CrowdNav has them, or by social force."""
    at = np.array(crossings(rule, TRAINING + seed))
    place, goal, n = at[:, :2].copy(), at[:, 2:], len(at)
    velocity, walls, every = np.zeros((n, 2)), walls_of([]), round(0.25 / FINE) if by_force else 1
    care = orca.Care(np.full(n, 10.0), np.full(n, 10), np.full(n, 5.0), np.full(n, 5.0))
    ways = [place]
    for k in range(1, 40 * every + 1):
        left = goal - place
        wish = left * (SPEED / np.maximum(np.linalg.norm(left, axis=1), SPEED))[:, None]
        size, most = (RADIUS, 1.3 * SPEED) if by_force else (RADIUS + 0.01, SPEED)
        bodies = Bodies(place, velocity, np.full(n, size), np.ones(n, np.int64), np.full(n, 0.5))
        wishes = Wishes(np.arange(n), wish, np.full(n, most), np.ones(n, np.int64))
        if by_force:
            velocity = social_force.velocities(bodies, wishes, np.full(n, -1), social_force.MOUSSAID, walls, FINE)
        else:
            velocity = orca.velocities(bodies, wishes, care, walls, 0.25)
        place = place + velocity * (FINE if by_force else 0.25)
        if k % every == 0:
            ways.append(place)
    there = np.linalg.norm(np.array(ways) - goal, axis=2) < RADIUS
    return Scene(0.25, RADIUS, np.array(ways), np.where(there.any(axis=0), there.argmax(axis=0), len(ways)))


def recorded(streams: Streams, seed: int, family: str) -> Scene:
    """20 s of a recording that is drawn, from when the robot would start on, every 0.1 s."""
    t = 20.0 + 0.1 * np.arange(201)
    tracks = [np.array(walk.track) for walk in one_draw(streams, seed, family).walks]
    places = [np.column_stack([np.interp(t, w[:, 0], w[:, c], np.nan, np.nan) for c in (1, 2)]) for w in tracks]
    place = np.stack([p for p in places if np.isfinite(p).any()], axis=1)
    return Scene(0.1, RECORDED_RADIUS, place, np.full(place.shape[1], len(t)))


def errors(scene: Scene, parameters: ForecastParameters, error: float) -> tuple[list[list[float]], list[float]]:
    """m of the likeliest hypothesis after each of `AHEAD`, and ms that each update took; places are perceived up to `error` [m] off."""
    rng = np.random.default_rng(7)
    dt, steps = scene.period, [round(a / scene.period) for a in AHEAD]
    forecaster, off, taken = Forecaster(parameters, dt, dt, steps[-1]), [[] for _ in AHEAD], []
    for k, place in enumerate(scene.place):
        at = np.flatnonzero(np.isfinite(place[:, 0]))
        n = len(at)
        way, angle = error * np.sqrt(rng.random(n)), 2.0 * math.pi * rng.random(n)
        seen = Obstacles(
            place[at] + np.column_stack([way * np.cos(angle), way * np.sin(angle)]), np.full((n, 2), np.nan),
            np.full(n, scene.radius), np.full(n, error), np.full(n, np.inf), at,
            np.ones(n, np.bool_),
        )  # fmt: skip
        begun = time.thread_time()
        found, _ = forecaster.update(dt * k, seen)
        taken.append(1e3 * (time.thread_time() - begun))
        before = k - round(SEEN / dt)
        for row, i in enumerate(found.identity.tolist()):
            if found.age[row] > 0.0 or before < 0 or not np.isfinite(scene.place[before, i, 0]):
                continue
            for gathered, step in zip(off, steps, strict=True):
                if k + step < min(len(scene.place), scene.arrives[i]) and np.isfinite(scene.place[k + step, i, 0]):
                    gathered.append(float(np.hypot(*(found.path[row, 0, step] - scene.place[k + step, i]))))
    return off, taken


def scenes(draws: range, family: str = "forecasts") -> dict[str, list[Scene]]:
    """Scenes by their kind."""
    return {
        "crowd, by ORCA": [crossing(s, rule, False) for s in draws for rule in ("circle", "square")],
        "crowd, by social force": [crossing(s, rule, True) for s in draws for rule in ("circle", "square")],
        "replayed": [recorded(CROSSING, s, family) for s in draws],
        "replayed-held-out": [recorded(COUNTERFLOW, s, family) for s in draws],
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draws", default="20000:20020", help="of each kind of scene, from A to before B")
    parser.add_argument("--error", type=float, default=0.0, help="places are perceived up to so much off, m")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--smoke", action="store_true", help="one draw, to see that it runs")
    args = parser.parse_args()
    first, last = map(int, args.draws.split(":"))
    found: dict[str, Any] = {}
    for kind, drawn in scenes(range(first, first + 1 if args.smoke else last)).items():
        for name, changed in WAYS.items():
            parameters = ForecastParameters(**changed)
            each = [errors(scene, parameters, args.error) for scene in drawn]
            off = [np.concatenate([e[0][a] for e in each]) for a in range(len(AHEAD))]
            taken = np.concatenate([e[1] for e in each])
            found.setdefault(kind, {})[name] = {
                "n": [len(e) for e in off], "error": [float(e.mean()) for e in off], "ms": float(np.median(taken)),
            }  # fmt: skip
    if args.json:
        print(json.dumps(found))
        return
    for kind, ways in found.items():
        counts = ", ".join(f"{n} after {a:g} s" for n, a in zip(ways["mixture"]["n"], AHEAD, strict=True))
        print(f"\n{kind}: mean error (m) of {counts}")
        print(f"  {'':<20}" + "".join(f"{a:>7.0f} s" for a in AHEAD) + "   ms an update")
        for name, way in ways.items():
            print(f"  {name:<20}" + "".join(f"{e:>9.3f}" for e in way["error"]) + f"{way['ms']:>10.2f}")


if __name__ == "__main__":
    main()
