"""Runs the recorders on every case of `mppi_recorded.py` and `pursuit_recorded.py`, writes `mppi.npz` and `pursuit.npz`: make.py FOLDER."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pursuit_recorded as pursuit
from mppi_recorded import BATCH, CASES, DECISIONS, FOLDER, STEPS, Case, decisions_of, noise_of, table_of, view_of


def text(value):
    """A parameter as the recorder reads it."""
    if isinstance(value, bool):
        return str(value).lower()
    return " ".join(map(text, value)) if isinstance(value, tuple) else str(value)


def flat(table, prefix="FollowPath"):
    """Lines `name=value` of all namespaces."""
    for name, value in table.items():
        if isinstance(value, dict):
            yield from flat(value, f"{prefix}.{name}")
        else:
            yield f"{prefix}.{name}={text(value)}"


def numbers(*values):
    """All the digits of numbers and arrays."""
    return " ".join(format(float(v), ".17g") for v in np.concatenate([np.ravel(v) for v in values]))


def told(case: Case) -> str:
    """What the recorder reads."""
    view = view_of(case)
    rows, columns = view.cost.shape
    lines = [*flat(table_of(case) | {"visualize": True}), f"controller_frequency={case.frequency}"]
    said = [
        str(len(lines)),
        *lines,
        f"{rows} {columns} {numbers(view.origin, view.resolution)}",
        numbers(view.inscribed, view.circumscribed, view.scaling, view.inflation),
        f"{int(view.tracks_unknown)} {int(case.outline is None)}",
        f"{len(view.footprint)} {numbers(view.footprint)}",
        " ".join(map(str, view.cost.ravel())),
        "0.25",
        str(case.limit),
        str(DECISIONS),
    ]
    for pose, velocity, path in decisions_of(case):
        said += [numbers(pose, velocity), f"{len(path)} {numbers(path)}"]
    return "\n".join(said) + "\n"


def record(recorder: str, case: Case):
    """What the real optimizer makes of a case, decision by decision."""
    with tempfile.TemporaryDirectory() as place:
        given, made, noise = (Path(place) / name for name in ("in", "out", "noise"))
        given.write_text(told(case))
        noise.write_bytes(b"".join(n.tobytes() for n in noise_of(case)))
        subprocess.run([recorder, str(given), str(made), str(noise)], check=True)
        rest = np.fromfile(made, np.float32)
    found: dict[str, list[np.ndarray]] = {}
    for _ in range(DECISIONS):
        for name, *shape in (
            ("head", 4), ("poses", 3, STEPS, BATCH), ("critics", len(table_of(case)["critics"]), BATCH), ("costs", BATCH),
            ("control", 3, STEPS),
        ):  # fmt: skip
            size = int(np.prod(shape))
            found.setdefault(name, []).append(rest[:size].reshape(shape))
            rest = rest[size:]
    assert len(rest) == 0
    heads, poses = np.array(found.pop("head")), np.array(found.pop("poses"))
    assert not heads[:, 0].any(), "no valid control"
    kept = {name: np.array(values) for name, values in found.items()}
    return kept | {"command": heads[:, 1:], "ends": poses[:, :, [STEPS // 2, STEPS - 1]]}


def told_of_pursuit(case: pursuit.Case) -> str:
    """What the recorder of pure pursuit reads of a case."""
    view, lines = pursuit.view_of(case), [*flat(case.own), f"controller_frequency={pursuit.FREQUENCY}"]
    rows, columns = view.cost.shape
    said = [
        str(len(lines)),
        *lines,
        f"{rows} {columns} {numbers(view.origin, view.resolution)}",
        f"{numbers(view.inscribed, view.circumscribed)} {int(view.tracks_unknown)}",
        f"{len(view.footprint)} {numbers(view.footprint)}",
        " ".join(map(str, view.cost.ravel())),
        f"{int(case.there)} {int(case.cancelling)} {case.limit!r}",
        numbers(case.pose, case.measured, case.last),
        f"{len(case.path)} {numbers(case.path)}",
    ]
    return "\n".join(said)


def record_pursuit(recorder: Path):
    """(n, 4) what the real pure pursuit makes of each case, see `pursuit.cpp`."""
    with tempfile.TemporaryDirectory() as place:
        given, made = (Path(place) / name for name in ("in", "out"))
        cases = [told_of_pursuit(pursuit.case_of(k)) for k in range(pursuit.COUNT)]
        given.write_text("\n".join([str(pursuit.COUNT), *cases]) + "\n")
        subprocess.run([recorder, str(given), str(made)], check=True)
        return np.loadtxt(made)


if __name__ == "__main__":
    recorders = Path(sys.argv[1])
    recorded = {
        f"{name}/{key}": values
        for name, case in CASES.items()
        for key, values in record(str(recorders / "mppi"), case).items()
    }
    np.savez_compressed(FOLDER / "mppi.npz", **recorded)
    np.savez_compressed(FOLDER / "pursuit.npz", made=record_pursuit(recorders / "pursuit"))
