"""Trees of transforms (tf, tf2): frames joined by transforms that move or stay, and how one frame moves in another.

As in tf2, a transform parent->child is the pose of the child in the parent, between two samples it is interpolated
(position linearly, orientation along the shortest arc), and before the first and after the last it is not known. A
static one holds always, and the last that was sent replaces those before (REP-105, tf2's design).
"""

from __future__ import annotations

from array import array
from collections import deque
from collections.abc import Iterable, Sequence

import numpy as np

from clearway.errors import ClearwayError, unknown
from clearway.geometry.shapes import FloatArray
from clearway.recordings.recording import Track
from clearway.recordings.times import in_order

ARROW = "->"
BASES = ("base_link", "base_footprint")
"""What robots call themselves, as in REP-105."""

Edge = tuple[str, str]
"""Parent and child."""


def split(name: str) -> Edge | None:
    """Parent and child of a `parent->child`, None if `name` is none."""
    parent, arrow, child = name.partition(ARROW)
    return (frame_name(parent), frame_name(child)) if arrow and parent.strip() and child.strip() else None


def frame_name(frame: str) -> str:
    """A frame's name without the leading slash that tf had and tf2 has not."""
    return frame.strip().lstrip("/")


class TransformTree:
    """Transforms as they come out of a recording."""

    def __init__(self) -> None:
        self._moving: dict[Edge, array[float]] = {}  # rows of t, x, y, z, qx, qy, qz, qw
        self._static: dict[Edge, tuple[float, ...]] = {}
        self._parents: dict[str, str] = {}
        self._several: set[str] = set()
        self._refused = 0
        self._only: frozenset[Edge] | None = None

    def add(self, parent: str, child: str, t: float, values: Sequence[float], *, static: bool = False) -> None:
        """A transform at `t` [s]: x, y, z [m], qx, qy, qz, qw. One without a rotation (a quaternion of zeros) is left out."""
        edge = (frame_name(parent), frame_name(child))
        q = values[3:]
        norm = sum(x * x for x in q)
        if not (1e-6 < norm < 1e6 and all(map(_finite, values))) or not all(edge) or edge[0] == edge[1]:
            self._refused += 1
            return
        if self._only is not None and edge not in self._only:
            return
        if self._parents.setdefault(edge[1], edge[0]) != edge[0]:
            self._several.add(edge[1])
        if static:
            self._static[edge] = tuple(values)
            return
        rows = self._moving.get(edge)
        if rows is None:
            rows = self._moving[edge] = array("d")
        rows.append(t)
        rows.extend(values)

    def settle(self, pairs: Iterable[Edge]) -> bool:
        """Whether all `pairs` are connected by now. If so, only the transforms between them are kept from here on: an arm's
        fifty joints would fill the memory for nothing."""
        ways = [self._way(*pair) for pair in pairs]
        if any(way is None for way in ways):
            return False
        self._only = frozenset(edge for way in ways for edge, _ in way or ())
        for edge in self._moving.keys() - self._only:
            del self._moving[edge]
        return True

    @property
    def frames(self) -> tuple[str, ...]:
        """Every frame's name, sorted."""
        return tuple(sorted({f for edge in self.edges for f in edge}))

    @property
    def edges(self) -> tuple[Edge, ...]:
        """Every transform's parent and child, sorted."""
        return tuple(sorted(self._moving.keys() | self._static.keys()))

    @property
    def moving(self) -> tuple[Edge, ...]:
        """Those that are not static."""
        return tuple(sorted(self._moving))

    @property
    def notes(self) -> tuple[str, ...]:
        """What was odd about the tree."""
        notes = []
        if self._refused:
            notes.append(
                f"{self._refused} transforms were left out: no rotation, not finite, or from a frame to itself"
            )
        notes += [f"the frame {f!r} has several parents; the shortest way is taken" for f in sorted(self._several)]
        return tuple(notes)

    def pairs(self) -> tuple[Edge, ...]:
        """Pairs that a reader would ask for: the robot's base in each frame that it can be known in, and what else moves
        directly in a root frame (such as a motion capture's bodies)."""
        children = {child for _, child in self.edges}
        roots = sorted({parent for parent, _ in self.edges} - children)
        base = next((b for b in BASES if b in self.frames), None)
        found = [(root, base) for root in [*roots, "odom"] if base and root != base]
        found += [edge for edge in self.moving if edge[0] in roots]
        return tuple(dict.fromkeys(e for e in found if self.moves(*e)))

    def connected(self, parent: str, child: str) -> bool:
        """Whether a way of transforms leads from one frame to the other."""
        return self._way(parent, child) is not None

    def moves(self, parent: str, child: str) -> bool:
        """Whether they are connected and something between them moves."""
        return any(edge in self._moving for edge, _ in self._way(parent, child) or ())

    def placed(self, child: str) -> tuple[FloatArray, FloatArray] | None:
        """Where a frame is on the robot's base, if only static transforms are between: position (3,) [m], quaternion (4,)."""
        for base in BASES:
            way = self._way(base, child) if base in self.frames and child in self.frames else None
            if way is None or any(edge not in self._static for edge, _ in way):
                continue
            p, q = np.zeros((1, 3)), np.array([[0.0, 0.0, 0.0, 1.0]])
            for edge, forward in way:
                at, turn = _constant(self._static[edge], 1)
                if not forward:
                    turn = turn * [-1.0, -1.0, -1.0, 1.0]
                    at = -rotate(turn, at)
                p, q = p + rotate(q, at), multiply(q, turn)
            return p[0], q[0]
        return None

    def track(self, parent: str, child: str, *, file: object = None) -> tuple[Track, tuple[str, ...]]:
        """How `child` moves in `parent`, at the stamps of the transform between them that was sent most often, and notes.

        Raises:
            ClearwayError: a frame is unknown (the closest is named), they are not connected, nothing between them
            moves, or their transforms were never known at the same time.
        """
        name = f"{parent}{ARROW}{child}"
        for frame in (parent, child):
            if frame not in self.frames:
                raise unknown("frame", frame, self.frames, file=file)
        way = self._way(parent, child)
        if way is None:
            raise ClearwayError(
                f"the frames are not connected; from {parent!r} one gets to {', '.join(self._reach(parent))};"
                f" from {child!r} to {', '.join(self._reach(child))}",
                file=file,
                field=name,
            )
        samples = {edge: self._sorted(edge, file) for edge, _ in way if edge in self._moving}
        if not samples:
            raise ClearwayError("nothing between these frames moves", file=file, field=name)
        notes = [note for _, n in samples.values() for note in n]
        t = max((rows[:, 0] for rows, _ in samples.values()), key=len)
        first = max(rows[0, 0] for rows, _ in samples.values())
        last = min((rows[-1, 0] for rows, _ in samples.values() if len(rows) > 1), default=np.inf)
        t = t[(t >= first) & (t <= last)]
        if not len(t):
            raise ClearwayError("the transforms between these frames were never known at once", file=file, field=name)
        position, q = np.zeros((len(t), 3)), np.tile([0.0, 0.0, 0.0, 1.0], (len(t), 1))
        for edge, forward in way:
            p, r = _at(samples[edge][0], t) if edge in samples else _constant(self._static[edge], len(t))
            if not forward:
                r = r * [-1.0, -1.0, -1.0, 1.0]
                p = -rotate(r, p)
            position = position + rotate(q, p)
            q = multiply(q, r)
        q /= np.linalg.norm(q, axis=1, keepdims=True)
        return Track("tf", parent, child, t, position, q), tuple(notes)

    def _sorted(self, edge: Edge, file: object) -> tuple[FloatArray, tuple[str, ...]]:
        rows = np.frombuffer(self._moving[edge]).reshape(-1, 8)
        keep, notes = in_order(rows[:, 0], file=file, field=ARROW.join(edge), sort=True)
        return rows[keep], tuple(n for n in notes if "out of order" in n)  # tf sends many twice

    def _neighbours(self) -> dict[str, list[tuple[str, Edge, bool]]]:
        near: dict[str, list[tuple[str, Edge, bool]]] = {}
        for edge in self.edges:
            near.setdefault(edge[0], []).append((edge[1], edge, True))
            near.setdefault(edge[1], []).append((edge[0], edge, False))
        return near

    def _way(self, parent: str, child: str) -> list[tuple[Edge, bool]] | None:
        """Transforms from `parent` to `child`, each with whether it is passed from its parent to its child."""
        near, came = self._neighbours(), {parent: (parent, ("", ""), True)}
        if parent not in near:
            return None
        waiting = deque([parent])
        while waiting and child not in came:
            at = waiting.popleft()
            for to, edge, forward in near[at]:
                if to not in came:
                    came[to] = (at, edge, forward)
                    waiting.append(to)
        if child not in came:
            return None
        way, at = [], child
        while at != parent:
            at, edge, forward = came[at]
            way.append((edge, forward))
        return way[::-1]

    def _reach(self, frame: str) -> list[str]:
        return [f for f in self.frames if f != frame and self._way(frame, f) is not None]


