"""Hostile command lines."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from fault_sections.hostile.good import REFUSED, TAKEN


def as_given(arguments: list[str]) -> Callable[[Path], list[str]]:
    return lambda folder: arguments


def command_lines() -> Iterator[tuple[list[str], tuple[int, ...]]]:
    run = [
        "run",
        "hospital",
        "--robot",
        "tiago",
        "--batch",
        "NO",
        "--speed",
        "0.6",
        "--no-report",
        "--workers",
        "1",
        "--out",
        "out",
    ]
    one = [*run, "--repetitions", "1"]
    for value in ("1000000000", "9223372036854775807", "-1", "0", "nan", "1e9", "9" * 5000):
        yield [*run, "--repetitions", value], REFUSED
    for value in ("nan", "-1", "0", "inf", "1e300", "-inf", "x"):
        yield [*one, "--decision-limit", value], REFUSED
        yield [*one, "--budget", value], REFUSED
    for value in (
        "nan",
        "1e300s",
        "0s",
        "-1s",
        "1e9iterations",
        "9" * 5000 + "s",
        "inf s",
        "",
        "1.5iterations",
        "0iterations",
    ):
        yield [*one, "--setup", value], REFUSED
    drawn = ["run", "sar-case1", "--no-report", "--workers", "1", "--out", "out"]
    for value in (
        "0:1000000000000",
        "0:100000000",
        "5:1",
        "-1:5",
        "0:" + "9" * 5000,
        "a:b",
        "0:1:2",
        "\u0661:\u0665",
        "",
        ":",
        "9223372036854775807:9223372036854775809",
        "²:³",
    ):
        yield [*drawn, "--seeds", value], REFUSED
    for value in ("nan", "inf", "-1", "1e300"):
        yield [*drawn, "--disturbance", value], REFUSED
        yield [*drawn, "--latency", value], REFUSED
    met = ["run", "meeting-points", "--no-report", "--workers", "1", "--out", "out", "--team"]
    for value in (
        "", "+", "*", "tiago", "tiago*0", "tiago*-1", "tiago*1000000000", "tiago*" + "9" * 5000, "tiago*1.5", "tiago*2+", "nobody*2",
        "+".join(["tiago"] * 50_000), "x.toml*2", "/dev/zero.toml*2", "tiago*\u0662", "tiago*2\nhosbot", "x" * 100_000, "tiago*101",
    ):  # fmt: skip
        yield [*met, value], REFUSED
    for value in (
        "=",
        "tiago=",
        "=orca",
        "tiago=orca,tiago=orca",
        "nobody=orca",
        "tiago=orca," * 20_000,
        "tiago==orca",
        ",",
    ):
        yield [*met, "tiago*2", "--navigator", value], REFUSED
    led = ["run", "replayed", "--no-report", "--workers", "1", "--out", "out"]
    for name in ("", "x" * 5000, "/dev/zero", ".", "none.csv", "a\nb"):
        yield [*led, "--people", name, "--start", "0,0,0", "--goal", "1,1"], REFUSED
    for place in ("", "nan,0,0", "1e300,0,0", "0,0,1e9", "0,0,0,0", "a,b,c", "0", ",,", "9" * 5000 + ",0,0"):
        yield [*led, "--start", place], REFUSED
        yield [*led, "--people", "none.csv", "--start", place, "--goal", "1,1"], REFUSED
    for word in ("", "x", "all,all", "x" * 100_000):
        yield [*led, "--ideal", word], REFUSED
        yield ["run", "hospital", "--movers", word, "--no-report", "--out", "out"], REFUSED
    for value in ("nan", "inf", "-0.5", "1e300"):
        yield [*run, "--speed", value], REFUSED
        yield ["run", "hospital", "--robot", "tiago", "--size", value, "--no-report", "--out", "out"], REFUSED
    for value in ("9223372036854775808", "-1", "1e3", "9" * 5000):
        yield [*one, "--seed", value], REFUSED
    for name in (
        "",
        "x" * 100_000,
        "a\nb",
        "../../etc/passwd",
        "/dev/zero",
        ".toml",
        "x.toml",
        "hospital:",
        "\x1b[31m",
        "/",
        ".",
    ):
        yield ["run", name, "--no-report", "--out", "out"], REFUSED
        yield [*one, "--robot", name], REFUSED
        yield [*one, "--navigator", name], REFUSED
        yield [*one, "--floor-plan", name], REFUSED
        yield [*one, "--map", name], REFUSED
        yield ["check", name], REFUSED
        yield ["report", name], REFUSED if name not in ("",) else TAKEN
        yield ["score", name, "--out", "out"], REFUSED
        yield ["map", name, "--out", "out"], REFUSED
    long = "x" * 5000
    for line in (
        [*one[:-3], long], ["map", "hall", "--out", long], ["import", "x.csv", "--out", long], ["protocol", "hospital", "--out", long],
        ["score", "x.toml", "--out", long], ["run", long], ["map", "hall", "--out", "/proc/x"], ["protocol", "hospital", "--out", "/proc/x"],
    ):  # fmt: skip
        yield line, REFUSED
    yield [*one, "--navigator", "hp-st", "--without", "+".join(["reverse"] * 10_000)], REFUSED
    for name in (
        "hp-st[",
        "hp-st[]",
        "hp-st[x]",
        "hp-st[" + "a=[" * 10_000 + "]",
        "hp-st[x=" + "[" * 100_000 + "]",
        "hp-st[x=" + "9" * 5000 + "]",
        "hp-st[x=NaN]",
        "hp-st" + "[a=1]" * 5000,
        "os:system",
        "builtins:exit",
        "json:loads",
        ":",
        "a:",
        ":b",
        "x.py:Y",
        "..:x",
        "hp-st[without=" + "x" * 10_000 + "]",
    ):
        yield [*one, "--navigator", name], REFUSED
    for verb in (
        ["rerun", ".", "--trial", "0"],
        ["replay", ".", "--trial", "0"],
        ["export", ".", "--trial", "0", "--to", "csv", "--out", "x"],
        ["compare", ".", "."],
        ["report", "."],
        ["run", "--resume", "."],
    ):
        yield verb, REFUSED
    yield ["run", "hospital", "--out", "out", "--workers", "1000000000"], REFUSED
    yield [*one, "--workers", "-1"], REFUSED
    for reliability in ("nan", "1", "0", "-1", "inf", "0.9999999999999999", "1e-300"):
        yield ["samples", "--reliability", reliability], TAKEN if reliability == "1e-300" else REFUSED
        yield (
            ["samples", "--confidence", reliability],
            TAKEN if reliability in ("0.9999999999999999", "1e-300") else REFUSED,
        )
    yield ["samples", "--failures", "1000000000"], REFUSED
    yield ["samples", "--failures", "9" * 5000], REFUSED
    yield ["schema", "x" * 10_000], REFUSED
    yield ["list", "x" * 10_000], REFUSED
    yield ["import", "x" * 5000, "--list"], REFUSED
    yield ["import", "/dev/zero", "--list"], REFUSED
    yield ["import", "/dev/zero", "--out", "out"], REFUSED
    yield ["import", ".", "--list"], REFUSED
    yield ["protocol", "hospital", "--repetitions", "1000000000"], REFUSED
    yield ["protocol", "hospital", "--out", "/dev/full"], REFUSED
    yield ["map", "hall", "--seed", "9223372036854775808"], REFUSED
    yield ["barn", "x"], REFUSED
    yield ["run", "barn", "--worlds", "999999999999999999999", "--out", "out"], REFUSED
    yield ["run", "barn", "--worlds", "-2", "--out", "out"], REFUSED
