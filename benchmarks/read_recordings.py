"""Public recordings, read by Clearway and by somebody else's reader, or by a few lines that know nothing of Clearway's: figures
side by side, and the largest difference between any two numbers.

Nothing of them is shipped here. `--list` prints where they are; they are looked for in FOLDER/OWNER+NAME/PATH.
docs/recordings-tried.md tells what came out.

    python benchmarks/read_recordings.py [FOLDER] [--list]

ezc3d and c3d (C3D), rosbags (bags) and numpy are the others.
"""

from __future__ import annotations

import argparse
import re
import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from clearway.recordings import formats
from clearway.recordings.recording import Want

UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
AXES = {"z": ((0, 1), (1, 1), (2, 1)), "y": ((0, 1), (2, -1), (1, 1))}
"""Where the file's axes come: column and sign, by the axis that is up."""


@dataclass(frozen=True)
class Taken:
    """What a reader took from a file: t (n,) s, xyz (n, m, 3) m with NaN where unseen, q (n, 4) xyzw or None."""

    names: tuple[str, ...]
    t: Any
    xyz: Any
    q: Any = None

    def figures(self) -> tuple[float, ...]:
        """Samples, tracks, seconds, metres of path of the one that is seen most, its first and last heading in degrees."""
        best = int(np.isfinite(self.xyz[..., 0]).sum(axis=0).argmax())
        way = self.xyz[np.isfinite(self.xyz[:, best, 0]), best]
        length = float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())
        turns = () if self.q is None else tuple(_yaw(self.q[i]) for i in (0, -1))
        return len(self.t), self.xyz.shape[1], float(self.t[-1] - self.t[0]), length, *turns


def _yaw(q: Any) -> float:
    x, y, z, w = q / np.linalg.norm(q)
    return float(np.degrees(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))))


def ours(path: Path, track: str) -> tuple[Taken, tuple[str, ...]]:
    """What Clearway reads, and its notes; `track`: its name, empty for markers."""
    names = frozenset({track}) if "->" in track else None
    read = formats.read(path, Want(names=names))
    if not track:
        assert read.points is not None
        return Taken(read.points.names, read.points.t, read.points.xyz), (read.up, *read.notes)
    found = read.tracks[track]
    return Taken((track,), found.t, found.position[:, None], found.orientation), (read.up, *read.notes)


# --- the others ------------------------------------------------------------------------------------------------------


def by_ezc3d(path: Path, track: str) -> Taken:
    import ezc3d

    read = ezc3d.c3d(str(path))
    point = read["parameters"]["POINT"]
    xyz = read["data"]["points"][:3].transpose(2, 1, 0) * UNITS[point["UNITS"]["value"][0]]
    return Taken(tuple(point["LABELS"]["value"]), np.arange(len(xyz)) / point["RATE"]["value"][0], xyz)


def by_c3d(path: Path, track: str) -> Taken:
    import c3d

    with open(path, "rb") as handle, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        reader = c3d.Reader(handle)
        rows = np.array([p for _, p, _ in reader.read_frames(copy=True)], dtype=np.float64)
    xyz = rows[..., :3] * 1e-3
    xyz[rows[..., 3] < 0] = np.nan
    return Taken(tuple(n.strip() for n in reader.point_labels), np.arange(len(xyz)) / reader.point_rate, xyz)


def by_splitting(path: Path, track: str) -> Taken:
    """A TRC, cell by cell."""
    lines = path.read_text().splitlines()
    separator = "," if "," in lines[3] else "\t"
    unit = lines[2].split(separator)[4]
    names = tuple(n.strip() for n in lines[3].split(separator)[2:] if n.strip())
    rows = [line.split(separator) for line in lines[5:] if line.split(separator)[0].strip()]
    width = 2 + 3 * len(names)
    cells = np.array([[float(c) if c.strip() else np.nan for c in (r + [""] * width)[:width]] for r in rows])
    return Taken(names, cells[:, 1], cells[:, 2:].reshape(len(rows), -1, 3) * UNITS[unit])


