"""How fast recordings are read, and how much memory that takes; beside other readers of the same files.

Files are made first, piece by piece, in a temporary folder: captures of 30 minutes at 200 Hz with 40 markers (2 % gaps),
a TUM trajectory and a table as long, and a bag of 1 GB as MCAP, as ROS 2 sqlite3 and as ROS 1 bag: odometry and TF at 50 Hz,
a lidar of 1081 beams at 20 Hz, a camera's images for the rest. Each is read in a fresh process: wall time without imports,
peak resident memory, and how much of it there was before reading. Peers (ezc3d, c3d, pandas, evo) read the same file in
turns; a peer that is missing is named.

    python benchmarks/import_speed.py [--formats c3d,vicon] [--minutes M] [--markers N] [--megabytes MB] [--rounds N]
                                      [--keep FOLDER] [--json] [--smoke]
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import math
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

RATE = 200.0
PIECE = 12_000  # frames
CAPTURES = {"vicon": ".csv", "motive": ".csv", "qualisys": ".tsv", "trc": ".trc", "c3d": ".c3d"}
ROWS = {"tum": ".tum", "table": ".csv"}
BAGS = {"bag: mcap": "", "bag: sqlite3": "", "bag: ros1": ".bag"}
PEERS = {"c3d": ("ezc3d", "c3d"), "vicon": ("pandas",), "tum": ("evo",), "table": ("pandas",)}


# --- files -----------------------------------------------------------------------------------------------------------


def markers(start: int, count: int, n: int) -> Any:
    """(count, n, 3) m from frame `start` on: a robot's on circles, the others standing; NaN in gaps."""
    import numpy as np

    rng = np.random.default_rng([7, start])
    t = (start + np.arange(count))[:, None] / RATE
    phase = np.arange(n)[None, :]
    moves = (phase < 8) * 2.0
    xyz = np.stack(
        [moves * np.cos(0.3 * t) + 0.1 * phase, moves * np.sin(0.3 * t) - 0.07 * phase, 0.2 + 0.01 * phase + 0 * t], 2
    )
    xyz += rng.normal(0.0, 0.0005, xyz.shape)
    for k in range(n):
        for begin in rng.integers(0, count, max(1, round(count * 0.02 / 20))):
            xyz[begin : begin + 20, k] = np.nan
    return xyz


def make(kind: str, path: Path, frames: int, n: int, megabytes: float) -> None:
    """Write the file that `kind` is measured by."""
    if kind in BAGS:
        make_bag(kind, path, megabytes)
        return
    import numpy as np

    from clearway.recordings import formats
    from clearway.recordings.recording import Points, Recording, Track

    write = formats.formats()[kind].write
    assert write is not None
    t = np.arange(frames) / RATE
    if kind in ROWS:
        angle = 0.3 * t
        position = np.column_stack([2 * np.cos(angle), 2 * np.sin(angle), 0 * t])
        half = angle / 2 + math.pi / 4
        turn = np.column_stack([0 * t, 0 * t, np.sin(half), np.cos(half)])
        write(path, Recording(path, kind, tracks={"robot": Track("pose", "map", "base_link", t, position, turn)}))
        return
    xyz = np.memmap(path.with_suffix(".raw"), np.float64, "w+", shape=(frames, n, 3))  # the disk's memory, not ours
    for start in range(0, frames, PIECE):
        count = min(PIECE, frames - start)
        xyz[start : start + count] = markers(start, count, n)
    names = tuple(f"body{k // 8}:m{k % 8}" for k in range(n))
    write(path, Recording(path, kind, points=Points(names, t, xyz)))
    path.with_suffix(".raw").unlink()