def multiply(a: FloatArray, b: FloatArray) -> FloatArray:
    """Products (n, 4) xyzw of quaternions a, b (n, 4): first b turns, then a."""
    v = a[:, 3:] * b[:, :3] + b[:, 3:] * a[:, :3] + np.cross(a[:, :3], b[:, :3])
    w = a[:, 3] * b[:, 3] - (a[:, :3] * b[:, :3]).sum(1)
    return np.column_stack([v, w])


def rotate(q: FloatArray, p: FloatArray) -> FloatArray:
    """Points p (n, 3) turned by unit quaternions q (n, 4) xyzw."""
    twice = 2.0 * np.cross(q[:, :3], p)
    turned: FloatArray = p + q[:, 3:] * twice + np.cross(q[:, :3], twice)
    return turned


def _at(rows: FloatArray, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Position (n, 3) and unit quaternion (n, 4) at `t`, which lie within the rows' times."""
    if len(rows) == 1:
        return _constant(tuple(rows[0, 1:]), len(t))
    after = np.clip(np.searchsorted(rows[:, 0], t, side="right"), 1, len(rows) - 1)
    a, b = rows[after - 1], rows[after]
    s = ((t - a[:, 0]) / (b[:, 0] - a[:, 0]))[:, None]
    p, q = _unit(a[:, 4:]), _unit(b[:, 4:])
    dot = (p * q).sum(1, keepdims=True)
    q, dot = np.where(dot < 0, -q, q), np.minimum(np.abs(dot), 1.0)
    angle = np.arccos(dot)
    sine = np.sin(angle)
    near = sine < 1e-6
    safe = np.where(near, 1.0, sine)
    turned = np.where(near, p + s * (q - p), (np.sin((1 - s) * angle) * p + np.sin(s * angle) * q) / safe)
    return a[:, 1:4] + s * (b[:, 1:4] - a[:, 1:4]), _unit(turned)


def _constant(values: tuple[float, ...], n: int) -> tuple[FloatArray, FloatArray]:
    row = np.tile(np.array(values, dtype=np.float64), (n, 1))
    return row[:, :3], _unit(row[:, 3:])


def _unit(q: FloatArray) -> FloatArray:
    unit: FloatArray = q / np.linalg.norm(q, axis=1, keepdims=True)
    return unit


def _finite(x: float) -> bool:
    return -1e12 < x < 1e12
