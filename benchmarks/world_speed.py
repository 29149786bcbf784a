"""How fast the world alone is, in control periods per second, beside IR-SIM and navground on the same scene.

One robot (0.2 m) circles in a room of 10 x 10 m among 16 discs (0.2 m) that go to and fro on lanes; a lidar of
180 beams around, 10 m, 1 cm of noise; 0.1 s a period; a navigator that always gives the same command. Clearway runs a
whole trial: ten plant steps a period with exact contact, odometry, lidar, recording. IR-SIM and navground make one
step a period and one scan. CPU time of one process each, the best of several rounds, in turns.

With `--people` the discs walk their lanes by ORCA, and see each other and the robot, in Clearway among neighbours within 10 m, in
navground within 5 m: they decide each 0.1 s, and once more each 0.05 s (`20Hz`; two of navground's steps a period), as is usual in
Clearway; IR-SIM is left out. Who decides as often is set beside each other.

With `--learning` too, and Clearway is 16 of its Gymnasium environments in one kernel (`make_vec`): what is seen comes back as an array, and
the action is a learner's; IR-SIM's discs go by its `rvo`. A step is then what a learner calls one in one of them, the beginnings of
episodes of a minute counted in. Beside them stand the environments of robot_sf, whose people walk the same lanes by social force, and
CrowdNav, whose people cross the room by ORCA of Python-RVO2, where a step is 0.25 s and there is no lidar. CrowdNav's `gym`, of which it
takes a base class and a list of names, is gymnasium here. People of all three decide once a step.

With `--alone` there are no discs. With `--before` the rival is an earlier Clearway, on rails or alone.

    python benchmarks/world_speed.py [--people | --learning | --alone] [--rivals PYTHON ... | --before FOLDER] [--steps N] [--rounds N]
                                     [--json] [--smoke]

`--rivals`: one or more Pythons that have the packages ir-sim and navground, with `--learning` also robot_sf (its `pysocialforce` is another
one than PyPI's) and crowd_sim of CrowdNav with rvo2; default: this one. The first that has a rival runs it; one that is missing is named.
`--before`: the folder in which the package of that Clearway lies.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import math
import os
import subprocess
import sys

from world_sides.ours import clearway, learner
from world_sides.theirs import crowd_sim, irsim, navground, robot_sf

AIM = {"irsim": 100.0, "navground": 1.0, "navground 20Hz": 1.0, "robot_sf": 50.0, "crowd_sim": 50.0, "before": 1 / 1.05}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rivals", default=[sys.executable], metavar="PYTHON", nargs="+")
    parser.add_argument("--steps", type=int, default=5000)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--smoke", action="store_true", help="few steps: only to see that it runs")
    parser.add_argument("--people", action="store_true", help="the discs decide, by ORCA")
    parser.add_argument("--only", choices=list(AIM), help=argparse.SUPPRESS)
    parser.add_argument("--learning", action="store_true", help="with --people: as a learner's environment")
    parser.add_argument("--alone", action="store_true", help="without discs")
    parser.add_argument("--before", metavar="FOLDER", help="an earlier Clearway, the only rival")
    options = parser.parse_args()
    if options.before and (options.people or options.learning):
        parser.error("--before is for the discs on rails, and for --alone")
    options.people |= options.learning
    if options.smoke:
        options.steps, options.rounds = 200, 1
        learner(options.steps)()
    if options.only:
        return _serve(options.only, options.steps, options.people, options.alone)

    ours = {
        "clearway": learner(options.steps)
        if options.learning
        else clearway(options.steps, options.people, alone=options.alone)
    }
    if options.people:
        ours["clearway 20Hz"] = (
            learner(options.steps, 0.05) if options.learning else clearway(options.steps, True, 0.05)
        )
    for once in ours.values():
        once()  # compiles
    rivals = {name: _start(name, options) for name in AIM if name not in _left_out(options)}
    best = dict.fromkeys(ours, math.inf) | {name: math.inf for name, process in rivals.items() if process}
    for _ in range(options.rounds):
        for name, once in ours.items():
            best[name] = min(best[name], once())
        for name, process in rivals.items():
            if process:
                best[name] = min(best[name], _ask(process))
    for process in filter(None, rivals.values()):
        _ask(process, "stop\n")
        process.wait()

    beside = {
        name: "clearway 20Hz" if name.endswith("20Hz") and "clearway 20Hz" in ours else "clearway" for name in rivals
    }
    result = {"steps_per_second": {name: 1 / seconds for name, seconds in best.items()},
              "ratio": {name: best[name] / best[beside[name]] for name in rivals if name in best},
              "missing": [name for name in rivals if name not in best]}  # fmt: skip
    if options.json:
        print(json.dumps(result))
        return 0
    print(f"{'world':<14} {'steps/s':>10} {'us/step':>10}")
    for name, seconds in best.items():
        aim = 50.0 if options.learning and name == "irsim" else AIM.get(name)
        ratio = f"{beside[name]} is {result['ratio'][name]:.3g} x as fast (aim: {aim:.3g} x)" if name in beside else ""
        print(f"{name:<14} {1 / seconds:>10.0f} {seconds * 1e6:>10.1f}   {ratio}")
    for name in result["missing"]:
        print(f"{name:<14} is not installed for {' '.join(options.rivals)}, or fails there; left out")
    return 0


def _left_out(options: argparse.Namespace) -> tuple[str, ...]:
    if options.before or options.alone:
        return tuple(name for name in AIM if name != "before" or not options.before)
    if options.learning:
        return ("before",)
    return ("before", "robot_sf", "crowd_sim", "irsim" if options.people else "navground 20Hz")


def _start(name: str, options: argparse.Namespace) -> subprocess.Popen[str] | None:
    """A process that measures the rival each time it is asked; None if the rival can't be had."""
    more = ["--only", name, "--steps", str(options.steps), *["--people"] * options.people, *["--alone"] * options.alone]
    earlier = os.environ | {"PYTHONPATH": options.before or ""}
    for python in [sys.executable] if options.before else options.rivals:
        process = subprocess.Popen(
            [python, __file__, *more],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=earlier if options.before else None,
        )  # fmt: skip
        assert process.stdout
        for line in process.stdout:
            if line == "ready\n":
                return process
        process.wait()
    return None


def _ask(process: subprocess.Popen[str], what: str = "go\n") -> float:
    assert process.stdin
    assert process.stdout
    process.stdin.write(what)
    process.stdin.flush()
    for line in process.stdout:
        if line.startswith("took "):
            return float(line.split()[1])
    return math.inf


def _serve(name: str, steps: int, people: bool, alone: bool) -> int:
    package, *often = name.split()
    if package != "before" and importlib.util.find_spec(package) is None:
        return 1
    if package == "before":
        once = clearway(steps, people, alone=alone)
    elif package in ("robot_sf", "crowd_sim"):
        once = (robot_sf if package == "robot_sf" else crowd_sim)(steps)
    else:
        once = irsim(steps, people) if package == "irsim" else navground(steps, people, 2 if often else 1)
    once()
    print("ready", flush=True)
    for line in sys.stdin:
        if line != "go\n":
            break
        print(f"took {once()!r}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
