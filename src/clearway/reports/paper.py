"""What paper A printed, to stand beside what was measured here.

Rondoni, Scotto di Luzio, Tamantini et al., "Navigation benchmarking for autonomous mobile robots in hospital
environment", Scientific Reports 14, 2024. Every number names its place in the paper.
"""

from __future__ import annotations

from dataclasses import dataclass

CITATION = (
    "Rondoni, Scotto di Luzio, Tamantini, Tagliamonte, Chiurazzi, Ciuti & Zollo, Navigation benchmarking for autonomous "
    "mobile robots in hospital environment, Scientific Reports 14 (2024)"
)


@dataclass(frozen=True, slots=True)
class Mean:
    """A mean as the paper prints it.

    Attributes:
        robot: The robot.
        batch: The batch of tests.
        speed: Set speed, m/s.
        indicator: Name of the indicator.
        mean: The mean, in the indicator's unit.
        spread: Its printed spread, in the same unit.
        source: Where in the paper it stands.
    """

    robot: str
    batch: str
    speed: float
    indicator: str
    mean: float
    spread: float
    source: str


MEANS = (
    Mean("hosbot", "NO", 0.2, "CT", 51.73, 0.81, "Results and discussion, text"),
    Mean("hosbot", "NO", 0.6, "CT", 20.19, 0.16, "Results and discussion, text"),
    Mean("tiago", "NO", 0.2, "CT", 48.10, 0.83, "Results and discussion, text"),
    Mean("tiago", "NO", 0.6, "CT", 22.50, 1.02, "Results and discussion, text"),
    Mean("hosbot", "NO", 0.6, "DE", 0.05, 0.02, "Results and discussion, text (best accuracy)"),
    Mean("hosbot", "NO", 0.6, "OE", 0.02, 0.01, "Results and discussion, text (best accuracy)"),
    Mean(
        "tiago",
        "SO",
        0.2,
        "PL",
        8.31,
        1.80,
        "Results and discussion, text; shorter than the task, see reports/DECISIONS.md",
    ),
)


@dataclass(frozen=True, slots=True)
class Significant:
    """One row of Table 4.

    Attributes:
        indicator: Name of the indicator.
        batch: The batch of tests.
        slower: The lower set speed, m/s.
        faster: The higher set speed, m/s.
        hosbot: p of the Wilcoxon test for HOSBOT; None where it prints a dash.
        tiago: p of the Wilcoxon test for TIAGo; None where it prints a dash.
    """

    indicator: str
    batch: str
    slower: float
    faster: float
    hosbot: float | None
    tiago: float | None

    def p(self, robot: str) -> float | None:
        """The printed p for a robot (by the name before a preset's colon)."""
        return {"hosbot": self.hosbot, "tiago": self.tiago}.get(robot.partition(":")[0])


V0, V1, V2 = 0.2, 0.6, 1.0

TABLE_4 = (
    Significant("CT", "SO", V0, V1, 1.34e-6, 4.72e-15),
    Significant("CT", "SO", V0, V2, 3.59e-8, 3.36e-15),
    Significant("CT", "SO", V1, V2, 5.19e-3, None),
    Significant("CT", "MO", V0, V1, None, 1.45e-3),
    Significant("CT", "CE", V0, V1, None, 4.06e-2),
    Significant("PL", "SO", V0, V1, None, 8.12e-4),
    Significant("PL", "SO", V0, V2, None, 1.26e-7),
    Significant("PL", "SO", V1, V2, None, 1.17e-2),
    Significant("PL", "CE", V0, V1, None, 4.06e-2),
    Significant("DE", "SO", V0, V2, None, 1.02e-2),
    Significant("OE", "SO", V0, V2, None, 2.06e-3),
    Significant("MDO", "SO", V0, V1, None, 2.58e-4),
    Significant("MDO", "SO", V0, V2, None, 1.73e-5),
    Significant("TCS", "SO", V0, V1, 2.82e-5, 5.20e-11),
    Significant("TCS", "SO", V0, V2, 4.68e-7, 3.36e-13),
    Significant("TCS", "MO", V0, V2, None, 3.93e-3),
)
"""Table 4. Its merged cells are read by the order of the rows; the last row names a speed that MO does not have."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """One row of Table 3, as printed; where the table has one value for both robots, both have it.

    Attributes:
        group: What the parameter belongs to.
        title: Its name.
        hosbot: Its value for HOSBOT.
        tiago: Its value for TIAGo.
    """

    group: str
    title: str
    hosbot: str
    tiago: str


TABLE_3 = (
    Parameter("planners", "Update frequency of the global planned path", "5 Hz", "1 Hz"),
    Parameter("planners", "Tolerance at the goal point", "0.3 m", "0.3 m"),
    Parameter("planners", "Update frequency of the local planned path", "5 Hz", "1 Hz"),
    Parameter("planners", "Controller frequency", "10 Hz", "10 Hz"),
    Parameter("planners", "Explored samples in the x velocity space", "3", "10"),
    Parameter("planners", "Explored samples in the y velocity space", "3", "0"),
    Parameter("planners", "Explored samples in the theta velocity space", "10", "20"),
    Parameter("planners", "Tolerance in reaching goal position", "0.1 m", "0.2 m"),
    Parameter("planners", "Tolerance in reaching goal orientation", "0.01 rad", "0.2 rad"),
    Parameter("planners", "Maximum translational velocity", "1.5 m/s", "1.5 m/s"),
    Parameter("planners", "Maximum rotational velocity", "2.0 rad/s", "2.0 rad/s"),
    Parameter("costmaps", "Global and local costmap update frequency", "5 Hz", "10 Hz"),
    Parameter("costmaps", "Local obstacle range", "0.3 m", "3.5 m"),
    Parameter("costmaps", "Local raytrace range", "5.5 m", "4.0 m"),
    Parameter("costmaps", "Local width and height", "10 m", "5.0 m"),
    Parameter("costmaps", "Local resolution", "0.050 m", "0.025 m"),
)

YAW_TOLERANCE = {"hosbot": 0.01, "tiago": 0.2}
"""Table 3, tolerance in reaching goal orientation, rad."""

SUCCESS = "“a very high success rate”, no number"
"""What it prints of SR."""

FIGURE_5: dict[tuple[str, str], dict[str, float]] = {
    ("SO", "single"): {"size": 0.15},
    ("SO", "parallel"): {"size": 0.03},
    ("SO", "perpendicular"): {"size": 0.03},
    ("MO", "passing"): {"obstacle_speed": V1},
    ("MO", "crossing"): {"obstacle_speed": V1},
    ("CE", "complex"): {"obstacle_speed": V1, "size": 0.15},
}
"""The trials that Fig. 5 shows, by (batch, configuration): the columns that it names. All at v_0; overtaking has one speed."""

EDGES = (0.03, 0.15, 0.30, 0.60)
GAPS = (1.0, 1.5, 2.0)
"""S_1 to S_4 in m, d_1 to d_3 in multiples of d_base: Fig. 2 and the protocol's text."""

MANOEUVRING_SHARE = 0.10
"""Results and discussion: the environment should leave more than 10 % of the robot's characteristic size."""

PROTOCOL = {"NO": 9, "SO": 252, "MO": 27, "CE": 48}
"""Trials of each batch for one robot: Table 1 and the protocol's text, read as scenarios/DECISIONS.md says."""
