"""How fast a ward full of people is simulated: simulated seconds per second of one core, by their number.

Runs whole trials of the suite `ward-day` (world with exact contact, people by social forces, lidar, odometry; AMCL, tracker, navigator)
after the same once, which compiles, warms up and finds out when people come to where they go without a robot: all trials of a scenario
share that. Measures the CPU time of the thread, so that other work on the machine does not count. A trial that fails early counts with
the time that it lasted. Once it is over people walk on to where they were going, up to two minutes, for what the robot cost them: what
that takes is told apart, as none of these seconds are counted as simulated.

    python benchmarks/ward_speed.py [--robot NAME] [--navigator NAME] [--people N ...] [--task NAME ...] [--seconds S] [--json] [--smoke]
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from contextlib import contextmanager
from time import thread_time
from typing import Any
from unittest import mock

AIM = 20.0
"""Simulated seconds per second that the project aims for, among 40 people with hp-st and lidar."""


@contextmanager
def walking_on() -> Iterator[list[float]]:
    """Meanwhile a list is filled with the CPU time that people's walking on takes once a trial is over, s."""
    from clearway.world.traffic import Traffic

    took: list[float] = []
    own = Traffic.walk_on

    def timed(traffic: Traffic) -> dict[int, int]:
        begin = thread_time()
        try:
            return own(traffic)
        finally:
            took.append(thread_time() - begin)

    with mock.patch.object(Traffic, "walk_on", timed):
        yield took


def measure(robot_name: str, navigator: str, number: int, tasks: list[str], seconds: float | None) -> dict[str, Any]:
    """Run one trial of each task, each leg at most so many `seconds`, and return what they took."""
    import clearway
    from clearway.robots import load_robot
    from clearway.scenarios.suites import Selection, load_suite

    robot = load_robot(robot_name)
    chosen = Selection(batches=(f"people-{number}",), configurations=tuple(tasks), repetitions=1)
    scenarios = load_suite("ward-day").build(robot, chosen)
    if seconds is not None:
        scenarios = [
            s.model_copy(update={"legs": tuple(leg.model_copy(update={"time_limit": seconds}) for leg in s.legs)})
            for s in scenarios
        ]
    simulated, total, after, outcomes = 0.0, 0.0, 0.0, []
    for i, scenario in enumerate([*scenarios, *scenarios]):
        with walking_on() as walked:
            begin = thread_time()
            trial = clearway.simulate(scenario, robot, navigator)
        if i < len(scenarios):
            continue
        total += thread_time() - begin
        after += sum(walked)
        simulated += float(trial.t[-1])
        outcomes.append(trial.outcome.value)
    return {
        "people": number,
        "outcomes": {o: outcomes.count(o) for o in sorted(set(outcomes))},
        "simulated_s": simulated,
        "cpu_s": total,
        "walking_on_cpu_s": after,
        "simulated_s_per_s": simulated / (total - after),
        "with_walking_on": simulated / total,
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robot", default="tiago")
    parser.add_argument("--navigator", default="hp-st")
    parser.add_argument("--people", type=int, nargs="+", default=[0, 10, 40])
    parser.add_argument("--task", nargs="+", default=["medicine", "guide", "samples"])
    parser.add_argument("--seconds", type=float, help="that a leg may take; without it as long as the suite says")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--smoke", action="store_true", help="one task among few people: only to see that it runs")
    given = parser.parse_args()
    if given.smoke:
        given.people, given.task, given.navigator = [2], ["samples"], "orca"
    found = [measure(given.robot, given.navigator, number, given.task, given.seconds) for number in given.people]
    if given.json:
        print(json.dumps({"aim": AIM, "trials": found}))
        return
    print(f"{given.robot} with {given.navigator}, {', '.join(given.task)}; aim among 40 people with hp-st: {AIM:.0f}")
    for one in found:
        print(
            f"  {one['people']:3d} people: {one['simulated_s_per_s']:5.1f} simulated seconds per second of one core"
            f" ({one['with_walking_on']:.1f} with what people walk on afterwards; {one['simulated_s']:.0f} s, {one['outcomes']})"
        )


if __name__ == "__main__":
    main()
