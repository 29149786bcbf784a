"""Where a robot was, from its own scans and odometry: AMCL forth and back through the recording.

A filter that runs along with the robot knows only what came before. Here all of it is known, so the filter runs several times
forth from where the robot was put, and as often back from where that ends, with other random numbers. At every update the two means are
weighted by how sure each is. Between updates the odometry is followed, and what the map corrects is spread over the way
between them, so that the path has no jumps.

The uncertainty is that of the particles, and how far the runs lie apart; `benchmarks/offline_localisation.py` holds it against the truth.
What neither shows is a map that is wrong, or scaled: the share of beams that end at one of its walls is told for that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.ndimage import distance_transform_edt
from scipy.spatial.transform import Rotation

from clearway.contract import Goal, Scan, Sensing, Task
from clearway.errors import ClearwayError
from clearway.geometry.frames import compose, relative
from clearway.geometry.grid import OCCUPIED, OccupancyGrid
from clearway.geometry.shapes import FloatArray
from clearway.perception import Amcl, AmclParameters
from clearway.recordings.recording import Sweeps, Track
from clearway.robots import Robot

RUNS = 4
"""Forth, and as many back."""
UPDATE = (0.05, 0.05)
"""m, rad of motion before an update; nothing has to keep up with the robot."""
ODOMETER = {
    "odom_model_type": "diff-corrected",
    "odom_alpha1": 0.02,
    "odom_alpha2": 0.002,
    "odom_alpha3": 0.08,
    "odom_alpha4": 0.002,
}
"""For a robot whose file has AMCL's older model `diff`: its noise falls with the square of a step, so that with many small ones there is
none. The values are those of TIAGo's public amcl.yaml."""
BEAMS = 60
"""Of a scan that are used, at least."""
WALL = 0.15
"""m; a beam that ends so near to a wall of the map agrees with it."""
FITS, LOST = 0.5, 0.25
"""Share of beams that agree: below the first, taken over all updates, it is the wrong map or start; below the second, over `LONG`, the
robot is lost there."""
LONG = 2.0
"""s"""
DRIFT = 0.1
"""Of the way to the nearest update, by which the odometry is taken to be wrong at most."""


@dataclass(frozen=True, slots=True, eq=False)
class Localised:
    """Where the robot was.

    Attributes:
        t: (n,) s, the odometry's stamps.
        pose: (n, 3) x, y [m], theta [rad] in the map; NaN where it was lost.
        sigma: (n, 2) standard uncertainty of position [m] and heading [rad]; NaN where it was lost.
        updates: (k,) s, when scan and map were compared.
        agreement: (k,) share of the beams that end at a wall of the map.
        notes: What was done and noticed, in sentences.
    """

    t: FloatArray
    pose: FloatArray
    sigma: FloatArray
    updates: FloatArray
    agreement: FloatArray
    notes: tuple[str, ...]


