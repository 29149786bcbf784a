"""What the robot's own log adds to a measured trial: its clock, its belief, the goals that it was sent, the plans it made."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from clearway.contract import Diagnostics
from clearway.errors import ClearwayError, unknown
from clearway.geometry.frames import compose
from clearway.geometry.shapes import FloatArray
from clearway.recordings.alignment import clocks, frames
from clearway.recordings.alignment.clocks import Offset
from clearway.recordings.alignment.frames import Tie
from clearway.recordings.lab.lab import Lab, must_stand
from clearway.recordings.motion import markers
from clearway.recordings.motion.motion import Motion
from clearway.recordings.recording import Goals, Recording
from clearway.trials import Snapshot

Recordings = Mapping[str, Recording]
"""The files of one trial, read, by source."""
Offsets = Mapping[str, Offset]
"""What to add to the clock of a source that is not the first, by source."""
BY_DATES = "by the dates in both files"


def offset_of(lab: Lab, name: str, recording: Recording, first: Recording, motion: Motion, whole: Motion) -> Offset:
    """What to add to the clock of source `name` to have the first one's, by which the robot moved as `motion` says in this
    trial, and as `whole` says in all of the first one's file.

    Raises:
        ClearwayError: the clocks can't be tied as the plan says, or then have no time in common.
    """
    offset = _tied(lab, name, recording, first, (motion, whole))
    ends = [end for track in recording.tracks.values() if len(track.t) for end in (track.t[0], track.t[-1])]
    begin, end = (min(ends) + offset.seconds, max(ends) + offset.seconds) if ends else (motion.t[0], motion.t[-1])
    if begin > motion.t[-1] or end < motion.t[0]:
        zones = "; does one of them take another time zone's time for UTC?" if offset.note == BY_DATES else ""
        raise ClearwayError(
            f"the robot was measured from {motion.t[0]:.1f} to {motion.t[-1]:.1f} s, and this file, by its clock as tied "
            f"({offset.note}), runs from {begin:.1f} to {end:.1f} s: they have no time in common{zones}",
            file=recording.file,
            field="clock",
        )
    return offset


def _tied(lab: Lab, name: str, recording: Recording, first: Recording, motions: tuple[Motion, ...]) -> Offset:
    spec = lab.plan.sources[name]
    if isinstance(spec.clock, float | int):
        return Offset(float(spec.clock), 0.0, 1.0, "given in the plan")
    if spec.clock == "same":
        return Offset(0.0, 0.0, 1.0, "the same clock, says the plan")
    if spec.clock == "epoch":
        if recording.epoch is None or first.epoch is None:
            lacking = recording if recording.epoch is None else first
            raise ClearwayError(
                "doesn't say when it was recorded; tie the clocks by speed", file=lacking.file, field="clock"
            )
        return Offset(recording.epoch - first.epoch, 0.0, 1.0, BY_DATES)
    track = spec.odometry or spec.estimate
    if track is None:
        raise ClearwayError(
            "ties its clock by speed, so it needs odometry or estimate: the track that the robot's speed is in",
            file=lab.path,
            field=f"sources.{name}",
        )
    own = _track(lab, name, recording, track)
    # one trial alone would fit all its repetitions in a log of the whole day, and the other way round
    return clocks.offset(min(motions, key=lambda m: abs(_lasts(m) - _lasts(own))), own)


def _lasts(motion: Motion) -> float:
    return float(motion.t[-1] - motion.t[0]) if len(motion.t) else 0.0


def _track(lab: Lab, source: str, recording: Recording, track: str) -> Motion:
    if track not in recording.tracks:
        raise unknown("track", track, recording.tracks, file=recording.file)
    must_stand(recording.tracks[track], track, recording, lab.plan.sources[source].up)
    cleaning = lab.plan.motion.model_copy(update={"cutoff": "none"})  # it is what the robot believed, not what it did
    return markers.motion_of_track(recording.tracks[track], cleaning, None, file=recording.file, field=track)


def own_view(
    lab: Lab, recordings: Recordings, offsets: Offsets, t: FloatArray
) -> tuple[FloatArray | None, tuple[Snapshot, ...]]:
    """What the robot's own log says: its belief of its pose (n, 3), and the plans that it published."""
    estimate, shown = None, []
    for name, recording in recordings.items():
        spec = lab.plan.sources[name]
        by = offsets[name].seconds if name in offsets else 0.0
        tie = lab.tie(name, recording)
        if spec.estimate is not None and estimate is None:
            if tie is None:
                raise ClearwayError(
                    "the robot's estimate is only of use in the map; say `frame.same = true` if it is given there",
                    file=lab.path,
                    field=f"sources.{name}.frame",
                )
            own = frames.apply(tie, _track(lab, name, recording, spec.estimate))
            own = clocks.resample(own, _within(t - by, own.t))
            estimate = own.wrapped
        if spec.plans is not None and tie is not None:
            if spec.plans not in recording.paths:
                raise unknown("topic of plans", spec.plans, recording.paths, file=recording.file)
            paths = recording.paths[spec.plans]
            for at, line in zip(paths.t, paths.lines, strict=True):
                drawn = Diagnostics(polylines={"global plan": _placed(tie, line)})
                shown.append(Snapshot(float(at) + by, drawn))
    return estimate, tuple(sorted(shown, key=lambda s: s.t))