def by_loadtxt(path: Path, track: str) -> Taken:
    rows = np.loadtxt(path)
    return Taken((track,), rows[:, 0], rows[:, None, 1:4], rows[:, 4:])


def by_rosbags(path: Path, track: str) -> Taken:
    """A topic of poses, or a pair of frames that stands in /tf as it is."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    parent, _, child = track.partition("->")
    rows = []
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as bag:
        for connection, _, raw in bag.messages([c for c in bag.connections if c.topic == ("/tf" if child else track)]):
            message: Any = bag.deserialize(raw, connection.msgtype)
            for m in message.transforms if child else [message]:
                if child and (m.header.frame_id.strip("/"), m.child_frame_id.strip("/")) != (parent, child):
                    continue
                p, q = (
                    (m.transform.translation, m.transform.rotation) if child else (m.pose.position, m.pose.orientation)
                )
                stamp = m.header.stamp.sec + 1e-9 * m.header.stamp.nanosec
                rows.append((stamp, p.x, p.y, p.z, q.x, q.y, q.z, q.w))
    found = np.array(rows)
    return Taken((track,), found[:, 0], found[:, None, 1:4], found[:, 4:])


KTK, OPENSIM, ZOO, PYOMECA, RPG, EVO = (
    "kineticstoolkit+kineticstoolkit", "opensim-org+opensim-core", "PhilD001+biomechZoo", "pyomeca+pyomeca",
    "uzh-rpg+rpg_trajectory_evaluation", "MichaelGrupp+evo",
)  # fmt: skip
COMMITS = {KTK: "169a99d", OPENSIM: "0435b08", ZOO: "a8753f2", PYOMECA: "3594512", RPG: "8c8ceec", EVO: "26d0953"}
SUITE, HOCKEY = "data/c3d_test_suite", "Toolbox/Visualization/Cinema objects/c3d files"
FILES: tuple[tuple[str, str, str, Callable[[Path, str], Taken]], ...] = (
    (KTK, f"{SUITE}/Sample01/Eb015pi.c3d", "", by_ezc3d),
    (KTK, f"{SUITE}/Sample01/Eb015vr.c3d", "", by_ezc3d),
    (KTK, f"{SUITE}/Sample02/sgi_real.c3d", "", by_c3d),
    (KTK, f"{SUITE}/Sample08/TESTDPI.c3d", "", by_ezc3d),
    (KTK, f"{SUITE}/ezc3d/BTS.c3d", "", by_ezc3d),
    (KTK, f"{SUITE}/ezc3d/Qualisys.c3d", "", by_ezc3d),
    (KTK, f"{SUITE}/others/duplicate_labels.c3d", "", by_ezc3d),
    (KTK, f"{SUITE}/others/many_analogs.c3d", "", by_ezc3d),
    (KTK, "data/kinematics_basket_sprint.c3d", "", by_ezc3d),
    (KTK, "data/kinematics_racing_full.c3d", "", by_ezc3d),
    (KTK, "data/kinematics_tennis_serve_2players.c3d", "", by_ezc3d),
    (OPENSIM, "OpenSim/Tests/shared/walking5.c3d", "", by_ezc3d),
    (OPENSIM, "OpenSim/Sandbox/MatlabScripts/test_walking.c3d", "", by_ezc3d),
    (ZOO, f"{HOCKEY}/ti003.c3d", "", by_ezc3d),
    (ZOO, f"{HOCKEY}/Whole body stick (6 markers) and puck left handed ti003.c3d", "", by_ezc3d),
    (PYOMECA, "tests/data/markers_analogs.c3d", "", by_ezc3d),
    (PYOMECA, "tests/data/markers.trc", "", by_splitting),
    (RPG, "results/euroc_vislam_mono/laptop/vislam_ba/laptop_vislam_ba_MH_04/stamped_groundtruth.txt", "trajectory", by_loadtxt),
    (EVO, "test/data/fr2_desk_groundtruth.txt", "trajectory", by_loadtxt),
    (EVO, "test/data/freiburg1_xyz-groundtruth.txt", "trajectory", by_loadtxt),
    (EVO, "test/data/freiburg1_xyz-rgbdslam.txt", "trajectory", by_loadtxt),
    (EVO, "test/data/georeferenced.tum", "trajectory", by_loadtxt),
    (EVO, "test/data/V102.txt", "trajectory", by_loadtxt),
    (EVO, "test/data/ROS_example.bag", "groundtruth", by_rosbags),
    (EVO, "test/data/ROS_example.bag", "S-PTAM", by_rosbags),
    (EVO, "test/data/tf_example.bag", "odom->base_footprint", by_rosbags),
    (EVO, "test/data/tf_example/tf_example.db3", "odom->base_footprint", by_rosbags),
)  # fmt: skip


def compared(path: Path, track: str, other: Callable[[Path, str], Taken]) -> tuple[str, str, str, str]:
    """Our figures, theirs, the largest difference, and what we noticed."""
    mine, (up, *notes) = ours(path, track)
    theirs = other(path, track)
    columns, labels = [], list(theirs.names)
    for name in mine.names:  # of points with one name the next one
        at = labels.index(re.sub(r" \(\d+\)$", "", name))
        labels[at] = ""
        columns.append(at)
    xyz = np.stack([sign * theirs.xyz[:, columns, i] for i, sign in AXES[up]], axis=-1)
    first = np.unique(theirs.t, return_index=True)[1]  # of samples with one stamp
    dropped = len(theirs.t) - len(first)
    theirs = Taken(mine.names, theirs.t[first], xyz[first], None if theirs.q is None else theirs.q[first])
    xyz = theirs.xyz
    differ = "another number of samples"
    if mine.xyz.shape == xyz.shape:
        gaps = np.isfinite(mine.xyz).all(axis=2) != np.isfinite(xyz).all(axis=2)
        far = [np.nanmax(np.abs(mine.xyz - xyz)), np.abs((mine.t - mine.t[0]) - (theirs.t - theirs.t[0])).max()]
        if mine.q is not None:
            unit = theirs.q / np.linalg.norm(theirs.q, axis=1, keepdims=True)
            far.append(np.nanmax(np.abs(mine.q - unit)))
        differ = f"{max(far):.1g}" + (f", {int(gaps.sum())} seen by one alone" if gaps.any() else "")
        differ += f", {dropped} with the stamp of another left out of theirs" if dropped else ""
    return _said(mine), _said(theirs), differ, "; ".join(notes)


def _said(taken: Taken) -> str:
    samples, many, seconds, length, *turns = taken.figures()
    plain = f"{samples:.0f} x {many:.0f}, {seconds:.3f} s, {length:.4f} m"
    return plain + (f", {turns[0]:.2f} to {turns[1]:.2f} deg" if turns else "")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path, default=Path(), help="where the files are")
    parser.add_argument("--list", action="store_true", help="print where the files are to be had")
    parser.add_argument("--smoke", action="store_true", help="the same: nothing is fetched")
    asked = parser.parse_args()
    if asked.list or asked.smoke:
        for repository, path, _, _ in FILES:
            print(f"https://github.com/{repository.replace('+', '/')}/blob/{COMMITS[repository]}/{path}")
        return
    print("| file | Clearway | the other | differ by | noticed |\n|---|---|---|---|---|")
    for repository, path, track, other in FILES:
        file = asked.folder / repository / path
        if file.is_file():
            row = compared(file, track, other)
            print(f"| {Path(path).name} {track} ({other.__name__[3:]}) | {' | '.join(row)} |")
        else:
            print(f"{file} is not there", file=sys.stderr)


if __name__ == "__main__":
    main()
