"""A furnished room of boxes, a lidar and a drifting odometry in plain numpy: independent of Clearway's world."""

from __future__ import annotations

import numpy as np

from clearway.contract import Goal, Scan, Sensing
from clearway.geometry.grid import FREE, OCCUPIED, OccupancyGrid
from clearway.robots import Robot

# x0, y0, x1, y1: four walls 0.2 m thick on cell borders, a pillar, two tables, a cupboard
BOXES = np.array(
    [
        (-0.2, -0.2, 10.2, 0.0),
        (-0.2, 6.0, 10.2, 6.2),
        (-0.2, 0.0, 0.0, 6.0),
        (10.0, 0.0, 10.2, 6.0),
        (4.0, 4.5, 4.4, 4.9),
        (7.0, 0.0, 8.2, 0.6),
        (1.5, 5.2, 3.0, 6.0),
        (9.4, 3.5, 10.0, 5.0),
    ]
)
MOUNT = np.array((0.1, 0.0, 0.0))


def make_robot(**more: object) -> Robot:
    return Robot.model_validate(
        {
            "name": "box",
            "title": "Box",
            "d_base": 0.5,
            "footprint": {"kind": "circle", "radius": 0.25},
            "period": 0.1,
            "drive": {
                "v_max": 1.0,
                "v_min": 0.0,
                "acceleration": 1.0,
                "deceleration": 1.0,
                "omega_max": 1.0,
                "angular_acceleration": 2.0,
                "angular_deceleration": 2.0,
            },
            "lidar": {
                "beams": 181,
                "angle_min": -1.9,
                "angle_max": 1.9,
                "range_min": 0.05,
                "range_max": 12.0,
                "sigma": 0.01,
                "mount": [0.1, 0.0, 0.0],
            },
            "odometry": {"translation_per_metre": 0.01, "rotation_per_metre": 0.01, "rotation_per_radian": 0.01},
            "tolerances": {"xy": 0.2, "yaw": 0.2},
        }
        | more
    )


def room_map(resolution: float = 0.05) -> OccupancyGrid:
    origin = (-0.5, -0.5)
    rows, cols = round(7.0 / resolution), round(11.0 / resolution)
    y = origin[1] + (np.arange(rows) + 0.5)[:, None] * resolution
    x = origin[0] + (np.arange(cols) + 0.5)[None, :] * resolution
    data = np.full((rows, cols), FREE, dtype=np.int8)
    for x0, y0, x1, y1 in BOXES:
        data[(x > x0) & (x < x1) & (y > y0) & (y < y1)] = OCCUPIED
    return OccupancyGrid(data, resolution, origin)


def cast(pose: np.ndarray, robot: Robot, rng: np.random.Generator | None = None) -> Scan:
    """A scan by the slab method; noise-free without `rng`."""
    lidar = robot.lidar
    assert lidar is not None
    c, s = np.cos(pose[2]), np.sin(pose[2])
    eye = np.array((pose[0] + c * MOUNT[0], pose[1] + s * MOUNT[0]))
    angles = pose[2] + np.linspace(lidar.angle_min, lidar.angle_max, lidar.beams)
    with np.errstate(divide="ignore"):
        inverse = 1.0 / np.stack((np.cos(angles), np.sin(angles)), axis=1)  # (n, 2)
    a = (BOXES[:, None, :2] - eye) * inverse
    b = (BOXES[:, None, 2:] - eye) * inverse
    near, far = np.minimum(a, b).max(axis=2), np.maximum(a, b).min(axis=2)
    ranges = np.where((near <= far) & (near > 0), near, np.inf).min(axis=0)
    if rng is not None:
        ranges = ranges + lidar.sigma * rng.standard_normal(lidar.beams)
    ranges[(ranges < lidar.range_min) | (ranges > lidar.range_max)] = np.inf
    step = (lidar.angle_max - lidar.angle_min) / (lidar.beams - 1)
    return Scan(ranges, lidar.angle_min, step, lidar.range_min, lidar.range_max, MOUNT)


def drive(start: np.ndarray, commands: np.ndarray, robot: Robot, seed: int) -> list[Sensing]:
    """What the robot senses under (n, 2) commands v, omega, held for a period each; truth in small Euler steps."""
    rng = np.random.default_rng(seed)
    o = robot.odometry
    scale = 1.0 + o.scale * rng.standard_normal()
    goal = Goal(np.zeros(3), 0.2, 0.2)
    truth, odom = np.array(start, dtype=float), np.zeros(3)
    out = []
    for k, (v, omega) in enumerate(commands):
        out.append(
            Sensing(
                k * robot.period, odom.copy(), np.array((v, omega)), cast(truth, robot, rng), None, goal, truth.copy()
            )
        )
        d, a = v * robot.period, omega * robot.period
        for _ in range(20):
            truth += np.array((d / 20 * np.cos(truth[2]), d / 20 * np.sin(truth[2]), a / 20))
        d_odom = scale * d + o.translation_per_metre * np.sqrt(abs(d)) * rng.standard_normal()
        a_odom = a + rng.standard_normal() * np.sqrt(
            o.rotation_per_metre**2 * abs(d) + o.rotation_per_radian**2 * abs(a)
        )
        odom += np.array((d_odom * np.cos(odom[2] + a_odom / 2), d_odom * np.sin(odom[2] + a_odom / 2), a_odom))
    return out


def forth_and_back(speed: float = 0.6) -> np.ndarray:
    """Commands: 5 m forth, a half turn, 5 m back, at a period of 0.1 s."""
    straight = np.tile((speed, 0.0), (round(5.0 / speed / 0.1), 1))
    turn = np.tile((0.0, np.pi / 4.0), (40, 1))
    return np.vstack((straight, turn, straight))