def make_bag(kind: str, path: Path, megabytes: float) -> None:
    """Odometry, TF, scans and images, message by message."""
    import numpy as np
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    ros1 = kind == "bag: ros1"
    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    if ros1:
        store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage"))
    plugin = StoragePlugin.SQLITE3 if kind == "bag: sqlite3" else StoragePlugin.MCAP
    types = store.types
    stamps = types["builtin_interfaces/msg/Time"]

    def header(ns: int, frame: str) -> Any:
        extra = {"seq": 0} if ros1 else {}
        return types["std_msgs/msg/Header"](stamp=stamps(sec=ns // 10**9, nanosec=ns % 10**9), frame_id=frame, **extra)

    xyz, xyzw = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Quaternion"]
    ranges = np.full(1081, 4.0, np.float32)
    pixels = np.zeros(640 * 480, np.uint8)

    def messages() -> Iterator[tuple[int, str, str, Any]]:
        k, size = 0, 0.0
        while size < megabytes * 1e6:
            ns, angle = 1_700_000_000 * 10**9 + k * 20_000_000, 0.006 * k
            turn = xyzw(x=0.0, y=0.0, z=math.sin(angle / 2), w=math.cos(angle / 2))
            at = (2 * math.sin(angle), 2 - 2 * math.cos(angle))
            pose = types["geometry_msgs/msg/Pose"](
                position=types["geometry_msgs/msg/Point"](x=at[0], y=at[1], z=0.0), orientation=turn
            )
            twist = types["geometry_msgs/msg/Twist"](linear=xyz(x=0.6, y=0.0, z=0.0), angular=xyz(x=0.0, y=0.0, z=0.3))
            yield ns, "/odom", "nav_msgs/msg/Odometry", types["nav_msgs/msg/Odometry"](
                header=header(ns, "odom"), child_frame_id="base_link",
                pose=types["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=np.zeros(36)),
                twist=types["geometry_msgs/msg/TwistWithCovariance"](twist=twist, covariance=np.zeros(36)),
            )  # fmt: skip
            moved = types["geometry_msgs/msg/Transform"](translation=xyz(x=at[0], y=at[1], z=0.0), rotation=turn)
            yield ns, "/tf", "tf2_msgs/msg/TFMessage", types["tf2_msgs/msg/TFMessage"](transforms=[
                types["geometry_msgs/msg/TransformStamped"](
                    header=header(ns, "odom"), child_frame_id="base_link", transform=moved)
            ])  # fmt: skip
            size += 900
            if k % 5 in (0, 2):
                yield ns, "/scan", "sensor_msgs/msg/LaserScan", types["sensor_msgs/msg/LaserScan"](
                    header=header(ns, "base_scan"), angle_min=-2.36, angle_max=2.36, angle_increment=4.72 / 1080,
                    time_increment=0.0, scan_time=0.05, range_min=0.06, range_max=20.0, ranges=ranges,
                    intensities=np.zeros(0, np.float32),
                )  # fmt: skip
                size += 4400
            if k % 50 == 0:
                yield ns, "/camera/image_raw", "sensor_msgs/msg/Image", types["sensor_msgs/msg/Image"](
                    header=header(ns, "camera"), height=480, width=640, encoding="mono8", is_bigendian=0, step=640,
                    data=pixels,
                )  # fmt: skip
                size += 307_300
            k += 1

    with Writer1(path) if ros1 else Writer(path, version=8, storage_plugin=plugin) as bag:
        connections: dict[str, Any] = {}
        for ns, topic, kind_of, message in messages():
            if topic not in connections:
                connections[topic] = bag.add_connection(topic, kind_of, typestore=store)
            coded = store.serialize_ros1(message, kind_of) if ros1 else store.serialize_cdr(message, kind_of)
            bag.write(connections[topic], ns, bytes(coded))


# --- reading, each in a process of its own ---------------------------------------------------------------------------


def read(kind: str, path: Path) -> tuple[float, int]:
    """Read with Clearway: s and frames (of a bag: messages that were wanted)."""
    from clearway.recordings import formats
    from clearway.recordings.recording import Want

    formats.formats()
    name, _, which = kind.partition(" + ")
    begun = time.perf_counter()
    if name in BAGS:
        topics = ("/odom", "/scan") if which else ("/odom",)
        found = formats.read(path, Want(names=frozenset(topics)), format="bag")
        count = len(found.tracks["/odom"].t) + (len(found.scans["/scan"].t) if which else 0)
    else:
        found = formats.read(path, format=name)
        count = len(found.points.t) if found.points is not None else len(next(iter(found.tracks.values())).t)
    return time.perf_counter() - begun, count


def read_as(peer: str, kind: str, path: Path) -> tuple[float, int]:
    """Read with a peer: s and frames, its numbers as arrays."""
    import numpy as np

    if peer == "ezc3d":
        import ezc3d

        begun = time.perf_counter()
        count = ezc3d.c3d(str(path))["data"]["points"].shape[2]
    elif peer == "c3d":
        import c3d

        begun = time.perf_counter()
        with open(path, "rb") as f:
            count = len(np.array([points[:, :4] for _, points, _ in c3d.Reader(f).read_frames()]))
    elif peer == "pandas":
        import pandas

        begun = time.perf_counter()
        count = len(
            pandas.read_csv(
                path, skiprows=5 if kind == "vicon" else 0, header=None if kind == "vicon" else 0
            ).to_numpy()
        )
    else:
        from evo.tools import file_interface

        begun = time.perf_counter()
        count = file_interface.read_tum_trajectory_file(str(path)).num_poses
    return time.perf_counter() - begun, count


def one(kind: str, path: Path, peer: str) -> int:
    """Measure in this process; prints JSON."""
    if peer:
        importlib.import_module({"evo": "evo.tools.file_interface"}.get(peer, peer))
    with tempfile.TemporaryDirectory() as folder:  # what comes once a process is not part of reading a file
        small = Path(folder) / f"small{path.suffix}"
        make(kind.partition(" + ")[0], small, 500, 5, 0.01)
        _ = read_as(peer, kind, small) if peer else read(kind, small)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    seconds, count = read_as(peer, kind, path) if peer else read(kind, path)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(json.dumps({"seconds": seconds, "frames": count, "before": before / 1024, "peak": peak / 1024}))
    return 0


def measure(kind: str, path: Path, peer: str, rounds: int) -> dict[str, Any] | str:
    """The fastest of several rounds, or why there is none."""
    best: dict[str, Any] = {}
    for _ in range(rounds):
        done = subprocess.run(
            [sys.executable, __file__, "--one", kind, "--path", str(path), "--peer", peer],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        if not done.stdout.strip():  # Arrow's threads may abort a process that has said all and ends
            return (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
        said = json.loads(done.stdout.splitlines()[-1])
        if not best or said["seconds"] < best["seconds"]:
            best = said | {"peak": max(said["peak"], best.get("peak", 0.0))}
    return best


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--formats", help="some of: " + ", ".join([*CAPTURES, *ROWS, "bag"]))
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--markers", type=int, default=40)
    parser.add_argument("--megabytes", type=float, default=1000.0, help="of the bags")
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--keep", type=Path, help="a folder for the files; those that are there are not made anew")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--smoke", action="store_true", help="four formats, tiny files: only to see that it runs")
    parser.add_argument("--make", nargs=2, help=argparse.SUPPRESS)
    parser.add_argument("--one", help=argparse.SUPPRESS)
    parser.add_argument("--path", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--peer", default="", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.smoke:
        options.minutes, options.markers, options.megabytes, options.rounds = 0.05, 9, 1.0, 1
        options.formats = options.formats or "c3d,vicon,tum,bag: mcap"
    if options.one:
        return one(options.one, options.path, options.peer)
    frames = max(2, round(options.minutes * 60 * RATE))
    if options.make:
        make(options.make[0], Path(options.make[1]), frames, options.markers, options.megabytes)
        return 0
    wanted = options.formats.split(",") if options.formats else [*CAPTURES, *ROWS, "bag"]
    endings = CAPTURES | ROWS | BAGS
    kinds = [k for k in endings if k.split(":")[0] in wanted or k in wanted]
    folder = options.keep or Path(tempfile.mkdtemp())
    folder.mkdir(parents=True, exist_ok=True)
    found: dict[str, Any] = {}
    if not options.json:
        print(
            f"{'format':<22}{'MB':>8}{'frames':>9}{'s':>8}{'MB/s':>8}{'frames/s':>11}{'peak MB':>9}{'of reading':>11}  beside Clearway"
        )
    try:
        for kind in kinds:
            path = folder / f"{kind.replace(': ', '-')}{endings[kind]}"
            if not path.exists():
                arguments = [
                    "--minutes",
                    str(options.minutes),
                    "--markers",
                    str(options.markers),
                    "--megabytes",
                    str(options.megabytes),
                ]
                subprocess.run([sys.executable, __file__, "--make", kind, str(path), *arguments], check=True)
            size = sum(p.stat().st_size for p in path.rglob("*")) if path.is_dir() else path.stat().st_size
            for what in (kind, f"{kind} + scans") if kind in BAGS else (kind,):
                ours = measure(what, path, "", options.rounds)
                found[what] = _report(what, size, ours, ours, options.json)
                for peer in PEERS.get(what, ()):
                    theirs = measure(kind, path, peer, options.rounds)
                    found[f"{what} by {peer}"] = _report(f"  {peer}", size, theirs, ours, options.json)
            if not options.keep:
                shutil.rmtree(path) if path.is_dir() else path.unlink()
    finally:
        if not options.keep:
            shutil.rmtree(folder, ignore_errors=True)
    if options.json:
        print(json.dumps(found))
    return int(any("failed" in f for what, f in found.items() if " by " not in what))


def _report(what: str, size: int, one: dict[str, Any] | str, ours: dict[str, Any] | str, quiet: bool) -> dict[str, Any]:
    megabytes = size / 1e6
    if isinstance(one, str):
        if not quiet:
            print(f"{what:<22}{megabytes:>8.1f}  none: {one}", flush=True)
        return {"failed": one}
    result = one | {
        "megabytes": megabytes,
        "rate": megabytes / one["seconds"],
        "frame_rate": one["frames"] / one["seconds"],
    }
    if not quiet:
        ratio = ""
        if one is not ours and isinstance(ours, dict):
            ratio = f"  {one['seconds'] / ours['seconds']:.2g} x the time, {(one['peak'] - one['before']) / max(1.0, ours['peak'] - ours['before']):.2g} x the memory"
        print(
            f"{what:<22}{megabytes:>8.1f}{one['frames']:>9}{one['seconds']:>8.2f}{result['rate']:>8.1f}"
            f"{result['frame_rate']:>11.0f}{one['peak']:>9.0f}{one['peak'] - one['before']:>11.0f}{ratio}",
            flush=True,
        )
    return result


if __name__ == "__main__":
    sys.exit(main())
