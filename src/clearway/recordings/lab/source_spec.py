"""What a test plan says of the files that its trials have, and of how their frames and clocks are tied. SI units, radians."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field, model_validator

from clearway.quantities import AngleSpread, Finite, NonNegative, PoseSpec
from clearway.recordings.formats.axes import Axis
from clearway.validation import Table

Point = tuple[Finite, Finite, Finite]
Span = tuple[Finite, Finite]


class StretchSpec(Table):
    """A stretch of a recording, with what is known of it."""

    file: str
    span: Span | None = Field(default=None, description="s on the file's clock; default: all of it")
    pose: str | PoseSpec | None = Field(
        default=None, description="where base_link was: a pose of [poses], or x, y, theta"
    )


class SurveyedSpec(Table):
    """A marker whose place in the map was surveyed."""

    marker: str
    at: tuple[Finite, Finite] = Field(description="x, y in the map, m")


class FrameSpec(Table):
    """How a source's frame is tied to the map: by exactly one of these. Without any, the map is not known."""

    same: bool = Field(default=False, description="it is the map's")
    transform: PoseSpec | None = Field(default=None, description="the source frame's pose in the map: m, m, rad")
    RENAMED: ClassVar = {"holds": "static_poses"}

    static_poses: tuple[StretchSpec, ...] = Field(default=(), description="the robot at rest on known poses")
    surveyed: tuple[SurveyedSpec, ...] = Field(default=(), description="markers on known places")
    file: str | None = Field(default=None, description="where the surveyed markers are seen; default: each trial's own")
    uncertainty: tuple[NonNegative, AngleSpread] | None = Field(
        default=None, description="standard uncertainty of a given transform or of known places: m, rad"
    )

    @model_validator(mode="after")
    def _one_way(self) -> FrameSpec:
        ways = sum((self.same, self.transform is not None, bool(self.static_poses), bool(self.surveyed)))
        if ways > 1:
            raise ValueError("say one of same, transform, static_poses, surveyed")
        if any(h.pose is None for h in self.static_poses):
            raise ValueError("every hold needs the pose that the robot stood on")
        return self


class VideoSpec(Table):
    """Videos of the trials: the page's events link to their moments in them."""

    files: str = Field(
        min_length=1,
        description="what they are called, by what the trials are: `video/{number:03d}.mp4`; one that is not there is none",
    )
    offset: Finite = Field(default=0.0, description="s of a video at which the first source's clock is at 0")


class SourceSpec(Table):
    """One kind of file that a trial may have: the capture, the robot's own log."""

    format: str | None = Field(default=None, description="`clearway list formats`; default: as the file looks")
    table: str | None = Field(default=None, description="for a plain CSV: the TOML that describes its columns")
    files: str | None = Field(
        default=None,
        min_length=1,
        description="the trials' files: `captures/{configuration}_{repetition}.csv` by what they are, or a folder or `captures/*.csv` "
        "in the plan's order; a trial whose file is not there was not driven yet",
    )
    up: Axis | dict[str, Axis] | None = Field(
        default=None,
        description="axis of the file that points up, or of single tracks by their names; default: what the file says, or its "
        "format's convention",
    )
    time: Literal["s", "ms", "us", "ns"] | None = Field(
        default=None, description="unit of its stamps, where the format has none (tum)"
    )
    frame: FrameSpec = FrameSpec()
    clock: Literal["speed", "epoch", "same"] | Finite = Field(
        default="speed",
        description="its clock against the first source's: correlate speeds, both files' dates, the same, or s to add",
    )
    estimate: str | None = Field(default=None, description="track that is the robot's own belief of its pose")
    odometry: str | None = Field(
        default=None, description="track whose speed the clocks are tied by; default: the estimate"
    )
    goals: str | None = Field(
        default=None,
        description="topic on which goals were sent, or an action such as /navigate_to_pose: its states also say when the robot "
        "called each goal reached",
    )
    plans: str | None = Field(default=None, description="topic on which the robot's plans were published")
