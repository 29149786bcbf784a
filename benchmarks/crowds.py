"""How fast the rules of a crowd are, in steps of everybody per second, beside PySocialForce and RVO2 in the same scenes.

Social force: 200 people in a corridor of 50 x 8 m that walk both ways, 80 of them in pairs, between its two walls; and 200 in a
square of 20 m without walls and groups. ORCA: 16 that change places across a circle, 200 in a square of 20 m. 0.1 s a step. Each
side moves its own crowd; only what decides and moves is timed, not what tells RVO2 each wish from Python. CPU time of one process
each, the best of several rounds, in turns.

    python benchmarks/crowds.py [--rivals PYTHON] [--steps N] [--rounds N] [--json] [--smoke]

`--rivals`: a Python that has the packages pysocialforce and pyrvo; default: this one. A rival that is missing is named.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any

import numpy as np

PERIOD, RADIUS, WISH, V_MAX = 0.1, 0.25, 1.2, 1.6
DISTANCE, NEIGHBOURS, HORIZON, WALL_HORIZON = 10.0, 10, 3.0, 1.0
WALLS = [((0.0, 0.0), (50.0, 0.0)), ((0.0, 8.0), (50.0, 8.0))]
RIVALS = {"corridor": "pysocialforce", "square": "pysocialforce", "circle": "pyrvo", "orca square": "pyrvo"}
AIMS = {"corridor": 50.0, "square": 50.0}
"""How many times as fast as the rival it is to be."""


def scene(name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(n, 2) places and goals, m, and (n,) groups, negative: none."""
    rng = np.random.default_rng(0)
    if name == "circle":
        angle = 2 * np.pi * (np.arange(16) + rng.uniform(-0.2, 0.2, 16)) / 16
        place = 6.0 * np.column_stack((np.cos(angle), np.sin(angle)))
        return place, -place, np.full(16, -1)
    long, wide = (50.0, 8.0) if name == "corridor" else (20.0, 20.0)
    spacing = np.sqrt(long * wide / 200)
    columns = int(np.ceil(long / spacing))
    place = np.array([(k % columns, k // columns) for k in range(200)]) * spacing + 0.5 * spacing
    place = np.clip(place + rng.uniform(-0.2, 0.2, (200, 2)), 0.3, (long - 0.3, wide - 0.3))
    if name == "corridor":
        goal = place + np.where(np.arange(200) // 2 % 2, 1.0, -1.0)[:, None] * (200.0, 0.0)
        return place, goal, np.where(np.arange(200) < 80, np.arange(200) // 2, -1)
    return place, place + 100.0 * (rng.uniform(-1, 1, (200, 2))), np.full(200, -1)


def clearway(name: str, steps: int) -> Callable[[], float]:
    """Our own kernels, called once a step for all."""
    from clearway.crowds import orca, social_force
    from clearway.crowds.bodies import Bodies, Wishes
    from clearway.crowds.walls import walls_of

    start, goal, group = scene(name)
    n = len(start)
    care = orca.Care(np.full(n, DISTANCE), np.full(n, NEIGHBOURS), np.full(n, HORIZON), np.full(n, WALL_HORIZON))
    walls, radius, ones = walls_of(WALLS if name == "corridor" else []), np.full(n, RADIUS), np.ones(n, np.int64)

    def run() -> float:
        place, velocity, spent = start.copy(), _towards(goal, start), 0.0
        for _ in range(steps):
            wish = _towards(goal, place)
            began = time.process_time()
            bodies = Bodies(place, velocity, radius, ones, np.full(n, 0.5))
            wishes = Wishes(np.arange(n), wish, np.full(n, V_MAX), ones)
            if RIVALS[name] == "pyrvo":
                velocity = orca.velocities(bodies, wishes, care, walls, PERIOD)
            else:
                velocity = social_force.velocities(bodies, wishes, group, social_force.MOUSSAID, walls, PERIOD)
            place = place + PERIOD * velocity
            spent += time.process_time() - began
        return spent

    return run


def pysocialforce(name: str, steps: int) -> Callable[[], float]:
    """PySocialForce as it is, with its own parameters."""
    import logging

    directory = os.getcwd()
    os.chdir(tempfile.gettempdir())  # on import it opens a log file where it is
    import pysocialforce as theirs

    os.chdir(directory)
    logging.disable(logging.CRITICAL)
    start, goal, group = scene(name)
    groups = [np.flatnonzero(group == g).tolist() for g in sorted(set(group[group >= 0]))]
    walls = [(a[0], b[0], a[1], b[1]) for a, b in WALLS] if name == "corridor" else None

    def run() -> float:
        state = np.column_stack((start, _towards(goal, start), goal))
        simulator = theirs.Simulator(state, groups=groups or None, obstacles=walls)
        simulator.peds.step_width = PERIOD
        simulator.step(1)
        began = time.process_time()
        simulator.step(steps)
        return time.process_time() - began

    return run


def pyrvo(name: str, steps: int) -> Callable[[], float]:
    """RVO2 by its Python binding pyrvo."""
    import pyrvo as theirs

    start, goal, _ = scene(name)
    n = len(start)

    def run() -> float:
        rvo = theirs.RVOSimulator(PERIOD, DISTANCE, NEIGHBOURS, HORIZON, WALL_HORIZON, RADIUS, V_MAX)
        for place in start:
            rvo.add_agent(tuple(place))
        spent = 0.0
        for _ in range(steps):
            at = [rvo.get_agent_position(i) for i in range(n)]
            for i, wish in enumerate(_towards(goal, np.array([(p.x, p.y) for p in at]))):
                rvo.set_agent_pref_velocity(i, tuple(wish))
            began = time.process_time()
            rvo.do_step()
            spent += time.process_time() - began
        return spent

    return run


def _towards(goal: np.ndarray, place: np.ndarray) -> np.ndarray:
    away = goal - place
    return away / np.maximum(np.hypot(*away.T)[:, None], WISH * PERIOD) * WISH


def measured(side: str, name: str, steps: int, rounds: int) -> list[float]:
    """Steps of everybody per second, a round each."""
    run = {"clearway": clearway, "pysocialforce": pysocialforce, "pyrvo": pyrvo}[side](name, steps)
    run()  # compiles
    return [steps / run() for _ in range(rounds)]


def asked_of(python: str, side: str, name: str, steps: int) -> float | None:
    """The same in a process of its own; None: it lacks the package."""
    command = [python, __file__, "--side", side, "--scene", name, "--steps", str(steps)]
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ | {"OMP_NUM_THREADS": "1"})
    if done.returncode == 3:
        return None
    if done.returncode != 0:
        raise SystemExit(f"{side} failed in the scene {name!r}:\n{done.stderr[-2000:]}")
    return float(done.stdout.splitlines()[-1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rivals", default=sys.executable, metavar="PYTHON")
    parser.add_argument("--steps", type=int, default=50)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--smoke", action="store_true", help="one round of three steps")
    parser.add_argument("--side", help=argparse.SUPPRESS)
    parser.add_argument("--scene", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.side:
        if asked.side != "clearway" and importlib.util.find_spec(asked.side) is None:
            raise SystemExit(3)
        print(max(measured(asked.side, asked.scene, asked.steps, 2)))
        return
    steps, rounds = (3, 1) if asked.smoke else (asked.steps, asked.rounds)
    found: list[dict[str, Any]] = []
    for name, rival in RIVALS.items():
        pairs = [
            (asked_of(sys.executable, "clearway", name, steps), asked_of(asked.rivals, rival, name, steps))
            for _ in range(rounds)
        ]
        ours = max(o for o, _ in pairs if o is not None)
        theirs = max((t for _, t in pairs if t is not None), default=None)
        ratio = None if theirs is None else ours / theirs
        found.append({"scene": name, "clearway": ours, "rival": rival, "theirs": theirs, "ratio": ratio})
        if not asked.json:
            n = len(scene(name)[0])
            beside = f"{rival} is missing" if theirs is None else f"{rival} {theirs:,.0f}, {ratio:.2f} times"
            aim = f" (aim: {AIMS[name]:g})" if name in AIMS else ""
            print(f"{name}, {n}: {ours:,.0f} steps/s; {beside}{aim}", flush=True)
    if asked.json:
        print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
