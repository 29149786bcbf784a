"""A test plan at work: reads what its trials need, ties frames and bodies once, and keeps what several trials share."""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from clearway.errors import ClearwayError, unknown
from clearway.geometry.shapes import FloatArray
from clearway.recordings import formats
from clearway.recordings.alignment import frames
from clearway.recordings.alignment.frames import Tie
from clearway.recordings.formats import axes, table
from clearway.recordings.formats.beside import beside
from clearway.recordings.lab import wildcards
from clearway.recordings.lab.plan_file import load_test_plan
from clearway.recordings.lab.source_spec import StretchSpec
from clearway.recordings.lab.test_plan import (
    BodySpec,
    PlacedSpec,
    RecordedTrialSpec,
    TestPlan,
    seen_from,
    without_coordinates,
)
from clearway.recordings.motion import base, markers
from clearway.recordings.motion.base import Base
from clearway.recordings.motion.markers import MarkerSet
from clearway.recordings.motion.motion import Motion
from clearway.recordings.motion.upright import other_axis
from clearway.recordings.recording import Contents, Points, Recording, Track, Want, contents_of
from clearway.robots import Robot, load_robot

ROBOT = "robot"
"""The name under which the plan's [robot] goes among the bodies."""
PLACED_HEADING = 0.01
"""rad; standard uncertainty of the heading in which a body was put on a known pose by hand."""
KEPT = 2
"""Recordings kept in memory, or one of each source if these are more: neighbouring trials often lie in one file."""


