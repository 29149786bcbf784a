"""The world for learners: a Gymnasium environment of each suite that a robot drives alone, and PettingZoo's of several robots.

    import clearway.learning
    env = gymnasium.make("clearway/Hospital-v0", robot="tiago", beams=180)

It needs Gymnasium, and `make_team` PettingZoo: `pip install 'clearway[learning]'`.
"""

from __future__ import annotations

import gymnasium

from clearway.errors import ClearwayError
from clearway.learning.environment import Alone, make
from clearway.learning.rewards import Step, default_reward
from clearway.learning.team import Team, make_team
from clearway.learning.vector import Lanes, Steps, default_rewards, make_vec
from clearway.scenarios.suites import load_suite, suite_names

__all__ = [
    "Alone", "Lanes", "Step", "Steps", "Team", "default_reward", "default_rewards", "environment_id", "make", "make_team", "make_vec",
]  # fmt: skip


def environment_id(suite: str) -> str:
    """Under which a suite that a robot drives alone is registered with Gymnasium: `clearway/SarCase1-v0` of `sar-case1`."""
    return f"clearway/{''.join(part[:1].upper() + part[1:] for part in suite.split('-'))}-v0"


def _for_one(suite: str) -> bool:
    """Whether a robot alone has something to do there."""
    try:
        return not load_suite(suite).several
    except ClearwayError:
        return True  # another package's, which is broken: who makes it is told


for _suite in filter(_for_one, suite_names()):
    gymnasium.register(environment_id(_suite), "clearway.learning:make", order_enforce=False, kwargs={"suite": _suite})
