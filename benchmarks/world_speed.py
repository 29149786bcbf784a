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
takes a base class and a list of names, is gymnasium here.

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
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from clearway.robots import Robot
    from clearway.scenarios.scenario import Scenario

HALF, LANE_END, RADIUS, PERIOD, BEAMS, RANGE, SIGMA = 5.0, 4.5, 0.2, 0.1, 180, 10.0, 0.01
V, OMEGA = 0.3, 1.0
WORLDS, EPISODE = 16, 600  # of a learner: how many side by side, and periods in an episode
LANES = [((1 if i % 2 else -1) * (1.2 + 0.45 * (i // 2)), 0.5 + 0.05 * i) for i in range(16)]  # y [m], speed [m/s]
AIM = {"irsim": 100.0, "navground": 1.0, "navground 20Hz": 1.0, "robot_sf": 50.0, "crowd_sim": 50.0, "before": 1 / 1.05}


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


def learner(steps: int) -> Callable[[], float]:
    """Steps of `clearway.learning.make_vec`: 16 worlds in one kernel, an episode of a minute each."""
    import numpy as np

    from clearway.learning import make_vec

    walls = [
        {"name": f"wall {k}", "shape": {"kind": "rectangle", "length": 2 * HALF, "width": 0.1}, "pose": pose}
        for k, pose in enumerate(
            [(0, HALF + 0.05, 0), (0, -HALF - 0.05, 0), (HALF + 0.06, 0, math.pi / 2), (-HALF - 0.06, 0, math.pi / 2)]
        )
    ]
    robot, scenario = _scene(EPISODE, True, walls)
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


def irsim(steps: int, people: bool) -> Callable[[], float]:
    """`env.step` and `get_lidar_scan`, without drawing."""
    os.environ["MPLBACKEND"] = "Agg"
    import irsim as simulator
    import numpy as np

    discs = "".join(
        f"""
  - kinematics: {{name: 'omni'}}
    shape: {{name: 'circle', radius: {RADIUS}}}
    state: [{-LANE_END}, {y}, 0]
    vel_max: [{speed}, {speed}]
    behavior: {{name: '{"rvo" if people else "dash"}', wander: True, range_low: [{-LANE_END}, {y}, 0], range_high: [{LANE_END}, {y}, 0]}}"""
        for y, speed in LANES
    )
    corners = f"[[{-HALF}, {-HALF}], [{HALF}, {-HALF}], [{HALF}, {HALF}], [{-HALF}, {HALF}], [{-HALF}, {-HALF}]]"
    text = f"""
world: {{height: {2 * HALF}, width: {2 * HALF}, offset: [{-HALF}, {-HALF}], step_time: {PERIOD}, sample_time: {PERIOD},
        collision_mode: 'unobstructed'}}
robot:
  - kinematics: {{name: 'diff'}}
    shape: {{name: 'circle', radius: {RADIUS}}}
    state: [0, 0, 0]
    goal: [4, 4, 0]
    sensors:
      - {{type: 'lidar2d', range_min: 0, range_max: {RANGE}, angle_range: {2 * math.pi}, number: {BEAMS}, noise: True,
          std: {SIGMA}, angle_std: 0.0}}
obstacle:{discs}
  - shape: {{name: 'linestring', vertices: {corners}}}
    kinematics: {{name: 'static'}}
"""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.yaml"
        path.write_text(text, encoding="utf-8")
        world = simulator.make(str(path), display=False, disable_all_plot=True, log_level="ERROR")
    command, few = np.array([[V], [OMEGA]]), max(10, steps // 50)

    def once() -> float:
        before = time.process_time()
        for _ in range(few):
            world.step(command)
            assert len(world.get_lidar_scan()["ranges"]) == BEAMS
        return (time.process_time() - before) / few

    return once


def navground(steps: int, people: bool, updates: int = 1) -> Callable[[], float]:
    """So many `World.update` a period, then the lidar's update and its buffer: `World.run` would leave the lidar out."""
    import numpy as np
    from navground import core, sim

    world = sim.World()
    corners = [(-HALF, -HALF), (HALF, -HALF), (HALF, HALF), (-HALF, HALF)]
    for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
        world.add_wall(sim.Wall(np.array(a), np.array(b)))

    def agent(kinematics: object, speed: float, points: list[tuple[float, float]], at: tuple[float, float]) -> object:
        walks = people and speed != V
        behavior = core.Behavior.make_type("ORCA" if walks else "Dummy")
        behavior.kinematics, behavior.radius, behavior.optimal_speed = kinematics, RADIUS, speed
        task = sim.tasks.WaypointsTask(waypoints=points, loop=True, tolerance=0.1)
        made = sim.Agent(
            radius=RADIUS, behavior=behavior, kinematics=kinematics, task=task, control_period=PERIOD / updates
        )
        if walks:
            made.state_estimation = sim.state_estimations.BoundedStateEstimation(range=5.0)
        made.pose = core.Pose2(at, 0)
        world.add_agent(made)
        return made

    wheels = core.kinematics.TwoWheelsDifferentialDriveKinematics(max_speed=V, wheel_axis=2 * RADIUS)
    robot = agent(wheels, V, [(0.3, 0.0), (-0.3, 0.0)], (0.0, 0.0))
    for y, speed in LANES:
        kinematics = core.kinematics.OmnidirectionalKinematics(max_speed=speed)
        agent(kinematics, speed, [(LANE_END, y), (-LANE_END, y)], (-LANE_END, y))
    lidar = sim.state_estimations.LidarStateEstimation(
        range=RANGE, start_angle=-math.pi, field_of_view=2 * math.pi, resolution=BEAMS, error_std_dev=SIGMA
    )
    state = core.SensingState()
    lidar.prepare_state(state)
    world.run(10, PERIOD)

    def once() -> float:
        before = time.process_time()
        for _ in range(steps):
            for _ in range(updates):
                world.update(PERIOD / updates)
            lidar.update(robot, world, state)
            state.get_buffer("range").data  # noqa: B018
        return (time.process_time() - before) / steps

    return once


def robot_sf(steps: int) -> Callable[[], float]:
    """Steps of robot_sf's Gymnasium environment, with the beginnings of its episodes."""
    import logging

    import numpy as np
    from loguru import logger
    from robot_sf.gym_env.environment_factory import make_robot_env
    from robot_sf.gym_env.unified_config import RobotSimulationConfig
    from robot_sf.nav.global_route import GlobalRoute
    from robot_sf.nav.map_config import MapDefinition, MapDefinitionPool, SinglePedestrianDefinition
    from robot_sf.sensor.range_sensor import LidarScannerSettings

    logger.remove()
    logging.disable(logging.CRITICAL)
    wide = 2 * HALF
    corners = [(0.0, 0.0), (wide, 0.0), (wide, wide), (0.0, wide)]
    zones = [((x - 0.1, x - 0.1), (x + 0.1, x - 0.1), (x + 0.1, x + 0.1)) for x in (HALF, HALF + 4.0)]
    route = GlobalRoute(0, 0, [(HALF, HALF), (HALF + 4.0, HALF + 4.0)], *zones)
    people = [
        SinglePedestrianDefinition(
            id=f"p{k}", start=(HALF - LANE_END, HALF + y), speed_m_s=speed,
            trajectory=[(HALF + (-LANE_END if i % 2 else LANE_END), HALF + y) for i in range(20)],
        ) for k, (y, speed) in enumerate(LANES)
    ]  # fmt: skip
    room = MapDefinition(
        wide, wide, [], [zones[0]], [], [zones[1]], list(zip(corners, [*corners[1:], corners[0]], strict=True)), [route],
        [], [], [], single_pedestrians=people,
    )  # fmt: skip
    config = RobotSimulationConfig()
    config.map_pool = MapDefinitionPool(map_defs={"room": room})
    config.lidar_config = LidarScannerSettings(num_rays=BEAMS, max_scan_dist=RANGE)
    config.robot_config.radius = RADIUS
    assert config.sim_config.time_per_step_in_secs == PERIOD
    config.sim_config.sim_time_in_secs = EPISODE * PERIOD
    config.sim_config.ped_density_by_difficulty, config.sim_config.difficulty = [0.0], 0  # none beside these
    env = make_robot_env(config, seed=1)
    env.reset(seed=1)
    assert env.simulator.ped_pos.shape == (len(LANES), 2)
    command, few = np.array([0.1, 0.3], np.float32), max(10, steps // 5)  # of its accelerations, in shares

    def once() -> float:
        before = time.process_time()
        for _ in range(few):
            seen, _, terminated, truncated, _ = env.step(command)
            assert seen["rays"].shape[-1] == BEAMS
            if terminated or truncated:
                env.reset()
        return (time.process_time() - before) / few

    return once


def crowd_sim(steps: int) -> Callable[[], float]:
    """Steps of CrowdNav's environment, with the beginnings of its episodes."""
    import logging
    from configparser import RawConfigParser

    import gymnasium

    sys.modules |= {"gym": gymnasium, "gym.envs": gymnasium.envs, "gym.envs.registration": gymnasium.envs.registration}
    from crowd_sim.envs.crowd_sim import CrowdSim
    from crowd_sim.envs.policy.policy_factory import policy_factory
    from crowd_sim.envs.utils.action import ActionXY
    from crowd_sim.envs.utils.robot import Robot as CrowdNavsRobot

    logging.disable(logging.CRITICAL)
    agent = {"visible": "true", "radius": RADIUS, "v_pref": 1, "sensor": "coordinates"}
    config = RawConfigParser()
    config.read_dict({
        "env": {"time_limit": int(EPISODE * PERIOD), "time_step": 0.25, "val_size": 100, "test_size": 500, "randomize_attributes": "false"},
        "reward": {"success_reward": 1, "collision_penalty": -0.25, "discomfort_dist": 0.2, "discomfort_penalty_factor": 0.5},
        "sim": {"train_val_sim": "square_crossing", "test_sim": "square_crossing", "square_width": 2 * HALF, "circle_radius": 4,
                "human_num": len(LANES)},
        "humans": agent | {"policy": "orca"}, "robot": agent | {"policy": "none"},
    })  # fmt: skip
    env, robot = CrowdSim(), CrowdNavsRobot(config, "robot")
    env.configure(config)
    robot.set_policy(policy_factory["orca"]())  # it is asked nothing: the actions are ours
    env.set_robot(robot)
    env.reset("test")
    few = max(10, steps // 5)

    def once() -> float:
        before = time.process_time()
        for k in range(few):
            turned = OMEGA * 0.25 * k
            seen, _, done, _ = env.step(ActionXY(V * math.cos(turned), V * math.sin(turned)))
            assert len(seen) == len(LANES)
            if done:
                env.reset("test")
        return (time.process_time() - before) / few

    return once


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
    if options.people and not options.learning:
        ours["clearway 20Hz"] = clearway(options.steps, True, 0.05)
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