def localise(
    odometry: Track,
    sweeps: Sweeps,
    map: OccupancyGrid,
    start: FloatArray,
    robot: Robot,
    *,
    within: tuple[float, float] = (0.5, 0.26),
    seed: int = 0,
) -> Localised:
    """Where a robot was by its scans, its odometry and a map.

    Args:
        odometry: Its dead reckoning, with orientations.
        sweeps: Scans of its lidar, with where that is mounted.
        map: Of the floor.
        start: (3,) where the robot was when the recording begins, in the map: x, y [m], theta [rad].
        robot: Whose parameters of AMCL are used.
        within: Standard uncertainty of `start`: m, rad.
        seed: Of the filters' random numbers.

    Raises:
        ClearwayError: There is no heading, no mount, nothing that both saw, or the scans don't fit the map from that start.
    """
    known = np.isfinite(odometry.position[:, :2]).all(axis=1)
    if odometry.orientation is None or not known.any():
        raise ClearwayError("has no orientations: dead reckoning needs them", field="odometry")
    if sweeps.mount is None:
        raise ClearwayError("nothing says where the lidar sits on the robot; give its mount", field=sweeps.frame)
    known &= np.isfinite(odometry.orientation).all(axis=1)
    t = odometry.t[known]
    odom = _planar(odometry.position[known], odometry.orientation[known])
    inside = np.flatnonzero((sweeps.t >= t[0]) & (sweeps.t <= t[-1])) if len(t) > 1 else np.zeros(0, dtype=int)
    if len(inside) < 2:
        raise ClearwayError("there are no two scans while the odometry was recorded", field="scan")
    at = _between(t, odom, sweeps.t[inside])
    scans = [_scan(sweeps, i) for i in inside.tolist()]
    rng = np.random.default_rng(seed)
    p = AmclParameters.read(robot)
    odometer = {} if p.odom_model_type == "diff-corrected" else ODOMETER
    p = p.model_copy(
        update=odometer
        | {
            "update_min_d": UPDATE[0],
            "update_min_a": UPDATE[1],
            "resample_interval": 1,
            "laser_max_beams": max(BEAMS, p.laser_max_beams),
            "recovery_alpha_slow": 0.0,
            "recovery_alpha_fast": 0.0,
        }
    )
    forth = _pass(p, map, robot, np.asarray(start, dtype=np.float64), np.array(within), scans, at, rng)
    end, sure = forth.mean[-1], np.sqrt(np.maximum(forth.variance[-1], 1e-6))
    back = _pass(p, map, robot, end, 2.0 * sure, scans[::-1], at[::-1], rng).reversed(len(scans))
    k, mean, variance = _joined(forth, back, at)
    agreement = np.array([_agreement(map, scans[i], pose) for i, pose in zip(k, mean, strict=True)])
    fits = float(np.median(agreement))
    if fits < FITS:
        raise ClearwayError(
            f"only {100 * fits:.0f} % of the beams end within {WALL} m of a wall of the map: another map, another start, a mount that is not"
            " the lidar's, or a floor that has changed",
            field="start",
        )
    when = sweeps.t[inside][k]
    pose, sigma = _followed(t, odom, when, _between(t, odom, when), mean, variance, map.resolution)
    notes = [
        f"localised by {len(k)} of {len(sweeps.t)} scans, {RUNS} times forth and back; {100 * fits:.0f} % of their beams end within {WALL} m of"
        f" a wall, at worst {100 * agreement.min():.0f} %"
    ]
    for a, b in _stretches(when, agreement < LOST):
        lost = (t >= a) & (t <= b)
        pose[lost], sigma[lost] = np.nan, np.nan
        notes.append(f"lost from {a:.1f} s to {b:.1f} s: hardly a beam ends at a wall; left open")
    return Localised(t, pose, sigma, when, agreement, tuple(notes))


@dataclass(frozen=True, slots=True, eq=False)
class _Pass:
    """What the filters of one direction say at their updates: numbers of the scans (k,), means (k, 3), variances (k, 2) of
    position along one axis [m^2] and heading [rad^2]."""

    scan: npt.NDArray[np.intp]
    mean: FloatArray
    variance: FloatArray

    def reversed(self, count: int) -> _Pass:
        """The same with the scans counted from the other end."""
        return _Pass((count - 1 - self.scan)[::-1], self.mean[::-1], self.variance[::-1])


