"""Recordings of real robots and people from public repositories: what can be computed of each, and what can't, and why.

Nothing of them is shipped here. `--list` prints where they are and the git commands that fetch just these files to
FOLDER/OWNER+NAME/PATH; each recording whose files are there is then scored by a test plan of ours, which stands below.
docs/recordings-tried.md tells what came out and what was learnt.

    python benchmarks/public_recordings.py [FOLDER] [--only NAME] [--keep FOLDER] [--list] [--json] [--smoke]

`--smoke` needs no recordings: it prints the list and checks every plan.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

INDICATORS = ("CT", "PL", "DE", "OE", "MDO", "TCS", "success")
UNITS = {"CT": "s", "PL": "m", "DE": "m", "OE": "rad", "MDO": "m", "TCS": "%", "success": ""}


@dataclass(frozen=True)
class Source:
    """A recording: where it is, what it is, and how it is to be scored.

    Attributes:
        repository: owner/name on GitHub. licence: as the repository states it. paths: files, from its root.
        plan: TOML; `{0}`, `{1}` ... stand for the files. tables: descriptions of plain tables, by file name.
    """

    name: str
    repository: str
    commit: str
    licence: str
    what: str
    paths: tuple[str, ...]
    plan: str
    tables: dict[str, str] = field(default_factory=dict)

    @property
    def folder(self) -> str:
        return self.repository.replace("/", "+")

    def files(self, root: Path) -> list[Path]:
        return [root / self.folder / path for path in self.paths]


TURTLEBOT = '[robot]\nshape = {{ kind = "disc", radius = 0.171 }}\ntrack = "{track}"\n\n[[legs]]\nname = "drive"\n'

ASKED = '\n[[trial]]\nfile = "{0}"\nspeed = 0.5  # what /cmd_vel asks for, straight on\n'

CART = "data/trajectories_filtered/vci_{group}/{group}_interaction_0{n}_traj_{who}_filtered.csv"
CLIPS = {
    ("front", 1): (129, 334), ("front", 2): (101, 364), ("front", 3): (97, 399), ("front", 4): (172, 491),
    ("back", 1): (311, 731), ("back", 2): (58, 405), ("back", 3): (179, 493), ("back", 4): (110, 435),
}  # fmt: skip
"""First and last frame in which the cart is seen; it drives in and out, and never rests."""
FRAMES = 29.97
"""Hz; the videos' rate."""
HOTEL = (
    180,
    181,
    182,
    185,
    187,
    190,
    192,
    193,
    194,
    195,
    196,
    199,
    200,
    201,
    202,
    204,
    205,
    206,
    207,
    208,
    211,
    212,
    213,
    214,
    215,
)
"""Who is in the picture while person 203 crosses it."""


def _people(ids: Iterable[int], source: str) -> str:
    return "".join(
        f'\n[bodies.person{i}]\nsource = "{source}"\ntrack = "{i}"\nshape = {{ kind = "disc", radius = 0.25 }}\n'
        'heading = "travel"\nvisits = true\n'
        for i in ids
    )


def _around(ids: Iterable[int]) -> str:
    return "obstacles = [" + ", ".join(f'{{ body = "person{i}" }}' for i in ids) + "]\n"


def _carts() -> str:
    ids = range(1, 9)
    text = (
        '[test]\nnavigator = "a driver"\n\n[sources.vehicle]\ntable = "vehicle.toml"\nframe = { same = true }\n\n'
        '[sources.people]\ntable = "people.toml"\nframe = { same = true }\nclock = "same"\n\n'
        '# As the set\'s README measures it: 1 m to the front, 1.2 m to the back, 0.6 m to each side.\n[robot]\ntrack = "1"\n'
        'shape = { kind = "polygon", vertices = [[-1.2, -0.6], [1.0, -0.6], [1.0, 0.6], [-1.2, 0.6]] }\n'
    ) + _people(ids, "people")
    for i, ((group, n), (first, last)) in enumerate(CLIPS.items()):
        text += (
            f'\n[[trial]]\nfile = "{{{2 * i}}}"\nfiles = {{ people = "{{{2 * i + 1}}}" }}\nconfiguration = "{group}"\n'
            f"repetition = {n}\n{_around(ids)}"
            f'legs = [{{ name = "drive", span = [{first / FRAMES + 1e-3:.3f}, {last / FRAMES - 1e-3:.3f}] }}]\n'
        )
    return text


PICTURE = (
    f'up = "-z"  # y runs down the picture\nid = "id"\n[time]\ncolumn = "frame"\nunit = "frame"\nrate = {FRAMES}\n'
)

