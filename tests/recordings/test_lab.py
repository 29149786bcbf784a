"""What ties markers to base_link and the capture to the map, from small captures whose robot stands where it is known."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clearway.errors import ClearwayError
from clearway.recordings.alignment.clocks import Offset
from clearway.recordings.formats import formats
from clearway.recordings.lab.assemble import assemble
from clearway.recordings.lab.lab import Lab
from clearway.recordings.lab.surroundings import obstacles
from clearway.recordings.protocol.toml_text import toml
from clearway.recordings.recording import Points, Recording
from clearway.trials import Trial

RATE = 50.0
MARKERS = {"m1": (0.25, 0.33, 0.3), "m2": (0.44, 0.39, 0.5), "m3": (0.32, 0.17, 0.4), "m4": (0.46, 0.21, 0.9)}
"""Some 0.4 m beside base_link."""
FRAME = (1.35, -0.8, 2.0)
TIED: dict[str, Any] = {"transform": list(FRAME), "uncertainty": [0.001, 0.001]}


def capture(path: Path, pose: np.ndarray, names: Sequence[str] = tuple(MARKERS)) -> None:
    """Markers of a robot at `pose` (n, 3) in the map."""
    x, y, turn = FRAME
    at = (pose[:, 0] + 1j * pose[:, 1] - complex(x, y)) * np.exp(-1j * turn)
    facing = np.exp(1j * (pose[:, 2] - turn))
    noise = np.random.default_rng(len(pose))
    columns = []
    for name in names:
        p = at + facing * complex(*MARKERS[name][:2])
        columns.append(np.column_stack([p.real, p.imag, np.full(len(pose), MARKERS[name][2])]))
    xyz = np.stack(columns, axis=1) + noise.normal(0.0, 0.0003, (len(pose), len(names), 3))
    points = Points(tuple(f"robot:{n}" for n in names), np.arange(len(pose)) / RATE, xyz)
    write = formats()["vicon"].write
    assert write is not None
    write(path, Recording(path, "vicon", points=points))


def still(pose: Sequence[float], seconds: float = 2.5) -> np.ndarray:
    return np.tile(pose, (int(seconds * RATE), 1))


def ahead(pose: Sequence[float], length: float) -> np.ndarray:
    """2.5 s of rest, straight ahead to `length` [m] along a cosine, 2.5 s of rest."""
    way = length * (1 - np.cos(np.linspace(0.0, math.pi, int(5 * RATE)))) / 2
    drive = np.column_stack([
        pose[0] + way * math.cos(pose[2]), pose[1] + way * math.sin(pose[2]), np.full(len(way), pose[2])
    ])  # fmt: skip
    return np.concatenate([still(pose), drive, still(drive[-1])])


Scored = Callable[..., Trial]


@pytest.fixture
def scored(tmp_path: Path) -> Scored:
    """The trial of a robot that drives 2 m ahead from A, by markers that are tied as the arguments say."""
    turning = np.column_stack([np.full((400, 2), 0.5), np.linspace(0.0, 2 * math.pi, 400)])
    capture(tmp_path / "static.csv", still((0.0, 1.0, 0.5)))
    capture(tmp_path / "straight.csv", ahead((-1.0, 0.0, 0.7), 1.5))
    capture(tmp_path / "turn.csv", turning)

    def score(robot: dict[str, Any], frame: dict[str, Any] = TIED, names: Sequence[str] = tuple(MARKERS)) -> Trial:
        capture(tmp_path / "trial.csv", ahead((0.0, 1.0, 0.5), 2.0), names)
        content = {
            "test": {"robot": "tiago"},
            "poses": {"A": [0.0, 1.0, 0.5]},
            "sources": {"capture": {"format": "vicon", "frame": frame}},
            "robot": {"markers": "robot:"} | robot,
            "legs": [{"name": "forth", "start": "A", "goal": [2 * math.cos(0.5), 1 + 2 * math.sin(0.5), 0.5]}],
            "trial": [{"file": "trial.csv"}],
        }
        (tmp_path / "plan.toml").write_text(toml(content), encoding="utf-8")
        return assemble(Lab(tmp_path / "plan.toml"), 0)

    return score


STATIC, STRAIGHT, TURN = {"file": "static.csv", "pose": "A"}, {"file": "straight.csv"}, {"file": "turn.csv"}


@pytest.mark.parametrize(
    "robot",
    [
        {"static": STATIC, "straight": STRAIGHT},
        {"static": STATIC, "straight": STRAIGHT, "turn": TURN},
        {"straight": STRAIGHT, "turn": TURN},
        {"static": STATIC, "turn": TURN},
        {"static": STATIC},
    ],
)
def test_base_link_is_found_beside_its_markers(scored: Scored, robot: dict[str, Any]) -> None:
    trial = scored(robot)
    assert trial.pose[20] == pytest.approx([0.0, 1.0, 0.5], abs=0.002)
    assert trial.outcome == "reached"


@pytest.mark.parametrize("names", [("m3", "m1", "m4", "m2"), ("m4", "m1", "m2")])
def test_a_file_with_other_columns_than_the_one_that_ties(scored: Scored, names: Sequence[str]) -> None:
    trial = scored({"static": STATIC, "straight": STRAIGHT}, names=names)
    assert trial.pose[20] == pytest.approx([0.0, 1.0, 0.5], abs=0.003)


def test_a_turn_alone_ties_no_heading(scored: Scored) -> None:
    with pytest.raises(ClearwayError, match="position alone"):
        scored({"turn": TURN})


def test_a_static_pose_needs_the_map(scored: Scored) -> None:
    with pytest.raises(ClearwayError, match=r"frame of 'capture' is not tied to the map"):
        scored({"static": STATIC, "straight": STRAIGHT}, frame={})


def test_holds_of_markers_that_nothing_ties(scored: Scored) -> None:
    with pytest.raises(ClearwayError, match="nothing ties it"):
        scored({}, frame={"static_poses": [STATIC]})


def test_markers_that_nothing_ties_find_no_leg_by_its_goal(scored: Scored) -> None:
    """Their middle is not base_link: where it stands tells nothing of a goal."""
    trial = scored({})
    assert trial.outcome == "reached"
    assert not np.isfinite(trial.attempt.legs[0].goal).any()
    assert trial.spans[0].reached


def test_unsure_clocks_make_a_moving_obstacle_of_another_source_unsure(tmp_path: Path) -> None:
    """It drives at up to 0.63 m/s; 20 ms are 13 mm then, and nothing while it stands."""
    for name in ("robot.csv", "cart.csv"):
        capture(tmp_path / name, ahead((0.0, 1.0, 0.5), 2.0))
    coordinates = {f"robot:{name}": list(at) for name, at in MARKERS.items()}
    seen = {"markers": "robot:", "coordinates": coordinates, "outline": 0.0}
    content = {
        "sources": {n: {"format": "vicon", "frame": TIED, "clock": 0.0} for n in ("capture", "other")},
        "robot": seen,
        "bodies": {"cart": seen | {"source": "other", "shape": {"kind": "disc", "radius": 0.2}}},
        "trial": [{"file": "robot.csv", "files": {"other": "cart.csv"}, "obstacles": [{"body": "cart"}]}],
    }
    (tmp_path / "plan.toml").write_text(toml(content), encoding="utf-8")
    lab = Lab(tmp_path / "plan.toml")
    recordings = {"capture": lab.recording("capture", "robot.csv"), "other": lab.recording("other", "cart.csv")}
    t = np.arange(0.0, 9.0, 0.02)
    sure, unsure = (
        obstacles(lab, lab.plan.trials[0], recordings, {"other": Offset(0.0, sigma, 1.0, "")}, t, tied=True).sigma
        for sigma in (0.0, 0.02)
    )
    added = np.sqrt(unsure[:, 0, 0] ** 2 - sure[:, 0, 0] ** 2)
    assert added.max() == pytest.approx(0.02 * 2.0 * math.pi / 2 / 5.0, rel=0.02)
    assert added[20] == pytest.approx(0.0, abs=1e-4)