def _pass(
    p: AmclParameters,
    map: OccupancyGrid,
    robot: Robot,
    start: FloatArray,
    within: FloatArray,
    scans: Sequence[Scan],
    odom: FloatArray,
    rng: np.random.Generator,
) -> _Pass:
    cov = {"initial_cov_xx": within[0] ** 2, "initial_cov_yy": within[0] ** 2, "initial_cov_aa": within[1] ** 2}
    goal, still = Goal(np.zeros(3), 0.0, 0.0), np.zeros(2)
    found: list[list[FloatArray]] = []
    for _ in range(RUNS):
        filter_ = Amcl(p.model_copy(update=cov))
        filter_.reset(Task(0.1, 1.0, start, map), robot, rng)
        row: list[FloatArray] = []
        for i, (scan, pose) in enumerate(zip(scans, odom, strict=True)):
            before = filter_.updates
            estimate = filter_.update(Sensing(0.0, pose, still, scan, None, goal, pose))
            if filter_.updates > before:
                c = filter_.covariance()
                row.append(np.array((i, *estimate, (c[0, 0] + c[1, 1]) / 2, c[2, 2])))
        found.append(row)
    runs = np.array(found)  # which scans are used depends on the odometry alone
    x, y = runs[:, :, 1].mean(axis=0), runs[:, :, 2].mean(axis=0)
    turn = np.exp(1j * runs[:, :, 3])
    theta = np.angle(turn.mean(axis=0))
    apart = (runs[:, :, 1].var(axis=0) + runs[:, :, 2].var(axis=0)) / 2
    turned = (_wrapped(runs[:, :, 3] - theta) ** 2).mean(axis=0)
    variance = np.column_stack((runs[:, :, 4].mean(axis=0) + apart, runs[:, :, 5].mean(axis=0) + turned))
    return _Pass(runs[0, :, 0].astype(np.intp), np.column_stack((x, y, theta)), variance)


def _joined(forth: _Pass, back: _Pass, odom: FloatArray) -> tuple[npt.NDArray[np.intp], FloatArray, FloatArray]:
    """Numbers of the scans (k,), means (k, 3) and variances (k, 2) of both directions, at the updates that go forth.

    What goes back updates at other scans: its nearest is carried over by the odometry `odom` (m, 3) at the scans. The two see the same
    walls, so the variance is that of the surer one at best; where they lie apart, half of that is added.
    """
    behind = np.clip(np.searchsorted(back.scan, forth.scan), 1, max(1, len(back.scan) - 1))
    near = np.where(
        np.abs(back.scan[behind - 1] - forth.scan) <= np.abs(back.scan[behind % len(back.scan)] - forth.scan),
        behind - 1,
        behind % len(back.scan),
    )
    steps = [relative(odom[back.scan[n]], odom[i]) for n, i in zip(near, forth.scan, strict=True)]
    other = np.array([compose(back.mean[n], step) for n, step in zip(near, steps, strict=True)])
    gone = np.array([DRIFT * (np.hypot(step[0], step[1]) + 0.5 * abs(step[2])) for step in steps])
    variance = back.variance[near] + gone[:, None] ** 2
    share = forth.variance / (forth.variance + variance)
    off = np.column_stack((other[:, :2] - forth.mean[:, :2], _wrapped(other[:, 2] - forth.mean[:, 2])))
    mean = forth.mean + share[:, [0, 0, 1]] * off
    mean[:, 2] = _wrapped(mean[:, 2])
    apart = np.column_stack(((off[:, :2] ** 2).sum(axis=1) / 2, off[:, 2] ** 2)) * share * (1 - share)
    return forth.scan, mean, np.minimum(forth.variance, variance) + apart


def _followed(
    t: FloatArray,
    odom: FloatArray,
    when: FloatArray,
    at: FloatArray,
    mean: FloatArray,
    variance: FloatArray,
    cell: float,
) -> tuple[FloatArray, FloatArray]:
    """Poses (n, 3) and standard uncertainties (n, 2) at every sample of the odometry: carried on from the update before, and back
    from the one behind, each by how far the robot has come between them. A map tells where a wall is within half a `cell` [m]."""
    way = np.concatenate(
        ([0.0], np.cumsum(np.hypot(*np.diff(odom[:, :2], axis=0).T) + 0.5 * np.abs(_wrapped(np.diff(odom[:, 2])))))
    )
    marks = np.interp(when, t, way)
    after = np.clip(np.searchsorted(when, t, side="right"), 1, len(when) - 1)
    before = after - 1
    gone, whole = way - marks[before], marks[after] - marks[before]
    s = np.clip(np.where(whole > 1e-9, gone / np.where(whole > 1e-9, whole, 1.0), 0.5), 0.0, 1.0)
    one = np.array([compose(mean[k], relative(at[k], pose)) for k, pose in zip(before, odom, strict=True)])
    two = np.array([compose(mean[k], relative(at[k], pose)) for k, pose in zip(after, odom, strict=True)])
    pose = one + s[:, None] * np.column_stack((two[:, :2] - one[:, :2], _wrapped(two[:, 2] - one[:, 2])))
    pose[:, 2] = _wrapped(pose[:, 2])
    away = DRIFT * np.minimum(np.abs(way - marks[before]), np.abs(way - marks[after]))
    spread = variance[before] + s[:, None] * (variance[after] - variance[before])
    return pose, np.sqrt(spread + np.column_stack((away**2 + cell**2 / 4, away**2)))