class Lab:
    """A plan with its folder.

    Args:
        path: The plan's file.
        plan: What it says, if that was read before; None: it is read now.

    Attributes:
        plan: What it says.
        fitted: Of the bodies that stand for several tracks, those that a file held any of, so far.

    Raises:
        ClearwayError: the plan is wrong.
    """

    def __init__(self, path: Path, plan: TestPlan | None = None) -> None:
        self.path, self.folder = Path(path), Path(path).parent
        self.plan: TestPlan = plan or load_test_plan(path)
        self._kept: OrderedDict[tuple[str, Path], Recording] = OrderedDict()
        self._bases: dict[str, Base | None] = {}
        self._ties: dict[str, Tie] = {}
        self._models: dict[str, dict[str, FloatArray]] = {}
        self._digests: dict[str, str] = {}
        self.fitted: set[str] = set()
        self._each: dict[str, BodySpec] = {}
        self._looked: dict[tuple[str, str], Contents] = {}
        self._motions: dict[tuple[str, bool], tuple[Path, Motion]] = {}

    @property
    def first(self) -> str:
        """Name of the source that measures; all others are tied to its clock."""
        return next(iter(self.plan.sources))

    @cached_property
    def robot(self) -> Robot | None:
        """The robot that was tested, None if the plan doesn't say."""
        which = self.plan.test.robot
        return None if which is None else load_robot(seen_from(self.folder, which))

    def files(self, trial: RecordedTrialSpec) -> dict[str, str]:
        """The trial's files by source; empty if it was not recorded."""
        return self.plan.files_of(trial)

    def body(self, name: str) -> BodySpec:
        """The robot or a body of the plan."""
        return self._each.get(name) or (self.plan.robot if name == ROBOT else self.plan.bodies[name])

    def placed(self, spec: RecordedTrialSpec, recordings: Mapping[str, Recording]) -> list[PlacedSpec]:
        """The obstacles of a trial, of bodies that stand for several each of those that its files hold."""
        found = []
        for one in spec.obstacles:
            body, source = self.body(one.body), self.source_of(one.body)
            if one.pose is not None or not wildcards.several(body) or source not in recordings:
                found.append(one)
                continue
            for track in wildcards.there(self.plan, body, recordings[source]):
                name = wildcards.called(track, {ROBOT, *self.plan.bodies})
                self.fitted.add(one.body)
                self._each[name] = body.model_copy(update={"track": track})
                found.append(one.model_copy(update={"body": name}))
        return found

    def source_of(self, name: str) -> str:
        """The source that measures the body `name`."""
        return self.body(name).source or self.first

    def recording(self, source: str, file: str) -> Recording:
        """What `file` of `source` holds of the names that the plan asks for."""
        spec, path = self.plan.sources[source], self.folder / file
        key = (source, path)
        if key not in self._kept:
            want = replace(self._want(source, file), up=spec.up if isinstance(spec.up, str) else None, time=spec.time)
            if spec.table is not None:
                found = table.read_with(path, self.folder / spec.table, want)
            else:
                found = formats.read(path, want, format=spec.format)
            if isinstance(spec.up, dict):
                found = axes.tracks_turned(found, spec.up)
            while len(self._kept) >= max(KEPT, len(self.plan.sources)):
                self._kept.popitem(last=False)
            self._kept[key] = wildcards.with_bearers(self.plan, source, found)
        self._kept.move_to_end(key)
        return self._kept[key]

    def digest(self, file: str) -> str:
        """SHA-256 of a file of the plan."""
        if file not in self._digests:
            self._digests[file] = digest(self.folder / file)
        return self._digests[file]

    def _want(self, source: str, file: str) -> Want:
        """What the plan needs of a file, so that no more of it is kept; all of it where a marker set is named by its prefix."""
        spec, frame = self.plan.sources[source], self.plan.sources[source].frame
        bodies: set[str] = {ROBOT} if file in {pose.file for pose in frame.static_poses} else set()
        for name in (ROBOT, *self.plan.bodies):
            b = self.body(name)
            if file in {stretch.file for stretch in (b.static, b.straight, b.turn) if stretch}:
                bodies.add(name)
        names = {s.marker for s in frame.surveyed} if frame.file in (None, file) else set()
        for trial in self.plan.trials:
            if self.files(trial).get(source) == file:
                bodies |= {ROBOT, *(o.body for o in trial.obstacles if o.pose is None)}
                names |= {n for n in (spec.estimate, spec.odometry, spec.goals, spec.plans) if n}
        for body in (self.body(name) for name in bodies if self.source_of(name) == source):
            if isinstance(body.markers, str):
                return Want()
            if wildcards.several(body):
                names |= wildcards.wanted(self.plan, body, self._contents(source, file))
            else:
                names |= set(body.markers or body.coordinates or ()) | ({body.track} if body.track else set())
        return Want(names=frozenset(names)) if names else Want()

    def _contents(self, source: str, file: str) -> Contents:
        """What a file holds, before it is read."""
        if (source, file) not in self._looked:
            spec, path = self.plan.sources[source], self.folder / file
            if spec.table is not None:
                found = contents_of(table.read_with(path, self.folder / spec.table, Want()))
            else:
                found = formats.look(path, format=spec.format, time=spec.time)
            self._looked = {(source, file): found}
        return self._looked[source, file]

    def raw(self, name: str, recording: Recording, *, tied: bool = True) -> Motion:
        """How the body moved, in its source's frame; `tied`: of its base_link, else of the fitted model or the track."""
        last = self._motions.get((name, tied))
        if last is None or last[0] != recording.file:  # the trials of one file follow each other
            last = recording.file, self._moved(name, recording, tied)
            self._motions[name, tied] = last
        return last[1]

    def _moved(self, name: str, recording: Recording, tied: bool) -> Motion:
        body = self.body(name)
        link = self._base(name) if tied else None
        where: dict[str, Any] = {"file": recording.file, "field": ROBOT if name == ROBOT else f"bodies.{name}"}
        if body.track is not None:
            if body.track not in recording.tracks:
                raise unknown("track", body.track, recording.tracks, file=recording.file)
            track = recording.tracks[body.track]
            must_stand(track, body.track, recording, self.plan.sources[self.source_of(name)].up)
            return markers.motion_of_track(track, self.plan.motion, link, heading=body.heading, **where)
        if body.markers is None and body.coordinates is None:
            raise ClearwayError("says neither its markers nor its track", file=self.path, field=where["field"])
        points = self._points(name, recording)
        return markers.motion_of_markers(
            points, self._markers(name, points, recording), self.plan.motion, link, **where
        )

    def _points(self, name: str, recording: Recording) -> Points:
        if recording.points is None:
            held = ", ".join(recording.tracks) or "nothing that moves"
            raise ClearwayError(
                f"holds no markers; the plan asks for those of {name!r}; it has {held}", file=recording.file
            )
        return recording.points

    def _markers(self, name: str, points: Points, recording: Recording) -> MarkerSet:
        """The body's marker set as `recording` names it, with where the markers sit on it as far as that is known."""
        body, field = self.body(name), ROBOT if name == ROBOT else f"bodies.{name}"
        names = markers.resolve(
            points.names, body.markers or tuple(body.coordinates or ()), file=recording.file, field=field
        )
        if body.coordinates is not None:
            if wrong := without_coordinates(names, body):
                raise ClearwayError(wrong, file=self.path, field=f"{field}.coordinates")
            return MarkerSet(names, np.array([body.coordinates[marker] for marker in names]))
        if (known := self._model(name)) is None:
            return MarkerSet(names)
        # another file may have other columns: a marker that wasn't there when the layout was learnt is not used
        return MarkerSet(names, np.array([known.get(marker, np.full(3, np.nan)) for marker in names]))

    def _model(self, name: str) -> dict[str, FloatArray] | None:
        """Where the markers sit on a body whose base_link was tied by a recording of its own: learnt there, used everywhere."""
        body = self.body(name)
        stretch = body.static or body.straight or body.turn
        if stretch is None or body.markers is None:
            return None
        if name not in self._models:
            recording = self.recording(self.source_of(name), stretch.file)
            points = self._points(name, recording)
            names = markers.resolve(points.names, body.markers, file=recording.file)
            model = markers.learnt(points, MarkerSet(names), self.plan.motion).model
            assert model is not None
            self._models[name] = dict(zip(names, model, strict=True))
        return self._models[name]

    def motion(self, name: str, recording: Recording) -> tuple[Motion, Tie | None]:
        """How the body moved in the map, and the tie; in the source's own frame, and None, where that isn't tied."""
        tie = self.tie(self.source_of(name), recording)
        raw = self.raw(name, recording)
        return (raw if tie is None else frames.apply(tie, raw)), tie

    def tie(self, source: str, recording: Recording) -> Tie | None:
        """How a source's frame lies in the map, None if the plan doesn't say."""
        spec = self.plan.sources[source].frame
        sigma = spec.uncertainty
        if spec.same:
            return frames.given(np.zeros(3), sigma or (0.0, 0.0))
        if spec.transform is not None:
            return frames.given(np.array(spec.transform), sigma)
        if spec.surveyed and spec.file is None:
            return self._surveyed(source, recording)
        if not spec.surveyed and not spec.static_poses:
            return None
        if source not in self._ties:
            if spec.file is not None:
                self._ties[source] = self._surveyed(source, self.recording(source, spec.file))
            else:
                self._ties[source] = self._held(source)
        return self._ties[source]

    def _surveyed(self, source: str, recording: Recording) -> Tie:
        spec, points = self.plan.sources[source].frame, recording.points
        if points is None:
            raise ClearwayError("holds no markers, and the frame is tied by surveyed ones", file=recording.file)
        seen = []
        for surveyed in spec.surveyed:
            if surveyed.marker not in points.names:
                raise unknown("marker", surveyed.marker, points.names, file=recording.file)
            at = points.xyz[:, points.names.index(surveyed.marker), :2]
            there = np.isfinite(at).all(axis=1)
            if not there.any():
                raise ClearwayError(f"the surveyed marker {surveyed.marker!r} is never seen", file=recording.file)
            seen.append(np.median(at[there], axis=0))
        known = np.array([s.at for s in spec.surveyed])
        return frames.tie_by_points(np.array(seen), known, *([] if spec.uncertainty is None else [spec.uncertainty[0]]))

    def _held(self, source: str) -> Tie:
        """By the robot at rest on known poses."""
        spec = self.plan.sources[source].frame
        body = self.plan.robot
        itself = body.coordinates is not None or body.track is not None
        if body.offset is None and (body.static is not None or body.straight is not None or not itself):
            how = (
                "robot.static ties base_link by the frame"
                if itself or body.static or body.straight
                else "nothing ties it"
            )
            raise ClearwayError(
                f"static poses tie the frame by where base_link is, and {how}: give the markers' coordinates alone, or tie the frame "
                "by surveyed points",
                file=self.path,
                field=f"sources.{source}.frame.static_poses",
            )
        poses = [frames.static_pose(self.stretch(ROBOT, pose, source)).pose for pose in spec.static_poses]
        known = np.array([self.pose(pose.pose) for pose in spec.static_poses])
        return frames.tie_by_static_poses(
            np.array(poses), known, *([] if spec.uncertainty is None else [spec.uncertainty])
        )

    def stretch(self, name: str, stretch: StretchSpec, source: str, *, tied: bool = True) -> Motion:
        """The body's motion during a stretch of a recording, in the source's frame."""
        whole = self.raw(name, self.recording(source, stretch.file), tied=tied)
        return cut(whole, stretch.span, file=self.folder / stretch.file)

    def _base(self, name: str) -> Base | None:
        """Where base_link is in the body's fitted model or track; None: it is the same."""
        if name not in self._bases:
            self._bases[name] = self._make_base(name)
        return self._bases[name]

    def _make_base(self, name: str) -> Base | None:
        body, source = self.body(name), self.source_of(name)
        if body.offset is not None:
            return base.from_offset(body.offset)
        if body.static is None and body.straight is None and body.turn is None:
            return None
        where: dict[str, Any] = {"file": self.path, "field": ROBOT if name == ROBOT else f"bodies.{name}"}
        placed = (body.uncertainty, PLACED_HEADING)
        straight, turn = (
            None if stretch is None else self.stretch(name, stretch, source, tied=False)
            for stretch in (body.straight, body.turn)
        )
        still = known = None
        if body.static is not None and body.static.pose is not None:
            tie = self.tie(source, self.recording(source, body.static.file))
            if tie is not None:
                still = frames.apply(tie, self.stretch(name, body.static, source, tied=False))
                known = self.pose(body.static.pose)
            elif turn is None and straight is not None:
                raise ClearwayError(
                    f"is tied by a pose in the map (static), and the frame of {source!r} is not tied to the map: say "
                    f"sources.{source}.frame, or give a turn in place instead",
                    **where,
                )
        if straight is not None:
            return base.from_static_and_straight(still, known, straight, turn=turn, placed=placed, **where)
        if still is not None and known is not None:
            return base.from_static(still, known, turn=turn, placed=placed, **where)
        if turn is not None:
            raise ClearwayError(
                "a turn in place gives base_link's position alone; its heading needs a straight drive, or a static pose in the "
                "map",
                **where,
            )
        return None

    def linked(self, name: str) -> bool:
        """Whether it is known where base_link is on the body; a track is taken to be base_link's own."""
        body = self.body(name)
        return body.track is not None or body.coordinates is not None or self._base(name) is not None

    def pose(self, which: str | tuple[float, float, float] | None) -> FloatArray:
        """A pose of the plan: named, given, or unknown (NaN); (3,)."""
        if which is None:
            return np.full(3, np.nan)
        return np.array(self.plan.poses[which] if isinstance(which, str) else which, dtype=np.float64)


