"""Grid mapping with a Rao-Blackwellised particle filter: GMapping's method (Grisetti, Stachniss, Burgard 2007).

Each particle is a path with a map of its own. A scan is matched with the particle's map, the particle moves to the
match (or to a pose drawn around it: `MappingParameters.proposal`) and is weighed by how well the scan fits; particles
are resampled when too few of them count. The map that comes out is drawn along the path of the best particle, from all
scans that were used.
"""

from __future__ import annotations

import numpy as np

from clearway.contract import Scan
from clearway.geometry.angles import wrap
from clearway.geometry.frames import compose, relative
from clearway.geometry.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from clearway.geometry.shapes import FloatArray
from clearway.perception import scan_matching as sm
from clearway.perception.parameters import MappingParameters

ENLARGE = 10.0
"""How much the map grows at a side where the robot sees beyond it, m (`ScanMatcher`'s enlarge step)."""


class GridMapper:
    """Builds an occupancy grid from odometry and scans, in the frame in which `start` is given.

    Args:
        parameters: Those of the robot's file.
        start: (3,) where the robot stands at the first scan.
        seed: That of the particles' draws.
        scan_matching: Without it, the scans are put where the odometry says.
    """

    def __init__(
        self, parameters: MappingParameters, start: FloatArray, seed: int, *, scan_matching: bool = True
    ) -> None:
        self.parameters = p = parameters
        self._matching = scan_matching
        self._rng = np.random.default_rng(seed)
        n = p.particles if scan_matching else 1
        self._poses = np.tile(np.asarray(start, dtype=np.float64), (n, 1))
        self._log_weights = np.zeros(n)  # since the last resampling
        self._total = np.zeros(n)  # since the start
        self._noise = np.array((p.srr, p.srt, p.str, p.stt))
        self._window = np.array((p.llsamplerange, p.llsamplestep, p.lasamplerange, p.lasamplestep))
        self._origin, rows, cols = _lattice(
            self._poses[0, :2] + (p.xmin, p.ymin), self._poses[0, :2] + (p.xmax, p.ymax), p.delta
        )
        self._cells = _empty(n, rows, cols)
        self._around = tuple(range(-p.kernelSize, p.kernelSize + 1))
        self._odom: FloatArray | None = None
        self._moved = self._turned = 0.0
        self._scans: list[FloatArray] = []
        self._past: list[FloatArray] = []  # poses (n, 3) after each scan, before resampling
        self._parents: list[np.ndarray] = []  # which of them each particle goes on from
        self._mount = np.zeros(3)

    def add(self, odom_pose: FloatArray, scan: Scan) -> bool:
        """Take in the odometry's pose (3,) and the scan made there; whether the robot had moved enough to use it."""
        p = self.parameters
        first = self._odom is None
        odom = np.asarray(odom_pose, dtype=np.float64).copy()
        if self._odom is None:
            self._odom = self._reference = odom
            self._settled = self._poses.copy()
        if self._matching:
            sm.predict(self._poses, self._odom, odom, self._noise, self._rng)
        else:
            self._poses[0] = compose(self._poses[0], relative(self._odom, odom))
        self._moved += float(np.hypot(*(odom - self._odom)[:2]))
        self._turned += abs(wrap(odom[2] - self._odom[2]))
        self._odom = odom
        if not first and self._moved < p.linearUpdate and self._turned < p.angularUpdate:
            return False

        beams = self._beams(scan)
        hits = beams[beams[:, 4] > 0.0]
        if not first and self._matching:
            self._match(hits[:: p.lskip + 1], odom)
        self._past.append(self._poses.copy())
        self._parents.append(self._resample())
        self._grow(hits)
        if self._matching:
            for i in range(len(self._poses)):
                sm.register(self._cells[i], self._origin, p.delta, hits, self._poses[i])
        self._scans.append(beams)
        self._settled, self._reference = self._poses.copy(), odom
        self._moved = self._turned = 0.0
        return True

    @property
    def pose(self) -> FloatArray:
        """The best particle's pose (3,)."""
        best: FloatArray = self._poses[int(np.argmax(self._total))]
        return best.copy()

    @property
    def path(self) -> FloatArray:
        """The best particle's poses (k, 3) at the scans that were used."""
        i = int(np.argmax(self._total))
        path = []
        for poses, parents in zip(reversed(self._past), reversed(self._parents), strict=True):
            i = int(parents[i])
            path.append(poses[i])
        return np.array(path[::-1]).reshape(-1, 3)

    def map(self) -> OccupancyGrid:
        """The map as seen along the best particle's path: occupied, free, or unknown where no beam went."""
        return render(self.path, self._scans, self._mount, self.parameters.delta, self.parameters.occ_thresh)

    def ranges(self, scan: Scan) -> tuple[float, float]:
        """How far a beam of such a scan may be to be used at all, and up to where it is then used, m."""
        farthest = min(self.parameters.maxRange or np.inf, scan.range_max - 0.01)
        return farthest, min(self.parameters.maxUrange or np.inf, farthest)

    def _beams(self, scan: Scan) -> FloatArray:
        farthest, usable = self.ranges(scan)
        self._mount = scan.mount
        return sm.beams(scan.ranges, scan.angle_min, scan.angle_increment, scan.mount, usable, farthest)

    def _match(self, hits: FloatArray, odom: FloatArray) -> None:
        p = self.parameters
        expected = relative(self._reference, odom)
        step = np.array((self._moved, self._turned))
        for i in range(len(self._poses)):
            where = (self._cells[i], self._origin, p.delta, hits)
            matched, score = sm.climb(*where, self._poses[i], self._around, p.sigma, p.lstep, p.astep, p.iterations)
            good = score > p.minimumScore  # else too poor a match: believe the odometry
            if good and p.proposal == "gaussian":
                centre = compose(self._settled[i], expected)
                self._poses[i], weight = sm.propose(
                    *where, matched, centre, step, self._noise, self._around, p.lsigma, self._window, self._rng
                )
            else:
                self._poses[i] = matched if good else self._poses[i]
                _, weight = sm.fit(*where, self._poses[i], self._around, 0.0, p.lsigma)
            self._log_weights[i] += weight
            self._total[i] += weight

    def _resample(self) -> np.ndarray:
        """Resample if too few particles count; which particle each one goes on from."""
        n = len(self._poses)
        same = np.arange(n)
        w = np.exp((self._log_weights - self._log_weights.max()) / (self.parameters.ogain * n))
        w /= w.sum()
        if 1.0 / float((w * w).sum()) >= self.parameters.resampleThreshold * n:
            return same
        at = (self._rng.random() + same) / n
        drawn = np.minimum(np.searchsorted(np.cumsum(w), at), n - 1)
        copies = np.bincount(drawn, minlength=n)
        parents = same.copy()
        spare = np.nonzero(copies == 0)[0]  # only these maps are overwritten
        parents[spare] = np.repeat(same, np.maximum(copies - 1, 0))
        for i in spare:
            self._cells[i] = self._cells[parents[i]]
        self._poses, self._total = self._poses[parents], self._total[parents]
        self._log_weights[:] = 0.0
        return parents

    def _grow(self, hits: FloatArray) -> None:
        """Enlarge the particles' maps where the scan ends beyond them."""
        if not self._matching:
            return
        delta = self.parameters.delta
        n, _, rows, cols = self._cells.shape
        low, high = self._origin, self._origin + delta * np.array((cols, rows))
        box = sm.extent(hits, self._poses, self._mount)
        margin = (self.parameters.kernelSize + 2) * delta
        short = np.array((low - box[:2], box[2:] - high)) + margin  # at the low and the high sides of x and y
        (left, below), (right, above) = (round(ENLARGE / delta) * np.ceil(np.maximum(short, 0.0) / ENLARGE)).astype(int)
        if left or below or right or above:
            cells = _empty(n, below + rows + above, left + cols + right)
            cells[:, :, below : below + rows, left : left + cols] = self._cells
            cells[:, :2] += delta * np.array((left, below), dtype=np.float32)[:, None, None]
            self._cells = cells
            self._origin = low - delta * np.array((left, below))


