"""The world for learners: a Gymnasium environment of each suite, and PettingZoo's of several robots.

    import clearway.learning
    env = gymnasium.make("clearway/Hospital-v0", robot="tiago", beams=180)

It needs Gymnasium, and `make_team` PettingZoo: `pip install 'clearway[learning]'`.
"""

from __future__ import annotations

from functools import partial

import gymnasium

from clearway.learning.environment import Alone, make
from clearway.learning.rewards import Step, default_reward
from clearway.learning.team import Team, make_team
from clearway.learning.vector import Lanes, Steps, default_rewards, make_vec
from clearway.scenarios.suites import suite_names

__all__ = [
    "Alone", "Lanes", "Step", "Steps", "Team", "default_reward", "default_rewards", "environment_id", "make", "make_team", "make_vec",
]  # fmt: skip


def environment_id(suite: str) -> str:
    """Under which a suite is registered with Gymnasium: `clearway/SarCase1-v0` of `sar-case1`."""
    return f"clearway/{''.join(part[:1].upper() + part[1:] for part in suite.split('-'))}-v0"


for _suite in suite_names():
    gymnasium.register(environment_id(_suite), partial(make, _suite), order_enforce=False)