def _agreement(map: OccupancyGrid, scan: Scan, pose: FloatArray) -> float:
    """Share of the beams with a return that end near a wall of the map, seen from `pose`."""
    returned = np.isfinite(scan.ranges) & (scan.ranges > scan.range_min) & (scan.ranges < scan.range_max)
    angle = scan.angle_min + scan.angle_increment * np.flatnonzero(returned)
    eye = compose(pose, scan.mount)
    ranges = scan.ranges[returned]
    x, y = eye[0] + ranges * np.cos(angle + eye[2]), eye[1] + ranges * np.sin(angle + eye[2])
    col, row = (np.floor((v - o) / map.resolution).astype(np.int64) for v, o in zip((x, y), map.origin, strict=True))
    on = (row >= 0) & (col >= 0) & (row < map.data.shape[0]) & (col < map.data.shape[1])
    near = np.zeros(len(on), dtype=bool)
    near[on] = _distance(map)[row[on], col[on]] <= WALL
    return float(near.mean()) if len(near) else 0.0


_kept: list[tuple[OccupancyGrid, FloatArray]] = []


def _distance(map: OccupancyGrid) -> FloatArray:
    """m from each cell to the nearest wall."""
    if not _kept or _kept[0][0] is not map:
        _kept[:] = [(map, distance_transform_edt(map.data != OCCUPIED) * map.resolution)]
    return _kept[0][1]


def _stretches(when: FloatArray, lost: npt.NDArray[np.bool_]) -> list[tuple[float, float]]:
    """From when to when it was so, for `LONG` at least."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], lost, [False])).astype(int)))
    pairs = [(float(when[a]), float(when[b - 1])) for a, b in edges.reshape(-1, 2)]
    return [(a, b) for a, b in pairs if b - a >= LONG]


def _scan(sweeps: Sweeps, i: int) -> Scan:
    assert sweeps.mount is not None
    return Scan(
        np.ascontiguousarray(sweeps.ranges[i]),
        sweeps.angle_min,
        sweeps.angle_increment,
        sweeps.range_min,
        sweeps.range_max,
        np.asarray(sweeps.mount, dtype=np.float64),
    )


def _planar(position: FloatArray, orientation: FloatArray) -> FloatArray:
    """Poses (n, 3) on the floor: where the robot's own x points to."""
    ahead = Rotation.from_quat(orientation).apply([1.0, 0.0, 0.0])
    return np.column_stack((position[:, :2], np.arctan2(ahead[:, 1], ahead[:, 0])))


def _between(t: FloatArray, pose: FloatArray, when: FloatArray) -> FloatArray:
    """Poses (k, 3) at the times `when`, which lie within `t`."""
    theta = np.interp(when, t, np.unwrap(pose[:, 2]))
    return np.column_stack((np.interp(when, t, pose[:, 0]), np.interp(when, t, pose[:, 1]), _wrapped(theta)))


def _wrapped(angle: FloatArray) -> FloatArray:
    """The same directions in [-pi, pi)."""
    return np.asarray(np.remainder(angle + np.pi, 2 * np.pi) - np.pi)
