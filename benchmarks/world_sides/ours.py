"""The scene in Clearway: a whole trial, and a learner's environments."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from world_sides.scene import BEAMS, EPISODE, HALF, LANE_END, LANES, OMEGA, PERIOD, RADIUS, RANGE, SIGMA, WORLDS, V

if TYPE_CHECKING:
    from clearway.robots import Robot
    from clearway.scenarios.scenario import Scenario


def clearway(steps: int, people: bool, every: float = PERIOD, alone: bool = False) -> Callable[[], float]:
    """A whole trial, a fresh world each time."""
    import numpy as np

    from clearway.contract import Command, Decision
    from clearway.geometry.shapes import Circle, rectangle
    from clearway.trials import Body
    from clearway.world import simulate_in
    from clearway.world.tracks import stack, tracks

    walls = [rectangle(2 * HALF, 0.1), rectangle(2 * HALF, 0.1), rectangle(0.1, 2 * HALF), rectangle(0.1, 2 * HALF)]
    places = [(0, HALF + 0.05), (0, -HALF - 0.05), (HALF + 0.05, 0), (-HALF - 0.05, 0)]
    bodies = [Body("wall", "wall", w, np.array([x, y, 0.0])) for w, (x, y) in zip(walls, places, strict=True)]
    knots = []
    for y, speed in () if alone else LANES:
        t, x, rows = 0.0, -LANE_END, []
        while t <= steps * PERIOD + 1:
            rows += [(t, x, y, 0.0), (t + 2 * LANE_END / speed, -x, y, 0.0)]
            t, x = t + 2 * LANE_END / speed, -x
        knots.append(np.array(rows))
        bodies.append(Body("disc", "moving obstacle", Circle(RADIUS), None))
    robot, scenario = _scene(steps, people, every=every)
    if people:
        from clearway.world.bodies import bodies_of

        bodies = [*bodies[: len(walls)], *bodies_of((), scenario)]

    class Pilot:
        def reset(self, task: object, robot: object, rng: object) -> None:
            self.command = Command(V, OMEGA)

        def decide(self, sensing: object) -> Decision:
            return Decision(self.command, sensing.truth)  # type: ignore[attr-defined]

    def once() -> float:
        before = time.process_time()
        way = tracks([], ["forth"], 0.0, len(LANES)) if people else stack([knots]) if knots else tracks([], ["forth"])
        trial = simulate_in(bodies, way, scenario, robot, Pilot(), navigator="constant", localisation="truth")
        assert len(trial.t) == steps + 1, trial.reason
        return (time.process_time() - before) / steps

    return once


def _scene(
    steps: int, people: bool, walls: Sequence[object] = (), every: float = 0.05
) -> tuple[Robot, Scenario]:  # fmt: skip
    """The robot, and the room's scenario, without the discs on rails; people decide `every` so many seconds."""
    from clearway.robots import Robot
    from clearway.scenarios.scenario import Scenario

    robot = Robot.model_validate({
        "name": "r", "title": "R", "d_base": 0.4, "footprint": {"kind": "circle", "radius": RADIUS}, "period": PERIOD,
        "drive": {"v_max": 1, "v_min": -1, "acceleration": 1, "deceleration": 1, "omega_max": 2,
                  "angular_acceleration": 2, "angular_deceleration": 2},
        "lidar": {"beams": BEAMS, "angle_min": -math.pi, "angle_max": math.pi, "range_min": 0.0, "range_max": RANGE,
                  "sigma": SIGMA},
        "odometry": {"translation_per_metre": 0.01, "rotation_per_metre": 0.01, "rotation_per_radian": 0.01},
        "tolerances": {"xy": 0.1, "yaw": 0.1},
    })  # fmt: skip
    scenario = Scenario.model_validate({
        "name": "s", "floor_plan": "open-25" if walls else "hall", "obstacles": walls, "start": (0, 0, 0), "speed": 1.0,
        "legs": [{"name": "forth", "goal": (4, 4, 0), "time_limit": steps * PERIOD}],
        **({"people": [
            {"name": f"p{k}", "start": (-LANE_END, y), "route": [{"at": (LANE_END, y)}, {"at": (-LANE_END, y)}], "loop": True,
             "speed": speed, "radius": RADIUS, "behaviour": "orca", "decides_every": every} for k, (y, speed) in enumerate(LANES)
        ]} if people else {}),
    })  # fmt: skip
    return robot, scenario


def learner(steps: int, every: float = PERIOD) -> Callable[[], float]:
    """Steps of `clearway.learning.make_vec`: 16 worlds in one kernel, an episode of a minute each; people decide `every` so many seconds."""
    import numpy as np

    from clearway.learning import make_vec

    walls = [
        {"name": f"wall {k}", "shape": {"kind": "rectangle", "length": 2 * HALF, "width": 0.1}, "pose": pose}
        for k, pose in enumerate(
            [(0, HALF + 0.05, 0), (0, -HALF - 0.05, 0), (HALF + 0.06, 0, math.pi / 2), (-HALF - 0.06, 0, math.pi / 2)]
        )
    ]
    robot, scenario = _scene(EPISODE, True, walls, every)
    env = make_vec(scenario, robot, num_envs=WORLDS, beams=BEAMS, flat=True, normalised=False, localisation="odometry")
    action = np.tile(np.array((V, OMEGA), np.float32), (WORLDS, 1))
    env.reset(seed=1)

    def once() -> float:
        before = time.process_time()
        for _ in range(max(steps // WORLDS, 1)):
            seen, *_ = env.step(action)
        assert seen.shape[1] > BEAMS
        return (time.process_time() - before) / (WORLDS * max(steps // WORLDS, 1))

    return once
