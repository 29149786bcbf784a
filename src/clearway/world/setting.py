"""Who moves, among what, as the compiled kernels of the world take it: the robot's state, its base, what stands, what moves."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.geometry.compiled import kernel, light
from clearway.geometry.held import Held
from clearway.geometry.packing import Packed
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import normal
from clearway.robots import Odometry
from clearway.robots.drive_limits import DriveLimits
from clearway.scenarios.scenario import DisturbanceSpec
from clearway.world.tracks import Tracks

STEP = 0.01
"""Longest step of the plant, s."""

# the state of a robot, a row of float64
X, Y, THETA, V, OMEGA, V_Y = 0, 1, 2, 3, 4, 5  # V_Y: to its left, m/s
ODOM_X, ODOM_Y, ODOM_THETA = 6, 7, 8
WAY = 9  # so many of them have a value at each step; measured velocities are those of a whole period
ODOM_V, ODOM_OMEGA, ODOM_V_Y = 9, 10, 11
TOLD = 12  # so many of them anybody but the plant asks for
ODOMETER, NEXT_CHECK, ELAPSED = 12, 13, 14  # m; the first reading at which a static body must be looked at; s
STEERING = 15  # angle of a car's front wheels to the left, rad
# what the base's controller sets its wheels to; a base that lags isn't there yet
SET_V, SET_OMEGA, SET_V_Y = 16, 17, 18
STATE = 19


class OdometryErrors(NamedTuple):
    """What the odometry of a trial makes of the wheels' motion; the drift's three are standard deviations.

    Attributes:
        distance: A metre of the wheels is told as so many.
        turn: A radian of the wheels is told as so many.
        curvature: Turn that is imagined per metre, rad/m.
        translation_per_metre: Drift, m per sqrt(m).
        rotation_per_metre: Drift, rad per sqrt(m).
        rotation_per_radian: Drift, rad per sqrt(rad).
        speed_noise: Of the measured velocities, as a share of them; negative: what the drift makes of them.
        yaw_rate_noise: Of the measured yaw rate beside that, rad/s per m/s.
    """

    distance: float
    turn: float
    curvature: float
    translation_per_metre: float
    rotation_per_metre: float
    rotation_per_radian: float
    speed_noise: float
    yaw_rate_noise: float


def odometry_errors(odometry: Odometry, key: np.uint64, turn_grip: float) -> OdometryErrors:
    """The errors of `odometry` in the trial of the random stream `key`: the systematic ones are drawn. Of its turns the base makes
    the share `turn_grip`, which a gyroscope tells."""
    return OdometryErrors(
        distance=1.0 + odometry.scale * normal(key, -1, 0),
        turn=(1.0 + odometry.turning * normal(key, -1, 1)) * (turn_grip if odometry.gyro else 1.0),
        curvature=odometry.curvature * normal(key, -1, 2),
        translation_per_metre=odometry.translation_per_metre,
        rotation_per_metre=odometry.rotation_per_metre,
        rotation_per_radian=odometry.rotation_per_radian,
        speed_noise=-1.0 if odometry.speed_noise is None else odometry.speed_noise,
        yaw_rate_noise=odometry.yaw_rate_noise,
    )


def disturbance_bounds(spec: DisturbanceSpec | None) -> FloatArray:
    """(5,) position [m], heading [rad], v [m/s], omega [rad/s], and 1 where it also moves a robot that stands."""
    if spec is None:
        return np.zeros(5)
    return np.array([spec.position, spec.heading, spec.velocity, spec.turn, float(spec.at_rest)])


class Vehicle(NamedTuple):
    """The robot that the plant moves, and what its wheels tell of it.

    Attributes:
        period: A control period, s.
        limits: Of its base.
        lag: Time constant with which its wheels follow what they are set to, s.
        grip: Of the way that its wheels turn, forwards or to its sides, which share it moves.
        turn_grip: The same of turns.
        errors: Of its odometry.
        odometry_key: The random stream of the odometry.
        bounds: (5,) see `disturbance_bounds`.
        disturbance_key: The random stream of the disturbance.
        outline: (k, 2) points of its footprint in its own frame, m.
        rim: By which they are thickened, m.
        reach: Radius around the frame's origin that no part of the footprint leaves, m.
    """

    period: float
    limits: DriveLimits
    lag: float
    grip: float
    turn_grip: float
    errors: OdometryErrors
    odometry_key: np.uint64
    bounds: FloatArray
    disturbance_key: np.uint64
    outline: FloatArray
    rim: float
    reach: float


class Still(NamedTuple):
    """The n bodies that stand still.

    Attributes:
        shapes: Packed in the map frame.
        boxes: (n, 4) around each, see `packing.boxes`.
        due: (n,) reading of the odometer up to which each needs no look, m; kept from period to period.
    """

    shapes: Packed
    boxes: FloatArray
    due: FloatArray


class Moving(NamedTuple):
    """The m bodies that move.

    Attributes:
        shapes: Packed, each in its own frame.
        tracks: Where they are, and when.
        since: (m,) time at which the clock of each began, s.
        slack: (m,) way for which each needs no look, m; kept from period to period.
        poses: (m, 3) now, map frame, NaN if absent; written at the end of each period.
    """

    shapes: Packed
    tracks: Tracks
    since: FloatArray
    slack: FloatArray
    poses: FloatArray


class Room(NamedTuple):
    """Room for what a kernel works with, made once: see `light`.

    Attributes:
        outline: (k, 2) the corners of the robot's footprint where it stands, m.
        shapes: (p, 2) the corners of the moving bodies where they stand, m.
        here: (3,) one pose of a moving body, m and rad.
        push: (5,) displacement of the robot, see `plant.disturb`.
    """

    outline: FloatArray
    shapes: FloatArray
    here: FloatArray
    push: FloatArray


def room_for(vehicle: Vehicle, moving: Moving) -> Room:
    """Room for this robot among these bodies."""
    return Room(np.empty_like(vehicle.outline), np.empty_like(moving.shapes.points), np.empty(3), np.zeros(5))


class Setting(NamedTuple):
    """Who moves, among what.

    Attributes:
        vehicle: The robot.
        still: What stands.
        moving: What moves.
        commands: (k, 4) what the base follows in the period that begins: since when, s after the period began, from 0 on and
            rising, inf where there is no more; forward speed, m/s; yaw rate, rad/s; speed to the left, m/s.
        way: (n + 1, WAY) what the robot's first states were at the ends of the last period's n steps; written in each
            period, after a contact only as far as it came.
        room: To work with.
    """

    vehicle: Vehicle
    still: Still
    moving: Moving
    commands: FloatArray
    way: FloatArray
    room: Room


@kernel
def hold(setting: Setting) -> Held[Setting]:
    """`setting`, as `between` takes it."""
    return Held(setting)


@light
def steps(period: float) -> int:
    """Into how many steps of the plant a control `period` [s] is cut."""
    return max(1, math.ceil(period / STEP - 1e-9))
