"""How the recordings in this folder were made: no robot was driven. Simulated trials of the hospital protocol, recorded by a
made-up capture system (Vicon's layout, 50 Hz, 0.5 mm of noise, 2 % gaps, two markers that change names for a moment), and the
robot's own log (MCAP: where AMCL believed to be, and the goals) on a clock of its own. The third trial's obstacle was moved
until it stood 3 mm beside the robot's way.

    python examples/06_score_recordings/make.py [FOLDER]
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

import clearway
from clearway.geometry.distance import path_clearance
from clearway.recordings import formats
from clearway.recordings.exports import mcap
from clearway.recordings.exports.synthetic import System, captured, held
from clearway.recordings.recording import Points, Recording
from clearway.trials import Body, Trial

CAPTURE = System(rate=50.0, noise=0.0005, gaps=0.02, swaps=1, lead=1.5, tail=1.0, frame=(1.35, -0.8, 0.6))
KEPT = ("robot:m1", "robot:m2", "robot:m3", "robot:m5", "square_300:m1", "square_300:m2", "square_300:m4")
"""Four of the robot's markers and three of the square's are enough, and the files small."""
GAP = 0.003
"""m between the robot's way and the obstacle in the third trial."""


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:

        def run(batch: str, **which: object) -> clearway.Results:
            return clearway.run("hospital", robots=["tiago"], batches=[batch], out=f"{scratch}/{batch}", **which)

        free = run("NO", speeds=[1.0], repetitions=1).trial(0)
        square, again = run("SO", configurations=["single"], speeds=[1.0], sizes=[0.3], repetitions=2)
        for number, trial in enumerate((free, square, close(again)), 1):
            write(folder / f"trial_{number}.csv", captured(trial, replace(CAPTURE, seed=number)))
            if number < 3:
                write_log(folder / f"trial_{number}.mcap", trial, Path(scratch) / f"{number}.mcap")
        for name, pose in (("A", free.attempt.legs[0].start), ("B", free.attempt.legs[0].goal)):
            write(folder / f"hold_{name}.csv", held(free, pose, replace(CAPTURE, seed=ord(name)), seconds=2.0))


def close(trial: Trial) -> Trial:
    """The same drive, with the obstacle moved towards its way until `GAP` is left between them."""
    k = next(i for i, b in enumerate(trial.attempt.bodies) if b.kind == "obstacle")
    square = trial.attempt.bodies[k]

    def moved(shift: float) -> Body:
        return replace(square, pose=square.pose + np.array([0.0, shift, 0.0]))

    def gap(shift: float) -> float:
        alone = np.empty((len(trial.t), 0, 3))
        return float(path_clearance(trial.attempt.footprint, trial.pose, [moved(shift)], alone).min())

    far, touching = 0.0, min((-0.1, 0.1), key=gap)
    while abs(touching - far) > 1e-6:
        middle = (far + touching) / 2
        far, touching = (middle, touching) if gap(middle) > GAP else (far, middle)
    bodies = (*trial.attempt.bodies[:k], moved(far), *trial.attempt.bodies[k + 1 :])
    return replace(trial, attempt=replace(trial.attempt, bodies=bodies))


def write(path: Path, recording: Recording) -> None:
    """The kept markers in Vicon's layout."""
    points = recording.points
    assert points is not None
    keep = [i for i, name in enumerate(points.names) if name in KEPT]
    few = Points(tuple(points.names[i] for i in keep), points.t, points.xyz[:, keep])
    formats.formats()["vicon"].write(path, replace(recording, points=few))


def write_log(path: Path, trial: Trial, whole: Path) -> None:
    """Of everything that an export holds, what a robot could have logged of itself."""
    mcap.write_trial(whole.with_suffix(""), trial, scans=False)
    store = get_typestore(Stores.ROS2_HUMBLE)
    target = whole.with_name(f"{whole.stem}-log")
    with Reader(whole.with_suffix("")) as source, Writer(target, version=8, storage_plugin=StoragePlugin.MCAP) as log:
        wanted = [c for c in source.connections if c.topic in ("/amcl_pose", "/goal_pose", "/cmd_vel")]
        made = {c.id: log.add_connection(c.topic, c.msgtype, typestore=store) for c in wanted}
        for connection, stamp, data in source.messages(connections=wanted):
            log.write(made[connection.id], stamp, data)
    path.write_bytes(next(target.glob("*.mcap")).read_bytes())


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