def must_stand(track: Track, name: str, recording: Recording, up: str | Mapping[str, str] | None) -> None:
    """Nothing, unless another axis than that which was taken for it is up in a track, and nobody said which is.

    Args:
        track: The track.
        name: Its name.
        recording: What it is of.
        up: What the plan says of its source.

    Raises:
        ClearwayError: another axis is.
    """
    said = up is not None and (isinstance(up, str) or name in up)
    if said or recording.up_said or (other := other_axis(track)) is None:
        return
    axis, how = axes.of_file(other[0], recording.up).lstrip("-"), other[1]
    raise ClearwayError(
        f"another axis than {recording.up} seems to be up in {name!r}: {how}; say which in the source, up = {axis!r} (or "
        f"'-{axis}', or {recording.up!r} if it is that), or in {beside(recording.file).name} beside it",
        file=recording.file,
        field="up",
    )


def cut(motion: Motion, span: tuple[float, float] | None, *, file: object) -> Motion:
    """The part of a motion within `span` [s], all of it for None.

    Raises:
        ClearwayError: it lies outside what was recorded.
    """
    if span is None:
        return motion
    start, end = span
    inside = (motion.t >= start - 1e-9) & (motion.t <= end + 1e-9)
    if not start < end or inside.sum() < 2:
        held = f"{motion.t[0]:.3f} to {motion.t[-1]:.3f} s" if len(motion.t) else "nothing"
        raise ClearwayError(f"({start:g}, {end:g}) s is not in the recording; it has {held}", file=file, field="span")
    sigma, residual = (None if v is None else v[inside] for v in (motion.sigma, motion.residual))
    t, pose, velocity = motion.t[inside], motion.pose[inside], motion.velocity[inside]
    return replace(motion, t=t, pose=pose, velocity=velocity, sigma=sigma, residual=residual)


def digest(path: Path) -> str:
    """SHA-256 of a file, or of a folder's files in the order of their names."""
    seen = hashlib.sha256()
    for file in sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]:
        with open(file, "rb") as f:
            while block := f.read(1 << 20):
                seen.update(block)
    return seen.hexdigest()
