"""Actions of Nav2 and move_base: when each goal was sent to the robot, and when it called it reached.

A server tells the state of its goals on a topic of its own: `NAME/_action/status` in ROS 2, at each change; `NAME/status` in ROS 1, five
times a second and at each change. Neither says where the goal is; in ROS 1 `NAME/goal` does, by the same id.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from clearway.recordings.formats.bag_messages import Pose, State
from clearway.recordings.formats.tf import frame_name
from clearway.recordings.recording import Goals

STATUS = ("/_action/status", "/status")
"""What follows an action's name in the topics of its states."""


def action_of(topic: str) -> str:
    """The action whose states a topic tells: `/navigate_to_pose` of `/navigate_to_pose/_action/status`."""
    return next((topic.removesuffix(end) for end in STATUS if topic.endswith(end)), topic)


@dataclass(slots=True)
class _Goal:
    sent: float
    ended: float = np.nan
    outcome: str = ""
    pose: Pose | None = None
    told: bool = False  # by a state, not only by where it is


@dataclass(slots=True)
class ActionOf:
    """Collects the goals of one action.

    Attributes:
        name: What they are called in the recording.
        goals: By their ids, in the order in which they came.
        over: Ids of the goals that were over when the recording began.
    """

    name: str
    goals: dict[str, _Goal] = field(default_factory=dict)
    over: set[str] = field(default_factory=set)

    def add_state(self, sent: float, seen: float, state: State) -> None:
        """What was said of a goal at `seen` [s]; by its own stamp it was sent at `sent`."""
        known = self.goals.get(state.goal)
        if known is None or not known.told:
            if state.outcome or state.goal in self.over:
                self.over.add(state.goal)
                return
            known = self.goals.setdefault(state.goal, _Goal(min(sent, seen)))
            known.sent, known.told = min(sent, seen), True
        if state.outcome and not known.outcome:
            known.ended, known.outcome = seen, state.outcome

    def add_pose(self, t: float, goal: str, pose: Pose) -> None:
        """Where a goal is, as it was sent at `t` [s]."""
        self.goals.setdefault(goal, _Goal(t)).pose = pose

    def finish(self, file: Path, span: tuple[float, float] | None) -> tuple[Goals, list[str]]:
        """The goals in the order in which they were sent."""
        found = sorted(self.goals.values(), key=lambda g: g.sent)
        if span is not None:
            found = [g for g in found if span[0] <= g.sent <= span[1]]
        frames = [frame_name(g.pose.frame) for g in found if g.pose is not None]
        frame = frames[0] if frames else ""
        poses = np.full((len(found), 3), np.nan)
        for row, goal in zip(poses, found, strict=True):
            if goal.pose is not None and frame_name(goal.pose.frame) == frame:
                x, y, _, qx, qy, qz, qw = goal.pose.values
                row[:] = x, y, np.arctan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))
        sent, ended = (np.array([getattr(g, what) for g in found], dtype=np.float64) for what in ("sent", "ended"))
        notes = []
        if self.over - self.goals.keys():
            notes.append(f"{self.name}: {len(self.over)} goals were over when the recording began; left out")
        return Goals(frame, sent, poses, ended, tuple(g.outcome for g in found)), notes
