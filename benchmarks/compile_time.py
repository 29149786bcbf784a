"""How long compiling takes, and why some kernels are compiled more than once.

Runs a few trials with an empty cache, each row in a fresh process, and listens to Numba: seconds of compiling and how
many kernels were compiled: to intermediate code, and those that Python calls to machine code as well. A kernel is compiled anew for each
combination of types that it meets; whoever calls it with a literal, with a default left out, with a read-only or a strided array, or with
an int for a float, may cost a second one. Such kernels are listed with the arguments that differ.

    python benchmarks/compile_time.py [--row NAME ...] [--slowest N] [--json] [--smoke]
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections import Counter, defaultdict
from pathlib import Path
from typing import Any

ROWS: dict[str, tuple[tuple[str, ...], dict[str, Any]]] = {
    "rescue": (("sar-case2",), {"navigators": ["hp-st", "hp-tmpc"], "configurations": ["scenario-1"]}),
    "hospital": (
        ("hospital",),
        {
            "robots": ["tiago"], "navigators": ["move-base"], "batches": ["CE"], "speeds": [0.6], "sizes": [0.3],
            "gaps": [1.0], "repetitions": 1,
        },
    ),
}  # fmt: skip
SMOKE: dict[str, tuple[tuple[str, ...], dict[str, Any]]] = {
    "rescue": (("sar-case1",), {"navigators": ["oracle"], "configurations": ["scenario-1"]}),
}
MACHINE = ", machine code"
KINDS = {
    "literal": r"^Literal|^literal",
    "default": r"^omitted",
    "readonly": r"(read-?only|readonly)|, const",
    "layout": r"array\(.*, [AF]\b",
}


def compiled(suites: tuple[str, ...], options: dict[str, Any]) -> dict[str, Any]:
    """Run the trials in this process; what was compiled: (kernel, types of its arguments, s without what it calls)."""
    from numba.core import event

    import clearway
    from clearway.geometry.dispatcher import Kernel

    class Listener(event.Listener):  # type: ignore[misc]
        def __init__(self) -> None:
            self.done: list[tuple[str, tuple[str, ...], float]] = []
            self.inner: list[float] = [0.0]
            self.began: list[float] = []

        def on_start(self, event: Any) -> None:
            self.began.append(time.process_time())
            self.inner.append(0.0)

        def on_end(self, event: Any) -> None:
            took = time.process_time() - self.began.pop()
            own = took - self.inner.pop()
            self.inner[-1] += took
            function = event.data["dispatcher"].py_func
            names = function.__code__.co_varnames
            types = tuple(f"{n}: {t}" for n, t in zip(names, event.data["args"], strict=False))
            machine = isinstance(event.data["dispatcher"], Kernel)
            self.done.append((f"{function.__module__}.{function.__qualname__}{MACHINE * machine}", types, own))

    listener = Listener()
    event.register("numba:compile", listener)
    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        clearway.run(*suites, **options, workers=0, out=Path(folder) / "results")
    return {"wall": time.perf_counter() - began, "compiled": listener.done}


def in_fresh_process(suites: tuple[str, ...], options: dict[str, Any]) -> dict[str, Any]:
    """`compiled` with an empty cache."""
    with tempfile.TemporaryDirectory() as cache:
        said = subprocess.run(
            [sys.executable, __file__, "--here", json.dumps([suites, options])],
            capture_output=True, text=True, check=True, env=os.environ | {"NUMBA_CACHE_DIR": cache},
        )  # fmt: skip
    found: dict[str, Any] = json.loads(said.stdout.splitlines()[-1])
    return found


def why(types: list[list[str]]) -> str:
    """The arguments in which the signatures of a kernel differ, each with the types that it had."""
    differing = []
    if len({len(t) for t in types}) > 1:
        return "number of arguments"
    for column in zip(*types, strict=True):
        had = sorted({t.partition(": ")[2] for t in column})
        if len(had) > 1:
            differing.append(f"{column[0].partition(': ')[0]} = {' | '.join(had)}")
    return "; ".join(differing)


def kinds(reason: str) -> list[str]:
    """What kinds of difference a reason holds."""
    parts = [p for part in reason.split("; ") for p in part.partition(" = ")[2].split(" | ")]
    return [k for k, pattern in KINDS.items() if any(re.search(pattern, p) for p in parts)] or ["other"]


def summary(found: dict[str, Any]) -> dict[str, Any]:
    """Seconds and counts: of Clearway's kernels and of Numba's own; and the kernels with several signatures."""
    ours, numbas = defaultdict(list), 0.0
    seconds: Counter[str] = Counter()
    for name, types, took in found["compiled"]:
        if name.startswith("clearway."):
            ours[name].append(types)
            seconds[name] += took
        else:
            numbas += took
    machine = {name for name in ours if name.endswith(MACHINE)}
    several = {
        name: {"signatures": len(types), "seconds": round(seconds[name], 2), "why": why(types)}
        for name, types in ours.items()
        if len(types) > 1
    }
    reasons: Counter[str] = Counter()
    for entry in several.values():
        reasons.update(kinds(str(entry["why"])))
    return {
        "wall_s": round(found["wall"], 1),
        "compiling_s": round(sum(seconds.values()) + numbas, 1),
        "numbas_own_s": round(numbas, 1),
        "of_machine_code_s": round(sum(seconds[name] for name in machine), 1),
        "kernels": len(ours) - len(machine),
        "compilations": sum(len(ours[name]) for name in ours.keys() - machine),
        "to_machine_code": sum(len(ours[name]) for name in machine),
        "reasons": dict(reasons),
        "several": dict(sorted(several.items(), key=lambda e: -e[1]["signatures"])),
        "slowest": dict(seconds.most_common()),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--row", action="append", choices=list(ROWS), help="only this; may be repeated")
    parser.add_argument("--slowest", type=int, default=10, help="so many of the slowest kernels are listed")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--smoke", action="store_true", help="one trial that needs few kernels")
    parser.add_argument("--here", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.here:
        suites, options = json.loads(asked.here)
        print(json.dumps(compiled(tuple(suites), options)))
        return
    rows = SMOKE if asked.smoke else {name: ROWS[name] for name in asked.row or ROWS}
    results = {name: summary(in_fresh_process(*row)) for name, row in rows.items()}
    if asked.json:
        print(json.dumps(results))
        return
    for name, r in results.items():
        print(
            f"{name}: {r['compiling_s']:.1f} s of compiling ({r['wall_s']:.1f} s in all; {r['numbas_own_s']:.1f} s of Numba's "
            f"own, {r['of_machine_code_s']:.1f} s of machine code), {r['compilations']} compilations of {r['kernels']} kernels, "
            f"{r['to_machine_code']} to machine code"
        )
        print("  several times for: " + (", ".join(f"{k} {n}" for k, n in r["reasons"].items()) or "no kernel"))
        for kernel, entry in r["several"].items():
            print(f"  {entry['signatures']:3d} x {kernel} ({entry['seconds']:.2f} s): {entry['why'][:400]}")
        for kernel, took in list(r["slowest"].items())[: asked.slowest]:
            print(f"  {took:6.2f} s  {kernel}")


if __name__ == "__main__":
    main()
