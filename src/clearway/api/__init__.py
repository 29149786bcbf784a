"""The Python interface: run campaigns and open their results.

import clearway
results = clearway.run("hospital", robots=["tiago"], navigators=["move-base"], batches=["NO"])
results.trials                                   # an Arrow table; .to_pandas(), .to_polars() in one call
results.figure("trajectories", batch="NO")       # a matplotlib figure
"""

from __future__ import annotations

from clearway.api.answers import accept, acceptance_plan, check_parameters, find_breaks, passable, requirement, tune
from clearway.api.campaigns import merge, recorded_people, rerun, resume, run, simulate
from clearway.api.live import Live, live_ros1, live_ros2
from clearway.api.recordings import score, watch
from clearway.api.results import Results, compare, open_results
from clearway.campaigns.rerun import Rerun
from clearway.improving.tuning import Tuning
from clearway.searching.breaks import Breaks

__all__ = [
    "Breaks", "Live", "Rerun", "Results", "Tuning", "accept", "acceptance_plan", "check_parameters", "compare", "find_breaks", "live_ros1", "live_ros2", "merge",
    "open_results", "passable", "recorded_people", "requirement", "rerun", "resume", "run", "score", "simulate", "tune", "watch",
]  # fmt: skip