def goals_sent(lab: Lab, recordings: Recordings, offsets: Offsets, span: tuple[float, float]) -> Goals | None:
    """The goals that the robot was sent within `span` by its own log, in the map (NaN where that isn't tied) and on the
    first source's clock; None where no log says."""
    for name, recording in recordings.items():
        topic = lab.plan.sources[name].goals
        if topic is None:
            continue
        tie, goals = lab.tie(name, recording), _goals(recording, topic)
        by = offsets[name].seconds if name in offsets else 0.0
        t, ended = goals.t + by, None if goals.ended is None else goals.ended + by
        within = (t >= span[0]) & (t <= span[1])
        poses = [np.full(3, np.nan) if tie is None else compose(tie.pose, p) for p in goals.pose[within]]
        outcome = tuple(o for o, inside in zip(goals.outcome, within, strict=False) if inside)
        return Goals(
            "map", t[within], np.array(poses).reshape(-1, 3), None if ended is None else ended[within], outcome
        )
    return None


def _goals(recording: Recording, topic: str) -> Goals:
    """The goals on a topic; poses on a topic that isn't called so are goals if the plan says it."""
    if topic in recording.goals:
        return recording.goals[topic]
    if topic not in recording.tracks:
        raise unknown("topic of goals", topic, (*recording.goals, *recording.tracks), file=recording.file)
    track = recording.tracks[topic]
    heading = np.full(len(track.t), np.nan)
    if track.orientation is not None:
        ahead = Rotation.from_quat(track.orientation).apply([1.0, 0.0, 0.0])
        heading = np.arctan2(ahead[:, 1], ahead[:, 0])
    return Goals(track.frame, track.t, np.column_stack([track.position[:, :2], heading]))


def _within(t: FloatArray, of: FloatArray) -> FloatArray:
    """The times `t`, those that lie outside `of` by less than one of its samples moved to its ends: a log that ends with
    the leg must not lose the leg's end to the clocks' uncertainty."""
    step = float(np.median(np.diff(of)))
    near = (t > of[0] - step) & (t < of[-1] + step)
    return np.where(near, np.clip(t, of[0], of[-1]), t)


def _placed(tie: Tie, points: FloatArray) -> FloatArray:
    """(n, 2) points of a source's frame, in the map."""
    c, s = math.cos(tie.pose[2]), math.sin(tie.pose[2])
    placed: FloatArray = tie.pose[:2] + points @ np.array([[c, s], [-s, c]])
    return placed