SOURCES = (
    Source(
        "turtlebot-odometry",
        "comprobo22/robot_localization",
        "f594d9a01773b62a16730cd0008f3127d4a8132a",
        "none stated",
        "TurtleBot 4 driven by hand through a corridor; ROS 2 bag: odometry, scan, no goal",
        ("bags/macfirst_floor_take_2/macfirst_floor_take_2_0.db3", "bags/macfirst_floor_take_2/metadata.yaml"),
        TURTLEBOT.format(track="/odom") + ASKED,
    ),
    Source(
        "turtlebot-localised",
        "Moampane/robot_localization",
        "3862738e6082efb4f33ec90385e5559d20a2d1e7",
        "none stated",
        "the same drive, played back a year later to a particle filter: map->base_link of the TF tree",
        ("bags/mac_take_2_bag/mac_take_2_bag_0.db3", "bags/mac_take_2_bag/metadata.yaml"),
        TURTLEBOT.format(track="map->base_link") + ASKED,
    ),
    Source(
        "drone-motive",
        "Kronium345/optitrack-odometry-movement",
        "c855edb7beb0ff29de5f8c3aa7c70842265a64bb",
        "none stated",
        "a drone under OptiTrack, Motive CSV of a rigid body",
        ("optitrack_20240717_0.csv",),
        '[robot]\ntrack = "drone"\n\n[[legs]]\nname = "flight"\n\n[[trial]]\nfile = "{0}"\n',
    ),
    Source(
        "drone-motive-px4",
        "Kronium345/optitrack-odometry-movement",
        "c855edb7beb0ff29de5f8c3aa7c70842265a64bb",
        "none stated",
        "another flight, with the drone's own odometry (PX4) as a second source, whose clock is tied by speed",
        ("optitrack_recording.csv", "odometry.csv"),
        "[sources.capture]\nframe = { same = true }\n\n"
        '[sources.log]\ntable = "px4.toml"\nframe = { same = true }\nclock = "speed"\nestimate = "drone"\n\n'
        '[robot]\ntrack = "drone"\n\n[[legs]]\nname = "flight"\n\n'
        '[[trial]]\nfile = "{0}"\nfiles = { log = "{1}" }\n',
        {
            "px4.toml": 'units = "mm"\nup = "-z"\n[time]\ncolumn = "sec"\n[bodies.drone]\nx = "pos_x"\ny = "pos_y"\n'
            'z = "pos_z"\nquaternion = ["x", "y", "z", "w"]\n'
        },
    ),
    Source(
        "ship-qualisys",
        "shiplab/dt_cv",
        "7bb6c1065c9cabc3f938e35505ef31b1188a3589",
        "none stated",
        "a model ship under autopilot in the waves of a basin; Qualisys 6DOF TSV",
        ("data/basin/raw/M510A-IRR-EKFPID-020019_6D.tsv",),
        '[robot]\ntrack = "PSVH"\nshape = { kind = "rectangle", length = 1.24, width = 0.345 }\n\n'
        '[[legs]]\nname = "turn on the spot"\n\n[[trial]]\nfile = "{0}"\n',
    ),
    Source(
        "cart-among-people",
        "dongfang-steven-yang/vci-dataset-citr",
        "b6a980628f48e7c80c748c3e333979ca3a6b0301",
        "none stated",
        "a golf cart meets eight people, head-on and from behind, filmed from above; eight clips, tables",
        tuple(CART.format(group=g, n=n, who=who) for g, n in CLIPS for who in ("veh", "ped")),
        _carts(),
        {
            "vehicle.toml": PICTURE + '[bodies.each]\nx = "x_est"\ny = "y_est"\nyaw = "psi_est"\nv = "vel_est"\n',
            "people.toml": PICTURE + '[bodies.each]\nx = "x_est"\ny = "y_est"\n',
        },
    ),
    Source(
        "person-among-people",
        "crowdbotp/OpenTraj",
        "97ec1d5e1b579f26febeaa9083705952deac338a",
        "MIT for its code; it says that none is known for the ETH set",
        "the ETH set's hotel entrance: person 203 as the robot, everybody else as obstacles; pedestrian text",
        ("datasets/ETH/seq_hotel/obsmat.txt",),
        '[sources.camera]\nformat = "pedestrians"\nframe = { same = true }\n\n[robot]\ntrack = "203"\n'
        'shape = { kind = "disc", radius = 0.25 }\nheading = "travel"\n'
        + _people(HOTEL, "camera")
        + '\n[[trial]]\nfile = "{0}"\n'
        + _around(HOTEL)
        + 'legs = [{ name = "walk", span = [383.65, 393.63] }]\n',
    ),
)


