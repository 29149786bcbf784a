"""DWB's search: of all velocities that can be reached, the one whose trajectory costs least.

Behaviour after nav2_dwb_controller/dwb_core/src/dwb_local_planner.cpp. One difference in the order of work and none in the
outcome: what a trajectory costs at least, by its command and its end, is reckoned for all of them; those that can
still win are then judged whole, the most promising first.
"""

from __future__ import annotations

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import Scene
from clearway.navigators.nav2.controllers.dwb.critics import (
    BASE_OBSTACLE,
    ILLEGAL,
    OBSTACLE_FOOTPRINT,
    PATH_DIST,
    ROTATE_TO_GOAL,
    Critics,
    Ground,
    add_least,
    heading_at,
    of_command,
    of_places,
    prepare,
)
from clearway.navigators.nav2.controllers.dwb.generator import Kinematics, is_tried, steps_of, turn, velocities, walk


@kernel
def search(
    kinematics: Kinematics,
    critics: Critics,
    scene: Scene,
    pose: FloatArray,
    velocity: FloatArray,
    goal: FloatArray,
    path: FloatArray,
) -> tuple[float, FloatArray, FloatArray]:
    """The cheapest legal trajectory, the first of several: its cost (negative if there is none), command (3,) and places (k, 2).

    Args:
        pose: (3,) of the robot.
        velocity: (3,) measured: forwards, to the left, turning.
        goal: (3,) the whole path's last pose.
        path: (n, 3) that is followed.
    """
    ground = prepare(critics, scene, pose, goal, path)
    speeds = velocities(kinematics.x, kinematics.reach, velocity[0])
    sides = velocities(kinematics.y, kinematics.reach, velocity[1])
    turns = velocities(kinematics.w, kinematics.reach, velocity[2])
    n, across = speeds.size * sides.size * turns.size, sides.size * turns.size
    steps = np.zeros(n, np.int64)
    longest = 1
    for k in range(n):
        v, u, w = speeds[k // across], sides[k % across // turns.size], turns[k % turns.size]
        if is_tried(kinematics, v, u, w):
            steps[k] = steps_of(kinematics, v, u, w)
            longest = max(longest, steps[k])

    headings, nothing = np.empty((longest + 1, 3)), np.empty((0, 2))
    commands, ends = np.empty((n, 3)), np.empty((n, 5))
    bound = np.full(n, np.inf)
    begin_x, begin_y, now_v, now_u = pose[0], pose[1], velocity[0], velocity[1]
    for t in range(turns.size):
        w, laid, first_w = turns[t], 0, 0.0
        for k in range(t, n, turns.size):
            if steps[k] == 0:
                continue
            if steps[k] != laid:
                laid = steps[k]
                first_w = turn(kinematics, pose[2], velocity[2], w, laid, headings)
            v, u = speeds[k // across], sides[k % across // turns.size]
            x, y, first_v, first_u = walk(kinematics, begin_x, begin_y, now_v, now_u, v, u, laid, headings, nothing)
            ends[k, 0], ends[k, 1] = x, y
            ends[k, 2], ends[k, 3], ends[k, 4] = headings[laid, 0], headings[laid, 1], headings[laid, 2]
            if kinematics.first_step:
                commands[k, 0], commands[k, 1], commands[k, 2] = first_v, first_u, first_w
            else:
                commands[k, 0], commands[k, 1], commands[k, 2] = v, u, w
            bound[k] = 0.0
    add_least(critics, ground, commands, ends, bound)

    places = np.empty((longest + 1, 2))
    best, best_cost = -1, np.inf
    while True:
        k = int(np.argmin(bound))
        if bound[k] == np.inf or (best >= 0 and bound[k] > best_cost + 1e-9 * max(1.0, best_cost)):
            break
        bound[k] = np.inf
        _lay_out(kinematics, pose, velocity, speeds, sides, turns, k, steps[k], headings, places)
        cost = _whole(critics, ground, commands[k], places, headings, steps[k], kinematics)
        if cost >= 0.0 and (cost < best_cost or (cost == best_cost and k < best)):
            best, best_cost = k, cost
    if best < 0:
        return ILLEGAL, np.zeros(3), nothing
    _lay_out(kinematics, pose, velocity, speeds, sides, turns, best, steps[best], headings, places)
    return best_cost, commands[best].copy(), places[: steps[best] + 1]


@kernel
def _lay_out(
    kinematics: Kinematics,
    pose: FloatArray,
    velocity: FloatArray,
    speeds: FloatArray,
    sides: FloatArray,
    turns: FloatArray,
    k: int,
    steps: int,
    headings: FloatArray,
    places: FloatArray,
) -> None:
    """Lay out the k-th trajectory."""
    v, u = speeds[k // (sides.size * turns.size)], sides[k % (sides.size * turns.size) // turns.size]
    turn(kinematics, pose[2], velocity[2], turns[k % turns.size], steps, headings)
    walk(kinematics, pose[0], pose[1], velocity[0], velocity[1], v, u, steps, headings, places)


@kernel
def _whole(
    critics: Critics,
    ground: Ground,
    command: FloatArray,
    places: FloatArray,
    headings: FloatArray,
    steps: int,
    kinematics: Kinematics,
) -> float:
    """What a trajectory costs, summed up in the critics' order; ILLEGAL if one of them refuses it."""
    total = 0.0
    for i in range(critics.kind.size):
        kind, weight = critics.kind[i], ground.weights[i]
        if weight == 0.0:
            continue
        if kind < PATH_DIST and kind not in (BASE_OBSTACLE, OBSTACLE_FOOTPRINT):
            time = critics.values[i, 3] if kind == ROTATE_TO_GOAL else -1.0
            heading = heading_at(time, headings, steps, kinematics.sim_time)
            score = of_command(critics, i, command[0], command[1], command[2], heading)
        else:
            score = of_places(critics, i, ground, places, headings, steps, kinematics.twice)
        if score < 0.0:
            return ILLEGAL
        total += score * weight
    return total
