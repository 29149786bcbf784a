"""Trials as if they had been recorded, and what their rows lack."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np

PEOPLE = {"person_distance", "social_time", "personal_time", "intimate_time", "person_speed", "person_ttc"}
DELAYS = {"people_delay", "people_delay_max", "people_detour"}
NEVER = {"barn_score", "barn_time", "PL_shortest", "CT_optimal", "cut", "jerk", "jerk_max"} | PEOPLE | DELAYS
SPEEDS = {"TCS", "TCS_5", "TCS_20", "TCS_U", "T_acceleration", "T_cruise", "T_approach", "T_rotation"}


def recorded(trial, *, sigma=(0.002, 0.004), moving_sigma=(0.001, 0.01), **changes):
    """The trial as if it had been measured; `sigma`: m and rad, of the robot and of moving_obstacles."""
    n, m = trial.moving_obstacles.shape[:2]
    known = np.empty((n, 1 + m, 2))
    known[:, 0], known[:, 1:] = sigma, moving_sigma
    attempt = replace(trial.attempt, source="recorded", scenario=None, seed=None, navigator="recorded", **changes)
    told = trial.provenance or {"legs": [f"{leg.name}: span given in the plan" for leg in attempt.legs]}
    return replace(trial, attempt=attempt, sigma=known, provenance=told)


def lost(row):
    return {name: why for name, why in json.loads(row["not_computable"]).items() if name not in NEVER}


def holed(trial, start, end, columns=slice(None)):
    """NaN in these columns of the pose between two times, both excluded."""
    pose = trial.pose.copy()
    inside = (trial.t > start + 1e-6) & (trial.t < end - 1e-6)
    pose[np.ix_(inside, np.arange(3)[columns])] = np.nan
    return replace(trial, pose=pose)
