"""What may be wrong with any file: its text, its encoding, what kind of file it is."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

from fault_sections.hostile.good import MAP, before_tables
from fault_sections.hostile.lines import as_given

HARMLESS = ("a comment of 1 MB", "a byte order mark", "Windows line ends")


def broken_texts(good: str) -> Iterator[tuple[str, str | bytes]]:
    """What may be wrong with any TOML file."""
    deep = 100_000
    put = before_tables
    yield "empty", ""
    yield "NUL bytes", b"\0" * 1000
    yield "not UTF-8", good.encode() + b'x = "\xff\xfe"\n'
    yield "UTF-16", good.encode("utf-16")
    yield "a byte order mark", b"\xef\xbb\xbf" + good.encode()
    yield "Windows line ends", good.replace("\n", "\r\n")
    yield "cut in the middle of a line", good[: len(good) // 2] + '"'
    yield "nested arrays", put(good, f"x = {'[' * deep}{']' * deep}")
    yield "nested arrays without an end", put(good, f"x = {'[' * deep}")
    yield "nested inline tables", put(good, f"x = {'{a=' * deep}1{'}' * deep}")
    yield "a dotted key of 100,000 parts", put(good, f"x{'.a' * deep} = 1")
    yield "a dotted key of 900 parts", put(good, f"x{'.a' * 900} = 1")
    yield "a dotted header of 100,000 parts", f"{good}\n[x{'.a' * deep}]\n"
    yield "nested arrays of tables", good + "".join(f"\n[[x{'.a' * k}]]" for k in range(1, 600))
    yield "a number of 5,000 digits", put(good, f"x = {'9' * 5000}")
    yield "a number of 4,000 digits", put(good, f"title = {'9' * 4000}")
    yield "a hexadecimal number of 100,000 digits", put(good, f"x = 0x{'f' * 100_000}")
    yield "a decimal fraction of 100,000 digits", put(good, f"x = 0.{'9' * 100_000}")
    yield "an exponent of 10^9", put(good, "x = 1e1000000000")
    yield "an impossible date", put(good, "x = 2021-02-30")
    yield "an impossible time", put(good, "x = 2021-02-03T25:61:61")
    yield "an impossible time zone", put(good, "x = 2021-02-03T12:00:00+99:99")
    yield "a date of year 0", put(good, "x = 0000-01-01")
    yield "a key of 1 MB", put(good, f"{'k' * 1_000_000} = 1")
    yield "a text of 3 MB for the name", good.replace("name", f'title = "{"x" * 3_000_000}"\nname', 1) + "\nx = 1\n"
    yield "a million keys", "".join(f"k{n} = 1\n" for n in range(400_000)) + good
    yield "a million array elements", put(good, f"x = [{'0,' * 1_000_000}]")
    yield "a million empty arrays", put(good, f"x = [{'[],' * 1_000_000}]")
    yield "half a million tables", good + "\n[[x]]" * 500_000
    yield "a comment of 1 MB", good + "\n# " + "x" * 1_000_000
    yield "a comment of 100 MB", good.encode() + b"\n#" + b"x" * 100_000_000
    yield "a text without an end", put(good, 'x = """' + '\\"""' * 300_000)
    yield "a key twice", put(good, "x = 1\nx = 2")
    yield "a surrogate by escape", put(good, 'x = "\\ud800"')
    yield "a table for every value", good.replace("= ", "= { a = 1 } #")
    yield "a date for every value", good.replace("= ", "= 2020-01-01 #")
    yield "true for every value", good.replace("= ", "= true #")
    yield "inf for every value", good.replace("= ", "= inf #")
    yield "nan for every value", good.replace("= ", "= nan #")
    yield "an empty array for every value", good.replace("= ", "= [] #")
    yield "an empty text for every value", good.replace("= ", '= "" #')
    yield "10^18 for every value", good.replace("= ", "= 1000000000000000000 #")
    yield "a nested array for every value", good.replace("= ", "= [[[[[1]]]]] #")


def kinds_of_file() -> Iterator[tuple[str, Callable[[Path], list[str]]]]:
    for suffix in ("toml", "yaml"):

        def fifo(folder: Path, suffix: str = suffix) -> list[str]:
            os.mkfifo(folder / f"x.{suffix}")
            return ["check", f"x.{suffix}"]

        def directory(folder: Path, suffix: str = suffix) -> list[str]:
            (folder / f"x.{suffix}").mkdir()
            return ["check", f"x.{suffix}"]

        def loop(folder: Path, suffix: str = suffix) -> list[str]:
            (folder / f"x.{suffix}").symlink_to(folder / f"x.{suffix}")
            return ["check", f"x.{suffix}"]

        def dangling(folder: Path, suffix: str = suffix) -> list[str]:
            (folder / f"x.{suffix}").symlink_to(folder / "nowhere")
            return ["check", f"x.{suffix}"]

        yield f"a FIFO as {suffix}", fifo
        yield f"a directory as {suffix}", directory
        yield f"a link to itself as {suffix}", loop
        yield f"a link to nothing as {suffix}", dangling
        for device in ("/dev/zero", "/dev/tty", "/dev/null", "/proc/self/mem", "/proc/kmsg"):

            def link(folder: Path, suffix: str = suffix, device: str = device) -> list[str]:
                (folder / f"x.{suffix}").symlink_to(device)
                return ["check", f"x.{suffix}"]

            yield f"{device} as {suffix}", link
        yield f"a name of 5,000 characters as {suffix}", as_given(["check", f"{'x' * 5000}.{suffix}"])
        yield f"a path of 5,000 folders as {suffix}", as_given(["check", f"{'x/' * 5000}y.{suffix}"])

    def test_plan(folder: Path) -> list[str]:
        os.mkfifo(folder / "x.toml")
        return ["score", "x.toml", "--out", "out"]

    yield "a FIFO as test plan", test_plan

    def sheet(folder: Path) -> list[str]:
        os.mkfifo(folder / "x.toml")
        return ["protocol", "x.toml"]

    yield "a FIFO as suite for a protocol", sheet

    def image(folder: Path) -> list[str]:
        (folder / "map.yaml").write_text(MAP)
        os.mkfifo(folder / "map.pgm")
        return ["check", "map.yaml"]

    yield "a FIFO as image", image

    def zero(folder: Path) -> list[str]:
        (folder / "map.yaml").write_text(MAP.replace("map.pgm", "/dev/zero"))
        return ["check", "map.yaml"]

    yield "/dev/zero as image", zero

    def campaign(folder: Path) -> list[str]:
        os.mkfifo(folder / "campaign.json")
        return ["report", "."]

    yield "a FIFO as campaign.json", campaign

    def device(folder: Path) -> list[str]:
        (folder / "campaign.json").symlink_to("/dev/zero")
        return ["report", "."]

    yield "/dev/zero as campaign.json", device

    def recording(folder: Path) -> list[str]:
        os.mkfifo(folder / "x.csv")
        return ["import", "x.csv", "--list"]

    yield "a FIFO as recording", recording

    def beside(folder: Path) -> list[str]:
        (folder / "x.csv").write_text("t,x,y\n0,0,0\n1,1,1\n2,2,2\n")
        os.mkfifo(folder / "x.csv.toml")
        return ["import", "x.csv", "--list"]

    yield "a FIFO beside a recording", beside