def _lattice(low: FloatArray, high: FloatArray, delta: float) -> tuple[FloatArray, int, int]:
    """Origin (2,), rows and columns of the cells between two corners (2,); as GMapping's, centred on multiples of delta."""
    first, last = np.round(low / delta).astype(int), np.round(high / delta).astype(int)
    cols, rows = (int(n) for n in last - first + 1)
    return (first - 0.5) * delta, rows, cols


def _empty(particles: int, rows: int, cols: int) -> sm.Cells:
    cells = np.full((particles, 3, rows, cols), np.inf, dtype=np.float32)
    cells[:, 2] = 0.0
    return cells


def render(
    path: FloatArray, scans: list[FloatArray], mount: FloatArray, delta: float, occ_thresh: float
) -> OccupancyGrid:
    """Draw the map that the scans give when they were made at the poses of a path.

    Args:
        path: (k, 3) poses of the robot.
        scans: k arrays (n, 5) of `scan_matching.beams`.
        mount: (3,) the sensor's pose in base_link.
        delta: Edge of a cell, m; cells are centred on its multiples.
        occ_thresh: A cell with a larger share of hits is a wall.
    """
    boxes = np.array([sm.extent(scan, path[k : k + 1], mount) for k, scan in enumerate(scans)]).reshape(-1, 4)
    origin, rows, cols = _lattice(boxes[:, :2].min(axis=0) - delta, boxes[:, 2:].max(axis=0) + delta, delta)
    hits, visits = np.zeros((rows, cols), dtype=np.int32), np.zeros((rows, cols), dtype=np.int32)
    for pose, scan in zip(path, scans, strict=True):
        sm.draw(hits, visits, origin, delta, mount, scan, pose)
    data = np.full((rows, cols), UNKNOWN, dtype=np.int8)
    data[visits > 0] = FREE
    data[hits > occ_thresh * visits] = OCCUPIED
    return OccupancyGrid(data, delta, (float(origin[0]), float(origin[1])))
