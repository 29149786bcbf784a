"""The scene in each of the rivals, which are imported where they are asked for."""

from __future__ import annotations

import math
import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from world_sides.scene import BEAMS, EPISODE, HALF, LANE_END, LANES, OMEGA, PERIOD, RADIUS, RANGE, SIGMA, V


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