def write_plan(source: Source, root: Path, folder: Path) -> Path:
    """The source's plan, with its tables, in `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    text = source.plan
    for i, file in enumerate(source.files(root)):
        bag = (file.parent / "metadata.yaml").name in {Path(p).name for p in source.paths}
        text = text.replace(f'"{{{i}}}"', json.dumps(str((file.parent if bag else file).absolute())))
    plan = folder / "plan.toml"
    plan.write_text(text, "utf-8")
    for name, table in source.tables.items():
        (folder / name).write_text(table, "utf-8")
    return plan


def fetched(source: Source) -> str:
    """Commands of the shell that fetch its files."""
    quoted = " ".join(f"'{path}'" for path in source.paths)
    return (
        f"git clone --filter=blob:none --no-checkout https://github.com/{source.repository} {source.folder}\n"
        f"git -C {source.folder} checkout {source.commit} -- {quoted}"
    )


def show(sources: tuple[Source, ...]) -> None:
    print("In FOLDER (a repository that is cloned already needs the second line only):")
    for source in sources:
        print(f"\n# {source.name}: {source.what}\n# licence: {source.licence}\n{fetched(source)}")


def score(source: Source, root: Path, folder: Path) -> dict[str, Any]:
    """What came of a recording: its rows, formats and notes."""
    import clearway

    plan = write_plan(source, root, folder / source.name)
    results = clearway.score(plan, out=folder / source.name / "results")
    rows = results.trials.to_pylist()
    formats, notes = [], []
    for trial in results:
        told = trial.provenance
        formats += [s["format"] for s in told["sources"].values()]
        notes += [note for s in told["sources"].values() for note in s["notes"]]
        notes += [note for note in told["motion"]["robot"]["notes"] if note != "frame: as given in the plan"]
        notes += [f"{name}: {c['note']}" for name, c in told["clock"].items()]
        notes += told["legs"]
    return {
        "format": "+".join(dict.fromkeys(formats)),
        "notes": list(dict.fromkeys(notes)),
        "rows": [{"duration": r["duration"]} | {i: r[i] for i in INDICATORS} for r in rows],
        "why": [json.loads(r["not_computable"]) for r in rows],
    }


def span(values: list[Any], of: int) -> str:
    """Several trials' values in a cell: how many percent, or from the smallest to the largest."""
    known = [v for v in values if v is not None]
    if not known:
        return "-"
    if isinstance(known[0], bool):
        return f"{100 * sum(known) / len(known):.0f} %"
    low, high = f"{min(known):.4g}", f"{max(known):.4g}"
    cell = low if low == high else f"{low}..{high}"
    return cell if len(known) == of else f"{cell} ({len(known)})"


def line(name: str, found: dict[str, Any]) -> None:
    rows = found["rows"]
    cells = [span([r[i] for r in rows], len(rows)) for i in INDICATORS]
    duration = span([r["duration"] for r in rows], len(rows))
    print(
        f"\n{name:<20} {found['format']:<14} {len(rows):>6} {duration:>13}" + "".join(f"{c:>16}" for c in cells),
        flush=True,
    )
    reasons: dict[str, list[str]] = defaultdict(list)
    for indicator in INDICATORS:
        for why in dict.fromkeys(w[indicator] for w in found["why"] if indicator in w):
            reasons[why].append(indicator.replace("success", "SR"))
    for why, which in reasons.items():
        print(f"  not computable: {', '.join(which)}: {why}")
    for note in found["notes"]:
        print(f"  told: {note}")


def main() -> int:
    from clearway.errors import ClearwayError
    from clearway.recordings.lab.plan_file import load_test_plan

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", help="where the recordings are; see --list")
    parser.add_argument("--only", action="append", help="one of: " + ", ".join(s.name for s in SOURCES))
    parser.add_argument("--keep", type=Path, help="a new folder for the plans, the results and their pages")
    parser.add_argument("--list", action="store_true", help="only say where the recordings are")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--smoke", action="store_true", help="print the list and check the plans, without recordings")
    options = parser.parse_args()
    sources = tuple(s for s in SOURCES if not options.only or s.name in options.only)
    if options.list or options.smoke or options.folder is None:
        show(sources)
        if options.smoke:
            with tempfile.TemporaryDirectory() as folder:
                for source in sources:
                    load_test_plan(write_plan(source, Path(folder), Path(folder) / source.name))
            print(f"\n{len(sources)} plans are valid")
        return 0
    if not options.json:
        heads = "".join(f"{f'{i} [{UNITS[i]}]' if UNITS[i] else 'SR':>16}" for i in INDICATORS)
        print(f"{'recording':<20} {'format':<14} {'trials':>6} {'duration [s]':>13}{heads}")
    failed = False
    everything: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as scratch:
        for source in sources:
            missing = [file for file in source.files(options.folder) if not file.exists()]
            if missing:
                if not options.json:
                    print(f"\n{source.name:<20} not here: {missing[0]}; see --list")
                continue
            try:
                found = score(source, options.folder, options.keep or Path(scratch))
            except ClearwayError as error:
                failed = True
                print(f"\n{source.name:<20} FAILED: {error}", file=sys.stderr)
                continue
            everything[source.name] = found
            if not options.json:
                line(source.name, found)
    if options.json:
        print(json.dumps(everything))
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
